//! Correspondence with a law that has a state: branches of springs and dashpots, softening by the largest
//! strain.

use super::constitutive::{at_thickness, check, find_thickness, isochoric_start, tangent_norm};
use super::past::{Driving, EnergyPart, Past};
use super::point_law::{Deformation, PointLaw, PointStress};
use super::tensor::BodyTensor;
use crate::calibrate::Space;
use crate::error::Error;
use nalgebra::Matrix3;
use polycore::constitutive::viscoelastic::{
    Branch, BranchState, Increment, Reaction, Response, State, Viscoelastic, Viscosity,
};
use polycore::constitutive::{Moduli, Workspace};
use polycore::tensor::voigt::{self, Voigt};
use std::cell::RefCell;

/// W = W_eq(C) + Σ_k W_k(C, C_v) + ½ aμ r + ½ g·max(0, √r − s)²: [`super::Correspondence`] whose law has a
/// state, with the residual r. Each step minimises the energy of backward Euler in exponential form
/// ([`Viscoelastic`]); g = a Σ_k ν_k/(1 + Δt ν_k/η_k) with ν and η at its start. s is the part of √r that
/// has relaxed, as the branches do: s ← √r + (s − √r) g/(aΣν) at the end of a step. A tenth of g acts on all
/// of r, so that no mode within s goes soft. A viscosity that depends on the pressure has that of the
/// particle at the start of the step, −tr σ/3 of the whole law.
///
/// A deformation without [`Past`] is one in equilibrium: it has the stress of W_eq alone.
pub struct ViscousCorrespondence {
    law: Viscoelastic,
    space: Space,
    moduli: Moduli,
    stabilisation: f64,
    driving: Driving,
    /// Temperature, K.
    temperature: f64,
    /// True if a viscosity depends on the pressure, which is then part of the state.
    keeps_pressure: bool,
    /// True if the stabilisation relaxes, whose s is then part of the state.
    keeps_residual: bool,
}

/// Scratch memory: states of a point at both ends of a step.
#[derive(Default)]
struct StepStates {
    memory: Workspace,
    start: State,
    end: State,
    /// Pressure at the start, Pa; 0 if no viscosity depends on it.
    pressure: f64,
}

/// Relative change of C₃₃ after which Newton's method leaves an error of its square, that of rounding: the
/// tangent of a step is exact.
const ENOUGH: f64 = 1e-9;
/// Relative change of C₃₃ whose square is below 1e-11 of the stress.
const NEARLY: f64 = 1e-6;

/// Share of the branches' stabilisation that acts on all of the residual.
const LASTING: f64 = 0.1;

thread_local! {
    static SCRATCH: RefCell<StepStates> = RefCell::default();
}

impl ViscousCorrespondence {
    /// Creates the solid with a stabilisation a ≥ 0; the equilibrium law is subject to the conditions of
    /// [`super::Correspondence::stabilised`].
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn new<const D: usize>(
        law: Viscoelastic,
        space: Space,
        stabilisation: f64,
        driving: Driving,
    ) -> Result<Self, Error> {
        let moduli = check::<D>(law.equilibrium(), space, stabilisation)?;
        let keeps_pressure = law.branches().iter().any(grows_with_pressure);
        let keeps_residual = stabilisation > 0.0 && !law.branches().is_empty();
        let temperature = 293.15;
        Ok(Self { law, space, moduli, stabilisation, driving, temperature, keeps_pressure, keeps_residual })
    }

    /// Sets the temperature, K, of branches with a shift; default 293.15.
    #[must_use]
    pub fn at_temperature(mut self, temperature: f64) -> Self {
        self.temperature = temperature;
        self
    }

    /// Step at a given C from a pressure, Pa.
    fn increment(&self, c: Voigt, duration: f64, pressure: f64) -> Increment {
        Increment { temperature: self.temperature, pressure, ..Increment::new(c, c, duration) }
    }

    /// Writes the state at the start of a step, and returns the pressure there, Pa.
    fn unpack(&self, past: &Past, state: &mut State) -> f64 {
        let mut rest = &past.state[..];
        let mut take = |count: usize| {
            let (taken, left) = rest.split_at(count);
            rest = left;
            taken
        };
        state.branches.clear();
        for branch in self.law.branches() {
            let viscous = Voigt::from_column_slice(take(6));
            let shear = if keeps_shear(branch) { take(1)[0] } else { 0.0 };
            state.branches.push(BranchState { viscous, shear });
        }
        state.peak = if self.law.softening().is_some() { take(1)[0] } else { 0.0 };
        if self.keeps_pressure { take(1)[0] } else { 0.0 }
    }

    fn pack(&self, state: &State, pressure: f64, relaxed: f64) -> impl Iterator<Item = f64> {
        let branches = self.law.branches().iter().zip(&state.branches).flat_map(|(branch, own)| {
            own.viscous.iter().copied().chain(keeps_shear(branch).then_some(own.shear))
        });
        let peak = self.law.softening().map(|_| state.peak);
        let pressure = self.keeps_pressure.then_some(pressure);
        branches.chain(peak).chain(pressure).chain(self.keeps_residual.then_some(relaxed))
    }

