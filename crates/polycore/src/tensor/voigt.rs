//! Voigt vectors and 6×6 tangents, in the thesis' order (3.2)–(3.3): **[11, 22, 33, 12, 13, 23]**.
//!
//! The factor-2 rules:
//! - **stress** has no factor: [S₁₁, S₂₂, S₃₃, S₁₂, S₁₃, S₂₃];
//! - **strain** doubles its shear: [E₁₁, E₂₂, E₃₃, 2E₁₂, 2E₁₃, 2E₂₃], so that stress · strain = S : E;
//! - **C** has no factor: [C₁₁, C₂₂, C₃₃, C₁₂, C₁₃, C₂₃] (3.2). For an energy written as a function of these
//!   six numbers, with C₁₂ counted once, S₁₁ = 2 ∂W/∂C₁₁ but S₁₂ = ∂W/∂C₁₂ ([`stress_from_energy_gradient`]);
//! - a **tangent** D has the components ℂ_ijkl without factor, ℂ = 2 ∂S/∂C = ∂S/∂E, and dS = D · dE in the
//!   vectors above. Hence ∂S/∂C₁₁ = ½ D column 1, but ∂S/∂C₁₂ = D column 4.

use super::{DeformationGradient, StressMeasure, Tensor};
use nalgebra::{Matrix6, SMatrix, Vector6};

/// Six components in the order [11, 22, 33, 12, 13, 23].
pub type Voigt = Vector6<f64>;
/// A fourth-order tensor with both minor symmetries, in the same order.
pub type Voigt6x6 = Matrix6<f64>;

/// Row and column, from 0, of each Voigt component.
pub const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
/// Names of the components.
pub const NAMES: [&str; 6] = ["11", "22", "33", "12", "13", "23"];

/// [S₁₁, S₂₂, S₃₃, S₁₂, S₁₃, S₂₃] of a symmetric tensor (its upper triangle is read). Also for C of (3.2).
pub fn from_stress(stress: &Tensor) -> Voigt {
    Voigt::from_fn(|a, _| stress[PAIRS[a]])
}

/// The symmetric tensor of a stress vector. Also for C of (3.2).
pub fn to_stress(stress: &Voigt) -> Tensor {
    Tensor::from_fn(|i, j| stress[index(i, j)])
}

/// [E₁₁, E₂₂, E₃₃, 2E₁₂, 2E₁₃, 2E₂₃] of a symmetric tensor (its upper triangle is read).
pub fn from_strain(strain: &Tensor) -> Voigt {
    Voigt::from_fn(|a, _| strain[PAIRS[a]] * if a < 3 { 1.0 } else { 2.0 })
}

/// The symmetric tensor of a strain vector: its shear is halved.
pub fn to_strain(strain: &Voigt) -> Tensor {
    Tensor::from_fn(|i, j| strain[index(i, j)] * if i == j { 1.0 } else { 0.5 })
}

/// E = ½(C − 1) as a strain vector from C as in (3.2): [(C₁₁ − 1)/2, …, C₁₂, C₁₃, C₂₃].
pub fn strain_from_right_cauchy_green(c: &Voigt) -> Voigt {
    Voigt::from_fn(|a, _| if a < 3 { 0.5 * (c[a] - 1.0) } else { c[a] })
}

/// S from ∂W/∂C for W(C₁₁, C₂₂, C₃₃, C₁₂, C₁₃, C₂₃): S_ii = 2 ∂W/∂C_ii, S_12 = ∂W/∂C_12.
pub fn stress_from_energy_gradient(gradient: &Voigt) -> Voigt {
    Voigt::from_fn(|a, _| gradient[a] * if a < 3 { 2.0 } else { 1.0 })
}

/// D = 2 ∂S/∂C from the 6×6 matrix of ∂S_a/∂C_b (C_12 not doubled): columns 1–3 are doubled.
pub fn tangent_from_stress_gradient(gradient: &Voigt6x6) -> Voigt6x6 {
    Voigt6x6::from_fn(|a, b| gradient[(a, b)] * if b < 3 { 2.0 } else { 1.0 })
}

