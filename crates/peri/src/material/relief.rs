//! Relief field θ with which irregular clouds pass the patch test, computed once.
//!
//! Families of an irregular cloud see B_IJ = ω_IJ M⁻¹ξ of each bond, F = Σ_J ζ⊗B_IJ. Uniform stress P leaves
//! the force −P h_I on a particle, h_I = Σ_J (V_J B_JI − V_I B_IJ), which is 0 inside a lattice but not in a
//! cloud. With B_IJ + ω_IJ z_IJ(θ), z(θ) = θ_J − θ_I − G ξ, G = Σ_J ω (θ_J − θ_I)⊗ξ M⁻¹, affine deformations
//! stay exact (Σ_J ω z⊗ξ = 0), and h + Lθ replaces h, with L of the stabilisation, f = −Lu for A = 1 and P =
//! 0: symmetric and positive definite as soon as some particles have θ = 0. Cf. Chen, Hillman & Rüter 2013,
//! doi:10.1002/nme.4512.

use super::point::LEAST_SHAPE;
use super::spline_levels::SplineLevels;
use super::tensor::{Vector, invert};
use crate::bonds::{BodyGeometry, BondKind, Bonds, CloudBonds, CloudPlaces, MomentColumns};
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;
use nalgebra::SMatrix;
use polycore::numerics::conjugate_gradients;

/// Largest |h + Lθ| over the largest |h| inside.
const TOLERANCE: f64 = 1e-13;
/// Iteration limit; 10⁴ particles take 140 in a plane body, 50 in a solid one.
const MOST_ITERATIONS: usize = 1000;
/// Cosine of half the angle of a cone without neighbours that only surface particles have.
const OPEN: f64 = 0.5;
/// Spacings within which such a cone has no neighbour.
const NEAR: f64 = 2.0;

/// Computes θ with h + Lθ = 0 in all particles whose family no surface cuts, and θ = 0 elsewhere, for
/// [`crate::bonds::BondForces::set_relief`]; `None` if there is no such particle, and for lattices, which
/// need none. Call it before any bond breaks: θ then stays constant, and the remaining bonds keep their part
/// of the correction, so that forces follow from an energy however many break.
pub fn relief<const D: usize>(bonds: &dyn Bonds<D>) -> Option<Field<D>> {
    let BondKind::Cloud(cloud) = bonds.kind() else { return None };
    let inside = complete(cloud);
    inside.contains(&true).then(|| ReliefProblem::new(cloud, inside).solve())
}

/// Marks the families inside the body: no bond leads to a surface particle nearer than δ − ½Δx (its half cell
/// ends there), and no cut divides them.
fn complete<const D: usize>(cloud: &CloudBonds<D>) -> Vec<bool> {
    let directions = directions::<D>();
    let sites = cloud.sites();
    let exposed: Vec<bool> = parallel::map(sites, |site| is_exposed(cloud, site, &directions));
    let reach = cloud.horizon() - 0.5 * cloud.spacing();
    let is_inside = |site: usize| {
        let mut inside = !exposed[site] && cloud.parted().binary_search(&(site as u32)).is_err();
        cloud.neighbours(site, &mut |bond| inside &= !(exposed[bond.site] && bond.length <= reach));
        inside
    };
    parallel::map(sites, is_inside)
}

/// Returns true if a particle lies at a surface: some cone of 120° holds none of its near neighbours.
fn is_exposed<const D: usize>(cloud: &CloudBonds<D>, site: usize, directions: &[[f64; D]]) -> bool {
    let own = (cloud.volume(site) / cloud.thickness()).powf(1.0 / D as f64);
    let reach = NEAR * own.max(cloud.spacing());
    let mut open: Vec<[f64; D]> = directions.to_vec();
    cloud.neighbours(site, &mut |bond| {
        if bond.length <= reach {
            let along = |to: &[f64; D]| (0..D).map(|d| to[d] * bond.bond[d]).sum::<f64>();
            open.retain(|to| along(to) < OPEN * bond.length);
        }
    });
    !open.is_empty()
}

/// Unit vectors in all directions: of a circle, and of Fibonacci's spiral on a sphere.
fn directions<const D: usize>() -> Vec<[f64; D]> {
    use std::f64::consts::PI;
    let count = if D == 2 { 48 } else { 200 };
    let turn = if D == 2 { 2.0 * PI / count as f64 } else { PI * (3.0 - 5.0_f64.sqrt()) };
    let place = |k: usize| {
        let (sine, cosine) = (turn * k as f64).sin_cos();
        let height = if D == 2 { 0.0 } else { 1.0 - (2.0 * k as f64 + 1.0) / count as f64 };
        let radius = (1.0 - height * height).sqrt();
        let all = [radius * cosine, radius * sine, height];
        std::array::from_fn(|d| all[d])
    };
    (0..count).map(place).collect()
}

struct ReliefProblem<'a, const D: usize> {
    cloud: &'a CloudBonds<D>,
    places: CloudPlaces<D>,
    terms: Vec<MomentColumns<D>>,
    force: Field<D>,
    inside: Vec<bool>,
    /// Σ_J V_J and M⁻¹ of each family; 0 if it does not span space.
    families: Vec<(f64, SMatrix<f64, D, D>)>,
}

