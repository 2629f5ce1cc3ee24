//! Tests of rubbers with branches in CalculiX 2.20, if `CALCULIX_SOURCE` names its source build.

use evidence::hosts;
use polycore::tensor::Voigt;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use umat::RelaxingRubber;

/// Links CalculiX with the library.
fn program() -> Option<&'static Path> {
    static BUILT: OnceLock<Option<(tempfile::TempDir, PathBuf)>> = OnceLock::new();
    let built = BUILT.get_or_init(|| {
        let source = hosts::calculix()?;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ccx");
        let library = hosts::static_library("umat");
        hosts::link_calculix(&source, &[&library], &["-u,umat_user_", "-u,umat_"], &path);
        Some((folder, path))
    });
    built.as_ref().map(|(_, path)| path.as_path())
}

/// Forces along y of all increments, N.
fn forces(program: &Path, deck: &str) -> Vec<f64> {
    let folder = tempfile::tempdir().unwrap();
    let (_, results) = hosts::run_calculix(program, folder.path(), deck);
    let rows = results.lines().map(|line| line.split_whitespace().map(str::parse::<f64>));
    let numbers = rows.filter_map(|row| row.collect::<Result<Vec<f64>, _>>().ok());
    numbers.filter(|row| row.len() == 3).map(|row| row[1]).collect()
}

/// Stretch of the bar in the example at a time.
fn stretch(time: f64) -> f64 {
    1.0 + time.min(1.0)
}

/// Nominal stress of a bar along axis 1 with free sides after each increment.
fn bar(constants: &[f64], duration: f64, count: usize, stretch: impl Fn(f64) -> f64) -> Vec<f64> {
    let rubber = RelaxingRubber::new("neo-hookean", constants).unwrap();
    let mut state = vec![0.0; rubber.states()];
    let mut side = 1.0_f64;
    let step = |n: usize| {
        let along = stretch(duration * n as f64);
        for _ in 0..50 {
            let c = Voigt::new(along * along, side * side, side * side, 0.0, 0.0, 0.0);
            let mut end = state.clone();
            let (s, tangent, _) = rubber.material(&mut end, &c, duration, 293.15).unwrap();
            // S₂₂ of equal sides: dS₂₂/dC₂₂ + dS₂₂/dC₃₃, ℂ = 2 dS/dC
            let slope = 0.5 * (tangent[(1, 1)] + tangent[(1, 2)]);
            let change = -s[1] / slope;
            if change.abs() < 1e-14 {
                state = end;
                return s[0] * along;
            }
            side = (side * side + change).sqrt();
        }
        panic!("no side at a stretch of {along}")
    };
    (1..=count).map(step).collect()
}

/// Tests `examples/relaxation.inp`, which the guide names: the force of every increment is that of a bar of
/// the material point; also through `umat_`, which CalculiX calls in the form of Abaqus for materials that
/// begin with `ABAQUSNL` (DDSDDE has another meaning there: more iterations).
#[test]
fn a_cube_relaxes() {
    let Some(program) = program() else { return };
    let deck = include_str!("../examples/relaxation.inp");
    let constants = [200.0, 0.4, 0.0, 0.0, 0.0, 0.0, 1.0, 0.8, 1.0, 1.6, 0.0];
    let expected = bar(&constants, 0.1, 100, stretch);
    let found = forces(program, deck);
    assert_eq!(found.len(), 100);
    let off = |found: &[f64]| {
        let pairs = found.iter().zip(&expected);
        pairs.map(|(found, expected)| (found / expected - 1.0).abs()).fold(0.0, f64::max)
    };
    eprintln!("force after 1 s and 10 s: {} and {} N", found[9], found[99]);
    evidence::at_most("a cube that relaxes in CalculiX beside the material point", off(&found), 1e-5);
    let abaqus = forces(program, &deck.replace("USER_VISCOELASTIC", "ABAQUSNLVISCOELASTIC"));
    assert_eq!(abaqus.len(), 100);
    evidence::at_most("the same through umat_ of Abaqus' form", off(&abaqus), 1e-4);
}

/// Creep that CalculiX has itself, ε̇ = A σⁿ of Mises stresses (`*CREEP, LAW=NORTON`), n = 1 and 3, at
/// strains of 0.1 %: a branch with constant η = 1/(3A), and one of Bergström and Boyce with c = 0 and
/// γ̇₀/τ̂^m = A (3/2)^((m+1)/2), beside an equilibrium law of a millionth.
#[test]
fn creep_of_the_host() {
    let Some(program) = program() else { return };
    let example = include_str!("../examples/relaxation.inp");
    let head = &example[..example.find("** K and mu").unwrap()];
    let tail = &example[example.find("*SOLID SECTION").unwrap()..];
    let step = tail.replace("*STATIC, DIRECT\n0.1, 10.", "*VISCO, CETOL=1., DIRECT\n0.02, 4.");
    let step =
        step.replace("PULLED,2,2,1.", "PULLED,2,2,0.001").replace("USER_VISCOELASTIC_NEO_HOOKEAN", "NAME");
    // G = 1 MPa, K = 5 MPa
    let (shear, bulk) = (1.0, 5.0);
    let young = 9.0 * bulk * shear / (3.0 * bulk + shear);
    let poisson = 0.5 * young / shear - 1.0;
    for (power, factor) in [(1.0, 0.3), (3.0, 1e5)] {
        let own = format!(
            "*MATERIAL, NAME=NAME\n*ELASTIC\n{young},{poisson}\n*CREEP, LAW=NORTON\n{factor},{power},0.\n"
        );
        let theirs = forces(program, &format!("{head}{own}{step}"));
        let flow = if power == 1.0 {
            format!("1., {}", 1.0 / (3.0 * factor))
        } else {
            let stress = (factor * 1.5_f64.powf(0.5 * (power + 1.0))).powf(-1.0 / power);
            format!("3., 1., {stress}, {power}, 0., 0.01")
        };
        let count = if power == 1.0 { 11 } else { 15 };
        let branch = format!("{bulk}, 1e-6, 0., 0., 0., 0., 1., {shear}\n{flow}, 0.");
        let user = format!(
            "*MATERIAL, NAME=USER_VISCOELASTIC_NEO_HOOKEAN\n*USER MATERIAL, CONSTANTS={count}\n{branch}\n\
             *DEPVAR\n10\n"
        );
        let step = step.replace("NAME\n*NSET", "USER_VISCOELASTIC_NEO_HOOKEAN\n*NSET");
        let ours = forces(program, &format!("{head}{user}{step}"));
        assert_eq!((ours.len(), theirs.len()), (200, 200));
        let most = theirs.iter().fold(0.0_f64, |most, force| most.max(force.abs()));
        let pairs = ours.iter().zip(&theirs);
        let off = pairs.map(|(ours, theirs)| (ours - theirs).abs() / most).fold(0.0, f64::max);
        eprintln!("n = {power}: at the end {:?} N, CalculiX' own {:?} N", ours.last(), theirs.last());
        // strains of 0.1 % apart, and both of first order in the increment
        evidence::at_most(&format!("creep of CalculiX, n = {power}, over the greatest force"), off, 5e-3);
    }
}
