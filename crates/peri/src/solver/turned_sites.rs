//! Rotating regions across the steps of a programme: each begins a step with the angle, the shift and the
//! warp at the end of the step before.

use super::curves::CurvedRegion;
use super::load::Loads;
use super::rotation::{RotatingRegion, Rotation, TurnStart};
use super::stage::StepOrigin;
use crate::amplitude::Amplitude;
use crate::bonds::BodyGeometry;
use crate::error::Error;
use crate::field::Field;
use crate::geometry::length;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Part of the spacing that rounding of a place explains.
const ROUNDING: f64 = 1e-12;
/// Largest jump of a region at the start of a step, in spacings.
const JUMP: f64 = 1e-6;
/// Largest angle, rad, of sites that count as not turned.
const STRAIGHT: f64 = 1e-9;
/// Largest distance of two axes, in spacings, and of the sine between them, that count as one.
const ONE_AXIS: f64 = 1e-9;

/// Sites that steps so far have turned about an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TurnedSites {
    /// A point of the axis, m.
    pub centre: [f64; 3],
    /// Unit vector of the axis.
    pub axis: [f64; 3],
    /// Angle, rad, with all full turns.
    pub angle: f64,
    /// The sites, in ascending order.
    pub sites: Vec<u32>,
}

impl<const D: usize> Rotation<D> {
    /// Returns true if two rotations have one axis, in either direction, within a distance, m.
    pub fn shares_axis(&self, other: &Self, near: f64) -> bool {
        let space = |x: [f64; D]| -> [f64; 3] { std::array::from_fn(|d| x.get(d).copied().unwrap_or(0.0)) };
        let [own, there] = [self.centre, other.centre].map(space);
        let across = |b: [f64; 3]| {
            let n = self.axis;
            length::<3>(std::array::from_fn(|d| {
                n[(d + 1) % 3] * b[(d + 2) % 3] - n[(d + 2) % 3] * b[(d + 1) % 3]
            }))
        };
        let apart = across(std::array::from_fn(|d| there[d] - own[d]));
        apart <= near && across(other.axis) <= ONE_AXIS
    }
}

impl TurnedSites {
    /// Angle about the axis of a rotation, rad; `None` about another axis.
    fn angle_about<const D: usize>(&self, rotation: &Rotation<D>, spacing: f64) -> Option<f64> {
        let along: f64 = (0..3).map(|d| self.axis[d] * rotation.axis[d]).sum();
        self.rotation(0.0).shares_axis(rotation, ONE_AXIS * spacing).then(|| self.angle * along.signum())
    }

    fn rotation<const D: usize>(&self, angle: f64) -> Rotation<D> {
        Rotation { centre: std::array::from_fn(|d| self.centre[d]), axis: self.axis, angle }
    }

    fn title(&self) -> String {
        let point = self.centre.map(|x| format!("{:.4}", x * 1e3)).join(", ");
        let axis = self.axis.map(|x| format!("{x:.4}")).join(", ");
        format!(
            "turned by {:.4}° about the axis through ({point}) mm along ({axis})",
            self.angle.to_degrees()
        )
    }
}

/// Rigid angle of sites about an axis, rad, within half a turn of another one.
fn angle_of<const D: usize>(
    bonds: &dyn BodyGeometry<D>,
    displacement: &Field<D>,
    (sites, rotation): (&[u32], &Rotation<D>),
    near: f64,
) -> f64 {
    let count = sites.len().max(1) as f64;
    let place = |site: u32| bonds.position(site as usize);
    let moved = |site: u32| {
        let (x, u) = (bonds.position(site as usize), displacement.get(site as usize));
        std::array::from_fn(|d| x[d] + u[d])
    };
    let mean = |of: &dyn Fn(u32) -> [f64; D]| {
        let sum = sites.iter().fold([0.0; D], |sum, &site| {
            let value = of(site);
            std::array::from_fn(|d| sum[d] + value[d])
        });
        sum.map(|x| x / count)
    };
    let [first, last] = [mean(&place), mean(&moved)];
    let (mut cosine, mut sine) = (0.0, 0.0);
    for &site in sites {
        let (x, y) = (place(site), moved(site));
        let from = std::array::from_fn(|d| x[d] - first[d]);
        let [across, arm] = rotation.across(from);
        for d in 0..D {
            cosine += across[d] * (y[d] - last[d]);
            sine += arm[d] * (y[d] - last[d]);
        }
    }
    let angle = if cosine == 0.0 && sine == 0.0 { near } else { f64::atan2(sine, cosine) };
    angle + TAU * ((near - angle) / TAU).round()
}

