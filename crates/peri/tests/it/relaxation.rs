//! Dynamic relaxation: the DENT specimen of `dent.py`, work counts, equal bits for any number of threads.

use crate::bodies::{Body, hold, relax};
use peri::bonds::{BodyGeometry, Bonds, LatticeBonds, VolumeCorrection};
use peri::calibrate::{Space, modulus};
use peri::geometry::{Cut, Operation, Shape, lattice};
use peri::potential::{BondPotential, Law};
use peri::solver::{DynamicRelaxation, Loads, State};

const THICKNESS: f64 = 3e-3;
const RATIO: f64 = 3.015;

/// Double-edge-notched tension: 80 × 200 × 3 mm, two cracks of `notch` from the sides, three layers clamped
/// at both ends and pulled apart by 20 mm; E = 0.6 MPa.
struct Dent {
    bonds: LatticeBonds<2>,
    loads: Loads<2>,
    law: Box<dyn BondPotential>,
    modulus: f64,
    spacing: f64,
}

impl Dent {
    fn new(spacing: f64, notch: f64) -> Self {
        let (width, height) = (0.08, 0.2);
        let body = [Operation::Add(Shape::Box {
            min: [-width / 2.0, -height / 2.0],
            max: [width / 2.0, height / 2.0],
        })];
        // a bond through the very tip counts as crossing the crack here and as intact in dent.py: end it just
        // before
        let crack = |side: f64| Cut {
            corner: [side * (width / 2.0 + 1e-3), 0.0],
            edges: [[-side * (notch + 1e-3 - 1e-9), 0.0], [0.0; 2]],
        };
        let cells = lattice(&body, spacing, THICKNESS).unwrap();
        let cuts = [crack(1.0), crack(-1.0)];
        let bonds = LatticeBonds::new(cells, RATIO, VolumeCorrection::None, &cuts).unwrap();
        let grip = height / 2.0 - 3.0 * spacing;
        let loads = hold(&bonds, |x| (x[1].abs() > grip).then(|| (3, [0.0, 0.01 * x[1].signum()])));
        let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
        let modulus = modulus(Space::PlaneStress, 0.6e6, RATIO * spacing, THICKNESS);
        Self { bonds, loads, law, modulus, spacing }
    }

    fn relax(&mut self, tolerance: f64, factors: &[f64]) -> State<2> {
        let solver = DynamicRelaxation { tolerance, ..Default::default() };
        let mut state = State::new(self.bonds.sites());
        relax(&solver, &mut self.bonds, (&*self.law, self.modulus), &self.loads, factors, &mut state)
            .unwrap();
        state
    }

    /// Returns the mean reaction of both grips, N.
    fn pull(&self, state: &State<2>) -> f64 {
        let volume = self.spacing * self.spacing * THICKNESS;
        let each = self.bonds.particles().iter().map(|&s| {
            let held = self.loads.constrained(s as usize) != 0;
            let sign = -self.bonds.position(s as usize)[1].signum();
            if held { 0.5 * volume * sign * state.force.get(s as usize)[1] } else { 0.0 }
        });
        each.sum()
    }
}

#[test]
fn dent_at_four_millimetres() {
    let mut dent = Dent::new(4e-3, 0.02);
    let steps: Vec<f64> = (1..=10).map(|k| f64::from(k) / 10.0).collect();
    let state = dent.relax(1e-6, &steps);
    // formulation.md: 14.069 N ± 0.1 % at tol 1e-6
    let pull = dent.pull(&state);
    assert!((pull / 14.069 - 1.0).abs() < 1e-3, "{pull} N");
    eprintln!("dent, dx = 4: {pull:.4} N, {} iterations in 10 steps", state.counts.total_iterations);
    // formulation.md: 150–195 iterations to 1e-3 and 310–330 to 1e-6 for one elastic step, from half the
    // affine strain (`s7_adr.py`); from the whole of it, as here, 76 and 139 were measured
    for (tolerance, most) in [(1e-3, 100), (1e-6, 180)] {
        let state = dent.relax(tolerance, &[1.0]);
        let (pull, iterations) = (dent.pull(&state), state.counts.total_iterations);
        eprintln!("dent, dx = 4, one step to {tolerance:.0e}: {pull:.4} N, {iterations} iterations");
        assert!(iterations <= most, "{iterations} iterations to {tolerance:.0e}");
        // the same equilibrium in one step as in ten
        assert!((pull / 14.069 - 1.0).abs() < 1e-3 + tolerance, "{pull} N");
    }
}

