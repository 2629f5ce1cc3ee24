//! Datasets of HDF5 files that others hand in: none is read before its size is believable.

use rust_hdf5::{H5Dataset, H5File, Hdf5Error};

/// Deflate packs at best 1032 bytes into one (Deutsch 1996, RFC 1951: 258 bytes in two bits).
const BEST_PACKING: f64 = 1032.0;
/// Bytes that a dataset or a chunk may always have: a chunk is as large as it is when only a corner of it is used.
const ALWAYS: f64 = (4 << 20) as f64;

/// Opens a dataset of a file of `file_bytes`, if the file can hold what the dataset says that it has.
///
/// A damaged or malicious header can name any size; HDF5 gives fill values for what was never written.
///
/// # Errors
/// No such dataset; more bytes, of the whole or of a chunk, than deflate can pack into the file.
pub fn dataset(file: &H5File, name: &str, file_bytes: u64) -> Result<H5Dataset, Hdf5Error> {
    let dataset = file.dataset(name)?;
    let bytes = |sizes: &[usize]| {
        sizes.iter().map(|&size| size as f64).product::<f64>() * dataset.element_size() as f64
    };
    let most = BEST_PACKING * file_bytes as f64 + ALWAYS;
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
}
