//! Contact across the steps of a programme: surfaces keep their places, sticking friction its slip.

use crate::curves::solve;
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
