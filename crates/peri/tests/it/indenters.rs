//! Rigid spheres, cylinders, planes and facets on a body: gradients of their energy, balance of a force,
//! work, friction, motion, bits.

use crate::bodies::{Body, Built, MODULUS, Random, hold, scatter};
use crate::dynamics::DENSITY;
use harness::scene::Source;
use peri::Error;
use peri::bonds::{BodyGeometry, Bonds, LatticeBonds};
use peri::contact::{Contact, Inertia, RigidSurface};
use peri::field::Field;
use peri::geometry::{Enclosure, SignedDistance};
use peri::material::BondMaterial;
use peri::potential::Law;
use peri::program::scene::Scene;
use peri::solver::{Amplitude, DynamicRelaxation, Lbfgs, Method, State, StepRecord, System, VelocityVerlet};
use peri::surface::BodySurface;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Builds the contact of a body of the longitudinal modulus 1 Pa with rigid surfaces on its faces.
fn beside<const D: usize>(
    bonds: &LatticeBonds<D>,
    surfaces: Vec<RigidSurface<D>>,
) -> Result<Contact<D>, Error> {
    let contact = Contact::short_range(bonds, MODULUS, 0.0)?;
    contact.with_surfaces(bonds, &BodySurface::of_lattice(bonds), 1.0, surfaces)
}

fn block() -> Built<3> {
    Body::<3>::solid([6, 6, 4], 1.0, 3.015).build()
}

/// Facets of a sphere about the origin with poles on the x axis: `bands` rings of 2·`bands` quadrangles in
/// halves.
fn ball(radius: f64, bands: u32) -> Vec<[[f64; 3]; 3]> {
    let around = 2 * bands;
    let corner = |i: u32, k: u32| {
        let theta = PI * f64::from(i) / f64::from(bands);
        let phi = TAU * f64::from(k % around) / f64::from(around);
        let across = if i == 0 || i == bands { 0.0 } else { theta.sin() };
        [theta.cos(), across * phi.cos(), across * phi.sin()].map(|x| radius * x)
    };
    let both = |(i, k): (u32, u32)| {
        let [p, q, r, s] = [corner(i, k), corner(i + 1, k), corner(i + 1, k + 1), corner(i, k + 1)];
        let halves = [(i + 1 < bands).then_some([p, q, r]), (i > 0).then_some([p, r, s])];
        halves.into_iter().flatten()
    };
    (0..bands).flat_map(|i| (0..around).map(move |k| (i, k))).flat_map(both).collect()
}

