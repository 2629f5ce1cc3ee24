//! Models and their training, as written in a scene.

use super::memory::{MOST_PARAMETERS, parameters};
use crate::dataset::Method;
use crate::network::{Activation, Architecture};
use crate::surrogate::{Header, Kind, Surrogate, Symmetry};
use crate::train::{Loss, MOST_UNITS, Schedule, Settings};
use harness::scene::{SceneError, Source};
use serde::Deserialize;
use std::collections::HashSet;

/// The axes of the data.
const OWN_AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A law to train.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelSpec {
    /// Prefix of its files and results; default: its network's row of Table 3.4, or its kind.
    pub name: Option<String>,
    /// What its networks compute.
    pub kind: KindName,
    /// A row of Table 3.4 instead of `hidden`; default of an `ann`: ANN-4.
    pub network: Option<ThesisNetwork>,
    /// Neurons and activation of each hidden layer; default of an `energy`: two of 64, softplus.
    pub hidden: Option<Vec<(usize, Activation)>>,
    /// Material symmetry of an energy; default: orthotropic.
    pub symmetry: Option<Symmetry>,
    /// Material axes of an energy as rows; default: those of the data.
    pub axes: Option<[[f64; 3]; 3]>,
    /// Whether an energy is polyconvex by construction: elliptic everywhere, but it cannot represent softening. Its
    /// symmetry is orthotropic, transverse or isotropic, its activations are softplus, elu or linear.
    #[serde(default)]
    pub polyconvex: bool,
    /// Whether a polyconvex isotropic energy takes √I₁ = ‖F‖ and √I₂ = ‖cof F‖ for I₁ and I₂: polyconvex too, and less
    /// stiff (rubber asks for √I₂).
    #[serde(default)]
    pub norms: bool,
    /// Units of a damage variable of an energy, by which runs that turn round unload below the curve of loading; their rows of
    /// unloading are for it alone. Default: none.
    pub softening: Option<usize>,
    /// Names of the training runs that it learns from; default: all of them. The others are then held out of it.
    #[serde(default)]
    pub runs: Vec<String>,
    /// Networks trained from different seeds into one law.
    #[serde(default = "one")]
    pub members: usize,
    /// Internal units of an `ann`'s outputs; default: standardised.
    pub outputs: Option<Outputs>,
    /// Overrides of the scene's `[training]`.
    #[serde(default)]
    pub training: TrainingSpec,
    /// Divides the rows by another method than the scene's `[split]`, for this model alone.
    pub split: Option<Method>,
    /// Trained in `--quick` runs too.
    #[serde(default = "yes")]
    pub quick: bool,
}

/// What the networks of a law compute, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum KindName {
    /// C → S (3.9).
    Ann,
    /// Invariants of C → W.
    Energy,
}

/// The columns of Table 3.4.
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

/// Units of an `ann`'s outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Outputs {
    /// Mean 0 and deviation 1 over the training rows, component by component.
    Standardised,
    /// MPa, as in the thesis.
    Stress,
}

/// How networks are trained; what is left out is that of [`Settings::default`].
#[derive(Clone, Copy, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrainingSpec {
    /// Passes over the training rows.
    pub epochs: Option<u32>,
    /// The same in `--quick` runs.
    pub quick_epochs: Option<u32>,
    /// Rows in a step.
    pub batch: Option<usize>,
    /// Adam's step.
    pub learning_rate: Option<f64>,
    /// `constant` or `cosine`.
    pub schedule: Option<Schedule>,
    /// Epochs without a better validation loss before it stops.
    pub patience: Option<u32>,
    /// `stress` (3.12) or `scaled`.
    pub loss: Option<Loss>,
    /// Of the first member; the others count on.
    pub seed: Option<u64>,
}

fn one() -> usize {
    1
}

fn yes() -> bool {
    true
}

