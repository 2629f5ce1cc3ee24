//! Extreme parameters, bodies and loads: a result, or an error with its cause and place.

use crate::bodies::{Body, MODULUS, Random, distance, forces, hold, norm, relax, rms};
use peri::Error;
use peri::bonds::{
    BodyGeometry, BondDamage, BondForces, Bonds, CloudBonds, Lattice, LatticeBonds, VolumeCorrection,
};
use peri::calibrate::{Space, modulus};
use peri::field::Field;
use peri::geometry::{Operation, Shape, lattice};
use peri::material::BondMaterial;
use peri::potential::{KernelFit, Law};
use peri::solver::{DynamicRelaxation, Loads, Method, State};

/// The fit keeps its bound and forces agree for D̂ from 1 to 1e9 and n̄ from 2 to 1e6, every law, at strains
/// of a tenth.
#[test]
fn extreme_chains() {
    let body = Body::<2>::solid([9, 8], 0.125, 3.015);
    let mut built = body.build();
    let pairs = body.pairs(&built.points);
    let u = Random(47).vectors(built.points.len(), 0.005);
    let range = crate::bodies::stretch_range(&pairs, &u);
    for links in [2.0, 1e6] {
        for dissociation in [1.0, 1e9] {
            for law in Law::ALL {
                let name = format!("{}, n̄ = {links}, D̂ = {dissociation}", law.name());
                let potential = law.build(links, dissociation, law.rescales()).unwrap();
                let fit = KernelFit::new(&*potential, range, 1e-9)
                    .unwrap_or_else(|error| panic!("{name}: {error}"));
                built.lattice.set_law(&fit, MODULUS);
                let found = forces(&built.lattice, &built.on_lattice, &u);
                let (plain, sizes) = body.plain_forces(&pairs, &*potential, &u);
                for (particle, (f, p)) in found.iter().zip(&plain).enumerate() {
                    let error = norm([f[0] - p[0], f[1] - p[1]]);
                    // the fit's bound on each bond
                    assert!(
                        error <= 1.2e-9 * sizes[particle],
                        "{name}: {error:.1e} of {:.1e}",
                        sizes[particle]
                    );
                }
            }
        }
    }
}

#[test]
fn parameters_out_of_their_domain_are_named() {
    for (links, dissociation) in [(0.5, 1.0), (f64::NAN, 1.0), (2.0, 0.0), (2.0, -1.0), (2.0, f64::INFINITY)]
    {
        let error = Law::ChainOffset.build(links, dissociation, false).err().unwrap();
        assert!(matches!(error, Error::Parameter { .. }), "{error}");
    }
    let law = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
    for range in [[0.0, 1.0], [1.2, 1.1], [0.5, f64::INFINITY], [f64::NAN, 1.1], [0.5, f64::NAN]] {
        assert!(matches!(KernelFit::new(&*law, range, 1e-9), Err(Error::Parameter { .. })), "{range:?}");
    }
}

/// A range of stretches so narrow that samples have nearly no force is fitted.
#[test]
fn narrow_ranges_are_fitted() {
    let law = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
    for width in [1e-3, 1e-5, 1e-9] {
        let fit = KernelFit::new(&*law, [1.0 - width, 1.0 + width], 1e-9).unwrap();
        assert!(fit.range[0] <= 1.0 - width && fit.range[1] >= 1.0 + width);
        // q/e at rest is K/2, and q = t/l: 1.5 e off it at strain e/2
        let slope = fit.value(width) / width;
        assert!((slope / (0.5 * law.tangent()) - 1.0).abs() < width + 1e-8, "±{width}: {slope}");
    }
}

