//! A cracked sheet, pulled until it tears: load against displacement, bond by bond.

use peri::bonds::{Bonds, LatticeBonds, VolumeCorrection, fragments};
use peri::calibrate::{Space, modulus};
use peri::geometry::{Operation, Shape, lattice};
use peri::material::BondMaterial;
use peri::potential::Law;
use peri::solver::{Breaking, Lbfgs, Loads, Policy, State, Support, System};

fn main() -> Result<(), peri::Error> {
    // 60 mm × 40 mm × 1 mm, particles 2 mm apart; a slot of 20 mm from the left edge, as wide as the horizon
    let (spacing, thickness, ratio) = (2e-3, 1e-3, 3.015);
    let body = [
        Operation::Add(Shape::Box { min: [0.0, 0.0], max: [60e-3, 40e-3] }),
        Operation::Cut(Shape::Box { min: [0.0, 16e-3], max: [20e-3, 24e-3] }),
    ];
    let mut bonds =
        LatticeBonds::new(lattice(&body, spacing, thickness)?, ratio, VolumeCorrection::None, &[])?;
    let law = Law::ChainOffset.build(720.0, 1200.0, false)?;
    let modulus = modulus(Space::PlaneStress, 1e6, bonds.horizon(), thickness);

    // three layers at each end are held; the upper ones move by 14 mm in 14 steps
    let layer = |from: f64, to: f64| -> Vec<u32> {
        let inside = |&slot: &u32| (from..to).contains(&bonds.position(slot as usize)[1]);
        bonds.particles().iter().copied().filter(inside).collect()
    };
    let held = |y| Support { displacement: [Some(0.0), Some(y)], body_force: [0.0; 2] };
    let loads = Loads::new(bonds.slots(), &[(layer(0.0, 6e-3), held(0.0)), (layer(34e-3, 1.0), held(14e-3))]);
    let steps: Vec<f64> = (1..=14).map(|step| f64::from(step) / 14.0).collect();

    let mut state = State::new(bonds.slots());
    let mut system = System::new(&mut bonds, BondMaterial::new(&*law, modulus), &loads, &steps);
    system.breaking = Some(Breaking { stretch: 1.6.into(), policy: Policy::AtEquilibrium });
    let method = Lbfgs { tolerance: 1e-4, ..Default::default() };
    method.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(()))?;
    drop(system);

    for record in &state.history {
        println!(
            "{:5.1} mm  {:7.3} N  {:4} broken bonds",
            1e3 * record.displacement,
            record.load,
            record.broken
        );
    }
    let peak = state.history.iter().map(|record| record.load).fold(0.0, f64::max);
    println!("peak {peak:.2} N, {} pieces", fragments(&bonds));
    assert!(peak > 0.0 && state.history.last().is_some_and(|last| last.broken > 0));
    Ok(())
}
