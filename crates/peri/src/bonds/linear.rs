//! Sums over the bonds of a lattice: energies, and both passes of materials whose forces are linear in a
//! bond.

use super::LatticeBonds;
use super::kernel::dispatch;
use super::linear_kernel::{self, LinearPass, LinearRow, MomentPass, Moments};
use crate::bonds::BodyGeometry;
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;
use crate::potential::StretchRange;

impl<const D: usize> LatticeBonds<D> {
    /// Computes Σ_I V_I Σ_J w V_J |ξ| φ(e), each bond once; `None` if bonds have their own weights.
    pub fn energy(&self, displacement: &Field<D>, energy: impl Fn(f64) -> f64 + Sync) -> Option<f64> {
        if !self.is_uniform() {
            return None;
        }
        let (sites, volume) = (self.sites(), self.lattice().volume);
        let spans = self.spans(displacement);
        let of = |chunk: usize| spans.energy(chunk_range(chunk, sites), &energy);
        Some(2.0 * volume * volume * parallel::sum(sites.div_ceil(CHUNK), of))
    }

    /// Builds the stencil for [`Self::moments`] and [`Self::linear_force`].
    pub fn linear_rows(&self) -> Vec<LinearRow<D>> {
        let spacing = self.spacing();
        let row = |(k, &offset): (usize, &[i32; D])| {
            let length = self.stencil().length(k) * spacing;
            let volume =
                self.lattice().volume * self.volume_correction().factor(length, self.horizon(), spacing);
            let inverse_square = 1.0 / (length * length);
            LinearRow {
                shift: self.shift(offset),
                bond: offset.map(|o| f64::from(o) * spacing),
                share: volume * inverse_square,
                inverse_square,
            }
        };
        self.stencil().offsets.iter().enumerate().map(row).collect()
    }

    /// Computes Σ_J (V_J/|ξ|²)|η|² and Σ_J (V_J/|ξ|²) η⊗ξ of the particles of work item `chunk`, tile by
    /// tile: `visit` receives the first site of a tile. N = 1 + D²; tiles without bonds are skipped.
    pub fn moments<const N: usize>(
        &self,
        rows: &[LinearRow<D>],
        displacement: &Field<D>,
        chunk: usize,
        visit: &mut dyn FnMut(usize, &Moments<N>),
    ) {
        let range = chunk_range(chunk, self.sites());
        let (start, length, tiles) = (range.start, range.len(), &self.tiles(displacement));
        linear_kernel::moments(MomentPass { rows, tiles, start, length, visit });
    }

    /// Computes Σ_J (V_J/|ξ|²)[(A_I + A_J) η + (S_I + S_J) ξ] of the particles of work item `chunk`, with
    /// `terms` = (A, S row by row).
    pub fn linear_force<const N: usize>(
        &self,
        rows: &[LinearRow<D>],
        displacement: &Field<D>,
        terms: &Field<N>,
        chunk: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) {
        let (tiles, terms) = (&self.tiles(displacement), terms.components());
        let start = chunk_range(chunk, self.sites()).start;
        dispatch(LinearPass { rows, tiles, terms }, start, force, track);
    }
}
