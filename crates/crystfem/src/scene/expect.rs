//! What the expectations of a part may ask for: the names of the scalars that its report can have.

use super::{PartScene, Task};
use polycore::case::STATISTICS;
use polycore::scene::{SceneError, Source};

/// Energies and their balance, J.
const ENERGIES: [&str; 7] = [
    "stored_energy",
    "exchanged_energy",
    "reaction_energy",
    "birth_energy",
    "heat_given_off",
    "missing_energy",
    "worst_balance",
];

impl PartScene {
    /// Names of all scalars that the run of a task can report.
    pub fn quantities(&self, task: &Task) -> Vec<String> {
        let mut fields: Vec<&str> =
            task.problem.materials.iter().flat_map(|material| material.field_names()).copied().collect();
        fields.sort_unstable();
        fields.dedup();
        let mut names: Vec<String> = ENERGIES.map(str::to_owned).to_vec();
        let layers = (1..=task.layers.len()).map(|layer| format!("layer-{layer}."));
        for prefix in std::iter::once(String::new()).chain(layers) {
            for field in std::iter::once("temperature").chain(fields.iter().copied()) {
                names.extend(STATISTICS.map(|statistic| format!("{prefix}{statistic}{field}")));
            }
        }
        for probe in &self.probe {
            let mut add = |what: &str| names.push(format!("{}.{what}", probe.name));
            let own = ["distance", "temperature", "lowest_temperature", "highest_temperature"];
            own.into_iter().for_each(&mut add);
            fields.iter().for_each(|field| add(field));
            for birth in 2..=task.layers.len() {
                add(&format!("jump_at_birth_{birth}"));
                for field in &fields {
                    add(&format!("{field}_at_birth_{birth}"));
                    add(&format!("{field}_lost_at_birth_{birth}"));
                }
            }
        }
        names
    }

    /// Names that studies which must fail add to those of the runs of the others, which have their study's name before them.
    pub fn quantities_of_studies(&self) -> Vec<String> {
        let failing = self.study.iter().filter(|study| study.fails.is_some());
        failing.map(|study| format!("{}.failed_as_it_must", study.name)).collect()
    }

    /// Refuses an expectation of a quantity that no run of the scene reports; those of studies that are left out of it,
    /// `absent`, and what compares studies are passed over.
    ///
    /// # Errors
    /// The quantity, and names like it.
    pub fn check_expectations(
        &self,
        source: &Source,
        names: &[String],
        absent: &[&str],
    ) -> Result<(), SceneError> {
        for (index, expect) in self.expect.iter().enumerate() {
            let quantity = expect.quantity.as_str();
            let first = quantity.split_once('.').map(|(first, _)| first);
            // what compares studies has names of its own
            let of_several =
                !self.study.is_empty() && !self.study.iter().any(|study| first == Some(study.name.as_str()));
            let left_out = first.is_some_and(|first| of_several || absent.contains(&first));
            if !left_out && !names.iter().any(|name| name == quantity) {
                let known: Vec<&str> = names.iter().map(String::as_str).collect();
                return Err(source.unknown(&format!("expect[{index}].quantity"), quantity, &known));
            }
        }
        Ok(())
    }
}
