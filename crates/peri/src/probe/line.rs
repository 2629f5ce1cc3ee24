//! Fields along lines through the body at rest, interpolated between particles by moving least squares with a
//! linear basis.
//!
//! Lancaster & Salkauskas (1981), doi:10.1090/S0025-5718-1981-0616367-1, over the nearest particle and its
//! neighbours by intact bonds, with the weights w = (δ/d − 1)⁴ of their distances d: a linear field is exact,
//! and a particle has its own value. No value crosses a crack of the reference configuration: the nearest
//! particle is on the same side, and so are its neighbours. At bonds that broke later, the side is that of
//! the nearest particle.

use crate::bonds::{BodyGeometry, BondKind, Bonds, CellGrid};
use crate::geometry::{Cut, length, severed};
use nalgebra::{Matrix3, Vector3};

/// Distance over the spacing that counts as zero.
const NEAR: f64 = 1e-9;
/// Difference of distances, over the spacing, up to which two particles count as equally near.
const TIE: f64 = 1e-6;
/// Extent along a direction, over the largest, below which particles have none there.
const FLAT: f64 = 1e-10;
/// Greatest weight of the slope along one direction: from particles nearly in a row, a point beside it would
/// take large multiples of small differences.
const MOST: f64 = 5.0;

/// Particles around a line, between which fields are interpolated.
pub struct LineSampler<'a, const D: usize> {
    bonds: &'a dyn Bonds<D>,
    sites: Vec<u32>,
    places: Vec<[f64; D]>,
    grid: CellGrid<D>,
    cuts: &'a [Cut<D>],
    /// Greatest reach of a particle.
    most: f64,
}

/// Extent of a particle from its centre along each axis, m: half its cell; in a cloud, which has no cells,
/// the whole edge of the square or cube of its volume.
fn reach<const D: usize>(bonds: &dyn Bonds<D>, site: usize) -> f64 {
    match bonds.kind() {
        BondKind::Lattice(lattice) => 0.5 * lattice.spacing(),
        BondKind::Cloud(cloud) => (cloud.volume(site) / cloud.thickness()).powf(1.0 / D as f64),
    }
}

impl<'a, const D: usize> LineSampler<'a, D> {
    /// Finds the particles near the line between two `ends`, m, in a body with these cracks.
    pub fn new(bonds: &'a dyn Bonds<D>, cuts: &'a [Cut<D>], ends: [[f64; D]; 2]) -> Self {
        let along: [f64; D] = std::array::from_fn(|d| ends[1][d] - ends[0][d]);
        let square: f64 = along.iter().map(|x| x * x).sum();
        let all = bonds.particles().iter();
        let most = all.clone().map(|&site| reach(bonds, site as usize)).fold(0.0, f64::max);
        let near = |&&site: &&u32| {
            let from: [f64; D] = std::array::from_fn(|d| bonds.position(site as usize)[d] - ends[0][d]);
            let part = (0..D).map(|d| from[d] * along[d]).sum::<f64>() / square;
            let part = part.clamp(0.0, 1.0);
            (0..D).all(|d| (from[d] - part * along[d]).abs() <= 2.0 * most)
        };
        let sites: Vec<u32> = all.filter(near).copied().collect();
        let places: Vec<[f64; D]> = sites.iter().map(|&site| bonds.position(site as usize)).collect();
        Self { bonds, cuts, grid: CellGrid::new(&places, most), sites, places, most }
    }

