//! Weights in the order in which the kernel reads them, and the kernel.
//!
//! Outputs stand in panels of [`SimdLanes::PANEL`](super::real::SimdLanes::PANEL); within a panel come all
//! inputs, one row of the panel's width each. A product goes through the inputs once, with the sums of a
//! panel for several columns (a value and its slopes, or several points) in registers, and skips inputs that
//! are 0 in all columns, as many are after a `relu`. Each sum is taken in the order of the inputs, whatever
//! the number of columns: the same bits.

use super::real::{Real, SimdLanes};
use aligned_vec::{AVec, ConstAlign};
use pulp::Simd;
use std::ops::Range;

/// Numbers aligned to cache lines: a vector that lies across two lines costs two loads.
type AlignedVec<T> = AVec<T, ConstAlign<64>>;

/// Largest number of columns of one product: a value and eight slopes.
pub(super) const MOST_COLUMNS: usize = 9;

/// W and b of one layer, packed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PackedMatrix<T> {
    inputs: usize,
    outputs: usize,
    padded: usize,
    weights: AlignedVec<T>,
    bias: AlignedVec<T>,
}

impl<T: Real> PackedMatrix<T> {
    /// W, (outputs, inputs) row by row, and b.
    pub fn new(inputs: usize, weights: &[T], bias: &[T]) -> Self {
        Self::fill(inputs, bias.len(), bias, |k, j| weights[k * inputs + j])
    }

    /// Wᵀ without b: from outputs to inputs.
    pub fn transposed(inputs: usize, outputs: usize, weights: &[T]) -> Self {
        Self::fill(outputs, inputs, &[], |j, k| weights[k * inputs + j])
    }

    fn fill(inputs: usize, outputs: usize, bias: &[T], weight: impl Fn(usize, usize) -> T) -> Self {
        let padded = padded::<T>(outputs);
        let mut weights = zeros(inputs * padded);
        for k in 0..outputs {
            let (panel, lane) = (k / T::PANEL, k % T::PANEL);
            for j in 0..inputs {
                weights[(panel * inputs + j) * T::PANEL + lane] = weight(k, j);
            }
        }
        let mut filled = zeros(padded);
        filled[..bias.len()].copy_from_slice(bias);
        Self { inputs, outputs, padded, weights, bias: filled }
    }

    /// Column j of W: its product with the unit vector j.
    #[inline(always)]
    pub fn column<S: Simd>(&self, j: usize, out: &mut [T]) {
        let (weights, out) = (T::vectors::<S>(&self.weights), T::vectors_mut::<S>(out));
        let in_panel = in_panel::<T, S>();
        for panel in 0..self.padded / T::PANEL {
            let row = &weights[(panel * self.inputs + j) * in_panel..][..in_panel];
            let out = &mut out[panel * in_panel..][..in_panel];
            #[expect(clippy::manual_memcpy, reason = "a call of memcpy costs more than the copy")]
            for r in 0..in_panel {
                out[r] = row[r];
            }
        }
    }

    /// W x + b for each column of x, b only in the first `biased` of them; columns lie `stride` apart, those
    /// of the result as far as the padded number of outputs.
    #[inline(always)]
    pub fn product<S: Simd>(
        &self,
        simd: S,
        active: &[u32],
        (x, stride): (&[T], usize),
        (columns, biased): (usize, usize),
        out: &mut [T],
    ) {
        let all = 0..self.padded / T::PANEL;
        match columns {
            1 => self.columns::<S, 1>(simd, active, x, stride, biased, all, out),
            2..=4 => self.columns::<S, 4>(simd, active, x, stride, biased, all, out),
            5 | 6 => self.columns::<S, 6>(simd, active, x, stride, biased, all, out),
            // sixteen registers: two vectors of outputs for six columns at most, or loads are the limit; two
            // panels after one another, which further columns find in the nearest cache
            _ if in_panel::<T, S>() == 4 => {
                for panel in all.clone().step_by(2) {
                    let pair = panel..all.end.min(panel + 2);
                    let mut first = 0;
                    while first < columns {
                        let (x, out) = (&x[first * stride..], &mut out[first * self.padded..]);
                        let (biased, pair) = (biased.saturating_sub(first), pair.clone());
                        match columns - first {
                            7 => first += self.columns::<S, 6>(simd, active, x, stride, biased, pair, out),
                            4.. => first += self.columns::<S, 4>(simd, active, x, stride, biased, pair, out),
                            _ => first += self.columns::<S, 1>(simd, active, x, stride, biased, pair, out),
                        }
                    }
                }
                columns
            }
            7 => self.columns::<S, 7>(simd, active, x, stride, biased, all, out),
            8 => self.columns::<S, 8>(simd, active, x, stride, biased, all, out),
            _ => self.columns::<S, MOST_COLUMNS>(simd, active, x, stride, biased, all, out),
        };
    }

