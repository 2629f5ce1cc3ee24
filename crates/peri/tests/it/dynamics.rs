//! Velocity Verlet against oscillators, lattice dispersion, conservation laws and the Rayleigh speed.

use crate::bodies::{Body, MODULUS, Random, hold, norm, relax};
use peri::Error;
use peri::bonds::{Bonds, force};
use peri::field::Field;
use peri::potential::{BondPotential, Law};
use peri::solver::{
    AdaptiveDynamicRelaxation, Breaking, Loads, Motion, Policy, State, System, VelocityVerlet,
};
use peri::stress::{BallVolume, Loaded, Measure, piola_on_lattice};
use std::f64::consts::PI;

const DENSITY: f64 = 2.3;

/// Runs to the end without a look at what happens on the way.
fn run<const D: usize>(
    solver: &VelocityVerlet,
    bonds: &mut dyn Bonds<D>,
    law: &dyn BondPotential,
    loads: &Loads<D>,
    state: &mut State<D>,
) -> Result<(), Error> {
    let mut system = System::new(bonds, law, MODULUS, loads, &[]);
    solver.solve(&mut system, state, &mut |_, _| Ok(()), &mut |_, _| Ok(()))
}

fn once(end_time: f64, time_step: f64) -> VelocityVerlet {
    VelocityVerlet { time_step: Some(time_step), records: 1, ..VelocityVerlet::new(DENSITY, end_time) }
}

/// A particle without bonds: no critical step, a straight line, no error.
#[test]
fn one_particle() {
    let law = Law::Subtract.build(720.0, 1200.0, true).unwrap();
    let mut one = Body::<3>::solid([1, 1, 1], 0.1, 3.015).build();
    for bonds in [&mut one.lattice as &mut dyn Bonds<3>, &mut one.cloud] {
        let slot = bonds.particles()[0] as usize;
        let mut state = State::new(bonds.slots());
        state.velocity.set(slot, [0.5, -0.25, 2.0]);
        let solver = VelocityVerlet { records: 4, ..VelocityVerlet::new(DENSITY, 8.0) };
        run(&solver, bonds, &*law, &Loads::default(), &mut state).unwrap();
        assert_eq!(state.displacement.get(slot), [4.0, -2.0, 16.0]);
        assert_eq!(state.total_iterations, 4);
        assert_eq!(state.motion.critical_step, f64::INFINITY);
        // and it falls: u = ½bt²/ρ, which the method integrates without error
        let mut force = Field::zeros(bonds.slots());
        force.set(slot, [0.0, 3.0, 0.0]);
        let loads = Loads { body_force: Some(force), ..Loads::default() };
        let mut state = State::new(bonds.slots());
        run(&once(2.0, 0.125), bonds, &*law, &loads, &mut state).unwrap();
        let fallen = state.displacement.get(slot)[1];
        assert!((fallen / (0.5 * 3.0 * 4.0 / DENSITY) - 1.0).abs() < 1e-14, "{fallen}");
        let last = &state.history[0];
        assert!((last.work / last.kinetic - 1.0).abs() < 1e-13, "{} {}", last.work, last.kinetic);
    }
}

