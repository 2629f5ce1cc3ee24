//! Search for hyperparameters: training, checkpoints, and a table like Table 3.4.

use super::searched::FinishedSearch;
use super::{Prepared, short};
use crate::dataset::DataRow;
use crate::error::Error;
use crate::program::quantities as q;
use crate::program::scene::{Scene, SearchSpec};
use crate::search::{Journal, Oracle, SearchMethod, Trial, bayesian, hyperband, random_search};
use crate::surrogate::Kind;
use crate::train::{Settings, Training, TrainingState};
use harness::case::Run;
use harness::output::picture::{LinePlot, Series};
use harness::report::Report;
use harness::scene::Failure;
use polycore::file::atomic_write;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

/// Progress of the searches.
#[derive(Debug, Default, Deserialize)]
struct SearchProgress {
    /// Finished searches with earlier seeds.
    done: Vec<FinishedSearch>,
    current: FinishedSearch,
    /// Trainings that may continue, by method and number.
    states: BTreeMap<(SearchMethod, usize), TrainingState>,
}

/// Runs or resumes the searches; returns a table, line by line.
///
/// # Errors
/// Returns [`Error::Interrupted`] and I/O errors.
pub fn search(
    scene: &Scene,
    spec: &SearchSpec,
    data: &Prepared,
    run: &mut Run,
    report: &mut Report,
) -> Result<Vec<String>, Failure<Error>> {
    let SearchProgress { done, current: FinishedSearch { mut journal, mut seconds }, states } =
        run.reached()?.unwrap_or_default();
    let quick = run.options.quick;
    // drop trials that were finished after the last entry of the journal
    seconds.truncate(journal.trials.len());
    let (epochs, trials) = (spec.epochs(quick), spec.trials(quick));
    let repeats = spec.repeats(quick);
    let expected = expected_epochs(spec, epochs, trials) * u64::from(repeats);
    let mut trainer = Trainer {
        rows: data.rows(&data.split.train),
        validation: data.rows(&data.split.validation),
        settings: scene.training.combine(&Default::default(), quick),
        done,
        states,
        seconds,
        epochs: 0,
        expected,
        run,
    };
    for repeat in trainer.done.len() as u64..u64::from(repeats) {
        // seeds that are far apart; the first is that of a single search
        let seed = spec.seed.wrapping_add(1000 * repeat);
        for method in &spec.methods {
            let (space, journal, trainer) = (&spec.space, &mut journal, &mut trainer);
            match method {
                SearchMethod::Hyperband => hyperband(space, epochs, spec.eta, seed, journal, trainer)?,
                SearchMethod::Bayesian => {
                    let seed = seed.wrapping_add(1);
                    bayesian(space, [spec.initial, trials], epochs, seed, journal, trainer)?;
                }
                SearchMethod::Random => {
                    random_search(space, trials, epochs, seed.wrapping_add(2), journal, trainer)?;
                }
            }
        }
        trainer.states.clear();
        let finished = FinishedSearch {
            journal: std::mem::take(&mut journal),
            seconds: std::mem::take(&mut trainer.seconds),
        };
        trainer.done.push(finished);
        let Trainer { done, states, seconds, run, .. } = &mut trainer;
        run.save(&BorrowedProgress { done, current: (&journal, seconds), states })?;
    }
    let Trainer { done, run, .. } = trainer;
    let count: usize = done.iter().map(|search| search.journal.trials.len()).sum();
    report.work("trainings of the search", count as u64);
    super::searched::against_time(spec, &done, report);
    Ok(write(spec, &done, run.options.output, report)?)
}

/// Returns the number of epochs that a search will train, for its progress.
fn expected_epochs(spec: &SearchSpec, epochs: u32, trials: usize) -> u64 {
    let mut sum = 0;
    for method in &spec.methods {
        sum += match method {
            SearchMethod::Bayesian | SearchMethod::Random => trials as u64 * u64::from(epochs),
            SearchMethod::Hyperband => {
                let brackets = crate::search::brackets(epochs, spec.eta).unwrap_or_default();
                let epochs_of_bracket = |rounds: &Vec<(usize, u32)>| {
                    let mut before = 0;
                    let mut sum = 0;
                    for &(count, trained) in rounds {
                        sum += count as u64 * u64::from(trained - before);
                        before = trained;
                    }
                    sum
                };
                brackets.iter().map(epochs_of_bracket).sum()
            }
        };
    }
    sum.max(1)
}

/// Trains candidates, and continues earlier trainings.
struct Trainer<'a, 'o> {
    rows: Vec<&'a DataRow>,
    validation: Vec<&'a DataRow>,
    settings: Settings,
    done: Vec<FinishedSearch>,
    states: BTreeMap<(SearchMethod, usize), TrainingState>,
    seconds: Vec<f64>,
    epochs: u64,
    expected: u64,
    run: &'a mut Run<'o>,
}

/// BorrowedProgress fields of the progress, serialized like it.
#[derive(Serialize)]
struct BorrowedProgress<'a> {
    done: &'a [FinishedSearch],
    current: (&'a Journal, &'a [f64]),
    states: &'a BTreeMap<(SearchMethod, usize), TrainingState>,
}

