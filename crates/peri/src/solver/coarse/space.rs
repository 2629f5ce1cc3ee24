//! A few smooth displacement fields for a whole body: multilinear hats on a background grid, divided where
//! the body is.
//!
//! The hat of a node is divided into one function for each part of the body connected by intact bonds within
//! the hat's support, so that no function moves both flanks of a crack, or a fragment together with the body
//! it has left.

use crate::bonds::BodyGeometry;
use crate::field::Field;
use polycore::numerics::{DisjointSets, Groups, bounds};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Corners of a cell in three dimensions.
pub const CORNERS: usize = 8;
/// Stride between sites of a window whose bonds are followed one after the other.
const STRIDE: usize = 32;
/// Marks a site without element.
pub const NONE: u32 = u32::MAX;

/// Particles of one cell that share all functions.
#[derive(Clone, Debug)]
pub struct CoarseElement {
    /// Function of each corner of the cell.
    pub functions: [u32; CORNERS],
    /// Start and end of its particles in [`CoarseSpace::members`].
    pub members: [usize; 2],
}

/// The functions, and the particles they move: by their sites, and by their numbers after
/// [`CoarseSpace::renumber`].
pub struct CoarseSpace<const D: usize> {
    /// Edges of a cell, m.
    pub edge: [f64; D],
    /// Number of functions, in an order of elimination with little fill (nested dissection of the grid).
    pub functions: usize,
    /// The elements.
    pub elements: Vec<CoarseElement>,
    /// Sites, element by element.
    pub members: Vec<u32>,
    /// Element of each site; particles without bonds have none.
    pub element_of: Vec<u32>,
    /// Coordinates of each site in its cell, 0 to 1.
    pub local: Field<D>,
}

/// The cells over a body's bounding box.
struct BackgroundGrid<const D: usize> {
    low: [f64; D],
    edge: [f64; D],
    cells: [usize; D],
    /// True along axes with periodic sides: the last node is the first.
    periodic: [bool; D],
}

impl<const D: usize> BackgroundGrid<D> {
    /// Divides the bounding box into a whole number of cells of about `edge`.
    fn new(bonds: &dyn BodyGeometry<D>, edge: f64) -> Self {
        let [mut low, mut high] = bounds(bonds.particles().iter().map(|&site| bonds.position(site as usize)));
        let (period, half) = (bonds.period(), 0.5 * bonds.spacing());
        let periodic = period.map(|period| period > 0.0);
        for d in (0..D).filter(|&d| periodic[d]) {
            (low[d], high[d]) = (low[d] - half, low[d] - half + period[d]);
        }
        // two cells of a period, as both nodes of one would be the same
        let least = periodic.map(|periodic| if periodic { 2.0 } else { 1.0 });
        let cells: [usize; D] =
            std::array::from_fn(|d| ((high[d] - low[d]) / edge).ceil().max(least[d]) as usize);
        // a box without extent along an axis still has a cell there
        let edge = std::array::from_fn(|d| {
            let fitted = (high[d] - low[d]) / cells[d] as f64;
            if fitted > 0.0 { fitted } else { edge }
        });
        Self { low, edge, cells, periodic }
    }

    /// Returns the cell of a position and the coordinates in it.
    fn locate(&self, position: [f64; D]) -> (usize, [f64; D]) {
        let mut index = 0;
        let mut local = [0.0; D];
        for d in (0..D).rev() {
            let place = (position[d] - self.low[d]) / self.edge[d];
            let cell = (place.max(0.0) as usize).min(self.cells[d] - 1);
            index = index * self.cells[d] + cell;
            local[d] = (place - cell as f64).clamp(0.0, 1.0);
        }
        (index, local)
    }

    fn node_counts(&self) -> [usize; D] {
        std::array::from_fn(|d| self.cells[d] + usize::from(!self.periodic[d]))
    }

    /// Node at corner `corner` of a cell.
    fn node(&self, cell: usize, corner: usize) -> usize {
        let (mut rest, mut index, mut stride) = (cell, 0, 1);
        let counts = self.node_counts();
        for d in 0..D {
            index += stride * ((rest % self.cells[d] + (corner >> d & 1)) % counts[d]);
            rest /= self.cells[d];
            stride *= counts[d];
        }
        index
    }

    /// The cells around a node.
    fn cells_around(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        let counts = self.node_counts();
        let mut rest = node;
        let place: [usize; D] = std::array::from_fn(|d| {
            let here = rest % counts[d];
            rest /= counts[d];
            here
        });
        (0..1_usize << D).filter_map(move |corner| {
            let mut index = 0;
            for d in (0..D).rev() {
                let place = if self.periodic[d] && place[d] == 0 { self.cells[d] } else { place[d] };
                let cell = place.checked_sub(corner >> d & 1).map(|cell| match self.periodic[d] {
                    true => cell % self.cells[d],
                    false => cell,
                });
                let cell = cell.filter(|&cell| cell < self.cells[d])?;
                index = index * self.cells[d] + cell;
            }
            Some(index)
        })
    }
}

