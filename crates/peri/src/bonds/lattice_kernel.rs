//! The lattice kernel: vectors of neighbouring particles, one bond of the stencil at a time, no gather.

use super::kernel::{Pass, law, load};
use crate::potential::StretchRange;
use pulp::Simd;

/// Sites per tile: the unit of the lattice kernel's classification. Storage is padded to a multiple of it.
pub const TILE: usize = 16;

/// One bond of the stencil with the law's coefficients scaled to its length and stiffness, for `P` numerator and
/// `Q` denominator coefficients: q·c = E·ΣₖaₖEᵏ/(1 + ΣₖbₖEᵏ⁺¹), E = η·(2ξ + η).
#[derive(Clone, Copy, Debug)]
pub struct Row<const D: usize, const P: usize, const Q: usize> {
    /// Distance to the neighbour in sites.
    pub shift: isize,
    /// Reference bond ξ.
    pub bond: [f64; D],
    /// 1/|ξ|².
    pub inverse_square: f64,
    /// Ends of the law in E; outside of them q stays what it is there.
    pub clamp: [f64; 2],
    /// Value at E = 0 (0 for stress-free laws).
    pub constant: f64,
    /// Scaled numerator.
    pub numerator: [f64; P],
    /// Scaled denominator beyond its leading 1.
    pub denominator: [f64; Q],
}

/// What a tile's particles need.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub enum Class {
    /// No particle has a bond.
    Empty,
    /// Every particle has every bond, with the stencil's own weight.
    Full,
    /// Bonds are missing or carry a weight of their own.
    Partial,
}

/// What the lattice kernel reads, beside its rows.
pub struct Tiles<'a, const D: usize> {
    /// Displacement.
    pub displacement: [&'a [f64]; D],
    /// Bit k of word w at a site: bond 64w + k is intact.
    pub intact: &'a [Vec<u64>],
    /// Class of each tile.
    pub classes: &'a [Class],
    /// Per-particle correction factors g (see [`super::correction`]), where the scene asks for them.
    pub factors: Option<[&'a [f64]; D]>,
    /// Largest |shift|: sites closer than this to either end hold no particle.
    pub guard: usize,
}

/// The lattice kernel: tiles under a set of rows.
pub struct LatticePass<'a, const D: usize, const P: usize, const Q: usize> {
    /// The stencil.
    pub rows: &'a [Row<D, P, Q>],
    /// The storage.
    pub tiles: &'a Tiles<'a, D>,
}

impl<const D: usize, const P: usize, const Q: usize> Pass<D> for LatticePass<'_, D, P, Q> {
    /// `start` and the length are multiples of [`TILE`].
    #[inline(always)]
    fn run<S: Simd>(
        &self,
        simd: S,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) {
        let length = force[0].len();
        // SAFETY of the unchecked loads below: a tile is visited only where `classes` says that it holds a bond,
        // and then every site of it lies at least `guard` ≥ max|shift| from both ends of every slice.
        assert!(start.is_multiple_of(TILE) && length.is_multiple_of(TILE));
        let sites = self.tiles.displacement[0].len();
        assert!(start + length <= sites && self.tiles.displacement.iter().all(|c| c.len() == sites));
        assert!(force.iter().all(|f| f.len() == length));
        assert!(
            self.tiles.intact.iter().all(|w| w.len() == sites)
                && self.tiles.intact.len() * 64 >= self.rows.len()
        );
        assert!(self.tiles.factors.is_none_or(|g| g.iter().all(|c| c.len() == sites)));
        assert!(self.rows.iter().all(|r| r.shift.unsigned_abs() <= self.tiles.guard));
        let tracking = track.is_some();
        let mut seen = [simd.splat_f64s(0.0); 2];
        for offset in (0..length).step_by(TILE) {
            let base = start + offset;
            let class = self.tiles.classes[base / TILE];
            if class == Class::Empty {
                for f in force.iter_mut() {
                    f[offset..offset + TILE].fill(0.0);
                }
                continue;
            }
            assert!(base >= self.tiles.guard && base + TILE + self.tiles.guard <= sites);
            let lanes = S::F64_LANES;
            // two vectors at once share the loads of coefficients, where registers hold both
            let pair = 2 * lanes <= TILE && (D < 3 || S::REGISTER_COUNT >= 32);
            let step = if pair { 2 * lanes } else { lanes };
            for sub in (0..TILE).step_by(step) {
                let mut out = [std::ptr::null_mut(); D];
                for d in 0..D {
                    out[d] = force[d][offset + sub..].as_mut_ptr();
                }
                let bonded = |from: usize| {
                    self.tiles.intact.iter().any(|w| w[from..from + lanes].iter().any(|&bits| bits != 0))
                };
                // SAFETY: see above; `out` has at least `step` elements left in its tile.
                unsafe {
                    match (class == Class::Full, pair) {
                        (true, true) => self.full::<S, 2>(simd, base + sub, out, tracking, &mut seen),
                        (true, false) => self.full::<S, 1>(simd, base + sub, out, tracking, &mut seen),
                        // at the end of a row: one vector
                        (false, true) if !bonded(base + sub) => {
                            let second = out.map(|out| out.add(lanes));
                            out.iter().for_each(|out| out.write_bytes(0, lanes));
                            self.partial::<S, 1>(simd, base + sub + lanes, second, tracking, &mut seen);
                        }
                        (false, true) if !bonded(base + sub + lanes) => {
                            self.partial::<S, 1>(simd, base + sub, out, tracking, &mut seen);
                            out.iter().for_each(|out| out.add(lanes).write_bytes(0, lanes));
                        }
                        (false, true) => self.partial::<S, 2>(simd, base + sub, out, tracking, &mut seen),
                        (false, false) => self.partial::<S, 1>(simd, base + sub, out, tracking, &mut seen),
                    }
                }
            }
        }
        if let Some(range) = track {
            let [low, high] = seen;
            let seen = StretchRange { low: simd.reduce_min_f64s(low), high: simd.reduce_max_f64s(high) };
            *range = range.join(seen);
        }
    }
}

