//! A law from networks, without a training framework: stress, tangent, and how far they can be trusted.
//!
//! Two kinds, both functions of C alone and so objective by construction:
//! - `ann`: S = N(C) as in the thesis (3.9); it has no energy, S(I) ≠ 0, and its tangent is not symmetric;
//! - `energy`: W = N(x(C)) − N(x(I)) − S₀ : E with x the invariants of a [`Symmetry`] and S₀ chosen so that
//!   S(I) = 0; S = 2 ∂W/∂C, so that the tangent is symmetric and closed cycles do no work.
//!
//! An ensemble of members is one law: its answer is their mean, their spread a measure of doubt.

mod export;
mod file;
mod header;
mod symmetry;

pub use export::CSource;
pub use header::{Header, Kind};
pub use symmetry::Symmetry;

use crate::Error;
use crate::kinematics::{NAMES, cauchy_of_material};
use crate::network::{LANES, Network, Real, Tape};
use nalgebra::{SMatrix, SVector};
use polycore::tensor::{DeformationGradient, Voigt, voigt};

/// A difference from a component that never changed in the training data that counts as rounding: ten times that of f32.
const UNSEEN: f64 = 1e-6;

/// Why an answer may not be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Flags {
    /// Components of C outside the box of the training data.
    pub outside: [bool; 6],
    /// Of those, the ones that never changed in the training data: shear that was never seen, for example.
    pub unseen: [bool; 6],
    /// The members of the ensemble disagree by more than the law's limit.
    pub spread: bool,
}

impl Flags {
    /// Whether there is any doubt.
    pub fn any(&self) -> bool {
        self.outside.contains(&true) || self.spread
    }
}

/// Stress at a C, with doubts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer<T> {
    /// S (3.3), Pa.
    pub stress: SVector<T, 6>,
    /// ℂ = 2 ∂S/∂C, Pa, in the Voigt order without factors (dS = ℂ dE with doubled shear strains); if asked for.
    pub tangent: Option<SMatrix<T, 6, 6>>,
    /// W, J/m³; an `ann` has none.
    pub energy: Option<T>,
    /// Root mean square over the members of the norm of their distance from the mean, Pa; 0 for a single one.
    pub spread: T,
    /// Doubts.
    pub flags: Flags,
}

/// A law C → S in one of two precisions.
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
    /// Of each member of an energy, so that W(I) = 0 and S(I) = 0: ∂N/∂c at I and N at I, scaled.
    at_identity: Vec<([T; 6], T)>,
}

/// Memory for one evaluation, reused between them.
#[derive(Debug, Clone, Default)]
pub struct Workspace<T> {
    tape: Tape<T>,
    stresses: Vec<[T; 6]>,
}

/// Energy, ∂W/∂c (or S of an `ann`) and their derivatives by c.
struct Member<T> {
    energy: T,
    first: [T; 6],
    second: [[T; 6]; 6],
}

impl<T: Real + nalgebra::Scalar> Surrogate<T> {
    /// A law from its header and the networks of its members.
    ///
    /// # Errors
    /// [`Header::check`]; [`Error::Parameter`] for another number of networks or another architecture, or axes that are
    /// not orthonormal.
    pub fn new(header: Header, members: Vec<Network<T>>) -> Result<Self, Error> {
        header.check()?;
        if members.len() != header.members {
            return Err(Error::parameter("members", members.len(), format!("{}", header.members)));
        }
        if let Some(other) = members.iter().find(|member| *member.architecture() != header.architecture) {
            let found = format!("{:?}", other.architecture());
            return Err(Error::parameter("network", found, format!("{:?}", header.architecture)));
        }
        let list = |values: &[f64]| values.iter().map(|value| T::from_f64(*value)).collect::<Vec<T>>();
        let inverse: Vec<f64> =
            header.input_deviation.iter().map(|d| if *d == 0.0 { 0.0 } else { 1.0 / d }).collect();
        let turn = match &header.kind {
            Kind::Energy { axes, .. } => {
                let matrix = symmetry::into_material_axes(axes)?;
                let identity = matrix == polycore::tensor::Voigt6x6::identity();
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
            header,
            members,
            turn,
            at_identity: Vec::new(),
        };
        if matches!(law.header.kind, Kind::Energy { .. }) {
            let mut tape = Tape::default();
            let identity = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0].map(T::from_f64);
            let zero = ([T::ZERO; 6], T::ZERO);
            law.at_identity = vec![zero; law.members.len()];
            let raw = (0..law.members.len()).map(|m| {
                let at = law.member(m, &identity, false, &mut tape);
                (at.first, at.energy)
            });
            law.at_identity = raw.collect();
        }
        Ok(law)
    }

