//! Branches of laws with time, and their softening, as a scene names them.

use std::collections::BTreeMap;
use std::str::FromStr;

use serde::Deserialize;

use super::{SceneError, Source};
use polycore::constitutive::Error;
use polycore::constitutive::hyperelastic::{EightChain, Hyperelastic, LopezPamies, NeoHookean};
use polycore::constitutive::viscoelastic::{Branch, Mullins, Shift, Spring, StrainSoftening, Viscosity};
use polycore::units::{
    MolarEnergy, PerSquaredStress, Rate, Stress, Temperature, TemperatureDifference, UnitError,
};

/// Branch of a law with time: a spring in series with a dashpot.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BranchSpec {
    /// The spring: `nu`; `nu_1`, `beta_1` …; `chain_modulus`, `links`.
    pub spring: SpringKind,
    /// The dashpot: `eta`; `eta_0`, `eta_inf`, `K_1`, `K_2`, `gamma_1`, `gamma_2`; `rate`, `stress`, `m`,
    /// `c`, `xi`; `rate`, `stress`, optionally `pressure`; the same with `S_a`, `r_0`, `r_1`, `r_2`.
    pub viscosity: ViscosityKind,
    /// Constants by name: those with a unit as text, other numbers without.
    pub parameters: BTreeMap<String, BranchConstant>,
    /// Shift of the viscosity with temperature; default: none.
    pub shift: Option<ShiftSpec>,
}

/// Shift of relaxation times with temperature.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ShiftSpec {
    /// Williams, Landel and Ferry: reference, C₁ and C₂; below the reference with its slope there.
    Wlf(Temperature, f64, TemperatureDifference),
    /// Arrhenius: reference and activation energy.
    Arrhenius(Temperature, MolarEnergy),
}

impl ShiftSpec {
    /// Returns the shift; `key` is where it stands.
    ///
    /// # Errors
    /// A [`SceneError`] for a constant that is not positive.
    pub fn shift(&self, source: &Source, key: &str) -> Result<Shift, SceneError> {
        let shift = match *self {
            Self::Wlf(reference, first, second) => {
                Shift::Wlf { reference: reference.si(), constants: [first, second.si()] }
            }
            Self::Arrhenius(reference, energy) => {
                Shift::Arrhenius { reference: reference.si(), energy: energy.si() }
            }
        };
        match shift.invalid_constant() {
            Some((name, value)) => Err(source.error(key, format!("{name} = {value}"), "above 0, finite")),
            None => Ok(shift),
        }
    }
}

/// Spring of a branch.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SpringKind {
    /// Neo-Hookean.
    NeoHookean,
    /// Power of I₁.
    #[serde(rename = "lopez-pamies-1")]
    LopezPamies1,
    /// Two powers of I₁.
    #[serde(rename = "lopez-pamies-2")]
    LopezPamies2,
    /// Eight-chain law.
    EightChain,
}

/// Dashpot of a branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ViscosityKind {
    /// Constant.
    Constant,
    /// Kumar and Lopez-Pamies 2016.
    KumarLopezPamies,
    /// Bergström and Boyce 1998.
    BergstromBoyce,
    /// Eyring 1936.
    Eyring,
    /// Eyring with softening after yield, Klompen et al. 2005.
    EyringSoftening,
}

/// Constant of a branch: a number, or a quantity such as "3 MPa s".
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(untagged)]
pub enum BranchConstant {
    /// A number.
    Number(f64),
    /// A quantity with its unit.
    Text(String),
}

/// Softening of the equilibrium law by the largest strain so far (Ogden and Roxburgh 1999, Abaqus' form).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MullinsSpec {
    /// r, above 1.
    pub r: f64,
    /// m, energy per volume.
    pub m: Stress,
    /// β.
    #[serde(default)]
    pub beta: f64,
}

/// Name of a constant, its value in the unit, and the unit; "1" for none.
pub type NamedConstant = (&'static str, f64, &'static str);

/// Constants of a spring or dashpot with their units.
type ConstantUnits = &'static [(&'static str, &'static str)];

