//! Atomic writing of files.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

use crate::Error;

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
        .map_err(Error::from_io("create a file in", directory))?;
    let mut buffer = BufWriter::new(temporary.as_file_mut());
    write(&mut buffer).and_then(|()| buffer.flush()).map_err(Error::from_io("write", path))?;
    drop(buffer);
    temporary.as_file().sync_all().map_err(Error::from_io("synchronise", path))?;
    temporary.persist(path).map_err(|error| Error::from_io("write", path)(error.error))?;
    sync_directory(directory);
    Ok(())
}

/// Makes sure, before any computation, that results can be written into `directory`; creates it if needed.
///
/// # Errors
/// [`Error::OutputDirectory`] (exit code 2) if it cannot be created or written to; [`Error::Io`] (1) if the
/// disk is full.
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
        true => Error::from_io("write into", directory)(error),
        false => fail(error.to_string()),
    })
}

/// Synchronises a directory so that a rename is durable; best effort, since not every system can.
pub fn sync_directory(directory: &Path) {
    if let Ok(handle) = File::open(directory) {
        let _ = handle.sync_all();
    }
}

/// File name without its folder.
pub fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Directory of a file, or `.` if its path names none.
pub fn parent(path: &Path) -> &Path {
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