    /// A law with random weights ([`Network::random`], seeds `seed`, `seed` + 1, …).
    ///
    /// # Errors
    /// Those of [`Surrogate::new`].
    pub fn random(header: Header, seed: u64) -> Result<Self, Error> {
        header.check()?;
        let network = |m: usize| Network::random(header.architecture.clone(), seed.wrapping_add(m as u64));
        let members = (0..header.members).map(network).collect::<Result<Vec<_>, _>>()?;
        Self::new(header, members)
    }

    /// Everything but the weights.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The networks.
    pub fn members(&self) -> &[Network<T>] {
        &self.members
    }

    /// The same law in another precision.
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

    /// Which components of C leave the training data; for the spread see [`Surrogate::stress`].
    pub fn flags(&self, c: &SVector<T, 6>) -> Flags {
        let mut flags = Flags::default();
        for (a, [low, high]) in self.header.training_box.iter().enumerate() {
            let value = c[a].to_f64();
            // what never changed may differ by rounding; NaN is outside
            let slack = if low == high { UNSEEN } else { 0.0 };
            flags.outside[a] = !(value >= low - slack && value <= high + slack);
            flags.unseen[a] = flags.outside[a] && low == high;
        }
        flags
    }

    /// S at C with its doubts.
    ///
    /// # Errors
    /// Those of [`Surrogate::tangent`].
    pub fn stress(&self, c: &SVector<T, 6>, memory: &mut Workspace<T>) -> Result<Answer<T>, Error> {
        self.evaluate(c, false, memory)
    }

    /// S and the tangent 2 ∂S/∂C at C with their doubts.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a C that is not finite or not positive definite, and for an answer that is not finite
    /// (a C so far away that the networks overflow).
    pub fn tangent(&self, c: &SVector<T, 6>, memory: &mut Workspace<T>) -> Result<Answer<T>, Error> {
        self.evaluate(c, true, memory)
    }

    fn evaluate(
        &self,
        c: &SVector<T, 6>,
        tangent: bool,
        memory: &mut Workspace<T>,
    ) -> Result<Answer<T>, Error> {
        check_deformation(c)?;
        let at: [T; 6] = (*c).into();
        let count = T::from_f64(self.members.len() as f64);
        let energetic = matches!(self.header.kind, Kind::Energy { .. });
        let factor = |a: usize| if energetic && a < 3 { T::ONE + T::ONE } else { T::ONE };
        let (mut mean, mut slope, mut energy) = ([T::ZERO; 6], [[T::ZERO; 6]; 6], T::ZERO);
        memory.stresses.clear();
        for m in 0..self.members.len() {
            let member = self.member(m, &at, tangent, &mut memory.tape);
            let mut stress = [T::ZERO; 6];
            for a in 0..6 {
                let rest = self.at_identity.get(m).map_or(T::ZERO, |(first, _)| first[a]);
                stress[a] = factor(a) * (member.first[a] - rest);
                mean[a] += stress[a] / count;
                for b in 0..6 {
                    slope[a][b] += factor(a) * member.second[a][b] / count;
                }
            }
            if let Some((first, at_rest)) = self.at_identity.get(m) {
                let mut linear = T::ZERO;
                for a in 0..6 {
                    linear += first[a] * (at[a] - if a < 3 { T::ONE } else { T::ZERO });
                }
                energy += (member.energy - *at_rest - linear) / count;
            }
            memory.stresses.push(stress);
        }
        let mut square = 0.0;
        for stress in &memory.stresses {
            square += (0..6).map(|a| (stress[a] - mean[a]).to_f64().powi(2)).sum::<f64>();
        }
        let spread = (square / self.members.len() as f64).sqrt();
        let mut flags = self.flags(c);
        flags.spread = self.header.spread_limit.is_some_and(|limit| spread > limit);
        // columns 1–3: 2 ∂S/∂C_11; the others ∂S/∂C_12, counted once (polycore's voigt)
        let two = |b: usize| if b < 3 { T::ONE + T::ONE } else { T::ONE };
        let matrix = SMatrix::<T, 6, 6>::from_fn(|a, b| slope[a][b] * two(b));
        let finite = mean.iter().all(|s| s.to_f64().is_finite())
            && (!tangent || matrix.iter().all(|d| d.to_f64().is_finite()));
        if !finite {
            let found = format!("C = {:?}, where the networks overflow", at.map(Real::to_f64));
            return Err(Error::parameter("C", found, "a deformation nearer to the training data"));
        }
        Ok(Answer {
            stress: SVector::from(mean),
            tangent: tangent.then_some(matrix),
            energy: energetic.then_some(energy),
            spread: T::from_f64(spread),
            flags,
        })
    }

