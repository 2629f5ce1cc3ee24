//! Forces of the bonds of one offset.

use super::convolution::lanes;
use super::{BondFits, StressInput};
use crate::bonds::{BodyGeometry, LatticeBonds, TILE, Weights};
use pulp::{Arch, Simd, WithSimd};

/// Vectors processed at a time: those of a tile at the widest.
const VECTORS: usize = 2;

/// Computes f V_I V_J, N, of bond `k` from the sites of a chunk on, in tiles that are `filled`; zero if not
/// intact. `out` has [`lanes`] numbers per site.
pub fn forces<const D: usize>(
    bonds: &LatticeBonds<D>,
    state: &StressInput<D>,
    k: usize,
    start: usize,
    filled: &[bool],
    out: &mut [f64],
) {
    let offset = bonds.stencil().offsets[k];
    let bond = offset.map(|o| f64::from(o) * bonds.lattice().spacing);
    let square: f64 = bond.iter().map(|x| x * x).sum();
    let volume = bonds.lattice().volume;
    let pull = Pull {
        fit: state.fit,
        displacement: state.displacement.components(),
        weights: bonds.weights(k),
        sites: bonds.sites(),
        shift: bonds.shift(offset),
        bond,
        inverse_square: 1.0 / square,
        inverse_length: 1.0 / square.sqrt(),
        scale: 2.0 * state.modulus * volume * volume / square.sqrt(),
    };
    Arch::new().dispatch(ForceChunk { pull, start, filled, out });
}

/// scale·weight·q(e) ζ, from the displacements of both ends.
struct Pull<'a, const D: usize> {
    fit: BondFits<'a>,
    displacement: [&'a [f64]; D],
    weights: Weights<'a, D>,
    sites: usize,
    shift: isize,
    bond: [f64; D],
    inverse_square: f64,
    inverse_length: f64,
    scale: f64,
}

/// Runs [`forces`] over a chunk.
struct ForceChunk<'a, const D: usize> {
    pull: Pull<'a, D>,
    start: usize,
    filled: &'a [bool],
    out: &'a mut [f64],
}

impl<const D: usize> WithSimd for ForceChunk<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let lanes = lanes::<D>();
        for tile in 0..self.filled.len() {
            if !self.filled[tile] {
                continue;
            }
            let out = &mut self.out[tile * TILE * lanes..][..TILE * lanes];
            let start = self.start + tile * TILE;
            let there = start.wrapping_add_signed(self.pull.shift);
            let mut forces = [[0.0; TILE]; D];
            // rows are padded: a bond that leaves the storage is never intact
            if there < self.pull.sites && there + TILE <= self.pull.sites {
                for part in (0..TILE).step_by(VECTORS * S::F64_LANES) {
                    self.pull.tile_forces::<S>(simd, start, there, part, &mut forces);
                }
            }
            for i in 0..TILE {
                for d in 0..D {
                    out[i * lanes + d] = forces[d][i];
                }
            }
        }
    }
}

/// Loads vectors from a number on. A function of arrays instead of the loop would not be inlined into vector
/// code.
#[inline(always)]
fn vectors<S: Simd>(simd: S, numbers: &[f64], from: usize) -> [S::f64s; VECTORS] {
    let vectors = &S::as_simd_f64s(&numbers[from..from + VECTORS * S::F64_LANES]).0[..VECTORS];
    let mut found = [simd.splat_f64s(0.0); VECTORS];
    #[expect(clippy::manual_memcpy, reason = "a slice of them would keep them in memory")]
    for v in 0..VECTORS {
        found[v] = vectors[v];
    }
    found
}

impl<const D: usize> Pull<'_, D> {
    /// Computes some vectors of a tile, from its site `part` on.
    #[inline(always)]
    fn tile_forces<S: Simd>(
        &self,
        simd: S,
        start: usize,
        there: usize,
        part: usize,
        forces: &mut [[f64; TILE]; D],
    ) {
        let zero = simd.splat_f64s(0.0);
        let (mut e, mut zeta) = ([zero; VECTORS], [[zero; VECTORS]; D]);
        for d in 0..D {
            let own = vectors::<S>(simd, self.displacement[d], start + part);
            let other = vectors::<S>(simd, self.displacement[d], there + part);
            let bond = simd.splat_f64s(self.bond[d]);
            for v in 0..VECTORS {
                let eta = simd.sub_f64s(other[v], own[v]);
                zeta[d][v] = simd.add_f64s(bond, eta);
                e[v] = simd.mul_add_f64s(eta, simd.add_f64s(bond, zeta[d][v]), e[v]);
            }
        }
        let inverse = simd.splat_f64s(self.inverse_square);
        for v in 0..VECTORS {
            e[v] = simd.mul_f64s(e[v], inverse);
        }
        let mut q = self.fit.vectors(simd, [start + part, there + part], e);
        let scale = simd.splat_f64s(self.scale * self.weights.share);
        for v in 0..VECTORS {
            q[v] = simd.mul_f64s(q[v], scale);
        }
        if let Some(factors) = &self.weights.factors {
            let mut sums = [zero; VECTORS];
            for d in 0..D {
                let own = vectors::<S>(simd, factors[d], start + part);
                let other = vectors::<S>(simd, factors[d], there + part);
                let cosine = simd.splat_f64s(2.0 * self.bond[d] * self.inverse_length);
                for v in 0..VECTORS {
                    let ratio = simd.div_f64s(cosine, simd.add_f64s(own[v], other[v]));
                    sums[v] = simd.mul_add_f64s(ratio, ratio, sums[v]);
                }
            }
            for v in 0..VECTORS {
                q[v] = simd.div_f64s(q[v], simd.sqrt_f64s(sums[v]));
            }
        }
        let words = &self.weights.words[start + part..][..VECTORS * S::F64_LANES];
        let (words, bit) = (&S::as_simd_u64s(words).0[..VECTORS], simd.splat_u64s(self.weights.bit));
        for v in 0..VECTORS {
            // values without a particle are arbitrary
            let intact = simd.equal_u64s(simd.and_u64s(words[v], bit), bit);
            q[v] = simd.select_f64s(intact, q[v], zero);
        }
        for d in 0..D {
            let out = &mut forces[d][part..][..VECTORS * S::F64_LANES];
            let out = &mut S::as_mut_simd_f64s(out).0[..VECTORS];
            for v in 0..VECTORS {
                out[v] = simd.mul_f64s(q[v], zeta[d][v]);
            }
        }
    }
}