impl<const D: usize, const P: usize, const Q: usize> LatticePass<'_, D, P, Q> {
    /// Rows whose stretches are tracked: those of one direction see every bond of the body once.
    #[inline(always)]
    fn tracked(&self, tracking: bool) -> usize {
        if tracking { self.rows.len() / 2 } else { 0 }
    }

    /// Every bond present: nothing but loads and arithmetic.
    ///
    /// # Safety
    /// Sites `base − guard .. base + V·lanes + guard` exist in every slice; `out` takes V·lanes values.
    #[inline(always)]
    unsafe fn full<S: Simd, const V: usize>(
        &self,
        simd: S,
        base: usize,
        out: [*mut f64; D],
        tracking: bool,
        seen: &mut [S::f64s; 2],
    ) {
        let zero = simd.splat_f64s(0.0);
        let mut sum = [[zero; V]; D];
        let (tracked, others) = self.rows.split_at(self.tracked(tracking));
        let [mut low, mut high] = *seen;
        for row in tracked {
            let inverse = simd.splat_f64s(row.inverse_square);
            for v in 0..V {
                // SAFETY: as above
                let (zeta, e) = unsafe { self.stretch(simd, row, base + v * S::F64_LANES) };
                let relative = simd.mul_f64s(e, inverse);
                low = simd.min_f64s(low, relative);
                high = simd.max_f64s(high, relative);
                let q = law::<S, P, Q>(simd, e, row.clamp, row.constant, &row.numerator, &row.denominator);
                for d in 0..D {
                    sum[d][v] = simd.mul_add_f64s(q, zeta[d], sum[d][v]);
                }
            }
        }
        *seen = [low, high];
        for row in others {
            for v in 0..V {
                // SAFETY: as above
                let (zeta, e) = unsafe { self.stretch(simd, row, base + v * S::F64_LANES) };
                let q = law::<S, P, Q>(simd, e, row.clamp, row.constant, &row.numerator, &row.denominator);
                for d in 0..D {
                    sum[d][v] = simd.mul_add_f64s(q, zeta[d], sum[d][v]);
                }
            }
        }
        for d in 0..D {
            for v in 0..V {
                unsafe { out[d].add(v * S::F64_LANES).cast::<S::f64s>().write_unaligned(sum[d][v]) };
            }
        }
    }

    /// Bonds masked by their bits, weighted by their ends' factors; those that no particle of the block has are left out.
    ///
    /// # Safety
    /// As [`Self::full`].
    #[inline(always)]
    unsafe fn partial<S: Simd, const V: usize>(
        &self,
        simd: S,
        base: usize,
        out: [*mut f64; D],
        tracking: bool,
        seen: &mut [S::f64s; 2],
    ) {
        let zero = simd.splat_f64s(0.0);
        let mut sum = [[zero; V]; D];
        let [mut low, mut high] = *seen;
        let tracked = self.tracked(tracking);
        for (word, rows) in self.rows.chunks(64).enumerate() {
            let own = &self.tiles.intact[word][base..base + V * S::F64_LANES];
            let mut present = 0;
            for bits in own {
                present |= bits;
            }
            while present != 0 {
                let k = present.trailing_zeros() as usize;
                present &= present - 1;
                let row = &rows[k];
                let bit = simd.splat_u64s(1 << k);
                for v in 0..V {
                    let here = base + v * S::F64_LANES;
                    // SAFETY: as above
                    let (zeta, e, bits) = unsafe {
                        let bits = own.as_ptr().add(v * S::F64_LANES).cast::<S::u64s>().read_unaligned();
                        let (zeta, e) = self.stretch(simd, row, here);
                        (zeta, e, bits)
                    };
                    let has = simd.equal_u64s(simd.and_u64s(bits, bit), bit);
                    let mut q =
                        law::<S, P, Q>(simd, e, row.clamp, row.constant, &row.numerator, &row.denominator);
                    if let Some(factors) = self.tiles.factors {
                        let there = here.wrapping_add_signed(row.shift);
                        let inverse = row.inverse_square;
                        // SAFETY: as above
                        let weight = unsafe {
                            directional_weight::<S, D>(simd, factors, here, there, &row.bond, inverse)
                        };
                        q = simd.mul_f64s(q, weight);
                    }
                    q = simd.select_f64s(has, q, zero);
                    for d in 0..D {
                        sum[d][v] = simd.mul_add_f64s(q, zeta[d], sum[d][v]);
                    }
                    if 64 * word + k < tracked {
                        let relative = simd.mul_f64s(e, simd.splat_f64s(row.inverse_square));
                        let relative = simd.select_f64s(has, relative, zero);
                        low = simd.min_f64s(low, relative);
                        high = simd.max_f64s(high, relative);
                    }
                }
            }
        }
        *seen = [low, high];
        for d in 0..D {
            for v in 0..V {
                unsafe { out[d].add(v * S::F64_LANES).cast::<S::f64s>().write_unaligned(sum[d][v]) };
            }
        }
    }

    /// ζ of a bond of the particles from `here` on, and E.
    ///
    /// # Safety
    /// As [`Self::full`] with V = 1.
    #[inline(always)]
    unsafe fn stretch<S: Simd>(&self, simd: S, row: &Row<D, P, Q>, here: usize) -> ([S::f64s; D], S::f64s) {
        let zero = simd.splat_f64s(0.0);
        let there = here.wrapping_add_signed(row.shift);
        let (mut eta, mut zeta) = ([zero; D], [zero; D]);
        for d in 0..D {
            // SAFETY: as above
            let (own, other) = unsafe {
                (load::<S>(self.tiles.displacement[d], here), load::<S>(self.tiles.displacement[d], there))
            };
            eta[d] = simd.sub_f64s(other, own);
            zeta[d] = simd.add_f64s(eta[d], simd.splat_f64s(row.bond[d]));
        }
        let e = elongation::<S, D>(simd, &eta, &zeta, &row.bond);
        (zeta, e)
    }
}

