//! Models of a scene, and their training.

use super::memory::{MOST_PARAMETERS, parameters};
use crate::dataset::SplitMethod;
use crate::network::{Activation, Architecture};
use crate::surrogate::{Header, Kind, Surrogate, Symmetry};
use crate::train::{Loss, MOST_BRANCHES, MOST_UNITS, Schedule, Settings};
use harness::scene::{SceneError, Source};
use serde::Deserialize;
use std::collections::HashSet;

/// Axes of the data.
const DATA_AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A law to train.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelSpec {
    /// Prefix of its files and values; default: the name of its network in Table 3.4, or its kind.
    pub name: Option<String>,
    /// Kind of law.
    pub kind: KindName,
    /// Network of Table 3.4, instead of `hidden`; default for an `ann`: ANN-4.
    pub network: Option<ThesisNetwork>,
    /// Neurons and activation of each hidden layer; default for an `energy`: two layers of 64, softplus.
    pub hidden: Option<Vec<(usize, Activation)>>,
    /// Material symmetry of an energy; default: orthotropic.
    pub symmetry: Option<Symmetry>,
    /// Material axes of an energy, as rows; default: the axes of the data.
    pub axes: Option<[[f64; 3]; 3]>,
    /// Makes an energy polyconvex by construction: elliptic everywhere, but without softening. Its symmetry
    /// is orthotropic, transverse or isotropic, its activations are softplus, elu or linear.
    #[serde(default)]
    pub polyconvex: bool,
    /// Uses √I₁ = ‖F‖ and √I₂ = ‖cof F‖ in a polyconvex isotropic energy instead of I₁ and I₂: also
    /// polyconvex, and less stiff (rubber needs √I₂).
    #[serde(default)]
    pub norms: bool,
    /// Units of a damage variable of an energy, which lets runs unload below the loading curve; it alone is
    /// fitted to the rows of unloading. Default: none.
    pub softening: Option<usize>,
    /// Branches of springs and dashpots beside the law, fitted to the hysteresis of runs with unloading; the
    /// law learns the stress without theirs. Default: none.
    pub branches: Option<usize>,
    /// Names of its training runs; the others are held out. Default: all.
    #[serde(default)]
    pub runs: Vec<String>,
    /// Number of networks in the law, trained from different seeds.
    #[serde(default = "one_member")]
    pub members: usize,
    /// Units of the outputs of an `ann` during training; default: standardised.
    pub outputs: Option<OutputUnits>,
    /// Training settings that replace those of the scene's `[training]`.
    #[serde(default)]
    pub training: TrainingSpec,
    /// Split method for this model instead of the scene's `[split]`.
    pub split: Option<SplitMethod>,
    /// Trains the model in `--quick` runs too; default true.
    #[serde(default = "default_true")]
    pub quick: bool,
}

/// Kind of law, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum KindName {
    /// Stress from strain, C → S (3.9).
    Ann,
    /// Energy from invariants of C, → W.
    Energy,
}

/// Networks of Table 3.4.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[allow(missing_docs)]
pub enum ThesisNetwork {
    #[serde(rename = "ANN-1")]
    Ann1 = 1,
    #[serde(rename = "ANN-2")]
    Ann2 = 2,
    #[serde(rename = "ANN-3")]
    Ann3 = 3,
    #[serde(rename = "ANN-4")]
    Ann4 = 4,
}

/// Units of the outputs of an `ann` during training.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum OutputUnits {
    /// Mean 0 and deviation 1 over the training rows, component by component.
    Standardised,
    /// Stress in MPa, as in the thesis.
    Stress,
}

/// Training settings; defaults are those of [`Settings::default`].
#[derive(Clone, Copy, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrainingSpec {
    /// Number of passes over the training rows.
    pub epochs: Option<u32>,
    /// Number of passes in `--quick` runs.
    pub quick_epochs: Option<u32>,
    /// Rows per training step.
    pub batch: Option<usize>,
    /// Learning rate of Adam.
    pub learning_rate: Option<f64>,
    /// Schedule of the learning rate: `constant` or `cosine`.
    pub schedule: Option<Schedule>,
    /// Epochs without a lower validation loss before the training stops.
    pub patience: Option<u32>,
    /// Loss function: `stress` (3.12) or `scaled`.
    pub loss: Option<Loss>,
    /// Seed of the first member; the others use the following numbers.
    pub seed: Option<u64>,
}

