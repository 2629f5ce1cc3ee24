//! Transfer between particles and the functions of an element.

use super::space::CORNERS;
use pulp::NullaryFnOnce;

/// Pᵀg of an element: Σ φ_a g over its members, component by component.
pub struct Restrict<'a, const D: usize> {
    /// Members of the element, as numbered in `gradient`.
    pub members: &'a [u32],
    /// Coordinates of the members in the cell, 0 to 1.
    pub local: [&'a [f64]; D],
    /// g.
    pub gradient: [&'a [f64]; D],
    /// Sums: for each component, one per corner.
    pub part: &'a mut [f64],
}

impl<const D: usize> NullaryFnOnce for Restrict<'_, D> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        let mut sums = [[0.0; CORNERS]; D];
        for (m, &member) in self.members.iter().enumerate() {
            // all corners at once
            let mut hats = [1.0; CORNERS];
            for d in 0..D {
                let x = self.local[d][m];
                for corner in 0..CORNERS {
                    hats[corner] *= if corner >> d & 1 == 1 { x } else { 1.0 - x };
                }
            }
            for d in 0..D {
                let g = self.gradient[d][member as usize];
                for corner in 0..CORNERS {
                    sums[d][corner] += hats[corner] * g;
                }
            }
        }
        for d in 0..D {
            for corner in 0..CORNERS {
                self.part[d * CORNERS + corner] = sums[d][corner];
            }
        }
    }
}

/// P c of an element's members.
pub struct Prolong<'a, const D: usize> {
    /// Coordinates of the members in the cell, 0 to 1.
    pub local: [&'a [f64]; D],
    /// c of each component, at the corners.
    pub corners: [[f64; CORNERS]; D],
    /// Values at the members.
    pub out: [&'a mut [f64]; D],
}

impl<const D: usize> NullaryFnOnce for Prolong<'_, D> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        for c in 0..D {
            let out = &mut *self.out[c];
            let corners = &self.corners[c];
            for m in 0..out.len() {
                // linear along one axis after the other
                let mut value = *corners;
                for d in (0..D).rev() {
                    let x = self.local[d][m];
                    for a in 0..1 << d {
                        value[a] += x * (value[a + (1 << d)] - value[a]);
                    }
                }
                out[m] = value[0];
            }
        }
    }
}
