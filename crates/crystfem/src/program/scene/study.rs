//! Studies of a scene: their changes, and the resulting scenes.

use super::PartScene;
use harness::report::Named;
use harness::scene::{SceneError, Source};
use harness::study::{Comparisons, Naming, Study, Variant, variants};

harness::study! {
    /// Variant of the scene. Its blocks replace those of the scene as a whole; `set` changes single keys.
    ///
    /// ```toml
    /// [[study]]
    /// name = "coupled"
    /// set = { "materials.pa12.latent_heat" = "209 J/g" }
    /// ```
    pub struct StudySpec;
    replaces {
        mesh: super::MeshSpec = "mesh",
        materials: std::collections::BTreeMap<String, super::MaterialSpec> = "materials",
        region: Vec<super::RegionSpec> = "region",
        print: super::PrintSpec = "print",
        boundary: Vec<super::BoundarySpec> = "boundary",
        source: Vec<super::SourceSpec> = "source",
        time: super::TimeSpec = "time",
        probe: Vec<super::ProbeSpec> = "probe",
        output: super::PartOutput = "output",
    }
    lists {}
}

/// Naming of studies: values are `NAME.mean_alpha`, ..., files are in a folder NAME.
pub const NAMING: Naming = Naming::Folders;

impl PartScene {
    /// Returns the studies of a run; `quick` skips those marked `quick = false`.
    ///
    /// # Errors
    /// As [`variants`] and [`Comparisons::check`].
    pub fn variants(&self, source: &Source, quick: bool) -> Result<Vec<Variant>, SceneError> {
        let studies: Vec<Study> = self.study.iter().map(StudySpec::study).collect();
        let name = |_: &Source, name: Option<&str>| Ok(name.unwrap_or_default().to_owned());
        let all = variants(source, &studies, false, NAMING, name)?;
        let names: Vec<&str> = all.iter().map(|variant| variant.name.as_str()).collect();
        self.comparisons().check(source, &names)?;
        variants(source, &studies, quick, NAMING, name)
    }

    /// Returns the comparisons of the studies.
    pub fn comparisons(&self) -> Comparisons<'_> {
        Comparisons { convergence: &self.convergence, curves: &self.error_against_time }
    }

    /// Returns the scene of a variant.
    ///
    /// # Errors
    /// As [`Source::parse`] and [`PartScene::check`].
    pub fn from_variant(variant: &Variant) -> Result<Self, SceneError> {
        let scene: Self = variant.source.parse()?;
        scene.check(&variant.source)?;
        Ok(scene)
    }

    /// Refuses an expectation of a quantity that no run of the scene reports; expectations of skipped studies
    /// (`absent`) are ignored.
    ///
    /// # Errors
    /// Returns the quantity, with similar names.
    pub fn check_expectations(
        &self,
        source: &Source,
        names: &[Named],
        absent: &[&str],
    ) -> Result<(), SceneError> {
        let known: Vec<&str> = names.iter().map(|known| known.name.as_str()).collect();
        harness::case::check_quantities(source, &self.expect, &known, |quantity| {
            absent.iter().any(|study| NAMING.is_of(study, quantity))
        })
    }
}
