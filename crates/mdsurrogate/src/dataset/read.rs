//! Data sets from CSV tables in three forms, and from HDF5.

use super::table::{Column, Table};
use super::{Dataset, Path, Row};
use crate::Error;
use crate::kinematics::{PeriodicBox, cauchy_of_material, stretch_of};
use polycore::constitutive::{self, hyperelastic};
use polycore::tensor::{DeformationGradient, Tensor, Voigt};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Seconds in a femtosecond.
const FEMTOSECOND: f64 = 1e-15;

const STRESSES: [&str; 6] = ["sxx", "syy", "szz", "sxy", "sxz", "syz"];
const LENGTHS: [&str; 3] = ["lx", "ly", "lz"];
const TILTS: [&str; 3] = ["xy", "xz", "yz"];

/// Which columns of a molecular dynamics table are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Columns {
    /// `avg_…`: means over the interval before each sample. Stress at one instant in a small cell is mostly the
    /// vibration of bonds (formulation.md, chapter 3).
    #[default]
    Averaged,
    /// The values at the instant of sampling.
    Instantaneous,
}

/// How a table is to be understood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReadOptions {
    /// Averaged or instantaneous.
    pub columns: Columns,
    /// Edges of the undeformed box, Å; without it, lengths are referred to the row where the file's own F is 1.
    pub reference: Option<PeriodicBox>,
    /// Pa in one unit of stress, for columns whose heading has no `[unit]`.
    pub stress_unit: f64,
}

impl Default for ReadOptions {
    /// Averaged columns, MPa.
    fn default() -> Self {
        Self { columns: Columns::Averaged, reference: None, stress_unit: 1e6 }
    }
}

/// Reads a CSV table (also gzip) or HDF5 file, and checks it ([`Dataset::check`]).
///
/// Forms of a table, told by its headings:
/// - `lx ly lz` (Å; with `xy xz yz` if the box is tilted) and `sxx syy szz sxy sxz syz` (σ), or the same with `avg_`;
/// - `F11 F12 … F33` (all nine) and `sxx …` or `avg_sxx …`;
/// - `C11 C22 C33 C12 C13 C23` and `S11 … S23`;
/// - nominal stresses of an incompressible body, as [`hyperelastic::data::Table`] has them: `stretch,nominal_MPa`,
///   `mode,stretch,nominal_MPa` (a run for each mode) or `stretch_1,stretch_2,nominal_1_MPa,nominal_2_MPa`.
///
/// Optional columns: `run_id` (without it a file is one path), `kind`, `rate_x rate_y rate_z` (1/fs), `sample`,
/// `time_fs`. Stress is in MPa, or in the unit of its heading. A row whose averaged cells are all empty (the state before a run) is skipped and counted.
///
/// # Errors
/// File, line, column, what was found and what is allowed; [`Dataset::check`].
pub fn read(path: impl AsRef<std::path::Path>, options: &ReadOptions) -> Result<Dataset, Error> {
    let path = path.as_ref();
    let set = if is_hdf5(path)? {
        #[cfg(feature = "hdf5")]
        let set = super::hdf5::read(path)?;
        #[cfg(not(feature = "hdf5"))]
        return Err(Error::file(path, "an HDF5 file", "CSV, or a build with the feature `hdf5`"));
        #[cfg(feature = "hdf5")]
        set
    } else {
        let text = Table::read(path)?;
        if ["mode", "stretch", "stretch_1"].iter().any(|name| text.has(name)) {
            nominal(&text)?
        } else {
            table(&text, options)?
        }
    };
    set.check().map_err(|error| match error {
        Error::Implausible { place, quantity, found, allowed } => {
            Error::Implausible { place: format!("{}, {place}", path.display()), quantity, found, allowed }
        }
        Error::Data { what, found, allowed } => {
            Error::Data { what, found: format!("{found} in {}", path.display()), allowed }
        }
        other => other,
    })?;
    Ok(set)
}

