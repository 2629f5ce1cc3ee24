//! Particles as cells: deformed cells of a lattice that come apart at cracks, or a block for each particle of
//! a cloud.

use polycore::numerics::DisjointSets;
use rayon::prelude::*;

use super::solid::{HEXAHEDRON, PageSolid, QUADRILATERAL};
use crate::output::lattice::{LatticeCells, NONE, Sides, joined, neighbours};

/// Particles of a lattice that are drawn at most, and of a cloud, whose blocks share no corners.
const MOST: [usize; 2] = [30_000, 8_000];
/// Cells of a plane lattice at most: a cell is one face.
const MOST_IN_PLANE: usize = 80_000;
/// Largest distance of a particle from its place in the lattice, in spacings.
const OFF: f64 = 0.05;
/// Part of the particles with a neighbour along each axis that makes a lattice.
const LATTICE: f64 = 0.9;
/// Layers of a body that stay where particles are left out.
const LAYERS: i64 = 4;
/// Particles of a cloud whose nearest neighbours tell its spacing.
const ASKED: usize = 100;

/// Particles of a body that are drawn, and their sizes.
#[derive(Debug)]
pub struct ParticleChoice {
    /// Numbers of the particles.
    pub kept: Vec<u32>,
    /// Sides of a cell, m.
    pub sides: [f64; 3],
    /// A body in a plane.
    pub plane: bool,
    lattice: bool,
}

impl ParticleChoice {
    /// The particles that are drawn: all, or every k-th along each axis of a large body; `coarser` drops
    /// more.
    pub fn from_positions(reference: &[[f64; 3]], coarser: usize) -> Self {
        let extent = [0, 1, 2].map(|d| polycore::numerics::range(reference.iter().map(|x| x[d])));
        let longest = extent.iter().map(|[low, high]| high - low).fold(f64::MIN_POSITIVE, f64::max);
        let flat = extent.map(|[low, high]| high - low <= 1e-9 * longest);
        let plane = flat[2];
        let spacing = [0, 1, 2].map(|d| if flat[d] { f64::NAN } else { gap(reference, d, 1e-5 * longest) });
        let some = spacing.into_iter().find(|x| x.is_finite()).unwrap_or(longest);
        let spacing = spacing.map(|x| if x.is_finite() { x } else { some });
        let place = |x: &[f64; 3]| [0, 1, 2].map(|d| (x[d] - extent[d][0]) / spacing[d]);
        let on = |place: &[f64; 3]| place.iter().all(|x| (x - x.round()).abs() < OFF);
        let index = |x: &[f64; 3]| place(x).map(|x| x.round() as i64);
        let taken: std::collections::HashSet<[i64; 3]> =
            reference.iter().filter(|x| on(&place(x))).map(index).collect();
        let beside = |at: &[i64; 3], d: usize| {
            let step = |by: i64| [0, 1, 2].map(|e| at[e] + if e == d { by } else { 0 });
            taken.contains(&step(1)) || taken.contains(&step(-1))
        };
        let neighboured = taken.iter().filter(|at| (0..3).all(|d| flat[d] || beside(at, d))).count();
        if (neighboured as f64) < LATTICE * reference.len() as f64 {
            return Self::cloud(reference, plane, coarser);
        }
        let layers = [0, 1, 2].map(|d| ((extent[d][1] - extent[d][0]) / spacing[d]).round() as i64 + 1);
        let mut step = coarser.max(1) as i64;
        loop {
            let steps = layers.map(|layers| step.min(layers / LAYERS).max(1));
            let keep = |x: &[f64; 3]| {
                let at = index(x);
                // a particle off the lattice is drawn by itself
                !on(&place(x)) || (0..3).all(|d| at[d] % steps[d] == steps[d] / 2 % layers[d])
            };
            let kept: Vec<u32> =
                (0..reference.len() as u32).filter(|&k| keep(&reference[k as usize])).collect();
            let coarsest = (0..3).all(|d| steps[d] >= layers[d] / LAYERS);
            let most = if plane { MOST_IN_PLANE } else { MOST[0] };
            if kept.len() <= most / coarser.max(1) || coarsest {
                let sides = [0, 1, 2].map(|d| spacing[d] * steps[d] as f64);
                return Self { kept, sides, plane, lattice: true };
            }
            step += 1;
        }
    }

    fn cloud(reference: &[[f64; 3]], plane: bool, coarser: usize) -> Self {
        let every = reference.len().div_ceil(MOST[1] / coarser.max(1).min(MOST[1])).max(1);
        let kept: Vec<u32> = (0..reference.len() as u32).step_by(every).collect();
        let dimensions = if plane { 2.0 } else { 3.0 };
        let side = nearest(reference) * (every as f64).powf(1.0 / dimensions);
        Self { kept, sides: [side; 3], plane, lattice: false }
    }

