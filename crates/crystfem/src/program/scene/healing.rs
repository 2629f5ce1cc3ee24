//! Healing of interfaces: of which material, how fast.

use super::PartScene;
use super::fault::located_in;
use crate::coupling::HealingSettings;
use crate::error::Error;
use crate::healing::{Glass, Healing};
use crate::mesh::Mesh;
use crate::problem::Birth;
use harness::scene::{SceneError, Source};
use polycore::units::{MolarEnergy, Stress, Temperature, TemperatureDifference, Time};
use serde::Deserialize;

/// Where its constants stand.
const KEYS: [(&str, &str); 6] = [
    ("relaxation time of healing, s", "time"),
    ("temperature of healing, K", "temperature"),
    ("activation energy of healing, J/mol", "energy"),
    ("glass transition, K", "glass_transition"),
    ("C1 of WLF", "wlf"),
    ("C2 of WLF, K", "wlf"),
];
/// T∞ of the kinetics is that much below T_g, K (Hoffman).
const FROZEN: f64 = 30.0;

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
    /// Activation energy of this time in the melt.
    pub energy: MolarEnergy,
    /// How `time` grows towards the glass: `wlf`, the default, or `arrhenius`, as in the melt.
    #[serde(default)]
    pub shift: Shift,
    /// Glass transition, at and below which nothing heals; default T∞ + 30 K of the material's kinetics.
    pub glass_transition: Option<Temperature>,
    /// C₁ and C₂ of Williams, Landel and Ferry about it; default 17.44 and 51.6 K.
    pub wlf: Option<(f64, TemperatureDifference)>,
    /// Tensile strength of the material: the strength of interfaces is D_h times it.
    pub strength: Option<Stress>,
}

/// How the relaxation time grows towards the glass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Shift {
    /// As Williams, Landel and Ferry have it.
    #[default]
    Wlf,
    /// As in the melt, at any temperature.
    Arrhenius,
}

impl HealingSpec {
    /// The law, of a material whose glass transition is about `transition`, K.
    fn law(&self, transition: f64) -> Result<Healing, Error> {
        let law = Healing::new(self.time.si(), self.temperature.si(), self.energy.si())?;
        if self.shift == Shift::Arrhenius {
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
    /// The interfaces of a scene, where it asks for their healing; `births` are those of its print.
    ///
    /// # Errors
    /// A [`SceneError`] for another material, constants out of their domain, and a part without interfaces.
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
            let found = format!("`{}`, which does not crystallize", spec.material);
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
