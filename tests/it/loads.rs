//! Loads and displacements of a report, compared with hand calculations; each of its values may have an
//! expectation.

use crate::program::peri;
use crate::results::{report, scalar};
use crate::scenes;
use harness::output::vtkhdf;
use harness::scene::Source;
use peri::program::observe::quantities_of;
use peri::program::scene::Scene;
use serde_json::Value;
use std::fs;

/// A strip of 60 × 20 × 2 mm, held or pulled at its ends by three layers of particles.
fn strip(left: &str, right: &str) -> String {
    format!(
        r#"version = 1
program = "peri"

[body]
space = "plane-stress"
thickness = "2 mm"
spacing = "1 mm"
shapes = [{{ add = "box", min = ["0 mm", "0 mm"], max = ["60 mm", "20 mm"] }}]

[material]
youngs_modulus = "2 MPa"
links = 720
dissociation = 1200

[[boundary]]
side = "x-"
{left}

[[boundary]]
side = "x+"
{right}

[solver]
tolerance = 1e-5
steps = 4
"#
    )
}

/// Runs a scene; returns its report, and the mean displacement along x of the three last layers at the right
/// and left.
fn pulled(left: &str, right: &str) -> (Value, [f64; 2]) {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("strip.toml"), strip(left, right)).unwrap();
    peri("run strip.toml --output out", directory.path()).with_code(0);
    let out = directory.path().join("out");
    let series = vtkhdf::read(out.join("dx-1mm_m-3.015.vtkhdf")).unwrap();
    let (points, moved) = (series.points(0).unwrap(), series.data(0, "displacement").unwrap());
    let mean = |inside: &dyn Fn(f64) -> bool| {
        let mut all =
            points.iter().zip(moved.chunks(3)).filter(|(x, u)| inside(x[0] - u[0])).map(|(_, u)| u[0]);
        let (sum, count) = all.by_ref().fold((0.0, 0.0), |(sum, count), u| (sum + u, count + 1.0));
        assert_eq!(count, 60.0);
        sum / count
    };
    (report(&out), [mean(&|x| x > 57e-3), mean(&|x| x < 3e-3)])
}

const HELD: &str = "displacement = [\"0 mm\", \"0 mm\"]";

/// 0.5 MPa on 20 × 2 mm is 20 N, whichever end is held, out of balance by at most the tolerance.
#[test]
fn a_held_end_carries_the_load() {
    let right = pulled(HELD, "traction = [\"0.5 MPa\", \"0 MPa\"]");
    let left = pulled("traction = [\"-0.5 MPa\", \"0 MPa\"]", HELD);
    for ((report, [at_right, at_left]), sign) in [(right, 1.0), (left, -1.0)] {
        for name in ["reaction_x", "applied_x", "peak_load"] {
            let load = scalar(&report, name);
            assert!((load - 20.0).abs() < 20.0 * 1e-3, "{name} {load}");
        }
        assert!(scalar(&report, "reaction_y").abs() < 0.02, "{report:#}");
        // the loaded end's mean, along the load
        let (moved, mean) =
            (scalar(&report, "displacement_at_peak"), sign * if sign > 0.0 { at_right } else { at_left });
        assert!((moved - mean).abs() < 1e-9 * mean && mean > 5e-3, "{moved} {mean}");
    }
}

/// Pulled at both ends: the displacement is their distance.
#[test]
fn two_loaded_ends_move_apart() {
    let (report, [right, left]) =
        pulled("traction = [\"-0.5 MPa\", \"0 MPa\"]", "traction = [\"0.5 MPa\", \"0 MPa\"]");
    let moved = scalar(&report, "displacement_at_peak");
    assert!((moved - (right - left)).abs() < 1e-9 * moved && moved > 5e-3, "{moved} {right} {left}");
    assert!((scalar(&report, "applied_x") - 20.0).abs() < 1e-9);
    assert!(report["values"]["reaction_x"].is_null());
}

/// Between two grips: the displacement is that of the grips, the load is the force on either.
#[test]
fn two_grips_share_the_reaction() {
    let (report, _) = pulled(HELD, "displacement = [\"12 mm\", \"0 mm\"]");
    let (load, reaction) = (scalar(&report, "peak_load"), scalar(&report, "reaction_x"));
    assert!((load - reaction).abs() < 1e-3 * load && load > 10.0, "{load} {reaction}");
    assert!((scalar(&report, "displacement_at_peak") - 12e-3).abs() < 1e-15);
    assert!(scalar(&report, "reaction_y").abs() < 1e-3 * load);
}

