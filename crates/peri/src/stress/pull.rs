//! Forces of the bonds of one type.

use super::Loaded;
use super::convolution::lanes;
use crate::bonds::{Bonds, LatticeBonds, TILE};
use crate::potential::KernelFit;
use pulp::{Arch, NullaryFnOnce};

/// f V_I V_J, N, of bond `k` from a tile of sites; zero where it is not intact. `out` has [`lanes`] numbers a site.
pub fn forces<const D: usize>(
    bonds: &LatticeBonds<D>,
    state: &Loaded<D>,
    k: usize,
    start: usize,
    out: &mut [f64],
) {
    let offset = bonds.stencil().offsets[k];
    let bond = offset.map(|o| f64::from(o) * bonds.lattice().spacing);
    let square: f64 = bond.iter().map(|x| x * x).sum();
    let there = start.wrapping_add_signed(bonds.shift(offset));
    // rows are padded: a bond that leaves the storage is never intact
    if there.checked_add(TILE).is_none_or(|end| end > bonds.sites()) {
        out.fill(0.0);
        return;
    }
    let volume = bonds.lattice().volume;
    let scale = 2.0 * state.modulus * volume * volume / square.sqrt();
    let displacement = state.displacement.components();
    Arch::new().dispatch(Pull { bonds, k, start, there, fit: state.fit, displacement, bond, square, scale, out });
}

/// scale·weight·q(e) ζ of a tile of bonds, from the displacements of both ends.
struct Pull<'a, const D: usize> {
    bonds: &'a LatticeBonds<D>,
    k: usize,
    start: usize,
    there: usize,
    fit: &'a KernelFit,
    displacement: [&'a [f64]; D],
    bond: [f64; D],
    square: f64,
    scale: f64,
    out: &'a mut [f64],
}

/// The numbers of a tile.
#[inline(always)]
fn tile(numbers: &[f64], start: usize) -> [f64; TILE] {
    let mut tile = [0.0; TILE];
    tile.copy_from_slice(&numbers[start..start + TILE]);
    tile
}

impl<const D: usize> NullaryFnOnce for Pull<'_, D> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        let weights = self.bonds.weights(self.start, self.k);
        let (mut q, mut zeta) = ([0.0; TILE], [[0.0; TILE]; D]);
        for d in 0..D {
            let (own, other) = (tile(self.displacement[d], self.start), tile(self.displacement[d], self.there));
            for i in 0..TILE {
                let eta = other[i] - own[i];
                q[i] += eta * (2.0 * self.bond[d] + eta);
                zeta[d][i] = self.bond[d] + eta;
            }
        }
        let inverse = 1.0 / self.square;
        for i in 0..TILE {
            q[i] *= inverse;
        }
        self.fit.values(&mut q);
        let mut scale = [0.0; TILE];
        for i in 0..TILE {
            // what lies where there is no particle may be anything
            scale[i] = if weights[i] == 0.0 { 0.0 } else { self.scale * weights[i] * q[i] };
        }
        let out = &mut self.out[..TILE * lanes::<D>()];
        for i in 0..TILE {
            for d in 0..D {
                out[i * lanes::<D>() + d] = scale[i] * zeta[d][i];
            }
        }
    }
}
