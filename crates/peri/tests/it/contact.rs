//! Contact by Macek & Silling (2007), doi:10.1016/j.finel.2007.08.012, against plain sums and closed forms;
//! balance, energy, objectivity; bodies pressed together; results independent of the list of pairs.

use crate::bodies::{Body, Built, MODULUS, Random, distance, norm, rms, scatter};
use peri::bonds::{BodyGeometry, Bonds, CloudBonds, Overstretched, VolumeCorrection};
use peri::contact::{Contact, SHORT_RANGE};
use peri::field::{CHUNK, Field};

/// Returns contact forces on particles in input order, and the energy.
fn contact<const D: usize>(bonds: &dyn Bonds<D>, sites: &[usize], u: &[[f64; D]]) -> (Vec<[f64; D]>, f64) {
    let field = scatter(bonds.sites(), sites, u);
    let mut contact = Contact::short_range(bonds, MODULUS, SHORT_RANGE).unwrap();
    contact.update(bonds, &field);
    let mut force = Field::zeros(bonds.sites());
    for (chunk, mut out) in force.chunks_mut().into_iter().enumerate() {
        contact.force(bonds, &field, chunk * CHUNK, &mut out);
    }
    (sites.iter().map(|&site| force.get(site)).collect(), contact.summary(bonds, &field).energy)
}

/// Returns contact forces and energy by comparing all pairs, with given volumes and radii; `bonded` by (I,
/// J), I < J.
fn plainly<const D: usize>(
    points: &[[f64; D]],
    volumes: &[f64],
    radii: &[f64],
    horizon: f64,
    bonded: &dyn Fn(usize, usize) -> bool,
    u: &[[f64; D]],
) -> (Vec<[f64; D]>, f64) {
    let (mut forces, mut energy) = (vec![[0.0; D]; points.len()], 0.0);
    let c = 6.0 * MODULUS;
    for i in 0..points.len() {
        for j in i + 1..points.len() {
            let xi: [f64; D] = std::array::from_fn(|d| points[j][d] - points[i][d]);
            let zeta: [f64; D] = std::array::from_fn(|d| xi[d] + u[j][d] - u[i][d]);
            let d_ij = (0.9 * norm(xi)).min(1.35 * (radii[i] + radii[j]));
            let r = norm(zeta);
            if r < d_ij && !bonded(i, j) {
                let push = 15.0 * c / horizon * (d_ij - r);
                energy += 0.5 * push * (d_ij - r) * volumes[i] * volumes[j];
                for d in 0..D {
                    forces[i][d] -= push * volumes[j] * zeta[d] / r;
                    forces[j][d] += push * volumes[i] * zeta[d] / r;
                }
            }
        }
    }
    (forces, energy)
}

#[test]
fn two_particles() {
    // volumes 1 and 1, thickness 1: radii ½; beyond the horizon, so no bond. d = 1.35 = min(0.9·2, 1.35·1)
    let points = [[0.0, 0.0], [2.0, 0.0]];
    let cloud = CloudBonds::new(&points, &[1.0; 2], 1.0, 1.5, VolumeCorrection::None, &[]).unwrap();
    let sites = [0, 1].map(|p| cloud.input_order().iter().position(|&i| i == p).unwrap());
    let stiffness = 15.0 * 6.0 * MODULUS / 1.5;
    for (r, overlap) in [(2.0, 0.0), (1.36, 0.0), (1.35, 0.0), (1.0, 0.35), (0.1, 1.25), (1e-200, 1.35)] {
        let (force, energy) = contact(&cloud, &sites, &[[0.0; 2], [r - 2.0, 0.0]]);
        let push = stiffness * overlap;
        // rounding of 1.35
        assert!((force[1][0] - push).abs() <= 1e-14 * stiffness, "r = {r}: {force:?}");
        assert!((force[0][0] + push).abs() <= 1e-14 * stiffness && force[0][1] == 0.0);
        assert!((energy - 0.5 * push * overlap).abs() <= 1e-14 * stiffness, "r = {r}: {energy}");
    }
    // past each other: pushed on, as contact depends on distances only
    let (force, _) = contact(&cloud, &sites, &[[0.0; 2], [-3.0, 0.0]]);
    assert!(force[1][0] < 0.0);
    // bonded: never
    let near = CloudBonds::new(&points, &[1.0; 2], 1.0, 2.5, VolumeCorrection::None, &[]).unwrap();
    assert_eq!(contact(&near, &sites, &[[0.0; 2], [-1.0, 0.0]]), (vec![[0.0; 2]; 2], 0.0));
}