/// The bonded particles of each cell.
struct OccupiedCells<const D: usize> {
    /// Sites, ascending in each cell.
    members: Groups<u32>,
    /// True if every particle of a cell has all its bonds.
    is_whole: Vec<bool>,
    /// Coordinates of each site in its cell, 0 to 1.
    local: Field<D>,
}

impl<const D: usize> OccupiedCells<D> {
    fn new(grid: &BackgroundGrid<D>, bonds: &dyn BodyGeometry<D>, bonded: &[u32], whole: u32) -> Self {
        let mut local = Field::zeros(bonds.sites());
        let cells: usize = grid.cells.iter().product();
        let mut members = Vec::with_capacity(bonds.particles().len());
        let mut is_whole = vec![true; cells];
        for &site in bonds.particles().iter().filter(|&&site| bonded[site as usize] > 0) {
            let (cell, at) = grid.locate(bonds.position(site as usize));
            local.set(site as usize, at);
            members.push((cell, site));
            is_whole[cell] &= bonded[site as usize] >= whole;
        }
        Self { members: Groups::new(cells, members.iter().copied()), is_whole, local }
    }

    /// Returns true if a particle lies beside a node.
    fn is_beside(&self, grid: &BackgroundGrid<D>, node: usize) -> bool {
        grid.cells_around(node).any(|cell| !self.members.group(cell).is_empty())
    }

    /// Number of nodes beside a particle, a lower bound of the number of functions.
    fn nodes(&self, grid: &BackgroundGrid<D>) -> usize {
        let nodes: usize = grid.node_counts().iter().product();
        (0..nodes).filter(|&node| self.is_beside(grid, node)).count()
    }
}

/// Parts of a hat's support: the part of each site in it, sites ascending.
struct SupportParts {
    parts: u32,
    part_of: Vec<(u32, u32)>,
}

impl<const D: usize> CoarseSpace<D> {
    /// Builds functions on cells of about `edge`, or larger ones if there would be more than `most`
    /// functions; `None` if even that does not help. `bonded` has the number of bonds of each site, `whole`
    /// the number of bonds of a complete family.
    pub fn new(
        bonds: &dyn BodyGeometry<D>,
        bonded: &[u32],
        whole: u32,
        edge: f64,
        most: usize,
    ) -> Option<Self> {
        let mut edge = edge;
        for _ in 0..24 {
            let grid = BackgroundGrid::new(bonds, edge);
            let nodes: f64 = grid.node_counts().iter().map(|&n| n as f64).product();
            // bodies that fill little of their box may have more nodes than functions, but not without limit
            let mut excess = nodes / (64.0 * most as f64);
            if excess <= 1.0 {
                let filled = OccupiedCells::new(&grid, bonds, bonded, whole);
                let mut functions = filled.nodes(&grid);
                if (1..=most).contains(&functions) {
                    let space = Self::on_grid(&grid, filled, bonds);
                    functions = space.functions;
                    if functions <= most {
                        return Some(space);
                    }
                }
                if functions == 0 || (0..D).all(|d| grid.cells[d] <= 1 + usize::from(grid.periodic[d])) {
                    return None;
                }
                excess = functions as f64 / most as f64;
            }
            edge *= excess.powf(1.0 / D as f64).max(1.05);
        }
        None
    }

    fn on_grid(grid: &BackgroundGrid<D>, filled: OccupiedCells<D>, bonds: &dyn BodyGeometry<D>) -> Self {
        let (sites, cells) = (bonds.sites(), filled.is_whole.len());
        // connected parts around each node
        let nodes: usize = grid.node_counts().iter().product();
        let suspects: Vec<usize> =
            (0..nodes).filter(|&node| !grid.cells_around(node).all(|cell| filled.is_whole[cell])).collect();
        // few batches: each needs a table of all sites
        let batch = suspects.len().div_ceil(4 * rayon::current_num_threads()).max(1);
        let found: Vec<Vec<(usize, SupportParts)>> = suspects
            .par_chunks(batch)
            .map(|batch| {
                let mut place = vec![NONE; sites];
                let window = |node: usize| -> Vec<u32> {
                    grid.cells_around(node)
                        .flat_map(|cell| filled.members.group(cell).iter().copied())
                        .collect()
                };
                let split = |&node: &usize| Some((node, split(bonds, window(node), &mut place)?));
                batch.iter().filter_map(split).collect()
            })
            .collect();
        let splits: BTreeMap<usize, SupportParts> = found.into_iter().flatten().collect();
        let mut first = vec![0_u32; nodes];
        let mut functions = 0_u32;
        for node in elimination_order(grid.node_counts()) {
            if filled.is_beside(grid, node) {
                first[node] = functions;
                functions += splits.get(&node).map_or(1, |split| split.parts);
            }
        }
        let mut space = Self {
            edge: grid.edge,
            functions: functions as usize,
            elements: Vec::new(),
            members: Vec::with_capacity(filled.members.items().len()),
            element_of: vec![NONE; sites],
            local: Field::zeros(0),
        };
        for cell in (0..cells).filter(|&cell| !filled.members.group(cell).is_empty()) {
            space.add_cell(grid, cell, filled.members.group(cell), &splits, &first);
        }
        space.local = filled.local;
        space
    }