/// Facets of a box.
fn cuboid(low: [f64; 3], high: [f64; 3]) -> Vec<[[f64; 3]; 3]> {
    let corner = |at: [usize; 3]| std::array::from_fn(|d| if at[d] == 0 { low[d] } else { high[d] });
    let side = |axis: usize, end: usize| {
        let at = |a: usize, b: usize| {
            let mut at = [0; 3];
            (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (end, a, b);
            corner(at)
        };
        let [p, q, r, s] = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
        if end == 1 { [[p, q, r], [p, r, s]] } else { [[p, r, q], [p, s, r]] }
    };
    (0..3).flat_map(|axis| [0, 1].map(|end| side(axis, end))).flatten().collect()
}

fn faceted(point: [f64; 3], facets: Vec<[[f64; 3]; 3]>) -> RigidSurface<3> {
    RigidSurface::facets(point, Arc::new(SignedDistance::new(Enclosure::new(facets).unwrap())))
}

/// Forces are the gradient of the energy of contact, less the work of a force, by central differences, for
/// spheres, cylinders, planes and facets that stand still or balance a force.
#[test]
fn forces_are_the_gradient_of_an_energy() {
    let built = block();
    let bonds = &built.lattice;
    let push = Some([0.0, 0.3, -4.0]);
    let up = [0.0, 0.0, -1.0];
    let still = [
        RigidSurface::sphere([3.1, 2.7, 8.7], 5.0),
        RigidSurface::cylinder([3.1, 2.7, 7.7], [0.3, 1.0, 0.1], 4.0),
        RigidSurface::plane([3.1, 2.7, 3.8], up),
        faceted([3.1, 2.7, 8.7], ball(5.0, 8)),
    ];
    let pushed = [
        RigidSurface { force: push, ..RigidSurface::sphere([3.1, 2.7, 10.0], 5.0) },
        RigidSurface { force: push, ..RigidSurface::cylinder([3.1, 2.7, 9.5], [0.3, 1.0, 0.1], 4.0) },
        RigidSurface { force: push, ..RigidSurface::plane([3.1, 2.7, 5.0], up) },
        RigidSurface { force: push, ..faceted([3.1, 2.7, 10.0], ball(5.0, 8)) },
    ];
    for surface in still.into_iter().chain(pushed) {
        let mut contact = beside(bonds, vec![surface.clone()]).unwrap();
        contact.move_surfaces(0.5, 0.0);
        let u = scatter(bonds.sites(), &built.on_lattice, &Random(7).vectors(built.points.len(), 0.05));
        let mut potential = |u: &Field<3>| {
            contact.update(bonds, u);
            let force = contact.surface_forces(bonds.sites()).unwrap();
            (contact.summary(bonds, u).energy - 0.5 * contact.travelled(), force)
        };
        let force = potential(&u).1;
        let direction: Field<3> =
            scatter(bonds.sites(), &built.on_lattice, &Random(8).vectors(built.points.len(), 1.0));
        let along = |step: f64| {
            let mut moved = u.clone();
            for site in bonds.particles().iter().map(|&site| site as usize) {
                let (here, by) = (u.get(site), direction.get(site));
                moved.set(site, std::array::from_fn(|d| here[d] + step * by[d]));
            }
            moved
        };
        let step = 1e-6;
        let slope = (potential(&along(step)).0 - potential(&along(-step)).0) / (2.0 * step);
        let work: f64 = bonds
            .particles()
            .iter()
            .map(|&site| {
                let (f, by) = (force.get(site as usize), direction.get(site as usize));
                bonds.volume(site as usize) * (0..3).map(|d| f[d] * by[d]).sum::<f64>()
            })
            .sum();
        assert!(work.abs() > 1e-3 && (slope + work).abs() < 1e-6 * work.abs(), "{slope} {work} {surface:?}");
    }
}

/// Travel and force: a surface with a force starts where it touches the body at rest, and contact balances it
/// to rounding along the force.
#[test]
fn contact_balances_a_force() {
    let built = block();
    let bonds = &built.lattice;
    let force = [0.0, 0.0, -2.0];
    let sphere = RigidSurface { force: Some(force), ..RigidSurface::sphere([3.0, 3.0, 50.0], 5.0) };
    let mut contact = beside(bonds, vec![sphere.clone()]).unwrap();
    // four faces at half a spacing from the axis on either side, but for balls below faces of a thin block
    let height = 4.0 + (25.0_f64 - 0.5).sqrt();
    assert!((contact.surfaces().next().unwrap().point[2] - height).abs() < 0.02);
    let rest = Field::zeros(bonds.sites());
    for factor in [0.0, 1e-6, 0.1, 1.0, 20.0] {
        contact.move_surfaces(factor, 0.0);
        contact.update(bonds, &rest);
        let found = contact.surface_reactions(&rest)[0];
        assert!(found.gap.abs() < 1e-12 || factor > 0.0, "{found:?}");
        assert!((found.force[2] - factor * force[2]).abs() <= 1e-11 * factor + 1e-12, "{factor}: {found:?}");
        assert!(found.force[0].abs() < 1e-9 && found.moved[2] <= 1e-12 && found.moved[0] == 0.0);
    }
    for (fault, wrong) in [
        ("no face of the body ahead", RigidSurface { force: Some([0.0, 0.0, 2.0]), ..sphere.clone() }),
        ("no face of the body ahead", RigidSurface { point: [30.0, 3.0, 50.0], ..sphere.clone() }),
        ("radius of a rigid surface: found -1", RigidSurface::sphere([0.0; 3], -1.0)),
        ("axis of a cylinder: found 0", RigidSurface::cylinder([0.0; 3], [0.0; 3], 1.0)),
        ("friction of a rigid surface: found -0.5", RigidSurface { friction: -0.5, ..sphere.clone() }),
        ("force on a rigid surface: found 0", RigidSurface { force: Some([0.0; 3]), ..sphere.clone() }),
    ] {
        let message = beside(bonds, vec![wrong]).map(|_| ()).unwrap_err().to_string();
        assert!(message.contains(fault), "{message}");
    }
}

/// Solves equilibria of a block that is held at its lower half, loaded and unloaded by the load factor or by
/// the amplitude of the surface; returns the last state and a restartable one
/// of the third step.
fn equilibria(
    surface: RigidSurface<3>,
    method: usize,
    from: Option<State<3>>,
) -> (State<3>, Option<State<3>>) {
    let mut built = block();
    let follows = surface.amplitudes.is_some();
    let contact = beside(&built.lattice, vec![surface]).unwrap();
    let bonds = &mut built.lattice;
    let mut loads = hold(bonds, |x| (x[2] < 1.0).then_some((7, [0.0; 3])));
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let mut factors = [0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25, 0.0];
    if follows {
        loads.curved = Some(Box::default());
        factors = std::array::from_fn(|k| (k + 1) as f64 / 8.0);
    }
    let mut system = System::new(bonds, BondMaterial::new(&*law, MODULUS), &loads, &factors);
    system.contact = Some(contact);
    let (mut state, mut saved) = (from.unwrap_or_else(|| State::new(system.bonds.sites())), None);
    let watch = &mut |status: &peri::solver::Status, state: &State<3>| {
        if status.restartable && status.step == 2 && saved.is_none() {
            saved = Some(state.clone());
        }
        Ok(())
    };
    let finished = &mut |_: &dyn Bonds<3>, _: &_| Ok(());
    let tolerance = 1e-7;
    match method {
        0 => DynamicRelaxation { tolerance, ..DynamicRelaxation::default() }.solve(
            &mut system,
            &mut state,
            watch,
            finished,
        ),
        _ => Lbfgs { tolerance, ..Lbfgs::default() }.solve(&mut system, &mut state, watch, finished),
    }
    .unwrap();
    (state, saved)
}

/// Returns the centre of a sphere above the block where it touches it.
fn touching(sphere: RigidSurface<3>) -> [f64; 3] {
    let pushed = RigidSurface { force: Some([0.0, 0.0, -1.0]), ..sphere };
    beside(&block().lattice, vec![pushed]).unwrap().surfaces().next().unwrap().point
}

/// An elastic block under a sphere stores the work of the sphere, by its displacement and by its force, and
/// gives it back; both find the same force and depth, in either method; a run resumed within a step gives the
/// same bits on any number of threads.
#[test]
fn loaded_and_unloaded() {
    let sphere = RigidSurface { stiffness: 50.0, ..RigidSurface::sphere([3.0, 3.0, 50.0], 8.0) };
    let pressed =
        RigidSurface { point: touching(sphere.clone()), displacement: [0.0, 0.0, -0.2], ..sphere.clone() };
    let (by_depth, _) = equilibria(pressed, 1, None);
    let peak = &by_depth.history[3];
    let force = peak.resting[0].force[2];
    assert!(force < -0.01 && (peak.load / force.abs() - 1.0).abs() < 1e-9, "{peak:?}");
    let pushed = RigidSurface { force: Some([0.0, 0.0, force]), ..sphere };
    let of_force: Vec<State<3>> = (0..2).map(|method| equilibria(pushed.clone(), method, None).0).collect();
    for (state, by_force) in std::iter::once((&by_depth, false)).chain(of_force.iter().map(|s| (s, true))) {
        let row = |k: usize| -> &StepRecord { &state.history[k] };
        assert!((row(3).resting[0].moved[2] + 0.2).abs() < 1e-5, "{:?}", row(3).resting);
        assert!((row(3).stored / peak.stored - 1.0).abs() < 1e-4);
        // the trapezoidal rule of four steps of F ∝ δ^1.5 is 1.8 % off by depth and 3 % by force, both ways
        let error = row(3).work / row(3).stored - 1.0;
        assert!(error.abs() < 0.05, "{by_force}: {error}");
        assert!(row(7).work.abs() < 1e-4 * row(3).work, "{by_force}: {} {}", row(7).work, row(3).work);
        assert!(row(7).stored < 1e-6 * row(3).stored, "{:?}", row(7));
        let balance = row(3).balance;
        assert!(balance.force < 1e-12 * balance.size && balance.external < 1e-6 * balance.size);
        if by_force {
            let (load, at) = (row(3).load, row(3).displacement);
            assert!((load + force).abs() < 1e-9 && (at - 0.2).abs() < 1e-5, "{load} {at}");
        }
    }
    for method in 0..2 {
        let run = |threads: usize, from: Option<State<3>>| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| equilibria(pushed.clone(), method, from))
        };
        let (one, saved) = run(1, None);
        assert!(run(2, None).0 == one && run(2, saved).0 == one, "method {method}");
    }
}

