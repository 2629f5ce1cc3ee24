//! Uniform states in which a solid reaches its strength.

use super::point_law::{Deformation, PointLaw};
use super::tensor::BodyTensor;
use polycore::numerics::bisect;
use std::cmp::Ordering;

/// Greatest stretch considered.
const GREATEST: f64 = 1e3;

/// Finds uniaxial tension of stretch λ₁: the lateral stretch with free sides, by bisection.
fn pulled<const D: usize>(
    law: &(impl PointLaw<D> + ?Sized),
    stretch: f64,
) -> (Deformation<D>, BodyTensor<D>) {
    let at = |side: f64| {
        let entry = |a: usize| if a == 0 { stretch - 1.0 } else { side - 1.0 };
        let displacement_gradient = BodyTensor::from_fn(|a, b| if a == b { entry(a) } else { 0.0 });
        let deformation = Deformation::homogeneous(displacement_gradient);
        let piola = law.respond(&deformation).piola;
        (deformation, piola)
    };
    // a body without volume is outside the domain of most laws
    at(bisect(0.0, 2.0, 60, |side| at(side).1[(1, 1)].partial_cmp(&0.0) != Some(Ordering::Greater))[1])
}

/// Energy density W, J/m³, of the uniform state of uniaxial tension in which the stress first reaches
/// `strength`, Pa: force over the undeformed section (first Piola–Kirchhoff), as tensile tests of rubber
/// report it (ISO 37). In plane strain the thickness is held. `None` if the law does not reach it.
pub fn energy_at_strength<const D: usize>(law: &(impl PointLaw<D> + ?Sized), strength: f64) -> Option<f64> {
    let beyond = |strain: f64| {
        let stress = pulled(law, 1.0 + strain).1[(0, 0)];
        // beyond the domain of a law that locks
        stress.is_nan() || stress >= strength
    };
    let (mut low, mut high) = (0.0, (0.01 * strength / law.shear_modulus()).min(1e-3));
    while !beyond(high) {
        (low, high) = (high, 1.1 * high);
        if high > GREATEST {
            return None;
        }
    }
    let [low, _] = bisect(low, high, 100, |strain| !beyond(strain));
    let (deformation, stress) = pulled(law, 1.0 + low);
    let reached = (stress[(0, 0)] / strength - 1.0).abs() < 1e-6;
    reached.then(|| law.energy(&deformation)).filter(|energy| *energy > 0.0)
}
