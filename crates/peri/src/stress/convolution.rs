//! Bonds of one offset, distributed over the sites whose windows they cross: sums with fixed weights, a block
//! of sites at a time.

use super::StressTensor;
use crate::bonds::TILE;
use crate::field::CHUNK;
use crate::parallel;
use pulp::{Arch, Simd, WithSimd};
use std::collections::BTreeMap;

/// Numbers summed at a time in registers: a block.
const BLOCK: usize = 64;

/// Most taps for which vectors are loaded once.
const RUN: usize = 6;

/// Numbers per site: the force, and in solids 1 if both particles of the bond exist, which fills a vector of
/// four. That is always aligned, wherever the bond begins; vectors of neighbouring sites cross cache lines at
/// nearly every shift. In a plane a fourth number would be wasted, and a third is needed near surfaces only.
pub const fn lanes<const D: usize>() -> usize {
    if D == 2 { 2 } else { 4 }
}

/// Sites per block.
const fn sites_of_block<const D: usize>() -> usize {
    BLOCK / lanes::<D>()
}

/// Start of a bond relative to the point of interest, and its weight there.
pub struct Tap {
    /// Distance in sites.
    pub shift: isize,
    /// Weight of the bond.
    pub weight: f64,
}

/// Taps of which each reads the vectors of the previous one from the second on: the contents of V + N − 1
/// vectors serve N taps.
struct TapRun {
    /// Shift of the first tap.
    shift: isize,
    weights: [f64; RUN],
}

/// Taps grouped in runs of one, two, … [`RUN`].
type TapRuns = [Vec<TapRun>; RUN];

/// Groups the taps of a bond in runs, with `width` numbers per vector and `lanes` per site.
fn runs(taps: &[Tap], width: usize, lanes: usize) -> TapRuns {
    // vectors smaller than a site do not overlap like this
    let (ahead, most) = if width < lanes { (1, 1) } else { ((width / lanes) as isize, RUN) };
    let mut left = BTreeMap::new();
    taps.iter().for_each(|tap| *left.entry(tap.shift).or_insert(0.0) += tap.weight);
    let mut runs: TapRuns = Default::default();
    while let Some((shift, first)) = left.pop_first() {
        let (mut weights, mut count) = ([0.0; RUN], 1);
        weights[0] = first;
        while count < most
            && let Some(weight) = left.remove(&(shift + count as isize * ahead))
        {
            weights[count] = weight;
            count += 1;
        }
        runs[count - 1].push(TapRun { shift, weights });
    }
    runs
}

/// Number of lanes of a vector on this machine.
struct Width;

impl WithSimd for Width {
    type Output = usize;
    fn with_simd<S: Simd>(self, _simd: S) -> usize {
        S::F64_LANES
    }
}

/// Marks the tiles that hold any of the given sites.
pub fn tiles(sites: usize, of: &[u32]) -> Vec<bool> {
    let mut filled = vec![false; sites.div_ceil(TILE)];
    of.iter().for_each(|&site| filled[site as usize / TILE] = true);
    filled
}

/// Numbers of all sites, aligned to a cache line.
struct Aligned {
    numbers: Vec<f64>,
    first: usize,
}

impl Aligned {
    fn zeros(count: usize) -> Self {
        let numbers = vec![0.0; count + 8];
        let first = numbers.as_ptr().align_offset(64).min(8);
        Self { numbers, first }
    }

    fn get(&self) -> &[f64] {
        &self.numbers[self.first..]
    }

    fn get_mut(&mut self) -> &mut [f64] {
        &mut self.numbers[self.first..]
    }
}

/// Bonds of one offset from every site.
pub struct OffsetBonds<const D: usize> {
    sites: usize,
    /// Number of zeros before and behind the sites: whole chunks.
    margin: usize,
    /// [`lanes`] numbers per site.
    forces: Aligned,
    /// 1 for sites with a particle.
    occupied: Vec<f64>,
    /// Tiles with particles.
    filled: Vec<bool>,
    /// Distance from a bond's site to its other one.
    shift: isize,
}

impl<const D: usize> OffsetBonds<D> {
    /// Allocates storage without bonds. No tap reaches farther than `reach` sites, no bond farther than
    /// `bond`.
    pub fn new(occupied: &[bool], filled: Vec<bool>, reach: usize, bond: usize) -> Self {
        let (sites, margin) = (occupied.len(), (reach + bond).next_multiple_of(CHUNK));
        let stored = sites.next_multiple_of(CHUNK) + 2 * margin;
        let mut there = vec![0.0; stored];
        occupied.iter().zip(&mut there[margin..]).for_each(|(&is, there)| *there = f64::from(u8::from(is)));
        let forces = Aligned::zeros(stored * lanes::<D>());
        Self { sites, margin, forces, occupied: there, filled, shift: 0 }
    }

