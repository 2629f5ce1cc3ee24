//! Laws with time: an elastic law and branches of a spring in series with a dashpot, at finite strain.
//!
//! W(C, C_v) = W_eq(C) + Σ_k W_k(I₁ᵉ), I₁ᵉ = tr(C̄ C_v⁻¹), C̄ = J^(−2/3) C, and for each branch
//! dC_v/dt = (2W_k′/η)(C̄ − ⅓ I₁ᵉ C_v), det C_v = 1 (formulation-time.md, section A). At small strain this
//! is the generalized Maxwell solid, G(t) = μ + Σ ν_k exp(−t ν_k/η_k); the bulk response stays elastic.
//!
//! ```
//! use polycore::constitutive::hyperelastic::{Compressible, NeoHookean, Volumetric};
//! use polycore::constitutive::viscoelastic::{Branch, Increment, Spring, Viscoelastic, Viscosity};
//! use polycore::tensor::Voigt;
//!
//! let rubber = Compressible::new(NeoHookean::new(1e6)?, Volumetric::Ciarlet { lame: 1e9 })?;
//! // a branch of 2 MPa that relaxes in 3 s
//! let branch = Branch::new(Spring::NeoHookean(NeoHookean::new(2e6)?), Viscosity::Constant(6e6))?;
//! let law = Viscoelastic::new(Box::new(rubber), vec![branch])?;
//! let rest = Voigt::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
//! let sheared = Voigt::new(1.0, 1.0001, 1.0, 0.01, 0.0, 0.0);
//! let sudden = law.advance(&law.rest(), &Increment::new(rest, sheared, 0.0), &mut Default::default())?;
//! let late = law.advance(&sudden.state, &Increment::new(sheared, sheared, 1e3), &mut Default::default())?;
//! assert!((sudden.prediction.stress[3] - 3e4).abs() < 10.0);
//! assert!((late.prediction.stress[3] - 1e4).abs() < 100.0);
//! # Ok::<(), polycore::constitutive::Error>(())
//! ```

mod branch;
mod control;
pub mod fit;
mod flow;
mod hysteresis;
pub mod linear;
mod mullins;
mod shift;
mod spring;
pub mod user_material;
mod viscosity;

pub use branch::{Branch, BranchState};
pub use control::{History, Pace, Reaction, Trace, TracePoint, nominal_of_test, strain_of_test};
pub use hysteresis::Hysteresis;
pub use mullins::Mullins;
pub use shift::Shift;
pub use spring::Spring;
pub use viscosity::{Fluidity, StrainSoftening, Viscosity};

use super::isochoric::isochoric;
use super::{Error, Law, Prediction, Workspace};
use crate::tensor::{Voigt, voigt};
use branch::Conditions;

/// Law with time: an equilibrium law, branches, softening by the largest strain.
pub struct Viscoelastic {
    equilibrium: Box<dyn Law>,
    branches: Vec<Branch>,
    softening: Option<Mullins>,
}

/// State of a material point, at rest [`Viscoelastic::rest`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct State {
    /// State of each branch.
    pub branches: Vec<BranchState>,
    /// Largest W₀ so far, J/m³, for [`Mullins`]; else 0.
    pub peak: f64,
}

/// Time step of a material point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Increment {
    /// C at the start.
    pub from: Voigt,
    /// C at the end.
    pub to: Voigt,
    /// Duration, s, at least 0.
    pub duration: f64,
    /// Temperature, K; read by branches with a [`Shift`].
    pub temperature: f64,
    /// Pressure at the start, Pa; read by viscosities that depend on it.
    pub pressure: f64,
    /// Time integration.
    pub scheme: Scheme,
}

/// Time integration of branches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scheme {
    /// Backward Euler in exponential form: first order, an energy in each step, symmetric tangent, stable
    /// and monotone for any duration.
    #[default]
    Euler,
    /// L-stable SDIRK of two stages, second order, with the distance to Euler as error estimate; no tangent.
    /// Overshoots in one step much longer than the relaxation time.
    Sdirk2,
}

