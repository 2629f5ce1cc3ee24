//! Constitutive laws: functions of C that return stress and tangent.

use super::Error;
use super::hyperelastic::Hyperelastic;
use crate::tensor::{DeformationGradient, Voigt, Voigt6x6, voigt};
use nalgebra::{SMatrix, SVector, Scalar};
use std::any::Any;

/// Law of an elastic solid, C → (W, S, ℂ), objective since it is a function of C = FᵀF alone.
///
/// Voigt vectors and tangents follow [`crate::tensor::voigt`]; Pa and J/m³. A law may have no energy (a
/// stress learnt as a function of C has none), and S(1) need not vanish: incompressible laws leave the
/// pressure open, and return as S the part that W determines.
pub trait Law: Send + Sync {
    /// Name of the law, for tables and messages.
    fn name(&self) -> String;

    /// Computes W and S at C. Allocates nothing once `memory` has served the same law.
    ///
    /// # Errors
    /// A C that is not positive definite, or without a finite stress.
    fn stress(&self, c: &Voigt, memory: &mut Workspace) -> Result<Prediction, Error>;

    /// Computes W, S and ℂ = 2 ∂S/∂C at C. Allocates nothing once `memory` has served the same law.
    ///
    /// # Errors
    /// As [`Law::stress`].
    fn tangent(&self, c: &Voigt, memory: &mut Workspace) -> Result<Prediction, Error>;

    /// Computes W and S at each C, with the same bits as one by one.
    ///
    /// # Errors
    /// As [`Law::stress`]; unequal numbers of predictions and of C.
    fn stresses(
        &self,
        c: &[Voigt],
        memory: &mut Workspace,
        predictions: &mut [Prediction],
    ) -> Result<(), Error> {
        same_length(c.len(), predictions.len())?;
        for (c, prediction) in c.iter().zip(predictions) {
            *prediction = self.stress(c, memory)?;
        }
        Ok(())
    }

    /// Computes σ = FSFᵀ/J at F = `deformation`, with the prediction at C = FᵀF.
    ///
    /// # Errors
    /// As [`Law::stress`].
    fn cauchy_stress(
        &self,
        deformation: &DeformationGradient,
        memory: &mut Workspace,
    ) -> Result<(Voigt, Prediction), Error> {
        let prediction = self.stress(&voigt::from_stress(&deformation.right_cauchy_green()), memory)?;
        Ok((voigt::cauchy_from_material(deformation, &prediction.stress), prediction))
    }

    /// Bulk and shear modulus of the tangent at C = 1, for a law without stress there: Voigt's averages over
    /// all directions (Proc. of Hill 1952, doi:10.1088/0370-1298/65/5/307, Eq. 4–5), exact for an
    /// isotropic law.
    ///
    /// # Errors
    /// As [`Law::stress`].
    fn moduli(&self, memory: &mut Workspace) -> Result<Moduli, Error> {
        let d = self.tangent(&IDENTITY, memory)?.tangent.unwrap_or_default();
        let axial = d[(0, 0)] + d[(1, 1)] + d[(2, 2)];
        let coupling = d[(0, 1)] + d[(0, 2)] + d[(1, 2)];
        let shear = d[(3, 3)] + d[(4, 4)] + d[(5, 5)];
        Ok(Moduli { bulk: (axial + 2.0 * coupling) / 9.0, shear: (axial - coupling + 3.0 * shear) / 15.0 })
    }
}

/// C = 1.
pub(super) const IDENTITY: Voigt = Voigt::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);

/// Stiffness at rest, Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moduli {
    /// K.
    pub bulk: f64,
    /// μ.
    pub shear: f64,
}

/// Prediction of a law at a C, with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Prediction<T: Scalar = f64> {
    /// S (3.3), Pa.
    pub stress: SVector<T, 6>,
    /// ℂ = 2 ∂S/∂C, Pa, in the Voigt order without factors (dS = ℂ dE with doubled shear strains); if
    /// requested.
    pub tangent: Option<SMatrix<T, 6, 6>>,
    /// W, J/m³; `None` for a law without an energy.
    pub energy: Option<T>,
    /// Root mean square over the members of an ensemble of the norm of their distance from the mean, Pa; 0
    /// for a single model. It is the norm of `deviation`: √Σₐ sₐ².
    pub spread: T,
    /// Standard deviation over the M members of each component of S, sₐ = √(Σₘ (Sₐᵐ − Sₐ)²/M), Pa, in the
    /// order of `stress`; 0 for one member. It belongs to these axes: in others it needs the members'
    /// covariance.
    pub deviation: SVector<T, 6>,
    /// Reasons for uncertainty; none for a law in closed form.
    pub flags: Flags,
}

/// Reasons for which a prediction is uncertain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Flags {
    /// Components of C outside the box of the training data.
    pub outside: [bool; 6],
    /// Components outside the range that never changed in the training data, e.g. a shear without any data.
    pub unseen: [bool; 6],
    /// Farther from the representatives of the training strains than any training row: in a gap of the box.
    pub far: bool,
    /// The members of the ensemble disagree by more than the model's limit.
    pub spread: bool,
}

impl Flags {
    /// Returns true if any flag is set.
    pub fn any(&self) -> bool {
        self.outside.contains(&true) || self.far || self.spread
    }
}

/// Scratch memory of a law, kept between its evaluations so that they need not allocate. Keep one for each
/// law and thread: content of another law is dropped.
#[derive(Debug, Default)]
pub struct Workspace(Option<Box<dyn Any + Send>>);

impl Workspace {
    /// Calls `work` with the stored `M`, a new one at first.
    #[inline]
    pub fn with<M: Default + Send + 'static, R>(&mut self, work: impl FnOnce(&mut M) -> R) -> R {
        let kept = self.0.take().and_then(|kept| kept.downcast::<M>().ok());
        let mut memory = kept.unwrap_or_default();
        let result = work(&mut memory);
        self.0 = Some(memory);
        result
    }
}

pub(super) fn same_length(points: usize, predictions: usize) -> Result<(), Error> {
    if points == predictions {
        return Ok(());
    }
    Err(Error::invalid("predictions", predictions, format!("{points}, one for each C")))
}

/// Laws of Chapter 1, at the principal stretches and directions of C.
impl<L: Hyperelastic + ?Sized> Law for L {
    fn name(&self) -> String {
        Hyperelastic::name(self)
    }

    fn stress(&self, c: &Voigt, _: &mut Workspace) -> Result<Prediction, Error> {
        isotropic(self, c, false)
    }

    fn tangent(&self, c: &Voigt, _: &mut Workspace) -> Result<Prediction, Error> {
        isotropic(self, c, true)
    }
}

fn isotropic<L: Hyperelastic + ?Sized>(law: &L, c: &Voigt, tangent: bool) -> Result<Prediction, Error> {
    let frame = DeformationGradient::from_right_cauchy_green(c)?.principal_frame();
    let response = law.response_at(frame.stretches)?;
    let turned = || -> Voigt6x6 { voigt::transform_tangent(&response.tangent(), &frame.referential) };
    Ok(Prediction {
        stress: voigt::from_stress(&frame.referential_tensor(response.stress)),
        tangent: tangent.then(turned),
        energy: Some(law.energy_at(frame.stretches)?),
        ..Prediction::default()
    })
}
