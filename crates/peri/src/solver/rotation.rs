//! Rotations about an axis, and rotating regions.

use crate::amplitude::Amplitude;
use crate::field::Field;
use crate::geometry::length;

/// A rotation about an axis, of the whole angle at load factor 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation<const D: usize> {
    /// A point of the axis, m.
    pub centre: [f64; D],
    /// Unit vector of the axis; (0, 0, 1) in the plane.
    pub axis: [f64; 3],
    /// Angle at load factor 1, rad.
    pub angle: f64,
}

impl<const D: usize> Rotation<D> {
    /// Part of a vector across the axis, and n × this part.
    fn across(&self, from: [f64; D]) -> [[f64; D]; 2] {
        let n = self.axis;
        let r: [f64; 3] = std::array::from_fn(|d| from.get(d).copied().unwrap_or(0.0));
        let along: f64 = (0..3).map(|d| n[d] * r[d]).sum();
        let cross = |d: usize| n[(d + 1) % 3] * r[(d + 2) % 3] - n[(d + 2) % 3] * r[(d + 1) % 3];
        [std::array::from_fn(|d| r[d] - along * n[d]), std::array::from_fn(cross)]
    }

    /// (R(φ) − 1) r of a vector from the axis: sin φ n × r − 2 sin²(φ/2) r_⊥ (Rodrigues).
    pub fn turn(&self, angle: f64, from: [f64; D]) -> [f64; D] {
        let [across, cross] = self.across(from);
        let (sine, half) = (angle.sin(), (0.5 * angle).sin());
        std::array::from_fn(|d| sine * cross[d] - 2.0 * half * half * across[d])
    }

    /// Displacement of a position X at a load factor, m.
    pub fn displacement(&self, place: [f64; D], factor: f64) -> [f64; D] {
        self.turn(factor * self.angle, self.from(place))
    }

    /// Rate of the displacement over the load factor, m: θ n × R(X − c).
    pub(super) fn rate(&self, place: [f64; D], factor: f64) -> [f64; D] {
        let (from, moved) = (self.from(place), self.displacement(place, factor));
        let [_, cross] = self.across(std::array::from_fn(|d| from[d] + moved[d]));
        cross.map(|x| self.angle * x)
    }

    /// Distance of a position from the axis, m.
    pub(super) fn radius(&self, place: [f64; D]) -> f64 {
        length(self.across(self.from(place))[0])
    }

    fn from(&self, place: [f64; D]) -> [f64; D] {
        std::array::from_fn(|d| place[d] - self.centre[d])
    }
}

/// A rotating region.
#[derive(Clone, Debug)]
pub struct RotatingRegion<const D: usize> {
    /// Rotation of the region.
    pub rotation: Rotation<D>,
    /// Additional displacement at load factor 1, m.
    pub shift: [f64; D],
    /// Amplitudes of the angle and of each component of `shift`; absent: the load factor.
    pub amplitudes: Option<(Amplitude, [Amplitude; D])>,
    /// Bit d: component d is prescribed.
    pub components: u8,
    /// Index of the region among [`Loads::held_regions`](super::Loads::held_regions).
    pub region: usize,
    /// Sites of the region that no later region holds.
    pub sites: Vec<u32>,
}

impl<const D: usize> RotatingRegion<D> {
    pub(super) fn set(&self, field: &mut Field<D>, site: u32, value: [f64; D]) {
        let old = field.get(site as usize);
        let prescribed = |d: usize| self.components >> d & 1 == 1;
        field.set(site as usize, std::array::from_fn(|d| if prescribed(d) { value[d] } else { old[d] }));
    }

    /// Multiples of the angle and of each component of the shift at a load factor.
    pub(super) fn multiples(&self, factor: f64) -> (f64, [f64; D]) {
        match &self.amplitudes {
            Some((angle, shift)) => {
                (angle.multiple(factor), shift.each_ref().map(|amplitude| amplitude.multiple(factor)))
            }
            None => (factor, [factor; D]),
        }
    }

    pub(super) fn displacement(&self, place: [f64; D], factor: f64) -> [f64; D] {
        let (angle, shift) = self.multiples(factor);
        let turned = self.rotation.displacement(place, angle);
        std::array::from_fn(|d| turned[d] + shift[d] * self.shift[d])
    }

    /// Rate of the displacement over the load factor, m.
    pub(super) fn rate(&self, place: [f64; D], factor: f64) -> [f64; D] {
        let rate = self.rotation.rate(place, self.multiples(factor).0);
        match &self.amplitudes {
            Some((angle, shift)) => {
                std::array::from_fn(|d| angle.rate(factor) * rate[d] + shift[d].rate(factor) * self.shift[d])
            }
            None => std::array::from_fn(|d| rate[d] + self.shift[d]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (R − 1) r about z and about a diagonal, which R(120°) permutes; its rate by differences.
    #[test]
    fn turns() {
        let quarter =
            Rotation { centre: [1.0, 0.0], axis: [0.0, 0.0, 1.0], angle: std::f64::consts::FRAC_PI_2 };
        let [x, y] = quarter.displacement([2.0, 0.0], 1.0);
        assert!((x + 1.0).abs() < 1e-15 && (y - 1.0).abs() < 1e-15);
        let axis = [1.0 / 3.0_f64.sqrt(); 3];
        let third = Rotation { centre: [0.0; 3], axis, angle: 2.0 * std::f64::consts::FRAC_PI_3 };
        let moved = third.displacement([1.0, 2.0, 4.0], 1.0);
        let expected = [4.0 - 1.0, 1.0 - 2.0, 2.0 - 4.0];
        assert!((0..3).all(|d| (moved[d] - expected[d]).abs() < 1e-14), "{moved:?}");
        let (place, h) = ([1.0, 2.0, 4.0], 1e-6);
        let [low, high] = [0.4 - h, 0.4 + h].map(|factor| third.displacement(place, factor));
        let rate = third.rate(place, 0.4);
        // central differences: h² and rounding over h
        assert!((0..3).all(|d| (rate[d] - (high[d] - low[d]) / (2.0 * h)).abs() < 1e-8));
    }
}
