//! Critical time step Δt_c = 2/ω_max of explicit dynamics: a bound for every deformation within a range of
//! stretches, and the sharp value of one deformation.

use super::motion::BondSums;
use super::state::State;
use super::system::System;
use super::verlet_step::SiteMasses;
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;

/// Displacement of the tangent's force differences, in shortest bonds: truncation and rounding are both about
/// 1e-10 of the force.
const PROBE: f64 = 1e-5;
/// Residual of the Ritz pair, over its value, at which the sharp frequency is accurate enough: a dense
/// spectrum would take hundreds of forces for further digits.
const ENOUGH: f64 = 1e-2;
/// Most steps of the Lanczos iteration.
const MOST_STEPS: usize = 200;

impl BondSums {
    /// Sums over all bonds in one visit.
    pub fn new<const D: usize>(system: &System<D>) -> Self {
        let of = |sites: &[u32]| {
            let mut part = Self { stiffness: 0.0, shortest: f64::INFINITY, extent: 0.0 };
            for &site in sites {
                let (mut stiffness, mut extent) = (0.0, 0.0);
                system.bonds.neighbours(site as usize, &mut |bond| {
                    stiffness += 2.0 * bond.weight / bond.length;
                    extent += bond.weight * bond.length;
                    part.shortest = part.shortest.min(bond.length);
                });
                part.stiffness = part.stiffness.max(stiffness);
                part.extent += system.bonds.volume(site as usize) * extent;
            }
            part
        };
        let parts: Vec<Self> = parallel::map_chunks(system.bonds.particles(), CHUNK, of);
        parts.into_iter().fold(Self { stiffness: 0.0, shortest: f64::INFINITY, extent: 0.0 }, |a, b| Self {
            stiffness: a.stiffness.max(b.stiffness),
            shortest: a.shortest.min(b.shortest),
            extent: a.extent + b.extent,
        })
    }
}

/// 2/ω, ∞ if nothing oscillates.
pub fn critical(frequency_squared: f64) -> f64 {
    if frequency_squared > 0.0 { 2.0 / frequency_squared.sqrt() } else { f64::INFINITY }
}

/// Computes ω_max² of the tangent −∂f/∂u/ρ at a state, 1/s², by the Lanczos iteration (1950,
/// doi:10.6028/jres.045.026) on differences of forces, constrained components at rest; 0 if the greatest is
/// not positive.
///
/// Masses are the weights of the inner product in which the tangent is symmetric. The Ritz value is a lower
/// bound; adding its residual, up to a hundredth of it, makes it safe: half a hundredth above the result of
/// 200 steps.
pub fn largest_frequency_squared<const D: usize>(
    system: &mut System<D>,
    state: &mut State<D>,
    masses: &SiteMasses,
    density: f64,
    shortest: f64,
) -> f64 {
    if !shortest.is_finite() {
        return 0.0;
    }
    let weights = masses.weights();
    let mut now = start(system);
    let mut before = Field::zeros(system.bonds.sites());
    let mut product = before.clone();
    let mut scratch = [before.clone(), before.clone()];
    let size = product_of(&now, &now, &weights).sqrt();
    if size == 0.0 {
        return 0.0;
    }
    scale(&mut now, 1.0 / size);
    let (mut diagonal, mut beside): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut value = 0.0;
    for step in 1..=MOST_STEPS {
        tangent(system, state, &now, shortest, density, &mut scratch, &mut product);
        for component in product.components_mut() {
            component.iter_mut().zip(&masses.ratios).for_each(|(x, ratio)| *x /= ratio);
        }
        diagonal.push(product_of(&now, &product, &weights));
        let (alpha, beta) = (diagonal[step - 1], beside.last().copied().unwrap_or(0.0));
        combine(&mut product, [(-alpha, &now), (-beta, &before)]);
        let next = product_of(&product, &product, &weights).sqrt();
        let exhausted = next.is_nan() || next <= 1e-12 * alpha.abs() || step == MOST_STEPS;
        // the small problem costs the cube of its size: not at every step
        if exhausted || step.is_multiple_of(5) {
            let (largest, last) = largest_pair(&diagonal, &beside);
            value = largest + next * last.abs();
            if exhausted || next * last.abs() <= ENOUGH * value.abs() {
                break;
            }
        }
        scale(&mut product, 1.0 / next);
        std::mem::swap(&mut before, &mut now);
        std::mem::swap(&mut now, &mut product);
        beside.push(next);
    }
    value.max(0.0)
}

