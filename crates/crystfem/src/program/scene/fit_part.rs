//! A fit whose model is a part of another scene.

use super::fit_spec::{FitSpec, alpha, table, time};
use super::material::KineticsSpec;
use super::{Kind, PartScene};
use crate::kinetics::KineticConstants;
use harness::scene::{SceneError, Source};

/// A part, and what was measured in it.
pub struct PartFit {
    /// Its scene.
    pub source: Source,
    scene: PartScene,
    material: String,
    /// The constants that it has.
    pub constants: KineticConstants,
    /// Of each file: the probe's place among those of the part, times, s, and α.
    pub curves: Vec<(usize, Vec<f64>, Vec<f64>)>,
}

impl PartFit {
    /// The part with other constants.
    pub fn with(&self, constants: &KineticConstants) -> PartScene {
        let mut scene = self.scene.clone();
        if let Some(material) = scene.materials.get_mut(&self.material) {
            material.kinetics = Some(KineticsSpec::Named(*constants));
        }
        scene
    }

    /// α of all files, one after the other.
    pub fn degrees(&self) -> Vec<f64> {
        self.curves.iter().flat_map(|(_, _, degrees)| degrees.iter().copied()).collect()
    }
}

impl FitSpec {
    pub(super) fn part(&self, source: &Source, key: &dyn Fn(&str) -> String) -> Result<PartFit, SceneError> {
        let Some(file) = &self.part else {
            return Err(source.error(&key("part"), "nothing", "`part`: the scene of a part"));
        };
        let part = Source::read(source.file(file))
            .map_err(|error| source.error(&key("part"), error.message(), "the scene of a part"))?;
        if super::kind(&part)? != Kind::Part {
            let found = format!("`{}`, which has no [mesh]", file.display());
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
                let found = format!("nothing, and {} materials that crystallize", known.len());
                return Err(source.error(&key("material"), found, "the name of one"));
            }
        };
        let constants = scene.materials[name].constants(&part, &format!("materials.{name}"))?;
        let probes: Vec<&str> = scene.probe.iter().map(|probe| probe.name.as_str()).collect();
        let mut curves = Vec::new();
        for (i, data) in self.data.iter().enumerate() {
            let at = key(&format!("data[{i}].probe"));
            let Some(probe) = &data.probe else {
                return Err(source.error(&at, "nothing", "`probe`: one of the part"));
            };
            let Some(index) = probes.iter().position(|name| name == probe) else {
                return Err(source.unknown(&at, probe, &probes));
            };
            let columns = [time().within(0.0, f64::INFINITY), alpha()];
            let [times, degrees] = table(source, &key(&format!("data[{i}].file")), &data.file, columns)?;
            curves.push((index, times, degrees));
        }
        // opens the files that the part reads
        let task = scene.mesh.build(&part).and_then(|built| scene.task(&part, built));
        task.map_err(|error| source.error(&key("part"), error.message(), "the scene of a valid part"))?;
        let material = name.to_owned();
        Ok(PartFit { source: part, scene, material, constants, curves })
    }
}
