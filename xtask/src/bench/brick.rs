//! The brick of `crates/crystfem/benches/brick.rs`, compared on the same mesh with CalculiX and scikit-fem.

use std::path::{Path, PathBuf};

use harness::output::csv;
use harness::output::picture::{LinePlot, Series};
use miette::{IntoDiagnostic, Result, WrapErr, miette};

use super::calculix::{self, Calculix};
use super::scikit_fem::ScikitFem;
use super::{Row, external};
use crate::table::TextTable;
use crate::workspace::Repository;

/// Number of steps of a run.
pub const STEPS: u32 = 20;
/// Elements along an edge of the largest brick that other programs solve, and of the largest that takes them
/// seconds.
const LARGEST: usize = 45;
const SHORT: usize = 26;
/// Number of rounds, whose medians count; more for short runs.
const ROUNDS: usize = 3;
const SHORT_ROUNDS: usize = 5;
/// Displacement of inner nodes of the distorted brick, over its edge.
const DISTORTION: &str = "0.1";

/// scikit-fem's mean temperature at 20 000 nodes after 20 steps, K (formulation.md; printed to 8 digits after
/// the point).
const MEAN: (usize, f64) = (26, 476.763_119_07);
const SAME_MEAN: f64 = 1e-7;
/// Tolerance of nodal temperatures, K: the error of Newton's iterations, and half of the last digit that
/// CalculiX prints.
const SAME_SCIKIT_FEM: f64 = 1e-5;
const SAME_CALCULIX: f64 = 1e-4;

/// Result of the brick bench.
pub struct Brick {
    pub rows: Vec<Row>,
    pub text: String,
    /// True if all temperatures agree.
    pub passed: bool,
}

/// Run of one program on one brick.
struct BrickRun {
    program: &'static str,
    edge: usize,
    /// Seconds per step, and before the first one.
    step: f64,
    set_up: Option<f64>,
    iterations: Option<f64>,
    memory: Option<f64>,
    /// Largest difference from our temperature at a node, K, and its limit.
    difference: Option<(f64, f64)>,
    mean: f64,
}

/// Runs all edges.
pub fn run(
    program: &Path,
    workspace: &Repository,
    folder: &Path,
    distorted: bool,
    edges: &[usize],
) -> Result<Brick> {
    let folder = folder.join(if distorted { "brick-distorted" } else { "brick" });
    std::fs::create_dir_all(&folder)
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot create {}", folder.display()))?;
    let mut runs =
        BrickBench { program: program.to_owned(), folder, distorted, lines: Vec::new(), rows: Vec::new() };
    let (calculix, scikit_fem) = (Calculix::find(), ScikitFem::find(workspace)?);
    let mut notes = String::new();
    for (name, found) in [("CalculiX", calculix.as_ref().err()), ("scikit-fem", scikit_fem.as_ref().err())] {
        if let Some(missing) = found {
            notes += &format!("skipped: {name}: {missing}\n");
            runs.push(&format!("{name} skipped"), 0, None, "");
        }
    }
    for &edge in edges {
        let beside = edge <= LARGEST;
        let rounds = if edge <= SHORT { SHORT_ROUNDS } else { ROUNDS };
        let lumped = (0..rounds).map(|_| Ok(vec![runs.ours(edge, true)?])).collect::<Result<_>>()?;
        runs.medians(lumped);
        let mut all: Vec<Vec<BrickRun>> = Vec::new();
        for _ in 0..rounds {
            let mut turn = vec![runs.ours(edge, false)?];
            if let (Ok(calculix), true) = (&calculix, beside) {
                turn.push(runs.calculix(calculix, edge)?);
            }
            if let (Ok(scikit_fem), true) = (&scikit_fem, beside) {
                turn.push(runs.scikit_fem(scikit_fem, edge)?);
            }
            all.push(turn);
        }
        runs.medians(all);
        if let (Ok(calculix), true) = (&calculix, edge <= SHORT) {
            runs.spooles(calculix, edge, rounds)?;
        }
        if !beside && (calculix.is_ok() || scikit_fem.is_ok()) {
            notes += &format!("skipped: {edge}³ elements with other programs: minutes (up to {LARGEST}³)\n");
        }
    }
    runs.draw(distorted)?;
    let table = runs.table();
    let passed = runs.passed(&mut notes);
    let text = format!(
        "Brick of 20 mm{}, film and radiation, {STEPS} steps of 0.5 s by backward Euler, one thread; \
         programs in turns, \
         medians of {ROUNDS}, up to {SHORT}³ elements of {SHORT_ROUNDS}\n{table}{notes}",
        if distorted { ", inner nodes moved by up to 2 mm: no two elements equal" } else { "" }
    );
    Ok(Brick { rows: runs.rows, text, passed })
}

struct BrickBench {
    program: PathBuf,
    folder: PathBuf,
    distorted: bool,
    lines: Vec<BrickRun>,
    rows: Vec<Row>,
}

