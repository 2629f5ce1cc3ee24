//! Networks in tensors of burn: prediction, loss and its gradients.

use super::dataset::{Batch, scaled_slopes, units};
use super::parameters::ParameterLayout;
use crate::Error;
use crate::network::Activation;
use crate::surrogate::{Kind, StressAtRest, Surrogate, Symmetry, SymmetryInvariants};
use burn::tensor::{Device, Tensor, TensorData, activation};
use polycore::tensor::Voigt;

/// Networks of a law, without their weights.
pub(super) struct Model {
    activations: Vec<Activation>,
    /// Correction of an energy at C = I.
    rest: Option<RestState>,
    /// Squares of the units of the outputs, MPa².
    unit_squares: [f64; 6],
    /// Weight of the squared error of each component, 1/MPa².
    weights: [f64; 6],
    device: Device,
    tracking: Device,
}

/// Correction that makes the stress of an energy vanish at C = I.
struct RestState {
    /// Inputs at C = I.
    x: TensorData,
    taken: RestCorrection,
}

/// Kind of correction.
enum RestCorrection {
    /// Subtracts S(I) = Σ_k ∂N/∂x_k · slopes_k, with the slopes at I: (1, inputs, 6).
    Stress(TensorData),
    /// Adds multiples of the invariants, see `Surrogate::rest_of`.
    Polyconvex(Box<Polyconvex>),
}

/// Matrices from ∂N/∂x at I, with the invariants x, to the multiples of the invariants that are added to W.
struct Polyconvex {
    /// Factors from the derivative by an input to that by an invariant, (1, inputs).
    scales: TensorData,
    /// Parts s of S(I) along directions, (inputs, 3).
    along: TensorData,
    /// Corrections for a negative and for a positive s, (3, inputs).
    negative: TensorData,
    positive: TensorData,
    /// Correction of the pressure at I, (inputs, inputs).
    spherical: TensorData,
}

impl Polyconvex {
    /// Creates the matrices, in units in which the energy is Σ_k weight_k x_k.
    fn new(law: &Surrogate<f64>, symmetry: Symmetry, invariants: SymmetryInvariants) -> Self {
        let inputs = invariants.count();
        let StressAtRest { spherical, along } = symmetry.stress_at_rest();
        let identity = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
        // S_ii = 2 Σ_k ∂W/∂x_k ∂x_k/∂C_ii
        let part = |k: usize, direction: [f64; 3]| {
            let slope = invariants.gradient(&identity, k);
            (0..3).map(|i| 2.0 * slope[i] * direction[i]).sum::<f64>()
        };
        let (mut parts, mut pressure) = (vec![0.0; 3 * inputs], vec![0.0; inputs * inputs]);
        let (mut negative, mut positive) = (vec![0.0; 3 * inputs], vec![0.0; 3 * inputs]);
        for k in 0..inputs {
            pressure[(k + 1) * inputs - 1] = -part(k, spherical);
        }
        for (d, &(direction, plain, cofactor)) in along.iter().enumerate() {
            for k in 0..inputs {
                parts[3 * k + d] = part(k, direction);
            }
            negative[d * inputs + plain] = 0.5;
            positive[d * inputs + cofactor] = 0.5;
            positive[(d + 1) * inputs - 1] = -1.0;
        }
        let data = |values: &[f64], shape: [usize; 2]| {
            TensorData::new(values.iter().map(|value| *value as f32).collect::<Vec<f32>>(), shape)
        };
        Self {
            scales: data(law.coefficients().inverse, [1, inputs]),
            along: data(&parts, [inputs, 3]),
            negative: data(&negative, [3, inputs]),
            positive: data(&positive, [3, inputs]),
            spherical: data(&pressure, [inputs, inputs]),
        }
    }

    /// Computes ∂W/∂x by the invariants from ∂N/∂x by the inputs, (rows, inputs), and the same at I, (1,
    /// inputs).
    fn corrected(&self, gradient: Tensor<2>, at_rest: Tensor<2>, device: &Device) -> Tensor<2> {
        let tensor = |data: &TensorData| Tensor::<2>::from_data(data.clone(), device);
        let at_rest = at_rest * tensor(&self.scales);
        let along = at_rest.clone().matmul(tensor(&self.along));
        let added = activation::relu(-along.clone()).matmul(tensor(&self.negative))
            + activation::relu(along).matmul(tensor(&self.positive))
            + at_rest.matmul(tensor(&self.spherical));
        gradient * tensor(&self.scales) + added
    }
}

/// Parameters of a layer as tensors: (inputs, outputs) and (1, outputs).
struct Tensors {
    weights: Tensor<2>,
    bias: Tensor<2>,
}

/// Derivatives of the loss by all parameters: weights and biases of each layer.
pub(super) struct ParameterGradients {
    pub layers: Vec<[Vec<f32>; 2]>,
}

