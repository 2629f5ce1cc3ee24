//! Bonds of a body and their forces: a regular lattice without neighbour lists, or a cloud with them.

mod breaking;
mod cells;
mod cloud;
mod cloud_kernel;
mod cloud_laws;
mod cloud_linear;
mod cloud_lists;
mod kernel;
mod lattice;
mod lattice_factors;
mod lattice_kernel;
mod lattice_sums;
mod law_shares;
mod linear;
mod linear_kernel;
mod property;
mod real;
mod rows;
mod softening;
mod stencil;
mod traits;

pub use crate::geometry::Lattice;
pub use crate::potential::StretchRange;
pub use breaking::{
    Fragment, Overstretched, StretchScan, add_counterparts, components, counterpart, fingerprint, fragments,
    overstretched, sever_pairs,
};
pub use cells::CellGrid;
pub use cloud::CloudBonds;
pub use cloud_kernel::GROUP;
pub use cloud_linear::{CloudMoments, CloudPlaces, MomentColumns};
pub use lattice::{LatticeBonds, PeriodicImage};
pub use lattice_kernel::TILE;
pub use lattice_sums::GradientSums;
pub(crate) use lattice_sums::Weights;
pub use law_shares::LawShares;
pub use linear_kernel::{LinearRow, Moments};
pub use property::Property;
pub use softening::{Softened, SoftenedBonds, among};
pub use stencil::{Stencil, storage};
pub use traits::{BodyGeometry, BondDamage, BondForces, BondKind, Bonds, Neighbour};

#[cfg(feature = "gpu")]
pub(crate) use rows::Rational;

use crate::error::Error;
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;
use crate::potential::KernelFit;

/// Refuses a body in which a bond acts on one of its ends only: its forces would not sum to zero.
fn refuse_one_sided<const D: usize>(bonds: &dyn BodyGeometry<D>) -> Result<(), Error> {
    let Some(pair) = bonds.one_sided() else { return Ok(()) };
    let [here, there] = pair.map(|site| bonds.position(site));
    Err(Error::geometry(format!("the bond from {here:?} to {there:?} m has no counterpart")))
}

/// Builds the error of a quantity that is not finite at a site.
pub(crate) fn not_finite<const D: usize>(
    bonds: &dyn BodyGeometry<D>,
    quantity: &'static str,
    site: usize,
    step: usize,
    iteration: u64,
) -> Error {
    let particle = bonds.particles().partition_point(|&s| (s as usize) < site);
    Error::NotFinite { quantity, particle, position: bonds.position(site).to_vec(), step, iteration }
}

/// Computes the force densities of the whole body, N/m³.
pub fn force<const D: usize, B: BondForces<D> + ?Sized>(
    bonds: &B,
    displacement: &Field<D>,
    force: &mut Field<D>,
) {
    let sites = bonds.sites();
    parallel::for_items(force.chunks_mut(), |chunk, mut out| {
        debug_assert_eq!(chunk_range(chunk, sites).len(), out[0].len());
        bonds.force(displacement, chunk * CHUNK, &mut out, None);
    });
}

/// Computes the extremes of e = λ² − 1 over all intact bonds.
pub fn stretch_range<const D: usize, B: BondForces<D> + ?Sized>(
    bonds: &B,
    displacement: &Field<D>,
) -> StretchRange {
    let sites = bonds.sites();
    let ranges = parallel::map(sites.div_ceil(CHUNK), |chunk| bonds.stretches(displacement, chunk));
    ranges.into_iter().fold(StretchRange::REST, StretchRange::join)
}

/// Returns the range of bond stretches [λ_low, λ_high] of a displacement, with a margin for rounding: the
/// range of a fitted law.
pub fn covered_stretches<const D: usize>(bonds: &dyn BondForces<D>, displacement: &Field<D>) -> [f64; 2] {
    let range = stretch_range(bonds, displacement);
    [(1.0 + range.low).max(0.0).sqrt() - 1e-3, (1.0 + range.high).sqrt() + 1e-3].map(|s| s.max(1e-3))
}

/// Loops plainly over bonds, for laws that only a table represents.
fn plain_force<const D: usize>(
    bonds: &dyn BodyGeometry<D>,
    fit: &KernelFit,
    modulus: f64,
    displacement: &Field<D>,
    start: usize,
    force: &mut [&mut [f64]; D],
    mut track: Option<&mut StretchRange>,
) {
    for offset in 0..force[0].len() {
        let own = displacement.get(start + offset);
        let mut sum = [0.0; D];
        bonds.neighbours(start + offset, &mut |bond| {
            let other = displacement.get(bond.site);
            let eta: [f64; D] = std::array::from_fn(|d| other[d] - own[d]);
            let square = bond.length * bond.length;
            let e = (0..D).map(|d| eta[d] * (2.0 * bond.bond[d] + eta[d])).sum::<f64>() / square;
            let q = 2.0 * modulus * bond.weight / bond.length * fit.value(e);
            for d in 0..D {
                sum[d] += q * (bond.bond[d] + eta[d]);
            }
            if let Some(range) = track.as_deref_mut() {
                *range = range.join(StretchRange { low: e, high: e });
            }
        });
        for d in 0..D {
            force[d][offset] = sum[d];
        }
    }
}

