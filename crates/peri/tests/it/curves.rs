//! Loads that follow curves of time, and steps in sequence: work against stored energy, resumed runs, cracks
//! that appear in a stretched sheet.

use crate::bodies::Body;
use crate::load_steps::dent;
use evidence::{at_most, near};
use harness::case::{Case, Options, Run};
use harness::scene::Source;
use peri::bonds::{BodyGeometry, Bonds};
use peri::calibrate::Space;
use peri::field::Field;
use peri::material::{BondMaterial, EightChainSolid, NonlocalSolid};
use peri::program::run::{FinishedScene, Peri, run};
use peri::program::scene::Scene;
use peri::solver::{
    Amplitude, Breaking, CurvedLoads, CurvedRegion, Lbfgs, Loads, Method, Policy, State, Status, System,
    VelocityVerlet,
};
use std::f64::consts::PI;

/// Steps of the programme, of unit time.
const STEPS: usize = 24;

fn region(
    bonds: &dyn Bonds<2>,
    inside: impl Fn([f64; 2]) -> bool,
    value: [f64; 2],
    components: u8,
    amplitudes: [Amplitude; 2],
) -> CurvedRegion<2> {
    let within = |site: &u32| inside(bonds.position(*site as usize));
    let sites: Vec<u32> = bonds.particles().iter().copied().filter(within).collect();
    let values = vec![value; sites.len()];
    CurvedRegion::new(sites, values, amplitudes, components)
}

/// Loads of regions, the first ones held, the others pushed.
fn loads_of(bonds: &dyn Bonds<2>, held: Vec<CurvedRegion<2>>, pushed: Vec<CurvedRegion<2>>) -> Loads<2> {
    let mut loads = Loads { constrained: vec![0; bonds.sites()], ..Loads::default() };
    loads.displacement = (!held.is_empty()).then(|| Field::zeros(bonds.sites()));
    loads.body_force = (!pushed.is_empty()).then(|| Field::zeros(bonds.sites()));
    for region in &held {
        region.sites.iter().for_each(|&site| loads.constrained[site as usize] |= region.components);
        loads.held_regions.push(region.sites.clone());
    }
    loads.curved = Some(Box::new(CurvedLoads { held, pushed, ..CurvedLoads::default() }));
    loads.set_peaks();
    loads
}

/// Multiple that rises smoothly from 0 to 1 between two τ.
fn rise(from: f64, to: f64) -> Amplitude {
    Amplitude::new(move |part| {
        let place = ((part - from) / (to - from)).clamp(0.0, 1.0);
        let rate = 0.5 * PI * (PI * place).sin() / (to - from);
        (0.5 - 0.5 * (PI * place).cos(), rate)
    })
}

/// Compresses a block, shears it and pushes its side meanwhile; in equilibria, or as fast as waves.
fn load(moving: bool, start: Option<&State<2>>, saved: &mut Vec<State<2>>) -> State<2> {
    let mut built = Body::<2>::solid([12, 12], 0.1, 3.015).build();
    let bonds = &mut built.lattice;
    let solid = NonlocalSolid::new(EightChainSolid::new(Space::PlaneStrain, 1.0, 1e6, 5.0).unwrap());
    let rest = || Amplitude::new(|_| (0.0, 0.0));
    let held = vec![
        region(&*bonds, |[_, y]| y < 0.3, [0.0; 2], 3, [rest(), rest()]),
        region(&*bonds, |[_, y]| y > 0.9, [0.3, -0.1], 3, [rise(0.4, 1.0), rise(0.0, 0.5)]),
    ];
    let pushed = vec![region(&*bonds, |[x, _]| x < 0.3, [0.5, 0.0], 0, [rise(0.2, 0.8), rest()])];
    let loads = loads_of(&*bonds, held, pushed);
    let factors: Vec<f64> = (1..=STEPS).map(|step| step as f64 / STEPS as f64).collect();
    let mut state = start.cloned().unwrap_or_else(|| State::new(bonds.sites()));
    let amplitude = |time: f64| (time / 20.0, 1.0 / 20.0);
    let mut system = System::new(bonds, solid, &loads, &factors);
    let mut seen = 0;
    let mut watch = |status: &Status, state: &State<2>| {
        seen += 1;
        if status.restartable && state.step > 0 && seen % 7 == 0 {
            saved.push(state.clone());
        }
        Ok(())
    };
    let finished = &mut |_: &dyn Bonds<2>, _: &_| Ok(());
    let solved = if moving {
        system.amplitude = Some(&amplitude);
        let method = VelocityVerlet { records: 20, safety: 0.5, ..VelocityVerlet::new(1.0, 20.0) };
        method.solve(&mut system, &mut state, &mut watch, finished)
    } else {
        system.times = factors.clone().into();
        let method = Lbfgs { tolerance: 1e-8, ..Lbfgs::default() };
        method.solve(&mut system, &mut state, &mut watch, finished)
    };
    solved.unwrap();
    state
}

