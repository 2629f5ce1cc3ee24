//! Transient VTKHDF file of known length.

use std::path::{Path, PathBuf};

use rust_hdf5::{DatatypeMessage, H5Dataset, H5Group};

use super::Layout;
use super::content::{Cells, StepContent};
use super::packed::{LEVEL, PackedRows, StoredTable, is_single};
use polycore::Error;
use polycore::hdf5::{Created, write_error};

/// The four kinds of cells of `PolyData`; ours are vertices.
const KINDS: [&str; 4] = ["Vertices", "Lines", "Polygons", "Strips"];

pub struct Writer {
    path: PathBuf,
    file: Created,
    group: H5Group,
    layout: Layout,
    /// Positions of points that move.
    points: Option<StoredTable>,
    arrays: Vec<StoredTable>,
    cell_arrays: Vec<StoredTable>,
    times: Vec<f64>,
    /// StepContent by step, in the order of the layout.
    moments: Vec<Vec<f64>>,
    steps: usize,
}

type Hdf5Result<T> = Result<T, rust_hdf5::Hdf5Error>;
type MeshContent = (Vec<[f64; 3]>, Cells);

impl Writer {
    /// Returns a file for exactly `steps` steps; of particles where there is no mesh.
    pub fn create(
        path: &Path,
        layout: &Layout,
        mesh: Option<&MeshContent>,
        steps: usize,
    ) -> Result<Self, Error> {
        Self::begin(path, layout, mesh, steps).map_err(|error| write_error(path, error))
    }

    fn begin(path: &Path, layout: &Layout, mesh: Option<&MeshContent>, steps: usize) -> Hdf5Result<Self> {
        let file = Created::new(path)?;
        let group = file.create_group("VTKHDF")?;
        group.set_attr_array_numeric("Version", &[2i64, 0])?;
        let name: &[u8] = if mesh.is_some() { b"UnstructuredGrid" } else { b"PolyData" };
        // VTK wants a fixed-length ASCII string, null-padded
        let ascii = DatatypeMessage::FixedString { size: name.len() as u32, padding: 1, charset: 0 };
        group.set_attr_typed("Type", ascii, name.to_vec())?;
        integers(&group, "NumberOfPoints", &[layout.points as i64])?;
        let points = StoredTable::new(table::<f64>(&group, "Points", 3, layout.points)?, layout.points, 3);
        let points = match mesh {
            Some((places, cells)) => {
                points.dataset.append(places.as_flattened())?;
                write_cells(&group, cells)?;
                None
            }
            None => {
                write_vertices(&group, layout.points)?;
                Some(points)
            }
        };
        let tables = |name: &str, arrays: &[(String, usize)], rows: usize| {
            let group = group.create_group(name)?;
            let create = |(name, n): &(String, usize)| {
                let table = if is_single(*n) { table::<f32> } else { table::<f64> };
                Ok(StoredTable::new(table(&group, name, *n, rows)?, rows, *n))
            };
            arrays.iter().map(create).collect::<Hdf5Result<Vec<_>>>()
        };
        let arrays = tables("PointData", &layout.arrays, layout.points)?;
        let cell_arrays =
            if mesh.is_some() { tables("CellData", &layout.cell_arrays, layout.cells)? } else { Vec::new() };
        let (path, layout) = (path.to_path_buf(), layout.clone());
        Ok(Self {
            path,
            file,
            group,
            layout,
            points,
            arrays,
            cell_arrays,
            times: Vec::new(),
            moments: Vec::new(),
            steps,
        })
    }

