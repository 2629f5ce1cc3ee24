//! HDF5: data sets of molecular dynamics, ours and others', and fields over time.

use super::{attack_files, fs};
use harness::output::vtkhdf::{self, Cells, MeshSeries, ParticleSeries};
use mdsurrogate::dataset::{Fractions, ReadOptions, SplitMethod, Standardisation, hdf5, read, split};
use rust_hdf5::{H5File, LibverBound};
use std::path::{Path, PathBuf};

/// Six paths of `rows` rows, as a table of C and S.
fn table(rows: usize) -> String {
    let mut text = String::from("run_id,kind,sample,C11,C22,C33,C12,C13,C23,S11,S22,S33,S12,S13,S23\n");
    for (path, row) in (0..6).flat_map(|path| (0..rows).map(move |row| (path, row))) {
        let strain = 0.01 * (1 + row) as f64 * (1.0 + 0.1 * f64::from(path));
        text += &format!("p{path},ux,{row},{},1,1,0,0,0,{},1,1,0,0,0\n", 1.0 + strain, 500.0 * strain);
    }
    text
}

/// Files as this project writes them, with and without a split, and of other origin: C and S alone, in the
/// formats of HDF5 1.8 and 1.6, contiguous and in compressed chunks.
fn data_sets(folder: &Path) -> Vec<PathBuf> {
    let csv = folder.join("a.csv");
    fs::write(&csv, table(6)).unwrap();
    let set = read(&csv, &ReadOptions::default()).unwrap();
    let parts = split(&set, SplitMethod::Path, Fractions::default(), 1).unwrap();
    let standardisation =
        Standardisation::from_rows(set.rows().map(|row| &row.c).collect::<Vec<_>>().into_iter());
    let files = ["plain.h5", "split.h5", "old.h5", "new.h5"].map(|name| folder.join(name));
    hdf5::write(&files[0], &set, None).unwrap();
    hdf5::write(&files[1], &set, Some((&parts, &standardisation.unwrap()))).unwrap();
    for (path, version) in files[2..].iter().zip([LibverBound::Earliest, LibverBound::V18]) {
        let file = H5File::options().libver(version).create(path).unwrap();
        let rows: Vec<_> = set.rows().collect();
        let six = |pick: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
            (0..6 * rows.len()).map(|index| pick(index / 6, index % 6)).collect()
        };
        let shape = [rows.len(), 6];
        let c = file.new_dataset::<f64>().shape(shape).create("C").unwrap();
        c.write_raw(&six(&|row, a| rows[row].c[a])).unwrap();
        let s = file.new_dataset::<f64>().shape(shape).chunk(&[5, 6]).shuffle_deflate(4).create("S").unwrap();
        s.write_raw(&six(&|row, a| rows[row].s[a])).unwrap();
        file.close().unwrap();
    }
    for path in &files {
        assert_eq!(read(path, &ReadOptions::default()).unwrap().len(), 36, "{}", path.display());
    }
    files.into()
}

#[test]
fn data_sets_in_hdf5() {
    let folder = tempfile::tempdir().unwrap();
    let files = data_sets(folder.path());
    attack_files("HDF5 data set", &files, "data.h5", |path| {
        read(path, &ReadOptions::default()).map(|_| ()).map_err(|error| error.to_string())
    });
}

/// Particles and a mesh, three steps each.
fn fields(folder: &Path) -> Vec<PathBuf> {
    let points: Vec<[f64; 3]> = (0..8).map(|k| [k & 1, k >> 1 & 1, k >> 2].map(f64::from)).collect();
    let scalars: Vec<f64> = (0..8).map(f64::from).collect();
    let vectors: Vec<f64> = points.concat();
    let mut cells = Cells { connectivity: Vec::new(), ends: Vec::new(), types: Vec::new() };
    cells.push(12, &[0, 1, 3, 2, 4, 5, 7, 6]);
    let mut particles = ParticleSeries::create(folder.join("particles.vtkhdf")).unwrap();
    let mut mesh = MeshSeries::create(folder.join("mesh.vtkhdf"), points.clone(), cells).unwrap();
    for step in 0..3 {
        let data = [("u", 3, &vectors[..]), ("damage", 1, &scalars[..])];
        particles.step(f64::from(step), &points, &data).unwrap();
        mesh.step(f64::from(step), &data[1..], &[("alpha", 1, &[0.5])]).unwrap();
    }
    vec![particles.finish().unwrap(), mesh.finish().unwrap()]
}

#[test]
fn fields_over_time() {
    let folder = tempfile::tempdir().unwrap();
    let files = fields(folder.path());
    attack_files("VTKHDF", &files, "fields.vtkhdf", |path| {
        let told = |error: polycore::Error| error.to_string();
        let series = vtkhdf::read(path).map_err(told)?;
        for step in 0..series.len().min(4) {
            series.points(step).map_err(told)?;
            for (name, _) in series.arrays() {
                series.data(step, name).map_err(told)?;
            }
            for (name, _) in series.cell_arrays() {
                series.cell_data(step, name).map_err(told)?;
            }
        }
        Ok(())
    });
}
