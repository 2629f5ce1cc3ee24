//! Programmes of times: quasi-static runs of solids with a state, or with curves.

use super::Scene;
use super::values::plain;
use harness::scene::{SceneError, Source};
use polycore::units::Time;
use serde::Deserialize;

/// Largest number of increments of a programme.
const MOST: usize = 1_000_000;

/// Programme of a quasi-static run in time, from time 0 without load.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TimeProgramSpec {
    /// Ramps and holds, one after the other.
    pub step: Vec<TimeStep>,
}

/// Ramp or hold.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TimeStep {
    /// Duration.
    pub duration: Time,
    /// Load factor at the end, reached linearly; default: that at the start, a hold.
    pub factor: Option<f64>,
    /// Number of equilibria.
    pub increments: usize,
    /// Duration of the first increment; the others grow by equal ratios. Default: equal increments.
    pub first: Option<Time>,
}

impl TimeStep {
    /// Fractions of the duration at the ends of the increments.
    fn parts(&self) -> Vec<f64> {
        let (count, total) = (self.increments, self.duration.si());
        let first = self.first.map_or(1.0 / count as f64, |first| first.si() / total);
        // Σ q^k = (qⁿ − 1)/(q − 1) = 1/first grows with q from n at q = 1
        let sum = |ratio: f64| (0..count).map(|k| ratio.powi(k as i32)).sum::<f64>();
        let (mut low, mut high) = (1.0, 2.0);
        while self.first.is_some() && sum(high) * first < 1.0 && high < 1e12 {
            high *= 2.0;
        }
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if sum(middle) * first < 1.0 { low = middle } else { high = middle }
        }
        let ratio = if self.first.is_some() { low } else { 1.0 };
        let all = sum(ratio);
        let mut done = 0.0;
        let end = |k: usize| {
            done += ratio.powi(k as i32);
            if k + 1 == count { 1.0 } else { done / all }
        };
        (0..count).map(end).collect()
    }
}

impl Scene {
    /// Returns the load factor at the end of each step, and its time, s; no times without a programme. With
    /// curves the factor is the part of the whole time.
    pub fn load_steps(&self) -> (Vec<f64>, Vec<f64>) {
        let (factors, times) = self.programme();
        match times.last() {
            Some(end) if self.has_curves() => (times.iter().map(|time| time / end).collect(), times),
            _ => (factors, times),
        }
    }

    /// Returns the load factor of what has no curve at the end of each step, and its time, s.
    pub(super) fn programme(&self) -> (Vec<f64>, Vec<f64>) {
        let Some(time) = &self.time else { return (self.solver.factors(), Vec::new()) };
        let (mut factors, mut times) = (Vec::new(), Vec::new());
        let (mut factor, mut start) = (0.0, 0.0);
        for step in &time.step {
            let (end, duration) = (step.factor.unwrap_or(factor), step.duration.si());
            for part in step.parts() {
                factors.push(if part == 1.0 { end } else { factor + part * (end - factor) });
                times.push(start + part * duration);
            }
            (factor, start) = (end, start + duration);
        }
        (factors, times)
    }

    /// Returns true for load factors that turn back.
    pub(crate) fn returns(&self) -> bool {
        let factors = self.programme().0;
        let steps = std::iter::once(0.0).chain(factors.iter().copied()).zip(&factors);
        let signs: Vec<bool> = steps.filter(|(a, b)| a != *b).map(|(a, b)| *b > a).collect();
        self.dynamics.is_none() && signs.windows(2).any(|pair| pair[0] != pair[1])
    }

    /// Returns the number of load steps.
    pub fn step_count(&self) -> usize {
        match &self.time {
            Some(time) => time.step.iter().map(|step| step.increments).sum(),
            None => self.solver.steps,
        }
    }
}

/// Checks the programme of a scene.
///
/// # Errors
/// A [`SceneError`] that names the key, the value found and what is allowed.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let remembers = scene.remembers();
    let Some(time) = &scene.time else {
        if remembers && scene.dynamics.is_none() {
            let why =
                "needed for a solid with branches or softening: the steps of a programme, or [dynamics]";
            return Err(source.missing("time", why));
        }
        return Ok(());
    };
    if !remembers && !scene.has_curves() {
        let why = "only a `solid` with `branch` or `mullins`, a `curve`, a formula of `t`, a `pressure` or \
             a `spin` follows the time";
        return Err(source.unexpected("time", why));
    }
    if scene.dynamics.is_some() {
        let why = "explicit dynamics has its own times";
        return Err(source.conflict("time", "dynamics", why));
    }
    let solver = &scene.solver;
    for (key, given) in
        [("steps", solver.steps != 1), ("path", solver.path.is_some()), ("snap_back", solver.snap_back)]
    {
        if given {
            let why = "the programme of times has its own steps, and time does not run backwards";
            return Err(source.conflict(&format!("solver.{key}"), "time", why));
        }
    }
    if time.step.is_empty() {
        return Err(source.error("time.step", "no step", "at least one"));
    }
    let most = MOST / time.step.len();
    for (index, step) in time.step.iter().enumerate() {
        let key = |name: &str| format!("time.step[{index}].{name}");
        let duration = step.duration.si();
        if !(duration > 0.0 && duration.is_finite()) {
            return Err(source.error(&key("duration"), format!("{} s", plain(duration)), "above 0 s"));
        }
        if !(1..=most).contains(&step.increments) {
            return Err(source.error(&key("increments"), step.increments, format!("1 to {most}")));
        }
        if let Some(factor) = step.factor
            && !(-1e3..=1e3).contains(&factor)
        {
            return Err(source.error(&key("factor"), plain(factor), "-1000 to 1000"));
        }
        if let Some(first) = step.first.map(|first| first.si()) {
            let equal = duration / step.increments as f64;
            if !(first > 1e-12 * duration && first <= equal) {
                let allowed = format!("up to {} s, that of equal increments", plain(equal));
                return Err(source.error(&key("first"), format!("{} s", plain(first)), allowed));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn increments_grow_by_equal_ratios_to_the_end() {
        let step = TimeStep {
            duration: Time::from_si(100.0),
            factor: None,
            increments: 20,
            first: Some(Time::from_si(0.1)),
        };
        let parts = step.parts();
        assert_eq!((parts.len(), parts[19]), (20, 1.0));
        assert!((parts[0] - 1e-3).abs() < 1e-12, "{}", parts[0]);
        let ratio = |k: usize| (parts[k + 2] - parts[k + 1]) / (parts[k + 1] - parts[k]);
        assert!((0..17).all(|k| (ratio(k) / ratio(0) - 1.0).abs() < 1e-9));
        let equal = TimeStep { first: None, ..step }.parts();
        assert!((equal[4] - 0.25).abs() < 1e-15);
    }
}
