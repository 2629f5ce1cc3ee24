//! scikit-fem as a separate program: brick.py in a virtual environment.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use miette::{IntoDiagnostic, Result, WrapErr, miette};
use serde::Deserialize;

use crate::workspace::Repository;

/// Environment variable with another virtual environment than target/venv-scikit-fem.
const VARIABLE: &str = "SCIKIT_FEM_VENV";

/// Installation of scikit-fem.
pub struct ScikitFem {
    python: PathBuf,
}

/// Numbers that brick.py prints; temperatures are in scikit-fem.csv.
#[derive(Deserialize)]
pub struct BrickFigures {
    /// Seconds for the constant matrices.
    pub set_up: f64,
    /// Seconds for all steps.
    #[serde(rename = "loop")]
    pub looped: f64,
    /// Peak memory of the process, bytes.
    pub memory: f64,
    /// Iterations of conjugate gradients in all steps.
    pub iterations: f64,
}

impl ScikitFem {
    /// Finds the installation; the inner error is the command that installs it.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub fn find(workspace: &Repository) -> Result<Result<Self, String>> {
        let folder = std::env::var_os(VARIABLE)
            .map_or_else(|| workspace.target().join("venv-scikit-fem"), PathBuf::from);
        let python = folder.join("bin/python");
        let imported = Command::new(&python)
            .args(["-c", "import skfem"])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        if imported.is_ok_and(|status| status.success()) {
            return Ok(Ok(Self { python: std::path::absolute(python).into_diagnostic()? }));
        }
        let folder = folder.display();
        Ok(Err(format!(
            "none in {folder} (python3 -m venv {folder} && {folder}/bin/pip install scikit-fem scipy; \
             {VARIABLE} names another virtual environment)"
        )))
    }

    /// Runs on one thread.
    ///
    /// # Errors
    /// If it fails.
    pub fn run(&self, folder: &Path, mesh: &Path, steps: u32) -> Result<BrickFigures> {
        std::fs::write(folder.join("brick.py"), include_str!("brick.py")).into_diagnostic()?;
        let mut command = Command::new(&self.python);
        command.arg("brick.py").arg(mesh).arg(steps.to_string()).arg("scikit-fem.csv").current_dir(folder);
        for variable in ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"] {
            command.env(variable, "1");
        }
        let output =
            command.stdin(Stdio::null()).output().into_diagnostic().wrap_err("cannot start python")?;
        if !output.status.success() {
            let errors = String::from_utf8_lossy(&output.stderr);
            return Err(miette!("scikit-fem: {}\n{errors}", output.status));
        }
        let figures = serde_json::from_slice(&output.stdout).into_diagnostic();
        figures.wrap_err("brick.py printed no figures")
    }
}
