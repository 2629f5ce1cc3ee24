//! Report of a sweep, and pictures of its values over the first key.

use super::{FAILED_RUNS, Vary, divided};
use crate::case::Program;
use crate::case::rows::{Rows, STATISTICS, numeric};
use crate::output::picture::{LinePlot, Series};
use crate::report::Report;
use crate::scene::Source;
use crate::study::plain;
use std::path::Path;

/// Every statistic of every run, and as curves against the number of the run.
pub(super) fn together(program: &Program, source: &Source, vary: &[Vary], rows: &Rows) -> Report {
    let mut report = Report::new(program.name, program.version, &source.text);
    let finished = || rows.rows.iter().filter_map(|row| Some((row, row.outcome.as_ref().ok()?)));
    let numbers: Vec<f64> =
        rows.rows.iter().zip(1..).filter(|(row, _)| row.outcome.is_ok()).map(|(_, k)| f64::from(k)).collect();
    let mut columns = vec![("run".to_owned(), String::new(), numbers)];
    for (index, vary) in vary.iter().enumerate() {
        if let Some((values, unit)) = numeric(&vary.values) {
            let of = |text: &String| values[vary.values.iter().position(|v| v == text).unwrap_or(0)];
            let list = finished().map(|(row, _)| of(&row.settings[index])).collect();
            columns.push((vary.key.clone(), unit, list));
        }
    }
    for name in rows.names() {
        let list = finished().map(|(_, report)| report.scalar(&name).unwrap_or(f64::NAN)).collect::<Vec<_>>();
        // a curve has no gaps
        if list.iter().all(|value| value.is_finite()) {
            columns.push((name, String::new(), list));
        }
    }
    let views: Vec<(&str, &str, Vec<f64>)> =
        columns.iter().map(|(name, unit, list)| (name.as_str(), unit.as_str(), list.clone())).collect();
    report.curve("sweep", &views);
    report.value(FAILED_RUNS, (rows.rows.len() - finished().count()) as f64);
    report.work("runs", rows.rows.len() as u64);
    report.work("steps", finished().filter_map(|(_, own)| own.work.get("steps")).sum());
    report
}

/// Returns the places of the values of a key and the label of their axis: of lists and tables the entry that
/// varies alone, `boundary[1].to[0] [mm]`; the position in the sweep where there is no such number.
fn axis(vary: &Vary) -> (Vec<f64>, String) {
    let first = |text: &String| divided(text, ';').swap_remove(0);
    let key = first(&vary.key);
    let entries: Vec<Vec<(String, String)>> = vary.values.iter().map(|text| entries(&first(text))).collect();
    let column = |place: usize| -> Option<Vec<&(String, String)>> {
        entries.iter().map(|entries| entries.get(place)).collect()
    };
    let most = entries.iter().map(Vec::len).max().unwrap_or_default();
    let columns: Option<Vec<_>> = (0..most).map(column).collect();
    let mut varying = columns.iter().flatten().filter(|column| column.iter().any(|own| *own != column[0]));
    if let (Some(column), None) = (varying.next(), varying.next())
        && column.iter().all(|(path, _)| *path == column[0].0)
        && let Some((places, unit)) =
            numeric(&column.iter().map(|(_, text)| text.clone()).collect::<Vec<_>>())
    {
        let unit = if unit.is_empty() { unit } else { format!(" [{}]", unit.replace("degC", "°C")) };
        return (places, format!("{key}{}{unit}", column[0].0));
    }
    let count = vary.values.len();
    let names = vary.values.join(", ");
    let names =
        if names.chars().count() > LABEL { format!("value 1 to {count} of the sweep") } else { names };
    ((1..=count).map(|k| k as f64).collect(), format!("{key}: {names}"))
}

/// Returns the entries of a value: path within it (empty, `[1]`, `.stretch`) and text.
fn entries(text: &str) -> Vec<(String, String)> {
    fn collect(path: String, value: &toml::Value, all: &mut Vec<(String, String)>) {
        match value {
            toml::Value::Array(items) => {
                items.iter().zip(0..).for_each(|(item, k)| collect(format!("{path}[{k}]"), item, all));
            }
            toml::Value::Table(table) => {
                table.iter().for_each(|(key, item)| collect(format!("{path}.{key}"), item, all));
            }
            toml::Value::String(text) => all.push((path, text.clone())),
            other => all.push((path, other.to_string())),
        }
    }
    let mut all = Vec::new();
    match format!("value = {text}").parse::<toml::Table>() {
        Ok(table) => collect(String::new(), &table["value"], &mut all),
        // a quantity without quotes
        Err(_) => all.push((String::new(), text.to_owned())),
    }
    all
}

