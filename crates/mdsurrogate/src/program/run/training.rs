//! Training of the models of a scene, one after the other.

use super::judge::NamedLaw;
use super::{Prepared, short};
use crate::dataset::SplitMethod;
use crate::error::Error;
use crate::program::quantities as q;
use crate::program::scene::{ModelSpec, Scene};
use crate::surrogate::{Header, Surrogate};
use crate::train::{Settings, Training, TrainingState, ensemble, fit_branches, loading, soften};
use harness::case::Run;
use harness::output::csv;
use harness::report::Report;
use harness::scene::{BranchSpec, Failure};
use polycore::constitutive::viscoelastic::Branch;
use polycore::file::atomic_write;
use polycore::tensor::Voigt;
use serde::{Deserialize, Serialize};
use std::io::Write as _;
use std::path::Path;

/// Progress of the trainings: all members of all models in order; the last may be unfinished.
#[derive(Debug, Default, Serialize, Deserialize)]
struct TrainingProgress {
    states: Vec<TrainingState>,
}

/// A trained law.
pub struct Trained {
    name: String,
    runs: Vec<String>,
    law: Surrogate,
    branches: Vec<Branch>,
    states: Vec<TrainingState>,
    split: Option<SplitMethod>,
}

impl Trained {
    /// Returns the law with its name and training time.
    pub fn named(&self) -> NamedLaw<'_> {
        let seconds = self.states.iter().map(TrainingState::seconds).sum();
        NamedLaw {
            name: &self.name,
            law: &self.law,
            branches: &self.branches,
            runs: &self.runs,
            seconds: Some(seconds),
            split: self.split,
        }
    }
}

/// Trains the models or resumes the training; writes each law when its members are finished.
///
/// # Errors
/// Returns the errors of [`Training`] (finished trainings stay in the checkpoint) and [`Error::Interrupted`].
pub fn train(
    scene: &Scene,
    models: &[&ModelSpec],
    data: &Prepared,
    run: &mut Run,
) -> Result<Vec<Trained>, Failure<Error>> {
    let (output, quick) = (run.options.output, run.options.quick);
    let mut queue = TrainingQueue {
        progress: run.reached()?.unwrap_or_default(),
        total: models.iter().map(|model| model.members).sum(),
        done: 0,
    };
    let mut trained = Vec::new();
    for model in models {
        let split = data.split_of(model.split);
        let branches = match model.branches {
            Some(count) => fit_branches(&data.paths_of(&split.train, &model.runs), count)?,
            None => Vec::new(),
        };
        let relieved;
        let data = if branches.is_empty() {
            data
        } else {
            relieved = data.without_stress_of(&branches)?;
            &relieved
        };
        let loading: Vec<bool> = data.set.paths.iter().flat_map(loading).collect();
        let learnt = |numbers: &[usize]| {
            let is_learnt = |row: &&usize| model.softening.is_none() || loading[**row];
            data.rows_of(&numbers.iter().filter(is_learnt).copied().collect::<Vec<_>>(), &model.runs)
        };
        let (rows, validation) = (learnt(&split.train), learnt(&split.validation));
        let strains: Vec<Voigt> = rows.iter().map(|row| row.c).collect();
        let mut header = crate::fitted::header(
            model.law(),
            model.architecture(),
            model.members,
            &rows,
            model.standardised(),
        )?;
        let settings = model.training.combine(&scene.training, quick);
        header.provenance.clone_from(&data.set.provenance);
        header.provenance.push(format!(
            "{} {}: {} training rows of a split by {:?} with seed {}; {settings:?}",
            env!("CARGO_PKG_NAME"),
            env!("CARGO_PKG_VERSION"),
            rows.len(),
            split.method,
            split.seed,
        ));
        let first = queue.done;
        for member in 0..model.members {
            let settings = Settings { seed: settings.seed.wrapping_add(member as u64), ..settings };
            let training = match queue.progress.states.get(queue.done) {
                Some(state) => Training::resume(&header, &rows, &validation, settings, state.clone()),
                None => Training::new(&header, &rows, &validation, settings),
            };
            let title = match model.members {
                1 => model.title(),
                members => format!("{} ({} of {members})", model.title(), member + 1),
            };
            let result = queue.finish(training?, &title, settings, run);
            // after divergence too: the best epoch gives a law
            if let Err(failure) = result {
                let begun = &queue.progress.states[first.min(queue.progress.states.len())..];
                write(&model.title(), &header, begun, &strains, output)?;
                return Err(failure);
            }
        }
        let states = queue.progress.states[first..queue.done].to_vec();
        let mut law = write(&model.title(), &header, &states, &strains, output)?;
        if let Some(units) = model.softening {
            law = soften(law, &data.paths_of(&split.train, &model.runs), units)?;
            law.write(output.join(format!("{}.safetensors", model.title())))?;
        }
        if !branches.is_empty() {
            let path = output.join(format!("{}_branches.toml", model.title()));
            atomic_write(path, |file| file.write_all(branch_blocks(&branches).as_bytes()))?;
        }
        let (name, runs, split) = (model.title(), model.runs.clone(), model.split);
        trained.push(Trained { name, runs, law, branches, states, split });
    }
    Ok(trained)
}

