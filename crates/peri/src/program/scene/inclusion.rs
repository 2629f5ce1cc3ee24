//! Inclusions and fields of other scenes: stiffness, critical stretch and prestrain of each particle.

use super::inclusion_region::Region;
use super::values::DiscreteBody;
use super::{Material, ParameterField, Scene, ShapeSpec, SolidLaw, VaryingParameter, plain};
use crate::bonds::{Bonds, Property};
use crate::calibrate::{Space, poisson_ratio};
use crate::critical::Critical;
use crate::error::Error;
use crate::potential::Law;
use harness::scene::{SceneError, Source};
use polycore::units::{Density, EnergyPerArea, Ratio};
use serde::Deserialize;
use std::array;
use std::collections::HashMap;

/// A part of the body whose bonds are stiffer or softer, or which has a law of its own; a bond across its
/// border has the mean of both.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Inclusion {
    /// Shape of the inclusion, with `add`; or `part`.
    pub shape: Option<ShapeSpec>,
    /// Name of a part of the body, see `body.shapes`.
    pub part: Option<String>,
    /// Stiffness over that of the rest; default: 1.
    #[serde(default = "default_stiffness")]
    pub stiffness: f64,
    /// Bond law of the part; default: `material.law`. Of overlapping parts with a law, links, dissociation or
    /// rescaling of their own the last counts.
    pub law: Option<Law>,
    /// Links per bond of the part, for the chain laws; default: `material.links`.
    pub links: Option<f64>,
    /// Dissociation energy of the part over kθ; default: `material.dissociation`.
    pub dissociation: Option<f64>,
    /// Scales kθ of the part so that the small-strain modulus is exact; default: that of the
    /// material if `law` is the same, otherwise by `law`.
    pub rescale: Option<bool>,
    /// Solid of the part, in place of `material.solid`; of overlapping parts the last counts.
    pub solid: Option<SolidLaw>,
    /// Replaces `material.critical`. A bond that ends in inclusions or passes through them takes the lowest
    /// value on its way, so that a layer may be thinner than the spacing.
    pub critical: Option<Critical>,
    /// Density, kg/m³, instead of that of `[dynamics]` or of a body force.
    pub density: Option<Density>,
    /// Strain ε* of the free part, equal in all directions; prestrains of overlapping parts add up.
    pub prestrain: Option<Ratio>,
}

fn default_stiffness() -> f64 {
    1.0
}

impl Inclusion {
    /// Returns the key of its region.
    fn key(&self, index: usize) -> String {
        format!("material.inclusions[{index}].{}", if self.part.is_some() { "part" } else { "shape" })
    }
}

/// Returns the density of each site over that of `[dynamics]`; none if all are 1.
///
/// # Errors
/// An invalid shape, or one without particles.
pub fn density_ratios<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
) -> Result<Vec<f64>, SceneError> {
    let Some(dynamics) = &scene.dynamics else { return Ok(Vec::new()) };
    let rest = dynamics.density.si();
    let densities = densities(source, scene, body, rest)?;
    if densities == rest.into() {
        return Ok(Vec::new());
    }
    let mut ratios = vec![1.0; body.bonds.sites()];
    for &site in body.bonds.particles() {
        ratios[site as usize] = densities.value_at(site as usize) / rest;
    }
    Ok(ratios)
}

/// Returns the density of each site, kg/m³: `rest`, replaced by that of the last inclusion with `density`.
///
/// # Errors
/// An invalid shape, or one without particles.
pub(super) fn densities<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
    rest: f64,
) -> Result<Property, SceneError> {
    let bonds = &*body.bonds;
    let mut parts = Vec::new();
    for (index, inclusion) in scene.material.inclusions.iter().enumerate() {
        let Some(density) = inclusion.density else { continue };
        let region = Region::new(source, scene, index, inclusion, body)?;
        if !bonds.particles().iter().any(|&site| region.contains(bonds.position(site as usize))) {
            let found = "a shape without particles";
            return Err(source.error(&inclusion.key(index), found, "a shape with at least one"));
        }
        parts.push((region, density.si()));
    }
    if parts.is_empty() {
        return Ok(rest.into());
    }
    Ok(Property::new(bonds, |_, place| {
        let own = parts.iter().rev().find(|(region, _)| region.contains(place));
        own.map_or(rest, |(_, density)| *density)
    }))
}

