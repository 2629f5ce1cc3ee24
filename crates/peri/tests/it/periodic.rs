//! Cells with periodic sides: homogeneous states without surface, of any size; waves of the lattice.

use crate::bodies::{MODULUS, hold};
use crate::dynamics::{DENSITY, once, run};
use peri::bonds::{BodyGeometry, BondDamage, BondForces, LatticeBonds, Stencil, VolumeCorrection, force};
use peri::field::Field;
use peri::geometry::{Cut, Operation, Shape, lattice};
use peri::material::{BondMaterial, virial};
use peri::potential::{BondPotential, Law};
use peri::solver::{Breaking, Lbfgs, Loads, Method, Policy, State, System};
use peri::stress::{BallVolume, StressInput, StressMethod, SurfaceCompensation, piola_on_lattice};
use std::f64::consts::PI;

const SPACING: f64 = 0.1;

fn cell<const D: usize>(cells: [usize; D], periodic: [bool; D]) -> LatticeBonds<D> {
    cut_cell(cells, periodic, &[])
}

fn cut_cell<const D: usize>(cells: [usize; D], periodic: [bool; D], cuts: &[Cut<D>]) -> LatticeBonds<D> {
    let max = cells.map(|count| count as f64 * SPACING);
    let body = [Operation::Add(Shape::Box { min: [0.0; D], max })];
    let lattice = lattice(&body, SPACING, 1.0).unwrap();
    LatticeBonds::with_periodic_sides(lattice, 3.015, VolumeCorrection::None, (cuts, None), periodic).unwrap()
}

/// Energy density Σ kθ|ξ|φ V and stress Σ kθ V t m ⊗ ξ of a homogeneous lattice.
fn homogeneous<const D: usize>(law: &dyn BondPotential, rows: [[f64; D]; D]) -> (f64, [[f64; D]; D]) {
    let (mut energy, mut stress) = (0.0, [[0.0; D]; D]);
    let volume = SPACING.powi(D as i32);
    for offset in Stencil::<D>::new(3.015).offsets {
        let bond = offset.map(|o| f64::from(o) * SPACING);
        let moved: [f64; D] =
            std::array::from_fn(|a| bond[a] + (0..D).map(|b| rows[a][b] * bond[b]).sum::<f64>());
        let [length, now] = [bond, moved].map(|x| x.iter().map(|x| x * x).sum::<f64>().sqrt());
        energy += MODULUS * volume * length * law.energy(now / length);
        let pull = MODULUS * volume * law.tension(now / length) / now;
        for (row, moved) in stress.iter_mut().zip(moved) {
            row.iter_mut().zip(bond).for_each(|(entry, bond)| *entry += pull * moved * bond);
        }
    }
    (energy, stress)
}

/// A strained cell stores the energy of the infinite lattice, whatever its size, also one of a single
/// particle or thinner than the horizon: nothing is left to iterate.
fn check_homogeneous<const D: usize>(cells: &[[usize; D]]) {
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let entry = |a: usize, b: usize| 0.15 - 0.11 * a as f64 + 0.04 * b as f64;
    let rows: [[f64; D]; D] = std::array::from_fn(|a| std::array::from_fn(|b| entry(a, b)));
    let (energy, stress) = homogeneous(&*law, rows);
    for &cells in cells {
        let mut bonds = cell(cells, [true; D]);
        let loads = Loads { mean_gradient: Some(rows), ..Loads::default() };
        let (material, factors) = (BondMaterial::new(&*law, MODULUS), [1.0]);
        let mut system = System::new(&mut bonds, material, &loads, &factors);
        let mut state = State::new(system.bonds.sites());
        let solver = Lbfgs { tolerance: 1e-8, ..Lbfgs::default() };
        solver.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap();
        let volume = cells.iter().map(|&count| count as f64 * SPACING).product::<f64>();
        let row = &state.history[0];
        // the law is fitted to 1e-9
        assert!(
            (row.stored / volume / energy - 1.0).abs() < 1e-8,
            "{cells:?}: {} {energy}",
            row.stored / volume
        );
        let rate: f64 = (0..D).flat_map(|a| (0..D).map(move |b| stress[a][b] * rows[a][b])).sum();
        let pull = row.load * row.displacement / volume;
        assert!((pull / rate - 1.0).abs() < 1e-8, "{cells:?}: {pull} {rate}");
        assert_eq!(state.counts.total_iterations, 0, "{cells:?}");
    }
}

#[test]
fn a_uniform_cell_has_no_surface() {
    check_homogeneous([[1, 1], [2, 5], [8, 8], [23, 9]].as_slice());
    check_homogeneous([[1, 4, 2], [6, 5, 7]].as_slice());
}

