//! Rubber as a network of Langevin chains whose volume is kept by a pressure.

use super::deformation::{Deformation, PointLaw, PointStress, Tensor, embed};
use crate::calibrate::Space;
use crate::error::Error;
use polycore::langevin;

/// Eight chains of n links each (Arruda & Boyce 1993, doi:10.1016/0022-5096(93)90013-6) on the nonlocal trace of C,
/// S = tr FᵀF + residual, and on J = det F:
/// W = ψ(I₁) − μ₀ ln J + ¼κ(J² − 1 − 2 ln J), μ = 2ψ′ = μ₀ (β/β₁)/Λ with Λ = √(I₁/3), β = 𝓛⁻¹(Λ/√n), β₁ = 𝓛⁻¹(1/√n).
///
/// I₁ = S in three dimensions, S + 1 in plane strain, and S + λ₃² in plane stress, where the stretch λ₃ of the thickness
/// follows from W; incompressible sheets have λ₃ = 1/J.
#[derive(Clone, Copy, Debug)]
pub struct EightChain {
    space: Space,
    modulus: f64,
    links: f64,
    bulk: f64,
    /// κ, Pa; infinite of an incompressible sheet.
    volumetric: f64,
    /// β₁.
    rest: f64,
    /// n(xβ + ln(β/sinh β)) at rest.
    rest_energy: f64,
}

/// Chains at I₁: ψ over μc, μ and dμ/dI₁.
struct Chains {
    energy: f64,
    modulus: f64,
    slope: f64,
}

/// Relative extension beyond which β grows linearly: a chain that a load step stretches too far has a force nevertheless.
const LINEAR: f64 = 0.995;
/// J below which ln J and J⁻² go on as parabolas.
const CRUSHED: f64 = 0.2;

impl EightChain {
    /// Of a shear modulus μ₀ > 0 in Pa and n > 1 links a chain. The bulk modulus K in Pa is above
    /// 2μ₀/3 + 2 dμ/dI₁ at rest, or infinite in plane stress.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn new(space: Space, modulus: f64, links: f64, bulk: f64) -> Result<Self, Error> {
        let wrong =
            |name, found, allowed: &str| Err(Error::Parameter { name, found, allowed: allowed.into() });
        if !(modulus > 0.0 && modulus.is_finite()) {
            return wrong("shear modulus", modulus, "above 0 Pa");
        }
        if !(links > 1.0 && links.is_finite()) {
            return wrong("links", links, "above 1: chains of one link are locked at rest");
        }
        let start = 1.0 / links.sqrt();
        let rest = langevin::inverse(start);
        let mut law = Self { space, modulus, links, bulk, volumetric: bulk, rest, rest_energy: 0.0 };
        let at_rest = law.chains(3.0);
        law.rest_energy = at_rest.energy;
        let least = 2.0 / 3.0 * modulus + 2.0 * at_rest.slope;
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

    fn chains(&self, first: f64) -> Chains {
        let root = self.links.sqrt();
        let network = 3.0 * self.modulus / (root * self.rest);
        let stretch = (first / 3.0).sqrt();
        let x = stretch / root;
        let end = x.min(LINEAR);
        let (held, tangent) = (langevin::inverse(end), langevin::inverse_derivative(end));
        let beta = held + tangent * (x - end);
        let free =
            end * held + langevin::ln_beta_over_sinh(held) + (held + 0.5 * tangent * (x - end)) * (x - end);
        Chains {
            energy: network * self.links * free,
            // μ₀ to the last bit at rest
            modulus: self.modulus * (beta / self.rest) / stretch,
            slope: network / 3.0 * (tangent - beta / x) / (6.0 * stretch * stretch),
        }
    }

    /// λ₃² and what W_J and W_JJ need of it, in plane stress.
    fn thickness(&self, trace: f64, jacobian: f64) -> Thickness {
        if self.volumetric.is_infinite() {
            let square = inverse_square(jacobian);
            let found = self.chains(trace + square[0]);
            let curvature = 0.5 * found.modulus * square[2] + 0.5 * found.slope * square[1] * square[1];
            return Thickness { chains: found, volume: 0.0, slope: [0.0, curvature], square };
        }
        // ∂W/∂λ₃ = μλ₃ + U′(Jλ₃) J = 0
        let area = jacobian.max(0.05);
        let mut stretch = 1.0 / area;
        let terms = |stretch: f64| {
            let found = self.chains(trace + stretch * stretch);
            (found, self.volume(area * stretch))
        };
        for _ in 0..60 {
            let (found, [_, first, second]) = terms(stretch);
            let force = found.modulus * stretch + first * area;
            let slope = found.modulus + 2.0 * found.slope * stretch * stretch + second * area * area;
            let step = (force / slope).clamp(-stretch, 0.5 * stretch);
            stretch -= step;
            if step.abs() < 1e-15 * stretch {
                break;
            }
        }
        let (found, [energy, first, second]) = terms(stretch);
        let square = [stretch * stretch, 0.0, 0.0];
        Thickness {
            chains: found,
            volume: energy,
            slope: [first * stretch, second * stretch * stretch],
            square,
        }
    }

