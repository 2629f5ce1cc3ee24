//! Vectors of L-BFGS on a graphics card, with the local part of the preconditioner only: a coarse level is
//! solved on the host, and fields would have to travel in each iteration.
//!
//! Fields go to the card when a search begins and come back when it has ended, when bonds break on the way,
//! and where the run may be saved.

use super::device_body::{held_as_before, lattice_with_law, loads, planes, refuse, squares};
use super::device_pairs::ListedPairs;
use super::lbfgs::{Lbfgs, LbfgsSearch, LinePoint, SearchVectors};
use super::lbfgs_host::{HUGE_SCALE, LARGEST_CHANGE};
use super::pair_products::{Kept, PairProducts};
use super::passes::ForceSums;
use super::preconditioner::Preconditioner;
use super::state::State;
use super::system::System;
use crate::error::Error;
use crate::field::Field;
use crate::gpu::{Device, DeviceSearch};
use std::collections::VecDeque;

impl Lbfgs {
    /// Creates a solver whose iterations a device takes, of lattices of a bond law, in contact with
    /// themselves and with planes at most, without friction.
    pub fn device_solver<'a, const D: usize>(&self, device: &'a Device) -> LbfgsSearch<CardVectors<'a, D>> {
        LbfgsSearch::with_vectors(*self, CardVectors::new(device, self.memory))
    }
}

/// Vectors of a search on a device.
pub struct CardVectors<'a, const D: usize> {
    device: &'a Device,
    card: Option<DeviceSearch<D>>,
    pairs: ListedPairs,
    /// Greatest length of the direction, m, where particles repel each other.
    reach: f64,
    preconditioner: Preconditioner<D>,
    most: usize,
    products: PairProducts,
    /// Places of the pairs on the card, oldest first, and those left.
    places: VecDeque<usize>,
    spare: Vec<usize>,
    /// Stretches that the law on the card covers.
    fitted: [f64; 2],
    /// Σ b² of the body forces at load factor 1.
    pushed: f64,
}

fn no_search() -> Error {
    Error::Device("expected a search on the device".to_owned())
}

impl<'a, const D: usize> CardVectors<'a, D> {
    fn new(device: &'a Device, most: usize) -> Self {
        Self {
            device,
            card: None,
            pairs: ListedPairs::new(),
            reach: 0.0,
            preconditioner: Preconditioner::new(),
            most,
            products: PairProducts::new(most),
            places: VecDeque::new(),
            // one more than there are pairs: a new one is known before the oldest is forgotten
            spare: (0..=most).collect(),
            fitted: [1.0; 2],
            pushed: 0.0,
        }
    }

    fn card(&mut self) -> Result<&mut DeviceSearch<D>, Error> {
        self.card.as_mut().ok_or_else(no_search)
    }

    fn renew_pairs(&mut self, system: &mut System<D>, displacement: &Field<D>) -> Result<(), Error> {
        let card = self.card.as_mut().ok_or_else(no_search)?;
        self.pairs.renew(&mut card.body, system, displacement);
        Ok(())
    }

    fn take_law(&mut self, system: &System<D>, state: &State<D>) -> Result<(), Error> {
        let law = lattice_with_law(system)?.1.0;
        self.card()?.body.set_law(law, f64::INFINITY)?;
        self.fitted = state.stretches.fitted;
        Ok(())
    }
}

