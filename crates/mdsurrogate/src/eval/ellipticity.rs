//! Loss of ellipticity of a law in its training range.

use crate::Error;
use crate::kinematics::stretch_from_c;
use nalgebra::{Matrix3, Vector3};
use polycore::constitutive::{Law, Workspace};
use polycore::tensor::{Tensor, Voigt, voigt};

/// Number of tested wave directions per state, over half of the sphere.
const DIRECTIONS: usize = 200;

/// Relative eigenvalue, to the norm of the tangent, below which it is rounding.
const ROUNDING: f64 = 1e-9;

/// Result of a scan for loss of ellipticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipticity {
    /// Number of tested states.
    pub states: usize,
    /// Number of states that lost ellipticity: the smallest eigenvalue of the acoustic tensor is negative.
    pub lost: usize,
    /// Smallest eigenvalue of all states, Pa: ρ₀ times the square of the slowest wave speed.
    pub least: f64,
    /// C of the state with this eigenvalue.
    pub at: Voigt,
    /// Direction N of this wave in the undeformed body.
    pub direction: [f64; 3],
}

impl Ellipticity {
    /// Scans a law at some strains; `None` without strains. The acoustic tensor is Q_ik = 𝔸_iJkL N_J N_L with
    /// 𝔸 = ∂P/∂F; for an `ann` its symmetric part (Ogden 1997, *Non-linear elastic deformations*, 6.2.7).
    ///
    /// # Errors
    /// Returns the errors of the law.
    pub fn scan(law: &dyn Law, strains: &[Voigt]) -> Result<Option<Self>, Error> {
        let mut memory = Workspace::default();
        let mut found: Option<Self> = None;
        for c in strains {
            let f = stretch_from_c(c)?;
            let answer = law.tangent(c, &mut memory)?;
            let tangent = answer.tangent.unwrap_or_default();
            let moduli = voigt::nominal_tangent(&f, &answer.stress, &tangent);
            let acoustic = |n: &Vector3<f64>| {
                let q: Tensor = Matrix3::from_fn(|i, k| {
                    (0..9).map(|jl| moduli[(3 * i + jl / 3, 3 * k + jl % 3)] * n[jl / 3] * n[jl % 3]).sum()
                });
                (0.5 * (q + q.transpose())).symmetric_eigenvalues().min()
            };
            let tried = directions().map(|n| (acoustic(&n), n));
            let Some((mut least, mut n)) = tried.min_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
            // refine the direction
            let mut step = 0.1;
            while step > 1e-3 {
                let better = (0..6).find_map(|k| {
                    let mut moved = n;
                    moved[k % 3] += if k < 3 { step } else { -step };
                    let moved = moved.normalize();
                    let value = acoustic(&moved);
                    (value < least).then_some((value, moved))
                });
                match better {
                    Some(found) => (least, n) = found,
                    None => step *= 0.5,
                }
            }
            let lost = usize::from(least < -ROUNDING * tangent.norm());
            let all = found.get_or_insert(Self {
                states: 0,
                lost: 0,
                least: f64::INFINITY,
                at: *c,
                direction: n.into(),
            });
            (all.states, all.lost) = (all.states + 1, all.lost + lost);
            if least < all.least {
                (all.least, all.at, all.direction) = (least, *c, n.into());
            }
        }
        Ok(found)
    }
}

/// Iterates over directions, evenly on half of the sphere, along a spiral of golden angles.
fn directions() -> impl Iterator<Item = Vector3<f64>> {
    (0..DIRECTIONS).map(|k| {
        let z = (k as f64 + 0.5) / DIRECTIONS as f64;
        let angle = k as f64 * std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
        let radius = (1.0 - z * z).sqrt();
        Vector3::new(radius * angle.cos(), radius * angle.sin(), z)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use polycore::constitutive::hyperelastic::{Compressible, Volumetric, model};

    /// Law μ (F Fᵀ − 1) + λ ln J: Q at I has the eigenvalues μ, μ, λ + 2μ. Under a dilation l they are μ and
    /// μ + (μ + λ − 3λ ln l)/l² along N, negative for large l.
    #[test]
    fn waves_of_a_closed_form() {
        let (mu, lame) = (0.2e6, 4e6);
        let law = model("neo-hookean").unwrap().law(&[mu]).unwrap();
        let law = Compressible::new(law, Volumetric::Logarithmic { lame }).unwrap();
        let at = |l: f64| Voigt::new(l * l, l * l, l * l, 0.0, 0.0, 0.0);
        let rest = Ellipticity::scan(&law, &[at(1.0)]).unwrap().unwrap();
        assert!((rest.least / mu - 1.0).abs() < 1e-9 && rest.lost == 0, "{rest:?}");
        for l in [0.8, 1.1, 1.4, 2.5] {
            let found = Ellipticity::scan(&law, &[at(l)]).unwrap().unwrap();
            let along = mu + (mu + lame - 3.0 * lame * f64::ln(l)) / (l * l);
            let expected = along.min(mu);
            assert!((found.least / expected - 1.0).abs() < 1e-6, "{l}: {found:?} {expected}");
            assert_eq!(found.lost, usize::from(expected < 0.0));
        }
        let all = Ellipticity::scan(&law, &[at(1.0), at(2.5), at(1.1)]).unwrap().unwrap();
        assert_eq!((all.states, all.lost, all.at), (3, 1, at(2.5)));
        assert!(Ellipticity::scan(&law, &[]).unwrap().is_none());
    }

    /// Extension along x until λ(1 − ln J) < 0: waves across, along the unstretched edges, stop first.
    #[test]
    fn direction_of_a_lost_wave() {
        let law = model("neo-hookean").unwrap().law(&[1e5]).unwrap();
        let law = Compressible::new(law, Volumetric::Logarithmic { lame: 4e6 }).unwrap();
        let found = Ellipticity::scan(&law, &[Voigt::new(16.0, 1.0, 1.0, 0.0, 0.0, 0.0)]).unwrap().unwrap();
        assert!(found.lost == 1 && found.direction[0].abs() < 1e-3, "{found:?}");
    }
}
