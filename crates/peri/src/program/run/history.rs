//! History of loading: tables and curves of load against displacement and of energies.

use super::outcome::VariantOutcome;
use crate::probe::envelope;
use crate::program::observe::{damped_energy, has_times};
use crate::program::scene::{Scene, Track};
use crate::solver::{BreakingEvent, StepRecord};
use harness::output::csv;
use harness::output::picture::{LegendPlace, LinePlot, Series};
use polycore::Error;
use std::path::Path;

/// Largest number of curves with a legend inside the picture.
const INNER_LEGEND: usize = 8;

/// Column of the history: name, unit, values.
type HistoryColumn = (String, String, Vec<f64>);

impl VariantOutcome {
    /// Returns the steps as columns.
    pub fn columns(&self) -> Vec<HistoryColumn> {
        let each = |get: &dyn Fn(&StepRecord) -> f64| self.history.iter().map(get).collect();
        let mut columns: Vec<HistoryColumn> = Vec::new();
        columns.extend([
            ("displacement".to_owned(), "m".to_owned(), each(&|r| r.displacement)),
            ("load".to_owned(), "N".to_owned(), each(&|r| r.load)),
        ]);
        if !self.starts.is_empty() {
            let step = |row: usize| 1.0 + self.starts.iter().filter(|&&start| start <= row).count() as f64;
            columns.push(("step".to_owned(), "".to_owned(), (0..self.history.len()).map(step).collect()));
        }
        if has_times(&self.history) {
            columns.push(("time".to_owned(), "s".to_owned(), each(&|r| r.time)));
        }
        if self.dynamic {
            columns.push(("kinetic".to_owned(), "J".to_owned(), each(&|r| r.kinetic)));
        }
        for (index, region) in self.regions.iter().enumerate() {
            for (d, axis) in ["x", "y", "z"].iter().enumerate() {
                let values: Vec<f64> =
                    self.history.iter().filter_map(|r| Some(r.reactions.get(index)?[d])).collect();
                if values.len() == self.history.len() && values.iter().any(|&v| v != 0.0) {
                    columns.push((format!("reaction_{axis} {region}"), "N".to_owned(), values));
                }
            }
        }
        columns.extend([
            ("out_of_balance".to_owned(), "".to_owned(), each(&|r| r.residual)),
            ("iterations".to_owned(), "".to_owned(), each(&|r| r.iterations as f64)),
            ("equilibria".to_owned(), "".to_owned(), each(&|r| r.rounds as f64)),
            ("broken_bonds".to_owned(), "".to_owned(), each(&|r| r.broken as f64)),
            ("detached_particles".to_owned(), "".to_owned(), each(&|r| r.detached as f64)),
            ("largest_stretch".to_owned(), "".to_owned(), each(&|r| r.largest_stretch)),
            ("work".to_owned(), "J".to_owned(), each(&|r| r.work)),
            ("stored".to_owned(), "J".to_owned(), each(&|r| r.stored)),
            ("released".to_owned(), "J".to_owned(), each(&|r| r.released)),
            ("damped".to_owned(), "J".to_owned(), each(&|r| damped_energy(r, self.dynamic))),
        ]);
        if self.history.iter().any(|r| r.dissipated != 0.0) {
            columns.push(("dissipated".to_owned(), "J".to_owned(), each(&|r| r.dissipated)));
        }
        if self.history.iter().any(|r| r.rubbed != 0.0) {
            columns.push(("friction_work".to_owned(), "J".to_owned(), each(&|r| r.rubbed)));
        }
        for (index, surface) in self.surfaces.iter().enumerate() {
            let resting = |r: &StepRecord| r.resting.get(index).copied().unwrap_or_default();
            for (d, axis) in ["x", "y", "z"].iter().enumerate() {
                let values = each(&|r| resting(r).force[d]);
                if values.iter().any(|&v| v != 0.0) {
                    columns.push((format!("force_{axis} {surface}"), "N".to_owned(), values));
                }
            }
            for (d, axis) in ["x", "y", "z"].iter().enumerate().filter(|_| index >= self.planes) {
                let values = each(&|r| resting(r).moved[d]);
                if values.iter().any(|&v| v != 0.0) {
                    columns.push((format!("displacement_{axis} {surface}"), "m".to_owned(), values));
                }
            }
            for (d, axis) in ["x", "y", "z"].iter().enumerate() {
                let values = each(&|r| resting(r).velocity[d]);
                if values.iter().any(|&v| v != 0.0) {
                    columns.push((format!("velocity_{axis} {surface}"), "m/s".to_owned(), values));
                }
            }
            columns.push((format!("area {surface}"), "m²".to_owned(), each(&|r| resting(r).area)));
            columns.push((format!("pressure {surface}"), "Pa".to_owned(), each(&|r| resting(r).pressure)));
            columns.push((format!("spread {surface}"), "m".to_owned(), each(&|r| resting(r).spread)));
            columns.push((format!("width {surface}"), "m".to_owned(), each(&|r| resting(r).width)));
        }
        let touching: Vec<_> = self.history.iter().filter_map(|r| r.contact).collect();
        if !touching.is_empty() {
            columns.extend([
                ("contact_energy".to_owned(), "J".to_owned(), touching.iter().map(|t| t.energy).collect()),
                ("contacts".to_owned(), "".to_owned(), touching.iter().map(|t| t.pairs as f64).collect()),
                ("overlap".to_owned(), "".to_owned(), touching.iter().map(|t| t.overlap).collect()),
            ]);
        }
        for (index, (name, unit)) in self.probes.iter().enumerate() {
            columns.push((
                name.clone(),
                unit.clone(),
                each(&|r| r.seen.get(index).copied().unwrap_or(f64::NAN)),
            ));
        }
        columns
    }

