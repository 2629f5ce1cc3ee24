//! Lines and sections of a scene, whose values are written as tables.

use super::Scene;
use super::values::vector;
use crate::calibrate::Space;
use crate::geometry::length;
use harness::scene::{LineSpec, SceneError, Source, check_name};
use polycore::units::Length;
use serde::Deserialize;

/// Plane (in a plane body a line) through the body at rest across which bonds transmit a force.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SectionSpec {
    /// Name, part of the file name and prefix of the values.
    pub name: String,
    /// Point of the plane, and reference point of moments.
    pub point: Vec<Length>,
    /// Normal of any length; the force is that of the part in front of the plane on the part behind.
    pub normal: Vec<f64>,
}

/// Quantity of a column along a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineField {
    /// A component of the displacement.
    Displacement(usize),
    /// Broken bonds over those at the start.
    Damage,
    /// A component of a stress by a measure of the scene.
    Stress {
        /// First Piola–Kirchhoff instead of Cauchy.
        piola: bool,
        /// Index of the measure in `stress.measures`.
        measure: usize,
        /// Row and column.
        entry: [usize; 2],
    },
}

/// Returns the fields that a line can have, with names and units.
pub fn line_fields(scene: &Scene) -> Vec<(LineField, String, &'static str)> {
    let dimension = dimension(scene);
    let mut fields = Vec::new();
    for (d, axis) in ["x", "y", "z"].into_iter().take(dimension).enumerate() {
        fields.push((LineField::Displacement(d), format!("displacement_{axis}"), "m"));
    }
    if scene.breaks() {
        fields.push((LineField::Damage, "damage".to_owned(), ""));
    }
    for (piola, kind) in [(false, "cauchy"), (true, "piola")] {
        for (measure, spec) in scene.stress.iter().flat_map(|stress| &stress.measures).enumerate() {
            for k in 0..dimension * dimension {
                let entry = [k / dimension, k % dimension];
                let name = format!("{kind}_{}_{}{}", spec.name(), entry[0] + 1, entry[1] + 1);
                fields.push((LineField::Stress { piola, measure, entry }, name, "Pa"));
            }
        }
    }
    fields
}

fn dimension(scene: &Scene) -> usize {
    if scene.body.space == Space::Solid { 3 } else { 2 }
}

impl SectionSpec {
    /// Returns the point, m, and the unit normal.
    ///
    /// # Errors
    /// As [`super::check`].
    pub fn plane<const D: usize>(
        &self,
        source: &Source,
        key: &str,
    ) -> Result<([f64; D], [f64; D]), SceneError> {
        plane_of(source, key, &self.point, &self.normal)
    }
}

/// Converts the keys `point` and `normal` under `key` to a point, m, and a unit normal.
///
/// # Errors
/// As [`super::check`].
pub(super) fn plane_of<const D: usize>(
    source: &Source,
    key: &str,
    point: &[Length],
    normal: &[f64],
) -> Result<([f64; D], [f64; D]), SceneError> {
    let point = vector(source, &format!("{key}.point"), point)?;
    let key = format!("{key}.normal");
    let Ok(normal) = <[f64; D]>::try_from(normal) else {
        let found = format!("{} components", normal.len());
        return Err(source.error(&key, found, format!("{D} components")));
    };
    let largest = normal.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    if largest == 0.0 || !normal.iter().all(|x| x.is_finite()) {
        return Err(source.error(&key, format!("{normal:?}"), "finite numbers, not all of them 0"));
    }
    // squares of very small or large numbers are 0 or infinite
    let normal = normal.map(|x| x / largest);
    let size = length(normal);
    Ok((point, normal.map(|x| x / size)))
}

/// Checks what needs no body.
///
/// # Errors
/// A [`SceneError`] that names the key, the value found and what is allowed.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let columns: Vec<String> = line_fields(scene).into_iter().map(|(_, name, _)| name).collect();
    LineSpec::check(&scene.output.line, source, dimension(scene), &columns)?;
    for (index, section) in scene.output.section.iter().enumerate() {
        let key = format!("output.section[{index}]");
        let name = format!("{key}.name");
        check_name(source, &name, &section.name)?;
        if scene.output.section[..index].iter().any(|other| other.name == section.name) {
            return Err(source.error(&name, format!("`{}` twice", section.name), "different names"));
        }
        match dimension(scene) {
            2 => section.plane::<2>(source, &key).map(|_| ())?,
            _ => section.plane::<3>(source, &key).map(|_| ())?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_of_any_length() {
        let source = Source::new("scene.toml", "");
        let plane = |normal: [f64; 2]| {
            let point = vec!["1 mm".parse().unwrap(); 2];
            let spec = SectionSpec { name: "s".into(), point, normal: normal.to_vec() };
            spec.plane::<2>(&source, "output.section[0]").map(|(_, normal)| normal)
        };
        for size in [1e-300, 1e-200, 1.0, 1e200, f64::MAX] {
            assert_eq!(plane([0.0, -size]).unwrap(), [0.0, -1.0]);
        }
        assert_eq!(plane([3e-200, 4e-200]).unwrap(), [0.6, 0.8]);
        for wrong in [[0.0; 2], [f64::NAN, 1.0], [1.0, f64::INFINITY]] {
            let message = plane(wrong).unwrap_err().to_string();
            assert!(message.contains("finite numbers, not all of them 0"), "{message}");
        }
    }
}
