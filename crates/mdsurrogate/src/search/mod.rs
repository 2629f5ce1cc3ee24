//! Search for the hyperparameters of an `ann`: Hyperband and Bayesian optimisation over Table 3.3.
//!
//! A search asks an [`Oracle`] for the validation loss of candidates after some epochs, and records each
//! answer in a [`Journal`]. It depends only on seed and answers: a search that continues with the journal of
//! an interrupted one repeats its questions, takes known answers from the journal, and continues from there.

mod bayesian;
mod hyperband;
mod space;

#[cfg(test)]
mod tests;

pub use bayesian::bayesian;
pub use hyperband::{brackets, hyperband};
pub use space::{SearchCandidate, SearchSpace};

use crate::Error;
use crate::random::SplitMix64;
use serde::{Deserialize, Serialize};

/// Search method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum SearchMethod {
    /// Many candidates for few epochs, the best ones for more (Li et al. 2018,
    /// <https://jmlr.org/papers/v18/16-558.html>).
    Hyperband,
    /// Candidates with the largest expected improvement by a Gaussian process of the losses (Jones et al.
    /// 1998, <https://doi.org/10.1023/A:1008306431147>).
    Bayesian,
    /// Random candidates, all for the largest number of epochs (Bergstra & Bengio 2012,
    /// <https://jmlr.org/papers/v13/bergstra12a.html>): the baseline of the other methods.
    Random,
}

impl SearchMethod {
    /// Returns the name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hyperband => "hyperband",
            Self::Bayesian => "bayesian",
            Self::Random => "random",
        }
    }
}

/// Trial of a search.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Search method.
    pub method: SearchMethod,
    /// Number of the candidate in its method, from 0.
    pub number: usize,
    /// Hyperparameters of the candidate.
    pub candidate: SearchCandidate,
    /// Total number of epochs.
    pub epochs: u32,
    /// Lowest validation loss so far, MPa²; `None` for a diverged training.
    pub loss: Option<f64>,
}

/// All trials so far, in order.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Journal {
    /// Trials with their losses.
    pub trials: Vec<Trial>,
}

impl Journal {
    fn known(&self, method: SearchMethod, number: usize, epochs: u32) -> Option<&Trial> {
        self.trials.iter().find(|t| t.method == method && t.number == number && t.epochs == epochs)
    }

    /// Returns the longest trial of each candidate, best first, diverged ones last.
    pub fn ranking(&self) -> Vec<&Trial> {
        let longest = |t: &Trial| {
            let same = |o: &&Trial| o.method == t.method && o.number == t.number;
            self.trials.iter().filter(same).map(|o| o.epochs).max() == Some(t.epochs)
        };
        let mut best: Vec<&Trial> = self.trials.iter().filter(|t| longest(t)).collect();
        // stable sort: equal losses keep the order of the trials
        best.sort_by(|a, b| loss_or_infinity(a).total_cmp(&loss_or_infinity(b)));
        best
    }
}

fn loss_or_infinity(trial: &Trial) -> f64 {
    trial.loss.unwrap_or(f64::INFINITY)
}

/// Tries `trials` random candidates, each for `epochs`.
///
/// # Errors
/// Returns the errors of [`SearchSpace::check`] and the oracle.
pub fn random_search(
    space: &SearchSpace,
    trials: usize,
    epochs: u32,
    seed: u64,
    journal: &mut Journal,
    oracle: &mut dyn Oracle,
) -> Result<(), Error> {
    space.check()?;
    let mut random = SplitMix64::new(seed);
    for number in 0..trials {
        let candidate = space.sample(&mut random);
        ask(oracle, journal, SearchMethod::Random, number, &candidate, epochs)?;
        oracle.forget(SearchMethod::Random, &[number]);
    }
    Ok(())
}

/// Trainer of candidates.
pub trait Oracle {
    /// Returns the lowest validation loss of a candidate after a total number of epochs; `None` if its
    /// training diverged. The journal contains all earlier answers.
    ///
    /// # Errors
    /// Returns any error that ends the search.
    fn loss(&mut self, question: &Trial, journal: &Journal) -> Result<Option<f64>, Error>;

    /// Drops the trainings of candidates that will not continue.
    fn forget(&mut self, method: SearchMethod, numbers: &[usize]);
}

/// Returns the answer of the journal, or asks the oracle.
fn ask(
    oracle: &mut dyn Oracle,
    journal: &mut Journal,
    method: SearchMethod,
    number: usize,
    candidate: &SearchCandidate,
    epochs: u32,
) -> Result<Option<f64>, Error> {
    if let Some(known) = journal.known(method, number, epochs) {
        return Ok(known.loss);
    }
    let mut trial = Trial { method, number, candidate: candidate.clone(), epochs, loss: None };
    trial.loss = oracle.loss(&trial, journal)?.filter(|loss| loss.is_finite());
    let loss = trial.loss;
    journal.trials.push(trial);
    Ok(loss)
}