    /// The solid, with the displacement of its points at each step of `positions`, those of the chosen
    /// particles. Neighbours up to `bridge` spacings apart have no crack between them.
    pub fn solid(&self, reference: &[[f64; 3]], positions: &[Vec<[f64; 3]>], bridge: f64) -> PageSolid {
        // lengths in spacings
        let scaled = |x: &[f64; 3]| [0, 1, 2].map(|d| x[d] / self.sides[d]);
        let rest: Vec<[f64; 3]> = reference.iter().map(scaled).collect();
        let next = match self.lattice {
            true => neighbours(&rest, 1.0),
            false => vec![[NONE; 6]; rest.len()],
        };
        let steps: Vec<(Vec<[f64; 3]>, Vec<Sides>)> = positions
            .par_iter()
            .map(|positions| {
                let places: Vec<[f64; 3]> = positions.iter().map(scaled).collect();
                let joined = joined(&places, &next, 1.0, bridge);
                (places, joined)
            })
            .collect();
        // joined in all steps: the same corners
        let mut always = next;
        for (_, joined) in &steps {
            for (always, now) in always.iter_mut().zip(joined) {
                (0..6).filter(|&side| now[side] == NONE).for_each(|side| always[side] = NONE);
            }
        }
        let (owner, corner_of) = self.corners(&always);
        let place = |positions: &[[f64; 3]], joined: &[Sides], &(particle, corner): &(u32, u8)| -> [f64; 3] {
            let cells =
                LatticeCells { positions, joined, spacing: 1.0, axes: if self.plane { 2 } else { 3 } };
            let at = cells.corner(particle as usize, corner);
            [0, 1, 2].map(|d| at[d] * self.sides[d])
        };
        let points: Vec<[f64; 3]> = owner.iter().map(|owner| place(&rest, &always, owner)).collect();
        let moved = steps
            .par_iter()
            .map(|(places, joined)| {
                let u = |(owner, x): (&(u32, u8), &[f64; 3])| {
                    let now = place(places, joined, owner);
                    [0, 1, 2].map(|d| now[d] - x[d])
                };
                owner.iter().zip(&points).map(u).collect()
            })
            .collect();
        PageSolid {
            points,
            moved,
            kinds: vec![if self.plane { QUADRILATERAL } else { HEXAHEDRON }; reference.len()],
            corners: corner_of,
            cell_of: self.kept.clone(),
            point_of: Vec::new(),
        }
    }

    /// Corners that joined cells share: a particle and a corner of its cell that stand for each, and the
    /// corners of all cells, in VTK's order.
    fn corners(&self, joined: &[Sides]) -> (Vec<(u32, u8)>, Vec<u32>) {
        let count = if self.plane { 4 } else { 8 };
        let mut sets = DisjointSets::new(joined.len() * count);
        for (particle, beside) in joined.iter().enumerate() {
            for axis in 0..3 {
                let other = beside[2 * axis + 1];
                if other == NONE {
                    continue;
                }
                for corner in (0..count).filter(|corner| corner >> axis & 1 == 1) {
                    let there = other as usize * count + (corner ^ (1 << axis));
                    sets.join((particle * count + corner) as u32, there as u32);
                }
            }
        }
        let order: &[usize] = if self.plane { &[0, 1, 3, 2] } else { &[0, 1, 3, 2, 4, 5, 7, 6] };
        let mut number = vec![u32::MAX; joined.len() * count];
        let (mut owners, mut corners) = (Vec::new(), Vec::with_capacity(number.len()));
        for particle in 0..joined.len() {
            for corner in order {
                let root = sets.root((particle * count + corner) as u32) as usize;
                if number[root] == u32::MAX {
                    number[root] = owners.len() as u32;
                    owners.push(((root / count) as u32, (root % count) as u8));
                }
                corners.push(number[root]);
            }
        }
        (owners, corners)
    }
}

/// The smallest distance of planes of points along an axis; closer ones than `same` are one.
fn gap(points: &[[f64; 3]], axis: usize, same: f64) -> f64 {
    let mut places: Vec<f64> = points.iter().map(|x| x[axis]).collect();
    places.sort_unstable_by(f64::total_cmp);
    places.windows(2).map(|pair| pair[1] - pair[0]).filter(|&gap| gap > same).fold(f64::INFINITY, f64::min)
}

