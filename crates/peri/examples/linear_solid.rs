//! Your own material: the linear solid of ordinary state-based peridynamics, with any Poisson ratio.
//! Silling et al. 2007, doi:10.1007/s10659-007-9125-1, in D dimensions (2: plane strain).
//!
//! ```sh
//! cargo run --release --package peri --example linear_solid
//! ```

use peri::bonds::{BodyGeometry, LatticeBonds, VolumeCorrection};
use peri::calibrate::modulus_in;
use peri::geometry::{Operation, Shape, lattice};
use peri::material::{Bond, Family, Material, Property};
use peri::solver::{Lbfgs, Loads, Method, State, Support, System};

// ANCHOR: material
/// W = ½K θ² + ½α Σ_J (e − θ|ξ|/D)² V_J with the bonds' extensions e = |ζ| − |ξ|, the weighted volume m = Σ_J
/// |ξ|² V_J of the whole family, the dilatation θ = (D/m) Σ_J |ξ| e V_J and α = D(D + 2)μ/m.
#[derive(Clone)]
pub struct LinearSolid {
    /// Bulk modulus K, Pa; in plane strain K₃ + μ/3. A number for all particles, or a field.
    pub bulk: Property,
    /// Shear modulus μ, Pa.
    pub shear: Property,
}

/// State of a particle, from its family. W = ½α Σ e² V_J + ½b θ², because the mixed terms are sums over e.
#[derive(Clone, Default)]
pub struct Point {
    alpha: f64,
    /// D/m, 1/m⁵.
    share: f64,
    /// b = K − α(2m − Σ|ξ|² V_J)/D² with the sum over the intact bonds.
    balance: f64,
    dilatation: f64,
    /// Σ_J |∂θ/∂u_J|, 1/m.
    spread: f64,
}

impl<const D: usize> Material<D> for LinearSolid {
    type Point = Point;

    /// Computes m from the complete family.
    fn begin(&self, family: &Family<D>) -> Point {
        let dimension = D as f64;
        let weighted = family.sum(|bond| bond.length * bond.length * bond.volume).max(f64::MIN_POSITIVE);
        let alpha = dimension * (dimension + 2.0) * self.shear.value_at(family.site()) / weighted;
        Point { alpha, share: dimension / weighted, ..Point::default() }
    }

    /// Computes θ and b from the intact bonds.
    fn prepare(&self, family: &Family<D>, point: &mut Point) {
        let (mut weighted, mut extension, mut spread) = (0.0, 0.0, 0.0);
        family.each(|bond| {
            weighted += bond.length * bond.length * bond.volume;
            extension += bond.length * bond.length * bond.strain() * bond.volume;
            spread += bond.length * bond.volume;
        });
        let dimension = D as f64;
        let both = 2.0 * dimension / point.share - weighted;
        point.balance = self.bulk.value_at(family.site()) - point.alpha * both / (dimension * dimension);
        point.dilatation = point.share * extension;
        point.spread = point.share * spread;
    }

    /// Returns the force along the bond from both ends: τ = (αe + bθ D|ξ|/m) ζ/|ζ|.
    fn force(&self, bond: &Bond<D>, own: &Point, other: &Point) -> [f64; D] {
        let pull = |end: &Point| {
            bond.length * (end.alpha * bond.strain() + end.balance * end.dilatation * end.share)
        };
        let size = pull(own) + pull(other);
        bond.direction().map(|x| size * x)
    }

    fn energy(&self, family: &Family<D>, point: &Point) -> f64 {
        let squares = family.sum(|bond| (bond.length * bond.strain()).powi(2) * bond.volume);
        0.5 * point.alpha * squares + 0.5 * point.balance * point.dilatation.powi(2)
    }

    /// Bounds the stiffness: springs αe and rotation of the bond at both ends; then b(∂θ/∂u)² and bθ ∂²θ/∂u²
    /// where positive.
    fn stiffness(&self, family: &Family<D>, points: &[Point]) -> f64 {
        let own = &points[family.site()];
        let dilatation = own.balance.max(0.0) * own.spread * own.spread;
        dilatation
            + family.sum(|bond| {
                let other = &points[bond.to];
                let turn = 1.0 / bond.stretch().max(1e-3);
                let springs = (own.alpha + other.alpha) * turn.max(1.0);
                let pressure = |end: &Point| (end.balance * end.dilatation * end.share).abs() * turn;
                let far = other.balance.max(0.0) * other.spread * other.share * bond.length;
                (springs + pressure(own) + pressure(other) + far) * bond.volume
            })
    }

    /// Returns kθ for Young's modulus E ≈ 3μ.
    fn micromodulus(&self, bonds: &dyn BodyGeometry<D>) -> f64 {
        modulus_in(bonds, 3.0 * self.shear.least())
    }
}
// ANCHOR_END: material

/// Pulls a strip of 60 × 16 particles in plane strain by 1 % with free sides; returns −ε₂₂/ε₁₁ in the middle,
/// from rows 6 apart.
pub fn poisson_ratio(solid: LinearSolid) -> Result<f64, peri::Error> {
    let body = [Operation::Add(Shape::Box { min: [0.0; 2], max: [60.0, 16.0] })];
    let mut bonds = LatticeBonds::new(lattice(&body, 1.0, 1.0)?, 3.015, VolumeCorrection::None, &[])?;
    let sites = |from: [f64; 2], to: [f64; 2]| -> Vec<u32> {
        let inside = |&site: &u32| {
            let place = bonds.position(site as usize);
            (0..2).all(|d| (from[d]..to[d]).contains(&place[d]))
        };
        bonds.particles().iter().copied().filter(inside).collect()
    };
    let grip = |x| Support { displacement: [Some(x), None], body_force: [0.0; 2] };
    let left = (sites([0.0; 2], [3.0, 16.0]), grip(0.0));
    let right = (sites([57.0, 0.0], [60.0, 16.0]), grip(0.54));
    // one particle is held across, so that the strip cannot drift
    let pin = Support { displacement: [None, Some(0.0)], body_force: [0.0; 2] };
    let pinned = (sites([30.0, 8.0], [31.0, 9.0]), pin);
    let mark = |place: [f64; 2]| sites(place, [place[0] + 1.0, place[1] + 1.0])[0] as usize;
    let [west, east, south, north] = [[26.0, 8.0], [34.0, 8.0], [30.0, 5.0], [30.0, 11.0]].map(mark);
    let loads = Loads::new(bonds.sites(), &[left, right, pinned]);

    let mut state = State::new(bonds.sites());
    let mut system = System::new(&mut bonds, solid, &loads, &[1.0]);
    let method = Lbfgs { tolerance: 1e-6, ..Default::default() };
    method.run(&mut system, &mut state)?;
    let moved = |site: usize, axis: usize| state.displacement.get(site)[axis];
    let along = (moved(east, 0) - moved(west, 0)) / 8.0;
    let across = (moved(north, 1) - moved(south, 1)) / 6.0;
    Ok(-across / along)
}

#[allow(dead_code, reason = "the tests include this file and call what it shows")]
pub(crate) fn main() -> Result<(), peri::Error> {
    for bulk in [2.0, 4.0, 19.0] {
        let exact = (bulk - 1.0) / (bulk + 1.0);
        let found = poisson_ratio(LinearSolid { bulk: bulk.into(), shear: 1.0.into() })?;
        println!("K/μ = {bulk}: −ε₂₂/ε₁₁ = {found:.4} where (K − μ)/(K + μ) = {exact:.4}");
    }
    Ok(())
}
