//! Preconditioned L-BFGS against dynamic relaxation: equal equilibria with less work.

use crate::bodies::{Body, Built, MODULUS, distance, hold, rms};
use crate::load_steps::dent;
use peri::Error;
use peri::bonds::{BodyGeometry, Bonds, LatticeBonds, VolumeCorrection};
use peri::calibrate::{Space, modulus};
use peri::field::Field;
use peri::geometry::{Operation, Shape, lattice};
use peri::material::BondMaterial;
use peri::potential::{BondPotential, Law};
use peri::solver::{
    Breaking, DynamicRelaxation, Equilibrium, Lbfgs, LbfgsSolver, Loads, Method, Policy, RelaxationSolver,
    State, Support, System, load_stepping,
};

/// Problem for any bonds.
struct Problem<'a, const D: usize> {
    law: &'a dyn BondPotential,
    modulus: f64,
    loads: &'a Loads<D>,
    factors: &'a [f64],
    breaking: Option<Breaking>,
}

impl<'a, const D: usize> Problem<'a, D> {
    fn new(law: &'a dyn BondPotential, modulus: f64, loads: &'a Loads<D>, factors: &'a [f64]) -> Self {
        Self { law, modulus, loads, factors, breaking: None }
    }

    fn solve(&self, bonds: &mut dyn Bonds<D>, method: &mut dyn Equilibrium<D>) -> Result<State<D>, Error> {
        let mut state = State::new(bonds.sites());
        let mut system =
            System::new(bonds, BondMaterial::new(self.law, self.modulus), self.loads, self.factors);
        system.breaking.clone_from(&self.breaking);
        load_stepping(method, &mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(()))?;
        Ok(state)
    }

    fn relaxed(&self, bonds: &mut dyn Bonds<D>, tolerance: f64) -> State<D> {
        let settings = DynamicRelaxation { tolerance, ..Default::default() };
        self.solve(bonds, &mut RelaxationSolver::new(settings)).unwrap()
    }

    fn minimised(&self, bonds: &mut dyn Bonds<D>, tolerance: f64) -> State<D> {
        self.solve(bonds, &mut method(tolerance)).unwrap()
    }
}

fn method<const D: usize>(tolerance: f64) -> LbfgsSolver<D> {
    LbfgsSolver::new(Lbfgs { tolerance, max_iterations: 2000, ..Default::default() })
}

fn displacements<const D: usize>(bonds: &dyn Bonds<D>, state: &State<D>) -> Vec<[f64; D]> {
    bonds.particles().iter().map(|&site| state.displacement.get(site as usize)).collect()
}

/// Returns the largest difference of two displacement fields over the rms of the first.
fn apart<const D: usize>(bonds: &dyn Bonds<D>, a: &State<D>, b: &State<D>) -> f64 {
    let (a, b) = (displacements(bonds, a), displacements(bonds, b));
    distance(&a, &b) / rms(&a)
}

/// The plate with a hole of `cases/ch2/plate-with-hole`.
struct Plate {
    bonds: LatticeBonds<2>,
    loads: Loads<2>,
    law: Box<dyn BondPotential>,
    modulus: f64,
}

impl Plate {
    fn new(spacing: f64) -> Self {
        let (half, thickness, ratio) = (0.5, 10e-3, 3.015);
        let body = [
            Operation::Add(Shape::Box { min: [-half; 2], max: [half; 2] }),
            Operation::Cut(Shape::Ball { centre: [0.0; 2], radius: 0.06 }),
        ];
        let cells = lattice(&body, spacing, thickness).unwrap();
        let bonds = LatticeBonds::new(cells, ratio, VolumeCorrection::None, &[]).unwrap();
        let depth = 3.0 * spacing;
        let side = |sign: f64| -> (Vec<u32>, Support<2>) {
            let inside = |&site: &u32| sign * bonds.position(site as usize)[0] > half - depth;
            let sites = bonds.particles().iter().copied().filter(inside).collect();
            (sites, Support { displacement: [None; 2], body_force: [sign * 1e3 / depth, 0.0] })
        };
        let loads = Loads::new(bonds.sites(), &[side(1.0), side(-1.0)]);
        let law = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
        let modulus = modulus(Space::PlaneStress, 1e6, ratio * spacing, thickness);
        Self { bonds, loads, law, modulus }
    }
}