/// Two particles on a linear bond: ω² = 12kθV/(ρ|ξ|); the method's own oscillation is cos(2n asin(ωΔt/2)).
#[test]
fn two_particles() {
    let law = Law::Pmb.build(1.0, 1.0, false).unwrap();
    let mut two = Body::<2>::solid([2, 1], 0.1, 3.015).build();
    let omega = (12.0 * MODULUS * 0.01 / (DENSITY * 0.1)).sqrt();
    for bonds in [&mut two.lattice as &mut dyn Bonds<2>, &mut two.cloud] {
        let start = |bonds: &dyn Bonds<2>| {
            let mut state = State::new(bonds.slots());
            for &slot in bonds.particles() {
                let right = bonds.position(slot as usize)[0] > 0.1;
                state.velocity.set(slot as usize, [if right { 0.01 } else { -0.01 }, 0.0]);
            }
            state
        };
        let far = bonds.particles().iter().map(|&s| s as usize).find(|&s| bonds.position(s)[0] > 0.1);
        let far = far.unwrap();
        let period = 2.0 * PI / omega;
        let mut errors = Vec::new();
        for steps in [20.0, 40.0, 80.0, 160.0] {
            let mut state = start(bonds);
            let step = period / steps;
            run(&once(period, step), bonds, &*law, &Loads::default(), &mut state).unwrap();
            assert_eq!(state.total_iterations, steps as u64);
            // the sharp critical step is that of the oscillator; differences of forces give it to 1e-9
            assert!((state.motion.critical_step * omega / 2.0 - 1.0).abs() < 1e-8);
            // and Gershgorin's theorem is sharp here, but for what the law's slope changes within the stretches covered
            assert!((state.motion.gershgorin_step / state.motion.critical_step - 1.0).abs() < 1e-8);
            // u = v₀/(ω√(1 − ω²Δt²/4)) sin(2n asin(ωΔt/2)); the fitted bond law is good to 1e-9
            let theta = 2.0 * (0.5 * omega * step).asin();
            let exact = 0.01 * step / theta.sin() * (steps * theta).sin();
            let found = state.displacement.get(far)[0];
            assert!((found - exact).abs() < 1e-8 * 0.01 / omega, "{steps}: {found} {exact}");
            errors.push((found * omega / 0.01).abs());
        }
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            eprintln!("two particles: error {:.2e} of the amplitude, order {order:.3}", pair[1]);
            // the error's next term is about two percent of it at 20 steps
            assert!((order - 2.0).abs() < 0.05, "order {order}");
        }
    }
}

/// Steps beyond the critical one are refused by name, with the exit code of bad input.
#[test]
fn steps_beyond_the_critical_are_refused() {
    let law = Law::Subtract.build(720.0, 1200.0, true).unwrap();
    let mut built = Body::<2>::damaged([24, 20], 0.1, 3.015).build();
    let bonds = &mut built.lattice;
    let mut state = State::new(bonds.slots());
    let solver = VelocityVerlet { records: 1, ..VelocityVerlet::new(DENSITY, 1e-3) };
    run(&solver, bonds, &*law, &Loads::default(), &mut state).unwrap();
    let Motion { critical_step, gershgorin_step, covered_step, .. } = state.motion;
    eprintln!(
        "critical step {critical_step:.4e}, all stretches {covered_step:.4e}, Gershgorin {gershgorin_step:.4e} s, {} forces",
        state.evaluations
    );
    assert!(gershgorin_step <= covered_step && covered_step <= critical_step);
    for factor in [1.05, 3.0] {
        let mut state = State::new(bonds.slots());
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
        let mut state = State::new(bonds.slots());
        let error = run(&solver, bonds, &*law, &Loads::default(), &mut state);
        assert!(matches!(error, Err(Error::Parameter { .. })), "{solver:?}");
    }
    let mut state = State::new(bonds.slots());
    state.velocity.set(bonds.particles()[3] as usize, [f64::NAN, 0.0]);
    let error = run(&once(1.0, 1e-3), bonds, &*law, &Loads::default(), &mut state).unwrap_err();
    assert!(matches!(error, Error::NotFinite { quantity: "velocity", .. }), "{error}");
}

