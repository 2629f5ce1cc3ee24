//! Meshes from VTK's unstructured grids.

use super::{GHOST, VtuArray, VtuGrid};
use crate::content::{FileElement, FileNode, MeshFile};
use crate::error::{Error, data_error};
use crate::vtk_cells::{ALLOWED, element};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// Greatest number of values of an array that makes sets.
const MOST_SETS: usize = 100;

/// Reads `.vtu` or `.pvtu`. Each value of an array of integers is a set, `ARRAY-VALUE`: of cells, as in
/// `MaterialIds-2`, or of nodes. Nodes that pieces share are merged, ghost cells left out.
///
/// # Errors
/// Those of [`VtuGrid::read`]; [`Error::Data`] for pyramids, polyhedra and other cells, and for positions
/// that are not finite.
pub fn read(path: &Path) -> Result<MeshFile, Error> {
    let grid = VtuGrid::read(&[path.to_owned()])?;
    let mut mesh = MeshFile::default();
    mesh.included.extend(grid.files.iter().filter(|file| *file != path).cloned());
    let node_of = add_nodes(&grid, &mut mesh);
    if let Some(node) = mesh.nodes.iter().find(|node| !node.point.iter().all(|x| x.is_finite())) {
        let (label, point) = (node.label, node.point);
        return Err(data_error(path, &format!("node {label} at {point:?}; allowed: finite positions")));
    }
    let ghost = grid.cell_arrays.iter().find(|array| array.name == GHOST);
    let mut place_of = vec![u32::MAX; grid.cells.len()];
    let mut unused = 0;
    for (cell, &(kind, _)) in grid.cells.iter().enumerate() {
        let is_ghost = ghost.and_then(|array| array.values.get(cell)).is_some_and(|value| *value != 0.0);
        // polyvertices and polylines bound nothing
        if is_ghost || matches!(kind, 0 | 2 | 4) {
            unused += usize::from(!is_ghost);
            continue;
        }
        let Some((kind, nodes)) = element(kind, grid.cell_nodes(cell), &grid.points) else {
            let count = grid.cell_nodes(cell).len();
            let found = format!("cell {cell} of VTK's type {kind} with {count} nodes; allowed: {ALLOWED}");
            return Err(data_error(path, &found));
        };
        place_of[cell] = mesh.elements.len() as u32;
        let first = mesh.element_nodes.len();
        mesh.element_nodes.extend(nodes.iter().map(|&node| node_of[node as usize]));
        mesh.elements.push(FileElement { label: cell as u64, line: 0, kind, first });
    }
    if unused > 0 {
        mesh.notes.push(format!("{unused} polylines, polyvertices and empty cells: not used"));
    }
    let MeshFile { element_sets, node_sets, notes, .. } = &mut mesh;
    for (arrays, places, what, sets) in [
        (&grid.cell_arrays, &place_of, "cells", element_sets),
        (&grid.point_arrays, &node_of, "nodes", node_sets),
    ] {
        for array in arrays.iter().filter(|array| array.integers && !array.name.starts_with("vtk")) {
            add_sets(array, places, what, sets, notes);
        }
    }
    Ok(mesh)
}

/// Adds the nodes of a grid; returns the place of each. A node of a later piece at the position of an earlier
/// one is that node.
fn add_nodes(grid: &VtuGrid, mesh: &mut MeshFile) -> Vec<u32> {
    let mut node_of = Vec::with_capacity(grid.points.len());
    let mut known: HashMap<[u64; 3], u32> = HashMap::new();
    for (piece, &begin) in grid.pieces.iter().enumerate() {
        let end = grid.pieces.get(piece + 1).copied().unwrap_or(grid.points.len());
        // those of this piece, which may have several nodes at one position, as at a crack
        let mut own = Vec::new();
        for (label, &point) in (begin as u64..).zip(&grid.points[begin..end]) {
            // −0 is 0
            let key = point.map(|x| (x + 0.0).to_bits());
            let place = known.get(&key).copied().unwrap_or_else(|| {
                mesh.nodes.push(FileNode { label, line: 0, point });
                own.push((key, mesh.nodes.len() as u32 - 1));
                mesh.nodes.len() as u32 - 1
            });
            node_of.push(place);
        }
        known.extend(own);
    }
    node_of
}

/// Adds a set for each value of an array.
fn add_sets(
    array: &VtuArray,
    places: &[u32],
    what: &str,
    sets: &mut BTreeMap<String, Vec<u32>>,
    notes: &mut Vec<String>,
) {
    let name = &array.name;
    if array.values.len() != places.len() {
        let (found, all) = (array.values.len(), places.len());
        notes.push(format!("array `{name}` has {found} values for {all} {what}: not used"));
        return;
    }
    let mut own: BTreeMap<i64, Vec<u32>> = BTreeMap::new();
    for (&value, &place) in array.values.iter().zip(places).filter(|(_, place)| **place != u32::MAX) {
        own.entry(value as i64).or_default().push(place);
        if own.len() > MOST_SETS {
            notes.push(format!("array `{name}` has more than {MOST_SETS} values on {what}: no sets"));
            return;
        }
    }
    for (value, mut members) in own {
        // nodes of several pieces occur in each
        members.sort_unstable();
        members.dedup();
        sets.insert(format!("{name}-{value}"), members);
    }
}