/// A surface that follows a triangle of time, by displacement or by force, has the forces, the displacements
/// and the work of one that follows the same load factors.
#[test]
fn along_a_curve() {
    let triangle =
        || Amplitude::new(|part| if part <= 0.5 { (2.0 * part, 2.0) } else { (2.0 - 2.0 * part, -2.0) });
    let sphere = RigidSurface { stiffness: 50.0, ..RigidSurface::sphere([3.0, 3.0, 50.0], 8.0) };
    let point = touching(sphere.clone());
    let pressed = RigidSurface { point, displacement: [0.0, 0.0, -0.2], ..sphere.clone() };
    let pushed = RigidSurface { force: Some([0.0, 0.0, -0.05]), ..sphere };
    for surface in [pressed, pushed] {
        let follower = RigidSurface { amplitudes: Some([(); 3].map(|()| triangle())), ..surface.clone() };
        let by_factor = equilibria(surface.clone(), 1, None).0.history;
        let (state, saved) = equilibria(follower.clone(), 1, None);
        let size = by_factor[3].work;
        for (own, other) in state.history.iter().zip(&by_factor) {
            let [a, b] = [own, other].map(|row| row.resting[0]);
            assert!((a.force[2] - b.force[2]).abs() < 1e-5 * by_factor[3].load, "{a:?} {b:?}");
            assert!((a.moved[2] - b.moved[2]).abs() < 1e-5, "{a:?} {b:?}");
            assert!((own.work - other.work).abs() < 1e-4 * size, "{} {}", own.work, other.work);
        }
        let last = state.history[7].work;
        assert!(size > 1e-6 && last.abs() < 1e-4 * size, "{last} {size}");
        let resumed = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        assert!(resumed.install(|| equilibria(follower, 1, saved)).0 == state);
    }
}

