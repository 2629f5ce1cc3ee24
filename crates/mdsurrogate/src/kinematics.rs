//! Conversion of measurements in molecular dynamics, box and virial stress, to (C, S) and back.
//!
//! Voigt order (3.2)–(3.3): [11, 22, 33, 12, 13, 23], as in the pressure vector of LAMMPS (xx, yy, zz, xy,
//! xz, yz). Stress is positive in tension: σ = −P.

use crate::Error;
use polycore::tensor::{DeformationGradient, StressMeasure, Tensor, Voigt, voigt};

pub use polycore::tensor::voigt::{NAMES, cauchy_from_material, jaumann_tangent};

/// Standard atmosphere, Pa (exact; the pressure unit of LAMMPS' `units real`).
pub const ATMOSPHERE: f64 = 101_325.0;

/// Ångström, m.
pub const ANGSTROM: f64 = 1e-10;

/// Edges and tilts of a periodic box as in LAMMPS, in one common unit.
///
/// The edge vectors are the columns of [[lx, xy, xz], [0, ly, yz], [0, 0, lz]].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeriodicBox {
    /// Lengths lx, ly, lz.
    pub lengths: [f64; 3],
    /// Tilts xy, xz, yz; zero for an orthogonal box.
    pub tilts: [f64; 3],
}

impl PeriodicBox {
    /// Creates a box without tilts.
    pub fn orthogonal(lengths: [f64; 3]) -> Self {
        Self { lengths, tilts: [0.0; 3] }
    }

    /// Returns the edge vectors as columns.
    pub fn edges(&self) -> Tensor {
        let ([x, y, z], [xy, xz, yz]) = (self.lengths, self.tilts);
        Tensor::new(x, xy, xz, 0.0, y, yz, 0.0, 0.0, z)
    }

    /// Computes F = H H₀⁻¹, which maps the edges of `reference` to those of this box (for orthogonal boxes
    /// F_ii = l_i/L_i).
    ///
    /// # Errors
    /// Returns an error for lengths that are not positive and finite, and for non-finite tilts.
    pub fn deformation_from(&self, reference: &Self) -> Result<DeformationGradient, Error> {
        for lengths in [self.lengths, reference.lengths] {
            if let Some(index) = lengths.iter().position(|l| !(l.is_finite() && *l > 0.0)) {
                let value = lengths[index];
                return Err(polycore::tensor::Error::Stretch { index: index + 1, value }.into());
            }
        }
        let ([x, y, z], [xy, xz, yz]) = (reference.lengths, reference.tilts);
        // explicit inverse of an upper triangle, so that F of orthogonal boxes is exactly l/L
        let inverse = Tensor::new(
            1.0 / x,
            -xy / (x * y),
            (xy * yz - xz * y) / (x * y * z),
            0.0,
            1.0 / y,
            -yz / (y * z),
            0.0,
            0.0,
            1.0 / z,
        );
        let mut matrix = self.edges() * inverse;
        for i in 0..3 {
            matrix[(i, i)] = self.lengths[i] / reference.lengths[i];
        }
        Ok(DeformationGradient::new(matrix)?)
    }
}

/// Computes σ = −P, Pa, from the pressure vector of LAMMPS [xx, yy, zz, xy, xz, yz] in atm.
pub fn cauchy_from_pressure(atmospheres: &Voigt) -> Voigt {
    -ATMOSPHERE * atmospheres
}

/// Computes C = FᵀF (3.5) and S = J F⁻¹ σ F⁻ᵀ (3.6), in the unit of σ.
pub fn material_pair(deformation: &DeformationGradient, cauchy: &Voigt) -> (Voigt, Voigt) {
    use StressMeasure::{Cauchy, SecondPiolaKirchhoff};
    let s = deformation.convert_stress(&voigt::to_stress(cauchy), Cauchy, SecondPiolaKirchhoff);
    (voigt::from_stress(&deformation.right_cauchy_green()), voigt::from_stress(&s))
}