impl Oracle for Trainer<'_, '_> {
    fn loss(&mut self, question: &Trial, journal: &Journal) -> Result<Option<f64>, Error> {
        let candidate = &question.candidate;
        let law = crate::fitted::header(Kind::Ann, candidate.architecture(), 1, &self.rows, true)?;
        let settings = Settings {
            epochs: question.epochs,
            learning_rate: candidate.learning_rate,
            seed: self.settings.seed.wrapping_add((1000 * self.done.len() + question.number) as u64),
            ..self.settings
        };
        let key = (question.method, question.number);
        let mut training = match self.states.get(&key) {
            Some(state) => Training::resume(&law, &self.rows, &self.validation, settings, state.clone())?,
            None => Training::new(&law, &self.rows, &self.validation, settings)?,
        };
        while training.ending().is_none() {
            let Self { done, states, seconds, run, .. } = self;
            run.pause(|| {
                states.insert(key, training.state().clone());
                Some(BorrowedProgress { done, current: (journal, seconds), states })
            })?;
            match training.epoch() {
                Ok(_) => {}
                Err(Error::Diverged { .. }) => {
                    self.seconds.push(training.state().seconds());
                    return Ok(None);
                }
                Err(error) => return Err(error),
            }
            self.epochs += 1;
            let part = (self.epochs as f64 / self.expected as f64).min(1.0);
            self.run.show(part, &|| {
                format!(
                    "{} {}: {} at {}, epoch {} of {}, best loss {} MPa²",
                    question.method.name(),
                    question.number + 1,
                    candidate.layers(),
                    candidate.learning_rate,
                    training.state().history().len(),
                    question.epochs,
                    short(training.state().best_loss())
                )
            });
        }
        let loss = training.state().best_loss();
        self.seconds.push(training.state().seconds());
        self.states.insert(key, training.state().clone());
        Ok(Some(loss))
    }

    fn forget(&mut self, method: SearchMethod, numbers: &[usize]) {
        for number in numbers {
            self.states.remove(&(method, *number));
        }
    }
}

/// Writes the table of the best candidates as CSV and lines; draws and reports their losses.
fn write(
    spec: &SearchSpec,
    done: &[FinishedSearch],
    output: &Path,
    report: &mut Report,
) -> Result<Vec<String>, Error> {
    let mut ranking: Vec<&Trial> = done.iter().flat_map(|search| search.journal.ranking()).collect();
    // the sort is stable: a single search keeps its order
    let loss = |trial: &&Trial| trial.loss.unwrap_or(f64::INFINITY);
    ranking.sort_by(|a, b| loss(a).total_cmp(&loss(b)));
    let parameters = |trial: &Trial| trial.candidate.architecture().parameters();
    let top: Vec<&Trial> = ranking.iter().copied().filter(|t| t.loss.is_some()).take(spec.top).collect();
    // the thesis takes the least complex of the best ten (§3.3)
    let chosen = top.iter().copied().min_by_key(|trial| parameters(trial));
    atomic_write(output.join("search.csv"), |file| {
        writeln!(
            file,
            "rank,method,number,hidden layers,learning rate,parameters,epochs,validation loss (3.12) \
             [MPa²],chosen"
        )?;
        for (rank, trial) in ranking.iter().enumerate() {
            writeln!(
                file,
                "{},{},{},\"{}\",{},{},{},{},{}",
                rank + 1,
                trial.method.name(),
                trial.number + 1,
                trial.candidate.layers(),
                trial.candidate.learning_rate,
                parameters(trial),
                trial.epochs,
                trial.loss.map_or("diverged".into(), |loss| format!("{loss:?}")),
                if chosen == Some(*trial) { "yes" } else { "" }
            )?;
        }
        Ok(())
    })?;
    let mut lines = vec![format!(
        "{:>4} {:<9} {:>10} {:>13} {:>6} {:>15}  hidden layers",
        "rank", "method", "parameters", "learning rate", "epochs", "loss (3.12)"
    )];
    for (rank, trial) in top.iter().enumerate() {
        lines.push(format!(
            "{:>4} {:<9} {:>10} {:>13} {:>6} {:>10} MPa²  {}{}",
            rank + 1,
            trial.method.name(),
            parameters(trial),
            trial.candidate.learning_rate,
            trial.epochs,
            short(trial.loss.unwrap_or(f64::NAN)),
            trial.candidate.layers(),
            if chosen == Some(*trial) { "  ← fewest parameters" } else { "" }
        ));
    }
    let diverged = ranking.iter().filter(|trial| trial.loss.is_none()).count();
    report.value(q::CANDIDATES, ranking.len() as f64).value(q::DIVERGED, diverged as f64);
    let mut plot =
        LinePlot::new("Search").axes("parameters", "validation loss (3.12) (MPa²)").log_x().log_y();
    for method in &spec.methods {
        let own = || ranking.iter().filter(|t| t.method == *method && t.loss.is_some_and(|loss| loss > 0.0));
        let losses: Vec<f64> = own().filter_map(|trial| trial.loss).collect();
        if let Some(best) = losses.first() {
            report.value(q::BEST_LOSS.named(&[method.name()]), *best);
            let sizes: Vec<f64> = own().map(|trial| parameters(trial) as f64).collect();
            plot = plot.series(Series::markers(method.name(), &sizes, &losses));
        }
    }
    if let Some(chosen) = chosen {
        report.value(q::CHOSEN_PARAMETERS, parameters(chosen) as f64);
        report.value(q::CHOSEN_LOSS, chosen.loss.unwrap_or(f64::NAN));
        plot.write(output.join("search.png"))?;
    }
    Ok(lines)
}
