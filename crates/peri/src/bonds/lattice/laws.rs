//! Forces of several laws on a lattice: a pass of the kernel for each law, over the bonds with an end of it.
//!
//! Tiles whose families have one law are those of a body of this law; where both ends of a bond have their
//! own, either pass has its share.

use super::LatticeBonds;
use crate::bonds::LawShares;
use crate::bonds::lattice_factors::Factors;
use crate::bonds::lattice_kernel::{TILE, TileClass, Tiles};
use crate::bonds::law_shares::add_force;
use crate::bonds::rows::{LatticeKernel, StencilBond, lattice_kernel};
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;
use crate::potential::{KernelFit, StretchRange};

/// Relative difference of factors that are the same up to rounding.
const ROUNDING: f64 = 1e-12;

/// A law of the kernel, and its bonds.
pub(super) struct LawPass<const D: usize> {
    kernel: Box<dyn LatticeKernel<D>>,
    /// Factor of the law's particles, by site; 0 at others.
    own: Vec<f64>,
    /// Stiffness of all particles, by site, unless a bond's weight is the mean of both ends' factors.
    whole: Option<Vec<f64>>,
    /// Bits of the intact bonds with an end of this law.
    pub intact: Vec<Vec<u64>>,
    pub classes: Vec<TileClass>,
}

impl<const D: usize> LawPass<D> {
    /// Severs the bonds that are not intact in `words`.
    pub fn restore(&mut self, words: &[Vec<u64>]) {
        for (tile, class) in self.classes.iter_mut().enumerate() {
            let (mut severed, mut left) = (0, 0);
            for (own, saved) in self.intact.iter_mut().zip(words) {
                for site in tile * TILE..(tile + 1) * TILE {
                    severed |= own[site] & !saved[site];
                    own[site] &= saved[site];
                    left |= own[site];
                }
            }
            if severed != 0 {
                *class = if left == 0 { TileClass::Empty } else { TileClass::Partial };
            }
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let whole = self.whole.as_ref().map_or(0, Vec::len);
        8 * (self.own.len() + whole + self.intact.iter().map(Vec::len).sum::<usize>()) + self.classes.len()
    }

    /// Weights of the law's bonds.
    fn factors<'a>(&'a self, along: Option<&'a Field<D>>) -> Factors<'a, D> {
        match &self.whole {
            None => Factors::Even(&self.own),
            Some(whole) => Factors::Shared { along: along.map(Field::components), own: &self.own, whole },
        }
    }
}

impl<const D: usize> LatticeBonds<D> {
    /// Builds the passes of several laws; `None` if one of them has no kernel.
    pub(super) fn passes_of(
        &self,
        fits: &[&KernelFit],
        modulus: f64,
        shares: &LawShares,
    ) -> Option<Vec<LawPass<D>>> {
        let mut whole = vec![0.0; self.sites];
        for law in 0..shares.laws() {
            whole.iter_mut().zip(shares.stiffness_of(law)).for_each(|(whole, own)| *whole += own);
        }
        // c_I/(c_I + c_J) of the weight ½(g_I + g_J) is ½ g_I if factors are the stiffness
        let factor = |site: usize| self.factors.as_ref().map_or(1.0, |factors| factors.get(site)[0]);
        let first = self.particles[0] as usize;
        let ratio = factor(first) / whole[first];
        let follows = |&site: &u32| {
            let (found, expected) = (factor(site as usize), ratio * whole[site as usize]);
            (found - expected).abs() <= ROUNDING * found
        };
        let mean = self.even && self.particles.iter().all(follows);
        let stencil = self.stencil_bonds(modulus);
        let pass = |(law, &fit): (usize, &&KernelFit)| {
            let mut own = shares.stiffness_of(law).to_vec();
            let mut unit = 1.0;
            if mean {
                // of the first particle, so that tiles of one law and stiffness need no factors
                unit = own.iter().position(|&c| c > 0.0).map_or(1.0, factor);
                let relative = |site: usize| {
                    let relative = factor(site) / unit;
                    if (relative - 1.0).abs() < ROUNDING { 1.0 } else { relative }
                };
                own.iter_mut().enumerate().filter(|(_, c)| **c > 0.0).for_each(|(s, c)| *c = relative(s));
            }
            let scaled = |bond: &StencilBond<D>| StencilBond { stiffness: unit * bond.stiffness, ..*bond };
            let kernel = lattice_kernel(fit, &stencil.iter().map(scaled).collect::<Vec<_>>())?;
            let intact = self.bonds_with(&own);
            let one = |g: &[f64; D]| g.iter().all(|&g| g == 1.0);
            let plain = |site: usize| match mean {
                true => own[site] == 1.0,
                false => own[site] == whole[site] && self.factors.as_ref().is_none_or(|g| one(&g.get(site))),
            };
            let classes = self.classes_of(&intact, Some(&plain));
            let whole = (!mean).then(|| whole.clone());
            Some(LawPass { kernel, own, whole, intact, classes })
        };
        fits.iter().enumerate().map(pass).collect()
    }

