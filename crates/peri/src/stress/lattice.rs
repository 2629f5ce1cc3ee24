//! On a lattice the bond function depends on offsets only: each measure is, bond by bond of the stencil, a convolution
//! of that bond's forces with fixed weights.

use super::{
    BallVolume, Loaded, Measure, Tensor, ball_volume, cell_fractions, force_over_length, segment_fraction,
};
use crate::bonds::{Bonds, LatticeBonds};
use crate::field::{Field, chunk_range};
use pulp::Arch;
use rayon::prelude::*;

/// Where a bond must begin, relative to the point of interest, and the weight with which it counts there.
struct Tap {
    shift: isize,
    weight: f64,
}

pub fn piola<const D: usize>(
    bonds: &LatticeBonds<D>,
    state: &Loaded<D>,
    measure: Measure,
    ball: BallVolume,
) -> Vec<Tensor<D>> {
    let slots = bonds.slots();
    let mut columns: [Field<D>; D] = std::array::from_fn(|_| Field::zeros(slots));
    let mut forces = Field::zeros(slots);
    let mut averages = Field::zeros(slots);
    // one direction of every bond; the other adds the same f ⊗ ξ, which the factor ½ of the definition undoes
    for k in 0..bonds.stencil().offsets.len() / 2 {
        let offset = bonds.stencil().offsets[k];
        bond_forces(bonds, state, k, &mut forces);
        let taps = taps(bonds, offset, measure);
        convolve(&forces, &taps, &mut averages);
        let spacing = bonds.lattice().spacing;
        for d in (0..D).filter(|&d| offset[d] != 0) {
            let edge = f64::from(offset[d]) * spacing;
            accumulate(&averages, edge, &mut columns[d]);
        }
    }
    let volumes = volumes(bonds, measure, ball);
    let particles = bonds.particles().iter().zip(volumes);
    particles
        .map(|(&slot, volume)| {
            let columns: [[f64; D]; D] = std::array::from_fn(|b| columns[b].get(slot as usize));
            std::array::from_fn(|a| std::array::from_fn(|b| columns[b][a] / volume))
        })
        .collect()
}

/// f V_I V_J, N, of bond `k` from every slot; zero where it is not intact.
fn bond_forces<const D: usize>(bonds: &LatticeBonds<D>, state: &Loaded<D>, k: usize, forces: &mut Field<D>) {
    let offset = bonds.stencil().offsets[k];
    let shift = bonds.shift(offset);
    let bond = offset.map(|o| f64::from(o) * bonds.lattice().spacing);
    let volume = bonds.lattice().volume;
    forces.chunks_mut().into_par_iter().enumerate().for_each(|(chunk, out)| {
        for (index, slot) in chunk_range(chunk, bonds.slots()).enumerate() {
            let mut force = [0.0; D];
            if bonds.is_intact(slot, k) {
                let (own, other) =
                    (state.displacement.get(slot), state.displacement.get(slot.wrapping_add_signed(shift)));
                let eta: [f64; D] = std::array::from_fn(|d| other[d] - own[d]);
                let weight = bonds.weight(slot, k) * volume;
                let scale = force_over_length(state.fit, state.modulus, weight, volume, bond, eta);
                force = std::array::from_fn(|d| scale * (bond[d] + eta[d]));
            }
            for d in 0..D {
                out[d][index] = force[d];
            }
        }
    });
}

