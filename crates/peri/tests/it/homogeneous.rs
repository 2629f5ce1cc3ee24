//! Homogeneous strains in lattice, law, relaxation and stress together.

use crate::bodies::{Body, Built, Random, fit, hold, relax};
use peri::bonds::{BodyGeometry, Bonds, Stencil};
use peri::calibrate::{Space, modulus};
use peri::exact::lattice_uniaxial;
use peri::potential::{BondPotential, Law};
use peri::solver::{DynamicRelaxation, State};
use peri::stress::{BallVolume, StressInput, StressMethod, SurfaceCompensation, piola_on_lattice};

/// Three affinely moved layers around a body make the inside follow exactly, because every inner particle has
/// a complete family.
fn check_affine<const D: usize>(cells: [usize; D], name: &str) {
    let body = Body::<D>::solid(cells, 0.1, 3.015);
    let mut built = body.build();
    let gradient = |a: usize, b: usize| 0.15 - 0.11 * a as f64 + 0.04 * b as f64;
    let affine = |x: [f64; D]| std::array::from_fn(|a| (0..D).map(|b| gradient(a, b) * x[b]).sum::<f64>());
    let edge = |x: [f64; D]| (0..D).any(|d| x[d] < 0.3 || x[d] > 0.1 * cells[d] as f64 - 0.3);
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let solver = DynamicRelaxation { tolerance: 1e-8, ..Default::default() };
    let bonds: [&mut dyn Bonds<D>; 2] = [&mut built.lattice, &mut built.cloud];
    for (path, bonds) in ["lattice", "cloud"].into_iter().zip(bonds) {
        let loads = hold(bonds, |x| edge(x).then(|| ((1 << D) - 1, affine(x))));
        let farthest = |state: &State<D>, bonds: &dyn Bonds<D>| {
            let error = |&s: &u32| {
                let (u, e) = (state.displacement.get(s as usize), affine(bonds.position(s as usize)));
                (0..D).map(|d| (u[d] - e[d]).abs()).fold(0.0, f64::max)
            };
            bonds.particles().iter().map(error).fold(0.0, f64::max)
        };
        let mut state = State::new(bonds.sites());
        relax(&solver, bonds, (&*law, 1.0), &loads, &[0.5, 1.0], &mut state).unwrap();
        // the affine predictor is the solution: nothing is left to iterate, but for rounding
        assert_eq!(state.counts.total_iterations, 0, "{name}, {path}");
        assert!(farthest(&state, bonds) < 1e-14, "{name}, {path}: {:.1e}", farthest(&state, bonds));
        // from a start that is off by a fifth of the spacing everywhere
        let mut state = State::new(bonds.sites());
        let mut random = Random(41);
        for &site in bonds.particles().to_vec().iter() {
            state.displacement.set(site as usize, std::array::from_fn(|_| 0.02 * random.next()));
        }
        relax(&solver, bonds, (&*law, 1.0), &loads, &[1.0], &mut state).unwrap();
        // u is off by at most the residual over the softest stiffness, about (spacing/size)² of the stiffest
        let error = farthest(&state, bonds);
        assert!(error < 1e-8, "{name}, {path}: off by {error:.1e}");
        // longest wave of 2·cells spacings: √(ω_max/ω_min) ≈ cells, e-folds of 1e-8: 18
        let most = 18 * cells.iter().max().copied().unwrap_or(0) as u64;
        assert!(
            state.counts.total_iterations < most,
            "{name}, {path}: {} iterations",
            state.counts.total_iterations
        );
        eprintln!("{name}, {path}: {} iterations, off by {error:.1e}", state.counts.total_iterations);
    }
}

#[test]
fn an_affine_boundary_gives_the_affine_field() {
    check_affine([19, 16], "sheet");
    check_affine([12, 11, 10], "block");
}