/// From a random start a cell returns to the homogeneous state, and its coarse level helps.
#[test]
fn a_cell_relaxes_to_the_homogeneous_state() {
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let rows = [[0.1, 0.05], [0.0, -0.05]];
    let (energy, _) = homogeneous(&*law, rows);
    let mut bonds = cell([40, 24], [true; 2]);
    let loads = Loads { mean_gradient: Some(rows), ..Loads::default() };
    let (material, factors) = (BondMaterial::new(&*law, MODULUS), [1.0]);
    let mut system = System::new(&mut bonds, material, &loads, &factors);
    let mut state = State::new(system.bonds.sites());
    let mut random = crate::bodies::Random(7);
    for &site in system.bonds.particles() {
        state.displacement.set(site as usize, std::array::from_fn(|_| 0.2 * SPACING * random.next()));
    }
    let solver = Lbfgs { tolerance: 1e-8, ..Lbfgs::default() };
    solver.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap();
    let volume = 40.0 * 24.0 * SPACING * SPACING;
    assert!((state.history[0].stored / volume / energy - 1.0).abs() < 1e-8);
    assert!((1..200).contains(&state.counts.total_iterations), "{}", state.counts.total_iterations);
}

/// A mean gradient is refused where it moves a component that is held, and a cell turned inside out.
#[test]
fn gradients_that_no_cell_can_have() {
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let solve = |rows: [[f64; 2]; 2], held: u8| {
        let mut bonds = cell([6, 6], [true; 2]);
        let mut constrained = vec![0; bonds.sites()];
        constrained[bonds.particles()[0] as usize] = held;
        let displacement = Some(Field::zeros(bonds.sites()));
        let loads = Loads { mean_gradient: Some(rows), constrained, displacement, ..Loads::default() };
        let mut system = System::new(&mut bonds, BondMaterial::new(&*law, MODULUS), &loads, &[1.0]);
        let mut state = State::new(system.bonds.sites());
        let solver = Lbfgs { tolerance: 1e-8, ..Lbfgs::default() };
        let solved = solver.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(()));
        solved.map_err(|error| error.to_string())
    };
    let along_x = [[0.01, 0.0], [0.0, 0.0]];
    assert!(solve(along_x, 1).unwrap_err().contains("held or loaded in a component"));
    solve(along_x, 2).unwrap();
    let error = solve([[-2.0, 0.0], [0.0, 0.0]], 2).unwrap_err();
    assert!(error.contains("at load factor 0.50 the cell has 0.000 of its volume"), "{error}");
}

/// Stresses of particles have the mean of the virial, and forces of a cell sum to zero, in any state.
#[test]
fn stresses_of_particles_have_the_mean_of_the_cell() {
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let mut bonds = cell([9, 7], [true; 2]);
    let loads = Loads { mean_gradient: Some([[0.1, 0.05], [0.0, -0.05]]), ..Loads::default() };
    let (material, factors) = (BondMaterial::new(&*law, MODULUS), [1.0]);
    let mut random = crate::bodies::Random(3);
    let mut displacement = Field::zeros(bonds.sites());
    for &site in bonds.particles() {
        displacement.set(site as usize, std::array::from_fn(|_| 0.2 * SPACING * random.next()));
    }
    System::new(&mut bonds, material.clone(), &loads, &factors).prepare(&mut displacement);
    let sum = virial(&material, &vec![(); bonds.sites()], &bonds, &displacement);
    let fit = crate::bodies::fit(&*law, [0.3, 1.7]);
    let (modulus, missing) = (MODULUS, SurfaceCompensation::Bonds);
    let loaded = StressInput { displacement: &displacement, fit: (&fit).into(), modulus, missing };
    let stress = piola_on_lattice(&bonds, &loaded, StressMethod::OnePoint, BallVolume::Whole);
    for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let mean: f64 = stress.iter().map(|stress| stress[a][b] * SPACING * SPACING).sum();
        assert!((mean - sum[a][b]).abs() < 1e-8 * sum[0][0].abs(), "{a}{b}: {mean} {}", sum[a][b]);
    }
    bonds.set_law(&fit, MODULUS);
    let mut forces = Field::zeros(bonds.sites());
    force(&bonds, &displacement, &mut forces);
    let each = || bonds.particles().iter().map(|&site| forces.get(site as usize));
    let size: f64 = each().map(|f| f[0].abs()).sum();
    for d in 0..2 {
        let total: f64 = each().map(|f| f[d]).sum();
        assert!(total.abs() < 1e-13 * size, "{total} of {size}");
    }
}

