//! Training of laws with [burn](https://burn.dev): loss (3.12), Adam, early stopping, and resumption after
//! interruptions.
//!
//! [`fit`] trains a law to the end; [`Training`] trains one network epoch by epoch. Its [`TrainingState`]
//! contains everything that changes: a training resumed from a stored state gives bit-identical weights, as
//! does a repetition. [`ensemble`] combines several networks in a law; [`Surrogate::with_spread_limit`] sets
//! the limit of their disagreement.
//!
//! ```
//! use mdsurrogate::dataset::{Dataset, Path, DataRow};
//! use mdsurrogate::kinematics::cauchy_from_material;
//! use mdsurrogate::network::{Activation::Softplus, Architecture};
//! use mdsurrogate::surrogate::{Header, Kind, Symmetry, Workspace};
//! use mdsurrogate::train::{Settings, fit};
//! use polycore::tensor::{DeformationGradient, Tensor, Voigt};
//!
//! // stretched along x: S₁₁ = 1 GPa · E₁₁
//! let mut rows = Vec::new();
//! for sample in 0..64 {
//!     let stretch = 0.9 + 0.003 * f64::from(sample);
//!     let f = DeformationGradient::new(Tensor::new(stretch, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0))?;
//!     let s = Voigt::new(1e9 * (stretch * stretch - 1.0) / 2.0, 0.0, 0.0, 0.0, 0.0, 0.0);
//!     rows.push(DataRow::new(sample as u64, f64::NAN, f, cauchy_from_material(&f, &s)));
//! }
//! let rows: Vec<&DataRow> = rows.iter().collect();
//! let architecture = Architecture::new(7, &[(16, Softplus)], 1);
//! let kind = Kind::energy(Symmetry::Orthotropic);
//! let header = mdsurrogate::fitted::header(kind, architecture, 1, &rows, true)?;
//! let settings = Settings { epochs: 200, batch: 16, ..Settings::default() };
//! let (law, _) = fit(header, &rows, &[], settings)?;
//! let stress = law.stress(&Voigt::new(1.1, 1.0, 1.0, 0.0, 0.0, 0.0), &mut Workspace::default())?.stress;
//! assert!((stress[0] / 1e6 - 50.0).abs() < 2.0, "{stress}");
//! # Ok::<(), mdsurrogate::Error>(())
//! ```

mod adam;
mod branches;
mod dataset;
mod model;
mod parameters;
mod softening;
mod state;

#[cfg(test)]
mod tests;

pub use branches::{MOST_BRANCHES, fit_branches};
pub use softening::{MOST_UNITS, loading, soften};
pub use state::{Ending, Epoch, TrainingState};

use crate::Error;
use crate::dataset::DataRow;
use crate::network::Network;
use crate::random::SplitMix64;
use crate::surrogate::{Header, Surrogate};
use dataset::Examples;
use model::Model;
use parameters::ParameterLayout;
use polycore::tensor::Voigt;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Rows per evaluation without gradients.
const CHUNK: usize = 4096;

/// Loss function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Loss {
    /// Squared error ‖S − Ŝ‖² (3.12), MPa²: the largest component dominates.
    #[default]
    Stress,
    /// Squared error of each component over its variance in the training rows: all components count alike.
    Scaled,
}

/// Schedule of the learning rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Schedule {
    /// Constant, as in the thesis.
    #[default]
    Constant,
    /// Half a cosine from the given rate to 1 % of it in the last epoch (Loshchilov & Hutter 2017,
    /// <https://arxiv.org/abs/1608.03983>, without restarts).
    Cosine,
}

/// Settings of a training.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Number of passes over the training rows.
    pub epochs: u32,
    /// Rows per step of Adam.
    pub batch: usize,
    /// Learning rate of Adam.
    pub learning_rate: f64,
    /// Schedule of the learning rate.
    pub schedule: Schedule,
    /// Epochs without a lower validation loss before the training stops.
    pub patience: Option<u32>,
    /// Loss function to minimise.
    pub loss: Loss,
    /// Seed of the initial weights and the order of the rows.
    pub seed: u64,
}

impl Default for Settings {
    /// Returns 1000 epochs as in the thesis (§3.3), the batch of Keras (32), and no early stopping. The
    /// learning rate is 10⁻³: the thesis' 10⁻² is for outputs in MPa, which start thousands of times too
    /// small.
    fn default() -> Self {
        Self {
            epochs: 1000,
            batch: 32,
            learning_rate: 1e-3,
            schedule: Schedule::Constant,
            patience: None,
            loss: Loss::Stress,
            seed: 1,
        }
    }
}

