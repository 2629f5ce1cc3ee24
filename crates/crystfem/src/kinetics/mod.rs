//! Crystallization from the melt: Nakamura's theory with the rate of Hoffman and Lauritzen, integrated in z.
//!
//! With z = \[−ln(1−α)\]^{1/n} the rate equation (4.5) becomes dz/dt = K(T), a quadrature. It is stable for
//! any step, α = 0 is not a fixed point, and α = 1 − exp(−zⁿ) stays within \[0, 1\]. z keeps the digits of
//! both ends: α → 0 as zⁿ, 1 − α as exp(−zⁿ).

mod exact;
mod growth;
mod scheme;

pub use exact::{CoolingCurve, avrami, cooling_curve};
pub use growth::{Growth, PANELS, Panels};
pub use scheme::KineticScheme;

use crate::error::Error;
use polycore::numerics::bisected;

/// Universal gas constant R as rounded in the thesis, J/(mol K).
pub const GAS_CONSTANT: f64 = 8.314;

/// Constants of Eqs (4.6) and (4.7), SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KineticConstants {
    /// Growth rate constant K₀, 1/s.
    pub growth_rate: f64,
    /// Nucleation constant K_G, K².
    pub nucleation: f64,
    /// Activation energy for jumps of chain segments U, J/mol.
    pub activation_energy: f64,
    /// Equilibrium melting temperature T₀, K, at which the undercooling is zero; also the T₀ of (T + T₀).
    pub equilibrium_melting: f64,
    /// Temperature T∞ at which chain motion ceases, about 30 K below the glass transition, K.
    pub frozen: f64,
    /// Avrami exponent n.
    pub avrami_exponent: f64,
}

impl KineticConstants {
    /// Table 4.1, column 1: PA12 after its reference \[108\] (Zhao et al.).
    pub const TABLE_4_1_COLUMN_1: Self = Self {
        growth_rate: 37_869.0,
        nucleation: 136_235.0,
        activation_energy: 6270.0,
        equilibrium_melting: 193.2 + 273.15,
        frozen: 21.0 + 273.15,
        avrami_exponent: 2.678,
    };
    /// Table 4.1, column 2: PA12 after its reference \[1\] (Amado et al.).
    pub const TABLE_4_1_COLUMN_2: Self = Self {
        growth_rate: 55_600.0,
        nucleation: 140_866.0,
        activation_energy: 6270.0,
        equilibrium_melting: 192.4 + 273.15,
        frozen: 21.0 + 273.15,
        avrami_exponent: 2.618,
    };
    /// Appendix B, which rounds the temperatures of column 1 (with 0 °C = 273 K).
    pub const APPENDIX_B: Self = Self {
        growth_rate: 37_870.0,
        nucleation: 136_235.0,
        activation_energy: 6270.0,
        equilibrium_melting: 466.0,
        frozen: 294.0,
        avrami_exponent: 2.678,
    };
}

/// Largest z: its n-th power stays finite, and 1 − α has long underflowed to 0.
const LARGEST_Z: f64 = 1e30;

/// Rate K(T) of a polymer, Eqs (4.6) and (4.7), and the relation of α and z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kinetics {
    constants: KineticConstants,
    /// K₀ (ln 2)^{1/n}.
    prefactor: f64,
    /// U/R.
    activation: f64,
}

impl Kinetics {
    /// Builds the kinetics from constants.
    ///
    /// # Errors
    /// [`Error::Parameter`] for K₀ or K_G ≤ 0, U < 0, T∞ < 0 K, T₀ ≤ T∞, n outside \[1, 10\] (below 1 the
    /// rate dα/dt would be infinite at α = 0), and values that are not finite.
    pub fn new(constants: KineticConstants) -> Result<Self, Error> {
        let KineticConstants {
            growth_rate,
            nucleation,
            activation_energy,
            equilibrium_melting,
            frozen,
            avrami_exponent,
        } = constants;
        let check = |name, found: f64, good: bool, allowed: &str| {
            if good && found.is_finite() {
                Ok(())
            } else {
                Err(Error::Parameter { name, found, allowed: allowed.to_owned() })
            }
        };
        check("growth rate constant K0, 1/s", growth_rate, growth_rate > 0.0, "above 0")?;
        check("nucleation constant K_G, K²", nucleation, nucleation > 0.0, "above 0")?;
        check("activation energy U, J/mol", activation_energy, activation_energy >= 0.0, "0 or above")?;
        check("temperature of frozen chains, K", frozen, frozen >= 0.0, "0 or above")?;
        let above = format!("above the temperature of frozen chains, {frozen} K");
        check(
            "equilibrium melting temperature, K",
            equilibrium_melting,
            equilibrium_melting > frozen,
            &above,
        )?;
        let fits = (1.0..=10.0).contains(&avrami_exponent);
        check("Avrami exponent n", avrami_exponent, fits, "1 to 10")?;
        Ok(Self {
            constants,
            prefactor: growth_rate * std::f64::consts::LN_2.powf(avrami_exponent.recip()),
            activation: activation_energy / GAS_CONSTANT,
        })
    }

    /// Constants.
    pub fn constants(&self) -> &KineticConstants {
        &self.constants
    }

