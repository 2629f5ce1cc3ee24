//! Coulomb friction and rigid planes in explicit dynamics: closed forms of a particle, plain sums, balances.

use crate::bodies::{Body, MODULUS, Random, Slit, norm};
use crate::dynamics::DENSITY;
use peri::Error;
use peri::bonds::{BodyGeometry, Bonds, CloudBonds, VolumeCorrection};
use peri::contact::{Contact, RigidSurface, SHORT_RANGE, SurfaceShape};
use peri::field::{CHUNK, Field};
use peri::material::BondMaterial;
use peri::potential::Law;
use peri::solver::{Loads, Method, State, StepRecord, Support, System, VelocityVerlet};
use peri::surface::BodySurface;

const G: f64 = 9.81;

/// Builds the contact of a body with planes, with M = 1 Pa.
pub fn beside(bonds: &dyn Bonds<2>, pairs: f64, planes: Vec<RigidSurface<2>>) -> Contact<2> {
    let contact = Contact::short_range(bonds, MODULUS, pairs).unwrap();
    contact.with_surfaces(bonds, &BodySurface::default(), 1.0, planes).unwrap()
}

/// Runs explicit dynamics with linear bonds.
fn run(
    solver: &VelocityVerlet,
    bonds: &mut dyn Bonds<2>,
    loads: &Loads<2>,
    contact: Contact<2>,
    state: &mut State<2>,
) -> Result<(), Error> {
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let mut system = System::new(bonds, BondMaterial::new(&*law, MODULUS), loads, &[]);
    system.contact = Some(contact);
    solver.solve(&mut system, state, &mut |_, _| Ok(()), &mut |_, _| Ok(()))
}

fn off(row: &StepRecord) -> f64 {
    row.work - row.kinetic - row.stored - row.rubbed - row.released - row.damped
}

/// Particle of 1 kg on a plane inclined by `theta` with a penalty of 1e6 N/m, whose normal is rotated by 0.3
/// rad from the axes. A run returns position and velocity along the plane, and the error of the energy
/// balance, J.
struct Incline {
    theta: f64,
    mu: f64,
    v0: f64,
    time: f64,
    step: f64,
    belt: f64,
}

const PENALTY: f64 = 1e6;

impl Incline {
    fn run(&self) -> ([f64; 2], f64, StepRecord) {
        let (sin, cos) = 0.3_f64.sin_cos();
        let (normal, along) = ([-sin, cos], [cos, sin]);
        let mut one = Body::<2>::solid([1, 1], 1.0, 3.015).build().lattice;
        let site = one.particles()[0] as usize;
        let place = one.position(site);
        let point = std::array::from_fn(|d| place[d] - 0.5 * normal[d]);
        let plane = RigidSurface {
            stiffness: PENALTY,
            friction: self.mu,
            velocity: along.map(|x| x * self.belt),
            ..RigidSurface::plane(point, normal.map(|x| 7.0 * x))
        };
        let contact = beside(&one, 0.0, vec![plane]);
        let (pull, push) = (G * self.theta.sin(), G * self.theta.cos());
        let body_force = std::array::from_fn(|d| pull * along[d] - push * normal[d]);
        let support = Support { displacement: [None; 2], body_force };
        let loads = Loads::new(one.sites(), &[(vec![site as u32], support)]);
        let mut state = State::new(one.sites());
        state.displacement.set(site, normal.map(|n| -push / PENALTY * n));
        state.velocity.set(site, along.map(|x| x * self.v0));
        let solver =
            VelocityVerlet { time_step: Some(self.step), records: 1, ..VelocityVerlet::new(1.0, self.time) };
        run(&solver, &mut one, &loads, contact, &mut state).unwrap();
        let project = |x: [f64; 2]| x[0] * along[0] + x[1] * along[1];
        let row = state.history[0].clone();
        let found = [project(state.displacement.get(site)), project(state.velocity.get(site))];
        (found, off(&row), row)
    }
}

