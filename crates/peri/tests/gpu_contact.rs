//! Scenes with contact on a graphics card, or on a program that stands for one, compared with the processor.

#[path = "it/bodies.rs"]
#[allow(dead_code)] // shared by all tests
mod bodies;

use bodies::{Body, MODULUS};
use harness::case::{Case, Options, Run};
use harness::scene::Source;
use peri::Error;
use peri::bonds::{BodyGeometry, LatticeBonds};
use peri::contact::{Contact, RigidSurface};
use peri::gpu::{Device, Precision};
use peri::material::BondMaterial;
use peri::potential::Law;
use peri::program::run::{FinishedScene, Peri};
use peri::program::scene::Scene;
use peri::solver::{Breaking, Loads, Method, Policy, State, Status, StepRecord, System, VelocityVerlet};
use peri::surface::BodySurface;

fn run(name: &str, text: &str) -> Result<FinishedScene, harness::scene::Failure<Error>> {
    let folder = tempfile::tempdir().unwrap();
    let source = Source::new(name, text);
    let scene = source.parse::<Scene>()?;
    let mut own = Run::new(const { &Peri::PROGRAM }, &source, Options::new(folder.path()));
    peri::program::run::run(&source, &scene, &mut own)
}

/// Precisions of this machine's device; reports a skipped test without a device.
#[track_caller]
fn precisions() -> Vec<(Precision, &'static str)> {
    let all = [(Precision::Single, "single"), (Precision::Double, "double")];
    let has = |(precision, _): &(Precision, &str)| {
        Device::portable().and_then(|device| device.with_precision(*precision)).is_ok()
    };
    let found: Vec<_> = all.into_iter().filter(has).collect();
    if found.is_empty() {
        evidence::skipped("a device behind Vulkan, Metal or DirectX 12");
    }
    found
}

fn on_card(text: &str, word: &str) -> FinishedScene {
    let scene = text.replace("device = \"cpu\"", &format!("device = \"gpu\"\nprecision = \"{word}\""));
    assert_ne!(scene, text);
    let found = run("gpu.toml", &scene).unwrap();
    let note = found.outcomes[0].warnings.join("\n");
    assert!(note.contains(&format!("in {word} precision")), "{note}");
    found
}

/// Forces, N, and lengths, m, of which only rounding is left.
const ROUNDING: f64 = 1e-9;

/// Numbers of a row of history that a device computes or that follow from its fields.
fn numbers(row: &StepRecord) -> Vec<f64> {
    let surfaces = row.resting.iter().flat_map(|resting| {
        resting.force.into_iter().chain(resting.moved).chain([resting.area, resting.gap])
    });
    [row.work, row.stored, row.kinetic, row.damped, row.released, row.load]
        .into_iter()
        .chain(surfaces)
        .collect()
}

/// Compares runs of a scene on the card with those of the processor: broken bonds, iterations within `apart`,
/// and all numbers of the history to `allowed` of the greatest of their kind.
fn compare(name: &str, text: &str, (apart, allowed, single): (u64, f64, f64)) -> FinishedScene {
    let host = run("host.toml", text).unwrap();
    for (precision, word) in precisions() {
        let found = on_card(text, word);
        let allowed = if precision == Precision::Double { allowed } else { single };
        for (found, host) in found.outcomes.iter().zip(&host.outcomes) {
            assert_eq!(found.history.len(), host.history.len(), "{name} in {word}");
            let greatest =
                |column: usize| host.history.iter().map(|row| numbers(row)[column].abs()).fold(0.0, f64::max);
            let energy = (0..3).map(greatest).fold(f64::MIN_POSITIVE, f64::max);
            let mut worst = (0.0_f64, String::new());
            for (found, host) in found.history.iter().zip(&host.history) {
                if precision == Precision::Double {
                    assert_eq!(found.broken, host.broken, "{name}");
                    let iterations = found.iterations.abs_diff(host.iterations);
                    assert!(iterations <= apart * host.rounds, "{name}: {found:?} {host:?}");
                }
                for (column, (a, b)) in numbers(found).into_iter().zip(numbers(host)).enumerate() {
                    let size = if column < 5 { energy } else { greatest(column).max(ROUNDING) };
                    let part = (a - b).abs() / size;
                    if part > worst.0 {
                        worst = (part, format!("number {column} at {}: {a:e} {b:e}", host.factor));
                    }
                }
            }
            eprintln!("{name} in {word}: {:.1e}, {}", worst.0, worst.1);
            evidence::at_most(&format!("{name} in {word}"), worst.0, allowed);
        }
    }
    host
}

