//! Peaks of heat flow: enthalpies, tables and pictures.

use super::fit::stem;
use crate::fit::MeasuredPeak;
use crate::program::observe::celsius::to_celsius;
use crate::program::quantities as q;
use crate::program::scene::FitSpec;
use harness::output::csv;
use harness::output::picture::{LinePlot, Series};
use harness::report::Report;
use std::path::Path;

/// Reports enthalpy and degree of crystallinity for each file of a fit.
pub fn record(report: &mut Report, spec: &FitSpec, peaks: &[MeasuredPeak]) {
    let perfect = spec.heat_flow.as_ref().and_then(|flow| flow.latent_heat);
    for (index, MeasuredPeak { peak, .. }) in peaks.iter().enumerate() {
        let run = (index + 1).to_string();
        report.value(q::ENTHALPY.named(&[&spec.name, &run]), peak.enthalpy / 1e3);
        if let Some(perfect) = perfect {
            report.value(q::CRYSTALLINITY.named(&[&spec.name, &run]), peak.enthalpy / perfect.si());
        }
    }
}

/// Writes NAME-heat-flow.csv and .png: released heat, baseline and α. Does nothing without peaks.
pub fn write(
    output: &Path,
    spec: &FitSpec,
    peaks: &[MeasuredPeak],
    picture: bool,
) -> Result<(), polycore::Error> {
    let Some(first) = peaks.first() else { return Ok(()) };
    let name = &spec.name;
    let mut columns: Vec<(&str, &str, Vec<f64>)> = vec![
        ("run", "", Vec::new()),
        ("time", "s", Vec::new()),
        ("heat_flow", "W/g", Vec::new()),
        ("baseline", "W/g", Vec::new()),
        ("alpha", "", Vec::new()),
    ];
    let cooling = !first.temperatures.is_empty();
    if cooling {
        columns.push(("temperature", "degC", Vec::new()));
    }
    let axis = if cooling { "temperature (°C)" } else { "time (s)" };
    let mut plot = LinePlot::new(name).axes(axis, "released heat (W/g)").size(800.0, 460.0);
    let mut under = [Vec::new(), Vec::new()];
    for (index, (MeasuredPeak { peak, temperatures, .. }, data)) in peaks.iter().zip(&spec.data).enumerate() {
        let per_gram = |flows: &[f64]| flows.iter().map(|q| q / 1e3).collect::<Vec<f64>>();
        let [flows, baseline] = [per_gram(&peak.flows), per_gram(&peak.baseline)];
        let celsius = to_celsius(temperatures);
        let x = if cooling { &celsius } else { &peak.times };
        plot = plot.series(Series::line(&stem(&data.file), x, &flows));
        under[0].extend(x);
        under[1].extend(&baseline);
        // NaN separates the lines of the runs
        under.iter_mut().for_each(|values| values.push(f64::NAN));
        let run = vec![(index + 1) as f64; x.len()];
        let all = [run, peak.times.clone(), flows, baseline, peak.degrees.clone(), celsius];
        columns.iter_mut().zip(all).for_each(|(column, values)| column.2.extend(values));
    }
    let columns: Vec<csv::Column> =
        columns.iter().map(|(name, unit, values)| (*name, *unit, &values[..])).collect();
    csv::write(output.join(format!("{name}-heat-flow.csv")), &columns)?;
    if !picture {
        return Ok(());
    }
    let plot = plot.series(Series::reference("baseline", &under[0], &under[1]));
    plot.write(output.join(format!("{name}-heat-flow.png")))
}
