//! The lattice kernel: vectors of neighbouring particles, one bond of the stencil at a time, without gather.

use super::kernel::{ForceKernel, law};
use super::lattice_factors::{Factors, mean};
use super::real::KernelReal;
use crate::potential::StretchRange;
use pulp::Simd;

/// Sites per tile: the unit of the lattice kernel's classification. Storage is padded to a multiple of it.
pub const TILE: usize = 16;

/// A bond of the stencil with the law's coefficients scaled to its length and stiffness, for `P` numerator
/// and `Q` denominator coefficients: q·c = E·ΣₖaₖEᵏ/(1 + ΣₖbₖEᵏ⁺¹), E = η·(2ξ + η).
#[derive(Clone, Copy, Debug)]
pub struct StencilRow<T, const D: usize, const P: usize, const Q: usize> {
    /// Distance to the neighbour in sites.
    pub shift: isize,
    /// Reference bond ξ.
    pub bond: [T; D],
    /// 1/|ξ|².
    pub inverse_square: T,
    /// Ends of the fitted range in E; q is constant beyond them.
    pub clamp: [T; 2],
    /// Value at E = 0 (0 for stress-free laws).
    pub constant: T,
    /// Scaled numerator.
    pub numerator: [T; P],
    /// Scaled denominator beyond its leading 1.
    pub denominator: [T; Q],
}

/// Work that the particles of a tile need.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub enum TileClass {
    /// No particle has a bond.
    Empty,
    /// Every particle has every bond, with the stencil's own weight.
    Full,
    /// Bonds are missing or have weights of their own.
    Partial,
}

/// Input of the lattice kernel besides its rows.
pub struct Tiles<'a, const D: usize, T = f64> {
    /// Displacement.
    pub displacement: [&'a [T]; D],
    /// Bit k of word w at a site: bond 64w + k is intact.
    pub intact: &'a [Vec<u64>],
    /// Class of each tile.
    pub classes: &'a [TileClass],
    /// Per-particle correction factors g (see [`super::correction`]), if the scene asks for them.
    pub factors: Option<Factors<'a, D, T>>,
    /// Largest |shift|: sites closer than this to either end hold no particle.
    pub guard: usize,
}

/// The lattice kernel: tiles and rows.
pub struct LatticePass<'a, T, const D: usize, const P: usize, const Q: usize> {
    /// The stencil.
    pub rows: &'a [StencilRow<T, D, P, Q>],
    /// The storage, in units of the rows.
    pub tiles: &'a Tiles<'a, D, T>,
    /// Unit of the rows' forces.
    pub unit: f64,
}

impl<T: KernelReal, const D: usize, const P: usize, const Q: usize> ForceKernel<D>
    for LatticePass<'_, T, D, P, Q>
{
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
        // SAFETY of the unchecked loads below: a tile is visited only where `classes` says that it holds a
        // bond, and then every site of it lies at least `guard` ≥ max|shift| from both ends of every slice.
        assert!(start.is_multiple_of(TILE) && length.is_multiple_of(TILE));
        let sites = self.tiles.displacement[0].len();
        assert!(start + length <= sites && self.tiles.displacement.iter().all(|c| c.len() == sites));
        assert!(force.iter().all(|f| f.len() == length));
        assert!(
            self.tiles.intact.iter().all(|w| w.len() == sites)
                && self.tiles.intact.len() * 64 >= self.rows.len()
        );
        assert!(self.tiles.factors.is_none_or(|factors| factors.cover(sites)));
        assert!(self.rows.iter().all(|r| r.shift.unsigned_abs() <= self.tiles.guard));
        let tracking = track.is_some();
        let mut seen = [T::splat(simd, T::from_f64(0.0)); 2];
        for offset in (0..length).step_by(TILE) {
            let base = start + offset;
            let class = self.tiles.classes[base / TILE];
            for f in force.iter_mut() {
                f[offset..offset + TILE].fill(0.0);
            }
            if class == TileClass::Empty {
                continue;
            }
            assert!(base >= self.tiles.guard && base + TILE + self.tiles.guard <= sites);
            let lanes = T::lanes::<S>();
            // two vectors at once share the loads of coefficients if registers suffice
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
                    match (class == TileClass::Full, pair) {
                        (true, true) => self.full::<S, 2>(simd, base + sub, out, tracking, &mut seen),
                        (true, false) => self.full::<S, 1>(simd, base + sub, out, tracking, &mut seen),
                        // at the end of a row: one vector
                        (false, true) if !bonded(base + sub) => {
                            let second = out.map(|out| out.add(lanes));
                            self.partial::<S, 1>(simd, base + sub + lanes, second, tracking, &mut seen);
                        }
                        (false, true) if !bonded(base + sub + lanes) => {
                            self.partial::<S, 1>(simd, base + sub, out, tracking, &mut seen);
                        }
                        (false, true) => self.partial::<S, 2>(simd, base + sub, out, tracking, &mut seen),
                        (false, false) => self.partial::<S, 1>(simd, base + sub, out, tracking, &mut seen),
                    }
                }
            }
        }
        if let Some(range) = track {
            let [low, high] = seen;
            let seen = StretchRange { low: T::least(simd, low), high: T::greatest(simd, high) };
            *range = range.join(seen);
        }
    }
}

