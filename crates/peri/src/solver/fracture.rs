//! Broken and softened bonds of a state.

use crate::bonds::{Bonds, Softened};
use crate::error::Error;
use serde::{Deserialize, Serialize};

/// Bonds that broke together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BreakingEvent {
    /// Load step, from 0.
    pub step: usize,
    /// Number of bonds.
    pub bonds: u64,
    /// Hash of the bonds: two sets of bonds of one body have different ones.
    pub fingerprint: u64,
    /// Load of the equilibrium before, N, see [`StepRecord::load`](super::StepRecord::load); 0 in dynamics.
    pub load: f64,
}

/// Damage of a body and its energy.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Fracture {
    /// Intact bonds, once any has broken, see [`crate::bonds::BondDamage::intact`].
    pub(super) intact: Option<Vec<u64>>,
    /// Damaged bonds (integrity below 1).
    pub softened: Vec<Softened>,
    /// Bonds broken so far.
    pub broken: u64,
    /// Breaking events.
    pub events: Vec<BreakingEvent>,
    /// Particles that have lost all their bonds so far.
    pub detached: u64,
    /// Energy of broken bonds when they broke, plus that dissipated by softening, J.
    pub released: f64,
}

impl Fracture {
    /// Severs and softens the bonds of a body in its reference state to those of this state.
    ///
    /// # Errors
    /// [`Error::Geometry`] for another body.
    pub fn restore<const D: usize>(&self, bonds: &mut dyn Bonds<D>) -> Result<(), Error> {
        if let Some(words) = &self.intact
            && !bonds.restore(words)
        {
            let found = format!("a state of {} words of bonds, which is another body's", words.len());
            return Err(Error::geometry(found));
        }
        if !self.softened.is_empty() {
            bonds.soften(self.softened.clone());
        }
        Ok(())
    }
}
