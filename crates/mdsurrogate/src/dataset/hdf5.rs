//! Data sets in HDF5, in the project's layout.
//!
//! Root: attributes `format` = [`FORMAT`], `skipped`; datasets `C`, `S` (N, 6), `F` (N, 9, row by row),
//! `cauchy` (N, 6), all SI, `sample`, `path` (N, i64), `time` (N, s); group `paths`: `id`, `kind` (P,
//! strings), `rates` (P, 3, 1/s, NaN for an axis that is not pulled); `provenance` (strings). A written split
//! adds `split` (N, u8: 0 train, 1 validation, 2 test) and the standardisation of the training rows, `mean`
//! and `deviation` (6) in the group `standardisation`. Other files need only `C` and `S`, (N, 6) or (N, 3,
//! 3), of any numeric type, or `F` (N, 9 or 3, 3) with `cauchy` or `P` (first Piola–Kirchhoff stress);
//! without `path` they are one path.

use super::stress::{SymmetryCheck, cauchy_of_first};
use super::{DataRow, DataSplit, Dataset, Path, Standardisation};
use crate::Error;
use crate::kinematics::{cauchy_from_material, material_pair, stretch_from_c};
use polycore::hdf5::{Created, dataset};
use polycore::tensor::{DeformationGradient, Tensor, Voigt};
use rust_hdf5::{DatatypeMessage, H5Dataset, H5File, H5Group};

/// Value of the attribute `format`.
pub const FORMAT: &str = "mdsurrogate data 1";

const DEFLATE_LEVEL: u32 = 4;
const CHUNK_ROWS: usize = 4096;
/// Largest integer up to which f64 is exact.
const LARGEST_WHOLE: f64 = 9_007_199_254_740_992.0;
/// Relative asymmetry of a symmetric tensor in single precision.
const ASYMMETRY_TOLERANCE: f64 = 1e-5;

type Hdf5Result<T> = Result<T, rust_hdf5::Hdf5Error>;

/// Writes a set, optionally with its split and the standardisation of the training rows; whole or not at all.
///
/// # Errors
/// Returns [`Error::File`] or an I/O error; an existing file then stays unchanged.
pub fn write(
    path: impl AsRef<std::path::Path>,
    set: &Dataset,
    split: Option<(&DataSplit, &Standardisation)>,
) -> Result<(), Error> {
    let path = path.as_ref();
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let temporary = tempfile::Builder::new()
        .prefix(".")
        .suffix(".part")
        .tempdir_in(folder.unwrap_or(".".as_ref()))
        .map_err(Error::from_io("create a folder beside", path))?;
    let inside = temporary.path().join("data.h5");
    fill(&inside, set, split).map_err(|error| polycore::hdf5::write_error(path, error))?;
    std::fs::File::open(&inside)
        .and_then(|file| file.sync_all())
        .map_err(Error::from_io("synchronise", path))?;
    std::fs::rename(&inside, path).map_err(Error::from_io("write", path))
}

