//! Boundaries of a scene: regions of the body with loads or supports.

use super::ShapeSpec;
use super::curve_spec::{CurveList, CurveSpec};
use super::formula::Formula;
use crate::solver::Rotation;
use polycore::units::{Angle, Force, Length, Speed, Stress};
use serde::Deserialize;

/// A region and its conditions.
#[derive(Clone, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Boundary {
    /// Name in curves and values; default: the side, or `box` and its number.
    pub name: Option<String>,
    /// A side of the body's bounding box …
    pub side: Option<Side>,
    /// … with this depth in particles; default: the horizon, rounded down …
    pub layers: Option<usize>,
    /// … or with this depth as a length: particles whose centres lie in it.
    pub depth: Option<Length>,
    /// Or a box: lower corner …
    pub min: Option<Vec<Length>>,
    /// … and upper corner.
    pub max: Option<Vec<Length>>,
    /// Or shapes, as those of the body.
    #[serde(default)]
    pub shapes: Vec<ShapeSpec>,
    /// Or a set of a mesh file of the body: particles in its cells, or within `layers` or `depth` of its
    /// faces and nodes.
    pub set: Option<String>,
    /// Traction on the side, applied as a uniform body force over its layers.
    pub traction: Option<Vec<Stress>>,
    /// Traction on the side as formulas of the reference position on it (m) and `t` (s), Pa.
    pub traction_field: Option<Vec<Formula>>,
    /// Pressure on the faces of the body in the region, across the deformed surface.
    pub pressure: Option<Stress>,
    /// Total force on the region, spread over its volume.
    pub force: Option<Vec<Force>>,
    /// Velocity at the start, in explicit dynamics.
    pub velocity: Option<Vec<Speed>>,
    /// Displacement at the end of the last step, component by component: a length, `"free"` or, in a later
    /// step, `"hold"`.
    pub displacement: Option<Vec<Prescribed>>,
    /// Moves the region as a whole, without rotation: components that `displacement` leaves free share one
    /// displacement, which follows from the forces on the region.
    #[serde(default)]
    pub rigid: bool,
    /// Rotation about an axis, along the arc; `displacement` adds to it.
    pub rotation: Option<RotationSpec>,
    /// Displacement at the end of the last step as formulas of the position, m.
    pub displacement_field: Option<Vec<PrescribedField>>,
    /// Curve of time that multiplies displacement, rotation, force, traction and pressure, or one for each
    /// component; default: the load factor.
    pub curve: Option<CurveList>,
    /// Velocity at the start as formulas of the position, m/s.
    pub velocity_field: Option<Vec<Formula>>,
}

impl Boundary {
    /// Returns true if the boundary prescribes displacements.
    pub fn prescribes_displacement(&self) -> bool {
        self.displacement.is_some() || self.displacement_field.is_some() || self.rotation.is_some()
    }

    /// Returns true if the boundary prescribes a component of the displacement.
    pub fn constrains(&self) -> bool {
        let held = self.displacement.iter().flatten().any(|u| *u != Prescribed::Free);
        let placed = self.displacement_field.iter().flatten().any(|u| !matches!(u, PrescribedField::Free));
        held || placed || self.rotation.is_some()
    }

    /// Returns the components that keep their displacement of the start of a step, a bit each.
    pub fn held_in_place(&self) -> u8 {
        let components = self.displacement.iter().flatten().enumerate();
        components.map(|(d, held)| u8::from(*held == Prescribed::Hold) << d).sum()
    }

    /// Returns true if the boundary prescribes forces.
    pub fn prescribes_force(&self) -> bool {
        let surface = self.traction.is_some() || self.traction_field.is_some() || self.pressure.is_some();
        surface || self.force.is_some()
    }

    /// Returns the key by which it holds or loads particles along an axis.
    pub fn acts_along(&self, d: usize) -> Option<&'static str> {
        let held = |list: &Vec<Prescribed>| list.get(d).is_some_and(|held| *held != Prescribed::Free);
        let formula = |list: &Vec<PrescribedField>| matches!(list.get(d), Some(PrescribedField::By(_)));
        let keys = [
            ("displacement", self.displacement.as_ref().is_some_and(held)),
            ("displacement_field", self.displacement_field.as_ref().is_some_and(formula)),
            (
                "traction",
                self.traction.as_ref().is_some_and(|list| list.get(d).is_some_and(|x| x.si() != 0.0)),
            ),
            ("traction_field", self.traction_field.as_ref().is_some_and(|list| d < list.len())),
            ("force", self.force.as_ref().is_some_and(|list| list.get(d).is_some_and(|x| x.si() != 0.0))),
        ];
        keys.into_iter().find_map(|(key, acts)| acts.then_some(key))
    }

    /// Returns the number of layers of particles that it takes at a side.
    pub fn layers_of(&self, spacing: f64, horizon_ratio: f64) -> usize {
        match (self.depth, self.layers) {
            // centres lie half a spacing inside
            (Some(depth), _) => (depth.si() / spacing + 0.5 + 1e-9).floor() as usize,
            (None, layers) => layers.unwrap_or(horizon_ratio.floor() as usize).max(1),
        }
    }

    /// Returns the key that gives its depth: `layers`, `depth` or none.
    pub fn depth_key(&self) -> Option<&'static str> {
        let keys = [("layers", self.layers.is_some()), ("depth", self.depth.is_some())];
        keys.into_iter().find_map(|(name, given)| given.then_some(name))
    }

    /// Returns true if the boundary prescribes velocities at the start.
    pub fn prescribes_velocity(&self) -> bool {
        self.velocity.is_some() || self.velocity_field.is_some()
    }
}

