//! Bodies pressed together in equilibrium: springs in series, flanks of a crack, results independent of the
//! list of pairs.

use crate::bodies::{Body, Built, MODULUS, Slit, distance, hold, rms};
use peri::bonds::{BodyGeometry, Bonds};
use peri::calibrate::Space;
use peri::contact::{Contact, ContactSummary, RigidSurface, SHORT_RANGE};
use peri::geometry::Shape;
use peri::material::{BondMaterial, EightChainSolid};
use peri::model::Model;
use peri::potential::Law;
use peri::solver::{
    Breaking, DynamicRelaxation, Equilibrium, Lbfgs, LbfgsSolver, Loads, RelaxationSolver, State, System,
    load_stepping,
};

/// Run of a body with contact of a given stiffness and skin (in spacings), or without contact.
struct Run<'a, const D: usize> {
    bonds: &'a mut dyn Bonds<D>,
    loads: &'a Loads<D>,
    factors: &'a [f64],
    law: Law,
    contact: Option<[f64; 2]>,
    breaking: Option<Breaking>,
}

impl<const D: usize> Run<'_, D> {
    /// Number of list rebuilds.
    fn solve(
        self,
        method: &mut dyn Equilibrium<D>,
        state: &mut State<D>,
        watch: &mut dyn FnMut(&State<D>, bool),
    ) -> u64 {
        let law = self.law.build(720.0, 1200.0, true).unwrap();
        let spacing = self.bonds.spacing();
        let contact = self.contact.map(|[stiffness, skin]| {
            Contact::short_range(self.bonds, MODULUS, stiffness).unwrap().with_skin(skin * spacing)
        });
        let mut system = System::new(self.bonds, BondMaterial::new(&*law, MODULUS), self.loads, self.factors);
        (system.contact, system.breaking) = (contact, self.breaking);
        let mut see = |status: &peri::solver::Status, state: &State<D>| {
            watch(state, status.restartable);
            Ok(())
        };
        load_stepping(method, &mut system, state, &mut see, &mut |_, _| Ok(())).unwrap();
        system.contact.map_or(0, |contact| contact.rebuilds())
    }
}

/// Returns dynamic relaxation and L-BFGS.
fn methods<const D: usize>(tolerance: f64) -> [Box<dyn Equilibrium<D>>; 2] {
    let relaxation = DynamicRelaxation { tolerance, max_iterations: 20_000, ..Default::default() };
    let memory = Lbfgs { tolerance, max_iterations: 2000, ..Default::default() };
    [Box::new(RelaxationSolver::new(relaxation)), Box::new(LbfgsSolver::new(memory))]
}

/// Returns the contacts of the last step.
fn touching<const D: usize>(state: &State<D>) -> ContactSummary {
    state.history.last().unwrap().contact.unwrap()
}

/// Two rows of five particles, one above the other, on linear bonds 6kθV²/Δ, pressed by u through the contact
/// spring κ(6kθ/δ)V² with its gap of a tenth of a spacing: F = (u − 0.1Δ)/Σ 1/k, E = ½F(u − 0.1Δ).
#[test]
fn springs_in_series() {
    let mut body = Body::<2>::solid([1, 10], 1.0, 1.015);
    body.slits = vec![Slit { at: 5.0, from: -1.0, to: 2.0 }];
    let bond = 6.0 * MODULUS;
    let factors: Vec<f64> = (1..=10).map(|k| 0.1 * f64::from(k)).collect();
    for stiffness in [1e-3, SHORT_RANGE, 1e3] {
        let spring = stiffness * 6.0 * MODULUS / 1.015;
        let compliance = 8.0 / bond + 1.0 / spring;
        for (name, mut method) in ["relaxation", "L-BFGS"].into_iter().zip(methods(1e-9)) {
            let mut built = body.build();
            let bonds = &mut built.lattice;
            // 0.6 only for a spring that is not the softest: that one would let the next ones touch
            let most = if stiffness < 1.0 { 0.2 } else { 0.6 };
            let loads = hold(bonds, |x| {
                Some(if x[1] < 1.0 { (3, [0.0; 2]) } else { (if x[1] > 9.0 { 3 } else { 1 }, [0.0, -most]) })
            });
            let mut state = State::new(bonds.sites());
            let contact = Some([stiffness, 0.5]);
            let run =
                Run { bonds, loads: &loads, factors: &factors, law: Law::Linear, contact, breaking: None };
            run.solve(&mut *method, &mut state, &mut |_, _| ());
            for row in &state.history {
                let pressed = (most * row.factor - 0.1).max(0.0);
                let force = pressed / compliance;
                let found = row.load.abs();
                // the residual's tolerance over ten particles; the fitted law is good to 1e-9
                let size = (most - 0.1) / compliance;
                assert!((found - force).abs() < 1e-7 * size, "{name} κ = {stiffness}: {found} {force}");
                let energy = 0.5 * force * pressed;
                assert!((row.stored - energy).abs() < 1e-6 * size, "{name}: {} {energy}", row.stored);
                let inside = row.contact.unwrap();
                assert!((inside.energy - 0.5 * force * force / spring).abs() < 1e-6 * size);
                // as it just closes, rounding decides
                assert!(
                    (pressed - 1e-9).abs() < 2e-9 || inside.pairs == u64::from(pressed > 0.0),
                    "{inside:?}"
                );
                assert!((inside.overlap * 0.9 - force / spring).abs() < 1e-6, "{inside:?}");
            }
            eprintln!("series, κ = {stiffness}, {name}: {} force evaluations", state.counts.evaluations);
            // some hundred a step, however stiff the contact
            assert!(state.counts.evaluations < 4000, "{name}, κ = {stiffness}: {}", state.counts.evaluations);
        }
    }
}

