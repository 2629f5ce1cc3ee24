//! Pictures of trained laws: Figs 3.7 and 3.9–3.11 of the thesis, and error against time.

use super::heldout::{Heldout, percentages};
use crate::dataset::DataRow;
use crate::error::Error;
use crate::kinematics::NAMES;
use crate::program::quantities as q;
use crate::surrogate::{Surrogate, Workspace};
use crate::train::TrainingState;
use harness::output::picture::{LinePlot, Series};
use harness::report::Report;
use std::io::Write;
use std::path::Path;

/// Larger percentage errors are drawn at the edge: (3.13) is unbounded for vanishing stress.
const LARGEST_PERCENTAGE: f64 = 300.0;

/// Draws Fig. 3.7: training and validation loss by epoch, for the first member of each law.
pub(super) fn learning(curves: &[(&str, &TrainingState)], output: &Path) -> Result<(), Error> {
    let mut plot = LinePlot::new("Learning curves").axes("epoch", "loss (3.12) (MPa²)").log_y();
    let mut drawn = false;
    for (name, state) in curves {
        let history = state.history();
        let epochs: Vec<f64> = (1..=history.len()).map(|epoch| epoch as f64).collect();
        // a logarithmic axis cannot show 0
        let shown = |loss: f64| if loss > 0.0 { loss } else { f64::NAN };
        let train: Vec<f64> = history.iter().map(|epoch| shown(epoch.train)).collect();
        plot = plot.series(Series::line(&format!("{name}, training"), &epochs, &train));
        drawn |= train.iter().any(|loss| !loss.is_nan());
        if history.iter().any(|epoch| epoch.validation.is_some()) {
            let loss = |k: usize| shown(history[k].validation.unwrap_or(0.0));
            let validation: Vec<f64> = (0..history.len()).map(loss).collect();
            plot = plot.series(Series::line(&format!("{name}, validation"), &epochs, &validation));
        }
    }
    if drawn { Ok(plot.write(output.join("learning.png"))?) } else { Ok(()) }
}

/// Draws and tabulates the error on the test rows against training time and the time per stress.
pub(super) fn against_time(
    names: &[&str],
    losses: &[f64],
    training: &[f64],
    inference: &[f64],
    floor: Option<f64>,
    output: &Path,
) -> Result<(), Error> {
    polycore::file::atomic_write(output.join("error_against_time.csv"), |file| {
        writeln!(file, "law,test error (3.12) [MPa²],training [s],one stress [s]")?;
        for (k, name) in names.iter().enumerate() {
            writeln!(file, "{name},{:?},{:?},{:?}", losses[k], training[k], inference[k])?;
        }
        Ok(())
    })?;
    let microseconds: Vec<f64> = inference.iter().map(|time| time * 1e6).collect();
    for (what, label, times) in [
        ("training", "training time (s)", training),
        ("inference", "time of one stress (µs)", &microseconds[..]),
    ] {
        let known = |k: &usize| times[*k] > 0.0 && losses[*k] > 0.0;
        let shown: Vec<usize> = (0..names.len()).filter(known).collect();
        let (Some(least), Some(greatest)) = (
            shown.iter().map(|&k| times[k]).reduce(f64::min),
            shown.iter().map(|&k| times[k]).reduce(f64::max),
        ) else {
            continue;
        };
        let mut plot =
            LinePlot::new("Error against time").axes(label, "test error (3.12) (MPa²)").log_x().log_y();
        for &k in &shown {
            plot = plot.series(Series::markers(names[k], &[times[k]], &[losses[k]]));
        }
        if let Some(floor) = floor.filter(|floor| *floor > 0.0) {
            let [low, high] = [0.8 * least, 1.25 * greatest];
            plot = plot.series(Series::reference("noise of the data", &[low, high], &[floor, floor]));
        }
        plot.write(output.join(format!("error_against_time_{what}.png")))?;
    }
    Ok(())
}

/// Draws Figs 3.9–3.11: measured and predicted stress of each held-out run, and the percentage error of all.
pub(super) fn heldout(seen: &[Heldout], names: &[&str], output: &Path) -> Result<(), Error> {
    let mut errors = LinePlot::new("Percentage error (3.13) of held-out runs")
        .axes("C along the axis of tension", "percentage error (%)")
        .y_range(0.0, LARGEST_PERCENTAGE);
    for held in seen {
        let component = NAMES[held.axis];
        let c: Vec<f64> = held.run.rows.iter().map(|row| row.c[held.axis]).collect();
        let (stress, measured) = held.measured();
        let rates = match held.within {
            Some(true) => ", rates within the training range",
            Some(false) => ", rates outside the training range",
            None => "",
        };
        let mut plot = LinePlot::new(&format!("Held-out run {}{rates}", held.run.id))
            .axes(&format!("C{component}"), &format!("{stress} (MPa)"))
            .series(Series::reference("measured", &c, &measured));
        for (name, predicted) in names.iter().zip(&held.predicted) {
            let along: Vec<f64> = predicted.iter().map(|stress| stress[held.axis] / 1e6).collect();
            plot = plot.series(Series::line(name, &c, &along));
            let limit = |error: f64| error.min(LARGEST_PERCENTAGE);
            let shown: Vec<f64> = percentages(&held.run.rows, predicted).into_iter().map(limit).collect();
            errors = errors.series(Series::line(&format!("{}, {name}", held.run.id), &c, &shown));
        }
        plot.write(output.join(format!("heldout-{}.png", held.run.id)))?;
    }
    if seen.is_empty() { Ok(()) } else { Ok(errors.write(output.join("percentage-error.png"))?) }
}

