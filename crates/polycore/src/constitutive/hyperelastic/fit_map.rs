//! Unconstrained parameters of fits: the optimiser's problem, and the uncertainty at its minimum.

use nalgebra::{DMatrix, DVector};

use super::data::{TestData, TestState};
use super::descriptor::UNLIMITED;
use super::{Domain, Error, Hyperelastic, ModelDescriptor};

/// Verdict of the data on a fitted parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Identifiability {
    /// Determined by the data.
    Determined,
    /// Modulus without effect on the stresses, or the exponent of such a term: the term is absent.
    Absent,
    /// Not bounded from above by the data, e.g. a locking limit far beyond them.
    Undetermined,
}

/// Residuals of the fit, Pa, state by state: √w r (P − P_measured) of each measured stress, with r of
/// [`TestState::ratio`] and the weight w.
///
/// # Errors
/// Errors of the law at a state of the table.
pub fn residuals<L: Hyperelastic + ?Sized>(law: &L, table: &TestData) -> Result<Vec<f64>, Error> {
    let mut residuals = Vec::with_capacity(2 * table.states.len());
    for state in &table.states {
        let nominal = state.predict(law)?;
        let measured = (0..2).filter(|&axis| state.nominal[axis] != 0.0);
        residuals.extend(measured.map(|axis| state.factor(axis) * (nominal[axis] - state.nominal[axis])));
    }
    Ok(residuals)
}

/// Least effect on the stresses that counts: the differences carry 1e-10.
const LEAST_EFFECT: f64 = 1e-6;

/// Uncertainty of the parameters at a minimum.
pub(super) struct FitUncertainty {
    /// Standard errors.
    pub errors: Vec<Option<f64>>,
    /// Verdict on each parameter.
    pub identifiability: Vec<Identifiability>,
    /// Draws of all parameters.
    pub draws: Vec<Vec<f64>>,
    /// As [`super::fit::Fit::collinear`].
    pub collinear: bool,
}

/// Least eigenvalue of the normal matrix of unit columns that counts.
const LEAST_EIGENVALUE: f64 = 1e-9;

/// Axis, state and computed stresses of each measured stress, state by state.
fn measured<'a>(
    table: &'a TestData,
    mut nominal: impl FnMut(&TestState) -> [f64; 2] + 'a,
) -> impl Iterator<Item = (usize, &'a TestState, [f64; 2])> + 'a {
    table.states.iter().flat_map(move |state| {
        let found = nominal(state);
        (0..2).filter(|&axis| state.nominal[axis] != 0.0).map(move |axis| (axis, state, found))
    })
}

/// Map between the parameters p of a law and the unbounded q of the optimiser.
pub(super) struct ParameterMap<'a> {
    pub model: &'a ModelDescriptor,
    /// Lower limit of each p.
    pub limits: Vec<f64>,
    /// Unit of stresses, Pa.
    pub modulus: f64,
}

/// Bound of |q|, beyond which a parameter is practically at its limit or at infinity; e^±40 = 4e∓18.
pub(super) const LARGEST_LOG: f64 = 40.0;

impl<'a> ParameterMap<'a> {
    pub fn new(model: &'a ModelDescriptor, table: &TestData, modulus: f64) -> Result<Self, Error> {
        let mut limits = Vec::new();
        for parameter in model.parameters {
            limits.push(match parameter.domain {
                Domain::Real => f64::NEG_INFINITY,
                Domain::Positive => 0.0,
                Domain::Above(limit) => {
                    let mut most = 0.0_f64;
                    for state in &table.states {
                        most = most.max(limit(state.principal_stretches()?));
                    }
                    most
                }
            });
        }
        Ok(Self { model, limits, modulus })
    }

    fn scale(&self, i: usize) -> f64 {
        if self.model.parameters[i].unit == "Pa" { self.modulus } else { 1.0 }
    }

    pub fn parameters(&self, q: &DVector<f64>) -> Vec<f64> {
        (0..q.len()).map(|i| self.value(i, q[i]).0).collect()
    }

