//! Loads without equilibrium: bodies torn by a force, free bodies, prescribed displacements that press a body
//! through itself.

use crate::bodies::{Body, MODULUS, hold};
use harness::case::Fault;
use peri::Error;
use peri::bonds::{BodyGeometry, BondDamage, Bonds, LatticeBonds, VolumeCorrection, components};
use peri::field::Field;
use peri::geometry::{Cut, Operation, Shape, lattice};
use peri::material::BondMaterial;
use peri::potential::{BondPotential, Law};
use peri::solver::{
    Breaking, ContactStops, DynamicRelaxation, Lbfgs, Loads, Method, Policy, State, System, Unsupported,
    VelocityVerlet, find_unsupported, inverted,
};

/// A force on some particles, N, spread evenly.
fn push<const D: usize>(
    bonds: &dyn Bonds<D>,
    loads: &mut Loads<D>,
    force: [f64; D],
    on: impl Fn([f64; D]) -> bool,
) {
    let sites = bonds.particles().iter().map(|&site| site as usize);
    let members: Vec<usize> = sites.filter(|&site| on(bonds.position(site))).collect();
    let volume: f64 = members.iter().map(|&site| bonds.volume(site)).sum();
    let field = loads.body_force.get_or_insert_with(|| Field::zeros(bonds.sites()));
    for site in members {
        let old = field.get(site);
        field.set(site, std::array::from_fn(|d| old[d] + force[d] / volume));
    }
}

fn linear() -> Box<dyn BondPotential> {
    Law::Linear.build(1.0, 1.0, false).unwrap()
}

/// A strip of 16 × 32 mm with a crack from its left edge, held below.
fn strip() -> (LatticeBonds<2>, Loads<2>) {
    let body = [Operation::Add(Shape::Box { min: [0.0; 2], max: [16e-3, 32e-3] })];
    let crack = Cut { corner: [-1e-3, 16e-3], edges: [[6e-3, 0.0], [0.0; 2]] };
    let cells = lattice(&body, 1e-3, 1e-3).unwrap();
    let bonds = LatticeBonds::new(cells, 3.015, VolumeCorrection::None, &[crack]).unwrap();
    let loads = hold(&bonds, |x| (x[1] < 3e-3).then_some((3, [0.0; 2])));
    (bonds, loads)
}

fn solved(
    bonds: &mut LatticeBonds<2>,
    loads: &Loads<2>,
    factors: &[f64],
    breaking: Option<(f64, Policy)>,
    method: &dyn Method<2>,
) -> (Result<(), Error>, State<2>) {
    let law = linear();
    let mut system = System::new(bonds, BondMaterial::new(&*law, 1e13), loads, factors);
    system.breaking = breaking.map(|(stretch, policy)| Breaking { criterion: stretch.into(), policy });
    let mut state = State::new(system.bonds.sites());
    let result = method.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(()));
    (result, state)
}

/// A single linear bond, f = 2·3kθ(λ − 1)V²: steps below the force at the critical stretch are rows, the next
/// one ends the run.
#[test]
fn a_bond_holds_up_to_its_strength() {
    let strength = 6.0 * MODULUS * 0.2 * 0.01 * 0.01;
    for method in
        [&Lbfgs { tolerance: 1e-8, ..Lbfgs::default() } as &dyn Method<2>, &DynamicRelaxation::default()]
    {
        let mut two = Body::<2>::solid([2, 1], 0.1, 3.015).build();
        let bonds = &mut two.lattice;
        let mut loads = hold(bonds, |x| (x[0] < 0.1).then_some((3, [0.0; 2])));
        push(bonds, &mut loads, [1.0, 0.0], |x| x[0] > 0.1);
        let law = linear();
        let factors: Vec<f64> = (1..=10).map(|k| 0.15 * f64::from(k) * strength).collect();
        let mut system = System::new(bonds, BondMaterial::new(&*law, MODULUS), &loads, &factors);
        system.breaking = Some(Breaking { criterion: 1.2.into(), policy: Policy::AtEquilibrium });
        let mut state = State::new(system.bonds.sites());
        let error = method.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(()));
        assert!(matches!(error, Err(Error::NoEquilibrium { torn: true, step: 6, .. })), "{error:?}");
        assert_eq!((state.history.len(), state.fracture.broken), (6, 0));
        assert!((state.history[5].load / (0.9 * strength) - 1.0).abs() < 1e-3);
    }
}

