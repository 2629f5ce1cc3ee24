//! Sums over the bonds of a lattice other than forces: stretches, energies, gradients; each bond seen from
//! one end.

use super::lattice_kernel::{TILE, TileClass, Tiles};
use crate::potential::{StretchRange, TangentTable};
use pulp::bytemuck::cast_slice;
use pulp::{Arch, NullaryFnOnce, Simd, WithSimd};
use std::ops::Range;

/// A bond of the stencil.
#[derive(Clone, Copy, Debug)]
pub struct Span<const D: usize> {
    /// Distance to the neighbour in sites.
    pub shift: isize,
    /// Reference bond ξ, m.
    pub bond: [f64; D],
    /// |ξ|, m.
    pub length: f64,
    /// Volume correction.
    pub share: f64,
    /// 1/|ξ|².
    pub inverse_square: f64,
}

/// Weights of all particles' bonds of one offset.
pub(crate) struct Weights<'a, const D: usize> {
    /// Weight without surface correction.
    pub share: f64,
    /// Factors g of the surface correction, site by site.
    pub factors: Option<[&'a [f64]; D]>,
    /// Words with the bit `bit` set where the bond is intact, site by site.
    pub words: &'a [u64],
    pub bit: u64,
}

/// A stencil applied to a displacement.
pub struct Spans<'a, const D: usize> {
    /// All bonds of the stencil; bond k and bond (n − 1 − k) are opposite.
    pub spans: &'a [Span<D>],
    /// The storage.
    pub tiles: Tiles<'a, D>,
}

impl<const D: usize> Spans<'_, D> {
    /// Calls `add` for each tile of some sites that holds bonds: with its first site, and the bonds among the
    /// first `count` of the stencil that any of its particles has.
    #[inline(always)]
    fn tiles<A: Add<D>>(&self, sites: Range<usize>, count: usize, add: &mut A) {
        let mut present = Vec::with_capacity(count);
        for base in sites.step_by(TILE).filter(|base| self.tiles.classes[base / TILE] != TileClass::Empty) {
            present.clear();
            for (word, words) in self.tiles.intact.iter().enumerate() {
                let mut any = words[base..base + TILE].iter().fold(0, |any, bits| any | bits);
                while any != 0 {
                    present.push(64 * word + any.trailing_zeros() as usize);
                    any &= any - 1;
                }
            }
            let end = present.partition_point(|&k| k < count);
            add.tile(self, base, &present[..end]);
        }
    }

    /// Computes e = λ² − 1 of bond k of each particle of a tile; 0 if broken.
    #[inline(always)]
    fn elongations(&self, base: usize, k: usize) -> [f64; TILE] {
        let span = &self.spans[k];
        let there = base.wrapping_add_signed(span.shift);
        let mut out = [0.0; TILE];
        for d in 0..D {
            let displacement = self.tiles.displacement[d];
            let (own, other) = (&displacement[base..base + TILE], &displacement[there..there + TILE]);
            for i in 0..TILE {
                let eta = other[i] - own[i];
                out[i] += eta * (2.0 * span.bond[d] + eta);
            }
        }
        let words = &self.tiles.intact[k / 64][base..base + TILE];
        for i in 0..TILE {
            // all bits of the mask: a condition would branch for each particle
            let present = 0_u64.wrapping_sub(words[i] >> (k % 64) & 1);
            out[i] = f64::from_bits((out[i] * span.inverse_square).to_bits() & present);
        }
        out
    }

    /// Computes the extremes of e over the bonds that begin in these sites, of one direction each.
    pub fn range(&self, sites: Range<usize>) -> StretchRange {
        let mut found = Extremes { low: [0.0; TILE], high: [0.0; TILE] };
        self.sum(sites, self.spans.len() / 2, &mut found);
        let Extremes { low, high } = found;
        StretchRange {
            low: low.iter().copied().fold(0.0, f64::min),
            high: high.iter().copied().fold(0.0, f64::max),
        }
    }

    /// Lists the bonds beyond e = `least` that begin in these sites, of one direction each: by site and bond
    /// of the stencil, from both ends.
    pub fn beyond(&self, sites: Range<usize>, least: f64) -> Vec<[u32; 2]> {
        let mut found = BeyondScan { least, bonds: Vec::new() };
        self.sum(sites, self.spans.len() / 2, &mut found);
        found.bonds
    }

    /// Computes Σ share·|ξ|·φ(e) over the bonds that begin in these sites, of one direction each.
    pub fn energy(&self, sites: Range<usize>, energy: impl Fn(f64) -> f64) -> f64 {
        let mut found = Energy { energy, total: 0.0 };
        self.sum(sites, self.spans.len() / 2, &mut found);
        found.total
    }

    /// Computes, for each site of whole tiles, Σ (2 share V/|ξ|)·max(table(e), least)·(1 + max_{d≠e} |n_d
    /// n_e|) over all its bonds, n the direction of the deformed bond.
    pub fn stiffness(&self, sites: Range<usize>, volume: f64, table: &TangentTable, least: f64) -> Vec<f64> {
        let sums = vec![0.0; sites.len()];
        let mut found = Stiffness { first: sites.start, volume, table, least, sums };
        self.sum(sites, self.spans.len(), &mut found);
        found.sums
    }

    /// Computes the sums of each site of whole tiles over all its bonds.
    pub fn gradient_sums(&self, sites: Range<usize>) -> Vec<GradientSums<D>> {
        let mut sums = vec![GradientSums::NONE; sites.len()];
        Arch::new().dispatch(GradientKernel { spans: self, first: sites.start, sums: &mut sums });
        sums
    }

    fn sum<A: Add<D>>(&self, sites: Range<usize>, count: usize, add: &mut A) {
        Arch::new().dispatch(TileSum { spans: self, sites, count, add });
    }
}

