//! A chain with extensible links: the implicit relation (2.41) in closed parametric form.
//!
//! With x = 𝓛(β): λ_b = exp(βx/D̂), λ̄ = √n̄ x λ_b, T = √n̄ β/λ_b. λ̄(β) is strictly monotone, so a scalar
//! root is the only inversion; a bond has no implicit relation.

use crate::error::Error;
use polycore::langevin::{complement, derivative, free_energy, inverse, langevin};
use polycore::numerics::bisected;

/// Iteration limit. Newton's method needs 3 to 8 steps; its fallback, bisection, more for absurd parameters
/// only.
const MOST_STEPS: usize = 400;

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
    /// Creates a chain of n̄ = `links` ≥ 1 and D̂ = D/kθ = `dissociation` > 0.
    ///
    /// # Errors
    /// [`Error::Parameter`] outside these domains.
    pub fn new(links: f64, dissociation: f64) -> Result<Self, Error> {
        for (name, found, least) in [("links", links, 1.0), ("dissociation", dissociation, f64::MIN_POSITIVE)]
        {
            if !(found >= least && found.is_finite()) {
                return Err(Error::Parameter { name, found, allowed: format!("at least {least}, finite") });
            }
        }
        Ok(Self { links, dissociation })
    }

    /// State at parameter β ≥ 0; at ∞ the torn chain: no force, no stiffness.
    pub fn state_at(&self, beta: f64) -> ChainPoint {
        if beta == f64::INFINITY {
            return ChainPoint {
                stretch: beta,
                link_stretch: beta,
                force: 0.0,
                stiffness: 0.0,
                energy: beta,
            };
        }
        let (x, slope) = (langevin(beta), derivative(beta));
        let root = self.links.sqrt();
        let work = beta * (x / self.dissociation);
        let link_stretch = work.exp();
        // q = d ln λ_b/dβ
        let q = (x + beta * slope) / self.dissociation;
        ChainPoint {
            stretch: root * x * link_stretch,
            link_stretch,
            force: root * beta / link_stretch,
            stiffness: (1.0 - beta * q) / (slope + x * q) / link_stretch / link_stretch,
            energy: self.links * (free_energy(beta) + 0.5 * beta * x * work),
        }
    }

    /// State at chain stretch λ̄ ≥ 0 (its magnitude is used).
    pub fn stretched(&self, stretch: f64) -> ChainPoint {
        self.state_at(self.beta(stretch))
    }

    /// β at a chain stretch λ̄ (its magnitude is used): x λ_b = λ̄/√n̄. Accurate to a few ulp for the given
    /// λ̄, also at λ̄ ≈ √n̄, where the curve is nearly vertical; ∞ at ∞.
    pub fn beta(&self, stretch: f64) -> f64 {
        let ratio = stretch.abs() / self.links.sqrt();
        // includes the limits: 0, ∞, and NaN for NaN
        if ratio == 0.0 || !ratio.is_finite() {
            ratio
        } else if ratio < 0.5 {
            self.slack(ratio)
        } else {
            self.taut(self.logarithm(stretch.abs()))
        }
    }

    /// Solves x λ_b = r for r < 1/2. The rigid chain gives an upper bound.
    fn slack(&self, ratio: f64) -> f64 {
        let start = inverse(ratio);
        newton(start, start, |beta| {
            let (x, slope) = (langevin(beta), derivative(beta));
            let link_stretch = (beta * (x / self.dissociation)).exp();
            let q = (x + beta * slope) / self.dissociation;
            (x * link_stretch - ratio, link_stretch * (slope + x * q))
        })
    }

    /// Solves ln x + βx/D̂ = ln r for r ≥ 1/2: both terms keep their digits as x → 1.
    fn taut(&self, logarithm: f64) -> f64 {
        // with ln x ≈ −1/β and βx ≈ β − 1: β² − D̂bβ − D̂ = 0
        let b = logarithm + 1.0 / self.dissociation;
        let half = 0.5 * self.dissociation * b.abs();
        let larger = half + (half * half + self.dissociation).sqrt();
        let start = if b >= 0.0 { larger } else { self.dissociation / larger };
        newton(start, f64::INFINITY, |beta| {
            let (x, slope, missing) = (langevin(beta), derivative(beta), complement(beta));
            let work = beta * (x / self.dissociation);
            ((-missing).ln_1p() + (work - logarithm), slope / x + (x + beta * slope) / self.dissociation)
        })
    }

    /// ln(λ̄/√n̄), with λ̄² − n̄ in doubled precision near locking.
    fn logarithm(&self, stretch: f64) -> f64 {
        let ratio = stretch / self.links.sqrt();
        if !(0.8..1.25).contains(&ratio) {
            return ratio.ln();
        }
        let square = stretch * stretch;
        let excess = (square - self.links) + stretch.mul_add(stretch, -square);
        0.5 * (excess / self.links).ln_1p()
    }

    /// State of greatest force, at β = D̂ up to terms e^{−2D̂}: where d(β/λ_b)/dβ = 0.
    pub fn strongest(&self) -> ChainPoint {
        // root of 1 = β(x + βx′)/D̂; β(x + βx′) lies between 2β²/3 and β, so the root lies roughly between D̂
        // and √(3D̂/2)
        let excess = |beta: f64| beta * (langevin(beta) + beta * derivative(beta)) / self.dissociation - 1.0;
        let (low, high) = (1e-3 * self.dissociation.min(1.0), 2.0 * self.dissociation.max(2.0));
        self.state_at(bisected(low, high, 200, |beta| excess(beta) < 0.0))
    }
}

