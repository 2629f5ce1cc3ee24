//! Converts labelled nodes and elements of a file to a [`Mesh`].

use std::collections::BTreeMap;
use std::path::Path;

use crate::error::Error;
use crate::file::line_error;
use crate::mesh::quality::{self, Quality};
use crate::mesh::{Cell, ElementShape, Face, Mesh};

/// A checked mesh from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadMesh {
    /// Mesh with nodes and elements in the order of the file, 8-node hexahedra before 4-node tetrahedra
    /// before others, without unused nodes.
    pub mesh: Mesh,
    /// Label of each node in the file.
    pub node_labels: Vec<u64>,
    /// Label of each element in the file.
    pub element_labels: Vec<u64>,
    /// Result of [`quality::check`].
    pub quality: Quality,
    /// Notes for the user: omissions and doubtful input.
    pub notes: Vec<String>,
}

/// Element kinds in files: solids, and kinds that only name faces and nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ElementKind {
    Solid(ElementShape),
    Quadrangle,
    Triangle,
    /// Quadrangle with mid-edge nodes.
    Quadrangle8,
    Triangle6,
    Line,
    Line3,
    Point,
}

impl ElementKind {
    pub fn node_count(self) -> usize {
        match self {
            Self::Solid(shape) => shape.nodes(),
            Self::Quadrangle8 => 8,
            Self::Triangle6 => 6,
            Self::Quadrangle => 4,
            Self::Triangle | Self::Line3 => 3,
            Self::Line => 2,
            Self::Point => 1,
        }
    }

    /// Element type of a solid.
    pub fn solid(self) -> Option<ElementShape> {
        if let Self::Solid(shape) = self { Some(shape) } else { None }
    }

    /// Number of corners of a triangle or quadrangle.
    fn facet(self) -> Option<usize> {
        match self {
            Self::Quadrangle | Self::Quadrangle8 => Some(4),
            Self::Triangle | Self::Triangle6 => Some(3),
            _ => None,
        }
    }
}

/// An element of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct FileElement {
    pub label: u64,
    pub line: u32,
    pub kind: ElementKind,
    /// Index of its first node in [`FileContent::element_nodes`]; the kind gives their number.
    pub first: usize,
}

/// A node of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct FileNode {
    pub label: u64,
    pub line: u32,
    pub point: [f64; 3],
}

/// Content of a file. Members of sets are indices into `nodes` and `elements`.
#[derive(Debug, Default)]
pub(super) struct FileContent {
    pub nodes: Vec<FileNode>,
    pub elements: Vec<FileElement>,
    /// Labels of the nodes of all elements, in the node order of [`ElementShape`].
    pub element_nodes: Vec<u64>,
    pub node_sets: BTreeMap<String, Vec<u32>>,
    /// Element sets by name; their solids become an element set, their triangles and quadrangles a surface of
    /// the same name.
    pub element_sets: BTreeMap<String, Vec<u32>>,
    pub surfaces: BTreeMap<String, Vec<Face>>,
    pub notes: Vec<String>,
}

/// Indices of the labels of a file.
pub(super) struct Labels {
    sorted: Vec<(u64, u32)>,
}

impl Labels {
    /// Sorts labels.
    ///
    /// # Errors
    /// Both indices of a duplicate.
    pub fn new(labels: impl Iterator<Item = u64>) -> Result<Self, [u32; 2]> {
        let mut sorted: Vec<(u64, u32)> = labels.zip(0u32..).collect();
        // most files are in order already
        if !sorted.is_sorted() {
            sorted.sort_unstable();
        }
        match sorted.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            Some(pair) => Err([pair[0].1, pair[1].1]),
            None => Ok(Self { sorted }),
        }
    }

    pub fn get(&self, label: u64) -> Option<u32> {
        // labels without gaps are found at once
        let first = self.sorted.first()?.0;
        let guess = usize::try_from(label.checked_sub(first)?).ok()?;
        if let Some(entry) = self.sorted.get(guess)
            && entry.0 == label
        {
            return Some(entry.1);
        }
        self.sorted.binary_search_by_key(&label, |entry| entry.0).ok().map(|place| self.sorted[place].1)
    }

    /// Existing labels from `first` to `last`, with their indices.
    pub fn range(&self, first: u64, last: u64) -> &[(u64, u32)] {
        let start = self.sorted.partition_point(|entry| entry.0 < first);
        let end = self.sorted.partition_point(|entry| entry.0 <= last);
        self.sorted.get(start..end).unwrap_or(&[])
    }
}