/// A notched plate on a plane, hit by another plane that is inclined and moves, until bonds break beside it.
const PRESSED: &str = r#"
version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "1 mm"
shapes = [{ add = "box", min = ["0 mm", "0 mm"], max = ["24 mm", "20 mm"] }]
cracks = [{ from = ["12 mm", "12 mm"], to = ["12 mm", "21 mm"] }]
[material]
youngs_modulus = "191 GPa"
law = "linear"
critical = { stretch = 1.012 }
[[boundary]]
name = "held"
min = ["0 mm", "0 mm"]
max = ["1 mm", "20 mm"]
displacement = ["0 mm", "free"]
[contact]
stiffness = 0
[[contact.plane]]
name = "floor"
point = ["0 mm", "0 mm"]
normal = [0.0, 1.0]
stiffness = 2
[[contact.plane]]
name = "hammer"
point = ["24 mm", "20.2 mm"]
normal = [-0.3, -1.0]
stiffness = 1.5
velocity = ["0 m/s", "-60 m/s"]
[solver]
method = "verlet"
[dynamics]
density = "8000 kg/m^3"
end_time = "20 us"
damping = "1000 1/s"
records = 8
device = "cpu"
[output]
pictures = false
fields = false
"#;

#[test]
fn gpu_planes_press_as_on_the_host() {
    let host = compare("hammer", PRESSED, (0, 1e-9, 0.05));
    let last = host.outcomes[0].history.last().unwrap();
    assert!(last.broken > 10, "{} bonds broke", last.broken);
    assert!(last.resting.iter().all(|resting| resting.force[1].abs() > 1.0), "{:?}", last.resting);
    assert!(last.work > 0.0);
}

/// The plates of a hammer that breaks nothing, whose steps are taken together.
#[test]
fn gpu_planes_in_steps_taken_together() {
    let elastic = PRESSED.replace("critical = { stretch = 1.012 }\n", "");
    let host = compare("elastic hammer", &elastic, (0, 1e-9, 1e-3));
    assert!(host.outcomes[0].history.last().unwrap().work > 0.0);
    let Some((_, word)) = precisions().pop() else { return };
    let [one, two] = [(); 2].map(|()| on_card(&elastic, word));
    let rows = |run: &FinishedScene| format!("{:?}", run.outcomes[0].history);
    assert_eq!(rows(&one), rows(&two), "another run has other bits");
}

/// A block between planes in equilibrium, of which one moves.
const SQUEEZED: &str = r#"
version = 1
program = "peri"
[body]
space = "solid"
spacing = "1 mm"
shapes = [{ add = "box", min = ["0 mm", "0 mm", "0 mm"], max = ["8 mm", "7 mm", "9 mm"] }]
[material]
youngs_modulus = "3 MPa"
law = "linear"
[[boundary]]
name = "held"
min = ["0 mm", "0 mm", "0 mm"]
max = ["1 mm", "7 mm", "9 mm"]
displacement = ["0 mm", "free", "free"]
[[boundary]]
name = "guided"
min = ["0 mm", "0 mm", "0 mm"]
max = ["8 mm", "1 mm", "9 mm"]
displacement = ["free", "0 mm", "free"]
[contact]
stiffness = 0
[[contact.plane]]
name = "floor"
point = ["0 mm", "0 mm", "0 mm"]
normal = [0.0, 0.0, 1.0]
[[contact.plane]]
name = "press"
point = ["8 mm", "0 mm", "9.1 mm"]
normal = [-0.2, 0.0, -1.0]
displacement = ["0 mm", "0 mm", "-0.6 mm"]
[solver]
method = "adr"
steps = 3
device = "cpu"
[output]
pictures = false
fields = false
"#;

