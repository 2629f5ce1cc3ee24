//! The energy surface correction on the plate with a hole: 1 m × 1 m, radius 60 mm, tractions on three layers
//! (`s12_mosurf.py`).

use crate::bodies::{fit, relax};
use peri::bonds::{BodyGeometry, BondForces, LatticeBonds, VolumeCorrection};
use peri::calibrate::{Space, modulus, stiffness_1111};
use peri::correction::surface_factors;
use peri::geometry::{Operation, Shape, lattice};
use peri::potential::Law;
use peri::solver::{DynamicRelaxation, Loads, State, Support};
use peri::stress::{
    BallVolume, StressInput, StressMethod, StressTensor, SurfaceCompensation, piola_on_lattice,
};

/// Returns E ε/σ between (±400, 300) mm, and the largest σ11/σ beside the hole: hardy, one-point.
fn plate(spacing: f64, volume: VolumeCorrection, surface: bool) -> [f64; 3] {
    let (half, ratio, thickness) = (0.5, 3.015, 0.01);
    let body = [
        Operation::Add(Shape::Box { min: [-half; 2], max: [half; 2] }),
        Operation::Cut(Shape::Ball { centre: [0.0; 2], radius: 0.06 }),
    ];
    let cells = lattice(&body, spacing, thickness).unwrap();
    let mut bonds = LatticeBonds::new(cells, ratio, volume, &[]).unwrap();
    let modulus = modulus(Space::PlaneStress, 1.0, ratio * spacing, thickness);
    if surface {
        let factors = surface_factors(&bonds, modulus, stiffness_1111(Space::PlaneStress, 1.0));
        bonds.set_factors(factors);
    }
    let (layers, stress) = (3.0 * spacing, 1e-3);
    let side = |sign: f64| -> (Vec<u32>, Support<2>) {
        let there = |&s: &u32| sign * bonds.position(s as usize)[0] > half - layers;
        let members = bonds.particles().iter().copied().filter(there).collect();
        (members, Support { displacement: [None; 2], body_force: [sign * stress / layers, 0.0] })
    };
    let loads = Loads::new(bonds.sites(), &[side(1.0), side(-1.0)]);
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let solver = DynamicRelaxation { tolerance: 1e-4, ..Default::default() };
    let mut state = State::new(bonds.sites());
    relax(&solver, &mut bonds, (&*law, modulus), &loads, &[1.0], &mut state).unwrap();
    let sites: Vec<usize> = bonds.particles().iter().map(|&s| s as usize).collect();
    let nearest = |x: f64, y: f64| {
        let distance = |&s: &usize| {
            let p = bonds.position(s);
            (p[0] - x).abs() + (p[1] - y).abs()
        };
        sites.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()
    };
    let (right, left) = (nearest(0.4, 0.3), nearest(-0.4, 0.3));
    let length = bonds.position(right)[0] - bonds.position(left)[0];
    let strain = (state.displacement.get(right)[0] - state.displacement.get(left)[0]) / length;
    let fit = fit(&*law, state.stretches.fitted);
    let loaded = StressInput {
        displacement: &state.displacement,
        fit: (&fit).into(),
        modulus,
        missing: SurfaceCompensation::Bonds,
    };
    let largest = |tensors: Vec<StressTensor<2>>| {
        // the two columns beside the axis, averaged row by row
        let mut rows = std::collections::BTreeMap::<i64, f64>::new();
        for (&site, p) in sites.iter().zip(&tensors) {
            let [x, y] = bonds.position(site);
            if x.abs() < 0.6 * spacing && y > 0.0 && y < 0.06 + 8.0 * spacing {
                *rows.entry((y / spacing * 2.0).round() as i64).or_default() += 0.5 * p[0][0] / stress;
            }
        }
        rows.values().copied().fold(0.0, f64::max)
    };
    let hardy = largest(piola_on_lattice(&bonds, &loaded, StressMethod::BallShare, BallVolume::Particles));
    let one_point = largest(piola_on_lattice(&bonds, &loaded, StressMethod::OnePoint, BallVolume::Particles));
    eprintln!(
        "dx = {spacing}, {volume:?}, surface {surface}: strain {:.4}, hardy {hardy:.3}, one-point \
         {one_point:.3}, {} its",
        strain / stress,
        state.counts.total_iterations
    );
    [strain / stress, hardy, one_point]
}

/// The correction reduces the error of the global modulus from 20.6 % to 3.4 %, with volume factor (printed
/// digits: ± 0.001); hardy 2.47 and one-point 2.64 at dx = 5 with the surface correction, volume factor off
/// (± 1 %).
#[test]
fn correction_on_the_plate() {
    let [strain, ..] = plate(0.005, VolumeCorrection::Linear, false);
    assert!((strain - 1.206).abs() < 1e-3, "{strain}");
    let [strain, hardy, _] = plate(0.005, VolumeCorrection::Linear, true);
    assert!((strain - 1.034).abs() < 1e-3, "{strain}");
    assert!((hardy / 2.47 - 1.0).abs() < 0.01, "{hardy}");
    let [_, hardy, one_point] = plate(0.005, VolumeCorrection::None, true);
    assert!(
        (hardy / 2.47 - 1.0).abs() < 0.01 && (one_point / 2.64 - 1.0).abs() < 0.01,
        "{hardy} {one_point}"
    );
}

/// Table of the plate, dx = 10, without corrections: ± 1 %.
#[test]
fn plate_without_corrections() {
    let [_, hardy, one_point] = plate(0.01, VolumeCorrection::None, false);
    assert!(
        (hardy / 1.83 - 1.0).abs() < 0.01 && (one_point / 2.14 - 1.0).abs() < 0.01,
        "{hardy} {one_point}"
    );
}