/// Kinetic + stored + released + damped = work, with ramps, supports, body forces, damping and breaking bonds; the error
/// falls as Δt² where no bond breaks.
#[test]
fn energies_balance() {
    let law = Law::Subtract.build(100.0, 1200.0, true).unwrap();
    let body = Body::<2>::damaged([24, 20], 0.1, 3.015);
    let critical = {
        let mut built = body.build();
        let mut state = State::new(built.lattice.slots());
        let solver = VelocityVerlet { records: 1, ..VelocityVerlet::new(DENSITY, 1e-9) };
        run(&solver, &mut built.lattice, &*law, &Loads::default(), &mut state).unwrap();
        state.motion.critical_step
    };
    let balance = |part: f64, breaking: Option<f64>, damping: f64| {
        let mut built = body.build();
        let bonds = &mut built.lattice;
        let mut loads = hold(bonds, |x| {
            (x[0] < 0.3 || x[0] > 2.1).then(|| (3, if x[0] < 0.3 { [0.0; 2] } else { [0.25, 0.05] }))
        });
        let mut force = Field::zeros(bonds.slots());
        for &slot in bonds.particles() {
            force.set(slot as usize, [0.0, -0.01]);
        }
        loads.body_force = Some(force);
        let end = 200.0 * critical;
        let solver = VelocityVerlet {
            time_step: Some(part * critical),
            damping,
            ramp: 0.5 * end,
            records: 50,
            ..VelocityVerlet::new(DENSITY, end)
        };
        let mut state = State::new(bonds.slots());
        let mut system = System::new(bonds, &*law, MODULUS, &loads, &[]);
        let policy = peri::solver::Policy::EachIteration;
        system.breaking = breaking.map(|stretch| peri::solver::Breaking { stretch, policy });
        solver.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap();
        assert_eq!(state.history.len(), 50);
        let last = state.history.last().unwrap();
        assert_eq!((last.time, last.factor), (end, 1.0));
        let scale = state.history.iter().map(|r| r.work.abs()).fold(0.0, f64::max);
        let error = |r: &peri::solver::Record| r.kinetic + r.stored + r.released + r.damped - r.work;
        let worst = state.history.iter().map(|r| error(r).abs()).fold(0.0, f64::max) / scale;
        eprintln!(
            "step {part} of critical, damping {damping}, {} broken: work {:.3e}, kinetic {:.3e}, stored {:.3e}, \
             released {:.3e}, damped {:.3e} J; off by {worst:.1e}",
            last.broken, last.work, last.kinetic, last.stored, last.released, last.damped
        );
        (worst, state)
    };
    for damping in [0.0, 0.02 / critical] {
        let errors: Vec<f64> = [0.4, 0.2, 0.1].map(|part| balance(part, None, damping).0).into();
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((order - 2.0).abs() < 0.3, "order {order}");
        }
        assert!(errors[0] < 1e-2, "{errors:?}");
    }
    for (part, most) in [(0.9, 0.03), (0.45, 0.01)] {
        let (worst, state) = balance(part, Some(1.2), 0.0);
        assert!(state.broken > 50, "{} broken", state.broken);
        assert!(worst < most, "{worst}");
    }
}

/// Conserved quantities of a state: momentum, angular momentum about the origin (xy), energies.
struct Conserved {
    momentum: [f64; 2],
    spin: f64,
    /// ½ρ(v² − ¼Δt²a²): with the stored energy, what the method conserves exactly where forces are linear.
    kinetic: f64,
}

fn conserved(bonds: &dyn Bonds<2>, state: &State<2>) -> Conserved {
    let mut sum = Conserved { momentum: [0.0; 2], spin: 0.0, kinetic: 0.0 };
    for &slot in bonds.particles() {
        let slot = slot as usize;
        let (mass, x) = (DENSITY * bonds.volume(slot), bonds.position(slot));
        let (u, v, f) = (state.displacement.get(slot), state.velocity.get(slot), state.force.get(slot));
        for d in 0..2 {
            sum.momentum[d] += mass * v[d];
            let half = 0.5 * state.motion.time_step * f[d] / DENSITY;
            sum.kinetic += 0.5 * mass * (v[d] * v[d] - half * half);
        }
        sum.spin += mass * ((x[0] + u[0]) * v[1] - (x[1] + u[1]) * v[0]);
    }
    sum
}