impl SpringKind {
    fn names(self) -> ConstantUnits {
        match self {
            Self::NeoHookean => &[("nu", "Pa")],
            Self::LopezPamies1 => &[("nu_1", "Pa"), ("beta_1", "1")],
            Self::LopezPamies2 => &[("nu_1", "Pa"), ("beta_1", "1"), ("nu_2", "Pa"), ("beta_2", "1")],
            Self::EightChain => &[("chain_modulus", "Pa"), ("links", "1")],
        }
    }
}

impl ViscosityKind {
    fn names(self) -> ConstantUnits {
        match self {
            Self::Constant => &[("eta", "Pa s")],
            Self::KumarLopezPamies => &[
                ("eta_0", "Pa s"),
                ("eta_inf", "Pa s"),
                ("K_1", "Pa s"),
                ("K_2", "1/Pa^2"),
                ("gamma_1", "1"),
                ("gamma_2", "1"),
            ],
            Self::BergstromBoyce => &[("rate", "1/s"), ("stress", "Pa"), ("m", "1"), ("c", "1"), ("xi", "1")],
            Self::Eyring => &[("rate", "1/s"), ("stress", "Pa")],
            Self::EyringSoftening => {
                &[("rate", "1/s"), ("stress", "Pa"), ("S_a", "1"), ("r_0", "1"), ("r_1", "1"), ("r_2", "1")]
            }
        }
    }

    /// Constants that are 0 if not given; they follow those of [`ViscosityKind::names`].
    fn optional(self) -> ConstantUnits {
        match self {
            Self::Eyring | Self::EyringSoftening => &[("pressure", "1")],
            _ => &[],
        }
    }
}

impl BranchSpec {
    /// Builds the branch; `key` is where this block stands.
    ///
    /// # Errors
    /// A [`SceneError`] for a constant that is missing, unknown, without its unit, or out of its range, and
    /// for a spring that softens at large strains.
    pub fn branch(&self, source: &Source, key: &str) -> Result<Branch, SceneError> {
        let own = key;
        let key = format!("{own}.parameters");
        let required = self.spring.names().iter().chain(self.viscosity.names());
        let all: Vec<_> = required.chain(self.viscosity.optional()).collect();
        let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
        if let Some(other) = self.parameters.keys().find(|name| !names.contains(&name.as_str())) {
            return Err(source.unknown(&format!("{key}.{other}"), other, &names));
        }
        let value = |&(name, unit): &(&str, &str)| {
            let Some(given) = self.parameters.get(name) else {
                if self.viscosity.optional().iter().any(|(other, _)| *other == name) {
                    return Ok(0.0);
                }
                return Err(source.error(&key, format!("no `{name}`"), names.join(", ")));
            };
            let path = format!("{key}.{name}");
            match (given, unit) {
                (BranchConstant::Number(value), "1") => Ok(*value),
                (BranchConstant::Number(value), _) => {
                    let allowed = format!("a text with a unit such as \"{value} {unit}\"");
                    Err(source.error(&path, format!("{value} without a unit"), allowed))
                }
                (BranchConstant::Text(text), _) => {
                    let read = |text: &str| match unit {
                        "Pa" => si::<Stress>(text, Stress::si),
                        "Pa s" => si::<polycore::units::Viscosity>(text, |eta| eta.si()),
                        "1/s" => si::<Rate>(text, Rate::si),
                        _ => si::<PerSquaredStress>(text, |k| k.si()),
                    };
                    match unit {
                        "1" => Err(source.error(&path, format!("\"{text}\""), "a number")),
                        _ => read(text).map_err(|error| source.error(&path, error, unit)),
                    }
                }
            }
        };
        let constants: Vec<f64> = all.into_iter().map(value).collect::<Result<_, _>>()?;
        let mut branch =
            Self::build(self.spring, self.viscosity, &constants).map_err(|error| match error {
                Error::Parameter { parameter, value, allowed, .. } => {
                    let name = if parameter == "viscosity" { "eta" } else { parameter.as_str() };
                    let known = names.contains(&name);
                    let path = if known { format!("{key}.{name}") } else { key.clone() };
                    source.error(&path, format!("{parameter} {value:?}"), allowed)
                }
                other => source.error(&key, other, "constants in their ranges"),
            })?;
        let least = branch.spring.least_slope(1.0);
        if least.is_nan() || least <= 0.0 {
            let found =
                format!("a spring whose stress falls at a slope of {least:.3e} Pa below log strains of 1");
            return Err(source.error(&key, found, "a stress that grows with the strain"));
        }
        if let Some(shift) = &self.shift {
            branch.shift = shift.shift(source, &format!("{own}.shift"))?;
        }
        Ok(branch)
    }

