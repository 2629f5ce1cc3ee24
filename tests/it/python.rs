//! The Python package: built with everything else, packed as a wheel, installed into its own environment, and
//! tested there by pytest.

use crate::program::{executable, workspace};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Instant;

/// Required packages, and optional ones that are used if available.
const NEEDED: [&str; 3] = ["maturin", "numpy", "pytest"];
const USED: [&str; 4] = ["matplotlib", "mypy", "pandas", "xarray"];

/// Builds `lib_polymech.so` with the whole workspace, whose features are those of the tests.
fn library() -> PathBuf {
    let cargo = std::env::var_os("CARGO").unwrap_or("cargo".into());
    let mut command = Command::new(cargo);
    command.args(["build", "--release", "--quiet", "--workspace", "--lib"]);
    command.arg("--message-format=json-render-diagnostics");
    let output = command.current_dir(workspace()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let messages = text.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let of_ours = messages.filter(|message| message["target"]["name"] == "_polymech");
    let files = of_ours.flat_map(|message| message["filenames"].as_array().cloned().unwrap_or_default());
    files.filter_map(|file| Some(PathBuf::from(file.as_str()?))).next().expect("a shared library")
}

fn python(interpreter: &Path, arguments: &[&str]) -> Option<Output> {
    Command::new(interpreter).args(arguments).current_dir(workspace()).output().ok()
}

fn passes(interpreter: &Path, arguments: &[&str]) -> bool {
    python(interpreter, arguments).is_some_and(|output| output.status.success())
}

/// Returns true if the modules can be imported.
fn can_import(interpreter: &Path, modules: &[&str]) -> bool {
    passes(interpreter, &["-c", &format!("import {}", modules.join(", "))])
}

/// Returns the interpreter of an environment with the requirements, or the missing ones.
fn environment() -> Result<PathBuf, &'static str> {
    let system = Path::new("python3");
    let recent = "import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 10))";
    if !passes(system, &["-c", recent]) {
        return Err("CPython 3.10 or newer with venv and pip");
    }
    let folder = executable("peri").with_file_name("python-tests");
    let place = folder.to_str().unwrap();
    let own = folder.join("bin/python");
    if !passes(&own, &["-c", recent]) && !passes(system, &["-m", "venv", "--clear", place]) {
        return Err("a virtual environment of CPython");
    }
    let install = |packages: &[&str]| {
        let pip =
            ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--retries=1", "--timeout=20"];
        can_import(&own, packages) || passes(&own, &[&pip[..], packages].concat())
    };
    if !install(&NEEDED) {
        return Err("maturin, numpy and pytest, from PyPI");
    }
    // pytest reports which of these are missing
    install(&USED);
    Ok(own)
}

#[cfg(target_os = "linux")]
#[test]
#[ignore = "builds the package in 20 to 140 s; .ci/run runs it"]
fn the_package_passes_its_tests() {
    let interpreter = match environment() {
        Ok(interpreter) => interpreter,
        Err(missing) => return evidence::skipped(missing),
    };
    let begun = Instant::now();
    let library = library();
    println!("built in {:.0} s", begun.elapsed().as_secs_f64());
    let folder = tempfile::tempdir().unwrap();
    let [library, out] = [&library, folder.path()].map(|path| path.to_str().unwrap());
    let packed = python(&interpreter, &["python/pack.py", library, out]).unwrap();
    assert!(packed.status.success(), "{}", String::from_utf8_lossy(&packed.stderr));
    let wheel = String::from_utf8(packed.stdout).unwrap();
    let pip =
        ["-m", "pip", "install", "--quiet", "--no-index", "--no-deps", "--force-reinstall", wheel.trim()];
    let installed = python(&interpreter, &pip).unwrap();
    assert!(installed.status.success(), "{}", String::from_utf8_lossy(&installed.stderr));
    let cache = format!("cache_dir={out}/cache");
    let arguments = ["-m", "pytest", "-q", "-rs", "-p", "no:randomly", "-o", &cache, "python/tests"];
    let tested = Command::new(&interpreter)
        .args(arguments)
        .env("POLYMECH_PROGRAMS", executable("peri").parent().unwrap())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .current_dir(workspace())
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&tested.stdout);
    println!("{text}\ntested in {:.0} s", begun.elapsed().as_secs_f64());
    assert!(tested.status.success(), "{text}{}", String::from_utf8_lossy(&tested.stderr));
    for line in text.lines().filter(|line| line.starts_with("SKIPPED")) {
        evidence::skipped(line);
    }
}