    /// Part of √r that has relaxed.
    fn relaxed_residual(&self, past: &Past) -> f64 {
        past.state.last().copied().filter(|_| self.keeps_residual).unwrap_or(0.0)
    }

    /// C, the response of a part of the energy there, and the state at the end in the scratch memory;
    /// `None` outside the law's domain. In plane stress the equilibrium law alone has its own thickness: the
    /// pressure that the branches need is no part of its stress.
    fn predict<const D: usize>(
        &self,
        deformation: &Deformation<D>,
        part: EnergyPart,
        tangent: bool,
        scratch: &mut StepStates,
    ) -> Option<(Voigt, Response)> {
        let mut law = self.law_of_step(deformation, part, scratch)?;
        let mut found = None;
        let (c, _) = at_thickness(self.space, ENOUGH, &deformation.gradient(), tangent, |c, tangent| {
            found = law(c, tangent);
            found.map(|found| found.prediction)
        })?;
        found.map(|found| (c, found))
    }

    /// Second Piola-Kirchhoff stress of a part of the energy, Pa. In plane stress it follows the last step of
    /// Newton's method along its tangent, an error of the square of [`NEARLY`], in place of another
    /// evaluation.
    fn stress<const D: usize>(
        &self,
        deformation: &Deformation<D>,
        part: EnergyPart,
        scratch: &mut StepStates,
    ) -> Option<Voigt> {
        let mut law = self.law_of_step(deformation, part, scratch)?;
        let mut c = isochoric_start(self.space, &deformation.gradient());
        if self.space != Space::PlaneStress {
            return law(&c, false).map(|found| found.prediction.stress);
        }
        let (found, change) = find_thickness(NEARLY, &mut c, |c| law(c, true).map(|found| found.prediction))?;
        Some(found.stress + found.tangent?.column(2) * (0.5 * change))
    }

    /// Response of a part of the energy to C, and to its tangent where asked; `None` for an inverted body.
    fn law_of_step<'a, const D: usize>(
        &'a self,
        deformation: &'a Deformation<D>,
        part: EnergyPart,
        scratch: &'a mut StepStates,
    ) -> Option<impl FnMut(&Voigt, bool) -> Option<Response> + 'a> {
        if deformation.volume_change() <= -1.0 {
            return None;
        }
        let StepStates { memory, start, end, pressure } = scratch;
        let past = deformation.past.as_deref();
        start.peak = 0.0;
        *pressure = past.map_or(0.0, |past| self.unpack(past, start));
        let past = past.filter(|_| !self.drives_alone(part));
        Some(move |c: &Voigt, tangent: bool| {
            let response = match past {
                Some(past) => {
                    let increment = self.increment(*c, past.duration, *pressure);
                    self.law.respond(start, &increment, tangent, end, memory)
                }
                None => self.law.respond_relaxed(start.peak, c, tangent, end, memory),
            };
            response.ok()
        })
    }

    /// Returns true for a part without branches.
    fn drives_alone(&self, part: EnergyPart) -> bool {
        part == EnergyPart::Driving && self.driving == Driving::Equilibrium
    }

    /// g/(aΣν): part of √r − s at the start of a step that is left at its end.
    fn left(&self, past: &Past) -> f64 {
        if past.duration == 0.0 || !self.keeps_residual {
            return 1.0;
        }
        // springs that stiffen exceed their modulus at rest
        let modulus = past.stabilisation / self.stabilisation - self.moduli.shear;
        (modulus / self.law.branch_modulus()).clamp(0.0, 1.0)
    }

    /// Energy of the stabilisation, J/m³, that of a part of the energy, and its modulus 2 ∂W/∂r, Pa.
    fn stabilisation_of<const D: usize>(&self, deformation: &Deformation<D>, part: EnergyPart) -> [f64; 2] {
        let (own, residual) = (self.stabilisation * self.moduli.shear, deformation.residual);
        let past = deformation.past.as_deref().filter(|_| !self.drives_alone(part));
        let Some(past) = past else { return [0.5 * own * residual, own] };
        let branches = past.stabilisation - own;
        let (root, relaxed) = (residual.sqrt(), self.relaxed_residual(past));
        let beyond = (root - relaxed).max(0.0);
        let free = if relaxed == 0.0 { 1.0 } else { beyond / root.max(relaxed) };
        let lasting = own + LASTING * branches;
        let fleeting = (1.0 - LASTING) * branches;
        // of all of the springs: as if nothing had flowed in the step, or at its end
        let left = if part == EnergyPart::Trial { 1.0 } else { self.left(past) };
        let springs = self.stabilisation * self.law.branch_modulus();
        let energy = (1.0 - LASTING) * springs * left * left;
        [0.5 * (lasting * residual + energy * beyond * beyond), lasting + fleeting * free]
    }
}

