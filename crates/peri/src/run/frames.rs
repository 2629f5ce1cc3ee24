//! Fields of single steps: what is written while a run goes on, and the pictures of its stages.

use super::outcome::Outcome;
use crate::bonds::{Bonds, Kind};
use crate::error::Error;
use crate::potential::{BondPotential, KernelFit};
use crate::scene::Scene;
use crate::solver::{Record, State};
use crate::stress::{Loaded, Measure, Missing, Tensor, cauchy, deformation_gradients};
use polycore::output::picture::{FieldMap, Panel};
use polycore::output::vtkhdf::{self, ParticleSeries};
use polycore::report::Phases;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A stress field of each measure.
pub type Fields<const D: usize> = Vec<(Measure, Vec<Tensor<D>>)>;

/// What stays the same over the steps of a variant.
pub struct Frames<'a> {
    scene: &'a Scene,
    law: &'a dyn BondPotential,
    modulus: f64,
    /// Intact bonds of each particle as the body was built, cracks taken off; only where bonds break.
    whole: Option<Vec<u32>>,
    series: Option<ParticleSeries>,
    path: PathBuf,
    /// The last step written.
    written: Option<usize>,
    /// Slots in which stress measures make up for missing bonds by their window's share in the body.
    by_window: Vec<bool>,
}

/// Stresses of a state by every measure that the scene names.
pub struct Stresses<const D: usize> {
    /// First Piola–Kirchhoff.
    pub piola: Fields<D>,
    /// Cauchy.
    pub cauchy: Fields<D>,
}

/// Intact bonds of a slot.
pub(super) fn intact<const D: usize>(bonds: &dyn Bonds<D>, slot: usize) -> u32 {
    let mut count = 0;
    bonds.neighbours(slot, &mut |_| count += 1);
    count
}

fn all_intact<const D: usize>(bonds: &dyn Bonds<D>) -> Vec<u32> {
    bonds.particles().iter().map(|&slot| intact(bonds, slot as usize)).collect()
}

/// Whether the fields of the last step of a history are written while the run goes on.
fn wanted(every: usize, history: &[Record]) -> bool {
    let step = history.len();
    let before = step.checked_sub(2).map_or(0, |k| history[k].broken);
    step > 0 && (step.is_multiple_of(every) || history[step - 1].broken > before)
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
        let last = wanted(every, &state.history[..=step]);
        in_between(state.history[step].rounds.saturating_sub(1)) + usize::from(last)
    };
    (0..state.history.len()).map(of_step).sum::<usize>() + in_between(state.round)
}

impl<'a> Frames<'a> {
    /// Begins, or continues after the steps in `state`. `bonds` are those of the body as it was built.
    ///
    /// # Errors
    /// Files that cannot be written or read.
    pub fn new<const D: usize>(
        scene: &'a Scene,
        law: &'a dyn BondPotential,
        modulus: f64,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
        path: PathBuf,
        by_window: Vec<bool>,
    ) -> Result<Self, Error> {
        let whole = scene.material.critical.is_some().then(|| all_intact(bonds));
        let every = scene.output.every;
        let done = every.map_or(0, |every| frames_of(every, state));
        let series = match (scene.output.fields, done) {
            (false, _) => None,
            (true, 0) => Some(ParticleSeries::create(&path)?),
            (true, done) => Some(ParticleSeries::resume(&path, done)?),
        };
        let last = |every| (1..=state.history.len()).rev().find(|&k| wanted(every, &state.history[..k]));
        let written = every.and_then(last);
        Ok(Self { scene, law, modulus, whole, series, path, written, by_window })
    }

