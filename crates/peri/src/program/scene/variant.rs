//! Variants of a scene: its own discretisation, or the combinations that its studies list.

use super::{HORIZON_RATIO, Scene, SurfaceCorrection};
use crate::bonds::VolumeCorrection;
use harness::scene::{SceneError, Source};
use harness::study::{self, Naming};
use polycore::units::Length;

harness::study! {
    /// Set of variants: all combinations of the listed values. Other keys keep the value of the scene; a
    /// replaced block is replaced as a whole.
    pub struct Study;
    replaces {
        critical: crate::critical::Critical = "material.critical",
        material: super::Material = "material",
        shapes: Vec<super::ShapeSpec> = "body.shapes",
        cracks: Vec<super::CrackSpec> = "body.cracks",
        boundary: Vec<super::Boundary> = "boundary",
        body_force: Vec<super::BodyForceSpec> = "body_force",
        solver: super::SolverSpec = "solver",
        time: super::TimeProgramSpec = "time",
        dynamics: super::Dynamics = "dynamics",
        contact: super::ContactSpec = "contact",
    }
    lists {
        spacing: Length = "body.spacing",
        horizon_ratio: f64 = "body.horizon_ratio",
        surface_correction: SurfaceCorrection = "material.surface_correction",
        volume_correction: VolumeCorrection = "material.volume_correction",
    }
}

/// Names of values and files end with the name of the variant.
pub const NAMING: Naming = Naming::Brackets;

/// Variant of a scene and its discretisation.
#[derive(Clone, Debug)]
pub struct SceneVariant {
    /// Name, study and source.
    pub of: study::Variant,
    /// Scene of the variant.
    pub scene: Scene,
    /// Spacing, m (0 for a cloud).
    pub spacing: f64,
    /// Horizon over spacing.
    pub horizon_ratio: f64,
    /// Surface correction.
    pub surface: SurfaceCorrection,
    /// Volume correction.
    pub volume: VolumeCorrection,
}

impl SceneVariant {
    fn new(of: study::Variant) -> Result<Self, SceneError> {
        let mut scene: Scene = of.source.parse()?;
        super::resolve_network(&of.source, &mut scene.material)?;
        Ok(Self {
            spacing: scene.body.spacing.map_or(0.0, |spacing| spacing.si()),
            horizon_ratio: scene.body.horizon_ratio.unwrap_or(HORIZON_RATIO),
            surface: scene.material.surface_correction,
            volume: scene.material.volume_correction,
            of,
            scene,
        })
    }

    /// Returns the short name for tables, curves and expectations: `dx=4mm m=3.015`, corrections, the name of
    /// the study.
    pub fn name(&self) -> String {
        self.of.name.clone()
    }

    /// Returns the name without the spacing: variants of one family differ in spacing only.
    pub fn family(&self) -> String {
        self.of.name.split_once(' ').map_or(&*self.of.name, |(_, rest)| rest).to_owned()
    }

    /// Returns the source, whose errors point at the study, and the scene.
    pub fn resolved(&self) -> (&Source, &Scene) {
        (&self.of.source, &self.scene)
    }
}

/// Builds a name such as `dx=4mm m=3.015`, with corrections and the name of the study.
fn name(source: &Source, study: Option<&str>) -> Result<String, SceneError> {
    let Scene { body, material, .. } = source.parse()?;
    // twelve digits: the number as written, without rounding by the conversion to SI
    let round = |value: f64| format!("{value:.12e}").parse().unwrap_or(value);
    let ratio = body.horizon_ratio.unwrap_or(HORIZON_RATIO);
    let lattice = body.spacing.map(|spacing| format!("dx={}mm m={ratio}", round(spacing.si() * 1e3)));
    let mut name = lattice.unwrap_or_else(|| "cloud".to_owned());
    if material.surface_correction == SurfaceCorrection::Energy {
        name += " surface=energy";
    }
    if material.volume_correction == VolumeCorrection::Linear {
        name += " volume=linear";
    }
    Ok(study.map_or(name.clone(), |study| name + " " + study))
}

/// Returns the variants: the scene's own discretisation, or all combinations that its studies list.
pub fn variants(source: &Source, scene: &Scene, quick: bool) -> Result<Vec<SceneVariant>, SceneError> {
    let studies: Vec<study::Study> = scene.study.iter().map(Study::study).collect();
    let each = study::variants(source, &studies, quick, NAMING, name)?.into_iter().map(SceneVariant::new);
    let each = each.collect::<Result<Vec<_>, _>>()?;
    let names: Vec<String> = each.iter().map(SceneVariant::name).collect();
    super::picture_state::refuse_shared_names(source, scene, &names)?;
    Ok(each)
}
