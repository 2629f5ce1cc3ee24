//! Point clouds, with the bodies built from them.

use super::{attack, below, fs};
use crate::scenes;
use harness::scene::Source;
use peri::program::scene::{Scene, body_of, check};

/// Every fortieth of the points of the strip, and a lattice of 12 × 4: scenes that are built quickly.
#[test]
fn clouds() {
    let folder = tempfile::tempdir().unwrap();
    let strip = scenes::points();
    let few: Vec<&str> = strip.lines().filter(|line| line.starts_with(['#', 'x'])).collect();
    let body: Vec<&str> = strip.lines().filter(|line| !line.starts_with(['#', 'x'])).collect();
    let near: Vec<&str> = (0..60).map(|k| body[k % 12 + 80 * (k / 12)]).collect();
    let lattice: Vec<String> = (0..48).map(|k| format!("{}e-3,{}e-3,1e-9", k % 12, k / 12)).collect();
    let lattice = lattice.iter().map(String::as_str).collect();
    let files = [("near", near), ("lattice", lattice)].map(|(name, rows)| {
        let path = folder.path().join(name);
        fs::write(&path, [few.clone(), rows].concat().join("\n")).unwrap();
        path
    });
    let files: Vec<_> = files.into_iter().chain(below("tests/bad/clouds", ".csv")).collect();
    let source = Source::new(folder.path().join("scene.toml"), scenes::strip());
    let scene = source.parse::<Scene>().unwrap();
    let variant = check(&source, &scene, false).unwrap().remove(0);
    let path = folder.path().join("points.csv");
    attack("cloud", &files, "points.csv", |bytes| {
        let _ = fs::remove_file(&path);
        fs::write(&path, bytes).unwrap();
        match body_of::<2>(&source, &scene, &variant) {
            Ok(_) => Ok(()),
            // these points are incompatible with that horizon: the message names both
            Err(error) if error.to_string().contains("body.horizon") => Ok(()),
            Err(error) => Err(error.render()),
        }
    });
}
