//! Values that may be written as a text or as a table, without losing the place of an error.

use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeOwned, Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;
use std::marker::PhantomData;

/// What is written either way.
pub trait TextOrTable: Sized {
    /// The table.
    type Table: DeserializeOwned;

    /// Both ways, for messages.
    fn expected() -> String;

    /// From a text.
    ///
    /// # Errors
    /// What is wrong with it.
    fn from_text<E: Error>(text: &str) -> Result<Self, E>;

    /// From a table.
    fn from_table(table: Self::Table) -> Self;
}

/// For `#[serde(deserialize_with = …)]` or a hand-written `Deserialize`.
///
/// # Errors
/// The deserializer's.
pub fn deserialize<'de, T: TextOrTable, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    deserializer.deserialize_any(Either(PhantomData))
}

struct Either<T>(PhantomData<T>);

impl<'de, T: TextOrTable> Visitor<'de> for Either<T> {
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
