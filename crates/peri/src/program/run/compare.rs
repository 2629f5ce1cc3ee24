//! Reports of all variants: comparison with closed forms, convergence, tables, notes.

use super::outcome::{VariantOutcome, families};
use crate::exact;
use crate::program::quantities as q;
use crate::program::scene::{NAMING, Scene};
use harness::case::numeric;
use harness::report::{Bound, Expect, Kind, Named, Report};
use harness::scene::Source;
use harness::study::{self, Compare, SuiteRow};
use std::path::Path;

/// Returns the seconds from the scene to the stress field of one measure alone.
pub fn run_time(outcome: &VariantOutcome, measure: &str) -> f64 {
    ["build", "solve", "deformation gradient", &format!("stress {measure}")]
        .map(|phase| outcome.seconds_of(phase))
        .iter()
        .sum()
}

/// Builds the report of all variants; with a single variant values keep their plain names.
pub fn report(source: &Source, scene: &Scene, outcomes: &[VariantOutcome], quick: bool) -> Report {
    let mut report =
        Report::new("peri", env!("CARGO_PKG_VERSION"), &text_with_defaults(source, scene, outcomes, quick));
    report.threads(rayon::current_num_threads());
    // names must not depend on the number of variants of this run
    let several =
        crate::program::scene::variants(source, scene, false).map_or(outcomes.len(), |all| all.len()) > 1;
    let full = |name: &str, outcome: &VariantOutcome| {
        if several { NAMING.value(&outcome.name, name) } else { name.to_owned() }
    };
    for outcome in outcomes {
        for (name, value, unit) in &outcome.values {
            report.value(Named { name: full(name, outcome), unit: unit.clone() }, *value);
        }
        for profile in &outcome.profiles {
            let columns = [("y", "m", profile.at.clone()), ("stress", "", profile.value.clone())];
            report.curve(&full(&format!("profile_{}", profile.name), outcome), &columns);
        }
        for (name, count) in &outcome.work {
            report.work(&full(name, outcome), *count);
        }
        for (phase, seconds) in &outcome.seconds {
            report.seconds(&full(phase, outcome), *seconds);
        }
    }
    if let (Some(problem), Some(stress)) = (&scene.exact, &scene.stress) {
        if let Some(width) = plate_width(scene) {
            report.value(q::KT_FINITE_WIDTH, exact::heywood_gross(2.0 * problem.hole().0 / width));
        }
        for (family, members) in families(outcomes) {
            let spacing: Vec<f64> = members.iter().map(|o| o.spacing).collect();
            for measure in &stress.measures {
                let name = measure.name();
                let errors_of = |kind: &str| -> Vec<f64> {
                    members.iter().filter_map(|o| o.get(&format!("{name}_{kind}"))).collect()
                };
                for kind in problem.errors() {
                    let errors = errors_of(kind);
                    if errors.len() == spacing.len() {
                        let order = exact::observed_order(&spacing, &errors);
                        report.value(q::MEASURE_ORDER.named(&[name, kind, &family]), order);
                    }
                }
                let seconds: Vec<f64> = members.iter().map(|o| run_time(o, name)).collect();
                let columns = [
                    ("spacing", "m", spacing.clone()),
                    ("seconds", "s", seconds),
                    ("rmse", "", errors_of("rmse")),
                    ("rmse_inner", "", errors_of("rmse_inner")),
                ];
                report.curve(&format!("error_against_time_{name}[{family}]"), &columns);
            }
        }
    }
    if scene.output.integrals {
        for (quantity, value) in q::INTEGRALS.into_iter().zip(crate::integrals::all()) {
            report.value(quantity, value);
        }
    }
    if several {
        for quantity in q::BALANCES {
            let most = outcomes.iter().filter_map(|o| o.get(quantity.name)).reduce(f64::max);
            if let Some(most) = most {
                report.value(quantity, most);
            }
        }
    }
    if let Some(compare) = &scene.output.compare {
        compare.add(&mut report, outcomes, q::COMPARED, method_name);
        add_same_events(&mut report, compare, outcomes);
    }
    scene.comparisons().add(&mut report, outcomes);
    for (family, change) in super::history::peak_changes(outcomes) {
        report.value(q::PEAK_LOAD_CHANGE.named(&[&family]), change);
    }
    let mut expectations = scene.expect.clone();
    expectations.extend(outcomes.iter().filter_map(|outcome| contact_expectation(scene, outcome, several)));
    report.judge(&expectations, quick);
    report
}