#[test]
fn slides_down() {
    for (degrees, mu) in [(30.0_f64, 0.3), (30.0, 0.5), (20.0, 0.3), (30.0, 0.0)] {
        let theta = degrees.to_radians();
        let incline = Incline { theta, mu, v0: 0.0, time: 1.0, step: 1e-4, belt: 0.0 };
        let ([x, v], error, row) = incline.run();
        let exact = G * (theta.sin() - mu * theta.cos());
        eprintln!("slides at {degrees}°, μ = {mu}: {v:.6} m/s, exactly {exact:.6}, off by {error:.1e} J");
        // until the elastic slip is μN/k_t friction is weaker, by a half in the mean
        let (bound, pull) = (mu * G * theta.cos(), G * theta.sin());
        let weaker = 0.5 * bound * (2.0 * bound / PENALTY / pull).sqrt();
        assert!(v - exact > -1e-6 && v - exact < 2.0 * weaker + 1e-6 && error.abs() < 1e-6);
        assert!((row.rubbed - mu * G * theta.cos() * x).abs() < 1e-4, "{row:?}");
    }
}

/// A sticking particle swings about its elastic slip mg sin θ/k_t and does not creep: the same distance after
/// ten times the time.
#[test]
fn sticks_without_creep() {
    for (degrees, mu) in [(10.0_f64, 0.3), (20.0, 0.5), (20.0, 10.0)] {
        let theta = degrees.to_radians();
        for time in [0.2, 2.0] {
            let incline = Incline { theta, mu, v0: 0.0, time, step: 2e-5, belt: 0.0 };
            let ([x, _], error, row) = incline.run();
            let slip = G * theta.sin() / PENALTY;
            eprintln!("sticks at {degrees}°, μ = {mu}: {x:e} m, slip {slip:e}, off by {error:.1e} J");
            // at 10° the oscillation exceeds μN: 2 sin θ > μ cos θ, and the particle slides once
            let slides = (2.0 * theta.sin() - mu * theta.cos()).max(0.0) * G / PENALTY;
            assert!(x > -1e-9 && x < 2.0 * slip + slides && error.abs() < 1e-9, "{x:e}");
            assert!(row.rubbed < mu * G * 2.0 * slip);
        }
    }
}

#[test]
fn stops_after() {
    for (v0, mu) in [(2.0, 0.3), (5.0, 0.5)] {
        let incline = Incline { theta: 0.0, mu, v0, time: v0 / mu / G * 1.5, step: 1e-4, belt: 0.0 };
        let ([x, _], error, row) = incline.run();
        let exact = 0.5 * v0 * v0 / (mu * G);
        eprintln!("stops from {v0} m/s: {x:.8} m, exactly {exact:.8}, off by {error:.1e} J");
        // it holds from an elastic slip of μN/k = 5e-6 m on
        assert!((x - exact).abs() < 2e-5 && error.abs() < 1e-5);
        assert!((row.rubbed / (0.5 * v0 * v0) - 1.0).abs() < 1e-4);
    }
}

/// A belt drags a particle until it has the velocity V of the belt; half of the work mV² becomes heat.
#[test]
fn belt_drags() {
    let incline = Incline { theta: 0.0, mu: 0.4, v0: 0.0, time: 1.0, step: 1e-4, belt: 1.5 };
    let ([x, v], error, row) = incline.run();
    let reached = 1.5 / (0.4 * G);
    let exact = 1.5 * (1.0 - reached) + 0.5 * 1.5 * reached;
    eprintln!("belt: {v:.6} m/s, {x:.6} m of {exact:.6}, heat {:.6} of 1.125 J, off {error:.1e}", row.rubbed);
    // a sticking particle oscillates by its elastic slip at the frequency √(k/m) = 1e3/s
    assert!((v - 1.5).abs() < 4e-3 && (x - exact).abs() < 1e-4 && error.abs() < 5e-6);
    assert!((row.rubbed - 1.125).abs() < 1e-4);
    let push = [-0.3_f64.sin(), 0.3_f64.cos()].map(|n| n * G);
    let force = row.resting[0].force;
    let along = force[0] * 0.3_f64.cos() + force[1] * 0.3_f64.sin();
    assert!((force[0] * push[0] + force[1] * push[1] - G * G).abs() < 1e-3 * G * G, "{force:?}");
    assert!(along.abs() <= 0.4 * G);
}

