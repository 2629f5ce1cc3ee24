//! Solids of the mean deformation in irregular clouds: kernels against plain loops, patch test, order of
//! convergence, a hole.

use crate::bodies::{Random, hold};
use crate::materials::checks;
use crate::solid_kernels::PlainLoops;
use crate::solids::{displaced, neo_hooke, rubber};
use crate::spectra::{COLLAR, errors, forces};
use evidence::{at_most, near, within};
use peri::bonds::{
    BodyGeometry, BondDamage, BondForces, Bonds, CloudBonds, Overstretched, Softened, StretchRange,
    VolumeCorrection,
};
use peri::calibrate::Space;
use peri::field::Field;
use peri::material::{
    BodyTensor, Family, Material, NonlocalSolid, PointLaw, Pointwise, SolverMaterial, relief,
};
use peri::solver::{Lbfgs, Method, State, System};
use std::f64::consts::PI;

/// Block of side^D cells with particles shifted by up to `jitter` spacings along each axis and volumes random
/// within ±`uneven`.
struct Scattered {
    side: usize,
    spacing: f64,
    ratio: f64,
    jitter: f64,
    uneven: f64,
    correction: VolumeCorrection,
}

impl Scattered {
    fn new(side: usize, jitter: f64) -> Self {
        let correction = VolumeCorrection::None;
        Self { side, spacing: 1.0, ratio: 3.015, jitter, uneven: 0.0, correction }
    }

    /// Builds the bonds, with θ if `relieved`.
    fn build<const D: usize>(&self, relieved: bool) -> CloudBonds<D> {
        let mut random = Random(5);
        let count = self.side.pow(D as u32);
        let place = |k: usize| {
            std::array::from_fn(|d| {
                let cell = k / self.side.pow(d as u32) % self.side;
                (cell as f64 + 0.5 + self.jitter * random.next()) * self.spacing
            })
        };
        let points: Vec<[f64; D]> = (0..count).map(place).collect();
        let volume = self.spacing.powi(D as i32);
        let volumes: Vec<f64> = (0..count).map(|_| volume * (1.0 + self.uneven * random.next())).collect();
        let horizon = self.ratio * self.spacing;
        let mut cloud = CloudBonds::new(&points, &volumes, 1.0, horizon, self.correction, &[]).unwrap();
        if relieved {
            relieve(&mut cloud);
        }
        cloud
    }
}

fn relieve<const D: usize>(cloud: &mut CloudBonds<D>) {
    let theta = relief(cloud).unwrap();
    cloud.set_relief(theta);
}

fn sites<const D: usize>(bonds: &dyn Bonds<D>) -> impl Iterator<Item = usize> + '_ {
    bonds.particles().iter().map(|&site| site as usize)
}

fn field<const D: usize>(bonds: &dyn Bonds<D>, value: impl Fn([f64; D]) -> [f64; D]) -> Field<D> {
    let mut field = Field::zeros(bonds.sites());
    sites(bonds).for_each(|site| field.set(site, value(bonds.position(site))));
    field
}

fn largest<const D: usize>(field: &Field<D>) -> f64 {
    field.components().iter().flat_map(|c| c.iter()).fold(0.0, |most, x| most.max(x.abs()))
}

/// Severs each bond that `choose` selects by its ends.
fn sever<const D: usize>(bonds: &mut CloudBonds<D>, mut choose: impl FnMut(usize, usize) -> bool) {
    let mut list = Vec::new();
    for site in 0..bonds.sites() {
        bonds.neighbours(site, &mut |bond| {
            if site < bond.site && choose(site, bond.site) {
                let entry = |site: usize, index| {
                    let site = site as u32;
                    list.push(Overstretched { site, index, elongation: 0.0, length: 1.0, weight: 1.0 });
                };
                both(bonds, site, bond.site, entry);
            }
        });
    }
    bonds.break_bonds(&list);
}

/// Returns the entries of a bond at both ends.
fn both<const D: usize>(bonds: &CloudBonds<D>, site: usize, other: usize, mut name: impl FnMut(usize, u32)) {
    for (from, to) in [(site, other), (other, site)] {
        let mut index = 0;
        bonds.neighbours(from, &mut |bond| index = if bond.site == to { bond.index } else { index });
        name(from, index);
    }
}

