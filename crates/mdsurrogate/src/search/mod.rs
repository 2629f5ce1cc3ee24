//! Search for the hyperparameters of an `ann`: Hyperband and Bayesian optimisation over Table 3.3.
//!
//! A search asks an [`Oracle`] for the validation loss of candidates after some epochs and remembers every answer in a
//! [`Journal`]. It is a function of seed and answers alone: a search that continues with the journal of a killed one asks
//! the same questions again, gets the answers that are known from the journal, and continues where it was.

mod bayesian;
mod hyperband;
mod space;

#[cfg(test)]
mod tests;

pub use bayesian::bayesian;
pub use hyperband::{brackets, hyperband};
pub use space::{Candidate, Space};

use crate::Error;
use crate::random::SplitMix64;
use serde::{Deserialize, Serialize};

/// How candidates are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Many candidates for few epochs, the best of them for more (Li et al. 2018,
    /// <https://jmlr.org/papers/v18/16-558.html>).
    Hyperband,
    /// Candidates where a Gaussian process of the losses so far expects the largest improvement (Jones et al. 1998,
    /// <https://doi.org/10.1023/A:1008306431147>).
    Bayesian,
    /// Candidates at random, all for the most epochs (Bergstra & Bengio 2012,
    /// <https://jmlr.org/papers/v13/bergstra12a.html>): what the others must beat.
    Random,
}

impl Method {
    /// As in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hyperband => "hyperband",
            Self::Bayesian => "bayesian",
            Self::Random => "random",
        }
    }
}

/// One trial of a search.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Which method asked.
    pub method: Method,
    /// The number of the candidate within its method, from 0.
    pub number: usize,
    /// What was trained.
    pub candidate: Candidate,
    /// For how many epochs in all.
    pub epochs: u32,
    /// The best validation loss up to then, MPa²; none of a training that diverged.
    pub loss: Option<f64>,
}

/// All trials so far, in order.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Journal {
    /// The answers.
    pub trials: Vec<Trial>,
}

impl Journal {
    fn known(&self, method: Method, number: usize, epochs: u32) -> Option<&Trial> {
        self.trials.iter().find(|t| t.method == method && t.number == number && t.epochs == epochs)
    }

    /// The longest trained trial of each candidate, best first; diverged ones last.
    pub fn ranking(&self) -> Vec<&Trial> {
        let longest = |t: &Trial| {
            let same = |o: &&Trial| o.method == t.method && o.number == t.number;
            self.trials.iter().filter(same).map(|o| o.epochs).max() == Some(t.epochs)
        };
        let mut best: Vec<&Trial> = self.trials.iter().filter(|t| longest(t)).collect();
        // a stable sort: equal losses stay in the order of the questions
        best.sort_by(|a, b| worth(a).total_cmp(&worth(b)));
        best
    }
}

fn worth(trial: &Trial) -> f64 {
    trial.loss.unwrap_or(f64::INFINITY)
}

/// Asks for `trials` candidates at random, each for `epochs`.
///
/// # Errors
/// [`Space::check`], and what the oracle returns.
pub fn at_random(
    space: &Space,
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
        ask(oracle, journal, Method::Random, number, &candidate, epochs)?;
        oracle.forget(Method::Random, &[number]);
    }
    Ok(())
}

/// A trainer of candidates.
pub trait Oracle {
    /// The best validation loss of a candidate after so many epochs in all; none if its training diverged. The journal
    /// has all answers before this one.
    ///
    /// # Errors
    /// Anything that ends the search.
    fn loss(&mut self, question: &Trial, journal: &Journal) -> Result<Option<f64>, Error>;

    /// No more questions about these candidates will come.
    fn forget(&mut self, method: Method, numbers: &[usize]);
}

/// An answer from the journal, or a new one.
fn ask(
    oracle: &mut dyn Oracle,
    journal: &mut Journal,
    method: Method,
    number: usize,
    candidate: &Candidate,
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
