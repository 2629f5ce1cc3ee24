//! Births conserve energy, and lumped capacity never overshoots.

use crate::bodies::{PA12, conductor, everywhere, film, grid, held, pa12, radiation, run};
use crystfem::boundary::{FaceSelection, Field};
use crystfem::problem::{Birth, Capacity, Problem};
use crystfem::simulation::{Settings, Simulation};
use crystfem::time::Scheme;

const HOT: f64 = 493.15;
const COLD: f64 = 353.15;

/// Creates four layers of one element on a block of glass, one every 8 s, with film and radiation on the
/// outer surface and a fixed bottom temperature.
fn printing_moves(latent_heat: Option<f64>, elements: usize) -> Problem {
    let (layers, glass) = (4, 3);
    let mesh = grid([4e-3, 2e-3, 3.5e-3], [2 * elements, elements, layers + glass]);
    let plane = 2 * elements * elements;
    let bottom = mesh.surfaces["bottom"].clone();
    let surface = || FaceSelection::Outer { except: bottom.clone() };
    let births = (0..layers)
        .map(|layer| Birth {
            time: 8.0 * layer as f64,
            elements: (((layer + glass) * plane) as u32..((layer + glass + 1) * plane) as u32).collect(),
            temperature: HOT,
        })
        .collect();
    Problem {
        materials: vec![conductor([1.0, 2500.0, 800.0]), pa12(latent_heat)],
        material_of: (0..(layers + glass) * plane).map(|e| u16::from(e >= glass * plane)).collect(),
        conditions: vec![
            held(&mesh, "bottom", Field::constant(COLD)),
            film(surface(), 15.0, 300.0),
            radiation(surface(), 0.9, 300.0),
        ],
        births,
        ..Problem::new(mesh, conductor(PA12), COLD)
    }
}

#[test]
fn a_printed_bar_balances_its_energy() {
    for scheme in [Scheme::BackwardEuler, Scheme::TrBdf2] {
        for latent_heat in [None, Some(209e3)] {
            let problem = printing_moves(latent_heat, 2);
            let settings = Settings { scheme, ..Settings::adaptive(0.01) };
            let mut simulation = Simulation::new(problem, settings).unwrap();
            let steps = run(&mut simulation, 40.0);
            let ledger = simulation.state().ledger;
            println!("{scheme:?} {latent_heat:?}: {ledger:?} {:?}", simulation.state().work);
            assert!(ledger.worst < 1e-10, "{ledger:?}");
            // four layers at 220 °C of 4 × 2 × 0.5 mm³ each
            let supplied = 4.0 * 4e-9 * PA12[1] * PA12[2] * HOT;
            if latent_heat.is_none() {
                assert!((ledger.birth / supplied - 1.0).abs() < 1e-12, "{ledger:?}, {supplied}");
            }
            let balance = ledger.stored - ledger.birth - ledger.exchange.total() - ledger.reaction;
            assert!(balance.abs() < 1e-10 * supplied, "{balance}");
            for time in [8.0, 16.0, 24.0, 40.0] {
                assert!(steps.iter().any(|step| step.time == time), "no step ends at {time} s");
            }
            for temperature in simulation.temperatures(COLD) {
                assert!((300.0..=HOT).contains(&temperature), "{temperature}");
            }
        }
    }
}

/// An insulated layer of a single element keeps its heat. CalculiX, whose interface nodes keep their old
/// temperature, loses half of it (formulation.md).
#[test]
fn an_insulated_layer_keeps_all_of_its_heat() {
    for capacity in [Capacity::Lumped, Capacity::Consistent] {
        let mesh = grid([1e-3; 3], [1, 1, 2]);
        let problem = Problem {
            births: vec![Birth { time: 1.0, elements: vec![1], temperature: HOT }],
            capacity,
            ..Problem::new(mesh, conductor(PA12), COLD)
        };
        let mut simulation = Simulation::new(problem, Settings::backward_euler(1.0)).unwrap();
        run(&mut simulation, 1.0);
        assert!(!simulation.exists(8) && simulation.temperature(8).is_none());
        run(&mut simulation, 1001.0);
        assert!(simulation.exists(8));
        for temperature in simulation.temperatures(0.0) {
            assert!((temperature - 0.5 * (HOT + COLD)).abs() < 1e-6, "{temperature}");
        }
        assert!(simulation.state().ledger.worst < 1e-10, "{:?}", simulation.state().ledger);
    }
}

