//! Sets and surfaces of an input file, resolved to their members.

use std::collections::BTreeMap;
use std::path::Path;

use crate::content::{ElementKind, Face, Labels, MeshFile};
use crate::error::{Error, line_error};
use crate::shape::ElementShape;

/// Kind of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SetKind {
    Nodes,
    Elements,
    /// Node set of the nodes of elements.
    NodesOfElements,
    /// Surface of the faces of elements.
    Faces,
}

/// A data line of a set.
#[derive(Debug)]
pub(super) enum SetEntry {
    Label(u64),
    Range([u64; 3]),
    Set(String),
    /// A label or set of elements and a side, or `None` for outer sides.
    Side(Box<SetEntry>, Option<u8>),
}

/// A set as written in the file.
#[derive(Debug)]
pub(super) struct FileSet {
    pub name: String,
    pub kind: SetKind,
    pub entries: Vec<(usize, SetEntry)>,
}

impl SetEntry {
    pub fn parse(word: &str) -> Self {
        // Abaqus writes INSTANCE.SET for sets of a part
        let name = || word.rsplit('.').next().unwrap_or(word).trim_matches('"').to_owned();
        word.parse().map_or_else(|_| Self::Set(name()), Self::Label)
    }
}

/// Resolves sets to their members, once all are known.
pub(super) struct Resolver<'a> {
    pub path: &'a Path,
    pub nodes: &'a Labels,
    pub elements: &'a Labels,
    /// True for a file without solids, whose plane elements have their edges as sides.
    pub is_plane: bool,
    /// Limit on further members, in proportion to the file, so that nested sets and ranges cannot grow
    /// without bound.
    pub budget: usize,
}