/// The force at coincident positions (r = 0) is κcd/δ along the reference bond, at any displacement; the
/// other limits are 0.
#[test]
fn degenerate_states() {
    let points = [[0.0, 0.0, 0.0], [1.2, 0.0, 1.6]];
    let cloud = CloudBonds::new(&points, &[1.0; 2], 1.0, 1.0, VolumeCorrection::None, &[]).unwrap();
    let sites = [0, 1].map(|p| cloud.input_order().iter().position(|&i| i == p).unwrap());
    let full = 15.0 * 6.0 * MODULUS * 1.35;
    for there in [[0.0; 3], [0.5, 0.25, -8.0], [0.0, 1e6, 0.0]] {
        let u = [there, std::array::from_fn(|d| there[d] - points[1][d])];
        let (force, energy) = contact(&cloud, &sites, &u);
        if there == [0.0; 3] {
            assert!(
                (norm(force[1]) / full - 1.0).abs() < 1e-14
                    && (energy / (0.5 * full * 1.35) - 1.0).abs() < 1e-14
            );
            assert!((force[1][0] / full - 0.6).abs() < 1e-14 && (force[1][2] / full - 0.8).abs() < 1e-14);
        }
        // places far away are rounded: r is not quite 0 and the direction any
        assert!((norm(force[1]) / full - 1.0).abs() < 1e-9, "{force:?}");
        assert!(norm(std::array::from_fn::<f64, 3, _>(|d| force[0][d] + force[1][d])) <= 1e-15 * full);
    }
    for far in [1e30, 1e200, f64::MAX, f64::INFINITY, f64::NAN] {
        let (force, energy) = contact(&cloud, &sites, &[[0.0; 3], [far, -far, 0.0]]);
        assert_eq!((force, energy), (vec![[0.0; 3]; 2], 0.0), "{far}");
    }
    let one = CloudBonds::new(&points[..1], &[1.0], 1.0, 1.0, VolumeCorrection::None, &[]).unwrap();
    assert_eq!(contact(&one, &[0], &[[7.0; 3]]), (vec![[0.0; 3]], 0.0));
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(
            Contact::short_range(&one, 1.0, bad).is_err() && Contact::short_range(&one, bad, 15.0).is_err()
        );
    }
    assert!(Contact::short_range(&one, 0.0, 15.0).is_err());
    // a body in a heap, all of it in one place: finite
    let built = Body::<2>::solid([12, 12], 1.0, 1.0).build();
    let heap: Vec<[f64; 2]> = built.points.iter().map(|x| x.map(|x| 3.0 - x)).collect();
    let (force, energy) = contact(&built.lattice, &built.on_lattice, &heap);
    assert!(force.iter().flatten().all(|f| f.is_finite()) && energy > 0.0);
}

/// Large random displacements of a body with a hole and cracks: lattice and cloud against all pairs, in
/// order.
fn check_plainly<const D: usize>(cells: [usize; D]) {
    let body = Body::damaged(cells, 0.1, 2.015);
    let built = body.build();
    let count = built.points.len();
    let bonds = body.pairs(&built.points);
    let bonded = |i: usize, j: usize| bonds.binary_search_by_key(&(i, j), |p| (p.i, p.j)).is_ok();
    for size in [0.03, 0.1, 0.3] {
        let u = Random(3).vectors(count, size);
        let volumes = vec![0.1_f64.powi(D as i32); count];
        let (expected, energy) =
            plainly(&built.points, &volumes, &vec![0.05; count], body.horizon(), &bonded, &u);
        assert!(energy > 0.0, "{size}: nothing touches");
        let lattice = contact(&built.lattice, &built.on_lattice, &u);
        let cloud = contact(&built.cloud, &built.in_cloud, &u);
        for (name, (force, stored)) in [("lattice", lattice), ("cloud", cloud)] {
            // rounding: overlaps of 0.1 from places of 2 to 1e-15
            let apart = distance(&force, &expected) / rms(&expected);
            assert!(apart < 1e-12, "{name} {cells:?}, {size}: {apart:.1e}");
            assert!((stored / energy - 1.0).abs() < 1e-12, "{name} {cells:?}, {size}: {stored} {energy}");
        }
    }
}

