//! Checks of the properties that every law must have, for any [`Law`], including your own.

use super::law::IDENTITY;
use super::{Error, Law, Prediction, Workspace};
use crate::random::SplitMix64;
use crate::tensor::{DeformationGradient, Tensor, Voigt, Voigt6x6, voigt};
use nalgebra::{SVector, Vector3};

/// Step of the central differences: truncation h² ~ 1e-10 and rounding ε/h ~ 2e-11 of the law's own size.
const STEP: f64 = 1e-5;

/// Deviations of a law from the properties that every law must have, each the largest over some deformations.
/// A deviation of stress or tangent is relative to the law's size there: the largest component of S and ℂ,
/// and |W|.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Deviations {
    /// Deviation of S from 2 ∂W/∂C by central differences; `None` for a law without an energy.
    pub stress: Option<f64>,
    /// Deviation of ℂ from 2 ∂S/∂C by central differences.
    pub tangent: f64,
    /// Deviation of ℂ from its transpose: 0 for a law that has an energy.
    pub asymmetry: f64,
    /// ‖σ(QF) − Qσ(F)Qᵀ‖ for a rotation Q.
    pub objectivity: f64,
    /// Deviation of a stress alone from the stress with its tangent, and of a list from single points: 0, the
    /// same bits.
    pub bits: f64,
    /// |W(1)| over the size there; `None` for a law without an energy.
    pub energy_at_rest: Option<f64>,
    /// Deviation of S(1) from zero.
    pub stress_at_rest: f64,
    /// Deviation of S(1) from a pressure: 0 for an isotropic law, also if the pressure is left open.
    pub shear_at_rest: f64,
}

impl Deviations {
    /// Measures a law at some deformations and at rest.
    ///
    /// # Errors
    /// Errors of the law at one of them, or a step of 1e-5 beside it.
    pub fn measure(law: &dyn Law, deformations: &[DeformationGradient]) -> Result<Self, Error> {
        let mut memory = Workspace::default();
        let mut all = Self::default();
        let rotation = nalgebra::Rotation3::from_euler_angles(0.3, -1.1, 2.0).into_inner();
        let rest = law.tangent(&IDENTITY, &mut memory)?;
        let size = size(&rest);
        all.energy_at_rest = rest.energy.map(|energy| energy.abs() / size);
        all.stress_at_rest = rest.stress.amax() / size;
        let pressure = (rest.stress[0] + rest.stress[1] + rest.stress[2]) / 3.0;
        all.shear_at_rest = (rest.stress - pressure * IDENTITY).amax() / size;
        let points: Vec<Voigt> =
            deformations.iter().map(|f| voigt::from_stress(&f.right_cauchy_green())).collect();
        let mut list = vec![Prediction::default(); points.len()];
        law.stresses(&points, &mut memory, &mut list)?;
        for ((f, c), listed) in deformations.iter().zip(&points).zip(&list) {
            let size = all.measure_at(law, c, listed, &mut memory)?;
            let turned = DeformationGradient::new(rotation * f.matrix())?;
            let (own, _) = law.cauchy_stress(f, &mut memory)?;
            let (other, _) = law.cauchy_stress(&turned, &mut memory)?;
            let expected = voigt::stress_transformation(&rotation) * own;
            raise(&mut all.objectivity, (other - expected).amax() / size.max(own.amax()));
        }
        Ok(all)
    }

