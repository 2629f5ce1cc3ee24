//! Scenes, as written in TOML. Only what a scene names is built.

mod convergence;
mod curve;
mod either;
mod expect;
mod fault;
mod file;
mod fit;
mod fit_part;
mod fit_spec;
mod healing;
mod heat_flow;
mod material;
mod mechanics;
mod memory;
mod mesh;
mod part;
mod places;
mod point;
mod powder;
mod print;
mod problem;
mod schedule;
mod setting;
mod study;
mod voxels;

pub use convergence::ConvergenceSpec;
pub use curve::CurveSpec;
pub use fit::{FitScene, Job};
pub use fit_part::PartFit;
pub use fit_spec::{DataSpec, Direction, FitLaw, FitSpec, HeatFlowSpec, Limit};
pub use healing::HealingSpec;
pub use material::{KineticsSpec, Law, MaterialSpec, MeltingSpec, PropertySpec, SignSpec};
pub use mechanics::{Mechanics, MechanicsLaw, MechanicsSpec};
pub use mesh::{BarSpec, BrickSpec, MeshSpec, SubstrateSpec, TubeSpec};
pub use part::{BoundarySpec, PartOutput, PartScene, PrintSpec, ProbeSpec, RegionSpec, SourceSpec, TimeSpec};
pub(crate) use places::millimetres;
pub use point::{CompareSpec, ExchangeSpec, LegSpec, NodesSpec, PointScene, PointSpec};
pub use problem::Task;
pub use schedule::{ScheduleSpec, TimesSpec};
pub use study::StudySpec;
pub use voxels::{BuiltMesh, Filling, PathSpec, StlSpec};

pub(crate) use harness::scene::check_name;

use harness::scene::{SceneError, Source};
use serde::Deserialize;
use serde::de::IgnoredAny;

/// The only program that runs these scenes.
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Program {
    /// This crate.
    Crystfem,
}

/// Files to write beside the report.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputSpec {
    /// Pictures (PNG).
    pub pictures: bool,
}

impl Default for OutputSpec {
    fn default() -> Self {
        Self { pictures: true }
    }
}

/// The task of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The material alone: `[[point]]`, `[[nodes]]`.
    Point,
    /// A body in time: `[mesh]`.
    Part,
    /// Constants from measurements: `[[fit]]`.
    Fit,
}

/// The JSON Schema of scenes.
pub fn schema() -> serde_json::Value {
    harness::scene::schema("crystfem", crate::program::quantities::ALL, |generator| {
        vec![
            generator.subschema_for::<PartScene>(),
            generator.subschema_for::<PointScene>(),
            generator.subschema_for::<FitScene>(),
        ]
    })
}

/// Determines the task of a scene from its blocks.
///
/// # Errors
/// What is no scene at all, another program, and a scene without any such block.
pub fn kind(source: &Source) -> Result<Kind, SceneError> {
    /// What tells kinds apart; the rest is read later.
    #[derive(Deserialize)]
    struct Outline {
        #[serde(rename = "program")]
        _program: Program,
        point: Option<IgnoredAny>,
        nodes: Option<IgnoredAny>,
        fit: Option<IgnoredAny>,
        mesh: Option<IgnoredAny>,
    }
    let outline: Outline = source.parse()?;
    let tasks = [
        (Kind::Point, "point", outline.point.is_some() || outline.nodes.is_some()),
        (Kind::Fit, "fit", outline.fit.is_some()),
        (Kind::Part, "mesh", outline.mesh.is_some()),
    ];
    let mut asked = tasks.iter().filter(|(_, _, given)| *given);
    match (asked.next(), asked.next()) {
        (Some((kind, ..)), None) => Ok(*kind),
        (Some((_, first, _)), Some((_, second, _))) => {
            let found = format!("`{second}` together with `{first}`");
            Err(source.error(second, found, "one of them: a scene does one thing"))
        }
        (None, _) => {
            let allowed = "a block `[[point]]`, `[[nodes]]`, `[[fit]]` or `[mesh]`";
            Err(source.error("program", "a scene without a task", allowed))
        }
    }
}

#[cfg(test)]
mod tests;
