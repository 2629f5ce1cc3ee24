//! Fit of kinetic constants to curves measured in a part; the model is a whole simulation.

use super::least_squares::minimize;
use super::{Estimate, KineticFit, check};
use crate::error::Error;
use crate::kinetics::{GAS_CONSTANT, KineticConstants};

/// Difference step of ln K and ln K_G: well above the effect of adaptive time steps on α.
const STEP: f64 = 1e-3;

/// Temperature, K, and α at each measurement for given constants; `None` if a simulation fails.
pub type Model<'a> = dyn Fn(&KineticConstants) -> Option<Vec<[f64; 2]>> + 'a;

/// Fits K₀ and K_G of Eqs (4.6) and (4.7), starting from `start`; its other constants are kept.
///
/// Estimates: `growth_rate` K₀ in 1/s, `nucleation` K_G in K².
///
/// # Errors
/// [`Error::Data`] as for [`avrami`](super::avrami), for a model that fails or does not crystallize at
/// `start`, and curves that do not determine both constants (of a single temperature, for example).
pub fn fit_in_part(model: &Model, degrees: &[f64], start: &KineticConstants) -> Result<KineticFit, Error> {
    let what = "fit of a part";
    let refuse = |reason: &str| Error::Data { what: what.to_owned(), reason: reason.to_owned() };
    check(what, degrees, 2)?;
    let first = model(start).ok_or_else(|| refuse("the part fails with the constants that it has"))?;
    let inside = |&&[temperature, degree]: &&[f64; 2]| {
        let kinetic = temperature > start.frozen && temperature < start.equilibrium_melting;
        kinetic && (0.01..=0.99).contains(&degree)
    };
    let (sum, count) =
        first.iter().filter(inside).fold((0.0, 0.0), |(sum, count), row| (sum + row[0], count + 1.0));
    if count == 0.0 {
        return Err(refuse(
            "with the constants that the part has, no alpha is between 0.01 and 0.99 at any measurement",
        ));
    }
    // parameters: ln of K where the part crystallizes, and of K_G. K₀ itself would be nearly collinear with
    // K_G.
    let middle = sum / count;
    let melting = start.equilibrium_melting;
    let barrier = (middle + melting) / (2.0 * middle * middle * (melting - middle));
    let jump = start.activation_energy / (GAS_CONSTANT * (middle - start.frozen));
    let logarithm = |q: &[f64]| q[0] + jump + q[1].exp() * barrier;
    let constants =
        |q: &[f64]| KineticConstants { growth_rate: logarithm(q).exp(), nucleation: q[1].exp(), ..*start };
    let residuals = |q: &[f64]| -> Option<Vec<f64>> {
        let found = model(&constants(q))?;
        Some(found.iter().zip(degrees).map(|(row, data)| row[1] - data).collect())
    };
    let begin = vec![start.growth_rate.ln() - jump - start.nucleation * barrier, start.nucleation.ln()];
    let minimum = minimize(what, &residuals, degrees.len(), &[begin], STEP)?;
    let q = &minimum.parameters;
    let estimate = |name, unit: &str, value: f64, gradient: [f64; 2]| {
        Estimate::of_logarithm(name, unit, value, minimum.error_of(&gradient), minimum.degrees)
    };
    Ok(KineticFit {
        estimates: vec![
            estimate("growth_rate", "1/s", logarithm(q), [1.0, q[1].exp() * barrier]),
            estimate("nucleation", "K^2", q[1], [0.0, 1.0]),
        ],
        draws: minimum.draws(|q| vec![logarithm(q).exp(), q[1].exp()]),
        rms: minimum.rms(),
        measurements: degrees.len(),
        evaluations: minimum.evaluations,
        model: minimum.residuals.iter().zip(degrees).map(|(residual, data)| residual + data).collect(),
    })
}
