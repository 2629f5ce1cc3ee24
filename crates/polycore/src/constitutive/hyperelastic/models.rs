//! The list of laws: how each is named, built from numbers, and started in a fit.

use super::data::Table;
use super::{Compressible, Coupling, Error, Hyperelastic, Volumetric, chain, gent, ogden, polynomial};

type Build = fn(&[f64]) -> Result<Box<dyn Hyperelastic>, Error>;

/// A law as a function of its parameters. To add one: a file, and its name in [`MODELS`].
#[derive(Debug, Clone, Copy)]
pub struct ModelDescriptor {
    /// The name in scenes and reports.
    pub key: &'static str,
    /// Where it comes from.
    pub kind: Kind,
    /// Names, units and domains of the parameters.
    pub parameters: &'static [Parameter],
    /// The law with the given parameters, as many as [`ModelDescriptor::parameters`]; see [`ModelDescriptor::law`].
    pub(super) build: Build,
    /// Plausible values for a rubber.
    pub example: &'static [f64],
    /// Where fits start.
    pub(super) starts: fn(&Start<'_>) -> Vec<Vec<f64>>,
}

/// The thesis' two categories of laws (§1.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// In invariants or stretches, chosen to fit.
    Phenomenological,
    /// From the statistics of a network of chains.
    Micromechanical,
}

/// What is known before a fit.
pub(super) struct Start<'a> {
    /// Lower limit of each parameter.
    pub limits: &'a [f64],
    /// The best neo-Hookean modulus, Pa.
    pub modulus: f64,
    /// The data.
    pub table: &'a Table,
}

/// A material parameter.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Its name.
    pub name: &'static str,
    /// `Pa` or `1`.
    pub unit: &'static str,
    /// Where it may lie.
    pub domain: Domain,
}

/// The domain of a parameter in a fit.
#[derive(Debug, Clone, Copy)]
pub enum Domain {
    /// (−∞, ∞).
    Real,
    /// (0, ∞).
    Positive,
    /// Above the largest value of this function of the stretches in the data: a locking limit.
    Above(fn([f64; 3]) -> f64),
}

/// Every law of Chapter 1, and the √I₂ extension.
pub const MODELS: &[ModelDescriptor] = &[
    polynomial::NEO_HOOKEAN,
    polynomial::MOONEY_RIVLIN,
    gent::GENT,
    ogden::OGDEN_1,
    ogden::OGDEN_2,
    ogden::OGDEN_3,
    chain::THREE_CHAIN,
    chain::EIGHT_CHAIN,
    chain::EIGHT_CHAIN_ROOT_I2,
];

impl ModelDescriptor {
    /// The law with these parameters (SI, in the order of [`ModelDescriptor::parameters`]).
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

/// The model of that name.
///
/// # Errors
/// [`Error::UnknownLaw`].
pub fn model(key: &str) -> Result<&'static ModelDescriptor, Error> {
    MODELS.iter().find(|model| model.key == key).ok_or_else(|| Error::UnknownLaw { name: key.to_owned() })
}

/// Every law with its example parameters: the incompressible forms, then each with both volumetric terms, then the
/// compressible forms as printed. The shared check runs over this list.
///
/// # Errors
/// None in practice: the examples are valid, and a test holds them to it.
pub fn all() -> Result<Vec<Box<dyn Hyperelastic>>, Error> {
    let mut laws: Vec<Box<dyn Hyperelastic>> = Vec::new();
    for model in MODELS {
        laws.push(model.law(model.example)?);
    }
    let lame = 2.0e6;
    let volumetrics =
        [Volumetric::Quadratic { lame }, Volumetric::Logarithmic { lame }, Volumetric::Ciarlet { lame }];
    for model in MODELS {
        for volumetric in volumetrics {
            laws.push(Box::new(Compressible::new(model.law(model.example)?, volumetric)?));
        }
    }
    for model in MODELS {
        let law = model.law(model.example)?;
        if law.published_coupling().is_some() {
            laws.push(Box::new(Compressible::with_coupling(law, volumetrics[0], Coupling::AsPublished)?));
        }
    }
    let gent = model("gent")?;
    let printed =
        Compressible::with_coupling(gent.law(gent.example)?, Volumetric::None, Coupling::AsPublished)?;
    laws.push(Box::new(printed));
    Ok(laws)
}