/// Trainings of a scene, in order.
struct TrainingQueue {
    progress: TrainingProgress,
    total: usize,
    done: usize,
}

impl TrainingQueue {
    /// Trains to the end, with checkpoints.
    fn finish(
        &mut self,
        mut training: Training,
        title: &str,
        settings: Settings,
        run: &mut Run,
    ) -> Result<(), Failure<Error>> {
        while training.ending().is_none() {
            let result = training.epoch().copied();
            let epochs = training.state().history().len();
            if result.is_err() {
                self.store(&training);
                run.save(&self.progress)?;
            }
            let epoch = result?;
            run.pause(|| {
                self.store(&training);
                Some(&self.progress)
            })?;
            let part = (self.done as f64 + epochs as f64 / f64::from(settings.epochs)) / self.total as f64;
            run.show(part, &|| {
                let validation =
                    epoch.validation.map_or(String::new(), |loss| format!(", validation {}", short(loss)));
                format!(
                    "{title}: epoch {epochs} of {}, loss {}{validation} MPa², best in epoch {}",
                    settings.epochs,
                    short(epoch.train),
                    training.state().best_epoch()
                )
            });
        }
        self.store(&training);
        self.done += 1;
        Ok(run.save(&self.progress)?)
    }

    fn store(&mut self, training: &Training) {
        self.progress.states.truncate(self.done);
        self.progress.states.push(training.state().clone());
    }
}

/// Writes the law of the best epochs, with its spread limit, and the learning curves.
fn write(
    name: &str,
    header: &Header,
    states: &[TrainingState],
    strains: &[Voigt],
    output: &Path,
) -> Result<Surrogate, Error> {
    let learnt: Vec<Vec<f32>> =
        states.iter().filter(|state| state.best_epoch() > 0).map(|state| state.best().to_vec()).collect();
    if learnt.is_empty() {
        return Ok(Surrogate::random(header.clone(), 0)?);
    }
    for (member, state) in states.iter().enumerate() {
        let end = if states.len() == 1 { String::new() } else { format!("-{}", member + 1) };
        learning_curve(state, &output.join(format!("learning-{name}{end}.csv")))?;
    }
    let law = ensemble(header.clone(), &learnt)?.with_spread_limit(strains)?;
    law.write(output.join(format!("{name}.safetensors")))?;
    Ok(law)
}

