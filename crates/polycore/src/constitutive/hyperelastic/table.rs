//! Tables of measured states as CSV.

use std::path::Path;

use super::Error;
use super::data::{Mode, State, Table};
use crate::units::Stress;

impl Table {
    /// Reads a CSV file; see [`Table::parse`].
    ///
    /// # Errors
    /// [`crate::Error::Io`], and what [`Table::parse`] refuses.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, crate::Error> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(crate::Error::io("read", path))?;
        Ok(Self::parse(&path.display().to_string(), &text)?)
    }

    /// Reads CSV text: lines of `#` comments, a header, rows of numbers. The header is `stretch,nominal_UNIT`
    /// (uniaxial: λ₂ = λ₁^{−1/2}), `mode,stretch,nominal_UNIT` with a [`Mode`] of [`Mode::TESTS`] in each row, of which P₁
    /// is measured, or `stretch_1,stretch_2,nominal_1_UNIT,nominal_2_UNIT`.
    ///
    /// # Errors
    /// [`Error::Data`] naming the line: an unknown header, unit or mode, a missing or non-finite number, a stretch that
    /// is not positive, no measurement at all.
    pub fn parse(name: &str, text: &str) -> Result<Self, Error> {
        let refuse = |reason: String| Error::Data { what: name.to_owned(), reason };
        let mut reader =
            csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
        let header = reader.headers().map_err(|error| refuse(error.to_string()))?.clone();
        let columns: Vec<&str> = header.iter().collect();
        let moded = columns.first() == Some(&"mode");
        let units: Vec<f64> = match columns[usize::from(moded)..] {
            ["stretch", nominal] => vec![unit(nominal, "nominal_")],
            ["stretch_1", "stretch_2", first, second] if !moded => {
                vec![unit(first, "nominal_1_"), unit(second, "nominal_2_")]
            }
            _ => vec![None],
        }
        .into_iter()
        .collect::<Option<_>>()
        .ok_or_else(|| {
            let expected = "`stretch,nominal_MPa`, `mode,stretch,nominal_MPa` or \
                            `stretch_1,stretch_2,nominal_1_MPa,nominal_2_MPa`";
            refuse(format!("header `{}`; expected {expected}, or another unit of stress", columns.join(",")))
        })?;

        let mut states = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| refuse(error.to_string()))?;
            let line = record.position().map_or(0, csv::Position::line);
            let mut mode = Mode::Uniaxial;
            if moded {
                let name = record.get(0).unwrap_or_default();
                let names = Mode::TESTS.map(|mode| format!("`{}`", mode.name())).join(", ");
                mode = Mode::TESTS
                    .into_iter()
                    .find(|mode| mode.name() == name)
                    .ok_or_else(|| refuse(format!("line {line}: mode `{name}`; expected {names}")))?;
            }
            let mut numbers = Vec::with_capacity(4);
            for field in record.iter().skip(usize::from(moded)) {
                let number = field.parse::<f64>().ok().filter(|number| number.is_finite());
                numbers
                    .push(number.ok_or_else(|| refuse(format!("line {line}: `{field}` is not a number")))?);
            }
            let state = match numbers[..] {
                [stretch, nominal] => State {
                    mode,
                    stretches: [stretch, mode.second_stretch(stretch)],
                    nominal: [nominal * units[0], 0.0],
                },
                [a, b, first, second] => State {
                    mode: Mode::Biaxial,
                    stretches: [a, b],
                    nominal: [first * units[0], second * units[1]],
                },
                // the csv reader has compared the number of fields with the header's
                _ => continue,
            };
            state.principal_stretches().map_err(|error| refuse(format!("line {line}: {error}")))?;
            states.push(state);
        }
        let source = text.lines().find_map(|line| line.strip_prefix("# source:"));
        let table = Self { source: source.unwrap_or_default().trim().to_owned(), states };
        if table.measurements() == 0 {
            return Err(refuse("contains no stress other than zero".to_owned()));
        }
        Ok(table)
    }
}

/// Pa per unit of a column such as `nominal_MPa`.
fn unit(column: &str, prefix: &str) -> Option<f64> {
    format!("1 {}", column.strip_prefix(prefix)?).parse::<Stress>().ok().map(Stress::si)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_layouts_and_any_unit_of_stress() {
        let uniaxial = Table::parse("t", "# source: me, 2024\nstretch,nominal_kPa\n1,0\n4, 1500\n").unwrap();
        assert_eq!(uniaxial.source, "me, 2024");
        let expected = State { mode: Mode::Uniaxial, stretches: [4.0, 0.5], nominal: [1.5e6, 0.0] };
        assert_eq!(uniaxial.states[1], expected);
        assert_eq!(uniaxial.measurements(), 1);
        let text = "stretch_1,stretch_2,nominal_1_MPa,nominal_2_N/mm^2\n2,1,0.5,0.25\n";
        let biaxial = Table::parse("t", text).unwrap();
        assert_eq!(biaxial.states[0].nominal, [0.5e6, 0.25e6]);
        assert_eq!(biaxial.source, "");
        let text =
            "mode,stretch,nominal_MPa\nuniaxial,4,1.5\nequibiaxial,2,1\npure-shear,3,1\npure-shear,1,0\n";
        let modes = Table::parse("t", text).unwrap();
        let stretches: Vec<[f64; 2]> = modes.states.iter().map(|state| state.stretches).collect();
        assert_eq!(stretches, [[4.0, 0.5], [2.0, 2.0], [3.0, 1.0], [1.0, 1.0]]);
        assert_eq!(modes.measurements(), 3);
        let strip = modes.of(Mode::PureShear).unwrap();
        assert_eq!((strip.states.len(), strip.measurements()), (2, 1));
        assert!(biaxial.of(Mode::Uniaxial).is_err());
    }

    #[test]
    fn bad_tables_are_refused_with_the_line() {
        for (text, message) in [
            ("stretch,force_N\n1,0\n", "header `stretch,force_N`"),
            ("stretch,nominal_kg\n1,0\n", "header `stretch,nominal_kg`"),
            ("stretch,nominal_MPa\n1,0\n2,x\n", "line 3: `x` is not a number"),
            ("stretch,nominal_MPa\n1,0\n2,NaN\n", "line 3: `NaN` is not a number"),
            ("stretch,nominal_MPa\n-2,1\n", "line 2: stretch 1 is -2"),
            ("stretch,nominal_MPa\n1,2,3\n", "3 fields"),
            (
                "mode,stretch,nominal_MPa\nsimple-shear,1,0\n",
                "line 2: mode `simple-shear`; expected `uniaxial`",
            ),
            ("mode,stretch_1,stretch_2,nominal_1_MPa,nominal_2_MPa\n", "header `mode,stretch_1"),
            ("stretch,nominal_MPa\n1,0\n", "no stress other than zero"),
            ("", "header ``"),
        ] {
            let error = Table::parse("table.csv", text).unwrap_err().to_string();
            assert!(error.starts_with("table.csv: ") && error.contains(message), "{error}");
        }
    }
}
