//! Reads Gmsh's MSH 2 and 4, ASCII and binary of either byte order
//! (<https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format>).
//!
//! An own reader, because `mshio` 0.4 does not read physical names and panics (`unimplemented!`, `expect`) on
//! unexpected sizes and digits.

use std::collections::BTreeMap;
use std::path::Path;

use crate::content::{ElementKind, FileElement, FileNode, Labels, MeshFile};
use crate::error::Error;
use crate::shape::ElementShape;

mod numbers;
mod version2;

use numbers::{Numbers, Version};

/// Reads a file. Physical groups of volumes and surfaces become element sets, those of surfaces, curves and
/// points also node sets; a group without a name is called `physical-TAG`. Supported solids are hexahedra (8
/// or 20 nodes), tetrahedra (4 or 10) and prisms (6 or 15); for 27 and 18 nodes those at the centres of sides
/// and elements are left out.
///
/// # Errors
/// [`Error::Shared`] if the file cannot be read; [`Error::File`] with the line (in binary files the section's
/// line and the byte) for files that are not MSH 2 or 4, other elements, and numbers that do not fit. Memory
/// is bounded by the size of the file, not by the counts that it announces.
pub fn read(path: &Path) -> Result<MeshFile, Error> {
    parse(path, &crate::error::read_bytes(path)?)
}

/// Reads bytes; `path` is for messages only.
///
/// # Errors
/// Errors of [`read`].
pub fn parse(path: &Path, bytes: &[u8]) -> Result<MeshFile, Error> {
    let mut reader = MshReader {
        content: MeshFile::default(),
        names: BTreeMap::new(),
        groups: BTreeMap::new(),
        members: bytes.len().saturating_mul(16),
        version: Version::FourOne,
        reduced: 0,
    };
    let mut numbers = Numbers::new(path, bytes);
    reader.version = numbers.header()?;
    let mut skipped: BTreeMap<String, usize> = BTreeMap::new();
    while let Some(section) = numbers.section()? {
        match section.as_str() {
            "PhysicalNames" => reader.physical_names(&mut numbers)?,
            "Nodes" if reader.version == Version::Two => reader.nodes_version2(&mut numbers)?,
            "Elements" if reader.version == Version::Two => reader.elements_version2(&mut numbers)?,
            "Entities" => reader.entities(&mut numbers)?,
            "Nodes" => reader.nodes(&mut numbers)?,
            "Elements" => reader.elements(&mut numbers)?,
            "PartitionedEntities" => {
                return Err(numbers.error("section", "$PartitionedEntities", "a mesh in one partition"));
            }
            _ => {
                numbers.skip(&section)?;
                *skipped.entry(section).or_default() += 1;
                continue;
            }
        }
        numbers.end(&section)?;
    }
    for (section, count) in skipped {
        reader.content.notes.push(format!("{count} × section ${section}: not used"));
    }
    if reader.reduced > 0 {
        let count = reader.reduced;
        let note = format!(
            "{count} elements of complete second order: nodes in the middles of sides and elements are left \
             out"
        );
        reader.content.notes.push(note);
    }
    let [nodes, _] = reader.content.labels(path)?;
    reader.name_nodes(&nodes);
    reader.content.number_nodes(path, &nodes)?;
    Ok(reader.content)
}

struct MshReader {
    content: MeshFile,
    /// Name of a physical group by dimension and tag.
    names: BTreeMap<(i64, i64), String>,
    /// Physical groups of an entity by dimension and tag.
    groups: BTreeMap<(i64, i64), Vec<i64>>,
    /// Limit on further members of groups: sixteen a byte, so that memory is bounded by the size of the file.
    members: usize,
    version: Version,
    /// Number of elements of complete second order.
    reduced: usize,
}

/// Element kinds by their number in the format.
const KINDS: [(i64, ElementKind); 16] = [
    (1, ElementKind::Line),
    (2, ElementKind::Triangle),
    (3, ElementKind::Quadrangle),
    (4, ElementKind::Solid(ElementShape::Tetrahedron)),
    (5, ElementKind::Solid(ElementShape::Hexahedron)),
    (6, ElementKind::Solid(ElementShape::Wedge)),
    (8, ElementKind::Line3),
    (9, ElementKind::Triangle6),
    (11, ElementKind::Solid(ElementShape::Tetrahedron10)),
    (15, ElementKind::Point),
    (16, ElementKind::Quadrangle8),
    (17, ElementKind::Solid(ElementShape::Hexahedron20)),
    (18, ElementKind::Solid(ElementShape::Wedge15)),
    // of complete second order
    (10, ElementKind::Quadrangle8),
    (12, ElementKind::Solid(ElementShape::Hexahedron20)),
    (13, ElementKind::Solid(ElementShape::Wedge15)),
];

/// Additional nodes of elements of complete second order: quadrangles, hexahedra, prisms.
const EXTRA_NODES: [(i64, usize); 3] = [(10, 1), (12, 7), (13, 3)];

