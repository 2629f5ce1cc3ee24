//! Computed stresses around a hole at the origin of a plate under tension along x, compared with closed
//! forms.

use super::{Plate, kirsch};
use crate::bonds::Bonds;
use crate::parallel;
use crate::stress::StressTensor;

/// Particles of a plate with a hole, with the exact σ₁₁/σ∞ at each.
pub struct HoleComparison {
    /// Kirsch's solution, Eq. (2.81).
    pub kirsch: Vec<f64>,
    /// Solution of the finite plate, if known; else Kirsch's.
    pub exact: Vec<f64>,
    radius: f64,
    /// Outer radius of the ring around the hole, m.
    near: f64,
    distance: Vec<f64>,
    inner: Vec<bool>,
    /// Heights above the hole and the particles there.
    column: Vec<(f64, Vec<usize>)>,
}

/// Particles over which an error is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HoleRegion {
    /// All particles.
    All,
    /// Particles without loads and supports.
    Inner,
    /// Particles up to 2δ from the hole.
    Ring,
    /// Particles farther than 2δ, up to five radii.
    Bulk,
}

impl HoleComparison {
    /// Evaluates the exact stresses of a hole of this radius, m, in a body; `loaded` marks its loaded sites.
    pub fn new<const D: usize>(
        bonds: &dyn Bonds<D>,
        radius: f64,
        plate: Option<&Plate>,
        loaded: &[bool],
    ) -> Self {
        let positions: Vec<[f64; D]> =
            bonds.particles().iter().map(|&site| bonds.position(site as usize)).collect();
        let kirsch: Vec<f64> = positions.iter().map(|p| kirsch(p[0], p[1], radius, 1.0)[0]).collect();
        let exact = match plate {
            Some(plate) => parallel::map_each(&positions, |p| plate.stress(p[0], p[1])[0]),
            None => kirsch.clone(),
        };
        Self {
            kirsch,
            exact,
            radius,
            near: radius + 2.0 * bonds.horizon(),
            distance: positions.iter().map(|p| p[0].hypot(p[1])).collect(),
            inner: bonds.particles().iter().map(|&site| !loaded[site as usize]).collect(),
            column: column(&positions, bonds.spacing()),
        }
    }

    /// σ₁₁/σ∞ of a stress field under the remote stress σ∞, Pa.
    pub fn normal<const D: usize>(field: &[StressTensor<D>], remote: f64) -> Vec<f64> {
        field.iter().map(|s| s[0][0] / remote).collect()
    }

    /// Root mean square (2.84) of the difference of σ₁₁/σ∞ from an exact one over a region.
    pub fn error(&self, normal: &[f64], exact: &[f64], region: HoleRegion) -> f64 {
        let wanted = |&i: &usize| match region {
            HoleRegion::All => true,
            HoleRegion::Inner => self.inner[i],
            HoleRegion::Ring => self.distance[i] <= self.near,
            HoleRegion::Bulk => self.distance[i] > self.near && self.distance[i] < 5.0 * self.radius,
        };
        let squares = (0..normal.len()).filter(wanted).map(|i| (normal[i] - exact[i]).powi(2));
        let (sum, count) = squares.fold((0.0, 0_usize), |(sum, count), square| (sum + square, count + 1));
        (sum / count.max(1) as f64).sqrt()
    }

    /// Largest value of the particles without loads and supports.
    pub fn most(&self, normal: &[f64]) -> f64 {
        (0..normal.len()).filter(|&i| self.inner[i]).map(|i| normal[i]).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Heights above the hole, m, and the mean values there; empty if no particle is near the line x = 0.
    pub fn profile(&self, values: &[f64]) -> [Vec<f64>; 2] {
        let mean = |members: &[usize]| members.iter().map(|&i| values[i]).sum::<f64>() / members.len() as f64;
        [self.column.iter().map(|row| row.0).collect(), self.column.iter().map(|row| mean(&row.1)).collect()]
    }
}

/// The column(s) of particles nearest the line x = 0, y > 0.
fn column<const D: usize>(positions: &[[f64; D]], spacing: f64) -> Vec<(f64, Vec<usize>)> {
    let mut near: Vec<usize> = (0..positions.len())
        .filter(|&i| positions[i][0].abs() < 0.6 * spacing && positions[i][1] > 0.0)
        .collect();
    near.sort_by(|&a, &b| positions[a][1].total_cmp(&positions[b][1]));
    let mut rows: Vec<(f64, Vec<usize>)> = Vec::new();
    for particle in near {
        let height = positions[particle][1];
        match rows.last_mut() {
            Some((last, members)) if height - *last < 0.1 * spacing => members.push(particle),
            _ => rows.push((height, vec![particle])),
        }
    }
    rows
}
