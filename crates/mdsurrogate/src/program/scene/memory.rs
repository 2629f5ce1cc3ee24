//! Memory that a run needs, stated before anything is trained.
//!
//! Counted are the arrays that live at once, in bytes; the test `memory` of the workspace compares the sum with what whole
//! runs take.

use super::{ModelSpec, Scene};
use harness::scene::{SceneError, Source};
use polycore::memory::{available, gib};

/// Threads, tables, the canvas and the letters of pictures.
const ALWAYS: f64 = 60e6;
/// A row of data: as it was read, as it is kept, and as it is written as HDF5 and drawn.
const ROW: f64 = 1200.0;
/// A parameter of the law in training: weight, gradient, moments, the best so far, its checkpoint and law file.
const TRAINED: f64 = 100.0;
/// A parameter of a law that is done: its number, in panels too.
const KEPT: f64 = 24.0;
/// A number in a layer for each row of a batch: values and derivatives that backpropagation keeps.
const ACTIVATION: f64 = 160.0;
/// Weights and biases of all networks of a law: training them takes 2 GB.
pub(super) const MOST_PARAMETERS: usize = 20_000_000;

/// Weights and biases of all networks of a model.
pub(super) fn parameters(model: &ModelSpec) -> usize {
    model.architecture().parameters().saturating_mul(model.members)
}

impl Scene {
    /// Bytes that a run on so many rows of data needs at most.
    pub fn memory(&self, rows: usize) -> f64 {
        let counts = || self.model.iter().map(|model| parameters(model) as f64);
        let batch = |model: &ModelSpec| {
            let batch = model.training.over(&self.training, false).batch.min(rows).max(rows.min(4096));
            batch as f64 * model.architecture().widths.iter().sum::<usize>() as f64
        };
        let mut bytes = ALWAYS + ROW * rows as f64;
        bytes += TRAINED * counts().fold(0.0, f64::max) + KEPT * counts().sum::<f64>();
        bytes += ACTIVATION * self.model.iter().map(batch).fold(0.0, f64::max);
        if let Some(search) = &self.search {
            let [layers, neurons] = [search.space.layers[1] as f64, search.space.neurons[1] as f64];
            bytes +=
                TRAINED * layers * neurons * neurons + ACTIVATION * rows.min(4096) as f64 * layers * neurons;
        }
        bytes
    }

    /// Refuses laws that do not fit before anything is read.
    ///
    /// # Errors
    /// What is needed and what there is.
    pub(super) fn refuse_too_large(&self, source: &Source) -> Result<(), SceneError> {
        let (needed, available) = (self.memory(0), available());
        if needed <= available {
            return Ok(());
        }
        let key = if self.search.is_some() { "search" } else { "model" };
        let found = format!("networks that need about {}", gib(needed));
        Err(source.error(key, found, format!("at most {} (the available memory)", gib(available))))
    }
}