    /// Sites and weights of the value at a point of the line, m; `None` outside of the body, and where the
    /// nearest particles lie on both sides of a crack.
    pub fn weights(&self, at: [f64; D]) -> Option<Vec<(usize, f64)>> {
        let (bonds, small) = (self.bonds, self.bonds.spacing());
        if self.sites.is_empty() {
            return None;
        }
        let (mut near, mut inside): (Vec<(f64, usize)>, _) = (Vec::new(), false);
        // beside a crack the nearest on the same side may be a spacing away along each axis
        self.grid.near(at, 2.0 * self.most * (1.0 + NEAR), |k| {
            let (site, place) = (self.sites[k] as usize, self.places[k]);
            let far = reach(bonds, site) + NEAR * small;
            inside |= (0..D).all(|d| (place[d] - at[d]).abs() <= far);
            near.push((distance(place, at), site));
        });
        if !inside {
            return None;
        }
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut near = near.into_iter().filter(|(_, site)| !severed(self.cuts, at, bonds.position(*site)));
        let (least, nearest) = near.next()?;
        if least <= NEAR * small {
            return Some(vec![(nearest, 1.0)]);
        }
        let here = bonds.position(nearest);
        let horizon = bonds.horizon();
        let apart = |other: usize| {
            distance(bonds.position(other), here) <= horizon * (1.0 + NEAR)
                && !bonds.is_bonded(nearest, other)
        };
        let on_crack = self.cuts.iter().any(|cut| cut.distance(at) <= NEAR * small);
        if on_crack
            || near.take_while(|(other, _)| *other <= least + TIE * small).any(|(_, site)| apart(site))
        {
            return None;
        }
        if least >= horizon {
            return Some(vec![(nearest, 1.0)]);
        }
        // site, weight, position relative to `at`
        let mut members = Vec::new();
        let mut add = |site: usize, place: [f64; D]| {
            let from: [f64; D] = std::array::from_fn(|d| place[d] - at[d]);
            let ratio = horizon / distance(place, at);
            if ratio > 1.0 {
                members.push((site, (ratio - 1.0).powi(4), vector(from)));
            }
        };
        add(nearest, here);
        bonds.neighbours(nearest, &mut |bond| add(bond.site, bonds.position(bond.site)));
        let total: f64 = members.iter().map(|member| member.1).sum();
        if !(total > 0.0 && total.is_finite()) {
            return Some(vec![(nearest, 1.0)]);
        }
        let mean = members.iter().map(|(_, weight, from)| *weight * from).sum::<Vector3<f64>>() / total;
        let spread = |(_, weight, from): &(usize, f64, Vector3<f64>)| {
            *weight * (from - mean) * (from - mean).transpose()
        };
        // along directions without extent the value is that of the nearest particle
        let eigen = members.iter().map(spread).sum::<Matrix3<f64>>().symmetric_eigen();
        let largest = eigen.eigenvalues.max();
        let mut slope = Vector3::zeros();
        for (value, axis) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            let share = axis.dot(&mean) / *value;
            let enters: f64 = members
                .iter()
                .map(|(_, weight, from)| (weight * share * axis.dot(&(from - mean))).abs())
                .sum();
            if *value > FLAT * largest && enters <= MOST {
                slope -= axis * share;
            }
        }
        // the weight of the nearest follows from the sum: computed directly it is a difference of large
        // numbers
        let mut weights = vec![(nearest, 1.0)];
        for (site, weight, from) in &members[1..] {
            let share = weight * (1.0 / total + slope.dot(&(from - mean)));
            weights.push((*site, share));
            weights[0].1 -= share;
        }
        Some(weights)
    }
}

fn vector<const D: usize>(of: [f64; D]) -> Vector3<f64> {
    Vector3::from_fn(|d, _| of.get(d).copied().unwrap_or(0.0))
}

