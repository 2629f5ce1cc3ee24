//! The equations of a body: bonds, material, loads, contact.

use super::criterion::Breaking;
use super::force_scale::{Balance, ForceScale};
use super::load::Loads;
use super::record::StepRecord;
use super::sliding::SlidingBonds;
use super::state::State;
use crate::bonds::{Bonds, StretchScan, not_finite};
use crate::contact::{Contact, ContactSummary, FrictionPair, SurfaceReaction, known_in};
use crate::error::Error;
use crate::field::Field;
use crate::material::{Material, SolverMaterial};
use crate::potential::StretchRange;
use std::borrow::Cow;

/// Renewals of the normal forces of friction in a load step, and the number after which they are averaged:
/// large coefficients may alternate.
const RENEWALS: u32 = 40;
const ALTERNATING: u32 = 8;
/// Residual of the search after a renewal over the relative change of the normal forces in it.
const LOOSE: f64 = 0.1;
/// Residual of the first search of a step with friction.
pub(super) const FIRST_RESIDUAL: f64 = 0.05;

/// The equations of a body under its loads.
pub struct System<'a, const D: usize> {
    /// Bonds; the solver sets their law.
    pub bonds: &'a mut dyn Bonds<D>,
    /// Material in these bonds.
    pub(super) material: Box<dyn SolverMaterial<D> + 'a>,
    /// Loads at factor 1. Particles without bonds lose their body forces.
    pub loads: Cow<'a, Loads<D>>,
    /// Load factor at the end of each step.
    pub factors: Cow<'a, [f64]>,
    /// Time, s, at the end of each step, for a material with a state; empty: steps take no time.
    pub times: Cow<'a, [f64]>,
    /// Fractions of a load step to which the load at which bonds break is found; 1: they break at the end of
    /// the step.
    pub refine: usize,
    /// Lowers the load after bonds broke, until no others would break at once; requires [`Self::refine`]
    /// above 1.
    pub snap_back: bool,
    /// Criterion of breaking; `None` if bonds do not break.
    pub breaking: Option<Breaking>,
    /// Bonds across interfaces that slide, which slip breaks under compression, too.
    pub sliding: SlidingBonds,
    /// Stops after the step whose load is below this fraction of the largest, once bonds broke; 0: never.
    pub stop_below: f64,
    /// Largest relative error of the fitted bond law.
    pub fit_bound: f64,
    /// Repulsion of particles without a bond, or a measurement of their overlaps, if wanted.
    pub contact: Option<Contact<D>>,
    /// Stretches of the last check.
    pub(super) seen_stretches: StretchScan,
    /// Load factor to which periodic sides have moved.
    pub(super) sides_at: f64,
    /// Reference scale of out-of-balance forces.
    pub(super) scale: ForceScale,
    /// Density of each site over that of [`VelocityVerlet`](super::VelocityVerlet), above 0; empty: 1.
    pub density_ratios: Vec<f64>,
    /// Load factor and its rate over the time, s, in explicit dynamics, instead of the ramp.
    pub amplitude: Option<&'a LoadCurve<'a>>,
    /// Values recorded in every row of the history, see [`StepRecord::seen`](super::StepRecord::seen).
    pub observer: Option<&'a StateObserver<'a, D>>,
}

/// Load factor and its rate, 1/s, at a time, s.
pub type LoadCurve<'a> = dyn Fn(f64) -> (f64, f64) + Sync + 'a;

/// Values of a body in a state, for its history.
pub type StateObserver<'a, const D: usize> = dyn Fn(&dyn Bonds<D>, &State<D>) -> Vec<f64> + Sync + 'a;

impl<'a, const D: usize> System<'a, D> {
    /// Creates the system of a body whose bonds do not break.
    pub fn new(
        bonds: &'a mut dyn Bonds<D>,
        material: impl Material<D> + 'a,
        loads: &'a Loads<D>,
        factors: &'a [f64],
    ) -> Self {
        let material = material.respond(bonds);
        Self::of_response(bonds, material, loads, factors)
    }

    /// Creates the system as [`Self::new`] does, from a material already prepared for solvers.
    pub fn of_response(
        bonds: &'a mut dyn Bonds<D>,
        material: Box<dyn SolverMaterial<D> + 'a>,
        loads: &'a Loads<D>,
        factors: &'a [f64],
    ) -> Self {
        Self {
            material,
            bonds,
            loads: Cow::Borrowed(loads),
            factors: Cow::Borrowed(factors),
            times: Cow::Borrowed(&[]),
            refine: 1,
            snap_back: false,
            breaking: None,
            sliding: SlidingBonds::default(),
            stop_below: 0.0,
            fit_bound: 1e-9,
            contact: None,
            seen_stretches: StretchScan::default(),
            sides_at: 0.0,
            scale: ForceScale::default(),
            density_ratios: Vec::new(),
            amplitude: None,
            observer: None,
        }
    }

