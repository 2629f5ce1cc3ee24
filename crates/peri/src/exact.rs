//! Closed-form solutions and homogeneous responses, for comparison with results.

mod hole;
mod plate;

pub use hole::{HoleComparison, HoleRegion};
pub use plate::Plate;

use crate::bonds::Stencil;
use crate::potential::BondPotential;
use crate::quadrature::mean;
use polycore::numerics::bisected;

/// Kirsch's stresses [σ_xx, σ_yy, σ_xy] at (x, y) around a hole of `radius` at the origin of an infinite
/// plate under remote tension `remote` along x, Eqs (2.81)–(2.83); continued as printed inside the hole.
pub fn kirsch(x: f64, y: f64, radius: f64, remote: f64) -> [f64; 3] {
    let q = radius * radius / (x * x + y * y);
    let angle = y.atan2(x);
    let (c2, c4) = ((2.0 * angle).cos(), (4.0 * angle).cos());
    let (s2, s4) = ((2.0 * angle).sin(), (4.0 * angle).sin());
    [
        remote * (1.0 - q * (1.5 * c2 + c4) + 1.5 * q * q * c4),
        remote * (-q * (0.5 * c2 - c4) - 1.5 * q * q * c4),
        remote * (-q * (0.5 * s2 + s4) + 1.5 * q * q * s4),
    ]
}

/// Stress concentration over the remote (gross) stress of a central hole in a plate of finite width, with
/// `ratio` = diameter/width: (2 + (1 − ratio)³)/(1 − ratio), Heywood (1952), within 1 % of Howland (1930) to
/// 0.6.
pub fn heywood_gross(ratio: f64) -> f64 {
    (2.0 + (1.0 - ratio).powi(3)) / (1.0 - ratio)
}

/// Observed order: slope of ln(error) over ln(spacing) by least squares.
pub fn observed_order(spacing: &[f64], error: &[f64]) -> f64 {
    let points: Vec<(f64, f64)> = spacing.iter().zip(error).map(|(h, e)| (h.ln(), e.ln())).collect();
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (top, bottom) =
        points.iter().fold((0.0, 0.0), |(t, b), p| (t + (p.0 - x) * (p.1 - y), b + (p.0 - x) * (p.0 - x)));
    top / bottom
}

/// Nominal stress P of a homogeneously deformed plane lattice under a bond law, over kθ, with F =
/// diag(stretches): P_dd = Σ t n_d ξ_d V (one-point sum), spacing 1, thickness 1.
pub fn lattice_nominal_stress(law: &dyn BondPotential, ratio: f64, stretches: [f64; 2]) -> [f64; 2] {
    let stencil = Stencil::<2>::new(ratio);
    let mut stress = [0.0; 2];
    for (k, offset) in stencil.offsets.iter().enumerate() {
        let bond = offset.map(f64::from);
        let deformed = [stretches[0] * bond[0], stretches[1] * bond[1]];
        let length = deformed[0].hypot(deformed[1]);
        let tension = law.tension(length / stencil.length(k));
        for d in 0..2 {
            stress[d] += tension * deformed[d] / length * bond[d];
        }
    }
    stress
}

/// Uniaxial response of the plane lattice: lateral stretch at which the lateral stress vanishes, and the
/// nominal stress over kθ along the pull. Both NaN if no lateral stretch between 0.02 and 3 is free of
/// stress.
pub fn lattice_uniaxial(law: &dyn BondPotential, ratio: f64, stretch: f64) -> (f64, f64) {
    uniaxial(stretch, |lateral| lattice_nominal_stress(law, ratio, [stretch, lateral]))
}

/// Nominal stress [along, across] over kθ of the continuum of `D` dimensions (2: sheet of thickness 1, 3:
/// solid) with a horizon of 1, F = diag(pull, lateral, …): P = ∫ t n ⊗ ξ dV over directions, r integrated in
/// closed form.
pub fn continuum_nominal_stress<const D: usize>(law: &dyn BondPotential, stretches: [f64; 2]) -> [f64; 2] {
    let [pull, lateral] = stretches;
    // (F n)·e n·e/|F n| of a bond at an angle of cosine c to the pull
    let along = |c: f64| {
        let across = 1.0 - c * c;
        let length = (pull * pull * c * c + lateral * lateral * across).sqrt();
        let scale = law.tension(length) / length;
        [scale * pull * c * c, scale * lateral * across]
    };
    let part = |axis: usize| {
        if D == 2 {
            // ∫ r r dr = 1/3; the mean over a period converges faster than any power
            (0..ANGLES)
                .map(|k| along((std::f64::consts::PI * (k as f64 + 0.5) / ANGLES as f64).cos())[axis])
                .sum::<f64>()
                / ANGLES as f64
                * (2.0 * std::f64::consts::PI / 3.0)
        } else {
            // ∫ r r² dr = 1/4, two lateral directions
            let piece =
                |k: usize| mean(k as f64 / PIECES as f64, (k + 1) as f64 / PIECES as f64, |c| along(c)[axis]);
            let directions = if axis == 0 { 1.0 } else { 2.0 };
            (0..PIECES).map(piece).sum::<f64>() / PIECES as f64 * (std::f64::consts::PI / directions)
        }
    };
    [part(0), part(1)]
}

