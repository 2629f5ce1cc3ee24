//! Stress in a cloud, whose bonds have no common offsets.

use super::window::{StressWindow, bond_function};
use super::{
    BallVolume, StressInput, StressMethod, StressTensor, ball_volume, force_over_length, segment_fraction,
};
use crate::bonds::{BodyGeometry, CellGrid, CloudBonds, Neighbour, Stencil};
use crate::parallel;
use pulp::{Arch, NullaryFnOnce};

pub fn piola<const D: usize>(
    bonds: &CloudBonds<D>,
    state: &StressInput<D>,
    measure: StressMethod,
    ball: BallVolume,
) -> Vec<StressTensor<D>> {
    let points: Vec<[f64; D]> = bonds.particles().iter().map(|&s| bonds.position(s as usize)).collect();
    let grid = CellGrid::new(&points, bonds.horizon());
    if measure.is_partition() {
        // scenes refuse measures that need a lattice
        let window =
            if measure.needs_lattice() { StressWindow::Ball } else { StressWindow::for_measure(measure) };
        return CloudShares { bonds, state, window, points: &points, grid: &grid }.stress();
    }
    in_balls(bonds, state, (measure, ball), &points, &grid)
}

/// Computes the other measures: every particle searches for the bonds that cross its ball.
fn in_balls<const D: usize>(
    bonds: &CloudBonds<D>,
    state: &StressInput<D>,
    (measure, ball): (StressMethod, BallVolume),
    points: &[[f64; D]],
    grid: &CellGrid<D>,
) -> Vec<StressTensor<D>> {
    let radius = bonds.horizon();
    let square = radius * radius;
    let whole = ball_volume(D, radius) * bonds.thickness();
    let filled: Vec<f64> = match (measure, ball) {
        (StressMethod::BallShare, BallVolume::Particles | BallVolume::Cells) => {
            // as for bonds: a distance equal to the horizon counts, whatever the rounding
            let reach = radius * (1.0 + 1e-9);
            let inside = parallel::map_each(points, |&here| {
                let mut sum = 0.0;
                grid.near(here, reach, |other| {
                    if distance_square(points[other], here) <= reach * reach {
                        sum += bonds.volume(other);
                    }
                });
                sum
            });
            // bonds of a lattice of the same mean spacing in a whole ball: bodies thinner than that have no
            // such ball
            let full = (Stencil::<D>::new(reach / bonds.spacing()).offsets.len() + 1) as f64;
            let full = full * bonds.spacing().powi(D as i32) * bonds.thickness();
            inside.into_iter().map(|v| whole * v / full).collect()
        }
        _ => vec![whole; points.len()],
    };
    // a bond that crosses the ball has its nearer end within √(δ² + (δ/2)²) of the centre
    let reach = radius * 1.25_f64.sqrt();
    let one = |site: usize| -> StressTensor<D> {
        let here = points[site];
        let mut sum = [[0.0; D]; D];
        let mut add = |own: usize, weight_of: &dyn Fn([f64; D], [f64; D], usize) -> f64| {
            bonds.neighbours(own, &mut |bond| {
                let p = std::array::from_fn(|d| points[own][d] - here[d]);
                // not p + ξ: both ends must see the same numbers, or ties are counted twice or never
                let q = std::array::from_fn(|d| points[bond.site][d] - here[d]);
                let weight = weight_of(p, q, bond.site);
                if weight > 0.0 {
                    let whole = moment(bonds, state, own, &bond);
                    for a in 0..D {
                        for b in 0..D {
                            sum[a][b] += weight * whole[a][b];
                        }
                    }
                }
            });
        };
        let volume = if measure == StressMethod::OnePoint {
            add(site, &|_, _, _| 0.5);
            bonds.volume(site)
        } else {
            let norm = |x: [f64; D]| x.iter().map(|c| c * c).sum::<f64>();
            grid.near(here, reach, |own| {
                if distance_square(points[own], here) > reach * reach {
                    return;
                }
                // a bond counts from the nearer end only
                let nearer = |p, q, other| (norm(p), own) < (norm(q), other);
                add(own, &|p, q, other| match measure {
                    // either end finds such a bond: half of its ½ from each
                    StressMethod::AsPublished if norm(p) < square && norm(q) < square => 0.25,
                    StressMethod::AsPublished => 0.0,
                    _ if nearer(p, q, other) => segment_fraction(p, q, square),
                    _ => 0.0,
                });
            });
            filled[site]
        };
        sum.map(|row| row.map(|x| x / volume))
    };
    parallel::map(points.len(), one)
}

/// f V_I V_J ⊗ ξ of a bond, N m.
fn moment<const D: usize>(
    bonds: &CloudBonds<D>,
    state: &StressInput<D>,
    own: usize,
    bond: &Neighbour<D>,
) -> StressTensor<D> {
    let (u, v) = (state.displacement.get(own), state.displacement.get(bond.site));
    let eta: [f64; D] = std::array::from_fn(|d| v[d] - u[d]);
    let volume = bonds.volume(own);
    let scale = force_over_length(state.fit, state.modulus, volume, own, bond, eta);
    std::array::from_fn(|a| std::array::from_fn(|b| scale * (bond.bond[a] + eta[a]) * bond.bond[b]))
}

/// Measures whose weights sum to 1: P_p = Σ f V_I V_J ⊗ ξ B_p/(Σ_q V_q B_q) over the bonds, B_p the bond
/// function in p's window.
struct CloudShares<'a, const D: usize> {
    bonds: &'a CloudBonds<D>,
    state: &'a StressInput<'a, D>,
    window: StressWindow,
    points: &'a [[f64; D]],
    grid: &'a CellGrid<D>,
}