impl MshReader {
    /// Reads `count`, then lines of dimension, tag and "name"; text in binary files too.
    fn physical_names(&mut self, numbers: &mut Numbers) -> Result<(), Error> {
        let line = numbers.text_line();
        let Ok(count) = line.trim().parse::<u64>() else {
            return Err(numbers.error("number of physical names", line, "a count"));
        };
        for _ in 0..count {
            let line = numbers.text_line();
            let mut parts = line.trim().splitn(3, char::is_whitespace);
            let mut tag = || parts.next().and_then(|part| part.parse::<i64>().ok());
            let (Some(dimension), Some(tag)) = (tag(), tag()) else {
                return Err(numbers.error("physical name", line, "dimension, tag, \"name\""));
            };
            let name = parts.next().unwrap_or("").trim().trim_matches('"');
            if name.is_empty() {
                return Err(numbers.error("physical name", line, "dimension, tag, \"name\""));
            }
            self.names.insert((dimension, tag), name.to_owned());
        }
        Ok(())
    }

    /// Reads the physical groups of each entity.
    fn entities(&mut self, numbers: &mut Numbers) -> Result<(), Error> {
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = numbers.size("number of entities")?;
        }
        for (dimension, count) in (0..).zip(counts) {
            for _ in 0..count {
                let tag = numbers.int("tag of an entity")?;
                // a point has a position, other entities a box; in 4.0 each has a box
                for _ in 0..if dimension == 0 && self.version == Version::FourOne { 3 } else { 6 } {
                    numbers.double("place of an entity")?;
                }
                let mut groups = Vec::new();
                for _ in 0..numbers.size("number of physical groups")? {
                    // the sign is an orientation
                    groups.push(numbers.int("physical group")?.abs());
                }
                if dimension > 0 {
                    for _ in 0..numbers.size("number of bounding entities")? {
                        numbers.int("bounding entity")?;
                    }
                }
                self.groups.insert((dimension, tag), groups);
            }
        }
        Ok(())
    }

    fn nodes(&mut self, numbers: &mut Numbers) -> Result<(), Error> {
        let [blocks, count] = self.counts(numbers)?;
        let before = self.content.nodes.len();
        for _ in 0..blocks {
            let [dimension, _] = self.entity(numbers)?;
            let parametric = numbers.int("parametric (0 or 1)")?;
            let parameters = match (parametric, dimension) {
                (0, _) => 0,
                (1, 0..=3) => dimension,
                _ => {
                    return Err(numbers.error(
                        "parametric coordinates",
                        parametric,
                        "0, or 1 in dimension 0 … 3",
                    ));
                }
            };
            let first = self.content.nodes.len();
            let own = numbers.size("number of nodes")?;
            if self.version == Version::Four {
                for _ in 0..own {
                    let (label, point) = (read_label(numbers, "number of a node")?, place(numbers)?);
                    for _ in 0..parameters {
                        numbers.double("parametric coordinate")?;
                    }
                    self.content.nodes.push(FileNode { label, line: numbers.line(), point });
                }
                continue;
            }
            for _ in 0..own {
                let label = numbers.size("number of a node")?;
                self.content.nodes.push(FileNode { label, line: numbers.line(), point: [0.0; 3] });
            }
            for node in first..self.content.nodes.len() {
                self.content.nodes[node].point = place(numbers)?;
                for _ in 0..parameters {
                    numbers.double("parametric coordinate")?;
                }
            }
        }
        let found = self.content.nodes.len() - before;
        if found as u64 != count {
            return Err(numbers.error("number of nodes", found, format!("{count}, as announced")));
        }
        Ok(())
    }

    fn elements(&mut self, numbers: &mut Numbers) -> Result<(), Error> {
        let [blocks, count] = self.counts(numbers)?;
        let before = self.content.elements.len();
        for _ in 0..blocks {
            let [dimension, tag] = self.entity(numbers)?;
            let code = numbers.int("type of elements")?;
            let kind = kind_of(numbers, code)?;
            let first = self.content.elements.len();
            for _ in 0..numbers.size("number of elements")? {
                if self.version == Version::Four {
                    let label = read_label(numbers, "number of an element")?;
                    self.element(numbers, label, code, kind, |numbers| {
                        read_label(numbers, "node of an element")
                    })?;
                } else {
                    let label = numbers.size("number of an element")?;
                    self.element(numbers, label, code, kind, |numbers| numbers.size("node of an element"))?;
                }
            }
            let places = first as u32..self.content.elements.len() as u32;
            let groups = self.groups.get(&(dimension, tag)).cloned().unwrap_or_default();
            for group in groups {
                self.add_to(numbers, dimension, group, places.clone())?;
            }
        }
        let found = self.content.elements.len() - before;
        if found as u64 != count {
            return Err(numbers.error("number of elements", found, format!("{count}, as announced")));
        }
        Ok(())
    }

    /// Reads the number of blocks and of members of a section; 4.1 has the smallest and largest tags, too.
    fn counts(&self, numbers: &mut Numbers) -> Result<[u64; 2], Error> {
        if self.version == Version::FourOne {
            return numbers.four_sizes().map(|[blocks, count, _, _]| [blocks, count]);
        }
        Ok([numbers.size("number of blocks")?, numbers.size("number of all")?])
    }

    /// Reads dimension and tag of an entity; 4.0 has the tag first.
    fn entity(&self, numbers: &mut Numbers) -> Result<[i64; 2], Error> {
        if self.version == Version::Four {
            let tag = numbers.int("tag of an entity")?;
            return Ok([numbers.int("dimension of an entity")?, tag]);
        }
        Ok([numbers.int("dimension of an entity")?, numbers.int("tag of an entity")?])
    }

    /// Reads an element after its label.
    fn element(
        &mut self,
        numbers: &mut Numbers,
        label: u64,
        code: i64,
        kind: ElementKind,
        node: impl Fn(&mut Numbers) -> Result<u64, Error>,
    ) -> Result<(), Error> {
        let mut nodes = [0; 20];
        for own in &mut nodes[..kind.node_count()] {
            *own = node(numbers)?;
        }
        let more = EXTRA_NODES.iter().find(|more| more.0 == code).map_or(0, |more| more.1);
        for _ in 0..more {
            node(numbers)?;
        }
        self.reduced += usize::from(more > 0 && kind.solid().is_some());
        let first = self.content.element_labels.len();
        let all = &mut self.content.element_labels;
        match kind.solid() {
            Some(shape) => all.extend(shape.gmsh().iter().map(|&place| nodes[place])),
            None => all.extend(&nodes[..kind.node_count()]),
        }
        self.content.elements.push(FileElement { label, line: numbers.line(), kind, first });
        Ok(())
    }

    /// Adds an element to a physical group.
    fn add_to(
        &mut self,
        numbers: &Numbers,
        dimension: i64,
        group: i64,
        places: std::ops::Range<u32>,
    ) -> Result<(), Error> {
        let Some(left) = self.members.checked_sub(places.len().max(1)) else {
            return Err(numbers.error(
                "members of physical groups",
                places.len(),
                "16 a byte of the file in all",
            ));
        };
        self.members = left;
        let name = self.names.get(&(dimension, group)).cloned();
        let name = name.unwrap_or_else(|| format!("physical-{group}"));
        self.content.element_sets.entry(name).or_default().extend(places);
        Ok(())
    }

    /// Builds node sets of the groups of points, curves and surfaces.
    fn name_nodes(&mut self, nodes: &Labels) {
        let MeshFile { elements, element_labels, element_sets, node_sets, curve_sets, .. } =
            &mut self.content;
        element_sets.retain(|name, places| {
            let low = |kind: ElementKind| kind.solid().is_none();
            let members = places.iter().map(|place| &elements[*place as usize]);
            let set: Vec<u32> = members
                .clone()
                .filter(|element| low(element.kind))
                .flat_map(|element| &element_labels[element.first..element.first + element.kind.node_count()])
                .filter_map(|label| nodes.get(*label))
                .collect();
            if !set.is_empty() {
                node_sets.entry(name.clone()).or_default().extend(set);
            }
            let thin = members.into_iter().all(|element| {
                matches!(element.kind, ElementKind::Line | ElementKind::Line3 | ElementKind::Point)
            });
            if thin {
                curve_sets.insert(name.clone(), std::mem::take(places));
            }
            !thin
        });
    }
}

