//! Healing of interfaces between layers and beads.

use super::PartScene;
use super::locate_error::located_in;
use crate::coupling::HealingSettings;
use crate::error::Error;
use crate::healing::{Glass, Healing};
use crate::mesh::Mesh;
use crate::problem::Birth;
use harness::scene::{SceneError, Source};
use polycore::units::{MolarEnergy, Stress, Temperature, TemperatureDifference, Time};
use serde::Deserialize;

/// Parameters of the law and their keys.
const KEYS: [(&str, &str); 6] = [
    ("relaxation time of healing, s", "time"),
    ("temperature of healing, K", "temperature"),
    ("activation energy of healing, J/mol", "energy"),
    ("glass transition, K", "glass_transition"),
    ("C1 of WLF", "wlf"),
    ("C2 of WLF, K", "wlf"),
];
/// Distance of T∞ in the kinetics below T_g, K (Hoffman).
const FROZEN: f64 = 30.0;

/// Healing of interfaces between material printed at different times.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HealingSpec {
    /// Printed material; it must be semicrystalline.
    pub material: String,
    /// Relaxation time of chains at `temperature`. No value for PA12 has been published.
    pub time: Time,
    /// Temperature of this relaxation time.
    pub temperature: Temperature,
    /// Activation energy of the relaxation time in the melt.
    pub energy: MolarEnergy,
    /// Increase of the relaxation time towards the glass transition: `wlf` (default), or `arrhenius` as in
    /// the melt.
    #[serde(default)]
    pub shift: ShiftLaw,
    /// Glass transition, at and below which nothing heals; default: T∞ + 30 K from the kinetics of the
    /// material.
    pub glass_transition: Option<Temperature>,
    /// Constants C₁ and C₂ of the WLF equation at the glass transition; default 17.44 and 51.6 K.
    pub wlf: Option<(f64, TemperatureDifference)>,
    /// Tensile strength of the material. The strength of an interface is D_h times this.
    pub strength: Option<Stress>,
}

/// Increase of the relaxation time towards the glass transition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ShiftLaw {
    /// Williams, Landel and Ferry.
    #[default]
    Wlf,
    /// Arrhenius' law of the melt, at any temperature.
    Arrhenius,
}

impl HealingSpec {
    /// Creates the law for a material with the default glass transition `transition`, K.
    fn law(&self, transition: f64) -> Result<Healing, Error> {
        let law = Healing::new(self.time.si(), self.temperature.si(), self.energy.si())?;
        if self.shift == ShiftLaw::Arrhenius {
            return Ok(law);
        }
        let mut glass = Glass::universal(self.glass_transition.map_or(transition, |given| given.si()));
        if let Some((steepness, width)) = &self.wlf {
            (glass.steepness, glass.width) = (*steepness, width.si());
        }
        law.with_glass(glass)
    }
}

impl PartScene {
    /// Returns the interfaces that heal, if the scene has `[healing]`; `births` belong to its print.
    ///
    /// # Errors
    /// Returns a [`SceneError`] for another material, invalid constants, and a part without interfaces.
    pub(super) fn interfaces(
        &self,
        source: &Source,
        mesh: &Mesh,
        material_of: &[u16],
        births: &[Birth],
    ) -> Result<Option<HealingSettings>, SceneError> {
        let Some(spec) = &self.healing else { return Ok(None) };
        let known: Vec<&str> = self.materials.keys().map(String::as_str).collect();
        let Some(index) = known.iter().position(|name| *name == spec.material) else {
            return Err(source.unknown("healing.material", &spec.material, &known));
        };
        let material = &self.materials[&spec.material];
        if material.kinetics.is_none() {
            let found = format!("`{}`, a material that does not crystallize", spec.material);
            return Err(source.error("healing.material", found, "a semicrystalline material"));
        }
        let kinetics = material.constants(source, &format!("materials.{}", spec.material))?;
        let law = spec
            .law(kinetics.frozen + FROZEN)
            .map_err(|error| located_in(source, "healing", &KEYS, &error))?;
        let strength = spec.strength.map(|strength| strength.si());
        if let Some(found) = strength.filter(|strength| !(*strength > 0.0 && strength.is_finite())) {
            return Err(source.error("healing.strength", format!("{found} Pa"), "above 0"));
        }
        let settings = HealingSettings::new(mesh, material_of, births, index as u16, law)
            .map_err(|error| source.refused("mesh", error.to_string()))?;
        if settings.interfaces.is_empty() {
            let found = format!("no two births of `{}` that touch", spec.material);
            return Err(source.error(
                "healing.material",
                found,
                "the material of a [print] with several births",
            ));
        }
        Ok(Some(HealingSettings { strength, ..settings }))
    }
}