#[test]
fn dent_at_two_millimetres() {
    // formulation.md: P(20 mm) for a = 12, 20, 28 mm, ± 1 %
    for (notch, expected) in [(0.012, 15.32), (0.02, 13.73), (0.028, 11.57)] {
        let mut dent = Dent::new(2e-3, notch);
        let state = dent.relax(1e-3, &[0.5, 1.0]);
        let pull = dent.pull(&state);
        eprintln!(
            "dent, dx = 2, a = {notch}: {pull:.3} N, {} iterations in 2 steps",
            state.counts.total_iterations
        );
        assert!((pull / expected - 1.0).abs() < 0.01, "a = {notch}: {pull} N");
    }
}

/// Bits do not depend on threads, with four work items, on a lattice and a cloud.
#[test]
fn bits_do_not_depend_on_threads() {
    let run = |threads: usize, cloud: bool| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut built = Body::<2>::damaged([120, 115], 0.1, RATIO).build();
            let bonds: &mut dyn Bonds<2> = if cloud { &mut built.cloud } else { &mut built.lattice };
            let loads = hold(bonds, |x| (x[0] < 0.3 || x[0] > 11.7).then(|| (3, [0.05 * x[0], 0.01 * x[0]])));
            let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
            let mut state = State::new(bonds.sites());
            let solver = DynamicRelaxation { tolerance: 1e-2, ..Default::default() };
            relax(&solver, bonds, (&*law, 1.0), &loads, &[0.5, 1.0], &mut state).unwrap();
            assert!(bonds.sites() > 3 * peri::field::CHUNK);
            let bits: Vec<u64> =
                state.displacement.components().into_iter().flatten().map(|x| x.to_bits()).collect();
            (state.counts.total_iterations, bits)
        })
    };
    for cloud in [false, true] {
        let one = run(1, cloud);
        assert!(one.0 > 20, "{} iterations", one.0);
        for threads in [2, 3] {
            assert!(run(threads, cloud) == one, "{threads} threads differ from one, cloud: {cloud}");
        }
    }
}

/// A notched sheet pulled by a tenth, under every stress-free law.
#[test]
fn every_stress_free_law_converges() {
    let mut built = Body::<2>::damaged([30, 24], 0.1, RATIO).build();
    for law in Law::ALL {
        let potential = law.build(100.0, 1200.0, law.rescales()).unwrap();
        if !potential.is_stress_free() {
            continue;
        }
        let bonds: [&mut dyn Bonds<2>; 2] = [&mut built.lattice, &mut built.cloud];
        let mut iterations = Vec::new();
        for bonds in bonds {
            let loads = hold(bonds, |x| (x[0] < 0.3 || x[0] > 2.7).then(|| (3, [0.1 * x[0], 0.0])));
            let solver = DynamicRelaxation {
                tolerance: 1e-6,
                mass_safety: law.mass_safety(),
                accept: 0.0,
                max_iterations: 2000,
            };
            let mut state = State::new(bonds.sites());
            relax(&solver, bonds, (&*potential, 1.0), &loads, &[0.5, 1.0], &mut state)
                .unwrap_or_else(|error| panic!("{}: {error}", law.name()));
            iterations.push(state.counts.total_iterations);
        }
        eprintln!("{}: {iterations:?} iterations in two steps to 1e-6", law.name());
        // both paths see the same forces to rounding and so take the same way, but for the last iteration or
        // two
        assert!(iterations[0].abs_diff(iterations[1]) <= 4, "{}: {iterations:?}", law.name());
    }
}