/// L-BFGS needs at most a tenth of the work of dynamic relaxation at 1 mm, whose work grows with the number
/// of particles across. `PLATE=1` in the environment measures 4, 2 and 1 mm (minutes).
#[test]
fn plate_with_a_hole() {
    let far = std::env::var_os("PLATE").is_some();
    let spacings: &[f64] = if far { &[10e-3, 5e-3, 4e-3, 2e-3, 1e-3] } else { &[10e-3, 5e-3] };
    let mut counts = Vec::new();
    for &spacing in spacings {
        let mut plate = Plate::new(spacing);
        let problem = Problem::new(&*plate.law, plate.modulus, &plate.loads, &[1.0]);
        let start = std::time::Instant::now();
        let fast = problem.minimised(&mut plate.bonds, 1e-5);
        let middle = start.elapsed().as_secs_f64();
        let slow = problem.relaxed(&mut plate.bonds, 1e-5);
        let ratio = slow.counts.bond_evaluations as f64 / fast.counts.bond_evaluations as f64;
        eprintln!(
            "plate, dx = {spacing}: {} and {} force evaluations, a factor of {ratio:.1}; {middle:.2} and \
             {:.2} s",
            fast.counts.evaluations,
            slow.counts.evaluations,
            start.elapsed().as_secs_f64() - middle
        );
        assert!(fast.convergence.residual <= 1e-5);
        // the residual over the lowest eigenvalue (π/L)²: 1e-5 of the load is 1e-3 of the displacement at
        // most
        let apart = apart(&plate.bonds, &fast, &slow);
        assert!(apart < 1e-3, "dx = {spacing}: {apart:.1e}");
        // measured: 18 to 20
        assert!(fast.counts.evaluations <= 30, "dx = {spacing}: {} evaluations", fast.counts.evaluations);
        assert!(ratio > if spacing < 6e-3 { 30.0 } else { 15.0 }, "dx = {spacing}: {ratio}");
        counts.push(fast.counts.evaluations);
    }
}

/// A notched body with a hole, all corrections, pulled by a quarter and sheared: ends at x.
fn damaged<const D: usize>(cells: [usize; D]) -> (Built<D>, f64) {
    (Body::<D>::damaged(cells, 0.125, 3.015).build(), 0.125 * cells[0] as f64 - 0.375)
}

/// Every stress-free law, stretches from far below to far above 1, on both representations and in both
/// dimensions.
#[test]
fn same_equilibrium_as_relaxation() {
    fn check<const D: usize>(cells: [usize; D], most: u64) {
        let (mut built, end) = damaged(cells);
        for law in Law::ALL {
            let potential = law.build(100.0, 1200.0, law.rescales()).unwrap();
            if !potential.is_stress_free() {
                continue;
            }
            for cloud in [false, true] {
                let bonds: &mut dyn Bonds<D> = if cloud { &mut built.cloud } else { &mut built.lattice };
                let loads = hold(bonds, |x| {
                    let mut pulled = [0.0; D];
                    (pulled[0], pulled[1]) = (0.25 * x[0], 0.05 * x[0]);
                    (x[0] < 0.375 || x[0] > end).then_some(((1 << D) - 1, pulled))
                });
                let problem = Problem::new(&*potential, MODULUS, &loads, &[0.5, 1.0]);
                let (slow, fast) = (problem.relaxed(bonds, 1e-7), problem.minimised(bonds, 1e-7));
                let apart = apart(bonds, &slow, &fast);
                let name = format!("{D}D, {}, cloud: {cloud}", law.name());
                eprintln!(
                    "{name}: {} and {} evaluations in two steps, {apart:.1e} apart",
                    slow.counts.evaluations, fast.counts.evaluations
                );
                // residual 1e-7 over the softest mode
                assert!(apart < 1e-5, "{name}: {apart:.1e}");
                let pulls = [&slow, &fast].map(|state| state.history[1].load);
                assert!((pulls[0] / pulls[1] - 1.0).abs() < 1e-6, "{name}: {pulls:?}");
                assert!(fast.counts.evaluations <= most, "{name}: {} evaluations", fast.counts.evaluations);
            }
        }
    }
    check([30, 24], 150);
    check([12, 10, 9], 150);
}

