//! Scalars of breaking: critical stretch or energy, fragments, dissipated energy over the area of new cracks.

use super::moment::Moment;
use crate::error::Error;
use crate::program::quantities as q;
use crate::program::scene::Scene;
use crate::solver::Criterion;
use harness::observe::{Fields, Observer, Place, Scalars};

/// Returns true if bonds break by their energy.
fn breaks_by_energy(scene: &Scene) -> bool {
    let energy = scene.limits().next().is_some_and(|limit| limit.fracture_energy.is_some());
    scene.material.solid.is_some() && energy
}

/// Adds the critical stretch or energy, and fragments.
pub(super) fn breaking<const D: usize>(scene: &Scene, to: &mut Scalars<Moment<D>>) {
    if !scene.breaks() {
        return;
    }
    if breaks_by_energy(scene) {
        to.add_if(q::CRITICAL_ENERGY, |m| match m.physics.body.criterion.as_ref()? {
            Criterion::Stretch(_) => None,
            energy => Some(energy.least()),
        });
    } else {
        to.add_if(q::CRITICAL_STRETCH, |m| m.physics.body.criterion.as_ref().map(Criterion::least_stretch));
    }
    to.add(q::FRAGMENTS, |m| m.fragments().len() as f64);
    to.add(q::LARGEST_FRAGMENT, |m| {
        let volume: f64 = m.sites().map(|site| m.bonds.volume(site)).sum();
        m.fragments().first().map_or(0.0, |largest| largest.volume / volume)
    });
}

/// Adds the broken share of each interface.
pub(super) fn interfaces<const D: usize>(scene: &Scene, to: &mut Scalars<Moment<D>>) {
    for (index, interface) in scene.interface.iter().enumerate() {
        to.add_if(q::BROKEN_ACROSS.named(&[&interface.name()]), |m| {
            let across = m.physics.body.interfaces.get(index)?;
            let intact = |bond: &&[u32; 2]| m.bonds.is_bonded(bond[0] as usize, bond[1] as usize);
            Some(1.0 - across.iter().filter(intact).count() as f64 / across.len() as f64)
        });
    }
}

/// Adds the damage if there are cracks or bonds break.
pub(super) fn damage_field<const D: usize>(scene: &Scene, to: &mut Fields<Moment<D>>) {
    if scene.breaks() || !scene.body.cracks.is_empty() {
        to.add("damage", 1, Place::Points, |m| m.damage().unwrap_or_default());
    }
}

/// Observer of new cracks: their area, the dissipated energy over it, and its ratio to the tearing energy of
/// the body.
pub(super) struct NewCracks<'s> {
    scene: &'s Scene,
    /// Area, m², and dissipated energy over it, J/m².
    found: Option<[f64; 2]>,
}

impl<'s> NewCracks<'s> {
    pub(super) fn new(scene: &'s Scene) -> Self {
        Self { scene, found: None }
    }
}

impl<'m, const D: usize> Observer<Moment<'m, D>, Error> for NewCracks<'_> {
    fn scalars(&self, to: &mut Scalars<Moment<'m, D>>) {
        if !self.scene.breaks() {
            return;
        }
        let tears = self.scene.material.solid.is_none() || breaks_by_energy(self.scene);
        if tears {
            to.add_if(q::TEARING_ENERGY, |m| m.physics.tearing);
        }
        to.add_if(q::NEW_CRACK_AREA, |_| self.found.map(|[area, _]| area));
        to.add_if(q::DISSIPATED_PER_AREA, |_| self.found.map(|[_, spent]| spent));
        if tears {
            to.add_if(q::DISSIPATION_BIAS, |m| Some(self.found?[1] / m.physics.tearing? - 1.0));
        }
    }

    fn end(&mut self, m: &Moment<'m, D>) -> Result<(), Error> {
        let last = m.state.history.last().filter(|last| last.broken > 0);
        if let Some((last, cracks)) = last.zip(m.physics.cracks.as_ref()) {
            let area = cracks.area(m.bonds);
            let spent = (last.work - last.stored - last.kinetic - last.rubbed - last.dissipated) / area;
            self.found = (area > 0.0 && area.is_finite()).then_some([area, spent]);
        }
        Ok(())
    }
}
