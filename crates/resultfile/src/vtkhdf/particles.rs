//! Particles that move.

use std::path::{Path, PathBuf};

use super::content::StepContent;
use super::frames::FrameFiles;
use super::packed::{PackedRows, is_single};
use super::{Data, Layout, Moment, check_points};
use polycore::Error;

/// Writes the steps of a moving cloud of particles.
#[derive(Debug)]
pub struct ParticleSeries {
    frames: FrameFiles,
}

impl ParticleSeries {
    /// Begins a series that will end as `path` (`….vtkhdf`); removes what an earlier run left there.
    ///
    /// # Errors
    /// [`Error::Io`] if the directory cannot be prepared.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, Error> {
        Ok(Self { frames: FrameFiles::create(path.as_ref(), None)? })
    }

    /// Continues a series after its first `steps_done` steps; discards later ones.
    ///
    /// # Errors
    /// [`Error::Data`] if fewer steps than that exist, [`Error::Format`] if one of them is damaged.
    pub fn resume(path: impl AsRef<Path>, steps_done: usize) -> Result<Self, Error> {
        Ok(Self { frames: FrameFiles::resume(path.as_ref(), None, steps_done)? })
    }

    /// Steps written so far.
    pub fn steps(&self) -> usize {
        self.frames.steps()
    }

    /// Writes the next step as a complete file. `time` grows from step to step; all steps have the same
    /// number of points and the same arrays.
    ///
    /// # Errors
    /// [`Error::Data`] if the arrays do not fit together or a value is not finite, [`Error::Io`] if writing
    /// fails.
    pub fn step(&mut self, time: f64, points: &[[f64; 3]], point_data: &[Data<'_>]) -> Result<(), Error> {
        self.moment(time, points, point_data, &[])
    }

    /// The same with numbers of the step as a whole, which become datasets `Steps/NAME`.
    ///
    /// # Errors
    /// As [`ParticleSeries::step`].
    pub fn moment(
        &mut self,
        time: f64,
        points: &[[f64; 3]],
        point_data: &[Data<'_>],
        moments: &[Moment<'_>],
    ) -> Result<(), Error> {
        check_points(points)?;
        let layout = Layout::from_data([points.len(), 0], point_data, &[])?.and(moments)?;
        let of = |name: &String| moments.iter().find(|m| m.0 == name).map_or(f64::NAN, |m| m.1);
        let moments = layout.moments.iter().map(of).collect();
        for (name, components, values) in point_data {
            let stored = |value: f64| if is_single(*components) { f64::from(value as f32) } else { value };
            if let Some(at) = values.iter().position(|&value| !stored(value).is_finite()) {
                let point = at / components;
                let place = points.get(point).copied().unwrap_or_default();
                let reason = format!("{} at point {point}, {place:?} m, time {time}", values[at]);
                return Err(Error::Data { what: format!("point array `{name}` is not finite"), reason });
            }
        }
        let arrays = point_data.iter().map(|(_, _, values)| PackedRows::Values((*values).into())).collect();
        let points = Some(PackedRows::Values(points.as_flattened().into()));
        self.frames.step(&layout, StepContent { time, points, arrays, cell_arrays: Vec::new(), moments })
    }

    /// Merges all steps into the one transient file and removes the frames; returns its path.
    ///
    /// # Errors
    /// [`Error::Data`] without any step; [`Error::Io`] or [`Error::Format`] if a frame has vanished or been
    /// damaged, in which case the frames stay.
    pub fn finish(self) -> Result<PathBuf, Error> {
        self.frames.finish()
    }

    #[cfg(test)]
    pub(super) fn frame(&self, step: usize) -> PathBuf {
        self.frames.frame(step)
    }
}