impl Increment {
    /// Creates a step by [`Scheme::Euler`] at 293.15 K without pressure.
    pub fn new(from: Voigt, to: Voigt, duration: f64) -> Self {
        Self { from, to, duration, temperature: 293.15, pressure: 0.0, scheme: Scheme::Euler }
    }
}

/// Result of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// S at the end, ℂ of the whole step (Euler), and the recoverable W.
    pub prediction: Prediction,
    /// State at the end.
    pub state: State,
    /// Energy dissipated in the step, J/m³: the decrease of W by the change of C_v, at the final C (Euler) or
    /// the mean of that at the first and the final C (SDIRK2).
    pub dissipated: f64,
    /// Norm of the distance of S between both schemes, Pa; 0 for Euler.
    pub error: f64,
}

/// Result of a step without the new state: fields of [`Step`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// S at the end, ℂ of the whole step (Euler), and the recoverable W.
    pub prediction: Prediction,
    /// Energy dissipated in the step, J/m³.
    pub dissipated: f64,
    /// Norm of the distance of S between both schemes, Pa; 0 for Euler.
    pub error: f64,
}

impl Viscoelastic {
    /// Creates a law of an elastic law and branches.
    ///
    /// # Errors
    /// [`Error::Parameter`] of a branch or its shift.
    pub fn new(equilibrium: Box<dyn Law>, branches: Vec<Branch>) -> Result<Self, Error> {
        for branch in &branches {
            branch.viscosity.check()?;
            if let Some((name, value)) = branch.shift.invalid_constant() {
                let (law, parameter, allowed) = ("shift", name.to_owned(), "(0, ∞)");
                return Err(Error::Parameter { law, parameter, value, allowed });
            }
        }
        Ok(Self { equilibrium, branches, softening: None })
    }