/// Twenty steps to rupture and beyond: the same load curve, fewer evaluations.
#[test]
fn dent_through_breaking() {
    let spacing = std::env::var("DENT").map_or(4.0, |x| x.parse().unwrap()) * 1e-3;
    let factors: Vec<f64> = (1..=20).map(|k| f64::from(k) / 20.0).collect();
    let mut states = Vec::new();
    for fast in [false, true] {
        let (mut bonds, loads, law, modulus) = dent(spacing, 0.02);
        let mut problem = Problem::new(&*law, modulus, &loads, &factors);
        problem.breaking = Some(Breaking { criterion: 2.9442.into(), policy: Policy::AtEquilibrium });
        let start = std::time::Instant::now();
        let state =
            if fast { problem.minimised(&mut bonds, 1e-4) } else { problem.relaxed(&mut bonds, 1e-4) };
        let loads: Vec<String> = state.history.iter().map(|r| format!("{:.2}", r.load)).collect();
        let rounds: u64 = state.history.iter().map(|r| r.rounds).sum();
        eprintln!(
            "dent, dx = {spacing}: {} evaluations, {rounds} rounds, {} broken, {:.1} s: {loads:?}",
            state.counts.evaluations,
            state.fracture.broken,
            start.elapsed().as_secs_f64()
        );
        states.push(state);
    }
    let [slow, fast] = [&states[0], &states[1]];
    let peak = |state: &State<2>| state.history.iter().map(|r| r.load).fold(0.0, f64::max);
    // the same bonds break until the peak; behind it a crack may choose another of equal ways
    assert!((peak(fast) / peak(slow) - 1.0).abs() < 0.01, "{} {}", peak(fast), peak(slow));
    assert!(fast.fracture.broken > 0 && slow.fracture.broken > 0);
    for (a, b) in slow.history.iter().zip(&fast.history).take_while(|(a, _)| a.load < peak(slow)) {
        assert!((a.load / b.load - 1.0).abs() < 1e-3, "{} {}", a.load, b.load);
        assert_eq!(a.broken, b.broken);
    }
    let ratio = slow.counts.bond_evaluations as f64 / fast.counts.bond_evaluations as f64;
    assert!(ratio > 2.0, "{ratio}");
}

/// Bits do not depend on threads, with several work items and elements, on a lattice and a cloud, with
/// breaking bonds.
#[test]
#[ignore = "takes 6 to 35 s; .ci/run runs it"]
fn bits_do_not_depend_on_threads() {
    let run = |threads: usize, cloud: bool| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut built = Body::<2>::damaged([120, 115], 0.1, 3.015).build();
            let bonds: &mut dyn Bonds<2> = if cloud { &mut built.cloud } else { &mut built.lattice };
            let loads = hold(bonds, |x| (x[0] < 0.3 || x[0] > 11.7).then(|| (3, [0.2 * x[0], 0.01 * x[0]])));
            let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
            let mut problem = Problem::new(&*law, 1.0, &loads, &[0.5, 1.0]);
            problem.breaking = Some(Breaking { criterion: 1.5.into(), policy: Policy::AtEquilibrium });
            let mut state = problem.minimised(bonds, 1e-3);
            assert!(bonds.sites() > 3 * peri::field::CHUNK && state.fracture.broken > 0);
            state.history.clear();
            state
        })
    };
    for (cloud, threads) in [(false, 3), (true, 2)] {
        assert!(run(threads, cloud) == run(1, cloud), "{threads} threads differ from one, cloud: {cloud}");
    }
}

