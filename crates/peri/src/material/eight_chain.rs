//! Rubber as a network of Langevin chains with a pressure that conserves the volume.

use super::compression::{CRUSH_LIMIT, inverse_square, logarithm, logarithm_slopes};
use super::point_law::{Deformation, PointLaw, PointStress};
use super::tensor::cofactor;
use crate::calibrate::Space;
use crate::error::Error;
use crate::quadrature::mean;
use polycore::langevin;

/// Eight chains of n links each (Arruda & Boyce 1993, doi:10.1016/0022-5096(93)90013-6) on the nonlocal trace
/// of C, S = tr FᵀF + residual, and on J = det F: W = ψ(I₁) − μ₀ ln J + ¼κ(J² − 1 − 2 ln J), μ = 2ψ′ = μ₀
/// (β/β₁)/Λ with Λ = √(I₁/3), β = 𝓛⁻¹(Λ/√n), β₁ = 𝓛⁻¹(1/√n).
///
/// I₁ = S in three dimensions, S + 1 in plane strain, and S + λ₃² in plane stress, where the stretch λ₃ of
/// the thickness follows from W; incompressible sheets have λ₃ = 1/J.
#[derive(Clone, Copy, Debug)]
pub struct EightChainSolid<const D: usize> {
    pub(crate) space: Space,
    modulus: f64,
    links: f64,
    /// √n.
    root: f64,
    bulk: f64,
    /// κ, Pa; infinite for an incompressible sheet.
    volumetric: f64,
    /// β₁.
    rest: f64,
    filter: bool,
}

/// Relative extension beyond which β grows linearly, so that a chain overstretched by a load step still has a
/// force.
pub(super) const LINEAR: f64 = 0.995;
/// Excess of I₁ below which the energy is integrated from μ, without cancellation.
const SMALL: f64 = 0.05;

impl<const D: usize> EightChainSolid<D> {
    /// Creates the law of a shear modulus μ₀ > 0 in Pa and n > 1 links a chain. The bulk modulus K in Pa is
    /// above 2μ₀/3 + 2 dμ/dI₁ at rest, or infinite in plane stress.
    ///
    /// # Errors
    /// [`Error::Parameter`]; [`Error::Geometry`] for a space of another dimension.
    pub fn new(space: Space, modulus: f64, links: f64, bulk: f64) -> Result<Self, Error> {
        let wrong =
            |name, found, allowed: &str| Err(Error::Parameter { name, found, allowed: allowed.into() });
        if !(modulus > 0.0 && modulus.is_finite()) {
            return wrong("shear modulus", modulus, "above 0 Pa");
        }
        if !(links > 1.0 && links.is_finite()) {
            return wrong("links", links, "above 1: chains of one link are locked at rest");
        }
        if (space == Space::Solid) != (D == 3) {
            return Err(Error::geometry(format!("{space:?} in {D} dimensions")));
        }
        let root = links.sqrt();
        let rest = langevin::inverse(1.0 / root);
        let mut law = Self { space, modulus, links, root, bulk, volumetric: bulk, rest, filter: false };
        let least = 2.0 / 3.0 * modulus + 2.0 * law.chains(0.0)[1];
        if bulk.is_infinite() && space != Space::PlaneStress {
            return wrong("bulk modulus", bulk, "finite, except in plane stress");
        }
        if bulk.is_nan() || bulk < least {
            let allowed = format!("at least {least:.6e} Pa, that of a network without volumetric energy");
            return Err(Error::Parameter { name: "bulk modulus", found: bulk, allowed });
        }
        law.volumetric = bulk - least;
        Ok(law)
    }

    /// Uses U(bJ), b the average over nearest neighbours of a lattice: pressures of large bulk moduli become
    /// smoother at corners.
    ///
    /// # Errors
    /// [`Error::Parameter`] in plane stress, whose thickness adapts.
    pub fn filtered(mut self) -> Result<Self, Error> {
        if self.space == Space::PlaneStress {
            let allowed = "solids and plane strain".into();
            return Err(Error::Parameter { name: "pressure filter", found: self.bulk, allowed });
        }
        self.filter = true;
        Ok(self)
    }

    /// κ, Pa: the factor of the volumetric energy.
    pub fn volumetric(&self) -> f64 {
        self.volumetric
    }