/// A strip under a growing force, by both methods and both policies: the peak is within a step of that under
/// a growing displacement; then the error, with the last finished step in the state.
#[test]
fn torn_by_a_force() {
    let steps = 24;
    let factors: Vec<f64> = (1..=steps).map(|k| f64::from(k) / f64::from(steps)).collect();
    let peak = {
        let (mut bonds, _) = strip();
        let loads = hold(&bonds, |x| {
            (x[1] < 3e-3 || x[1] > 29e-3).then(|| (3, [0.0, if x[1] > 16e-3 { 3e-3 } else { 0.0 }]))
        });
        let fine: Vec<f64> = (1..=60).map(|k| f64::from(k) / 60.0).collect();
        let breaking = Some((1.1, Policy::AtEquilibrium));
        let (result, state) = solved(&mut bonds, &loads, &fine, breaking, &Lbfgs::default());
        result.unwrap();
        state.history.iter().map(|row| row.load).fold(0.0, f64::max)
    };
    let full = 1.7 * peak;
    let methods: [(&dyn Method<2>, Policy); 3] = [
        (&Lbfgs { tolerance: 1e-5, ..Lbfgs::default() }, Policy::AtEquilibrium),
        (&DynamicRelaxation { tolerance: 1e-5, ..DynamicRelaxation::default() }, Policy::AtEquilibrium),
        (&DynamicRelaxation { tolerance: 1e-5, ..DynamicRelaxation::default() }, Policy::EachIteration),
    ];
    for (method, policy) in methods {
        let (mut bonds, mut loads) = strip();
        push(&bonds, &mut loads, [0.0, full], |x| x[1] > 29e-3);
        let (result, state) = solved(&mut bonds, &loads, &factors, Some((1.1, policy)), method);
        let error = result.unwrap_err();
        println!("{error}");
        assert!(matches!(error, Error::NoEquilibrium { torn: true, .. }), "{error}");
        assert!(error.to_string().contains("no equilibrium") && error.exit_code() == 1);
        let last = state.history.last().unwrap();
        // the force side is free to turn, the displacement side is not: 12 %
        let step = full / f64::from(steps);
        println!("{policy:?}: {:.3} N of {peak:.3} N, a step is {step:.3} N", last.load);
        assert!(last.load < 1.05 * peak && last.load > 0.8 * peak - step, "{} {peak}", last.load);
        assert_eq!((state.fracture.broken, state.step), (last.broken, state.history.len()));
        let largest = bonds
            .particles()
            .iter()
            .map(|&s| state.displacement.get(s as usize)[1].abs())
            .fold(0.0, f64::max);
        assert!(largest < 32e-3, "{largest} m");
        // and the state is that row: a body as it was built takes its bonds and has its reaction
        let (mut again, _) = strip();
        state.fracture.restore(&mut again).unwrap();
        let held =
            again.particles().iter().map(|&site| site as usize).filter(|&site| loads.constrained(site) != 0);
        let reaction: f64 = held.map(|site| state.force.get(site)[1] * again.volume(site)).sum();
        assert!((reaction / last.load - 1.0).abs() < 2e-3, "{reaction} {}", last.load);
        assert_eq!(2 * state.fracture.broken, strip().0.directed_bonds() - again.directed_bonds());
    }
}

/// A body without supports along an axis is refused before any iteration; with a support along it or balanced
/// loads it is solved.
#[test]
fn free_bodies_under_forces() {
    for (held, force, missing) in [
        (0, [0.0, 2.0], Some("y")),
        (1, [0.0, 2.0], Some("y")),
        (2, [0.0, 2.0], None),
        (2, [1.0, 2.0], Some("x")),
        (3, [1.0, 2.0], None),
    ] {
        let (mut bonds, _) = strip();
        let mut loads = hold(&bonds, |x| (held > 0 && x[1] < 3e-3).then_some((held, [0.0; 2])));
        push(&bonds, &mut loads, force, |x| x[1] > 29e-3);
        let (result, state) = solved(&mut bonds, &loads, &[1.0], None, &Lbfgs::default());
        match (result, missing) {
            (Ok(()), None) => assert_eq!(state.history.len(), 1),
            (Err(error), Some(axis)) => {
                assert!(matches!(error, Error::NoEquilibrium { torn: false, .. }), "{error}");
                assert!(error.to_string().contains(&format!("holds it along {axis}")), "{error}");
                assert_eq!((state.counts.evaluations, error.exit_code()), (0, 2));
            }
            (result, missing) => panic!("held {held}: {result:?}, {missing:?}"),
        }
    }
    let (mut bonds, _) = strip();
    let mut loads = Loads::default();
    push(&bonds, &mut loads, [0.0, 2.0], |x| x[1] > 29e-3);
    push(&bonds, &mut loads, [0.0, -2.0], |x| x[1] < 3e-3);
    solved(&mut bonds, &loads, &[1.0], None, &Lbfgs::default()).0.unwrap();
}