/// Returns the prestrain ε* = −S:σ with which a body of bonds has the stress σ while it is held in its shape.
fn prestrain_of_stress<const D: usize>(
    space: Space,
    youngs_modulus: f64,
    stress: &[[f64; 3]; 3],
) -> [[f64; D]; D] {
    let nu = poisson_ratio(space);
    let trace: f64 = (0..D).map(|d| stress[d][d]).sum();
    // a strain across the plane that is zero takes ν(1 + ν) of the sum, in its plane
    let across = if space == Space::PlaneStrain { nu * (1.0 + nu) } else { nu };
    let strain = |a: usize, b: usize| across * if a == b { trace } else { 0.0 } - (1.0 + nu) * stress[a][b];
    array::from_fn(|a| array::from_fn(|b| strain(a, b) / youngs_modulus))
}

/// Material parameters of each particle, from inclusions and fields of other scenes.
pub struct Inclusions<'a, const D: usize> {
    /// Micromodulus over that of the scene's Young's modulus, the product of all inclusions of a particle.
    pub micromodulus: Property,
    /// Fracture energy, J/m², if it follows a field.
    fracture_energy: Option<Property>,
    /// Prestrain ε* by site, if there is any.
    pub prestrain: Option<Vec<[[f64; D]; D]>>,
    /// Inclusions with their regions and the sites of their particles.
    each: Vec<(&'a Inclusion, Region<D>, Vec<u32>)>,
}

impl<'a, const D: usize> Inclusions<'a, D> {
    /// Finds the particles of all inclusions and applies `followed`, the parameters that follow fields.
    ///
    /// # Errors
    /// An invalid shape, or one without particles.
    pub fn new(
        source: &Source,
        scene: &'a Scene,
        body: &DiscreteBody<D>,
        followed: &[ParameterField],
    ) -> Result<Self, SceneError> {
        let bonds = &*body.bonds;
        let mut each = Vec::new();
        let following =
            |parameter| followed.iter().find(|one| one.parameter == parameter).map(|one| &one.values);
        let stressed = followed.iter().find(|one| !one.stress.is_empty());
        let modulus = following(VaryingParameter::YoungsModulus).zip(scene.material.youngs_modulus);
        let varies = modulus.is_some() || stressed.is_some() || !scene.material.inclusions.is_empty();
        let mut stiffness = vec![1.0; if varies { bonds.sites() } else { 0 }];
        if let Some((values, whole)) = modulus {
            bonds.particles().iter().for_each(|&site| {
                stiffness[site as usize] = values.value_at(site as usize) / whole.si();
            });
        }
        let shrinks = scene.material.is_prestrained();
        let mut prestrain = vec![0.0; if shrinks { bonds.sites() } else { 0 }];
        if let Some(values) = following(VaryingParameter::Prestrain).filter(|_| stressed.is_none()) {
            bonds
                .particles()
                .iter()
                .for_each(|&site| prestrain[site as usize] = values.value_at(site as usize));
        }
        for (index, inclusion) in scene.material.inclusions.iter().enumerate() {
            let region = Region::new(source, scene, index, inclusion, body)?;
            let inside = |&site: &u32| region.contains(bonds.position(site as usize));
            let members: Vec<u32> = bonds.particles().iter().copied().filter(inside).collect();
            // a layer between particles may still be a weak one
            let acts =
                inclusion.stiffness != 1.0 || inclusion.prestrain.is_some() || inclusion.critical.is_none();
            let acts = acts || inclusion.has_law() || inclusion.solid.is_some();
            if members.is_empty() && acts {
                let key = inclusion.key(index);
                return Err(source.error(&key, "a shape without particles", "a shape with at least one"));
            }
            members.iter().for_each(|&site| stiffness[site as usize] *= inclusion.stiffness);
            if let Some(strain) = inclusion.prestrain {
                members.iter().for_each(|&site| prestrain[site as usize] += strain.si());
            }
            each.push((inclusion, region, members));
        }
        let factor = |site: usize, _| stiffness.get(site).copied().unwrap_or(1.0);
        let fracture_energy = following(VaryingParameter::FractureEnergy).cloned();
        let strain = |site: usize| {
            let own: [[f64; D]; D] =
                array::from_fn(|a| array::from_fn(|b| if a == b { prestrain[site] } else { 0.0 }));
            let (Some(one), Some(whole)) = (stressed, scene.material.youngs_modulus) else { return own };
            let held: [[f64; D]; D] =
                prestrain_of_stress(scene.body.space, stiffness[site] * whole.si(), &one.stress[site]);
            array::from_fn(|a| array::from_fn(|b| own[a][b] + held[a][b]))
        };
        let prestrain: Option<Vec<[[f64; D]; D]>> = shrinks.then(|| (0..bonds.sites()).map(strain).collect());
        let along = prestrain.iter().flatten().flat_map(|tensor| (0..D).map(|d| tensor[d][d]));
        if let Some(found) = along.reduce(f64::min).filter(|&least| least <= -1.0) {
            return Err(source.error("material", format!("a prestrain of {}", plain(found)), "above -1"));
        }
        Ok(Self { micromodulus: Property::new(bonds, factor), fracture_energy, prestrain, each })
    }

