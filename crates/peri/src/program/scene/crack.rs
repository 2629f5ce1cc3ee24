//! Cracks of zero width, and the bonds that they sever.

use super::Scene;
use super::values::{plain, vector};
use crate::bonds::{Bonds, CellGrid};
use crate::geometry::{Cut, cuts_within, severed as severs};
use harness::scene::{SceneError, Source};
use polycore::units::Length;

/// Checks and converts the cracks of a scene.
///
/// # Errors
/// As [`super::body_of`].
pub(super) fn cracks<const D: usize>(source: &Source, scene: &Scene) -> Result<Vec<Cut<D>>, SceneError> {
    let cuts = cuts_of(scene);
    for (index, (crack, Cut { edges, .. })) in scene.body.cracks.iter().zip(&cuts).enumerate() {
        let key = |name: &str| format!("body.cracks[{index}].{name}");
        vector::<D>(source, &key("from"), &crack.from)?;
        vector::<D>(source, &key("to"), &crack.to)?;
        match (&crack.and, D) {
            (Some(and), 3) => {
                vector::<D>(source, &key("and"), and)?;
            }
            (None, 2) => {}
            (Some(_), _) => {
                return Err(source.unexpected(&key("and"), "a crack of a plane body has two corners"));
            }
            (None, _) => {
                return Err(source.missing(&key("and"), "needed in a solid: the third corner of the crack"));
            }
        }
        if edges.iter().take(D - 1).any(|e| e.iter().all(|&x| x == 0.0)) {
            return Err(source.error(&key("to"), "the same point as `from`", "another point"));
        }
        if D == 3 && parallel(edges[0], edges[1]) {
            return Err(source.error(&key("and"), "a corner on the line `from`–`to`", "a corner beside it"));
        }
    }
    Ok(cuts)
}

/// Converts the cracks of a checked scene.
pub fn cuts_of<const D: usize>(scene: &Scene) -> Vec<Cut<D>> {
    let each = scene.body.cracks.iter().map(|crack| {
        let place =
            |of: &[Length]| -> [f64; D] { std::array::from_fn(|d| of.get(d).map_or(0.0, |x| x.si())) };
        let corner = place(&crack.from);
        let edge = |end: &Vec<Length>| -> [f64; D] { std::array::from_fn(|d| place(end)[d] - corner[d]) };
        let mut edges = [[0.0; D]; D];
        edges[0] = edge(&crack.to);
        edges[1] = crack.and.as_ref().map_or([0.0; D], edge);
        Cut { corner, edges }
    });
    each.collect()
}

/// Counts the bonds that each crack breaks on its own.
///
/// # Errors
/// A crack that breaks none.
pub(super) fn severed<const D: usize>(
    source: &Source,
    bonds: &dyn Bonds<D>,
    cuts: &[Cut<D>],
) -> Result<Vec<u64>, SceneError> {
    // bonds as long as the horizon count despite rounding of positions
    let reach = bonds.horizon() * (1.0 + 1e-9);
    let count = |(index, cut): (usize, &Cut<D>)| {
        let places = bonds.particles().iter().map(|&site| bonds.position(site as usize));
        let places: Vec<[f64; D]> = places.filter(|&place| cut.is_within(place, reach)).collect();
        let mut severed = 0;
        if !places.is_empty() {
            let grid = CellGrid::new(&places, reach);
            for (own, &here) in places.iter().enumerate() {
                grid.near(here, reach, |other| {
                    let square: f64 = (0..D).map(|d| (places[other][d] - here[d]).powi(2)).sum();
                    severed +=
                        u64::from(own < other && square <= reach * reach && cut.severs(here, places[other]));
                });
            }
        }
        if severed == 0 {
            let spacing = plain((bonds.spacing() * 1e9).round() / 1e6);
            let found = format!("a crack that breaks no bond of particles {spacing} mm apart");
            return Err(source.error(
                &format!("body.cracks[{index}]"),
                found,
                "a crack across a part of the body, or a smaller spacing",
            ));
        }
        Ok(severed)
    };
    cuts.iter().enumerate().map(count).collect()
}

/// Counts the bonds of each particle that the cracks break together.
pub fn severed_of_each<const D: usize>(bonds: &dyn Bonds<D>, cuts: &[Cut<D>]) -> Vec<u32> {
    let reach = bonds.horizon() * (1.0 + 1e-9);
    let mut counts = vec![0; bonds.particles().len()];
    let places = bonds.particles().iter().map(|&site| bonds.position(site as usize)).enumerate();
    let near = |place: &[f64; D]| cuts.iter().any(|cut| cut.is_within(*place, reach));
    let (own, places): (Vec<usize>, Vec<[f64; D]>) = places.filter(|(_, place)| near(place)).unzip();
    if own.is_empty() {
        return counts;
    }
    let grid = CellGrid::new(&places, reach);
    for (k, &here) in places.iter().enumerate() {
        let cuts = cuts_within(cuts, here, reach);
        grid.near(here, reach, |other| {
            let square: f64 = (0..D).map(|d| (places[other][d] - here[d]).powi(2)).sum();
            counts[own[k]] +=
                u32::from(other != k && square <= reach * reach && severs(&cuts, here, places[other]));
        });
    }
    counts
}

/// Returns true if |a × b| vanishes to rounding.
fn parallel<const D: usize>(a: [f64; D], b: [f64; D]) -> bool {
    let dot = |a: [f64; D], b: [f64; D]| (0..D).map(|d| a[d] * b[d]).sum::<f64>();
    let (aa, bb, ab) = (dot(a, a), dot(b, b), dot(a, b));
    aa * bb - ab * ab <= 1e-12 * aa * bb
}
