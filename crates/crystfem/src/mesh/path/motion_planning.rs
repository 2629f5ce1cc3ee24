//! Motion planning of a machine with limited acceleration.

use super::limits::{Limits, Ramp};
use super::{MachineMotion, ToolPath};
use crate::error::Error;
use nalgebra::Vector3;

/// Durations of consecutive motions, s, by trapezoids of velocity from rest: backward and forward passes give
/// the velocity at each corner. `exit` is the final velocity.
fn durations(ramps: &[Ramp], exit: f64) -> Vec<f64> {
    let mut corner: Vec<f64> = ramps.iter().map(|ramp| ramp.enter).collect();
    corner.push(exit);
    let reach =
        |velocity: f64, ramp: &Ramp| (velocity * velocity + 2.0 * ramp.acceleration * ramp.length).sqrt();
    for (k, ramp) in ramps.iter().enumerate().rev() {
        corner[k] = corner[k].min(reach(corner[k + 1], ramp));
    }
    for (k, ramp) in ramps.iter().enumerate() {
        corner[k + 1] = corner[k + 1].min(reach(corner[k], ramp));
    }
    let time = |(ramp, ends): (&Ramp, &[f64])| {
        let (length, acceleration) = (ramp.length, ramp.acceleration);
        let [a, b] = [ends[0], ends[1]];
        let squares = a * a + b * b;
        let top = ramp.velocity.min((acceleration * length + 0.5 * squares).sqrt()).max(a).max(b);
        let even = (length - (2.0 * top * top - squares) / (2.0 * acceleration)).max(0.0);
        let time = (2.0 * top - a - b) / acceleration + even / top;
        if time.is_finite() { time } else { 0.0 }
    };
    ramps.iter().zip(corner.windows(2)).map(time).collect()
}

impl ToolPath {
    /// Applies trapezoidal velocities: along each move the velocity changes by at most `acceleration`, m/s²,
    /// and from move to move by at most `jerk` along each axis, m/s (as Marlin's classic jerk). Dwells and
    /// feed-only motions keep their duration and do not interrupt the velocity. The result has constant
    /// velocity along each move.
    ///
    /// # Errors
    /// [`Error::Parameter`] for an acceleration or a jerk that is not positive.
    pub fn with_acceleration(mut self, acceleration: f64, jerk: f64) -> Result<Self, Error> {
        for (name, found) in [("acceleration", acceleration), ("jerk", jerk)] {
            if !(found > 0.0 && found.is_finite()) {
                return Err(Error::Parameter { name, found, allowed: "positive and finite".into() });
            }
        }
        let mut last: Option<(f64, Vector3<f64>)> = None;
        let mut ramps = Vec::with_capacity(self.moves.len());
        for one in &self.moves {
            let length = one.length();
            let velocity = length / (one.end - one.start);
            let along = (Vector3::from(one.to) - Vector3::from(one.from)) / length;
            let enter = last.map_or(0.0, |(before, from)| {
                let jump = (along * velocity - from * before).amax();
                before.min(velocity) * if jump > jerk { jerk / jump } else { 1.0 }
            });
            last = Some((velocity, along));
            ramps.push(Ramp { length, velocity, acceleration, enter });
        }
        let mut moved = Vec::with_capacity(ramps.len());
        for (one, took) in self.moves.iter().zip(durations(&ramps, 0.0)) {
            moved.push([one.start, one.end, took]);
        }
        self.retime(&moved);
        Ok(self)
    }

    /// Applies the limits stated in the file at each time, for feed-only motions too: velocity, acceleration
    /// and jerk of each axis, or junction deviation. Dwells are stops.
    pub fn with_stated_limits(mut self) -> Self {
        let mut last: Option<(Ramp, [f64; 4])> = None;
        let (mut ramps, mut kept): (Vec<Ramp>, Vec<usize>) = Default::default();
        for (k, motion) in self.motions.iter().enumerate() {
            let limits: &Limits = &self.limits[motion.limits as usize];
            let velocity = motion.length() / (motion.end - motion.start);
            let Some((mut ramp, along)) = limits.ramp(motion.delta, velocity) else { continue };
            let before = last.filter(|_| !motion.stop);
            ramp.enter = limits.corner(before.as_ref().map(|(ramp, from)| (ramp, *from)), (&ramp, along));
            last = Some((ramp, along));
            ramps.push(ramp);
            kept.push(k);
        }
        let took = durations(&ramps, 0.0);
        let moved: Vec<[f64; 3]> = (kept.iter().zip(took))
            .map(|(&k, took)| [self.motions[k].start, self.motions[k].end, took])
            .collect();
        self.retime(&moved);
        self
    }

    /// Describes the limits stated in the file in a line; `None` without limits of motion.
    pub fn describe_limits(&self) -> Option<String> {
        let acts = |motion: &MachineMotion| self.limits[motion.limits as usize].stated;
        let last = self.motions.iter().rfind(|motion| acts(motion))?;
        Some(self.limits[last.limits as usize].describe())
    }

    /// Assigns new durations to motions, given by start and end, s; everything else keeps its own.
    fn retime(&mut self, moved: &[[f64; 3]]) {
        // delay of everything from the end of a motion on
        let mut shift = Vec::with_capacity(moved.len());
        let mut late = 0.0;
        for [start, end, took] in moved {
            late += took - (end - start);
            shift.push((*start, *end, late));
        }
        let later = |time: f64| {
            let after = shift.partition_point(|(_, end, _)| *end <= time);
            let before = after.checked_sub(1).map_or(0.0, |k| shift[k].2);
            match shift.get(after) {
                // within a motion, in proportion
                Some((start, end, late)) if *start < time => {
                    time + before + (late - before) * (time - start) / (end - start)
                }
                _ => time + before,
            }
        };
        let whole = self.duration();
        for one in &mut self.moves {
            (one.start, one.end) = (later(one.start), later(one.end));
        }
        for command in &mut self.commands {
            command.time = later(command.time);
        }
        for motion in &mut self.motions {
            (motion.start, motion.end) = (later(motion.start), later(motion.end));
        }
        self.rest = later(whole) - self.moves.last().map_or(0.0, |last| last.end);
    }
}