/// Values with a picture of their own at most.
const DRAWN: usize = 8;
/// Characters of the values in the label of an axis at most.
const LABEL: usize = 60;

/// sweep_FIELD.png: mean, least and largest at the end (the mean only where several keys vary), and
/// sweep_deviation_of_FIELD.png, sweep_VALUE.png of at most [`DRAWN`] other values, against the first
/// key, with a line for each combination of the others.
pub(super) fn draw(vary: &[Vary], rows: &Rows, output: &Path) -> Result<(), polycore::Error> {
    let Some(first) = vary.first().filter(|vary| vary.values.len() > 1) else { return Ok(()) };
    let (places, label) = axis(first);
    let mut others: Vec<String> = rows.rows.iter().map(|row| row.settings[1..].join(", ")).collect();
    others.dedup();
    others.sort();
    others.dedup();
    let points = |other: &String, name: &str| -> (Vec<f64>, Vec<f64>) {
        let mut points: Vec<(f64, f64)> = rows
            .rows
            .iter()
            .filter(|row| row.settings[1..].join(", ") == *other)
            .filter_map(|row| {
                let value = row.outcome.as_ref().ok()?.scalar(name)?;
                Some((places[first.values.iter().position(|v| *v == row.settings[0])?], value))
            })
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points.into_iter().unzip()
    };
    let asked = rows.requested();
    for name in asked.iter().filter(|name| asked.len() <= DRAWN && rows.has_value(name)) {
        let mut plot = LinePlot::new("At the end").axes(&label, &rows.heading(name)).size(800.0, 480.0);
        for other in &others {
            let (x, y) = points(other, name);
            let label = if other.is_empty() { name } else { other };
            plot = plot.series(Series::marked_line(&label.replace("degC", " °C"), &x, &y));
        }
        plot.write(output.join(format!("sweep_{}.png", plain(name))))?;
    }
    for field in rows.fields() {
        let line = |other: &String, statistic: &str| {
            let name = [statistic.trim_end_matches("_of_").trim_end_matches('_'), other];
            let name: Vec<&str> = name.into_iter().filter(|part| !part.is_empty()).collect();
            let name = name.join(", ").replace("degC", " °C");
            let (x, y) = points(other, &format!("{statistic}{field}"));
            Series::marked_line(&name, &x, &y)
        };
        let plot = |statistics: &[&str], what: &str| {
            let mut plot = LinePlot::new("At the end").axes(&label, what).size(800.0, 480.0);
            for other in &others {
                // not every field has all of them: healing has no largest
                for statistic in statistics.iter().filter(|name| rows.has_value(&format!("{name}{field}"))) {
                    plot = plot.series(line(other, statistic));
                }
            }
            plot
        };
        let unit = if field == "temperature" {
            ["temperature [°C]", "deviation of temperature [K]"]
        } else {
            ["", ""]
        };
        let what = if unit[0].is_empty() { field.as_str() } else { unit[0] };
        let shown = if others.len() > 1 { &STATISTICS[..1] } else { &STATISTICS[..3] };
        plot(shown, what).write(output.join(format!("sweep_{field}.png")))?;
        let deviation = format!("deviation of {field}");
        let what = if unit[1].is_empty() { deviation.as_str() } else { unit[1] };
        if rows.has_value(&format!("{}{field}", STATISTICS[3])) {
            plot(&STATISTICS[3..], what).write(output.join(format!("sweep_deviation_of_{field}.png")))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_that_vary_alone_are_axes() {
        let labelled = |text: &str| axis(&text.parse().unwrap());
        let told = |text: &str, places: &[f64], label: &str| {
            assert_eq!(labelled(text), (places.to_vec(), label.to_owned()));
        };
        told("time.end=10 s,20s", &[10.0, 20.0], "time.end [s]");
        told("body.ratio=3,4.5", &[3.0, 4.5], "body.ratio");
        let lists = "boundary[1].to=[\"-8 mm\",\"0 mm\"],[\"-4mm\",\"0 mm\"]";
        told(lists, &[-8.0, -4.0], "boundary[1].to[0] [mm]");
        let tables = "critical={stretch=2,links=9},{stretch=3,links=9};end=1s,2s";
        told(tables, &[2.0, 3.0], "critical.stretch");
        told("a=[1,2],[3,4]", &[1.0, 2.0], "a: [1,2], [3,4]");
        told("a=[1,2],[3,2,5]", &[1.0, 2.0], "a: [1,2], [3,2,5]");
        told("end=1 s,1 min", &[1.0, 2.0], "end: 1 s, 1 min");
        let long = labelled(&format!("a=[{}],[0,1]", "1,".repeat(40)));
        assert_eq!(long.1, "a: value 1 to 2 of the sweep");
    }
}
