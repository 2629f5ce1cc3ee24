//! Errors of networks: compositions without a network, and numbers without a meaning.

use super::KNOWN_POLYMERS;

/// Error of a composition.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The composition is at or below its gel point.
    #[error("no gel: {product} = {value:.4}, and a network needs more than {least}; {advice}")]
    NoGel {
        /// Product that the gel point limits, as it is written.
        product: &'static str,
        /// Value found.
        value: f64,
        /// Value at the gel point.
        least: f64,
        /// Change that helps.
        advice: &'static str,
    },
    /// Conversion above one, of the groups A or of the groups B, which react in pairs.
    #[error(
        "conversion p_A = {conversion} with r = {ratio}: p_B = r p_A = {:.4} is above 1; p_A is at most \
         {:.4}",
        ratio * conversion, 1.0_f64.min(1.0 / ratio)
    )]
    TooManyReacted {
        /// Conversion of the groups A.
        conversion: f64,
        /// Groups A per group B.
        ratio: f64,
    },
    /// Sol fraction that no conversion gives.
    #[error(
        "sol fraction {sol}: with r = {ratio} at least {least:.4} stays soluble (at p_A = {conversion:.4}, \
         the largest); check r, the purity of the strands and the extraction"
    )]
    TooLittleSol {
        /// Measured sol fraction.
        sol: f64,
        /// Least sol fraction.
        least: f64,
        /// Groups A per group B.
        ratio: f64,
        /// Largest conversion of the groups A.
        conversion: f64,
    },
    /// Number outside its range.
    #[error("{quantity} = {value} is outside {allowed}")]
    Domain {
        /// The quantity.
        quantity: &'static str,
        /// Value found.
        value: f64,
        /// Allowed values.
        allowed: &'static str,
    },
    /// Polymer without data.
    #[error("unknown polymer `{0}`; known: {known}", known = names())]
    UnknownPolymer(String),
    /// Property that the table of polymers lacks.
    #[error("the {property} of {polymer} is not in the table; give it")]
    Missing {
        /// The polymer.
        polymer: &'static str,
        /// The property.
        property: &'static str,
    },
    /// Strand shorter than the segments of which statistics are made.
    #[error(
        "{segments:.3} Kuhn segments between junctions: too few for a chain, which takes more than {least}"
    )]
    TooShort {
        /// Kuhn segments of an effective strand.
        segments: f64,
        /// Least number.
        least: f64,
    },
}

fn names() -> String {
    KNOWN_POLYMERS.iter().map(|polymer| polymer.name).collect::<Vec<_>>().join(", ")
}