/// Adds a tile to a sum: `present` are the bonds of the stencil that any of its particles has.
trait Add<const D: usize> {
    fn tile(&mut self, spans: &Spans<D>, base: usize, present: &[usize]);
}

/// A sum, compiled as a whole for the instruction set.
struct TileSum<'a, 'b, const D: usize, A> {
    spans: &'b Spans<'a, D>,
    sites: Range<usize>,
    count: usize,
    add: &'b mut A,
}

impl<const D: usize, A: Add<D>> NullaryFnOnce for TileSum<'_, '_, D, A> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.spans.tiles(self.sites, self.count, self.add);
    }
}

struct Extremes {
    low: [f64; TILE],
    high: [f64; TILE],
}

impl<const D: usize> Add<D> for Extremes {
    #[inline(always)]
    fn tile(&mut self, spans: &Spans<D>, base: usize, present: &[usize]) {
        let Self { low, high } = self;
        for &k in present {
            let e = spans.elongations(base, k);
            for i in 0..TILE {
                // NaN stretches are skipped, as in the kernels
                low[i] = if e[i] < low[i] { e[i] } else { low[i] };
                high[i] = if e[i] > high[i] { e[i] } else { high[i] };
            }
        }
    }
}

struct BeyondScan {
    least: f64,
    bonds: Vec<[u32; 2]>,
}

impl<const D: usize> Add<D> for BeyondScan {
    #[inline(always)]
    fn tile(&mut self, spans: &Spans<D>, base: usize, present: &[usize]) {
        for &k in present {
            let e = spans.elongations(base, k);
            let mut lanes = 0_u32;
            for i in 0..TILE {
                lanes |= u32::from(e[i] > self.least) << i;
            }
            while lanes != 0 {
                let site = base + lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                // below no stretch, broken bonds have 0
                if spans.tiles.intact[k / 64][site] >> (k % 64) & 1 == 1 {
                    let there = site.wrapping_add_signed(spans.spans[k].shift);
                    let opposite = spans.spans.len() - 1 - k;
                    self.bonds.extend([[site as u32, k as u32], [there as u32, opposite as u32]]);
                }
            }
        }
    }
}

struct Stiffness<'a> {
    first: usize,
    volume: f64,
    table: &'a TangentTable,
    least: f64,
    sums: Vec<f64>,
}

impl<const D: usize> Add<D> for Stiffness<'_> {
    #[inline(always)]
    fn tile(&mut self, spans: &Spans<D>, base: usize, present: &[usize]) {
        let sums = &mut self.sums[base - self.first..][..TILE];
        for &k in present {
            let span = &spans.spans[k];
            let there = base.wrapping_add_signed(span.shift);
            let (mut zeta, mut square, mut mixed) = ([[0.0; TILE]; D], [0.0; TILE], [0.0_f64; TILE]);
            for d in 0..D {
                let displacement = spans.tiles.displacement[d];
                let (own, other) = (&displacement[base..base + TILE], &displacement[there..there + TILE]);
                for i in 0..TILE {
                    zeta[d][i] = span.bond[d] + other[i] - own[i];
                    square[i] += zeta[d][i] * zeta[d][i];
                }
                for e in 0..d {
                    for i in 0..TILE {
                        mixed[i] = mixed[i].max((zeta[d][i] * zeta[e][i]).abs());
                    }
                }
            }
            let factor = 2.0 * (self.volume * span.share) / span.length;
            let words = &spans.tiles.intact[k / 64][base..base + TILE];
            for i in 0..TILE {
                let e = square[i] / (span.length * span.length) - 1.0;
                let tangent = self.table.value(e).max(self.least);
                let part = factor * tangent * (1.0 + mixed[i] / square[i].max(f64::MIN_POSITIVE));
                sums[i] += if words[i] >> (k % 64) & 1 == 1 { part } else { 0.0 };
            }
        }
    }
}

