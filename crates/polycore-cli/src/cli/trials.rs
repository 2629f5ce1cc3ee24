//! Trials: a law at a stretch, or fitted to a few states, with their expected behaviour.

use harness::report::{self, Judgement, Quantity, Report};
use harness::scene::{SceneError, Source};
use polycore::Error;
use polycore::constitutive;
use polycore::constitutive::hyperelastic::data::{Mode, TestData, TestState};
use polycore::constitutive::hyperelastic::fit::fit;
use polycore::constitutive::hyperelastic::{
    self, Compressible, Hyperelastic, Volumetric, homogeneous, model, plane_stress,
};
use polycore::tensor::Tensor2;
use polycore::units::Stress;
use serde::Deserialize;

use super::{MPA, quantities as q};

/// Trial: with `parameters` a law is evaluated at a `stretch`, with `data` it is fitted.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FitTrial {
    /// Name in the report.
    name: String,
    /// Expected behaviour, in words.
    description: String,
    /// Name of the law.
    law: String,
    /// Parameters, in the order of the law.
    parameters: Option<Vec<ParameterValue>>,
    /// Test.
    #[serde(default = "uniaxial")]
    mode: Mode,
    /// First stretch.
    stretch: Option<f64>,
    /// Lamé's λ of a quadratic volumetric term; without it, the stress of the incompressible law.
    bulk: Option<Stress>,
    /// Pairs of λ₁ and P₁, states of the test.
    data: Option<Vec<(f64, Stress)>>,
    /// Part of the expected error message.
    refused: Option<String>,
}

/// Parameter: a stress with its unit, or a number.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(untagged)]
enum ParameterValue {
    /// Stress with its unit.
    Stress(Stress),
    /// Number without a unit.
    Plain(f64),
}

impl ParameterValue {
    fn si(&self) -> f64 {
        match self {
            Self::Stress(stress) => stress.si(),
            Self::Plain(value) => *value,
        }
    }
}

fn uniaxial() -> Mode {
    Mode::Uniaxial
}

/// Result of a trial.
enum TrialResult {
    Stress { nominal: f64, energy: f64 },
    Fit(Box<hyperelastic::fit::Fit>),
}

impl FitTrial {
    /// Names of the scalars that the trial may have.
    pub fn quantities(&self) -> Vec<String> {
        let parameters = model(&self.law).map_or(&[][..], |model| model.parameters);
        let fixed = [q::NOMINAL, q::ENERGY, q::REFUSED, q::RMS, q::SHEAR_MODULUS];
        let fixed = fixed.iter().map(|quantity| quantity.named(&[&self.name]));
        let own = parameters.iter().map(|parameter| q::PARAMETER.named(&[&self.name, parameter.name]));
        fixed.chain(own).map(|quantity| quantity.name).collect()
    }

    fn evaluate(&self) -> Result<TrialResult, constitutive::Error> {
        let model = model(&self.law)?;
        if let Some(data) = &self.data {
            let state = |(stretch, nominal): &(f64, Stress)| {
                let stretches = [*stretch, self.mode.second_stretch(*stretch)];
                TestState::new(self.mode, stretches, [nominal.si(), 0.0])
            };
            let table = TestData::new(String::new(), data.iter().map(state).collect());
            return Ok(TrialResult::Fit(Box::new(fit(model, &table)?)));
        }
        let values: Vec<f64> = self.parameters.iter().flatten().map(ParameterValue::si).collect();
        let law = model.law(&values)?;
        let first = self.stretch.unwrap_or(1.0);
        let second = self.mode.second_stretch(first);
        let Some(bulk) = self.bulk else {
            let nominal = homogeneous::biaxial(&law, first, second)?[0];
            let stretches = homogeneous::incompressible(first, second)?;
            return Ok(TrialResult::Stress { nominal, energy: law.energy_at(stretches)? });
        };
        let law = Compressible::new(law, Volumetric::Quadratic { lame: bulk.si() })?;
        let state = plane_stress(&law, &Tensor2::new(first, 0.0, 0.0, second))?;
        Ok(TrialResult::Stress { nominal: first * state.stress[0], energy: law.energy(&state.deformation)? })
    }
}

