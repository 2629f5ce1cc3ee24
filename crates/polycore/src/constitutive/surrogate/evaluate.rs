//! Predictions at C: members, their mean, lists of points.

use super::{Kind, Prediction, RestTerm, Surrogate, SurrogateScratch, Workspace, product, to_data_axes};
use crate::constitutive::Error;
use crate::constitutive::law::same_length;
use crate::constitutive::network::{BATCH, LANES, Real, Tape};
use crate::tensor::Voigt;
use crate::tensor::voigt::{self, NAMES};
use nalgebra::{SMatrix, SVector};

/// Inputs of the networks at a C.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Features {
    /// Standardised inputs (3.8); only as many as the network has.
    pub values: [f64; LANES],
    /// Derivatives of the invariants of an energy, not yet standardised, with respect to the six components
    /// of C, C₁₂ counted once.
    pub slopes: [[f64; 6]; LANES],
}

impl Surrogate<f64> {
    /// Inputs at `c`; those of an `ann` are the components of C and have no slopes.
    pub fn features(&self, c: &Voigt) -> Features {
        let mut features = Features { values: [0.0; LANES], slopes: [[0.0; 6]; LANES] };
        let local = self.input(&(*c).into(), &mut features.values);
        if let Some(invariants) = self.header.kind.invariants() {
            for k in 0..invariants.count() {
                let slope = invariants.gradient(&local, k);
                features.slopes[k] = match &self.turn {
                    Some(turn) => to_data_axes(turn, &slope, &[[0.0; 6]; 6]).0,
                    None => slope,
                };
            }
        }
        features
    }
}

/// Energy, ∂W/∂c (or S of an `ann`) and their derivatives with respect to c.
pub(super) struct Member<T> {
    pub energy: T,
    pub first: [T; 6],
    pub second: [[T; 6]; 6],
}

impl<T: Real + nalgebra::Scalar> Surrogate<T> {
    /// Computes S at each C with its uncertainty, with the same bits as one by one, at less cost.
    ///
    /// # Errors
    /// Those of [`Surrogate::stress`], with the place in the list; a list of predictions of another length.
    pub fn stresses(
        &self,
        c: &[SVector<T, 6>],
        memory: &mut Workspace,
        predictions: &mut [Prediction<T>],
    ) -> Result<(), Error> {
        same_length(c.len(), predictions.len())?;
        memory.with(|memory| self.side_by_side(c, memory, predictions))
    }

    fn side_by_side(
        &self,
        c: &[SVector<T, 6>],
        memory: &mut SurrogateScratch<T>,
        predictions: &mut [Prediction<T>],
    ) -> Result<(), Error> {
        let members = self.members.len();
        for (chunk, (points, predictions)) in c.chunks(BATCH).zip(predictions.chunks_mut(BATCH)).enumerate() {
            let (mut inputs, mut local) = ([[T::ZERO; LANES]; BATCH], [[T::ZERO; 6]; BATCH]);
            for (p, point) in points.iter().enumerate() {
                check_deformation(point).map_err(|error| at_point(chunk * BATCH + p, error))?;
                local[p] = self.input(&(*point).into(), &mut inputs[p]);
            }
            let inputs = &inputs[..points.len()];
            memory.parts.clear();
            memory.parts.resize(members * BATCH, (T::ZERO, [T::ZERO; 6]));
            for (m, (network, parts)) in self.members.iter().zip(memory.parts.chunks_mut(BATCH)).enumerate() {
                if matches!(self.header.kind, Kind::Ann) {
                    network.forward_batch(inputs, &mut memory.tape, |p, values| {
                        parts[p] = (T::ZERO, self.mapped(values).first);
                    });
                } else {
                    network.gradient_batch(inputs, &mut memory.tape, |p, value, gradient| {
                        let member = self.energetic(&local[p], &self.rest[m], value, &gradient, None);
                        parts[p] = (member.energy, member.first);
                    });
                }
            }
            for (p, (point, prediction)) in points.iter().zip(predictions).enumerate() {
                *prediction = self
                    .combine(point, memory.parts[p..].iter().step_by(BATCH), None)
                    .map_err(|error| at_point(chunk * BATCH + p, error))?;
            }
        }
        Ok(())
    }