/// Random velocities without momentum that strain bonds by about `strain`.
fn shake(bonds: &dyn Bonds<2>, strain: f64, state: &mut State<2>) {
    let particles = bonds.particles();
    // at the frequency √(kθ…) of a bond the amplitude v/ω is strain·spacing
    let omega = 2.0 / 0.234;
    let values = Random(5).vectors::<2>(particles.len(), strain * bonds.spacing() * omega);
    let mean = |d: usize| values.iter().map(|v| v[d]).sum::<f64>() / values.len() as f64;
    let mean = [mean(0), mean(1)];
    for (&slot, v) in particles.iter().zip(&values) {
        state.velocity.set(slot as usize, [v[0] - mean[0], v[1] - mean[1]]);
    }
}

/// 1e5 steps of a small body that is shaken: no drift of the energy, momentum or spin.
#[test]
fn energy_does_not_drift() {
    let law = Law::Subtract.build(100.0, 1200.0, true).unwrap();
    let mut built = Body::<2>::solid([7, 6], 0.1, 3.015).build();
    let bonds = &mut built.lattice;
    let run = |bonds: &mut dyn Bonds<2>, part: f64, steps: f64, strain: f64| {
        let mut state = State::new(bonds.slots());
        shake(bonds, strain, &mut state);
        let loads = Loads::default();
        let mut system = System::new(bonds, &*law, MODULUS, &loads, &[]);
        let step = part * 0.234;
        let solver = VelocityVerlet {
            records: 1000,
            time_step: Some(step),
            ..VelocityVerlet::new(DENSITY, steps * step)
        };
        let start = conserved(&*system.bonds, &state);
        let (mut method, mut plain) = (Vec::new(), Vec::new());
        solver
            .solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |bonds, state| {
                let row = state.history.last().unwrap();
                method.push(conserved(bonds, state).kinetic + row.stored);
                plain.push(row.kinetic + row.stored);
                Ok(())
            })
            .unwrap();
        let end = conserved(&*system.bonds, &state);
        let size = DENSITY * 0.42 * (2.0 * state.motion.kinetic / (DENSITY * 0.42)).sqrt();
        let moved = norm([end.momentum[0] - start.momentum[0], end.momentum[1] - start.momentum[1]]) / size;
        let turned = (end.spin - start.spin).abs() / (0.5 * size);
        eprintln!(
            "{} steps of {part} critical: momentum {moved:.1e}, spin {turned:.1e}",
            state.total_iterations
        );
        // rounding of 1e5 steps adds up as their root, and not more than their number
        assert!(moved < 1e-11 && turned < 1e-11);
        (method, plain, state.work)
    };
    let (method, plain, work) = run(bonds, 0.1, 1e5, 1e-3);
    // larger strains let it wander, without a trend, by O(Δt²·strain): 1.5e-5 at 0.02. Slope of the line of least squares
    // times the duration
    let drift = |values: &[f64]| {
        let (count, mean) = (values.len() as f64, values.iter().sum::<f64>() / values.len() as f64);
        let middle = 0.5 * (count - 1.0);
        let top: f64 = values.iter().enumerate().map(|(k, y)| (k as f64 - middle) * (y - mean)).sum();
        top / (count * (count * count - 1.0) / 12.0) * count / work
    };
    eprintln!("drift {:.1e} (kinetic energy of whole steps: {:.1e})", drift(&method), drift(&plain));
    assert!(drift(&method).abs() < 1e-6);
    let error = |part: f64| {
        let (method, plain, work) = run(bonds, part, 400.0 / part, 0.02);
        let worst = |values: &[f64]| values.iter().map(|e| (e - work).abs()).fold(0.0, f64::max) / work;
        (worst(&method), worst(&plain))
    };
    let errors = [0.4, 0.2, 0.1, 0.05].map(error);
    for pair in errors.windows(2) {
        let orders = [(pair[0].0 / pair[1].0).log2(), (pair[0].1 / pair[1].1).log2()];
        eprintln!("energy error {:.2e}, {:.2e}: orders {orders:.2?}", pair[1].0, pair[1].1);
        assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.3), "{orders:?}");
    }
}

