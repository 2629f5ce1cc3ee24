//! Rotations in the later steps of a programme: totals from the undeformed region, along the arc from where
//! the step before has left it.

use crate::curves::solve;
use crate::rotations::value;
use evidence::{at_most, near};
use harness::case::{Case, Fault, Options, Run};
use harness::scene::{Failure, Source};
use peri::program::run::{FinishedScene, Peri, run};
use peri::program::scene::Scene;
use peri::solver::StepRecord;
use std::f64::consts::{FRAC_PI_3, PI, TAU};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Round bar of 10 mm with 20 mm between its grips.
fn bar(first: &str, solver: &str, steps: &str) -> String {
    format!(
        r#"version = 1
program = "peri"
[body]
space = "solid"
spacing = "1.25 mm"
shapes = [{{ add = "cylinder", centre = [
 "0 mm", "0 mm", "0 mm"], radius = "5 mm", length = "35 mm", axis = "z" }}]
[material.solid]
law = "eight-chain"
shear_modulus = "0.4 MPa"
bulk_modulus = "20 MPa"
links = 1000000
[[boundary]]
side = "z-"
depth = "7.5 mm"
displacement = ["0 mm", "0 mm", "0 mm"]
[[boundary]]
side = "z+"
depth = "7.5 mm"
{first}
[[output.section]]
name = "mid"
point = ["0 mm", "0 mm", "0.01 mm"]
normal = [0, 0, 1]
[solver]
{solver}
[output]
fields = false
pictures = false
{steps}"#
    )
}

/// The rotation of the upper grip of the bar.
fn turn(degrees: f64) -> String {
    format!(
        "rotation = {{ point = [\"0 mm\", \"0 mm\", \"0 mm\"], axis = [0, 0, 1], angle = \"{degrees} deg\" }}"
    )
}

/// A later step of the bar.
fn step(grip: &str, solver: &str) -> String {
    let low = "{ side = \"z-\", depth = \"7.5 mm\", displacement = [\"0 mm\", \"0 mm\", \"0 mm\"] }";
    format!(
        "[[step]]\nboundary = [{low}, {{ side = \"z+\", depth = \"7.5 mm\", {grip} }}]\n\
         solver = {{ {solver} }}\n"
    )
}

fn history(run: &FinishedScene) -> &[StepRecord] {
    &run.outcomes[0].history
}

/// A bar twisted by 120° in one step, and by 60° in each of two: the same moment, force, energy and work at
/// every angle. Held there, and named with its lengths it returns along the arc, through the same energies,
/// to none. The solver's tolerance is 1e-5 of the forces.
#[test]
fn twisted_further_and_back() {
    let solver = |steps: u32| format!("steps = {steps}, tolerance = 1e-5");
    let scene = |steps: u32| solver(steps).replace(", ", "\n");
    let one = solve(&bar(&turn(120.0), &scene(4), ""));
    let twice = solve(&bar(&turn(60.0), &scene(2), &step(&turn(120.0), &solver(2))));
    for name in ["mid_moment_z", "mid_force_z"] {
        near("twisted_in_two_steps", value(&twice, name) / value(&one, name), 1.0, 1e-3);
    }
    let (one, twice) = (history(&one), history(&twice));
    assert_eq!((one.len(), twice.len()), (4, 4));
    for (a, b) in one.iter().zip(twice) {
        near("energy_of_a_twist", b.stored / a.stored, 1.0, 1e-5);
        near("load_of_a_twist", b.load / a.load, 1.0, 1e-3);
        near("arc_of_a_twist", b.displacement / a.displacement, 1.0, 1e-12);
        near("work_of_a_twist", b.work / a.work, 1.0, 1e-3);
    }
    let back = step("displacement = [\"0 mm\", \"0 mm\", \"0 mm\"]", &solver(2));
    let hold = step("displacement = [\"hold\", \"hold\", \"hold\"]", &solver(1));
    let returned = solve(&bar(&turn(60.0), &scene(2), &(hold + &back)));
    let rows = history(&returned);
    assert_eq!(rows.len(), 5);
    near("held_twist", rows[2].stored / rows[1].stored, 1.0, 1e-6);
    near("held_arc", rows[2].displacement / rows[1].displacement, 1.0, 1e-12);
    near("held_moment", rows[2].load / rows[1].load, 1.0, 1e-3);
    near("untwisted_energy", rows[3].stored / rows[0].stored, 1.0, 1e-5);
    at_most("untwisted_rest", rows[4].stored / rows[1].stored, 1e-8);
    at_most("untwisted_work", rows[4].work.abs() / rows[1].work, 1e-3);
}

