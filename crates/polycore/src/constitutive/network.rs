//! Fully connected networks without a framework: value, Jacobian, gradient and second derivatives, in f64 or
//! f32.

use crate::constitutive::Error;
use crate::random::SplitMix64;
use serde::{Deserialize, Serialize};

mod activation;
mod packed;
mod pass;
mod real;

pub(super) use pass::BATCH;

pub use activation::Activation;
pub use pass::Tape;
pub use real::Real;

use packed::PackedMatrix;
use pass::PassOutput;

/// Largest number of inputs of a network with derivatives: the lanes of one row of a Jacobian.
pub const LANES: usize = 8;

/// Largest number of neurons in a layer: a file with more is damaged.
pub const MOST_NEURONS: usize = 1 << 16;

/// Widths from input to output, and the activation of each layer after the input.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Architecture {
    /// Neurons of each layer, the inputs first.
    pub widths: Vec<usize>,
    /// Activation of each layer after the input.
    pub activations: Vec<Activation>,
}

impl Architecture {
    /// Returns network 1 to 4 of Table 3.4: six inputs, six linear outputs.
    ///
    /// # Errors
    /// [`Error::Invalid`] for another number.
    pub fn thesis(number: usize) -> Result<Self, Error> {
        use Activation::{Relu as R, Softplus as S};
        let hidden: &[(usize, Activation)] = match number {
            1 => &[(192, R), (32, S), (32, R), (64, R), (128, R)],
            2 => &[(64, R), (32, S), (256, S), (32, R), (64, R)],
            3 => &[(160, R), (64, S), (32, R), (128, S)],
            4 => &[(224, R), (96, S), (64, R), (96, S)],
            _ => return Err(Error::invalid("network of Table 3.4", number, "1 to 4")),
        };
        Ok(Self::new(6, hidden, 6))
    }

    /// Creates hidden layers between inputs and linear outputs.
    pub fn new(inputs: usize, hidden: &[(usize, Activation)], outputs: usize) -> Self {
        let mut widths = vec![inputs];
        widths.extend(hidden.iter().map(|(width, _)| *width));
        widths.push(outputs);
        let mut activations: Vec<Activation> = hidden.iter().map(|(_, activation)| *activation).collect();
        activations.push(Activation::Linear);
        Self { widths, activations }
    }

    /// Number of weights and biases.
    pub fn parameters(&self) -> usize {
        self.widths.windows(2).map(|pair| (pair[0] + 1) * pair[1]).sum()
    }

    /// Checks the widths and activations.
    ///
    /// # Errors
    /// [`Error::Invalid`] for no layer, an empty or absurdly wide one, or another number of activations.
    pub fn check(&self) -> Result<(), Error> {
        let Self { widths, activations } = self;
        if widths.len() < 2 || widths.len() > 1000 || activations.len() + 1 != widths.len() {
            let found = format!("{} widths and {} activations", widths.len(), activations.len());
            return Err(Error::invalid("network", found, "2 to 1000 widths, and one activation less"));
        }
        match widths.iter().find(|width| !(1..=MOST_NEURONS).contains(*width)) {
            Some(width) => Err(Error::invalid("width of a layer", width, "1 to 65,536")),
            None => Ok(()),
        }
    }
}

/// Layer of a network: activation(W x + b).
#[derive(Debug, Clone, PartialEq)]
pub struct Layer<T> {
    /// W, (outputs, inputs), row by row.
    pub weights: Vec<T>,
    /// b, (outputs).
    pub bias: Vec<T>,
    /// Activation applied to the sum.
    pub activation: Activation,
}

/// Multilayer perceptron (3.9).
#[derive(Debug, Clone, PartialEq)]
pub struct Network<T> {
    architecture: Architecture,
    layers: Vec<Layer<T>>,
    packed: Vec<PackedMatrix<T>>,
    transposed: Vec<PackedMatrix<T>>,
}

