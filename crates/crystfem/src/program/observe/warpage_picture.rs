//! Picture of the warped part.

use super::part_skin::{PartSkin, SolidFrame};
use crate::coupling::StressCoupling;
use crate::error::Error;
use crate::program::scene::{PartScene, PartTask};
use harness::output::picture::{ColorMap, Solids, Strip};
use std::path::Path;

/// Drawn displacement over the size of the part, by default.
const DRAWN_DISPLACEMENT: f64 = 0.1;

/// Draws warped.png: the parts that bear stress at the end, displacements magnified by `output.magnify`,
/// colored by lift and Mises stress.
pub fn draw(scene: &PartScene, task: &PartTask, stress: &StressCoupling, output: &Path) -> Result<(), Error> {
    let mesh = &task.problem.mesh;
    let stresses = stress.mises();
    let own: Vec<u32> =
        (0..mesh.element_count() as u32).filter(|&e| stresses[e as usize].is_finite()).collect();
    let Some(bounds) = mesh.bounds_of(&own) else { return Ok(()) };
    let moved = stress.displacement();
    let most = moved.chunks(3).map(|u| u[0].hypot(u[1]).hypot(u[2])).filter(|u| u.is_finite());
    let size = (0..3).map(|d| bounds[1][d] - bounds[0][d]).fold(0.0, f64::max);
    let factor = scene
        .output
        .magnify
        .unwrap_or_else(|| round_down(DRAWN_DISPLACEMENT * size / most.fold(0.0, f64::max)));
    let shown = |node: usize, d: usize| {
        let u = moved[3 * node + d];
        mesh.points[node][d] + if u.is_finite() { factor * u } else { 0.0 }
    };
    let points: Vec<[f64; 3]> =
        (0..mesh.points.len()).map(|node| std::array::from_fn(|d| shown(node, d))).collect();
    let (mut low, mut high) = (bounds[0], bounds[1]);
    for &node in own.iter().flat_map(|&element| mesh.nodes(element)) {
        for d in 0..3 {
            low[d] = low[d].min(points[node as usize][d]);
            high[d] = high[d].max(points[node as usize][d]);
        }
    }
    let lift: Vec<f64> = moved.chunks(3).map(|u| 1e3 * u[2]).collect();
    // stress is constant per element: each node gets the mean of its elements
    let mut around = vec![(0.0, 0.0); mesh.points.len()];
    for &element in &own {
        for &node in mesh.nodes(element) {
            let (sum, count) = &mut around[node as usize];
            *sum += 1e-6 * stresses[element as usize];
            *count += 1.0;
        }
    }
    let mises: Vec<f64> = around.into_iter().map(|(sum, count)| sum / count).collect();
    let range = |values: &[f64], least: f64| {
        let finite = || values.iter().copied().filter(|x| x.is_finite());
        let (low, high) = (finite().fold(least, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
        if high > low { (low, high) } else { (low.min(0.0), low.max(0.0) + 1.0) }
    };
    let fields = vec![
        Strip { label: "lift [mm]".into(), range: range(&lift, f64::INFINITY), colors: ColorMap::Viridis },
        Strip { label: "Mises stress [MPa]".into(), range: range(&mises, 0.0), colors: ColorMap::Inferno },
    ];
    let bounds = [low, high];
    let view = scene.output.solid.view();
    let solids = Solids { title: scene.title.clone(), bounds, unit: ("mm".into(), 1e-3), view, fields };
    let outside = PartSkin::new(mesh, &own, scene.output.solid.plane(bounds))?.with_points(points);
    let exists = stresses.iter().map(|stress| stress.is_finite()).collect();
    let state = if stress.settings().release { "released" } else { "on the bed" };
    let title = format!("{state}, displacements × {factor}");
    let (title, skin) = outside.skin(SolidFrame { title, values: vec![lift, mises], exists });
    solids.write(output.join("warped.png"), 1, |_| Ok((title.clone(), skin.clone())))?;
    Ok(())
}

/// Rounds down to 1, 2 or 5 times a power of ten; 1 if nothing moves.
fn round_down(factor: f64) -> f64 {
    if !factor.is_finite() || factor < 1.0 {
        return 1.0;
    }
    let power = 10.0_f64.powf(factor.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|digit| digit * power).find(|round| *round <= factor).unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::round_down;

    #[test]
    fn factors_are_rounded() {
        let found = [0.3, 1.0, 4.9, 18.0, 77.0, 1000.0, f64::INFINITY, f64::NAN].map(round_down);
        assert_eq!(found, [1.0, 1.0, 2.0, 10.0, 50.0, 1000.0, 1.0, 1.0]);
    }
}
