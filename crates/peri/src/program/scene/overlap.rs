//! Refuses regions that prescribe different displacements of one particle.

use super::rotation::rotation_of;
use super::values::{DiscreteBody, plain};
use super::{Boundary, Prescribed, PrescribedField, Scene};
use crate::solver::{Amplitude, Support};
use harness::scene::{SceneError, Source};

/// Parts of the time at which displacements with curves are compared.
const MOMENTS: [f64; 3] = [0.25, 0.5, 1.0];
/// No region.
const NONE: u32 = u32::MAX;
/// Difference of two displacements, over the larger, that rounding explains.
const EQUAL: f64 = 1e-9;

/// Refuses overlapping regions that disagree.
///
/// # Errors
/// The later region, with the particle, both displacements and the time.
pub(super) fn refuse<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
    regions: &[(Vec<u32>, Support<D>)],
    amplitudes: &[(Amplitude, [Amplitude; D])],
) -> Result<(), SceneError> {
    let moments: &[f64] = if amplitudes.is_empty() { &MOMENTS[2..] } else { &MOMENTS };
    if scene.boundary.iter().filter(|boundary| boundary.prescribes_displacement()).count() < 2 {
        return Ok(());
    }
    let mut owners = vec![[NONE; D]; body.bonds.sites()];
    for (index, (members, support)) in regions.iter().enumerate() {
        for &site in members {
            for d in (0..D).filter(|&d| support.displacement[d].is_some()) {
                let other = std::mem::replace(&mut owners[site as usize][d], index as u32);
                if other == NONE {
                    continue;
                }
                let other = other as usize;
                let place = body.bonds.position(site as usize);
                for &part in moments {
                    let of = |index: usize| {
                        let (key, boundary) = (format!("boundary[{index}]"), &scene.boundary[index]);
                        displacement(source, &key, boundary, amplitudes.get(index), (place, part))
                    };
                    let [own, before] = [of(index)?[d], of(other)?[d]];
                    if own.is_nan() != before.is_nan() {
                        let found =
                            format!("`hold` or a displacement of particles that boundary[{other}] moves");
                        let allowed = "`hold` in both where regions overlap, or `free` in one of them";
                        return Err(source.error(&format!("boundary[{index}]"), found, allowed));
                    }
                    // what is held in place is unknown before the run
                    if (own - before).abs() > EQUAL * own.abs().max(before.abs()) {
                        let when = if amplitudes.is_empty() {
                            String::new()
                        } else {
                            format!(" at {part} of the time")
                        };
                        let at: Vec<String> = place.iter().map(|x| plain((x * 1e9).round() / 1e6)).collect();
                        let found = format!(
                            "{} m along {} of the particle at ({}) mm{when}, for which boundary[{other}] \
                             prescribes {} m",
                            plain(own),
                            ["x", "y", "z"][d],
                            at.join(", "),
                            plain(before)
                        );
                        let allowed = "equal displacements where regions overlap, or `free` in one of them";
                        return Err(source.error(&format!("boundary[{index}]"), found, allowed));
                    }
                }
            }
        }
    }
    Ok(())
}

/// Displacement of a particle by a boundary at a part of the time, m; NaN where it is not known.
fn displacement<const D: usize>(
    source: &Source,
    key: &str,
    boundary: &Boundary,
    amplitudes: Option<&(Amplitude, [Amplitude; D])>,
    (place, part): ([f64; D], f64),
) -> Result<[f64; D], SceneError> {
    let value = |d: usize| {
        let held = boundary.displacement.as_ref().and_then(|held| held.get(d));
        let field = boundary.displacement_field.as_ref().and_then(|field| field.get(d));
        match (held, field) {
            (Some(Prescribed::At(value)), _) => *value,
            (Some(Prescribed::Hold), _) => f64::NAN,
            (_, Some(PrescribedField::By(formula))) => formula.value_at(place),
            _ => 0.0,
        }
    };
    let multiple =
        |amplitude: Option<&Amplitude>| amplitude.map_or(1.0, |amplitude| amplitude.multiple(part));
    let mut u: [f64; D] = std::array::from_fn(|d| value(d) * multiple(amplitudes.map(|(_, each)| &each[d])));
    if let Some(rotation) = rotation_of::<D>(source, key, boundary)? {
        let turned = rotation.displacement(place, multiple(amplitudes.map(|(angle, _)| angle)));
        (0..D).for_each(|d| u[d] += turned[d]);
    }
    Ok(u)
}
