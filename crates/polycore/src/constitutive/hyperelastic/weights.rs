//! Weights of measured stresses in a fit, from columns of a table or one value for all.

use super::columns::suffixed;
use super::table::TestFormat;
use crate::table::{Error, Heading, Table, plain_unit, plainly};
use crate::units::dimension::{RatioDimension, StressDimension};
use crate::units::{Ratio, Stress, Unit};

/// Standard deviation of measured stresses: √(s² + (rP)²).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// Part s of all stresses, Pa.
    stress: f64,
    /// Part r that is a share of each stress.
    share: f64,
}

impl Deviation {
    /// Reads `"0.02 MPa"`, `"2 %"` or `"0.02 MPa + 2 %"`.
    ///
    /// # Errors
    /// The text allowed, for another text or a part that is not above 0.
    pub fn parse(text: &str) -> Result<Self, &'static str> {
        let mut found = Self { stress: 0.0, share: 0.0 };
        for part in text.split('+') {
            let (place, size) = match part.parse::<Stress>() {
                Ok(stress) => (&mut found.stress, stress.si()),
                Err(_) => (&mut found.share, part.parse::<Ratio>().map_err(|_| ALLOWED)?.si()),
            };
            if !(size > 0.0 && *place == 0.0) {
                return Err(ALLOWED);
            }
            *place = size;
        }
        Ok(found)
    }

    /// Standard deviation of a stress, Pa.
    fn of(self, stress: f64) -> f64 {
        self.stress.hypot(self.share * stress)
    }
}

const ALLOWED: &str = "standard deviations above 0: of all stresses, \"0.02 MPa\", as a share of each, \
                       \"2 %\", or \"0.02 MPa + 2 %\"";

/// Source of the weights of a table.
pub(super) enum WeightSource {
    One(Deviation),
    /// Column of weights of squares.
    Weights(usize),
    /// Column of standard deviations in a unit of stress.
    Stresses(usize, Unit<StressDimension>),
    /// Column of standard deviations relative to the stress.
    Shares(usize, Unit<RatioDimension>),
}

impl WeightSource {
    /// Finds the columns that a format names; `None` if it asks for no weights.
    ///
    /// # Errors
    /// An unknown column, a column of standard deviations without a unit, several sources.
    pub fn find(file: &Table, format: &TestFormat) -> Result<Option<Self>, Error> {
        let column = |key: &str, name: &str| {
            let is = |heading: &Heading| heading.name == name || suffixed(heading).0 == plainly(name);
            let found = file.headings.iter().position(is);
            found.ok_or_else(|| file.refuse_headings(format!("the heading `{name}` of `{key}`")))
        };
        match (&format.weight_column, &format.deviation_column, format.deviation) {
            (None, None, None) => Ok(None),
            (None, None, Some(one)) => Ok(Some(Self::One(one))),
            (Some(name), None, None) => Ok(Some(Self::Weights(column("weight_column", name)?))),
            (None, Some(name), None) => {
                let at = column("deviation_column", name)?;
                let written = suffixed(&file.headings[at]).1.unwrap_or_default();
                let unit = plain_unit(&written);
                if let Ok(unit) = Unit::parse(&unit) {
                    return Ok(Some(Self::Stresses(at, unit)));
                }
                let share = Unit::parse(&unit).ok().filter(|_| !written.is_empty());
                let allowed = format!("a unit of stress, or %, in the heading of `{name}`: `sd [MPa]`");
                share.map(|unit| Some(Self::Shares(at, unit))).ok_or_else(|| file.refuse_headings(allowed))
            }
            _ => Err(file.refuse_headings("one of `weight_column`, `deviation_column` and `deviation`")),
        }
    }

    /// Returns true if weights are those of standard deviations.
    pub fn is_absolute(&self) -> bool {
        !matches!(self, Self::Weights(_))
    }