    /// Returns true for a viscosity that grows with the pressure.
    pub fn has_pressure(&self) -> bool {
        self.parameters.get("pressure").is_some_and(|own| !matches!(own, BranchConstant::Number(0.0)))
    }

    /// Builds a branch from constants by name, in SI units.
    ///
    /// # Errors
    /// [`Error::Data`] for a constant that is missing or unknown; [`Error::Parameter`] for one out of its
    /// range.
    pub fn from_constants(
        spring: SpringKind,
        viscosity: ViscosityKind,
        constants: &BTreeMap<String, f64>,
    ) -> Result<Branch, Error> {
        let required = spring.names().len() + viscosity.names().len();
        let all = spring.names().iter().chain(viscosity.names()).chain(viscosity.optional());
        let names: Vec<&str> = all.map(|(name, _)| *name).collect();
        let other = constants.keys().find(|name| !names.contains(&name.as_str()));
        let missing = names[..required].iter().find(|name| !constants.contains_key(**name));
        let refuse = |found: String| {
            let reason = format!("{found}; allowed: {}", names.join(", "));
            Err(Error::Data { what: "constants of a branch".to_owned(), reason })
        };
        match (other, missing) {
            (Some(other), _) => refuse(format!("unknown `{other}`")),
            (None, Some(missing)) => refuse(format!("no `{missing}`")),
            (None, None) => {
                let value = |name: &&str| constants.get(*name).copied().unwrap_or(0.0);
                Self::build(spring, viscosity, &names.iter().map(value).collect::<Vec<_>>())
            }
        }
    }

