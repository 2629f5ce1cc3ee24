//! Rectangular plate with a free circular hole under tension: reference solution for plates of finite size.
//!
//! Kolosov's potentials Φ, Ψ as even powers with real coefficients (Muskhelishvili, 1953, §§ 32, 56): the
//! coefficients of Ψ follow from those of Φ so that the hole is free of traction exactly; the outer edges are
//! satisfied by least squares.

use crate::quadrature::panel;
use nalgebra::{Complex, DMatrix, DVector};

type C = Complex<f64>;

/// Even powers of z in Φ, upwards and downwards.
const POWERS: usize = 60;

/// ν of every plane body here, in plane strain ν/(1 − ν): fixed by central bonds.
const POISSON: f64 = 1.0 / 3.0;

/// Stresses of a plate |x| ≤ half₁, |y| ≤ half₂ with a free hole about the origin under unit tension along x:
/// by tractions on the edges x = ±half₁ where `layer` is 0, else by the body force 1/layer within a layer of
/// that width at each of these edges, as `peri` applies tractions.
///
/// A body force has the particular solution σ = (1, ν, 0)·min(1, (half₁ − |x|)/layer) of uniaxial strain; the
/// remainder is smooth and has tractions σ₁₁ = 1 on x = ±half₁ and σ₂₂ = ν·ramp(x) on y = ±half₂, ramp =
/// max(0, (|x| − half₁ + layer)/layer); subtracting ramp·(1, ν, 0) gives the plate's stress.
pub struct Plate {
    radius: f64,
    half: [f64; 2],
    layer: f64,
    /// Distance from the origin to a corner.
    corner: f64,
    coefficients: Vec<f64>,
    /// Root mean square of the remaining tractions on the edges, over the tension.
    pub edge_error: f64,
}

impl Plate {
    /// Finds the coefficients; lengths in any one unit. `None` unless 0 < `radius` < both halves and 0 ≤
    /// `layer` < half₁ − `radius`.
    ///
    /// Accuracy for the square with half = 25/3 radii, which reproduces the figures of an independent
    /// finite-element program (tests): 8 digits without a layer; with one, 5e-5 except in the last twentieth
    /// of the edges.
    pub fn new(radius: f64, half: [f64; 2], layer: f64) -> Option<Self> {
        let fits = 0.0 < radius && radius < half[0].min(half[1]) && 0.0 <= layer && layer < half[0] - radius;
        if !fits || !half.iter().all(|h| h.is_finite()) {
            return None;
        }
        let corner = half[0].hypot(half[1]);
        let mut plate = Self { radius, half, layer, corner, coefficients: Vec::new(), edge_error: 0.0 };
        let unknowns = 2 * POWERS + 1;
        // points of an edge with the weights of Gauss' rule, in panels
        let points = |from: f64, to: f64| {
            let edge = move |k: usize| from + (to - from) * k as f64 / POWERS as f64;
            (0..POWERS).flat_map(move |k| panel(edge(k), edge(k + 1)))
        };
        let right = points(0.0, half[1]).map(|(y, weight)| (C::new(half[0], y), weight, 0, 1.0));
        let knee = half[0] - layer;
        let loaded = points(knee, half[0]).filter(|_| layer > 0.0);
        let top = points(0.0, knee).chain(loaded);
        let top = top.map(|(x, weight)| (C::new(x, half[1]), weight, 1, POISSON * plate.ramp(x)));
        // tractions normal and along the edge
        let rows: Vec<(C, f64, usize, f64)> = right
            .chain(top)
            .flat_map(|(z, weight, normal, traction)| [(z, weight, normal, traction), (z, weight, 2, 0.0)])
            .collect();
        let mut matrix = DMatrix::zeros(rows.len(), unknowns);
        let mut wanted = DVector::zeros(rows.len());
        for (row, &(z, weight, component, traction)) in rows.iter().enumerate() {
            plate.terms(z, |term, stress| matrix[(row, term)] = weight.sqrt() * stress[component]);
            wanted[row] = weight.sqrt() * traction;
        }
        let factors = matrix.clone().qr();
        let mut projected = wanted.clone();
        factors.q_tr_mul(&mut projected);
        let solution = factors.r().solve_upper_triangular(&projected.rows(0, unknowns).into_owned())?;
        plate.edge_error = (&matrix * &solution - wanted).norm() / (half[0] + half[1]).sqrt();
        plate.coefficients = solution.iter().copied().collect();
        Some(plate)
    }