/// A run from any restartable state has equal bits.
#[test]
#[ignore = "takes 6 to 35 s; .ci/run runs it"]
fn restarts_take_the_same_bits() {
    for (refine, snap_back) in [(1, false), (16, false), (16, true)] {
        let settings = Lbfgs { tolerance: 1e-5, ..Default::default() };
        restarts([40, 30], settings, (refine, snap_back), &|_| true);
    }
}

/// So has one that begins within a search longer than a preconditioner is kept.
#[test]
fn restarts_within_a_long_search() {
    let settings = Lbfgs { tolerance: 1e-9, memory: 2, coarsening: f64::INFINITY, ..Default::default() };
    restarts([24, 18], settings, (1, false), &|state| state.counts.iteration > 0);
}

/// Tears a sheet, and again from restartable states of a kind.
fn restarts(
    counts: [usize; 2],
    settings: Lbfgs,
    (refine, snap_back): (usize, bool),
    kind: &dyn Fn(&State<2>) -> bool,
) {
    // some steps go on from equilibria without a broken bond, and one begins with a new preconditioner
    let factors: Vec<f64> = (1..=12).map(|k| f64::from(k) / 12.0).collect();
    let build = || {
        let (built, end) = damaged(counts);
        let loads =
            hold(&built.lattice, |x| (x[0] < 0.375 || x[0] > end).then(|| (3, [0.6 * x[0], 0.1 * x[0]])));
        (built, loads)
    };
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let breaking = Some(Breaking { criterion: 1.8.into(), policy: Policy::AtEquilibrium });
    let run = |state: &mut State<2>, saved: &mut Vec<State<2>>| {
        let (mut built, loads) = build();
        let mut system = System::new(&mut built.lattice, BondMaterial::new(&*law, MODULUS), &loads, &factors);
        system.breaking.clone_from(&breaking);
        (system.refine, system.snap_back) = (refine, snap_back);
        let mut watch = |status: &peri::solver::Status, state: &State<2>| {
            if status.restartable && kind(state) {
                saved.push(state.clone());
            }
            Ok(())
        };
        settings.solve(&mut system, state, &mut watch, &mut |_, _| Ok(())).unwrap();
    };
    let (built, _) = build();
    let (mut whole, mut saved) = (State::new(built.lattice.sites()), Vec::new());
    run(&mut whole, &mut saved);
    eprintln!("{} broken, {} restartable moments", whole.fracture.broken, saved.len());
    assert!(saved.len() >= 4 && whole.fracture.broken > 0);
    let is_cut = (1..=whole.history.len()).any(|rows| whole.control.prescribed(rows).is_none());
    assert_eq!(is_cut, refine > 1);
    assert_eq!(whole.history.windows(2).any(|rows| rows[1].factor < rows[0].factor), snap_back);
    // a long path restarts from a few places
    let every = saved.len().div_ceil(4);
    for mut state in saved.into_iter().step_by(every) {
        let (step, round, iteration) = (state.step, state.control.round, state.counts.iteration);
        run(&mut state, &mut Vec::new());
        assert!(state == whole, "from step {step}, round {round}, iteration {iteration}");
    }
}

