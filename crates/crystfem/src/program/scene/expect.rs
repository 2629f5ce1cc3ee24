//! What the expectations of a part may ask for: the names of the scalars that its report can have.

use super::{PartScene, Task};
use crate::program::quantities as q;
use harness::report::{Named, Quantity};
use harness::scene::{SceneError, Source};

impl PartScene {
    /// All scalars that the run of a task can report.
    pub fn quantities(&self, task: &Task) -> Vec<Named> {
        let mut fields: Vec<&str> =
            task.problem.materials.iter().flat_map(|material| material.field_names()).copied().collect();
        fields.sort_unstable();
        fields.dedup();
        let energies = [
            q::STORED_ENERGY,
            q::EXCHANGED_ENERGY,
            q::REACTION_ENERGY,
            q::BIRTH_ENERGY,
            q::HEAT_GIVEN_OFF,
            q::MISSING_ENERGY,
            q::WORST_BALANCE,
        ];
        let mut all: Vec<Named> = energies.map(Named::from).to_vec();
        if let Some(filling) = &task.filling {
            all.extend([q::PRINTED_VOLUME, q::CELLS_OVER_BODY].map(Named::from));
            if filling.path.is_some() {
                all.extend([q::PATH_TIME, q::FILAMENT].map(Named::from));
            }
        }
        if let Some(mechanics) = &task.mechanics {
            let stresses = [
                q::WARPAGE,
                q::LARGEST_DISPLACEMENT,
                q::MISES_ON_BED,
                q::MISES,
                q::LARGEST_ROTATION,
                q::STRESS_WORK,
                q::STRESS_STORED,
                q::STRESS_LOST,
                q::STRESS_HARDENING,
                q::WORST_STRESS_BALANCE,
            ];
            all.extend(stresses.map(Named::from));
            all.extend(mechanics.law.strength.is_finite().then(|| q::MISES_OVER_STRENGTH.into()));
        }
        if let Some(interfaces) = &task.interfaces {
            all.extend([q::LEAST_HEALING, q::MEAN_HEALING].map(Named::from));
            let strengths = [q::LEAST_INTERLAYER_STRENGTH, q::MEAN_INTERLAYER_STRENGTH];
            all.extend(interfaces.strength.iter().flat_map(|_| strengths.map(Named::from)));
        }
        let unit = |field: &str| if field == "temperature" { "degC" } else { "" };
        let with_temperature = || std::iter::once("temperature").chain(fields.iter().copied());
        let layers = (1..=task.layers.len()).map(|layer| format!("layer-{layer}."));
        for layer in std::iter::once(String::new()).chain(layers) {
            for field in with_temperature() {
                let of = |quantity: Quantity| quantity.of(&[&layer, field]).in_unit(unit(field));
                all.extend([q::MEAN, q::LEAST, q::LARGEST].map(of));
                let spread = if field == "temperature" { "K" } else { "" };
                all.push(of(q::DEVIATION).in_unit(spread));
            }
        }
        for probe in &self.probe {
            let name = probe.name.as_str();
            let own = [q::DISTANCE, q::LOWEST_TEMPERATURE, q::HIGHEST_TEMPERATURE];
            all.extend(own.map(|quantity| quantity.of(&[name])));
            all.extend(with_temperature().map(|field| q::AT_PROBE.of(&[name, field]).in_unit(unit(field))));
            if task.mechanics.is_some() {
                all.extend(["x", "y", "z"].map(|axis| q::DISPLACEMENT.of(&[name, axis])));
            }
            for birth in (2..=task.layers.len()).map(|birth| birth.to_string()) {
                all.push(q::JUMP.of(&[name, &birth]));
                for field in &fields {
                    all.extend(
                        [q::AT_BIRTH, q::LOST_AT_BIRTH].map(|quantity| quantity.of(&[name, field, &birth])),
                    );
                }
            }
        }
        all
    }

    /// Refuses an expectation of a quantity that no run of the scene reports; those of studies that are left out of it,
    /// `absent`, are passed over.
    ///
    /// # Errors
    /// The quantity, and names like it.
    pub fn check_expectations(
        &self,
        source: &Source,
        names: &[Named],
        absent: &[&str],
    ) -> Result<(), SceneError> {
        let known: Vec<&str> = names.iter().map(|known| known.name.as_str()).collect();
        harness::case::check_quantities(source, &self.expect, &known, |quantity| {
            absent.iter().any(|study| super::NAMING.is_of(study, quantity))
        })
    }
}