    /// Returns the change of the load in the step that reaches the peak, over the peak.
    pub(super) fn step_at_peak(&self) -> Option<f64> {
        let loads: Vec<f64> = std::iter::once(0.0).chain(self.history.iter().map(|r| r.load)).collect();
        let (at, &peak) = loads.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
        (at > 0 && peak > 0.0).then(|| (peak - loads[at - 1]).abs() / peak)
    }

    /// Returns the [`envelope`] of displacement and load, from the undeformed body on.
    fn envelope(&self) -> [Vec<f64>; 2] {
        let rows = self.history.iter().map(|r| [r.displacement, r.load]);
        envelope(&std::iter::once([0.0; 2]).chain(rows).collect::<Vec<_>>())
    }
}

/// Returns a line per variant with its peak load and the resolution by load steps.
pub fn peak_lines(outcomes: &[VariantOutcome]) -> String {
    let line = |outcome: &VariantOutcome| {
        let peak = StepRecord::peak(&outcome.history)?;
        let (at, name) = (outcome.history[peak].displacement, &outcome.name);
        let load = outcome.history[peak].load;
        let near = [peak.checked_sub(1), Some(peak + 1)];
        let near: Vec<&StepRecord> = near.into_iter().filter_map(|row| outcome.history.get(row?)).collect();
        let gap = |r: &&StepRecord| [(r.displacement - at).abs(), (r.load - load).abs()];
        let gaps: Vec<[f64; 2]> = near.iter().map(gap).collect();
        let broken = outcome.history[peak].broken;
        let [apart, least] = match (&near[..], &gaps[..]) {
            // bonds break only after the peak: it lies between the two rows
            ([before, after], [[back, rise], [ahead, _]])
                if before.broken == broken && after.broken > broken =>
            {
                [*ahead, rise * ahead / back]
            }
            _ => gaps.iter().fold([0.0_f64, f64::INFINITY], |[a, l], gap| [a.max(gap[0]), l.min(gap[1])]),
        };
        (apart > 0.0 && load > 0.0 && !outcome.dynamic).then(|| {
            let (at, apart) = (at * 1e3, apart * 1e3);
            // with a load lowered after the peak, the step in which bonds broke has no row
            let lowered =
                outcome.history.get(peak + 1).is_some_and(|r| r.factor < outcome.history[peak].factor);
            let within = match lowered {
                true => String::new(),
                false => format!(", resolved to a load step of {apart:.3} mm, {least:.3} N"),
            };
            format!("{name}: peak {load:.5} N at {at:.5} mm{within}\n")
        })
    };
    outcomes.iter().filter_map(line).collect()
}

