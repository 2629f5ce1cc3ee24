//! Numbers of a page: quantised to 16 bits, as differences, deflated.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde::Serialize;

/// LevelRange of positions and displacements: a 16th of a pixel on a screen of a thousand.
pub const PLACES: u16 = 16_383;
/// LevelRange of fields: a quarter of a thousandth of the colour bar.
pub const VALUES: u16 = 4_095;
/// Stands for no value.
pub const NOTHING: u16 = u16::MAX;

/// Position of an array of `rows` × `count` numbers in a [`Store`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Slot {
    /// First byte.
    pub at: usize,
    /// Rows: steps.
    pub rows: usize,
    /// Numbers of a row.
    pub count: usize,
}

/// The range of quantised numbers: level k stands for `low + k · step`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LevelRange {
    /// The least number.
    pub low: f64,
    /// Distance of levels.
    pub step: f64,
}

impl LevelRange {
    /// Returns `count` + 1 levels over the finite numbers, if there are any.
    pub fn over(numbers: impl IntoIterator<Item = f64>, count: u16) -> Option<Self> {
        let finite = numbers.into_iter().filter(|number| number.is_finite());
        let [low, high] = polycore::numerics::range(finite);
        let step = high / f64::from(count) - low / f64::from(count);
        (low <= high).then_some(Self { low, step })
    }

    /// Returns the level next to a number; [`NOTHING`] for one that is not finite.
    pub fn level(&self, number: f64) -> u16 {
        match number.is_finite() {
            true if self.step > 0.0 => (number / self.step - self.low / self.step).round() as u16,
            true => 0,
            false => NOTHING,
        }
    }
}

/// All arrays of a page.
#[derive(Debug, Default)]
pub struct Store(Vec<u8>);

impl Store {
    /// Appends rows of equal length. Each row is kept as its difference from the one before, the first as
    /// differences of neighbours, in zigzag order, low bytes before high bytes: what changes little deflates
    /// well.
    pub fn push(&mut self, rows: &[Vec<u16>]) -> Slot {
        let (at, count) = (self.0.len(), rows.first().map_or(0, Vec::len));
        for (index, row) in rows.iter().enumerate() {
            let before = |k: usize| match (index.checked_sub(1), k.checked_sub(1)) {
                (Some(index), _) => rows[index][k],
                (None, Some(k)) => row[k],
                (None, None) => 0,
            };
            let changes = (0..count).map(|k| zigzag(row[k].wrapping_sub(before(k))));
            let [low, high]: [Vec<u8>; 2] =
                [0, 1].map(|byte| changes.clone().map(|change| change.to_le_bytes()[byte]).collect());
            self.0.extend(low);
            self.0.extend(high);
        }
        Slot { at, rows: rows.len(), count }
    }

    /// Returns the store as text: gzip in base 64.
    pub fn text(&self) -> String {
        zipped(&self.0)
    }
}

/// Bytes as text: gzip in base 64.
pub fn zipped(bytes: &[u8]) -> String {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::new(6));
    // into memory: cannot fail
    let packed = encoder.write_all(bytes).and_then(|()| encoder.finish()).unwrap_or_default();
    STANDARD.encode(packed)
}

/// 0, −1, 1, −2, … as 0, 1, 2, 3, …
fn zigzag(change: u16) -> u16 {
    let signed = change as i16;
    ((signed << 1) ^ (signed >> 15)) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unpacks an array as the page does.
    fn unpacked(bytes: &[u8], slot: Slot) -> Vec<Vec<u16>> {
        let mut rows: Vec<Vec<u16>> = Vec::new();
        for index in 0..slot.rows {
            let from = slot.at + 2 * slot.count * index;
            let mut row = Vec::new();
            for k in 0..slot.count {
                let change = u16::from_le_bytes([bytes[from + k], bytes[from + slot.count + k]]);
                let signed = (change >> 1) ^ (change & 1).wrapping_neg();
                let before = match (index, k) {
                    (0, 0) => 0,
                    (0, _) => row[k - 1],
                    _ => rows[index - 1][k],
                };
                row.push(signed.wrapping_add(before));
            }
            rows.push(row);
        }
        rows
    }

    #[test]
    fn numbers_come_back() {
        let rows = [vec![0, 65_535, 7, 32_768], vec![1, 0, 65_535, 32_767], vec![NOTHING; 4]];
        let mut store = Store::default();
        store.push(&[vec![5; 3]]);
        let slot = store.push(&rows);
        assert_eq!((slot, store.0.len()), (Slot { at: 6, rows: 3, count: 4 }, 30));
        assert_eq!(unpacked(&store.0, slot), rows);
        assert!(store.text().starts_with("H4sI"), "a gzip header");
    }

    #[test]
    fn levels_cover_the_finite_numbers() {
        let numbers = [f64::NAN, -1.5, 3.0, f64::INFINITY, 0.1];
        let levels = LevelRange::over(numbers, VALUES).unwrap();
        assert_eq!((levels.level(-1.5), levels.level(3.0), levels.level(f64::NAN)), (0, VALUES, NOTHING));
        let back = levels.low + f64::from(levels.level(0.1)) * levels.step;
        assert!((back - 0.1).abs() <= 0.5 * levels.step, "{back}");
        let constant = LevelRange::over([2.0, 2.0], VALUES).unwrap();
        assert_eq!((constant.low, constant.step, constant.level(2.0)), (2.0, 0.0, 0));
        assert_eq!(LevelRange::over([f64::NAN], VALUES), None);
        // the difference of the ends is not finite
        let wide = LevelRange::over([-1e308, 1e308], VALUES).unwrap();
        assert!(wide.step.is_finite() && wide.level(1e308) == VALUES);
    }
}
