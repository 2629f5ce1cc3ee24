//! Coulomb friction and rigid planes in equilibrium: closed forms of a belt, a bar, a spring and a row of
//! particles on a plane.

use crate::bodies::{Body, MODULUS, Slit, hold};
use crate::friction::beside;
use peri::Error;
use peri::bonds::{BodyGeometry, Bonds};
use peri::contact::{Contact, RigidSurface, SHORT_RANGE};
use peri::material::BondMaterial;
use peri::potential::Law;
use peri::solver::{DynamicRelaxation, Lbfgs, Loads, Method, State, System};
use peri::surface::BodySurface;

/// Solves all steps by a method; returns the final state and the first restartable state of step 2.
fn equilibria(
    method: usize,
    bonds: &mut dyn Bonds<2>,
    loads: &Loads<2>,
    contact: Contact<2>,
    factors: &[f64],
    from: Option<State<2>>,
) -> Result<(State<2>, Option<State<2>>), Error> {
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let mut system = System::new(bonds, BondMaterial::new(&*law, MODULUS), loads, factors);
    system.contact = Some(contact);
    let mut state = from.unwrap_or_else(|| State::new(system.bonds.sites()));
    let mut saved = None;
    let watch = &mut |status: &peri::solver::Status, state: &State<2>| {
        if status.restartable && status.step == 2 && saved.is_none() {
            saved = Some(state.clone());
        }
        Ok(())
    };
    let finished = &mut |_: &dyn Bonds<2>, _: &_| Ok(());
    match method {
        0 => DynamicRelaxation { tolerance: 1e-9, ..DynamicRelaxation::default() }.solve(
            &mut system,
            &mut state,
            watch,
            finished,
        )?,
        _ => Lbfgs { tolerance: 1e-9, ..Lbfgs::default() }.solve(&mut system, &mut state, watch, finished)?,
    }
    Ok((state, saved))
}

/// The drag of a belt in equilibrium grows as k_t U up to μN, to rounding, for any number of steps.
#[test]
fn belt_in_equilibrium() {
    for (method, steps) in [(0, 4), (1, 4), (1, 16), (1, 64)] {
        let mut built = Body::<2>::solid([2, 1], 1.0, 1.015).build();
        let bonds = &mut built.lattice;
        let loads = hold(bonds, |_| Some((3, [0.0; 2])));
        let (mu, stiffness, deep) = (0.5, 40.0, 0.1);
        let belt = RigidSurface {
            friction: mu,
            stiffness,
            displacement: [0.2, 0.0],
            ..RigidSurface::plane([0.0, deep], [0.0, 1.0])
        };
        let contact = beside(bonds, 0.0, vec![belt]);
        let factors: Vec<f64> = (1..=steps).map(|step| f64::from(step) / f64::from(steps)).collect();
        let (state, _) = equilibria(method, bonds, &loads, contact, &factors, None).unwrap();
        for (factor, row) in factors.iter().zip(&state.history) {
            // each particle has an area of 1 m²
            let normal = 2.0 * stiffness * deep;
            let wanted = (2.0 * stiffness * 0.2 * factor).min(mu * normal);
            let found = row.resting[0].force;
            assert!((found[1] / normal - 1.0).abs() < 1e-12, "{found:?} {normal}");
            assert!((found[0] / wanted - 1.0).abs() < 1e-8, "of {steps} steps: {found:?} {wanted}");
        }
    }
}

/// Returns load factors in equal steps, without the first.
fn leg(from: f64, to: f64, steps: usize) -> impl Iterator<Item = f64> {
    (1..=steps).map(move |step| from + (to - from) * step as f64 / steps as f64)
}

/// A bar of stiffness EA = 1 and length 1 on a plane with friction τ = 1 per length, pulled at one end to U =
/// 0.18, back to −U and again to U: F(U) = √(2EAτU), F at 0 on the way back F_U − 2√(EAτU), a cycle
/// dissipates 4F_U U/3, for any number of steps.
#[test]
fn strip_pulled_forth_and_back() {
    // lengths in cells, forces in units of the bonds' k = 6kθ, which is EA
    let (count, pull) = (100, 0.18);
    let unit = 6.0 * MODULUS;
    for steps in [4, 16, 64] {
        let mut built = Body::<2>::solid([count, 1], 1.0, 1.015).build();
        let bonds = &mut built.lattice;
        let end = pull * count as f64;
        let loads = hold(bonds, |x| Some((if x[0] > count as f64 - 1.0 { 3 } else { 2 }, [end, 0.0])));
        // a penalty ten times the bonds', and μN = 1/n of the unit for each particle
        let (mu, stiffness) = (0.5, 60.0 * MODULUS);
        let deep = unit / count as f64 / (mu * stiffness);
        let floor = RigidSurface { friction: mu, stiffness, ..RigidSurface::plane([0.0, deep], [0.0, 1.0]) };
        let contact = beside(bonds, 0.0, vec![floor]);
        let factors: Vec<f64> =
            leg(0.0, 1.0, steps).chain(leg(1.0, -1.0, 2 * steps)).chain(leg(-1.0, 1.0, 2 * steps)).collect();
        let (state, _) = equilibria(1, bonds, &loads, contact, &factors, None).unwrap();
        let load = |row: usize| state.history[row - 1].load / unit;
        let (first, back) = (load(steps), load(2 * steps));
        let taken = state.history.last().unwrap().rubbed - state.history[steps - 1].rubbed;
        let (exact, cycle) = ((2.0 * pull).sqrt(), taken / (unit * count as f64));
        eprintln!("strip, {steps} steps: F(U) {first:.4}, back {back:.4}, cycle {cycle:.4}");
        // half of the held particle is beyond the end of the bar, and rubs along the whole way
        let half = 0.5 / count as f64;
        assert!((first - exact - half).abs() < 1e-3, "{first} {exact}");
        assert!((back - (exact - 2.0 * pull.sqrt()) + half).abs() < 1e-3, "{back}");
        assert!((cycle / (4.0 / 3.0 * exact * pull + 4.0 * half * pull) - 1.0).abs() < 5e-3, "{cycle}");
    }
}

