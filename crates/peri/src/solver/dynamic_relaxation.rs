//! Adaptive dynamic relaxation: damped pseudo-dynamics with unit time step, a fictitious mass from the bonds'
//! stiffness and a damping from the Rayleigh quotient of the last increment, until the forces balance.
//! Underwood (1983), in Computational Methods for Transient Analysis; Kilic & Madenci (2010),
//! doi:10.1016/j.tafmec.2010.08.001, with the quotient of increments (the displacement-weighted form has
//! negative stiffness in many iterations).

use super::balance::SearchLimits;
use super::load::Loads;
use super::load_stepping::{Equilibrium, QuasiStatic};
use super::mass::{has_own_mass, own_mass, update_unit_mass};
use super::method::Watch;
use super::passes::{ForceSums, force_pass, move_pass};
use super::state::State;
use super::system::System;

use crate::bonds::StretchRange;
use crate::error::Error;

/// Iterations between checks of the stretches.
const CHECK_INTERVAL: u64 = 10;

/// Quasi-static solution by adaptive dynamic relaxation: robust, one force evaluation an iteration, but many
/// more iterations than [`Lbfgs`](super::Lbfgs). Use it for comparison with published results, and for bodies
/// that break during an iteration ([`Policy::EveryIteration`](super::Policy)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DynamicRelaxation {
    /// Out-of-balance force over reference force at which a step is converged.
    pub tolerance: f64,
    /// Iterations that a search for equilibrium may take.
    pub max_iterations: u64,
    /// Factor S on the fictitious mass above the Gershgorin bound.
    pub mass_safety: f64,
    /// Residual below which a search continues after all its iterations are used; the residual is recorded in
    /// the history.
    pub accept: f64,
}

impl Default for DynamicRelaxation {
    fn default() -> Self {
        Self { tolerance: 1e-3, max_iterations: 100_000, mass_safety: 1.1, accept: 0.0 }
    }
}

impl DynamicRelaxation {
    pub(super) fn goal(&self) -> SearchLimits {
        SearchLimits { tolerance: self.tolerance, max_iterations: self.max_iterations, accept: self.accept }
    }
}

impl<const D: usize> QuasiStatic<D> for DynamicRelaxation {
    fn solver(&self) -> impl Equilibrium<D> {
        RelaxationSolver::new(*self)
    }
}

/// Iterations between updates of the masses, if bonds differ much in their tangent.
pub(super) const REFRESH: u64 = 10;
/// Iterations after which a search is a long one, and the least damping towards twice as many.
const LONG: u64 = 3000;
const LATE_DAMPING: f64 = 0.05;

/// Returns true if an iteration looks at the stretches.
pub(super) fn is_look_due<const D: usize>(system: &System<D>, state: &State<D>) -> bool {
    // a step's first iterations move farthest: the fit must not be extrapolated for long
    system.breaks_on_the_way()
        || state.counts.iteration < CHECK_INTERVAL
        || state.counts.iteration.is_multiple_of(CHECK_INTERVAL)
}

/// Damping c of an iteration, from the Rayleigh quotient of the last increment.
pub(super) fn damping(iteration: u64, sums: &ForceSums) -> f64 {
    let quotient = if iteration > 0 && sums.quotient_bottom > 0.0 {
        -sums.quotient_top / sums.quotient_bottom
    } else {
        0.0
    };
    // with softening bonds the quotient is negative and would let them oscillate indefinitely, so a long
    // search is damped
    let late = iteration.saturating_sub(LONG) as f64 / LONG as f64;
    (2.0 * quotient.max(0.0).sqrt()).clamp(LATE_DAMPING * late.min(1.0), 1.9)
}

/// Solver of [`DynamicRelaxation`].
pub struct RelaxationSolver {
    settings: DynamicRelaxation,
    /// Gershgorin sums of the undeformed body for a unit bond tangent; computed when first needed.
    unit_mass: Vec<f64>,
    /// Gershgorin sums of the deformed body with each bond's own tangent, if bonds differ much in it.
    own_mass: Vec<f64>,
    /// Either of them plus contact in this iteration.
    contact_mass: Vec<f64>,
}

