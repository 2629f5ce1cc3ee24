//! Powder block of a material.

use super::locate_error::located_in;
use crate::material::{Powder, ThermalMaterial};
use harness::scene::{SceneError, Source};
use polycore::units::Temperature;
use serde::Deserialize;

/// Parameters of powder and their keys.
const KEYS: [(&str, &str); 3] = [
    ("conductivity of powder over that of the solid", "conductivity"),
    ("temperature at which powder begins to consolidate, K", "from"),
    ("temperature at which powder is consolidated, K", "to"),
];

/// Powder properties of new material, see [`Powder`].
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PowderSpec {
    /// Conductivity of the powder over that of the solid.
    pub conductivity: f64,
    /// Temperature at which consolidation begins.
    pub from: Temperature,
    /// Temperature at which consolidation is complete.
    pub to: Temperature,
}

impl PowderSpec {
    /// Wraps the material of block `key` as a powder if the block has one.
    ///
    /// # Errors
    /// Returns the errors of [`Powder::new`], with their keys.
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
