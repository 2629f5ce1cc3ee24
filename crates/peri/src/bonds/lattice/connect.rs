//! What bonds a lattice is built with, and what the kernel must look at for them.

use super::LatticeBonds;
use crate::bonds::Bonds;
use crate::bonds::lattice_kernel::{Class, TILE};
use crate::field::{CHUNK, chunk_range};
use crate::geometry::{Cut, cuts_within, severed};
use rayon::prelude::*;

impl<const D: usize> LatticeBonds<D> {
    /// Bonds of all pairs of occupied sites within the stencil, less those that cross a cut.
    pub(super) fn connect(&mut self, cuts: &[Cut<D>]) {
        let words = self.stencil.offsets.len().div_ceil(64);
        let occupied = self.occupancy();
        let bits = |site: usize| -> Vec<u64> {
            let mut bits = vec![0_u64; words];
            let Some(cell) = self.cell_of(site).filter(|_| occupied[site]) else { return bits };
            let here = self.position(site);
            let cuts = cuts_within(cuts, here, self.horizon());
            for (k, offset) in self.stencil.offsets.iter().enumerate() {
                let there = self.cell_at(cell, *offset).filter(|&there| occupied[there]);
                if there.is_some_and(|there| cuts.is_empty() || !severed(&cuts, here, self.position(there))) {
                    bits[k / 64] |= 1 << (k % 64);
                }
            }
            bits
        };
        let mut intact = vec![vec![0; self.sites]; words];
        let mut chunks: Vec<Vec<&mut [u64]>> = (0..self.sites.div_ceil(CHUNK)).map(|_| Vec::new()).collect();
        for word in &mut intact {
            for (chunk, part) in chunks.iter_mut().zip(word.chunks_mut(CHUNK)) {
                chunk.push(part);
            }
        }
        chunks.into_par_iter().enumerate().for_each(|(chunk, mut parts)| {
            for (index, site) in chunk_range(chunk, self.sites).enumerate() {
                if occupied[site] {
                    for (part, value) in parts.iter_mut().zip(bits(site)) {
                        part[index] = value;
                    }
                }
            }
        });
        self.directed_bonds = intact.par_iter().flatten().map(|word| u64::from(word.count_ones())).sum();
        self.intact = intact;
    }

    /// Sorts the tiles by what the kernel must look at.
    pub(super) fn classify(&mut self) {
        let bonds = self.stencil.offsets.len();
        let full: Vec<u64> =
            (0..self.intact.len()).map(|w| u64::MAX >> (64 - (bonds - 64 * w).min(64))).collect();
        let shifts: Vec<isize> = self.stencil.offsets.iter().map(|&o| self.shift(o)).collect();
        let (intact, factors, guard, sites) = (&self.intact, &self.factors, self.guard, self.sites);
        let uniform = |site: usize| {
            let Some(factors) = factors else { return true };
            let one = |s: usize| factors.components().iter().all(|g| g[s] == 1.0);
            one(site) && shifts.iter().all(|&s| one(site.wrapping_add_signed(s)))
        };
        let class = |tile: usize| {
            let mut range = tile * TILE..(tile + 1) * TILE;
            if range.clone().all(|s| intact.iter().all(|w| w[s] == 0)) {
                Class::Empty
            } else if range.start >= guard
                && range.end + guard <= sites
                && range.all(|s| intact.iter().zip(&full).all(|(w, f)| w[s] == *f) && uniform(s))
            {
                Class::Full
            } else {
                Class::Partial
            }
        };
        let classes = (0..sites / TILE).into_par_iter().map(class).collect();
        self.classes = classes;
    }
}
