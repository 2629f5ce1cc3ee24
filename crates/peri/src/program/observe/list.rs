//! The observers of a scene.

use super::moment::{Moment, SceneObservers, StatelessObserver};
use super::{contact, cracks, exact, flags, frames, history, lines, maps, probes, sections, values};
use crate::calibrate::Space;
use crate::error::Error;
use crate::program::scene::Scene;
use harness::observe::{Observer, Scalars};
use harness::report::Named;

/// SceneObservers of a scene, which know nothing of its body.
pub fn observers<const D: usize>(scene: &Scene) -> SceneObservers<'_, D> {
    let values = |of| {
        Box::new(StatelessObserver { scene, ..of }) as Box<dyn for<'m> Observer<Moment<'m, D>, Error> + '_>
    };
    let none = StatelessObserver::none(scene);
    vec![
        values(StatelessObserver { scalars: values::followed, ..none }),
        values(StatelessObserver { scalars: values::stretches, ..none }),
        Box::new(values::FitError::new(scene)),
        values(StatelessObserver { scalars: cracks::breaking, ..none }),
        values(StatelessObserver { scalars: values::motion, warnings: values::mixed, ..none }),
        values(StatelessObserver { scalars: values::responses, ..none }),
        values(StatelessObserver { scalars: history::scalars, ..none }),
        Box::new(cracks::NewCracks::new(scene)),
        values(StatelessObserver { scalars: contact::scalars, warnings: contact::warnings, ..none }),
        values(StatelessObserver { scalars: probes::scalars, ..none }),
        values(StatelessObserver { scalars: flags::scalars, warnings: flags::warnings, ..none }),
        Box::new(exact::HoleErrors::new(scene)),
        Box::new(sections::Sections(scene)),
        Box::new(lines::LineObserver(scene)),
        values(StatelessObserver { fields: frames::places, ..none }),
        values(StatelessObserver { fields: cracks::field, ..none }),
        values(StatelessObserver { fields: flags::field, ..none }),
        values(StatelessObserver { fields: frames::stresses, ..none }),
        Box::new(maps::Pictures(scene)),
    ]
}

/// Scalars that a run of a scene without studies can give; some only where something happens (`first_break`).
pub fn quantities(scene: &Scene) -> Vec<Named> {
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
