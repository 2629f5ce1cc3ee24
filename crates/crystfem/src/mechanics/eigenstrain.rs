//! Free strain of a crystallizing polymer as a function of its state.

/// Specific volume v = (1 − X) v_a + X v_c, X = X∞ α, of crystals and an amorphous phase with a glass
/// transition:
///
/// ln v_a = −ln ρ_a + γ_g (min(T, T_g) − T_r) + γ_l max(T − T_g, 0), ln v_c = −ln ρ_c + γ_c (T − T_r).
///
/// Thermal expansion and shrinkage by crystallization are one state function: nothing drifts over cycles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpecificVolume {
    /// Densities ρ_a and ρ_c at T_r, kg/m³.
    pub densities: [f64; 2],
    /// Glass transition T_g, K.
    pub glass_transition: f64,
    /// Reference temperature T_r, K.
    pub reference: f64,
    /// Volumetric expansion γ_g and γ_l of the amorphous phase below and above T_g, and γ_c of the crystals,
    /// 1/K.
    pub expansions: [f64; 3],
    /// Mass fraction X∞ of crystals at α = 1.
    pub crystallinity: f64,
}

impl SpecificVolume {
    /// PA12: ρ_c of the γ cell (Inoue and Hoshino 1973 gives 1034 kg/m³), ρ_a = 990 kg/m³ from the
    /// literature, expansions assumed.
    pub const PA12: Self = Self {
        densities: [990.0, 1034.0],
        glass_transition: 324.0,
        reference: 298.15,
        expansions: [3.3e-4, 6.6e-4, 2.5e-4],
        crystallinity: 0.25,
    };

    /// ln v at a temperature, K, and a degree α, v in m³/kg.
    pub fn logarithm(&self, temperature: f64, degree: f64) -> f64 {
        let Self { densities: [amorphous, crystal], expansions: [glass, melt, crystals], .. } = *self;
        let above = (temperature - self.glass_transition).max(0.0);
        let below = temperature.min(self.glass_transition) - self.reference;
        let log_amorphous = -amorphous.ln() + glass * below + melt * above;
        let log_crystal = -crystal.ln() + crystals * (temperature - self.reference);
        let share = self.crystallinity * degree;
        // the difference is small: strains keep their digits
        log_amorphous + (share * (log_crystal - log_amorphous).exp_m1()).ln_1p()
    }

    /// Linear free strain ⅓ ln(v₂/v₁) from one (T, α) to another.
    pub fn strain(&self, from: [f64; 2], to: [f64; 2]) -> f64 {
        (self.logarithm(to[0], to[1]) - self.logarithm(from[0], from[1])) / 3.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use evidence::near;

    /// PA12 agrees with `docs/reference/print/pa12.py`: expansion coefficients, crystallization at 160 °C,
    /// melt to room temperature.
    #[test]
    fn pa12_shrinks_as_it_should() {
        let volume = SpecificVolume::PA12;
        let kelvin = |celsius: f64| celsius + 273.15;
        let expansion = |celsius: f64| {
            let at = |shift: f64| [kelvin(celsius) + shift, 1.0];
            volume.strain(at(-1e-3), at(1e-3)) / 2e-3
        };
        near("print_expansion_25", expansion(25.0), 1.035e-4, 1e-7);
        near("print_expansion_60", expansion(60.0), 1.87e-4, 1e-6);
        near("print_crystallization_160", volume.strain([433.15, 0.0], [433.15, 1.0]), -7.274_398e-3, 1e-9);
        near("print_melt_to_room", volume.strain([453.15, 0.0], [298.15, 1.0]), -3.482_16e-2, 1e-7);
        // a state function: a cycle leaves no strain
        let states = [[453.15, 0.0], [433.15, 0.4], [300.0, 0.9], [440.0, 1.0], [453.15, 0.0]];
        let sum: f64 = states.windows(2).map(|pair| volume.strain(pair[0], pair[1])).sum();
        assert!(sum.abs() < 1e-16, "{sum}");
    }
}
