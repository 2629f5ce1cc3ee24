//! `[material.network]`: modulus and chains of a material from the chemistry of its network.

use super::values::plain;
use super::{Material, SolidKind};
use harness::scene::{SceneError, Source};
use polycore::network::{
    EndLinked, Error, KnownPolymer, KuhnChain, LinkerMix, Melt, PolymerNetwork, PrimaryChains, Reacted,
    Vulcanized, known_polymer,
};
use polycore::units::{
    Density, EnergyPerArea, Length, MolarEnergy, MolarMass, Quantity, Stress, Temperature,
};
use serde::Deserialize;

/// Key of the block.
const KEY: &str = "material.network";

/// Distribution of the lengths of long chains that are cross-linked at random.
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ChainsSpec {
    /// Flory's most probable distribution, M_w = 2 M_n.
    MostProbable,
    /// Chains of equal length.
    OneLength,
}

/// Network, end-linked or vulcanized, whose chemistry gives `youngs_modulus` and `links` of a bond law, or
/// `shear_modulus` and `links` of an `eight-chain` solid.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChemistrySpec {
    /// Polymer whose data are used where the keys below do not give them: PDMS, polyisoprene,
    /// polybutadiene, polyethylene, polypropylene, PEO.
    pub polymer: Option<String>,
    /// Kuhn length b.
    pub kuhn_length: Option<Length>,
    /// Molar mass of a Kuhn segment M_K.
    pub kuhn_mass: Option<MolarMass>,
    /// Molar mass per backbone bond M_b.
    pub bond_mass: Option<MolarMass>,
    /// Long chains cross-linked at random, in place of strands linked at their ends: their distribution.
    pub primary_chains: Option<ChainsSpec>,
    /// Cross-linked units per number-average chain, with `primary_chains`.
    pub units: Option<f64>,
    /// Molar mass of the strands, or of the `primary_chains`, number average.
    pub strand_mass: MolarMass,
    /// Molar mass of the cross-linkers; default: none.
    pub linker_mass: Option<MolarMass>,
    /// Functionality of the cross-linkers; a mean is made of the two whole numbers beside it; not with
    /// `primary_chains`.
    pub functionality: Option<f64>,
    /// Groups of the cross-linkers per group of the chains; default: 1.
    pub ratio: Option<f64>,
    /// Conversion of the groups of the cross-linkers.
    pub conversion: Option<f64>,
    /// Measured sol fraction, in place of a conversion.
    pub sol_fraction: Option<f64>,
    /// Share of the chains' groups on chains with one group; default: 0.
    pub monofunctional_share: Option<f64>,
    /// Molar mass of the chains with one group.
    pub monofunctional_mass: Option<MolarMass>,
    /// Sol is extracted, and the gel dried; default: it is left in.
    #[serde(default)]
    pub extracted: bool,
    /// Density; default: that of the polymer.
    pub density: Option<Density>,
    /// Temperature; default: 298.15 K.
    pub temperature: Option<Temperature>,
    /// Plateau modulus that entanglements give if all are trapped; default: that of the polymer.
    pub entanglement_modulus: Option<Stress>,
    /// Energy per mole of backbone bonds of a strand that breaks: gives `critical.fracture_energy` by the
    /// theory of Lake and Thomas. 60 to 350 kJ/mol for C–C.
    pub bond_energy: Option<MolarEnergy>,
}

impl ChemistrySpec {
    /// Computes the network.
    ///
    /// # Errors
    /// A missing or contradictory key, a composition below its gel point, numbers outside their range.
    pub fn network(&self, source: &Source) -> Result<PolymerNetwork, SceneError> {
        let key = |field: &str| format!("{KEY}.{field}");
        let known = match &self.polymer {
            Some(name) => Some(known_polymer(name).map_err(|error| source.refused(&key("polymer"), error))?),
            None => None,
        };
        if let Some(chains) = self.primary_chains {
            return self.vulcanized(source, chains, &self.melt(source, known)?);
        }
        if self.units.is_some() {
            return Err(source.unexpected(&key("units"), "needs `primary_chains` beside it"));
        }
        let Some(functionality) = self.functionality else {
            return Err(source.missing(&key("functionality"), "needed without `primary_chains`"));
        };
        let reacted = match (self.conversion, self.sol_fraction) {
            (Some(_), Some(_)) => {
                let why = "one follows from the other";
                return Err(source.conflict(&key("sol_fraction"), "conversion", why));
            }
            (Some(conversion), None) => Reacted::Conversion(conversion),
            (None, Some(sol)) => Reacted::SolFraction(sol),
            (None, None) => {
                let why = "needed: the conversion of the groups, or the measured `sol_fraction`";
                return Err(source.missing(&key("conversion"), why));
            }
        };
        let linkers =
            LinkerMix::mean(functionality).map_err(|error| source.refused(&key("functionality"), error))?;
        let recipe = EndLinked::new(1, self.strand_mass.si(), reacted)
            .linkers(linkers)
            .ratio(self.ratio.unwrap_or(1.0))
            .linker_mass(self.linker_mass.map_or(0.0, MolarMass::si))
            .ends(
                self.monofunctional_share.unwrap_or(0.0),
                self.monofunctional_mass.map_or(0.0, MolarMass::si),
            );
        let melt = self.melt(source, known)?;
        recipe.network(&melt).map_err(|error| {
            let field = match error {
                Error::TooLittleSol { .. } => "sol_fraction",
                Error::TooShort { .. } => "strand_mass",
                Error::NoGel { .. } | Error::TooManyReacted { .. } if self.conversion.is_some() => {
                    "conversion"
                }
                _ => return source.refused(KEY, error),
            };
            source.refused(&key(field), error)
        })
    }

