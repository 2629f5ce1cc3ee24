//! Explicit dynamics on a graphics card: the host decides as [`VelocityVerlet`] does, from sums of each step.
//!
//! As long as no stretch can leave the fitted law or reach the critical one, several steps are taken before
//! their sums are read; where the sums show that stretches were to be looked at on the way, the card goes
//! back to that step. Otherwise a step is taken at a time, and the stretches that its forces meet are looked
//! at. Pairs of particles in contact are listed by the host, whenever particles have moved so far since that
//! others may touch.

use super::device_body::refuse;
use super::device_run::{DeviceRun, GROWTH, TakenStep};
use super::method::{StepCallback, Watch};
use super::motion::StretchLook;
use super::state::State;
use super::system::System;
use super::verlet::VelocityVerlet;
use super::verlet_friction::work_of_pushes;
use super::verlet_step::VerletSums;
use crate::error::Error;
use crate::gpu::{Device, DeviceStep, MOST_STEPS};

/// Steps for which the list of pairs has to hold.
const FEW: f64 = 4.0;

impl VelocityVerlet {
    /// As [`Method::solve`](super::Method::solve), with steps on a device: of a lattice of a bond law, in
    /// contact with itself and with planes at most, without friction. `watch` may keep the state after a row
    /// of history only.
    ///
    /// # Errors
    /// As there; [`Error::Device`] for what the device cannot do, or where it fails.
    pub fn solve_on<const D: usize>(
        &self,
        device: &Device,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
        finished: &mut StepCallback<D>,
    ) -> Result<(), Error> {
        refuse(system)?;
        refuse_in_steps(system)?;
        self.open(system, state)?;
        let mut run = DeviceRun::new(device, system, state)?;
        while state.step < self.records {
            let end = self.end_of_row(state);
            while state.motion.steps.taken < state.motion.steps.planned {
                self.advance_on(&mut run, system, state, end, watch)?;
            }
            [state.displacement, state.velocity, state.force] = run.body.state()?;
            run.renew_pairs(system, &state.displacement);
            self.close_row(system, state)?;
            finished(&*system.bonds, state)?;
            watch(&self.status(state, true), state)?;
        }
        Ok(())
    }

    /// Some steps: many where no stretch has to be looked at, one otherwise.
    fn advance_on<const D: usize>(
        &self,
        run: &mut DeviceRun<D>,
        system: &mut System<D>,
        state: &mut State<D>,
        end: f64,
        watch: &mut Watch<D>,
    ) -> Result<(), Error> {
        let motion = &state.motion;
        let room = motion.look.room(state.stretches.fitted, system.breaking_stretch());
        let left = motion.steps.planned - motion.steps.taken;
        let most = (left as f64).min(MOST_STEPS as f64);
        if run.pairs.moves_left() < most.min(FEW) {
            let displacement = run.body.displacement()?;
            run.renew_pairs(system, &displacement);
        }
        // not a number, or none below 2: one
        let many = (room / (GROWTH * run.strain)).min(most).min(run.pairs.moves_left());
        if many >= 2.0 {
            self.advance_many(run, system, state, (end, many as usize), watch)
        } else {
            self.advance_one(run, system, state, end)?;
            watch(&self.status(state, false), state)
        }
    }

    /// Constants of the step that begins `ahead` steps from now, and the time at its end.
    fn step_ahead<const D: usize>(
        &self,
        system: &System<D>,
        state: &State<D>,
        ahead: usize,
        end: f64,
    ) -> (DeviceStep, f64) {
        let mut steps = state.motion.steps;
        steps.taken += ahead as u64;
        let before = match ahead {
            0 => state.motion.time,
            _ => super::motion::EqualSteps { taken: steps.taken - 1, ..steps }.time_after(end),
        };
        let after = steps.time_after(end);
        let (factor, rate) = self.factor(system, after);
        let factors = [self.factor(system, before).0, factor];
        let loading = factors.map(|factor| system.loads.force_factor(factor));
        let (time_step, density, damping) = (steps.time_step, self.density, self.damping);
        (DeviceStep { time_step, density, damping, factors, loading, rate }, after)
    }

