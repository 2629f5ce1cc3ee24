//! A search for hyperparameters, as written in a scene.

use super::memory::MOST_PARAMETERS;
use crate::search::{Method, Space, brackets};
use crate::surrogate::Header;
use crate::surrogate::Kind;
use harness::scene::{SceneError, Source};
use serde::Deserialize;

/// A search for hyperparameters.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SearchSpec {
    /// `hyperband`, `bayesian`, `random` or some of them, in this order.
    #[serde(default = "both")]
    pub methods: Vec<Method>,
    /// Maximum epochs of a training; `bayesian` always uses it.
    #[serde(default = "epochs")]
    pub epochs: u32,
    /// The same in `--quick` runs.
    pub quick_epochs: Option<u32>,
    /// Of `hyperband`: one of so many candidates is kept for so many times the epochs.
    #[serde(default = "eta")]
    pub eta: u32,
    /// Trainings of `bayesian` and of `random`.
    #[serde(default = "trials")]
    pub trials: usize,
    /// The same in `--quick` runs.
    pub quick_trials: Option<usize>,
    /// Random trials before the Gaussian process is fitted.
    #[serde(default = "initial")]
    pub initial: usize,
    /// Seed of the random choices.
    #[serde(default)]
    pub seed: u64,
    /// Whole searches with one seed after the other, for medians of their best losses.
    #[serde(default = "once")]
    pub repeats: u32,
    /// The same in `--quick` runs.
    pub quick_repeats: Option<u32>,
    /// Of the best so many, the one with the fewest parameters is chosen.
    #[serde(default = "top")]
    pub top: usize,
    /// Search space; default: Table 3.3.
    #[serde(default)]
    pub space: Space,
}

fn both() -> Vec<Method> {
    vec![Method::Hyperband, Method::Bayesian]
}

fn epochs() -> u32 {
    81
}

fn eta() -> u32 {
    3
}

fn trials() -> usize {
    40
}

fn initial() -> usize {
    10
}

fn once() -> u32 {
    1
}

fn top() -> usize {
    10
}

impl SearchSpec {
    /// Epochs of a run.
    pub fn epochs(&self, quick: bool) -> u32 {
        self.quick_epochs.filter(|_| quick).unwrap_or(self.epochs)
    }

    /// Trainings of `bayesian` in a run.
    pub fn trials(&self, quick: bool) -> usize {
        self.quick_trials.filter(|_| quick).unwrap_or(self.trials)
    }

    /// Searches of a run.
    pub fn repeats(&self, quick: bool) -> u32 {
        self.quick_repeats.filter(|_| quick).unwrap_or(self.repeats)
    }

    /// # Errors
    /// What is wrong and where.
    pub fn check(&self, source: &Source) -> Result<(), SceneError> {
        let wrong = |key: &str, error: crate::Error| {
            let (found, allowed) = match error {
                crate::Error::Parameter { found, allowed, .. } => (found, allowed),
                other => (other.to_string(), "a search that can run".into()),
            };
            source.error(&format!("search.{key}"), found, allowed)
        };
        let twice = |k: usize| self.methods[..k].contains(&self.methods[k]);
        if self.methods.is_empty() || (0..self.methods.len()).any(twice) {
            let allowed = "`hyperband`, `bayesian`, `random` or some of them, each once";
            return Err(source.error("search.methods", format!("{:?}", self.methods), allowed));
        }
        for (key, repeats) in [("repeats", Some(self.repeats)), ("quick_repeats", self.quick_repeats)] {
            if let Some(repeats) = repeats.filter(|repeats| !(1..=100).contains(repeats)) {
                return Err(source.error(&format!("search.{key}"), repeats, "1 to 100"));
            }
        }
        for (key, epochs) in [("epochs", Some(self.epochs)), ("quick_epochs", self.quick_epochs)] {
            if let Some(epochs) = epochs {
                let fault = |error: crate::Error| match &error {
                    crate::Error::Parameter { name: "eta", .. } => wrong("eta", error),
                    _ => wrong(key, error),
                };
                brackets(epochs, self.eta).map_err(fault)?;
            }
        }
        if self.initial < 3 {
            return Err(source.error("search.initial", self.initial, "3 or more, to fit a process"));
        }
        for (key, trials) in [("trials", Some(self.trials)), ("quick_trials", self.quick_trials)] {
            if trials.is_some_and(|trials| !(self.initial..=10_000).contains(&trials)) {
                let allowed = format!("{} (`initial`) to 10,000", self.initial);
                return Err(source.error(&format!("search.{key}"), trials.unwrap_or(0), allowed));
            }
        }
        if self.top == 0 {
            return Err(source.error("search.top", 0, "1 or more"));
        }
        self.space.check().map_err(|error| {
            let key = match &error {
                crate::Error::Parameter { name, .. } => format!("space.{name}"),
                _ => "space".into(),
            };
            wrong(&key, error)
        })?;
        // the largest network of the space
        let widest = (self.space.neurons[1], self.space.activations[0]);
        let largest = Header::new(Kind::Ann, &vec![widest; self.space.layers[1]], 1);
        largest.check().map_err(|error| wrong("space", error.into()))?;
        let parameters = largest.architecture.parameters();
        if parameters > MOST_PARAMETERS {
            let found = format!("networks of up to {parameters} parameters");
            return Err(source.error("search.space", found, format!("{MOST_PARAMETERS} at most")));
        }
        Ok(())
    }
}
