//! Homogeneous deformations: tension tests of an incompressible body, and plane stress of a compressible one.

use super::{Error, Hyperelastic};
use crate::tensor::deformation::check_stretches;
use crate::tensor::{DeformationGradient, Tensor2, voigt};
use nalgebra::{Matrix3, Vector3};

/// Nominal stresses (P₁, P₂) of a sheet stretched to λ₁, λ₂ with free faces, λ₃ = 1/(λ₁λ₂); Pa.
///
/// The pressure follows from P₃ = 0: Pᵢ = (λᵢ²Sᵢ − λ₃²S₃)/λᵢ, written with ℂ_i3i3 = (Sᵢ − S₃)/(λᵢ² − λ₃²) as
/// Pᵢ = (λᵢ² − λ₃²)(Sᵢ + λ₃²ℂ_i3i3)/λᵢ so that small strains keep their digits.
///
/// # Errors
/// Stretches that are not positive and finite; errors of the law.
pub fn biaxial<L: Hyperelastic + ?Sized>(law: &L, stretch_1: f64, stretch_2: f64) -> Result<[f64; 2], Error> {
    let stretches = incompressible(stretch_1, stretch_2)?;
    let response = law.response_at(stretches)?;
    let thickness = stretches[2];
    let nominal = [0, 1].map(|i| {
        let l = stretches[i];
        let difference = (l - thickness) * (l + thickness);
        difference * (response.stress[i] + thickness * thickness * response.shear_between(i, 2)) / l
    });
    match nominal.iter().all(|stress| stress.is_finite()) {
        true => Ok(nominal),
        // for laws whose name depends on their parameters
        false => Err(Error::Overflow { law: "homogeneous test", stretches }),
    }
}

/// Nominal stress of a bar stretched to λ; Pa.
///
/// # Errors
/// As [`biaxial`].
pub fn uniaxial<L: Hyperelastic + ?Sized>(law: &L, stretch: f64) -> Result<f64, Error> {
    Ok(biaxial(law, stretch, stretch.recip().sqrt())?[0])
}

/// Nominal stress of a sheet stretched to λ in both directions; Pa.
///
/// # Errors
/// As [`biaxial`].
pub fn equibiaxial<L: Hyperelastic + ?Sized>(law: &L, stretch: f64) -> Result<f64, Error> {
    Ok(biaxial(law, stretch, stretch)?[0])
}

/// Nominal stresses of a wide strip stretched to λ ("pure shear", planar tension): along the load, and along
/// the width, whose length is fixed; Pa.
///
/// # Errors
/// As [`biaxial`].
pub fn pure_shear<L: Hyperelastic + ?Sized>(law: &L, stretch: f64) -> Result<[f64; 2], Error> {
    biaxial(law, stretch, 1.0)
}

/// λ₁, λ₂ and 1/(λ₁λ₂).
///
/// # Errors
/// A stretch that is not positive and finite.
pub fn incompressible(stretch_1: f64, stretch_2: f64) -> Result<[f64; 3], Error> {
    let stretches = [stretch_1, stretch_2, 1.0 / (stretch_1 * stretch_2)];
    check_stretches(&stretches)?;
    Ok(stretches)
}

/// Bar of a compressible law with free sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeBar {
    /// λ₂ = λ₃.
    pub lateral: f64,
    /// P₁, Pa.
    pub nominal: f64,
}

/// Finds the lateral stretch of a bar with S₂₂ = S₃₃ = 0, by Newton's method in ln λ₂, bracketed as it goes.
///
/// # Errors
/// A stretch that is not positive and finite, errors of the law, [`Error::NoConvergence`].
pub fn free_bar<L: Hyperelastic + ?Sized>(law: &L, stretch: f64) -> Result<FreeBar, Error> {
    balanced(0.0, "lateral stretch", |log| {
        let lateral = log.exp();
        let response = law.response_at([stretch, lateral, lateral])?;
        let size = response.normal[1][1].abs().max(response.stress[0].abs());
        Ok(TrialStretch {
            residual: response.stress[1],
            slope: lateral * lateral * (response.normal[1][1] + response.normal[1][2]),
            size,
            state: FreeBar { lateral, nominal: stretch * response.stress[0] },
        })
    })
}

