//! The cloud kernel: the neighbours of one particle gathered a vector at a time.
//!
//! A particle occupies one or two rows of four numbers. Groups of as many rows as a vector has lanes are
//! loaded whole and transposed by shuffles: with AVX2 and AVX-512 this takes 0.7 of the time of scalar loads.

use super::kernel::{ForceKernel, law};
use super::real::KernelReal;
use crate::field::{CHUNK, Field};
use crate::parallel;
use crate::potential::StretchRange;
use pulp::Simd;
use std::ops::Range;

/// Neighbour lists are padded to a multiple of this with bonds of zero stiffness from the particle to itself.
pub const GROUP: usize = 8;

/// Numbers of a row.
const ROW: usize = 4;

/// Positions and displacements of consecutive particles: (x, y, u_x, u_y) in a plane, in space (x, y, z, 0)
/// and (u_x, u_y, u_z, 0).
#[derive(Default)]
pub struct ParticleRows {
    /// The first particle.
    first: usize,
    rows: Vec<[f64; ROW]>,
}

impl ParticleRows {
    /// Gathers these particles in a displacement.
    pub fn new<const D: usize>(position: &Field<D>, displacement: &Field<D>, range: Range<usize>) -> Self {
        let mut rows = Self { first: range.start, rows: vec![[0.0; ROW]; range.len() * (D - 1)] };
        rows.write(position, 0);
        rows.write(displacement, ROW * (D - 1) / 2);
        rows
    }

    /// Returns true if no particle is held.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        size_of_val(self.rows.as_slice())
    }

    /// Returns true if these are `particles` particles from the first on.
    pub fn has_particles<const D: usize>(&self, particles: usize) -> bool {
        self.first == 0 && self.rows.len() == particles * (D - 1)
    }

    /// Returns true if these are the rows of `sites` in this displacement.
    pub fn matches<const D: usize>(&self, displacement: &Field<D>, sites: Range<usize>) -> bool {
        let rows = self.rows.as_flattened().chunks_exact(ROW * (D - 1)).skip(sites.start - self.first);
        sites.zip(rows).all(|(site, row)| {
            let moved = &row[ROW * (D - 1) / 2..][..D];
            moved.iter().zip(displacement.get(site)).all(|(a, b)| a.to_bits() == b.to_bits())
        })
    }

    /// Loads another displacement.
    pub fn load<const D: usize>(&mut self, displacement: &Field<D>) {
        self.write(displacement, ROW * (D - 1) / 2);
    }

    /// Writes a vector of each particle, beginning with column `at` of its rows.
    fn write<const D: usize>(&mut self, field: &Field<D>, at: usize) {
        let (first, components) = (self.first, field.components());
        parallel::for_chunks(&mut self.rows, CHUNK * (D - 1), |chunk, rows| {
            let sites = first + chunk * CHUNK..;
            for (site, row) in sites.zip(rows.as_flattened_mut().chunks_exact_mut(ROW * (D - 1))) {
                for d in 0..D {
                    row[at + d] = components[d][site];
                }
            }
        });
    }
}

/// Input of the cloud kernel: compressed rows of neighbours.
pub struct CloudData<'a, const D: usize> {
    /// All particles that a work item reads.
    pub rows: &'a ParticleRows,
    /// First bond of each particle, and the end of the last.
    pub starts: &'a [usize],
    /// Neighbour of each bond.
    pub neighbours: &'a [u32],
    /// 1/|ξ| of each bond; 0 where broken.
    pub inverse_length: &'a [f64],
    /// w V_J of each bond; empty if all are equal and included in `stiffness`.
    pub weights: &'a [f64],
    /// 2kθ, times the common w V_J.
    pub stiffness: f64,
}

/// The cloud kernel: lists under a law.
pub struct CloudPass<'a, const D: usize, const P: usize, const Q: usize> {
    /// The lists.
    pub data: &'a CloudData<'a, D>,
    /// q(0), numerator and denominator of the law in e = λ² − 1.
    pub law: (f64, [f64; P], [f64; Q]),
    /// Ends of the fitted range in e; q is constant beyond them.
    pub clamp: [f64; 2],
}

