//! What all methods have in common.

use super::{State, Status, System};
use crate::bonds::Bonds;
use crate::error::Error;

/// Sees every iteration, and may stop the run by an error.
pub type Watch<'a, const D: usize> = dyn FnMut(&Status, &State<D>) -> Result<(), Error> + 'a;

/// Sees the bonds and the state after every finished step; may stop the solution by an error.
pub type Finished<'a, const D: usize> = dyn FnMut(&dyn Bonds<D>, &State<D>) -> Result<(), Error> + 'a;

/// A method that brings a state to the end of a system's loads.
pub trait Method<const D: usize> {
    /// Continues from `state`. `watch` sees every iteration, `finished` every finished step.
    ///
    /// # Errors
    /// Those of the method, and whatever `watch` and `finished` return.
    fn solve(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
        finished: &mut Finished<D>,
    ) -> Result<(), Error>;

    /// [`Self::solve`] to the end, watched by nobody.
    ///
    /// # Errors
    /// Those of the method.
    fn run(&self, system: &mut System<D>, state: &mut State<D>) -> Result<(), Error> {
        self.solve(system, state, &mut |_, _| Ok(()), &mut |_, _| Ok(()))
    }
}