/// A plane with velocity w hits a particle at rest, which leaves with 2w; the plane has done the work.
#[test]
fn plane_hits_a_particle() {
    let mut one = Body::<2>::solid([1, 1], 1.0, 3.015).build().lattice;
    let site = one.particles()[0] as usize;
    for moves in [false, true] {
        // by its own velocity, or with the load factor, over 1 s
        let (velocity, displacement) = if moves { ([0.5, 0.0], [0.0; 2]) } else { ([0.0; 2], [0.5, 0.0]) };
        let plane = RigidSurface { velocity, displacement, ..RigidSurface::plane([-0.1, 0.0], [1.0, 0.0]) };
        let contact = beside(&one, 0.0, vec![RigidSurface { stiffness: 2e3, ..plane }]);
        let mut state = State::new(one.sites());
        let solver = VelocityVerlet {
            time_step: Some(1e-4),
            ramp: 1.0,
            records: 1,
            ..VelocityVerlet::new(DENSITY, 1.0)
        };
        run(&solver, &mut one, &Loads::default(), contact, &mut state).unwrap();
        let (v, row) = (state.velocity.get(site), &state.history[0]);
        eprintln!("hit: {:.8} m/s, work {:.8} J, off by {:.1e} J", v[0], row.work, off(row));
        assert!((v[0] - 1.0).abs() < 1e-6 && (row.work / (0.5 * DENSITY) - 1.0).abs() < 2e-6);
        assert!(off(row).abs() < 1e-6 && v[1] == 0.0);
    }
}

/// Verification test Contact_Friction of Peridigm, with Coulomb's law: two particles that repel each other
/// with friction.
#[test]
fn two_particles_of_peridigm() {
    let (side, modulus, reach, horizon) = (0.1612_f64, 1e12, 0.2, 0.6_f64);
    let volume = side.powi(3);
    // our contact distance is 0.9 of the distance at rest
    let rest = reach / 0.9;
    let own_horizon = 0.2;
    let points = [[0.0, 0.0], [0.0, rest]];
    let mut cloud =
        CloudBonds::new(&points, &[volume; 2], side, own_horizon, VolumeCorrection::None, &[]).unwrap();
    let wanted = 18.0 * modulus / (std::f64::consts::PI * horizon.powi(5));
    let contact = Contact::short_range(&cloud, MODULUS, wanted * own_horizon / (6.0 * MODULUS)).unwrap();
    let contact = contact.with_friction(0.3, Some(1e-15)).unwrap();
    let sites = [0, 1].map(|p| cloud.input_order().iter().position(|&i| i == p).unwrap());
    let mut state = State::new(cloud.sites());
    state.displacement.set(sites[1], [0.0, 0.19 - rest]);
    state.velocity.set(sites[0], [10.0, 0.0]);
    state.velocity.set(sites[1], [-10.0, 0.0]);
    let solver = VelocityVerlet { time_step: Some(1e-5), records: 1, ..VelocityVerlet::new(8960.0, 1e-3) };
    run(&solver, &mut cloud, &Loads::default(), contact, &mut state).unwrap();
    let v = state.velocity.get(sites[0]);
    eprintln!("Peridigm: {v:?}");
    // an elastic slip of 1e-15 m turns by as much as the pair does
    assert!((v[0] / 0.161378373734 - 1.0).abs() < 1e-8, "{v:?}");
    assert!((v[1] / -41.4843659641 - 1.0).abs() < 1e-8, "{v:?}");
}