/// Bodies far from a minimum: a buckling strip, floating pieces, a hinge, single particles.
#[test]
fn unstable_and_loose_bodies() {
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    // a slender strip pressed by a fifth, with a nudge: buckles
    let mut strip = Body::<2>::solid([80, 6], 0.125, 3.015).build();
    let loads = hold(&strip.lattice, |x| {
        (x[0] < 0.375 || x[0] > 9.625)
            .then(|| (3, [-0.2 * x[0], 0.0]))
            .or_else(|| ((x[0] - 5.0).abs() < 0.1 && x[1] < 0.1).then_some((2, [0.0, 0.2])))
    });
    let problem = Problem::new(&*law, MODULUS, &loads, &[0.25, 0.5, 0.75, 1.0]);
    let state = problem.minimised(&mut strip.lattice, 1e-6);
    eprintln!(
        "buckling: {} iterations, {} evaluations",
        state.counts.total_iterations, state.counts.evaluations
    );
    assert!(state.counts.evaluations < 3000, "{}", state.counts.evaluations);
    // two halves and a particle by themselves, one half unheld; a hinge of one particle between two blocks
    let block = |x: f64, cells: f64| Operation::Add(Shape::Box { min: [x, 0.0], max: [x + cells, 8.0] });
    let dot = |x: f64| Operation::Add(Shape::Box { min: [x, 4.0], max: [x + 1.0, 5.0] });
    for (name, body, ratio) in [
        ("loose", vec![block(0.0, 20.0), block(26.0, 6.0), dot(38.0)], 3.015),
        ("hinge", vec![block(0.0, 12.0), dot(12.0), block(13.0, 12.0)], 1.0),
    ] {
        let bonds = LatticeBonds::new(lattice(&body, 1.0, 1.0).unwrap(), ratio, VolumeCorrection::None, &[]);
        let mut bonds = bonds.unwrap();
        let loads = hold(&bonds, |x| {
            (x[0] < 3.0 || (x[0] > 17.0 && x[0] < 20.0)).then_some((3, [0.05 * x[0], 0.02 * x[0]]))
        });
        let problem = Problem::new(&*law, 1.0, &loads, &[0.5, 1.0]);
        let state = problem.minimised(&mut bonds, 1e-6);
        eprintln!(
            "{name}: {} iterations, {} evaluations",
            state.counts.total_iterations, state.counts.evaluations
        );
        assert!(state.counts.evaluations < 400, "{name}: {}", state.counts.evaluations);
    }
}

/// Bonds stretched past their largest force, where the energy is not convex, end in an equilibrium.
#[test]
fn past_the_greatest_force() {
    // β e^{−β𝓛(β)/D̂} is greatest at β = 2.25 for D̂ = 2, where λ̄ = 1.53 with n̄ = 2
    let law = Law::ChainOffset.build(2.0, 2.0, true).unwrap();
    assert!(law.tension_derivative(1.4) > 0.0 && law.tension_derivative(1.7) < 0.0);
    let (mut built, end) = damaged([24, 20]);
    let loads = hold(&built.lattice, |x| (x[0] < 0.375 || x[0] > end).then(|| (3, [0.2 * x[0], 0.0])));
    let state = Problem::new(&*law, MODULUS, &loads, &[0.5, 1.0]).minimised(&mut built.lattice, 1e-4);
    let stretch = (1.0 + state.stretches.observed.high).sqrt();
    eprintln!(
        "{} iterations, {} evaluations, stretches to {stretch:.2}",
        state.counts.total_iterations, state.counts.evaluations
    );
    assert!(stretch > 1.6 && state.convergence.residual <= 1e-4, "{stretch} {}", state.convergence.residual);
}

