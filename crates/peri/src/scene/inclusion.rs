//! Parts of a body that are stiffer or softer than the rest, or break earlier or later.

use super::build::shape;
use super::values::Body;
use super::{Inclusion, Scene, plain};
use crate::bonds::{Bonds, Property};
use crate::critical::Critical;
use crate::error::Error;
use polycore::scene::{SceneError, Source};

/// The inclusions of a scene as fields.
pub struct Inclusions<'a> {
    /// Micromodulus over that of the rest: the product of those that hold a particle.
    pub micromodulus: Property,
    /// The inclusions, and their particles' sites.
    each: Vec<(&'a Inclusion, Vec<u32>)>,
}

impl<'a> Inclusions<'a> {
    /// Finds the particles of all inclusions.
    ///
    /// # Errors
    /// A fault of an inclusion's shape, or one that contains no particle.
    pub fn new<const D: usize>(
        source: &Source,
        scene: &'a Scene,
        body: &Body<D>,
    ) -> Result<Self, SceneError> {
        let bonds = &*body.bonds;
        let mut each = Vec::new();
        let mut stiffness = vec![1.0; if scene.material.inclusions.is_empty() { 0 } else { bonds.sites() }];
        for (index, inclusion) in scene.material.inclusions.iter().enumerate() {
            let key = format!("material.inclusions[{index}].shape");
            let Some(kind) = inclusion.shape.add.filter(|_| inclusion.shape.cut.is_none()) else {
                return Err(source.error(&key, "no `add`", "`add` with the kind of shape"));
            };
            let shape = shape::<D>(source, &key, kind, &inclusion.shape)?;
            let inside = |&site: &u32| shape.contains(bonds.position(site as usize));
            let members: Vec<u32> = bonds.particles().iter().copied().filter(inside).collect();
            if members.is_empty() {
                return Err(source.error(&key, "a shape without particles", "a shape with at least one"));
            }
            members.iter().for_each(|&site| stiffness[site as usize] *= inclusion.stiffness);
            each.push((inclusion, members));
        }
        let at = |site: usize, _| stiffness.get(site).copied().unwrap_or(1.0);
        Ok(Self { micromodulus: Property::new(bonds, at), each })
    }

    /// The critical stretch: `rest`, and of inclusions with a critical stretch of their own what `resolve` makes of it with
    /// their micromodulus over that of the rest; of several the last.
    ///
    /// # Errors
    /// A critical stretch out of its domain.
    pub fn critical_stretch<const D: usize>(
        &self,
        source: &Source,
        bonds: &dyn Bonds<D>,
        rest: f64,
        resolve: &dyn Fn(Critical, f64) -> Result<f64, Error>,
    ) -> Result<Property, SceneError> {
        let mut stretch = vec![rest; if self.each.is_empty() { 0 } else { bonds.sites() }];
        for (index, (inclusion, members)) in self.each.iter().enumerate() {
            let Some(critical) = inclusion.critical else { continue };
            let key = format!("material.inclusions[{index}].critical");
            let fault = |error| match error {
                Error::Parameter { found, allowed, .. } => source.error(&key, plain(found), allowed),
                other => source.error(&key, other, "a critical stretch"),
            };
            // one bisection for neighbours of one stiffness
            let mut last = None;
            for &site in members {
                let stiffness = self.micromodulus.at(site as usize);
                let own = match last {
                    Some((before, own)) if before == stiffness => own,
                    _ => resolve(critical, stiffness).map_err(fault)?,
                };
                stretch[site as usize] = own;
                last = Some((stiffness, own));
            }
        }
        Ok(Property::new(bonds, |site, _| stretch.get(site).copied().unwrap_or(rest)))
    }
}
