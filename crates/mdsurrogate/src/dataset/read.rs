//! Data sets from CSV tables, LAMMPS output and HDF5.

use super::boxes::{BoxColumns, TableRun};
use super::options::{BoxReference, LENGTHS, ReadOptions, SampledColumns};
use super::stress::{StressColumns, SymmetryCheck, tensor_names};
use super::table::{ColumnIndex, DataTable};
use super::{DataRow, Dataset, Path};
use crate::Error;
use crate::kinematics::{NAMES, stretch_from_c};
use polycore::constitutive::{self, hyperelastic};
use polycore::tensor::{DeformationGradient, Tensor, Voigt};
use std::collections::HashMap;

/// Seconds in a femtosecond.
const FEMTOSECOND: f64 = 1e-15;

/// Reads and checks a CSV table (also compressed by gzip), LAMMPS output or an HDF5 file.
///
/// Forms of a table, recognized by its headings:
/// - `lx ly lz` (Å; with `xy xz yz` if the box is tilted) and `sxx syy szz sxy sxz syz` (σ), or the same with
///   `avg_`; F is H H₀⁻¹ with the undeformed box H₀ of each run, and flips of a tilted box are undone;
/// - `F11 F12 … F33` (all nine) and `sxx …` or `avg_sxx …`, `S11 …`, or the nine components `P11 P12 … P33`
///   of the first Piola–Kirchhoff stress;
/// - thermo output in LAMMPS logs (also `thermo_style yaml`), and files of `fix ave/time`;
/// - `C11 C22 C33 C12 C13 C23` and `S11 … S23`;
/// - nominal stresses of an incompressible body, as in [`hyperelastic::data::TestData`]:
///   `stretch,nominal_MPa`, `mode,stretch,nominal_MPa` (a run per mode) or
///   `stretch_1,stretch_2,nominal_1_MPa,nominal_2_MPa`.
///
/// Optional columns: `run_id` (default: a file is one path), `kind`, `rate_x rate_y rate_z` (1/fs), `sample`,
/// `time_fs`. Stress is in MPa, or in the unit of its heading. Pressures (`pxx …`, σ = −p) need
/// [`ReadOptions::pressure`].
/// Rows whose averaged cells are all empty (the state before a run) are skipped and counted.
///
/// # Errors
/// Returns file, line, column, value and allowed values, and the errors of [`Dataset::check`].
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
        let text = DataTable::read(path, options)?;
        if is_rubber(&text) { nominal(&text)? } else { table(&text, options)? }
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

/// Tells if a table has tests of rubber: stretches or strains, but no tensors or boxes.
fn is_rubber(table: &DataTable) -> bool {
    let has_tensors = ["C11", "F11", "lx", "avg_lx", "P11", "S11"].iter().any(|name| table.contains(name));
    let words = ["stretch", "strain", "dehnung"];
    let is_stretch = |name: &str| {
        let lower = name.to_lowercase();
        lower == "mode" || words.iter().any(|word| lower.contains(word))
    };
    !has_tensors && !table.is_lammps() && table.headings.iter().any(|(name, _)| is_stretch(name))
}

pub(super) fn is_hdf5(path: &std::path::Path) -> Result<bool, Error> {
    use std::io::Read;
    let mut start = Vec::new();
    let file = std::fs::File::open(path).map_err(Error::from_io("open", path))?;
    file.take(8).read_to_end(&mut start).map_err(Error::from_io("read", path))?;
    let named = path.extension().is_some_and(|e| e == "h5" || e == "hdf5");
    Ok(named || start == b"\x89HDF\r\n\x1a\n")
}

/// Columns of the deformation.
enum DeformationColumns {
    Box(BoxColumns),
    Gradient([ColumnIndex; 9]),
    Material([ColumnIndex; 6]),
}

/// Columns of a table.
pub(super) struct TableLayout {
    form: DeformationColumns,
    stress: Option<StressColumns>,
    /// Description of the columns.
    name: String,
}

