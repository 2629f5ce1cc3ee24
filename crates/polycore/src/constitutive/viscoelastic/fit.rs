//! Fit of a law with time to measured histories.
//!
//! The sum of squares of the nominal stress over all points of all runs is minimised by Levenberg–Marquardt
//! in the logarithms of the constants (exponents of any sign as they are), from several starts. Every run is
//! integrated from rest along its points, ramps included. Constants that the data cannot determine are fixed
//! by name ([`Constant::fixed`]); a branch that is not monotone is refused ([`super::Spring::least_slope`]).
//!
//! ```
//! use polycore::constitutive::hyperelastic::model;
//! use polycore::constitutive::viscoelastic::fit::{
//!     BranchForm, FitSettings, Form, Measurement, MeasuredRun, SpringForm, Test, ViscosityForm, fit,
//! };
//!
//! // ramp to a stretch of 1.02 in 1 s, held: E = 3μ falls from 6 to 3 MPa within some seconds
//! let relaxing = |t: f64| 3e6 * 0.02 * (t.min(1.0) + (1.0 - (-t).exp()) * (1.0 - t).max(0.0).exp());
//! let point = |k: u32| {
//!     let time = f64::from(k) * 0.25;
//!     let strain = 1.0 + 0.02 * time.min(1.0);
//!     Measurement { time, strain, nominal: relaxing(time) }
//! };
//! let run = MeasuredRun::new("ramp", 0.02, Test::Uniaxial, (0..20).map(point).collect())?;
//! let branch = BranchForm { spring: SpringForm::NeoHookean, viscosity: ViscosityForm::Constant };
//! let form = Form::new(model("neo-hookean")?, vec![branch]);
//! let found = fit(&form, &[run], &FitSettings::default())?;
//! assert!(found.runs[0].rms < 20e3);
//! # Ok::<(), polycore::constitutive::Error>(())
//! ```

mod form;
mod leave;
mod problem;
mod runs;

pub use form::{BranchForm, Constant, Form, SpringForm, ViscosityForm};
pub use leave::{LeftOut, leave_out, rates};
pub use runs::{MeasuredRun, Measurement, Test};

use nalgebra::{DMatrix, DVector};

use super::{Pace, Scheme, Viscoelastic};
use crate::constitutive::Error;
use crate::constitutive::hyperelastic::fit::Agreement;
use problem::Problem;

/// Settings of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct FitSettings {
    /// Number of starts, at least 1.
    pub starts: usize,
    /// Steps between two points of a run.
    pub pace: Pace,
    /// Largest principal log strain at which a branch must be monotone.
    pub reach: f64,
    /// Constants of an earlier fit of the same form, as one more start.
    pub first: Option<Vec<f64>>,
}

impl Default for FitSettings {
    /// Six starts, one step of second order between two points, branches monotone up to a stretch of e.
    fn default() -> Self {
        Self { starts: 6, pace: Pace::Equal(1, Scheme::Sdirk2), reach: 1.0, first: None }
    }
}

/// Fitted law with time.
#[derive(Debug, Clone)]
pub struct TimeFit {
    /// Form of the law.
    pub form: Form,
    /// The constants, in the order of [`Form::law`].
    pub constants: Vec<FittedConstant>,
    /// Agreement with each run, in the order given.
    pub runs: Vec<Agreement>,
    /// Agreement with all runs.
    pub pooled: Agreement,
    /// Singular values of the Jacobian by q, over the noise √(Σr²/(m − k)), from the largest: a direction
    /// below 1 is not determined.
    pub singular_values: Vec<f64>,
    /// Least slope of τ(e) of each branch up to [`FitSettings::reach`], Pa.
    pub least_slopes: Vec<f64>,
    /// Number of starts, and of those that ended within 1 % of the best rms.
    pub starts: (usize, usize),
    /// Evaluations of the residuals of all runs.
    pub evaluations: usize,
}

/// Fitted or fixed constant.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedConstant {
    /// Name and unit, with the reason if it is fixed.
    pub constant: Constant,
    /// Value, SI.
    pub value: f64,
    /// Interval of 95 % from the linearised model with independent errors; `None` if it is fixed or the
    /// data do not determine it. Errors of a law are not independent: the true interval is wider.
    pub interval: Option<[f64; 2]>,
}

impl TimeFit {
    /// Values of all constants, SI, in the order of [`Form::law`].
    pub fn values(&self) -> Vec<f64> {
        self.constants.iter().map(|constant| constant.value).collect()
    }

    /// Value of a constant.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.constants.iter().find(|constant| constant.constant.name == name).map(|found| found.value)
    }

    /// Builds the law.
    ///
    /// # Errors
    /// As [`Form::law`].
    pub fn law(&self) -> Result<Viscoelastic, Error> {
        self.form.law(&self.values())
    }
}

/// Fits a form to runs.
///
/// # Errors
/// [`Error::Data`] for no run, fewer stresses than constants, or a mean stiffness below zero;
/// [`Error::Invalid`] for unknown names of constants; [`Error::NoConvergence`] if no start ends at a law;
/// [`Error::Data`] if every end has a branch that is not monotone.
pub fn fit(form: &Form, runs: &[MeasuredRun], settings: &FitSettings) -> Result<TimeFit, Error> {
    fit_until(form, runs, settings, &|| false)
}

