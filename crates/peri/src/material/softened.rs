//! Bond laws whose bonds soften before they break: the force that the few softened bonds of a body have lost
//! relative to the law of the kernels.

use super::{Bond, BondMaterial};
use crate::bonds::{BondForces, Property};
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;
use crate::potential::{BondSoftening, EnergyTable, KernelFit};

/// Softening of the bonds of a body.
#[derive(Clone)]
pub(super) struct BodySoftening {
    pub law: BondSoftening,
    /// λ_f.
    pub end: Property,
    /// λ₀ of bonds that soften by another e_f than that of `law`; `None`: there are none.
    pub onset: Option<Property>,
}

impl BodySoftening {
    /// Softening of a bond, by its sites, with its λ_f.
    pub fn of_bond(&self, from: usize, to: usize) -> (BondSoftening, f64) {
        let end = self.end.weaker(from, to);
        let Some(onset) = self.onset.as_ref().filter(|_| end.is_finite()) else { return (self.law, end) };
        let ductility = (end - 1.0) / (onset.weaker(from, to) - 1.0);
        (BondSoftening { ductility, ..self.law }, end)
    }

    fn least_onset(&self) -> f64 {
        self.onset.as_ref().map_or_else(|| self.law.onset(self.end.least()), Property::least)
    }
}

/// Softened bonds of a displacement, by work items: site, and the force density lost by its bonds, N/m³ (to
/// be added).
#[derive(Default)]
pub(super) struct SofteningLoss(Vec<Vec<(u32, [f64; 3])>>);

/// Visits the bonds beyond the onset that a work item finds, with their softening and λ_f; all items together
/// find each bond from both ends.
fn each<const D: usize>(
    softening: &BodySoftening,
    bonds: &dyn BondForces<D>,
    displacement: &Field<D>,
    chunk: usize,
    visit: &mut dyn FnMut(&Bond<D>, (BondSoftening, f64)),
) {
    let least = softening.least_onset().powi(2) - 1.0;
    let sites = chunk_range(chunk, bonds.sites());
    for [site, index] in bonds.suspects(displacement, sites, least * (1.0 - 1e-9) - 1e-12) {
        let bond = Bond::new(site as usize, &bonds.bond(site as usize, index), displacement);
        visit(&bond, softening.of_bond(bond.from, bond.to));
    }
}

impl SofteningLoss {
    /// Collects the losses of a displacement, with the fit of the kernels.
    pub fn new<const D: usize>(
        material: &BondMaterial,
        soft: &BodySoftening,
        fit: &KernelFit,
        bonds: &dyn BondForces<D>,
        displacement: &Field<D>,
    ) -> Self {
        let (law, modulus) = (material.law(), material.modulus());
        let of = |chunk: usize| {
            let mut found: Vec<(u32, [f64; 3])> = Vec::new();
            each(soft, bonds, displacement, chunk, &mut |bond, (softening, end)| {
                let stretch = bond.stretch();
                let borne = softening.integrity(stretch, end);
                if borne < 1.0 {
                    let pull = borne * law.tension(stretch) / stretch - fit.value(bond.elongation());
                    let size = 2.0 * modulus * bond.weight / bond.length * pull;
                    let current = bond.current();
                    let force = std::array::from_fn(|d| if d < D { size * current[d] } else { 0.0 });
                    found.push((bond.from as u32, force));
                }
            });
            found
        };
        let count = bonds.sites().div_ceil(CHUNK);
        let parts: Vec<Vec<(u32, [f64; 3])>> = parallel::map(count, of);
        // an item may have found the other end of its bonds in another one
        let mut items = vec![Vec::new(); count];
        for found in parts.into_iter().flatten() {
            items[found.0 as usize / CHUNK].push(found);
        }
        Self(items)
    }

    /// Adds the losses of the sites of `force`, from `start` on in one work item.
    pub fn add<const D: usize>(&self, start: usize, force: &mut [&mut [f64]; D]) {
        let Some(lacking) = self.0.get(start / CHUNK) else { return };
        let sites = start..start + force[0].len();
        for (site, more) in lacking.iter().filter(|(site, _)| sites.contains(&(*site as usize))) {
            (0..D).for_each(|d| force[d][*site as usize - start] += more[d]);
        }
    }
}

/// Energy lost by softened bonds relative to `table`, over kθ.
pub(super) fn lacking_energy<const D: usize>(
    material: &BondMaterial,
    soft: &BodySoftening,
    table: &EnergyTable,
    bonds: &dyn BondForces<D>,
    displacement: &Field<D>,
) -> f64 {
    let law = material.law();
    let of = |chunk: usize| {
        let mut sum = 0.0;
        each(soft, bonds, displacement, chunk, &mut |bond, (softening, end)| {
            let stretch = bond.stretch();
            if softening.integrity(stretch, end) < 1.0 {
                let more = softening.energy(law, stretch, end) - table.value(bond.elongation());
                sum += bonds.volume(bond.from) * bond.weight * bond.length * more;
            }
        });
        sum
    };
    parallel::sum(bonds.sites().div_ceil(CHUNK), of)
}
