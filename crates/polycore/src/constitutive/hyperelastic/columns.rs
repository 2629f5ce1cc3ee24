//! Strain and stress columns of a table, recognised by their headings.

use super::data::Mode;
use crate::table::{Heading, plainly};
use crate::units::Unit;
use crate::units::dimension::{RatioDimension, StressDimension};

/// Measures of the extension of a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum StrainMeasure {
    /// λ = l/L, 1 at rest.
    Stretch,
    /// λ − 1.
    Engineering,
    /// ln λ.
    True,
}

/// Measures of the stress of a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum TestStressMeasure {
    /// Force over undeformed area, P (PK1, "engineering").
    Nominal,
    /// Force over deformed area, σ = λP.
    True,
}

/// Role of a column, read from its heading.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Role {
    pub what: ColumnKind,
    /// Index of the axis: 0 for `stretch_1`, 1 for `stretch_2`.
    pub axis: Option<usize>,
    /// True if the axis is a number, which may also number a specimen.
    pub numbered: bool,
    /// True if stresses are positive in compression.
    pub compressive: bool,
    /// Unit; `None` if the heading has none.
    pub unit: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum ColumnKind {
    /// Strain; the heading may name the measure.
    Strain(Option<StrainMeasure>),
    /// Stress; the heading may name the measure.
    Stress(Option<TestStressMeasure>),
    /// Name of a test.
    Mode,
    /// Force or displacement.
    Raw,
}

/// Words that mark a quantity derived from a strain or stress.
const DERIVED: [&str; 14] = [
    "rate",
    "modulus",
    "energy",
    "error",
    "std",
    "sd",
    "deviation",
    "pk2",
    "second",
    "offset",
    "yield",
    "break",
    "limit",
    "gauge",
];
const STRETCHES: [&str; 7] = ["stretch", "lambda", "λ", "lambda1", "lambda2", "λ1", "λ2"];
const STRAINS: [&str; 6] = ["strain", "dehnung", "ε", "eps", "epsilon", "stauchung"];
const ELONGATIONS: [&str; 5] = ["elongation", "extension", "displacement", "traverse", "verlängerung"];
const STRESSES: [&str; 8] = ["stress", "nominal", "pk1", "p", "σ", "sigma", "spannung", "druckspannung"];
const FORCES: [&str; 5] = ["force", "load", "kraft", "standardkraft", "prüfkraft"];
const TRUE: [&str; 6] = ["true", "cauchy", "log", "logarithmic", "hencky", "wahre"];
const NOMINAL: [&str; 8] = ["engineering", "eng", "nominal", "technical", "pk1", "p", "piola", "technische"];

/// Headings of columns with names of tests; all but the first count only if the cells are such names.
pub(super) const MODES: [&str; 9] = [
    "mode",
    "test",
    "test type",
    "type",
    "loading",
    "load case",
    "deformation",
    "deformation mode",
    "experiment",
];

impl Role {
    /// Returns the role that a heading names, or `None` if it names none.
    pub fn from_heading(heading: &Heading) -> Option<Self> {
        let (plain, unit) = suffixed(heading);
        let words: Vec<&str> = plain.split(' ').collect();
        let has = |list: &[&str]| words.iter().any(|word| list.contains(word));
        let axis = match words.last() {
            Some(&("1" | "x" | "11" | "lambda1" | "λ1")) if words.len() > 1 || has(&STRETCHES) => Some(0),
            Some(&("2" | "y" | "22" | "lambda2" | "λ2")) if words.len() > 1 || has(&STRETCHES) => Some(1),
            _ => None,
        };
        let ratio = unit
            .as_deref()
            .is_none_or(|unit| Unit::<RatioDimension>::parse(&crate::table::plain_unit(unit)).is_ok());
        let lengthened = has(&ELONGATIONS) && unit.is_some() && ratio;
        let what = if has(&DERIVED) {
            return None;
        } else if MODES.contains(&plain.as_str()) {
            ColumnKind::Mode
        } else if has(&STRETCHES) {
            ColumnKind::Strain(Some(StrainMeasure::Stretch))
        } else if has(&STRAINS) || lengthened {
            let measure = match (has(&TRUE), has(&NOMINAL) || lengthened) {
                (true, _) => Some(StrainMeasure::True),
                (_, true) => Some(StrainMeasure::Engineering),
                _ => None,
            };
            ColumnKind::Strain(measure)
        } else if has(&STRESSES) {
            let measure = match (has(&TRUE), has(&NOMINAL)) {
                (true, _) => Some(TestStressMeasure::True),
                (_, true) => Some(TestStressMeasure::Nominal),
                _ => None,
            };
            ColumnKind::Stress(measure)
        } else if has(&FORCES) || has(&ELONGATIONS) {
            ColumnKind::Raw
        } else {
            return None;
        };
        let compressive = words
            .iter()
            .any(|word| ["compress", "stauch", "druck"].iter().any(|start| word.starts_with(start)));
        let numbered = matches!(words.last(), Some(&("1" | "2")));
        Some(Self { what, axis, numbered, compressive, unit })
    }
}

/// Splits the heading into its plain name and the unit, which may follow a `_`: `nominal_1_N/mm^2`.
pub(super) fn suffixed(heading: &Heading) -> (String, Option<String>) {
    for (at, _) in heading.text.match_indices('_') {
        let (name, unit) = (&heading.text[..at], &heading.text[at + 1..]);
        let percent = unit == "%" || unit == "pct" || unit == "percent";
        if percent || Unit::<StressDimension>::parse(&crate::table::plain_unit(unit)).is_ok() {
            return (plainly(name), Some(unit.to_owned()));
        }
    }
    (heading.plain.clone(), heading.unit.clone())
}

/// Reads the name of a test from a cell; true if it is compression.
pub(super) fn mode(cell: &str) -> Option<(Mode, bool)> {
    let plain = plainly(cell);
    let words: Vec<&str> = plain.split(' ').collect();
    let has = |list: &[&str]| words.iter().any(|word| list.contains(word));
    let compression = words.iter().any(|word| word.starts_with("compress")) || has(&["uc"]);
    let shear = has(&["shear", "ps"]);
    if has(&["planar", "plane", "pt", "ps", "strip", "constrained"]) || (shear && has(&["pure"])) {
        Some((Mode::PureShear, compression))
    } else if shear && has(&["simple"]) || has(&["ss"]) {
        Some((Mode::SimpleShear, false))
    } else if shear {
        None
    } else if has(&["equibiaxial", "equi", "biaxial", "eb", "et", "ebt", "bt", "inflation", "bulge"]) {
        Some((Mode::Equibiaxial, compression))
    } else if has(&["uniaxial", "ut", "uc", "tension", "tensile", "simple"]) || compression {
        Some((Mode::Uniaxial, compression))
    } else {
        None
    }
}