/// [`lattice_uniaxial`] of the continuum of [`continuum_nominal_stress`].
pub fn continuum_uniaxial<const D: usize>(law: &dyn BondPotential, stretch: f64) -> (f64, f64) {
    uniaxial(stretch, |lateral| continuum_nominal_stress::<D>(law, [stretch, lateral]))
}

/// Directions in a half plane; pieces of the cosine in a half space, of eight directions each. They must
/// resolve the rotation of bonds into the pull, over an angle of lateral/pull stretch: the error is below
/// 1e-9 while that angle exceeds 0.01.
const ANGLES: usize = 1024;
const PIECES: usize = 128;

/// The lateral stretch free of stress nearest to 1, and the stress along the pull.
fn uniaxial(stretch: f64, stress: impl Fn(f64) -> [f64; 2]) -> (f64, f64) {
    // a body contracts when pulled: strong contraction has its own, unphysical, free states
    let end: f64 = if stretch >= 1.0 { 0.02 } else { 3.0 };
    let at = |k: u32| end.powf(f64::from(k) / 96.0);
    let sign = |lateral: f64| stress(lateral)[1] < 0.0;
    let start = sign(at(0));
    if stress(1.0)[1] == 0.0 {
        return (1.0, stress(1.0)[0]);
    }
    let Some(k) = (1..=96).find(|k| sign(at(*k)) != start) else { return (f64::NAN, f64::NAN) };
    let lateral = bisected(at(k - 1), at(k), 60, |lateral| sign(lateral) == start);
    (lateral, stress(lateral)[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::{Space, modulus};
    use crate::potential::Law;

    #[test]
    fn kirsch_has_a_free_hole_a_remote_field_and_equilibrium() {
        let (a, s) = (0.06, 2.0);
        for k in 0..24 {
            let angle = f64::from(k) * 0.26;
            let (n, m) = (angle.cos(), angle.sin());
            let [xx, yy, xy] = kirsch(a * n, a * m, a, s);
            assert!(
                (xx * n + xy * m).abs() < 1e-14 && (xy * n + yy * m).abs() < 1e-14,
                "traction at {angle}"
            );
            let far = kirsch(1e5 * n, 1e5 * m, a, s);
            assert!((far[0] - s).abs() + far[1].abs() + far[2].abs() < 1e-10);
            let (x, y, h) = (0.1 * n, 0.1 * m, 1e-5);
            let d = |i: usize, dx: f64, dy: f64| {
                (kirsch(x + dx, y + dy, a, s)[i] - kirsch(x - dx, y - dy, a, s)[i]) / (2.0 * h)
            };
            // second-order differences: error about h² times third derivatives s/a³
            let bound = 10.0 * h * h * s / a.powi(3);
            assert!(
                (d(0, h, 0.0) + d(2, 0.0, h)).abs() < bound && (d(2, h, 0.0) + d(1, 0.0, h)).abs() < bound
            );
        }
        assert!((kirsch(0.0, a, a, 1.0)[0] - 3.0).abs() < 1e-14);
        assert!((kirsch(a, 0.0, a, 1.0)[1] + 1.0).abs() < 1e-14);
    }

    #[test]
    fn finite_width_of_the_plate() {
        // formulation.md: 3.047
        assert!((heywood_gross(0.12) - 3.047).abs() < 5e-4);
        assert!((heywood_gross(1e-9) - 3.0).abs() < 1e-8);
    }

    #[test]
    fn order_of_a_power_law() {
        let h = [4.0, 2.0, 1.0];
        let error = h.map(|h: f64| 0.3 * h.powf(0.45));
        assert!((observed_order(&h, &error) - 0.45).abs() < 1e-14);
    }

    /// Compares with formulation.md: lattice uniaxial, n̄ = 720, unscaled, P11/E.
    #[test]
    fn lattice_uniaxial_response() {
        let law = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
        let kt = modulus(Space::PlaneStress, 1.0, 3.015, 1.0);
        for (stretch, expected) in [(1.2, 0.22269), (1.5, 0.59576), (2.0, 1.28691)] {
            let found = lattice_uniaxial(&*law, 3.015, stretch).1 * kt;
            assert!((found / expected - 1.0).abs() < 1e-4, "{stretch}: {found} against {expected}");
        }
    }
    /// Compares with `reference/ch2/uniaxial.csv`: P11/E and lateral stretch of the continuum with K rescaled
    /// to 3, n̄ = 720, D̂ = 1200 (25 where noted), sheet then solid. Its tables and quadratures are accurate
    /// to about 1e-5.
    #[test]
    fn continuum_uniaxial_response() {
        let table = [
            (Law::ChainOffset, 720.0, 1.08, [0.082056, 0.973343, 0.083324, 0.979868]),
            (Law::ChainOffset, 720.0, 1.98, [1.190601, 0.688686, 1.343329, 0.750009]),
            (Law::ChainOffset, 720.0, 2.94, [2.555969, 0.443533, 3.041127, 0.530434]),
            (Law::ChainOffset, 25.0, 2.94, [3.199784, 0.403714, 3.644650, 0.500326]),
            (Law::ChainAffine, 720.0, 1.08, [0.076509, 0.974396, 0.078615, 0.980515]),
            (Law::ChainAffine, 720.0, 1.98, [0.639180, 0.783667, 0.782105, 0.817777]),
            (Law::Linear, 720.0, 1.5, [0.565310, 0.835811, 0.610012, 0.872009]),
        ];
        for (law, links, stretch, expected) in table {
            let built = law.build(links, 1200.0, true).unwrap();
            let sheet = continuum_uniaxial::<2>(&*built, stretch);
            let solid = continuum_uniaxial::<3>(&*built, stretch);
            let found = [
                sheet.1 * modulus(Space::PlaneStress, 1.0, 1.0, 1.0),
                sheet.0,
                solid.1 * modulus(Space::Solid, 1.0, 1.0, 1.0),
                solid.0,
            ];
            for (f, e) in found.iter().zip(expected) {
                assert!(
                    (f / e - 1.0).abs() < 2e-5,
                    "{law:?} {links} {stretch}: {found:?} against {expected:?}"
                );
            }
        }
    }

    /// Checks that the continuum's small-strain response is E and ν of the calibration, and that a lattice of
    /// long horizon converges to it.
    #[test]
    fn small_strain_and_long_horizon() {
        let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
        for strain in [1e-6, -1e-6] {
            let (lateral, stress) = continuum_uniaxial::<2>(&*law, 1.0 + strain);
            let sheet = modulus(Space::PlaneStress, 1.0, 1.0, 1.0);
            // second-order terms of about the strain
            assert!((stress * sheet / strain - 1.0).abs() < 1e-5);
            evidence::near("Poisson's ratio in plane stress", (1.0 - lateral) / strain, 1.0 / 3.0, 1e-5);
            let (lateral, stress) = continuum_uniaxial::<3>(&*law, 1.0 + strain);
            let solid = modulus(Space::Solid, 1.0, 1.0, 1.0);
            assert!((stress * solid / strain - 1.0).abs() < 1e-5);
            evidence::near("Poisson's ratio in space", (1.0 - lateral) / strain, 0.25, 1e-5);
        }
        let exact = continuum_uniaxial::<2>(&*law, 1.6).1 * modulus(Space::PlaneStress, 1.0, 1.0, 1.0);
        let far = lattice_uniaxial(&*law, 40.015, 1.6).1 * modulus(Space::PlaneStress, 1.0, 40.015, 1.0);
        // bonds at the rim of the horizon: a relative area of about m^{-3/2}, stiffness r³
        assert!((far / exact - 1.0).abs() < 0.01, "{far} {exact}");
    }

    /// The reference finds no stress-free lateral stretch beyond l ≈ 8; a stretch of 1 has no stress.
    #[test]
    fn limits_of_the_uniaxial_response() {
        let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
        for stretch in [9.2615, 12.0] {
            let (lateral, stress) = continuum_uniaxial::<2>(&*law, stretch);
            assert!(lateral.is_nan() && stress.is_nan());
        }
        let (lateral, stress) = continuum_uniaxial::<2>(&*law, 4.6974);
        assert!((lateral - 0.170884).abs() < 2e-5, "{lateral}");
        let expected = 5.224564;
        assert!((stress * modulus(Space::PlaneStress, 1.0, 1.0, 1.0) / expected - 1.0).abs() < 2e-5);
        let (lateral, stress) = lattice_uniaxial(&*law, 3.015, 1.0);
        assert!((lateral - 1.0).abs() < 1e-12 && stress.abs() < 1e-12);
    }
}
