//! Example programs of the libraries: each runs to its end.

use crate::program::{command, finish, workspace};
use std::fs;

#[test]
fn every_example_runs() {
    let folder = tempfile::tempdir().unwrap();
    let mut names = Vec::new();
    for package in ["crystfem", "mdsurrogate", "peri", "polycore"] {
        let examples = workspace().join("crates").join(package).join("examples");
        let Ok(entries) = fs::read_dir(examples) else { continue };
        let stem = |entry: fs::DirEntry| Some(entry.path().file_stem()?.to_str()?.to_owned());
        names.extend(entries.filter_map(|entry| stem(entry.unwrap())));
    }
    for name in &names {
        let ended = finish(command(name, "", folder.path()).spawn().unwrap()).with_code(0);
        assert!(!ended.stdout.is_empty(), "{name} prints what it found");
    }
    assert!(names.len() >= 10, "{names:?}");
}