/// Kernels agree with plain loops, with and without θ: intact, with broken and softened bonds, and with so
/// few bonds that particles have springs or no bond.
fn kernels_are_plain_loops<const D: usize>(space: Space, side: usize, correction: VolumeCorrection) {
    for relieved in [false, true] {
        let scattered = Scattered { uneven: 0.3, correction, ..Scattered::new(side, 0.25) };
        let mut bonds = scattered.build::<D>(relieved);
        let displacement = field(&bonds, displaced);
        let mut fast = rubber::<D>(space, 10.0).respond(&bonds);
        let mut plain = PlainLoops(rubber::<D>(space, 10.0)).respond(&bonds);
        let mut random = Random(7);
        for severed in [-1.0, -0.4, 0.6, 1.0] {
            let half = bonds.sites() / 2;
            sever(&mut bonds, |site, _| match severed {
                1.0 => site < half,
                part => random.next() < part,
            });
            let mut soft = Vec::new();
            for site in 0..bonds.sites() {
                bonds.neighbours(site, &mut |bond| {
                    // a bond that is softened once stays so until it breaks
                    if site < bond.site && (31 * site + 17 * bond.site) % 9 == 0 {
                        both(&bonds, site, bond.site, |site, index| {
                            soft.push(Softened { site: site as u32, index, greatest: 1.0, integrity: 0.4 });
                        });
                    }
                });
            }
            bonds.soften(soft);
            let mut found = Vec::new();
            for material in [&mut fast, &mut plain] {
                material.prepare(&bonds, &displacement);
                let (mut force, mut seen) = (Field::<D>::zeros(bonds.sites()), StretchRange::REST);
                for (chunk, mut part) in force.chunks_mut().into_iter().enumerate() {
                    material.force(
                        &bonds,
                        &displacement,
                        chunk * peri::field::CHUNK,
                        &mut part,
                        Some(&mut seen),
                    );
                }
                found.push((force, seen, material.energy(&bonds, &displacement, StretchRange::REST)));
            }
            let (a, b) = (&found[0], &found[1]);
            let apart = |site: usize| (0..D).map(move |d| (a.0.get(site)[d] - b.0.get(site)[d]).abs());
            let apart = (0..bonds.sites()).flat_map(apart).fold(0.0, f64::max);
            at_most("cloud_kernel_forces", apart / largest(&b.0).max(1e-12), 1e-12);
            at_most("cloud_kernel_energy", (a.2 - b.2).abs() / b.2.abs().max(1e-12), 1e-12);
            let off = |a: f64, b: f64| (a - b).abs() < 1e-13;
            assert!(off(a.1.low, b.1.low) && off(a.1.high, b.1.high), "{severed}");
        }
    }
}

#[test]
fn kernels_of_solids_in_clouds_are_plain_loops() {
    for correction in [VolumeCorrection::None, VolumeCorrection::Linear] {
        kernels_are_plain_loops::<2>(Space::PlaneStrain, 12, correction);
        kernels_are_plain_loops::<3>(Space::Solid, 9, correction);
    }
}

/// θ and forces have the same bits on 1 and 2 threads.
#[test]
fn bits_in_clouds_do_not_depend_on_threads() {
    let found = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let bonds = Scattered::new(68, 0.2).build::<2>(true);
            assert!(bonds.sites() > peri::field::CHUNK);
            let displacement = field(&bonds, displaced);
            let mut solid = neo_hooke::<2>(Space::PlaneStrain, 10.0).respond(&bonds);
            (bonds.relief().cloned().unwrap(), forces(&mut *solid, &bonds, &displacement))
        })
    });
    assert!(found[0] == found[1]);
}

