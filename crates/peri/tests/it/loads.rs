//! Loads that depend on the displacement, and regions that move as a whole under a force.

use crate::bodies::Body;
use evidence::{at_most, near};
use peri::bonds::{BodyGeometry, Bonds};
use peri::calibrate::Space;
use peri::field::Field;
use peri::material::{EightChainSolid, NonlocalSolid};
use peri::solver::{
    Amplitude, Centrifugal, CurvedLoads, CurvedRegion, DynamicRelaxation, Lbfgs, Loads, Method, RigidRegion,
    State, Status, System, VelocityVerlet,
};
use std::sync::Arc;

/// Steps of the programme.
const STEPS: usize = 12;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Solver {
    Lbfgs,
    Relaxation,
    Verlet,
}

/// Multiple that rises smoothly from 0 to 1.
fn rise() -> Amplitude {
    Amplitude::new(|part| (part * part * (3.0 - 2.0 * part), 6.0 * part * (1.0 - part)))
}

/// Spins a block that is held below, and pushes its upper end, which moves as a whole.
fn spin(solver: Solver, start: Option<&State<2>>, saved: &mut Vec<State<2>>) -> (State<2>, Vec<u32>, f64) {
    let mut built = Body::<2>::solid([12, 12], 0.1, 3.015).build();
    let bonds = &mut built.lattice;
    let solid = NonlocalSolid(EightChainSolid::new(Space::PlaneStrain, 1.0, 1e6, 5.0).unwrap());
    let all = bonds.particles().to_vec();
    let within = |inside: &dyn Fn([f64; 2]) -> bool| {
        all.iter().copied().filter(|&site| inside(bonds.position(site as usize))).collect::<Vec<u32>>()
    };
    let (low, high) = (within(&|[_, y]| y < 0.3), within(&|[_, y]| y > 0.9));
    let mut loads = Loads {
        displacement: Some(Field::zeros(bonds.sites())),
        body_force: Some(Field::zeros(bonds.sites())),
        constrained: vec![0; bonds.sites()],
        held_regions: vec![low.clone()],
        ..Loads::default()
    };
    low.iter().for_each(|&site| loads.constrained[site as usize] = 3);
    let amplitudes = [rise(), rise()];
    let rest = vec![[0.0; 2]; low.len()];
    let push = vec![[0.1, 0.4]; high.len()];
    let spun = Centrifugal {
        density: 1.0,
        angular_velocity: 0.4,
        centre: [0.5, 0.0],
        axis: [0.0, 0.0, 1.0],
        amplitude: rise(),
    };
    loads.curved = Some(Box::new(CurvedLoads {
        held: vec![CurvedRegion::new(low, rest, amplitudes.clone(), 3)],
        pushed: vec![CurvedRegion::new(high.clone(), push, amplitudes, 0)],
        fields: vec![Arc::new(spun)],
        ..CurvedLoads::default()
    }));
    loads.join(RigidRegion { sites: high.clone(), components: 3 }, bonds.sites());
    let factors: Vec<f64> = (1..=STEPS).map(|step| step as f64 / STEPS as f64).collect();
    let mut state = start.cloned().unwrap_or_else(|| State::new(bonds.sites()));
    let amplitude = |time: f64| (time / 40.0, 1.0 / 40.0);
    let mut system = System::new(bonds, solid, &loads, &factors);
    let volume = system.bonds.volume(high[0] as usize);
    let mut seen = 0;
    let mut watch = |status: &Status, state: &State<2>| {
        seen += 1;
        // of equilibria by L-BFGS few states can be resumed
        if status.restartable && state.step > 0 && (seen % 7 == 0 || solver == Solver::Lbfgs) {
            saved.push(state.clone());
        }
        Ok(())
    };
    let finished = &mut |_: &dyn Bonds<2>, _: &_| Ok(());
    system.times = factors.clone().into();
    let solved = match solver {
        Solver::Lbfgs => {
            let method = Lbfgs { tolerance: 1e-8, ..Lbfgs::default() };
            method.solve(&mut system, &mut state, &mut watch, finished)
        }
        Solver::Relaxation => {
            let method = DynamicRelaxation { tolerance: 1e-8, ..DynamicRelaxation::default() };
            method.solve(&mut system, &mut state, &mut watch, finished)
        }
        Solver::Verlet => {
            system.times = Vec::new().into();
            system.amplitude = Some(&amplitude);
            let method = VelocityVerlet { records: 20, safety: 0.5, ..VelocityVerlet::new(1.0, 40.0) };
            method.solve(&mut system, &mut state, &mut watch, finished)
        }
    };
    solved.unwrap();
    (state, high, volume)
}

/// The work of a force that follows the body is its energy; a region that moves as a whole is in balance; a
/// resumed run has equal bits, on any number of threads.
#[test]
fn work_of_followers_is_stored_and_rigid_regions_balance() {
    let mut places = Vec::new();
    for solver in [Solver::Lbfgs, Solver::Relaxation, Solver::Verlet] {
        let mut saved = Vec::new();
        let (whole, high, volume) = spin(solver, None, &mut saved);
        let last = whole.history.last().unwrap();
        assert!(last.stored > 0.0 && last.work > 0.0, "{solver:?}");
        // trapezoidal rule of twelve steps
        at_most("followers_energy_balance", ((last.stored + last.kinetic) / last.work - 1.0).abs(), 2e-3);
        let first = whole.displacement.get(high[0] as usize);
        for &site in &high {
            let own = whole.displacement.get(site as usize);
            let apart = (own[0] - first[0]).hypot(own[1] - first[1]);
            at_most("rigid_region_distortion", apart / first[1], 1e-12);
        }
        if solver != Solver::Verlet {
            let force: f64 = high.iter().map(|&site| volume * whole.force.get(site as usize)[1]).sum();
            let load = 0.4 * volume * high.len() as f64;
            at_most("rigid_region_balance", (force / load).abs(), 1e-6);
            places.push(first);
        }
        assert!(saved.len() > 1, "{}", saved.len());
        for state in saved.iter().step_by(saved.len().div_ceil(2)) {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            let again = pool.install(|| spin(solver, Some(state), &mut Vec::new()).0);
            assert!(again == whole, "{solver:?}: from step {}", state.step);
        }
    }
    near("rigid_region_by_two_methods", places[1][1] / places[0][1], 1.0, 1e-5);
}
