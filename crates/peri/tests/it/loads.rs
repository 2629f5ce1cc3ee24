//! Loads that depend on the displacement, and regions that move as a whole under a force.

use crate::bodies::{Body, Slit};
use evidence::{at_most, near};
use peri::bonds::{BodyGeometry, Bonds, components, sever_pairs};
use peri::calibrate::Space;
use peri::field::Field;
use peri::material::{EightChainSolid, NonlocalSolid};
use peri::solver::{
    Amplitude, Centrifugal, ContactStops, CurvedLoads, CurvedRegion, DynamicRelaxation, FollowingPressure,
    ForceField, Lbfgs, Loads, Method, PlacedForce, RigidRegion, State, Status, System, VelocityVerlet,
    find_unsupported,
};
use peri::surface::{BodySurface, SurfaceFace};
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

/// Spins a block that is held below, presses on its right side, pushes its middle by a force of place and
/// time, and its upper end, which moves as a whole.
fn spin(solver: Solver, start: Option<&State<2>>, saved: &mut Vec<State<2>>) -> (State<2>, Vec<u32>, f64) {
    let body = Body::<2>::solid([12, 12], 0.1, 3.015);
    let surface = BodySurface::of_shapes(&body.operations, body.spacing);
    let mut built = body.build();
    let bonds = &mut built.lattice;
    let solid = NonlocalSolid::new(EightChainSolid::new(Space::PlaneStrain, 1.0, 1e6, 5.0).unwrap());
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
        density: 1.0.into(),
        angular_velocity: 0.4,
        centre: [0.5, 0.0],
        axis: [0.0, 0.0, 1.0],
        amplitude: rise(),
    };
    let right = |face: &SurfaceFace<2>| face.normal[0] > 0.5;
    let pressed = FollowingPressure::new(bonds, &surface, right, 0.02, rise()).unwrap();
    let middle = within(&|[_, y]| (0.3..0.9).contains(&y)).into_iter();
    let points = middle.map(|site| (site, bonds.position(site as usize), 1.0)).collect();
    let travelling = PlacedForce::new(points, |[x, _], part| [0.0, 0.05 * part * (x - part).sin()]);
    loads.curved = Some(Box::new(CurvedLoads {
        held: vec![CurvedRegion::new(low, rest, amplitudes.clone(), 3)],
        pushed: vec![CurvedRegion::new(high.clone(), push, amplitudes, 0)],
        fields: vec![Arc::new(spun), Arc::new(pressed), Arc::new(travelling)],
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

/// The force on a side of a wall of four horizons is that of its area, and a gap between two halves that have
/// come apart is no pressed area.
#[test]
fn gaps_are_not_pressed() {
    let body = Body::<2>::solid([12, 12], 0.1, 3.015);
    let surface = BodySurface::of_shapes(&body.operations, body.spacing);
    let mut bonds = body.build().lattice;
    let top = |face: &SurfaceFace<2>| face.normal[1] > 0.5;
    let pressed = FollowingPressure::new(&bonds, &surface, top, 1.0, Amplitude::new(|_| (1.0, 0.0))).unwrap();
    let mut apart = Field::zeros(bonds.sites());
    for &site in bonds.particles() {
        let x = bonds.position(site as usize)[0];
        apart.set(site as usize, [0.3 * (x - 0.6).signum(), 0.0]);
    }
    let force = |bonds: &dyn Bonds<2>, displacement: &Field<2>| -> f64 {
        let mut field = Field::zeros(bonds.sites());
        pressed.add(bonds, displacement, 1.0, 1.0, &mut field);
        let each = bonds.particles().iter().map(|&site| site as usize);
        each.map(|site| bonds.volume(site) * field.get(site)[1]).sum()
    };
    let rest = force(&bonds, &Field::zeros(bonds.sites()));
    near("pressure_on_a_side", rest, -1.2 * bonds.volume(bonds.particles()[0] as usize) / 0.01, 1e-12);
    assert!(force(&bonds, &apart) / rest > 1.2, "bonds across the gap stretch the face");
    let mut across = Vec::new();
    for &site in bonds.particles() {
        let left = bonds.position(site as usize)[0] < 0.6;
        bonds.neighbours(site as usize, &mut |bond| {
            if left && bonds.position(bond.site)[0] > 0.6 {
                across.push([site, bond.site as u32]);
            }
        });
    }
    sever_pairs(&mut bonds, &across);
    near("pressure_beside_a_gap", force(&bonds, &apart) / rest, 1.0, 1e-12);
}

/// A part that shares its displacement with a held one is held; along the components that they share.
#[test]
fn parts_of_one_grip_are_held() {
    let mut body = Body::<2>::solid([12, 6], 0.1, 3.015);
    body.slits = vec![Slit { at: 0.3, from: -1.0, to: 2.0 }];
    let bonds = body.build().lattice;
    let places = |inside: &dyn Fn([f64; 2]) -> bool| -> Vec<u32> {
        let each = bonds.particles().iter().copied();
        each.filter(|&site| inside(bonds.position(site as usize))).collect()
    };
    let mut loads = Loads { constrained: vec![0; bonds.sites()], ..Loads::default() };
    places(&|[x, y]| x < 0.3 && y < 0.3).iter().for_each(|&site| loads.constrained[site as usize] = 3);
    let mut force = Field::zeros(bonds.sites());
    let grip = places(&|[x, _]| x > 0.9);
    grip.iter().for_each(|&site| force.set(site as usize, [1.0, 1.0]));
    loads.body_force = Some(force);
    let roots = components(&bonds, |_, _| true);
    let axis = |loads: &Loads<2>| {
        find_unsupported(&bonds, &roots, loads, None, &ContactStops::default(), 1e-6).map(|part| part.axis)
    };
    assert_eq!(axis(&loads), Some("x"));
    let join = |components: u8| {
        let mut joined = loads.clone();
        joined.join(RigidRegion { sites: grip.clone(), components }, bonds.sites());
        axis(&joined)
    };
    assert_eq!([join(1), join(3)], [Some("y"), None]);
}
