//! State of a training.

use super::adam::Adam;
use crate::Error;
use serde::{Deserialize, Serialize};

/// Reason of the end of a training.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// All epochs are finished.
    Epochs,
    /// The validation loss has not fallen within the patience.
    Stopped,
}

/// Results of an epoch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Epoch {
    /// Learning rate of the epoch.
    pub learning_rate: f64,
    /// Training loss (3.12), MPa², mean over the batches during the epoch; Keras reports a sixth of it.
    pub train: f64,
    /// Validation loss (3.12), MPa², after the epoch.
    pub validation: Option<f64>,
    /// Loss that selects the best epoch: validation loss, or training loss without validation rows.
    pub judged: f64,
    /// Wall time, s.
    pub seconds: f64,
}

/// Everything that changes in a training: the content of a checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrainingState {
    pub(super) weights: Vec<f32>,
    pub(super) adam: Adam,
    pub(super) best: Vec<f32>,
    pub(super) best_loss: f64,
    pub(super) best_epoch: u32,
    pub(super) history: Vec<Epoch>,
}

impl TrainingState {
    pub(super) fn new(weights: Vec<f32>) -> Self {
        let adam = Adam::new(weights.len());
        let best = weights.clone();
        Self { weights, adam, best, best_loss: f64::INFINITY, best_epoch: 0, history: Vec::new() }
    }

    pub(super) fn check(&self, parameters: usize) -> Result<(), Error> {
        for found in [self.weights.len(), self.best.len(), self.adam.len()] {
            if found != parameters {
                let allowed = format!("{parameters}, as in its architecture");
                return Err(Error::parameter("parameters of a stored training", found, allowed));
            }
        }
        Ok(())
    }

    /// Returns the epochs so far.
    pub fn history(&self) -> &[Epoch] {
        &self.history
    }

    /// Returns the parameters of the best epoch so far.
    pub fn best(&self) -> &[f32] {
        &self.best
    }

    /// Returns the epoch with the lowest loss, from 1; 0 before the first.
    pub fn best_epoch(&self) -> u32 {
        self.best_epoch
    }

    /// Tells if the best epoch is in the first tenth of a training of 20 epochs or more: the rest had no
    /// effect.
    pub fn is_best_early(&self) -> bool {
        is_early(self.best_epoch as usize, self.history.len())
    }

    /// Returns the lowest loss ([`Epoch::judged`]); infinite before the first epoch.
    pub fn best_loss(&self) -> f64 {
        self.best_loss
    }

    /// Returns the seconds of all epochs.
    pub fn seconds(&self) -> f64 {
        self.history.iter().map(|epoch| epoch.seconds).sum()
    }
}

fn is_early(best: usize, epochs: usize) -> bool {
    epochs >= 20 && best as f64 <= 0.1 * epochs as f64
}

#[cfg(test)]
mod tests {
    #[test]
    fn epochs_among_the_first() {
        for (best, epochs, early) in
            [(1, 20, true), (3, 20, false), (100, 1000, true), (101, 1000, false), (1, 5, false)]
        {
            assert_eq!(super::is_early(best, epochs), early, "{best} of {epochs}");
        }
    }
}