impl<'a, const D: usize> ReliefProblem<'a, D> {
    fn new(cloud: &'a CloudBonds<D>, mut inside: Vec<bool>) -> Self {
        let family = |site: usize| {
            let (mut shape, mut whole) = (SMatrix::<f64, D, D>::zeros(), 0.0);
            cloud.neighbours(site, &mut |bond| {
                let xi = Vector::from(bond.bond);
                whole += bond.volume;
                shape += xi * xi.transpose() * (bond.volume / (bond.length * bond.length));
            });
            let (inverse, least) = if whole > 0.0 { invert(&(shape / whole)) } else { (shape, 0.0) };
            if D as f64 * least > LEAST_SHAPE { (whole, inverse) } else { (0.0, SMatrix::zeros()) }
        };
        let families: Vec<_> = parallel::map(cloud.sites(), family);
        inside.iter_mut().zip(&families).for_each(|(inside, (whole, _))| *inside &= *whole > 0.0);
        let (places, terms) = (cloud.bare_places(), vec![[[0.0; 4]; D]; cloud.sites()]);
        Self { cloud, places, terms, force: Field::zeros(cloud.sites()), inside, families }
    }

    /// Solves by conjugate gradients. L is similar to a biharmonic operator: with its diagonal alone,
    /// iterations grow as the square of the body's size.
    fn solve(mut self) -> Field<D> {
        let sites = self.cloud.sites();
        // −h
        let mut residual = self.apply(None);
        let scale: Vec<f64> = parallel::map(sites, |site| self.diagonal(site));
        let allowed = TOLERANCE * largest(&residual);
        // Lθ is about ¼m ∫(Δθ)², m = Σωξ₁⁴, for smooth fields
        let fourth = if D == 2 { 3.0 / 16.0 } else { 3.0 / 25.0 } * self.cloud.horizon().powi(2);
        let cloud = self.cloud;
        let mut levels = SplineLevels::new(cloud, &self.inside, 0.25 * fourth);
        let precondition = |residual: &[Vector<D>], scaled: &mut [Vector<D>]| {
            parallel::for_chunks(scaled, CHUNK, |chunk, scaled| {
                let range = chunk_range(chunk, sites);
                let each = scaled.iter_mut().zip(&residual[range.clone()]).zip(&scale[range]);
                each.for_each(|((scaled, r), scale)| *scaled = r / *scale);
            });
            levels.add(cloud, residual, scaled);
        };
        let product = |search: &[Vector<D>], image: &mut [Vector<D>]| {
            // −L p
            let force = self.apply(Some(search));
            image.iter_mut().zip(force).for_each(|(image, force)| *image = -force);
        };
        let dot = |a: &[Vector<D>], b: &[Vector<D>]| sum(sites, |site| a[site].dot(&b[site]));
        let reached = |residual: &[Vector<D>]| largest(residual) <= allowed;
        let (theta, _) =
            conjugate_gradients(&mut residual, MOST_ITERATIONS, reached, product, precondition, dot);
        let mut field = Field::zeros(sites);
        theta.iter().enumerate().for_each(|(site, &theta)| field.set(site, theta.into()));
        field
    }

    /// Computes −h, or −Lu, inside, m² (2D: times the thickness) and m³: forces on particles for P = 1, and
    /// for A = 1.
    fn apply(&mut self, displacement: Option<&[Vector<D>]>) -> Vec<Vector<D>> {
        if let Some(displacement) = displacement {
            let mut field = Field::zeros(displacement.len());
            displacement.iter().enumerate().for_each(|(site, &value)| field.set(site, value.into()));
            self.places.load(&field);
        }
        let Self { cloud, places, terms, force, inside, families } = self;
        let (cloud, places) = (*cloud, &*places);
        parallel::for_chunks(terms, CHUNK, |chunk, terms| {
            cloud.moments(places, chunk, &mut |site, moments| {
                let (whole, inverse) = &families[site];
                let columns = &mut terms[site - chunk * CHUNK];
                if *whole > 0.0 {
                    let moment = SMatrix::<f64, D, D>::from_fn(|a, b| moments.first[b][a] / whole);
                    let stress = if displacement.is_some() { -moment * inverse } else { *inverse };
                    (0..D).for_each(|b| (0..D).for_each(|a| columns[b][a] = stress[(a, b)] / whole));
                    columns[0][3] = if displacement.is_some() { 1.0 / whole } else { 0.0 };
                }
            });
        });
        let terms = &*terms;
        parallel::for_items(force.chunks_mut(), |chunk, mut part| {
            cloud.linear_force(places, terms, chunk, &mut part, None);
        });
        let value = |site: usize| {
            let density = Vector::from(force.get(site));
            if inside[site] { density * cloud.volume(site) } else { Vector::zeros() }
        };
        parallel::map(cloud.sites(), value)
    }

    /// Approximate diagonal of L, m (2D: times the thickness).
    fn diagonal(&self, site: usize) -> f64 {
        let part = |site: usize| if self.families[site].0 > 0.0 { 1.0 / self.families[site].0 } else { 0.0 };
        let mut sum = 0.0;
        self.cloud.neighbours(site, &mut |bond| {
            sum += bond.volume / (bond.length * bond.length) * (part(site) + part(bond.site));
        });
        if sum > 0.0 { sum * self.cloud.volume(site) } else { 1.0 }
    }
}

fn largest<const D: usize>(field: &[Vector<D>]) -> f64 {
    field.iter().map(Vector::amax).fold(0.0, f64::max)
}

/// Sums a term in the order of the work items.
fn sum(sites: usize, term: impl Fn(usize) -> f64 + Sync) -> f64 {
    let of = |chunk: usize| chunk_range(chunk, sites).map(&term).sum::<f64>();
    parallel::sum(sites.div_ceil(CHUNK), of)
}
