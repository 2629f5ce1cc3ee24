//! Loads that follow curves of time, each region its own, instead of one load factor.
//!
//! The load factor of a system with curves is the part τ = t/T of its whole time T. Prescribed displacements
//! are u(X, τ) = c_d(τ) a_d(X); as in rotating regions, [`Loads::displacement`] is their rate over τ. Body
//! forces Σ c_d(τ) b_d(X) are computed anew at each τ and act in full.

use super::force_fields::ForceField;
use super::load::{Loads, one_sided};
use super::state::State;
use super::system::System;
use crate::amplitude::Amplitude;
use crate::bonds::BodyGeometry;
use crate::contact::Contact;
use crate::field::Field;
use crate::geometry::length;
use std::sync::Arc;

/// Number of times at which the curves of regions are compared.
const PROBED: u32 = 16;

/// Displacement or body force of a region whose components follow amplitudes.
#[derive(Clone, Debug)]
pub struct CurvedRegion<const D: usize> {
    /// Sites of the region.
    pub sites: Vec<u32>,
    /// Displacement, m, or body force density, N/m³, of each site at a multiple of 1.
    pub values: Vec<[f64; D]>,
    /// Amplitude of each component.
    pub amplitudes: [Amplitude; D],
    /// Bit d: component d is prescribed.
    pub components: u8,
    /// Displacement of each site at a multiple of 0, m; empty: none.
    pub(super) offsets: Vec<[f64; D]>,
    /// Bit d: component d keeps its value at the start of a step.
    pub kept: u8,
}

impl<const D: usize> CurvedRegion<D> {
    /// Creates a region that begins at rest.
    pub fn new(sites: Vec<u32>, values: Vec<[f64; D]>, amplitudes: [Amplitude; D], components: u8) -> Self {
        Self { sites, values, amplitudes, components, offsets: Vec::new(), kept: 0 }
    }

    /// Values of all sites, times one multiple for each component.
    fn scaled(&self, multiples: [f64; D]) -> impl Iterator<Item = (usize, [f64; D])> + '_ {
        let values = self.values.iter().map(move |value| std::array::from_fn(|d| multiples[d] * value[d]));
        self.sites.iter().map(|&site| site as usize).zip(values)
    }

    /// Displacements of all sites at τ.
    fn placed(&self, part: f64) -> impl Iterator<Item = (usize, [f64; D])> + '_ {
        let offsets = self.offsets.iter().copied().chain(std::iter::repeat([0.0; D]));
        let each = self.scaled(self.multiples(part)).zip(offsets);
        each.map(|((site, value), offset)| (site, std::array::from_fn(|d| offset[d] + value[d])))
    }

    /// Sets the prescribed components of a field.
    fn set(&self, field: &mut Field<D>, values: impl Iterator<Item = (usize, [f64; D])>) {
        for (site, value) in values {
            let old = field.get(site);
            let prescribed = |d: usize| self.components >> d & 1 == 1;
            field.set(site, std::array::from_fn(|d| if prescribed(d) { value[d] } else { old[d] }));
        }
    }

    fn multiples(&self, part: f64) -> [f64; D] {
        self.amplitudes.each_ref().map(|amplitude| amplitude.multiple(part))
    }
}

/// Loads that follow amplitudes; of overlapping displacements the last applies, forces add up.
#[derive(Clone, Debug, Default)]
pub struct CurvedLoads<const D: usize> {
    /// Prescribed displacements.
    pub held: Vec<CurvedRegion<D>>,
    /// Body forces.
    pub pushed: Vec<CurvedRegion<D>>,
    /// Body forces that depend on the displacement, or on place and time at once.
    pub fields: Vec<Arc<dyn ForceField<D>>>,
    /// Sites without bonds, on which no field acts.
    pub bare: Vec<u32>,
    /// τ of the present body forces, the later one of two.
    pub part: f64,
    /// Body forces that do not depend on the displacement, if others do.
    pub fixed: Option<FixedForces<D>>,
}

impl<const D: usize> CurvedLoads<D> {
    /// Returns true if regions begin where a step before has left them.
    fn begins_moved(&self) -> bool {
        self.held.iter().any(|region| !region.offsets.is_empty())
    }
}

/// Body forces that do not depend on the displacement, N/m³.
#[derive(Clone, Debug)]
pub struct FixedForces<const D: usize> {
    /// Both τ of which they are the mean.
    pub parts: [f64; 2],
    /// Number of sites without bonds at that time.
    pub bare: usize,
    /// Their sum.
    pub force: Field<D>,
}

impl<const D: usize> Loads<D> {
    /// Returns true if all loads are proportional to the load factor.
    pub fn is_proportional(&self) -> bool {
        self.turned.is_empty() && self.curved.is_none()
    }

