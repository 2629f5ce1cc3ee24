//! List of all observers.

use super::moment::{Moment, SceneObservers, StatelessObserver};
use super::{
    contact, cracks, exact, flags, frames, history, lines, maps, probes, resistance, sections, tractions,
    values,
};
use crate::calibrate::Space;
use crate::error::Error;
use crate::program::scene::Scene;
use harness::observe::{Observer, Scalars};
use harness::report::Named;

/// Returns the observers of a scene; they need no body yet.
pub fn observers<const D: usize>(scene: &Scene) -> SceneObservers<'_, D> {
    let stateless = |functions| {
        Box::new(StatelessObserver { scene, ..functions })
            as Box<dyn for<'m> Observer<Moment<'m, D>, Error> + '_>
    };
    let none = StatelessObserver::empty(scene);
    vec![
        stateless(StatelessObserver { scalars: values::followed_fields, ..none }),
        stateless(StatelessObserver { scalars: values::network, ..none }),
        stateless(StatelessObserver { scalars: values::stretches, ..none }),
        Box::new(values::FitError::new(scene)),
        stateless(StatelessObserver { scalars: cracks::breaking, ..none }),
        stateless(StatelessObserver { scalars: cracks::interfaces, ..none }),
        stateless(StatelessObserver { scalars: values::motion, warnings: values::mixed_warnings, ..none }),
        stateless(StatelessObserver { scalars: values::responses, ..none }),
        stateless(StatelessObserver { scalars: history::scalars, warnings: history::warnings, ..none }),
        Box::new(cracks::NewCracks::new(scene)),
        stateless(StatelessObserver { scalars: contact::scalars, warnings: contact::warnings, ..none }),
        stateless(StatelessObserver { scalars: probes::scalars, ..none }),
        stateless(StatelessObserver { scalars: probes::mean_stresses, ..none }),
        Box::new(resistance::Resistance(scene)),
        stateless(StatelessObserver { scalars: flags::scalars, warnings: flags::warnings, ..none }),
        Box::new(exact::HoleErrors::new(scene)),
        Box::new(sections::Sections(scene)),
        Box::new(lines::LineObserver(scene)),
        stateless(StatelessObserver { fields: frames::displacement_fields, ..none }),
        stateless(StatelessObserver { fields: cracks::damage_field, ..none }),
        stateless(StatelessObserver { fields: flags::flag_field, ..none }),
        stateless(StatelessObserver { fields: frames::energy_field, ..none }),
        stateless(StatelessObserver { fields: frames::stress_fields, ..none }),
        Box::new(tractions::Tractions(scene)),
        Box::new(maps::Pictures(scene)),
    ]
}

/// Returns the scalars that a run of a scene without studies can report; some depend on events, such as
/// `first_break`.
pub fn quantities(scene: &Scene) -> Vec<Named> {
    let scene = &*scene.at_end();
    match scene.body.space {
        Space::Solid => names(&observers::<3>(scene)),
        _ => names(&observers::<2>(scene)),
    }
}

fn names<const D: usize>(observers: &SceneObservers<D>) -> Vec<Named> {
    let mut names = Vec::new();
    let take = &mut |named, _| names.push(named);
    observers.iter().for_each(|observer| observer.scalars(&mut Scalars::new(None, take)));
    names
}
