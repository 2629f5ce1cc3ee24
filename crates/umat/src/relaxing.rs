//! Rubbers with branches under the deformations and times of a host.

use crate::Error;
use crate::rubber::{self, stretched};
use polycore::constitutive::Workspace;
use polycore::constitutive::viscoelastic::user_material::{self, PointRecord, state_count};
use polycore::constitutive::viscoelastic::{Increment, Reaction, Scheme, Shift, State, Viscoelastic};
use polycore::tensor::voigt::{self, Voigt, Voigt6x6};
use polycore::tensor::{DeformationGradient, Tensor};

/// Rubber that relaxes: an elastic law as of [`crate::RubberMaterial`], and branches.
pub struct RelaxingRubber {
    law: Viscoelastic,
    /// Absolute zero in the host's degrees.
    zero: f64,
}

/// Energies of a point in the host's unit of stress.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointEnergies {
    /// Elastic energy that can be recovered.
    pub stored: f64,
    /// Dissipated so far by the softening of the elastic law.
    pub softening: f64,
    /// Dissipated so far by the branches.
    pub viscous: f64,
}

impl PointEnergies {
    fn over(self, volume: f64) -> Self {
        let Self { stored, softening, viscous } = self;
        Self { stored: stored / volume, softening: softening / volume, viscous: viscous / volume }
    }
}

impl RelaxingRubber {
    /// Beginning of the name in the input of a host; that of the elastic law follows.
    pub const PREFIX: &'static str = "viscoelastic-";

    /// Creates a law from the key of its elastic law; constants are those of the elastic law alone, then
    /// those of [`user_material`], stresses in the host's unit.
    ///
    /// # Errors
    /// As [`crate::RubberMaterial::new`] and [`user_material::law`]; no branch.
    pub fn new(key: &str, constants: &[f64]) -> Result<Self, Error> {
        let count = rubber::count(key)?;
        let (own, rest) = constants.split_at(count.min(constants.len()));
        let equilibrium = rubber::law(key, own)?;
        let wrong = |error: polycore::constitutive::Error| {
            Error::new(format!("constants of {}{key}", Self::PREFIX), format!("{rest:?}"), error)
        };
        let (law, zero) = user_material::law(Box::new(equilibrium), rest).map_err(wrong)?;
        if law.branches().is_empty() {
            let allowed = format!("constants of one branch or more behind the first {}", count + 4);
            return Err(Error::new("branches", "none", allowed));
        }
        Ok(Self { law, zero })
    }

    /// Number of state variables.
    pub fn states(&self) -> usize {
        state_count(self.law.branches().len())
    }

    /// Converts a temperature of the host to K.
    ///
    /// # Errors
    /// A temperature at or below absolute zero, or none, where a branch depends on it.
    pub fn kelvin(&self, temperature: f64) -> Result<f64, Error> {
        let kelvin = temperature + self.zero;
        if kelvin > 0.0 || self.law.branches().iter().all(|branch| branch.shift == Shift::None) {
            return Ok(kelvin);
        }
        let allowed = "above absolute zero: give initial temperatures, and 273.15 among the constants for °C";
        Err(Error::new("temperature, K", kelvin, allowed))
    }

    /// Advances a point to C in a time: S, ℂ = 2 ∂S/∂C of the whole step, in the order 11, 22, 33, 12, 13,
    /// 23, and energies per undeformed volume. `state` holds [`Self::states`] numbers, 0 at first; an error
    /// leaves them as they are.
    ///
    /// # Errors
    /// A C that is not positive definite, chains beyond their limit, a time below 0, a result that is not
    /// finite; too few state variables.
    pub fn material(
        &self,
        state: &mut [f64],
        c: &Voigt,
        duration: f64,
        kelvin: f64,
    ) -> Result<(Voigt, Voigt6x6, PointEnergies), Error> {
        let given = state.len();
        let Some(state) = state.get_mut(..self.states()) else {
            return Err(Error::new("state variables", given, self.states()));
        };
        let before = PointRecord::read(state);
        let increment = Increment {
            // read by second order alone
            from: *c,
            to: *c,
            duration,
            temperature: kelvin,
            pressure: before.pressure,
            scheme: Scheme::Euler,
        };
        let mut end = State::default();
        let found = self.law.respond(&before.state, &increment, true, &mut end, &mut Workspace::default());
        let found = found.map_err(stretched)?;
        let (stress, tangent) = (found.prediction.stress, found.prediction.tangent.unwrap_or_default());
        let lost = |peak: f64| self.law.softening().map_or(0.0, |own| own.energies(peak, peak)[1]);
        let softening = lost(end.peak);
        let viscous = before.dissipated + found.dissipated - (softening - lost(before.state.peak));
        let stored = found.prediction.energy.unwrap_or_default();
        let pressure = Reaction::Law.pressure(c, &stress);
        let numbers = [stored, softening, viscous, pressure];
        if !stress.iter().chain(tangent.iter()).chain(&numbers).all(|number| number.is_finite()) {
            return Err(stretched(format!("no finite stress at C = {:?}", c.as_slice())));
        }
        PointRecord { state: end, pressure, dissipated: viscous }.write(state);
        Ok((stress, tangent, PointEnergies { stored, softening, viscous }))
    }

    /// Advances a point to F, nine numbers column by column: Cauchy stress, tangent of its Jaumann rate
    /// ([`voigt::jaumann_tangent`]), energies per deformed volume.
    ///
    /// # Errors
    /// As [`Self::material`]; det F ≤ 0.
    pub fn cauchy(
        &self,
        state: &mut [f64],
        f: &[f64; 9],
        duration: f64,
        kelvin: f64,
    ) -> Result<(Voigt, Voigt6x6, PointEnergies), Error> {
        let f = DeformationGradient::new(Tensor::from_column_slice(f)).map_err(stretched)?;
        let c = voigt::from_stress(&f.right_cauchy_green());
        let (s, tangent, energies) = self.material(state, &c, duration, kelvin)?;
        let stress = voigt::cauchy_from_material(&f, &s);
        Ok((stress, voigt::jaumann_tangent(&f, &s, &tangent), energies.over(f.jacobian())))
    }
}