impl FileContent {
    /// Labels of an element's nodes.
    pub fn nodes_of(&self, element: &FileElement) -> &[u64] {
        &self.element_nodes[element.first..element.first + element.kind.node_count()]
    }

    /// Indices of the labels of nodes and of elements.
    ///
    /// # Errors
    /// [`Error::File`] for a duplicate label.
    pub fn labels(&self, path: &Path) -> Result<[Labels; 2], Error> {
        let nodes = Labels::new(self.nodes.iter().map(|node| node.label)).map_err(|[a, b]| {
            let [a, b] = [a, b].map(|place| self.nodes[place as usize]);
            let allowed = format!("each number once; also on line {}", a.line);
            line_error(path, b.line as usize, "number of a node", b.label, allowed)
        })?;
        let elements = Labels::new(self.elements.iter().map(|element| element.label)).map_err(|[a, b]| {
            let [a, b] = [a, b].map(|place| self.elements[place as usize]);
            let allowed = format!("each number once; also on line {}", a.line);
            line_error(path, b.line as usize, "number of an element", b.label, allowed)
        })?;
        Ok([nodes, elements])
    }

    /// Converts to a mesh, with coordinates multiplied by `scale`; `nodes` come from [`Self::labels`].
    ///
    /// # Errors
    /// [`Error::Parameter`] for a scale that is not positive, [`Error::File`] for a missing node, and errors
    /// of [`quality::check`].
    pub fn into_mesh(mut self, path: &Path, nodes: &Labels, scale: f64) -> Result<ReadMesh, Error> {
        if !(scale > 0.0 && scale.is_finite()) {
            let allowed = "positive and finite, m per unit of the file".into();
            return Err(Error::Parameter { name: "scale of the mesh", found: scale, allowed });
        }
        let mut mesh = Mesh::default();
        mesh.points.extend(self.nodes.iter().map(|node| node.point.map(|x| scale * x)));
        mesh.node_sets = std::mem::take(&mut self.node_sets);
        // hexahedra, tetrahedra and others
        let mut labels = [const { Vec::new() }; 3];
        // index in the mesh, first within each of the three
        let mut number = vec![u32::MAX; self.elements.len()];
        let mut facets: Vec<([u32; 4], u32)> = Vec::new();
        let list = |shape| match shape {
            ElementShape::Hexahedron => 0,
            ElementShape::Tetrahedron => 1,
            _ => 2,
        };
        for (place, element) in self.elements.iter().enumerate() {
            let mut own = [u32::MAX; 20];
            for (own, label) in own.iter_mut().zip(self.nodes_of(element)) {
                *own = nodes.get(*label).ok_or_else(|| {
                    let what = format!("node of element {}", element.label);
                    line_error(path, element.line as usize, what, label, "nodes of this file")
                })?;
            }
            if let Some(shape) = element.kind.solid() {
                let labels = &mut labels[list(shape)];
                number[place] = labels.len() as u32;
                labels.push(element.label);
                match shape {
                    ElementShape::Hexahedron => mesh.hexahedra.extend(own.first_chunk::<8>()),
                    ElementShape::Tetrahedron => mesh.tetrahedra.extend(own.first_chunk::<4>()),
                    _ => mesh.others.extend(Cell::new(&own[..shape.nodes()])),
                }
            } else if let Some(corners) = element.kind.facet() {
                let mut key = [u32::MAX; 4];
                key[..corners].copy_from_slice(&own[..corners]);
                key.sort_unstable();
                facets.push((key, place as u32));
            }
        }
        let starts = [0, labels[0].len(), labels[0].len() + labels[1].len()];
        for (number, element) in number.iter_mut().zip(&self.elements) {
            *number += element.kind.solid().map_or(0, |shape| starts[list(shape)] as u32);
        }
        let element_labels = labels.concat();
        let face_of = self.match_facets(&mesh, facets);
        self.name_sets(&mut mesh, &number, &face_of);
        let kept = quality::drop_unused_nodes(&mut mesh);
        if kept.len() < self.nodes.len() {
            let unused = self.nodes.len() - kept.len();
            self.notes.push(format!(
                "{unused} nodes that belong to no hexahedron, tetrahedron or wedge are left out"
            ));
        }
        let notes = &mut self.notes;
        mesh.node_sets.retain(|name, set| {
            if set.is_empty() {
                notes.push(format!("node set `{name}` contains no node of the mesh: left out"));
            }
            !set.is_empty()
        });
        let quality = quality::check(&mesh, Some(&element_labels)).map_err(|error| match error {
            Error::Mesh(text) => Error::Mesh(format!("{}: {text}", path.display())),
            other => other,
        })?;
        self.notes.extend(quality.notes.iter().cloned());
        let node_labels = kept.iter().map(|node| self.nodes[*node as usize].label).collect();
        Ok(ReadMesh { mesh, node_labels, element_labels, quality, notes: self.notes })
    }

