//! Observers of a part's run: each names its scalars, fields and files, and how they follow from a state, in one place.

mod animation;
pub(crate) mod celsius;
mod healing;
mod lines;
mod outside;
mod probes;
mod section;
mod stress;
mod thermal;
mod warped;

pub use animation::FIELDS;
pub use probes::{Probe, record};

use crate::error::Error;
use crate::program::scene::{PartScene, Task};
use crate::simulation::Simulation;
use harness::observe::Observer;

/// Observers of a part's run.
pub type Observers<'a> = harness::observe::Observers<'a, Simulation, Error>;

/// Observers of a scene, in the order of their fields.
pub fn observers<'a>(scene: &'a PartScene, task: &'a Task) -> Observers<'a> {
    let mut all: Vec<Box<dyn Observer<Simulation, Error> + Send + 'a>> =
        vec![Box::new(thermal::Thermal::new(task)), Box::new(probes::Probes::new(scene, task))];
    all.push(Box::new(lines::Lines { scene, task }));
    all.push(Box::new(animation::Animation { scene, task }));
    if let Some(mechanics) = &task.mechanics {
        all.push(Box::new(stress::Stress::new(scene, task, mechanics)));
    }
    if let Some(interfaces) = &task.interfaces {
        all.push(Box::new(healing::Interfaces::new(scene, interfaces)));
    }
    harness::observe::Observers(all)
}

/// Values of a field, NaN where nothing exists.
fn or_nan(field: Vec<Option<f64>>) -> Vec<f64> {
    field.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect()
}
