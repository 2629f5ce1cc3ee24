//! TOML scenes of `crystfem`. Only what a scene names is built.

mod fit;
mod fit_part;
mod fit_spec;
mod gcode_file;
mod gcode_setting;
mod healing;
mod heat_flow;
mod locate_error;
mod material;
mod mechanics;
mod memory;
mod mesh;
mod part;
mod point;
mod polymer;
mod powder;
mod printing;
mod problem;
mod revolved;
mod schedule;
mod selection;
mod study;
mod text_or_table;
mod voxels;

pub use fit::{FitScene, Job};
pub use fit_part::PartFit;
pub use fit_spec::{DataSpec, Direction, FitLaw, FitSpec, HeatFlowSpec, Limit};
pub use healing::HealingSpec;
pub use material::{KineticsSpec, Law, MaterialSpec, MeltingSpec, PropertySpec, SignSpec};
pub use mechanics::{Mechanics, MechanicsLaw, MechanicsSpec};
pub use mesh::{BarSpec, BrickSpec, MeshSpec, SubstrateSpec, TubeSpec};
pub use part::{BoundarySpec, PartOutput, PartScene, PrintSpec, ProbeSpec, RegionSpec, SourceSpec, TimeSpec};
pub use point::{CompareSpec, ExchangeSpec, LegSpec, NodesSpec, PointScene, PointSpec};
pub use polymer::{FlowSpec, PhaseSpec, PolymerSpec};
pub use problem::PartTask;
pub use revolved::{RectangleSpec, RevolvedSpec};
pub use schedule::{ScheduleSpec, TimesSpec};
pub(crate) use selection::millimetres;
pub use study::{NAMING, StudySpec};
pub use voxels::{BuiltMesh, Filling, PathSpec, StlSpec};

pub(crate) use harness::scene::check_name;

use harness::scene::{SceneError, Source};
use serde::Deserialize;
use serde::de::IgnoredAny;

/// Program of these scenes.
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Program {
    /// `crystfem`.
    Crystfem,
}

/// Output of a point or fit scene beside the report.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PictureOutput {
    /// Draws pictures (PNG); default true.
    pub pictures: bool,
}

impl Default for PictureOutput {
    fn default() -> Self {
        Self { pictures: true }
    }
}

/// Default of keys that are true unless a scene sets them.
fn default_true() -> bool {
    true
}

/// Kind of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneKind {
    /// Material alone: `[[point]]`, `[[nodes]]`.
    Point,
    /// Part over time: `[mesh]`.
    Part,
    /// Fit of constants to measurements: `[[fit]]`.
    Fit,
}

/// Returns the JSON Schema of scenes.
pub fn schema() -> serde_json::Value {
    harness::scene::schema("crystfem", crate::program::quantities::ALL, |generator| {
        vec![
            generator.subschema_for::<PartScene>(),
            generator.subschema_for::<PointScene>(),
            generator.subschema_for::<FitScene>(),
        ]
    })
}

/// Determines the kind of a scene from its blocks.
///
/// # Errors
/// Returns an error for invalid TOML, another program, and a scene without any of the blocks.
pub fn kind(source: &Source) -> Result<SceneKind, SceneError> {
    /// Blocks that determine the kind.
    #[derive(Deserialize)]
    struct SceneBlocks {
        #[serde(rename = "program")]
        _program: Program,
        point: Option<IgnoredAny>,
        nodes: Option<IgnoredAny>,
        fit: Option<IgnoredAny>,
        mesh: Option<IgnoredAny>,
    }
    let outline: SceneBlocks = source.parse()?;
    let tasks = [
        (SceneKind::Point, "point", outline.point.is_some() || outline.nodes.is_some()),
        (SceneKind::Fit, "fit", outline.fit.is_some()),
        (SceneKind::Part, "mesh", outline.mesh.is_some()),
    ];
    let mut asked = tasks.iter().filter(|(_, _, given)| *given);
    match (asked.next(), asked.next()) {
        (Some((kind, ..)), None) => Ok(*kind),
        (Some((_, first, _)), Some((_, second, _))) => {
            Err(source.conflict(second, first, "a scene has one task; remove one of them"))
        }
        (None, _) => {
            let why = "the scene needs a block `[mesh]`, `[[point]]`, `[[nodes]]` or `[[fit]]`";
            Err(source.missing("mesh", why))
        }
    }
}

#[cfg(test)]
mod tests;
