//! Phases of a solidifying body: branches with common shifts of their relaxation times.

use super::maxwell::SolidifyingMaxwell;
use crate::error::Error;
use polycore::constitutive::viscoelastic::Shift;

/// A Maxwell branch: a modulus that relaxes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Branch {
    /// Modulus, Pa.
    pub modulus: f64,
    /// Relaxation time at the reference of the shift, s; infinite if elastic.
    pub time: f64,
}

/// Branches of a phase; default: none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Phase {
    /// Maxwell branches.
    pub branches: Vec<Branch>,
    /// Shift ln a_T of all relaxation times with temperature.
    pub shift: Shift,
    /// Slope of ln a with α: crystals slow relaxation; default 0.
    pub retardation: f64,
    /// Flow of the shear of each branch that relaxes; default: none.
    pub flow: Option<EyringFlow>,
    /// Temperatures, K, between which the constants hold; default: all.
    pub range: Option<[f64; 2]>,
}

/// Eyring flow: the relaxation time of the shear of a branch is multiplied by (q/τ₀)/sinh(q/τ₀), q = √J₂ of
/// its stress. With τ(T), the time at rest, and G, the shear modulus, this is the viscosity
/// [`polycore::constitutive::viscoelastic::Viscosity::Eyring`] of the rate γ̇₀ = τ₀/(G τ). The volume relaxes
/// as at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyringFlow {
    /// τ₀ = kT/V at the reference, Pa.
    pub stress: f64,
    /// Temperature of this τ₀, K; τ₀ is proportional to T.
    pub reference: f64,
}

impl EyringFlow {
    /// τ₀ at a temperature, Pa.
    pub fn stress_at(&self, temperature: f64) -> f64 {
        self.stress * (temperature / self.reference)
    }
}

impl Phase {
    /// Returns branches and their shift.
    pub fn new(branches: Vec<Branch>, shift: Shift) -> Self {
        Self { branches, shift, ..Self::default() }
    }

    /// Reduced time ∫dt/a of a history linear in T and α, s.
    pub fn reduced_time(&self, temperatures: [f64; 2], degrees: [f64; 2], duration: f64) -> f64 {
        let slower = self.retardation * 0.5 * (degrees[0] + degrees[1]);
        self.shift.reduced_time(temperatures, duration) * (-slower).exp()
    }

    /// Checks the constants.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn check(&self) -> Result<(), Error> {
        let rule = |name, found: f64, valid: bool, allowed: &str| match valid {
            true => Ok(()),
            false => Err(Error::Parameter { name, found, allowed: allowed.to_owned() }),
        };
        let positive =
            |name, value: f64| rule(name, value, value > 0.0 && value.is_finite(), "above 0, finite");
        for branch in &self.branches {
            positive("modulus of a branch, Pa", branch.modulus)?;
            rule("relaxation time, s", branch.time, branch.time > 0.0, "above 0")?;
        }
        if let Some((name, value)) = self.shift.invalid_constant() {
            positive(name, value)?;
        }
        let slope = self.retardation;
        rule("retardation by crystals", slope, (-100.0..=100.0).contains(&slope), "-100 to 100")?;
        if let Some(EyringFlow { stress, reference }) = self.flow {
            positive("stress of flow, Pa", stress)?;
            positive("reference of flow, K", reference)?;
        }
        match self.range {
            Some([low, high]) => rule(
                "upper end of the range, K",
                high,
                low > 0.0 && high > low && high.is_finite(),
                &format!("above {low} K, which is above 0 K"),
            ),
            None => Ok(()),
        }
    }
}

impl SolidifyingMaxwell {
    /// Checks the constants of both phases.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn check(&self) -> Result<(), Error> {
        self.amorphous.check()?;
        self.network.check()
    }

    /// Refuses a temperature, K, outside the range of a phase with branches.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn check_temperature(&self, temperature: f64) -> Result<(), Error> {
        let ranges = [&self.amorphous, &self.network].into_iter().filter_map(|phase| phase.range);
        for [low, high] in ranges {
            if !(low..=high).contains(&temperature) {
                return Err(Error::Parameter {
                    name: "temperature in the law of relaxation, K",
                    found: temperature,
                    allowed: format!("{low} to {high}, the range of its shift"),
                });
            }
        }
        Ok(())
    }

    /// Returns true if a branch flows: a step then needs iterations.
    pub fn flows(&self) -> bool {
        self.amorphous.flow.is_some() || self.network.flow.is_some()
    }
}