/// A particle on a spring k = 6kθV²/Δ over a plane that presses with N, loaded, unloaded and loaded again:
/// both springs in series up to μN; a cycle dissipates 4μN(U − μN/k'), likewise at the held end.
#[test]
fn spring_over_a_plane() {
    let (mu, stiffness, deep, far) = (0.4, 30.0, 0.1, 0.5);
    let spring = 6.0 * MODULUS;
    let (series, bound) = (spring * stiffness / (spring + stiffness), mu * stiffness * deep);
    let factors = [0.25, 0.5, 1.0, 0.5, 0.0, -0.5, -1.0, -0.5, 0.0, 0.5, 1.0];
    for method in 0..2 {
        for last in 1..=factors.len() {
            let mut built = Body::<2>::solid([2, 1], 1.0, 1.015).build();
            let bonds = &mut built.lattice;
            let loads = hold(bonds, |x| Some(if x[0] < 1.0 { (3, [far, 0.0]) } else { (2, [0.0; 2]) }));
            let plane =
                RigidSurface { friction: mu, stiffness, ..RigidSurface::plane([0.0, deep], [0.0, 1.0]) };
            let contact = beside(bonds, 0.0, vec![plane]);
            let (state, _) = equilibria(method, bonds, &loads, contact, &factors[..last], None).unwrap();
            let (mut pulled, mut before) = (0.0_f64, 0.0);
            for factor in &factors[..last] {
                pulled = (pulled + series * far * (factor - before)).clamp(-bound, bound);
                before = *factor;
            }
            let found = state.displacement.get(bonds.particles()[1] as usize)[0];
            let exact = far * factors[last - 1] - pulled / spring;
            assert!((found - exact).abs() < 1e-7, "method {method}, step {last}: {found} {exact}");
            if last == factors.len() {
                let taken = state.history[last - 1].rubbed - state.history[2].rubbed;
                let exact = 4.0 * bound * (2.0 * far - bound / series - bound / stiffness);
                eprintln!("spring, method {method}: a cycle takes {taken:.7}, exactly {exact:.7}");
                assert!((taken / exact - 1.0).abs() < 1e-6);
            }
        }
    }
}

/// A row of five particles against a plane, F = u/(4/k + 1/s) with k = 6kθV²/Δ of the bonds and stiffness s
/// of the plane: by both quasi-static methods, with moving planes and moving supports.
#[test]
fn row_on_a_plane() {
    let (cells, ratio) = ([1, 5], 1.015);
    for stiffness in [1.0, 15.0, 300.0] {
        for method in 0..3 {
            let mut built = Body::<2>::solid(cells, 1.0, ratio).build();
            let bonds = &mut built.lattice;
            let by_plane = method < 2;
            let top = if by_plane { 0.0 } else { -0.2 };
            let loads = hold(bonds, |x| (x[1] > 4.0).then_some((3, [0.0, top])));
            let law = Law::Linear.build(1.0, 1.0, false).unwrap();
            let displacement = if by_plane { [0.0, 0.2] } else { [0.0; 2] };
            let plane = RigidSurface { stiffness, displacement, ..RigidSurface::plane([0.0; 2], [0.0, 2.0]) };
            let contact = beside(bonds, 0.0, vec![plane]);
            let factors = [0.25, 0.5, 1.0];
            let mut system = System::new(bonds, BondMaterial::new(&*law, MODULUS), &loads, &factors);
            system.contact = Some(contact);
            let mut state = State::new(system.bonds.sites());
            let (watch, finished) = (&mut |_: &_, _: &_| Ok(()), &mut |_: &dyn Bonds<2>, _: &_| Ok(()));
            match method {
                1 => {
                    let solver = Lbfgs { tolerance: 1e-9, ..Lbfgs::default() };
                    solver.solve(&mut system, &mut state, watch, finished).unwrap();
                }
                _ => {
                    let solver = DynamicRelaxation { tolerance: 1e-9, ..DynamicRelaxation::default() };
                    solver.solve(&mut system, &mut state, watch, finished).unwrap();
                }
            }
            let unit = 6.0 * MODULUS;
            for (factor, row) in factors.iter().zip(&state.history) {
                let exact = 0.2 * factor / (4.0 / unit + 1.0 / stiffness);
                let resting = row.resting[0];
                let error = row.load / exact - 1.0;
                assert!(error.abs() < 1e-7, "κ = {stiffness}, method {method}: {} {exact}", row.load);
                assert!(
                    (resting.force[1] / exact - 1.0).abs() < 1e-7
                        && resting.area == 1.0
                        && resting.spread == 0.0
                );
                assert!((row.displacement - 0.2 * factor).abs() < 1e-15);
                assert!(row.balance.force < 1e-12 * exact && row.balance.external < 1e-7 * exact);
                assert!((row.work / (0.5 * exact * 0.2 * factor) - 1.0).abs() < 1e-6, "{row:?}");
                assert!((row.stored / row.work - 1.0).abs() < 1e-6);
            }
        }
    }
}