/// Forces and gradients of every particle agree with corr.py, intact and with a cut
/// (`docs/reference/correspondence/t_relieved.py`).
#[test]
fn relieved_clouds_agree_with_an_independent_program() {
    let number = |text: &str| text.trim().parse::<f64>().unwrap();
    let rows: Vec<Vec<f64>> = include_str!("solid_relieved.csv")
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(number).collect())
        .collect();
    let points: Vec<[f64; 2]> = rows.iter().map(|row| [row[0], row[1]]).collect();
    let volumes: Vec<f64> = rows.iter().map(|row| row[2]).collect();
    let mut bonds = CloudBonds::new(&points, &volumes, 1.0, 3.015, VolumeCorrection::None, &[]).unwrap();
    relieve(&mut bonds);
    let order: Vec<usize> = bonds.input_order().iter().map(|&particle| particle as usize).collect();
    for site in 0..bonds.sites() {
        let moves = bonds.relief().unwrap().get(site) != [0.0; 2];
        assert_eq!(moves, rows[order[site]][15] == 1.0, "{:?}", bonds.position(site));
    }
    let displacement = field(&bonds, displaced);
    let mut material = Pointwise::new(neo_hooke::<2>(Space::PlaneStrain, 5.0 / 3.0), &bonds);
    for (name, first, energy) in [("intact", 3, 1.12472032724), ("cut", 9, 1.06976677758)] {
        if first == 9 {
            let at = |site: usize| points[order[site]];
            sever(&mut bonds, |site, other| {
                let (p, q) = (at(site), at(other));
                let crossing = p[1] + (5.5 - p[0]) / (q[0] - p[0]) * (q[1] - p[1]);
                (p[0] - 5.5) * (q[0] - 5.5) < 0.0 && crossing < 5.2
            });
        }
        let force = forces(&mut material, &bonds, &displacement);
        let (mut off, mut turned) = (0.0_f64, 0.0_f64);
        for site in 0..bonds.sites() {
            let row = &rows[order[site]][first..];
            let gradient = material.points()[site].deformation().unwrap().gradient();
            for a in 0..2 {
                off = off.max((force.get(site)[a] * bonds.volume(site) - row[a]).abs());
                for b in 0..2 {
                    turned = turned.max((gradient[(a, b)] - row[2 + 2 * a + b]).abs());
                }
            }
        }
        at_most(&format!("solid_relieved_{name}_force"), off, 1e-11);
        at_most(&format!("solid_relieved_{name}_gradient"), turned, 1e-11);
        let found = material.energy(&bonds, &displacement, StretchRange::REST);
        near(&format!("solid_relieved_{name}_energy"), found, energy, 5e-12 * energy);
    }
}

/// Returns the largest force on an inner particle under a uniform F, over μ and the spacing, and the largest
/// error of F.
fn patch<L: PointLaw<D>, const D: usize>(
    bonds: &CloudBonds<D>,
    solid: NonlocalSolid<L>,
    inside: impl Fn(f64) -> bool,
) -> (f64, f64) {
    let gradient = [[0.1, 0.05, -0.02], [-0.03, -0.05, 0.04], [0.06, 0.01, 0.03]];
    let displacement =
        field(bonds, |x| std::array::from_fn(|a| (0..D).map(|b| gradient[a][b] * x[b]).sum::<f64>()));
    let mut material = Pointwise::new(solid, bonds);
    let force = forces(&mut material, bonds, &displacement);
    let (mut residual, mut off) = (0.0_f64, 0.0_f64);
    for site in sites(bonds) {
        let found = material.points()[site].deformation().unwrap().displacement_gradient;
        off = off.max((found - BodyTensor::<D>::from_fn(|a, b| gradient[a][b])).amax());
        if bonds.position(site).iter().all(|&x| inside(x)) {
            let force = force.get(site).iter().fold(0.0_f64, |most, f| most.max(f.abs()));
            residual = residual.max(force * bonds.volume(site));
        }
    }
    (residual, off)
}

/// Uniform deformation is in equilibrium in every family away from surfaces.
#[test]
fn jittered_clouds_pass_the_patch_test() {
    for jitter in [0.1, 0.2] {
        let plane = |relieved| {
            let bonds = Scattered { uneven: 0.2, ..Scattered::new(16, jitter) }.build::<2>(relieved);
            patch(&bonds, neo_hooke::<2>(Space::PlaneStrain, 5.0 / 3.0), |x| x > 3.0 && x < 13.0)
        };
        let space = |relieved| {
            let bonds = Scattered { uneven: 0.2, ..Scattered::new(9, jitter) }.build::<3>(relieved);
            patch(&bonds, rubber::<3>(Space::Solid, 5.0 / 3.0), |x| x > 3.0 && x < 6.0)
        };
        for (name, [before, after]) in [("2d", [false, true].map(plane)), ("3d", [false, true].map(space))] {
            within(&format!("patch_{name}_{jitter}_plain"), before.0, 1e-2, 0.3);
            at_most(&format!("patch_{name}_{jitter}"), after.0, 1e-12);
            at_most(&format!("patch_{name}_{jitter}_gradient"), before.1.max(after.1), 1e-13);
        }
    }
}