#[test]
fn lattice_and_cloud_equal_plain_sums() {
    check_plainly([22, 17]);
    check_plainly([9, 8, 7]);
    check_plainly([4, 5, 24]);
}

/// Pairs whose bonds break join the existing list, and later moves within its skin need no new list.
fn check_parted<const D: usize>(cells: [usize; D]) {
    fn parted<const D: usize>(bonds: &mut dyn Bonds<D>, sites: &[usize], count: usize) {
        let mut random = Random(11);
        let (u, step) = (random.vectors::<D>(count, 0.04), random.vectors::<D>(count, 0.002));
        let mut contact = Contact::short_range(bonds, MODULUS, SHORT_RANGE).unwrap();
        contact.rebuild(bonds, &scatter(bonds.sites(), sites, &u));
        let rebuilds = contact.rebuilds();
        // every fifth bond in one half of the body, and all in a corner
        let (mut list, mut pairs) = (Vec::new(), Vec::new());
        for &site in sites {
            bonds.neighbours(site, &mut |bond| {
                let low = |site: usize| bonds.position(site).into_iter().fold(0.0, f64::max) < 0.5;
                let one = bonds.position(site)[0] < 1.0 && (site + bond.site).is_multiple_of(5);
                let one = one && bonds.position(bond.site)[0] < 1.0;
                if one || low(site) || low(bond.site) {
                    let (site, index, length) = (site as u32, bond.index, bond.length);
                    list.push(Overstretched { site, index, elongation: 1.0, length, weight: bond.weight });
                    pairs.push([site, bond.site as u32]);
                }
            });
        }
        for (bond, pair) in list.iter().zip(&pairs) {
            assert_eq!(bonds.bond(bond.site as usize, bond.index).site, pair[1] as usize);
        }
        bonds.break_bonds(&list);
        contact.add_broken_pairs(bonds, &pairs);
        let moved: Vec<[f64; D]> =
            u.iter().zip(&step).map(|(u, s)| std::array::from_fn(|d| u[d] + s[d])).collect();
        let field = scatter(bonds.sites(), sites, &moved);
        contact.update(bonds, &field);
        assert_eq!(contact.rebuilds(), rebuilds, "the list was made again");
        let mut fresh = Contact::short_range(bonds, MODULUS, SHORT_RANGE).unwrap();
        fresh.rebuild(bonds, &field);
        let forces = |contact: &Contact<D>| {
            let mut force = Field::zeros(bonds.sites());
            for (chunk, mut out) in force.chunks_mut().into_iter().enumerate() {
                contact.force(bonds, &field, chunk * CHUNK, &mut out);
            }
            force
        };
        assert_eq!(forces(&contact), forces(&fresh));
        assert_eq!(contact.summary(bonds, &field), fresh.summary(bonds, &field));
        assert!(contact.summary(bonds, &field).pairs > 50);
        // what is listed is not listed twice
        contact.add_broken_pairs(bonds, &pairs);
        assert_eq!(contact.summary(bonds, &field), fresh.summary(bonds, &field));
    }
    let built = Body::damaged(cells, 0.1, 2.015).build();
    let Built { mut lattice, mut cloud, points, on_lattice, in_cloud } = built;
    parted(&mut lattice, &on_lattice, points.len());
    parted(&mut cloud, &in_cloud, points.len());
}

#[test]
fn broken_bonds_join_the_list() {
    check_parted([22, 17]);
    check_parted([12, 9, 8]);
}

