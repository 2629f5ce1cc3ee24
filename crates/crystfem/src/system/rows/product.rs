//! Rows times a vector: runs of equal rows by vectors of the processor, others one by one.

use super::{Rows, Segment};
use crate::system::vector::dot_simd;
use pulp::{Simd, WithSimd};

/// Entries of the longest row that the vector path takes.
const MOST_ENTRIES: usize = 64;

/// One work item of a product.
pub(super) struct Product<'a, const FLOW: bool> {
    pub rows: &'a Rows,
    pub segments: &'a [Segment],
    pub weights: [f64; 2],
    pub diagonal: Option<&'a [f64]>,
    pub x: &'a [f64],
    pub y: &'a mut [f64],
    pub first: usize,
}

impl<const FLOW: bool> WithSimd for Product<'_, FLOW> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { rows, segments, weights, diagonal, x, y, first } = self;
        let stencils = &rows.stencils;
        let lanes = S::F64_LANES;
        let mut values = [0.0; MOST_ENTRIES];
        for segment in segments {
            let range = stencils.range(segment.stencil);
            let (start, length) = (segment.start as usize, segment.length as usize);
            if length >= lanes && range.len() <= MOST_ENTRIES {
                let offsets = &stencils.offsets[range.clone()];
                let values = &mut values[..offsets.len()];
                for (value, at) in values.iter_mut().zip(range) {
                    *value = rows.value(at, weights);
                }
                let mut row = start;
                let end = start + length;
                while row + 4 * lanes <= end {
                    block::<S, 4, FLOW>(simd, offsets, values, diagonal, x, y, row, first);
                    row += 4 * lanes;
                }
                while row < end {
                    // the last vector may overlap the one before: it writes the same bits again
                    block::<S, 1, FLOW>(simd, offsets, values, diagonal, x, y, row.min(end - lanes), first);
                    row += lanes;
                }
            } else {
                for row in start..start + length {
                    let mut sums = [0.0; 4];
                    for (k, at) in range.clone().enumerate() {
                        let mut other = x[row.wrapping_add_signed(stencils.offsets[at] as isize)];
                        if FLOW {
                            other -= x[row];
                        }
                        sums[k & 3] += rows.value(at, weights) * other;
                    }
                    let mut sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
                    if let Some(diagonal) = diagonal {
                        sum += diagonal[row] * x[row];
                    }
                    y[row - first] = sum;
                }
            }
        }
        dot_simd(simd, &x[first..first + y.len()], y)
    }
}

/// V vectors of rows of one stencil.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn block<S: Simd, const V: usize, const FLOW: bool>(
    simd: S,
    offsets: &[i32],
    values: &[f64],
    diagonal: Option<&[f64]>,
    x: &[f64],
    y: &mut [f64],
    row: usize,
    first: usize,
) {
    let width = V * S::F64_LANES;
    let mut sums = [simd.splat_f64s(0.0); V];
    let (own, _) = S::as_simd_f64s(&x[row..row + width]);
    if let Some(diagonal) = diagonal {
        let (d, _) = S::as_simd_f64s(&diagonal[row..row + width]);
        for v in 0..V {
            sums[v] = simd.mul_f64s(d[v], own[v]);
        }
    }
    for (offset, value) in offsets.iter().zip(values) {
        let start = row.wrapping_add_signed(*offset as isize);
        let (other, _) = S::as_simd_f64s(&x[start..start + width]);
        let value = simd.splat_f64s(*value);
        for v in 0..V {
            let other = if FLOW { simd.sub_f64s(other[v], own[v]) } else { other[v] };
            sums[v] = simd.mul_add_f64s(value, other, sums[v]);
        }
    }
    let (out, _) = S::as_mut_simd_f64s(&mut y[row - first..row - first + width]);
    out[..V].copy_from_slice(&sums);
}