/// ω² = (12kθV/ρ) Σ_k (1 − cos qkΔx)/(kΔx), k = 1 … m: linear bonds along a row of particles, of any amplitude.
fn chain_frequency(q: f64, spacing: f64, volume: f64) -> f64 {
    let each = |k: i32| (1.0 - (q * f64::from(k) * spacing).cos()) / (f64::from(k) * spacing);
    (12.0 * MODULUS * volume / DENSITY * (1..=3).map(each).sum::<f64>()).sqrt()
}

/// A Gaussian at rest in the middle of a long row splits in two: against the lattice's own dispersion for all wave numbers
/// at once, and against d'Alembert's solution with the chain's modulus.
#[test]
fn waves_in_a_chain() {
    let law = Law::Pmb.build(1.0, 1.0, false).unwrap();
    let width = 0.1;
    // kθ is kept for each spacing: the speed √(36kθVΔx/ρ) belongs to it
    let run = |count: usize, spacing: f64, part: f64| {
        let mut built = Body::<2>::solid([count, 1], spacing, 3.015).build();
        let bonds = &mut built.lattice;
        let volume = bonds.volume(bonds.particles()[0] as usize);
        let speed = (36.0 * MODULUS * volume * spacing / DENSITY).sqrt();
        let centre = 0.5 * spacing * count as f64;
        let pulse = |x: f64| 1e-3 * (-(x / width).powi(2)).exp();
        let places: Vec<f64> =
            bonds.particles().iter().map(|&s| bonds.position(s as usize)[0] - centre).collect();
        let mut state = State::new(bonds.slots());
        for (&slot, &x) in bonds.particles().iter().zip(&places) {
            state.displacement.set(slot as usize, [pulse(x), 0.0]);
        }
        let time = 0.5 / speed;
        let fastest =
            chain_frequency(PI / spacing, spacing, volume).max(chain_frequency(2.0, spacing, volume));
        let solver = once(time, part * 2.0 / fastest * 0.8);
        crate::dynamics::run(&solver, bonds, &*law, &Loads::default(), &mut state).unwrap();
        let found: Vec<f64> =
            bonds.particles().iter().map(|&s| state.displacement.get(s as usize)[0]).collect();
        // periodic waves of the row's length; what comes back from the ends is below 1e-16
        let length = spacing * count as f64;
        let exact = |x: f64| {
            let wave = |k: usize| {
                let q = 2.0 * PI * k as f64 / length;
                let amplitude = PI.sqrt() * width / length * (-(0.5 * q * width).powi(2)).exp();
                let both = if k == 0 { 1.0 } else { 2.0 };
                1e-3 * both * amplitude * (q * x).cos() * (chain_frequency(q, spacing, volume) * time).cos()
            };
            (0..count / 2).map(wave).sum::<f64>()
        };
        let largest = |reference: &dyn Fn(f64) -> f64| {
            let errors = places.iter().zip(&found).map(|(&x, u)| (u - reference(x)).abs());
            errors.fold(0.0, f64::max) / 0.5e-3
        };
        let continuum = |x: f64| 0.5 * (pulse(x - speed * time) + pulse(x + speed * time));
        (largest(&exact), largest(&continuum), state.motion.critical_step * fastest / 2.0)
    };
    let errors = [1.0, 0.5, 0.25].map(|part| run(200, 0.0125, part).0);
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        eprintln!(
            "chain against its dispersion: {:.2e} of the pulse, order {order:.2} in the time step",
            pair[1]
        );
        assert!((order - 2.0).abs() < 0.05, "order {order}");
    }
    let errors = [(200, 0.0125), (400, 0.00625), (800, 0.003125)].map(|(n, spacing)| run(n, spacing, 0.25));
    for pair in errors.windows(2) {
        let order = (pair[0].1 / pair[1].1).log2();
        eprintln!(
            "chain against d'Alembert: {:.2e} of the pulse, order {order:.2} in the spacing",
            pair[1].1
        );
        assert!(pair[1].1 > 5.0 * pair[1].0);
        assert!((order - 2.0).abs() < 0.2, "order {order}");
    }
    eprintln!("critical steps: {:?}", errors.map(|e| e.2));
}

