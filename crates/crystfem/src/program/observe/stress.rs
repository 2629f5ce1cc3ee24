//! Stress and warpage.

use super::warpage_picture;
use crate::coupling::StressCoupling;
use crate::error::Error;
use crate::program::quantities as q;
use crate::program::scene::{Mechanics, PartScene, PartTask};
use crate::simulation::Simulation;
use harness::observe::{Fields, Observer, Outputs, Place, Scalars};

/// Observer that couples the stress to the temperatures; the coupling is allocated at the first step.
pub struct StressObserver<'a> {
    scene: &'a PartScene,
    task: &'a PartTask,
    mechanics: &'a Mechanics,
    coupling: Option<StressCoupling<'a>>,
}

impl<'a> StressObserver<'a> {
    /// Creates the observer.
    pub fn new(scene: &'a PartScene, task: &'a PartTask, mechanics: &'a Mechanics) -> Self {
        Self { scene, task, mechanics, coupling: None }
    }

    fn coupling(&mut self) -> Result<&mut StressCoupling<'a>, Error> {
        let coupling = match self.coupling.take() {
            Some(coupling) => coupling,
            None => StressCoupling::new(&self.task.problem.mesh, self.mechanics.settings.clone())?,
        };
        Ok(self.coupling.insert(coupling))
    }

    /// Returns a value of the coupling; NaN before the first step.
    fn value(&self, value: impl Fn(&StressCoupling<'a>) -> f64) -> f64 {
        self.coupling.as_ref().map_or(f64::NAN, value)
    }
}

impl<'a> Observer<Simulation, Error> for StressObserver<'a> {
    fn scalars(&self, to: &mut Scalars<Simulation>) {
        to.add(q::WARPAGE, |_| self.value(StressCoupling::warpage));
        to.add(q::MISES_ON_BED, |_| self.value(StressCoupling::mises_on_bed));
        to.add(q::MISES, |_| self.value(StressCoupling::largest_mises));
        if self.mechanics.settings.release_at.is_some() {
            let at = |k: usize| self.value(|stress| stress.at_release().map_or(f64::NAN, |found| found[k]));
            to.add(q::WARPAGE_AT_RELEASE, move |_| at(0));
            to.add(q::MISES_AT_RELEASE, move |_| at(1));
        }
        let strength = self.mechanics.settings.law.strength;
        if strength.is_finite() {
            let most = |stress: &StressCoupling<'a>| stress.mises_on_bed().max(stress.largest_mises());
            to.add(q::MISES_OVER_STRENGTH, |_| self.value(most) / strength);
        }
        to.add(q::LARGEST_ROTATION, |_| self.value(StressCoupling::largest_rotation));
        to.add(q::STRESS_WORK, |_| self.value(|stress| stress.energy_balance().energies.work));
        to.add(q::STRESS_STORED, |_| self.value(|stress| stress.energy_balance().energies.stored));
        to.add(q::STRESS_LOST, |_| self.value(|stress| stress.energy_balance().energies.lost()));
        to.add(q::STRESS_HARDENING, |_| self.value(|stress| stress.energy_balance().energies.softening));
        to.add(q::WORST_STRESS_BALANCE, |_| self.value(|stress| stress.energy_balance().worst));
        to.add(q::LARGEST_DISPLACEMENT, |_| self.value(StressCoupling::largest_displacement));
        let moved = self.coupling.as_ref().map(StressCoupling::displacement);
        for (probe, place) in self.scene.probe.iter().zip(&self.task.probes) {
            for (d, axis) in ["x", "y", "z"].into_iter().enumerate() {
                to.add_if(q::DISPLACEMENT.named(&[&probe.name, axis]), |_| {
                    let at = |node: u32| Some(moved.as_ref()?[3 * node as usize + d]).filter(|x| !x.is_nan());
                    place.value(at)
                });
            }
        }
    }

    fn fields(&self, to: &mut Fields<Simulation>) {
        let field = |values: fn(&StressCoupling<'a>) -> Vec<f64>| {
            move |_: &Simulation| self.coupling.as_ref().map(values).unwrap_or_default()
        };
        to.add("displacement_m", 3, Place::Points, field(StressCoupling::displacement));
        to.add("mises_Pa", 1, Place::Cells, field(StressCoupling::mises));
        to.add("residual_stress_Pa", 6, Place::Cells, field(StressCoupling::stresses));
    }

    fn see(&mut self, simulation: &Simulation) -> Result<(), Error> {
        self.coupling()?.after_step(simulation)
    }

    fn end(&mut self, simulation: &Simulation) -> Result<(), Error> {
        self.coupling()?.finish(simulation)
    }

    fn work(&self, _: &Simulation) -> Vec<(&'static str, u64)> {
        let [solutions, iterations] = self.coupling.as_ref().map(StressCoupling::work).unwrap_or_default();
        vec![("stress_steps", solutions), ("stress_iterations", iterations)]
    }

    fn draw(&self, _: &Simulation, to: &Outputs) -> Result<(), Error> {
        let drawn = self
            .coupling
            .as_ref()
            .map(|stress| warpage_picture::draw(self.scene, self.task, stress, to.folder));
        drawn.unwrap_or(Ok(()))
    }

    fn save(&self) -> Vec<u8> {
        self.coupling.as_ref().map(|stress| harness::observe::encode(&stress.save())).unwrap_or_default()
    }

    fn restore(&mut self, saved: &[u8]) -> Result<(), Error> {
        self.coupling()?.restore(harness::observe::decode(saved)?);
        Ok(())
    }
}