/// Friction between particles agrees with a plain sum over all pairs, for random velocities, slips and
/// bounds; Σ V f = 0.
fn friction_of_a_heap<const D: usize>(cells: [usize; D]) {
    let body = Body::<D>::solid(cells, 0.3, 1.015);
    let built = body.build();
    let bonds = &built.lattice;
    let mut random = Random(7);
    let (mut u, mut v) = (Field::zeros(bonds.sites()), Field::zeros(bonds.sites()));
    for &site in bonds.particles() {
        u.set(site as usize, std::array::from_fn(|_| 0.2 * random.next()));
        v.set(site as usize, std::array::from_fn(|_| 3.0 * random.next()));
    }
    let (mu, step) = (0.7, 0.02);
    let contact = Contact::short_range(bonds, MODULUS, SHORT_RANGE).unwrap();
    let mut contact = contact.with_friction(mu, None).unwrap();
    contact.update(bonds, &u);
    contact.slide_on(bonds, &u, &v, step, &[]);
    let mut force = Field::zeros(bonds.sites());
    for (chunk, mut out) in force.chunks_mut().into_iter().enumerate() {
        contact.add_friction(chunk, &mut out);
    }
    let sites: Vec<usize> = bonds.particles().iter().map(|&s| s as usize).collect();
    let stiffness = SHORT_RANGE * 6.0 * MODULUS / bonds.horizon();
    let (mut sum, mut largest, mut sticks, mut slides) = ([0.0; D], 0.0_f64, 0, 0);
    for &i in &sites {
        let mut plain = [0.0; D];
        for &j in sites.iter().filter(|&&j| j != i && !bonds.is_bonded(i, j)) {
            let xi: [f64; D] = std::array::from_fn(|d| bonds.position(j)[d] - bonds.position(i)[d]);
            let zeta: [f64; D] = std::array::from_fn(|d| xi[d] + u.get(j)[d] - u.get(i)[d]);
            let (r, d) = (norm(zeta), (0.9 * norm(xi)).min(1.35 * bonds.spacing()));
            if r >= d {
                continue;
            }
            let relative: [f64; D] = std::array::from_fn(|k| v.get(i)[k] - v.get(j)[k]);
            let along: f64 = (0..D).map(|k| relative[k] * zeta[k] / r).sum();
            let slip: [f64; D] = std::array::from_fn(|k| step * (relative[k] - along * zeta[k] / r));
            let most = mu * (d - r);
            let part = (most / norm(slip)).min(1.0);
            if part < 1.0 {
                slides += 1
            } else {
                sticks += 1
            }
            for k in 0..D {
                plain[k] -= stiffness * bonds.volume(j) * part * slip[k];
            }
        }
        let found = force.get(i);
        for d in 0..D {
            sum[d] += found[d];
            largest = largest.max(found[d].abs());
            assert!((found[d] - plain[d]).abs() < 1e-11 * (1.0 + plain[d].abs()), "{found:?} {plain:?}");
        }
    }
    eprintln!("heap in {D}D: {sticks} stick, {slides} slide, Σf {sum:?} of {largest:.1e}");
    assert!(sticks > 10 && slides > 10 && sum.iter().all(|x| x.abs() < 1e-12 * largest * sites.len() as f64));
}

#[test]
fn friction_is_a_plain_sum() {
    friction_of_a_heap([9, 7]);
    friction_of_a_heap([6, 5, 4]);
}

/// Two halves of a sheet collide obliquely over a moving rough plane: equal bits on any number of threads,
/// and from a state saved while they touch.
#[test]
fn neither_threads_nor_restarts_change_a_bit() {
    let mut body = Body::<2>::solid([66, 66], 1.0, 3.015);
    body.slits = vec![Slit { at: 33.0, from: -1.0, to: 67.0 }];
    let run = |threads: usize, friction: Option<f64>, from: Option<State<2>>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut built = body.build();
            let bonds = &mut built.lattice;
            let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
            let plane = RigidSurface {
                friction: friction.unwrap_or(0.0),
                velocity: [0.5, 0.1],
                stiffness: 30.0,
                ..RigidSurface::plane([0.0; 2], [0.0, 1.0])
            };
            let mut contact = beside(bonds, SHORT_RANGE, vec![plane]);
            if let Some(friction) = friction {
                contact = contact.with_friction(friction, None).unwrap();
            }
            let mut state = from.unwrap_or_else(|| {
                let mut state = State::new(bonds.sites());
                for &site in bonds.particles() {
                    if bonds.position(site as usize)[1] > 33.0 {
                        state.velocity.set(site as usize, [1.0, -2.0]);
                    }
                }
                state
            });
            let loads = Loads::default();
            let mut system = System::new(bonds, BondMaterial::new(&*law, MODULUS), &loads, &[]);
            system.contact = Some(contact);
            let solver = VelocityVerlet { records: 4, safety: 0.3, ..VelocityVerlet::new(DENSITY, 2.0) };
            let mut saved = None;
            let mut watch = |_: &peri::solver::Status, state: &State<2>| {
                if state.motion.time > 1.0 && saved.is_none() {
                    saved = Some(state.clone());
                }
                Ok(())
            };
            solver.solve(&mut system, &mut state, &mut watch, &mut |_, _| Ok(())).unwrap();
            (state, saved.unwrap())
        })
    };
    let (one, saved) = run(1, Some(0.3), None);
    let row = one.history.last().unwrap();
    eprintln!("askew: {row:?}, off by {:.1e} J", off(row));
    let without = run(2, None, None).0;
    eprintln!("without friction: off by {:.1e} J", off(without.history.last().unwrap()));
    assert!(one.displacement.sites() > CHUNK && row.contact.unwrap().pairs > 20);
    assert!(row.rubbed > 0.0 && row.resting[0].force[0] > 0.0 && off(row).abs() < 1e-3 * row.work);
    assert!(run(2, Some(0.3), None).0 == one && run(2, Some(0.3), Some(saved)).0 == one);
    let smooth = run(2, None, None).0;
    assert!(smooth != one && run(1, Some(0.0), None).0 == smooth, "no friction, no bit");
    // far above what the law needs: nothing grows
    let rough = run(2, Some(10.0), None).0;
    let row = rough.history.last().unwrap();
    eprintln!("μ = 10: rubbed {:.3} of {:.3} J, off by {:.1e}", row.rubbed, row.work, off(row));
    assert!(off(row).abs() < 1e-2 * row.work && row.rubbed > 0.0);
}