/// State at a trial stretch.
struct TrialStretch<T> {
    /// Stress that must vanish, and its derivative by the logarithm of the stretch, Pa.
    residual: f64,
    slope: f64,
    /// Size of the terms whose difference the residual is, Pa.
    size: f64,
    state: T,
}

/// Finds the logarithm of a stretch whose stress vanishes, by Newton's method from `log`, bracketed as it
/// goes; the stress grows with the stretch. A trial that locks, beyond a bound from below, goes back half
/// way.
fn balanced<T>(
    mut log: f64,
    iteration: &'static str,
    trial: impl Fn(f64) -> Result<TrialStretch<T>, Error>,
) -> Result<T, Error> {
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut residual = f64::NAN;
    for _ in 0..MAX_STEPS {
        let found = match trial(log) {
            Err(error) if !low.is_finite() => return Err(error),
            Err(_) => {
                high = log;
                log = 0.5 * (low + high);
                continue;
            }
            Ok(found) => found,
        };
        residual = found.residual;
        if residual.abs() <= 16.0 * f64::EPSILON * found.size {
            return Ok(found.state);
        }
        if residual > 0.0 {
            high = high.min(log)
        } else {
            low = low.max(log)
        }
        let next = log - (residual / found.slope).clamp(-1.0, 1.0);
        log = if found.slope > 0.0 && next > low && next < high {
            next
        } else if low.is_finite() && high.is_finite() {
            0.5 * (low + high)
        } else {
            log - residual.signum()
        };
    }
    Err(Error::NoConvergence { iteration, steps: MAX_STEPS, residual })
}

/// Plane-stress state of a compressible law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneStress {
    /// F with its thickness stretch.
    pub deformation: DeformationGradient,
    /// PK2 stress in the plane, [S₁₁, S₂₂, S₁₂], Pa.
    pub stress: Vector3<f64>,
    /// ∂[S₁₁, S₂₂, S₁₂]/∂[E₁₁, E₂₂, 2E₁₂] at S₃₃ = 0 (ℂ₃₃₃₃ condensed out), Pa.
    pub tangent: Matrix3<f64>,
}

/// Finds the thickness stretch with S₃₃ = 0 by Newton's method in ln λ₃, bracketed as it goes.
///
/// # Errors
/// An inadmissible in-plane gradient, errors of the law, [`Error::NoConvergence`].
pub fn plane_stress<L: Hyperelastic + ?Sized>(law: &L, in_plane: &Tensor2) -> Result<PlaneStress, Error> {
    let start = DeformationGradient::plane_stress_incompressible(in_plane)?.matrix()[(2, 2)].ln();
    let (deformation, stress, tangent) = balanced(start, "plane-stress thickness", |log| {
        let deformation = DeformationGradient::plane_stress(in_plane, log.exp())?;
        let stress = voigt::from_stress(&law.second_piola_kirchhoff(&deformation)?);
        let tangent = law.material_tangent(&deformation)?;
        Ok(TrialStretch {
            residual: stress[2],
            slope: tangent[(2, 2)] * (2.0 * log).exp(),
            // the rest is rounding of S₃₃ itself, a difference of terms as large as the tangent
            size: tangent.amax().max(stress.amax()),
            state: (deformation, stress, tangent),
        })
    })?;
    Ok(condensed(deformation, &stress, &tangent))
}

const MAX_STEPS: usize = 100;

