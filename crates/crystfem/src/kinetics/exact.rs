//! Exact solutions of the kinetics: isothermal (Avrami) and at a constant cooling rate.

use super::Kinetics;
use polycore::numerics::bisected;

/// α = 1 − exp(−ln 2 (t/t_½)ⁿ), Eqs (4.2) and (4.6).
pub fn avrami(time: f64, half_time: f64, exponent: f64) -> f64 {
    -(-std::f64::consts::LN_2 * (time / half_time).powf(exponent)).exp_m1()
}

/// z at a constant cooling rate, z(T) = q⁻¹ ∫_T^{T_start} K dT, on equally spaced temperatures.
#[derive(Clone, Debug)]
pub struct CoolingCurve {
    kinetics: Kinetics,
    /// Cooling rate q, K/s.
    rate: f64,
    /// Temperatures, K, falling.
    pub temperature: Vec<f64>,
    /// z at the temperatures.
    pub z: Vec<f64>,
}

/// Nodes and weights of Gauss' rule of five points on \[−1, 1\] (Abramowitz & Stegun, table 25.4).
const GAUSS_5: [[f64; 2]; 5] = [
    [-0.906_179_845_938_664, 0.236_926_885_056_189_08],
    [-0.538_469_310_105_683_1, 0.478_628_670_499_366_47],
    [0.0, 0.568_888_888_888_888_9],
    [0.538_469_310_105_683_1, 0.478_628_670_499_366_47],
    [0.906_179_845_938_664, 0.236_926_885_056_189_08],
];

/// Cools from `start` to `end`, K, at `rate`, K/s, from a relative crystallinity `seed`. Gauss' rule of five
/// points on at least `points − 1` intervals of at most 0.25 K: exact to rounding.
pub fn cooling_curve(
    kinetics: &Kinetics,
    rate: f64,
    start: f64,
    end: f64,
    seed: f64,
    points: usize,
) -> CoolingCurve {
    let count = points.max(2).max(((start - end).abs() * 4.0).ceil() as usize + 1);
    let width = (start - end) / (count - 1) as f64;
    let mut curve = CoolingCurve {
        kinetics: *kinetics,
        rate,
        temperature: vec![start],
        z: vec![kinetics.z_of_degree(seed)],
    };
    let mut z = curve.z[0];
    for interval in 0..count - 1 {
        let top = start - interval as f64 * width;
        z += integral(kinetics, top - width, top) / rate;
        curve.temperature.push(start - (interval + 1) as f64 * width);
        curve.z.push(z);
    }
    curve
}

/// ∫K dT over a short interval.
fn integral(kinetics: &Kinetics, low: f64, high: f64) -> f64 {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    half * GAUSS_5.iter().map(|[node, weight]| weight * kinetics.rate(middle + node * half)).sum::<f64>()
}

impl CoolingCurve {
    /// Interpolates z at a temperature within the range.
    pub fn z_at(&self, temperature: f64) -> f64 {
        let last = self.temperature.len() - 1;
        let index = self.temperature.partition_point(|&t| t >= temperature).clamp(1, last) - 1;
        self.z[index] + integral(&self.kinetics, temperature, self.temperature[index]) / self.rate
    }

    /// Temperature at which α is reached, K; `None` if it is not.
    pub fn temperature_at(&self, degree: f64) -> Option<f64> {
        let z = self.kinetics.z_of_degree(degree);
        if self.z[self.z.len() - 1] < z || self.z[0] > z {
            return None;
        }
        let index = self.z.partition_point(|&x| x < z).max(1);
        Some(bisected(self.temperature[index], self.temperature[index - 1], 80, |t| self.z_at(t) >= z))
    }

    /// Temperature of the largest dα/dt, K.
    pub fn peak(&self) -> f64 {
        let speed = |t: f64| self.kinetics.degree_slope(self.z_at(t)) * self.kinetics.rate(t);
        let speeds: Vec<f64> = self.temperature.iter().map(|&t| speed(t)).collect();
        let top = (0..speeds.len()).max_by(|&a, &b| speeds[a].total_cmp(&speeds[b])).unwrap_or(0);
        let (mut high, mut low) =
            (self.temperature[top.saturating_sub(1)], self.temperature[(top + 1).min(speeds.len() - 1)]);
        // golden section: a maximum is determined to √ε of the width only
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        for _ in 0..60 {
            let (a, b) = (high - golden * (high - low), low + golden * (high - low));
            if speed(a) > speed(b) { high = b } else { low = a }
        }
        0.5 * (low + high)
    }
}
