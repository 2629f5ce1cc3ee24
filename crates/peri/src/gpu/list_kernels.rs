//! Kernels of lists: sums, copies, values in some places.

use cubecl::ir::ElemType;
use cubecl::prelude::*;

/// Sums, or extremes, of `rows` lists: thread i of `lanes` takes every `lanes`th number from i on, in order.
/// Bit r of `greatest` and `least`: list r, of the first 32, has its extreme taken.
#[cube(launch_unchecked)]
pub fn fold<F: Float>(
    from: &[F],
    into: &mut [F],
    lanes: InputScalar,
    start: InputScalar,
    #[comptime] rows: usize,
    #[comptime] greatest: u32,
    #[comptime] least: u32,
    #[define(F)] _precision: ElemType,
) {
    let lanes = lanes.get::<u32>() as usize;
    let start = start.get::<u32>() as usize;
    if ABSOLUTE_POS >= lanes {
        terminate!();
    }
    let length = from.len() / rows;
    #[unroll]
    for row in 0..rows {
        let mut sum = F::new(0.0);
        for index in range_stepped(ABSOLUTE_POS, length, lanes) {
            let value = from[row * length + index];
            if comptime!(row < 32 && (greatest >> row) & 1 == 1) {
                sum = F::max(sum, value);
            } else if comptime!(row < 32 && (least >> row) & 1 == 1) {
                sum = F::min(sum, value);
            } else {
                sum += value;
            }
        }
        into[start + row * lanes + ABSOLUTE_POS] = sum;
    }
}

/// Replaces words of a list.
#[cube(launch_unchecked)]
pub fn scatter(places: &[u32], values: &[u32], into: &mut [u32]) {
    if ABSOLUTE_POS < places.len() {
        into[places[ABSOLUTE_POS] as usize] = values[ABSOLUTE_POS];
    }
}

/// Replaces values of a field in some sites.
#[cube(launch_unchecked)]
pub fn put<F: Float>(
    sites: &[u32],
    values: &[F],
    into: &mut [F],
    #[comptime] dimension: usize,
    #[define(F)] _precision: ElemType,
) {
    let count = sites.len();
    if ABSOLUTE_POS >= count {
        terminate!();
    }
    let all = into.len() / dimension;
    #[unroll]
    for d in 0..dimension {
        into[d * all + sites[ABSOLUTE_POS] as usize] = values[d * count + ABSOLUTE_POS];
    }
}

/// Copies a list.
#[cube(launch_unchecked)]
pub fn copy<F: Float>(from: &[F], into: &mut [F], #[define(F)] _precision: ElemType) {
    if ABSOLUTE_POS < from.len() {
        into[ABSOLUTE_POS] = from[ABSOLUTE_POS];
    }
}