/// Forces are slopes of the energy to 1e-9: intact, with 30 % of the bonds broken, and with some particles on
/// springs.
fn slopes<const D: usize>(space: Space, side: usize, ratio: f64) {
    let mut bonds = Scattered { ratio, uneven: 0.2, ..Scattered::new(side, 0.2) }.build::<D>(true);
    let displacement = field(&bonds, displaced);
    let mut random = Random(3);
    for (severed, bound) in [(-1.0, 1e-9), (-0.4, 1e-9), (0.8, 1e-8)] {
        sever(&mut bonds, |_, _| random.next() < severed);
        let mut material = rubber::<D>(space, 5.0).respond(&bonds);
        let force = forces(&mut *material, &bonds, &displacement);
        let mut direction = Field::<D>::zeros(bonds.sites());
        sites(&bonds).for_each(|site| direction.set(site, std::array::from_fn(|_| random.next())));
        let mut at = |size: f64| {
            let mut moved = displacement.clone();
            for site in sites(&bonds) {
                let (u, v) = (displacement.get(site), direction.get(site));
                moved.set(site, std::array::from_fn(|d| u[d] + size * v[d]));
            }
            material.energy(&bonds, &moved, StretchRange::REST)
        };
        let step = 2e-4;
        let slope = (8.0 * (at(step) - at(-step)) - at(2.0 * step) + at(-2.0 * step)) / (12.0 * step);
        let product = |a: &Field<D>, b: &Field<D>| {
            let one = |site: usize| (0..D).map(move |d| a.get(site)[d] * b.get(site)[d]).sum::<f64>();
            sites(&bonds).map(|site| one(site) * bonds.volume(site)).sum::<f64>()
        };
        let size = (product(&force, &force) * product(&direction, &direction)).sqrt();
        let off = (slope + product(&force, &direction)).abs() / size;
        at_most(&format!("relieved_forces_{D}d_severed_{severed}"), off, bound);
    }
}

#[test]
fn forces_in_relieved_clouds_are_slopes() {
    slopes::<2>(Space::PlaneStrain, 14, 3.015);
    slopes::<2>(Space::PlaneStress, 14, 3.015);
    slopes::<3>(Space::Solid, 8, 2.015);
}

/// The released energy of a bond is the derivative of the energy by its integrity, to finite differences.
#[test]
fn bonds_of_relieved_clouds_release_the_slope_of_the_energy() {
    let mut bonds = Scattered { uneven: 0.2, ..Scattered::new(12, 0.2) }.build::<2>(true);
    let displacement = field(&bonds, displaced);
    let solid = rubber::<2>(Space::PlaneStrain, 5.0);
    let mut states = Pointwise::new(solid.clone(), &bonds);
    let middle =
        (0..bonds.sites()).find(|&s| bonds.position(s).iter().all(|x| (x - 6.0).abs() < 0.8)).unwrap();
    let mut family = Vec::new();
    bonds.neighbours(middle, &mut |bond| family.push(bond));
    let whole = |site: usize| {
        let mut sum = 0.0;
        bonds.neighbours(site, &mut |bond| sum += bonds.volume(bond.site));
        sum
    };
    let shares: Vec<[f64; 2]> = family
        .iter()
        .map(|bond| [bonds.volume(bond.site) / whole(middle), bonds.volume(middle) / whole(bond.site)])
        .collect();
    for (bond, shares) in family.iter().zip(shares).step_by(5) {
        let mut at = |integrity: f64| {
            let mut soft = Vec::new();
            both(&bonds, middle, bond.site, |site, index| {
                soft.push(Softened { site: site as u32, index, greatest: 1.0, integrity });
            });
            bonds.soften(soft);
            states.energy(&bonds, &displacement, StretchRange::REST)
        };
        let step = 1e-4;
        let slope = (at(0.5 + step) - at(0.5 - step)) / (2.0 * step);
        at(0.5);
        let seen = peri::material::Bond::new(middle, bond, &displacement);
        let said: f64 = [middle, bond.site]
            .iter()
            .zip(shares)
            .map(|(&end, share)| {
                let point = &states.points()[end];
                let weighed = solid.energy(&Family::new(&bonds, &displacement, end), point);
                let seen = if end == middle {
                    seen
                } else {
                    let turned = |x: [f64; 2]| x.map(|x| -x);
                    let (reference, change) = (turned(seen.reference), turned(seen.change));
                    peri::material::Bond { reference, change, relief: turned(seen.relief), ..seen }
                };
                solid.released_energy(&seen, point, weighed).unwrap() * share * bonds.volume(end)
            })
            .sum();
        near("relieved_released_energy", slope / said, 1.0, 1e-6);
    }
}

