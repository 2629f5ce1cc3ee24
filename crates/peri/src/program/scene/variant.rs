//! The variants of a scene: its own discretisation, or the combinations that its studies list.

use super::values::{positive, ratio};
use super::{HORIZON_RATIO, Scene, Study, SurfaceCorrection};
use crate::bonds::VolumeCorrection;
use harness::scene::{SceneError, Source};

/// What a study may change.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    /// Spacing, m (0 for a cloud).
    pub spacing: f64,
    /// Horizon over spacing.
    pub horizon_ratio: f64,
    /// Surface correction.
    pub surface: SurfaceCorrection,
    /// Volume correction.
    pub volume: VolumeCorrection,
    /// Part of `--quick` runs.
    pub quick: bool,
    /// The study's name.
    pub label: Option<String>,
    /// The study it belongs to.
    pub study: Option<usize>,
}

impl Variant {
    /// Short name in tables, curves and expectations: `dx=4mm m=3.015`, corrections where there are any, the study's name.
    pub fn name(&self) -> String {
        let mut name = if self.spacing > 0.0 {
            format!("dx={}mm m={}", round(self.spacing * 1e3), self.horizon_ratio)
        } else {
            "cloud".to_owned()
        };
        if self.surface == SurfaceCorrection::Energy {
            name += " surface=energy";
        }
        if self.volume == VolumeCorrection::Linear {
            name += " volume=linear";
        }
        if let Some(label) = &self.label {
            name += " ";
            name += label;
        }
        name
    }

    /// Its name without its spacing: variants that differ in nothing else converge together.
    pub fn family(&self) -> String {
        let name = self.name();
        name.split_once(' ').map_or(name.clone(), |(_, rest)| rest.to_owned())
    }

    /// The scene of this variant, with the parts that its study replaces; errors point there.
    ///
    /// # Errors
    /// As [`Source::parse`].
    pub fn resolve(&self, source: &Source, scene: &Scene) -> Result<(Source, Scene), SceneError> {
        let Some(index) = self.study else { return Ok((source.clone(), scene.clone())) };
        let study = &scene.study[index];
        // of what concerns a key the first holds: a single key before its block
        let source = match study.set {
            Some(_) => source.with_merged(&format!("study[{index}].set")),
            None => source.clone(),
        };
        let given = study.replaced().into_iter().filter(|(_, _, given)| *given);
        let source = given
            .fold(source, |source, (key, by, _)| source.with_replaced(key, &format!("study[{index}].{by}")));
        let scene = source.parse()?;
        Ok((source, scene))
    }
}

impl Study {
    /// Which key of the scene each key of a study stands for, and whether it is given.
    pub(super) fn replaced(&self) -> [(&'static str, &'static str, bool); 8] {
        // the longer key first: it would be found under the shorter one
        [
            ("material.critical", "critical", self.critical.is_some()),
            ("material", "material", self.material.is_some()),
            ("body.shapes", "shapes", self.shapes.is_some()),
            ("body.cracks", "cracks", self.cracks.is_some()),
            ("boundary", "boundary", self.boundary.is_some()),
            ("solver", "solver", self.solver.is_some()),
            ("dynamics", "dynamics", self.dynamics.is_some()),
            ("contact", "contact", self.contact.is_some()),
        ]
    }
}

/// Twelve digits: what a user wrote, without the rounding of its conversion to SI.
fn round(value: f64) -> f64 {
    format!("{value:.12e}").parse().unwrap_or(value)
}

/// The scene's own discretisation, or every combination that its studies list.
pub fn variants(source: &Source, scene: &Scene, quick: bool) -> Result<Vec<Variant>, SceneError> {
    let own = Study::default();
    let mut variants: Vec<Variant> = Vec::new();
    let studies: Vec<&Study> = if scene.study.is_empty() { vec![&own] } else { scene.study.iter().collect() };
    for (index, study) in studies.iter().enumerate() {
        if scene.body.has_points() && !(study.spacing.is_empty() && study.horizon_ratio.is_empty()) {
            return Err(source.error(&format!("study[{index}]"), "spacings of a cloud", "corrections only"));
        }
        let stops = |c: char| c.is_control() || "/\\[]".contains(c);
        if let Some(name) = study.name.as_ref().filter(|name| name.contains(stops)) {
            let allowed = "a name without `/`, `\\`, `[`, `]`: files and values have it";
            return Err(source.error(&format!("study[{index}].name"), format!("`{name}`"), allowed));
        }
        let replaces = study.set.is_some() || study.replaced().iter().any(|(_, _, given)| *given);
        let is_quick = study.quick.unwrap_or(true);
        if quick && !is_quick {
            continue;
        }
        let spacings = if study.spacing.is_empty() {
            scene.body.spacing.into_iter().collect()
        } else {
            study.spacing.clone()
        };
        let spacings: Vec<f64> =
            if spacings.is_empty() { vec![0.0] } else { spacings.iter().map(|s| s.si()).collect() };
        let or_own = |list: &[f64], own: f64| if list.is_empty() { vec![own] } else { list.to_vec() };
        let ratios = or_own(&study.horizon_ratio, scene.body.horizon_ratio.unwrap_or(HORIZON_RATIO));
        let own_material = study.material.as_ref().unwrap_or(&scene.material);
        let surfaces = if study.surface_correction.is_empty() {
            vec![own_material.surface_correction]
        } else {
            study.surface_correction.clone()
        };
        let volumes = if study.volume_correction.is_empty() {
            vec![own_material.volume_correction]
        } else {
            study.volume_correction.clone()
        };
        for (k, &spacing) in spacings.iter().enumerate() {
            if !study.spacing.is_empty() {
                positive(source, &format!("study[{index}].spacing[{k}]"), spacing, "m")?;
            }
            for (k, &horizon_ratio) in ratios.iter().enumerate() {
                let key = if study.horizon_ratio.is_empty() {
                    "body.horizon_ratio".to_owned()
                } else {
                    format!("study[{index}].horizon_ratio[{k}]")
                };
                ratio(source, &key, horizon_ratio)?;
                for &surface in &surfaces {
                    for &volume in &volumes {
                        let variant = Variant {
                            spacing,
                            horizon_ratio,
                            surface,
                            volume,
                            quick: is_quick,
                            label: study.name.clone(),
                            study: (!scene.study.is_empty()).then_some(index),
                        };
                        if !variants.iter().any(|v| v.name() == variant.name()) {
                            variants.push(variant);
                        } else if replaces {
                            let found = format!("a second variant `{}`", variant.name());
                            let allowed = "a `name` for each study that replaces a part of the scene";
                            return Err(source.error(&format!("study[{index}]"), found, allowed));
                        }
                    }
                }
            }
        }
    }
    Ok(variants)
}
