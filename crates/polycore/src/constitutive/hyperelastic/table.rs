//! Readers of test data in tables.

use std::path::Path;

use super::Error;
use super::columns::{
    ColumnKind, MODES, Role, StrainMeasure, TestColumn, TestStressMeasure, Wanted, choose, mode,
};
use super::components::ComponentColumns;
use super::data::{Mode, TestData, TestState};
use super::heading_test::named_test;
use super::plausible::{TestRow, plausible};
use super::torsion_table::{TestCylinder, TorsionColumns};
use super::weights::{Deviation, WeightSource};
use crate::table::{self, plain_unit};
use crate::units::Unit;
use crate::units::dimension::{RatioDimension, StressDimension};

/// Properties of a table that its headings do not state.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TestFormat {
    /// Test of all rows, if no column names it.
    pub mode: Option<Mode>,
    /// Measure of the strain.
    pub strain: Option<StrainMeasure>,
    /// Measure of the stress.
    pub stress: Option<TestStressMeasure>,
    /// Unit of stresses without one.
    pub stress_unit: Option<String>,
    /// Heading of the strain, if there are several.
    pub strain_column: Option<String>,
    /// Heading of the stress, if there are several.
    pub stress_column: Option<String>,
    /// Material, in a table of components of several materials.
    pub material: Option<String>,
    /// Names of tests, in a table of components; all if empty.
    pub tests: Vec<String>,
    /// Heading of the weights of squares.
    pub weight_column: Option<String>,
    /// Heading of the standard deviations, in a unit of stress or in per cent of each stress.
    pub deviation_column: Option<String>,
    /// Standard deviation of all stresses.
    pub deviation: Option<Deviation>,
    /// Cylinder of a torsion test.
    pub cylinder: Option<TestCylinder>,
}

/// Result of reading a table.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedTest {
    /// States of the test.
    pub table: TestData,
    /// Description of the file's layout, one line.
    pub description: String,
    /// Rows left out and signs changed, one line each; doubts begin with `warning: `.
    pub notes: Vec<String>,
}

impl TestData {
    /// Reads a file; see [`TestData::read_as`].
    ///
    /// # Errors
    /// As [`TestData::read_as`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, crate::Error> {
        Self::read_as(path, &TestFormat::default()).map(|reading| reading.table)
    }

    /// Reads a text; see [`TestData::read_as`].
    ///
    /// # Errors
    /// As [`TestData::read_as`].
    pub fn parse(name: &str, text: &str) -> Result<Self, Error> {
        Self::parse_as(name, text.as_bytes().to_vec(), &TestFormat::default()).map(|reading| reading.table)
    }

    /// Reads a table as [`crate::table`] does: a column of stretches or strains and one of stresses, with a
    /// column of the [`Mode`] or for one test; or two of each (`stretch_1`, `stretch_2`, `nominal_1 [MPa]`,
    /// …). By default, strains are engineering strains and stresses nominal ones, unless the heading or
    /// `format` says otherwise. Blank stresses were not measured. A table with a column `component` has one
    /// stress in each row: `mode`, `lambda1`, `lambda2`, `component` (P1, P2, s1-s2), `unit`, `value`. With a
    /// cylinder, a table of torsion: `twist [rad/m]` or `angle [deg]`, `torque [N mm]`, `axial force [N]`,
    /// `stretch`.
    ///
    /// # Errors
    /// [`crate::Error::Io`]; errors of [`TestData::parse_as`].
    pub fn read_as(path: impl AsRef<Path>, format: &TestFormat) -> Result<ImportedTest, crate::Error> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(crate::Error::from_io("read", path))?;
        Ok(Self::parse_as(&path.display().to_string(), bytes, format)?)
    }

    /// Parses the bytes of a file as [`TestData::read_as`] does.
    ///
    /// # Errors
    /// [`Error::Data`] with line and column: headings, units and modes that are unknown or ambiguous, text
    /// instead of numbers, a stretch that is not positive, strains that look like stretches or vice versa, a
    /// stiffness below zero, no measurement at all.
    pub fn parse_as(name: &str, bytes: Vec<u8>, format: &TestFormat) -> Result<ImportedTest, Error> {
        let file = table::Table::parse(name, bytes).map_err(located)?;
        if let Some(torsion) = TorsionColumns::find(&file, format).map_err(located)? {
            return torsion.read(&file, format).map_err(located);
        }
        if let Some(components) = ComponentColumns::find(&file).map_err(located)? {
            return components.read(&file, format).map_err(located);
        }
        if format.material.is_some() || !format.tests.is_empty() {
            let allowed = "a column `component` where the keys `material` or `tests` choose rows";
            return Err(located(file.refuse_headings(allowed)));
        }
        let columns = TestColumns::find(&file, format).map_err(located)?;
        columns.read(&file, format).map_err(located)
    }
}

