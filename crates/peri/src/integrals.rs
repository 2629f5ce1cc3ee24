//! Integrals over the horizon of Appendix A, by quadrature of their integrands.
//!
//! Unit disk and unit ball, of unit thickness. Single-point: ∫ ξ⊗ξ⊗ξ⊗ξ/|ξ|³ dV over the horizon of a point,
//! which is a coefficient times δδ + δδ + δδ: (A.19) has tπR³/12, (A.39) πR⁴/15. Double: the same between two
//! points of the horizon, ∬ ξ⊗ξ⊗ξ⊗ξ/|ξ|³ dV dV, of which (A.18) prints t²R⁵π²/6 and (A.38) 8R⁷π²/45 for the
//! coefficient. Its trace, ∬ |ξ| dV dV, is the mean distance of two points times the square of the measure.

use crate::quadrature::mean;
use std::f64::consts::PI;

/// Pieces of a radius or a cosine, of eight points each.
const PIECES: usize = 48;
/// Directions of a circle.
const ANGLES: usize = 1024;
/// ∫ f over [from, to].
fn integral(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    let width = (to - from) / PIECES as f64;
    (0..PIECES).map(|k| mean(from + k as f64 * width, from + (k + 1) as f64 * width, &f) * width).sum()
}

/// ∫ f over a circle; the midpoint rule of a periodic function converges faster than any power.
fn around(f: impl Fn(f64) -> f64) -> f64 {
    let step = 2.0 * PI / ANGLES as f64;
    (0..ANGLES).map(|k| f((k as f64 + 0.5) * step)).sum::<f64>() * step
}

/// Computes ∫ ξᵢξⱼξₖξₗ/|ξ|³ dV of (1111) and (1122) over the disk and the ball, ∬ |ξ| dV dV over both, and
/// the trace of the published values.
pub fn all() -> [f64; 8] {
    // ξᵢξⱼξₖξₗ/|ξ|³ of (1111) and (1122), ξ = r(c, s)
    let disk = |power: [i32; 2]| {
        around(|angle| {
            let (s, c) = angle.sin_cos();
            integral(0.0, 1.0, |r| (r * c).powi(power[0]) * (r * s).powi(power[1]) / r.powi(3) * r)
        })
    };
    // ξ = r(√(1 − z²) cos φ, √(1 − z²) sin φ, z): (3333) and (1133), the circle of φ in closed form
    let ball = |power: [i32; 2], circle: f64| {
        integral(-1.0, 1.0, |z| {
            let lateral = (1.0 - z * z).powi(power[0] / 2) * z.powi(power[1]);
            integral(0.0, 1.0, |r| r.powi(4) / r.powi(3) * r * r) * lateral * circle
        })
    };
    // from a point at the radius a, the boundary is at the distance −a c + √(1 − a²s²) in the direction (c,
    // s); with a = sin t the root has no singular end
    let edge = |a: f64, c: f64| (1.0 - a * a * (1.0 - c * c)).max(0.0).sqrt() - a * c;
    let disk_trace = integral(0.0, 0.5 * PI, |t| {
        let (a, da) = t.sin_cos();
        // ∫ r·r dr
        2.0 * PI * a * da * around(|angle| edge(a, angle.cos()).powi(3) / 3.0)
    });
    let ball_trace = integral(0.0, 0.5 * PI, |t| {
        let (a, da) = t.sin_cos();
        // ∫ r·r² dr
        4.0 * PI * a * a * da * 2.0 * PI * integral(-1.0, 1.0, |c| edge(a, c).powi(4) / 4.0)
    });
    [
        disk([4, 0]),
        disk([2, 2]),
        ball([0, 4], 2.0 * PI),
        ball([2, 2], PI),
        disk_trace,
        ball_trace,
        // δδ + δδ + δδ has the trace 8 in a plane and 15 in space
        8.0 * PI * PI / 6.0 / disk_trace,
        15.0 * 8.0 * PI * PI / 45.0 / ball_trace,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with closed forms: δδ + δδ + δδ is 3 for (1111) and 1 for (1122); 128/45π is the mean
    /// distance of two points in a unit disk, 36/35 in a unit ball (Santaló 1976).
    #[test]
    fn closed_forms() {
        let expected = [
            PI / 4.0,
            PI / 12.0,
            PI / 5.0,
            PI / 15.0,
            128.0 * PI / 45.0,
            36.0 / 35.0 * (4.0 * PI / 3.0).powi(2),
            15.0 * PI / 32.0,
            35.0 / 24.0,
        ];
        for (index, (found, expected)) in all().into_iter().zip(expected).enumerate() {
            assert!((found / expected - 1.0).abs() < 1e-9, "{index}: {found} {expected}");
        }
    }
}
