//! Mathematics of the polymer-mechanics toolkit: tensors, Langevin statistics, constitutive laws and their
//! fits, networks from their chemistry, units, transfer of fields.
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

pub mod constitutive;
pub mod error;
#[cfg(feature = "files")]
pub mod file;
#[cfg(feature = "hdf5")]
pub mod hdf5;
pub mod langevin;
pub mod memory;
pub mod network;
pub mod numerics;
pub mod posterior;
pub mod random;
#[cfg(feature = "tables")]
pub mod table;
pub mod tensor;
pub mod transfer;
pub mod units;

pub use error::Error;
