//! Work of a graphics card, in builds with the feature `gpu`; without it there is neither a card nor code for
//! one.

#[cfg(feature = "gpu")]
pub use with::{Card, equilibria, is_card, open, piolas, room, solve};
#[cfg(not(feature = "gpu"))]
pub use without::{Card, equilibria, is_card, open, piolas, room, solve};

#[cfg(feature = "gpu")]
mod with {
    use crate::bonds::Bonds;
    use crate::error::Error;
    use crate::gpu::Precision;
    use crate::program::scene::{Scene, SolverMethod, StressSpec};
    use crate::solver::{Equilibrium, State, StepCallback, System, VelocityVerlet, Watch};
    use crate::stress::{MeasuredStress, StressInput};

    /// A graphics card.
    pub type Card = crate::gpu::Device;

    /// Opens the card of this machine, with its name and the precision; or returns why not.
    pub fn open(single: bool, block: &str) -> Result<(Card, String), String> {
        let precision = if single { Precision::Single } else { Precision::Double };
        let none =
            |error: crate::Error| format!("this machine has no graphics card that can be used ({error})");
        let card = Card::portable().map_err(none)?;
        let name = card.name().to_owned();
        let card = card.with_precision(precision).map_err(|_| {
            format!("{name} does not compute in double precision; take `{block}.precision = \"single\"`")
        })?;
        let digits = if single { "single" } else { "double" };
        let what = if block == "solver" { "equilibria" } else { "steps" };
        Ok((card, format!("{what} on {name} in {digits} precision")))
    }

    /// Returns false for a program that stands for a card.
    pub fn is_card(card: &Card) -> bool {
        card.is_card()
    }

    /// Returns why the memory of a card does not hold the body of a scene.
    pub fn room<const D: usize>(card: &Card, scene: &Scene, bonds: &dyn Bonds<D>) -> Result<(), String> {
        let pairs = match scene.method() {
            // one more than it remembers
            SolverMethod::Lbfgs => scene.lbfgs().memory + 1,
            _ => 0,
        };
        let refused = bonds.as_lattice().map_or(Ok(()), |lattice| card.refuse_large(lattice, pairs));
        refused.map_err(|error| format!("the body does not fit ({error})"))
    }

    /// Takes the steps of explicit dynamics.
    ///
    /// # Errors
    /// Those of the method.
    pub fn solve<const D: usize>(
        card: &Card,
        method: &VelocityVerlet,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
        finished: &mut StepCallback<D>,
    ) -> Result<(), Error> {
        method.solve_on(card, system, state, watch, finished)
    }

    /// Returns the method of equilibria of a scene.
    pub fn equilibria<'a, const D: usize>(card: &'a Card, scene: &Scene) -> Box<dyn Equilibrium<D> + 'a> {
        match scene.method() {
            SolverMethod::Lbfgs => Box::new(scene.lbfgs().device_solver(card)),
            _ => Box::new(scene.relaxation().device_solver(card)),
        }
    }

    /// Computes stresses by the measures of a scene; `None` for what the card cannot do or does not hold.
    pub fn piolas<const D: usize>(
        card: &Card,
        bonds: &dyn Bonds<D>,
        state: &StressInput<D>,
        spec: &StressSpec,
    ) -> Option<Vec<MeasuredStress<D>>> {
        let lattice = bonds.as_lattice()?;
        crate::gpu::piolas(card, lattice, state, &spec.measures, spec.ball).ok()
    }
}

#[cfg(not(feature = "gpu"))]
mod without {
    use crate::bonds::Bonds;
    use crate::error::Error;
    use crate::program::scene::{Scene, StressSpec};
    use crate::solver::{Equilibrium, State, StepCallback, System, VelocityVerlet, Watch};
    use crate::stress::{MeasuredStress, StressInput};

    /// No graphics card in this build.
    pub enum Card {}

    /// Returns that this build has no cards.
    pub fn open(_: bool, _: &str) -> Result<(Card, String), String> {
        Err("this program was built without graphics cards: `cargo build --release -p peri --features gpu`"
            .to_owned())
    }

    /// Never called.
    pub fn is_card(card: &Card) -> bool {
        match *card {}
    }

    /// Never called.
    pub fn room<const D: usize>(card: &Card, _: &Scene, _: &dyn Bonds<D>) -> Result<(), String> {
        match *card {}
    }

    /// Never called.
    pub fn solve<const D: usize>(
        card: &Card,
        _: &VelocityVerlet,
        _: &mut System<D>,
        _: &mut State<D>,
        _: &mut Watch<D>,
        _: &mut StepCallback<D>,
    ) -> Result<(), Error> {
        match *card {}
    }

    /// Never called.
    pub fn equilibria<'a, const D: usize>(card: &'a Card, _: &Scene) -> Box<dyn Equilibrium<D> + 'a> {
        match *card {}
    }

    /// Never called.
    pub fn piolas<const D: usize>(
        card: &Card,
        _: &dyn Bonds<D>,
        _: &StressInput<D>,
        _: &StressSpec,
    ) -> Option<Vec<MeasuredStress<D>>> {
        match *card {}
    }
}
