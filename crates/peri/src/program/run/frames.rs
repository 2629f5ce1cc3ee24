//! Fields of single steps: what is written during a run.

use super::material::Observed;
use crate::bonds::{Bonds, Kind, covered_stretches};
use crate::error::Error;
use crate::geometry::Cut;
use crate::potential::KernelFit;
use crate::program::scene::{Scene, severed_of_each};
use crate::solver::{Record, State};
use crate::stress::{self, Loaded, Measure, Measured, Missing, Tensor, cauchy, deformation_gradients};
use harness::output::vtkhdf::ParticleSeries;
use harness::report::Phases;
use polycore::constitutive::Flags;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A stress field of each measure.
pub type Fields<const D: usize> = Vec<(Measure, Vec<Tensor<D>>)>;

/// What stays the same over the steps of a variant.
pub struct Frames<'a, const D: usize> {
    scene: &'a Scene,
    observed: &'a Observed<'a, D>,
    /// Bonds of each particle without cracks, and how many these have broken; only where there are cracks, or bonds break.
    whole: Option<[Vec<u32>; 2]>,
    series: Option<ParticleSeries>,
    path: PathBuf,
    /// The last step written.
    written: Option<usize>,
    /// Sites in which stress measures make up for missing bonds by their window's share in the body.
    by_window: Vec<bool>,
}

/// Stresses of a state by every measure that the scene names.
pub struct Stresses<const D: usize> {
    /// First Piola–Kirchhoff.
    pub piola: Fields<D>,
    /// Cauchy.
    pub cauchy: Fields<D>,
}

fn all_intact<const D: usize>(bonds: &dyn Bonds<D>) -> Vec<u32> {
    bonds.particles().iter().map(|&site| bonds.bonded(site as usize)).collect()
}

/// Whether the fields after the first `rows` of the history are written during the run.
fn wanted<const D: usize>(every: usize, state: &State<D>, rows: usize) -> bool {
    let history = &state.history;
    let before = rows.checked_sub(2).map_or(0, |k| history[k].broken);
    let prescribed = state.control.prescribed(rows).is_some_and(|steps| steps.is_multiple_of(every));
    rows > 0 && (prescribed || history[rows - 1].broken > before)
}

/// Whether an equilibrium within a step is written: the 1st, 2nd, 3rd, 4th, 6th, 8th, 12th, 16th, 24th, …
fn is_stage(equilibrium: u64) -> bool {
    equilibrium.is_power_of_two() || (equilibrium.is_multiple_of(3) && (equilibrium / 3).is_power_of_two())
}

/// How many of the first equilibria are written.
fn in_between(equilibria: u64) -> usize {
    let powers = |n: u64| (u64::BITS - n.leading_zeros()) as usize;
    powers(equilibria) + powers(equilibria / 3)
}

/// Frames written up to a state.
fn frames_of<const D: usize>(every: usize, state: &State<D>) -> usize {
    let of_step = |step: usize| {
        let last = wanted(every, state, step + 1);
        in_between(state.history[step].rounds.saturating_sub(1)) + usize::from(last)
    };
    (0..state.history.len()).map(of_step).sum::<usize>() + in_between(state.control.round)
}

/// Flags as a number, the sum of 1 for a component of C outside of the box of the training data, 2 for one that never changed there,
/// 4 for a gap in the data and 8 for members that disagree.
fn reasons(flags: &Flags) -> f64 {
    let reasons = [flags.outside.contains(&true), flags.unseen.contains(&true), flags.far, flags.spread];
    reasons.iter().zip([1.0, 2.0, 4.0, 8.0]).map(|(&given, bit)| if given { bit } else { 0.0 }).sum()
}

/// A vector with zeros for what a plane body lacks.
pub(super) fn in_space<const D: usize>(v: [f64; D]) -> [f64; 3] {
    std::array::from_fn(|d| v.get(d).copied().unwrap_or(0.0))
}

/// A tensor, rows first, with zeros for what a plane body lacks.
pub(super) fn tensor_in_space<const D: usize>(t: &Tensor<D>) -> [f64; 9] {
    std::array::from_fn(|k| t.get(k / 3).and_then(|row| row.get(k % 3)).copied().unwrap_or(0.0))
}