/// Two blocks with a gap: supports are judged for each part, and contact may hold a part that presses on
/// another.
#[test]
fn parts_and_stops() {
    let block = |low: f64| Operation::Add(Shape::Box { min: [0.0, low], max: [8.0, low + 6.0] });
    let cells = lattice(&[block(0.0), block(12.0)], 1.0, 1.0).unwrap();
    let bonds = LatticeBonds::new(cells, 3.015, VolumeCorrection::None, &[]).unwrap();
    let mut up = hold(&bonds, |x| (x[1] < 3.0).then_some((3, [0.0; 2])));
    let mut down = up.clone();
    push(&bonds, &mut up, [0.0, 2.0], |x| x[1] > 15.0);
    push(&bonds, &mut down, [0.0, -2.0], |x| x[1] > 15.0);
    let free = ContactStops::default();
    let pairs = ContactStops { pairs: true, ..ContactStops::default() };
    let plane = |normal: f64| ContactStops { normals: vec![[0.0, normal]], ..ContactStops::default() };
    let roots = components(&bonds, |_, _| true);
    let of = |loads: &Loads<2>, stops: &ContactStops<2>| {
        find_unsupported(&bonds, &roots, loads, None, stops, 1e-3)
    };
    let Some(Unsupported { particles, total: all, middle, axis, force }) = of(&up, &free) else { panic!() };
    assert_eq!((particles, all, axis), (48, 96, "y"));
    assert!(
        (force - 2.0).abs() < 1e-12 && (middle[1] - 15.0).abs() < 1e-12 && (middle[0] - 4.0).abs() < 1e-12
    );
    assert!(of(&down, &free).is_some());
    assert!(of(&up, &pairs).is_some() && of(&down, &pairs).is_none());
    assert!(
        of(&up, &plane(1.0)).is_some() && of(&down, &plane(1.0)).is_none() && of(&up, &plane(-1.0)).is_none()
    );
}

/// A side moved past the other, in one step or many, with all components or one, and a region turned inside
/// out are refused; half the height, a punch through a ring, and a part rotated by a right angle are not.
#[test]
fn bodies_crushed_through_themselves() {
    let cube = || Body::<3>::solid([6, 6, 10], 0.1, 3.015).build().lattice;
    let found = |bonds: &LatticeBonds<3>, loads: &Loads<3>, factors: &[f64]| inverted(bonds, loads, factors);
    let press = |by: f64, held: u8| {
        move |bonds: &LatticeBonds<3>| {
            hold(bonds, |x| {
                let up = if x[2] > 0.7 { -by } else { 0.0 };
                (x[2] > 0.7 || x[2] < 0.3).then_some((held, [0.0, 0.0, up]))
            })
        }
    };
    let bonds = cube();
    for held in [7, 4] {
        let said = found(&bonds, &press(1.2, held)(&bonds), &[0.5, 1.0]).unwrap();
        // the layers next to each other, at 0.75 and 0.25, meet at 0.5/1.2
        assert!(said.contains("load factor 0.4167") && said.contains("pass"), "{said}");
        assert!(found(&bonds, &press(0.45, held)(&bonds), &[1.0]).is_none());
        assert!(found(&bonds, &press(1.2, held)(&bonds), &[0.2, 0.4]).is_none());
    }
    // the library's methods refuse it before they begin
    let mut bonds = cube();
    let loads = press(1.2, 7)(&bonds);
    let law = linear();
    let methods: [&dyn Method<3>; 2] = [&Lbfgs::default(), &VelocityVerlet::new(1.0, 1.0)];
    for method in methods {
        let mut system = System::new(&mut bonds, BondMaterial::new(&*law, 1.0), &loads, &[1.0]);
        let mut state = State::new(system.bonds.sites());
        let error =
            method.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap_err();
        assert!(matches!(&error, Error::Geometry(said) if said.contains("pass through")), "{error}");
        assert_eq!((state.counts.evaluations, error.exit_code()), (0, 2));
    }
    // a field: det F = 1 − 1.3
    let long = Body::<3>::solid([4, 4, 20], 0.1, 3.015).build().lattice;
    let shrink = |part: f64| hold(&long, |x| (x[0] < 0.25).then(|| (7, [0.0, 0.0, -part * x[2]])));
    let said = found(&long, &shrink(1.3), &[1.0]).unwrap();
    assert!(said.contains("det F = -0.300"), "{said}");
    assert!(found(&long, &shrink(0.6), &[1.0]).is_none());
    // a quarter turn along the chord has det F = ½ on the way
    let turn = hold(&bonds, |x| (x[2] > 0.7).then(|| (7, [0.6 - x[0] - x[1], x[0] - x[1], 0.0])));
    assert!(found(&bonds, &turn, &[0.25, 0.5, 0.75, 1.0]).is_none());
    // a punch through a ring
    let punch = hold(&bonds, |x| {
        let r = (x[0] - 0.3).hypot(x[1] - 0.3);
        let (inner, outer) = (r < 0.13 && x[2] > 0.8, r > 0.25 && x[2] < 0.3);
        (inner || outer).then(|| (7, [0.0, 0.0, if inner { -1.5 } else { 0.0 }]))
    });
    assert!(found(&bonds, &punch, &[1.0]).is_none());
}
