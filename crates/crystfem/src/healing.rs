//! Healing of interfaces between regions printed at different times.

use crate::error::Error;
use crate::kinetics::GAS_CONSTANT;

/// Degree of healing D_h = min(1, ∫ w dt/τ_r(T))^¼ of chains that cross an interface after contact (Yang and
/// Pitchumani 2002), with the melt fraction w = 1 − α of the colder side: crystals stop healing, and
/// remelting resumes it. Strength is D_h times and fracture energy D_h² times that of the material (de
/// Gennes, Wool).
///
/// The relaxation time is τ₀ at T₀. It follows Arrhenius in the melt, τ_r ∝ exp(H/(RT)), and, with a
/// [`Glass`], the Williams–Landel–Ferry equation from there down to the glass transition; no healing at or
/// below the transition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Healing {
    time: f64,
    temperature: f64,
    energy: f64,
    glass: Option<Glass>,
}

/// Glass transition with the WLF equation log₁₀ a_T = −C₁(T − T_g)/(C₂ + T − T_g) (Williams, Landel and Ferry
/// 1955).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glass {
    /// T_g, K.
    pub transition: f64,
    /// C₁.
    pub steepness: f64,
    /// C₂, K.
    pub width: f64,
}

/// Range above T_g, K, in which free volume controls the mobility of chains (Ferry 1980).
const FREE_VOLUME: f64 = 100.0;

impl Glass {
    /// Returns the universal constants C₁ = 17.44 and C₂ = 51.6 K, which fit most polymers; T_g in K.
    pub fn universal(transition: f64) -> Self {
        Self { transition, steepness: 17.44, width: 51.6 }
    }

    /// ln a_T.
    fn shift(&self, temperature: f64) -> f64 {
        let above = temperature - self.transition;
        -std::f64::consts::LN_10 * self.steepness * above / (self.width + above)
    }

    /// Temperature at which the apparent activation energy R T² ln 10 C₁C₂/(C₂ + T − T_g)² falls to `energy`,
    /// J/mol; at most T_g + 100 K.
    fn border(&self, energy: f64) -> f64 {
        let Self { transition, steepness, width } = *self;
        // √H (C₂ + T − T_g) = √(R ln 10 C₁C₂) T
        let own = (GAS_CONSTANT * std::f64::consts::LN_10 * steepness * width).sqrt();
        let slope = own - energy.sqrt();
        let most = transition + FREE_VOLUME;
        if slope >= 0.0 {
            most
        } else {
            ((width - transition) * energy.sqrt() / slope).clamp(transition, most)
        }
    }
}

impl Healing {
    /// Returns Arrhenius healing at any temperature, from τ₀, s, at T₀, K, and H, J/mol.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a time or a temperature that is not above 0, an energy below 0, and values
    /// that are not finite.
    pub fn new(time: f64, temperature: f64, energy: f64) -> Result<Self, Error> {
        positive(&[("relaxation time of healing, s", time), ("temperature of healing, K", temperature)])?;
        if !(energy >= 0.0 && energy.is_finite()) {
            let (name, allowed) = ("activation energy of healing, J/mol", "0 or above, finite".to_owned());
            return Err(Error::Parameter { name, found: energy, allowed });
        }
        Ok(Self { time, temperature, energy, glass: None })
    }

    /// Adds a glass transition.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a T_g that is not above 0 or not below T₀, and constants that are not above
    /// 0.
    pub fn with_glass(self, glass: Glass) -> Result<Self, Error> {
        let Glass { transition, steepness, width } = glass;
        let named = [("glass transition, K", transition), ("C1 of WLF", steepness), ("C2 of WLF, K", width)];
        positive(&named)?;
        if transition >= self.temperature {
            let allowed = format!("below {} K, where the relaxation time is given", self.temperature);
            return Err(Error::Parameter { name: "glass transition, K", found: transition, allowed });
        }
        Ok(Self { glass: Some(glass), ..self })
    }

    /// 1/τ_r, 1/s.
    pub fn rate(&self, temperature: f64) -> f64 {
        if self.glass.is_some_and(|glass| temperature <= glass.transition) {
            return 0.0;
        }
        (self.logarithm(self.temperature) - self.logarithm(temperature)).exp() / self.time
    }

    /// Describes the equations and their ranges.
    pub fn explain(&self) -> String {
        match self.glass {
            Some(glass) => format!(
                "Arrhenius above {:.1} °C, WLF below, none at and below T_g = {:.1} °C",
                glass.border(self.energy) - 273.15,
                glass.transition - 273.15
            ),
            None => "Arrhenius at any temperature".to_owned(),
        }
    }

    /// ln τ_r up to a constant.
    fn logarithm(&self, temperature: f64) -> f64 {
        let arrhenius = |temperature: f64| self.energy / (GAS_CONSTANT * temperature);
        match self.glass {
            Some(glass) => {
                let border = glass.border(self.energy);
                let below = temperature.min(border);
                arrhenius(temperature.max(border)) + glass.shift(below) - glass.shift(border)
            }
            None => arrhenius(temperature),
        }
    }

