//! Histories of a material point: equal steps, and steps under error control.

use super::{Increment, Scheme, State, Step, Viscoelastic};
use crate::constitutive::hyperelastic::data::Mode;
use crate::constitutive::{Error, Workspace};
use crate::tensor::{Voigt, voigt};

/// History of a material point: C and temperature over time.
pub struct History<'a> {
    /// C at a time, s.
    pub strain: &'a dyn Fn(f64) -> Voigt,
    /// Temperature, K, at a time, s.
    pub temperature: &'a dyn Fn(f64) -> f64,
    /// Times of output, s, increasing; the first is the start. A kink of the history belongs among them.
    pub times: &'a [f64],
    /// Origin of the pressure.
    pub reaction: Reaction,
}

/// Origin of the pressure of a point, which glassy viscosities need.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reaction {
    /// The law, which is compressible.
    Law,
    /// The free surface of a test of an incompressible law.
    Test(Mode),
}

/// Steps of a history.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// Number of equal steps between two times of output, at least 1.
    Equal(usize, Scheme),
    /// Second order with the local error of S below a limit, Pa.
    Within(f64),
}

/// Point of a trace.
#[derive(Debug, Clone)]
pub struct TracePoint {
    /// Time, s.
    pub time: f64,
    /// Step that ends here.
    pub step: Step,
    /// Energy dissipated since the start, J/m³.
    pub dissipated: f64,
    /// Work since the start, ∫ ½S:dC by the trapezoidal rule, J/m³.
    pub work: f64,
}

/// Result of a history.
#[derive(Debug, Clone)]
pub struct Trace {
    /// A point at each time of output after the first.
    pub points: Vec<TracePoint>,
    /// Accepted steps.
    pub steps: usize,
    /// Rejected steps.
    pub rejected: usize,
}

/// Safety factor and limits of the change of a step.
const SAFETY: f64 = 0.9;
const CHANGE: [f64; 2] = [0.1, 4.0];

impl Viscoelastic {
    /// Follows a history from a state.
    ///
    /// # Errors
    /// [`Error::Invalid`] for times that do not increase; [`Error::NoConvergence`] where the step falls below
    /// 1e-12 of an interval; errors of [`Viscoelastic::advance`].
    pub fn follow(&self, history: &History<'_>, start: State, pace: Pace) -> Result<Trace, Error> {
        let mut trace = Trace { points: Vec::new(), steps: 0, rejected: 0 };
        let mut memory = Workspace::default();
        let (mut state, mut dissipated, mut work, mut pressure) = (start, 0.0, 0.0, 0.0);
        let mut before = None;
        let mut duration = f64::INFINITY;
        for pair in history.times.windows(2) {
            let [begin, end] = [pair[0], pair[1]];
            if !(end > begin && end.is_finite()) {
                return Err(Error::invalid("times", format!("{end} s after {begin} s"), "increasing times"));
            }
            let (mut time, mut done) = (begin, 0);
            let step = loop {
                let (next, scheme) = match pace {
                    Pace::Equal(count, scheme) => {
                        let next = begin + (end - begin) * (done + 1) as f64 / count as f64;
                        (if done + 1 < count { next } else { end }, scheme)
                    }
                    Pace::Within(_) => {
                        let is_last = time + 1.000_001 * duration >= end;
                        (if is_last { end } else { time + duration }, Scheme::Sdirk2)
                    }
                };
                let increment = Increment {
                    from: (history.strain)(time),
                    to: (history.strain)(next),
                    duration: next - time,
                    temperature: (history.temperature)(0.5 * (time + next)),
                    pressure,
                    scheme,
                };
                let step = self.advance_stress(&state, &increment, &mut memory)?;
                if let Pace::Within(limit) = pace {
                    let growth = SAFETY * (limit / step.error.max(f64::MIN_POSITIVE)).sqrt();
                    let wanted = (next - time) * growth.clamp(CHANGE[0], CHANGE[1]);
                    if step.error > limit {
                        (duration, trace.rejected) = (wanted, trace.rejected + 1);
                        if wanted < 1e-12 * (end - begin) {
                            return Err(Error::NoConvergence {
                                iteration: "the control of the time step",
                                steps: trace.rejected,
                                residual: step.error,
                            });
                        }
                        continue;
                    }
                    // an interval that ends early says nothing against a longer step
                    duration =
                        if next == end && duration.is_finite() { duration.max(wanted) } else { wanted };
                }
                let stress = step.prediction.stress;
                let mean = 0.5 * (before.unwrap_or(stress) + stress);
                work += 0.5 * double_contraction(&mean, &(increment.to - increment.from));
                dissipated += step.dissipated;
                pressure = history.reaction.pressure(&increment.to, &stress);
                (before, state, time) = (Some(stress), step.state.clone(), next);
                (trace.steps, done) = (trace.steps + 1, done + 1);
                if time >= end {
                    break step;
                }
            };
            trace.points.push(TracePoint { time: end, step, dissipated, work });
        }
        Ok(trace)
    }
}

/// A:B of symmetric tensors in Voigt form without factors.
fn double_contraction(a: &Voigt, b: &Voigt) -> f64 {
    (0..6).map(|k| a[k] * b[k] * if k < 3 { 1.0 } else { 2.0 }).sum()
}

impl Reaction {
    /// Pressure −tr σ/3 at C and S, Pa.
    pub fn pressure(self, c: &Voigt, stress: &Voigt) -> f64 {
        let volume = voigt::to_stress(c).determinant().sqrt();
        let mean = double_contraction(stress, c) / (3.0 * volume);
        match self {
            Self::Law => -mean,
            Self::Test(_) => c[2] * stress[2] - mean,
        }
    }
}

/// C of a test of an incompressible body at a stretch.
pub fn strain_of_test(mode: Mode, stretch: f64) -> Voigt {
    let second = mode.second_stretch(stretch);
    let third = 1.0 / (stretch * second);
    Voigt::new(stretch * stretch, second * second, third * third, 0.0, 0.0, 0.0)
}

/// Nominal stress of such a test, Pa, from C and the part of S that the law determines: the free surface,
/// normal to axis 3, carries none.
pub fn nominal_of_test(c: &Voigt, stress: &Voigt) -> f64 {
    (c[0] * stress[0] - c[2] * stress[2]) / c[0].sqrt()
}
