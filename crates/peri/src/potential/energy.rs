//! Bond energies and tangents as tables over e = λ² − 1.

use super::{BondPotential, KernelFit, StretchRange};

/// Pieces of the table.
const PIECES: usize = 2048;
/// Pieces of the table of a fit, which has a wider range.
const FINE: usize = 8192;

/// φ(e)/kθ by cubic Hermite interpolation, with dφ/de = t/2λ at its nodes: relative error about 1e-9 of the
/// largest.
pub struct EnergyTable {
    low: f64,
    step: f64,
    nodes: Vec<[f64; 2]>,
}

impl EnergyTable {
    /// Tabulates the energies of the stretches observed.
    pub fn new(law: &dyn BondPotential, observed: StretchRange) -> Self {
        // never empty, never a bond of zero length
        let low = observed.low.max(-1.0 + 1e-12);
        let high = observed.high.max(low + 1e-9);
        let step = (high - low) / PIECES as f64;
        let node = |k: usize| {
            let e = low + step * k as f64;
            let stretch = (1.0 + e).sqrt();
            [law.energy(stretch), 0.5 * law.tension_at_strain(e / (1.0 + stretch)) / stretch]
        };
        Self { low, step, nodes: (0..=PIECES).map(node).collect() }
    }

    /// Tabulates the energies of a fitted law, ½∫q de from the energy `at_rest` on: the potential of the
    /// kernels' forces. `None` for a law that only a table represents.
    pub fn of_fit(fit: &KernelFit, at_rest: f64) -> Option<Self> {
        if fit.numerator.is_empty() {
            return None;
        }
        let [low, high] = fit.range.map(|stretch| stretch * stretch - 1.0);
        let (low, high) = (low.min(-1e-9), high.max(1e-9));
        let step = (high - low) / FINE as f64;
        // rest is a node, so that small energies keep their digits
        let below = (-low / step).ceil() as usize;
        let above = (high / step).ceil() as usize;
        // Gauss' three points, exact to the fifth degree
        let piece = |k: f64| {
            let at = |x: f64| fit.value(step * (k + 0.5 + 0.5 * x));
            let outer = 0.6_f64.sqrt();
            0.5 * step * (5.0 * (at(-outer) + at(outer)) + 8.0 * at(0.0)) / 18.0
        };
        let node = |k: f64, energy: f64| [at_rest + energy, 0.5 * fit.value(step * k)];
        let mut nodes = vec![[0.0; 2]; below + above + 1];
        let mut energy = 0.0;
        nodes[below] = node(0.0, 0.0);
        for k in 0..above {
            energy += piece(k as f64);
            nodes[below + k + 1] = node((k + 1) as f64, energy);
        }
        energy = 0.0;
        for k in 1..=below {
            energy -= piece(-(k as f64));
            nodes[below - k] = node(-(k as f64), energy);
        }
        Some(Self { low: -step * below as f64, step, nodes })
    }

    /// φ(e)/kθ; beyond the table, along its end tangents.
    #[inline]
    pub fn value(&self, e: f64) -> f64 {
        let place = (e - self.low) / self.step;
        let k = (place.max(0.0) as usize).min(self.nodes.len() - 2);
        let ([y0, s0], [y1, s1]) = (self.nodes[k], self.nodes[k + 1]);
        let x = place - k as f64;
        if !(0.0..=1.0).contains(&x) {
            return if x < 0.0 { y0 + s0 * x * self.step } else { y1 + s1 * (x - 1.0) * self.step };
        }
        let (a, b) = (1.0 - x, x);
        a * a * (1.0 + 2.0 * b) * y0 + b * b * (1.0 + 2.0 * a) * y1 + self.step * a * b * (a * s0 - b * s1)
    }
}

/// max(|t′|, |t|/λ)/kθ by the larger of two neighbouring nodes: a bound, not an interpolation.
pub struct TangentTable {
    low: f64,
    step: f64,
    /// The bound of each piece.
    pieces: Vec<f64>,
}

impl TangentTable {
    /// Tabulates the tangents of the stretches observed.
    pub fn new(law: &dyn BondPotential, observed: StretchRange) -> Self {
        let low = observed.low.max(-1.0 + 1e-6);
        let high = observed.high.max(low + 1e-9);
        let step = (high - low) / PIECES as f64;
        let node = |k: usize| {
            let stretch = (1.0 + low + step * k as f64).sqrt();
            law.tension_derivative(stretch).abs().max(law.tension(stretch).abs() / stretch)
        };
        let nodes: Vec<f64> = (0..=PIECES).map(node).collect();
        Self { low, step, pieces: nodes.windows(2).map(|ends| ends[0].max(ends[1])).collect() }
    }

    /// Least e, length of a piece in e, and the bound of each piece.
    pub fn pieces(&self) -> (f64, f64, &[f64]) {
        (self.low, self.step, &self.pieces)
    }

    /// Bound at e; beyond the table, the value at its end.
    #[inline]
    pub fn value(&self, e: f64) -> f64 {
        let piece = (((e - self.low) / self.step).max(0.0) as usize).min(PIECES - 1);
        self.pieces[piece]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::potential::Law;

    #[test]
    fn energies_of_every_law() {
        for law in Law::ALL {
            let law = law.build(100.0, 1200.0, false).unwrap();
            let table = EnergyTable::new(&*law, StretchRange { low: -0.7, high: 3.0 });
            for k in 0..1000 {
                let e = -0.7 + 3.7 * f64::from(k) / 999.0;
                let (found, exact) = (table.value(e), law.energy((1.0 + e).sqrt()));
                // the cubic's error h⁴/384 φ⁗ with h = 1.8e-3
                assert!((found - exact).abs() < 1e-9 * (1.0 + exact.abs()), "{e}: {found} {exact}");
            }
        }
    }

    /// Compares energies of the fit with those of the law, relative to their size down to small strains.
    #[test]
    fn energies_of_fits() {
        for law in Law::ALL {
            let law = law.build(100.0, 1200.0, false).unwrap();
            let fit = KernelFit::new(&*law, [0.5, 2.0], 1e-9).unwrap();
            let Some(table) = EnergyTable::of_fit(&fit, law.energy(1.0)) else { continue };
            for k in 0..1000 {
                let e = -0.75 + 3.75 * f64::from(k) / 999.0;
                let (found, exact) = (table.value(e), law.energy((1.0 + e).sqrt()));
                assert!((found - exact).abs() < 1e-9 * (1.0 + exact.abs()), "{e}: {found} {exact}");
            }
            if fit.stress_free {
                // φ = t′(1)(λ − 1)²/2 at rest: three terms are left, each below 10 (λ − 1)³
                let (strain, rest) = (1e-6, table.value(0.0));
                let found = table.value(strain * (2.0 + strain)) - rest;
                let exact = 0.5 * law.tangent() * strain * strain;
                assert!((found / exact - 1.0).abs() < 1e-4, "{}: {found} {exact}", fit.kind());
            }
        }
    }
}
