//! Stress and tangent in the principal frame, for the forms of energy in Chapter 1.

use super::Error;
use crate::tensor::{Voigt6x6, deformation::check_stretches};

/// Response of an isotropic law in the frame of the principal directions Nᵢ. With aᵢ = λᵢ²:
/// Sᵢ = 2 ∂W/∂aᵢ, ℂ_iijj = 4 ∂²W/∂aᵢ∂aⱼ, ℂ_ijij = (Sᵢ − Sⱼ)/(aᵢ − aⱼ) for i ≠ j, all others zero.
/// (Ogden, *Non-Linear Elastic Deformations*, 1984, §6.1.4.) Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrincipalResponse {
    /// Principal PK2 stresses Sᵢ.
    pub stress: [f64; 3],
    /// ℂ_iijj, row i, column j.
    pub normal: [[f64; 3]; 3],
    /// ℂ_1212, ℂ_1313, ℂ_2323, formed without the quotient of differences wherever that would cancel.
    pub shear: [f64; 3],
}

/// Derivatives of W(I₁, I₂) at a point.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct InvariantDerivatives {
    /// ∂W/∂I₁.
    pub first: f64,
    /// ∂W/∂I₂.
    pub second: f64,
    /// ∂²W/∂I₁².
    pub first_first: f64,
    /// ∂²W/∂I₂².
    pub second_second: f64,
    /// ∂²W/∂I₁∂I₂.
    pub mixed: f64,
}

/// ij of each entry of [`PrincipalResponse::shear`].
const SHEAR: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

impl PrincipalResponse {
    /// The tangent in Voigt form, in the principal frame.
    pub fn tangent(&self) -> Voigt6x6 {
        let mut tangent = Voigt6x6::zeros();
        for i in 0..3 {
            for j in 0..3 {
                tangent[(i, j)] = self.normal[i][j];
            }
            tangent[(3 + i, 3 + i)] = self.shear[i];
        }
        tangent
    }

    /// ℂ_ijij for i ≠ j, from 0.
    pub fn shear_between(&self, i: usize, j: usize) -> f64 {
        self.shear[(i + j).saturating_sub(1).min(2)]
    }

    /// Response of W(I₁, I₂). The shear quotient is −2 ∂W/∂I₂ exactly.
    pub(super) fn from_invariants(stretches: [f64; 3], w: InvariantDerivatives) -> Self {
        let [a, b, c] = stretches.map(|l| l * l);
        let others = [b + c, c + a, a + b];
        Self {
            stress: others.map(|sum| 2.0 * (w.first + w.second * sum)),
            normal: std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    let second = if i == j { 0.0 } else { w.second };
                    let mixed = w.mixed * (others[i] + others[j]);
                    4.0 * (w.first_first + w.second_second * others[i] * others[j] + second + mixed)
                })
            }),
            shear: [-2.0 * w.second; 3],
        }
    }

    /// Response of W = Σ w(λᵢ). `law(λ)` returns (w′, w″), `room(λ)` a length over which w is smooth.
    pub(super) fn separable(
        stretches: [f64; 3],
        law: impl Fn(f64) -> (f64, f64),
        room: impl Fn(f64) -> f64,
    ) -> Self {
        let stress_of = |l: f64| law(l).0 / l;
        let stress = stretches.map(stress_of);
        let mut normal = [[0.0; 3]; 3];
        for i in 0..3 {
            normal[i][i] = (law(stretches[i]).1 - stress[i]) / (stretches[i] * stretches[i]);
        }
        let shear = SHEAR.map(|(i, j)| {
            let (x, y) = (stretches[i], stretches[j]);
            let slope = if (x - y).abs() > NEAR_EQUAL * room(x.max(y)) {
                (stress[i] - stress[j]) / (x - y)
            } else {
                // mean of dS/dλ over [y, x]; the error of the rule is NEAR_EQUAL⁶ relative, far below
                // rounding
                GAUSS
                    .iter()
                    .map(|(at, weight)| {
                        let l = 0.5 * ((x + y) + at * (x - y));
                        let (w1, w2) = law(l);
                        weight * (w2 - w1 / l) / l
                    })
                    .sum()
            };
            slope / (x + y)
        });
        Self { stress, normal, shear }
    }

    /// Response of a function of J alone with h(J) = J dU/dJ: Sᵢ = h/aᵢ. `slope` is J dh/dJ.
    pub(super) fn volumetric(stretches: [f64; 3], h: f64, slope: f64) -> Self {
        // one division at a time: 1/λ⁴ may overflow where h/λ⁴ does not
        let over = |value: f64, i: usize| value / stretches[i] / stretches[i];
        Self {
            stress: std::array::from_fn(|i| over(h, i)),
            normal: std::array::from_fn(|i| {
                std::array::from_fn(|j| over(over(if i == j { slope - 2.0 * h } else { slope }, i), j))
            }),
            shear: SHEAR.map(|(i, j)| -over(over(h, i), j)),
        }
    }

    /// Response of W(λ̄) with λ̄ᵢ = J^(−1/3) λᵢ, from that of W at λ̄: with tᵢ = āᵢS̄ᵢ and the deviator dev,
    /// ∂W/∂ln λᵢ = dev t, ∂²W/∂ln λᵢ∂ln λⱼ = dev ∂t/∂ln λ̄ dev.
    pub(super) fn isochoric(&self, stretches: [f64; 3]) -> Self {
        let root = stretches.iter().map(|l| l.cbrt()).product::<f64>();
        let (full, kept) = (stretches.map(|l| l * l), stretches.map(|l| (l / root) * (l / root)));
        let t: [f64; 3] = std::array::from_fn(|i| kept[i] * self.stress[i]);
        let mean = |of: [f64; 3]| of.iter().sum::<f64>() / 3.0;
        let hessian: [[f64; 3]; 3] = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                kept[i] * kept[j] * self.normal[i][j] + if i == j { 2.0 * t[i] } else { 0.0 }
            })
        });
        let (rows, pressure) = (hessian.map(mean), mean(t));
        let all = mean(rows);
        Self {
            stress: std::array::from_fn(|i| (t[i] - pressure) / full[i]),
            normal: std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    let own = if i == j { 2.0 * (t[i] - pressure) } else { 0.0 };
                    (hessian[i][j] - rows[i] - rows[j] + all - own) / full[i] / full[j]
                })
            }),
            shear: std::array::from_fn(|k| {
                let (i, j) = SHEAR[k];
                (kept[i] * kept[j] * self.shear[k] + pressure) / full[i] / full[j]
            }),
        }
    }

    /// Sum of two responses.
    pub(super) fn plus(mut self, other: &Self) -> Self {
        for i in 0..3 {
            self.stress[i] += other.stress[i];
            self.shear[i] += other.shear[i];
            for j in 0..3 {
                self.normal[i][j] += other.normal[i][j];
            }
        }
        self
    }

    /// Returns the response, or the error if a component is not finite.
    pub(super) fn finite(self, law: &'static str, stretches: [f64; 3]) -> Result<Self, Error> {
        check_stretches(&stretches)?;
        let mut all = self.stress.iter().chain(&self.shear).chain(self.normal.iter().flatten());
        let finite = all.all(|value| value.is_finite());
        if finite { Ok(self) } else { Err(Error::Overflow { law, stretches }) }
    }
}

/// Relative distance of stretches, on the scale on which w varies, below which the quadrature is used.
const NEAR_EQUAL: f64 = 1e-3;

/// Three-point Gauss–Legendre rule on [−1, 1], weights halved.
const GAUSS: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 18.0), (0.0, 4.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 18.0)];