/// The work of displacements and forces that follow different curves is the energy of the body; a resumed run
/// has equal bits, on any number of threads.
#[test]
fn work_of_curves_is_stored_and_runs_resume() {
    for (moving, most) in [(false, 2e-3), (true, 2e-3)] {
        let mut saved = Vec::new();
        let whole = load(moving, None, &mut saved);
        let last = whole.history.last().unwrap();
        let energy = last.stored + last.kinetic;
        assert!(last.stored > 0.0 && last.work > 0.0);
        at_most("curves_energy_balance", (energy / last.work - 1.0).abs(), most);
        // √(0.3² + 0.1²)
        near("curves_reach", last.displacement, 0.1_f64.sqrt(), 1e-12);
        assert!(saved.len() > 1, "{}", saved.len());
        for state in saved.iter().step_by(saved.len().div_ceil(2)) {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            let again = pool.install(|| load(moving, Some(state), &mut Vec::new()));
            assert!(again == whole, "moving {moving}: from step {}", state.step);
        }
    }
}

/// The work of a displacement that grows with t² is the energy of the sheet at the load at which its first
/// bond breaks, where the second of two increments is cut.
#[test]
fn work_of_curves_after_cuts_is_stored() {
    let (mut bonds, proportional, law, modulus) = dent(4e-3, 0.02);
    let rising = || Amplitude::new(|part| (part * part, 2.0 * part));
    let grip = |side: f64| {
        region(&bonds, move |[_, y]| side * y > 0.088, [0.0, 0.02 * side], 3, [rising(), rising()])
    };
    let loads = loads_of(&bonds, vec![grip(-1.0), grip(1.0)], Vec::new());
    assert_eq!(loads.constrained, proportional.constrained);
    let mut system = System::new(&mut bonds, BondMaterial::new(&*law, modulus), &loads, &[0.5, 1.0]);
    system.breaking = Some(Breaking { criterion: 1.3.into(), policy: Policy::AtEquilibrium });
    (system.refine, system.stop_below) = (64, 0.9);
    let mut state = State::new(system.bonds.sites());
    let settings = Lbfgs { tolerance: 1e-8, ..Default::default() };
    settings.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap();
    let first = state.history.iter().position(|row| row.broken > 0).unwrap();
    let intact = &state.history[first - 1];
    assert!(first > 1 && intact.factor > 0.5, "{first} {}", intact.factor);
    at_most("cut_curve_energy_balance", (intact.work / intact.stored - 1.0).abs(), 1e-2);
}

/// Runs a scene.
pub fn solve(text: &str) -> FinishedScene {
    let directory = tempfile::tempdir().unwrap();
    let source = Source::new("scene.toml", text);
    let scene = source.parse::<Scene>().unwrap_or_else(|error| panic!("{}", error.render()));
    let mut own = Run::new(const { &Peri::PROGRAM }, &source, Options::new(directory.path()));
    run(&source, &scene, &mut own).unwrap_or_else(|error| panic!("{error}"))
}

/// A sheet that is stretched and then cut is the sheet that is cut and then stretched; a grip that is held,
/// and one that the next step moves on, go on from where they are.
#[test]
fn a_stretched_sheet_is_cut() {
    let crack = "[{ from = [\"-1 mm\", \"5 mm\"], to = [\"5 mm\", \"5 mm\"] }]";
    let scene = |cracks: &str, steps: &str| {
        format!(
            r#"version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "0.5 mm"
shapes = [{{ add = "box", min = ["0 mm", "0 mm"], max = ["20 mm", "10 mm"] }}]
{cracks}
[material]
youngs_modulus = "1 MPa"
law = "linear"
[[boundary]]
name = "low"
side = "y-"
displacement = ["0 mm", "0 mm"]
[[boundary]]
name = "high"
side = "y+"
displacement = ["0 mm", "0.2 mm"]
[solver]
tolerance = 1e-8
[output]
pictures = false
fields = false
{steps}"#
        )
    };
    let low = "{ name = \"low\", side = \"y-\", displacement = [\"0 mm\", \"0 mm\"] }";
    let high = |u: &str| format!("{{ name = \"high\", side = \"y+\", displacement = [{u}] }}");
    let solver = "solver = { tolerance = 1e-8 }";
    let hold = high("\"hold\", \"hold\"");
    let cut = format!("[[step]]\nboundary = [{low}, {hold}]\ncracks = {crack}\n{solver}\n");
    let before = solve(&scene(&format!("cracks = {crack}"), ""));
    let after = solve(&scene("", &cut));
    let [before, after] = [&before, &after].map(|run| run.outcomes[0].history.last().unwrap().clone());
    near("cut_energy", after.stored / before.stored, 1.0, 1e-6);
    near("cut_force", after.reactions[1][1] / before.reactions[1][1], 1.0, 1e-6);
    // the grip moves on by as much again, in two increments of equal work
    let further = high("\"0 mm\", \"0.4 mm\"");
    let text =
        format!("[[step]]\nboundary = [{low}, {further}]\nsolver = {{ steps = 2, tolerance = 1e-8 }}\n");
    let twice = solve(&scene("", &text));
    let history = &twice.outcomes[0].history;
    assert_eq!(history.len(), 3);
    near("continued_reach", history[1].displacement, 0.3e-3, 1e-12);
    near("continued_reach", history[2].displacement, 0.4e-3, 1e-12);
    at_most("continued_balance", (history[2].stored / history[2].work - 1.0).abs(), 1e-2);
}
