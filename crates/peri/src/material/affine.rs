//! Rubber as the full network: a Langevin chain along every bond, and a pressure that conserves the volume.

use super::compression::{logarithm, logarithm_slopes};
use super::eight_chain::LINEAR;
use super::point::{GRADIENT, LEAST_SHAPE};
use super::tensor::{BodyTensor, cofactor, invert};
use super::{Bond, Family, Material};
use crate::bonds::BodyGeometry;
use crate::calibrate::modulus_in;
use crate::error::Error;
use polycore::langevin;

/// Chains of n links along the bonds of a family in space, which move with it (Treloar & Riding 1979,
/// doi:10.1098/rspa.1979.0163): W = Σ ŵψ(λ) − ½ψ′(1)(M − 1/3):(FᵀF − 1) − ⅓ψ′(1) ln J + ¼κ(J² − 1 − 2 ln J),
/// per intact part I of the family, with ŵ, M and F of [`super::Deformation`] and ψ = c n [xβ + ln(β/sinh
/// β)], x = λ/√n, β = 𝓛⁻¹(x), ψ′ = c√n β.
///
/// The second term removes the effect of the chains' pre-tension in families that are not isotropic (edges,
/// lattices). A homogeneous deformation is exact, the reference state has no force, and Poisson's ratio is
/// free. If too few bonds are left for a gradient, springs of the same shear modulus act as in
/// [`super::NonlocalSolid`].
#[derive(Clone, Copy, Debug)]
pub struct Affine {
    shear: f64,
    bulk: f64,
    root: f64,
    /// c, Pa, and κ, Pa.
    chains: f64,
    volumetric: f64,
}

impl Affine {
    /// Creates the law of a shear modulus μ and a bulk modulus K at rest, Pa, and n > 1 links a chain.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn new(shear: f64, links: f64, bulk: f64) -> Result<Self, Error> {
        let wrong =
            |name, found, allowed: &str| Err(Error::Parameter { name, found, allowed: allowed.into() });
        if !(shear > 0.0 && shear.is_finite()) {
            return wrong("shear modulus", shear, "above 0 Pa");
        }
        if !(links > 1.0 && links.is_finite()) {
            return wrong("links", links, "above 1: chains of one link are locked at rest");
        }
        let mut law = Self { shear, bulk, root: links.sqrt(), chains: 1.0, volumetric: 0.0 };
        // μ of a sphere of bonds: (ψ″ − ψ′)/15 + ψ′/3
        let [tension, slope] = law.tension(1.0);
        law.chains = shear / ((slope - tension) / 15.0 + tension / 3.0);
        let least = law.chains * (slope + tension) / 9.0;
        if !(bulk >= least && bulk.is_finite()) {
            let allowed =
                format!("finite, at least {least:.6e} Pa, that of a network without volumetric energy");
            return Err(Error::Parameter { name: "bulk modulus", found: bulk, allowed });
        }
        law.volumetric = bulk - least;
        Ok(law)
    }

    /// ψ′ and ψ″; linear beyond 0.995 of the contour.
    fn tension(&self, stretch: f64) -> [f64; 2] {
        let x = stretch / self.root;
        let (end, slope) = (x.min(LINEAR), langevin::inverse_derivative(x.min(LINEAR)));
        let beta = langevin::inverse(end) + slope * (x - end);
        [self.chains * self.root * beta, self.chains * slope]
    }

    /// ψ(λ) − ψ(1).
    fn chain_energy(&self, stretch: f64) -> f64 {
        let free = |x: f64| {
            let end = x.min(LINEAR);
            let beta = langevin::inverse(end);
            let beyond = x - end;
            end * beta
                + langevin::ln_beta_over_sinh(beta)
                + beyond * (beta + 0.5 * langevin::inverse_derivative(end) * beyond)
        };
        self.chains * self.root * self.root * (free(stretch / self.root) - free(1.0 / self.root))
    }

    /// U, U′ and U″ of J = 1 + `change`.
    fn volume(&self, change: f64) -> [f64; 3] {
        let (pressure, half) = (self.tension(1.0)[0] / 3.0, 0.5 * self.volumetric);
        let [first, second] = logarithm_slopes(change);
        let factor = pressure + half;
        [
            0.5 * half * change * (2.0 + change) - factor * logarithm(change),
            half * (1.0 + change) - factor * first,
            half - factor * second,
        ]
    }
}

/// State of a particle's family.
#[derive(Clone, Debug)]
pub struct AffinePoint {
    /// Σ_J V_J of the whole family and of the intact bonds, m³.
    whole: f64,
    intact: f64,
    /// M, M⁻¹ and 3 λ_min(M).
    shape: BodyTensor<3>,
    inverse: BodyTensor<3>,
    least: f64,
    gradient: BodyTensor<3>,
    /// Q = P M⁻¹ without chains, Pa.
    stress: BodyTensor<3>,
    /// Bound of the stiffness of `stress`, N/m⁴.
    own: f64,
}

impl Default for AffinePoint {
    fn default() -> Self {
        let zero = BodyTensor::zeros();
        let (shape, inverse, gradient, stress) = (zero, zero, zero, zero);
        Self { whole: 0.0, intact: 0.0, shape, inverse, least: 0.0, gradient, stress, own: 0.0 }
    }
}

