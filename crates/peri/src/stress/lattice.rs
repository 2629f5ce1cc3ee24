//! Stress on a lattice, where the bond function depends on offsets only: each measure is, bond by bond of the
//! stencil, a convolution of that bond's forces with fixed weights. The forces are the same for all measures.

use super::bond_forces::forces;
use super::convolution::{OffsetBonds, ShareSums, Tap, tiles};
use super::window::{AveragedWindow, StressWindow, normalise};
use super::{
    BallVolume, MeasuredStress, StressInput, StressMethod, ball_volume, cell_fractions, force_over_length,
    segment_fraction,
};
use crate::bonds::{BodyGeometry, LatticeBonds};
use crate::parallel;
use std::collections::BTreeMap;
use std::time::Instant;

/// Weights of a measure on a lattice.
pub struct StressPlan<const D: usize> {
    measure: StressMethod,
    window: Option<AveragedWindow<D>>,
    /// Taps of each bond of half the stencil.
    pub taps: Vec<Vec<Tap>>,
    /// Sites whose averages are divided by the weights of the bonds whose two particles exist.
    pub rim: Vec<u32>,
}

impl<const D: usize> StressPlan<D> {
    /// Computes the weights of a measure.
    pub fn new(bonds: &LatticeBonds<D>, state: &StressInput<D>, measure: StressMethod) -> Self {
        let window = measure
            .is_partition()
            .then(|| AveragedWindow::<D>::new(StressWindow::for_measure(measure), bonds.ratio()));
        let mut alike = BTreeMap::new();
        let half = half(bonds).iter();
        let taps = half.map(|&offset| taps(bonds, offset, measure, window.as_ref(), &mut alike)).collect();
        Self { measure, window, taps, rim: rim(bonds, state, measure) }
    }

    /// Returns the divisor of the sum over bonds, particle by particle.
    pub fn volumes(&self, bonds: &LatticeBonds<D>, state: &StressInput<D>, ball: BallVolume) -> Vec<f64> {
        volumes(bonds, state, self.measure, ball, self.window.as_ref())
    }
}

/// Sums of a measure, and their run time.
struct StressSums<const D: usize> {
    plan: StressPlan<D>,
    shares: ShareSums<D>,
    seconds: f64,
}

impl<const D: usize> StressSums<D> {
    fn new(bonds: &LatticeBonds<D>, state: &StressInput<D>, measure: StressMethod) -> Self {
        let started = Instant::now();
        let plan = StressPlan::new(bonds, state, measure);
        let shares = ShareSums::new(bonds.sites(), &plan.rim);
        Self { plan, shares, seconds: started.elapsed().as_secs_f64() }
    }

    /// Divides the sums by the volumes.
    fn finish(self, bonds: &LatticeBonds<D>, state: &StressInput<D>, ball: BallVolume) -> MeasuredStress<D> {
        let started = Instant::now();
        let volumes = self.plan.volumes(bonds, state, ball);
        let one = |particle: usize| {
            let share = self.shares.get(bonds.particles()[particle] as usize);
            share.map(|row| row.map(|sum| sum / volumes[particle]))
        };
        let piola = parallel::map(volumes.len(), one);
        MeasuredStress { piola, seconds: self.seconds + started.elapsed().as_secs_f64() }
    }
}

/// Returns one direction of every bond; the other adds the same f ⊗ ξ, which cancels the factor ½ of the
/// definition.
fn half<const D: usize>(bonds: &LatticeBonds<D>) -> &[[i32; D]] {
    let offsets = &bonds.stencil().offsets;
    &offsets[..offsets.len() / 2]
}

