//! Models learnt from data, without a training framework: stress, tangent, and how uncertain they are.
//!
//! Two kinds, both functions of C alone and so objective by construction:
//! - `ann`: S = N(C) as in the thesis (3.9); it has no energy, S(I) ≠ 0, and its tangent is not symmetric;
//! - `energy`: W = N(x(C)) − N(x(I)) − S₀ : E with x the invariants of a [`Symmetry`] and S₀ chosen so that
//!   S(I) = 0; S = 2 ∂W/∂C, so that the tangent is symmetric and closed cycles do no work.
//!
//! An ensemble of members is one model: it predicts their mean, and their spread measures its uncertainty.
//!
//! ```
//! use polycore::constitutive::network::Activation::Softplus;
//! use polycore::constitutive::surrogate::{Header, Kind, Surrogate, Symmetry};
//!
//! // an orthotropic energy with random weights, instead of `Surrogate::read("law.safetensors")`
//! let header = Header::new(Kind::energy(Symmetry::Orthotropic), &[(32, Softplus), (32, Softplus)], 2);
//! let model = Surrogate::<f64>::random(header, 1)?;
//! let prediction = model.predict(&[1.1, 1.0, 1.0, 0.1, 0.0, 0.0].into())?;
//! assert!(prediction.tangent.is_some() && prediction.spread > 0.0);
//! assert!(prediction.flags.unseen[3], "no training data had shear");
//! # Ok::<(), polycore::constitutive::Error>(())
//! ```

mod evaluate;
mod examples;
mod file;
mod header;
mod invariants;
mod softening;
mod support;
mod symmetry;

pub use super::{Flags, Prediction, Workspace};
pub use evaluate::Features;
pub use examples::examples;
pub use header::{Header, Kind};
pub use invariants::{SymmetryInvariants, derivative};
pub use softening::{Softening, SofteningHistory};
pub use support::Support;
pub use symmetry::{Monomial, StressAtRest, Symmetry};

use super::network::{LANES, Network, Real, Tape};
use super::{Error, Law};
use crate::tensor::{Voigt, Voigt6x6};
use nalgebra::SVector;
use support::Nearest;

/// Tolerance for components that never changed in the training data: ten times the rounding of f32.
pub const CONSTANT_TOLERANCE: f64 = 1e-6;

/// Law C → S in one of two precisions.
#[derive(Debug, Clone)]
pub struct Surrogate<T: Real = f64> {
    header: Header,
    members: Vec<Network<T>>,
    mean: Vec<T>,
    inverse: Vec<T>,
    output_mean: Vec<T>,
    output: Vec<T>,
    /// C → material axes, row by row; none for the axes of the data.
    turn: Option<[[T; 6]; 6]>,
    nearest: Option<Nearest<T>>,
    /// Terms of each member of an energy such that W(I) = 0 and S(I) = 0.
    rest: Vec<RestTerm<T>>,
}

/// Scratch kept between evaluations.
#[derive(Default)]
struct SurrogateScratch<T> {
    tape: Tape<T>,
    /// Energy and ∂W/∂c, or S, of each member (and in a batch of each point of it).
    parts: Vec<(T, [T; 6])>,
}

/// Terms subtracted from a member's energy: its value at I, and a function linear in c or in the invariants.
#[derive(Debug, Clone, Copy, Default)]
pub struct RestTerm<T> {
    /// W at I.
    pub value: T,
    /// −∂/∂c.
    pub slope: [T; 6],
    /// Added to ∂W/∂x of the invariants x.
    pub invariants: [T; LANES],
    /// The invariants at I.
    pub at: [T; LANES],
}

/// Numbers of a model beside its weights, in the form used by evaluation and exporters.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients<'a, T> {
    /// Mean of each input, subtracted first.
    pub mean: &'a [T],
    /// Factor of each input, applied after `mean` is subtracted; 0 for one without variance.
    pub inverse: &'a [T],
    /// Added to the outputs of an `ann`.
    pub output_mean: &'a [T],
    /// Factor of the outputs, applied before `output_mean` is added.
    pub output: &'a [T],
    /// Transformation of C to the material axes, row by row; `None` for the axes of the data.
    pub turn: Option<&'a [[T; 6]; 6]>,
    /// Terms of each member of an energy.
    pub rest: &'a [RestTerm<T>],
    /// Distance in standard deviations beyond which a C is far from all representatives of the training
    /// strains.
    pub farthest: Option<f64>,
}

