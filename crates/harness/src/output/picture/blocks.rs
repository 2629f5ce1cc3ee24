//! The outline of each particle: an upright block, or the deformed cell of a lattice.

use rayon::prelude::*;

/// What a particle covers.
#[derive(Clone, Debug)]
pub(super) enum Block {
    /// How far it reaches to the left, right, down and up.
    Upright([f64; 4]),
    /// Its corners, in order around it.
    Cell([[f64; 2]; 4]),
}

/// The outline of every particle.
pub(super) struct Blocks(pub(super) Vec<Block>);

/// Of two neighbours of a lattice there is a crack between those that have moved apart this many times farther than both
/// have from the next ones behind them.
const JUMP: f64 = 2.0;
/// How far from its place in the lattice, in spacings, a neighbour may be.
const OFF: f64 = 0.05;

impl Blocks {
    /// Deformed cells of those that `reference` shows to be on a lattice, upright blocks of the others; neighbours
    /// farther apart than `bridge` spacings have a crack between them.
    pub(super) fn new(
        positions: &[[f64; 2]],
        reference: Option<&[[f64; 2]]>,
        spacing: f64,
        bridge: f64,
    ) -> Self {
        let lattice = reference.map(|reference| Neighbours::new(positions, reference, spacing, bridge));
        let on_it = |particle: usize| lattice.as_ref().filter(|lattice| lattice.is_on_it(particle));
        let all = (0..positions.len()).all(|particle| on_it(particle).is_some());
        let reach = if all { vec![[0.0; 4]; positions.len()] } else { reach(positions, spacing, bridge) };
        let block = |(particle, reach)| match on_it(particle) {
            Some(lattice) => Block::Cell(lattice.cell(particle)),
            None => Block::Upright(reach),
        };
        Self(reach.into_par_iter().enumerate().map(block).collect())
    }
}

/// Who was whose neighbour on a square lattice.
struct Neighbours<'a> {
    positions: &'a [[f64; 2]],
    spacing: f64,
    farthest: f64,
    /// To the left, right, down and up.
    next: Vec<[Option<u32>; 4]>,
    /// Those of them without a crack between.
    joined: Vec<[Option<u32>; 4]>,
}

impl<'a> Neighbours<'a> {
    fn new(positions: &'a [[f64; 2]], reference: &[[f64; 2]], spacing: f64, bridge: f64) -> Self {
        let cells = Cells::new(reference, 1.5 * spacing);
        let next = |here: &[f64; 2]| {
            let mut next = [None; 4];
            cells.around(here, |other| {
                let there = reference[other];
                for (side, step) in [[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]].iter().enumerate() {
                    let off = |d: usize| (there[d] - here[d] - step[d] * spacing).abs() < OFF * spacing;
                    if off(0) && off(1) {
                        next[side] = Some(other as u32);
                    }
                }
            });
            next
        };
        let farthest = spacing * bridge.max(1.0) * (1.0 + 1e-9);
        let next = reference.par_iter().map(next).collect();
        let mut all = Self { positions, spacing, farthest, next, joined: Vec::new() };
        let joined = |particle| [0, 1, 2, 3].map(|side| all.unbroken(particle, side));
        all.joined = (0..positions.len()).into_par_iter().map(joined).collect();
        all
    }

    fn is_on_it(&self, particle: usize) -> bool {
        self.next[particle].iter().any(Option::is_some)
    }

    fn between(&self, from: usize, to: usize) -> [f64; 2] {
        [0, 1].map(|d| self.positions[to][d] - self.positions[from][d])
    }

    /// The neighbour at a side, unless a crack is between.
    fn joined(&self, particle: usize, side: usize) -> Option<usize> {
        self.joined[particle][side].map(|other| other as usize)
    }

    fn unbroken(&self, particle: usize, side: usize) -> Option<u32> {
        let other = self.next[particle][side]? as usize;
        let gap = |a: usize, b: usize| {
            let [x, y] = self.between(a, b);
            x.hypot(y)
        };
        let behind = |particle: usize, side: usize| {
            self.next[particle][side]
                .map(|next| gap(particle, next as usize))
                .filter(|&gap| gap <= self.farthest)
        };
        let most = match (behind(particle, side ^ 1), behind(other, side)) {
            (None, None) => self.farthest,
            (a, b) => (JUMP * a.unwrap_or(0.0).max(b.unwrap_or(0.0)).max(self.spacing)).min(self.farthest),
        };
        (gap(particle, other) <= most).then_some(other as u32)
    }