    /// −μ₀ ln J + ¼κ(J² − 1 − 2 ln J) with its derivatives.
    fn volume(&self, jacobian: f64) -> [f64; 3] {
        let log = logarithm(jacobian);
        let (shear, bulk) = (self.modulus, self.volumetric);
        [
            -shear * log[0] + 0.25 * bulk * ((jacobian - 1.0) * (jacobian + 1.0) - 2.0 * log[0]),
            -shear * log[1] + 0.5 * bulk * (jacobian - log[1]),
            -shear * log[2] + 0.5 * bulk * (1.0 - log[2]),
        ]
    }

    /// W, W_S, W_J, W_SS, W_JJ at S and J.
    fn derivatives(&self, trace: f64, jacobian: f64) -> [f64; 5] {
        let out = if self.space == Space::PlaneStress {
            let Thickness { chains, volume, slope, square } = self.thickness(trace, jacobian);
            let pressure = slope[0] + 0.5 * chains.modulus * square[1];
            [chains.energy + volume, 0.5 * chains.modulus, pressure, 0.5 * chains.slope, slope[1]]
        } else {
            let first = if self.space == Space::Solid { trace } else { trace + 1.0 };
            let (found, [energy, pressure, curvature]) = (self.chains(first), self.volume(jacobian));
            [found.energy + energy, 0.5 * found.modulus, pressure, 0.5 * found.slope, curvature]
        };
        [out[0] - self.rest_energy, out[1], out[2], out[3], out[4]]
    }
}

struct Thickness {
    chains: Chains,
    /// Volumetric energy.
    volume: f64,
    /// W_J and W_JJ but for that of `square`.
    slope: [f64; 2],
    /// λ₃², and its derivatives by J where they are explicit.
    square: [f64; 3],
}

/// ln J and its derivatives, a parabola below [`CRUSHED`].
fn logarithm(jacobian: f64) -> [f64; 3] {
    if jacobian > CRUSHED {
        return [jacobian.ln(), 1.0 / jacobian, -1.0 / (jacobian * jacobian)];
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

/// det F and cof F = J F⁻ᵀ.
fn cofactor<const D: usize>(gradient: &Tensor<D>) -> (f64, Tensor<D>) {
    let full = embed(gradient, 1.0);
    let [a, b, c] = [0, 1, 2].map(|k| full.column(k).into_owned());
    let rows = [b.cross(&c), c.cross(&a), a.cross(&b)];
    (a.dot(&rows[0]), Tensor::from_fn(|i, k| rows[k][i]))
}

impl<const D: usize> PointLaw<D> for EightChain {
    fn respond(&self, deformation: &Deformation<D>) -> PointStress<D> {
        let gradient = deformation.gradient();
        let (jacobian, cofactor) = cofactor(&gradient);
        let [energy, by_trace, by_volume, ..] =
            self.derivatives(D as f64 + deformation.excess_trace(), jacobian);
        PointStress {
            energy,
            piola: gradient * (2.0 * by_trace) + cofactor * by_volume,
            stabilisation: 2.0 * by_trace,
        }
    }

    fn stiffness(&self, deformation: &Deformation<D>) -> f64 {
        let gradient = deformation.gradient();
        let (jacobian, cofactor) = cofactor(&gradient);
        let [_, by_trace, by_volume, second_trace, second_volume] =
            self.derivatives(D as f64 + deformation.excess_trace(), jacobian);
        let size = gradient.norm();
        2.0 * by_trace
            + 4.0 * second_trace.max(0.0) * size * size
            + second_volume.max(0.0) * cofactor.norm_squared()
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
        let (jacobian, _) = cofactor(&deformation.gradient());
        self.thickness(D as f64 + deformation.excess_trace(), jacobian).square[0].sqrt()
    }
}
