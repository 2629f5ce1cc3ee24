//! Springs of faces in the local part of the preconditioner.
//!
//! A face in contact with a rigid surface, or tied to a grip, adds k w wᵀ to the stiffness. With the
//! diagonal of this matrix alone, the particles below would be as stiff against each other as against the
//! surface, and iterations grow in proportion to k. With D the diagonal of the body and W the weights w of
//! all faces, (D + W K Wᵀ)⁻¹ = D⁻¹ − D⁻¹W S⁻¹WᵀD⁻¹ and S = K⁻¹ + WᵀD⁻¹W (Woodbury), with sparse factors of
//! S.

use super::load::Loads;
use crate::field::Field;
use polycore::numerics::cholesky::{Cholesky, Pattern};

/// A face held by a rigid surface or a grip.
pub struct HeldFace<const D: usize> {
    /// Sites of the particles below with their weights.
    pub below: Vec<(usize, f64)>,
    /// Directions in which it is held, at right angles to each other, with the stiffness along each, N/m.
    pub directions: Vec<([f64; D], f64)>,
}

/// Springs of faces.
pub struct FaceSprings<const D: usize> {
    /// Start of each row of Wᵀ, a direction of a face, and the number of entries.
    starts: Vec<usize>,
    /// Particle of each entry, and D⁻¹W.
    entries: Vec<(u32, [f64; D])>,
    cholesky: Cholesky,
    factors: Vec<f64>,
    right: Vec<f64>,
}

impl<const D: usize> FaceSprings<D> {
    /// Computes the factors with D⁻¹ of each of the `particles`. `None` without faces, or if the factors
    /// exceed the memory.
    pub fn new(faces: &[HeldFace<D>], particles: &[u32], loads: &Loads<D>, local: &[f64]) -> Option<Self> {
        if faces.is_empty() {
            return None;
        }
        let (mut starts, mut entries, mut stiffness) = (vec![0], Vec::new(), Vec::new());
        for face in faces {
            for &(direction, spring) in &face.directions {
                for &(site, weight) in &face.below {
                    let Ok(particle) = particles.binary_search(&(site as u32)) else { continue };
                    let bits = loads.bound().get(site).copied().unwrap_or(0);
                    let free = |d: usize| if bits >> d & 1 == 1 { 0.0 } else { weight * direction[d] };
                    entries.push((particle as u32, std::array::from_fn(free)));
                }
                starts.push(entries.len());
                stiffness.push(spring);
            }
        }
        let (pattern, values) = matrix(&starts, &entries, &stiffness, local);
        let cholesky = Cholesky::analyse_reordered(pattern)?;
        let mut factors = Vec::new();
        if !cholesky.factor(&values, &mut factors) {
            return None;
        }
        for (particle, weight) in &mut entries {
            *weight = weight.map(|w| w * local[*particle as usize]);
        }
        Some(Self { right: vec![0.0; stiffness.len()], starts, entries, cholesky, factors })
    }

    /// Adds −D⁻¹W S⁻¹WᵀD⁻¹g to a field over particles.
    pub fn correct(&mut self, gradient: &Field<D>, result: &mut Field<D>) {
        let rows = self.starts.windows(2);
        for (right, row) in self.right.iter_mut().zip(rows.clone()) {
            let product = |&(particle, weight): &(u32, [f64; D])| {
                let g = gradient.get(particle as usize);
                (0..D).map(|d| weight[d] * g[d]).sum::<f64>()
            };
            *right = self.entries[row[0]..row[1]].iter().map(product).sum();
        }
        self.cholesky.solve(&self.factors, &mut self.right);
        for (right, row) in self.right.iter().zip(rows) {
            for &(particle, weight) in &self.entries[row[0]..row[1]] {
                let z = result.get(particle as usize);
                result.set(particle as usize, std::array::from_fn(|d| z[d] - right * weight[d]));
            }
        }
    }

    /// Releases a particle that has lost all its bonds, so that the sum of both parts stays positive.
    pub fn release_particle(&mut self, particle: usize) {
        let own = self.entries.iter_mut().filter(|(other, _)| *other as usize == particle);
        own.for_each(|(_, weight)| *weight = [0.0; D]);
    }
}

