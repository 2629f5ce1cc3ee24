//! Parts of a body that are stiffer or softer than the rest.

use super::Scene;
use super::build::{Body, shape};
use crate::field::Field;
use polycore::scene::{SceneError, Source};

/// The factors of surface correction, if any, times the stiffness of the inclusions, if any: a bond has the mean of its
/// two ends.
///
/// # Errors
/// A fault of an inclusion's shape, or one that holds no particle.
pub fn with_inclusions<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &Body<D>,
    factors: Option<Field<D>>,
) -> Result<Option<Field<D>>, SceneError> {
    if scene.material.inclusions.is_empty() {
        return Ok(factors);
    }
    let bonds = &*body.bonds;
    let mut factors = factors.unwrap_or_else(|| {
        let mut ones = Field::zeros(bonds.slots());
        bonds.particles().iter().for_each(|&slot| ones.set(slot as usize, [1.0; D]));
        ones
    });
    for (index, inclusion) in scene.material.inclusions.iter().enumerate() {
        let key = format!("material.inclusions[{index}].shape");
        let Some(kind) = inclusion.shape.add.filter(|_| inclusion.shape.cut.is_none()) else {
            return Err(source.error(&key, "no `add`", "`add` with the kind of shape"));
        };
        let shape = shape::<D>(source, &key, kind, &inclusion.shape)?;
        let mut empty = true;
        for &slot in bonds.particles() {
            if shape.contains(bonds.position(slot as usize)) {
                let old = factors.get(slot as usize);
                factors.set(slot as usize, old.map(|g| g * inclusion.stiffness));
                empty = false;
            }
        }
        if empty {
            return Err(source.error(&key, "a shape without particles", "a shape that holds at least one"));
        }
    }
    Ok(Some(factors))
}
