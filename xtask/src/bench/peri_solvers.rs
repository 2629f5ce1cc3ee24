//! Quasi-static methods of `peri` on the plate with a hole: error against work and run time.

use std::collections::BTreeMap;
use std::path::Path;

use harness::output::picture::{LinePlot, Series};
use miette::{IntoDiagnostic, Result, miette};

use super::{Row, external};
use crate::table::TextTable;
use crate::workspace::Repository;

/// Default spacings of particles, mm.
const SPACINGS: &str = "10,5,2";

/// Run of one method at one tolerance, on one lattice.
#[derive(Default)]
struct SolverRun {
    tolerance: String,
    error: f64,
    forces: f64,
    bonds: f64,
    seconds: f64,
}

/// Returns the rows and their table; pictures go to `folder`/peri-solvers-{time,work}.png.
pub fn run(workspace: &Repository, folder: &Path, arguments: &[String]) -> Result<(Vec<Row>, String)> {
    let spacings = arguments.first().map_or(SPACINGS, String::as_str);
    let rows = external(&workspace.bench("peri")?, &["--solvers".to_owned(), spacings.to_owned()])?;
    let curves = curves(&rows)?;
    let mut table = TextTable::new([
        "particles",
        "method",
        "residual",
        "error",
        "force evaluations",
        "bond evaluations",
        "s",
    ]);
    for ((particles, method), points) in &curves {
        for point in points {
            table.push([
                particles.to_string(),
                method.clone(),
                point.tolerance.clone(),
                format!("{:.2e}", point.error),
                format!("{:.0}", point.forces),
                format!("{:.3e}", point.bonds),
                format!("{:.3}", point.seconds),
            ]);
        }
    }
    draw(folder, "time", "time / s", &curves, |point| point.seconds)?;
    draw(folder, "work", "directed bond evaluations", &curves, |point| point.bonds)?;
    Ok((rows, table.text()))
}

type SolverCurves = BTreeMap<(u64, String), Vec<SolverRun>>;

/// Collects rows `METHOD TOLERANCE: QUANTITY`.
fn curves(rows: &[Row]) -> Result<SolverCurves> {
    let mut curves = SolverCurves::new();
    for row in rows {
        let unknown = || miette!("--solvers printed a row `{}`", row.what);
        let (method, rest) = row.what.split_once(' ').ok_or_else(unknown)?;
        let (tolerance, quantity) = rest.split_once(": ").ok_or_else(unknown)?;
        let value = row.value.ok_or_else(unknown)?;
        let points = curves.entry((row.size, method.to_owned())).or_default();
        if points.last().is_none_or(|point| point.tolerance != tolerance) {
            points.push(SolverRun { tolerance: tolerance.to_owned(), ..SolverRun::default() });
        }
        let point = points.last_mut().ok_or_else(unknown)?;
        match quantity {
            "error" => point.error = value,
            "force evaluations" => point.forces = value,
            "bond evaluations" => point.bonds = value,
            "time" => point.seconds = value,
            _ => return Err(unknown()),
        }
    }
    Ok(curves)
}

fn draw(
    folder: &Path,
    name: &str,
    label: &str,
    curves: &SolverCurves,
    x: impl Fn(&SolverRun) -> f64,
) -> Result<()> {
    let mut plot = LinePlot::new("Plate with a hole: error of displacements")
        .axes(label, "largest error / rms displacement")
        .log_x()
        .log_y();
    for ((particles, method), points) in curves {
        let xs: Vec<f64> = points.iter().map(&x).collect();
        let ys: Vec<f64> = points.iter().map(|point| point.error).collect();
        plot = plot.series(Series::marked_line(&format!("{method}, {particles} particles"), &xs, &ys));
    }
    plot.write(folder.join(format!("peri-solvers-{name}.png"))).into_diagnostic()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_become_points() {
        let row = |what: &str, value: f64| Row {
            what: what.to_owned(),
            size: 100,
            threads: 2,
            value: Some(value),
            unit: String::new(),
        };
        let rows = [row("adr 1e-2: error", 0.1), row("adr 1e-2: time", 3.0), row("adr 1e-3: error", 0.01)];
        let curves = curves(&rows).expect("points");
        let points = &curves[&(100, "adr".to_owned())];
        assert_eq!((points.len(), points[0].seconds, points[1].error), (2, 3.0, 0.01));
        assert!(super::curves(&[row("something else", 1.0)]).is_err());
    }
}
