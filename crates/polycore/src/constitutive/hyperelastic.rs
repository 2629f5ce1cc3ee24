//! Hyperelastic laws of Chapter 1: energy, stresses, consistent tangent, homogeneous responses, and fits to
//! data.
//!
//! A law is isotropic: its energy per unit reference volume is a symmetric function W(λ₁, λ₂, λ₃) of the
//! principal stretches, zero at rest. It implements [`Hyperelastic`] in principal values; everything in three
//! dimensions is provided from there. The incompressible laws leave the pressure open: what they return as
//! stress is the part that W determines, S = 2 ∂W/∂C. [`Compressible`] adds the volumetric terms of (1.19),
//! (1.21), (1.23), and [`homogeneous`] eliminates the pressure in tension tests.
//!
//! ```
//! use polycore::constitutive::hyperelastic::{EightChain, Hyperelastic, homogeneous};
//! // Nkθ = 0.27 MPa, 25 links a chain
//! let law = EightChain::new(0.27e6, 25.0)?;
//! let nominal = homogeneous::uniaxial(&law, 3.0)?;
//! assert!((nominal / law.shear_modulus() - 3.0671409).abs() < 1e-6);
//! # Ok::<(), polycore::constitutive::Error>(())
//! ```

use super::Error;
use crate::tensor::deformation::check_stretches;
use crate::tensor::{DeformationGradient, PrincipalFrame, Tensor, Voigt6x6, voigt};

mod ansys_reader;
mod arruda_boyce;
mod chain;
mod compressible;
mod descriptor;
mod extended_tube;
mod fit_map;
mod general_polynomial;
mod gent;
mod hyperfoam;
mod lopez_pamies;
mod models;
mod ogden;
mod ogden_project;
mod ogden_starts;
mod polynomial;
mod principal;

pub mod bulk;
#[cfg(feature = "tables")]
mod columns;
#[cfg(feature = "tables")]
mod components;
mod coverage;
#[cfg(feature = "tables")]
mod curves;
pub mod data;
pub mod deck;
mod deck_keywords;
pub mod deck_reader;
pub mod fit;
pub mod foam;
#[cfg(feature = "tables")]
mod foam_table;
pub mod forecast;
#[cfg(feature = "tables")]
mod heading_test;
pub mod homogeneous;
pub mod host;
mod host_reader;
#[cfg(feature = "tables")]
mod plausible;
pub mod ranking;
pub mod stability;
#[cfg(feature = "tables")]
mod table;
pub mod torsion;
mod torsion_check;
#[cfg(feature = "tables")]
mod torsion_table;
mod van_der_waals;
#[cfg(feature = "tables")]
mod weights;
mod yeoh;

pub use arruda_boyce::ArrudaBoyce;
pub use chain::{EightChain, EightChainRootI2, ThreeChain};
#[cfg(feature = "tables")]
pub use columns::{StrainMeasure, TestStressMeasure};
pub use compressible::{Compressible, Coupling, Volumetric};
pub use coverage::Coverage;
pub use descriptor::{Domain, ModelDescriptor, ModelKind, Parameter};
pub use extended_tube::ExtendedTube;
pub use general_polynomial::Polynomial;
pub use gent::Gent;
pub use homogeneous::{PlaneStress, plane_stress};
pub use hyperfoam::{FoamTerm, Hyperfoam};
pub use lopez_pamies::LopezPamies;
pub use models::{COMPRESSIBLE_MODELS, MODELS, all, any_model, model};
pub use ogden::{Ogden, OgdenConvention};
pub use polynomial::{MooneyRivlin, NeoHookean};
pub use principal::PrincipalResponse;
#[cfg(feature = "tables")]
pub use table::{ImportedTest, TestFormat};
pub use torsion::TwistedCylinder;
pub use torsion_check::{HELD_STRETCHES, check_torques};
#[cfg(feature = "tables")]
pub use torsion_table::TestCylinder;
pub use van_der_waals::VanDerWaals;
#[cfg(feature = "tables")]
pub use weights::Deviation;
pub use yeoh::Yeoh;

/// An isotropic hyperelastic law. Stresses and moduli in Pa, energies in J/m³.
pub trait Hyperelastic: Send + Sync {
    /// Name of the law, for tables and messages.
    fn name(&self) -> String;

    /// Names and values of the parameters, in the order of the constructor.
    fn parameters(&self) -> Vec<(String, f64)>;

    /// Shear modulus of the small-strain limit.
    fn shear_modulus(&self) -> f64;

