//! Step of a branch: C̄ and C_v at the start → C_v at the end, stress, tangent, energies.

use super::flow::{Flow, ViscousTrace};
use super::{Increment, Shift, Spring, Viscosity};
use crate::constitutive::Error;
use crate::constitutive::hyperelastic::PrincipalResponse;
use crate::tensor::{DeformationGradient, Tensor, Voigt, Voigt6x6, voigt};

/// Branch of a viscoelastic law: a spring in series with a dashpot.
#[derive(Debug, Clone, PartialEq)]
pub struct Branch {
    /// The spring.
    pub spring: Spring,
    /// The dashpot.
    pub viscosity: Viscosity,
    /// Factor a_T on the viscosity.
    pub shift: Shift,
}

/// State of a branch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BranchState {
    /// C_v, det C_v = 1.
    pub viscous: Voigt,
    /// ∫ q/η dt, viscous shear that softens glassy polymers.
    pub shear: f64,
}

impl BranchState {
    /// State of a virgin branch.
    pub const REST: Self = Self { viscous: Voigt::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0), shear: 0.0 };
}

/// Result of a step of a branch.
#[derive(Debug, Clone, Copy)]
pub(super) struct BranchStep {
    pub state: BranchState,
    pub stress: Voigt,
    pub tangent: Option<Voigt6x6>,
    /// W at the end, J/m³.
    pub energy: f64,
    /// W(C, C_v at the start) − W(C, C_v at the end), J/m³, at the last C; the mean of first and last C for
    /// second order.
    pub dissipated: f64,
}

/// Conditions of a step that all branches share.
#[derive(Debug, Clone, Copy)]
pub(super) struct Conditions {
    pub duration: f64,
    pub temperature: f64,
    pub pressure: f64,
}

impl Conditions {
    pub fn new(increment: &Increment) -> Self {
        let Increment { duration, temperature, pressure, .. } = *increment;
        Self { duration, temperature, pressure }
    }
}

/// Frame of a branch in a step: C_v = LLᵀ, L⁻¹C̄L⁻ᵀ = Q diag(exp 2e_tr) Qᵀ.
struct Frame {
    /// e_tr, without its mean.
    trial: [f64; 3],
    /// LQ.
    forward: Tensor,
    /// L⁻ᵀQ.
    inverse: Tensor,
}

impl Frame {
    fn new(isochoric: &Tensor, viscous: &Tensor) -> Result<Self, Error> {
        let refuse = |name, tensor: &Tensor| Error::invalid(name, tensor, "positive definite");
        let factor = viscous.cholesky().ok_or_else(|| refuse("C_v", viscous))?.l();
        let strain = isochoric.cholesky().ok_or_else(|| refuse("C", isochoric))?.l();
        let inverse = factor.try_inverse().ok_or_else(|| refuse("C_v", viscous))?;
        // A = GᵀG with G = Uᵀ-factor of C̄ times L⁻ᵀ: principal stretches without squaring
        let gradient = product(&inverse, &strain).transpose();
        let frame = DeformationGradient::new(gradient)?.principal_frame();
        let logarithms = frame.stretches.map(f64::ln);
        let mean = logarithms.iter().sum::<f64>() / 3.0;
        Ok(Self {
            trial: logarithms.map(|e| e - mean),
            forward: product(&factor, &frame.referential),
            inverse: product(&inverse.transpose(), &frame.referential),
        })
    }

    /// C_v after the flow `rate`·(e_tr − e).
    fn flowed(&self, strains: [f64; 3], rate: f64) -> Tensor {
        let grown: [f64; 3] = std::array::from_fn(|i| (2.0 * rate * (self.trial[i] - strains[i])).exp());
        diagonal_in(&self.forward, grown)
    }

    /// Principal values aᵢ = J^(2/3) exp 2eᵢ of C in the frame.
    fn squares(&self, c: &Tensor) -> [f64; 3] {
        let volume = c.determinant().cbrt();
        self.trial.map(|e| volume * (2.0 * e).exp())
    }

    /// mᵢ of I₁ᵛ = Σ mᵢ exp 2(e_tr − e)ᵢ.
    fn weights(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| self.forward.column(i).norm_squared())
    }

    /// √2 |e_tr − e|, the viscous shear of a step.
    fn shear(&self, strains: [f64; 3]) -> f64 {
        (2.0 * (0..3).map(|i| (self.trial[i] - strains[i]).powi(2)).sum::<f64>()).sqrt()
    }
}

