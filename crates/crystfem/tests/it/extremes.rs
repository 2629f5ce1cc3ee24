//! Stiff and extreme problems: no NaN, and balanced energy.

use crate::bodies::{PA12, conductor, everywhere, film, grid, held, pa12, radiation, run};
use crystfem::boundary::{Field, HeatSource};
use crystfem::exact::Wall;
use crystfem::mesh::Mesh;
use crystfem::problem::Problem;
use crystfem::simulation::{Settings, Simulation};

fn balanced(simulation: &Simulation) {
    let ledger = simulation.state().ledger;
    assert!(ledger.worst < 1e-10, "{ledger:?}");
    assert!(simulation.temperatures(0.0).iter().all(|t| t.is_finite() && *t >= 0.0));
}

/// Glass and powder, conductivity 1e8 : 1, in one step of 1e9 s and in small ones; the powder takes the whole
/// gradient.
#[test]
fn conductivity_contrast() {
    let mesh = grid([0.01, 0.004, 0.004], [10, 4, 4]);
    let material_of = (0..mesh.element_count()).map(|e| u16::from(e % 10 >= 5)).collect();
    let problem = Problem {
        materials: vec![conductor([1e6, 2500.0, 800.0]), conductor([1e-2, 500.0, 1000.0])],
        material_of,
        conditions: vec![
            held(&mesh, "left", Field::constant(300.0)),
            held(&mesh, "right", Field::constant(400.0)),
        ],
        ..Problem::new(mesh, conductor(PA12), 300.0)
    };
    for dt in [1e9, 1.0] {
        let mut simulation = Simulation::new(problem.clone(), Settings::backward_euler(dt)).unwrap();
        run(&mut simulation, 3.0 * dt);
        balanced(&simulation);
        println!("contrast, {dt} s: {:?}", simulation.state().work);
        if dt > 1.0 {
            for (place, found) in simulation.problem().mesh.points.iter().zip(simulation.temperatures(0.0)) {
                let exact = 300.0 + 100.0 * ((place[0] - 0.005) / 0.005).max(0.0);
                // 1e-8 of the drop is in the glass; rounding of 300 K in a matrix with entries 1e8 apart
                assert!((found - exact).abs() < 1e-4, "{found}, {exact}");
            }
        }
    }
}

/// Bi = hL/k from 1e-6 to 1e6: insulated face of a wall against the series.
#[test]
fn biot_numbers() {
    let (length, diffusivity) = (5e-3, PA12[0] / (PA12[1] * PA12[2]));
    for exponent in [-6, -3, 0, 3, 6] {
        let biot = 10.0_f64.powi(exponent);
        let mesh = grid([length, 2e-4, 2e-4], [25, 1, 1]);
        let surface = crystfem::boundary::FaceSelection::Faces(mesh.surfaces["right"].clone());
        let problem = Problem {
            conditions: vec![film(surface, biot * PA12[0] / length, 353.15)],
            ..Problem::new(mesh, conductor(PA12), 493.15)
        };
        let fourier = 0.5 * (1.0 + 1.0 / biot).min(10.0);
        let end = fourier * length * length / diffusivity;
        let steps = Settings::adaptive(1e-3);
        let mut simulation = Simulation::new(problem, steps).unwrap();
        run(&mut simulation, end);
        balanced(&simulation);
        let share = (simulation.temperature(0).unwrap() - 353.15) / 140.0;
        // (πh/L)²/24 in space, 0.1 K per step in time
        let exact = Wall { biot }.share(0.0, fourier);
        println!("Bi {biot}: {share}, {exact}, {:?}", simulation.state().work);
        assert!((share - exact).abs() < 5e-3, "Bi = {biot}: {share}, {exact}");
    }
}

/// Radiation to 0 K: T = (T_i⁻³ + 3ct)^{−1/3} for a body of uniform temperature, over 1e12 s, and never below
/// 0 K.
#[test]
fn radiation_to_nothing() {
    let problem = Problem {
        conditions: vec![radiation(everywhere(), 1.0, 0.0)],
        ..Problem::new(grid([1e-3; 3], [2; 3]), conductor([400.0, 1000.0, 1000.0]), 3000.0)
    };
    let mut simulation = Simulation::new(problem.clone(), Settings::adaptive(1e-3)).unwrap();
    run(&mut simulation, 1e12);
    balanced(&simulation);
    let c = 5.670_374_419e-8 * 6.0 / 1e-3 / 1e6;
    let exact = (3000.0_f64.powi(-3) + 3.0 * c * 1e12).powf(-1.0 / 3.0);
    println!("radiation: {}, {exact}, {:?}", simulation.temperature(0).unwrap(), simulation.state().work);
    assert!((simulation.temperature(0).unwrap() - exact).abs() < 0.5, "{exact}");
    // one step for the whole time
    let mut simulation = Simulation::new(problem, Settings::backward_euler(1e12)).unwrap();
    run(&mut simulation, 1e12);
    balanced(&simulation);
    assert!(simulation.temperature(0).unwrap() < 100.0);
}

