//! External programs of tests: compilers, and CalculiX linked with a material.

use super::skipped;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Returns true if a program is installed; otherwise records that the test is skipped.
#[track_caller]
pub fn has_program(program: &str) -> bool {
    let found = Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success());
    if !found {
        skipped(program);
    }
    found
}

/// Returns the standard output of a command.
///
/// # Panics
/// If it cannot be started or fails.
#[track_caller]
pub fn run(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let [out, error] =
        [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text).into_owned());
    assert!(output.status.success(), "{command:?}\n{out}\n{error}");
    out
}

/// Builds `libPACKAGE.a` of a package of this workspace and returns its path.
///
/// # Panics
/// If it does not compile.
pub fn static_library(package: &str) -> PathBuf {
    let cargo = std::env::var_os("CARGO").unwrap_or("cargo".into());
    let mut build = Command::new(cargo);
    build.args(["build", "--release", "--quiet", "--message-format=json-render-diagnostics"]);
    // libraries of the whole workspace in one build: names without a hash, features of the tests
    build.args(["--workspace", "--lib"]);
    let text = run(build.current_dir(env!("CARGO_MANIFEST_DIR")));
    let messages = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let files = messages.flat_map(|message| message["filenames"].as_array().cloned().unwrap_or_default());
    let mut names = files.filter_map(|file| Some(PathBuf::from(file.as_str()?)));
    let library = format!("lib{package}.a");
    names.rfind(|file| file.ends_with(&library)).unwrap_or_else(|| panic!("no {library}"))
}

/// Returns the folder of a CalculiX 2.20 built from source, with its archive, from the environment variable
/// `CALCULIX_SOURCE`; without it, records that the test is skipped.
#[track_caller]
pub fn calculix() -> Option<PathBuf> {
    let folder = std::env::var_os("CALCULIX_SOURCE").map(PathBuf::from);
    let found = folder.filter(|folder| folder.join("ccx_2.20.a").is_file());
    if found.is_none() {
        skipped("CalculiX built from source (CALCULIX_SOURCE names the folder of ccx_2.20.a)");
        return None;
    }
    if has_program("gfortran") { found } else { None }
}

/// Links CalculiX with a material, which stands before the archive: its empty routines stay unless `symbols`
/// are asked for.
///
/// # Panics
/// If it cannot be linked.
pub fn link_calculix(source: &Path, materials: &[&Path], symbols: &[&str], program: &Path) {
    let mut link = Command::new("gfortran");
    link.args(["-O2", "-fopenmp", "-o"]).arg(program).arg(source.join("ccx_2.20.o"));
    link.args(symbols.iter().map(|symbol| format!("-Wl,{symbol}"))).args(materials);
    // modules of Fortran
    link.arg("-J").arg(program.parent().unwrap_or(Path::new(".")));
    link.arg(source.join("ccx_2.20.a"));
    run(link.args(["-lspooles", "-lpthread", "-larpack", "-llapack", "-lblas", "-lm", "-ldl"]));
}

/// Runs an input file in CalculiX in a folder; returns its `.dat`.
///
/// # Panics
/// If it fails.
pub fn run_calculix(program: &Path, folder: &Path, deck: &str) -> (String, String) {
    std::fs::write(folder.join("deck.inp"), deck).expect("a folder to write to");
    let told = run(Command::new(program).arg("deck").current_dir(folder));
    (told, std::fs::read_to_string(folder.join("deck.dat")).unwrap_or_default())
}
