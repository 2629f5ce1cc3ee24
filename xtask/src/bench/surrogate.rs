//! `mdsurrogate`: its own measurements, and in the same session an epoch of the thesis' network in PyTorch,
//! and the predictions of a trained law in PyTorch and in onnxruntime.

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use miette::{IntoDiagnostic, Result, WrapErr, miette};
use polycore::file::atomic_write;

use super::{Row, external};
use crate::workspace::Repository;

const TRAINING: &str = include_str!("torch_training.py");
const ANSWERS: &str = include_str!("surrogate_peers.py");

/// Case whose ANN-4 is evaluated, as its quick tier trains it.
const CASE: &str = "cases/ch3/train-default/case.toml";

/// Number of strains.
const POINTS: usize = 512;

/// Returns the rows; a peer that cannot be measured here has a row without a value.
pub fn run(workspace: &Repository, folder: &Path) -> Result<Vec<Row>> {
    let program = workspace.build_program("mdsurrogate")?;
    let bench = workspace.bench("mdsurrogate")?;
    let mut rows = external(&bench, &[])?;
    rows.extend(external(&bench, &["--training".to_owned()])?);
    let folder = folder.join("mdsurrogate");
    let path = |name: &str| folder.join(name).display().to_string();
    let (law, strains, answers) = (path("ANN-4.safetensors"), path("strains.csv"), path("answers.csv"));
    let case = workspace.root().join(CASE).display().to_string();
    mdsurrogate(&program, &["run", &case, "--quick", "--output", &folder.display().to_string()])?;
    let table = points();
    atomic_write(&strains, |file| std::io::Write::write_all(file, table.as_bytes())).into_diagnostic()?;
    mdsurrogate(&program, &["predict", &law, &strains, "--tangent", "--output", &answers])?;
    mdsurrogate(&program, &["export", &law, &path("ann4"), "--form", "onnx"])?;
    for (name, variable, script, arguments) in [
        (
            "PyTorch, training",
            "TORCH_PYTHON",
            TRAINING,
            ["58176", "5", "16", "32", "64", "256", "1024"].map(str::to_owned).to_vec(),
        ),
        ("PyTorch, answers", "TORCH_PYTHON", ANSWERS, vec!["torch".to_owned(), law, answers.clone()]),
        ("onnxruntime", "ONNX_PYTHON", ANSWERS, vec!["onnx".to_owned(), path("ann4.onnx"), answers]),
    ] {
        let python = std::env::var(variable).unwrap_or_else(|_| "python3".into());
        match peer(Path::new(&python), script, &arguments) {
            Ok(measured) => rows.extend(measured),
            Err(reason) => rows.push(Row {
                what: format!("{name}: skipped, `{python}` ({variable} names another): {reason}"),
                size: 0,
                threads: 1,
                value: None,
                unit: String::new(),
            }),
        }
    }
    Ok(rows)
}

/// Strains like those of the training data, stretches of up to 0.9 to 1.3, with some shear beyond them.
fn points() -> String {
    let mut table = "C11,C22,C33,C12,C13,C23\n".to_owned();
    for k in 0..POINTS {
        let at = |a: usize| ((k * (2 * a + 3)) % 97) as f64 / 97.0;
        let normal = |a: usize| 0.9 + 0.4 * at(a);
        let shear = |a: usize| 0.02 * (at(a) - 0.5);
        let _ = writeln!(
            table,
            "{},{},{},{},{},{}",
            normal(0),
            normal(1),
            normal(2),
            shear(3),
            shear(4),
            shear(5)
        );
    }
    table
}

/// Runs the program; its output is shown only if it fails.
fn mdsurrogate(program: &Path, arguments: &[&str]) -> Result<()> {
    let output = Command::new(program)
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot start {}", program.display()))?;
    // 1: an expectation of the case was not met, which does not matter here
    match output.status.code() {
        Some(0 | 1) => Ok(()),
        _ => Err(miette!("mdsurrogate {}: {}", arguments.join(" "), String::from_utf8_lossy(&output.stderr))),
    }
}

fn peer(python: &Path, script: &str, arguments: &[String]) -> Result<Vec<Row>, String> {
    let mut command = Command::new(python);
    command.args(["-c", script]).args(arguments).stdin(Stdio::null());
    let output = command.output().map_err(|error| error.to_string())?;
    if !output.status.success() {
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        return Err(errors.lines().last().unwrap_or("no message").to_owned());
    }
    serde_json::from_slice(&output.stdout).map_err(|error| error.to_string())
}