    /// Returns spring and viscosity of a branch as scenes name them, and its constants with their units,
    /// without optional ones of 0.
    pub fn constants(branch: &Branch) -> ([&'static str; 2], Vec<NamedConstant>) {
        let (spring, kind, law): (_, _, &dyn Hyperelastic) = match &branch.spring {
            Spring::NeoHookean(law) => ("neo-hookean", SpringKind::NeoHookean, law),
            Spring::LopezPamies(law) if law.parameters().len() == 2 => {
                ("lopez-pamies-1", SpringKind::LopezPamies1, law)
            }
            Spring::LopezPamies(law) => ("lopez-pamies-2", SpringKind::LopezPamies2, law),
            Spring::EightChain(law) => ("eight-chain", SpringKind::EightChain, law),
        };
        let (viscosity, names, own) = match branch.viscosity {
            Viscosity::Constant(eta) => ("constant", ViscosityKind::Constant, vec![eta]),
            Viscosity::KumarLopezPamies { start, end, thickening, thinning, exponents: [first, second] } => (
                "kumar-lopez-pamies",
                ViscosityKind::KumarLopezPamies,
                vec![start, end, thickening, thinning, first, second],
            ),
            Viscosity::BergstromBoyce { rate, stress, power, creep, offset } => {
                ("bergstrom-boyce", ViscosityKind::BergstromBoyce, vec![rate, stress, power, creep, offset])
            }
            Viscosity::Eyring { rate, stress, pressure, softening: None } => {
                ("eyring", ViscosityKind::Eyring, vec![rate, stress, pressure])
            }
            Viscosity::Eyring { rate, stress, pressure, softening: Some(soft) } => {
                let [r0, r1, r2] = soft.shape;
                (
                    "eyring-softening",
                    ViscosityKind::EyringSoftening,
                    vec![rate, stress, soft.amount, r0, r1, r2, pressure],
                )
            }
        };
        let values = law.parameters().into_iter().map(|(_, value)| value).chain(own);
        let all = kind.names().iter().chain(names.names()).chain(names.optional()).zip(values);
        let given = all.filter(|((name, _), value)| *name != "pressure" || *value != 0.0);
        ([spring, viscosity], given.map(|(&(name, unit), value)| (name, value, unit)).collect())
    }

    fn build(spring: SpringKind, viscosity: ViscosityKind, constants: &[f64]) -> Result<Branch, Error> {
        let (p, q) = constants.split_at(spring.names().len());
        let spring = match spring {
            SpringKind::NeoHookean => Spring::NeoHookean(NeoHookean::new(p[0])?),
            SpringKind::LopezPamies1 | SpringKind::LopezPamies2 => {
                Spring::LopezPamies(LopezPamies::new(p.chunks_exact(2).map(|k| [k[0], k[1]]).collect())?)
            }
            SpringKind::EightChain => Spring::EightChain(EightChain::new(p[0], p[1])?),
        };
        let viscosity = match viscosity {
            ViscosityKind::Constant => Viscosity::Constant(q[0]),
            ViscosityKind::KumarLopezPamies => Viscosity::KumarLopezPamies {
                start: q[0],
                end: q[1],
                thickening: q[2],
                thinning: q[3],
                exponents: [q[4], q[5]],
            },
            ViscosityKind::BergstromBoyce => {
                Viscosity::BergstromBoyce { rate: q[0], stress: q[1], power: q[2], creep: q[3], offset: q[4] }
            }
            ViscosityKind::Eyring => {
                Viscosity::Eyring { rate: q[0], stress: q[1], pressure: q[2], softening: None }
            }
            ViscosityKind::EyringSoftening => {
                let softening = StrainSoftening { amount: q[2], shape: [q[3], q[4], q[5]] };
                Viscosity::Eyring { rate: q[0], stress: q[1], pressure: q[6], softening: Some(softening) }
            }
        };
        Branch::new(spring, viscosity)
    }
}

fn si<Q: FromStr<Err = UnitError>>(text: &str, value: impl Fn(Q) -> f64) -> Result<f64, UnitError> {
    text.parse().map(value)
}

impl MullinsSpec {
    /// Builds the softening; `key` is where this block stands.
    ///
    /// # Errors
    /// A constant out of its range.
    pub fn softening(&self, source: &Source, key: &str) -> Result<Mullins, SceneError> {
        let softening = Mullins { ratio: self.r, offset: self.m.si(), slope: self.beta };
        match softening.check() {
            Err(Error::Parameter { parameter, value, allowed, .. }) => {
                Err(source.error(&format!("{key}.{parameter}"), value, allowed))
            }
            Err(other) => Err(source.error(key, other, "constants in their ranges")),
            Ok(()) => Ok(softening),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Constants of a branch lead back to it, by their names and units.
    #[test]
    fn branches_return_from_their_constants() {
        let springs = [
            SpringKind::NeoHookean,
            SpringKind::LopezPamies1,
            SpringKind::LopezPamies2,
            SpringKind::EightChain,
        ];
        let viscosities = [
            ViscosityKind::Constant,
            ViscosityKind::KumarLopezPamies,
            ViscosityKind::BergstromBoyce,
            ViscosityKind::Eyring,
            ViscosityKind::EyringSoftening,
        ];
        let both = springs.into_iter().flat_map(|s| viscosities.map(|v| (s, v)));
        for (spring, viscosity, given) in both.flat_map(|(s, v)| [(s, v, v.optional()), (s, v, &[])]) {
            let names: Vec<_> = spring.names().iter().chain(viscosity.names()).chain(given).collect();
            let value = |k: usize, name: &str| match name {
                "c" => -0.5,
                "r_2" => -5.0,
                "eta_0" => 100.0,
                _ => 2.0 + k as f64,
            };
            let given: BTreeMap<String, f64> =
                names.iter().enumerate().map(|(k, (name, _))| ((*name).to_owned(), value(k, name))).collect();
            let branch = BranchSpec::from_constants(spring, viscosity, &given).expect("a branch");
            let (kinds, found) = BranchSpec::constants(&branch);
            let text = format!("spring = \"{}\"\nviscosity = \"{}\"\n[parameters]\n", kinds[0], kinds[1]);
            let spec: BranchSpec = toml::from_str(&text).expect("a block");
            assert_eq!(std::mem::discriminant(&spec.spring), std::mem::discriminant(&spring));
            assert_eq!(spec.viscosity, viscosity);
            assert_eq!(found.len(), names.len());
            for ((name, value, unit), (own, own_unit)) in found.into_iter().zip(names) {
                assert_eq!((name, unit), (*own, *own_unit));
                assert_eq!(value, given[name], "{name}");
            }
        }
    }
}
