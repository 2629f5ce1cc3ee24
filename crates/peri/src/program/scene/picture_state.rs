//! States of a run that a scene names, at which its pictures are drawn.

use super::values::{ONE_OF_THEM, plain};
use super::{Scene, step::duration};
use crate::solver::{State, StepRecord};
use harness::scene::{SceneError, Source, check_name};
use polycore::units::Time;
use serde::Deserialize;

/// Relative difference of load factors, and of times, that are the same.
const SAME: f64 = 1e-9;

/// State at which pictures are drawn: the first load step of a load factor or a time, or the end of a
/// `[[step]]`.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StateSpec {
    /// Name, the end of the names of its pictures.
    pub name: String,
    /// Load factor, that of a load step.
    pub factor: Option<f64>,
    /// Time from the start of the run: that of a load step; with `[dynamics]` the first row of the history
    /// from then on.
    pub time: Option<Time>,
    /// Step of a scene with `[[step]]`, the first is 1: of the `factor`, else the state is its end.
    pub step: Option<usize>,
}

/// A named state in the step of a run in which it lies.
pub struct NamedState<'s> {
    /// Name.
    pub name: &'s str,
    /// Step, from 0.
    pub step: usize,
    place: StatePlace,
}

/// Place of a state in its step.
enum StatePlace {
    Factor(f64),
    /// Time of a load step, s.
    Time(f64),
    /// The first row from this time on, s.
    From(f64),
    End,
}

fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME * a.abs().max(b.abs())
}

impl NamedState<'_> {
    /// Returns true for rows that may be the state.
    fn fits(&self, row: &StepRecord) -> bool {
        match self.place {
            StatePlace::Factor(factor) => same(row.factor, factor),
            StatePlace::Time(time) => same(row.time, time),
            StatePlace::From(time) => row.time >= time * (1.0 - SAME),
            StatePlace::End => false,
        }
    }

    /// Returns the first row that is the state, from 0; of an end the last row of a step that is over.
    fn row<const D: usize>(&self, state: &State<D>, is_over: bool) -> Option<usize> {
        let start =
            self.step.checked_sub(1).map_or(Some(0), |before| state.stage.starts.get(before).copied())?;
        let next = state.stage.starts.get(self.step).copied();
        let rows = start..next.unwrap_or(state.history.len());
        match self.place {
            StatePlace::End => rows.last().filter(|_| next.is_some() || is_over),
            _ => rows.into_iter().find(|&row| self.fits(&state.history[row])),
        }
    }

    /// Returns true if the last row of the history is the state; that of an end, if its step is over.
    pub fn is_now<const D: usize>(&self, state: &State<D>, is_over: bool) -> bool {
        let is_end = matches!(self.place, StatePlace::End);
        let row = self.row(state, is_over).filter(|_| is_end == is_over);
        state.stage.finished == self.step && row.is_some_and(|row| row + 1 == state.history.len())
    }
}

impl Scene {
    /// Returns the states that the scene names.
    pub fn named_states(&self) -> Vec<NamedState<'_>> {
        let of = |spec: &'_ StateSpec| -> (usize, StatePlace) {
            match (spec.factor, spec.time.map(Time::si)) {
                (Some(factor), _) => (spec.step.unwrap_or(1) - 1, StatePlace::Factor(factor)),
                (None, Some(time)) => {
                    let step = self.step_at(time);
                    let moves = self.stage(step).dynamics.is_some();
                    (step, if moves { StatePlace::From(time) } else { StatePlace::Time(time) })
                }
                (None, None) => (spec.step.unwrap_or(1) - 1, StatePlace::End),
            }
        };
        let named = |spec| {
            let (step, place) = of(spec);
            NamedState { name: &spec.name, step, place }
        };
        self.output.state.iter().map(named).collect()
    }

    /// Returns a warning for each named state that a run has not reached; `failed` if it ended in an error.
    pub fn unreached<const D: usize>(&self, state: &State<D>, failed: bool) -> Vec<String> {
        let missed = |named: &NamedState| named.row(state, !failed).is_none();
        let end = state.history.last().map_or(String::new(), |row| {
            let time = if row.time > 0.0 { format!(", {} s", plain(row.time)) } else { String::new() };
            format!(" at load factor {}{time}", plain(row.factor))
        });
        let warning = |named: NamedState| {
            format!(
                "`output.state`: the run ended{end}, before the state `{}`: it has no pictures",
                named.name
            )
        };
        self.named_states().into_iter().filter(missed).map(warning).collect()
    }

    /// Returns the step, from 0, in which a time from the start of the run lies, s; the last for later times.
    fn step_at(&self, time: f64) -> usize {
        let ends = |&step: &usize| time <= self.end_of(step) * (1.0 + SAME);
        (0..=self.step.len()).find(ends).unwrap_or(self.step.len())
    }

    /// Returns the time at the end of a step, from 0, s.
    fn end_of(&self, step: usize) -> f64 {
        let own = self.stage(step);
        own.earlier.time + duration(own.time.as_ref(), own.dynamics.as_ref())
    }
}

