//! Bond modulus kθ from Young's modulus, and the moduli of a lattice.
//!
//! The dual force f = 2t enters the equation of motion (2.6). With t ≈ 3kθ(l − 1), (2.76) and (2.80) equal
//! the standard constants of the prototype microelastic material; Poisson's ratio is 1/4 (3D, plane strain)
//! or 1/3 (plane stress).

use crate::bonds::{BodyGeometry, LatticeBonds, Stencil, VolumeCorrection};
use serde::Deserialize;
use std::f64::consts::PI;

/// Dimension and plane state of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Space {
    /// Thin sheet, bonds in its plane.
    PlaneStress,
    /// Thick slab, bonds in its cross-section (a disk, not a sphere).
    PlaneStrain,
    /// Three dimensions.
    Solid,
}

/// Source of kθ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Calibration {
    /// The continuum's integrals, (2.76) and (2.80).
    #[default]
    Continuum,
    /// Sums over the lattice: a homogeneous dilatation stores the exact energy.
    Lattice,
}

/// Poisson's ratio of bond forces along the bonds.
pub fn poisson_ratio(space: Space) -> f64 {
    if space == Space::PlaneStress { 1.0 / 3.0 } else { 0.25 }
}

/// C₁₁₁₁ of the space: E/(1 − ν²) in plane stress, else E(1 − ν)/((1 + ν)(1 − 2ν)).
pub fn stiffness_1111(space: Space, youngs_modulus: f64) -> f64 {
    let nu = poisson_ratio(space);
    if space == Space::PlaneStress {
        youngs_modulus / (1.0 - nu * nu)
    } else {
        youngs_modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
    }
}

/// Computes kθ from Young's modulus (Pa), horizon and thickness (m).
///
/// Solid: 2E/(πδ⁴), Eq. (2.76). Plane stress: 3E/(2πtδ³), Eq. (2.80). Plane strain on a disk: 8E/(5πtδ³).
pub fn modulus(space: Space, youngs_modulus: f64, horizon: f64, thickness: f64) -> f64 {
    match space {
        Space::Solid => 2.0 * youngs_modulus / (PI * horizon.powi(4)),
        Space::PlaneStress => 3.0 * youngs_modulus / (2.0 * PI * thickness * horizon.powi(3)),
        Space::PlaneStrain => 8.0 * youngs_modulus / (5.0 * PI * thickness * horizon.powi(3)),
    }
}

/// Computes kθ of bonds in a solid or, in two dimensions, in a sheet of the thickness of its particles.
pub fn modulus_in<const D: usize>(bonds: &dyn BodyGeometry<D>, youngs_modulus: f64) -> f64 {
    let volume = bonds.particles().first().map_or(0.0, |&site| bonds.volume(site as usize));
    let thickness = volume / bonds.spacing().powi(D as i32);
    let space = if D == 2 { Space::PlaneStress } else { Space::Solid };
    modulus(space, youngs_modulus, bonds.horizon(), thickness)
}

/// Factor of a calibration on kθ.
pub fn lattice_factor<const D: usize>(calibration: Calibration, bonds: &LatticeBonds<D>) -> f64 {
    match calibration {
        Calibration::Continuum => 1.0,
        Calibration::Lattice => {
            let ratio = bonds.ratio();
            1.0 / LatticeModuli::new::<D>(ratio, bonds.volume_correction()).dilatation
        }
    }
}

/// Small-strain moduli of a regular lattice, over their exact value (C₁₁₁₁, C₁₁₂₂, E over E) or plain (ν, A).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatticeModuli {
    /// C₁₁₁₁ over the isotropic one.
    pub c1111: f64,
    /// C₁₁₂₂ over the isotropic one.
    pub c1122: f64,
    /// Young's modulus along \[100\] over E.
    pub e100: f64,
    /// Young's modulus along \[110\] over E.
    pub e110: f64,
    /// Poisson's ratio along \[100\].
    pub nu: f64,
    /// Zener's anisotropy 2C₄₄/(C₁₁ − C₁₂).
    pub zener: f64,
    /// C_iijj over the exact one: the stiffness against dilatation.
    pub dilatation: f64,
}