    /// Sets the bonds to the sites `shift` farther on; `force` writes their forces for a chunk from a site
    /// on, in the tiles that have particles ([`lanes`] numbers per site).
    pub fn set(&mut self, shift: isize, force: impl Fn(usize, &[bool], &mut [f64]) + Sync) {
        self.shift = shift;
        let lanes = lanes::<D>();
        let (filled, margin, occupied) = (&self.filled, self.margin, &self.occupied);
        let stored = &mut self.forces.get_mut()[margin * lanes..][..self.sites * lanes];
        let tiles = CHUNK / TILE;
        parallel::for_chunks(stored, CHUNK * lanes, |chunk, stored| {
            let start = chunk * CHUNK;
            let filled = &filled[chunk * tiles..filled.len().min((chunk + 1) * tiles)];
            force(start, filled, stored);
            if D < lanes {
                let here = &occupied[margin + start..];
                let there = &occupied[(margin + start).wrapping_add_signed(shift)..];
                for ((site, here), there) in stored.chunks_exact_mut(lanes).zip(here).zip(there) {
                    site[D] = here * there;
                }
            }
        });
    }

    /// Adds the bonds' averages by a measure's taps ⊗ edge to its sums.
    pub fn add(&self, taps: &[Tap], edge: [f64; D], to: &mut ShareSums<D>) {
        let arch = Arch::new();
        let width = arch.dispatch(Width);
        let apart = D == lanes::<D>() && to.rim.contains(&true);
        let runs =
            [runs(taps, width, lanes::<D>()), if apart { runs(taps, width, 1) } else { TapRuns::default() }];
        let ShareSums { sums, completed, rim } = to;
        let sums = &mut sums.get_mut()[..self.sites.next_multiple_of(CHUNK) * lanes::<D>() * D];
        parallel::for_chunks(sums, CHUNK * lanes::<D>() * D, |chunk, sums| {
            let start = chunk * CHUNK;
            arch.dispatch(ConvolutionChunk { shared: self, runs: &runs, completed, rim, start, edge, sums });
        });
    }
}

/// Sums of a measure, site by site.
pub struct ShareSums<const D: usize> {
    /// Block by block, for each component of the edge [`lanes`] numbers per site.
    sums: Aligned,
    /// 1 in sites whose averages are divided by the weights of the bonds whose two particles exist; and their
    /// tiles.
    completed: Vec<bool>,
    rim: Vec<bool>,
}

impl<const D: usize> ShareSums<D> {
    /// Allocates zero sums; `rim` are the sites whose averages are completed.
    pub fn new(sites: usize, rim: &[u32]) -> Self {
        let stored = sites.next_multiple_of(CHUNK);
        let mut completed = vec![false; stored];
        rim.iter().for_each(|&site| completed[site as usize] = true);
        Self { sums: Aligned::zeros(stored * lanes::<D>() * D), completed, rim: tiles(stored, rim) }
    }

    /// The sum of a site.
    pub fn get(&self, site: usize) -> StressTensor<D> {
        let (block, site) = (site / sites_of_block::<D>(), site % sites_of_block::<D>());
        let sums = &self.sums.get()[block * BLOCK * D..];
        std::array::from_fn(|a| std::array::from_fn(|b| sums[b * BLOCK + site * lanes::<D>() + a]))
    }
}

/// Runs [`OffsetBonds::add`] over a chunk.
struct ConvolutionChunk<'a, const D: usize> {
    shared: &'a OffsetBonds<D>,
    /// Taps for the numbers of the bonds, and in a plane for their existence.
    runs: &'a [TapRuns; 2],
    completed: &'a [bool],
    rim: &'a [bool],
    start: usize,
    edge: [f64; D],
    sums: &'a mut [f64],
}

impl<const D: usize> WithSimd for ConvolutionChunk<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (sites, tiles) = (sites_of_block::<D>(), sites_of_block::<D>() / TILE);
        let mut edge = [simd.splat_f64s(0.0); D];
        for d in 0..D {
            edge[d] = simd.splat_f64s(self.edge[d]);
        }
        for block in 0..self.sums.len() / (BLOCK * D) {
            let start = self.start + block * sites;
            let (mut filled, mut rim) = (false, false);
            for tile in start / TILE..start / TILE + tiles {
                filled |= tile < self.shared.filled.len() && self.shared.filled[tile];
                rim |= self.rim[tile];
            }
            if !filled {
                continue;
            }
            let mut averages = [0.0; BLOCK];
            // eight sums at a time hide the latency of additions and leave registers for the rest
            self.average::<S, 8>(simd, start, &mut averages);
            if rim {
                self.complete(simd, start, &mut averages);
            }
            let averages = S::as_simd_f64s(&averages).0;
            for d in 0..D {
                let sums = &mut self.sums[(block * D + d) * BLOCK..][..BLOCK];
                let sums = S::as_mut_simd_f64s(sums).0;
                for v in 0..BLOCK / S::F64_LANES {
                    sums[v] = simd.mul_add_f64s(averages[v], edge[d], sums[v]);
                }
            }
        }
    }
}