/// Converts an error, with the line in its reason.
fn located(error: table::Error) -> Error {
    let table::Error { path, line, what, found, allowed } = error;
    let line = if line == 0 { String::new() } else { format!("line {line}: ") };
    let reason = format!("{line}{what}: found `{found}`; allowed: {allowed}");
    Error::Data { what: path.display().to_string(), reason }
}

/// Columns of a table with one stress or two in each row.
struct TestColumns {
    mode: Option<usize>,
    /// Test that the headings name, if neither a column nor the scene does.
    named: Option<Mode>,
    strains: Vec<TestColumn<StrainMeasure>>,
    stresses: Vec<TestColumn<TestStressMeasure>>,
}

impl TestColumns {
    fn find(file: &table::Table, format: &TestFormat) -> Result<Self, table::Error> {
        let roles: Vec<Option<Role>> = file.headings.iter().map(Role::from_heading).collect();
        let strain =
            |what: ColumnKind| if let ColumnKind::Strain(measure) = what { Some(measure) } else { None };
        let stress =
            |what: ColumnKind| if let ColumnKind::Stress(measure) = what { Some(measure) } else { None };
        let mut strains = Vec::new();
        let mut stresses = Vec::new();
        let paired = |axis| {
            let has = |test: &dyn Fn(ColumnKind) -> bool| {
                roles.iter().flatten().any(|role| role.axis == Some(axis) && test(role.what))
            };
            has(&|what| strain(what).is_some()) && has(&|what| stress(what).is_some())
        };
        let biaxial = format.strain_column.is_none() && paired(0) && paired(1);
        // `strain 1, stress 1, strain 2, stress 2` are specimens side by side
        let place = |axis, test: &dyn Fn(ColumnKind) -> bool| {
            roles.iter().position(|role| {
                role.as_ref().is_some_and(|role| role.axis == Some(axis) && role.numbered && test(role.what))
            })
        };
        let (stress_1, strain_2) =
            (place(0, &|what| stress(what).is_some()), place(1, &|what| strain(what).is_some()));
        if biaxial && stress_1.zip(strain_2).is_some_and(|(stress, strain)| stress < strain) {
            let allowed = "`strain_column` and `stress_column` in the data's entry, if these are specimens \
                           side by side (an entry each); for a biaxial test both strains before both \
                           stresses";
            return Err(file.refuse_headings(allowed));
        }
        let axes = if biaxial { vec![Some(0), Some(1)] } else { vec![None] };
        for &axis in &axes {
            strains.push(choose(
                file,
                &roles,
                axis,
                &Wanted {
                    key: "strain",
                    name: format.strain_column.as_deref(),
                    measure: format.strain,
                    of: &strain,
                    order: &[StrainMeasure::Stretch, StrainMeasure::Engineering, StrainMeasure::True],
                    assumed: StrainMeasure::Engineering,
                },
            )?);
            stresses.push(choose(
                file,
                &roles,
                axis,
                &Wanted {
                    key: "stress",
                    name: format.stress_column.as_deref(),
                    measure: format.stress,
                    of: &stress,
                    order: &[TestStressMeasure::Nominal, TestStressMeasure::True],
                    assumed: TestStressMeasure::Nominal,
                },
            )?);
        }
        let named = |(i, role): (usize, &Option<Role>)| {
            let is_mode = role.as_ref().is_some_and(|role| role.what == ColumnKind::Mode);
            let says = || (0..file.rows()).any(|row| mode(file.text(row, i)).is_some());
            (is_mode && (file.headings[i].plain == MODES[0] || says())).then_some(i)
        };
        let mode = if axes.len() == 1 { roles.iter().enumerate().find_map(named) } else { None };
        let named = match (axes.len(), mode, format.mode) {
            (1, None, None) => named_test(file, &strains[0], stresses[0].column)?,
            _ => None,
        };
        // of the amount of shear there is one measure, and its stress is both
        if mode.is_none() && format.mode.or(named) == Some(Mode::SimpleShear) {
            return Ok(Self { mode, named, strains, stresses });
        }
        let (first, other) = (&strains[0], &stresses[0]);
        if first.assumed && other.measure == TestStressMeasure::True && !other.assumed {
            let allowed = "`strain = \"engineering\"` or `strain = \"true\"` in the data's entry: the \
                           stress is a true one";
            return Err(file.refuse_headings(allowed));
        }
        if other.assumed && first.measure == StrainMeasure::True && !first.assumed {
            let allowed =
                "`stress = \"nominal\"` or `stress = \"true\"` in the data's entry: the strain is a true one";
            return Err(file.refuse_headings(allowed));
        }
        Ok(Self { mode, named, strains, stresses })
    }