impl LatticeModuli {
    /// Computes the moduli of a lattice with a horizon of `ratio` spacings: C_ijkl = 3kθ Σ w V ξ_i ξ_j ξ_k
    /// ξ_l/|ξ|³, E = Δx = 1.
    pub fn new<const D: usize>(ratio: f64, correction: VolumeCorrection) -> Self {
        let space = if D == 2 { Space::PlaneStress } else { Space::Solid };
        let modulus = modulus(space, 1.0, ratio, 1.0);
        let stencil = Stencil::<D>::new(ratio);
        let (mut c11, mut c12, mut trace) = (0.0, 0.0, 0.0);
        for (k, offset) in stencil.offsets.iter().enumerate() {
            let length = stencil.length(k);
            let factor = 3.0 * modulus * correction.factor(length, ratio, 1.0) / length.powi(3);
            let (x, y) = (f64::from(offset[0]), f64::from(offset[1]));
            c11 += factor * x.powi(4);
            c12 += factor * x * x * y * y;
            trace += factor * length.powi(4);
        }
        // a central-force lattice obeys Cauchy's relation C₄₄ = C₁₂
        let (c44, exact) = (c12, stiffness_1111(space, 1.0));
        let (e100, nu, along_110);
        if D == 2 {
            e100 = c11 - c12 * c12 / c11;
            nu = c12 / c11;
            let (s11, s12) = (c11 / (c11 * c11 - c12 * c12), -c12 / (c11 * c11 - c12 * c12));
            along_110 = (2.0 * s11 + 2.0 * s12 + 1.0 / c44) / 4.0;
        } else {
            e100 = (c11 - c12) * (c11 + 2.0 * c12) / (c11 + c12);
            nu = c12 / (c11 + c12);
            let (s11, s12, s44) = (1.0 / e100, -nu / e100, 1.0 / c44);
            along_110 = s11 - 0.5 * (s11 - s12 - 0.5 * s44);
        }
        let isotropic = if D == 2 { 3.0 / 8.0 } else { 1.0 / 5.0 };
        Self {
            c1111: c11 / exact,
            c1122: c12 / (exact / 3.0),
            e100,
            e110: 1.0 / along_110,
            nu,
            zener: 2.0 * c44 / (c11 - c12),
            dilatation: trace * isotropic / exact,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with formulation.md, table of lattice moduli at m = 3.015, to its printed digits. Its 3D rows
    /// are shifted by one column (ΣV/Ω stands under C₁₁₁₁, and so on) and taken from
    /// `reference/ch2/lattice_moduli.csv`, which names the columns.
    #[test]
    fn lattice_moduli_table() {
        let check = |found: LatticeModuli, expected: [f64; 6], name: &str| {
            let found = [found.c1111, found.c1122, found.e100, found.e110, found.nu, found.zener];
            for (f, (e, digits)) in
                found.iter().zip(expected.iter().zip([5e-4, 5e-4, 6e-4, 6e-4, 5e-4, 5e-4]))
            {
                assert!((f - e).abs() <= digits, "{name}: {found:?} against {expected:?}");
            }
        };
        use VolumeCorrection::{Linear, None};
        check(LatticeModuli::new::<2>(3.015, None), [1.037, 0.990, 1.0486, 1.0017, 0.3182, 0.934], "2D none");
        check(
            LatticeModuli::new::<2>(3.015, Linear),
            [0.861, 0.867, 0.859, 0.865, 0.336, 1.010],
            "2D linear",
        );
        check(
            LatticeModuli::new::<3>(3.015, None),
            [1.0355, 1.1935, 0.9777, 1.1196, 0.2775, 1.2476],
            "3D none",
        );
        check(
            LatticeModuli::new::<3>(3.015, Linear),
            [0.8540, 0.9429, 0.8219, 0.9029, 0.2690, 1.1648],
            "3D linear",
        );
    }

    /// Compares with Silling & Askari's c = 18K/(πδ⁴), and 9E/(πtδ³) in plane stress (Ha & Bobaru 2010,
    /// doi:10.1007/s10704-010-9442-4): force density c(l − 1) = 2t with t = 3kθ(l − 1).
    #[test]
    fn equals_the_constants_of_the_linear_bond() {
        let (e, delta, thickness) = (2.7, 0.31, 0.05);
        let bulk = e / (3.0 * (1.0 - 2.0 * poisson_ratio(Space::Solid)));
        let solid = 6.0 * modulus(Space::Solid, e, delta, 1.0);
        assert!((solid / (18.0 * bulk / (PI * delta.powi(4))) - 1.0).abs() < 1e-15);
        let sheet = 6.0 * modulus(Space::PlaneStress, e, delta, thickness);
        assert!((sheet / (9.0 * e / (PI * thickness * delta.powi(3))) - 1.0).abs() < 1e-15);
        let slab = 6.0 * modulus(Space::PlaneStrain, e, delta, thickness);
        let linear = 48.0 * e / (5.0 * PI * thickness * delta.powi(3));
        evidence::near("plane strain on a disk, 6kθ over 48E/(5πtδ³)", slab / linear, 1.0, 1e-15);
    }

    /// The lattice tends to the continuum: every modulus within 3 % at m = 20.
    #[test]
    fn lattice_tends_to_the_continuum() {
        let far = LatticeModuli::new::<2>(20.015, VolumeCorrection::None);
        for value in [far.c1111, far.c1122, far.e100, far.e110, far.zener, far.dilatation, 3.0 * far.nu] {
            assert!((value - 1.0).abs() < 0.03, "{far:?}");
        }
    }

    /// Compares the traces of the printed double integrals (A.18), (A.38), 128π/45 on the unit disk and
    /// 64π²/35 in the unit ball, with the distribution of distances between two points, p(r) of a disk and of
    /// a ball.
    #[test]
    fn double_integrals_of_the_appendix() {
        let n = 20_000;
        let integral = |p: &dyn Fn(f64) -> f64| -> f64 {
            (0..n)
                .map(|k| {
                    let r = 2.0 * (f64::from(k) + 0.5) / f64::from(n);
                    r * p(r) * 2.0 / f64::from(n)
                })
                .sum()
        };
        // trace of ξ⊗ξ⊗ξ⊗ξ/|ξ|³ is |ξ|; mean distance × measure²
        let disk = |r: f64| 4.0 * r / PI * (0.5 * r).acos() - r * r / PI * (4.0 - r * r).sqrt();
        let ball = |r: f64| 3.0 * r * r - 2.25 * r.powi(3) + 0.1875 * r.powi(5);
        let found = integral(&disk) * PI * PI;
        assert!((found - 128.0 * PI / 45.0).abs() < 1e-5, "{found}");
        let found = integral(&ball) * (4.0 / 3.0 * PI).powi(2);
        assert!((found - 64.0 * PI * PI / 35.0).abs() < 1e-5, "{found}");
    }

    /// Compares with `reference/ch2/lattice_moduli.csv`, rows of other horizons: C₁₁₁₁, C₁₁₂₂, E along
    /// \[100\], ν, E along \[110\], Zener's ratio and the isotropic mean.
    #[test]
    #[rustfmt::skip]
    fn lattice_moduli_at_other_horizons() {
        use VolumeCorrection::{Linear, None};
        let near = |m: LatticeModuli, expected: [f64; 7]| {
            let found = [m.c1111, m.c1122, m.e100, m.nu, m.e110, m.zener, m.dilatation];
            // eight digits are copied from the file
            assert!(
                found.iter().zip(expected).all(|(f, e)| (f / e - 1.0).abs() < 3e-8),
                "{found:?} {expected:?}"
            );
        };
        let rows = [
            (3.015, None, [
                1.03713356, 0.99019733, 1.04860210, 0.31824809, 1.00165972, 0.93361849, 1.02539950,
            ]),
            (3.015, Linear, [
                0.86076051, 0.86664499, 0.85928436, 0.33561212, 0.86516885, 1.01028973, 0.86223163,
            ]),
            (6.015, None, [
                0.98313429, 1.01630059, 0.97470286, 0.34457842, 1.00787147, 1.05147110, 0.99142587,
            ]),
            (8.015, Linear, [
                0.92282413, 0.94124460, 0.91817305, 0.33998699, 0.93659398, 1.03024331, 0.92742925,
            ]),
        ];
        for (ratio, correction, expected) in rows {
            near(LatticeModuli::new::<2>(ratio, correction), expected);
        }
        let rows = [
            (3.015, None, [
                1.03554537, 1.19345703, 0.97766676, 0.27754213, 1.11960848, 1.24761663, 1.09871003,
            ]),
            (3.015, Linear, [
                0.85400927, 0.94294951, 0.82186459, 0.26903156, 0.90292221, 1.16479791, 0.88958537,
            ]),
            (6.015, None, [
                0.99836783, 1.05133156, 0.97951856, 0.25981674, 1.02847399, 1.08174375, 1.01955332,
            ]),
            (8.015, Linear, [
                0.92156207, 0.93127787, 0.91815004, 0.25197157, 0.92723336, 1.01589794, 0.92544839,
            ]),
        ];
        for (ratio, correction, expected) in rows {
            near(LatticeModuli::new::<3>(ratio, correction), expected);
        }
    }

    /// Checks that (A.18) and (A.38) print 2Ω times the single-point integrals of (2.77) and (2.73): ∫
    /// ξξξξ/|ξ|³ dV has the coefficients tπR³/12 and πR⁴/15 that the calibration needs, by quadrature of its
    /// components.
    #[test]
    fn single_point_integrals() {
        let n = 2000;
        let middle = |k: i32, width: f64| (f64::from(k) + 0.5) * width / f64::from(n);
        // disk: ∫ r·r dr = 1/3 times the mean of c⁴ and c²s² over the circle; ball: 1/4, with c from −1 to 1
        let (mut disk, mut ball) = ([0.0; 2], [0.0; 2]);
        for k in 0..n {
            let (s, c) = middle(k, 2.0 * PI).sin_cos();
            disk[0] += c.powi(4) * 2.0 * PI / f64::from(n) / 3.0;
            disk[1] += c * c * s * s * 2.0 * PI / f64::from(n) / 3.0;
            let z = middle(k, 2.0) - 1.0;
            ball[0] += z.powi(4) * 2.0 / f64::from(n) * 2.0 * PI / 4.0;
            ball[1] += z * z * (1.0 - z * z) * 2.0 / f64::from(n) * PI / 4.0;
        }
        // δδ + δδ + δδ is 3 for 1111 and 1 for 1122; the midpoint rule in z is of second order
        for (found, coefficient, bound) in [(disk, PI / 12.0, 1e-12), (ball, PI / 15.0, 1e-5)] {
            assert!((found[0] / (3.0 * coefficient) - 1.0).abs() < bound, "{found:?}");
            assert!((found[1] / coefficient - 1.0).abs() < bound, "{found:?}");
        }
        // the printed values are those with the factor 2Ω, not the double integrals of the test above
        assert!((PI * PI / 6.0 / (2.0 * PI) - PI / 12.0).abs() < 1e-15);
        assert!((8.0 * PI * PI / 45.0 / (8.0 / 3.0 * PI) - PI / 15.0).abs() < 1e-15);
        assert!((8.0 * PI * PI / 6.0 / (128.0 * PI / 45.0) - 1.473).abs() < 5e-4);
        assert!((15.0 * 8.0 * PI * PI / 45.0 / (64.0 * PI * PI / 35.0) - 1.458).abs() < 5e-4);
    }
}
