//! Training examples: single precision, standardised, in batches.

use super::Loss;
use crate::dataset::DataRow;
use crate::surrogate::{Header, Kind, Surrogate};
use burn::tensor::TensorData;

/// Pascals per megapascal.
const MEGAPASCAL: f64 = 1e6;

/// Inputs and targets of some rows.
pub(super) struct Examples {
    inputs: usize,
    /// Inputs, (rows, inputs).
    x: Vec<f32>,
    /// Factors from the gradient of N by its inputs to S in MPa, for an energy: (rows, inputs · 6). For a
    /// polyconvex energy by its invariants, also by those without variance in these rows, which the stress at
    /// rest needs.
    slopes: Vec<f32>,
    /// Targets in units of [`units`], (rows, 6).
    s: Vec<f32>,
    /// Maps from S to the measured stresses ([`DataRow::elimination`]), (rows, 36); empty if all rows have
    /// full stresses.
    maps: Vec<f32>,
    /// Variances of the components of S, MPa².
    variances: [f64; 6],
}

/// Batch of rows as tensors.
pub(super) struct Batch {
    pub rows: usize,
    pub x: TensorData,
    pub slopes: Option<TensorData>,
    pub s: TensorData,
    pub maps: Option<TensorData>,
}

/// Returns factor and offset from the outputs of a network to S in MPa.
pub(super) fn units(header: &Header) -> ([f64; 6], [f64; 6]) {
    let (mut unit, mut mean) = ([1.0; 6], [0.0; 6]);
    if header.kind == Kind::Ann {
        for a in 0..6 {
            unit[a] = header.output_deviation[a] / MEGAPASCAL;
            mean[a] = header.output_mean[a] / MEGAPASCAL;
        }
    }
    (unit, mean)
}

/// Returns the factors of S in MPa = Σ_k slopes[k] ∂N/∂x_k, before the correction at the identity: (inputs ·
/// 6), in f32.
pub(super) fn scaled_slopes(law: &Surrogate<f64>, slopes: &[[f64; 6]]) -> Vec<f32> {
    let scale = law.header().output_deviation[0] / MEGAPASCAL;
    // S_ii = 2 ∂W/∂C_ii, S_12 = ∂W/∂C_12 with C_12 not doubled
    let factor = |a: usize| if a < 3 { 2.0 } else { 1.0 };
    let row = |(slope, input): (&[f64; 6], &f64)| {
        let input = if law.header().kind.is_polyconvex() { 1.0 } else { *input };
        [0, 1, 2, 3, 4, 5].map(|a| (factor(a) * scale * (slope[a] * input)) as f32)
    };
    slopes.iter().zip(law.coefficients().inverse).flat_map(row).collect()
}

impl Examples {
    pub fn new(law: &Surrogate<f64>, rows: &[&DataRow]) -> Self {
        let inputs = law.header().kind.inputs();
        let (unit, mean) = units(law.header());
        let energetic = law.header().kind != Kind::Ann;
        let mut examples = Self {
            inputs,
            x: Vec::new(),
            slopes: Vec::new(),
            s: Vec::new(),
            maps: Vec::new(),
            variances: [0.0; 6],
        };
        let nominal = rows.iter().any(|row| row.nominal.is_some());
        let whole = std::array::from_fn(|a| std::array::from_fn(|b| if a == b { 1.0 } else { 0.0 }));
        let measured: Vec<_> = rows.iter().map(|row| row.compared(&row.s)[0]).collect();
        for (row, measured) in rows.iter().zip(&measured) {
            let features = law.features(&row.c);
            examples.x.extend(features.values[..inputs].iter().map(|value| *value as f32));
            if energetic {
                examples.slopes.extend(scaled_slopes(law, &features.slopes[..inputs]));
            }
            for a in 0..6 {
                let target = measured[a] / MEGAPASCAL - mean[a];
                // constant components have no unit and are not trained
                examples.s.push(if unit[a] > 0.0 { (target / unit[a]) as f32 } else { 0.0 });
            }
            if nominal {
                let map: [[f64; 6]; 6] = row.elimination().unwrap_or(whole);
                examples.maps.extend(map.as_flattened().iter().map(|weight| *weight as f32));
            }
        }
        for (a, variance) in examples.variances.iter_mut().enumerate() {
            let count = rows.len() as f64;
            let mean = measured.iter().map(|row| row[a] / MEGAPASCAL).sum::<f64>() / count;
            *variance = measured.iter().map(|row| (row[a] / MEGAPASCAL - mean).powi(2)).sum::<f64>() / count;
        }
        examples
    }

    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        self.s.len() / 6
    }

    /// Returns the weight of the squared error of each component, 1/MPa², in the loss.
    pub fn weights(&self, loss: Loss) -> [f64; 6] {
        match loss {
            Loss::Stress => [1.0; 6],
            Loss::Scaled => self.variances.map(|variance| if variance > 0.0 { 1.0 / variance } else { 1.0 }),
        }
    }

    /// Returns a batch of rows by number.
    pub fn batch(&self, rows: &[usize]) -> Batch {
        let gather = |from: &[f32], width: usize| {
            let mut data = Vec::with_capacity(rows.len() * width);
            for &row in rows {
                data.extend_from_slice(&from[row * width..(row + 1) * width]);
            }
            data
        };
        let count = rows.len();
        Batch {
            rows: count,
            x: TensorData::new(gather(&self.x, self.inputs), [count, self.inputs]),
            slopes: (!self.slopes.is_empty())
                .then(|| TensorData::new(gather(&self.slopes, 6 * self.inputs), [count, self.inputs, 6])),
            s: TensorData::new(gather(&self.s, 6), [count, 6]),
            maps: (!self.maps.is_empty()).then(|| TensorData::new(gather(&self.maps, 36), [count, 6, 6])),
        }
    }
}
