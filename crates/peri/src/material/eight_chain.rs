//! Rubber as a network of Langevin chains whose volume is kept by a pressure.

use super::deformation::{Deformation, PointLaw, PointStress, Tensor, embed};
use crate::calibrate::Space;
use crate::error::Error;
use crate::quadrature::mean;
use polycore::langevin;

/// Eight chains of n links each (Arruda & Boyce 1993, doi:10.1016/0022-5096(93)90013-6) on the nonlocal trace of C,
/// S = tr FᵀF + residual, and on J = det F:
/// W = ψ(I₁) − μ₀ ln J + ¼κ(J² − 1 − 2 ln J), μ = 2ψ′ = μ₀ (β/β₁)/Λ with Λ = √(I₁/3), β = 𝓛⁻¹(Λ/√n), β₁ = 𝓛⁻¹(1/√n).
///
/// I₁ = S in three dimensions, S + 1 in plane strain, and S + λ₃² in plane stress, where the stretch λ₃ of the thickness
/// follows from W; incompressible sheets have λ₃ = 1/J.
#[derive(Clone, Copy, Debug)]
pub struct EightChain<const D: usize> {
    space: Space,
    modulus: f64,
    links: f64,
    bulk: f64,
    /// κ, Pa; infinite of an incompressible sheet.
    volumetric: f64,
    /// β₁.
    rest: f64,
}

/// Chains at an I₁.
struct Chains {
    /// μ.
    modulus: f64,
    /// dμ/dI₁.
    slope: f64,
}

/// Relative extension beyond which β grows linearly: a chain that a load step stretches too far has a force nevertheless.
const LINEAR: f64 = 0.995;
/// J below which ln J and J⁻² go on as parabolas.
const CRUSHED: f64 = 0.2;

/// Excess of I₁ below which the energy is an integral of μ, which does not cancel.
const SMALL: f64 = 0.05;

impl<const D: usize> EightChain<D> {
    /// Of a shear modulus μ₀ > 0 in Pa and n > 1 links a chain. The bulk modulus K in Pa is above
    /// 2μ₀/3 + 2 dμ/dI₁ at rest, or infinite in plane stress.
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
        let start = 1.0 / links.sqrt();
        let rest = langevin::inverse(start);
        let mut law = Self { space, modulus, links, bulk, volumetric: bulk, rest };
        let least = 2.0 / 3.0 * modulus + 2.0 * law.chains(0.0).slope;
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

    /// κ, Pa: the factor of the volumetric energy.
    pub fn volumetric(&self) -> f64 {
        self.volumetric
    }

    /// β and its derivative at x = Λ/√n.
    fn extension(x: f64) -> [f64; 2] {
        let end = x.min(LINEAR);
        let slope = langevin::inverse_derivative(end);
        [langevin::inverse(end) + slope * (x - end), slope]
    }

    /// At I₁ = 3 + `excess`.
    fn chains(&self, excess: f64) -> Chains {
        let root = self.links.sqrt();
        let stretch = (1.0 + excess / 3.0).sqrt();
        let x = stretch / root;
        let [beta, tangent] = Self::extension(x);
        let network = self.modulus / (root * self.rest);
        Chains {
            // μ₀ to the last bit at rest
            modulus: self.modulus * (beta / self.rest) / stretch,
            slope: network * (tangent - beta / x) / (6.0 * stretch * stretch),
        }
    }

    /// ψ(3 + `excess`) − ψ(3).
    fn chain_energy(&self, excess: f64) -> f64 {
        if excess.abs() < SMALL {
            return excess * mean(0.0, excess, |part| 0.5 * self.chains(part).modulus);
        }
        let root = self.links.sqrt();
        let free = |x: f64| {
            let end = x.min(LINEAR);
            let ([beta, _], [start, slope]) = (Self::extension(x), Self::extension(end));
            end * start + langevin::ln_beta_over_sinh(start) + (beta - 0.5 * slope * (x - end)) * (x - end)
        };
        let network = 3.0 * self.modulus / (root * self.rest);
        let stretch = (1.0 + excess / 3.0).sqrt();
        network * self.links * (free(stretch / root) - free(1.0 / root))
    }

    /// λ₃² and what W_J and W_JJ need of it, in plane stress.
    fn thickness(&self, excess: f64, change: f64) -> Thickness {
        let jacobian = 1.0 + change;
        if self.volumetric.is_infinite() {
            let square = inverse_square(jacobian);
            // J⁻² − 1 with all digits
            let third =
                if jacobian > CRUSHED { -change * (2.0 + change) * square[0] } else { square[0] - 1.0 };
            let found = self.chains(excess + third);
            let curvature = 0.5 * found.modulus * square[2] + 0.5 * found.slope * square[1] * square[1];
            return Thickness {
                chains: found,
                third,
                change: 0.0,
                slope: [0.0, curvature],
                explicit: square[1],
            };
        }
        // ∂W/∂λ₃ = μλ₃ + U′(Jλ₃) J = 0
        let area = jacobian.max(THINNEST);
        let change = if jacobian > THINNEST { change } else { THINNEST - 1.0 };
        let mut stretch = 1.0 / area;
        let third = |stretch: f64| (stretch - 1.0) * (stretch + 1.0);
        let whole = |stretch: f64| change + (stretch - 1.0) * area;
        for _ in 0..60 {
            let (found, [first, second]) =
                (self.chains(excess + third(stretch)), self.volume(whole(stretch)));
            let force = found.modulus * stretch + first * area;
            let slope = found.modulus + 2.0 * found.slope * stretch * stretch + second * area * area;
            let step = (force / slope).clamp(-stretch, 0.5 * stretch);
            stretch -= step;
            if step.abs() < 1e-15 * stretch {
                break;
            }
        }
        let [first, second] = self.volume(whole(stretch));
        Thickness {
            chains: self.chains(excess + third(stretch)),
            third: third(stretch),
            change: whole(stretch),
            slope: [first * stretch, second * stretch * stretch],
            explicit: 0.0,
        }
    }

