//! Selects the particles of a boundary.

use super::Boundary;
use super::mesh_region::SetRegion;
use super::shapes::operations;
use super::values::{DiscreteBody, ONE_OF_THEM, check_order, vector};
use crate::bonds::Bonds;
use crate::geometry::{Operation, inside};
use crate::surface::SurfaceFace;
use harness::scene::{SceneError, Source};

/// Returns the number of layers of particles that a boundary takes at a side.
pub(super) fn layers<const D: usize>(boundary: &Boundary, bonds: &dyn Bonds<D>) -> usize {
    boundary.layers_of(bonds.spacing(), bonds.horizon() / bonds.spacing())
}

/// Returns the region of a boundary, and its depth from a side, m.
pub(super) fn extent<const D: usize>(
    source: &Source,
    key: &str,
    boundary: &Boundary,
    body: &DiscreteBody<D>,
) -> Result<(BoundaryExtent<D>, Option<f64>), SceneError> {
    let spacing = body.bonds.spacing();
    let kinds = [boundary.side.is_some(), boundary.min.is_some(), !boundary.shapes.is_empty()];
    if boundary.set.is_some() && kinds.contains(&true) {
        let allowed = "one of `side`, `set`, `shapes`, or `min` and `max`";
        return Err(source.error(key, "several kinds of region", allowed));
    }
    let (low, high, depth) = match (boundary.side, &boundary.min, &boundary.max) {
        (Some(side), None, None) if boundary.shapes.is_empty() => {
            let (axis, upper) = side.axis();
            if axis >= D {
                return Err(source.error(
                    &format!("{key}.side"),
                    side,
                    "a side along x or y of a plane body",
                ));
            }
            let name = boundary.depth_key().unwrap_or("layers");
            if boundary.depth.is_some() && boundary.layers.is_some() {
                return Err(source.conflict(&format!("{key}.depth"), "layers", ONE_OF_THEM));
            }
            if boundary.layers == Some(0) {
                return Err(source.error(&format!("{key}.layers"), 0, "at least 1"));
            }
            let layers = layers(boundary, &*body.bonds);
            // particles of a lattice fill whole layers
            let depth = match boundary.depth {
                Some(depth) if body.bonds.as_lattice().is_none() => depth.si(),
                _ => layers as f64 * spacing,
            };
            if depth <= 0.0 || boundary.depth.is_some_and(|depth| depth.si() <= 0.0) {
                let found = format!("{} m", boundary.depth.map_or(0.0, |depth| depth.si()));
                let allowed = format!("at least half a spacing, {} m: it holds no particle", 0.5 * spacing);
                return Err(source.error(&format!("{key}.depth"), found, allowed));
            }
            let extent = body.bounds.1[axis] - body.bounds.0[axis];
            let given = boundary.depth_key().is_some() || boundary.prescribes_displacement();
            let depth = if given { depth } else { depth.min(extent) };
            if depth > extent * (1.0 + 1e-9) {
                let found = format!("{layers} layers, {depth} m deep");
                return Err(source.error(
                    &format!("{key}.{name}"),
                    found,
                    format!("at most the body, {extent} m"),
                ));
            }
            let (mut low, mut high) = ([f64::NEG_INFINITY; D], [f64::INFINITY; D]);
            if upper {
                low[axis] = body.bounds.1[axis] - depth;
            } else {
                high[axis] = body.bounds.0[axis] + depth;
            }
            (low, high, Some(depth))
        }
        (None, Some(min), Some(max)) if boundary.shapes.is_empty() => {
            if let Some(name) = boundary.depth_key() {
                return Err(source.unexpected(&format!("{key}.{name}"), "a box has its own depth"));
            }
            let (min, max) =
                (vector(source, &format!("{key}.min"), min)?, vector(source, &format!("{key}.max"), max)?);
            check_order(source, key, min, max)?;
            (min, max, None)
        }
        (None, None, None)
            if boundary.set.is_some() || !boundary.shapes.is_empty() && boundary.depth_key().is_none() =>
        {
            ([f64::NEG_INFINITY; D], [f64::INFINITY; D], None)
        }
        (side, min, max) => {
            let shapes = !boundary.shapes.is_empty() || boundary.set.is_some();
            let given = [side.is_some(), min.is_some() || max.is_some(), shapes];
            let several = given.iter().filter(|given| **given).count() > 1;
            let found = if several { "several kinds of region" } else { "no region" };
            return Err(source.error(key, found, "one of `side`, `set`, `shapes`, or `min` and `max`"));
        }
    };
    let shapes = operations(source, &format!("{key}.shapes"), &boundary.shapes)?;
    let set = boundary.set.as_ref().map(|name| body.sets.find(source, key, name, boundary, &*body.bonds));
    Ok((BoundaryExtent { low, high, shapes, set: set.transpose()? }, depth))
}

/// Region of a boundary: a box that may be unbounded, shapes, and a set of a mesh.
pub(super) struct BoundaryExtent<const D: usize> {
    low: [f64; D],
    high: [f64; D],
    shapes: Vec<Operation<D>>,
    set: Option<SetRegion<D>>,
}

impl<const D: usize> BoundaryExtent<D> {
    /// Returns true if the region contains a point, edges included.
    pub(super) fn contains(&self, place: [f64; D]) -> bool {
        let boxed = (0..D).all(|d| self.low[d] <= place[d] && place[d] <= self.high[d]);
        let shaped = boxed && (self.shapes.is_empty() || inside(&self.shapes, place));
        shaped && self.set.as_ref().is_none_or(|set| set.contains(place))
    }

    /// Returns true if the region contains a face of a body of this spacing, m; of a set of faces, if they
    /// are the nearest of the mesh to it.
    pub(super) fn has_face(&self, face: &SurfaceFace<D>, spacing: f64) -> bool {
        match &self.set {
            Some(set) => set.has_face(face, spacing),
            None => self.contains(face.place),
        }
    }
}

/// Returns the particles of a boundary, and its depth from a side, m.
pub(super) fn region<const D: usize>(
    source: &Source,
    key: &str,
    boundary: &Boundary,
    body: &DiscreteBody<D>,
) -> Result<(Vec<u32>, Option<f64>), SceneError> {
    let (extent, depth) = extent(source, key, boundary, body)?;
    let inside = |&site: &u32| extent.contains(body.bonds.position(site as usize));
    Ok((body.bonds.particles().iter().copied().filter(inside).collect(), depth))
}
