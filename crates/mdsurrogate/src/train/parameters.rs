//! All weights and biases of a network as one list of f32, in the order of burn's layers.

use crate::Error;
use crate::network::{Architecture, Layer, Network};
use crate::surrogate::Kind;
use std::ops::Range;

/// Positions of the parts of each layer in the list: weights (inputs, outputs), then biases.
#[derive(Debug, Clone)]
pub(super) struct ParameterLayout {
    /// Inputs and outputs of each layer.
    pub shapes: Vec<[usize; 2]>,
    starts: Vec<usize>,
}

impl ParameterLayout {
    pub fn new(architecture: &Architecture) -> Self {
        let shapes: Vec<[usize; 2]> = architecture.widths.windows(2).map(|pair| [pair[0], pair[1]]).collect();
        let mut starts = vec![0];
        for [inputs, outputs] in &shapes {
            starts.push(starts[starts.len() - 1] + (inputs + 1) * outputs);
        }
        Self { shapes, starts }
    }

    /// Returns the number of parameters.
    pub fn len(&self) -> usize {
        self.starts[self.shapes.len()]
    }

    pub fn weights(&self, layer: usize) -> Range<usize> {
        let [inputs, outputs] = self.shapes[layer];
        self.starts[layer]..self.starts[layer] + inputs * outputs
    }

    pub fn bias(&self, layer: usize) -> Range<usize> {
        self.weights(layer).end..self.starts[layer + 1]
    }

    /// Returns the parameters of a network, rounded to f32.
    pub fn flat(&self, network: &Network<f64>) -> Vec<f32> {
        let mut flat = Vec::with_capacity(self.len());
        for (layer, [inputs, outputs]) in network.layers().iter().zip(&self.shapes) {
            for i in 0..*inputs {
                flat.extend((0..*outputs).map(|o| layer.weights[o * inputs + i] as f32));
            }
            flat.extend(layer.bias.iter().map(|bias| *bias as f32));
        }
        flat
    }

    /// Sets negative weights to 0 if they must not be negative ([`Kind::non_negative`]); keeps NaN, so that
    /// it is detected.
    pub fn project(&self, kind: &Kind, flat: &mut [f32]) {
        if !kind.is_polyconvex() {
            return;
        }
        for (l, [inputs, outputs]) in self.shapes.iter().enumerate() {
            for (i, row) in flat[self.weights(l)].chunks_mut(*outputs).enumerate().take(*inputs) {
                if kind.non_negative(l, i) {
                    for weight in row {
                        *weight = if *weight < 0.0 { 0.0 } else { *weight };
                    }
                }
            }
        }
    }

    /// Creates the network with these parameters, bit by bit.
    pub fn network(&self, architecture: &Architecture, flat: &[f32]) -> Result<Network<f64>, Error> {
        if flat.len() != self.len() {
            return Err(Error::parameter("parameters", flat.len(), format!("{}", self.len())));
        }
        let layer = |l: usize| {
            let [inputs, outputs] = self.shapes[l];
            let (weights, bias) = (&flat[self.weights(l)], &flat[self.bias(l)]);
            let mut transposed = Vec::with_capacity(weights.len());
            for o in 0..outputs {
                transposed.extend((0..inputs).map(|i| f64::from(weights[i * outputs + o])));
            }
            let bias = bias.iter().copied().map(f64::from).collect();
            Layer { weights: transposed, bias, activation: architecture.activations[l] }
        };
        Ok(Network::new(architecture.clone(), (0..self.shapes.len()).map(layer).collect())?)
    }
}