/// Results of a batch.
pub(super) struct BatchResult {
    /// Loss that is minimised.
    pub loss: f64,
    /// Squared error of each component, MPa², summed over the rows.
    pub squares: [f64; 6],
    pub gradients: ParameterGradients,
}

impl Model {
    /// Creates the model of a law; `weights` weigh the squared errors of the components.
    ///
    /// # Errors
    /// Returns [`Error::Parameter`] for an energy of ReLU.
    pub fn new(law: &Surrogate<f64>, weights: &[f64; 6]) -> Result<Self, Error> {
        let header = law.header();
        let activations = header.architecture.activations.clone();
        let rest = match (&header.kind, header.kind.invariants()) {
            (Kind::Energy { symmetry, polyconvex, .. }, Some(invariants)) => {
                if activations.contains(&Activation::Relu) {
                    let allowed = "softplus, tanh, sigmoid, silu or elu (with a continuous derivative)";
                    return Err(Error::parameter("activation of an energy", "relu", allowed));
                }
                let at = law.features(&Voigt::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0));
                let inputs = header.kind.inputs();
                let values: Vec<f32> = at.values[..inputs].iter().map(|value| *value as f32).collect();
                let taken = match polyconvex {
                    true => RestCorrection::Polyconvex(Box::new(Polyconvex::new(law, *symmetry, invariants))),
                    false => {
                        let slopes = scaled_slopes(law, &at.slopes[..inputs]);
                        RestCorrection::Stress(TensorData::new(slopes, [1, inputs, 6]))
                    }
                };
                Some(RestState { x: TensorData::new(values, [1, inputs]), taken })
            }
            _ => None,
        };
        let device = Device::flex();
        Ok(Self {
            activations,
            rest,
            unit_squares: units(header).0.map(|unit| unit * unit),
            weights: *weights,
            tracking: device.clone().autodiff(),
            device,
        })
    }

    /// Computes the loss from mean squared errors in MPa².
    pub fn loss(&self, squares: &[f64; 6]) -> f64 {
        squares.iter().zip(&self.weights).map(|(square, weight)| square * weight).sum()
    }

    /// Computes loss and gradients of a batch.
    pub fn step(&self, layout: &ParameterLayout, parameters: &[f32], batch: &Batch) -> BatchResult {
        let layers: Vec<Tensors> = tensors(layout, parameters, &self.tracking)
            .into_iter()
            .map(|layer| Tensors { weights: layer.weights.require_grad(), bias: layer.bias.require_grad() })
            .collect();
        let squares = self.squared_errors(&layers, batch, &self.tracking);
        let each = numbers(squares.clone().inner());
        // (3.12): sum over components, mean over rows
        let weight = |a: usize| (self.weights[a] * self.unit_squares[a] / batch.rows as f64) as f32;
        let weights = TensorData::new([0, 1, 2, 3, 4, 5].map(weight).to_vec(), [1, 6]);
        let loss = (squares * Tensor::from_data(weights, &self.tracking)).sum();
        let mut gradients = loss.backward();
        let mut taken = |tensor: &Tensor<2>, length: usize| match tensor.grad_remove(&mut gradients) {
            Some(gradient) => numbers(gradient),
            // the stress does not depend on the last bias of an energy
            None => vec![0.0; length],
        };
        let layers = layers.iter().enumerate().map(|(l, layer)| {
            [taken(&layer.weights, layout.weights(l).len()), taken(&layer.bias, layout.bias(l).len())]
        });
        let gradients = ParameterGradients { layers: layers.collect() };
        let squares = self.in_megapascal(&each);
        let mean = squares.map(|square| square / batch.rows as f64);
        BatchResult { loss: self.loss(&mean), squares, gradients }
    }

    /// Computes the squared error of each component, MPa², summed over the rows.
    pub fn squares(&self, layout: &ParameterLayout, parameters: &[f32], batch: &Batch) -> [f64; 6] {
        let layers = tensors(layout, parameters, &self.device);
        self.in_megapascal(&numbers(self.squared_errors(&layers, batch, &self.device)))
    }

    fn in_megapascal(&self, squares: &[f32]) -> [f64; 6] {
        let mut result = [0.0; 6];
        for a in 0..6 {
            result[a] = f64::from(squares[a]) * self.unit_squares[a];
        }
        result
    }

    /// Computes the squared error of each component, summed over the rows, in units of the outputs: (1, 6).
    fn squared_errors(&self, layers: &[Tensors], batch: &Batch, device: &Device) -> Tensor<2> {
        let tensor = |data: &TensorData| Tensor::<2>::from_data(data.clone(), device);
        let outputs = match (&self.rest, &batch.slopes) {
            (Some(rest), Some(slopes)) => {
                // Σ_k ∂N/∂x_k · slopes_k
                let stress = |gradient: Tensor<2>, slopes: &TensorData| {
                    let slopes = Tensor::<3>::from_data(slopes.clone(), device);
                    (gradient.unsqueeze_dim::<3>(2) * slopes).sum_dim(1).squeeze_dim::<2>(1)
                };
                let gradient = self.input_gradient(layers, tensor(&batch.x));
                let at_rest = self.input_gradient(layers, tensor(&rest.x));
                match &rest.taken {
                    RestCorrection::Stress(slopes_at_rest) => {
                        stress(gradient, slopes) - stress(at_rest, slopes_at_rest)
                    }
                    RestCorrection::Polyconvex(part) => {
                        stress(part.corrected(gradient, at_rest, device), slopes)
                    }
                }
            }
            _ => self.forward(layers, tensor(&batch.x)),
        };
        let outputs = match &batch.maps {
            Some(maps) => {
                let maps = Tensor::<3>::from_data(maps.clone(), device);
                (outputs.unsqueeze_dim::<3>(1) * maps).sum_dim(2).squeeze_dim::<2>(2)
            }
            None => outputs,
        };
        let error = outputs - tensor(&batch.s);
        (error.clone() * error).sum_dim(0)
    }

    /// Computes N(x), row by row.
    fn forward(&self, layers: &[Tensors], x: Tensor<2>) -> Tensor<2> {
        let mut y = x;
        for (layer, kind) in layers.iter().zip(&self.activations) {
            let sums = y.matmul(layer.weights.clone()) + layer.bias.clone();
            y = match kind {
                Activation::Linear => sums,
                _ => ActivatedLayer::new(*kind, sums, 0).derivative(0),
            };
        }
        y
    }

    /// Computes ∂N/∂x of the first output, row by row, in explicit tensor operations: reverse mode through
    /// the layers, because burn differentiates once, and the loss uses that.
    fn input_gradient(&self, layers: &[Tensors], x: Tensor<2>) -> Tensor<2> {
        let last = layers.len() - 1;
        let mut slopes = Vec::with_capacity(last);
        let mut y = x;
        for (l, (layer, kind)) in layers[..last].iter().zip(&self.activations).enumerate() {
            let sums = y.clone().matmul(layer.weights.clone()) + layer.bias.clone();
            let activated = ActivatedLayer::new(*kind, sums, 1);
            slopes.push(activated.derivative(1));
            if l + 1 < last {
                y = activated.derivative(0);
            }
        }
        let rows = y.dims()[0];
        // (outputs, inputs) of the last layer: one row for all rows
        let mut adjoint = layers[last].weights.clone().transpose();
        if last == 0 {
            adjoint = adjoint.expand([rows, layers[0].weights.dims()[0]]);
        }
        for (layer, slope) in layers[..last].iter().zip(slopes).rev() {
            adjoint = (slope * adjoint).matmul(layer.weights.clone().transpose());
        }
        adjoint
    }
}