/// Weight of a bond from its ends' surface-correction factors g: (Σ_d (n_d/ḡ_d)²)^(−1/2), ḡ = ½(g_I + g_J).
/// Madenci & Oterkus, Peridynamic Theory and Its Applications (2014), §4.2.
pub fn surface_weight<const D: usize>(bond: [f64; D], length: f64, own: [f64; D], other: [f64; D]) -> f64 {
    let sum: f64 = (0..D)
        .map(|d| {
            let mean = 0.5 * (own[d] + other[d]);
            (bond[d] / (length * mean)).powi(2)
        })
        .sum();
    1.0 / sum.sqrt()
}

/// Volume of a pair at distance r ≤ δ: full, or the linear partial volume clamp((δ + Δx/2 − r)/Δx, 0, 1) of a
/// particle that the horizon cuts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum VolumeCorrection {
    /// Full volumes, as printed in the thesis.
    #[default]
    None,
    /// Linear partial volume of the particles that the horizon cuts.
    Linear,
}

impl VolumeCorrection {
    /// Returns the factor for a bond of `length`.
    pub fn factor(self, length: f64, horizon: f64, spacing: f64) -> f64 {
        match self {
            Self::None => 1.0,
            Self::Linear => ((horizon + 0.5 * spacing - length) / spacing).clamp(0.0, 1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Operation, Shape, lattice};
    use crate::potential::Law;

    /// Finds and refuses a bond severed from one end only.
    #[test]
    fn a_one_sided_bond_is_found() {
        let body = [Operation::Add(Shape::Box { min: [0.0; 2], max: [6.0, 5.0] })];
        let mut regular =
            LatticeBonds::new(lattice(&body, 1.0, 1.0).unwrap(), 3.015, VolumeCorrection::None, &[]).unwrap();
        let points: Vec<[f64; 2]> =
            regular.particles().iter().map(|&s| regular.position(s as usize)).collect();
        let mut cloud =
            CloudBonds::new(&points, &[1.0; 30], 1.0, 3.015, VolumeCorrection::None, &[]).unwrap();
        for bonds in [&mut regular as &mut dyn Bonds<2>, &mut cloud] {
            assert_eq!(bonds.one_sided(), None);
            let site = bonds.particles()[7];
            let mut index = None;
            bonds.neighbours(site as usize, &mut |bond| index = index.or(Some(bond.index)));
            let index = index.unwrap();
            bonds.break_bonds(&[Overstretched { site, index, elongation: 0.0, length: 1.0, weight: 1.0 }]);
            assert_eq!(bonds.one_sided().map(|pair| pair[1]), Some(site as usize));
            assert!(refuse_one_sided(bonds).unwrap_err().to_string().contains("no counterpart"));
        }
    }

    /// Compares laws with stretches across the knee of the chain force, which need a table, with the exact
    /// law bond by bond, on both representations.
    #[test]
    fn laws_that_need_a_table() {
        let law = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
        let fit = KernelFit::new(&*law, [0.3, 1.25 * 720.0_f64.sqrt()], 1e-9).unwrap();
        assert!(fit.kind().starts_with("table"), "{}", fit.kind());
        let body = [Operation::Add(Shape::Box { min: [0.0; 2], max: [6.0, 5.0] })];
        let built = lattice(&body, 1.0, 1.0).unwrap();
        let points: Vec<[f64; 2]> =
            (0..30).map(|i| [f64::from(i % 6) + 0.5, f64::from(i / 6) + 0.5]).collect();
        let mut regular = LatticeBonds::new(built, 3.015, VolumeCorrection::None, &[]).unwrap();
        let mut cloud =
            CloudBonds::new(&points, &[1.0; 30], 1.0, 3.015, VolumeCorrection::None, &[]).unwrap();
        for bonds in [&mut regular as &mut dyn Bonds<2>, &mut cloud] {
            bonds.set_law(&fit, 0.7);
            let mut displacement = Field::zeros(bonds.sites());
            for &site in bonds.particles() {
                let [x, y] = bonds.position(site as usize);
                displacement.set(site as usize, [20.0 * x + 0.1 * y, 0.3 * (x * y).sin()]);
            }
            let mut found = Field::zeros(bonds.sites());
            force(bonds, &displacement, &mut found);
            for &site in bonds.particles() {
                let own = displacement.get(site as usize);
                let (mut exact, mut scale) = ([0.0; 2], 0.0_f64);
                bonds.neighbours(site as usize, &mut |bond| {
                    let other = displacement.get(bond.site);
                    let zeta: [f64; 2] = std::array::from_fn(|d| bond.bond[d] + other[d] - own[d]);
                    let length = zeta[0].hypot(zeta[1]);
                    let t = 2.0 * 0.7 * law.tension(length / bond.length);
                    scale = scale.max(t.abs());
                    exact = std::array::from_fn(|d| exact[d] + t * zeta[d] / length);
                });
                let found = found.get(site as usize);
                // 28 bonds, each within the fit's bound of the largest
                assert!(
                    (0..2).all(|d| (found[d] - exact[d]).abs() < 28.0 * 1e-9 * scale),
                    "{found:?} {exact:?}"
                );
            }
        }
    }
}