    fn advance_many<const D: usize>(
        &self,
        run: &mut DeviceRun<D>,
        system: &mut System<D>,
        state: &mut State<D>,
        (end, many): (f64, usize),
        watch: &mut Watch<D>,
    ) -> Result<(), Error> {
        let steps: Vec<(DeviceStep, f64)> =
            (0..many).map(|ahead| self.step_ahead(system, state, ahead, end)).collect();
        let constants: Vec<DeviceStep> = steps.iter().map(|(step, _)| *step).collect();
        let before = run.body.time_step();
        run.body.keep_state();
        for (slot, step) in steps.iter().enumerate() {
            run.step(system, step);
            run.keep_sums(slot);
        }
        let sums = run.sums(&constants)?;
        for (taken, (sums, step)) in sums.iter().zip(&steps).enumerate() {
            let strain = run.strain_of(state, &sums.sums);
            let mut look = state.motion.look;
            look.slack += strain;
            if look.is_due(state.stretches.fitted, system.breaking_stretch())
                || !run.keeps_pairs(&sums.sums)
                || Self::is_stiffer(system, state, sums.stiffness)
            {
                run.body.take_back(before);
                run.force(system, constants[0].factors[0]);
                steps[..taken].iter().for_each(|step| run.step(system, step));
                run.strain = f64::INFINITY;
                return Ok(());
            }
            state.motion.look = look;
            run.strain = strain;
            system.count_evaluation(state);
            self.count(system, state, step, sums)?;
            watch(&self.status(state, false), state)?;
        }
        Ok(())
    }

    fn advance_one<const D: usize>(
        &self,
        run: &mut DeviceRun<D>,
        system: &mut System<D>,
        state: &mut State<D>,
        end: f64,
    ) -> Result<(), Error> {
        let (step, after) = self.step_ahead(system, state, 0, end);
        run.half_step(system, &(step, after));
        if run.pairs.are_listed() {
            run.body.keep_sums(0);
            if !run.keeps_pairs(&run.body.sums(&[step])?[0]) {
                let displacement = run.body.displacement()?;
                run.renew_pairs(system, &displacement);
            }
        }
        let loading = step.loading[1];
        run.body.pull(loading, true);
        let (observed, listed) = run.body.stretch_range()?;
        run.body.keep_sums(0);
        let sums = run.body.sums(&[step])?[0];
        run.strain = run.strain_of(state, &sums);
        state.motion.look.slack += run.strain;
        system.count_evaluation(state);
        let look = state.motion.look.is_due(state.stretches.fitted, system.breaking_stretch());
        if look {
            state.stretches.observe(observed);
            state.motion.look = StretchLook::new(observed);
            if observed.high.is_finite() && system.widen(state)? {
                run.take_law(system)?;
                run.body.pull(loading, false);
                system.count_evaluation(state);
                self.cover(system, state);
            }
        }
        run.body.kick(&step);
        run.keep_sums(0);
        let sums = run.sums(&[step])?;
        let mut stiffness = sums[0].stiffness;
        self.count(system, state, &(step, after), &sums[0])?;
        if look && system.is_overstretched(observed) {
            let list = run.overstretched(system, state, listed)?;
            let sites = system.sever_bonds(state, list, None);
            run.take_severed(system, state, &sites, loading);
            stiffness = run.stiffness_of_pairs()?;
        }
        if let Some(contact) = system.repulsion() {
            self.raise_contact(system, state, contact.stiffness_with_pairs(stiffness));
        }
        let motion = &mut state.motion;
        if motion.limits.longest < (1.0 - 1e-9) * motion.steps.time_step
            && motion.steps.taken < motion.steps.planned
        {
            motion.plan(end);
        }
        Ok(())
    }

    /// Returns true if contact is stiffer than the limits of time steps include.
    fn is_stiffer<const D: usize>(system: &System<D>, state: &State<D>, pairs: f64) -> bool {
        let greatest = system.repulsion().map_or(0.0, |contact| contact.stiffness_with_pairs(pairs));
        greatest > state.motion.limits.contact
    }

    /// Counts a step with its sums.
    fn count<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        (step, after): &(DeviceStep, f64),
        TakenStep { sums, pushes, .. }: &TakenStep,
    ) -> Result<(), Error> {
        if system.contact.is_some() {
            system.move_surfaces(step.factors[1], *after);
        }
        if let Some(contact) = system.repulsion().filter(|_| !pushes.is_empty()) {
            let pushing = contact.plane_forces(pushes);
            state.work += work_of_pushes(contact, state, pushing);
        }
        state.motion.time = *after;
        state.motion.steps.taken += 1;
        state.counts.iterate();
        let half =
            |k: usize| VerletSums { work: sums.work[k], damped: sums.damped[k], ..VerletSums::default() };
        let first = VerletSums { increment: sums.increment, ..half(0) };
        self.account(state, first, VerletSums { kinetic: sums.kinetic, ..half(1) })
    }
}

/// Refuses what only the host does in steps of time.
fn refuse_in_steps<const D: usize>(system: &System<D>) -> Result<(), Error> {
    let formulas = system.loads.curved.as_ref().is_some_and(|curved| !curved.fields.is_empty());
    let what = [
        (formulas, "formulas of place and time"),
        (!system.density_ratios.is_empty(), "parts of their own density"),
    ];
    match what.iter().find(|(has, _)| *has) {
        Some((_, what)) => Err(Error::Device(format!("unexpected {what}: only the processor does that"))),
        None => Ok(()),
    }
}