impl Resolver<'_> {
    /// Resolves all sets into `content`.
    ///
    /// # Errors
    /// [`Error::File`] for members that do not exist or are too many.
    pub fn resolve(&mut self, sets: Vec<FileSet>, content: &mut MeshFile) -> Result<(), Error> {
        // names in upper case, with the letter case of their first use
        let mut node_sets: BTreeMap<String, (String, Vec<u32>)> = BTreeMap::new();
        let mut element_sets: BTreeMap<String, (String, Vec<u32>)> = BTreeMap::new();
        let mut faces: BTreeMap<String, (String, Vec<Face>)> = BTreeMap::new();
        let mut outer = None;
        for set in sets {
            let key = set.name.to_uppercase();
            match set.kind {
                SetKind::Nodes => {
                    let mut members = Vec::new();
                    for (line, entry) in &set.entries {
                        self.members(*line, entry, self.nodes, &node_sets, "node", &mut members)?;
                    }
                    node_sets.entry(key).or_insert((set.name, Vec::new())).1.append(&mut members);
                }
                SetKind::Elements => {
                    let mut members = Vec::new();
                    for (line, entry) in &set.entries {
                        self.members(*line, entry, self.elements, &element_sets, "element", &mut members)?;
                    }
                    element_sets.entry(key).or_insert((set.name, Vec::new())).1.append(&mut members);
                }
                SetKind::NodesOfElements => {
                    let mut members = Vec::new();
                    for (line, entry) in &set.entries {
                        self.members(*line, entry, self.elements, &element_sets, "element", &mut members)?;
                    }
                    self.count_work(set.entries.first().map_or(0, |entry| entry.0), 8 * members.len())?;
                    let elements = members.iter().map(|place| &content.elements[*place as usize]);
                    let nodes = elements
                        .flat_map(|element| content.labels_of(element))
                        .filter_map(|label| self.nodes.get(*label))
                        .collect();
                    node_sets.entry(key).or_insert((set.name, Vec::new())).1.append(&mut { nodes });
                }
                SetKind::Faces => {
                    let mut found = Vec::new();
                    for (line, entry) in &set.entries {
                        let SetEntry::Side(entry, side) = entry else { continue };
                        let mut members = Vec::new();
                        self.members(*line, entry, self.elements, &element_sets, "element", &mut members)?;
                        self.sides(*line, &members, *side, content, &mut outer, &mut found)?;
                    }
                    faces.entry(key).or_insert((set.name, Vec::new())).1.append(&mut found);
                }
            }
        }
        content.node_sets = node_sets.into_values().collect();
        content.element_sets = element_sets.into_values().collect();
        content.surfaces = faces.into_values().collect();
        Ok(())
    }

    fn count_work(&mut self, line: usize, count: usize) -> Result<(), Error> {
        match self.budget.checked_sub(count) {
            Some(left) => {
                self.budget = left;
                Ok(())
            }
            None => {
                let allowed = "16 a byte of the file in all";
                Err(line_error(self.path, line, "members of sets", count, allowed))
            }
        }
    }

    /// Collects the indices of the members of an entry.
    fn members(
        &mut self,
        line: usize,
        entry: &SetEntry,
        labels: &Labels,
        sets: &BTreeMap<String, (String, Vec<u32>)>,
        kind: &str,
        members: &mut Vec<u32>,
    ) -> Result<(), Error> {
        match entry {
            SetEntry::Label(label) => {
                self.count_work(line, 1)?;
                members.push(labels.get(*label).ok_or_else(|| {
                    line_error(self.path, line, format!("member of a set of {kind}s"), label, "existing ones")
                })?);
            }
            SetEntry::Range([first, last, step]) => {
                let inside = labels.range(*first, *last);
                self.count_work(line, inside.len().saturating_add(1))?;
                let on = inside.iter().filter(|entry| (entry.0 - first).is_multiple_of(*step));
                members.extend(on.map(|entry| entry.1));
            }
            SetEntry::Set(name) => {
                let Some((_, set)) = sets.get(&name.to_uppercase()) else {
                    let mut names: Vec<&str> = sets.values().take(20).map(|set| set.0.as_str()).collect();
                    if names.is_empty() {
                        names.push("none so far");
                    }
                    let allowed = format!("numbers, and {kind} sets above: {}", names.join(", "));
                    return Err(line_error(self.path, line, format!("{kind} set"), name, allowed));
                };
                self.count_work(line, set.len().saturating_add(1))?;
                members.extend_from_slice(set);
            }
            SetEntry::Side(entry, _) => self.members(line, entry, labels, sets, kind, members)?,
        }
        Ok(())
    }

    /// Collects sides of elements; outer sides if none is given.
    fn sides(
        &mut self,
        line: usize,
        members: &[u32],
        side: Option<u8>,
        content: &MeshFile,
        outer: &mut Option<BTreeMap<u32, Vec<u8>>>,
        found: &mut Vec<Face>,
    ) -> Result<(), Error> {
        self.count_work(line, 6 * members.len())?;
        for place in members {
            let element = &content.elements[*place as usize];
            let sides = side_count(element.kind, self.is_plane);
            match side {
                Some(side) if side < sides => found.push(Face { element: *place, side }),
                Some(side) => {
                    let allowed = match sides {
                        0 => "sides of hexahedra, tetrahedra and wedges, of plane elements without these"
                            .into(),
                        sides => format!("S1 … S{sides}"),
                    };
                    let what = format!("side of element {}", element.label);
                    return Err(line_error(self.path, line, what, format!("S{}", side + 1), allowed));
                }
                None => {
                    let outer = match outer {
                        Some(outer) => outer,
                        None => outer.insert(outer_sides(content, self.is_plane)),
                    };
                    let sides = outer.get(place).map_or(&[][..], Vec::as_slice);
                    found.extend(sides.iter().map(|side| Face { element: *place, side: *side }));
                }
            }
        }
        Ok(())
    }
}

/// Returns the number of sides of an element: faces of solids, in a plane mesh edges of plane elements.
fn side_count(kind: ElementKind, is_plane: bool) -> u8 {
    let edges = kind.facet().filter(|_| is_plane).map_or(0, |corners| corners as u8);
    kind.solid().map_or(edges, ElementShape::side_count)
}

/// Returns the sides of elements that no other shares, by the element's index.
fn outer_sides(content: &MeshFile, is_plane: bool) -> BTreeMap<u32, Vec<u8>> {
    let mut sides: Vec<([u64; 4], Face)> = Vec::new();
    for (place, element) in (0u32..).zip(&content.elements) {
        let labels = content.labels_of(element);
        let count = side_count(element.kind, is_plane);
        for side in 0..count {
            let edge = [usize::from(side), usize::from((side + 1) % count)];
            let corners = element.kind.solid().map_or(&edge[..], |shape| shape.side(side));
            let mut key = [u64::MAX; 4];
            key.iter_mut().zip(corners).for_each(|(key, &corner)| *key = labels[corner]);
            key.sort_unstable();
            sides.push((key, Face { element: place, side }));
        }
    }
    sides.sort_unstable();
    let mut outer: BTreeMap<u32, Vec<u8>> = BTreeMap::new();
    for group in sides.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, face)] = group {
            outer.entry(face.element).or_default().push(face.side);
        }
    }
    outer.values_mut().for_each(|sides| sides.sort_unstable());
    outer
}
