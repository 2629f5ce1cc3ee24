//! Writes the fields of a run to a file.

use super::moment::{Moment, SceneObservers};
use crate::bonds::BondKind;
use crate::error::Error;
use crate::program::scene::Scene;
use crate::solver::{State, StepRecord};
use crate::stress::StressTensor;
use harness::observe::{Fields, Place};
use harness::output::vtkhdf::ParticleSeries;
use std::path::Path;

/// Field file of a variant.
pub struct FieldFrames {
    series: Option<ParticleSeries>,
    /// Last step written.
    written: Option<usize>,
}

/// Returns true if the fields after the first `rows` of the history are written during the run.
fn is_written<const D: usize>(every: usize, state: &State<D>, rows: usize) -> bool {
    let history = &state.history;
    let before = rows.checked_sub(2).map_or(0, |k| history[k].broken);
    let prescribed = state.control.prescribed(rows).is_some_and(|steps| steps.is_multiple_of(every));
    rows > 0 && (prescribed || history[rows - 1].broken > before)
}

/// Returns true if an equilibrium within a step is written: the 1st, 2nd, 3rd, 4th, 6th, 8th, 12th, 16th,
/// 24th, …
fn is_stage(equilibrium: u64) -> bool {
    equilibrium.is_power_of_two() || (equilibrium.is_multiple_of(3) && (equilibrium / 3).is_power_of_two())
}

/// Counts the equilibria written among the first ones.
fn count_stages(equilibria: u64) -> usize {
    let powers = |n: u64| (u64::BITS - n.leading_zeros()) as usize;
    powers(equilibria) + powers(equilibria / 3)
}

/// Frames written up to a state.
fn frames_of<const D: usize>(every: usize, state: &State<D>) -> usize {
    let of_step = |step: usize| {
        let last = is_written(every, state, step + 1);
        count_stages(state.history[step].rounds.saturating_sub(1)) + usize::from(last)
    };
    (0..state.history.len()).map(of_step).sum::<usize>() + count_stages(state.control.round)
}

/// Extends a vector of a plane body by zeros.
pub fn in_space<const D: usize>(v: [f64; D]) -> [f64; 3] {
    std::array::from_fn(|d| v.get(d).copied().unwrap_or(0.0))
}

/// Flattens a tensor, rows first, extended by zeros for a plane body.
pub(super) fn tensor_in_space<const D: usize>(t: &StressTensor<D>) -> [f64; 9] {
    std::array::from_fn(|k| t.get(k / 3).and_then(|row| row.get(k % 3)).copied().unwrap_or(0.0))
}

/// Adds displacements, and for a cloud the index of each particle in the input file: particles are sorted for
/// locality.
pub(super) fn displacement_fields<const D: usize>(scene: &Scene, to: &mut Fields<Moment<D>>) {
    to.add("displacement", 3, Place::Points, |m| {
        let each: Vec<[f64; 3]> = m.sites().map(|site| in_space(m.state.displacement.get(site))).collect();
        each.into_flattened()
    });
    if scene.body.has_points() {
        to.add("input_index", 1, Place::Points, |m| match m.bonds.kind() {
            BondKind::Cloud(cloud) => cloud.input_order().iter().map(|&line| f64::from(line)).collect(),
            BondKind::Lattice(_) => Vec::new(),
        });
    }
}

/// Adds the energy density, J/m³, if the scene requests it.
pub(super) fn energy_field<const D: usize>(scene: &Scene, to: &mut Fields<Moment<D>>) {
    if scene.output.energy {
        to.add("energy_density", 1, Place::Points, |m| {
            m.physics.evaluator.energies(m.bonds, m.state).unwrap_or_default()
        });
    }
}

