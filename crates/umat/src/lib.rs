//! Materials of this workspace as UMAT: `umat_` for Abaqus and `umat_user_` for CalculiX, in `libumat`.
//!
//! The name of the material in the input of the host selects a hyperelastic law of [`polycore`]
//! (`EIGHT_CHAIN`, `NEO_HOOKEAN`, …, [`RubberMaterial`]), such a law with branches
//! (`VISCOELASTIC_EIGHT_CHAIN`, …, [`RelaxingRubber`]) or the solidifying body of prints (`PRINTED_PA12`,
//! [`Print`]); CalculiX needs `USER_` before it. The library also contains `umatht_`.
//!
//! ```
//! use umat::RubberMaterial;
//! // K, then C_R and N of the eight-chain law, in the host's unit of stress
//! let rubber = RubberMaterial::new("eight-chain", &[100.0, 0.3, 25.0])?;
//! let twice = [2.0, 0.0, 0.0, 0.0, 0.8, 0.0, 0.0, 0.0, 0.7];
//! let (stress, _) = rubber.cauchy(&twice)?;
//! assert!(stress[0] > stress[1] && stress[3] == 0.0);
//! # Ok::<(), umat::Error>(())
//! ```

mod host;
mod print;
mod relaxing;
mod rubber;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod time_tests;

pub use print::{Dissipation, Print};
pub use relaxing::{PointEnergies, RelaxingRubber};
pub use rubber::RubberMaterial;

/// Error of a material's constants or state.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("umat: {what}: found {found}; allowed: {allowed}")]
pub struct Error {
    /// Name of the quantity.
    pub what: String,
    /// Value found.
    pub found: String,
    /// Allowed values.
    pub allowed: String,
}

impl Error {
    fn new(what: impl ToString, found: impl ToString, allowed: impl ToString) -> Self {
        Self { what: what.to_string(), found: found.to_string(), allowed: allowed.to_string() }
    }
}

/// Material of a host's input.
pub enum Material {
    /// Hyperelastic: no state.
    Rubber(RubberMaterial),
    /// With branches: [`RelaxingRubber::states`] state variables.
    Relaxing(Box<RelaxingRubber>),
    /// Solidifying: [`Print::STATES`] state variables.
    Print(Box<Print>),
}

impl Material {
    /// Creates the material of a name: that of a law, in any case, with `_` or `-`, optionally with `USER_`
    /// and `VISCOELASTIC_` before and `_…` behind it.
    ///
    /// # Errors
    /// An unknown name; constants out of range, too few or too many.
    pub fn new(name: &str, constants: &[f64]) -> Result<Self, Error> {
        let lower = name.trim().to_lowercase().replace('_', "-");
        // CalculiX removes its `USER`
        let lower = lower.strip_prefix("user").unwrap_or(&lower).trim_start_matches('-');
        let (lower, relaxes) = match lower.strip_prefix(RelaxingRubber::PREFIX) {
            Some(rest) => (rest, true),
            None => (lower, false),
        };
        let is =
            |key: &str| lower.strip_prefix(key).is_some_and(|rest| rest.is_empty() || rest.starts_with('-'));
        if is(Print::NAME) && !relaxes {
            return Ok(Self::Print(Box::new(Print::new(constants)?)));
        }
        let keys = rubber::names();
        // the longest: `eight-chain` begins `eight-chain-root-i2`
        match keys.iter().filter(|key| is(key)).max_by_key(|key| key.len()) {
            Some(key) if relaxes => Ok(Self::Relaxing(Box::new(RelaxingRubber::new(key, constants)?))),
            Some(key) => Ok(Self::Rubber(RubberMaterial::new(key, constants)?)),
            None => {
                let allowed =
                    format!("{}, {}", keys.join(", "), Print::NAME).to_uppercase().replace('-', "_");
                let allowed = format!("{allowed}, or VISCOELASTIC_ before the name of a law");
                Err(Error::new(
                    "name of the material",
                    name.trim(),
                    format!("one that begins with {allowed}"),
                ))
            }
        }
    }
}