    /// Visits the stresses [σ₁₁, σ₂₂, σ₁₂] of every unknown's term at z: Φ = α₀ + Σ α_m (z/R)^m + γ_m
    /// (a/R)^{m−2} (a/z)^m over even m, R the distance of a corner; σ₁₁ + σ₂₂ = 4 Re Φ, σ₂₂ − σ₁₁ + 2iσ₁₂ =
    /// 2(z̄Φ′ + Ψ).
    fn terms(&self, z: C, mut visit: impl FnMut(usize, [f64; 3])) {
        let (w, v) = (z / self.corner, self.radius / z);
        let (w2, v2, turn) = (w * w, v * v, z.conj() / z);
        let square = (self.radius / self.corner).powi(2);
        let mut add = |term: usize, phi: C, slope: C, psi: C| {
            let shear = turn * slope + psi;
            visit(term, [2.0 * phi.re - shear.re, 2.0 * phi.re + shear.re, shear.im]);
        };
        add(0, C::new(1.0, 0.0), C::default(), 2.0 * v2);
        // (z/R)^{m−2}, (a/z)^m, (a/R)^{m−2}
        let (mut up, mut down, mut scale) = (C::new(1.0, 0.0), v2, 1.0);
        for k in 1..=POWERS {
            let m = 2.0 * k as f64;
            let risen = up * w2;
            add(k, risen, m * risen, (1.0 - m) * square * up + scale * square * down * v2);
            let fallen = scale * down;
            add(POWERS + k, fallen, -m * fallen, up + (1.0 + m) * fallen * v2);
            (up, down, scale) = (risen, down * v2, scale * square);
        }
    }

    fn ramp(&self, x: f64) -> f64 {
        if self.layer > 0.0 { ((x.abs() - self.half[0] + self.layer) / self.layer).max(0.0) } else { 0.0 }
    }

