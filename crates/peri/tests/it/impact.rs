//! Impact of bodies by velocity Verlet: the closed form of two particles, momentum, energy, Newton's cradle.

use crate::bodies::{Body, MODULUS, Slit, hold};
use crate::dynamics::DENSITY;
use peri::Error;
use peri::bonds::{BodyGeometry, Bonds, CloudBonds, VolumeCorrection};
use peri::contact::{Contact, SHORT_RANGE};
use peri::material::BondMaterial;
use peri::potential::Law;
use peri::solver::{Loads, Method, State, System, VelocityVerlet};
use std::f64::consts::PI;

/// Runs linear bonds with contact of stiffness κ.
fn run(
    solver: &VelocityVerlet,
    bonds: &mut dyn Bonds<2>,
    loads: &Loads<2>,
    kappa: f64,
    state: &mut State<2>,
) -> Result<(), Error> {
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let contact = Contact::short_range(bonds, MODULUS, kappa)?;
    let mut system = System::new(bonds, BondMaterial::new(&*law, MODULUS), loads, &[]);
    system.contact = Some(contact);
    solver.solve(&mut system, state, &mut |_, _| Ok(()), &mut |_, _| Ok(()))
}

/// The distance of two touching particles without a bond swings with ω² = κ(c/δ)(V₁ + V₂)/ρ about d for half
/// a period. Then each has the velocity 2v_m − v, with v_m of their centre.
#[test]
fn two_particles_rebound() {
    let (volumes, horizon) = ([1.0, 0.64], 1.5);
    let points = [[0.0, 0.0], [2.0, 0.0]];
    let stiffness = SHORT_RANGE * 6.0 * MODULUS / horizon;
    let omega = (stiffness * (volumes[0] + volumes[1]) / DENSITY).sqrt();
    let before = [0.3, -0.9];
    let centre = (before[0] * volumes[0] + before[1] * volumes[1]) / (volumes[0] + volumes[1]);
    let mut errors = Vec::new();
    // half a step more: where a whole number of steps fits into the contact, its two ends cancel
    for steps in [16.5, 32.5, 64.5, 128.5] {
        let step = PI / omega / steps;
        let mut sum = 0.0;
        // the error depends on where in a step they meet
        for phase in 0..8 {
            let mut cloud =
                CloudBonds::new(&points, &volumes, 1.0, horizon, VolumeCorrection::None, &[]).unwrap();
            let sites = [0, 1].map(|p| cloud.input_order().iter().position(|&i| i == p).unwrap());
            let mut state = State::new(cloud.sites());
            for (site, v) in sites.into_iter().zip(before) {
                state.velocity.set(site, [v, 0.0]);
            }
            let shift = 1.2 * step * f64::from(phase) / 8.0;
            state.displacement.set(sites[0], [0.3 - shift, 0.0]);
            let solver = VelocityVerlet {
                time_step: Some(step),
                records: 1,
                ..VelocityVerlet::new(DENSITY, 1.0 + 2.0 * PI / omega)
            };
            run(&solver, &mut cloud, &Loads::default(), SHORT_RANGE, &mut state).unwrap();
            let after = sites.map(|site| state.velocity.get(site)[0]);
            let momentum = |v: [f64; 2]| v[0] * volumes[0] + v[1] * volumes[1];
            // rounding of some thousand steps
            assert!((momentum(after) - momentum(before)).abs() < 1e-13, "{after:?}");
            let last = state.history.last().unwrap();
            assert_eq!(last.contact.unwrap().pairs, 0, "they have parted");
            // the trajectory is symmetric in time but for the phases at which it enters and leaves
            let exact = before.map(|v| 2.0 * centre - v);
            sum += (after[0] - exact[0]).powi(2) + (after[1] - exact[1]).powi(2);
        }
        errors.push((sum / 8.0).sqrt());
    }
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        eprintln!("rebound: error {:.1e} m/s of 1.2, order {order:.2}", pair[1]);
        // a force with a kink, observed anywhere within a step
        assert!((order - 2.0).abs() < 0.4, "{errors:?}");
    }
    assert!(errors[3] < 1e-3 * 1.2, "{errors:?}");
}

