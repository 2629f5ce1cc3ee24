//! Dynamic relaxation on a graphics card: the host decides as [`super::dynamic_relaxation`] does, from sums
//! of each iteration.
//!
//! Fields go to the card when a search for equilibrium begins and come back when it has ended, when bonds
//! break on the way, and where the run may be saved.

use super::device_body::{held_as_before, lattice_with_law, loads, planes, refuse, squares};
use super::device_pairs::ListedPairs;
use super::dynamic_relaxation::{DynamicRelaxation, REFRESH, damping, is_look_due};
use super::load_stepping::Equilibrium;
use super::mass::{has_own_mass, update_unit_mass};
use super::method::Watch;
use super::passes::{ForceSums, move_factors};
use super::state::State;
use super::system::System;
use crate::bonds::StretchRange;
use crate::error::Error;
use crate::gpu::{Device, DeviceRelaxation};

/// Iterations between states that a run may be continued from.
const KEPT: u64 = 500;

impl DynamicRelaxation {
    /// Creates a solver whose iterations a device takes, of lattices of a bond law, in contact with
    /// themselves and with planes at most, without friction.
    pub fn device_solver<'a, const D: usize>(&self, device: &'a Device) -> CardRelaxation<'a, D> {
        CardRelaxation {
            settings: *self,
            device,
            card: None,
            pairs: ListedPairs::new(),
            unit_mass: Vec::new(),
            stiffened: false,
            pushed: 0.0,
        }
    }
}

/// Solver of [`DynamicRelaxation`] on a device.
pub struct CardRelaxation<'a, const D: usize> {
    settings: DynamicRelaxation,
    device: &'a Device,
    card: Option<DeviceRelaxation<D>>,
    pairs: ListedPairs,
    /// Gershgorin sums of the undeformed body for a unit bond tangent.
    unit_mass: Vec<f64>,
    /// True if the card has those of the deformed body with each bond's own tangent.
    stiffened: bool,
    /// Σ b² of the body forces at load factor 1.
    pushed: f64,
}