/// Adds `same_events[VARIANT]`: the number of first events of a variant with the same bonds and load step as
/// in the reference.
fn add_same_events(report: &mut Report, compare: &Compare, outcomes: &[VariantOutcome]) {
    let compared = || outcomes.iter().filter(|outcome| outcome.get(&compare.quantity).is_some());
    let truth = compared().find(|o| Some(&o.name) == compare.variant.as_ref());
    let Some(truth) = truth.filter(|truth| !truth.events.is_empty()) else { return };
    for outcome in compared().filter(|outcome| outcome.name != truth.name) {
        let pairs = outcome.events.iter().zip(&truth.events);
        let same = pairs.take_while(|(a, b)| (a.step, a.fingerprint) == (b.step, b.fingerprint)).count();
        report.value(q::SAME_EVENTS.named(&[&outcome.name]), same as f64);
    }
}

/// Returns the name of a variant without its spacing and without a number at its end.
fn method_name(outcome: &VariantOutcome) -> String {
    match outcome.family.rsplit_once(' ') {
        Some((method, last)) if last.parse::<f64>().is_ok() => method.to_owned(),
        _ => outcome.family.clone(),
    }
}

/// Largest energy of contact over the stored energy of a run in equilibrium that passes.
const LARGEST_CONTACT_SHARE: f64 = 0.1;

/// Returns the expectation that contact is stiff enough for the load of a variant in equilibrium.
fn contact_expectation(scene: &Scene, outcome: &VariantOutcome, several: bool) -> Option<Expect> {
    let judged = scene.contact.as_ref().is_some_and(|contact| contact.short_range.is_none());
    outcome.get(q::CONTACT_SHARE.name).filter(|_| judged && scene.dynamics.is_none())?;
    let name = q::CONTACT_SHARE.name;
    Some(Expect {
        quantity: if several { NAMING.value(&outcome.name, name) } else { name.to_owned() },
        bound: Bound::Range { at_least: None, at_most: Some(LARGEST_CONTACT_SHARE) },
        kind: Kind::Bound,
        source: "every scene with contact: the load is too low by about this fraction".to_owned(),
        quick: true,
        missed: false,
    })
}

/// Returns the text of the scene, followed by all settings with their defaults as comments.
fn text_with_defaults(source: &Source, scene: &Scene, outcomes: &[VariantOutcome], quick: bool) -> String {
    let Scene { material, solver, stress, output, .. } = scene;
    let mut text = format!("{}\n# as run, with defaults (quick = {quick}):\n", source.text.trim_end());
    for line in [format!("{material:?}"), format!("{solver:?}"), format!("{stress:?}"), format!("{output:?}")]
    {
        text += &format!("# {line}\n");
    }
    for outcome in outcomes {
        text += &format!("# variant {}\n", outcome.name);
    }
    text
}

/// Returns names and units of the values of all variants, in order of appearance.
fn columns(outcomes: &[VariantOutcome]) -> Vec<(&str, &str)> {
    let mut columns: Vec<(&str, &str)> = Vec::new();
    for (name, _, unit) in outcomes.iter().flat_map(|o| &o.values) {
        if !columns.iter().any(|(known, _)| known == name) {
            columns.push((name, unit));
        }
    }
    columns
}

