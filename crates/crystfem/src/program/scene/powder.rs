//! Powder of a material, as written in TOML.

use super::fault::located_in;
use crate::material::{Powder, ThermalMaterial};
use harness::scene::{SceneError, Source};
use polycore::units::Temperature;
use serde::Deserialize;

/// Where its parameters stand.
const KEYS: [(&str, &str); 3] = [
    ("conductivity of powder over that of the solid", "conductivity"),
    ("temperature at which powder begins to consolidate, K", "from"),
    ("temperature at which powder is consolidated, K", "to"),
];

/// Powder of a material, see [`Powder`].
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PowderSpec {
    /// Its conductivity over that of the solid.
    pub conductivity: f64,
    /// Where it begins to consolidate.
    pub from: Temperature,
    /// Where it is consolidated.
    pub to: Temperature,
}

impl PowderSpec {
    /// The material, as a powder where its block `key` says so.
    ///
    /// # Errors
    /// Those of [`Powder::new`], located.
    pub(super) fn wrap<M: ThermalMaterial + 'static>(
        spec: Option<Self>,
        source: &Source,
        key: &str,
        solid: M,
    ) -> Result<Box<dyn ThermalMaterial>, SceneError> {
        let Some(spec) = spec else { return Ok(Box::new(solid)) };
        let powder = Powder::new(solid, spec.conductivity, [spec.from.si(), spec.to.si()]);
        let powder = powder.map_err(|error| located_in(source, &format!("{key}.powder"), &KEYS, &error))?;
        Ok(Box::new(powder))
    }
}