impl<T: KernelReal, const D: usize, const P: usize, const Q: usize> LatticePass<'_, T, D, P, Q> {
    /// Returns the number of rows whose stretches are tracked: rows of one direction visit every bond once.
    #[inline(always)]
    fn tracked(&self, tracking: bool) -> usize {
        if tracking { self.rows.len() / 2 } else { 0 }
    }

    /// Sums a tile in which every bond is present: only loads and arithmetic.
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
        seen: &mut [T::Vector<S>; 2],
    ) {
        let (tracked, others) = self.rows.split_at(self.tracked(tracking));
        let [mut low, mut high] = *seen;
        let displacement = self.tiles.displacement;
        // SAFETY: as above
        let own = unsafe { self.displacements::<S, V>(simd, base) };
        let mut sum = [[T::splat(simd, T::from_f64(0.0)); V]; D];
        for rows in tracked.chunks(T::RUN) {
            for row in rows {
                let inverse = T::splat(simd, row.inverse_square);
                for v in 0..V {
                    // SAFETY: as above
                    let (zeta, e) =
                        unsafe { row.stretch(simd, displacement, &own[v], base + v * T::lanes::<S>()) };
                    let relative = T::mul(simd, e, inverse);
                    low = T::min(simd, low, relative);
                    high = T::max(simd, high, relative);
                    let q = row.law(simd, e);
                    for d in 0..D {
                        sum[d][v] = T::mul_add(simd, q, zeta[d], sum[d][v]);
                    }
                }
            }
            // SAFETY: as above
            sum = unsafe { self.pass_on(simd, out, sum, false) };
        }
        *seen = [low, high];
        for rows in others.chunks(T::RUN) {
            for row in rows {
                for v in 0..V {
                    // SAFETY: as above
                    let (zeta, e) =
                        unsafe { row.stretch(simd, displacement, &own[v], base + v * T::lanes::<S>()) };
                    let q = row.law(simd, e);
                    for d in 0..D {
                        sum[d][v] = T::mul_add(simd, q, zeta[d], sum[d][v]);
                    }
                }
            }
            // SAFETY: as above
            sum = unsafe { self.pass_on(simd, out, sum, false) };
        }
        // SAFETY: as above
        unsafe { self.pass_on(simd, out, sum, true) };
    }

    /// Sums bonds masked by their bits and weighted by the factors of their ends; skips bonds that no
    /// particle of the block has.
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
        seen: &mut [T::Vector<S>; 2],
    ) {
        let lanes = T::lanes::<S>();
        let [mut low, mut high] = *seen;
        let tracked = self.tracked(tracking);
        let displacement = self.tiles.displacement;
        // SAFETY: as above
        let own = unsafe { self.displacements::<S, V>(simd, base) };
        let zero = T::splat(simd, T::from_f64(0.0));
        let mut sum = [[zero; V]; D];
        for (word, rows) in self.rows.chunks(64).enumerate() {
            let words = &self.tiles.intact[word][base..base + V * lanes];
            let (mut present, mut common) = (0, u64::MAX);
            for &bits in words {
                present |= bits;
                common &= if bits == 0 { u64::MAX } else { bits };
            }
            // bonds of this word that all particles with any such bond share need no mask
            common &= if self.tiles.factors.is_none() { present } else { 0 };
            present &= !common;
            // a particle has all common bonds or none of this word: one bit decides
            let (one, mut left) = (common & common.wrapping_neg(), common);
            while left != 0 {
                let (mut part, mut run) = ([[zero; V]; D], T::RUN);
                while left != 0 && run > 0 {
                    run -= 1;
                    let k = left.trailing_zeros() as usize;
                    left &= left - 1;
                    let row = &rows[k];
                    let mut stretches = [zero; V];
                    for v in 0..V {
                        // SAFETY: as above
                        let (zeta, e) = unsafe { row.stretch(simd, displacement, &own[v], base + v * lanes) };
                        stretches[v] = e;
                        let q = row.law(simd, e);
                        for d in 0..D {
                            part[d][v] = T::mul_add(simd, q, zeta[d], part[d][v]);
                        }
                    }
                    if 64 * word + k < tracked {
                        for v in 0..V {
                            // SAFETY: as above
                            let e =
                                unsafe { row.relative(simd, stretches[v], words[v * lanes..].as_ptr(), one) };
                            (low, high) = (T::min(simd, low, e), T::max(simd, high, e));
                        }
                    }
                }
                for v in 0..V {
                    for d in 0..D {
                        // SAFETY: as above
                        let kept = unsafe { T::keep(simd, part[d][v], words[v * lanes..].as_ptr(), one) };
                        sum[d][v] = T::add(simd, sum[d][v], kept);
                    }
                }
                // SAFETY: as above
                sum = unsafe { self.pass_on(simd, out, sum, false) };
            }
            while present != 0 {
                let mut run = T::RUN;
                while present != 0 && run > 0 {
                    run -= 1;
                    let k = present.trailing_zeros() as usize;
                    present &= present - 1;
                    let row = &rows[k];
                    for v in 0..V {
                        let (here, words) = (base + v * lanes, words[v * lanes..].as_ptr());
                        // SAFETY: as above
                        let (zeta, e) = unsafe { row.stretch(simd, displacement, &own[v], here) };
                        let mut q = row.law(simd, e);
                        if let Some(factors) = self.tiles.factors {
                            let there = here.wrapping_add_signed(row.shift);
                            // SAFETY: as above
                            q = T::mul(simd, q, unsafe { row.weight(simd, factors, here, there) });
                        }
                        // SAFETY: as above
                        q = unsafe { T::keep(simd, q, words, 1 << k) };
                        for d in 0..D {
                            sum[d][v] = T::mul_add(simd, q, zeta[d], sum[d][v]);
                        }
                        if 64 * word + k < tracked {
                            // SAFETY: as above
                            let e = unsafe { row.relative(simd, e, words, 1 << k) };
                            (low, high) = (T::min(simd, low, e), T::max(simd, high, e));
                        }
                    }
                }
                // SAFETY: as above
                sum = unsafe { self.pass_on(simd, out, sum, false) };
            }
        }
        // SAFETY: as above
        unsafe { self.pass_on(simd, out, sum, true) };
        *seen = [low, high];
    }

    /// Adds forces of V vectors to the output, after each run of sums and at the end; returns the remainder.
    ///
    /// # Safety
    /// `out` takes V·lanes values.
    #[inline(always)]
    unsafe fn pass_on<S: Simd, const V: usize>(
        &self,
        simd: S,
        out: [*mut f64; D],
        mut sum: [[T::Vector<S>; V]; D],
        end: bool,
    ) -> [[T::Vector<S>; V]; D] {
        if end == (T::RUN == usize::MAX) {
            for d in 0..D {
                for v in 0..V {
                    // SAFETY: as above
                    unsafe { T::add_to(simd, out[d].add(v * T::lanes::<S>()), self.unit, sum[d][v]) };
                    sum[d][v] = T::splat(simd, T::from_f64(0.0));
                }
            }
        }
        sum
    }

    /// Loads the displacements of V vectors of particles.
    ///
    /// # Safety
    /// As [`Self::full`].
    #[inline(always)]
    unsafe fn displacements<S: Simd, const V: usize>(&self, simd: S, base: usize) -> [[T::Vector<S>; D]; V] {
        let mut own = [[T::splat(simd, T::from_f64(0.0)); D]; V];
        for v in 0..V {
            for d in 0..D {
                // SAFETY: as above
                own[v][d] = unsafe { T::load::<S>(self.tiles.displacement[d], base + v * T::lanes::<S>()) };
            }
        }
        own
    }
}

