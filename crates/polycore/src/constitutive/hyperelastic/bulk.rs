//! Volumetric tests: pressure against the ratio of volumes, and the bulk modulus.

#[cfg(feature = "tables")]
use std::path::Path;

use nalgebra::{DMatrix, DVector};

use super::Error;
#[cfg(feature = "tables")]
use crate::table::{self, Table};
#[cfg(feature = "tables")]
use crate::units::dimension::{RatioDimension, StressDimension};

/// State of a volumetric test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VolumetricState {
    /// Ratio of volumes J.
    pub ratio: f64,
    /// Pressure, Pa, above 0 in compression.
    pub pressure: f64,
}

/// Volumetric energy U = Σ (J − 1)²ⁱ/Dᵢ of finite-element programs (Abaqus Theory Guide, 4.6.1), fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumetricFit {
    /// Bulk modulus K = 2/D₁, Pa.
    pub bulk: f64,
    /// Standard error of K, Pa; `None` if the states are as many as the terms.
    pub bulk_error: Option<f64>,
    /// Dᵢ, 1/Pa.
    pub compliances: Vec<f64>,
    /// Root mean square of the residuals of the pressure, Pa.
    pub rms: f64,
}

impl VolumetricFit {
    /// Fits p = −dU/dJ = −Σ 2i (J − 1)²ⁱ⁻¹/Dᵢ, linear in 1/Dᵢ, by least squares. States at J = 1 do not
    /// count.
    ///
    /// # Errors
    /// [`Error::Data`] for fewer states than terms, and for a bulk modulus that is not above 0 or a term that
    /// the states do not determine.
    pub fn new(states: &[VolumetricState], terms: usize) -> Result<Self, Error> {
        let refused = |reason: String| Error::Data { what: "volumetric test".to_owned(), reason };
        let states: Vec<&VolumetricState> = states.iter().filter(|state| state.ratio != 1.0).collect();
        if terms == 0 || states.len() < terms {
            return Err(refused(format!("{} states away from rest for {terms} terms", states.len())));
        }
        let column = |i: usize| {
            let power =
                |state: &&VolumetricState| -2.0 * i as f64 * (state.ratio - 1.0).powi(2 * i as i32 - 1);
            DVector::from_iterator(states.len(), states.iter().map(power))
        };
        let columns: Vec<DVector<f64>> = (1..=terms).map(column).collect();
        let norms: Vec<f64> = columns.iter().map(|column| column.norm()).collect();
        let scaled: Vec<DVector<f64>> =
            columns.iter().zip(&norms).map(|(column, norm)| column / *norm).collect();
        let (matrix, data) = (
            DMatrix::from_columns(&scaled),
            DVector::from_iterator(states.len(), states.iter().map(|state| state.pressure)),
        );
        let inverse = matrix.tr_mul(&matrix).cholesky().map(|factor| factor.inverse());
        let inverse = inverse.filter(|inverse| inverse.iter().all(|value| value.abs() < 1e9));
        let inverse = inverse.ok_or_else(|| refused(format!("the states do not determine {terms} terms")))?;
        let found = &inverse * matrix.tr_mul(&data);
        let squares = (&matrix * &found - &data).norm_squared();
        let bulk = 2.0 * found[0] / norms[0];
        if !(bulk > 0.0 && bulk.is_finite()) {
            let allowed = "a ratio of volumes below 1 under pressure, above 1 under tension";
            return Err(refused(format!("bulk modulus of {bulk:.6e} Pa; allowed: {allowed}")));
        }
        let degrees = states.len() - terms;
        let error = || 2.0 * (squares / degrees as f64 * inverse[(0, 0)]).sqrt() / norms[0];
        Ok(Self {
            bulk,
            bulk_error: (degrees > 0).then(error),
            compliances: found.iter().zip(&norms).map(|(value, norm)| norm / value).collect(),
            rms: (squares / states.len() as f64).sqrt(),
        })
    }

    /// Pressure at a ratio of volumes, Pa.
    pub fn pressure(&self, ratio: f64) -> f64 {
        let term = |(i, d): (usize, &f64)| -2.0 * i as f64 * (ratio - 1.0).powi(2 * i as i32 - 1) / d;
        (1..).zip(&self.compliances).map(term).sum()
    }
}

#[cfg(feature = "tables")]
impl VolumetricState {
    /// Reads a table of columns `pressure [MPa]` and `J` (`volume ratio`), or `volumetric strain [%]`, J − 1.
    ///
    /// # Errors
    /// [`crate::Error::Io`]; columns that are missing or have no unit, cells that are no number, a ratio that
    /// is not above 0.
    pub fn read(path: impl AsRef<Path>) -> Result<Vec<Self>, crate::Error> {
        Ok(Self::of_table(&Table::read(path)?)?)
    }