/// Relieved clouds pass the checks of all materials, including the bound of the stiffness.
#[test]
fn relieved_clouds_pass_the_battery() {
    let mut greatest = 0.0_f64;
    for (jitter, bulk) in [(0.1, 5.0 / 3.0), (0.25, 5.0 / 3.0), (0.25, 100.0)] {
        let name = |d: usize| format!("relieved {d}D, jitter {jitter}, K/μ = {bulk}");
        let mut plane = Scattered::new(9, jitter).build::<2>(true);
        let at = field(&plane, displaced);
        let make = |bonds: &dyn Bonds<2>| rubber::<2>(Space::PlaneStrain, bulk).respond(bonds);
        greatest = greatest.max(checks(name(2), &mut plane, &make, at));
        let mut space = Scattered { ratio: 2.015, ..Scattered::new(6, jitter) }.build::<3>(true);
        let at = field(&space, displaced);
        let make = |bonds: &dyn Bonds<3>| rubber::<3>(Space::Solid, bulk).respond(bonds);
        greatest = greatest.max(checks(name(3), &mut space, &make, at));
    }
    println!("λmax(K)/s V in relieved clouds: {greatest:.3}; the bound is 2");
}

/// Manufactured finite deformation on clouds shifted by a fifth of the spacing. An independent program has on
/// another cloud errors of 4.7e-3, 3.0e-3, 1.3e-3 plain and 3.3e-3, 5.8e-4, 1.2e-4 relieved.
#[test]
fn manufactured_deformations_of_clouds_converge() {
    let found = [false, true].map(|relieved| {
        [8, 16, 32].map(|n: usize| {
            let spacing = 1.0 / n as f64;
            let scattered = Scattered { spacing, ..Scattered::new(n + 2 * COLLAR, 0.2) };
            errors(&mut scattered.build::<2>(relieved), n, 5.0 / 3.0, 0.05)[0]
        })
    });
    let reference = [[4.66e-3, 3.03e-3, 1.33e-3], [3.26e-3, 5.81e-4, 1.21e-4]];
    println!("plain {:?}, relieved {:?}", found[0], found[1]);
    for (name, (found, reference)) in ["plain", "relieved"].iter().zip(found.iter().zip(reference)) {
        for (n, (found, reference)) in [8, 16, 32].iter().zip(found.iter().zip(reference)) {
            within(&format!("cloud_manufactured_{name}_{n}"), found / reference, 0.6, 1.6);
        }
    }
    at_most("cloud_manufactured_order_below_2", 2.0 - (found[1][1] / found[1][2]).log2(), 0.0);
}

/// Plate with a hole as rings of particles, Kirsch's displacements beyond three radii, plane strain, K/μ =
/// 5/3: rms error of the stress beyond 1.5 radii over the remote stress. The independent program has 0.01763
/// and 0.01622 plain; with the correction in all families away from rims 0.00954 and 0.00321 (0.0088 and
/// 0.0029 with it from two horizons off the rim).
#[test]
fn rings_around_a_hole() {
    let found = [false, true].map(|relieved| [10, 20].map(|n| ring_error(n, relieved)));
    println!("plain {:.4?}, relieved {:.4?}", found[0], found[1]);
    for (name, (found, reference)) in
        ["plain", "relieved"].iter().zip(found.iter().zip([[0.01763, 0.01622], [0.00954, 0.00321]]))
    {
        for (n, (found, reference)) in [10, 20].iter().zip(found.iter().zip(reference)) {
            near(&format!("ring_cloud_{name}_{n}"), *found, reference, 1e-4);
        }
    }
}