    /// p and dp/dq.
    fn value(&self, i: usize, q: f64) -> (f64, f64) {
        let exponential = q.clamp(-LARGEST_LOG, LARGEST_LOG).exp();
        match self.model.parameters[i].domain {
            Domain::Real => (q * self.scale(i), self.scale(i)),
            Domain::Positive => (exponential * self.scale(i), exponential * self.scale(i)),
            Domain::Above(_) => {
                // never the limit itself, where the energy is infinite, nor beyond what data can tell from
                // infinity
                let excess = self.limits[i] * exponential.clamp(1e-12, UNLIMITED);
                (self.limits[i] + excess, excess)
            }
        }
    }

    pub fn inverse(&self, p: &[f64]) -> DVector<f64> {
        DVector::from_fn(p.len(), |i, _| match self.model.parameters[i].domain {
            Domain::Real => p[i] / self.scale(i),
            Domain::Positive => (p[i] / self.scale(i)).ln(),
            Domain::Above(_) => (p[i] / self.limits[i] - 1.0).ln(),
        })
    }

    /// Residuals in units of the modulus.
    pub fn residuals(&self, q: &DVector<f64>, table: &TestData) -> Option<DVector<f64>> {
        let p = self.parameters(q);
        let residuals = match self.model.slopes {
            Some(slopes) => {
                let mut unused = vec![[0.0; 2]; p.len()];
                measured(table, |state| state.predict_slopes(slopes, &p, &mut unused))
                    .map(|(i, state, nominal)| state.factor(i) * (nominal[i] - state.nominal[i]))
                    .collect()
            }
            None => residuals(&self.model.law(&p).ok()?, table).ok()?,
        };
        let residuals = DVector::from_vec(residuals) / self.modulus;
        residuals.iter().all(|residual| residual.is_finite()).then_some(residuals)
    }

    /// dr/dq, in closed form or by central differences of step ∛ε, good to 1e-10.
    pub(super) fn jacobian(&self, q: &DVector<f64>, table: &TestData) -> Option<DMatrix<f64>> {
        if let Some(slopes) = self.model.slopes {
            let values: Vec<(f64, f64)> = (0..q.len()).map(|i| self.value(i, q[i])).collect();
            let p: Vec<f64> = values.iter().map(|value| value.0).collect();
            let mut rows = DMatrix::zeros(table.measurements(), q.len());
            let mut of = vec![[0.0; 2]; p.len()];
            let mut row = 0;
            for state in &table.states {
                state.predict_slopes(slopes, &p, &mut of);
                for axis in (0..2).filter(|&axis| state.nominal[axis] != 0.0) {
                    for (i, value) in values.iter().enumerate() {
                        rows[(row, i)] = state.factor(axis) * of[i][axis] * value.1 / self.modulus;
                    }
                    row += 1;
                }
            }
            return rows.iter().all(|slope: &f64| slope.is_finite()).then_some(rows);
        }
        let mut columns = Vec::with_capacity(q.len());
        for i in 0..q.len() {
            let step = f64::EPSILON.cbrt() * q[i].abs().max(1.0);
            let (mut up, mut down) = (q.clone(), q.clone());
            up[i] += step;
            down[i] -= step;
            let difference = self.residuals(&up, table)? - self.residuals(&down, table)?;
            columns.push(difference / (up[i] - down[i]));
        }
        Some(DMatrix::from_columns(&columns))
    }

