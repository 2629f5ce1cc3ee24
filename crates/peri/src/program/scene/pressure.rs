//! Pressures on the faces of a body.

use super::Scene;
use super::body_force::add_field;
use super::curve_spec::CurveList;
use super::part_solid::solid_of_parts;
use super::region::extent;
use super::values::{DiscreteBody, plain};
use crate::calibrate::Space;
use crate::geometry::inside as within;
use crate::material::{Deformation, PointLaw};
use crate::solver::{Amplitude, FollowingPressure, Loads, ThicknessStretch};
use crate::surface::SurfaceFace;
use harness::scene::{SceneError, Source};

/// Least thickness of a wall, in spacings: one layer of particles has no stiffness across it.
pub(super) const LEAST_WALL: f64 = 1.75;

/// Adds the pressures of boundaries to loads that follow curves.
///
/// # Errors
/// A pressure in plane stress without a thickness, with a curve for each component, on a region without
/// faces, or on a wall that is too thin for its horizon.
pub(super) fn add<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
    amplitudes: &[(Amplitude, [Amplitude; D])],
    loads: &mut Loads<D>,
) -> Result<(), SceneError> {
    for (index, boundary) in scene.boundary.iter().enumerate() {
        let Some(pressure) = boundary.pressure else { continue };
        let key = format!("boundary[{index}].pressure");
        if let Some(depth) = boundary.depth_key().filter(|_| boundary.set.is_some()) {
            let why = "a pressure acts on the faces of a set, whatever lies below them";
            return Err(source.conflict(&format!("boundary[{index}].{depth}"), "pressure", why));
        }
        if matches!(boundary.curve, Some(CurveList::Each(_))) {
            let why = "a pressure has one curve, not one for each component";
            return Err(source.conflict(&format!("boundary[{index}].curve"), "pressure", why));
        }
        let (extent, _) = extent(source, &format!("boundary[{index}]"), boundary, body)?;
        let outward = boundary.side.map(|side| {
            let (axis, upper) = side.axis();
            (axis, if upper { 1.0 } else { -1.0 })
        });
        let inside = |face: &SurfaceFace<D>| {
            let faces = outward.is_none_or(|(axis, sign)| sign * face.normal[axis] > 0.5);
            faces && extent.has_face(face, body.bonds.spacing())
        };
        let Some(amplitude) = amplitudes.get(index).map(|(_, each)| &each[0]) else { continue };
        let surface = body.surface();
        if let Some(wall) = wall(body, surface.faces().iter().filter(|face| inside(face))) {
            let spacing = body.bonds.spacing();
            if wall < LEAST_WALL * spacing {
                let found = format!("a wall of {} mm", plain(wall * 1e3));
                let allowed = format!(
                    "at least two layers of particles, {} mm: one has no stiffness across it; take a smaller \
                     `body.spacing`",
                    plain((2e6 * spacing).ceil() / 1e3)
                );
                return Err(source.error(&key, found, allowed));
            }
        }
        let pressed =
            FollowingPressure::new(&*body.bonds, &surface, inside, pressure.si(), amplitude.clone());
        let Some(pressed) = pressed else {
            let allowed = "a region with a part of the surface of a body of `shapes`, or of a lattice; of a \
                           mesh a set of faces";
            return Err(source.error(&key, "a region without faces", allowed));
        };
        add_field(body, loads, pressed.with_thickness(thickness(source, scene, &key, body)?));
    }
    Ok(())
}

/// Builds the stretch of the thickness of a body in plane stress; `None` of others.
///
/// # Errors
/// Bond laws and laws with a state, whose thickness no deformation gradient gives.
fn thickness<const D: usize>(
    source: &Source,
    scene: &Scene,
    key: &str,
    body: &DiscreteBody<D>,
) -> Result<Option<ThicknessStretch<D>>, SceneError> {
    if scene.body.space != Space::PlaneStress {
        return Ok(None);
    }
    if scene.material.solid.is_none() || scene.remembers() {
        let found = if scene.remembers() { "a solid with a state" } else { "a bond law" };
        let allowed = "a `solid` without `branch` and `mullins`, which gives the thickness; or \
                       `plane-strain` or `solid`: in plane stress the area changes with the thickness";
        return Err(source.error(key, format!("a pressure in `plane-stress` on {found}"), allowed));
    }
    let (solid, _) = solid_of_parts(source, scene, body)?;
    Ok(Some(Box::new(move |site, displacement_gradient| {
        let deformation = Deformation { displacement_gradient, residual: 0.0, past: None };
        solid.law_at(site).thickness_stretch(&deformation)
    })))
}

/// Median thickness of the wall below some faces, m, up to [`LEAST_WALL`] spacings and in steps of a quarter;
/// `None` without shapes or faces.
pub(super) fn wall<'a, const D: usize>(
    body: &DiscreteBody<D>,
    faces: impl Iterator<Item = &'a SurfaceFace<D>>,
) -> Option<f64> {
    let step = 0.25 * body.bonds.spacing();
    let most = (4.0 * LEAST_WALL).ceil() as u32 + 1;
    let depth = |face: &SurfaceFace<D>| {
        let below =
            |k: u32| std::array::from_fn(|d| face.place[d] - (f64::from(k) + 0.5) * step * face.normal[d]);
        f64::from((0..most).find(|&k| !within(&body.operations, below(k))).unwrap_or(most)) * step
    };
    let mut depths: Vec<f64> = faces.map(depth).collect();
    depths.sort_by(f64::total_cmp);
    depths.get(depths.len() / 2).copied().filter(|_| !body.operations.is_empty())
}
