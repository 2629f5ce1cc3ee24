//! Particle fields over time as VTKHDF, the HDF5 format that VTK (≥ 9.3) and ParaView (≥ 5.12) read natively.
//!
//! Layout: <https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html>, type `PolyData`, one
//! vertex cell for each particle, the topology once, points and point data for every step.
//!
//! A run can be killed at any moment: each step becomes a complete file `NAME.frames/000k.vtkhdf` of its own, written
//! under another name and renamed. [`ParticleSeries::finish`] merges them into `NAME.vtkhdf` in the same way and
//! removes the frames. A resumed run goes on with the frame after its checkpoint.

use std::fs;
use std::path::{Path, PathBuf};

use super::sync_directory;
use crate::Error;

mod read;
#[cfg(test)]
mod tests;
mod write;

pub use read::{Series, read};
use write::Writer;

/// A point array: name, number of components, values `[points · components]`, the components of a point together.
pub type PointData<'a> = (&'a str, usize, &'a [f64]);

/// Writes the steps of a moving cloud of particles.
#[derive(Debug)]
pub struct ParticleSeries {
    path: PathBuf,
    frames: PathBuf,
    steps: usize,
    last_time: f64,
    layout: Option<Layout>,
}

/// What all steps have in common.
#[derive(Clone, Debug, PartialEq)]
struct Layout {
    points: usize,
    /// Names and numbers of components.
    arrays: Vec<(String, usize)>,
}

impl ParticleSeries {
    /// Begins a series that will end as `path` (`….vtkhdf`); removes what an earlier run left there.
    ///
    /// # Errors
    /// [`Error::Io`] if the directory cannot be prepared.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, Error> {
        let series = Self::new(path.as_ref())?;
        remove(&series.frames)?;
        remove(&series.path)?;
        series.prepare()?;
        Ok(series)
    }

    /// Continues a series after its first `steps_done` steps; discards later ones.
    ///
    /// # Errors
    /// [`Error::Data`] if fewer steps than that exist, [`Error::Format`] if one of them is damaged.
    pub fn resume(path: impl AsRef<Path>, steps_done: usize) -> Result<Self, Error> {
        let mut series = Self::new(path.as_ref())?;
        series.prepare()?;
        // a finished series has no frames any more: take them from the merged file
        let mut merged = None;
        for step in 0..steps_done {
            let frame = series.frame(step);
            if !frame.is_file() {
                if !series.path.is_file() {
                    return Err(series.too_short(steps_done, step));
                }
                let merged = match &mut merged {
                    Some(merged) => merged,
                    empty => empty.insert(read(&series.path)?),
                };
                if step >= merged.len() {
                    return Err(series.too_short(steps_done, merged.len()));
                }
                series.copy(merged, step, &frame)?;
            }
            let frame = read(&frame)?;
            series.check(&frame.layout(), frame.times()[0])?;
            series.steps = step + 1;
        }
        drop(merged);
        remove(&series.path)?;
        series.discard_from(steps_done)?;
        Ok(series)
    }

    /// Steps written so far.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// Writes the next step as a complete file. `time` grows from step to step; all steps have the same number of
    /// points and the same arrays.
    ///
    /// # Errors
    /// [`Error::Data`] if the arrays do not fit together, [`Error::Io`] or [`Error::Format`] if writing fails.
    pub fn step(
        &mut self,
        time: f64,
        points: &[[f64; 3]],
        point_data: &[PointData<'_>],
    ) -> Result<(), Error> {
        let layout = Layout::of(points, point_data)?;
        self.check(&layout, time)?;
        let target = self.frame(self.steps);
        whole_file(&target, |temporary| {
            let mut writer = Writer::create(temporary, &layout, 1)?;
            writer.step(time, points.as_flattened(), point_data.iter().map(|(_, _, values)| *values))?;
            writer.close()
        })?;
        self.steps += 1;
        Ok(())
    }

    /// Merges all steps into the one transient file and removes the frames; returns its path.
    ///
    /// # Errors
    /// [`Error::Data`] without any step; [`Error::Io`] or [`Error::Format`] if a frame has vanished or been damaged,
    /// in which case the frames stay.
    pub fn finish(self) -> Result<PathBuf, Error> {
        let Some(layout) = &self.layout else {
            return Err(data_error(&self.path, "there is no step to write".into()));
        };
        whole_file(&self.path, |temporary| {
            let mut writer = Writer::create(temporary, layout, self.steps)?;
            for step in 0..self.steps {
                let frame = read(self.frame(step))?;
                let points = frame.points(0)?;
                let names = layout.arrays.iter().map(|(name, _)| frame.data(0, name));
                let arrays = names.collect::<Result<Vec<_>, _>>()?;
                writer.step(frame.times()[0], points.as_flattened(), arrays.iter().map(Vec::as_slice))?;
            }
            writer.close()
        })?;
        remove(&self.frames)?;
        Ok(self.path)
    }

    fn new(path: &Path) -> Result<Self, Error> {
        if path.extension().is_none_or(|extension| extension != "vtkhdf") {
            return Err(data_error(path, "the file name must end in .vtkhdf".into()));
        }
        let frames = path.with_extension("frames");
        Ok(Self { path: path.to_path_buf(), frames, steps: 0, last_time: f64::NEG_INFINITY, layout: None })
    }

    fn prepare(&self) -> Result<(), Error> {
        fs::create_dir_all(&self.frames).map_err(Error::io("create", &self.frames))?;
        remove(&temporary_name(&self.path))
    }

    fn frame(&self, step: usize) -> PathBuf {
        self.frames.join(format!("{step:04}.vtkhdf"))
    }

    fn too_short(&self, asked: usize, found: usize) -> Error {
        data_error(&self.path, format!("cannot resume after {asked} steps, only {found} were written"))
    }

    fn copy(&self, from: &Series, step: usize, to: &Path) -> Result<(), Error> {
        let layout = from.layout();
        let points = from.points(step)?;
        let names = layout.arrays.iter().map(|(name, _)| from.data(step, name));
        let arrays = names.collect::<Result<Vec<_>, _>>()?;
        whole_file(to, |temporary| {
            let mut writer = Writer::create(temporary, &layout, 1)?;
            writer.step(from.times()[step], points.as_flattened(), arrays.iter().map(Vec::as_slice))?;
            writer.close()
        })
    }

    /// Removes later frames and whatever a killed writer left behind.
    fn discard_from(&self, steps: usize) -> Result<(), Error> {
        let keep: Vec<PathBuf> = (0..steps).map(|step| self.frame(step)).collect();
        let entries = fs::read_dir(&self.frames).map_err(Error::io("list", &self.frames))?;
        for entry in entries {
            let path = entry.map_err(Error::io("list", &self.frames))?.path();
            if !keep.contains(&path) {
                remove(&path)?;
            }
        }
        Ok(())
    }

    fn check(&mut self, layout: &Layout, time: f64) -> Result<(), Error> {
        let what = || format!("step {} of {}", self.steps, self.path.display());
        if !time.is_finite() || time <= self.last_time {
            let reason = format!("time {time} must be finite and greater than the last, {}", self.last_time);
            return Err(Error::Data { what: what(), reason });
        }
        match &self.layout {
            Some(first) if first != layout => {
                let reason = format!("has {layout}, but the steps before have {first}");
                return Err(Error::Data { what: what(), reason });
            }
            Some(_) => {}
            None => self.layout = Some(layout.clone()),
        }
        self.last_time = time;
        Ok(())
    }
}

