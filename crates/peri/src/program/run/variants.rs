//! The variants of a scene, as many at a time as there are threads where their bodies are too small to keep all threads busy.
//!
//! Each thread solves one variant; what its loops hand out is taken by threads that have no variant of their own any more. A
//! variant's numbers do not depend on the threads, so neither do those of a scene.

use super::outcome::Outcome;
use super::{Failure, line_of, part_of};
use crate::error::Error;
use crate::solver::{State, Status};
use harness::case::{Fault, Run, Step};
use std::cell::Cell;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What the variants under way share.
struct Shared<'a, 'r, const D: usize> {
    reached: Mutex<Reached<'a, 'r, D>>,
    /// The first variant that failed: those after it stop.
    failed: AtomicUsize,
    of: usize,
    checkpoint_every: Duration,
}

/// How far the run is. Finished variants, and the states from which those under way can continue, are its checkpoint.
struct Reached<'a, 'r, const D: usize> {
    run: &'a mut Run<'r>,
    finished: BTreeMap<usize, Outcome>,
    states: BTreeMap<usize, State<D>>,
    /// The part of each variant under way that is done, 0 to 1.
    parts: BTreeMap<usize, f64>,
}

/// A variant under way, as it reports to the run.
pub struct UnderWay<'a, 'r, const D: usize> {
    shared: &'a Shared<'a, 'r, D>,
    index: usize,
    name: String,
    kept: Cell<Instant>,
}

impl<'a, 'r, const D: usize> Shared<'a, 'r, D> {
    fn lock(&self) -> MutexGuard<'_, Reached<'a, 'r, D>> {
        self.reached.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<const D: usize> UnderWay<'_, '_, D> {
    /// After an iteration: shows it, keeps its state where a checkpoint is due, ends where the user or another variant asks for it.
    ///
    /// # Errors
    /// [`polycore::Error::Interrupted`]; a checkpoint cannot be written.
    pub fn watch(&self, status: &Status, state: &State<D>) -> Result<(), Error> {
        let mut reached = self.shared.lock();
        let Reached { run, finished, states, parts } = &mut *reached;
        if status.iteration.is_multiple_of(20) {
            parts.insert(self.index, part_of(status));
            let part = (finished.len() as f64 + parts.values().sum::<f64>()) / self.shared.of as f64;
            run.show(part, &|| format!("{}  {}", self.name, line_of(status)));
        }
        // each keeps its own state in time, whichever of them writes the file
        if status.restartable && self.kept.get().elapsed() >= self.shared.checkpoint_every {
            self.kept.set(Instant::now());
            states.insert(self.index, state.clone());
            run.save(&(&*finished, &*states))?;
        }
        run.pause(|| {
            status.restartable.then(|| {
                states.insert(self.index, state.clone());
                (&*finished, &*states)
            })
        })?;
        match self.shared.failed.load(Ordering::Relaxed) < self.index {
            true => Err(run.interruption().into()),
            false => Ok(()),
        }
    }

    /// After a step.
    pub fn step(&self, step: impl FnOnce() -> Step) {
        self.shared.lock().run.step(step);
    }
}

/// Solves the variants that the checkpoint does not have, `at_once` of them at a time, each by `solve` from the state that it
/// had reached; their outcomes in their order.
///
/// # Errors
/// That of the first variant that fails; a checkpoint that cannot be read or written.
pub fn all<const D: usize>(
    run: &mut Run,
    names: &[String],
    at_once: usize,
    solve: impl Fn(usize, &UnderWay<D>, Option<State<D>>) -> Result<Outcome, Failure> + Sync,
) -> Result<Vec<Outcome>, Failure> {
    let (finished, states): (BTreeMap<usize, Outcome>, BTreeMap<usize, State<D>>) =
        run.reached()?.unwrap_or_default();
    let left: Vec<usize> = (0..names.len()).filter(|index| !finished.contains_key(index)).collect();
    let shared = Shared {
        failed: AtomicUsize::new(usize::MAX),
        of: names.len(),
        checkpoint_every: run.options.checkpoint_every,
        reached: Mutex::new(Reached { run, finished, states, parts: BTreeMap::new() }),
    };
    let next = AtomicUsize::new(0);
    // what went wrong, interruptions last
    let failures = Mutex::new(BTreeMap::new());
    let one = |index: usize| -> Result<(), Failure> {
        let state = shared.lock().states.get(&index).cloned();
        let name = names[index].clone();
        let outcome =
            solve(index, &UnderWay { shared: &shared, index, name, kept: Cell::new(Instant::now()) }, state)?;
        let mut reached = shared.lock();
        let Reached { run, finished, states, parts } = &mut *reached;
        states.remove(&index);
        parts.remove(&index);
        finished.insert(index, outcome);
        Ok(run.save(&(&*finished, &*states))?)
    };
    let one_after_another = || {
        while let Some(&index) = left.get(next.fetch_add(1, Ordering::Relaxed)) {
            if shared.failed.load(Ordering::Relaxed) < index {
                return;
            }
            if let Err(failure) = one(index) {
                let interrupted = matches!(&failure, Failure::Run(error) if error.is_interruption());
                if !interrupted {
                    shared.failed.fetch_min(index, Ordering::Relaxed);
                }
                let mut failures = failures.lock().unwrap_or_else(PoisonError::into_inner);
                failures.insert((interrupted, index), failure);
                return;
            }
        }
    };
    match at_once.min(left.len()) {
        0 | 1 => one_after_another(),
        several => rayon::scope(|scope| (0..several).for_each(|_| scope.spawn(|_| one_after_another()))),
    }
    match failures.into_inner().unwrap_or_else(PoisonError::into_inner).pop_first() {
        Some((_, failure)) => Err(failure),
        None => Ok(std::mem::take(&mut shared.lock().finished).into_values().collect()),
    }
}
