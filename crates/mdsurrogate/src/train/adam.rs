//! The optimizer Adam on one list of parameters.

use super::model::ParameterGradients;
use super::parameters::ParameterLayout;
use serde::{Deserialize, Serialize};

/// Decay rates of the means of gradients and of their squares.
const BETAS: [f64; 2] = [0.9, 0.999];
/// ε of Keras, as in the thesis.
const EPSILON: f32 = 1e-7;

/// Adam, Algorithm 1 of Kingma & Ba 2015 (<https://arxiv.org/abs/1412.6980>), in one pass over the
/// parameters.
///
/// It replaces burn's Adam because its three lists are most of a checkpoint, and because burn needs a dozen
/// tensor operations for each weight and bias.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Adam {
    first: Vec<f32>,
    second: Vec<f32>,
    steps: u64,
}

impl Adam {
    pub fn new(parameters: usize) -> Self {
        Self { first: vec![0.0; parameters], second: vec![0.0; parameters], steps: 0 }
    }

    pub fn len(&self) -> usize {
        self.first.len().min(self.second.len())
    }

    /// Updates θ ← θ − η m̂/(√v̂ + ε) with m̂ = m/(1 − β₁ᵗ), v̂ = v/(1 − β₂ᵗ).
    pub fn step(
        &mut self,
        rate: f64,
        parameters: &mut [f32],
        layout: &ParameterLayout,
        gradients: &ParameterGradients,
    ) {
        self.steps += 1;
        let unbiased = |beta: f64| 1.0 - beta.powf(self.steps as f64);
        let rate = (rate / unbiased(BETAS[0])) as f32;
        let scale = (1.0 / unbiased(BETAS[1])) as f32;
        for l in 0..layout.shapes.len() {
            let [weights, bias] = &gradients.layers[l];
            for (range, gradient) in [(layout.weights(l), weights), (layout.bias(l), bias)] {
                let (first, second) = (&mut self.first[range.clone()], &mut self.second[range.clone()]);
                update(rate, scale, &mut parameters[range], first, second, gradient);
            }
        }
    }
}

fn update(rate: f32, scale: f32, theta: &mut [f32], m: &mut [f32], v: &mut [f32], g: &[f32]) {
    let [beta_1, beta_2] = BETAS.map(|beta| beta as f32);
    let count = theta.len();
    let (m, v, g) = (&mut m[..count], &mut v[..count], &g[..count]);
    for i in 0..count {
        m[i] = beta_1 * m[i] + (1.0 - beta_1) * g[i];
        v[i] = beta_2 * v[i] + (1.0 - beta_2) * (g[i] * g[i]);
        theta[i] -= rate * m[i] / ((v[i] * scale).sqrt() + EPSILON);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::{Activation, Architecture};
    use burn::optim::{AdamConfig, Optimizer};
    use burn::tensor::{Device, Tensor, TensorData};

    /// The steps agree with those of burn's Adam.
    #[test]
    fn steps_agree_with_burn() {
        let layout = ParameterLayout::new(&Architecture::new(3, &[], 2));
        assert_eq!(Architecture::new(3, &[], 2).activations, [Activation::Linear]);
        let mut ours: Vec<f32> = (0..8).map(|i| 0.3 * i as f32 - 1.0).collect();
        let device = Device::flex();
        let mut theirs = Tensor::<1>::from_data(TensorData::new(ours.clone(), [8]), &device);
        let (mut adam, mut state) = (Adam::new(8), None);
        let burn = AdamConfig::new().with_epsilon(EPSILON).build();
        for step in 0..50 {
            let gradient: Vec<f32> =
                (0..8).map(|i| ((i * 7 + step) as f32).sin() * 10f32.powi(i - 4)).collect();
            let gradients =
                ParameterGradients { layers: vec![[gradient[..6].to_vec(), gradient[6..].to_vec()]] };
            adam.step(0.01, &mut ours, &layout, &gradients);
            let given = Tensor::<1>::from_data(TensorData::new(gradient, [8]), &device);
            (theirs, state) = burn.step(0.01, theirs, given, state);
        }
        let theirs = theirs.into_data().try_into_vec::<f32>().unwrap();
        for (a, b) in ours.iter().zip(&theirs) {
            // fifty steps of at most 0.01, each with a few roundings of 6e-8 of numbers up to 1.5
            assert!((a - b).abs() < 1e-5, "{a} {b}");
        }
        assert!(ours.iter().enumerate().all(|(i, w)| (w - (0.3 * i as f32 - 1.0)).abs() > 1e-3));
    }
}
