//! Our VTKHDF files as VTK itself reads them. Needs a Python with VTK (`pip install vtk`), named by
//! `POLY_VTK_PYTHON` or found as `python3`; says so and passes where there is none.

use std::path::Path;
use std::process::Command;

use harness::output::vtkhdf::{ParticleSeries, read};
use serde_json::{Value, json};

const STEPS: usize = 3;
const POINTS: usize = 66_001; // more than a compressed chunk

fn expected(step: usize) -> Value {
    let wave = |index: usize, k: f64| (k * index as f64 + step as f64).sin();
    let points: Vec<[f64; 3]> =
        (0..POINTS).map(|i| [i as f64 * 1e-3 + wave(i, 0.1), wave(i, 0.2), 0.0]).collect();
    let displacement: Vec<[f64; 3]> = (0..POINTS).map(|i| [wave(i, 0.1), wave(i, 0.2), -0.0]).collect();
    let stress: Vec<[f64; 6]> =
        (0..POINTS).map(|i| std::array::from_fn(|c| 1e6 * wave(i, c as f64))).collect();
    let damage: Vec<[f64; 1]> = (0..POINTS).map(|i| [wave(i, 0.3).abs()]).collect();
    let arrays = json!({ "displacement": displacement, "stress": stress, "damage": damage });
    json!({ "points": points, "arrays": arrays })
}

fn floats(values: &Value) -> Vec<f64> {
    values
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|row| row.as_array().unwrap())
        .map(|x| x.as_f64().unwrap())
        .collect()
}

fn write(path: &Path) -> Value {
    let mut series = ParticleSeries::create(path).unwrap();
    let mut times = Vec::new();
    let mut steps = Vec::new();
    for step in 0..STEPS {
        let wanted = expected(step);
        let points: Vec<[f64; 3]> = floats(&wanted["points"]).chunks(3).map(|p| [p[0], p[1], p[2]]).collect();
        let [u, s, d] = ["displacement", "stress", "damage"].map(|name| floats(&wanted["arrays"][name]));
        times.push(0.1 * step as f64);
        series
            .step(times[step], &points, &[("displacement", 3, &u), ("stress", 6, &s), ("damage", 1, &d)])
            .unwrap();
        steps.push(wanted);
    }
    series.finish().unwrap();
    json!({ "times": times, "steps": steps })
}

#[test]
fn vtk_reads_every_step() {
    let python = std::env::var("POLY_VTK_PYTHON").unwrap_or_else(|_| "python3".into());
    let has_vtk =
        Command::new(&python).args(["-c", "import vtk"]).output().is_ok_and(|run| run.status.success());
    if !has_vtk {
        evidence::skipped("VTK (`pip install vtk`, or name a Python with it in POLY_VTK_PYTHON)");
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("particles.vtkhdf");
    let expectation = directory.path().join("expected.json");
    std::fs::write(&expectation, write(&path).to_string()).unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/vtk/check_particles.py");
    let run = Command::new(&python).arg(script).args([&path, &expectation]).output().unwrap();
    let (out, err) = (String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
    assert!(run.status.success() && !err.contains("ERR|"), "{out}{err}");
    eprint!("{out}");
}

#[test]
fn our_reader_agrees_without_vtk() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("particles.vtkhdf");
    let written = write(&path);
    let series = read(&path).unwrap();
    assert_eq!(json!(series.times()), written["times"]);
    for step in (0..STEPS).rev() {
        let wanted = &written["steps"][step];
        assert_eq!(series.points(step).unwrap().as_flattened(), floats(&wanted["points"]));
        for (name, _) in series.arrays() {
            assert_eq!(series.data(step, name).unwrap(), floats(&wanted["arrays"][name]));
        }
    }
}
