//! Preconditioned L-BFGS against dynamic relaxation: the same equilibria, for less work.

use peri::bonds::{Bonds, LatticeBonds, VolumeCorrection};
use peri::calibrate::{Space, modulus};
use peri::geometry::{Operation, Shape, lattice};
use peri::potential::{BondPotential, Law};
use peri::solver::{AdaptiveDynamicRelaxation, Loads, PreconditionedLbfgs, State, Support, System};
use std::time::Instant;

/// The plate with a hole of `cases/ch2/plate-with-hole`.
struct Plate {
    bonds: LatticeBonds<2>,
    loads: Loads<2>,
    law: Box<dyn BondPotential>,
    modulus: f64,
}

impl Plate {
    fn new(spacing: f64) -> Self {
        let (half, thickness, ratio) = (0.5, 10e-3, 3.015);
        let body = [
            Operation::Add(Shape::Box { min: [-half; 2], max: [half; 2] }),
            Operation::Cut(Shape::Ball { centre: [0.0; 2], radius: 0.06 }),
        ];
        let cells = lattice(&body, spacing, thickness).unwrap();
        let bonds = LatticeBonds::new(cells, ratio, VolumeCorrection::None, &[]).unwrap();
        let depth = 3.0 * spacing;
        let side = |sign: f64| -> (Vec<u32>, Support<2>) {
            let inside = |&slot: &u32| sign * bonds.position(slot as usize)[0] > half - depth;
            let slots = bonds.particles().iter().copied().filter(inside).collect();
            (slots, Support { displacement: [None; 2], body_force: [sign * 1e3 / depth, 0.0] })
        };
        let loads = Loads::new(bonds.slots(), &[side(1.0), side(-1.0)]);
        let law = Law::Subtract.build(720.0, 1200.0, false).unwrap();
        let modulus = modulus(Space::PlaneStress, 1e6, ratio * spacing, thickness);
        Self { bonds, loads, law, modulus }
    }
}

#[test]
#[ignore]
fn explore() {
    let spacing: f64 = std::env::var("DX").map_or(4.0, |x| x.parse().unwrap()) * 1e-3;
    let get = |name: &str, value: f64| std::env::var(name).map_or(value, |x| x.parse().unwrap());
    let mut plate = Plate::new(spacing);
    if std::env::var("ADR").is_ok() {
        let mut state = State::new(plate.bonds.slots());
        let mut system = System::new(&mut plate.bonds, &*plate.law, plate.modulus, &plate.loads, &[1.0]);
        let start = Instant::now();
        let adr = AdaptiveDynamicRelaxation { tolerance: 1e-5, ..Default::default() };
        adr.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap();
        eprintln!("ADR dx {spacing}: {} evaluations, {:.2} s", state.evaluations, start.elapsed().as_secs_f64());
    }
    let settings = PreconditionedLbfgs {
        tolerance: 1e-5,
        memory: get("M", 10.0) as usize,
        coarsening: get("C", 6.0),
        weight: get("W", 1.0),
        ..Default::default()
    };
    let mut state = State::new(plate.bonds.slots());
    let mut system = System::new(&mut plate.bonds, &*plate.law, plate.modulus, &plate.loads, &[1.0]);
    let start = Instant::now();
    let verbose = std::env::var("V").is_ok();
    let result = settings.solve(
        &mut system,
        &mut state,
        &mut |status, state| {
            if verbose {
                eprintln!("{} {:.3e} {}", status.iteration, status.residual, state.evaluations);
            }
            Ok(())
        },
        &mut |_, _| Ok(()),
    );
    eprintln!(
        "L-BFGS dx {spacing} {settings:?}: {} iterations, {} evaluations, {:.2} s {result:?}",
        state.total_iterations,
        state.evaluations,
        start.elapsed().as_secs_f64()
    );
}