impl<T: Real> Network<T> {
    /// Creates a network of these layers.
    ///
    /// # Errors
    /// [`Error::Invalid`] for sizes that do not fit the architecture, or a weight that is not finite.
    pub fn new(architecture: Architecture, layers: Vec<Layer<T>>) -> Result<Self, Error> {
        architecture.check()?;
        if layers.len() != architecture.activations.len() {
            let allowed = format!("{} for its architecture", architecture.activations.len());
            return Err(Error::invalid("layers", layers.len(), allowed));
        }
        for (index, layer) in layers.iter().enumerate() {
            let (inputs, outputs) = (architecture.widths[index], architecture.widths[index + 1]);
            if layer.weights.len() != inputs * outputs || layer.bias.len() != outputs {
                let found = format!("{} weights, {} biases", layer.weights.len(), layer.bias.len());
                let allowed = format!("({outputs}, {inputs}) and {outputs} in layer {index}");
                return Err(Error::invalid("weights", found, allowed));
            }
            if layer.activation != architecture.activations[index] {
                let allowed = format!("{:?} in layer {index}", architecture.activations[index]);
                return Err(Error::invalid("activation", format!("{:?}", layer.activation), allowed));
            }
            if let Some(bad) = layer.weights.iter().chain(&layer.bias).find(|w| !w.to_f64().is_finite()) {
                return Err(Error::invalid("weights", format!("{bad:?} in layer {index}"), "finite numbers"));
            }
        }
        Ok(Self::packed(architecture, layers))
    }

    fn packed(architecture: Architecture, layers: Vec<Layer<T>>) -> Self {
        let pairs = || architecture.widths.windows(2).zip(&layers);
        let packed = pairs().map(|(w, layer)| PackedMatrix::new(w[0], &layer.weights, &layer.bias)).collect();
        let transposed =
            pairs().map(|(w, layer)| PackedMatrix::transposed(w[0], w[1], &layer.weights)).collect();
        Self { architecture, layers, packed, transposed }
    }

    /// Creates a network with Glorot's uniform weights, ±√(6/(inputs + outputs)), and no bias, as Keras does;
    /// the same seed gives the same network.
    ///
    /// # Errors
    /// [`Architecture::check`].
    pub fn random(architecture: Architecture, seed: u64) -> Result<Self, Error> {
        architecture.check()?;
        let mut random = SplitMix64::new(seed);
        let pairs = architecture.widths.windows(2).zip(&architecture.activations);
        let layers = pairs.map(|(pair, &activation)| {
            let limit = (6.0 / (pair[0] + pair[1]) as f64).sqrt();
            let weight = |_| T::from_f64(limit * (2.0 * random.uniform() - 1.0));
            let weights = (0..pair[0] * pair[1]).map(weight).collect();
            Layer { weights, bias: vec![T::ZERO; pair[1]], activation }
        });
        let layers = layers.collect();
        Self::new(architecture, layers)
    }

    /// Widths and activations.
    pub fn architecture(&self) -> &Architecture {
        &self.architecture
    }

    /// Layers from the input on.
    pub fn layers(&self) -> &[Layer<T>] {
        &self.layers
    }

    /// Converts the network to another precision.
    pub fn convert<U: Real>(&self) -> Network<U> {
        let list = |values: &[T]| values.iter().map(|value| U::from_f64(value.to_f64())).collect();
        let layer = |layer: &Layer<T>| Layer {
            weights: list(&layer.weights),
            bias: list(&layer.bias),
            activation: layer.activation,
        };
        Network::packed(self.architecture.clone(), self.layers.iter().map(layer).collect())
    }

