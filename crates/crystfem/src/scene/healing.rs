//! Healing of interfaces: of which material, how fast.

use super::PartScene;
use super::fault::located_in;
use crate::healing::Healing;
use crate::mesh::Mesh;
use crate::mesh::surface::{Surface, area};
use polycore::scene::{SceneError, Source};
use polycore::units::{MolarEnergy, Temperature, Time};
use serde::Deserialize;

/// Where its constants stand.
const KEYS: [(&str, &str); 3] = [
    ("relaxation time of healing, s", "time"),
    ("temperature of healing, K", "temperature"),
    ("activation energy of healing, J/mol", "energy"),
];

/// How interfaces between what was printed at different times heal.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HealingSpec {
    /// The printed material; it must be semicrystalline.
    pub material: String,
    /// Relaxation time of chains at `temperature`; nobody has published it of PA12.
    pub time: Time,
    /// See `time`.
    pub temperature: Temperature,
    /// Activation energy of this time.
    pub energy: MolarEnergy,
}

/// An interface between two elements.
pub struct Interface {
    /// The elements.
    pub sides: [u32; 2],
    /// The corners that they share.
    pub nodes: Vec<u32>,
    /// m².
    pub area: f64,
}

/// What heals.
pub struct Interfaces {
    /// How fast.
    pub law: Healing,
    /// Between elements that appear at different times.
    pub list: Vec<Interface>,
    /// Elements that are printed of this material.
    pub printed: Vec<bool>,
}

impl PartScene {
    /// The interfaces of a scene, where it asks for their healing; `births` are the elements of each birth.
    ///
    /// # Errors
    /// A [`SceneError`] for another material, constants out of their domain, and a part without interfaces.
    pub(super) fn interfaces<'a>(
        &self,
        source: &Source,
        mesh: &Mesh,
        material_of: &[u16],
        births: impl Iterator<Item = &'a [u32]>,
    ) -> Result<Option<Interfaces>, SceneError> {
        let Some(spec) = &self.healing else { return Ok(None) };
        let known: Vec<&str> = self.materials.keys().map(String::as_str).collect();
        let Some(index) = known.iter().position(|name| *name == spec.material) else {
            return Err(source.unknown("healing.material", &spec.material, &known));
        };
        if self.materials[&spec.material].kinetics.is_none() {
            let found = format!("`{}`, which does not crystallize", spec.material);
            return Err(source.error("healing.material", found, "a semicrystalline material"));
        }
        let law = Healing::new(spec.time.si(), spec.temperature.si(), spec.energy.si())
            .map_err(|error| located_in(source, "healing", &KEYS, &error))?;
        let mut birth_of = vec![u32::MAX; mesh.element_count()];
        for (number, elements) in (0..).zip(births) {
            elements.iter().for_each(|&element| birth_of[element as usize] = number);
        }
        let births = birth_of.iter().zip(material_of);
        let printed: Vec<bool> =
            births.map(|(&birth, &of)| usize::from(of) == index && birth != u32::MAX).collect();
        let surface = Surface::of_all(mesh).map_err(|error| source.refused("mesh", error.to_string()))?;
        let mut list = Vec::new();
        for element in 0..mesh.element_count() as u32 {
            if !printed[element as usize] {
                continue;
            }
            for face in mesh.faces_of(element) {
                let Some(other) = surface.opposite(face).map(|face| face.element) else { continue };
                if printed[other as usize] && birth_of[other as usize] < birth_of[element as usize] {
                    let nodes = mesh.face_nodes(face).to_vec();
                    list.push(Interface { sides: [element, other], nodes, area: area(mesh, face) });
                }
            }
        }
        if list.is_empty() {
            let found = format!("no two births of `{}` that touch", spec.material);
            return Err(source.error(
                "healing.material",
                found,
                "the material of a [print] with several births",
            ));
        }
        Ok(Some(Interfaces { law, list, printed }))
    }
}
