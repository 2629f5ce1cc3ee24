//! Judgement of a form on runs that it was not fitted to.

use super::{FitSettings, Form, MeasuredRun, TimeFit, fit_until};
use crate::constitutive::Error;
use crate::constitutive::hyperelastic::fit::Agreement;

/// Fit without some runs, and its prediction of them.
#[derive(Debug, Clone)]
pub struct LeftOut {
    /// The fit to the others.
    pub fit: TimeFit,
    /// Agreement with each run left out, in the order given.
    pub runs: Vec<Agreement>,
    /// Agreement with all runs left out.
    pub pooled: Agreement,
}

/// Rates of runs, increasing, each once.
pub fn rates(runs: &[MeasuredRun]) -> Vec<f64> {
    let mut rates: Vec<f64> = runs.iter().map(|run| run.rate).collect();
    rates.sort_by(f64::total_cmp);
    rates.dedup();
    rates
}

/// Fits a form to the runs that `left` does not select, and predicts those that it does.
///
/// # Errors
/// As [`fit_until`]; [`Error::Data`] if `left` selects no run or all; errors of the law at a run left out.
pub fn leave_out(
    form: &Form,
    all: &[MeasuredRun],
    left: impl Fn(&MeasuredRun) -> bool,
    settings: &FitSettings,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<LeftOut, Error> {
    let (out, kept): (Vec<MeasuredRun>, Vec<MeasuredRun>) = all.iter().cloned().partition(|run| left(run));
    if out.is_empty() || kept.is_empty() {
        let reason = format!("{} of {} runs left out", out.len(), all.len());
        return Err(Error::Data { what: "fit without some runs".to_owned(), reason });
    }
    let fit = fit_until(form, &kept, settings, stop)?;
    let law = fit.law()?;
    let mut residuals = Vec::new();
    let mut each = Vec::new();
    for run in &out {
        let own = run.residuals(&law, settings.pace)?;
        each.push(Agreement::of_residuals(&own, run.points().iter().map(|point| point.nominal)));
        residuals.extend(own);
    }
    let measured = out.iter().flat_map(|run| run.points()).map(|point| point.nominal);
    Ok(LeftOut { fit, runs: each, pooled: Agreement::of_residuals(&residuals, measured) })
}
