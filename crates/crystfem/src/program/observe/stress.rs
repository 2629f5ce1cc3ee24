//! Stress and warpage.

use super::warpage_picture;
use crate::coupling::StressCoupling;
use crate::coupling::compensation::{LayerScale, axial_scales, layer_scales, opposite, residual};
use crate::error::Error;
use crate::mesh::abaqus;
use crate::program::quantities as q;
use crate::program::scene::{Mechanics, PartScene, PartTask};
use crate::simulation::Simulation;
use harness::observe::{Fields, Observer, Outputs, Place, Scalars};
use harness::output::csv;
use polycore::file::atomic_write;

/// Observer that couples the stress to the temperatures; the coupling is allocated at the first step.
pub struct StressObserver<'a> {
    scene: &'a PartScene,
    task: &'a PartTask,
    mechanics: &'a Mechanics,
    coupling: Option<StressCoupling<'a>>,
    /// Residual of the compensation.
    residual: f64,
}

impl<'a> StressObserver<'a> {
    /// Creates the observer.
    pub fn new(scene: &'a PartScene, task: &'a PartTask, mechanics: &'a Mechanics) -> Self {
        Self { scene, task, mechanics, coupling: None, residual: f64::NAN }
    }

    fn coupling(&mut self) -> Result<&mut StressCoupling<'a>, Error> {
        let coupling = match self.coupling.take() {
            Some(coupling) => coupling,
            None => StressCoupling::new(&self.task.problem.mesh, self.mechanics.settings.clone())?,
        };
        Ok(self.coupling.insert(coupling))
    }

    /// Writes the mesh with the opposite displacement, in metres, and the scale of each layer; a part without
    /// layers is one.
    fn write_compensation(&self, displacement: &[f64], to: &Outputs) -> Result<(), Error> {
        let mesh = &self.task.problem.mesh;
        let compensated = opposite(mesh, displacement);
        atomic_write(to.folder.join("compensated.inp"), |file| abaqus::write(&compensated, true, file))?;
        let whole = [(0..mesh.element_count() as u32).collect()];
        let layers = if self.task.layers.is_empty() { &whole[..] } else { &self.task.layers };
        let scales = match self.mechanics.settings.rollers.is_empty() {
            true => layer_scales(mesh, layers, displacement),
            // the axis of a sector stays
            false => axial_scales(mesh, layers, displacement),
        };
        let column = |of: &dyn Fn(&LayerScale) -> f64| scales.iter().map(of).collect::<Vec<f64>>();
        let layer: Vec<f64> = (1..=scales.len()).map(|layer| layer as f64).collect();
        let (height, x, y) = (column(&|s| s.height), column(&|s| s.factors[0]), column(&|s| s.factors[1]));
        let (shift_x, shift_y) = (column(&|s| s.shift[0]), column(&|s| s.shift[1]));
        let columns: [csv::Column; 6] = [
            ("layer", "", &layer),
            ("z", "m", &height),
            ("scale_x", "", &x),
            ("scale_y", "", &y),
            ("shift_x", "m", &shift_x),
            ("shift_y", "m", &shift_y),
        ];
        Ok(csv::write(to.folder.join("compensation.csv"), &columns)?)
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
        if self.mechanics.compensation {
            to.add(q::COMPENSATION_RESIDUAL, |_| self.residual);
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
        self.coupling()?.finish(simulation)?;
        if let (true, Some(stress)) = (self.mechanics.compensation, &self.coupling) {
            let PartTask { problem, settings, end, .. } = self.task;
            let law = self.mechanics.settings.clone();
            self.residual = residual(problem, *settings, law, *end, &stress.displacement())?;
        }
        Ok(())
    }

    fn write(&self, _: &Simulation, to: &Outputs) -> Result<(), Error> {
        match (self.mechanics.compensation, &self.coupling) {
            (true, Some(stress)) => self.write_compensation(&stress.displacement(), to),
            _ => Ok(()),
        }
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
