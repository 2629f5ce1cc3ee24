//! `mdsurrogate`: its own measurements, and an epoch of the thesis' network beside PyTorch in the same run.

use std::path::Path;
use std::process::{Command, Stdio};

use miette::Result;

use super::{Row, external};
use crate::workspace::Workspace;

const SCRIPT: &str = include_str!("torch_training.py");

/// Rows; what PyTorch cannot measure here is named in a row without a value.
pub fn run(workspace: &Workspace) -> Result<Vec<Row>> {
    let program = workspace.release("mdsurrogate")?;
    let mut rows = external(&program, &[])?;
    rows.extend(external(&program, &["--training".to_owned()])?);
    let python = std::env::var("TORCH_PYTHON").unwrap_or_else(|_| "python3".into());
    match torch(Path::new(&python)) {
        Some(measured) => rows.extend(measured),
        None => rows.push(Row {
            what: format!("PyTorch: skipped, `{python}` has none (TORCH_PYTHON names another)"),
            size: 0,
            threads: 1,
            value: None,
            unit: String::new(),
        }),
    }
    Ok(rows)
}

fn torch(python: &Path) -> Option<Vec<Row>> {
    let mut command = Command::new(python);
    command.args(["-c", SCRIPT, "58176", "4", "32", "256"]).stdin(Stdio::null()).stderr(Stdio::null());
    let output = command.output().ok().filter(|output| output.status.success())?;
    serde_json::from_slice(&output.stdout).ok()
}