impl<T: Real + nalgebra::Scalar> Surrogate<T> {
    /// Builds a law from its header and the networks of its members.
    ///
    /// # Errors
    /// [`Header::check`]; [`Error::Invalid`] for another number of networks or another architecture, axes
    /// that are not orthonormal, or a negative weight where a polyconvex energy must have none
    /// ([`Kind::non_negative`]).
    pub fn new(header: Header, members: Vec<Network<T>>) -> Result<Self, Error> {
        header.check()?;
        if members.len() != header.members {
            return Err(Error::invalid("members", members.len(), format!("{}", header.members)));
        }
        if let Some(other) = members.iter().find(|member| *member.architecture() != header.architecture) {
            let found = format!("{:?}", other.architecture());
            return Err(Error::invalid("network", found, format!("{:?}", header.architecture)));
        }
        for layers in members.iter().map(Network::layers) {
            for (l, layer) in layers.iter().enumerate() {
                let inputs = header.architecture.widths[l];
                let bad =
                    |(i, weight): &(usize, &T)| header.kind.non_negative(l, i % inputs) && **weight < T::ZERO;
                if let Some((i, weight)) = layer.weights.iter().enumerate().find(bad) {
                    let found = format!("{weight:?} for input {} of layer {l}", i % inputs);
                    return Err(Error::invalid("weight", found, "0 or more in a polyconvex energy"));
                }
            }
        }
        let list = |values: &[f64]| values.iter().map(|value| T::from_f64(*value)).collect::<Vec<T>>();
        let inverse: Vec<f64> =
            header.input_deviation.iter().map(|d| if *d == 0.0 { 0.0 } else { 1.0 / d }).collect();
        let turn = match &header.kind {
            Kind::Energy { axes, .. } => {
                let matrix = symmetry::into_material_axes(axes)?;
                let identity = matrix == Voigt6x6::identity();
                let mut rows = [[T::ZERO; 6]; 6];
                for (i, row) in rows.iter_mut().enumerate() {
                    for (j, value) in row.iter_mut().enumerate() {
                        *value = T::from_f64(matrix[(i, j)]);
                    }
                }
                (!identity).then_some(rows)
            }
            Kind::Ann => None,
        };
        let mut law = Self {
            mean: list(&header.input_mean),
            inverse: list(&inverse),
            output_mean: list(&header.output_mean),
            output: list(&header.output_deviation),
            nearest: header.support.as_ref().map(Nearest::new),
            header,
            members,
            turn,
            rest: Vec::new(),
        };
        if let Some(invariants) = law.header.kind.invariants() {
            law.rest = vec![RestTerm::default(); law.members.len()];
            for m in 0..law.members.len() {
                law.rest[m] = law.rest_of(m, invariants);
            }
        }
        Ok(law)
    }

    /// Creates a law with random weights ([`Network::random`], seeds `seed`, `seed` + 1, …). Weights that
    /// [`Kind::non_negative`] restricts are |w|/√n with n inputs: a sum of n numbers of one sign is √n times
    /// as large as one of both signs.
    ///
    /// # Errors
    /// Those of [`Surrogate::new`].
    pub fn random(header: Header, seed: u64) -> Result<Self, Error> {
        header.check()?;
        let network = |m: usize| {
            let network = Network::<T>::random(header.architecture.clone(), seed.wrapping_add(m as u64))?;
            let mut layers = network.layers().to_vec();
            for (l, layer) in layers.iter_mut().enumerate() {
                let inputs = header.architecture.widths[l];
                let scale = T::ONE / T::from_f64(inputs as f64).root();
                for (i, weight) in layer.weights.iter_mut().enumerate() {
                    if header.kind.non_negative(l, i % inputs) {
                        *weight = scale * if *weight < T::ZERO { -*weight } else { *weight };
                    }
                }
            }
            Network::new(header.architecture.clone(), layers)
        };
        let members = (0..header.members).map(network).collect::<Result<Vec<_>, _>>()?;
        Self::new(header, members)
    }