/// A bar compressed by 5 % and then twisted by 60°, in one step of the scene and in two, against Rivlin
/// (1949), doi:10.1098/rsta.1949.0009: M = ½πμψa⁴/λ with the twist ψ per undeformed length and the stretch λ
/// in the middle: to 1 % against the bar that is twisted only, and to 5 % in itself, as the polar moment of
/// the cells, an eighth of the diameter wide, is 8 % above that of the circle. Both steps at once, or in the
/// opposite order, lead to the same state.
#[test]
fn compressed_then_twisted() {
    let slice = |name: &str, track: &str, z: f64| {
        let (low, high) = (z - 0.6, z + 0.6);
        format!(
            "[[probe]]\nname = \"{name}\"\ntrack = \"{track}\"\naxis = \"z\"\nmin = [\"-6 mm\", \"-6 mm\", \
             \"{low} mm\"]\nmax = [\"6 mm\", \"6 mm\", \"{high} mm\"]\n"
        )
    };
    let probes = slice("low", "rotation", -4.375)
        + &slice("high", "rotation", 4.375)
        + &slice("down", "displacement", -4.375)
        + &slice("up", "displacement", 4.375);
    let solver = "steps = 2, tolerance = 1e-5";
    let first = "steps = 2\ntolerance = 1e-5\n".to_owned() + &probes;
    let press = "displacement = [\"0 mm\", \"0 mm\", \"-1 mm\"]";
    let both = |separator: &str| format!("{}{separator}{press}", turn(60.0));
    let keep = format!("{}, displacement = [\"hold\", \"hold\", \"hold\"]", turn(60.0));
    let at_once = solve(&bar(&both("\n"), &first, ""));
    let programmes =
        [bar(press, &first, &step(&keep, solver)), bar(&turn(60.0), &first, &step(&both(", "), solver))];
    for text in programmes {
        let run = solve(&text);
        for name in ["mid_moment_z", "mid_force_z"] {
            near("compressed_and_twisted", value(&run, name) / value(&at_once, name), 1.0, 1e-3);
        }
        let [end, last] = [&at_once, &run].map(|run| history(run).last().unwrap());
        near("compressed_and_twisted", last.stored / end.stored, 1.0, 1e-5);
        // 20 mm and up to a spacing in each grip; the trapezoidal rule of few steps
        near("work_of_both", last.work / last.stored, 1.0, 0.02);
    }
    let twisted = solve(&bar(&turn(60.0), &first, ""));
    let of = |run: &FinishedScene| {
        let length = 8.75e-3;
        let twist = (value(run, "high") - value(run, "low")) / length;
        let stretch = 1.0 + (value(run, "up") - value(run, "down")) / length;
        [twist, stretch, value(run, "mid_moment_z").abs()]
    };
    let [[twist, stretch, moment], [before, one, alone]] = [&at_once, &twisted].map(of);
    assert!(stretch < 0.97 && (one - 1.0).abs() < 0.01 && twist > 40.0, "{stretch} {one} {twist}");
    near("moment_of_a_compressed_bar", moment / alone, twist / before * one / stretch, 0.01);
    near(
        "moment_of_a_compressed_bar",
        moment,
        0.5 * PI * 0.4e6 * twist * 5e-3_f64.powi(4) / stretch,
        0.05 * moment,
    );
}

/// A ring between a rim and a sleeve that turns in its plane.
fn ring(first: &str, steps: &str) -> String {
    format!(
        r#"version = 1
program = "peri"
[body]
space = "plane-strain"
thickness = "1 mm"
spacing = "1 mm"
shapes = [
 {{ add = "disk", centre = ["0 mm", "0 mm"], radius = "16 mm" }},
 {{ cut = "disk", centre = ["0 mm", "0 mm"], radius = "4 mm" }},
]
[material]
youngs_modulus = "1 MPa"
law = "linear"
[[boundary]]
name = "rim"
shapes = [
  {{ add = "disk", centre = ["0 mm", "0 mm"], radius = "16 mm" }},
  {{ cut = "disk", centre = ["0 mm", "0 mm"], radius = "13 mm" }},
]
displacement = ["0 mm", "0 mm"]
[[boundary]]
name = "sleeve"
shapes = [{{ add = "disk", centre = ["0 mm", "0 mm"], radius = "7 mm" }}]
{first}
[solver]
steps = 3
tolerance = 1e-8
[output]
fields = false
pictures = false
{steps}"#
    )
}