    /// Lists the inclusions with the sites of their particles.
    pub(super) fn members(&self) -> impl Iterator<Item = (&Inclusion, &[u32])> {
        self.each.iter().map(|(inclusion, _, members)| (*inclusion, &members[..]))
    }

    /// Returns the limit of each particle, of a bond law the critical stretch: `rest`, replaced by that of a
    /// fracture energy that follows a field, or of the last inclusion with `critical`. `resolve` computes it
    /// from the criterion and the relative micromodulus.
    ///
    /// # Errors
    /// A limit out of its domain.
    pub fn limits(
        &self,
        source: &Source,
        bonds: &dyn Bonds<D>,
        rest: f64,
        resolve: &dyn Fn(Critical, f64) -> Result<f64, Error>,
    ) -> Result<Property, SceneError> {
        let varies = self.fracture_energy.is_some() || !self.each.is_empty();
        let mut stretch = vec![rest; if varies { bonds.sites() } else { 0 }];
        if let Some(energies) = &self.fracture_energy {
            for site in bonds.particles().iter().map(|&site| site as usize) {
                let energy = Some(EnergyPerArea::from_si(energies.value_at(site)));
                let critical = Critical { fracture_energy: energy, ..Critical::default() };
                stretch[site] = resolve(critical, self.micromodulus.value_at(site)).map_err(|error| {
                    source.error("material.fields", error, "a fracture energy that bonds can have")
                })?;
            }
        }
        for (index, (inclusion, _, members)) in self.each.iter().enumerate() {
            let Some(critical) = inclusion.critical else { continue };
            let key = format!("material.inclusions[{index}].critical");
            let fault = |error| match error {
                Error::Parameter { found, allowed, .. } => source.error(&key, plain(found), allowed),
                other => source.error(&key, other, "a limit that bonds can have"),
            };
            // neighbours of equal stiffness share one bisection
            let mut last = None;
            for &site in members {
                let stiffness = self.micromodulus.value_at(site as usize);
                let own = match last {
                    Some((before, own)) if before == stiffness => own,
                    _ => resolve(critical, stiffness).map_err(fault)?,
                };
                stretch[site as usize] = own;
                last = Some((stiffness, own));
            }
        }
        let property = Property::new(bonds, |site, _| stretch.get(site).copied().unwrap_or(rest));
        if self.each.iter().all(|(inclusion, ..)| inclusion.critical.is_none()) {
            return Ok(property);
        }
        let weak = self.weakened_bonds(source, bonds, resolve)?;
        for (index, (_, _, members)) in self.each.iter().enumerate() {
            if members.is_empty() && !weak.iter().any(|one| one.0.contains(&index)) {
                let key = self.each[index].0.key(index);
                let found = "a shape without particles, and without bonds that pass through it";
                return Err(source.error(&key, found, "a shape with at least one"));
            }
        }
        Ok(property.weakened(weak.into_iter().map(|(_, bond, value)| (bond, value)).collect()))
    }

