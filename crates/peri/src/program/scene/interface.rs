//! Interfaces between parts of a body, and particles whose bonds never break.

use super::limits::{LimitOf, limit_error};
use super::shapes::operations;
use super::values::{DiscreteBody, ONE_OF_THEM, plain, positive};
use super::{Scene, tearing};
use crate::bonds::{Property, sever_pairs};
use crate::critical::{Convention, Critical, ONE_OF};
use crate::geometry::{Parts, inside};
use crate::solver::{Criterion, SlidingBonds};
use harness::scene::{SceneError, Source};
use serde::Deserialize;

/// Interface between two parts of a body of shapes, see `body.shapes`.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InterfaceSpec {
    /// Names of the two parts.
    pub between: [String; 2],
    /// Limit of the bonds from one part to the other, in place of those of the parts: it may be lower or
    /// higher. A bond across several interfaces takes the lowest.
    pub critical: Option<Critical>,
    /// True: no bond crosses the interface.
    #[serde(default)]
    pub unbonded: bool,
    /// True: its compressed bonds break, too, where the parts slide along each other.
    #[serde(default)]
    pub slides: bool,
}

impl InterfaceSpec {
    /// Returns its name in reports and messages.
    pub fn name(&self) -> String {
        self.between.join("-")
    }
}

impl Scene {
    /// Lists the limits of bonds: that of the material, then those of interfaces.
    pub fn limits(&self) -> impl Iterator<Item = Critical> {
        self.material.critical.into_iter().chain(self.interface.iter().filter_map(|one| one.critical))
    }

    /// Returns true if some bonds have a strength.
    pub fn has_strength(&self) -> bool {
        let parts = self.material.inclusions.iter().filter_map(|part| part.critical);
        self.limits().chain(parts).any(|limit| limit.strength.is_some())
    }

    /// Returns the convention of the first limit, which the others follow unless they have their own.
    pub fn convention(&self) -> Option<Convention> {
        self.limits().next().and_then(|limit| limit.convention)
    }

    /// Returns true if bonds may break.
    pub fn breaks(&self) -> bool {
        self.limits().next().is_some()
    }
}

/// Checks unbreakable shapes, and the names and limits of interfaces.
///
/// # Errors
/// Unbreakable shapes where nothing breaks, a body without parts, unknown or equal names, a pair named twice,
/// none or both of `critical` and `unbonded`, and a limit that the material does not take.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    if !scene.material.unbreakable.is_empty() {
        let key = "material.unbreakable";
        if !scene.breaks() {
            return Err(source.unexpected(key, "needs `material.critical`, or no bond breaks at all"));
        }
    }
    for (index, interface) in scene.interface.iter().enumerate() {
        let key = format!("interface[{index}]");
        let [one, other] = &interface.between;
        for (end, name) in [one, other].into_iter().enumerate() {
            part_number(source, scene, &format!("{key}.between[{end}]"), name)?;
        }
        if one == other {
            return Err(source.error(&format!("{key}.between"), format!("`{one}` twice"), "two parts"));
        }
        let same = |before: &InterfaceSpec| before.between.contains(one) && before.between.contains(other);
        if let Some(before) = scene.interface[..index].iter().position(same) {
            let found = format!("`{one}` and `{other}`, which interface[{before}] joins");
            return Err(source.error(&format!("{key}.between"), found, "each pair once"));
        }
        match (&interface.critical, interface.unbonded) {
            (None, false) => {
                let allowed = "`critical`, the limit of its bonds, or `unbonded = true`";
                return Err(source.error(&key, "neither `critical` nor `unbonded`", allowed));
            }
            (Some(_), true) => {
                return Err(source.conflict(&format!("{key}.critical"), "unbonded", ONE_OF_THEM));
            }
            (Some(critical), false) => check_limit(source, scene, &format!("{key}.critical"), critical)?,
            (None, true) => {}
        }
        if interface.slides {
            check_sliding(source, scene, index)?;
        }
    }
    Ok(())
}

/// Checks an interface whose compressed bonds break where its parts slide.
///
/// # Errors
/// No limit, bonds that soften or break by their energy, and prestrains.
fn check_sliding(source: &Source, scene: &Scene, index: usize) -> Result<(), SceneError> {
    let [key, limit] = ["slides", "critical"].map(|name| format!("interface[{index}].{name}"));
    let Some(critical) = scene.interface[index].critical else {
        return Err(source.unexpected(&key, "needs `critical`, the limit of its bonds"));
    };
    if scene.softens() || critical.convention == Some(Convention::Softening) || critical.strength.is_some() {
        return Err(source.conflict(&key, &limit, "bonds that break at once, by the `tearing` convention"));
    }
    if scene.material.solid.is_some() && critical.stretch.is_none() {
        return Err(source.conflict(
            &key,
            &limit,
            "bonds of a law, or of a `solid` that break by a `stretch`",
        ));
    }
    if scene.material.is_prestrained() {
        return Err(
            source.unexpected(&key, "bonds with prestrains break in tension only; remove one of both")
        );
    }
    if scene.solver.refine > 1 {
        return Err(source.conflict(
            &key,
            "solver.refine",
            "slip is looked at at the ends of steps; take more",
        ));
    }
    Ok(())
}

