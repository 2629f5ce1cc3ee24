//! The variants of a scene, as many at a time as the program says. All are parts of one run, and of its
//! checkpoint.
//!
//! Each thread solves one variant; what its loops hand out is taken by threads that have no variant of their
//! own any more. A variant's numbers do not depend on the threads, so neither do those of a scene.

use super::Naming;
use crate::case::{Fault, Options, Run, Step, VariantCheckpoint};
use crate::scene::Failure;
use polycore::Error;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Progress of the whole run. The outcomes of finished variants, and what those under way have reached, are
/// its checkpoint.
struct Whole<'a, 'r, O> {
    run: &'a mut Run<'r>,
    finished: BTreeMap<usize, O>,
    states: BTreeMap<usize, Vec<u8>>,
    /// Finished part of each variant under way, 0 to 1.
    parts: BTreeMap<usize, f64>,
}

impl<O: Serialize> Whole<'_, '_, O> {
    fn save(&mut self) -> Result<(), Error> {
        self.run.save(&(&self.finished, &self.states))
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Solves the variants called `names` that the checkpoint does not have, `at_once` of them at a time, each by
/// `solve` in a run of its own; their outcomes in their order. Variants after one that fails stop.
///
/// # Errors
/// That of the first variant that fails; an interruption; a checkpoint that cannot be read or written.
pub fn solve<O, E>(
    run: &mut Run,
    naming: Naming,
    names: &[String],
    at_once: usize,
    solve: impl Fn(usize, &mut Run) -> Result<O, Failure<E>> + Sync,
) -> Result<Vec<O>, Failure<E>>
where
    O: Serialize + DeserializeOwned + Send,
    E: Fault,
{
    let (finished, states): (BTreeMap<usize, O>, _) = run.reached()?.unwrap_or_default();
    let left: Vec<usize> = (0..names.len()).filter(|index| !finished.contains_key(index)).collect();
    let Options { output, quick, checkpoint_every, interrupted, .. } = run.options;
    let (interruption, watched) = (run.interruption(), run.options.on_step.is_some());
    let whole = Mutex::new(Whole { run, finished, states, parts: BTreeMap::new() });
    // the first variant that failed
    let failed = AtomicUsize::new(usize::MAX);
    let one = |index: usize| -> Result<(), Failure<E>> {
        let name = &names[index];
        let folder = match naming {
            Naming::Brackets => output.to_path_buf(),
            Naming::Folders => output.join(name),
        };
        let mut progress = |part: f64, line: &dyn Fn() -> String| {
            let Whole { run, finished, parts, .. } = &mut *lock(&whole);
            parts.insert(index, part);
            let done = finished.len() as f64 + parts.values().sum::<f64>();
            run.show(done / names.len() as f64, &|| format!("{name}  {}", line()));
        };
        let mut on_step = |step: Step| {
            let run = &mut lock(&whole).run;
            run.step(|| step);
            !run.stopped
        };
        let reached = lock(&whole).states.get(&index).cloned();
        let options = Options {
            output: &folder,
            quick,
            resume: reached.is_some(),
            checkpoint_every,
            interrupted: &|| interrupted() || failed.load(Ordering::Relaxed) < index,
            progress: Some(&mut progress),
            on_step: watched.then_some(&mut on_step),
        };
        let keep = |state: Vec<u8>| {
            let mut whole = lock(&whole);
            whole.states.insert(index, state);
            whole.save()
        };
        let mut own = lock(&whole).run.of_variant(options, VariantCheckpoint { keep: &keep, reached });
        let outcome = solve(index, &mut own)?;
        drop(own);
        let mut whole = lock(&whole);
        whole.states.remove(&index);
        whole.parts.remove(&index);
        whole.finished.insert(index, outcome);
        Ok(whole.save()?)
    };
    let next = AtomicUsize::new(0);
    // what went wrong, interruptions last
    let failures = Mutex::new(BTreeMap::new());
    let one_after_another = || {
        while let Some(&index) = left.get(next.fetch_add(1, Ordering::Relaxed)) {
            if failed.load(Ordering::Relaxed) < index {
                return;
            }
            if let Err(failure) = one(index) {
                let interrupted = matches!(&failure, Failure::Run(error) if error.is_interruption());
                if !interrupted {
                    failed.fetch_min(index, Ordering::Relaxed);
                }
                lock(&failures).insert((interrupted, index), failure);
                return;
            }
        }
    };
    match at_once.min(left.len()) {
        0 | 1 => one_after_another(),
        several => rayon::scope(|scope| (0..several).for_each(|_| scope.spawn(|_| one_after_another()))),
    }
    match lock(&failures).pop_first() {
        Some(((true, _), _)) => Err(interruption.into()),
        Some((_, failure)) => Err(failure),
        None => Ok(std::mem::take(&mut lock(&whole).finished).into_values().collect()),
    }
}

/// Returns the text of an error that the scene expects, a part of which is `text`, in place of the outcome.
///
/// # Errors
/// Any other.
pub fn expected<T, E: std::error::Error>(
    outcome: Result<T, Failure<E>>,
    text: Option<&str>,
) -> Result<Result<T, String>, Failure<E>> {
    match outcome {
        Err(failure) if text.is_some_and(|text| failure.to_string().contains(text)) => {
            Ok(Err(failure.to_string()))
        }
        other => other.map(Ok),
    }
}
