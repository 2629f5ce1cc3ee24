//! Solids of parts of a body, in place of `material.solid` in its rest.

use super::interface::check_limit;
use super::solid::KEY;
use super::values::{DiscreteBody, plain};
use super::{Inclusion, Inclusions, Scene, SolidLaw};
use crate::bonds::{Bonds, Property};
use crate::material::{NonlocalSolid, PointLaw};
use crate::probe::AnySolid;
use harness::scene::{SceneError, Source};
use std::sync::Arc;

/// Greatest ratio of shear moduli of two parts: rounding of the stiffer part then hides less than 1e-6 of the
/// forces of the other.
const GREATEST_RATIO: f64 = 1e9;

impl Scene {
    /// Lists the solids with the keys of their blocks, that of the rest first.
    pub(super) fn solids(&self) -> impl Iterator<Item = (String, &SolidLaw)> {
        let parts = self.material.inclusions.iter().enumerate();
        let parts = parts.filter_map(|(index, part)| Some((key_of(index), part.solid.as_ref()?)));
        self.material.solid.iter().map(|own| (KEY.to_owned(), own)).chain(parts)
    }

    /// Returns true if a solid has a state.
    pub fn remembers(&self) -> bool {
        self.solids().any(|(_, own)| own.has_state())
    }

    /// Returns true for a law learnt from data.
    pub fn is_learnt(&self) -> bool {
        self.solids().any(|(_, own)| own.is_learnt())
    }
}

fn key_of(index: usize) -> String {
    format!("material.inclusions[{index}].solid")
}

/// Checks the parts of a scene with a solid.
///
/// # Errors
/// A [`SceneError`] that names a key of bond laws, or a limit that a solid does not take.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    for (index, part) in scene.material.inclusions.iter().enumerate() {
        let key = |name: &str| format!("material.inclusions[{index}].{name}");
        for (name, given) in [
            ("stiffness", part.stiffness != 1.0),
            ("law", part.law.is_some()),
            ("links", part.links.is_some()),
            ("dissociation", part.dissociation.is_some()),
            ("rescale", part.rescale.is_some()),
            ("prestrain", part.prestrain.is_some()),
        ] {
            if given {
                let why = "belongs to bond laws; a part of a solid has a `solid` of its own";
                return Err(source.unexpected(&key(name), why));
            }
        }
        if part.solid.is_none() && part.critical.is_none() && part.density.is_none() {
            let why = "its own `solid`, `critical` or `density`: it is like the rest of the body";
            return Err(source.missing(&key("solid"), why));
        }
        if let Some(critical) = &part.critical {
            check_limit(source, scene, &key("critical"), critical)?;
        }
        if scene.material.critical.is_some_and(|critical| critical.strength.is_some()) && part.solid.is_some()
        {
            let why = "at the border of two solids bonds soften below their strength";
            return Err(source.conflict(&key("solid"), "material.critical.strength", why));
        }
    }
    Ok(())
}

/// Builds the solids of a body, and its inclusions.
///
/// # Errors
/// An invalid material or shape, moduli too far apart.
pub fn solid_of_parts<'a, const D: usize>(
    source: &Source,
    scene: &'a Scene,
    body: &DiscreteBody<D>,
) -> Result<(AnySolid<D>, Inclusions<'a, D>), SceneError> {
    let (space, planes, driving) = (scene.body.space, scene.is_beside_surfaces(), scene.driving());
    // equal solids have one number: pressures are averaged over their neighbours
    let mut different: Vec<(String, &SolidLaw)> = Vec::new();
    for (key, own) in scene.solids() {
        if different.iter().all(|(_, other)| *other != own) {
            different.push((key, own));
        }
    }
    let built = different.iter().map(|(key, own)| own.build(source, key, space, planes, driving));
    let mut laws: Vec<Arc<dyn PointLaw<D>>> = built.collect::<Result<_, _>>()?;
    let inclusions = Inclusions::new(source, scene, body, &[])?;
    let parts = laws.split_off(1);
    for ((key, _), law) in different[1..].iter().zip(&parts) {
        let [own, rest] = [law, &laws[0]].map(|law| law.shear_modulus());
        if own.max(rest) > GREATEST_RATIO * own.min(rest) {
            let found = format!("a shear modulus of {} Pa beside {} Pa of the rest", plain(own), plain(rest));
            return Err(source.error(key, found, format!("at most {GREATEST_RATIO:.0e} apart")));
        }
    }
    let mut solid = NonlocalSolid::new(laws.remove(0));
    if !parts.is_empty() {
        let mut numbers = vec![0; body.bonds.sites()];
        for (part, members) in inclusions.members() {
            let Some(own) = &part.solid else { continue };
            let number = different.iter().position(|(_, other)| *other == own).unwrap_or(0);
            let number = u16::try_from(number).map_err(|_| {
                let found = format!("{} different solids", different.len());
                source.error("material.inclusions", found, format!("at most {}", u16::MAX))
            })?;
            members.iter().for_each(|&site| numbers[site as usize] = number);
        }
        let wrong = |error| source.error("material.inclusions", error, "a law for every part");
        solid = solid.with_parts(parts, numbers).map_err(wrong)?;
    }
    Ok((solid, inclusions))
}

/// Returns the shear modulus at rest of each particle over that of the rest.
pub fn relative_moduli<const D: usize>(solid: &AnySolid<D>, bonds: &dyn Bonds<D>) -> Property {
    if solid.laws().len() == 1 {
        return 1.0.into();
    }
    Property::new(bonds, |site, _| solid.law_at(site).shear_modulus() / solid.law().shear_modulus())
}

/// Returns a line for `peri check` of each part.
pub(super) fn explain(scene: &Scene) -> Vec<String> {
    let own = |(index, part): (usize, &Inclusion)| {
        let name =
            part.part.as_ref().map_or_else(|| format!("inclusions[{index}]"), |name| format!("`{name}`"));
        Some(format!("a solid of part {name}: `{}`", part.solid.as_ref()?.law.name()))
    };
    scene.material.inclusions.iter().enumerate().filter_map(own).collect()
}