/// The middle of a strip between rollers, far from free edges and six widths from the ends, is a lattice
/// under uniaxial stress.
#[test]
fn a_sheet_between_rollers_is_in_uniaxial_stress() {
    let cells = [201, 31];
    let mut built = Body::<2>::solid(cells, 1.0, 3.015).build();
    let law = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
    let modulus = modulus(Space::PlaneStress, 1.0, 3.015, 1.0);
    let solver = DynamicRelaxation { tolerance: 1e-9, ..Default::default() };
    // P11/E of formulation.md, printed to five digits
    for (stretch, printed) in [(1.2, 0.22269), (1.5, 0.59576), (2.0, 1.28691)] {
        let grip = |x: [f64; 2]| x[0] < 3.0 || x[0] > cells[0] as f64 - 3.0;
        let loads = hold(&built.lattice, |x| grip(x).then(|| (1, [(stretch - 1.0) * x[0], 0.0])));
        let mut state = State::new(built.lattice.sites());
        relax(&solver, &mut built.lattice, (&*law, modulus), &loads, &[0.3, 0.6, 1.0], &mut state).unwrap();
        let fit = fit(&*law, state.stretches.fitted);
        let loaded = StressInput {
            displacement: &state.displacement,
            fit: (&fit).into(),
            modulus,
            missing: SurfaceCompensation::Bonds,
        };
        let stress = piola_on_lattice(&built.lattice, &loaded, StressMethod::OnePoint, BallVolume::Whole);
        for (particle, x) in built.points.iter().enumerate() {
            if (x[1] - 15.5).abs() < 3.0 && (x[0] - 100.5).abs() < 8.0 {
                // the ends strain a little differently: the response at the stretch found here
                let [along, across] = local_stretches(&built, &state, particle);
                let (lateral, nominal) = lattice_uniaxial(&*law, 3.015, along);
                let p = stress[particle];
                // what is left of the edges' and ends' disturbance, each e-folding in a few rows or in a
                // tenth of 2 widths
                assert!((p[0][0] / (nominal * modulus) - 1.0).abs() < 1e-6, "λ = {along}, {x:?}: {p:?}");
                assert!(p[1][1].abs() < 1e-6 && p[0][1].abs() < 1e-6, "λ = {along}, {x:?}: {p:?}");
                assert!((across - lateral).abs() < 1e-6, "λ = {along}: {across} {lateral}");
                // formulation.md's figures, to the ends' effect on the stretch in the middle
                assert!((p[0][0] / printed - 1.0).abs() < 1e-3, "λ = {stretch}: {} {printed}", p[0][0]);
            }
        }
    }
}

/// Returns the stretches along the axes between a particle and the next one.
fn local_stretches<const D: usize>(built: &Built<D>, state: &State<D>, particle: usize) -> [f64; D] {
    std::array::from_fn(|d| {
        let mut there = built.points[particle];
        there[d] += 1.0;
        let next = built.points.iter().position(|x| *x == there).unwrap();
        let u = |p: usize| state.displacement.get(built.on_lattice[p])[d];
        1.0 + u(next) - u(particle)
    })
}

/// Returns P11/kθ and P22/kθ of the cubic lattice under F = diag(a, b, b).
fn block_stress(law: &dyn BondPotential, ratio: f64, a: f64, b: f64) -> [f64; 2] {
    let stencil = Stencil::<3>::new(ratio);
    let mut stress = [0.0; 2];
    for offset in &stencil.offsets {
        let x = offset.map(f64::from);
        let reference = (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]).sqrt();
        let length = (a * a * x[0] * x[0] + b * b * (x[1] * x[1] + x[2] * x[2])).sqrt();
        let tension = law.tension(length / reference) / length;
        stress[0] += tension * a * x[0] * x[0];
        stress[1] += tension * b * x[1] * x[1];
    }
    stress
}

#[test]
fn a_block_between_rollers_is_in_uniaxial_stress() {
    let cells = [81, 15, 15];
    let ratio = 2.015;
    let mut built = Body::<3>::solid(cells, 1.0, ratio).build();
    let law = Law::ChainAffine.build(720.0, 1200.0, true).unwrap();
    let modulus = modulus(Space::Solid, 1.0, ratio, 1.0);
    let stretch = 1.25;
    let grip = |x: [f64; 3]| x[0] < 2.0 || x[0] > cells[0] as f64 - 2.0;
    let loads = hold(&built.lattice, |x| grip(x).then(|| (1, [(stretch - 1.0) * x[0], 0.0, 0.0])));
    let solver = DynamicRelaxation {
        tolerance: 1e-7,
        mass_safety: Law::ChainAffine.mass_safety(),
        ..Default::default()
    };
    let mut state = State::new(built.lattice.sites());
    relax(&solver, &mut built.lattice, (&*law, modulus), &loads, &[1.0], &mut state).unwrap();
    let fit = fit(&*law, state.stretches.fitted);
    let loaded = StressInput {
        displacement: &state.displacement,
        fit: (&fit).into(),
        modulus,
        missing: SurfaceCompensation::Bonds,
    };
    let stress = piola_on_lattice(&built.lattice, &loaded, StressMethod::OnePoint, BallVolume::Whole);
    let middle = built.points.iter().position(|x| *x == [40.5, 7.5, 7.5]).unwrap();
    let p = stress[middle];
    let [along, across, depth] = local_stretches(&built, &state, middle);
    let [nominal, lateral] = block_stress(&*law, ratio, along, across).map(|s| s * modulus);
    eprintln!(
        "block: {p:?} against {nominal} {lateral} at {along} {across} {depth}, {} iterations",
        state.counts.total_iterations
    );
    assert!((across - depth).abs() < 1e-9);
    // the edges' disturbance, seven rows away, is a third of a percent of the stress and all but affine over
    // one family
    for (found, expected) in [(p[0][0], nominal), (p[1][1], lateral), (p[2][2], lateral)] {
        assert!((found - expected).abs() < 2e-4 * nominal, "{p:?} against {nominal}, {lateral}");
    }
    assert!(p[1][1].abs() < 0.01 * nominal, "{p:?}");
}
