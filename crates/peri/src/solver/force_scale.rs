//! Reference scale of forces, and force sums of a history row.

use super::load::Loads;
use crate::bonds::BodyGeometry;
use crate::field::{CHUNK, Field};
use crate::parallel;
use polycore::numerics::bounds;
use serde::{Deserialize, Serialize};

/// Fraction of the grips' bond forces under the strain U/L.
const LEAST_STRAIN: f64 = 0.01;

/// Reference scale of a body's forces besides its reactions, in the reference state.
#[derive(Clone, Debug, Default)]
pub struct ForceScale {
    /// s of each site, N/m⁴.
    pub(super) springs: Vec<f64>,
    /// U at load factor 1, m, and L, m.
    pub(super) largest: f64,
    pub(super) diagonal: f64,
    /// δ‖s‖₂ over constrained particles, N/m³, and δ Σ V s over them, N.
    pub(super) constrained: f64,
    pub(super) held_sum: f64,
}

impl ForceScale {
    /// Measures a body with its loads; `stiffness` is kθK.
    pub fn new<const D: usize>(bonds: &dyn BodyGeometry<D>, loads: &Loads<D>, stiffness: f64) -> Self {
        let of = |&site: &u32| {
            let mut sum = 0.0;
            bonds.neighbours(site as usize, &mut |bond| sum += 2.0 * stiffness * bond.weight / bond.length);
            sum
        };
        let sums: Vec<f64> = parallel::map_each(bonds.particles(), of);
        let mut scale = Self { springs: vec![0.0; bonds.sites()], ..Self::default() };
        let sides = loads.mean_gradient.map(|rows| rows.iter().flatten().map(|x| x * x).sum::<f64>().sqrt());
        let [low, high] = bounds(bonds.particles().iter().map(|&site| bonds.position(site as usize)));
        let mut square = 0.0;
        for (&site, sum) in bonds.particles().iter().zip(sums) {
            let site = site as usize;
            scale.springs[site] = sum;
            if let Some(prescribed) = loads.displacement.as_ref().filter(|_| loads.constrained(site) != 0) {
                let moved = prescribed.get(site).iter().map(|x| x * x).sum::<f64>().sqrt();
                scale.largest = scale.largest.max(moved);
                square += sum * sum;
                scale.held_sum += bonds.horizon() * bonds.volume(site) * sum;
            }
        }
        scale.diagonal = (0..D).map(|d| (high[d] - low[d]).powi(2)).sum::<f64>().sqrt();
        if let Some(strain) = sides {
            // bonds across periodic sides pull as those at grips
            scale.largest = scale.largest.max(strain * scale.diagonal);
            let origins = bonds.images().iter().map(|image| image.origin as usize);
            let sums = origins.map(|site| (scale.springs[site], bonds.volume(site)));
            let (squares, forces) =
                sums.fold((0.0, 0.0), |(s, f), (sum, volume)| (s + sum * sum, f + volume * sum));
            square += squares;
            scale.held_sum += bonds.horizon() * forces;
        }
        scale.constrained = bonds.horizon() * square.sqrt();
        scale
    }

    /// LEAST_STRAIN · min(U/L, 1) at a load factor.
    pub(super) fn strain(&self, factor: f64) -> f64 {
        LEAST_STRAIN * (self.largest * factor.abs() / self.diagonal.max(f64::MIN_POSITIVE)).min(1.0)
    }

    /// ‖s u‖₂.
    pub(super) fn moved<const D: usize>(&self, displacement: &Field<D>) -> f64 {
        let u = displacement.components();
        let of = |chunk: usize| {
            let springs = &self.springs[crate::field::chunk_range(chunk, self.springs.len())];
            let each = springs.iter().enumerate().map(|(k, s)| {
                let square: f64 = (0..D).map(|d| u[d][chunk * CHUNK + k].powi(2)).sum();
                s * s * square
            });
            each.sum::<f64>()
        };
        parallel::sum(self.springs.len().div_ceil(CHUNK), of).sqrt()
    }
}

/// Sums over the whole body in equilibrium. The first two vanish by Newton's third law, whatever the
/// residual: bonds and contact pull both ends with equal forces, along the line between them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Balance {
    /// |Σ V F| of the internal forces F, N.
    pub force: f64,
    /// |Σ V x × F| about the body's middle with deformed positions x, N·m.
    pub moment: f64,
    /// |Σ reactions + Σ loads|, N: remaining imbalance of the free particles.
    pub external: f64,
    /// ½ Σ V |F|, N, and no less than a hundredth of the grips' bond forces under the strain U/L.
    pub size: f64,
    /// Half the body's diagonal, m.
    pub arm: f64,
}