    /// W(λ₁, λ₂, λ₃) with W(1, 1, 1) = 0.
    ///
    /// # Errors
    /// [`Error::Locked`] at or beyond a locking stretch, [`Error::Overflow`] where W leaves the range of
    /// `f64`.
    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error>;

    /// Stress and tangent in the principal frame.
    ///
    /// # Errors
    /// As [`Hyperelastic::energy_at`].
    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error>;

    /// Factor g of −g ln J in the compressible form of the thesis; `None` if the thesis has none.
    fn published_coupling(&self) -> Option<f64> {
        None
    }

    /// W(F).
    ///
    /// # Errors
    /// As [`Hyperelastic::energy_at`].
    fn energy(&self, deformation: &DeformationGradient) -> Result<f64, Error> {
        self.energy_at(deformation.principal_stretches())
    }

    /// S = 2 ∂W/∂C (1.14), PK2.
    ///
    /// # Errors
    /// As [`Hyperelastic::energy_at`].
    fn second_piola_kirchhoff(&self, deformation: &DeformationGradient) -> Result<Tensor, Error> {
        let (frame, response) = principal(self, deformation)?;
        Ok(frame.referential_tensor(response.stress))
    }

    /// P = ∂W/∂F = FS (1.13), PK1.
    ///
    /// # Errors
    /// As [`Hyperelastic::energy_at`].
    fn first_piola_kirchhoff(&self, deformation: &DeformationGradient) -> Result<Tensor, Error> {
        let (frame, response) = principal(self, deformation)?;
        Ok(frame.two_point_tensor(std::array::from_fn(|i| frame.stretches[i] * response.stress[i])))
    }

    /// σ = FSFᵀ/J.
    ///
    /// # Errors
    /// As [`Hyperelastic::energy_at`].
    fn cauchy(&self, deformation: &DeformationGradient) -> Result<Tensor, Error> {
        let (frame, response) = principal(self, deformation)?;
        let [a, b, c] = frame.stretches;
        // λ² S/J with the products ordered so that extreme stretches do not overflow on the way
        let factors = [a / b / c, b / c / a, c / a / b];
        Ok(frame.spatial_tensor(std::array::from_fn(|i| factors[i] * response.stress[i])))
    }

    /// Material tangent ℂ = 2 ∂S/∂C as a 6×6 matrix with the rules of [`crate::tensor::voigt`]. Pa.
    ///
    /// # Errors
    /// As [`Hyperelastic::energy_at`].
    fn material_tangent(&self, deformation: &DeformationGradient) -> Result<Voigt6x6, Error> {
        let (frame, response) = principal(self, deformation)?;
        Ok(voigt::transform_tangent(&response.tangent(), &frame.referential))
    }
}

impl<L: Hyperelastic + ?Sized> Hyperelastic for Box<L> {
    fn name(&self) -> String {
        (**self).name()
    }
    fn parameters(&self) -> Vec<(String, f64)> {
        (**self).parameters()
    }
    fn shear_modulus(&self) -> f64 {
        (**self).shear_modulus()
    }
    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        (**self).energy_at(stretches)
    }
    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        (**self).response_at(stretches)
    }
    fn published_coupling(&self) -> Option<f64> {
        (**self).published_coupling()
    }
}

fn principal<L: Hyperelastic + ?Sized>(
    law: &L,
    deformation: &DeformationGradient,
) -> Result<(PrincipalFrame, PrincipalResponse), Error> {
    let frame = deformation.principal_frame();
    let response = law.response_at(frame.stretches)?;
    Ok((frame, response))
}

/// Returns `value` if it satisfies the rule, the error otherwise.
fn parameter(
    law: &'static str,
    parameter: &str,
    value: f64,
    valid: bool,
    allowed: &'static str,
) -> Result<f64, Error> {
    if value.is_finite() && valid {
        Ok(value)
    } else {
        Err(Error::Parameter { law, parameter: parameter.to_owned(), value, allowed })
    }
}

fn positive(law: &'static str, name: &str, value: f64) -> Result<f64, Error> {
    parameter(law, name, value, value > 0.0, "(0, ∞)")
}

/// Returns an error if an energy left the range of `f64`.
fn finite(law: &'static str, stretches: [f64; 3], energy: f64) -> Result<f64, Error> {
    check_stretches(&stretches)?;
    if energy.is_finite() { Ok(energy) } else { Err(Error::Overflow { law, stretches }) }
}

#[cfg(test)]
mod limits_tests;
#[cfg(test)]
mod tests;