    /// After a step, or an equilibrium in which bonds broke: writes its fields if the scene wants them.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn step<const D: usize>(
        &mut self,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
        phases: &mut Phases,
    ) -> Result<(), Error> {
        let Some(every) = self.scene.output.every.filter(|_| self.scene.output.fields) else { return Ok(()) };
        if is_stage(state.round) {
            let stresses = self.stresses(bonds, state, phases)?;
            let equilibrium = state.round as f64;
            self.write(bonds, state, &stresses, state.step as f64 + equilibrium / (equilibrium + 1.0))?;
        } else if state.round == 0 && wanted(every, &state.history) {
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
    pub fn finish<const D: usize>(
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

    /// Broken bonds over those that the body was built with, particle by particle; cracks are no damage.
    pub fn damage<const D: usize>(&self, bonds: &dyn Bonds<D>) -> Option<Vec<f64>> {
        let whole = self.whole.as_ref()?;
        let now = all_intact(bonds);
        let part = |(&whole, &now): (&u32, &u32)| {
            if whole == 0 { 0.0 } else { 1.0 - f64::from(now) / f64::from(whole) }
        };
        Some(whole.iter().zip(&now).map(part).collect())
    }

    /// Stresses of a state.
    ///
    /// # Errors
    /// As [`KernelFit::new`].
    pub fn stresses<const D: usize>(
        &self,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
        phases: &mut Phases,
    ) -> Result<Stresses<D>, Error> {
        let mut stresses = Stresses { piola: Vec::new(), cauchy: Vec::new() };
        let Some(spec) = &self.scene.stress else { return Ok(stresses) };
        let fit = KernelFit::new(self.law, super::covering(bonds, state), self.scene.fit_bound())?;
        let gradients =
            phases.time("deformation gradient", || deformation_gradients(bonds, &state.displacement));
        for &measure in &spec.measures {
            let missing = Missing::WindowAt(&self.by_window);
            let loaded =
                Loaded { displacement: &state.displacement, fit: &fit, modulus: self.modulus, missing };
            let started = Instant::now();
            let piola = super::stress(bonds, &loaded, measure, spec.ball);
            stresses.cauchy.push((measure, cauchy(&piola, &gradients)));
            phases.add(&format!("stress {}", measure.name()), started.elapsed().as_secs_f64());
            if self.scene.output.fields {
                stresses.piola.push((measure, piola));
            }
        }
        Ok(stresses)
    }

    fn write<const D: usize>(
        &mut self,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
        stresses: &Stresses<D>,
        time: f64,
    ) -> Result<(), Error> {
        let damage = self.damage(bonds);
        let Some(series) = &mut self.series else { return Ok(()) };
        let in_space =
            |v: [f64; D]| -> [f64; 3] { std::array::from_fn(|d| v.get(d).copied().unwrap_or(0.0)) };
        // lists of arrays are allocated once; flat ones would grow by doubling
        let particles = bonds.particles().iter().map(|&slot| slot as usize);
        let displacement: Vec<[f64; 3]> =
            particles.clone().map(|slot| in_space(state.displacement.get(slot))).collect();
        let place = |(slot, u): (usize, &[f64; 3])| -> [f64; 3] {
            let x = in_space(bonds.position(slot));
            std::array::from_fn(|d| x[d] + u[d])
        };
        let points: Vec<[f64; 3]> = particles.zip(&displacement).map(place).collect();
        let full = |t: &Tensor<D>| -> [f64; 9] {
            std::array::from_fn(|k| t.get(k / 3).and_then(|row| row.get(k % 3)).copied().unwrap_or(0.0))
        };
        let kinds = [("cauchy", &stresses.cauchy), ("piola", &stresses.piola)];
        let tensors: Vec<(String, Vec<f64>)> = kinds
            .iter()
            .flat_map(|(kind, fields)| fields.iter().map(move |(measure, field)| (kind, measure, field)))
            .map(|(kind, measure, field)| {
                let all: Vec<[f64; 9]> = field.iter().map(full).collect();
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

/// Largest principal stress of a plane tensor in a row-major 3 × 3.
fn principal(t: &[f64]) -> f64 {
    let (mean, half) = (0.5 * (t[0] + t[4]), 0.5 * (t[0] - t[4]));
    mean + half.hypot(0.5 * (t[1] + t[3]))
}

/// Largest principal stress and damage at some stages from the last whole state on, of a plane body or of the middle
/// plane y = const of a solid.
///
/// # Errors
/// Files that cannot be read or written.
pub fn stages(
    scene: &Scene,
    outcome: &Outcome,
    spacing: f64,
    series: &Path,
    output: &Path,
) -> Result<(), Error> {
    let frames = vtkhdf::read(series)?;
    let damages: Vec<f64> = (0..frames.len())
        .map(|k| Ok(frames.data(k, "damage")?.iter().sum()))
        .collect::<Result<_, Error>>()?;
    // the step of the peak load, which the damage does not tell
    let peak = outcome.history.iter().enumerate().max_by(|a, b| a.1.load.total_cmp(&b.1.load));
    let peak = peak.and_then(|(k, _)| frames.times().iter().position(|&time| time == (k + 1) as f64));
    let chosen = choose(&damages, peak, scene.output.stages);
    let Some(spec) = &scene.stress else { return Ok(()) };
    let measure = format!("cauchy_{}", spec.measures[0].name());
    let component = spec.component();
    let index = match (&spec.component, component) {
        (Some(name), Some(_)) => {
            name.chars().filter_map(|c| "₀₁₂₃".chars().nth(c.to_digit(10)? as usize)).collect()
        }
        _ => "₁".to_owned(),
    };
    let flat = scene.body.space != crate::calibrate::Space::Solid;
    struct Stage {
        places: Vec<[f64; 2]>,
        rest: Vec<[f64; 2]>,
        stress: Vec<f64>,
        damage: Vec<f64>,
        title: String,
    }
    let mut stages = Vec::new();
    for frame in chosen {
        let points = frames.points(frame)?;
        let (moved, tensors, damage) = (
            frames.data(frame, "displacement")?,
            frames.data(frame, &measure)?,
            frames.data(frame, "damage")?,
        );
        let at_rest = |k: usize| [0, 1, 2].map(|d| points[k][d] - moved[3 * k + d]);
        let rest = |k: usize| at_rest(k)[1];
        let middle = {
            let (low, high) =
                (0..points.len()).map(rest).fold((f64::MAX, f64::MIN), |(l, h), y| (l.min(y), h.max(y)));
            0.5 * (low + high)
        };
        let keep: Vec<usize> = (0..points.len())
            .filter(|&k| flat || (0.0..spacing).contains(&(rest(k) - middle + 0.01 * spacing)))
            .collect();
        let in_plane = |x: [f64; 3]| if flat { [x[0], x[1]] } else { [x[0], x[2]] };
        let plane = |k: usize| {
            let t = &tensors[9 * k..9 * k + 9];
            if let Some([a, b]) = component {
                return t[3 * a + b];
            }
            if flat { principal(t) } else { principal(&[t[0], t[2], 0.0, t[6], t[8]]) }
        };
        let title = title(outcome, frames.times()[frame]);
        stages.push(Stage {
            places: keep.iter().map(|&k| in_plane(points[k])).collect(),
            rest: keep.iter().map(|&k| in_plane(at_rest(k))).collect(),
            stress: keep.iter().map(|&k| plane(k)).collect(),
            damage: keep.iter().map(|&k| damage[k]).collect(),
            title,
        });
    }
    let bridge = super::draw::bridge(outcome);
    let [wide, tall] = [0, 1].map(|d| {
        let ends = |(low, high): (f64, f64), x: &[f64; 2]| (low.min(x[d]), high.max(x[d]));
        let extent = |stage: &Stage| stage.places.iter().fold((f64::MAX, f64::MIN), ends);
        stages.iter().map(extent).map(|(low, high)| high - low).fold(0.0, f64::max)
    });
    let layout = Layout::of(wide / tall, stages.len());
    let mut map = FieldMap::new().lengths("mm", 1e-3).columns(layout.columns).size(layout.size);
    if !flat {
        map = map.axes(["x", "z"]);
    }
    // a crushed particle's Cauchy stress would take all the colours
    let mut all: Vec<f64> = stages.iter().flat_map(|stage| stage.stress.iter().copied()).collect();
    all.sort_by(f64::total_cmp);
    let part = |share: f64| all.get((share * (all.len().max(1) - 1) as f64) as usize).copied().unwrap_or(0.0);
    let (low, high) = (part(0.002).min(0.0), part(0.998).max(0.0));
    let (scale, unit) = super::draw::stress_unit(high.max(-low));
    let (low_stress, high_stress, label) = (low * scale, high * scale, format!("σ{index} ({unit})"));
    for stage in &mut stages {
        stage.stress.iter_mut().for_each(|stress| *stress *= scale);
    }
    let kinds = [false, true];
    let order: Vec<(&Stage, bool)> = if layout.pairs {
        stages.iter().flat_map(|stage| kinds.map(|damage| (stage, damage))).collect()
    } else {
        kinds.iter().flat_map(|&damage| stages.iter().map(move |stage| (stage, damage))).collect()
    };
    for (stage, damage) in order {
        let panel = if damage {
            Panel::new("", "damage", &stage.places, &stage.damage, spacing).range(0.0, 0.6)
        } else {
            let panel = Panel::new(&stage.title, &label, &stage.places, &stage.stress, spacing);
            if high_stress > low_stress { panel.range(low_stress, high_stress) } else { panel }
        };
        map = map.panel(panel.reference(&stage.rest).bridge(bridge));
    }
    map.write(output.join(format!("stages_{}.png", outcome.file_name())))?;
    Ok(())
}

/// How stages are laid out: side by side, damage under stress; wide bodies one under another, damage beside stress.
struct Layout {
    pairs: bool,
    columns: usize,
    /// Pixels of a body's longer side.
    size: usize,
}

impl Layout {
    /// For bodies `aspect` times as wide as high.
    fn of(aspect: f64, stages: usize) -> Self {
        match aspect {
            wide if wide > 1.8 => Self { pairs: true, columns: 2, size: 720 },
            narrow if narrow < 0.5 => Self { pairs: false, columns: stages, size: 720 },
            _ => Self { pairs: false, columns: stages, size: 420 },
        }
    }
}

/// What a moment of a run is called: a load step's displacement and load, or a place within a step.
fn title(outcome: &Outcome, time: f64) -> String {
    let step = time.ceil() as usize;
    let Some(record) = step.checked_sub(1).and_then(|k| outcome.history.get(k)) else { return String::new() };
    let place = format!("U = {} mm", short(record.displacement * 1e3));
    let part = time - time.floor();
    if part > 0.0 {
        format!("{place}, equilibrium {:.0}", part / (1.0 - part))
    } else {
        format!("{place}, F = {} N", short(record.load))
    }
}

/// Four digits.
pub(super) fn short(value: f64) -> String {
    let digits = if value == 0.0 { 0 } else { (3 - value.abs().log10().floor() as i32).clamp(0, 6) };
    let text = format!("{value:.*}", digits as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// The last frame before the first break, the peak where it is later, then frames at even parts of all damage, then the
/// last.
fn choose(damage: &[f64], peak: Option<usize>, count: usize) -> Vec<usize> {
    let last = damage.len() - 1;
    let whole = damage.iter().rposition(|&d| d == 0.0).unwrap_or(0);
    let mut chosen = vec![whole];
    let peak = peak.filter(|peak| (whole + 1..last).contains(peak) && count > 2);
    chosen.extend(peak);
    for part in 1 + chosen.len() - 1..count.saturating_sub(1) {
        let target = damage[last] * part as f64 / (count - 1) as f64;
        let off = |k: usize| (damage[k] - target).abs();
        chosen.extend((whole..=last).min_by(|&a, &b| off(a).total_cmp(&off(b))));
    }
    chosen.push(last);
    chosen.sort_unstable();
    chosen.dedup();
    chosen
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

    #[test]
    fn stages_are_chosen_by_damage() {
        assert_eq!(choose(&[0.0, 0.0, 1.0, 5.0, 6.0, 9.0], None, 4), [1, 2, 4, 5]);
        // the peak takes the place of the first of them
        assert_eq!(choose(&[0.0, 0.0, 0.1, 1.0, 5.0, 6.0, 9.0], Some(2), 4), [1, 2, 5, 6]);
        assert_eq!(choose(&[0.0, 0.0], Some(0), 4), [1]);
        assert_eq!(choose(&[3.0], None, 4), [0]);
    }

    #[test]
    fn four_digits() {
        assert_eq!(
            [116.0, 0.021234, 89.57346, 0.0, 12345.6].map(short),
            ["116", "0.02123", "89.57", "0", "12346"]
        );
    }
}
