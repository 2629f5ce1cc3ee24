//! Position of a part instance.

use nalgebra::{Rotation3, Unit, Vector3};

use super::cards::{Cards, DataLine};
use crate::error::Error;

/// Position of an instance: a translation, then a rotation about a line (Abaqus Keywords Guide, `*INSTANCE`).
#[derive(Debug)]
pub(super) struct InstancePosition {
    shift: Vector3<f64>,
    /// A point of the line, and the rotation about it.
    turn: Option<(Vector3<f64>, Rotation3<f64>)>,
}

impl InstancePosition {
    /// Reads data lines: x, y, z; then two points of the line and an angle in degrees. `None` without any.
    pub fn read(cards: &mut Cards) -> Result<Option<Self>, Error> {
        let numbers = |row: &DataLine, allowed: &str, count: usize| -> Result<Vec<f64>, Error> {
            let words = row.words();
            if words.len() > count {
                return Err(row.error("place of an instance", row.text(), allowed));
            }
            let mut numbers =
                words.iter().map(|word| row.number(word, "place")).collect::<Result<Vec<_>, _>>()?;
            numbers.resize(count, 0.0);
            Ok(numbers)
        };
        let Some(row) = cards.row() else { return Ok(None) };
        let shift = Vector3::from_row_slice(&numbers(&row, "x, y, z", 3)?);
        let Some(row) = cards.row() else { return Ok(Some(Self { shift, turn: None })) };
        let allowed = "two different points and an angle in degrees: x, y, z, x, y, z, angle";
        let line = numbers(&row, allowed, 7)?;
        let [a, b] = [Vector3::from_row_slice(&line[..3]), Vector3::from_row_slice(&line[3..6])];
        let Some(axis) = Unit::try_new(b - a, 0.0) else {
            return Err(row.error("place of an instance", row.text(), allowed));
        };
        Ok(Some(Self { shift, turn: Some((a, Rotation3::from_axis_angle(&axis, line[6].to_radians()))) }))
    }

    /// Transforms a point of the part.
    pub fn transform(&self, point: [f64; 3]) -> [f64; 3] {
        let moved = Vector3::from(point) + self.shift;
        self.turn.as_ref().map_or(moved, |(at, turn)| at + turn * (moved - at)).into()
    }
}