/// Returns a table of variants: size, work, time and main results; `study.csv` has all results.
pub fn table(outcomes: &[VariantOutcome]) -> String {
    use std::fmt::Write;
    // reactions of a torn body are those of its pieces
    let torn = outcomes.iter().any(|o| o.history.iter().any(|r| r.broken > 0));
    let main = ["_peak", "_rmse", "_rmse_inner", "_rmse_ring", "largest_displacement"];
    let of_loading = ["peak_load", "displacement_at_peak", "first_break", "broken_bonds"];
    let shown: Vec<(&str, String)> = columns(outcomes)
        .into_iter()
        .filter(|(name, _)| {
            main.iter().any(|end| name.ends_with(end))
                || of_loading.contains(name)
                || (!torn && name.starts_with("reaction_"))
        })
        .filter(|(name, _)| !name.starts_with("as-published"))
        .map(|(name, unit)| {
            (name, if unit.is_empty() { name.to_owned() } else { format!("{name} ({unit})") })
        })
        .collect();
    let width = outcomes.iter().map(|o| o.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    let _ = write!(text, "{:<width$} {:>10} {:>10} {:>9}", "variant", "particles", "iterations", "solve (s)");
    for (_, heading) in &shown {
        let _ = write!(text, "  {heading:>10}");
    }
    text.push('\n');
    for outcome in outcomes {
        let [particles, iterations] = ["particles", "iterations"].map(|name| outcome.count_of(name));
        let _ = write!(
            text,
            "{:<width$} {particles:>10} {iterations:>10} {:>9.2}",
            outcome.name,
            outcome.seconds_of("solve")
        );
        for (name, heading) in &shown {
            let column = heading.chars().count().max(10);
            let _ = write!(text, "  {:>column$}", outcome.get(name).map_or("-".to_owned(), format_value));
        }
        text.push('\n');
    }
    text
}

/// Formats with six digits.
fn format_value(value: f64) -> String {
    let size = value.abs();
    if value != 0.0 && !(1e-4..1e7).contains(&size) {
        return format!("{value:.5e}");
    }
    let after = if value == 0.0 { 0 } else { (5 - size.log10().floor() as i32).clamp(0, 9) };
    let text = format!("{value:.*}", after as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Returns notes on the results: warnings, variants without broken bonds, resolution of peak loads.
pub fn notes(outcomes: &[VariantOutcome]) -> String {
    let mut lines = Vec::new();
    let several = outcomes.len() > 1;
    let prefix =
        |outcome: &VariantOutcome| if several { format!("{}: ", outcome.name) } else { String::new() };
    for outcome in outcomes {
        lines.extend(outcome.warnings.iter().map(|text| format!("warning: {}{text}", prefix(outcome))));
        let unbroken = outcome.history.last().is_some_and(|last| last.broken == 0);
        if let (Some(critical), true) = (outcome.get("critical_stretch"), unbroken) {
            let largest = outcome.history.iter().map(|r| r.largest_stretch).fold(1.0, f64::max);
            lines.push(format!(
                "{}largest stretch {largest:.4} of {critical:.4}: nothing broke",
                prefix(outcome)
            ));
        }
    }
    for (family, change) in super::history::peak_changes(outcomes) {
        let members: Vec<&VariantOutcome> = outcomes.iter().filter(|o| o.family == family).collect();
        let step = members.iter().filter_map(|o| o.step_at_peak()).fold(0.0, f64::max);
        let known = if step >= change { ": use smaller steps first" } else { "" };
        lines.push(format!(
            "{family}: the peak load changes by {:.2} % between the two finest spacings; a load step changes \
             it by up to \
             {:.2} %{known}",
            100.0 * change,
            100.0 * step
        ));
    }
    lines.iter().map(|line| format!("{line}\n")).collect()
}

/// Writes the table of a suite, also as trials of the report: expected and observed behaviour and cost of
/// each variant.
///
/// # Errors
/// A file that cannot be written.
pub fn suite(report: &mut Report, outcomes: &[VariantOutcome], output: &Path) -> Result<(), polycore::Error> {
    let row = |outcome: &'_ VariantOutcome| {
        let value = |name: &str| outcome.get(name).unwrap_or(f64::NAN);
        format!(
            "stretches {:.3} to {:.3}, residual {:.1e}, {} bonds broken",
            value("smallest_stretch"),
            value("largest_stretch"),
            value("largest_residual"),
            outcome.history.last().map_or(0, |r| r.broken),
        )
    };
    let rows = outcomes.iter().map(|outcome| SuiteRow {
        name: &outcome.name,
        description: outcome.description.as_deref(),
        observed: outcome.error.as_deref().map_or_else(|| Ok(row(outcome)), Err),
        count: outcome.count_of("iterations"),
        seconds: outcome.seconds_of("solve"),
    });
    let trials = study::suite(report, NAMING, "iterations", &rows.collect::<Vec<_>>(), output)?;
    let described = trials.into_iter().zip(outcomes).filter(|(_, outcome)| outcome.description.is_some());
    report.trials.extend(described.map(|(trial, _)| trial));
    Ok(())
}

/// Returns the keys that studies vary, with the text of each variant; a unit that all have is in the heading.
fn varied(outcomes: &[VariantOutcome]) -> Vec<(String, Vec<String>)> {
    let mut keys: Vec<&String> = Vec::new();
    for (key, _) in outcomes.iter().flat_map(|outcome| &outcome.varied) {
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    let of_key = |key: &String| {
        let texts: Vec<Option<String>> = outcomes.iter().map(|own| own.text_of(key).cloned()).collect();
        let Some((numbers, unit)) = numeric(&texts.iter().flatten().cloned().collect::<Vec<_>>()) else {
            return (key.clone(), texts.into_iter().map(Option::unwrap_or_default).collect());
        };
        let mut numbers = numbers.into_iter();
        let value = |text: &Option<String>| {
            text.as_ref().and_then(|_| numbers.next()).map_or(String::new(), |number| format!("{number:?}"))
        };
        let heading = if unit.is_empty() { key.clone() } else { format!("{key} [{unit}]") };
        (heading, texts.iter().map(value).collect())
    };
    keys.into_iter().map(of_key).collect()
}

/// Writes the varied keys and all values of all variants to `study.csv`.
pub fn write(outcomes: &[VariantOutcome], output: &Path) -> Result<(), polycore::Error> {
    if outcomes.len() < 2 {
        return Ok(());
    }
    let (columns, varied) = (columns(outcomes), varied(outcomes));
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let mut text = String::from("variant,spacing [m],horizon_ratio");
    varied.iter().for_each(|(key, _)| text += &format!(",{}", quoted(key)));
    for (name, unit) in &columns {
        let heading = if unit.is_empty() { (*name).to_owned() } else { format!("{name} [{unit}]") };
        text += &format!(",{}", quoted(&heading));
    }
    text.push('\n');
    for (row, outcome) in outcomes.iter().enumerate() {
        text += &format!("{},{:?},{:?}", quoted(&outcome.name), outcome.spacing, outcome.horizon_ratio);
        for (_, values) in &varied {
            let number = values[row].parse::<f64>().is_ok();
            text += &format!(",{}", if number { values[row].clone() } else { quoted(&values[row]) });
        }
        for (name, _) in &columns {
            // empty: this variant has no such value
            text += &outcome.get(name).map_or(",".to_owned(), |value| format!(",{value:?}"));
        }
        text.push('\n');
    }
    polycore::file::atomic_write(output.join("study.csv"), |file| {
        std::io::Write::write_all(file, text.as_bytes())
    })
}

/// Returns the width of the plate across the load, from the added boxes, m.
pub fn plate_width(scene: &Scene) -> Option<f64> {
    let edges = |get: fn(&crate::program::scene::ShapeSpec) -> &Option<Vec<polycore::units::Length>>| {
        scene
            .body
            .shapes()
            .iter()
            .filter(|s| s.add.is_some())
            .filter_map(move |s| Some(get(s).as_ref()?.get(1)?.si()))
    };
    let low = edges(|s| &s.min).reduce(f64::min)?;
    let high = edges(|s| &s.max).reduce(f64::max)?;
    Some(high - low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_digits() {
        let texts = [0.0, 1234567.8, 0.001234567, 8.9e-5, -15.25, 2e9].map(format_value);
        assert_eq!(texts, ["0", "1234568", "0.00123457", "8.90000e-5", "-15.25", "2.00000e9"]);
    }
}
