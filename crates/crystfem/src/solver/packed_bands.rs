//! Packed matrix of rows that are stored by diagonals: the upper half in single precision, and the diagonal
//! with the rounding errors of both halves, as in [`super::packed`].

use crate::system::bands::{BandLayout, BandPiece, Bands, TILE};
use crate::system::vector::{CHUNK, dot_simd};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// Number of rows side by side.
const LANES: usize = 8;

/// Upper half of a combination of M and K.
#[derive(Default)]
pub(super) struct PackedBands {
    /// Places of the entries, without distance 0.
    layout: BandLayout,
    /// Diagonal plus the rounding errors of the other entries.
    core: Vec<f64>,
    values: Vec<f32>,
}

impl PackedBands {
    /// Packs `weights[0]`·M + `weights[1]`·K.
    pub fn pack(&mut self, bands: &Bands, weights: [f64; 2]) {
        let BandLayout { size, distances } = &bands.layout;
        self.layout = BandLayout { size: *size, distances: distances[1..].to_vec() };
        let Self { layout, core, values } = self;
        let count = layout.distances.len();
        values.resize(layout.places(), 0.0);
        values.par_chunks_mut((TILE * count).max(1)).enumerate().for_each(|(tile, values)| {
            for (band, values) in (1..).zip(values.chunks_exact_mut(TILE)) {
                for (row, value) in (tile * TILE..*size).zip(values) {
                    *value = bands.value(band, row, weights) as f32;
                }
            }
        });
        core.resize(*size, 0.0);
        core.par_chunks_mut(CHUNK).enumerate().for_each(|(item, core)| {
            for (row, core) in (item * CHUNK..).zip(core) {
                *core = bands.value(0, row, weights);
                for (band, distance) in layout.distances.iter().enumerate() {
                    for row in [Some(row), row.checked_sub(*distance)].into_iter().flatten() {
                        let exact = bands.value(band + 1, row, weights);
                        *core += exact - f64::from(values[layout.entry_index(band, row)]);
                    }
                }
            }
        });
    }
}

/// Product y = (diagonal + `factor`·A) x of the rows from `first` on; returns x·y.
pub(super) struct PackedBandProduct<'a> {
    pub packed: &'a PackedBands,
    pub diagonal: Option<&'a [f64]>,
    pub factor: f64,
    pub x: &'a [f64],
    pub y: &'a mut [f64],
    pub first: usize,
}

impl WithSimd for PackedBandProduct<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { packed, diagonal, factor, x, y, first } = self;
        let PackedBands { layout, core, values } = packed;
        for (tile, y) in y.chunks_mut(TILE).enumerate() {
            let start = first + tile * TILE;
            let rows = start..start + y.len();
            let own = core[rows.clone()].iter().zip(&x[rows.clone()]);
            y.iter_mut().zip(own).for_each(|(y, (core, x))| *y = core * x);
            for band in 0..layout.distances.len() {
                for piece in layout.pieces(band, &rows).into_iter().flatten() {
                    let BandPiece { at, begin, length, column } = piece;
                    let (values, other) = (&values[at..][..length], &x[column..][..length]);
                    add_band(simd, values, other, &mut y[begin..][..length]);
                }
            }
            match diagonal.map(|diagonal| &diagonal[rows.clone()]) {
                Some(diagonal) => {
                    let terms = diagonal.iter().zip(&x[rows]);
                    y.iter_mut().zip(terms).for_each(|(y, (d, x))| *y = factor * *y + d * x);
                }
                None if factor != 1.0 => y.iter_mut().for_each(|y| *y *= factor),
                None => {}
            }
        }
        dot_simd(simd, &x[first..first + y.len()], y)
    }
}

/// Adds entries of a band times entries of a vector to y.
#[inline(always)]
fn add_band<S: Simd>(simd: S, values: &[f32], x: &[f64], y: &mut [f64]) {
    let ((values, last_values), (x, last_x)) = (values.as_chunks::<LANES>(), x.as_chunks::<LANES>());
    let (y, last_y) = y.as_chunks_mut::<LANES>();
    for ((value, x), y) in values.iter().zip(x).zip(y) {
        let mut wide = [0.0; LANES];
        for lane in 0..LANES {
            wide[lane] = f64::from(value[lane]);
        }
        let ((value, _), (x, _)) = (S::as_simd_f64s(&wide), S::as_simd_f64s(x));
        let (y, _) = S::as_mut_simd_f64s(y);
        for v in 0..y.len() {
            y[v] = simd.mul_add_f64s(value[v], x[v], y[v]);
        }
    }
    for ((value, x), y) in last_values.iter().zip(last_x).zip(last_y) {
        *y += f64::from(*value) * x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Products on a grid of 90 × 70 with unequal entries agree with f64 to the rounding of f32, and on
    /// uniform vectors to that of f64; with lumped and consistent capacity.
    #[test]
    fn products_of_grids() {
        let (width, height) = (90, 70);
        let size = width * height;
        let across = (0..size).filter(|k| k % width + 1 < width).map(|k| [k, k + 1]);
        let along = (0..size - width).map(|k| [k, k + width]);
        let pairs: Vec<[usize; 2]> = across.chain(along).collect();
        let list = |pair: &[usize; 2], out: &mut Vec<u32>| out.extend(pair.map(|k| k as u32));
        let mut bands = Bands::find(size, true, pairs.iter(), list).unwrap();
        for &[one, other] in &pairs {
            let value = 1.0 + 0.5 * ((one + 3 * other) as f64).sin();
            bands.add(one, other, -value, 0.1 * value);
            // below the diagonal: without effect
            bands.add(other, one, 1e9, 1e9);
            [one, other].into_iter().for_each(|row| bands.add(row, row, value, 0.2 * value));
        }
        let diagonal: Vec<f64> = (0..size).map(|k| 1e-3 * (k as f64).cos().abs()).collect();
        let (x, one) = ((0..size).map(|k| (k as f64).sin()).collect::<Vec<_>>(), vec![1.0; size]);
        for (weights, diagonal, factor) in [([0.0, 1.0], Some(&diagonal), 50.0), ([1.0, 50.0], None, 1.0)] {
            let mut packed = PackedBands::default();
            packed.pack(&bands, weights);
            for (x, rounding) in [(&x, 4.0 * f64::from(f32::EPSILON)), (&one, 1e-15)] {
                let (mut dot, mut plain) = (0.0, 0.0);
                let mut found = vec![0.0; size];
                for (item, y) in found.chunks_mut(CHUNK).enumerate() {
                    let diagonal = diagonal.map(|diagonal| &diagonal[..]);
                    let first = item * CHUNK;
                    let product = PackedBandProduct { packed: &packed, diagonal, factor, x, y, first };
                    dot += pulp::Arch::new().dispatch(product);
                }
                let scale = 50.0 * 8.0;
                for row in 0..size {
                    let sum: f64 = bands.row(row, weights).map(|(column, value)| value * x[column]).sum();
                    let exact = factor * sum + diagonal.map_or(0.0, |diagonal| diagonal[row] * x[row]);
                    assert!((found[row] - exact).abs() <= rounding * scale, "{row}: {} {exact}", found[row]);
                    plain += x[row] * exact;
                }
                assert!((dot - plain).abs() <= rounding * scale * size as f64);
            }
        }
    }
}
