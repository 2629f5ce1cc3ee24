//! Runs every command of the tutorials that begin with a reader's own file, in a copy of the folder that has
//! it.

use crate::documents::{commands_of, ours};
use crate::program::{command, finish, workspace};
use std::fs;
use std::path::Path;

/// Commands that are shown and not run: they install the programs or enter the folder.
const SETUP: [&str; 2] = ["cargo install --path", "cd docs/guide/src/tutorial/"];

/// Runs the commands of `NAME.md` in a copy of the folder `NAME`; afterwards these files exist.
#[track_caller]
fn follow(name: &str, results: &[&str]) {
    let source = workspace().join("docs/guide/src/tutorial");
    let page = source.join(name).with_extension("md");
    let text = fs::read_to_string(&page).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(source.join(name)).unwrap() {
        let file = entry.unwrap().path();
        fs::copy(&file, folder.path().join(file.file_name().unwrap())).unwrap();
        if file.extension().is_some_and(|extension| extension == "toml") {
            let path = file.strip_prefix(workspace()).unwrap().display().to_string().replace('\\', "/");
            let marker = format!("<!-- file: {path} -->");
            assert!(text.contains(&marker), "{}: the page does not show it", file.display());
        }
    }
    let mut run = 0;
    for shown in commands_of(&page) {
        let line = shown.words.join(" ");
        let Some((program, arguments)) = ours(&shown.words) else {
            assert!(SETUP.iter().any(|setup| line.starts_with(setup)), "{line}: neither run nor setup");
            continue;
        };
        let mut command = command(program, "", folder.path());
        let ended = finish(command.args(&arguments).spawn().unwrap());
        assert_eq!(ended.code, Some(0), "{line}\n{}\n{}", ended.stdout, ended.stderr);
        run += 1;
    }
    assert!(run >= 3, "{run} commands");
    for result in results {
        assert!(folder.path().join(result).is_file(), "no {result} in {:?}", list(folder.path()));
    }
}

fn list(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder.join("out")).into_iter().flatten().flatten();
    entries.map(|entry| entry.path().display().to_string()).collect()
}

#[test]
fn rubber_designer() {
    follow("rubber", &["out/fit/materials_mm.inp", "out/seal/history_dx-0.25mm_m-3.015.csv"]);
}

#[test]
fn rubber_that_relaxes() {
    follow("relaxation", &["out/fit/time_material.toml", "out/bushing/load_displacement.png"]);
}

#[test]
#[ignore = "takes 6 to 35 s; .ci/run runs it"]
fn fracture_researcher() {
    follow("fracture", &["out/calibrate-sweep/sweep.csv", "out/predict/load_displacement.png"]);
}

#[test]
#[ignore = "takes 6 to 35 s; .ci/run runs it"]
fn printing_engineer() {
    follow("printing", &["out/print/warped.png", "out/print-sweep/sweep.csv"]);
}

#[test]
fn molecular_dynamics_researcher() {
    follow("molecular-dynamics", &["out/law/energy.safetensors", "crystal.f90", "answers.csv"]);
}