/// Writes the loss by epoch: (3.12), and the mean over the components as in Keras.
fn learning_curve(state: &TrainingState, path: &Path) -> Result<(), Error> {
    let history = state.history();
    let column = |value: &dyn Fn(usize) -> f64| (0..history.len()).map(value).collect::<Vec<f64>>();
    let validation = |k: usize| history[k].validation.unwrap_or(f64::NAN);
    Ok(csv::write(
        path,
        &[
            ("epoch", "", &column(&|k| (k + 1) as f64)),
            ("learning rate", "", &column(&|k| history[k].learning_rate)),
            ("training loss (3.12)", "MPa²", &column(&|k| history[k].train)),
            ("training loss per component", "MPa²", &column(&|k| history[k].train / 6.0)),
            ("validation loss (3.12)", "MPa²", &column(&validation)),
            ("validation loss per component", "MPa²", &column(&|k| validation(k) / 6.0)),
        ],
    )?)
}

/// Returns remarks on the trainings: invariants that hardly vary in the data, and early best epochs.
pub fn remarks(trained: &[Trained], data: &Prepared) -> Vec<String> {
    let remark = |model: &Trained| {
        let names = crate::fitted::constrained(
            &model.law,
            &data.rows_of(&data.split_of(model.split).train, &model.runs),
        );
        let text = format!(
            "{}: {} does not vary independently in these data, so the energy's dependence on it is unknown",
            model.name,
            names.join(", ")
        );
        (!names.is_empty()).then_some(text)
    };
    trained.iter().filter_map(remark).chain(trained.iter().flat_map(early_stops)).collect()
}

/// Returns a remark for each member with an early best epoch: the rest of its training had no effect.
fn early_stops(model: &Trained) -> Vec<String> {
    let members = model.states.len();
    let line = |(member, state): (usize, &TrainingState)| {
        let (best, epochs) = (state.best_epoch() as usize, state.history().len());
        let which =
            if members > 1 { format!(" (member {} of {members})", member + 1) } else { String::new() };
        state.is_best_early().then(|| {
            format!(
                "{}{which}: the best epoch is {best} of {epochs}; the validation loss only grew \
                  afterwards. Check the learning curve; a smaller learning rate, or validation rows more \
                  like the training rows, may help",
                model.name
            )
        })
    };
    model.states.iter().enumerate().filter_map(line).collect()
}

/// Reports numbers of the trainings, and draws Fig. 3.7.
///
/// # Errors
/// Returns I/O errors.
pub fn record(trained: &[Trained], output: &Path, report: &mut Report) -> Result<(), Error> {
    for model in trained {
        let name = &model.name;
        let epochs: usize = model.states.iter().map(|state| state.history().len()).sum();
        report.work(&format!("epochs of {name}"), epochs as u64);
        report.value(q::PARAMETERS.named(&[name]), model.law.header().architecture.parameters() as f64);
        report.seconds(&format!("training of {name}"), model.states.iter().map(TrainingState::seconds).sum());
        if let Some(limit) = model.law.header().spread_limit {
            report.value(q::SPREAD_LIMIT.named(&[name]), limit / 1e6);
        }
        for (member, state) in model.states.iter().enumerate() {
            let quantity = match model.states.len() {
                1 => q::BEST_EPOCH.named(&[name]),
                _ => q::MEMBER_BEST_EPOCH.named(&[name, &(member + 1).to_string()]),
            };
            report.value(quantity, f64::from(state.best_epoch()));
        }
    }
    let curves: Vec<_> = trained.iter().map(|model| (model.name.as_str(), &model.states[0])).collect();
    super::draw::learning(&curves, output)
}

/// Branches as blocks of a scene of `peri`, for the learnt law as its equilibrium.
fn branch_blocks(branches: &[Branch]) -> String {
    let block = |branch: &Branch| {
        let ([spring, viscosity], constants) = BranchSpec::constants(branch);
        let constant = |&(name, value, unit): &(&str, f64, &str)| match unit {
            "1" => format!("{name} = {value:e}"),
            _ => format!("{name} = \"{value:e} {unit}\""),
        };
        let constants: Vec<String> = constants.iter().map(constant).collect();
        format!(
            "[[material.solid.branch]]\nspring = \"{spring}\"\nviscosity = \"{viscosity}\"\n\
             parameters = {{ {} }}\n",
            constants.join(", ")
        )
    };
    branches.iter().map(block).collect()
}
