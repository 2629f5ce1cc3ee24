//! Checks of rigid planes: planes behind the body, without room between them, or out of reach.

use super::Scene;
use super::values::DiscreteBody;
use crate::contact::{RigidSurface, SurfaceShape};
use harness::scene::{SceneError, Source};
use polycore::numerics::range;

/// Largest n₁·n₂ of planes that face each other.
const FACING: f64 = -0.99;
/// Smallest distance of facing planes over the thickness of the body between them.
const LEAST_ROOM: f64 = 0.2;
/// Largest distance of the surface from a bonded plane, in spacings.
const TIE_DISTANCE: f64 = 0.5;
/// Overlap at the start above which a plane presses on the body, in spacings.
const PRESTRESSED: f64 = 0.01;
/// Number of moments at which planes of a run in time are checked.
const MOMENTS: u32 = 100;

/// Plane of a scene with a unit normal, and the range of the particles' heights above it, m.
struct PlanePosition<const D: usize> {
    name: String,
    /// Key of the scene.
    key: String,
    plane: RigidSurface<D>,
    normal: [f64; D],
    low: f64,
    high: f64,
    /// Height of the lowest point of the surface above the plane, m.
    surface: f64,
}

impl<const D: usize> PlanePosition<D> {
    /// Returns the displacement of the plane along its normal, m, at a load factor and a time, s.
    fn displacement(&self, factor: f64, time: f64) -> f64 {
        let place = self.plane.place_at(factor, time);
        (0..D).map(|d| self.normal[d] * place[d]).sum()
    }
}

/// Returns the planes of a scene in relation to the body.
fn plane_positions<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
) -> Result<Vec<PlanePosition<D>>, SceneError> {
    let Some(contact) = &scene.contact else { return Ok(Vec::new()) };
    let surfaces = contact.surfaces::<D>(source, scene)?;
    let outside = body.surface();
    let names = contact.surface_names();
    let each = surfaces.into_iter().zip(names).enumerate().filter_map(|(number, (mut plane, name))| {
        let SurfaceShape::Plane(normal) = plane.shape else { return None };
        let size = crate::geometry::length(normal);
        let normal = normal.map(|n| n / size);
        plane.shape = SurfaceShape::Plane(normal);
        let key = match number.checked_sub(contact.plane.len()) {
            None => format!("contact.plane[{number}]"),
            Some(index) => format!("contact.indenter[{index}]"),
        };
        let heights =
            body.bonds.particles().iter().map(|&site| plane.height(body.bonds.position(site as usize)));
        let [low, high] = range(heights);
        let faces = outside.faces().iter().map(|face| plane.height(face.place));
        let lowest = faces.fold(f64::INFINITY, f64::min);
        let of_particles = low - 0.5 * body.bonds.spacing();
        let lowest = if lowest.is_finite() { lowest } else { of_particles };
        Some(PlanePosition { name, key, plane, normal, low, high, surface: lowest })
    });
    Ok(each.collect())
}

/// Name of a moment, for messages.
fn moment(scene: &Scene, factor: f64, time: f64) -> String {
    if time > 0.0 {
        return format!("time {:.3e} s", scene.earlier.time + time);
    }
    format!("load factor {factor:.3}")
}

/// Returns the load factors and times, s, at which planes are checked.
fn moments(scene: &Scene) -> Vec<(f64, f64)> {
    let end = scene.dynamics.as_ref().map_or(0.0, |dynamics| dynamics.method().end_time);
    let even = (0..=MOMENTS).map(|k| f64::from(k) / f64::from(MOMENTS));
    if scene.has_curves() && scene.dynamics.is_some() {
        return even.map(|part| (part, part * end)).collect();
    }
    if scene.dynamics.is_some() {
        let ramp = scene.dynamics.as_ref().map_or(0.0, |dynamics| dynamics.method().ramp);
        let factor = |time: f64| if time < ramp { time / ramp } else { 1.0 };
        return even.map(|part| (factor(part * end), part * end)).collect();
    }
    let factors = scene.load_steps().0;
    std::iter::once(0.0).chain(factors).map(|factor| (factor, 0.0)).collect()
}

