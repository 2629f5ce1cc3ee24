//! The surface of a body of particles: deformed cells of a lattice, or a cube for each particle of a cloud.

use std::collections::{HashMap, HashSet};

use super::skin::{Corner, Plane, Skin};

/// Particles in space.
#[derive(Clone, Copy, Debug)]
pub struct Particles<'a> {
    /// Positions before the deformation: those with neighbours one spacing away along the axes are drawn as deformed cells,
    /// the others as upright cubes.
    pub reference: &'a [[f64; 3]],
    /// Positions.
    pub positions: &'a [[f64; 3]],
    /// Distance of neighbours.
    pub spacing: f64,
    /// Neighbours up to this many spacings apart have no crack between them.
    pub bridge: f64,
}

/// Of two neighbours of a lattice there is a crack between those that have moved apart this many times farther than both
/// have from the next ones behind them.
const JUMP: f64 = 2.0;
/// How far from its place in the lattice, in spacings, a particle may be.
const OFF: f64 = 0.05;
const NONE: u32 = u32::MAX;
/// Neighbours at both ends of x, y and z.
const STEPS: [[i64; 3]; 6] = [[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]];

impl Particles<'_> {
    /// The surface: faces without a neighbour, or with a crack in front. A plane removes particles by their reference positions;
    /// `value` gives the values of a particle.
    pub fn skin(&self, cut: Option<Plane>, value: impl Fn(usize) -> [f64; 2]) -> Skin {
        // whole particles: nothing is cut in two
        let mut skin = Skin::new(None);
        let count = self.reference.len().min(self.positions.len());
        let gone = |k: usize| cut.is_some_and(|plane| plane.side(self.reference[k]) > 0.0);
        let next = self.neighbours(count);
        let lattice = Lattice { particles: self, next: &next };
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
                let beyond = lattice.joined(particle, side);
                if beyond.is_some_and(|other| !gone(other)) {
                    continue;
                }
                let (axis, [u, v]) = (side / 2, [(side / 2 + 1) % 3, (side / 2 + 2) % 3]);
                let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[a, b]| {
                    let mut sides = [0; 3];
                    (sides[axis], sides[u], sides[v]) = (side, 2 * u + a, 2 * v + b);
                    let at = if loose(particle) {
                        [0, 1, 2].map(|d| at[d] + self.spacing * (sides[d] % 2) as f64 - 0.5 * self.spacing)
                    } else {
                        lattice.corner(particle, sides)
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

    /// Of the given reference neighbours, those without a crack in between; the others become `u32::MAX`.
    pub(crate) fn joins(&self, next: &[[u32; 6]]) -> Vec<[u32; 6]> {
        let lattice = Lattice { particles: self, next };
        let of =
            |side: usize, particle: usize| lattice.joined(particle, side).map_or(NONE, |other| other as u32);
        (0..next.len()).map(|particle| [0, 1, 2, 3, 4, 5].map(|side| of(side, particle))).collect()
    }

    /// Reference neighbours at both ends of x, y and z, `u32::MAX` where there is none.
    pub(crate) fn neighbours(&self, count: usize) -> Vec<[u32; 6]> {
        let Some(origin) = self.reference.first() else { return Vec::new() };
        let place = |x: &[f64; 3]| -> Option<[i64; 3]> {
            let steps = [0, 1, 2].map(|d| (x[d] - origin[d]) / self.spacing);
            let near = steps.iter().all(|x| (x - x.round()).abs() < OFF);
            near.then(|| steps.map(|x| x.round() as i64))
        };
        let mut index: HashMap<[i64; 3], u32> = HashMap::with_capacity(count);
        for (k, x) in self.reference[..count].iter().enumerate() {
            if let Some(place) = place(x) {
                index.entry(place).or_insert(k as u32);
            }
        }
        let of = |(k, x): (usize, &[f64; 3])| {
            let place = place(x).filter(|place| index.get(place) == Some(&(k as u32)));
            place.map_or([NONE; 6], |place| {
                STEPS.map(|step| {
                    let there = [0, 1, 2].map(|d| place[d].saturating_add(step[d]));
                    index.get(&there).copied().unwrap_or(NONE)
                })
            })
        };
        self.reference[..count].iter().enumerate().map(of).collect()
    }
}

struct Lattice<'a> {
    particles: &'a Particles<'a>,
    next: &'a [[u32; 6]],
}

impl Lattice<'_> {
    fn beside(&self, particle: usize, side: usize) -> Option<usize> {
        let other = self.next[particle][side];
        (other != NONE).then_some(other as usize)
    }

    fn between(&self, from: usize, to: usize) -> [f64; 3] {
        [0, 1, 2].map(|d| self.particles.positions[to][d] - self.particles.positions[from][d])
    }

    /// The neighbour at a side, unless a crack is between.
    fn joined(&self, particle: usize, side: usize) -> Option<usize> {
        let other = self.beside(particle, side)?;
        let Particles { spacing, bridge, .. } = *self.particles;
        let farthest = spacing * bridge.max(1.0) * (1.0 + 1e-9);
        let gap = |a: usize, b: usize| self.between(a, b).iter().map(|x| x * x).sum::<f64>().sqrt();
        let behind = |particle: usize, side: usize| {
            self.beside(particle, side).map(|next| gap(particle, next)).filter(|&gap| gap <= farthest)
        };
        let most = match (behind(particle, side ^ 1), behind(other, side)) {
            (None, None) => farthest,
            (a, b) => (JUMP * a.unwrap_or(0.0).max(b.unwrap_or(0.0)).max(spacing)).min(farthest),
        };
        (gap(particle, other) <= most).then_some(other)
    }

    /// From a particle to the middle of its cell's side.
    fn half(&self, particle: usize, side: usize) -> [f64; 3] {
        if let Some(other) = self.joined(particle, side) {
            return self.between(particle, other).map(|x| 0.5 * x);
        }
        if let Some(other) = self.joined(particle, side ^ 1) {
            return self.between(particle, other).map(|x| -0.5 * x);
        }
        STEPS[side].map(|step| 0.5 * self.particles.spacing * step as f64)
    }

    /// The corner of three sides of a cell: the mean over the connected cells around it, so that they share the corner.
    fn corner(&self, particle: usize, sides: [usize; 3]) -> [f64; 3] {
        // bit d of a place: other side of the corner along axis d
        let mut around = [None; 8];
        around[0] = Some(particle);
        let mut open = vec![(0, particle)];
        let toward = |place: usize, d: usize| sides[d] ^ (place >> d & 1);
        while let Some((place, here)) = open.pop() {
            for d in 0..3 {
                let there = place ^ (1 << d);
                if around[there].is_none()
                    && let Some(other) = self.joined(here, toward(place, d))
                {
                    around[there] = Some(other);
                    open.push((there, other));
                }
            }
        }
        let mut members: Vec<(usize, usize)> =
            around.iter().enumerate().filter_map(|(place, member)| Some(((*member)?, place))).collect();
        // one order for all cells of the corner: the same bits
        members.sort_unstable();
        let mut sum = [0.0; 3];
        for &(member, place) in &members {
            let halves = [0, 1, 2].map(|d| self.half(member, toward(place, d)));
            for d in 0..3 {
                sum[d] +=
                    self.particles.positions[member][d] + halves.iter().map(|half| half[d]).sum::<f64>();
            }
        }
        sum.map(|x| x / members.len() as f64)
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

    /// Torn in two: two faces more for each pair that parted, the halves as they were; a cut takes whole particles away.
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