/// Sums from which the mean deformation of a family follows.
#[derive(Clone, Copy, Debug)]
pub struct GradientSums<const D: usize> {
    /// Σ share ξ⊗ξ/|ξ|².
    pub shape: [[f64; D]; D],
    /// Σ share η⊗ξ/|ξ|².
    pub change: [[f64; D]; D],
}

impl<const D: usize> GradientSums<D> {
    const NONE: Self = Self { shape: [[0.0; D]; D], change: [[0.0; D]; D] };
}

/// Sums of whole tiles from `first` on, one vector of sites at a time.
struct GradientKernel<'a, 'b, const D: usize> {
    spans: &'b Spans<'a, D>,
    first: usize,
    sums: &'b mut [GradientSums<D>],
}

impl<const D: usize> WithSimd for GradientKernel<'_, '_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Spans { spans, tiles } = self.spans;
        let zero = simd.splat_f64s(0.0);
        for (at, sums) in self.sums.chunks_mut(S::F64_LANES).enumerate() {
            let base = self.first + at * S::F64_LANES;
            if tiles.classes[base / TILE] == TileClass::Empty {
                continue;
            }
            let (mut shape, mut change) = ([[zero; D]; D], [[zero; D]; D]);
            for (k, span) in spans.iter().enumerate() {
                let words = S::as_simd_u64s(&tiles.intact[k / 64][base..base + S::F64_LANES]).0[0];
                let bit = simd.splat_u64s(1 << (k % 64));
                let has = simd.equal_u64s(simd.and_u64s(words, bit), bit);
                let weight = simd.select_f64s(has, simd.splat_f64s(span.share * span.inverse_square), zero);
                // a bond that leads outside the storage is never intact
                let there = base.wrapping_add_signed(span.shift);
                if there > tiles.displacement[0].len() - S::F64_LANES {
                    continue;
                }
                // closures would not be compiled for the instruction set
                let mut weighted = [zero; D];
                for b in 0..D {
                    weighted[b] = simd.mul_f64s(weight, simd.splat_f64s(span.bond[b]));
                }
                for a in 0..D {
                    let displacement = tiles.displacement[a];
                    let own = S::as_simd_f64s(&displacement[base..base + S::F64_LANES]).0[0];
                    let other = S::as_simd_f64s(&displacement[there..there + S::F64_LANES]).0[0];
                    let eta = simd.sub_f64s(other, own);
                    let bond = simd.splat_f64s(span.bond[a]);
                    for b in 0..D {
                        change[a][b] = simd.mul_add_f64s(weighted[b], eta, change[a][b]);
                        shape[a][b] = simd.mul_add_f64s(weighted[b], bond, shape[a][b]);
                    }
                }
            }
            for a in 0..D {
                for b in 0..D {
                    let (shape, change) = ([shape[a][b]], [change[a][b]]);
                    let (shape, change) = (cast_slice(&shape), cast_slice(&change));
                    for (i, sums) in sums.iter_mut().enumerate() {
                        (sums.shape[a][b], sums.change[a][b]) = (shape[i], change[i]);
                    }
                }
            }
        }
    }
}

struct Energy<F> {
    energy: F,
    total: f64,
}

impl<const D: usize, F: Fn(f64) -> f64> Add<D> for Energy<F> {
    #[inline(always)]
    fn tile(&mut self, spans: &Spans<D>, base: usize, present: &[usize]) {
        for &k in present {
            let (span, e) = (&spans.spans[k], spans.elongations(base, k));
            let words = &spans.tiles.intact[k / 64][base..base + TILE];
            let mut sum = 0.0;
            for i in 0..TILE {
                if words[i] >> (k % 64) & 1 == 1 {
                    sum += (self.energy)(e[i]);
                }
            }
            self.total += span.share * span.length * sum;
        }
    }
}