    /// Computes the outputs at `input`; surplus inputs are not read, missing ones count as 0.
    pub fn forward<'t>(&self, input: &[T], tape: &'t mut Tape<T>) -> &'t [T] {
        tape.fit(self);
        tape.set_input(0, input);
        pass::run(self, PassOutput::Points { count: 1, gradients: false }, tape);
        tape.output(0)
    }

    /// Outputs and their derivatives, ∂y/∂x_b in list b (forward mode; inputs up to [`LANES`], further ones
    /// are left out).
    pub fn jacobian<'t>(&self, input: &[T], tape: &'t mut Tape<T>) -> (&'t [T], [&'t [T]; LANES]) {
        let inputs = self.architecture.widths[0];
        tape.fit(self);
        tape.set_input(0, input);
        let mut slopes: [&[T]; LANES] = [&[]; LANES];
        if inputs > LANES {
            pass::run(self, PassOutput::Points { count: 1, gradients: false }, tape);
            return (tape.output(0), slopes);
        }
        pass::run(self, PassOutput::Slopes, tape);
        let tape = &*tape;
        for (b, slope) in slopes.iter_mut().enumerate().take(inputs) {
            *slope = tape.output(b + 1);
        }
        (tape.output(0), slopes)
    }

    /// Value, gradient and second derivatives of the first output by the inputs (up to [`LANES`], all 0 for
    /// more).
    ///
    /// With the sums a of each layer and the adjoints g = ∂out/∂y of its activations y = σ(a):
    /// gradient by reverse mode, H = Σ g σ″(a) (∂a/∂x)(∂a/∂x)ᵀ over all neurons.
    pub fn second_derivatives(
        &self,
        input: &[T],
        tape: &mut Tape<T>,
    ) -> (T, [T; LANES], [[T; LANES]; LANES]) {
        tape.fit(self);
        tape.set_input(0, input);
        if self.architecture.widths[0] > LANES {
            return (self.forward(input, tape)[0], [T::ZERO; LANES], [[T::ZERO; LANES]; LANES]);
        }
        let hessian = pass::run(self, PassOutput::Curvature, tape);
        let (value, gradient) = first_output(tape, 0);
        (value, gradient, hessian)
    }

    /// Value and gradient of the first output by the inputs (up to [`LANES`]).
    pub fn gradient(&self, input: &[T], tape: &mut Tape<T>) -> (T, [T; LANES]) {
        tape.fit(self);
        tape.set_input(0, input);
        pass::run(self, PassOutput::Points { count: 1, gradients: true }, tape);
        first_output(tape, 0)
    }

    /// Outputs at up to [`BATCH`] points side by side, to the same bits as one by one; `outputs` is called
    /// with each.
    pub(crate) fn forward_batch(
        &self,
        inputs: &[[T; LANES]],
        tape: &mut Tape<T>,
        mut outputs: impl FnMut(usize, &[T]),
    ) {
        let count = self.points(inputs, false, tape);
        for point in 0..count {
            outputs(point, tape.output(point));
        }
    }

    /// Value and gradient of the first output at up to [`BATCH`] points side by side, to the same bits as one
    /// by one.
    pub(crate) fn gradient_batch(
        &self,
        inputs: &[[T; LANES]],
        tape: &mut Tape<T>,
        mut outputs: impl FnMut(usize, T, [T; LANES]),
    ) {
        let count = self.points(inputs, true, tape);
        for point in 0..count {
            let (value, gradient) = first_output(tape, point);
            outputs(point, value, gradient);
        }
    }

    fn points(&self, inputs: &[[T; LANES]], gradients: bool, tape: &mut Tape<T>) -> usize {
        let count = inputs.len().min(BATCH);
        tape.fit(self);
        for (point, input) in inputs.iter().enumerate().take(count) {
            tape.set_input(point, input);
        }
        pass::run(self, PassOutput::Points { count, gradients }, tape);
        count
    }
}

