//! Cross-validation of laws: each mode of deformation predicted by fits to the others.

use super::data::{Mode, TestData, TestState};
use super::fit::{Agreement, fit_until};
use super::{Error, Hyperelastic, ModelDescriptor};

/// Measurements of one mode of deformation.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeTable {
    /// Name of the mode.
    pub mode: &'static str,
    /// States with a measured stress.
    pub table: TestData,
}

/// Relative difference of stretches within which a general biaxial state counts as one of a simpler test.
const SAME: f64 = 1e-6;

/// Returns the mode of deformation of a state of an incompressible body, to which a pressure adds nothing:
/// compression of a bar is equibiaxial tension, compression of a sheet along both sides is uniaxial tension;
/// simple shear is pure shear but for a rotation.
fn mode_of(state: &TestState) -> Mode {
    let [first, second] = state.stretches;
    let same = |other: f64| (second / other - 1.0).abs() < SAME;
    let bar = |along: f64| if along < 1.0 { Mode::Equibiaxial } else { Mode::Uniaxial };
    match state.mode {
        Mode::Uniaxial => bar(first),
        Mode::Biaxial if state.nominal[1] == 0.0 => bar(first),
        Mode::Biaxial if state.nominal[0] == 0.0 => bar(second),
        Mode::Biaxial | Mode::Component if same(1.0) => Mode::PureShear,
        Mode::Biaxial | Mode::Component if same(first) => bar(first.powi(-2)),
        Mode::Equibiaxial => bar(first.powi(-2)),
        Mode::SimpleShear | Mode::PureShear => Mode::PureShear,
        // an average over pure shear from nil to that of the surface
        Mode::Torsion => Mode::Torsion,
        Mode::Biaxial | Mode::Component | Mode::Difference => Mode::Biaxial,
    }
}

/// Splits a table by mode of deformation, in the order in which they appear.
pub fn modes(table: &TestData) -> Vec<ModeTable> {
    let mut found: Vec<ModeTable> = Vec::new();
    for state in table.states.iter().filter(|state| state.measured().next().is_some()) {
        let mode = mode_of(state).name();
        match found.iter_mut().find(|one| one.mode == mode) {
            Some(one) => one.table.states.push(*state),
            None => {
                let table = TestData { states: vec![*state], ..table.clone() };
                found.push(ModeTable { mode, table });
            }
        }
    }
    found
}

impl ModeTable {
    /// Root mean square of the residuals of a law, without weights, over the largest measured stress; `None`
    /// where the law has no stress, beyond locking.
    pub fn error<L: Hyperelastic + ?Sized>(&self, law: &L) -> Option<f64> {
        let largest = self.table.states.iter().flat_map(TestState::measured);
        let largest = largest.map(f64::abs).fold(0.0, f64::max);
        let states = self.table.states.iter().map(|state| TestState { roots: [1.0; 2], ..*state });
        let plain = TestData::new(String::new(), states.collect());
        Agreement::new(law, &plain).ok().map(|found| found.rms / largest)
    }
}

/// Errors of a law in modes to which it was not fitted, as [`ModeTable::error`] defines them. `None`: no fit,
/// or a law that locks.
#[derive(Debug, Clone, PartialEq)]
pub struct CrossValidation {
    /// Error in each mode of a fit to all others.
    pub left_out: Vec<Option<f64>>,
    /// Largest error, of a fit to each mode alone, in the others.
    pub alone: Vec<Option<f64>>,
}

impl CrossValidation {
    /// Fits a law to all modes but one, and to each alone, and judges it on the rest.
    ///
    /// # Errors
    /// [`Error::Stopped`] if `stop` returned true.
    pub fn new(
        model: &'static ModelDescriptor,
        modes: &[ModeTable],
        stop: &dyn Fn() -> bool,
    ) -> Result<Self, Error> {
        // error of a fit to some modes in all others
        let judge = |fitted: &dyn Fn(usize) -> bool| {
            let part = |wanted: bool| {
                modes.iter().enumerate().filter(move |(i, _)| fitted(*i) == wanted).map(|(_, mode)| mode)
            };
            let states = part(true).flat_map(|mode| mode.table.states.iter().copied()).collect();
            let table = TestData::new(String::new(), states);
            match fit_until(model, &table, stop) {
                Ok(fit) => Ok(worst(part(false).map(|mode| mode.error(&fit.law)))),
                Err(Error::Stopped) => Err(Error::Stopped),
                Err(_) => Ok(None),
            }
        };
        let all = 0..modes.len();
        Ok(Self {
            left_out: all.clone().map(|one| judge(&|i| i != one)).collect::<Result<_, _>>()?,
            alone: all.map(|one| judge(&|i| i == one)).collect::<Result<_, _>>()?,
        })
    }

