//! Search space of the hyperparameters.

use crate::Error;
use crate::network::{Activation, Architecture, MOST_NEURONS};
use crate::random::SplitMix64;
use polycore::numerics::range;
use serde::{Deserialize, Serialize};

/// Ranges of the hyperparameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct SearchSpace {
    /// Smallest and largest number of hidden layers.
    pub layers: [usize; 2],
    /// Smallest and largest number of neurons per layer.
    pub neurons: [usize; 2],
    /// Step of the number of neurons.
    pub step: usize,
    /// Activations of the layers.
    pub activations: Vec<Activation>,
    /// Learning rates of Adam.
    pub learning_rates: Vec<f64>,
}

impl Default for SearchSpace {
    /// Returns Table 3.3. The step of 32 neurons is not printed there: all widths of Table 3.4 are multiples
    /// of it.
    fn default() -> Self {
        Self {
            layers: [2, 5],
            neurons: [32, 256],
            step: 32,
            activations: vec![Activation::Relu, Activation::Softplus],
            learning_rates: vec![1e-1, 1e-2, 1e-3],
        }
    }
}

/// Hyperparameters of a trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SearchCandidate {
    /// Neurons and activation of each hidden layer.
    pub hidden: Vec<(usize, Activation)>,
    /// Learning rate of Adam.
    pub learning_rate: f64,
}

impl SearchCandidate {
    /// Returns its network from C to S.
    pub fn architecture(&self) -> Architecture {
        Architecture::new(6, &self.hidden, 6)
    }

    /// Describes its layers as in Table 3.4.
    pub fn layers(&self) -> String {
        let layer = |(neurons, activation): &(usize, Activation)| format!("{neurons} × {activation:?}");
        self.hidden.iter().map(layer).collect::<Vec<_>>().join(", ")
    }
}

impl SearchSpace {
    /// Checks the ranges.
    ///
    /// # Errors
    /// Returns [`Error::Parameter`] for an empty range, a step of 0, and invalid values.
    pub fn check(&self) -> Result<(), Error> {
        let [least, most] = self.layers;
        if !(1..=most).contains(&least) || most > 20 {
            return Err(Error::parameter("layers", format!("{:?}", self.layers), "1 to 20, ascending"));
        }
        let [least, most] = self.neurons;
        if !(1..=most).contains(&least) || most > MOST_NEURONS {
            return Err(Error::parameter("neurons", format!("{:?}", self.neurons), "1 to 65,536, ascending"));
        }
        if self.step == 0 {
            return Err(Error::parameter("step", 0, "1 neuron or more"));
        }
        if self.activations.is_empty() {
            return Err(Error::parameter("activations", "none", "at least one"));
        }
        match self.learning_rates.iter().find(|rate| !(rate.is_finite() && **rate > 0.0)) {
            Some(rate) => Err(Error::parameter("learning_rates", rate, "positive, finite numbers")),
            None if self.learning_rates.is_empty() => {
                Err(Error::parameter("learning_rates", "none", "at least one"))
            }
            None => Ok(()),
        }
    }

    /// Counts the possible numbers of neurons.
    fn widths(&self) -> usize {
        1 + (self.neurons[1] - self.neurons[0]) / self.step
    }

    fn layer(&self, random: &mut SplitMix64) -> (usize, Activation) {
        let neurons = self.neurons[0] + self.step * random.below(self.widths());
        (neurons, self.activations[random.below(self.activations.len())])
    }

    /// Draws a random candidate; depth, widths, activations and rate are uniformly distributed.
    pub fn sample(&self, random: &mut SplitMix64) -> SearchCandidate {
        let layers = self.layers[0] + random.below(self.layers[1] - self.layers[0] + 1);
        let hidden = (0..layers).map(|_| self.layer(random)).collect();
        SearchCandidate {
            hidden,
            learning_rate: self.learning_rates[random.below(self.learning_rates.len())],
        }
    }

    /// Returns a candidate that differs in one layer, the depth or the rate.
    pub fn neighbour(&self, from: &SearchCandidate, random: &mut SplitMix64) -> SearchCandidate {
        let mut near = from.clone();
        match random.below(4) {
            0 => near.learning_rate = self.learning_rates[random.below(self.learning_rates.len())],
            1 if near.hidden.len() < self.layers[1] => near.hidden.push(self.layer(random)),
            2 if near.hidden.len() > self.layers[0] => {
                near.hidden.remove(random.below(near.hidden.len()));
            }
            _ => {
                let place = random.below(near.hidden.len());
                near.hidden[place] = self.layer(random);
            }
        }
        near
    }

    /// Encodes a candidate as a point of a Gaussian process: depth, decimal logarithm of the rate, and for
    /// each possible layer the width (0 without it) and one number per activation except the first, all about
    /// 0 to 1.
    pub fn encode(&self, candidate: &SearchCandidate) -> Vec<f64> {
        let share =
            |value: f64, [low, high]: [f64; 2]| if high > low { (value - low) / (high - low) } else { 0.0 };
        let rates = || self.learning_rates.iter().map(|rate| rate.log10());
        let rate_range = range(rates());
        let mut point = vec![
            share(candidate.hidden.len() as f64, self.layers.map(|count| count as f64)),
            share(candidate.learning_rate.log10(), rate_range),
        ];
        for layer in 0..self.layers[1] {
            let at = candidate.hidden.get(layer);
            point.push(at.map_or(0.0, |(neurons, _)| *neurons as f64 / self.neurons[1] as f64));
            for other in self.activations.iter().skip(1) {
                point.push(at.map_or(0.5, |(_, activation)| f64::from(u8::from(activation == other))));
            }
        }
        point
    }
}
