//! A manufactured solution: a decaying product of cosines in an insulated cube.

use std::f64::consts::PI;

/// T = T₀ + A e^{−ωt} ∏ cos(πx_d/L) in the cube from 0 to L, insulated on all sides, with the heat source
/// r = (−ρcω + 3kπ²/L²)(T − T₀).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Manufactured {
    /// T₀, K.
    pub base: f64,
    /// A, K.
    pub amplitude: f64,
    /// ω, 1/s.
    pub rate: f64,
    /// L, m.
    pub length: f64,
    /// k, W/(m K).
    pub conductivity: f64,
    /// ρc, J/(m³ K).
    pub heat_capacity: f64,
}

impl Manufactured {
    /// T, K.
    pub fn temperature(&self, [x, y, z]: [f64; 3], time: f64) -> f64 {
        let cosine = |x: f64| (PI * x / self.length).cos();
        self.base + self.amplitude * (-self.rate * time).exp() * cosine(x) * cosine(y) * cosine(z)
    }

    /// ∇T, K/m.
    pub fn gradient(&self, at: [f64; 3], time: f64) -> [f64; 3] {
        let wave = PI / self.length;
        [0, 1, 2].map(|d| {
            let factor = |e: usize| if e == d { -wave * (wave * at[e]).sin() } else { (wave * at[e]).cos() };
            self.amplitude * (-self.rate * time).exp() * factor(0) * factor(1) * factor(2)
        })
    }

    /// Heat source r, W/m³.
    pub fn source(&self, at: [f64; 3], time: f64) -> f64 {
        let wave = PI / self.length;
        (3.0 * self.conductivity * wave * wave - self.heat_capacity * self.rate)
            * (self.temperature(at, time) - self.base)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_solves_the_heat_equation_with_insulated_sides() {
        let exact = Manufactured {
            base: 400.0,
            amplitude: 50.0,
            rate: 0.1,
            length: 0.01,
            conductivity: 0.25,
            heat_capacity: 1010.0 * 2200.0,
        };
        let (at, time, h, dt) = ([0.0021, 0.0037, 0.0084], 3.0, 1e-5, 1e-3);
        let mut laplacian = 0.0;
        for d in 0..3 {
            let moved = |step: f64| {
                let mut place = at;
                place[d] += step;
                exact.temperature(place, time)
            };
            laplacian += (moved(h) - 2.0 * moved(0.0) + moved(-h)) / (h * h);
            let slope = (moved(h) - moved(-h)) / (2.0 * h);
            assert!((exact.gradient(at, time)[d] - slope).abs() < 1e-5 * slope.abs());
        }
        let rate = (exact.temperature(at, time + dt) - exact.temperature(at, time - dt)) / (2.0 * dt);
        let source = exact.heat_capacity * rate - exact.conductivity * laplacian;
        // truncation: (πh/L)²/12 = 8e-7 of the Laplacian
        assert!((source / exact.source(at, time) - 1.0).abs() < 1e-4, "{source}");
        for d in 0..3 {
            for side in [0.0, exact.length] {
                let mut place = at;
                place[d] = side;
                assert!(exact.gradient(place, time)[d].abs() < 1e-11);
            }
        }
    }
}