    /// Finds the face of a solid element for each triangle and quadrangle; the first of two.
    fn match_facets(&mut self, mesh: &Mesh, mut facets: Vec<([u32; 4], u32)>) -> BTreeMap<u32, Face> {
        facets.sort_unstable();
        let mut face_of = BTreeMap::new();
        if facets.is_empty() {
            return face_of;
        }
        for element in 0..mesh.element_count() as u32 {
            for side in 0..mesh.side_count(element) {
                let face = Face { element, side };
                let key = mesh.face_nodes(face).key();
                let first = facets.partition_point(|facet| facet.0 < key);
                for facet in facets[first..].iter().take_while(|facet| facet.0 == key) {
                    face_of.entry(facet.1).or_insert(face);
                }
            }
        }
        if face_of.len() < facets.len() {
            let missed = facets.len() - face_of.len();
            let first = facets.iter().find(|facet| !face_of.contains_key(&facet.1));
            let label = first.map_or(0, |facet| self.elements[facet.1 as usize].label);
            self.notes.push(format!(
                "{missed} triangles or quadrangles are not sides of a hexahedron, tetrahedron or wedge, \
                 element {label} first: left out"
            ));
        }
        face_of
    }

    /// Converts element sets and surfaces to the mesh's indices.
    fn name_sets(&mut self, mesh: &mut Mesh, number: &[u32], face_of: &BTreeMap<u32, Face>) {
        mesh.surfaces = std::mem::take(&mut self.surfaces);
        for faces in mesh.surfaces.values_mut() {
            faces.iter_mut().for_each(|face| face.element = number[face.element as usize]);
        }
        for (name, places) in std::mem::take(&mut self.element_sets) {
            let mut set: Vec<u32> =
                places.iter().map(|place| number[*place as usize]).filter(|n| *n != u32::MAX).collect();
            let faces: Vec<Face> = places.iter().filter_map(|place| face_of.get(place).copied()).collect();
            if set.is_empty() && faces.is_empty() {
                self.notes.push(format!(
                    "element set `{name}` contains no hexahedra, tetrahedra, wedges or sides of them: left \
                     out"
                ));
            }
            if !faces.is_empty() {
                mesh.surfaces.entry(name.clone()).or_default().extend(faces);
            }
            if !set.is_empty() {
                set.sort_unstable();
                set.dedup();
                mesh.element_sets.insert(name, set);
            }
        }
        for (name, faces) in &mut mesh.surfaces {
            faces.sort_unstable();
            faces.dedup();
            if faces.is_empty() {
                self.notes.push(format!("surface `{name}` contains no face: left out"));
            }
        }
        mesh.surfaces.retain(|_, faces| !faces.is_empty());
        for set in mesh.node_sets.values_mut() {
            set.sort_unstable();
            set.dedup();
        }
    }
}