/// A thin bar in plane stress: the wave runs with √(E/ρ), E the static modulus of the same bar, and with the material's E
/// but for the bonds that its surfaces lack.
#[test]
fn wave_in_a_thin_bar() {
    let law = Law::Pmb.build(1.0, 1.0, false).unwrap();
    let height = 0.1;
    let mut speeds = Vec::new();
    for rows in [4_usize, 8, 16] {
        let spacing = height / rows as f64;
        let youngs = MODULUS * 2.0 * PI * (3.015 * spacing).powi(3) / 3.0;
        let bar = |columns: usize| Body::<2>::solid([columns, rows], spacing, 3.015).build().lattice;
        // the static modulus from the stretch of a gauge length between held ends
        let mut short = bar(8 * rows);
        let end = 0.8 - 3.0 * spacing;
        let loads = hold(&short, |x| (x[0] < 3.0 * spacing || x[0] > end).then(|| (1, [1e-4 * x[0], 0.0])));
        let mut state = State::new(short.slots());
        let solver = AdaptiveDynamicRelaxation { tolerance: 1e-8, ..Default::default() };
        relax(&solver, &mut short, (&*law, MODULUS), &loads, &[1.0], &mut state).unwrap();
        let volume = short.volume(short.particles()[0] as usize);
        let mut mean = [[0.0, 0.0]; 2];
        let mut pull = 0.0;
        for &slot in short.particles() {
            let (slot, x) = (slot as usize, short.position(slot as usize)[0]);
            let u = state.displacement.get(slot)[0];
            for (side, at) in [0.25, 0.55].into_iter().enumerate() {
                if (x - at).abs() < 1.01 * spacing {
                    mean[side] = [mean[side][0] + u, mean[side][1] + 1.0];
                }
            }
            if x > end {
                pull -= state.force.get(slot)[0] * volume;
            }
        }
        let strain = (mean[1][0] / mean[1][1] - mean[0][0] / mean[0][1]) / 0.3;
        let modulus = pull / (height * strain);

        // a pulse of eight heights, released at rest in the middle; its right half after a flight of 20 heights
        let mut long = bar(80 * rows);
        let width = 8.0 * height;
        let mut state = State::new(long.slots());
        for &slot in long.particles() {
            let x = long.position(slot as usize)[0] - 4.0;
            state.displacement.set(slot as usize, [1e-5 * (-(x / width).powi(2)).exp(), 0.0]);
        }
        let speed = (modulus / DENSITY).sqrt();
        let time = 2.0 / speed;
        let solver = VelocityVerlet { safety: 0.5, records: 1, ..VelocityVerlet::new(DENSITY, time) };
        run(&solver, &mut long, &*law, &Loads::default(), &mut state).unwrap();
        // first moment of the strain energy's root |u′|: rather of u² on the right, whose centre is the pulse's
        let (mut top, mut bottom) = (0.0, 0.0);
        for &slot in long.particles() {
            let x = long.position(slot as usize)[0] - 4.0;
            if x > 0.0 {
                let u = state.displacement.get(slot as usize)[0];
                top += x * u * u;
                bottom += u * u;
            }
        }
        let found = top / bottom / time;
        let (own, material) = (found / speed - 1.0, found / (youngs / DENSITY).sqrt() - 1.0);
        eprintln!(
            "{rows} rows: static modulus {:.4} E, speed {:.5} of its own, {:.4} of √(E/ρ), {} steps",
            modulus / youngs,
            1.0 + own,
            1.0 + material,
            state.total_iterations
        );
        // bars are dispersive by (νqh)²/24: 1e-4 for this pulse; sampling and the particles' grips the rest
        assert!(own.abs() < 1.5e-3, "{own}");
        speeds.push(1.0 + material);
    }
    // the bonds that surfaces lack are a part δ/h: first order; what is left is the lattice's E₁₀₀ = 1.0486 E of
    // formulation.md, √ of it
    let order = ((speeds[1] - speeds[0]) / (speeds[2] - speeds[1])).log2();
    let limit = speeds[2] + (speeds[2] - speeds[1]) / (order.exp2() - 1.0);
    eprintln!("order {order:.2} in the spacing, limit {limit:.4} of √(E/ρ)");
    assert!((order - 1.0).abs() < 0.15, "order {order}");
    assert!((limit / 1.0486_f64.sqrt() - 1.0).abs() < 2e-3, "{limit}");
}