    /// Computes the correction of member m. For a polyconvex energy it is polyconvex itself: with S(I) = Σ sᵢ
    /// aᵢ⊗aᵢ in the material axes, add ½|sᵢ| (aᵢ·Caᵢ − 1) for sᵢ < 0 and ½sᵢ (aᵢ·cof C aᵢ − 1) − sᵢ(J − 1)
    /// for sᵢ > 0, since 2 ∂(aᵢ·cof C aᵢ)/∂C = 2(1 − aᵢ⊗aᵢ) and 2 ∂J/∂C = 1 at I (after Linden et al. 2023,
    /// <https://doi.org/10.1016/j.jmps.2023.105363>).
    fn rest_of(&self, m: usize, invariants: SymmetryInvariants) -> RestTerm<T> {
        let mut tape = Tape::default();
        let identity = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0].map(T::from_f64);
        let mut rest = RestTerm::default();
        invariants.values(&identity, &mut rest.at);
        if let Kind::Energy { symmetry, polyconvex: true, .. } = self.header.kind {
            let last = invariants.count() - 1;
            let mut input = [T::ZERO; LANES];
            self.input(&identity, &mut input);
            let (_, gradient) = self.members[m].gradient(&input[..=last], &mut tape);
            let mut stress = [T::ZERO; 6];
            for k in 0..=last {
                let slope = invariants.gradient(&identity, k);
                for a in 0..6 {
                    stress[a] +=
                        (T::ONE + T::ONE) * self.output[0] * gradient[k] * self.inverse[k] * slope[a];
                }
            }
            let part = |of: [f64; 3]| {
                let mut sum = T::ZERO;
                for i in 0..3 {
                    sum += T::from_f64(of[i]) * stress[i];
                }
                sum
            };
            let StressAtRest { spherical, along } = symmetry.stress_at_rest();
            rest.invariants[last] = -part(spherical);
            for &(of, plain, cofactor) in along {
                let s = part(of);
                if s < T::ZERO {
                    rest.invariants[plain] = -(s / (T::ONE + T::ONE));
                } else {
                    rest.invariants[cofactor] = s / (T::ONE + T::ONE);
                    rest.invariants[last] += -s;
                }
            }
        }
        // the remainder: all of it, or rounding
        let raw = self.member(m, &identity, &rest, false, &mut tape);
        rest.value = raw.energy;
        rest.slope = raw.first;
        rest
    }

    /// Metadata of the model: everything but the weights.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The networks.
    pub fn members(&self) -> &[Network<T>] {
        &self.members
    }

    /// Converts the law to another precision.
    ///
    /// # Errors
    /// Weights beyond the range of f32.
    pub fn convert<U: Real + nalgebra::Scalar>(&self) -> Result<Surrogate<U>, Error> {
        let convert = |member: &Network<T>| {
            let converted = member.convert::<U>();
            Network::new(converted.architecture().clone(), converted.layers().to_vec())
        };
        let members = self.members.iter().map(convert).collect::<Result<Vec<_>, _>>()?;
        Surrogate::new(self.header.clone(), members)
    }

    /// Numbers beside the weights.
    pub fn coefficients(&self) -> Coefficients<'_, T> {
        Coefficients {
            mean: &self.mean,
            inverse: &self.inverse,
            output_mean: &self.output_mean,
            output: &self.output,
            turn: self.turn.as_ref(),
            rest: &self.rest,
            farthest: self.nearest.as_ref().map(|nearest| nearest.limit),
        }
    }

    /// Flags components of C outside the training data; for the spread see [`Surrogate::stress`].
    pub fn flags(&self, c: &SVector<T, 6>) -> Flags {
        let mut flags = Flags::default();
        for (a, [low, high]) in self.header.training_box.iter().enumerate() {
            let value = c[a].to_f64();
            // components that never changed may differ by rounding; NaN is outside
            let slack = if low == high { CONSTANT_TOLERANCE } else { 0.0 };
            flags.outside[a] = !(value >= low - slack && value <= high + slack);
            flags.unseen[a] = flags.outside[a] && low == high;
        }
        if let Some(nearest) = &self.nearest {
            flags.far = nearest.distance(&(*c).into()) > nearest.limit;
        }
        flags
    }

    /// Computes S, the tangent 2 ∂S/∂C and their uncertainty at C, with new memory: for single points.
    ///
    /// # Errors
    /// Those of [`Surrogate::tangent`].
    pub fn predict(&self, c: &SVector<T, 6>) -> Result<Prediction<T>, Error> {
        self.tangent(c, &mut Workspace::default())
    }

    /// Computes S at C with its uncertainty.
    ///
    /// # Errors
    /// Those of [`Surrogate::tangent`].
    pub fn stress(&self, c: &SVector<T, 6>, memory: &mut Workspace) -> Result<Prediction<T>, Error> {
        memory.with(|memory| self.evaluate(c, false, memory))
    }

    /// Computes S and the tangent 2 ∂S/∂C at C with their uncertainty.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a C that is not finite or not positive definite, and for a result that is not
    /// finite (a C so far away that the networks overflow).
    pub fn tangent(&self, c: &SVector<T, 6>, memory: &mut Workspace) -> Result<Prediction<T>, Error> {
        memory.with(|memory| self.evaluate(c, true, memory))
    }
}

