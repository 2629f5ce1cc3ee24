//! Connects a lattice, and classifies its tiles for the kernel.

use super::LatticeBonds;
use crate::bonds::BodyGeometry;
use crate::bonds::lattice_kernel::{TILE, TileClass};
use crate::field::{CHUNK, chunk_range};
use crate::geometry::{Cut, Gaps, cell, cuts_within, severed};
use crate::parallel;

impl<const D: usize> LatticeBonds<D> {
    /// Bonds all pairs of occupied sites within the stencil, except those that cross a cut or a gap.
    pub(super) fn connect(&mut self, cuts: &[Cut<D>], gaps: Option<&Gaps<D>>) {
        let words = self.stencil.offsets.len().div_ceil(64);
        let occupied = self.occupancy();
        let mut reached = occupied.clone();
        self.images.iter().for_each(|image| reached[image.site as usize] = true);
        let bits = |site: usize| -> Vec<u64> {
            let mut bits = vec![0_u64; words];
            let Some(cell) = self.cell_of(site).filter(|_| occupied[site]) else { return bits };
            let here = self.position(site);
            let cuts = cuts_within(cuts, here, self.horizon());
            let gaps = gaps.and_then(|gaps| gaps.within(here, self.horizon()));
            let parted = |there: [f64; D]| {
                !cuts.is_empty() && severed(&cuts, here, there)
                    || gaps.as_ref().is_some_and(|gaps| gaps.severs(here, there))
            };
            for (k, offset) in self.stencil.offsets.iter().enumerate() {
                let there = self.cell_at(cell, *offset).filter(|&there| reached[there]);
                if there.is_some_and(|there| !parted(self.position(there))) {
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
        parallel::for_items(chunks, |chunk, mut parts| {
            for (index, site) in chunk_range(chunk, self.sites).enumerate() {
                if occupied[site] {
                    for (part, value) in parts.iter_mut().zip(bits(site)) {
                        part[index] = value;
                    }
                }
            }
        });
        self.intact = intact;
        self.sever_across_sides();
        let count = |bits: &Vec<u64>| bits.iter().map(|bits| u64::from(bits.count_ones())).sum::<u64>();
        self.directed_bonds = parallel::map_each(&self.intact, count).iter().sum();
    }

    /// Severs bonds across periodic sides that a cut parts, by rounding, as seen from one of their ends only.
    fn sever_across_sides(&mut self) {
        let opposite = self.stencil.offsets.len() - 1;
        for image in &self.images {
            // bonds that lead to the image, from their particles
            for k in 0..=opposite {
                let from = (image.site as usize).wrapping_add_signed(-self.spans[k].shift);
                if from >= self.sites {
                    continue;
                }
                let back = image.origin as usize;
                let [here, there] = [self.is_intact(from, k), self.is_intact(back, opposite - k)];
                if here && !there {
                    self.intact[k / 64][from] &= !(1 << (k % 64));
                }
            }
        }
    }

    /// Classifies the tiles by the checks that the kernel must make.
    pub(super) fn classify(&mut self) {
        let one = |site: usize| {
            self.factors.as_ref().is_none_or(|factors| factors.components().iter().all(|g| g[site] == 1.0))
        };
        let classes = self.classes_of(&self.intact, self.factors.is_some().then_some(&one));
        self.classes = classes;
    }

    /// Classifies tiles by their bonds; particles `plain` have factors of 1, all without it.
    pub(super) fn classes_of(
        &self,
        intact: &[Vec<u64>],
        plain: Option<&(dyn Fn(usize) -> bool + Sync)>,
    ) -> Vec<TileClass> {
        let bonds = self.stencil.offsets.len();
        let full: Vec<u64> = (0..intact.len()).map(|w| u64::MAX >> (64 - (bonds - 64 * w).min(64))).collect();
        let shifts: Vec<isize> = self.stencil.offsets.iter().map(|&o| self.shift(o)).collect();
        let (guard, sites) = (self.guard, self.sites);
        let uniform = |site: usize| {
            let Some(plain) = plain else { return true };
            plain(site) && shifts.iter().all(|&s| plain(site.wrapping_add_signed(s)))
        };
        let class = |tile: usize| {
            let mut range = tile * TILE..(tile + 1) * TILE;
            if range.clone().all(|s| intact.iter().all(|w| w[s] == 0)) {
                TileClass::Empty
            } else if range.start >= guard
                && range.end + guard <= sites
                && range.all(|s| intact.iter().zip(&full).all(|(w, f)| w[s] == *f) && uniform(s))
            {
                TileClass::Full
            } else {
                TileClass::Partial
            }
        };
        parallel::map(sites / TILE, class)
    }

    /// Returns, for each cell, whether a particle occupies it.
    pub fn occupancy(&self) -> Vec<bool> {
        let mut occupied = vec![false; self.sites];
        for &site in &self.particles {
            occupied[site as usize] = true;
        }
        occupied
    }

    /// Returns the site of the cell at `offset` from `cell`; `None` outside the box.
    pub fn cell_at(&self, cell: [usize; D], offset: [i32; D]) -> Option<usize> {
        let mut there = [0; D];
        for d in 0..D {
            there[d] =
                cell[d].checked_add_signed(offset[d] as isize).filter(|&c| c < self.lattice.cells[d])?;
        }
        Some(self.site(there))
    }

    /// Returns the cell of a site; `None` outside the box.
    pub fn cell_of(&self, site: usize) -> Option<[usize; D]> {
        let mut rest = site.checked_sub(self.guard)?;
        let mut cell = [0; D];
        for &d in self.order.iter().rev() {
            cell[d] = rest / self.strides[d];
            rest %= self.strides[d];
        }
        (0..D).all(|d| cell[d] < self.lattice.cells[d]).then_some(cell)
    }

    pub(super) fn site(&self, cell: [usize; D]) -> usize {
        self.guard + (0..D).map(|d| self.strides[d] * cell[d]).sum::<usize>()
    }

    /// Returns the sites of all particles, ascending.
    pub(super) fn occupied_sites(&self) -> Vec<u32> {
        let cells = self.lattice.cells;
        let mut particles: Vec<u32> = (0..self.lattice.occupied.len())
            .filter(|&index| self.lattice.occupied[index])
            .map(|index| self.site(cell(index, cells)) as u32)
            .collect();
        particles.sort_unstable();
        particles
    }
}
