//! Damage of the bonds of a lattice.

use super::LatticeBonds;
use crate::bonds::lattice_kernel::{TILE, TileClass};
use crate::bonds::{BondDamage, Overstretched, Softened, SoftenedBonds};

impl<const D: usize> BondDamage<D> for LatticeBonds<D> {
    fn break_bonds(&mut self, bonds: &[Overstretched]) {
        sever(&mut self.intact, &mut self.classes, bonds);
        for pass in &mut self.passes {
            sever(&mut pass.intact, &mut pass.classes, bonds);
        }
        self.directed_bonds -= bonds.len() as u64;
    }

    fn softening(&self) -> &SoftenedBonds {
        &self.softening
    }

    fn soften(&mut self, bonds: Vec<Softened>) {
        self.softening.replace(bonds);
    }

    fn intact(&self) -> Vec<u64> {
        self.intact.concat()
    }

    fn bit(&self, site: usize, index: u32) -> (usize, u64) {
        (index as usize / 64 * self.sites + site, 1 << (index % 64))
    }

    fn restore(&mut self, words: &[u64]) -> bool {
        if words.len() != self.intact.len() * self.sites {
            return false;
        }
        for (own, saved) in self.intact.iter_mut().zip(words.chunks(self.sites)) {
            own.iter_mut().zip(saved).for_each(|(own, saved)| *own &= saved);
        }
        self.directed_bonds = self.intact.iter().flatten().map(|word| u64::from(word.count_ones())).sum();
        self.classify();
        for pass in &mut self.passes {
            pass.restore(&self.intact);
        }
        true
    }

    fn directed_bonds(&self) -> u64 {
        self.directed_bonds
    }
}

/// Clears the bits of bonds, and classifies their tiles again.
fn sever(intact: &mut [Vec<u64>], classes: &mut [TileClass], bonds: &[Overstretched]) {
    for bond in bonds {
        let (site, k) = (bond.site as usize, bond.index as usize);
        intact[k / 64][site] &= !(1 << (k % 64));
    }
    let mut tiles: Vec<usize> = bonds.iter().map(|bond| bond.site as usize / TILE).collect();
    tiles.dedup();
    for tile in tiles {
        let empty = (tile * TILE..(tile + 1) * TILE).all(|s| intact.iter().all(|w| w[s] == 0));
        classes[tile] = if empty { TileClass::Empty } else { TileClass::Partial };
    }
}