impl<const D: usize> ConvolutionChunk<'_, D> {
    /// Σ weight·number over the taps, V vectors at a time.
    #[inline(always)]
    fn average<S: Simd, const V: usize>(&self, simd: S, start: usize, averages: &mut [f64; BLOCK]) {
        let (lanes, width) = (lanes::<D>(), V * S::F64_LANES);
        let source = TapSource { numbers: self.shared.forces.get(), lanes, bond: 0 };
        for part in 0..BLOCK / width {
            let here = (self.shared.margin + start) * lanes + part * width;
            let sums = source.total::<S, V, false>(simd, &self.runs[0], here);
            let out = &mut S::as_mut_simd_f64s(&mut averages[part * width..][..width]).0[..V];
            #[expect(clippy::manual_memcpy, reason = "a slice of the sums would keep them in memory")]
            for v in 0..V {
                out[v] = sums[v];
            }
        }
    }

    /// Divides the averages of completed sites by the weights of the bonds that exist.
    #[inline(always)]
    fn complete<S: Simd>(&self, simd: S, start: usize, averages: &mut [f64; BLOCK]) {
        let (lanes, sites) = (lanes::<D>(), sites_of_block::<D>());
        let mut weights = [0.0; BLOCK];
        if D < lanes {
            for k in 0..sites {
                weights[k] = averages[k * lanes + D];
            }
        } else {
            self.existing::<S, 4>(simd, start, &mut weights[..sites]);
        }
        for k in 0..sites {
            // where no such bond exists, the average is zero
            if self.completed[start + k] && weights[k] > 0.0 {
                for lane in 0..D {
                    averages[k * lanes + lane] /= weights[k];
                }
            }
        }
    }

    /// Computes the weights of the bonds whose two particles exist, V vectors at a time.
    #[inline(always)]
    fn existing<S: Simd, const V: usize>(&self, simd: S, start: usize, weights: &mut [f64]) {
        let OffsetBonds { occupied, shift, margin, .. } = self.shared;
        let (source, width) = (TapSource { numbers: occupied, lanes: 1, bond: *shift }, V * S::F64_LANES);
        for part in 0..weights.len() / width {
            let sums = source.total::<S, V, true>(simd, &self.runs[1], margin + start + part * width);
            let out = &mut S::as_mut_simd_f64s(&mut weights[part * width..][..width]).0[..V];
            #[expect(clippy::manual_memcpy, reason = "a slice of the sums would keep them in memory")]
            for v in 0..V {
                out[v] = sums[v];
            }
        }
    }
}

/// Numbers weighted by taps, or the products of those at a bond's two ends.
struct TapSource<'a> {
    numbers: &'a [f64],
    /// Numbers per site.
    lanes: usize,
    /// Sites from one end to the other.
    bond: isize,
}

impl TapSource<'_> {
    /// Sums over all taps of V vectors from the number `here` on.
    #[inline(always)]
    fn total<S: Simd, const V: usize, const ENDS: bool>(
        &self,
        simd: S,
        runs: &TapRuns,
        here: usize,
    ) -> [S::f64s; V] {
        let mut sums = [simd.splat_f64s(0.0); V];
        sums = self.sum::<S, V, 6, ENDS>(simd, runs, here, sums);
        sums = self.sum::<S, V, 5, ENDS>(simd, runs, here, sums);
        sums = self.sum::<S, V, 4, ENDS>(simd, runs, here, sums);
        sums = self.sum::<S, V, 3, ENDS>(simd, runs, here, sums);
        sums = self.sum::<S, V, 2, ENDS>(simd, runs, here, sums);
        self.sum::<S, V, 1, ENDS>(simd, runs, here, sums)
    }

    /// Adds the runs of N taps.
    #[inline(always)]
    fn sum<S: Simd, const V: usize, const N: usize, const ENDS: bool>(
        &self,
        simd: S,
        runs: &TapRuns,
        here: usize,
        mut sums: [S::f64s; V],
    ) -> [S::f64s; V] {
        for run in &runs[N - 1] {
            let from = here.wrapping_add_signed(run.shift * self.lanes as isize);
            let count = (V + N - 1) * S::F64_LANES;
            let values = &S::as_simd_f64s(&self.numbers[from..from + count]).0[..V + N - 1];
            let from = if ENDS { from.wrapping_add_signed(self.bond * self.lanes as isize) } else { from };
            let ends = &S::as_simd_f64s(&self.numbers[from..from + count]).0[..V + N - 1];
            let mut weights = [simd.splat_f64s(0.0); N];
            for i in 0..N {
                weights[i] = simd.splat_f64s(run.weights[i]);
            }
            for i in 0..N {
                for v in 0..V {
                    let value = if ENDS { simd.mul_f64s(values[v + i], ends[v + i]) } else { values[v + i] };
                    sums[v] = simd.mul_add_f64s(weights[i], value, sums[v]);
                }
            }
        }
        sums
    }
}