impl AffinePoint {
    fn has_gradient(&self) -> bool {
        self.least > LEAST_SHAPE
    }

    /// J − 1.
    fn change(&self) -> f64 {
        self.gradient.determinant() - 1.0
    }
}

impl Material<3> for Affine {
    type Point = AffinePoint;

    fn begin(&self, family: &Family<3>) -> AffinePoint {
        AffinePoint { whole: family.sum(|bond| bond.volume), ..AffinePoint::default() }
    }

    fn prepare(&self, family: &Family<3>, point: &mut AffinePoint) {
        let (mut shape, mut moment, mut intact) = (BodyTensor::<3>::zeros(), BodyTensor::<3>::zeros(), 0.0);
        family.each(|bond| {
            let share = bond.volume / (bond.length * bond.length);
            let reference = nalgebra::Vector3::from(bond.reference);
            intact += bond.volume;
            shape += share * reference * reference.transpose();
            moment += share * nalgebra::Vector3::from(bond.change) * reference.transpose();
        });
        if intact != point.intact {
            point.shape = if intact > 0.0 { shape / intact } else { shape };
            let least;
            (point.inverse, least) = invert(&point.shape);
            point.least = if intact > 0.0 { 3.0 * least } else { 0.0 };
            point.intact = intact;
        }
        if !point.has_gradient() {
            (point.gradient, point.stress) = (BodyTensor::zeros(), BodyTensor::zeros());
            return;
        }
        point.gradient = moment / intact * point.inverse + BodyTensor::identity();
        let excess = point.shape - BodyTensor::identity() / 3.0;
        let pressure = cofactor(&point.gradient) * self.volume(point.change())[1];
        point.stress = (pressure - point.gradient * excess * self.tension(1.0)[0]) * point.inverse;
    }

    fn stiffen(&self, family: &Family<3>, point: &mut AffinePoint) {
        if !point.has_gradient() {
            point.own = 0.0;
            return;
        }
        let [_, first, second] = self.volume(point.change());
        let excess = (point.shape - BodyTensor::identity() / 3.0).norm() * self.tension(1.0)[0];
        let gradient = excess
            + first.abs() * point.gradient.norm()
            + second.max(0.0) * cofactor(&point.gradient).norm_squared();
        let reach = GRADIENT.sqrt() / (family.horizon() * point.least);
        point.own = point.intact / point.whole * gradient * reach * reach;
    }

    /// τ = [ψ′ ζ/(|ζ||ξ|) + Qξ/|ξ|²]/Σ_K V_K of both ends.
    fn force(&self, bond: &Bond<3>, own: &AffinePoint, other: &AffinePoint) -> [f64; 3] {
        let square = bond.length * bond.length;
        let (mut along, mut stress) = (0.0, BodyTensor::<3>::zeros());
        for end in [own, other] {
            if end.has_gradient() {
                along += self.tension(bond.stretch())[0] / end.whole;
                stress += end.stress / end.whole;
            } else {
                along += 15.0 * self.shear * bond.strain() / end.whole;
            }
        }
        let (direction, pull) = (bond.direction(), stress * nalgebra::Vector3::from(bond.reference));
        std::array::from_fn(|d| along * direction[d] / bond.length + pull[d] / square)
    }

    fn energy(&self, family: &Family<3>, point: &AffinePoint) -> f64 {
        if point.whole <= 0.0 {
            return 0.0;
        }
        if !point.has_gradient() {
            let springs = family.sum(|bond| bond.volume * bond.strain().powi(2));
            return 7.5 * self.shear * springs / point.whole;
        }
        let chains = family.sum(|bond| bond.volume * self.chain_energy(bond.stretch())) / point.whole;
        let excess = point.shape - BodyTensor::identity() / 3.0;
        let strain = point.gradient.transpose() * point.gradient - BodyTensor::identity();
        let rest = self.volume(point.change())[0] - 0.5 * self.tension(1.0)[0] * excess.dot(&strain);
        chains + point.intact / point.whole * rest
    }

    /// Chains and springs of both ends by Gershgorin; the other terms as in [`super::NonlocalSolid`].
    fn stiffness(&self, family: &Family<3>, points: &[AffinePoint]) -> f64 {
        let mut most = points[family.site()].own;
        let springs = family.sum(|bond| {
            most = most.max(points[bond.to].own);
            let stretch = bond.stretch().max(1e-3);
            let [tension, slope] = self.tension(stretch);
            let ends = [family.site(), bond.to].map(|site| {
                let springs = || 15.0 * self.shear * (1.0 - 1.0 / stretch).abs().max(1.0);
                let chain = || slope.max(tension / stretch);
                (if points[site].has_gradient() { chain() } else { springs() }) / points[site].whole
            });
            bond.volume * (ends[0] + ends[1]) / (bond.length * bond.length)
        });
        springs + most
    }

    fn micromodulus(&self, bonds: &dyn BodyGeometry<3>) -> f64 {
        modulus_in(bonds, 3.0 * self.shear)
    }

    fn volumetric(&self) -> f64 {
        (self.bulk - 2.0 * self.shear).max(0.0)
    }
}
