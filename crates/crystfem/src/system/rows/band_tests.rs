//! Tests of rows by diagonals, against sums over elements.

use crate::boundary::{Condition, FaceSelection, Schedule};
use crate::material::{Conductor, ThermalProperty};
use crate::mesh::{Grid, Mesh};
use crate::problem::{Birth, Capacity, Problem};
use crate::system::bands::Bands;
use crate::system::vector::CHUNK;
use crate::system::{Evaluation, MaterialBehaviour, PointMemory, StepInput, ThermalSystem};
use std::sync::Arc;

const CONDUCTIVITY: f64 = 0.3;
const DENSITY: f64 = 1000.0;
const SPECIFIC_HEAT: f64 = 2000.0;

/// Creates a body of 20 × 18 × 16 elements of 1 mm, more than one work item of equations, with three of four
/// layers distorted.
fn mesh() -> Mesh {
    let mut mesh =
        Grid::uniform([0.0; 3], [20e-3, 18e-3, 16e-3], [20, 18, 16]).unwrap().mesh("body").unwrap();
    for place in mesh.points.iter_mut().filter(|place| place[2] > 4.5e-3) {
        let [x, y, z] = *place;
        place[0] += 0.2e-3 * (900.0 * y + 700.0 * z).sin();
        place[1] += 0.2e-3 * (800.0 * z + 300.0 * x).cos();
        place[2] += 0.2e-3 * (600.0 * x - 500.0 * y).sin();
    }
    mesh
}

fn problem(capacity: Capacity) -> Problem {
    let property = ThermalProperty::constant;
    let material =
        Conductor::new(DENSITY, property("k", CONDUCTIVITY).unwrap(), property("c", SPECIFIC_HEAT).unwrap());
    Problem { capacity, ..Problem::new(mesh(), Arc::new(material.unwrap()), 300.0) }
}

fn system(problem: &Problem) -> ThermalSystem {
    let behaviour = MaterialBehaviour::from_material(&*problem.materials[0], problem.capacity).unwrap();
    let mut born = vec![0; problem.mesh.element_count()];
    for birth in &problem.births {
        birth.elements.iter().for_each(|&element| born[element as usize] = 1);
    }
    ThermalSystem::build(problem, &[behaviour], &born, problem.births.len()).unwrap()
}

/// Returns K x and M x of nodes by integration of each element.
fn integrated(mesh: &Mesh, x: &[f64]) -> [Vec<f64>; 2] {
    let mut sums = [vec![0.0; x.len()], vec![0.0; x.len()]];
    for element in 0..mesh.element_count() as u32 {
        let geometry = mesh.geometry(element).unwrap();
        let conduction = geometry.conduction(&(CONDUCTIVITY * nalgebra::Matrix3::identity()));
        let mass = geometry.mass();
        let nodes = mesh.nodes(element);
        for (a, &row) in nodes.iter().enumerate() {
            for (b, &column) in nodes.iter().enumerate() {
                sums[0][row as usize] += conduction[a][b] * x[column as usize];
                sums[1][row as usize] += DENSITY * SPECIFIC_HEAT * mass[a][b] * x[column as usize];
            }
        }
    }
    sums
}

fn wave(size: usize, number: f64) -> Vec<f64> {
    (0..size).map(|k| (number * k as f64).sin()).collect()
}

/// Products, flow and diagonal agree with integration element by element to rounding; the matrix is
/// symmetric; uniform temperature conducts nothing; the bits do not depend on threads. A row takes 14 numbers
/// of each matrix and a word, apart from the last tile.
#[test]
fn products_are_those_of_the_elements() {
    for capacity in [Capacity::Consistent, Capacity::Lumped] {
        let problem = problem(capacity);
        let system = system(&problem);
        let (rows, size, consistent) = (&system.rows, system.size(), capacity == Capacity::Consistent);
        assert!(rows.bands().is_some() && size > CHUNK + 512);
        let matrices = if consistent { 2 } else { 1 };
        assert!(rows.bytes() <= (size + 512) * (14 * 8 * matrices + 4), "{}", rows.bytes());
        assert_eq!(rows.stored()[2], (3 * 20 + 1) * (3 * 18 + 1) * (3 * 16 + 1));
        let by_equation = |values: &[f64]| -> Vec<f64> {
            system.nodes().iter().map(|&node| values[node as usize]).collect()
        };
        let of_nodes = wave(size, 0.7);
        let x = by_equation(&of_nodes);
        let sums = integrated(&problem.mesh, &of_nodes);
        let [conducted, stored] = [by_equation(&sums[0]), by_equation(&sums[1])];
        let mut diagonal = vec![0.0; size];
        rows.add_diagonal([0.0, 1.0], &mut diagonal);
        let largest = diagonal.iter().copied().fold(0.0, f64::max);
        assert_eq!(rows.largest(|_, value| value), largest);
        let own = wave(size, 0.1);
        // 27 products of order of the diagonal, and the sums of eight elements
        let close = |found: &[f64], exact: &dyn Fn(usize) -> f64, scale: f64| {
            let far = (0..size).map(|k| (found[k] - exact(k)).abs()).fold(0.0, f64::max);
            assert!(far <= 64.0 * f64::EPSILON * scale, "{far:e} of {scale:e}");
        };
        let weights = if consistent { [0.5, 200.0] } else { [0.0, 200.0] };
        let heat = DENSITY * SPECIFIC_HEAT * 1e-9;
        let scale = 1.0 + 200.0 * largest + heat;
        let mut y = vec![0.0; size];
        let dot = rows.product(Some(&own), weights, &x, &mut y);
        close(&y, &|k| own[k] * x[k] + weights[0] * stored[k] + weights[1] * conducted[k], scale);
        let plain: f64 = x.iter().zip(&y).map(|(x, y)| x * y).sum();
        assert!((dot - plain).abs() <= 1e-13 * scale * size as f64);
        let [mut flow, mut heats] = [vec![0.0; size], vec![0.0; size]];
        rows.flow(&x, &mut flow);
        close(&flow, &|k| conducted[k], 2.0 * largest);
        if consistent {
            rows.flow_and_capacity(&x, &x, &mut flow, &mut heats);
            close(&flow, &|k| conducted[k], 2.0 * largest);
            close(&heats, &|k| stored[k], heat);
        }
        // entries of a row, one by one
        for row in [0, 1, 511, 512, CHUNK - 1, CHUNK, size / 2, size - 1] {
            let sum: f64 = rows.row(row, [0.0, 1.0]).map(|(column, value)| value * x[column]).sum();
            assert!((sum - conducted[row]).abs() <= 64.0 * f64::EPSILON * largest);
            assert!(rows.columns(row).is_sorted());
        }
        // symmetry, and constant fields in the kernel: exactly in flows, to rounding in products
        let other = wave(size, 1.3);
        let mut z = vec![0.0; size];
        rows.product(None, weights, &other, &mut z);
        rows.product(None, weights, &x, &mut y);
        let [one, two]: [f64; 2] =
            [(&other, &y), (&x, &z)].map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b).sum());
        assert!((one - two).abs() <= 1e-13 * scale * size as f64, "{one} {two}");
        rows.flow(&vec![480.0; size], &mut flow);
        assert!(flow.iter().all(|heat| *heat == 0.0));
        rows.product(None, [0.0, 1.0], &vec![1.0; size], &mut z);
        close(&z, &|_| 0.0, largest);
        let bits = [1, 2].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let dot = pool.install(|| rows.product(Some(&own), weights, &x, &mut y));
            y.iter().chain([&dot]).map(|value| value.to_bits()).collect::<Vec<_>>()
        });
        assert!(bits[0] == bits[1]);
    }
}

