//! The verification problems of formulation.md, chapter 4, to their stated digits by Richardson's extrapolation, and
//! with the order that it needs.

use crate::bodies::{PA12, conductor, everywhere, film, grid, held, radiation, run};
use crystfem::boundary::{Field, Where};
use crystfem::exact::{Freezing, steady_wall};
use crystfem::material::{Conductor, Property};
use crystfem::mesh::Mesh;
use crystfem::problem::{Birth, Problem};
use crystfem::simulation::{Settings, Simulation};
use crystfem::time::{Scheme, Steps};
use std::sync::Arc;

const HOT: f64 = 493.15;
const COLD: f64 = 353.15;

/// A line of cubes along x.
fn line(length: f64, elements: usize) -> Mesh {
    let h = length / elements as f64;
    grid([length, h, h], [elements, 1, 1])
}

fn precise(tolerance: f64) -> Settings {
    let steps = Steps::Adaptive { tolerance, first: 1e-4, smallest: 1e-9, largest: 1e9 };
    Settings { scheme: Scheme::TrBdf2, steps, ..Settings { tolerance: 1e-9, ..Settings::adaptive(1.0) } }
}

/// Temperature at x on meshes of h, h/2, h/4; the value extrapolated in h² and h⁴, and the observed order.
fn extrapolate(values: [f64; 3]) -> (f64, f64) {
    let order = ((values[0] - values[1]) / (values[1] - values[2])).abs().log2();
    ((64.0 * values[2] - 20.0 * values[1] + values[0]) / 45.0, order)
}

fn at(simulation: &Simulation, x: f64) -> f64 {
    let near = |p: &[f64; 3]| (p[0] - x).abs() < 1e-9;
    let node = simulation.problem().mesh.points.iter().position(near).unwrap();
    simulation.temperature(node as u32).unwrap()
}

#[test]
fn a_half_space_with_its_surface_held() {
    let (found, order) = extrapolate([80, 160, 320].map(|elements| {
        let mesh = line(0.016, elements);
        let conditions = vec![held(&mesh, "left", Field::constant(COLD))];
        let problem = Problem { conditions, ..Problem::new(mesh, conductor(PA12), HOT) };
        let mut simulation = Simulation::new(problem, precise(1e-7)).unwrap();
        run(&mut simulation, 20.0);
        at(&simulation, 2e-3)
    }));
    println!("held: {found}, order {order}");
    assert!((found - 444.737_621).abs() < 1e-5 && (order - 2.0).abs() < 0.1, "{found}, order {order}");
}

#[test]
fn a_half_space_with_film() {
    let (found, order) = extrapolate([80, 160, 320].map(|elements| {
        let mesh = line(0.016, elements);
        let conditions = vec![film(Where::Faces(mesh.surfaces["left"].clone()), 50.0, COLD)];
        let problem = Problem { conditions, ..Problem::new(mesh, conductor(PA12), HOT) };
        let mut simulation = Simulation::new(problem, precise(1e-6)).unwrap();
        run(&mut simulation, 20.0);
        at(&simulation, 2e-3)
    }));
    println!("film: {found}, order {order}");
    assert!((found - 483.955_143).abs() < 1e-5 && (order - 2.0).abs() < 0.1, "{found}, order {order}");
}

/// A layer of melt is born on glass (k = 1 W/mK, 2500 kg/m³, 800 J/kgK): the contact keeps one temperature.
#[test]
fn a_layer_on_glass() {
    let found = [20, 40, 80].map(|elements| {
        let mesh = line(0.064, 4 * elements);
        let half = 2 * elements as u32;
        let birth = Birth { time: 0.0, elements: (half..2 * half).collect(), temperature: HOT };
        let problem = Problem {
            materials: vec![conductor([1.0, 2500.0, 800.0]), conductor(PA12)],
            material_of: (0..2 * half).map(|e| u16::from(e >= half)).collect(),
            births: vec![birth],
            ..Problem::new(mesh, conductor(PA12), COLD)
        };
        let mut simulation = Simulation::new(problem, precise(1e-6)).unwrap();
        run(&mut simulation, 20.0);
        assert!(simulation.state().ledger.worst < 1e-10, "{:?}", simulation.state().ledger);
        at(&simulation, 0.032)
    });
    let (extrapolated, order) = extrapolate(found);
    println!("contact: {found:?}, {extrapolated}, order {order}");
    assert!((extrapolated - 401.468_158).abs() < 5e-4, "{found:?}, {extrapolated}, order {order}");
    assert!((found[2] - 401.468_158).abs() < 0.02, "{found:?}");
}

/// A 5 mm cube that radiates, ε = 0.9: one element keeps one temperature.
#[test]
fn a_radiating_cube() {
    for (ambient, exact) in [(COLD, 357.811_561), (0.0, f64::NAN)] {
        let conditions = vec![radiation(everywhere(), 0.9, ambient)];
        let problem = Problem { conditions, ..Problem::new(grid([5e-3; 3], [1; 3]), conductor(PA12), HOT) };
        let mut simulation = Simulation::new(problem, precise(1e-8)).unwrap();
        run(&mut simulation, 600.0);
        let found = simulation.temperature(0).unwrap();
        let exact = if ambient > 0.0 {
            exact
        } else {
            // (T_i⁻³ + 3ct)^{−1/3}, c = εσA/(ρcV)
            let c = 0.9 * 5.670_374_419e-8 * 6.0 / 5e-3 / (PA12[1] * PA12[2]);
            (HOT.powi(-3) + 3.0 * c * 600.0).powf(-1.0 / 3.0)
        };
        println!("radiation: {found}, {exact}, {:?}", simulation.state().work);
        // 1e-8 K for each of two thousand steps
        assert!((found - exact).abs() < 1e-5, "{found}, {exact}");
        assert!(simulation.state().ledger.worst < 1e-10);
    }
}