/// Elastic blocks separated by a cut and pressed together have no force until the gap of a tenth of a spacing
/// closes; then both grips have equal forces, which grow with the approach, and the work of loads is stored.
/// Particles are guided along y, because opposite rows would slip sideways.
#[test]
fn elastic_blocks_press_each_other() {
    let mut body = Body::<2>::solid([24, 20], 1.0, 3.015);
    body.slits = vec![Slit { at: 10.0, from: -1.0, to: 25.0 }];
    let factors: Vec<f64> = (1..=20).map(|k| 0.05 * f64::from(k)).collect();
    let mut seen: Vec<(State<2>, Vec<[f64; 2]>)> = Vec::new();
    for (cloud, which) in [(false, 0), (true, 0), (false, 1), (true, 1)] {
        let mut built = body.build();
        let sites = if cloud { built.in_cloud } else { built.on_lattice };
        let bonds: &mut dyn Bonds<2> = if cloud { &mut built.cloud } else { &mut built.lattice };
        let mut loads = hold(bonds, |x| {
            Some(if x[1] < 3.0 { (3, [0.0; 2]) } else { (if x[1] > 17.0 { 3 } else { 1 }, [0.0, -1.0]) })
        });
        let region = |inside: &dyn Fn(f64) -> bool| {
            let at = |site: &&u32| inside(bonds.position(**site as usize)[1]);
            bonds.particles().iter().filter(at).copied().collect::<Vec<u32>>()
        };
        loads.held_regions = vec![region(&|y| y < 3.0), region(&|y| y > 17.0)];
        let mut state = State::new(bonds.sites());
        let contact = Some([SHORT_RANGE, 0.5]);
        let run =
            Run { bonds, loads: &loads, factors: &factors, law: Law::ChainOffset, contact, breaking: None };
        let lists = run.solve(&mut *methods(1e-8)[which], &mut state, &mut |_, _| ());
        let mut before = 0.0;
        for row in &state.history {
            let (bottom, top) = (row.reactions[0][1], row.reactions[1][1]);
            if row.factor < 0.099 {
                // the residual's tolerance over forces that begin with those of a strain of 0.05/14
                assert!(top.abs() < 1e-4 && row.stored < 1e-6, "no contact yet: {top}");
                continue;
            }
            // the residual's tolerance over some 100 free particles' forces
            assert!((top + bottom).abs() <= 1e-4 * top.abs() + 1e-9, "{top} {bottom}");
            assert!(-top >= before - 1e-9, "grows with the approach");
            before = -top;
        }
        let last = state.history.last().unwrap();
        // trapezoidal rule with 20 steps
        assert!((last.stored / last.work - 1.0).abs() < 0.02, "{} {}", last.stored, last.work);
        eprintln!(
            "blocks, cloud {cloud}, method {which}: {:?}, {} evaluations, {lists} lists",
            touching(&state),
            state.counts.evaluations
        );
        // a strain of 0.9/14 over 15 and over a part of the spacing
        assert!(touching(&state).pairs > 20 && touching(&state).overlap < 0.2);
        let moved = sites.iter().map(|&site| state.displacement.get(site)).collect();
        seen.push((state, moved));
    }
    for (state, moved) in &seen[1..] {
        let apart = distance(moved, &seen[0].1) / rms(&seen[0].1);
        let loads = [state, &seen[0].0].map(|state| state.history.last().unwrap().load);
        // residuals over the softest mode
        assert!(apart < 1e-4 && (loads[0] / loads[1] - 1.0).abs() < 1e-5, "{apart:.1e} {loads:?}");
    }
    let [slow, fast] = [&seen[0].0, &seen[2].0].map(|state| state.counts.evaluations);
    assert!(3 * fast < 2 * slow, "{fast} {slow}");
}