fn fill(
    path: &std::path::Path,
    set: &Dataset,
    split: Option<(&DataSplit, &Standardisation)>,
) -> Hdf5Result<()> {
    let file = Created::new(path)?;
    let root = file.root_group();
    file.set_attr_string("format", FORMAT)?;
    file.set_attr_numeric("skipped", &(set.skipped as i64))?;
    let rows: Vec<&DataRow> = set.rows().collect();
    let six = |pick: fn(&DataRow) -> &Voigt| -> Vec<f64> {
        rows.iter().flat_map(|row| pick(row).iter().copied()).collect()
    };
    table(&root, "C", 6, &six(|row| &row.c))?;
    table(&root, "S", 6, &six(|row| &row.s))?;
    table(&root, "cauchy", 6, &six(|row| &row.cauchy))?;
    // nalgebra stores columns: the columns of the transpose are the rows
    let gradients: Vec<f64> =
        rows.iter().flat_map(|row| row.deformation.matrix().transpose().as_slice().to_vec()).collect();
    table(&root, "F", 9, &gradients)?;
    let integers = |name: &str, data: Vec<i64>| {
        root.new_dataset::<i64>().shape([data.len()]).create(name)?.write_raw(&data)
    };
    integers("sample", rows.iter().map(|row| row.sample as i64).collect())?;
    integers("path", set.path_of_rows().into_iter().map(|path| path as i64).collect())?;
    let times: Vec<f64> = rows.iter().map(|row| row.time).collect();
    root.new_dataset::<f64>().shape([times.len()]).create("time")?.write_raw(&times)?;
    let paths = file.create_group("paths")?;
    paths.write_vlen_strings("id", &set.paths.iter().map(|path| path.id.as_str()).collect::<Vec<_>>())?;
    paths.write_vlen_strings("kind", &set.paths.iter().map(|path| path.kind.as_str()).collect::<Vec<_>>())?;
    table(&paths, "rates", 3, &set.paths.iter().flat_map(|path| path.rates).collect::<Vec<_>>())?;
    file.write_vlen_strings("provenance", &set.provenance.iter().map(String::as_str).collect::<Vec<_>>())?;
    if let Some((split, standardisation)) = split {
        let labels = split.labels();
        let dataset = root.new_dataset::<u8>().shape([labels.len()]).create("split")?;
        dataset.write_raw(&labels)?;
        let group = file.create_group("standardisation")?;
        for (name, data) in [("mean", &standardisation.mean), ("deviation", &standardisation.deviation)] {
            group.new_dataset::<f64>().shape([6]).create(name)?.write_raw(data)?;
        }
    }
    file.close()
}

fn table(group: &H5Group, name: &str, columns: usize, data: &[f64]) -> Hdf5Result<()> {
    let rows = data.len() / columns;
    let builder = group.new_dataset::<f64>().shape([rows, columns]);
    let builder = builder.chunk(&[rows.clamp(1, CHUNK_ROWS), columns]).shuffle_deflate(DEFLATE_LEVEL);
    builder.create(name)?.write_raw(data)
}