/// Scattered points, a negative or missing volume, coincident particles: no panic.
#[test]
fn clouds_out_of_their_domain_are_refused() {
    let points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    let build = |points: &[[f64; 2]], volumes: &[f64], horizon: f64| {
        CloudBonds::new(points, volumes, 1.0, horizon, VolumeCorrection::None, &[]).map(|_| ())
    };
    assert!(build(&points, &[1.0; 3], 1.5).is_ok());
    let bad: [(&str, Result<(), Error>); 7] = [
        ("nothing", build(&[], &[], 1.5)),
        ("no volume", build(&points, &[1.0, 0.0, 1.0], 1.5)),
        ("NaN volume", build(&points, &[1.0, f64::NAN, 1.0], 1.5)),
        ("twins", build(&[[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]], &[1.0; 3], 1.5)),
        ("too few volumes", build(&points, &[1.0; 2], 1.5)),
        ("NaN position", build(&[[0.0, 0.0], [f64::NAN, 0.0]], &[1.0; 2], 1.5)),
        ("infinite position", build(&[[0.0, 0.0], [f64::INFINITY, 0.0]], &[1.0; 2], 1.5)),
    ];
    for (name, result) in bad {
        assert!(matches!(result, Err(Error::Geometry(_))), "{name}");
    }
    for horizon in [f64::NAN, -1.0, 0.0] {
        assert!(build(&points, &[1.0; 3], horizon).is_err(), "horizon {horizon}");
    }
}

#[test]
fn lattices_out_of_their_domain_are_refused() {
    let build = |spacing: f64, cells: usize, listed: usize, ratio: f64| {
        let occupied = vec![true; listed];
        let lattice = Lattice { spacing, origin: [0.0; 2], cells: [cells; 2], occupied, volume: 1.0 };
        LatticeBonds::new(lattice, ratio, VolumeCorrection::None, &[]).map(|bonds| bonds.directed_bonds())
    };
    assert_eq!(build(1.0, 5, 25, 1.0).unwrap(), 80);
    let bad = [
        ("no cells", build(1.0, 0, 0, 3.0)),
        ("fewer cells than listed", build(1.0, 5, 26, 3.0)),
        ("more cells than listed", build(1.0, 5, 24, 3.0)),
        ("no spacing", build(0.0, 5, 25, 3.0)),
        ("NaN spacing", build(f64::NAN, 5, 25, 3.0)),
        ("horizon below the spacing", build(1.0, 5, 25, 0.99)),
        ("NaN horizon", build(1.0, 5, 25, f64::NAN)),
        ("infinite horizon", build(1.0, 5, 25, f64::INFINITY)),
    ];
    for (name, result) in bad {
        assert!(matches!(result, Err(Error::Geometry(_))), "{name}: {result:?}");
    }
    let square = [Operation::Add(Shape::Box { min: [0.0; 2], max: [1.0; 2] })];
    for spacing in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        assert!(matches!(lattice(&square, spacing, 1.0), Err(Error::Geometry(_))), "{spacing}");
    }
    assert!(matches!(lattice::<2>(&[], 0.1, 1.0), Err(Error::Geometry(_))));
}

/// Bonds as long as the horizon exist in a cloud despite rounding of positions.
#[test]
fn bonds_as_long_as_the_horizon() {
    for spacing in [0.1, 0.3, 1e-3, 7e-9] {
        for ratio in [1.0, 2.0, 3.0, 5.0] {
            let built = Body::<2>::solid([13, 11], spacing, ratio).build();
            assert_eq!(
                built.lattice.directed_bonds(),
                built.cloud.directed_bonds(),
                "m = {ratio}, spacing {spacing}"
            );
        }
    }
}

/// m = 1 (a square grid without shear stiffness) and m = 8, stretched between held ends.
#[test]
fn smallest_and_large_horizons() {
    for (ratio, cells) in [(1.0, [14, 9]), (8.0, [40, 33])] {
        let mut built = Body::<2>::solid(cells, 0.125, ratio).build();
        let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
        let end = 0.125 * cells[0] as f64 - 0.125;
        let loads = hold(&built.lattice, |x| (x[0] < 0.125 || x[0] > end).then(|| (3, [0.1 * x[0], 0.0])));
        let mut state = State::new(built.lattice.sites());
        let solver = DynamicRelaxation { tolerance: 1e-6, ..Default::default() };
        relax(&solver, &mut built.lattice, (&*law, 1.0), &loads, &[1.0], &mut state).unwrap();
        let middle = built.on_lattice[built.on_lattice.len() / 2];
        let x = built.lattice.position(middle);
        // by symmetry the middle column moves by the mean of the ends
        let u = state.displacement.get(middle)[0];
        assert!((u - 0.1 * x[0]).abs() < 0.02, "m = {ratio}: {u} at {x:?}");
    }
}