/// A wall with Bi = 1 at Fo = 0.5: its insulated face.
#[test]
fn a_wall_with_film() {
    let diffusivity = PA12[0] / (PA12[1] * PA12[2]);
    let length = 5e-3;
    let (found, order) = extrapolate([8, 16, 32].map(|elements| {
        let mesh = line(length, elements);
        let conditions = vec![film(Where::Faces(mesh.surfaces["right"].clone()), PA12[0] / length, COLD)];
        let problem = Problem { conditions, ..Problem::new(mesh, conductor(PA12), HOT) };
        let mut simulation = Simulation::new(problem, precise(1e-7)).unwrap();
        run(&mut simulation, 0.5 * length * length / diffusivity);
        (at(&simulation, 0.0) - COLD) / (HOT - COLD)
    }));
    println!("wall: {found}, order {order}");
    assert!((found - 0.772_526_383).abs() < 1e-8 && (order - 2.0).abs() < 0.1, "{found}, order {order}");
}

/// Freezing with equal properties of solid and melt, L = 52.25 kJ/kg at 450 K: λ = 0.628718116, as a peak of the
/// specific heat 2w wide. The error falls with w and h.
#[test]
fn freezing() {
    let diffusivity = PA12[0] / (PA12[1] * PA12[2]);
    let exact = Freezing {
        conductivity: [PA12[0]; 2],
        diffusivity: [diffusivity; 2],
        specific_heat: PA12[2],
        latent_heat: 52.25e3,
        melting: 450.0,
        initial: HOT,
        surface: COLD,
    };
    assert!((exact.root() - 0.628_718_116).abs() < 1e-9);
    let errors = [(60, 4.0), (120, 2.0), (240, 1.0)].map(|(elements, width)| {
        let mesh = line(0.018, elements);
        let conditions = vec![held(&mesh, "left", Field::constant(COLD))];
        let peak = PA12[2] + exact.latent_heat / width;
        let heat = Property::table(
            "c",
            vec![450.0 - 1.0001 * width, 450.0 - width, 450.0, 450.0 + width, 450.0 + 1.0001 * width],
            vec![PA12[2], PA12[2], peak, PA12[2], PA12[2]],
        )
        .unwrap();
        let material = Conductor::new(PA12[1], Property::constant("k", PA12[0]).unwrap(), heat).unwrap();
        let problem = Problem { conditions, ..Problem::new(mesh, Arc::new(material), HOT) };
        let mut simulation = Simulation::new(problem, Settings { tolerance: 1e-7, ..precise(0.02) }).unwrap();
        run(&mut simulation, 20.0);
        let work = simulation.state().work;
        assert!(simulation.state().ledger.worst < 1e-10, "{:?}", simulation.state().ledger);
        let points = &simulation.problem().mesh.points;
        let squares = points.iter().zip(simulation.temperatures(0.0)).filter(|(p, _)| p[0] < 6e-3);
        let count = squares.clone().count() as f64;
        let error =
            (squares.map(|(p, t)| (t - exact.temperature(p[0], 20.0)).powi(2)).sum::<f64>() / count).sqrt();
        println!("freezing {elements} {width}: error {error} K, {work:?}");
        error
    });
    assert!(errors[2] < 0.4 && errors[2] < 0.65 * errors[1] && errors[1] < 0.65 * errors[0], "{errors:?}");
}

/// k = k₀ (1 + b (T − T₀)) between held faces: Kirchhoff's closed form.
#[test]
fn conductivity_that_follows_temperature() {
    let slope = 5e-3;
    let k = |t: f64| PA12[0] * (1.0 + slope * (t - COLD));
    let table = Property::table("k", vec![COLD, HOT], vec![k(COLD), k(HOT)]).unwrap();
    let errors = [8, 16, 32].map(|elements| {
        let mesh = line(0.01, elements);
        let conditions =
            vec![held(&mesh, "left", Field::constant(COLD)), held(&mesh, "right", Field::constant(HOT))];
        let material =
            Conductor::new(PA12[1], table.clone(), Property::constant("c", PA12[2]).unwrap()).unwrap();
        let problem = Problem { conditions, ..Problem::new(mesh, Arc::new(material), 400.0) };
        let mut simulation = Simulation::new(problem, Settings::backward_euler(1e8)).unwrap();
        run(&mut simulation, 4e8);
        println!("{:?}", simulation.state().work);
        (at(&simulation, 2.5e-3) - steady_wall([COLD, HOT], slope, COLD, 0.25)).abs()
    });
    println!("Kirchhoff: {errors:?}");
    // exact at nodes up to the quadrature of k over an element
    assert!(errors[2] < 1e-3 && errors[2] < 0.3 * errors[1] + 1e-6, "{errors:?}");
}