    /// β at x = Λ/√n.
    fn extension(x: f64) -> f64 {
        if x < LINEAR { langevin::inverse(x) } else { Self::stiff_extension(x)[0] }
    }

    /// β and dβ/dx at x ≥ [`LINEAR`].
    fn stiff_extension(x: f64) -> [f64; 2] {
        let [beta, slope] = langevin::inverse_with_derivative(LINEAR);
        [beta + slope * (x - LINEAR), slope]
    }

    /// Λ and Λ/√n at I₁ = 3 + `excess`.
    fn stretches(&self, excess: f64) -> [f64; 2] {
        let stretch = (1.0 + excess / 3.0).sqrt();
        [stretch, stretch / self.root]
    }

    /// μ at I₁ = 3 + `excess`, μ₀ to the last bit at rest.
    fn shear(&self, excess: f64) -> f64 {
        let [stretch, x] = self.stretches(excess);
        self.modulus * (Self::extension(x) / self.rest) / stretch
    }

    /// μ and dμ/dI₁ at I₁ = 3 + `excess`.
    fn chains(&self, excess: f64) -> [f64; 2] {
        let [stretch, x] = self.stretches(excess);
        let [beta, tangent] =
            if x < LINEAR { langevin::inverse_with_derivative(x) } else { Self::stiff_extension(x) };
        let modulus = self.modulus * (beta / self.rest) / stretch;
        let network = self.modulus / (self.root * self.rest);
        [modulus, (network * tangent - modulus * stretch / (self.root * x)) / (6.0 * stretch * stretch)]
    }

    /// ψ(3 + `excess`) − ψ(3).
    fn chain_energy(&self, excess: f64) -> f64 {
        if excess.abs() < SMALL {
            return excess * mean(0.0, excess, |part| 0.5 * self.shear(part));
        }
        let root = self.root;
        let free = |x: f64| {
            let end = x.min(LINEAR);
            let [beta, start] = [x, end].map(Self::extension);
            end * start + langevin::ln_beta_over_sinh(start) + 0.5 * (beta + start) * (x - end)
        };
        let network = 3.0 * self.modulus / (root * self.rest);
        let [_, x] = self.stretches(excess);
        network * self.links * (free(x) - free(1.0 / root))
    }

    /// λ₃² and its terms in W_J and W_JJ, in plane stress.
    fn thickness(&self, excess: f64, change: f64) -> Thickness {
        let jacobian = 1.0 + change;
        if self.volumetric.is_infinite() {
            let square = inverse_square(jacobian);
            // J⁻² − 1 with all digits
            let third =
                if jacobian > CRUSH_LIMIT { -change * (2.0 + change) * square[0] } else { square[0] - 1.0 };
            return Thickness { third, change: 0.0, square };
        }
        // ∂W/∂λ₃ = μλ₃ + U′(Jλ₃) J = 0
        let area = jacobian.max(THINNEST);
        let change = if jacobian > THINNEST { change } else { THINNEST - 1.0 };
        let mut stretch = 1.0 / area;
        let third = |stretch: f64| (stretch - 1.0) * (stretch + 1.0);
        let whole = |stretch: f64| change + (stretch - 1.0) * area;
        for _ in 0..60 {
            let ([shear, rise], [first, second]) =
                (self.chains(excess + third(stretch)), self.volume(whole(stretch)));
            let force = shear * stretch + first * area;
            let slope = shear + 2.0 * rise * stretch * stretch + second * area * area;
            let step = (force / slope).clamp(-stretch, 0.5 * stretch);
            stretch -= step;
            // the error left is of second order, at the locking stretch 200 times the square
            if step.abs() < 1e-9 * stretch {
                break;
            }
        }
        Thickness { third: third(stretch), change: whole(stretch), square: [stretch * stretch, 0.0, 0.0] }
    }

    /// U′ and U″ of U = −μ₀ ln J + ¼κ(J² − 1 − 2 ln J) at J = 1 + `change`.
    fn volume(&self, change: f64) -> [f64; 2] {
        let (jacobian, [first, second]) = (1.0 + change, logarithm_slopes(change));
        let (shear, bulk) = (self.modulus, self.volumetric);
        [-shear * first + 0.5 * bulk * (jacobian - first), -shear * second + 0.5 * bulk * (1.0 - second)]
    }