/// S of rows of Wᵀ with their stiffness.
fn matrix<const D: usize>(
    starts: &[usize],
    entries: &[(u32, [f64; D])],
    stiffness: &[f64],
    local: &[f64],
) -> (Pattern, Vec<f64>) {
    let rows = stiffness.len();
    // entries of each particle, with their rows
    let mut of_particles: Vec<(u32, usize, usize)> = Vec::with_capacity(entries.len());
    for row in 0..rows {
        of_particles.extend((starts[row]..starts[row + 1]).map(|entry| (entries[entry].0, row, entry)));
    }
    of_particles.sort_unstable();
    let (mut sums, mut found) = (vec![0.0; rows], Vec::new());
    let (mut pattern, mut values) = (Pattern { starts: vec![0], rows: Vec::new() }, Vec::new());
    for column in 0..rows {
        found.push(column);
        sums[column] = 1.0 / stiffness[column];
        for &(particle, own) in &entries[starts[column]..starts[column + 1]] {
            let first = of_particles.partition_point(|other| other.0 < particle);
            let others = of_particles[first..].iter().take_while(|other| other.0 == particle);
            for &(_, row, entry) in others.take_while(|other| other.1 <= column) {
                let other = entries[entry].1;
                let product: f64 = (0..D).map(|d| own[d] * other[d]).sum();
                if product == 0.0 {
                    continue;
                }
                if sums[row] == 0.0 {
                    found.push(row);
                }
                sums[row] += product * local[particle as usize];
            }
        }
        found.sort_unstable();
        found.dedup();
        for &row in &found {
            pattern.rows.push(row);
            values.push(std::mem::take(&mut sums[row]));
        }
        pattern.starts.push(pattern.rows.len());
        found.clear();
    }
    (pattern, values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    /// Compares with the inverse of the whole matrix: faces that share particles, one held in all directions,
    /// a constrained component, and stiffness from below that of the particles to a million times it.
    #[test]
    fn corrects_to_the_inverse_of_the_sum() {
        let diagonal = [2.0, 3.0, 0.5, 4.0, 1.5];
        let local = diagonal.map(|d: f64| 1.0 / d);
        for stiffness in [0.1, 30.0, 1e6] {
            let slanted = vec![([0.6, 0.8], stiffness)];
            let both = vec![([1.0, 0.0], 3.0 * stiffness), ([0.0, 1.0], 0.5 * stiffness)];
            let along = vec![([1.0, 0.0], stiffness)];
            let faces = [
                HeldFace { below: vec![(0, 1.1), (1, 0.2), (2, -0.3)], directions: slanted },
                HeldFace { below: vec![(2, 0.9), (3, 0.1)], directions: both },
                HeldFace { below: vec![(4, 1.0)], directions: along },
            ];
            let loads = Loads::<2> { constrained: vec![0, 1, 0, 0, 0], ..Loads::default() };
            let mut springs = FaceSprings::new(&faces, &[0, 1, 2, 3, 4], &loads, &local).unwrap();
            let mut whole = DMatrix::from_fn(10, 10, |a, b| if a == b { diagonal[a / 2] } else { 0.0 });
            for face in &faces {
                for (part_a, a) in face.below.iter().flat_map(|&(p, w)| [(w, 2 * p), (w, 2 * p + 1)]) {
                    for (part_b, b) in face.below.iter().flat_map(|&(p, w)| [(w, 2 * p), (w, 2 * p + 1)]) {
                        for (direction, spring) in &face.directions {
                            whole[(a, b)] += spring * part_a * part_b * direction[a % 2] * direction[b % 2];
                        }
                    }
                }
            }
            // the first component of the second particle is constrained
            let whole = whole.remove_row(2).remove_column(2);
            let values = [[1.0, 0.3], [0.0, 2.0], [-2.0, 1.0], [0.5, -1.0], [3.0, 0.7]];
            let (mut gradient, mut result) = (Field::<2>::zeros(5), Field::zeros(5));
            for (particle, value) in values.into_iter().enumerate() {
                gradient.set(particle, value);
                result.set(particle, value.map(|g| g * local[particle]));
            }
            springs.correct(&gradient, &mut result);
            let flat = |field: &Field<2>| {
                let all = (0..5).flat_map(|particle| field.get(particle)).collect::<Vec<f64>>();
                nalgebra::DVector::from_vec(all).remove_row(2)
            };
            let back = &whole * flat(&result);
            let off = (back - flat(&gradient)).amax();
            assert!(off < 1e-14 * (1.0 + 10.0 * stiffness), "{stiffness}: {off:e}");
        }
    }
}
