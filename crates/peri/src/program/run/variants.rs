//! A variant under way, as its solver sees the run.

use super::{line_of, part_of};
use crate::error::Error;
use crate::solver::{State, Status};
use harness::case::{Run, Step};
use std::cell::RefCell;

/// The run of a variant: its checkpoint, its progress, who watches it.
pub struct VariantRun<'a, 'r>(pub RefCell<&'a mut Run<'r>>);

impl VariantRun<'_, '_> {
    /// After an iteration: shows it, keeps its state where a checkpoint is due, ends where the user or another variant asks for it.
    ///
    /// # Errors
    /// [`polycore::Error::Interrupted`]; a checkpoint cannot be written.
    pub fn watch<const D: usize>(&self, status: &Status, state: &State<D>) -> Result<(), Error> {
        let mut run = self.0.borrow_mut();
        if status.iteration.is_multiple_of(20) {
            run.show(part_of(status), &|| line_of(status));
        }
        Ok(run.pause(|| status.restartable.then_some(state))?)
    }

    /// After a step.
    pub fn step(&self, step: impl FnOnce() -> Step) {
        self.0.borrow_mut().step(step);
    }
}
