//! Regions of inclusions: a shape, or a part of the body.

use super::interface::{part_number, parts_of};
use super::shapes::shape;
use super::values::DiscreteBody;
use super::{Inclusion, Scene};
use crate::geometry::{Parts, Shape};
use harness::scene::{SceneError, Source};

/// Region of an inclusion.
pub(super) enum Region<const D: usize> {
    Shape(Shape<D>),
    Part { parts: Parts<D>, part: u32, bounds: ([f64; D], [f64; D]) },
}

impl<const D: usize> Region<D> {
    /// Builds the region of an inclusion.
    ///
    /// # Errors
    /// An invalid shape, an unknown part, or none or both of them.
    pub fn new(
        source: &Source,
        scene: &Scene,
        index: usize,
        inclusion: &Inclusion,
        body: &DiscreteBody<D>,
    ) -> Result<Self, SceneError> {
        let key = format!("material.inclusions[{index}]");
        match (&inclusion.shape, &inclusion.part) {
            (Some(spec), None) => {
                let key = format!("{key}.shape");
                let Some(kind) = spec.add.filter(|_| spec.cut.is_none()) else {
                    return Err(source.error(&key, "no `add`", "`add` with the kind of shape"));
                };
                Ok(Self::Shape(shape::<D>(source, &key, kind, spec)?))
            }
            (None, Some(name)) => {
                let part = part_number(source, scene, &format!("{key}.part"), name)?;
                let parts = parts_of(scene, body);
                let bounds = parts.bounds(part).unwrap_or(body.bounds);
                Ok(Self::Part { parts, part, bounds })
            }
            (shape, _) => {
                let found = if shape.is_some() { "both `shape` and `part`" } else { "no region" };
                Err(source.error(&key, found, "one of `shape` and `part`"))
            }
        }
    }

    /// Returns true if the region contains a point, m.
    pub fn contains(&self, point: [f64; D]) -> bool {
        match self {
            Self::Shape(shape) => shape.contains(point),
            Self::Part { parts, part, .. } => parts.part_at(point) == Some(*part),
        }
    }

    /// Returns true if a box about the region reaches to `reach` from a point.
    pub fn is_near(&self, point: [f64; D], reach: f64) -> bool {
        let (low, high) = match self {
            Self::Shape(shape) => shape.bounds(),
            Self::Part { bounds, .. } => *bounds,
        };
        (0..D).all(|d| low[d] - reach <= point[d] && point[d] <= high[d] + reach)
    }

    /// Fractions of the segment from `a` to `b` between which it is inside or outside.
    pub fn passages(&self, a: [f64; D], b: [f64; D]) -> Vec<f64> {
        let mut ends = Vec::new();
        match self {
            Self::Shape(shape @ Shape::Enclosed(_)) => {
                shape.passages(a, b, &mut ends);
                ends.extend([0.0, 1.0]);
            }
            Self::Shape(shape) => shape.passages(a, b, &mut ends),
            Self::Part { parts, .. } => {
                ends = parts.passages(a, b);
                ends.extend([0.0, 1.0]);
            }
        }
        ends
    }
}
