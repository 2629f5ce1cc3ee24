//! Eyring flow of a material point within a step.
//!
//! The shear of a branch is a Maxwell element whose rate of relaxation is that of the stress at the end of
//! the step: y = y₀ sinh(x)/x, x = √J₂/τ₀, y₀ = Δξ/τ. ln y is the unknown of one scalar equation with a
//! bracketed root. For that y all closed forms of [`BranchStep`] hold: any step is stable, its energies close
//! and no loss is negative. First order in the step; without flow, exact for a constant rate of strain.

use super::branch::{BranchEnergies, BranchStep};
use super::element::{VoigtVector, stiffness};
use super::maxwell::{BranchIncrement, MaxwellIncrement};
use nalgebra::SMatrix;
use polycore::constitutive::viscoelastic::Viscosity;

type Matrix6 = SMatrix<f64, 6, 6>;

/// Greatest ln y: its square is still a number.
const MOST: f64 = 350.0;
const STEPS: usize = 200;

/// Step of a material point that may flow.
#[derive(Clone, Debug)]
pub struct PointStep {
    branches: Vec<ShearStep>,
    floor: f64,
    poisson: f64,
}

/// Step of a branch: of its volume, and of its shear if it flows.
#[derive(Clone, Debug)]
struct ShearStep {
    volume: BranchStep,
    modulus: f64,
    shear: Option<Flowed>,
}

/// Shear that flows: its step, and the slope of the strain by Δε over that of the step, (1 + `slope` n⊗n).
#[derive(Clone, Debug)]
struct Flowed {
    step: BranchStep,
    direction: VoigtVector,
    slope: f64,
}

/// Deviator of a strain with engineering shears.
fn deviator(strain: &[f64; 6]) -> [f64; 6] {
    let mean = (strain[0] + strain[1] + strain[2]) / 3.0;
    std::array::from_fn(|k| if k < 3 { strain[k] - mean } else { strain[k] })
}

/// a:b of strains with engineering shears.
fn product(a: &VoigtVector, b: &VoigtVector) -> f64 {
    (0..6).map(|k| if k < 3 { a[k] * b[k] } else { 0.5 * a[k] * b[k] }).sum()
}

impl BranchIncrement {
    /// Solves for the flow of the shear from e, Δε; `shear` is 2 Ĝ b₂ E.
    fn flowed(&self, stress: f64, shear: f64, strain: &VoigtVector, change: &VoigtVector) -> Flowed {
        let law = Viscosity::Eyring { rate: stress, stress, pressure: 0.0, softening: None };
        // ln(sinh x/x) and its derivative by ln J₂
        let activation = |size: f64| {
            let found = law.fluidity(0.5 * (shear * size).powi(2), 3.0);
            (found.logarithm, found.by_stress)
        };
        let at = |step: BranchStep| -> (Flowed, f64, f64) {
            let [[e, d], [e_slope, d_slope]] = step.relaxed();
            let (reached, moved) = (strain * e + change * d, strain * e_slope + change * d_slope);
            let square = product(&reached, &reached);
            let (logarithm, by_stress) = activation(square.sqrt());
            // d ln|e|/d ln y: flow lowers the stress, except where Δε reverses a strain
            let ratio = if square > 0.0 { product(&reached, &moved) / square } else { 0.0 };
            let falls = 2.0 * by_stress * ratio;
            let slope = if ratio < 0.0 { falls / (1.0 - falls) } else { 0.0 };
            let direction = if square > 0.0 { reached / square.sqrt() } else { reached };
            (Flowed { step, direction, slope }, logarithm, falls)
        };
        let rest = self.step.input().relaxation.ln();
        let size = product(strain, strain).sqrt() + product(change, change).sqrt();
        let [mut low, mut high] = [rest, rest + activation(size).0].map(|x| x.min(MOST));
        let (mut found, mut x) = (at(self.step), rest);
        if rest == f64::NEG_INFINITY || rest >= MOST {
            return found.0;
        }
        for _ in 0..STEPS {
            let residual = x - rest - found.1;
            if residual > 0.0 {
                high = x
            } else {
                low = x
            }
            let newton = x - residual / (1.0 - found.2);
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if (next - x).abs() <= 4.0 * f64::EPSILON * x.abs().max(1.0) || next == low && next == high {
                break;
            }
            x = next;
            found = at(self.step.with_relaxation(x.exp()));
        }
        found.0
    }
}

