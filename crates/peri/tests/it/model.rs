//! Models in a few lines agree with models built by hand.

use crate::linear_solid::LinearSolid;
use peri::Error;
use peri::bonds::{BodyGeometry, BondDamage, LatticeBonds, VolumeCorrection};
use peri::calibrate::{Space, modulus};
use peri::geometry::{Cut, Operation, Shape, lattice};
use peri::material::{BondMaterial, EightChainSolid};
use peri::model::{Body, Model, Rubber};
use peri::potential::{BondPotential, Law};
use peri::solver::{
    Breaking, DynamicRelaxation, Lbfgs, Loads, Method, Policy, State, Support, System, VelocityVerlet,
};
use peri::stress::StressMethod;

const CRACK: [[f64; 2]; 2] = [[0.0, 20e-3], [8e-3, 20e-3]];

fn sheet() -> Body<2> {
    let shape = Shape::rectangle([0.0; 2], [24e-3, 40e-3]);
    Body::lattice(shape, 2e-3).plane_stress(1e-3).crack(Cut::segment(CRACK[0], CRACK[1]))
}

/// Tears the cracked sheet in three steps, built by hand.
fn by_hand() -> (LatticeBonds<2>, State<2>) {
    let body = [Operation::Add(Shape::Box { min: [0.0; 2], max: [24e-3, 40e-3] })];
    let crack = Cut { corner: CRACK[0], edges: [[8e-3, 0.0], [0.0; 2]] };
    let lattice = lattice(&body, 2e-3, 1e-3).unwrap();
    let mut bonds = LatticeBonds::new(lattice, 3.015, VolumeCorrection::None, &[crack]).unwrap();
    let law = Law::ChainOffset.build(300.0, 900.0, false).unwrap();
    let modulus = modulus(Space::PlaneStress, 1e6, bonds.horizon(), 1e-3);
    let grip = |inside: &dyn Fn(f64) -> bool, y| {
        let inside = |&site: &u32| inside(bonds.position(site as usize)[1]);
        let members: Vec<u32> = bonds.particles().iter().copied().filter(inside).collect();
        (members, Support { displacement: [Some(0.0), Some(y)], body_force: [0.0; 2] })
    };
    let loads = Loads::new(bonds.sites(), &[grip(&|y| y < 6e-3, 0.0), grip(&|y| y > 34e-3, 12e-3)]);
    let mut state = State::new(bonds.sites());
    let factors = [1.0 / 3.0, 2.0 / 3.0, 1.0];
    let mut system = System::new(&mut bonds, BondMaterial::new(&*law, modulus), &loads, &factors);
    system.breaking = Some(Breaking { criterion: 1.5.into(), policy: Policy::AtEquilibrium });
    DynamicRelaxation::default()
        .solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(()))
        .unwrap();
    drop(system);
    (bonds, state)
}

#[test]
fn a_model_is_its_parts() {
    let rubber = Rubber::new(Law::ChainOffset, 1e6).chains(300.0, 900.0).critical_stretch(1.5);
    let model =
        Model::new(sheet(), rubber).clamp(|[_, y]| y < 6e-3).displace(|[_, y]| y > 34e-3, [0.0, 12e-3]);
    let mut simulation = model.steps(3).build().unwrap();
    let mut seen = 0;
    let count = |_: &State<2>| {
        seen += 1;
        Ok(())
    };
    simulation.solve_with(DynamicRelaxation::default(), count).unwrap();
    let (bonds, state) = by_hand();
    assert!(state.fracture.broken > 0, "the sheet tears");
    assert_eq!(simulation.state, state);
    assert_eq!(simulation.bonds.intact(), bonds.intact());
    assert!(seen >= 3 && simulation.history().len() == 3);
    let particles = bonds.particles().len();
    assert_eq!(simulation.displacements().count(), particles);
    let stress = simulation.cauchy(StressMethod::Hardy).unwrap();
    assert!(stress.len() == particles && stress.iter().flatten().flatten().all(|x| x.is_finite()));
}

/// A method continues the state of another: further load steps, then motion.
#[test]
fn a_simulation_goes_on() {
    let model = Model::new(sheet(), Rubber::new(Law::Linear, 1e6));
    let model = model.clamp(|[_, y]| y < 6e-3).displace(|[_, y]| y > 34e-3, [0.0, 1e-3]);
    let mut simulation = model.build().unwrap();
    simulation.solve(Lbfgs::default()).unwrap();
    simulation.factors.push(2.0);
    simulation.solve(Lbfgs::default()).unwrap();
    let [once, twice] = simulation.history() else { panic!("two steps") };
    // nearly linear at strains of 4 and 7 %
    let ratio = twice.load / once.load;
    assert!((1.9..2.1).contains(&ratio), "{ratio}");
    simulation.state = State::new(simulation.bonds.sites());
    simulation.solve(VelocityVerlet { records: 2, ..VelocityVerlet::new(1000.0, 1e-3) }).unwrap();
    assert_eq!(simulation.history().len(), 2);
}

/// A crack opens correctly with a material from outside the crate.
#[test]
fn any_material() {
    let solid = LinearSolid { bulk: 9e6.into(), shear: 1e6.into() };
    let model = Model::new(sheet(), solid).clamp(|[_, y]| y < 6e-3).displace(|[_, y]| y > 34e-3, [0.0, 1e-3]);
    let mut simulation = model.build().unwrap();
    simulation.solve(Lbfgs::default()).unwrap();
    let opening = |x: f64| {
        let near = |at: [f64; 2], y: f64| (at[0] - x).abs() < 1.1e-3 && (at[1] - y).abs() < 1.1e-3;
        let moved =
            |y: f64| simulation.displacements().find(|(at, _)| near(*at, y)).map_or(f64::NAN, |(_, u)| u[1]);
        moved(21e-3) - moved(19e-3)
    };
    assert!(opening(1e-3) > 3.0 * opening(23e-3), "{} {}", opening(1e-3), opening(23e-3));
}