/// Checks the limit of bonds of an interface or a part.
///
/// # Errors
/// A limit that the material does not take.
pub(super) fn check_limit(
    source: &Source,
    scene: &Scene,
    key: &str,
    critical: &Critical,
) -> Result<(), SceneError> {
    if scene.material.solid.is_none() {
        let given = critical.alternatives();
        return match given.len() {
            1 => Ok(()),
            _ => Err(source.error(key, tearing::listed(&given), ONE_OF)),
        };
    }
    super::solid::check_limit(source, key, critical)?;
    if critical.driving.is_some() {
        let why = "all bonds have that of `material.critical`";
        return Err(source.unexpected(&format!("{key}.driving"), why));
    }
    if let Some(strength) = critical.strength {
        let key = format!("{key}.strength");
        positive(source, &key, strength.si(), "Pa")?;
        if critical.fracture_energy.is_none() {
            return Err(source.unexpected(&key, "needs `fracture_energy` beside it"));
        }
        if scene.material.inclusions.iter().any(|part| part.solid.is_some()) {
            let why = "the energy at a strength is that of one solid";
            return Err(source.conflict(&key, "material.inclusions.solid", why));
        }
    }
    let kind = |critical: &Critical| match (critical.stretch, critical.strength) {
        (Some(_), _) => "`stretch`",
        (None, None) => "`fracture_energy`",
        (None, Some(_)) => "`fracture_energy` with `strength`",
    };
    if scene.limits().any(|other| kind(&other) != kind(critical)) {
        let allowed = "the same kind of limit as all other bonds of a `solid`";
        return Err(source.error(key, kind(critical), allowed));
    }
    Ok(())
}

/// Returns the names of the parts of a body, each once.
fn part_names(scene: &Scene) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for name in
        scene.body.shapes().iter().filter_map(|shape| shape.part_name().filter(|_| shape.add.is_some()))
    {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// Returns the number of a part by its name.
///
/// # Errors
/// A body without parts, or an unknown name.
pub(super) fn part_number(source: &Source, scene: &Scene, key: &str, name: &str) -> Result<u32, SceneError> {
    let names = part_names(scene);
    if names.is_empty() {
        let found = format!("`{name}` of a body without named parts");
        return Err(source.error(key, found, "a name that shapes of the body have as their `part`"));
    }
    let number = names.iter().position(|known| *known == name);
    number.map(|number| number as u32).ok_or_else(|| source.unknown(key, name, &names))
}

/// Returns the parts of a body, numbered as their names; shapes without one form another part.
pub(super) fn parts_of<const D: usize>(scene: &Scene, body: &DiscreteBody<D>) -> Parts<D> {
    let names = part_names(scene);
    let number = |name: &str| names.iter().position(|known| *known == name).unwrap_or(names.len()) as u32;
    let each = scene.body.shapes().iter().map(|shape| shape.part_name().map_or(names.len() as u32, number));
    Parts::new(&body.operations, &each.collect::<Vec<u32>>())
}

/// Warns of unbonded parts that would pass through each other.
pub(super) fn free_to_pass(scene: &Scene) -> Option<String> {
    let opens = |one: &&InterfaceSpec| one.unbonded || one.slides;
    let open = scene.interface.iter().find(opens).filter(|_| scene.contact.is_none())?;
    let [one, other] = &open.between;
    let how = if open.unbonded { "are unbonded and" } else { "slide, and once unbonded they" };
    Some(format!(
        "parts `{one}` and `{other}` {how} may pass through each other: a `[contact]` block lets them touch"
    ))
}

/// Finds the bonds across each interface, and severs those of unbonded ones.
///
/// # Errors
/// An interface that no bond crosses.
pub(super) fn cross_interfaces<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &mut DiscreteBody<D>,
) -> Result<(), SceneError> {
    if scene.interface.is_empty() {
        return Ok(());
    }
    let mut pairs = Vec::new();
    for (index, InterfaceSpec { between: [one, other], .. }) in scene.interface.iter().enumerate() {
        let number = |name| part_number(source, scene, &format!("interface[{index}].between"), name);
        pairs.push([number(one)?, number(other)?]);
    }
    let parts = parts_of(scene, body);
    let mut across = parts.bonds_across(&*body.bonds, &pairs);
    for (interface, bonds) in scene.interface.iter().zip(&across) {
        if interface.unbonded {
            sever_pairs(&mut *body.bonds, bonds);
        }
    }
    for (index, (interface, bonds)) in scene.interface.iter().zip(&mut across).enumerate() {
        if !interface.unbonded {
            // those that also cross an unbonded interface have no limit
            bonds.retain(|&[a, b]| body.bonds.is_bonded(a as usize, b as usize));
        }
        if bonds.is_empty() {
            let [one, other] = &interface.between;
            let spacing = plain((body.bonds.spacing() * 1e9).round() / 1e6);
            let gap = plain((parts.gap(pairs[index]) * 1e9).round() / 1e6);
            let apart = if gap == "0" { String::new() } else { format!(", {gap} mm from each other") };
            let found = format!(
                "`{one}` and `{other}`{apart}, between which no bond of particles {spacing} mm apart passes"
            );
            let allowed = "parts that touch and are not separated by cracks";
            return Err(source.error(&format!("interface[{index}].between"), found, allowed));
        }
    }
    body.interfaces = across;
    Ok(())
}