    /// Computes S and the tangent 2 ∂S/∂C at each C with their uncertainty: the bits of
    /// [`Surrogate::tangent`], one after the other (a tangent fills the registers by itself).
    ///
    /// # Errors
    /// Those of [`Surrogate::tangent`], with the place in the list; a list of predictions of another length.
    pub fn tangents(
        &self,
        c: &[SVector<T, 6>],
        memory: &mut Workspace,
        predictions: &mut [Prediction<T>],
    ) -> Result<(), Error> {
        same_length(c.len(), predictions.len())?;
        for (p, (point, prediction)) in c.iter().zip(predictions).enumerate() {
            *prediction = self.tangent(point, memory).map_err(|error| at_point(p, error))?;
        }
        Ok(())
    }

    pub(super) fn evaluate(
        &self,
        c: &SVector<T, 6>,
        tangent: bool,
        memory: &mut SurrogateScratch<T>,
    ) -> Result<Prediction<T>, Error> {
        check_deformation(c)?;
        let at: [T; 6] = (*c).into();
        let mut slope = [[T::ZERO; 6]; 6];
        memory.parts.clear();
        for m in 0..self.members.len() {
            let rest = self.rest.get(m).copied().unwrap_or_default();
            let member = self.member(m, &at, &rest, tangent, &mut memory.tape);
            memory.parts.push((member.energy, member.first));
            if tangent {
                for a in 0..6 {
                    for b in 0..6 {
                        slope[a][b] += member.second[a][b];
                    }
                }
            }
        }
        self.combine(c, memory.parts.iter(), tangent.then_some(&slope))
    }

