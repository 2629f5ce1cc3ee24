//! Bodies without reactions: moved by one grip, cut in two, without loads. A residual over reactions alone
//! would never converge.

use crate::bodies::{Body, MODULUS, hold};
use peri::bonds::{BodyGeometry, Bonds, LatticeBonds, VolumeCorrection};
use peri::geometry::{Cut, Operation, Shape, lattice};
use peri::material::BondMaterial;
use peri::potential::Law;
use peri::solver::{
    DynamicRelaxation, Equilibrium, Lbfgs, LbfgsSolver, Loads, RelaxationSolver, State, System, load_stepping,
};

const WAY: [f64; 2] = [0.3, 1.0];

/// Returns both methods.
fn methods(tolerance: f64) -> [(&'static str, Box<dyn Equilibrium<2>>); 2] {
    let max_iterations = 5000;
    let plain = DynamicRelaxation { tolerance, max_iterations, ..Default::default() };
    let memory = Lbfgs { tolerance, max_iterations, ..Default::default() };
    [("adr", Box::new(RelaxationSolver::new(plain))), ("lbfgs", Box::new(LbfgsSolver::new(memory)))]
}

fn sheet(cuts: &[Cut<2>]) -> LatticeBonds<2> {
    let shape = Shape::Box { min: [0.0; 2], max: [0.06, 0.1] };
    let cells = lattice(&[Operation::Add(shape)], 4e-3, 1.0).unwrap();
    LatticeBonds::new(cells, 3.015, VolumeCorrection::None, cuts).unwrap()
}

fn solve(
    method: &mut dyn Equilibrium<2>,
    bonds: &mut LatticeBonds<2>,
    loads: &Loads<2>,
    factors: &[f64],
    state: &mut State<2>,
) -> Result<(), peri::Error> {
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let mut system = System::new(bonds, BondMaterial::new(&*law, MODULUS), loads, factors);
    load_stepping(method, &mut system, state, &mut |_, _| Ok(()), &mut |_, _| Ok(()))
}

/// Moves the grip y > 88 mm by U along [`WAY`], without other supports.
fn grip(bonds: &dyn Bonds<2>, far: f64) -> Loads<2> {
    hold(bonds, |x| (x[1] > 0.088).then_some((0b11, WAY.map(|w| far * w))))
}

#[test]
fn a_body_moved_by_one_grip() {
    let factors: Vec<f64> = (1..=10).map(|s| f64::from(s) / 10.0).collect();
    for far in [1e-9, 1e-3, 1.0, 1e3, 1e6] {
        for (name, mut method) in methods(1e-10) {
            let mut bonds = sheet(&[]);
            let loads = grip(&bonds, far);
            let mut state = State::new(bonds.sites());
            solve(&mut *method, &mut bonds, &loads, &factors, &mut state).unwrap();
            assert!(
                state.counts.total_iterations <= 10,
                "{name}, U = {far}: {} iterations",
                state.counts.total_iterations
            );
            let size = far * WAY[0].hypot(WAY[1]);
            for &site in bonds.particles() {
                let u = state.displacement.get(site as usize);
                let off = (u[0] - far * WAY[0]).hypot(u[1] - far * WAY[1]);
                assert!(off < 1e-12 * size, "{name}, U = {far}: {off:e} m from rigid");
            }
        }
    }
}

/// A start with the grip far from the rest ends in a rigid motion to the tolerance; with reactions alone as
/// reference the error would be 15 to 36 % at 1e-3, or the search would never end.
#[test]
fn a_strained_start_comes_to_rest() {
    for (tolerance, most) in [(1e-3, 0.02), (1e-6, 2e-5)] {
        for (name, mut method) in methods(tolerance) {
            let mut bonds = sheet(&[]);
            let loads = grip(&bonds, 1e-3);
            let mut state = State::new(bonds.sites());
            // the first guess moves all with the grip: what is free is put back before
            for &site in bonds.particles().iter().filter(|&&s| loads.constrained(s as usize) == 0) {
                state.displacement.set(site as usize, WAY.map(|w| -1e-3 * w));
            }
            solve(&mut *method, &mut bonds, &loads, &[1.0], &mut state).unwrap();
            for &site in bonds.particles() {
                let u = state.displacement.get(site as usize);
                let off = (u[0] - 1e-3 * WAY[0]).hypot(u[1] - 1e-3 * WAY[1]);
                assert!(off < most * 1.04e-3, "{name} at {tolerance}: {off:e} m from rigid");
            }
        }
    }
}

/// Two halves with a grip each follow their grips without forces.
#[test]
fn halves_go_with_their_grips() {
    let cut = Cut { corner: [-1.0, 0.052], edges: [[2.0, 0.0], [0.0; 2]] };
    for (name, mut method) in methods(1e-6) {
        let mut bonds = sheet(std::slice::from_ref(&cut));
        let loads = hold(&bonds, |x| match x[1] {
            y if y > 0.088 => Some((0b11, [0.0, 2e-3])),
            y if y < 0.012 => Some((0b11, [0.0; 2])),
            _ => None,
        });
        let mut state = State::new(bonds.sites());
        solve(&mut *method, &mut bonds, &loads, &[0.5, 1.0], &mut state).unwrap();
        for &site in bonds.particles() {
            let up = if bonds.position(site as usize)[1] > 0.052 { 2e-3 } else { 0.0 };
            let u = state.displacement.get(site as usize);
            let off = u[0].hypot(u[1] - up);
            assert!(off < 2e-3 * 1e-4, "{name}: {off:e} m from rigid");
        }
    }
}

/// A body without loads and moving grips is in equilibrium at once.
#[test]
fn a_body_at_rest_stays() {
    for (name, mut method) in methods(1e-10) {
        let body = Body::<2>::solid([6, 5], 1e-3, 3.015);
        let mut bonds = body.build().lattice;
        let loads = hold(&bonds, |x| (x[1] < 1e-3).then_some((0b11, [0.0; 2])));
        let mut state = State::new(bonds.sites());
        solve(&mut *method, &mut bonds, &loads, &[0.5, 1.0], &mut state).unwrap();
        assert_eq!(state.counts.total_iterations, 0, "{name}");
    }
}
