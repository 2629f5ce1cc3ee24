//! Growth and melting of crystals at a point, over an increment.

use crate::kinetics::{Extent, Kinetics, PANELS, Panels};
use crate::melting::Melting;

/// Number of panels of (T∞, T₀) on heating, where growth and melting alternate; 1.35 K each for PA12.
pub(super) const HEATING_PANELS: usize = 4 * PANELS;

/// ln of the melted fraction's complement above which melting is negligible.
pub(super) const NEGLIGIBLE_MELTING: f64 = -1e-17;

/// Smallest z that can melt: quotients of smaller numbers overflow.
pub(super) const SMALLEST_MELTING_Z: f64 = 1e-280;

/// Kinetics and melting: dz/dt = K(T) at every temperature; on heating α falls in proportion to 1 − X_m(T).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crystallization {
    /// Growth.
    pub kinetics: Kinetics,
    /// Melting; `None` if crystals never melt.
    pub melting: Option<Melting>,
}

/// z at the end of an increment, and its derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grown {
    /// z = \[−ln(1−α)\]^{1/n}.
    pub z: f64,
    /// ∂z/∂T at the end of the increment, at fixed Δt, 1/K.
    pub slope: f64,
}

impl Crystallization {
    /// Advances z over an increment with the temperature linear from `start` to `end`, K, in the time `dt`,
    /// s.
    ///
    /// On cooling and at a hold z grows by ∫K dt. On heating each panel of temperature takes half of its
    /// growth, then α ← α (1−X_m(T₂))/(1−X_m(T₁)), then the other half: z and α stay within their bounds for
    /// any increment, and the result is a continuous function of the end temperature.
    pub fn advance(&self, z: f64, start: f64, end: f64, dt: f64) -> Grown {
        let kinetics = &self.kinetics;
        let melting = match &self.melting {
            Some(melting) if end > start && melting.survival(end)[0] < NEGLIGIBLE_MELTING => melting,
            _ => {
                let growth = kinetics.growth(start, end, dt);
                return Grown { z: z + growth.z, slope: growth.slope };
            }
        };
        let mut grown = Grown { z, slope: 0.0 };
        if z == 0.0 && start >= kinetics.constants().equilibrium_melting {
            return grown;
        }
        let [mut before, _] = melting.survival(start);
        // no growth in a jump, and the melting of all panels is their product
        let panels = if dt == 0.0 { 1 } else { HEATING_PANELS };
        for panel in Panels::new(kinetics, start, end, panels) {
            let growth = kinetics.growth_over(&panel, dt);
            grown.z += 0.5 * growth.z;
            grown.slope += 0.5 * growth.slope;
            let [after, slope] = melting.survival(panel.end);
            grown = self.melt(grown, after - before, if panel.last { slope } else { 0.0 });
            before = after;
            grown.z += 0.5 * growth.z;
            grown.slope += 0.5 * growth.slope;
        }
        grown
    }

    /// Melts α ← α e^L, near α = 1 through 1 − α, so that no digits are lost.
    pub(super) fn melt(&self, grown: Grown, logarithm: f64, slope: f64) -> Grown {
        let kinetics = &self.kinetics;
        let Grown { z, slope: z_slope } = grown;
        if z == 0.0 || logarithm > NEGLIGIBLE_MELTING {
            return grown;
        }
        let before = kinetics.extent(z);
        let (survivors, lost) = (logarithm.exp(), -logarithm.exp_m1());
        let degree = before.degree * survivors;
        let remainder = lost + survivors * before.remainder;
        let power = if degree < 0.5 { -(-degree).ln_1p() } else { -remainder.ln() };
        let z_after = kinetics.z_of_power(power);
        if degree < SMALLEST_MELTING_Z {
            return Grown { z: 0.0, slope: 0.0 };
        }
        let after = Extent { power, degree, remainder };
        let change = kinetics.logarithmic_slope_of(z, &before) * z_slope + slope;
        let sensitivity = kinetics.logarithmic_slope_of(z_after, &after);
        Grown { z: z_after, slope: if sensitivity > 0.0 { change / sensitivity } else { 0.0 } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinetics::KineticConstants;

    /// A jump equals the sequence of smaller jumps.
    #[test]
    fn jumps_follow_each_other() {
        let kinetics = Kinetics::new(KineticConstants::TABLE_4_1_COLUMN_1).unwrap();
        let law = Crystallization { kinetics, melting: Some(Melting::PA12) };
        for z in [1e-6, 0.3, 1.2, 3.0] {
            let to = |z: f64, start: f64, end: f64| law.advance(z, start, end, 0.0).z;
            for end in [350.0, 430.0, 451.0, 465.0, 480.0] {
                let parts = (0..100).fold(z, |z, k| {
                    let at = |k: i32| 300.0 + 0.01 * f64::from(k) * (end - 300.0);
                    to(z, at(k), at(k + 1))
                });
                let whole = to(z, 300.0, end);
                // a hundred roundings of L, times the slope of ln z, below 1e3 where 1 − α = 5e-9
                assert!((parts - whole).abs() <= 1e-11 * whole, "{z} {end}: {parts:e} {whole:e}");
            }
            assert_eq!(to(z, 480.0, 300.0), z);
        }
    }
}
