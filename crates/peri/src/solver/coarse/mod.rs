//! Coarse level of a two-level preconditioner: P A_c⁻¹ Pᵀ with P the hat functions of [`space`], A_c their
//! stiffness of [`stiffness`], factored by [`factor`].

mod faces;
mod factor;
mod space;
mod stiffness;
mod transfer;

pub use stiffness::BondCounts;

use crate::bonds::BodyGeometry;
use crate::field::Field;
use crate::parallel;
use crate::potential::BondPotential;
use crate::solver::face_springs::HeldFace;
use crate::solver::load::Loads;
use crate::solver::particle_map::in_order;
use faces::{FaceFunctions, add_faces};
use factor::{Factor, Pattern};
use polycore::numerics::bounds;
use pulp::Arch;
use space::{CORNERS, CoarseSpace, NONE};
use stiffness::{Assembly, ElementMatrix};
use transfer::{Prolong, Restrict};

/// Stiffness against rigid motion over that against the longest wave of the body: floating pieces, and pieces
/// that rotate about one bond, have none of their own.
const SHIFT: f64 = 0.01;
/// Least diagonal entry over the mean one.
const LEAST_DIAGONAL: f64 = 1e-9;
/// Elements summed by one work item.
const BATCH: usize = 64;

/// Body and law of a coarse level.
pub struct CoarseBody<'a, const D: usize> {
    /// The bonds.
    pub bonds: &'a dyn BodyGeometry<D>,
    /// Loads, for the constrained components.
    pub loads: &'a Loads<D>,
    /// Present displacement.
    pub displacement: &'a Field<D>,
    /// Law; kθ, N/m⁶, and λ of the volume in excess of that of bonds, Pa; fitted stretches.
    pub law: (&'a dyn BondPotential, [f64; 2], [f64; 2]),
    /// Stiffness density of each site, N/m⁵, that holds constrained components.
    pub springs: &'a [f64],
    /// Counts of the bonds.
    pub survey: &'a BondCounts,
    /// Faces held by rigid surfaces and grips.
    pub faces: &'a [HeldFace<D>],
}

/// A factored coarse level.
pub struct CoarseLevel<const D: usize> {
    space: CoarseSpace<D>,
    factor: Factor,
    /// Index of each particle among the elements' members; [`NONE`] for particles without bonds.
    places: Vec<u32>,
    /// P c of the members, in their order.
    moved: Field<D>,
    /// Pᵀg of each element at its corners, component by component.
    parts: Vec<f64>,
    /// Coefficients of the functions, D each.
    coefficients: Vec<f64>,
}

impl<const D: usize> CoarseLevel<D> {
    /// Builds functions with cells of about `edge` (m), at most `most` degrees of freedom; reuses the
    /// analysis of `old` if possible. `None` if the body is too small or too broken for a coarse level.
    pub fn new(body: &CoarseBody<D>, edge: f64, most: usize, old: Option<Self>) -> Option<Self> {
        // a lattice's particle with every bond has neighbours on all sides; a cloud's may still be at a gap
        let whole = if body.bonds.whole_family().is_some() { body.survey.most } else { u32::MAX };
        let mut space = CoarseSpace::new(body.bonds, &body.survey.bonded, whole, edge, most / D)?;
        let CoarseBody { bonds, loads, displacement, law, springs, survey, faces } = *body;
        let assembly = Assembly::new(bonds, loads, displacement, survey, law, springs, space.edge);
        let matrices: Vec<(ElementMatrix, [f64; CORNERS])> =
            parallel::map_each(&space.elements, |element| assembly.element(&space, element));
        let faces: Vec<FaceFunctions<D>> =
            faces.iter().map(|face| FaceFunctions::new(&space, loads, face)).collect();
        let extent = extent(body.bonds);
        let shift = SHIFT * assembly.stiffness() * (std::f64::consts::PI / extent).powi(2);
        let (pattern, blocks) = pattern::<D>(&space, &faces);
        let mut entries = assemble::<D>(&space, &pattern, &blocks, &matrices, shift);
        add_faces(&faces, &pattern, &blocks, &mut entries);
        drop(matrices);
        let factor = Factor::new(pattern, &entries, old.map(|old| old.factor))?;
        let places = space.renumber(bonds.particles());
        let moved = Field::zeros(space.members.len());
        let parts = vec![0.0; space.elements.len() * CORNERS * D];
        let coefficients = vec![0.0; space.functions * D];
        Some(Self { space, factor, places, moved, parts, coefficients })
    }