/// Returns the relative change of the peak load between the two finest spacings of each family.
pub fn peak_changes(outcomes: &[VariantOutcome]) -> Vec<(String, f64)> {
    let change = |(family, members): (String, Vec<&VariantOutcome>)| {
        let mut finest = members.iter().rev().map(|o| o.get("peak_load"));
        let (last, before) = (finest.next()??, finest.next()??);
        (last != 0.0).then(|| (family, ((last - before) / last).abs()))
    };
    super::outcome::families(outcomes).into_iter().filter_map(change).collect()
}

/// Draws the peak load over the spacing of each family.
fn draw_peaks(outcomes: &[VariantOutcome], output: &Path) -> Result<(), Error> {
    let mut plot = LinePlot::new("Peak load").size(900.0, 560.0).axes("spacing Δx (mm)", "peak load (N)");
    let mut any = false;
    for (family, members) in super::outcome::families(outcomes) {
        let peaks: Vec<f64> = members.iter().filter_map(|o| o.get("peak_load")).collect();
        if peaks.len() == members.len() {
            let spacing: Vec<f64> = members.iter().map(|o| o.spacing * 1e3).collect();
            plot = plot.series(Series::marked_line(&family, &spacing, &peaks));
            any = true;
        }
    }
    if any { plot.write(output.join("peak_load.png")) } else { Ok(()) }
}

/// Draws the load over each opening, beside the measured band.
fn draw_openings(scene: &Scene, several: &[&VariantOutcome], output: &Path) -> Result<(), Error> {
    for probe in scene.probe.iter().filter(|probe| probe.track == Track::Opening) {
        let mut plot = LinePlot::new(if scene.title.is_empty() { "Load" } else { &scene.title })
            .size(900.0, 560.0)
            .axes("opening (mm)", "load (N)");
        let at: Vec<f64> = probe.measured.iter().map(|row| row.0.si() * 1e3).collect();
        let bounds: [Vec<f64>; 2] =
            probe.measured.iter().map(|row| (row.1.si(), row.2.si())).unzip::<_, _, Vec<_>, Vec<_>>().into();
        for (name, loads) in ["measured, lowest", "measured, highest"].iter().zip(&bounds) {
            if !loads.is_empty() {
                plot = plot.series(Series::reference(name, &at, loads));
            }
        }
        for outcome in several {
            let columns = outcome.columns();
            if let Some(opening) = columns.iter().find(|column| column.0 == probe.name) {
                let x: Vec<f64> = opening.2.iter().map(|value| value * 1e3).collect();
                plot = plot.series(Series::line(&outcome.name, &x, &columns[1].2));
            }
        }
        plot.write(output.join(format!("load_{}.png", probe.name)))?;
    }
    Ok(())
}