#[test]
fn one_particle_and_two() {
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let solver = DynamicRelaxation::default();
    let mut one = Body::<3>::solid([1, 1, 1], 0.1, 3.015).build();
    assert_eq!((one.lattice.directed_bonds(), one.cloud.directed_bonds()), (0, 0));
    for bonds in [&mut one.lattice as &mut dyn Bonds<3>, &mut one.cloud] {
        let loads = hold(bonds, |_| Some((1, [0.3, 0.0, 0.0])));
        let mut state = State::new(bonds.sites());
        relax(&solver, bonds, (&*law, 1.0), &loads, &[1.0], &mut state).unwrap();
        let site = bonds.particles()[0] as usize;
        // held along x; the least-norm predictor moves nothing else
        assert_eq!(state.displacement.get(site), [0.3, 0.0, 0.0]);
        assert_eq!(state.force.get(site), [0.0; 3]);
    }
    // two particles 0.1 apart, one held, the other pulled by b: 2kθ t(λ) V = b
    let mut two = Body::<2>::solid([2, 1], 0.1, 3.015).build();
    let pull = 2.0 * MODULUS * law.tension(1.2) * 0.01;
    for bonds in [&mut two.lattice as &mut dyn Bonds<2>, &mut two.cloud] {
        let mut loads = hold(bonds, |x| (x[0] < 0.1).then_some((3, [0.0; 2])));
        let mut force = Field::zeros(bonds.sites());
        let far =
            bonds.particles().iter().map(|&s| s as usize).find(|&s| bonds.position(s)[0] > 0.1).unwrap();
        force.set(far, [pull, 0.0]);
        loads.body_force = Some(force);
        let solver = DynamicRelaxation { tolerance: 1e-10, ..solver };
        let mut state = State::new(bonds.sites());
        relax(&solver, bonds, (&*law, MODULUS), &loads, &[1.0], &mut state).unwrap();
        // tolerance over a tangent of order 1, and the fit's 1e-9
        let u = state.displacement.get(far);
        assert!((u[0] - 0.02).abs() < 1e-9 && u[1] == 0.0, "{u:?}");
    }
}

/// A particle without bonds, and a piece without loads.
#[test]
fn loose_parts_stay_where_they_are_put() {
    let at = |x: f64, cells: f64| Operation::Add(Shape::Box { min: [x, 0.0], max: [x + cells, 8.0] });
    let dot = Operation::Add(Shape::Box { min: [38.0, 4.0], max: [39.0, 5.0] });
    let body = [at(0.0, 20.0), at(26.0, 6.0), dot];
    let bonds = LatticeBonds::new(lattice(&body, 1.0, 1.0).unwrap(), 3.015, VolumeCorrection::None, &[]);
    let mut bonds = bonds.unwrap();
    let loads = hold(&bonds, |x| {
        let value = [0.05 * x[0], 0.0];
        (x[0] < 3.0 || (x[0] > 17.0 && x[0] < 20.0)).then_some((3, value))
    });
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let solver = DynamicRelaxation { tolerance: 1e-6, max_iterations: 2000, ..Default::default() };
    let mut state = State::new(bonds.sites());
    relax(&solver, &mut bonds, (&*law, 1.0), &loads, &[1.0], &mut state).unwrap();
    let mut seen = 0;
    for &site in bonds.particles() {
        let (x, f) = (bonds.position(site as usize), state.force.get(site as usize));
        if x[0] > 38.0 {
            let mut bonded = 0;
            bonds.neighbours(site as usize, &mut |_| bonded += 1);
            assert_eq!((bonded, f), (0, [0.0; 2]));
            seen += 1;
        }
    }
    assert_eq!(seen, 1);
    // the loose piece takes the predictor's strain and relaxes from it: its forces vanish with the residual
    let reference = state.force.components().iter().flat_map(|c| c.iter()).map(|f| f * f).sum::<f64>().sqrt();
    for &site in bonds.particles() {
        let x = bonds.position(site as usize);
        if x[0] > 26.0 {
            assert!(norm(state.force.get(site as usize)) <= 1e-6 * reference, "at {x:?}");
        }
    }
}

