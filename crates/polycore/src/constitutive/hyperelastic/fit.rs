//! Least-squares fit of a law to measured states.
//!
//! The objective is the weighted sum of squares of the nominal-stress residuals, over every measured stress
//! of the table (those that are not exactly zero; [`super::data::TestState::nominal`]); weights are 1 unless
//! a table has others. The figure of merit, `rms`, is the root of its mean. Levenberg–Marquardt in
//! transformed parameters (ln p for positive ones, ln(p/limit − 1) for locking limits) keeps every iterate in
//! the law's domain; several starting points guard against local minima.

use std::cell::Cell;

use nalgebra::DVector;

use super::data::TestData;
use super::descriptor::FitStart;
pub use super::fit_map::{Identifiability, residuals};
use super::fit_map::{ParameterMap, REJECTED};
use super::{Error, Hyperelastic, ModelDescriptor, ModelKind};
use crate::numerics::least_squares::{Optimum, levenberg_marquardt};

/// A fitted law.
pub struct Fit {
    /// The law.
    pub law: Box<dyn Hyperelastic>,
    /// Model that was fitted.
    pub model: &'static ModelDescriptor,
    /// Parameters of the law.
    pub parameters: Vec<FittedParameter>,
    /// Root mean square of the residuals over the measured stresses, weighted, Pa.
    pub rms: f64,
    /// Root of χ² over the degrees of freedom, 1 on average if the errors of the tests are all: `None` if
    /// their standard deviations are not known.
    pub chi: Option<f64>,
    /// Draws of all parameters from their posterior ([`crate::posterior`]); those that the data do not
    /// determine keep their values. Empty if the data determine none.
    pub draws: Vec<Vec<f64>>,
    /// True if other values of the parameters fit as well, to first order: the data determine combinations of
    /// them alone.
    pub collinear: bool,
    /// Number of measured stresses.
    pub measurements: usize,
    /// Number of evaluations of all residuals, over all starts (without those for derivatives).
    pub iterations: usize,
    /// Number of starts, and of those that ended within 1e-4 of the best rms.
    pub starts: (usize, usize),
}

/// A fitted parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedParameter {
    /// Name of the parameter.
    pub name: &'static str,
    /// `Pa` or `1`.
    pub unit: &'static str,
    /// Value in `unit`.
    pub value: f64,
    /// Standard error from s²(JᵀJ)⁻¹ at the minimum, s² = Σr²/(m − k). `None` if the data do not determine
    /// the parameter: it lies at an end of its domain, which for a locking limit is 1e6 × the least
    /// admissible value.
    pub standard_error: Option<f64>,
    /// Verdict of the data on the parameter.
    pub identifiability: Identifiability,
}

/// Root mean square of model minus data, with the weights of the table, Pa.
///
/// # Errors
/// As [`residuals`].
pub fn rms<L: Hyperelastic + ?Sized>(law: &L, table: &TestData) -> Result<f64, Error> {
    let residuals = residuals(law, table)?;
    Ok((residuals.iter().map(|r| r * r).sum::<f64>() / table.weight_sum()).sqrt())
}

/// Agreement of a law with the measured stresses of a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agreement {
    /// Root mean square of the residuals, Pa.
    pub rms: f64,
    /// Mean of their absolute values, Pa.
    pub mae: f64,
    /// Coefficient of determination 1 − Σr²/Σ(P − P̄)², P̄ the mean of the measured stresses; `None` if they
    /// are all equal.
    pub r2: Option<f64>,
}

impl Agreement {
    /// Compares a law with test data.
    ///
    /// # Errors
    /// As [`residuals`]: at a state beyond locking there is no stress to compare.
    pub fn new<L: Hyperelastic + ?Sized>(law: &L, table: &TestData) -> Result<Self, Error> {
        let measured = table.states.iter().flat_map(|state| state.measured().zip(state.measured_roots()));
        Ok(Self::of_weighted_residuals(&residuals(law, table)?, measured))
    }

    /// Summarizes residuals of measured stresses, Pa, both of one length.
    pub(crate) fn of_residuals(residuals: &[f64], measured: impl Iterator<Item = f64> + Clone) -> Self {
        Self::of_weighted_residuals(residuals, measured.map(|data| (data, 1.0)))
    }

