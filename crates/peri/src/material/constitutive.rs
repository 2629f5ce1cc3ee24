//! Any constitutive law C → (W, S, ℂ) as the law of a family's mean deformation.

use super::point_law::{Deformation, PointLaw, PointStress};
use super::tensor::{BodyTensor, embed};
use crate::calibrate::Space;
use crate::error::Error;
use nalgebra::Matrix3;
use polycore::constitutive::{Flags, Law, Moduli, Prediction, Workspace};
use polycore::tensor::voigt::{self, Voigt, component};
use std::cell::RefCell;

/// W = W(C) + ½ a μ · residual, C = FᵀF, for any [`Law`] that has an energy and no stress at rest:
/// correspondence with the stabilisation a = 1 (Silling 2017, doi:10.1016/j.cma.2017.03.043, made exact). In
/// plane stress the law gives the stretch of the thickness by S₃₃ = 0.
///
/// The axes of an anisotropic law are those of the body; its μ is the mean over all directions
/// ([`Law::moduli`]), and in a plane body z must be normal to one of its planes of symmetry. A learnt law is
/// one with an energy: its stress at rest is 0 by construction.
#[derive(Clone, Debug)]
pub struct Correspondence<L, const D: usize> {
    law: L,
    pub(crate) space: Space,
    shear: f64,
    bulk: f64,
    stabilisation: f64,
}

thread_local! {
    /// Scratch memory of laws.
    static MEMORY: RefCell<Workspace> = RefCell::default();
}

impl<L: Law, const D: usize> Correspondence<L, D> {
    /// Uses the stabilisation a = 1: accurate in the bulk and at free surfaces.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a law without energy, with stress or without stiffness at rest, or, in a
    /// plane body, with shear stress out of the plane.
    pub fn new(law: L, space: Space) -> Result<Self, Error> {
        Self::stabilised(law, space, 1.0)
    }

    /// Uses another stabilisation a ≥ 0: 4/3 is the most accurate in the bulk; below 0.1 soft modes appear.
    ///
    /// # Errors
    /// As [`Self::new`]; a below 0.
    pub fn stabilised(law: L, space: Space, stabilisation: f64) -> Result<Self, Error> {
        let moduli = check::<D>(&law, space, stabilisation)?;
        Ok(Self { law, space, shear: moduli.shear, bulk: moduli.bulk, stabilisation })
    }

    /// Evaluates the law; `None` for an inverted body, which W(C) cannot detect.
    fn upright(&self, deformation: &Deformation<D>) -> Option<Prediction> {
        let upright = deformation.volume_change() > -1.0;
        self.predict(&deformation.gradient(), false).filter(|_| upright).map(|(_, found)| found)
    }

    /// The law.
    pub fn law(&self) -> &L {
        &self.law
    }

    /// Computes λ₃² and the law's prediction at C, with ℂ if requested.
    fn predict(&self, gradient: &BodyTensor<D>, tangent: bool) -> Option<(f64, Prediction)> {
        MEMORY.with_borrow_mut(|memory| {
            let (c, found) = at_thickness(self.space, 1e-15, gradient, tangent, |c, tangent| {
                if tangent { self.law.tangent(c, memory) } else { self.law.stress(c, memory) }.ok()
            })?;
            Some((c[2], found))
        })
    }
}

impl<L: Law, const D: usize> PointLaw<D> for Correspondence<L, D> {
    fn energy(&self, deformation: &Deformation<D>) -> f64 {
        let energy = self.upright(deformation).and_then(|found| found.energy).unwrap_or(f64::NAN);
        energy + 0.5 * self.stabilisation * self.shear * deformation.residual
    }

    fn respond(&self, deformation: &Deformation<D>) -> PointStress<D> {
        let found = self.upright(deformation);
        let stress = found.map_or(Matrix3::from_element(f64::NAN), |found| voigt::to_stress(&found.stress));
        let plane = BodyTensor::<D>::from_fn(|a, b| stress[(a, b)]);
        PointStress { piola: deformation.gradient() * plane, stabilisation: self.stabilisation * self.shear }
    }

