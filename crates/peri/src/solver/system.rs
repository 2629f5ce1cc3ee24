//! What is solved: a body under its law and loads, bonds that may break, and everything a checkpoint holds of it.

use super::balance::{Balance, Scale};
use super::load::Loads;
use super::verlet::Motion;
use crate::bonds::{Bonds, Overstretched, StretchRange, fingerprint, overstretched, stretch_range};
use crate::contact::{Contact, Touching};
use crate::error::Error;
use crate::field::Field;
use crate::potential::{BondPotential, KernelFit};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Stretches below this are not fitted …
const SMALLEST_STRETCH: f64 = 1e-3;
/// … nor below this where bonds break: beside a crack without contact bonds are crushed to nothing.
const CRUSHED: f64 = 0.1;

/// When bonds break: in tension only, for good.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breaking {
    /// Critical bond stretch λ_c.
    pub stretch: f64,
    /// When stretches are looked at.
    pub policy: Policy,
}

/// When stretches are compared with the critical one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    /// In equilibrium: all overstretched bonds break at once, and a new equilibrium is sought until none is left.
    /// Independent of the method.
    #[default]
    AtEquilibrium,
    /// In every iteration of dynamic relaxation, on its way to equilibrium: cheaper, and breaks bonds that an overshoot
    /// stretches.
    EachIteration,
}

/// The system under solution.
pub struct System<'a, const D: usize> {
    /// The bonds; their law is set by the solver.
    pub bonds: &'a mut dyn Bonds<D>,
    /// The bond law.
    pub law: &'a dyn BondPotential,
    /// kθ, N/m⁶ (3D) with the dimension's own convention.
    pub modulus: f64,
    /// Loads at factor 1. Particles without bonds lose theirs.
    pub loads: Cow<'a, Loads<D>>,
    /// Load factor at the end of each step.
    pub factors: &'a [f64],
    /// Whether and when bonds break.
    pub breaking: Option<Breaking>,
    /// Stop after the step whose load is below this part of the largest, once bonds broke; 0: never.
    pub stop_below: f64,
    /// Largest relative error of the fitted bond law.
    pub fit_bound: f64,
    /// Repulsion of particles without a bond, or a look at how they overlap, where wanted.
    pub contact: Option<Contact<D>>,
    /// What forces out of balance are measured by.
    pub(super) scale: Scale,
    /// The load factor and its rate over the time, s, in explicit dynamics, in place of the ramp.
    pub course: Option<&'a Course<'a>>,
    /// What is looked at in every row of the history, see [`Record::seen`].
    pub observer: Option<&'a Observer<'a, D>>,
}

/// Load factor and its rate, 1/s, at a time, s.
pub type Course<'a> = dyn Fn(f64) -> (f64, f64) + Sync + 'a;

/// Numbers of a body in a state, for its history.
pub type Observer<'a, const D: usize> = dyn Fn(&dyn Bonds<D>, &State<D>) -> Vec<f64> + Sync + 'a;

/// One load step in equilibrium.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Load factor.
    pub factor: f64,
    /// Force, N, that does the loads' work on `displacement`, see [`Loads::response`].
    pub load: f64,
    /// Displacement of the grips against each other, or of where forces act, m.
    pub displacement: f64,
    /// Reaction on each region of prescribed displacement, N.
    pub reactions: Vec<[f64; 3]>,
    /// Out-of-balance force over its reference.
    pub residual: f64,
    /// Iterations of this step.
    pub iterations: u64,
    /// Equilibria sought: 1, and one more for each time that bonds broke.
    pub rounds: u64,
    /// Bonds broken so far.
    pub broken: u64,
    /// Particles that have lost all their bonds so far.
    pub detached: u64,
    /// Energy stored in bonds and contact, J.
    pub stored: f64,
    /// Sums of all forces and moments.
    pub balance: Balance,
    /// What touches, where that is looked at.
    pub contact: Option<Touching>,
    /// Work of the loads so far, J.
    pub work: f64,
    /// Energy that broken bonds held when they broke, J.
    pub released: f64,
    /// Largest intact stretch.
    pub largest_stretch: f64,
    /// Time, s; 0 without dynamics.
    pub time: f64,
    /// Kinetic energy, J.
    pub kinetic: f64,
    /// Energy that mass-proportional damping has taken so far, J.
    pub damped: f64,
    /// What [`System::observer`] sees.
    pub seen: Vec<f64>,
}

/// Bonds that broke together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Load step, from 0.
    pub step: usize,
    /// How many.
    pub bonds: u64,
    /// Which ones, as a number: two sets of bonds of one body that differ have different ones.
    pub fingerprint: u64,
    /// Load of the equilibrium before, N, see [`Record::load`]; 0 in dynamics.
    pub load: f64,
}