pub fn piolas<const D: usize>(
    bonds: &LatticeBonds<D>,
    state: &StressInput<D>,
    measures: &[StressMethod],
    ball: BallVolume,
) -> Vec<MeasuredStress<D>> {
    if !bonds.images().is_empty() {
        // sums below see the bonds of particles only, not those of images
        return measures.iter().map(|&measure| of_families(bonds, state, measure)).collect();
    }
    let mut all: Vec<StressSums<D>> =
        measures.iter().map(|&measure| StressSums::new(bonds, state, measure)).collect();
    let started = Instant::now();
    let reach =
        all.iter().flat_map(|sums| sums.plan.taps.iter().flatten()).map(|tap| tap.shift.unsigned_abs());
    let longest = half(bonds).iter().map(|&offset| bonds.shift(offset).unsigned_abs());
    let (reach, longest) = (reach.max().unwrap_or(0), longest.max().unwrap_or(0));
    let filled = tiles(bonds.sites(), bonds.particles());
    let mut shared = OffsetBonds::new(&bonds.occupancy(), filled, reach, longest);
    let mut seconds = started.elapsed().as_secs_f64();
    for (k, &offset) in half(bonds).iter().enumerate() {
        let started = Instant::now();
        shared.set(bonds.shift(offset), |start, filled, out| forces(bonds, state, k, start, filled, out));
        seconds += started.elapsed().as_secs_f64();
        let edge = offset.map(|o| f64::from(o) * bonds.lattice().spacing);
        for sums in &mut all {
            let started = Instant::now();
            shared.add(&sums.plan.taps[k], edge, &mut sums.shares);
            sums.seconds += started.elapsed().as_secs_f64();
        }
    }
    let finish = |sums: StressSums<D>| {
        let measured = sums.finish(bonds, state, ball);
        MeasuredStress { seconds: measured.seconds + seconds, ..measured }
    };
    all.into_iter().map(finish).collect()
}

/// P = ½ Σ_J f ⊗ ξ V_J of each family of a body with periodic sides; NaN for other measures.
fn of_families<const D: usize>(
    bonds: &LatticeBonds<D>,
    state: &StressInput<D>,
    measure: StressMethod,
) -> MeasuredStress<D> {
    let started = Instant::now();
    let of = |&site: &u32| {
        if measure != StressMethod::OnePoint {
            return [[f64::NAN; D]; D];
        }
        let (own, mut sum) = (state.displacement.get(site as usize), [[0.0; D]; D]);
        bonds.neighbours(site as usize, &mut |bond| {
            let other = state.displacement.get(bond.site);
            let eta: [f64; D] = std::array::from_fn(|d| other[d] - own[d]);
            let pull = force_over_length(state.fit, state.modulus, 1.0, site as usize, &bond, eta);
            for a in 0..D {
                for b in 0..D {
                    sum[a][b] += 0.5 * pull * (bond.bond[a] + eta[a]) * bond.bond[b];
                }
            }
        });
        sum
    };
    let piola = parallel::map_each(bonds.particles(), of);
    MeasuredStress { piola, seconds: started.elapsed().as_secs_f64() }
}

/// Bond functions of offsets that differ only in the order and signs of their components.
type EquivalentOffsets<const D: usize> = BTreeMap<[i32; D], Vec<([i32; D], f64)>>;

/// Bond function of an offset, from that of the equivalent one with ascending, non-negative components.
fn bond_function<const D: usize>(
    window: &AveragedWindow<D>,
    offset: [i32; D],
    alike: &mut EquivalentOffsets<D>,
) -> Vec<([i32; D], f64)> {
    let mut order: [usize; D] = std::array::from_fn(|d| d);
    order.sort_by_key(|&d| offset[d].abs());
    let plain: [i32; D] = std::array::from_fn(|d| offset[order[d]].abs());
    let found = alike.entry(plain).or_insert_with(|| window.bond_function(plain));
    let turn = |(start, weight): &([i32; D], f64)| {
        let mut turned = [0; D];
        for d in 0..D {
            turned[order[d]] = if offset[order[d]] < 0 { -start[d] } else { start[d] };
        }
        (turned, *weight)
    };
    let mut turned: Vec<([i32; D], f64)> = found.iter().map(turn).collect();
    turned.sort_by_key(|(start, _)| std::array::from_fn::<i32, D, _>(|d| start[D - 1 - d]));
    turned
}

/// Weights of a stencil bond for a measure.
fn taps<const D: usize>(
    bonds: &LatticeBonds<D>,
    offset: [i32; D],
    measure: StressMethod,
    window: Option<&AveragedWindow<D>>,
    alike: &mut EquivalentOffsets<D>,
) -> Vec<Tap> {
    let weights = match (measure, window) {
        (StressMethod::OnePoint, _) => vec![([0; D], 0.5), (offset.map(|o| -o), 0.5)],
        (StressMethod::HardyScaled, _) => {
            let mut weights = crossing(bonds.ratio(), offset, measure);
            normalise(&mut weights);
            weights
        }
        (_, Some(window)) => bond_function(window, offset, alike),
        _ => crossing(bonds.ratio(), offset, measure),
    };
    weights.into_iter().map(|(start, weight)| Tap { shift: bonds.shift(start), weight }).collect()
}

