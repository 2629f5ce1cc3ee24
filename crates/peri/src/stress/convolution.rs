//! The bonds of one type, shared out among the sites whose windows they cross: sums with fixed weights, a block of sites at
//! a time.

use super::Tensor;
use crate::field::CHUNK;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Sites that are summed at a time, in registers.
pub const BLOCK: usize = 16;
/// Numbers a site: the force, and 1 where both particles of the bond exist. Together they fill a vector of four, which
/// is always aligned, wherever the bond begins; vectors of neighbouring sites cross cache lines at nearly every shift.
const LANES: usize = 4;

/// Most taps whose vectors are loaded once for all of them.
const RUN: usize = 4;

/// Where a bond must begin, relative to the point of interest, and the weight with which it counts there.
pub struct Tap {
    /// In sites.
    pub shift: isize,
    /// Its share.
    pub weight: f64,
}

/// Taps of which each reads the vectors of the one before from the second on: what V + N − 1 vectors hold serves N taps.
struct Run {
    /// The first tap's.
    shift: isize,
    weights: [f64; RUN],
}

/// The taps of a bond in runs of one, two, … [`RUN`], where a vector holds `lanes` numbers.
fn runs(taps: &[Tap], lanes: usize) -> [Vec<Run>; RUN] {
    // vectors that hold less than a site do not overlap like this
    let (ahead, most) = if lanes < LANES { (1, 1) } else { ((lanes / LANES) as isize, RUN) };
    let mut left = BTreeMap::new();
    taps.iter().for_each(|tap| *left.entry(tap.shift).or_insert(0.0) += tap.weight);
    let mut runs: [Vec<Run>; RUN] = Default::default();
    while let Some((shift, first)) = left.pop_first() {
        let (mut weights, mut count) = ([0.0; RUN], 1);
        weights[0] = first;
        while count < most
            && let Some(weight) = left.remove(&(shift + count as isize * ahead))
        {
            weights[count] = weight;
            count += 1;
        }
        runs[count - 1].push(Run { shift, weights });
    }
    runs
}

/// Numbers in a vector of this machine.
struct Lanes;

impl WithSimd for Lanes {
    type Output = usize;
    fn with_simd<S: Simd>(self, _simd: S) -> usize {
        S::F64_LANES
    }
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
        let runs = &runs(taps, arch.dispatch(Lanes));
        sums.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, sums)| {
            for (block, sums) in sums.chunks_mut(BLOCK).enumerate() {
                let start = chunk * CHUNK + block * BLOCK;
                if filled[start / BLOCK] {
                    arch.dispatch(Block { shared: self, runs, start, edge, sums });
                }
            }
        });
    }
}

/// A block of [`Shared::add`].
struct Block<'a, const D: usize> {
    shared: &'a Shared,
    runs: &'a [Vec<Run>; RUN],
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
        let width = V * S::F64_LANES;
        for (part, out) in averages.chunks_mut(width).enumerate() {
            let here = self.shared.first + (self.shared.margin + self.start) * LANES + part * width;
            let mut sums = [simd.splat_f64s(0.0); V];
            sums = self.sum::<S, V, 4>(simd, here, sums);
            sums = self.sum::<S, V, 3>(simd, here, sums);
            sums = self.sum::<S, V, 2>(simd, here, sums);
            sums = self.sum::<S, V, 1>(simd, here, sums);
            let out = &mut S::as_mut_simd_f64s(out).0[..V];
            #[expect(clippy::manual_memcpy, reason = "a slice of the sums would keep them in memory")]
            for v in 0..V {
                out[v] = sums[v];
            }
        }
    }

    /// Adds the runs of N taps to V vectors from the number `here` on.
    #[inline(always)]
    fn sum<S: Simd, const V: usize, const N: usize>(
        &self,
        simd: S,
        here: usize,
        mut sums: [S::f64s; V],
    ) -> [S::f64s; V] {
        for run in &self.runs[N - 1] {
            let from = here.wrapping_add_signed(run.shift * LANES as isize);
            let bonds = &self.shared.bonds[from..from + (V + N - 1) * S::F64_LANES];
            let values = &S::as_simd_f64s(bonds).0[..V + N - 1];
            let mut weights = [simd.splat_f64s(0.0); N];
            for i in 0..N {
                weights[i] = simd.splat_f64s(run.weights[i]);
            }
            for j in 0..V + N - 1 {
                let value = values[j];
                for i in 0..N {
                    if i <= j && j - i < V {
                        sums[j - i] = simd.mul_add_f64s(weights[i], value, sums[j - i]);
                    }
                }
            }
        }
        sums
    }
}