    /// Summarizes residuals that are multiplied by the roots of their weights, of measured stresses with
    /// these roots.
    fn of_weighted_residuals(residuals: &[f64], measured: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        let count: f64 = measured.clone().map(|(_, root)| root * root).sum();
        let mean = measured.clone().map(|(data, root)| root * root * data).sum::<f64>() / count;
        let variation: f64 = measured.clone().map(|(data, root)| (root * (data - mean)).powi(2)).sum();
        let squares: f64 = residuals.iter().map(|r| r * r).sum();
        let sizes = residuals.iter().zip(measured).map(|(residual, (_, root))| root * residual.abs());
        Self {
            rms: (squares / count).sqrt(),
            mae: sizes.sum::<f64>() / count,
            r2: (variation > 0.0).then(|| 1.0 - squares / variation),
        }
    }
}

/// Finds the best fit of a model to a table: never worse than that of a law that it contains.
///
/// # Errors
/// [`Error::Data`] if the table has fewer measurements than the law has parameters, or a mean stiffness below
/// zero, and for compressible laws; [`Error::NoConvergence`] if no start converges.
pub fn fit(model: &'static ModelDescriptor, table: &TestData) -> Result<Fit, Error> {
    fit_until(model, table, &|| false)
}

/// Fits as [`fit`] does, until `stop` returns true.
///
/// # Errors
/// As [`fit`]; [`Error::Stopped`].
pub fn fit_until(
    model: &'static ModelDescriptor,
    table: &TestData,
    stop: &dyn Fn() -> bool,
) -> Result<Fit, Error> {
    if model.kind == ModelKind::Compressible {
        let reason = "tests at constant volume do not determine its volume; `foam::fit` fits it".to_owned();
        return Err(Error::Data { what: format!("fit of `{}`", model.key), reason });
    }
    let measurements = table.measurements();
    if measurements < model.parameters.len() {
        return Err(Error::Data {
            what: format!("fit of `{}`", model.key),
            reason: format!("{measurements} measurements for {} parameters", model.parameters.len()),
        });
    }
    let map = ParameterMap::new(model, table, neo_hookean_modulus(table)?)?;
    let FitMinimum { at, starts, iterations } = minimum(&map, table, stop)?;
    let values = map.parameters(&at);
    let law = model.law(&values)?;
    let rms = rms(&law, table)?;
    let found = map.uncertainty(&at, table);
    let degrees = measurements - model.parameters.len();
    let chi = table
        .deviation
        .filter(|_| degrees > 0)
        .map(|deviation| rms / deviation * (table.weight_sum() / degrees as f64).sqrt());
    let parameters = model
        .parameters
        .iter()
        .zip(values)
        .enumerate()
        .map(|(i, (parameter, value))| FittedParameter {
            name: parameter.name,
            unit: parameter.unit,
            value,
            standard_error: found.errors[i],
            identifiability: found.identifiability[i],
        })
        .collect();
    let (draws, collinear) = (found.draws, found.collinear);
    Ok(Fit { law, model, parameters, rms, chi, draws, collinear, measurements, iterations, starts })
}

/// Best parameters of a model.
struct FitMinimum {
    /// Parameters in the optimiser's variables.
    at: DVector<f64>,
    /// As [`Fit::starts`] and [`Fit::iterations`].
    starts: (usize, usize),
    iterations: usize,
}

/// Evaluations of a search per parameter.
const PATIENCE: usize = 200;
/// The same from parameters that [`ModelDescriptor::refine`] has found: it would follow a flat valley.
const REFINED_PATIENCE: usize = 20;