    /// Runs the first pass over a new displacement, or over changed bonds: images, states of particles, the
    /// copy read by kernels of clouds and of mixed precision, and pairs in contact if particles have moved
    /// far. Call it once before the forces; how often pairs are updated changes no bit.
    pub fn prepare(&mut self, displacement: &mut Field<D>) {
        self.place_images(displacement);
        let displacement = &*displacement;
        if let Some(contact) = self.contact.as_mut().filter(|contact| contact.repels()) {
            contact.update(&*self.bonds, displacement);
        }
        self.bonds.prepare(displacement);
        self.material.prepare(&*self.bonds, displacement);
    }

    /// Moves the images beyond periodic sides with their origins.
    pub(super) fn place_images(&self, displacement: &mut Field<D>) {
        self.loads.place_images(&*self.bonds, self.sides_at, displacement);
    }

    /// Moves rigid surfaces and periodic sides to their positions at a load factor and a time, s.
    pub(super) fn move_surfaces(&mut self, factor: f64, time: f64) {
        self.sides_at = factor;
        if let Some(contact) = &mut self.contact {
            contact.move_surfaces(factor, time);
        }
    }

    /// Moves rigid surfaces to the load factor at the start of a step, those with a force to their balance.
    pub(super) fn place_surfaces_at_start(&mut self, state: &State<D>, before: f64) {
        self.move_surfaces(before, 0.0);
        let Some(contact) = &mut self.contact else { return };
        let resting = Some(&*state.contact.grips);
        match &state.contact.start {
            Some(start) => contact.balance(start, resting),
            // a step of a programme begins with surfaces that earlier ones have pressed on the body
            None if state.stage.finished > 0 && !state.control.predicted => {
                contact.balance(&state.displacement, resting)
            }
            None => {}
        }
    }

    /// Returns the least density of a particle over that of the method.
    pub(super) fn lightest_ratio(&self) -> f64 {
        self.density_ratios.iter().copied().reduce(f64::min).unwrap_or(1.0)
    }

    /// Moves rigid surfaces to the end of a load step, sets the rates of rotating regions there, and starts
    /// friction.
    pub(super) fn begin_step(&mut self, state: &mut State<D>) {
        let before = state.step.checked_sub(1).map_or(0.0, |before| self.factors[before]);
        let after = self.factors[state.step];
        self.set_rates(after, after);
        // first, as a step given up at touch has left them at its end
        self.place_surfaces_at_start(state, before);
        self.begin_curved_step(state, [before, after]);
        self.move_surfaces(after, 0.0);
        if let Some(start) = &state.contact.start
            && let Some(contact) = self.contact.as_mut().filter(|contact| contact.has_friction())
        {
            contact.begin_friction(start, state.contact.active.clone());
        }
    }

    /// Renews the normal forces of friction in an equilibrium; returns true if they have changed by more than
    /// `tolerance` of their sum, so that another equilibrium must be sought.
    pub(super) fn renew_friction(&mut self, state: &mut State<D>, tolerance: f64) -> bool {
        let Some(contact) = self.contact.as_mut().filter(|contact| contact.has_friction()) else {
            return false;
        };
        let Some(start) = &state.contact.start else { return false };
        let rough = std::mem::take(&mut state.contact.loose) > 0.0 && state.convergence.residual > tolerance;
        let mut new = contact.grips(&*self.bonds, &state.displacement, start, &state.contact.grips);
        let bound = |grips: &[FrictionPair], pair| known_in(grips, pair).map_or(0.0, |grip| grip.bound);
        let lost =
            state.contact.active.iter().filter(|grip| bound(&new, grip.pair) == 0.0).map(|grip| grip.bound);
        let changed = new.iter().map(|grip| (grip.bound - bound(&state.contact.active, grip.pair)).abs());
        let change: f64 = lost.chain(changed).sum();
        let total: f64 = new.iter().map(|grip| grip.bound).sum();
        let settled = change <= tolerance * total;
        if !rough && settled {
            return false;
        }
        if state.contact.renewals >= RENEWALS {
            state.counts.unconverged += u64::from(!rough);
            return rough;
        }
        if !settled && total > 0.0 {
            state.contact.loose = LOOSE * (change / total).min(1.0);
        }
        if state.contact.renewals >= ALTERNATING {
            new.iter_mut()
                .for_each(|grip| grip.bound = 0.5 * (grip.bound + bound(&state.contact.active, grip.pair)));
        }
        contact.begin_friction(start, new.clone());
        (state.contact.active, state.contact.renewals) = (new, state.contact.renewals + 1);
        true
    }

    /// Contact, if it has friction.
    pub(super) fn friction(&self) -> Option<&Contact<D>> {
        self.contact.as_ref().filter(|contact| contact.has_friction())
    }

