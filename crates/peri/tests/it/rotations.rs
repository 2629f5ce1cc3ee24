//! Boundaries that rotate along the arc: a twisted bar against torsion of a neo-Hookean cylinder, bodies that
//! rotate as a whole.

use harness::case::{Case, Options, Run};
use harness::scene::Source;
use peri::bonds::stretch_range;
use peri::geometry::Shape;
use peri::model::{Body, Model, Rubber};
use peri::potential::Law;
use peri::program::run::{FinishedScene, Peri, run};
use peri::program::scene::Scene;
use peri::solver::{DynamicRelaxation, Lbfgs, Rotation, VelocityVerlet};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, PI, TAU};

fn solve(text: &str) -> FinishedScene {
    let directory = tempfile::tempdir().unwrap();
    let source = Source::new("scene.toml", text);
    let scene = source.parse::<Scene>().unwrap_or_else(|error| panic!("{}", error.render()));
    let mut own = Run::new(const { &Peri::PROGRAM }, &source, Options::new(directory.path()));
    run(&source, &scene, &mut own).unwrap_or_else(|error| panic!("{error}"))
}

pub fn value(finished: &FinishedScene, name: &str) -> f64 {
    finished.report.scalar(name).unwrap_or_else(|| panic!("no {name} in\n{}", finished.report.table()))
}

/// Round bar of 10 mm with 20 mm between its grips.
fn bar(turn: &str, steps: usize) -> String {
    format!(
        r#"version = 1
program = "peri"
[body]
space = "solid"
spacing = "1 mm"
shapes = [{{ add = "cylinder", centre = [
 "0 mm", "0 mm", "0 mm"], radius = "5 mm", length = "32 mm", axis = "z" }}]
[material.solid]
law = "eight-chain"
shear_modulus = "0.4 MPa"
bulk_modulus = "20 MPa"
links = 1000000
[[boundary]]
side = "z-"
depth = "6 mm"
displacement = ["0 mm", "0 mm", "0 mm"]
[[boundary]]
side = "z+"
depth = "6 mm"
{turn}
[[output.section]]
name = "mid"
point = ["0 mm", "0 mm", "0.01 mm"]
normal = [0, 0, 1]
[[probe]]
name = "turn"
track = "rotation"
axis = "z"
side = "z+"
layers = 6
[solver]
steps = {steps}
tolerance = 1e-5
[output]
fields = false
pictures = false
"#
    )
}

/// M = μθ′πR⁴/2, exact for a neo-Hookean cylinder of constant length (Rivlin 1948), with the twist θ′ in the
/// middle of the bar: to 1 % on a lattice of a tenth of the diameter. θ′ is θ/L of a free length that reaches
/// up to a spacing into each grip, because grips act over a horizon: at most 0.0206 N m at 60°. Along the arc
/// the largest stretch of every step is at most that of the last, 1.15; along the chord steps before the last
/// would be compressed.
#[test]
fn a_bar_twisted_along_the_arc() {
    let turn = "rotation = { point = [\"0 mm\", \"0 mm\", \"0 mm\"], axis = [0, 0, 2], angle = \"60 deg\" }";
    let slice = |name: &str, z: f64| {
        let (low, high) = (z - 0.5, z + 0.5);
        format!(
            "[[probe]]\nname = \"{name}\"\ntrack = \"rotation\"\naxis = \"z\"\nmin = [\"-6 mm\", \"-6 mm\", \
             \"{low} mm\"]\nmax = [\"6 mm\", \"6 mm\", \"{high} mm\"]\n"
        )
    };
    let twisted = solve(&(bar(turn, 4) + &slice("low", -5.5) + &slice("high", 5.5)));
    let moment_of = |rate: f64| 0.4e6 * rate * 0.5 * PI * 5e-3_f64.powi(4);
    let history = &twisted.outcomes[0].history;
    assert_eq!(history.len(), 4);
    for (step, record) in history.iter().enumerate() {
        assert!(record.largest_stretch <= 1.15, "step {}: {}", step + 1, record.largest_stretch);
    }
    let moment = value(&twisted, "mid_moment_z").abs();
    let exact = moment_of((value(&twisted, "high") - value(&twisted, "low")) / 11e-3);
    assert!((moment / exact - 1.0).abs() < 0.01, "{moment} N m, exactly {exact}");
    let [least, most] = [22e-3, 20e-3].map(|length| moment_of(FRAC_PI_3 / length));
    assert!(least < moment && moment < most, "{moment} N m, {least} to {most}");
    assert!((value(&twisted, "turn") - FRAC_PI_3).abs() < 1e-9);
    // the load is the moment over the largest radius of the grip, at the end of its arc
    let last = &history[3];
    let radius = last.displacement / FRAC_PI_3;
    assert!((4.5e-3..5e-3).contains(&radius), "{radius}");
    assert!((last.load * radius / moment - 1.0).abs() < 1e-2, "{} N", last.load);
    // work of the moment: ½Mθ of a linear response, by trapezoids
    assert!((last.work / (0.5 * moment * FRAC_PI_3) - 1.0).abs() < 0.03, "{} J", last.work);
    // the other way round, and back: the same moment with the other sign, then none
    let back = solve(&bar(&turn.replace("60", "-60"), 4).replace("steps = 4", "steps = 4\npath = [1, 0]"));
    let history = &back.outcomes[0].history;
    assert!((history[1].load / last.load - 1.0).abs() < 1e-3, "{} {}", history[1].load, last.load);
    assert!(history[3].load.abs() < 1e-3 * last.load, "{}", history[3].load);
}

