//! Search for hyperparameters in a scene.

use super::memory::MOST_PARAMETERS;
use crate::search::{SearchMethod, SearchSpace, brackets};
use crate::surrogate::Header;
use crate::surrogate::Kind;
use harness::scene::{SceneError, Source};
use serde::Deserialize;

/// Search for hyperparameters.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SearchSpec {
    /// Search methods, in this order: `hyperband`, `bayesian`, `random`; default: the first two.
    #[serde(default = "default_methods")]
    pub methods: Vec<SearchMethod>,
    /// Largest number of epochs of a training; `bayesian` always uses it.
    #[serde(default = "default_epochs")]
    pub epochs: u32,
    /// Epochs in `--quick` runs.
    pub quick_epochs: Option<u32>,
    /// Reduction factor of `hyperband`: one in `eta` candidates continues, for `eta` times the epochs.
    #[serde(default = "default_eta")]
    pub eta: u32,
    /// Number of trainings of `bayesian` and `random`.
    #[serde(default = "default_trials")]
    pub trials: usize,
    /// Number of trainings in `--quick` runs.
    pub quick_trials: Option<usize>,
    /// Number of random trials before the Gaussian process is fitted.
    #[serde(default = "default_initial")]
    pub initial: usize,
    /// Seed of the random choices.
    #[serde(default)]
    pub seed: u64,
    /// Number of whole searches with consecutive seeds, for medians of their best losses.
    #[serde(default = "default_repeats")]
    pub repeats: u32,
    /// Number of searches in `--quick` runs.
    pub quick_repeats: Option<u32>,
    /// Number of best candidates among which the one with the fewest parameters is chosen.
    #[serde(default = "default_top")]
    pub top: usize,
    /// Search space; default: Table 3.3.
    #[serde(default)]
    pub space: SearchSpace,
}

fn default_methods() -> Vec<SearchMethod> {
    vec![SearchMethod::Hyperband, SearchMethod::Bayesian]
}

fn default_epochs() -> u32 {
    81
}

fn default_eta() -> u32 {
    3
}

fn default_trials() -> usize {
    40
}

fn default_initial() -> usize {
    10
}

fn default_repeats() -> u32 {
    1
}

fn default_top() -> usize {
    10
}

impl SearchSpec {
    /// Returns the epochs of a run.
    pub fn epochs(&self, quick: bool) -> u32 {
        self.quick_epochs.filter(|_| quick).unwrap_or(self.epochs)
    }

    /// Returns the trainings of `bayesian` in a run.
    pub fn trials(&self, quick: bool) -> usize {
        self.quick_trials.filter(|_| quick).unwrap_or(self.trials)
    }

    /// Returns the searches of a run.
    pub fn repeats(&self, quick: bool) -> u32 {
        self.quick_repeats.filter(|_| quick).unwrap_or(self.repeats)
    }

    /// Checks the settings.
    ///
    /// # Errors
    /// Returns a [`SceneError`] with key and allowed values.
    pub fn check(&self, source: &Source) -> Result<(), SceneError> {
        let wrong = |key: &str, error: crate::Error| {
            let (found, allowed) = match error {
                crate::Error::Parameter { found, allowed, .. } => (found, allowed),
                other => (other.to_string(), "a valid search".into()),
            };
            source.error(&format!("search.{key}"), found, allowed)
        };
        let repeated = |k: usize| self.methods[..k].contains(&self.methods[k]);
        if self.methods.is_empty() || (0..self.methods.len()).any(repeated) {
            let allowed = "some of `hyperband`, `bayesian`, `random`, each once";
            return Err(source.error("search.methods", format!("{:?}", self.methods), allowed));
        }
        for (key, repeats) in [("repeats", Some(self.repeats)), ("quick_repeats", self.quick_repeats)] {
            if let Some(repeats) = repeats.filter(|repeats| !(1..=100).contains(repeats)) {
                return Err(source.error(&format!("search.{key}"), repeats, "1 to 100"));
            }
        }
        for (key, epochs) in [("epochs", Some(self.epochs)), ("quick_epochs", self.quick_epochs)] {
            if let Some(epochs) = epochs {
                let locate = |error: crate::Error| match &error {
                    crate::Error::Parameter { name: "eta", .. } => wrong("eta", error),
                    _ => wrong(key, error),
                };
                brackets(epochs, self.eta).map_err(locate)?;
            }
        }
        if self.initial < 3 {
            return Err(source.error("search.initial", self.initial, "3 or more, to fit a Gaussian process"));
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
        // largest network of the space
        let widest = (self.space.neurons[1], self.space.activations[0]);
        let largest = Header::new(Kind::Ann, &vec![widest; self.space.layers[1]], 1);
        largest.check().map_err(|error| wrong("space", error.into()))?;
        let parameters = largest.architecture.parameters();
        if parameters > MOST_PARAMETERS {
            let found = format!("networks of up to {parameters} parameters");
            return Err(source.error("search.space", found, format!("at most {MOST_PARAMETERS}")));
        }
        Ok(())
    }
}