/// Everything an interrupted run needs to go on with the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct State<const D: usize> {
    /// Displacement, m.
    pub displacement: Field<D>,
    /// Velocity, m per (fictitious) second.
    pub velocity: Field<D>,
    /// Force density with loads, N/m³: out of balance where free, reaction where held.
    pub force: Field<D>,
    /// Load steps finished.
    pub step: usize,
    /// Whether this step's first guess is made.
    pub(super) predicted: bool,
    /// Equilibria found in this step.
    pub round: u64,
    /// Iterations towards the current equilibrium.
    pub iteration: u64,
    /// Iterations of the current step.
    pub step_iterations: u64,
    /// Iterations of all steps.
    pub total_iterations: u64,
    /// Force evaluations so far.
    pub evaluations: u64,
    /// Bond evaluations so far: intact directed bonds at each force evaluation.
    pub bond_evaluations: u64,
    /// Stretches [λ_low, λ_high] that the fitted law covers.
    pub fitted: [f64; 2],
    /// Stretches met, as e = λ² − 1.
    pub met: StretchRange,
    /// Stretches at the last equilibrium.
    pub(super) balanced_stretches: StretchRange,
    /// Largest relative bond tangent max(|t′|, |t|/λ) kθ over the fitted stretches.
    pub(super) tangent: f64,
    /// Greatest reference force of an equilibrium.
    pub(super) reference: f64,
    /// Reference force of the last iterate alone, and what it is at least.
    pub(super) present: f64,
    pub(super) floor: f64,
    /// Displacements of the two equilibria before the last, where no bond has broken since.
    pub(super) past: Vec<Field<D>>,
    /// Residual of the last iteration.
    pub residual: f64,
    /// Searches for equilibrium that ended above the tolerance.
    pub unconverged: u64,
    /// Bonds broken so far.
    pub broken: u64,
    /// When they broke.
    pub events: Vec<Event>,
    /// Particles that have lost all their bonds so far.
    pub detached: u64,
    /// Energy of broken bonds when they broke, J.
    pub released: f64,
    /// Work of the loads so far, J.
    pub work: f64,
    /// Factor, and the loads' conjugate sums, at the last equilibrium.
    pub(super) balanced: [f64; 3],
    /// Intact bonds, once any has broken.
    pub(super) intact: Option<Vec<u64>>,
    /// Time and energies of explicit dynamics.
    pub motion: Motion,
    /// The finished steps.
    pub history: Vec<Record>,
}

impl<const D: usize> State<D> {
    /// The undeformed body.
    pub fn new(slots: usize) -> Self {
        Self {
            displacement: Field::zeros(slots),
            velocity: Field::zeros(slots),
            force: Field::zeros(slots),
            step: 0,
            predicted: false,
            round: 0,
            iteration: 0,
            step_iterations: 0,
            total_iterations: 0,
            evaluations: 0,
            bond_evaluations: 0,
            fitted: [0.95, 1.05],
            met: StretchRange::REST,
            balanced_stretches: StretchRange::REST,
            tangent: 0.0,
            reference: 0.0,
            present: 0.0,
            floor: 0.0,
            past: Vec::new(),
            residual: 0.0,
            unconverged: 0,
            broken: 0,
            events: Vec::new(),
            detached: 0,
            released: 0.0,
            work: 0.0,
            balanced: [0.0; 3],
            intact: None,
            motion: Motion::default(),
            history: Vec::new(),
        }
    }
}

/// One iteration, for progress bars and logs.
#[derive(Clone, Copy, Debug)]
pub struct Status {
    /// Load step, from 0.
    pub step: usize,
    /// Load steps in all.
    pub steps: usize,
    /// Iteration towards the current equilibrium.
    pub iteration: u64,
    /// Out-of-balance force over its reference.
    pub residual: f64,
    /// The tolerance on it.
    pub tolerance: f64,
    /// Load of the last step that is finished, N.
    pub load: Option<f64>,
    /// Damping coefficient used.
    pub damping: f64,
    /// Bonds broken so far.
    pub broken: u64,
    /// Whether the state may be saved here: a run that begins from it takes the same way.
    pub restartable: bool,
}

impl<'a, const D: usize> System<'a, D> {
    /// A body whose bonds do not break.
    pub fn new(
        bonds: &'a mut dyn Bonds<D>,
        law: &'a dyn BondPotential,
        modulus: f64,
        loads: &'a Loads<D>,
        factors: &'a [f64],
    ) -> Self {
        let loads = Cow::Borrowed(loads);
        Self {
            bonds,
            law,
            modulus,
            loads,
            factors,
            breaking: None,
            stop_below: 0.0,
            fit_bound: 1e-9,
            contact: None,
            scale: Scale::default(),
            course: None,
            observer: None,
        }
    }

