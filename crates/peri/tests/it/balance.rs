//! Forces balance, rotate with the body, vanish in rigid motions, and are the gradient of the bond energy.

use crate::bodies::{
    Body, Built, MODULUS, Random, distance, fit, forces, laws, norm, rms, scatter, stretch_range,
};
use peri::bonds::{BondForces, Bonds, CloudBonds, VolumeCorrection};
use peri::potential::{KernelFit, Law};

/// Forces of both paths on particles in input order.
fn both<const D: usize>(
    built: &mut Built<D>,
    fit: &KernelFit,
    u: &[[f64; D]],
) -> [(&'static str, Vec<[f64; D]>); 2] {
    built.lattice.set_law(fit, MODULUS);
    built.cloud.set_law(fit, MODULUS);
    let lattice = forces(&built.lattice, &built.on_lattice, u);
    [("lattice", lattice), ("cloud", forces(&built.cloud, &built.in_cloud, u))]
}

/// Returns Σ V f and all Σ V (x_a f_b − x_b f_a) over the sums of magnitudes.
fn imbalance<const D: usize>(positions: &[[f64; D]], forces: &[[f64; D]], volumes: &[f64]) -> f64 {
    let mut worst = 0.0_f64;
    let size: f64 = forces.iter().zip(volumes).map(|(f, v)| norm(*f) * v).sum();
    let arm = positions.iter().map(|x| norm(*x)).fold(0.0, f64::max);
    for a in 0..D {
        let sum: f64 = forces.iter().zip(volumes).map(|(f, v)| f[a] * v).sum();
        worst = worst.max(sum.abs() / size);
        for b in 0..a {
            let moment: f64 = positions
                .iter()
                .zip(forces)
                .zip(volumes)
                .map(|((x, f), v)| v * (x[a] * f[b] - x[b] * f[a]))
                .sum();
            worst = worst.max(moment.abs() / (size * arm));
        }
    }
    worst
}

fn check_balance<const D: usize>(cells: [usize; D], ratio: f64) {
    let body = Body::damaged(cells, 0.1, ratio);
    let mut built = body.build();
    let pairs = body.pairs(&built.points);
    let u = Random(11).vectors(built.points.len(), 0.012);
    let positions: Vec<[f64; D]> =
        built.points.iter().zip(&u).map(|(x, u)| std::array::from_fn(|d| x[d] + u[d])).collect();
    let volumes = vec![1.0; u.len()];
    for (law, potential) in laws() {
        let fit = fit(&*potential, stretch_range(&pairs, &u));
        for (path, found) in both(&mut built, &fit, &u) {
            // each bond is summed at both ends: only roundings of about 1e3 particles remain
            let worst = imbalance(&positions, &found, &volumes);
            assert!(worst < 1e-11, "{path}, {D}D, {}: {worst:.1e}", law.name());
        }
    }
}

#[test]
fn forces_and_moments_balance() {
    check_balance([23, 19], 3.015);
    check_balance([20, 21], 5.3);
    check_balance([10, 9, 8], 3.015);
}

/// Forces V_I f_I balance on scattered points with volumes from 1 to 5.
#[test]
fn unequal_volumes_balance() {
    let mut random = Random(5);
    let points = random.vectors::<3>(500, 1.0);
    let volumes: Vec<f64> = (0..500).map(|_| 3.0 + 2.0 * random.next()).collect();
    let mut cloud = CloudBonds::new(&points, &volumes, 1.0, 0.4, VolumeCorrection::Linear, &[]).unwrap();
    let law = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
    // close pairs of scattered points are stretched arbitrarily: move them affinely, with a rotation
    let u: Vec<[f64; 3]> = points
        .iter()
        .map(|x| [0.2 * x[0] + 0.3 * x[1], -0.1 * x[1] - 0.3 * x[0], 0.1 * x[2] * x[0]])
        .collect();
    cloud.set_law(&KernelFit::new(&*law, [0.5, 1.8], 1e-9).unwrap(), MODULUS);
    let mut sites = vec![0; points.len()];
    for (site, &particle) in cloud.input_order().iter().enumerate() {
        sites[particle as usize] = site;
    }
    let found = forces(&cloud, &sites, &u);
    let positions: Vec<[f64; 3]> =
        points.iter().zip(&u).map(|(x, u)| std::array::from_fn(|d| x[d] + u[d])).collect();
    let worst = imbalance(&positions, &found, &volumes);
    // rounding only, as above
    assert!(worst < 1e-11, "{worst:.1e}");
    let unweighted = imbalance(&positions, &found, &vec![1.0; 500]);
    assert!(unweighted > 1e-3, "the volumes matter: {unweighted:.1e}");
}

fn rotation<const D: usize>(angle: f64) -> [[f64; D]; D] {
    // about (1, 1, 1) in space, by Rodrigues' formula
    let (s, c) = angle.sin_cos();
    std::array::from_fn(|a| {
        std::array::from_fn(|b| {
            let identity = f64::from(u8::from(a == b));
            let sign = if a == b {
                0.0
            } else if (a + 1) % D == b {
                -1.0
            } else {
                1.0
            };
            if D == 2 {
                identity * c
                    + if a < b {
                        -s
                    } else if a > b {
                        s
                    } else {
                        0.0
                    }
            } else {
                identity * c + (1.0 - c) / 3.0 + sign * s / 3.0_f64.sqrt()
            }
        })
    })
}

fn turn<const D: usize>(by: &[[f64; D]; D], x: [f64; D]) -> [f64; D] {
    std::array::from_fn(|a| (0..D).map(|b| by[a][b] * x[b]).sum())
}

fn check_objectivity<const D: usize>(cells: [usize; D]) {
    let body = Body::damaged(cells, 0.1, 3.015);
    let mut built = body.build();
    let pairs = body.pairs(&built.points);
    let u = Random(17).vectors(built.points.len(), 0.012);
    let by = rotation::<D>(0.83);
    let turned: Vec<[f64; D]> = built
        .points
        .iter()
        .zip(&u)
        .map(|(x, u)| {
            let there = turn(&by, std::array::from_fn(|d| x[d] + u[d]));
            std::array::from_fn(|d| there[d] - x[d] + 3.0)
        })
        .collect();
    for (law, potential) in laws() {
        let fit = fit(&*potential, stretch_range(&pairs, &u));
        let straight = both(&mut built, &fit, &u);
        let after = both(&mut built, &fit, &turned);
        for ((path, straight), (_, after)) in straight.into_iter().zip(after) {
            let expected: Vec<[f64; D]> = straight.iter().map(|&f| turn(&by, f)).collect();
            // u ≈ 5 is rounded to 4e-16: strains of bonds of 0.1 to 1e-14, forces of strains 0.1 to 1e-13,
            // times the bonds of a particle
            let apart = distance(&expected, &after) / rms(&straight);
            assert!(apart < 1e-11, "{path}, {D}D, {}: {apart:.1e}", law.name());
        }
    }
}

#[test]
fn forces_turn_with_the_body() {
    check_objectivity([19, 17]);
    check_objectivity([9, 8, 7]);
}

fn check_rigid<const D: usize>(cells: [usize; D]) {
    // quarter turns and shifts of a lattice with a spacing of 2⁻³ are exact in floating point
    let body = Body::solid(cells, 0.125, 3.015);
    let mut built = body.build();
    let count = built.points.len();
    let quarter: Vec<[f64; D]> = built
        .points
        .iter()
        .map(|x| {
            let mut there = *x;
            (there[0], there[1]) = (-x[1], x[0]);
            std::array::from_fn(|d| there[d] - x[d])
        })
        .collect();
    let states = [
        ("rest", vec![[0.0; D]; count]),
        ("a shift by 8e9 spacings", vec![[1e9; D]; count]),
        ("a quarter turn", quarter),
    ];
    for (law, potential) in laws().filter(|(_, p)| p.is_stress_free()) {
        let fit = fit(&*potential, [0.9, 1.1]);
        for (state, u) in &states {
            for (path, found) in both(&mut built, &fit, u) {
                assert!(
                    found.iter().flatten().all(|&f| f == 0.0),
                    "{path}, {D}D, {}, {state}: {:.1e}",
                    law.name(),
                    rms(&found)
                );
            }
        }
    }
}

#[test]
fn rigid_motions_make_no_force_at_all() {
    check_rigid([19, 12]);
    check_rigid([9, 8, 6]);
}

/// Π = Σ over pairs of 2kθ w V_I V_J |ξ| φ(λ); V_I f_I = −∂Π/∂u_I.
fn check_gradient<const D: usize>(cells: [usize; D]) {
    let body = Body::damaged(cells, 0.1, 3.015);
    let mut built = body.build();
    let pairs = body.pairs(&built.points);
    let u = Random(23).vectors(built.points.len(), 0.012);
    let volume = 0.1_f64.powi(D as i32);
    for (law, potential) in laws() {
        let fit = fit(&*potential, stretch_range(&pairs, &u));
        let found = both(&mut built, &fit, &u);
        let scale = rms(&found[0].1);
        for particle in (0..u.len()).step_by(37) {
            let own: Vec<_> = pairs.iter().filter(|p| p.i == particle || p.j == particle).collect();
            let energy = |d: usize, step: f64| -> f64 {
                let mut moved = u.clone();
                moved[particle][d] += step;
                let of = |p: &&crate::bodies::BondPair<D>| {
                    p.weight * p.length * potential.energy(p.deformed(&moved).1)
                };
                2.0 * MODULUS * volume * own.iter().map(of).sum::<f64>()
            };
            for d in 0..D {
                // fourth-order differences: error h⁴ Π⁽⁵⁾ ≈ (1e-3)⁴ times the law's fifth derivative, and
                // 1e-16/1e-3 of the energy for rounding
                let h = 1e-3 * 0.1;
                let slope = (8.0 * (energy(d, h) - energy(d, -h)) - energy(d, 2.0 * h) + energy(d, -2.0 * h))
                    / (12.0 * h);
                for (path, forces) in &found {
                    let error = (forces[particle][d] + slope).abs() / scale;
                    assert!(
                        error < 1e-8,
                        "{path}, {D}D, {}, particle {particle}, component {d}: {} against {}",
                        law.name(),
                        forces[particle][d],
                        -slope
                    );
                }
            }
        }
    }
}

#[test]
fn forces_are_the_gradient_of_the_energy() {
    check_gradient([16, 15]);
    check_gradient([8, 8, 7]);
}

/// The range of stretches that kernels report is that of the bonds.
#[test]
fn stretches_are_tracked() {
    fn check<const D: usize>(cells: [usize; D]) {
        let body = Body::damaged(cells, 0.1, 3.015);
        let mut built = body.build();
        let pairs = body.pairs(&built.points);
        let u = Random(29).vectors(built.points.len(), 0.012);
        let law = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
        let fit = fit(&*law, stretch_range(&pairs, &u));
        both(&mut built, &fit, &u);
        let stretches = pairs.iter().map(|p| p.deformed(&u).1);
        let (low, high) = stretches.fold((1.0_f64, 1.0_f64), |(l, h), x| (l.min(x), h.max(x)));
        let lattice: &dyn Bonds<D> = &built.lattice;
        for (bonds, sites) in [(lattice, &built.on_lattice), (&built.cloud, &built.in_cloud)] {
            let observed = peri::bonds::stretch_range(bonds, &scatter(bonds.sites(), sites, &u));
            let found = ((1.0 + observed.low).sqrt(), (1.0 + observed.high).sqrt());
            // roundings of λ²
            assert!(
                (found.0 - low).abs() < 1e-14 && (found.1 - high).abs() < 1e-14,
                "{found:?} {low} {high}"
            );
        }
    }
    check([16, 15]);
    check([8, 8, 7]);
}
