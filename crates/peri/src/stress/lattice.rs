//! On a lattice the bond function depends on offsets only: each measure is, bond by bond of the stencil, a convolution
//! of that bond's forces with fixed weights.

use super::convolution::{BLOCK, Shared, Tap, blocks};
use super::window::{Averaged, Window, normalise};
use super::{BallVolume, Loaded, Measure, Tensor, ball_volume, cell_fractions, segment_fraction};
use crate::bonds::{Bonds, LatticeBonds};
use crate::potential::KernelFit;
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;
use std::collections::BTreeMap;

pub fn piola<const D: usize>(
    bonds: &LatticeBonds<D>,
    state: &Loaded<D>,
    measure: Measure,
    ball: BallVolume,
) -> Vec<Tensor<D>> {
    let sites = bonds.sites();
    let mut sums = vec![[[0.0; D]; D]; sites];
    let window = measure.is_partition().then(|| Averaged::<D>::new(Window::of(measure), bonds.ratio()));
    let (filled, rim) = (blocks(sites, bonds.particles()), rim(bonds, state, measure));
    let mut shared = Shared::new(sites, bonds.occupancy(), &rim);
    let mut alike = BTreeMap::new();
    // one direction of every bond; the other adds the same f ⊗ ξ, which the factor ½ of the definition undoes
    for k in 0..bonds.stencil().offsets.len() / 2 {
        let offset = bonds.stencil().offsets[k];
        let taps = taps(bonds, offset, measure, window.as_ref(), &mut alike);
        let edge = offset.map(|o| f64::from(o) * bonds.lattice().spacing);
        shared
            .set(bonds.shift(offset), &filled, &taps, |start, out| bond_forces(bonds, state, k, start, out));
        shared.add(&taps, &filled, edge, &mut sums);
    }
    let volumes = volumes(bonds, state, measure, ball, window.as_ref());
    let particles = bonds.particles().iter().zip(volumes);
    particles.map(|(&site, volume)| sums[site as usize].map(|row| row.map(|sum| sum / volume))).collect()
}

/// f V_I V_J, N, of bond `k` from a block of sites; zero where it is not intact.
fn bond_forces<const D: usize>(
    bonds: &LatticeBonds<D>,
    state: &Loaded<D>,
    k: usize,
    start: usize,
    mut out: [&mut [f64]; D],
) {
    let (offset, count) = (bonds.stencil().offsets[k], out[0].len());
    let bond = offset.map(|o| f64::from(o) * bonds.lattice().spacing);
    let square: f64 = bond.iter().map(|x| x * x).sum();
    let (volume, length) = (bonds.lattice().volume, square.sqrt());
    let mut scale = [0.0; BLOCK];
    for (index, scale) in scale[..count].iter_mut().enumerate() {
        if bonds.is_intact(start + index, k) {
            let weight = bonds.weight(start + index, k) * volume;
            *scale = 2.0 * state.modulus * weight * volume / length;
        }
    }
    let there = start.wrapping_add_signed(bonds.shift(offset));
    // rows are padded: a bond that leaves the storage is never intact
    if there.checked_add(count).is_none_or(|end| end > bonds.sites()) {
        out.iter_mut().for_each(|out| out.fill(0.0));
        return;
    }
    let ends = state.displacement.components().map(|u| [&u[start..start + count], &u[there..there + count]]);
    Arch::new().dispatch(Pull { fit: state.fit, bond, square, scale: &scale, ends, out });
}

/// scale·q(e) ζ of a block of bonds, from the displacements of both ends.
struct Pull<'a, const D: usize> {
    fit: &'a KernelFit,
    bond: [f64; D],
    square: f64,
    scale: &'a [f64; BLOCK],
    ends: [[&'a [f64]; 2]; D],
    out: [&'a mut [f64]; D],
}

impl<const D: usize> NullaryFnOnce for Pull<'_, D> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        let count = self.out[0].len();
        let mut q = [0.0; BLOCK];
        for d in 0..D {
            let [own, other] = self.ends[d];
            for k in 0..count {
                let eta = other[k] - own[k];
                q[k] += eta * (2.0 * self.bond[d] + eta);
            }
        }
        for q in &mut q {
            *q /= self.square;
        }
        self.fit.values(&mut q);
        for d in 0..D {
            let ([own, other], out) = (self.ends[d], &mut *self.out[d]);
            for k in 0..count {
                let force = self.scale[k] * q[k] * (self.bond[d] + (other[k] - own[k]));
                out[k] = if self.scale[k] == 0.0 { 0.0 } else { force };
            }
        }
    }
}

/// Bond functions of offsets that are the same but for order and signs of their components.
type Alike<const D: usize> = BTreeMap<[i32; D], Vec<([i32; D], f64)>>;

