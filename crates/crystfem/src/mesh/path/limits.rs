//! Machine limits stated in a file (M201 to M205, M566, SET_VELOCITY_LIMIT, settings in comments), and ramps
//! of moves with them.

use super::line::{Words, keys};

const AXES: [char; 4] = ['X', 'Y', 'Z', 'E'];
/// Default jerks of Marlin, for files that state accelerations alone, m/s.
const JERK: [f64; 4] = [10e-3, 10e-3, 0.4e-3, 5e-3];
/// Default square corner velocity of Klipper, m/s.
const SQUARE_CORNER: f64 = 5e-3;
/// Largest plausible M203 in mm/s; larger values are per minute.
const MAX_MILLIMETRES_PER_SECOND: f64 = 2000.0;

/// Limits of a straight motion: length, m, velocity, m/s, acceleration, m/s², and entry velocity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ramp {
    pub length: f64,
    pub velocity: f64,
    pub acceleration: f64,
    pub enter: f64,
}

/// Machine limits in SI units, by axis X, Y, Z, E.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limits {
    acceleration: [f64; 4],
    velocity: [f64; 4],
    /// Accelerations of printing, travel and feed-only moves.
    by_kind: [f64; 3],
    jerk: [f64; 4],
    /// Junction deviation, m, which replaces jerk.
    deviation: Option<f64>,
    /// True once a command or comment has stated a limit.
    pub stated: bool,
    /// True if accelerations are limited.
    pub accelerates: bool,
}

impl Default for Limits {
    fn default() -> Self {
        let none = [f64::INFINITY; 4];
        Self {
            acceleration: none,
            velocity: none,
            by_kind: [f64::INFINITY; 3],
            jerk: JERK,
            deviation: None,
            stated: false,
            accelerates: false,
        }
    }
}

impl Limits {
    /// Applies M201, M203, M204, M205 or M566; `per_minute` for the units of RepRapFirmware.
    pub fn command(&mut self, code: &str, words: &Words, per_minute: bool) {
        let positive =
            |letter: char| words.value(letter).filter(|found| *found > 0.0).map(|found| 1e-3 * found);
        let minutes =
            |all: &[f64; 4]| per_minute || all.iter().any(|v| *v > 1e-3 * MAX_MILLIMETRES_PER_SECOND);
        let mut of_axes = AXES.map(|axis| positive(axis).unwrap_or(0.0));
        self.stated = true;
        match code {
            "M201" => set(&mut self.acceleration, of_axes),
            "M203" => {
                if minutes(&of_axes) {
                    of_axes = of_axes.map(|v| v / 60.0);
                }
                set(&mut self.velocity, of_axes);
            }
            "M204" => {
                if let Some(both) = positive('S') {
                    (self.by_kind[0], self.by_kind[1]) = (both, both);
                    self.by_kind[2] = positive('T').unwrap_or(self.by_kind[2]);
                } else {
                    for (kind, letter) in ['P', 'T', 'R'].into_iter().enumerate() {
                        self.by_kind[kind] = positive(letter).unwrap_or(self.by_kind[kind]);
                    }
                }
            }
            "M205" => {
                set(&mut self.jerk, of_axes);
                if of_axes[0] > 0.0 {
                    self.deviation = None;
                    // one value for both, in old firmwares
                    self.jerk[1] = if of_axes[1] > 0.0 { of_axes[1] } else { of_axes[0] };
                }
                self.deviation = positive('J').or(self.deviation);
            }
            // always in mm/min
            _ => set(&mut self.jerk, of_axes.map(|v| v / 60.0)),
        }
        self.update();
    }

    /// Applies Klipper's SET_VELOCITY_LIMIT.
    pub fn velocity_limit(&mut self, rest: &str) {
        if !self.accelerates && self.jerk == JERK {
            self.jerk = [SQUARE_CORNER, SQUARE_CORNER, SQUARE_CORNER, 1e-3];
        }
        for (key, value) in keys(rest) {
            let Some(value) = value.parse::<f64>().ok().filter(|v| *v > 0.0).map(|v| 1e-3 * v) else {
                continue;
            };
            match key.as_str() {
                "ACCEL" => self.by_kind = [value; 3],
                "VELOCITY" => (self.velocity[0], self.velocity[1]) = (value, value),
                "SQUARE_CORNER_VELOCITY" => self.jerk[..3].fill(value),
                _ => {}
            }
        }
        self.stated = true;
        self.update();
    }

