//! Refuses regions that prescribe different displacements of one particle.

use super::curve::CurveTime;
use super::rotation::rotation_of;
use super::values::{DiscreteBody, plain};
use super::{Boundary, Prescribed, PrescribedField, Scene};
use crate::solver::{Amplitude, Rotation, Support};
use harness::scene::{SceneError, Source};

/// Number of even parts of the time at which displacements with curves are compared, beside the ends of
/// increments.
const MOMENTS: u32 = 64;
/// Largest number of increments whose ends are compared.
const MOST_INCREMENTS: usize = 1024;
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
    refuse_velocities(source, scene, body, regions)?;
    if scene.boundary.iter().filter(|boundary| boundary.prescribes_displacement()).count() < 2 {
        return Ok(());
    }
    let moments = moments(scene, !amplitudes.is_empty());
    let motion = |(index, boundary)| -> Result<BoundaryMotion<D>, SceneError> {
        let rotation = rotation_of::<D>(source, &format!("boundary[{index}]"), boundary, scene.later)?;
        Ok(BoundaryMotion { boundary, rotation, amplitudes: amplitudes.get(index), later: scene.later })
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
                if let Some((found, allowed)) =
                    motions[index].disagreement(before, other, (place, d), &moments)
                {
                    return Err(source.error(&format!("boundary[{index}]"), found, allowed));
                }
            }
        }
    }
    Ok(())
}

/// Parts of the time at which displacements are compared: of curves, ends of increments and even parts.
fn moments(scene: &Scene, curved: bool) -> Vec<f64> {
    if !curved {
        return vec![1.0];
    }
    let time = CurveTime::new(scene);
    let rows = time.moments();
    let apart = rows.len().div_ceil(MOST_INCREMENTS).max(1);
    let ends = rows.iter().step_by(apart).map(|at| at / time.end).filter(|&part| part > 0.0);
    ends.chain((1..=MOMENTS).map(|k| f64::from(k) / f64::from(MOMENTS))).collect()
}

/// Refuses overlapping regions with different velocities at the start.
fn refuse_velocities<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
    regions: &[(Vec<u32>, Support<D>)],
) -> Result<(), SceneError> {
    let mut owners = vec![NONE; body.bonds.sites()];
    for (index, (boundary, (members, _))) in scene.boundary.iter().zip(regions).enumerate() {
        if !boundary.prescribes_velocity() {
            continue;
        }
        for &site in members {
            let other = std::mem::replace(&mut owners[site as usize], index as u32);
            let Some(before) = scene.boundary.get(other as usize) else { continue };
            let place = body.bonds.position(site as usize);
            for d in 0..D {
                let [own, before] = [boundary, before].map(|one| one.velocity_at(place, d));
                if (own - before).abs() > EQUAL * own.abs().max(before.abs()) {
                    let found = format!(
                        "{} m/s along {} of the particle at ({}) mm, for which boundary[{other}] prescribes \
                         {} m/s",
                        plain(own),
                        ["x", "y", "z"][d],
                        millimetres(place),
                        plain(before)
                    );
                    let allowed = "equal velocities where regions overlap";
                    return Err(source.error(&format!("boundary[{index}]"), found, allowed));
                }
            }
        }
    }
    Ok(())
}

/// Formats a place in mm.
fn millimetres<const D: usize>(place: [f64; D]) -> String {
    place.map(|x| plain((x * 1e9).round() / 1e6)).join(", ")
}

/// Prescribed motion of a boundary.
struct BoundaryMotion<'a, const D: usize> {
    boundary: &'a Boundary,
    rotation: Option<Rotation<D>>,
    amplitudes: Option<&'a (Amplitude, [Amplitude; D])>,
    /// True in a later step, whose motions begin where the one before has left the particles.
    later: bool,
}

impl<const D: usize> BoundaryMotion<'_, D> {
    /// Returns how component `d` of a particle differs from that by boundary `other`, and what is allowed.
    fn disagreement(
        &self,
        before: &Self,
        other: u32,
        (place, d): ([f64; D], usize),
        moments: &[f64],
    ) -> Option<(String, &'static str)> {
        if self.later && self.rotation.is_some() != before.rotation.is_some() {
            let found = format!("particles that boundary[{other}] moves, one of them by a `rotation`");
            return Some((found, "a `rotation` in both where regions overlap, or `free` in one of them"));
        }
        for &part in moments {
            let moves = !self.holds(d) || self.rotation.is_some();
            if self.later && moves && self.multiples(part, d) != before.multiples(part, d) {
                let found = format!("particles that boundary[{other}] moves by another curve");
                return Some((found, "one curve where regions overlap in a later step"));
            }
            if self.holds(d) != before.holds(d) {
                let found = format!("`hold` or a displacement of particles that boundary[{other}] moves");
                return Some((found, "`hold` in both where regions overlap, or `free` in one of them"));
            }
            let [own, before] = [self, before].map(|motion| motion.displacement(place, part)[d]);
            if (own - before).abs() > EQUAL * own.abs().max(before.abs()) {
                let when = self.amplitudes.map_or(String::new(), |_| format!(" at {part} of the time"));
                let found = format!(
                    "{} m along {} of the particle at ({}) mm{when}, for which boundary[{other}] prescribes \
                     {} m",
                    plain(own),
                    ["x", "y", "z"][d],
                    millimetres(place),
                    plain(before)
                );
                return Some((found, "equal displacements where regions overlap, or `free` in one of them"));
            }
        }
        None
    }

    /// Returns the multiples of the angle and of a component at a part of the time.
    fn multiples(&self, part: f64, d: usize) -> [f64; 2] {
        let both = self.amplitudes.map(|(angle, each)| [angle, &each[d]].map(|one| one.multiple(part)));
        let [angle, own] = both.unwrap_or([1.0; 2]);
        [if self.rotation.is_some() { angle } else { 0.0 }, own]
    }

    /// Returns true if the component keeps its value of the start of a step, which is unknown before the run.
    fn holds(&self, d: usize) -> bool {
        self.boundary.held_in_place() >> d & 1 == 1
    }

    /// Displacement of a particle at a part of the time, m; of components that are held, by a rotation alone.
    fn displacement(&self, place: [f64; D], part: f64) -> [f64; D] {
        let value = |d: usize| {
            let held = self.boundary.displacement.as_ref().and_then(|held| held.get(d));
            let field = self.boundary.displacement_field.as_ref().and_then(|field| field.get(d));
            match (held, field) {
                (Some(Prescribed::At(value)), _) => *value,
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
