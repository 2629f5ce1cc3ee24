//! The equation of a time step in principal log strains: e + Δt τ(e)/(2η) = e_tr.
//!
//! Newton's method from e = e_tr is not safe for a viscosity that falls steeply with stress. One scalar
//! unknown is: for a given α = Δt W′/η the strains minimise ½|e − e_tr|² + ½α Σ exp 2eᵢ on Σe = 0, strictly
//! convex, and ln α = ln(Δt W′(e(α))/η(e(α))) always has a root, one if τ(e) is monotone.

use super::spring::{deviator, squares_above_one};
use super::{Spring, Viscosity};
use crate::constitutive::Error;

/// tr C_v in the viscosity.
#[derive(Debug, Clone, Copy)]
pub(super) enum ViscousTrace {
    /// Value at the start of the step: the step has a potential, hence a symmetric tangent.
    Start(f64),
    /// Σ mᵢ exp 2(e_tr − e)ᵢ at the end, needed for second order.
    End([f64; 3]),
}

/// Time step of a branch in principal log strains.
pub(super) struct Flow<'a> {
    pub spring: &'a Spring,
    pub viscosity: &'a Viscosity,
    /// Duration, s.
    pub duration: f64,
    /// ln of the factor on η from temperature, pressure and softening.
    pub factor: f64,
    pub trace: ViscousTrace,
}

/// Greatest ln α: exp(−650) is still a number.
const MOST: f64 = 650.0;
const STEPS: usize = 200;
/// Newton steps of ln α below this converge, or move by rounding.
const NEAR: f64 = 1e-8;

impl Flow<'_> {
    /// Solves for the elastic strains e; `trial` is e_tr with the sum 0.
    pub fn solve(&self, trial: [f64; 3]) -> Result<[f64; 3], Error> {
        if trial == [0.0; 3] || self.duration == 0.0 {
            return Ok(trial);
        }
        let start = self.logarithm(trial, trial);
        if start == f64::NEG_INFINITY {
            return Ok(trial);
        }
        let mut x = if start.is_finite() { start.min(60.0) } else { 0.0 };
        let (mut low, mut high, mut stride) = (f64::NEG_INFINITY, f64::INFINITY, 0.05);
        // linear in small strains
        let mut strains = trial.map(|e| e / (1.0 + 2.0 * x.exp()));
        let (mut residual, mut before) = (f64::NAN, f64::INFINITY);
        for _ in 0..STEPS {
            let alpha = x.min(MOST).exp();
            strains = relaxed(trial, alpha, strains)?;
            residual = x - self.logarithm(strains, trial);
            let scale = 4.0 * f64::EPSILON * x.abs().max(1.0);
            if residual.abs() <= scale || (x > MOST && residual < 0.0) {
                return Ok(strains);
            }
            if residual > 0.0 {
                high = x
            } else {
                low = x
            }
            let newton = x - residual / self.derivative(strains, trial, alpha);
            // Newton steps that do not shrink may cycle between both sides of a kink
            let step = (newton - x).abs();
            let bracketed = low.is_finite() && high.is_finite();
            let shrinks = !bracketed || step <= 0.5 * before || step < NEAR;
            let next = if newton > low && newton < high && shrinks {
                newton
            } else if bracketed {
                0.5 * (low + high)
            } else {
                stride *= 2.0;
                if residual > 0.0 { x - stride } else { x + stride }
            };
            if (next - x).abs() <= scale {
                return Ok(strains);
            }
            before = (next - x).abs();
            x = next;
        }
        Err(Error::NoConvergence { iteration: "the flow of a branch", steps: STEPS, residual })
    }

    /// ln(Δt W′/η).
    pub fn logarithm(&self, strains: [f64; 3], trial: [f64; 3]) -> f64 {
        let slope = self.spring.slopes(strains)[0];
        let j2 = if let Viscosity::Constant(_) = self.viscosity { 0.0 } else { self.j2(strains) };
        let fluidity = self.viscosity.fluidity(j2, self.trace(strains, trial)).logarithm;
        (0.5 * self.duration).ln() + slope.ln() + fluidity - self.factor
    }

    /// Derivative of ln α − ln(Δt W′/η) by ln α.
    fn derivative(&self, strains: [f64; 3], trial: [f64; 3], alpha: f64) -> f64 {
        let squares = strains.map(|e| (2.0 * e).exp());
        let change = newton_step(deviator(strains).map(|d| alpha * d), squares, alpha);
        let [slope, second] = self.spring.slopes(strains);
        let (tau, derivative) = self.spring.response(strains);
        let grown: f64 = (0..3).map(|i| 2.0 * squares[i] * change[i]).sum();
        let j2 = self.j2(strains);
        let stress: f64 = (0..3).map(|i| tau[i] * dot(derivative[i], change)).sum();
        let viscous = self.trace(strains, trial);
        let fluidity = self.viscosity.fluidity(j2, viscous);
        let by_strain = match self.trace {
            ViscousTrace::Start(_) => 0.0,
            ViscousTrace::End(weights) => {
                let rate = |i: usize| -2.0 * weights[i] * (2.0 * (trial[i] - strains[i])).exp() * change[i];
                fluidity.by_strain * (0..3).map(rate).sum::<f64>()
            }
        };
        let by_stress = if j2 > 0.0 { fluidity.by_stress * stress / j2 } else { 0.0 };
        1.0 - second / slope * grown - by_stress - by_strain
    }

    fn j2(&self, strains: [f64; 3]) -> f64 {
        let slope = self.spring.slopes(strains)[0];
        0.5 * deviator(strains).iter().map(|b| (slope * b).powi(2)).sum::<f64>()
    }

    fn trace(&self, strains: [f64; 3], trial: [f64; 3]) -> f64 {
        match self.trace {
            ViscousTrace::Start(trace) => trace,
            ViscousTrace::End(weights) => {
                (0..3).map(|i| weights[i] * (2.0 * (trial[i] - strains[i])).exp()).sum()
            }
        }
    }

    /// τ(e) and dτ/de_tr at the solution, for tr C_v at the start of the step.
    pub fn response(&self, strains: [f64; 3], trial: [f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
        let (tau, derivative) = self.spring.response(strains);
        if self.duration == 0.0 {
            return (tau, derivative);
        }
        let j2 = self.j2(strains);
        let fluidity = self.viscosity.fluidity(j2, self.trace(strains, trial));
        let a = (0.5 * self.duration * (fluidity.logarithm - self.factor).exp()).min(f64::MAX);
        // on the plane Σe = 0, D the derivative: dτ/de_tr = D (1 + a(1 + 2p n⊗n)D)⁻¹, n = τ/|τ|
        let d = plane(&derivative);
        let normal = BASIS.map(|axis| dot(axis, tau) / (2.0 * j2).sqrt());
        let stiffening = if j2 > 0.0 { 2.0 * fluidity.by_stress } else { 0.0 };
        let weight: [[f64; 2]; 2] = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let one = if i == j { 1.0 } else { 0.0 };
                one + if stiffening > 0.0 { stiffening * normal[i] * normal[j] } else { 0.0 }
            })
        });
        let k: [[f64; 2]; 2] = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let one = if i == j { 1.0 } else { 0.0 };
                one + a * (weight[i][0] * d[0][j] + weight[i][1] * d[1][j])
            })
        });
        let determinant = k[0][0] * k[1][1] - k[0][1] * k[1][0];
        // rows of D K⁻¹
        let found = d.map(|[x, y]| {
            [(x * k[1][1] - y * k[1][0]) / determinant, (y * k[0][0] - x * k[0][1]) / determinant]
        });
        let off = 0.5 * (found[0][1] + found[1][0]);
        let found = [[found[0][0], off], [off, found[1][1]]];
        let entry = |i: usize, j: usize| -> f64 {
            (0..4).map(|n| BASIS[n / 2][i] * found[n / 2][n % 2] * BASIS[n % 2][j]).sum()
        };
        (tau, std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j))))
    }
}