impl<T: KernelReal, const D: usize, const P: usize, const Q: usize> StencilRow<T, D, P, Q> {
    /// Computes ζ of a bond of the particles from `here` on, and E = η·(2ξ + η) = |ζ|² − |ξ|².
    ///
    /// # Safety
    /// The sites `here` and `here + shift` are followed by a vector's width in every slice.
    #[inline(always)]
    unsafe fn stretch<S: Simd>(
        &self,
        simd: S,
        displacement: [&[T]; D],
        own: &[T::Vector<S>; D],
        here: usize,
    ) -> ([T::Vector<S>; D], T::Vector<S>) {
        let zero = T::splat(simd, T::from_f64(0.0));
        let there = here.wrapping_add_signed(self.shift);
        let (mut e, mut zeta) = (zero, [zero; D]);
        for d in 0..D {
            // SAFETY: as above
            let other = unsafe { T::load::<S>(displacement[d], there) };
            // few registers remain for sums
            // SAFETY: as above
            let own =
                if S::REGISTER_COUNT >= 32 { own[d] } else { unsafe { T::load::<S>(displacement[d], here) } };
            let (eta, bond) = (T::sub(simd, other, own), T::splat(simd, self.bond[d]));
            zeta[d] = T::add(simd, eta, bond);
            let twice = T::add(simd, zeta[d], bond);
            e = if d == 0 { T::mul(simd, eta, twice) } else { T::mul_add(simd, eta, twice, e) };
        }
        (zeta, e)
    }

