//! Bond laws in Python: sampled once, then evaluated as polynomials.

use crate::error::value;
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use peri::potential::BondPotential;
use pyo3::prelude::*;
use std::f64::consts::PI;
use std::sync::Arc;

/// Number of panels below and above rest, which is the end of one.
const PANELS: usize = 128;

/// Degree of the polynomial of a panel.
const DEGREE: usize = 10;

/// Tension t(l)/kθ on panels, each by its values at the Chebyshev–Lobatto points.
pub struct Sampled {
    /// Ends of the panels, l.
    ends: Vec<f64>,
    /// Tension, its derivative and the energy at the points of each panel.
    points: Vec<[[f64; DEGREE + 1]; 3]>,
    stress_free: bool,
}

/// Points of a panel, from −1 to 1.
fn nodes() -> [f64; DEGREE + 1] {
    std::array::from_fn(|k| -(PI * k as f64 / DEGREE as f64).cos())
}

fn ends(low: f64, high: f64) -> Vec<f64> {
    let part = |from: f64, to: f64, k: usize| from + (to - from) * (k as f64 / PANELS as f64);
    let below = (0..PANELS).map(|k| part(low, 1.0, k));
    below.chain((0..PANELS).map(|k| part(1.0, high, k))).chain([high]).collect()
}

fn node(ends: &[f64], panel: usize, at: f64) -> f64 {
    // exact at both ends
    0.5 * ((1.0 - at) * ends[panel] + (1.0 + at) * ends[panel + 1])
}

/// Differentiation matrix D of the Lobatto points: the derivative of the polynomial at the points from its
/// values (Trefethen 2000, Spectral Methods in MATLAB, chapter 6).
fn differentiation() -> [[f64; DEGREE + 1]; DEGREE + 1] {
    let x = nodes();
    let c = |k: usize| {
        (if k == 0 || k == DEGREE { 2.0 } else { 1.0 }) * if k.is_multiple_of(2) { 1.0 } else { -1.0 }
    };
    let mut d = [[0.0; DEGREE + 1]; DEGREE + 1];
    for i in 0..=DEGREE {
        for j in 0..=DEGREE {
            if i != j {
                d[i][j] = c(i) / c(j) / (x[i] - x[j]);
                d[i][i] -= d[i][j];
            }
        }
    }
    d
}

/// Evaluates the polynomial through values at the points, by the barycentric formula (Berrut and Trefethen
/// 2004, doi:10.1137/S0036144502417715).
fn interpolate(values: &[f64; DEGREE + 1], at: f64) -> f64 {
    let (mut above, mut below) = (0.0, 0.0);
    for (k, (x, value)) in nodes().into_iter().zip(values).enumerate() {
        if at == x {
            return *value;
        }
        let weight = if k.is_multiple_of(2) { 1.0 } else { -1.0 }
            * if k == 0 || k == DEGREE { 0.5 } else { 1.0 }
            / (at - x);
        above += weight * value;
        below += weight;
    }
    above / below
}

impl Sampled {
    fn new(low: f64, high: f64, tension: &[f64]) -> Self {
        let (ends, d) = (ends(low, high), differentiation());
        let mut points = Vec::new();
        for (panel, values) in tension.chunks_exact(DEGREE + 1).enumerate() {
            let scale = 2.0 / (ends[panel + 1] - ends[panel]);
            let t: [f64; DEGREE + 1] = std::array::from_fn(|k| values[k]);
            let slope = d.map(|row| scale * row.iter().zip(&t).map(|(d, t)| d * t).sum::<f64>());
            points.push([t, slope, [0.0; DEGREE + 1]]);
        }
        let rest = tension[PANELS * (DEGREE + 1)];
        let stiff = points[PANELS][1][0].abs();
        let mut law = Self { ends, points, stress_free: rest.abs() <= 1e-12 * stiff };
        if law.stress_free {
            // the remainder at rest is rounding
            law.points[PANELS][0][0] = 0.0;
            law.points[PANELS - 1][0][DEGREE] = 0.0;
        }
        law.integrate();
        law
    }

    /// Integrates the energies at the points, from 0 at rest outwards: Gauss' rule of six points between
    /// neighbours is exact.
    fn integrate(&mut self) {
        const GAUSS: [[f64; 2]; 6] = [
            [-0.932_469_514_203_152, 0.171_324_492_379_170_36],
            [-0.661_209_386_466_264_5, 0.360_761_573_048_138_6],
            [-0.238_619_186_083_196_9, 0.467_913_934_572_691],
            [0.238_619_186_083_196_9, 0.467_913_934_572_691],
            [0.661_209_386_466_264_5, 0.360_761_573_048_138_6],
            [0.932_469_514_203_152, 0.171_324_492_379_170_36],
        ];
        let x = nodes();
        let panels = self.points.len();
        let between = |t: &[f64; DEGREE + 1], a: f64, b: f64| {
            let at = |g: f64| interpolate(t, 0.5 * ((1.0 - g) * a + (1.0 + g) * b));
            0.5 * (b - a) * GAUSS.iter().map(|[g, w]| w * at(*g)).sum::<f64>()
        };
        let mut energy = 0.0;
        for panel in PANELS..panels {
            let half = 0.5 * (self.ends[panel + 1] - self.ends[panel]);
            let [t, _, found] = &mut self.points[panel];
            found[0] = energy;
            for k in 0..DEGREE {
                energy += half * between(t, x[k], x[k + 1]);
                found[k + 1] = energy;
            }
        }
        energy = 0.0;
        for panel in (0..PANELS).rev() {
            let half = 0.5 * (self.ends[panel + 1] - self.ends[panel]);
            let [t, _, found] = &mut self.points[panel];
            found[DEGREE] = energy;
            for k in (0..DEGREE).rev() {
                energy -= half * between(t, x[k], x[k + 1]);
                found[k] = energy;
            }
        }
    }