/// Orthonormal axes of the plane Σe = 0.
const BASIS: [[f64; 3]; 2] = [
    [std::f64::consts::FRAC_1_SQRT_2, -std::f64::consts::FRAC_1_SQRT_2, 0.0],
    [0.408_248_290_463_863, 0.408_248_290_463_863, -0.816_496_580_927_726],
];

/// Components of a 3 × 3 matrix on the plane Σe = 0.
pub(super) fn plane(matrix: &[[f64; 3]; 3]) -> [[f64; 2]; 2] {
    let rows = BASIS.map(|axis| [0, 1, 2].map(|j| (0..3).map(|i| axis[i] * matrix[i][j]).sum::<f64>()));
    rows.map(|row| BASIS.map(|axis| dot(row, axis)))
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Newton step on Σe = 0 for a gradient and the diagonal 1 + 2α exp 2e.
fn newton_step(gradient: [f64; 3], squares: [f64; 3], alpha: f64) -> [f64; 3] {
    let inverse = squares.map(|x| 1.0 / (1.0 + 2.0 * alpha * x));
    let step: [f64; 3] = std::array::from_fn(|i| -gradient[i] * inverse[i]);
    let excess = step.iter().sum::<f64>() / inverse.iter().sum::<f64>();
    std::array::from_fn(|i| step[i] - excess * inverse[i])
}

/// e(α): e + α dev exp 2e = e_tr on Σe = 0, the minimum of a strictly convex function, from a first guess:
/// Newton's method, halved until the slope along the step has fallen.
fn relaxed(trial: [f64; 3], alpha: f64, guess: [f64; 3]) -> Result<[f64; 3], Error> {
    // gradient, and exp 2e for its derivative
    let gradient = |e: [f64; 3]| -> ([f64; 3], [f64; 3]) {
        let squares = squares_above_one(e);
        let mean = squares.iter().sum::<f64>() / 3.0;
        (std::array::from_fn(|i| e[i] - trial[i] + alpha * (squares[i] - mean)), squares.map(|x| 1.0 + x))
    };
    let largest = |e: [f64; 3]| e.iter().fold(0.0_f64, |most, e| most.max(e.abs()));
    let (mut strains, mut here) = (guess, gradient(guess));
    let mut moved = f64::INFINITY;
    for _ in 0..STEPS {
        let step = newton_step(here.0, here.1, alpha);
        moved = largest(step);
        let size = largest(strains);
        // rounding, of the strains or of the trial strains over the stiffness
        if moved <= 4.0 * f64::EPSILON * (size + largest(trial) / (1.0 + 2.0 * alpha)) {
            return Ok(strains);
        }
        let slope = dot(here.0, step).abs();
        let mut part = 1.0;
        loop {
            let next: [f64; 3] = std::array::from_fn(|i| strains[i] + part * step[i]);
            // a change of 1e-9 leaves an error of its square
            if part == 1.0 && moved <= 1e-9 * size {
                return Ok(next);
            }
            let there = gradient(next);
            if dot(there.0, step).abs() <= 0.9 * slope || part < 1e-12 {
                (strains, here) = (next, there);
                break;
            }
            part *= 0.5;
        }
    }
    Err(Error::NoConvergence { iteration: "the strains of a branch", steps: STEPS, residual: moved })
}