impl<'a, const D: usize> Frames<'a, D> {
    /// Begins, or continues after the steps in `state`. `bonds` are those of the body as it was built, with its cracks.
    ///
    /// # Errors
    /// Files that cannot be written or read.
    pub fn new(
        scene: &'a Scene,
        observed: &'a Observed<'a, D>,
        (bonds, cuts): (&dyn Bonds<D>, &[Cut<D>]),
        state: &State<D>,
        path: PathBuf,
        by_window: Vec<bool>,
    ) -> Result<Self, Error> {
        let whole = (scene.material.critical.is_some() || !cuts.is_empty()).then(|| {
            let cracked = severed_of_each(bonds, cuts);
            [all_intact(bonds).iter().zip(&cracked).map(|(left, cracked)| left + cracked).collect(), cracked]
        });
        let every = scene.output.every;
        let done = every.map_or(0, |every| frames_of(every, state));
        let series = match (scene.output.fields, done) {
            (false, _) => None,
            (true, 0) => Some(ParticleSeries::create(&path)?),
            (true, done) => Some(ParticleSeries::resume(&path, done)?),
        };
        let last = |every| (1..=state.history.len()).rev().find(|&k| wanted(every, state, k));
        let written = every.and_then(last);
        Ok(Self { scene, observed, whole, series, path, written, by_window })
    }