    /// Brings bonds, law and loads to where a state is: at rest, or where an interrupted run was.
    ///
    /// # Errors
    /// [`Error::Geometry`] where the state belongs to another body, or as [`KernelFit::new`].
    pub fn restore(&mut self, state: &mut State<D>) -> Result<(), Error> {
        if let Some(words) = &state.intact {
            if !self.bonds.restore(words) {
                let found = format!("a state of {} words of bonds, which is another body's", words.len());
                return Err(Error::geometry(found));
            }
            let particles = self.bonds.particles().to_vec();
            self.release(particles.iter().copied());
        }
        self.rebuild_contact(&state.displacement);
        state.fitted[1] = state.fitted[1].min(self.most());
        self.fit(state)
    }

    /// Has contact look for pairs again where particles have moved far since it last did. To be called before the forces
    /// of a new displacement, once; it makes no difference to them how often it looks.
    pub fn update_contact(&mut self, displacement: &Field<D>) {
        if let Some(contact) = self.contact.as_mut().filter(|contact| contact.repels()) {
            contact.update(&*self.bonds, displacement);
        }
    }

    /// Has contact look for pairs, as it must where bonds have changed.
    fn rebuild_contact(&mut self, displacement: &Field<D>) {
        if let Some(contact) = self.contact.as_mut().filter(|contact| contact.repels()) {
            contact.rebuild(&*self.bonds, displacement);
        }
    }

    /// Contact, where it does more than look.
    pub fn repulsion(&self) -> Option<&Contact<D>> {
        self.contact.as_ref().filter(|contact| contact.repels())
    }

    /// What touches in a state, where that is looked at.
    pub(super) fn touching(&mut self, state: &State<D>) -> Option<Touching> {
        let contact = self.contact.as_mut()?;
        if !contact.repels() {
            contact.rebuild(&*self.bonds, &state.displacement);
        }
        Some(contact.touching(&state.displacement))
    }

    /// Force densities of a work item, without loads: bonds, and all that acts between particles beside them.
    pub fn internal_force(
        &self,
        displacement: &Field<D>,
        chunk: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) {
        self.bonds.force(displacement, chunk, force, track);
        if let Some(contact) = self.repulsion() {
            contact.force(displacement, chunk, force);
        }
    }

    /// What the observer sees in a state.
    pub(super) fn seen(&self, state: &State<D>) -> Vec<f64> {
        self.observer.map_or_else(Vec::new, |observer| observer(&*self.bonds, state))
    }

    /// Counts one evaluation of all forces.
    pub fn count_evaluation(&self, state: &mut State<D>) {
        state.evaluations += 1;
        state.bond_evaluations += self.bonds.directed_bonds();
    }

    /// Severs all bonds beyond the critical stretch; the slots of their ends.
    pub fn break_bonds(&mut self, state: &mut State<D>) -> Vec<u32> {
        let Some(breaking) = self.breaking else { return Vec::new() };
        let critical = breaking.stretch * breaking.stretch - 1.0;
        let list = overstretched(&*self.bonds, &state.displacement, critical);
        self.count_evaluation(state);
        if list.is_empty() {
            return Vec::new();
        }
        // half of a bond's energy 2kθ|ξ|φ w V_I V_J from either end
        let energy = |bond: &Overstretched| {
            // beyond what is fitted q is held: the energy grows with half of it
            let (stretch, most) = ((1.0 + bond.elongation).sqrt(), self.most());
            let mut energy = self.law.energy(stretch.min(most));
            if stretch > most {
                let beyond = bond.elongation - (most * most - 1.0);
                energy += 0.5 * beyond * self.law.tension(most) / most;
            }
            self.bonds.volume(bond.slot as usize) * bond.weight * bond.length * energy
        };
        state.released += self.modulus * list.iter().map(energy).sum::<f64>();
        let bonds = list.len() as u64 / 2;
        state.broken += bonds;
        let [factor, pull, push] = state.balanced;
        let load = self.loads.response(&*self.bonds, factor, (pull, push)).0;
        state.events.push(Event { step: state.step, bonds, fingerprint: fingerprint(&list), load });
        self.bonds.sever(&list);
        self.rebuild_contact(&state.displacement);
        state.intact = Some(self.bonds.intact());
        let mut slots: Vec<u32> = list.iter().map(|bond| bond.slot).collect();
        slots.dedup();
        state.detached += self.release(slots.iter().copied());
        slots
    }

