//! States that only follow the temperature are integrated for all points of a law at once, in place for steps
//! of equal length, with the same results as point by point with separate old and new states.

use crate::bodies::{PA12, conductor, film, grid, pa12, run};
use crystfem::boundary::FaceSelection;
use crystfem::error::Error;
use crystfem::material::{Filled, PointInput, ThermalMaterial, ThermalResponse};
use crystfem::problem::{Birth, Problem};
use crystfem::simulation::{Settings, Simulation, State};
use std::sync::Arc;

/// A material of a type that the solver does not know.
struct PointByPoint(Arc<dyn ThermalMaterial>);

impl ThermalMaterial for PointByPoint {
    fn density(&self) -> f64 {
        self.0.density()
    }
    fn state_names(&self) -> &'static [&'static str] {
        self.0.state_names()
    }
    fn initial_state(&self, temperature: f64, state: &mut [f64]) {
        self.0.initial_state(temperature, state);
    }
    fn field_names(&self) -> &'static [&'static str] {
        self.0.field_names()
    }
    fn fields(&self, state: &[f64], fields: &mut [f64]) {
        self.0.fields(state, fields);
    }
    fn energy(&self, temperature: f64, state: &[f64]) -> f64 {
        self.0.energy(temperature, state)
    }
    fn is_linear(&self) -> bool {
        self.0.is_linear()
    }
    fn constant_conductivity(&self) -> bool {
        self.0.constant_conductivity()
    }
    fn respond(&self, at: &PointInput, old: &[f64], new: &mut [f64]) -> Result<ThermalResponse, Error> {
        self.0.respond(at, old, new)
    }
}

/// Creates lines of five elements on an existing plate, layer by layer, of a full and a half-filled material
/// of one law, in two work items. With `latent`, a third material has latent heat.
fn path(latent: bool, wrap: impl Fn(Arc<dyn ThermalMaterial>) -> Arc<dyn ThermalMaterial>) -> Problem {
    let (side, layers, plate) = (20, 20, 10);
    let mesh = grid([10e-3, 10e-3, 10e-3], [22, side, layers]);
    let plane = 22 * side;
    let half = Arc::new(Filled::new(pa12(None), 0.5).unwrap());
    let third = pa12(latent.then_some(209e3));
    let mut births = Vec::new();
    for layer in plate..layers {
        let mut order: Vec<u32> = (layer * plane..(layer + 1) * plane).map(|e| e as u32).collect();
        if layer % 2 == 1 {
            order.sort_by_key(|e| (e % 22, *e));
        }
        for line in order.chunks(5) {
            let time = 0.02 * births.len() as f64;
            births.push(Birth { time, elements: line.to_vec(), temperature: 493.15 });
        }
    }
    let material_of = |e: usize| match e {
        e if e < plate * plane => 3,
        e if e % 7 == 0 => 1,
        e if e % 11 == 0 => 2,
        _ => 0,
    };
    Problem {
        materials: vec![wrap(pa12(None)), wrap(half), wrap(third), conductor(PA12)],
        material_of: (0..layers * plane).map(material_of).collect(),
        conditions: vec![film(FaceSelection::Outer { except: Vec::new() }, 50.0, 353.15)],
        births,
        ..Problem::new(mesh, conductor(PA12), 400.0)
    }
}

fn bits(state: &State) -> Vec<u64> {
    let memory = &state.memory.nodal;
    state.temperature.iter().chain(&memory.state).chain(&memory.energy).map(|x| x.to_bits()).collect()
}

#[test]
fn rows_agree_with_single_points() {
    for (latent, settings, kelvin) in [
        (false, Settings::backward_euler(0.02), 0.0),
        (true, Settings::backward_euler(0.02), 1e-9),
        // the requested next step equals that of points to rounding
        (false, Settings::adaptive(0.01), 1e-6),
    ] {
        let mut rows = Simulation::new(path(latent, |material| material), settings).unwrap();
        let points = path(latent, |material| Arc::new(PointByPoint(material)));
        let mut points = Simulation::new(points, settings).unwrap();
        run(&mut rows, 1.0);
        run(&mut points, 1.0);
        let (rows, points) = (rows.state(), points.state());
        let far = rows.temperature.iter().zip(&points.temperature);
        let far = far.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(far <= kelvin, "{far:e} K");
        let states = rows.memory.nodal.state.iter().zip(&points.memory.nodal.state);
        let mut grown = 0;
        for (a, b) in states {
            // rounding of 50 steps; a kelvin changes z by about a tenth
            assert!((a - b).abs() <= (1e-12 + kelvin) * b.abs().max(1e-200), "{a:e} {b:e}");
            grown += usize::from(*b > 1e-4);
        }
        println!("{latent} {far:e} K, {grown} of {}", points.memory.nodal.state.len());
        assert!(grown > 100, "{grown}");
        assert_eq!(rows.memory.nodal.energy.is_empty(), !latent);
        assert_eq!(rows.work, points.work);
    }
}