impl TableLayout {
    /// Finds the columns of a table; `stressed` is false for predictions.
    pub fn new(table: &DataTable, options: &ReadOptions, stressed: bool) -> Result<Self, Error> {
        if table.contains("C11") {
            let names = |letter: &str| NAMES.map(|name| format!("{letter}{name}"));
            require_material(table, [names("C"), names("S")].as_flattened())?;
            let (c, s) = (table.columns(names("C"))?, table.columns(names("S"))?);
            return Ok(Self {
                form: DeformationColumns::Material(c),
                stress: Some(StressColumns::Second(s)),
                name: "C and S".into(),
            });
        }
        let (mut prefix, mut name) = match (table.is_lammps(), options.columns) {
            (true, _) => ("", "LAMMPS"),
            (_, SampledColumns::Averaged) => ("avg_", "averaged columns"),
            (_, SampledColumns::Instantaneous) => ("", "instantaneous columns"),
        };
        let form = if table.contains("F12") {
            // a table without averaged columns leaves no choice
            if !prefix.is_empty() && !table.headings.iter().any(|(name, _)| name.starts_with(prefix)) {
                (prefix, name) = ("", "F");
            }
            DeformationColumns::Gradient(table.columns(tensor_names("F"))?)
        } else if LENGTHS.iter().any(|name| table.contains(&format!("{prefix}{name}"))) {
            DeformationColumns::Box(BoxColumns::new(table, prefix)?)
        } else {
            return Err(unknown_form(table, options.columns));
        };
        let stress = if stressed { Some(StressColumns::find(table, prefix, options)?) } else { None };
        let name = match stress {
            None | Some(StressColumns::Cauchy(_)) => name.to_owned(),
            Some(stress) => format!("{name}, {}", stress.name()),
        };
        Ok(Self { form, stress, name })
    }

    fn stress(&self) -> &[ColumnIndex] {
        self.stress.as_ref().map_or(&[], StressColumns::columns)
    }

    /// Tells if a row has no values.
    fn is_blank(&self, table: &DataTable, row: usize) -> bool {
        let blank = |column: &ColumnIndex| table.text(row, *column).is_empty();
        match &self.form {
            DeformationColumns::Box(boxes) => boxes.lengths().iter().chain(self.stress()).all(blank),
            DeformationColumns::Gradient(_) => !self.stress().is_empty() && self.stress().iter().all(blank),
            DeformationColumns::Material(_) => false,
        }
    }

    /// Computes F of each row of each run; returns it with notes.
    pub fn deformations(
        &self,
        table: &DataTable,
        runs: &[TableRun],
        options: &ReadOptions,
    ) -> Result<(Vec<Vec<DeformationGradient>>, Vec<String>), Error> {
        let deformation = |&(_, row): &(u64, usize)| -> Result<DeformationGradient, Error> {
            match &self.form {
                DeformationColumns::Material(c) => {
                    stretch_from_c(&Voigt::from_row_slice(&table.numbers(row, c)?))
                        .map_err(|error| table.at_row(row, error))
                }
                DeformationColumns::Gradient(columns) => {
                    DeformationGradient::new(Tensor::from_row_slice(&table.numbers(row, columns)?))
                        .map_err(|error| table.at_row(row, error.into()))
                }
                DeformationColumns::Box(_) => Err(Error::file(&table.path, "a box", "a deformation")),
            }
        };
        match &self.form {
            DeformationColumns::Box(boxes) => boxes.deformations(table, runs, options),
            _ => {
                let all = runs
                    .iter()
                    .map(|run| run.rows.iter().map(deformation).collect())
                    .collect::<Result<_, _>>()?;
                Ok((all, Vec::new()))
            }
        }
    }