    /// Rate K(T), 1/s, Eqs (4.6) and (4.7); tends smoothly to 0 at T∞ and T₀ and is 0 outside:
    /// K(T) = (ln 2)^{1/n} K₀ exp(−U/(R(T−T∞))) exp(−K_G(T+T₀)/(2T²(T₀−T))).
    #[inline]
    pub fn rate(&self, temperature: f64) -> f64 {
        let KineticConstants { nucleation, equilibrium_melting, frozen, .. } = self.constants;
        if !(temperature > frozen && temperature < equilibrium_melting) {
            return 0.0;
        }
        let barrier = nucleation * (temperature + equilibrium_melting)
            / (2.0 * temperature * temperature * (equilibrium_melting - temperature));
        self.prefactor * (-self.activation / (temperature - frozen) - barrier).exp()
    }

    /// K(T) and dK/dT, 1/s and 1/(s K).
    pub fn rate_and_slope(&self, temperature: f64) -> [f64; 2] {
        let rate = self.rate(temperature);
        if rate == 0.0 {
            return [0.0; 2];
        }
        [rate, rate * self.logarithmic_slope(temperature)]
    }

    /// d ln K/dT within (T∞, T₀).
    fn logarithmic_slope(&self, temperature: f64) -> f64 {
        let KineticConstants { nucleation, equilibrium_melting, frozen, .. } = self.constants;
        let (above, below) = (temperature - frozen, equilibrium_melting - temperature);
        let barrier =
            nucleation * (temperature + equilibrium_melting) / (2.0 * temperature * temperature * below);
        let change = (temperature + equilibrium_melting).recip() - 2.0 / temperature + below.recip();
        self.activation / (above * above) - barrier * change
    }

    /// Half time of isothermal crystallization t_½ = (ln 2)^{1/n}/K, s, Eq. (4.6); infinite outside (T∞, T₀).
    pub fn half_time(&self, temperature: f64) -> f64 {
        std::f64::consts::LN_2.powf(self.constants.avrami_exponent.recip()) / self.rate(temperature)
    }

    /// Temperature of fastest crystallization, K, and its K(T), 1/s.
    pub fn fastest(&self) -> [f64; 2] {
        let (low, high) = (self.constants.frozen, self.constants.equilibrium_melting);
        // d ln K/dT tends to +∞ at T∞ and to −∞ at T₀
        let temperature = bisected(low, high, 200, |t| self.logarithmic_slope(t) > 0.0);
        [temperature, self.rate(temperature)]
    }

    /// α = 1 − exp(−zⁿ).
    pub fn degree(&self, z: f64) -> f64 {
        -(-self.power(z)).exp_m1()
    }

    /// 1 − α = exp(−zⁿ), to full relative precision.
    pub fn remainder(&self, z: f64) -> f64 {
        (-self.power(z)).exp()
    }

    /// z from a relative crystallinity α in \[0, 1\]; near α = 1, [`Kinetics::z_of_remainder`] keeps digits.
    pub fn z_of_degree(&self, degree: f64) -> f64 {
        self.root(-(-degree).ln_1p())
    }

    /// z from 1 − α in \[0, 1\].
    pub fn z_of_remainder(&self, remainder: f64) -> f64 {
        self.root(-remainder.ln())
    }

    /// dα/dz = n z^{n−1} exp(−zⁿ).
    pub fn degree_slope(&self, z: f64) -> f64 {
        self.degree_and_slope(z)[1]
    }

    /// α and dα/dz, at the cost of one power and one exponential.
    #[inline]
    pub fn degree_and_slope(&self, z: f64) -> [f64; 2] {
        let extent = self.extent(z);
        let n = self.constants.avrami_exponent;
        let slope = if z > 0.0 {
            n * (extent.power / z) * extent.remainder
        } else {
            // n z^{n−1} at 0
            f64::from(u8::from(n == 1.0))
        };
        [extent.degree, slope]
    }

    /// zⁿ with α and 1 − α, both to full relative precision.
    #[inline]
    pub(crate) fn extent(&self, z: f64) -> Extent {
        let power = self.power(z);
        let degree = -(-power).exp_m1();
        let remainder = if power < 0.5 { 1.0 - degree } else { (-power).exp() };
        Extent { power, degree, remainder }
    }

    /// d ln α/dz = n z^{n−1}/(exp(zⁿ) − 1), for z > 0.
    #[inline]
    pub(crate) fn logarithmic_slope_of(&self, z: f64, extent: &Extent) -> f64 {
        self.constants.avrami_exponent * (extent.power / z) * (extent.remainder / extent.degree)
    }

    /// z from zⁿ.
    #[inline]
    pub(crate) fn z_of_power(&self, power: f64) -> f64 {
        self.root(power)
    }

    /// dα/dt = n K (1−α) \[ln 1/(1−α)\]^{(n−1)/n}, 1/s, Eq. (4.5), as printed, without guard: NaN beyond α =
    /// 1.
    pub fn degree_rate(&self, temperature: f64, degree: f64) -> f64 {
        let n = self.constants.avrami_exponent;
        n * self.rate(temperature) * (1.0 - degree) * (-(-degree).ln_1p()).powf((n - 1.0) / n)
    }

    #[inline]
    fn power(&self, z: f64) -> f64 {
        z.powf(self.constants.avrami_exponent)
    }

    #[inline]
    fn root(&self, power: f64) -> f64 {
        power.max(0.0).powf(self.constants.avrami_exponent.recip()).min(LARGEST_Z)
    }
}

/// zⁿ, α = 1 − exp(−zⁿ) and 1 − α.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Extent {
    pub power: f64,
    pub degree: f64,
    pub remainder: f64,
}

#[cfg(test)]
mod tests;
