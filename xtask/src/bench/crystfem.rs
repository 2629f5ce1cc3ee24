//! `crystfem`: error against run time of its kinetics, time integrators and linear solvers; then the
//! [`brick`], with equal elements and on a distorted mesh.

use std::collections::BTreeMap;
use std::path::Path;

use harness::output::picture::{LinePlot, Series};
use miette::{IntoDiagnostic, Result, miette};

use super::{Row, brick, external, write};
use crate::table::TextTable;
use crate::workspace::Repository;

/// Default numbers of elements along an edge of the brick: 20 000, 100 000, 300 000, 1 000 000 nodes.
const EDGES: &str = "26,45,66,99";

/// Parts that run other programs: the brick, and the same with displaced inner nodes, so that no two elements
/// are equal.
const BRICK: &str = "brick";
const DISTORTED: &str = "distorted";

/// Curve: its name, and the measurements at each step length or tolerance.
type BenchCurve = (String, Vec<(String, BTreeMap<String, f64>)>);

/// Returns rows, tables, and whether other programs agree on the brick. `arguments` are names of parts
/// (default: all) and edges of the brick. Rows and pictures of each part go to `folder`.
pub fn run(workspace: &Repository, folder: &Path, arguments: &[String]) -> Result<(Vec<Row>, String, bool)> {
    let known = || PARTS.iter().map(|part| part.name).chain([BRICK, DISTORTED]);
    let (mut names, mut edges) = (Vec::new(), EDGES.to_owned());
    for argument in arguments {
        match known().find(|name| *name == argument.as_str()) {
            Some(name) => names.push(name),
            None => edges.clone_from(argument),
        }
    }
    let edges: Vec<usize> = edges
        .split(',')
        .map(|edge| {
            let allowed = known().collect::<Vec<_>>().join(", ");
            edge.trim()
                .parse()
                .map_err(|_| miette!("found `{edge}`; allowed: a number of elements, or {allowed}"))
        })
        .collect::<Result<_>>()?;
    let wanted = |name: &str| names.is_empty() || names.contains(&name);
    let program = workspace.bench("crystfem")?;
    let (mut all, mut text, mut passed) = (Vec::new(), String::new(), true);
    let mut take = |name: &str, rows: Vec<Row>| -> Result<()> {
        write(workspace, &format!("crystfem-{name}"), &rows)?;
        all.extend(rows.into_iter().map(|row| Row { what: format!("{name} {}", row.what), ..row }));
        Ok(())
    };
    for part in PARTS.iter().filter(|part| wanted(part.name)) {
        let rows = external(&program, &[part.name, "--threads", "1"].map(str::to_owned))?;
        let curves = curves(&rows);
        text += &format!("{}, one thread\n{}\n", part.title, table(part, &curves));
        part.draw(folder, &curves)?;
        take(part.name, rows)?;
    }
    for name in [BRICK, DISTORTED].into_iter().filter(|name| wanted(name)) {
        let brick = brick::run(&program, workspace, folder, name == DISTORTED, &edges)?;
        (text, passed) = (text + &brick.text, passed && brick.passed);
        take(name, brick.rows)?;
    }
    Ok((all, text, passed))
}