/// The weights of a stencil bond for a measure.
fn taps<const D: usize>(bonds: &LatticeBonds<D>, offset: [i32; D], measure: Measure) -> Vec<Tap> {
    let ratio = bonds.horizon() / bonds.lattice().spacing;
    let square = ratio * ratio;
    if measure == Measure::OnePoint {
        return vec![Tap { shift: 0, weight: 0.5 }, Tap { shift: -bonds.shift(offset), weight: 0.5 }];
    }
    let reach = 2 * ratio.ceil() as i32;
    let side = (2 * reach + 1) as usize;
    (0..side.pow(D as u32))
        .filter_map(|index| {
            let start: [i32; D] = std::array::from_fn(|d| (index / side.pow(d as u32) % side) as i32 - reach);
            let p = start.map(f64::from);
            let q = std::array::from_fn(|d| p[d] + f64::from(offset[d]));
            let norm = |x: [f64; D]| x.iter().map(|c| c * c).sum::<f64>();
            let weight = match measure {
                Measure::Printed if norm(p) < square && norm(q) < square => 0.5,
                Measure::Printed => 0.0,
                _ => segment_fraction(p, q, square),
            };
            (weight > 0.0).then(|| Tap { shift: bonds.shift(start), weight })
        })
        .collect()
}

/// averages(p) = Σ weight·forces(p + shift); nothing lies beyond the ends.
fn convolve<const D: usize>(forces: &Field<D>, taps: &[Tap], averages: &mut Field<D>) {
    let slots = forces.slots();
    let forces = forces.components();
    averages.chunks_mut().into_par_iter().enumerate().for_each(|(chunk, out)| {
        let range = chunk_range(chunk, slots);
        for (d, out) in out.into_iter().enumerate() {
            out.fill(0.0);
            for tap in taps {
                let low = range.start as isize + tap.shift;
                let skip = (-low).max(0) as usize;
                let end = (range.end as isize + tap.shift).clamp(0, slots as isize) as usize;
                let begin = low.max(0) as usize;
                if begin < end && skip < out.len() {
                    add_scaled(&mut out[skip..], &forces[d][begin..end], tap.weight);
                }
            }
        }
    });
}

/// out += factor·values over the shorter of both.
fn add_scaled(out: &mut [f64], values: &[f64], factor: f64) {
    Arch::new().dispatch(|| {
        for (o, v) in out.iter_mut().zip(values) {
            *o += factor * v;
        }
    });
}

fn accumulate<const D: usize>(averages: &Field<D>, edge: f64, column: &mut Field<D>) {
    let slots = averages.slots();
    let averages = averages.components();
    column.chunks_mut().into_par_iter().enumerate().for_each(|(chunk, out)| {
        for (d, out) in out.into_iter().enumerate() {
            add_scaled(out, &averages[d][chunk_range(chunk, slots)], edge);
        }
    });
}

/// What the sum over bonds is divided by, particle by particle.
fn volumes<const D: usize>(bonds: &LatticeBonds<D>, measure: Measure, ball: BallVolume) -> Vec<f64> {
    let lattice = bonds.lattice();
    let thickness = lattice.volume / lattice.spacing.powi(D as i32);
    let whole = ball_volume(D, bonds.horizon()) * thickness;
    let count = bonds.particles().len();
    match (measure, ball) {
        (Measure::OnePoint, _) => vec![lattice.volume; count],
        (Measure::Printed, _) | (_, BallVolume::Whole) => vec![whole; count],
        (Measure::Hardy, BallVolume::Particles) => {
            let offsets = &bonds.stencil().offsets;
            let share = 1.0 / (offsets.len() + 1) as f64;
            let all = offsets.iter().copied().chain([[0; D]]).map(|o| (o, share));
            shares(bonds, &all.collect::<Vec<_>>()).into_iter().map(|s| s * whole).collect()
        }
        (Measure::Hardy, BallVolume::Cells) => {
            let cells = cell_fractions::<D>(bonds.horizon() / lattice.spacing);
            shares(bonds, &cells).into_iter().map(|s| s * whole).collect()
        }
    }
}

/// Sum of the shares of the occupied cells around each particle.
fn shares<const D: usize>(bonds: &LatticeBonds<D>, cells: &[([i32; D], f64)]) -> Vec<f64> {
    let occupied = bonds.occupancy();
    bonds
        .particles()
        .par_iter()
        .map(|&slot| {
            let cell = bonds.cell_of(slot as usize);
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
