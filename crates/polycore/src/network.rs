//! From chemistry to a bond law: modulus, chain length, sol fraction and fracture energy of a polymer
//! network.
//!
//! [`EndLinked`] (strands with a reactive group at either end, joined by cross-linkers of any
//! functionality) and [`Vulcanized`] (long chains, cross-linked at random) build a [`PolymerNetwork`]. The
//! structure is that of the recursive method of Miller and Macosko (1976), doi:10.1021/ma60050a003 and
//! doi:10.1021/ma60050a004: groups react independently and form no loops. Junctions fluctuate as in a
//! phantom network; trapped entanglements add to them (Langley 1968, doi:10.1021/ma60004a015; Pearson and
//! Graessley 1980).
//!
//! Not to be confused with [`crate::constitutive::network`], the neural networks of learnt laws.
//!
//! ```
//! use polycore::network::{EndLinked, Melt, Reacted};
//!
//! // silicone strands of 10 kg/mol, cross-linker of four groups, in balance, 95 % of the groups reacted
//! let silicone = EndLinked::new(4, 10.0, Reacted::Conversion(0.95)).network(&Melt::of_polymer("PDMS")?)?;
//! assert!((silicone.modulus() - 0.2613e6).abs() < 100.0, "{} Pa", silicone.modulus());
//! let [low, high] = silicone.fracture_energy().unwrap_or_default();
//! assert!(low > 4.0 && high < 30.0, "{low} to {high} J/m²");
//!
//! // half of the groups: no network
//! let sol = EndLinked::new(4, 10.0, Reacted::Conversion(0.5)).network(&Melt::of_polymer("PDMS")?);
//! assert!(sol.is_err_and(|error| error.to_string().starts_with("no gel: (f - 1) p_A p_B = 0.75")));
//! # Ok::<(), polycore::network::Error>(())
//! ```

mod chain;
#[cfg(feature = "tables")]
mod columns;
mod end_linked;
mod error;
mod linkers;
#[cfg(feature = "tables")]
pub mod prediction;
mod structure;
mod swelling;
#[cfg(feature = "tables")]
pub mod table;
mod vulcanized;

pub use chain::{BOND_ENERGIES, KNOWN_POLYMERS, KnownPolymer, KuhnChain, known_polymer};
pub use end_linked::{EndLinked, LOOP_FACTOR, Reacted};
pub use error::Error;
pub use linkers::LinkerMix;
pub use structure::{Melt, PolymerNetwork, SolFractions};
pub use swelling::Solvent;
pub use vulcanized::{PrimaryChains, Vulcanized};

/// Molar gas constant, J/(mol K); exact in SI.
pub const GAS_CONSTANT: f64 = 8.314_462_618_153_24;

/// Avogadro's number, 1/mol; exact in SI.
const AVOGADRO: f64 = 6.022_140_76e23;

/// Checks that a number is positive and finite.
fn positive(quantity: &'static str, value: f64) -> Result<f64, Error> {
    match value.is_finite() && value > 0.0 {
        true => Ok(value),
        false => Err(Error::Domain { quantity, value, allowed: "positive numbers" }),
    }
}

/// Checks that a number is finite and not negative.
fn not_negative(quantity: &'static str, value: f64) -> Result<f64, Error> {
    match value.is_finite() && value >= 0.0 {
        true => Ok(value),
        false => Err(Error::Domain { quantity, value, allowed: "0 and positive numbers" }),
    }
}
