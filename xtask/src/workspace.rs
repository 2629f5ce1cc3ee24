//! Paths of the repository, and calls of cargo.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use miette::{IntoDiagnostic, Result, WrapErr, miette};

/// Workspace in which this xtask was built.
pub struct Repository {
    root: PathBuf,
    target: PathBuf,
}

impl Repository {
    /// Creates the paths, with build products where cargo puts them.
    pub fn new(root: PathBuf) -> Self {
        let root = root.canonicalize().unwrap_or(root);
        let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| "target".into(), PathBuf::from);
        let target = root.join(target);
        Self { root, target }
    }

    /// Folder of the workspace's Cargo.toml.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Folder of cargo's build products.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Creates a folder for results under target/, if needed.
    pub fn results(&self, name: &str) -> Result<PathBuf> {
        let folder = self.target.join(name);
        std::fs::create_dir_all(&folder)
            .into_diagnostic()
            .wrap_err_with(|| format!("cannot create {}", folder.display()))?;
        Ok(folder)
    }

    /// Path relative to the root if possible, for messages.
    pub fn short<'a>(&self, path: &'a Path) -> std::path::Display<'a> {
        path.strip_prefix(&self.root).unwrap_or(path).display()
    }

    /// Runs cargo with these variables; returns true if it succeeded.
    pub fn cargo(&self, arguments: &[&str], more: &[String], variables: &[(&str, &Path)]) -> Result<bool> {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| OsString::from("cargo"));
        let status = Command::new(cargo)
            .args(arguments)
            .args(more)
            .envs(variables.iter().copied())
            .current_dir(&self.root)
            .status()
            .into_diagnostic()
            .wrap_err("cannot start cargo")?;
        Ok(status.success())
    }

    /// Builds one of our programs; returns the path of its executable.
    pub fn build_program(&self, program: &str) -> Result<PathBuf> {
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if program.is_empty() || !program.chars().all(plain) || self.package(program).is_none() {
            let known = self.programs().join(", ");
            return Err(miette!("unknown program `{program}`; programs: {known}"));
        }
        // by its name, not by its package: features are those of the workspace, and tests share the build
        if !self.cargo(&["build", "--release", "--quiet", "--bin", program], &[], &[])? {
            return Err(miette!("`cargo build --release --bin {program}` failed"));
        }
        Ok(self.target.join("release").join(program).with_extension(std::env::consts::EXE_EXTENSION))
    }

    /// Builds the measurements of a crate, `benches/measure.rs`; returns the path of the executable.
    pub fn bench(&self, package: &str) -> Result<PathBuf> {
        let known: Vec<String> = self.programs().into_iter().filter(|name| self.measures(name)).collect();
        if !known.iter().any(|name| name == package) {
            return Err(miette!("unknown bench `{package}`; benches: {}", known.join(", ")));
        }
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| OsString::from("cargo"));
        let output = Command::new(cargo)
            .args(["build", "--release", "--quiet", "--message-format=json-render-diagnostics"])
            .args(["--package", package, "--bench", "measure"])
            .current_dir(&self.root)
            .stderr(Stdio::inherit())
            .output()
            .into_diagnostic()
            .wrap_err("cannot start cargo")?;
        let text = String::from_utf8_lossy(&output.stdout);
        let messages = text.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
        let executable =
            messages.filter_map(|message| Some(PathBuf::from(message["executable"].as_str()?))).next_back();
        executable
            .filter(|_| output.status.success())
            .ok_or_else(|| miette!("the bench of {package} was not built"))
    }

    fn measures(&self, name: &str) -> bool {
        self.root.join("crates").join(name).join("benches/measure.rs").is_file()
    }

    /// Finds the package of a program: its own name, or `NAME-cli` if that is the name of a library.
    pub fn package(&self, program: &str) -> Option<String> {
        let has_main = |name: &String| self.root.join("crates").join(name).join("src/main.rs").is_file();
        [program.to_owned(), format!("{program}-cli")].into_iter().find(has_main)
    }

    /// Lists the programs by name.
    pub fn programs(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.root.join("crates")).into_iter().flatten().flatten();
        let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
        let mut names: Vec<String> =
            names.filter(|name| !name.ends_with("-cli") && self.package(name).is_some()).collect();
        names.sort();
        names
    }
}
