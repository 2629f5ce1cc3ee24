//! Viscosities of branches, and their temperature shift.

use crate::constitutive::Error;

/// Viscosity η of a branch as a function of J₂ = ½ τ:τ of the branch's Kirchhoff stress and I₁ᵛ = tr C_v.
///
/// Code carries ln(1/η): at rest 1/η is 0 for `BergstromBoyce`, and η of a trial stress of `Eyring`
/// underflows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Viscosity {
    /// η₀, Pa s.
    Constant(f64),
    /// η = η_∞ + (η₀ − η_∞ + K₁(I₁ᵛ^γ₁ − 3^γ₁))/(1 + (K₂J₂)^γ₂); Kumar and Lopez-Pamies 2016,
    /// doi:10.1016/j.crme.2015.11.004.
    KumarLopezPamies {
        /// η₀ ≥ η_∞, Pa s.
        start: f64,
        /// η_∞ ≥ 0, Pa s.
        end: f64,
        /// K₁ ≥ 0, Pa s.
        thickening: f64,
        /// K₂ ≥ 0, 1/Pa².
        thinning: f64,
        /// γ₁ and γ₂ ≥ 0.
        exponents: [f64; 2],
    },
    /// η = √(2J₂)/(2γ̇), γ̇ = γ̇₀(√(I₁ᵛ/3) − 1 + ξ)^c (√(2J₂)/τ̂)^m: Frobenius norms; Bergström and Boyce
    /// 1998, doi:10.1016/S0022-5096(97)00075-6. Abaqus' A, E: γ̇₀/τ̂^m = A(3/2)^((m+1)/2), ξ = E.
    BergstromBoyce {
        /// γ̇₀, 1/s.
        rate: f64,
        /// τ̂, Pa.
        stress: f64,
        /// m ≥ 1.
        power: f64,
        /// c from −1 to 0.
        creep: f64,
        /// ξ > 0.
        offset: f64,
    },
    /// η = q/(γ̇₀ sinh(q/τ₀)) · exp(μ_p p/τ₀ + S_a R(γ)), q = √J₂, pressure p and viscous shear γ at the
    /// start of the step; Eyring 1936.
    Eyring {
        /// γ̇₀, 1/s.
        rate: f64,
        /// τ₀, Pa.
        stress: f64,
        /// μ_p ≥ 0.
        pressure: f64,
        /// Softening after yield.
        softening: Option<StrainSoftening>,
    },
}

/// S_a R(γ), R = [(1 + (r₀e^γ)^r₁)/(1 + r₀^r₁)]^((r₂−1)/r₁), of glassy polymers; Klompen et al. 2005,
/// doi:10.1021/ma050498v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrainSoftening {
    /// S_a.
    pub amount: f64,
    /// r₀, r₁, r₂ > 0.
    pub shape: [f64; 3],
}

impl StrainSoftening {
    /// S_a R(γ).
    pub fn logarithm(&self, shear: f64) -> f64 {
        let [r0, r1, r2] = self.shape;
        // ln(1 + (r₀e^γ)^r₁) without overflow
        let power = r1 * (r0.ln() + shear);
        let grown = if power > 30.0 { power } else { power.exp().ln_1p() };
        self.amount * ((r2 - 1.0) / r1 * (grown - r0.powf(r1).ln_1p())).exp()
    }
}

/// ln(1/η) at a state, with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fluidity {
    /// ln(1/η).
    pub logarithm: f64,
    /// ∂ln(1/η)/∂ln J₂.
    pub by_stress: f64,
    /// ∂ln(1/η)/∂I₁ᵛ.
    pub by_strain: f64,
}

