//! Variables of a netCDF file, in the classic format or in HDF5.

use crate::error::{Error, data_error};
use netcdf3::{DataVector, FileReader};
use polycore::hdf5::dataset;
use rust_hdf5::format::messages::datatype::DatatypeMessage;
use rust_hdf5::{H5Dataset, H5File};
use std::path::{Path, PathBuf};

/// An open file.
pub struct Netcdf {
    path: PathBuf,
    bytes: u64,
    format: NetcdfFormat,
}

enum NetcdfFormat {
    Classic(Box<FileReader>),
    Hdf5(H5File),
}

impl Netcdf {
    /// Opens a file.
    ///
    /// # Errors
    /// Returns an error for other formats, and I/O errors.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let read = |path: &Path| -> std::io::Result<([u8; 4], u64)> {
            let mut magic = [0; 4];
            let mut file = std::fs::File::open(path)?;
            std::io::Read::read_exact(&mut file, &mut magic)?;
            Ok((magic, file.metadata()?.len()))
        };
        let (magic, bytes) = read(path).map_err(polycore::Error::from_io("read", path))?;
        let format = match &magic {
            b"CDF\x01" | b"CDF\x02" => {
                let file = FileReader::open(path).map_err(|error| data_error(path, &format!("{error:?}")))?;
                NetcdfFormat::Classic(Box::new(file))
            }
            b"\x89HDF" => {
                NetcdfFormat::Hdf5(H5File::open(path).map_err(|error| data_error(path, &error.to_string()))?)
            }
            _ => {
                return Err(data_error(
                    path,
                    "found another format; allowed: netCDF, classic (also with 64-bit offsets) or HDF5",
                ));
            }
        };
        Ok(Self { path: path.to_path_buf(), bytes, format })
    }

    fn wrong(&self, name: &str, reason: impl std::fmt::Display) -> Error {
        data_error(&self.path, &format!("`{name}`: {reason}"))
    }

    fn dataset(&self, file: &H5File, name: &str) -> Result<H5Dataset, Error> {
        dataset(file, name, self.bytes).map_err(|error| self.wrong(name, error))
    }

    /// Returns the shape of a variable; `None` if there is no such variable.
    pub fn shape(&self, name: &str) -> Option<Vec<usize>> {
        match &self.format {
            NetcdfFormat::Classic(file) => {
                let sizes = file.data_set().get_var(name)?.get_dims();
                Some(sizes.iter().map(|size| size.size()).collect())
            }
            NetcdfFormat::Hdf5(file) => self.dataset(file, name).ok().map(|dataset| dataset.shape()),
        }
    }

    /// Reads the numbers or characters of a variable, or of one of its rows.
    ///
    /// # Errors
    /// [`Error::Data`] for a variable that is missing, damaged or larger than the file.
    pub fn numbers(&mut self, name: &str, row: Option<usize>) -> Result<Vec<f64>, Error> {
        let Some(shape) = self.shape(name) else {
            return Err(self.wrong(name, "missing (Exodus II has this variable)"));
        };
        let count = shape.iter().try_fold(8u64, |product, &size| product.checked_mul(size as u64));
        // a byte of the file gives at most eight bytes in memory, or 1032 times as many if compressed
        if count.is_none_or(|count| count > (1 << 22) + 8 * 1032 * self.bytes) {
            return Err(
                self.wrong(name, format!("found shape {shape:?}; allowed: at most the size of the file"))
            );
        }
        let found = match &mut self.format {
            NetcdfFormat::Classic(file) => {
                let data = match row {
                    None => file.read_var(name),
                    Some(row) => file.read_record(name, row),
                };
                data.map(|data| match data {
                    DataVector::I8(values) => values.into_iter().map(f64::from).collect(),
                    DataVector::U8(values) => values.into_iter().map(f64::from).collect(),
                    DataVector::I16(values) => values.into_iter().map(f64::from).collect(),
                    DataVector::I32(values) => values.into_iter().map(f64::from).collect(),
                    DataVector::F32(values) => values.into_iter().map(f64::from).collect(),
                    DataVector::F64(values) => values,
                })
                .map_err(|error| format!("{error:?}"))
            }
            NetcdfFormat::Hdf5(file) => {
                let dataset = dataset(file, name, self.bytes).map_err(|error| error.to_string());
                dataset
                    .and_then(|dataset| read_hdf5(&dataset, &shape, row).map_err(|error| error.to_string()))
            }
        };
        found.map_err(|reason| self.wrong(name, reason))
    }

    /// Reads a text attribute of a variable.
    pub fn attribute(&self, name: &str, key: &str) -> Option<String> {
        match &self.format {
            NetcdfFormat::Classic(file) => file.data_set().get_var(name)?.get_attr_as_string(key),
            NetcdfFormat::Hdf5(file) => self.dataset(file, name).ok()?.attr(key).ok()?.read_string().ok(),
        }
    }
}

fn read_hdf5(
    dataset: &H5Dataset,
    shape: &[usize],
    row: Option<usize>,
) -> Result<Vec<f64>, rust_hdf5::Hdf5Error> {
    fn read<T: rust_hdf5::H5Type>(
        dataset: &H5Dataset,
        shape: &[usize],
        row: Option<usize>,
    ) -> Result<Vec<T>, rust_hdf5::Hdf5Error> {
        let Some(row) = row else { return dataset.read_raw() };
        let (mut first, mut count) = (vec![0; shape.len()], shape.to_vec());
        if let (Some(first), Some(count)) = (first.first_mut(), count.first_mut()) {
            (*first, *count) = (row, 1);
        }
        dataset.read_slice(&first, &count)
    }
    let floats = matches!(dataset.datatype()?, DatatypeMessage::FloatingPoint { .. });
    Ok(match (dataset.element_size(), floats) {
        (8, true) => read::<f64>(dataset, shape, row)?,
        (4, true) => read::<f32>(dataset, shape, row)?.into_iter().map(f64::from).collect(),
        (8, false) => read::<i64>(dataset, shape, row)?.into_iter().map(|value| value as f64).collect(),
        (4, false) => read::<i32>(dataset, shape, row)?.into_iter().map(f64::from).collect(),
        _ => read::<u8>(dataset, shape, row)?.into_iter().map(f64::from).collect(),
    })
}