    /// Returns the bits of the intact bonds with an end at which `own` is not 0.
    fn bonds_with(&self, own: &[f64]) -> Vec<Vec<u64>> {
        let bits = |site: usize, word: usize| {
            let mut bits = self.intact[word][site];
            if own[site] != 0.0 {
                return bits;
            }
            let mut left = bits;
            while left != 0 {
                let k = left.trailing_zeros() as usize;
                left &= left - 1;
                let other = site.wrapping_add_signed(self.spans[64 * word + k].shift);
                if own[other] == 0.0 {
                    bits &= !(1 << k);
                }
            }
            bits
        };
        let chunk = |word: usize, chunk: usize| -> Vec<u64> {
            chunk_range(chunk, self.sites).map(|site| bits(site, word)).collect()
        };
        let chunks = self.sites.div_ceil(CHUNK);
        (0..self.intact.len()).map(|word| parallel::map(chunks, |c| chunk(word, c)).concat()).collect()
    }

    /// Computes [`crate::bonds::BondForces::force`] of several laws.
    pub(super) fn force_of_laws(
        &self,
        displacement: &Field<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
        mut track: Option<&mut StretchRange>,
    ) {
        force.iter_mut().for_each(|force| force.fill(0.0));
        let end = start + force[0].len();
        for pass in &self.passes {
            let factors = Some(pass.factors(self.factors.as_ref()));
            let tiles =
                Tiles { intact: &pass.intact, classes: &pass.classes, factors, ..self.tiles(displacement) };
            let has_bonds = |tile: &usize| pass.classes[*tile] != TileClass::Empty;
            let (first, last) = (start / TILE, end / TILE);
            // tiles of other laws at both ends are passed over
            let Some(first) = (first..last).find(has_bonds) else { continue };
            let last = (first..last).rfind(has_bonds).map_or(first, |last| last + 1);
            add_force(force, start, first * TILE..last * TILE, |from, part| {
                pass.kernel.run(&tiles, from, part, track.as_deref_mut());
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bonds::{BodyGeometry, BondDamage, BondForces, Overstretched, VolumeCorrection, force};
    use crate::geometry::{Operation, Shape, lattice};
    use crate::potential::Law;

    /// Evaluates each bond once inside of a part and twice across its border, with the whole tiles of the
    /// kernel inside; a bond that breaks breaks in the passes of both laws.
    #[test]
    fn bonds_of_one_law_take_one_pass() {
        let body = [Operation::Add(Shape::Box { min: [0.0; 2], max: [20.0, 160.0] })];
        let built = lattice(&body, 1.0, 1.0).unwrap();
        let mut bonds = LatticeBonds::new(built, 3.015, VolumeCorrection::None, &[]).unwrap();
        let is_part = |place: [f64; 2]| place[1] > 80.0;
        let shares = LawShares::new(&bonds, 2, |_, place| (usize::from(is_part(place)), 1.0)).unwrap();
        let law = Law::Linear.build(1.0, 1.0, false).unwrap();
        let fit = KernelFit::new(&*law, [0.5, 2.0], 1e-9).unwrap();
        assert!(bonds.set_laws(&[&fit; 2], 1.0, &shares));
        let count =
            |words: &[Vec<u64>]| words.iter().flatten().map(|w| u64::from(w.count_ones())).sum::<u64>();
        let mut across = Vec::new();
        for &site in bonds.particles() {
            let here = is_part(bonds.position(site as usize));
            bonds.neighbours(site as usize, &mut |bond| {
                if is_part(bonds.position(bond.site)) != here {
                    across.push((site, bond.index, bond.site));
                }
            });
        }
        let passes: u64 = bonds.passes.iter().map(|pass| count(&pass.intact)).sum();
        assert_eq!(passes, bonds.directed_bonds() + across.len() as u64);
        let tiles = |classes: &[TileClass], class| classes.iter().filter(|&&own| own == class).count();
        let whole = tiles(&bonds.classes, TileClass::Full);
        let found: usize = bonds.passes.iter().map(|pass| tiles(&pass.classes, TileClass::Full)).sum();
        // families reach three particles of a row of 16 or more across the border
        assert!(found < whole && whole - found <= 20, "{found} {whole}");
        let (site, index, other) = across[0];
        let broken = Overstretched { site, index, elongation: 0.0, length: 1.0, weight: 1.0 };
        let back = across.iter().find(|(own, _, there)| (*own as usize, *there) == (other, site as usize));
        let &(there, back, _) = back.unwrap();
        bonds.break_bonds(&[broken, Overstretched { site: there, index: back, ..broken }]);
        let after: u64 = bonds.passes.iter().map(|pass| count(&pass.intact)).sum();
        assert_eq!(after, passes - 4);
        // restored bits are those of bonds that broke
        let words = bonds.intact();
        let sums = |bonds: &LatticeBonds<2>| {
            let mut displacement = Field::zeros(bonds.sites());
            for &site in bonds.particles() {
                let [x, y] = bonds.position(site as usize);
                displacement.set(site as usize, [0.1 * (x * y).sin(), 0.2 * y]);
            }
            let mut forces = Field::zeros(bonds.sites());
            force(bonds, &displacement, &mut forces);
            forces
        };
        let wanted = sums(&bonds);
        let built = lattice(&body, 1.0, 1.0).unwrap();
        let mut again = LatticeBonds::new(built, 3.015, VolumeCorrection::None, &[]).unwrap();
        assert!(again.set_laws(&[&fit; 2], 1.0, &shares) && again.restore(&words));
        assert!(sums(&again) == wanted);
        again.set_law(&fit, 1.0);
        let (one, two) = (sums(&again), wanted);
        for &site in again.particles() {
            let pair = [one.get(site as usize), two.get(site as usize)];
            assert!((0..2).all(|d| (pair[0][d] - pair[1][d]).abs() < 1e-12), "{pair:?}");
        }
    }
}