    /// Returns the runs of a table, in order of appearance, and the number of blank rows.
    pub fn runs(&self, table: &DataTable) -> Result<(Vec<TableRun>, usize), Error> {
        let [id, sample] = ["run_id", "sample"].map(|name| table.find(name));
        let file_name = polycore::file::name_of(&table.path);
        let mut runs: Vec<TableRun> = Vec::new();
        let mut index: HashMap<String, usize> = HashMap::new();
        let mut samples: HashMap<(usize, u64), u64> = HashMap::new();
        let mut skipped = 0;
        for row in 0..table.rows() {
            let id = id.map_or(file_name.as_str(), |column| table.text(row, column));
            let number = *index.entry(id.to_owned()).or_insert_with(|| {
                runs.push(TableRun { id: id.to_owned(), all: Vec::new(), first: row, rows: Vec::new() });
                runs.len() - 1
            });
            let run = &mut runs[number];
            run.all.push(row);
            if self.is_blank(table, row) {
                skipped += 1;
                continue;
            }
            let sample = match sample {
                Some(column) => table
                    .text(row, column)
                    .parse()
                    .map_err(|_| table.cell(row, column, "a non-negative integer"))?,
                None => run.rows.len() as u64,
            };
            if let Some(line) = samples.insert((number, sample), table.line(row)) {
                return Err(Error::Data {
                    what: "data set",
                    found: format!(
                        "sample {sample} of run `{id}` twice, in lines {line} and {} of {}",
                        table.line(row),
                        table.path.display()
                    ),
                    allowed: "different samples in a run".into(),
                });
            }
            run.rows.push((sample, row));
        }
        for run in &mut runs {
            run.rows.sort_by_key(|(sample, _)| *sample);
        }
        runs.retain(|run| !run.rows.is_empty());
        Ok((runs, skipped))
    }
}

/// Checks that all components of C and S have a column.
///
/// # Errors
/// Returns an error for a missing column.
fn require_material(table: &DataTable, all: &[String]) -> Result<(), Error> {
    let Some(missing) = all.iter().find(|name| !table.contains(name)) else { return Ok(()) };
    let others = table.headings.iter().map(|(name, _)| name).filter(|name| !all.contains(name));
    let similar = crate::error::nearest(missing, others.map(String::as_str));
    if similar.is_some() {
        let (path, column) = (table.path.clone(), missing.clone());
        return Err(Error::MissingColumn { path, column, similar });
    }
    let mut allowed = "C11 C22 C33 C12 C13 C23 and S11 S22 S33 S12 S13 S23".to_owned();
    if missing.ends_with(['2', '3']) && !missing.ends_with("22") && !missing.ends_with("33") {
        allowed += "; without shear, add columns of zeros";
    }
    Err(Error::file(&table.path, format!("no column `{missing}`"), allowed))
}

/// Reads nominal stresses over stretches: one run per test, in order of appearance.
fn nominal(table: &DataTable) -> Result<Dataset, Error> {
    let path = &table.path;
    let reading = hyperelastic::data::TestData::read_as(path, &hyperelastic::TestFormat::default());
    let reading = reading.map_err(|error| match error {
        polycore::Error::Constitutive(constitutive::Error::Data { reason, .. }) => {
            Error::file(path, reason, "stretches and nominal stresses of an incompressible body")
        }
        other => other.into(),
    })?;
    let named = table.headings.iter().any(|(name, _)| name.eq_ignore_ascii_case("mode"));
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut set = Dataset::default();
    for state in &reading.table.states {
        let kind = state.mode.name();
        let known = set.paths.iter().position(|run| run.kind == kind);
        let run = known.unwrap_or_else(|| {
            let id = if named { kind.to_owned() } else { stem.to_string() };
            set.paths.push(Path { id, kind: kind.to_owned(), rates: [f64::NAN; 3], rows: Vec::new() });
            set.paths.len() - 1
        });
        // the undeformed state is a condition that each law here satisfies
        if state.nominal != [0.0; 2] {
            let rows = &mut set.paths[run].rows;
            rows.push(DataRow::from_nominal(rows.len() as u64, state.stretches, state.nominal)?);
        } else {
            set.skipped += 1;
        }
    }
    set.paths.retain(|run| !run.rows.is_empty());
    let line = format!(
        "{}: {}, nominal stresses, {} rows of {} runs, {} at rest or free",
        polycore::file::name_of(path),
        table.fingerprint,
        set.len(),
        set.paths.len(),
        set.skipped
    );
    let more = table.layout_note().map(|_| &reading.description).into_iter().chain(&reading.notes);
    set.provenance.push(more.fold(line, |line, note| line + "; " + note));
    Ok(set)
}

