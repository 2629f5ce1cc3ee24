//! The rows of a step in a dataset: one chunk, packed here, on all threads, and copied packed from file to
//! file.

use std::borrow::Cow;
use std::io::Write;

use flate2::{Compression, write::ZlibEncoder};
use rayon::prelude::*;
use rust_hdf5::{H5Dataset, H5File, Hdf5Error};

/// Deflate's level: the last bits of measured numbers cannot be packed, and higher levels take long to find
/// that out.
pub const LEVEL: u32 = 2;
/// HDF5's numbers of the filters shuffle and deflate.
const FILTERS: [u16; 2] = [2, 1];
/// Bytes that are sorted at a time, before they are packed.
const BLOCK: usize = 1 << 16;

/// Returns whether an array of so many components is stored in single precision: second-order tensors, the
/// bulk of a file, whose seventh digit no one needs.
pub fn is_single(components: usize) -> bool {
    components == 9
}

/// A dataset of which each step is a chunk.
pub struct StoredTable {
    pub dataset: H5Dataset,
    rows: usize,
    columns: usize,
}

/// Values of a step as they are written.
pub enum PackedRows<'a> {
    /// Double precision.
    Values(Cow<'a, [f64]>),
    /// Packed as [`StoredTable::write`] does it.
    Packed(Vec<u8>),
}

impl StoredTable {
    /// Creates an array of so many rows per step and so many components.
    pub fn new(dataset: H5Dataset, rows: usize, columns: usize) -> Self {
        Self { dataset, rows, columns }
    }

    /// Writes the step `at` of each table.
    pub fn write(all: Vec<(&Self, PackedRows<'_>)>, at: usize) -> Result<(), Hdf5Error> {
        // as many at a time as there are threads: packed arrays are nearly as large as those that the caller
        // holds
        for some in all.chunks(rayon::current_num_threads()) {
            let work: Vec<(usize, &PackedRows<'_>)> =
                some.iter().map(|(table, rows)| (table.columns, rows)).collect();
            let packed: Vec<Cow<'_, [u8]>> = work.into_par_iter().map(|(n, rows)| rows.packed(n)).collect();
            for ((table, _), packed) in some.iter().zip(packed) {
                table.dataset.write_chunk_raw_at(&table.place(at), &packed, 0)?;
            }
        }
        Ok(())
    }

    /// Returns the chunk of a step.
    fn place(&self, at: usize) -> Vec<usize> {
        if self.columns == 1 { vec![at] } else { vec![at, 0] }
    }

    /// Returns the step `at` of the same dataset of another file as it is packed there, if it is stored in
    /// the same way.
    pub fn same_of(&self, file: &H5File, name: &str, at: usize) -> Option<Vec<u8>> {
        let other = file.dataset(name).ok()?;
        let chunk = if self.columns == 1 { vec![self.rows] } else { vec![self.rows, self.columns] };
        let filters = other.filters().ok()?.iter().map(|filter| filter.id).collect::<Vec<_>>();
        let stored = (other.chunk_dims()?, other.element_size(), filters);
        if stored != (chunk, self.dataset.element_size(), FILTERS.to_vec()) {
            return None;
        }
        other
            .read_chunk_raw_at(&self.place(at))
            .ok()
            .filter(|(_, left_out)| *left_out == 0)
            .map(|(bytes, _)| bytes)
    }
}

impl PackedRows<'_> {
    /// Packs an array of so many components with HDF5's filters.
    fn packed(&self, components: usize) -> Cow<'_, [u8]> {
        let values = match self {
            PackedRows::Values(values) => values,
            PackedRows::Packed(bytes) => return Cow::Borrowed(bytes),
        };
        Cow::Owned(match is_single(components) {
            true => packed(values, |value| (value as f32).to_le_bytes()),
            false => packed(values, f64::to_le_bytes),
        })
    }
}

/// Returns the first bytes of all values, then their second bytes, and so on (HDF5's shuffle), deflated.
fn packed<const N: usize>(values: &[f64], bytes: impl Fn(f64) -> [u8; N]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::with_capacity(values.len() * N / 2), Compression::new(LEVEL));
    let mut sorted = Vec::with_capacity(BLOCK);
    for byte in 0..N {
        for values in values.chunks(BLOCK) {
            sorted.clear();
            sorted.extend(values.iter().map(|&value| bytes(value)[byte]));
            encoder.write_all(&sorted).expect("a list takes all bytes");
        }
    }
    encoder.finish().expect("a list takes all bytes")
}

#[cfg(test)]
mod tests {
    use super::*;
    use rust_hdf5::H5Type;
    use std::path::Path;

    /// Returns a file with an array `a` of some rows to a chunk, and its table.
    fn begun<T: H5Type>(path: &Path, rows: usize, columns: usize) -> (H5File, StoredTable) {
        let file = H5File::create(path).unwrap();
        let builder = file.new_dataset::<T>().shape([0, columns]).chunk(&[rows, columns]);
        let builder = builder.max_shape(&[None, Some(columns)]).shuffle_deflate(LEVEL);
        let table = StoredTable::new(builder.create("a").unwrap(), rows, columns);
        (file, table)
    }

    fn read(path: &Path) -> Vec<f64> {
        H5File::open(path).unwrap().dataset("a").unwrap().read_numeric_as().unwrap()
    }

    /// The library unpacks what is packed here, steps in any order; tensors keep seven digits.
    #[test]
    fn rows_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.h5");
        for (columns, error) in [(3, 0.0), (9, 6e-8)] {
            let values: Vec<f64> = (0..8 * columns).map(|k| (1.0 + k as f64).ln() - 2.0).collect();
            let create = if is_single(columns) { begun::<f32> } else { begun::<f64> };
            let (file, table) = create(&path, 4, columns);
            let (first, second) = values.split_at(4 * columns);
            StoredTable::write(vec![(&table, PackedRows::Values(second.into()))], 1).unwrap();
            StoredTable::write(vec![(&table, PackedRows::Values(first.into()))], 0).unwrap();
            file.close().unwrap();
            let found = read(&path);
            let far = found.iter().zip(&values).map(|(a, b)| ((a - b) / b).abs()).fold(0.0, f64::max);
            assert!(found.len() == values.len() && far <= error, "{columns} components: {far:e}");
        }
    }

    /// Packed rows are copied between files of this version, and not where another version has written them.
    #[test]
    fn packed_rows_are_copied_where_files_are_alike() {
        let folder = tempfile::tempdir().unwrap();
        let [from, to] = ["from.h5", "to.h5"].map(|name| folder.path().join(name));
        let values: Vec<f64> = (0..36).map(f64::from).collect();
        for (single, rows, alike) in [(true, 4, true), (false, 4, false), (true, 2, false)] {
            let (file, table) =
                if single { begun::<f32>(&from, rows, 9) } else { begun::<f64>(&from, rows, 9) };
            let values = &values[..9 * rows];
            let rows = if single {
                PackedRows::Values(values.into())
            } else {
                PackedRows::Packed(packed(values, f64::to_le_bytes))
            };
            StoredTable::write(vec![(&table, rows)], 0).unwrap();
            file.close().unwrap();
            let (file, table) = begun::<f32>(&to, 4, 9);
            let bytes = table.same_of(&H5File::open(&from).unwrap(), "a", 0);
            assert_eq!(bytes.is_some(), alike, "{single} {}", values.len());
            if let Some(bytes) = bytes {
                StoredTable::write(vec![(&table, PackedRows::Packed(bytes))], 0).unwrap();
                file.close().unwrap();
                assert_eq!(read(&to), values);
            }
        }
    }
}