/// At Fo = 0.056, below the 1/6 that consistent capacity needs, the second node beyond the interface
/// overshoots: the first step along a line solves c e_{i−1} + d e_i + c e_{i+1} = 0 with c = 1/6 − Fo,
/// d = 2/3 + 2 Fo, e_i ~ λ^i, λ < 0. (formulation.md has +1.75 K for a scene that it does not describe.)
#[test]
fn overshoot_at_birth() {
    let overshoot = |capacity| {
        let h = 1e-3;
        let mesh = grid([20.0 * h, h, h], [20, 1, 1]);
        let problem = Problem {
            births: vec![Birth { time: 0.0, elements: (10..20).collect(), temperature: HOT }],
            capacity,
            ..Problem::new(mesh, conductor(PA12), COLD)
        };
        let dt = 0.056 * h * h * PA12[1] * PA12[2] / PA12[0];
        let mut simulation = Simulation::new(problem, Settings::backward_euler(dt)).unwrap();
        run(&mut simulation, dt);
        simulation.temperatures(0.0).into_iter().fold(0.0, f64::max) - HOT
    };
    let (lumped, consistent) = (overshoot(Capacity::Lumped), overshoot(Capacity::Consistent));
    println!("overshoot: lumped {lumped}, consistent {consistent}");
    let (c, d) = (1.0 / 6.0 - 0.056, 2.0 / 3.0 + 2.0 * 0.056);
    let lambda = (-d + f64::sqrt(d * d - 4.0 * c * c)) / (2.0 * c);
    // the interface has the mean of both sides
    let exact = -0.5 * (HOT - COLD) * 0.056 / (d + c * lambda) * lambda;
    assert!(lumped <= 1e-7 && (consistent - exact).abs() < 1e-5, "{lumped}, {consistent}, {exact}");
}

/// Latent heat in the mixture: crystals of the lower layer melt at contact with the new layer, and both
/// supply the heat.
#[test]
fn birth_on_crystals_melts_them_and_balances() {
    let problem = printing_moves(Some(209e3), 1);
    let mut simulation = Simulation::new(problem, Settings::adaptive(0.01)).unwrap();
    run(&mut simulation, 8.0);
    let before = simulation.state().clone();
    run(&mut simulation, 8.001);
    let after = simulation.state();
    assert!(after.ledger.birth > before.ledger.birth);
    assert!(after.ledger.worst < 1e-10, "{:?}", after.ledger);
}

/// An empty birth, simultaneous births, and a birth of all elements.
#[test]
fn unusual_births() {
    let mesh = grid([3e-3, 1e-3, 1e-3], [3, 1, 1]);
    let birth =
        |time, elements: &[u32], temperature| Birth { time, elements: elements.to_vec(), temperature };
    let problem = Problem {
        births: vec![
            birth(0.0, &[0], 400.0),
            birth(0.0, &[], 300.0),
            birth(0.0, &[1], 450.0),
            birth(2.0, &[2], 300.0),
        ],
        conditions: vec![film(everywhere(), 10.0, 300.0)],
        ..Problem::new(mesh, conductor(PA12), COLD)
    };
    let mut simulation = Simulation::new(problem.clone(), Settings::adaptive(0.1)).unwrap();
    // the node between both elements has the mean
    let middle = simulation.problem().mesh.points.iter().position(|p| p[0] == 1e-3).unwrap();
    assert!((simulation.temperature(middle as u32).unwrap() - 425.0).abs() < 1e-10);
    assert!(simulation.is_born(1) && !simulation.is_born(2));
    run(&mut simulation, 10.0);
    assert!(simulation.is_born(2) && simulation.state().ledger.worst < 1e-10);

    // without elements before the first birth, time still advances
    let late = Problem { births: vec![birth(3.0, &[0, 1, 2], 400.0)], ..problem.clone() };
    let mut simulation = Simulation::new(late, Settings::adaptive(0.1)).unwrap();
    run(&mut simulation, 2.0);
    assert!(simulation.temperatures(-1.0).iter().all(|&t| t == -1.0));
    run(&mut simulation, 4.0);
    assert!(simulation.temperatures(-1.0).iter().all(|&t| (300.0..=400.0).contains(&t)));

    for (births, message) in [
        (vec![birth(1.0, &[0], 400.0), birth(0.5, &[1], 400.0)], "or later"),
        (vec![birth(1.0, &[0], -1.0)], "0 K or above"),
        (vec![birth(1.0, &[0, 0], 400.0)], "born twice"),
        (vec![birth(1.0, &[3], 400.0)], "below 3"),
        (vec![birth(f64::NAN, &[0], 400.0)], "finite"),
    ] {
        let wrong = Problem { births, ..problem.clone() };
        let error = Simulation::new(wrong, Settings::adaptive(0.1)).err().unwrap().to_string();
        assert!(error.contains(message), "{error}");
    }
}
