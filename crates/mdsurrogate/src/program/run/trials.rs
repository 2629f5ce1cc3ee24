//! Trials of a stability suite: extreme or degenerate data, and predictions far from the data. Each trial
//! must be refused with a message, or give finite numbers, with flags if they are uncertain.

use super::{Prepared, short};
use crate::error::Error;
use crate::program::quantities as q;
use crate::program::scene::{ModelSpec, Scene, TrialSpec};
use crate::surrogate::Workspace;
use crate::train::{TrainingState, fit};
use harness::case::Run;
use harness::report::{Report, Trial};
use harness::scene::{Failure, Source};
use polycore::tensor::Voigt;

/// Runs the trials; reports a row and the value `NAME.as_expected`, 1 or 0, for each.
///
/// # Errors
/// Returns [`Error::Interrupted`]; errors of trials are results.
pub fn run(source: &Source, scene: &Scene, run: &Run, report: &mut Report) -> Result<(), Failure<Error>> {
    for trial in &scene.trial {
        let mut changed = scene.clone();
        if let (Some(files), Some(data)) = (&trial.files, &mut changed.data) {
            data.files.clone_from(files);
        }
        let mut epochs = 0;
        let result = observed(source, &changed, trial, run.options.quick, &mut epochs);
        if (run.options.interrupted)() {
            return Err(run.interruption().into());
        }
        let (observed, passed) = match (result, &trial.refused) {
            (Err(failure), Some(part)) => {
                let text = failure.to_string();
                let passed = text.contains(part.as_str());
                (format!("refused: {text}"), passed)
            }
            (Err(failure), None) => (format!("refused: {failure}"), false),
            (Ok((observed, _)), Some(_)) => (format!("not refused: {observed}"), false),
            (Ok((observed, flagged)), None) => {
                (observed, trial.flagged.is_none_or(|asked| flagged == Some(asked)))
            }
        };
        report.value(q::AS_EXPECTED.named(&[&trial.name]), f64::from(u8::from(passed)));
        report.trials.push(Trial {
            what: trial.name.clone(),
            description: trial.description.clone(),
            observed,
            iterations: (epochs > 0).then_some(epochs),
            passed,
        });
    }
    Ok(())
}

/// Trains the models on the data of a trial and evaluates them; returns a description, and true if all
/// predictions were flagged.
fn observed(
    source: &Source,
    scene: &Scene,
    trial: &TrialSpec,
    quick: bool,
    epochs: &mut u64,
) -> Result<(String, Option<bool>), Failure<Error>> {
    let data = Prepared::new(source, scene)?;
    let mut parts = Vec::new();
    let mut flagged: Option<bool> = None;
    let chosen =
        |model: &&ModelSpec| trial.models.as_ref().is_none_or(|names| names.contains(&model.title()));
    for model in scene.model.iter().filter(chosen) {
        let settings = model.training.combine(&scene.training, quick);
        let (rows, validation) = (data.rows(&data.split.train), data.rows(&data.split.validation));
        let (kind, shape) = (model.law(), model.architecture());
        let header = crate::fitted::header(kind, shape, model.members, &rows, model.standardised())?;
        let (law, states) = fit(header, &rows, &validation, settings)?;
        *epochs += states.iter().map(|state| state.history().len() as u64).sum::<u64>();
        let best = states.iter().map(TrainingState::best_loss).fold(0.0, f64::max);
        let mut part = format!("{}: loss {} MPa²", model.title(), short(best));
        if let Some(c) = trial.at {
            let answer = law.stress(&Voigt::from(c), &mut Workspace::default()).map_err(Error::from)?;
            let all = flagged.unwrap_or(true) && answer.flags.any();
            flagged = Some(all);
            let flags = if answer.flags.any() { "flagged" } else { "not flagged" };
            part += &format!(", largest |S| = {} MPa, {flags}", short(answer.stress.amax() / 1e6));
        }
        parts.push(part);
    }
    if parts.is_empty() {
        parts.push(format!("{} rows read", data.set.len()));
    }
    Ok((parts.join("; "), flagged))
}