/// The component ℂ_ijkl (indices from 0) of a tangent.
pub fn component(tangent: &Voigt6x6, i: usize, j: usize, k: usize, l: usize) -> f64 {
    tangent[(index(i, j), index(k, l))]
}

/// T of (A S Aᵀ)_Voigt = T S_Voigt for a stress vector S; a tangent then becomes T D Tᵀ.
pub fn stress_transformation(a: &Tensor) -> Voigt6x6 {
    Voigt6x6::from_fn(|row, column| {
        let ((i, j), (k, l)) = (PAIRS[row], PAIRS[column]);
        if k == l { a[(i, k)] * a[(j, k)] } else { a[(i, k)] * a[(j, l)] + a[(i, l)] * a[(j, k)] }
    })
}

/// A tangent in axes turned by the orthogonal Q (or, generally, A_iI A_jJ A_kK A_lL ℂ_IJKL).
pub fn transform_tangent(tangent: &Voigt6x6, a: &Tensor) -> Voigt6x6 {
    let t = stress_transformation(a);
    // in loops, which the compiler unrolls: nalgebra's product calls a function for each column. Tangents in
    // principal axes and frames of the plane are sparse
    let product = |left: &Voigt6x6, factor: &dyn Fn(usize, usize) -> f64| {
        let mut product = Voigt6x6::zeros();
        for j in 0..6 {
            for k in 0..6 {
                let factor = factor(k, j);
                if factor != 0.0 {
                    for i in 0..6 {
                        product[(i, j)] += left[(i, k)] * factor;
                    }
                }
            }
        }
        product
    };
    let half = product(&t, &|k, j| tangent[(k, j)]);
    product(&half, &|k, j| t[(j, k)])
}

/// The spatial tangent c_ijkl = J⁻¹ F_iI F_jJ F_kK F_lL ℂ_IJKL: the Truesdell rate of σ over the rate of
/// deformation.
pub fn spatial_tangent(deformation: &DeformationGradient, material_tangent: &Voigt6x6) -> Voigt6x6 {
    transform_tangent(material_tangent, deformation.matrix()) / deformation.jacobian()
}

/// σ = F S Fᵀ / J of a second Piola–Kirchhoff stress S (3.6).
pub fn cauchy_from_material(deformation: &DeformationGradient, second_piola_kirchhoff: &Voigt) -> Voigt {
    use StressMeasure::{Cauchy, SecondPiolaKirchhoff};
    let s = to_stress(second_piola_kirchhoff);
    from_stress(&deformation.convert_stress(&s, SecondPiolaKirchhoff, Cauchy))
}

/// Tangent of the Jaumann rate of the Kirchhoff stress over J, as Abaqus' UMAT needs it (DDSDDE at finite
/// strain): F_iI F_jJ F_kK F_lL ℂ_IJKL / J + ½(σ_ik δ_jl + σ_jk δ_il + σ_il δ_jk + σ_jl δ_ik), in the unit of
/// ℂ, from S and ℂ = 2 ∂S/∂C (Sun, Chaikof & Levenston 2008, <https://doi.org/10.1115/1.2979872>).
pub fn jaumann_tangent(
    deformation: &DeformationGradient,
    second_piola_kirchhoff: &Voigt,
    tangent: &Voigt6x6,
) -> Voigt6x6 {
    let sigma = to_stress(&cauchy_from_material(deformation, second_piola_kirchhoff));
    let delta = |i: usize, j: usize| f64::from(u8::from(i == j));
    let rate = Voigt6x6::from_fn(|a, b| {
        let ((i, j), (k, l)) = (PAIRS[a], PAIRS[b]);
        let (first, second) = (sigma[(i, k)] * delta(j, l), sigma[(j, k)] * delta(i, l));
        0.5 * (first + second + sigma[(i, l)] * delta(j, k) + sigma[(j, l)] * delta(i, k))
    });
    spatial_tangent(deformation, tangent) + rate
}

