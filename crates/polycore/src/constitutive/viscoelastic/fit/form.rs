//! Forms of laws with time: which constants they have, and the law of given constants.

use super::super::{Branch, Mullins, Spring, Viscoelastic, Viscosity};
use crate::constitutive::Error;
use crate::constitutive::hyperelastic::{Domain, EightChain, LopezPamies, ModelDescriptor, NeoHookean};

/// Form of a law with time, without its constants.
#[derive(Debug, Clone)]
pub struct Form {
    /// The equilibrium law.
    pub equilibrium: &'static ModelDescriptor,
    /// The branches; their constants have the names `1.nu`, `1.eta_0`, `2.nu`, ….
    pub branches: Vec<BranchForm>,
    /// Softening of the equilibrium law by the largest strain so far, with the constants `mullins.r`,
    /// `mullins.m`, `mullins.beta`.
    pub softening: bool,
    /// Constants that keep a value, by their names, SI. These replace the choices of the fit.
    pub fixed: Vec<(String, f64)>,
    /// Constants that are fitted although the fit would fix them.
    pub free: Vec<String>,
}

/// Form of a branch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BranchForm {
    /// The spring.
    pub spring: SpringForm,
    /// The dashpot.
    pub viscosity: ViscosityForm,
}

/// Form of the spring of a branch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpringForm {
    /// `nu`.
    NeoHookean,
    /// `nu_1`, `beta_1`, … of so many terms.
    LopezPamies(usize),
    /// `chain_modulus`, `links`.
    EightChain,
    /// `S`: so many times the equilibrium law, as Bergström and Boyce have it.
    Proportional,
}

/// Form of the viscosity of a branch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ViscosityForm {
    /// `eta`.
    Constant,
    /// `eta_0`, `eta_inf`, `K_1`, `K_2`, `gamma_1`, `gamma_2`.
    KumarLopezPamies,
    /// `rate`, `stress`, `m`, `c`, `xi`.
    BergstromBoyce,
    /// `rate`, `stress`.
    Eyring,
}

/// Constant of a form.
#[derive(Debug, Clone, PartialEq)]
pub struct Constant {
    /// Name: `mu_1`, `1.eta_0`.
    pub name: String,
    /// `Pa`, `Pa s`, `1/Pa^2`, `1/s` or `1`.
    pub unit: &'static str,
    /// Map to the unbounded q of the search.
    pub(super) map: Map,
    /// Value and reason of a constant that is not fitted.
    pub fixed: Option<(f64, &'static str)>,
}

/// Map between a constant p and the unbounded q of the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Map {
    /// p = q.
    Real,
    /// p = limit + e^q.
    Above(f64),
    /// p = −1/(1 + e^−q), from −1 to 0.
    Creep,
    /// p = limit/(1 + e^−q).
    Below(f64),
}

/// Bounds of |q|: of logarithms, and of exponents, where the law is another one.
const LARGEST_LOG: f64 = 60.0;
const LARGEST_EXPONENT: f64 = 30.0;

impl Map {
    pub fn constant(self, q: f64) -> f64 {
        let log = q.clamp(-LARGEST_LOG, LARGEST_LOG);
        match self {
            Self::Real => q.clamp(-LARGEST_EXPONENT, LARGEST_EXPONENT),
            Self::Above(limit) => limit + log.exp(),
            Self::Creep => -1.0 / (1.0 + (-log).exp()),
            Self::Below(limit) => limit / (1.0 + (-log).exp()),
        }
    }

    pub fn inverse(self, p: f64) -> f64 {
        match self {
            Self::Real => p,
            Self::Above(limit) => (p - limit).max(f64::MIN_POSITIVE).ln(),
            Self::Creep => Self::Below(1.0).inverse(-p),
            Self::Below(limit) => {
                let share = (p / limit).clamp(1e-9, 1.0 - 1e-9);
                (share / (1.0 - share)).ln()
            }
        }
    }
}

/// Largest m of the softening over the energy at the largest strain.
const WIDEST: f64 = 100.0;

const POSITIVE: Map = Map::Above(0.0);

/// Scales of the data that choices of constants need.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scales {
    /// Shear modulus of the best neo-Hookean law without time, Pa.
    pub modulus: f64,
    /// Power of 1000 Pa below the root mean square of the stresses.
    pub unit: f64,
    /// Shortest and longest duration of a run, s.
    pub durations: [f64; 2],
    /// Energy of that law at the largest strain, J/m³.
    pub energy: f64,
    /// Number of different largest strains before an unloading.
    pub peaks: usize,
    /// Lower limit of each constant of the equilibrium law, from the stretches of the data.
    pub limits: Vec<f64>,
}

