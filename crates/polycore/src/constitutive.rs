//! Constitutive laws of solids behind one trait, [`Law`]: C → (W, S, ℂ).
//!
//! - [`hyperelastic`]: the isotropic laws of Chapter 1 in closed form, and their fits to tests of rubber;
//! - [`surrogate`]: models learnt from data (feature `surrogate`): networks, without a training framework;
//! - your own: implement [`Law`], or [`hyperelastic::Hyperelastic`] for an isotropic law of the principal
//!   stretches;
//! - [`viscoelastic`]: any of them as the equilibrium of a law with time, which has a state.
//!
//! [`verify`] measures how well any of them keeps what every law must keep.
//!
//! ```
//! use polycore::constitutive::hyperelastic::{Compressible, Gent, Volumetric};
//! use polycore::constitutive::{Law, Workspace};
//! use polycore::tensor::Voigt;
//!
//! let gent = Compressible::new(Gent::new(0.27e6, 80.0)?, Volumetric::Quadratic { lame: 10e6 })?;
//! let law: &dyn Law = &gent;
//! let mut memory = Workspace::default();
//! // C in the order 11, 22, 33, 12, 13, 23: a simple shear of 0.1
//! let found = law.tangent(&Voigt::new(1.0, 1.01, 1.0, 0.1, 0.0, 0.0), &mut memory)?;
//! assert!((found.stress[3] / 27e3 - 1.0).abs() < 0.02, "about the shear modulus times 0.1");
//! assert!(found.tangent.is_some() && found.energy.is_some() && !found.flags.any());
//! # Ok::<(), polycore::constitutive::Error>(())
//! ```

mod error;
mod isochoric;
mod law;

#[cfg(feature = "ndarray")]
pub mod arrays;
pub mod hyperelastic;
#[cfg(feature = "surrogate")]
pub mod network;
#[cfg(feature = "surrogate")]
pub mod surrogate;
pub mod verify;
pub mod viscoelastic;

pub use error::Error;
pub use isochoric::IsochoricSplit;
pub use law::{Flags, Law, Moduli, Prediction, Workspace};
