//! The semicrystalline material of [`crystfem`] in other programs: `umatht_`, as Abaqus and CalculiX call it,
//! and `crystfem_respond` for C (`include/crystfem.h`).
//!
//! [`respond`] is the material: a pure function of constants, an increment and the state at its start. The
//! host keeps the state; an increment that it repeats or cuts back gets the same response.
//!
//! ```
//! use umatht::{HeatIncrement, NAMES, State, respond};
//!
//! // k, c, ΔH·X∞, column of Table 4.1; 1 s of cooling from 150 °C at 10 K/min
//! let constants = [0.25, 2200.0, 0.0, 1.0];
//! let (change, gradient) = (-10.0 / 60.0, [100.0, 0.0, 0.0]);
//! let at = HeatIncrement { temperature: 423.15, change, time: 1.0, gradient };
//! let answer = respond(&constants, &at, &State::default())?;
//! assert!(answer.state.degree > 0.0 && answer.flux[0] == -25.0);
//! assert_eq!(NAMES[3], "kinetics");
//! # Ok::<(), umatht::Error>(())
//! ```

mod constants;
mod file;
mod host;

pub use constants::{Error, NAMES};

use constants::HostMaterial;
use crystfem::material::{PointInput, ThermalMaterial};
use nalgebra::Vector3;

/// Increment at an integration point, in the units of the host: time in s, temperature from its own zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeatIncrement {
    /// Temperature at the start.
    pub temperature: f64,
    /// Change over the increment.
    pub change: f64,
    /// Time increment, s.
    pub time: f64,
    /// ∇T at the end.
    pub gradient: [f64; 3],
}

/// State variables (SDV), all 0 in fresh material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct State {
    /// z = \[−ln(1 − α)\]^{1/n}.
    pub z: f64,
    /// Relative crystallinity α, for plots.
    pub degree: f64,
    /// Absolute temperature at the end, K.
    pub temperature: f64,
}

/// Response of the material at the end of an increment.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct HeatResponse {
    /// State at the end.
    pub state: State,
    /// Change of internal energy per mass over the increment.
    pub energy: f64,
    /// ∂U/∂T with ∂α/∂T.
    pub slope: f64,
    /// Heat flux −k ∇T.
    pub flux: [f64; 3],
    /// ∂f/∂∇T row by row, with the sign that the host expects.
    pub conductivity: [f64; 9],
    /// Suggested ratio of the next increment to this one; 1 without a suggestion.
    pub step_ratio: f64,
}

/// Computes the response to an increment.
///
/// # Errors
/// [`Error`]: a constant out of range, a temperature that is not finite or below 0 K.
pub fn respond(constants: &[f64], at: &HeatIncrement, state: &State) -> Result<HeatResponse, Error> {
    constants::with_material(constants, |constants| answer(constants, at, state))?
}

