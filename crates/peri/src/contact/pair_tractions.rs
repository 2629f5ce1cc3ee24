//! Tractions of particles on others that they touch.
//!
//! Others push on a particle of the undeformed volume V along n. Of a column of the lattice along the axis
//! nearest to n, one particle lies on the surface: it has the area V/(Δx max|n_d|).

use super::Contact;
use super::friction_pair::{ContactPair, across};
use super::tractions::SurfaceTraction;
use crate::bonds::BodyGeometry;
use crate::field::{CHUNK, Field, chunk_range};
use crate::geometry::length;
use crate::parallel;

impl<const D: usize> Contact<D> {
    /// Returns the traction on each particle that touches others at a displacement, by site, with forces of
    /// friction, N, by pair. Requires the pairs of this displacement, see [`Self::rebuild`]. The number of
    /// the surface is that after those of rigid surfaces.
    pub(super) fn pair_tractions(
        &self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        drags: &[(ContactPair, [f64; 3])],
    ) -> Vec<SurfaceTraction<D>> {
        let mut rubs: Vec<(u32, [f64; 3])> = drags
            .iter()
            .filter_map(|&(pair, force)| match pair {
                ContactPair::Particles(own, _) => Some((own, force)),
                _ => None,
            })
            .collect();
        rubs.sort_by_key(|rub| rub.0);
        let (surface, spacing) = (self.surfaces().count(), bonds.spacing());
        let of = |chunk: usize| {
            let mut found = Vec::new();
            for (own, touching) in self.pairs(bonds, displacement, chunk_range(chunk, bonds.sites()), 0.0) {
                let (site, volume) = (own.site as usize, bonds.volume(own.site as usize));
                let mut force = [0.0; D];
                for touch in touching {
                    let push = self.pair(own.site, touch.site) * touch.overlap();
                    let (push, direction) =
                        (push * volume * bonds.volume(touch.site as usize), touch.direction());
                    (0..D).for_each(|d| force[d] -= push * direction[d]);
                }
                let size = length(force);
                if size == 0.0 {
                    continue;
                }
                let normal = force.map(|x| x / size);
                let steepest = normal.iter().fold(0.0_f64, |most, n| most.max(n.abs()));
                let area = volume / (spacing * steepest);
                let first = rubs.partition_point(|rub| rub.0 < own.site);
                let own_rubs = rubs[first..].iter().take_while(|rub| rub.0 == own.site);
                let rub = own_rubs.fold([0.0; D], |sum, rub| std::array::from_fn(|d| sum[d] + rub.1[d]));
                let (here, moved) = (bonds.position(site), displacement.get(site));
                found.push(SurfaceTraction {
                    surface,
                    sites: vec![own.site],
                    place: std::array::from_fn(|d| here[d] + moved[d]),
                    normal,
                    area,
                    pressure: size / area,
                    shear: across(&normal, rub).map(|x| x / area),
                });
            }
            found
        };
        let parts: Vec<Vec<SurfaceTraction<D>>> = parallel::map(bonds.sites().div_ceil(CHUNK), of);
        parts.concat()
    }
}
