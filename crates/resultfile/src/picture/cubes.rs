//! The surface of a body of particles: deformed cells of a lattice, or a cube for each particle of a cloud.

use std::collections::HashSet;

use super::skin::{Corner, Plane, Skin};
use crate::lattice::{LatticeCells, NONE, joined, neighbours};

/// Particles in space.
#[derive(Clone, Copy, Debug)]
pub struct Particles<'a> {
    /// Positions before the deformation: those with neighbours one spacing away along the axes are drawn as
    /// deformed cells, the others as upright cubes.
    pub reference: &'a [[f64; 3]],
    /// Positions.
    pub positions: &'a [[f64; 3]],
    /// Distance of neighbours.
    pub spacing: f64,
    /// Neighbours up to this many spacings apart have no crack between them.
    pub bridge: f64,
}

/// Neighbours at both ends of x, y and z.
const STEPS: [[i64; 3]; 6] = [[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]];

impl Particles<'_> {
    /// Returns the surface: faces without a neighbour, or with a crack in front. A plane removes particles by
    /// their reference positions; `value` gives the values of a particle.
    pub fn skin(&self, cut: Option<Plane>, value: impl Fn(usize) -> [f64; 2]) -> Skin {
        // whole particles: nothing is cut in two
        let mut skin = Skin::new(None);
        let count = self.reference.len().min(self.positions.len());
        let gone = |k: usize| cut.is_some_and(|plane| plane.side(self.reference[k]) > 0.0);
        let next = neighbours(&self.reference[..count], self.spacing);
        let positions = &self.positions[..count];
        let joined = joined(positions, &next, self.spacing, self.bridge);
        let cells = LatticeCells { positions, joined: &joined, spacing: self.spacing, axes: 3 };
        let loose = |k: usize| next[k] == [NONE; 6];
        let taken: HashSet<[i64; 3]> =
            (0..count).filter(|&k| loose(k) && !gone(k)).map(|k| self.cell(self.positions[k])).collect();
        for particle in (0..count).filter(|&k| !gone(k)) {
            let values = value(particle);
            let at = self.positions[particle];
            // surrounded particles are invisible
            let cell = self.cell(at);
            let hidden =
                |step: &[i64; 3]| taken.contains(&[0, 1, 2].map(|d| cell[d].saturating_add(step[d])));
            if loose(particle) && STEPS.iter().all(hidden) {
                continue;
            }
            for side in 0..6 {
                let beyond = joined[particle][side];
                if beyond != NONE && !gone(beyond as usize) {
                    continue;
                }
                let (axis, [u, v]) = (side / 2, [(side / 2 + 1) % 3, (side / 2 + 2) % 3]);
                let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[a, b]| {
                    let corner = (side % 2) << axis | a << u | b << v;
                    let at = if loose(particle) {
                        [0, 1, 2]
                            .map(|d| at[d] + self.spacing * (corner >> d & 1) as f64 - 0.5 * self.spacing)
                    } else {
                        cells.corner(particle, corner as u8)
                    };
                    Corner { at, values }
                });
                skin.face(&corners);
            }
        }
        skin
    }

    /// The cell of a cubic grid.
    fn cell(&self, x: [f64; 3]) -> [i64; 3] {
        x.map(|x| (x / self.spacing).floor() as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::super::skin::{dot, minus};
    use super::*;

    fn lattice(counts: [usize; 3]) -> Vec<[f64; 3]> {
        let [a, b, c] = counts;
        (0..a * b * c).map(|k| [k % a, k / a % b, k / a / b].map(|x| 0.1 + 0.5 * x as f64)).collect()
    }

    fn skin(reference: &[[f64; 3]], positions: &[[f64; 3]], bridge: f64, cut: Option<Plane>) -> Skin {
        let particles = Particles { reference, positions, spacing: 0.5, bridge };
        particles.skin(cut, |k| [k as f64, 0.0])
    }

    /// An affine deformation takes the block of cells to its image: every corner, and no face within.
    #[test]
    fn blocks_deform_as_one() {
        let rest = lattice([4, 3, 2]);
        let map = |x: [f64; 3]| [1.4 * x[0] + 0.3 * x[1], 0.8 * x[1] - 0.2 * x[2], x[2] + 0.1 * x[0]];
        let places: Vec<[f64; 3]> = rest.iter().map(|x| map(*x)).collect();
        let skin = skin(&rest, &places, 3.0, None);
        assert_eq!(skin.faces.len(), 2 * (4 * 3 + 3 * 2 + 4 * 2));
        // corners of cells lie half a spacing off particles
        let corners: Vec<[f64; 3]> =
            lattice([5, 4, 3]).iter().map(|x| map([0, 1, 2].map(|d| x[d] - 0.25))).collect();
        for at in skin.faces.iter().flat_map(|face| face.at) {
            let off = |corner: &[f64; 3]| dot(minus(*corner, at), minus(*corner, at)).sqrt();
            assert!(corners.iter().map(off).fold(f64::INFINITY, f64::min) < 1e-12, "{at:?}");
        }
        // the same corner has the same bits, from whichever cell it is seen
        let mut all: Vec<_> =
            skin.faces.iter().flat_map(|face| face.at).map(|at| at.map(f64::to_bits)).collect();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), 5 * 4 * 3 - 3 * 2);
    }

    /// Torn in two: two faces more for each pair that parted, the halves as they were; a cut takes whole
    /// particles away.
    #[test]
    fn cracks_open_and_cuts_show_values() {
        let rest = lattice([4, 3, 2]);
        let torn: Vec<[f64; 3]> =
            rest.iter().map(|x| [if x[0] > 1.0 { x[0] + 2.0 } else { x[0] }, x[1], x[2]]).collect();
        let halves = skin(&rest, &torn, 1.5, None);
        assert_eq!(halves.faces.len(), 2 * (4 * 3 + 3 * 2 + 4 * 2) + 2 * 3 * 2);
        let ends = halves.faces.iter().flat_map(|face| face.at).map(|at| at[0]);
        let inner = ends
            .filter(|x| (0.7..3.0).contains(x))
            .fold([f64::MAX, f64::MIN], |[l, h], x| [l.min(x), h.max(x)]);
        assert!((inner[0] - 0.85).abs() < 1e-12 && (inner[1] - 2.85).abs() < 1e-12, "{inner:?}");
        // without what lay at y > 0.4 of the body at rest: the middle row is gone, and the last
        let cut = Plane { normal: [0.0, 1.0, 0.0], at: 0.4 };
        let left = skin(&rest, &rest, 1.5, Some(cut));
        assert_eq!(left.faces.len(), 2 * (4 + 2 + 4 * 2));
        assert!(left.values(0).all(|value| (value as usize / 4).is_multiple_of(3)));
    }

    /// Particles on no lattice are cubes; of those that are surrounded nothing is seen.
    #[test]
    fn clouds_are_cubes() {
        let cloud: Vec<[f64; 3]> = lattice([5, 5, 5])
            .iter()
            .enumerate()
            .map(|(k, x)| x.map(|x| x + 0.1 * ((k * k) as f64 + x).sin()))
            .collect();
        let cubes = skin(&cloud, &cloud, 1.5, None);
        assert!(cubes.faces.len().is_multiple_of(6) && cubes.faces.len() < 6 * 125);
        for face in &cubes.faces {
            let side = minus(face.at[1], face.at[0]);
            assert!((dot(side, side).sqrt() - 0.5).abs() < 1e-12);
        }
        assert_eq!(skin(&[], &[], 1.5, None).faces.len(), 0);
        assert_eq!(skin(&[[0.0; 3]], &[[f64::NAN; 3]], 1.5, None).faces.len(), 0);
        assert_eq!(skin(&[[0.0; 3], [f64::INFINITY; 3]], &[[0.0; 3], [1e300; 3]], 1.5, None).faces.len(), 12);
    }
}
