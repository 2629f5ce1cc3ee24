//! The steps of a series as files of their own, until they are merged.

use std::fs;
use std::path::{Path, PathBuf};

use super::content::{Cells, StepContent};
use super::packed::StoredTable;
use super::read::{Series, read};
use super::write::Writer;
use super::{Layout, data_error, remove, temporary_name, whole_file};
use polycore::Error;
use polycore::file::{parent, sync_directory};

/// The frames of a series.
#[derive(Debug)]
pub struct FrameFiles {
    path: PathBuf,
    frames: PathBuf,
    steps: usize,
    last_time: f64,
    layout: Option<Layout>,
    /// Points and cells of a mesh, equal in all steps.
    mesh: Option<(Vec<[f64; 3]>, Cells)>,
}

impl FrameFiles {
    /// A new series; removes what an earlier run left there.
    pub fn create(path: &Path, mesh: Option<(Vec<[f64; 3]>, Cells)>) -> Result<Self, Error> {
        let series = Self::new(path, mesh)?;
        remove(&series.frames)?;
        remove(&series.path)?;
        series.prepare()?;
        Ok(series)
    }

    /// The series after its first `steps_done` steps; later ones are discarded.
    pub fn resume(
        path: &Path,
        mesh: Option<(Vec<[f64; 3]>, Cells)>,
        steps_done: usize,
    ) -> Result<Self, Error> {
        let mut series = Self::new(path, mesh)?;
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

    /// Writes the next step as a complete file.
    pub fn step(&mut self, layout: &Layout, step: StepContent<'_>) -> Result<(), Error> {
        self.check(layout, step.time)?;
        let target = self.frame(self.steps);
        whole_file(&target, |temporary| {
            let mut writer = Writer::create(temporary, layout, self.mesh.as_ref(), 1)?;
            writer.step(step)?;
            writer.close()
        })?;
        self.steps += 1;
        Ok(())
    }

    /// Merges all steps into one file and removes the frames; returns its path.
    pub fn finish(self) -> Result<PathBuf, Error> {
        let Some(layout) = &self.layout else {
            return Err(data_error(&self.path, "there is no step to write".into()));
        };
        if self.steps == 1 {
            // it is the whole series
            fs::rename(self.frame(0), &self.path).map_err(Error::from_io("rename to", &self.path))?;
            sync_directory(parent(&self.path));
            remove(&self.frames)?;
            return Ok(self.path);
        }
        whole_file(&self.path, |temporary| {
            let mut writer = Writer::create(temporary, layout, self.mesh.as_ref(), self.steps)?;
            for step in 0..self.steps {
                append(&mut writer, &read(self.frame(step))?, 0)?;
            }
            writer.close()
        })?;
        remove(&self.frames)?;
        Ok(self.path)
    }

    fn new(path: &Path, mesh: Option<(Vec<[f64; 3]>, Cells)>) -> Result<Self, Error> {
        if path.extension().is_none_or(|extension| extension != "vtkhdf") {
            return Err(data_error(path, "the file name must end in .vtkhdf".into()));
        }
        let frames = path.with_extension("frames");
        let last_time = f64::NEG_INFINITY;
        Ok(Self { path: path.to_path_buf(), frames, steps: 0, last_time, layout: None, mesh })
    }

    fn prepare(&self) -> Result<(), Error> {
        fs::create_dir_all(&self.frames).map_err(Error::from_io("create", &self.frames))?;
        remove(&temporary_name(&self.path))
    }

    /// Returns the file of a step.
    pub fn frame(&self, step: usize) -> PathBuf {
        self.frames.join(format!("{step:04}.vtkhdf"))
    }

    fn too_short(&self, asked: usize, found: usize) -> Error {
        data_error(&self.path, format!("cannot resume after {asked} steps, only {found} were written"))
    }

    fn copy(&self, from: &Series, step: usize, to: &Path) -> Result<(), Error> {
        whole_file(to, |temporary| {
            let mut writer = Writer::create(temporary, &from.layout(), self.mesh.as_ref(), 1)?;
            append(&mut writer, from, step)?;
            writer.close()
        })
    }

    /// Removes later frames and whatever a killed writer left behind.
    fn discard_from(&self, steps: usize) -> Result<(), Error> {
        let keep: Vec<PathBuf> = (0..steps).map(|step| self.frame(step)).collect();
        let entries = fs::read_dir(&self.frames).map_err(Error::from_io("list", &self.frames))?;
        for entry in entries {
            let path = entry.map_err(Error::from_io("list", &self.frames))?.path();
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

/// Copies a step of a series.
fn append(writer: &mut Writer, from: &Series, step: usize) -> Result<(), Error> {
    let layout = from.layout();
    let [points, arrays, cells] = writer.tables();
    let all = |tables: &[StoredTable], names: &[(String, usize)], kind| {
        let rows = tables.iter().zip(names).map(|(table, (name, _))| from.packed(table, kind, name, step));
        rows.collect::<Result<Vec<_>, _>>()
    };
    let copied = StepContent {
        time: from.times()[step],
        points: points.first().map(|table| from.packed(table, "", "Points", step)).transpose()?,
        arrays: all(arrays, &layout.arrays, "PointData")?,
        cell_arrays: all(cells, &layout.cell_arrays, "CellData")?,
        moments: layout.moments.iter().map(|name| from.moment(step, name).unwrap_or(f64::NAN)).collect(),
    };
    writer.step(copied)
}
