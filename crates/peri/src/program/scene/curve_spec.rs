//! Curves of time as a scene writes them.

use super::formula::Formula;
use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use std::fmt;
use std::path::PathBuf;

/// Curve of time.
#[derive(Clone, Debug)]
pub enum CurveSpec {
    /// Formula of the time `t`, s.
    Formula(Formula),
    /// Columns of a file.
    Table(CurveTable),
}

/// Columns of a file, between whose rows the curve is linear.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CurveTable {
    /// Table with headings (`time [s],pull [mm]`).
    pub file: PathBuf,
    /// Name of the column of times.
    pub time: String,
    /// Name of the column of multiples; one with a unit multiplies values of 1 in this unit.
    pub value: String,
}

/// Curve of all components, or of each.
#[derive(Clone, Debug)]
pub enum CurveList {
    /// The same for all components.
    All(CurveSpec),
    /// Curves of the components.
    Each(Vec<CurveSpec>),
}

struct CurveVisitor;

impl<'de> serde::de::Visitor<'de> for CurveVisitor {
    type Value = CurveList;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(
            "a formula of `t`, a table `{ file, time, value }`, or a list with one for each component",
        )
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<CurveList, E> {
        Formula::parse(text).map(|formula| CurveList::All(CurveSpec::Formula(formula))).map_err(E::custom)
    }

    fn visit_map<A: serde::de::MapAccess<'de>>(self, map: A) -> Result<CurveList, A::Error> {
        let table = CurveTable::deserialize(MapAccessDeserializer::new(map))?;
        Ok(CurveList::All(CurveSpec::Table(table)))
    }

    fn visit_seq<A: serde::de::SeqAccess<'de>>(self, list: A) -> Result<CurveList, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(list)).map(CurveList::Each)
    }
}

impl<'de> Deserialize<'de> for CurveList {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(CurveVisitor)
    }
}

impl<'de> Deserialize<'de> for CurveSpec {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        match CurveList::deserialize(from)? {
            CurveList::All(curve) => Ok(curve),
            CurveList::Each(_) => {
                Err(serde::de::Error::custom("found a list; allowed: a formula or a table"))
            }
        }
    }
}

impl schemars::JsonSchema for CurveSpec {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "CurveSpec".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let (formula, table) =
            (generator.subschema_for::<Formula>(), generator.subschema_for::<CurveTable>());
        schemars::json_schema!({
            "description": "a formula of t (s), or a table of a file",
            "anyOf": [formula, table],
        })
    }
}

impl schemars::JsonSchema for CurveList {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "CurveList".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let curve = generator.subschema_for::<CurveSpec>();
        schemars::json_schema!({
            "description": "a curve, or one for each component",
            "anyOf": [curve, { "type": "array", "items": curve }],
        })
    }
}
