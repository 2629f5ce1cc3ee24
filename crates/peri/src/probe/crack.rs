//! Cracks: the J-integral at a tip, and the tip of a crack that grows.

use super::StressEvaluator;
use crate::bonds::Bonds;
use crate::error::Error;
use crate::solver::State;

/// Distance of the particles of a crack's tip, in spacings.
const TIP: f64 = 2.0;

/// J-integral of a crack of a plane solid that grows along an axis, over a ring around its tip.
///
/// J = Σ V/t (P_ij u_i,1 − W δ_1j) ∂q/∂X_j along the axis 1, J/m²: the domain form of Li, Shih & Needleman
/// (1985), doi:10.1016/0013-7944(85)90029-3, of Rice's integral in the reference configuration, for flanks
/// without traction. q falls linearly from 1 at the inner radius to 0 at the outer.
pub struct JIntegral {
    sites: Vec<u32>,
    /// V/t ∇q of each site, m.
    weights: Vec<[f64; 2]>,
    axis: usize,
}

impl JIntegral {
    /// Finds the particles whose distance from `tip`, m, is between two radii, m, in a body of this
    /// thickness, m.
    ///
    /// # Errors
    /// [`Error::Geometry`] if no particle is there.
    pub fn new<const D: usize>(
        bonds: &dyn Bonds<D>,
        thickness: f64,
        tip: [f64; D],
        [inner, outer]: [f64; 2],
        axis: usize,
    ) -> Result<Self, Error> {
        let (mut sites, mut weights) = (Vec::new(), Vec::new());
        for &site in bonds.particles() {
            let place = bonds.position(site as usize);
            let arm = [place[0] - tip[0], place[1] - tip[1]];
            let radius = arm[0].hypot(arm[1]);
            if radius > inner && radius < outer {
                let area = bonds.volume(site as usize) / thickness;
                sites.push(site);
                weights.push(arm.map(|x| -area * x / (radius * (outer - inner))));
            }
        }
        if sites.is_empty() {
            let found = format!("{inner} m to {outer} m about {tip:?} m, where no particle is");
            return Err(Error::geometry(found));
        }
        Ok(Self { sites, weights, axis })
    }

    /// J in a state, J/m².
    pub fn value<const D: usize>(
        &self,
        evaluator: &StressEvaluator<D>,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
    ) -> f64 {
        let mut sum = 0.0;
        evaluator.energy_momentum(bonds, state, &self.sites, &mut |at, tensor| {
            let products = self.weights[at].iter().zip(tensor[self.axis]);
            sum += products.map(|(weight, entry)| weight * entry).sum::<f64>();
        });
        sum
    }
}

/// Tip of a crack that grows along an axis through some sites.
pub struct CrackTip {
    /// Sites to search.
    pub sites: Vec<u32>,
    /// Intact bonds of each site in the reference state.
    pub whole: Vec<u32>,
    /// Damage range of particles at the tip: less is intact, more lies behind it.
    pub damage: [f64; 2],
    /// Axis along which the crack grows.
    pub axis: usize,
    /// Axis along which to measure its distance from 0.
    pub across: Option<usize>,
}

impl CrackTip {
    /// Position along the axis of the farthest particle (reference configuration) with damage in the range,
    /// and the largest distance from 0 across it of the particles near it, m; NaN if there is none.
    pub fn value<const D: usize>(&self, bonds: &dyn Bonds<D>) -> [f64; 2] {
        let [low, high] = self.damage;
        let damaged = |&site: &u32| {
            let whole = self.whole[site as usize];
            let damage = 1.0 - f64::from(bonds.bonded(site as usize)) / f64::from(whole.max(1));
            whole > 0 && (low..=high).contains(&damage)
        };
        let torn: Vec<[f64; D]> =
            self.sites.iter().copied().filter(damaged).map(|site| bonds.position(site as usize)).collect();
        let farthest = torn.iter().max_by(|a, b| a[self.axis].total_cmp(&b[self.axis]));
        let Some(tip) = farthest else { return [f64::NAN; 2] };
        let near = |place: &&[f64; D]| {
            let square: f64 = (0..D).map(|d| (place[d] - tip[d]).powi(2)).sum();
            square <= (TIP * bonds.spacing()).powi(2)
        };
        let across = self
            .across
            .map_or(f64::NAN, |axis| torn.iter().filter(near).map(|at| at[axis].abs()).fold(0.0, f64::max));
        [tip[self.axis], across]
    }
}
