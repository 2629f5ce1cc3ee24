//! Velocity Verlet against oscillators and conservation laws.

use crate::bodies::{Body, MODULUS, Random, hold, norm};
use peri::Error;
use peri::bonds::{BodyGeometry, BondForces, Bonds, force};
use peri::field::Field;
use peri::material::BondMaterial;
use peri::potential::{BondPotential, Law};
use peri::solver::{Breaking, Loads, Method, Policy, State, StepRecord, System, VelocityVerlet};
use peri::stress::{BallVolume, StressInput, StressMethod, SurfaceCompensation, piola_on_lattice};
use std::f64::consts::PI;

pub const DENSITY: f64 = 2.3;

/// Runs to the end.
pub fn run<const D: usize>(
    solver: &VelocityVerlet,
    bonds: &mut dyn Bonds<D>,
    law: &dyn BondPotential,
    loads: &Loads<D>,
    state: &mut State<D>,
) -> Result<(), Error> {
    let mut system = System::new(bonds, BondMaterial::new(law, MODULUS), loads, &[]);
    solver.solve(&mut system, state, &mut |_, _| Ok(()), &mut |_, _| Ok(()))
}

pub fn once(end_time: f64, time_step: f64) -> VelocityVerlet {
    VelocityVerlet { time_step: Some(time_step), records: 1, ..VelocityVerlet::new(DENSITY, end_time) }
}

/// A particle without bonds: no critical step, a straight line, no error.
#[test]
fn one_particle() {
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let mut one = Body::<3>::solid([1, 1, 1], 0.1, 3.015).build();
    for bonds in [&mut one.lattice as &mut dyn Bonds<3>, &mut one.cloud] {
        let site = bonds.particles()[0] as usize;
        let mut state = State::new(bonds.sites());
        state.velocity.set(site, [0.5, -0.25, 2.0]);
        let solver = VelocityVerlet { records: 4, ..VelocityVerlet::new(DENSITY, 8.0) };
        run(&solver, bonds, &*law, &Loads::default(), &mut state).unwrap();
        assert_eq!(state.displacement.get(site), [4.0, -2.0, 16.0]);
        assert_eq!(state.counts.total_iterations, 4);
        assert_eq!(state.motion.limits.critical_step, f64::INFINITY);
        // and it falls: u = ½bt²/ρ, which the method integrates without error
        let mut force = Field::zeros(bonds.sites());
        force.set(site, [0.0, 3.0, 0.0]);
        let loads = Loads { body_force: Some(force), ..Loads::default() };
        let mut state = State::new(bonds.sites());
        run(&once(2.0, 0.125), bonds, &*law, &loads, &mut state).unwrap();
        let fallen = state.displacement.get(site)[1];
        assert!((fallen / (0.5 * 3.0 * 4.0 / DENSITY) - 1.0).abs() < 1e-14, "{fallen}");
        let last = &state.history[0];
        assert!((last.work / last.kinetic - 1.0).abs() < 1e-13, "{} {}", last.work, last.kinetic);
    }
}

/// A particle slowed by damping only: v = v₀(1 − ½cΔt)ⁿ/(1 + ½cΔt)ⁿ, to second order v₀e^(−ct), and the lost
/// energy counts as damped.
#[test]
fn damping_slows() {
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let mut one = Body::<2>::solid([1, 1], 0.1, 3.015).build();
    let bonds = &mut one.lattice;
    let site = bonds.particles()[0] as usize;
    let errors = [16.0, 32.0, 64.0].map(|steps: f64| {
        let mut state = State::new(bonds.sites());
        state.velocity.set(site, [0.7, 0.0]);
        let step = 2.0 / steps;
        let solver = VelocityVerlet { damping: 1.3, ..once(2.0, step) };
        run(&solver, bonds, &*law, &Loads::default(), &mut state).unwrap();
        let speed = state.velocity.get(site)[0];
        let ratio = (1.0 - 0.65 * step) / (1.0 + 0.65 * step);
        assert!((speed / (0.7 * ratio.powf(steps)) - 1.0).abs() < 1e-13, "{speed}");
        let last = &state.history[0];
        [(speed / 0.7 - (-2.6_f64).exp()).abs(), ((last.kinetic + last.damped) / last.work - 1.0).abs()]
    });
    for pair in errors.windows(2) {
        let orders = [0, 1].map(|k| (pair[0][k] / pair[1][k]).log2());
        assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.05), "{orders:?}");
    }
}

