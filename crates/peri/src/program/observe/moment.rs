//! A body in a state, and what is derived from it once.

use super::material::Physics;
use crate::bonds::{Bonds, Fragment, covered_stretches, fragments};
use crate::error::Error;
use crate::potential::KernelFit;
use crate::program::scene::Scene;
use crate::solver::{State, StepRecord};
use crate::stress::{
    self, MeasuredStress, StressInput, StressMethod, StressTensor, SurfaceCompensation, cauchy,
    deformation_gradients,
};
use harness::observe::{Fields, Observer, Scalars};
use harness::report::Phases;
use std::cell::{OnceCell, RefCell};
use std::time::Instant;

/// A stress field of each measure.
pub type StressFields<const D: usize> = Vec<(StressMethod, Vec<StressTensor<D>>)>;

/// Stresses of a state by every measure that the scene names.
#[derive(Default)]
pub struct Stresses<const D: usize> {
    /// First Piola–Kirchhoff.
    pub piola: StressFields<D>,
    /// Cauchy.
    pub cauchy: StressFields<D>,
}

/// A body in a state, and what is derived from it once.
pub struct Moment<'a, const D: usize> {
    /// The scene of the variant.
    pub scene: &'a Scene,
    /// What the scene has been turned into.
    pub physics: &'a Physics<D>,
    /// Intact bonds.
    pub bonds: &'a dyn Bonds<D>,
    /// Displacement and history.
    pub state: &'a State<D>,
    phases: &'a RefCell<Phases>,
    stresses: OnceCell<Stresses<D>>,
    fragments: OnceCell<Vec<Fragment>>,
}

impl<'a, const D: usize> Moment<'a, D> {
    /// A body in a state; `phases` take the time of its stresses.
    pub fn new(
        (scene, physics): (&'a Scene, &'a Physics<D>),
        bonds: &'a dyn Bonds<D>,
        state: &'a State<D>,
        phases: &'a RefCell<Phases>,
    ) -> Self {
        let (stresses, fragments) = (OnceCell::new(), OnceCell::new());
        Self { scene, physics, bonds, state, phases, stresses, fragments }
    }

    /// A number of every row of the history.
    pub fn each(&self, get: fn(&StepRecord) -> f64) -> impl Iterator<Item = f64> {
        self.state.history.iter().map(get)
    }

    /// Sites of the particles.
    pub fn sites(&self) -> impl Iterator<Item = usize> + Clone {
        self.bonds.particles().iter().map(|&site| site as usize)
    }

    /// Pieces of the body, the largest first, where bonds may break.
    pub fn fragments(&self) -> &[Fragment] {
        let breaks = self.physics.body.criterion.is_some();
        self.fragments.get_or_init(|| if breaks { fragments(self.bonds) } else { Vec::new() })
    }

    /// Broken bonds over those of the body without cracks, particle by particle: bonds that cracks of the scene break are damage.
    /// `None` where there are no cracks and no bond breaks.
    pub fn damage(&self) -> Option<Vec<f64>> {
        let [whole, _] = self.physics.whole.as_ref()?;
        let part = |(&whole, site): (&u32, usize)| match whole {
            0 => 0.0,
            _ => 1.0 - f64::from(self.bonds.bonded(site)) / f64::from(whole),
        };
        Some(whole.iter().zip(self.sites()).map(part).collect())
    }

    /// The sum of the damage that cracks of the scene are.
    pub fn damage_of_cracks(&self) -> f64 {
        let part = |(&whole, &cracked): (&u32, &u32)| match whole {
            0 => 0.0,
            _ => 1.0 - f64::from(whole - cracked) / f64::from(whole),
        };
        self.physics.whole.as_ref().map_or(0.0, |[whole, cracked]| whole.iter().zip(cracked).map(part).sum())
    }

    /// Stresses; the phase of a measure is what it would take alone ([`MeasuredStress::seconds`]).
    ///
    /// # Errors
    /// As [`KernelFit::new`].
    pub fn stresses(&self) -> Result<&Stresses<D>, Error> {
        match self.stresses.get() {
            Some(known) => Ok(known),
            None => {
                let stresses = self.evaluate()?;
                Ok(self.stresses.get_or_init(|| stresses))
            }
        }
    }

    fn evaluate(&self) -> Result<Stresses<D>, Error> {
        let mut stresses = Stresses::default();
        let Some(spec) = &self.scene.stress else { return Ok(stresses) };
        let keeps = self.scene.output.fields || !self.scene.output.line.is_empty();
        let (bonds, state, evaluator) = (self.bonds, self.state, &self.physics.evaluator);
        let mut phases = self.phases.borrow_mut();
        let Some(material) = evaluator.bond_material() else {
            let found = phases.time("stress constitutive", || evaluator.stress(bonds, state));
            if let Some([piola, cauchy]) = found {
                stresses.cauchy.push((StressMethod::Constitutive, cauchy));
                stresses.piola.extend(keeps.then_some((StressMethod::Constitutive, piola)));
            }
            return Ok(stresses);
        };
        let stretches = covered_stretches(bonds, &state.displacement);
        let fit = KernelFit::new(material.law(), stretches, self.scene.fit_bound())?;
        let gradients =
            phases.time("deformation gradient", || deformation_gradients(bonds, &state.displacement));
        let (modulus, missing) = (material.modulus(), SurfaceCompensation::WindowAt(&self.physics.by_window));
        let loaded = StressInput { displacement: &state.displacement, fit: &fit, modulus, missing };
        let measured = stress::piolas(bonds, &loaded, &spec.measures, spec.ball);
        for (&measure, MeasuredStress { piola, seconds }) in spec.measures.iter().zip(measured) {
            let started = Instant::now();
            stresses.cauchy.push((measure, cauchy(&piola, &gradients)));
            let seconds = seconds + started.elapsed().as_secs_f64();
            phases.add(&format!("stress {}", measure.name()), seconds);
            if keeps {
                stresses.piola.push((measure, piola));
            }
        }
        Ok(stresses)
    }
}

/// The observers of a scene, in the order of their output.
pub type Observers<'s, const D: usize> = Vec<Box<dyn for<'m> Observer<Moment<'m, D>, Error> + 's>>;

/// An observer without memory and files: scalars, fields and warnings of a scene.
#[derive(Clone, Copy)]
pub(super) struct Values<'s, const D: usize> {
    pub scene: &'s Scene,
    pub scalars: for<'t, 'm> fn(&Scene, &mut Scalars<'t, Moment<'m, D>>),
    pub fields: for<'t, 'm> fn(&Scene, &mut Fields<'t, Moment<'m, D>>),
    pub warnings: for<'m> fn(&Moment<'m, D>) -> Vec<String>,
}

impl<'s, const D: usize> Values<'s, D> {
    pub fn none(scene: &'s Scene) -> Self {
        Self { scene, scalars: |_, _| {}, fields: |_, _| {}, warnings: |_| Vec::new() }
    }
}

impl<'m, const D: usize> Observer<Moment<'m, D>, Error> for Values<'_, D> {
    fn scalars(&self, to: &mut Scalars<Moment<'m, D>>) {
        (self.scalars)(self.scene, to);
    }

    fn fields(&self, to: &mut Fields<Moment<'m, D>>) {
        (self.fields)(self.scene, to);
    }

    fn warnings(&self, state: &Moment<'m, D>) -> Vec<String> {
        (self.warnings)(state)
    }
}
