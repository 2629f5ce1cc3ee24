//! One chain with extensible links: the implicit relation (2.41) in closed parametric form.
//!
//! With x = 𝓛(β): λ_b = exp(βx/D̂), λ̄ = √n̄ x λ_b, T = √n̄ β/λ_b. λ̄(β) is strictly monotone, so the only inversion is
//! one scalar root; nothing implicit is left in a bond.

use crate::error::Error;
use polycore::langevin::{derivative, free_energy, langevin};

/// A chain of n̄ links whose bonds have the energy ½ D (ln λ_b)².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain {
    links: f64,
    dissociation: f64,
}

/// A state of a chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainPoint {
    /// Chain stretch λ̄.
    pub stretch: f64,
    /// Stretch of the links λ_b.
    pub link_stretch: f64,
    /// Force T = t/kθ.
    pub force: f64,
    /// dT/dλ̄.
    pub stiffness: f64,
    /// Energy φ/kθ, zero for the collapsed chain.
    pub energy: f64,
}

impl Chain {
    /// A chain of n̄ = `links` ≥ 1 and D̂ = D/kθ = `dissociation` > 0.
    ///
    /// # Errors
    /// [`Error::Parameter`] outside.
    pub fn new(links: f64, dissociation: f64) -> Result<Self, Error> {
        for (name, found, least) in [("links", links, 1.0), ("dissociation", dissociation, f64::MIN_POSITIVE)]
        {
            if !(found >= least && found.is_finite()) {
                return Err(Error::Parameter { name, found, allowed: format!("at least {least}, finite") });
            }
        }
        Ok(Self { links, dissociation })
    }

    /// The state at parameter β ≥ 0.
    pub fn at(&self, beta: f64) -> ChainPoint {
        let (x, slope) = (langevin(beta), derivative(beta));
        let root = self.links.sqrt();
        let link_stretch = (beta * x / self.dissociation).exp();
        // q = d ln λ_b/dβ
        let q = (x + beta * slope) / self.dissociation;
        let stretch_slope = root * link_stretch * (slope + x * q);
        let force_slope = root / link_stretch * (1.0 - beta * q);
        ChainPoint {
            stretch: root * x * link_stretch,
            link_stretch,
            force: root * beta / link_stretch,
            stiffness: force_slope / stretch_slope,
            energy: self.links * (free_energy(beta) + 0.5 * (beta * x).powi(2) / self.dissociation),
        }
    }

    /// The state at chain stretch λ̄ ≥ 0 (its magnitude is taken).
    pub fn stretched(&self, stretch: f64) -> ChainPoint {
        self.at(self.beta(stretch))
    }

    /// β at a chain stretch: root of ln x + βx/D̂ = ln(λ̄/√n̄) by bisection-guarded Newton in ln β, in which the left
    /// side is nearly linear for small and for large β alike.
    pub fn beta(&self, stretch: f64) -> f64 {
        let ratio = stretch.abs() / self.links.sqrt();
        if ratio == 0.0 || ratio.is_nan() {
            return ratio;
        }
        let target = ratio.ln();
        let excess = |beta: f64| {
            let x = langevin(beta);
            x.ln() + beta * x / self.dissociation - target
        };
        // x ≤ β/3 and λ_b ≥ 1 bound β from below only where λ_b ≈ 1; walk from there in factors of four
        let (mut low, mut high) = (3.0 * ratio, 3.0 * ratio);
        for _ in 0..600 {
            if excess(low) <= 0.0 || low < 1e-300 {
                break;
            }
            high = low;
            low *= 0.25;
        }
        for _ in 0..600 {
            if excess(high) >= 0.0 || high > 1e300 {
                break;
            }
            low = high;
            high *= 4.0;
        }
        let mut beta = (low * high).sqrt();
        for _ in 0..100 {
            let value = excess(beta);
            if value == 0.0 {
                break;
            }
            if value < 0.0 {
                low = beta
            } else {
                high = beta
            }
            let (x, slope) = (langevin(beta), derivative(beta));
            let rate = beta * (slope / x + (x + beta * slope) / self.dissociation);
            let newton = beta * (-value / rate).exp();
            let next = if newton > low && newton < high { newton } else { (low * high).sqrt() };
            let moved = (next - beta).abs();
            beta = next;
            if moved <= 2e-16 * beta {
                break;
            }
        }
        beta
    }

    /// The greatest force, at β = D̂ up to terms e^{−2D̂}: where d(β/λ_b)/dβ = 0.
    pub fn strongest(&self) -> ChainPoint {
        // root of 1 = β(x + βx′)/D̂; β(x + βx′) lies between 2β²/3 and β, so the root between D̂ and √(3D̂/2) or about
        let excess = |beta: f64| beta * (langevin(beta) + beta * derivative(beta)) / self.dissociation - 1.0;
        let (mut low, mut high) = (1e-3 * self.dissociation.min(1.0), 2.0 * self.dissociation.max(2.0));
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if excess(middle) < 0.0 { low = middle } else { high = middle }
        }
        self.at(0.5 * (low + high))
    }
}
