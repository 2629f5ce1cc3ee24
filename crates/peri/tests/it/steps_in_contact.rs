//! Contact across the steps of a programme: surfaces keep their places, sticking friction its slip.

use crate::curves::solve;
use crate::turning_steps::interrupted;
use evidence::{at_most, near};
use peri::solver::StepRecord;

/// A block on a rough floor below a smooth press; planes follow curves over the time of all steps.
fn block(floor: &str, press: &str, steps: &str) -> String {
    format!(
        r#"version = 1
program = "peri"
[body]
space = "plane-strain"
thickness = "1 mm"
spacing = "1 mm"
shapes = [{{ add = "box", min = ["0 mm", "0 mm"], max = ["12 mm", "8 mm"] }}]
[material.solid]
law = "correspondence"
constitutive = {{ model = "neo-hookean", parameters = {{ shear_modulus = "1 MPa" }}, bulk_modulus = "2 MPa" }}
[contact]
stiffness = 0
[[contact.plane]]
name = "floor"
point = ["0 mm", "0 mm"]
normal = [0, 1]
stiffness = 5
friction = 0.3
{floor}
[[contact.plane]]
name = "press"
point = ["0 mm", "8 mm"]
normal = [0, -1]
stiffness = 5
{press}
[output]
pictures = false
fields = false
{steps}"#
    )
}

fn history(text: &str) -> Vec<StepRecord> {
    solve(text).outcomes[0].history.clone()
}

/// A press that closes and a floor that then slides forth and back under the block: in one step of the scene,
/// and in three that end while contacts stick and slide. Forces, energies and the work of friction, which
/// depend on the whole path, are the same.
#[test]
fn friction_goes_on_in_the_next_step() {
    let floor = "displacement = [\"1 mm\", \"0 mm\"]\ncurve = \"0.3 * (max(t - 1, 0) - 2 * max(t - 2, 0))\"";
    let press = "displacement = [\"0 mm\", \"-0.2 mm\"]\ncurve = \"min(t, 1)\"";
    let grip = |u: &str| format!("{{ side = \"x-\", layers = 3, displacement = [{u}, \"free\"] }}");
    let first = |time: &str| {
        let solver = "[solver]\ntolerance = 1e-8\n";
        format!("boundary = [{}]\ntime = {{ step = [{time}] }}\n{solver}", grip("\"0 mm\""))
    };
    let time = |duration: f64, increments: u32| {
        format!("{{ duration = \"{duration} s\", increments = {increments}, factor = 1 }}")
    };
    // keys of the scene stand before its tables
    let scene = |time: &str, steps: &str| {
        let text = block(floor, press, steps);
        let (head, rest) = text.split_once("[body]").unwrap();
        let own = first(time);
        let (keys, solver) = own.split_once("[solver]").unwrap();
        format!("{head}{keys}[body]{rest}\n[solver]{solver}")
    };
    let step = |u: &str, time: &str| {
        let solver = "solver = { tolerance = 1e-8 }";
        format!("[[step]]\nboundary = [{}]\ntime = {{ step = [{time}] }}\n{solver}\n", grip(u))
    };
    let one = history(&scene(&time(3.0, 24), ""));
    let later = step("\"hold\"", &time(0.625, 5)) + &step("\"0 mm\"", &time(1.25, 10));
    let several = history(&scene(&time(1.125, 9), &later));
    assert_eq!((one.len(), several.len()), (24, 24));
    let (end, last) = (one.last().unwrap(), several.last().unwrap());
    assert!(end.rubbed > 0.1 * end.work && end.resting[0].force[0] != 0.0, "{end:?}");
    for (a, b) in one.iter().zip(&several) {
        near("time_of_steps", a.time, b.time, 1e-12);
        for (d, scale) in [(0, end.resting[0].force[1]), (1, end.resting[0].force[1])] {
            let off = (a.resting[0].force[d] - b.resting[0].force[d]).abs() / scale.abs();
            at_most("friction_of_steps", off, 1e-5);
        }
    }
    near("friction_work_of_steps", last.rubbed / end.rubbed, 1.0, 1e-4);
    near("work_of_steps", last.work / end.work, 1.0, 1e-4);
    near("energy_of_steps", last.stored / end.stored, 1.0, 1e-5);
}