    /// Finds bonds that pass through inclusions with a limit, and the lowest limit between their ends.
    fn weakened_bonds(
        &self,
        source: &Source,
        bonds: &dyn Bonds<D>,
        resolve: &dyn Fn(Critical, f64) -> Result<f64, Error>,
    ) -> Result<Vec<Passing>, SceneError> {
        let reach = bonds.horizon() * (1.0 + 1e-9);
        let mut known: HashMap<(usize, u64), f64> = HashMap::new();
        let mut found = Vec::new();
        for &site in bonds.particles() {
            let here = bonds.position(site as usize);
            let near = |&index: &usize| self.each[index].1.is_near(here, reach);
            let near: Vec<usize> = (0..self.each.len()).filter(near).collect();
            if near.iter().all(|&index| self.each[index].0.critical.is_none()) {
                continue;
            }
            // relative micromodulus of the rest at this end
            let inside = |place| near.iter().filter(move |&&index| self.each[index].1.contains(place));
            let stiffness = |place| inside(place).map(|&index| self.each[index].0.stiffness).product::<f64>();
            let rest = self.micromodulus.value_at(site as usize) / stiffness(here);
            let mut others = Vec::new();
            bonds.neighbours(site as usize, &mut |bond| {
                if site < bond.site as u32 {
                    others.push(bond.site as u32);
                }
            });
            for other in others {
                let there = bonds.position(other as usize);
                let mut ends: Vec<f64> =
                    near.iter().flat_map(|&index| self.each[index].1.passages(here, there)).collect();
                ends.sort_by(f64::total_cmp);
                let mut passing = (Vec::new(), [site, other], f64::INFINITY);
                for pair in ends.windows(2).filter(|pair| pair[1] - pair[0] > THIN) {
                    let part = 0.5 * (pair[0] + pair[1]);
                    let place: [f64; D] = array::from_fn(|d| here[d] + part * (there[d] - here[d]));
                    let last =
                        inside(place).rev().find_map(|&index| Some((index, self.each[index].0.critical?)));
                    let Some((index, critical)) = last else { continue };
                    let stiffness = rest * stiffness(place);
                    let value = match known.get(&(index, stiffness.to_bits())) {
                        Some(&value) => value,
                        None => resolve(critical, stiffness).map_err(|error| {
                            source.error(
                                &format!("material.inclusions[{index}].critical"),
                                error,
                                "a limit that bonds can have",
                            )
                        })?,
                    };
                    known.insert((index, stiffness.to_bits()), value);
                    passing.0.push(index);
                    passing.2 = passing.2.min(value);
                }
                if !passing.0.is_empty() {
                    found.push(passing);
                }
            }
        }
        Ok(found)
    }
}

/// Fraction of a bond's length below which a crossed part is rounding, where faces meet.
const THIN: f64 = 1e-6;

/// Inclusions that a bond passes through, its sites, and the lowest limit in them.
type Passing = (Vec<usize>, [u32; 2], f64);

impl Material {
    /// Returns true if some bonds are at rest at a stretch other than 1.
    pub fn is_prestrained(&self) -> bool {
        let follows = self.fields.iter().any(|field| field.of == VaryingParameter::Prestrain);
        follows || self.inclusions.iter().any(|inclusion| inclusion.prestrain.is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hooke's law: ε_xx = σ/E and ε_yy = −νσ/E of a bar, with 1 − ν² and −ν(1 + ν) in plane strain; shear
    /// σ_xy(1 + ν)/E.
    #[test]
    fn strains_of_stresses() {
        let bar = [[2.0, 0.0, 0.0], [0.0; 3], [0.0; 3]];
        let close =
            |found: f64, expected: f64| assert!((found - expected).abs() < 1e-15, "{found} {expected}");
        let sheet: [[f64; 2]; 2] = prestrain_of_stress(Space::PlaneStress, 4.0, &bar);
        close(sheet[0][0], -0.5);
        close(sheet[1][1], 0.5 / 3.0);
        let slab: [[f64; 2]; 2] = prestrain_of_stress(Space::PlaneStrain, 4.0, &bar);
        close(slab[0][0], -0.5 * (1.0 - 0.0625));
        close(slab[1][1], 0.5 * 0.25 * 1.25);
        let block: [[f64; 3]; 3] = prestrain_of_stress(Space::Solid, 4.0, &bar);
        close(block[2][2], 0.125);
        let shear: [[f64; 3]; 3] =
            prestrain_of_stress(Space::Solid, 4.0, &[[0.0, 2.0, 0.0], [2.0, 0.0, 0.0], [0.0; 3]]);
        close(shear[1][0], -0.625);
        close(shear[0][0] + shear[2][2], 0.0);
    }
}
