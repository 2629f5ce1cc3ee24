//! Cells of a mesh file in the dimension of the body.

use super::values::positive;
use crate::geometry::{Facet, moments};
use harness::scene::{SceneError, Source};
use meshfile::{ElementKind, FileElement, MeshFile};
use polycore::units::Length;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A mesh file: solids in 3D, triangles and quadrangles in 2D; corners in m.
pub(super) struct CellMesh<const D: usize> {
    /// Path as in the scene.
    pub file: PathBuf,
    content: MeshFile,
    points: Vec<[f64; D]>,
    /// Elements of the dimension of the body, by their place in the file.
    cells: Vec<u32>,
    /// Facets of each of them.
    facets: Vec<Vec<Facet<D>>>,
}

/// Differences of z of a plane mesh, over its size, that are none: of seven digits, as programs write them.
const FLAT: f64 = 1e-6;

/// Number of cells that share a side, and the facets of the first of them.
type SharedSide<const D: usize> = (u32, Vec<Facet<D>>);

impl<const D: usize> CellMesh<D> {
    /// Reads and checks a file; `key` and `unit_key` are those of its name and its unit.
    ///
    /// # Errors
    /// A file that cannot be read, without cells of the body's dimension or with others, nodes off the plane
    /// of a plane body, cells that are inverted or without volume.
    pub fn read(
        source: &Source,
        key: &str,
        unit_key: &str,
        file: &Path,
        unit: Length,
    ) -> Result<Self, SceneError> {
        let scale = unit.si();
        positive(source, unit_key, scale, "m")?;
        let content = meshfile::read(&source.file(file), |_| None)
            .map_err(|error| source.refused(key, error.to_string()))?;
        for included in &content.included {
            // with its hash in the stamp of the scene
            source.file(included.strip_prefix(source.folder()).unwrap_or(included));
        }
        let points =
            content.nodes.iter().map(|node| std::array::from_fn(|d| scale * node.point[d])).collect();
        let (facets, file) = (Vec::new(), file.to_owned());
        let mut mesh = Self { file, content, points, cells: Vec::new(), facets };
        mesh.cells = mesh.cells_of(0..mesh.content.elements.len() as u32);
        mesh.check_dimension(source, key, scale)?;
        for &cell in &mesh.cells {
            let facets = mesh.facets_of_cell(source, key, cell)?;
            mesh.facets.push(facets);
        }
        Ok(mesh)
    }

