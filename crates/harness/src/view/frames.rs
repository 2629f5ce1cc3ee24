//! The steps of a field file, merged or, of an unfinished run, file by file.

use std::fs;
use std::path::{Path, PathBuf};

use crate::output::vtkhdf::{self, Cells, Series};
use polycore::Error;

/// Steps that are read on demand.
pub struct FrameReader {
    /// NAME of NAME.vtkhdf.
    pub name: String,
    /// Particles that move: time counts load steps. Otherwise a mesh that stands still, and time is in
    /// seconds.
    pub moves: bool,
    first: Series,
    /// File of each step, if the run is unfinished.
    files: Vec<PathBuf>,
}

impl FrameReader {
    /// Returns all field files of a folder by name, those of an unfinished run included.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] for a damaged file.
    pub fn all(folder: &Path) -> Result<Vec<Self>, Error> {
        let mut names: Vec<String> = names(folder)?
            .iter()
            .filter_map(|name| name.strip_suffix(".vtkhdf").or(name.strip_suffix(".frames")))
            .filter(|name| !name.starts_with('.'))
            .map(str::to_owned)
            .collect();
        names.sort();
        names.dedup();
        let opened = names.into_iter().map(|name| Self::open(folder, name));
        opened.filter_map(Result::transpose).collect()
    }

    fn open(folder: &Path, name: String) -> Result<Option<Self>, Error> {
        let merged = folder.join(format!("{name}.vtkhdf"));
        let mut files = Vec::new();
        let first = if merged.is_file() {
            vtkhdf::read(&merged)?
        } else {
            let frames = folder.join(format!("{name}.frames"));
            files
                .extend(names(&frames)?.iter().filter(|name| !name.starts_with('.')).map(|n| frames.join(n)));
            files.sort();
            let Some(first) = files.first() else { return Ok(None) };
            vtkhdf::read(first)?
        };
        Ok(Some(Self { name, moves: first.moves(), first, files }))
    }

    /// Returns whether the run that writes the file has not ended.
    pub fn unfinished(&self) -> bool {
        !self.files.is_empty()
    }

    /// Steps.
    pub fn len(&self) -> usize {
        if self.files.is_empty() { self.first.len() } else { self.files.len() }
    }

    /// Arrays at points and at cells: names and numbers of components.
    pub fn arrays(&self) -> [&[(String, usize)]; 2] {
        [self.first.arrays(), self.first.cell_arrays()]
    }

    /// Returns the cells of a mesh.
    ///
    /// # Errors
    /// [`Error::Format`].
    pub fn cells(&self) -> Result<Cells, Error> {
        self.first.cells()
    }

    /// Reads from a step.
    ///
    /// # Errors
    /// Those of reading a damaged file.
    pub fn read_step<T>(
        &self,
        step: usize,
        read: impl FnOnce(&Series, usize) -> Result<T, Error>,
    ) -> Result<T, Error> {
        match self.files.get(step) {
            Some(file) => read(&vtkhdf::read(file)?, 0),
            None => read(&self.first, step),
        }
    }
}

/// Returns the sorted names of the entries of a folder.
///
/// # Errors
/// [`Error::Io`].
pub fn names(folder: &Path) -> Result<Vec<String>, Error> {
    let entries = fs::read_dir(folder).map_err(Error::from_io("read", folder))?;
    let mut names: Vec<String> =
        entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    Ok(names)
}