/// A floor hits a block that lies on it, and drags it along: in one step of dynamics, and in two, of which
/// the first ends while they touch. The block moves on with the same energy, and the ledger closes.
#[test]
fn impacts_go_on_in_the_next_step() {
    let floor = "displacement = [\"0.3 mm\", \"0.5 mm\"]\ncurve = \"1000 * t\"";
    let press = "displacement = [\"0 mm\", \"1 mm\"]\ncurve = \"1000 * t\"";
    let free = "boundary = [{ side = \"x+\", traction = [\"0 kPa\", \"0 kPa\"] }]";
    let dynamics = |end: &str| format!("{{ density = \"1000 kg/m^3\", end_time = \"{end} ms\" }}");
    let scene = |end: &str, steps: &str| {
        let text = block(floor, press, steps);
        let (head, rest) = text.split_once("[body]").unwrap();
        let solver = "solver = { method = \"verlet\" }";
        format!("{head}{free}\ndynamics = {}\n{solver}\n[body]{rest}", dynamics(end))
    };
    let one = history(&scene("1", ""));
    let later = format!("[[step]]\n{free}\ndynamics = {}\n", dynamics("0.8"));
    let two = history(&scene("0.2", &later));
    let (end, last) = (one.last().unwrap(), two.last().unwrap());
    let touches = |row: &&StepRecord| row.resting[0].force[1] > 0.0;
    assert!(touches(&&two[two.len() / 2 - 1]) && end.kinetic > 0.0, "{last:?}");
    assert!(end.rubbed > 0.0 && last.rubbed > 0.0);
    near("kinetic_energy_of_steps", last.kinetic / end.kinetic, 1.0, 5e-3);
    let open = |row: &StepRecord| (row.kinetic + row.stored + row.rubbed - row.work).abs() / end.work;
    at_most("ledger_of_an_impact", open(end), 5e-3);
    at_most("ledger_of_an_impact_in_steps", open(last), 5e-3);
}

/// A plane presses a block in equilibria and leaves it: what is left is nothing.
#[test]
fn a_press_that_leaves_leaves_nothing() {
    let press = "displacement = [\"0 mm\", \"-0.2 mm\"]\ncurve = \"min(t, 1) - max(t - 2, 0)\"";
    let time = "time = { step = [{ duration = \"1 s\", increments = 2, factor = 1 }] }";
    let grip = "boundary = [{ side = \"x-\", layers = 3, displacement = [\"0 mm\", \"free\"] }]";
    let solver = "solver = { tolerance = 1e-8 }";
    let later = format!("[[step]]\n{grip}\n{time}\n{solver}\n").repeat(2);
    let text = block("", press, &later).replace("friction = 0.3", "friction = 0");
    let (head, rest) = text.split_once("[body]").unwrap();
    let rows = history(&format!("{head}{grip}\n{time}\n{solver}\n[body]{rest}"));
    let force = |row: usize| rows[row].resting[1].force[1].abs();
    assert!(rows.len() == 6 && force(1) > 0.01, "{} rows, {} N", rows.len(), force(1));
    near("held_force", force(3) / force(1), 1.0, 1e-6);
    at_most("left_force", force(5) / force(1), 1e-6);
    at_most("left_energy", rows[5].stored / rows[1].stored, 1e-6);
}

/// A held block under a round indenter with a force of 2 N/mm; `time` are keys of the first step.
fn pressed(curve: &str, time: &str, steps: &str) -> String {
    format!(
        r#"version = 1
program = "peri"
boundary = [{{ name = "base", side = "y-", displacement = ["0 mm", "0 mm"] }}]
{time}
[body]
space = "plane-strain"
thickness = "1 mm"
spacing = "0.5 mm"
shapes = [{{ add = "box", min = ["0 mm", "0 mm"], max = ["16 mm", "8 mm"] }}]
[material.solid]
law = "correspondence"
constitutive = {{ model = "neo-hookean", parameters = {{ shear_modulus = "1 MPa" }}, bulk_modulus = "2 MPa" }}
[contact]
stiffness = 0
tied_grips = false
[[contact.indenter]]
point = ["8 mm", "12 mm"]
radius = "4 mm"
force = ["0 N", "-2 N"]
{curve}
[output]
pictures = false
fields = false
{steps}"#
    )
}

const BASE: &str = "{ name = \"base\", side = \"y-\", displacement = [\"0 mm\", \"0 mm\"] }";

/// An indenter keeps its force of 2 N while the next step loads the block from the side: contact and base
/// balance both forces, and the indenter, which moves along its force, sinks further. Work and stored energy
/// go on.
#[test]
fn a_force_stays_in_the_next_step() {
    let solver = "solver = { steps = 2, tolerance = 1e-8 }";
    let side = "{ name = \"side\", side = \"x+\", force = [\"1 N\", \"0 N\"] }";
    let later = format!("[[step]]\nboundary = [{BASE}, {side}]\n{solver}\n");
    let rows = history(&pressed("", solver, &later));
    assert_eq!(rows.len(), 4);
    for (row, [pull, push]) in rows.iter().zip([[0.0, 1.0], [0.0, 2.0], [0.5, 2.0], [1.0, 2.0]]) {
        // the balance of a force is found to 1e-13
        near("force_of_an_indenter", row.resting[0].force[1], -push, 1e-9);
        // sum of the residuals of all particles; the indenter cannot give way to the side
        near("base_beside_a_side_load", row.reactions[0][0] + row.resting[0].force[0], -pull, 1e-5);
        near("base_below_an_indenter", row.reactions[0][1], push, 1e-5);
    }
    assert!(rows[3].resting[0].moved[1] != rows[1].resting[0].moved[1]);
    // the trapezoidal rule of two steps of F ∝ δ, and of a load that is nearly linear
    near("work_under_a_force", (rows[3].work - rows[1].work) / (rows[3].stored - rows[1].stored), 1.0, 0.05);
}

