//! The trials of a stability suite: data that are extreme or degenerate, laws asked where they cannot know; each must be
//! refused with a message, or end with finite numbers, flagged where they are uncertain.

use super::{Failure, Prepared, short};
use crate::error::Error;
use crate::program::quantities as q;
use crate::program::scene::{ModelSpec, Scene, TrialSpec};
use crate::surrogate::{Surrogate, Workspace};
use crate::train::{Settings, Training, ensemble};
use harness::case::Run;
use harness::report::{Report, Trial};
use harness::scene::Source;
use polycore::tensor::Voigt;

/// Goes through the trials: a row each in the report, and the value `NAME as expected`, 1 or 0.
///
/// # Errors
/// [`Error::Interrupted`]: errors of a trial are what it shows.
pub fn run(source: &Source, scene: &Scene, run: &Run, report: &mut Report) -> Result<(), Failure> {
    for trial in &scene.trial {
        let mut own = scene.clone();
        if let (Some(files), Some(data)) = (&trial.files, &mut own.data) {
            data.files.clone_from(files);
        }
        let mut epochs = 0;
        let result = observed(source, &own, trial, run.options.quick, &mut epochs);
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
        report.value(q::AS_EXPECTED.of(&[&trial.name]), f64::from(u8::from(passed)));
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

/// Trains the models on a trial's data and asks them; what came out, and whether all answers were flagged.
fn observed(
    source: &Source,
    scene: &Scene,
    trial: &TrialSpec,
    quick: bool,
    epochs: &mut u64,
) -> Result<(String, Option<bool>), Failure> {
    let data = Prepared::new(source, scene)?;
    let mut parts = Vec::new();
    let mut flagged: Option<bool> = None;
    let chosen =
        |model: &&ModelSpec| trial.models.as_ref().is_none_or(|names| names.contains(&model.title()));
    for model in scene.model.iter().filter(chosen) {
        let settings = model.training.over(&scene.training, quick);
        let (law, best) = trained(model, settings, &data, epochs)?;
        let mut part = format!("{}: loss {} MPa²", model.title(), short(best));
        if let Some(c) = trial.at {
            let answer = law.stress(&Voigt::from(c), &mut Workspace::default()).map_err(Error::from)?;
            let all = flagged.unwrap_or(true) && answer.flags.any();
            flagged = Some(all);
            let doubt = if answer.flags.any() { "flagged" } else { "not flagged" };
            part += &format!(", largest |S| = {} MPa, {doubt}", short(answer.stress.amax() / 1e6));
        }
        parts.push(part);
    }
    if parts.is_empty() {
        parts.push(format!("{} rows read", data.set.len()));
    }
    Ok((parts.join("; "), flagged))
}

/// A law, and the loss of its best epoch.
fn trained(
    model: &ModelSpec,
    settings: Settings,
    data: &Prepared,
    epochs: &mut u64,
) -> Result<(Surrogate, f64), Failure> {
    let (rows, validation) = (data.rows(&data.split.train), data.rows(&data.split.validation));
    let header =
        crate::fitted::header(model.law(), model.architecture(), model.members, &rows, model.standardised())?;
    let (mut learnt, mut worst) = (Vec::new(), 0.0f64);
    for member in 0..model.members {
        let settings = Settings { seed: settings.seed.wrapping_add(member as u64), ..settings };
        let mut training = Training::new(&header, &rows, &validation, settings)?;
        while training.ending().is_none() {
            training.epoch()?;
            *epochs += 1;
        }
        worst = worst.max(training.state().best_loss());
        learnt.push(training.best().to_vec());
    }
    let strains: Vec<Voigt> = rows.iter().map(|row| row.c).collect();
    let law = ensemble(header, &learnt)?.with_spread_limit(&strains).map_err(Error::from)?;
    Ok((law, worst))
}