fn one_member() -> usize {
    1
}

fn default_true() -> bool {
    true
}

impl TrainingSpec {
    /// Combines these settings with `general` and the defaults, in this order of precedence.
    pub fn combine(&self, general: &Self, quick: bool) -> Settings {
        let default = Settings::default();
        let epochs = |spec: &Self| spec.quick_epochs.filter(|_| quick).or(spec.epochs);
        Settings {
            epochs: epochs(self).or(epochs(general)).unwrap_or(default.epochs),
            batch: self.batch.or(general.batch).unwrap_or(default.batch),
            learning_rate: self.learning_rate.or(general.learning_rate).unwrap_or(default.learning_rate),
            schedule: self.schedule.or(general.schedule).unwrap_or(default.schedule),
            patience: self.patience.or(general.patience),
            loss: self.loss.or(general.loss).unwrap_or(default.loss),
            seed: self.seed.or(general.seed).unwrap_or(default.seed),
        }
    }
}

impl ModelSpec {
    /// Returns the name, or the default one.
    pub fn title(&self) -> String {
        if let Some(name) = &self.name {
            return name.clone();
        }
        match (self.kind, self.network, &self.hidden) {
            (KindName::Energy, ..) => "energy".into(),
            (_, Some(network), _) => format!("ANN-{}", network as usize),
            (_, None, None) => "ANN-4".into(),
            (_, None, Some(_)) => "ann".into(),
        }
    }

    /// Returns the kind of law.
    pub fn law(&self) -> Kind {
        match self.kind {
            KindName::Ann => Kind::Ann,
            KindName::Energy => Kind::Energy {
                symmetry: self.symmetry.unwrap_or(Symmetry::Orthotropic),
                axes: self.axes.unwrap_or(DATA_AXES),
                polyconvex: self.polyconvex,
                norms: self.norms,
            },
        }
    }

    /// Tells if the outputs of an `ann` are standardised.
    pub fn standardised(&self) -> bool {
        self.outputs != Some(OutputUnits::Stress)
    }

    /// Returns the architecture of its networks.
    pub fn architecture(&self) -> Architecture {
        let kind = self.law();
        let hidden = match (&self.hidden, self.network, self.kind) {
            (Some(hidden), ..) => hidden.clone(),
            (None, network, KindName::Ann) => {
                // numbers from 1 to 4 are valid
                let number = network.unwrap_or(ThesisNetwork::Ann4) as usize;
                return Architecture::thesis(number).unwrap_or_else(|_| Architecture::new(6, &[], 6));
            }
            (None, _, KindName::Energy) => vec![(64, Activation::Softplus); 2],
        };
        Architecture::new(kind.inputs(), &hidden, kind.outputs())
    }
}