    /// Solves A_c c = Pᵀg of a field over particles; g is zero where components are constrained.
    pub fn solve(&mut self, gradient: &Field<D>) {
        let (space, gradient, arch) = (&self.space, gradient.components(), Arch::new());
        let local = space.local.components();
        in_order(self.parts.chunks_mut(BATCH * CORNERS * D).collect(), |batch, parts| {
            for (part, element) in parts.chunks_mut(CORNERS * D).zip(&space.elements[batch * BATCH..]) {
                let [from, to] = element.members;
                let members = &space.members[from..to];
                arch.dispatch(Restrict { members, local: local.map(|x| &x[from..to]), gradient, part });
            }
        });
        self.coefficients.fill(0.0);
        for (part, element) in self.parts.chunks(CORNERS * D).zip(&space.elements) {
            for a in 0..1 << D {
                for d in 0..D {
                    self.coefficients[element.functions[a] as usize * D + d] += part[d * CORNERS + a];
                }
            }
        }
        self.factor.solve(&mut self.coefficients);
        let (mut rest, mut at) = (self.moved.components_mut(), 0);
        let cut = |elements: &'_ [space::CoarseElement]| {
            let length = elements.last().map_or(at, |element| element.members[1]) - at;
            at += length;
            rest.each_mut().map(|rest| {
                let (part, others) = std::mem::take(rest).split_at_mut(length);
                *rest = others;
                part
            })
        };
        let pieces: Vec<[&mut [f64]; D]> = space.elements.chunks(BATCH).map(cut).collect();
        let coefficients = &self.coefficients;
        in_order(pieces, |batch, moved| {
            let elements = &space.elements[batch * BATCH..];
            let (count, first) = (moved[0].len(), elements[0].members[0]);
            let mut moved = moved;
            for element in elements.iter().take_while(|element| element.members[1] <= first + count) {
                let [from, to] = element.members;
                let mut corners = [[0.0; CORNERS]; D];
                for a in 0..1 << D {
                    for d in 0..D {
                        corners[d][a] = coefficients[element.functions[a] as usize * D + d];
                    }
                }
                let out = moved.each_mut().map(|moved| &mut moved[from - first..to - first]);
                arch.dispatch(Prolong { local: local.map(|x| &x[from..to]), corners, out });
            }
        });
    }

    /// (P c)_I of a particle with the coefficients of the last [`Self::solve`].
    #[inline]
    pub fn value(&self, particle: usize) -> [f64; D] {
        match self.places[particle] {
            NONE => [0.0; D],
            place => self.moved.get(place as usize),
        }
    }

    /// Degrees of freedom, and entries of the factors.
    pub fn size(&self) -> [usize; 2] {
        [self.coefficients.len(), self.factor.entries()]
    }
}

/// Diagonal of the bounding box, m.
fn extent<const D: usize>(bonds: &dyn BodyGeometry<D>) -> f64 {
    let [low, high] = bounds(bonds.particles().iter().map(|&site| bonds.position(site as usize)));
    (0..D).map(|d| (high[d] - low[d] + bonds.spacing()).powi(2)).sum::<f64>().sqrt()
}

/// Functions that share an element with each function, up to and including itself.
struct FunctionBlocks {
    starts: Vec<usize>,
    others: Vec<u32>,
}