/// Value and gradient of the first output at a point.
fn first_output<T: Real>(tape: &Tape<T>, point: usize) -> (T, [T; LANES]) {
    let mut gradient = [T::ZERO; LANES];
    for (lane, &adjoint) in gradient.iter_mut().zip(tape.gradient(point)) {
        *lane = adjoint;
    }
    (tape.output(point)[0], gradient)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// formulation.md, chapter 3: ANN-4 has 36,198 parameters.
    #[test]
    fn table_3_4() {
        assert_eq!(Architecture::thesis(4).unwrap().parameters(), 36_198);
        assert_eq!(Architecture::thesis(1).unwrap().widths, [6, 192, 32, 32, 64, 128, 6]);
        for number in [0, 5] {
            assert!(Architecture::thesis(number).is_err());
        }
        for number in 1..=4 {
            let architecture = Architecture::thesis(number).unwrap();
            assert_eq!(*architecture.activations.last().unwrap(), Activation::Linear);
            Network::<f64>::random(architecture, 1).unwrap();
        }
    }

    /// A network by hand: y = 2 softplus(3x₁ − x₂ + 0.5) − 1.
    #[test]
    fn by_hand() {
        let layers = vec![
            Layer { weights: vec![3.0, -1.0], bias: vec![0.5], activation: Activation::Softplus },
            Layer { weights: vec![2.0], bias: vec![-1.0], activation: Activation::Linear },
        ];
        let architecture = Architecture::new(2, &[(1, Activation::Softplus)], 1);
        let network = Network::new(architecture, layers).unwrap();
        let mut tape = Tape::default();
        let (value, gradient, hessian) = network.second_derivatives(&[0.2, 0.3], &mut tape);
        let a = 3.0 * 0.2 - 0.3 + 0.5;
        let s = 1.0 / (1.0 + f64::exp(-a));
        assert!((value - (2.0 * f64::ln(1.0 + f64::exp(a)) - 1.0)).abs() < 1e-15);
        assert!((gradient[0] - 6.0 * s).abs() < 1e-15 && (gradient[1] + 2.0 * s).abs() < 1e-15);
        assert!((hessian[0][1] + 6.0 * s * (1.0 - s)).abs() < 1e-15);
        assert!((hessian[0][0] - 18.0 * s * (1.0 - s)).abs() < 1e-15);
        assert_eq!(gradient[2..], [0.0; 6]);
    }

    /// Widths around panels and vectors, all activations, against plain sums in f64: 1e-14 is some roundings
    /// a layer.
    #[test]
    fn kernels_give_what_plain_loops_give() {
        for (width, inputs) in [(1, 3), (7, 6), (16, 1), (17, 5), (40, 7), (97, 8), (224, 4)] {
            for activation in Activation::ALL {
                let hidden = [(width, activation), (width / 2 + 1, Activation::Relu), (5, activation)];
                let network = Network::<f64>::random(Architecture::new(inputs, &hidden, 6), 4).unwrap();
                let x = [0.3, -0.2, 0.5, 0.1, -0.7, 0.9, 0.05, 0.6];
                let mut values = x[..inputs].to_vec();
                // rows of outputs, columns of inputs
                let unit = |i: usize| (0..inputs).map(|j| f64::from(u8::from(i == j))).collect();
                let mut slopes: Vec<Vec<f64>> = (0..inputs).map(unit).collect();
                for layer in network.layers() {
                    let (mut next, mut next_slopes) = (Vec::new(), Vec::new());
                    for (row, bias) in layer.weights.chunks(values.len()).zip(&layer.bias) {
                        let sum: f64 = row.iter().zip(&values).map(|(w, y)| w * y).sum();
                        let [value, first, _] = layer.activation.derivatives(sum + bias);
                        next.push(value);
                        let slope = |b: usize| row.iter().zip(&slopes).map(|(w, s)| w * s[b]).sum::<f64>();
                        next_slopes.push((0..inputs).map(|b| first * slope(b)).collect());
                    }
                    (values, slopes) = (next, next_slopes);
                }
                let mut tape = Tape::default();
                let (outputs, jacobian) = network.jacobian(&x, &mut tape);
                for a in 0..6 {
                    assert!((outputs[a] - values[a]).abs() < 1e-14, "{width} {inputs} {activation:?}");
                    for b in 0..inputs {
                        assert!(
                            (jacobian[b][a] - slopes[a][b]).abs() < 1e-14,
                            "{width} {inputs} {activation:?}"
                        );
                    }
                }
                let outputs = outputs.to_vec();
                assert_eq!(network.forward(&x, &mut tape), outputs);
                let gradient = network.gradient(&x, &mut tape).1;
                for b in 0..inputs {
                    assert!((gradient[b] - slopes[0][b]).abs() < 1e-14, "{width} {inputs} {activation:?}");
                }
            }
        }
    }

    #[test]
    fn second_derivatives_are_those_of_the_gradient() {
        let hidden = [(13, Activation::Tanh), (9, Activation::Softplus), (5, Activation::Silu)];
        let network = Network::<f64>::random(Architecture::new(7, &hidden, 1), 5).unwrap();
        let mut tape = Tape::default();
        let x = [0.3, -0.2, 0.5, 0.1, -0.7, 0.9, 0.05];
        let (value, gradient, hessian) = network.second_derivatives(&x, &mut tape);
        assert_eq!(value, network.forward(&x, &mut tape)[0]);
        let (_, jacobian) = network.jacobian(&x, &mut tape);
        for lane in 0..LANES {
            // forward and reverse mode sum in different orders
            let slope = jacobian[lane].first().copied().unwrap_or_default();
            assert!((slope - gradient[lane]).abs() < 1e-15);
        }
        let step = 1e-5;
        for i in 0..7 {
            let at = |by: f64, tape: &mut Tape<f64>| {
                let mut x = x;
                x[i] += by;
                network.second_derivatives(&x, tape)
            };
            let (up, down) = (at(step, &mut tape), at(-step, &mut tape));
            assert!(((up.0 - down.0) / (2.0 * step) - gradient[i]).abs() < 1e-9);
            for j in 0..7 {
                assert!(((up.1[j] - down.1[j]) / (2.0 * step) - hessian[i][j]).abs() < 1e-9, "{i}{j}");
                assert!((hessian[i][j] - hessian[j][i]).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn precisions_agree() {
        let network = Network::<f64>::random(Architecture::thesis(4).unwrap(), 3).unwrap();
        let single: Network<f32> = network.convert();
        let x = [0.1, -0.5, 0.3, 0.0, 0.0, 0.0];
        let (mut tape, mut small) = (Tape::default(), Tape::default());
        let double = network.forward(&x, &mut tape);
        for (a, b) in double.iter().zip(single.forward(&x.map(|x| x as f32), &mut small)) {
            // some hundred roundings of 6e-8 on numbers of order 1
            assert!((a - f64::from(*b)).abs() < 1e-5, "{a} {b}");
        }
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let architecture = || Architecture::new(2, &[(3, Activation::Tanh)], 1);
        let good = Network::<f64>::random(architecture(), 1).unwrap();
        let mut short = good.layers().to_vec();
        short[0].weights.pop();
        let error = Network::new(architecture(), short).unwrap_err().to_string();
        assert!(error.contains("found 5 weights, 3 biases; allowed: (3, 2) and 3 in layer 0"), "{error}");
        let mut nan = good.layers().to_vec();
        nan[1].bias[0] = f64::NAN;
        assert!(Network::new(architecture(), nan).unwrap_err().to_string().contains("NaN in layer 1"));
        let mut other = good.layers().to_vec();
        other[0].activation = Activation::Relu;
        assert!(Network::new(architecture(), other).is_err());
        assert!(Network::new(architecture(), good.layers()[..1].to_vec()).is_err());
        for widths in [vec![], vec![6], vec![6, 0, 6], vec![6, 1 << 20, 6]] {
            let activations = vec![Activation::Linear; widths.len().saturating_sub(1)];
            assert!(Architecture { widths, activations }.check().is_err());
        }
    }
}
