//! Lattice kernels of materials with two passes: moments of family displacements, and forces linear in a
//! bond.
//!
//! Fields of `N` = 1 + D² components hold a scalar and then a tensor, row by row.

use super::kernel::ForceKernel;
use super::lattice_kernel::{TILE, TileClass, Tiles};
use super::real::KernelReal;
use crate::potential::StretchRange;
use pulp::{Arch, Simd, WithSimd};

/// A bond of the stencil.
#[derive(Clone, Copy, Debug)]
pub struct LinearRow<const D: usize> {
    /// Distance to the neighbour in sites.
    pub shift: isize,
    /// Reference bond ξ, m.
    pub bond: [f64; D],
    /// V/|ξ|², V with its correction.
    pub share: f64,
    /// 1/|ξ|².
    pub inverse_square: f64,
}

/// Moments of the particles in one tile: Σ_J (V_J/|ξ|²)|η|² and Σ_J (V_J/|ξ|²) η⊗ξ over the intact bonds.
pub type Moments<const N: usize> = [[f64; TILE]; N];

/// The first pass: moments of the tiles of a work item; `visit` receives each tile's moments and first site.
pub struct MomentPass<'a, const D: usize, const N: usize> {
    /// The stencil.
    pub rows: &'a [LinearRow<D>],
    /// The storage.
    pub tiles: &'a Tiles<'a, D>,
    /// First site, a multiple of [`TILE`].
    pub start: usize,
    /// Number of sites, a multiple of [`TILE`].
    pub length: usize,
    /// Receives the moments.
    pub visit: &'a mut dyn FnMut(usize, &Moments<N>),
}

/// The second pass: Σ_J (V_J/|ξ|²)[(A_I + A_J) η + (S_I + S_J) ξ] with A and S of `terms`.
pub struct LinearPass<'a, const D: usize, const N: usize> {
    /// The stencil.
    pub rows: &'a [LinearRow<D>],
    /// The storage.
    pub tiles: &'a Tiles<'a, D>,
    /// A and S, site by site.
    pub terms: [&'a [f64]; N],
}

/// Asserts the bounds that the unchecked loads of both passes rely on, except those of each tile.
fn check<const D: usize>(rows: &[LinearRow<D>], tiles: &Tiles<D>, start: usize, length: usize) -> usize {
    let sites = tiles.displacement[0].len();
    assert!(start.is_multiple_of(TILE) && length.is_multiple_of(TILE) && start + length <= sites);
    assert!(tiles.displacement.iter().all(|c| c.len() == sites));
    assert!(tiles.intact.iter().all(|w| w.len() == sites) && tiles.intact.len() * 64 >= rows.len());
    assert!(rows.iter().all(|row| row.shift.unsigned_abs() <= tiles.guard));
    sites
}

/// Returns the mask of the lanes from `base` that have bond `k`.
///
/// # Safety
/// A vector's width of sites follows `base` in every word.
#[inline(always)]
unsafe fn present<S: Simd>(simd: S, intact: &[Vec<u64>], k: usize, base: usize) -> S::m64s {
    let bits = unsafe { intact[k / 64].as_ptr().add(base).cast::<S::u64s>().read_unaligned() };
    let bit = simd.splat_u64s(1 << (k % 64));
    simd.equal_u64s(simd.and_u64s(bits, bit), bit)
}

impl<const D: usize, const N: usize> WithSimd for MomentPass<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows, tiles, start, length, visit } = self;
        let sites = check(rows, tiles, start, length);
        assert!(N == 1 + D * D);
        let mut moments = [[0.0; TILE]; N];
        for base in (start..start + length).step_by(TILE) {
            let class = tiles.classes[base / TILE];
            if class == TileClass::Empty {
                continue;
            }
            assert!(base >= tiles.guard && base + TILE + tiles.guard <= sites);
            for sub in (0..TILE).step_by(S::F64_LANES) {
                // SAFETY: every site up to `guard` ≥ max|shift| from the tile lies in every slice.
                let sums: [S::f64s; N] = unsafe {
                    match class {
                        TileClass::Full => sums::<S, D, N, true>(simd, rows, tiles, base + sub),
                        _ => sums::<S, D, N, false>(simd, rows, tiles, base + sub),
                    }
                };
                for (row, sum) in moments.iter_mut().zip(sums) {
                    let lanes = &mut row[sub..sub + S::F64_LANES];
                    S::as_mut_simd_f64s(lanes).0[0] = sum;
                }
            }
            visit(base, &moments);
        }
    }
}