    fn read(&self, file: &table::Table, format: &TestFormat) -> Result<ImportedTest, table::Error> {
        let unit = |chosen: &TestColumn<TestStressMeasure>| {
            let text = chosen.unit.as_deref().or(format.stress_unit.as_deref()).unwrap_or_default();
            Unit::<StressDimension>::parse(&plain_unit(text)).map_err(|error| {
                let what =
                    format!("unit of column {}, `{}`", chosen.column + 1, file.headings[chosen.column].text);
                let found = if text.is_empty() { "no unit" } else { text };
                let allowed = format!(
                    "a unit of stress in the heading, as in `nominal [MPa]`, or `stress_unit = \
                             \"MPa\"`; {error}"
                );
                file.refuse(file.layout().heading_line, &what, found.to_owned(), &allowed)
            })
        };
        let units = self.stresses.iter().map(unit).collect::<Result<Vec<_>, _>>()?;
        let ratio = |chosen: &TestColumn<StrainMeasure>| {
            Unit::<RatioDimension>::parse(&plain_unit(chosen.unit.as_deref().unwrap_or_default())).map_err(
                |error| {
                    let what = format!(
                        "unit of column {}, `{}`",
                        chosen.column + 1,
                        file.headings[chosen.column].text
                    );
                    let found = chosen.unit.clone().unwrap_or_default();
                    file.refuse(
                        file.layout().heading_line,
                        &what,
                        found,
                        &format!("a strain, in % or without a unit; {error}"),
                    )
                },
            )
        };
        let ratios = self.strains.iter().map(ratio).collect::<Result<Vec<_>, _>>()?;
        let weights = WeightSource::find(file, format)?;
        let absolute = weights.as_ref().is_some_and(WeightSource::is_absolute);
        let mut rows = Vec::with_capacity(file.rows());
        let mut blank = 0;
        for index in 0..file.rows() {
            let (test, compression) = self.test(file, index, format)?;
            let mut row = TestRow {
                index,
                mode: test,
                compression,
                written: [0.0; 2],
                stretches: [0.0; 2],
                nominal: [0.0; 2],
                roots: [1.0; 2],
            };
            let mut measured = 0;
            for (axis, (chosen, unit)) in self.stresses.iter().zip(&units).enumerate() {
                let Some(number) = file.number_or_blank(index, chosen.column)? else { continue };
                let si = unit.quantity(number).map(|stress| stress.si());
                row.nominal[axis] =
                    si.map_err(|error| file.refuse_cell(index, chosen.column, &error.to_string()))?;
                measured += 1;
                if let Some(weights) = weights.as_ref().filter(|_| row.nominal[axis] != 0.0) {
                    row.roots[axis] = weights.root(file, index, row.nominal[axis])?;
                }
            }
            if measured == 0 {
                blank += 1;
                continue;
            }
            for (axis, (chosen, ratio)) in self.strains.iter().zip(&ratios).enumerate() {
                let number = file.number(index, chosen.column)?;
                row.written[axis] = ratio.quantity(number).map_or(number, |ratio| ratio.si());
            }
            rows.push(row);
        }
        let mut notes = Vec::new();
        if blank > 0 {
            notes.push(format!("{blank} rows without a stress are left out"));
        }
        self.make_compression_negative(&mut rows, &mut notes);
        for row in &mut rows {
            if let (Mode::SimpleShear, [_, second, ..]) = (row.mode, &self.strains[..]) {
                return Err(file.refuse_cell(
                    row.index,
                    second.column,
                    "one strain column, γ, for simple shear",
                ));
            }
            for (axis, chosen) in self.strains.iter().enumerate() {
                let written = row.written[axis];
                if row.mode == Mode::SimpleShear {
                    let state = TestState::simple_shear(written, row.nominal[0]);
                    (row.stretches, row.nominal) = (state.stretches, state.nominal);
                    continue;
                }
                let stretch = match chosen.measure {
                    StrainMeasure::Stretch => written,
                    StrainMeasure::Engineering => 1.0 + written,
                    StrainMeasure::True => written.exp(),
                };
                if !(stretch > 0.0 && stretch.is_finite()) {
                    let strain = "a stretch above 0; if this is a strain, use the heading `strain` or \
                                  `strain \
                                  = \"engineering\"`";
                    let allowed = if chosen.measure == StrainMeasure::Stretch {
                        strain
                    } else {
                        "a strain above −100 %"
                    };
                    return Err(file.refuse_cell(row.index, chosen.column, allowed));
                }
                row.stretches[axis] = stretch;
            }
            if self.strains.len() == 1 {
                row.stretches[1] = row.mode.second_stretch(row.stretches[0]);
            }
            for (axis, chosen) in self.stresses.iter().enumerate() {
                // the shear stress is both
                if chosen.measure == TestStressMeasure::True && row.mode != Mode::SimpleShear {
                    // J = 1: σ = λP
                    row.nominal[axis] /= row.stretches[axis];
                    row.roots[axis] *= if absolute { row.stretches[axis] } else { 1.0 };
                }
            }
        }
        if self.strains.len() == 1 {
            let chosen = &self.strains[0];
            let said = format.strain.is_some() || format.strain_column.is_some();
            plausible(&mut rows, &mut notes, chosen.measure, said, chosen.unit.is_some())
                .map_err(|(row, allowed)| file.refuse_cell(row, chosen.column, &allowed))?;
        }
        let state = |row: &TestRow| TestState {
            roots: row.roots,
            ..TestState::new(row.mode, row.stretches, row.nominal)
        };
        if let Some(mode) = self.named {
            notes.push(format!("test: {}, as the headings say", mode.name()));
        }
        let source = file.remark("# source:").unwrap_or_default().to_owned();
        let table = TestData::weighted(source, rows.iter().map(state).collect(), absolute);
        if table.measurements() == 0 {
            let found = format!("{} rows", file.rows());
            return Err(file.refuse(0, "table", found, "at least one row with a stress other than zero"));
        }
        Ok(ImportedTest { description: self.describe(file, &table), table, notes })
    }