#[test]
fn gpu_planes_in_equilibria() {
    let host = compare("press by relaxation", SQUEEZED, (1, 1e-8, 5e-3));
    let last = host.outcomes[0].history.last().unwrap();
    assert!(last.resting.iter().all(|resting| resting.force[2].abs() > 0.01), "{:?}", last.resting);
    let lbfgs = SQUEEZED.replace("method = \"adr\"", "method = \"lbfgs\"\ntolerance = 1e-6");
    // without the coarse level it takes more iterations, and ends at another place within the tolerance
    compare("press by L-BFGS", &lbfgs, (1000, 1e-4, 5e-3));
}

/// A plate turned at its upper end, pulled at its left side and pushed as a whole by curves of time, beside a
/// plane that follows another.
const CURVED: &str = r#"
version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "1 mm"
shapes = [{ add = "box", min = ["0 mm", "0 mm"], max = ["16 mm", "24 mm"] }]
[material]
youngs_modulus = "191 GPa"
law = "linear"
critical = { stretch = 1.01 }
[[boundary]]
name = "turned"
min = ["0 mm", "22 mm"]
max = ["16 mm", "24 mm"]
rotation = { point = ["0 mm", "0 mm"], angle = "0.01 rad" }
[[boundary]]
name = "pulled"
min = ["0 mm", "4 mm"]
max = ["2 mm", "8 mm"]
displacement = ["-0.1 mm", "free"]
curve = "sin(pi*t/2e-5)"
[[boundary]]
name = "pushed"
min = ["10 mm", "8 mm"]
max = ["14 mm", "12 mm"]
force = ["900 N", "0 N"]
curve = "(t/1e-5)^2"
[[body_force]]
acceleration = ["0 m/s^2", "-1e6 m/s^2"]
curve = "cos(pi*t/1e-5)"
[contact]
stiffness = 0
[[contact.plane]]
name = "press"
point = ["0 mm", "-0.1 mm"]
normal = [0.0, 1.0]
displacement = ["0 mm", "0.3 mm"]
curve = "t/2e-5"
[solver]
method = "verlet"
[dynamics]
density = "8000 kg/m^3"
end_time = "20 us"
records = 8
device = "cpu"
[output]
pictures = false
fields = false
"#;

#[test]
fn gpu_curves_and_rotations_as_on_the_host() {
    let host = compare("curves", CURVED, (0, 1e-9, 0.05));
    let last = host.outcomes[0].history.last().unwrap();
    assert!(last.broken > 10, "{} bonds broke", last.broken);
    assert!(host.outcomes[0].history.iter().any(|row| row.resting[0].force[1] > 1.0));
    let elastic = CURVED.replace("critical = { stretch = 1.01 }\n", "");
    compare("elastic curves", &elastic, (0, 1e-9, 1e-3));
    // equilibria at the times of a programme
    let slow = CURVED.replace("method = \"verlet\"", "method = \"adr\"\ndevice = \"cpu\"");
    let dynamics = &slow[slow.find("[dynamics]").unwrap()..slow.find("[output]").unwrap()];
    let time = "[[time.step]]\nduration = \"20 us\"\nincrements = 4\n";
    let slow = slow.replace(dynamics, time).replace("critical = { stretch = 1.01 }\n", "");
    // a programme begins without load
    let slow = slow.replace("-1e6 m/s^2\"]", "-1e6 m/s^2\"]\ndensity = \"8000 kg/m^3\"");
    let slow = slow
        .replace("cos(pi*t/1e-5)", "sin(pi*t/1e-5)")
        .replace("0.01 rad\" }", "0.01 rad\" }\ncurve = \"t/2e-5\"");
    let host = compare("equilibria of curves", &slow, (1, 1e-7, 0.02));
    assert_eq!(host.outcomes[0].history.len(), 4);
}