impl Viscosity {
    /// Checks the constants against the ranges above.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn check(&self) -> Result<(), Error> {
        let rule = |law, parameter: &str, value: f64, valid: bool, allowed| {
            if valid && value.is_finite() {
                Ok(())
            } else {
                Err(Error::Parameter { law, parameter: parameter.to_owned(), value, allowed })
            }
        };
        match *self {
            Self::Constant(eta) => rule("constant viscosity", "viscosity", eta, eta > 0.0, "(0, ∞)"),
            Self::KumarLopezPamies { start, end, thickening, thinning, exponents: [g1, g2] } => {
                let law = "kumar-lopez-pamies";
                rule(law, "eta_inf", end, end >= 0.0, "[0, eta_0]")?;
                rule(law, "eta_0", start, start >= end && start > 0.0, "(0, ∞), at least eta_inf")?;
                for (name, value) in
                    [("K_1", thickening), ("K_2", thinning), ("gamma_1", g1), ("gamma_2", g2)]
                {
                    rule(law, name, value, value >= 0.0, "[0, ∞)")?;
                }
                Ok(())
            }
            Self::BergstromBoyce { rate, stress, power, creep, offset } => {
                let law = "bergstrom-boyce";
                rule(law, "rate", rate, rate > 0.0, "(0, ∞)")?;
                rule(law, "stress", stress, stress > 0.0, "(0, ∞)")?;
                rule(law, "m", power, power >= 1.0, "[1, ∞)")?;
                rule(law, "c", creep, (-1.0..=0.0).contains(&creep), "[-1, 0]")?;
                rule(law, "xi", offset, offset > 0.0, "(0, ∞)")
            }
            Self::Eyring { rate, stress, pressure, softening } => {
                let law = "eyring";
                rule(law, "rate", rate, rate > 0.0, "(0, ∞)")?;
                rule(law, "stress", stress, stress > 0.0, "(0, ∞)")?;
                rule(law, "pressure", pressure, pressure >= 0.0, "[0, ∞)")?;
                if let Some(StrainSoftening { amount, shape }) = softening {
                    rule(law, "S_a", amount, amount >= 0.0, "[0, ∞)")?;
                    for (name, value) in [("r_0", shape[0]), ("r_1", shape[1])] {
                        rule(law, name, value, value > 0.0, "(0, ∞)")?;
                    }
                    rule(law, "r_2", shape[2], shape[2] < 1.0, "below 1: R falls")?;
                }
                Ok(())
            }
        }
    }

    /// ln(1/η) at J₂, Pa², and I₁ᵛ, without the factors of [`Viscosity::glassy`].
    pub fn fluidity(&self, j2: f64, viscous: f64) -> Fluidity {
        let viscous = viscous.max(3.0);
        match *self {
            Self::Constant(eta) => Fluidity { logarithm: -eta.ln(), by_stress: 0.0, by_strain: 0.0 },
            Self::KumarLopezPamies { start, end, thickening, thinning, exponents: [g1, g2] } => {
                let power = (thinning * j2).powf(g2);
                let grown = start - end + thickening * (viscous.powf(g1) - 3.0_f64.powf(g1));
                let eta = end + grown / (1.0 + power);
                let by_stress =
                    if power.is_finite() { g2 * power * grown / (1.0 + power).powi(2) / eta } else { 0.0 };
                let slope = thickening * g1 * viscous.powf(g1 - 1.0);
                Fluidity { logarithm: -eta.ln(), by_stress, by_strain: -slope / (1.0 + power) / eta }
            }
            Self::BergstromBoyce { rate, stress, power, creep, offset } => {
                let chain = (viscous / 3.0).sqrt();
                let base = chain - 1.0 + offset;
                // at rest 1/η = 0 for m > 1
                let flow =
                    if power > 1.0 { (power - 1.0) * (0.5 * (2.0 * j2).ln() - stress.ln()) } else { 0.0 };
                Fluidity {
                    logarithm: (2.0 * rate / stress).ln() + creep * base.ln() + flow,
                    by_stress: 0.5 * (power - 1.0),
                    by_strain: creep / base / (6.0 * chain),
                }
            }
            Self::Eyring { rate, stress, .. } => {
                let x = j2.max(0.0).sqrt() / stress;
                // ln(sinh x/x) and ½(x coth x − 1)
                let (logarithm, by_stress) = if x < 1e-3 {
                    (x * x / 6.0, x * x / 6.0)
                } else if x < 30.0 {
                    ((x.sinh() / x).ln(), 0.5 * (x / x.tanh() - 1.0))
                } else {
                    (x - (2.0 * x).ln(), 0.5 * (x - 1.0))
                };
                Fluidity { logarithm: (rate / stress).ln() + logarithm, by_stress, by_strain: 0.0 }
            }
        }
    }

    /// Logarithm of the factor exp(μ_p p/τ₀ + S_a R(γ)) on η, from pressure p, Pa, and viscous shear γ.
    pub fn glassy(&self, pressure: f64, shear: f64) -> f64 {
        match *self {
            Self::Eyring { stress, pressure: sensitivity, softening, .. } => {
                sensitivity * pressure / stress + softening.map_or(0.0, |soft| soft.logarithm(shear))
            }
            _ => 0.0,
        }
    }
}
