//! Coulomb friction, regularised where slip is slow.

use crate::geometry::length;

/// What two sides in contact exert on each other across their normal: −μN f₁(|v_t|/v_ε) v_t/|v_t| with v_t the part of the
/// relative velocity across `normal` and f₁(x) = 2x − x² below 1, 1 from there on: the C¹ mollifier of Li et al. (2020),
/// doi:10.1145/3386569.3392425. `bound` is μN, `slip` is v_ε; 0 is Coulomb's law itself, f₁ = 1.
pub fn tangential<const D: usize>(bound: f64, slip: f64, normal: &[f64; D], velocity: [f64; D]) -> [f64; D] {
    let across = across(normal, velocity);
    let size = length(across);
    if size == 0.0 {
        return [0.0; D];
    }
    let factor = if size < slip { (2.0 - size / slip) / slip } else { 1.0 / size };
    across.map(|v| -bound * factor * v)
}

/// The part of a vector across a unit normal.
pub fn across<const D: usize>(normal: &[f64; D], vector: [f64; D]) -> [f64; D] {
    let along: f64 = normal.iter().zip(vector).map(|(n, v)| n * v).sum();
    std::array::from_fn(|d| vector[d] - along * normal[d])
}

/// A step of explicit dynamics, as friction needs to know it.
#[derive(Clone, Copy, Debug)]
pub struct Rubbing {
    /// Mass density ρ, kg/m³.
    pub density: f64,
    /// Time step Δt, s; 0 before the first.
    pub step: f64,
}

impl Rubbing {
    /// v_ε, m/s, no less than 2μN nΔt/m_eff: friction is then a damper of at most m_eff/(nΔt), which n touches of a particle at once do not
    /// make unstable. `rate` is μN/m_eff per ρ: the force over the effective volume V_I V_J/(V_I + V_J). Coulomb's own law (0)
    /// stays what it is.
    pub fn slip(&self, wanted: f64, rate: f64, touches: f64) -> f64 {
        if wanted > 0.0 { wanted.max(2.0 * touches * rate * self.step / self.density) } else { 0.0 }
    }
}

/// What friction did in a work item.
#[derive(Clone, Debug, Default)]
pub struct Rubbed {
    /// Force of each plane, N.
    pub planes: Vec<[f64; 3]>,
    /// Largest v_ε in use, m/s.
    pub slip: f64,
}

impl Rubbed {
    /// Of `planes` planes.
    pub fn new(planes: usize) -> Self {
        Self { planes: vec![[0.0; 3]; planes], slip: 0.0 }
    }

    /// Adds another work item's.
    pub fn and(mut self, other: &Self) -> Self {
        for (sum, force) in self.planes.iter_mut().zip(&other.planes) {
            (0..3).for_each(|d| sum[d] += force[d]);
        }
        self.slip = self.slip.max(other.slip);
        self
    }
}
