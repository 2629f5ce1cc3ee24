//! State of a body at one moment, with derived fields computed at most once.

use super::material::Physics;
use crate::bonds::{Bonds, Fragment, covered_stretches, fragments};
use crate::contact::SurfaceTraction;
use crate::error::Error;
use crate::program::card::{self, Card};
use crate::program::scene::Scene;
use crate::solver::{State, StepRecord};
use crate::stress::{
    self, BondFits, MeasuredStress, StressInput, StressMethod, StressTensor, SurfaceCompensation, cauchy,
    deformation_gradients,
};
use harness::observe::{Fields, Observer, Scalars};
use harness::report::Phases;
use std::cell::{OnceCell, RefCell};
use std::time::Instant;

/// Stress fields by measure.
pub type StressFields<const D: usize> = Vec<(StressMethod, Vec<StressTensor<D>>)>;

/// Stresses of a state by every measure of the scene.
#[derive(Default)]
pub struct Stresses<const D: usize> {
    /// First Piola–Kirchhoff stress, Pa.
    pub piola: StressFields<D>,
    /// Cauchy stress, Pa.
    pub cauchy: StressFields<D>,
}

/// State of a body, with derived fields computed at most once.
pub struct Moment<'a, const D: usize> {
    /// Scene of the variant.
    pub scene: &'a Scene,
    /// Physics of the variant.
    pub physics: &'a Physics<D>,
    /// Intact bonds.
    pub bonds: &'a dyn Bonds<D>,
    /// Displacement and history.
    pub state: &'a State<D>,
    card: Option<&'a Card>,
    label: Option<&'a str>,
    phases: &'a RefCell<Phases>,
    stresses: OnceCell<Stresses<D>>,
    fragments: OnceCell<Vec<Fragment>>,
    tractions: OnceCell<Vec<SurfaceTraction<D>>>,
}

impl<'a, const D: usize> Moment<'a, D> {
    /// Wraps a state; `phases` records the time of stresses.
    pub fn new(
        (scene, physics): (&'a Scene, &'a Physics<D>),
        bonds: &'a dyn Bonds<D>,
        state: &'a State<D>,
        phases: &'a RefCell<Phases>,
    ) -> Self {
        let (stresses, fragments, tractions) = (OnceCell::new(), OnceCell::new(), OnceCell::new());
        Self { scene, physics, bonds, state, card: None, label: None, phases, stresses, fragments, tractions }
    }

    /// Computes stresses on a graphics card, if there is one.
    pub fn with_card(self, card: Option<&'a Card>) -> Self {
        Self { card, ..self }
    }

    /// Gives the moment the name of a state.
    pub fn named(self, name: &'a str) -> Self {
        Self { label: Some(name), ..self }
    }

    /// Returns the end of the names of its pictures: the variant, and the state if it has a name.
    pub fn file_name(&self) -> String {
        let name = &self.physics.name;
        self.label.map_or_else(|| name.clone(), |label| format!("{name}_{label}"))
    }

    /// Returns a title, with the name of the state.
    pub fn titled(&self, title: &str) -> String {
        self.label.map_or_else(|| title.to_owned(), |label| format!("{title}, {label}"))
    }

    /// Iterates over a number of every row of the history.
    pub fn each(&self, get: fn(&StepRecord) -> f64) -> impl Iterator<Item = f64> {
        self.state.history.iter().map(get)
    }

    /// Iterates over the sites of the particles.
    pub fn sites(&self) -> impl Iterator<Item = usize> + Clone {
        self.bonds.particles().iter().map(|&site| site as usize)
    }

    /// Returns the pieces of the body, the largest first; none if bonds cannot break.
    pub fn fragments(&self) -> &[Fragment] {
        let breaks = self.physics.body.criterion.is_some();
        self.fragments.get_or_init(|| if breaks { fragments(self.bonds) } else { Vec::new() })
    }

    /// Returns the tractions of contact; none without `output.contact`.
    pub fn tractions(&self) -> &[SurfaceTraction<D>] {
        self.tractions.get_or_init(|| self.physics.tractions(self.scene, self.bonds, self.state))
    }

    /// Returns the damage of each particle: broken bonds over the bonds of the body without cracks, so that
    /// cracks of the scene count as damage. `None` without cracks and breaking bonds.
    pub fn damage(&self) -> Option<Vec<f64>> {
        let [whole, _] = self.physics.whole.as_ref()?;
        let part = |(&whole, site): (&u32, usize)| match whole {
            0 => 0.0,
            _ => 1.0 - f64::from(self.bonds.bonded(site)) / f64::from(whole),
        };
        Some(whole.iter().zip(self.sites()).map(part).collect())
    }

    /// Returns the sum of the damage by cracks of the scene.
    pub fn damage_of_cracks(&self) -> f64 {
        let part = |(&whole, &cracked): (&u32, &u32)| match whole {
            0 => 0.0,
            _ => 1.0 - f64::from(whole - cracked) / f64::from(whole),
        };
        self.physics.whole.as_ref().map_or(0.0, |[whole, cracked]| whole.iter().zip(cracked).map(part).sum())
    }

    /// Returns the stresses; the recorded time of a measure is its time alone ([`MeasuredStress::seconds`]).
    ///
    /// # Errors
    /// As [`crate::material::BondMaterial::fits`].
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
        let fits = material.fits(stretches, self.scene.fit_bound())?;
        let gradients =
            phases.time("deformation gradient", || deformation_gradients(bonds, &state.displacement));
        let (modulus, missing) = (material.modulus(), SurfaceCompensation::WindowAt(&self.physics.by_window));
        let fit = BondFits::new(&fits, material.shares(), bonds.sites())?;
        let loaded = StressInput { displacement: &state.displacement, fit, modulus, missing };
        let on_card = self.card.and_then(|card| card::piolas(card, bonds, &loaded, spec));
        let measured = on_card.unwrap_or_else(|| stress::piolas(bonds, &loaded, &spec.measures, spec.ball));
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

/// Observers of a scene, in the order of their output.
pub type SceneObservers<'s, const D: usize> = Vec<Box<dyn for<'m> Observer<Moment<'m, D>, Error> + 's>>;

/// Observer without state and files, from functions for scalars, fields and warnings.
#[derive(Clone, Copy)]
pub(super) struct StatelessObserver<'s, const D: usize> {
    pub scene: &'s Scene,
    pub scalars: for<'t, 'm> fn(&Scene, &mut Scalars<'t, Moment<'m, D>>),
    pub fields: for<'t, 'm> fn(&Scene, &mut Fields<'t, Moment<'m, D>>),
    pub warnings: for<'m> fn(&Moment<'m, D>) -> Vec<String>,
}

impl<'s, const D: usize> StatelessObserver<'s, D> {
    pub fn empty(scene: &'s Scene) -> Self {
        Self { scene, scalars: |_, _| {}, fields: |_, _| {}, warnings: |_| Vec::new() }
    }
}

impl<'m, const D: usize> Observer<Moment<'m, D>, Error> for StatelessObserver<'_, D> {
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
