//! Observers of a part's run. Each defines its scalars, fields and files, and how they follow from a state.

mod animation;
pub(crate) mod celsius;
mod healing;
mod lines;
mod part_skin;
mod probes;
mod section;
mod stress;
mod thermal;
mod warpage_picture;

pub use animation::FIELDS;
pub use probes::{ProbeRecord, record};

use crate::error::Error;
use crate::program::scene::{PartScene, PartTask};
use crate::simulation::Simulation;
use harness::observe::Observer;

/// Observers of one run.
pub type PartObservers<'a> = harness::observe::Observers<'a, Simulation, Error>;

/// Creates the observers that a scene needs, in the order of their fields.
pub fn observers<'a>(scene: &'a PartScene, task: &'a PartTask) -> PartObservers<'a> {
    let mut all: Vec<Box<dyn Observer<Simulation, Error> + Send + 'a>> = vec![
        Box::new(thermal::ThermalObserver::new(task)),
        Box::new(probes::ProbeObserver::new(scene, task)),
    ];
    all.push(Box::new(lines::LineObserver { scene, task }));
    all.push(Box::new(animation::AnimationObserver { scene, task }));
    if let Some(mechanics) = &task.mechanics {
        all.push(Box::new(stress::StressObserver::new(scene, task, mechanics)));
    }
    if let Some(interfaces) = &task.interfaces {
        all.push(Box::new(healing::HealingObserver::new(scene, interfaces)));
    }
    harness::observe::Observers(all)
}

/// Returns the values of a field, with NaN for nonexistent nodes.
fn or_nan(field: Vec<Option<f64>>) -> Vec<f64> {
    field.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect()
}