/// A rotating grip that is free along its axis has no axial force, and the bar elongates (Poynting).
#[test]
fn a_bar_free_along_its_axis() {
    let turn = "rotation = { point = [\"0 mm\", \"0 mm\", \"0 mm\"], axis = [0, 0, 1], angle = \"90 deg\" }
displacement = [\"0 mm\", \"0 mm\", \"free\"]";
    let held = solve(&bar(turn.lines().next().unwrap(), 3));
    let text = bar(turn, 3)
        + "[[probe]]\nname = \"end\"\ntrack = \"displacement\"\naxis = \"z\"\nside = \"z+\"\nlayers = 1\n";
    let free = solve(&text);
    let (with, without) = (value(&held, "mid_force_z"), value(&free, "mid_force_z"));
    assert!(without.abs() < 0.01 * with.abs(), "{without} N, held {with} N");
    assert!(value(&free, "end") > 1e-5, "{} m", value(&free, "end"));
}

/// A body follows a full rotation of a region without stretching any bond in any step, and ends in its
/// initial position.
#[test]
fn a_full_turn_strains_nothing() {
    let sheet = || Body::lattice(Shape::rectangle([0.0; 2], [20e-3, 8e-3]), 1e-3).plane_stress(1e-3);
    let turn = Rotation { centre: [5e-3, 4e-3], axis: [0.0, 0.0, 1.0], angle: TAU };
    let model =
        || Model::new(sheet(), Rubber::new(Law::Linear, 1e6)).rotate(|[x, _]| x < 3e-3, turn).steps(6);
    let mut simulations = [model().build().unwrap(), model().build().unwrap()];
    simulations[0].solve(Lbfgs::default()).unwrap();
    simulations[1].solve(DynamicRelaxation::default()).unwrap();
    for simulation in &simulations {
        for record in simulation.history() {
            // rounding of positions of 20 mm over bonds of 1 mm
            assert!((record.largest_stretch - 1.0).abs() < 1e-12, "{}", record.largest_stretch);
            assert!(record.load.abs() < 1e-9, "{} N", record.load);
        }
        assert!(simulation.displacements().all(|(_, u)| u[0].hypot(u[1]) < 1e-15));
        let arc = simulation.history()[5].displacement;
        // from (5, 4) to the corner particle at (0.5, 0.5) mm
        assert!((arc / (TAU * 4.5e-3_f64.hypot(3.5e-3)) - 1.0).abs() < 1e-12, "{arc}");
    }
    let axis = [0.0, 0.6, 0.8];
    let body = Body::lattice(Shape::cuboid([0.0; 3], [8e-3, 5e-3, 5e-3]), 1e-3);
    let third = Rotation { centre: [1e-3, 2e-3, 3e-3], axis, angle: 2.5 };
    let model = Model::new(body, Rubber::new(Law::Linear, 1e6)).rotate(|[x, ..]| x < 3e-3, third);
    let mut simulation = model.steps(2).build().unwrap();
    simulation.solve(Lbfgs::default()).unwrap();
    for (place, u) in simulation.displacements() {
        let exact = third.displacement(place, 1.0);
        assert!((0..3).all(|d| (u[d] - exact[d]).abs() < 1e-14), "{u:?} {exact:?}");
    }
}

/// A ring between a fixed rim and a rotated sleeve: M = 4πμ t θ/(1/a² − 1/b²) at small angles, with rims up
/// to a spacing inside the grips.
#[test]
fn a_bushing_turned_in_its_plane() {
    let (inner, outer, thickness) = (10e-3_f64, 30e-3_f64, 1e-3);
    let disk = |radius: f64| Shape::disk([0.0; 2], radius);
    let body = Body::lattice(disk(outer + 6e-3), 1e-3).cut(disk(inner - 6e-3)).plane_stress(thickness);
    let turn = Rotation { centre: [0.0; 2], axis: [0.0, 0.0, 1.0], angle: 0.02 };
    let model = Model::new(body, Rubber::new(Law::Linear, 1e6))
        .clamp(move |[x, y]| x.hypot(y) > outer)
        .rotate(move |[x, y]| x.hypot(y) < inner, turn);
    let mut simulation = model.build().unwrap();
    simulation.solve(Lbfgs::default()).unwrap();
    let last = &simulation.history()[0];
    let moment = last.load * last.displacement / turn.angle;
    let shear = 1e6 / (2.0 * (1.0 + 1.0 / 3.0));
    let exact = |a: f64, b: f64| 4.0 * PI * shear * thickness * turn.angle / (a.powi(-2) - b.powi(-2));
    let (least, most) = (exact(inner - 1e-3, outer + 1e-3), exact(inner, outer));
    assert!(least < moment && moment < most, "{moment} N m, {least} to {most}");
}

/// Explicit dynamics: the grip follows the factor, and work = kinetic + stored up to O(Δt²), a quarter at
/// half the time step.
#[test]
fn a_strip_swung_by_its_grip() {
    let turn = Rotation { centre: [0.0; 2], axis: [0.0, 0.0, 1.0], angle: FRAC_PI_2 };
    let error = |step: f64| {
        let sheet = Body::lattice(Shape::rectangle([0.0; 2], [16e-3, 6e-3]), 1e-3).plane_stress(1e-3);
        let model = Model::new(sheet, Rubber::new(Law::Linear, 1e6)).rotate(|[x, _]| x < 3e-3, turn);
        let mut simulation = model.build().unwrap();
        let own = VelocityVerlet::new(1000.0, 50e-3);
        simulation.solve(VelocityVerlet { ramp: 40e-3, records: 10, time_step: Some(step), ..own }).unwrap();
        for (place, u) in simulation.displacements().filter(|(place, _)| place[0] < 3e-3) {
            let exact = turn.displacement(place, 1.0);
            assert!((0..2).all(|d| (u[d] - exact[d]).abs() < 1e-16), "{u:?} {exact:?}");
        }
        // it bends a little while it swings
        let range = stretch_range(&simulation.bonds, &simulation.state.displacement);
        assert!(range.low > -0.2 && range.high < 0.2, "{range:?}");
        let of = |record: &peri::solver::StepRecord| {
            (record.kinetic + record.stored - record.work).abs() / record.work
        };
        simulation.history().iter().map(of).fold(0.0, f64::max)
    };
    let [coarse, fine] = [4e-5, 2e-5].map(error);
    assert!(coarse < 0.01 && (3.0..5.0).contains(&(coarse / fine)), "{coarse} {fine}");
}

/// A displacement field of the same rotation along the chord gives a warning.
#[test]
fn chords_are_told() {
    let chord = "displacement_field = [\"-0.5*x - 0.866025404*y\", \"0.866025404*x - 0.5*y\", \"0\"]";
    let told = |turn: &str| {
        let source = Source::new("scene.toml", bar(turn, 4));
        let scene = source.parse::<Scene>().unwrap_or_else(|error| panic!("{}", error.render()));
        peri::program::run::explanation(&source, &scene, false)
            .unwrap_or_else(|error| panic!("{error}"))
            .join("\n")
    };
    let warned = told(chord);
    assert!(warned.contains("boundary[1].displacement_field turns its region by 60°"), "{warned}");
    let small =
        told("displacement_field = [\"-0.0038053*x - 0.0871557*y\", \"0.0871557*x - 0.0038053*y\", \"0\"]");
    assert!(!small.contains("warning"), "{small}");
    let stretched = told("displacement_field = [\"0.3*x\", \"0.3*y\", \"1e-3\"]");
    assert!(!stretched.contains("warning"), "{stretched}");
}
