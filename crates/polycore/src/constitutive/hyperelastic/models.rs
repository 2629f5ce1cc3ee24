//! List of all laws, for scenes, fits and checks.

use super::descriptor::ModelDescriptor;
use super::{
    Compressible, Coupling, Error, Hyperelastic, Volumetric, arruda_boyce, chain, extended_tube,
    general_polynomial, gent, hyperfoam, lopez_pamies, ogden, polynomial, van_der_waals, yeoh,
};

/// All laws of Chapter 1, the √I₂ extension, and laws of finite-element programs.
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
    yeoh::YEOH,
    lopez_pamies::LOPEZ_PAMIES,
    general_polynomial::REDUCED_POLYNOMIAL_2,
    general_polynomial::REDUCED_POLYNOMIAL_4,
    general_polynomial::REDUCED_POLYNOMIAL_5,
    general_polynomial::REDUCED_POLYNOMIAL_6,
    general_polynomial::POLYNOMIAL_2,
    general_polynomial::POLYNOMIAL_3,
    general_polynomial::BIDERMAN_4,
    arruda_boyce::ARRUDA_BOYCE,
    extended_tube::EXTENDED_TUBE,
    van_der_waals::VAN_DER_WAALS,
];

/// Laws with a bulk modulus of their own; tests at constant volume do not determine it, so [`super::fit`]
/// refuses them and [`super::foam`] fits them.
pub const COMPRESSIBLE_MODELS: &[ModelDescriptor] =
    &[hyperfoam::HYPERFOAM_1, hyperfoam::HYPERFOAM_2, hyperfoam::HYPERFOAM_3];

/// Returns the model of [`MODELS`] or [`COMPRESSIBLE_MODELS`] with this key.
///
/// # Errors
/// [`Error::UnknownLaw`].
pub fn any_model(key: &str) -> Result<&'static ModelDescriptor, Error> {
    COMPRESSIBLE_MODELS.iter().find(|model| model.key == key).map_or_else(|| model(key), Ok)
}

/// Returns the model of [`MODELS`] with this key.
///
/// # Errors
/// [`Error::UnknownLaw`].
pub fn model(key: &str) -> Result<&'static ModelDescriptor, Error> {
    MODELS.iter().find(|model| model.key == key).ok_or_else(|| Error::UnknownLaw { name: key.to_owned() })
}

/// Every law with its example parameters: the incompressible forms, the foams, then each incompressible form
/// with each volumetric term, then the compressible forms as printed. The shared check runs over this list.
///
/// # Errors
/// None in practice: a test checks that the examples are valid.
pub fn all() -> Result<Vec<Box<dyn Hyperelastic>>, Error> {
    let mut laws: Vec<Box<dyn Hyperelastic>> = Vec::new();
    for model in MODELS.iter().chain(COMPRESSIBLE_MODELS) {
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