    /// Computes λ² − 1 = E/|ξ|² of the particles that have all bits of `bit` in their words; 0 for others.
    ///
    /// # Safety
    /// `words` are as many as a vector has lanes.
    #[inline(always)]
    unsafe fn relative<S: Simd>(
        &self,
        simd: S,
        e: T::Vector<S>,
        words: *const u64,
        bit: u64,
    ) -> T::Vector<S> {
        let relative = T::mul(simd, e, T::splat(simd, self.inverse_square));
        // SAFETY: as above
        unsafe { T::keep(simd, relative, words, bit) }
    }

    /// q·c.
    #[inline(always)]
    fn law<S: Simd>(&self, simd: S, e: T::Vector<S>) -> T::Vector<S> {
        law::<T, S, P, Q>(simd, e, self.clamp, self.constant, &self.numerator, &self.denominator)
    }

    /// Computes the weight of a bond from the factors of its two ends.
    ///
    /// # Safety
    /// `here` and `there` are followed by a vector's width in every slice.
    #[inline(always)]
    unsafe fn weight<S: Simd>(
        &self,
        simd: S,
        factors: Factors<D, T>,
        here: usize,
        there: usize,
    ) -> T::Vector<S> {
        let ends = [here, there];
        match factors {
            // SAFETY: as above
            Factors::Even(factors) => unsafe { mean::<T, S>(simd, factors, ends) },
            // SAFETY: as above
            Factors::Along(along) => unsafe { self.weight_along(simd, along, here, there) },
            Factors::Shared { along, own, whole } => {
                // SAFETY: as above
                let [own, whole] =
                    unsafe { [mean::<T, S>(simd, own, ends), mean::<T, S>(simd, whole, ends)] };
                let share = T::div(simd, own, whole);
                match along {
                    // SAFETY: as above
                    Some(along) => {
                        T::mul(simd, share, unsafe { self.weight_along(simd, along, here, there) })
                    }
                    None => share,
                }
            }
        }
    }

    /// Computes (Σ_d (n_d/ḡ_d)²)^(−1/2), ḡ = ½(g_I + g_J), from factors g along each axis.
    ///
    /// # Safety
    /// As [`Self::weight`].
    #[inline(always)]
    unsafe fn weight_along<S: Simd>(
        &self,
        simd: S,
        factors: [&[T]; D],
        here: usize,
        there: usize,
    ) -> T::Vector<S> {
        let four = T::splat(simd, T::from_f64(4.0));
        let inverse = T::mul(simd, four, T::splat(simd, self.inverse_square));
        let mut sum = T::splat(simd, T::from_f64(0.0));
        for d in 0..D {
            let bond = T::splat(simd, self.bond[d]);
            // 4/(g_I + g_J)² = 1/ḡ²
            // SAFETY: as above
            let pair =
                unsafe { T::add(simd, T::load::<S>(factors[d], here), T::load::<S>(factors[d], there)) };
            let cosine = T::mul(simd, T::mul(simd, bond, bond), inverse);
            sum = T::add(simd, sum, T::div(simd, cosine, T::mul(simd, pair, pair)));
        }
        T::div(simd, T::splat(simd, T::from_f64(1.0)), T::sqrt(simd, sum))
    }
}