    /// Returns the test of a row; true if it is compression.
    fn test(
        &self,
        file: &table::Table,
        row: usize,
        format: &TestFormat,
    ) -> Result<(Mode, bool), table::Error> {
        let Some(column) = self.mode else {
            let one = format.mode.or(self.named).unwrap_or(Mode::Uniaxial);
            return Ok((if self.strains.len() == 2 { Mode::Biaxial } else { one }, false));
        };
        mode(file.text(row, column)).ok_or_else(|| {
            let names = Mode::TESTS.into_iter().chain([Mode::SimpleShear]);
            let names = names.map(|mode| format!("`{}`", mode.name())).collect::<Vec<_>>().join(", ");
            let allowed = format!("a test: {names}; torsion has tables of its own, `mode = \"torsion\"`");
            file.refuse_cell(row, column, &allowed)
        })
    }

    /// Makes strains and stresses negative that headings or tests call compressive.
    fn make_compression_negative(&self, rows: &mut [TestRow], notes: &mut Vec<String>) {
        let (strain, stress) = (&self.strains[0], &self.stresses[0]);
        if self.strains.len() == 2 {
            return;
        }
        let strains: fn(&mut TestRow) -> &mut f64 = |row| &mut row.written[0];
        let stresses: fn(&mut TestRow) -> &mut f64 = |row| &mut row.nominal[0];
        let turned = strain.measure != StrainMeasure::Stretch;
        for (name, value, may, by_heading) in [
            ("strains", strains, turned, strain.compressive && turned),
            ("stresses", stresses, true, stress.compressive),
        ] {
            let mut of: Vec<&mut TestRow> =
                rows.iter_mut().filter(|row| may && (by_heading || row.compression)).collect();
            if of.iter_mut().all(|row| *value(row) >= 0.0) && !of.is_empty() {
                of.iter_mut().for_each(|row| *value(row) = 0.0 - *value(row));
                notes.push(format!("{name} in compression, positive in the file, become negative"));
            }
        }
    }

