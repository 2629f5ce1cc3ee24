//! Shared ground of the polymer-mechanics toolkit: tensors, Langevin statistics, constitutive laws, units, scenes, reports
//! and output.
//!
//! ```
//! use polycore::constitutive::hyperelastic::{EightChain, homogeneous::uniaxial};
//! use polycore::langevin::inverse;
//! use polycore::units::Stress;
//!
//! // the eight-chain law fitted to Treloar's rubber, which at this stretch took 1.56 MPa
//! let modulus: Stress = "0.273 MPa".parse()?;
//! let law = EightChain::new(modulus.si(), 25.46)?;
//! let nominal = uniaxial(&law, 4.852)?;
//! assert!((nominal / 1e6 - 1.5617).abs() < 0.2, "{nominal} Pa");
//!
//! // the inverse Langevin function is exact: 𝓛(𝓛⁻¹(x)) = x
//! let beta = inverse(0.9);
//! assert!((1.0 / beta.tanh() - 1.0 / beta - 0.9).abs() < 1e-15);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[cfg(feature = "case")]
pub mod case;
#[cfg(feature = "case")]
pub mod checkpoint;
pub mod constitutive;
pub mod error;
pub mod langevin;
pub mod memory;
pub mod numerics;
pub mod output;
pub mod posterior;
pub mod random;
#[cfg(feature = "case")]
pub mod report;
#[cfg(feature = "case")]
pub mod scene;
#[cfg(feature = "tables")]
pub mod table;
pub mod tensor;
pub mod transfer;
pub mod units;
#[cfg(feature = "view")]
pub mod view;

pub use error::Error;
