//! `polycore deck`: cards of a run return as the blocks of its `materials.toml`.

use std::process::{Command, Output};

const SCENE: &str = "version = 1\nprogram = \"polycore\"\n[fit]\nlaws = [\"neo-hookean\"]\n\
                     [[fit.data]]\nname = \"bar\"\nfile = \"bar.csv\"\n";

/// Exact neo-Hookean stress for μ = 0.5 MPa: λ − λ⁻² halved.
const BAR: &str = "stretch,nominal_MPa\n1,0\n2,0.875\n4,1.96875\n";

fn polycore(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_polycore")).args(arguments).output().unwrap()
}

/// Reads the number of a line `key = "NUMBER UNIT"`.
fn value(text: &str, key: &str) -> f64 {
    let line = text.lines().find(|line| line.starts_with(key)).unwrap_or_else(|| panic!("{key}: {text}"));
    line.split('"').nth(1).unwrap().split(' ').next().unwrap().parse().unwrap()
}

/// Cards have seven digits.
#[test]
fn cards_return_as_blocks() {
    let folder = tempfile::tempdir().unwrap();
    let [scene, output, cards] = ["case.toml", "out", "out/materials_mm.inp"]
        .map(|name| folder.path().join(name).display().to_string());
    std::fs::write(&scene, SCENE).unwrap();
    std::fs::write(folder.path().join("bar.csv"), BAR).unwrap();
    assert!(polycore(&["run", &scene, "--output", &output]).status.success());
    let result = polycore(&["deck", &cards]);
    let shown = String::from_utf8_lossy(&result.stdout);
    assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    let blocks = std::fs::read_to_string(folder.path().join("out/materials.toml")).unwrap();
    for key in ["shear_modulus", "bulk_modulus"] {
        let (found, expected) = (value(&shown, key), value(&blocks, key));
        assert!((found / expected - 1.0).abs() < 2e-6, "{key}: {found} {expected}");
    }
}

#[test]
fn files_without_a_law_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("case.toml").display().to_string();
    std::fs::write(&file, SCENE).unwrap();
    let result = polycore(&["deck", &file]);
    assert_eq!(result.status.code(), Some(2));
    let shown = String::from_utf8_lossy(&result.stderr);
    assert!(shown.contains("no `*HYPERELASTIC`"), "{shown}");
}