/// 𝔸 = ∂P/∂F, 𝔸_iJkL = F_iI F_kK ℂ_IJKL + δ_ik S_JL, in the unit of ℂ, from S and ℂ = 2 ∂S/∂C. Row 3i + J,
/// column 3k + L.
pub fn nominal_tangent(
    deformation: &DeformationGradient,
    second_piola_kirchhoff: &Voigt,
    tangent: &Voigt6x6,
) -> SMatrix<f64, 9, 9> {
    let f = deformation.matrix();
    SMatrix::from_fn(|row, column| {
        let ((i, j), (k, l)) = ((row / 3, row % 3), (column / 3, column % 3));
        let mut sum = if i == k { second_piola_kirchhoff[index(j, l)] } else { 0.0 };
        for m in 0..3 {
            for n in 0..3 {
                sum += f[(i, m)] * f[(k, n)] * component(tangent, m, j, n, l);
            }
        }
        sum
    })
}

pub(crate) fn index(i: usize, j: usize) -> usize {
    if i == j { i } else { i + j + 2 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn symmetric() -> Tensor {
        Tensor::new(1.0, 4.0, 5.0, 4.0, 2.0, 6.0, 5.0, 6.0, 3.0)
    }

    #[test]
    fn order_and_factors_are_those_of_the_thesis() {
        assert_eq!(from_stress(&symmetric()), Voigt::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0));
        assert_eq!(from_strain(&symmetric()), Voigt::new(1.0, 2.0, 3.0, 8.0, 10.0, 12.0));
        assert_eq!(to_stress(&from_stress(&symmetric())), symmetric());
        assert_eq!(to_strain(&from_strain(&symmetric())), symmetric());
    }

    #[test]
    fn stress_times_strain_is_the_double_contraction() {
        let other = Tensor::new(-1.0, 0.5, 2.0, 0.5, 0.3, -0.7, 2.0, -0.7, 1.1);
        let expected = symmetric().dot(&other);
        assert!((from_stress(&symmetric()).dot(&from_strain(&other)) - expected).abs() < 1e-14);
    }

    /// W = tr C²/4 has S = C; with C₁₂ counted once W = (ΣC_ii² + 2ΣC_ij²)/4 and ∂W/∂C₁₂ = C₁₂.
    /// Its ℂ = 2 ∂C/∂C has ℂ₁₁₁₁ = 2 and ℂ₁₂₁₂ = 1.
    #[test]
    fn factor_two_rules_on_a_quadratic_energy() {
        let c = from_stress(&symmetric());
        let gradient = Voigt::from_fn(|a, _| if a < 3 { 0.5 * c[a] } else { c[a] });
        assert_eq!(stress_from_energy_gradient(&gradient), c);
        let tangent = tangent_from_stress_gradient(&Voigt6x6::identity());
        assert_eq!(component(&tangent, 0, 0, 0, 0), 2.0);
        assert_eq!(component(&tangent, 0, 1, 1, 0), 1.0);
        // dS = D dE, with E = ½(C − 1)
        let zero = Voigt::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
        let stress = tangent * strain_from_right_cauchy_green(&c);
        assert_eq!(stress, c - zero);
    }

    #[test]
    fn transformation_matches_the_index_formula() {
        let a = Tensor::new(1.3, 0.4, -0.2, 0.1, 0.8, 0.3, -0.3, 0.2, 1.7);
        let direct = from_stress(&(a * symmetric() * a.transpose()));
        assert!((stress_transformation(&a) * from_stress(&symmetric()) - direct).norm() < 1e-13);

        let d = Voigt6x6::from_fn(|i, j| ((i + 2 * j) as f64).sin());
        let turned = transform_tangent(&d, &a);
        for (m, n) in [(0, 0), (0, 3), (4, 2), (5, 3)] {
            let ((i, j), (k, l)) = (PAIRS[m], PAIRS[n]);
            let mut sum = 0.0;
            for p in 0..3 {
                for q in 0..3 {
                    for r in 0..3 {
                        for s in 0..3 {
                            sum += a[(i, p)] * a[(j, q)] * a[(k, r)] * a[(l, s)] * component(&d, p, q, r, s);
                        }
                    }
                }
            }
            assert!((turned[(m, n)] - sum).abs() < 1e-12, "{m}{n}");
        }
    }
}
