//! Areas of a side of a solid, for tractions.

use super::Side;
use super::values::{DiscreteBody, plain};
use crate::contact::{self, DEPTH, SideAreas};
use crate::geometry::{Operation, Shape};
use crate::material::{BodyTensor, surface_load};
use harness::scene::{SceneError, Source};

/// Least thickness of a body without faces over its horizon: area vectors of both sides overlap in thinner
/// ones, by 7 to 10 % of the force at 2.7.
const LEAST_EXTENT: f64 = 3.0;
/// Depth of area vectors below a flat side, in horizons.
const REACH: f64 = 2.0;

/// Returns the particles within two horizons of a side with the area of the side over their volume, 1/m: the
/// component n·h_I/V_I of the area vectors ([`surface_load`]), in thin walls the share of the faces of this
/// side. Floors of slots and steps have none; beside their walls, area vectors are too large: there all are
/// scaled to the area of the side.
///
/// # Errors
/// A thin cloud, which has no faces; a side without area.
pub(super) fn side_areas<const D: usize>(
    source: &Source,
    key: &str,
    body: &DiscreteBody<D>,
    side: Side,
) -> Result<Vec<(u32, f64)>, SceneError> {
    let (bonds, surface, (axis, upper)) = (&*body.bonds, body.surface(), side.axis());
    let bounds = [body.bounds.0[axis], body.bounds.1[axis]];
    let (extent, least) = (bounds[1] - bounds[0], LEAST_EXTENT * bonds.horizon());
    if surface.faces().is_empty() && extent < least {
        let found = format!("a body {} mm thick", plain((extent * 1e6).round() / 1e3));
        let allowed = format!(
            "at least {} mm, {LEAST_EXTENT} horizons, in a body without faces; or `layers`, in which the \
             traction is a body force",
            plain((least * 1e6).ceil() / 1e3)
        );
        return Err(source.error(key, found, allowed));
    }
    let sign = if upper { 1.0 } else { -1.0 };
    let areas = surface_load(bonds, BodyTensor::<D>::identity());
    let mut reach = REACH * bonds.horizon();
    let mut own = SideAreas { shared: Vec::new(), whole: None };
    if surface.faces().is_empty() {
        reach = reach.min(0.5 * extent);
    } else {
        let from_cells = |operation: &Operation<D>| {
            matches!(operation, Operation::Add(Shape::Enclosed(_)) | Operation::Cut(Shape::Enclosed(_)))
        };
        let smooth = !body.operations.is_empty() && !body.operations.iter().any(from_cells);
        own = contact::side_areas(bonds, &surface, &areas, (axis, sign), smooth);
    }
    let area = |&site: &u32| {
        let at = site as usize;
        let below = sign * (bounds[usize::from(upper)] - bonds.position(at)[axis]);
        let (area, reach) = match own.shared.binary_search_by_key(&site, |own| own.0) {
            Ok(number) => (own.shared[number].1 / bonds.volume(at), DEPTH * bonds.horizon()),
            Err(_) => (sign * areas.get(at)[axis], reach),
        };
        (below <= reach && area != 0.0).then_some((site, area))
    };
    let mut all: Vec<(u32, f64)> = bonds.particles().iter().filter_map(area).collect();
    let found: f64 = all.iter().map(|&(site, area)| area * bonds.volume(site as usize)).sum();
    if found.is_nan() || found <= 0.0 {
        let why = "a side with faces; or `layers`, in which the traction is a body force";
        return Err(source.error(key, format!("an area of {} m²", plain(found)), why));
    }
    if let Some(whole) = own.whole {
        all.iter_mut().for_each(|(_, area)| *area *= whole / found);
    }
    Ok(all)
}