/// Results are bit-identical on any number of threads, and after restarts between births.
#[test]
fn same_bits() {
    for (latent, settings) in [
        (false, Settings::backward_euler(0.02)),
        (true, Settings::backward_euler(0.02)),
        (false, Settings::adaptive(0.01)),
    ] {
        let problem = Arc::new(path(latent, |material| material));
        let on = |threads: usize, restart: bool| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut simulation = Simulation::new(Arc::clone(&problem), settings).unwrap();
                for stop in [0.07, 0.2, 0.41] {
                    run(&mut simulation, stop);
                    if restart {
                        let saved = postcard::to_stdvec(simulation.state()).unwrap();
                        let state = postcard::from_bytes(&saved).unwrap();
                        simulation = Simulation::resume(Arc::clone(&problem), settings, state).unwrap();
                    }
                }
                simulation.state().clone()
            })
        };
        let one = on(1, false);
        for (threads, restart) in [(2, false), (3, false), (2, true)] {
            let other = on(threads, restart);
            assert!(bits(&one) == bits(&other) && one == other, "{threads} {restart}");
        }
    }
}

/// Fields weigh points by their masses, stored or not: means of z depend on element shapes only.
#[test]
fn masses_that_are_not_stored() {
    let settings = Settings::backward_euler(0.02);
    let alpha = |latent| {
        let mut problem = path(latent, |material| material);
        problem.material_of.iter_mut().filter(|material| **material == 2).for_each(|material| *material = 0);
        let mut simulation = Simulation::new(problem, settings).unwrap();
        run(&mut simulation, 0.5);
        simulation.field("alpha")
    };
    // masses are stored as soon as a material with latent heat may appear
    let (found, stored) = (alpha(false), alpha(true));
    assert!(found == stored && found.iter().flatten().any(|alpha| *alpha > 0.0));
}

/// Cells with eight filled fractions need the points of full cells and, for large systems, less than a packed
/// copy of their rows, both after births and when built at once, apart from lists that are freed later.
#[test]
fn unequal_cells_need_little_more_than_equal_ones() {
    let storage = |fills: u16| {
        let (count, layers, piece, width) = (24, 12, 12, 2);
        let mesh = grid([12e-3, 12e-3, 6e-3], [count, count, layers]);
        // one material for all fractions, which then share its points
        let whole = pa12(None);
        let filled =
            |k| Arc::new(Filled::new(whole.clone(), 0.5 + 0.5 * f64::from(k) / f64::from(fills)).unwrap());
        let mut births = Vec::new();
        for (layer, line) in (0..layers).flat_map(|layer| (0..count / width).map(move |line| (layer, line))) {
            for along in [0..piece, piece..count] {
                let cells = along.flat_map(|a| (0..width).map(move |w| (a, width * line + w)));
                let place = |(a, b)| if layer % 2 == 0 { [a, b] } else { [b, a] };
                let cell = |[x, y]: [usize; 2]| ((layer * count + y) * count + x) as u32;
                let mut elements: Vec<u32> = cells.map(|indices| cell(place(indices))).collect();
                elements.sort_unstable();
                births.push(Birth { time: 0.0, elements, temperature: 493.15 });
            }
        }
        let late = births.len() - 100;
        for (k, birth) in births[late..].iter_mut().enumerate() {
            birth.time = 0.5 * k as f64;
        }
        let bottom = mesh.surfaces["bottom"].clone();
        let outer = FaceSelection::Outer { except: bottom.clone() };
        let problem = Arc::new(Problem {
            materials: (1..=fills).map(|k| filled(k) as Arc<dyn ThermalMaterial>).collect(),
            material_of: (0..mesh.element_count())
                .map(|e| ((e as u64 * 2_654_435_761) >> 16) as u16 % fills)
                .collect(),
            conditions: vec![film(FaceSelection::Faces(bottom), 300.0, 353.15), film(outer, 15.0, 353.15)],
            births,
            ..Problem::new(mesh, pa12(None), 353.15)
        });
        let settings = Settings::backward_euler(0.5);
        let mut simulation = Simulation::new(problem.clone(), settings).unwrap();
        run(&mut simulation, 50.0);
        let whole = Simulation::resume(problem, settings, simulation.state().clone()).unwrap();
        [simulation, whole].map(|simulation| {
            let [points, _, bytes] = simulation.storage();
            assert_eq!(simulation.state().memory.nodal.state.len(), points);
            let size = simulation.state().temperature.len() as f64;
            [bytes as f64 / size, points as f64 / size]
        })
    };
    let ([equal, _], [unequal, whole]) = (storage(1), storage(8));
    assert_eq!(equal[1], unequal[1]);
    assert!(whole[0] <= 60.0 && unequal[0] <= 60.0 + 12.0, "{unequal:?} {whole:?}");
}