    fn of_table(file: &Table) -> Result<Vec<Self>, table::Error> {
        let pressure = file.require_column(&["pressure", "p", "hydrostatic pressure"])?;
        let unit = file.unit::<StressDimension>(pressure, None)?;
        let strain = file.matching(&["volumetric strain", "volume strain"]).first().copied();
        let (column, rest) = match strain {
            Some(column) => {
                file.require_unit(column, "`volumetric strain [%]` or `volumetric strain [mm/mm]`")?;
                (column, 1.0)
            }
            None => (file.require_column(&["J", "volume ratio", "relative volume"])?, 0.0),
        };
        let ratios = file.unit::<RatioDimension>(column, None)?;
        let mut states = Vec::with_capacity(file.rows());
        for row in 0..file.rows() {
            let value = |column: usize| file.number(row, column);
            let size = unit.quantity(value(pressure)?).map(|pressure| pressure.si());
            let pressure = size.map_err(|error| file.refuse_cell(row, pressure, &error.to_string()))?;
            let share = ratios.quantity(value(column)?).map(|ratio| ratio.si());
            let ratio = rest + share.map_err(|error| file.refuse_cell(row, column, &error.to_string()))?;
            if ratio <= 0.0 {
                return Err(file.refuse_cell(
                    row,
                    column,
                    "a ratio of volumes above 0, a strain above −100 %",
                ));
            }
            states.push(Self { ratio, pressure });
        }
        Ok(states)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn states(points: &[(f64, f64)]) -> Vec<VolumetricState> {
        points.iter().map(|&(ratio, pressure)| VolumetricState { ratio, pressure }).collect()
    }

    /// Fit of one term: K = −Σ(J − 1)p/Σ(J − 1)², with the standard error of a line through rest.
    #[test]
    fn one_term_in_closed_form() {
        let points = [(1.0, 0.0), (0.995, 10.2e6), (0.99, 19.9e6), (0.98, 40.3e6), (1.002, -4.1e6)];
        let found = VolumetricFit::new(&states(&points), 1).unwrap();
        let sum =
            |of: &dyn Fn(f64, f64) -> f64| points[1..].iter().map(|(j, p)| of(j - 1.0, *p)).sum::<f64>();
        let squares = sum(&|x, _| x * x);
        let bulk = -sum(&|x, p| x * p) / squares;
        let error = (sum(&|x, p| (p + bulk * x).powi(2)) / 3.0 / squares).sqrt();
        let worst = [
            found.bulk / bulk - 1.0,
            found.bulk_error.unwrap() / error - 1.0,
            found.compliances[0] * bulk / 2.0 - 1.0,
        ];
        let worst = worst.into_iter().map(f64::abs).fold(0.0, f64::max);
        evidence::at_most("bulk modulus of a volumetric test against its closed form, relative", worst, 1e-9);
        assert!((found.pressure(0.99) / (0.01 * bulk) - 1.0).abs() < 1e-12);
    }

    /// Three terms of known Dᵢ come back.
    #[test]
    fn terms_return() {
        let d = [1e-9, 2e-11, 5e-13];
        let pressure = |j: f64| -> f64 {
            (1..).zip(d).map(|(i, d)| -2.0 * f64::from(i) * (j - 1.0).powi(2 * i - 1) / d).sum()
        };
        let points: Vec<_> = (1..20).map(|k| 1.0 - 0.01 * f64::from(k)).map(|j| (j, pressure(j))).collect();
        let found = VolumetricFit::new(&states(&points), 3).unwrap();
        assert!(found.compliances.iter().zip(d).all(|(a, b)| (a / b - 1.0).abs() < 1e-6), "{found:?}");
        assert!((found.bulk / 2e9 - 1.0).abs() < 1e-6 && found.rms < 1e-6 * pressure(0.81), "{found:?}");
    }

    #[test]
    fn bad_tests_are_refused() {
        for (points, terms, part) in [
            (&[(1.0, 0.0), (0.99, 2e7)][..], 2, "1 states away from rest for 2 terms"),
            (&[(1.01, 2e7), (1.02, 4e7)], 1, "a ratio of volumes below 1 under pressure"),
            (&[(0.99, 2e7), (0.99, 2e7), (0.99, 2e7)], 2, "do not determine 2 terms"),
            (&[(0.99, 2e7)], 0, "for 0 terms"),
        ] {
            let error = VolumetricFit::new(&states(points), terms).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }

    #[cfg(feature = "tables")]
    #[test]
    fn tables_of_pressure() {
        let read = |text: &str| {
            let file = Table::parse("v.csv", text.as_bytes().to_vec()).unwrap();
            VolumetricState::of_table(&file).map_err(|error| error.to_string())
        };
        let expected = states(&[(0.98, 4e7)]);
        for text in [
            "J,pressure [MPa]\n0.98,40\n",
            "pressure/kPa;volumetric strain [%]\n40000;-2\n",
            "volumetric strain [mm/mm],pressure [MPa]\n-0.02,40\n",
        ] {
            let found = read(text).unwrap();
            assert!(
                (found[0].ratio - 0.98).abs() < 1e-12 && found[0].pressure == expected[0].pressure,
                "{found:?}"
            );
        }
        for (text, part) in [
            ("J,pressure\n1,1\n", "unit of column 2, `pressure`"),
            ("volumetric strain,pressure [MPa]\n-2,40\n", "unit of column 1, `volumetric strain`"),
            ("J,pressure [MPa]\n0,1\n", "v.csv:2: column 1, `J`: found \"0\""),
            ("ratio,pressure [MPa]\n1,1\n", "one column `J [unit]`"),
            ("J,pressure [MPa]\nx,1\n", "v.csv:2: column 1, `J`: found \"x\""),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }
}
