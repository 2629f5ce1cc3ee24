//! Area of the cracks that form in a run, from the bonds that break.

use super::crossing::{Crossing, SHORT};
use crate::bonds::Bonds;
use crate::parallel;

/// Bonds of a body before loading, as far as its crack area needs them.
pub struct CrackArea {
    /// Σ_J w V_J |ξ_e|/|ξ| over short bonds, m³.
    short: f64,
    /// Intact bonds of a lattice, see [`crate::bonds::BondDamage::intact`].
    words: Vec<u64>,
    /// Short bonds of a cloud.
    pairs: Vec<[u32; 2]>,
}

impl CrackArea {
    /// Records a body whose bonds are intact except across its initial cracks.
    pub fn new<const D: usize>(bonds: &dyn Bonds<D>, crossing: &Crossing) -> Self {
        let (mut words, mut pairs) = (Vec::new(), Vec::new());
        if bonds.as_lattice().is_some() {
            words = bonds.intact();
        } else {
            let short = SHORT * bonds.spacing();
            for &site in bonds.particles() {
                bonds.neighbours(site as usize, &mut |bond| {
                    if bond.length <= short && (site as usize) < bond.site {
                        pairs.push([site, bond.site as u32]);
                    }
                });
            }
        }
        Self { short: crossing.short, words, pairs }
    }

    /// Computes the area of new cracks, m². Two particles up to 1.8 spacings apart are separated if their
    /// bond has broken and no particle is bonded to both. Thus a crack tip is counted up to a horizon behind
    /// its foremost broken bond, and scattered broken bonds beside the crack are not. By the formula of
    /// Cauchy and Crofton the area is Σ V_I V_J/|ξ| over these pairs, over ½ Σ_J V_J |ξ_e|/|ξ|: lines of all
    /// directions meet a surface in proportion to its area. With 1/|ξ| planes along the axes, at 45° and
    /// along (111) count the same to 2 % (cf. Boykov & Kolmogorov, ICCV 2003, doi:10.1109/ICCV.2003.1238310).
    pub fn area<const D: usize>(&self, bonds: &dyn Bonds<D>) -> f64 {
        let share = |site: usize, other: usize, length: f64| {
            let mut common = false;
            bonds.neighbours(site, &mut |bond| common = common || bonds.is_bonded(bond.site, other));
            if common { 0.0 } else { bonds.volume(site) * bonds.volume(other) / length }
        };
        let parted: f64 = if let Some(lattice) = bonds.as_lattice() {
            let stencil = lattice.stencil();
            let near: Vec<u32> =
                (0..stencil.offsets.len() as u32).filter(|&k| stencil.length(k as usize) <= SHORT).collect();
            let now = bonds.intact();
            let of = |&site: &u32| {
                let mut sum = 0.0;
                for &index in &near {
                    let (word, bit) = bonds.bit(site as usize, index);
                    if self.words[word] & !now[word] & bit != 0 {
                        let bond = bonds.bond(site as usize, index);
                        // each once
                        if (site as usize) < bond.site {
                            sum += share(site as usize, bond.site, bond.length);
                        }
                    }
                }
                sum
            };
            parallel::map_each(bonds.particles(), of).iter().sum()
        } else {
            let of = |&[a, b]: &[u32; 2]| {
                let (a, b) = (a as usize, b as usize);
                let apart = || {
                    let (from, to) = (bonds.position(a), bonds.position(b));
                    (0..D).map(|d| (to[d] - from[d]).powi(2)).sum::<f64>().sqrt()
                };
                if bonds.is_bonded(a, b) { 0.0 } else { share(a, b, apart()) }
            };
            parallel::map_each(&self.pairs, of).iter().sum()
        };
        2.0 * parted / self.short
    }
}
