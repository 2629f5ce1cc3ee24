//! Deformed cells of a lattice of particles: neighbours, cracks between them, and the corners of each cell.

use std::collections::HashMap;

use rayon::prelude::*;

/// No neighbour.
pub const NONE: u32 = u32::MAX;
/// Neighbours at both ends of each axis: side 2d lies before a particle along axis d, side 2d + 1 behind it.
pub type Sides = [u32; 6];

/// Two neighbours that have moved apart this many times farther than both have from the next ones behind them
/// have a crack between them.
const JUMP: f64 = 2.0;
/// Distance of a particle from its place in the lattice, in spacings, at most.
const OFF: f64 = 0.05;

/// Returns the neighbours of each particle that lies on the lattice of the first one.
pub fn neighbours<const D: usize>(reference: &[[f64; D]], spacing: f64) -> Vec<Sides> {
    let Some(origin) = reference.first() else { return Vec::new() };
    let place = |x: &[f64; D]| -> Option<[i64; D]> {
        let steps: [f64; D] = std::array::from_fn(|d| (x[d] - origin[d]) / spacing);
        let near = steps.iter().all(|x| (x - x.round()).abs() < OFF);
        near.then(|| steps.map(|x| x.round() as i64))
    };
    let mut index: HashMap<[i64; D], u32> = HashMap::with_capacity(reference.len());
    for (k, x) in reference.iter().enumerate() {
        if let Some(place) = place(x) {
            index.entry(place).or_insert(k as u32);
        }
    }
    let of = |(k, x): (usize, &[f64; D])| {
        let own = place(x).filter(|place| index.get(place) == Some(&(k as u32)));
        std::array::from_fn(|side| {
            let Some(mut there) = own.filter(|_| side < 2 * D) else { return NONE };
            there[side / 2] = there[side / 2].saturating_add(if side % 2 == 1 { 1 } else { -1 });
            index.get(&there).copied().unwrap_or(NONE)
        })
    };
    reference.par_iter().enumerate().map(of).collect()
}

/// Returns the neighbours without a crack in between; those farther apart than `bridge` spacings have one.
pub fn joined<const D: usize>(
    positions: &[[f64; D]],
    next: &[Sides],
    spacing: f64,
    bridge: f64,
) -> Vec<Sides> {
    let farthest = spacing * bridge.max(1.0) * (1.0 + 1e-9);
    let gap = |a: u32, b: u32| {
        let [a, b] = [a, b].map(|k| positions[k as usize]);
        (0..D).map(|d| (b[d] - a[d]).powi(2)).sum::<f64>().sqrt()
    };
    let beside = |particle: u32, side: usize| Some(next[particle as usize][side]).filter(|&k| k != NONE);
    let behind = |particle, side| {
        beside(particle, side).map(|next| gap(particle, next)).filter(|&gap| gap <= farthest)
    };
    let unbroken = |particle, side| {
        let other = beside(particle, side)?;
        let most = match (behind(particle, side ^ 1), behind(other, side)) {
            (None, None) => farthest,
            (a, b) => (JUMP * a.unwrap_or(0.0).max(b.unwrap_or(0.0)).max(spacing)).min(farthest),
        };
        (gap(particle, other) <= most).then_some(other)
    };
    let of = |particle| std::array::from_fn(|side| unbroken(particle, side).unwrap_or(NONE));
    (0..next.len() as u32).into_par_iter().map(of).collect()
}

/// LatticeCells around the particles of a lattice along its first `axes` axes.
pub struct LatticeCells<'a, const D: usize> {
    /// Positions.
    pub positions: &'a [[f64; D]],
    /// Pairs of neighbours from [`joined`].
    pub joined: &'a [Sides],
    /// Distance of neighbours.
    pub spacing: f64,
    /// Dimensions of a cell.
    pub axes: usize,
}

impl<const D: usize> LatticeCells<'_, D> {
    fn beside(&self, particle: usize, side: usize) -> Option<usize> {
        Some(self.joined[particle][side] as usize).filter(|&other| other != NONE as usize)
    }

    /// Vector from a particle to the middle of a side of its cell.
    fn half(&self, particle: usize, side: usize) -> [f64; D] {
        for (side, sign) in [(side, 0.5), (side ^ 1, -0.5)] {
            if let Some(other) = self.beside(particle, side) {
                let (from, to) = (self.positions[particle], self.positions[other]);
                return std::array::from_fn(|d| sign * (to[d] - from[d]));
            }
        }
        let mut half = [0.0; D];
        half[side / 2] = if side % 2 == 1 { 0.5 } else { -0.5 } * self.spacing;
        half
    }

    /// Returns a corner of a cell, the mean over the connected cells around it, so that they share the
    /// corner: bit d of `corner` is its end along axis d.
    pub fn corner(&self, particle: usize, corner: u8) -> [f64; D] {
        // bit d of a place: the other side of the corner along axis d
        let side = |place: usize, d: usize| 2 * d + (usize::from(corner) ^ place) / (1 << d) % 2;
        let mut members = [(usize::MAX, 0); 8];
        members[0] = (particle, 0);
        let (mut open, mut waiting) = ([0; 8], 1);
        while waiting > 0 {
            waiting -= 1;
            let place: usize = open[waiting];
            for d in 0..self.axes {
                let there = place ^ (1 << d);
                if members[there].0 == usize::MAX
                    && let Some(other) = self.beside(members[place].0, side(place, d))
                {
                    members[there] = (other, there);
                    (open[waiting], waiting) = (there, waiting + 1);
                }
            }
        }
        // one order for all cells of the corner: the same bits
        members.sort_unstable();
        let (mut sum, mut count) = ([0.0; D], 0.0);
        for &(member, place) in members.iter().take_while(|(member, _)| *member != usize::MAX) {
            let mut halves = [0.0; D];
            for axis in 0..self.axes {
                let half = self.half(member, side(place, axis));
                (0..D).for_each(|d| halves[d] += half[d]);
            }
            (0..D).for_each(|d| sum[d] += self.positions[member][d] + halves[d]);
            count += 1.0;
        }
        sum.map(|x| x / count)
    }
}