fn bits<const D: usize>(state: &State<D>) -> Vec<u64> {
    let fields = [&state.displacement, &state.velocity, &state.force];
    let all = fields.into_iter().flat_map(|field| field.components().into_iter().flatten());
    let history = state.history.iter().flat_map(|row| [row.load, row.stored]);
    let numbers = all.copied().chain(history).chain([state.work]);
    numbers.map(f64::to_bits).chain([state.counts.total_iterations, state.fracture.broken]).collect()
}

/// Sheet with a crack of zero width across most of it, compressed and sheared by twice as much, so that the
/// flanks slide over and into each other.
fn sheet(cells: usize, down: f64) -> (Built<2>, impl Fn(&dyn Bonds<2>) -> Loads<2>) {
    let n = cells as f64;
    let mut body = Body::<2>::solid([cells, cells], 1.0, 3.015);
    body.slits = vec![Slit { at: 0.5 * n, from: 0.1 * n, to: 0.9 * n }];
    let loads = move |bonds: &dyn Bonds<2>| {
        hold(bonds, |x| {
            (x[1] < 3.0).then_some((3, [0.0; 2])).or((x[1] > n - 3.0).then_some((3, [2.0 * down, -down])))
        })
    };
    (body.build(), loads)
}

/// κ = 0 records the overlap of flanks without contact.
#[test]
fn flanks_do_not_interpenetrate() {
    let factors: Vec<f64> = (1..=10).map(|k| 0.1 * f64::from(k)).collect();
    for down in [2.0, 4.0] {
        for which in 0..2 {
            let deepest = [0.0, SHORT_RANGE].map(|stiffness| {
                let (mut built, loads) = sheet(30, down);
                let loads = loads(&built.lattice);
                let mut state = State::new(built.lattice.sites());
                let (bonds, contact) = (&mut built.lattice, Some([stiffness, 0.5]));
                let run = Run {
                    bonds,
                    loads: &loads,
                    factors: &factors,
                    law: Law::ChainOffset,
                    contact,
                    breaking: None,
                };
                run.solve(&mut *methods(1e-4)[which], &mut state, &mut |_, _| ());
                let touching = touching(&state);
                eprintln!(
                    "down {down}, κ = {stiffness}, method {which}: {touching:?}, {} evaluations",
                    state.counts.evaluations
                );
                touching.overlap
            });
            // without it flanks pass through each other; with it they overlap by what presses them together
            // over κ: a strain of 4/24 over 15, some three times that at the crack's ends
            assert!(deepest[0] > 0.5 && deepest[1] < 0.25, "{deepest:?}");
        }
    }
}

/// Bits do not depend on threads, the skin of the list and a restart, while bonds break.
#[test]
fn neither_threads_nor_lists_nor_restarts_change_a_bit() {
    let run = |which: usize, threads: usize, skin: f64, cloud: bool, from: Option<State<2>>, save: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (mut built, loads) = sheet(66, 5.5);
            let bonds: &mut dyn Bonds<2> = if cloud { &mut built.cloud } else { &mut built.lattice };
            let loads = loads(bonds);
            let mut state = from.unwrap_or_else(|| State::new(bonds.sites()));
            let mut saved = None;
            let breaking = Some(Breaking { criterion: 1.17.into(), policy: Default::default() });
            let (law, contact) = (Law::ChainOffset, Some([SHORT_RANGE, skin]));
            let run = Run { bonds, loads: &loads, factors: &[0.4, 0.7, 1.0], law, contact, breaking };
            let lists = run.solve(&mut *methods(1e-2)[which], &mut state, &mut |state, restartable| {
                if restartable && state.counts.total_iterations >= save && saved.is_none() {
                    saved = Some(state.clone());
                }
            });
            assert!(state.displacement.sites() > peri::field::CHUNK);
            (bits(&state), saved, lists, state)
        })
    };
    for (which, cloud) in [(0, false), (0, true), (1, false), (1, true)] {
        let (one, _, lists, state) = run(which, 1, 0.5, cloud, None, u64::MAX);
        let (broken, iterations) = (state.fracture.broken, state.counts.total_iterations);
        eprintln!("{:?}, {broken} broken, {iterations} iterations, {lists} lists", touching(&state));
        assert!(touching(&state).pairs > 20 && broken > 0);
        assert!(run(which, 3, 0.5, cloud, None, u64::MAX).0 == one, "threads, cloud: {cloud}");
        for skin in [0.0, 3.0] {
            let other = run(which, 2, skin, cloud, None, u64::MAX);
            assert!(other.2 != lists && other.0 == one, "skin {skin}, cloud: {cloud}");
        }
        // L-BFGS may be restarted where it restarts, which is at the start of a step
        let saved = run(which, 2, 0.5, cloud, None, iterations * [3, 1][which] / 4).1.unwrap();
        assert!(saved.counts.total_iterations < iterations);
        assert!(run(which, 2, 0.2, cloud, Some(saved), u64::MAX).0 == one, "restart, cloud: {cloud}");
    }
}