/// A block that is driven against another one, which a plane stops.
const BLOCKS: &str = r#"
version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "1 mm"
shapes = [
  { add = "box", min = ["0 mm", "0 mm"], max = ["10 mm", "14 mm"] },
  { add = "disk", centre = ["20 mm", "7 mm"], radius = "6 mm" },
]
[material]
youngs_modulus = "191 GPa"
law = "linear"
[[boundary]]
name = "driven"
min = ["0 mm", "0 mm"]
max = ["2 mm", "14 mm"]
displacement = ["5 mm", "0 mm"]
[contact]
[[contact.plane]]
name = "wall"
point = ["25.9 mm", "0 mm"]
normal = [-1.0, 0.1]
[solver]
method = "verlet"
[dynamics]
density = "8000 kg/m^3"
end_time = "30 us"
ramp = "30 us"
records = 6
device = "cpu"
[output]
pictures = false
fields = false
"#;

#[test]
fn gpu_pieces_touch_as_on_the_host() {
    let host = compare("blocks", BLOCKS, (0, 1e-9, 0.05));
    let last = host.outcomes[0].history.last().unwrap();
    let touches = |row: &StepRecord| row.contact.is_some_and(|contact| contact.pairs > 2);
    assert!(host.outcomes[0].history.iter().any(touches) && last.resting[0].force[0] < -1.0, "{last:?}");
    // cracks whose flanks touch, and pieces of them
    let touching = PRESSED.replace("stiffness = 0\n", "stiffness = 2\n");
    let host = compare("hammer on pieces", &touching, (0, 1e-9, 0.05));
    let last = host.outcomes[0].history.last().unwrap();
    assert!(last.broken > 10 && last.contact.unwrap().pairs > 5, "{last:?}");
    let broken = BLOCKS.replace("law = \"linear\"", "law = \"linear\"\ncritical = { stretch = 1.02 }");
    let host = compare("blocks that break", &broken, (0, 1e-9, 0.05));
    assert!(host.outcomes[0].history.last().unwrap().broken > 10);
}

/// A plate that is torn in two and closed again.
const TORN: &str = r#"
version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "1 mm"
shapes = [{ add = "box", min = ["0 mm", "0 mm"], max = ["16 mm", "22 mm"] }]
cracks = [{ from = ["-1 mm", "11 mm"], to = ["7.6 mm", "11 mm"] }]
[material]
youngs_modulus = "191 GPa"
law = "linear"
critical = { stretch = 1.03 }
[[boundary]]
name = "pulled"
min = ["0 mm", "19 mm"]
max = ["16 mm", "22 mm"]
displacement = ["0.1 mm", "0.4 mm"]
[[boundary]]
name = "fixed"
min = ["0 mm", "0 mm"]
max = ["16 mm", "3 mm"]
displacement = ["0 mm", "0 mm"]
[contact]
short_range = 15
[solver]
method = "adr"
path = [1.0, -1.5]
steps = 4
device = "cpu"
[output]
pictures = false
fields = false
"#;

/// Equilibria of a piece between another one and a plane, and of a plate that was torn.
#[test]
fn gpu_pieces_touch_in_equilibria() {
    let dynamics = &BLOCKS[BLOCKS.find("[dynamics]").unwrap()..BLOCKS.find("device").unwrap()];
    let fixed = "\n[[boundary]]\nname = \"fixed\"\nmin = [\"17 mm\", \"6 mm\"]\nmax = [\"19 mm\", \"8 mm\"]\n\
                 displacement = [\"0 mm\", \"0 mm\"]\n[contact]";
    let mut slow = BLOCKS.replace(dynamics, "steps = 8\n").replace("\n[contact]", fixed);
    // in small steps, as the law of the first trials must not become a table
    let others = [("20 mm", "18 mm"), ("25.9", "23.1"), ("5 mm", "2.4 mm"), ("verlet", "adr")];
    for (old, new) in others {
        slow = slow.replacen(old, new, 1);
    }
    for (name, text, broken) in [("torn plate", TORN, 100), ("blocks", slow.as_str(), 0)] {
        let host = compare(&format!("{name} by relaxation"), text, (1, 1e-9, 0.05));
        let rows = &host.outcomes[0].history;
        let last = rows.last().unwrap();
        assert!(last.contact.unwrap().pairs > 3 && last.broken >= broken, "{last:?}");
        assert!(last.resting.iter().all(|resting| resting.force[0] < -1.0), "{last:?}");
        let lbfgs = text.replace("method = \"adr\"", "method = \"lbfgs\"\ntolerance = 1e-6");
        compare(&format!("{name} by L-BFGS"), &lbfgs, (1000, 1e-4, 0.05));
    }
}

