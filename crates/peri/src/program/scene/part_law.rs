//! Bond laws of a scene: that of the material, and those of parts of the body.

use super::inclusion::Inclusion;
use super::values::plain;
use super::{Inclusions, Material, Scene};
use crate::bonds::{Bonds, LawShares};
use crate::critical::Critical;
use crate::error::Error;
use crate::material::PartLaw;
use crate::potential::{BondPotential, Law};
use harness::scene::{SceneError, Source};
use std::sync::Arc;

/// Largest number of links and dissociation energy: far beyond any polymer, and far from where the chain's
/// force overflows.
const MOST: f64 = 1e9;

/// Bond law and its constants.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LawChoice {
    law: Law,
    links: Option<f64>,
    dissociation: Option<f64>,
    rescale: bool,
}

impl LawChoice {
    /// Builds the law.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a chain parameter out of its domain.
    fn build(&self) -> Result<Box<dyn BondPotential>, Error> {
        self.law.build(self.links.unwrap_or(1.0), self.dissociation.unwrap_or(1.0), self.rescale)
    }

    /// Checks the constants in the block `key`.
    ///
    /// # Errors
    /// A missing constant of a chain, or one out of its domain.
    fn check(&self, source: &Source, key: &str) -> Result<(), SceneError> {
        let constants = [("links", self.links, 2.0), ("dissociation", self.dissociation, 1.0)];
        for (name, value, least) in constants.into_iter().filter(|_| self.law.is_chain()) {
            let key = format!("{key}.{name}");
            match value {
                None => {
                    let why = format!("needed for `{}`: a number of at least {least}", self.law.name());
                    return Err(source.missing(&key, why));
                }
                Some(value) if !(least..=MOST).contains(&value) => {
                    return Err(source.error(&key, plain(value), format!("{least} to {MOST:e}")));
                }
                Some(_) => {}
            }
        }
        Ok(())
    }
}

/// Refuses constants of chains, given in the block `key`, of a law without chains.
///
/// # Errors
/// A [`SceneError`] that names the constant.
fn refuse_chains(
    source: &Source,
    key: &str,
    law: Law,
    [links, dissociation]: [Option<f64>; 2],
) -> Result<(), SceneError> {
    for (name, given) in [("links", links.is_some()), ("dissociation", dissociation.is_some())] {
        if given && !law.is_chain() {
            let why = format!("`{}` has no chains", law.name());
            return Err(source.unexpected(&format!("{key}.{name}"), why));
        }
    }
    Ok(())
}

impl Inclusion {
    /// Returns true if the part has a bond law of its own, or constants of it.
    pub(super) fn has_law(&self) -> bool {
        let constants = self.links.is_some() || self.dissociation.is_some();
        self.law.is_some() || constants || self.rescale.is_some()
    }
}

impl Material {
    /// Builds the bond law, that of the rest of a body with parts.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a chain parameter out of its domain.
    pub fn bond_law(&self) -> Result<Box<dyn BondPotential>, Error> {
        self.law_of_rest().build()
    }

    /// Returns the largest factor on the fictitious mass of dynamic relaxation of any law.
    pub fn mass_safety(&self) -> f64 {
        self.laws().iter().map(|choice| choice.law.mass_safety()).fold(0.0, f64::max)
    }

    fn law_of_rest(&self) -> LawChoice {
        let law = self.law.unwrap_or_default();
        let rescale = self.rescale.unwrap_or(law.rescales());
        LawChoice { law, links: self.links, dissociation: self.dissociation, rescale }
    }

    /// Returns the law of an inclusion, if it has one of its own.
    fn law_of(&self, part: &Inclusion) -> Option<LawChoice> {
        let rest = self.law_of_rest();
        let law = part.law.unwrap_or(rest.law);
        let given = self.rescale.filter(|_| law == rest.law);
        part.has_law().then(|| LawChoice {
            law,
            links: part.links.or(rest.links),
            dissociation: part.dissociation.or(rest.dissociation),
            rescale: part.rescale.or(given).unwrap_or(law.rescales()),
        })
    }

    /// Returns true if inclusions have laws of their own.
    pub fn has_laws_of_parts(&self) -> bool {
        self.laws().len() > 1
    }

    /// Lists the different laws, that of the rest first.
    fn laws(&self) -> Vec<LawChoice> {
        let mut laws = vec![self.law_of_rest()];
        for choice in self.inclusions.iter().filter_map(|part| self.law_of(part)) {
            if !laws.contains(&choice) {
                laws.push(choice);
            }
        }
        laws
    }
}