    /// Applies a slicer's setting in a comment, such as `machine_max_jerk_x`.
    pub fn setting(&mut self, key: &str, found: f64) {
        let Some((what, of)) = key.trim_start_matches("machine_max_").rsplit_once('_') else { return };
        if found.is_nan() || found <= 0.0 {
            return;
        }
        let value = 1e-3 * found;
        let axis = AXES.iter().position(|axis| of.len() == 1 && of.starts_with(axis.to_ascii_lowercase()));
        match (what, axis, of) {
            ("acceleration", Some(axis), _) => self.acceleration[axis] = value,
            ("feedrate" | "speed", Some(axis), _) => self.velocity[axis] = value,
            ("jerk", Some(axis), _) => self.jerk[axis] = value,
            ("acceleration", None, "extruding") => self.by_kind[0] = value,
            ("acceleration", None, "travel") => self.by_kind[1] = value,
            ("acceleration", None, "retracting") => self.by_kind[2] = value,
            ("junction", None, "deviation") => self.deviation = Some(value),
            _ => return,
        }
        self.stated = true;
        self.update();
    }

    fn update(&mut self) {
        self.accelerates = self.acceleration[..2].iter().chain(&self.by_kind).any(|a| a.is_finite());
    }

    /// Describes the limits in a line.
    pub fn describe(&self) -> String {
        let list = |all: &[f64]| {
            let values =
                all.iter().map(|v| if v.is_finite() { format!("{:.6}", 1e3 * v) } else { "–".into() });
            let short = values.map(|v| match v.contains('.') {
                true => v.trim_end_matches('0').trim_end_matches('.').to_owned(),
                false => v,
            });
            short.collect::<Vec<_>>().join(", ")
        };
        let corner = match self.deviation {
            Some(deviation) => format!("junction deviation {} mm", list(&[deviation])),
            None => format!("jerk {} mm/s", list(&self.jerk)),
        };
        format!(
            "at the end {} mm/s² of printing, travel and filament, {} mm/s² of X, Y, Z, E, {corner}",
            list(&self.by_kind),
            list(&self.acceleration)
        )
    }

    /// Returns the ramp of a motion along `delta` (X, Y, Z, E, m) at F = `velocity`, m/s, and its direction;
    /// `None` if the length is 0.
    pub fn ramp(&self, delta: [f64; 4], velocity: f64) -> Option<(Ramp, [f64; 4])> {
        let across = delta[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
        let length = if across > 0.0 { across } else { delta[3].abs() };
        if length.is_nan() || length <= 0.0 {
            return None;
        }
        let along = delta.map(|x| x / length);
        let kind = if across == 0.0 {
            2
        } else if delta[3] > 0.0 {
            0
        } else {
            1
        };
        let (mut top, mut acceleration) = (velocity, self.by_kind[kind]);
        for axis in 0..4 {
            let share = along[axis].abs();
            if share > 0.0 {
                top = top.min(self.velocity[axis] / share);
                acceleration = acceleration.min(self.acceleration[axis] / share);
            }
        }
        Some((Ramp { length, velocity: top, acceleration, enter: 0.0 }, along))
    }

    /// Largest entry velocity of a motion from rest.
    fn safe(&self, ramp: &Ramp, along: [f64; 4]) -> f64 {
        let of = |axis: usize| match along[axis].abs() * ramp.velocity {
            v if v > self.jerk[axis] => ramp.velocity * self.jerk[axis] / v,
            _ => ramp.velocity,
        };
        (0..4).map(of).fold(ramp.velocity, f64::min)
    }

    /// Largest velocity from one motion to the next, by the jerks of the axes (a reversal counts once), or by
    /// junction deviation: v² = a δ sin(θ/2)/(1 − sin(θ/2)).
    pub fn corner(&self, before: Option<(&Ramp, [f64; 4])>, after: (&Ramp, [f64; 4])) -> f64 {
        let (next, to) = after;
        let Some((last, from)) = before else { return self.deviation.map_or(self.safe(next, to), |_| 0.0) };
        let even = last.velocity.min(next.velocity);
        if let Some(deviation) = self.deviation {
            let cosine: f64 = -(0..3).map(|axis| from[axis] * to[axis]).sum::<f64>();
            let sine = (0.5 * (1.0 - cosine.clamp(-1.0, 1.0))).sqrt();
            let square = next.acceleration.min(last.acceleration) * deviation * sine / (1.0 - sine);
            return if square.is_nan() { even } else { even.min(square.sqrt()) };
        }
        let mut factor = 1.0f64;
        for axis in 0..4 {
            let (exit, entry) = (from[axis] * even, to[axis] * even);
            let jump = if exit * entry < 0.0 { exit.abs().max(entry.abs()) } else { (exit - entry).abs() };
            if jump > self.jerk[axis] {
                factor = factor.min(self.jerk[axis] / jump);
            }
        }
        let corner = even * factor;
        let (first, second) = (self.safe(last, from), self.safe(next, to));
        // stopping and starting is as fast
        if first > 0.99 * corner && second > 0.99 * corner { second.min(even) } else { corner }
    }
}

/// Sets the values above 0.
fn set(all: &mut [f64; 4], found: [f64; 4]) {
    for (own, found) in all.iter_mut().zip(found) {
        if found > 0.0 {
            *own = found;
        }
    }
}