/// Contact changes no bit if nothing touches, recording overlaps never does, and contact is not built unless
/// requested.
#[test]
fn contact_without_touch_changes_no_bit() {
    let solve = |which: usize, contact: Option<[f64; 2]>| {
        let mut built = Body::<2>::solid([30, 24], 0.1, 3.015).build();
        let bonds: &mut dyn Bonds<2> = &mut built.lattice;
        let loads = hold(bonds, |x| (x[0] < 0.3 || x[0] > 2.7).then(|| (3, [0.05 * x[0], 0.0])));
        let mut state = State::new(bonds.sites());
        let run = Run {
            bonds,
            loads: &loads,
            factors: &[0.5, 1.0],
            law: Law::ChainOffset,
            contact,
            breaking: None,
        };
        run.solve(&mut *methods(1e-4)[which], &mut state, &mut |_, _| ());
        assert_eq!(state.history[1].contact.map(|touching| touching.pairs), contact.map(|_| 0));
        bits(&state)
    };
    for which in 0..2 {
        let without = solve(which, None);
        assert!(
            without == solve(which, Some([SHORT_RANGE, 0.5])) && without == solve(which, Some([0.0, 0.5]))
        );
    }
    let pressed = |contact: Option<[f64; 2]>| {
        let (mut built, loads) = sheet(30, 4.0);
        let loads = loads(&built.lattice);
        let mut state = State::new(built.lattice.sites());
        let (bonds, law) = (&mut built.lattice, Law::ChainOffset);
        let run = Run { bonds, loads: &loads, factors: &[1.0], law, contact, breaking: None };
        run.solve(&mut *methods(1e-2)[0], &mut state, &mut |_, _| ());
        bits(&state)
    };
    assert!(pressed(None) == pressed(Some([0.0, 0.5])));
    let mut built = Body::<2>::solid([3, 3], 1.0, 1.5).build();
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let loads = Loads::default();
    assert!(
        System::new(&mut built.lattice, BondMaterial::new(&*law, MODULUS), &loads, &[]).contact.is_none()
    );
}

/// A block of 20 × 12 (plane strain, μ = 0.4, K/μ = 20), bonded to two plates and squeezed by 40 %: its sides
/// fold onto the plates, and it carries what finite elements do (FElupe 11, whose sides touch the plates:
/// 12.066 and 37.221 at 2.4 and 4.8 with 48 over the half height; with 12, 37.118 at 4.8, and 34.052 where
/// sides pass through the plates).
#[test]
fn sides_fold_onto_bonded_plates() {
    let body = peri::model::Body::lattice(Shape::rectangle([0.0; 2], [20.0, 12.0]), 0.5).plane_strain(1.0);
    let rubber = EightChainSolid::new(Space::PlaneStrain, 0.4, 25.0, 8.0).unwrap();
    let plate =
        |point, normal| RigidSurface { bonded: true, stiffness: 10.0, ..RigidSurface::plane(point, normal) };
    let upper = RigidSurface { displacement: [0.0, -4.8], ..plate([0.0, 12.0], [0.0, -1.0]) };
    let model = Model::new(body, rubber).contact(0.0).rigid_surface(plate([0.0; 2], [0.0, 1.0]));
    let mut simulation = model.rigid_surface(upper).steps(8).build().unwrap();
    simulation.solve(Lbfgs { tolerance: 1e-4, ..Lbfgs::default() }).unwrap();
    let rows = simulation.history();
    for (row, reference) in [(&rows[3], 12.066), (&rows[7], 37.221)] {
        let (off, touching) = (row.load / reference - 1.0, row.contact.unwrap().pairs);
        eprintln!("squeezed by {:.1}: {:.3}, {off:.4}; {touching} contacts", row.displacement, row.load);
        assert!(off.abs() < 0.04, "{} at {}", row.load, row.displacement);
    }
    let [first, last] = [&rows[0], &rows[7]].map(|row| row.contact.unwrap().pairs);
    assert!(last >= first + 8, "{first} contacts at first, {last} at last");
    assert!((rows[7].stored / rows[7].work - 1.0).abs() < 0.01);
    let lowest = simulation.displacements().map(|(x, u)| x[1] + u[1]).fold(f64::INFINITY, f64::min);
    assert!(lowest > -0.1 * 0.5, "a particle at {lowest}");
}