/// Reads a data set.
///
/// # Errors
/// Returns [`Error::File`] for other formats, missing datasets, wrong shapes, and invalid deformations.
pub fn read(path: impl AsRef<std::path::Path>) -> Result<Dataset, Error> {
    let path = path.as_ref();
    let size = std::fs::metadata(path).map_err(Error::from_io("open", path))?.len();
    let damaged =
        |error: rust_hdf5::Hdf5Error| Error::file(path, format!("an unreadable file ({error})"), "HDF5");
    let file = H5File::open(path).map_err(damaged)?;
    let root = file.root_group();
    let names = root.dataset_names().map_err(damaged)?;
    let fail = |found: String, allowed: &str| Error::file(path, found, allowed);
    let numbers = |name: &str, columns: usize| -> Result<Vec<f64>, Error> {
        if !names.iter().any(|other| other == name) {
            let similar = crate::error::nearest(name, names.iter().map(String::as_str));
            return Err(Error::MissingColumn { path: path.to_path_buf(), column: name.into(), similar });
        }
        let dataset = dataset(&file, name, size).map_err(damaged)?;
        let shape = dataset.shape();
        let tensors = shape.len() == 3 && shape[1..] == [3, 3];
        if !(tensors || shape.len() == 2 && shape[1] == columns) {
            let allowed = format!("(N, {columns}) or (N, 3, 3)");
            return Err(fail(format!("dataset `{name}` of shape {shape:?}"), &allowed));
        }
        let mut data = floats(&dataset, name, path)?;
        if tensors && columns == 6 {
            data = symmetric(&data).ok_or_else(|| {
                fail(format!("asymmetric tensors in dataset `{name}`"), "symmetric tensors")
            })?;
        }
        match data.iter().position(|value| !value.is_finite()) {
            Some(at) => Err(fail(
                format!("{} in row {} of dataset `{name}`", data[at], at / columns),
                "finite numbers",
            )),
            None => Ok(data),
        }
    };
    let integers = |name: &str, rows: usize| -> Result<Option<Vec<i64>>, Error> {
        if !names.iter().any(|other| other == name) {
            return Ok(None);
        }
        let data = floats(&dataset(&file, name, size).map_err(damaged)?, name, path)?;
        let whole = |value: &f64| value.fract() == 0.0 && (0.0..=LARGEST_WHOLE).contains(value);
        if let Some(wrong) = data.iter().find(|value| !whole(value)) {
            return Err(fail(format!("{wrong} in dataset `{name}`"), "non-negative integers"));
        }
        if data.len() != rows {
            return Err(fail(format!("{} numbers in dataset `{name}`", data.len()), &rows.to_string()));
        }
        Ok(Some(data.into_iter().map(|value| value as i64).collect()))
    };
    let has = |name: &str| names.iter().any(|other| other == name);
    let from_gradient = !has("C") && has("F");
    let (c, s) = if from_gradient {
        from_gradients(path, &numbers, has("P"))?
    } else {
        (numbers("C", 6)?, numbers("S", 6)?)
    };
    let rows = c.len() / 6;
    if s.len() != c.len() {
        return Err(fail(format!("{} rows of S for {rows} of C", s.len() / 6), "the same number"));
    }
    let full = ["F", "cauchy"].into_iter().all(has);
    let gradients = if full { Some((numbers("F", 9)?, numbers("cauchy", 6)?)) } else { None };
    if let Some((f, cauchy)) = &gradients
        && (f.len() != 9 * rows || cauchy.len() != 6 * rows)
    {
        return Err(fail(
            format!("different numbers of rows in F, cauchy and C ({rows})"),
            "the same number",
        ));
    }
    let samples = integers("sample", rows)?;
    let of_rows = integers("path", rows)?.unwrap_or_else(|| vec![0; rows]);
    let times = match has("time") {
        true => floats(&dataset(&file, "time", size).map_err(damaged)?, "time", path)?,
        false => Vec::new(),
    };
    let mut set = Dataset { paths: paths(&file, path, size, &of_rows)?, ..Dataset::default() };
    for row in 0..rows {
        let six = |data: &[f64]| Voigt::from_row_slice(&data[6 * row..6 * row + 6]);
        let at = |error: Error| fail(format!("row {row}: {error}"), "a deformation and its stress");
        let target = &mut set.paths[of_rows[row] as usize].rows;
        let sample = samples.as_ref().map_or(target.len() as u64, |samples| samples[row] as u64);
        let time = times.get(row).copied().unwrap_or(f64::NAN);
        let (c, s) = (six(&c), six(&s));
        let (deformation, cauchy) = match &gradients {
            Some((f, cauchy)) => {
                let f = DeformationGradient::new(Tensor::from_row_slice(&f[9 * row..9 * row + 9]));
                (f.map_err(|error| at(error.into()))?, six(cauchy))
            }
            None => {
                let f = stretch_from_c(&c).map_err(at)?;
                (f, cauchy_from_material(&f, &s))
            }
        };
        target.push(DataRow { sample, time, deformation, cauchy, c, s, nominal: None });
    }
    if has("provenance") {
        let lines = dataset(&file, "provenance", size).and_then(|dataset| dataset.read_vlen_strings());
        set.provenance = lines.map_err(damaged)?;
    }
    set.provenance.push(format!("{}: {size} bytes, HDF5, {rows} rows", polycore::file::name_of(path)));
    Ok(set)
}

/// Returns C and S, six numbers per row, from F and either P (nine) or σ (six).
fn from_gradients(
    path: &std::path::Path,
    numbers: &impl Fn(&str, usize) -> Result<Vec<f64>, Error>,
    first: bool,
) -> Result<(Vec<f64>, Vec<f64>), Error> {
    let (name, width) = if first { ("P", 9) } else { ("cauchy", 6) };
    let (f, stress) = (numbers("F", 9)?, numbers(name, width)?);
    let (mut c, mut s) = (Vec::new(), Vec::new());
    let mut symmetry = SymmetryCheck::default();
    if stress.len() / width != f.len() / 9 {
        let found = format!("{} rows of {name} for {} of F", stress.len() / width, f.len() / 9);
        return Err(Error::file(path, found, "the same number"));
    }
    for (row, (f, stress)) in f.chunks_exact(9).zip(stress.chunks_exact(width)).enumerate() {
        let f = DeformationGradient::new(Tensor::from_row_slice(f));
        let f = f.map_err(|error| Error::file(path, format!("row {row}: {error}"), "a deformation"))?;
        let cauchy = if first { cauchy_of_first(&f, stress) } else { Voigt::from_row_slice(stress) };
        if first {
            symmetry.add(&f, stress);
        }
        let (c_, s_) = material_pair(&f, &cauchy);
        c.extend(c_.iter());
        s.extend(s_.iter());
    }
    symmetry.check(path)?;
    Ok((c, s))
}

