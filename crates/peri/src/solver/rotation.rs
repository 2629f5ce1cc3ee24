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
    pub(super) fn across(&self, from: [f64; D]) -> [[f64; D]; 2] {
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
        self.turn(factor * self.angle, self.offset(place))
    }

    /// Distance of a position from the axis, m.
    pub(super) fn radius(&self, place: [f64; D]) -> f64 {
        length(self.across(self.offset(place))[0])
    }

    /// Vector from the centre to a position, m.
    pub(super) fn offset(&self, place: [f64; D]) -> [f64; D] {
        std::array::from_fn(|d| place[d] - self.centre[d])
    }

    /// n × R(φ) r of a vector from the axis: the arm of its moment.
    pub(super) fn arm(&self, angle: f64, from: [f64; D]) -> [f64; D] {
        let turned = self.turn(angle, from);
        self.across(std::array::from_fn(|d| from[d] + turned[d]))[1]
    }

    /// Component along the axis, if the axis is one of the coordinate axes.
    pub(super) fn along(&self) -> Option<usize> {
        (0..D).find(|&d| (0..3).all(|other| other == d || self.axis[other].abs() <= 1e-9))
    }
}

/// A rotating region: x = c + s + R(θ)(X − c + w), with the shift s and, in later steps, the warp w.
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
    /// Bit d: component d of the shift, and of the warp, keeps its value at the start of a step.
    pub kept: u8,
    /// Index of the region among [`Loads::held_regions`](super::Loads::held_regions).
    pub region: usize,
    /// Sites of the region that no later region holds.
    pub sites: Vec<u32>,
    /// Place at the start of a later step; absent: the undeformed one.
    pub start: Option<TurnStart<D>>,
}

/// Place of a rotating region at the start of a step.
#[derive(Clone, Debug)]
pub struct TurnStart<const D: usize> {
    /// Angle, rad.
    pub(super) angle: f64,
    /// Shift, m.
    pub(super) shift: [f64; D],
    /// Warp of each site: its place against that of a rigid region, turned back, m. Empty: none.
    pub(super) warp: Vec<[f64; D]>,
    /// Multiple of the warp, by component: 1, or falling to 0 in the step.
    pub(super) fading: [Amplitude; D],
}

impl<const D: usize> RotatingRegion<D> {
    pub(super) fn set(&self, field: &mut Field<D>, site: u32, value: [f64; D]) {
        let old = field.get(site as usize);
        field.set(site as usize, std::array::from_fn(|d| if self.prescribes(d) { value[d] } else { old[d] }));
    }

    pub(super) fn prescribes(&self, d: usize) -> bool {
        self.components >> d & 1 == 1
    }

    /// Multiples of the angle and of each component of the shift, by a function of an amplitude; `factor`
    /// without amplitudes.
    fn multiples(&self, factor: f64, of: impl Fn(&Amplitude) -> f64) -> (f64, [f64; D]) {
        match &self.amplitudes {
            Some((angle, shift)) => (of(angle), shift.each_ref().map(of)),
            None => (factor, [factor; D]),
        }
    }

    /// Angle, rad, and shift, m, that a multiple of 1 adds to those at the start.
    fn ways(&self) -> (f64, [f64; D]) {
        let Some(start) = &self.start else { return (self.rotation.angle, self.shift) };
        let kept = |d: usize| self.kept >> d & 1 == 1;
        let way = |d: usize| if kept(d) { 0.0 } else { self.shift[d] - start.shift[d] };
        (self.rotation.angle - start.angle, std::array::from_fn(way))
    }

    /// Angle, rad, and shift, m, at a load factor.
    pub(super) fn turn_at(&self, factor: f64) -> (f64, [f64; D]) {
        let (angle, shift) = self.multiples(factor, |amplitude| amplitude.multiple(factor));
        let (whole, ways) = self.ways();
        let (first, begin) = self.start.as_ref().map_or((0.0, [0.0; D]), |start| (start.angle, start.shift));
        (first + angle * whole, std::array::from_fn(|d| begin[d] + shift[d] * ways[d]))
    }

    /// Warp of the site of a number, m, times a function of the amplitude of each component.
    fn warp(&self, number: usize, of: impl Fn(&Amplitude) -> f64) -> [f64; D] {
        let Some(start) = &self.start else { return [0.0; D] };
        let Some(warp) = start.warp.get(number) else { return [0.0; D] };
        std::array::from_fn(|d| of(&start.fading[d]) * warp[d])
    }

    /// Displacement at a load factor of the site of a number, with the position `place`, m.
    pub(super) fn displacement(&self, number: usize, place: [f64; D], factor: f64) -> [f64; D] {
        let (angle, shift) = self.turn_at(factor);
        let warp = self.warp(number, |fading| fading.multiple(factor));
        let from = self.rotation.offset(place);
        let turned = self.rotation.turn(angle, std::array::from_fn(|d| from[d] + warp[d]));
        std::array::from_fn(|d| turned[d] + shift[d] + warp[d])
    }

    /// Arm n × R(θ)(X − c + w), m, of the moment of the site of a number at a load factor.
    pub(super) fn arm(&self, number: usize, place: [f64; D], factor: f64) -> [f64; D] {
        let warp = self.warp(number, |fading| fading.multiple(factor));
        let from = self.rotation.offset(place);
        self.rotation.arm(self.turn_at(factor).0, std::array::from_fn(|d| from[d] + warp[d]))
    }

    /// Rate over the load factor of the displacement, m, along the arc at `at`: of angle, shift and warp the
    /// mean rate between two factors, or the rate at one.
    pub(super) fn rate(
        &self,
        number: usize,
        place: [f64; D],
        [before, after]: [f64; 2],
        at: f64,
    ) -> [f64; D] {
        let of = |amplitude: &Amplitude| amplitude.secant(before, after);
        self.moved(number, place, at, of, self.warp(number, of))
    }

    /// Largest displacement in the step, along the arc at its start, m.
    pub(super) fn peak(&self, number: usize, place: [f64; D]) -> [f64; D] {
        let fades = self.warp(number, |fading| fading.multiple(1.0) - fading.multiple(0.0));
        self.moved(number, place, 0.0, Amplitude::largest, fades)
    }

    fn moved(
        &self,
        number: usize,
        place: [f64; D],
        at: f64,
        of: impl Fn(&Amplitude) -> f64,
        fades: [f64; D],
    ) -> [f64; D] {
        let (angle, shift) = self.multiples(1.0, of);
        let (whole, ways) = self.ways();
        let arm = self.arm(number, place, at);
        let fading = self.rotation.turn(self.turn_at(at).0, fades);
        let rate = angle * whole;
        std::array::from_fn(|d| rate * arm[d] + shift[d] * ways[d] + fades[d] + fading[d])
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
        let region = RotatingRegion {
            rotation: third,
            shift: [0.0; 3],
            amplitudes: None,
            components: 7,
            kept: 0,
            region: 0,
            sites: vec![0],
            start: None,
        };
        let rate = region.rate(0, place, [0.4; 2], 0.4);
        // central differences: h² and rounding over h
        assert!((0..3).all(|d| (rate[d] - (high[d] - low[d]) / (2.0 * h)).abs() < 1e-8));
    }
}
