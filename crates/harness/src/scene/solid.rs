//! The view of solids in pictures: viewer and cutting plane.

use serde::Deserialize;

use super::{SceneError, Source};
use crate::output::picture::{Plane, View};
use polycore::units::{Angle, Length};

/// View of solids in pictures.
#[derive(Clone, Copy, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SolidSpec {
    /// Position of the viewer around z, from x towards y; default −60°.
    pub azimuth: Option<Angle>,
    /// Position of the viewer above the plane of x and y; default 25°.
    pub elevation: Option<Angle>,
    /// A plane that cuts the body; the part in front of it is not drawn.
    pub cut: Option<CutSpec>,
    /// A full turn about z as an animation, too.
    pub turntable: bool,
}

/// A plane.
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CutSpec {
    /// Normal of any length and sign.
    pub normal: [f64; 3],
    /// Distance from the origin along the normal; default: through the middle of the body.
    pub at: Option<Length>,
}

impl SolidSpec {
    /// Checks angles and the plane, at `key`.
    ///
    /// # Errors
    /// A [`SceneError`] that names the key, the value found and what is allowed.
    pub fn check(&self, source: &Source, key: &str) -> Result<(), SceneError> {
        let wrong = |name: &str, found: String, allowed: &str| {
            Err(source.error(&format!("{key}.{name}"), found, allowed))
        };
        for (name, angle, most) in [("azimuth", self.azimuth, 360.0), ("elevation", self.elevation, 90.0)] {
            // without the digits of a change of units
            let degrees = angle.map_or(0.0, |angle| (angle.si().to_degrees() * 1e9).round() / 1e9);
            if degrees.is_nan() || degrees.abs() > most {
                return wrong(name, format!("{degrees} deg"), &format!("between −{most} deg and {most} deg"));
            }
        }
        let Some(CutSpec { normal, .. }) = self.cut else { return Ok(()) };
        let square: f64 = normal.iter().map(|x| x * x).sum();
        if !square.is_normal() {
            return wrong("cut.normal", format!("{normal:?}"), "three numbers, not all of them 0");
        }
        Ok(())
    }

    /// Returns the viewer.
    pub fn view(&self) -> View {
        let View { azimuth, elevation } = View::default();
        View {
            azimuth: self.azimuth.map_or(azimuth, Angle::si),
            elevation: self.elevation.map_or(elevation, Angle::si),
        }
    }

    /// The plane that cuts a body between two corners and removes the part in front.
    pub fn plane(&self, [low, high]: [[f64; 3]; 2]) -> Option<Plane> {
        let CutSpec { normal, at } = self.cut?;
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        let normal = normal.map(|x| x / length);
        let middle = (0..3).map(|d| 0.5 * (low[d] + high[d]) * normal[d]).sum();
        Some(self.view().facing(Plane { normal, at: at.map_or(middle, Length::si) }))
    }
}
