//! Levenberg–Marquardt from several starting points, and the covariance at the minimum.

use crate::error::Error;
use nalgebra::{DMatrix, DVector};
use polycore::numerics::least_squares::{Optimum, levenberg_marquardt};
use polycore::posterior;
use std::cell::Cell;

/// Residuals, model minus measurement, at given parameters; `None` outside the model's domain.
pub type Residuals<'a> = dyn Fn(&[f64]) -> Option<Vec<f64>> + 'a;

/// Residual of rejected trial points: no step to them is accepted.
const REJECTED_RESIDUAL: f64 = 1e100;

/// Smallest relative eigenvalue of the normal matrix, with its columns scaled to 1, at which the parameters
/// count as determined: differences have errors of 1e-10, which the matrix squares with the condition.
const MIN_EIGENVALUE: f64 = 1e-12;

/// Relative difference step for residuals exact to rounding: ∛ε, good to 1e-10.
pub const STEP: f64 = 6e-6;

/// A minimum of the sum of squares.
pub struct Minimum {
    /// Parameters.
    pub parameters: Vec<f64>,
    /// Residuals at the minimum.
    pub residuals: Vec<f64>,
    /// Covariance of the parameters, s² (JᵀJ)⁻¹ with s² = Σr²/(m − k).
    pub covariance: DMatrix<f64>,
    /// Degrees of freedom m − k.
    pub degrees: usize,
    /// Number of evaluations of all residuals, without those for derivatives.
    pub evaluations: usize,
}

impl Minimum {
    /// Root mean square of the residuals.
    pub fn rms(&self) -> f64 {
        (self.residuals.iter().map(|r| r * r).sum::<f64>() / self.residuals.len() as f64).sqrt()
    }

    /// Draws parameters from their posterior ([`polycore::posterior`]) and converts each draw to constants.
    pub fn draws(&self, constants: impl Fn(&[f64]) -> Vec<f64>) -> Vec<Vec<f64>> {
        let drawn = posterior::draws(&self.parameters, &self.covariance, self.degrees, posterior::DRAWS, 0);
        drawn.unwrap_or_default().iter().map(|q| constants(q)).collect()
    }

    /// Standard error of a function of the parameters, from its gradient.
    pub fn error_of(&self, gradient: &[f64]) -> f64 {
        let gradient = DVector::from_row_slice(gradient);
        (gradient.transpose() * &self.covariance * gradient)[(0, 0)].max(0.0).sqrt()
    }
}

/// Returns the best minimum over all starting points of `count` residuals, with central differences of
/// relative size `step`.
///
/// # Errors
/// [`Error::Data`] if no start converges, or if the data do not determine the parameters.
pub fn minimize(
    what: &str,
    residuals: &Residuals,
    count: usize,
    starts: &[Vec<f64>],
    step: f64,
) -> Result<Minimum, Error> {
    let refuse = |reason: &str| Error::Data { what: what.to_owned(), reason: reason.to_owned() };
    let mut best: Option<(f64, DVector<f64>)> = None;
    let evaluations = Cell::new(0);
    let trial = |at: &DVector<f64>| {
        evaluations.set(evaluations.get() + 1);
        // a trial outside the domain must be rejected; `None` would end the search
        Some(DVector::from_vec(residuals(at.as_slice()).unwrap_or_else(|| vec![REJECTED_RESIDUAL; count])))
    };
    for start in starts {
        let at = DVector::from_row_slice(start);
        let Optimum { at, objective } =
            levenberg_marquardt(at, 200, trial, |at| jacobian(residuals, at, step));
        let better = best.as_ref().is_none_or(|(least, _)| objective < *least);
        if objective < REJECTED_RESIDUAL && better && residuals(at.as_slice()).is_some() {
            best = Some((objective, at));
        }
    }
    let undetermined =
        "the data do not determine all parameters (the model hardly changes along some direction)";
    let (_, at) = best.ok_or_else(|| refuse("no start converged"))?;
    let found = residuals(at.as_slice()).ok_or_else(|| refuse("no start converged"))?;
    let jacobian = jacobian(residuals, &at, step).ok_or_else(|| refuse(undetermined))?;
    let norms: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    if norms.iter().any(|norm| norm.is_nan() || *norm < 1e-9) {
        return Err(refuse(undetermined));
    }
    let scaled = DMatrix::from_fn(count, at.len(), |row, column| jacobian[(row, column)] / norms[column]);
    let normal = scaled.tr_mul(&scaled);
    if normal.clone().symmetric_eigenvalues().min() < MIN_EIGENVALUE {
        return Err(refuse(undetermined));
    }
    let inverse = normal.cholesky().ok_or_else(|| refuse(undetermined))?.inverse();
    let degrees = count.saturating_sub(at.len()).max(1);
    let variance = found.iter().map(|r| r * r).sum::<f64>() / degrees as f64;
    let covariance =
        DMatrix::from_fn(at.len(), at.len(), |i, j| variance * inverse[(i, j)] / (norms[i] * norms[j]));
    let parameters = at.as_slice().to_vec();
    Ok(Minimum { parameters, residuals: found, covariance, degrees, evaluations: evaluations.get() })
}

/// Computes the Jacobian by central differences.
fn jacobian(residuals: &Residuals, at: &DVector<f64>, step: f64) -> Option<DMatrix<f64>> {
    let mut columns = Vec::with_capacity(at.len());
    for i in 0..at.len() {
        let step = step * at[i].abs().max(1.0);
        let (mut up, mut down) = (at.clone(), at.clone());
        up[i] += step;
        down[i] -= step;
        let [above, below] = [residuals(up.as_slice())?, residuals(down.as_slice())?];
        let width = up[i] - down[i];
        columns.push(DVector::from_iterator(
            above.len(),
            above.iter().zip(&below).map(|(a, b)| (a - b) / width),
        ));
    }
    Some(DMatrix::from_columns(&columns))
}
