//! Ways to evaluate a bond law: error against time (`cargo xtask bench peri-laws`).
//!
//! Law `chain-offset`, n̄ = 720, D̂ = 1200, bond stretches l uniform in [0.5, 2.9442], the critical one of
//! the thesis' DENT specimen. As in the kernels, the input is e = l² − 1 and the output q = t/l, so that
//! tables need a square root. Error: the largest error of q over its root mean square.

use evidence::measurement::Measurement;
use peri::Error;
use peri::potential::{BondPotential, KernelFit, Law};
use std::hint::black_box;
use std::time::Instant;

const RANGE: [f64; 2] = [0.5, 2.9442];
/// Length of a row in the first-level cache.
const ROW: usize = 1024;
/// Rows per repeat.
const ROWS: usize = 100;
/// Numbers of nodes of tables; the thesis gives none.
const NODES: [usize; 4] = [50, 200, 1000, 4000];
/// Bounds of fits, the second that of the solvers.
const BOUNDS: [f64; 4] = [1e-4, 1e-6, 1e-9, 1e-11];

/// Measures every way with every setting.
pub fn measure() -> Result<Vec<Measurement>, Error> {
    let law = Law::ChainOffset.build(720.0, 1200.0, false)?;
    let strains: Vec<f64> = stretches().iter().map(|l| l * l - 1.0).collect();
    let exact: Vec<f64> = stretches().iter().map(|&l| law.tension(l) / l).collect();
    let rms = (exact.iter().map(|tension| tension * tension).sum::<f64>() / ROW as f64).sqrt();
    let mut rows = Vec::new();
    let mut push = |name: &str, way: &dyn Fn(&[f64], &mut [f64])| {
        let mut found = vec![0.0; ROW];
        way(&strains, &mut found);
        let error = found.iter().zip(&exact).map(|(f, e)| (f - e).abs()).fold(0.0, f64::max) / rms;
        let mut row = |what: &str, value, unit| {
            let what = format!("{name}: {what}");
            rows.push(Measurement::new(what, ROW, 1, value, unit));
        };
        row("largest error", error, "");
        row("time", nanoseconds(&strains, &mut found, way), "ns/bond");
    };
    push("newton", &|strains, found| {
        for (e, q) in strains.iter().zip(found) {
            let l = (1.0 + e).sqrt();
            *q = law.tension(l) / l;
        }
    });
    for nodes in NODES {
        let table = Table::new(&*law, nodes);
        push(&format!("linear table with {nodes} nodes"), &|strains, found| table.linear(strains, found));
        push(&format!("hermite table with {nodes} nodes"), &|strains, found| table.cubic(strains, found));
    }
    for bound in BOUNDS {
        let fit = KernelFit::new(&*law, RANGE, bound)?;
        push(&format!("fitted with bound {bound:e}"), &|strains, found| evaluate(&fit, strains, found));
    }
    Ok(rows)
}

/// Returns unordered uniform numbers: multiples of the golden section modulo 1.
fn stretches() -> Vec<f64> {
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    let [low, high] = RANGE;
    (1..=ROW).map(|k| low + (high - low) * (GOLDEN * k as f64).fract()).collect()
}

/// Evaluates q = e·N(e)/D(e) for eight bonds at once, as the kernels do.
fn evaluate(fit: &KernelFit, strains: &[f64], found: &mut [f64]) {
    const LANES: usize = 8;
    let (strains, found) = (strains.as_chunks::<LANES>().0, found.as_chunks_mut::<LANES>().0);
    for (e, q) in strains.iter().zip(found) {
        let (mut top, mut bottom) = ([0.0; LANES], [0.0; LANES]);
        for coefficient in fit.numerator.iter().rev() {
            for k in 0..LANES {
                top[k] = top[k] * e[k] + coefficient;
            }
        }
        for coefficient in fit.denominator.iter().rev() {
            for k in 0..LANES {
                bottom[k] = (bottom[k] + coefficient) * e[k];
            }
        }
        for k in 0..LANES {
            q[k] = top[k] * if fit.stress_free { e[k] } else { 1.0 };
        }
        if !fit.denominator.is_empty() {
            for k in 0..LANES {
                q[k] /= 1.0 + bottom[k];
            }
        }
    }
}

fn nanoseconds(strains: &[f64], found: &mut [f64], way: &dyn Fn(&[f64], &mut [f64])) -> f64 {
    let mut times: Vec<f64> = (0..crate::REPEATS)
        .map(|_| {
            let since = Instant::now();
            for _ in 0..ROWS {
                way(black_box(strains), black_box(&mut *found));
            }
            since.elapsed().as_secs_f64() * 1e9 / (ROWS * ROW) as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[crate::REPEATS / 2]
}

/// Tension and its derivative at equally spaced stretches.
struct Table {
    per_width: f64,
    nodes: Vec<[f64; 2]>,
}

impl Table {
    fn new(law: &dyn BondPotential, count: usize) -> Self {
        let width = (RANGE[1] - RANGE[0]) / (count - 1) as f64;
        let node = |k: usize| RANGE[0] + width * k as f64;
        let nodes =
            (0..count).map(|k| [law.tension(node(k)), law.tension_derivative(node(k)) * width]).collect();
        Self { per_width: 1.0 / width, nodes }
    }

    /// Returns the nodes on both sides, and the fraction between them.
    fn between(&self, stretch: f64) -> ([f64; 2], [f64; 2], f64) {
        let place = (stretch - RANGE[0]) * self.per_width;
        let k = (place as usize).min(self.nodes.len() - 2);
        (self.nodes[k], self.nodes[k + 1], place - k as f64)
    }

    /// Interpolation of the thesis (§2.4).
    fn linear(&self, strains: &[f64], found: &mut [f64]) {
        for (e, q) in strains.iter().zip(found) {
            let l = (1.0 + e).sqrt();
            let ([a, _], [b, _], s) = self.between(l);
            *q = (a + s * (b - a)) / l;
        }
    }

    fn cubic(&self, strains: &[f64], found: &mut [f64]) {
        for (e, q) in strains.iter().zip(found) {
            let l = (1.0 + e).sqrt();
            let ([a, slope_a], [b, slope_b], s) = self.between(l);
            let r = 1.0 - s;
            let tension =
                r * r * ((1.0 + 2.0 * s) * a + s * slope_a) + s * s * ((3.0 - 2.0 * s) * b - r * slope_b);
            *q = tension / l;
        }
    }
}
