//! Meshes that stand still.

use std::path::{Path, PathBuf};

use super::content::{Cells, StepContent};
use super::frames::FrameFiles;
use super::packed::PackedRows;
use super::{Data, Layout, check_points};
use polycore::Error;

/// Writes the steps of fields on a mesh.
#[derive(Debug)]
pub struct MeshSeries {
    frames: FrameFiles,
    counts: [usize; 2],
}

impl MeshSeries {
    /// Begins a series that will end as `path` (`….vtkhdf`); removes what an earlier run left there.
    ///
    /// # Errors
    /// [`Error::Data`] for a mesh that does not fit together, [`Error::Io`] if the directory cannot be
    /// prepared.
    pub fn create(path: impl AsRef<Path>, points: Vec<[f64; 3]>, cells: Cells) -> Result<Self, Error> {
        let counts = counts(&points, &cells)?;
        Ok(Self { frames: FrameFiles::create(path.as_ref(), Some((points, cells)))?, counts })
    }

    /// Continues a series of the same mesh after its first `steps_done` steps; discards later ones.
    ///
    /// # Errors
    /// As [`MeshSeries::create`]; [`Error::Data`] if fewer steps than that exist, [`Error::Format`] if one is
    /// damaged.
    pub fn resume(
        path: impl AsRef<Path>,
        points: Vec<[f64; 3]>,
        cells: Cells,
        steps_done: usize,
    ) -> Result<Self, Error> {
        let counts = counts(&points, &cells)?;
        Ok(Self { frames: FrameFiles::resume(path.as_ref(), Some((points, cells)), steps_done)?, counts })
    }

    /// Steps written so far.
    pub fn steps(&self) -> usize {
        self.frames.steps()
    }

    /// Writes the next step as a complete file. `time` grows from step to step; all steps have the same
    /// arrays.
    ///
    /// # Errors
    /// [`Error::Data`] if the arrays do not fit the mesh, [`Error::Io`] or [`Error::Format`] if writing
    /// fails.
    pub fn step(&mut self, time: f64, point_data: &[Data<'_>], cell_data: &[Data<'_>]) -> Result<(), Error> {
        let layout = Layout::from_data(self.counts, point_data, cell_data)?;
        let [arrays, cell_arrays] = [point_data, cell_data]
            .map(|data| data.iter().map(|(_, _, values)| PackedRows::Values((*values).into())).collect());
        self.frames
            .step(&layout, StepContent { time, points: None, arrays, cell_arrays, moments: Vec::new() })
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