    /// U.
    fn volume_energy(&self, change: f64) -> f64 {
        let log = logarithm(change);
        -self.modulus * log + 0.25 * self.volumetric * (change * (2.0 + change) - 2.0 * log)
    }

    /// W_S and W_J at S − D and J − 1.
    fn slopes(&self, excess: f64, change: f64) -> [f64; 2] {
        if self.space != Space::PlaneStress {
            return [0.5 * self.shear(excess), self.volume(change)[0]];
        }
        let Thickness { third, change, square } = self.thickness(excess, change);
        let shear = self.shear(excess + third);
        let pressure = if self.volumetric.is_infinite() {
            0.5 * shear * square[1]
        } else {
            self.volume(change)[0] * square[0].sqrt()
        };
        [0.5 * shear, pressure]
    }

    /// W_SS and W_JJ.
    fn curvatures(&self, excess: f64, change: f64) -> [f64; 2] {
        if self.space != Space::PlaneStress {
            return [0.5 * self.chains(excess)[1], self.volume(change)[1]];
        }
        let Thickness { third, change, square } = self.thickness(excess, change);
        let [shear, rise] = self.chains(excess + third);
        let volume = if self.volumetric.is_infinite() {
            0.5 * shear * square[2] + 0.5 * rise * square[1] * square[1]
        } else {
            self.volume(change)[1] * square[0]
        };
        [0.5 * rise, volume]
    }
}

/// J below which the thickness is that at this J, for a sheet with finite K.
const THINNEST: f64 = 0.05;

struct Thickness {
    /// λ₃² − 1.
    third: f64,
    /// Jλ₃ − 1.
    change: f64,
    /// λ₃², and for an incompressible sheet its derivatives by J.
    square: [f64; 3],
}

impl<const D: usize> PointLaw<D> for EightChainSolid<D> {
    fn energy(&self, deformation: &Deformation<D>) -> f64 {
        let (excess, change) = (deformation.excess_trace(), deformation.volume_change());
        if self.space != Space::PlaneStress {
            return self.chain_energy(excess) + self.volume_energy(change);
        }
        let found = self.thickness(excess, change);
        let chains = self.chain_energy(excess + found.third);
        if self.volumetric.is_infinite() {
            return chains;
        }
        // below the thinnest state, continued along the slope there
        let slope = self.volume(found.change)[0] * found.square[0].sqrt();
        chains + self.volume_energy(found.change) + slope * (1.0 + change - THINNEST).min(0.0)
    }

    fn respond(&self, deformation: &Deformation<D>) -> PointStress<D> {
        let gradient = deformation.gradient();
        let [by_trace, by_volume] = self.slopes(deformation.excess_trace(), deformation.volume_change());
        PointStress {
            piola: gradient * (2.0 * by_trace) + cofactor(&gradient) * by_volume,
            stabilisation: 2.0 * by_trace,
        }
    }

    fn stiffness(&self, deformation: &Deformation<D>) -> f64 {
        let gradient = deformation.gradient();
        let (excess, change) = (deformation.excess_trace(), deformation.volume_change());
        let [by_trace, by_volume] = self.slopes(excess, change);
        let [second_trace, second_volume] = self.curvatures(excess, change);
        let size = gradient.norm();
        2.0 * by_trace
            + 4.0 * second_trace.max(0.0) * size * size
            + second_volume.max(0.0) * cofactor(&gradient).norm_squared()
            + by_volume.abs() * if D == 2 { 1.0 } else { size }
    }

    fn residual_stiffness(&self, deformation: &Deformation<D>) -> f64 {
        let [second, _] = self.curvatures(deformation.excess_trace(), deformation.volume_change());
        4.0 * second.max(0.0)
    }

    fn shear_modulus(&self) -> f64 {
        self.modulus
    }

    fn bulk_modulus(&self) -> f64 {
        if self.space == Space::PlaneStress { 0.0 } else { self.bulk }
    }

    fn thickness_stretch(&self, deformation: &Deformation<D>) -> f64 {
        if self.space != Space::PlaneStress {
            return 1.0;
        }
        (1.0 + self.thickness(deformation.excess_trace(), deformation.volume_change()).third).sqrt()
    }

    fn filtered(&self, change: f64) -> Option<[f64; 2]> {
        self.filter.then(|| [self.volume_energy(change), self.volume(change)[0]])
    }
}