impl MaxwellIncrement {
    /// Returns true if a branch flows.
    pub fn flows(&self) -> bool {
        self.branches.iter().any(|branch| branch.flow.is_some())
    }

    /// Solves for the flow at a point with elastic strains e and the increment Δε − Δε*, shears doubled.
    pub fn point(&self, poisson: f64, strains: &[[f64; 6]], mechanical: &[f64; 6]) -> PointStep {
        let change = VoigtVector::from(deviator(mechanical));
        let each = |(branch, strain): (&BranchIncrement, &[f64; 6])| {
            let shear = branch.modulus * branch.step.input().softening[1] / (1.0 + poisson);
            let strain = VoigtVector::from(deviator(strain));
            let shear = branch.flow.map(|stress| branch.flowed(stress, shear, &strain, &change));
            ShearStep { volume: branch.step, modulus: branch.modulus, shear }
        };
        PointStep {
            branches: self.branches.iter().zip(strains).map(each).collect(),
            floor: self.floor,
            poisson,
        }
    }
}

impl PointStep {
    /// Updates the elastic strains.
    pub fn advance(&self, strains: &mut [[f64; 6]], mechanical: &[f64; 6]) {
        let change = deviator(mechanical);
        for (ShearStep { volume, shear, .. }, strain) in self.branches.iter().zip(strains) {
            let own = deviator(strain);
            let shear = shear.as_ref().map_or(volume, |flowed| &flowed.step);
            *strain = std::array::from_fn(|k| {
                shear.carried * own[k]
                    + shear.gained * change[k]
                    + volume.carried * (strain[k] - own[k])
                    + volume.gained * (mechanical[k] - change[k])
            });
        }
    }

    /// ∂σ/∂Δε of the step, symmetric, Pa, floor included. Of the slope of the flow it has the part along the
    /// stress: all of it where strain and Δε are parallel.
    pub fn tangent(&self) -> Matrix6 {
        let whole = stiffness(self.poisson);
        let bulk = 1.0 / (3.0 * (1.0 - 2.0 * self.poisson));
        let volume = Matrix6::from_fn(|i, j| if i < 3 && j < 3 { bulk } else { 0.0 });
        let mut sum = whole * self.floor;
        for ShearStep { volume: step, modulus, shear } in &self.branches {
            let Some(Flowed { step: flowed, direction, slope }) = shear else {
                sum += whole * (modulus * step.stiffness);
                continue;
            };
            // tensor components of n
            let normal = VoigtVector::from_fn(|k, _| if k < 3 { direction[k] } else { 0.5 * direction[k] });
            let along = normal * normal.transpose() * (slope / (1.0 + self.poisson));
            sum += volume * (modulus * step.stiffness);
            sum += (whole - volume + along) * (modulus * flowed.stiffness);
        }
        sum
    }

    /// Energies of all branches, J/m³, with the product a:Ĉ:b; call before [`Self::advance`].
    pub fn energies(
        &self,
        strains: &[[f64; 6]],
        mechanical: &[f64; 6],
        product: impl Fn(&[f64; 6], &[f64; 6]) -> f64,
    ) -> BranchEnergies {
        let parts = |strain: &[f64; 6]| {
            let shear = deviator(strain);
            [std::array::from_fn(|k| strain[k] - shear[k]), shear]
        };
        let mut sum = BranchEnergies::default();
        for (branch, strain) in self.branches.iter().zip(strains) {
            let shear = branch.shear.as_ref().map_or(&branch.volume, |flowed| &flowed.step);
            let pairs = parts(strain).into_iter().zip(parts(mechanical));
            for ((e, d), step) in pairs.zip([&branch.volume, shear]) {
                sum.add(&step.energies(product(&e, &e), product(&e, &d), product(&d, &d)), branch.modulus);
            }
        }
        sum
    }
}

#[cfg(test)]
#[path = "flow_tests.rs"]
mod tests;
