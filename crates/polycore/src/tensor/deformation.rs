//! The deformation gradient and quantities derived from it.

use super::decomposition::{adjugate, determinant, principal_frame};
use super::{Error, PrincipalFrame, Tensor, Tensor2, Voigt};

/// F = ∂x/∂X (1.3), finite and with det F > 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeformationGradient {
    matrix: Tensor,
    jacobian: f64,
}

/// Principal invariants of C (1.7)–(1.9), and of B.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Invariants {
    /// I₁ = tr C = ‖F‖².
    pub first: f64,
    /// I₂ = ½(I₁² − tr C²) = ‖cof F‖², summed in the second form, which does not cancel.
    pub second: f64,
    /// I₃ = det C = J².
    pub third: f64,
}

impl DeformationGradient {
    /// Checks F: every component finite, det F > 0.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::Inverted`], or [`Error::OutOfRange`] with the offending value.
    pub fn new(matrix: Tensor) -> Result<Self, Error> {
        for row in 0..3 {
            for column in 0..3 {
                let value = matrix[(row, column)];
                if !value.is_finite() {
                    return Err(Error::NotFinite { row: row + 1, column: column + 1, value });
                }
            }
        }
        let jacobian = determinant(&matrix);
        if !jacobian.is_finite() {
            return Err(Error::OutOfRange { determinant: jacobian });
        }
        if jacobian <= 0.0 {
            return Err(Error::Inverted { determinant: jacobian });
        }
        Ok(Self { matrix, jacobian })
    }

    /// F = 1.
    pub fn identity() -> Self {
        Self { matrix: Tensor::identity(), jacobian: 1.0 }
    }

    /// F = diag(λ₁, λ₂, λ₃), in the order given.
    ///
    /// # Errors
    /// [`Error::Stretch`] if one is not positive and finite.
    pub fn from_stretches(stretches: [f64; 3]) -> Result<Self, Error> {
        check_stretches(&stretches)?;
        Self::new(Tensor::from_diagonal(&stretches.into()))
    }

