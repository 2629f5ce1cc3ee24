//! A material at one point: under a given temperature history, or as a lumped body that cools or is
//! adiabatic.

use crate::error::Error;
use crate::history::{HistorySegment, TemperatureHistory};
use crate::material::{PointInput, ThermalMaterial};
use nalgebra::Vector3;
use root::root;

mod material_point;
mod root;

pub use material_point::MaterialPoint;

/// Source of the temperature.
#[derive(Clone, Debug, PartialEq)]
pub enum Drive {
    /// Given history.
    Prescribed(TemperatureHistory),
    /// Newton's cooling, dU/dt = −c (T − T_a)/τ, with the initial heat capacity c; adiabatic without
    /// exchange.
    Lumped {
        /// Initial temperature, K.
        start: f64,
        /// Temperature of the surroundings T_a, K, and time constant τ, s.
        exchange: Option<[f64; 2]>,
        /// Duration, s.
        duration: f64,
    },
}

/// Division of time into steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stepping {
    /// Adaptive steps: none changes α by more than `degree`, or T by more than `kelvin`.
    Adaptive {
        /// Largest change of α in a step.
        degree: f64,
        /// Largest change of temperature in a step, K.
        kelvin: f64,
    },
    /// Steps of equal change of temperature, K; a hold is one step.
    Kelvin(f64),
    /// Steps of equal time, s.
    Seconds(f64),
}

impl Default for Stepping {
    fn default() -> Self {
        Self::Adaptive { degree: 0.01, kelvin: 0.5 }
    }
}

/// Limit on the steps of a curve.
pub const MAX_STEPS: usize = 1_000_000;

/// A material with its thermal process.
pub struct PointProcess<'a> {
    /// The material.
    pub material: &'a dyn ThermalMaterial,
    /// Source of the temperature.
    pub drive: Drive,
    /// Division of time into steps.
    pub stepping: Stepping,
}

/// Columns of equal length, with a row for the start and for the end of each step.
#[derive(Clone, Debug, Default)]
pub struct Curves {
    /// Time, s.
    pub time: Vec<f64>,
    /// Temperature, K.
    pub temperature: Vec<f64>,
    /// Energy U, J/kg.
    pub energy: Vec<f64>,
    /// dα/dt of growth, 1/s.
    pub rate: Vec<f64>,
    /// States, a vector per row.
    pub states: Vec<Vec<f64>>,
    /// Fields of the material, a vector per row.
    pub fields: Vec<Vec<f64>>,
    /// Segment of the history on which each row's step ends.
    segments: Vec<Option<HistorySegment>>,
    /// Number of rejected steps.
    pub rejected: usize,
}

/// Time and temperature of an event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveEvent {
    /// Time, s.
    pub time: f64,
    /// Temperature, K.
    pub temperature: f64,
    /// dα/dt, 1/s.
    pub rate: f64,
}

/// Values at the end of a step.
struct StepEnd {
    temperature: f64,
    energy: f64,
    state: Vec<f64>,
    step_ratio: Option<f64>,
}

