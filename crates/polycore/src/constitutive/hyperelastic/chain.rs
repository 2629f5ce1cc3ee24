//! Langevin chain networks: three chains, eight chains, and eight chains with a √I₂ term.

use super::descriptor::{
    ABSENT, Contained, Domain, FitStart, ModelDescriptor, ModelKind, Parameter, UNLIMITED,
};
use super::polynomial::{first_invariant_excess, second_invariant_excess};
use super::principal::InvariantDerivatives;
use super::{Error, Hyperelastic, PrincipalResponse, finite, parameter, positive};
use crate::langevin;
use crate::tensor::Invariants;
use crate::tensor::deformation::check_stretches;

/// W = (Nkθ/3)√n Σᵢ [λᵢβᵢ + √n ln(βᵢ/sinh βᵢ)], βᵢ = 𝓛⁻¹(λᵢ/√n) (1.25)–(1.26); James & Guth,
/// doi:10.1063/1.1723785.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThreeChain {
    modulus: f64,
    links: f64,
}

/// W = Nkθ√n [λβ + √n ln(β/sinh β)] with λ = √(I₁/3) and β = 𝓛⁻¹(λ/√n) (1.27)–(1.28);
/// doi:10.1016/0022-5096(93)90013-6.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EightChain {
    modulus: f64,
    links: f64,
}

/// Eight-chain law plus c(√I₂ − √3), a term that general biaxial data require (formulation.md, "Beyond the
/// thesis"; Carroll, J. Elasticity 103 (2011) 173–187).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EightChainRootI2 {
    network: EightChain,
    constraint: f64,
}

const MODULUS: Parameter = Parameter { name: "chain_modulus", unit: "Pa", domain: Domain::Positive };
const LINKS: &str = "links";

pub(super) const THREE_CHAIN: ModelDescriptor = ModelDescriptor {
    key: "three-chain",
    kind: ModelKind::Micromechanical,
    parameters: &[MODULUS, Parameter { name: LINKS, unit: "1", domain: Domain::Above(largest_square) }],
    build: |p| Ok(Box::new(ThreeChain::new(p[0], p[1])?)),
    example: &[0.3e6, 60.0],
    starts,
    contains: &[UNLOCKED],
    slopes: None,
    refine: None,
};

pub(super) const EIGHT_CHAIN: ModelDescriptor = ModelDescriptor {
    key: "eight-chain",
    kind: ModelKind::Micromechanical,
    parameters: &[MODULUS, Parameter { name: LINKS, unit: "1", domain: Domain::Above(chain_square) }],
    build: |p| Ok(Box::new(EightChain::new(p[0], p[1])?)),
    example: &[0.27e6, 25.0],
    starts,
    contains: &[UNLOCKED],
    slopes: None,
    refine: None,
};

pub(super) const EIGHT_CHAIN_ROOT_I2: ModelDescriptor = ModelDescriptor {
    key: "eight-chain-root-i2",
    kind: ModelKind::Micromechanical,
    parameters: &[
        MODULUS,
        Parameter { name: LINKS, unit: "1", domain: Domain::Above(chain_square) },
        Parameter { name: "c", unit: "Pa", domain: Domain::Positive },
    ],
    build: |p| Ok(Box::new(EightChainRootI2::new(p[0], p[1], p[2])?)),
    example: &[0.25e6, 26.0, 0.1e6],
    starts: |start| starts(start).into_iter().map(|p| vec![p[0], p[1], 0.3 * start.modulus]).collect(),
    contains: &[Contained {
        key: "eight-chain",
        embed: |p, start| [ABSENT * p[0], 0.1 * start.modulus].map(|c| vec![p[0], p[1], c]).to_vec(),
    }],
    slopes: None,
    refine: None,
};

/// Number of links from which on chains never lock in practice.
const UNLOCKED: Contained =
    Contained { key: "neo-hookean", embed: |p, start| vec![vec![p[0], UNLIMITED * start.limits[1]]] };

fn starts(start: &FitStart<'_>) -> Vec<Vec<f64>> {
    [1.02, 1.3, 3.0].map(|r| vec![0.8 * start.modulus, r * start.limits[1]]).to_vec()
}

/// Lower limit of n: λ² of the longest chain.
fn largest_square(stretches: [f64; 3]) -> f64 {
    stretches.iter().fold(1.0, |most, l| (l * l).max(most))
}

/// Lower limit of n: I₁/3.
fn chain_square(stretches: [f64; 3]) -> f64 {
    (Invariants::from_stretches(stretches).first / 3.0).max(1.0)
}

fn checked(law: &'static str, modulus: f64, links: f64) -> Result<(f64, f64), Error> {
    Ok((
        positive(law, MODULUS.name, modulus)?,
        parameter(law, LINKS, links, links > 1.0, "(1, ∞): at rest the chains must not be extended already")?,
    ))
}

