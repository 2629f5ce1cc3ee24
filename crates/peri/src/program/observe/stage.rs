//! Later steps of a scene: their loads, cracks and velocities.

use crate::contact::RigidSurface;
use crate::error::Error;
use crate::field::Field;
use crate::geometry::Cut;
use crate::program::scene::{self, DiscreteBody, Scene};
use crate::solver::{Loads, StageEnd, State};
use harness::scene::{Failure, Source};

/// Later step of a scene in its body.
pub struct SceneStage<const D: usize> {
    loads: Loads<D>,
    cuts: Vec<Cut<D>>,
    /// Velocities that the step prescribes at its start, m/s; 0 where it prescribes none.
    velocity: Option<Field<D>>,
    /// Rigid surfaces with their motion in the step.
    pub surfaces: Vec<RigidSurface<D>>,
}

impl<const D: usize> SceneStage<D> {
    /// Builds the later steps of a scene, and orders the regions of the first one as those of all.
    ///
    /// # Errors
    /// An invalid step.
    pub fn all(
        source: &Source,
        scene: &Scene,
        body: &DiscreteBody<D>,
        first: &mut Loads<D>,
    ) -> Result<Vec<Self>, Failure<Error>> {
        if scene.step.is_empty() {
            return Ok(Vec::new());
        }
        let names = scene::region_names(scene);
        scene::order_regions(&scene.boundary, &names, first);
        let of = |index: usize| {
            let (source, scene) = (scene.source_of(source, index), scene.stage(index));
            let (mut loads, _) = scene::loads_of(&source, &scene, body)?;
            scene::order_regions(&scene.boundary, &names, &mut loads);
            let cuts = scene::step_cuts(&source, &scene, &*body.bonds)?;
            let moves = scene.boundary.iter().any(scene::Boundary::prescribes_velocity);
            let velocity = moves.then(|| scene::velocities_of(&source, &scene, body)).transpose()?;
            scene::check_surfaces(&source, &scene, body)?;
            let contact = scene.contact.as_ref();
            let surfaces = contact.map(|own| own.surfaces(&source, &scene)).transpose()?.unwrap_or_default();
            Ok(Self { loads, cuts, velocity, surfaces })
        };
        (1..=scene.step.len()).map(of).collect()
    }

    /// Begins the step in the state at the end of the one before, with its `end`.
    pub fn begin(
        &self,
        [before, own]: [&Scene; 2],
        body: &DiscreteBody<D>,
        end: StageEnd<D>,
        state: &mut State<D>,
    ) {
        let moving = before.dynamics.is_some() && own.dynamics.is_some();
        state.begin_stage(&*body.bonds, &self.cuts, end, moving);
        for site in 0..self.velocity.as_ref().map_or(0, Field::sites) {
            let prescribed = self.velocity.as_ref().map_or([0.0; D], |field| field.get(site));
            if prescribed != [0.0; D] {
                state.velocity.set(site, prescribed);
            }
        }
    }

    /// Loads of the step, which continue those of a state that has begun it.
    ///
    /// # Errors
    /// As [`Loads::continue_from`].
    pub fn loads(&self, own: &Scene, body: &DiscreteBody<D>, state: &State<D>) -> Result<Loads<D>, Error> {
        let mut loads = self.loads.clone();
        loads.continue_from(&*body.bonds, &state.stage, &scene::common_amplitude(own))?;
        Ok(loads)
    }
}