/// A body turned by 90° in steps of 1° bears no force and no stress; one that spins keeps energy, momentum and spin.
#[test]
fn rigid_rotation() {
    let law = Law::Subtract.build(100.0, 1200.0, true).unwrap();
    let mut built = Body::<2>::damaged([24, 20], 0.1, 3.015).build();
    let bonds = &mut built.lattice;
    let fit = crate::bodies::fit(&*law, [0.95, 1.05]);
    bonds.set_law(&fit, MODULUS);
    let mut out = Field::zeros(bonds.slots());
    // force of a particle with 28 bonds strained by one, and Young's modulus
    let stiffness = 28.0 * 2.0 * MODULUS * law.tangent() * 0.01;
    let youngs = MODULUS * 2.0 * PI * 0.3015_f64.powi(3) / 3.0;
    let (mut largest, mut stress) = (0.0_f64, 0.0_f64);
    for degree in 0..=90 {
        let (sine, cosine) = f64::from(degree).to_radians().sin_cos();
        let mut u = Field::zeros(bonds.slots());
        for &slot in bonds.particles() {
            let [x, y] = bonds.position(slot as usize);
            u.set(slot as usize, [cosine * x - sine * y - x, sine * x + cosine * y - y]);
        }
        force(bonds, &u, &mut out);
        let each = bonds.particles().iter().map(|&s| norm(out.get(s as usize)));
        largest = largest.max(each.fold(0.0, f64::max) / stiffness);
        let loaded = Loaded { displacement: &u, fit: &fit, modulus: MODULUS };
        for measure in [Measure::Hardy, Measure::OnePoint] {
            let piola = piola_on_lattice(bonds, &loaded, measure, BallVolume::Particles);
            let each = piola.iter().flatten().flatten().map(|p| p.abs());
            stress = stress.max(each.fold(0.0, f64::max) / youngs);
        }
    }
    eprintln!(
        "90 rotations: largest force {largest:.1e} of a particle's stiffness, largest stress {stress:.1e} E"
    );
    // displacements of 3 m are rounded to 4e-16 m, strains of bonds of 0.1 m to about 1e-14
    assert!(largest < 1e-13 && stress < 1e-13);

    // spinning at a tenth of its first frequency or so: 20 turns of 1°-steps' size
    let mut state = State::new(bonds.slots());
    let rate = 0.02;
    for &slot in bonds.particles() {
        let [x, y] = bonds.position(slot as usize);
        state.velocity.set(slot as usize, [-rate * (y - 1.0) + 0.3, rate * (x - 1.2) - 0.1]);
    }
    let start = conserved(bonds, &state);
    let solver = VelocityVerlet { records: 360, ..VelocityVerlet::new(DENSITY, 2.0 * PI / rate) };
    run(&solver, bonds, &*law, &Loads::default(), &mut state).unwrap();
    let end = conserved(bonds, &state);
    let moved = (0..2).map(|d| (end.momentum[d] / start.momentum[d] - 1.0).abs()).fold(0.0, f64::max);
    let turned = (end.spin / start.spin - 1.0).abs();
    let energy =
        state.history.iter().map(|r| ((r.kinetic + r.stored) / r.work - 1.0).abs()).fold(0.0, f64::max);
    eprintln!(
        "one free turn in {} steps: momentum {moved:.1e}, spin {turned:.1e}, energy {energy:.1e}, stretch {:.5}",
        state.total_iterations,
        state.history.last().unwrap().largest_stretch
    );
    assert!(moved < 1e-12 && turned < 1e-12 && energy < 1e-5);
}

