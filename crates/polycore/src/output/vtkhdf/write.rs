//! One transient VTKHDF file of known length.

use std::path::{Path, PathBuf};

use rust_hdf5::{DatatypeMessage, H5Dataset, H5File, H5Group};

use super::{Layout, format_error};
use crate::Error;

/// Rows of a compressed chunk: large enough to compress, small enough to read a step without much waste.
const CHUNK_ROWS: usize = 1 << 16;
const DEFLATE_LEVEL: u32 = 4;
/// The four kinds of cells of `PolyData`; ours are vertices.
const CELLS: [&str; 4] = ["Vertices", "Lines", "Polygons", "Strips"];

pub(super) struct Writer {
    path: PathBuf,
    file: H5File,
    group: H5Group,
    layout: Layout,
    points: H5Dataset,
    arrays: Vec<H5Dataset>,
    times: Vec<f64>,
    steps: usize,
}

type Hdf5<T> = Result<T, rust_hdf5::Hdf5Error>;

impl Writer {
    /// A file for exactly `steps` steps.
    pub(super) fn create(path: &Path, layout: &Layout, steps: usize) -> Result<Self, Error> {
        Self::begin(path, layout, steps).map_err(|error| format_error(path, error))
    }

    fn begin(path: &Path, layout: &Layout, steps: usize) -> Hdf5<Self> {
        let file = H5File::create(path)?;
        let group = file.create_group("VTKHDF")?;
        group.set_attr_array_numeric("Version", &[2i64, 0])?;
        let name = b"PolyData";
        // VTK wants a fixed-length ASCII string, null-padded
        let ascii = DatatypeMessage::FixedString { size: name.len() as u32, padding: 1, charset: 0 };
        group.set_attr_typed("Type", ascii, name.to_vec())?;
        integers(&group, "NumberOfPoints", &[layout.points as i64])?;
        for cells in CELLS {
            let count = if cells == "Vertices" { layout.points } else { 0 };
            let subgroup = group.create_group(cells)?;
            integers(&subgroup, "NumberOfCells", &[count as i64])?;
            integers(&subgroup, "NumberOfConnectivityIds", &[count as i64])?;
            let ids: Vec<i64> = (0..=count as i64).collect();
            table::<i64>(&subgroup, "Connectivity", 1, count.max(1))?.append(&ids[..count])?;
            table::<i64>(&subgroup, "Offsets", 1, count + 1)?.append(&ids)?;
        }
        let points = table::<f64>(&group, "Points", 3, layout.points)?;
        let point_data = group.create_group("PointData")?;
        let datasets =
            layout.arrays.iter().map(|(name, n)| table::<f64>(&point_data, name, *n, layout.points));
        let arrays = datasets.collect::<Hdf5<Vec<_>>>()?;
        let (path, layout) = (path.to_path_buf(), layout.clone());
        Ok(Self { path, file, group, layout, points, arrays, times: Vec::new(), steps })
    }

    pub(super) fn step<'a>(
        &mut self,
        time: f64,
        points: &[f64],
        arrays: impl Iterator<Item = &'a [f64]>,
    ) -> Result<(), Error> {
        let write = || -> Hdf5<()> {
            self.points.append(points)?;
            for (dataset, values) in self.arrays.iter().zip(arrays) {
                dataset.append(values)?;
            }
            Ok(())
        };
        write().map_err(|error| format_error(&self.path, error))?;
        self.times.push(time);
        Ok(())
    }

    pub(super) fn close(self) -> Result<(), Error> {
        let path = self.path.clone();
        self.end().map_err(|error| format_error(&path, error))
    }

    fn end(self) -> Hdf5<()> {
        let n = self.steps;
        debug_assert_eq!(n, self.times.len());
        let group = self.group.create_group("Steps")?;
        group.set_attr_numeric("NSteps", &(n as i64))?;
        group.new_dataset::<f64>().shape([n]).create("Values")?.write_raw(&self.times)?;
        let rows: Vec<i64> = (0..n).map(|step| (step * self.layout.points) as i64).collect();
        integers(&group, "PointOffsets", &rows)?;
        // all steps share the one part; counting parts up here makes VTK 9.3 fail
        integers(&group, "PartOffsets", &vec![0; n])?;
        integers(&group, "NumberOfParts", &vec![1; n])?;
        for name in ["CellOffsets", "ConnectivityIdOffsets"] {
            group.new_dataset::<i64>().shape([n, CELLS.len()]).create(name)?.write_raw(&vec![
                0i64;
                n * CELLS
                    .len()
            ])?;
        }
        let offsets = group.create_group("PointDataOffsets")?;
        for (name, _) in &self.layout.arrays {
            integers(&offsets, name, &rows)?;
        }
        // finalises the file and synchronises it to disk
        self.file.close()
    }
}

fn integers(group: &H5Group, name: &str, values: &[i64]) -> Hdf5<()> {
    group.new_dataset::<i64>().shape([values.len()]).create(name)?.write_raw(values)
}

/// An empty compressed dataset with unlimited rows.
fn table<T: rust_hdf5::H5Type>(group: &H5Group, name: &str, columns: usize, rows: usize) -> Hdf5<H5Dataset> {
    let chunk = rows.clamp(1, CHUNK_ROWS);
    let builder = group.new_dataset::<T>();
    let builder = if columns == 1 {
        builder.shape([0]).chunk(&[chunk]).max_shape(&[None])
    } else {
        builder.shape([0, columns]).chunk(&[chunk, columns]).max_shape(&[None, Some(columns)])
    };
    builder.shuffle_deflate(DEFLATE_LEVEL).create(name)
}