fn is_hdf5(path: &std::path::Path) -> Result<bool, Error> {
    use std::io::Read;
    let mut start = Vec::new();
    let file = std::fs::File::open(path).map_err(Error::io("open", path))?;
    file.take(8).read_to_end(&mut start).map_err(Error::io("read", path))?;
    let named = path.extension().is_some_and(|e| e == "h5" || e == "hdf5");
    Ok(named || start == b"\x89HDF\r\n\x1a\n")
}

/// Where a table keeps the deformation and the stress.
enum Form {
    Box { lengths: [Column; 3], tilts: Option<[Column; 3]>, reference: PeriodicBox, stress: [Column; 6] },
    Gradient { components: [Column; 9], stress: [Column; 6] },
    Material { c: [Column; 6], s: [Column; 6] },
}

impl Form {
    fn new(table: &Table, options: &ReadOptions) -> Result<Self, Error> {
        if table.has("C11") {
            let names = |letter: &str| crate::kinematics::NAMES.map(|name| format!("{letter}{name}"));
            let all: Vec<String> = names("C").into_iter().chain(names("S")).collect();
            if let Some(missing) = all.iter().find(|name| !table.has(name)) {
                let others = table.headings.iter().map(|(name, _)| name).filter(|name| !all.contains(name));
                let similar = crate::error::nearest(missing, others.map(String::as_str));
                if similar.is_some() {
                    let (path, column) = (table.path.clone(), missing.clone());
                    return Err(Error::MissingColumn { path, column, similar });
                }
                let mut allowed = "C11 C22 C33 C12 C13 C23 and S11 S22 S33 S12 S13 S23".to_owned();
                if missing.ends_with(['2', '3']) && !missing.ends_with("22") && !missing.ends_with("33") {
                    allowed += "; where there is no shear, add columns of zeros";
                }
                return Err(Error::file(&table.path, format!("no column `{missing}`"), allowed));
            }
            return Ok(Self::Material { c: table.columns(names("C"))?, s: table.columns(names("S"))? });
        }
        let prefix = match options.columns {
            Columns::Averaged => "avg_",
            Columns::Instantaneous => "",
        };
        let prefixed = |name: &str| format!("{prefix}{name}");
        let stress = || table.columns(STRESSES.map(prefixed));
        if table.has("F12") {
            let name = |k: usize| format!("F{}{}", k / 3 + 1, k % 3 + 1);
            let components = table.columns(std::array::from_fn::<_, 9, _>(name))?;
            return Ok(Self::Gradient { components, stress: stress()? });
        }
        if !LENGTHS.iter().any(|name| table.has(&prefixed(name))) {
            return Err(unknown_form(table, options.columns));
        }
        let lengths = table.columns(LENGTHS.map(prefixed))?;
        let tilted = table.has(&prefixed("xy"));
        let tilts = if tilted { Some(table.columns(TILTS.map(prefixed))?) } else { None };
        let reference = match options.reference {
            Some(reference) => reference,
            None => undeformed(table)?,
        };
        Ok(Self::Box { lengths, tilts, reference, stress: stress()? })
    }

    fn stress(&self) -> &[Column] {
        match self {
            Self::Box { stress, .. } | Self::Gradient { stress, .. } => stress,
            Self::Material { s, .. } => s,
        }
    }

    /// Whether a row has none of the values looked for.
    fn is_blank(&self, table: &Table, row: usize) -> bool {
        let blank = |column: &Column| table.text(row, *column).is_empty();
        match self {
            Self::Box { lengths, stress, .. } => lengths.iter().chain(stress).all(blank),
            Self::Gradient { stress, .. } => stress.iter().all(blank),
            Self::Material { .. } => false,
        }
    }