impl Settings {
    /// Checks the settings.
    ///
    /// # Errors
    /// Returns [`Error::Parameter`] for no epochs, an empty batch, a learning rate that is not positive and
    /// finite, or no patience.
    pub fn check(&self) -> Result<(), Error> {
        if !(1..=10_000_000).contains(&self.epochs) {
            return Err(Error::parameter("epochs", self.epochs, "1 to 10 million"));
        }
        if !(1..=1 << 20).contains(&self.batch) {
            return Err(Error::parameter("batch", self.batch, "1 to 1,048,576 rows"));
        }
        if !(self.learning_rate > 0.0 && self.learning_rate.is_finite()) {
            return Err(Error::parameter("learning rate", self.learning_rate, "a positive, finite number"));
        }
        match self.patience {
            Some(0) => Err(Error::parameter("patience", 0, "1 epoch or more, or no `patience`")),
            _ => Ok(()),
        }
    }

    /// Returns the learning rate in an epoch, counted from 0.
    pub fn rate(&self, epoch: u32) -> f64 {
        match self.schedule {
            Schedule::Constant => self.learning_rate,
            Schedule::Cosine => {
                let done = f64::from(epoch) / f64::from(self.epochs.max(2) - 1);
                let share = 0.5 * (1.0 + (std::f64::consts::PI * done.min(1.0)).cos());
                self.learning_rate * (0.01 + 0.99 * share)
            }
        }
    }
}

/// Training of one network.
pub struct Training {
    header: Header,
    settings: Settings,
    layout: ParameterLayout,
    model: Model,
    train: Examples,
    validation: Option<Examples>,
    state: TrainingState,
}

impl Training {
    /// Creates a network with random weights ([`Surrogate::random`] of the seed), trained as one member of a
    /// law.
    ///
    /// Without validation rows, the training loss of an epoch replaces the validation loss.
    ///
    /// # Errors
    /// Returns the errors of [`Settings::check`] and [`Header::check`]; [`Error::Data`] for no training rows;
    /// [`Error::Parameter`] for an energy of ReLU, whose stress would be a step function.
    pub fn new(
        header: &Header,
        train: &[&DataRow],
        validation: &[&DataRow],
        settings: Settings,
    ) -> Result<Self, Error> {
        let law = Surrogate::random(Header { members: 1, ..header.clone() }, settings.seed)?;
        let layout = ParameterLayout::new(&header.architecture);
        let state = TrainingState::new(layout.flat(&law.members()[0]));
        Self::resume(header, train, validation, settings, state)
    }

    /// Continues from a state of the same training.
    ///
    /// # Errors
    /// As [`Training::new`], and [`Error::Parameter`] for the state of another architecture.
    pub fn resume(
        header: &Header,
        train: &[&DataRow],
        validation: &[&DataRow],
        settings: Settings,
        state: TrainingState,
    ) -> Result<Self, Error> {
        settings.check()?;
        header.check()?;
        let mut header = header.clone();
        header.members = 1;
        let layout = ParameterLayout::new(&header.architecture);
        state.check(layout.len())?;
        if train.is_empty() {
            let (found, allowed) = ("no row".into(), "at least one training row".into());
            return Err(Error::Data { what: "training", found, allowed });
        }
        let law = Surrogate::random(header.clone(), 0)?;
        let train = Examples::new(&law, train);
        let model = Model::new(&law, &train.weights(settings.loss))?;
        let validation = (!validation.is_empty()).then(|| Examples::new(&law, validation));
        Ok(Self { header, settings, layout, model, train, validation, state })
    }

    /// Returns the reason of the end; `None` before the end.
    pub fn ending(&self) -> Option<Ending> {
        let done = self.state.history.len() as u32;
        let patient = |patience| done.saturating_sub(self.state.best_epoch) >= patience;
        if self.settings.patience.is_some_and(patient) {
            return Some(Ending::Stopped);
        }
        (done >= self.settings.epochs).then_some(Ending::Epochs)
    }

    /// Returns the state.
    pub fn state(&self) -> &TrainingState {
        &self.state
    }

    /// Returns the parameters of the best epoch so far: by validation loss, or by training loss without
    /// validation rows.
    pub fn best(&self) -> &[f32] {
        &self.state.best
    }

    /// Extends the training to more epochs, as Hyperband does.
    pub fn extend(&mut self, epochs: u32) {
        self.settings.epochs = epochs;
    }

