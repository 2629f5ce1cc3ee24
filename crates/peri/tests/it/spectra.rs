//! Spectra and manufactured solutions of solids: modes of free blocks, plane waves in the infinite lattice,
//! and the order of convergence at finite strains, against an independent program
//! (`docs/reference/correspondence`) and closed forms.

use evidence::{at_most, near};
use peri::bonds::{BodyGeometry, Bonds, LatticeBonds, VolumeCorrection};
use peri::calibrate::Space;
use peri::field::Field;
use peri::geometry::{Operation, Shape, lattice};
use peri::material::{
    BodyTensor, Correspondence, Deformation, NonlocalSolid, PointLaw, Pointwise, SolverMaterial,
};
use peri::solver::{Lbfgs, Loads, Method, State, System};
use polycore::constitutive::hyperelastic::{Compressible, NeoHookean, Volumetric};
use std::f64::consts::PI;

pub type NeoHooke<const D: usize> = Correspondence<Compressible<NeoHookean>, D>;

/// Returns W = ½μ(I₁ − 3 − 2 ln J) + ¼κ(J² − 1 − 2 ln J), μ = 1, with the stabilisation a.
pub fn neo_hooke<const D: usize>(space: Space, bulk: f64, stabilisation: f64) -> NeoHooke<D> {
    let volumetric = Volumetric::Ciarlet { lame: bulk - 2.0 / 3.0 };
    let law = Compressible::new(NeoHookean::new(1.0).unwrap(), volumetric).unwrap();
    Correspondence::stabilised(law, space, stabilisation).unwrap()
}

/// Builds a block of particles from the origin on.
fn block<const D: usize>(cells: [usize; D], spacing: f64) -> LatticeBonds<D> {
    let max = cells.map(|n| n as f64 * spacing);
    let body = [Operation::Add(Shape::Box { min: [0.0; D], max })];
    LatticeBonds::new(lattice(&body, spacing, 1.0).unwrap(), 3.015, VolumeCorrection::None, &[]).unwrap()
}

pub fn forces<const D: usize>(
    material: &mut dyn SolverMaterial<D>,
    bonds: &dyn Bonds<D>,
    displacement: &Field<D>,
) -> Field<D> {
    material.prepare(bonds, displacement);
    let mut force = Field::zeros(bonds.sites());
    for (chunk, mut part) in force.chunks_mut().into_iter().enumerate() {
        material.force(bonds, displacement, chunk, &mut part, None);
    }
    force
}

