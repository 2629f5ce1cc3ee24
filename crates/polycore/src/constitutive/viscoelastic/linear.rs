//! Linear viscoelasticity: Prony series of measured moduli, and master curves.
//!
//! E(t) = E_∞ + Σ E_k exp(−t/τ_k), E′(ω) = E_∞ + Σ E_k (ωτ_k)²/(1 + (ωτ_k)²), E″(ω) = Σ E_k ωτ_k/(1 +
//! (ωτ_k)²): the small strains of branches of constant viscosity η_k = ν_k τ_k (formulation-time.md, section
//! C).
//!
//! ```
//! use polycore::constitutive::viscoelastic::linear::{PronySettings, fit_relaxation};
//!
//! // 1 MPa, and 2 MPa that relax in 3 s
//! let data: Vec<[f64; 2]> = (0..30)
//!     .map(|k| 0.1 * 1.3_f64.powi(k))
//!     .map(|t| [t, 1e6 + 2e6 * (-t / 3.0_f64).exp()])
//!     .collect();
//! let found = fit_relaxation(&data, &PronySettings::default())?;
//! assert_eq!(found.series.terms.len(), 1);
//! assert!((found.series.terms[0].time - 3.0).abs() < 1e-6);
//! # Ok::<(), polycore::constitutive::Error>(())
//! ```

mod master;
mod prony;

pub use master::{Isotherm, WlfFit, fit_wlf, shift_isotherms};
pub use prony::{PronyFit, PronySettings, fit_oscillation, fit_relaxation};

use super::{Branch, Spring, Viscosity};
use crate::constitutive::Error;
use crate::constitutive::hyperelastic::NeoHookean;

/// Prony series of a modulus.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Prony {
    /// Modulus after a long time, Pa; 0 for a melt.
    pub equilibrium: f64,
    /// The terms, from the shortest time.
    pub terms: Vec<PronyTerm>,
}

/// Term of a Prony series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PronyTerm {
    /// Modulus, Pa.
    pub modulus: f64,
    /// Relaxation time, s.
    pub time: f64,
}

impl Prony {
    /// Modulus at a time after a step of strain, Pa.
    pub fn relaxation(&self, time: f64) -> f64 {
        self.equilibrium + self.terms.iter().map(|term| term.modulus * (-time / term.time).exp()).sum::<f64>()
    }

    /// Storage and loss modulus, Pa, at a frequency in Hz, ω = 2πf.
    pub fn oscillation(&self, frequency: f64) -> [f64; 2] {
        let start = [self.equilibrium, 0.0];
        self.terms.iter().fold(start, |[storage, loss], term| {
            let x = std::f64::consts::TAU * frequency * term.time;
            let [own_storage, own_loss] = oscillation(x);
            [storage + term.modulus * own_storage, loss + term.modulus * own_loss]
        })
    }

    /// Modulus at once, Pa.
    pub fn instantaneous(&self) -> f64 {
        self.equilibrium + self.terms.iter().map(|term| term.modulus).sum::<f64>()
    }

    /// Neo-Hookean branches of constant viscosity. `share` is G/E: 1 for moduli in shear, 1/3 for moduli in
    /// tension of an incompressible body. With a finite bulk modulus K a series in E is not one in G of the
    /// same times: convert it first.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a share that is not above 0.
    pub fn branches(&self, share: f64) -> Result<Vec<Branch>, Error> {
        let branch = |term: &PronyTerm| {
            let modulus = share * term.modulus;
            let spring = Spring::NeoHookean(NeoHookean::new(modulus)?);
            Branch::new(spring, Viscosity::Constant(modulus * term.time))
        };
        self.terms.iter().map(branch).collect()
    }
}

/// x²/(1 + x²) and x/(1 + x²) of x = ωτ, without overflow.
fn oscillation(x: f64) -> [f64; 2] {
    if x > 1.0 {
        let y = x.recip();
        [1.0 / (1.0 + y * y), y / (1.0 + y * y)]
    } else {
        [x * x / (1.0 + x * x), x / (1.0 + x * x)]
    }
}
