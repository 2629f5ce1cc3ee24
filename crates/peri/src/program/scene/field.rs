//! Specification of material parameters that follow a field of another scene, such as the crystallinity of a
//! part.

use polycore::units::{Length, Time};
use serde::{Deserialize, Deserializer};
use std::fmt;
use std::path::PathBuf;

/// A parameter that follows a field of another scene; with `inclusions`, their stiffness multiplies it.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FieldSpec {
    /// Parameter whose value in `[material]` the field replaces.
    pub of: VaryingParameter,
    /// The field.
    pub from: FieldSource,
    /// Rows [value of the field, value of the parameter]; linear between them, an error outside. Empty for a
    /// `prestrain` from a stress tensor: the stress while the body is held in its shape.
    #[serde(default)]
    pub table: Vec<[TableEntry; 2]>,
    /// Placement of the body in the mesh of the field; default: equal coordinates.
    #[serde(default)]
    pub placement: FieldPlacement,
}

/// Parameters that can follow a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum VaryingParameter {
    /// `material.youngs_modulus`; a bond has the mean of its ends.
    YoungsModulus,
    /// `material.critical.fracture_energy`; a bond takes the weaker of its ends.
    FractureEnergy,
    /// Strain ε* of a free particle, equal in all directions; a bond has the mean of its ends.
    Prestrain,
}

/// A field over the nodes or the cells of a mesh.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FieldSource {
    /// Name of a scene in `[inputs]`.
    pub input: String,
    /// Name of the array, with or without its unit.
    pub field: String,
    /// The time of the step; default: the last.
    pub time: Option<Time>,
    /// File in the folder of the results; default: `fields.vtkhdf`.
    pub file: Option<PathBuf>,
}

/// Coordinates of the mesh = `origin` + `scale` × those of the body along each of `axes`.
#[derive(Clone, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FieldPlacement {
    /// Origin of the body in the mesh; default: the origin of the mesh.
    pub origin: Option<[Length; 3]>,
    /// Axes of the mesh along the axes of the body; default: x, y, z.
    pub axes: Option<Vec<MeshAxis>>,
    /// Length in the mesh over length in the body; default: 1.
    pub scale: Option<f64>,
    /// Range along the third axis for the mean in a plane body; default: the whole mesh.
    pub depth: Option<[Length; 2]>,
}

/// An axis of a mesh, or its opposite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
pub enum MeshAxis {
    /// First.
    #[serde(rename = "x")]
    X,
    /// Second.
    #[serde(rename = "y")]
    Y,
    /// Third.
    #[serde(rename = "z")]
    Z,
    /// Against the first.
    #[serde(rename = "-x")]
    MinusX,
    /// Against the second.
    #[serde(rename = "-y")]
    MinusY,
    /// Against the third.
    #[serde(rename = "-z")]
    MinusZ,
}

impl MeshAxis {
    /// Returns its index and sign.
    pub fn index_and_sign(self) -> (usize, f64) {
        match self {
            Self::X => (0, 1.0),
            Self::Y => (1, 1.0),
            Self::Z => (2, 1.0),
            Self::MinusX => (0, -1.0),
            Self::MinusY => (1, -1.0),
            Self::MinusZ => (2, -1.0),
        }
    }
}

impl VaryingParameter {
    /// Returns the name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::YoungsModulus => "youngs-modulus",
            Self::FractureEnergy => "fracture-energy",
            Self::Prestrain => "prestrain",
        }
    }

    /// Returns the name in reports.
    pub fn value_name(self) -> &'static str {
        match self {
            Self::YoungsModulus => "youngs_modulus",
            Self::FractureEnergy => "fracture_energy",
            Self::Prestrain => "prestrain",
        }
    }
}

/// A number, or a text with a unit.
#[derive(Clone, Debug, PartialEq)]
pub enum TableEntry {
    /// Number without unit.
    Number(f64),
    /// Text with a unit.
    Text(String),
}

impl<'de> Deserialize<'de> for TableEntry {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl serde::de::Visitor<'_> for Visitor {
            type Value = TableEntry;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number, or a text with a unit such as \"1.6 GPa\"")
            }
            fn visit_f64<E>(self, value: f64) -> Result<TableEntry, E> {
                Ok(TableEntry::Number(value))
            }
            fn visit_i64<E>(self, value: i64) -> Result<TableEntry, E> {
                Ok(TableEntry::Number(value as f64))
            }
            fn visit_str<E>(self, text: &str) -> Result<TableEntry, E> {
                Ok(TableEntry::Text(text.to_owned()))
            }
        }
        from.deserialize_any(Visitor)
    }
}

impl schemars::JsonSchema for TableEntry {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "TableEntry".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "description": "a number, or a text with a \
            unit", "type": ["number", "string"] })
    }
}
