//! Split of a law into a part that keeps the volume and one that changes it.

use super::hyperelastic::Hyperelastic;
use super::{Error, Law, Prediction, Workspace};
use crate::tensor::{Tensor, Voigt, Voigt6x6, voigt};

/// W = W₀(C̄) + ½κ(J − 1)² with C̄ = J^(−2/3) C: the form of Abaqus and of most published constants. The
/// forms of the thesis are [`super::hyperelastic::Compressible`].
pub struct IsochoricSplit {
    law: Box<dyn Hyperelastic>,
    bulk: f64,
}

impl IsochoricSplit {
    /// Creates the split of an incompressible law with a bulk modulus κ > 0, Pa.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn new(law: Box<dyn Hyperelastic>, bulk: f64) -> Result<Self, Error> {
        if !(bulk > 0.0 && bulk.is_finite()) {
            let (parameter, allowed) = ("bulk modulus".to_owned(), "(0, ∞)");
            return Err(Error::Parameter { law: "isochoric split", parameter, value: bulk, allowed });
        }
        Ok(Self { law, bulk })
    }

    fn predict(&self, c: &Voigt, tangent: bool, memory: &mut Workspace) -> Result<Prediction, Error> {
        let tensor = voigt::to_stress(c);
        let mut found = isochoric(&self.law, &tensor, tangent, memory)?;
        let jacobian = tensor.determinant().sqrt();
        let inverse = inverse(&tensor)?;
        // S = h C⁻¹ with h = J U′, ℂ = J h′ C⁻¹ ⊗ C⁻¹ − 2h C⁻¹ ⊙ C⁻¹
        let h = self.bulk * jacobian * (jacobian - 1.0);
        let slope = self.bulk * jacobian * (2.0 * jacobian - 1.0);
        found.stress += h * inverse;
        found.energy = found.energy.map(|energy| energy + 0.5 * self.bulk * (jacobian - 1.0).powi(2));
        found.tangent = found
            .tangent
            .map(|own| own + slope * inverse * inverse.transpose() - 2.0 * h * symmetric_product(&inverse));
        Ok(found)
    }
}

impl Law for IsochoricSplit {
    fn name(&self) -> String {
        format!("{}, isochoric", Hyperelastic::name(&self.law))
    }

    fn stress(&self, c: &Voigt, memory: &mut Workspace) -> Result<Prediction, Error> {
        self.predict(c, false, memory)
    }

    fn tangent(&self, c: &Voigt, memory: &mut Workspace) -> Result<Prediction, Error> {
        self.predict(c, true, memory)
    }
}

fn inverse(c: &Tensor) -> Result<Voigt, Error> {
    let inverse = c.try_inverse().ok_or_else(|| Error::invalid("C", c, "positive definite"))?;
    Ok(voigt::from_stress(&inverse))
}

/// (A ⊙ A)_ijkl = ½(A_ik A_jl + A_il A_jk).
fn symmetric_product(a: &Voigt) -> Voigt6x6 {
    let at = |p: usize, q: usize| a[voigt::index(p, q)];
    Voigt6x6::from_fn(|a, b| {
        let ((i, j), (k, l)) = (voigt::PAIRS[a], voigt::PAIRS[b]);
        0.5 * (at(i, k) * at(j, l) + at(i, l) * at(j, k))
    })
}

/// Isochoric part of a law at C: W(C̄), its S = 2 ∂W(C̄)/∂C and tangent, with C̄ = J^(−2/3) C (Holzapfel,
/// *Nonlinear Solid Mechanics*, 2000, Eq. 6.168).
pub(super) fn isochoric(
    law: &dyn Law,
    c: &Tensor,
    tangent: bool,
    memory: &mut Workspace,
) -> Result<Prediction, Error> {
    let factor = c.determinant().powf(-1.0 / 3.0);
    let bar = voigt::from_stress(&(factor * c));
    let found = if tangent { law.tangent(&bar, memory)? } else { law.stress(&bar, memory)? };
    let (inverse, c) = (inverse(c)?, voigt::from_stress(c));
    // A : C of symmetric tensors in Voigt form
    let contracted = |a: &Voigt| (0..6).map(|k| a[k] * c[k] * if k < 3 { 1.0 } else { 2.0 }).sum::<f64>();
    let trace = contracted(&found.stress);
    let stress = factor * (found.stress - trace / 3.0 * inverse);
    let turned = found.tangent.map(|d| {
        // P : ℂ : Pᵀ with P = 1 − ⅓ C⁻¹ ⊗ C
        let by_columns =
            Voigt6x6::from_fn(|a, b| d[(a, b)] - inverse[b] / 3.0 * contracted(&d.row(a).transpose()));
        let both = Voigt6x6::from_fn(|a, b| {
            by_columns[(a, b)] - inverse[a] / 3.0 * contracted(&by_columns.column(b).into_owned())
        });
        let unit = symmetric_product(&inverse) - inverse * inverse.transpose() / 3.0;
        let mixed = inverse * stress.transpose();
        factor * factor * both + 2.0 / 3.0 * factor * trace * unit - 2.0 / 3.0 * (mixed + mixed.transpose())
    });
    Ok(Prediction { stress, tangent: turned, ..found })
}
