//! Fit whose model is the part of another scene.

use super::fit_spec::{FitSpec, alpha, table, time};
use super::material::KineticsSpec;
use super::{PartScene, SceneKind};
use crate::kinetics::KineticConstants;
use harness::scene::{SceneError, Source};

/// A part, and the measurements in it.
pub struct PartFit {
    /// Scene of the part.
    pub source: Source,
    scene: PartScene,
    material: String,
    /// Constants of the material in its scene, the first trial.
    pub constants: KineticConstants,
    /// For each file: index of the probe in the scene of the part, times, s, and α.
    pub curves: Vec<(usize, Vec<f64>, Vec<f64>)>,
}

impl PartFit {
    /// Returns the scene with other constants.
    pub fn with_constants(&self, constants: &KineticConstants) -> PartScene {
        let mut scene = self.scene.clone();
        if let Some(material) = scene.materials.get_mut(&self.material) {
            material.kinetics = Some(KineticsSpec::Named(*constants));
        }
        scene
    }

    /// Returns α of all files, one file after the other.
    pub fn degrees(&self) -> Vec<f64> {
        self.curves.iter().flat_map(|(_, _, degrees)| degrees.iter().copied()).collect()
    }
}

impl FitSpec {
    pub(super) fn read_part(
        &self,
        source: &Source,
        key: &dyn Fn(&str) -> String,
    ) -> Result<PartFit, SceneError> {
        let Some(file) = &self.part else {
            return Err(source.missing(&key("part"), "`law = \"part\"` needs the scene of a part"));
        };
        let part = Source::read(source.file(file))
            .map_err(|error| source.error(&key("part"), error.message(), "the scene of a part"))?;
        if super::kind(&part)? != SceneKind::Part {
            let found = format!("`{}`, a scene without [mesh]", file.display());
            return Err(source.error(&key("part"), found, "the scene of a part"));
        }
        let scene: PartScene = part.parse()?;
        scene.check(&part)?;
        let known: Vec<&str> = scene
            .materials
            .iter()
            .filter(|(_, material)| material.kinetics.is_some())
            .map(|(name, _)| name.as_str())
            .collect();
        let name = match (&self.material, known.as_slice()) {
            (Some(name), _) if known.contains(&name.as_str()) => name.as_str(),
            (Some(name), _) => return Err(source.unknown(&key("material"), name, &known)),
            (None, [only]) => only,
            (None, _) => {
                let why = format!("{} materials of the part crystallize; name one", known.len());
                return Err(source.missing(&key("material"), why));
            }
        };
        let constants = scene.materials[name].constants(&part, &format!("materials.{name}"))?;
        let probes: Vec<&str> = scene.probe.iter().map(|probe| probe.name.as_str()).collect();
        let mut curves = Vec::new();
        for (i, data) in self.data.iter().enumerate() {
            let at = key(&format!("data[{i}].probe"));
            let Some(probe) = &data.probe else {
                return Err(source.missing(&at, "`law = \"part\"` needs a probe of the part"));
            };
            let Some(index) = probes.iter().position(|name| name == probe) else {
                return Err(source.unknown(&at, probe, &probes));
            };
            let columns = [time().within(0.0, f64::INFINITY), alpha()];
            let [times, degrees] = table(source, &key(&format!("data[{i}].file")), &data.file, columns)?;
            curves.push((index, times, degrees));
        }
        // open the files of the part
        let task = scene.mesh.build(&part).and_then(|built| scene.task(&part, built));
        task.map_err(|error| source.error(&key("part"), error.message(), "a valid part scene"))?;
        let material = name.to_owned();
        Ok(PartFit { source: part, scene, material, constants, curves })
    }
}