/// Impact of bars of `bars` particles in a row: returns the velocities of their centres over that of the
/// first, and the state. The horizon Δ makes each bar a chain of springs 6kθV²/Δ, which hits the next at a
/// hundredth of its wave speed.
fn cradle(bars: usize, particles: usize, safety: f64, kappa: f64) -> (Vec<f64>, State<2>) {
    let count = bars * particles;
    let mut body = Body::<2>::solid([1, count], 1.0, 1.015);
    body.slits = (1..bars).map(|k| Slit { at: (k * particles) as f64, from: -1.0, to: 2.0 }).collect();
    let mut built = body.build();
    let bonds = &mut built.lattice;
    let loads = hold(bonds, |_| Some((1, [0.0; 2])));
    let speed = (6.0 * MODULUS / DENSITY).sqrt();
    let first = 0.01 * speed;
    let mut state = State::new(bonds.sites());
    let bar = |bonds: &dyn Bonds<2>, site: u32| bonds.position(site as usize)[1] as usize / particles;
    for &site in bonds.particles() {
        if bar(bonds, site) == 0 {
            state.velocity.set(site as usize, [0.0, first]);
        }
    }
    // to close the gaps, and for a wave to go up and down each bar
    let end = (bars - 1) as f64 * 0.1 / first + (2 * particles * bars) as f64 / speed;
    let solver = VelocityVerlet { safety, records: 200, ..VelocityVerlet::new(DENSITY, end) };
    run(&solver, bonds, &loads, kappa, &mut state).unwrap();
    let mut centres = vec![0.0; bars];
    for &site in bonds.particles() {
        centres[bar(bonds, site)] += state.velocity.get(site as usize)[1] / (particles as f64 * first);
    }
    (centres, state)
}

fn energy_error(state: &State<2>) -> f64 {
    let off = |row: &peri::solver::StepRecord| ((row.kinetic + row.stored) / row.work - 1.0).abs();
    state.history.iter().map(off).fold(0.0, f64::max)
}

/// Equal elastic bars exchange their velocities. Dispersion in chains of particles leaves a vibration that
/// decreases with the number of particles. Momentum is conserved to rounding, energy to O(Δt²).
#[test]
fn newtons_cradle() {
    let mut left = Vec::new();
    for particles in [10, 40, 160] {
        let (velocities, state) = cradle(2, particles, 0.5, SHORT_RANGE);
        let momentum: f64 = velocities.iter().sum();
        eprintln!(
            "two bars of {particles}: {velocities:.4?}, momentum {:.1e}, energy {:.1e}, {} steps",
            momentum - 1.0,
            energy_error(&state),
            state.counts.total_iterations
        );
        // rounding of thousands of steps
        assert!((momentum - 1.0).abs() < 1e-12);
        assert_eq!(state.history.last().unwrap().contact.unwrap().pairs, 0, "they have parted");
        left.push(velocities[0].abs());
    }
    assert!(left[2] < 0.02 && left[2] < 0.7 * left[1] && left[1] < 0.7 * left[0], "{left:?}");
    let (velocities, _) = cradle(3, 40, 0.5, SHORT_RANGE);
    eprintln!("three bars of 40: {velocities:.4?}");
    assert!((velocities.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    assert!(velocities[2] > 0.9 && velocities[..2].iter().all(|v| v.abs() < 0.1), "{velocities:?}");
}

/// Two halves of a sheet collide obliquely: equal bits on any number of threads, and from a state saved while
/// they touch.
#[test]
fn neither_threads_nor_restarts_change_a_bit() {
    let mut body = Body::<2>::solid([66, 66], 1.0, 3.015);
    body.slits = vec![Slit { at: 33.0, from: -1.0, to: 67.0 }];
    let run = |threads: usize, from: Option<State<2>>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut built = body.build();
            let bonds = &mut built.lattice;
            let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
            let contact = Contact::short_range(bonds, MODULUS, SHORT_RANGE).unwrap();
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
            let solver = VelocityVerlet { records: 4, ..VelocityVerlet::new(DENSITY, 2.0) };
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
    let (one, saved) = run(1, None);
    eprintln!("askew: {:?}, {} steps", one.history[1].contact, one.counts.total_iterations);
    assert!(one.displacement.sites() > peri::field::CHUNK && one.history[1].contact.unwrap().pairs > 20);
    // == of all fields and histories: no −0 and no NaN are here
    assert!(run(3, None).0 == one && run(2, Some(saved)).0 == one);
}

/// The energy error of an impact is of second order in the time step, from the stability limit of the
/// stiffest contact on.
#[test]
fn energy_through_an_impact() {
    for kappa in [SHORT_RANGE, 1e4] {
        let errors: Vec<f64> = [0.4, 0.2, 0.1]
            .map(|safety| {
                let (_, state) = cradle(2, 20, safety, kappa);
                let motion = state.motion;
                // twice the stiffest pair's
                let contact = 2.0 * kappa * 6.0 * MODULUS / 1.015 / DENSITY;
                assert!(motion.limits.covered_step < 2.0 / contact.sqrt(), "{motion:?}");
                energy_error(&state)
            })
            .to_vec();
        eprintln!("impact, κ = {kappa}: {errors:?}");
        let order = (errors[0] / errors[2]).log2() / 2.0;
        assert!(errors[2] < 1e-3 && (order - 2.0).abs() < 0.4, "κ = {kappa}: {errors:?}, order {order}");
    }
}