/// A problem in nanometres and kilometres, pascals and terapascals has equal u/L and iterations.
#[test]
fn results_scale_with_length_and_modulus() {
    fn solve<const D: usize>(cells: [usize; D], length: f64, stiffness: f64) -> (Vec<[f64; D]>, u64) {
        let mut built = Body::<D>::damaged(cells, 0.125 * length, 3.015).build();
        let space = if D == 2 { Space::PlaneStress } else { Space::Solid };
        let modulus = modulus(space, stiffness, 3.015 * 0.125 * length, if D == 2 { length } else { 1.0 });
        let end = (0.125 * cells[0] as f64 - 0.375) * length;
        let loads = hold(&built.lattice, |x| {
            (x[0] < 0.375 * length || x[0] > end).then(|| ((1 << D) - 1, x.map(|c| 0.04 * c)))
        });
        let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
        let solver = DynamicRelaxation { tolerance: 1e-8, ..Default::default() };
        let mut state = State::new(built.lattice.sites());
        relax(&solver, &mut built.lattice, (&*law, modulus), &loads, &[1.0], &mut state).unwrap();
        let u = built.on_lattice.iter().map(|&s| state.displacement.get(s).map(|x| x / length)).collect();
        (u, state.counts.total_iterations)
    }
    fn check<const D: usize>(cells: [usize; D]) {
        let (plain, iterations) = solve(cells, 1.0, 1.0);
        assert!(iterations > 20);
        for (length, stiffness) in [(1e-9, 1e12), (1e-9, 1.0), (1e3, 1.0), (1e3, 1e12)] {
            let (scaled, found) = solve(cells, length, stiffness);
            // both are within the relaxation's tolerance of the same solution
            let apart = distance(&plain, &scaled) / rms(&plain);
            assert!(apart < 1e-7, "{D}D, L = {length}, E = {stiffness}: {apart:.1e}");
            assert!(
                found.abs_diff(iterations) <= 2,
                "{D}D, L = {length}, E = {stiffness}: {found}, {iterations}"
            );
        }
    }
    check([18, 15]);
    check([9, 8, 8]);
}

#[test]
fn what_is_not_finite_is_located() {
    let mut built = Body::<2>::solid([12, 9], 0.125, 3.015).build();
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let solver = DynamicRelaxation::default();
    let struck = 57;
    for bad in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e200] {
        let mut loads = hold(&built.lattice, |x| (x[0] < 0.375).then_some((3, [0.0; 2])));
        let mut force = Field::zeros(built.lattice.sites());
        force.set(built.on_lattice[struck], [0.0, bad]);
        loads.body_force = Some(force);
        let mut state = State::new(built.lattice.sites());
        let error = relax(&solver, &mut built.lattice, (&*law, 1.0), &loads, &[1.0], &mut state);
        let Err(Error::NotFinite { particle, position, step, iteration, .. }) = error else {
            panic!("{bad}: {error:?}");
        };
        assert_eq!((particle, step, iteration), (struck, 0, 0), "{bad}");
        assert_eq!(position, built.points[struck], "{bad}");
    }
    let loads = hold(&built.lattice, |x| {
        (x[0] < 0.375).then(|| (3, [0.0, if x == built.points[1] { f64::NAN } else { 0.0 }]))
    });
    let mut state = State::new(built.lattice.sites());
    let error = relax(&solver, &mut built.lattice, (&*law, 1.0), &loads, &[1.0], &mut state);
    assert!(matches!(error, Err(Error::NotFinite { .. })), "{error:?}");
}

