//! In a cloud every particle looks for the bonds that cross its ball.

use super::window::{Window, bond_function};
use super::{BallVolume, Loaded, Measure, Tensor, ball_volume, force_over_length, segment_fraction};
use crate::bonds::{Bonds, CellGrid, CloudBonds, Stencil};
use rayon::prelude::*;

pub fn piola<const D: usize>(
    bonds: &CloudBonds<D>,
    state: &Loaded<D>,
    measure: Measure,
    ball: BallVolume,
) -> Vec<Tensor<D>> {
    let points: Vec<[f64; D]> = bonds.particles().iter().map(|&s| bonds.position(s as usize)).collect();
    let grid = CellGrid::new(&points, bonds.horizon());
    let radius = bonds.horizon();
    let square = radius * radius;
    let whole = ball_volume(D, radius) * bonds.thickness();
    let filled: Vec<f64> = match (measure, ball) {
        (Measure::BallShare, BallVolume::Particles | BallVolume::Cells) => {
            // as for bonds: a distance equal to the horizon counts, whatever the rounding
            let reach = radius * (1.0 + 1e-9);
            let inside: Vec<f64> = points
                .par_iter()
                .map(|&here| {
                    let mut sum = 0.0;
                    grid.near(here, reach, |other| {
                        if distance_square(points[other], here) <= reach * reach {
                            sum += bonds.volume(other);
                        }
                    });
                    sum
                })
                .collect();
            // what a lattice of the same mean spacing has in a whole ball: bodies thinner than that have no such ball
            let full = (Stencil::<D>::new(reach / bonds.spacing()).offsets.len() + 1) as f64;
            let full = full * bonds.spacing().powi(D as i32) * bonds.thickness();
            inside.into_iter().map(|v| whole * v / full).collect()
        }
        _ => vec![whole; points.len()],
    };
    // a bond that crosses the ball has its nearer end within √(δ² + (δ/2)²) of the centre
    let reach = radius * 1.25_f64.sqrt();
    // scenes refuse measures that need a lattice
    let window = if measure.needs_lattice() { Window::Ball } else { Window::of(measure) };
    let totals = measure.is_partition().then(|| totals(bonds, &points, &grid, window));
    let one = |site: usize| -> Tensor<D> {
        let here = points[site];
        let mut sum = [[0.0; D]; D];
        let mut add = |own: usize, weight_of: &dyn Fn([f64; D], [f64; D], usize, usize) -> f64| {
            let mut count = 0;
            bonds.neighbours(own, &mut |bond| {
                let p = std::array::from_fn(|d| points[own][d] - here[d]);
                // not p + ξ: seen from the other end, both must be the same numbers or ties are counted twice or never
                let q = std::array::from_fn(|d| points[bond.site][d] - here[d]);
                let weight = weight_of(p, q, bond.site, count);
                count += 1;
                if weight > 0.0 {
                    let (u, v) = (state.displacement.get(own), state.displacement.get(bond.site));
                    let eta: [f64; D] = std::array::from_fn(|d| v[d] - u[d]);
                    let volume = bonds.volume(own);
                    let scale = weight
                        * force_over_length(state.fit, state.modulus, bond.weight, volume, bond.bond, eta);
                    for a in 0..D {
                        for b in 0..D {
                            sum[a][b] += scale * (bond.bond[a] + eta[a]) * bond.bond[b];
                        }
                    }
                }
            });
        };
        let volume = if measure == Measure::OnePoint {
            add(site, &|_, _, _, _| 0.5);
            bonds.volume(site)
        } else {
            let norm = |x: [f64; D]| x.iter().map(|c| c * c).sum::<f64>();
            grid.near(here, reach, |own| {
                if distance_square(points[own], here) > reach * reach {
                    return;
                }
                // only the nearer end counts a bond
                let nearer = |p, q, other| (norm(p), own) < (norm(q), other);
                add(own, &|p, q, other, index| match (measure, &totals) {
                    (_, Some(totals)) if nearer(p, q, other) => {
                        bond_function(window, p, q, radius) / totals[own][index]
                    }
                    (_, Some(_)) => 0.0,
                    // either end finds such a bond: half of its ½ from each
                    (Measure::AsPublished, _) if norm(p) < square && norm(q) < square => 0.25,
                    (Measure::AsPublished, _) => 0.0,
                    _ if nearer(p, q, other) => segment_fraction(p, q, square),
                    _ => 0.0,
                });
            });
            if totals.is_some() { 1.0 } else { filled[site] }
        };
        sum.map(|row| row.map(|x| x / volume))
    };
    (0..points.len()).into_par_iter().map(one).collect()
}

/// Σ V B over the particles whose windows a bond crosses, for every bond in the order of the visits.
fn totals<const D: usize>(
    bonds: &CloudBonds<D>,
    points: &[[f64; D]],
    grid: &CellGrid<D>,
    window: Window,
) -> Vec<Vec<f64>> {
    let one = |own: usize| {
        let mut sums = Vec::new();
        bonds.neighbours(own, &mut |bond| {
            // the same bond from either end in the same order: the same bits
            let (a, b) = (points[own.min(bond.site)], points[own.max(bond.site)]);
            let middle = std::array::from_fn(|d| 0.5 * (a[d] + b[d]));
            let mut sum = 0.0;
            // half a bond and a ball away from its middle
            grid.near(middle, 1.5 * bonds.horizon(), |third| {
                let seen = |end: [f64; D]| std::array::from_fn(|d| end[d] - points[third][d]);
                sum += bonds.volume(third) * bond_function::<D>(window, seen(a), seen(b), bonds.horizon());
            });
            sums.push(sum);
        });
        sums
    };
    (0..points.len()).into_par_iter().map(one).collect()
}

fn distance_square<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    (0..D).map(|d| (a[d] - b[d]).powi(2)).sum()
}
