//! Answers of scenes in closed form: energies of particles, loads on held particles, signs of histories.

use crate::bodies::Body;
use harness::case::{Case, Options, Run};
use harness::output::vtkhdf;
use harness::scene::Source;
use peri::bonds::BodyGeometry;
use peri::field::Field;
use peri::program::run::{FinishedScene, Peri, run};
use peri::program::scene::Scene;
use peri::solver::Loads;
use std::path::Path;

const BONDS: &str = "[material]\nyoungs_modulus = \"1 MPa\"\nlaw = \"linear\"\n";
pub const RUBBER: &str = "[material.solid]\nlaw = \"correspondence\"\n\
                          constitutive = { model = \"neo-hookean\", \
                          parameters = { shear_modulus = \"0.4 MPa\" }, bulk_modulus = \"4 MPa\" }\n";

/// A strip of 20 × 6 particles, held at its left end.
pub fn strip(material: &str, rest: &str) -> String {
    format!(
        r#"version = 1
program = "peri"
[body]
space = "plane-strain"
thickness = "1 mm"
spacing = "1 mm"
shapes = [{{ add = "box", min = ["0 mm", "0 mm"], max = ["20 mm", "6 mm"] }}]
{material}
[[boundary]]
name = "foot"
side = "x-"
displacement = ["0 mm", "0 mm"]
{rest}
"#
    )
}

pub fn solve(text: &str, output: &Path) -> FinishedScene {
    let source = Source::new("scene.toml", text);
    let scene = source.parse::<Scene>().unwrap_or_else(|error| panic!("{}", error.render()));
    let mut own = Run::new(const { &Peri::PROGRAM }, &source, Options::new(output));
    run(&source, &scene, &mut own).unwrap_or_else(|error| panic!("{error}"))
}

/// Displacements and loads of a run.
fn history(text: &str) -> Vec<[f64; 2]> {
    let directory = tempfile::tempdir().unwrap();
    let finished = solve(text, directory.path());
    finished.outcomes[0].history.iter().map(|row| [row.displacement, row.load]).collect()
}

#[test]
fn energy_densities_add_up_to_the_stored_energy() {
    let pulled = "[[boundary]]\nside = \"x+\"\ndisplacement = [\"2 mm\", \"1 mm\"]\n[output]\npictures = \
                  false\nenergy = true\n";
    for material in [BONDS, RUBBER] {
        let directory = tempfile::tempdir().unwrap();
        let finished = solve(&strip(material, pulled), directory.path());
        let frames = vtkhdf::read(directory.path().join("dx-1mm_m-3.015.vtkhdf")).unwrap();
        let densities = frames.data(frames.len() - 1, "energy_density").unwrap();
        assert_eq!(densities.len(), 120);
        let (sum, stored) = (1e-9 * densities.iter().sum::<f64>(), finished.report.scalar("stored_energy"));
        // fields are written in single precision
        assert!((sum / stored.unwrap() - 1.0).abs() < 1e-6, "{sum} of {stored:?} J");
    }
}

/// A load on held particles goes into the support and leaves the search for equilibrium as it is.
#[test]
fn loads_on_held_particles_do_not_end_the_search() {
    let tip = "[[boundary]]\nside = \"x+\"\nforce = [\"0 N\", \"0.001 N\"]\n[output]\npictures = false\n";
    let bolt = "[[boundary]]\nside = \"x-\"\nforce = [\"0 N\", \"-1000 N\"]\n";
    for method in ["lbfgs", "adr"] {
        let solver = format!("[solver]\nmethod = \"{method}\"\n");
        let directory = tempfile::tempdir().unwrap();
        let deflection = |extra: &str| {
            let finished = solve(&strip(BONDS, &format!("{tip}{extra}{solver}")), directory.path());
            finished.report.scalar("largest_displacement").unwrap()
        };
        let (with, without) = (deflection(bolt), deflection(""));
        assert!(without > 1e-6 && (with / without - 1.0).abs() < 1e-6, "{method}: {with} and {without} m");
    }
}