/// Limits as of dynamic relaxation in `limits.rs`: one particle, two, all constrained, a load without
/// support, NaN.
#[test]
fn smallest_bodies_and_errors() {
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let mut one = Body::<3>::solid([1, 1, 1], 0.1, 3.015).build();
    let loads = hold(&one.lattice, |_| Some((1, [0.3, 0.0, 0.0])));
    let state = Problem::new(&*law, 1.0, &loads, &[1.0]).minimised(&mut one.lattice, 1e-3);
    assert_eq!(state.displacement.get(one.on_lattice[0]), [0.3, 0.0, 0.0]);
    // two particles 0.1 apart, one held, the other pulled by b: 2kθ t(λ) V = b
    let mut two = Body::<2>::solid([2, 1], 0.1, 3.015).build();
    let pull = 2.0 * MODULUS * law.tension(1.2) * 0.01;
    for bonds in [&mut two.lattice as &mut dyn Bonds<2>, &mut two.cloud] {
        let mut loads = hold(bonds, |x| (x[0] < 0.1).then_some((3, [0.0; 2])));
        let mut force = Field::zeros(bonds.sites());
        let far = bonds.particles().iter().map(|&s| s as usize).find(|&s| bonds.position(s)[0] > 0.1);
        let far = far.unwrap();
        force.set(far, [pull, 0.0]);
        loads.body_force = Some(force);
        let state = Problem::new(&*law, MODULUS, &loads, &[1.0]).minimised(bonds, 1e-10);
        let u = state.displacement.get(far);
        // tolerance over a tangent of order 1, and the fit's 1e-9
        assert!((u[0] - 0.02).abs() < 1e-9 && u[1].abs() < 1e-12, "{u:?}");
    }
    // all held
    let mut body = Body::<2>::solid([9, 7], 0.125, 3.015).build();
    let loads = hold(&body.lattice, |x| Some((3, [0.1 * x[0], 0.0])));
    let state = Problem::new(&*law, 1.0, &loads, &[0.5, 1.0]).minimised(&mut body.lattice, 1e-12);
    assert_eq!(state.counts.total_iterations, 0);
    // a body force on a particle without bonds has no equilibrium
    let mut one = Body::<2>::solid([1, 1], 0.125, 3.015).build();
    let mut force = Field::zeros(one.lattice.sites());
    force.set(one.on_lattice[0], [1.0, 0.0]);
    let loads = Loads { body_force: Some(force), ..Default::default() };
    let settings = Lbfgs { max_iterations: 50, ..Default::default() };
    let error = Problem::new(&*law, 1.0, &loads, &[1.0])
        .solve(&mut one.lattice, &mut LbfgsSolver::new(settings))
        .err();
    assert!(matches!(error, Some(Error::NoEquilibrium { step: 0, torn: false, .. })), "{error:?}");
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        let mut loads = hold(&body.lattice, |x| (x[0] < 0.375).then_some((3, [0.0; 2])));
        let mut force = Field::zeros(body.lattice.sites());
        force.set(body.on_lattice[31], [0.0, bad]);
        loads.body_force = Some(force);
        let problem = Problem::new(&*law, 1.0, &loads, &[1.0]);
        let error = problem.solve(&mut body.lattice, &mut method(1e-3)).err();
        let Some(Error::NotFinite { particle, position, step: 0, iteration: 0, .. }) = error else {
            panic!("{bad}: {error:?}");
        };
        assert_eq!((particle, &position[..]), (31, &body.points[31][..]), "{bad}");
    }
}

/// Prints residual against force evaluations for both methods; `--nocapture` shows it.
#[test]
fn error_against_work() {
    let mut plate = Plate::new(10e-3);
    let mut rows = Vec::new();
    for exponent in [2, 4, 6, 8, 10] {
        let tolerance = 10_f64.powi(-exponent);
        let problem = Problem::new(&*plate.law, plate.modulus, &plate.loads, &[1.0]);
        let fast = problem.minimised(&mut plate.bonds, tolerance);
        let slow = problem.relaxed(&mut plate.bonds, tolerance);
        eprintln!(
            "residual {tolerance:.0e}: {} and {} force evaluations",
            fast.counts.evaluations, slow.counts.evaluations
        );
        rows.push(fast);
    }
    // every two digits cost about the same
    let best = rows.pop().unwrap();
    assert!(best.counts.evaluations < 60, "{}", best.counts.evaluations);
    let errors: Vec<f64> = rows.iter().map(|state| apart(&plate.bonds, &best, state)).collect();
    assert!(errors.windows(2).all(|pair| pair[1] < 0.1 * pair[0]), "{errors:?}");
}
