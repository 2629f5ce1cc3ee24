//! Times of moves of a machine that cannot change its velocity at once.

use super::ToolPath;
use crate::error::Error;
use nalgebra::Vector3;

impl ToolPath {
    /// The same path with trapezoidal velocities: along each move the velocity changes by `acceleration` at most, m/s², and
    /// from move to move by `jerk` along each axis, m/s (as Marlin's classic jerk): passes back and forth over the moves give
    /// the velocity at each corner. Waits, and filament alone, keep their time and let velocity pass. Velocity is
    /// even along each move of the result.
    ///
    /// # Errors
    /// An acceleration or a jerk that is not positive.
    pub fn accelerated(mut self, acceleration: f64, jerk: f64) -> Result<Self, Error> {
        for (name, found) in [("acceleration", acceleration), ("jerk", jerk)] {
            if !(found > 0.0 && found.is_finite()) {
                return Err(Error::Parameter { name, found, allowed: "positive and finite".into() });
            }
        }
        let moves: Vec<(f64, f64, Vector3<f64>)> = (self.moves.iter())
            .map(|one| {
                let length = one.length();
                let along = Vector3::from(one.to) - Vector3::from(one.from);
                (length, length / (one.end - one.start), along / length)
            })
            .collect();
        // at the beginning of each move, and at the end of the last: rest at both ends
        let mut corner = vec![0.0; moves.len() + 1];
        for (k, pair) in (1..).zip(moves.windows(2)) {
            let [(_, before, from), (_, after, to)] = [pair[0], pair[1]];
            let jump = (to * after - from * before).amax();
            corner[k] = before.min(after) * if jump > jerk { jerk / jump } else { 1.0 };
        }
        let reach = |velocity: f64, length: f64| (velocity * velocity + 2.0 * acceleration * length).sqrt();
        for k in (0..moves.len()).rev() {
            corner[k] = corner[k].min(reach(corner[k + 1], moves[k].0));
        }
        for k in 0..moves.len() {
            corner[k + 1] = corner[k + 1].min(reach(corner[k], moves[k].0));
        }
        let (mut time, mut last) = (0.0, 0.0);
        let mut shift = Vec::with_capacity(moves.len());
        for ((k, one), (length, velocity, _)) in self.moves.iter_mut().enumerate().zip(moves) {
            let [a, b] = [corner[k], corner[k + 1]];
            let squares = a * a + b * b;
            let top = velocity.min((acceleration * length + 0.5 * squares).sqrt()).max(a).max(b);
            let even = (length - (2.0 * top * top - squares) / (2.0 * acceleration)).max(0.0);
            let start = time + (one.start - last);
            time = start + (2.0 * top - a - b) / acceleration + even / top;
            shift.push((one.end, time - one.end));
            last = one.end;
            (one.start, one.end) = (start, time);
        }
        for command in &mut self.commands {
            let before = shift.partition_point(|(end, _)| *end <= command.time);
            command.time += before.checked_sub(1).map_or(0.0, |k| shift[k].1);
        }
        Ok(self)
    }
}