    /// Computes the network of long chains that are cross-linked at random.
    fn vulcanized(
        &self,
        source: &Source,
        chains: ChainsSpec,
        melt: &Melt,
    ) -> Result<PolymerNetwork, SceneError> {
        let key = |field: &str| format!("{KEY}.{field}");
        for (field, given) in [
            ("functionality", self.functionality.is_some()),
            ("ratio", self.ratio.is_some()),
            ("conversion", self.conversion.is_some()),
            ("linker_mass", self.linker_mass.is_some()),
            ("monofunctional_share", self.monofunctional_share.is_some()),
            ("monofunctional_mass", self.monofunctional_mass.is_some()),
        ] {
            if given {
                return Err(source.conflict(&key(field), "primary_chains", "of end-linked networks only"));
            }
        }
        let chains = match chains {
            ChainsSpec::MostProbable => PrimaryChains::MostProbable,
            ChainsSpec::OneLength => PrimaryChains::OneLength,
        };
        let mass = self.strand_mass.si();
        let (field, recipe) = match (self.units, self.sol_fraction) {
            (Some(_), Some(_)) => {
                return Err(source.conflict(&key("sol_fraction"), "units", "one follows from the other"));
            }
            (Some(units), None) => ("units", Ok(Vulcanized::new(chains, mass, units))),
            (None, Some(sol)) => ("sol_fraction", Vulcanized::with_sol(chains, mass, sol)),
            (None, None) => {
                let why = "needed: cross-linked units per chain, or the measured `sol_fraction`";
                return Err(source.missing(&key("units"), why));
            }
        };
        recipe.and_then(|recipe| recipe.network(melt)).map_err(|error| source.refused(&key(field), error))
    }

    /// Returns the melt: keys before the data of the polymer.
    fn melt(&self, source: &Source, known: Option<&KnownPolymer>) -> Result<Melt, SceneError> {
        let missing = |field: &str| {
            let why = match known {
                Some(polymer) => format!("needed: unknown for {}", polymer.name),
                None => "needed without a `polymer` of which it is known".to_owned(),
            };
            source.missing(&format!("{KEY}.{field}"), why)
        };
        fn or<D: polycore::units::Dimension>(given: Option<Quantity<D>>, known: Option<f64>) -> Option<f64> {
            given.map(Quantity::si).or(known)
        }
        let chain = known.map(|polymer| polymer.chain);
        let length = or(self.kuhn_length, chain.map(|chain| chain.length));
        let mass = or(self.kuhn_mass, chain.map(|chain| chain.mass));
        let bond = or(self.bond_mass, chain.map(|chain| chain.bond_mass));
        let density = or(self.density, known.and_then(|polymer| polymer.density));
        let plateau = or(self.entanglement_modulus, known.and_then(|polymer| polymer.entanglement_modulus));
        Ok(Melt {
            density: density.ok_or_else(|| missing("density"))?,
            temperature: or(self.temperature, Some(298.15)).unwrap_or(298.15),
            entanglement_modulus: plateau.ok_or_else(|| missing("entanglement_modulus"))?,
            chain: Some(KuhnChain {
                length: length.ok_or_else(|| missing("kuhn_length"))?,
                mass: mass.ok_or_else(|| missing("kuhn_mass"))?,
                bond_mass: bond.ok_or_else(|| missing("bond_mass"))?,
            }),
            extracted: self.extracted,
        })
    }
}