impl ThreeChain {
    const NAME: &'static str = "three-chain";

    /// Nkθ > 0 in Pa, n > 1 links a chain (any real number).
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn new(chain_modulus: f64, links: f64) -> Result<Self, Error> {
        let (modulus, links) = checked(Self::NAME, chain_modulus, links)?;
        Ok(Self { modulus, links })
    }

    fn extension(&self, stretch: f64) -> Result<Extension, Error> {
        Extension::new(&[stretch], self.links).ok_or(Error::Locked {
            law: Self::NAME,
            quantity: "principal stretch",
            value: stretch,
            limit: self.links.sqrt(),
        })
    }
}

impl Hyperelastic for ThreeChain {
    fn name(&self) -> String {
        Self::NAME.into()
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        vec![(MODULUS.name.into(), self.modulus), (LINKS.into(), self.links)]
    }

    fn shear_modulus(&self) -> f64 {
        // ½(w″ + w′) at λ = 1 with w = (Nkθ n/3) f(λ/√n)
        let rest = Extension::rest(self.links);
        self.modulus / 6.0 * (rest.slope() + self.links.sqrt() * rest.beta)
    }

    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        check_stretches(&stretches)?;
        let rest = Extension::rest(self.links).free_energy();
        let mut sum = 0.0;
        for stretch in stretches {
            sum += self.extension(stretch)?.free_energy() - rest;
        }
        finite(Self::NAME, stretches, self.modulus * self.links / 3.0 * sum)
    }

    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        check_stretches(&stretches)?;
        for stretch in stretches {
            self.extension(stretch)?;
        }
        let (third, root) = (self.modulus / 3.0, self.links.sqrt());
        // inside the interval of the three stretches, so the extension exists
        let law = |l: f64| {
            let chain = self.extension(l).unwrap_or_else(|_| Extension::rest(self.links));
            (third * root * chain.beta, third * chain.slope())
        };
        PrincipalResponse::separable(stretches, law, |l| l.min(root - l)).finite(Self::NAME, stretches)
    }
}

impl EightChain {
    const NAME: &'static str = "eight-chain";

    /// Nkθ > 0 in Pa, n > 1 links a chain (any real number).
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn new(chain_modulus: f64, links: f64) -> Result<Self, Error> {
        let (modulus, links) = checked(Self::NAME, chain_modulus, links)?;
        Ok(Self { modulus, links })
    }

    /// Builds the law with the small-strain shear modulus μ₀ = Nkθ √n 𝓛⁻¹(1/√n)/3.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn from_shear_modulus(shear_modulus: f64, links: f64) -> Result<Self, Error> {
        positive(Self::NAME, "shear_modulus", shear_modulus)?;
        let unit = Self::new(1.0, links)?.shear_modulus();
        Self::new(shear_modulus / unit, links)
    }

    fn extension(&self, stretches: [f64; 3]) -> Result<Extension, Error> {
        check_stretches(&stretches)?;
        Extension::new(&stretches, self.links).ok_or(Error::Locked {
            law: Self::NAME,
            quantity: "chain stretch",
            value: (Invariants::from_stretches(stretches).first / 3.0).sqrt(),
            limit: self.links.sqrt(),
        })
    }

    fn derivatives(&self, stretches: [f64; 3]) -> Result<InvariantDerivatives, Error> {
        let chain = self.extension(stretches)?;
        // dx/dI₁ = 1/(6nx), dW/dx = Nkθ n β
        Ok(InvariantDerivatives {
            first: self.modulus / 6.0 * (chain.beta / chain.x),
            first_first: self.modulus / (36.0 * self.links) * chain.stiffening(),
            ..Default::default()
        })
    }
}

impl Hyperelastic for EightChain {
    fn name(&self) -> String {
        Self::NAME.into()
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        vec![(MODULUS.name.into(), self.modulus), (LINKS.into(), self.links)]
    }

    fn shear_modulus(&self) -> f64 {
        let rest = Extension::rest(self.links);
        self.modulus / 3.0 * (rest.beta / rest.x)
    }

    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        let chain = self.extension(stretches)?;
        let rest = Extension::rest(self.links);
        let energy = self.modulus * self.links * chain.energy_above(&rest, first_invariant_excess(stretches));
        finite(Self::NAME, stretches, energy)
    }

    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        PrincipalResponse::from_invariants(stretches, self.derivatives(stretches)?)
            .finite(Self::NAME, stretches)
    }
}

impl EightChainRootI2 {
    const NAME: &'static str = "eight-chain + c√I2";