    /// [σ₁₁, σ₂₂, σ₁₂] over the tension at a point of the plate; meaningless inside the hole.
    pub fn stress(&self, x: f64, y: f64) -> [f64; 3] {
        let mut sum = [0.0; 3];
        self.terms(C::new(x.abs(), y.abs()), |term, stress| {
            for (sum, s) in sum.iter_mut().zip(stress) {
                *sum += self.coefficients[term] * s;
            }
        });
        let ramp = self.ramp(x);
        let sign = if (x < 0.0) == (y < 0.0) { 1.0 } else { -1.0 };
        [sum[0] - ramp, sum[1] - POISSON * ramp, sign * sum[2]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(layer: f64) -> Plate {
        Plate::new(60.0, [500.0; 2], layer).unwrap()
    }

    /// Rows of a table that docs/reference/plate/plate_series.py wrote.
    fn table(text: &str) -> Vec<Vec<f64>> {
        let lines = text.lines().filter(|line| !line.starts_with('#')).skip(1);
        lines.map(|line| line.split(',').map(|x| x.parse().unwrap()).collect()).collect()
    }

    /// Compares the ligament with another program's series, whose peaks a third one, of quadratic finite
    /// elements, confirms to the digits below: 3.12474, 3.12770, 3.13642, 3.13917, 3.15280.
    #[test]
    fn ligament_and_peaks() {
        let layers = [0.0, 3.0, 6.0, 12.0, 15.0, 30.0];
        let rows = table(include_str!("../../tests/data/plate_ligament.csv"));
        let elements = [3.12474, 3.12770, f64::NAN, 3.13642, 3.13917, 3.15280];
        for (column, (layer, element)) in layers.into_iter().zip(elements).enumerate() {
            let plate = square(layer);
            let peak = plate.stress(0.0, 60.0)[0];
            // the finite elements' last step of refinement moved the peak by 7e-5
            assert!(element.is_nan() || (peak - element).abs() < 7e-5, "L = {layer}: {peak} and {element}");
            // printed digits; with layers, the difference between numbers of powers, and ten times that at
            // the edge
            for row in rows.iter().filter(|row| row[0] <= 500.0) {
                let bound = if layer == 0.0 {
                    1e-6
                } else if row[0] < 480.0 {
                    6e-5
                } else {
                    1e-3
                };
                let found = plate.stress(0.0, row[0])[0];
                assert!((found - row[1 + column]).abs() < bound, "L = {layer}, y = {}: {found}", row[0]);
            }
        }
    }

    /// Compares all components on the 60 radii and angles of the other program (every seventh is shipped).
    #[test]
    fn polar_grid() {
        let plate = square(0.0);
        let rows = table(include_str!("../../tests/data/plate_polar.csv"));
        assert!(rows.len() > 300);
        for row in rows {
            let (radius, angle) = (row[0], row[1].to_radians());
            let found = plate.stress(radius * angle.cos(), radius * angle.sin());
            for (found, expected) in found.iter().zip(&row[2..]) {
                // r and θ have five decimals, near the rim σ changes by 0.1 a mm
                assert!((found - expected).abs() < 3e-6, "{row:?}: {found}");
            }
        }
    }

    /// Checks that Kirsch's plate is the limit of a small hole; a strip three times as long has 3.05245 in
    /// the other program and 3.047 ± 1 % by Heywood.
    #[test]
    fn other_plates() {
        let wide = Plate::new(1.0, [60.0; 2], 0.0).unwrap();
        for [x, y] in [[0.0, 1.0], [1.0, 0.0], [0.9, 1.1], [-2.0, 1.5]] {
            let kirsch = crate::exact::kirsch(x, y, 1.0, 1.0);
            for (found, expected) in wide.stress(x, y).iter().zip(kirsch) {
                // edges have an effect of a few times (radius/half)²
                assert!((found - expected).abs() < 5e-3, "{x} {y}: {found} {expected}");
            }
        }
        let strip = Plate::new(60.0, [1500.0, 500.0], 0.0).unwrap().stress(0.0, 60.0)[0];
        assert!((strip - 3.05245).abs() < 1e-5, "{strip}");
        assert!((strip / crate::exact::heywood_gross(0.12) - 1.0).abs() < 0.01);
    }

    #[test]
    fn free_hole_equilibrium_and_symmetry() {
        for layer in [0.0, 9.0, 80.0] {
            let plate = square(layer);
            for degrees in (-180..180).step_by(7) {
                let (s, c) = f64::from(degrees).to_radians().sin_cos();
                let [s11, s22, s12] = plate.stress(60.0 * c, 60.0 * s);
                // exact by construction: rounding of the sums
                assert!((s11 * c + s12 * s).abs() < 1e-12 && (s12 * c + s22 * s).abs() < 1e-12);
            }
            let h = 1e-3;
            for [x, y] in
                [[70.0, 20.0], [-30.0, 90.0], [400.0, 300.0], [-350.0, -410.0], [499.0 - 0.5 * layer, 100.0]]
            {
                let d = |a: [f64; 3], b: [f64; 3], k: usize| (a[k] - b[k]) / (2.0 * h);
                let (east, west) = (plate.stress(x + h, y), plate.stress(x - h, y));
                let (north, south) = (plate.stress(x, y + h), plate.stress(x, y - h));
                let force = if layer > 0.0 && x.abs() > 500.0 - layer { x.signum() / layer } else { 0.0 };
                // rounding over 2h
                assert!((d(east, west, 0) + d(north, south, 2) + force).abs() < 1e-8, "{layer} {x} {y}");
                assert!((d(east, west, 2) + d(north, south, 1)).abs() < 1e-8, "{layer} {x} {y}");
            }
            // the load at the ends passes through the ligament
            let edge = |k: usize| 60.0 + 440.0 * k as f64 / 200.0;
            let force: f64 = (0..200)
                .flat_map(|k| panel(edge(k), edge(k + 1)))
                .map(|(y, weight)| weight * plate.stress(0.0, y)[0])
                .sum();
            assert!((force / 500.0 - 1.0).abs() < 1e-5, "{layer}: {force}");
        }
    }

    #[test]
    fn plates_that_do_not_exist() {
        for (radius, half, layer) in
            [(0.0, 1.0, 0.0), (1.0, 1.0, 0.0), (0.2, 1.0, 0.8), (0.2, 1.0, -0.1), (0.2, f64::NAN, 0.1)]
        {
            assert!(Plate::new(radius, [half; 2], layer).is_none());
        }
    }
}