    /// Computes the uncertainty of the parameters. Those without effect on the residuals have no standard
    /// error; none has if the others are collinear.
    pub fn uncertainty(&self, q: &DVector<f64>, table: &TestData) -> FitUncertainty {
        let mut found = FitUncertainty {
            errors: vec![None; q.len()],
            identifiability: vec![Identifiability::Determined; q.len()],
            draws: Vec::new(),
            collinear: self.is_collinear(q, table),
        };
        let effects =
            self.jacobian(q, table).map(|jacobian| jacobian.column_iter().map(|c| c.norm()).collect());
        let effects: Vec<f64> = effects.unwrap_or_default();
        for (i, effect) in effects.iter().enumerate() {
            let parameter = &self.model.parameters[i];
            let modulus = matches!(parameter.domain, Domain::Positive) && parameter.unit == "Pa";
            let unlimited = matches!(parameter.domain, Domain::Above(_)) && q[i].exp() > 0.1 * UNLIMITED;
            found.identifiability[i] = match modulus {
                true if *effect <= LEAST_EFFECT => Identifiability::Absent,
                // the exponent of a term that is absent
                false
                    if *effect <= LEAST_EFFECT
                        && i > 0
                        && found.identifiability[i - 1] == Identifiability::Absent =>
                {
                    Identifiability::Absent
                }
                false if *effect <= LEAST_EFFECT || unlimited => Identifiability::Undetermined,
                _ => Identifiability::Determined,
            };
        }
        let Some((live, covariance, degrees)) = self.covariance(q, table) else {
            return found;
        };
        for (k, &i) in live.iter().enumerate() {
            found.errors[i] = Some(covariance[(k, k)].sqrt() * self.value(i, q[i]).1.abs());
        }
        let at: Vec<f64> = live.iter().map(|&i| q[i]).collect();
        let drawn = crate::posterior::draws(&at, &covariance, degrees, crate::posterior::DRAWS, 0);
        let parameters = |drawn: Vec<f64>| {
            let mut q = q.clone();
            live.iter().zip(drawn).for_each(|(&i, value)| q[i] = value);
            self.parameters(&q)
        };
        found.draws = drawn.unwrap_or_default().into_iter().map(parameters).collect();
        found
    }

    /// Returns true if other values of the q with an effect on the residuals leave them as they are, to first
    /// order: their Jacobian has a lower rank than their number.
    fn is_collinear(&self, q: &DVector<f64>, table: &TestData) -> bool {
        let Some(jacobian) = self.jacobian(q, table) else { return false };
        let columns = jacobian.column_iter().map(|column| (column.norm(), column));
        let live: Vec<_> =
            columns.filter(|own| own.0 > LEAST_EFFECT).map(|(norm, column)| column / norm).collect();
        if live.is_empty() {
            return false;
        }
        let scaled = DMatrix::from_columns(&live);
        scaled.tr_mul(&scaled).symmetric_eigenvalues().min() < LEAST_EIGENVALUE
    }

    /// Returns the q that the residuals determine, their covariance s²(JᵀJ)⁻¹ and the degrees of freedom.
    fn covariance(&self, q: &DVector<f64>, table: &TestData) -> Option<(Vec<usize>, DMatrix<f64>, usize)> {
        let (residuals, jacobian) = (self.residuals(q, table)?, self.jacobian(q, table)?);
        let norms: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
        let live: Vec<usize> = (0..q.len()).filter(|&i| norms[i] > LEAST_EFFECT).collect();
        let columns: Vec<_> = live.iter().map(|&i| jacobian.column(i) / norms[i]).collect();
        if columns.is_empty() || residuals.len() <= live.len() {
            return None;
        }
        let scaled = DMatrix::from_columns(&columns);
        let normal = scaled.tr_mul(&scaled);
        if normal.clone().symmetric_eigenvalues().min() < LEAST_EIGENVALUE {
            return None;
        }
        let degrees = residuals.len() - live.len();
        let variance = residuals.norm_squared() / degrees as f64;
        let inverse = normal.cholesky()?.inverse();
        let covariance = DMatrix::from_fn(live.len(), live.len(), |a, b| {
            variance * inverse[(a, b)] / (norms[live[a]] * norms[live[b]])
        });
        Some((live, covariance, degrees))
    }
}

/// Residual in units of the modulus with which no step is accepted.
pub(super) const REJECTED: f64 = 1e100;
