//! Explicit dynamics: velocity Verlet, with all energies that the integrator exchanges.
//!
//! ρü = f + F(t)b − cρu̇ with the load factor F, a linear ramp or [`System::amplitude`];
//! constrained components follow F(t)d and its rate. v₊ = v + ½Δt a, u ← u + Δt v₊, v ← v₊ + ½Δt a, the new
//! a = (f + Fb)/ρ − cv; Swope et al. (1982), doi:10.1063/1.442716, Hairer, Lubich & Wanner (2003),
//! doi:10.1017/S0962492902000144. Works are sums of ½(force before + force after)·Δu, which change ½ρ(v² −
//! ¼Δt²a²) exactly: the energies balance to O(Δt²) without drift.

use super::method::{Method, StepCallback, Watch};
use super::motion::{BondSums, DynamicEnergies, Motion, StepLimits, StretchLook};
use super::record::Status;
use super::state::State;
use super::system::System;
use super::time_step::{critical, largest_frequency_squared};
use super::verlet_friction::{friction_pass, surface_pass};
use super::verlet_step::{
    SiteMasses, VerletStep, VerletSums, force_pass, kick_pass, leap_pass, refresh, stored,
};
use crate::bonds::{StretchRange, stretch_range};
use crate::contact::Contact;
use crate::error::Error;

/// Fraction of the energy turned over by which the kinetic energy may exceed the available energy before the
/// run stops: far above the O(Δt²) error of steps below the critical one, exceeded within a few steps beyond
/// it.
const EXCESS: f64 = 0.25;
/// Steps at the start in which the work of a ramped load is too small for that fraction: the kinetic energy
/// exceeds the work by (3/n²)·¼ after n steps.
const EARLY_STEPS: u64 = 8;

/// Contact stiffness in the limits over that observed, so that the time step is not shortened for each
/// additional particle.
const GROWTH: f64 = 1.25;

/// Growth of the allowed step at which steps are planned anew.
const LONGER: f64 = 1.25;
/// Most cuts of one step, which is then accepted.
const MOST_CUTS: u32 = 12;

/// Explicit dynamics by velocity Verlet, for impact, waves and running cracks; for equilibria use
/// [`Lbfgs`](super::Lbfgs). [`State::velocity`] is the velocity at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityVerlet {
    /// Mass density ρ, kg/m³.
    pub density: f64,
    /// Largest time step Δt, s; `None`: `safety` times the critical one, reduced as the law stiffens.
    pub time_step: Option<f64>,
    /// Fraction of the critical time step used if no time step is given.
    pub safety: f64,
    /// Mass-proportional damping c, 1/s, of unconstrained components.
    pub damping: f64,
    /// Time over which the loads rise to their full value, s; 0: at once.
    pub ramp: f64,
    /// End time, s.
    pub end_time: f64,
    /// Rows of history, equally spaced in time; steps are shortened evenly to end on them.
    pub records: usize,
}

/// Load factor of a linear ramp from 0 to 1 at a time, and its rate from then on.
pub fn ramped(time: f64, ramp: f64) -> (f64, f64) {
    if time < ramp { (time / ramp, 1.0 / ramp) } else { (1.0, 0.0) }
}

impl VelocityVerlet {
    /// Uses steps of 0.9 of the critical one up to `end_time`, no damping, full loads at once, 100 rows of
    /// history.
    pub fn new(density: f64, end_time: f64) -> Self {
        Self { density, time_step: None, safety: 0.9, damping: 0.0, ramp: 0.0, end_time, records: 100 }
    }
}