const RIM: &str = "{ name = \"rim\", shapes = [\
                   { add = \"disk\", centre = [\"0 mm\", \"0 mm\"], radius = \"16 mm\" }, \
                   { cut = \"disk\", centre = [\"0 mm\", \"0 mm\"], radius = \"13 mm\" }], \
                   displacement = [\"0 mm\", \"0 mm\"] }";

fn sleeve(motion: &str) -> String {
    let disk = "{ add = \"disk\", centre = [\"0 mm\", \"0 mm\"], radius = \"7 mm\" }";
    format!("{{ name = \"sleeve\", shapes = [{disk}], {motion} }}")
}

fn about(degrees: f64) -> String {
    format!("rotation = {{ point = [\"0 mm\", \"0 mm\"], angle = \"{degrees} deg\" }}")
}

fn later(motion: &str, keys: &str) -> String {
    format!("[[step]]\nboundary = [{RIM}, {}]\n{keys}\n", sleeve(motion))
}

/// Work of a rotation: the area under the moment over the angle, which the stored energy is; with a curve as
/// without one. The chord of a step of 20° instead of its arc would be 2 % off.
#[test]
fn work_of_a_rotation() {
    let solver = "solver = { steps = 1, tolerance = 1e-8 }";
    let text = ring(&about(20.0), &(later(&about(40.0), solver) + &later(&about(20.0), solver)));
    let run = solve(&text);
    let rows = history(&run);
    assert_eq!(rows.len(), 5);
    let of = |k: usize| rows[k].work / rows[k].stored;
    // the trapezoidal rule of a nearly linear moment
    [0, 2, 3].into_iter().for_each(|k| near("work_of_a_rotation", of(k), 1.0, 0.01));
    near("work_given_back", rows[4].work / rows[2].work, 1.0, 1e-6);
    near("moment_given_back", rows[4].load / rows[2].load, 1.0, 1e-6);
    // a curve that overshoots and comes back to the angle
    let time = "time = { step = [{ duration = \"1 s\", increments = 4, factor = 1 }] }\n\
                solver = { tolerance = 1e-8 }";
    let curve = format!("{}, curve = \"2.5 * t - 1.5 * t * t\"", about(40.0));
    let run = solve(&ring(&about(20.0), &later(&curve, time)));
    let last = history(&run).last().unwrap();
    near("angle_of_a_curve", last.stored / rows[3].stored, 1.0, 1e-6);
}

/// A sheet is stretched between rollers; one end, gripped as deformed as it is, then turns by 180° and on to
/// 360°, while the other is let go: it stores what it stores beside an end that does not turn. With lengths
/// the grip becomes straight and the free sheet stores nothing.
#[test]
fn a_deformed_grip_turns_as_it_is() {
    let scene = |steps: &str| {
        format!(
            r#"version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "1 mm"
shapes = [{{ add = "box", min = ["0 mm", "0 mm"], max = ["16 mm", "8 mm"] }}]
[material]
youngs_modulus = "1 MPa"
law = "linear"
[[boundary]]
side = "x-"
displacement = ["0.2 mm", "free"]
[[boundary]]
side = "x+"
displacement = ["1.2 mm", "free"]
[[boundary]]
name = "middle"
min = ["7 mm", "3 mm"]
max = ["9 mm", "5 mm"]
displacement = ["free", "0 mm"]
[solver]
tolerance = 1e-10
[output]
fields = false
pictures = false
{steps}"#
        )
    };
    let step = |motion: &str| {
        let solver = "solver = { steps = 4, tolerance = 1e-10 }";
        format!("[[step]]\nboundary = [{{ side = \"x-\", {motion} }}]\n{solver}\n")
    };
    let turn = |degrees: f64, held: &str| {
        let rotation = format!("rotation = {{ point = [\"8 mm\", \"4 mm\"], angle = \"{degrees} deg\" }}");
        format!("{rotation}, displacement = [{held}]")
    };
    let hold = "\"hold\", \"hold\"";
    let still = solve(&scene(&step(&format!("displacement = [{hold}]"))));
    let stored = history(&still)[4].stored;
    assert!(stored > 1e-3 * history(&still)[0].stored, "{stored}");
    let run = solve(&scene(&(step(&turn(180.0, hold)) + &step(&turn(360.0, hold)))));
    let rows = history(&run);
    assert_eq!(rows.len(), 9);
    for row in &rows[1..] {
        near("energy_beside_a_turned_grip", row.stored / stored, 1.0, 1e-8);
    }
    let straight = solve(&scene(&step(&turn(180.0, "\"0 mm\", \"1 mm\""))));
    at_most("energy_beside_a_straight_grip", history(&straight)[4].stored / stored, 1e-12);
}