fn answer(constants: &HostMaterial, at: &HeatIncrement, state: &State) -> Result<HeatResponse, Error> {
    let HostMaterial { material, absolute_zero, calculix } = constants;
    let end = at.temperature + at.change + absolute_zero;
    // CalculiX passes the last iterate for the temperature at the start
    let known = *calculix && state.temperature > 0.0;
    let start = if known { state.temperature } else { at.temperature + absolute_zero };
    for kelvin in [start, end] {
        if !(kelvin.is_finite() && kelvin > 0.0) {
            return Err(Error { name: "temperature, K", found: kelvin, allowed: "above 0".into() });
        }
    }
    let point =
        PointInput { temperature: start, increment: end - start, gradient: at.gradient.into(), dt: at.time };
    let (old, mut new) = ([state.z], [0.0]);
    let response = material.respond(&point, &old, &mut new)?;
    let mut fields = [0.0; 2];
    material.fields(&new, &mut fields);
    let sign = if *calculix { -1.0 } else { 1.0 };
    let mut conductivity = [0.0; 9];
    for (k, entry) in response.d_flux_d_gradient.transpose().iter().enumerate() {
        conductivity[k] = sign * entry;
    }
    let flux: Vector3<f64> = response.flux;
    Ok(HeatResponse {
        state: State { z: new[0], degree: fields[0], temperature: end },
        energy: response.energy - material.energy(start, &old),
        slope: response.d_energy_d_temperature,
        flux: flux.into(),
        conductivity,
        step_ratio: response.step_ratio.unwrap_or(1.0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(temperature: f64, change: f64) -> HeatIncrement {
        HeatIncrement { temperature, change, time: 1.0, gradient: [1.0, 2.0, 3.0] }
    }

    /// Constants with own kinetics: those of column 1, with a melting point of 500 K.
    const OWN: [f64; 15] = [
        0.25,
        2200.0,
        0.0,
        0.0,
        0.0,
        0.0,
        37_869.0,
        136_235.0,
        6270.0,
        193.2 + 273.15,
        21.0 + 273.15,
        2.678,
        0.965,
        8.584,
        500.0,
    ];

    /// Crystals melt at the temperature of their own constants: at 460 K those of PA12 are gone, others
    /// remain, or never melt.
    #[test]
    fn melting_belongs_to_the_constants() {
        let hot = HeatIncrement { gradient: [0.0; 3], ..at(440.0, 20.0) };
        let state = State { z: 2.0, ..State::default() };
        let degree = |constants: &[f64]| respond(constants, &hot, &state).unwrap().state.degree;
        let pa12 = degree(&[0.25, 2200.0, 0.0, 1.0]);
        assert!(pa12 < 1e-3, "{pa12}");
        assert!(degree(&OWN) > 0.99, "{}", degree(&OWN));
        let mut never = OWN;
        never[12..].fill(0.0);
        assert!(degree(&never) > 0.99);
        let mut as_pa12 = OWN;
        as_pa12[14] = 450.0;
        assert_eq!(degree(&as_pa12), pa12);
    }

    /// CalculiX' conventions: start from the state, sign of k in its conductivity, zero of the host's
    /// temperature.
    #[test]
    fn hosts_differ() {
        let celsius = [0.25, 2200.0, 52e3, 1.0, 273.15, 0.0];
        let state = State { z: 0.3, degree: 0.0, temperature: 420.0 };
        let abaqus = respond(&celsius[..4], &at(421.0, -1.0), &state).unwrap();
        assert_eq!(abaqus.state, respond(&celsius, &at(147.85, -1.0), &state).unwrap().state);
        let mut calculix = celsius;
        calculix[5] = 1.0;
        let other = respond(&calculix, &at(146.0, 0.85), &State { temperature: 421.0, ..state }).unwrap();
        assert!(
            (other.state.z - abaqus.state.z).abs() < 1e-12 && (other.state.temperature - 420.0).abs() < 1e-9
        );
        assert_eq!((abaqus.conductivity[0], other.conductivity[0]), (-0.25, 0.25));
        assert_eq!(abaqus.flux, [-0.25, -0.5, -0.75]);
    }

    /// ∂U/∂T by central differences, with latent heat; an instantaneous round trip has no energy.
    #[test]
    fn slope_is_the_derivative() {
        let constants = [0.25, 2200.0, 52e3, 2.0];
        let state = State { z: 0.5, ..State::default() };
        let energy = |change: f64| respond(&constants, &at(430.0, change), &state).unwrap();
        let slope = (energy(-9.99).energy - energy(-10.01).energy) / 0.02;
        assert!((slope / energy(-10.0).slope - 1.0).abs() < 1e-5, "{slope}");
        let still = respond(&constants, &HeatIncrement { time: 0.0, ..at(430.0, 0.0) }, &state).unwrap();
        assert_eq!((still.energy, still.state.z), (0.0, 0.5));
    }

    #[test]
    fn wrong_numbers_are_named() {
        let good = [0.25, 2200.0, 0.0, 1.0];
        for (place, wrong) in [(0, -1.0), (1, f64::NAN), (2, -1.0), (3, 3.0), (3, 0.0)] {
            let mut constants = good;
            constants[place] = wrong;
            let text = respond(&constants, &at(400.0, 0.0), &State::default()).unwrap_err().to_string();
            assert!(text.contains("allowed"), "{text}");
        }
        assert!(respond(&good[..3], &at(400.0, 0.0), &State::default()).is_err());
        let text = respond(&OWN[..12], &at(400.0, 0.0), &State::default()).unwrap_err().to_string();
        assert!(text.contains("melting"), "{text}");
        assert!(respond(&good, &at(f64::NAN, 0.0), &State::default()).is_err());
        assert!(respond(&good, &at(-1.0, 0.0), &State::default()).is_err());
    }
}