fn minimum(map: &ParameterMap<'_>, table: &TestData, stop: &dyn Fn() -> bool) -> Result<FitMinimum, Error> {
    let model = map.model;
    let measurements = table.measurements();
    let mut ends: Vec<(f64, DVector<f64>)> = Vec::new();
    let evaluations = Cell::new(0);
    let residuals = |q: &DVector<f64>| {
        evaluations.update(|count| count + 1);
        // a trial where the law overflows must be rejected; `None` would end the search
        let rejected = || DVector::from_element(measurements, REJECTED);
        Some(map.residuals(q, table).unwrap_or_else(rejected))
    };
    let start =
        FitStart { limits: &map.limits, modulus: map.modulus, table, stop, evaluations: &evaluations };
    let mut starts = (model.starts)(&start);
    for contained in model.contains {
        let inner = super::model(contained.key).and_then(|inner| {
            let map = ParameterMap::new(inner, table, map.modulus)?;
            Ok(map.parameters(&minimum(&map, table, stop)?.at))
        });
        let values = match inner {
            Ok(values) => values,
            Err(Error::Stopped) => return Err(Error::Stopped),
            // the outer law has starts of its own
            Err(_) => continue,
        };
        let grown = (contained.embed)(&values, &start);
        if let Some(embedded) = grown.first() {
            let at = map.inverse(embedded);
            if let Some(residuals) = map.residuals(&at, table) {
                ends.push((0.5 * residuals.norm_squared(), at));
            }
        }
        starts.extend(grown);
    }
    let patience = if model.refine.is_some() { REFINED_PATIENCE } else { PATIENCE };
    let search = |from: &[f64], ends: &mut Vec<(f64, DVector<f64>)>| {
        // nothing ends the search
        let jacobian = |q: &DVector<f64>| if stop() { None } else { map.jacobian(q, table) };
        let Optimum { at, objective } = levenberg_marquardt(map.inverse(from), patience, residuals, jacobian);
        if objective < REJECTED && map.residuals(&at, table).is_some() {
            ends.push((objective, at));
        }
    };
    for from in &starts {
        if stop() {
            return Err(Error::Stopped);
        }
        match model.refine {
            Some(refine) => search(&refine(from, &start), &mut ends),
            None => search(from, &mut ends),
        }
    }
    let by_misfit = |a: &&(f64, DVector<f64>), b: &&(f64, DVector<f64>)| a.0.total_cmp(&b.0);
    let end = ends.iter().min_by(by_misfit).map(|end| map.parameters(&end.1));
    if let (Some(refine), Some(end)) = (model.refine, end) {
        search(&refine(&end, &start), &mut ends);
    }
    if stop() {
        return Err(Error::Stopped);
    }
    let Some((least, best)) = ends.iter().min_by(by_misfit) else {
        return Err(Error::NoConvergence {
            iteration: model.key,
            steps: evaluations.get(),
            residual: f64::NAN,
        });
    };
    // objective = ½Σr², so 1e-4 in rms is 2e-4 in the objective
    let agreeing = ends.iter().filter(|(objective, _)| *objective <= least * (1.0 + 2e-4)).count();
    let starts = (starts.len(), agreeing.min(starts.len()));
    Ok(FitMinimum { at: best.clone(), starts, iterations: evaluations.get() })
}

/// Modulus of the best neo-Hookean law, Pa, in closed form: P is linear in μ. It is the scale and the
/// starting point of every fit.
///
/// # Errors
/// [`Error::Data`] if it is not above zero.
pub fn neo_hookean_modulus(table: &TestData) -> Result<f64, Error> {
    let unit = super::NeoHookean::new(1.0)?;
    let (mut model_data, mut model_model) = (0.0, 0.0);
    for state in &table.states {
        let model = state.predict(&unit)?;
        for axis in (0..2).filter(|&axis| state.nominal[axis] != 0.0) {
            let square = state.factor(axis).powi(2);
            model_data += square * model[axis] * state.nominal[axis];
            model_model += square * model[axis] * model[axis];
        }
    }
    let modulus = model_data / model_model;
    if modulus.is_finite() && modulus > 0.0 {
        return Ok(modulus);
    }
    let reason = format!(
        "the mean stiffness of the data is {modulus:.6e} Pa, but must be positive: in tension (stretch \
         above 1) stresses are positive, in compression negative; and a stretch is 1 at rest, a strain 0"
    );
    Err(Error::Data { what: "fit".to_owned(), reason })
}

#[cfg(test)]
#[path = "fit_tests.rs"]
mod tests;
