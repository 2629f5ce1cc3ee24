//! Reader of tests of foams.

use std::path::Path;

use super::columns::{ColumnKind, Role, mode};
use super::data::Mode;
use super::foam::{FoamState, FoamTest, FoamTestKind};
use crate::table::{Error, Table, plain_unit, plainly};
use crate::units::Unit;
use crate::units::dimension::StressDimension;

/// Share of the largest stress of a test below which stresses are noise around zero.
const NOISE_LEVEL: f64 = 0.02;

impl FoamTest {
    /// Reads the tests of a foam: columns `mode` (UT, UC: bars with free sides; SS: simple shear), `stretch`
    /// (of shear its amount; also `stretch_or_shear`), `nominal [MPa]` or `P_MPa`, `lateral` (lateral
    /// stretch, may be blank or absent), and `foam` or `material` if there are several.
    ///
    /// # Errors
    /// [`crate::Error::Io`]; columns that are missing, several foams and none chosen, cells that are no
    /// number or no test, stresses against the strain.
    pub fn read(path: impl AsRef<Path>, foam: Option<&str>) -> Result<(Vec<Self>, String), crate::Error> {
        let file = Table::read(path)?;
        Ok(Self::of_table(&file, foam)?)
    }

    /// Reads the tests of a table, with a description of its layout.
    fn of_table(file: &Table, foam: Option<&str>) -> Result<(Vec<Self>, String), Error> {
        let test = file.require_column(&["mode", "test"])?;
        let strain = file.require_column(&["stretch", "stretch_or_shear"])?;
        let lateral = file.matching(&["lateral", "transverse", "lateral stretch", "transverse stretch"]);
        let roles: Vec<Option<Role>> = file.headings.iter().map(Role::from_heading).collect();
        let is_stress = |role: &Option<Role>| {
            role.as_ref().is_some_and(|role| matches!(role.what, ColumnKind::Stress(_)))
        };
        let Some(stress) = roles.iter().position(is_stress) else {
            return Err(file.refuse_headings("a nominal stress: `nominal [MPa]`, `P_MPa`"));
        };
        let unit = roles[stress].as_ref().and_then(|role| role.unit.clone()).unwrap_or_default();
        let unit = Unit::<StressDimension>::parse(&plain_unit(&unit)).map_err(|error| {
            file.refuse_headings(format!("a stress with a unit, as `nominal [MPa]`; {error}"))
        })?;
        let rows = of_foam(file, foam)?;
        let mut tests: Vec<Self> = Vec::new();
        for &row in &rows {
            let name = file.text(row, test);
            let kind = match mode(name) {
                Some((Mode::Uniaxial, _)) => FoamTestKind::Bar,
                _ if ["ss", "shear", "simple shear"].contains(&plainly(name).as_str()) => FoamTestKind::Shear,
                _ => return Err(file.refuse_cell(row, test, "a test: UT, UC, SS")),
            };
            let positive = |column: usize, value: f64| match value > 0.0 {
                true => Ok(value),
                false => Err(file.refuse_cell(row, column, "a stretch above 0")),
            };
            let mut value = file.number(row, strain)?;
            if kind == FoamTestKind::Bar {
                value = positive(strain, value)?;
            }
            let second = lateral.first().map(|&column| {
                let number = file.number_or_blank(row, column)?;
                number.map(|number| positive(column, number)).transpose()
            });
            let nominal = unit.quantity(file.number(row, stress)?).map(|stress| stress.si());
            let state = FoamState {
                strain: value,
                nominal: nominal.map_err(|error| file.refuse_cell(row, stress, &error.to_string()))?,
                lateral: second.transpose()?.flatten(),
            };
            match tests.iter_mut().find(|test| test.name == name) {
                Some(test) => test.states.push(state),
                None => tests.push(Self { name: name.to_owned(), kind, states: vec![state] }),
            }
        }
        for &row in &rows {
            let Some(own) = tests.iter().find(|own| own.name == file.text(row, test)) else { continue };
            let rest = if own.kind == FoamTestKind::Bar { 1.0 } else { 0.0 };
            let nominal = file.number(row, stress)? * unit.quantity(1.0).map_or(1.0, |one| one.si());
            if (file.number(row, strain)? - rest) * nominal < 0.0
                && nominal.abs() > NOISE_LEVEL * own.largest()
            {
                return Err(file.refuse_cell(row, stress, "a stress with the sign of the strain"));
            }
        }
        let names: Vec<String> =
            tests.iter().map(|test| format!("{} ({} states)", test.name, test.states.len())).collect();
        let used: Vec<usize> = [test, strain, stress].into_iter().chain(lateral.first().copied()).collect();
        Ok((tests, format!("{}; {}", file.describe(&used), names.join(", "))))
    }
}

/// Rows of a foam; of all rows if the table has one foam.
fn of_foam(file: &Table, foam: Option<&str>) -> Result<Vec<usize>, Error> {
    let column = file.matching(&["foam", "material", "source"]).first().copied();
    let mut names: Vec<&str> = Vec::new();
    let mut rows = Vec::new();
    for row in 0..file.rows() {
        let name = column.map_or("", |column| file.text(row, column));
        if !names.contains(&name) {
            names.push(name);
        }
        if foam.is_none_or(|foam| foam == name) {
            rows.push(row);
        }
    }
    if rows.is_empty() || (foam.is_none() && names.len() > 1) {
        let found = foam.map_or_else(|| format!("{} foams and none chosen", names.len()), str::to_owned);
        return Err(file.refuse(0, "foam", found, &format!("`material` = one of {}", names.join(", "))));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str, foam: Option<&str>) -> Result<(Vec<FoamTest>, String), Error> {
        FoamTest::of_table(&Table::parse("f.csv", text.as_bytes().to_vec())?, foam)
    }

    #[test]
    fn tests_of_a_foam() {
        let text =
            "foam,mode,stretch_or_shear,P_MPa,lateral\na,UC,0.5,-0.2,1.01\na,SS,0.1,0.01,\nb,UT,1.2,0.1,\n";
        let (tests, _) = parse(text, Some("a")).unwrap();
        assert_eq!(tests.len(), 2);
        let state = FoamState { strain: 0.5, nominal: -0.2e6, lateral: Some(1.01) };
        assert_eq!((tests[0].kind, tests[0].states[0]), (FoamTestKind::Bar, state));
        assert_eq!((tests[1].kind, tests[1].states[0].lateral), (FoamTestKind::Shear, None));
        let head = "mode,stretch,P_MPa\n";
        for (text, foam, part) in [
            (text.to_owned(), None, "none chosen\"; allowed: `material` = one of a, b"),
            (text.to_owned(), Some("c"), "found \"c\""),
            (format!("{head}XX,1.2,0.1\n"), None, "column 1, `mode`: found \"XX\""),
            (format!("{head}UT,-1.2,0.1\n"), None, "a stretch above 0"),
            (format!("{head}UC,0.8,0.1\n"), None, "the sign of the strain"),
            (format!("{head}UT,1.2,x\n"), None, "column 3"),
            ("mode,stretch\nUT,1.2\n".to_owned(), None, "a nominal stress"),
        ] {
            let error = parse(&text, foam).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}
