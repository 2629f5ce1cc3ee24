//! Error against run time, from what `cargo xtask bench` has measured and from cases that time themselves.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use harness::output::picture::{LinePlot, Series};
use miette::{IntoDiagnostic, Result};
use serde::Serialize;

use super::pictures;
use super::points::{of_curves, of_table, pairs};
use crate::bench;
use crate::stamp::Stamp;
use crate::validate::outcome::Outcome;
use crate::workspace::Workspace;

/// Where the points of a subject are.
enum Source {
    /// Rows of target/bench/NAME.json: what distinguishes those of errors and those of times, the rest being a point.
    Bench { name: &'static str, error: &'static str, time: &'static str },
    /// A table among a case's results: a method a row, its name in the first column; these columns, the times multiplied.
    Table { case: &'static str, file: &'static str, error: usize, time: usize, scale: f64 },
    /// Curves of a case's report: columns `seconds` and, last, errors.
    Case { case: &'static str, curves: &'static str },
}

/// Alternatives for one thing.
struct Subject {
    title: &'static str,
    source: Source,
    /// What separates the name of a method from its setting in a point's name.
    split: &'static str,
    /// The method that is taken where a scene names none.
    default: &'static str,
    axes: [&'static str; 2],
    /// What measures it.
    command: &'static str,
    note: &'static str,
}

const SUBJECTS: &[Subject] = &[
    Subject {
        title: "Inverse Langevin functions",
        source: Source::Bench { name: "langevin", error: "largest relative error", time: "time" },
        split: "\n",
        default: "exact",
        axes: ["ns per call", "largest relative error over (0, 1)"],
        command: "cargo xtask bench langevin",
        note: "",
    },
    Subject {
        title: "Evaluation of the bond law",
        source: Source::Bench { name: "peri-laws", error: "largest error", time: "time" },
        split: " with ",
        default: "fitted",
        axes: ["ns per bond", "largest error / rms tension"],
        command: "cargo xtask bench peri-laws",
        note: "Law `chain-offset`, one stretch after the other; the kernels evaluate the fit for eight bonds at once. Newton is the exact law.",
    },
    Subject {
        title: "Stress measures and corrections",
        source: Source::Case { case: "ch2/plate-convergence", curves: "error_against_time_" },
        split: "\n",
        default: "spline [m=3.015]",
        axes: ["s, whole solution", "RMSE of the normalized stress, Eq. (2.84), loaded layers left out"],
        command: "cargo xtask validate --case cases/ch2/plate-convergence",
        note: "The plate with a hole against its own series solution at several spacings; each curve is one measure, horizon and correction.",
    },
    Subject {
        title: "Quasi-static solvers",
        source: Source::Bench { name: "peri-solvers", error: "error", time: "time" },
        split: " ",
        default: "lbfgs",
        axes: ["s", "largest error / rms displacement"],
        command: "cargo xtask bench peri-solvers",
        note: "The plate with a hole on the finest lattice that was measured; a point for each tolerance of the residual.",
    },
    Subject {
        title: "Fracture: what breaks",
        source: Source::Case { case: "ch2/dent-events", curves: "error_against_time_" },
        split: "\n",
        default: "peak_load [m=3.015 lbfgs]",
        axes: ["s, whole solution", "error of the peak load"],
        command: "cargo xtask validate --case cases/ch2/dent-events",
        note: "A notched sheet torn apart, against a residual of 1e-8; a point for each tolerance of the residual.",
    },
    Subject {
        title: "Fracture: load steps",
        source: Source::Case { case: "ch2/dent-steps", curves: "error_against_time_" },
        split: "\n",
        default: "peak_load [m=3.015 refine]",
        axes: ["s, whole solution", "error of the peak load"],
        command: "cargo xtask validate --case cases/ch2/dent-steps",
        note: "The same sheet against an independent program; a point for each number of steps, and for each `refine` of 15 steps.",
    },
    Subject {
        title: "Fracture: a response that snaps back",
        source: Source::Case { case: "ch2/dent-snap-back", curves: "error_against_time_" },
        split: "\n",
        default: "released_energy [m=3.015 refine]",
        axes: ["s, whole solution", "error of the energy of broken bonds"],
        command: "cargo xtask validate --case cases/ch2/dent-snap-back",
        note: "The same sheet torn along its equilibria, against an independent program; a point for each `refine`, and one for a displacement that is held.",
    },
    Subject {
        title: "Fracture: spacing",
        source: Source::Case { case: "ch2/dent-convergence", curves: "error_against_time_" },
        split: "\n",
        default: "peak_load [m=3.015 G]",
        axes: ["s, whole solution", "difference of the peak load from that at Δx = 1 mm"],
        command: "cargo xtask validate --case cases/ch2/dent-convergence",
        note: "The same sheet with a given fracture energy; a point for each spacing.",
    },
    Subject {
        title: "Contact",
        source: Source::Case { case: "ch2/contact-series", curves: "error_against_time_" },
        split: "\n",
        default: "peak_load [m=1 adr]",
        axes: ["s, whole solution", "error of the force against a rigid contact"],
        command: "cargo xtask validate --case cases/ch2/contact-series",
        note: "Springs in series, one of them the contact; a point for each stiffness of the contact.",
    },
    Subject {
        title: "Explicit dynamics",
        source: Source::Case { case: "ch2/verlet-steps", curves: "error_against_time_" },
        split: "\n",
        default: "largest_displacement [m=1 verlet]",
        axes: ["s, whole solution", "error of the displacement"],
        command: "cargo xtask validate --case cases/ch2/verlet-steps",
        note: "Linear oscillators; a point for each time step.",
    },
    Subject {
        title: "Integrators of Nakamura's law",
        source: Source::Bench { name: "crystfem-kinetics", error: "error", time: "time" },
        split: " ",
        default: "z-gauss2",
        axes: ["s, whole curve", "largest error in α"],
        command: "cargo xtask bench crystfem -- kinetics",
        note: "PA12 cooled from 200 to 120 °C; a point for each length of steps, K. Schemes that leave [0, 1] have no point there.",
    },
    Subject {
        title: "Time integrators of heat conduction, smooth",
        source: Source::Bench { name: "crystfem-integrators", error: "error, smooth", time: "time, smooth" },
        split: " ",
        default: "tr-bdf2-adaptive",
        axes: ["s", "rms error, K"],
        command: "cargo xtask bench crystfem -- integrators",
        note: "A cube that cools from an eigenvector of its finite elements; a point for each number of steps or tolerance.",
    },
    Subject {
        title: "Time integrators of heat conduction, quenched",
        source: Source::Bench {
            name: "crystfem-integrators",
            error: "error, quenched",
            time: "time, quenched",
        },
        split: " ",
        default: "tr-bdf2-adaptive",
        axes: ["s", "rms error, K"],
        command: "cargo xtask bench crystfem -- integrators",
        note: "The same cube, quenched at three faces.",
    },
    Subject {
        title: "Linear solvers of heat conduction, short steps",
        source: Source::Bench {
            name: "crystfem-solvers",
            error: "error, 0.5 s a step",
            time: "time, 0.5 s a step",
        },
        split: " ",
        default: "cg",
        axes: ["s per step", "rms error, K"],
        command: "cargo xtask bench crystfem -- solvers",
        note: "The quenched cube of 27³ nodes, 0.5 s a step; a point for each tolerance. Factors are made before.",
    },
    Subject {
        title: "Linear solvers of heat conduction, long steps",
        source: Source::Bench {
            name: "crystfem-solvers",
            error: "error, 50 s a step",
            time: "time, 50 s a step",
        },
        split: " ",
        default: "cg",
        axes: ["s per step", "rms error, K"],
        command: "cargo xtask bench crystfem -- solvers",
        note: "The same with 50 s a step.",
    },
    Subject {
        title: "Crystallization with births, over the step",
        source: Source::Case { case: "ch4/error-against-time", curves: "error_against_time_step-" },
        split: "\n",
        default: "adaptive",
        axes: ["s of the solution", "rms error of the layers' mean α"],
        command: "cargo xtask validate --case cases/ch4/error-against-time",
        note: "A bar of three layers that crystallizes, melts and gives off heat while it is printed; a point for each step or tolerance. The truth is the same program at a tolerance of 1e-4 K.",
    },
    Subject {
        title: "Crystallization with births, over the mesh",
        source: Source::Case { case: "ch4/error-against-time", curves: "error_against_time_mesh-" },
        split: "\n",
        default: "hex8",
        axes: ["s of the solution", "rms error of the layers' mean α"],
        command: "cargo xtask validate --case cases/ch4/error-against-time",
        note: "The same bar on grids of 1 to 6 elements a layer; six tetrahedra fill a cell. The truth is hexahedra, 12 a layer.",
    },
    Subject {
        title: "Warpage of a print, over the step",
        source: Source::Case { case: "ch5/print-warpage", curves: "error_against_time_cold-" },
        split: "\n",
        default: "over-tolerance",
        axes: ["s of the solution", "error of the warpage, m"],
        command: "cargo xtask validate --case cases/ch5/print-warpage",
        note: "A bar in a cold chamber whose warpage is 0.21 mm; a point for each temporal tolerance of the temperature. The truth is the same program at 0.02 K.",
    },
    Subject {
        title: "Latent heat",
        source: Source::Case { case: "ch4/freezing", curves: "error_against_time_latent-" },
        split: "\n",
        default: "width-of-mesh",
        axes: ["s of the solution", "rms error, K"],
        command: "cargo xtask validate --case cases/ch4/freezing",
        note: "Freezing with latent heat as a peak of c(T), against Neumann's closed form; a point for each mesh, or each tolerance.",
    },
    Subject {
        title: "Surrogate models: training",
        source: Source::Table {
            case: "ch3/train-default",
            file: "error_against_time.csv",
            error: 1,
            time: 2,
            scale: 1.0,
        },
        split: "\n",
        default: "energy",
        axes: ["s of training", "error (3.12) on test runs, MPa²"],
        command: "cargo xtask validate --case cases/ch3/train-default",
        note: "Laws learnt from the shipped molecular dynamics, split by path.",
    },
    Subject {
        title: "Surrogate models: inference",
        source: Source::Table {
            case: "ch3/train-default",
            file: "error_against_time.csv",
            error: 1,
            time: 3,
            scale: 1e6,
        },
        split: "\n",
        default: "energy",
        axes: ["µs per stress", "error (3.12) on test runs, MPa²"],
        command: "cargo xtask validate --case cases/ch3/train-default",
        note: "The same laws, one stress at a time.",
    },
    Subject {
        title: "Surrogate models on a known law: training",
        source: Source::Table {
            case: "ch3/known-law",
            file: "error_against_time.csv",
            error: 1,
            time: 2,
            scale: 1.0,
        },
        split: "_",
        default: "energy",
        axes: ["s of training", "error (3.12) on unseen runs, MPa²"],
        command: "cargo xtask validate --case cases/ch3/known-law",
        note: "An orthotropic, softening law without noise; of each kind five networks, the larger trained for longer.",
    },
    Subject {
        title: "Surrogate models on a known law: inference",
        source: Source::Table {
            case: "ch3/known-law",
            file: "error_against_time.csv",
            error: 1,
            time: 3,
            scale: 1e6,
        },
        split: "_",
        default: "energy",
        axes: ["µs per stress", "error (3.12) on unseen runs, MPa²"],
        command: "cargo xtask validate --case cases/ch3/known-law",
        note: "The same networks, one stress at a time.",
    },
    Subject {
        title: "Searches for hyperparameters",
        source: Source::Case { case: "ch3/search-methods", curves: "error_against_time_" },
        split: "\n",
        default: "hyperband",
        axes: ["s of training", "best validation loss (3.12) so far, MPa²"],
        command: "cargo xtask validate --case cases/ch3/search-methods",
        note: "γ-PA12, a part of Table 3.3; medians of three seeds at equal epochs, against candidates at random.",
    },
];

/// A subject as measured.
#[derive(Serialize)]
pub struct Measured {
    title: &'static str,
    axes: [&'static str; 2],
    default: &'static str,
    command: &'static str,
    note: &'static str,
    points: Vec<Point>,
    /// Whether a point of the default is on the front.
    default_on_front: bool,
    /// When, where and from what a bench measured it; none of what this run's cases measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    measured: Option<String>,
    /// The sources that the bench measured have changed.
    stale: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    picture: Option<String>,
}

/// A method with one setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    method: String,
    name: String,
    time: f64,
    error: f64,
    /// Nothing measured is both faster and more exact.
    front: bool,
    default: bool,
    /// For a reader.
    shown: [String; 2],
}

impl Measured {
    /// Pictures are for the page only.
    pub fn without_picture(mut self) -> Self {
        self.picture = None;
        self
    }

