//! Matrix-vector products: vectorized over runs of equal rows, row by row otherwise.

use super::stencils::RowStencil;
use super::{ConductionRows, RowRun};
use crate::system::vector::dot_simd;
use pulp::{Simd, WithSimd};

/// Longest row of the vectorized path.
const MAX_ENTRIES: usize = 64;

/// Product of one work item.
pub(super) struct RowsProduct<'a, const FLOW: bool> {
    pub rows: &'a ConductionRows,
    pub segments: &'a [RowRun],
    pub weights: [f64; 2],
    pub diagonal: Option<&'a [f64]>,
    pub x: &'a [f64],
    pub y: &'a mut [f64],
    pub first: usize,
}

impl<const FLOW: bool> WithSimd for RowsProduct<'_, FLOW> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { rows, segments, weights, diagonal, x, y, first } = self;
        let stencils = &rows.stencils;
        for segment in segments {
            let RowStencil { pattern, values } = segment.stencil;
            let (range, offsets) = (stencils.values.range(values), stencils.offsets(pattern));
            let start = first + segment.start as usize;
            let length = segment.length as usize;
            if length >= S::F64_LANES && range.len() <= MAX_ENTRIES {
                RunProduct { rows, segment, diagonal, y: &mut *y, first }.run::<S, FLOW>(simd, weights, x);
            } else {
                // vectors of four read one number past a row with columns in threes
                let threes = stencils.in_threes(pattern)
                    && stencils.capacity.is_empty()
                    && range.end < stencils.conduction.len()
                    && (start + length).wrapping_add_signed(offsets[offsets.len() - 1] as isize) < x.len();
                for row in start..start + length {
                    let mut sum = if threes {
                        let own = if FLOW { x[row] } else { 0.0 };
                        weights[1] * in_threes(offsets, &stencils.conduction[range.start..], x, row, own)
                    } else if FLOW {
                        flow(offsets, &stencils.conduction[range.clone()], x, row)
                    } else {
                        let mut sum = 0.0;
                        for k in 0..offsets.len() {
                            let other = x[row.wrapping_add_signed(offsets[k] as isize)];
                            sum += rows.value(range.start + k, weights) * other;
                        }
                        sum
                    };
                    if let Some(diagonal) = diagonal {
                        sum += diagonal[row] * x[row];
                    }
                    y[row - first] = sum;
                }
            }
        }
        if FLOW { 0.0 } else { dot_simd(simd, &x[first..first + y.len()], y) }
    }
}

/// Σ v_j (x_j − `own`) of a row with columns in threes, by vectors of four numbers, the last of which is
/// ignored.
#[inline(always)]
fn in_threes(offsets: &[i32], values: &[f64], x: &[f64], row: usize, own: f64) -> f64 {
    let mut sums = [0.0; 4];
    let mut at = 0;
    while at < offsets.len() {
        let start = row.wrapping_add_signed(offsets[at] as isize);
        let (other, value) = (&x[start..start + 4], &values[at..at + 4]);
        for k in 0..4 {
            sums[k] += value[k] * (other[k] - own);
        }
        at += 3;
    }
    sums[0] + sums[1] + sums[2]
}

/// Σ K_ij (x_j − x_i) of a row, in four partial sums and a remainder.
#[inline(always)]
fn flow(offsets: &[i32], values: &[f64], x: &[f64], row: usize) -> f64 {
    let own = x[row];
    let mut sums = [0.0; 4];
    let ((offsets, last_offsets), (values, last_values)) =
        (offsets.as_chunks::<4>(), values.as_chunks::<4>());
    for at in 0..offsets.len() {
        for k in 0..4 {
            sums[k] += values[at][k] * (x[row.wrapping_add_signed(offsets[at][k] as isize)] - own);
        }
    }
    let mut rest = 0.0;
    for k in 0..last_offsets.len() {
        rest += last_values[k] * (x[row.wrapping_add_signed(last_offsets[k] as isize)] - own);
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// Products K x and M u of one work item, in one pass over the rows.
pub(super) struct FlowAndCapacity<'a> {
    pub rows: &'a ConductionRows,
    pub segments: &'a [RowRun],
    pub x: &'a [f64],
    pub u: &'a [f64],
    pub flow: &'a mut [f64],
    pub stored: &'a mut [f64],
    pub first: usize,
}

impl WithSimd for FlowAndCapacity<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows, segments, x, u, flow, stored, first } = self;
        let stencils = &rows.stencils;
        for segment in segments {
            let RowStencil { pattern, values } = segment.stencil;
            let (range, offsets) = (stencils.values.range(values), stencils.offsets(pattern));
            let start = first + segment.start as usize;
            let length = segment.length as usize;
            if length >= S::F64_LANES && range.len() <= MAX_ENTRIES {
                let rows_of = |y| RunProduct { rows, segment, diagonal: None, y, first };
                rows_of(&mut *flow).run::<S, true>(simd, [0.0, 1.0], x);
                rows_of(&mut *stored).run::<S, false>(simd, [1.0, 0.0], u);
                continue;
            }
            let conduction = &stencils.conduction[range.clone()][..offsets.len()];
            let capacity = &stencils.capacity[range][..offsets.len()];
            for row in start..start + length {
                let own = x[row];
                // K x and M u, two partial sums each
                let mut sums = [0.0; 4];
                let pairs = offsets.len() / 2;
                for pair in 0..pairs {
                    for half in 0..2 {
                        let at = 2 * pair + half;
                        let other = row.wrapping_add_signed(offsets[at] as isize);
                        sums[half] += conduction[at] * (x[other] - own);
                        sums[2 + half] += capacity[at] * u[other];
                    }
                }
                if let Some(at) = (2 * pairs < offsets.len()).then_some(2 * pairs) {
                    let other = row.wrapping_add_signed(offsets[at] as isize);
                    sums[0] += conduction[at] * (x[other] - own);
                    sums[2] += capacity[at] * u[other];
                }
                flow[row - first] = sums[0] + sums[1];
                stored[row - first] = sums[2] + sums[3];
            }
        }
    }
}

/// Product of a run of equal rows.
struct RunProduct<'a> {
    rows: &'a ConductionRows,
    segment: &'a RowRun,
    diagonal: Option<&'a [f64]>,
    y: &'a mut [f64],
    first: usize,
}

impl RunProduct<'_> {
    #[inline(always)]
    fn run<S: Simd, const FLOW: bool>(self, simd: S, weights: [f64; 2], x: &[f64]) {
        let Self { rows, segment, diagonal, y, first } = self;
        let lanes = S::F64_LANES;
        let range = rows.stencils.values.range(segment.stencil.values);
        let mut values = [0.0; MAX_ENTRIES];
        let offsets = rows.stencils.offsets(segment.stencil.pattern);
        let values = &mut values[..offsets.len()];
        for (value, at) in values.iter_mut().zip(range) {
            *value = rows.value(at, weights);
        }
        let mut row = first + segment.start as usize;
        let end = row + segment.length as usize;
        while row + 4 * lanes <= end {
            block::<S, 4, FLOW>(simd, offsets, values, diagonal, x, y, row, first);
            row += 4 * lanes;
        }
        while row < end {
            // the last vector may overlap the one before: it writes the same bits again
            block::<S, 1, FLOW>(simd, offsets, values, diagonal, x, y, row.min(end - lanes), first);
            row += lanes;
        }
    }
}

/// Multiplies V vectors of rows of one stencil.
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