/// Explicit dynamics turns on from the angle of an equilibrium; kinetic and stored energy are its work.
#[test]
fn turned_on_in_dynamics() {
    let dynamics = "dynamics = { density = \"1000 kg/m^3\", end_time = \"20 ms\", ramp = \"15 ms\" }";
    let run = solve(&ring(&about(30.0), &later(&about(60.0), dynamics)));
    let (rows, at_rest) = (history(&run), solve(&ring(&about(60.0), "")));
    let last = rows.last().unwrap();
    near("arc_in_dynamics", last.displacement / history(&at_rest)[2].displacement, 1.0, 1e-9);
    let open = |row: &StepRecord| (row.kinetic + row.stored - row.work).abs() / last.work;
    let most = rows[3..].iter().map(open).fold(0.0, f64::max);
    // velocity Verlet, of second order in the time step
    at_most("ledger_of_a_rotation", most, 5e-3);
    assert!(last.stored > 0.5 * history(&at_rest)[2].stored && last.kinetic > 0.0, "{last:?}");
}

/// Runs a scene until the solver has asked `calls` times whether to stop, continues it on other threads, and
/// returns its history.
pub fn interrupted(text: &str, calls: usize) -> Vec<StepRecord> {
    let directory = tempfile::tempdir().unwrap();
    let source = Source::new("scene.toml", text);
    let scene = source.parse::<Scene>().unwrap_or_else(|error| panic!("{}", error.render()));
    let asked = AtomicUsize::new(0);
    let stop = || asked.fetch_add(1, Ordering::Relaxed) >= calls;
    let options = Options { interrupted: &stop, ..Options::new(directory.path()) };
    let mut own = Run::new(const { &Peri::PROGRAM }, &source, options);
    assert!(run(&source, &scene, &mut own).is_err(), "ended before {calls} calls");
    drop(own);
    let options = Options { resume: true, ..Options::new(directory.path()) };
    let mut own = Run::new(const { &Peri::PROGRAM }, &source, options);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let resumed = pool.install(|| run(&source, &scene, &mut own));
    resumed.unwrap_or_else(|error| panic!("{error}")).outcomes[0].history.clone()
}

/// A run resumed within each of the steps has the same bits, on one thread and on two.
#[test]
fn resumed_while_it_turns() {
    let solver = "solver = { steps = 3, tolerance = 1e-8 }";
    let dynamics = "dynamics = { density = \"1000 kg/m^3\", end_time = \"2 ms\", ramp = \"1 ms\" }";
    let back = "displacement = [\"0 mm\", \"0.5 mm\"]";
    let steps = later(&about(50.0), solver) + &later(&about(55.0), dynamics) + &later(back, solver);
    let text = ring(&about(30.0), &steps);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let whole = pool.install(|| history(&solve(&text)).to_vec());
    let iterations: usize = whole.iter().map(|row| row.iterations as usize).sum();
    for part in [0.2, 0.5, 0.6, 0.7, 0.9] {
        let calls = (part * iterations as f64) as usize;
        assert_eq!(interrupted(&text, calls), whole, "after {calls} of {iterations} iterations");
    }
    // back at rest, moved as a whole: nothing but the shift
    let shifted = solve(&ring("displacement = [\"0 mm\", \"0.5 mm\"]", ""));
    near("shift_after_a_turn", whole.last().unwrap().stored / history(&shifted)[2].stored, 1.0, 1e-6);
}