/// Rotation of a region about an axis; in a plane body about a point.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotationSpec {
    /// A point of the axis.
    pub point: Vec<Length>,
    /// Direction of the axis, of any length, in a solid.
    pub axis: Option<Vec<f64>>,
    /// Angle at the end of the last load step, from the undeformed region, right-handed about the axis; in
    /// the plane from x to y.
    pub angle: Angle,
    /// Curve of time that multiplies the angle; default: that of the boundary.
    pub curve: Option<CurveSpec>,
}

impl RotationSpec {
    /// Returns the rotation in space; a plane body turns about z.
    pub(super) fn in_space(&self) -> Rotation<3> {
        let centre = std::array::from_fn(|d| self.point.get(d).map_or(0.0, |x| x.si()));
        let axis = self.axis.as_deref().unwrap_or(&[0.0, 0.0, 1.0]);
        let size = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
        let axis = std::array::from_fn(|d| axis.get(d).map_or(0.0, |x| x / size));
        Rotation { centre, axis, angle: self.angle.si() }
    }
}

/// Sides of the bounding box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
pub enum Side {
    /// Smallest x.
    #[serde(rename = "x-")]
    XLow,
    /// Largest x.
    #[serde(rename = "x+")]
    XHigh,
    /// Smallest y.
    #[serde(rename = "y-")]
    YLow,
    /// Largest y.
    #[serde(rename = "y+")]
    YHigh,
    /// Smallest z.
    #[serde(rename = "z-")]
    ZLow,
    /// Largest z.
    #[serde(rename = "z+")]
    ZHigh,
}

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (axis, upper) = self.axis();
        write!(f, "{}{}", ["x", "y", "z"][axis], if upper { "+" } else { "-" })
    }
}

impl Side {
    /// Returns the index of the axis, and true for its upper end.
    pub fn axis(self) -> (usize, bool) {
        match self {
            Self::XLow => (0, false),
            Self::XHigh => (0, true),
            Self::YLow => (1, false),
            Self::YHigh => (1, true),
            Self::ZLow => (2, false),
            Self::ZHigh => (2, true),
        }
    }
}

/// A displacement component: prescribed or free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Prescribed {
    /// Not prescribed.
    Free,
    /// Prescribed, m.
    At(f64),
    /// Keeps its value at the start of the step.
    Hold,
}

impl schemars::JsonSchema for Prescribed {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Prescribed".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let length = generator.subschema_for::<Length>();
        schemars::json_schema!({
            "description": "a length; `free`: not prescribed; `hold`: as at the start of a later step",
            "anyOf": [{ "const": "free" }, { "const": "hold" }, length],
        })
    }
}

impl<'de> Deserialize<'de> for Prescribed {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let text = String::deserialize(from)?;
        if text.trim() == "free" {
            return Ok(Self::Free);
        }
        if text.trim() == "hold" {
            return Ok(Self::Hold);
        }
        let length = text.parse::<Length>().map_err(|error| {
            serde::de::Error::custom(format!("{error}; a component that is not prescribed is \"free\""))
        })?;
        Ok(Self::At(length.si()))
    }
}

/// A displacement component: prescribed by a formula, or free.
#[derive(Clone, Debug, PartialEq)]
pub enum PrescribedField {
    /// Not prescribed.
    Free,
    /// Prescribed, m.
    By(Formula),
}

impl schemars::JsonSchema for PrescribedField {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "PrescribedField".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let formula = generator.subschema_for::<Formula>();
        schemars::json_schema!({
            "description": "a formula of x, y, z (m), or `free`: not prescribed",
            "anyOf": [{ "const": "free" }, formula],
        })
    }
}

impl<'de> Deserialize<'de> for PrescribedField {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let text = String::deserialize(from)?;
        if text.trim() == "free" {
            return Ok(Self::Free);
        }
        Formula::parse(&text).map(Self::By).map_err(serde::de::Error::custom)
    }
}
