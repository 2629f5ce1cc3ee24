//! Meshes that stand still.

use std::path::{Path, PathBuf};

use super::frames::{Frames, Step};
use super::packed::Rows;
use super::{Data, Layout, check_points};
use polycore::Error;

/// Cells of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cells {
    /// Points of all cells, one cell after another, in VTK's order.
    pub connectivity: Vec<u32>,
    /// Where each cell ends in `connectivity`.
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

    /// Whether there is none.
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

/// Writes the steps of fields on a mesh.
#[derive(Debug)]
pub struct MeshSeries {
    frames: Frames,
    counts: [usize; 2],
}

impl MeshSeries {
    /// Begins a series that will end as `path` (`….vtkhdf`); removes what an earlier run left there.
    ///
    /// # Errors
    /// [`Error::Data`] for a mesh that does not fit together, [`Error::Io`] if the directory cannot be prepared.
    pub fn create(path: impl AsRef<Path>, points: Vec<[f64; 3]>, cells: Cells) -> Result<Self, Error> {
        let counts = counts(&points, &cells)?;
        Ok(Self { frames: Frames::create(path.as_ref(), Some((points, cells)))?, counts })
    }

    /// Continues a series of the same mesh after its first `steps_done` steps; discards later ones.
    ///
    /// # Errors
    /// As [`MeshSeries::create`]; [`Error::Data`] if fewer steps than that exist, [`Error::Format`] if one is damaged.
    pub fn resume(
        path: impl AsRef<Path>,
        points: Vec<[f64; 3]>,
        cells: Cells,
        steps_done: usize,
    ) -> Result<Self, Error> {
        let counts = counts(&points, &cells)?;
        Ok(Self { frames: Frames::resume(path.as_ref(), Some((points, cells)), steps_done)?, counts })
    }

    /// Steps written so far.
    pub fn steps(&self) -> usize {
        self.frames.steps()
    }

    /// Writes the next step as a complete file. `time` grows from step to step; all steps have the same arrays.
    ///
    /// # Errors
    /// [`Error::Data`] if the arrays do not fit the mesh, [`Error::Io`] or [`Error::Format`] if writing fails.
    pub fn step(&mut self, time: f64, point_data: &[Data<'_>], cell_data: &[Data<'_>]) -> Result<(), Error> {
        let layout = Layout::of(self.counts, point_data, cell_data)?;
        let [arrays, cell_arrays] = [point_data, cell_data]
            .map(|data| data.iter().map(|(_, _, values)| Rows::Values((*values).into())).collect());
        self.frames.step(&layout, Step { time, points: None, arrays, cell_arrays, moments: Vec::new() })
    }

    /// Merges all steps into the one transient file and removes the frames; returns its path.
    ///
    /// # Errors
    /// As [`super::ParticleSeries::finish`].
    pub fn finish(self) -> Result<PathBuf, Error> {
        self.frames.finish()
    }
}

fn counts(points: &[[f64; 3]], cells: &Cells) -> Result<[usize; 2], Error> {
    check_points(points)?;
    cells.check(points.len())?;
    Ok([points.len(), cells.len()])
}