/// A B in loops, which the compiler unrolls; nalgebra's product calls a function for each column.
fn product(a: &Tensor, b: &Tensor) -> Tensor {
    let mut product = Tensor::zeros();
    for j in 0..3 {
        for i in 0..3 {
            product[(i, j)] = a[(i, 0)] * b[(0, j)] + a[(i, 1)] * b[(1, j)] + a[(i, 2)] * b[(2, j)];
        }
    }
    product
}

/// A diag(v) Aᵀ, symmetric to the last bit.
fn diagonal_in(a: &Tensor, values: [f64; 3]) -> Tensor {
    let mut sum = Tensor::zeros();
    for i in 0..3 {
        for j in 0..=i {
            for k in 0..3 {
                sum[(i, j)] += values[k] * (a[(i, k)] * a[(j, k)]);
            }
            sum[(j, i)] = sum[(i, j)];
        }
    }
    sum
}

/// γ of the L-stable SDIRK method of two stages, 1 − 1/√2.
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;

impl Branch {
    /// Creates a branch with the viscosity of the reference temperature at all temperatures.
    ///
    /// # Errors
    /// [`Error::Parameter`] of the viscosity.
    pub fn new(spring: Spring, viscosity: Viscosity) -> Result<Self, Error> {
        viscosity.check()?;
        Ok(Self { spring, viscosity, shift: Shift::None })
    }

    /// Advances the branch alone by a step of [`Scheme::Euler`](super::Scheme::Euler): its S at the end, Pa,
    /// and its state there.
    ///
    /// # Errors
    /// As [`Viscoelastic::advance`](super::Viscoelastic::advance).
    pub fn advance(&self, start: &BranchState, increment: &Increment) -> Result<(Voigt, BranchState), Error> {
        let c = voigt::to_stress(&increment.to);
        let isochoric = c / c.determinant().cbrt();
        let step = self.euler([&c, &isochoric], start, &Conditions::new(increment), false)?;
        Ok((step.stress, step.state))
    }

    /// ln of the factor on η at the start of a step.
    fn factor(&self, start: &BranchState, conditions: &Conditions) -> f64 {
        self.shift.logarithm(conditions.temperature) + self.viscosity.glassy(conditions.pressure, start.shear)
    }