/// A law of the caller at any scale equals the named law of its shape, and so does the stretch of a fracture
/// energy.
#[test]
fn a_law_of_the_caller() {
    struct Springs(f64);
    impl BondPotential for Springs {
        fn tension(&self, stretch: f64) -> f64 {
            self.0 * (stretch - 1.0)
        }
        fn tension_derivative(&self, _: f64) -> f64 {
            self.0
        }
        fn energy(&self, stretch: f64) -> f64 {
            0.5 * self.0 * (stretch - 1.0).powi(2)
        }
    }
    let torn = |rubber: Rubber| {
        let model = Model::new(sheet(), rubber.fracture_energy(500.0)).clamp(|[_, y]| y < 6e-3);
        let mut simulation = model.displace(|[_, y]| y > 34e-3, [0.0, 12e-3]).steps(4).build().unwrap();
        simulation.solve(Lbfgs::default()).unwrap();
        simulation
    };
    let (ours, theirs) = (torn(Rubber::with_law(Springs(0.7), 1e6)), torn(Rubber::new(Law::Linear, 1e6)));
    assert!(theirs.state.fracture.broken > 0);
    assert_eq!(ours.bonds.intact(), theirs.bonds.intact());
    let peak = theirs.history().iter().map(|record| record.load.abs()).fold(0.0, f64::max);
    for (a, b) in ours.history().iter().zip(theirs.history()) {
        // the torn sheet is free of load: what is left is a residual, and is judged by the peak
        let allowed = 1e-8 * b.load.abs() + 1e-8 * peak;
        assert!((a.load - b.load).abs() <= allowed, "{} {}", a.load, b.load);
    }
    let slack = Model::new(sheet(), Rubber::with_law(Springs(0.0), 1e6)).build();
    let message = slack.err().map(|error| error.to_string()).unwrap_or_default();
    assert!(message.starts_with("t′(1) of the bond law: found 0"), "{message}");
}

/// A homogeneous stretch of a sheet of long chains has the stress of an incompressible neo-Hookean solid,
/// σᵢ = μ(λᵢ² − λ₃²), in every particle.
#[test]
fn stress_of_a_solid() {
    let (shear, [a, b]) = (0.4e6, [1.2_f64, 0.9_f64]);
    let law = |space| EightChainSolid::new(space, shear, 1e6, f64::INFINITY);
    let body = || Body::lattice(Shape::rectangle([0.0; 2], [10e-3, 8e-3]), 1e-3).plane_stress(1e-3);
    let mut simulation = Model::new(body(), law(Space::PlaneStress).unwrap()).build().unwrap();
    let moved: Vec<_> =
        simulation.displacements().map(|([x, y], _)| [(a - 1.0) * x, (b - 1.0) * y]).collect();
    for (&site, moved) in simulation.bonds.particles().to_vec().iter().zip(moved) {
        simulation.state.displacement.set(site as usize, moved);
    }
    let thickness = 1.0 / (a * b);
    let expected = [a, b].map(|stretch| shear * (stretch * stretch - thickness * thickness));
    for stress in simulation.cauchy().unwrap() {
        for d in 0..2 {
            assert!((stress[d][d] / expected[d] - 1.0).abs() < 1e-5, "{stress:?}, {expected:?} Pa");
        }
    }
    simulation.state.fracture.broken = 1;
    let fault = simulation.piola().unwrap_err().to_string();
    assert!(fault.starts_with("broken bonds: found 1; allowed: 0"), "{fault}");
    let slab = Model::new(body().plane_strain(1e-3), law(Space::PlaneStress).unwrap()).build();
    let fault = slab.map(|_| ()).unwrap_err().to_string();
    assert_eq!(fault, "law: found PlaneStress; allowed: PlaneStrain, that of the body");
}

#[test]
fn faults_are_named() {
    let fault = |model: Model<2, Rubber>| match model.build() {
        Err(error @ (Error::Geometry(_) | Error::Parameter { .. })) => error.to_string(),
        other => panic!("{:?}", other.map(|_| ()).map_err(|error| error.to_string())),
    };
    let model = |body, youngs_modulus| Model::new(body, Rubber::new(Law::ChainOffset, youngs_modulus));
    let empty = model(sheet(), 1e6).clamp(|[_, y]| y < 6e-3).clamp(|[_, y]| y > 1.0);
    assert_eq!(fault(empty), "region 2 of the loads has no particle");
    assert_eq!(fault(model(sheet(), 0.0)), "Young's modulus: found 0; allowed: above 0, finite");
    assert!(fault(model(sheet().plane_stress(f64::NAN), 1e6)).starts_with("thickness: found NaN"));
    assert!(fault(model(Body::lattice(Shape::disk([0.0; 2], 1e-3), -1.0), 1e6)).starts_with("spacing"));
    let brittle = Rubber::new(Law::ChainOffset, 1e6).fracture_energy(-1.0);
    assert!(fault(Model::new(sheet(), brittle)).contains("fracture_energy"));
    assert!(fault(model(sheet(), 1e6).contact(-1.0)).starts_with("contact.stiffness"));
}