    fn describe(&self, file: &table::Table, table: &TestData) -> String {
        let used: Vec<usize> =
            self.mode.into_iter().chain(self.strains.iter().map(|chosen| chosen.column)).collect();
        let used: Vec<usize> =
            used.into_iter().chain(self.stresses.iter().map(|chosen| chosen.column)).collect();
        let strain = match self.strains[0].measure {
            StrainMeasure::Stretch => "stretch",
            StrainMeasure::Engineering => "engineering strain",
            StrainMeasure::True => "true strain",
        };
        let stress = match self.stresses[0].measure {
            TestStressMeasure::Nominal => "nominal stress",
            TestStressMeasure::True => "true stress",
        };
        let biaxial = if self.strains.len() == 2 { "biaxial, " } else { "" };
        let assumed = match (self.strains[0].assumed, self.stresses[0].assumed) {
            (true, true) => " (assumed; the keys `strain` and `stress` set them)",
            (true, false) => " (strain assumed; the key `strain` sets it)",
            (false, true) => " (stress assumed; the key `stress` sets it)",
            (false, false) => "",
        };
        let stretches =
            table.states.iter().flat_map(|state| state.stretches.into_iter().take(self.strains.len()));
        let (low, high) =
            stretches.fold((f64::INFINITY, 0.0_f64), |(low, high), l| (low.min(l), high.max(l)));
        let is_shear = table.states.iter().all(|state| state.mode == Mode::SimpleShear);
        let measured = match is_shear {
            true => "amount of shear and shear stress".to_owned(),
            false => format!("{biaxial}{strain} and {stress}{assumed}"),
        };
        format!("{}; {measured}; stretches {low:.4} to {high:.4}", file.describe(&used))
    }
}

#[cfg(test)]
#[path = "table_tests.rs"]
mod tests;