/// Checks that the body is in front of all planes at the start, and that they leave it room during the run.
///
/// # Errors
/// A [`SceneError`] that names the plane, the value found and what is allowed.
pub(super) fn check<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
) -> Result<(), SceneError> {
    let (planes, spacing) = (plane_positions(source, scene, body)?, body.bonds.spacing());
    let particles = body.bonds.particles();
    for (index, own) in planes.iter().enumerate() {
        let key = &own.key;
        // the surface of a particle lies half a spacing from its centre
        let allowed = 1e-6 * spacing;
        if own.low < -allowed {
            let behind = particles
                .iter()
                .filter(|&&site| own.plane.height(body.bonds.position(site as usize)) < -allowed)
                .count();
            let found = format!("{behind} of {} particles behind plane `{}`", particles.len(), own.name);
            let advice = if own.high < allowed {
                let opposite = own.normal.map(|n| super::plain(if n == 0.0 { 0.0 } else { -n })).join(", ");
                format!("a normal towards the body: [{opposite}]")
            } else {
                "a plane with the whole body in front of it; `normal` points towards the body".to_owned()
            };
            return Err(source.error(&format!("{key}.normal"), found, advice));
        }
        if own.plane.bonded && own.surface.abs() >= TIE_DISTANCE * spacing {
            let found = format!("plane `{}` {:.3e} m from the surface of the body", own.name, own.surface);
            let allowed = format!(
                "up to half a spacing, {:.3e} m: a bonded plane touches the body",
                TIE_DISTANCE * spacing
            );
            return Err(source.error(&format!("{key}.point"), found, allowed));
        }
        if own.plane.bonded && body.surface().faces().is_empty() {
            let allowed = "false: a cloud of points has no faces to tie";
            return Err(source.error(&format!("{key}.bonded"), "true", allowed));
        }
        for other in planes.iter().skip(index + 1) {
            let turn: f64 = (0..D).map(|d| own.normal[d] * other.normal[d]).sum();
            if turn > FACING {
                continue;
            }
            let apart = own.plane.height(other.plane.point);
            let body_between = own.high - own.low + spacing;
            for (factor, time) in moments(scene) {
                let gap = apart - own.displacement(factor, time) - other.displacement(factor, time);
                if gap < LEAST_ROOM * body_between {
                    let when = moment(scene, factor, time);
                    let found = format!(
                        "planes `{}` and `{}` {:.3e} m apart at {when}, with {body_between:.3e} m of the \
                         body between them",
                        own.name, other.name, gap
                    );
                    let allowed =
                        format!("at least {:.3e} m, a fifth of the body", LEAST_ROOM * body_between);
                    let key = format!("{}.displacement", other.key);
                    return Err(source.error(&key, found, allowed));
                }
            }
        }
    }
    if let Some((factor, time)) = moments(scene).into_iter().find(|&(f, t)| !has_room(&planes, body, f, t)) {
        let when = moment(scene, factor, time);
        let names: Vec<String> = planes.iter().map(|position| format!("`{}`", position.name)).collect();
        let found = format!("planes {} that leave no room between them at {when}", names.join(", "));
        return Err(source.error(
            "contact.plane",
            found,
            "planes with room for the body in front of all of them",
        ));
    }
    Ok(())
}

/// Returns true if some point near the body is in front of all planes: the largest t with n_i·x − h_i ≥ t is
/// positive. The maximum is at a corner, where D + 1 of the constraints hold with equality.
fn has_room<const D: usize>(
    planes: &[PlanePosition<D>],
    body: &DiscreteBody<D>,
    factor: f64,
    time: f64,
) -> bool {
    let (low, high) = body.bounds;
    let size = (0..D).map(|d| high[d] - low[d]).fold(0.0, f64::max);
    // n·x − t ≥ h of planes and of a box ten times the body
    let mut rows: Vec<([f64; D], f64)> = Vec::new();
    for position in planes {
        let at: f64 = (0..D).map(|d| position.normal[d] * position.plane.point[d]).sum();
        rows.push((position.normal, at + position.displacement(factor, time)));
    }
    if rows.len() < 2 {
        return true;
    }
    for d in 0..D {
        let middle = 0.5 * (low[d] + high[d]);
        for sign in [1.0, -1.0] {
            let normal = std::array::from_fn(|e| if e == d { sign } else { 0.0 });
            rows.push((normal, sign * middle - 10.0 * size));
        }
    }
    let least = |x: &[f64]| {
        let slack = |(n, h): &([f64; D], f64)| (0..D).map(|d| n[d] * x[d]).sum::<f64>() - h;
        rows.iter().map(slack).fold(f64::INFINITY, f64::min)
    };
    let count = rows.len();
    let mut chosen: Vec<usize> = (0..=D).collect();
    loop {
        let matrix =
            nalgebra::DMatrix::from_fn(D + 1, D + 1, |i, j| if j < D { rows[chosen[i]].0[j] } else { -1.0 });
        let right = nalgebra::DVector::from_fn(D + 1, |i, _| rows[chosen[i]].1);
        if let Some(corner) = matrix.lu().solve(&right)
            && corner.iter().all(|x| x.is_finite())
            && least(corner.as_slice()) > 1e-9 * size
        {
            return true;
        }
        // the next choice of D + 1 of them
        let Some(at) = (0..=D).rev().find(|&k| chosen[k] < count - 1 - (D - k)) else { return false };
        chosen[at] += 1;
        for k in at + 1..=D {
            chosen[k] = chosen[k - 1] + 1;
        }
    }
}

/// Warns of planes that press at the start, or that do not reach the body.
pub(super) fn warnings<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
) -> Vec<String> {
    let (planes, spacing) = (plane_positions(source, scene, body).unwrap_or_default(), body.bonds.spacing());
    let warning = |position: &PlanePosition<D>| {
        let gap = position.surface;
        if gap < -PRESTRESSED * spacing {
            return Some(format!(
                "plane `{}` stands {:.3e} m inside the surface of the body at the start: it presses before \
                 it moves",
                position.name, -gap
            ));
        }
        // a later step may bring it nearer
        let moves = position.plane.moves() && scene.step.is_empty();
        let reach = moments(scene).into_iter().map(|(f, t)| position.displacement(f, t)).fold(0.0, f64::max);
        let far = reach < gap - PRESTRESSED * spacing && !position.plane.bonded;
        (moves && far && scene.dynamics.is_none()).then(|| {
            format!(
                "plane `{}` comes {reach:.3e} m nearer to the body, whose gap is {gap:.3e} m: it does \
                not reach it",
                position.name
            )
        })
    };
    planes.iter().filter_map(warning).collect()
}