    /// First guess of a load step from the rates of its curves, as [`Loads::affine_predictor`].
    pub(super) fn curved_predictor(&self, bonds: &dyn BodyGeometry<D>) -> [[f64; 4]; D] {
        if self.displacement.is_some() { self.affine_closest(bonds) } else { [[0.0; 4]; D] }
    }

    /// Sets [`Loads::displacement`] of curved regions to the rate over τ: the secant between two τ, or the
    /// tangent at one.
    pub(super) fn set_curved_rates(&mut self, before: f64, after: f64) {
        let (Some(field), Some(curved)) = (self.displacement.as_mut(), &self.curved) else { return };
        for region in &curved.held {
            let rate = |amplitude: &Amplitude| amplitude.secant(before, after);
            region.set(field, region.scaled(region.amplitudes.each_ref().map(rate)));
        }
    }

    /// Sets [`Loads::displacement`] of curved regions so that τ times it is the displacement at τ.
    pub(super) fn set_curved_ends(&mut self, after: f64) {
        let (Some(field), Some(curved)) = (self.displacement.as_mut(), &self.curved) else { return };
        for region in &curved.held {
            let ends = region.placed(after).map(|(site, u)| (site, u.map(|x| x / after)));
            region.set(field, ends);
        }
    }

    /// Sets the displacement of curved regions at τ.
    pub(super) fn place_curved(&self, part: f64, displacement: &mut Field<D>) {
        for region in self.curved.iter().flat_map(|curved| &curved.held) {
            region.set(displacement, region.placed(part));
        }
    }

    /// Sets [`Loads::displacement`] of curved regions to their largest ones, for scales, and the body forces
    /// to those at the end.
    pub fn set_peaks(&mut self) {
        if let (Some(field), Some(curved)) = (self.displacement.as_mut(), &self.curved) {
            for region in &curved.held {
                region.set(field, region.scaled(region.amplitudes.each_ref().map(Amplitude::largest)));
            }
        }
        self.set_forces([1.0; 2]);
    }

    /// Computes the body forces at the mean of two τ, each with half of its multiples, without fields.
    pub fn set_forces(&mut self, parts: [f64; 2]) {
        let (Some(field), Some(curved)) = (self.body_force.as_mut(), &mut self.curved) else { return };
        curved.part = parts[1];
        if !curved.fields.is_empty() {
            field.components_mut().into_iter().for_each(|component| component.fill(0.0));
        }
        for site in curved.pushed.iter().flat_map(|region| &region.sites) {
            field.set(*site as usize, [0.0; D]);
        }
        for region in &curved.pushed {
            let [before, after] = parts.map(|part| region.multiples(part));
            for (site, value) in region.scaled(std::array::from_fn(|d| 0.5 * (before[d] + after[d]))) {
                let old = field.get(site);
                field.set(site, std::array::from_fn(|d| old[d] + value[d]));
            }
        }
    }

    /// Factor of [`Loads::body_force`] at a load factor: 1 with curves.
    pub(super) fn force_factor(&self, factor: f64) -> f64 {
        if self.curved.is_some() { 1.0 } else { factor }
    }

    /// Relative prescribed displacement at τ, m, of regions and rigid surfaces: √Σ_d (max − min)², counted
    /// from the body at rest.
    pub(super) fn curved_reach(&self, part: f64, rigid: &[[f64; D]]) -> f64 {
        let regions = self.curved.iter().flat_map(|curved| &curved.held);
        let shifts = self.turned.iter().map(|turned| (turned.components, turned.turn_at(part).1));
        reach(regions.map(|region| (region.components, region.placed(part))), shifts, rigid)
    }

    /// Relative prescribed displacement of regions at a multiple of 1, m, if all move by one multiple.
    fn common_reach(&self) -> Option<f64> {
        let curved = self.curved.as_ref()?;
        if !self.turned.is_empty() || curved.begins_moved() {
            return None;
        }
        let moving = |region: &CurvedRegion<D>| -> Vec<Amplitude> {
            let moves = |&d: &usize| {
                region.components >> d & 1 == 1 && region.values.iter().any(|value| value[d] != 0.0)
            };
            (0..D).filter(moves).map(|d| region.amplitudes[d].clone()).collect()
        };
        let moving: Vec<Amplitude> = curved.held.iter().flat_map(moving).collect();
        let is_common = |part: f64| {
            let mut multiples = moving.iter().map(|amplitude| amplitude.multiple(part));
            let first = multiples.next();
            multiples.all(|multiple| Some(multiple) == first)
        };
        let single = (1..=PROBED).all(|k| is_common(f64::from(k) / f64::from(PROBED)));
        let full = curved.held.iter().map(|region| (region.components, region.scaled([1.0; D])));
        single.then(|| reach(full, std::iter::empty(), &[])).filter(|reach| *reach > 0.0)
    }

