//! Tables with one measured stress in each row, of one or several materials.

use super::columns::mode;
use super::data::{Mode, TestData, TestState};
use super::plausible::NOISE_LEVEL;
use super::table::{ImportedTest, TestFormat};
use super::weights::WeightSource;
use crate::table::{Error, Table, plain_unit, plainly};
use crate::units::Unit;
use crate::units::dimension::StressDimension;

/// Columns of a table of components: a test, its stretches, and one stress with its unit.
pub(super) struct ComponentColumns {
    /// Columns that tell materials apart.
    materials: Vec<usize>,
    mode: usize,
    first: usize,
    second: Option<usize>,
    component: usize,
    unit: Option<usize>,
    value: usize,
}

/// Relative difference between a second stretch in the file and that of its test.
const STRETCH_ERROR: f64 = 0.01;

impl ComponentColumns {
    /// Finds the columns; `None` without a column `component`.
    ///
    /// # Errors
    /// A column that is missing, or several of one name.
    pub fn find(file: &Table) -> Result<Option<Self>, Error> {
        let optional = |names: &[&str]| file.matching(names).first().copied();
        let Some(component) = optional(&["component"]) else { return Ok(None) };
        Ok(Some(Self {
            materials: ["source", "material"].iter().filter_map(|name| optional(&[name])).collect(),
            mode: file.require_column(&["mode", "test"])?,
            first: file.require_column(&["lambda1", "lambda_1", "stretch_1", "stretch1"])?,
            second: optional(&["lambda2", "lambda_2", "stretch_2", "stretch2"]),
            component,
            unit: optional(&["unit"]),
            value: file.require_column(&["value", "stress"])?,
        }))
    }

    /// Reads the rows of a material and of some tests.
    ///
    /// # Errors
    /// Several materials and none chosen, a material or a test that no row has; cells that are no number, no
    /// test, no component or no unit; stresses against the strain.
    pub fn read(&self, file: &Table, format: &TestFormat) -> Result<ImportedTest, Error> {
        let mut rows: Vec<usize> = (0..file.rows()).collect();
        let of_row = |row: usize| self.materials.iter().map(move |&column| file.text(row, column));
        let names = |columns: &[usize], rows: &[usize]| {
            let mut names: Vec<String> = Vec::new();
            for &row in rows {
                let cells: Vec<&str> = columns.iter().map(|&column| file.text(row, column)).collect();
                let name = cells.join(", ");
                if !names.contains(&name) {
                    names.push(name);
                }
            }
            names
        };
        let materials = names(&self.materials, &rows);
        if let Some(name) = &format.material {
            rows.retain(|&row| of_row(row).any(|cell| cell == name));
        }
        if rows.is_empty() || (format.material.is_none() && materials.len() > 1) {
            let found = match &format.material {
                Some(name) => name.clone(),
                None => format!("{} materials and none chosen", materials.len()),
            };
            let allowed = format!("`material` = one of {}", materials.join("; "));
            return Err(file.refuse(0, "material", found, &allowed));
        }
        for test in &format.tests {
            let known = names(&[self.mode], &rows);
            if !known.contains(test) {
                return Err(file.refuse(0, "tests", test.clone(), &known.join(", ")));
            }
        }
        let asked = |row: usize| {
            let test = file.text(row, self.mode);
            format.tests.is_empty() || format.tests.iter().any(|other| other == test)
        };
        rows.retain(|&row| asked(row));
        let weights = WeightSource::find(file, format)?;
        let state = |&row: &usize| self.state(file, row, format, weights.as_ref());
        let states = rows.iter().map(state).collect::<Result<Vec<_>, _>>()?;
        self.check_signs(file, &rows, &states)?;
        let count = states.len();
        let source = file.remark("# Source:").or(file.remark("# source:")).unwrap_or_default().to_owned();
        let table = TestData::weighted(source, states, weights.is_some_and(|weights| weights.is_absolute()));
        if table.measurements() == 0 {
            let found = format!("{count} rows");
            return Err(file.refuse(0, "table", found, "at least one row with a stress other than zero"));
        }
        let used = [self.mode, self.first, self.component, self.value];
        let chosen = [names(&self.materials, &rows), names(&[self.mode], &rows)].concat().join("; ");
        let description =
            format!("{}; one stress in each row; {count} rows of {chosen}", file.describe(&used));
        Ok(ImportedTest { description, table, notes: Vec::new() })
    }