/// Measurement of `crates/crystfem/benches/measure.rs`.
struct BenchTable {
    name: &'static str,
    title: &'static str,
    /// Heading of the table.
    heading: [&'static str; 6],
    /// Quantities shown besides error and time.
    more: [&'static str; 2],
    error: &'static str,
    time: &'static str,
    /// First words of the curves of each picture; an empty word selects all curves.
    pictures: &'static [&'static str],
}

const PARTS: &[BenchTable] = &[
    BenchTable {
        name: "kinetics",
        title: "Kinetics, 200 → 120 °C at 10 K/min",
        heading: ["scheme", "K a step", "largest error in α", "s", "ns a step", ""],
        more: ["step", ""],
        error: "largest error in α",
        time: "time of the curve / s",
        pictures: &[""],
    },
    BenchTable {
        name: "integrators",
        title: "Time integrators, cube of 17³ nodes that cools from a smooth temperature, and one that is \
                quenched",
        heading: ["integrator", "steps / tolerance, K", "rms error, K", "s", "steps taken", "CG iterations"],
        more: ["steps", "cg iterations"],
        error: "rms error / K",
        time: "time / s",
        pictures: &["smooth", "quenched"],
    },
    BenchTable {
        name: "solvers",
        title: "Linear solvers, steps of 0.5, 5 and 50 s of the quenched cube of 27³ nodes",
        heading: ["solver", "tolerance, K", "rms error, K", "s a step", "set-up, s", "CG iterations a step"],
        more: ["set-up", "cg iterations"],
        error: "rms error / K",
        time: "time of a step / s",
        pictures: &[""],
    },
];

impl BenchTable {
    fn draw(&self, folder: &Path, curves: &[BenchCurve]) -> Result<()> {
        for first in self.pictures {
            let title = [self.title.split(',').next().unwrap_or_default(), first].join(": ");
            let mut plot =
                LinePlot::new(title.trim_end_matches(": ")).axes(self.time, self.error).log_x().log_y();
            for (name, points) in curves.iter().filter(|(name, _)| name.starts_with(first)) {
                let there = points.iter().filter_map(|(_, at)| Some((*at.get("time")?, *at.get("error")?)));
                // zero has no place on a logarithmic axis
                let (x, y): (Vec<f64>, Vec<f64>) = there.filter(|(_, error)| *error > 0.0).unzip();
                if !x.is_empty() {
                    plot = plot.series(Series::marked_line(name[first.len()..].trim(), &x, &y));
                }
            }
            let name = ["crystfem", self.name, first].join("-");
            plot.write(folder.join(format!("{}.png", name.trim_end_matches('-')))).into_diagnostic()?;
        }
        Ok(())
    }
}

/// Collects rows `CURVE PLACE: QUANTITY` and `CURVE PLACE: QUANTITY, PROBLEM` in the order of their first
/// appearance; other rows belong to no curve.
fn curves(rows: &[Row]) -> Vec<BenchCurve> {
    let mut curves: Vec<BenchCurve> = Vec::new();
    for row in rows {
        let Some((words, quantity)) = row.what.split_once(": ") else { continue };
        let (Some((name, place)), Some(value)) = (words.rsplit_once(' '), row.value) else { continue };
        let (quantity, problem) = quantity.split_once(", ").unwrap_or((quantity, ""));
        let name = format!("{problem} {name}").trim_start().to_owned();
        let known = curves.iter().position(|(other, _)| *other == name);
        let curve = known.unwrap_or_else(|| {
            curves.push((name, Vec::new()));
            curves.len() - 1
        });
        let points = &mut curves[curve].1;
        if points.last().is_none_or(|(other, _)| other != place) {
            points.push((place.to_owned(), BTreeMap::new()));
        }
        if let Some((_, at)) = points.last_mut() {
            at.insert(quantity.to_owned(), value);
        }
    }
    curves
}

fn table(part: &BenchTable, curves: &[BenchCurve]) -> String {
    let mut table = TextTable::new(part.heading);
    for (name, points) in curves {
        for (place, at) in points {
            let shown = |quantity: &str, digits: usize| {
                at.get(quantity).map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$e}"))
            };
            let [first, second] = part.more.map(|quantity| match at.get(quantity) {
                Some(value) => format!("{value:.2}").trim_end_matches('0').trim_end_matches('.').to_owned(),
                None => String::new(),
            });
            table.push([name.clone(), place.clone(), shown("error", 2), shown("time", 2), first, second]);
        }
    }
    table.text()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_become_curves() {
        let row = |what: &str, value: Option<f64>| Row {
            what: what.to_owned(),
            size: 1,
            threads: 1,
            value,
            unit: String::new(),
        };
        let rows = [
            row("euler-fixed 4: error, smooth", Some(1.0)),
            row("euler-fixed 4: time, smooth", Some(2.0)),
            row("euler-fixed 8: error, smooth", None),
            row("euler-fixed 8: time, smooth", Some(4.0)),
            row("euler-fixed 4: error", Some(3.0)),
            row("response of a material", Some(9.0)),
        ];
        let curves = curves(&rows);
        let names: Vec<&str> = curves.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["smooth euler-fixed", "euler-fixed"]);
        let points = &curves[0].1;
        assert_eq!((points[0].1["error"], points[1].1["time"]), (1.0, 4.0));
        assert_eq!(points[1].1.get("error"), None);
        let text = table(&PARTS[1], &curves);
        assert!(text.contains("smooth euler-fixed  8                     -             4.00e0"), "{text}");
    }
}
