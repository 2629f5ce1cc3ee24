//! Conversions between stress measures.

use super::{DeformationGradient, Tensor};

/// A stress measure; all are related through the Kirchhoff stress τ = Jσ = PFᵀ = FSFᵀ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StressMeasure {
    /// P, nominal: force per reference area (PK1). P = FS = τF⁻ᵀ.
    FirstPiolaKirchhoff,
    /// S, energy conjugate to E = ½(C − 1) (PK2). S = JF⁻¹σF⁻ᵀ (3.6).
    SecondPiolaKirchhoff,
    /// τ = Jσ.
    Kirchhoff,
    /// σ, true stress: force per current area. σ = PFᵀ/J (2.32).
    Cauchy,
}

impl StressMeasure {
    /// All four.
    pub const ALL: [Self; 4] =
        [Self::FirstPiolaKirchhoff, Self::SecondPiolaKirchhoff, Self::Kirchhoff, Self::Cauchy];
}

/// The von Mises stress √(3/2 s:s), s the deviator, from the three normal and the three shear stresses.
pub fn von_mises([x, y, z, first, second, third]: [f64; 6]) -> f64 {
    let normal = (x - y).powi(2) + (y - z).powi(2) + (z - x).powi(2);
    (0.5 * normal + 3.0 * (first * first + second * second + third * third)).sqrt()
}

impl DeformationGradient {
    /// Converts a stress from one measure to another, in the same unit. A conversion of a measure to itself
    /// changes nothing.
    pub fn convert_stress(&self, stress: &Tensor, from: StressMeasure, to: StressMeasure) -> Tensor {
        use StressMeasure::{Cauchy, FirstPiolaKirchhoff, Kirchhoff, SecondPiolaKirchhoff};
        let f = self.matrix();
        match (from, to) {
            (FirstPiolaKirchhoff, FirstPiolaKirchhoff)
            | (SecondPiolaKirchhoff, SecondPiolaKirchhoff)
            | (Kirchhoff, Kirchhoff)
            | (Cauchy, Cauchy) => *stress,
            // direct conversions, so that PK1 ↔ PK2 does not pass through τ and lose digits
            (SecondPiolaKirchhoff, FirstPiolaKirchhoff) => f * stress,
            (FirstPiolaKirchhoff, SecondPiolaKirchhoff) => self.inverse() * stress,
            (FirstPiolaKirchhoff, Kirchhoff) => stress * f.transpose(),
            (FirstPiolaKirchhoff, Cauchy) => stress * f.transpose() / self.jacobian(),
            (SecondPiolaKirchhoff, Kirchhoff) => self.push_forward(stress),
            (SecondPiolaKirchhoff, Cauchy) => self.push_forward(stress) / self.jacobian(),
            (Kirchhoff, Cauchy) => stress / self.jacobian(),
            (Cauchy, Kirchhoff) => stress * self.jacobian(),
            (Kirchhoff, FirstPiolaKirchhoff) => stress * self.inverse().transpose(),
            (Kirchhoff, SecondPiolaKirchhoff) => self.pull_back(stress),
            (Cauchy, FirstPiolaKirchhoff) => stress * self.cofactor(),
            (Cauchy, SecondPiolaKirchhoff) => self.pull_back(stress) * self.jacobian(),
        }
    }

    /// Contravariant push-forward F A Fᵀ: S to τ.
    pub fn push_forward(&self, referential: &Tensor) -> Tensor {
        self.matrix() * referential * self.matrix().transpose()
    }

    /// Contravariant pull-back F⁻¹ A F⁻ᵀ: τ to S.
    pub fn pull_back(&self, spatial: &Tensor) -> Tensor {
        let inverse = self.inverse();
        inverse * spatial * inverse.transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use StressMeasure::{Cauchy, FirstPiolaKirchhoff, Kirchhoff, SecondPiolaKirchhoff};

    /// Uniaxial tension λ = 2 of an incompressible bar under a nominal stress of 3: σ = λP, τ = σ, S = P/λ.
    #[test]
    fn uniaxial_tension_by_hand() {
        let lateral = 0.5_f64.sqrt();
        let f = DeformationGradient::from_stretches([2.0, lateral, lateral]).unwrap();
        let nominal = Tensor::from_diagonal(&[3.0, 0.0, 0.0].into());
        for (to, expected) in [(Cauchy, 6.0), (Kirchhoff, 6.0), (SecondPiolaKirchhoff, 1.5)] {
            let stress = f.convert_stress(&nominal, FirstPiolaKirchhoff, to);
            // J = 1 only to rounding, as √½ is rounded
            assert!((stress[(0, 0)] - expected).abs() < 4e-15, "{to:?} {stress}");
        }
    }

    #[test]
    fn every_pair_of_measures_commutes() {
        let f = DeformationGradient::new(Tensor::new(1.3, 0.4, -0.2, 0.1, 0.8, 0.3, -0.3, 0.2, 1.7)).unwrap();
        let cauchy = Tensor::new(3.0, -1.0, 0.5, -1.0, 2.0, 0.7, 0.5, 0.7, -4.0);
        for from in StressMeasure::ALL {
            let start = f.convert_stress(&cauchy, Cauchy, from);
            for to in StressMeasure::ALL {
                let there = f.convert_stress(&start, from, to);
                let direct = f.convert_stress(&cauchy, Cauchy, to);
                // three products with a matrix of condition 3
                assert!((there - direct).norm() < 1e-14 * direct.norm(), "{from:?} → {to:?}");
            }
        }
    }

    /// Power is measure-independent: P : Ḟ = S : Ė = τ : d.
    #[test]
    fn stress_power_is_the_same_in_every_measure() {
        let f = DeformationGradient::new(Tensor::new(1.1, 0.2, 0.0, -0.3, 0.9, 0.1, 0.2, 0.0, 1.4)).unwrap();
        let rate = Tensor::new(0.3, -0.1, 0.2, 0.5, 0.4, -0.2, 0.1, 0.6, -0.3);
        let s = Tensor::new(2.0, 0.3, -0.1, 0.3, 1.0, 0.2, -0.1, 0.2, -0.5);
        let p = f.convert_stress(&s, SecondPiolaKirchhoff, FirstPiolaKirchhoff);
        let tau = f.convert_stress(&s, SecondPiolaKirchhoff, Kirchhoff);
        let strain_rate = (f.matrix().transpose() * rate + rate.transpose() * f.matrix()) * 0.5;
        let gradient = rate * f.inverse();
        let power = p.dot(&rate);
        assert!((s.dot(&strain_rate) - power).abs() < 1e-14);
        assert!((tau.dot(&gradient) - power).abs() < 1e-14);
    }
}
