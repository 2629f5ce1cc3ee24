//! Studies of a scene: what each changes, and the scene that comes out.

use super::PartScene;
use harness::report::Named;
use harness::scene::{SceneError, Source};
use harness::study::{Comparisons, Naming, Study, Variant, variants};

harness::study! {
    /// A variant of the scene. A block that it names replaces the scene's whole; `set` changes single keys.
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

/// Values of a study are `NAME.mean_alpha` and so on, its files lie in a folder of its name.
pub const NAMING: Naming = Naming::Folders;

impl PartScene {
    /// The studies of a run; `quick` leaves out those marked so.
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

    /// What compares the studies.
    pub fn comparisons(&self) -> Comparisons<'_> {
        Comparisons { convergence: &self.convergence, curves: &self.error_against_time }
    }

    /// The scene of a variant.
    ///
    /// # Errors
    /// As [`Source::parse`] and [`PartScene::check`].
    pub fn of_variant(variant: &Variant) -> Result<Self, SceneError> {
        let scene: Self = variant.source.parse()?;
        scene.check(&variant.source)?;
        Ok(scene)
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
            absent.iter().any(|study| NAMING.is_of(study, quantity))
        })
    }
}
