//! Explicit dynamics on a graphics card: the host decides as [`VelocityVerlet`] does, from sums of each step.
//!
//! As long as no stretch can leave the fitted law or reach the critical one, several steps are taken before
//! their sums are read; where the sums show that stretches were to be looked at on the way, the card goes
//! back to that step. Otherwise a step is taken at a time, and the stretches that its forces meet are looked
//! at.

use super::device_body::{critical, lattice, lattice_with_law, limit, loads, planes, refuse};
use super::method::{StepCallback, Watch};
use super::motion::StretchLook;
use super::state::State;
use super::system::System;
use super::verlet::VelocityVerlet;
use super::verlet_friction::work_of_pushes;
use super::verlet_step::VerletSums;
use crate::bonds::{LatticeBonds, Overstretched};
use crate::contact::{Contact, RigidSurface};
use crate::error::Error;
use crate::field::Field;
use crate::gpu::{Device, DeviceBody, DeviceStep, DrivenSites, MOST_STEPS, StepSums};

/// Strain of a step, over that of the last, that steps taken together allow for.
const GROWTH: f64 = 1.5;

/// A body on a card in a run.
struct Run<const D: usize> {
    body: DeviceBody<D>,
    /// Greatest change of a stretch in the last step, at most; ∞ where it is not known.
    strain: f64,
    /// True if planes move.
    pushed: bool,
    /// Sites of prescribed displacements and of body forces that are not proportional to the load factor.
    driven: Option<[DrivenSites; 2]>,
}