impl Form {
    /// Creates a form of branches of one kind, with nothing fixed.
    pub fn new(equilibrium: &'static ModelDescriptor, branches: Vec<BranchForm>) -> Self {
        Self { equilibrium, branches, softening: false, fixed: Vec::new(), free: Vec::new() }
    }

    /// Names of the constants, in the order of [`Form::law`].
    pub fn names(&self) -> Vec<String> {
        let limits = vec![0.0; self.equilibrium.parameters.len()];
        let scales = Scales { modulus: 1.0, unit: 1.0, durations: [1.0; 2], energy: 1.0, peaks: 2, limits };
        let unnamed = Self { fixed: Vec::new(), free: Vec::new(), ..self.clone() };
        let constants = unnamed.constants(&scales).unwrap_or_default();
        constants.into_iter().map(|constant| constant.name).collect()
    }

    /// Lists the constants in the order of [`Form::law`]. Those that no data determine are fixed, with the
    /// reason: γ̇₀ of `BergstromBoyce` (degenerate with τ̂), η_∞ and K₂ of `KumarLopezPamies` (nearly
    /// degenerate: only η₀/K₂^γ₂ and K₁/K₂^γ₂ are seen), ξ (acts on the first per cent of flow), β of the
    /// softening where all cycles turn at one strain (only m + βW_max is seen).
    pub(super) fn constants(&self, scales: &Scales) -> Result<Vec<Constant>, Error> {
        let mut all = Vec::new();
        let mut add = |name: String, unit, map, fixed: Option<(f64, &'static str)>| {
            all.push(Constant { name, unit, map, fixed });
        };
        for (parameter, limit) in self.equilibrium.parameters.iter().zip(&scales.limits) {
            let map = match parameter.domain {
                Domain::Real => Map::Real,
                Domain::Positive => POSITIVE,
                Domain::Above(_) => Map::Above(*limit),
            };
            add(parameter.name.to_owned(), parameter.unit, map, None);
        }
        for (k, branch) in (1..).zip(&self.branches) {
            let named = |name: &str| format!("{k}.{name}");
            match branch.spring {
                SpringForm::NeoHookean => add(named("nu"), "Pa", POSITIVE, None),
                SpringForm::LopezPamies(terms) => {
                    for r in 1..=terms {
                        add(named(&format!("nu_{r}")), "Pa", POSITIVE, None);
                        add(named(&format!("beta_{r}")), "1", Map::Real, None);
                    }
                }
                SpringForm::EightChain => {
                    add(named("chain_modulus"), "Pa", POSITIVE, None);
                    add(named("links"), "1", Map::Above(1.0), None);
                }
                SpringForm::Proportional => add(named("S"), "1", POSITIVE, None),
            }
            match branch.viscosity {
                ViscosityForm::Constant => add(named("eta"), "Pa s", POSITIVE, None),
                ViscosityForm::KumarLopezPamies => {
                    add(named("eta_0"), "Pa s", POSITIVE, None);
                    add(named("eta_inf"), "Pa s", POSITIVE, Some((0.0, "without effect on the stresses")));
                    add(named("K_1"), "Pa s", POSITIVE, None);
                    let thinning = (scales.unit.powi(-2), "trades with eta_0 and K_1");
                    add(named("K_2"), "1/Pa^2", POSITIVE, Some(thinning));
                    add(named("gamma_1"), "1", POSITIVE, None);
                    add(named("gamma_2"), "1", POSITIVE, None);
                }
                ViscosityForm::BergstromBoyce => {
                    add(named("rate"), "1/s", POSITIVE, Some((1.0, "degenerate with stress")));
                    add(named("stress"), "Pa", POSITIVE, None);
                    add(named("m"), "1", Map::Above(1.0), None);
                    add(named("c"), "1", Map::Creep, None);
                    add(named("xi"), "1", POSITIVE, Some((0.01, "acts on the first flow only")));
                }
                ViscosityForm::Eyring => {
                    add(named("rate"), "1/s", POSITIVE, None);
                    add(named("stress"), "Pa", POSITIVE, None);
                }
            }
        }
        if self.softening {
            add("mullins.r".to_owned(), "1", Map::Above(1.0), None);
            if scales.peaks == 0 {
                let found = "no run that turns back";
                return Err(Error::invalid("softening", found, "at least one: loading does not show it"));
            }
            // far above, the law does not soften
            add("mullins.m".to_owned(), "Pa", Map::Below(WIDEST * scales.energy), None);
            let single = (0.0, "degenerate with mullins.m: all cycles turn at one strain");
            add("mullins.beta".to_owned(), "1", POSITIVE, (scales.peaks < 2).then_some(single));
        }
        let known = all.iter().map(|constant| constant.name.as_str()).collect::<Vec<_>>().join(", ");
        let unknown = |name: &str| Error::invalid("name of a constant", name, &known);
        for (name, value) in &self.fixed {
            let found = all.iter_mut().find(|constant| constant.name == *name);
            found.ok_or_else(|| unknown(name))?.fixed = Some((*value, "given"));
        }
        for name in &self.free {
            let found = all.iter_mut().find(|constant| constant.name == *name);
            found.ok_or_else(|| unknown(name))?.fixed = None;
        }
        Ok(all)
    }

