//! Expectations of a case, and their judgement.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use super::{Value, number};
use polycore::units::Ratio;

/// An expectation, written in a scene as
///
/// ```toml
/// [[expect]]
/// quantity = "stress_concentration"   # a scalar of the report, or a quotient of two: "NAME / NAME"
/// reference = 3.0
/// tolerance = "1 %"                   # of |reference|; or a number in the unit of the value
/// kind = "closed-form"                # what kind of evidence the figure is: see [`Kind`]
/// source = "Kirsch (1898), infinite plate"
/// quick = false                       # optional: not judged in --quick runs
/// ```
///
/// or with `at_most = …` and/or `at_least = …` instead of `reference` and `tolerance`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(try_from = "Written", into = "Written")]
pub struct Expect {
    /// The name of a scalar of the report, or a quotient of two: `peak[a] / peak[b]`.
    pub quantity: String,
    /// Accepted range.
    pub bound: Bound,
    /// Kind of evidence.
    pub kind: Kind,
    /// Source of the figure and its tolerance.
    pub source: String,
    /// Judged in `--quick` runs too.
    pub quick: bool,
    /// The bar is known to be missed: the run passes as long as it is, and shows it.
    pub missed: bool,
}

/// Kind of evidence of an expectation.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// A measurement.
    Measured,
    /// A formula, a series or a count that follows from the problem's statement.
    ClosedForm,
    /// A figure of the literature or of a benchmark.
    Published,
    /// A figure of a program that shares no code with this one.
    IndependentProgram,
    /// An observed order, or a change under refinement.
    Convergence,
    /// An inequality that any correct result satisfies: a maximum principle, a balance, a range.
    Bound,
    /// An earlier figure of this program: it detects changes and is no evidence.
    Regression,
}

impl Kind {
    /// All kinds, the strongest evidence first.
    pub const ALL: [Self; 7] = [
        Self::Measured,
        Self::ClosedForm,
        Self::Published,
        Self::IndependentProgram,
        Self::Convergence,
        Self::Bound,
        Self::Regression,
    ];

    /// Returns its name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::ClosedForm => "closed-form",
            Self::Published => "published",
            Self::IndependentProgram => "independent-program",
            Self::Convergence => "convergence",
            Self::Bound => "bound",
            Self::Regression => "regression",
        }
    }

    /// Returns whether a verdict may rest on it: all but our own earlier figures.
    pub fn is_evidence(self) -> bool {
        self != Self::Regression
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The accepted range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// `|value - reference| <= tolerance`.
    Near {
        /// The figure to reproduce.
        reference: f64,
        /// The accepted distance.
        tolerance: Tolerance,
    },
    /// `at_least <= value <= at_most`.
    Range {
        /// Lower bound, or none.
        at_least: Option<f64>,
        /// Upper bound, or none.
        at_most: Option<f64>,
    },
}

/// Accepted distance of a value from its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// A share of |reference|: `"1 %"`.
    Relative(f64),
    /// Distance in the unit of the value: `"0.01"` or `0.01`.
    Absolute(f64),
}

impl Tolerance {
    /// Returns the accepted distance from `reference`.
    pub fn distance(self, reference: f64) -> f64 {
        match self {
            Self::Relative(share) => share * reference.abs(),
            Self::Absolute(distance) => distance,
        }
    }
}

impl FromStr for Tolerance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = text.parse::<Ratio>().map_err(|error| error.to_string())?.si();
        if number < 0.0 {
            return Err(format!("tolerance `{text}` is negative"));
        }
        let relative = text.trim_end().ends_with(['%', '‰']);
        Ok(if relative { Self::Relative(number) } else { Self::Absolute(number) })
    }
}

impl fmt::Display for Tolerance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // twelve digits: as it was written
            Self::Relative(share) => {
                let percent = share * 100.0;
                write!(f, "{} %", format!("{percent:.12e}").parse().unwrap_or(percent))
            }
            Self::Absolute(distance) => write!(f, "{distance}"),
        }
    }
}

impl schemars::JsonSchema for Tolerance {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Tolerance".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        Ratio::json_schema(generator)
    }
}

impl Serialize for Tolerance {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Tolerance {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl de::Visitor<'_> for Visitor {
            type Value = Tolerance;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a tolerance like \"1 %\" (of the reference) or \"0.01\" (absolute)")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Tolerance, E> {
                text.parse().map_err(E::custom)
            }