    fn stiffness(&self, deformation: &Deformation<D>) -> f64 {
        let f = deformation.gradient();
        self.predict(&f, true).map_or(f64::NAN, |(_, found)| tangent_norm(self.space, &f, &found))
    }

    fn shear_modulus(&self) -> f64 {
        self.shear
    }

    fn bulk_modulus(&self) -> f64 {
        if self.space == Space::PlaneStress { 0.0 } else { self.bulk }
    }

    fn thickness_stretch(&self, deformation: &Deformation<D>) -> f64 {
        match self.space {
            Space::PlaneStress => {
                self.predict(&deformation.gradient(), false).map_or(f64::NAN, |(square, _)| square.sqrt())
            }
            _ => 1.0,
        }
    }

    fn flags(&self, deformation: &Deformation<D>) -> Flags {
        let found = self.predict(&deformation.gradient(), false);
        // points without a result
        found.map_or(Flags { outside: [true; 6], ..Flags::default() }, |(_, found)| found.flags)
    }
}

/// Checks a law and its stabilisation; returns the moduli at rest.
pub(super) fn check<const D: usize>(
    law: &(impl Law + ?Sized),
    space: Space,
    stabilisation: f64,
) -> Result<Moduli, Error> {
    let mut memory = Workspace::default();
    let rest = Voigt::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    let wrong = |name, found, allowed: &str| Err(Error::Parameter { name, found, allowed: allowed.into() });
    let found = (law.tangent(&rest, &mut memory), law.moduli(&mut memory));
    let (Ok(found), Ok(moduli)) = found else {
        return wrong("law", f64::NAN, "a law with a tangent at rest");
    };
    if found.energy.is_none() {
        return wrong("law", f64::NAN, "a law with an energy");
    }
    if !(moduli.shear > 0.0 && moduli.bulk > 0.0) {
        return wrong("shear or bulk modulus of the law", moduli.shear.min(moduli.bulk), "above 0 Pa");
    }
    let tangent = found.tangent.unwrap_or_default();
    let least = (0.5 * (tangent + tangent.transpose())).symmetric_eigenvalues().min();
    if least.is_nan() || least <= 0.0 {
        return wrong("least eigenvalue of the law's tangent at rest", least, "above 0 Pa");
    }
    let stress = found.stress.amax() / moduli.shear;
    if stress.is_nan() || stress >= 1e-6 {
        return wrong("stress at rest over the shear modulus", stress, "below 1e-6");
    }
    if (space == Space::Solid) != (D == 3) {
        return Err(Error::geometry(format!("{space:?} in {D} dimensions")));
    }
    if D == 2 {
        let shear = out_of_plane(law, &mut memory) / moduli.shear;
        if shear.is_nan() || shear >= 1e-6 {
            let name = "shear stress out of the plane over the shear modulus";
            return wrong(name, shear, "below 1e-6: z normal to a plane of symmetry of the law");
        }
    }
    if !(stabilisation >= 0.0 && stabilisation.is_finite()) {
        return wrong("stabilisation", stabilisation, "at least 0");
    }
    Ok(moduli)
}

/// C of a deformation and the prediction there; in plane stress C₃₃ is found by S₃₃ = 0, by Newton's method
/// up to a relative change of `enough`.
#[inline]
pub(super) fn at_thickness<const D: usize>(
    space: Space,
    enough: f64,
    gradient: &BodyTensor<D>,
    tangent: bool,
    mut law: impl FnMut(&Voigt, bool) -> Option<Prediction>,
) -> Option<(Voigt, Prediction)> {
    let mut c = isochoric_start(space, gradient);
    if space == Space::PlaneStress {
        find_thickness(enough, &mut c, |c| law(c, true))?;
    }
    Some((c, law(&c, tangent)?))
}