    /// Σ −F V·a and Σ u·a over the regions of prescribed displacement, with a the displacement at a multiple
    /// of 1 and u that at τ.
    fn along_curves(&self, bonds: &dyn BodyGeometry<D>, part: f64, force: &Field<D>) -> [f64; 2] {
        let (mut pull, mut way) = (0.0, 0.0);
        for region in self.curved.iter().flat_map(|curved| &curved.held) {
            for ((site, placed), value) in region.placed(part).zip(&region.values) {
                let (force, volume) = (force.get(site), bonds.volume(site));
                for d in (0..D).filter(|d| region.components >> d & 1 == 1) {
                    pull -= force[d] * volume * value[d];
                    way += placed[d] * value[d];
                }
            }
        }
        [pull, way]
    }

    /// Load, N, and displacement, m, of body forces: their sum, and the mean displacement of their points
    /// along them, both positive along the forces at a multiple of 1. Along the present ones in later steps,
    /// and where forces depend on the displacement or do not follow multiples. `None` without forces.
    fn pushed_response(&self, bonds: &dyn BodyGeometry<D>, displacement: &Field<D>) -> Option<(f64, f64)> {
        let (present, curved) = (self.body_force.as_ref()?, self.curved.as_ref()?);
        let mut full = Field::zeros(bonds.sites());
        for (site, value) in curved.pushed.iter().flat_map(|region| region.scaled([1.0; D])) {
            let old: [f64; D] = full.get(site);
            full.set(site, std::array::from_fn(|d| old[d] + value[d]));
        }
        let follows = !curved.fields.is_empty() || curved.pushed.is_empty() || curved.begins_moved();
        let full = if follows { present } else { &full };
        let (mut push, mut way) = (0.0, 0.0);
        for site in bonds.particles().iter().map(|&site| site as usize) {
            let (full, volume) = (full.get(site), bonds.volume(site));
            let product = |field: &Field<D>| {
                let value = field.get(site);
                (0..D).map(|d| full[d] * value[d]).sum::<f64>() * volume
            };
            push += product(present);
            way += product(displacement);
        }
        let sum = |field| length(one_sided(bonds, &self.pushed_regions, Some(field), &[]));
        (sum(full) > 0.0).then(|| (along(sum(present), push), way / sum(full)))
    }

    /// Removes the body force of curves from a site.
    pub(super) fn unload_curved(&mut self, site: u32) {
        let Some(curved) = &mut self.curved else { return };
        if !curved.fields.is_empty() {
            curved.bare.push(site);
        }
        for region in &mut curved.pushed {
            let found = region.sites.iter().zip(&mut region.values).filter(|(own, _)| **own == site);
            found.for_each(|(_, value)| *value = [0.0; D]);
        }
    }
}