/// `check` must not refuse an expectation that a run can meet.
#[test]
fn every_value_may_be_expected() {
    let fracture = scenes::fracture("8 mm", "").replace("[output]", "[contact]\n\n[output]");
    let thrown = strip("velocity = [\"-1 m/s\", \"0 m/s\"]", "velocity = [\"1 m/s\", \"0 m/s\"]")
        .replace("tolerance = 1e-5\nsteps = 4", "method = \"verlet\"")
        + "\n[dynamics]\ndensity = \"1 g/cm^3\"\nend_time = \"1 ms\"\nrecords = 3\n";
    let forced = strip(HELD, "force = [\"1 N\", \"0 N\"]");
    let plates = scenes::plate("\"50 mm\", \"40 mm\"", "1e-3")
        + "\n[[study]]\nname = \"impossible\"\nspacing = [\"50 mm\"]\nexpect_error = \"not converged\"\n\
           solver = { tolerance = 1e-9, max_iterations = 2 }\n";
    for (scene, asked) in [
        (fracture, "load_at_first_break"),
        (thrown, "energy_error"),
        (forced, "applied_y"),
        (plates, "one-point_rmse_order[m=3.015]"),
    ] {
        let directory = tempfile::tempdir().unwrap();
        fs::write(directory.path().join("scene.toml"), &scene).unwrap();
        peri("run scene.toml --output out", directory.path()).with_code(0);
        let source = Source::new("scene.toml", scene.as_str());
        let names = quantities_of(&source, &source.parse::<Scene>().unwrap()).unwrap();
        let report = report(&directory.path().join("out"));
        let values = report["values"].as_object().unwrap();
        for (name, _) in values.iter().filter(|(_, value)| value["value"].is_number()) {
            assert!(names.contains(name), "{name} is not in {names:?}");
        }
        assert!(values.contains_key(asked), "{asked}: {:?}", values.keys());
    }
}

/// A notched strip under a growing force: the run ends with an error once it is torn, and keeps the last step
/// in equilibrium, in its own run and as a variant that expects the error; a study of one reports both.
#[test]
fn torn_by_a_force_a_run_keeps_its_last_equilibrium() {
    let scene = r#"version = 1
program = "peri"

[body]
space = "plane-stress"
thickness = "2 mm"
spacing = "1 mm"
shapes = [{ add = "box", min = ["-10 mm", "-20 mm"], max = ["10 mm", "20 mm"] }]
cracks = [{ from = ["-10 mm", "0 mm"], to = ["-4 mm", "0 mm"] }]

[material]
youngs_modulus = "2 MPa"
law = "linear"
critical = { stretch = 1.3 }

[[boundary]]
side = "y-"
displacement = ["0 mm", "0 mm"]

[[boundary]]
side = "y+"
force = ["0 N", "20 N"]

[solver]
steps = 20
stop_below = 0.05
"#;
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let expecting = "\n[[study]]\nname = \"torn\"\nspacing = [\"1 mm\"]\nexpect_error = \"no equilibrium\"\n";
    fs::write(here.join("one.toml"), scene).unwrap();
    fs::write(here.join("study.toml"), scene.to_owned() + expecting).unwrap();
    peri("run one.toml --output one", here).with_code(1).tells("no equilibrium after 7 steps");
    peri("run study.toml --output study", here).with_code(0);
    let (one, study) = (report(&here.join("one")), report(&here.join("study")));
    assert_eq!(one["passed"], false);
    assert_eq!(scalar(&study, "failed_as_expected"), 1.0);
    for report in [&one, &study] {
        let value = |quantity: &str| scalar(report, quantity);
        // 7 N is the last row: 8 N tears it
        assert!((value("peak_load") - 7.0).abs() < 1e-9 && value("last_load") == value("peak_load"));
        // of ends of steps, not of trials
        assert!(value("largest_stretch") < 1.3 && value("largest_stretch_met") > 1.3);
        assert!((value("load_at_first_break") - 6.0).abs() < 1e-9);
        assert!(value("largest_displacement") < 5e-3);
    }
    // the field is that of the last row
    let series = vtkhdf::read(here.join("one/dx-1mm_m-3.015.vtkhdf")).unwrap();
    let moved = series.data(0, "displacement").unwrap();
    let largest = moved.chunks(3).map(|u| u.iter().map(|x| x * x).sum::<f64>().sqrt()).fold(0.0, f64::max);
    assert!((largest / scalar(&one, "largest_displacement") - 1.0).abs() < 1e-6, "{largest}");
}
