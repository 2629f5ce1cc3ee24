//! Parameters of the material that follow a field of another scene, such as the crystallinity of a printed part, as written in TOML.

use polycore::units::{Length, Time};
use serde::{Deserialize, Deserializer};
use std::fmt;
use std::path::PathBuf;

/// A parameter that follows a field of another scene; with `inclusions`, their stiffness multiplies it.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FieldSpec {
    /// The parameter, in the place of its value in `[material]`.
    pub of: Parameter,
    /// The field.
    pub from: FieldSource,
    /// Rows [value of the field, value of the parameter]; linear between them, an error outside. None of a `prestrain` from a stress tensor, which is
    /// to be there while the body is held in its shape.
    #[serde(default)]
    pub table: Vec<[Entry; 2]>,
    /// Where the body lies in the mesh of the field; default: as it is written.
    #[serde(default)]
    pub placement: FieldPlacement,
}

/// Parameters that can follow a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Parameter {
    /// `material.youngs_modulus`; a bond has the mean of its ends.
    YoungsModulus,
    /// `material.critical.fracture_energy`; a bond breaks as the weaker of its ends does.
    FractureEnergy,
    /// ε*: the strain that a particle would have if it were free, the same in all directions; a bond has the mean of its ends.
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

/// x of the mesh = `origin` + `scale` x of the body along each of `axes`.
#[derive(Clone, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FieldPlacement {
    /// Where the origin of the body lies in the mesh; default: its origin.
    pub origin: Option<[Length; 3]>,
    /// Axes of the mesh along which those of the body lie; default: the same ones.
    pub axes: Option<Vec<MeshAxis>>,
    /// Length in the mesh over length in the body; default: 1.
    pub scale: Option<f64>,
    /// Of a plane body: the range along the third axis over which the mean is taken; default: the whole mesh.
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
    /// Its number and sign.
    pub fn of(self) -> (usize, f64) {
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

impl Parameter {
    /// Name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::YoungsModulus => "youngs-modulus",
            Self::FractureEnergy => "fracture-energy",
            Self::Prestrain => "prestrain",
        }
    }

    /// Name in reports.
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
pub enum Entry {
    /// Without a unit.
    Number(f64),
    /// With one.
    Text(String),
}

impl<'de> Deserialize<'de> for Entry {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl serde::de::Visitor<'_> for Visitor {
            type Value = Entry;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number, or a text with a unit such as \"1.6 GPa\"")
            }
            fn visit_f64<E>(self, value: f64) -> Result<Entry, E> {
                Ok(Entry::Number(value))
            }
            fn visit_i64<E>(self, value: i64) -> Result<Entry, E> {
                Ok(Entry::Number(value as f64))
            }
            fn visit_str<E>(self, text: &str) -> Result<Entry, E> {
                Ok(Entry::Text(text.to_owned()))
            }
        }
        from.deserialize_any(Visitor)
    }
}

impl schemars::JsonSchema for Entry {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Entry".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "description": "a number, or a text with a unit", "type": ["number", "string"] })
    }
}