    /// Conjugate sums of loads and rigid surfaces, see [`Loads::conjugates`].
    pub(super) fn conjugates(&self, state: &State<D>) -> (f64, f64) {
        let (pull, push) = self.loads.conjugates(&*self.bonds, &state.displacement, &state.force);
        let pull = pull + self.work_rate_of_sides(state);
        let work = |(rate, resting): ([f64; D], &SurfaceReaction)| {
            (0..D).map(|d| rate[d] * resting.force[d]).sum::<f64>()
        };
        let Some(contact) = self.repulsion() else { return (pull, push) };
        let resting = self.surface_reactions(state);
        (pull + contact.rates().zip(&resting).map(work).sum::<f64>(), push + self.work_of_pushed())
    }

    /// Work that the mean stress does over the load factor, J: Σ_I V_I P_I : H, in equilibrium.
    fn work_rate_of_sides(&self, state: &State<D>) -> f64 {
        let Some(gradient) = &self.loads.mean_gradient else { return 0.0 };
        let sum = self.material.virial(&*self.bonds, &state.displacement);
        let pairs = sum.iter().flatten().zip(gradient.iter().flatten());
        pairs.map(|(stress, rate)| stress * rate).sum()
    }

    /// Work of the forces on rigid surfaces, see [`Contact::travelled`].
    pub(super) fn work_of_pushed(&self) -> f64 {
        self.repulsion().filter(|contact| contact.has_pushed()).map_or(0.0, Contact::travelled)
    }

    /// Load and displacement, see [`Loads::response`] and [`Self::curved_response`].
    pub(super) fn response(&self, state: &State<D>, factor: f64, conjugates: (f64, f64)) -> (f64, f64) {
        if self.loads.curved.is_some() {
            return self.curved_response(state, factor);
        }
        let sides = self.loads.reach_of_sides(self.bonds.period());
        if sides > 0.0 {
            let reach = sides.hypot(self.loads.reach(&*self.bonds, &[]));
            return (conjugates.0 / reach, factor * reach);
        }
        let surfaces = || self.contact.iter().flat_map(Contact::surfaces);
        let rigid: Vec<[f64; D]> = surfaces().map(|surface| surface.displacement).collect();
        let pushes: Vec<[f64; D]> = surfaces().filter_map(|surface| surface.force).collect();
        self.loads.response(&*self.bonds, factor, conjugates, [&rigid, &pushes])
    }

    /// Contact of the body with each rigid surface, including friction.
    pub(super) fn surface_reactions(&self, state: &State<D>) -> Vec<SurfaceReaction> {
        let Some(contact) = self.repulsion() else { return Vec::new() };
        let mut resting = contact.surface_reactions(&state.displacement);
        for (resting, rub) in resting.iter_mut().zip(&state.contact.surface_friction) {
            (0..3).for_each(|d| resting.force[d] += rub[d]);
        }
        resting
            .iter_mut()
            .zip(&state.contact.flights)
            .for_each(|(own, flight)| own.velocity = flight.velocity);
        resting
    }

    /// Refuses a state with particles behind a rigid surface, or halfway through each other.
    ///
    /// # Errors
    /// [`Error::Penetration`] with the overlap.
    pub(super) fn check_overlaps(&self, state: &State<D>) -> Result<(), Error> {
        let Some(contact) = self.repulsion() else { return Ok(()) };
        let allowed = 0.5 * self.bonds.spacing();
        let resting = contact.surface_reactions(&state.displacement);
        let surfaces = contact.surfaces().zip(resting).enumerate();
        for (number, (surface, resting)) in surfaces.filter(|(_, (surface, _))| !surface.bonded) {
            if resting.gap < -allowed && surface.stiffness > 0.0 {
                let what = format!("the body and {}", surface.title(number));
                let (step, time, overlap) = (state.step, state.motion.time, -resting.gap);
                return Err(Error::Penetration { what, step, time, overlap, allowed });
            }
        }
        match contact.deepest_pair(&*self.bonds, &state.displacement) {
            Some([overlap, distance]) if overlap > 0.5 => Err(Error::Penetration {
                what: "particles without a bond".to_owned(),
                step: state.step,
                time: state.motion.time,
                overlap: overlap * distance,
                allowed: 0.5 * distance,
            }),
            _ => Ok(()),
        }
    }

    /// Rebuilds the list of contact pairs, as required after bonds have changed.
    pub(super) fn rebuild_contact(&mut self, displacement: &Field<D>) {
        if let Some(contact) = self.contact.as_mut().filter(|contact| contact.repels()) {
            contact.rebuild(&*self.bonds, displacement);
        }
    }

    /// Contact, if it exerts forces.
    pub fn repulsion(&self) -> Option<&Contact<D>> {
        self.contact.as_ref().filter(|contact| contact.repels())
    }