impl<const D: usize> System<'_, D> {
    /// Begins a load step with curves: the loads move from the last equilibrium along the secant of the step,
    /// with its mean forces.
    pub(super) fn begin_curved_step(&mut self, state: &mut State<D>, [before, after]: [f64; 2]) {
        if self.loads.curved.is_none() {
            return;
        }
        self.set_rates(before, after);
        if !state.control.predicted {
            self.set_arc_rates([before, after], before);
            if self.loads.follows() && state.control.pushed.is_none() {
                self.set_forces(before, &state.displacement);
                self.keep_forces(state);
            }
            self.set_mean_forces([before, after], &state.displacement);
            let (pull, push) = self.curved_conjugates(state);
            if !self.loads.turned.is_empty() {
                self.set_rates(before, after);
            }
            state.control.balanced = [before, pull, push];
            if self.refine > 1 && state.control.cuts == 0 {
                state.control.start_force = Some(Box::new(state.force.clone()));
            }
        }
        self.set_forces(after, &state.displacement);
    }

    /// Conjugate sums as [`System::conjugates`]; body forces that depend on the displacement do not count.
    fn curved_conjugates(&self, state: &State<D>) -> (f64, f64) {
        let (pull, push) = self.conjugates(state);
        (pull, if self.loads.follows() { self.work_of_pushed() } else { push })
    }

    /// Work of curved loads since the last equilibrium, J, by the trapezoidal rule.
    pub(super) fn work_of_curves(&mut self, state: &mut State<D>, [before, after]: [f64; 2]) -> f64 {
        let [old_factor, old_pull, old_push] = state.control.balanced;
        let first = state.control.round == 0;
        self.set_arc_rates([before, after], after);
        self.set_mean_forces(if first { [before, after] } else { [after; 2] }, &state.displacement);
        let (pull, push) = self.curved_conjugates(state);
        self.set_forces(after, &state.displacement);
        let present = self.curved_conjugates(state).1;
        state.control.balanced = [after, pull, present];
        let followed = if self.loads.follows() { self.work_of_followers(state) } else { 0.0 };
        let pushed = push - old_push + followed;
        self.keep_forces(state);
        0.5 * (pull + old_pull) * (after - old_factor) + pushed
    }

    /// Load, N, and displacement, m, of a row of history with curves: the reaction of the regions of
    /// prescribed displacement and [`Loads::curved_reach`], both positive along the displacements at a
    /// multiple of 1; where one curve moves all, its conjugate force. Of regions that only rotate, the moment
    /// over the largest radius, and the arc there; of regions that do both, the root of both squares. Where
    /// no region moves, the force and the way of the rigid surface that moves or is pressed with the largest
    /// force; without one the applied force and the mean displacement of its points along it.
    pub(super) fn curved_response(&self, state: &State<D>, part: f64) -> (f64, f64) {
        let held = self.loads.curved.iter().flat_map(|curved| &curved.held);
        let regions_move =
            !self.loads.turned.is_empty() || held.flat_map(|region| &region.values).any(|u| *u != [0.0; D]);
        if !regions_move {
            let surfaces = self.contact.iter().flat_map(Contact::surfaces).zip(self.surface_reactions(state));
            let driven = surfaces.filter(|(surface, _)| surface.moves() || surface.force.is_some());
            let each = driven.map(|(_, resting)| (length(resting.force), length(resting.moved)));
            let pushed = || self.loads.pushed_response(&*self.bonds, &state.displacement);
            if let Some(response) = each.max_by(|a, b| a.0.total_cmp(&b.0)).or_else(pushed) {
                return response;
            }
        }
        let force = match self.loads.displacement {
            Some(_) => self.loads.reaction(&*self.bonds, &state.force),
            None => self.loads.applied(&*self.bonds, &[]),
        };
        let surfaces = self.contact.iter().flat_map(Contact::surfaces);
        let rigid: Vec<[f64; D]> = surfaces.map(|surface| surface.displacement_at(part)).collect();
        // in later steps both are magnitudes
        let moved = self.loads.curved.as_ref().is_some_and(|curved| curved.begins_moved())
            || self.loads.turned.iter().any(|turned| turned.start.is_some());
        let [pull, way] =
            if moved { [0.0; 2] } else { self.loads.along_curves(&*self.bonds, part, &state.force) };
        let straight = self.loads.curved_reach(part, &rigid);
        if !self.loads.turned.is_empty() {
            let bonds = &*self.bonds;
            let arc = self.loads.arc(bonds, |turned| turned.turn_at(part).0);
            let (turning, signs) = self.loads.turning_force(bonds, part, &state.force);
            let [pull, way] = if moved { [0.0; 2] } else { [pull + signs[0], way + signs[1]] };
            let moves = [0.0, 1.0].map(|at| self.loads.curved_reach(at, &rigid));
            let pushed = moves.into_iter().any(|reach| reach > 0.0) || straight > 0.0;
            let load = if pushed { length(force).hypot(turning) } else { turning };
            return (along(load, pull), along(straight.hypot(arc), way));
        }
        let load = match self.loads.common_reach().filter(|_| rigid.iter().all(|u| *u == [0.0; D])) {
            Some(reach) => pull / reach,
            None => along(length(force), pull),
        };
        (load, along(straight, way))
    }
}

/// Relative displacement, m, of regions with the bits of their prescribed components, of the shifts of
/// rotating ones, and of rigid surfaces: √Σ_d (max − min)², counted from the body at rest.
fn reach<const D: usize>(
    regions: impl Iterator<Item = (u8, impl Iterator<Item = (usize, [f64; D])>)>,
    shifts: impl Iterator<Item = (u8, [f64; D])>,
    rigid: &[[f64; D]],
) -> f64 {
    let mut span = [[0.0_f64; 2]; D];
    for (d, span) in span.iter_mut().enumerate() {
        let moved = rigid.iter().map(|displacement| displacement[d]);
        *span = moved.fold(*span, |[low, high], u| [low.min(u), high.max(u)]);
    }
    let mut widen = |components: u8, value: [f64; D]| {
        for d in (0..D).filter(|d| components >> d & 1 == 1) {
            span[d] = [span[d][0].min(value[d]), span[d][1].max(value[d])];
        }
    };
    for (components, values) in regions {
        values.for_each(|(_, value)| widen(components, value));
    }
    shifts.for_each(|(components, shift)| widen(components, shift));
    span.iter().map(|[low, high]| (high - low).powi(2)).sum::<f64>().sqrt()
}

/// Magnitude with a sign; positive at 0.
fn along(magnitude: f64, sign: f64) -> f64 {
    if sign < 0.0 { -magnitude } else { magnitude }
}
