//! Studies of a scene: what each changes, and the scene that comes out.

use super::{PartScene, check_name};
use harness::scene::{SceneError, Source};
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;

/// A variant of the scene. A block that it names replaces the scene's whole; `set` changes single keys.
///
/// ```toml
/// [[study]]
/// name = "coupled"
/// set = { "materials.pa12.latent_heat" = "209 J/g" }
/// ```
#[derive(Clone, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudySpec {
    /// Its name: values are `NAME.mean_alpha` and so on, files lie in a folder of this name.
    pub name: String,
    /// Expected behaviour, for the table of a suite.
    pub description: Option<String>,
    /// It must end with an error that contains this.
    pub expect_error: Option<String>,
    /// Part of `--quick` runs; default yes.
    pub quick: Option<bool>,
    /// Values by their paths (`"print.layer_time"`, `"boundary[1].film"`), merged into the scene.
    #[schemars(with = "Option<BTreeMap<String, serde_json::Value>>")]
    pub set: Option<BTreeMap<String, IgnoredAny>>,
    /// Instead of the scene's.
    #[schemars(with = "Option<super::MeshSpec>")]
    pub mesh: Option<IgnoredAny>,
    /// Instead of the scene's.
    #[schemars(with = "Option<BTreeMap<String, super::MaterialSpec>>")]
    pub materials: Option<IgnoredAny>,
    /// Instead of the scene's.
    #[schemars(with = "Option<Vec<super::RegionSpec>>")]
    pub region: Option<IgnoredAny>,
    /// Instead of the scene's.
    #[schemars(with = "Option<super::PrintSpec>")]
    pub print: Option<IgnoredAny>,
    /// Instead of the scene's.
    #[schemars(with = "Option<Vec<super::BoundarySpec>>")]
    pub boundary: Option<IgnoredAny>,
    /// Instead of the scene's.
    #[schemars(with = "Option<Vec<super::SourceSpec>>")]
    pub source: Option<IgnoredAny>,
    /// Instead of the scene's.
    #[schemars(with = "Option<super::TimeSpec>")]
    pub time: Option<IgnoredAny>,
    /// Instead of the scene's.
    #[schemars(with = "Option<Vec<super::ProbeSpec>>")]
    pub probe: Option<IgnoredAny>,
    /// Instead of the scene's.
    #[schemars(with = "Option<super::PartOutput>")]
    pub output: Option<IgnoredAny>,
}

impl StudySpec {
    fn blocks(&self) -> impl Iterator<Item = &'static str> {
        let blocks = [
            ("mesh", self.mesh),
            ("materials", self.materials),
            ("region", self.region),
            ("print", self.print),
            ("boundary", self.boundary),
            ("source", self.source),
            ("time", self.time),
            ("probe", self.probe),
            ("output", self.output),
        ];
        blocks.into_iter().filter_map(|(name, given)| given.map(|_| name))
    }
}

impl PartScene {
    /// The studies of a run, by their places in `study`; `quick` leaves out those marked so.
    ///
    /// # Errors
    /// Names that name no folder or two studies, a quick run of nothing, and those of
    /// [`Self::check_convergence`] and [`Self::check_curves`].
    pub fn studies(&self, source: &Source, quick: bool) -> Result<Vec<usize>, SceneError> {
        for (index, study) in self.study.iter().enumerate() {
            let key = format!("study[{index}].name");
            check_name(source, &key, &study.name)?;
            // folders of some systems do not tell `A` from `a`
            if self.study[..index].iter().any(|other| other.name.eq_ignore_ascii_case(&study.name)) {
                return Err(source.error(&key, format!("`{}` twice", study.name), "different names"));
            }
        }
        self.check_convergence(source)?;
        self.check_curves(source)?;
        let asked: Vec<usize> =
            (0..self.study.len()).filter(|&index| !quick || self.study[index].quick != Some(false)).collect();
        if asked.is_empty() && !self.study.is_empty() {
            let allowed = "at least one without `quick = false`";
            return Err(source.error("study", "no study left in a --quick run", allowed));
        }
        Ok(asked)
    }

    /// The scene of a study, and the source whose errors point at what it changes.
    ///
    /// # Errors
    /// As [`Source::parse`] and [`PartScene::check`].
    pub fn of_study(&self, source: &Source, index: usize) -> Result<(Source, Self), SceneError> {
        let study = &self.study[index];
        // of what concerns a key the first holds: a single key before its block
        let mut source = source.clone();
        if study.set.is_some() {
            source = source.with_merged(&format!("study[{index}].set"));
        }
        for block in study.blocks() {
            source = source.with_replaced(block, &format!("study[{index}].{block}"));
        }
        let scene: Self = source.parse()?;
        scene.check(&source)?;
        Ok((source, scene))
    }
}