    /// Largest error in a mode left out; `None` if one is missing.
    pub fn worst(&self) -> Option<f64> {
        worst(self.left_out.iter().copied())
    }
}

/// Largest of some errors; `None` if one is missing.
fn worst(mut errors: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    errors.try_fold(0.0, |most: f64, error| Some(most.max(error?)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::{homogeneous, model};

    fn state(mode: Mode, stretches: [f64; 2], nominal: [f64; 2]) -> TestState {
        TestState::new(mode, stretches, nominal)
    }

    #[test]
    fn modes_of_states() {
        let states = [
            (Mode::Uniaxial, [2.0, 0.5_f64.sqrt()], [1.0, 0.0], "uniaxial"),
            (Mode::Uniaxial, [1.0, 1.0], [0.0, 0.0], "at rest"),
            (Mode::Biaxial, [2.0, 0.7], [1.0, 0.0], "uniaxial"),
            (Mode::Uniaxial, [0.5, 2.0_f64.sqrt()], [-1.0, 0.0], "equibiaxial"),
            (Mode::Biaxial, [2.0_f64.sqrt(), 0.5], [0.0, -1.0], "equibiaxial"),
            (Mode::Equibiaxial, [0.8, 0.8], [-1.0, 0.0], "uniaxial"),
            (Mode::Biaxial, [2.0, 1.0], [1.0, 0.5], "pure-shear"),
            (Mode::Component, [2.0, 1.0], [0.0, 0.5], "pure-shear"),
            (Mode::SimpleShear, [2.0, 1.0], [1.0, 0.0], "pure-shear"),
            (Mode::Component, [2.0, 2.0], [1.0, 0.0], "equibiaxial"),
            (Mode::Biaxial, [2.0, 1.5], [1.0, 0.5], "biaxial"),
            (Mode::Difference, [2.0, 1.0], [1.0, 0.0], "biaxial"),
            (Mode::Torsion, [2.0, 0.5], [1.0, -0.5], "torsion"),
        ];
        let states = states.iter().map(|(mode, l, p, _)| state(*mode, *l, *p)).collect();
        let table = TestData::new(String::new(), states);
        let found = modes(&table);
        let shown: Vec<_> = found.iter().map(|one| (one.mode, one.table.states.len())).collect();
        let expected =
            [("uniaxial", 3), ("equibiaxial", 3), ("pure-shear", 3), ("biaxial", 2), ("torsion", 1)];
        assert_eq!(shown, expected);
    }

    /// μ fitted to tension of a body of 1 Pa errs in equibiaxial tension of one of 2 Pa by half of each
    /// stress, and twice as much the other way round; of two modes, one left out is the other alone.
    #[test]
    fn errors_in_closed_form() {
        let law = model("neo-hookean").unwrap().law(&[1.0]).unwrap();
        let sheet = |l: f64| 2.0 * homogeneous::equibiaxial(&law, l).unwrap();
        let bar = |l: f64| homogeneous::uniaxial(&law, l).unwrap();
        let states = [1.5, 2.0].into_iter().flat_map(|l: f64| {
            [
                state(Mode::Uniaxial, [l, l.recip().sqrt()], [bar(l), 0.0]),
                state(Mode::Equibiaxial, [l, l], [sheet(l), 0.0]),
            ]
        });
        let table = TestData::new(String::new(), states.collect());
        let modes = modes(&table);
        let found = CrossValidation::new(model("neo-hookean").unwrap(), &modes, &|| false).unwrap();
        let rms = |a: f64, b: f64| (0.5 * (a * a + b * b)).sqrt();
        let bar = rms(bar(1.5), bar(2.0)) / bar(2.0);
        let sheet = 0.5 * rms(sheet(1.5), sheet(2.0)) / sheet(2.0);
        for (found, expected) in [(found.left_out[0], bar), (found.left_out[1], sheet)] {
            assert!((found.unwrap() / expected - 1.0).abs() < 1e-6, "{found:?} {expected}");
        }
        assert_eq!(found.alone, [found.left_out[1], found.left_out[0]]);
        assert!((found.worst().unwrap() / bar.max(sheet) - 1.0).abs() < 1e-6);
        // a law of six parameters has no fit to two states
        let found = CrossValidation::new(model("ogden-3").unwrap(), &modes, &|| false).unwrap();
        assert_eq!((found.worst(), &found.alone), (None, &vec![None, None]));
        let stopped = CrossValidation::new(model("gent").unwrap(), &modes, &|| true);
        assert_eq!(stopped, Err(Error::Stopped));
    }
}