/// Returns the error for a table without any of the forms of [`read`].
fn unknown_form(table: &DataTable, columns: SampledColumns) -> Error {
    let headings: Vec<&str> = table.headings.iter().map(|(name, _)| name.as_str()).collect();
    let found = format!("the headings {}", headings.join(", "));
    let forms = "C11 C22 C33 C12 C13 C23 and S11 … S23, or F11 F12 … F33 or lx ly lz and sxx syy szz sxy \
        sxz syz, or (rubber) mode, stretch, nominal_MPa";
    let allowed = match columns {
        _ if table.contains("F11") => {
            "all nine columns F11 F12 F13 F21 … F33; without shear, add columns of zeros".into()
        }
        SampledColumns::Averaged if table.contains("lx") => {
            "avg_lx … avg_syz, or lx … syz with `columns = \"instantaneous\"` (`--instantaneous`)".into()
        }
        SampledColumns::Averaged => format!("{forms}; boxes and their stresses with the prefix `avg_`"),
        SampledColumns::Instantaneous => forms.to_owned(),
    };
    Error::file(&table.path, found, allowed)
}

fn table(table: &DataTable, options: &ReadOptions) -> Result<Dataset, Error> {
    let mut options = options.clone();
    if let Some(origin) = table.lammps() {
        options.origin = options.origin.or(origin.first_is_undeformed.then_some(BoxReference::Run));
    }
    let layout = TableLayout::new(table, &options, true)?;
    let Some(stress) = &layout.stress else { return Ok(Dataset::default()) };
    let units = stress.units(table, &options)?;
    let (runs, skipped) = layout.runs(table)?;
    let [kind, time] = ["kind", "time_fs"].map(|name| table.find(name));
    let rates = ["rate_x", "rate_y", "rate_z"].map(|name| table.find(name));
    let (deformations, notes) = layout.deformations(table, &runs, &options)?;
    let mut set = Dataset { skipped, ..Dataset::default() };
    let mut symmetry = SymmetryCheck::default();
    for (run, deformations) in runs.iter().zip(deformations) {
        let Some(&(_, row)) = run.rows.first() else { continue };
        let mut of_axes = [f64::NAN; 3];
        for (rate, column) in of_axes.iter_mut().zip(rates) {
            if let Some(column) = column.filter(|column| !table.text(row, *column).is_empty()) {
                *rate = table.number(row, column)? / FEMTOSECOND;
            }
        }
        let kind = kind.map(|column| table.text(row, column)).filter(|kind| !kind.is_empty());
        let kind = kind.unwrap_or("unknown").to_owned();
        let mut rows = Vec::new();
        for (&(sample, row), f) in run.rows.iter().zip(deformations) {
            let mut numbers = Vec::new();
            for (column, unit) in stress.columns().iter().zip(&units) {
                numbers.push(table.number(row, *column)? * unit);
            }
            if matches!(stress, StressColumns::First(_)) {
                symmetry.add(&f, &numbers);
            }
            let time = match time {
                Some(column) => table.number(row, column)? * FEMTOSECOND,
                None => f64::NAN,
            };
            rows.push(DataRow::new(sample, time, f, stress.cauchy(&f, &numbers)));
        }
        set.paths.push(Path { id: run.id.clone(), kind, rates: of_axes, rows });
    }
    symmetry.check(&table.path)?;
    let mut line = format!(
        "{}: {}, {}, {} rows of {} runs, {} skipped",
        polycore::file::name_of(&table.path),
        table.fingerprint,
        layout.name,
        set.len(),
        set.paths.len(),
        set.skipped
    );
    if let Some(how) = table.layout_note() {
        line += "; ";
        line += &how;
    }
    for note in table.lammps().iter().flat_map(|origin| &origin.notes).chain(&notes) {
        line += "; ";
        line += note;
    }
    set.provenance.push(line);
    Ok(set)
}