/// The bond function of an offset, from that of the one with ascending components, none of them negative.
fn bond_function<const D: usize>(
    window: &Averaged<D>,
    offset: [i32; D],
    alike: &mut Alike<D>,
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

/// The weights of a stencil bond for a measure.
fn taps<const D: usize>(
    bonds: &LatticeBonds<D>,
    offset: [i32; D],
    measure: Measure,
    window: Option<&Averaged<D>>,
    alike: &mut Alike<D>,
) -> Vec<Tap> {
    let weights = match (measure, window) {
        (Measure::OnePoint, _) => vec![([0; D], 0.5), (offset.map(|o| -o), 0.5)],
        (Measure::HardyScaled, _) => {
            let mut weights = crossing(bonds.ratio(), offset, measure);
            normalise(&mut weights);
            weights
        }
        (_, Some(window)) => bond_function(window, offset, alike),
        _ => crossing(bonds.ratio(), offset, measure),
    };
    weights.into_iter().map(|(start, weight)| Tap { shift: bonds.shift(start), weight }).collect()
}

/// Where a bond begins that crosses the ball about a particle, and the part of it inside (as printed: ½ with both ends there).
fn crossing<const D: usize>(ratio: f64, offset: [i32; D], measure: Measure) -> Vec<([i32; D], f64)> {
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
                Measure::AsPublished if norm(p) < square && norm(q) < square => 0.5,
                Measure::AsPublished => 0.0,
                _ => segment_fraction(p, q, square),
            };
            (weight > 0.0).then_some((start, weight))
        })
        .collect()
}

/// The sites of particles so near a surface that bonds of their windows are missing, where existing ones make up for them.
fn rim<const D: usize>(bonds: &LatticeBonds<D>, state: &Loaded<D>, measure: Measure) -> Vec<u32> {
    let wanted = |site: usize| match measure {
        Measure::HardyBonds => true,
        Measure::HardyWindow => false,
        _ => measure.is_partition() && !state.missing.is_window(site),
    };
    // no bond that crosses a window begins farther away
    let reach = (bonds.ratio() + 0.5).floor() as i32 + bonds.ratio().floor() as i32;
    // axis by axis: whether all within reach along it, and along those before, are occupied
    let mut whole = bonds.occupancy();
    for d in 0..D {
        let mut offset = [0; D];
        offset[d] = 1;
        let stride = bonds.shift(offset);
        let full = |site: usize| {
            let at = |k: i32| site.wrapping_add_signed(k as isize * stride);
            (-reach..=reach).all(|k| whole.get(at(k)).copied().unwrap_or(false))
        };
        let next: Vec<bool> =
            (0..whole.len()).into_par_iter().map(|site| whole[site] && full(site)).collect();
        whole = next;
    }
    let particles = bonds.particles().iter().copied();
    particles.filter(|&s| !whole[s as usize] && wanted(s as usize)).collect()
}

/// What the sum over bonds is divided by, particle by particle.
fn volumes<const D: usize>(
    bonds: &LatticeBonds<D>,
    state: &Loaded<D>,
    measure: Measure,
    ball: BallVolume,
    window: Option<&Averaged<D>>,
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
        (Measure::BallShare, BallVolume::Particles, _) => (sites(), whole),
        (Measure::BallShare, BallVolume::Cells, _) => (cell_fractions::<D>(bonds.ratio()), whole),
        (Measure::OnePoint, ..) => (Vec::new(), lattice.volume),
        (Measure::HardyScaled, ..) => (sites(), lattice.volume),
        (_, _, Some(window)) => (window.cells(), lattice.volume),
        _ => (Vec::new(), whole),
    };
    let shared = |site: usize| match measure {
        Measure::HardyWindow => true,
        Measure::HardyBonds => false,
        _ => !measure.is_partition() || state.missing.is_window(site),
    };
    shares(bonds, &cells, shared).into_iter().map(|s| s * volume).collect()
}

/// Sum of the shares of the occupied cells around each particle; 1 where none is wanted or none is given.
fn shares<const D: usize>(
    bonds: &LatticeBonds<D>,
    cells: &[([i32; D], f64)],
    wanted: impl Fn(usize) -> bool + Sync,
) -> Vec<f64> {
    let occupied = bonds.occupancy();
    bonds
        .particles()
        .par_iter()
        .map(|&site| {
            if cells.is_empty() || !wanted(site as usize) {
                return 1.0;
            }
            let cell = bonds.cell_of(site as usize);
            cells
                .iter()
                .filter(|(offset, _)| {
                    cell.and_then(|c| bonds.cell_at(c, *offset)).is_some_and(|s| occupied[s])
                })
                .map(|c| c.1)
                .sum()
        })
        .collect()
}