impl Surrogate<f64> {
    /// Sets the limit of the spread: the model flags predictions whose spread exceeds that at all of these
    /// strains, those of its training. There is no limit for a single member, or for members that agree
    /// everywhere.
    ///
    /// # Errors
    /// Those of [`Surrogate::stress`].
    pub fn with_spread_limit(mut self, strains: &[Voigt]) -> Result<Self, Error> {
        let mut memory = Workspace::default();
        let mut greatest = 0.0f64;
        for c in strains {
            greatest = greatest.max(self.stress(c, &mut memory)?.spread);
        }
        self.header.spread_limit = (self.members.len() > 1 && greatest > 0.0).then_some(greatest);
        Ok(self)
    }
}

impl Law for Surrogate<f64> {
    fn name(&self) -> String {
        match self.header.kind {
            Kind::Ann => "ann".into(),
            Kind::Energy { symmetry, .. } => format!("energy, {symmetry:?}").to_lowercase(),
        }
    }

    fn stress(&self, c: &Voigt, memory: &mut Workspace) -> Result<Prediction, Error> {
        self.stress(c, memory)
    }

    fn tangent(&self, c: &Voigt, memory: &mut Workspace) -> Result<Prediction, Error> {
        self.tangent(c, memory)
    }

    fn stresses(
        &self,
        c: &[Voigt],
        memory: &mut Workspace,
        predictions: &mut [Prediction],
    ) -> Result<(), Error> {
        self.stresses(c, memory, predictions)
    }
}

fn product<T: Real>(row: &[T; 6], c: &[T; 6]) -> T {
    let mut sum = T::ZERO;
    for (&weight, &value) in row.iter().zip(c) {
        sum += weight * value;
    }
    sum
}

/// Tᵀ g and Tᵀ H T: derivatives with respect to c from those with respect to T c.
fn to_data_axes<T: Real>(turn: &[[T; 6]; 6], g: &[T; 6], h: &[[T; 6]; 6]) -> ([T; 6], [[T; 6]; 6]) {
    let (mut first, mut half, mut second) = ([T::ZERO; 6], [[T::ZERO; 6]; 6], [[T::ZERO; 6]; 6]);
    for k in 0..6 {
        for a in 0..6 {
            first[a] += turn[k][a] * g[k];
            for b in 0..6 {
                half[k][a] += h[k][b] * turn[b][a];
            }
        }
    }
    for k in 0..6 {
        for a in 0..6 {
            for b in 0..6 {
                second[a][b] += turn[k][a] * half[k][b];
            }
        }
    }
    (first, second)
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod polyconvex_tests;

#[cfg(test)]
mod uncertainty_tests;