    /// Builds the law from its constants, SI, in the order equilibrium, spring and viscosity of each branch,
    /// softening.
    ///
    /// # Errors
    /// [`Error::Parameter`]; [`Error::Data`] for a wrong number of constants; [`Error::Invalid`] for a
    /// branch proportional to a law that is no spring.
    pub fn law(&self, constants: &[f64]) -> Result<Viscoelastic, Error> {
        let mut rest = Constants { form: self, all: constants, next: 0 };
        let equilibrium = rest.take(self.equilibrium.parameters.len())?;
        let law = self.equilibrium.law(equilibrium)?;
        let mut branches = Vec::with_capacity(self.branches.len());
        for branch in &self.branches {
            let spring = match branch.spring {
                SpringForm::NeoHookean => Spring::NeoHookean(NeoHookean::new(rest.take(1)?[0])?),
                SpringForm::LopezPamies(terms) => powers(rest.take(2 * terms)?, 1.0)?,
                SpringForm::EightChain => {
                    let p = rest.take(2)?;
                    Spring::EightChain(EightChain::new(p[0], p[1])?)
                }
                SpringForm::Proportional => self.scaled(equilibrium, rest.take(1)?[0])?,
            };
            let viscosity = match branch.viscosity {
                ViscosityForm::Constant => Viscosity::Constant(rest.take(1)?[0]),
                ViscosityForm::KumarLopezPamies => {
                    let p = rest.take(6)?;
                    Viscosity::KumarLopezPamies {
                        start: p[0],
                        end: p[1],
                        thickening: p[2],
                        thinning: p[3],
                        exponents: [p[4], p[5]],
                    }
                }
                ViscosityForm::BergstromBoyce => {
                    let p = rest.take(5)?;
                    Viscosity::BergstromBoyce {
                        rate: p[0],
                        stress: p[1],
                        power: p[2],
                        creep: p[3],
                        offset: p[4],
                    }
                }
                ViscosityForm::Eyring => {
                    let p = rest.take(2)?;
                    Viscosity::Eyring { rate: p[0], stress: p[1], pressure: 0.0, softening: None }
                }
            };
            branches.push(Branch::new(spring, viscosity)?);
        }
        let softening = match self.softening {
            true => Some(rest.take(3)?).map(|p| Mullins { ratio: p[0], offset: p[1], slope: p[2] }),
            false => None,
        };
        if rest.next < constants.len() {
            return Err(rest.wrong());
        }
        let law = Viscoelastic::new(Box::new(law), branches)?;
        match softening {
            Some(softening) => law.with_softening(softening),
            None => Ok(law),
        }
    }

    /// Spring of `share` times the equilibrium law.
    fn scaled(&self, p: &[f64], share: f64) -> Result<Spring, Error> {
        match self.equilibrium.key {
            "neo-hookean" => Ok(Spring::NeoHookean(NeoHookean::new(share * p[0])?)),
            "lopez-pamies" => powers(p, share),
            "eight-chain" => Ok(Spring::EightChain(EightChain::new(share * p[0], p[1])?)),
            other => Err(Error::invalid(
                "branch proportional to the equilibrium law",
                other,
                "neo-hookean, lopez-pamies, eight-chain",
            )),
        }
    }
}

/// Spring of the terms [μ₁, α₁, …], with `share` times the moduli.
fn powers(p: &[f64], share: f64) -> Result<Spring, Error> {
    let terms = p.chunks_exact(2).map(|term| [share * term[0], term[1]]).collect();
    Ok(Spring::LopezPamies(LopezPamies::new(terms)?))
}

/// Constants not yet used.
struct Constants<'a> {
    form: &'a Form,
    all: &'a [f64],
    next: usize,
}

impl<'a> Constants<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [f64], Error> {
        let taken = self.all.get(self.next..self.next + count).ok_or_else(|| self.wrong())?;
        self.next += count;
        Ok(taken)
    }

    fn wrong(&self) -> Error {
        let what = format!("law `{}` with {} branches", self.form.equilibrium.key, self.form.branches.len());
        Error::Data { what, reason: format!("{} constants do not fit it", self.all.len()) }
    }
}