    /// One member at c, without its correction at the identity.
    fn member(&self, m: usize, c: &[T; 6], tangent: bool, tape: &mut Tape<T>) -> Member<T> {
        let network = &self.members[m];
        let mut result = Member { energy: T::ZERO, first: [T::ZERO; 6], second: [[T::ZERO; 6]; 6] };
        let mut input = [T::ZERO; LANES];
        let inputs = self.mean.len().min(LANES);
        match &self.header.kind {
            Kind::Ann => {
                for k in 0..inputs {
                    input[k] = (c[k] - self.mean[k]) * self.inverse[k];
                }
                if tangent {
                    let (values, slopes) = network.jacobian(&input[..inputs], tape);
                    for a in 0..6 {
                        result.first[a] = self.output_mean[a] + self.output[a] * values[a];
                        for b in 0..6 {
                            result.second[a][b] = self.output[a] * slopes[a][b] * self.inverse[b];
                        }
                    }
                } else {
                    let values = network.forward(&input[..inputs], tape);
                    for a in 0..6 {
                        result.first[a] = self.output_mean[a] + self.output[a] * values[a];
                    }
                }
            }
            Kind::Energy { symmetry, .. } => {
                let local = self.turn.as_ref().map_or(*c, |turn| turn.map(|row| product(&row, c)));
                symmetry.values(&local, &mut input);
                for k in 0..inputs {
                    input[k] = (input[k] - self.mean[k]) * self.inverse[k];
                }
                let (value, gradient, hessian) = network.derivatives(&input[..inputs], tangent, tape);
                let scale = self.output[0];
                result.energy = scale * value;
                let mut slopes = [[T::ZERO; 6]; LANES];
                let (mut first, mut second) = ([T::ZERO; 6], [[T::ZERO; 6]; 6]);
                for k in 0..inputs {
                    slopes[k] = symmetry.gradient(&local, k).map(|slope| slope * self.inverse[k]);
                    let weight = scale * gradient[k];
                    for a in 0..6 {
                        first[a] += weight * slopes[k][a];
                    }
                    if tangent {
                        symmetry.add_curvature(&local, k, weight * self.inverse[k], &mut second);
                    }
                }
                if tangent {
                    for k in 0..inputs {
                        for l in 0..inputs {
                            let weight = scale * hessian[k][l];
                            for a in 0..6 {
                                let row = weight * slopes[k][a];
                                for b in 0..6 {
                                    second[a][b] += row * slopes[l][b];
                                }
                            }
                        }
                    }
                }
                (result.first, result.second) = match &self.turn {
                    Some(turn) => back(turn, &first, &second),
                    None => (first, second),
                };
            }
        }
        result
    }
}

impl Surrogate<f64> {
    /// σ and its doubts at F: S at C = FᵀF, pushed forward; σ(RF) = R σ(F) Rᵀ.
    ///
    /// # Errors
    /// [`Surrogate::stress`].
    pub fn cauchy(
        &self,
        deformation: &DeformationGradient,
        memory: &mut Workspace<f64>,
    ) -> Result<(Voigt, Flags), Error> {
        let c = voigt::from_stress(&deformation.right_cauchy_green());
        let answer = self.stress(&c, memory)?;
        Ok((cauchy_of_material(deformation, &answer.stress), answer.flags))
    }
}

fn product<T: Real>(row: &[T; 6], c: &[T; 6]) -> T {
    let mut sum = T::ZERO;
    for (&weight, &value) in row.iter().zip(c) {
        sum += weight * value;
    }
    sum
}

/// Tᵀ g and Tᵀ H T: derivatives by c from those by T c.
fn back<T: Real>(turn: &[[T; 6]; 6], g: &[T; 6], h: &[[T; 6]; 6]) -> ([T; 6], [[T; 6]; 6]) {
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

/// Finite and positive definite (leading minors).
fn check_deformation<T: Real + nalgebra::Scalar>(c: &SVector<T, 6>) -> Result<(), Error> {
    let v = c.map(Real::to_f64);
    let bad =
        |found: String| Err(Error::parameter("C", found, "a positive definite tensor of finite components"));
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

#[cfg(test)]
mod tests;