/// Writes the tables of every variant, a plot of all loads, and a plot of energies for each variant with
/// broken bonds.
pub fn write(scene: &Scene, outcomes: &[VariantOutcome], output: &Path) -> Result<(), Error> {
    let several: Vec<&VariantOutcome> = outcomes.iter().filter(|o| o.history.len() > 1).collect();
    for outcome in &several {
        let columns = outcome.columns();
        let views: Vec<_> = columns.iter().map(|(n, u, v)| (n.as_str(), u.as_str(), v.as_slice())).collect();
        csv::write(output.join(format!("history_{}.csv", outcome.file_name())), &views)?;
    }
    for outcome in several.iter().filter(|outcome| outcome.snaps_back) {
        let [at, load] = outcome.envelope();
        let columns = [("displacement", "m", &at[..]), ("load", "N", &load)];
        csv::write(output.join(format!("envelope_{}.csv", outcome.file_name())), &columns)?;
    }
    for outcome in outcomes.iter().filter(|outcome| !outcome.events.is_empty()) {
        let each = |get: &dyn Fn(&BreakingEvent) -> f64| outcome.events.iter().map(get).collect::<Vec<f64>>();
        let (step, load) = (each(&|e| e.step as f64 + 1.0), each(&|e| e.load));
        let bonds = each(&|e| e.bonds as f64);
        let columns = [("step", "", &step[..]), ("load_before", "N", &load), ("bonds", "", &bonds)];
        csv::write(output.join(format!("events_{}.csv", outcome.file_name())), &columns)?;
    }
    for outcome in outcomes.iter().filter(|outcome| outcome.fragments.len() > 1) {
        let particles: Vec<f64> = outcome.fragments.iter().map(|own| own.particles as f64).collect();
        let volume: Vec<f64> = outcome.fragments.iter().map(|own| own.volume).collect();
        let is_uniform = scene.material.inclusions.iter().all(|inclusion| inclusion.density.is_none());
        let density = scene.dynamics.as_ref().filter(|_| is_uniform).map(|dynamics| dynamics.density.si());
        let mass: Option<Vec<f64>> = density.map(|density| volume.iter().map(|v| density * v).collect());
        let mut columns = vec![("particles", "", &particles[..]), ("volume", "m^3", &volume)];
        columns.extend(mass.iter().map(|mass| ("mass", "kg", &mass[..])));
        csv::write(output.join(format!("fragments_{}.csv", outcome.file_name())), &columns)?;
    }
    if several.is_empty() || !scene.output.pictures {
        return Ok(());
    }
    let mut plot = LinePlot::new(if scene.title.is_empty() { "Load" } else { &scene.title })
        .size(900.0, 560.0)
        .axes("displacement (mm)", "load (N)")
        .legend(if several.len() > INNER_LEGEND { LegendPlace::Outside } else { LegendPlace::TopLeft });
    let from_rest = |values: &[f64], scale: f64| -> Vec<f64> {
        std::iter::once(0.0).chain(values.iter().map(|v| v * scale)).collect()
    };
    // a body in free flight has neither load nor displacement
    let loaded: Vec<&&VariantOutcome> =
        several.iter().filter(|o| o.history.iter().any(|r| r.load != 0.0 || r.displacement != 0.0)).collect();
    for outcome in &loaded {
        let columns = outcome.columns();
        let (x, y) = (from_rest(&columns[0].2, 1e3), from_rest(&columns[1].2, 1.0));
        plot = plot.series(Series::line(&outcome.name, &x, &y));
        if outcome.snaps_back {
            let [at, load] = outcome.envelope();
            let at: Vec<f64> = at.iter().map(|u| u * 1e3).collect();
            plot = plot.series(Series::reference(&format!("{}, envelope", outcome.name), &at, &load));
        }
    }
    if !loaded.is_empty() {
        plot.write(output.join("load_displacement.png"))?;
    }
    draw_peaks(outcomes, output)?;
    draw_openings(scene, &several, output)?;
    for outcome in several.iter().filter(|o| o.history.iter().any(|r| r.broken > 0)) {
        let columns = outcome.columns();
        // a body in motion keeps moving after its loads stop
        let time = columns.iter().find(|c| c.0 == "time");
        let (label, x) = match time {
            Some(time) if outcome.dynamic => ("time (ms)", from_rest(&time.2, 1e3)),
            Some(time) => ("time (s)", from_rest(&time.2, 1.0)),
            None => ("displacement (mm)", from_rest(&columns[0].2, 1e3)),
        };
        let mut plot = LinePlot::new(&format!("Energies, {}", outcome.name))
            .size(900.0, 560.0)
            .axes(label, "energy (J)")
            .legend(LegendPlace::TopLeft);
        // `stored` includes the energy of contact
        for name in [
            "work",
            "stored",
            "contact_energy",
            "kinetic",
            "released",
            "dissipated",
            "damped",
            "friction_work",
        ] {
            if let Some(column) = columns.iter().find(|c| c.0 == name) {
                plot = plot.series(Series::line(name, &x, &from_rest(&column.2, 1.0)));
            }
        }
        plot.write(output.join(format!("energy_{}.png", outcome.file_name())))?;
    }
    Ok(())
}
