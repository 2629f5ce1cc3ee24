//! Interface common to all methods.

use super::{State, Status, System};
use crate::bonds::Bonds;
use crate::error::Error;

/// Callback of every iteration; may stop the run by an error.
pub type Watch<'a, const D: usize> = dyn FnMut(&Status, &State<D>) -> Result<(), Error> + 'a;

/// Callback of every finished step, with the bonds and the state; may stop the solution by an error.
pub type StepCallback<'a, const D: usize> = dyn FnMut(&dyn Bonds<D>, &State<D>) -> Result<(), Error> + 'a;

/// A method that solves a system to the end of its loads: [`Lbfgs`](super::Lbfgs) (equilibria, the first
/// choice), [`DynamicRelaxation`](super::DynamicRelaxation) (equilibria),
/// [`VelocityVerlet`](super::VelocityVerlet) (explicit dynamics).
pub trait Method<const D: usize> {
    /// Continues from `state`. `watch` receives every iteration, `finished` every finished step.
    ///
    /// # Errors
    /// Errors of the method, and of `watch` and `finished`.
    fn solve(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
        finished: &mut StepCallback<D>,
    ) -> Result<(), Error>;

    /// Runs [`Self::solve`] to the end without callbacks.
    ///
    /// # Errors
    /// Errors of the method.
    fn run(&self, system: &mut System<D>, state: &mut State<D>) -> Result<(), Error> {
        self.solve(system, state, &mut |_, _| Ok(()), &mut |_, _| Ok(()))
    }
}
