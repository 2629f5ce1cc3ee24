//! Bound of the greatest frequency of a [`super::NonlocalSolid`] at any deformation and with any bonds
//! broken, by Schur's test.
//!
//! F of a particle i depends on u_j by B_ij = V_j M⁻¹ξ/(|ξ|² Σ_J V_J), on its own displacement by b_i = |Σ_j
//! B_ij|. With k_i = ‖∂P/∂F‖ without the springs of the stabilisation, R_i = Σ_j |B_ij| + b_i and a_i = I_i
//! k_i R_i the Hessian K of the energy has
//!
//! K ≤ diag(V_j m_j), m_j = Σ_i (V_i/V_j) a_i |B_ij| + a_j b_j + springs, ρω² ≤ max m_j.
//!
//! This bound is proven but two to three times too large: waves on a lattice do not reach all signs that
//! Schur's test allows. The first two terms are therefore multiplied by [`WAVES`] and the springs by the
//! greatest of Σ_j ω(1 − cos k·ξ) over Σ_j ω, both measured. Shape tensors enter by R_i: a family of few
//! bonds is stiff, and its neighbours share that stiffness.

use super::nonlocal_solid::NonlocalSolid;
use super::point::{FrequencyTerms, SolidPoint};
use super::point_law::PointLaw;
use super::{DeformedBody, Family};
use crate::field::{CHUNK, chunk_range};
use crate::parallel;
use nalgebra::SVector;

/// Fraction of the bound by Schur's test that frequencies reach: at stretches of 1 to 3 and with up to half
/// of the bonds broken.
const WAVES: f64 = 0.4;

/// Fraction of a family below which its bonds are few.
const FEW: f64 = 0.7;

/// Greatest Σ_j ω 2(1 − cos k·ξ) over Σ_j ω in lattices.
fn greatest_wave<const D: usize>() -> f64 {
    if D == 2 { 2.6 } else { 2.4 }
}

impl<const D: usize> SolidPoint<D> {
    /// Computes R, b and Σ V/|ξ|² of the intact bonds.
    fn measure(&mut self, family: &Family<D>) {
        let (mut size, mut sum, mut squares) = (0.0, SVector::<f64, D>::zeros(), 0.0);
        let mut greatest = 0.0_f64;
        family.each(|bond| {
            let share = bond.volume / (bond.length * bond.length);
            let part = self.inverse * SVector::from(bond.reference) * (share / self.intact);
            size += part.norm();
            greatest = greatest.max(part.norm());
            sum += part;
            squares += share;
        });
        (self.reach.own, self.reach.squares) = (sum.norm(), squares);
        self.reach.size = size + self.reach.own;
        let bonds = self.whole / family.volume();
        let all = if self.integrity() > FEW { size } else { size.max(bonds * greatest) };
        self.reach.among = all + self.reach.own;
    }

    /// Computes the share of the law; returns the bound of ρω² if all neighbours are alike.
    fn stiffen_waves(&mut self, law: &(impl PointLaw<D> + ?Sized), family: &Family<D>) -> f64 {
        if self.intact <= 0.0 {
            (self.reach.front, self.reach.slope) = (0.0, 0.0);
            return 0.0;
        }
        if self.reach.size.is_nan() {
            self.measure(family);
        }
        let FrequencyTerms { size, among, squares, .. } = self.reach;
        if !self.has_gradient() {
            (self.reach.front, self.reach.slope) = (0.0, 0.0);
            return 4.0 * self.spring * squares;
        }
        let dimension = D as f64;
        // κ(F:δF + ½δr)² ≤ κ(|F| + √r)(|F||δF|² + √r D Σ ω|δz|²/I)
        let (norm, root) = (self.deformation.gradient().norm(), self.deformation.residual.sqrt());
        let mixed = law.residual_stiffness(&self.deformation) * root;
        let shear = self.slope * self.whole / dimension;
        let gradient = law.stiffness(&self.deformation) + mixed * norm - shear * self.shape.min(1.0);
        self.reach.slope = self.steepest() + dimension * mixed * (norm + root) / self.whole;
        self.reach.front = WAVES * self.integrity() * gradient.max(0.0) * size;
        self.reach.front * among + greatest_wave::<D>() * self.reach.slope * squares
    }
}

/// Computes m_j of a particle.
fn of_particle<const D: usize>(family: &Family<D>, points: &[SolidPoint<D>]) -> f64 {
    let own = &points[family.site()];
    let mut sum = own.reach.front * own.reach.own;
    family.each(|bond| {
        let other = &points[bond.to];
        let share = bond.volume / (bond.length * bond.length);
        if other.reach.front > 0.0 {
            let part = (other.inverse * SVector::<f64, D>::from(bond.reference)).norm();
            sum += other.reach.front * part * share / other.intact;
        }
        let waves = 0.5 * greatest_wave::<D>() * (own.reach.slope + other.reach.slope);
        sum += share * (waves + 2.0 * (own.spring + other.spring));
    });
    sum
}

/// Computes max m_j, or returns `enough` if that is larger.
pub fn bound<const D: usize>(
    solid: &NonlocalSolid<impl PointLaw<D>>,
    (bonds, displacement): DeformedBody<D>,
    points: &mut [SolidPoint<D>],
    enough: f64,
) -> f64 {
    let particles = bonds.particles();
    let of_chunk = |chunk: usize, points: &mut [SolidPoint<D>]| {
        let range = chunk_range(chunk, bonds.sites());
        let [from, to] =
            [range.start, range.end].map(|end| particles.partition_point(|&s| (s as usize) < end));
        let mut beyond = Vec::new();
        for &site in &particles[from..to] {
            let family = Family::new(bonds, displacement, site as usize);
            let point = &mut points[site as usize - range.start];
            if point.stiffen_waves(solid.law_of(point), &family) > enough {
                beyond.push(site);
            }
        }
        beyond
    };
    let beyond: Vec<Vec<u32>> = parallel::map_items(points.chunks_mut(CHUNK).collect(), of_chunk);
    // particles that have one of these in their family, and these themselves
    let mut near = beyond.concat();
    for site in beyond.concat() {
        bonds.neighbours(site as usize, &mut |bond| near.push(bond.site as u32));
    }
    near.sort_unstable();
    near.dedup();
    let points = &*points;
    let of = |&site: &u32| of_particle(&Family::new(bonds, displacement, site as usize), points);
    parallel::map_each(&near, of).into_iter().fold(enough, f64::max)
}