/// A plane on a curve that would leap into the block in one step is cut at touch: it does the work that the
/// block stores and takes it back, but for the trapezoidal rule. A jump is no ramp to be cut, and comes to an
/// end.
#[test]
fn cut_at_touch_on_a_curve() {
    let ramp = Amplitude::new(|part| ((8.0 * part).min(1.0).min(8.0 - 8.0 * part), 0.0));
    let jump = Amplitude::new(|part| (if (0.3..0.9).contains(&part) { 1.0 } else { 0.0 }, 0.0));
    for amplitude in [ramp, jump] {
        let displacement = [0.0, 0.0, -0.8];
        let amplitudes = Some([(); 3].map(|()| amplitude.clone()));
        let plane = RigidSurface::plane([3.0, 3.0, 4.0], [0.0, 0.0, -1.0]);
        let plane = RigidSurface { stiffness: 2000.0, displacement, amplitudes, ..plane };
        let history = equilibria(plane, 1, None).0.history;
        let peak = history.iter().max_by(|a, b| a.stored.total_cmp(&b.stored)).unwrap();
        let (work, last) = (peak.work / peak.stored, history.last().unwrap());
        assert!((9..12).contains(&history.len()), "{}", history.len());
        assert!((work - 1.0).abs() < 0.1, "{work}");
        assert!(last.work.abs() < 0.1 * peak.stored && last.stored < 1e-6 * peak.stored, "{last:?}");
    }
}