impl BrickBench {
    /// Runs our program with lumped capacity, or with consistent capacity as the others have it.
    fn ours(&self, edge: usize, lumped: bool) -> Result<BrickRun> {
        let words = format!("brick --threads 1 --elements {edge} --steps {STEPS}");
        let mut arguments: Vec<String> = words.split(' ').map(str::to_owned).collect();
        if self.distorted {
            arguments.extend(["--distorted", DISTORTION].map(str::to_owned));
        }
        if lumped {
            arguments.push("--lumped".to_owned());
        } else {
            let path = |ending: &str| self.file(edge, ending).display().to_string();
            arguments.extend(["--mesh".to_owned(), path("inp"), "--temperatures".to_owned(), path("csv")]);
        }
        let rows = external(&self.program, &arguments)?;
        let of = |what: &str| rows.iter().find(|row| row.what == what).and_then(|row| row.value);
        let (Some(step), Some(mean)) = (of("step"), of("mean temperature")) else {
            return Err(miette!("the brick printed no time of a step"));
        };
        Ok(BrickRun {
            program: if lumped { "crystfem, lumped" } else { "crystfem" },
            edge,
            step,
            set_up: of("build"),
            iterations: of("CG iterations"),
            memory: of("memory"),
            difference: None,
            mean,
        })
    }

    fn calculix(&self, calculix: &Calculix, edge: usize) -> Result<BrickRun> {
        let mesh = self.read_mesh(edge)?;
        // two lengths of runs give the time per step, without reading the input
        let short = calculix.run(&self.folder, &mesh, 2, "ITERATIVE SCALING")?;
        let long = calculix.run(&self.folder, &mesh, STEPS, "ITERATIVE SCALING")?;
        let step = (long.seconds - short.seconds) / f64::from(STEPS - 2);
        let difference = (self.difference(edge, &long.temperatures)?, SAME_CALCULIX);
        Ok(BrickRun {
            program: "CalculiX, iterative scaling",
            edge,
            step,
            set_up: Some(short.seconds - 2.0 * step),
            iterations: None,
            memory: None,
            difference: Some(difference),
            mean: mean(&long.temperatures),
        })
    }

    /// Times the direct solver of CalculiX; three steps are enough.
    fn spooles(&mut self, calculix: &Calculix, edge: usize, rounds: usize) -> Result<()> {
        let mesh = self.read_mesh(edge)?;
        let turn = || -> Result<Vec<BrickRun>> {
            let [one, three] = [1, 3].map(|steps| calculix.run(&self.folder, &mesh, steps, "SPOOLES"));
            let (one, three) = (one?, three?);
            let step = 0.5 * (three.seconds - one.seconds);
            Ok(vec![BrickRun {
                program: "CalculiX, SPOOLES",
                edge,
                step,
                set_up: Some(one.seconds - step),
                iterations: None,
                memory: None,
                difference: None,
                mean: f64::NAN,
            }])
        };
        let turns = (0..rounds).map(|_| turn()).collect::<Result<_>>()?;
        self.medians(turns);
        Ok(())
    }

    fn scikit_fem(&self, scikit_fem: &ScikitFem, edge: usize) -> Result<BrickRun> {
        let run = scikit_fem.run(&self.folder, &self.file(edge, "inp"), STEPS)?;
        let temperatures = column(&self.folder.join("scikit-fem.csv"), "temperature")?;
        Ok(BrickRun {
            program: "scikit-fem, CG",
            edge,
            step: run.looped / f64::from(STEPS),
            set_up: Some(run.set_up),
            iterations: Some(run.iterations / f64::from(STEPS)),
            memory: Some(run.memory / nodes(edge) as f64),
            difference: Some((self.difference(edge, &temperatures)?, SAME_SCIKIT_FEM)),
            mean: mean(&temperatures),
        })
    }

    /// Adds the medians of the rounds to lines and rows.
    fn medians(&mut self, turns: Vec<Vec<BrickRun>>) {
        let mut turns = turns.into_iter();
        let Some(mut lines) = turns.next() else { return };
        let others: Vec<Vec<BrickRun>> = turns.collect();
        for (k, line) in lines.iter_mut().enumerate() {
            let all = |of: &dyn Fn(&BrickRun) -> f64| {
                let mut values = vec![of(line)];
                values.extend(others.iter().map(|turn| of(&turn[k])));
                values.sort_by(f64::total_cmp);
                values[values.len() / 2]
            };
            let step = all(&|line| line.step);
            let set_up = line.set_up.map(|_| all(&|line| line.set_up.unwrap_or(f64::NAN)));
            (line.step, line.set_up) = (step, set_up);
        }
        for line in lines {
            let (size, name) = (nodes(line.edge), line.program);
            self.push(&format!("{name}: step"), size, Some(line.step), "s/step");
            for (what, value, unit) in [
                ("set-up", line.set_up, "s"),
                ("CG iterations", line.iterations, "/step"),
                ("memory", line.memory, "bytes/dof"),
                ("largest difference at a node", line.difference.map(|(found, _)| found), "K"),
                ("mean temperature", Some(line.mean).filter(|mean| mean.is_finite()), "K"),
            ] {
                if value.is_some() {
                    self.push(&format!("{name}: {what}"), size, value, unit);
                }
            }
            self.lines.push(line);
        }
    }