/// Two blocks, one on the other and both on a rough plane, pressed and dragged: sliding contacts carry μN of
/// the current step; forces balance, and a run resumed within a step gives the same bits, on any number of
/// threads.
#[test]
fn dragged_over_a_plane() {
    let mut body = Body::<2>::solid([8, 8], 1.0, 3.015);
    body.slits = vec![Slit { at: 4.0, from: -1.0, to: 9.0 }];
    let run = |method: usize, threads: usize, from: Option<State<2>>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut built = body.build();
            let bonds = &mut built.lattice;
            let loads = hold(bonds, |x| (x[1] > 6.0).then_some((3, [2.0, -0.6])));
            let plane =
                RigidSurface { friction: 0.1, stiffness: 30.0, ..RigidSurface::plane([0.0; 2], [0.0, 1.0]) };
            let contact = beside(bonds, SHORT_RANGE, vec![plane]).with_friction(0.4, None).unwrap();
            let factors = [0.25, 0.5, 0.75, 1.0];
            equilibria(method, bonds, &loads, contact, &factors, from).unwrap()
        })
    };
    for method in 0..2 {
        let (one, saved) = run(method, 1, None);
        for pair in one.history.windows(2) {
            let [before, now] = [&pair[0], &pair[1]];
            let (rub, bound) = (-now.resting[0].force[0], 0.1 * now.resting[0].force[1]);
            eprintln!(
                "dragged, method {method}: {rub:.6} N of {bound:.6}, friction took {:.5} of {:.5} J, {:?}",
                now.rubbed, now.work, now.balance
            );
            assert!(bound > 0.01 && (rub / bound - 1.0).abs() < 1e-6);
            assert!(now.balance.force < 1e-12 * now.balance.size && now.rubbed > before.rubbed);
            assert!(now.balance.external < 1e-6 * now.balance.size);
        }
        assert!(run(method, 2, None).0 == one && run(method, 2, saved).0 == one, "method {method}");
    }
}

/// A block pressed by a twentieth between planes: L-BFGS takes as many iterations at any stiffness of the
/// planes, with friction at ten times the least, and finds the forces of relaxation.
#[test]
fn stiff_planes_take_no_more_iterations() {
    let run = |method: usize, friction: f64, times: f64| {
        let mut built = Body::<2>::solid([16, 12], 1.0, 3.015).build();
        let bonds = &mut built.lattice;
        let loads = hold(bonds, |x| ((x[0] - 7.5).abs() + (x[1] - 5.5).abs() < 0.1).then_some((1, [0.0; 2])));
        let plane = |point, normal| RigidSurface {
            friction,
            stiffness: times * MODULUS,
            ..RigidSurface::plane(point, normal)
        };
        let upper = RigidSurface { displacement: [0.0, -0.6], ..plane([0.0, 12.0], [0.0, -1.0]) };
        let surfaces = vec![plane([0.0, 0.0], [0.0, 1.0]), upper];
        let contact = Contact::short_range(bonds, MODULUS, 0.0).unwrap();
        let contact = contact.with_surfaces(bonds, &BodySurface::of_lattice(bonds), 1.0, surfaces).unwrap();
        let (state, _) = equilibria(method, bonds, &loads, contact, &[0.5, 1.0], None).unwrap();
        let forces = state.history.last().unwrap().resting.iter().map(|resting| resting.force[1]).collect();
        (state.counts.total_iterations, forces)
    };
    for friction in [0.0, 0.3] {
        let stiff = [100.0, 1e3, 1e5];
        let found: [(u64, Vec<f64>); 3] = stiff.map(|times| run(1, friction, times));
        let counts = found.each_ref().map(|found| found.0);
        let (relaxed, forces) = run(0, friction, stiff[0]);
        eprintln!("planes, μ = {friction}: {counts:?} iterations, relaxation {relaxed}; {:?}", found[0].1);
        // with the stiffest, an elastic slip of 1e-5 spacings, faces alternate between stick and slip: four
        // times as many iterations, for a thousand times the stiffness
        let most = if friction > 0.0 { 10 } else { 2 };
        assert!(counts[1] < 2 * counts[0] && counts[2] < most * counts[0], "μ = {friction}: {counts:?}");
        for (a, b) in found[0].1.iter().zip(&forces) {
            assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
        }
    }
}
