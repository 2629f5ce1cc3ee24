//! Closed-form solutions and homogeneous responses: what results are compared with.

use crate::bonds::Stencil;
use crate::potential::BondPotential;

/// Kirsch's stresses [σ_xx, σ_yy, σ_xy] at (x, y) around a hole of `radius` at the origin of an infinite plate under
/// remote tension `remote` along x, Eqs (2.81)–(2.83); continued as printed inside the hole.
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
/// `ratio` = diameter/width: (2 + (1 − ratio)³)/(1 − ratio), Heywood (1952), within 1 % of Howland (1930) to 0.6.
pub fn heywood_gross(ratio: f64) -> f64 {
    (2.0 + (1.0 - ratio).powi(3)) / (1.0 - ratio)
}

/// Nominal stress P of a homogeneously deformed plane lattice under a bond law, over kθ, with F = diag(stretches):
/// P_dd = Σ t n_d ξ_d V (one-point sum), spacing 1, thickness 1.
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

/// Uniaxial response of the plane lattice: lateral stretch at which the lateral stress vanishes, and the nominal
/// stress over kθ along the pull.
pub fn lattice_uniaxial(law: &dyn BondPotential, ratio: f64, stretch: f64) -> (f64, f64) {
    let lateral = |l: f64| lattice_nominal_stress(law, ratio, [stretch, l])[1];
    // between strong contraction and slight extension the lateral stress changes sign once
    let (mut low, mut high) = (0.02, 3.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if lateral(middle) < 0.0 { low = middle } else { high = middle }
    }
    let l = 0.5 * (low + high);
    (l, lattice_nominal_stress(law, ratio, [stretch, l])[0])
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

    /// formulation.md: lattice uniaxial, n̄ = 720, unscaled, P11/E.
    #[test]
    fn lattice_uniaxial_response() {
        let law = Law::Subtract.build(720.0, 1200.0, false).unwrap();
        let kt = modulus(Space::PlaneStress, 1.0, 3.015, 1.0);
        for (stretch, expected) in [(1.2, 0.22269), (1.5, 0.59576), (2.0, 1.28691)] {
            let found = lattice_uniaxial(&*law, 3.015, stretch).1 * kt;
            assert!((found / expected - 1.0).abs() < 1e-4, "{stretch}: {found} against {expected}");
        }
    }
}
