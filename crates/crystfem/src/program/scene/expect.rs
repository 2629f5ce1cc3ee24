//! What the expectations of a part may ask for: the names of the scalars that its report can have.

use super::PartScene;
use crate::program::quantities as q;
use harness::report::Named;
use harness::scene::{SceneError, Source};

impl PartScene {
    /// What studies which must fail add to those of the runs of the others, which have their study's name before them.
    pub fn quantities_of_studies(&self) -> Vec<Named> {
        let failing = self.study.iter().filter(|study| study.expect_error.is_some());
        failing.map(|study| q::FAILED_AS_EXPECTED.of(&[&study.name])).collect()
    }

    /// Refuses an expectation of a quantity that no run of the scene reports; those of studies that are left out of it,
    /// `absent`, and what compares studies are passed over.
    ///
    /// # Errors
    /// The quantity, and names like it.
    pub fn check_expectations(
        &self,
        source: &Source,
        names: &[Named],
        absent: &[&str],
    ) -> Result<(), SceneError> {
        let asked = || self.expect.iter().enumerate();
        for (index, quantity) in asked().flat_map(|(at, expect)| expect.names().map(move |name| (at, name))) {
            let first = quantity.split_once('.').map(|(first, _)| first);
            // what compares studies has names of its own
            let of_several =
                !self.study.is_empty() && !self.study.iter().any(|study| first == Some(study.name.as_str()));
            let left_out = first.is_some_and(|first| of_several || absent.contains(&first));
            if !left_out && !names.iter().any(|known| known.name == quantity) {
                let known: Vec<&str> = names.iter().map(|known| known.name.as_str()).collect();
                return Err(source.unknown(&format!("expect[{index}].quantity"), quantity, &known));
            }
        }
        Ok(())
    }
}
