//! Probes, formulas of boundaries and loads, grids, and field files of whole scenes.

use harness::case::{Case, Options, Run};
use harness::scene::Source;
use peri::program::run::{FinishedScene, Peri, run};
use peri::program::scene::Scene;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::process::Command;

fn solve(text: &str, output: &Path) -> FinishedScene {
    let source = Source::new("scene.toml", text);
    let scene = source.parse::<Scene>().unwrap_or_else(|error| panic!("{}", error.render()));
    let mut own = Run::new(const { &Peri::PROGRAM }, &source, Options::new(output));
    run(&source, &scene, &mut own).unwrap_or_else(|error| panic!("{error}"))
}

fn value(finished: &FinishedScene, name: &str) -> f64 {
    finished.report.scalar(name).unwrap_or_else(|| panic!("no {name} in\n{}", finished.report.table()))
}

const SHEET: &str = r#"version = 1
program = "peri"

[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "2 mm"
shapes = [{ add = "box", min = ["0 mm", "-20 mm"], max = ["80 mm", "20 mm"] }]

[material]
youngs_modulus = "1 MPa"
law = "linear"

[output]
pictures = false
fields = false
"#;

/// A body rotated by θ = 0.3 about the origin has a rotation of 0.3, no strains and no forces.
#[test]
fn a_rotation_is_seen_as_one() {
    let directory = tempfile::tempdir().unwrap();
    let turn = format!(
        "{SHEET}\n[[boundary]]\nname = \"all\"\nmin = [\"0 mm\", \"-20 mm\"]\nmax = [\"80 mm\", \"20 mm\"]
displacement_field = [\"(cos(0.3) - 1)*x - sin(0.3)*y\", \"sin(0.3)*x + (cos(0.3) - 1)*y\"]
[solver]\nmethod = \"verlet\"
[dynamics]\ndensity = \"1 g/cm^3\"\nend_time = \"1 ms\"\nrecords = 2
[[probe]]\nname = \"turn\"\ntrack = \"rotation\"\naxis = \"z\"
[[probe]]\nname = \"gauge\"\ntrack = \"strain\"\nfrom = [\"11 mm\", \"1 mm\"]\nto = [\"61 mm\", \"11 mm\"]
[[probe]]\nname = \"end\"\ntrack = \"displacement\"\naxis = \"y\"\nside = \"x+\"\nlayers = 1\n"
    );
    let finished = solve(&turn, directory.path());
    assert!((value(&finished, "turn") - 0.3).abs() < 1e-14);
    assert!(value(&finished, "gauge").abs() < 1e-14);
    // the mean over a column symmetric about y = 0
    assert!((value(&finished, "end") / (0.3_f64.sin() * 0.079) - 1.0).abs() < 1e-13);
    assert!(value(&finished, "reaction_x") < 1e-9);
    let table = std::fs::read_to_string(directory.path().join("history_dx-2mm_m-3.015.csv")).unwrap();
    assert!(table.lines().next().unwrap().contains("turn [rad],gauge,end [m]"), "{table}");
}

/// A homogeneous strain prescribed at the rim reaches the inside (Cauchy–Born), and marks measure it.
#[test]
fn a_strain_between_marks() {
    let directory = tempfile::tempdir().unwrap();
    let mut scene = SHEET.to_owned();
    for (name, min, max) in [
        ("left", ["0", "-20"], ["6", "20"]),
        ("right", ["74", "-20"], ["80", "20"]),
        ("below", ["0", "-20"], ["80", "-14"]),
        ("above", ["0", "14"], ["80", "20"]),
    ] {
        scene += &format!(
            "[[boundary]]\nname = \"{name}\"\nmin = [\"{} mm\", \"{} mm\"]\nmax = [\"{} mm\", \"{} mm\"]
displacement_field = [\"0.02*x\", \"-0.01*y\"]\n",
            min[0], min[1], max[0], max[1]
        );
    }
    scene += "[solver]\ntolerance = 1e-10\n[[probe]]\nname = \"along\"\ntrack = \"strain\"\nfrom = [\"31 \
        mm\", \"1 mm\"]\nto = [\"51 mm\", \"1 mm\"]
[[probe]]\nname = \"across\"\ntrack = \"strain\"\nfrom = [\"41 mm\", \"-5 mm\"]\nto = [\"41 mm\", \"5 \
mm\"]\n";
    let finished = solve(&scene, directory.path());
    assert!((value(&finished, "along") / 0.02 - 1.0).abs() < 1e-8);
    assert!((value(&finished, "across") / -0.01 - 1.0).abs() < 1e-8);
}

/// Prescribed components follow the factor and its rate: a completely prescribed sheet has the speed d·F′(t).
#[test]
fn loads_follow_a_factor() {
    let directory = tempfile::tempdir().unwrap();
    let scene = format!(
        "{SHEET}\n[[boundary]]\nname = \"all\"\nmin = [\"0 mm\", \"-20 mm\"]\nmax = [\"80 mm\", \"20 \
         mm\"]\ndisplacement = [\"2 mm\", \"0 mm\"]
[solver]\nmethod = \"verlet\"\n[dynamics]\ndensity = \"1 g/cm^3\"\nend_time = \"3 ms\"\nrecords = 3\nfactor \
= \"sin(pi*t/4e-3)\"
[[probe]]\nname = \"all\"\ntrack = \"displacement\"\naxis = \"x\"\n"
    );
    let finished = solve(&scene, directory.path());
    for (k, record) in finished.outcomes[0].history.iter().enumerate() {
        let phase = PI * (k as f64 + 1.0) / 4.0;
        assert!((record.seen[0] / (2e-3 * phase.sin()) - 1.0).abs() < 1e-12, "{record:?}");
        let speed = 2e-3 * PI / 4e-3 * phase.cos();
        let mass = 1000.0 * 80e-3 * 40e-3 * 1e-3;
        assert!((record.kinetic - 0.5 * mass * speed * speed).abs() < 1e-12, "{record:?}");
    }
    assert!((value(&finished, "all_peak") / 2e-3 - 1.0).abs() < 1e-12);
}

/// A grid of square cells has the reactions of the lattice of a box; one of other cells has equal volume.
#[test]
fn a_grid_is_a_box() {
    let directory = tempfile::tempdir().unwrap();
    let ends = "[[boundary]]\nside = \"x-\"\nlayers = 3\ndisplacement = [\"0 mm\", \"0 mm\"]
[[boundary]]\nside = \"x+\"\nlayers = 3\ndisplacement = [\"1 mm\", \"free\"]\n[solver]\ntolerance = 1e-8\n";
    let grid = |cells: &str| {
        let from = SHEET.find("spacing").unwrap();
        let to = SHEET.find("[material]").unwrap();
        format!(
            "{}horizon = \"6.03 mm\"\ngrid = {{ min = [\"0 mm\", \"-20 mm\"], max = [\"80 mm\", \"20 mm\"], \
             cells = {cells} }}\n{}{ends}",
            &SHEET[..from],
            &SHEET[to..]
        )
    };
    let force = |scene: &str| value(&solve(scene, directory.path()), "reaction_x");
    let expected = force(&format!("{SHEET}{ends}"));
    assert!((force(&grid("[40, 20]")) / expected - 1.0).abs() < 1e-6);
    assert!((force(&grid("[48, 20]")) / expected - 1.0).abs() < 0.1);
}

/// The probe of a crack through a sheet follows its tip to the far edge.
#[test]
fn a_tip_runs_through() {
    let directory = tempfile::tempdir().unwrap();
    let scene = torn("critical = { stretch = 1.1 }", 40);
    let finished = solve(&scene, directory.path());
    let rows: Vec<f64> = finished.outcomes[0].history.iter().map(|r| r.seen[0]).collect();
    let seen: Vec<f64> = rows.into_iter().filter(|x| x.is_finite()).collect();
    assert!(seen.len() > 1 && seen.windows(2).all(|pair| pair[1] >= pair[0]), "{seen:?}");
    assert!((value(&finished, "tip") - 39e-3).abs() < 2.1e-3, "{seen:?}");
    assert!(value(&finished, "tip_across") < 4e-3);
    let notes = finished.summary();
    assert!(!notes.contains("nothing broke") && !notes.contains("warning"), "{notes}");
}

/// Scenes that are probably not intended give warnings.
#[test]
fn what_is_most_likely_not_meant() {
    let directory = tempfile::tempdir().unwrap();
    let notes = |scene: &str| solve(scene, directory.path()).summary();
    let never = notes(&torn("critical = { stretch = 600 }", 40));
    assert!(never.contains("of 600.0000: nothing broke"), "{never}");
    let far = notes(&torn("critical = { stretch = 600 }", 1).replace("\"8 mm\"", "\"80 mm\""));
    assert!(far.contains("warning: a step moves a grip by 80.000 mm, 13 horizons"), "{far}");
    let neck = torn("critical = { stretch = 600 }", 1).replace(
        "]\ncracks",
        ", { add = \"box\", min = [\"40 mm\", \"0 mm\"], max = [\"60 mm\", \"2 mm\"] }]\ncracks",
    );
    let thin = notes(&neck);
    assert!(
        thin.contains("particles have no neighbour one spacing (2.000e-3 m) away along some axis"),
        "{thin}"
    );
    let here = torn("critical = { stretch = 600 }", 40);
    assert!(!never.contains("lie on body.cracks") && !never.contains("cuts out"), "{never}");
    // 20 of the rows at y = 1 mm; of 28 neighbours within 3.015 spacings 6 lie along the crack, fewer at its
    // ends
    let on = notes(
        &here
            .replace("-1 mm\", \"0 mm\"", "-1 mm\", \"1 mm\"")
            .replace("19.9 mm\", \"0 mm", "40.5 mm\", \"1 mm"),
    );
    assert!(on.contains("20 particles lie on body.cracks[0], the first at (1.000, 1.000) mm"), "{on}");
    assert!(on.contains("move it by half a spacing (1.000 mm)"), "{on}");
    let slot = |height: &str| {
        let (low, high) = (format!("\"-{height} mm\""), format!("\"{height} mm\""));
        let cut =
            format!("]\n# {{ cut = \"box\", min = [\"-1 mm\", {low}], max = [\"19.9 mm\", {high}] }}]\n#");
        let cut = cut.replacen("]\n# ", ", ", 1);
        here.replace("]\ncracks", &format!("{cut}cracks"))
    };
    // bonds end at a slot, unless they are asked for
    let bonded = |height: &str| notes(&slot(height).replace("shapes = [", "bond_gaps = true\nshapes = ["));
    // rows at ±3 mm are two horizons' worth apart: three spacings, 6 mm of 6.03 mm; at 2.9 mm the rows at ±1
    // mm go
    let narrow = bonded("2.9");
    assert!(
        narrow.contains(
            "body.shapes[1] cuts out 5.800 mm along y, less than the horizon of 6.030 mm: 10 bonds"
        ),
        "{narrow}"
    );
    assert!(!bonded("3.1").contains("cuts out") && !notes(&slot("2.9")).contains("warning"));
    let points: String =
        (0..200).map(|k| format!("{}e-3,{}e-3,4e-6\n", 2 * (k % 20), 2 * (k / 20))).collect();
    std::fs::write(directory.path().join("points.csv"), format!("x,y,volume\n{points}")).unwrap();
    let cloud = format!(
        "version = 1\nprogram = \"peri\"\n[body]\nspace = \"plane-stress\"\nthickness = \"1 mm\"\nhorizon = \
         \"6 mm\"\npoints = \"{}\"
[material]\nyoungs_modulus = \"1 MPa\"\nlaw = \"linear\"\n[[boundary]]\nside = \"x-\"\nlayers = \
1\ndisplacement = [\"0 mm\", \"0 mm\"]
[[boundary]]\nmin = [\"37 mm\", \"-1 mm\"]\nmax = [\"39 mm\", \"30 mm\"]\ndisplacement = [\"1 mm\", \"0 \
mm\"]\n",
        directory.path().join("points.csv").display()
    );
    let output = tempfile::tempdir().unwrap();
    let volumes = solve(&cloud, output.path()).summary();
    assert!(volumes.contains("do the volumes (in m³) include the thickness?"), "{volumes}");
}

/// A study prints its table and the resolution of its peaks.
#[test]
fn a_study_is_a_table() {
    let directory = tempfile::tempdir().unwrap();
    let study = torn("critical = { fracture_energy = \"1 N/mm\" }", 8)
        + "[[study]]\nspacing = [\"4 mm\", \"2 mm\"]\n";
    let finished = solve(&study, directory.path());
    let summary = finished.summary();
    for part in [
        "peak_load (N)",
        "first_break (m)",
        "m=3.015: the peak load changes by",
        "a load step changes it by up to",
    ] {
        assert!(summary.contains(part), "{part} is not in\n{summary}");
    }
    assert!(!summary.contains("reaction_y"), "{summary}");
    let table = std::fs::read_to_string(directory.path().join("study.csv")).unwrap();
    let heads: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    let column = heads.iter().position(|head| *head == "\"peak_load [N]\"").unwrap();
    let row = table.lines().nth(2).unwrap();
    assert!(row.starts_with("\"dx=2mm m=3.015\",0.002,3.015"), "{row}");
    let peak: f64 = row.split(',').nth(column).unwrap().parse().unwrap();
    assert_eq!(Some(peak), finished.outcomes[1].get("peak_load"));
}

/// Runs a sheet with a crack from its left side to the middle, pulled up by 8 mm.
fn torn(critical: &str, steps: usize) -> String {
    format!(
        r#"version = 1
program = "peri"

[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "2 mm"
shapes = [{{ add = "box", min = ["0 mm", "-20 mm"], max = ["40 mm", "20 mm"] }}]
cracks = [{{ from = ["-1 mm", "0 mm"], to = ["19.9 mm", "0 mm"] }}]

[material]
youngs_modulus = "1 MPa"
law = "linear"
{critical}

[[boundary]]
side = "y-"
displacement = ["0 mm", "0 mm"]

[[boundary]]
side = "y+"
displacement = ["0 mm", "8 mm"]

[solver]
steps = {steps}
stop_below = 0.02

[[probe]]
name = "tip"
track = "crack"
axis = "x"
across = "y"
min = ["20 mm", "-20 mm"]
max = ["40 mm", "20 mm"]
damage = [0.35, 1.0]

[output]
pictures = false
fields = false

"#
    )
}

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The examples of `fields.md` read the last step of a file with many. Needs a Python with h5py and VTK (`pip
/// install h5py vtk`) from `POLY_VTK_PYTHON`, else `python3`; reported as skipped without one.
#[test]
fn examples_of_the_guide_read_the_last_step() {
    let python = std::env::var("POLY_VTK_PYTHON").unwrap_or_else(|_| "python3".into());
    let has = |module: &str| {
        let import = Command::new(&python).args(["-c", &format!("import {module}")]).output();
        import.is_ok_and(|run| run.status.success())
    };
    let directory = tempfile::tempdir().unwrap();
    let output = directory.path().join("out/my-plate");
    std::fs::create_dir_all(&output).unwrap();
    let fields = "[stress]\nmeasures = [\"hardy\"]\n[output]\npictures = false\nevery = 1\n";
    let (head, tail) = SHEET.split_once("[output]").unwrap();
    assert!(tail.contains("fields = false"));
    let scene = format!(
        "{}{fields}[[boundary]]\nside = \"x-\"\ndisplacement = [\"0 mm\", \"0 mm\"]\n[[boundary]]\nside = \
         \"x+\"\ndisplacement = [\"6 mm\", \"0 mm\"]\n[solver]\nsteps = 3\n",
        head.replace("\"2 mm\"", "\"5 mm\"")
            .replace("\"0 mm\"", "\"-40 mm\"")
            .replace("\"80 mm\"", "\"40 mm\"")
    );
    let finished = solve(&scene, &output);
    let file = output.join("dx-5mm_m-3.015.vtkhdf");
    let series = harness::output::vtkhdf::read(&file).unwrap();
    let last = series.len() - 1;
    assert_eq!(series.len(), 3);
    let history = &finished.outcomes[0].history;
    for (step, record) in history.iter().enumerate() {
        assert_eq!(series.moment(step, "load"), Some(record.load));
        assert_eq!(series.moment(step, "displacement"), Some(record.displacement));
    }
    let stress = series.data(last, "cauchy_hardy").unwrap();
    let rest =
        |k: usize| series.points(last).unwrap()[k][0] - series.data(last, "displacement").unwrap()[3 * k];
    let points = series.points(last).unwrap();
    let highest = |near: bool| {
        (0..points.len())
            .filter(|&k| !near || (rest(k).abs() < 3e-3 && points[k][1] > 0.0))
            .map(|k| stress[9 * k])
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let page = std::fs::read_to_string(workspace().join("docs/guide/src/how-to/fields.md")).unwrap();
    let fences: Vec<&str> =
        page.split("```python\n").skip(1).filter_map(|rest| rest.split("\n```").next()).collect();
    for (module, fence, expected) in [("h5py", fences[0], highest(true)), ("vtk", fences[1], highest(false))]
    {
        assert!(fence.contains(&format!("import {module}")));
        if !has(module) {
            eprintln!(
                "skipped: {python} has no {module} (`pip install {module}`, or name a Python with it in \
                 POLY_VTK_PYTHON)"
            );
            continue;
        }
        let run = Command::new(&python).args(["-c", fence]).current_dir(directory.path()).output().unwrap();
        let (out, err) = (String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
        assert!(run.status.success(), "{module}: {out}{err}");
        let found: f64 = out.split_whitespace().rev().find_map(|word| word.parse().ok()).unwrap();
        assert!((found / expected - 1.0).abs() < 1e-12, "{module}: {out} is not {expected}");
        if module == "h5py" {
            assert!(out.contains("step 3.0"), "{out}");
        } else {
            assert!(out.starts_with(&points.len().to_string()), "{out}");
        }
    }
}
