//! Time-temperature superposition.

/// Molar gas constant, J/(mol K), rounded as in the thesis, which gives activation energies with it.
const GAS_CONSTANT: f64 = 8.314;

/// Largest a_T by WLF.
const LARGEST: f64 = 1e12;

/// Shift ln a_T of relaxation times and viscosities with temperature.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Shift {
    /// Zero at all temperatures.
    #[default]
    None,
    /// −ln 10 · c₁(T − T_r)/(c₂ + T − T_r) above T_r (Williams, Landel and Ferry 1955); below, linear with
    /// the slope at T_r, up to a = 1e12.
    Wlf {
        /// Reference temperature T_r, K.
        reference: f64,
        /// Constants c₁ and c₂ (K).
        constants: [f64; 2],
    },
    /// Arrhenius, (H/R)(1/T − 1/T_r).
    Arrhenius {
        /// Reference temperature T_r, K.
        reference: f64,
        /// Activation energy H, J/mol.
        energy: f64,
    },
}

impl Shift {
    /// ln a_T at a temperature, K.
    pub fn logarithm(&self, temperature: f64) -> f64 {
        match *self {
            Self::None => 0.0,
            Self::Wlf { reference, constants: [first, second] } => {
                let above = temperature - reference;
                let slope = -first * std::f64::consts::LN_10;
                if above >= 0.0 {
                    slope * above / (second + above)
                } else {
                    (slope / second * above).min(LARGEST.ln())
                }
            }
            Self::Arrhenius { reference, energy } => {
                energy / GAS_CONSTANT * (1.0 / temperature - 1.0 / reference)
            }
        }
    }

    /// Finds a constant that is not positive and finite: its name and its value.
    pub fn invalid_constant(&self) -> Option<(&'static str, f64)> {
        let constants = match *self {
            Self::None => Vec::new(),
            Self::Wlf { reference, constants: [first, second] } => {
                vec![("reference of the shift, K", reference), ("C1 of WLF", first), ("C2 of WLF, K", second)]
            }
            Self::Arrhenius { reference, energy } => {
                vec![
                    ("reference of the shift, K", reference),
                    ("activation energy of the shift, J/mol", energy),
                ]
            }
        };
        constants.into_iter().find(|(_, value)| !(*value > 0.0 && value.is_finite()))
    }

    /// Temperature, K, below which ln a_T no longer grows.
    pub fn least_temperature(&self) -> f64 {
        match *self {
            Self::Wlf { reference, constants: [first, second] } => {
                reference - LARGEST.ln() / std::f64::consts::LN_10 * second / first
            }
            _ => 0.0,
        }
    }

    /// Reduced time ∫dt/a_T of a linear temperature history, by two Gauss points: fourth order in the step.
    pub fn reduced_time(&self, temperatures: [f64; 2], duration: f64) -> f64 {
        let middle = 0.5 * (temperatures[0] + temperatures[1]);
        let reach = 0.5 * (temperatures[1] - temperatures[0]) / 3.0_f64.sqrt();
        0.5 * duration * [-reach, reach].map(|at| (-self.logarithm(middle + at)).exp()).iter().sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 12 decades at 20 °C − 12 · 100 K/10.
    #[test]
    fn wlf_ends_at_twelve_decades() {
        let shift = Shift::Wlf { reference: 293.15, constants: [10.0, 100.0] };
        assert!((shift.least_temperature() - 173.15).abs() < 1e-9);
        assert!((shift.logarithm(173.15) - 1e12_f64.ln()).abs() < 1e-9 && shift.logarithm(180.0) < 27.5);
        assert_eq!(shift.invalid_constant(), None);
        let wrong = Shift::Wlf { reference: 293.15, constants: [10.0, -5.0] };
        assert_eq!(wrong.invalid_constant(), Some(("C2 of WLF, K", -5.0)));
    }
}