/// # Safety
/// Sites `base − guard .. base + lanes + guard` exist in every slice.
#[inline(always)]
unsafe fn sums<S: Simd, const D: usize, const N: usize, const FULL: bool>(
    simd: S,
    rows: &[LinearRow<D>],
    tiles: &Tiles<D>,
    base: usize,
) -> [S::f64s; N] {
    let zero = simd.splat_f64s(0.0);
    let mut sums = [zero; N];
    let mut own = [zero; D];
    for d in 0..D {
        own[d] = unsafe { f64::load::<S>(tiles.displacement[d], base) };
    }
    for (k, row) in rows.iter().enumerate() {
        let there = base.wrapping_add_signed(row.shift);
        let share = simd.splat_f64s(row.share);
        let share = if FULL {
            share
        } else {
            simd.select_f64s(unsafe { present::<S>(simd, tiles.intact, k, base) }, share, zero)
        };
        for a in 0..D {
            let other = unsafe { f64::load::<S>(tiles.displacement[a], there) };
            let eta = simd.sub_f64s(other, own[a]);
            let weighted = simd.mul_f64s(share, eta);
            sums[0] = simd.mul_add_f64s(weighted, eta, sums[0]);
            for b in 0..D {
                let at = 1 + a * D + b;
                sums[at] = simd.mul_add_f64s(weighted, simd.splat_f64s(row.bond[b]), sums[at]);
            }
        }
    }
    sums
}

impl<const D: usize, const N: usize> ForceKernel<D> for LinearPass<'_, D, N> {
    #[inline(always)]
    fn run<S: Simd>(
        &self,
        simd: S,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) {
        let length = force[0].len();
        let sites = check(self.rows, self.tiles, start, length);
        assert!(N == 1 + D * D && force.iter().all(|f| f.len() == length));
        assert!(self.terms.iter().all(|term| term.len() == sites));
        let mut seen = StretchRange::REST;
        for offset in (0..length).step_by(TILE) {
            let base = start + offset;
            let class = self.tiles.classes[base / TILE];
            if class == TileClass::Empty {
                force.iter_mut().for_each(|f| f[offset..offset + TILE].fill(0.0));
                continue;
            }
            assert!(base >= self.tiles.guard && base + TILE + self.tiles.guard <= sites);
            for sub in (0..TILE).step_by(S::F64_LANES) {
                // SAFETY: as in the first pass.
                let sum = unsafe {
                    match (class, track.is_some()) {
                        (TileClass::Full, false) => self.sum::<S, true, false>(simd, base + sub, &mut seen),
                        (_, false) => self.sum::<S, false, false>(simd, base + sub, &mut seen),
                        _ => self.sum::<S, false, true>(simd, base + sub, &mut seen),
                    }
                };
                for (f, sum) in force.iter_mut().zip(sum) {
                    let lanes = &mut f[offset + sub..offset + sub + S::F64_LANES];
                    S::as_mut_simd_f64s(lanes).0[0] = sum;
                }
            }
        }
        if let Some(range) = track {
            *range = range.join(seen);
        }
    }
}

impl<const D: usize, const N: usize> LinearPass<'_, D, N> {
    /// # Safety
    /// Sites `base − guard .. base + lanes + guard` exist in every slice.
    #[inline(always)]
    unsafe fn sum<S: Simd, const FULL: bool, const TRACK: bool>(
        &self,
        simd: S,
        base: usize,
        seen: &mut StretchRange,
    ) -> [S::f64s; D] {
        let zero = simd.splat_f64s(0.0);
        let mut sum = [zero; D];
        let (mut low, mut high) = (simd.splat_f64s(seen.low), simd.splat_f64s(seen.high));
        let (mut own, mut terms) = ([zero; D], [zero; N]);
        for d in 0..D {
            own[d] = unsafe { f64::load::<S>(self.tiles.displacement[d], base) };
        }
        for n in 0..N {
            terms[n] = unsafe { f64::load::<S>(self.terms[n], base) };
        }
        for (k, row) in self.rows.iter().enumerate() {
            let there = base.wrapping_add_signed(row.shift);
            let share = simd.splat_f64s(row.share);
            let present =
                if FULL { None } else { Some(unsafe { present::<S>(simd, self.tiles.intact, k, base) }) };
            let share = present.map_or(share, |present| simd.select_f64s(present, share, zero));
            let slope = simd.add_f64s(terms[0], unsafe { f64::load::<S>(self.terms[0], there) });
            let mut e = zero;
            for a in 0..D {
                let eta = simd.sub_f64s(unsafe { f64::load::<S>(self.tiles.displacement[a], there) }, own[a]);
                let mut density = simd.mul_f64s(slope, eta);
                for b in 0..D {
                    let at = 1 + a * D + b;
                    let stress = simd.add_f64s(terms[at], unsafe { f64::load::<S>(self.terms[at], there) });
                    density = simd.mul_add_f64s(stress, simd.splat_f64s(row.bond[b]), density);
                }
                sum[a] = simd.mul_add_f64s(share, density, sum[a]);
                if TRACK {
                    e = simd.mul_add_f64s(eta, simd.add_f64s(eta, simd.splat_f64s(2.0 * row.bond[a])), e);
                }
            }
            if TRACK {
                let e = simd.mul_f64s(e, simd.splat_f64s(row.inverse_square));
                let e = present.map_or(e, |present| simd.select_f64s(present, e, zero));
                low = simd.min_f64s(low, e);
                high = simd.max_f64s(high, e);
            }
        }
        if TRACK {
            *seen = StretchRange { low: simd.reduce_min_f64s(low), high: simd.reduce_max_f64s(high) };
        }
        sum
    }
}

/// Runs the first pass with the widest instructions that this machine has.
pub fn moments<const D: usize, const N: usize>(pass: MomentPass<D, N>) {
    Arch::new().dispatch(pass);
}
