//! Critical time step, larger steps, and equal bits on any threads and after any restart.

use crate::bodies::{Body, hold};
use crate::dynamics::{DENSITY, once, run};
use harness::case::Fault;
use peri::Error;
use peri::bonds::{BodyGeometry, Bonds};
use peri::material::BondMaterial;
use peri::potential::Law;
use peri::solver::{Breaking, Loads, Method, Policy, State, StepLimits, System, VelocityVerlet};

/// Steps beyond the critical one are refused with the exit code of bad input.
#[test]
fn steps_beyond_the_critical_are_refused() {
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let mut built = Body::<2>::damaged([24, 20], 0.1, 3.015).build();
    let bonds = &mut built.lattice;
    let mut state = State::new(bonds.sites());
    let solver = VelocityVerlet { records: 1, ..VelocityVerlet::new(DENSITY, 1e-3) };
    run(&solver, bonds, &*law, &Loads::default(), &mut state).unwrap();
    let StepLimits { critical_step, gershgorin_step, covered_step, .. } = state.motion.limits;
    eprintln!(
        "critical step {critical_step:.4e}, all stretches {covered_step:.4e}, Gershgorin \
         {gershgorin_step:.4e} s, {} forces",
        state.counts.evaluations
    );
    assert!(gershgorin_step <= covered_step && covered_step <= critical_step);
    for factor in [1.05, 3.0] {
        let mut state = State::new(bonds.sites());
        let solver = once(1.0, factor * critical_step);
        let error = run(&solver, bonds, &*law, &Loads::default(), &mut state).unwrap_err();
        let Error::TimeStep { found, critical } = error else { panic!("{error}") };
        assert_eq!((found, critical, error.exit_code()), (factor * critical_step, critical_step, 2));
    }
    for solver in [
        once(1.0, f64::NAN),
        once(1.0, 0.0),
        once(f64::INFINITY, 1e-3),
        VelocityVerlet { safety: 1.5, ..once(1.0, 1e-3) },
        VelocityVerlet { density: -1.0, ..once(1.0, 1e-3) },
        VelocityVerlet { damping: f64::NAN, ..once(1.0, 1e-3) },
        VelocityVerlet { records: 0, ..once(1.0, 1e-3) },
    ] {
        let mut state = State::new(bonds.sites());
        let error = run(&solver, bonds, &*law, &Loads::default(), &mut state);
        assert!(matches!(error, Err(Error::Parameter { .. })), "{solver:?}");
    }
    let mut state = State::new(bonds.sites());
    state.velocity.set(bonds.particles()[3] as usize, [f64::NAN, 0.0]);
    let error = run(&once(1.0, 1e-3), bonds, &*law, &Loads::default(), &mut state).unwrap_err();
    assert!(matches!(error, Error::NotFinite { quantity: "velocity", .. }), "{error}");
}

/// A block of the `chain-affine` law, which stiffens without bound, crushed between its ends: a fixed step
/// just below the critical one at rest is reported as unstable before any value is infinite; the automatic
/// step follows the stiffening.
#[test]
fn stiffening_beyond_the_step_is_named() {
    let law = Law::ChainAffine.build(100.0, 1200.0, true).unwrap();
    let crush = |time_step: Option<f64>, part: f64| {
        let mut built = Body::<2>::solid([16, 8], 0.1, 3.015).build();
        let bonds = &mut built.lattice;
        let loads = hold(bonds, |x| (x[0] < 0.3 || x[0] > 1.3).then(|| (3, [-part * x[0], 0.0])));
        let mut state = State::new(bonds.sites());
        let solver =
            VelocityVerlet { time_step, ramp: 60.0, records: 10, ..VelocityVerlet::new(DENSITY, 60.0) };
        let result = run(&solver, bonds, &*law, &loads, &mut state);
        (result, state)
    };
    let (result, state) = crush(None, 0.5);
    result.unwrap();
    let (first, last) = (state.motion.limits.critical_step, state.motion.steps.time_step);
    let row = state.history.last().unwrap();
    let off = (row.kinetic + row.stored - row.work) / row.work;
    eprintln!(
        "automatic: critical {first:.4} s at rest, step {last:.4} s at the end, energies off by {off:.1e}"
    );
    assert!(last < 0.6 * first && off.abs() < 0.01);
    for factor in [0.99, 0.9] {
        let (result, state) = crush(Some(factor * first), 0.5);
        let error = result.unwrap_err();
        eprintln!("{factor}: {error}");
        assert_eq!(error.exit_code(), 1);
        let Error::Unstable { time, step, kinetic, available, time_step, critical } = error else {
            panic!("{error}")
        };
        assert!(time > 0.0 && time < 60.0 && step == state.counts.total_iterations);
        assert!(kinetic > available && kinetic.is_finite());
        assert!(time_step > critical, "{time_step} {critical}");
        assert!(state.displacement.non_finite().is_none() && state.velocity.non_finite().is_none());
    }
}

/// Tears a notched sheet; `pause` interrupts after a number of steps.
fn tear(cloud: bool, pause: Option<u64>) -> State<2> {
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    // four work items, so that threads have something to mix up
    let build = || Body::<2>::damaged([120, 115], 0.1, 3.015).build();
    let solver =
        VelocityVerlet { damping: 0.1, ramp: 10.0, records: 3, ..VelocityVerlet::new(DENSITY, 16.0) };
    let mut state = None;
    for pause in [pause, None] {
        let mut built = build();
        let bonds: &mut dyn Bonds<2> = if cloud { &mut built.cloud } else { &mut built.lattice };
        let loads = hold(bonds, |x| (x[0] < 0.3 || x[0] > 11.7).then(|| (3, [0.1 * x[0], 0.05 * x[0]])));
        let state = state.get_or_insert_with(|| State::new(bonds.sites()));
        let mut system = System::new(bonds, BondMaterial::new(&*law, 1.0), &loads, &[]);
        system.breaking = Some(Breaking { criterion: 1.1.into(), policy: Policy::EachIteration });
        let mut watch = |status: &peri::solver::Status, state: &State<2>| {
            assert!(status.restartable);
            let stop = pause.is_some_and(|steps| state.counts.total_iterations == steps);
            if stop {
                Err(polycore::Error::Interrupted { program: "peri", output: "here".into() }.into())
            } else {
                Ok(())
            }
        };
        let result = solver.solve(&mut system, state, &mut watch, &mut |_, _| Ok(()));
        assert_eq!(result.is_err(), pause.is_some());
        if pause.is_none() {
            break;
        }
        // through the checkpoint's own format
        *state = postcard::from_bytes(&postcard::to_stdvec(state).unwrap()).unwrap();
    }
    state.unwrap()
}

#[test]
fn bits_do_not_depend_on_threads_or_restarts() {
    for cloud in [false, true] {
        let run = |threads: usize, pause: Option<u64>| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| tear(cloud, pause))
        };
        let one = run(1, None);
        eprintln!(
            "{} steps, {} broken, {} forces",
            one.counts.total_iterations, one.fracture.broken, one.counts.evaluations
        );
        assert!(
            one.fracture.broken > 100 && one.counts.total_iterations > 50,
            "{} broken",
            one.fracture.broken
        );
        for threads in [2, 3] {
            assert!(run(threads, None) == one, "{threads} threads differ from one, cloud: {cloud}");
        }
        for pause in [1, 17, one.counts.total_iterations] {
            let again = run(1, Some(pause));
            assert!(again.displacement == one.displacement && again.history == one.history, "{pause}");
            assert!(again.velocity == one.velocity && again.motion == one.motion, "{pause}");
        }
    }
}