fn distance<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    length::<D>(std::array::from_fn(|d| a[d] - b[d]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bonds::{CloudBonds, LatticeBonds, VolumeCorrection};
    use crate::geometry::{Operation, Shape, lattice};

    const CRACK: Cut<2> = Cut { corner: [-1.0, 3.0], edges: [[4.5, 0.0], [0.0; 2]] };

    fn regular(size: [f64; 2], cuts: &[Cut<2>]) -> LatticeBonds<2> {
        let body = lattice(&[Operation::Add(Shape::Box { min: [0.0; 2], max: size })], 1.0, 0.5).unwrap();
        LatticeBonds::new(body, 3.015, VolumeCorrection::None, cuts).unwrap()
    }

    /// The same particles, shifted by up to a fifth of the spacing.
    fn uneven(of: &LatticeBonds<2>) -> CloudBonds<2> {
        let shift = |k: usize, step: f64| 0.4 * ((k as f64 * step).fract() - 0.5);
        let each = of.particles().iter().map(|&site| of.position(site as usize)).enumerate();
        let points: Vec<[f64; 2]> =
            each.map(|(k, [x, y])| [x + shift(k, 0.618), y + shift(k, 0.732)]).collect();
        CloudBonds::new(&points, &vec![0.5; points.len()], 0.5, 3.015, VolumeCorrection::None, &[]).unwrap()
    }

    fn value(bonds: &dyn Bonds<2>, at: [f64; 2], field: &dyn Fn([f64; 2]) -> f64) -> Option<f64> {
        beside(bonds, &[], at, field)
    }

    fn beside(
        bonds: &dyn Bonds<2>,
        cuts: &[Cut<2>],
        at: [f64; 2],
        field: &dyn Fn([f64; 2]) -> f64,
    ) -> Option<f64> {
        let around = LineSampler::new(bonds, cuts, [[-1.0, at[1]], [13.0, at[1]]]);
        let weights = around.weights(at)?;
        Some(weights.iter().map(|(site, weight)| weight * field(bonds.position(*site))).sum())
    }

    /// Linear fields are exact anywhere in the body, up to its faces, and particles have their own values.
    #[test]
    fn linear_fields_are_exact() {
        let lattice = regular([12.0, 6.0], &[]);
        let cloud = uneven(&lattice);
        let linear = |[x, y]: [f64; 2]| 1.0 + 2.0 * x - 3.0 * y;
        for bonds in [&lattice as &dyn Bonds<2>, &cloud] {
            for k in 0..500 {
                let share = |step: f64| (f64::from(k) * step).fract();
                // near particles, too
                let near = [share(0.618).mul_add(1e-5, 4.5), 2.5];
                for at in [[12.0 * share(0.618), 6.0 * share(0.732)], near] {
                    let found = value(bonds, at, &linear).unwrap();
                    assert!((found - linear(at)).abs() < 1e-11, "{at:?} {found}");
                }
            }
            for &site in bonds.particles() {
                let at = bonds.position(site as usize);
                let rough = |[x, y]: [f64; 2]| (7.0 * x).sin() + y * y * y;
                assert_eq!(value(bonds, at, &rough), Some(rough(at)));
            }
            for outside in [[-0.9, 3.0], [12.9, 3.0], [6.0, 7.2]] {
                let of_lattice = bonds.as_lattice().is_some();
                assert!(!of_lattice || value(bonds, outside, &linear).is_none(), "{outside:?}");
            }
            assert_eq!(value(bonds, [6.0, 8.0], &linear), None);
        }
        // for one row of particles the value is that along it
        let row = regular([12.0, 1.0], &[]);
        assert!((value(&row, [4.2, 0.7], &linear).unwrap() - linear([4.2, 0.5])).abs() < 1e-12);
    }

    /// Each flank of a crack keeps its own values; on the crack, equally near to both, there is none.
    #[test]
    fn no_value_crosses_a_crack() {
        let bonds = regular([12.0, 6.0], &[CRACK]);
        let jump = |[_, y]: [f64; 2]| if y > 3.0 { 1.0 } else { 0.0 };
        assert_eq!(value(&bonds, [1.2, 2.9], &jump), Some(0.0));
        assert!((value(&bonds, [1.2, 3.1], &jump).unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(value(&bonds, [1.2, 3.0], &jump), None);
        assert!(value(&bonds, [9.2, 3.0], &jump).is_some());
    }

    /// A crack nearer to one row: points in the cells of that row but below the crack belong to the row
    /// below.
    #[test]
    fn no_value_crosses_a_crack_beside_a_row() {
        let cut = Cut { corner: [-1.0, 3.4], edges: [[4.5, 0.0], [0.0; 2]] };
        let bonds = regular([12.0, 6.0], std::slice::from_ref(&cut));
        let jump = |[_, y]: [f64; 2]| if y > 3.4 { 1.0 } else { 0.0 };
        for y in [2.9, 3.1, 3.3, 3.399] {
            assert_eq!(beside(&bonds, std::slice::from_ref(&cut), [1.2, y], &jump), Some(0.0), "{y}");
        }
        let above = beside(&bonds, std::slice::from_ref(&cut), [1.2, 3.41], &jump);
        assert!((above.unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(beside(&bonds, std::slice::from_ref(&cut), [1.2, 3.4], &jump), None);
    }

    /// A row of particles that is straight up to rounding: a point beside it has the value along it.
    #[test]
    fn nearly_straight_rows() {
        for uneven in [1e-8, 1e-4, 1e-2] {
            let points: Vec<[f64; 2]> = (0..40)
                .map(|k| [f64::from(k) + 0.5, uneven * ((f64::from(k) * 0.618).fract() - 0.5)])
                .collect();
            let bonds =
                CloudBonds::new(&points, &[1.0; 40], 1.0, 3.015, VolumeCorrection::None, &[]).unwrap();
            let curved = |[x, _]: [f64; 2]| 0.01 * x * x;
            for y in [0.0, 0.3, 0.9] {
                let found = value(&bonds, [6.2, y], &curved).unwrap();
                assert!((found - curved([6.2, y])).abs() < 0.02, "{uneven} {y} {found}");
            }
        }
    }

    /// A large particle covers points that are nearer to small ones, or farther than the horizon from all.
    #[test]
    fn nearest_of_unequal_particles() {
        let small = [[2.0, 0.0], [2.0, 0.6], [2.6, -0.6], [2.6, 0.5]];
        let points: Vec<[f64; 2]> = [[0.0, 0.0]].into_iter().chain(small).collect();
        let volumes = [9.0, 0.01, 0.01, 0.01, 0.01];
        let bonds = CloudBonds::new(&points, &volumes, 1.0, 2.1, VolumeCorrection::None, &[]).unwrap();
        let own = |[x, y]: [f64; 2]| if [x, y] == [0.0, 0.0] { 1000.0 } else { x };
        assert!((value(&bonds, [2.3, 0.0], &own).unwrap() - 2.3).abs() < 1.0);
        assert_eq!(value(&bonds, [-2.5, 0.5], &own), Some(1000.0));
    }
}