fn ring_error(n: usize, relieved: bool) -> f64 {
    let (spacing, outer, size) = (1.0 / n as f64, 3.0, 1e-4);
    let (mut points, mut volumes) = (Vec::new(), Vec::new());
    for ring in 0..(2.0 / spacing).round() as usize + 10 {
        let radius = 1.0 + (ring as f64 + 0.5) * spacing;
        let count = (2.0 * PI * radius / spacing).round();
        for k in 0..count as usize {
            let angle = (k as f64 + 0.5 * (ring % 2) as f64) * 2.0 * PI / count + 0.1 * ring as f64;
            points.push([radius * angle.cos(), radius * angle.sin()]);
            volumes.push(2.0 * PI * radius * spacing / count);
        }
    }
    let horizon = 3.015 * spacing;
    let mut bonds = CloudBonds::new(&points, &volumes, 1.0, horizon, VolumeCorrection::None, &[]).unwrap();
    if relieved {
        relieve(&mut bonds);
    }
    let exact = field(&bonds, |x| kirsch(x).0.map(|u| size * u));
    let loads = hold(&bonds, |x| (x[0].hypot(x[1]) >= outer).then(|| (3, kirsch(x).0.map(|u| size * u))));
    let solid = neo_hooke::<2>(Space::PlaneStrain, 5.0 / 3.0);
    let mut state = State::new(bonds.sites());
    state.displacement.clone_from(&exact);
    let mut system = System::new(&mut bonds, solid.clone(), &loads, &[1.0]);
    let method = Lbfgs { tolerance: 1e-6, max_iterations: 5000, ..Default::default() };
    method.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap();
    drop(system);
    assert_eq!(state.counts.unconverged, 0);
    let mut material = Pointwise::new(solid.clone(), &bonds);
    material.prepare(&bonds, &state.displacement);
    let (mut sum, mut count) = (0.0, 0);
    for site in sites(&bonds) {
        let x = bonds.position(site);
        let radius = x[0].hypot(x[1]);
        if radius > 1.5 && radius < outer {
            let piola = solid.law().respond(material.points()[site].deformation().unwrap()).piola / size;
            let truth = kirsch(x).1;
            let found = [piola[(0, 0)], piola[(1, 1)], piola[(0, 1)]];
            sum += (0..3).map(|k| (found[k] - truth[k]).powi(2)).sum::<f64>();
            count += 1;
        }
    }
    (sum / f64::from(count)).sqrt()
}

/// Kirsch's displacement and stress (xx, yy, xy) around a free hole of radius 1 under unit tension along x, μ
/// = 1, K = 5/3.
fn kirsch([x, y]: [f64; 2]) -> ([f64; 2], [f64; 3]) {
    let (poisson, t) = (0.25, y.atan2(x));
    let (k, q) = (3.0 - 4.0 * poisson, 1.0 / x.hypot(y));
    let cube = 2.0 * q.powi(3);
    let along =
        (k + 1.0) / q * t.cos() + 2.0 * q * ((1.0 + k) * t.cos() + (3.0 * t).cos()) - cube * (3.0 * t).cos();
    let across =
        (k - 3.0) / q * t.sin() + 2.0 * q * ((1.0 - k) * t.sin() + (3.0 * t).sin()) - cube * (3.0 * t).sin();
    let (square, fourth) = (q * q, 1.5 * q.powi(4));
    let ([c2, c4], [s2, s4]) = ([2.0, 4.0].map(|n| (n * t).cos()), [2.0, 4.0].map(|n| (n * t).sin()));
    let stress = [
        1.0 - square * (1.5 * c2 + c4) + fourth * c4,
        -square * (0.5 * c2 - c4) - fourth * c4,
        -square * (0.5 * s2 + s4) + fourth * s4,
    ];
    ([along / 8.0, across / 8.0], stress)
}
