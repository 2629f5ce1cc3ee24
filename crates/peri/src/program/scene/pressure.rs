//! Pressures on the faces of a body.

use super::Scene;
use super::body_force::add_field;
use super::curve_spec::CurveList;
use super::region::extent;
use super::values::DiscreteBody;
use crate::calibrate::Space;
use crate::solver::{Amplitude, FollowingPressure, Loads};
use crate::surface::SurfaceFace;
use harness::scene::{SceneError, Source};

/// Adds the pressures of boundaries to loads that follow curves.
///
/// # Errors
/// A pressure in plane stress, with a curve for each component, or on a region without faces.
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
        if scene.body.space == Space::PlaneStress {
            let allowed = "`plane-strain` or `solid`: in plane stress the area changes with the thickness";
            return Err(source.error(&key, "a pressure in `plane-stress`", allowed));
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
            faces && extent.contains(face.place)
        };
        let Some(amplitude) = amplitudes.get(index).map(|(_, each)| &each[0]) else { continue };
        let pressed =
            FollowingPressure::new(&*body.bonds, &body.surface(), inside, pressure.si(), amplitude.clone());
        let Some(pressed) = pressed else {
            let allowed = "a region with a part of the surface of a body of `shapes`, or of a lattice";
            return Err(source.error(&key, "a region without faces", allowed));
        };
        add_field(body, loads, pressed);
    }
    Ok(())
}