    /// The subject, the methods on its front, where the default is, and by what it was measured; for docs/validation.md.
    pub fn cells(&self) -> Option<[String; 4]> {
        let mut front: Vec<&str> =
            self.points.iter().filter(|p| p.front).map(|p| p.method.as_str()).collect();
        front.sort_unstable();
        front.dedup();
        let verdict = if self.default_on_front { "on the front" } else { "not on the front" };
        let stale = if self.stale { "stale; " } else { "" };
        let measured = self.measured.as_deref().unwrap_or("this run");
        let cells = [
            self.title.to_owned(),
            front.join(", "),
            format!("{stale}{}: {verdict}", self.default),
            measured.to_owned(),
        ];
        (!self.points.is_empty()).then_some(cells)
    }

    /// What was not measured, and by what it is.
    pub fn absent(&self) -> [&'static str; 2] {
        [self.title, self.command]
    }
}

/// Everything that was measured, and by what command the rest is; pictures go to `folder`.
pub fn measured(workspace: &Workspace, folder: &Path, outcomes: &[Outcome]) -> Result<Vec<Measured>> {
    SUBJECTS.iter().map(|subject| subject.measured(workspace, folder, outcomes)).collect()
}

impl Subject {
    fn measured(&self, workspace: &Workspace, folder: &Path, outcomes: &[Outcome]) -> Result<Measured> {
        let mut stamp: Option<Stamp> = None;
        let points = match self.source {
            Source::Bench { name, error, time } => {
                let bench = bench::read(workspace, name);
                stamp = bench.as_ref().map(|bench| bench.stamp.clone());
                pairs(bench.as_ref().map_or(&[], |bench| &bench.rows), error, time)
            }
            Source::Table { case, file, error, time, scale } => {
                let outcome = outcomes.iter().find(|outcome| outcome.case == case);
                let path = outcome.map(|outcome| outcome.output.join(file));
                let text = path.and_then(|path| fs::read_to_string(path).ok()).unwrap_or_default();
                of_table(&text, error, time, scale)
            }
            Source::Case { case, curves } => outcomes
                .iter()
                .find(|outcome| outcome.case == case)
                .map_or_else(Vec::new, |outcome| of_curves(outcome, curves)),
        };
        let mut points: Vec<Point> = points
            .into_iter()
            .filter(|(_, time, error)| time.is_finite() && error.is_finite() && *time > 0.0)
            .map(|(name, time, error)| {
                let method = name.split(self.split).next().unwrap_or(&name).to_owned();
                let default = method == self.default;
                let shown = [time, error].map(|number| format!("{number:.2e}"));
                Point { method, name, time, error, front: false, default, shown }
            })
            .collect();
        front(&mut points);
        let picture = if points.is_empty() { None } else { Some(self.draw(&points, folder)?) };
        let default_on_front = points.iter().any(|point| point.front && point.default);
        Ok(Measured {
            title: self.title,
            axes: self.axes,
            default: self.default,
            command: self.command,
            note: self.note,
            points,
            default_on_front,
            stale: stamp.as_ref().is_some_and(|stamp| !stamp.fresh(workspace.root())),
            measured: stamp.as_ref().map(Stamp::to_string),
            picture,
        })
    }