    /// The mean of the members, each without its value and stress at rest; `slope`: the sum of their second
    /// derivatives.
    fn combine<'a>(
        &self,
        c: &SVector<T, 6>,
        parts: impl Iterator<Item = &'a (T, [T; 6])> + Clone,
        slope: Option<&[[T; 6]; 6]>,
    ) -> Result<Prediction<T>, Error> {
        let energetic = !matches!(self.header.kind, Kind::Ann);
        let count = T::from_f64(self.members.len() as f64);
        let two = |b: usize| if b < 3 { T::ONE + T::ONE } else { T::ONE };
        let factor = |a: usize| if energetic { two(a) } else { T::ONE };
        let own = |m: usize, first: &[T; 6], a: usize| {
            factor(a) * (first[a] - self.rest.get(m).map_or(T::ZERO, |rest| rest.slope[a]))
        };
        let (mut mean, mut energy) = ([T::ZERO; 6], T::ZERO);
        for (m, (value, first)) in parts.clone().enumerate() {
            for a in 0..6 {
                mean[a] += own(m, first, a) / count;
            }
            if let Some(rest) = self.rest.get(m) {
                let mut linear = T::ZERO;
                for a in 0..6 {
                    linear += rest.slope[a] * (c[a] - if a < 3 { T::ONE } else { T::ZERO });
                }
                energy += (*value - rest.value - linear) / count;
            }
        }
        let (mut square, mut squares) = (0.0, [0.0; 6]);
        for (m, (_, first)) in parts.enumerate() {
            for a in 0..6 {
                let distance = (own(m, first, a) - mean[a]).to_f64();
                square += distance * distance;
                squares[a] += distance * distance;
            }
        }
        let spread = (square / self.members.len() as f64).sqrt();
        let mut flags = self.flags(c);
        flags.spread = self.header.spread_limit.is_some_and(|limit| spread > limit);
        // columns 1–3: 2 ∂S/∂C_11; the others ∂S/∂C_12, counted once (polycore's voigt)
        let tangent = slope.map(|slope| SMatrix::from_fn(|a, b| factor(a) * slope[a][b] * two(b) / count));
        let finite = |value: &T| value.to_f64().is_finite();
        if !mean.iter().chain(tangent.iter().flatten()).all(finite) {
            let found = format!("C = {:?}, where the networks overflow", c.map(Real::to_f64).as_slice());
            return Err(Error::invalid("C", found, "a deformation nearer to the training data"));
        }
        Ok(Prediction {
            stress: SVector::from(mean),
            tangent,
            energy: energetic.then_some(energy),
            spread: T::from_f64(spread),
            deviation: squares.map(|square| T::from_f64((square / self.members.len() as f64).sqrt())).into(),
            flags,
        })
    }

    /// Evaluates one member at c, without its correction at the identity.
    pub(super) fn member(
        &self,
        m: usize,
        c: &[T; 6],
        rest: &RestTerm<T>,
        tangent: bool,
        tape: &mut Tape<T>,
    ) -> Member<T> {
        let network = &self.members[m];
        let mut input = [T::ZERO; LANES];
        let local = self.input(c, &mut input);
        let input = &input[..self.mean.len().min(LANES)];
        if matches!(self.header.kind, Kind::Ann) {
            if !tangent {
                return self.mapped(network.forward(input, tape));
            }
            let (values, slopes) = network.jacobian(input, tape);
            let mut result = self.mapped(values);
            for a in 0..6 {
                for b in 0..6 {
                    result.second[a][b] = self.output[a] * slopes[b][a] * self.inverse[b];
                }
            }
            return result;
        }
        if tangent {
            let (value, gradient, hessian) = network.second_derivatives(input, tape);
            self.energetic(&local, rest, value, &gradient, Some(&hessian))
        } else {
            let (value, gradient) = network.gradient(input, tape);
            self.energetic(&local, rest, value, &gradient, None)
        }
    }

    /// The inputs of the networks at c; returns c in the material axes.
    pub(super) fn input(&self, c: &[T; 6], input: &mut [T; LANES]) -> [T; 6] {
        let Some(invariants) = self.header.kind.invariants() else {
            for k in 0..6 {
                input[k] = (c[k] - self.mean[k]) * self.inverse[k];
            }
            return *c;
        };
        let local = self.turn.as_ref().map_or(*c, |turn| turn.map(|row| product(&row, c)));
        invariants.values(&local, input);
        for k in 0..self.mean.len().min(LANES) {
            input[k] = (input[k] - self.mean[k]) * self.inverse[k];
        }
        local
    }

    /// S of an `ann` from the outputs of its network.
    fn mapped(&self, values: &[T]) -> Member<T> {
        let mut result = Member { energy: T::ZERO, first: [T::ZERO; 6], second: [[T::ZERO; 6]; 6] };
        for a in 0..6 {
            result.first[a] = self.output_mean[a] + self.output[a] * values[a];
        }
        result
    }

    /// W and its derivatives with respect to c from those of a network with respect to its inputs.
    fn energetic(
        &self,
        local: &[T; 6],
        rest: &RestTerm<T>,
        value: T,
        gradient: &[T; LANES],
        hessian: Option<&[[T; LANES]; LANES]>,
    ) -> Member<T> {
        let Some(invariants) = self.header.kind.invariants() else { return self.mapped(&[T::ZERO; 6]) };
        let inputs = self.mean.len().min(LANES);
        let scale = self.output[0];
        let mut slopes = [[T::ZERO; 6]; LANES];
        let (mut first, mut second) = ([T::ZERO; 6], [[T::ZERO; 6]; 6]);
        let mut energy = scale * value;
        let mut corrected = [T::ZERO; LANES];
        invariants.values(local, &mut corrected);
        for k in 0..inputs {
            energy += rest.invariants[k] * (corrected[k] - rest.at[k]);
            let slope = invariants.gradient(local, k);
            slopes[k] = slope.map(|slope| slope * self.inverse[k]);
            let weight = scale * gradient[k] * self.inverse[k] + rest.invariants[k];
            for a in 0..6 {
                first[a] += weight * slope[a];
            }
            if hessian.is_some() {
                invariants.add_curvature(local, k, weight, &mut second);
            }
        }
        if let Some(hessian) = hessian {
            for k in 0..inputs {
                let mut row = [T::ZERO; 6];
                for l in 0..inputs {
                    let weight = scale * hessian[k][l];
                    for b in 0..6 {
                        row[b] += weight * slopes[l][b];
                    }
                }
                for a in 0..6 {
                    for b in 0..6 {
                        second[a][b] += slopes[k][a] * row[b];
                    }
                }
            }
        }
        (first, second) = match &self.turn {
            Some(turn) => to_data_axes(turn, &first, &second),
            None => (first, second),
        };
        Member { energy, first, second }
    }
}

/// Error of one point of a list.
fn at_point(point: usize, error: Error) -> Error {
    match error {
        Error::Invalid { name, found, allowed } => {
            Error::Invalid { name, found: format!("{found} (point {point} of the list)"), allowed }
        }
        other => other,
    }
}

/// Finite and positive definite (leading minors).
fn check_deformation<T: Real + nalgebra::Scalar>(c: &SVector<T, 6>) -> Result<(), Error> {
    let v = c.map(Real::to_f64);
    let bad =
        |found: String| Err(Error::invalid("C", found, "a positive definite tensor of finite components"));
    if let Some(a) = (0..6).find(|&a| !v[a].is_finite()) {
        return bad(format!("component {} = {}", NAMES[a], v[a]));
    }
    let minor = v[0] * v[1] - v[3] * v[3];
    let third = voigt::to_stress(&v).determinant();
    if v[0] > 0.0 && minor > 0.0 && third > 0.0 {
        Ok(())
    } else {
        bad(format!("the leading minors {:e}, {minor:e}, {third:e}", v[0]))
    }
}
