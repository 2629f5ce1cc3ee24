//! Compares the self-check state with LAMMPS.

use crate::Error;
use polycore::Error as Shared;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Largest difference of forces over their rms that rounding and the splines of the tables explain.
pub const BOUND: f64 = 1e-11;

/// Difference of the forces of LAMMPS and ours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Ranks.
    pub ranks: usize,
    /// Largest |F − F_ref|, over the rms of |F_ref|.
    pub largest: f64,
}

/// Runs LAMMPS on the self-check state of an exported folder, on one rank, and on two if there is an
/// `mpiexec`.
///
/// # Errors
/// A folder without an export, a `python` without LAMMPS, a run that fails.
pub fn compare(folder: &Path, python: &Path) -> Result<Vec<Comparison>, Error> {
    // the command runs in the folder, where a relative path would change its meaning
    let python = match python.components().count() {
        1 => find_program(python, std::env::var_os("VIRTUAL_ENV"), std::env::var_os("PATH")),
        _ => std::path::absolute(python).map_err(Shared::from_io("find", python))?,
    };
    let python = &*python;
    let table = folder.join("check.csv");
    let text = std::fs::read_to_string(&table).map_err(Shared::from_io("read", &table))?;
    let own = forces(&table, text.lines().skip(1), ',', 4)?;
    let mut found = vec![run_check(folder, python, None, &own)?];
    if let Some(mpiexec) = mpiexec(python) {
        found.push(run_check(folder, python, Some(&mpiexec), &own)?);
    }
    Ok(found)
}

/// Finds a program by name: in the active virtual environment, else the first on the path, so that MPI beside
/// it is found.
fn find_program(name: &Path, active: Option<OsString>, path: Option<OsString>) -> PathBuf {
    let own = active.into_iter().map(|folder| PathBuf::from(folder).join("bin"));
    let paths = path.iter().flat_map(std::env::split_paths);
    let found =
        own.chain(paths).map(|folder| folder.join(name)).find(|file| file.is_absolute() && file.is_file());
    found.unwrap_or_else(|| name.to_path_buf())
}

/// Runs the self-check, with `mpiexec` on two ranks, and compares the forces.
fn run_check(
    folder: &Path,
    python: &Path,
    mpiexec: Option<&Path>,
    own: &[[f64; 3]],
) -> Result<Comparison, Error> {
    let ranks = if mpiexec.is_some() { 2 } else { 1 };
    let name = format!("check.{ranks}.dump");
    let path = folder.join(&name);
    // a dump of an earlier run must not replace a missing one
    if path.exists() {
        std::fs::remove_file(&path).map_err(Shared::from_io("remove", &path))?;
    }
    let mut command = match mpiexec {
        Some(mpiexec) => {
            let mut command = Command::new(mpiexec);
            command.args(["-n", "2"]).arg(python);
            command
        }
        None => Command::new(python),
    };
    if let Some(libraries) = libraries(python) {
        command.env("LD_LIBRARY_PATH", libraries);
    }
    let run = command.args(["drive.py", "--check", &name]).current_dir(folder).output();
    let run = run.map_err(Shared::from_io("run", mpiexec.unwrap_or(python)))?;
    if !run.status.success() || !path.exists() {
        let message = String::from_utf8_lossy(&run.stderr);
        let last =
            message.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("no message").to_owned();
        let reason = format!("{} with {} rank(s): {last}", run.status, ranks);
        return Err(Shared::Data { what: "LAMMPS".into(), reason }.into());
    }
    let text = std::fs::read_to_string(&path).map_err(Shared::from_io("read", &path))?;
    let theirs = forces(&path, text.lines().skip(9), ' ', 5)?;
    if theirs.len() != own.len() {
        let reason = format!("{} particles, the self-check state has {}", theirs.len(), own.len());
        return Err(Shared::Format { path, format: "LAMMPS dump", reason }.into());
    }
    let square = |f: &[f64; 3]| f.iter().map(|f| f * f).sum::<f64>();
    let rms = (own.iter().map(square).sum::<f64>() / own.len() as f64).sqrt();
    let off = own.iter().zip(&theirs).map(|(a, b)| square(&[a[0] - b[0], a[1] - b[1], a[2] - b[2]]).sqrt());
    // NaN counts as the worst
    let largest = off.fold(0.0, |most: f64, off| if off.is_nan() || off > most { off } else { most }) / rms;
    Ok(Comparison { ranks, largest })
}

/// Parses three columns from `first` on; the first column counts from 1.
fn forces<'a>(
    path: &Path,
    lines: impl Iterator<Item = &'a str>,
    between: char,
    first: usize,
) -> Result<Vec<[f64; 3]>, Error> {
    let line = |(index, line): (usize, &str)| {
        let fields: Vec<f64> =
            line.trim().split(between).map(str::parse).collect::<Result<_, _>>().unwrap_or_default();
        match fields.get(first..first + 3) {
            Some(&[x, y, z]) if fields[0] == (index + 1) as f64 => Ok([x, y, z]),
            _ => Err(Shared::Format {
                path: path.to_path_buf(),
                format: "list of forces",
                reason: format!("row {} is `{line}`", index + 1),
            }
            .into()),
        }
    };
    let rows: Vec<[f64; 3]> = lines.enumerate().map(line).collect::<Result<_, Error>>()?;
    if rows.is_empty() {
        let (path, reason) = (path.to_path_buf(), "it has no rows".to_owned());
        return Err(Shared::Format { path, format: "list of forces", reason }.into());
    }
    Ok(rows)
}

/// Finds the `mpiexec` beside `python`, with which its LAMMPS was installed; for a bare name of `python` the
/// first on the path.
fn mpiexec(python: &Path) -> Option<PathBuf> {
    let beside = python.parent().map(|folder| folder.join("mpiexec"));
    if let Some(beside) = beside.filter(|path| path.is_file() && path.components().count() > 1) {
        return Some(beside);
    }
    let paths = std::env::var_os("PATH")?;
    std::env::split_paths(&paths).map(|folder| folder.join("mpiexec")).find(|path| path.is_file())
}

/// Returns the library path extended by that of `python`'s environment, where a wheel puts its MPI.
fn libraries(python: &Path) -> Option<OsString> {
    let own = python.parent()?.parent()?.join("lib");
    own.is_dir().then_some(())?;
    let given = std::env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
    std::env::join_paths(
        std::iter::once(own).chain(std::env::split_paths(&given).filter(|p| !p.as_os_str().is_empty())),
    )
    .ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An activated environment comes first; its libraries are beside its `bin`.
    #[test]
    fn python_of_an_environment() {
        let folder = tempfile::tempdir().unwrap();
        let make = |name: &str| {
            let bin = folder.path().join(name).join("bin");
            std::fs::create_dir_all(&bin).unwrap();
            std::fs::create_dir_all(folder.path().join(name).join("lib")).unwrap();
            std::fs::write(bin.join("python3"), "").unwrap();
            bin
        };
        let (active, system) = (make("active"), make("system"));
        let path = || Some(std::env::join_paths([&system, &active]).unwrap());
        let root = || active.parent().map(|root| root.as_os_str().to_owned());
        let found = |active, path| find_program(Path::new("python3"), active, path);
        assert_eq!(found(root(), path()), active.join("python3"));
        assert_eq!(found(None, path()), system.join("python3"));
        assert_eq!(found(Some("/nowhere".into()), None), Path::new("python3"));
        let libraries = libraries(&found(root(), path())).unwrap();
        let first = std::env::split_paths(&libraries).next();
        assert_eq!(first, Some(active.parent().unwrap().join("lib")));
    }
}
