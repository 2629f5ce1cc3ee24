//! Virial of the forces between particles: the volume of a body times its mean stress.

use super::{Family, Material};
use crate::bonds::BodyGeometry;
use crate::field::{CHUNK, Field};
use crate::parallel;
use crate::stress::StressTensor;

/// Computes ½ Σ_I V_I Σ_J f_IJ ⊗ ξ_IJ V_J, N·m, with f_IJ the force densities of bonds and `points` the
/// states of all sites. Over the volume it is the mean first Piola–Kirchhoff stress of a cell with periodic
/// sides: ∂E/∂H of a homogeneous change of all displacements, in equilibrium that of the mean displacement
/// gradient (Hill 1972, doi:10.1098/rspa.1972.0001).
pub fn virial<M: Material<D>, const D: usize>(
    material: &M,
    points: &[M::Point],
    bonds: &dyn BodyGeometry<D>,
    displacement: &Field<D>,
) -> StressTensor<D> {
    let of = |sites: &[u32]| {
        let mut sum = [[0.0; D]; D];
        for site in sites.iter().map(|&site| site as usize) {
            let volume = bonds.volume(site);
            Family::new(bonds, displacement, site).each(|bond| {
                let force = material.force(&bond, &points[site], &points[bond.to]);
                let factor = 0.5 * volume * bond.volume;
                for (row, force) in sum.iter_mut().zip(force) {
                    for (entry, reference) in row.iter_mut().zip(bond.reference) {
                        *entry += factor * force * reference;
                    }
                }
            });
        }
        sum
    };
    let parts: Vec<StressTensor<D>> = parallel::map_chunks(bonds.particles(), CHUNK, of);
    let add = |a: StressTensor<D>, b: StressTensor<D>| {
        std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + b[i][j]))
    };
    parts.into_iter().fold([[0.0; D]; D], add)
}
