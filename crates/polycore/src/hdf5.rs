//! HDF5 files: datasets are checked for a plausible size before they are read; errors of the library become
//! plain ones.

use crate::Error;
use rust_hdf5::{H5Dataset, H5File, Hdf5Error};
use std::mem::ManuallyDrop;
use std::ops::Deref;
use std::path::Path;

/// Largest ratio of deflate compression (Deutsch 1996, RFC 1951: 258 bytes in two bits).
const BEST_COMPRESSION: f64 = 1032.0;
/// Size that a dataset or a chunk may always have, bytes: a chunk keeps its size when only a corner of it is
/// used.
const ALWAYS_ALLOWED: f64 = (4 << 20) as f64;

/// Opens a dataset of a file of `file_bytes`, if the file can hold the size that the dataset claims.
///
/// A damaged or malicious header can name any size; HDF5 returns fill values for content that was never
/// written.
///
/// # Errors
/// No such dataset; more bytes, of the whole or of a chunk, than deflate can pack into the file.
pub fn dataset(file: &H5File, name: &str, file_bytes: u64) -> Result<H5Dataset, Hdf5Error> {
    let dataset = file.dataset(name)?;
    let bytes = |sizes: &[usize]| {
        sizes.iter().map(|&size| size as f64).product::<f64>() * dataset.element_size() as f64
    };
    let most = BEST_COMPRESSION * file_bytes as f64 + ALWAYS_ALLOWED;
    let chunk = dataset.chunk_dims().unwrap_or_default();
    let needed = bytes(&dataset.shape()).max(bytes(&chunk));
    if needed > most {
        let shape = dataset.shape();
        let found = format!("dataset `{name}` of shape {shape:?} in chunks of {chunk:?}: {needed:.1e} bytes");
        return Err(Hdf5Error::InvalidState(format!(
            "{found}, more than {file_bytes} bytes of a file can hold"
        )));
    }
    Ok(dataset)
}

/// File that is being written. If it is dropped before it is closed, since a write failed, it is left as it
/// is: the library would try to finish it, and print errors beside the one that is returned.
pub struct Created(ManuallyDrop<H5File>);

impl Created {
    /// Creates a file.
    ///
    /// # Errors
    /// Those of the library.
    pub fn new(path: &Path) -> Result<Self, Hdf5Error> {
        Ok(Self(ManuallyDrop::new(H5File::create(path)?)))
    }

    /// Finishes the file and synchronises it to disk.
    ///
    /// # Errors
    /// Those of the library.
    pub fn close(self) -> Result<(), Hdf5Error> {
        ManuallyDrop::into_inner(self.0).close()
    }
}

impl Deref for Created {
    type Target = H5File;

    fn deref(&self) -> &H5File {
        &self.0
    }
}

/// Converts an error of writing; the library wraps the system's message, sometimes as text alone.
pub fn write_error(path: &Path, error: Hdf5Error) -> Error {
    let told = match error {
        Hdf5Error::Io(error) => error,
        other => {
            let text = other.to_string();
            let number = text.rsplit_once("(os error ").and_then(|(_, rest)| rest.split(')').next());
            match number.and_then(|number| number.parse().ok()) {
                Some(number) => std::io::Error::from_raw_os_error(number),
                None => std::io::Error::other(text),
            }
        }
    };
    Error::from_io("write", path)(told)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 80 GB of fill values that were never written take a megabyte of index.
    #[test]
    fn sizes_that_a_file_cannot_hold() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.h5");
        let file = H5File::create(&path).unwrap();
        file.new_dataset::<f64>().shape([10_000_000_000]).chunk(&[100_000]).create("never").unwrap();
        let data = vec![0.5; 1_000_000];
        let packed = file.new_dataset::<f64>().shape([data.len()]).chunk(&[100_000]).shuffle_deflate(9);
        packed.create("constant").unwrap().write_raw(&data).unwrap();
        file.close().unwrap();
        let file = H5File::open(&path).unwrap();
        let bytes = std::fs::metadata(&path).unwrap().len();
        let error = dataset(&file, "never", bytes).err().unwrap().to_string();
        assert!(
            error.contains("dataset `never` of shape [10000000000]") && error.contains("8.0e10 bytes"),
            "{error}"
        );
        let read = dataset(&file, "constant", bytes).unwrap().read_raw::<f64>().unwrap();
        assert_eq!((read, bytes < 2_000_000), (data, true));
        assert!(dataset(&file, "neither", bytes).is_err());
    }

    /// A full disk is not a defect of a file's format.
    #[test]
    #[cfg(target_os = "linux")]
    fn no_room_for_a_file() {
        let wrapped = |text: &str| write_error(Path::new("a.vtkhdf"), Hdf5Error::InvalidState(text.into()));
        let full = wrapped("hdf5-io error: No space left on device (os error 28)");
        assert!(full.to_string().starts_with("cannot write a.vtkhdf: the disk is full: "), "{full}");
        assert_eq!((full.exit_code(), wrapped("something else").exit_code()), (1, 1));
        let full =
            write_error(Path::new("a.vtkhdf"), std::io::Error::from(std::io::ErrorKind::StorageFull).into());
        assert!(full.to_string().contains("the disk is full"));
    }
}