/// Puts what follows from `[material.network]` in the place of the keys that it replaces: `youngs_modulus`
/// = 3G (rubber is incompressible) and, for chain laws, `links` = n; `shear_modulus` = G and `links` = n of
/// an `eight-chain` solid; with a `bond_energy` also `critical.fracture_energy`.
///
/// # Errors
/// As [`ChemistrySpec::network`]; keys given beside it.
pub fn resolve_network(source: &Source, material: &mut Material) -> Result<(), SceneError> {
    let Some(spec) = &material.network else { return Ok(()) };
    let network = spec.network(source)?;
    let twice = |key: &str| Err(source.conflict(key, "network", "it follows from the network"));
    let modulus = network.modulus();
    let links = network.segments();
    match &mut material.solid {
        Some(solid) if solid.law != SolidKind::EightChain => {
            let why = "only an `eight-chain` solid takes its constants from it";
            return Err(source.conflict(KEY, "solid", why));
        }
        Some(solid) => {
            if solid.shear_modulus.is_some() {
                return twice("material.solid.shear_modulus");
            }
            if solid.links.is_some() {
                return twice("material.solid.links");
            }
            (solid.shear_modulus, solid.links) = (Some(Stress::from_si(modulus)), links);
        }
        None => {
            if material.youngs_modulus.is_some() {
                return twice("material.youngs_modulus");
            }
            if material.links.is_some() {
                return twice("material.links");
            }
            material.youngs_modulus = Some(Stress::from_si(3.0 * modulus));
            material.links = links.filter(|_| material.law.unwrap_or_default().is_chain());
        }
    }
    if let (Some(energy), Some(chain), Some(segments)) = (spec.bond_energy, network.melt.chain, links) {
        if !(energy.si() > 0.0 && energy.si().is_finite()) {
            let found = format!("{} J/mol", plain(energy.si()));
            return Err(source.error(&format!("{KEY}.bond_energy"), found, "a positive molar energy"));
        }
        let mut critical = material.critical.unwrap_or_default();
        if !critical.alternatives().is_empty() {
            return Err(source.conflict("material.critical", "network.bond_energy", "both give it"));
        }
        let of_bonds = chain.fracture_energy(network.strands, segments, energy.si()) * network.shrinkage();
        critical.fracture_energy = Some(EnergyPerArea::from_si(of_bonds));
        material.critical = Some(critical);
    }
    Ok(())
}