    /// A product of some panels; the number of columns.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "what `product` was given, and which part of it")]
    fn columns<S: Simd, const COLUMNS: usize>(
        &self,
        simd: S,
        active: &[u32],
        x: &[T],
        stride: usize,
        biased: usize,
        panels: Range<usize>,
        out: &mut [T],
    ) -> usize {
        let mut lists: [&[T]; COLUMNS] = [&[]; COLUMNS];
        for c in 0..COLUMNS {
            lists[c] = &x[c * stride..c * stride + self.inputs];
        }
        let Range { start: mut panel, end: panels } = panels;
        // one column: several panels at a time, to hide the latency of the sums
        if COLUMNS == 1 && in_panel::<T, S>() == 2 {
            while panel + 4 <= panels {
                self.tile::<S, COLUMNS, 4, 2>(simd, active, &lists, biased, (panel, 0), out);
                panel += 4;
            }
            while panel + 2 <= panels {
                self.tile::<S, COLUMNS, 2, 2>(simd, active, &lists, biased, (panel, 0), out);
                panel += 2;
            }
        }
        if COLUMNS == 1 && in_panel::<T, S>() == 4 {
            while panel + 2 <= panels {
                self.tile::<S, COLUMNS, 2, 4>(simd, active, &lists, biased, (panel, 0), out);
                panel += 2;
            }
        }
        for panel in panel..panels {
            match in_panel::<T, S>() {
                // 32 registers hold the sums of a whole panel
                2 => self.tile::<S, COLUMNS, 1, 2>(simd, active, &lists, biased, (panel, 0), out),
                4 if COLUMNS == 1 => {
                    self.tile::<S, COLUMNS, 1, 4>(simd, active, &lists, biased, (panel, 0), out);
                }
                4 if COLUMNS <= 6 => {
                    self.tile::<S, COLUMNS, 1, 2>(simd, active, &lists, biased, (panel, 0), out);
                    self.tile::<S, COLUMNS, 1, 2>(simd, active, &lists, biased, (panel, 2), out);
                }
                places => {
                    for place in 0..places {
                        self.tile::<S, COLUMNS, 1, 1>(simd, active, &lists, biased, (panel, place), out);
                    }
                }
            }
        }
        COLUMNS
    }

    /// `PANELS` panels from number `panel` on, of each `REGISTERS` vectors of outputs from number `place` on.
    #[inline(always)]
    fn tile<S: Simd, const COLUMNS: usize, const PANELS: usize, const REGISTERS: usize>(
        &self,
        simd: S,
        active: &[u32],
        lists: &[&[T]; COLUMNS],
        biased: usize,
        (panel, place): (usize, usize),
        out: &mut [T],
    ) {
        let lanes = size_of::<T::Vector<S>>() / size_of::<T>();
        let (in_panel, registers) = (T::PANEL / lanes, self.padded / lanes);
        let (weights, bias) = (T::vectors::<S>(&self.weights), T::vectors::<S>(&self.bias));
        let zero = T::splat(simd, T::ZERO);
        let mut rows: [&[T::Vector<S>]; PANELS] = [&[]; PANELS];
        let mut sums = [[[zero; REGISTERS]; PANELS]; COLUMNS];
        let at = panel * in_panel + place;
        for p in 0..PANELS {
            let size = self.inputs * in_panel;
            rows[p] = &weights[(panel + p) * size..(panel + p + 1) * size];
            for c in 0..COLUMNS {
                for r in 0..REGISTERS {
                    if c < biased {
                        sums[c][p][r] = bias[at + p * in_panel + r];
                    }
                }
            }
        }
        // vectors of nothing but padding have no sums
        let active = if at * lanes < self.outputs { active } else { &[] };
        for &j in active {
            let j = j as usize;
            let mut weight = [[zero; REGISTERS]; PANELS];
            for p in 0..PANELS {
                let row = &rows[p][j * in_panel + place..][..REGISTERS];
                #[expect(clippy::manual_memcpy, reason = "a call of memcpy costs more than the product")]
                for r in 0..REGISTERS {
                    weight[p][r] = row[r];
                }
            }
            for c in 0..COLUMNS {
                let value = T::splat(simd, lists[c][j]);
                for p in 0..PANELS {
                    for r in 0..REGISTERS {
                        sums[c][p][r] = T::mul_add(simd, weight[p][r], value, sums[c][p][r]);
                    }
                }
            }
        }
        let out = T::vectors_mut::<S>(out);
        for c in 0..COLUMNS {
            for p in 0..PANELS {
                for r in 0..REGISTERS {
                    out[c * registers + at + p * in_panel + r] = sums[c][p][r];
                }
            }
        }
    }
}

/// Vectors in a panel.
#[inline(always)]
const fn in_panel<T: Real, S: Simd>() -> usize {
    T::PANEL * size_of::<T>() / size_of::<T::Vector<S>>()
}

fn zeros<T: Real>(length: usize) -> AlignedVec<T> {
    let mut list = AlignedVec::with_capacity(0, length);
    list.resize(length, T::ZERO);
    list
}

/// Outputs in whole panels.
pub(super) fn padded<T: SimdLanes>(outputs: usize) -> usize {
    outputs.next_multiple_of(T::PANEL)
}
