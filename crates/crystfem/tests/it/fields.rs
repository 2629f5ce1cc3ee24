//! Crystallinity in bodies.

use crate::bodies::{PA12, conductor, film, grid, pa12, run};
use crystfem::boundary::{Condition, FaceSelection, Field, Schedule};
use crystfem::problem::{Capacity, Problem};
use crystfem::simulation::{Settings, Simulation};

/// Half glass, half PA12, cooled slowly: glass has no crystallinity, PA12 a uniform one, with points at nodes
/// (lumped capacity) and in elements (consistent capacity, latent heat).
#[test]
fn crystallinity_of_half_a_body() {
    for (capacity, latent_heat) in
        [(Capacity::Lumped, None), (Capacity::Lumped, Some(209e3)), (Capacity::Consistent, Some(209e3))]
    {
        let mesh = grid([4e-4, 1e-4, 1e-4], [4, 1, 1]);
        let conditions = vec![film(FaceSelection::Outer { except: Vec::new() }, 2.0, 293.15)];
        let problem = Problem {
            materials: vec![conductor(PA12), pa12(latent_heat)],
            material_of: vec![0, 0, 1, 1],
            conditions,
            capacity,
            ..Problem::new(mesh, conductor(PA12), 493.15)
        };
        let mut simulation = Simulation::new(problem, Settings::adaptive(0.1)).unwrap();
        assert_eq!(simulation.field_names(), ["alpha", "crystallinity"]);
        run(&mut simulation, 200.0);
        let [alpha, crystallinity] = ["alpha", "crystallinity"].map(|name| simulation.field(name));
        for ((place, alpha), crystallinity) in
            simulation.problem().mesh.points.iter().zip(&alpha).zip(crystallinity)
        {
            assert_eq!(alpha.is_none(), place[0] < 1.9e-4);
            if let (Some(alpha), Some(crystallinity)) = (alpha, crystallinity) {
                // the temperature in 0.4 mm is uniform within 1e-2 K
                assert!(
                    (0.5..=1.0).contains(alpha) && (crystallinity - 0.25 * alpha).abs() < 1e-12,
                    "{alpha}"
                );
            }
        }
        let known = alpha.iter().copied().flatten();
        assert!(known.clone().fold(0.0, f64::max) - known.fold(1.0, f64::min) < 4e-3);
    }
}

/// All nodes cooled at 1, 2, 10 K/min: α = 0.5 at the temperatures in formulation.md, ± 0.02 K. The material
/// limits the steps, because the temperature has no temporal error.
#[test]
fn cooling_rates() {
    for (rate, half) in [(1.0, 162.05), (2.0, 159.77), (10.0, 152.77)] {
        let mesh = grid([1e-3; 3], [1; 3]);
        let slope = rate / 60.0;
        let end = (473.15 - 373.15) / slope;
        let value = Field::Uniform(Schedule::linear(&[(0.0, 473.15), (end, 373.15)]).unwrap());
        let conditions = vec![Condition::Temperature { nodes: (0..8).collect(), value }];
        let problem = Problem { conditions, ..Problem::new(mesh, pa12(None), 473.15) };
        let mut simulation = Simulation::new(problem, Settings::adaptive(0.1)).unwrap();
        let alpha = |simulation: &Simulation| simulation.field("alpha")[0].unwrap();
        for (offset, above) in [(0.02, false), (-0.02, true)] {
            run(&mut simulation, (473.15 - (half + 273.15 + offset)) / slope);
            assert_eq!(alpha(&simulation) > 0.5, above, "{rate} K/min: {}", alpha(&simulation));
        }
        let work = simulation.state().work;
        println!("{rate} K/min: {work:?}");
        assert!(work.steps < 60, "{work:?}");
    }
}
