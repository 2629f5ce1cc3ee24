//! Descriptors of laws: names, constructors, and starting points of fits.

use std::cell::Cell;

use super::data::TestData;
use super::{Error, Hyperelastic};

type Build = fn(&[f64]) -> Result<Box<dyn Hyperelastic>, Error>;

/// Law as a function of its parameters. To add one: a file, and its name in [`super::MODELS`].
#[derive(Debug, Clone, Copy)]
pub struct ModelDescriptor {
    /// The name in scenes and reports.
    pub key: &'static str,
    /// Category of the law.
    pub kind: ModelKind,
    /// Names, units and domains of the parameters.
    pub parameters: &'static [Parameter],
    /// Constructor from as many parameters as [`ModelDescriptor::parameters`]; see [`ModelDescriptor::law`].
    pub(super) build: Build,
    /// Plausible values for a rubber.
    pub example: &'static [f64],
    /// Starting points of fits.
    pub(super) starts: fn(&FitStart<'_>) -> Vec<Vec<f64>>,
    /// Laws that this one contains at some parameters: it fits no worse than they do.
    pub(super) contains: &'static [Contained],
    /// Nominal stresses and their derivatives with respect to the parameters, if known in closed form.
    pub(super) slopes: Option<Slopes>,
    /// Moves parameters along valleys in which the optimiser of all parameters is slow.
    pub(super) refine: Option<Refine>,
}

/// Maps parameters to better ones.
pub(super) type Refine = fn(&[f64], &FitStart<'_>) -> Vec<f64>;

/// Law contained in another one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contained {
    /// Key of the inner law.
    pub key: &'static str,
    /// Maps the best parameters of the inner law to those of the outer law at which both agree (or cannot be
    /// distinguished), followed by more starting points.
    pub embed: fn(&[f64], &FitStart<'_>) -> Vec<Vec<f64>>,
}

/// Computes P₁, P₂ and their derivatives with respect to each parameter, from the parameters and λ₁, λ₂.
pub(super) type Slopes = fn(&[f64], [f64; 2], &mut [[f64; 2]]) -> [f64; 2];

/// Share of the modulus below which a term is absent.
pub(super) const ABSENT: f64 = 1e-17;

/// Excess of a locking limit over its least value, relative, beyond which data cannot tell it from infinity.
pub(super) const UNLIMITED: f64 = 1e6;

/// Category of a law (§1.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// Written in invariants or stretches, chosen to fit data.
    Phenomenological,
    /// Derived from the statistics of a network of chains.
    Micromechanical,
    /// Foam: with a bulk modulus of its own.
    Compressible,
}

/// Data available before a fit.
pub(super) struct FitStart<'a> {
    /// Lower limit of each parameter.
    pub limits: &'a [f64],
    /// The best neo-Hookean modulus, Pa.
    pub modulus: f64,
    /// The data.
    pub table: &'a TestData,
    /// Returns true if the user asks the fit to stop.
    pub stop: &'a dyn Fn() -> bool,
    /// Number of evaluations of all residuals so far.
    pub evaluations: &'a Cell<usize>,
}

/// A material parameter.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Name of the parameter.
    pub name: &'static str,
    /// `Pa` or `1`.
    pub unit: &'static str,
    /// Admissible values.
    pub domain: Domain,
}

/// The domain of a parameter in a fit.
#[derive(Debug, Clone, Copy)]
pub enum Domain {
    /// (−∞, ∞).
    Real,
    /// (0, ∞).
    Positive,
    /// Locking limit: above the largest value of this function of the stretches in the data.
    Above(fn([f64; 3]) -> f64),
}

impl ModelDescriptor {
    /// Builds the law with these parameters (SI, in the order of [`ModelDescriptor::parameters`]).
    ///
    /// # Errors
    /// [`Error::Parameter`]; [`Error::Data`] for a wrong number of parameters.
    pub fn law(&self, parameters: &[f64]) -> Result<Box<dyn Hyperelastic>, Error> {
        if parameters.len() != self.parameters.len() {
            return Err(Error::Data {
                what: format!("law `{}`", self.key),
                reason: format!("{} parameters given, {} needed", parameters.len(), self.parameters.len()),
            });
        }
        (self.build)(parameters)
    }
}
