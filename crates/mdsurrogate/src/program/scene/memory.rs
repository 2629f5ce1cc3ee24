//! Memory of a run, estimated before training.
//!
//! Counts the bytes of arrays that are alive at the same time. The workspace test `memory` compares the sum
//! with measured peaks.

use super::{ModelSpec, Scene};
use harness::scene::{SceneError, Source};
use polycore::memory::{available, gib};

/// Threads, tables, drawing surfaces and fonts.
const ALWAYS: f64 = 60e6;
/// Row of data: as read, as kept, and as written to HDF5 and drawn.
const ROW: f64 = 1200.0;
/// Parameter in training: weight, gradient, moments, best value, checkpoint and law file.
const TRAINED: f64 = 100.0;
/// Parameter of a finished law, including packed copies.
const KEPT: f64 = 24.0;
/// Number of a layer per row of a batch: values and derivatives for backpropagation.
const ACTIVATION: f64 = 160.0;
/// Largest number of parameters of all networks of a law; their training needs 2 GB.
pub(super) const MOST_PARAMETERS: usize = 20_000_000;

/// Counts the parameters of all networks of a model.
pub(super) fn parameters(model: &ModelSpec) -> usize {
    model.architecture().parameters().saturating_mul(model.members)
}

impl Scene {
    /// Returns the bytes that a run on this number of rows needs at most.
    pub fn memory(&self, rows: usize) -> f64 {
        let counts = || self.model.iter().map(|model| parameters(model) as f64);
        let batch = |model: &ModelSpec| {
            let batch = model.training.combine(&self.training, false).batch.min(rows).max(rows.min(4096));
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

    /// Refuses laws that do not fit into memory, before reading data.
    ///
    /// # Errors
    /// Returns needed and available memory.
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
