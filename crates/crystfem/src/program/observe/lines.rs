//! Temperature and fields along lines through the mesh at the end of a run.

use super::celsius::CELSIUS;
use crate::error::Error;
use crate::mesh::LocatedPoint;
use crate::program::scene::{PartScene, PartTask};
use crate::simulation::Simulation;
use harness::observe::{Observer, Outputs};

/// Observer that writes the fields along the lines of a scene.
pub struct LineObserver<'a> {
    /// Scene of the run.
    pub scene: &'a PartScene,
    /// Locations of the line points in the mesh.
    pub task: &'a PartTask,
}

impl Observer<Simulation, Error> for LineObserver<'_> {
    /// Writes `line_NAME.csv` for each line: values interpolated in the element of each point, NaN outside
    /// the existing elements.
    fn write(&self, simulation: &Simulation, to: &Outputs) -> Result<(), Error> {
        let names = simulation.field_names();
        for (line, places) in self.scene.output.line.iter().zip(&self.task.lines) {
            let exists =
                |place: &&LocatedPoint| place.elements().iter().any(|&element| simulation.is_born(element));
            let along = |value: &dyn Fn(u32) -> Option<f64>| -> Vec<f64> {
                let there = places.iter().map(|place| place.as_ref().filter(exists));
                there.map(|place| place.and_then(|place| place.value(value)).unwrap_or(f64::NAN)).collect()
            };
            let mut columns = Vec::new();
            if line.wants("temperature", true) {
                let celsius = |node: u32| simulation.temperature(node).map(|kelvin| kelvin - CELSIUS);
                columns.push(("temperature".to_owned(), "degC", along(&celsius)));
            }
            for name in names.iter().filter(|name| line.wants(name, true)) {
                let field = simulation.field(name);
                columns.push((
                    (*name).to_owned(),
                    "",
                    along(&|node| field.get(node as usize).copied().flatten()),
                ));
            }
            line.write::<3>(&to.folder.join(format!("line_{}.csv", line.name)), &columns)?;
        }
        Ok(())
    }
}