/// A body with all components prescribed follows the ramp and stores the work of the supports.
#[test]
fn fully_held() {
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let mut built = Body::<2>::solid([9, 8], 0.1, 3.015).build();
    let bonds = &mut built.lattice;
    let loads = hold(bonds, |x| Some((3, [0.2 * x[0], -0.1 * x[1]])));
    let mut state = State::new(bonds.sites());
    let solver = VelocityVerlet { ramp: 1.0, records: 200, ..VelocityVerlet::new(DENSITY, 2.0) };
    run(&solver, bonds, &*law, &loads, &mut state).unwrap();
    let [half, last] = [&state.history[49], &state.history[199]];
    assert_eq!((half.factor, last.factor, last.kinetic), (0.5, 1.0, 0.0));
    assert!(half.kinetic > 0.0 && (last.largest_stretch - 1.2).abs() < 1e-6, "{}", last.largest_stretch);
    // the trapezoidal rule over 100 steps of the ramp
    for row in [half, last] {
        let off = (row.kinetic + row.stored) / row.work - 1.0;
        assert!(off.abs() < 1e-4, "{off}");
    }
}

/// Two particles on a linear bond: ω² = 12kθV/(ρ|ξ|); the method's own oscillation is cos(2n asin(ωΔt/2)).
#[test]
fn two_particles() {
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let mut two = Body::<2>::solid([2, 1], 0.1, 3.015).build();
    let omega = (12.0 * MODULUS * 0.01 / (DENSITY * 0.1)).sqrt();
    for bonds in [&mut two.lattice as &mut dyn Bonds<2>, &mut two.cloud] {
        let start = |bonds: &dyn Bonds<2>| {
            let mut state = State::new(bonds.sites());
            for &site in bonds.particles() {
                let right = bonds.position(site as usize)[0] > 0.1;
                state.velocity.set(site as usize, [if right { 0.01 } else { -0.01 }, 0.0]);
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
            assert_eq!(state.counts.total_iterations, steps as u64);
            // the sharp critical step is that of the oscillator; differences of forces give it to 1e-9
            assert!((state.motion.limits.critical_step * omega / 2.0 - 1.0).abs() < 1e-8);
            // and Gershgorin's theorem is sharp here, but for what the law's slope changes within the
            // stretches covered
            assert!(
                (state.motion.limits.gershgorin_step / state.motion.limits.critical_step - 1.0).abs() < 1e-8
            );
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

/// Two particles of the densities ρ and 3ρ on a linear bond, the light one with the speed v₀: ω² of the
/// reduced mass is ⅔ of that of equal ones, the sharp critical step follows from it, the centre of mass
/// flies on at v₀/4, and the energies add up.
#[test]
fn two_densities() {
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let mut two = Body::<2>::solid([2, 1], 0.1, 3.015).build();
    let omega = (2.0 / 3.0 * 12.0 * MODULUS * 0.01 / (DENSITY * 0.1)).sqrt();
    for bonds in [&mut two.lattice as &mut dyn Bonds<2>, &mut two.cloud] {
        let order = |&site: &u32| (bonds.position(site as usize)[0] * 1e6) as i64;
        let mut sites = bonds.particles().to_vec();
        sites.sort_by_key(order);
        let [light, heavy] = [sites[0] as usize, sites[1] as usize];
        let mut density_ratios = vec![1.0; bonds.sites()];
        density_ratios[heavy] = 3.0;
        let mut state = State::new(bonds.sites());
        state.velocity.set(light, [0.01, 0.0]);
        let (steps, period) = (160.0, 2.0 * PI / omega);
        let step = period / steps;
        let loads = Loads::default();
        let mut system = System::new(bonds, BondMaterial::new(&*law, MODULUS), &loads, &[]);
        system.density_ratios = density_ratios;
        once(0.25 * period, step)
            .solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(()))
            .unwrap();
        assert!((state.motion.limits.critical_step * omega / 2.0 - 1.0).abs() < 1e-8);
        assert!(state.motion.limits.gershgorin_step <= state.motion.limits.critical_step);
        let [u, w] = [light, heavy].map(|site| state.displacement.get(site)[0]);
        let centre = 0.25 * (u + 3.0 * w);
        assert!((centre / (0.0025 * 0.25 * period) - 1.0).abs() < 1e-12, "{centre}");
        // relative motion v₀ sin(ωt)/ω, by the method's own frequency
        let theta = 2.0 * (0.5 * omega * step).asin();
        let exact = 0.01 * step / theta.sin() * (0.25 * steps * theta).sin();
        assert!((u - w - exact).abs() < 1e-8 * 0.01 / omega, "{} {exact}", u - w);
        let last = &state.history[0];
        let kinetic = 0.5
            * DENSITY
            * 0.01
            * [light, heavy]
                .map(|site| state.velocity.get(site)[0].powi(2))
                .iter()
                .zip([1.0, 3.0])
                .map(|(square, ratio)| ratio * square)
                .sum::<f64>();
        assert!((last.kinetic / kinetic - 1.0).abs() < 1e-12, "{} {kinetic}", last.kinetic);
        assert!(((last.kinetic + last.stored) / last.work - 1.0).abs() < 1e-3, "{last:?}");
    }
}

/// Kinetic + stored + released + damped = work, with ramps, supports, body forces, damping and breaking
/// bonds; the error falls as Δt² where no bond breaks.
#[test]
fn energies_balance() {
    let law = Law::ChainOffset.build(100.0, 1200.0, true).unwrap();
    let body = Body::<2>::damaged([24, 20], 0.1, 3.015);
    let critical = {
        let mut built = body.build();
        let mut state = State::new(built.lattice.sites());
        let solver = VelocityVerlet { records: 1, ..VelocityVerlet::new(DENSITY, 1e-9) };
        run(&solver, &mut built.lattice, &*law, &Loads::default(), &mut state).unwrap();
        state.motion.limits.critical_step
    };
    let balance = |part: f64, breaking: Option<f64>, damping: f64| {
        let mut built = body.build();
        let bonds = &mut built.lattice;
        let mut loads = hold(bonds, |x| {
            (x[0] < 0.3 || x[0] > 2.1).then(|| (3, if x[0] < 0.3 { [0.0; 2] } else { [0.25, 0.05] }))
        });
        let mut force = Field::zeros(bonds.sites());
        for &site in bonds.particles() {
            force.set(site as usize, [0.0, -0.01]);
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
        let mut state = State::new(bonds.sites());
        let mut system = System::new(bonds, BondMaterial::new(&*law, MODULUS), &loads, &[]);
        system.breaking = breaking
            .map(|stretch: f64| Breaking { criterion: stretch.into(), policy: Policy::EachIteration });
        solver.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap();
        assert_eq!(state.history.len(), 50);
        let last = state.history.last().unwrap();
        assert_eq!((last.time, last.factor), (end, 1.0));
        let scale = state.history.iter().map(|r| r.work.abs()).fold(0.0, f64::max);
        let error = |r: &StepRecord| r.kinetic + r.stored + r.released + r.damped - r.work;
        let worst = state.history.iter().map(|r| error(r).abs()).fold(0.0, f64::max) / scale;
        eprintln!(
            "step {part} of critical, damping {damping}, {} broken: work {:.3e}, kinetic {:.3e}, stored \
             {:.3e}, \
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
        assert!(state.fracture.broken > 50, "{} broken", state.fracture.broken);
        assert!(worst < most, "{worst}");
    }
}

/// Returns conserved quantities of a state: momentum, angular momentum about the origin (xy), energies.
struct Conserved {
    momentum: [f64; 2],
    spin: f64,
    /// Energy ½ρ(v² − ¼Δt²a²); its sum with the stored energy is exactly conserved for linear forces.
    kinetic: f64,
}

fn conserved(bonds: &dyn Bonds<2>, state: &State<2>) -> Conserved {
    let mut sum = Conserved { momentum: [0.0; 2], spin: 0.0, kinetic: 0.0 };
    for &site in bonds.particles() {
        let site = site as usize;
        let (mass, x) = (DENSITY * bonds.volume(site), bonds.position(site));
        let (u, v, f) = (state.displacement.get(site), state.velocity.get(site), state.force.get(site));
        for d in 0..2 {
            sum.momentum[d] += mass * v[d];
            let half = 0.5 * state.motion.steps.time_step * f[d] / DENSITY;
            sum.kinetic += 0.5 * mass * (v[d] * v[d] - half * half);
        }
        sum.spin += mass * ((x[0] + u[0]) * v[1] - (x[1] + u[1]) * v[0]);
    }
    sum
}

/// Returns random velocities without momentum that strain bonds by about `strain`.
fn shake(bonds: &dyn Bonds<2>, strain: f64, state: &mut State<2>) {
    let particles = bonds.particles();
    // at the frequency √(kθ…) of a bond the amplitude v/ω is strain·spacing
    let omega = 2.0 / 0.234;
    let values = Random(5).vectors::<2>(particles.len(), strain * bonds.spacing() * omega);
    let mean = |d: usize| values.iter().map(|v| v[d]).sum::<f64>() / values.len() as f64;
    let mean = [mean(0), mean(1)];
    for (&site, v) in particles.iter().zip(&values) {
        state.velocity.set(site as usize, [v[0] - mean[0], v[1] - mean[1]]);
    }
}

/// A shaken small body has no drift of energy, momentum or spin in 1e5 steps.
#[test]
fn energy_does_not_drift() {
    let law = Law::ChainOffset.build(100.0, 1200.0, true).unwrap();
    let mut built = Body::<2>::solid([7, 6], 0.1, 3.015).build();
    let bonds = &mut built.lattice;
    let run = |bonds: &mut dyn Bonds<2>, part: f64, steps: f64, strain: f64| {
        let mut state = State::new(bonds.sites());
        shake(bonds, strain, &mut state);
        let loads = Loads::default();
        let mut system = System::new(bonds, BondMaterial::new(&*law, MODULUS), &loads, &[]);
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
        let size = DENSITY * 0.42 * (2.0 * state.motion.energies.kinetic / (DENSITY * 0.42)).sqrt();
        let moved = norm([end.momentum[0] - start.momentum[0], end.momentum[1] - start.momentum[1]]) / size;
        let turned = (end.spin - start.spin).abs() / (0.5 * size);
        eprintln!(
            "{} steps of {part} critical: momentum {moved:.1e}, spin {turned:.1e}",
            state.counts.total_iterations
        );
        // rounding of 1e5 steps adds up as their root, and not more than their number
        assert!(moved < 1e-11 && turned < 1e-11);
        (method, plain, state.work)
    };
    let (method, plain, work) = run(bonds, 0.1, 1e5, 1e-3);
    // larger strains let it wander, without a trend, by O(Δt²·strain): 1.5e-5 at 0.02. Slope of the line of
    // least squares times the duration
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

/// A body rotated by 90° in steps of 1° has no forces and stresses; a spinning one conserves energy, momentum
/// and spin.
#[test]
fn rigid_rotation() {
    let law = Law::ChainOffset.build(100.0, 1200.0, true).unwrap();
    let mut built = Body::<2>::damaged([24, 20], 0.1, 3.015).build();
    let bonds = &mut built.lattice;
    let fit = crate::bodies::fit(&*law, [0.95, 1.05]);
    bonds.set_law(&fit, MODULUS);
    let mut out = Field::zeros(bonds.sites());
    // force of a particle with 28 bonds strained by one, and Young's modulus
    let stiffness = 28.0 * 2.0 * MODULUS * law.tangent() * 0.01;
    let youngs = MODULUS * 2.0 * PI * 0.3015_f64.powi(3) / 3.0;
    let (mut largest, mut stress) = (0.0_f64, 0.0_f64);
    for degree in 0..=90 {
        let (sine, cosine) = f64::from(degree).to_radians().sin_cos();
        let mut u = Field::zeros(bonds.sites());
        for &site in bonds.particles() {
            let [x, y] = bonds.position(site as usize);
            u.set(site as usize, [cosine * x - sine * y - x, sine * x + cosine * y - y]);
        }
        force(bonds, &u, &mut out);
        let each = bonds.particles().iter().map(|&s| norm(out.get(s as usize)));
        largest = largest.max(each.fold(0.0, f64::max) / stiffness);
        let loaded = StressInput {
            displacement: &u,
            fit: (&fit).into(),
            modulus: MODULUS,
            missing: SurfaceCompensation::Bonds,
        };
        for measure in [StressMethod::Hardy, StressMethod::BallShare, StressMethod::OnePoint] {
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

    // one free turn, slow beside the body's own vibrations, while it drifts
    let mut state = State::new(bonds.sites());
    let rate = 0.02;
    for &site in bonds.particles() {
        let [x, y] = bonds.position(site as usize);
        state.velocity.set(site as usize, [-rate * (y - 1.0) + 0.3, rate * (x - 1.2) - 0.1]);
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
        "one free turn in {} steps: momentum {moved:.1e}, spin {turned:.1e}, energy {energy:.1e}, stretch \
         {:.5}",
        state.counts.total_iterations,
        state.history.last().unwrap().largest_stretch
    );
    assert!(moved < 1e-12 && turned < 1e-12 && energy < 1e-5);
}