/// Checks the rules of the list.
///
/// # Errors
/// The rule that is broken, and its place.
pub fn check(source: &Source, trials: &[FitTrial]) -> Result<(), SceneError> {
    for (i, trial) in trials.iter().enumerate() {
        let key = |field: &str| format!("trial[{i}].{field}");
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if trial.name.is_empty() || !trial.name.chars().all(plain) {
            return Err(source.error(
                &key("name"),
                format!("`{}`", trial.name),
                "letters, digits, `-` and `_`",
            ));
        }
        if trials[..i].iter().any(|other| other.name == trial.name) {
            return Err(source.error(
                &key("name"),
                format!("`{}` a second time", trial.name),
                "another name",
            ));
        }
        let Ok(model) = model(&trial.law) else {
            let all: Vec<&str> = hyperelastic::MODELS.iter().map(|model| model.key).collect();
            return Err(source.error(&key("law"), format!("`{}`", trial.law), all.join(", ")));
        };
        if !Mode::TESTS.contains(&trial.mode) {
            let allowed = "uniaxial, equibiaxial, pure-shear: simple shear is pure shear but for a rotation, \
                           and torsion has states of many stretches";
            return Err(source.error(&key("mode"), trial.mode.name(), allowed));
        }
        match (&trial.data, &trial.parameters) {
            (Some(_), Some(_)) => {
                let why = "a law is either evaluated with `parameters` or fitted to `data`";
                return Err(source.conflict(&key("data"), "parameters", why));
            }
            (None, None) => {
                let why = "needed with `stretch` to evaluate the law, or `data` to fit it";
                return Err(source.missing(&key("parameters"), why));
            }
            _ => {}
        }
        for (name, is_given) in [("stretch", trial.stretch.is_some()), ("bulk", trial.bulk.is_some())] {
            if trial.data.is_some() && is_given {
                let why = "the law is fitted to `data`; remove it, or give `parameters` instead of `data`";
                return Err(source.unexpected(&key(name), why));
            }
        }
        let Some(parameters) = &trial.parameters else { continue };
        if parameters.len() != model.parameters.len() {
            let names: Vec<_> = model.parameters.iter().map(|parameter| parameter.name).collect();
            return Err(source.error(
                &key("parameters"),
                format!("{} parameters", parameters.len()),
                names.join(", "),
            ));
        }
        for (given, parameter) in parameters.iter().zip(model.parameters) {
            if matches!(given, ParameterValue::Stress(_)) != (parameter.unit == "Pa") {
                let (found, allowed) = match parameter.unit {
                    "Pa" => (format!("`{}` without a unit", parameter.name), "a stress, as \"0.3 MPa\""),
                    _ => (format!("`{}` with a unit", parameter.name), "a number without a unit"),
                };
                return Err(source.error(&key("parameters"), found, allowed));
            }
        }
        if trial.stretch.is_none() {
            let why = "needed with `parameters` to evaluate the law, e.g. `stretch = 2.0`";
            return Err(source.missing(&key("stretch"), why));
        }
    }
    Ok(())
}

/// Runs a trial and records the observed behaviour.
///
/// # Errors
/// Unexpected failures.
pub fn run(trial: &FitTrial, report: &mut Report) -> Result<(), Error> {
    let of = |quantity: Quantity| quantity.named(&[&trial.name]);
    let result = trial.evaluate();
    let mut passed = true;
    let text = match (result, &trial.refused) {
        (Err(error), Some(part)) => {
            let error = error.to_string();
            passed = error.contains(part.as_str());
            report.value(of(q::REFUSED), f64::from(u8::from(passed)));
            format!("refused: {error}")
        }
        (Err(error), None) => return Err(error.into()),
        (Ok(result), refused) => {
            if refused.is_some() {
                passed = false;
                report.value(of(q::REFUSED), 0.0);
            }
            match result {
                TrialResult::Stress { nominal, energy } => {
                    report.value(of(q::NOMINAL), nominal / MPA);
                    report.value(of(q::ENERGY), energy / MPA);
                    format!("P = {:e} MPa, W = {:e} MJ/m³", nominal / MPA, energy / MPA)
                }
                TrialResult::Fit(fit) => {
                    report.value(of(q::RMS), fit.rms / MPA);
                    report.value(of(q::SHEAR_MODULUS), fit.law.shear_modulus() / MPA);
                    for parameter in &fit.parameters {
                        let (scale, unit) = if parameter.unit == "Pa" { (MPA, "MPa") } else { (1.0, "") };
                        let quantity = q::PARAMETER.named(&[&trial.name, parameter.name]).in_unit(unit);
                        report.value(quantity, parameter.value / scale);
                    }
                    format!("rms {:e} MPa", fit.rms / MPA)
                }
            }
        }
    };
    let (what, description) = (trial.name.clone(), trial.description.clone());
    report.trials.push(report::Trial { what, description, observed: text, iterations: None, passed });
    Ok(())
}

/// Marks a trial as failed if any expectation on it fails.
pub fn judge(trials: &[FitTrial], report: &mut Report) {
    for (trial, result) in trials.iter().zip(&mut report.trials) {
        let own = trial.quantities();
        let fails = |judged: &&Judgement| {
            !judged.pass && judged.expect.names().any(|name| own.iter().any(|o| o == name))
        };
        result.passed &= !report.expect.iter().any(|judged| fails(&judged));
    }
}