    fn row(
        &self,
        table: &Table,
        row: usize,
        units: &[f64; 6],
    ) -> Result<(DeformationGradient, Voigt), Error> {
        // stresses without a column are 0
        let mut stress = Voigt::zeros();
        for ((value, column), unit) in stress.iter_mut().zip(self.stress()).zip(units) {
            *value = table.number(row, *column)? * unit;
        }
        let at = |error: Error| {
            let (found, allowed) = match error {
                Error::Parameter { name, found, allowed } => (format!("{name}: {found}"), allowed),
                other => (other.to_string(), "a deformation with positive determinant".into()),
            };
            Error::file(&table.path, format!("line {}: {found}", table.line(row)), allowed)
        };
        match self {
            Self::Box { lengths, tilts, reference, .. } => {
                let lengths = table.numbers(row, lengths)?;
                let tilts = tilts.map_or(Ok([0.0; 3]), |tilts| table.numbers(row, &tilts))?;
                let current = PeriodicBox { lengths, tilts };
                Ok((current.deformation_from(reference).map_err(at)?, stress))
            }
            Self::Gradient { components, .. } => {
                let numbers = table.numbers(row, components)?;
                let f = DeformationGradient::new(Tensor::from_row_slice(&numbers));
                Ok((f.map_err(|error| at(error.into()))?, stress))
            }
            Self::Material { c, .. } => {
                let c = Voigt::from_row_slice(&table.numbers(row, c)?);
                let f = stretch_of(&c).map_err(at)?;
                Ok((f, cauchy_of_material(&f, &stress)))
            }
        }
    }
}

/// Nominal stresses over stretches: a run for each test, in order of appearance.
fn nominal(table: &Table) -> Result<Dataset, Error> {
    let path = &table.path;
    let text = std::fs::read_to_string(path).map_err(Error::io("read", path))?;
    let read = hyperelastic::data::Table::parse("", &text).map_err(|error| {
        let found = match error {
            constitutive::Error::Data { reason, .. } => reason,
            other => other.to_string(),
        };
        Error::file(path, found, "stretches and nominal stresses of an incompressible body")
    })?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut set = Dataset::default();
    for state in &read.states {
        let kind = state.mode.name();
        let known = set.paths.iter().position(|run| run.kind == kind);
        let run = known.unwrap_or_else(|| {
            let id = if table.has("mode") { kind.to_owned() } else { stem.to_string() };
            set.paths.push(Path { id, kind: kind.to_owned(), rates: [f64::NAN; 3], rows: Vec::new() });
            set.paths.len() - 1
        });
        // a body at rest is a condition, which every law here meets
        if state.nominal != [0.0; 2] {
            let rows = &mut set.paths[run].rows;
            rows.push(Row::of_nominal(rows.len() as u64, state.stretches, state.nominal)?);
        } else {
            set.skipped += 1;
        }
    }
    set.paths.retain(|run| !run.rows.is_empty());
    set.provenance.push(format!(
        "{}: {}, nominal stresses, {} rows of {} runs, {} at rest or free",
        super::table::name_of(path),
        table.fingerprint,
        set.len(),
        set.paths.len(),
        set.skipped
    ));
    Ok(set)
}

/// The error of a table without any of the forms of [`read`].
fn unknown_form(table: &Table, columns: Columns) -> Error {
    let headings: Vec<&str> = table.headings.iter().map(|(name, _)| name.as_str()).collect();
    let found = format!("the headings {}", headings.join(", "));
    let forms = "C11 C22 C33 C12 C13 C23 and S11 … S23, or F11 F12 … F33 or lx ly lz and sxx syy szz sxy sxz syz, or (rubber) \
         mode, stretch, nominal_MPa";
    let allowed = match columns {
        _ if headings.len() == 1 => format!("{forms}, separated by commas"),
        Columns::Averaged if table.has("lx") => {
            "avg_lx … avg_syz; for lx … syz as they are, `columns = \"instantaneous\"` (`--instantaneous`)"
                .into()
        }
        Columns::Averaged => format!("{forms}, the last two forms with `avg_` before lx … syz"),
        Columns::Instantaneous => forms.to_owned(),
    };
    Error::file(&table.path, found, allowed)
}