/// A sphere dragged over a block sticks or slides by μN: with a coefficient of 0.05 it slides, and friction
/// takes its work.
#[test]
fn dragged_sphere() {
    let at = touching(RigidSurface::sphere([2.7, 3.0, 50.0], 8.0));
    let sphere = RigidSurface {
        friction: 0.05,
        stiffness: 50.0,
        displacement: [0.6, 0.0, -0.2],
        ..RigidSurface::sphere(at, 8.0)
    };
    let row = equilibria(sphere, 1, None).0.history[3].clone();
    let [x, _, z] = row.resting[0].force;
    // normals lean by up to 0.3/8 from z
    assert!(row.rubbed > 0.0 && (-x / z.abs()).abs() < 0.2, "{row:?}");
    assert!((row.work - row.stored - row.rubbed).abs() < 0.1 * row.work, "{row:?}");
}

/// A disc that flies through a strip in motion does the work that it stores and moves.
#[test]
fn disc_in_motion() {
    let mut built = Body::<2>::solid([20, 8], 1.0, 3.015).build();
    let disc = RigidSurface {
        stiffness: 2.0,
        velocity: [0.0, -0.2],
        ..RigidSurface::sphere([10.0, 8.0 + 6.1], 6.0)
    };
    let contact = beside(&built.lattice, vec![disc]).unwrap();
    let bonds = &mut built.lattice;
    let loads = hold(bonds, |x| (x[1] < 1.0).then_some((3, [0.0; 2])));
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let mut system = System::new(bonds, BondMaterial::new(&*law, MODULUS), &loads, &[]);
    system.contact = Some(contact);
    let mut state = State::new(system.bonds.sites());
    let solver = VelocityVerlet { records: 10, ..VelocityVerlet::new(DENSITY, 2.0) };
    solver.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap();
    let last = state.history.last().unwrap();
    let off = last.work - last.stored - last.kinetic;
    assert!(last.work > 0.0 && off.abs() < 0.01 * last.work, "{off} {last:?}");
    assert!((last.resting[0].moved[1] + 0.4).abs() < 1e-12 && last.resting[0].force[1] < 0.0);
}