/// Returns the eigenvalues of −∂f/∂u at rest of a free block, ascending.
fn modes<const D: usize>(cells: [usize; D], space: Space, bulk: f64, stabilisation: f64) -> Vec<f64> {
    let bonds = block(cells, 1.0);
    let mut material = Pointwise::new(NonlocalSolid::new(neo_hooke::<D>(space, bulk, stabilisation)), &bonds);
    let sites: Vec<usize> = bonds.particles().iter().map(|&site| site as usize).collect();
    let step = 1e-5;
    let mut matrix = nalgebra::DMatrix::zeros(D * sites.len(), D * sites.len());
    let mut displacement = Field::zeros(bonds.sites());
    for (column, &site) in sites.iter().enumerate() {
        for d in 0..D {
            let moved = |sign: f64| std::array::from_fn(|e| if e == d { sign * step } else { 0.0 });
            displacement.set(site, moved(1.0));
            let ahead = forces(&mut material, &bonds, &displacement);
            displacement.set(site, moved(-1.0));
            let behind = forces(&mut material, &bonds, &displacement);
            displacement.set(site, [0.0; D]);
            for (row, &other) in sites.iter().enumerate() {
                for e in 0..D {
                    let slope = (behind.get(other)[e] - ahead.get(other)[e]) / (2.0 * step);
                    matrix[(D * row + e, D * column + d)] = slope;
                }
            }
        }
    }
    let symmetric = 0.5 * (&matrix + matrix.transpose());
    let mut values: Vec<f64> = symmetric.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Only rigid motions are free, and the softest mode has the frequency of the independent program, which
/// detects modes that a weak stabilisation leaves nearly free.
#[test]
fn free_blocks_have_rigid_modes_and_no_soft_ones() {
    let judge = |name: &str, values: &[f64], rigid: usize, first: f64| {
        at_most(&format!("solid_modes_{name}_rigid"), values[rigid - 1].abs(), 1e-8);
        near(&format!("solid_modes_{name}_first"), values[rigid], first, 2e-6);
    };
    let sheet = |a: f64| modes([12, 12], Space::PlaneStrain, 5.0 / 3.0, a);
    let table = [
        (0.1, 0.096154),
        (0.3, 0.100996),
        (1.0, 0.112661),
        (4.0 / 3.0, 0.116812),
        (2.0, 0.123431),
        (4.0, 0.135740),
    ];
    for (a, first) in table {
        judge(&format!("12x12_a_{a:.3}"), &sheet(a), 3, first);
    }
    let small = |bulk: f64| modes([6, 5], Space::PlaneStrain, bulk, 1.0);
    judge("6x5", &small(5.0 / 3.0), 3, 0.502963);
    judge("6x5_k_100", &small(100.0), 3, 0.642830);
    judge("5x4x3", &modes([5, 4, 3], Space::Solid, 5.0 / 3.0, 1.0), 6, 0.425515);
}

/// Returns ρω² of a plane wave cos(k·(x − x₀)) with displacements along `along` in the infinite lattice: the
/// force at x₀, the middle of a block with a distant surface.
fn symbol<const D: usize>(number: [f64; D], along: usize, bulk: f64, stabilisation: f64) -> f64 {
    // two horizons on either side
    let bonds = block([13; D], 1.0);
    let space = if D == 2 { Space::PlaneStrain } else { Space::Solid };
    let mut material = Pointwise::new(NonlocalSolid::new(neo_hooke::<D>(space, bulk, stabilisation)), &bonds);
    let middle = bonds.particles().iter().map(|&site| site as usize);
    let middle = middle.into_iter().find(|&site| bonds.position(site) == [6.5; D]).unwrap();
    let size = 1e-4;
    let force = |sign: f64, material: &mut Pointwise<_, D>| {
        let mut displacement = Field::zeros(bonds.sites());
        for &site in bonds.particles() {
            let place = bonds.position(site as usize);
            let phase: f64 = (0..D).map(|d| number[d] * (place[d] - 6.5)).sum();
            let value = std::array::from_fn(|d| if d == along { sign * size * phase.cos() } else { 0.0 });
            displacement.set(site as usize, value);
        }
        forces(material, &bonds, &displacement).get(middle)[along]
    };
    (force(-1.0, &mut material) - force(1.0, &mut material)) / (2.0 * size)
}

/// Returns ρω² of waves along x with `wave` particles per length.
fn along_x<const D: usize>(wave: f64, along: usize, bulk: f64, stabilisation: f64) -> f64 {
    let number = std::array::from_fn(|d| if d == 0 { 2.0 * PI / wave } else { 0.0 });
    symbol::<D>(number, along, bulk, stabilisation)
}

/// A checkerboard has no mean deformation, so that only the stabilisation resists it, by s Δx² = 1.7269841270
/// (plane) and 1.6524590164 (space) times a g.
#[test]
fn checkerboards_have_the_stiffness_of_the_stabilisation() {
    for a in [0.1, 1.0, 4.0] {
        let (plane, space) = (symbol([PI; 2], 0, 100.0, a), symbol([PI; 3], 0, 100.0, a));
        near(&format!("solid_checkerboard_2d_a_{a}"), plane / a, 1.726_984_127, 1e-6);
        near(&format!("solid_checkerboard_3d_a_{a}"), space / a, 1.652_459_016_4, 1e-6);
    }
}

/// ρω²/(E_w k²) − 1 = −D m₄ k²(1/3 − a g/(4E_w)) for long waves, m₄ = Σωξ₁⁴; and the speed of shear waves of
/// 16 particles per length.
#[test]
fn waves_have_the_dispersion_of_the_theory() {
    fn coefficient<const D: usize>(along: usize, bulk: f64, a: f64) -> (f64, f64) {
        let stiffness = if along == 0 { bulk + 4.0 / 3.0 } else { 1.0 };
        let number = 2.0 * PI / 200.0;
        let found = along_x::<D>(200.0, along, bulk, a) / (stiffness * number * number) - 1.0;
        let fourth = if D == 2 { 1.842_857_1 } else { 1.075_409_8 };
        (found / (number * number), -(D as f64) * fourth * (1.0 / 3.0 - a / (4.0 * stiffness)))
    }
    for (along, bulk) in [(1, 5.0 / 3.0), (0, 5.0 / 3.0), (0, 100.0)] {
        for a in [0.0, 1.0, 4.0] {
            let name = |d: usize| format!("solid_dispersion_{d}d_along_{along}_k_{bulk:.0}_a_{a}");
            let (found, truth) = coefficient::<2>(along, bulk, a);
            near(&name(2), found, truth, 5e-3);
            let (found, truth) = coefficient::<3>(along, bulk, a);
            near(&name(3), found, truth, 5e-3);
        }
    }
    let number = 2.0 * PI / 16.0;
    for (a, error) in [(0.0, -0.091), (1.0, -0.023), (4.0 / 3.0, -0.0018), (4.0, 0.156)] {
        let speed = along_x::<2>(16.0, 1, 5.0 / 3.0, a).sqrt() / number;
        near(&format!("solid_shear_wave_16_a_{a:.1}"), speed - 1.0, error, 6e-4);
    }
}

/// Returns y(X): two shears, which keep the volume, and a dilation.
fn manufactured([x, y]: [f64; 2], volume: f64) -> [f64; 2] {
    let first = x + 0.08 * (PI * y + 0.3).sin();
    let second = y + 0.08 * (PI * first - 0.2).sin();
    [first + volume * (2.0 * x + y).sin(), second]
}

/// Returns ∂f/∂X_k by differences of fourth order.
fn derivative<const N: usize>(
    of: impl Fn([f64; 2]) -> [f64; N],
    at: [f64; 2],
    k: usize,
    step: f64,
) -> [f64; N] {
    let shifted = |n: f64| {
        let mut place = at;
        place[k] += n * step;
        of(place)
    };
    let [a, b, c, d] = [2.0, 1.0, -1.0, -2.0].map(shifted);
    std::array::from_fn(|i| (8.0 * (b[i] - c[i]) - a[i] + d[i]) / (12.0 * step))
}

/// Width in particles of the collar with the manufactured displacement.
pub const COLLAR: usize = 8;

/// Returns the rms errors of u and of K(J − J₀)/μ inside the collar, with n particles over the edge of 1, in
/// the block from the origin on.
pub fn errors(bonds: &mut dyn Bonds<2>, n: usize, bulk: f64, volume: f64) -> [f64; 2] {
    let law = neo_hooke::<2>(Space::PlaneStrain, bulk, 1.0);
    let width = COLLAR as f64 / n as f64;
    let place = |site: usize, bonds: &dyn Bonds<2>| bonds.position(site).map(|x| x - width);
    let piola = |at: [f64; 2]| {
        let columns = [0, 1].map(|k| derivative(|x| manufactured(x, volume), at, k, 1e-3));
        let gradient = BodyTensor::<2>::from_fn(|a, b| columns[b][a]);
        let displacement_gradient = gradient - BodyTensor::<2>::identity();
        let stress = law.respond(&Deformation::homogeneous(displacement_gradient)).piola;
        [stress[(0, 0)], stress[(0, 1)], stress[(1, 0)], stress[(1, 1)]]
    };
    let sites = bonds.sites();
    let mut loads = Loads { constrained: vec![0; sites], ..Loads::default() };
    let (mut exact, mut body) = (Field::zeros(sites), Field::zeros(sites));
    let mut inside = Vec::new();
    let volume_change = |x: [f64; 2]| {
        let [along_x, along_y] = [0, 1].map(|k| derivative(|x| manufactured(x, volume), x, k, 1e-3));
        along_x[0] * along_y[1] - along_x[1] * along_y[0]
    };
    for &site in bonds.particles() {
        let site = site as usize;
        let x = place(site, bonds);
        let moved = manufactured(x, volume);
        exact.set(site, [moved[0] - x[0], moved[1] - x[1]]);
        let [along_x, along_y] = [0, 1].map(|k| derivative(piola, x, k, 2e-3));
        body.set(site, [-along_x[0] - along_y[1], -along_x[2] - along_y[3]]);
        if x.iter().all(|&x| x > 0.0 && x < 1.0) {
            inside.push((site, volume_change(x)));
        } else {
            loads.constrained[site] = 3;
        }
    }
    loads.held_regions.push(
        bonds.particles().iter().copied().filter(|&site| loads.constrained[site as usize] == 3).collect(),
    );
    (loads.displacement, loads.body_force) = (Some(exact.clone()), Some(body));
    let mut points = Pointwise::new(NonlocalSolid::new(law.clone()), bonds);
    let mut system = System::new(bonds, NonlocalSolid::new(law), &loads, &[1.0]);
    let mut state = State::new(sites);
    state.displacement.clone_from(&exact);
    let method = Lbfgs { tolerance: 1e-8, max_iterations: 5000, ..Default::default() };
    method.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap();
    assert_eq!(state.counts.unconverged, 0, "n = {n}, K/μ = {bulk}");
    points.prepare(&*system.bonds, &state.displacement);
    let squares = inside.iter().map(|&(site, truth)| {
        let (found, wanted) = (state.displacement.get(site), exact.get(site));
        let deformation = points.points()[site].deformation().unwrap();
        let pressure = bulk * (deformation.gradient().determinant() - truth);
        [(found[0] - wanted[0]).powi(2) + (found[1] - wanted[1]).powi(2), pressure * pressure]
    });
    let sums = squares.fold([0.0; 2], |sum, square| [sum[0] + square[0], sum[1] + square[1]]);
    sums.map(|sum| (sum / inside.len() as f64).sqrt())
}

/// Second order at finite strains without locking at K/μ = 1000, in displacement and pressure: equal to the
/// errors of the independent program.
#[test]
fn manufactured_deformations_converge_with_second_order() {
    let table = [
        (5.0 / 3.0, 0.05, [[3.5486e-3, 5.3789e-3], [6.3838e-4, 1.3274e-3], [1.3294e-4, 3.2824e-4]]),
        (100.0, 0.0, [[4.5569e-4, 1.4664e-2], [6.6988e-5, 3.4581e-3], [1.4112e-5, 8.1393e-4]]),
        (1000.0, 0.0, [[5.9727e-4, 7.3886e-2], [7.3795e-5, 1.9154e-2], [1.4845e-5, 3.3543e-3]]),
    ];
    for (bulk, volume, references) in table {
        let found = [8, 16, 32].map(|n: usize| {
            let mut bonds = block([n + 2 * COLLAR; 2], 1.0 / n as f64);
            errors(&mut bonds, n, bulk, volume)
        });
        for (n, (found, truth)) in [8, 16, 32].into_iter().zip(found.into_iter().zip(references)) {
            near(&format!("solid_manufactured_k_{bulk:.0}_n_{n}"), found[0] / truth[0], 1.0, 0.01);
            near(&format!("solid_manufactured_pressure_k_{bulk:.0}_n_{n}"), found[1] / truth[1], 1.0, 0.01);
        }
        for (k, name) in ["", "pressure_"].into_iter().enumerate() {
            let order = (found[0][k] / found[2][k]).log2() / 2.0;
            at_most(&format!("solid_manufactured_{name}k_{bulk:.0}_order_below_1.9"), 1.9 - order, 0.0);
        }
    }
}