/// Message of a run that refuses to begin a step.
fn refused(text: &str) -> String {
    let directory = tempfile::tempdir().unwrap();
    let source = Source::new("scene.toml", text);
    let scene = source.parse::<Scene>().unwrap_or_else(|error| panic!("{}", error.render()));
    let mut own = Run::new(const { &Peri::PROGRAM }, &source, Options::new(directory.path()));
    match run(&source, &scene, &mut own) {
        Err(Failure::Run(error)) => {
            assert_eq!(error.exit_code(), 2);
            error.to_string()
        }
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("it ran"),
    }
}

/// Motions that would distort a turned region, that begin with a jump, or that turn a part of a region.
#[test]
fn distortions_are_refused() {
    let told = |motion: &str, keys: &str, found: &str| {
        let text = refused(&ring(&about(30.0), &later(motion, keys)));
        assert!(text.starts_with("step 2: ") && text.contains(found), "{text}");
    };
    let solver = "solver = { steps = 3, tolerance = 1e-8 }";
    let mixed = "displacement = [\"hold\", \"0 mm\"]";
    told(
        mixed,
        solver,
        "displacements of particles turned by 30.0000° about the axis through (0.0000, 0.0000",
    );
    let field = "displacement_field = [\"0.01 * y\", \"0\"]";
    told(field, solver, "allowed: a `rotation`, `hold`, or lengths");
    let time = "time = { step = [{ duration = \"1 s\", increments = 2, factor = 1 }] }";
    let jump = format!("{}, curve = \"1\"", about(0.0));
    told(&jump, time, "begins 3.");
    let sudden = "dynamics = { density = \"1000 kg/m^3\", end_time = \"2 ms\" }";
    told(&about(70.0), sudden, "allowed: a curve that is 0 at the start, in explicit dynamics also a ramp");
    let wide = format!(
        "[[step]]\nboundary = [{RIM}, {}]\n{solver}\n",
        sleeve(&about(80.0)).replace("\"7 mm\"", "\"9 mm\"").replace("sleeve", "wide")
    );
    let text = refused(&ring(&about(30.0), &wide));
    assert!(text.contains(" particles turned by 30.0000°") && text.contains("all been turned"), "{text}");
    let other = format!(
        "[[step]]\nboundary = [{RIM}, {}]\n{solver}\n",
        sleeve(&about(80.0))
            .replace("[\"0 mm\", \"0 mm\"], angle", "[\"1 mm\", \"0 mm\"], angle")
            .replace("sleeve", "hub")
    );
    let text = refused(&ring(&about(30.0), &other));
    assert!(text.contains("found a rotation about another axis of a region turned by 30.0000°"), "{text}");
}

/// A free body that is turned by 180° and on to 360°, or back, is not strained: the angle counts full turns.
#[test]
fn full_turns_strain_nothing() {
    let scene = |steps: &str| {
        format!(
            r#"version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "1 mm"
shapes = [{{ add = "box", min = ["0 mm", "0 mm"], max = ["12 mm", "6 mm"] }}]
[material]
youngs_modulus = "1 MPa"
law = "linear"
[[boundary]]
side = "x-"
rotation = {{ point = ["5 mm", "4 mm"], angle = "180 deg" }}
[solver]
steps = 3
[output]
fields = false
pictures = false
{steps}"#
        )
    };
    let on = |degrees: f64| {
        format!(
            "[[step]]\nboundary = [{{ side = \"x-\", rotation = {{ point = [\"5 mm\", \"4 mm\"], angle = \
             \"{degrees} deg\" }} }}]\nsolver = {{ steps = 3 }}\n"
        )
    };
    let run = solve(&scene(&(on(360.0) + &on(540.0) + &on(-180.0))));
    let rows = history(&run);
    assert_eq!(rows.len(), 12);
    let radius = rows[2].displacement / PI;
    for (row, arc) in rows.iter().zip([1, 2, 3, 4, 5, 6, 7, 8, 9, 5, 1, -3]) {
        // rounding of positions of 12 mm over bonds of 1 mm
        at_most("stretch_of_a_free_turn", (row.largest_stretch - 1.0).abs(), 1e-12);
        near("arc_of_full_turns", row.displacement, radius * FRAC_PI_3 * f64::from(arc).abs(), 1e-12);
    }
    assert!(radius < TAU);
}