/// C of a deformation in its plane, with the thickness of an isochoric body in plane stress.
pub(super) fn isochoric_start<const D: usize>(space: Space, gradient: &BodyTensor<D>) -> Voigt {
    let mut c = voigt::from_stress(&embed(&(gradient.transpose() * gradient), 1.0));
    if space == Space::PlaneStress {
        c[2] = 1.0 / (c[0] * c[1] - c[3] * c[3]);
    }
    c
}

/// Finds C₃₃ of S₃₃ = 0 by Newton's method up to a relative change of `enough`. Returns the last prediction,
/// which has ℂ, and the change of C₃₃ after it; `None` without a stress-free thickness.
#[inline]
pub(super) fn find_thickness(
    enough: f64,
    c: &mut Voigt,
    mut law: impl FnMut(&Voigt) -> Option<Prediction>,
) -> Option<(Prediction, f64)> {
    let mut relative = f64::INFINITY;
    let mut last = None;
    for _ in 0..60 {
        let found = law(c)?;
        let step = found.stress[2] / (0.5 * found.tangent?[(2, 2)]);
        let next = (c[2] - step).clamp(0.5 * c[2], 2.0 * c[2]);
        let before = relative;
        relative = (next - c[2]).abs() / next;
        last = Some((found, next - c[2]));
        c[2] = next;
        // otherwise only rounding is left
        if relative <= enough || (relative >= before && relative < 1e-13) {
            break;
        }
    }
    last.filter(|_| relative <= enough.max(1e-9))
}

/// √(‖A‖₁‖A‖∞) of A_iJkL = F_iM ℂ_MJNL F_kN + δ_ik S_JL: 3K at rest where K > 2μ/3.
pub(super) fn tangent_norm<const D: usize>(space: Space, f: &BodyTensor<D>, found: &Prediction) -> f64 {
    let Prediction { stress, tangent: Some(c), .. } = found else { return f64::NAN };
    let stress = voigt::to_stress(stress);
    // in plane stress the thickness adapts
    let thin = if space == Space::PlaneStress { 1.0 / c[(2, 2)] } else { 0.0 };
    let material =
        |i, j, k, l| component(c, i, j, k, l) - thin * component(c, i, j, 2, 2) * component(c, 2, 2, k, l);
    let entry = |i: usize, j: usize, k: usize, l: usize| {
        let mut sum = if i == k { stress[(j, l)] } else { 0.0 };
        for m in 0..D {
            for n in 0..D {
                sum += f[(i, m)] * material(m, j, n, l) * f[(k, n)];
            }
        }
        sum
    };
    let pairs = || (0..D).flat_map(|i| (0..D).map(move |j| (i, j)));
    let rows = pairs().map(|(i, j)| pairs().map(|(k, l)| entry(i, j, k, l).abs()).sum::<f64>());
    let columns = pairs().map(|(k, l)| pairs().map(|(i, j)| entry(i, j, k, l).abs()).sum::<f64>());
    (rows.fold(0.0, f64::max) * columns.fold(0.0, f64::max)).sqrt()
}

/// Computes the largest of |S₁₃| and |S₂₃| at in-plane strains of 1, and of 2 % over 2 %, Pa: 0 if z is
/// normal to a plane of symmetry.
fn out_of_plane(law: &(impl Law + ?Sized), memory: &mut Workspace) -> f64 {
    let rest = Voigt::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    let tangent = law.tangent(&rest, memory).ok().and_then(|found| found.tangent);
    let mut largest = f64::NAN;
    for column in 0..4 {
        let mut strain = Voigt::zeros();
        strain[column] = 0.02;
        // a locking law has no result
        let finite = law.stress(&(rest + strain), memory).map_or(Voigt::zeros(), |found| found.stress / 0.02);
        for row in 4..6 {
            largest =
                largest.max(finite[row].abs()).max(tangent.map_or(f64::NAN, |t| t[(row, column)].abs()));
        }
    }
    largest
}