impl TrainingSpec {
    /// What is written here, else what is written in `general`, else the defaults.
    pub fn over(&self, general: &Self, quick: bool) -> Settings {
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
    /// Its name, or the default one.
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

    /// What its networks compute.
    pub fn law(&self) -> Kind {
        match self.kind {
            KindName::Ann => Kind::Ann,
            KindName::Energy => Kind::Energy {
                symmetry: self.symmetry.unwrap_or(Symmetry::Orthotropic),
                axes: self.axes.unwrap_or(OWN_AXES),
                polyconvex: self.polyconvex,
                norms: self.norms,
            },
        }
    }

    /// Whether an `ann`'s outputs are standardised.
    pub fn standardised(&self) -> bool {
        self.outputs != Some(Outputs::Stress)
    }

    /// Its networks.
    pub fn architecture(&self) -> Architecture {
        let kind = self.law();
        let hidden = match (&self.hidden, self.network, self.kind) {
            (Some(hidden), ..) => hidden.clone(),
            (None, network, KindName::Ann) => {
                // a number from 1 to 4 is always known
                let number = network.unwrap_or(ThesisNetwork::Ann4) as usize;
                return Architecture::thesis(number).unwrap_or_else(|_| Architecture::new(6, &[], 6));
            }
            (None, _, KindName::Energy) => vec![(64, Activation::Softplus); 2],
        };
        Architecture::new(kind.inputs(), &hidden, kind.outputs())
    }
}

/// Checks models and training; `key` of the first model is `model[0]`.
///
/// # Errors
/// What is wrong and where.
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
            return Err(source.error(&at("name"), format!("`{name}` twice"), "a name for each model"));
        }
        if model.hidden.is_some() && model.network.is_some() {
            return Err(source.error(&at("network"), "`network` together with `hidden`", "one of them"));
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
                let found = format!("`{key}` of an ann, which has none");
                return Err(source.error(&at(key), found, "`kind = \"energy\"`"));
            }
        }
        if let Some(units) = model.softening.filter(|units| !(1..=MOST_UNITS).contains(units)) {
            return Err(source.error(&at("softening"), units, format!("1 to {MOST_UNITS} units")));
        }
        if energy && model.network.is_some() {
            let found = "a network of Table 3.4, which returns a stress";
            return Err(source.error(&at("network"), found, "`hidden` layers for an energy"));
        }
        if energy && model.outputs.is_some() {
            return Err(source.error(&at("outputs"), "`outputs` of an energy", "`kind = \"ann\"`"));
        }
        if energy && model.architecture().activations.contains(&Activation::Relu) {
            let allowed = match model.polyconvex {
                true => "softplus, elu or linear (convex, and its stress is a derivative)",
                false => "softplus, tanh, sigmoid, silu or elu (its stress is a derivative)",
            };
            return Err(source.error(&at("hidden"), "relu in an energy", allowed));
        }
        let symmetry = model.symmetry.unwrap_or(Symmetry::Orthotropic);
        if model.polyconvex && symmetry.polyconvex_invariants().is_none() {
            let allowed = "orthotropic, transverse or isotropic for a polyconvex energy";
            return Err(source.error(&at("symmetry"), format!("{symmetry:?}").to_lowercase(), allowed));
        }
        if model.norms && !(model.polyconvex && symmetry == Symmetry::Isotropic) {
            let allowed = "`polyconvex = true` and `symmetry = \"isotropic\"` beside it";
            return Err(source.error(&at("norms"), "norms of another energy", allowed));
        }
        let mut header = Header::new(model.law(), &[], model.members);
        if (1..=1000).contains(&model.members) {
            // a law without hidden layers has the same axes
            Surrogate::<f64>::random(header.clone(), 0)
                .map_err(|error| source.error(&at("axes"), error, "axes that a material can have"))?;
        }
        header.architecture = model.architecture();
        header.check().map_err(|error| {
            let key = if (1..=1000).contains(&model.members) { "hidden" } else { "members" };
            source.error(&at(key), error, "a network that can be built")
        })?;
        let parameters = parameters(model);
        if parameters > MOST_PARAMETERS {
            let found = format!("{parameters} parameters, in networks: {}", model.members);
            let allowed = format!("networks of {MOST_PARAMETERS} at most, all members together");
            return Err(source.error(&at("hidden"), found, allowed));
        }
        check_training(source, &at("training"), &model.training)?;
    }
    check_training(source, "training", general)
}

/// Numbers of a block of training settings.
///
/// # Errors
/// What is wrong and where.
fn check_training(source: &Source, key: &str, spec: &TrainingSpec) -> Result<(), SceneError> {
    let settings = |spec: &TrainingSpec| spec.over(&TrainingSpec::default(), false);
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