impl<const D: usize> CardRelaxation<'_, D> {
    /// Puts the state on the card.
    fn begin(&mut self, system: &mut System<D>, state: &State<D>) -> Result<(), Error> {
        let (bonds, (law, modulus)) = lattice_with_law(system)?;
        let mut card = match self.card.take() {
            Some(card) => card,
            None => DeviceRelaxation::new(self.device, bonds, (law, modulus), &system.scale.springs)?,
        };
        card.body.set_law(law, f64::INFINITY)?;
        card.body.set_loads(&loads(system));
        card.body.set_state(bonds, [&state.displacement, &state.velocity, &state.force], 1.0)?;
        if self.unit_mass.len() != system.bonds.sites() {
            self.unit_mass = vec![1.0; system.bonds.sites()];
            update_unit_mass(bonds, system.bonds.particles(), &mut self.unit_mass);
        }
        card.set_masses(&self.unit_mass)?;
        card.body.set_planes(planes(system));
        self.stiffened = false;
        self.pushed = squares(system);
        self.pairs.expire();
        self.pairs.renew(&mut card.body, system, &state.displacement);
        self.card = Some(card);
        Ok(())
    }

    /// Fetches the state; held components have kept their displacement.
    fn fetch(card: &DeviceRelaxation<D>, system: &mut System<D>, state: &mut State<D>) -> Result<(), Error> {
        let [displacement, velocity, force] = card.body.state()?;
        state.displacement = held_as_before(system, &state.displacement, displacement);
        (state.velocity, state.force) = (velocity, force);
        system.prepare(&mut state.displacement);
        Ok(())
    }

    /// Runs one iteration; returns true if the forces balance (the displacement then stays).
    fn iterate(
        &mut self,
        card: &mut DeviceRelaxation<D>,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
    ) -> Result<bool, Error> {
        let (goal, iteration) = (self.settings.goal(), state.counts.iteration);
        let look = is_look_due(system, state);
        let factor = system.loads.force_factor(system.factors[state.step]);
        let own = has_own_mass(system, state);
        if own && (iteration.is_multiple_of(REFRESH) || !self.stiffened) {
            let fitted = state.stretches.fitted;
            let table = system.material.tangents(fitted);
            let (table, least) =
                table.ok_or_else(|| Error::Device("expected the tangents of one law".to_owned()))?;
            card.stiffen(table, least);
            self.stiffened = true;
        }
        let tangent = if own { system.material.bond_law().1 } else { state.stretches.tangent };
        let mass = 0.5 * self.settings.mass_safety * tangent;
        let contact = system.repulsion().map(|_| tangent);
        let measures = state.measures_rounding();
        card.keep_forces();
        let forces = |card: &mut DeviceRelaxation<D>| {
            card.weigh(contact);
            card.body.pull(factor, look);
            card.sums(measures)
        };
        let mut found = forces(card)?;
        if !self.pairs.hold_after((D as f64).sqrt() * found.way) && found.free.is_finite() {
            // others than those listed may touch
            let displacement = card.body.displacement()?;
            self.pairs.renew(&mut card.body, system, &displacement);
            found = forces(card)?;
        }
        let sums = ForceSums {
            quotient_top: found.quotient_top,
            quotient_bottom: found.quotient_bottom * mass,
            free: found.free,
            // planes hold a body, too
            constrained: found.constrained + card.body.plane_square()?,
            external: factor * factor * self.pushed,
        };
        system.count_evaluation(state);
        if !sums.is_finite() {
            Self::fetch(card, system, state)?;
            return Err(system.not_finite(state));
        }
        let mut broken = false;
        if look {
            let observed = card.body.stretch_range()?.0;
            state.stretches.observe(observed);
            if system.widen(state)? {
                card.body.set_law(lattice_with_law(system)?.1.0, f64::INFINITY)?;
            }
            if system.breaks_on_the_way() && system.is_overstretched(observed) {
                broken = self.break_bonds(card, system, state)?;
            }
        }
        let damping = damping(iteration, &sums);
        let rounding = (self.device.precision().epsilon(), measures.then_some(found.moved));
        state.record_measured(system, &sums, &goal, rounding);
        if state.is_balanced(&goal, broken)? {
            return Ok(true);
        }
        let (keep, push) = move_factors(iteration, mass, damping);
        card.relax(keep, push);
        if let Some(contact) = system.repulsion() {
            card.body.stop(contact.detached());
        }
        state.counts.iterate();
        let keeps = state.counts.iteration.is_multiple_of(KEPT);
        if keeps {
            Self::fetch(card, system, state)?;
        }
        let status = state.status(system.factors.len(), self.settings.tolerance, damping, keeps);
        watch(&status, state)?;
        if keeps {
            // as a run that continues here
            let fields = [&state.displacement, &state.velocity, &state.force];
            card.body.set_state(lattice_with_law(system)?.0, fields, 1.0)?;
        }
        Ok(false)
    }

    /// Breaks bonds on the way to equilibrium; returns true if any broke.
    fn break_bonds(
        &mut self,
        card: &mut DeviceRelaxation<D>,
        system: &mut System<D>,
        state: &mut State<D>,
    ) -> Result<bool, Error> {
        Self::fetch(card, system, state)?;
        let sites = system.break_bonds(state);
        if !sites.is_empty() {
            self.bonds_broke(system, &sites);
            let fields = [&state.displacement, &state.velocity, &state.force];
            card.body.set_state(lattice_with_law(system)?.0, fields, 1.0)?;
            card.body.set_loads(&loads(system));
            card.body.set_planes(planes(system));
            self.pairs.expire();
            self.pairs.renew(&mut card.body, system, &state.displacement);
            self.pushed = squares(system);
            if !self.stiffened {
                card.set_masses(&self.unit_mass)?;
            }
        }
        system.refuse_unsupported(state, self.settings.tolerance)?;
        Ok(!sites.is_empty())
    }
}

impl<const D: usize> Equilibrium<D> for CardRelaxation<'_, D> {
    fn equilibrate(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
    ) -> Result<Option<StretchRange>, Error> {
        refuse(system)?;
        let status = state.status(system.factors.len(), self.settings.tolerance, 0.0, true);
        watch(&status, state)?;
        self.begin(system, state)?;
        let Some(mut card) = self.card.take() else { return Ok(None) };
        let ended = loop {
            match self.iterate(&mut card, system, state, watch) {
                Ok(false) => {}
                ended => break ended,
            }
        };
        if matches!(ended, Ok(_) | Err(Error::NotConverged { .. })) {
            Self::fetch(&card, system, state)?;
        }
        self.card = Some(card);
        ended.map(|_| None)
    }

    fn bonds_broke(&mut self, system: &System<D>, sites: &[u32]) {
        update_unit_mass(&*system.bonds, sites, &mut self.unit_mass);
    }

    fn tolerance(&self) -> f64 {
        self.settings.tolerance
    }
}