impl<const D: usize, const P: usize, const Q: usize> ForceKernel<D> for CloudPass<'_, D, P, Q> {
    #[inline(always)]
    fn run<S: Simd>(
        &self,
        simd: S,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) {
        const { assert!(S::F64_LANES <= GROUP) };
        let (zero, lanes) = (simd.splat_f64s(0.0), S::F64_LANES);
        let (mut low, mut high) = (zero, zero);
        let tracking = track.is_some();
        let CloudData { rows, starts, neighbours, inverse_length, weights, stiffness } = *self.data;
        let order = order(simd);
        // closures and `array::from_fn` would not inherit the target features, and so not be inlined
        for offset in 0..force[0].len() {
            let own = start + offset;
            let (mut here, mut moved) = ([zero; D], [zero; D]);
            let place = (own - rows.first) * (D - 1);
            for d in 0..D {
                let (x, u) = if D == 2 { ([0, d], [0, 2 + d]) } else { ([0, d], [1, d]) };
                here[d] = simd.splat_f64s(rows.rows[place + x[0]][x[1]]);
                moved[d] = simd.splat_f64s(rows.rows[place + u[0]][u[1]]);
            }
            let mut sum = [zero; D];
            for first in (starts[own]..starts[own + 1]).step_by(lanes) {
                let group = &neighbours[first..first + lanes];
                // SAFETY: the rows hold every neighbour of this work item: those of all particles, of which
                // there is one row or two each (asserted in `CloudBonds::force`), or those of `reached_by`
                let (x, u) = unsafe {
                    let whole = columns::<S, D>(simd, rows, 0, group, &order);
                    let (mut x, mut u) = ([zero; D], [zero; D]);
                    if D == 2 {
                        for d in 0..D {
                            (x[d], u[d]) = (whole[d], whole[2 + d]);
                        }
                    } else {
                        let second = columns::<S, D>(simd, rows, 1, group, &order);
                        for d in 0..D {
                            (x[d], u[d]) = (whole[d], second[d]);
                        }
                    }
                    (x, u)
                };
                // SAFETY: the lists are as long as that of neighbours, of which `group` was cut
                let inverse = unsafe { f64::load::<S>(&inverse_length[first..first + lanes], 0) };
                let mut factor = simd.mul_f64s(inverse, simd.splat_f64s(stiffness));
                if !weights.is_empty() {
                    // SAFETY: as above
                    let weight = unsafe { f64::load::<S>(&weights[first..first + lanes], 0) };
                    factor = simd.mul_f64s(factor, weight);
                }
                let (mut zeta, mut e) = ([zero; D], zero);
                for d in 0..D {
                    let (xi, eta) = (simd.sub_f64s(x[d], here[d]), simd.sub_f64s(u[d], moved[d]));
                    zeta[d] = simd.add_f64s(xi, eta);
                    e = simd.mul_add_f64s(eta, simd.add_f64s(zeta[d], xi), e);
                }
                e = simd.mul_f64s(e, simd.mul_f64s(inverse, inverse));
                let q = law::<f64, S, P, Q>(simd, e, self.clamp, self.law.0, &self.law.1, &self.law.2);
                let q = simd.mul_f64s(q, factor);
                for d in 0..D {
                    sum[d] = simd.mul_add_f64s(q, zeta[d], sum[d]);
                }
                if tracking {
                    (low, high) = (simd.min_f64s(low, e), simd.max_f64s(high, e));
                }
            }
            for d in 0..D {
                force[d][offset] = simd.reduce_sum_f64s(sum[d]);
            }
        }
        if let Some(range) = track {
            *range =
                range.join(StretchRange { low: simd.reduce_min_f64s(low), high: simd.reduce_max_f64s(high) });
        }
    }
}

/// Loads row `at` of a vector of particles, column by column.
///
/// # Safety
/// `rows` hold every particle of `group`.
#[inline(always)]
unsafe fn columns<S: Simd, const D: usize>(
    simd: S,
    rows: &ParticleRows,
    at: usize,
    group: &[u32],
    order: &[usize; GROUP],
) -> [S::f64s; ROW] {
    let mut raw = [[0.0; ROW]; GROUP];
    for lane in 0..S::F64_LANES {
        let row = (group[order[lane]] as usize - rows.first) * (D - 1) + at;
        debug_assert!(row < rows.rows.len());
        // SAFETY: as this function asks
        raw[lane] = unsafe { *rows.rows.get_unchecked(row) };
    }
    turned(simd, &raw)
}

/// Transposes rows to columns; [`order`] returns the lane of each row.
#[inline(always)]
fn turned<S: Simd>(simd: S, raw: &[[f64; ROW]; GROUP]) -> [S::f64s; ROW] {
    // slices would be made by functions that are not inlined here
    let start = std::ptr::from_ref(raw).cast::<S::f64s>();
    let mut vectors = [simd.splat_f64s(0.0); ROW];
    for k in 0..ROW {
        // SAFETY: `ROW` vectors are at most `GROUP` rows
        vectors[k] = unsafe { start.add(k).read_unaligned() };
    }
    simd.deinterleave_shfl_f64s(vectors)
}

/// Returns the lane of each row in its column: loading bonds in this order restores the order of the lists in
/// the columns.
#[inline(always)]
fn order<S: Simd>(simd: S) -> [usize; GROUP] {
    let mut raw = [[0.0; ROW]; GROUP];
    for lane in 0..GROUP {
        raw[lane] = [lane as f64; ROW];
    }
    let mut row_of = [0.0; GROUP];
    S::as_mut_simd_f64s(&mut row_of).0[0] = turned(simd, &raw)[0];
    let mut order = [0; GROUP];
    for lane in 0..S::F64_LANES {
        order[row_of[lane] as usize] = lane;
    }
    order
}