    /// Measures the law at one C; returns its size there.
    fn measure_at(
        &mut self,
        law: &dyn Law,
        c: &Voigt,
        listed: &Prediction,
        memory: &mut Workspace,
    ) -> Result<f64, Error> {
        let found = law.tangent(c, memory)?;
        let (tangent, size) = (found.tangent.unwrap_or_default(), size(&found));
        let alone = law.stress(c, memory)?;
        raise(
            &mut self.bits,
            (alone.stress - found.stress).amax().max((alone.stress - listed.stress).amax()),
        );
        raise(&mut self.asymmetry, (tangent - tangent.transpose()).amax() / size);
        let (mut slopes, mut of_energy) = (Voigt6x6::zeros(), Some(Voigt::zeros()));
        for b in 0..6 {
            let mut step = Voigt::zeros();
            step[b] = STEP;
            let (up, down) = (law.stress(&(c + step), memory)?, law.stress(&(c - step), memory)?);
            slopes.set_column(b, &((up.stress - down.stress) / (2.0 * STEP)));
            let difference = up.energy.zip(down.energy).map(|(up, down)| (up - down) / (2.0 * STEP));
            of_energy = of_energy.zip(difference).map(|(mut list, slope)| {
                list[b] = slope;
                list
            });
        }
        raise(&mut self.tangent, (tangent - voigt::tangent_from_stress_gradient(&slopes)).amax() / size);
        if let Some(gradient) = of_energy {
            let error = (found.stress - voigt::stress_from_energy_gradient(&gradient)).amax() / size;
            raise(self.stress.get_or_insert(0.0), error);
        }
        Ok(size)
    }
}

/// Counts, among `count` random deformations and directions, the states without a real wave speed: the law
/// has lost its ellipticity there, (m ⊗ N) : ∂P/∂F : (m ⊗ N) < 0 beyond rounding. Strains go up to several
/// hundred per cent.
///
/// # Errors
/// Errors of the law.
pub fn count_ellipticity_losses(
    law: &dyn Law,
    count: usize,
    random: &mut SplitMix64,
) -> Result<usize, Error> {
    let mut memory = Workspace::default();
    let mut lost = 0;
    for _ in 0..count {
        let f = loop {
            let noise = Tensor::from_fn(|_, _| 3.0 * (random.uniform() - 0.5));
            match DeformationGradient::new(Tensor::identity() + noise) {
                Ok(f) if f.jacobian() > 0.05 => break f,
                _ => {}
            }
        };
        let mut unit = || Vector3::from_fn(|_, _| random.uniform() - 0.5).normalize();
        let (m, n) = (unit(), unit());
        let found = law.tangent(&voigt::from_stress(&f.right_cauchy_green()), &mut memory)?;
        let tangent = found.tangent.unwrap_or_default();
        let direction = SVector::<f64, 9>::from_fn(|row, _| m[row / 3] * n[row % 3]);
        let acoustic = direction.dot(&(voigt::nominal_tangent(&f, &found.stress, &tangent) * direction));
        let size = tangent.norm() * (f.matrix().transpose() * m).norm_squared();
        lost += usize::from(acoustic < -1e-12 * size);
    }
    Ok(lost)
}