impl FunctionBlocks {
    /// Adds a matrix of components (i of the row, j of the column) of a pair of functions, row ≤ column, of
    /// one element or face to the entries of the upper triangle.
    fn add<const D: usize>(
        &self,
        pattern: &Pattern,
        entries: &mut [f64],
        [row, column]: [usize; 2],
        value: impl Fn(usize, usize) -> f64,
    ) {
        let others = &self.others[self.starts[column]..self.starts[column + 1]];
        let place = others.partition_point(|&other| (other as usize) < row);
        for j in 0..D {
            let last = if row == column { j } else { D - 1 };
            for i in 0..=last {
                entries[pattern.starts[column * D + j] + place * D + i] += value(i, j);
            }
        }
    }
}

fn pattern<const D: usize>(space: &CoarseSpace<D>, faces: &[FaceFunctions<D>]) -> (Pattern, FunctionBlocks) {
    let mut pairs: Vec<u64> = Vec::with_capacity(space.elements.len() * (1 << (2 * D)));
    for element in &space.elements {
        for &column in &element.functions[..1 << D] {
            for &row in element.functions[..1 << D].iter().filter(|&&row| row <= column) {
                pairs.push(u64::from(column) << 32 | u64::from(row));
            }
        }
    }
    let mut last: &[u32] = &[];
    for functions in faces.iter().map(|face| &*face.functions) {
        // neighbours have the same
        if functions != last {
            for (k, &column) in functions.iter().enumerate() {
                pairs.extend(functions[..=k].iter().map(|&row| u64::from(column) << 32 | u64::from(row)));
            }
        }
        last = functions;
    }
    pairs.sort_unstable();
    pairs.dedup();
    let mut blocks = FunctionBlocks { starts: vec![0], others: Vec::with_capacity(pairs.len()) };
    let mut pattern = Pattern { starts: vec![0], rows: Vec::with_capacity(pairs.len() * D * D) };
    let mut next = 0;
    for column in 0..space.functions {
        while next < pairs.len() && (pairs[next] >> 32) as usize == column {
            blocks.others.push(pairs[next] as u32);
            next += 1;
        }
        let others = &blocks.others[blocks.starts[column]..];
        blocks.starts.push(blocks.others.len());
        for j in 0..D {
            for &row in others {
                let count = if row as usize == column { j + 1 } else { D };
                pattern.rows.extend((0..count).map(|i| row as usize * D + i));
            }
            pattern.starts.push(pattern.rows.len());
        }
    }
    (pattern, blocks)
}

/// Sums the element matrices and the shift.
fn assemble<const D: usize>(
    space: &CoarseSpace<D>,
    pattern: &Pattern,
    blocks: &FunctionBlocks,
    matrices: &[(ElementMatrix, [f64; CORNERS])],
    shift: f64,
) -> Vec<f64> {
    let mut entries = vec![0.0; pattern.rows.len()];
    for (element, (matrix, measure)) in space.elements.iter().zip(matrices) {
        let mut at = 0;
        for a in 0..1 << D {
            for b in a..1 << D {
                let (f, g) = (element.functions[a], element.functions[b]);
                let pair = [f.min(g), f.max(g)].map(|function| function as usize);
                blocks.add::<D>(pattern, &mut entries, pair, |i, j| {
                    let value = if f <= g { matrix[at][i * D + j] } else { matrix[at][j * D + i] };
                    if a == b && i == j { value + shift * measure[a] } else { value }
                });
                at += 1;
            }
        }
    }
    // a function that its particles hardly reach
    let mean =
        (0..pattern.size()).map(|k| entries[pattern.starts[k + 1] - 1]).sum::<f64>() / pattern.size() as f64;
    for k in 0..pattern.size() {
        entries[pattern.starts[k + 1] - 1] += LEAST_DIAGONAL * mean;
    }
    entries
}