    /// Upper triangular F with FᵀF = C (3.2), by Cholesky: one of the F of this C, which differ by a
    /// rotation.
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`].
    pub fn from_right_cauchy_green(c: &Voigt) -> Result<Self, Error> {
        let first = c[0].sqrt();
        let (f12, f13) = (c[3] / first, c[4] / first);
        let second = (c[1] - f12 * f12).sqrt();
        let f23 = (c[5] - f12 * f13) / second;
        let third = (c[2] - f13 * f13 - f23 * f23).sqrt();
        // roots of negative numbers are NaN
        if [first, second, third, f12, f13, f23].iter().all(|x| x.is_finite()) && third > 0.0 {
            Self::new(Tensor::new(first, f12, f13, 0.0, second, f23, 0.0, 0.0, third))
        } else {
            Err(Error::NotPositiveDefinite { c: (*c).into() })
        }
    }

    /// Plane strain: F₃₃ = 1, no shear out of the plane.
    ///
    /// # Errors
    /// As [`DeformationGradient::new`].
    pub fn plane_strain(in_plane: &Tensor2) -> Result<Self, Error> {
        Self::new(embed(in_plane, 1.0))
    }

    /// Plane stress with a known thickness stretch λ₃; [`crate::constitutive::hyperelastic::plane_stress`]
    /// finds the one that makes S₃₃ vanish.
    ///
    /// # Errors
    /// As [`DeformationGradient::new`]; [`Error::Stretch`] for λ₃.
    pub fn plane_stress(in_plane: &Tensor2, thickness_stretch: f64) -> Result<Self, Error> {
        if !(thickness_stretch.is_finite() && thickness_stretch > 0.0) {
            return Err(Error::Stretch { index: 3, value: thickness_stretch });
        }
        Self::new(embed(in_plane, thickness_stretch))
    }

    /// Plane stress of an incompressible sheet: λ₃ = 1/det F₂, hence J = 1.
    ///
    /// # Errors
    /// As [`DeformationGradient::new`].
    pub fn plane_stress_incompressible(in_plane: &Tensor2) -> Result<Self, Error> {
        let area = Self::plane_strain(in_plane)?.jacobian;
        Self::plane_stress(in_plane, 1.0 / area)
    }

    /// The 3×3 matrix.
    pub fn matrix(&self) -> &Tensor {
        &self.matrix
    }

    /// J = det F (1.4), (3.4).
    pub fn jacobian(&self) -> f64 {
        self.jacobian
    }

    /// F⁻¹ = adj F / J, accurate component by component.
    pub fn inverse(&self) -> Tensor {
        adjugate(&self.matrix) / self.jacobian
    }

    /// cof F = J F⁻ᵀ: maps reference to current area vectors (Nanson).
    pub fn cofactor(&self) -> Tensor {
        adjugate(&self.matrix).transpose()
    }

    /// C = FᵀF (1.5), (3.5), symmetric to the last bit.
    pub fn right_cauchy_green(&self) -> Tensor {
        gram(|i, k| self.matrix[(k, i)])
    }

    /// B = FFᵀ, symmetric to the last bit.
    pub fn left_cauchy_green(&self) -> Tensor {
        gram(|i, k| self.matrix[(i, k)])
    }

    /// E = ½(C − 1), formed from H = F − 1 as ½(H + Hᵀ + HᵀH) so that small strains keep their digits.
    pub fn green_lagrange(&self) -> Tensor {
        let h = self.matrix - Tensor::identity();
        gram(|i, k| h[(k, i)]) * 0.5 + (h + h.transpose()) * 0.5
    }

    /// I₁, I₂, I₃ of C.
    pub fn invariants(&self) -> Invariants {
        Invariants {
            first: self.matrix.norm_squared(),
            second: adjugate(&self.matrix).norm_squared(),
            third: self.jacobian * self.jacobian,
        }
    }

    /// λ₁ ≥ λ₂ ≥ λ₃ with both sets of principal directions.
    pub fn principal_frame(&self) -> PrincipalFrame {
        principal_frame(&self.matrix)
    }

    /// λ₁ ≥ λ₂ ≥ λ₃.
    pub fn principal_stretches(&self) -> [f64; 3] {
        self.principal_frame().stretches
    }

    /// F̄ = J^{−1/3} F, the factor of F = J^{1/3} F̄ with det F̄ = 1.
    pub fn isochoric(&self) -> Self {
        Self { matrix: self.matrix / self.jacobian.cbrt(), jacobian: 1.0 }
    }
}

impl Invariants {
    /// (1.10)–(1.12): I₁ = Σλᵢ², I₂ = Σλᵢ²λⱼ² (i < j), I₃ = Πλᵢ².
    pub fn from_stretches(stretches: [f64; 3]) -> Self {
        let [a, b, c] = stretches.map(|l| l * l);
        Self { first: a + b + c, second: a * b + b * c + c * a, third: a * b * c }
    }

    /// Ī₁ = J^{−2/3} I₁, Ī₂ = J^{−4/3} I₂ and 1: the invariants of the isochoric part.
    pub fn isochoric(&self) -> Self {
        let root = self.third.cbrt();
        Self { first: self.first / root, second: self.second / (root * root), third: 1.0 }
    }
}

pub(crate) fn check_stretches(stretches: &[f64; 3]) -> Result<(), Error> {
    match stretches.iter().position(|l| !(l.is_finite() && *l > 0.0)) {
        Some(i) => Err(Error::Stretch { index: i + 1, value: stretches[i] }),
        None => Ok(()),
    }
}

fn embed(in_plane: &Tensor2, thickness_stretch: f64) -> Tensor {
    let mut matrix = Tensor::zeros();
    matrix.fixed_view_mut::<2, 2>(0, 0).copy_from(in_plane);
    matrix[(2, 2)] = thickness_stretch;
    matrix
}

fn gram(component: impl Fn(usize, usize) -> f64) -> Tensor {
    Tensor::from_fn(|i, j| (0..3).map(|k| component(i, k) * component(j, k)).sum())
}

#[cfg(test)]
mod tests {
    use super::super::voigt;
    use super::*;

    fn relative(a: f64, b: f64) -> f64 {
        ((a - b) / b).abs()
    }

    /// A rotation about no special axis.
    fn rotation() -> Tensor {
        *nalgebra::Rotation3::from_euler_angles(0.3, -1.1, 2.0).matrix()
    }

    fn assert_decomposes(f: &DeformationGradient, tolerance: f64) {
        let frame = f.principal_frame();
        let rebuilt =
            frame.spatial * Tensor::from_diagonal(&frame.stretches.into()) * frame.referential.transpose();
        assert!((rebuilt - f.matrix()).amax() <= tolerance * f.matrix().amax(), "{rebuilt} {}", f.matrix());
        for q in [frame.spatial, frame.referential] {
            assert!((q.transpose() * q - Tensor::identity()).amax() < 1e-14, "{q}");
        }
    }

    /// Simple shear γ: λ = √(1 + γ²/4) ± γ/2 and 1, J = 1, I₁ = I₂ = 3 + γ². At γ = 1e8 the stretches are
    /// 1e±8.
    #[test]
    fn simple_shear_in_closed_form() {
        for gamma in [0.0, 1e-9, 1e-3, 0.5, 3.0, 1e4, 1e8] {
            let mut matrix = Tensor::identity();
            matrix[(0, 1)] = gamma;
            let f = DeformationGradient::new(matrix).unwrap();
            let long = (0.5 * gamma).hypot(1.0) + 0.5 * gamma;
            let [a, b, c] = f.principal_stretches();
            // backward-stable decomposition of a matrix that is well conditioned after scaling: a few ulp
            assert!(relative(a, long) < 2e-15, "{gamma} {a}");
            assert!(relative(b, 1.0) < 2e-15, "{gamma} {b}");
            assert!(relative(c, 1.0 / long) < 2e-15, "{gamma} {c} {}", 1.0 / long);
            assert_eq!(f.jacobian(), 1.0);
            let invariants = f.invariants();
            assert!(relative(invariants.first, 3.0 + gamma * gamma) < 4e-16);
            assert!(relative(invariants.second, 3.0 + gamma * gamma) < 4e-16);
            assert_eq!(f.inverse()[(0, 1)], -gamma);
            assert_decomposes(&f, 1e-15);
        }
    }

    #[test]
    fn graded_stretches_keep_their_digits_in_any_order() {
        for stretches in [[1e8, 1.0, 1e-8], [1e-8, 1e8, 1.0], [1e-8, 1e-8, 1e8], [1e8, 1e8, 1e8], [1e-8; 3]] {
            let f = DeformationGradient::from_stretches(stretches).unwrap();
            let mut sorted = stretches;
            sorted.sort_by(|x, y| y.total_cmp(x));
            for (found, exact) in f.principal_stretches().into_iter().zip(sorted) {
                assert!(relative(found, exact) < 4e-16, "{found} {exact}");
            }
            assert!(relative(f.jacobian(), stretches.iter().product()) < 4e-16);
            assert_decomposes(&f, 1e-15);
        }
    }

    /// Rounding the entries of QΛRᵀ moves every stretch by up to ε·λ₁ (Weyl), and no method can do better.
    #[test]
    fn rotated_extreme_stretches_are_good_to_rounding_of_the_input() {
        let (q, r) = (rotation(), rotation().transpose() * rotation().transpose());
        for stretches in
            [[1e8, 1.0, 1e-7], [1e4, 1e-4, 1e-4], [3.0, 3.0, 3.0], [2.0, 2.0, 0.25], [1e8, 1e8, 1e8]]
        {
            let matrix = q * Tensor::from_diagonal(&stretches.into()) * r.transpose();
            let f = DeformationGradient::new(matrix).unwrap();
            for (found, exact) in f.principal_stretches().into_iter().zip(stretches) {
                assert!((found - exact).abs() <= 4.0 * f64::EPSILON * stretches[0], "{found} {exact}");
            }
            let product: f64 = f.principal_stretches().iter().product();
            assert!(relative(product, f.jacobian()) < 8.0 * f64::EPSILON * stretches[0] / stretches[2]);
            assert_decomposes(&f, 16.0 * f64::EPSILON);
        }
    }

    #[test]
    fn repeated_stretches_have_an_orthonormal_frame() {
        for matrix in [Tensor::identity(), rotation(), rotation() * 1e-8] {
            let f = DeformationGradient::new(matrix).unwrap();
            let [a, _, c] = f.principal_stretches();
            assert!(relative(a, c) < 1e-15);
            assert_decomposes(&f, 1e-15);
        }
    }

    /// Subtracting the first row leaves diag(ε, ε): det = ε² exactly, of which the plain expansion keeps
    /// nothing.
    #[test]
    fn near_singular_determinants_have_the_right_sign() {
        let tiny = f64::EPSILON;
        let matrix = Tensor::new(1.0, 1.0, 1.0, 1.0, 1.0 + tiny, 1.0, 1.0, 1.0, 1.0 + tiny);
        assert_eq!(DeformationGradient::new(matrix).unwrap().jacobian(), tiny * tiny);
        let mut inverted = matrix;
        inverted.swap_rows(0, 1);
        assert_eq!(DeformationGradient::new(inverted), Err(Error::Inverted { determinant: -tiny * tiny }));
    }

    #[test]
    fn bad_matrices_are_refused_with_the_value() {
        let mirror = Tensor::from_diagonal(&[1.0, 1.0, -2.0].into());
        assert_eq!(DeformationGradient::new(mirror), Err(Error::Inverted { determinant: -2.0 }));
        assert_eq!(DeformationGradient::new(Tensor::zeros()), Err(Error::Inverted { determinant: 0.0 }));
        let mut broken = Tensor::identity();
        broken[(1, 2)] = f64::INFINITY;
        let error = DeformationGradient::new(broken).unwrap_err();
        assert_eq!(error, Error::NotFinite { row: 2, column: 3, value: f64::INFINITY });
        assert_eq!(error.to_string(), "component 23 of the deformation gradient is inf");
        assert!(matches!(
            DeformationGradient::new(Tensor::identity() * 1e200),
            Err(Error::OutOfRange { .. })
        ));
        let stretch = DeformationGradient::from_stretches([1.0, -0.5, 1.0]);
        assert_eq!(stretch, Err(Error::Stretch { index: 2, value: -0.5 }));
    }

    #[test]
    fn a_deformation_of_its_right_cauchy_green_tensor() {
        let matrix = Tensor::new(1.3, 0.4, -0.2, 0.1, 0.8, 0.3, -0.3, 0.2, 1.7);
        let c = DeformationGradient::new(matrix).unwrap().right_cauchy_green();
        let f = DeformationGradient::from_right_cauchy_green(&voigt::from_stress(&c)).unwrap();
        assert!((f.right_cauchy_green() - c).amax() < 1e-15 * 4.0, "some roundings of numbers up to 3");
        for bad in [
            Voigt::new(1.0, 1.0, 1.0, 1.0, 0.0, 0.0),
            Voigt::new(-1.0, -1.0, 1.0, 0.0, 0.0, 0.0),
            Voigt::new(1.0, 1.0, 1.0, 0.0, f64::NAN, 0.0),
            Voigt::new(0.0, 1.0, 1.0, 0.0, 0.0, 0.0),
            Voigt::new(1.0, f64::INFINITY, 1.0, 0.0, 0.0, 0.0),
        ] {
            let refused = DeformationGradient::from_right_cauchy_green(&bad);
            assert!(matches!(refused, Err(Error::NotPositiveDefinite { .. })), "{bad}");
        }
    }

    #[test]
    fn small_strain_keeps_its_digits() {
        let mut matrix = Tensor::identity();
        matrix[(0, 1)] = 1e-12;
        let strain = DeformationGradient::new(matrix).unwrap().green_lagrange();
        assert_eq!(strain[(0, 1)], 5e-13);
        assert_eq!(strain[(1, 1)], 5e-25);
    }

    #[test]
    fn plane_embeddings() {
        let in_plane = Tensor2::new(2.0, 0.5, 0.25, 1.5);
        let strain = DeformationGradient::plane_strain(&in_plane).unwrap();
        assert_eq!(strain.jacobian(), 2.875);
        assert_eq!(strain.right_cauchy_green()[(2, 2)], 1.0);
        let stress = DeformationGradient::plane_stress_incompressible(&in_plane).unwrap();
        assert!((stress.jacobian() - 1.0).abs() < 4e-16);
        assert!(matches!(
            DeformationGradient::plane_stress(&in_plane, 0.0),
            Err(Error::Stretch { index: 3, value: 0.0 })
        ));
        assert!(DeformationGradient::plane_strain(&-Tensor2::new(0.0, 1.0, 1.0, 0.0)).is_err());
    }

    #[test]
    fn tensors_agree_with_their_definitions() {
        let matrix = Tensor::new(1.3, 0.4, -0.2, 0.1, 0.8, 0.3, -0.3, 0.2, 1.7);
        let f = DeformationGradient::new(matrix).unwrap();
        let c = f.right_cauchy_green();
        assert!((c - matrix.transpose() * matrix).amax() < 1e-15);
        assert_eq!(c, c.transpose());
        assert!((f.inverse() * matrix - Tensor::identity()).amax() < 1e-15);
        let invariants = f.invariants();
        assert!(relative(invariants.first, c.trace()) < 1e-15);
        assert!(relative(invariants.second, 0.5 * (c.trace().powi(2) - (c * c).trace())) < 1e-14);
        assert!(relative(invariants.third, c.determinant()) < 1e-14);
        let from_stretches = Invariants::from_stretches(f.principal_stretches());
        assert!(relative(from_stretches.second, invariants.second) < 1e-14);
        let isochoric = f.isochoric();
        assert!((determinant(isochoric.matrix()) - 1.0).abs() < 1e-15);
        assert!(relative(invariants.isochoric().first, isochoric.invariants().first) < 1e-15);
        // eigenvalues of C belong to the referential frame
        let frame = f.principal_frame();
        let squares = frame.stretches.map(|l| l * l);
        assert!((frame.referential_tensor(squares) - c).amax() < 1e-14);
        assert!((frame.spatial_tensor(squares) - f.left_cauchy_green()).amax() < 1e-14);
    }
}
