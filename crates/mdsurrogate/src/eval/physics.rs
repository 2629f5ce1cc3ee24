//! Properties of elastic solids, measured on a law.

use crate::Error;
use crate::dataset::DataRow;
use crate::surrogate::{Surrogate, Workspace};
use polycore::constitutive::Law;
use polycore::tensor::{DeformationGradient, Tensor, Voigt, voigt};

/// Amount of simple shear at which the shear stress is evaluated.
pub const SHEAR: f64 = 0.05;
/// Number of pieces of each side of the closed cycle.
const PIECES: usize = 64;
/// Points and weights of the four-point Gauss rule on [0, 1].
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// Deviations of a law from an elastic solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhysicsChecks {
    /// ‖S(I)‖, Pa, the stress of the undeformed state: 0 for a solid at rest.
    pub rest: f64,
    /// Mean of ‖ℂ − ℂᵀ‖/‖ℂ‖ over the rows: 0 for the tangent of a potential.
    pub asymmetry: f64,
    /// Largest ‖ℂ − ℂᵀ‖/‖ℂ‖.
    pub largest_asymmetry: f64,
    /// |∮ S:dC/2| / ∮ |S:dC/2| around a rectangle from I to half of the training box in C₁₁ and C₃₃: 0 for an
    /// elastic solid.
    pub cycle: f64,
    /// Largest ‖σ(RF) − R σ(F) Rᵀ‖/‖σ(F)‖ for the rows and some rotations R.
    pub objectivity: f64,
    /// Fraction of states with simple shear in one of three planes that are flagged as never varied; `None`
    /// if the training data contain shear.
    pub shear_flagged: Option<f64>,
    /// Mean norm of the predicted shear stresses in these states, Pa.
    pub shear_stress: f64,
}

impl PhysicsChecks {
    /// Measures a law at the deformations of some rows.
    ///
    /// # Errors
    /// Returns the errors of [`Surrogate::tangent`].
    pub fn measure(law: &Surrogate, rows: &[&DataRow]) -> Result<Self, Error> {
        let mut memory = Workspace::default();
        let rest = law.stress(&Voigt::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0), &mut memory)?.stress.norm();
        let (mut asymmetry, mut largest, mut objectivity) = (0.0, 0.0f64, 0.0f64);
        let (mut flagged, mut shear, mut sheared) = (0, 0.0, 0);
        for (index, row) in rows.iter().enumerate() {
            let tangent = law.tangent(&row.c, &mut memory)?.tangent.unwrap_or_default();
            let norm = tangent.norm();
            let own = if norm > 0.0 { (tangent - tangent.transpose()).norm() / norm } else { 0.0 };
            asymmetry += own / rows.len() as f64;
            largest = largest.max(own);
            objectivity = objectivity.max(objectivity_error(law, row, index, &mut memory)?);
            for [i, j] in [[0, 1], [0, 2], [1, 2]] {
                let mut matrix = Tensor::identity();
                matrix[(i, j)] = SHEAR;
                let f = DeformationGradient::new(row.deformation.matrix() * matrix)?;
                let answer = law.stress(&voigt::from_stress(&f.right_cauchy_green()), &mut memory)?;
                flagged += usize::from(answer.flags.unseen.contains(&true));
                shear += answer.stress.fixed_rows::<3>(3).norm();
                sheared += 1;
            }
        }
        let unseen = law.header().training_box[3..].iter().all(|[low, high]| low == high);
        let sheared = f64::from(sheared.max(1));
        Ok(Self {
            rest,
            asymmetry,
            largest_asymmetry: largest,
            cycle: cycle_error(law, &mut memory)?,
            objectivity,
            shear_flagged: unseen.then(|| f64::from(flagged as u32) / sheared),
            shear_stress: shear / sheared,
        })
    }
}