/// Adds stresses by every measure.
pub(super) fn stress_fields<const D: usize>(scene: &Scene, to: &mut Fields<Moment<D>>) {
    for piola in [false, true] {
        let kind = if piola { "piola" } else { "cauchy" };
        for measure in scene.stress.iter().flat_map(|stress| &stress.measures) {
            to.add(format!("{kind}_{}", measure.name()), 9, Place::Points, |m| {
                let Ok(stresses) = m.stresses() else { return Vec::new() };
                let mut fields = if piola { &stresses.piola } else { &stresses.cauchy }.iter();
                let field = fields.find(|(own, _)| own == measure).map(|(_, field)| field);
                // lists of arrays are allocated once; flat ones would grow by doubling
                let all: Vec<[f64; 9]> = field.into_iter().flatten().map(tensor_in_space).collect();
                all.into_flattened()
            });
        }
    }
}

impl FieldFrames {
    /// Creates the file, or continues it after the steps in `state`.
    ///
    /// # Errors
    /// Files that cannot be written or read.
    pub fn new<const D: usize>(scene: &Scene, state: &State<D>, path: &Path) -> Result<Self, Error> {
        let every = scene.output.every;
        let done = every.map_or(0, |every| frames_of(every, state));
        let series = match (scene.output.fields, done) {
            (false, _) => None,
            (true, 0) => Some(ParticleSeries::create(path)?),
            (true, done) => Some(ParticleSeries::resume(path, done)?),
        };
        let last = |every| (1..=state.history.len()).rev().find(|&k| is_written(every, state, k));
        Ok(Self { series, written: every.and_then(last) })
    }

    /// Writes the fields after a step, or after an equilibrium in which bonds broke, if the scene requests
    /// them.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn step<const D: usize>(
        &mut self,
        observers: &SceneObservers<D>,
        m: &Moment<D>,
    ) -> Result<(), Error> {
        let (Some(every), state) = (m.scene.output.every, m.state) else { return Ok(()) };
        if is_stage(state.control.round) {
            let equilibrium = state.control.round as f64;
            self.write(observers, m, state.history.len() as f64 + equilibrium / (equilibrium + 1.0))?;
        } else if state.control.round == 0 && is_written(every, state, state.history.len()) {
            self.write(observers, m, state.history.len() as f64)?;
            self.written = Some(state.history.len());
        }
        Ok(())
    }

    /// Writes the last step and closes the file.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn finish<const D: usize>(
        mut self,
        observers: &SceneObservers<D>,
        m: &Moment<D>,
    ) -> Result<(), Error> {
        if self.written != Some(m.state.history.len()) {
            self.write(observers, m, m.state.history.len() as f64)?;
        }
        if let Some(series) = self.series {
            series.finish()?;
        }
        Ok(())
    }

    fn write<const D: usize>(
        &mut self,
        observers: &SceneObservers<D>,
        m: &Moment<D>,
        time: f64,
    ) -> Result<(), Error> {
        let Some(series) = &mut self.series else { return Ok(()) };
        m.stresses()?;
        let place = |site: usize| -> [f64; 3] {
            let (x, u) = (in_space(m.bonds.position(site)), in_space(m.state.displacement.get(site)));
            std::array::from_fn(|d| x[d] + u[d])
        };
        let points: Vec<[f64; 3]> = m.sites().map(place).collect();
        let mut fields = Fields::new(Some(m));
        observers.iter().for_each(|observer| observer.fields(&mut fields));
        let fields = fields.each.iter().filter(|field| !field.values.is_empty());
        let data: Vec<(&str, usize, &[f64])> =
            fields.map(|field| (&*field.name, field.components, &*field.values)).collect();
        // between two steps the load is unknown
        let record = m.state.history.last().filter(|_| time.fract() == 0.0);
        let value = |get: fn(&StepRecord) -> f64| record.map_or(f64::NAN, get);
        let moments = [("displacement", value(|r| r.displacement)), ("load", value(|r| r.load))];
        series.moment(time, &points, &data, &moments)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_are_counted() {
        for n in 0..200 {
            assert_eq!(count_stages(n), (1..=n).filter(|&k| is_stage(k)).count(), "{n}");
        }
    }
}