    pub fn step(&mut self, step: StepContent<'_>) -> Result<(), Error> {
        let tables = self.points.iter().chain(&self.arrays).chain(&self.cell_arrays);
        let rows = step.points.into_iter().chain(step.arrays).chain(step.cell_arrays);
        let all: Vec<(&StoredTable, PackedRows<'_>)> = tables.zip(rows).collect();
        StoredTable::write(all, self.times.len()).map_err(|error| write_error(&self.path, error))?;
        self.times.push(step.time);
        self.moments.push(step.moments);
        Ok(())
    }

    /// Returns the datasets of points, arrays on points and arrays on cells, in their order in a step.
    pub fn tables(&self) -> [&[StoredTable]; 3] {
        [self.points.as_slice(), &self.arrays, &self.cell_arrays]
    }

    pub fn close(self) -> Result<(), Error> {
        let path = self.path.clone();
        self.end().map_err(|error| write_error(&path, error))
    }

    fn end(self) -> Hdf5Result<()> {
        let n = self.steps;
        debug_assert_eq!(n, self.times.len());
        let group = self.group.create_group("Steps")?;
        group.set_attr_numeric("NSteps", &(n as i64))?;
        group.new_dataset::<f64>().shape([n]).create("Values")?.write_raw(&self.times)?;
        for (index, name) in self.layout.moments.iter().enumerate() {
            let values: Vec<f64> = self.moments.iter().map(|moments| moments[index]).collect();
            group.new_dataset::<f64>().shape([n]).create(name)?.write_raw(&values)?;
        }
        let rows = |count: usize| -> Vec<i64> { (0..n).map(|step| (step * count) as i64).collect() };
        let zeros = vec![0; n];
        // all steps share the one part; counting parts up here makes VTK 9.3 fail
        integers(&group, "PartOffsets", &zeros)?;
        integers(&group, "NumberOfParts", &vec![1; n])?;
        if self.points.is_some() {
            integers(&group, "PointOffsets", &rows(self.layout.points))?;
            for name in ["CellOffsets", "ConnectivityIdOffsets"] {
                let zeros = vec![0i64; n * KINDS.len()];
                group.new_dataset::<i64>().shape([n, KINDS.len()]).create(name)?.write_raw(&zeros)?;
            }
        } else {
            for name in ["PointOffsets", "CellOffsets", "ConnectivityIdOffsets"] {
                integers(&group, name, &zeros)?;
            }
        }
        for (name, arrays, count) in [
            ("PointDataOffsets", &self.layout.arrays, self.layout.points),
            ("CellDataOffsets", &self.layout.cell_arrays, self.layout.cells),
        ] {
            if name == "PointDataOffsets" || !arrays.is_empty() {
                let offsets = group.create_group(name)?;
                for (name, _) in arrays {
                    integers(&offsets, name, &rows(count))?;
                }
            }
        }
        // finalises the file and synchronises it to disk
        self.file.close()
    }
}

/// Each particle a vertex.
fn write_vertices(group: &H5Group, points: usize) -> Hdf5Result<()> {
    for kind in KINDS {
        let count = if kind == "Vertices" { points } else { 0 };
        let subgroup = group.create_group(kind)?;
        integers(&subgroup, "NumberOfCells", &[count as i64])?;
        integers(&subgroup, "NumberOfConnectivityIds", &[count as i64])?;
        let ids: Vec<i64> = (0..=count as i64).collect();
        table::<i64>(&subgroup, "Connectivity", 1, count.max(1))?.append(&ids[..count])?;
        table::<i64>(&subgroup, "Offsets", 1, count + 1)?.append(&ids)?;
    }
    Ok(())
}

fn write_cells(group: &H5Group, cells: &Cells) -> Hdf5Result<()> {
    let ids: Vec<i64> = cells.connectivity.iter().map(|&point| i64::from(point)).collect();
    let offsets: Vec<i64> = std::iter::once(0).chain(cells.ends.iter().map(|&end| end as i64)).collect();
    integers(group, "NumberOfCells", &[cells.len() as i64])?;
    integers(group, "NumberOfConnectivityIds", &[ids.len() as i64])?;
    table::<i64>(group, "Connectivity", 1, ids.len())?.append(&ids)?;
    table::<i64>(group, "Offsets", 1, offsets.len())?.append(&offsets)?;
    table::<u8>(group, "Types", 1, cells.len())?.append(&cells.types)
}

fn integers(group: &H5Group, name: &str, values: &[i64]) -> Hdf5Result<()> {
    group.new_dataset::<i64>().shape([values.len()]).create(name)?.write_raw(values)
}

/// Returns an empty compressed dataset with unlimited rows; a step is a chunk.
fn table<T: rust_hdf5::H5Type>(
    group: &H5Group,
    name: &str,
    columns: usize,
    rows: usize,
) -> Hdf5Result<H5Dataset> {
    let chunk = rows.max(1);
    let builder = group.new_dataset::<T>();
    let builder = if columns == 1 {
        builder.shape([0]).chunk(&[chunk]).max_shape(&[None])
    } else {
        builder.shape([0, columns]).chunk(&[chunk, columns]).max_shape(&[None, Some(columns)])
    };
    builder.shuffle_deflate(LEVEL).create(name)
}
