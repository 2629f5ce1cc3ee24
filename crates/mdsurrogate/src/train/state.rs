//! Where a training stands.

use super::adam::Adam;
use crate::Error;
use serde::{Deserialize, Serialize};

/// Why a training is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// All epochs are done.
    Epochs,
    /// The validation loss has not fallen for as long as patience lasts.
    Stopped,
}

/// What an epoch gave.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Epoch {
    /// The learning rate.
    pub learning_rate: f64,
    /// (3.12), MPa², mean over the batches as they came; a sixth of it is what Keras reports.
    pub train: f64,
    /// (3.12), MPa², of the validation rows after the epoch.
    pub validation: Option<f64>,
    /// What the weights are judged by: the loss of the validation rows, or of the training rows where there are none.
    pub judged: f64,
    /// Wall time.
    pub seconds: f64,
}

/// All that changes in a training, and all that a checkpoint needs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    pub(super) weights: Vec<f32>,
    pub(super) adam: Adam,
    pub(super) best: Vec<f32>,
    pub(super) best_loss: f64,
    pub(super) best_epoch: u32,
    pub(super) history: Vec<Epoch>,
}

impl State {
    pub(super) fn new(weights: Vec<f32>) -> Self {
        let adam = Adam::new(weights.len());
        let best = weights.clone();
        Self { weights, adam, best, best_loss: f64::INFINITY, best_epoch: 0, history: Vec::new() }
    }

    pub(super) fn check(&self, parameters: usize) -> Result<(), Error> {
        for found in [self.weights.len(), self.best.len(), self.adam.len()] {
            if found != parameters {
                let allowed = format!("{parameters}, as its architecture has");
                return Err(Error::parameter("parameters of a stored training", found, allowed));
            }
        }
        Ok(())
    }

    /// The epochs so far.
    pub fn history(&self) -> &[Epoch] {
        &self.history
    }

    /// Parameters of the best epoch so far.
    pub fn best(&self) -> &[f32] {
        &self.best
    }

    /// The epoch with the best loss, from 1; 0 before the first.
    pub fn best_epoch(&self) -> u32 {
        self.best_epoch
    }

    /// Whether the best epoch is within the first tenth of a training of 20 epochs or more: the rest taught nothing.
    pub fn is_best_early(&self) -> bool {
        is_early(self.best_epoch as usize, self.history.len())
    }

    /// Its loss ([`Epoch::judged`]); infinite before the first.
    pub fn best_loss(&self) -> f64 {
        self.best_loss
    }

    /// Seconds of all epochs.
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