/// Start of bonds that cross the ball about a particle, and the fraction inside (as printed: ½ with both ends
/// there).
fn crossing<const D: usize>(ratio: f64, offset: [i32; D], measure: StressMethod) -> Vec<([i32; D], f64)> {
    let square = ratio * ratio;
    let reach = 2 * ratio.ceil() as i32;
    let side = (2 * reach + 1) as usize;
    (0..side.pow(D as u32))
        .filter_map(|index| {
            let start: [i32; D] = std::array::from_fn(|d| (index / side.pow(d as u32) % side) as i32 - reach);
            let p = start.map(f64::from);
            let q = std::array::from_fn(|d| p[d] + f64::from(offset[d]));
            let norm = |x: [f64; D]| x.iter().map(|c| c * c).sum::<f64>();
            let weight = match measure {
                StressMethod::AsPublished if norm(p) < square && norm(q) < square => 0.5,
                StressMethod::AsPublished => 0.0,
                _ => segment_fraction(p, q, square),
            };
            (weight > 0.0).then_some((start, weight))
        })
        .collect()
}

/// Sites near a surface whose windows lack bonds, if existing bonds compensate for them.
fn rim<const D: usize>(bonds: &LatticeBonds<D>, state: &StressInput<D>, measure: StressMethod) -> Vec<u32> {
    let wanted = |site: usize| match measure {
        StressMethod::HardyBonds => true,
        StressMethod::HardyWindow => false,
        _ => measure.is_partition() && !state.missing.is_window(site),
    };
    // no bond that crosses a window begins farther away
    let reach = (bonds.ratio() + 0.5).floor() as i32 + bonds.ratio().floor() as i32;
    // axis by axis: true if all within reach along it, and along previous axes, are occupied
    let mut whole = bonds.occupancy();
    for d in 0..D {
        let mut offset = [0; D];
        offset[d] = 1;
        let stride = bonds.shift(offset);
        let full = |site: usize| {
            let at = |k: i32| site.wrapping_add_signed(k as isize * stride);
            (-reach..=reach).all(|k| whole.get(at(k)).copied().unwrap_or(false))
        };
        let next: Vec<bool> = parallel::map(whole.len(), |site| whole[site] && full(site));
        whole = next;
    }
    let particles = bonds.particles().iter().copied();
    particles.filter(|&s| !whole[s as usize] && wanted(s as usize)).collect()
}

/// Divisor of the sum over bonds, particle by particle.
fn volumes<const D: usize>(
    bonds: &LatticeBonds<D>,
    state: &StressInput<D>,
    measure: StressMethod,
    ball: BallVolume,
    window: Option<&AveragedWindow<D>>,
) -> Vec<f64> {
    let lattice = bonds.lattice();
    let thickness = lattice.volume / lattice.spacing.powi(D as i32);
    let whole = ball_volume(D, bonds.horizon()) * thickness;
    let sites = || {
        let offsets = &bonds.stencil().offsets;
        let share = 1.0 / (offsets.len() + 1) as f64;
        offsets.iter().copied().chain([[0; D]]).map(|o| (o, share)).collect::<Vec<_>>()
    };
    let (cells, volume) = match (measure, ball, window) {
        (StressMethod::BallShare, BallVolume::Particles, _) => (sites(), whole),
        (StressMethod::BallShare, BallVolume::Cells, _) => (cell_fractions::<D>(bonds.ratio()), whole),
        (StressMethod::OnePoint, ..) => (Vec::new(), lattice.volume),
        (StressMethod::HardyScaled, ..) => (sites(), lattice.volume),
        (_, _, Some(window)) => (window.cells(), lattice.volume),
        _ => (Vec::new(), whole),
    };
    let shared = |site: usize| match measure {
        StressMethod::HardyWindow => true,
        StressMethod::HardyBonds => false,
        _ => !measure.is_partition() || state.missing.is_window(site),
    };
    shares(bonds, &cells, shared).into_iter().map(|s| s * volume).collect()
}

/// Sum of the shares of the occupied cells around each particle; 1 where unwanted or without shares.
fn shares<const D: usize>(
    bonds: &LatticeBonds<D>,
    cells: &[([i32; D], f64)],
    wanted: impl Fn(usize) -> bool + Sync,
) -> Vec<f64> {
    let occupied = bonds.occupancy();
    parallel::map_each(bonds.particles(), |&site| {
        if cells.is_empty() || !wanted(site as usize) {
            return 1.0;
        }
        let cell = bonds.cell_of(site as usize);
        cells
            .iter()
            .filter(|(offset, _)| cell.and_then(|c| bonds.cell_at(c, *offset)).is_some_and(|s| occupied[s]))
            .map(|c| c.1)
            .sum()
    })
}