/// Returns the bonds across interfaces that slide, by their sites.
pub fn sliding_bonds(scene: &Scene, interfaces: &[Vec<[u32; 2]>]) -> SlidingBonds {
    let each = scene.interface.iter().zip(interfaces).filter(|(interface, _)| interface.slides);
    SlidingBonds::new(each.flat_map(|(_, bonds)| bonds).copied())
}

/// Gives bonds across interfaces their own limits in place of `rest`, bonds of unbreakable particles none.
/// `stiffness` is that of the particles.
///
/// # Errors
/// A limit out of its domain, and unbreakable shapes without particles.
pub fn limits_of_bonds<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
    rest: Property,
    stiffness: &Property,
    limit: LimitOf<f64>,
) -> Result<Property, SceneError> {
    let mut limits = Vec::new();
    for (index, (interface, bonds)) in scene.interface.iter().zip(&body.interfaces).enumerate() {
        let Some(critical) = interface.critical else { continue };
        let key = format!("interface[{index}].critical");
        // neighbours of equal stiffness share one bisection
        let mut last = None;
        for &[a, b] in bonds {
            let mean = 0.5 * (stiffness.value_at(a as usize) + stiffness.value_at(b as usize));
            let own = match last {
                Some((before, own)) if before == mean => own,
                _ => limit(critical, mean).map_err(|error| limit_error(source, &key, error))?,
            };
            limits.push(([a, b], own));
            last = Some((mean, own));
        }
    }
    let guarded = unbreakable(source, scene, body)?;
    Ok(rest.with_bonds(limits).guarded(&guarded, body.bonds.sites()))
}

/// Finds the particles whose bonds never break.
fn unbreakable<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
) -> Result<Vec<u32>, SceneError> {
    let key = "material.unbreakable";
    let shapes = operations::<D>(source, key, &scene.material.unbreakable)?;
    let within = |&site: &u32| inside(&shapes, body.bonds.position(site as usize));
    let sites: Vec<u32> = body.bonds.particles().iter().copied().filter(within).collect();
    if sites.is_empty() && !shapes.is_empty() {
        return Err(source.error(key, "shapes without particles", "shapes with at least one"));
    }
    Ok(sites)
}

/// Returns lines for `peri check`.
pub(super) fn explain<const D: usize>(
    scene: &Scene,
    body: &DiscreteBody<D>,
    criterion: Option<&Criterion>,
) -> Vec<String> {
    let of = |(interface, bonds): (&InterfaceSpec, &Vec<[u32; 2]>)| {
        let least = |limits: &Property| {
            bonds.iter().map(|&[a, b]| limits.weaker(a as usize, b as usize)).fold(f64::INFINITY, f64::min)
        };
        let limit = match criterion {
            _ if interface.unbonded => "severed".to_owned(),
            Some(Criterion::Stretch(limits)) => format!("that break at a stretch of {:.6}", least(limits)),
            Some(Criterion::Energy(limits)) => {
                format!("that break when they release more than {:.4e} J/m³", least(limits))
            }
            Some(Criterion::Softening { onset, limit }) => {
                let (onset, limit) = (least(onset), least(limit));
                format!(
                    "that soften from {onset:.4e} J/m³ on and break when they have taken {limit:.4e} J/m³"
                )
            }
            None => "that never break".to_owned(),
        };
        format!("an interface, {}: {} bonds {limit}", interface.name(), bonds.len())
    };
    scene.interface.iter().zip(&body.interfaces).map(of).collect()
}