/// Returns the lines of `peri check` about the network.
///
/// # Errors
/// As [`ChemistrySpec::network`].
pub fn explain_network(source: &Source, material: &Material) -> Result<Vec<String>, SceneError> {
    let Some(spec) = &material.network else { return Ok(Vec::new()) };
    let network = spec.network(source)?;
    let mega = |stress: f64| format!("{:.4} MPa", stress / 1e6);
    let least = match network.least_conversion {
        Some(least) => format!(", without loops at least {least:.4}"),
        None => String::new(),
    };
    let reacted = match spec.primary_chains {
        Some(_) => format!("{:.4} cross-linked units per chain", network.conversion[0]),
        None => format!("conversion {:.4} and {:.4}{least}", network.conversion[0], network.conversion[1]),
    };
    let mut lines = vec![
        format!(
            "a network: {reacted}; sol {:.4}; {:.1} mol/m³ effective strands of \
             {:.3} kg/mol",
            network.sol.mass, network.strands, network.strand_mass
        ),
        format!(
            "its shear modulus {}: phantom {} × {:.4}, entangled {}; E = 3G = {}",
            mega(network.modulus()),
            mega(network.phantom()),
            network.stiffening(),
            mega(network.entangled()),
            mega(3.0 * network.modulus())
        ),
    ];
    if let (Some(segments), Some(locking), Some([low, high])) =
        (network.segments(), network.locking_stretch(), network.fracture_energy())
    {
        lines.push(format!(
            "its chains of {segments:.2} Kuhn segments, locking at a stretch of about {locking:.2}; fracture \
             energy {low:.3} to {high:.3} J/m² (Lake and Thomas, 60 to 350 kJ/mol: an estimate)"
        ));
    }
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NETWORK: &str = "[network]\npolymer = \"PDMS\"\nstrand_mass = \"10 kg/mol\"\nfunctionality = 4\n\
                           conversion = 1\nentanglement_modulus = \"0 Pa\"\n";

    fn resolved(text: &str) -> Result<Material, SceneError> {
        let source = Source::new("material.toml", format!("version = 1\n{text}"));
        let mut material: Material = source.parse()?;
        resolve_network(&source, &mut material)?;
        Ok(material)
    }

    /// A perfect phantom network: G = k(n) ρRT/(2M), n = M/M_K, E = 3G; fracture energy of
    /// formulation-networks.md, section C: 30.6 J/m² for 350 kJ/mol.
    #[test]
    fn constants_of_bond_laws_and_solids() {
        let segments = 10.0 / 0.381;
        let modulus = KuhnChain::stiffening(segments) * 48.5 * polycore::network::GAS_CONSTANT * 298.15;
        let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
        let linear = resolved(&format!("law = \"linear\"\n{NETWORK}bond_energy = \"350 kJ/mol\"\n")).unwrap();
        assert!(close(linear.youngs_modulus.unwrap().si(), 3.0 * modulus) && linear.links.is_none());
        let energy = linear.critical.unwrap().fracture_energy.unwrap().si();
        assert!((energy - 30.6).abs() < 0.05, "{energy}");
        let chains = resolved(&format!("dissociation = 1200\n{NETWORK}")).unwrap();
        assert!(close(chains.links.unwrap(), segments) && chains.critical.is_none());
        let solid = resolved(&format!("solid = {{ law = \"eight-chain\" }}\n{NETWORK}")).unwrap();
        let constants = solid.solid.unwrap();
        assert!(close(constants.shear_modulus.unwrap().si(), modulus) && solid.youngs_modulus.is_none());
        assert!(close(constants.links.unwrap(), segments));
        let source = Source::new("material.toml", format!("version = 1\nlaw = \"linear\"\n{NETWORK}"));
        let lines = explain_network(&source, &source.parse().unwrap()).unwrap().join("\n");
        assert!(lines.contains("26.25 Kuhn segments") && lines.contains("5.238 to 30.555 J/m²"), "{lines}");
    }

    /// Vulcanized chains: E = 3G of the library, and compositions without a network.
    #[test]
    fn vulcanized_rubber() {
        let chains = |rest: &str| {
            resolved(&format!(
                "law = \"linear\"\n[network]\npolymer = \"PDMS\"\nstrand_mass = \"100 kg/mol\"\n\
                 primary_chains = \"one-length\"\n{rest}\n"
            ))
        };
        let found = chains("units = 2").unwrap().youngs_modulus.unwrap().si();
        let melt = Melt::of_polymer("PDMS").unwrap();
        let network = Vulcanized::new(PrimaryChains::OneLength, 100.0, 2.0).network(&melt).unwrap();
        assert!((found / (3.0 * network.modulus()) - 1.0).abs() < 1e-12);
        for (rest, message) in [
            ("units = 0.9", "no gel"),
            ("units = 2\nfunctionality = 4", "of end-linked networks only"),
            ("units = 2\nsol_fraction = 0.1", "one follows from the other"),
            ("", "missing `material.network.units`"),
        ] {
            let error = chains(rest).unwrap_err().plain();
            assert!(error.contains(message), "{error}\n{message}");
        }
    }

    /// Keys given twice, missing ones, and compositions without a network.
    #[test]
    fn refusals() {
        for (head, from, to, message) in [
            ("youngs_modulus = \"1 MPa\"\n", "", "", "material.youngs_modulus"),
            ("links = 20\n", "", "", "material.links"),
            ("solid = { law = \"eight-chain\", links = 20 }\n", "", "", "material.solid.links"),
            ("solid = { law = \"correspondence\" }\n", "", "", "only an `eight-chain` solid"),
            (
                "critical = { stretch = 2 }\n",
                "[network]",
                "[network]\nbond_energy = \"60 kJ/mol\"",
                "both give it",
            ),
            ("", "conversion = 1", "conversion = 0.5", "no gel: (f - 1) p_A p_B = 0.7500"),
            ("", "conversion = 1", "conversion = 1.1", "p_B = r p_A = 1.1000 is above 1"),
            ("", "conversion = 1", "", "missing `material.network.conversion`"),
            ("", "conversion = 1", "conversion = 1\nsol_fraction = 0.1", "one follows from the other"),
            ("", "conversion = 1", "sol_fraction = 0.01\nratio = 0.8", "stays soluble"),
            ("", "functionality = 4", "functionality = 0.5", "functionality = 0.5 is outside 1 to 1000"),
            ("", "\"10 kg/mol\"", "\"0.4 kg/mol\"", "too few for a chain"),
            ("", "\"10 kg/mol\"", "\"-10 kg/mol\"", "molar mass of the strands = -10"),
            ("", "\"PDMS\"", "\"PDMZ\"", "unknown polymer `PDMZ`"),
            ("", "\"PDMS\"", "\"PEO\"", "missing `material.network.density`"),
            (
                "",
                "polymer = \"PDMS\"\n",
                "density = \"1 g/cm^3\"\n",
                "missing `material.network.kuhn_length`",
            ),
        ] {
            let text = format!("{head}{}", NETWORK.replacen(from, to, 1));
            let error = resolved(&text).unwrap_err();
            assert!(error.plain().contains(message), "{text}\n{}\n{message}", error.plain());
        }
    }
}