fn tensors(layout: &ParameterLayout, parameters: &[f32], device: &Device) -> Vec<Tensors> {
    let tensor = |range: std::ops::Range<usize>, shape: [usize; 2]| {
        Tensor::from_data(TensorData::new(parameters[range].to_vec(), shape), device)
    };
    let layer = |(l, [inputs, outputs]): (usize, &[usize; 2])| Tensors {
        weights: tensor(layout.weights(l), [*inputs, *outputs]),
        bias: tensor(layout.bias(l), [1, *outputs]),
    };
    layout.shapes.iter().enumerate().map(layer).collect()
}

/// Returns the numbers of a tensor of f32.
fn numbers(tensor: Tensor<2>) -> Vec<f32> {
    // all tensors here are f32
    tensor.into_data().try_into_vec::<f32>().unwrap_or_default()
}

/// Activation of a layer at its sums a. Its derivatives come from [`Activation::evaluate`], as burn computes
/// exponentials and logarithms one at a time.
struct ActivatedLayer {
    sums: Tensor<2>,
    /// Entries of σ, σ′ and σ″, as far as they were asked for.
    derivatives: [Vec<f32>; 3],
}

impl ActivatedLayer {
    /// Evaluates the derivatives of order 0 to `highest` and, for their gradients, one more.
    fn new(kind: Activation, sums: Tensor<2>, highest: usize) -> Self {
        let a = numbers(sums.clone().detach());
        let list = |order: usize| vec![0.0; if order <= highest + 1 { a.len() } else { 0 }];
        let [mut values, mut first, mut second] = [0, 1, 2].map(list);
        kind.evaluate(&a, &mut values, &mut first, &mut second);
        Self { sums, derivatives: [values, first, second] }
    }

    /// Returns the derivative f = σ⁽ᵒʳᵈᵉʳ⁾(a), tracked as f(a₀) + f′(a₀)·(a − a₀) with constants at a₀ = a,
    /// which has its value and its gradient.
    fn derivative(&self, order: usize) -> Tensor<2> {
        let (shape, device) = (self.sums.dims(), self.sums.device());
        let constant =
            |entries: &[f32]| Tensor::<2>::from_data(TensorData::new(entries.to_vec(), shape), &device);
        let change = self.sums.clone() - self.sums.clone().detach();
        change * constant(&self.derivatives[order + 1]) + constant(&self.derivatives[order])
    }
}