    /// Integrates ∫ w dt/τ_r over a step with temperatures, K, and melt fractions linear in time, by two
    /// Gauss points: fourth order in the step.
    pub fn progress(&self, temperatures: [f64; 2], melt: [f64; 2], duration: f64) -> f64 {
        let reach = 0.5 / 3.0_f64.sqrt();
        let at = |[from, to]: [f64; 2], share: f64| from + share * (to - from);
        let own = |share: f64| at(melt, share) * self.rate(at(temperatures, share));
        0.5 * duration * (own(0.5 - reach) + own(0.5 + reach))
    }

    /// Degree of healing D_h from the integral.
    pub fn degree(integral: f64) -> f64 {
        integral.clamp(0.0, 1.0).powf(0.25)
    }
}

fn positive(named: &[(&'static str, f64)]) -> Result<(), Error> {
    let allowed = "above 0, finite";
    match named.iter().find(|(_, found)| !(*found > 0.0 && found.is_finite())) {
        Some(&(name, found)) => Err(Error::Parameter { name, found, allowed: allowed.to_owned() }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinetics::{KineticConstants, Kinetics};
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

    /// Hold at 165 °C during crystallization: ∫(1 − α)dt/τ = Γ(1 + 1/n)/(Kτ).
    #[test]
    fn crystals_stop_healing() {
        let kinetics = Kinetics::new(KineticConstants::TABLE_4_1_COLUMN_1).unwrap();
        let healing = Healing::new(1000.0, 438.15, 60e3).unwrap();
        let (rate, steps) = (kinetics.rate(438.15), 4000);
        let dt = 4.0 / rate / steps as f64;
        let melt = |k: usize| kinetics.remainder(rate * dt * k as f64);
        let sum: f64 = (0..steps).map(|k| healing.progress([438.15; 2], [melt(k), melt(k + 1)], dt)).sum();
        near("healing: ∫(1 − α)dt/τ of a hold", sum, 0.443767419, 1e-6);
        near("healing: its degree, ended by crystals", Healing::degree(sum), 0.816185, 1e-6);
    }

    /// WLF slows healing by 10^6.63 from T_g + 100 K to T_g + 20 K, Arrhenius at 60 kJ/mol by 10^1.8.
    #[test]
    fn glass_transition_stops_healing() {
        let arrhenius = Healing::new(2.0, 453.15, 60e3).unwrap();
        let healing = arrhenius.with_glass(Glass::universal(318.15)).unwrap();
        let factor = |law: Healing| (law.rate(418.15) / law.rate(338.15)).log10();
        let wlf = 17.44 * (100.0 / 151.6 - 20.0 / 71.6);
        near("healing: WLF from T_g + 100 to T_g + 20 K", factor(healing), wlf, 1e-12);
        near("healing: Arrhenius from T_g + 100 to T_g + 20 K", factor(arrhenius), 1.78, 0.02);
        // equal in the melt and at T₀
        for temperature in [418.15, 440.0, 453.15, 500.0] {
            assert!((healing.rate(temperature) / arrhenius.rate(temperature) - 1.0).abs() < 1e-12);
        }
        assert_eq!([300.0, 318.15].map(|temperature| healing.rate(temperature)), [0.0; 2]);
        let rates: Vec<f64> = (319..500).map(|t| healing.rate(f64::from(t))).collect();
        assert!(rates.windows(2).all(|pair| pair[0] < pair[1]));
        // an energy above that of WLF at T_g + 100 K: value and slope are continuous at the border
        let stiff = Healing::new(2.0, 453.15, 200e3).unwrap().with_glass(Glass::universal(318.15)).unwrap();
        let border = Glass::universal(318.15).border(200e3);
        assert!(border > 318.15 && border < 418.15, "{border}");
        let slope = |at: f64| (stiff.logarithm(at + 1e-3) - stiff.logarithm(at - 1e-3)) / 2e-3;
        near(
            "healing: slope below over above the border",
            slope(border - 0.01) / slope(border + 0.01),
            1.0,
            1e-3,
        );
        assert!(arrhenius.with_glass(Glass::universal(460.0)).is_err());
        assert!(arrhenius.with_glass(Glass { width: 0.0, ..Glass::universal(318.15) }).is_err());
    }

    #[test]
    fn extremes() {
        assert_eq!([Healing::degree(0.0), Healing::degree(7.0), Healing::degree(-1e-30)], [0.0, 1.0, 0.0]);
        for wrong in [[0.0, 450.0, 6e4], [1.0, 0.0, 6e4], [1.0, 450.0, -1.0], [f64::NAN, 450.0, 6e4]] {
            assert!(Healing::new(wrong[0], wrong[1], wrong[2]).is_err(), "{wrong:?}");
        }
    }
}