/// Checks models and training.
///
/// # Errors
/// Returns a [`SceneError`] with key and advice.
pub fn check_models(source: &Source, models: &[ModelSpec], general: &TrainingSpec) -> Result<(), SceneError> {
    let mut names = HashSet::new();
    for (index, model) in models.iter().enumerate() {
        let at = |key: &str| format!("model[{index}].{key}");
        let name = model.title();
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        if name.is_empty() || name.starts_with('.') || !name.chars().all(plain) {
            let allowed = "letters, digits, `-`, `_` and `.` (it names files)";
            return Err(source.error(&at("name"), format!("`{name}`"), allowed));
        }
        if !names.insert(name.clone()) {
            return Err(source.error(
                &at("name"),
                format!("`{name}` twice"),
                "a different name for each model",
            ));
        }
        if model.hidden.is_some() && model.network.is_some() {
            return Err(source.conflict(&at("network"), &at("hidden"), "keep one of them"));
        }
        let energy = model.kind == KindName::Energy;
        for (key, written) in [
            ("symmetry", model.symmetry.is_some()),
            ("axes", model.axes.is_some()),
            ("polyconvex", model.polyconvex),
            ("norms", model.norms),
            ("softening", model.softening.is_some()),
        ] {
            if written && !energy {
                let why = "it belongs to `kind = \"energy\"`; remove it or change the kind";
                return Err(source.unexpected(&at(key), why));
            }
        }
        if let Some(units) = model.softening.filter(|units| !(1..=MOST_UNITS).contains(units)) {
            return Err(source.error(&at("softening"), units, format!("1 to {MOST_UNITS} units")));
        }
        if let Some(count) = model.branches.filter(|count| !(1..=MOST_BRANCHES).contains(count)) {
            return Err(source.error(&at("branches"), count, format!("1 to {MOST_BRANCHES} branches")));
        }
        if energy && model.network.is_some() {
            let why = "networks of Table 3.4 return a stress; use `hidden` for an energy";
            return Err(source.unexpected(&at("network"), why));
        }
        if energy && model.outputs.is_some() {
            return Err(source
                .unexpected(&at("outputs"), "it belongs to `kind = \"ann\"`; remove it or change the kind"));
        }
        if energy && model.architecture().activations.contains(&Activation::Relu) {
            let allowed = match model.polyconvex {
                true => "softplus, elu or linear (convex, with a continuous derivative)",
                false => "softplus, tanh, sigmoid, silu or elu (with a continuous derivative)",
            };
            return Err(source.error(&at("hidden"), "relu in an energy", allowed));
        }
        let symmetry = model.symmetry.unwrap_or(Symmetry::Orthotropic);
        if model.polyconvex && symmetry.polyconvex_invariants().is_none() {
            let allowed = "orthotropic, transverse or isotropic for a polyconvex energy";
            return Err(source.error(&at("symmetry"), format!("{symmetry:?}").to_lowercase(), allowed));
        }
        if model.norms && !(model.polyconvex && symmetry == Symmetry::Isotropic) {
            let why = "it needs `polyconvex = true` and `symmetry = \"isotropic\"`";
            return Err(source.unexpected(&at("norms"), why));
        }
        let mut header = Header::new(model.law(), &[], model.members);
        if (1..=1000).contains(&model.members) {
            // hidden layers do not affect the axes
            Surrogate::<f64>::random(header.clone(), 0)
                .map_err(|error| source.error(&at("axes"), error, "orthonormal material axes"))?;
        }
        header.architecture = model.architecture();
        header.check().map_err(|error| {
            let key = if (1..=1000).contains(&model.members) { "hidden" } else { "members" };
            source.error(&at(key), error, "a valid network")
        })?;
        let parameters = parameters(model);
        if parameters > MOST_PARAMETERS {
            let found = format!("{parameters} parameters in {} networks", model.members);
            let allowed = format!("at most {MOST_PARAMETERS} in all members");
            return Err(source.error(&at("hidden"), found, allowed));
        }
        check_training(source, &at("training"), &model.training)?;
    }
    check_training(source, "training", general)
}

/// Checks the numbers of training settings.
///
/// # Errors
/// Returns a [`SceneError`] with key and allowed values.
fn check_training(source: &Source, key: &str, spec: &TrainingSpec) -> Result<(), SceneError> {
    let settings = |spec: &TrainingSpec| spec.combine(&TrainingSpec::default(), false);
    let quick = TrainingSpec { epochs: spec.quick_epochs, ..TrainingSpec::default() };
    for (name, alone) in [
        ("epochs", TrainingSpec { epochs: spec.epochs, ..TrainingSpec::default() }),
        ("quick_epochs", quick),
        ("batch", TrainingSpec { batch: spec.batch, ..TrainingSpec::default() }),
        ("learning_rate", TrainingSpec { learning_rate: spec.learning_rate, ..TrainingSpec::default() }),
        ("patience", TrainingSpec { patience: spec.patience, ..TrainingSpec::default() }),
    ] {
        if let Err(crate::Error::Parameter { found, allowed, .. }) = settings(&alone).check() {
            return Err(source.error(&format!("{key}.{name}"), found, allowed));
        }
    }
    Ok(())
}