/// A rough disc with a mass strikes a free block obliquely, pushed on by a force: momentum and energy of both
/// balance, and a resumed run has the same bits on any number of threads. Before it touches, it falls by
/// ½at².
#[test]
fn struck_by_a_mass() {
    let (mass, force) = (20.0 * DENSITY, [0.0, -0.02 * DENSITY]);
    let disc = RigidSurface {
        stiffness: 5.0,
        friction: 0.3,
        velocity: [0.06, -0.1],
        inertia: Some(Inertia { mass, force }),
        ..RigidSurface::sphere([8.0, 8.0 + 6.5], 6.0)
    };
    let run = |threads: usize, from: Option<State<2>>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut built = Body::<2>::solid([20, 8], 1.0, 3.015).build();
            let contact = beside(&built.lattice, vec![disc.clone()]).unwrap();
            let bonds = &mut built.lattice;
            let loads = hold(bonds, |_| None);
            let law = Law::Linear.build(1.0, 1.0, false).unwrap();
            let mut system = System::new(bonds, BondMaterial::new(&*law, MODULUS), &loads, &[]);
            system.contact = Some(contact);
            let mut state = from.unwrap_or_else(|| State::new(system.bonds.sites()));
            let mut saved = None;
            let watch = &mut |status: &peri::solver::Status, state: &State<2>| {
                if status.restartable && status.step == 12 && saved.is_none() {
                    saved = Some(state.clone());
                }
                Ok(())
            };
            let solver = VelocityVerlet { records: 20, ..VelocityVerlet::new(DENSITY, 12.0) };
            solver.solve(&mut system, &mut state, watch, &mut |_, _| Ok(())).unwrap();
            let particles = system.bonds.particles().iter().map(|&site| site as usize);
            let momentum: Vec<[f64; 2]> = particles
                .map(|site| state.velocity.get(site).map(|v| DENSITY * system.bonds.volume(site) * v))
                .collect();
            (state, saved, [0, 1].map(|d| momentum.iter().map(|p| p[d]).sum::<f64>()))
        })
    };
    let (one, saved, body) = run(1, None);
    let first = &one.history[0];
    let fallen = disc.velocity[1] * first.time + 0.5 * force[1] / mass * first.time.powi(2);
    assert!((first.resting[0].moved[1] - fallen).abs() < 1e-12 && first.stored == 0.0, "{first:?}");
    let last = one.history.last().unwrap();
    let resting = last.resting[0];
    for d in 0..2 {
        let given = mass * disc.velocity[d] + force[d] * last.time;
        let off = body[d] + mass * resting.velocity[d] - given;
        assert!(off.abs() < 1e-9 * given.abs(), "{off} {given}");
    }
    let square = |v: [f64; 3]| 0.5 * mass * v.iter().map(|v| v * v).sum::<f64>();
    let fed = (0..2).map(|d| force[d] * resting.moved[d]).sum::<f64>();
    let given = square([disc.velocity[0], disc.velocity[1], 0.0]) + fed;
    let off = given - square(resting.velocity) - last.kinetic - last.stored - last.rubbed;
    eprintln!("{given} {off} {body:?} {last:?}");
    assert!(body[1] < 0.0 && last.rubbed > 0.0 && off.abs() < 0.01 * given, "{off} {given}");
    assert!(run(2, None).0 == one && run(2, saved).0 == one);
    let heavy = RigidSurface { inertia: Some(Inertia { mass: 0.0, force }), ..disc.clone() };
    let bonds = Body::<2>::solid([20, 8], 1.0, 3.015).build().lattice;
    let message = beside(&bonds, vec![heavy]).map(|_| ()).unwrap_err().to_string();
    assert!(message.contains("mass of a rigid surface: found 0"), "{message}");
}

/// The lower side of a box of facets acts as a plane, to rounding.
#[test]
fn box_of_facets_is_a_plane() {
    let bonds = &block().lattice;
    let rest = Field::zeros(bonds.sites());
    let reactions = |surface: RigidSurface<3>| {
        let mut contact =
            beside(bonds, vec![RigidSurface { displacement: [0.0, 0.0, -0.3], ..surface }]).unwrap();
        contact.move_surfaces(1.0, 0.0);
        contact.update(bonds, &rest);
        let forces = contact.surface_forces(bonds.sites()).unwrap();
        (contact.surface_reactions(&rest)[0], contact.summary(bonds, &rest), forces)
    };
    let flat = reactions(RigidSurface::plane([0.0, 0.0, 4.1], [0.0, 0.0, -1.0]));
    let boxed = reactions(faceted([0.0, 0.0, 4.1], cuboid([-20.0, -30.0, 0.0], [40.0, 20.0, 9.0])));
    assert!(flat.1.pairs >= 36 && boxed.1.pairs == flat.1.pairs && boxed.0.area == flat.0.area);
    for (a, b) in [
        (flat.0.force[2], boxed.0.force[2]),
        (flat.0.gap, boxed.0.gap),
        (flat.0.spread, boxed.0.spread),
        (flat.0.width, boxed.0.width),
        (flat.1.energy, boxed.1.energy),
    ] {
        assert!((a - b).abs() < 1e-12 * a.abs(), "{a} {b}");
    }
    for &site in bonds.particles() {
        let (a, b) = (flat.2.get(site as usize), boxed.2.get(site as usize));
        assert!((0..3).all(|d| (a[d] - b[d]).abs() < 1e-12 * flat.0.force[2].abs()));
    }
}

