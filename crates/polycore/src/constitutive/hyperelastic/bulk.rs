//! Volumetric tests: pressure against the ratio of volumes, and the bulk modulus.

#[cfg(feature = "tables")]
use std::path::Path;

use nalgebra::{DMatrix, DVector};

use super::Error;
use crate::numerics::bisection::bisected;
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
    /// Standard errors of Dᵢ, 1/Pa: Dᵢ² times that of 1/Dᵢ, to first order. Empty if the states are as many
    /// as the terms.
    pub compliance_errors: Vec<f64>,
    /// Root mean square of the residuals of the pressure, Pa.
    pub rms: f64,
    /// Least and largest J of the states, 1 included.
    pub range: [f64; 2],
}

/// Change of volume |J − 1| up to which a pressure should rise with compression, even beyond the states.
const LEAST_CHANGE: f64 = 0.2;

/// Number of steps of a scan of the stiffness from rest.
const STEPS: usize = 1000;

impl VolumetricFit {
    /// Fits p = −dU/dJ = −Σ 2i (J − 1)²ⁱ⁻¹/Dᵢ, linear in 1/Dᵢ, by least squares. States at J = 1 do not
    /// count.
    ///
    /// # Errors
    /// [`Error::Data`] for fewer states than terms, states that are not finite or without a volume, and for a
    /// bulk modulus that is not above 0 or a term that the states do not determine.
    pub fn new(states: &[VolumetricState], terms: usize) -> Result<Self, Error> {
        let refused = |reason: String| Error::Data { what: "volumetric test".to_owned(), reason };
        let is_valid = |state: &VolumetricState| {
            state.ratio > 0.0 && state.ratio.is_finite() && state.pressure.is_finite()
        };
        if let Some((at, VolumetricState { ratio, pressure })) =
            states.iter().enumerate().find(|(_, state)| !is_valid(state))
        {
            let allowed = "a ratio of volumes above 0 and a finite pressure";
            return Err(refused(format!("state {at}: J = {ratio}, {pressure} Pa; allowed: {allowed}")));
        }
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
            let fewer = if terms > 1 { "; or fewer terms" } else { "" };
            return Err(refused(format!("bulk modulus of {bulk:.6e} Pa; allowed: {allowed}{fewer}")));
        }
        let compliances: Vec<f64> = found.iter().zip(&norms).map(|(value, norm)| norm / value).collect();
        let degrees = states.len() - terms;
        // of 1/Dᵢ, relative
        let shares = (0..terms)
            .map(|i| (squares / degrees as f64 * inverse[(i, i)]).sqrt() / found[i].abs())
            .filter(|_| degrees > 0);
        let compliance_errors: Vec<f64> =
            shares.zip(&compliances).map(|(share, compliance)| share * compliance.abs()).collect();
        let bulk_error = compliance_errors.first().map(|error| bulk * error / compliances[0]);
        let ends = states
            .iter()
            .fold([1.0_f64, 1.0_f64], |[low, high], state| [low.min(state.ratio), high.max(state.ratio)]);
        let rms = (squares / states.len() as f64).sqrt();
        Ok(Self { bulk, bulk_error, compliances, compliance_errors, rms, range: ends })
    }

    /// Pressure at a ratio of volumes, Pa.
    pub fn pressure(&self, ratio: f64) -> f64 {
        let term = |(i, d): (usize, &f64)| -2.0 * i as f64 * (ratio - 1.0).powi(2 * i as i32 - 1) / d;
        (1..).zip(&self.compliances).map(term).sum()
    }

    /// Stiffness −dp/dJ = Σ 2i (2i − 1) (J − 1)²ⁱ⁻²/Dᵢ at a change of volume |J − 1|, Pa.
    fn stiffness(&self, change: f64) -> f64 {
        let term = |(i, d): (i32, &f64)| f64::from(2 * i * (2 * i - 1)) * change.powi(2 * i - 2) / d;
        (1..).zip(&self.compliances).map(term).sum()
    }

    /// Returns the least change of volume |J − 1| at which the pressure no longer rises with compression,
    /// within the states or 0.2; `None` if it rises throughout.
    pub fn softening(&self) -> Option<f64> {
        let [low, high] = self.range;
        let end = LEAST_CHANGE.max(1.0 - low).max(high - 1.0);
        let at = |step: usize| end * step as f64 / STEPS as f64;
        let lost = (1..=STEPS).find(|&step| self.stiffness(at(step)) <= 0.0)?;
        Some(bisected(at(lost - 1), at(lost), 60, |change| self.stiffness(change) > 0.0))
    }

    /// Returns the numbers i of the Dᵢ whose standard errors exceed their values.
    pub fn undetermined(&self) -> Vec<usize> {
        let pairs = self.compliances.iter().zip(&self.compliance_errors);
        let shares = pairs.map(|(compliance, error)| error / compliance.abs());
        (1..).zip(shares).filter(|(_, share)| *share > 1.0 || share.is_nan()).map(|(i, _)| i).collect()
    }

    /// Describes the defects for which the terms should not be used as they are, a line each: errors that
    /// are unknown or exceed their values, a pressure that falls with compression.
    pub fn warnings(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if self.compliance_errors.is_empty() {
            lines.push("the errors of D are unknown: there are as many states as terms".to_owned());
        }
        let advice = "use fewer terms, or states of larger changes of volume";
        for i in self.undetermined() {
            let share = self.compliance_errors[i - 1] / self.compliances[i - 1].abs();
            lines.push(format!(
                "D{i} is not determined: its standard error is {:.0} % of it; {advice}",
                100.0 * share
            ));
        }
        if let Some(change) = self.softening() {
            let [low, high] = self.range;
            let within = if 1.0 - change > low || 1.0 + change < high { "within" } else { "beyond" };
            lines.push(format!(
                "the pressure falls with compression at J below {:.4} and with expansion above {:.4}, \
                 {within} the states of {low:.4} to {high:.4}: a body there is unstable; {advice}",
                1.0 - change,
                1.0 + change
            ));
        }
        lines
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

    /// Standard errors of two terms by their closed form: of the 2 × 2 normal equations of 1/D₁ and 1/D₂.
    #[test]
    fn errors_of_two_terms() {
        let points = [(0.99, 20.5e6), (0.98, 41e6), (0.96, 88e6), (0.93, 190e6), (0.9, 330e6)];
        let found = VolumetricFit::new(&states(&points), 2).unwrap();
        let [x, y] = [1, 2].map(|i| points.map(|(j, _)| -2.0 * f64::from(i) * (j - 1.0_f64).powi(2 * i - 1)));
        let dot = |a: [f64; 5], b: [f64; 5]| (0..5).map(|k| a[k] * b[k]).sum::<f64>();
        let determinant = dot(x, x) * dot(y, y) - dot(x, y).powi(2);
        let residuals = points.map(|(j, p)| p - found.pressure(j));
        let variance = dot(residuals, residuals) / 3.0;
        let errors = [dot(y, y), dot(x, x)].map(|part| (variance * part / determinant).sqrt());
        let worst = (0..2)
            .map(|i| found.compliance_errors[i] / (found.compliances[i].powi(2) * errors[i]) - 1.0)
            .chain([found.bulk_error.unwrap() / (2.0 * errors[0]) - 1.0])
            .map(f64::abs)
            .fold(0.0, f64::max);
        evidence::at_most("standard errors of two terms against their closed form, relative", worst, 1e-6);
        assert_eq!((found.range, found.warnings()), ([0.9, 1.0], vec![]));
    }

    /// U″ = 2/D₁ + 12 x²/D₂ with D₂ below 0 is 0 at x = √(−D₂/(6D₁)), here 0.1.
    #[test]
    fn pressures_that_fall_with_compression() {
        let [first, second] = [1e-9, -6e-11];
        let pressure = |j: f64| -2.0 * (j - 1.0) / first - 4.0 * (j - 1.0).powi(3) / second;
        for (last, place) in [(0.95, "beyond the states of 0.9500"), (0.85, "within the states of 0.8500")] {
            let points: Vec<_> = (1..=10).map(|k| 1.0 - f64::from(k) * (1.0 - last) / 10.0).collect();
            let points: Vec<_> = points.into_iter().map(|j| (j, pressure(j))).collect();
            let found = VolumetricFit::new(&states(&points), 2).unwrap();
            assert!((found.softening().unwrap() - 0.1).abs() < 1e-8, "{found:?}");
            let warnings = found.warnings();
            assert!(warnings.len() == 1 && warnings[0].contains(place), "{warnings:?}");
            assert!(warnings[0].contains("J below 0.9000 and with expansion above 1.1000"), "{warnings:?}");
        }
        // stable up to 0.2 and within the states
        assert_eq!(VolumetricFit::new(&states(&[(0.99, 2e7), (0.98, 4e7)]), 1).unwrap().softening(), None);
    }

    /// Noise decides on the third term of small changes of volume; two states leave no error of two terms.
    #[test]
    fn terms_that_the_states_do_not_determine() {
        let noise = [0.3e6, -0.4e6, 0.2e6, -0.3e6, 0.4e6, -0.2e6];
        let points: Vec<_> = (1..)
            .zip(noise)
            .map(|(k, noise)| (1.0 - 0.005 * f64::from(k), 1e7 * f64::from(k) + noise))
            .collect();
        let found = VolumetricFit::new(&states(&points), 3).unwrap();
        assert_eq!(found.undetermined(), [2, 3], "{found:?}");
        let warnings = found.warnings();
        assert!(warnings[0].starts_with("D2 is not determined: its standard error is"), "{warnings:?}");
        let found = VolumetricFit::new(&states(&[(0.99, 2e7), (0.98, 4.1e7)]), 2).unwrap();
        assert!(found.bulk_error.is_none() && found.warnings()[0].contains("as many states"), "{found:?}");
    }

    #[test]
    fn bad_tests_are_refused() {
        for (points, terms, part) in [
            (&[(1.0, 0.0), (0.99, 2e7)][..], 2, "1 states away from rest for 2 terms"),
            (&[(1.01, 2e7), (1.02, 4e7)], 1, "a ratio of volumes below 1 under pressure"),
            (&[(0.99, 2e7), (0.99, 2e7), (0.99, 2e7)], 2, "do not determine 2 terms"),
            (&[(0.99, 2e7)], 0, "for 0 terms"),
            (&[(0.99, 2e7), (f64::NAN, 2e7)], 1, "state 1: J = NaN, 20000000 Pa"),
            (&[(0.99, f64::INFINITY)], 1, "a finite pressure"),
            (&[(0.99, 1e6), (0.98, 1e6), (0.9, 9e8)], 2, "under tension; or fewer terms"),
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