/// Bond laws of parts of a body, and the particles of all laws.
pub type LawsOfParts = (Vec<PartLaw<'static>>, Arc<LawShares>);

/// Builds the bond laws of parts of the body; `None` if all particles have that of the rest.
///
/// # Errors
/// [`Error::Parameter`] for a parameter out of its domain.
pub fn laws_of_parts<const D: usize>(
    scene: &Scene,
    bonds: &dyn Bonds<D>,
    inclusions: &Inclusions<D>,
) -> Result<Option<LawsOfParts>, Error> {
    let laws = scene.material.laws();
    if laws.len() == 1 {
        return Ok(None);
    }
    let mut numbers = vec![0; bonds.sites()];
    for (part, members) in inclusions.members() {
        let Some(choice) = scene.material.law_of(part) else { continue };
        let number = laws.iter().position(|own| *own == choice).unwrap_or(0);
        members.iter().for_each(|&site| numbers[site as usize] = number);
    }
    let of = |site: usize, _| (numbers[site], inclusions.micromodulus.value_at(site));
    let shares = LawShares::new(bonds, laws.len(), of)?;
    let built = laws[1..].iter().map(|choice| {
        let parts = scene.material.inclusions.iter().enumerate();
        let own = parts.filter(|(_, part)| scene.material.law_of(part).as_ref() == Some(choice));
        let name = |(index, part): (usize, &Inclusion)| match &part.part {
            Some(name) => format!("part `{name}`"),
            None => format!("`material.inclusions[{index}]`"),
        };
        let part = own.map(name).collect::<Vec<_>>().join(", ");
        Ok(PartLaw { part, law: Arc::from(choice.build()?) })
    });
    Ok(Some((built.collect::<Result<_, Error>>()?, Arc::new(shares))))
}

/// Checks the bond laws of a scene and what goes with several.
///
/// # Errors
/// A [`SceneError`] that names the key, the value found and what is allowed.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let material = &scene.material;
    let rest = material.law_of_rest();
    refuse_chains(source, "material", rest.law, [material.links, material.dissociation])?;
    rest.check(source, "material")?;
    for (index, part) in material.inclusions.iter().enumerate() {
        let Some(own) = material.law_of(part) else { continue };
        let key = format!("material.inclusions[{index}]");
        refuse_chains(source, &key, own.law, [part.links, part.dissociation])?;
        own.check(source, &key)?;
        if own == rest {
            continue;
        }
        let named = [
            ("law", part.law.is_some()),
            ("links", part.links.is_some()),
            ("dissociation", part.dissociation.is_some()),
        ];
        let name = named.iter().find(|(_, given)| *given).map_or("rescale", |(name, _)| name);
        let key = format!("{key}.{name}");
        if material.is_prestrained() {
            return Err(source.conflict(&key, "prestrain", "prestrained bonds have one law"));
        }
        if scene.is_mixed() {
            let why = "forces of several laws are summed in double precision";
            return Err(source.conflict(&key, "dynamics.precision", why));
        }
        let interfaces = scene.interface.iter().map(|one| &one.critical);
        let parts = material.inclusions.iter().map(|one| &one.critical);
        let energies = |critical: &Critical| critical.stretch.is_none();
        if interfaces.chain(parts).flatten().chain(&material.critical).any(energies) {
            let why = "with several laws bonds break at a `stretch`; other limits refer to one law";
            return Err(source.conflict(&key, "critical", why));
        }
    }
    Ok(())
}

/// Returns lines for `peri check`.
pub(super) fn explain<const D: usize>(scene: &Scene, bonds: &dyn Bonds<D>) -> Option<String> {
    let laws = scene.material.laws();
    let names: Vec<&str> = laws.iter().map(|choice| choice.law.name()).collect();
    let words = bonds.as_lattice().map_or(0, |lattice| lattice.stencil().offsets.len().div_ceil(64));
    let megabytes = memory_of_a_site(scene, 8.0 * words as f64) * bonds.sites() as f64 / 1e6;
    (laws.len() > 1).then(|| {
        let passes = "a pass of the kernel for each, plain loops if one needs a table";
        format!("bond laws {}: {megabytes:.1} MB, {passes}", names.join(", "))
    })
}

/// Returns the bytes of a site for the shares of several laws, and for their passes over bonds of `masks`
/// bytes a site.
pub(super) fn memory_of_a_site(scene: &Scene, masks: f64) -> f64 {
    let laws = scene.material.laws().len() as f64;
    // number and shares of laws, numbers and sites of particles while they are made; factors and bonds of
    // passes, stiffness of all particles
    if laws > 1.0 { 2.0 + 8.0 * laws + 8.0 + 4.0 + laws * (8.0 + 8.0 + masks) } else { 0.0 }
}

/// Returns the bytes of a bond of a cloud for its weights in the passes of several laws.
pub(super) fn memory_of_a_bond(scene: &Scene) -> f64 {
    let laws = scene.material.laws().len();
    if laws > 1 { 8.0 * laws as f64 } else { 0.0 }
}
