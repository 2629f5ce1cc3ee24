//! The observers of a scene.

use super::moment::{Moment, Observers, Values};
use super::{contact, cracks, exact, flags, frames, history, lines, maps, probes, sections, values};
use crate::calibrate::Space;
use crate::error::Error;
use crate::program::scene::Scene;
use harness::observe::{Observer, Scalars};
use harness::report::Named;

/// Observers of a scene, which know nothing of its body.
pub fn observers<const D: usize>(scene: &Scene) -> Observers<'_, D> {
    let values =
        |of| Box::new(Values { scene, ..of }) as Box<dyn for<'m> Observer<Moment<'m, D>, Error> + '_>;
    let none = Values::none(scene);
    vec![
        values(Values { scalars: values::followed, ..none }),
        values(Values { scalars: values::stretches, ..none }),
        Box::new(values::Fit::new(scene)),
        values(Values { scalars: cracks::breaking, ..none }),
        values(Values { scalars: values::motion, warnings: values::mixed, ..none }),
        values(Values { scalars: values::responses, ..none }),
        values(Values { scalars: history::scalars, ..none }),
        Box::new(cracks::NewCracks::new(scene)),
        values(Values { scalars: contact::scalars, warnings: contact::warnings, ..none }),
        values(Values { scalars: probes::scalars, ..none }),
        values(Values { scalars: flags::scalars, warnings: flags::warnings, ..none }),
        Box::new(exact::Exact::new(scene)),
        Box::new(sections::Sections(scene)),
        Box::new(lines::Lines(scene)),
        values(Values { fields: frames::places, ..none }),
        values(Values { fields: cracks::field, ..none }),
        values(Values { fields: flags::field, ..none }),
        values(Values { fields: frames::stresses, ..none }),
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

fn names<const D: usize>(observers: &Observers<D>) -> Vec<Named> {
    let mut names = Vec::new();
    let take = &mut |named, _| names.push(named);
    observers.iter().for_each(|observer| observer.scalars(&mut Scalars::new(None, take)));
    names
}