    fn table(&self) -> String {
        let mut table = TextTable::new([
            "program",
            "nodes",
            "s/step",
            "over crystfem's",
            "set-up, s",
            "CG iterations/step",
            "bytes/dof",
            "max |ΔT|, K",
            "mean T, K",
        ]);
        let shown = |value: Option<f64>, digits: usize| {
            value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
        };
        for line in &self.lines {
            let ours = self.lines.iter().find(|other| other.edge == line.edge && other.program == "crystfem");
            table.push([
                line.program.to_owned(),
                nodes(line.edge).to_string(),
                format!("{:.4}", line.step),
                shown(ours.map(|ours| line.step / ours.step), 1),
                shown(line.set_up, 2),
                shown(line.iterations, 1),
                shown(line.memory, 0),
                line.difference.map_or_else(|| "-".to_owned(), |(found, _)| format!("{found:.1e}")),
                shown(Some(line.mean).filter(|mean| mean.is_finite()), 8),
            ]);
        }
        table.text()
    }

    /// Returns true if the temperatures agree; `notes` names those that do not.
    fn passed(&self, notes: &mut String) -> bool {
        let before = notes.len();
        // NaN is no agreement
        let apart = |difference: f64, allowed: f64| difference.is_nan() || difference.abs() > allowed;
        for line in &self.lines {
            let (program, nodes) = (line.program, nodes(line.edge));
            if let Some((found, allowed)) = line.difference.filter(|(found, allowed)| apart(*found, *allowed))
            {
                *notes += &format!(
                    "FAILED: {program}, {nodes} nodes: differs by {found:e} K (at most {allowed:e})\n"
                );
            }
            if line.program == "crystfem"
                && line.edge == MEAN.0
                && !self.distorted
                && apart(line.mean - MEAN.1, SAME_MEAN)
            {
                *notes += &format!("FAILED: {program}: mean of {} K, not {} K\n", line.mean, MEAN.1);
            }
        }
        notes.len() == before
    }

    fn draw(&self, distorted: bool) -> Result<()> {
        let (title, name) = match distorted {
            true => ("Distorted brick: time of a step", "crystfem-distorted.png"),
            false => ("Brick: time of a step", "crystfem-brick.png"),
        };
        let mut plot = LinePlot::new(title).axes("nodes", "s").log_x().log_y();
        let mut names: Vec<&str> = Vec::new();
        for line in &self.lines {
            if !names.contains(&line.program) {
                names.push(line.program);
            }
        }
        for program in names {
            let of = || self.lines.iter().filter(|line| line.program == program);
            let x: Vec<f64> = of().map(|line| nodes(line.edge) as f64).collect();
            let y: Vec<f64> = of().map(|line| line.step).collect();
            plot = plot.series(Series::marked_line(program, &x, &y));
        }
        plot.write(self.folder.with_file_name(name)).into_diagnostic()
    }

    fn file(&self, edge: usize, ending: &str) -> PathBuf {
        self.folder.join(format!("brick-{edge}.{ending}"))
    }

    fn read_mesh(&self, edge: usize) -> Result<calculix::CalculixMesh> {
        let path = self.file(edge, "inp");
        let text = std::fs::read_to_string(&path)
            .into_diagnostic()
            .wrap_err_with(|| format!("cannot read {}", path.display()))?;
        Ok(calculix::CalculixMesh::new(&format!("brick-{edge}.inp"), &text, nodes(edge)))
    }

    /// Largest difference from our temperature at a node, K.
    fn difference(&self, edge: usize, temperatures: &[f64]) -> Result<f64> {
        let ours = column(&self.file(edge, "csv"), "temperature")?;
        if ours.len() != temperatures.len() {
            return Err(miette!("{} temperatures, not {}", temperatures.len(), ours.len()));
        }
        let apart = |(a, b): (&f64, &f64)| (a - b).abs();
        // NaN counts as the largest
        Ok(ours.iter().zip(temperatures).map(apart).max_by(f64::total_cmp).unwrap_or(f64::NAN))
    }

    fn push(&mut self, what: &str, size: u64, value: Option<f64>, unit: &str) {
        self.rows.push(Row { what: what.to_owned(), size, threads: 1, value, unit: unit.to_owned() });
    }
}

fn nodes(edge: usize) -> u64 {
    (edge as u64 + 1).pow(3)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Reads a column of a CSV file.
fn column(path: &Path, name: &str) -> Result<Vec<f64>> {
    let columns = csv::read(path).into_diagnostic()?;
    let found = columns.into_iter().find(|(heading, _)| heading.split_whitespace().next() == Some(name));
    Ok(found.ok_or_else(|| miette!("{}: no {name}", path.display()))?.1)
}