    fn draw(&self, points: &[Point], folder: &Path) -> Result<String> {
        // an error of 0 has no place on a logarithmic axis
        let y = |point: &Point| point.error.max(1e-17);
        let mut plot =
            LinePlot::new(self.title).axes(self.axes[0], self.axes[1]).log_x().log_y().size(900.0, 520.0);
        let mut methods: BTreeMap<&str, Vec<&Point>> = BTreeMap::new();
        for point in points {
            methods.entry(&point.method).or_default().push(point);
        }
        for (method, mut points) in methods {
            points.sort_by(|a, b| a.time.total_cmp(&b.time));
            let xs: Vec<f64> = points.iter().map(|point| point.time).collect();
            let ys: Vec<f64> = points.iter().map(|point| y(point)).collect();
            let name = if method == self.default { format!("{method} (default)") } else { method.to_owned() };
            plot = plot.series(Series::markers(&name, &xs, &ys));
        }
        let mut on: Vec<&Point> = points.iter().filter(|point| point.front).collect();
        on.sort_by(|a, b| a.time.total_cmp(&b.time));
        let xs: Vec<f64> = on.iter().map(|point| point.time).collect();
        let ys: Vec<f64> = on.iter().map(|point| y(point)).collect();
        plot = plot.series(Series::reference("Pareto front", &xs, &ys));
        let stem = self.title.to_lowercase().replace(|c: char| !c.is_ascii_alphanumeric(), "-");
        let path = folder.join(format!("{stem}.svg"));
        plot.write(&path).into_diagnostic()?;
        Ok(pictures::embed(&path).unwrap_or_default())
    }
}

/// Marks what nothing measured beats in both.
fn front(points: &mut [Point]) {
    let all: Vec<(f64, f64)> = points.iter().map(|point| (point.time, point.error)).collect();
    for point in points {
        let beaten = |&(time, error): &(f64, f64)| {
            time <= point.time && error <= point.error && (time < point.time || error < point.error)
        };
        point.front = !all.iter().any(beaten);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let point = |time, error| Point {
            method: String::new(),
            name: String::new(),
            time,
            error,
            front: false,
            default: false,
            shown: [String::new(), String::new()],
        };
        let mut points =
            [point(1.0, 1.0), point(2.0, 0.5), point(3.0, 0.6), point(2.0, 0.7), point(0.5, 2.0)];
        front(&mut points);
        assert_eq!(points.map(|point| point.front), [true, true, false, false, true]);
    }
}