/// The median distance of the nearest neighbours of some points.
fn nearest(points: &[[f64; 3]]) -> f64 {
    let distance = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|d| (a[d] - b[d]).powi(2)).sum::<f64>();
    let of = |k: usize| {
        let others = points.iter().enumerate().filter(|(other, _)| *other != k);
        others.map(|(_, x)| distance(&points[k], x)).fold(f64::INFINITY, f64::min).sqrt()
    };
    let every = points.len().div_ceil(ASKED).max(1);
    let mut found: Vec<f64> = (0..points.len()).step_by(every).map(of).filter(|x| x.is_finite()).collect();
    found.sort_unstable_by(f64::total_cmp);
    found.get(found.len() / 2).copied().filter(|x| *x > 0.0).unwrap_or(1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice([a, b, c]: [usize; 3]) -> Vec<[f64; 3]> {
        (0..a * b * c)
            .map(|k| [0.3 + 0.5 * (k % a) as f64, 0.2 * (k / a % b) as f64, 0.5 * (k / a / b) as f64])
            .collect()
    }

    /// Cells of unequal sides deform as one: every corner goes to its image, no corner twice, the volume is
    /// that of the block.
    #[test]
    fn blocks_deform_as_one() {
        let rest = lattice([6, 5, 4]);
        let image =
            |x: &[f64; 3]| [2.0 * x[0] + 0.3 * x[1], 0.9 * x[1] - 0.1 * x[2], 1.1 * x[2] + 0.2 * x[0]];
        let choice = ParticleChoice::from_positions(&rest, 1);
        assert!(
            (0..3).all(|d| (choice.sides[d] - [0.5, 0.2, 0.5][d]).abs() < 1e-12)
                && !choice.plane
                && choice.lattice
        );
        let solid = choice.solid(&rest, &[rest.clone(), rest.iter().map(image).collect()], 100.0);
        assert_eq!((solid.points.len(), solid.corners.len()), (7 * 6 * 5, 8 * 120));
        for (x, (still, moved)) in solid.points.iter().zip(solid.moved[0].iter().zip(&solid.moved[1])) {
            assert!(
                (0..3).all(|d| still[d].abs() < 1e-12 && (x[d] + moved[d] - image(x)[d]).abs() < 1e-12),
                "{x:?}"
            );
        }
        // corners in VTK's order: the determinant of the edges at corner 0 is the volume
        let corner = |k: usize| solid.points[solid.corners[k] as usize];
        let edge = |k: usize| [0, 1, 2].map(|d| corner(k)[d] - corner(0)[d]);
        let [u, v, w] = [1, 3, 4].map(edge);
        let volume = u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0])
            + u[2] * (v[0] * w[1] - v[1] * w[0]);
        assert!((volume - 0.05).abs() < 1e-12, "{volume}");
    }

    /// A sheet torn in its last step has a seam from the first, closed until then.
    #[test]
    fn cracks_split_corners() {
        let rest = lattice([8, 6, 1]);
        let torn: Vec<[f64; 3]> =
            rest.iter().map(|x| [x[0], x[1] + if x[1] > 0.5 { 1.0 } else { 0.0 }, 0.0]).collect();
        let choice = ParticleChoice::from_positions(&rest, 1);
        assert!(choice.plane);
        let solid = choice.solid(&rest, &[rest.clone(), torn], 100.0);
        assert_eq!(solid.points.len(), 9 * 7 + 9, "a second row of corners");
        assert!(solid.moved[0].iter().flatten().all(|u| u.abs() < 1e-12));
        let opened = solid.moved[1].iter().filter(|u| (u[1] - 1.0).abs() < 1e-12).count();
        assert_eq!(opened, 9 * 4, "the upper half goes as it is");
    }

    #[test]
    fn fewer_of_many_and_clouds() {
        let rest = lattice([100, 80, 10]);
        let choice = ParticleChoice::from_positions(&rest, 1);
        assert!(choice.kept.len() <= MOST[0] && choice.kept.len() > MOST[0] / 10, "{}", choice.kept.len());
        let extent = 100.0 * 80.0 * 10.0 * 0.05;
        let volume = choice.kept.len() as f64 * choice.sides.iter().product::<f64>();
        assert!((volume / extent - 1.0).abs() < 0.1, "{volume} of {extent}");
        assert!(ParticleChoice::from_positions(&rest, 4).kept.len() < choice.kept.len() / 3);
        // a turned lattice is a cloud
        let (s, c) = 0.4f64.sin_cos();
        let turned: Vec<[f64; 3]> =
            lattice([30, 20, 1]).iter().map(|x| [c * x[0] - s * x[1], s * x[0] + c * x[1], 0.0]).collect();
        let choice = ParticleChoice::from_positions(&turned, 1);
        assert!(
            !choice.lattice && choice.plane && (choice.sides[0] - 0.2).abs() < 1e-9,
            "{:?}",
            choice.sides
        );
        let solid = choice.solid(&turned, std::slice::from_ref(&turned), 2.0);
        assert_eq!(solid.points.len(), 4 * 600);
        // one particle
        let one = [[1.0, 2.0, 0.0]];
        assert_eq!(ParticleChoice::from_positions(&one, 1).solid(&one, &[one.to_vec()], 2.0).points.len(), 4);
    }
}