/// Returns the kind of an element type.
fn kind_of(numbers: &Numbers, code: i64) -> Result<ElementKind, Error> {
    KINDS.iter().find(|kind| kind.0 == code).map(|kind| kind.1).ok_or_else(|| {
        let pyramids = if matches!(code, 7 | 14 | 19) { " (pyramids are none)" } else { "" };
        let allowed = format!(
            "1, 8 (lines), 2, 9 (triangles), 3, 16, 10 (quadrangles), 4, 11 (tetrahedra), 5, 17, 12 \
             (hexahedra), 6, 18, 13 (prisms), 15 (point){pyramids}; in Gmsh: Mesh.ElementOrder = 1 or 2"
        );
        numbers.error("type of elements", code, allowed)
    })
}

/// Reads a position, after the label of a node.
fn place(numbers: &mut Numbers) -> Result<[f64; 3], Error> {
    let mut point = [0.0; 3];
    for x in &mut point {
        *x = numbers.double("coordinate")?;
        if !x.is_finite() {
            return Err(numbers.error("coordinate", *x, "a finite number"));
        }
    }
    Ok(point)
}

/// Reads a label of a node or an element stored in four bytes.
fn read_label(numbers: &mut Numbers, what: &str) -> Result<u64, Error> {
    let number = numbers.int(what)?;
    u64::try_from(number).map_err(|_| numbers.error(what, number, "0 or more"))
}
