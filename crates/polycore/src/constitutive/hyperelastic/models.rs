//! List of all laws, for scenes, fits and checks.

use super::descriptor::ModelDescriptor;
use super::{
    Compressible, Coupling, Error, Hyperelastic, Volumetric, chain, gent, lopez_pamies, ogden, polynomial,
    yeoh,
};

/// All laws of Chapter 1, the √I₂ extension, and the laws of Yeoh and of Lopez-Pamies.
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
];

/// Returns the model with this key.
///
/// # Errors
/// [`Error::UnknownLaw`].
pub fn model(key: &str) -> Result<&'static ModelDescriptor, Error> {
    MODELS.iter().find(|model| model.key == key).ok_or_else(|| Error::UnknownLaw { name: key.to_owned() })
}

/// Every law with its example parameters: the incompressible forms, then each with both volumetric terms,
/// then the compressible forms as printed. The shared check runs over this list.
///
/// # Errors
/// None in practice: a test checks that the examples are valid.
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