impl<const D: usize> RotatingRegion<D> {
    /// Begins a step at the place of its particles, at an angle, rad; `common` is the load factor.
    ///
    /// # Errors
    /// A deformed region of which some components across the axis are held, others not; the text says what is
    /// found and allowed.
    fn begin(
        &mut self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        angle: f64,
        common: &Amplitude,
    ) -> Result<(), String> {
        let rounding = ROUNDING * bonds.spacing();
        let offset = |&site: &u32| -> [f64; D] {
            let u = displacement.get(site as usize);
            let turned = self.rotation.turn(angle, self.rotation.offset(bonds.position(site as usize)));
            std::array::from_fn(|d| if self.prescribes(d) { u[d] - turned[d] } else { 0.0 })
        };
        let offsets: Vec<[f64; D]> = self.sites.iter().map(offset).collect();
        let sum = offsets.iter().fold([0.0; D], |sum, own| std::array::from_fn(|d| sum[d] + own[d]));
        let mean = sum.map(|x| x / offsets.len().max(1) as f64);
        let shift = mean.map(|x| if x.abs() <= rounding { 0.0 } else { x });
        let back = |offset: &[f64; D]| {
            let from: [f64; D] = std::array::from_fn(|d| offset[d] - shift[d]);
            let turned = self.rotation.turn(-angle, from);
            std::array::from_fn(|d| if self.prescribes(d) { from[d] + turned[d] } else { 0.0 })
        };
        let mut warp: Vec<[f64; D]> = offsets.iter().map(back).collect();
        let largest = |d: usize| warp.iter().fold(0.0, |most, own| f64::max(most, own[d].abs()));
        let warped: [bool; D] = std::array::from_fn(|d| largest(d) > rounding);
        let held = |d: usize| self.kept >> d & 1 == 1;
        let along = self.rotation.along();
        let across = || (0..D).filter(|&d| along != Some(d));
        if across().any(|d| warped[d]) && across().any(held) && !across().all(held) {
            let most = across().map(largest).fold(0.0, f64::max);
            return Err(format!(
                "its particles, up to {:.4} mm from the places of a rigid region, and `hold` beside a \
                 length; allowed: `hold` in all components across the axis, which turns the region as it \
                 is, or in none",
                most * 1e3
            ));
        }
        if warped == [false; D] {
            warp = Vec::new();
        }
        let (still, common) = (Amplitude::new(|_| (1.0, 0.0)), common.clone());
        let falling = Amplitude::new(move |part| (1.0 - common.multiple(part), -common.rate(part)));
        let fading = std::array::from_fn(|d| if held(d) { still.clone() } else { falling.clone() });
        self.start = Some(TurnStart { angle, shift, warp, fading });
        Ok(())
    }
}

/// Motion of a region without a `rotation` of its own in the next step.
enum NextMotion<const D: usize> {
    /// Straight, from where it is.
    Straight,
    /// Along the arc, to the angle of this rotation.
    Arc(Rotation<D>),
}

/// Finds the motion of a region without a `rotation` of its own: a region that has been turned stays at its
/// angle, or returns to 0.
///
/// # Errors
/// A motion that would distort the region; the text says what is found and allowed.
fn next_motion<const D: usize>(
    region: &CurvedRegion<D>,
    turned: &[TurnedSites],
) -> Result<NextMotion<D>, String> {
    let shares = |own: &&TurnedSites| region.sites.iter().any(|site| own.sites.binary_search(site).is_ok());
    let Some(own) = turned.iter().find(shares) else { return Ok(NextMotion::Straight) };
    let has = |mask: u8, d: usize| mask >> d & 1 == 1;
    let along = own.rotation::<D>(0.0).along();
    let across = || (0..D).filter(|&d| along != Some(d));
    let [held, set] = [region.kept, region.components & !region.kept]
        .map(|mask| across().filter(|&d| has(mask, d)).count());
    let every = across().count();
    let whole = region.sites.iter().all(|site| own.sites.binary_search(site).is_ok());
    if set == 0 {
        return Ok(if whole && held == every {
            NextMotion::Arc(own.rotation(own.angle))
        } else {
            NextMotion::Straight
        });
    }
    let first = region.values.first().copied().unwrap_or([0.0; D]);
    let same = |value: &[f64; D]| (0..D).all(|d| !has(region.components, d) || value[d] == first[d]);
    let uniform = region.values.iter().all(same);
    let mut amplitudes = across().map(|d| &region.amplitudes[d]);
    let one = amplitudes.next();
    if whole && set == every && uniform && amplitudes.all(|amplitude| Some(amplitude) == one) {
        return Ok(NextMotion::Arc(own.rotation(0.0)));
    }
    Err(format!(
        "displacements of particles {}; allowed: a `rotation`, `hold`, or lengths with one curve in all \
         components across the axis, which turn the region back",
        own.title()
    ))
}