/// Checks the states of a scene.
///
/// # Errors
/// A [`SceneError`] that names the key, the value found and what is allowed.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let states = &scene.output.state;
    if scene.later || states.is_empty() {
        return Ok(());
    }
    if !scene.output.pictures {
        return Err(source.conflict("output.state", "pictures = false", "states are drawn"));
    }
    for (index, (spec, named)) in states.iter().zip(checked_steps(source, scene)?).enumerate() {
        let key = |name: &str| format!("output.state[{index}].{name}");
        let own = scene.stage(named);
        let (factors, times) = own.load_steps();
        if let Some(factor) = spec.factor {
            if scene.end_of(named) > 0.0 && (own.dynamics.is_some() || own.has_curves()) {
                let why = "with [dynamics] and with curves of time states have a `time`";
                return Err(source.unexpected(&key("factor"), why));
            }
            if !factors.iter().any(|&own| same(own, factor)) {
                return Err(source.error(
                    &key("factor"),
                    plain(factor),
                    around(factor, &factors, "load factor", ""),
                ));
            }
        }
        if let Some(time) = spec.time.map(Time::si) {
            let (start, end) = (own.earlier.time, scene.end_of(named));
            if end == 0.0 {
                let why = "only [time] and [dynamics] have times: write `factor`";
                return Err(source.unexpected(&key("time"), why));
            }
            let found = format!("{} s", plain(time));
            if own.dynamics.is_some() && !(time > 0.0 && time <= end * (1.0 + SAME)) {
                let allowed = format!("above 0 s, up to {} s, the end of the run", plain(end));
                return Err(source.error(&key("time"), found, allowed));
            }
            let times: Vec<f64> = times.iter().map(|own| start + own).collect();
            if own.dynamics.is_none() && !times.iter().any(|&own| same(own, time)) {
                return Err(source.error(&key("time"), found, around(time, &times, "time", " s")));
            }
        }
    }
    Ok(())
}

/// Refuses states whose pictures have the names of others, of the variants with these names.
///
/// # Errors
/// A [`SceneError`] that names the state.
pub(super) fn refuse_shared_names(
    source: &Source,
    scene: &Scene,
    variants: &[String],
) -> Result<(), SceneError> {
    let mut known: Vec<(String, &str)> = variants.iter().map(|name| (name.clone(), "")).collect();
    for (index, state) in scene.output.state.iter().enumerate() {
        for variant in variants {
            let name = format!("{variant}_{}", state.name);
            if known.iter().any(|(other, own)| *other == name && *own != state.name) {
                let found =
                    format!("`{}`, with which pictures of `{variant}` are named `{name}`", state.name);
                let allowed = "a name that makes no name of other pictures";
                return Err(source.error(&format!("output.state[{index}].name"), found, allowed));
            }
            known.push((name, &state.name));
        }
    }
    Ok(())
}

/// Checks names and keys of states, and returns their steps, from 0.
fn checked_steps(source: &Source, scene: &Scene) -> Result<Vec<usize>, SceneError> {
    let states = &scene.output.state;
    for (index, spec) in states.iter().enumerate() {
        let key = |name: &str| format!("output.state[{index}].{name}");
        check_name(source, &key("name"), &spec.name)?;
        if states[..index].iter().any(|other| other.name == spec.name) {
            return Err(source.error(&key("name"), format!("`{}` twice", spec.name), "different names"));
        }
        if spec.time.is_some() {
            for (name, given) in [("factor", spec.factor.is_some()), ("step", spec.step.is_some())] {
                if given {
                    return Err(source.conflict(&key(name), "time", ONE_OF_THEM));
                }
            }
        }
        let count = scene.step.len() + 1;
        match spec.step {
            Some(_) if count == 1 => {
                return Err(source.unexpected(&key("step"), "only a scene with [[step]] has several"));
            }
            Some(step) if !(1..=count).contains(&step) => {
                return Err(source.error(
                    &key("step"),
                    step,
                    format!("1 to {count}, the first is that of the scene"),
                ));
            }
            None if count > 1 && spec.factor.is_some() => {
                return Err(source.missing(&key("step"), "needed beside `factor` in a scene with [[step]]"));
            }
            None if spec.factor.is_none() && spec.time.is_none() => {
                let name = if count > 1 { "step" } else { "factor" };
                return Err(source.missing(&key(name), "needed for a state, or its `time`"));
            }
            _ => {}
        }
    }
    Ok(scene.named_states().into_iter().map(|named| named.step).collect())
}

/// Returns what is allowed: a value of a load step, with those on either side.
fn around(found: f64, all: &[f64], what: &str, unit: &str) -> String {
    let below = all.iter().copied().filter(|&one| one < found).max_by(f64::total_cmp);
    let above = all.iter().copied().filter(|&one| one > found).min_by(f64::total_cmp);
    let near: Vec<String> = below.into_iter().chain(above).map(|one| plain(one) + unit).collect();
    format!("the {what} at the end of a load step, such as {}", near.join(" or "))
}
