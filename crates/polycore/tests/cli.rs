//! The contract of the `polycore` command line: what it prints, writes and returns.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use polycore::report::Report;

const CASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../cases/ch1/rubber-fits/case.toml");

const SCENE: &str = r#"
version = 1
program = "polycore"
[fit]
laws = ["neo-hookean"]
[[fit.data]]
name = "bar"
file = "bar.csv"
[[expect]]
quantity = "bar.neo-hookean.shear_modulus"
reference = 0.5
tolerance = 1e-6
kind = "closed-form"
source = "the data were made with it"
"#;

/// Exact neo-Hookean stress for μ = 0.5 MPa: λ − λ⁻² halved.
const BAR: &str = "stretch,nominal_MPa\n1,0\n2,0.875\n4,1.96875\n";

fn polycore(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_polycore")).args(arguments).output().unwrap()
}

/// A folder with a scene and its table; the scene's path.
fn folder(scene: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bar.csv"), BAR).unwrap();
    let path = folder.path().join("case.toml");
    std::fs::write(&path, scene).unwrap();
    (folder, path)
}

fn run(scene: &Path, output: &Path) -> Output {
    polycore(&["run", scene.to_str().unwrap(), "--output", output.to_str().unwrap(), "--quick"])
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn the_case_of_chapter_1_passes() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let result = polycore(&["run", CASE, "--output", out]);
    assert_eq!(result.status.code(), Some(0), "{}{}", text(&result.stdout), text(&result.stderr));
    let report = Report::read(folder.path().join("report.json")).unwrap();
    assert!(report.passed());
    assert_eq!(report.expect.len(), 6);
    for file in [
        "fits.csv",
        "kawabata_states.csv",
        "treloar_uniaxial_chains.png",
        "kawabata_parity_phenomenological.png",
    ] {
        assert!(folder.path().join(file).exists(), "{file}");
    }
}

#[test]
fn exit_codes_0_and_1() {
    let (folder, scene) = folder(SCENE);
    let result = run(&scene, &folder.path().join("out"));
    assert_eq!(result.status.code(), Some(0), "{}", text(&result.stderr));
    let report = Report::read(folder.path().join("out/report.json")).unwrap();
    assert!((report.scalar("bar.neo-hookean.shear_modulus").unwrap() - 0.5).abs() < 1e-9);

    std::fs::write(&scene, SCENE.replace("reference = 0.5", "reference = 0.6")).unwrap();
    let result = run(&scene, &folder.path().join("out"));
    assert_eq!(result.status.code(), Some(1));
    assert!(text(&result.stdout).contains("FAIL  bar.neo-hookean.shear_modulus"), "{}", text(&result.stdout));
}

#[test]
fn bad_scenes_exit_with_2_and_write_nothing() {
    for (from, to, message) in [
        ("neo-hookean\"]", "neo-hooke\"]", "fit.laws[0]"),
        ("neo-hookean\"]", "neo-hookean\", \"neo-hookean\"]", "a second time"),
        ("laws = [\"neo-hookean\"]", "laws = []", "no law"),
        ("laws =", "law =", "did you mean `laws`?"),
        ("\"bar.csv\"", "\"foo.csv\"", "foo.csv"),
        ("name = \"bar\"", "name = \"../bar\"", "../bar"),
        ("neo-hookean\"]", "ogden-3\"]", "2 measured stresses"),
        ("bar.neo-hookean.shear_modulus", "bar.gent.rms", "does not compute"),
        ("version = 1", "version = 2", "version"),
        ("[[fit.data]]\nname = \"bar\"\nfile = \"bar.csv\"", "data = []", "no data"),
    ] {
        assert!(SCENE.contains(from), "{from}");
        let (folder, scene) = folder(&SCENE.replacen(from, to, 1));
        let out = folder.path().join("out");
        for result in [run(&scene, &out), polycore(&["check", scene.to_str().unwrap()])] {
            let error = text(&result.stderr);
            assert_eq!(result.status.code(), Some(2), "{from} → {to}: {error}");
            // miette may break lines
            let joined = error.replace(['\n', '│'], " ").split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(joined.contains(message), "{from} → {to}: {error}");
            assert!(!error.contains("panicked"));
        }
        assert!(!out.exists(), "{from} → {to}");
    }
    let (folder, scene) = folder(SCENE);
    std::fs::write(folder.path().join("file"), "").unwrap();
    assert_eq!(run(&scene, &folder.path().join("file")).status.code(), Some(2));
    assert_eq!(polycore(&["run"]).status.code(), Some(2));
    assert_eq!(polycore(&["run", "no/such/case.toml"]).status.code(), Some(2));
}

#[test]
fn check_says_what_run_would_do() {
    let result = polycore(&["check", CASE]);
    assert_eq!(result.status.code(), Some(0));
    let text = text(&result.stdout);
    assert!(text.contains("data treloar: 21 states, 20 measured stresses"), "{text}");
    assert!(text.contains("law eight-chain: chain_modulus, links"), "{text}");
    assert!(text.contains("18 fits, 6 expectations"), "{text}");
}

#[test]
fn exact_tables_read_back_as_data() {
    let arguments = ["exact", "neo-hookean", "0.5 MPa", "--from", "2", "--to", "4", "--points", "2"];
    let result = polycore(&arguments);
    assert_eq!(result.status.code(), Some(0), "{}", text(&result.stderr));
    let table = polycore::hyperelastic::data::Table::parse("exact", &text(&result.stdout)).unwrap();
    assert_eq!(table.measurements(), 2);
    assert!((table.states[0].nominal[0] - 0.875e6).abs() < 1e-6);
    for bad in [
        &["exact", "gent", "0.3 MPa", "5", "--to", "9"][..],
        &["exact", "gent", "0.3 m", "5"],
        &["exact", "gent", "0.3 MPa"],
        &["exact", "rubber", "1 MPa"],
        &["exact", "neo-hookean", "1 MPa", "--from", "-1"],
        &["exact", "neo-hookean", "1 MPa", "--points", "0"],
    ] {
        let result = polycore(bad);
        assert_eq!(result.status.code(), Some(2), "{bad:?} {}", text(&result.stdout));
        assert!(text(&result.stderr).contains("error"), "{bad:?}");
    }
}

#[test]
fn completions() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let result = polycore(&["completions", shell]);
        assert_eq!(result.status.code(), Some(0));
        assert!(text(&result.stdout).contains("polycore"));
    }
}