    /// Nkθ > 0 and c ≥ 0 in Pa, n > 1.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn new(chain_modulus: f64, links: f64, constraint: f64) -> Result<Self, Error> {
        let network = EightChain::new(chain_modulus, links)?;
        let constraint = parameter(Self::NAME, "c", constraint, constraint >= 0.0, "[0, ∞)")?;
        Ok(Self { network, constraint })
    }
}

impl Hyperelastic for EightChainRootI2 {
    fn name(&self) -> String {
        Self::NAME.into()
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        let mut all = self.network.parameters();
        all.push(("c".into(), self.constraint));
        all
    }

    fn shear_modulus(&self) -> f64 {
        // μ = 2(W₁ + W₂), W₂ = c/(2√3)
        self.network.shear_modulus() + self.constraint / 3.0_f64.sqrt()
    }

    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        let excess = second_invariant_excess(stretches);
        // √I₂ − √3 = (I₂ − 3)/(√I₂ + √3)
        let root = excess / ((excess + 3.0).sqrt() + 3.0_f64.sqrt());
        let energy = self.network.energy_at(stretches)? + self.constraint * root;
        finite(Self::NAME, stretches, energy)
    }

    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        let second = Invariants::from_stretches(stretches).second;
        let w = InvariantDerivatives {
            second: 0.5 * self.constraint / second.sqrt(),
            second_second: -0.25 * self.constraint / (second * second.sqrt()),
            ..self.network.derivatives(stretches)?
        };
        PrincipalResponse::from_invariants(stretches, w).finite(Self::NAME, stretches)
    }
}

/// State of one chain at relative extension x = λ/√n: β = 𝓛⁻¹(x) and free energy f = xβ + ln(β/sinh β) per
/// link and kθ.
struct Extension {
    x: f64,
    beta: f64,
}

impl Extension {
    /// Computes the state of a chain whose λ² is the mean square of the given stretches; `None` at and beyond
    /// locking. Near locking the complement 1 − x = (1 − λ²/n)/(1 + x) carries the digits that x loses; n −
    /// λ² is summed in doubled precision.
    fn new(stretches: &[f64], links: f64) -> Option<Self> {
        let count = stretches.len() as f64;
        let full = count * links;
        let (mut left, mut rounding) = (full, count.mul_add(links, -full));
        for l in stretches {
            let square = l * l;
            let next = left - square;
            // Knuth's error of the difference, and that of the square
            let seen = left - next;
            rounding += (left - (next + seen)) + (seen - square) - l.mul_add(*l, -square);
            left = next;
        }
        let room = (left + rounding) / full;
        if !(room > 0.0 && room <= 1.0) {
            return None;
        }
        let x = (stretches.iter().map(|l| l * l).sum::<f64>() / full).sqrt();
        let beta =
            if x < 0.5 { langevin::inverse(x) } else { langevin::inverse_from_complement(room / (1.0 + x)) };
        Some(Self { x, beta })
    }

    fn rest(links: f64) -> Self {
        // n > 1 was checked on construction
        Self::new(&[1.0], links).unwrap_or(Self { x: 1.0, beta: f64::INFINITY })
    }

    /// dβ/dx = 1/𝓛′(β).
    fn slope(&self) -> f64 {
        1.0 / langevin::derivative(self.beta)
    }

    /// (x dβ/dx − β)/x³: 18/5 + 1188/175 x² + … where the difference would cancel.
    fn stiffening(&self) -> f64 {
        let (x, square) = (self.x, self.x * self.x);
        if x < 0.02 {
            // coefficients (2k)·a_k of 𝓛⁻¹ = 3x + 9/5 x³ + 297/175 x⁵ + 1539/875 x⁷ + …
            18.0 / 5.0 + square * (1188.0 / 175.0 + square * (9234.0 / 875.0))
        } else {
            (self.slope() - self.beta / x) / square
        }
    }

    /// f = xβ + ln(β/sinh β).
    fn free_energy(&self) -> f64 {
        langevin::free_energy(self.beta)
    }

    /// f(x) − f(x₀), from I₁ − 3 given exactly. Near rest, where f is flat compared with its rounding, it is
    /// the integral of β/(2nx·3) over I₁.
    fn energy_above(&self, rest: &Self, excess: f64) -> f64 {
        // x² − x₀² = (I₁ − 3)/3n and x₀² = 1/n
        let change = excess / 3.0 * rest.x * rest.x;
        if change.abs() > 1e-3 * rest.x * rest.x * (1.0 - rest.x) {
            return self.free_energy() - rest.free_energy();
        }
        // df = β dx = (β/2x) d(x²), two-point Gauss rule
        let half = 0.5 * change;
        let nodes = [-1.0, 1.0].map(|sign| rest.x * rest.x + half * (1.0 + sign / 3.0_f64.sqrt()));
        half * nodes.map(|square| 0.5 * langevin::inverse(square.sqrt()) / square.sqrt()).iter().sum::<f64>()
    }
}
