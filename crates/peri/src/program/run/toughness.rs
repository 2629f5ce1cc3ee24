//! Energy that new cracks take, over their area.

use super::outcome::Outcome;
use crate::bonds::Bonds;
use crate::critical::{CrackArea, Crossing, Toughness};
use crate::program::quantities as q;
use crate::program::scene::Scene;

/// The body before it is loaded, and what its cracks should take.
pub struct NewCrack {
    area: CrackArea,
    /// Energy at which a crack runs, J/m²; none of a solid with a critical stretch.
    tearing: Option<f64>,
}

impl NewCrack {
    pub fn new<const D: usize>(scene: &Scene, bonds: &dyn Bonds<D>, toughness: Option<&Toughness>) -> Self {
        let given = scene.material.critical.and_then(|critical| critical.fracture_energy);
        let tearing = toughness.map(|own| own.tearing).or(given.map(|energy| energy.si()));
        let crossing = toughness.map_or_else(|| Crossing::new(bonds, None), |own| own.crossing);
        Self { area: CrackArea::new(bonds, &crossing), tearing }
    }

    /// Area, dissipated energy over it, and that over the tearing energy of the body without its inclusions.
    pub fn values<const D: usize>(&self, bonds: &dyn Bonds<D>, outcome: &mut Outcome) {
        if let Some(tearing) = self.tearing {
            outcome.value(q::TEARING_ENERGY, tearing);
        }
        let Some(last) = outcome.history.last().filter(|last| last.broken > 0).cloned() else { return };
        let area = self.area.of(bonds);
        if !(area > 0.0 && area.is_finite()) {
            return;
        }
        let spent = (last.work - last.stored - last.kinetic - last.rubbed) / area;
        outcome.value(q::NEW_CRACK_AREA, area);
        outcome.value(q::DISSIPATED_PER_AREA, spent);
        if let Some(tearing) = self.tearing {
            outcome.value(q::DISSIPATION_BIAS, spent / tearing - 1.0);
        }
    }
}
