//! Checkpoints and progress of a variant while it is solved.

use super::{finished_fraction, progress_line};
use crate::error::Error;
use crate::solver::{State, Status};
use harness::case::{Run, Step};
use std::cell::RefCell;

/// Run of a variant: checkpoint, progress, callback.
pub struct VariantRun<'a, 'r>(pub RefCell<&'a mut Run<'r>>);

impl VariantRun<'_, '_> {
    /// Shows the progress after an iteration, writes a due checkpoint, and stops at an interruption.
    ///
    /// # Errors
    /// [`polycore::Error::Interrupted`]; a checkpoint that cannot be written.
    pub fn watch<const D: usize>(&self, status: &Status, state: &State<D>) -> Result<(), Error> {
        let mut run = self.0.borrow_mut();
        if status.iteration.is_multiple_of(20) {
            run.show(finished_fraction(status), &|| progress_line(status));
        }
        Ok(run.pause(|| status.restartable.then_some(state))?)
    }

    /// Passes a finished step to the callback of the run.
    pub fn step(&self, step: impl FnOnce() -> Step) {
        self.0.borrow_mut().step(step);
    }
}