    /// Refuses stresses against their strain, but for those near rest that are digitised on its other side.
    fn check_signs(&self, file: &Table, rows: &[usize], states: &[TestState]) -> Result<(), Error> {
        let amount = |state: &TestState| state.nominal[0].abs().max(state.nominal[1].abs());
        let largest = |mode| states.iter().filter(|state| state.mode == mode).map(amount).fold(0.0, f64::max);
        for (&row, state) in rows.iter().zip(states) {
            let against = (state.stretches[0] - 1.0) * (state.nominal[0] + state.nominal[1]) < 0.0;
            let is_signed = ![Mode::Component, Mode::Difference].contains(&state.mode);
            if is_signed && against && amount(state) > NOISE_LEVEL * largest(state.mode) {
                return Err(file.refuse_cell(row, self.value, "a stress with the sign of the strain"));
            }
        }
        Ok(())
    }

    fn state(
        &self,
        file: &Table,
        row: usize,
        format: &TestFormat,
        weights: Option<&WeightSource>,
    ) -> Result<TestState, Error> {
        let positive = |column: usize, stretch: f64| match stretch > 0.0 {
            true => Ok(stretch),
            false => Err(file.refuse_cell(row, column, "a stretch above 0")),
        };
        let (test, _) = mode(file.text(row, self.mode))
            .ok_or_else(|| file.refuse_cell(row, self.mode, "a test: UT, UC, ET, PS, BT"))?;
        if test == Mode::SimpleShear {
            return Err(file.refuse_cell(row, self.mode, "a test with stretches: UT, UC, ET, PS, BT"));
        }
        let first = positive(self.first, file.number(row, self.first)?)?;
        let given = match self.second {
            Some(column) => file.number_or_blank(row, column)?.map(|second| (column, second)),
            None => None,
        };
        let is_general = ["bt", "biaxial"].contains(&plainly(file.text(row, self.mode)).as_str());
        let second = match given {
            Some((column, second)) => {
                let second = positive(column, second)?;
                let own = test.second_stretch(first);
                if !is_general && (second / own - 1.0).abs() > STRETCH_ERROR {
                    let allowed = format!("{own:.4}, the second stretch of this test, or blank");
                    return Err(file.refuse_cell(row, column, &allowed));
                }
                second
            }
            None if is_general => {
                let allowed = "a test with one stretch, or a second stretch in the column `lambda2`";
                return Err(file.refuse_cell(row, self.mode, allowed));
            }
            None => test.second_stretch(first),
        };
        let unit = self.unit.map(|column| file.text(row, column)).filter(|unit| !unit.is_empty());
        let heading = file.headings[self.value].unit.as_deref();
        let unit = unit.or(heading).or(format.stress_unit.as_deref()).unwrap_or_default();
        let unit = Unit::<StressDimension>::parse(&plain_unit(unit)).map_err(|error| {
            file.refuse_cell(row, self.unit.unwrap_or(self.value), &format!("a stress with a unit; {error}"))
        })?;
        let stress = unit.quantity(file.number(row, self.value)?).map(|stress| stress.si());
        let stress = stress.map_err(|error| file.refuse_cell(row, self.value, &error.to_string()))?;
        let mode = if is_general { Mode::Component } else { test };
        let mut state = match plainly(file.text(row, self.component)).as_str() {
            "p1" => TestState::new(mode, [first, second], [stress, 0.0]),
            "p2" if test != Mode::Uniaxial => TestState::new(mode, [first, second], [0.0, stress]),
            "s1 s2" => {
                let stretches = [first, 1.0 / (first * second)];
                TestState::new(Mode::Difference, stretches, [stress / first, 0.0])
            }
            _ => {
                let allowed = "P1, P2 (nominal, P2 not of a bar), s1-s2 (difference of true stresses)";
                return Err(file.refuse_cell(row, self.component, allowed));
            }
        };
        if let Some(weights) = weights.filter(|_| stress != 0.0) {
            state.roots = [weights.root(file, row, stress)?; 2];
        }
        Ok(state)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::{MooneyRivlin, fit, homogeneous};

    const HEAD: &str = "source,material,mode,lambda1,lambda2,component,unit,value\n";

    fn read(rows: &str, format: &TestFormat) -> Result<ImportedTest, crate::constitutive::Error> {
        TestData::parse_as("t.csv", format!("{HEAD}{rows}").into_bytes(), format)
    }

    /// σ₁ − σ₂ from the nominal stresses of the sheet itself: another route than the permuted state.
    #[test]
    fn a_difference_of_true_stresses() {
        let law = MooneyRivlin::new(0.2e6, 0.05e6).unwrap();
        let [a, b] = [1.8, 2.3];
        let [p, q] = homogeneous::biaxial(&law, a, b).unwrap();
        let row = format!("s,m,BT,{a},{b},s1-s2,kPa,{}\n", (a * p - b * q) / 1e3);
        let table = read(&row, &TestFormat::default()).unwrap().table;
        let residuals = fit::residuals(&law, &table).unwrap();
        assert!(residuals[0].abs() < 1e-9 * p, "{residuals:?}");
        let stiffer = MooneyRivlin::new(0.2e6, 0.06e6).unwrap();
        let [r, s] = homogeneous::biaxial(&stiffer, a, b).unwrap();
        let expected = a * r - b * s - (a * p - b * q);
        let residuals = fit::residuals(&stiffer, &table).unwrap();
        assert!((residuals[0] / expected - 1.0).abs() < 1e-9, "{residuals:?} {expected}");
    }

    #[test]
    fn components_and_materials() {
        let two = "a,gel,UT,2,,P1,kPa,5\nb,silicone,PS,1.5,1,P2,MPa,0.1\nb,silicone,BT,1.5,1.2,P2,MPa,0.1\n";
        let of = |name: &str, tests: &[&str]| TestFormat {
            material: Some(name.to_owned()),
            tests: tests.iter().map(|&test| test.to_owned()).collect(),
            ..TestFormat::default()
        };
        let gel = read(two, &of("a", &[])).unwrap().table;
        assert_eq!(gel.states[0].nominal, [5e3, 0.0]);
        let silicone = read(two, &of("silicone", &[])).unwrap().table;
        assert_eq!((silicone.states.len(), silicone.states[0].nominal), (2, [0.0, 1e5]));
        assert_eq!(silicone.states[1].mode, Mode::Component);
        // digitised on the other side of rest, by 1 % of the largest stress
        let near_rest = "a,gel,UT,0.999,,P1,kPa,0.05\na,gel,UT,2,,P1,kPa,5\n";
        assert_eq!(read(near_rest, &TestFormat::default()).unwrap().table.states.len(), 2);
        let unit_of_heading = b"mode,lambda1,component,value [kPa]\nUT,2,P1,5\n".to_vec();
        let table = TestData::parse_as("t.csv", unit_of_heading, &TestFormat::default()).unwrap().table;
        assert_eq!(table.states[0].nominal, [5e3, 0.0]);
        assert_eq!(read(two, &of("b", &["BT"])).unwrap().table.states[0].stretches, [1.5, 1.2]);
        for (rows, format, part) in [
            (two, TestFormat::default(), "2 materials and none chosen"),
            (two, of("c", &[]), "found `c`; allowed: `material` = one of a, gel; b, silicone"),
            (two, of("b", &["UT"]), "tests: found `UT`; allowed: PS, BT"),
            ("a,g,BT,2,,P1,kPa,5\n", TestFormat::default(), "line 2: column 3, `mode`: found `BT`"),
            ("a,g,PS,2,1.5,P1,kPa,5\n", TestFormat::default(), "allowed: 1.0000, the second stretch"),
            ("a,g,UT,2,,P2,kPa,5\n", TestFormat::default(), "column 6, `component`: found `P2`"),
            ("a,g,UT,2,,P1,K,5\n", TestFormat::default(), "column 7, `unit`: found `K`"),
            ("a,g,UT,2,,P1,kPa,-5\n", TestFormat::default(), "the sign of the strain"),
            ("a,g,UT,2,,P1,kPa,5\na,g,UT,0.9,,P1,kPa,0.2\n", TestFormat::default(), "line 3: column 8"),
            ("a,g,UT,-2,,P1,kPa,5\n", TestFormat::default(), "a stretch above 0"),
            ("a,g,XX,2,,P1,kPa,5\n", TestFormat::default(), "a test: UT"),
        ] {
            let error = read(rows, &format).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}