/// Width of a bin of C for mean percentage errors.
const BIN: f64 = 0.05;
/// Largest number of bins; larger ranges, e.g. of rubber, get wider bins.
const BINS: usize = 12;

/// Reports Fig. 3.11 in numbers: the mean of (3.13) over the rows of the held-out runs pulled along an axis,
/// by bins of C; values, a curve per law, and a picture.
pub(super) fn binned(
    report: &mut Report,
    seen: &[Heldout],
    names: &[&str],
    output: &Path,
) -> Result<(), Error> {
    for axis in 0..3 {
        // runs with unknown rates may not be tension
        let runs: Vec<&Heldout> =
            seen.iter().filter(|held| held.axis == axis && !held.run.rates[axis].is_nan()).collect();
        let c = |row: &DataRow| row.c[axis];
        let greatest = runs.iter().flat_map(|held| &held.run.rows).map(c).fold(1.0, f64::max);
        if greatest <= 1.0 {
            continue;
        }
        let width = BIN.max((greatest - 1.0) / BINS as f64);
        let component = NAMES[axis];
        let mut plot = LinePlot::new("Percentage error (3.13) of held-out runs, by bins")
            .axes(&format!("C{component}"), "mean percentage error (%)");
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        for (law, name) in names.iter().enumerate() {
            let mut sums = vec![(0.0, 0usize); BINS + 1];
            for held in &runs {
                let errors = percentages(&held.run.rows, &held.predicted[law]);
                for (row, error) in held.run.rows.iter().zip(errors).filter(|(_, error)| error.is_finite()) {
                    let bin = ((c(row) - 1.0) / width).floor().clamp(0.0, BINS as f64) as usize;
                    sums[bin] = (sums[bin].0 + error, sums[bin].1 + 1);
                }
            }
            let (mut centres, mut means, mut counts) = (Vec::new(), Vec::new(), Vec::new());
            for (bin, (sum, count)) in sums.iter().enumerate().filter(|(_, (_, count))| *count > 0) {
                let [low, high] = [bin, bin + 1].map(|k| 1.0 + k as f64 * width);
                let mean = sum / *count as f64;
                let range = [low, high].map(|end| format!("{end:.2}"));
                report.value(q::BINNED.named(&[name, component, &range[0], &range[1]]), mean);
                centres.push(0.5 * (low + high));
                means.push(mean);
                counts.push(*count as f64);
            }
            ends = [ends[0].min(1.0), ends[1].max(centres.last().copied().unwrap_or(1.0))];
            plot = plot.series(Series::marked_line(name, &centres, &means));
            report.curve(
                &format!("percentage error over C{component} of {name}"),
                &[(&format!("C{component}"), "", centres), ("error", "%", means), ("rows", "", counts)],
            );
        }
        plot = plot.series(Series::reference("zero stress", &ends, &[100.0, 100.0]));
        plot.write(output.join(format!("percentage-error-C{component}.png")))?;
    }
    Ok(())
}

/// Draws `predicted-LAW.png`: predicted against measured stress of the test rows, S or nominal, all
/// components.
pub(super) fn predicted(name: &str, law: &Surrogate, test: &[&DataRow], output: &Path) -> Result<(), Error> {
    let mut memory = Workspace::default();
    let mut pairs = Vec::with_capacity(test.len());
    for row in test {
        pairs.push(row.compared(&law.stress(&row.c, &mut memory)?.stress));
    }
    let mut plot = LinePlot::new(&format!("{name}: test rows")).axes("S measured (MPa)", "S predicted (MPa)");
    let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
    for (a, component) in NAMES.iter().enumerate() {
        let measured: Vec<f64> = pairs.iter().map(|[measured, _]| measured[a] / 1e6).collect();
        if measured.iter().all(|s| *s == 0.0) {
            continue;
        }
        let answered: Vec<f64> = pairs.iter().map(|[_, predicted]| predicted[a] / 1e6).collect();
        ends = measured.iter().fold(ends, |[low, high], s| [low.min(*s), high.max(*s)]);
        plot = plot.series(Series::markers(&format!("S{component}"), &measured, &answered));
    }
    if ends[0] >= ends[1] {
        return Ok(());
    }
    plot = plot.series(Series::reference("measured", &ends, &ends));
    Ok(plot.write(output.join(format!("predicted-{name}.png")))?)
}
