//! Average of pressures over nearest neighbours: at a bulk modulus of a thousand shear moduli the pressures
//! of single particles are rough at corners of grips.

use super::nonlocal_solid::NonlocalSolid;
use super::point::SolidPoint;
use super::point_law::PointLaw;
use super::pointwise::copy_to_images;
use crate::bonds::BodyGeometry;
use crate::parallel;
use rayon::prelude::*;

/// The symmetric average b = 1 + (A − D)/(2·dimension + 1) of the particles of a lattice, with A = 1 between
/// nearest neighbours of one law whose bond is intact and D its sums over rows: rows of b sum to 1, and no
/// entry is negative.
#[derive(Default)]
pub(super) struct Filter {
    /// Neighbours of each site; `u32::MAX`: none.
    neighbours: Vec<[u32; 6]>,
    /// Values to average, site by site, and their averages.
    values: Vec<f64>,
    means: Vec<f64>,
}

impl Filter {
    /// Finds the neighbours after bonds have changed.
    pub(super) fn link<const D: usize>(
        &mut self,
        bonds: &dyn BodyGeometry<D>,
        points: &[SolidPoint<D>],
        spacing: f64,
    ) {
        let of = |site: usize| {
            let mut found = [u32::MAX; 6];
            if points[site].has_gradient() {
                let mut places = found.iter_mut();
                bonds.neighbours(site, &mut |bond| {
                    if bond.length < 1.1 * spacing
                        && points[bond.site].has_gradient()
                        && points[bond.site].law == points[site].law
                        && let Some(place) = places.next()
                    {
                        *place = bond.site as u32;
                    }
                });
            }
            found
        };
        self.neighbours = parallel::map(points.len(), of);
    }

    /// Changes the energy to Σ_I V_I I_I U((bJ)_I): with p_I = Σ_J b_IJ I_J U′((bJ)_J)/I_I in place of
    /// U′(J_I), forces are its exact variation.
    pub(super) fn apply<L: PointLaw<D>, const D: usize>(
        &mut self,
        solid: &NonlocalSolid<L>,
        bonds: &dyn BodyGeometry<D>,
        points: &mut [SolidPoint<D>],
    ) {
        let change = |point: &SolidPoint<D>| point.deformation().map_or(0.0, |found| found.volume_change());
        self.values = parallel::map_each(points, change);
        self.average(bonds);
        let parts = points.par_iter_mut().zip(&self.means).zip(&self.values);
        let slopes = parts.map(|((point, &mean), &change)| {
            if !point.has_gradient() {
                return 0.0;
            }
            let own = |change: f64| solid.law_of(point).filtered(change).unwrap_or_default();
            let ([before, slope], [after, smooth]) = (own(change), own(mean));
            point.filtered = [after - before, -slope];
            point.integrity() * smooth
        });
        let slopes: Vec<f64> = slopes.collect();
        self.values = slopes;
        self.average(bonds);
        points.par_iter_mut().zip(&self.means).filter(|(point, _)| point.has_gradient()).for_each(
            |(point, mean)| {
                point.filtered[1] += mean / point.integrity();
            },
        );
    }

    fn average<const D: usize>(&mut self, bonds: &dyn BodyGeometry<D>) {
        let (values, share) = (&self.values, 1.0 / (2 * D + 1) as f64);
        let of = |site: usize| {
            let others = self.neighbours[site].iter().take_while(|&&site| site != u32::MAX);
            let own = values[site];
            own + share * others.map(|&site| values[site as usize] - own).sum::<f64>()
        };
        self.means = parallel::map(values.len(), of);
        copy_to_images(bonds, &mut self.means);
    }
}