/// Invalid planes and coefficients of friction are refused.
#[test]
fn refuses() {
    let one = Body::<2>::solid([1, 1], 1.0, 3.015).build().lattice;
    let contact = || Contact::short_range(&one, MODULUS, SHORT_RANGE).unwrap();
    let good = RigidSurface::plane([0.0; 2], [0.0, 1.0]);
    let fault = |plane: RigidSurface<2>| {
        let planes = contact().with_surfaces(&one, &BodySurface::default(), 1.0, vec![plane]);
        planes.err().map(|error| error.to_string())
    };
    assert_eq!(fault(good.clone()), None);
    for (plane, what) in [
        (RigidSurface { shape: SurfaceShape::Plane([0.0; 2]), ..good.clone() }, "normal of a plane: found 0"),
        (
            RigidSurface { shape: SurfaceShape::Plane([f64::NAN, 1.0]), ..good.clone() },
            "normal of a plane: found NaN",
        ),
        (RigidSurface { stiffness: -1.0, ..good.clone() }, "stiffness of a rigid surface: found -1"),
        (RigidSurface { friction: f64::INFINITY, ..good.clone() }, "friction of a rigid surface: found inf"),
        (RigidSurface { velocity: [f64::NAN; 2], ..good.clone() }, "velocity of a rigid surface: found NaN"),
        (
            RigidSurface { elastic_slip: Some(0.0), ..good.clone() },
            "elastic slip of a rigid surface: found 0",
        ),
    ] {
        assert!(fault(plane).unwrap().starts_with(what), "{what}");
    }
    assert!(contact().with_friction(-0.1, None).is_err() && contact().with_friction(0.1, Some(0.0)).is_err());
    let slack = contact().with_surfaces(&one, &BodySurface::default(), 0.0, vec![good]).err().unwrap();
    assert!(slack.to_string().starts_with("modulus of contact: found 0"), "{slack}");
    let far = RigidSurface { bonded: true, ..RigidSurface::plane([0.0, -3.0], [0.0, 1.0]) };
    assert!(fault(far).unwrap().contains("no face of the body within half a spacing"));
}

/// A plane through the middle of a body drives its halves apart; everything stays finite.
#[test]
fn plane_through_a_body() {
    let mut built = Body::<2>::solid([12, 12], 1.0, 3.015).build();
    let bonds = &mut built.lattice;
    let plane = RigidSurface { friction: 0.5, stiffness: 5.0, ..RigidSurface::plane([0.0, 6.0], [0.0, 1.0]) };
    let contact = beside(bonds, SHORT_RANGE, vec![plane]).with_friction(0.5, None).unwrap();
    let mut state = State::new(bonds.sites());
    let solver = VelocityVerlet { records: 5, ..VelocityVerlet::new(DENSITY, 20.0) };
    run(&solver, bonds, &Loads::default(), contact, &mut state).unwrap();
    let row = state.history.last().unwrap();
    eprintln!("through a body: {row:?}, off by {:.1e}", off(row));
    assert!(row.resting[0].area == 0.0 && off(row).abs() < 0.1 * row.work, "it is thrown out");
}