    /// Takes the body forces off particles without bonds, which nothing could balance; their number.
    fn release(&mut self, slots: impl Iterator<Item = u32>) -> u64 {
        let mut count = 0;
        for slot in slots {
            if self.bonds.is_alone(slot as usize) {
                count += 1;
                if self.loads.body_force.as_ref().is_some_and(|b| b.get(slot as usize) != [0.0; D]) {
                    self.loads.to_mut().unload(slot as usize);
                }
            }
        }
        count
    }

    /// Whether every stretch of the state lies within the fit; widens it otherwise.
    pub(super) fn covers_stretches(&mut self, state: &mut State<D>) -> Result<bool, Error> {
        let met = stretch_range(&*self.bonds, &state.displacement);
        self.count_evaluation(state);
        state.balanced_stretches = met;
        state.met = state.met.join(met);
        Ok(!self.widen(state)?)
    }

    /// Widens the fitted range where stretches have left it, and the tangent with it.
    pub(super) fn widen(&mut self, state: &mut State<D>) -> Result<bool, Error> {
        // bonds crushed below that are extrapolated: no fit covers l → 0
        let low = (1.0 + state.met.low).max(0.0).sqrt().max(self.least());
        let high = (1.0 + state.met.high).sqrt().min(self.most());
        if low >= state.fitted[0] && high <= state.fitted[1] {
            return Ok(false);
        }
        // twice the strain met, so that a growing load does not refit at every look
        state.fitted[0] = state.fitted[0].min((1.0 - 2.0 * (1.0 - low)).max(0.5 * low)).max(self.least());
        state.fitted[1] = state.fitted[1].max(1.0 + 2.0 * (high - 1.0)).min(self.most());
        self.fit(state)?;
        Ok(true)
    }

    /// The smallest stretch that is fitted.
    fn least(&self) -> f64 {
        if self.breaking.is_some() { CRUSHED } else { SMALLEST_STRETCH }
    }

    /// The largest stretch that is fitted: bonds beyond it are about to break, however long they are.
    fn most(&self) -> f64 {
        self.breaking.map_or(f64::INFINITY, |b| b.stretch + 0.25 * (b.stretch - 1.0))
    }

    /// The part of stretches that the law itself covers; beyond it q is held, and energies grow with e.
    pub fn fitted_part(&self, met: StretchRange) -> StretchRange {
        if self.breaking.is_none() {
            return met;
        }
        let (least, most) = (self.least(), self.most());
        StretchRange { low: met.low.max(least * least - 1.0), high: met.high.min(most * most - 1.0) }
    }

    fn fit(&mut self, state: &mut State<D>) -> Result<(), Error> {
        let mut fit = KernelFit::new(self.law, state.fitted, self.fit_bound)?;
        if self.breaking.is_some() {
            fit = fit.held();
        }
        self.bonds.set_law(&fit, self.modulus);
        let [low, high] = state.fitted;
        let samples = 200;
        let tangent = (0..=samples)
            .map(|k| {
                let stretch = low + (high - low) * f64::from(k) / f64::from(samples);
                let slope = self.law.tension_derivative(stretch).abs();
                slope.max(self.law.tension(stretch).abs() / stretch)
            })
            .fold(0.0, f64::max);
        state.tangent = tangent * self.modulus;
        Ok(())
    }

    /// The error that names where a state has ceased to be finite.
    pub(super) fn not_finite(&self, state: &State<D>) -> Error {
        let bonds = &*self.bonds;
        let fields =
            [("displacement", &state.displacement), ("velocity", &state.velocity), ("force", &state.force)];
        for (quantity, field) in fields {
            if let Some((slot, _)) = field.non_finite() {
                let particle = bonds.particles().partition_point(|&s| (s as usize) < slot);
                return Error::NotFinite {
                    quantity,
                    particle,
                    position: bonds.position(slot).to_vec(),
                    step: state.step,
                    iteration: state.iteration,
                };
            }
        }
        // every entry is finite, their squares are not: the greatest force is to blame
        let size = |slot: u32| state.force.get(slot as usize).iter().fold(0.0_f64, |m, f| m.max(f.abs()));
        let particles = bonds.particles().iter().enumerate();
        let greatest = particles.max_by(|a, b| size(*a.1).total_cmp(&size(*b.1)));
        Error::NotFinite {
            quantity: "sum of squared forces",
            particle: greatest.map_or(0, |(particle, _)| particle),
            position: greatest.map_or_else(Vec::new, |(_, &slot)| bonds.position(slot as usize).to_vec()),
            step: state.step,
            iteration: state.iteration,
        }
    }
}