const DENSITY: f64 = 2.3;

/// A sheet with slits and a hole that a plane crushes, from a state; the state after row `stop`, or the last.
fn crush(device: Option<&Device>, state: Option<State<2>>, stop: Option<usize>) -> State<2> {
    let mut bonds = damaged();
    let stiffness = bonds.particles().iter().map(|&site| {
        let mut sum = 0.0;
        bonds.neighbours(site as usize, &mut |bond| sum += 2.0 * MODULUS * bond.weight / bond.length);
        sum
    });
    let stiffest = stiffness.fold(0.0, f64::max);
    let step = (DENSITY / (2.0 * stiffest)).sqrt();
    let solver = VelocityVerlet { records: 6, ..VelocityVerlet::new(DENSITY, 150.0 * step) };
    let modulus = 0.2 * stiffest * bonds.spacing().powi(2);
    let floor = RigidSurface::plane([0.0, 0.0], [0.1, 1.0]);
    let mut hammer = RigidSurface::plane([0.0, 0.0301], [0.1, -1.0]);
    hammer.velocity = [0.0, -0.0035 / (150.0 * step)];
    let surfaces = vec![floor, hammer].into_iter().map(|plane| RigidSurface { stiffness: 2.0, ..plane });
    let contact = Contact::new(&bonds, modulus, 2.0).unwrap();
    let outside = BodySurface::of_lattice(&bonds);
    let contact = contact.with_surfaces(&bonds, &outside, modulus, surfaces.collect()).unwrap();
    let mut state = state.unwrap_or_else(|| State::new(bonds.sites()));
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let loads = Loads::default();
    let mut system = System::new(&mut bonds, BondMaterial::new(&*law, MODULUS), &loads, &[]);
    system.breaking = Some(Breaking { criterion: 1.03.into(), policy: Policy::default() });
    system.contact = Some(contact);
    let mut kept = None;
    let mut watch = |status: &Status, state: &State<2>| {
        if status.restartable && stop.is_some_and(|stop| state.step == stop) {
            // through the checkpoint's own format
            kept = Some(postcard::to_stdvec(state).unwrap());
            return Err(Error::Device("stopped".to_owned()));
        }
        Ok(())
    };
    let finished = &mut |_: &dyn peri::bonds::Bonds<2>, _: &State<2>| Ok(());
    let result = match device {
        Some(device) => solver.solve_on(device, &mut system, &mut state, &mut watch, finished),
        None => solver.solve(&mut system, &mut state, &mut watch, finished),
    };
    assert_eq!(result.is_err(), stop.is_some(), "{result:?}");
    kept.map_or(state, |kept| postcard::from_bytes(&kept).unwrap())
}

fn damaged() -> LatticeBonds<2> {
    Body { surface: None, ..Body::damaged([24, 30], 1e-3, 3.015) }.build().lattice
}

/// Bits repeat, and a run that is stopped and continued agrees to rounding.
#[test]
fn gpu_contact_repeats_and_continues() {
    let host = crush(None, None, None);
    let last = host.history.last().unwrap();
    assert!(last.broken > 10 && last.contact.unwrap().pairs > 10, "{last:?}");
    let Some((precision, _)) = precisions().pop() else { return };
    let device = Device::portable().unwrap().with_precision(precision).unwrap();
    let whole = crush(Some(&device), None, None);
    assert!(whole == crush(Some(&device), None, None), "another run has other bits");
    let resumed = crush(Some(&device), Some(crush(Some(&device), None, Some(3))), None);
    for (name, other) in [("the host", &host), ("a continued run", &resumed)] {
        let components = |state: &State<2>| state.displacement.components().concat();
        let greatest = components(other).into_iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let pairs = components(&whole).into_iter().zip(components(other));
        let apart = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs())) / greatest;
        eprintln!("crushed sheet against {name}: {apart:.1e} of the greatest");
        if precision == Precision::Double {
            assert_eq!(whole.fracture.events, other.fracture.events, "{name}");
            evidence::at_most(&format!("crushed sheet against {name}"), apart, 1e-9);
        }
    }
}
