//! Refuses regions that prescribe different displacements of one particle.

use super::rotation::rotation_of;
use super::values::{DiscreteBody, plain};
use super::{Boundary, Prescribed, PrescribedField, Scene};
use crate::solver::{Amplitude, Rotation, Support};
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
    if scene.boundary.iter().filter(|boundary| boundary.prescribes_displacement()).count() < 2 {
        return Ok(());
    }
    let motion = |(index, boundary)| -> Result<BoundaryMotion<D>, SceneError> {
        let rotation = rotation_of::<D>(source, &format!("boundary[{index}]"), boundary)?;
        Ok(BoundaryMotion { boundary, rotation, amplitudes: amplitudes.get(index) })
    };
    let motions: Vec<BoundaryMotion<D>> =
        scene.boundary.iter().enumerate().map(motion).collect::<Result<_, _>>()?;
    let mut owners = vec![[NONE; D]; body.bonds.sites()];
    for (index, (members, support)) in regions.iter().enumerate() {
        for &site in members {
            let place = body.bonds.position(site as usize);
            for d in (0..D).filter(|&d| support.displacement[d].is_some()) {
                let other = std::mem::replace(&mut owners[site as usize][d], index as u32);
                let Some(before) = motions.get(other as usize) else { continue };
                if let Some((found, allowed)) = motions[index].disagreement(before, other, place, d) {
                    return Err(source.error(&format!("boundary[{index}]"), found, allowed));
                }
            }
        }
    }
    Ok(())
}

/// Prescribed motion of a boundary.
struct BoundaryMotion<'a, const D: usize> {
    boundary: &'a Boundary,
    rotation: Option<Rotation<D>>,
    amplitudes: Option<&'a (Amplitude, [Amplitude; D])>,
}

impl<const D: usize> BoundaryMotion<'_, D> {
    /// Returns how component `d` of a particle differs from that by boundary `other`, and what is allowed.
    fn disagreement(
        &self,
        before: &Self,
        other: u32,
        place: [f64; D],
        d: usize,
    ) -> Option<(String, &'static str)> {
        let moments: &[f64] = if self.amplitudes.is_some() { &MOMENTS } else { &MOMENTS[2..] };
        for &part in moments {
            let [own, before] = [self, before].map(|motion| motion.displacement(place, part)[d]);
            if own.is_nan() != before.is_nan() {
                let found = format!("`hold` or a displacement of particles that boundary[{other}] moves");
                return Some((found, "`hold` in both where regions overlap, or `free` in one of them"));
            }
            // what is held in place is unknown before the run
            if (own - before).abs() > EQUAL * own.abs().max(before.abs()) {
                let when = self.amplitudes.map_or(String::new(), |_| format!(" at {part} of the time"));
                let at: Vec<String> = place.iter().map(|x| plain((x * 1e9).round() / 1e6)).collect();
                let found = format!(
                    "{} m along {} of the particle at ({}) mm{when}, for which boundary[{other}] prescribes \
                     {} m",
                    plain(own),
                    ["x", "y", "z"][d],
                    at.join(", "),
                    plain(before)
                );
                return Some((found, "equal displacements where regions overlap, or `free` in one of them"));
            }
        }
        None
    }

    /// Displacement of a particle at a part of the time, m; NaN where it is not known.
    fn displacement(&self, place: [f64; D], part: f64) -> [f64; D] {
        let value = |d: usize| {
            let held = self.boundary.displacement.as_ref().and_then(|held| held.get(d));
            let field = self.boundary.displacement_field.as_ref().and_then(|field| field.get(d));
            match (held, field) {
                (Some(Prescribed::At(value)), _) => *value,
                (Some(Prescribed::Hold), _) => f64::NAN,
                (_, Some(PrescribedField::By(formula))) => formula.value_at(place),
                _ => 0.0,
            }
        };
        let multiple =
            |amplitude: Option<&Amplitude>| amplitude.map_or(1.0, |amplitude| amplitude.multiple(part));
        let turned = self.rotation.as_ref().map_or([0.0; D], |rotation| {
            rotation.displacement(place, multiple(self.amplitudes.map(|(angle, _)| angle)))
        });
        std::array::from_fn(|d| value(d) * multiple(self.amplitudes.map(|(_, each)| &each[d])) + turned[d])
    }
}