/// Deformations for tests, far from the locking of rubber: rest, small strain, shear, two and three equal
/// stretches, and general ones.
pub fn deformations() -> Vec<DeformationGradient> {
    let q: Tensor = nalgebra::Rotation3::from_euler_angles(0.3, -1.1, 2.0).into_inner();
    let half = 0.5_f64.sqrt();
    [
        Tensor::identity(),
        Tensor::identity() * 1.2,
        Tensor::new(1.0 + 1e-6, 3e-7, 0.0, -2e-7, 1.0, 4e-7, 0.0, 1e-7, 1.0 - 1e-6),
        Tensor::new(1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        Tensor::from_diagonal(&[2.0, half, half].into()),
        q * Tensor::from_diagonal(&[1.5, 1.5 + 1e-5, 0.5].into()) * q,
        Tensor::new(1.3, 0.4, -0.2, 0.1, 0.8, 0.3, -0.3, 0.2, 1.7),
    ]
    .into_iter()
    .filter_map(|matrix| DeformationGradient::new(matrix).ok())
    .collect()
}

fn size(found: &Prediction) -> f64 {
    let tangent = found.tangent.map_or(0.0, |tangent| tangent.amax());
    found.stress.amax().max(tangent).max(found.energy.unwrap_or(0.0).abs()).max(f64::MIN_POSITIVE)
}

/// Updates a maximum; keeps NaN.
fn raise(largest: &mut f64, value: f64) {
    if value.is_nan() || value > *largest {
        *largest = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic;

    /// 2e-8 of the differences; a few hundred roundings of the rest.
    fn check(name: &str, found: &Deviations) {
        assert!(found.tangent < 2e-8, "{name}: {found:?}");
        assert!(found.objectivity < 1e-12 && found.bits == 0.0, "{name}: {found:?}");
        if let Some(stress) = found.stress {
            assert!(stress < 2e-8 && found.asymmetry < 1e-14, "{name}: {found:?}");
            assert!(found.energy_at_rest.is_some_and(|energy| energy < 1e-12), "{name}: {found:?}");
        }
    }

    #[test]
    fn every_law_of_chapter_1() {
        let laws = hyperelastic::all().unwrap();
        let mut stress_free = 0;
        for law in &laws {
            let found = Deviations::measure(law, &deformations()).unwrap();
            let name = hyperelastic::Hyperelastic::name(law);
            check(&name, &found);
            assert!(found.stress.is_some() && found.shear_at_rest < 1e-15, "{name}: {found:?}");
            if found.stress_at_rest < 1e-15 {
                stress_free += 1;
                let moduli = law.moduli(&mut Workspace::default()).unwrap();
                let expected = hyperelastic::Hyperelastic::shear_modulus(law);
                assert!((moduli.shear / expected - 1.0).abs() < 1e-12, "{name}: {moduli:?} {expected}");
                // without a volumetric term that law has no bulk modulus
                assert!(moduli.bulk > 0.0 || name == "van der Waals");
            }
        }
        // the compressible forms but Mooney–Rivlin's as published (1.21), foams, van der Waals' isochoric law
        let compressible = 3 * hyperelastic::MODELS.len() + 3 + hyperelastic::COMPRESSIBLE_MODELS.len();
        assert_eq!(stress_free, compressible + 1);
    }

    #[cfg(feature = "surrogate")]
    #[test]
    fn every_kind_of_learnt_model() {
        for (name, model) in crate::constitutive::surrogate::examples().unwrap() {
            let found = Deviations::measure(&model, &deformations()).unwrap();
            check(&name, &found);
            match found.stress {
                Some(_) => {
                    assert_eq!((found.stress_at_rest, found.energy_at_rest), (0.0, Some(0.0)), "{name}")
                }
                None => assert!(found.asymmetry > 1e-3 && found.stress_at_rest > 1e-3, "{name}: {found:?}"),
            }
        }
    }

    /// Errors in a law are detected: a tangent, a stress, a frame.
    #[test]
    fn slips_are_measured() {
        struct Slip(usize);
        impl Law for Slip {
            fn name(&self) -> String {
                "Saint Venant and Kirchhoff, λ = 0, μ = ½".into()
            }
            fn stress(&self, c: &Voigt, memory: &mut Workspace) -> Result<Prediction, Error> {
                Ok(Prediction { tangent: None, ..self.tangent(c, memory)? })
            }
            fn tangent(&self, c: &Voigt, _: &mut Workspace) -> Result<Prediction, Error> {
                let e = voigt::strain_from_right_cauchy_green(c);
                let mut tangent = Voigt6x6::from_diagonal(&Voigt::new(1.0, 1.0, 1.0, 0.5, 0.5, 0.5));
                let mut stress = tangent * e;
                let energy = Some(0.5 * stress.dot(&e));
                match self.0 {
                    1 => tangent[(3, 3)] = 1.0,
                    2 => stress[3] *= 2.0,
                    3 => tangent[(0, 1)] = 1e-3,
                    _ => {}
                }
                Ok(Prediction { stress, tangent: Some(tangent), energy, ..Prediction::default() })
            }
        }
        let of = |slip| Deviations::measure(&Slip(slip), &deformations()).unwrap();
        check("none", &of(0));
        assert!(of(1).tangent > 0.1 && of(2).stress.unwrap() > 0.1 && of(2).tangent > 0.1);
        assert!(of(3).asymmetry > 1e-4);
        let moduli = Slip(0).moduli(&mut Workspace::default()).unwrap();
        assert!((moduli.shear - 0.5).abs() < 1e-15 && (moduli.bulk - 1.0 / 3.0).abs() < 1e-15);
    }
}
