//! The bonds of one type, shared out among the sites whose windows they cross: sums with fixed weights, a block of sites at
//! a time.

use super::Tensor;
use crate::field::CHUNK;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Sites that are summed at a time, in registers.
pub const BLOCK: usize = 16;
/// Numbers a site: the force, and 1 where both particles of the bond exist. Together they fill a vector of four, which
/// is always aligned, wherever the bond begins; vectors of neighbouring sites cross cache lines at nearly every shift.
const LANES: usize = 4;

/// Where a bond must begin, relative to the point of interest, and the weight with which it counts there.
pub struct Tap {
    /// In sites.
    pub shift: isize,
    /// Its share.
    pub weight: f64,
}

/// Which blocks of sites hold any of those given.
pub fn blocks(sites: usize, of: &[u32]) -> Vec<bool> {
    let mut filled = vec![false; sites.div_ceil(BLOCK)];
    of.iter().for_each(|&site| filled[site as usize / BLOCK] = true);
    filled
}

/// The bonds of one type from every site.
pub struct Shared {
    sites: usize,
    /// [`LANES`] numbers a site from `first` on; a margin of zeros before and behind the sites, whole chunks of them.
    bonds: Vec<f64>,
    first: usize,
    margin: usize,
    /// 1 where there is a particle.
    occupied: Vec<f64>,
    /// Sites whose averages are divided by the weights of the bonds whose two particles exist, and their blocks.
    completed: Vec<bool>,
    rim: Vec<bool>,
}

impl Shared {
    /// No bonds yet; `rim` are the sites whose averages are completed.
    pub fn new(sites: usize, occupied: Vec<bool>, rim: &[u32]) -> Self {
        let mut completed = vec![false; sites];
        rim.iter().for_each(|&site| completed[site as usize] = true);
        let occupied = occupied.into_iter().map(|there| f64::from(u8::from(there))).collect();
        let rim = blocks(sites, rim);
        Self { sites, bonds: Vec::new(), first: 0, margin: 0, occupied, completed, rim }
    }

    /// Takes the bonds to the sites `shift` farther on, whose forces `force` writes for the block from a site on, in the
    /// blocks that are `filled`.
    pub fn set<const D: usize>(
        &mut self,
        shift: isize,
        filled: &[bool],
        taps: &[Tap],
        force: impl Fn(usize, [&mut [f64]; D]) + Sync,
    ) {
        let reach = taps.iter().map(|tap| tap.shift.unsigned_abs()).max().unwrap_or(0);
        if self.bonds.is_empty() || reach > self.margin {
            self.margin = reach.next_multiple_of(CHUNK);
            let stored = self.sites.next_multiple_of(BLOCK) + 2 * self.margin;
            self.bonds = vec![0.0; (stored + 2) * LANES];
            self.first = self.bonds.as_ptr().align_offset(64).min(2 * LANES);
        }
        let (sites, occupied) = (self.sites, &self.occupied);
        let stored = &mut self.bonds[self.first + self.margin * LANES..][..sites * LANES];
        stored.par_chunks_mut(CHUNK * LANES).enumerate().for_each(|(chunk, stored)| {
            for (block, stored) in stored.chunks_mut(BLOCK * LANES).enumerate() {
                let start = chunk * CHUNK + block * BLOCK;
                if !filled[start / BLOCK] {
                    continue;
                }
                let mut forces = [[0.0; BLOCK]; D];
                force(start, forces.each_mut().map(|force| &mut force[..stored.len() / LANES]));
                for (index, stored) in stored.chunks_exact_mut(LANES).enumerate() {
                    let site = start + index;
                    let there = occupied.get(site.wrapping_add_signed(shift)).copied();
                    for d in 0..D {
                        stored[d] = forces[d][index];
                    }
                    stored[D] = occupied[site] * there.unwrap_or(0.0);
                }
            }
        });
    }

    /// sums += (Σ weight·force over the taps of a bond) ⊗ edge, site by site.
    pub fn add<const D: usize>(&self, taps: &[Tap], filled: &[bool], edge: [f64; D], sums: &mut [Tensor<D>]) {
        let arch = Arch::new();
        sums.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, sums)| {
            for (block, sums) in sums.chunks_mut(BLOCK).enumerate() {
                let start = chunk * CHUNK + block * BLOCK;
                if filled[start / BLOCK] {
                    arch.dispatch(Block { shared: self, taps, start, edge, sums });
                }
            }
        });
    }
}

/// A block of [`Shared::add`].
struct Block<'a, const D: usize> {
    shared: &'a Shared,
    taps: &'a [Tap],
    start: usize,
    edge: [f64; D],
    sums: &'a mut [Tensor<D>],
}

impl<const D: usize> WithSimd for Block<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut averages = [0.0; BLOCK * LANES];
        // eight sums at a time hide the latency of additions, and leave registers for the rest
        self.average::<S, 8>(simd, &mut averages);
        let rim = self.shared.rim[self.start / BLOCK];
        let completed = &self.shared.completed[self.start..][..self.sums.len()];
        let averages = averages.as_chunks::<LANES>().0;
        for ((sum, average), completed) in self.sums.iter_mut().zip(averages).zip(completed) {
            // where no such bond exists, the average is zero
            let scale = if rim && *completed && average[D] > 0.0 { 1.0 / average[D] } else { 1.0 };
            for a in 0..D {
                for b in 0..D {
                    sum[a][b] += scale * average[a] * self.edge[b];
                }
            }
        }
    }
}

impl<const D: usize> Block<'_, D> {
    /// Σ weight·number over the taps, V vectors at a time.
    #[inline(always)]
    fn average<S: Simd, const V: usize>(&self, simd: S, averages: &mut [f64; BLOCK * LANES]) {
        let Shared { bonds, first, margin, .. } = self.shared;
        let width = V * S::F64_LANES;
        for (part, out) in averages.chunks_mut(width).enumerate() {
            let here = first + (margin + self.start) * LANES + part * width;
            let mut sums = [simd.splat_f64s(0.0); V];
            for tap in self.taps {
                let from = here.wrapping_add_signed(tap.shift * LANES as isize);
                let values = &S::as_simd_f64s(&bonds[from..from + width]).0[..V];
                let weight = simd.splat_f64s(tap.weight);
                for v in 0..V {
                    sums[v] = simd.mul_add_f64s(weight, values[v], sums[v]);
                }
            }
            let out = &mut S::as_mut_simd_f64s(out).0[..V];
            #[expect(clippy::manual_memcpy, reason = "a slice of the sums would keep them in memory")]
            for v in 0..V {
                out[v] = sums[v];
            }
        }
    }
}