    /// Trains one epoch in an order that depends on seed and epoch, and evaluates the validation loss.
    ///
    /// # Errors
    /// Returns [`Error::Diverged`] for a non-finite loss or parameter; the state remains that before the
    /// epoch.
    pub fn epoch(&mut self) -> Result<&Epoch, Error> {
        let since = Instant::now();
        let index = self.state.history.len() as u32;
        let rate = self.settings.rate(index);
        let before = self.state.clone();
        let diverged = |training: &mut Self, batch: usize, loss: f64| {
            training.state = before.clone();
            Err(Error::Diverged { epoch: index + 1, batch, loss, learning_rate: rate })
        };
        let mut order: Vec<usize> = (0..self.train.len()).collect();
        // each epoch has its own seed, so that a resumed training needs no generator state
        let mut named = SplitMix64::new(self.settings.seed);
        let mut random = SplitMix64::new(named.next_u64() ^ u64::from(index));
        random.shuffle(&mut order);
        let mut squares = [0.0; 6];
        for (batch, rows) in order.chunks(self.settings.batch).enumerate() {
            let step = self.model.step(&self.layout, &self.state.weights, &self.train.batch(rows));
            if !step.loss.is_finite() {
                return diverged(self, batch + 1, step.loss);
            }
            self.state.adam.step(rate, &mut self.state.weights, &self.layout, &step.gradients);
            // projected Adam: states and files contain the weights themselves; softplus(r) was not better
            self.layout.project(&self.header.kind, &mut self.state.weights);
            for (sum, square) in squares.iter_mut().zip(step.squares) {
                *sum += square;
            }
        }
        if let Some(bad) = self.state.weights.iter().find(|weight| !weight.is_finite()) {
            let batches = order.len().div_ceil(self.settings.batch);
            return diverged(self, batches, f64::from(*bad));
        }
        let train = squares.map(|square| square / order.len() as f64);
        let validation = self.validation.as_ref().map(|examples| self.squares(examples));
        let judged = validation.unwrap_or(train);
        let loss = self.model.loss(&judged);
        if !loss.is_finite() {
            return diverged(self, order.len().div_ceil(self.settings.batch), loss);
        }
        if self.state.history.is_empty() || loss < self.state.best_loss {
            self.state.best_loss = loss;
            self.state.best_epoch = index + 1;
            self.state.best.clone_from(&self.state.weights);
        }
        self.state.history.push(Epoch {
            learning_rate: rate,
            train: train.iter().sum(),
            validation: validation.map(|squares| squares.iter().sum()),
            judged: loss,
            seconds: since.elapsed().as_secs_f64(),
        });
        // the entry was just pushed
        Ok(&self.state.history[index as usize])
    }

    /// Computes the mean squared error of each component, MPa², with the current weights.
    fn squares(&self, examples: &Examples) -> [f64; 6] {
        let mut squares = [0.0; 6];
        let rows: Vec<usize> = (0..examples.len()).collect();
        for rows in rows.chunks(CHUNK) {
            let part = self.model.squares(&self.layout, &self.state.weights, &examples.batch(rows));
            for (sum, square) in squares.iter_mut().zip(part) {
                *sum += square / examples.len() as f64;
            }
        }
        squares
    }

    /// Returns the network of the best epoch.
    ///
    /// # Errors
    /// Returns an error for non-finite parameters, which no finished epoch has.
    pub fn network(&self) -> Result<Network<f64>, Error> {
        self.layout.network(&self.header.architecture, &self.state.best)
    }
}

/// Trains all members of a law to the end, with consecutive seeds; returns the law with the spread limit from
/// its training rows, and the final state of each member.
///
/// # Errors
/// Returns the errors of [`Training`].
pub fn fit(
    header: Header,
    rows: &[&DataRow],
    validation: &[&DataRow],
    settings: Settings,
) -> Result<(Surrogate, Vec<TrainingState>), Error> {
    let mut states = Vec::new();
    for member in 0..header.members as u64 {
        let settings = Settings { seed: settings.seed.wrapping_add(member), ..settings };
        let mut training = Training::new(&header, rows, validation, settings)?;
        while training.ending().is_none() {
            training.epoch()?;
        }
        states.push(training.state().clone());
    }
    let weights: Vec<Vec<f32>> = states.iter().map(|state| state.best().to_vec()).collect();
    let strains: Vec<Voigt> = rows.iter().map(|row| row.c).collect();
    Ok((ensemble(header, &weights)?.with_spread_limit(&strains)?, states))
}

/// Combines parameters ([`Training::best`]) in a law with these members.
///
/// # Errors
/// Returns [`Error::Parameter`] for parameters of another architecture.
pub fn ensemble(mut header: Header, members: &[Vec<f32>]) -> Result<Surrogate<f64>, Error> {
    header.members = members.len();
    header.check()?;
    let layout = ParameterLayout::new(&header.architecture);
    let network = |flat: &Vec<f32>| layout.network(&header.architecture, flat);
    let networks = members.iter().map(network).collect::<Result<Vec<_>, _>>()?;
    Ok(Surrogate::new(header, networks)?)
}