/// Weight of a bond from the correction factors g of its two ends, (Σ_d (n_d/ḡ_d)²)^(−1/2), ḡ = ½(g_I + g_J).
///
/// # Safety
/// `here` and `there` are followed by a vector's width in every slice.
#[inline(always)]
unsafe fn directional_weight<S: Simd, const D: usize>(
    simd: S,
    factors: [&[f64]; D],
    here: usize,
    there: usize,
    bond: &[f64; D],
    inverse_square: f64,
) -> S::f64s {
    let mut sum = simd.splat_f64s(0.0);
    for d in 0..D {
        // 4/(g_I + g_J)² = 1/ḡ²
        let pair = unsafe { simd.add_f64s(load::<S>(factors[d], here), load::<S>(factors[d], there)) };
        let cosine = simd.splat_f64s(4.0 * bond[d] * bond[d] * inverse_square);
        sum = simd.add_f64s(sum, simd.div_f64s(cosine, simd.mul_f64s(pair, pair)));
    }
    simd.div_f64s(simd.splat_f64s(1.0), simd.sqrt_f64s(sum))
}

/// E = η·(2ξ + η) = |ζ|² − |ξ|².
#[inline(always)]
fn elongation<S: Simd, const D: usize>(
    simd: S,
    eta: &[S::f64s; D],
    zeta: &[S::f64s; D],
    bond: &[f64; D],
) -> S::f64s {
    let mut e = simd.mul_f64s(eta[0], simd.add_f64s(zeta[0], simd.splat_f64s(bond[0])));
    for d in 1..D {
        e = simd.mul_add_f64s(eta[d], simd.add_f64s(zeta[d], simd.splat_f64s(bond[d])), e);
    }
    e
}