/// Computes F = U = √C without rotation from C in Voigt order (3.2).
///
/// # Errors
/// Returns an error for non-finite components, and for a C that is not positive definite.
pub fn stretch_from_c(c: &Voigt) -> Result<DeformationGradient, Error> {
    let bad = |found: String| Error::parameter("C", found, "a positive definite tensor of finite components");
    if let Some(index) = c.iter().position(|value| !value.is_finite()) {
        return Err(bad(format!("component {} = {}", NAMES[index], c[index])));
    }
    let eigen = voigt::to_stress(c).symmetric_eigen();
    let least = eigen.eigenvalues.min();
    // a singular C stays singular with rounding
    if least <= 1e-14 * eigen.eigenvalues.max() {
        return Err(bad(format!("the eigenvalue {least:e}")));
    }
    let roots = Tensor::from_diagonal(&eigen.eigenvalues.map(f64::sqrt));
    Ok(DeformationGradient::new(eigen.eigenvectors * roots * eigen.eigenvectors.transpose())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// First averaged row of run uz_4 of the shipped data, by hand: F₃₃ = 33.128024/33.1027, J = F₁₁F₂₂F₃₃,
    /// S₃₃ = Jσ₃₃/F₃₃² (diagonal F).
    #[test]
    fn a_row_by_hand() {
        let reference = PeriodicBox::orthogonal([9.2081, 16.6364, 33.1027]);
        let current = PeriodicBox::orthogonal([9.206562, 16.635653, 33.128024]);
        let f = current.deformation_from(&reference).unwrap();
        let stretch: Vec<f64> = (0..3).map(|i| current.lengths[i] / reference.lengths[i]).collect();
        let cauchy = Voigt::new(197.553, 97.798, -32.859, -47.072, 129.563, 35.571);
        let (c, s) = material_pair(&f, &cauchy);
        let j: f64 = stretch.iter().product();
        for i in 0..3 {
            assert!((c[i] - stretch[i] * stretch[i]).abs() < 1e-15);
            // a handful of roundings
            assert!((s[i] / (j * cauchy[i] / stretch[i].powi(2)) - 1.0).abs() < 4e-15);
        }
        assert_eq!([c[3], c[4], c[5]], [0.0; 3]);
        assert!((s[4] / (j * cauchy[4] / (stretch[0] * stretch[2])) - 1.0).abs() < 4e-15);
    }

    /// PROVENANCE.md of the data: σ = −P[atm] × 0.101325 MPa, positive in tension.
    #[test]
    fn pressure_in_atmospheres_becomes_tension_in_pascal() {
        let stress = cauchy_from_pressure(&Voigt::new(-1000.0, 0.0, 0.0, 0.0, 0.0, 10.0));
        assert_eq!(stress[0], 101.325e6);
        assert_eq!(stress[5], -1.01325e6);
    }

    /// A sheared box: the tilt xy over ly is the simple shear γ, C₁₂ = γ and C₂₂ = 1 + γ².
    #[test]
    fn tilt_is_simple_shear() {
        let reference = PeriodicBox::orthogonal([2.0, 4.0, 5.0]);
        let sheared = PeriodicBox { lengths: [2.0, 4.0, 5.0], tilts: [0.4, 0.0, 0.0] };
        let f = sheared.deformation_from(&reference).unwrap();
        let (c, _) = material_pair(&f, &Voigt::zeros());
        assert!((c - Voigt::new(1.0, 1.01, 1.0, 0.1, 0.0, 0.0)).amax() < 1e-15);
        // with a tilted reference, the deformation back is the inverse
        let back = reference.deformation_from(&sheared).unwrap();
        assert!((back.matrix() * f.matrix() - Tensor::identity()).amax() < 1e-15);
    }

    #[test]
    fn there_and_back() {
        let f = DeformationGradient::new(Tensor::new(1.3, 0.4, -0.2, 0.1, 0.8, 0.3, -0.3, 0.2, 1.7)).unwrap();
        let cauchy = Voigt::new(3.0, 2.0, -4.0, -1.0, 0.5, 0.7);
        let (c, s) = material_pair(&f, &cauchy);
        // three products with a matrix of condition 3
        assert!((cauchy_from_material(&f, &s) - cauchy).amax() < 2e-14);
        let u = stretch_from_c(&c).unwrap();
        assert!((voigt::from_stress(&u.right_cauchy_green()) - c).amax() < 1e-14);
        assert!((u.matrix() - u.matrix().transpose()).amax() < 1e-15);
    }

    #[test]
    fn invalid_deformations_are_refused() {
        let reference = PeriodicBox::orthogonal([1.0; 3]);
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = PeriodicBox::orthogonal([1.0, bad, 1.0]).deformation_from(&reference).unwrap_err();
            assert!(error.to_string().contains("stretch 2"), "{error}");
        }
        for (c, part) in [
            (Voigt::new(1.0, 1.0, 1.0, 1.0, 0.0, 0.0), "eigenvalue"),
            (Voigt::new(1.0, 1.0, f64::NAN, 0.0, 0.0, 0.0), "33"),
        ] {
            assert!(stretch_from_c(&c).unwrap_err().to_string().contains(part));
        }
    }
}
