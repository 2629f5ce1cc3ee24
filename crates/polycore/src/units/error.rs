//! Errors of reading quantities.

use super::{Dimension, Exponents, name_of};

/// Error of a text that is not the required quantity.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnitError {
    /// Empty text.
    #[error("empty; a number with a unit is needed")]
    Empty,
    /// The text does not begin with a number.
    #[error("`{text}` does not begin with a number{hint}")]
    NoNumber {
        /// The whole text.
        text: String,
        /// A remark on the likely cause, or empty.
        hint: &'static str,
    },
    /// A number where a unit is needed.
    #[error("`{text}` has no unit; {name} is needed, e.g. \"{example}\"")]
    Bare {
        /// The whole text.
        text: String,
        /// Quantity needed, with its article.
        name: &'static str,
        /// A valid input.
        example: &'static str,
    },
    /// A symbol that is not in the table.
    #[error("unknown unit `{unit}` in `{text}`{}", suggestion.as_ref().map(|s| format!("; did you mean \
        `{s}`?")).unwrap_or_default())]
    Unknown {
        /// The symbol.
        unit: String,
        /// The whole text.
        text: String,
        /// The nearest known symbol.
        suggestion: Option<String>,
    },
    /// A unit expression that cannot be read.
    #[error("cannot read the unit in `{text}`: {problem}")]
    Grammar {
        /// The whole text.
        text: String,
        /// Defect of the unit.
        problem: String,
    },
    /// Another dimension than the one needed.
    #[error("`{text}` is {found}; {needed} is needed, e.g. \"{example}\"")]
    Dimension {
        /// The whole text.
        text: String,
        /// Quantity found, with its article.
        found: String,
        /// Quantity needed, with its article.
        needed: &'static str,
        /// A valid input.
        example: &'static str,
    },
    /// `degC` outside an absolute temperature.
    #[error("`{text}`: `{unit}` is for absolute temperatures only; for differences and rates use K")]
    Affine {
        /// The whole text.
        text: String,
        /// The unit.
        unit: String,
    },
    /// NaN, infinity, overflow, underflow, or below absolute zero.
    #[error("`{text}` {problem}")]
    Range {
        /// The whole text.
        text: String,
        /// Defect of the number.
        problem: &'static str,
    },
}

impl UnitError {
    pub(super) fn bare<D: Dimension>(text: &str) -> Self {
        Self::Bare { text: text.into(), name: D::NAME, example: D::EXAMPLE }
    }

    pub(super) fn affine(text: &str, unit: &str) -> Self {
        Self::Affine { text: text.into(), unit: unit.into() }
    }

    pub(super) fn dimension<D: Dimension>(text: &str, found: Exponents) -> Self {
        Self::Dimension { text: text.into(), found: name_of(found), needed: D::NAME, example: D::EXAMPLE }
    }
}
