//! Results and cost of searches: the best loss against epochs and seconds, by method.

use crate::dataset::statistics::median;
use crate::program::quantities as q;
use crate::program::scene::SearchSpec;
use crate::search::{Journal, SearchMethod};
use harness::report::Report;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Number of points per curve.
const POINTS: usize = 8;

/// Search with one seed.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct FinishedSearch {
    pub journal: Journal,
    /// Training time of the candidate of each trial so far, s.
    pub seconds: Vec<f64>,
}

/// Returns total epochs, total seconds and best loss after each trial of a method.
fn cost_curve(search: &FinishedSearch, method: SearchMethod) -> Vec<[f64; 3]> {
    let mut before: HashMap<usize, [f64; 2]> = HashMap::new();
    let (mut epochs, mut seconds, mut best) = (0.0, 0.0, f64::INFINITY);
    let mut points = Vec::new();
    for (trial, total) in
        search.journal.trials.iter().zip(&search.seconds).filter(|(t, _)| t.method == method)
    {
        // a candidate continues its training
        let now = [f64::from(trial.epochs), *total];
        let [was, took] = before.insert(trial.number, now).unwrap_or_default();
        epochs += now[0] - was;
        seconds += (now[1] - took).max(0.0);
        best = best.min(trial.loss.unwrap_or(f64::INFINITY));
        points.push([epochs, seconds, best]);
    }
    points
}

/// Reports the curves `error_against_time_METHOD`, medians over the seeds, and the final results.
pub(super) fn against_time(spec: &SearchSpec, done: &[FinishedSearch], report: &mut Report) {
    for method in &spec.methods {
        let curves: Vec<_> = done.iter().map(|search| cost_curve(search, *method)).collect();
        let ends: Vec<[f64; 3]> = curves.iter().filter_map(|curve| curve.last().copied()).collect();
        let finite = |k: usize| ends.iter().map(|end| end[k]).filter(|v| v.is_finite()).collect::<Vec<f64>>();
        if finite(2).is_empty() {
            continue;
        }
        let name = method.name();
        report.work(&format!("epochs of {name}"), ends.iter().map(|end| end[0] as u64).sum());
        report.value(q::MEDIAN_EPOCHS.named(&[name]), median(finite(0)));
        report.value(q::MEDIAN_LOSS.named(&[name]), median(finite(2)));
        let worst = finite(2).into_iter().fold(f64::NEG_INFINITY, f64::max);
        report.value(q::WORST_LOSS.named(&[name]), worst);
        let most = ends.iter().map(|end| end[0]).fold(0.0, f64::max);
        let mut columns = [Vec::new(), Vec::new(), Vec::new()];
        for point in 1..=POINTS {
            let budget = most * point as f64 / POINTS as f64;
            let within = curves.iter().filter_map(|curve| curve.iter().rfind(|at| at[0] <= budget));
            let found: Vec<[f64; 3]> = within.copied().filter(|at| at[2].is_finite()).collect();
            // a point needs the median over all seeds
            if found.len() == done.len() {
                for (k, column) in columns.iter_mut().enumerate() {
                    column.push(median(found.iter().map(|at| at[k]).collect()));
                }
            }
        }
        let [epochs, seconds, losses] = columns;
        report.curve(
            &format!("error_against_time_{name}"),
            &[("epochs", "", epochs), ("seconds", "s", seconds), ("loss", "MPa²", losses)],
        );
    }
    let value = |method: &str, report: &Report| report.scalar(&q::MEDIAN_LOSS.named(&[method]).name);
    if let Some(random) = value("random", report) {
        for name in ["hyperband", "bayesian"] {
            if let Some(own) = value(name, report) {
                report.value(q::LOSS_OVER_RANDOM.named(&[name]), own / random);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::Activation::Relu;
    use crate::search::{Journal, SearchCandidate, Trial};

    #[test]
    fn costs_by_hand() {
        let trial = |number, epochs, loss| Trial {
            method: SearchMethod::Hyperband,
            number,
            candidate: SearchCandidate { hidden: vec![(8, Relu)], learning_rate: 0.1 },
            epochs,
            loss,
        };
        let journal =
            Journal { trials: vec![trial(0, 1, Some(9.0)), trial(1, 1, None), trial(0, 3, Some(4.0))] };
        let one = FinishedSearch { journal, seconds: vec![0.5, 0.25, 1.5] };
        // candidate 0 trains two more epochs in one more second
        assert_eq!(
            cost_curve(&one, SearchMethod::Hyperband),
            [[1.0, 0.5, 9.0], [2.0, 0.75, 9.0], [4.0, 1.75, 4.0]]
        );
        assert_eq!(cost_curve(&one, SearchMethod::Random), [[0.0; 3]; 0]);
        assert_eq!((median(vec![3.0, 1.0, 2.0]), median(vec![4.0, 1.0])), (2.0, 2.5));
    }
}
