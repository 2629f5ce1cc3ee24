//! Drucker stability of a law, within the range of the tests and beyond.

use super::data::{Mode, TestData};
use super::{Hyperelastic, homogeneous};

/// Number of steps of a scan from rest to the end of a range.
const STEPS: usize = 200;
/// Step of the differences in ln λ; their error is its square.
const STEP: f64 = 1e-5;

/// Least and largest first stretch of a table, 1 included.
pub fn range(table: &TestData) -> [f64; 2] {
    let stretches = table.states.iter().map(|state| state.stretches[0]);
    stretches.fold([1.0, 1.0], |[low, high], l| [l.min(low), l.max(high)])
}

/// Returns the stretch, between rest and `to`, from which an incompressible law is unstable in a test: there
/// ∂τᵢ/∂ln λⱼ, τᵢ = λᵢPᵢ at a free third face, is not positive definite (Drucker's postulate dτ : dε > 0 for
/// all strains in the plane of the sheet). `None` if it is stable up to `to` or up to its locking stretch.
pub fn unstable_from<L: Hyperelastic + ?Sized>(law: &L, mode: Mode, to: f64) -> Option<f64> {
    let stress = |logs: [f64; 2]| {
        let [a, b] = logs.map(f64::exp);
        homogeneous::biaxial(law, a, b).ok().map(|nominal| [a * nominal[0], b * nominal[1]])
    };
    for step in 0..=STEPS {
        let stretch = to.powf(step as f64 / STEPS as f64);
        let at = [stretch.ln(), mode.second_stretch(stretch).ln()];
        let mut slopes = [[0.0; 2]; 2];
        for j in [0, 1] {
            let (mut up, mut down) = (at, at);
            up[j] += STEP;
            down[j] -= STEP;
            let (up, down) = (stress(up)?, stress(down)?);
            for i in [0, 1] {
                slopes[i][j] = (up[i] - down[i]) / (2.0 * STEP);
            }
        }
        let [[a, b], [c, d]] = slopes;
        if !(a > 0.0 && d > 0.0 && a * d - b * c > 0.0) {
            return Some(stretch);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::{MODELS, MooneyRivlin, Ogden, OgdenConvention};

    /// Laws with positive terms are stable everywhere; a Mooney–Rivlin law of C₂ < 0 in equibiaxial tension
    /// is not, and an Ogden law with a softening term loses it where dτ/dln λ = 3C₁… has its zero in closed
    /// form.
    #[test]
    fn drucker_in_the_sheet() {
        for model in MODELS {
            let law = model.law(model.example).unwrap();
            for mode in Mode::TESTS {
                assert_eq!(unstable_from(&law, mode, 3.0), None, "{}", model.key);
                assert_eq!(unstable_from(&law, mode, 0.5), None, "{}", model.key);
            }
        }
        // equibiaxial: τ = 2C₁(λ² − λ⁻⁴) + 2C₂(λ⁴ − λ⁻²); along the diagonal dτ/dln λ = 2C₁(2λ² + 4λ⁻⁴) +
        // 2C₂(4λ⁴ + 2λ⁻²)
        let law = MooneyRivlin::new(1e6, -0.05e6).unwrap();
        let slope =
            |l: f64| 2.0 * (2.0 * l.powi(2) + 4.0 * l.powi(-4)) - 0.1 * (4.0 * l.powi(4) + 2.0 * l.powi(-2));
        let found = unstable_from(&law, Mode::Equibiaxial, 6.0).unwrap();
        let zero = (0..10_000).map(|i| 1.0 + 5e-4 * f64::from(i)).find(|l| slope(*l) < 0.0).unwrap();
        assert!(found <= zero * 1.01 && found > 0.5 * zero, "{found} {zero}");
        // uniaxial Ogden of α = −4 alone: stable everywhere by itself
        let law = Ogden::new(OgdenConvention::Abaqus, &[(1e6, -4.0)]).unwrap();
        assert_eq!(unstable_from(&law, Mode::Uniaxial, 5.0), None);
    }
}