/// A force on a curve over the time of all steps: two steps of one increment each are one step of two, in
/// forces, places, energies and work, forth and back.
#[test]
fn a_force_goes_on_along_its_curve() {
    let curve = "curve = \"min(t, 4 - t)\"";
    let time = |seconds: u32| {
        let step = format!("[{{ duration = \"{seconds} s\", increments = {seconds}, factor = 1 }}]");
        format!("time = {{ step = {step} }}\nsolver = {{ tolerance = 1e-9 }}")
    };
    let one = history(&pressed(curve, &time(4), ""));
    let later = format!("[[step]]\nboundary = [{BASE}]\n{}\n", time(1)).repeat(3);
    let steps = history(&pressed(curve, &time(1), &later));
    assert_eq!((one.len(), steps.len()), (4, 4));
    let peak = &one[1];
    for (a, b) in one.iter().zip(&steps) {
        near("time_of_a_force", b.time, a.time, 1e-12);
        near("force_of_steps", b.resting[0].force[1], a.resting[0].force[1], 1e-9);
        let way = (b.resting[0].moved[1] - a.resting[0].moved[1]).abs() / peak.resting[0].moved[1].abs();
        at_most("way_of_steps", way, 1e-6);
        at_most("energy_of_a_force", (b.stored - a.stored).abs() / peak.stored, 1e-6);
        at_most("work_of_a_force", (b.work - a.work).abs() / peak.work, 1e-6);
    }
    near("work_of_the_peak", peak.work / peak.stored, 1.0, 0.1);
}

/// A run resumed within either step has the same bits.
#[test]
fn resumed_below_an_indenter() {
    // L-BFGS continues from the start of a search only
    for (method, parts) in [("adr", [0.3, 0.6, 0.9]), ("lbfgs", [0.2, 0.4, 0.6])] {
        let solver = &format!("solver = {{ method = \"{method}\", steps = 2, tolerance = 1e-8 }}");
        let side = "{ name = \"side\", side = \"x+\", force = [\"1 N\", \"0 N\"] }";
        let text = pressed("", solver, &format!("[[step]]\nboundary = [{BASE}, {side}]\n{solver}\n"));
        let whole = history(&text);
        let iterations: usize = whole.iter().map(|row| row.iterations as usize).sum();
        for part in parts {
            let calls = (part * iterations as f64) as usize;
            let resumed = interrupted(&text, calls);
            assert_eq!(resumed, whole, "{method}, after {calls} of {iterations} iterations");
        }
    }
}

/// A floor with a velocity moves in explicit steps and stays in equilibria between them: as one with a
/// displacement on the curve of this motion.
#[test]
fn a_velocity_goes_on_in_explicit_steps() {
    let grip = "boundary = [{ side = \"x+\", displacement = [\"free\", \"0 mm\"] }]";
    let dynamics = "dynamics = { density = \"1000 kg/m^3\", end_time = \"0.2 ms\" }";
    let time = "time = { step = [{ duration = \"1 s\", increments = 1, factor = 1 }] }\n\
                solver = { tolerance = 1e-9 }";
    let scene = |floor: &str| {
        let steps = format!("[[step]]\n{grip}\n{time}\n[[step]]\n{grip}\n{dynamics}\n");
        let text = block(floor, "", &steps).replace("friction = 0.3", "friction = 0");
        let (head, rest) = text.split_once("[body]").unwrap();
        history(&format!("{head}{grip}\n{dynamics}\nsolver = {{ method = \"verlet\" }}\n[body]{rest}"))
    };
    let by_velocity = scene("velocity = [\"0 m/s\", \"0.5 m/s\"]");
    let curve = "curve = \"min(t, 2e-4) + max(t - 1.0002, 0)\"";
    let by_curve = scene(&format!("displacement = [\"0 mm\", \"500 mm\"]\n{curve}"));
    assert_eq!(by_velocity.len(), by_curve.len());
    let force = by_velocity.iter().map(|row| row.resting[0].force[1]).fold(0.0, f64::max);
    let (between, last) = (&by_velocity[by_velocity.len() / 2], by_velocity.last().unwrap());
    near("drift_between", between.resting[0].moved[1], 1e-4, 1e-12);
    near("drift_at_the_end", last.resting[0].moved[1], 2e-4, 1e-12);
    for (a, b) in by_velocity.iter().zip(&by_curve) {
        // 1 s of the curve leaves rounding of its time: 1e-16 s over 0.4 ms
        at_most("place_of_a_velocity", (a.resting[0].moved[1] - b.resting[0].moved[1]).abs(), 1e-12);
        at_most("force_of_a_velocity", (a.resting[0].force[1] - b.resting[0].force[1]).abs() / force, 1e-5);
    }
}
