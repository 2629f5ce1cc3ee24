//! Compressible forms: an incompressible law with −g ln J + U(J).

use super::{Error, Hyperelastic, PrincipalResponse, finite, parameter};

/// W = W₀(λ₁, λ₂, λ₃) − g ln J + U(J), the form of (1.19), (1.21) and (1.23).
///
/// W₀ keeps the full stretches (not the isochoric ones), hence W₀ alone is stressed at rest, Sᵢ(1) = g₀ =
/// 2 ∂W₀/∂I₁ + 4 ∂W₀/∂I₂, and g = g₀ makes the sum stress free: μ for (1.19) and (1.23), as printed, but
/// 2(C₁ + 2C₂) for (1.21), where C₁ is printed and leaves S(1) = (C₁ + 4C₂)·1.
#[derive(Debug, Clone)]
pub struct Compressible<L> {
    law: L,
    coupling: Coupling,
    factor: f64,
    volumetric: Volumetric,
}

/// Factor g before ln J.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Coupling {
    /// Value that makes F = 1 stress free.
    #[default]
    StressFree,
    /// Value printed in (1.19), (1.21), (1.23).
    AsPublished,
}

/// Volumetric energy U(J).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Volumetric {
    /// U = ½λ(J − 1)². Finite as J → 0: it does not resist collapse by itself, −g ln J does.
    Quadratic {
        /// Lamé's λ, Pa.
        lame: f64,
    },
    /// U = ½λ(ln J)². Not convex beyond J = e.
    Logarithmic {
        /// Lamé's λ, Pa.
        lame: f64,
    },
    /// U = ¼λ(J² − 1 − 2 ln J): convex, and infinite as J → 0 and as J → ∞ (Ciarlet 1988, Simo & Taylor 1991,
    /// doi:10.1016/0045-7825(91)90100-K).
    Ciarlet {
        /// Lamé's λ, Pa.
        lame: f64,
    },
    /// U = −p(J − 1): the reaction of an incompressible body under the pressure p (Pa), which no law
    /// determines.
    Pressure {
        /// p, positive in compression.
        pressure: f64,
    },
    /// U = 0, as (1.23) prints it.
    None,
}

impl<L: Hyperelastic> Compressible<L> {
    const NAME: &'static str = "compressible form";

    /// Builds the stress-free form of a law with a volumetric term.
    ///
    /// # Errors
    /// [`Error::Parameter`] for λ < 0 or a pressure that is not finite.
    pub fn new(law: L, volumetric: Volumetric) -> Result<Self, Error> {
        Self::with_coupling(law, volumetric, Coupling::StressFree)
    }

    /// Builds the law with a choice of g.
    ///
    /// # Errors
    /// Also [`Error::NotPublished`] if the thesis has no compressible form of that law.
    pub fn with_coupling(law: L, volumetric: Volumetric, coupling: Coupling) -> Result<Self, Error> {
        match volumetric {
            Volumetric::Quadratic { lame }
            | Volumetric::Logarithmic { lame }
            | Volumetric::Ciarlet { lame } => {
                parameter(Self::NAME, "lame", lame, lame >= 0.0, "[0, ∞)")?;
            }
            Volumetric::Pressure { pressure } => {
                parameter(Self::NAME, "pressure", pressure, true, "(−∞, ∞)")?;
            }
            Volumetric::None => {}
        }
        let factor = match coupling {
            Coupling::StressFree => law.response_at([1.0; 3])?.stress[0],
            Coupling::AsPublished => {
                law.published_coupling().ok_or_else(|| Error::NotPublished { law: law.name() })?
            }
        };
        Ok(Self { law, coupling, factor, volumetric })
    }

    /// g, Pa.
    pub fn coupling_factor(&self) -> f64 {
        self.factor
    }