/// Particles around one, relative to it, whose windows its bonds may cross.
struct ParticlesInReach<const D: usize> {
    members: Vec<u32>,
    relative: [Vec<f64>; D],
    volumes: Vec<f64>,
    /// |x|² − δ².
    beyond: Vec<f64>,
}

impl<const D: usize> CloudShares<'_, D> {
    /// Distributes bonds particle by particle; the shares are summed in the order of the particles, so that
    /// threads change no bit.
    fn stress(&self) -> Vec<StressTensor<D>> {
        /// Particles whose shares are held at once: about 150 kB each in a solid at m = 4.
        const HELD: usize = 128;
        let mut stress = vec![[[0.0; D]; D]; self.points.len()];
        let arch = Arch::new();
        let owners: Vec<usize> = (0..self.points.len()).collect();
        for owners in owners.chunks(HELD) {
            let of = |&own: &usize| {
                let around = self.around(own);
                let mut bonds = Vec::new();
                self.bonds.neighbours(own, &mut |bond| {
                    if bond.site > own {
                        bonds.push(bond);
                    }
                });
                let shares = arch.dispatch(ShareKernel { shares: self, own, bonds: &bonds, around: &around });
                (around.members, shares)
            };
            let all: Vec<_> = parallel::map_each(owners, of);
            for (members, shares) in all {
                for (member, share) in members.into_iter().zip(shares) {
                    for a in 0..D {
                        for b in 0..D {
                            stress[member as usize][a][b] += share[a][b];
                        }
                    }
                }
            }
        }
        stress
    }

    /// Collects the particles around one: a bond and a ball end within 2δ.
    fn around(&self, own: usize) -> ParticlesInReach<D> {
        let (here, radius) = (self.points[own], self.bonds.horizon());
        let mut around = ParticlesInReach {
            members: Vec::new(),
            relative: [(); D].map(|()| Vec::new()),
            volumes: Vec::new(),
            beyond: Vec::new(),
        };
        let reach = 2.0 * radius * (1.0 + 1e-9);
        self.grid.near(here, reach, |third| {
            let square = distance_square(self.points[third], here);
            if square <= reach * reach {
                around.members.push(third as u32);
                for d in 0..D {
                    around.relative[d].push(self.points[third][d] - here[d]);
                }
                around.volumes.push(self.bonds.volume(third));
                around.beyond.push(square - radius * radius);
            }
        });
        around
    }
}

/// Distributes the bonds of `own` over the particles around it.
struct ShareKernel<'a, const D: usize> {
    shares: &'a CloudShares<'a, D>,
    own: usize,
    bonds: &'a [Neighbour<D>],
    around: &'a ParticlesInReach<D>,
}

impl<const D: usize> NullaryFnOnce for ShareKernel<'_, D> {
    type Output = Vec<StressTensor<D>>;
    #[inline(always)]
    fn call(self) -> Vec<StressTensor<D>> {
        let Self { shares: all, own, bonds, around } = self;
        let count = around.members.len();
        let radius = all.bonds.horizon();
        let mut shares = vec![[[0.0; D]; D]; count];
        let mut parts = vec![0.0; count];
        let mut crossed = vec![0; count];
        for bond in bonds {
            around.fractions(bond.bond, &mut parts);
            let mut crossings = 0;
            for (k, part) in parts.iter().enumerate() {
                crossed[crossings] = k;
                crossings += usize::from(*part > 0.0);
            }
            let crossed = &crossed[..crossings];
            if all.window != StressWindow::Ball {
                for &k in crossed {
                    let p: [f64; D] = std::array::from_fn(|d| -around.relative[d][k]);
                    let q = std::array::from_fn(|d| bond.bond[d] - around.relative[d][k]);
                    parts[k] = bond_function(all.window, p, q, radius);
                }
            }
            let total: f64 = crossed.iter().map(|&k| around.volumes[k] * parts[k]).sum();
            let whole = moment(all.bonds, all.state, own, bond);
            for &k in crossed {
                let weight = parts[k] / total;
                for a in 0..D {
                    for b in 0..D {
                        shares[k][a][b] += weight * whole[a][b];
                    }
                }
            }
        }
        shares
    }
}

impl<const D: usize> ParticlesInReach<D> {
    /// Fraction of the bond inside the ball of every particle: [`segment_fraction`], vectorised.
    #[inline(always)]
    fn fractions(&self, bond: [f64; D], parts: &mut [f64]) {
        let square: f64 = bond.iter().map(|x| x * x).sum();
        let inverse = 1.0 / square;
        let relative: [&[f64]; D] = std::array::from_fn(|d| &self.relative[d][..parts.len()]);
        let beyond = &self.beyond[..parts.len()];
        for (k, part) in parts.iter_mut().enumerate() {
            let along: f64 = (0..D).map(|d| relative[d][k] * bond[d]).sum();
            let discriminant = along * along - square * beyond[k];
            let root = if discriminant > 0.0 { discriminant.sqrt() } else { 0.0 };
            let [enter, leave] = [(along - root) * inverse, (along + root) * inverse];
            let (enter, leave) =
                (if enter > 0.0 { enter } else { 0.0 }, if leave < 1.0 { leave } else { 1.0 });
            *part = if leave > enter { leave - enter } else { 0.0 };
        }
    }
}

fn distance_square<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    (0..D).map(|d| (a[d] - b[d]).powi(2)).sum()
}
