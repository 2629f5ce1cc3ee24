//! Healing of interfaces between what was printed at different times.

use crate::error::Error;
use crate::kinetics::GAS_CONSTANT;

/// Degree of healing D_h = min(1, ∫ w dt/τ_r(T))^¼ of chains that cross an interface from contact on (Yang and Pitchumani 2002), with the relaxation time
/// τ_r = τ₀ exp[(H/R)(1/T − 1/T₀)] and the melt's share w = 1 − α of the colder side: crystals stop it, remelting lets it go on. Strength is
/// D_h times, fracture energy D_h² times that of the material (de Gennes, Wool).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Healing {
    time: f64,
    temperature: f64,
    energy: f64,
}

impl Healing {
    /// τ₀, s, at T₀, K, and H, J/mol.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a time or a temperature that is not above 0, an energy below 0, and what is not finite.
    pub fn new(time: f64, temperature: f64, energy: f64) -> Result<Self, Error> {
        for (name, found, good, allowed) in [
            ("relaxation time of healing, s", time, time > 0.0, "above 0, finite"),
            ("temperature of healing, K", temperature, temperature > 0.0, "above 0, finite"),
            ("activation energy of healing, J/mol", energy, energy >= 0.0, "0 or above, finite"),
        ] {
            if !(good && found.is_finite()) {
                return Err(Error::Parameter { name, found, allowed: allowed.to_owned() });
            }
        }
        Ok(Self { time, temperature, energy })
    }

    /// 1/τ_r, 1/s.
    pub fn rate(&self, temperature: f64) -> f64 {
        let exponent = self.energy / GAS_CONSTANT * (1.0 / temperature - 1.0 / self.temperature);
        (-exponent).exp() / self.time
    }

    /// ∫ w dt/τ_r over a step of temperatures, K, and melt's shares that are linear in time, by two points of Gauss: fourth order in the step.
    pub fn progress(&self, temperatures: [f64; 2], melt: [f64; 2], duration: f64) -> f64 {
        let reach = 0.5 / 3.0_f64.sqrt();
        let at = |[from, to]: [f64; 2], share: f64| from + share * (to - from);
        let own = |share: f64| at(melt, share) * self.rate(at(temperatures, share));
        0.5 * duration * (own(0.5 - reach) + own(0.5 + reach))
    }

    /// D_h of an integral.
    pub fn degree(integral: f64) -> f64 {
        integral.clamp(0.0, 1.0).powf(0.25)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinetics::{Constants, Kinetics};
    use evidence::near;

    /// 190 to 130 °C at 40 K/s, 2 s at 180 °C, 60 kJ/mol, no crystals.
    #[test]
    fn a_contact_cools() {
        let healing = Healing::new(2.0, 453.15, 60e3).unwrap();
        let steps = 100;
        let at = |k: usize| 463.15 - 60.0 * k as f64 / steps as f64;
        let dt = 60.0 / 40.0 / steps as f64;
        let sum: f64 = (0..steps).map(|k| healing.progress([at(k), at(k + 1)], [1.0; 2], dt)).sum();
        near("healing: ∫dt/τ of a contact that cools", sum, 0.431868214, 1e-9);
        near("healing: its degree", Healing::degree(sum), 0.810658256, 1e-9);
        let error = |steps: u32| {
            let at = |k: u32| 463.15 - 60.0 * f64::from(k) / f64::from(steps);
            let step = |k| healing.progress([at(k), at(k + 1)], [1.0; 2], 1.5 / f64::from(steps));
            (0..steps).map(step).sum::<f64>() - sum
        };
        near("healing: order of its steps", (error(2) / error(4)).log2(), 4.0, 0.1);
    }

    /// A hold at 165 °C while it crystallizes: ∫(1 − α)dt/τ = Γ(1 + 1/n)/(Kτ).
    #[test]
    fn crystals_end_it() {
        let kinetics = Kinetics::new(Constants::TABLE_4_1_COLUMN_1).unwrap();
        let healing = Healing::new(1000.0, 438.15, 60e3).unwrap();
        let (rate, steps) = (kinetics.rate(438.15), 4000);
        let dt = 4.0 / rate / steps as f64;
        let melt = |k: usize| kinetics.remainder(rate * dt * k as f64);
        let sum: f64 = (0..steps).map(|k| healing.progress([438.15; 2], [melt(k), melt(k + 1)], dt)).sum();
        near("healing: ∫(1 − α)dt/τ of a hold", sum, 0.443767419, 1e-6);
        near("healing: its degree, ended by crystals", Healing::degree(sum), 0.816185, 1e-6);
    }

    #[test]
    fn extremes() {
        assert_eq!([Healing::degree(0.0), Healing::degree(7.0), Healing::degree(-1e-30)], [0.0, 1.0, 0.0]);
        for wrong in [[0.0, 450.0, 6e4], [1.0, 0.0, 6e4], [1.0, 450.0, -1.0], [f64::NAN, 450.0, 6e4]] {
            assert!(Healing::new(wrong[0], wrong[1], wrong[2]).is_err(), "{wrong:?}");
        }
    }
}
