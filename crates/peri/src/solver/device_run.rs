//! A body on a graphics card in explicit dynamics: steps, and what the host reads of them.

use super::device_body::{critical, lattice, lattice_with_law, limit, loads, pairs, planes};
use super::device_pairs::ListedPairs;
use super::state::State;
use super::system::System;
use crate::bonds::{LatticeBonds, Overstretched};
use crate::contact::{Contact, RigidSurface};
use crate::error::Error;
use crate::field::Field;
use crate::gpu::{Device, DeviceBody, DeviceStep, DrivenSites, StepSums};

/// Strain and way of a step, over those of the last, that steps taken together allow for.
pub const GROWTH: f64 = 1.5;

/// A body on a card in a run.
pub struct DeviceRun<const D: usize> {
    /// The body.
    pub body: DeviceBody<D>,
    /// Greatest change of a stretch in the last step, at most; ∞ where it is not known.
    pub strain: f64,
    /// Pairs of particles that may touch.
    pub pairs: ListedPairs,
    /// True if planes move.
    pushed: bool,
    /// Sites of prescribed displacements and of body forces that are not proportional to the load factor.
    driven: Option<[DrivenSites; 2]>,
}

/// Sums of a step, with contact.
pub struct TakenStep {
    /// Sums over particles.
    pub sums: StepSums,
    /// Sizes of the forces of planes, N, if any moves.
    pub pushes: Vec<f64>,
    /// Greatest stiffness of pairs on a particle, N/m⁴.
    pub stiffness: f64,
}

impl<const D: usize> DeviceRun<D> {
    /// Puts the body of a system in a state on a device.
    ///
    /// # Errors
    /// [`Error::Device`] for what the device cannot do, or where it fails.
    pub fn new(device: &Device, system: &mut System<D>, state: &State<D>) -> Result<Self, Error> {
        let body = body_of(device, system, state)?;
        let driven = driven_sites(system).map(|sites| sites.map(|sites| body.list_driven(sites)));
        let pushed = system.contact.iter().flat_map(Contact::surfaces).any(RigidSurface::moves);
        let (strain, pairs) = (f64::INFINITY, ListedPairs::new());
        let mut run = Self { body, strain, pairs, pushed, driven };
        run.renew_pairs(system, &state.displacement);
        Ok(run)
    }

    /// Takes a step; its constants and the time at its end.
    pub fn step(&mut self, system: &mut System<D>, step: &(DeviceStep, f64)) {
        self.half_step(system, step);
        self.body.pull(step.0.loading[1], false);
        self.body.kick(&step.0);
    }

    /// The first half of a step, and loads and planes at its end.
    pub fn half_step(&mut self, system: &mut System<D>, (step, after): &(DeviceStep, f64)) {
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
    pub fn force(&self, system: &mut System<D>, factor: f64) {
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

    /// Keeps the sums of the step just taken, as number `slot` of those to be read.
    pub fn keep_sums(&self, slot: usize) {
        self.body.keep_sums(slot);
        self.body.keep_stiffness(slot);
        if self.pushed {
            self.body.keep_pushes(slot);
        }
    }

    /// Sums of the steps kept in the first slots.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn sums(&self, steps: &[DeviceStep]) -> Result<Vec<TakenStep>, Error> {
        let count = steps.len();
        let pushes = if self.pushed { self.body.pushes(count)? } else { vec![Vec::new(); count] };
        let contact = pushes.into_iter().zip(self.body.pair_stiffness(count)?);
        let all = self.body.sums(steps)?.into_iter().zip(contact);
        Ok(all.map(|(sums, (pushes, stiffness))| TakenStep { sums, pushes, stiffness }).collect())
    }

    /// Counts the way of a step; returns false if pairs may have come near that are not listed.
    pub fn keeps_pairs(&mut self, sums: &StepSums) -> bool {
        self.pairs.hold_after((D as f64).sqrt() * sums.increment)
    }

    /// Makes the list of pairs hold at a displacement, m, and as long as possible.
    pub fn renew_pairs(&mut self, system: &mut System<D>, displacement: &Field<D>) {
        self.pairs.renew(&mut self.body, system, displacement);
    }

    /// Greatest stiffness of contact on a particle after bonds have broken, N/m⁴.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn stiffness_of_pairs(&self) -> Result<f64, Error> {
        if !self.pairs.are_listed() {
            return Ok(0.0);
        }
        self.body.measure_pairs();
        self.body.keep_stiffness(0);
        Ok(self.body.pair_stiffness(1)?.first().copied().unwrap_or(0.0))
    }

    /// Greatest change of a stretch in a step, at most: two ends, √D components.
    pub fn strain_of(&self, state: &State<D>, sums: &StepSums) -> f64 {
        2.0 * (D as f64).sqrt() * sums.increment / state.motion.limits.bonds.shortest
    }

    /// Takes the fitted law.
    ///
    /// # Errors
    /// [`Error::Device`] for forces that are 0 or not finite.
    pub fn take_law(&mut self, system: &System<D>) -> Result<(), Error> {
        let Some((law, _)) = lattice(system).and_then(LatticeBonds::law) else { return Ok(()) };
        self.body.set_law(law, limit(system))
    }

    /// Listed bonds that break, as the host finds them.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn overstretched(
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
    pub fn take_severed(&mut self, system: &System<D>, state: &State<D>, sites: &[u32], loading: f64) {
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

    /// Takes the faces and particles that planes touch now, pairs with those whose bonds have broken, and the
    /// forces of their sites and of those beside them, as the host renews them: by pieces.
    fn press_severed(&mut self, system: &System<D>, sites: &[u32], loading: f64) {
        self.body.set_planes(planes(system));
        self.body.set_pairs(pairs(system));
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
        self.body.push_pairs(Some(&ranges));
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
    body.set_planes(planes(system));
    let time_step = Some(state.motion.steps.time_step).filter(|&step| step > 0.0);
    let fields = [&state.displacement, &state.velocity, &state.force];
    body.set_state(bonds, fields, time_step.unwrap_or(state.motion.limits.longest))?;
    Ok(body)
}