impl Layout {
    fn of(points: &[[f64; 3]], point_data: &[PointData<'_>]) -> Result<Self, Error> {
        let fail =
            |name: &str, reason: String| Err(Error::Data { what: format!("point array `{name}`"), reason });
        if points.is_empty() {
            return fail("Points", "there are no points".into());
        }
        if let Some(index) = points.iter().position(|point| point.iter().any(|x| !x.is_finite())) {
            return fail("Points", format!("point {index} is {:?}", points[index]));
        }
        let mut arrays: Vec<(String, usize)> = Vec::new();
        for &(name, components, values) in point_data {
            if name.is_empty() || name == "." || name.contains('/') || name.contains('\0') {
                return fail(name, "not a valid name".into());
            }
            if arrays.iter().any(|(other, _)| other == name) {
                return fail(name, "given twice".into());
            }
            if components == 0 || points.len().checked_mul(components) != Some(values.len()) {
                let points = points.len();
                return fail(
                    name,
                    format!("{} values for {points} points of {components} components", values.len()),
                );
            }
            arrays.push((name.to_owned(), components));
        }
        Ok(Self { points: points.len(), arrays })
    }
}

impl std::fmt::Display for Layout {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names = self.arrays.iter().map(|(name, components)| format!("{name}[{components}]"));
        write!(f, "{} points with {}", self.points, names.collect::<Vec<_>>().join(", "))
    }
}

/// Lets `write` make a complete HDF5 file under another name, then renames it to `target`.
fn whole_file(target: &Path, write: impl FnOnce(&Path) -> Result<(), Error>) -> Result<(), Error> {
    let temporary = temporary_name(target);
    remove(&temporary)?;
    let result = write(&temporary)
        .and_then(|()| fs::rename(&temporary, target).map_err(Error::io("rename to", target)));
    if result.is_err() {
        let _ = remove(&temporary);
    }
    sync_directory(super::parent(target));
    result
}

fn temporary_name(target: &Path) -> PathBuf {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    target.with_file_name(format!(".{name}.part"))
}

fn remove(path: &Path) -> Result<(), Error> {
    let removed = match fs::symlink_metadata(path) {
        Err(_) => return Ok(()),
        Ok(metadata) if metadata.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
    };
    removed.map_err(Error::io("remove", path))
}

fn data_error(path: &Path, reason: String) -> Error {
    Error::Data { what: path.display().to_string(), reason }
}

fn format_error(path: &Path, reason: impl ToString) -> Error {
    Error::Format { path: path.to_path_buf(), format: "VTKHDF file", reason: reason.to_string() }
}