/// Computes ‖σ(RF) − R σ(F) Rᵀ‖/‖σ(F)‖ for a rotation that depends on the row number.
fn objectivity_error(
    law: &Surrogate,
    row: &DataRow,
    index: usize,
    memory: &mut Workspace,
) -> Result<f64, Error> {
    let angle = 0.1 + index as f64;
    let axis = nalgebra::Unit::new_normalize(nalgebra::Vector3::new(angle.sin(), angle.cos(), 0.4));
    let rotation = nalgebra::Rotation3::from_axis_angle(&axis, angle).into_inner();
    let turned = DeformationGradient::new(rotation * row.deformation.matrix())?;
    let (own, _) = law.cauchy_stress(&row.deformation, memory)?;
    let (other, _) = law.cauchy_stress(&turned, memory)?;
    let expected = rotation * voigt::to_stress(&own) * rotation.transpose();
    let norm = own.norm();
    Ok(if norm > 0.0 { (voigt::to_stress(&other) - expected).norm() / norm } else { 0.0 })
}

/// Computes the work of a closed cycle over the sum of the absolute work of its pieces.
fn cycle_error(law: &Surrogate, memory: &mut Workspace) -> Result<f64, Error> {
    let half = |a: usize| {
        let [low, high] = law.header().training_box[a];
        // the side of the box that is farther from the undeformed state
        let far = if high - 1.0 >= 1.0 - low { high } else { low };
        1.0 + 0.5 * (far - 1.0)
    };
    let (x, z) = (half(0), half(2));
    let corners = [[1.0, 1.0], [x, 1.0], [x, z], [1.0, z], [1.0, 1.0]];
    let (mut work, mut parts) = (0.0, 0.0);
    for side in corners.windows(2) {
        let change = [side[1][0] - side[0][0], side[1][1] - side[0][1]];
        for piece in 0..PIECES {
            for (place, weight) in GAUSS {
                let s = (piece as f64 + place) / PIECES as f64;
                let c =
                    Voigt::new(side[0][0] + s * change[0], 1.0, side[0][1] + s * change[1], 0.0, 0.0, 0.0);
                let stress = law.stress(&c, memory)?.stress;
                let part = 0.5 * weight / PIECES as f64 * (stress[0] * change[0] + stress[2] * change[1]);
                work += part;
                parts += part.abs();
            }
        }
    }
    Ok(if parts > 0.0 { work.abs() / parts } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::tests::rows_of_a_law;
    use crate::network::{Activation::Softplus, Architecture};
    use crate::surrogate::{Kind, Symmetry};

    fn law(kind: Kind) -> Surrogate {
        let rows = rows_of_a_law();
        let rows: Vec<&DataRow> = rows.iter().collect();
        let architecture =
            Architecture::new(kind.inputs(), &[(16, Softplus), (16, Softplus)], kind.outputs());
        Surrogate::random(crate::fitted::header(kind, architecture, 2, &rows, true).unwrap(), 3).unwrap()
    }

    #[test]
    fn an_energy_is_elastic_and_a_map_of_stress_is_not() {
        let rows = rows_of_a_law();
        let rows: Vec<&DataRow> = rows.iter().step_by(20).collect();
        let energy = PhysicsChecks::measure(&law(Kind::energy(Symmetry::Orthotropic)), &rows).unwrap();
        assert_eq!(energy.rest, 0.0);
        // rounding; the cycle also has the error of the Gauss rule on 64 pieces
        assert!(
            energy.largest_asymmetry < 1e-13 && energy.cycle < 1e-12 && energy.objectivity < 1e-12,
            "{energy:?}"
        );
        let ann = PhysicsChecks::measure(&law(Kind::Ann), &rows).unwrap();
        assert!(ann.rest > 1e6 && ann.asymmetry > 0.01 && ann.cycle > 1e-3, "{ann:?}");
        assert!(ann.objectivity < 1e-12);
        for physics in [ann, energy] {
            assert_eq!(physics.shear_flagged, Some(1.0));
            assert!(physics.asymmetry <= physics.largest_asymmetry);
        }
        // the rows contain no shear stress
        assert_eq!([ann.shear_stress, energy.shear_stress], [0.0; 2]);
    }
}