impl<const D: usize> Loads<D> {
    /// Sites turned so far at the end of a step that began at `origin`, at the load factor `factor`.
    pub(super) fn turned_at_end(
        &self,
        bonds: &dyn BodyGeometry<D>,
        origin: &StepOrigin<D>,
        displacement: &Field<D>,
        factor: f64,
    ) -> Vec<TurnedSites> {
        let of = |region: &RotatingRegion<D>| {
            let Rotation { centre, axis, .. } = region.rotation;
            let mut sites = self.held_regions.get(region.region).unwrap_or(&region.sites).clone();
            sites.sort_unstable();
            let centre = std::array::from_fn(|d| centre.get(d).copied().unwrap_or(0.0));
            TurnedSites { centre, axis, angle: region.turn_at(factor).0, sites }
        };
        let mut all: Vec<TurnedSites> = self.turned.iter().map(of).collect();
        let count = all.len();
        for before in &origin.turned {
            let known = |site: &u32| all[..count].iter().any(|own| own.sites.binary_search(site).is_ok());
            let sites: Vec<u32> = before.sites.iter().copied().filter(|site| !known(site)).collect();
            let rotation = before.rotation(0.0);
            let angle = angle_of(bonds, displacement, (&sites, &rotation), before.angle);
            // what a free region has left of a turn without full ones is seen in its place
            if sites.iter().all(|&site| self.constrained(site as usize) == 0) && angle.abs() < FRAC_PI_2 {
                continue;
            }
            all.push(TurnedSites { angle, sites, ..before.clone() });
        }
        all.retain(|own| !own.sites.is_empty() && own.angle.abs() > STRAIGHT);
        all
    }

    /// Lets rotations begin at the start of a step, and regions that have been turned stay, or return along
    /// the arc.
    ///
    /// # Errors
    /// [`Error::Geometry`] for another axis than before, a part of a turned region, or a motion that would
    /// distort it.
    pub(super) fn continue_turned(
        &mut self,
        bonds: &dyn BodyGeometry<D>,
        origin: &StepOrigin<D>,
        common: &Amplitude,
    ) -> Result<(), Error> {
        let (Some(curved), Some(displacement)) = (&mut self.curved, &origin.displacement) else {
            return Ok(());
        };
        let refused = |sites: &[u32], found: String| {
            let place = sites.first().map_or([0.0; D], |&site| bonds.position(site as usize));
            let place = place.map(|x| format!("{:.4}", x * 1e3)).join(", ");
            let text = format!("step {}: region with the particle at ({place}) mm", origin.finished + 1);
            Error::geometry(format!("{text}: found {found}"))
        };
        for region in std::mem::take(&mut curved.held) {
            match next_motion(&region, &origin.turned).map_err(|found| refused(&region.sites, found))? {
                NextMotion::Straight => curved.held.push(region),
                NextMotion::Arc(rotation) => self.turned.push(RotatingRegion {
                    rotation,
                    shift: region.values.first().copied().unwrap_or([0.0; D]),
                    amplitudes: (0..D)
                        .find(|&d| rotation.along() != Some(d))
                        .map(|d| (region.amplitudes[d].clone(), region.amplitudes.clone())),
                    components: region.components,
                    kept: region.kept,
                    region: self
                        .held_regions
                        .iter()
                        .position(|own| *own == region.sites)
                        .unwrap_or(usize::MAX),
                    sites: region.sites,
                    start: None,
                }),
            }
        }
        for region in &mut self.turned {
            let mut angle = None;
            for own in &origin.turned {
                let count = region.sites.iter().filter(|site| own.sites.binary_search(site).is_ok()).count();
                if count == 0 {
                    continue;
                }
                if count < region.sites.len() {
                    let found = format!("{count} of {} particles {}", region.sites.len(), own.title());
                    let allowed = "a region whose particles have all been turned, or none";
                    return Err(refused(&region.sites, format!("{found}; allowed: {allowed}")));
                }
                let Some(about) = own.angle_about(&region.rotation, bonds.spacing()) else {
                    let allowed = "the same axis; another one once it is turned back to 0°";
                    let found = format!("a rotation about another axis of a region {}", own.title());
                    return Err(refused(&region.sites, format!("{found}; allowed: {allowed}")));
                };
                angle = Some(about);
            }
            let angle = angle
                .unwrap_or_else(|| angle_of(bonds, displacement, (&region.sites, &region.rotation), 0.0));
            let begun = region.begin(bonds, displacement, angle, common);
            begun.map_err(|found| refused(&region.sites, found))?;
        }
        Ok(())
    }

    /// Refuses regions that do not begin a step where the one before has left them.
    ///
    /// # Errors
    /// [`Error::Geometry`] with the particle and the jump.
    pub(super) fn refuse_jumps(
        &self,
        bonds: &dyn BodyGeometry<D>,
        origin: &StepOrigin<D>,
    ) -> Result<(), Error> {
        let Some(before) = &origin.displacement else { return Ok(()) };
        let mut begun = before.clone();
        self.place_turned(bonds, 0.0, &mut begun);
        let jump = |site: usize| {
            let (old, new) = (before.get(site), begun.get(site));
            length::<D>(std::array::from_fn(|d| new[d] - old[d]))
        };
        let each = bonds.particles().iter().map(|&site| (site as usize, jump(site as usize)));
        let Some((site, most)) = each.max_by(|a, b| a.1.total_cmp(&b.1)) else { return Ok(()) };
        if most <= JUMP * bonds.spacing() {
            return Ok(());
        }
        let place = bonds.position(site).map(|x| format!("{:.4}", x * 1e3)).join(", ");
        Err(Error::geometry(format!(
            "step {}: found a prescribed motion that begins {:.4} mm from where the step before has left \
             the particle at ({place}) mm; allowed: a curve that is 0 at the start, in explicit dynamics \
             also a ramp",
            origin.finished + 1,
            most * 1e3
        )))
    }
}
