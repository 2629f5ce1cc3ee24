//! Tables of measurements as others publish them, through the command line.

use std::path::Path;
use std::process::{Command, Output};

use harness::report::Report;

fn run(scene: &Path, output: &Path) -> Output {
    let [scene, output] = [scene, output].map(|path| path.to_str().unwrap());
    let arguments = ["run", scene, "--output", output, "--quick", "--verbose"];
    Command::new(env!("CARGO_BIN_EXE_polycore")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A material that the program has not seen is fitted from its file alone, in the form of the case's table.
#[test]
fn a_table_of_components_needs_no_hand_work() {
    let table = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../cases/measured/elastomers-multiaxial/rubber_multiaxial.csv"
    );
    let table = std::fs::read_to_string(table).unwrap();
    for (source, rms) in [("Meunier2008", 0.034), ("JonesTreloar1975", 0.056), ("Kawamura2001", 0.0096)] {
        let heading = table.lines().find(|line| line.starts_with("source,")).unwrap();
        let rows = table.lines().filter(|line| line.starts_with(source));
        let own = [heading].into_iter().chain(rows).collect::<Vec<_>>().join("\n");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("the \"new\" one.csv");
        std::fs::write(&path, own).unwrap();
        let result = run(&path, &folder.path().join("out"));
        assert_eq!(result.status.code(), Some(0), "{}{}", text(&result.stdout), text(&result.stderr));
        let report = Report::read(folder.path().join("out/report.json")).unwrap();
        let best = report.scalar("the--new--one.eight-chain-root-i2.rms").unwrap();
        assert!(best < rms, "{source}: {best}");
        assert!(!text(&result.stdout).contains("failed"), "{}", text(&result.stdout));
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("case.toml");
    let scene = "version = 1\nprogram = \"polycore\"\n[[fit.data]]\nname = \"new\"\nfile = \"new.csv\"\n";
    std::fs::write(&path, scene).unwrap();
    std::fs::write(folder.path().join("new.csv"), &table).unwrap();
    let result = run(&path, &folder.path().join("out"));
    assert_eq!(result.status.code(), Some(2));
    assert!(text(&result.stderr).contains("3 materials and none chosen"));
}
