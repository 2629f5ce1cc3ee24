//! Example programs of `polycore`, and those that read arguments: each runs to its end. Tests of the other
//! packages run theirs.

use crate::program::{EXAMPLES, command, finish, workspace};

#[test]
fn every_example_runs() {
    let files = std::fs::read_dir(workspace().join("crates/polycore/examples")).unwrap();
    for file in files.map(|entry| entry.unwrap().path()) {
        assert!(EXAMPLES.contains(&file.file_stem().unwrap().to_str().unwrap()), "{file:?}");
    }
    let folder = tempfile::tempdir().unwrap();
    for name in EXAMPLES {
        let ended = finish(command(name, "", folder.path()).spawn().unwrap()).with_code(0);
        assert!(!ended.stdout.is_empty(), "{name} prints what it found");
    }
}
