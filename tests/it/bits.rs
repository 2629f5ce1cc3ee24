//! Results have the same bits on any number of threads.

use crate::program::peri;
use crate::results::{assert_same, report, scalar};
use crate::scenes;
use std::fs;
use std::path::Path;

/// Runs the scene in `here` on 1, 2 and 3 threads; everything but times must be equal, byte by byte.
fn on_any_number_of_threads(here: &Path) {
    for threads in 1..=3 {
        peri(&format!("run scene.toml --output out{threads} --threads {threads}"), here).with_code(0);
        let out = here.join(format!("out{threads}"));
        assert_eq!(report(&out)["provenance"]["host"]["threads"], threads);
        assert_same(&here.join("out1"), &out);
    }
}

#[test]
fn plate_on_a_lattice() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("scene.toml"), scenes::plate("\"20 mm\", \"10 mm\"", "1e-6")).unwrap();
    on_any_number_of_threads(here);
}

#[test]
fn cracked_bar_in_three_dimensions() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let scene = scenes::bar().to_owned() + "[output.solid]\nturntable = true\ncut = { normal = [0, 1, 0] }\n";
    fs::write(here.join("scene.toml"), scene).unwrap();
    on_any_number_of_threads(here);
    for picture in ["solid", "turntable"] {
        let path = here.join(format!("out1/{picture}_dx-10mm_m-3.015_surface-energy_volume-linear.png"));
        assert!(fs::read(path).unwrap().starts_with(b"\x89PNG"), "{picture}");
    }
    let work = &report(&here.join("out1"))["work"];
    assert_eq!((&work["particles"], &work["steps"]), (&320.into(), &3.into()));
}

/// Rough planes, friction and its slip over steps of both methods.
#[test]
fn steps_in_contact() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("scene.toml"), scenes::STEPS_IN_CONTACT).unwrap();
    on_any_number_of_threads(here);
}

/// Variants, several at once if there are several threads.
#[test]
fn variants() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let spacings = "[[study]]\nspacing = [\"20 mm\", \"10 mm\", \"8 mm\", \"16 mm\"]\n";
    fs::write(here.join("scene.toml"), format!("{}{spacings}", scenes::bar())).unwrap();
    on_any_number_of_threads(here);
}

/// A torn sheet, its bonds checked in equilibrium or in every iteration, with and without contact.
#[test]
fn fracture() {
    for solver in ["", "breaking = \"each-iteration\"\n[contact]", "method = \"lbfgs\""] {
        let directory = tempfile::tempdir().unwrap();
        let here = directory.path();
        fs::write(here.join("scene.toml"), scenes::fracture("4 mm", solver)).unwrap();
        on_any_number_of_threads(here);
        let report = report(&here.join("out1"));
        assert_eq!(scalar(&report, "fragments"), 2.0);
        let [peak, last] = ["peak_load", "last_load"].map(|name| scalar(&report, name));
        assert!(peak > 50.0 && last.abs() < 0.02 * peak, "{peak} N, {last} N");
        // the work of the loads is stored, released by breaking, or damped
        let [work, stored, released, damped] =
            ["work_of_loads", "stored_energy", "released_energy", "damped_energy"]
                .map(|name| scalar(&report, name));
        assert!((work - stored - released - damped).abs() < 1e-12 * work);
        assert!(
            released > 0.0 && damped > 0.0 && stored < 1e-3 * work,
            "{stored} {released} {damped} of {work} J"
        );
    }
}

/// A sheet that cracks in explicit dynamics, in both precisions: equal up to single precision.
#[test]
fn explicit_dynamics() {
    let [double, mixed] = ["double", "mixed"].map(|precision| {
        let directory = tempfile::tempdir().unwrap();
        let here = directory.path();
        fs::write(here.join("scene.toml"), scenes::cracking("2 mm", precision)).unwrap();
        on_any_number_of_threads(here);
        report(&here.join("out1"))
    });
    let of = |name: &str| [&double, &mixed].map(|report| scalar(report, name));
    let broken = of("broken_bonds");
    assert!(broken[0] > 100.0 && broken[1] == broken[0], "{broken:?}");
    let [peak, in_mixed] = of("peak_load");
    assert!((in_mixed / peak - 1.0).abs() < 1e-5, "{peak} N, {in_mixed} N");
    let error = scalar(&mixed, "mixed_error");
    assert!(error > 0.0 && error < 1e-4, "{error}");
    assert!(double["quantities"].get("mixed_error").is_none());
}

#[test]
fn strip_of_scattered_points() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("scene.toml"), scenes::strip()).unwrap();
    fs::write(here.join("points.csv"), scenes::points()).unwrap();
    on_any_number_of_threads(here);
}

/// Results do not depend on an earlier run or other results in the same directory.
#[test]
fn a_second_run_into_the_same_directory() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let scene = scenes::plate("\"50 mm\"", "1e-4");
    fs::write(here.join("scene.toml"), &scene).unwrap();
    peri("run scene.toml --output first", here).with_code(0);
    fs::create_dir(here.join("second")).unwrap();
    for rubbish in ["report.json", "checkpoint.bin", ".left.part"] {
        fs::write(here.join("second").join(rubbish), "rubbish").unwrap();
    }
    for _ in 0..2 {
        peri("run scene.toml --output second", here).with_code(0);
        assert_same(&here.join("first"), &here.join("second"));
    }
}
