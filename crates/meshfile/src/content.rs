//! Content of a mesh file: nodes, elements and sets, as written there.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::error::{Error, line_error};
use crate::shape::ElementShape;

/// A face of an element: the element's index and the side, 0–5 of a hexahedron, 0–3 of a tetrahedron or 0–4
/// of a wedge, numbered as in Abaqus (S1 is side 0); in a file without solids an edge, 0–3 of a quadrangle or
/// 0–2 of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Face {
    /// Index of the element.
    pub element: u32,
    /// Side.
    pub side: u8,
}

/// Element kinds in files: solids, plane elements, lines and points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ElementKind {
    /// Solid.
    Solid(ElementShape),
    /// Quadrangle of four nodes.
    Quadrangle,
    /// Triangle of three nodes.
    Triangle,
    /// Quadrangle with mid-edge nodes.
    Quadrangle8,
    /// Triangle with mid-edge nodes.
    Triangle6,
    /// Line of two nodes.
    Line,
    /// Line with a node in its middle, the last one.
    Line3,
    /// Single node.
    Point,
}

impl ElementKind {
    /// Number of nodes.
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

    /// Dimension: 3 of solids, 2 of plane elements, 1 of lines, 0 of points.
    pub fn dimension(self) -> usize {
        match self {
            Self::Solid(_) => 3,
            Self::Point => 0,
            Self::Line | Self::Line3 => 1,
            _ => 2,
        }
    }

    /// Number of corners of a triangle or quadrangle.
    pub fn facet(self) -> Option<usize> {
        match self {
            Self::Quadrangle | Self::Quadrangle8 => Some(4),
            Self::Triangle | Self::Triangle6 => Some(3),
            _ => None,
        }
    }
}

/// An element of a file.
#[derive(Clone, Copy, Debug)]
pub struct FileElement {
    /// Number in the file.
    pub label: u64,
    /// Line of the file.
    pub line: u32,
    /// Kind.
    pub kind: ElementKind,
    /// Index of its first node in [`MeshFile::element_nodes`]; the kind gives their number.
    pub first: usize,
}

/// A node of a file.
#[derive(Clone, Copy, Debug)]
pub struct FileNode {
    /// Number in the file.
    pub label: u64,
    /// Line of the file.
    pub line: u32,
    /// Position, in the unit of the file.
    pub point: [f64; 3],
}

/// Content of a file. Members of sets are indices into `nodes` and `elements`.
#[derive(Debug, Default)]
pub struct MeshFile {
    /// Nodes in the order of the file.
    pub nodes: Vec<FileNode>,
    /// Elements in the order of the file.
    pub elements: Vec<FileElement>,
    /// Nodes of all elements, in the node order of [`ElementShape`].
    pub element_nodes: Vec<u32>,
    /// Labels of these nodes, until all nodes are known.
    pub(crate) element_labels: Vec<u64>,
    /// Sets of nodes by name.
    pub node_sets: BTreeMap<String, Vec<u32>>,
    /// Sets of elements by name: solids, plane elements, lines.
    pub element_sets: BTreeMap<String, Vec<u32>>,
    /// Physical groups of Gmsh that consist of curves and points; their nodes are also in `node_sets`.
    pub curve_sets: BTreeMap<String, Vec<u32>>,
    /// Sides of solids by name; in a file without solids edges of plane elements.
    pub surfaces: BTreeMap<String, Vec<Face>>,
    /// Files that this one includes, each once.
    pub included: Vec<PathBuf>,
    /// Notes for the user: omissions and doubtful input.
    pub notes: Vec<String>,
}

/// Indices of the labels of a file.
pub(crate) struct Labels {
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

    /// Returns the index of a label.
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

impl MeshFile {
    /// Nodes of an element.
    pub fn nodes_of(&self, element: &FileElement) -> &[u32] {
        &self.element_nodes[element.first..element.first + element.kind.node_count()]
    }

    /// Labels of an element's nodes, before [`Self::number_nodes`].
    pub(crate) fn labels_of(&self, element: &FileElement) -> &[u64] {
        &self.element_labels[element.first..element.first + element.kind.node_count()]
    }

    /// Replaces the labels of the nodes of elements by their indices.
    ///
    /// # Errors
    /// [`Error::File`] for a node that does not exist.
    pub(crate) fn number_nodes(&mut self, path: &Path, nodes: &Labels) -> Result<(), Error> {
        let mut numbers = Vec::with_capacity(self.element_labels.len());
        for element in &self.elements {
            for label in self.labels_of(element) {
                numbers.push(nodes.get(*label).ok_or_else(|| {
                    let what = format!("node of element {}", element.label);
                    line_error(path, element.line as usize, what, label, "nodes of this file")
                })?);
            }
        }
        self.element_nodes = numbers;
        self.element_labels = Vec::new();
        Ok(())
    }

    /// Indices of the labels of nodes and of elements.
    ///
    /// # Errors
    /// [`Error::File`] for a duplicate label.
    pub(crate) fn labels(&self, path: &Path) -> Result<[Labels; 2], Error> {
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
}
