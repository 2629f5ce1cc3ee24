//! Strain and stress columns of a table, recognised by their headings.

use super::data::Mode;
use crate::table::{Error, Heading, Table, plainly};
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

/// Words that mark a quantity derived from a strain or stress, or another one than those of the test.
const DERIVED: [&str; 26] = [
    "lateral",
    "transverse",
    "thickness",
    "volumetric",
    "hydrostatic",
    "green",
    "almansi",
    "plastic",
    "permanent",
    "residual",
    "amplitude",
    "2nd",
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
            // Cauchy's strain is the engineering one
            let measure = match (has(&TRUE) && !has(&["cauchy"]), has(&NOMINAL) || lengthened) {
                (true, _) => Some(StrainMeasure::True),
                (_, true) => Some(StrainMeasure::Engineering),
                _ => None,
            };
            ColumnKind::Strain(measure)
        } else if has(&STRESSES) {
            // J = 1: Kirchhoff's stress Jσ is the true one
            let measure = match (has(&TRUE), has(&NOMINAL), has(&["kirchhoff"])) {
                (true, ..) | (_, false, true) => Some(TestStressMeasure::True),
                (_, true, _) => Some(TestStressMeasure::Nominal),
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
    let biaxial = has(&["equibiaxial", "equi", "biaxial"]);
    let planar = has(&["planar", "plane", "pt", "ps", "strip", "constrained"]) && !biaxial;
    if planar || (shear && has(&["pure"])) {
        Some((Mode::PureShear, compression))
    } else if shear && has(&["simple"]) || has(&["ss"]) {
        Some((Mode::SimpleShear, false))
    } else if shear {
        None
    } else if biaxial || has(&["eb", "et", "ebt", "bt", "inflation", "bulge"]) {
        Some((Mode::Equibiaxial, compression))
    } else if has(&["uniaxial", "ut", "uc", "tension", "tensile", "simple"]) || compression {
        Some((Mode::Uniaxial, compression))
    } else {
        None
    }
}

/// Column and its measure.
#[derive(Clone)]
pub(super) struct TestColumn<M> {
    pub column: usize,
    pub measure: M,
    /// True if the heading does not name the measure.
    pub assumed: bool,
    pub compressive: bool,
    pub unit: Option<String>,
}

const LAYOUTS: &str = "a strain (`stretch`, `strain [%]`) and a stress (`nominal [MPa]`), with a `mode` in \
                       each row if there are several tests, or `stretch_1`, `stretch_2`, `nominal_1 [MPa]`, \
                       `nominal_2 [MPa]`; torsion: `mode = \"torsion\"`, `radius`";

/// Column to be found.
pub(super) struct Wanted<'a, M> {
    pub key: &'static str,
    pub name: Option<&'a str>,
    pub measure: Option<M>,
    pub of: &'a dyn Fn(ColumnKind) -> Option<Option<M>>,
    pub order: &'a [M],
    pub assumed: M,
}

/// Finds a column of a table by the roles of its headings, on an axis if one is given.
///
/// # Errors
/// None or several such columns, one that is named and missing.
pub(super) fn choose<M: Copy + PartialEq>(
    file: &Table,
    roles: &[Option<Role>],
    axis: Option<usize>,
    wanted: &Wanted<M>,
) -> Result<TestColumn<M>, Error> {
    let key = wanted.key;
    let chosen = |column: usize, measure: Option<M>, role: Option<&Role>| TestColumn {
        column,
        measure: wanted.measure.or(measure).unwrap_or(wanted.assumed),
        assumed: wanted.measure.or(measure).is_none(),
        compressive: role.is_some_and(|role| role.compressive),
        unit: role.map_or_else(|| file.headings[column].unit.clone(), |role| role.unit.clone()),
    };
    if let Some(name) = wanted.name {
        let same = |i: &usize| {
            let heading = &file.headings[*i];
            heading.text == name || heading.name == name || heading.plain == plainly(name)
        };
        let number = name.parse::<usize>().ok().filter(|number| (1..=roles.len()).contains(number));
        let several = (0..roles.len()).filter(same).count() > 1;
        if several {
            let allowed =
                format!("the number of one of the columns `{name}` as `{key}_column`: \"1\" is the first");
            return Err(file.refuse_headings(allowed));
        }
        let Some(column) = (0..roles.len()).find(same).or(number.map(|number| number - 1)) else {
            return Err(file.refuse_headings(format!("the heading `{name}` of `{key}_column`")));
        };
        let role = roles[column].as_ref();
        return Ok(chosen(column, role.and_then(|role| (wanted.of)(role.what)).flatten(), role));
    }
    let all: Vec<(usize, Option<M>, &Role)> = roles
        .iter()
        .enumerate()
        .filter_map(|(i, role)| role.as_ref().map(|role| (i, role)))
        .filter(|(_, role)| axis.is_none() || role.axis == axis)
        .filter_map(|(i, role)| Some((i, (wanted.of)(role.what)?, role)))
        .collect();
    let of = |measure: Option<M>| all.iter().filter(move |one| one.1 == measure).collect::<Vec<_>>();
    // named measures in their order, then those that name none, then the last; the key before all
    let mut order: Vec<Option<M>> = wanted.order.iter().copied().map(Some).collect();
    order.insert(order.len() - 1, None);
    if let Some(asked) = wanted.measure {
        order.splice(0..0, [Some(asked), None]);
    }
    let found = order.into_iter().map(of).find(|found| !found.is_empty()).unwrap_or_default();
    match found[..] {
        [(column, measure, role)] => Ok(chosen(*column, *measure, Some(role))),
        [] => {
            let raw = roles.iter().flatten().any(|role| role.what == ColumnKind::Raw);
            let advice = "; divide forces by the undeformed area and displacements by the free length";
            Err(file.refuse_headings(format!("{LAYOUTS}{}", if raw { advice } else { "" })))
        }
        _ => Err(file.refuse_headings(format!(
            "one {key}, or `{key}_column = \"…\"` in the data's entry with one of these headings, or its \
             number"
        ))),
    }
}
