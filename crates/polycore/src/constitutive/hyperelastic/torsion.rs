//! Torsion of a solid cylinder held at a length: torque and axial force of an incompressible law.
//!
//! A cylinder of radius R is stretched to λ and twisted by the angle ψ, both per undeformed length (Rivlin,
//! doi:10.1098/rsta.1949.0009). At sR, with k = sψR, hoop and axis span
//!
//! B = [(1 + k²)/λ, k√λ; k√λ, λ²],
//!
//! and the radial stretch is λ^(−1/2): every ring is a sheet stretched in the plane of hoop and axis, whose
//! stresses σ a free face determines. Equilibrium, dσᵣᵣ/dr = (σ_θθ − σᵣᵣ)/r with σᵣᵣ = 0 at the surface, adds
//! a pressure, which moves into the integrals by parts:
//!
//! 2M/(πR³) = 4 λ^(−3/2) ∫ σ_θz s² ds,  N/(πR²) = λ⁻¹ ∫ (2σ_zz − σ_θθ) s ds,  s from 0 to 1.
//!
//! At λ = 1 and in invariants these are M = 4πψ ∫ (W₁ + W₂) r³ dr and N = −2πψ² ∫ (W₁ + 2W₂) r³ dr.

use super::homogeneous::biaxial;
use super::{Error, Hyperelastic};

/// Cylinder, stretched and twisted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwistedCylinder {
    /// Length over undeformed length, λ.
    pub stretch: f64,
    /// Amount of shear at the surface, ψR: angle per undeformed length times undeformed radius, from 0 on.
    pub shear: f64,
}

/// Ring of a cylinder, with the share of its nominal stresses in torque and axial force.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ring {
    /// Principal stretches in the plane of hoop and axis.
    pub stretches: [f64; 2],
    /// Factors of P₁ and P₂ in 2M/(πR³), and in N/(πR²).
    shares: [[f64; 2]; 2],
}

/// Number of rings, by Gauss's rule in t with s = 1 − (1 − t)³: exact for polynomials in s up to the 20th
/// power. Rings crowd at the surface, where a law that locks is steep: the torque of Gent's law is right to
/// 1e-9 at 99.9 % of its locking shear and to 1e-6 at 99.99 %.
const RINGS: usize = 32;

/// Abscissae above 0 on [−1, 1] and their weights.
const GAUSS: [(f64, f64); RINGS / 2] = [
    (0.9972638618494816, 0.007018610009470506),
    (0.9856115115452684, 0.016274394730905743),
    (0.9647622555875064, 0.025392065309262024),
    (0.9349060759377397, 0.034273862913021765),
    (0.8963211557660521, 0.042835898022226836),
    (0.84936761373257, 0.05099805926237609),
    (0.7944837959679424, 0.058684093478535565),
    (0.7321821187402897, 0.06582222277636168),
    (0.6630442669302152, 0.07234579410884834),
    (0.5877157572407623, 0.07819389578707023),
    (0.5068999089322294, 0.08331192422694671),
    (0.42135127613063533, 0.08765209300440378),
    (0.33186860228212767, 0.09117387869576378),
    (0.23928736225213706, 0.09384439908080451),
    (0.1444719615827965, 0.09563872007927471),
    (0.048307665687738324, 0.09654008851472766),
];

impl TwistedCylinder {
    /// Principal stretches at the surface in the plane of hoop and axis, the larger one first.
    pub fn surface(self) -> [f64; 2] {
        self.plane(1.0).0
    }

    /// Returns the cylinder of these stretches at the surface, a ≥ b: λ = (ab)², ψR =
    /// √((a² − λ²)(λ − a⁻²)).
    pub fn from_surface([a, b]: [f64; 2]) -> Self {
        let stretch = (a * b) * (a * b);
        let square = (a - stretch) * (a + stretch) * (stretch - 1.0 / (a * a));
        Self { stretch, shear: square.max(0.0).sqrt() }
    }

    /// Computes [2M/(πR³), N/(πR²)] of a law, Pa: torque and axial force of the undeformed radius R.
    ///
    /// # Errors
    /// As [`biaxial`], at a ring or at the surface.
    pub fn stresses<L: Hyperelastic + ?Sized>(self, law: &L) -> Result<[f64; 2], Error> {
        let [a, b] = self.surface();
        biaxial(law, a, b)?;
        let mut sum = [0.0; 2];
        for ring in self.rings() {
            let own = ring.observed(biaxial(law, ring.stretches[0], ring.stretches[1])?);
            sum = [sum[0] + own[0], sum[1] + own[1]];
        }
        Ok(sum)
    }