impl<const D: usize> SearchVectors<D> for CardVectors<'_, D> {
    const HOLDS: bool = false;

    fn build(&mut self, system: &mut System<D>, state: &State<D>, settings: &Lbfgs) -> Result<(), Error> {
        refuse(system)?;
        SearchVectors::<D>::forget(self, true);
        self.preconditioner.build(system, state, settings.weight, None);
        Ok(())
    }

    fn is_built(&self) -> bool {
        self.preconditioner.is_built()
    }

    fn take(&mut self, system: &mut System<D>, state: &State<D>) -> Result<(), Error> {
        let (bonds, law) = lattice_with_law(system)?;
        if self.card.is_none() {
            let springs = &system.scale.springs;
            self.card = Some(DeviceSearch::new(self.device, bonds, law, springs, self.most + 1)?);
        }
        self.take_law(system, state)?;
        self.pushed = squares(system);
        let (local, card) = (self.preconditioner.local().to_vec(), self.card()?);
        card.body.set_loads(&loads(system));
        card.body.set_planes(planes(system));
        card.set_local(bonds, &local);
        // the direction is in the place of the velocity
        let rest = Field::zeros(system.bonds.sites());
        card.body.set_state(bonds, [&state.displacement, &rest, &state.force], 1.0)?;
        self.pairs.expire();
        self.renew_pairs(system, &state.displacement)
    }

    fn give(&self, system: &mut System<D>, state: &mut State<D>) -> Result<(), Error> {
        let Some(card) = &self.card else { return Ok(()) };
        let [displacement, force] = card.iterate()?;
        state.displacement = held_as_before(system, &state.displacement, displacement);
        state.force = force;
        system.prepare(&mut state.displacement);
        Ok(())
    }

    fn evaluate(&mut self, system: &mut System<D>, state: &mut State<D>) -> Result<LinePoint, Error> {
        if self.fitted != state.stretches.fitted {
            self.take_law(system, state)?;
        }
        if !self.pairs.are_complete() {
            let displacement = self.card()?.body.displacement()?;
            self.renew_pairs(system, &displacement)?;
        }
        let factor = system.loads.force_factor(system.factors[state.step]);
        let pushed = self.pushed;
        let card = self.card()?;
        card.body.pull(factor, true);
        let found = card.line_sums(false)?;
        let (observed, _) = card.body.stretch_range()?;
        system.count_evaluation(state);
        // planes hold a body, too
        let (free, constrained) = (found.free, found.constrained + card.body.plane_square()?);
        let external = factor * factor * pushed;
        let sums = ForceSums { free, constrained, external, ..ForceSums::default() };
        Ok(LinePoint { sums, observed, slope: found.slope })
    }

    fn in_touch(&self, _: &System<D>, _: &State<D>) -> Result<Vec<[u32; 3]>, Error> {
        self.card.as_ref().map_or_else(|| Ok(Vec::new()), |card| card.body.plane_touches())
    }

    fn rounding(&mut self, _: &System<D>, _: &State<D>) -> Result<(f64, f64), Error> {
        let epsilon = self.device.precision().epsilon();
        Ok((self.card()?.line_sums(true)?.moved, epsilon))
    }

    fn step(&mut self, _: &mut State<D>, step: f64) {
        if let Some(card) = &self.card {
            card.advance(step);
            self.pairs.hold_after(step.abs() * self.reach);
        }
    }

    /// Limited as on the host.
    fn longest_step(&mut self, system: &System<D>, _: &State<D>, most: f64) -> Result<f64, Error> {
        let mut longest = f64::INFINITY;
        if let Some(contact) = system.repulsion().filter(|contact| contact.has_pairs()) {
            let moves = self.card()?.moves()?;
            self.reach = moves[0];
            longest = contact.step_of(moves);
        }
        if !system.material.softens_at((1.0 + most).sqrt()) {
            return Ok(longest);
        }
        let range = self.card()?.range_along(HUGE_SCALE)?;
        Ok((LARGEST_CHANGE * HUGE_SCALE / (1.0 + range.high).sqrt()).min(longest))
    }

    fn direct(&mut self) -> Result<f64, Error> {
        let (back, weights) = self.products.weights();
        let scale = self.products.scale();
        let mut of_places = vec![[0.0; 2]; self.most + 1];
        for (&place, (a, b)) in self.places.iter().zip(back.iter().zip(weights)) {
            of_places[place] = [scale * a, b];
        }
        self.card()?.combine(scale, &of_places)
    }

    fn direct_anew(&mut self) -> Result<f64, Error> {
        SearchVectors::<D>::direct(self)
    }

    fn accept(&mut self, step: f64, least: f64) -> Result<(), Error> {
        let Some(place) = self.spare.pop() else { return Ok(()) };
        let card = self.card()?;
        let sums = card.record(place, step)?;
        card.arrive();
        let others: Vec<[f64; 4]> = self.places.iter().map(|&place| sums[place]).collect();
        match self.products.add(sums[place], &others, least) {
            Kept::None => self.spare.push(place),
            kept => {
                if kept == Kept::InsteadOfOldest {
                    self.spare.extend(self.places.pop_front());
                }
                self.places.push_back(place);
            }
        }
        Ok(())
    }

    fn arrive(&mut self) {
        if let Some(card) = &mut self.card {
            card.arrive();
        }
    }

    fn forget(&mut self, scale_too: bool) {
        // sums run over places in their order: a run that continues here takes the same
        self.places.clear();
        self.spare = (0..=self.most).collect();
        self.products.clear(scale_too);
    }

    fn simplify(&mut self) {
        SearchVectors::<D>::forget(self, true);
    }

    fn bonds_broke(&mut self, system: &System<D>, sites: &[u32]) {
        self.preconditioner.bonds_broke(&*system.bonds, sites);
        self.pairs.expire();
        self.pushed = squares(system);
        if let (Some(card), Some(bonds)) = (&mut self.card, system.bonds.as_lattice()) {
            card.body.set_intact(bonds);
            card.body.set_loads(&loads(system));
            card.body.set_planes(planes(system));
            card.set_local(bonds, self.preconditioner.local());
        }
    }
}