    /// Adds softening of the isochoric part of the equilibrium law.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn with_softening(mut self, softening: Mullins) -> Result<Self, Error> {
        softening.check()?;
        self.softening = Some(softening);
        Ok(self)
    }

    /// The equilibrium law.
    pub fn equilibrium(&self) -> &dyn Law {
        &*self.equilibrium
    }

    /// Softening of the equilibrium law.
    pub fn softening(&self) -> Option<&Mullins> {
        self.softening.as_ref()
    }

    /// The branches.
    pub fn branches(&self) -> &[Branch] {
        &self.branches
    }

    /// State of a virgin point.
    pub fn rest(&self) -> State {
        State { branches: vec![BranchState::REST; self.branches.len()], peak: 0.0 }
    }

    /// Shear modulus of all branches at frozen C_v, Σν, Pa: with that of the equilibrium law, the stiffness
    /// of a fast step.
    pub fn branch_modulus(&self) -> f64 {
        self.branches.iter().map(|branch| branch.spring.shear_modulus()).sum()
    }

    /// Advances a point by a step, with its tangent.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a duration below 0, a state of another law, or a C or C_v that is not positive
    /// definite; [`Error::Overflow`] for a step that locks a spring before it relaxes; errors of the
    /// equilibrium law.
    pub fn advance(
        &self,
        start: &State,
        increment: &Increment,
        memory: &mut Workspace,
    ) -> Result<Step, Error> {
        self.step(start, increment, true, memory)
    }

    /// Advances a point by a step, without its tangent.
    ///
    /// # Errors
    /// As [`Viscoelastic::advance`].
    pub fn advance_stress(
        &self,
        start: &State,
        increment: &Increment,
        memory: &mut Workspace,
    ) -> Result<Step, Error> {
        self.step(start, increment, false, memory)
    }

    fn step(
        &self,
        start: &State,
        increment: &Increment,
        tangent: bool,
        memory: &mut Workspace,
    ) -> Result<Step, Error> {
        let mut state = State { branches: Vec::with_capacity(self.branches.len()), peak: 0.0 };
        let Response { prediction, dissipated, error } =
            self.respond(start, increment, tangent, &mut state, memory)?;
        Ok(Step { prediction, state, dissipated, error })
    }

    /// Advances a point by a step, with its tangent or without. Writes the state at the end to `end`, and
    /// allocates nothing once `end` and `memory` have served the same law.
    ///
    /// # Errors
    /// As [`Viscoelastic::advance`].
    pub fn respond(
        &self,
        start: &State,
        increment: &Increment,
        tangent: bool,
        end: &mut State,
        memory: &mut Workspace,
    ) -> Result<Response, Error> {
        if !(increment.duration >= 0.0 && increment.duration.is_finite()) {
            return Err(Error::invalid("duration", increment.duration, "at least 0 s, finite"));
        }
        if start.branches.len() != self.branches.len() {
            let allowed = format!("{}, one for each branch", self.branches.len());
            return Err(Error::invalid("states of branches", start.branches.len(), allowed));
        }
        let mut all = self.respond_relaxed(start.peak, &increment.to, tangent, end, memory)?;
        let c = voigt::to_stress(&increment.to);
        let volume = c.determinant().cbrt();
        let isochoric = c / volume;
        let conditions = Conditions::new(increment);
        let mut distance = Voigt::zeros();
        end.branches.clear();
        for (branch, start) in self.branches.iter().zip(&start.branches) {
            let euler = branch.euler((volume, &isochoric), start, &conditions, tangent)?;
            let found = match increment.scheme {
                Scheme::Euler => euler,
                Scheme::Sdirk2 => {
                    let before = voigt::to_stress(&increment.from);
                    let before = before / before.determinant().cbrt();
                    branch.sdirk2((volume, &isochoric), &before, start, &conditions, &euler)?
                }
            };
            distance += found.stress - euler.stress;
            all.prediction.stress += found.stress;
            all.prediction.tangent = all.prediction.tangent.zip(found.tangent).map(|(sum, own)| sum + own);
            all.prediction.energy = all.prediction.energy.map(|sum| sum + found.energy);
            all.dissipated += found.dissipated;
            end.branches.push(found.state);
        }
        all.error = distance.norm();
        Ok(all)
    }

    /// Response of the equilibrium law with its softening, without branches, after a largest W₀ of `peak`;
    /// writes the new one to `end`.
    ///
    /// # Errors
    /// Errors of the equilibrium law; [`Error::Invalid`] for one without energy that softens.
    pub fn respond_relaxed(
        &self,
        peak: f64,
        c: &Voigt,
        tangent: bool,
        end: &mut State,
        memory: &mut Workspace,
    ) -> Result<Response, Error> {
        let mut prediction = if tangent {
            self.equilibrium.tangent(c, memory)?
        } else {
            self.equilibrium.stress(c, memory)?
        };
        end.peak = peak;
        let Some(softening) = &self.softening else {
            return Ok(Response { prediction, dissipated: 0.0, error: 0.0 });
        };
        let found = isochoric(&*self.equilibrium, &voigt::to_stress(c), tangent, memory)?;
        let energy = found.energy.ok_or_else(|| {
            Error::invalid(
                "equilibrium law",
                self.equilibrium.name(),
                "a law with an energy, for Mullins softening",
            )
        })?;
        end.peak = peak.max(energy);
        let (factor, slope) = softening.factor(energy, end.peak);
        // first loading has ζ = 1 all along
        let slope = if energy < peak { slope } else { 0.0 };
        prediction.stress -= (1.0 - factor) * found.stress;
        prediction.tangent = prediction
            .tangent
            .zip(found.tangent)
            .map(|(full, own)| full - (1.0 - factor) * own + slope * found.stress * found.stress.transpose());
        let [recoverable, dissipated] = softening.energies(energy, end.peak);
        let before = softening.energies(peak, peak)[1];
        prediction.energy = prediction.energy.map(|full| full - energy + recoverable);
        Ok(Response { prediction, dissipated: dissipated - before, error: 0.0 })
    }

    /// Σ 2W′/(1 + Δt 2W′/η), Pa: shear modulus of the branches in a step, from the C and C_v at its start.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a C or C_v that is not positive definite.
    pub fn step_modulus(&self, start: &State, increment: &Increment) -> Result<f64, Error> {
        let c = voigt::to_stress(&increment.from);
        let isochoric = c / c.determinant().cbrt();
        let conditions = Conditions::new(increment);
        let branches = self.branches.iter().zip(&start.branches);
        branches.map(|(branch, start)| branch.step_modulus(&isochoric, start, &conditions)).sum()
    }
}
