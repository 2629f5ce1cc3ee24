//! Variants against one that is taken as true, or against a number: errors, errors over run time, which bonds break when.

use super::outcome::Outcome;
use crate::program::quantities as q;
use crate::program::scene::CompareSpec;
use harness::report::Report;
use std::collections::BTreeMap;

/// Adds to a report, for every variant but the true one, `QUANTITY_error[VARIANT]` = |q/q₀ − 1| and, where bonds break,
/// `same_events[VARIANT]`, how many of the first events have the same bonds in the same load step; and a curve
/// `error_against_time_QUANTITY[METHOD]` for each method, the variants' names without spacing and last number.
pub fn add(report: &mut Report, compare: &CompareSpec, outcomes: &[Outcome]) {
    let truth = outcomes.iter().find(|o| Some(&o.name) == compare.variant.as_ref());
    let Some(exact) = truth.map_or(compare.value, |truth| truth.get(&compare.quantity)) else { return };
    let mut curves: BTreeMap<String, Vec<[f64; 2]>> = BTreeMap::new();
    for outcome in outcomes.iter().filter(|o| truth.is_none_or(|truth| truth.name != o.name)) {
        let Some(value) = outcome.get(&compare.quantity) else { continue };
        let error = (value / exact - 1.0).abs();
        report.value(q::COMPARED.of(&[&compare.quantity, &outcome.name]), error);
        if let Some(truth) = truth.filter(|truth| !truth.events.is_empty()) {
            let pairs = outcome.events.iter().zip(&truth.events);
            let same = pairs.take_while(|(a, b)| (a.step, a.fingerprint) == (b.step, b.fingerprint)).count();
            report.value(q::SAME_EVENTS.of(&[&outcome.name]), same as f64);
        }
        curves.entry(method(outcome)).or_default().push([outcome.seconds_of("solve"), error]);
    }
    for (method, points) in curves {
        let column = |k: usize| points.iter().map(|point| point[k]).collect::<Vec<f64>>();
        let name = format!("error_against_time_{}[{method}]", compare.quantity);
        report.curve(&name, &[("seconds", "s", column(0)), ("error", "", column(1))]);
    }
}

/// Name of a variant without its spacing, and without a number at its end.
fn method(outcome: &Outcome) -> String {
    match outcome.family.rsplit_once(' ') {
        Some((method, last)) if last.parse::<f64>().is_ok() => method.to_owned(),
        _ => outcome.family.clone(),
    }
}