/// A body without boundary conditions: the temperature becomes uniform, and the energy is constant.
#[test]
fn a_floating_body() {
    for dt in [0.1, 1e9] {
        let mesh = grid([0.01; 3], [6; 3]);
        let problem = Problem {
            initial: Field::function(|x, _| if x[0] < 0.005 { 400.0 } else { 300.0 }),
            ..Problem::new(mesh, conductor(PA12), 0.0)
        };
        let mut simulation = Simulation::new(problem, Settings::backward_euler(dt)).unwrap();
        let mean = |simulation: &Simulation| {
            let weight = |x: f64| if (1e-9..0.01 - 1e-9).contains(&x) { 1.0 } else { 0.5 };
            let points = &simulation.problem().mesh.points;
            let sums = points.iter().zip(simulation.temperatures(0.0)).fold([0.0; 2], |[w, s], (p, t)| {
                let weight: f64 = p.iter().map(|&x| weight(x)).product();
                [w + weight, s + weight * t]
            });
            sums[1] / sums[0]
        };
        let before = mean(&simulation);
        run(&mut simulation, 10.0 * dt);
        balanced(&simulation);
        // rounding of 400 K in ten steps
        assert!((mean(&simulation) - before).abs() < 1e-11, "{before}, {}", mean(&simulation));
        if dt > 1.0 {
            assert!(simulation.temperatures(0.0).iter().all(|t| (t - before).abs() < 1e-6));
        }
    }
}

/// One heated element of each kind: T = T₀ + rt/ρc.
#[test]
fn one_element() {
    let tetrahedron = Mesh {
        points: vec![[0.0; 3], [1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0], [0.0, 0.0, 1e-3]],
        tetrahedra: vec![[0, 1, 2, 3]],
        ..Mesh::default()
    };
    for mesh in [grid([1e-3; 3], [1; 3]), tetrahedron] {
        for settings in [Settings::adaptive(1.0), Settings::backward_euler(1e9)] {
            let problem = Problem {
                sources: vec![HeatSource { elements: vec![0], power: Field::constant(1e-4) }],
                ..Problem::new(mesh.clone(), conductor(PA12), 300.0)
            };
            let mut simulation = Simulation::new(problem, settings).unwrap();
            run(&mut simulation, 2e9);
            balanced(&simulation);
            let exact = 300.0 + 1e-4 * 2e9 / (PA12[1] * PA12[2]);
            for found in simulation.temperatures(0.0) {
                assert!((found - exact).abs() < 1e-8, "{found}, {exact}");
            }
        }
    }
}

/// PA12 with latent heat from melt to 280 K within one step of 1e9 s, and with a film of Bi = 1e6.
#[test]
fn crystallization_in_one_step() {
    for (coefficient, dt) in [(10.0, 1e9), (1e6, 1e9), (1e6, 1e-3), (10.0, 10.0)] {
        let problem = Problem {
            conditions: vec![film(everywhere(), coefficient, 280.0)],
            ..Problem::new(grid([4e-3; 3], [4; 3]), pa12(Some(209e3)), 493.15)
        };
        let mut simulation = Simulation::new(problem, Settings::backward_euler(dt)).unwrap();
        run(&mut simulation, 5.0 * dt);
        balanced(&simulation);
        println!("h = {coefficient}, {dt} s: {:?}", simulation.state().work);
        assert!(simulation.temperatures(0.0).iter().all(|t| (280.0 - 1e-6..493.16).contains(t)));
    }
}

/// Invalid problems are refused with their reason.
#[test]
fn refusals() {
    let good = Problem::new(grid([1e-3; 3], [2; 3]), conductor(PA12), 300.0);
    let message = |problem: Problem, settings: Settings| {
        Simulation::new(problem, settings).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let euler = Settings::backward_euler(1.0);
    let mut inverted = good.clone();
    inverted.mesh.hexahedra[3].swap(0, 4);
    assert!(message(inverted, euler).contains("element 3"));
    let mut sliver = good.clone();
    for point in &mut sliver.mesh.points {
        point[2] = 0.0;
    }
    assert!(message(sliver, euler).contains("inverted, flat or folded"));
    let mut node = good.clone();
    node.mesh.hexahedra[1][2] = 99;
    assert!(message(node, euler).contains("found node 99"));
    assert!(message(Problem { material_of: vec![0; 3], ..good.clone() }, euler).contains("3 elements"));
    assert!(message(Problem { material_of: vec![1; 8], ..good.clone() }, euler).contains("material 1"));
    assert!(
        message(Problem { mesh: Mesh::default(), material_of: vec![], ..good.clone() }, euler)
            .contains("no element")
    );
    let initial = Field::constant(-1.0);
    assert!(message(Problem { initial, ..good.clone() }, euler).contains("initial temperature"));
    assert!(message(good.clone(), Settings::backward_euler(0.0)).contains("time step"));
    assert!(message(good.clone(), Settings::backward_euler(f64::NAN)).contains("time step"));
    assert!(message(good.clone(), Settings { tolerance: -1.0, ..euler }).contains("tolerance"));
    let source = HeatSource { elements: vec![8], power: Field::constant(1.0) };
    assert!(message(Problem { sources: vec![source], ..good.clone() }, euler).contains("element 8"));
    let mut simulation = Simulation::new(good, euler).unwrap();
    run(&mut simulation, 1.0);
    for wrong in [0.5, f64::NAN, f64::INFINITY] {
        let error = simulation.advance(wrong, &mut |_, _| std::ops::ControlFlow::Continue(())).err().unwrap();
        assert!(error.to_string().contains("end time"), "{error}");
    }
}