    /// Contacts in a state, if they are tracked.
    pub(super) fn contact_summary(&mut self, state: &State<D>) -> Option<ContactSummary> {
        let contact = self.contact.as_mut()?;
        if !contact.has_pairs() {
            contact.rebuild(&*self.bonds, &state.displacement);
        }
        Some(contact.summary(&*self.bonds, &state.displacement))
    }

    /// Computes the force densities of whole pieces from the site `start` on, without loads: of the material,
    /// contact and friction. Requires [`Self::prepare`].
    pub fn internal_force(
        &self,
        displacement: &Field<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) {
        self.material.force(&*self.bonds, displacement, start, force, track);
        if let Some(contact) = self.repulsion() {
            contact.force(&*self.bonds, displacement, start, force);
        }
    }

    /// Granularity of [`Self::internal_force`] in sites.
    pub(super) fn piece(&self) -> usize {
        self.material.piece(&*self.bonds)
    }

    /// Energy of the material, whose law is evaluated over the stretches `observed`, and of contact, J.
    pub fn stored_energy(&mut self, state: &State<D>, observed: StretchRange) -> f64 {
        let bonds = self.material.energy(&*self.bonds, &state.displacement, observed);
        match self.repulsion() {
            Some(contact) => bonds + contact.summary(&*self.bonds, &state.displacement).energy,
            None => bonds,
        }
    }

    /// kθK, N/m⁶, of undeformed bonds of similar stiffness to the material.
    pub(super) fn stiffness_at_rest(&self) -> f64 {
        let (law, modulus) = self.material.bond_law();
        modulus * law.tangent()
    }

    /// Values of the observer in a state.
    pub(super) fn seen(&self, state: &State<D>) -> Vec<f64> {
        self.observer.map_or_else(Vec::new, |observer| observer(&*self.bonds, state))
    }

    /// Builds the history row of a state: at a load factor with its conjugate sums, see
    /// [`Loads::conjugates`](super::Loads::conjugates), the stretches `observed` and the `stored` energy, J.
    /// Without residual and balance, which an equilibrium adds.
    pub(super) fn row(
        &mut self,
        state: &State<D>,
        [factor, pull, push]: [f64; 3],
        observed: StretchRange,
        stored: f64,
    ) -> StepRecord {
        let (load, displacement) = self.response(state, factor, (pull, push));
        let mut resting = self.surface_reactions(state);
        if let Some(contact) = self.repulsion() {
            let pressures = contact.greatest_pressures(&*self.bonds, &state.displacement);
            resting.iter_mut().zip(pressures).for_each(|(own, pressure)| own.pressure = pressure);
        }
        StepRecord {
            factor,
            load,
            displacement,
            reactions: self.loads.reactions(&*self.bonds, &state.force),
            residual: 0.0,
            iterations: state.counts.step_iterations,
            rounds: 1,
            broken: state.fracture.broken,
            detached: state.fracture.detached,
            stored,
            balance: Balance::default(),
            contact: self.contact_summary(state),
            work: state.work,
            released: state.fracture.released,
            dissipated: state.memory.dissipated,
            smallest_stretch: (1.0 + observed.low).max(0.0).sqrt(),
            largest_stretch: (1.0 + observed.high).sqrt(),
            time: state.stage.time + state.motion.time,
            kinetic: state.motion.energies.kinetic,
            damped: state.motion.energies.damped,
            rubbed: state.motion.energies.rubbed,
            resting,
            seen: self.seen(state),
        }
    }

    /// Counts one evaluation of all forces.
    pub fn count_evaluation(&self, state: &mut State<D>) {
        state.counts.evaluations += 1;
        state.counts.bond_evaluations += self.bonds.directed_bonds();
    }

    /// Builds the error that names the first value that is not finite.
    pub(super) fn not_finite(&self, state: &State<D>) -> Error {
        let bonds = &*self.bonds;
        let fields =
            [("displacement", &state.displacement), ("velocity", &state.velocity), ("force", &state.force)];
        for (quantity, field) in fields {
            if let Some((site, _)) = field.non_finite() {
                return not_finite(bonds, quantity, site, state.step, state.counts.iteration);
            }
        }
        // every entry is finite, their squares are not: report the greatest force
        let size = |site: u32| state.force.get(site as usize).iter().fold(0.0_f64, |m, f| m.max(f.abs()));
        let particles = bonds.particles().iter().enumerate();
        let greatest = particles.max_by(|a, b| size(*a.1).total_cmp(&size(*b.1)));
        Error::NotFinite {
            quantity: "sum of squared forces",
            particle: greatest.map_or(0, |(particle, _)| particle),
            position: greatest.map_or_else(Vec::new, |(_, &site)| bonds.position(site as usize).to_vec()),
            step: state.step,
            iteration: state.counts.iteration,
        }
    }
}