/// Static condensation of E₃₃ at S₃₃ = 0. The out-of-plane shears do not couple: the law is isotropic and F
/// is block-diagonal.
fn condensed(
    deformation: DeformationGradient,
    stress: &voigt::Voigt,
    tangent: &voigt::Voigt6x6,
) -> PlaneStress {
    const IN_PLANE: [usize; 3] = [0, 1, 3];
    PlaneStress {
        deformation,
        stress: Vector3::from_fn(|i, _| stress[IN_PLANE[i]]),
        tangent: Matrix3::from_fn(|i, j| {
            let (a, b) = (IN_PLANE[i], IN_PLANE[j]);
            tangent[(a, b)] - tangent[(a, 2)] * tangent[(2, b)] / tangent[(2, 2)]
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::{Compressible, MODELS, Volumetric};

    /// Central differences: truncation h² ~ 1e-10, rounding ε/h ~ 2e-11 of the modulus.
    const STEP: f64 = 1e-5;
    const DIFFERENCE: f64 = 2e-8;

    /// λ⁻² = 1e320: S is finite, the nominal stress is not.
    #[test]
    fn a_stress_beyond_all_numbers_is_refused() {
        let law = MODELS[0].law(&[1e6]).unwrap();
        assert!(matches!(uniaxial(&law, 1e-160), Err(Error::Overflow { .. })));
        assert!(uniaxial(&law, 1e-100).unwrap() < -1e205);
    }

    /// After (1.28) the thesis prints λ₁λ₂λ₃ = 3.
    #[test]
    fn incompressible_means_unit_volume() {
        let mut worst: f64 = 0.0;
        for (a, b) in [(2.0, 0.25), (1.5, 0.9), (7.5, 7.5)] {
            let product: f64 = incompressible(a, b).unwrap().iter().product();
            worst = worst.max((product - 1.0).abs());
        }
        evidence::at_most("λ₁λ₂λ₃ − 1 of incompressible stretches", worst, 4e-16);
        assert!(incompressible(2.0, 0.0).is_err());
        assert!(incompressible(f64::NAN, 1.0).is_err());
    }

    /// An incompressible law with its pressure has the stress of the tension test: S from W plus −pJC⁻¹ with
    /// S₃₃ = 0.
    #[test]
    fn pressure_closes_the_incompressible_laws() {
        for model in MODELS {
            let law = model.law(model.example).unwrap();
            let stretches = incompressible(1.8, 1.2).unwrap();
            let pressure = law.response_at(stretches).unwrap().stress[2] * stretches[2] * stretches[2];
            let nominal = biaxial(&law, 1.8, 1.2).unwrap();
            // the coupling −g ln J acts as a pressure too, and is nil at J = 1 only in energy
            let closed = Compressible::new(law, Volumetric::Pressure { pressure }).unwrap();
            let stress = closed.response_at(stretches).unwrap().stress;
            let free = stress[2] * stretches[2] * stretches[2];
            for i in 0..2 {
                let found = (stress[i] * stretches[i] * stretches[i] - free) / stretches[i];
                assert!((found / nominal[i] - 1.0).abs() < 1e-12, "{}", model.key);
            }
        }
    }

    /// A nearly incompressible sheet tends to the incompressible tension test, and its condensed tangent is
    /// the derivative of its stress.
    #[test]
    fn plane_stress_of_compressible_laws() {
        for model in MODELS {
            let law = model.law(model.example).unwrap();
            let nominal = biaxial(&law, 1.5, 0.9).unwrap();
            for volumetric in [
                Volumetric::Quadratic { lame: 4e10 },
                Volumetric::Logarithmic { lame: 4e10 },
                Volumetric::Ciarlet { lame: 4e10 },
            ] {
                let law = Compressible::new(model.law(model.example).unwrap(), volumetric).unwrap();
                let state = plane_stress(&law, &Tensor2::new(1.5, 0.0, 0.0, 0.9)).unwrap();
                for (i, l) in [1.5, 0.9].into_iter().enumerate() {
                    // compressibility μ/λ = 1e-5
                    assert!((l * state.stress[i] / nominal[i] - 1.0).abs() < 1e-4, "{}", law.name());
                }
            }
            let law = Compressible::new(law, Volumetric::Quadratic { lame: 1e6 }).unwrap();
            let in_plane = Tensor2::new(1.4, 0.2, -0.1, 0.8);
            let state = plane_stress(&law, &in_plane).unwrap();
            let full = law.second_piola_kirchhoff(&state.deformation).unwrap();
            assert!(full[(2, 2)].abs() < 1e-12 * full.amax(), "{}", law.name());
            let inverse = in_plane.try_inverse().unwrap().transpose();
            for (column, g) in [(0, [1.0, 0.0, 0.0]), (1, [0.0, 1.0, 0.0]), (2, [0.0, 0.0, 0.5])] {
                let by = inverse * Tensor2::new(g[0], g[2], g[2], g[1]) * STEP;
                let up = plane_stress(&law, &(in_plane + by)).unwrap().stress;
                let down = plane_stress(&law, &(in_plane - by)).unwrap().stress;
                let slope = (up - down) / (2.0 * STEP);
                let error = (slope - state.tangent.column(column)).amax();
                assert!(
                    error < DIFFERENCE * state.tangent.amax(),
                    "{}: {slope} {}",
                    law.name(),
                    state.tangent
                );
            }
        }
    }
}