    fn flow(&self, duration: f64, factor: f64, trace: ViscousTrace) -> Flow<'_> {
        Flow { spring: &self.spring, viscosity: &self.viscosity, duration, factor, trace }
    }

    /// 2W′/(1 + Δt 2W′/η) at the start of a step, Pa.
    pub(super) fn step_modulus(
        &self,
        isochoric: &Tensor,
        start: &BranchState,
        conditions: &Conditions,
    ) -> Result<f64, Error> {
        let viscous = voigt::to_stress(&start.viscous);
        let trial = Frame::new(isochoric, &viscous)?.trial;
        let trace = ViscousTrace::Start(viscous.trace());
        let flow = self.flow(conditions.duration, self.factor(start, conditions), trace);
        Ok(self.spring.slopes(trial)[0] / (1.0 + 2.0 * flow.logarithm(trial, trial).exp()))
    }

    /// Backward Euler in exponential form.
    pub(super) fn euler(
        &self,
        [c, isochoric]: [&Tensor; 2],
        start: &BranchState,
        conditions: &Conditions,
        tangent: bool,
    ) -> Result<BranchStep, Error> {
        let viscous = voigt::to_stress(&start.viscous);
        let frame = Frame::new(isochoric, &viscous)?;
        let trace = ViscousTrace::Start(viscous.trace());
        let flow = self.flow(conditions.duration, self.factor(start, conditions), trace);
        let strains = flow.solve(frame.trial)?;
        let state = BranchState {
            viscous: if strains == frame.trial {
                start.viscous
            } else {
                voigt::from_stress(&frame.flowed(strains, 1.0))
            },
            shear: start.shear + frame.shear(strains),
        };
        let trial = self.spring.energy(frame.trial);
        let mut step = self.ended(&frame, c, state, strains, trial)?;
        step.tangent = tangent.then(|| {
            let response = principal(&frame, c, flow.response(strains, frame.trial));
            voigt::transform_tangent(&response.tangent(), &frame.inverse)
        });
        Ok(step)
    }

    /// Result of a step without its tangent; `before` is W at the last C and the C_v at the start.
    fn ended(
        &self,
        frame: &Frame,
        c: &Tensor,
        state: BranchState,
        strains: [f64; 3],
        before: f64,
    ) -> Result<BranchStep, Error> {
        let energy = self.spring.energy(strains);
        if !before.is_finite() {
            let stretches = frame.trial.map(f64::exp);
            return Err(Error::Overflow { law: "spring of a branch at the start of a step", stretches });
        }
        let (tau, squares) = (self.spring.stress(strains), frame.squares(c));
        let diagonal = [0, 1, 2].map(|i| tau[i] / squares[i]);
        let stress = voigt::from_stress(&diagonal_in(&frame.inverse, diagonal));
        Ok(BranchStep { state, stress, tangent: None, energy, dissipated: before - energy })
    }

    /// Second order: two stages, the flows composed as exponentials, C̄ linear within the step. `euler` is
    /// the step of [`Branch::euler`], which has the trial energy. No tangent.
    pub(super) fn sdirk2(
        &self,
        [c, isochoric]: [&Tensor; 2],
        isochoric_before: &Tensor,
        start: &BranchState,
        conditions: &Conditions,
        euler: &BranchStep,
    ) -> Result<BranchStep, Error> {
        let between = isochoric_before + GAMMA * (isochoric - isochoric_before);
        let between = between / between.determinant().cbrt();
        let (duration, factor) = (GAMMA * conditions.duration, self.factor(start, conditions));
        let stage = |isochoric: &Tensor, viscous: &Tensor| -> Result<(Frame, [f64; 3]), Error> {
            let frame = Frame::new(isochoric, viscous)?;
            let flow = self.flow(duration, factor, ViscousTrace::End(frame.weights()));
            let strains = flow.solve(frame.trial)?;
            Ok((frame, strains))
        };
        let share = (1.0 - GAMMA) / GAMMA;
        let (first, at_first) = stage(&between, &voigt::to_stress(&start.viscous))?;
        let (last, strains) = stage(isochoric, &first.flowed(at_first, share))?;
        let ended = last.flowed(strains, 1.0);
        let state = BranchState {
            viscous: voigt::from_stress(&ended),
            shear: start.shear + share * first.shear(at_first) + last.shear(strains),
        };
        let mut step = self.ended(&last, c, state, strains, euler.energy + euler.dissipated)?;
        // half the release at the first C, half at the last: second order as well
        let at_first = |viscous: &Tensor| -> Result<f64, Error> {
            Ok(self.spring.energy(Frame::new(isochoric_before, viscous)?.trial))
        };
        let release = at_first(&voigt::to_stress(&start.viscous))? - at_first(&ended)?;
        step.dissipated = 0.5 * (release + step.dissipated);
        Ok(step)
    }
}

/// τ and dτ/de in principal axes, Pa.
type PrincipalStress = ([f64; 3], [[f64; 3]; 3]);

/// Response in the frame with its squares aᵢ from τ and dτ/de: Sᵢ = τᵢ/aᵢ, ℂ_iijj = (dτᵢ/deⱼ −
/// 2δᵢⱼτᵢ)/(aᵢaⱼ), ℂ_ijij = (Sᵢ − Sⱼ)/(aᵢ − aⱼ) or its limit.
fn principal(frame: &Frame, c: &Tensor, (tau, derivative): PrincipalStress) -> PrincipalResponse {
    let (trial, squares) = (frame.trial, frame.squares(c));
    let stress: [f64; 3] = std::array::from_fn(|i| tau[i] / squares[i]);
    let normal: [[f64; 3]; 3] = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let own = if i == j { 2.0 * tau[i] } else { 0.0 };
            (derivative[i][j] - own) / squares[i] / squares[j]
        })
    });
    let shear = [(0, 1), (0, 2), (1, 2)].map(|(i, j)| {
        if (trial[i] - trial[j]).abs() > NEAR_EQUAL {
            (stress[i] - stress[j]) / (squares[i] - squares[j])
        } else {
            0.25 * (normal[i][i] + normal[j][j] - normal[i][j] - normal[j][i])
        }
    });
    PrincipalResponse { stress, normal, shear }
}

/// Distance of log strains below which the quotient of differences is its limit: the limit is off by the
/// square, the quotient by ε over it.
const NEAR_EQUAL: f64 = 1e-5;
