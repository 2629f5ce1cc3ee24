//! The output directory of a run: emptied of what an earlier run left, and held against a second one.

use polycore::Error;
use polycore::file::prepare_directory;
use std::fs::{self, File};
use std::path::Path;

/// Returns the directory of a new run: as [`prepare_directory`], without what an earlier run left, which must
/// not pass for this one's, and held against a second run.
///
/// # Errors
/// As [`prepare_directory`] and [`lock_run`].
pub fn prepare_run(directory: impl AsRef<Path>) -> Result<RunLock, Error> {
    let directory = directory.as_ref();
    prepare_directory(directory)?;
    let lock = lock_run(directory)?;
    for old in [crate::checkpoint::FILE_NAME, crate::report::FILE_NAME] {
        let _ = fs::remove_file(directory.join(old));
    }
    remove_unfinished(directory);
    Ok(lock)
}

/// Returns the directory of a resumed run: without half-written files, and held against a second run.
///
/// # Errors
/// As [`lock_run`].
pub fn resume_run(directory: impl AsRef<Path>) -> Result<RunLock, Error> {
    let lock = lock_run(directory.as_ref())?;
    remove_unfinished(directory.as_ref());
    Ok(lock)
}

/// Held by the run that writes into a directory, until it is dropped or its process ends in any way.
#[derive(Debug)]
#[must_use = "the directory is free again where this is dropped"]
pub struct RunLock {
    _handle: Option<File>,
}

/// Keeps a second run, or a second `resume`, out of a directory. Where the system or its file system has no
/// such locks, nothing is kept out.
///
/// # Errors
/// [`Error::OutputDirectory`] (exit code 2) where another run holds it.
pub fn lock_run(directory: impl AsRef<Path>) -> Result<RunLock, Error> {
    locked(directory.as_ref(), File::try_lock)
}

/// Keeps runs that need the whole directory ([`lock_run`]) out, and lets in others that share it.
///
/// # Errors
/// As [`lock_run`].
pub fn share_run(directory: impl AsRef<Path>) -> Result<RunLock, Error> {
    locked(directory.as_ref(), File::try_lock_shared)
}

fn locked(directory: &Path, lock: fn(&File) -> Result<(), fs::TryLockError>) -> Result<RunLock, Error> {
    let handle = File::open(directory).ok();
    match handle.as_ref().map(lock) {
        Some(Err(fs::TryLockError::WouldBlock)) => Err(Error::OutputDirectory {
            path: directory.to_path_buf(),
            reason: "another run is writing into it".into(),
        }),
        _ => Ok(RunLock { _handle: handle }),
    }
}

/// Removes what a killed run leaves: files and folders that it had begun to write under their temporary
/// names.
pub fn remove_unfinished(directory: &Path) {
    for entry in fs::read_dir(directory).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with('.') && name.ends_with(".part") {
            let folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            let _ = if folder { fs::remove_dir_all(entry.path()) } else { fs::remove_file(entry.path()) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(directory: &Path) -> Vec<String> {
        let entries = fs::read_dir(directory).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    /// Files, and folders as HDF5 files are written in; nothing else.
    #[test]
    fn what_a_kill_leaves_is_removed() {
        let directory = tempfile::tempdir().unwrap();
        let here = directory.path();
        fs::create_dir(here.join(".b.part")).unwrap();
        for name in [".a.part", ".b.part/data.h5", "result.part", ".hidden"] {
            fs::write(here.join(name), "x").unwrap();
        }
        remove_unfinished(here);
        let mut left = names(here);
        left.sort();
        assert_eq!(left, [".hidden", "result.part"]);
    }

    #[cfg(unix)]
    #[test]
    fn one_run_at_a_time() {
        let directory = tempfile::tempdir().unwrap();
        let first = lock_run(directory.path()).unwrap();
        let second = lock_run(directory.path()).unwrap_err();
        assert!(second.to_string().contains("another run is writing into it") && second.exit_code() == 2);
        assert!(prepare_run(directory.path()).is_err() && resume_run(directory.path()).is_err());
        drop(first);
        drop(lock_run(directory.path()).unwrap());
        assert!(names(directory.path()).is_empty(), "a lock leaves nothing behind");
        fs::write(directory.path().join(".a.part"), "").unwrap();
        let again = resume_run(directory.path()).unwrap();
        assert!(names(directory.path()).is_empty() && prepare_run(directory.path()).is_err());
        drop(again);
        drop(prepare_run(directory.path()).unwrap());
    }
}