/// Largest eigenvalue of the tridiagonal matrix, and the last component of its unit vector.
fn largest_pair(diagonal: &[f64], beside: &[f64]) -> (f64, f64) {
    let size = diagonal.len();
    let matrix = nalgebra::DMatrix::from_fn(size, size, |i, j| match i.abs_diff(j) {
        0 => diagonal[i],
        1 => beside[i.min(j)],
        _ => 0.0,
    });
    if matrix.iter().any(|x| !x.is_finite()) {
        return (f64::INFINITY, 0.0);
    }
    let eigen = matrix.symmetric_eigen();
    let (k, value) = eigen.eigenvalues.argmax();
    (value, eigen.eigenvectors[(size - 1, k)])
}

/// −(∂f/∂u)x/ρ by a central difference.
fn tangent<const D: usize>(
    system: &mut System<D>,
    state: &mut State<D>,
    direction: &Field<D>,
    shortest: f64,
    density: f64,
    scratch: &mut [Field<D>; 2],
    product: &mut Field<D>,
) {
    let largest = direction.components().iter().flat_map(|c| c.iter()).fold(0.0_f64, |m, x| m.max(x.abs()));
    let probe = PROBE * shortest / largest;
    let [moved, force] = scratch;
    for (sign, out) in [(1.0, &mut *product), (-1.0, force)] {
        moved.clone_from(&state.displacement);
        combine(moved, [(sign * probe, direction), (0.0, direction)]);
        system.prepare(moved);
        let moved = &*moved;
        let system = &*system;
        parallel::for_items(out.chunks_mut(), |chunk, mut out| {
            system.internal_force(moved, chunk * CHUNK, &mut out, None);
        });
        system.count_evaluation(state);
    }
    let factor = -0.5 / (probe * density);
    combine(product, [(-1.0, &scratch[1]), (0.0, &scratch[1])]);
    scale(product, factor);
    if system.loads.constrained.is_empty() {
        return;
    }
    for &site in system.bonds.particles() {
        let constrained = system.loads.constrained(site as usize);
        if constrained != 0 {
            let value = product.get(site as usize);
            let value = std::array::from_fn(|d| if constrained >> d & 1 == 1 { 0.0 } else { value[d] });
            product.set(site as usize, value);
        }
    }
}

/// Start vector with a part of every mode: Knuth's linear congruential generator, free components only.
fn start<const D: usize>(system: &System<D>) -> Field<D> {
    let mut field = Field::zeros(system.bonds.sites());
    let mut seed = 1_u64;
    for &site in system.bonds.particles() {
        let constrained = system.loads.constrained(site as usize);
        let value = std::array::from_fn(|d| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            if constrained >> d & 1 == 1 { 0.0 } else { (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0 }
        });
        field.set(site as usize, value);
    }
    field
}

/// Σ V x·y, work item by work item in order.
fn product_of<const D: usize>(a: &Field<D>, b: &Field<D>, volumes: &[f64]) -> f64 {
    let sites = volumes.len();
    let (a, b) = (a.components(), b.components());
    let of = |chunk: usize| {
        let range = chunk_range(chunk, sites);
        let of_axis = |d: usize| {
            let parts = a[d][range.clone()].iter().zip(&b[d][range.clone()]).zip(&volumes[range.clone()]);
            parts.map(|((x, y), v)| x * y * v).sum::<f64>()
        };
        (0..D).map(of_axis).sum()
    };
    parallel::sum(sites.div_ceil(CHUNK), of)
}

fn scale<const D: usize>(field: &mut Field<D>, factor: f64) {
    parallel::for_items(field.chunks_mut(), |_, chunk| {
        chunk.into_iter().flatten().for_each(|x| *x *= factor);
    });
}

/// field += Σ factor·other.
fn combine<const D: usize>(field: &mut Field<D>, others: [(f64, &Field<D>); 2]) {
    let sites = field.sites();
    let [(first, a), (second, b)] = others;
    let (a, b) = (a.components(), b.components());
    parallel::for_items(field.chunks_mut(), |chunk, out| {
        let range = chunk_range(chunk, sites);
        for (d, out) in out.into_iter().enumerate() {
            for ((x, a), b) in out.iter_mut().zip(&a[d][range.clone()]).zip(&b[d][range.clone()]) {
                *x += first * a + second * b;
            }
        }
    });
}
