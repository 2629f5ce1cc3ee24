//! A polymer that relaxes: branches of two phases, shifts, flow.

use super::locate_error::located_in;
use crate::mechanics::{Branch, EyringFlow, Phase, Shift, SolidifyingMaxwell, SpecificVolume};
use harness::scene::{SceneError, ShiftSpec, Source};
use polycore::units::{PerTemperature, Stress, Temperature, Time};
use serde::Deserialize;

/// Stiffness of the melt over the sum of all moduli.
const FLOOR: f64 = 1e-4;

/// Parameters of a phase and their keys.
const KEYS: [(&str, &str); 10] = [
    ("modulus of a branch, Pa", "moduli"),
    ("relaxation time, s", "times"),
    ("reference of the shift, K", "shift"),
    ("C1 of WLF", "shift"),
    ("C2 of WLF, K", "shift"),
    ("activation energy of the shift, J/mol", "shift"),
    ("retardation by crystals", "retardation"),
    ("stress of flow, Pa", "flow.stress"),
    ("reference of flow, K", "flow.temperature"),
    ("upper end of the range, K", "range"),
];

/// Solidifying Maxwell body σ = Ĉ(ν):[Σ_A E e + b(T) α Σ_N E e]: amorphous branches, and a network of
/// crystals whose share is α.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PolymerSpec {
    /// Poisson's ratio, above −1 and below 0.5.
    pub poisson: f64,
    /// Linear thermal expansion.
    pub expansion: PerTemperature,
    /// Linear shrinkage by complete crystallization; default 0.
    #[serde(default)]
    pub shrinkage: f64,
    /// Amorphous phase.
    pub amorphous: PhaseSpec,
    /// Network of crystals, of a semicrystalline material; default: none.
    pub network: Option<PhaseSpec>,
    /// Temperatures between which the factor b of the network falls from 1 to 0; default: b = 1.
    pub softening: Option<[Temperature; 2]>,
    /// Tensile strength, for `largest_mises_over_strength`.
    pub strength: Option<Stress>,
}

/// Maxwell branches, and the shift of their relaxation times.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhaseSpec {
    /// Young's moduli of the branches.
    pub moduli: Vec<Stress>,
    /// Relaxation time of each branch at the reference of the shift.
    pub times: Vec<Time>,
    /// Modulus that does not relax; default: none.
    pub elastic: Option<Stress>,
    /// Shift of the relaxation times with temperature; default: none.
    pub shift: Option<ShiftSpec>,
    /// Increase of ln τ from α = 0 to 1; default 0.
    #[serde(default)]
    pub retardation: f64,
    /// Flow of the solid under stress (Eyring); default: none.
    pub flow: Option<FlowSpec>,
    /// Temperatures between which the constants hold; a run that leaves them ends. Default: all.
    pub range: Option<[Temperature; 2]>,
}

/// Eyring flow: relaxation of shear is sinh(x)/x times as fast, x = √J₂/τ₀.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlowSpec {
    /// τ₀ at `temperature`, in proportion to the absolute temperature elsewhere.
    pub stress: Stress,
    /// Temperature of τ₀.
    pub temperature: Temperature,
}

impl PhaseSpec {
    fn build(&self, source: &Source, key: &str) -> Result<Phase, SceneError> {
        if self.moduli.len() != self.times.len() {
            let found = format!("{} times", self.times.len());
            let allowed = format!("one for each of the {} moduli", self.moduli.len());
            return Err(source.error(&format!("{key}.times"), found, allowed));
        }
        if self.moduli.is_empty() && self.elastic.is_none() {
            return Err(source.error(&format!("{key}.moduli"), "no branch", "at least one, or `elastic`"));
        }
        let relaxing = self.moduli.iter().zip(&self.times);
        let relaxing = relaxing.map(|(modulus, time)| Branch { modulus: modulus.si(), time: time.si() });
        let elastic = self.elastic.map(|modulus| Branch { modulus: modulus.si(), time: f64::INFINITY });
        let shift = match &self.shift {
            Some(shift) => shift.shift(source, &format!("{key}.shift"))?,
            None => Shift::None,
        };
        let flow = self.flow.as_ref();
        let phase = Phase {
            branches: relaxing.chain(elastic).collect(),
            shift,
            retardation: self.retardation,
            flow: flow.map(|flow| EyringFlow { stress: flow.stress.si(), reference: flow.temperature.si() }),
            range: self.range.map(|range| range.map(|t| t.si())),
        };
        phase.check().map_err(|error| located_in(source, key, &KEYS, &error))?;
        Ok(phase)
    }
}

impl PolymerSpec {
    /// Returns the law.
    ///
    /// # Errors
    /// Returns a [`SceneError`] with key, value and allowed values.
    pub fn build(&self, source: &Source) -> Result<SolidifyingMaxwell, SceneError> {
        let rule = |key: &str, found: f64, valid: bool, allowed: &str| match valid {
            true => Ok(()),
            false => Err(source.error(&format!("mechanics.law.polymer.{key}"), found, allowed)),
        };
        let expansion = self.expansion.si();
        rule("poisson", self.poisson, self.poisson > -1.0 && self.poisson < 0.5, "above -1 and below 0.5")?;
        rule("expansion", expansion, expansion.is_finite(), "finite")?;
        rule("shrinkage", self.shrinkage, self.shrinkage.abs() < 0.5, "above -0.5 and below 0.5")?;
        let strength = self.strength.map_or(f64::INFINITY, |strength| strength.si());
        rule("strength", strength, strength > 0.0, "above 0")?;
        let softening = self.softening.map(|pair| pair.map(|t| t.si()));
        if let Some([hard, soft]) = softening {
            rule("softening", soft, soft > hard, &format!("a second temperature above {hard} K"))?;
        }
        let amorphous = self.amorphous.build(source, "mechanics.law.polymer.amorphous")?;
        let network = self.network.as_ref().map(|spec| spec.build(source, "mechanics.law.polymer.network"));
        // ln v = 3γT − 3 shrinkage α: two phases of equal expansion
        let volume = SpecificVolume {
            densities: [1.0, (3.0 * self.shrinkage).exp()],
            glass_transition: 0.0,
            reference: 0.0,
            expansions: [3.0 * expansion; 3],
            crystallinity: 1.0,
        };
        Ok(SolidifyingMaxwell {
            volume,
            amorphous,
            network: network.transpose()?.unwrap_or_default(),
            softening,
            poisson: self.poisson,
            floor: FLOOR,
            strength,
        })
    }

    /// Refuses constants of crystals for a material that does not crystallize.
    ///
    /// # Errors
    /// Returns a [`SceneError`].
    pub fn check_crystals(
        &self,
        source: &Source,
        material: &str,
        crystallizes: bool,
    ) -> Result<(), SceneError> {
        for (key, given) in [
            ("network", self.network.is_some()),
            ("softening", self.softening.is_some()),
            ("shrinkage", self.shrinkage != 0.0),
            ("amorphous.retardation", self.amorphous.retardation != 0.0),
        ] {
            if given && !crystallizes {
                let why = format!("`{material}` does not crystallize; remove it");
                return Err(source.unexpected(&format!("mechanics.law.polymer.{key}"), why));
            }
        }
        Ok(())
    }
}