/// Reads a dataset of floats or integers of any width and byte order.
fn floats(dataset: &H5Dataset, name: &str, path: &std::path::Path) -> Result<Vec<f64>, Error> {
    let damaged =
        |error: rust_hdf5::Hdf5Error| Error::file(path, format!("dataset `{name}`: {error}"), "HDF5");
    match dataset.datatype().map_err(damaged)? {
        DatatypeMessage::FixedPoint { signed: true, .. } => Ok(dataset
            .read_numeric_as::<i64>()
            .map_err(damaged)?
            .into_iter()
            .map(|value| value as f64)
            .collect()),
        DatatypeMessage::FixedPoint { .. } => Ok(dataset
            .read_numeric_as::<u64>()
            .map_err(damaged)?
            .into_iter()
            .map(|value| value as f64)
            .collect()),
        DatatypeMessage::FloatingPoint { .. } => dataset.read_numeric_as::<f64>().map_err(damaged),
        other => {
            let found = format!("dataset `{name}` of type {other}");
            Err(Error::file(path, found, "floats or integers"))
        }
    }
}

/// Returns the components 11, 22, 33, 12, 13, 23 of tensors of nine; `None` for an asymmetric tensor.
fn symmetric(data: &[f64]) -> Option<Vec<f64>> {
    let mut six = Vec::with_capacity(data.len() / 9 * 6);
    for tensor in data.chunks_exact(9) {
        let size = tensor.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
        if [(1, 3), (2, 6), (5, 7)]
            .iter()
            .any(|&(a, b)| (tensor[a] - tensor[b]).abs() > ASYMMETRY_TOLERANCE * size)
        {
            return None;
        }
        let mean = |a: usize, b: usize| 0.5 * (tensor[a] + tensor[b]);
        six.extend([tensor[0], tensor[4], tensor[8], mean(1, 3), mean(2, 6), mean(5, 7)]);
    }
    Some(six)
}

/// Returns empty paths with names, kinds and rates.
fn paths(file: &H5File, path: &std::path::Path, size: u64, of_rows: &[i64]) -> Result<Vec<Path>, Error> {
    let damaged = |error: rust_hdf5::Hdf5Error| Error::file(path, format!("damaged HDF5 ({error})"), "HDF5");
    let count = of_rows.iter().max().map_or(0, |last| *last as usize + 1);
    let groups = file.root_group().group_names().map_err(damaged)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if !groups.iter().any(|group| group == "paths") {
        if count > of_rows.len() {
            return Err(Error::file(
                path,
                format!("path number {}", count - 1),
                "a number below the row count",
            ));
        }
        let blank = |index| Path {
            id: if count == 1 { name.to_string() } else { format!("{name}:{index}") },
            kind: "unknown".into(),
            rates: [f64::NAN; 3],
            rows: Vec::new(),
        };
        return Ok((0..count).map(blank).collect());
    }
    let strings = |name: &str| {
        let dataset = dataset(file, &format!("paths/{name}"), size);
        dataset.and_then(|dataset| dataset.read_vlen_strings()).map_err(damaged)
    };
    let (ids, kinds) = (strings("id")?, strings("kind")?);
    let rates = floats(&dataset(file, "paths/rates", size).map_err(damaged)?, "paths/rates", path)?;
    if kinds.len() != ids.len() || rates.len() != 3 * ids.len() || count > ids.len() {
        let found = format!("{} ids, {} kinds, {} rates", ids.len(), kinds.len(), rates.len());
        return Err(Error::file(path, found, "one id, one kind and three rates per path"));
    }
    let build = |(index, (id, kind)): (usize, (String, String))| {
        let rates = [rates[3 * index], rates[3 * index + 1], rates[3 * index + 2]];
        Path { id, kind, rates, rows: Vec::new() }
    };
    Ok(ids.into_iter().zip(kinds).enumerate().map(build).collect())
}