/// Two blocks approach, a spacing in five steps, and shake: the list is rebuilt where they meet, not during
/// the approach, and forces always equal those of a new list.
#[test]
fn a_list_holds_while_bodies_fly() {
    let block = |low: f64| (0..36).map(move |k| [low + f64::from(k % 6), f64::from(k / 6)]);
    let points: Vec<[f64; 2]> = block(0.0).chain(block(40.0)).collect();
    let cloud = CloudBonds::new(&points, &[1.0; 72], 1.0, 1.5, VolumeCorrection::None, &[]).unwrap();
    let mut sites = vec![0; 72];
    for (site, &particle) in cloud.input_order().iter().enumerate() {
        sites[particle as usize] = site;
    }
    let forces = |contact: &Contact<2>, u: &Field<2>| {
        let mut force = Field::zeros(cloud.sites());
        for (chunk, mut out) in force.chunks_mut().into_iter().enumerate() {
            contact.force(&cloud, u, chunk * CHUNK, &mut out);
        }
        force
    };
    let mut contact = Contact::short_range(&cloud, MODULUS, SHORT_RANGE).unwrap();
    let (first, mut far, mut random) = (contact.rebuilds(), 0, Random(5));
    for step in 0..220 {
        let shaken = random.vectors::<2>(72, 0.02);
        let flown = |k: usize| if k < 36 { 1.0 } else { -1.0 } * 0.1 * f64::from(step);
        let u: Vec<[f64; 2]> = (0..72).map(|k| [flown(k) + shaken[k][0], 300.0 + shaken[k][1]]).collect();
        let mut u = scatter(cloud.sites(), &sites, &u);
        if step == 219 {
            u.set(sites[7], [f64::NAN, 0.0]);
            u.set(sites[40], [1e300, -1e300]);
        }
        contact.update(&cloud, &u);
        let mut fresh = Contact::short_range(&cloud, MODULUS, SHORT_RANGE).unwrap();
        fresh.rebuild(&cloud, &u);
        assert_eq!(forces(&contact, &u), forces(&fresh, &u), "{step}");
        assert_eq!(contact.summary(&cloud, &u), fresh.summary(&cloud, &u), "{step}");
        let gap = 35.0 - 0.2 * f64::from(step);
        if gap > 8.0 {
            far = contact.rebuilds() - first;
        }
    }
    // 27 spacings against each other, of which a skin takes half of one
    assert!(far <= 8, "{far} lists on the way");
    assert!(contact.rebuilds() - first > far, "none where they met");
}

/// Scattered points with volumes from 1 to 5 times the smallest.
#[test]
fn unequal_volumes() {
    let mut random = Random(8);
    let points = random.vectors::<3>(400, 1.0);
    let volumes: Vec<f64> = (0..400).map(|_| 0.01 * (3.0 + 2.0 * random.next())).collect();
    let cloud = CloudBonds::new(&points, &volumes, 1.0, 0.3, VolumeCorrection::None, &[]).unwrap();
    let mut sites = vec![0; 400];
    for (site, &particle) in cloud.input_order().iter().enumerate() {
        sites[particle as usize] = site;
    }
    let radii: Vec<f64> = volumes.iter().map(|v| 0.5 * v.cbrt()).collect();
    let bonded = |i: usize, j: usize| {
        let xi: [f64; 3] = std::array::from_fn(|d| points[j][d] - points[i][d]);
        norm(xi) <= 0.3
    };
    let u = random.vectors(400, 0.2);
    let (expected, energy) = plainly(&points, &volumes, &radii, 0.3, &bonded, &u);
    let (force, stored) = contact(&cloud, &sites, &u);
    // rounding, as above
    assert!(distance(&force, &expected) / rms(&expected) < 1e-12 && (stored / energy - 1.0).abs() < 1e-12);
    let momentum: [f64; 3] = std::array::from_fn(|d| force.iter().zip(&volumes).map(|(f, v)| f[d] * v).sum());
    let size: f64 = force.iter().zip(&volumes).map(|(f, v)| norm(*f) * v).sum();
    assert!(norm(momentum) < 1e-13 * size);
    // V f = −∂E/∂u by central differences: E is quadratic, but for pairs that touch within the difference
    for &particle in &[0, 57, 123, 399] {
        for d in 0..3 {
            let energy = |step: f64| {
                let mut moved = u.clone();
                moved[particle][d] += step;
                contact(&cloud, &sites, &moved).1
            };
            let slope = (energy(1e-6) - energy(-1e-6)) / 2e-6;
            let exact = -volumes[particle] * force[particle][d];
            assert!((slope - exact).abs() < 1e-6 * volumes[particle] * rms(&force), "{slope} {exact}");
        }
    }
}

