//! Draws variants together: profiles, convergence, error against run time.

use super::compare::{plate_width, run_time};
use super::outcome::VariantOutcome;
use super::outcome::families;
use crate::exact;
use crate::program::scene::{ExactSpec, Scene};
use crate::stress::StressMethod;
use harness::output::csv;
use harness::output::picture::{LegendPlace, LinePlot, Series};
use polycore::Error;
use std::path::Path;

/// Draws profiles (Fig. 2.7), convergence (Fig. 2.8) and error against run time.
pub fn draw_curves(scene: &Scene, outcomes: &[VariantOutcome], output: &Path) -> Result<(), Error> {
    let (Some(exact), Some(stress)) = (&scene.exact, &scene.stress) else { return Ok(()) };
    let (radius, is_plate) = (exact.hole().0, matches!(exact, ExactSpec::PlateWithHole { .. }));
    let kind = if is_plate { "rmse_inner" } else { "rmse" };
    let error_axis = if is_plate {
        "RMSE of σ₁₁/σ∞ without loaded layers"
    } else {
        "RMSE of σ₁₁/σ∞ (2.84)"
    };
    profiles(scene, outcomes, stress.measures[0].name(), radius, output)?;
    let families = families(outcomes);
    if families.is_empty() {
        return Ok(());
    }
    let mut cost = LinePlot::new("Error against run time").log_x().log_y().size(1000.0, 560.0);
    cost = cost.axes("build + solve + stress (s)", error_axis);
    let mut rows: Vec<Vec<f64>> = vec![Vec::new(); 5];
    let convergence = |title: &str| {
        let plot = LinePlot::new(title).log_x().log_y().size(900.0, 500.0);
        plot.axes("spacing Δx (mm)", error_axis)
    };
    let title = "Stress error of the plate with a hole";
    let mut together = convergence(title);
    for (index, measure) in
        stress.measures.iter().enumerate().filter(|(_, m)| **m != StressMethod::AsPublished)
    {
        let name = measure.name();
        let mut single = convergence(&format!("{title}, {name}"));
        for (family, members) in &families {
            let error: Vec<f64> = members.iter().filter_map(|o| o.get(&format!("{name}_{kind}"))).collect();
            let spacing: Vec<f64> = members.iter().map(|o| o.spacing * 1e3).collect();
            let seconds: Vec<f64> = members.iter().map(|o| run_time(o, name)).collect();
            for (row, outcome) in members.iter().enumerate() {
                let values = [spacing[row], outcome.horizon_ratio, index as f64, seconds[row], error[row]];
                for (column, value) in rows.iter_mut().zip(values) {
                    column.push(value);
                }
            }
            single = single.series(Series::marked_line(family, &spacing, &error));
            together = together.series(Series::marked_line(name, &spacing, &error));
            cost = cost.series(Series::marked_line(&format!("{name} {family}"), &seconds, &error));
        }
        if families.len() > 1 {
            single.write(output.join(format!("convergence_{name}.png")))?;
        }
    }
    if families.len() == 1 {
        together.write(output.join("convergence.png"))?;
    }
    cost.write(output.join("error_against_time.png"))?;
    let names = [("spacing", "mm"), ("horizon_ratio", ""), ("measure", ""), ("run_time", "s"), (kind, "")];
    let columns: Vec<_> =
        names.iter().zip(&rows).map(|((name, unit), data)| (*name, *unit, data.as_slice())).collect();
    csv::write(output.join("convergence.csv"), &columns)
}

fn profiles(
    scene: &Scene,
    outcomes: &[VariantOutcome],
    measure: &str,
    radius: f64,
    output: &Path,
) -> Result<(), Error> {
    let far = 5.0 * radius;
    let line: Vec<f64> = (0..=400).map(|k| radius + (far - radius) * f64::from(k) / 400.0).collect();
    let exact: Vec<f64> = line.iter().map(|&y| exact::kirsch(0.0, y, radius, 1.0)[0]).collect();
    let over_radius = |at: &[f64]| -> Vec<f64> { at.iter().map(|y| y / radius).collect() };
    let mut plot = LinePlot::new("Stress above the hole, θ = π/2")
        .axes("y/a", "σ₁₁/σ∞")
        .x_range(1.0, 5.0)
        .legend(LegendPlace::TopRight);
    if let Some(width) = plate_width(scene) {
        let peak = exact::heywood_gross(2.0 * radius / width);
        plot = plot.series(Series::markers(&format!("long strip, Heywood: {peak:.3}"), &[1.0], &[peak]));
    }
    let first = outcomes.first().map(|o| o.family.clone());
    let mut columns: Vec<(&str, &str, Vec<f64>)> = vec![("spacing", "m", Vec::new()), ("y", "m", Vec::new())];
    for outcome in outcomes.iter().filter(|o| Some(&o.family) == first.as_ref()) {
        if let Some(profile) = outcome.profiles.iter().find(|p| p.name == measure) {
            let keep = profile.at.iter().filter(|&&y| y <= far).count();
            let label = format!("{measure}, {}", outcome.name);
            plot =
                plot.series(Series::line(&label, &over_radius(&profile.at[..keep]), &profile.value[..keep]));
        }
        // all profiles of a variant are at the same particles
        let rows = outcome.profiles.first().map_or(0, |profile| profile.at.len());
        columns[0].2.extend(std::iter::repeat_n(outcome.spacing, rows));
        columns[1].2.extend(outcome.profiles.iter().take(1).flat_map(|profile| &profile.at));
        for profile in &outcome.profiles {
            if !columns.iter().any(|column| column.0 == profile.name) {
                columns.push((&profile.name, "", Vec::new()));
            }
            let column = columns.iter_mut().find(|column| column.0 == profile.name);
            column.into_iter().for_each(|column| column.2.extend(&profile.value));
        }
    }
    let views: Vec<_> = columns.iter().map(|(name, unit, data)| (*name, *unit, data.as_slice())).collect();
    if !columns[1].2.is_empty() {
        csv::write(output.join("profile.csv"), &views)?;
    }
    let kirsch = ("Kirsch, infinite plate", over_radius(&line), exact);
    let finest = outcomes.iter().rfind(|o| Some(&o.family) == first.as_ref());
    plot = match finest.and_then(|o| o.profiles.iter().find(|p| p.name == "exact")) {
        Some(profile) => {
            let keep = profile.at.iter().filter(|&&y| y <= far).count();
            let (at, value) = (over_radius(&profile.at[..keep]), &profile.value[..keep]);
            let plot = plot.series(Series::line(kirsch.0, &kirsch.1, &kirsch.2));
            plot.series(Series::reference("this plate, series", &at, value))
        }
        None => plot.series(Series::reference(kirsch.0, &kirsch.1, &kirsch.2)),
    };
    plot.write(output.join("profile.png"))
}