    /// Renames particles from sites to numbers, and orders coordinates as [`Self::members`]; returns the
    /// index of each particle there.
    pub fn renumber(&mut self, particles: &[u32]) -> Vec<u32> {
        let mut number = vec![NONE; self.element_of.len()];
        particles.iter().enumerate().for_each(|(index, &site)| number[site as usize] = index as u32);
        let mut local = Field::zeros(self.members.len());
        let mut places = vec![NONE; particles.len()];
        for (place, member) in self.members.iter_mut().enumerate() {
            local.set(place, self.local.get(*member as usize));
            *member = number[*member as usize];
            places[*member as usize] = place as u32;
        }
        (self.local, self.element_of) = (local, Vec::new());
        places
    }

    /// Adds the elements of a cell: one, or one for each set of parts that its particles belong to.
    fn add_cell(
        &mut self,
        grid: &BackgroundGrid<D>,
        cell: usize,
        sites: &[u32],
        splits: &BTreeMap<usize, SupportParts>,
        first: &[u32],
    ) {
        let mut groups: BTreeMap<[u32; CORNERS], Vec<u32>> = BTreeMap::new();
        let mut plain = [0; CORNERS];
        let mut cut = Vec::new();
        for corner in 0..1 << D {
            let node = grid.node(cell, corner);
            plain[corner] = first[node];
            if let Some(split) = splits.get(&node) {
                cut.push((corner, split));
            }
        }
        if cut.is_empty() {
            groups.insert(plain, sites.to_vec());
        } else {
            for &site in sites {
                let mut functions = plain;
                for (corner, split) in &cut {
                    if let Ok(at) = split.part_of.binary_search_by_key(&site, |pair| pair.0) {
                        functions[*corner] += split.part_of[at].1;
                    }
                }
                groups.entry(functions).or_default().push(site);
            }
        }
        for (functions, sites) in groups {
            let start = self.members.len();
            sites.iter().for_each(|&site| self.element_of[site as usize] = self.elements.len() as u32);
            self.members.extend(sites);
            self.elements.push(CoarseElement { functions, members: [start, self.members.len()] });
        }
    }
}

/// Finds the parts of a window connected by bonds within it, numbered by their first site; `None` for one
/// part. `place` holds [`NONE`] for every site, before and after.
fn split<const D: usize>(
    bonds: &dyn BodyGeometry<D>,
    mut window: Vec<u32>,
    place: &mut [u32],
) -> Option<SupportParts> {
    window.sort_unstable();
    for (index, &site) in window.iter().enumerate() {
        place[site as usize] = index as u32;
    }
    let mut joined = DisjointSets::new(window.len());
    let mut parts = window.len();
    // distant sites first: few families then connect a window
    let far = |start: usize| (start..window.len()).step_by(STRIDE);
    for index in (0..STRIDE).flat_map(far) {
        if parts == 1 {
            break;
        }
        bonds.neighbours(window[index] as usize, &mut |bond| {
            let other = place[bonds.origin(bond.site)];
            if other != NONE && joined.join(index as u32, other) {
                parts -= 1;
            }
        });
    }
    window.iter().for_each(|&site| place[site as usize] = NONE);
    if parts <= 1 {
        return None;
    }
    let mut number = vec![NONE; window.len()];
    let mut count = 0;
    let mut part_of = Vec::with_capacity(window.len());
    for index in 0..window.len() {
        let root = joined.root(index as u32) as usize;
        if number[root] == NONE {
            number[root] = count;
            count += 1;
        }
        part_of.push((window[index], number[root]));
    }
    Some(SupportParts { parts: count, part_of })
}

/// Orders the nodes of a grid by nested dissection: both halves first, the plane between them last.
fn elimination_order<const D: usize>(counts: [usize; D]) -> Vec<usize> {
    let mut order = Vec::with_capacity(counts.iter().product());
    dissect([0; D], counts, counts, &mut order);
    order
}

fn dissect<const D: usize>(low: [usize; D], high: [usize; D], counts: [usize; D], order: &mut Vec<usize>) {
    let longest = (0..D).max_by_key(|&d| high[d] - low[d]).unwrap_or(0);
    if (0..D).any(|d| low[d] >= high[d]) {
        return;
    }
    // halves of less than two nodes are not worth a plane between them
    if high[longest] - low[longest] < 5 {
        let mut at = low;
        loop {
            order.push((0..D).rev().fold(0, |index, d| index * counts[d] + at[d]));
            let mut d = 0;
            loop {
                at[d] += 1;
                if at[d] < high[d] {
                    break;
                }
                at[d] = low[d];
                d += 1;
                if d == D {
                    return;
                }
            }
        }
    }
    let middle = usize::midpoint(low[longest], high[longest]);
    let part = |from: usize, to: usize| {
        let (mut low, mut high) = (low, high);
        (low[longest], high[longest]) = (from, to);
        (low, high)
    };
    for (from, to) in [(low[longest], middle), (middle + 1, high[longest]), (middle, middle + 1)] {
        let (low, high) = part(from, to);
        dissect(low, high, counts, order);
    }
}
