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
        if keeps_plane(isochoric)
            && keeps_plane(viscous)
            && let Some(frame) = Self::plane(isochoric, viscous)
        {
            return Ok(frame);
        }
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

    /// Frame of tensors that keep the plane and its normal, by one rotation; `None` if one is not positive
    /// definite.
    fn plane(isochoric: &Tensor, viscous: &Tensor) -> Option<Self> {
        // diagonal and off-diagonal entries of the Cholesky factor
        let factor = |a: &Tensor| {
            let off = a[(0, 1)] / a[(0, 0)].sqrt();
            let [x, y, z] = [a[(0, 0)], a[(1, 1)] - off * off, a[(2, 2)]];
            (x > 0.0 && y > 0.0 && z > 0.0).then(|| ([x, y, z].map(f64::sqrt), off))
        };
        let ([l1, l2, l3], l21) = factor(viscous)?;
        let ([s1, s2, s3], s21) = factor(isochoric)?;
        // G = L⁻¹S is lower triangular; a rotation makes its rows orthogonal
        let (g1, g2) = (s1 / l1, s2 / l2);
        let g21 = (s21 - l21 * g1) / l2;
        let shared = g1 * g21;
        let tangent = if shared == 0.0 {
            0.0
        } else {
            let zeta = (g21 * g21 + g2 * g2 - g1 * g1) / (2.0 * shared);
            zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt())
        };
        let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
        let sine = tangent * cosine;
        let first = (cosine * g1 - sine * g21).powi(2) + (sine * g2).powi(2);
        let second = (sine * g1 + cosine * g21).powi(2) + (cosine * g2).powi(2);
        // the smaller from the determinant, which does not cancel
        let larger = first.max(second).sqrt();
        let smaller = g1 * g2 / larger;
        let stretches = if first > second { [larger, smaller, s3 / l3] } else { [smaller, larger, s3 / l3] };
        let logarithms = stretches.map(f64::ln);
        let mean = logarithms.iter().sum::<f64>() / 3.0;
        let block = |[a, b, c, d]: [f64; 4], e: f64| Tensor::new(a, b, 0.0, c, d, 0.0, 0.0, 0.0, e);
        let skew = l21 / (l1 * l2);
        Some(Self {
            trial: logarithms.map(|e| e - mean),
            forward: block([l1 * cosine, l1 * sine, l21 * cosine - l2 * sine, l21 * sine + l2 * cosine], l3),
            inverse: block(
                [cosine / l1 + skew * sine, sine / l1 - skew * cosine, -sine / l2, cosine / l2],
                1.0 / l3,
            ),
        })
    }

    /// C_v after the flow `rate`·(e_tr − e).
    fn flowed(&self, strains: [f64; 3], rate: f64) -> Tensor {
        let grown: [f64; 3] = std::array::from_fn(|i| (2.0 * rate * (self.trial[i] - strains[i])).exp());
        diagonal_in(&self.forward, grown)
    }

    /// Principal values aᵢ = J^(2/3) exp 2eᵢ of C in the frame; `volume` is J^(2/3).
    fn squares(&self, volume: f64) -> [f64; 3] {
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

/// Returns true for a tensor without components 13 and 23.
fn keeps_plane(a: &Tensor) -> bool {
    a[(0, 2)] == 0.0 && a[(1, 2)] == 0.0
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
        let volume = c.determinant().cbrt();
        let step = self.euler((volume, &(c / volume)), start, &Conditions::new(increment), false)?;
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

    /// Backward Euler in exponential form, from J^(2/3) and C̄.
    pub(super) fn euler(
        &self,
        (volume, isochoric): (f64, &Tensor),
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
        let mut step = self.ended(&frame, volume, state, strains, trial)?;
        step.tangent = tangent.then(|| {
            let response = principal(&frame, volume, flow.response(strains, frame.trial));
            voigt::transform_tangent(&response.tangent(), &frame.inverse)
        });
        Ok(step)
    }

    /// Result of a step without its tangent; `before` is W at the last C and the C_v at the start.
    fn ended(
        &self,
        frame: &Frame,
        volume: f64,
        state: BranchState,
        strains: [f64; 3],
        before: f64,
    ) -> Result<BranchStep, Error> {
        let (energy, tau) = self.spring.energy_and_stress(strains);
        if !before.is_finite() {
            let stretches = frame.trial.map(f64::exp);
            return Err(Error::Overflow { law: "spring of a branch at the start of a step", stretches });
        }
        let squares = frame.squares(volume);
        let diagonal = [0, 1, 2].map(|i| tau[i] / squares[i]);
        let stress = voigt::from_stress(&diagonal_in(&frame.inverse, diagonal));
        Ok(BranchStep { state, stress, tangent: None, energy, dissipated: before - energy })
    }

    /// Second order: two stages, the flows composed as exponentials, C̄ linear within the step. `euler` is
    /// the step of [`Branch::euler`], which has the trial energy. No tangent.
    pub(super) fn sdirk2(
        &self,
        (volume, isochoric): (f64, &Tensor),
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
        let mut step = self.ended(&last, volume, state, strains, euler.energy + euler.dissipated)?;
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
fn principal(frame: &Frame, volume: f64, (tau, derivative): PrincipalStress) -> PrincipalResponse {
    let (trial, squares) = (frame.trial, frame.squares(volume));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::NeoHookean;

    /// A step in the plane 12 and the same in the plane 13, which has no frame of its own: stress, state and
    /// tangent agree, for equal stretches, a graded C and one with its axes at 45°.
    #[test]
    fn frames_of_the_plane() {
        let rubber = NeoHookean::new(1e5).unwrap();
        let branch = Branch::new(Spring::NeoHookean(rubber), Viscosity::Constant(1e5)).unwrap();
        let conditions = Conditions { duration: 0.3, temperature: 293.15, pressure: 0.0 };
        // 11, 22, 33, 12 to 11, 33, 22, 13
        let turned = |a: &Voigt| Voigt::new(a[0], a[2], a[1], a[4], a[3], a[5]);
        let step = |c: &Voigt, viscous: &Voigt| {
            let c = voigt::to_stress(c);
            let volume = c.determinant().cbrt();
            let start = BranchState { viscous: *viscous, shear: 0.0 };
            branch.euler((volume, &(c / volume)), &start, &conditions, true).unwrap()
        };
        let rest = Voigt::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
        let flowed = Voigt::new(1.3, 1.04, 0.8, 0.18, 0.0, 0.0);
        let flowed = flowed / voigt::to_stress(&flowed).determinant().cbrt();
        for c in [
            rest,
            Voigt::new(4.0, 4.0, 0.0625, 0.0, 0.0, 0.0),
            Voigt::new(1.5, 1.5, 0.7, 0.4, 0.0, 0.0),
            Voigt::new(1.5, 1.5, 0.7, -1e-9, 0.0, 0.0),
            Voigt::new(1e4, 1e-3, 1.0, 0.5, 0.0, 0.0),
            Voigt::new(2.0, 0.6, 1.1, -0.3, 0.0, 0.0),
        ] {
            for viscous in [rest, flowed] {
                let (here, there) = (step(&c, &viscous), step(&turned(&c), &turned(&viscous)));
                let scale = here.stress.amax().max(1e-9);
                assert!((turned(&here.stress) - there.stress).amax() <= 1e-10 * scale, "{c}{viscous}");
                let states = turned(&here.state.viscous) - there.state.viscous;
                assert!(states.amax() <= 1e-10 * there.state.viscous.amax(), "{c}{viscous}");
                assert!((here.energy - there.energy).abs() <= 1e-10 * there.energy.max(1.0), "{c}{viscous}");
                let [here, there] = [here.tangent.unwrap(), there.tangent.unwrap()];
                let places = [0, 2, 1, 4, 3, 5];
                let turned = Voigt6x6::from_fn(|i, j| here[(places[i], places[j])]);
                assert!((turned - there).amax() <= 1e-7 * there.amax(), "{c}{viscous}{turned}{there}");
            }
        }
    }
}