/// Only bodies of mostly unequal elements that all exist from the start are stored by diagonals, and only if
/// neighbours have few distances.
#[test]
fn others_are_stored_by_rows() {
    let whole = problem(Capacity::Lumped);
    assert!(system(&whole).rows.bands().is_some());
    let last = whole.mesh.element_count() as u32 - 1;
    let births = vec![Birth { time: 1.0, elements: vec![last], temperature: 400.0 }];
    assert!(system(&Problem { births, ..problem(Capacity::Lumped) }).rows.bands().is_none());
    let mut equal = problem(Capacity::Lumped);
    equal.mesh = Grid::uniform([0.0; 3], [20e-3; 3], [20; 3]).unwrap().mesh("body").unwrap();
    equal.material_of = vec![0; equal.mesh.element_count()];
    assert!(system(&equal).rows.bands().is_none());
    let pairs = |stride: u32| (0..1000_u32).map(move |k| [k, k * stride % 1000]);
    let find = |stride| Bands::find(1000, false, pairs(stride), |pair, list| list.extend(pair));
    assert!(find(1).is_some() && find(7).is_none());
}

/// Film and radiation on the same faces share a matrix for each, which is the sum of both; so are rates and
/// heat flows.
#[test]
fn conditions_on_the_same_faces_share_matrices() {
    let ambient = Schedule::constant(290.0);
    let all = || FaceSelection::Outer { except: Vec::new() };
    let film =
        Condition::Film { surface: all(), coefficient: Schedule::constant(15.0), ambient: ambient.clone() };
    let radiation = Condition::Radiation { surface: all(), emissivity: 0.9, ambient };
    let evaluated = |conditions: Vec<Condition>| {
        let problem = Problem { conditions, ..problem(Capacity::Consistent) };
        let mut system = system(&problem);
        let temperature: Vec<f64> = (0..system.size()).map(|k| 400.0 + (k as f64).sin()).collect();
        let at =
            StepInput { temperature: &temperature, start: &temperature, dt: 1.0, time: 1.0, tangent: true };
        let mut out = Evaluation::default();
        system.evaluate(&problem, &at, &PointMemory::default(), &mut out).unwrap();
        let mut image = vec![0.0; system.size()];
        out.faces.iter().for_each(|face| face.add_product(1.0, &temperature, &mut image));
        assert_eq!(
            system.surfaces.radiates(),
            problem.conditions.iter().any(|c| matches!(c, Condition::Radiation { .. }))
        );
        (out, image)
    };
    let (both, image) = evaluated(vec![film.clone(), radiation.clone()]);
    let (alone, alone_image) = evaluated(vec![film]);
    let (other, other_image) = evaluated(vec![radiation]);
    let count = |out: &Evaluation| out.faces.iter().count();
    assert_eq!([count(&both), count(&other)], [count(&alone); 2]);
    let (none, _) = evaluated(Vec::new());
    for k in 0..image.len() {
        let sums = [alone_image[k] + other_image[k], alone.rate[k] + other.rate[k] - none.rate[k]];
        for (found, sum) in [image[k], both.rate[k]].into_iter().zip(sums) {
            assert!((found - sum).abs() <= 1e-13 * (1.0 + sum.abs()), "{found} {sum}");
        }
    }
    let gross = both.exchange.gross();
    assert!((gross - alone.exchange.gross() - other.exchange.gross()).abs() < 1e-13 * gross);
    assert!(both.exchange.film == alone.exchange.film && both.exchange.radiation == other.exchange.radiation);
}
