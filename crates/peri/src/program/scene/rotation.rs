//! Boundaries that rotate about an axis, and warnings of displacement fields that rotate along the chord.

use super::boundary::RotationSpec;
use super::region::region;
use super::values::{DiscreteBody, ONE_OF_THEM, plain, vector};
use super::{Boundary, Prescribed, PrescribedField, Scene};
use crate::bonds::Bonds;
use crate::solver::{Amplitude, Loads, RotatingRegion, Rotation, Support};
use harness::scene::{SceneError, Source};
use nalgebra::{DMatrix, SMatrix};

/// Rotation of a `displacement_field`, °, above which `check` proposes `rotation`: at half of it the chord is
/// 0.4 % off.
const LARGE_ROTATION: f64 = 10.0;
/// Largest strain of a field that rotates its region as a rigid body.
const RIGID_STRAIN: f64 = 0.02;

/// Converts the rotation of a boundary, of a `later` step or of the first one.
///
/// # Errors
/// An invalid point, axis or angle; a free component that the rotation needs; a `displacement_field` beside
/// it.
pub(super) fn rotation_of<const D: usize>(
    source: &Source,
    key: &str,
    boundary: &Boundary,
    later: bool,
) -> Result<Option<Rotation<D>>, SceneError> {
    let Some(RotationSpec { point, axis, angle, .. }) = &boundary.rotation else { return Ok(None) };
    let key = format!("{key}.rotation");
    let centre = vector::<D>(source, &format!("{key}.point"), point)?;
    let axis = direction::<D>(source, &format!("{key}.axis"), axis.as_deref())?;
    if angle.si() == 0.0 && !later {
        return Err(source.error(&format!("{key}.angle"), "0", "an angle other than 0"));
    }
    if boundary.displacement_field.is_some() {
        return Err(source.conflict(&key, "displacement_field", ONE_OF_THEM));
    }
    let moved = boundary.displacement.iter().flatten().enumerate();
    for (d, _) in moved.filter(|(_, component)| **component == Prescribed::Free) {
        if (0..3).any(|other| other != d && axis[other].abs() > 1e-9) || d >= D {
            let allowed = "a length: a rotation prescribes all components but that along its axis";
            return Err(source.error(
                &key.replace("rotation", &format!("displacement[{d}]")),
                "`free`",
                allowed,
            ));
        }
    }
    Ok(Some(Rotation { centre, axis, angle: angle.si() }))
}

/// Converts the direction of an axis to one of length 1.
///
/// # Errors
/// No direction in a solid, or one in a plane body.
pub(super) fn direction<const D: usize>(
    source: &Source,
    key: &str,
    axis: Option<&[f64]>,
) -> Result<[f64; 3], SceneError> {
    match (axis, D) {
        (None, 2) => Ok([0.0, 0.0, 1.0]),
        (Some(axis), 3) => {
            let size = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
            let three = <[f64; 3]>::try_from(axis).ok().filter(|_| size > 0.0 && size.is_finite());
            let three = three
                .ok_or_else(|| source.error(key, format!("{axis:?}"), "three numbers, not all of them 0"))?;
            Ok(three.map(|x| x / size))
        }
        (None, _) => Err(source.missing(key, "needed in a solid: the direction of the axis, e.g. [0, 0, 1]")),
        (Some(_), _) => Err(source.unexpected(key, "a plane body turns in its plane")),
    }
}

/// Adds the rotations to the loads; where regions overlap, the last one wins.
///
/// # Errors
/// As [`rotation_of`].
pub(super) fn turn<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
    regions: &[(Vec<u32>, Support<D>)],
    amplitudes: &[(Amplitude, [Amplitude; D])],
    loads: &mut Loads<D>,
) -> Result<(), SceneError> {
    let mut number = 0;
    for (index, (boundary, (members, support))) in scene.boundary.iter().zip(regions).enumerate() {
        let held = support.displacement.iter().any(Option::is_some);
        let key = format!("boundary[{index}]");
        if let Some(rotation) = rotation_of::<D>(source, &key, boundary, scene.later)? {
            let mut later = vec![false; body.bonds.sites()];
            for (others, support) in &regions[index + 1..] {
                if support.displacement.iter().any(Option::is_some) {
                    others.iter().for_each(|&site| later[site as usize] = true);
                }
            }
            let bit = |d: usize| u8::from(support.displacement[d].is_some()) << d;
            let turned = RotatingRegion {
                rotation,
                shift: support.displacement.map(|component| component.unwrap_or(0.0)),
                amplitudes: amplitudes.get(index).cloned(),
                components: (0..D).map(bit).sum(),
                kept: boundary.held_in_place(),
                region: number,
                sites: members.iter().copied().filter(|&site| !later[site as usize]).collect(),
                start: None,
            };
            loads.turn(&*body.bonds, turned);
        }
        number += usize::from(held);
    }
    Ok(())
}

/// Warnings of fields of displacements that turn a region: they grow along the chord.
pub(super) fn chords<const D: usize>(source: &Source, scene: &Scene, body: &DiscreteBody<D>) -> Vec<String> {
    let warning = |(index, boundary): (usize, &Boundary)| {
        let field = boundary.displacement_field.as_ref()?;
        let key = format!("boundary[{index}]");
        let (members, _) = region(source, &key, boundary, body).ok()?;
        let angle = angle_of(&*body.bonds, &members, field)?.to_degrees();
        (angle > LARGE_ROTATION).then(|| {
            format!(
                "{key}.displacement_field turns its region by {}°, along the chord: at half the load it is \
                 narrower by a factor of \
                 {:.4}; `rotation` turns it along the arc",
                plain((angle * 10.0).round() / 10.0),
                (0.5 * angle.to_radians()).cos()
            )
        })
    };
    scene.boundary.iter().enumerate().filter_map(warning).collect()
}

/// Returns the angle of a field that rotates its region nearly rigidly, rad, from the closest affine field.
fn angle_of<const D: usize>(bonds: &dyn Bonds<D>, members: &[u32], field: &[PrescribedField]) -> Option<f64> {
    let places: Vec<[f64; D]> = members.iter().map(|&site| bonds.position(site as usize)).collect();
    let formulas: Vec<_> = field
        .iter()
        .take(D)
        .map(|component| match component {
            PrescribedField::By(formula) => Some(formula),
            PrescribedField::Free => None,
        })
        .collect();
    let mean: [f64; D] =
        std::array::from_fn(|d| places.iter().map(|x| x[d]).sum::<f64>() / places.len().max(1) as f64);
    let rows =
        DMatrix::from_fn(places.len(), D + 1, |i, j| if j == D { 1.0 } else { places[i][j] - mean[j] });
    let values = DMatrix::from_fn(places.len(), D, |i, d| {
        // a free component counts as not moving
        formulas.get(d).copied().flatten().map_or(0.0, |formula| formula.value_at(places[i]))
    });
    let size = rows.columns(0, D).norm();
    let solution =
        (&rows.transpose() * &rows).pseudo_inverse(1e-12 * size * size).ok()? * rows.transpose() * values;
    let gradient = SMatrix::<f64, D, D>::from_fn(|a, b| f64::from(u8::from(a == b)) + solution[(b, a)]);
    if !gradient.iter().all(|x| x.is_finite()) {
        return None;
    }
    let strain = (gradient.transpose() * gradient - SMatrix::<f64, D, D>::identity()) * 0.5;
    let cosine = if D == 2 { 0.5 * gradient.trace() } else { 0.5 * (gradient.trace() - 1.0) };
    (strain.norm() < RIGID_STRAIN).then(|| cosine.clamp(-1.0, 1.0).acos())
}