    /// U′ and U″ of U = −μ₀ ln J + ¼κ(J² − 1 − 2 ln J) at J = 1 + `change`.
    fn volume(&self, change: f64) -> [f64; 2] {
        let (jacobian, [_, first, second]) = (1.0 + change, logarithm(change));
        let (shear, bulk) = (self.modulus, self.volumetric);
        [-shear * first + 0.5 * bulk * (jacobian - first), -shear * second + 0.5 * bulk * (1.0 - second)]
    }

    /// U.
    fn volume_energy(&self, change: f64) -> f64 {
        let log = logarithm(change)[0];
        -self.modulus * log + 0.25 * self.volumetric * (change * (2.0 + change) - 2.0 * log)
    }

    /// W_S, W_J, W_SS, W_JJ at S − D and J − 1.
    fn derivatives(&self, excess: f64, change: f64) -> [f64; 4] {
        if self.space == Space::PlaneStress {
            let Thickness { chains, slope, explicit, .. } = self.thickness(excess, change);
            let pressure = slope[0] + 0.5 * chains.modulus * explicit;
            return [0.5 * chains.modulus, pressure, 0.5 * chains.slope, slope[1]];
        }
        let (found, [pressure, curvature]) = (self.chains(excess), self.volume(change));
        [0.5 * found.modulus, pressure, 0.5 * found.slope, curvature]
    }
}

/// J below which the thickness is that at this J, of a sheet with finite K.
const THINNEST: f64 = 0.05;

struct Thickness {
    chains: Chains,
    /// λ₃² − 1.
    third: f64,
    /// Jλ₃ − 1.
    change: f64,
    /// W_J and W_JJ but for those of λ₃², and all W_JJ of an incompressible sheet.
    slope: [f64; 2],
    /// dλ₃²/dJ where it is explicit.
    explicit: f64,
}

/// ln J and its derivatives at J = 1 + `change`, a parabola below [`CRUSHED`].
fn logarithm(change: f64) -> [f64; 3] {
    let jacobian = 1.0 + change;
    if jacobian > CRUSHED {
        return [change.ln_1p(), 1.0 / jacobian, -1.0 / (jacobian * jacobian)];
    }
    let (s, r) = (jacobian - CRUSHED, 1.0 / CRUSHED);
    [CRUSHED.ln() + s * r - 0.5 * s * s * r * r, r - s * r * r, -r * r]
}

/// J⁻² and its derivatives, a parabola below [`CRUSHED`].
fn inverse_square(jacobian: f64) -> [f64; 3] {
    if jacobian > CRUSHED {
        let r = 1.0 / jacobian;
        return [r * r, -2.0 * r.powi(3), 6.0 * r.powi(4)];
    }
    let (s, r) = (jacobian - CRUSHED, 1.0 / CRUSHED);
    let (first, second) = (-2.0 * r.powi(3), 6.0 * r.powi(4));
    [r * r + first * s + 0.5 * second * s * s, first + second * s, second]
}

/// cof F = J F⁻ᵀ.
fn cofactor<const D: usize>(gradient: &Tensor<D>) -> Tensor<D> {
    let full = embed(gradient, 1.0);
    let [a, b, c] = [0, 1, 2].map(|k| full.column(k).into_owned());
    let rows = [b.cross(&c), c.cross(&a), a.cross(&b)];
    Tensor::from_fn(|i, k| rows[k][i])
}

impl<const D: usize> PointLaw<D> for EightChain<D> {
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
        // below the thinnest, along the slope there
        chains + self.volume_energy(found.change) + found.slope[0] * (1.0 + change - THINNEST).min(0.0)
    }

    fn respond(&self, deformation: &Deformation<D>) -> PointStress<D> {
        let gradient = deformation.gradient();
        let [by_trace, by_volume, ..] =
            self.derivatives(deformation.excess_trace(), deformation.volume_change());
        PointStress {
            piola: gradient * (2.0 * by_trace) + cofactor(&gradient) * by_volume,
            stabilisation: 2.0 * by_trace,
        }
    }

    fn stiffness(&self, deformation: &Deformation<D>) -> f64 {
        let gradient = deformation.gradient();
        let [by_trace, by_volume, second_trace, second_volume] =
            self.derivatives(deformation.excess_trace(), deformation.volume_change());
        let size = gradient.norm();
        2.0 * by_trace
            + 4.0 * second_trace.max(0.0) * size * size
            + second_volume.max(0.0) * cofactor(&gradient).norm_squared()
            + by_volume.abs() * if D == 2 { 1.0 } else { size }
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
}
