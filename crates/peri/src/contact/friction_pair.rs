//! Coulomb friction with elastic slip: return mapping of Simo & Laursen (1992),
//! doi:10.1016/0045-7949(92)90540-G.
//!
//! Two sides in contact hold each other by T = −k_t e with the elastic slip e, up to |T| = b = μN; the rest
//! slides. For a given N the force is the gradient of the convex potential ½k_t|e*|² below b/k_t and b|e*| −
//! b²/(2k_t) beyond, e* = Pe + Δu_t: equilibria exist, and minimisers find them.

use crate::geometry::length;
use serde::{Deserialize, Serialize};

/// Two sides in contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum ContactPair {
    /// Two particles, by their sites.
    Particles(u32, u32),
    /// A rigid surface and a face, by their numbers.
    Face(u32, u32),
    /// A rigid surface, by its number, and a particle without a face, by its site.
    Particle(u32, u32),
}

/// Friction of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrictionPair {
    /// The sides.
    pub pair: ContactPair,
    /// Elastic slip e, m.
    pub slip: [f64; 3],
    /// b = μN, N.
    pub bound: f64,
    /// k_t, N/m.
    pub stiffness: f64,
    /// Unit normal, towards the first side of two particles and the body of a surface.
    pub normal: [f64; 3],
    /// Fraction of the load step since the sides have touched.
    pub share: f64,
    /// Growth of b over the last load step, N.
    pub growth: f64,
}

/// Derivative of the friction after a slip.
#[derive(Clone, Copy, Debug)]
pub struct TangentStiffness {
    /// True beyond the elastic slip.
    pub slips: bool,
    /// Unit vector of the elastic slip, or any across the normal if it is 0.
    pub direction: [f64; 3],
    /// Stiffness along it, and across it and the normal, N/m.
    pub along: f64,
    pub across: f64,
}

/// Friction after a slip.
#[derive(Clone, Copy, Debug)]
pub struct Drag {
    /// Force on the first side, N.
    pub force: [f64; 3],
    /// Elastic slip, m.
    pub slip: [f64; 3],
    /// Energy dissipated, J.
    pub dissipated: f64,
}

impl FrictionPair {
    /// Energy of the elastic slip, J.
    pub fn energy(&self) -> f64 {
        0.5 * self.stiffness * length(self.slip).powi(2)
    }

    /// Computes the friction after the first side has moved by `moved`, m, against the second.
    pub fn drag(&self, moved: [f64; 3]) -> Drag {
        let (trial, size, most) = self.trial_slip(moved);
        if size <= most {
            return Drag { force: trial.map(|x| -self.stiffness * x), slip: trial, dissipated: 0.0 };
        }
        let direction = trial.map(|x| x / size);
        Drag {
            force: direction.map(|x| -self.bound * x),
            slip: direction.map(|x| most * x),
            dissipated: self.bound * (size - most),
        }
    }

    /// e* after a motion, m, its length, and b/k_t.
    fn trial_slip(&self, moved: [f64; 3]) -> ([f64; 3], f64, f64) {
        let moved = across(&self.normal, moved);
        let trial = std::array::from_fn(|d| self.slip[d] + self.share * moved[d]);
        (trial, length(trial), self.bound / self.stiffness)
    }

    /// Computes the stiffness after the first side has moved by `moved`, m, against the second: k_t, beyond
    /// the elastic slip b/|e*| across it only.
    pub fn tangent_stiffness(&self, moved: [f64; 3]) -> TangentStiffness {
        let (trial, size, most) = self.trial_slip(moved);
        let slips = size > most;
        let [along, across_it] = if slips { [0.0, self.bound / size] } else { [self.stiffness; 2] };
        let direction = if size > 0.0 { trial.map(|x| x / size) } else { tangent(&self.normal) };
        TangentStiffness { slips, direction, along: self.share * along, across: self.share * across_it }
    }

    /// Extrapolates b over a load step of `ratio` times the length of the last one, to between half and twice
    /// its value.
    pub fn extrapolate(&mut self, ratio: f64) {
        self.bound = (self.bound + ratio * self.growth).clamp(0.5 * self.bound, 2.0 * self.bound);
    }

    /// Rotates the slip into the plane across a new normal, keeping its length, and shortens it to the bound.
    pub fn project(&mut self) {
        let old = length(self.slip);
        let turned = across(&self.normal, self.slip);
        let size = length(turned);
        let wanted = old.min(self.bound / self.stiffness);
        self.slip = if size > 0.0 { turned.map(|x| x * wanted / size) } else { [0.0; 3] };
    }
}

/// Returns the friction of a pair in a list that is sorted by pair.
pub fn known_in(sorted: &[FrictionPair], pair: ContactPair) -> Option<&FrictionPair> {
    sorted.binary_search_by_key(&pair, |grip| grip.pair).ok().map(|at| &sorted[at])
}

/// A unit vector across a unit normal, in the plane of the first two axes if the normal is.
fn tangent(normal: &[f64; 3]) -> [f64; 3] {
    let flat = normal[0].hypot(normal[1]);
    if flat > 0.5 {
        [-normal[1] / flat, normal[0] / flat, 0.0]
    } else {
        let size = normal[1].hypot(normal[2]);
        [0.0, -normal[2] / size, normal[1] / size]
    }
}

/// Projects a vector onto the plane across a unit normal.
pub fn across<const D: usize>(normal: &[f64; D], vector: [f64; D]) -> [f64; D] {
    let along: f64 = normal.iter().zip(vector).map(|(n, v)| n * v).sum();
    std::array::from_fn(|d| vector[d] - along * normal[d])
}
