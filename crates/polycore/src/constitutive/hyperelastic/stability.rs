//! Drucker stability and ellipticity of a law, within the range of the tests and beyond.

use std::f64::consts::{FRAC_PI_2, PI};

use super::data::{Mode, TestData, TestState};
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

/// Number of directions in a right angle of a scan for waves: the least one is missed by up to π/48.
const DIRECTIONS: usize = 12;

/// Least stiffness ρc² of a plane wave in an incompressible law, Pa, over directions n and amplitudes a ⊥ n
/// at principal stretches: a⊗n : 𝕔 : a⊗n + σₙₙ, 𝕔 the tangent pushed forward; the pressure drops out. Below
/// zero the law is not elliptic: bands of localised strain may form (Zee & Sternberg,
/// doi:10.1007/BF00281556). `None` where the law has no stress.
pub fn least_wave_stiffness<L: Hyperelastic + ?Sized>(law: &L, stretches: [f64; 3]) -> Option<f64> {
    let response = law.response_at(stretches).ok()?;
    let squares = stretches.map(|l| l * l);
    let stiffness = |n: [f64; 3], a: [f64; 3]| {
        let mut sum = 0.0;
        for i in 0..3 {
            sum += squares[i] * response.stress[i] * n[i] * n[i];
            for j in 0..3 {
                sum += squares[i] * squares[j] * response.normal[i][j] * a[i] * n[i] * a[j] * n[j];
                if i < j {
                    let shear = response.shear_between(i, j) * squares[i] * squares[j];
                    sum += shear * (a[i] * n[j] + a[j] * n[i]).powi(2);
                }
            }
        }
        sum
    };
    let mut least = f64::INFINITY;
    let right = |k: usize| FRAC_PI_2 * k as f64 / DIRECTIONS as f64;
    // the principal planes are planes of symmetry: n in one octant
    for polar in (0..=DIRECTIONS).map(right) {
        for azimuth in (0..=DIRECTIONS).map(right) {
            let ((s, c), (sine, cosine)) = (polar.sin_cos(), azimuth.sin_cos());
            let n = [s * cosine, s * sine, c];
            let across = [[c * cosine, c * sine, -s], [-sine, cosine, 0.0]];
            for turn in (0..2 * DIRECTIONS).map(|k| PI * k as f64 / (2 * DIRECTIONS) as f64) {
                let a = std::array::from_fn(|i| turn.cos() * across[0][i] + turn.sin() * across[1][i]);
                least = least.min(stiffness(n, a));
            }
        }
    }
    Some(least)
}

/// Counts the states of a table at which a law is not elliptic ([`least_wave_stiffness`]).
pub fn count_states_without_ellipticity<L: Hyperelastic + ?Sized>(law: &L, table: &TestData) -> usize {
    let lost = |state: &&TestState| {
        let least = state.principal_stretches().ok().and_then(|l| least_wave_stiffness(law, l));
        least.is_some_and(|least| least <= 0.0)
    };
    table.states.iter().filter(lost).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::{MODELS, MooneyRivlin, Ogden, OgdenConvention};

    /// W(I₁) in the plane of λ₁, λ₃ with n at the angle θ, q = cos²θ, d = λ₁² − λ₃²: ρc² = 2W′(λ₃² + qd) +
    /// 4W″q(1 − q)d², a parabola in q; examples of all laws are elliptic.
    #[test]
    fn waves_of_softening_laws() {
        for model in MODELS {
            let law = model.law(model.example).unwrap();
            for stretches in [[1.0; 3], [2.0, 1.0, 0.5], [3.0, 0.5, 1.0 / 1.5]] {
                assert!(least_wave_stiffness(&law, stretches).unwrap() > 0.0, "{}", model.key);
            }
        }
        let law = crate::constitutive::hyperelastic::Yeoh::new([1.0, -0.1, 0.006]).unwrap();
        let mut worst: f64 = 0.0;
        for l in [1.5_f64, 2.0, 2.3] {
            let (x, d) = (l * l + l.powi(-2) - 2.0, l * l - l.powi(-2));
            let (slope, curvature) = (1.0 - 0.2 * x + 0.018 * x * x, -0.2 + 0.036 * x);
            let at = |q: f64| 2.0 * slope * (l.powi(-2) + q * d) + 4.0 * curvature * q * (1.0 - q) * d * d;
            let expected = (0..=10_000).map(|k| at(1e-4 * f64::from(k))).fold(f64::INFINITY, f64::min);
            let found = least_wave_stiffness(&law, [l, 1.0, 1.0 / l]).unwrap();
            worst = worst.max((found - expected).abs() / law.shear_modulus());
        }
        evidence::at_most("least ρc² of a softening Yeoh law over μ, against its parabola", worst, 2e-2);
        let softer = crate::constitutive::hyperelastic::Yeoh::new([1.0, -0.2, 0.015]).unwrap();
        let state = |l: f64| TestState::new(Mode::PureShear, [l, 1.0], [1.0, 0.0]);
        let table = TestData::new(String::new(), [1.2, 1.6, 2.0].map(state).to_vec());
        let lost = |l: f64| {
            let (x, d) = (l * l + l.powi(-2) - 2.0, l * l - l.powi(-2));
            let (slope, curvature) = (1.0 - 0.4 * x + 0.045 * x * x, -0.4 + 0.09 * x);
            (0..=1000)
                .map(|k| 1e-3 * f64::from(k))
                .any(|q| 2.0 * slope * (l.powi(-2) + q * d) + 4.0 * curvature * q * (1.0 - q) * d * d < 0.0)
        };
        let expected = [1.2, 1.6, 2.0].into_iter().filter(|l| lost(*l)).count();
        assert!((1..3).contains(&expected));
        assert_eq!(count_states_without_ellipticity(&softer, &table), expected);
    }

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