impl RelaxationSolver {
    /// Creates a solver without any computed data.
    pub fn new(settings: DynamicRelaxation) -> Self {
        Self { settings, unit_mass: Vec::new(), own_mass: Vec::new(), contact_mass: Vec::new() }
    }

    /// Gershgorin sums of this iteration.
    fn masses<const D: usize>(&self, system: &System<D>, own: bool) -> &[f64] {
        match (system.repulsion(), own) {
            (Some(_), _) => &self.contact_mass,
            (None, true) => &self.own_mass,
            (None, false) => &self.unit_mass,
        }
    }

    /// Gives particles that move as a whole the same mass.
    fn level<const D: usize>(&mut self, loads: &Loads<D>) {
        for masses in [&mut self.unit_mass, &mut self.own_mass, &mut self.contact_mass] {
            if !masses.is_empty() {
                loads.level_masses(masses);
            }
        }
    }

    /// Runs one iteration; returns true if the forces balance (the displacement then stays).
    fn iterate<const D: usize>(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
    ) -> Result<bool, Error> {
        let settings = self.settings;
        let look = is_look_due(system, state);
        let factor = system.loads.force_factor(system.factors[state.step]);
        system.prepare(&mut state.displacement);
        system.follow(&state.displacement);
        let own = has_own_mass(system, state);
        if own && (state.counts.iteration.is_multiple_of(REFRESH) || self.own_mass.is_empty()) {
            own_mass(system, state, &mut self.own_mass);
        }
        let tangent = if own { system.material.bond_law().1 } else { state.stretches.tangent };
        if let Some(contact) = system.repulsion() {
            self.contact_mass.clone_from(if own { &self.own_mass } else { &self.unit_mass });
            contact.add_stiffness(&*system.bonds, &state.displacement, tangent, &mut self.contact_mass);
        }
        let mass = 0.5 * settings.mass_safety * tangent;
        self.level(&system.loads);
        let shared = system.shared_forces(state);
        let (mut sums, observed) = force_pass(system, state, self.masses(system, own), mass, factor, look);
        system.add_shared(state, &shared, self.masses(system, own), mass, &mut sums);
        system.count_evaluation(state);
        if !sums.is_finite() {
            return Err(system.not_finite(state));
        }
        state.stretches.observe(observed);
        let mut broken = false;
        if look {
            // after a refit this force still belongs to the old fit, whose range it left by little: continue
            system.widen(state)?;
            if system.breaks_on_the_way() && system.is_overstretched(observed) {
                let sites = system.break_bonds(state);
                broken = !sites.is_empty();
                Equilibrium::bonds_broke(self, system, &sites);
                system.refuse_unsupported(state, settings.tolerance)?;
            }
        }
        let damping = damping(state.counts.iteration, &sums);
        let goal = settings.goal();
        state.record_sums(system, &sums, &goal);
        if state.is_balanced(&goal, broken)? {
            return Ok(true);
        }
        system.level_forces(state);
        move_pass(&system.loads, state, self.masses(system, own), mass, damping);
        system.stop_detached(state);
        state.counts.iterate();
        // masses are rebuilt from the state alone
        let restartable = state.counts.iteration.is_multiple_of(REFRESH);
        let status = state.status(system.factors.len(), settings.tolerance, damping, restartable);
        watch(&status, state)?;
        Ok(false)
    }
}

impl<const D: usize> Equilibrium<D> for RelaxationSolver {
    fn equilibrate(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
    ) -> Result<Option<StretchRange>, Error> {
        if self.unit_mass.len() != system.bonds.sites() {
            self.unit_mass = vec![1.0; system.bonds.sites()];
            let particles = system.bonds.particles();
            update_unit_mass(&*system.bonds, particles, &mut self.unit_mass);
        }
        self.own_mass.clear();
        while !self.iterate(system, state, watch)? {}
        Ok(None)
    }

    fn bonds_broke(&mut self, system: &System<D>, sites: &[u32]) {
        update_unit_mass(&*system.bonds, sites, &mut self.unit_mass);
        // regions that move as a whole get the largest of their masses anew
        for region in &system.loads.rigid {
            update_unit_mass(&*system.bonds, &region.sites, &mut self.unit_mass);
        }
    }

    fn tolerance(&self) -> f64 {
        self.settings.tolerance
    }
}
