//! Temperature, material fields and energies.

use super::celsius::{CELSIUS, TEMPERATURE, to_celsius};
use super::or_nan;
use crate::error::Error;
use crate::program::quantities as q;
use crate::program::scene::PartTask;
use crate::simulation::{Simulation, Statistics};
use harness::observe::{Fields, Observer, Place, Scalars};
use harness::report::Quantity;

/// Observer of the heat problem: fields, statistics by layer, and energy balance.
pub struct ThermalObserver<'a> {
    task: &'a PartTask,
    /// Names: the temperature, °C, and the material fields.
    names: Vec<&'static str>,
    /// Statistics of the whole part and of each layer, name by name; `None` for nonexistent layers.
    statistics: Vec<Option<Statistics>>,
}

impl<'a> ThermalObserver<'a> {
    /// Creates the observer.
    pub fn new(task: &'a PartTask) -> Self {
        let names = std::iter::once("temperature").chain(task.problem.field_names()).collect();
        Self { task, names, statistics: Vec::new() }
    }

    /// Returns prefix and elements of the whole part and of each layer.
    fn pieces(&self) -> impl Iterator<Item = (String, &Vec<u32>)> {
        let layers = (1..).zip(&self.task.layers).map(|(k, elements)| (format!("layer-{k}."), elements));
        std::iter::once((String::new(), &self.task.printed)).chain(layers)
    }

    /// Computes the volume of the existing elements, m³, each scaled by its filled fraction.
    fn printed_volume(&self, simulation: &Simulation) -> f64 {
        let mesh = &self.task.problem.mesh;
        let parts = self.task.filling.as_ref().and_then(|filling| filling.parts.as_ref());
        let fraction = |element: u32| parts.map_or(1.0, |(values, index)| values[index[element as usize]]);
        let born = (0..mesh.element_count() as u32).filter(|&element| simulation.is_born(element));
        born.map(|element| fraction(element) * mesh.volume(element)).sum()
    }
}

impl Observer<Simulation, Error> for ThermalObserver<'_> {
    fn scalars(&self, to: &mut Scalars<Simulation>) {
        to.add(q::STORED_ENERGY, |s| s.state().ledger.stored);
        to.add(q::EXCHANGED_ENERGY, |s| s.state().ledger.exchange.total());
        to.add(q::REACTION_ENERGY, |s| s.state().ledger.reaction);
        to.add(q::BIRTH_ENERGY, |s| s.state().ledger.birth);
        to.add(q::HEAT_GIVEN_OFF, |s| -(s.state().ledger.exchange.total() + s.state().ledger.reaction));
        to.add(q::MISSING_ENERGY, |s| s.state().ledger.missing);
        to.add(q::WORST_BALANCE, |s| s.state().ledger.worst);
        if let Some(filling) = &self.task.filling {
            to.add(q::PRINTED_VOLUME, |s| self.printed_volume(s));
            to.add(q::CELLS_OVER_BODY, |_| filling.ratio);
            if let Some((path, _)) = &filling.path {
                to.add(q::PATH_TIME, |_| path.duration());
                to.add(q::FILAMENT, |_| path.fed());
            }
        }
        let columns =
            self.pieces().flat_map(|(prefix, _)| self.names.iter().map(move |name| (prefix.clone(), *name)));
        for (column, (prefix, name)) in columns.enumerate() {
            let statistics = self.statistics.get(column).copied().flatten();
            let [unit, spread] = if name == "temperature" { ["degC", "K"] } else { [""; 2] };
            let column = |quantity: Quantity, unit: &str| quantity.named(&[&prefix, name]).in_unit(unit);
            to.add_if(column(q::MEAN, unit), |_| Some(statistics?.mean));
            to.add_if(column(q::LEAST, unit), |_| Some(statistics?.least));
            to.add_if(column(q::LARGEST, unit), |_| Some(statistics?.largest));
            to.add_if(column(q::DEVIATION, spread), |_| Some(statistics?.deviation));
        }
    }

    fn fields(&self, to: &mut Fields<Simulation>) {
        to.add(TEMPERATURE, 1, Place::Points, |s| to_celsius(&s.temperatures(f64::NAN)));
        for name in &self.names[1..] {
            to.add(*name, 1, Place::Points, |s| or_nan(s.field(name)));
        }
        to.add("exists", 1, Place::Cells, |s| {
            let elements = 0..s.problem().mesh.element_count() as u32;
            elements.map(|element| f64::from(u8::from(s.is_born(element)))).collect()
        });
    }

    fn end(&mut self, simulation: &Simulation) -> Result<(), Error> {
        let nodes = 0..self.task.problem.mesh.points.len() as u32;
        let celsius = |node| simulation.temperature(node).map(|kelvin| kelvin - CELSIUS);
        let mut values = vec![nodes.map(celsius).collect::<Vec<_>>()];
        values.extend(self.names[1..].iter().map(|name| simulation.field(name)));
        let statistics = |(_, elements): (String, &Vec<u32>)| {
            let volumes = simulation.volumes(elements);
            values.iter().map(|values| Statistics::new(values, &volumes)).collect::<Vec<_>>()
        };
        self.statistics = self.pieces().flat_map(statistics).collect();
        Ok(())
    }

    fn work(&self, simulation: &Simulation) -> Vec<(&'static str, u64)> {
        let (state, mesh) = (simulation.state(), &self.task.problem.mesh);
        let work = state.work;
        vec![
            ("nodes", mesh.points.len() as u64),
            ("elements", mesh.element_count() as u64),
            ("equations", state.temperature.len() as u64),
            ("steps", work.steps),
            ("rejected", work.rejected),
            ("newton_iterations", work.newton_iterations),
            ("cg_iterations", work.cg_iterations),
            ("factorizations", work.factorizations),
            ("direct_solves", work.direct_solves),
            ("material_responses", work.responses),
            ("builds", work.builds),
        ]
    }
}