    /// Principal stretches of hoop and axis at sR, and (B_zz − B_θθ, 2B_θz) over the difference of their
    /// squares: cosine and sine of twice the angle between the axis and the first.
    fn plane(self, s: f64) -> ([f64; 2], [f64; 2]) {
        let (l, k) = (self.stretch, s * self.shear);
        let (axial, hoop, shear) = (l * l, (1.0 + k * k) / l, k * l.sqrt());
        let half = (0.5 * (axial - hoop)).hypot(shear);
        let first = (0.5 * (axial + hoop) + half).sqrt();
        let turn = if half > 0.0 { [0.5 * (axial - hoop) / half, shear / half] } else { [1.0, 0.0] };
        ([first, l.sqrt() / first], turn)
    }

    /// Rings whose contributions add up to the observed stresses.
    pub(super) fn rings(self) -> [Ring; RINGS] {
        std::array::from_fn(|i| {
            let (abscissa, weight) = GAUSS[i / 2];
            // 1 − t
            let rest = 0.5 * if i % 2 == 0 { 1.0 + abscissa } else { 1.0 - abscissa };
            let s = 1.0 - rest.powi(3);
            let ([a, b], [cosine, sine]) = self.plane(s);
            let weight = 1.5 * weight * rest * rest;
            // σ_θz = ½(σ₁ − σ₂) sin, 2σ_zz − σ_θθ = ½(σ₁ + σ₂) + 3/2 (σ₁ − σ₂) cos, σᵢ = λᵢPᵢ
            let torque = 2.0 * weight * s * s * sine / (self.stretch * self.stretch.sqrt());
            let force = weight * s / self.stretch;
            let shares = [
                [torque * a, -torque * b],
                [force * (0.5 + 1.5 * cosine) * a, force * (0.5 - 1.5 * cosine) * b],
            ];
            Ring { stretches: [a, b], shares }
        })
    }
}

