//! The variants of a scene: its own discretisation, or the combinations that its studies list.

use super::{HORIZON_RATIO, Scene, SurfaceCorrection};
use crate::bonds::VolumeCorrection;
use harness::scene::{SceneError, Source};
use harness::study::{self, Naming};
use polycore::units::Length;

harness::study! {
    /// A set of variants: every combination of the listed values; other keys keep the scene's value. A replaced part of the
    /// scene is replaced as a whole.
    pub struct Study;
    replaces {
        critical: crate::critical::Critical = "material.critical",
        material: super::Material = "material",
        shapes: Vec<super::ShapeSpec> = "body.shapes",
        cracks: Vec<super::CrackSpec> = "body.cracks",
        boundary: Vec<super::Boundary> = "boundary",
        solver: super::Solver = "solver",
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

/// Values and files of a variant have its name behind theirs.
pub const NAMING: Naming = Naming::Brackets;

/// A variant and its discretisation.
#[derive(Clone, Debug)]
pub struct Variant {
    /// Its name, its study, its source.
    pub of: study::Variant,
    /// Its scene.
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

impl Variant {
    fn new(of: study::Variant) -> Result<Self, SceneError> {
        let scene: Scene = of.source.parse()?;
        Ok(Self {
            spacing: scene.body.spacing.map_or(0.0, |spacing| spacing.si()),
            horizon_ratio: scene.body.horizon_ratio.unwrap_or(HORIZON_RATIO),
            surface: scene.material.surface_correction,
            volume: scene.material.volume_correction,
            of,
            scene,
        })
    }

    /// Short name in tables, curves and expectations: `dx=4mm m=3.015`, corrections where there are any, the study's name.
    pub fn name(&self) -> String {
        self.of.name.clone()
    }

    /// Its name without its spacing: variants that differ in nothing else converge together.
    pub fn family(&self) -> String {
        self.of.name.split_once(' ').map_or(&*self.of.name, |(_, rest)| rest).to_owned()
    }

    /// Its source, whose errors point at its study, and its scene.
    pub fn resolved(&self) -> (&Source, &Scene) {
        (&self.of.source, &self.scene)
    }
}

/// `dx=4mm m=3.015`, corrections where there are any, the study's name.
fn name(source: &Source, study: Option<&str>) -> Result<String, SceneError> {
    let Scene { body, material, .. } = source.parse()?;
    // twelve digits: what a user wrote, without the rounding of its conversion to SI
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

/// The scene's own discretisation, or every combination that its studies list.
pub fn variants(source: &Source, scene: &Scene, quick: bool) -> Result<Vec<Variant>, SceneError> {
    let studies: Vec<study::Study> = scene.study.iter().map(Study::study).collect();
    study::variants(source, &studies, quick, NAMING, name)?.into_iter().map(Variant::new).collect()
}
