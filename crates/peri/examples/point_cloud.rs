//! Pulls a strip of points without a lattice, step by step: points, bonds, material, loads, solution.

use peri::bonds::{BodyGeometry, CloudBonds, VolumeCorrection};
use peri::calibrate::{Space, modulus};
use peri::material::BondMaterial;
use peri::potential::Law;
use peri::solver::{Lbfgs, Loads, Method, State, Support, System};

pub(crate) fn main() -> Result<(), peri::Error> {
    // 40 × 12 points 1 mm apart, each shifted by up to 0.2 mm; 1 mm thick
    let (thickness, horizon, youngs_modulus) = (1e-3, 3.015e-3, 1e6);
    let shift = |k: usize, step: f64| 0.4e-3 * ((k as f64 * step).fract() - 0.5);
    let place =
        |k: usize| [1e-3 * (k % 40) as f64 + shift(k, 0.618), 1e-3 * (k / 40) as f64 + shift(k, 0.732)];
    let points: Vec<[f64; 2]> = (0..480).map(place).collect();
    let volumes = vec![1e-6 * thickness; points.len()];
    let mut bonds = CloudBonds::new(&points, &volumes, thickness, horizon, VolumeCorrection::None, &[])?;

    let kt = modulus(Space::PlaneStress, youngs_modulus, horizon, thickness);
    let material = BondMaterial::new(Law::ChainOffset.build(720.0, 1200.0, false)?, kt);
    let grip = |from: f64, to: f64, displacement: f64| {
        let inside = |&&site: &&u32| (from..to).contains(&bonds.position(site as usize)[0]);
        let sites = bonds.particles().iter().filter(inside).copied().collect();
        (sites, Support { displacement: [Some(displacement), Some(0.0)], body_force: [0.0; 2] })
    };
    let loads = Loads::new(bonds.sites(), &[grip(-1.0, 2.6e-3, 0.0), grip(36.4e-3, 1.0, 2e-3)]);

    let mut state = State::new(bonds.sites());
    Lbfgs::default().run(&mut System::new(&mut bonds, material, &loads, &[1.0]), &mut state)?;
    let load = state.history.last().map_or(0.0, |record| record.load);
    println!("{load:.3} N");
    // about E times the strain between the grips over the section
    assert!((load / (youngs_modulus * 2e-3 / 34e-3 * 12e-6) - 1.0).abs() < 0.2);
    Ok(())
}