impl Ring {
    /// Returns the contribution of nominal stresses, or of their derivatives, to 2M/(πR³) and N/(πR²).
    pub fn observed(&self, nominal: [f64; 2]) -> [f64; 2] {
        self.shares.map(|share| share[0] * nominal[0] + share[1] * nominal[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::data::{Mode, TestData, TestState};
    use crate::constitutive::hyperelastic::fit::{fit, residuals};
    use crate::constitutive::hyperelastic::homogeneous::uniaxial;
    use crate::constitutive::hyperelastic::{Coverage, Gent, MODELS, MooneyRivlin, model};

    const STATES: [(f64, f64); 6] = [(1.0, 0.01), (1.0, 0.7), (1.0, 2.5), (1.3, 1.2), (2.0, 0.4), (0.8, 1.0)];

    fn cylinders() -> impl Iterator<Item = TwistedCylinder> {
        STATES.into_iter().map(|(stretch, shear)| TwistedCylinder { stretch, shear })
    }

    /// Rivlin's solution for W = C₁(I₁ − 3) + C₂(I₂ − 3), γ = ψR: 2M/(πR³) = 2γ(C₁ + C₂/λ)/λ, N/(πR²) =
    /// 2(λ − λ⁻²)(C₁ + C₂/λ) − γ²(½C₁ + C₂/λ)/λ²; at λ = 1 M = πψR⁴(C₁ + C₂), N = −½πψ²R⁴(C₁ + 2C₂).
    #[test]
    fn mooney_and_rivlin_in_closed_form() {
        let [a, b] = [0.17e6, 0.04e6];
        let law = MooneyRivlin::new(a, b).unwrap();
        let mut worst: f64 = 0.0;
        for cylinder @ TwistedCylinder { stretch: l, shear } in cylinders() {
            let sum = a + b / l;
            let square = shear * shear;
            let expected =
                [2.0 * shear * sum / l, 2.0 * (l - l.powi(-2)) * sum - square * (0.5 * a + b / l) / (l * l)];
            let found = cylinder.stresses(&law).unwrap();
            for (found, expected) in found.into_iter().zip(expected) {
                worst = worst.max((found / expected - 1.0).abs());
            }
        }
        evidence::at_most("torque and force of Mooney–Rivlin torsion, relative", worst, 1e-9);
    }

    /// Gent's law at λ = 1, W₁ = μJ/(2(J − k²)): 2M/(πR³) = 4μγJ ∫ s³ ds/(J − γ²s²) = −2μJ(1/γ + J ln(1 −
    /// γ²/J)/γ³), N/(πR²) = −¼γ 2M/(πR³) as W₂ = 0; to 99.9 % of the locking shear. Beyond it the law has no
    /// torque.
    #[test]
    fn gent_in_closed_form() {
        let (modulus, limit) = (0.3e6, 4.0_f64);
        let law = Gent::new(modulus, limit).unwrap();
        let mut worst: f64 = 0.0;
        for part in [0.2, 0.5, 0.9, 0.99, 0.999] {
            let shear = part * limit.sqrt();
            let logarithm = (-shear * shear / limit).ln_1p();
            let torque = -2.0 * modulus * limit * (1.0 / shear + limit * logarithm / shear.powi(3));
            let found = TwistedCylinder { stretch: 1.0, shear }.stresses(&law).unwrap();
            worst = worst.max((found[0] / torque - 1.0).abs());
            worst = worst.max((found[1] / (-0.25 * shear * torque) - 1.0).abs());
        }
        assert!(TwistedCylinder { stretch: 1.0, shear: 1.001 * limit.sqrt() }.stresses(&law).is_err());
        evidence::at_most("torque and force of Gent's law near locking, relative", worst, 1e-8);
    }

    /// Small twists have 2M/(πR³) = μψR, an untwisted cylinder is a bar; a state returns from its stretches.
    #[test]
    fn limits_of_all_laws() {
        let mut worst: f64 = 0.0;
        for model in MODELS {
            let law = model.law(model.example).unwrap();
            let small = TwistedCylinder { stretch: 1.0, shear: 1e-4 }.stresses(&law).unwrap();
            worst = worst.max((small[0] / (1e-4 * law.shear_modulus()) - 1.0).abs());
            let bar = TwistedCylinder { stretch: 1.4, shear: 0.0 }.stresses(&law).unwrap();
            assert_eq!(bar[0], 0.0, "{}", model.key);
            worst = worst.max((bar[1] / uniaxial(&law, 1.4).unwrap() - 1.0).abs());
        }
        for cylinder in cylinders() {
            let found = TwistedCylinder::from_surface(cylinder.surface());
            worst = worst.max((found.stretch / cylinder.stretch - 1.0).abs());
            worst = worst.max((found.shear / cylinder.shear - 1.0).abs());
        }
        evidence::at_most("limits of torsion of all laws, relative", worst, 1e-6);
        let rest = TwistedCylinder { stretch: 1.0, shear: 0.0 };
        assert_eq!(rest.stresses(&model("gent").unwrap().law(&[1e6, 50.0]).unwrap()).unwrap(), [0.0; 2]);
    }

    fn table(law: &dyn Hyperelastic) -> TestData {
        let state = |cylinder: TwistedCylinder| {
            TestState::new(Mode::Torsion, cylinder.surface(), cylinder.stresses(law).unwrap())
        };
        TestData::new(String::new(), cylinders().map(state).collect())
    }

    /// Every law returns from torque and force that it has itself, by finite differences and in Ogden's
    /// closed form; it moves with the modulus.
    #[test]
    fn laws_return_from_their_torsion() {
        let mut worst: f64 = 0.0;
        for key in ["neo-hookean", "mooney-rivlin", "yeoh", "ogden-1", "ogden-2", "gent", "eight-chain"] {
            let model = model(key).unwrap();
            let law = model.law(model.example).unwrap();
            let table = table(&law);
            assert!(residuals(&law, &table).unwrap().iter().all(|r| r.abs() < 1e-8 * law.shear_modulus()));
            let found = fit(model, &table).unwrap();
            worst = worst.max(found.rms / law.shear_modulus());
            let modulus = found.law.shear_modulus() / law.shear_modulus();
            assert!((modulus - 1.0).abs() < 1e-3, "{key}: {modulus}");
        }
        evidence::at_most("rms of fits to torsion of the laws themselves over μ", worst, 1e-6);
    }

    /// A table of torsion covers pure shear up to the surface and tension to the held length.
    #[test]
    fn torsion_covers_its_rings() {
        let state = |stretch: f64, shear: f64| {
            let cylinder = TwistedCylinder { stretch, shear };
            TestState::new(Mode::Torsion, cylinder.surface(), [1e5, 0.0])
        };
        let coverage = |states: Vec<TestState>| Coverage::new(&TestData::new(String::new(), states)).unwrap();
        let held = coverage(vec![state(1.0, 1.5)]);
        for (stretch, inside) in [(1.5, true), (2.0, true), (2.2, false)] {
            assert_eq!(held.contains([stretch, 1.0, 1.0 / stretch]), inside, "{stretch}");
        }
        assert!(!held.contains([1.5, 1.5_f64.powf(-0.5), 1.5_f64.powf(-0.5)]));
        let stretched = coverage(vec![state(1.5, 1.0)]);
        assert!(stretched.contains([1.45, 1.45_f64.powf(-0.5), 1.45_f64.powf(-0.5)]));
    }
}