/// A sphere of 9800 facets acts as a sphere, within the error of its facets: a facet of corners on the sphere
/// lies inside of it by up to R − √(R² − ρ²), with the radius ρ of the circle through them, which takes this
/// off overlaps, and leans from its normal by up to ρ/R.
#[test]
fn ball_of_facets_is_a_sphere() {
    let bonds = &Body::<3>::solid([16, 16, 4], 1.0, 3.015).build().lattice;
    let rest = Field::zeros(bonds.sites());
    let (radius, bands, depth) = (20.0_f64, 50, 0.5);
    let reactions = |surface: RigidSurface<3>| {
        let surface = RigidSurface { displacement: [0.0, 0.0, -depth], ..surface };
        let mut contact = beside(bonds, vec![surface]).unwrap();
        contact.move_surfaces(1.0, 0.0);
        contact.surface_reactions(&rest)[0]
    };
    let centre = [7.3, 8.2, 4.0 + radius];
    let smooth = reactions(RigidSurface::sphere(centre, radius));
    let facets = ball(radius, bands);
    assert_eq!(facets.len(), 9800);
    let rough = reactions(faceted(centre, facets));
    let circle = PI * radius / f64::from(bands) / 2.0_f64.sqrt();
    let inside = radius - (radius * radius - circle * circle).sqrt();
    let (lean, slope) = (circle / radius, (2.0 * depth / radius).sqrt());
    // stiffness over area: 10 layers of a modulus of 1 Pa and a spacing of 1 m
    let allowed = 10.0 * smooth.area * inside + smooth.force[2].abs() * lean * (slope + 0.5 * lean);
    let off = rough.force[2] - smooth.force[2];
    eprintln!("{smooth:?}\n{rough:?}: off by {off:.3}, allowed {allowed:.3}");
    assert!(off.abs() <= allowed && allowed < 0.12 * smooth.force[2].abs(), "{off} {allowed}");
    assert!((rough.gap - smooth.gap).abs() <= inside, "{} {}", rough.gap, smooth.gap);
    assert!(rough.area <= smooth.area);
}

/// Facets with a force start at touch, balance it, and keep their bits when a run is resumed and on any
/// number of threads.
#[test]
fn facets_under_a_force() {
    let force = Some([0.0, 0.0, -0.1]);
    let facets = RigidSurface { stiffness: 50.0, ..faceted([3.0, 3.0, 50.0], ball(8.0, 16)) };
    let top = touching(facets.clone())[2];
    assert!((11.8..12.0).contains(&top), "{top}");
    let pushed = RigidSurface { force, ..facets };
    let run = |threads: usize, from: Option<State<3>>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| equilibria(pushed.clone(), 1, from))
    };
    let (one, saved) = run(1, None);
    let row = &one.history[3];
    assert!((row.resting[0].force[2] + 0.1).abs() < 1e-9 && row.resting[0].moved[2] < 0.0, "{row:?}");
    assert!(run(2, None).0 == one && run(2, saved).0 == one);
}

/// A rough plane pressed along its normal by a force of its own: friction takes work when the body spreads
/// below it, the force stays balanced, and a resumed run has the same bits.
#[test]
fn rough_plane_under_a_force() {
    let plane = RigidSurface { stiffness: 50.0, ..RigidSurface::plane([3.0, 3.0, 5.0], [0.0, 0.0, -2.0]) };
    let pushed = RigidSurface { force: Some([0.0, 0.0, -4.0]), ..plane };
    let smooth = equilibria(pushed.clone(), 1, None).0;
    let rough = RigidSurface { friction: 0.05, ..pushed.clone() };
    let run = |threads: usize, from: Option<State<3>>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| equilibria(rough.clone(), 1, from))
    };
    let (one, saved) = run(1, None);
    let row = &one.history[3];
    assert!((row.resting[0].force[2] + 4.0).abs() < 1e-9, "{row:?}");
    assert!(row.rubbed > 0.0 && row.resting[0].moved[2] > smooth.history[3].resting[0].moved[2], "{row:?}");
    assert!((row.work - row.stored - row.rubbed).abs() < 0.02 * row.work, "{row:?}");
    assert!(run(2, None).0 == one && run(2, saved).0 == one);
}