    /// After a step, or an equilibrium in which bonds broke: writes its fields if the scene wants them.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn step(&mut self, bonds: &dyn Bonds<D>, state: &State<D>, phases: &mut Phases) -> Result<(), Error> {
        let Some(every) = self.scene.output.every.filter(|_| self.scene.output.fields) else { return Ok(()) };
        if is_stage(state.control.round) {
            let stresses = self.stresses(bonds, state, phases)?;
            let equilibrium = state.control.round as f64;
            self.write(bonds, state, &stresses, state.step as f64 + equilibrium / (equilibrium + 1.0))?;
        } else if state.control.round == 0 && wanted(every, state, state.history.len()) {
            let stresses = self.stresses(bonds, state, phases)?;
            self.write(bonds, state, &stresses, state.step as f64)?;
            self.written = Some(state.step);
        }
        Ok(())
    }

    /// Closes the series with the last step.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn finish(
        mut self,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
        stresses: &Stresses<D>,
    ) -> Result<(), Error> {
        if self.series.is_some() && self.written != Some(state.history.len()) {
            self.write(bonds, state, stresses, state.step as f64)?;
        }
        if let Some(series) = self.series {
            series.finish()?;
        }
        Ok(())
    }

    /// Broken bonds over those of the body without cracks, particle by particle: bonds that cracks of the scene break are damage.
    pub fn damage(&self, bonds: &dyn Bonds<D>) -> Option<Vec<f64>> {
        let [whole, _] = self.whole.as_ref()?;
        let now = all_intact(bonds);
        let part = |(&whole, &now): (&u32, &u32)| {
            if whole == 0 { 0.0 } else { 1.0 - f64::from(now) / f64::from(whole) }
        };
        Some(whole.iter().zip(&now).map(part).collect())
    }

    /// The sum of the damage that cracks of the scene are.
    pub fn damage_of_cracks(&self) -> f64 {
        let part = |(&whole, &cracked): (&u32, &u32)| {
            if whole == 0 { 0.0 } else { 1.0 - f64::from(whole - cracked) / f64::from(whole) }
        };
        self.whole.as_ref().map_or(0.0, |[whole, cracked]| whole.iter().zip(cracked).map(part).sum())
    }

    /// Stresses of a state. The phase of a measure is what it would take alone ([`Measured::seconds`]).
    ///
    /// # Errors
    /// As [`KernelFit::new`].
    pub fn stresses(
        &self,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
        phases: &mut Phases,
    ) -> Result<Stresses<D>, Error> {
        let mut stresses = Stresses { piola: Vec::new(), cauchy: Vec::new() };
        let Some(spec) = &self.scene.stress else { return Ok(stresses) };
        let keeps = self.scene.output.fields || !self.scene.output.line.is_empty();
        let (law, modulus) = match self.observed {
            Observed::Bonds { material, .. } => (material.law(), material.modulus()),
            _ => {
                let found = phases.time("stress constitutive", || self.observed.stress(bonds, state));
                if let Some([piola, cauchy]) = found {
                    stresses.cauchy.push((Measure::Constitutive, cauchy));
                    stresses.piola.extend(keeps.then_some((Measure::Constitutive, piola)));
                }
                return Ok(stresses);
            }
        };
        let fit = KernelFit::new(law, covered_stretches(bonds, &state.displacement), self.scene.fit_bound())?;
        let gradients =
            phases.time("deformation gradient", || deformation_gradients(bonds, &state.displacement));
        let missing = Missing::WindowAt(&self.by_window);
        let loaded = Loaded { displacement: &state.displacement, fit: &fit, modulus, missing };
        let measured = stress::piolas(bonds, &loaded, &spec.measures, spec.ball);
        for (&measure, Measured { piola, seconds }) in spec.measures.iter().zip(measured) {
            let started = Instant::now();
            stresses.cauchy.push((measure, cauchy(&piola, &gradients)));
            let seconds = seconds + started.elapsed().as_secs_f64();
            phases.add(&format!("stress {}", measure.name()), seconds);
            if keeps {
                stresses.piola.push((measure, piola));
            }
        }
        Ok(stresses)
    }

    fn write(
        &mut self,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
        stresses: &Stresses<D>,
        time: f64,
    ) -> Result<(), Error> {
        let damage = self.damage(bonds);
        let flags = self.scene.output.flags.then(|| self.observed.flags(bonds, state)).flatten();
        let flags: Option<Vec<f64>> = flags.map(|flags| flags.iter().map(reasons).collect());
        let Some(series) = &mut self.series else { return Ok(()) };
        // lists of arrays are allocated once; flat ones would grow by doubling
        let particles = bonds.particles().iter().map(|&site| site as usize);
        let displacement: Vec<[f64; 3]> =
            particles.clone().map(|site| in_space(state.displacement.get(site))).collect();
        let place = |(site, u): (usize, &[f64; 3])| -> [f64; 3] {
            let x = in_space(bonds.position(site));
            std::array::from_fn(|d| x[d] + u[d])
        };
        let points: Vec<[f64; 3]> = particles.zip(&displacement).map(place).collect();
        let kinds = [("cauchy", &stresses.cauchy), ("piola", &stresses.piola)];
        let tensors: Vec<(String, Vec<f64>)> = kinds
            .iter()
            .flat_map(|(kind, fields)| fields.iter().map(move |(measure, field)| (kind, measure, field)))
            .map(|(kind, measure, field)| {
                let all: Vec<[f64; 9]> = field.iter().map(tensor_in_space).collect();
                (format!("{kind}_{}", measure.name()), all.into_flattened())
            })
            .collect();
        let mut data: Vec<(&str, usize, &[f64])> = vec![("displacement", 3, displacement.as_flattened())];
        // a cloud's particles are sorted for locality: this is the line of each in the user's file, from 0
        let lines: Option<Vec<f64>> = match bonds.kind() {
            Kind::Cloud(cloud) => Some(cloud.input_order().iter().map(|&line| f64::from(line)).collect()),
            Kind::Lattice(_) => None,
        };
        data.extend(lines.iter().map(|lines| ("input_index", 1, lines.as_slice())));
        data.extend(damage.iter().map(|damage| ("damage", 1, damage.as_slice())));
        data.extend(flags.iter().map(|flags| ("flags", 1, flags.as_slice())));
        data.extend(tensors.iter().map(|(name, values)| (name.as_str(), 9, values.as_slice())));
        // between two steps a load is that of neither
        let record = state.history.last().filter(|_| time.fract() == 0.0);
        let of = |get: fn(&Record) -> f64| record.map_or(f64::NAN, get);
        let moments = [("displacement", of(|r| r.displacement)), ("load", of(|r| r.load))];
        series.moment(time, &points, &data, &moments)?;
        Ok(())
    }

    /// Where the series ends up.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_are_counted() {
        for n in 0..200 {
            assert_eq!(in_between(n), (1..=n).filter(|&k| is_stage(k)).count(), "{n}");
        }
    }
}
