//! Stiffness of held faces in the space of the coarse functions: k Pᵀw wᵀP, exactly. One that is too small,
//! as with the functions at one particle in place of wᵀP, makes steps of the coarse level too long in
//! proportion to k.

use super::space::{CORNERS, CoarseSpace, NONE};
use super::stiffness::hats;
use super::{FunctionBlocks, Pattern};
use crate::solver::face_springs::HeldFace;
use crate::solver::load::Loads;

/// wᵀP of a face.
pub struct FaceFunctions<const D: usize> {
    /// Functions, ascending.
    pub functions: Vec<u32>,
    /// Value of each, for the free components of the particles below.
    values: Vec<[f64; D]>,
    /// Σ k n⊗n over the directions n in which the face is held, N/m.
    stiffness: [[f64; D]; D],
}

impl<const D: usize> FaceFunctions<D> {
    /// Sums the functions at the particles below a face.
    pub fn new(space: &CoarseSpace<D>, loads: &Loads<D>, face: &HeldFace<D>) -> Self {
        let mut all: Vec<(u32, [f64; D])> = Vec::with_capacity(face.below.len() * CORNERS);
        for &(site, weight) in &face.below {
            let element = space.element_of[site];
            if element == NONE {
                continue;
            }
            let (values, _) = hats::<D>(space.local.get(site), space.edge);
            let (bits, functions) = (loads.constrained(site), space.elements[element as usize].functions);
            for (&function, value) in functions[..1 << D].iter().zip(values) {
                let free = |d: usize| if bits >> d & 1 == 1 { 0.0 } else { weight * value };
                all.push((function, std::array::from_fn(free)));
            }
        }
        all.sort_by_key(|entry| entry.0);
        let (mut functions, mut values) = (Vec::new(), Vec::new());
        for group in all.chunk_by(|a, b| a.0 == b.0) {
            let sum = |d: usize| group.iter().map(|entry| entry.1[d]).sum::<f64>();
            functions.push(group[0].0);
            values.push(std::array::from_fn(sum));
        }
        let part = |i: usize, j: usize| face.directions.iter().map(|(n, k)| k * n[i] * n[j]).sum::<f64>();
        let stiffness = std::array::from_fn(|i| std::array::from_fn(|j| part(i, j)));
        Self { functions, values, stiffness }
    }
}

/// Adds the stiffness of faces to the upper triangle of the matrix.
pub fn add_faces<const D: usize>(
    faces: &[FaceFunctions<D>],
    pattern: &Pattern,
    blocks: &FunctionBlocks,
    entries: &mut [f64],
) {
    for face in faces {
        for (k, &column) in face.functions.iter().enumerate() {
            let (column, other) = (column as usize, face.values[k]);
            for (&row, own) in face.functions[..=k].iter().zip(&face.values) {
                blocks.add::<D>(pattern, entries, [row as usize, column], |i, j| {
                    face.stiffness[i][j] * own[i] * other[j]
                });
            }
        }
    }
}
