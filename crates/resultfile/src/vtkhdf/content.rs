//! Content of a file: cells of a mesh, and a step.

use super::packed::PackedRows;
use polycore::Error;

/// Cells of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cells {
    /// Points of all cells, one cell after another, in VTK's order.
    pub connectivity: Vec<u32>,
    /// End of each cell in `connectivity`.
    pub ends: Vec<usize>,
    /// VTK's number of each cell's type: 10 tetrahedron, 12 hexahedron.
    pub types: Vec<u8>,
}

impl Cells {
    /// Adds a cell.
    pub fn push(&mut self, kind: u8, points: &[u32]) {
        self.connectivity.extend_from_slice(points);
        self.ends.push(self.connectivity.len());
        self.types.push(kind);
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.types.len()
    }

    /// Returns whether there is no cell.
    pub fn is_empty(&self) -> bool {
        self.types.is_empty()
    }

    pub(super) fn check(&self, points: usize) -> Result<(), Error> {
        let fail = |reason: String| Err(Error::Data { what: "cells".into(), reason });
        if self.is_empty() {
            return fail("there are no cells".into());
        }
        let ascending = self.ends.windows(2).all(|pair| pair[0] <= pair[1]);
        if self.ends.len() != self.len() || !ascending || self.ends.last() != Some(&self.connectivity.len()) {
            let (cells, ends, ids) = (self.len(), self.ends.len(), self.connectivity.len());
            return fail(format!("{cells} types, {ends} ends and {ids} points of cells do not fit together"));
        }
        match self.connectivity.iter().find(|&&point| point as usize >= points) {
            Some(point) => fail(format!("point {point} of a mesh of {points} points")),
            None => Ok(()),
        }
    }
}

/// A step: time, points where they move, arrays on points and on cells.
pub struct StepContent<'a> {
    pub time: f64,
    pub points: Option<PackedRows<'a>>,
    pub arrays: Vec<PackedRows<'a>>,
    pub cell_arrays: Vec<PackedRows<'a>>,
    /// Arrays in the order of the layout.
    pub moments: Vec<f64>,
}
