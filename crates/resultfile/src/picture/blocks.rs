//! The outline of each particle: an upright block, or the deformed cell of a lattice.

use polycore::numerics::{Groups, bounds};
use rayon::prelude::*;

use crate::lattice::{self, NONE, joined, neighbours};

/// Area that a particle covers.
#[derive(Clone, Debug)]
pub(super) enum ParticleBlock {
    /// Distances to the left, right, lower and upper side.
    Upright([f64; 4]),
    /// Corners, in order around it.
    Cell([[f64; 2]; 4]),
}

/// The outline of every particle.
pub(super) struct ParticleBlocks(pub(super) Vec<ParticleBlock>);

impl ParticleBlocks {
    /// Deformed cells of those that `reference` shows to be on a lattice, upright blocks of the others;
    /// neighbours farther apart than `bridge` spacings have a crack between them.
    pub(super) fn new(
        positions: &[[f64; 2]],
        reference: Option<&[[f64; 2]]>,
        spacing: f64,
        bridge: f64,
    ) -> Self {
        let next = reference.map_or(vec![[NONE; 6]; positions.len()], |rest| neighbours(rest, spacing));
        let joined = joined(positions, &next, spacing, bridge);
        let cells = lattice::LatticeCells { positions, joined: &joined, spacing, axes: 2 };
        let all = next.iter().all(|next| *next != [NONE; 6]);
        let reach = if all { vec![[0.0; 4]; positions.len()] } else { reach(positions, spacing, bridge) };
        let block = |(particle, reach)| match next[particle] == [NONE; 6] {
            true => ParticleBlock::Upright(reach),
            false => ParticleBlock::Cell([0, 1, 3, 2].map(|corner| cells.corner(particle, corner))),
        };
        Self(reach.into_par_iter().enumerate().map(block).collect())
    }
}

/// Returns the distances from each particle to the sides of its block: half the way to its neighbour there,
/// or half a spacing where the next one is farther than `bridge` spacings (a surface, a hole, a crack).
fn reach(positions: &[[f64; 2]], spacing: f64, bridge: f64) -> Vec<[f64; 4]> {
    let far = spacing * bridge.max(1.0) * (1.0 + 1e-9);
    let cells = GridCells::new(positions, far);
    let nearest = |position: &[f64; 2]| {
        let mut gaps = [f64::INFINITY; 4];
        cells.around(position, |index| {
            let other = positions[index];
            let d = [other[0] - position[0], other[1] - position[1]];
            for axis in 0..2 {
                let (along, across) = (d[axis].abs(), d[1 - axis].abs());
                // a neighbour in this direction and not a diagonal one
                if across <= 0.6 * along && along > 1e-3 * spacing {
                    let side = 2 * axis + usize::from(d[axis] > 0.0);
                    gaps[side] = gaps[side].min(along);
                }
            }
        });
        gaps.map(|gap| if gap <= far { gap / 2.0 } else { spacing / 2.0 })
    };
    positions.iter().map(nearest).collect()
}

/// Particles sorted into square cells.
struct GridCells {
    low: [f64; 2],
    size: f64,
    count: [usize; 2],
    particles: Groups<usize>,
}

impl GridCells {
    fn new(positions: &[[f64; 2]], size: f64) -> Self {
        let [low, high] = bounds(positions.iter().copied());
        let extent = [0, 1].map(|axis| high[axis] - low[axis]);
        // scattered particles must not ask for more cells than there are particles
        let most = (4.0 * positions.len() as f64).sqrt() + 1.0;
        let size = size.max(extent[0] / most).max(extent[1] / most);
        let count = extent.map(|extent| (extent / size) as usize + 1);
        let mut cells = Self { low, size, count, particles: Groups::new(0, std::iter::empty()) };
        let homes = positions.iter().map(|position| cells.index(cells.home(position)));
        cells.particles = Groups::new(count[0] * count[1], homes.zip(0..));
        cells
    }

    fn home(&self, position: &[f64; 2]) -> [usize; 2] {
        [0, 1]
            .map(|axis| (((position[axis] - self.low[axis]) / self.size) as usize).min(self.count[axis] - 1))
    }

    fn index(&self, home: [usize; 2]) -> usize {
        home[1] * self.count[0] + home[0]
    }

    fn around(&self, position: &[f64; 2], mut each: impl FnMut(usize)) {
        let home = self.home(position);
        for row in home[1].saturating_sub(1)..=(home[1] + 1).min(self.count[1] - 1) {
            let first = self.index([home[0].saturating_sub(1), row]);
            let last = self.index([(home[0] + 1).min(self.count[0] - 1), row]);
            for &particle in self.particles.groups(first, last) {
                each(particle);
            }
        }
    }
}
