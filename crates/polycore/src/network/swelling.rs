//! Swelling of a network in a solvent, to equilibrium.

use super::{Error, GAS_CONSTANT, positive};
use crate::numerics::bisected;

/// Solvent around a network.
///
/// The law of Flory and Rehner (1943), doi:10.1063/1.1723792, for phantom junctions: ln(1 − φ) + φ + χφ² +
/// (V₁G/RT) φ^(1/3) = 0, with the polymer's volume fraction φ and the modulus G of the dry gel, whose
/// entanglements count as junctions. It cross-checks a modulus by a balance and a bottle of solvent.
///
/// ```
/// use polycore::network::Solvent;
///
/// // 106 cm³/mol, χ = 0.45: a gel of 0.2 MPa takes up four times its volume
/// let solvent = Solvent::new(106e-6, 0.45)?;
/// let fraction = solvent.polymer_fraction(0.2e6, 298.15)?;
/// assert!((1.0 / fraction - 5.06).abs() < 0.01, "{}", 1.0 / fraction);
/// assert!((solvent.modulus(fraction, 298.15)? / 0.2e6 - 1.0).abs() < 1e-9);
/// # Ok::<(), polycore::network::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solvent {
    molar_volume: f64,
    interaction: f64,
}

impl Solvent {
    /// Creates a solvent of a molar volume V₁ (m³/mol) with the interaction parameter χ of polymer and
    /// solvent, taken as constant.
    ///
    /// # Errors
    /// A molar volume that is not positive, a χ that is not finite.
    pub fn new(molar_volume: f64, interaction: f64) -> Result<Self, Error> {
        positive("molar volume of the solvent", molar_volume)?;
        if !interaction.is_finite() {
            let (quantity, allowed) = ("interaction parameter", "finite numbers");
            return Err(Error::Domain { quantity, value: interaction, allowed });
        }
        Ok(Self { molar_volume, interaction })
    }

    /// Returns −(ln(1 − φ) + φ + χφ²) φ^(−1/3), V₁G/RT at equilibrium.
    fn stiffness(&self, fraction: f64) -> f64 {
        // ln(1 − φ) + φ by its series where the sum cancels
        let mixing = if fraction < 1e-3 {
            -fraction * fraction * (0.5 + fraction * (1.0 / 3.0 + fraction * (0.25 + fraction * 0.2)))
        } else {
            (-fraction).ln_1p() + fraction
        };
        -(mixing + self.interaction * fraction * fraction) / fraction.cbrt()
    }

    /// Computes the polymer's volume fraction φ at equilibrium from the shear modulus of the dry gel (Pa)
    /// and the temperature (K); 1/φ is the swelling by volume.
    ///
    /// # Errors
    /// Numbers that are not positive.
    pub fn polymer_fraction(&self, modulus: f64, temperature: f64) -> Result<f64, Error> {
        let modulus = positive("modulus", modulus)?;
        let target = self.molar_volume * modulus / (GAS_CONSTANT * positive("temperature", temperature)?);
        // below 0 up to some φ of a poor solvent, then monotone up to infinity
        Ok(bisected(0.0, 1.0, 2000, |fraction| self.stiffness(fraction) < target))
    }

    /// Computes the shear modulus of the dry gel, Pa, from the polymer's volume fraction at equilibrium.
    ///
    /// # Errors
    /// A fraction outside 0 to 1, or one at which a solvent as poor as this would not swell the gel.
    pub fn modulus(&self, fraction: f64, temperature: f64) -> Result<f64, Error> {
        let thermal = GAS_CONSTANT * positive("temperature", temperature)?;
        let stiffness = self.stiffness(fraction);
        if fraction > 0.0 && fraction < 1.0 && stiffness > 0.0 {
            return Ok(stiffness * thermal / self.molar_volume);
        }
        let (quantity, allowed) =
            ("volume fraction of polymer", "0 to 1, and what χ allows without a network");
        Err(Error::Domain { quantity, value: fraction, allowed })
    }
}
