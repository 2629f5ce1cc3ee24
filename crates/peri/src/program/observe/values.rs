//! Scalars of every run: stretches, fit error, reactions, the largest displacement, motion, fields of other
//! scenes.

use super::moment::Moment;
use crate::bonds::covered_stretches;
use crate::calibrate::Space;
use crate::error::Error;
use crate::program::quantities as q;
use crate::program::scene::Scene;
use harness::observe::{Observer, Scalars};
use polycore::network::PolymerNetwork;

/// Error of forces in mixed precision above which a run warns.
const LARGEST_MIXED_ERROR: f64 = 1e-2;

/// Returns the names of the axes of a scene.
pub(super) fn axes(scene: &Scene) -> &'static [&'static str] {
    if scene.body.space == Space::Solid { &["x", "y", "z"] } else { &["x", "y"] }
}

/// Adds the scalars of parameters that follow fields of other scenes.
pub(super) fn followed_fields<const D: usize>(scene: &Scene, to: &mut Scalars<Moment<D>>) {
    for field in &scene.material.fields {
        for (index, quantity) in q::OF_A_FIELD.iter().enumerate() {
            // the unit of the field is known only after reading it
            to.add_in_unit(quantity.named(&[field.of.value_name()]), |m| {
                let one = m.physics.body.followed.iter().find(|one| one.parameter == field.of)?;
                let [mean, least, largest] = one.field;
                Some((one.unit, [mean, one.mesh_mean, least, largest][index]))
            });
        }
    }
}

/// Adds what follows from the chemistry of a network.
pub(super) fn network<const D: usize>(scene: &Scene, to: &mut Scalars<Moment<D>>) {
    if scene.material.network.is_some() {
        to.add_if(q::NETWORK_MODULUS, |m| m.physics.network.as_ref().map(PolymerNetwork::modulus));
        to.add_if(q::LOCKING_STRETCH, |m| m.physics.network.as_ref()?.locking_stretch());
    }
}

/// Adds the smallest and largest stretches.
pub(super) fn stretches<const D: usize>(_: &Scene, to: &mut Scalars<Moment<D>>) {
    to.add(q::SMALLEST_STRETCH, |m| m.each(|row| row.smallest_stretch).fold(1.0, f64::min));
    to.add(q::LARGEST_STRETCH, |m| m.each(|row| row.largest_stretch).fold(1.0, f64::max));
    to.add(q::SMALLEST_STRETCH_MET, |m| (1.0 + m.state.stretches.observed.low).max(0.0).sqrt());
    to.add(q::LARGEST_STRETCH_MET, |m| (1.0 + m.state.stretches.observed.high).sqrt());
}

/// Observer of the error of the fitted bond law.
pub(super) struct FitError<'s> {
    scene: &'s Scene,
    error: f64,
}

impl<'s> FitError<'s> {
    pub(super) fn new(scene: &'s Scene) -> Self {
        Self { scene, error: f64::NAN }
    }

    fn is_fitted(&self) -> bool {
        self.scene.material.solid.is_none() && !self.scene.material.is_prestrained()
    }
}

impl<'m, const D: usize> Observer<Moment<'m, D>, Error> for FitError<'_> {
    fn scalars(&self, to: &mut Scalars<Moment<'m, D>>) {
        if self.is_fitted() {
            to.add(q::FIT_ERROR, |_| self.error);
        }
    }

    fn end(&mut self, m: &Moment<'m, D>) -> Result<(), Error> {
        if let Some(material) = m.physics.evaluator.bond_material() {
            let stretches = covered_stretches(m.bonds, &m.state.displacement);
            let fits = material.fits(stretches, self.scene.fit_bound())?;
            self.error = fits.iter().map(|fit| fit.max_error).fold(0.0, f64::max);
        }
        Ok(())
    }
}

/// Adds scalars of explicit dynamics; a body that is held everywhere has no critical step.
pub(super) fn motion<const D: usize>(scene: &Scene, to: &mut Scalars<Moment<D>>) {
    if scene.dynamics.is_none() {
        return;
    }
    to.add_if(q::CRITICAL_TIME_STEP, |m| {
        Some(m.state.motion.limits.critical_step).filter(|step| step.is_finite())
    });
    to.add(q::TIME_STEP, |m| m.state.motion.steps.time_step);
    to.add(q::KINETIC_ENERGY, |m| m.state.motion.energies.kinetic);
    if scene.is_mixed() {
        to.add_if(q::MIXED_ERROR, mixed_error);
    }
}

fn mixed_error<const D: usize>(m: &Moment<D>) -> Option<f64> {
    m.scene.dynamics.as_ref()?;
    m.bonds.as_lattice()?.mixed_error(&m.state.displacement)
}

/// Warns if mixed precision is too rough.
pub(super) fn mixed_warnings<const D: usize>(m: &Moment<D>) -> Vec<String> {
    let error = mixed_error(m).filter(|&error| error > LARGEST_MIXED_ERROR);
    let warning = |error| {
        format!(
            "forces in mixed precision are wrong by {error:.1e} of their rms: use `precision = \"double\"`"
        )
    };
    error.map(warning).into_iter().collect()
}

/// Adds the largest displacement, reactions and applied forces.
pub(super) fn responses<const D: usize>(scene: &Scene, to: &mut Scalars<Moment<D>>) {
    to.add(q::LARGEST_DISPLACEMENT, |m| {
        let length = |site| m.state.displacement.get(site).iter().map(|x| x * x).sum::<f64>().sqrt();
        m.sites().map(length).fold(0.0, f64::max)
    });
    let holds = scene.boundary.iter().any(|boundary| boundary.prescribes_displacement());
    for (d, axis) in axes(scene).iter().enumerate() {
        if holds {
            to.add_if(q::REACTION.named(&[axis]), |m| {
                let loads = &m.physics.loads;
                (!loads.constrained.is_empty()).then(|| loads.reaction(m.bonds, &m.state.force)[d])
            });
        }
        if scene.has_forces() {
            to.add_if(q::APPLIED.named(&[axis]), |m| {
                let loads = &m.physics.loads;
                loads.body_force.is_some().then(|| loads.applied(m.bonds, &[])[d])
            });
        }
    }
}