    /// From a particle to the middle of its cell's side.
    fn half(&self, particle: usize, side: usize) -> [f64; 2] {
        if let Some(other) = self.joined(particle, side) {
            return self.between(particle, other).map(|x| 0.5 * x);
        }
        if let Some(other) = self.joined(particle, side ^ 1) {
            return self.between(particle, other).map(|x| -0.5 * x);
        }
        let step = if side.is_multiple_of(2) { -0.5 } else { 0.5 } * self.spacing;
        if side < 2 { [step, 0.0] } else { [0.0, step] }
    }

    /// Corners that four joined cells share are the same point.
    fn cell(&self, particle: usize) -> [[f64; 2]; 4] {
        [[0, 2], [1, 2], [1, 3], [0, 3]].map(|[across, up]| {
            let here = self.positions[particle];
            let (beside, above) = (self.joined(particle, across), self.joined(particle, up));
            if let (Some(beside), Some(above)) = (beside, above)
                && let Some(corner) = self.joined(beside, up)
                && self.joined(above, across) == Some(corner)
            {
                let all = [particle, beside, above, corner].map(|p| self.positions[p]);
                return [0, 1].map(|d| 0.25 * all.iter().map(|p| p[d]).sum::<f64>());
            }
            let (x, y) = (self.half(particle, across), self.half(particle, up));
            // along a surface two cells share a corner
            let (x, y) = match (beside, above) {
                (Some(beside), None) => (x, mean(y, self.half(beside, up))),
                (None, Some(above)) => (mean(x, self.half(above, across)), y),
                _ => (x, y),
            };
            [0, 1].map(|d| here[d] + x[d] + y[d])
        })
    }
}

fn mean(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|d| 0.5 * (a[d] + b[d]))
}

/// How far each particle's block reaches to the left, right, down and up: half the way to its neighbour there, or half
/// a spacing where the next one is farther than `bridge` spacings (a surface, a hole, a crack).
fn reach(positions: &[[f64; 2]], spacing: f64, bridge: f64) -> Vec<[f64; 4]> {
    let far = spacing * bridge.max(1.0) * (1.0 + 1e-9);
    let cells = Cells::new(positions, far);
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
struct Cells {
    low: [f64; 2],
    size: f64,
    count: [usize; 2],
    starts: Vec<usize>,
    order: Vec<usize>,
}

impl Cells {
    fn new(positions: &[[f64; 2]], size: f64) -> Self {
        let fold = |axis: usize, start: f64, pick: fn(f64, f64) -> f64| {
            positions.iter().fold(start, |bound, position| pick(bound, position[axis]))
        };
        let low = [0, 1].map(|axis| fold(axis, f64::INFINITY, f64::min));
        let extent = [0, 1].map(|axis| fold(axis, f64::NEG_INFINITY, f64::max) - low[axis]);
        // scattered particles must not ask for more cells than there are particles
        let most = (4.0 * positions.len() as f64).sqrt() + 1.0;
        let size = size.max(extent[0] / most).max(extent[1] / most);
        let count = extent.map(|extent| (extent / size) as usize + 1);
        let mut cells = Self { low, size, count, starts: vec![0; count[0] * count[1] + 1], order: vec![] };
        let homes: Vec<usize> = positions.iter().map(|position| cells.index(cells.home(position))).collect();
        for &home in &homes {
            cells.starts[home + 1] += 1;
        }
        for cell in 1..cells.starts.len() {
            cells.starts[cell] += cells.starts[cell - 1];
        }
        let mut next = cells.starts.clone();
        cells.order = vec![0; positions.len()];
        for (particle, &home) in homes.iter().enumerate() {
            cells.order[next[home]] = particle;
            next[home] += 1;
        }
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
            for &particle in &self.order[self.starts[first]..self.starts[last + 1]] {
                each(particle);
            }
        }
    }
}