    /// Bulk modulus of the small-strain limit, (ℂ₁₁₁₁ + 2ℂ₁₁₂₂)/3 at F = 1. It is λ + 2μ/3 only for the
    /// neo-Hookean law: the invariants of the full stretches add 4(W₁₁ + W₂ + …), 4C₂ for Mooney–Rivlin,
    /// 2μ/J_m for Gent.
    ///
    /// # Errors
    /// As [`Hyperelastic::response_at`].
    pub fn bulk_modulus(&self) -> Result<f64, Error> {
        let response = self.response_at([1.0; 3])?;
        Ok((response.normal[0][0] + 2.0 * response.normal[0][1]) / 3.0)
    }
}

impl Volumetric {
    /// U, J dU/dJ and J d(J dU/dJ)/dJ, with J − 1 and ln J given.
    fn terms(self, jacobian: f64, excess: f64, log: f64) -> (f64, f64, f64) {
        match self {
            Self::Quadratic { lame } => (
                0.5 * lame * excess * excess,
                lame * jacobian * excess,
                lame * jacobian * (jacobian + excess),
            ),
            Self::Logarithmic { lame } => (0.5 * lame * log * log, lame * log, lame),
            Self::Ciarlet { lame } => {
                let square = excess * (2.0 + excess);
                (0.25 * lame * (square - 2.0 * log), 0.5 * lame * square, lame * jacobian * jacobian)
            }
            Self::Pressure { pressure } => (-pressure * excess, -pressure * jacobian, -pressure * jacobian),
            Self::None => (0.0, 0.0, 0.0),
        }
    }
}

impl<L: Hyperelastic> Hyperelastic for Compressible<L> {
    fn name(&self) -> String {
        let volumetric = match self.volumetric {
            Volumetric::Quadratic { .. } => "λ/2(J−1)²",
            Volumetric::Logarithmic { .. } => "λ/2(ln J)²",
            Volumetric::Ciarlet { .. } => "λ/4(J²−1−2 ln J)",
            Volumetric::Pressure { .. } => "−p(J−1)",
            Volumetric::None => "U = 0",
        };
        let printed = if self.coupling == Coupling::AsPublished { ", as printed" } else { "" };
        format!("{} with {volumetric}{printed}", self.law.name())
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        let mut all = self.law.parameters();
        match self.volumetric {
            Volumetric::Quadratic { lame }
            | Volumetric::Logarithmic { lame }
            | Volumetric::Ciarlet { lame } => {
                all.push(("lame".into(), lame));
            }
            Volumetric::Pressure { pressure } => all.push(("pressure".into(), pressure)),
            Volumetric::None => {}
        }
        all
    }

    fn shear_modulus(&self) -> f64 {
        // ½(ℂ₁₁₁₁ − ℂ₁₁₂₂) at rest; a wrong g shifts it by g − g₀
        match self.response_at([1.0; 3]) {
            Ok(response) => 0.5 * (response.normal[0][0] - response.normal[0][1]),
            Err(_) => f64::NAN,
        }
    }

    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        let (jacobian, excess, log) = volume(stretches);
        let (energy, _, _) = self.volumetric.terms(jacobian, excess, log);
        finite(Self::NAME, stretches, self.law.energy_at(stretches)? - self.factor * log + energy)
    }

    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        let (jacobian, excess, log) = volume(stretches);
        let (_, slope, curvature) = self.volumetric.terms(jacobian, excess, log);
        let volumetric = PrincipalResponse::volumetric(stretches, slope - self.factor, curvature);
        self.law.response_at(stretches)?.plus(&volumetric).finite(Self::NAME, stretches)
    }
}

/// J, J − 1 and ln J, the last two without cancellation near J = 1 whatever the stretches.
fn volume([a, b, c]: [f64; 3]) -> (f64, f64, f64) {
    let area = a * b;
    let jacobian = area * c;
    let rounding = area.mul_add(c, -jacobian) + a.mul_add(b, -area) * c;
    let excess = (jacobian - 1.0) + rounding;
    (jacobian, excess, if excess.abs() < 0.5 { excess.ln_1p() } else { jacobian.ln() })
}
