//! Values written as a string or a table, with errors at their place in the scene.

use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeOwned, Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;
use std::marker::PhantomData;

/// Value that a scene can write as a string or a table.
pub trait TextOrTable: Sized {
    /// Type of the table.
    type Table: DeserializeOwned;

    /// Describes both forms, for error messages.
    fn expected() -> String;

    /// Parses the string.
    ///
    /// # Errors
    /// Fails on a text that has neither form.
    fn from_text<E: Error>(text: &str) -> Result<Self, E>;

    /// Converts the table.
    fn from_table(table: Self::Table) -> Self;
}

/// Deserializes either form, for `#[serde(deserialize_with = …)]` or a `Deserialize` implementation.
///
/// # Errors
/// Returns the errors of the deserializer.
pub fn deserialize<'de, T: TextOrTable, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    deserializer.deserialize_any(TextOrTableVisitor(PhantomData))
}

struct TextOrTableVisitor<T>(PhantomData<T>);

impl<'de, T: TextOrTable> Visitor<'de> for TextOrTableVisitor<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&T::expected())
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<T, E> {
        T::from_text(text)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
        T::Table::deserialize(MapAccessDeserializer::new(map)).map(T::from_table)
    }
}
