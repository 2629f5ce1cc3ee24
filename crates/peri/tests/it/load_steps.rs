//! Load steps bisected where bonds break, and loads that follow a snap-back.

use crate::bodies::hold;
use peri::bonds::{BodyGeometry, LatticeBonds, VolumeCorrection};
use peri::calibrate::{Space, modulus};
use peri::geometry::{Cut, Operation, Shape, lattice};
use peri::material::BondMaterial;
use peri::potential::{BondPotential, Law};
use peri::solver::{Breaking, Lbfgs, Loads, Method, Policy, State, System};

/// Critical stretch of [`dent`].
const CRITICAL: f64 = 2.9442;

/// Double-edge-notched tension as in `relaxation.rs`: 80 × 200 × 3 mm, cracks of length `notch`, pulled apart
/// until it breaks.
pub fn dent(spacing: f64, notch: f64) -> (LatticeBonds<2>, Loads<2>, Box<dyn BondPotential>, f64) {
    let (width, height, thickness) = (0.08, 0.2, 3e-3);
    let body =
        [Operation::Add(Shape::Box { min: [-width / 2.0, -height / 2.0], max: [width / 2.0, height / 2.0] })];
    let crack = |side: f64| Cut {
        corner: [side * (width / 2.0 + 1e-3), 0.0],
        edges: [[-side * (notch + 1e-3 - 1e-9), 0.0], [0.0; 2]],
    };
    let cells = lattice(&body, spacing, thickness).unwrap();
    let bonds = LatticeBonds::new(cells, 3.015, VolumeCorrection::None, &[crack(1.0), crack(-1.0)]).unwrap();
    let grip = height / 2.0 - 3.0 * spacing;
    let loads = hold(&bonds, |x| (x[1].abs() > grip).then(|| (3, [0.0, 0.1 * x[1].signum()])));
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let modulus = modulus(Space::PlaneStress, 0.6e6, 3.015 * spacing, thickness);
    (bonds, loads, law, modulus)
}

/// Tears the sheet with notches of `notch` in `steps`.
fn torn(notch: f64, steps: u32, refine: usize, snap_back: bool) -> State<2> {
    let (mut bonds, loads, law, modulus) = dent(4e-3, notch);
    let factors: Vec<f64> = (1..=steps).map(|k| f64::from(k) / f64::from(steps)).collect();
    let mut system = System::new(&mut bonds, BondMaterial::new(&*law, modulus), &loads, &factors);
    system.breaking = Some(Breaking { criterion: CRITICAL.into(), policy: Policy::AtEquilibrium });
    (system.refine, system.snap_back, system.stop_below) = (refine, snap_back, 0.02);
    let mut state = State::new(system.bonds.sites());
    let settings = Lbfgs { tolerance: 1e-5, ..Default::default() };
    settings.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap();
    state
}

/// Ten steps, bisected to a 64th where bonds break, agree with 640 steps: rows around the first break, peak,
/// number of broken bonds.
#[test]
fn cut_steps_find_what_short_ones_do() {
    let (cut, short) = (torn(0.02, 10, 64, false), torn(0.02, 640, 1, false));
    let step = 1.0 / 640.0;
    let first = |state: &State<2>| state.history.iter().position(|r| r.broken > 0).unwrap();
    let (row, of_short) = (first(&cut), first(&short));
    let [before, at] = [row - 1, row].map(|k| cut.history[k].factor);
    // each finds the first break within its own shortest step
    assert!(at - before < 1.3 * step && (at - short.history[of_short].factor).abs() < step, "{before} {at}");
    let peak = |state: &State<2>| {
        state.history.iter().max_by(|a, b| a.load.total_cmp(&b.load)).map(|r| (r.load, r.factor)).unwrap()
    };
    let ((load, place), (wanted, at)) = (peak(&cut), peak(&short));
    assert!((place - at).abs() < step && (load / wanted - 1.0).abs() < step, "{load} {wanted} {place} {at}");
    assert_eq!(cut.fracture.broken, short.fracture.broken);
    // every prescribed step is there, and no more than a few others
    let prescribed: Vec<usize> =
        (1..=cut.history.len()).filter_map(|rows| cut.control.prescribed(rows)).collect();
    assert!(prescribed.iter().copied().eq(1..=prescribed.len()) && prescribed.len() > 3, "{prescribed:?}");
    let iterations = [cut.counts.total_iterations, short.counts.total_iterations];
    assert!(
        2 * iterations[0] < iterations[1] && cut.history.len() < 60,
        "{iterations:?} {}",
        cut.history.len()
    );
}

/// The path of a sheet that snaps back contains the peaks of sheets with longer notches, and broken bonds
/// release the energy of the bonds across the ligament at the critical stretch.
#[test]
fn snap_back_follows_equilibria() {
    let (steps, refine) = (20, 64);
    let state = torn(0.02, steps, refine, true);
    let shortest = 1.0 / f64::from(steps) / refine as f64;
    // local peaks of the load, by the bonds broken until then
    for columns in 1..4 {
        let longer = torn(0.02 + 4e-3 * f64::from(columns), steps, refine, false);
        let peak = longer.history.iter().max_by(|a, b| a.load.total_cmp(&b.load)).unwrap();
        let gap =
            |factor: f64, load: f64| (factor / peak.factor - 1.0).abs().max((load / peak.load - 1.0).abs());
        let least = state.history.iter().map(|r| gap(r.factor, r.load)).fold(f64::INFINITY, f64::min);
        assert!(
            least < shortest / peak.factor,
            "{columns} columns: {} N at {}: {least}",
            peak.load,
            peak.factor
        );
    }
    let (bonds, _, law, modulus) = dent(4e-3, 0.02);
    let mut crossing = (0_u64, 0.0);
    for &site in bonds.particles() {
        let site = site as usize;
        let from = bonds.position(site);
        bonds.neighbours(site, &mut |bond| {
            if from[1] < 0.0 && from[1] + bond.bond[1] > 0.0 {
                crossing.0 += 1;
                crossing.1 +=
                    2.0 * modulus * bonds.volume(site) * bond.weight * bond.length * law.energy(CRITICAL);
            }
        });
    }
    assert_eq!(state.fracture.broken, crossing.0);
    // a bond breaks up to 1¼ shortest steps late, at about half of the full load, and its energy grows with
    // the load's square
    let beyond = state.fracture.released / crossing.1 - 1.0;
    assert!((0.0..4e-3).contains(&beyond), "{} J of {} J", state.fracture.released, crossing.1);
    // breaking at a held displacement adds no work: what is damped never falls, but for the trapezoidal rule
    // of an elastic step
    let damped: Vec<f64> = state.history.iter().map(|row| row.work - row.stored - row.released).collect();
    let least = damped.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::min);
    assert!(least > -1e-3 * state.work, "{least} J of {} J", state.work);
    // what was loaded to a peak at once is unloaded to where it parts
    let last = state.history.last().unwrap();
    assert!(
        last.factor < 0.25 && last.stored < 1e-6 * state.work && state.work > state.fracture.released,
        "{last:?}"
    );
}