            fn visit_f64<E: de::Error>(self, value: f64) -> Result<Tolerance, E> {
                value.to_string().parse().map_err(E::custom)
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<Tolerance, E> {
                self.visit_f64(value as f64)
            }

            fn visit_u64<E: de::Error>(self, value: u64) -> Result<Tolerance, E> {
                self.visit_f64(value as f64)
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

/// The keys as they stand in a scene.
#[derive(Clone, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Expect")]
struct Written {
    /// The name of a scalar of the report, or a quotient of two: `peak[a] / peak[b]`.
    quantity: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    /// The figure to reproduce, with `tolerance`.
    reference: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    /// `"1 %"` of the reference, or a number in the unit of the value.
    tolerance: Option<Tolerance>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    /// Instead of a reference: a lower bound.
    at_least: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    /// Instead of a reference: an upper bound.
    at_most: Option<f64>,
    /// Kind of evidence.
    kind: Kind,
    /// Source of the figure and its tolerance.
    source: String,
    #[serde(default = "default_true")]
    /// Judged in `--quick` runs too.
    quick: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    /// The bar is known to be missed: the run passes as long as it is, and shows it as missed.
    missed: bool,
}

fn default_true() -> bool {
    true
}

impl TryFrom<Written> for Expect {
    type Error = String;

    fn try_from(written: Written) -> Result<Self, String> {
        let Written { quantity, reference, tolerance, at_least, at_most, kind, source, quick, missed } =
            written;
        for (name, number) in [("reference", reference), ("at_least", at_least), ("at_most", at_most)] {
            if let Some(number) = number.filter(|number| !number.is_finite()) {
                return Err(format!("expectation of `{quantity}`: {name} = {number} is not finite"));
            }
        }
        if source.trim().is_empty() {
            return Err(format!(
                "expectation of `{quantity}`: `source` is empty; say where the figure comes from"
            ));
        }
        let bound = match (reference, tolerance, at_least, at_most) {
            (Some(reference), Some(tolerance), None, None) => Bound::Near { reference, tolerance },
            (None, None, Some(low), Some(high)) if low > high => {
                return Err(format!(
                    "expectation of `{quantity}`: at_least = {low} exceeds at_most = {high}"
                ));
            }
            (None, None, at_least, at_most) if at_least.or(at_most).is_some() => {
                Bound::Range { at_least, at_most }
            }
            _ => {
                return Err(format!(
                    "expectation of `{quantity}`: give `reference` and `tolerance`, or `at_least`, `at_most` \
                     or both"
                ));
            }
        };
        Ok(Self { quantity, bound, kind, source, quick, missed })
    }
}

impl From<Expect> for Written {
    fn from(expect: Expect) -> Self {
        let Expect { quantity, bound, kind, source, quick, missed } = expect;
        let (reference, tolerance, at_least, at_most) = match bound {
            Bound::Near { reference, tolerance } => (Some(reference), Some(tolerance), None, None),
            Bound::Range { at_least, at_most } => (None, None, at_least, at_most),
        };
        Self { quantity, reference, tolerance, at_least, at_most, kind, source, quick, missed }
    }
}

impl Expect {
    /// Returns the scalars that it needs: one name, or the two of a quotient.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.quantity.split(QUOTIENT)
    }

    /// Compares with what the report holds under the name or names.
    pub(super) fn judge(&self, values: &BTreeMap<String, Value>) -> Judgement {
        let found = self.names().map(|name| scalar(values, name)).collect::<Result<Vec<f64>, String>>();
        let (value, message) = match found.as_deref() {
            Ok([value]) => (Some(*value), None),
            Ok([over, under]) => (Some(over / under), None),
            Ok(_) => (None, Some("a quotient has two names".to_owned())),
            Err(message) => (None, Some(message.clone())),
        };
        let not_finite =
            value.filter(|value| !value.is_finite()).map(|value| format!("the value is {value}"));
        let message = message.or(not_finite);
        let within = |value: f64| match self.bound {
            Bound::Near { reference, tolerance } => {
                (value - reference).abs() <= tolerance.distance(reference)
            }
            Bound::Range { at_least, at_most } => {
                at_least.is_none_or(|low| value >= low) && at_most.is_none_or(|high| value <= high)
            }
        };
        let met = value.map(within);
        let stale = (self.missed && met == Some(true)).then(|| "the bar is met: remove `missed`".to_owned());
        let message = message.or(stale);
        let pass = message.is_none() && met.is_some_and(|met| met != self.missed);
        Judgement { expect: self.clone(), value, pass, message }
    }
}

/// Between the names of a quotient.
const QUOTIENT: &str = " / ";

fn scalar(values: &BTreeMap<String, Value>, name: &str) -> Result<f64, String> {
    match values.get(name) {
        Some(Value::Scalar { value, .. }) => Ok(*value),
        Some(Value::Curve { .. }) => Err("the report has a curve of that name, not a scalar".to_owned()),
        None => Err("the report has no value of that name".to_owned()),
    }
}

/// An expectation with the value of the report.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Judgement {
    /// The requirement.
    #[serde(flatten)]
    pub expect: Expect,
    /// Value of the report.
    #[serde(with = "number::option")]
    pub value: Option<f64>,
    /// True if the expectation is met, or missed as it states.
    pub pass: bool,
    /// Reason if there is no value to compare.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
}

impl Judgement {
    /// Returns true for a bar that is missed as the scene states.
    pub fn is_known_miss(&self) -> bool {
        self.pass && self.expect.missed
    }

    /// Returns a row of a table: verdict, quantity, value, requirement, source.
    pub fn row(&self) -> [String; 5] {
        let verdict = match (self.pass, self.expect.missed) {
            (true, false) => "pass",
            (true, true) => "miss",
            (false, _) => "FAIL",
        };
        let value = match (&self.message, self.value) {
            (Some(message), _) => message.clone(),
            (None, value) => value.map(number::short).unwrap_or_default(),
        };
        let asked = match self.expect.bound {
            Bound::Near { reference, tolerance } => {
                // ± in the form the author chose
                format!("{} ± {tolerance}", number::short(reference))
            }
            Bound::Range { at_least, at_most } => {
                let low = at_least.map(|low| format!("≥ {}", number::short(low)));
                let high = at_most.map(|high| format!("≤ {}", number::short(high)));
                low.into_iter().chain(high).collect::<Vec<_>>().join(", ")
            }
        };
        [verdict.into(), self.expect.quantity.clone(), value, asked, self.expect.source.clone()]
    }
}