fn check_balance<const D: usize>(cells: [usize; D]) {
    let body = Body::damaged(cells, 0.1, 2.015);
    let Built { lattice, points, on_lattice, .. } = body.build();
    let volume = 0.1_f64.powi(D as i32);
    let u = Random(21).vectors(points.len(), 0.1);
    let (force, _) = contact(&lattice, &on_lattice, &u);
    let size: f64 = force.iter().map(|f| norm(*f)).sum();
    let place: Vec<[f64; D]> =
        points.iter().zip(&u).map(|(x, u)| std::array::from_fn(|d| x[d] + u[d])).collect();
    for a in 0..D {
        // rounding of some 1e3 pairs
        assert!(force.iter().map(|f| f[a]).sum::<f64>().abs() < 1e-12 * size);
        for b in 0..a {
            let moment: f64 = place.iter().zip(&force).map(|(x, f)| x[a] * f[b] - x[b] * f[a]).sum();
            assert!(moment.abs() < 1e-12 * size);
        }
    }
    // V f = −∂E/∂u; ± 1e-6 of rms is the rounding of E over the step, and of pairs that touch within it
    for &particle in &[0, 5, points.len() / 2, points.len() - 1] {
        for d in 0..D {
            let energy = |step: f64| {
                let mut moved = u.clone();
                moved[particle][d] += step;
                contact(&lattice, &on_lattice, &moved).1
            };
            let slope = (energy(1e-7) - energy(-1e-7)) / 2e-7;
            let error = slope + volume * force[particle][d];
            assert!(error.abs() < 1e-6 * volume * rms(&force), "{error:.1e} of {:.1e}", volume * rms(&force));
        }
    }
    // turned by 0.83 in the plane of the first two axes, and shifted
    let (s, c) = 0.83_f64.sin_cos();
    let turn = |x: [f64; D]| {
        let mut y = x;
        (y[0], y[1]) = (c * x[0] - s * x[1], s * x[0] + c * x[1]);
        y
    };
    let turned: Vec<[f64; D]> =
        points.iter().zip(&place).map(|(x, p)| std::array::from_fn(|d| turn(*p)[d] - x[d] + 3.0)).collect();
    let (after, _) = contact(&lattice, &on_lattice, &turned);
    let expected: Vec<[f64; D]> = force.iter().map(|&f| turn(f)).collect();
    // displacements of 5 rounded to 4e-16, over overlaps of 0.1
    assert!(distance(&after, &expected) / rms(&force) < 1e-12);
}

#[test]
fn contact_balances_has_an_energy_and_turns() {
    check_balance([22, 17]);
    check_balance([9, 8, 7]);
}

/// Two rigid blocks, one cell apart across a cut, come closer by u: per column, pairs straight across (d =
/// 0.9) and to either side (d = 0.9√2), as long as the next row (d = 1.35, 2 − u apart) does not touch.
#[test]
fn force_over_penetration_of_rigid_blocks() {
    let columns = 40;
    let mut body = Body::<2>::solid([columns, 10], 1.0, 3.015);
    body.slits = vec![crate::bodies::Slit { at: 5.0, from: -1.0, to: 41.0 }];
    let built = body.build();
    for u in [0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 0.6] {
        let moved: Vec<[f64; 2]> =
            built.points.iter().map(|x| if x[1] > 5.0 { [0.0, -u] } else { [0.0; 2] }).collect();
        let (force, _) = contact(&built.lattice, &built.on_lattice, &moved);
        let lifted: f64 =
            built.points.iter().zip(&force).filter(|(x, _)| x[1] > 5.0).map(|(_, f)| f[1]).sum();
        let all: f64 = force.iter().map(|f| f[1]).sum();
        let (straight, diagonal) = (1.0 - u, ((1.0 - u) * (1.0 - u) + 1.0_f64).sqrt());
        let side = (0.9 * 2.0_f64.sqrt() - diagonal).max(0.0) * (1.0 - u) / diagonal;
        let columns = columns as f64;
        let pairs = columns * (0.9 - straight).max(0.0) + 2.0 * (columns - 1.0) * side;
        let expected = 15.0 * 6.0 * MODULUS / 3.015 * pairs;
        // rounding of places up to 40
        assert!((lifted - expected).abs() < 1e-12 * (1.0 + expected), "u = {u}: {lifted} {expected}");
        assert!(all.abs() < 1e-12 * (1.0 + expected));
    }
}