impl<const D: usize> Method<D> for VelocityVerlet {
    /// Continues from `state` to the end time. Bonds break in every step with overstretched bonds. `watch`
    /// receives every step and may stop the run by an error; `finished` receives every row of the history.
    /// [`System::factors`] and [`System::stop_below`] are not used.
    ///
    /// Time begins at a state that has not moved yet, or at an equilibrium of another method (its velocities
    /// are reset): [`State::work`] is set to its energy, so that kinetic + stored + released + damped +
    /// rubbed = work in every row up to O(Δt²).
    ///
    /// # Errors
    /// [`Error::Parameter`] for settings out of their domain; [`Error::TimeStep`] for a time step beyond the
    /// critical one; [`Error::Unstable`] if energy grows without work; [`Error::NotFinite`] for a state that
    /// is not finite at the start; [`Error::Geometry`] for a mean gradient and of [`System::restore`];
    /// errors of `watch` and `finished`.
    fn solve(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
        finished: &mut StepCallback<D>,
    ) -> Result<(), Error> {
        let masses = self.open(system, state)?;
        while state.step < self.records {
            let end = self.end_of_row(state);
            while state.motion.steps.taken < state.motion.steps.planned {
                self.advance(system, state, &masses, end)?;
                watch(&self.status(state, true), state)?;
            }
            self.close_row(system, state)?;
            finished(&*system.bonds, state)?;
        }
        Ok(())
    }
}

impl VelocityVerlet {
    fn check(&self) -> Result<(), Error> {
        let step = self.time_step.unwrap_or(1.0);
        let positive = "above 0, finite";
        let checks = [
            ("density", self.density, self.density > 0.0, positive),
            ("time step", step, step > 0.0, positive),
            (
                "safety of the time step",
                self.safety,
                self.safety > 0.0 && self.safety <= 1.0,
                "above 0, up to 1",
            ),
            ("damping", self.damping, self.damping >= 0.0, "0 or above, finite"),
            ("ramp", self.ramp, self.ramp >= 0.0, "0 or above, finite"),
            ("end time", self.end_time, self.end_time > 0.0, positive),
            ("records", self.records as f64, self.records > 0, "1 or more"),
        ];
        match checks.into_iter().find(|(_, found, good, _)| !good || !found.is_finite()) {
            Some((name, found, _, allowed)) => Err(Error::Parameter { name, found, allowed: allowed.into() }),
            None => Ok(()),
        }
    }

