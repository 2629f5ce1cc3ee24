//! What a run leaves on disk: CSV curves, pictures, VTKHDF fields; always whole files, never half-written ones.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

use crate::Error;

#[cfg(feature = "case")]
pub mod csv;
#[cfg(feature = "hdf5")]
pub mod hdf5;
#[cfg(feature = "pictures")]
pub mod picture;
#[cfg(feature = "hdf5")]
pub mod vtkhdf;

/// Writes a file so that `path` holds either its old content or all of the new one, whatever happens.
///
/// `write` fills a temporary file in the same directory, which is synchronised to disk and renamed to `path`.
///
/// # Errors
/// [`Error::Io`] with the operation that failed; the temporary file is removed then.
pub fn atomic_write(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> std::io::Result<()>,
) -> Result<(), Error> {
    let path = path.as_ref();
    let directory = parent(path);
    let mut temporary = tempfile::Builder::new()
        .prefix(".")
        .suffix(".part")
        .permissions_of_a_new_file()
        .tempfile_in(directory)
        .map_err(Error::io("create a file in", directory))?;
    let mut buffer = BufWriter::new(temporary.as_file_mut());
    write(&mut buffer).and_then(|()| buffer.flush()).map_err(Error::io("write", path))?;
    drop(buffer);
    temporary.as_file().sync_all().map_err(Error::io("synchronise", path))?;
    temporary.persist(path).map_err(|error| Error::io("write", path)(error.error))?;
    sync_directory(directory);
    Ok(())
}

/// Makes sure, before any computation, that results can be written into `directory`; creates it if needed.
///
/// # Errors
/// [`Error::OutputDirectory`] (exit code 2) if it cannot be created or written to; [`Error::Io`] (1) if the disk is full.
pub fn prepare_directory(directory: impl AsRef<Path>) -> Result<(), Error> {
    let directory = directory.as_ref();
    let fail = |reason: String| Error::OutputDirectory { path: directory.to_path_buf(), reason };
    if directory.as_os_str().is_empty() {
        return Err(fail("its name is empty".into()));
    }
    match fs::metadata(directory) {
        Ok(metadata) if !metadata.is_dir() => return Err(fail("it is a file".into())),
        Ok(_) => {}
        Err(_) => fs::create_dir_all(directory).map_err(|error| fail(error.to_string()))?,
    }
    // permissions do not tell everything (read-only mounts, quotas): try
    let probe = tempfile::tempfile_in(directory).and_then(|mut probe| probe.write_all(b"probe"));
    probe.map_err(|error| match crate::error::no_room(&error) {
        true => Error::io("write into", directory)(error),
        false => fail(error.to_string()),
    })
}

#[cfg(feature = "case")]
/// The directory of a new run: as [`prepare_directory`], without what an earlier run left, which must not pass for this
/// one's, and held against a second run.
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

#[cfg(feature = "case")]
/// The directory of a run that goes on: without half-written files, and held against a second run.
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

/// Keeps a second run, or a second `resume`, out of a directory. Where the system or its file system has no such locks,
/// nothing is kept out.
///
/// # Errors
/// [`Error::OutputDirectory`] (exit code 2) where another run holds it.
pub fn lock_run(directory: impl AsRef<Path>) -> Result<RunLock, Error> {
    let directory = directory.as_ref();
    let handle = File::open(directory).ok();
    match handle.as_ref().map(File::try_lock) {
        Some(Err(fs::TryLockError::WouldBlock)) => Err(Error::OutputDirectory {
            path: directory.to_path_buf(),
            reason: "another run is writing into it".into(),
        }),
        _ => Ok(RunLock { _handle: handle }),
    }
}

/// Makes a rename last; best effort, since not every system can synchronise a directory.
pub(crate) fn sync_directory(directory: &Path) {
    if let Ok(handle) = File::open(directory) {
        let _ = handle.sync_all();
    }
}

fn parent(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// `tempfile` makes private files (0600); results should be readable like any other new file.
trait NewFilePermissions {
    fn permissions_of_a_new_file(&mut self) -> &mut Self;
}

impl NewFilePermissions for tempfile::Builder<'_, '_> {
    #[cfg(unix)]
    fn permissions_of_a_new_file(&mut self) -> &mut Self {
        use std::os::unix::fs::PermissionsExt;
        // the process' umask is applied by the system on creation
        self.permissions(fs::Permissions::from_mode(0o666))
    }

    #[cfg(not(unix))]
    fn permissions_of_a_new_file(&mut self) -> &mut Self {
        self
    }
}

/// Removes what a killed run leaves: files and folders that it had begun to write under their temporary names.
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

    #[test]
    fn a_failed_write_leaves_the_old_file() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.txt");
        atomic_write(&path, |file| file.write_all(b"old")).unwrap();
        let error = atomic_write(&path, |file| {
            file.write_all(b"half")?;
            Err(std::io::Error::other("disk on fire"))
        });
        assert!(error.unwrap_err().to_string().contains("disk on fire"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(directory.path()), ["a.txt"]);
        atomic_write(&path, |file| file.write_all(b"new")).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert!(atomic_write(directory.path().join("no/such/file"), |_| Ok(())).is_err());
    }

    #[test]
    fn directories() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path();
        prepare_directory(path.join("a/b")).unwrap();
        prepare_directory(path.join("a/b")).unwrap();
        assert!(names(&path.join("a/b")).is_empty());
        fs::write(path.join("file"), "").unwrap();
        for (bad, reason) in [("file", "it is a file"), ("file/below", "directory"), ("nul\0", "nul")] {
            let error = prepare_directory(path.join(bad)).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().to_lowercase().contains(reason), "{error}");
        }
        assert!(prepare_directory("").is_err());
        if cfg!(target_os = "linux") {
            // refused to everyone, root included
            let error = prepare_directory("/proc/out").unwrap_err();
            assert!(error.to_string().contains("/proc/out cannot be used"), "{error}");
        }
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

    #[cfg(unix)]
    #[test]
    fn files_have_ordinary_permissions() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().unwrap();
        let mode = |name: &str| fs::metadata(directory.path().join(name)).unwrap().permissions().mode();
        atomic_write(directory.path().join("ours"), |_| Ok(())).unwrap();
        fs::write(directory.path().join("usual"), "").unwrap();
        assert_eq!(mode("ours"), mode("usual"));
    }
}