#[test]
fn what_does_not_converge_says_how_far_it_came() {
    let mut built = Body::<2>::damaged([20, 15], 0.125, 3.015).build();
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let loads = hold(&built.lattice, |x| (x[0] < 0.375 || x[0] > 2.125).then(|| (3, [0.1 * x[0], 0.0])));
    let solver = DynamicRelaxation { tolerance: 1e-12, max_iterations: 15, ..Default::default() };
    let mut last = f64::NAN;
    let mut state = State::new(built.lattice.sites());
    let mut system =
        peri::solver::System::new(&mut built.lattice, BondMaterial::new(&*law, 1.0), &loads, &[0.5, 1.0]);
    let error = solver.solve(
        &mut system,
        &mut state,
        &mut |status, _| {
            last = status.residual;
            Ok(())
        },
        &mut |_, _| Ok(()),
    );
    let Err(Error::NotConverged { step, iterations, residual, needed }) = error else { panic!("{error:?}") };
    assert_eq!((step, iterations, needed), (0, 15, 1e-12));
    assert!(residual > needed && residual < 1.0 && residual < 10.0 * last, "{residual}, before it {last}");
    // a body force on a particle without bonds has no equilibrium
    let mut one = Body::<2>::solid([1, 1], 0.125, 3.015).build();
    let mut force = Field::zeros(one.lattice.sites());
    force.set(one.on_lattice[0], [1.0, 0.0]);
    let loads = Loads { body_force: Some(force), ..Default::default() };
    let mut state = State::new(one.lattice.sites());
    let solver = DynamicRelaxation { max_iterations: 50, ..Default::default() };
    let error = relax(&solver, &mut one.lattice, (&*law, 1.0), &loads, &[1.0], &mut state);
    assert!(matches!(error, Err(Error::NoEquilibrium { step: 0, torn: false, .. })), "{error:?}");
}

/// The network law, whose force grows without bound at both ends, squeezed and pulled; the fit follows the
/// stretches.
#[test]
fn strong_compression_of_the_network_law() {
    let mut built = Body::<2>::solid([20, 20], 0.125, 3.015).build();
    let law = Law::ChainAffine.build(720.0, 1200.0, true).unwrap();
    let end = 2.5 - 0.375;
    for (to, most) in [(0.7, 2000), (2.0, 2000), (0.4, 300)] {
        let loads =
            hold(&built.lattice, |x| (x[0] < 0.375 || x[0] > end).then(|| (3, [(to - 1.0) * x[0], 0.0])));
        let solver = DynamicRelaxation {
            tolerance: 1e-5,
            mass_safety: Law::ChainAffine.mass_safety(),
            accept: 0.0,
            max_iterations: most,
        };
        let mut state = State::new(built.lattice.sites());
        let steps = [0.25, 0.5, 0.75, 1.0];
        let result = relax(&solver, &mut built.lattice, (&*law, 1.0), &loads, &steps, &mut state);
        match result {
            Ok(()) => {}
            // squeezed to 0.4 the sheet buckles and folds: it may take longer, but its numbers stay numbers
            Err(Error::NotConverged { residual, .. }) if to < 0.5 && residual < 1.0 => {}
            Err(error) => panic!("to {to}: {error}"),
        }
        let (low, high) =
            ((1.0 + state.stretches.observed.low).sqrt(), (1.0 + state.stretches.observed.high).sqrt());
        eprintln!(
            "chain to {to}: stretches {low:.3} to {high:.3}, {} iterations",
            state.counts.total_iterations
        );
        assert!(
            state.stretches.fitted[0] <= low && high <= state.stretches.fitted[1],
            "{:?} {low} {high}",
            state.stretches.fitted
        );
    }
}

/// A step to four times the length ends like four steps, although its first stretches lie far outside the
/// first range of the fit.
#[test]
fn a_leap_ends_where_steps_end() {
    let law = Law::ChainOffset.build(100.0, 1200.0, true).unwrap();
    let mut built = Body::<2>::damaged([18, 16], 0.125, 3.015).build();
    let loads = hold(&built.lattice, |x| (x[0] < 0.375 || x[0] > 1.875).then(|| (3, [3.0 * x[0], 0.0])));
    let solver = DynamicRelaxation { tolerance: 1e-7, max_iterations: 5000, ..Default::default() };
    let mut ends = Vec::new();
    for steps in [1, 4] {
        let factors: Vec<f64> = (1..=steps).map(|k| f64::from(k) / f64::from(steps)).collect();
        let mut state = State::new(built.lattice.sites());
        relax(&solver, &mut built.lattice, (&*law, 1.0), &loads, &factors, &mut state).unwrap();
        let u: Vec<[f64; 2]> = built.on_lattice.iter().map(|&s| state.displacement.get(s)).collect();
        eprintln!("{steps} steps: {} iterations", state.counts.total_iterations);
        ends.push(u);
    }
    // both within the relaxation's tolerance of one equilibrium
    let apart = distance(&ends[0], &ends[1]) / rms(&ends[0]);
    assert!(apart < 1e-5, "{apart:.1e}");
}
