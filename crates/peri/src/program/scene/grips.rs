//! Compares the free length between grips over the spacings of a study.

use super::build::outline;
use super::{Boundary, SceneVariant};
use harness::scene::SceneError;

/// Relative change of the free length above which a study warns.
const WARNING_CHANGE: f64 = 1e-3;

/// A spacing, m, and the free length along each axis with grips at both sides, m.
type FreeLengths<const D: usize> = (f64, [Option<f64>; D]);

/// Returns a warning for each axis along which the free length between grips differs between variants that
/// differ in spacing only.
///
/// # Errors
/// As [`super::body_of`].
pub fn free_lengths<const D: usize>(variants: &[SceneVariant]) -> Result<Vec<String>, SceneError> {
    let mut warnings = Vec::new();
    let mut seen: Vec<(String, Vec<FreeLengths<D>>)> = Vec::new();
    for variant in variants.iter().filter(|variant| variant.spacing > 0.0) {
        if variant.of.expect_error.is_some() {
            continue;
        }
        let (source, scene) = variant.resolved();
        let (_, low, high) = outline::<D>(source, scene)?;
        let free = std::array::from_fn(|axis| {
            let depth = |upper: bool| {
                let is_here = |boundary: &&Boundary| {
                    boundary.prescribes_displacement()
                        && boundary.side.is_some_and(|side| side.axis() == (axis, upper))
                };
                let held = scene.boundary.iter().rev().find(is_here)?;
                Some(held.layers_of(variant.spacing, variant.horizon_ratio) as f64 * variant.spacing)
            };
            Some(high[axis] - low[axis] - depth(false)? - depth(true)?)
        });
        let found = (variant.spacing, free);
        match seen.iter_mut().find(|(family, _)| *family == variant.family()) {
            Some((_, members)) => members.push(found),
            None => seen.push((variant.family(), vec![found])),
        }
    }
    for (family, members) in seen {
        for axis in 0..D {
            let lengths = members.iter().filter_map(|(spacing, free)| Some((*spacing, free[axis]?)));
            let least = lengths.clone().min_by(|a, b| a.1.total_cmp(&b.1));
            let most = lengths.max_by(|a, b| a.1.total_cmp(&b.1));
            let (Some(least), Some(most)) = (least, most) else { continue };
            if most.1 - least.1 > WARNING_CHANGE * most.1.abs() {
                let name = ["x", "y", "z"][axis];
                warnings.push(format!(
                    "{family}: the free length between {name}- and {name}+ is {:.4} mm at a spacing of {:.4} \
                     mm and {:.4} mm at \
                     {:.4} mm: grips of whole layers change with the spacing; give their `depth`, a multiple \
                     of all spacings",
                    least.1 * 1e3,
                    least.0 * 1e3,
                    most.1 * 1e3,
                    most.0 * 1e3
                ));
            }
        }
    }
    Ok(warnings)
}
