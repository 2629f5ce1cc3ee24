//! A material that is powder until it first melts.

use super::{PointInput, ThermalMaterial, ThermalResponse};
use crate::error::Error;

/// Names of states and fields, without and with those of a crystallizing solid.
const ALONE: &[&str] = &["consolidated"];
const STATES: &[&str] = &["z", "consolidated"];
const FIELDS: &[&str] = &["alpha", "crystallinity", "consolidated"];

/// Powder that consolidates when heated: the consolidated fraction p is the largest value reached by (T −
/// `from`)/(`to` − `from`), clamped to 0 … 1, and the conductivity is [φ + (1 − φ)p] times that of the solid.
/// Density and specific heat are those of the solid: settling of the bed is not modelled.
#[derive(Clone, Debug, PartialEq)]
pub struct Powder<M> {
    solid: M,
    /// φ, conductivity of powder over that of the solid.
    share: f64,
    /// Temperatures at which consolidation begins and ends, K.
    window: [f64; 2],
}

impl<M: ThermalMaterial> Powder<M> {
    /// Returns a powder of a solid, from the ratio of conductivities φ and the temperatures, K, at which
    /// consolidation begins and ends.
    ///
    /// # Errors
    /// [`Error::Parameter`] for φ outside (0, 1], and temperatures that are not above 0, increasing and
    /// finite.
    pub fn new(solid: M, share: f64, window: [f64; 2]) -> Result<Self, Error> {
        let refuse =
            |name, found, allowed: &str| Err(Error::Parameter { name, found, allowed: allowed.to_owned() });
        if !(share > 0.0 && share <= 1.0) {
            return refuse("conductivity of powder over that of the solid", share, "above 0, up to 1");
        }
        if !(window[0] > 0.0 && window[0].is_finite()) {
            return refuse(
                "temperature at which powder begins to consolidate, K",
                window[0],
                "above 0, finite",
            );
        }
        if !(window[1] > window[0] && window[1].is_finite()) {
            return refuse(
                "temperature at which powder is consolidated, K",
                window[1],
                "above that at which it begins",
            );
        }
        Ok(Self { solid, share, window })
    }

    /// Returns p and its slope over T, starting from `before`.
    fn consolidated(&self, temperature: f64, before: f64) -> [f64; 2] {
        let [from, to] = self.window;
        let now = ((temperature - from) / (to - from)).min(1.0);
        if now > before { [now, if now < 1.0 { 1.0 / (to - from) } else { 0.0 }] } else { [before, 0.0] }
    }

    /// Number of states of the solid.
    fn solid_states(&self) -> usize {
        self.solid.state_names().len()
    }
}

impl<M: ThermalMaterial> ThermalMaterial for Powder<M> {
    fn density(&self) -> f64 {
        self.solid.density()
    }

    fn state_names(&self) -> &'static [&'static str] {
        if self.solid_states() == 0 { ALONE } else { STATES }
    }

    fn initial_state(&self, temperature: f64, state: &mut [f64]) {
        let (own, last) = state.split_at_mut(self.solid_states());
        self.solid.initial_state(temperature, own);
        last[0] = self.consolidated(temperature, 0.0)[0];
    }

    fn field_names(&self) -> &'static [&'static str] {
        if self.solid_states() == 0 { ALONE } else { FIELDS }
    }

    fn fields(&self, state: &[f64], fields: &mut [f64]) {
        let (own, last) = state.split_at(self.solid_states());
        let count = fields.len() - 1;
        self.solid.fields(own, &mut fields[..count]);
        fields[count] = last[0];
    }

    fn crystallization_rate(&self, temperature: f64, state: &[f64]) -> f64 {
        self.solid.crystallization_rate(temperature, &state[..self.solid_states()])
    }

    fn energy(&self, temperature: f64, state: &[f64]) -> f64 {
        self.solid.energy(temperature, &state[..self.solid_states()])
    }

    fn is_linear(&self) -> bool {
        false
    }

    fn constant_conductivity(&self) -> bool {
        false
    }

    fn respond(&self, at: &PointInput, old: &[f64], new: &mut [f64]) -> Result<ThermalResponse, Error> {
        let own = self.solid_states();
        let response = self.solid.respond(at, &old[..own], &mut new[..own])?;
        let [part, slope] = self.consolidated(at.temperature + at.increment, old[own]);
        new[own] = part;
        let factor = self.share + (1.0 - self.share) * part;
        Ok(ThermalResponse {
            flux: factor * response.flux,
            d_flux_d_temperature: factor * response.d_flux_d_temperature
                + (1.0 - self.share) * slope * response.flux,
            d_flux_d_gradient: factor * response.d_flux_d_gradient,
            ..response
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{Conductor, Semicrystalline, ThermalProperty};
    use nalgebra::Vector3;

    fn powder() -> Powder<Conductor> {
        let solid =
            Conductor::new(1000.0, ThermalProperty::Constant(0.25), ThermalProperty::Constant(2000.0))
                .unwrap();
        Powder::new(solid, 0.4, [440.0, 450.0]).unwrap()
    }

    fn flux(from: f64, to: f64, before: f64) -> (ThermalResponse, f64) {
        let at = PointInput {
            temperature: from,
            increment: to - from,
            gradient: Vector3::new(8.0, 0.0, -4.0),
            dt: 1.0,
        };
        let mut after = [f64::NAN];
        (powder().respond(&at, &[before], &mut after).unwrap(), after[0])
    }

    #[test]
    fn powder_consolidates_once() {
        for (from, to, before, part) in [
            (300.0, 430.0, 0.0, 0.0),
            (430.0, 445.0, 0.0, 0.5),
            (445.0, 300.0, 0.5, 0.5),
            (300.0, 443.0, 0.5, 0.5),
            (443.0, 600.0, 0.5, 1.0),
            (600.0, 300.0, 1.0, 1.0),
        ] {
            let (response, after) = flux(from, to, before);
            assert!((after - part).abs() < 1e-12, "{from} {to}: {after}");
            let exact = -0.25 * (0.4 + 0.6 * part) * 8.0;
            assert!((response.flux[0] - exact).abs() < 1e-12, "{}", response.flux[0]);
            assert_eq!(response.flux[2], -0.5 * response.flux[0]);
            let h = 1e-4;
            let change = (flux(from, to + h, before).0.flux - flux(from, to - h, before).0.flux) / (2.0 * h);
            assert!((change - response.d_flux_d_temperature).norm() < 1e-9, "{change}");
        }
    }

    #[test]
    fn the_states_of_its_solid_are_first() {
        let material = Powder::new(Semicrystalline::pa12().unwrap(), 1.0 / 2.6, [440.0, 450.0]).unwrap();
        assert_eq!(material.state_names().len(), 2);
        let mut state = [f64::NAN; 2];
        material.initial_state(445.0, &mut state);
        let mut fields = [f64::NAN; 3];
        material.fields(&state, &mut fields);
        assert_eq!(fields, [0.0, 0.0, 0.5]);
        for wrong in
            [(0.0, [440.0, 450.0]), (1.1, [440.0, 450.0]), (0.5, [450.0, 450.0]), (0.5, [f64::NAN, 450.0])]
        {
            assert!(Powder::new(Semicrystalline::pa12().unwrap(), wrong.0, wrong.1).is_err(), "{wrong:?}");
        }
    }
}