impl PointProcess<'_> {
    /// Computes the curves.
    ///
    /// # Errors
    /// [`Error::Parameter`] for steps that are not above 0 or more than [`MAX_STEPS`]; errors of the
    /// material.
    pub fn run(&self) -> Result<Curves, Error> {
        self.check()?;
        let mut state = vec![0.0; self.material.state_names().len()];
        let (start, segments) = match &self.drive {
            Drive::Prescribed(history) => (history.start(), history.segments().map(Some).collect::<Vec<_>>()),
            Drive::Lumped { start, .. } => (*start, vec![None]),
        };
        self.material.initial_state(start, &mut state);
        let time = match &self.drive {
            Drive::Prescribed(history) => history.span()[0],
            Drive::Lumped { .. } => 0.0,
        };
        let mut curves = Curves::default();
        let energy = self.material.energy(start, &state);
        self.record(&mut curves, time, None, StepEnd { temperature: start, energy, state, step_ratio: None });
        for segment in segments {
            self.follow(&mut curves, segment)?;
        }
        Ok(curves)
    }

    fn check(&self) -> Result<(), Error> {
        let positive = |name, found: f64| {
            let allowed = "above 0 and finite".to_owned();
            if found > 0.0 && found.is_finite() {
                Ok(())
            } else {
                Err(Error::Parameter { name, found, allowed })
            }
        };
        if let Drive::Lumped { start, exchange, duration } = self.drive {
            positive("temperature at the start, K", start)?;
            positive("duration, s", duration)?;
            if let Some([ambient, constant]) = exchange {
                positive("temperature of the surroundings, K", ambient)?;
                positive("time constant, s", constant)?;
            }
        }
        let (steps, step) = match (self.stepping, &self.drive) {
            (Stepping::Seconds(seconds), Drive::Prescribed(history)) => {
                ((history.span()[1] - history.span()[0]) / seconds, seconds)
            }
            (Stepping::Seconds(seconds), Drive::Lumped { duration, .. }) => (duration / seconds, seconds),
            (Stepping::Kelvin(kelvin), Drive::Prescribed(history)) => (
                history.segments().map(|s| (s.temperatures[1] - s.temperatures[0]).abs() / kelvin).sum(),
                kelvin,
            ),
            _ => (0.0, 0.0),
        };
        if steps > MAX_STEPS as f64 {
            let allowed = format!("one that makes at most {MAX_STEPS} steps");
            return Err(Error::Parameter { name: "step (s or K)", found: step, allowed });
        }
        match self.stepping {
            Stepping::Adaptive { degree, kelvin } => {
                positive("largest change of alpha in a step", degree)?;
                positive("largest change of temperature in a step, K", kelvin)
            }
            Stepping::Kelvin(kelvin) => positive("step of temperature, K", kelvin),
            Stepping::Seconds(seconds) => positive("time step, s", seconds),
        }
    }

    /// Steps through a segment, or through the whole duration of a lumped body.
    fn follow(&self, curves: &mut Curves, segment: Option<HistorySegment>) -> Result<(), Error> {
        let (begin, end, slope) = match (&self.drive, &segment) {
            (Drive::Lumped { duration, .. }, _) => (0.0, *duration, 0.0),
            (_, Some(HistorySegment { times: [a, b], temperatures: [from, to] })) => {
                (*a, *b, if b > a { (to - from) / (b - a) } else { 0.0 })
            }
            _ => return Ok(()),
        };
        let duration = end - begin;
        // time over which the temperature changes by a kelvin
        let widest = match self.stepping {
            Stepping::Adaptive { kelvin, .. } | Stepping::Kelvin(kelvin) if slope != 0.0 => {
                kelvin / slope.abs()
            }
            Stepping::Seconds(seconds) => seconds,
            _ => f64::INFINITY,
        };
        let exchanged = match self.drive {
            Drive::Lumped { exchange: Some([_, constant]), .. } => 0.05 * constant,
            _ => f64::INFINITY,
        };
        let widest = match self.stepping {
            Stepping::Adaptive { .. } => widest.min(exchanged),
            _ => widest,
        };
        let least = duration * 1e-12;
        let (mut done, mut wish) = (0.0, widest);
        if matches!(self.drive, Drive::Lumped { .. }) && matches!(self.stepping, Stepping::Adaptive { .. }) {
            wish = wish.min(duration * 1e-3);
        }
        loop {
            let left = duration - done;
            // avoid a tiny last step
            let dt = if wish >= left * (1.0 - 1e-9) { left } else { wish.min(widest) };
            let row = curves.time.len() - 1;
            let last = dt == left;
            let after = if last { duration } else { done + dt };
            let found = self.step(curves, row, segment.as_ref(), begin + done, begin + after, dt)?;
            let ratio = self.ratio(curves, row, &found);
            if ratio < 1.0 && dt > least && dt > 0.0 {
                curves.rejected += 1;
                wish = dt * ratio.max(0.1) * 0.9;
                continue;
            }
            self.record(curves, begin + after, segment, found);
            if last {
                return Ok(());
            }
            if curves.time.len() > MAX_STEPS {
                let allowed = format!("steps that make at most {MAX_STEPS}");
                return Err(Error::Parameter { name: "time step, s", found: dt, allowed });
            }
            done = after;
            wish = match self.stepping {
                Stepping::Adaptive { .. } => dt * (0.9 * ratio).clamp(0.2, 2.0),
                _ => widest,
            };
        }
    }

    /// Ratio of allowed to actual change of a step.
    fn ratio(&self, curves: &Curves, row: usize, found: &StepEnd) -> f64 {
        let Stepping::Adaptive { degree, kelvin } = self.stepping else { return 1.0 };
        let mut ratio = f64::INFINITY;
        if let (Some(_), Some(index)) = (found.step_ratio, self.degree_index()) {
            let mut fields = vec![0.0; self.material.field_names().len()];
            self.material.fields(&found.state, &mut fields);
            ratio = degree / (fields[index] - curves.fields[row][index]).abs();
        }
        // steps along prescribed temperatures are limited in advance
        if matches!(self.drive, Drive::Lumped { .. }) {
            ratio = ratio.min(kelvin / (found.temperature - curves.temperature[row]).abs());
        }
        if ratio.is_nan() { 1.0 } else { ratio }
    }

    /// Steps from a row to a later time.
    fn step(
        &self,
        curves: &Curves,
        row: usize,
        segment: Option<&HistorySegment>,
        from: f64,
        to: f64,
        dt: f64,
    ) -> Result<StepEnd, Error> {
        let start = curves.temperature[row];
        let mut state = vec![0.0; self.material.state_names().len()];
        let mut respond = |end: f64| {
            let at =
                PointInput { temperature: start, increment: end - start, gradient: Vector3::zeros(), dt };
            self.material.respond(&at, &curves.states[row], &mut state)
        };
        let temperature = match (&self.drive, segment) {
            (Drive::Lumped { start: first, exchange, .. }, _) => {
                let capacity = self.capacity(*first);
                let (before, loss) =
                    (curves.energy[row], exchange.map(|[ambient, tau]| (ambient, capacity / tau)));
                // the trapezoidal rule, second order
                root(start, |end| {
                    let response = respond(end)?;
                    let (lost, slope) = loss.map_or((0.0, 0.0), |(ambient, conductance)| {
                        (dt * conductance * (0.5 * (start + end) - ambient), 0.5 * dt * conductance)
                    });
                    Ok([response.energy - before + lost, response.d_energy_d_temperature + slope])
                })?
            }
            (Drive::Prescribed(_), Some(segment)) if from < to => segment.temperature_at(to),
            (Drive::Prescribed(_), Some(segment)) => segment.temperatures[1],
            (Drive::Prescribed(_), None) => start,
        };
        let response = respond(temperature)?;
        Ok(StepEnd { temperature, energy: response.energy, state, step_ratio: response.step_ratio })
    }

    /// Heat capacity at constant state, J/(kg K).
    fn capacity(&self, temperature: f64) -> f64 {
        let mut state = vec![0.0; self.material.state_names().len()];
        self.material.initial_state(temperature, &mut state);
        let [below, above] = [temperature - 0.5, temperature + 0.5].map(|t| self.material.energy(t, &state));
        above - below
    }

    fn record(&self, curves: &mut Curves, time: f64, segment: Option<HistorySegment>, end: StepEnd) {
        let mut fields = vec![0.0; self.material.field_names().len()];
        self.material.fields(&end.state, &mut fields);
        curves.time.push(time);
        curves.temperature.push(end.temperature);
        curves.energy.push(end.energy);
        curves.rate.push(self.material.crystallization_rate(end.temperature, &end.state));
        curves.states.push(end.state);
        curves.fields.push(fields);
        curves.segments.push(segment);
    }

    /// Index of α among the fields.
    pub fn degree_index(&self) -> Option<usize> {
        self.material.field_names().iter().position(|name| *name == "alpha")
    }

    /// Locates the first upward crossing of α through a degree, by repeating its step, to rounding.
    ///
    /// # Errors
    /// Errors of [`PointProcess::run`].
    pub fn reaching(&self, curves: &Curves, degree: f64) -> Result<Option<CurveEvent>, Error> {
        let Some(index) = self.degree_index() else { return Ok(None) };
        let alpha = |row: usize| curves.fields[row][index];
        let Some(row) = (1..curves.time.len()).find(|&row| alpha(row - 1) < degree && alpha(row) >= degree)
        else {
            return Ok(None);
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let end = self.within(curves, row, middle)?;
            let mut fields = vec![0.0; self.material.field_names().len()];
            self.material.fields(&end.state, &mut fields);
            if fields[index] >= degree { high = middle } else { low = middle }
        }
        self.event(curves, row, high).map(Some)
    }

    /// Locates the maximum of dα/dt, by golden section around the largest row.
    ///
    /// # Errors
    /// Errors of [`PointProcess::run`].
    pub fn peak(&self, curves: &Curves) -> Result<Option<CurveEvent>, Error> {
        let rows = curves.time.len();
        let finite = (0..rows).filter(|&row| curves.rate[row] > 0.0 && curves.rate[row].is_finite());
        let Some(top) = finite.max_by(|&a, &b| curves.rate[a].total_cmp(&curves.rate[b])) else {
            return Ok(None);
        };
        let mut best = CurveEvent {
            time: curves.time[top],
            temperature: curves.temperature[top],
            rate: curves.rate[top],
        };
        for row in [top, top + 1].into_iter().filter(|&row| row > 0 && row < rows) {
            let (mut low, mut high) = (0.0, 1.0);
            let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
            for _ in 0..50 {
                let [a, b] = [high - golden * (high - low), low + golden * (high - low)];
                let [left, right] = [self.event(curves, row, a)?, self.event(curves, row, b)?];
                if left.rate > right.rate { high = b } else { low = a }
            }
            let event = self.event(curves, row, 0.5 * (low + high))?;
            if event.rate > best.rate && event.rate.is_finite() {
                best = event;
            }
        }
        Ok(Some(best))
    }

    fn event(&self, curves: &Curves, row: usize, share: f64) -> Result<CurveEvent, Error> {
        let end = self.within(curves, row, share)?;
        let time = curves.time[row - 1] + share * (curves.time[row] - curves.time[row - 1]);
        let rate = self.material.crystallization_rate(end.temperature, &end.state);
        Ok(CurveEvent { time, temperature: end.temperature, rate })
    }

    /// Repeats a fraction of the step that ended at a row.
    fn within(&self, curves: &Curves, row: usize, share: f64) -> Result<StepEnd, Error> {
        let [from, to] = [curves.time[row - 1], curves.time[row]];
        let dt = share * (to - from);
        if to > from {
            return self.step(curves, row - 1, curves.segments[row].as_ref(), from, from + dt, dt);
        }
        // a fraction of a jump
        let [a, b] = [curves.temperature[row - 1], curves.temperature[row]];
        let jump = HistorySegment { times: [from, from], temperatures: [a, a + share * (b - a)] };
        self.step(curves, row - 1, Some(&jump), from, from, 0.0)
    }
}

#[cfg(test)]
mod tests;