    /// Returns tension (0), its derivative (1) or the energy (2) at a stretch; beyond the samples along the
    /// tangent at their end.
    fn value(&self, what: usize, stretch: f64) -> f64 {
        let (low, high) = (self.ends[0], self.ends[2 * PANELS]);
        let inside = stretch.clamp(low, high);
        let panel = self.ends.partition_point(|end| *end <= inside).saturating_sub(1).min(2 * PANELS - 1);
        let (a, b) = (self.ends[panel], self.ends[panel + 1]);
        // both differences keep digits beside both ends, one of which may be rest
        let at = ((inside - a) - (b - inside)) / (b - a);
        let value = |what: usize| interpolate(&self.points[panel][what], at);
        let beyond = stretch - inside;
        match what {
            _ if beyond == 0.0 => value(what),
            0 => value(0) + beyond * value(1),
            1 => value(1),
            _ => value(2) + beyond * (value(0) + 0.5 * beyond * value(1)),
        }
    }
}

impl BondPotential for Sampled {
    fn tension(&self, stretch: f64) -> f64 {
        self.value(0, stretch)
    }
    fn tension_derivative(&self, stretch: f64) -> f64 {
        self.value(1, stretch)
    }
    fn energy(&self, stretch: f64) -> f64 {
        self.value(2, stretch)
    }
    fn is_stress_free(&self) -> bool {
        self.stress_free
    }
}

/// Bond law from samples of t/kθ.
#[pyclass(frozen, module = "polymech._polymech")]
pub struct BondLaw {
    low: f64,
    high: f64,
    tension: Vec<f64>,
    /// Creates the law for the solver.
    pub law: Arc<Sampled>,
}

#[pymethods]
impl BondLaw {
    /// Creates a law from the tensions at [`Self::stretches`].
    #[new]
    fn new(low: f64, high: f64, tension: PyReadonlyArray1<'_, f64>) -> PyResult<Self> {
        let stretches = stretches(low, high)?;
        let tension = tension.as_slice()?.to_vec();
        if tension.len() != stretches.len() {
            let (found, allowed) = (tension.len(), stretches.len());
            return Err(value(format!("tensions: found {found}; allowed: {allowed}, one for each stretch")));
        }
        if let Some((stretch, bad)) = stretches.iter().zip(&tension).find(|(_, t)| !t.is_finite()) {
            return Err(value(format!(
                "tension at the stretch {stretch}: found {bad}; allowed: finite numbers"
            )));
        }
        let law = Sampled::new(low, high, &tension);
        let found = law.tangent();
        if found.is_nan() || found <= 0.0 {
            return Err(value(format!("dt/dl at rest: found {found}; allowed: above 0")));
        }
        Ok(Self { low, high, tension, law: Arc::new(law) })
    }

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> (f64, f64, Bound<'py, PyArray1<f64>>) {
        (self.low, self.high, self.tension.clone().into_pyarray(py))
    }

    /// Stretches at which a law is sampled.
    #[staticmethod]
    #[pyo3(name = "stretches")]
    fn sampled(py: Python<'_>, low: f64, high: f64) -> PyResult<Bound<'_, PyArray1<f64>>> {
        Ok(stretches(low, high)?.into_pyarray(py))
    }

    /// Computes tension, its derivative and energy at stretches.
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        stretch: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<[Bound<'py, PyArray1<f64>>; 3]> {
        let stretch = stretch.as_slice()?;
        let each = |what: usize| stretch.iter().map(|&l| self.law.value(what, l)).collect::<Vec<f64>>();
        Ok([0, 1, 2].map(|what| each(what).into_pyarray(py)))
    }
}

fn stretches(low: f64, high: f64) -> PyResult<Vec<f64>> {
    if !(low > 0.0 && low < 1.0 && high > 1.0 && high.is_finite()) {
        return Err(value(format!(
            "stretches: found {low} to {high}; allowed: from above 0, below 1, to above 1"
        )));
    }
    let ends = ends(low, high);
    Ok((0..2 * PANELS).flat_map(|panel| nodes().map(|at| node(&ends, panel, at))).collect())
}