    /// Path, for messages.
    pub fn path(&self) -> std::path::Display<'_> {
        self.file.display()
    }

    /// Places of all cells.
    pub fn cells(&self) -> &[u32] {
        &self.cells
    }

    /// Content of the file.
    pub fn content(&self) -> &MeshFile {
        &self.content
    }

    /// Position of a node, m.
    pub fn point(&self, node: u32) -> [f64; D] {
        self.points[node as usize]
    }

    /// Selects elements of the dimension of the body.
    pub fn cells_of(&self, places: impl IntoIterator<Item = u32>) -> Vec<u32> {
        let is_cell = |place: &u32| self.content.elements[*place as usize].kind.dimension() == D;
        let mut cells: Vec<u32> = places.into_iter().filter(is_cell).collect();
        // a set may name a cell twice
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    /// Names of the sets with cells.
    pub fn blocks(&self) -> Vec<&str> {
        let sets = self.content.element_sets.iter();
        let filled = sets.filter(|(_, places)| !self.cells_of(places.iter().copied()).is_empty());
        filled.map(|(name, _)| name.as_str()).collect()
    }

    /// Volumes (in 2D areas) and centroids of all cells.
    pub fn moments(&self) -> Vec<(f64, [f64; D])> {
        self.facets.iter().map(|facets| moments(facets)).collect()
    }

    /// Returns the facets around some cells, and the sum of their volumes.
    ///
    /// # Errors
    /// A side of more than two cells.
    pub fn boundary(&self, places: &[u32]) -> Result<(Vec<Facet<D>>, f64), String> {
        let mut sides: HashMap<[u32; 4], SharedSide<D>> = HashMap::new();
        let mut keys = Vec::new();
        let mut volume = 0.0;
        for &place in places {
            let element = &self.content.elements[place as usize];
            let flipped = self.is_clockwise(element);
            for side in sides_of(element.kind) {
                let (key, facets) = self.side(element, &side, flipped);
                let shared = sides.entry(key).or_insert_with(|| {
                    keys.push(key);
                    (0, facets)
                });
                shared.0 += 1;
                if shared.0 > 2 {
                    return Err(format!("a side of element {} belongs to three cells", element.label));
                }
            }
            let at = self.cells.binary_search(&place).map(|at| moments(&self.facets[at]).0);
            volume += at.unwrap_or(0.0);
        }
        let outer = keys.iter().filter_map(|key| sides.remove(key)).filter(|(count, _)| *count == 1);
        Ok((outer.flat_map(|(_, facets)| facets).collect(), volume))
    }

    /// Returns the facets of an element of one dimension less than the body.
    pub fn facets_of_side(&self, place: u32) -> Vec<Facet<D>> {
        let element = &self.content.elements[place as usize];
        let count = element.kind.facet().unwrap_or(2);
        let nodes = self.content.nodes_of(element);
        let (corners, middles) = nodes.split_at(count.min(nodes.len()));
        self.split(corners, middles)
    }

    /// Returns the facets of a side of a solid, numbered from 0 as in Abaqus.
    pub fn facets_of_face(&self, place: u32, side: u8) -> Vec<Facet<D>> {
        let element = &self.content.elements[place as usize];
        let sides = sides_of(element.kind);
        sides.get(usize::from(side)).map_or(Vec::new(), |side| self.side(element, side, false).1)
    }

    /// Refuses files without cells of the body's dimension, and plane bodies with others or off their plane.
    fn check_dimension(&self, source: &Source, key: &str, scale: f64) -> Result<(), SceneError> {
        let kinds = || self.content.elements.iter().map(|element| element.kind.dimension());
        let most = kinds().max().unwrap_or(0);
        let found = |what: &str| format!("{}, {what}", self.path());
        if most > D {
            let allowed = "triangles and quadrangles in a plane body; `space = \"solid\"` takes solids";
            return Err(source.error(key, found("a mesh of solids"), allowed));
        }
        if self.cells.is_empty() {
            let allowed = match D {
                2 => "at least one triangle or quadrangle for a plane body",
                _ => {
                    "at least one hexahedron, tetrahedron or wedge for a `solid`; plane bodies take triangles"
                }
            };
            let without =
                if most == 2 { "a mesh of triangles or quadrangles" } else { "a mesh without cells" };
            return Err(source.error(key, found(without), allowed));
        }
        let nodes = self.cells.iter().flat_map(|&cell| self.nodes(cell));
        let heights = nodes.map(|&node| self.content.nodes[node as usize].point[2]);
        let (low, high) = heights.fold((f64::MAX, f64::MIN), |(low, high), z| (low.min(z), high.max(z)));
        let size = |d: usize| {
            let along = self.points.iter().map(|point| point[d]);
            along.clone().fold(f64::MIN, f64::max) - along.fold(f64::MAX, f64::min)
        };
        // in the unit of the file
        let size = (0..D).map(size).fold(0.0, f64::max) / scale;
        if D == 2 && high - low > FLAT * size {
            let what = format!("nodes between z = {low} and {high}");
            return Err(source.error(key, found(&what), "nodes of a plane body at one z"));
        }
        Ok(())
    }

    fn nodes(&self, place: u32) -> &[u32] {
        self.content.nodes_of(&self.content.elements[place as usize])
    }

    /// Returns true for a plane cell with its nodes clockwise.
    fn is_clockwise(&self, element: &FileElement) -> bool {
        let (Some(count), 2) = (element.kind.facet(), D) else { return false };
        let at = |k: usize| self.point(self.content.nodes_of(element)[k % count]);
        let twice = |p: [f64; D], q: [f64; D]| p[0] * q[1] - p[1] * q[0];
        let offset = |k: usize| std::array::from_fn(|d| at(k)[d] - at(0)[d]);
        (0..count).map(|k| twice(offset(k), offset(k + 1))).sum::<f64>() < 0.0
    }

    /// Returns the facets of a cell.
    ///
    /// # Errors
    /// A volume that is not positive, a plane cell that is not convex.
    fn facets_of_cell(&self, source: &Source, key: &str, cell: u32) -> Result<Vec<Facet<D>>, SceneError> {
        let element = &self.content.elements[cell as usize];
        let flipped = self.is_clockwise(element);
        let sides = sides_of(element.kind);
        let facets: Vec<Facet<D>> =
            sides.iter().flat_map(|side| self.side(element, side, flipped).1).collect();
        let (volume, _) = moments(&facets);
        let place = || match element.line {
            // without lines
            0 => format!("{}: element {}", self.path(), element.label),
            line => format!("{}:{line}: element {}", self.path(), element.label),
        };
        if !(volume > 0.0 && volume.is_finite()) {
            let what = if D == 2 { "area" } else { "volume" };
            let found = format!("{}, inverted or without {what}: {volume:.3e} m^{D}", place());
            return Err(source.error(key, found, "cells with their nodes in the order of the format"));
        }
        if D == 2 {
            let corners: Vec<[f64; D]> =
                sides.iter().map(|side| self.point(self.nodes(cell)[side.0[0]])).collect();
            let count = corners.len();
            let turns = |k: usize| {
                let [p, q, r] = [corners[k], corners[(k + 1) % count], corners[(k + 2) % count]];
                let turn = (q[0] - p[0]) * (r[1] - q[1]) - (q[1] - p[1]) * (r[0] - q[0]);
                if flipped { -turn } else { turn }
            };
            if (0..count).any(|k| turns(k) <= 0.0) {
                let found = format!("{}, a cell that is not convex", place());
                return Err(source.error(key, found, "cells with their nodes in order around them"));
            }
        }
        Ok(facets)
    }

    /// Returns the sorted corners of a side, and its facets.
    pub fn side(&self, element: &FileElement, side: &LocalSide, flipped: bool) -> ([u32; 4], Vec<Facet<D>>) {
        let nodes = self.content.nodes_of(element);
        let [mut corners, mut middles] = [&side.0, &side.1].map(|local| {
            let global = local.iter().map(|&k| nodes[k]);
            global.collect::<Vec<u32>>()
        });
        if flipped {
            corners.reverse();
            middles.reverse();
        }
        let mut key = [u32::MAX; 4];
        key[..corners.len()].copy_from_slice(&corners);
        key.sort_unstable();
        (key, self.split(&corners, &middles))
    }

    /// Splits a side into facets, the same from both of its sides: corners in order, and the nodes between
    /// each and the next.
    fn split(&self, corners: &[u32], middles: &[u32]) -> Vec<Facet<D>> {
        let facet = |three: [[f64; D]; 3]| std::array::from_fn(|k| three[k.min(2)]);
        let at = |node: u32| self.point(node);
        let ring: Vec<u32> = (0..corners.len())
            .flat_map(|k| [Some(corners[k]), middles.get(k).copied()].into_iter().flatten())
            .collect();
        match (&ring[..], corners.len()) {
            // of lines the second corner is the end
            ([a, m, b], 2) => vec![facet([at(*a), at(*m), at(*m)]), facet([at(*m), at(*b), at(*b)])],
            ([a, b], _) => vec![facet([at(*a), at(*b), at(*b)])],
            ([a, b, c], _) => vec![facet([at(*a), at(*b), at(*c)])],
            ([a, p, b, q, c, r], 3) => {
                let each = [[a, p, r], [b, q, p], [c, r, q], [p, q, r]];
                each.map(|three| facet(three.map(|node| at(*node)))).into()
            }
            _ => {
                let mean = |nodes: &[u32]| -> [f64; D] {
                    let mut sorted = nodes.to_vec();
                    sorted.sort_unstable();
                    let sum = |d: usize| sorted.iter().map(|&node| at(node)[d]).sum::<f64>();
                    std::array::from_fn(|d| sum(d) / nodes.len() as f64)
                };
                let mut centre = mean(corners);
                if middles.len() == corners.len() {
                    // that of the shape functions of eight nodes
                    let between = mean(middles);
                    centre = std::array::from_fn(|d| 2.0 * between[d] - centre[d]);
                }
                let next = |k: usize| ring[(k + 1) % ring.len()];
                (0..ring.len()).map(|k| facet([at(ring[k]), at(next(k)), centre])).collect()
            }
        }
    }
}

/// Local nodes of a side: corners, then the nodes between each and the next.
pub(super) type LocalSide = (Vec<usize>, Vec<usize>);

/// Returns the sides of a cell: faces of a solid, anticlockwise seen from outside; edges of a plane cell.
pub(super) fn sides_of(kind: ElementKind) -> Vec<LocalSide> {
    if let Some(shape) = kind.solid() {
        let side = |side: u8| {
            let ring = shape.side(side);
            let next = (0..ring.len()).map(|k| (ring[k], ring[(k + 1) % ring.len()]));
            (ring.to_vec(), next.filter_map(|(a, b)| shape.middle(a, b)).collect())
        };
        return (0..shape.side_count()).map(side).collect();
    }
    let count = kind.facet().unwrap_or(0);
    let middle = |k: usize| if kind.node_count() > count { vec![count + k] } else { Vec::new() };
    (0..count).map(|k| (vec![k, (k + 1) % count], middle(k))).collect()
}