/// The box of the first row in which the file's own F is 1.
fn undeformed(table: &Table) -> Result<PeriodicBox, Error> {
    let columns = ["F11", "F22", "F33"].map(|name| table.find(name));
    let lengths = LENGTHS.map(|name| table.find(name));
    if let ([Some(a), Some(b), Some(c)], [Some(x), Some(y), Some(z)]) = (columns, lengths) {
        for row in 0..table.rows() {
            if table.numbers(row, &[a, b, c])? == [1.0; 3] {
                return Ok(PeriodicBox::orthogonal(table.numbers(row, &[x, y, z])?));
            }
        }
    }
    Err(Error::file(
        &table.path,
        "box lengths, but no row with F11 = F22 = F33 = 1 and its lx, ly, lz",
        "such a row, or `reference_lengths` in the scene",
    ))
}

fn table(table: &Table, options: &ReadOptions) -> Result<Dataset, Error> {
    let form = Form::new(table, options)?;
    let mut units = [0.0; 6];
    for (unit, column) in units.iter_mut().zip(form.stress()) {
        *unit = table.stress_unit(*column, options.stress_unit)?;
    }
    let [run, kind, sample, time] = ["run_id", "kind", "sample", "time_fs"].map(|name| table.find(name));
    let rates = ["rate_x", "rate_y", "rate_z"].map(|name| table.find(name));
    let file_name = table.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut set = Dataset::default();
    let mut index: HashMap<String, usize> = HashMap::new();
    let mut samples: HashMap<(usize, u64), u64> = HashMap::new();
    for row in 0..table.rows() {
        let id = run.map_or(file_name.as_str(), |column| table.text(row, column));
        if form.is_blank(table, row) {
            set.skipped += 1;
            continue;
        }
        let (deformation, cauchy) = form.row(table, row, &units)?;
        let path = match index.get(id) {
            Some(&path) => path,
            None => {
                let mut of_axes = [f64::NAN; 3];
                for (rate, column) in of_axes.iter_mut().zip(rates) {
                    if let Some(column) = column.filter(|column| !table.text(row, *column).is_empty()) {
                        *rate = table.number(row, column)? / FEMTOSECOND;
                    }
                }
                let kind = kind.map(|column| table.text(row, column)).filter(|kind| !kind.is_empty());
                let kind = kind.unwrap_or("unknown").to_owned();
                set.paths.push(Path { id: id.to_owned(), kind, rates: of_axes, rows: Vec::new() });
                index.insert(id.to_owned(), set.paths.len() - 1);
                set.paths.len() - 1
            }
        };
        let number = match sample {
            Some(column) => table
                .text(row, column)
                .parse()
                .map_err(|_| table.cell(row, column, "a whole number, not negative"))?,
            None => set.paths[path].rows.len() as u64,
        };
        if let Some(line) = samples.insert((path, number), table.line(row)) {
            return Err(Error::Data {
                what: "data set",
                found: format!(
                    "sample {number} of run `{id}` twice, in lines {line} and {} of {}",
                    table.line(row),
                    table.path.display()
                ),
                allowed: "each sample of a run once".into(),
            });
        }
        let time = match time {
            Some(column) => table.number(row, column)? * FEMTOSECOND,
            None => f64::NAN,
        };
        set.paths[path].rows.push(Row::new(number, time, deformation, cauchy));
    }
    for path in &mut set.paths {
        path.rows.sort_by_key(|row| row.sample);
    }
    let columns = match (&form, options.columns) {
        (Form::Material { .. }, _) => "C and S",
        (_, Columns::Averaged) => "averaged columns",
        (_, Columns::Instantaneous) => "instantaneous columns",
    };
    set.provenance.push(format!(
        "{}: {}, {columns}, {} rows of {} runs, {} skipped",
        super::table::name_of(&table.path),
        table.fingerprint,
        set.len(),
        set.paths.len(),
        set.skipped
    ));
    Ok(set)
}