impl VelocityVerlet {
    /// As [`Method::solve`](super::Method::solve), with steps on a device: of a lattice of a bond law, in
    /// contact with planes at most. `watch` may keep the state after a row of history only.
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
        let body = body_of(device, system, state)?;
        let driven = driven_sites(system).map(|sites| sites.map(|sites| body.driven(sites)));
        let pushed = system.contact.iter().flat_map(Contact::surfaces).any(RigidSurface::moves);
        let mut run = Run { body, strain: f64::INFINITY, pushed, driven };
        while state.step < self.records {
            let end = self.end_of_row(state);
            while state.motion.steps.taken < state.motion.steps.planned {
                self.advance_on(&mut run, system, state, end, watch)?;
            }
            [state.displacement, state.velocity, state.force] = run.body.state()?;
            self.close_row(system, state)?;
            finished(&*system.bonds, state)?;
            watch(&self.status(state, true), state)?;
        }
        Ok(())
    }

    /// Some steps: many where no stretch has to be looked at, one otherwise.
    fn advance_on<const D: usize>(
        &self,
        run: &mut Run<D>,
        system: &mut System<D>,
        state: &mut State<D>,
        end: f64,
        watch: &mut Watch<D>,
    ) -> Result<(), Error> {
        let motion = &state.motion;
        let room = motion.look.room(state.stretches.fitted, system.breaking_stretch());
        let left = motion.steps.planned - motion.steps.taken;
        // not a number, or none below 2: one
        let many = (room / (GROWTH * run.strain)).min(left as f64).min(MOST_STEPS as f64);
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
        run: &mut Run<D>,
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
            let strain = run.strain_of(state, &sums.0);
            let mut look = state.motion.look;
            look.slack += strain;
            if look.is_due(state.stretches.fitted, system.breaking_stretch()) {
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
        run: &mut Run<D>,
        system: &mut System<D>,
        state: &mut State<D>,
        end: f64,
    ) -> Result<(), Error> {
        let (step, after) = self.step_ahead(system, state, 0, end);
        run.leap(system, &(step, after));
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
        self.count(system, state, &(step, after), &sums[0])?;
        if look && system.is_overstretched(observed) {
            let list = run.overstretched(system, state, listed)?;
            let sites = system.sever_bonds(state, list, None);
            run.take_severed(system, state, &sites, loading);
        }
        let motion = &mut state.motion;
        if motion.limits.longest < (1.0 - 1e-9) * motion.steps.time_step
            && motion.steps.taken < motion.steps.planned
        {
            motion.plan(end);
        }
        Ok(())
    }

    /// Counts a step with its sums and the sizes of the forces of planes that move.
    fn count<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        (step, after): &(DeviceStep, f64),
        (sums, pushes): &(StepSums, Vec<f64>),
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

impl<const D: usize> Run<D> {
    fn step(&mut self, system: &mut System<D>, step: &(DeviceStep, f64)) {
        self.leap(system, step);
        self.body.pull(step.0.loading[1], false);
        self.body.kick(&step.0);
    }

    /// The first half of a step, and loads and planes at its end.
    fn leap(&mut self, system: &mut System<D>, (step, after): &(DeviceStep, f64)) {
        let [before, factor] = step.factors;
        if let Some([held, _]) = &self.driven {
            system.set_ends(factor);
            self.body.drive_held(held, &loads(system));
        }
        self.body.half_kick_and_drift(step);
        if let Some([held, _]) = &self.driven {
            system.set_rates(before, factor);
            self.body.drive_held(held, &loads(system));
            self.force(system, factor);
        }
        self.place(system, factor, *after);
    }

    /// Takes the body forces at a load factor.
    fn force(&self, system: &mut System<D>, factor: f64) {
        if let Some([_, pushed]) = &self.driven {
            // none depends on the displacement
            system.set_forces(factor, &Field::zeros(0));
            self.body.drive_pushed(pushed, &loads(system));
        }
    }

    /// Moves planes to a load factor and a time, s.
    fn place(&mut self, system: &System<D>, factor: f64, time: f64) {
        if let Some(contact) = system.repulsion().filter(|_| self.pushed) {
            self.body.place_planes(&contact.plane_shifts_at(factor, time));
        }
    }

    fn keep_sums(&self, slot: usize) {
        self.body.keep_sums(slot);
        if self.pushed {
            self.body.keep_pushes(slot);
        }
    }

    /// Sums of the steps kept, and the sizes of the forces of planes if any moves.
    fn sums(&self, steps: &[DeviceStep]) -> Result<Vec<(StepSums, Vec<f64>)>, Error> {
        let pushes = if self.pushed { self.body.pushes(steps.len())? } else { vec![Vec::new(); steps.len()] };
        Ok(self.body.sums(steps)?.into_iter().zip(pushes).collect())
    }

    /// Greatest change of a stretch in a step, at most: two ends, √D components.
    fn strain_of(&self, state: &State<D>, sums: &StepSums) -> f64 {
        2.0 * (D as f64).sqrt() * sums.increment / state.motion.limits.bonds.shortest
    }

    fn take_law(&mut self, system: &System<D>) -> Result<(), Error> {
        let Some((law, _)) = lattice(system).and_then(LatticeBonds::law) else { return Ok(()) };
        self.body.set_law(law, limit(system))
    }

    /// Listed bonds that break, as the host finds them.
    fn overstretched(
        &self,
        system: &System<D>,
        state: &mut State<D>,
        listed: usize,
    ) -> Result<Vec<Overstretched>, Error> {
        let Some(critical) = critical(system) else { return Ok(Vec::new()) };
        let Some(listed) = self.body.listed(listed)? else {
            [state.displacement, state.velocity, state.force] = self.body.state()?;
            let scan = crate::bonds::StretchScan::default();
            return Ok(crate::bonds::overstretched(&*system.bonds, &state.displacement, critical, &scan));
        };
        let each = listed.into_iter().filter_map(|(site, index, elongation)| {
            let bond = system.bonds.bond(site as usize, index);
            let least = critical.weaker(site as usize, bond.site).powi(2) - 1.0;
            let (length, weight) = (bond.length, bond.weight);
            (elongation > least).then_some(Overstretched { site, index, elongation, length, weight })
        });
        Ok(each.collect())
    }

    /// Takes the bonds left to sites, and their forces with a factor of body forces.
    fn take_severed(&mut self, system: &System<D>, state: &State<D>, sites: &[u32], loading: f64) {
        let Some(words) = state.fracture.intact.as_ref().filter(|_| !sites.is_empty()) else { return };
        let all = system.bonds.sites();
        let rows = words.len() / all;
        let changed = sites.iter().flat_map(|&site| (0..rows).map(move |row| row * all + site as usize));
        let changed: Vec<(usize, u64)> = changed.map(|at| (at, words[at])).collect();
        self.body.replace(&changed);
        if system.loads.body_force.is_some() {
            // particles without bonds have lost theirs
            self.body.set_loads(&loads(system));
        }
        if system.repulsion().is_some() {
            self.press_severed(system, sites, loading);
        } else {
            self.body.pull_at(sites, loading);
        }
    }

    /// Takes the faces and particles that planes touch now, and the forces of sites whose bonds have broken
    /// and of those beside them, as the host renews them: by pieces.
    fn press_severed(&mut self, system: &System<D>, sites: &[u32], loading: f64) {
        let (rows, shifts) = planes(system);
        self.body.set_planes(rows);
        self.body.place_planes(&shifts);
        let piece = system.piece();
        let mut pieces: Vec<usize> = sites.iter().map(|&site| site as usize / piece).collect();
        pieces.sort_unstable();
        pieces.dedup();
        let ranges: Vec<_> = pieces.iter().map(|k| k * piece..(k + 1) * piece).collect();
        let particles = system.bonds.particles();
        let at = |end: usize| particles.partition_point(|&site| (site as usize) < end);
        let among: Vec<u32> =
            ranges.iter().flat_map(|range| &particles[at(range.start)..at(range.end)]).copied().collect();
        self.body.pull_at(&among, loading);
        self.body.press(Some(&ranges));
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

/// Sites of prescribed displacements, and of body forces, that are not proportional to the load factor;
/// `None` if all are.
fn driven_sites<const D: usize>(system: &System<D>) -> Option<[Vec<u32>; 2]> {
    let loads = &system.loads;
    let (turned, curved) = (&loads.turned, &loads.curved);
    let of_curves = curved.iter().flat_map(|curved| &curved.held).flat_map(|region| &region.sites);
    let held = turned.iter().flat_map(|region| &region.sites).chain(of_curves).copied();
    let pushed = curved.iter().flat_map(|curved| &curved.pushed).flat_map(|region| &region.sites).copied();
    let sorted = |mut sites: Vec<u32>| {
        sites.sort_unstable();
        sites.dedup();
        sites
    };
    (!loads.is_proportional()).then(|| [sorted(held.collect()), sorted(pushed.collect())])
}

fn body_of<const D: usize>(
    device: &Device,
    system: &System<D>,
    state: &State<D>,
) -> Result<DeviceBody<D>, Error> {
    let (bonds, (law, modulus)) = lattice_with_law(system)?;
    let mut body = DeviceBody::new(device, bonds, law, modulus)?;
    body.set_law(law, limit(system))?;
    body.set_loads(&loads(system));
    let (rows, shifts) = planes(system);
    body.set_planes(rows);
    body.place_planes(&shifts);
    let time_step = Some(state.motion.steps.time_step).filter(|&step| step > 0.0);
    let fields = [&state.displacement, &state.velocity, &state.force];
    body.set_state(bonds, fields, time_step.unwrap_or(state.motion.limits.longest))?;
    Ok(body)
}