    /// Root of the weight of a measured stress: √w, or 1/s in 1/Pa.
    ///
    /// # Errors
    /// A cell that is no number, or not above 0.
    pub fn root(&self, file: &Table, row: usize, stress: f64) -> Result<f64, Error> {
        let above = "a standard deviation above 0";
        let (column, allowed, root) = match self {
            Self::One(deviation) => return Ok(deviation.of(stress).recip()),
            Self::Weights(column) => (*column, "a weight above 0", file.number(row, *column)?.sqrt()),
            Self::Stresses(column, unit) => {
                let size = unit.quantity(file.number(row, *column)?).map_or(f64::NAN, |size| size.si());
                (*column, above, size.recip())
            }
            Self::Shares(column, unit) => {
                let share = unit.quantity(file.number(row, *column)?).map_or(f64::NAN, |share| share.si());
                (*column, above, (share * stress.abs()).recip())
            }
        };
        let valid = root > 0.0 && root.is_finite();
        if valid { Ok(root) } else { Err(file.refuse_cell(row, column, allowed)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::data::{Mode, TestData};
    use crate::constitutive::hyperelastic::fit::{Agreement, Fit, fit};
    use crate::constitutive::hyperelastic::model;

    const TABLE: &str = "stretch,nominal_MPa,weight,sd_kPa,cv [%]\n1,0,1,1,1\n\
                         1.5,0.46,4,20,4.347826086956522\n2,0.70,1,40,5.714285714285714\n\
                         3,1.20,0.25,80,6.666666666666667\n";

    fn format(weight: &str, deviation: &str) -> TestFormat {
        let some = |name: &str| (!name.is_empty()).then(|| name.to_owned());
        TestFormat { weight_column: some(weight), deviation_column: some(deviation), ..TestFormat::default() }
    }

    fn read(format: &TestFormat) -> TestData {
        TestData::parse_as("t.csv", TABLE.as_bytes().to_vec(), format).unwrap().table
    }

    fn neo_hookean(table: &TestData) -> Fit {
        fit(model("neo-hookean").unwrap(), table).unwrap()
    }

    /// P = μg(λ) is linear in μ: μ = Σwgp/Σwg², with the standard error √(Σw(p − μg)²/(m − 1)/Σwg²).
    #[test]
    fn a_linear_law_in_closed_form() {
        let rows = [(1.5_f64, 0.46e6, 4.0), (2.0, 0.70e6, 1.0), (3.0, 1.20e6, 0.25)];
        let g = |l: f64| l - l.powi(-2);
        let sum = |of: &dyn Fn(f64, f64) -> f64| rows.iter().map(|(l, p, w)| w * of(g(*l), *p)).sum::<f64>();
        let modulus = sum(&|g, p| g * p) / sum(&|g, _| g * g);
        let squares = sum(&|g, p| (p - modulus * g).powi(2));
        let error = (squares / 2.0 / sum(&|g, _| g * g)).sqrt();
        let table = read(&format("weight", ""));
        let found = neo_hookean(&table);
        let own = &found.parameters[0];
        let differences = [
            own.value / modulus - 1.0,
            own.standard_error.unwrap() / error - 1.0,
            found.rms / (squares / 5.25).sqrt() - 1.0,
            Agreement::new(&found.law, &table).unwrap().rms / found.rms - 1.0,
        ];
        let worst = differences.into_iter().map(f64::abs).fold(0.0, f64::max);
        evidence::at_most("weighted fit of a linear law against its closed form, relative", worst, 1e-8);
        let plain = neo_hookean(&read(&TestFormat::default()));
        assert!((plain.parameters[0].value / modulus - 1.0).abs() > 0.01 && plain.chi.is_none());
        assert_eq!(read(&TestFormat::default()).states[1].roots, [1.0; 2]);
    }

    /// Standard deviations of 20, 40 and 80 kPa are the weights 4, 1 and ¼, whatever their form; χ² needs
    /// their size.
    #[test]
    fn standard_deviations_are_weights_of_known_size() {
        let weighted = neo_hookean(&read(&format("weight", "")));
        let mut chi = Vec::new();
        for table in [read(&format("", "sd")), read(&format("", "cv"))] {
            let found = neo_hookean(&table);
            assert!((found.parameters[0].value / weighted.parameters[0].value - 1.0).abs() < 1e-12);
            assert!((found.rms / weighted.rms - 1.0).abs() < 1e-12);
            chi.push(found.chi.unwrap());
            let deviations = table.states[1..].iter().map(|state| table.deviation.unwrap() / state.roots[0]);
            assert!(deviations.zip([2e4, 4e4, 8e4]).all(|(found, size)| (found / size - 1.0).abs() < 1e-12));
        }
        let modulus = weighted.parameters[0].value;
        let term = |(l, p, s): (f64, f64, f64)| ((p - modulus * (l - l.powi(-2))) / s).powi(2);
        let sum: f64 = [(1.5, 0.46e6, 2e4), (2.0, 0.7e6, 4e4), (3.0, 1.2e6, 8e4)].into_iter().map(term).sum();
        assert!(chi.iter().all(|chi| (chi / (sum / 2.0).sqrt() - 1.0).abs() < 1e-10), "{chi:?} {sum}");
        let one = TestFormat { deviation: Deviation::parse("3 %").ok(), ..TestFormat::default() };
        let share = read(&one);
        assert!((share.deviation.unwrap() / share.states[3].roots[0] / 36e3 - 1.0).abs() < 1e-12);
        let one = TestFormat { deviation: Deviation::parse("27 kPa + 3 %").ok(), ..TestFormat::default() };
        let both = read(&one);
        assert!((both.deviation.unwrap() / both.states[3].roots[0] / 45e3 - 1.0).abs() < 1e-12);
        let one = TestFormat { deviation: Deviation::parse("3 kPa").ok(), ..TestFormat::default() };
        let same = read(&one);
        assert!(
            (same.deviation.unwrap() / 3e3 - 1.0).abs() < 1e-12
                && (same.states[3].roots[0] - 1.0).abs() < 1e-15
        );
    }

    /// Tables of one law and two moduli: the mean that the weights give.
    #[test]
    fn tables_fitted_at_once_have_weights() {
        let of = |modulus: f64| {
            let p = modulus * 1.75;
            TestData::parse("t", &format!("stretch,nominal_Pa\n2,{p}\n")).unwrap()
        };
        let (soft, stiff) = (of(1e6), of(2e6));
        for (weight, expected) in [(1.0, 1.5e6), (3.0, 1.75e6)] {
            let both = TestData::join(&[(&soft, 1.0), (&stiff, weight)]).unwrap();
            let found = neo_hookean(&both).parameters[0].value;
            assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
            assert_eq!(both.select(Mode::Uniaxial).unwrap(), both);
        }
        let known = TestData { deviation: Some(1e3), ..stiff };
        let error = TestData::join(&[(&soft, 1.0), (&known, 1.0)]).unwrap_err().to_string();
        assert!(error.contains("standard deviations of all tables, or of none"), "{error}");
    }

    #[test]
    fn bad_weights_name_the_cell() {
        let of = |text: &str, format: &TestFormat| {
            TestData::parse_as("t.csv", text.as_bytes().to_vec(), format).unwrap_err().to_string()
        };
        let table = "stretch,nominal_MPa,w,s_MPa,q\n2,1,0,-1,1\n3,2,x,1,1\n";
        for (format, part) in [
            (format("w", ""), "line 2: column 3, `w`: found `0`"),
            (format("", "s"), "line 2: column 4, `s_MPa`: found `-1`"),
            (format("", "q"), "a unit of stress, or %, in the heading of `q`"),
            (format("v", ""), "the heading `v` of `weight_column`"),
            (format("w", "s"), "one of `weight_column`, `deviation_column` and `deviation`"),
        ] {
            let error = of(table, &format);
            assert!(error.contains(part), "{error}");
        }
        let error = of("stretch,nominal_MPa,w\n2,1,x\n", &format("w", ""));
        assert!(error.contains("line 2: column 3, `w`: found `x`"), "{error}");
        for text in ["0 MPa", "-2 %", "2 kg", "x", "inf MPa", "1 MPa + 2 MPa", "1 MPa +", ""] {
            assert!(Deviation::parse(text).is_err(), "{text}");
        }
    }
}
