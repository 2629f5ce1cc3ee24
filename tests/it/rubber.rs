//! Workflow from rubber tests to a simulated specimen: the block that `polycore` fits is a material of
//! `peri`.

use crate::program::{command, finish, peri, workspace};
use crate::results::{report, scalar};
use std::fs;

const SHEET: &str = r#"version = 1
program = "peri"

[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "1 mm"
shapes = [{ add = "box", min = ["0 mm", "0 mm"], max = ["24 mm", "12 mm"] }]

[[boundary]]
side = "x-"
layers = 6
displacement_field = ["2.06*x", "free"]

[[boundary]]
side = "x+"
layers = 6
displacement_field = ["2.06*x", "free"]

[solver]
steps = 4
tolerance = 1e-7

[output]
pictures = false
fields = false
section = [{ name = "middle", point = ["12 mm", "6 mm"], normal = [1, 0] }]

"#;

/// Treloar's bar at a stretch of 3.06 carries 0.866 MPa (1944); the law fitted to all of his tests gives
/// 0.904 MPa, and so do particles.
#[test]
fn a_fitted_law_is_a_material() {
    let folder = tempfile::tempdir().unwrap();
    let case = workspace().join("cases/external/treloar-fits/case.toml");
    let verb = format!("run {} --quick --output fits", case.display());
    let fit = finish(command("polycore", &verb, folder.path()).spawn().unwrap());
    assert_eq!(fit.code, Some(0), "{}", fit.stderr);
    let block = fit.stdout.split("for a scene of peri, from all:\n").nth(1).unwrap();
    let block: String =
        block.lines().take_while(|line| line.starts_with("  ")).map(|l| format!("{l}\n")).collect();
    fs::write(folder.path().join("sheet.toml"), format!("{SHEET}{block}")).unwrap();
    let run = peri("run sheet.toml --output out", folder.path());
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let nominal = scalar(&report(&folder.path().join("out")), "middle_force_x") / 12e-6 / 1e6;
    assert!((nominal / 0.901 - 1.0).abs() < 0.005, "{nominal} MPa");
    assert!((nominal - 0.866).abs() < 2.0 * 0.0597, "{nominal} MPa");
}