    /// Begins, or continues, a run; masses of all sites.
    pub(super) fn open<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
    ) -> Result<SiteMasses, Error> {
        self.check()?;
        if system.loads.mean_gradient.is_some() {
            let why = "mean gradient: found one in explicit dynamics; allowed: in equilibria".to_owned();
            return Err(Error::geometry(why));
        }
        if !state.motion.begun && system.amplitude.is_none() {
            system.refuse_inverted(&[1.0])?;
        }
        let masses = SiteMasses::new(system);
        system.contact.iter_mut().for_each(Contact::end_friction);
        if state.motion.begun {
            let factor = self.factor(system, state.motion.time).0;
            system.place_flights(state);
            system.move_surfaces(factor, state.motion.time);
            system.restore(state)?;
            system.set_forces(factor, &state.displacement);
            system.contact.iter_mut().for_each(|contact| contact.resume_friction(&state.contact.grips));
        } else {
            self.begin(system, state, &masses)?;
        }
        Ok(masses)
    }

    /// Time at the end of the next row of history, s, with steps planned to it.
    pub(super) fn end_of_row<const D: usize>(&self, state: &mut State<D>) -> f64 {
        // the last of them is the end time to the bit
        let end = self.end_time * ((state.step + 1) as f64 / self.records as f64);
        if state.motion.steps.planned == 0 {
            state.motion.plan(end);
        }
        end
    }

    /// Adds the row of history that steps have come to.
    pub(super) fn close_row<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
    ) -> Result<(), Error> {
        system.check_overlaps(state)?;
        self.record(system, state);
        state.step += 1;
        (state.counts.iteration, state.counts.step_iterations, state.motion.steps.planned) = (0, 0, 0);
        Ok(())
    }

    /// Load factor at a time, and its rate from then on.
    pub(super) fn factor<const D: usize>(&self, system: &System<D>, time: f64) -> (f64, f64) {
        if let Some(amplitude) = system.amplitude {
            return amplitude(time);
        }
        ramped(time, self.ramp)
    }

    /// Computes loads at time 0, forces, energies and the critical time step.
    fn begin<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        masses: &SiteMasses,
    ) -> Result<(), Error> {
        let (factor, rate) = self.factor(system, 0.0);
        system.move_surfaces(factor, 0.0);
        if state.stage.finished > 0 {
            // where the step before has left them: not moved now
            system.move_surfaces(factor, 0.0);
        }
        system.set_rates(factor, factor);
        system.set_forces(factor, &state.displacement);
        (state.contact.friction, state.contact.start) = (None, None);
        (state.contact.surface_friction, state.contact.surface_push) = (Vec::new(), Vec::new());
        for &site in system.bonds.particles() {
            let site = site as usize;
            let constrained = system.loads.constrained(site);
            let Some(full) = system.loads.displacement.as_ref().map(|field| field.get(site)) else { break };
            let (mut u, mut v) = (state.displacement.get(site), state.velocity.get(site));
            for d in (0..D).filter(|d| constrained >> d & 1 == 1) {
                (u[d], v[d]) = (factor * full[d], rate * full[d]);
            }
            state.displacement.set(site, u);
            state.velocity.set(site, v);
        }
        system.loads.place_turned(&*system.bonds, factor, &mut state.displacement);
        system.level_velocities(state);
        if state.displacement.non_finite().is_some() || state.velocity.non_finite().is_some() {
            return Err(system.not_finite(state));
        }
        // another method may have left it at another displacement
        state.stretches.tangent = 0.0;
        system.restore(state)?;
        system.covers_stretches(state, None)?;
        refresh(system, state, factor, None);
        system.count_evaluation(state);
        let observed = state.stretches.balanced;
        let stored = system.stored_energy(state, observed);
        let square = |site: u32| state.velocity.get(site as usize).iter().map(|v| v * v).sum::<f64>();
        let (weights, particles) = (masses.weights(), system.bonds.particles().iter());
        let kinetic = particles.map(|&site| weights[site as usize] * square(site)).sum::<f64>();
        let kinetic = 0.5 * self.density * kinetic;
        if state.force.non_finite().is_some() || !(kinetic + stored).is_finite() {
            return Err(system.not_finite(state));
        }
        state.work = kinetic + stored + state.fracture.released + state.memory.dissipated;
        (state.step, state.counts.iteration, state.counts.step_iterations) = (0, 0, 0);
        let bonds = BondSums::new(system);
        let frequency = largest_frequency_squared(system, state, masses, self.density, bonds.shortest);
        let contact = system.repulsion().map_or(0.0, |contact| {
            contact.greatest_stiffness(&*system.bonds, &state.displacement).max(contact.pair_stiffness())
        });
        let limits =
            StepLimits { critical_step: critical(frequency), contact, bonds, ..StepLimits::default() };
        let energies = DynamicEnergies { kinetic, turnover: state.work, ..DynamicEnergies::default() };
        let earlier = state.counts.total_iterations;
        state.motion = Motion { begun: true, earlier, limits, energies, ..Motion::default() };
        if let Some(found) = self.time_step.filter(|&found| found > state.motion.limits.critical_step) {
            return Err(Error::TimeStep { found, critical: state.motion.limits.critical_step });
        }
        state.motion.look = StretchLook::new(observed);
        self.record_frequency(system, state, frequency);
        self.cover(system, state);
        let rest = VerletStep { step: 0.0, density: self.density, damping: 0.0, factors: [factor; 2], rate };
        friction_pass(system, state, &masses.volumes, &rest, None);
        surface_pass(system, state, &[]);
        system.begin_flights(state, factor);
        self.break_overstretched(system, state, observed, factor);
        Ok(())
    }

    /// Records the sharp frequency of the present stretches in units of the law's tangent there.
    fn record_frequency<const D: usize>(&self, system: &mut System<D>, state: &mut State<D>, frequency: f64) {
        let tangent = system.material.range(state.motion.look.stretches).least_tangent;
        state.motion.limits.frequency = if frequency > 0.0 { frequency / tangent } else { 0.0 };
        if system.material.has_points() {
            self.measure(system, state, frequency);
        }
    }

    /// Computes the bounds of the critical time step and of the energy for the stretches of the fitted law.
    pub(super) fn cover<const D: usize>(&self, system: &System<D>, state: &mut State<D>) {
        let (law, modulus) = (system.material.range(state.stretches.fitted), system.material.bond_law().1);
        let motion = &mut state.motion;
        // blocks of the tangent's rows: ω² ≤ ‖A_II‖ + Σ‖A_IJ‖ with ‖t′nn + t/λ(1 − nn)‖ ≤ max(|t′|, |t|/λ);
        // Feingold & Varga (1962), doi:10.2140/pjm.1962.12.1241
        let lightest = self.density * system.lightest_ratio();
        let (contact, striking) = (2.0 * motion.limits.contact / lightest, motion.limits.striking);
        // the greatest frequency of a sum is no greater than the sum of both (Weyl)
        let [bound, estimate] = if system.material.has_points() {
            motion.pace.squares(lightest).map(|square| square + contact + striking)
        } else {
            [
                2.0 * (motion.limits.bonds.stiffness * state.stretches.tangent + motion.limits.contact)
                    / lightest
                    + striking,
                motion.limits.frequency * law.mean_tangent + contact + striking,
            ]
        };
        motion.limits.gershgorin_step = critical(bound);
        // nothing free, or a tangent without a positive frequency: only the bound remains
        motion.limits.covered_step = critical(if estimate > 0.0 { estimate.min(bound) } else { bound });
        motion.energies.floor = law.least_energy * modulus * motion.limits.bonds.extent;
        // friction follows the normal force, which neither tangent contains: it gets half of ω²Δt²
        let part = if system.friction().is_some() { std::f64::consts::FRAC_1_SQRT_2 } else { 1.0 };
        motion.limits.longest = self.time_step.unwrap_or(part * self.safety * motion.limits.covered_step);
    }

    /// Raises the contact stiffness of the limits if more particles are in contact than so far.
    fn cover_contact<const D: usize>(&self, system: &System<D>, state: &mut State<D>) {
        let Some(contact) = system.repulsion() else { return };
        let striking = contact.striking(&state.displacement);
        if striking > state.motion.limits.striking {
            state.motion.limits.striking = GROWTH * striking;
            self.cover(system, state);
        }
        self.raise_contact(system, state, contact.greatest_stiffness(&*system.bonds, &state.displacement));
    }

    /// Raises the contact stiffness of the limits to that found, N/m⁴, if it is greater.
    pub(super) fn raise_contact<const D: usize>(
        &self,
        system: &System<D>,
        state: &mut State<D>,
        greatest: f64,
    ) {
        if greatest > state.motion.limits.contact {
            state.motion.limits.contact = GROWTH * greatest;
            self.cover(system, state);
        }
    }

    /// Runs one step.
    fn advance<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        masses: &SiteMasses,
        end: f64,
    ) -> Result<(), Error> {
        let before = self.factor(system, state.motion.time).0;
        let (density, damping) = (self.density, self.damping);
        let start = self.follows(system).then(|| (state.displacement.clone(), state.velocity.clone()));
        let flights = state.contact.flights.clone();
        let (mut cuts, slack) = (0, state.motion.look.slack);
        let (after, leap, first) = loop {
            let after = state.motion.steps.time_after(end);
            let (factor, rate) = self.factor(system, after);
            let step = state.motion.steps.time_step;
            let leap = VerletStep { step, density, damping, factors: [before, factor], rate };
            // the drift goes to the factor times this, the kick takes its increment
            system.set_ends(factor);
            let first = leap_pass(&system.loads, state, masses, &leap);
            system.set_rates(before, factor);
            // two ends, √D components
            let strain = 2.0 * (D as f64).sqrt() * first.increment / state.motion.limits.bonds.shortest;
            state.motion.look.slack = slack + strain;
            system.leap_flights(state, &flights, step);
            system.move_surfaces(factor, after);
            system.set_duration(state, step)?;
            system.prepare(&mut state.displacement);
            let Some((displacement, velocity)) = &start else { break (after, leap, first) };
            cuts += 1;
            if cuts > MOST_CUTS || !self.is_too_long(system, state, strain) {
                break (after, leap, first);
            }
            // a step whose end requires a shorter one is undone
            state.displacement.clone_from(displacement);
            state.velocity.clone_from(velocity);
            state.contact.flights.clone_from(&flights);
            system.place_flights(state);
            system.move_surfaces(before, state.motion.time);
            state.motion.plan(end);
        };
        let factor = leap.factors[1];
        system.set_forces(factor, &state.displacement);
        let (friction, rubbing, rubs) = (
            state.contact.friction.take(),
            state.contact.surface_friction.clone(),
            system.friction().is_some(),
        );
        let due = state.motion.look.is_due(state.stretches.fitted, system.breaking_stretch());
        let look = due || !system.sliding.is_empty();
        // forces that are not final yet
        let late = look || rubs || !system.loads.rigid.is_empty();
        let (mut second, observed) = force_pass(system, state, masses, &leap, look, !late);
        system.count_evaluation(state);
        if look {
            state.stretches.observe(observed);
            state.motion.look = StretchLook::new(observed);
            if state.stretches.observed.high.is_finite() && system.widen(state)? {
                refresh(system, state, factor, None);
                system.count_evaluation(state);
                self.cover(system, state);
            }
        }
        if late {
            friction_pass(system, state, &masses.volumes, &leap, friction);
            system.level_forces(state);
            second = kick_pass(&system.loads, state, masses, &leap);
        }
        surface_pass(system, state, &rubbing);
        system.kick_flights(state, factor, leap.step);
        let motion = &mut state.motion;
        motion.time = after;
        motion.steps.taken += 1;
        state.counts.iterate();
        self.account(state, first, second)?;
        let broken = look && self.break_overstretched(system, state, observed, factor);
        state.memory.dissipated += system.end_time_step(state)?;
        self.cover_contact(system, state);
        let follows = self.follows(system);
        if follows {
            self.follow(system, state, masses, broken);
        }
        let motion = &mut state.motion;
        let longer = follows && motion.limits.longest > LONGER * motion.steps.time_step;
        if (longer || motion.limits.longest < (1.0 - 1e-9) * motion.steps.time_step)
            && motion.steps.taken < motion.steps.planned
        {
            motion.plan(end);
        }
        Ok(())
    }

    /// Updates the energies of a step and checks them.
    pub(super) fn account<const D: usize>(
        &self,
        state: &mut State<D>,
        first: VerletSums,
        second: VerletSums,
    ) -> Result<(), Error> {
        let motion = &mut state.motion;
        motion.energies.kinetic = second.kinetic;
        motion.energies.damped += first.damped + second.damped;
        state.work += first.work + second.work;
        let gone = state.fracture.released
            + state.memory.dissipated
            + motion.energies.damped
            + motion.energies.rubbed;
        let available = state.work - gone - motion.energies.floor;
        motion.energies.turnover = motion.energies.turnover.max(available).max(gone);
        let most = available.max(0.0) + EXCESS * motion.energies.turnover;
        let grown =
            motion.energies.kinetic > most && state.counts.total_iterations > motion.earlier + EARLY_STEPS;
        if grown || !motion.energies.kinetic.is_finite() || !available.is_finite() {
            return Err(Error::Unstable {
                time: motion.time,
                step: state.counts.total_iterations,
                kinetic: motion.energies.kinetic,
                available,
                time_step: motion.steps.time_step,
                critical: motion.limits.covered_step,
            });
        }
        Ok(())
    }

    /// Breaks overstretched bonds and updates the forces; returns true if any broke.
    fn break_overstretched<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        observed: StretchRange,
        factor: f64,
    ) -> bool {
        if !system.may_break(observed) {
            return false;
        }
        let sites = system.break_bonds(state);
        refresh(system, state, factor, Some(&sites));
        !sites.is_empty()
    }

    pub(super) fn status<const D: usize>(&self, state: &State<D>, restartable: bool) -> Status {
        let left = 1.0 - state.motion.steps.taken as f64 / state.motion.steps.planned as f64;
        Status { residual: left, ..state.status(self.records, 0.1, self.damping, restartable) }
    }

    /// Adds a row of history.
    fn record<const D: usize>(&self, system: &mut System<D>, state: &mut State<D>) {
        let observed = stretch_range(&*system.bonds, &state.displacement);
        system.count_evaluation(state);
        let stored = stored(system, state, observed);
        let (factor, _) = self.factor(system, state.motion.time);
        let (pull, push) = system.conjugates(state);
        let row = system.row(state, [factor, pull, push], observed, stored);
        state.history.push(row);
    }
}
