//! Lines through bodies, along which values are written as a table.

use serde::Deserialize;
use std::path::Path;

use super::{SceneError, Source};
use crate::output::csv;
use polycore::Error;
use polycore::units::Length;

/// Points of a line at most.
const MOST_POINTS: usize = 100_000;
/// Characters of a name at most: with what is added it must still name a file.
const MOST_CHARACTERS: usize = 64;

/// A straight line through a body at rest, along which fields are written at the end of the run.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineSpec {
    /// Name, a part of the name of its file.
    pub name: String,
    /// First end.
    pub from: Vec<Length>,
    /// Second end.
    pub to: Vec<Length>,
    /// Points at equal distances, with both ends.
    #[serde(default = "points")]
    pub points: usize,
    /// Fields or their components; default: all but first Piola–Kirchhoff stresses.
    pub fields: Option<Vec<String>>,
}

fn points() -> usize {
    101
}

/// Checks a name that may be part of a file's name and of a value's.
///
/// # Errors
/// Other characters than letters, digits, `-` and `_`, none, or more than 64.
pub fn check_name(source: &Source, key: &str, name: &str) -> Result<(), SceneError> {
    let valid = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if (1..=MOST_CHARACTERS).contains(&name.len()) && name.chars().all(valid) {
        return Ok(());
    }
    let allowed = format!("1 to {MOST_CHARACTERS} letters, digits, `-` and `_`: it names files");
    Err(source.error(key, format!("`{name}`"), allowed))
}

impl LineSpec {
    /// Checks the lines at `output.line` of a body of `dimension`, of which `columns` can be written.
    ///
    /// # Errors
    /// A [`SceneError`] that names the key, the value found and what is allowed.
    pub fn check(
        lines: &[Self],
        source: &Source,
        dimension: usize,
        columns: &[String],
    ) -> Result<(), SceneError> {
        // `displacement` stands for all that begin with `displacement_`
        let mut known: Vec<&str> = Vec::new();
        for column in columns {
            let starts = column.match_indices('_').map(|(end, _)| &column[..end]);
            known.extend(starts.chain([column.as_str()]));
        }
        known.sort_unstable();
        known.dedup();
        for (index, line) in lines.iter().enumerate() {
            let key = |name: &str| format!("output.line[{index}].{name}");
            check_name(source, &key("name"), &line.name)?;
            if lines[..index].iter().any(|other| other.name == line.name) {
                return Err(source.error(&key("name"), format!("`{}` twice", line.name), "different names"));
            }
            for (name, end) in [("from", &line.from), ("to", &line.to)] {
                if end.len() != dimension {
                    let found = format!("{} components", end.len());
                    return Err(source.error(&key(name), found, format!("{dimension} components")));
                }
            }
            if line.from.iter().zip(&line.to).all(|(a, b)| a.si() == b.si()) {
                return Err(source.error(&key("to"), "the same point as `from`", "another point"));
            }
            if !(2..=MOST_POINTS).contains(&line.points) {
                return Err(source.error(&key("points"), line.points, format!("2 to {MOST_POINTS}")));
            }
            if line.fields.as_ref().is_some_and(Vec::is_empty) {
                return Err(source.error(&key("fields"), "an empty list", "at least one field"));
            }
            for (number, field) in line.fields.iter().flatten().enumerate() {
                if !known.contains(&field.as_str()) {
                    return Err(source.unknown(&key(&format!("fields[{number}]")), field, &known));
                }
            }
        }
        Ok(())
    }

    /// Returns whether a column is written; `by_default` if the scene names no fields.
    pub fn wants(&self, column: &str, by_default: bool) -> bool {
        let of = |field: &String| {
            column.strip_prefix(field.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with('_'))
        };
        self.fields.as_ref().map_or(by_default, |fields| fields.iter().any(of))
    }

    /// Returns the points, m, after [`Self::check`].
    pub fn places<const D: usize>(&self) -> Vec<[f64; D]> {
        let ends = [&self.from, &self.to].map(|end| -> [f64; D] { std::array::from_fn(|d| end[d].si()) });
        let last = (self.points - 1) as f64;
        let at = |k: usize| -> [f64; D] {
            let part = k as f64 / last;
            std::array::from_fn(|d| (1.0 - part) * ends[0][d] + part * ends[1][d])
        };
        (0..self.points).map(at).collect()
    }

    /// Refuses a line of which no point lies `inside` the body.
    ///
    /// # Errors
    /// The line at `index`.
    pub fn refuse_outside(&self, source: &Source, index: usize, inside: bool) -> Result<(), SceneError> {
        let found = "a line of which no point lies in the body";
        let fault = || source.error(&format!("output.line[{index}].from"), found, "a line through the body");
        if inside { Ok(()) } else { Err(fault()) }
    }

    /// Writes arc length, reference position and columns of values; NaN leaves a cell empty.
    ///
    /// # Errors
    /// As [`csv::write`].
    pub fn write<const D: usize>(
        &self,
        path: &Path,
        columns: &[(String, &str, Vec<f64>)],
    ) -> Result<(), Error> {
        let places = self.places::<D>();
        let from = places.first().copied().unwrap_or([0.0; D]);
        let arc = |x: &[f64; D]| (0..D).map(|d| (x[d] - from[d]).powi(2)).sum::<f64>().sqrt();
        let mut table = vec![("arc_length", "m", places.iter().map(arc).collect::<Vec<f64>>())];
        for (d, axis) in ["x", "y", "z"].into_iter().take(D).enumerate() {
            table.push((axis, "m", places.iter().map(|x| x[d]).collect()));
        }
        let own = table.iter().map(|(name, unit, values)| (*name, *unit, values.as_slice()));
        let more = columns.iter().map(|(name, unit, values)| (name.as_str(), *unit, values.as_slice()));
        csv::write_with_gaps(path, &own.chain(more).collect::<Vec<_>>())
    }
}
