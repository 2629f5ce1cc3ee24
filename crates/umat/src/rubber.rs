//! Hyperelastic laws under the deformations of a host.

use crate::Error;
use polycore::constitutive::hyperelastic::{
    COMPRESSIBLE_MODELS, Compressible, Hyperelastic, MODELS, ModelKind, Volumetric, any_model,
};
use polycore::constitutive::{Law, Workspace};
use polycore::tensor::voigt::{self, Voigt, Voigt6x6};
use polycore::tensor::{DeformationGradient, Tensor};

/// Law with a bulk modulus, W₀(λ₁, λ₂, λ₃) − g ln J + ¼λ(J² − 1 − 2 ln J), or a foam.
pub struct RubberMaterial {
    law: Compressible<Box<dyn Hyperelastic>>,
}

/// Keys of the laws.
pub(crate) fn names() -> Vec<&'static str> {
    MODELS.iter().chain(COMPRESSIBLE_MODELS).map(|model| model.key).collect()
}

/// Number of constants of a law: its parameters and K, of a foam its parameters alone.
pub(crate) fn count(key: &str) -> Result<usize, Error> {
    let descriptor = any_model(key).map_err(|error| Error::new(key, "no such law", error))?;
    Ok(descriptor.parameters.len() + usize::from(descriptor.kind != ModelKind::Compressible))
}

/// Builds a law as [`RubberMaterial::new`] does.
pub(crate) fn law(key: &str, constants: &[f64]) -> Result<Compressible<Box<dyn Hyperelastic>>, Error> {
    let wrong = |error: polycore::constitutive::Error| Error::new(key, format!("{constants:?}"), error);
    let descriptor = any_model(key).map_err(wrong)?;
    let names: Vec<&str> = descriptor.parameters.iter().map(|parameter| parameter.name).collect();
    let law = |parameters: &[f64]| descriptor.law(parameters).map_err(wrong);
    if descriptor.kind == ModelKind::Compressible {
        return Compressible::new(law(constants)?, Volumetric::None).map_err(wrong);
    }
    let allowed = format!("K, {}", names.join(", "));
    let Some((&bulk, parameters)) = constants.split_first().filter(|(_, rest)| rest.len() == names.len())
    else {
        return Err(Error::new(format!("constants of {key}"), format!("{constants:?}"), allowed));
    };
    let bare = Compressible::new(law(parameters)?, Volumetric::None).and_then(|law| law.bulk_modulus());
    let bare = bare.map_err(wrong)?;
    let lame = bulk - bare;
    if !(lame.is_finite() && lame > 0.0) {
        return Err(Error::new("K", bulk, format!("above {bare}, that of the law alone")));
    }
    Compressible::new(law(parameters)?, Volumetric::Ciarlet { lame }).map_err(wrong)
}

impl RubberMaterial {
    /// Creates a law by its key; constants are the bulk modulus K at small strains, then the parameters of
    /// the law, stresses in the host's unit; of a foam its parameters alone.
    ///
    /// # Errors
    /// An unknown key; constants out of range, too few or too many; K below that of the law without a
    /// volumetric term.
    pub fn new(key: &str, constants: &[f64]) -> Result<Self, Error> {
        Ok(Self { law: law(key, constants)? })
    }

    /// Computes S and ℂ = 2 ∂S/∂C at C, in the order 11, 22, 33, 12, 13, 23.
    ///
    /// # Errors
    /// A C that is not positive definite, chains beyond their limit.
    pub fn material(&self, c: &Voigt) -> Result<(Voigt, Voigt6x6), Error> {
        let prediction = self.law.tangent(c, &mut Workspace::default()).map_err(stretched)?;
        Ok((prediction.stress, prediction.tangent.unwrap_or_default()))
    }

    /// Computes the Cauchy stress and the tangent of its Jaumann rate ([`voigt::jaumann_tangent`]) at F, nine
    /// numbers column by column.
    ///
    /// # Errors
    /// As [`Self::material`]; det F ≤ 0.
    pub fn cauchy(&self, f: &[f64; 9]) -> Result<(Voigt, Voigt6x6), Error> {
        self.stored(f).map(|(stress, tangent, _)| (stress, tangent))
    }

    /// Computes the Cauchy stress and tangent as [`Self::cauchy`], and the stored energy W/J per deformed
    /// volume, in the host's unit of stress.
    ///
    /// # Errors
    /// As [`Self::cauchy`].
    pub fn stored(&self, f: &[f64; 9]) -> Result<(Voigt, Voigt6x6, f64), Error> {
        let f = DeformationGradient::new(Tensor::from_column_slice(f)).map_err(stretched)?;
        let c = voigt::from_stress(&f.right_cauchy_green());
        let found = self.law.tangent(&c, &mut Workspace::default()).map_err(stretched)?;
        let (s, tangent) = (found.stress, found.tangent.unwrap_or_default());
        let energy = found.energy.unwrap_or_default() / f.jacobian();
        Ok((voigt::cauchy_from_material(&f, &s), voigt::jaumann_tangent(&f, &s, &tangent), energy))
    }
}

pub(crate) fn stretched(error: impl std::fmt::Display) -> Error {
    Error::new("deformation", error, "where the law has a stress")
}