/// Returns true for a viscosity that depends on ∫ q/η dt.
fn keeps_shear(branch: &Branch) -> bool {
    matches!(branch.viscosity, Viscosity::Eyring { softening: Some(_), .. })
}

/// Returns true for a viscosity that depends on the pressure.
fn grows_with_pressure(branch: &Branch) -> bool {
    matches!(branch.viscosity, Viscosity::Eyring { pressure, .. } if pressure > 0.0)
}

/// Part of the energy that a deformation refers to.
fn part_of<const D: usize>(deformation: &Deformation<D>) -> EnergyPart {
    deformation.past.as_ref().map_or(EnergyPart::Stored, |past| past.part)
}

impl<const D: usize> PointLaw<D> for ViscousCorrespondence {
    fn energy(&self, deformation: &Deformation<D>) -> f64 {
        let part = part_of(deformation);
        let found = SCRATCH.with_borrow_mut(|scratch| self.predict(deformation, part, false, scratch));
        let energy = found.and_then(|(_, found)| {
            let trial = if part == EnergyPart::Trial { found.dissipated } else { 0.0 };
            Some(found.prediction.energy? + trial)
        });
        energy.unwrap_or(f64::NAN) + self.stabilisation_of(deformation, part)[0]
    }

    fn respond(&self, deformation: &Deformation<D>) -> PointStress<D> {
        let part = part_of(deformation);
        let found = SCRATCH.with_borrow_mut(|scratch| self.stress(deformation, part, scratch));
        let stress = found.map_or(Matrix3::from_element(f64::NAN), |stress| voigt::to_stress(&stress));
        let plane = BodyTensor::<D>::from_fn(|a, b| stress[(a, b)]);
        let [_, stabilisation] = self.stabilisation_of(deformation, part);
        PointStress { piola: deformation.gradient() * plane, stabilisation }
    }

    fn stiffness(&self, deformation: &Deformation<D>) -> f64 {
        let found =
            SCRATCH.with_borrow_mut(|scratch| self.predict(deformation, EnergyPart::Stored, true, scratch));
        found.map_or(f64::NAN, |(_, found)| {
            tangent_norm(self.space, &deformation.gradient(), &found.prediction)
        })
    }

    fn shear_modulus(&self) -> f64 {
        self.moduli.shear
    }

    fn bulk_modulus(&self) -> f64 {
        if self.space == Space::PlaneStress { 0.0 } else { self.moduli.bulk }
    }

    fn thickness_stretch(&self, deformation: &Deformation<D>) -> f64 {
        if self.space != Space::PlaneStress {
            return 1.0;
        }
        let found =
            SCRATCH.with_borrow_mut(|scratch| self.predict(deformation, EnergyPart::Stored, false, scratch));
        found.map_or(f64::NAN, |(c, _)| c[2].sqrt())
    }

    fn past(&self) -> Option<Past> {
        let state = self.pack(&self.law.rest(), 0.0, 0.0).collect();
        let stabilisation = self.stabilisation * (self.moduli.shear + self.law.branch_modulus());
        Some(Past { state, duration: 0.0, stabilisation, part: EnergyPart::Stored })
    }

    fn stabilise(&self, deformation: &mut Deformation<D>, duration: f64) {
        let modulus = SCRATCH.with_borrow_mut(|scratch| {
            // the thickness in equilibrium with the state at the start
            let (c, _) = self.predict(deformation, EnergyPart::Stored, false, scratch)?;
            let pressure = self.unpack(deformation.past.as_deref()?, &mut scratch.start);
            self.law.step_modulus(&scratch.start, &self.increment(c, duration, pressure)).ok()
        });
        if let (Some(past), Some(modulus)) = (&mut deformation.past, modulus) {
            past.stabilisation = self.stabilisation * (self.moduli.shear + modulus);
        }
    }

    fn advance(&self, deformation: &mut Deformation<D>) -> f64 {
        let of = |part| self.stabilisation_of(deformation, part)[0];
        let flowed = of(EnergyPart::Trial) - of(EnergyPart::Stored);
        let dissipated = SCRATCH.with_borrow_mut(|scratch| {
            let (c, found) = self.predict(deformation, EnergyPart::Stored, false, scratch)?;
            let root = deformation.residual.sqrt();
            if let Some(past) = &mut deformation.past {
                let pressure = Reaction::Law.pressure(&c, &found.prediction.stress);
                let relaxed = root + (self.relaxed_residual(past) - root) * self.left(past);
                let end = self.pack(&scratch.end, pressure, relaxed);
                past.state.iter_mut().zip(end).for_each(|(old, new)| *old = new);
            }
            Some(found.dissipated + flowed)
        });
        dissipated.unwrap_or(0.0)
    }
}