/// A block of the `chain` law, which stiffens without bound, crushed between its ends: at a fixed step just below what is
/// critical at rest the growth is named before anything is infinite; the automatic step follows the stiffening.
#[test]
fn stiffening_beyond_the_step_is_named() {
    let law = Law::Chain.build(100.0, 1200.0, true).unwrap();
    let crush = |time_step: Option<f64>, part: f64| {
        let mut built = Body::<2>::solid([16, 8], 0.1, 3.015).build();
        let bonds = &mut built.lattice;
        let loads = hold(bonds, |x| (x[0] < 0.3 || x[0] > 1.3).then(|| (3, [-part * x[0], 0.0])));
        let mut state = State::new(bonds.slots());
        let solver =
            VelocityVerlet { time_step, ramp: 60.0, records: 10, ..VelocityVerlet::new(DENSITY, 60.0) };
        let result = run(&solver, bonds, &*law, &loads, &mut state);
        (result, state)
    };
    let (result, state) = crush(None, 0.5);
    result.unwrap();
    let (first, last) = (state.motion.critical_step, state.motion.time_step);
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
        assert!(time > 0.0 && time < 60.0 && step == state.total_iterations);
        assert!(kinetic > available && kinetic.is_finite());
        assert!(time_step > critical, "{time_step} {critical}");
        assert!(state.displacement.non_finite().is_none() && state.velocity.non_finite().is_none());
    }
}

/// A notched sheet torn apart; `pause` interrupts after so many steps.
fn tear(cloud: bool, pause: Option<u64>) -> State<2> {
    let law = Law::Subtract.build(720.0, 1200.0, true).unwrap();
    // four work items, so that threads have something to mix up
    let build = || Body::<2>::damaged([120, 115], 0.1, 3.015).build();
    let solver =
        VelocityVerlet { damping: 0.1, ramp: 10.0, records: 3, ..VelocityVerlet::new(DENSITY, 16.0) };
    let mut state = None;
    for pause in [pause, None] {
        let mut built = build();
        let bonds: &mut dyn Bonds<2> = if cloud { &mut built.cloud } else { &mut built.lattice };
        let loads = hold(bonds, |x| (x[0] < 0.3 || x[0] > 11.7).then(|| (3, [0.1 * x[0], 0.05 * x[0]])));
        let state = state.get_or_insert_with(|| State::new(bonds.slots()));
        let mut system = System::new(bonds, &*law, 1.0, &loads, &[]);
        system.breaking = Some(Breaking { stretch: 1.1, policy: Policy::EachIteration });
        let mut watch = |status: &peri::solver::Status, state: &State<2>| {
            assert!(status.restartable);
            let stop = pause.is_some_and(|steps| state.total_iterations == steps);
            if stop { Err(Error::Interrupted("here".into())) } else { Ok(()) }
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
        eprintln!("{} steps, {} broken, {} forces", one.total_iterations, one.broken, one.evaluations);
        assert!(one.broken > 100 && one.total_iterations > 50, "{} broken", one.broken);
        for threads in [2, 3] {
            assert!(run(threads, None) == one, "{threads} threads differ from one, cloud: {cloud}");
        }
        for pause in [1, 17, one.total_iterations] {
            let again = run(1, Some(pause));
            assert!(again.displacement == one.displacement && again.history == one.history, "{pause}");
            assert!(again.velocity == one.velocity && again.motion == one.motion, "{pause}");
        }
    }
}