/// A weight of 3 N against a push of 2 N is a load of 3 N; a region whose particles are pushed both ways
/// counts with its resultant.
#[test]
fn applied_forces_count_in_one_direction() {
    let bonds = Body::<2>::solid([6, 5], 1.0, 3.015).build().lattice;
    let volume: f64 = bonds.particles().iter().map(|&site| bonds.volume(site as usize)).sum();
    let mut body = Field::zeros(bonds.sites());
    bonds.particles().iter().for_each(|&site| body.set(site as usize, [0.0, -3.0 / volume]));
    let mut loads = Loads { body_force: Some(body), ..Loads::default() };
    let applied = loads.applied(&bonds, &[[0.0, 2.0]]);
    assert!(applied[0] == 0.0 && (applied[1] - 3.0).abs() < 1e-12, "{applied:?}");
    let (first, second) = (bonds.particles()[0], bonds.particles()[1]);
    let body = loads.body_force.as_mut().unwrap();
    bonds.particles().iter().for_each(|&site| body.set(site as usize, [0.0; 2]));
    body.set(first as usize, [0.0, 5.0 / bonds.volume(first as usize)]);
    body.set(second as usize, [0.0, -1.0 / bonds.volume(second as usize)]);
    assert!((loads.applied(&bonds, &[])[1] - 5.0).abs() < 1e-12);
    loads.pushed_regions = vec![vec![first, second]];
    assert!((loads.applied(&bonds, &[])[1] - 4.0).abs() < 1e-12);
}

/// A curve of all loads gives the history of the same load factors; forces alone move their points.
#[test]
fn histories_of_curves_are_those_of_factors() {
    let ends = [
        "displacement = [\"0.5 mm\", \"0.2 mm\"]",
        "traction = [\"20 kPa\", \"0 Pa\"]",
        "force = [\"0.05 N\", \"0.01 N\"]",
    ];
    let rest = "tolerance = 1e-9\n[output]\npictures = false\n";
    let factors = format!("[solver]\npath = [1, 0, -1]\nsteps = 6\n{rest}");
    let times = format!("[[time.step]]\nduration = \"3 s\"\nincrements = 6\n[solver]\n{rest}");
    for end in ends {
        let grip = format!("[[boundary]]\nname = \"grip\"\nside = \"x+\"\n{end}\n");
        let curve = "curve = \"min(t, 2 - t)\"\n";
        let by_factor = history(&strip(RUBBER, &format!("{grip}{factors}")));
        let by_curve = history(&strip(RUBBER, &format!("{grip}{curve}{times}")));
        assert_eq!(by_curve.len(), 6);
        let [way, load] = [0, 1].map(|k| by_factor.iter().map(|row| row[k].abs()).fold(0.0, f64::max));
        for (found, expected) in by_curve.iter().zip(&by_factor) {
            assert!((found[0] - expected[0]).abs() < 1e-6 * way, "{end}: {by_curve:?} {by_factor:?}");
            assert!((found[1] - expected[1]).abs() < 1e-5 * load, "{end}: {by_curve:?} {by_factor:?}");
        }
        assert!(by_curve[5][0] < 0.0 && by_curve[5][1] < 0.0);
    }
}

/// A region that is free in every component has no reaction, and leaves those of others their names.
#[test]
fn free_regions_leave_reactions_their_names() {
    let rest = |free: &str| {
        format!(
            r#"[[boundary]]
name = "middle"
min = ["8 mm", "0 mm"]
max = ["12 mm", "6 mm"]
{free}
force = ["0.1 N", "0 N"]
[[boundary]]
name = "right"
side = "x+"
displacement = ["0.5 mm", "0 mm"]
[output]
pictures = false
"#
        )
    };
    let reactions = |free: &str| {
        let directory = tempfile::tempdir().unwrap();
        let outcome = solve(&strip(RUBBER, &rest(free)), directory.path()).outcomes.remove(0);
        (outcome.regions.clone(), outcome.history[0].reactions.clone())
    };
    let plain = reactions("");
    assert_eq!(plain.0, ["foot", "right"]);
    assert_eq!(reactions("displacement = [\"free\", \"free\"]\n"), plain);
}

/// A plane that stands inside the body at the start brings energy that its motion does not account for.
#[test]
fn energy_without_work_is_reported() {
    let press = |depth: &str| {
        format!(
            "[[boundary]]\nname = \"guide\"\nside = \"y-\"\ndisplacement = [\"free\", \"0 mm\"]\n\
             [contact]\nstiffness = 0\n[[contact.plane]]\nname = \"press\"\npoint = [\"{depth}\", \"0 mm\"]\n\
             normal = [-1, 0]\ndisplacement = [\"-0.1 mm\", \"0 mm\"]\n\
             [solver]\nmethod = \"lbfgs\"\nsteps = 2\n[output]\npictures = false\nfields = false\n"
        )
    };
    for (depth, warns) in [("20 mm", false), ("19.7 mm", true)] {
        let directory = tempfile::tempdir().unwrap();
        let finished = solve(&strip(RUBBER, &press(depth)), directory.path());
        let warnings = finished.outcomes[0].warnings.join("\n");
        assert_eq!(warnings.contains("step 1: the body stores"), warns, "{warnings}");
    }
}
