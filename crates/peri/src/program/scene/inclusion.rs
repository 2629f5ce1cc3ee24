//! Inclusions and fields of other scenes: stiffness, critical stretch and prestrain of each particle.

use super::inclusion_region::Region;
use super::values::DiscreteBody;
use super::{Material, ParameterField, Scene, ShapeSpec, SolidLaw, VaryingParameter, plain};
use crate::bonds::Property;
use crate::calibrate::{Space, poisson_ratio};
use crate::critical::Critical;
use crate::potential::Law;
use harness::scene::{SceneError, Source};
use polycore::units::{Density, Ratio};
use serde::Deserialize;
use std::array;

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
    pub(super) fn key(&self, index: usize) -> String {
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
    pub(super) fracture_energy: Option<Property>,
    /// Prestrain ε* by site, if there is any.
    pub prestrain: Option<Vec<[[f64; D]; D]>>,
    /// Inclusions with their regions and the sites of their particles.
    pub(super) each: Vec<(&'a Inclusion, Region<D>, Vec<u32>)>,
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
}

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