/// A standing wave in a row, periodic along it: at any time the exact solution of velocity Verlet with the
/// frequency of the lattice, and its energy.
#[test]
fn a_standing_wave_has_the_frequency_of_the_lattice() {
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let count = 12_u32;
    let mut bonds = cell([count as usize, 1], [true, false]);
    let volume = SPACING * SPACING;
    for waves in 1..=5 {
        let q = 2.0 * PI * f64::from(waves) / (f64::from(count) * SPACING);
        let each = |k: i32| (1.0 - (q * f64::from(k) * SPACING).cos()) / (f64::from(k) * SPACING);
        let frequency = (12.0 * MODULUS * volume / DENSITY * (1..=3).map(each).sum::<f64>()).sqrt();
        let mut state = State::new(bonds.sites());
        let shape = |x: f64| 1e-3 * (q * x).cos();
        for &site in bonds.particles() {
            let x = bonds.position(site as usize)[0];
            state.displacement.set(site as usize, [shape(x), 0.0]);
        }
        let (time, steps) = (20.3 * 2.0 * PI / frequency, 4000.0);
        let step = time / steps;
        run(&once(time, step), &mut bonds, &*law, &Loads::default(), &mut state).unwrap();
        let phase = 2.0 * (0.5 * frequency * step).asin() * steps;
        for &site in bonds.particles() {
            let exact = shape(bonds.position(site as usize)[0]) * phase.cos();
            let found = state.displacement.get(site as usize)[0];
            // 128 rad to the fit's 1e-9, and rounding of 4000 steps
            assert!((found - exact).abs() < 1e-6 * 1e-3, "{waves} waves: {found} {exact}");
        }
        let row = state.history.last().unwrap();
        let error = ((row.kinetic + row.stored) / row.work - 1.0).abs();
        assert!(error < (frequency * step).powi(2), "{waves} waves: energy off by {error}");
    }
}

/// Tears a cell that is held at the ends of y: broken bonds, detached particles, stored energy and load.
fn tear<const D: usize>(mut bonds: LatticeBonds<D>) -> [f64; 4] {
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let height = bonds.lattice().cells[1] as f64 * SPACING;
    let end = |y: f64| if y < 0.15 { -1.0 } else { f64::from(u8::from(y > height - 0.15)) };
    let pulled = |place: [f64; D]| {
        let side = end(place[1]);
        let moved = std::array::from_fn(|d| if d == 1 { 0.014 * side } else { 0.0 });
        (side != 0.0).then_some(((1 << D) - 1, moved))
    };
    let loads = hold(&bonds, pulled);
    let mut state = State::new(bonds.sites());
    let factors = [0.5, 0.75, 1.0];
    let mut system = System::new(&mut bonds, BondMaterial::new(&*law, MODULUS), &loads, &factors);
    system.breaking = Some(Breaking { criterion: 1.03.into(), policy: Policy::default() });
    let solver = Lbfgs { tolerance: 1e-9, ..Lbfgs::default() };
    solver.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap();
    assert_eq!(system.bonds.one_sided(), None);
    let row = state.history.last().unwrap();
    [state.fracture.broken as f64, state.fracture.detached as f64, row.stored, row.load]
}

fn assert_near(found: [f64; 4], expected: [f64; 4], what: &str) {
    for (found, expected) in found.into_iter().zip(expected) {
        assert!((found - expected).abs() <= 1e-6 * expected.abs(), "{what}: {found} {expected}");
    }
}

/// A plate that repeats itself through its thickness tears alike with a layer and with five.
#[test]
fn layers_of_a_periodic_thickness_tear_alike() {
    let plate = |layers: usize| {
        let crack = Cut { corner: [-0.1, 0.7, -1.0], edges: [[0.6, 0.0, 0.0], [0.0, 0.0, 9.0], [0.0; 3]] };
        tear(cut_cell([16, 14, layers], [false, false, true], &[crack]))
    };
    let one = plate(1);
    assert!(one[0] > 30.0, "{one:?}");
    assert_near(plate(5), one.map(|value| 5.0 * value), "five layers");
}

/// A crack tears a cell alike wherever it lies, also across the side, without a place where it is missing.
#[test]
fn a_crack_across_a_periodic_side() {
    let sheet = |from: f64| {
        let cut = Cut::segment([from, 0.7], [from + 0.8, 0.7]);
        let bonds = cut_cell([20, 14], [true, false], &[cut]);
        (bonds.directed_bonds(), tear(bonds))
    };
    let (bonds, middle) = sheet(0.63);
    assert!(middle[0] > 20.0, "{middle:?}");
    for from in [1.63, -0.37, 0.03, 1.23] {
        let (found, torn) = sheet(from);
        assert_eq!(found, bonds);
        assert_near(torn, middle, &format!("a crack from {from}"));
    }
}

/// Bonds at their limit by the mean deformation alone break at both of their ends.
#[test]
fn a_strained_cell_breaks_from_both_ends() {
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    for strain in [0.1, 0.123456, 1.0 / 3.0] {
        let mut bonds = cell([7, 5], [true, true]);
        let loads = Loads { mean_gradient: Some([[strain, 0.0], [0.0, 0.0]]), ..Loads::default() };
        let (material, factors) = (BondMaterial::new(&*law, MODULUS), [1.0]);
        let mut system = System::new(&mut bonds, material, &loads, &factors);
        // bonds along x, to the last bits
        system.breaking = Some(Breaking { criterion: (1.0 + strain).into(), policy: Policy::default() });
        let mut state = State::new(system.bonds.sites());
        let solver = Lbfgs { tolerance: 1e-6, ..Lbfgs::default() };
        let ended = solver.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(()));
        assert!(ended.is_ok(), "{ended:?}");
        assert_eq!(system.bonds.one_sided(), None, "{strain}");
    }
}