/// Finds the positive root of an increasing function from its value and slope: Newton's method kept inside a
/// shrinking bracket.
fn newton(start: f64, upper: f64, value_and_slope: impl Fn(f64) -> (f64, f64)) -> f64 {
    let (mut low, mut high) = (0.0, upper);
    let mut at = start;
    for _ in 0..MOST_STEPS {
        let (value, slope) = value_and_slope(at);
        if value > 0.0 {
            high = at;
        } else {
            low = at;
        }
        let step = value / slope;
        let next = at - step;
        // the step after this one would be its square
        if step.abs() <= 1e-9 * at {
            return next.clamp(low, upper);
        }
        let inside = next > low && next < high;
        at = match (inside, high.is_finite()) {
            (true, _) => next,
            (false, true) if low > 0.0 => (low * high).sqrt(),
            (false, true) => 0.1 * high,
            (false, false) => 2.0 * at,
        };
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;
    use polycore::numerics::bisect;
    use proptest::prelude::*;

    #[test]
    fn nothing_pulls_harder_than_the_strongest() {
        for dissociation in [1.0, 1.5, 4.0, 19.9, 20.1, 1200.0, 1e9] {
            for links in [2.0, 720.0, 1e6] {
                let chain = Chain::new(links, dissociation).unwrap();
                let top = chain.strongest();
                assert!((chain.stretched(top.stretch).force / top.force - 1.0).abs() < 1e-13);
                assert!(chain.stretched(0.999 * top.stretch).stiffness > 0.0);
                assert!(chain.stretched(1.001 * top.stretch).stiffness < 0.0);
            }
        }
    }

    #[test]
    fn limits() {
        for (links, dissociation) in [(1.0, 1e-30), (2.0, 1.0), (720.0, 1200.0), (1e6, 1e9), (1e12, 1e12)] {
            let chain = Chain::new(links, dissociation).unwrap();
            let rest = chain.stretched(0.0);
            assert_eq!((rest.force, rest.energy, rest.stiffness, rest.link_stretch), (0.0, 0.0, 3.0, 1.0));
            let torn = chain.stretched(f64::INFINITY);
            assert_eq!((torn.force, torn.stiffness, torn.energy), (0.0, 0.0, f64::INFINITY));
            assert!(chain.stretched(f64::NAN).force.is_nan());
            for small in [1e-300, 1e-150, 1e-20, 1e-9] {
                // 3λ̄(1 + O(λ̄²(1/n̄ + 1/(n̄D̂))))
                let force = chain.stretched(small).force;
                assert!(dissociation < 1.0 || (force / (3.0 * small) - 1.0).abs() < 1e-14);
            }
            // far beyond the maximum λ_b → λ̄/√n̄, so that Tλ̄ = n̄βx = n̄D̂ ln(λ̄/√n̄)
            for large in [1e100, 1e200, f64::MAX] {
                let asymptote = dissociation * (large.ln() - 0.5 * links.ln()) * (links / large);
                let force = chain.stretched(large).force;
                assert!(force.is_finite());
                // ln x ~ −1/β is left out, β ~ 200 D̂; exp of up to 700
                let bound = 1e-2 / dissociation + 1e-12;
                assert!(
                    dissociation < 1.0 || (force / asymptote - 1.0).abs() < bound,
                    "{large} {dissociation}"
                );
            }
        }
    }

    /// Compares with the implicit relation (2.41), solved directly for λ_b by bisection.
    #[test]
    fn agrees_with_the_implicit_relation_solved_directly() {
        let mut worst: f64 = 0.0;
        for dissociation in [1200.0, 2300.0] {
            for links in [720.0f64, 90.0, 100.0, 12.5] {
                let chain = Chain::new(links, dissociation).unwrap();
                for ratio in [0.05, 0.3, 0.7, 0.95, 1.0, 1.05, 1.1, 1.2, 1.5] {
                    let less = |x: f64| x.ln() * x * dissociation < ratio * inverse(ratio / x);
                    let [low, _] = bisect(f64::max(ratio, 1.0), 3.0 * ratio + 1.0, 200, less);
                    let force = links.sqrt() * inverse(ratio / low) / low;
                    let found = chain.stretched(ratio * links.sqrt());
                    // the bisection resolves λ_b to ε, and β = 1/(1 − x) loses a factor 1/(1 − x) < 1e3 of it
                    assert!((found.link_stretch / low - 1.0).abs() < 1e-14, "{links} {ratio}");
                    worst = worst.max((found.force / force - 1.0).abs());
                }
            }
        }
        evidence::at_most("closed form of (2.41) against the implicit relation", worst, 1e-12);
    }

    proptest! {
        /// Inverts λ̄(β): the error is the rounding of λ̄ times the condition number of the inversion, up to
        /// √D̂ at locking.
        #[test]
        fn inversion(exponent in -8.0..9.0f64, links in 0.0..6.0f64, dissociation in 0.0..9.0f64) {
            let chain = Chain::new(10f64.powf(links), 10f64.powf(dissociation)).unwrap();
            let beta = 10f64.powf(exponent);
            let (x, slope) = (langevin(beta), derivative(beta));
            let work = beta * x / chain.dissociation;
            prop_assume!(work < 600.0);
            let sensitivity = beta * (slope / x + (x + beta * slope) / chain.dissociation);
            // λ̄ itself: 𝓛 3.5 ulp, the exponent 4 ulp, two roundings and √n̄
            let rounding = (6.0 + 4.0 * work) * f64::EPSILON / sensitivity;
            let error = (chain.beta(chain.state_at(beta).stretch) / beta - 1.0).abs();
            prop_assert!(error < rounding + 8.0 * f64::EPSILON, "{} {}", error, rounding);
        }

        /// Differentiates φ → T → dT/dλ̄ on both sides of locking and of the maximum.
        #[test]
        fn differences(ratio in 0.01..4.0f64, links in 0.31..5.0f64, dissociation in 0.0..3.5f64) {
            let chain = Chain::new(10f64.powf(links), 10f64.powf(dissociation)).unwrap();
            let stretch = ratio * chain.links.sqrt();
            // the curve bends over √n̄/√D̂ > 0.017 λ̄: truncation (2e-6/0.017)²/6, cancellation ε/2e-6
            let left = chain.stretched(stretch * (1.0 - 2e-6));
            let right = chain.stretched(stretch * (1.0 + 2e-6));
            let (width, here) = (4e-6 * stretch, chain.stretched(stretch));
            let force = (right.energy - left.energy) / width;
            prop_assert!((force - here.force).abs() < 1e-6 * here.force.max(1e-3 * here.energy / stretch));
            let stiffness = (right.force - left.force) / width;
            let scale = here.stiffness.abs() + here.force / stretch;
            let error = (stiffness - here.stiffness).abs();
            prop_assert!(error < 1e-6 * scale, "{} {}", stiffness, here.stiffness);
        }
    }
}
