//! Tractions on sides as formulas of place and time.

use super::body_force::add_field;
use super::curve::CurveTime;
use super::formula::VectorFormula;
use super::region::region;
use super::side_areas::side_areas;
use super::values::{DiscreteBody, ONE_OF_THEM};
use super::{Boundary, Scene, Side};
use crate::field::Field;
use crate::solver::{Amplitude, CurvedRegion, Loads, PlacedForce};
use harness::scene::{SceneError, Source};

impl Boundary {
    /// Returns true if its formulas depend on the time.
    pub fn depends_on_time(&self) -> bool {
        self.traction_field.iter().flatten().any(|formula| formula.find_variable_except("xyz").is_some())
    }
}

/// Adds the tractions to the loads, and marks the particles on which they act.
///
/// # Errors
/// A field without a side or beside `traction`, and formulas that do not suit the body or the time.
pub(super) fn add<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
    amplitudes: &[(Amplitude, [Amplitude; D])],
    loads: &mut Loads<D>,
    loaded: &mut [bool],
) -> Result<(), SceneError> {
    for (index, boundary) in scene.boundary.iter().enumerate() {
        let Some(formulas) = &boundary.traction_field else { continue };
        let key = format!("boundary[{index}].traction_field");
        let Some(side) = boundary.side else { return Err(source.unexpected(&key, "needs a `side`")) };
        if boundary.traction.is_some() {
            return Err(source.conflict(&key, "traction", ONE_OF_THEM));
        }
        if boundary.depends_on_time() && boundary.curve.is_some() {
            let why = "a formula of `t` has its own course";
            return Err(source.conflict(&format!("boundary[{index}].curve"), "traction_field", why));
        }
        let formula = VectorFormula::new(source, &key, formulas)?;
        let points = points(source, scene, (index, boundary, side), body)?;
        let time = CurveTime::new(scene);
        let places: Vec<[f64; D]> = points.iter().map(|point| point.1).collect();
        formula.check(source, &key, &places, (time.end, time.moments()))?;
        let end = time.end;
        points.iter().for_each(|point| loaded[point.0 as usize] = true);
        loads.pushed_regions.push(points.iter().map(|point| point.0).collect());
        if boundary.depends_on_time() {
            let traction = move |place, part| formula.value(place, part * end);
            add_field(body, loads, PlacedForce::new(points, traction));
            continue;
        }
        let value = |(_, place, share): &(u32, [f64; D], f64)| formula.value(*place, 0.0).map(|t| share * t);
        let field = loads.body_force.get_or_insert_with(|| Field::zeros(body.bonds.sites()));
        if let (Some(curved), Some((_, amplitudes))) = (&mut loads.curved, amplitudes.get(index)) {
            let (sites, values) = points.iter().map(|point| (point.0, value(point))).unzip();
            curved.pushed.push(CurvedRegion::new(sites, values, amplitudes.clone(), 0));
            continue;
        }
        for point in &points {
            let (old, new) = (field.get(point.0 as usize), value(point));
            field.set(point.0 as usize, std::array::from_fn(|d| old[d] + new[d]));
        }
    }
    Ok(())
}

/// Returns the particles on which a traction of a side acts, their places on the side, m, and the area over
/// volume with which it acts on each, 1/m: as `traction`.
fn points<const D: usize>(
    source: &Source,
    scene: &Scene,
    (index, boundary, side): (usize, &Boundary, Side),
    body: &DiscreteBody<D>,
) -> Result<Vec<(u32, [f64; D], f64)>, SceneError> {
    let (axis, upper) = side.axis();
    let (members, depth) = region(source, &format!("boundary[{index}]"), boundary, body)?;
    let at = [body.bounds.0[axis], body.bounds.1[axis]][usize::from(upper)];
    let place = |site: u32| {
        let place = body.bonds.position(site as usize);
        std::array::from_fn(|d| if d == axis { at } else { place[d] })
    };
    let in_layers = scene.material.solid.is_none() || boundary.layers.is_some() || boundary.depth.is_some();
    if let Some(depth) = depth.filter(|_| in_layers) {
        return Ok(members.into_iter().map(|site| (site, place(site), 1.0 / depth)).collect());
    }
    let areas = side_areas(source, &format!("boundary[{index}].traction_field"), body, side)?;
    Ok(areas.into_iter().map(|(site, area)| (site, place(site), area)).collect())
}