/// Friction helps to carry the force of a sphere, and of a plane pressed aside: normal forces and friction
/// along the force balance it, it leads to where a displacement has needed it, the energies balance, and a
/// resumed run has the same bits.
#[test]
fn friction_along_a_force() {
    let plane = RigidSurface::plane([3.0, 3.0, 50.0], [0.0, 0.0, -1.0]);
    for (smooth, along, depth, friction, eased) in [
        (RigidSurface::sphere([3.0, 3.0, 50.0], 4.0), [0.0, 0.0, -1.0], 0.4, 0.1, 1.01),
        (plane, [0.0, 0.6, -0.8], 0.1, 0.3, 1.1),
    ] {
        let smooth = RigidSurface { stiffness: 50.0, ..smooth };
        let rough = RigidSurface { friction, point: touching(smooth.clone()), ..smooth };
        let moved = RigidSurface { displacement: along.map(|e| depth * e), ..rough.clone() };
        let by_depth = equilibria(moved, 1, None).0.history[3].resting[0];
        let force: f64 = (0..3).map(|d| along[d] * by_depth.force[d]).sum();
        let pushed = RigidSurface { force: Some(along.map(|e| force * e)), ..rough };
        let run = |threads: usize, from: Option<State<3>>| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| equilibria(pushed.clone(), 1, from))
        };
        let (one, saved) = run(1, None);
        let row = &one.history[3];
        let travel = |row: &StepRecord| (0..3).map(|d| along[d] * row.resting[0].moved[d]).sum::<f64>();
        let carried: f64 = (0..3).map(|d| along[d] * row.resting[0].force[d]).sum();
        let easy = equilibria(RigidSurface { friction: 0.0, ..pushed.clone() }, 1, None).0;
        eprintln!("{force} {carried}: {} {}", travel(row), travel(&easy.history[3]));
        assert!((carried - force).abs() < 1e-6 * force, "{carried} {force}");
        assert!((travel(row) - depth).abs() < 0.01 * depth, "{} {depth}", travel(row));
        assert!(travel(&easy.history[3]) > eased * depth, "{}", travel(&easy.history[3]));
        let off = row.work - row.stored - row.rubbed;
        assert!(row.rubbed > 0.0 && off.abs() < 0.03 * row.work, "{off} {row:?}");
        assert!(run(2, None).0 == one && run(2, saved).0 == one);
    }
}

/// A block between two planes: of one layer of particles, which has no stiffness across it, a scene warns of
/// both.
#[test]
fn thin_bodies_are_warned_of() {
    let told = |height: u32| {
        let scene = format!(
            r#"version = 1
program = "peri"
[body]
space = "solid"
spacing = "1 mm"
shapes = [{{ add = "box", min = ["-4 mm", "-4 mm", "0 mm"], max = ["4 mm", "4 mm", "{height} mm"] }}]
[material]
law = "linear"
youngs_modulus = "1 MPa"
[[boundary]]
min = ["-1.1 mm", "-1.1 mm", "0 mm"]
max = ["1.1 mm", "1.1 mm", "1.1 mm"]
displacement = ["0 mm", "0 mm", "free"]
[contact]
[[contact.plane]]
name = "base"
point = ["0 mm", "0 mm", "0 mm"]
normal = [0, 0, 1]
[[contact.indenter]]
name = "punch"
point = ["0 mm", "0 mm", "{height} mm"]
normal = [0, 0, -1]
displacement = ["0 mm", "0 mm", "-0.06 mm"]
"#
        );
        let source = Source::new("scene.toml", scene);
        let scene = source.parse::<Scene>().unwrap_or_else(|error| panic!("{}", error.render()));
        let lines = peri::program::run::explanation(&source, &scene, false);
        lines.unwrap_or_else(|error| panic!("{error}")).join("\n")
    };
    let [thin, thick] = [1, 2].map(told);
    for name in ["base", "punch"] {
        let found = thin.contains(&format!("`{name}` meets a body 1 mm thick, one layer of particles"));
        assert!(found, "{thin}");
    }
    assert!(!thick.contains("meets a body"), "{thick}");
}