/// Fits as [`fit`] does, until `stop` returns true.
///
/// # Errors
/// As [`fit`]; [`Error::Stopped`].
pub fn fit_until(
    form: &Form,
    runs: &[MeasuredRun],
    settings: &FitSettings,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<TimeFit, Error> {
    let what = || "fit of a law with time".to_owned();
    if runs.is_empty() {
        return Err(Error::Data { what: what(), reason: "no run".to_owned() });
    }
    let problem = Problem::new(form, runs, settings.pace)?;
    let given = settings.first.as_ref().map(|values| problem.inverse(values));
    let drawn = (0..settings.starts.max(usize::from(given.is_none()))).map(|k| problem.start(k));
    let starts: Vec<DVector<f64>> = given.into_iter().chain(drawn).collect();
    let (mut ends, mut evaluations, mut refused) = (Vec::new(), 0, None);
    for from in &starts {
        if stop() {
            return Err(Error::Stopped);
        }
        let Some((end, squares, count)) = problem.search(from.clone()) else { continue };
        evaluations += count;
        let slopes = least_slopes(&problem.law(&end)?, settings.reach);
        match slopes.iter().position(|slope| *slope <= 0.0) {
            Some(k) => refused = Some((k + 1, slopes[k])),
            None => ends.push((squares, end, slopes)),
        }
    }
    let least = ends.iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((squares, best, slopes)) = least else {
        return Err(match refused {
            Some((branch, slope)) => Error::Data {
                what: what(),
                reason: format!(
                    "branch {branch} softens elastically below the log strain {}: least slope {slope:.3e} \
                     Pa; fix an exponent of its spring at 0 or above",
                    settings.reach
                ),
            },
            None => Error::NoConvergence {
                iteration: "the fit of a law with time",
                steps: evaluations,
                residual: f64::NAN,
            },
        });
    };
    let agreeing = ends.iter().filter(|end| end.0 <= squares * 1.02).count();
    let (residuals, jacobian) = problem.jacobian(best).ok_or(Error::NoConvergence {
        iteration: "the derivatives of a fit",
        steps: evaluations,
        residual: f64::NAN,
    })?;
    let degrees = problem.measurements().saturating_sub(best.len()).max(1) as f64;
    let noise = (residuals.norm_squared() / degrees).sqrt().max(f64::MIN_POSITIVE);
    let (singular_values, errors) = uncertainty(jacobian / noise);
    let mut free = best.iter().zip(errors);
    let constants = problem.constants.iter().map(|constant| {
        let (value, interval) = match constant.fixed {
            Some((value, _)) => (value, None),
            None => {
                let (q, error) = free.next().unwrap_or((&0.0, None));
                let end = |side: f64| move |error: f64| constant.map.constant(q + side * STUDENT * error);
                let interval = error.map(|error| [end(-1.0)(error), end(1.0)(error)]);
                (constant.map.constant(*q), interval.map(sorted))
            }
        };
        FittedConstant { constant: constant.clone(), value, interval }
    });
    let constants = constants.collect();
    let mut rest = residuals.as_slice();
    let each = runs.iter().map(|run| {
        let (own, others) = rest.split_at(run.points().len());
        rest = others;
        Agreement::of_residuals(own, run.points().iter().map(|point| point.nominal))
    });
    let each: Vec<Agreement> = each.collect();
    let measured = runs.iter().flat_map(|run| run.points()).map(|point| point.nominal);
    Ok(TimeFit {
        form: form.clone(),
        constants,
        runs: each,
        pooled: Agreement::of_residuals(residuals.as_slice(), measured),
        singular_values,
        least_slopes: slopes.clone(),
        starts: (starts.len(), agreeing),
        evaluations,
    })
}

/// Standard errors to either side that hold 95 % of a normal distribution.
const STUDENT: f64 = 1.96;

/// Share of a constant in directions that are not determined, beyond which it is not.
const OPEN: f64 = 0.05;

fn sorted([a, b]: [f64; 2]) -> [f64; 2] {
    [a.min(b), a.max(b)]
}

/// Singular values of the Jacobian over the noise, and the standard error of each q from the directions of at
/// least 1; `None` where a q lies in the others.
pub(super) fn uncertainty(jacobian: DMatrix<f64>) -> (Vec<f64>, Vec<Option<f64>>) {
    let count = jacobian.ncols();
    let found = jacobian.svd(false, true);
    let values: Vec<f64> = found.singular_values.iter().copied().collect();
    let Some(axes) = found.v_t else { return (values, vec![None; count]) };
    let error = |i: usize| {
        let (mut open, mut square) = (0.0, 0.0);
        for (k, value) in values.iter().enumerate() {
            let share = axes[(k, i)].powi(2);
            if *value < 1.0 { open += share } else { square += share / value.powi(2) }
        }
        (open <= OPEN).then(|| square.sqrt())
    };
    let errors = (0..count).map(error).collect();
    (values, errors)
}

/// Least slope of τ(e) of each branch, Pa.
fn least_slopes(law: &Viscoelastic, reach: f64) -> Vec<f64> {
    law.branches().iter().map(|branch| branch.spring.least_slope(reach)).collect()
}

#[cfg(test)]
mod tests;
