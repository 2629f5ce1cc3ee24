//! Forecast of a cooling at a rate that was not measured.

use super::{FixedConstants, KineticFit, Run, quantile};
use crate::error::Error;
use crate::kinetics::Kinetics;

/// Shares α of a forecast.
pub const SHARES: [f64; 7] = [0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95];

/// Temperature step, K, of the cooling curves of the law.
const STEP: f64 = 0.1;

/// Temperature at which a share is reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForecastRow {
    /// Share α.
    pub share: f64,
    /// Temperature of the law, K.
    pub law: f64,
    /// Temperature of the law with its misfit to the measured runs, K.
    pub temperature: f64,
    /// Band of 95 % around it, K.
    pub band: [f64; 2],
}

/// Forecasts the temperatures at which [`SHARES`] are reached at a cooling rate, K/s, from runs at constant
/// rates, K/s, and the fit of Nakamura's law to them; shares that a run does not reach are left out.
///
/// The misfit T_measured − T_law of a share is a straight line in the logarithm of the rate, held constant
/// beyond the measured rates. The band is ± t₀.₉₅ s with the rms misfit s of all shares and runs: the lack of
/// fit of the law. Scatter between samples enters as far as the runs show it.
///
/// # Errors
/// [`Error::Data`] if no share is reached in all runs, or the law does not reach it above T∞;
/// [`Error::Parameter`] for constants out of their domain.
pub fn forecast(
    runs: &[(f64, &Run)],
    known: &FixedConstants,
    fit: &KineticFit,
    rate: f64,
) -> Result<Vec<ForecastRow>, Error> {
    let what = "forecast of a cooling";
    let refuse = |reason: String| Error::Data { what: what.to_owned(), reason };
    let estimate = |name: &str| {
        fit.get(name).map(|found| found.value).ok_or_else(|| refuse(format!("the fit has no `{name}`")))
    };
    let kinetics =
        known.kinetics(estimate("growth_rate")?, estimate("nucleation")?, estimate("avrami_exponent")?)?;
    let shares: Vec<f64> = SHARES
        .into_iter()
        .filter(|&share| runs.iter().all(|(_, run)| reached(run, share).is_some()))
        .collect();
    if shares.is_empty() {
        return Err(refuse("no share of 0.05 to 0.95 is reached in all runs".to_owned()));
    }
    let curves = runs.iter().map(|&(rate, _)| cooling(&kinetics, known, rate));
    let curves = curves.collect::<Result<Vec<Run>, Error>>()?;
    let wanted = cooling(&kinetics, known, rate)?;
    let temperature = |curve: &Run, share: f64| {
        reached(curve, share).ok_or_else(|| refuse(format!("the law does not reach α = {share} above T∞")))
    };
    let logarithms: Vec<f64> = runs.iter().map(|(rate, _)| rate.ln()).collect();
    let [least, most] =
        logarithms.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], &x| [a.min(x), b.max(x)]);
    let place = rate.ln().clamp(least, most);
    let (mut rows, mut squares) = (Vec::new(), 0.0);
    for &share in &shares {
        let mut misfits = Vec::new();
        for ((_, run), curve) in runs.iter().zip(&curves) {
            let measured = reached(run, share).unwrap_or(f64::NAN);
            misfits.push(measured - temperature(curve, share)?);
        }
        squares += misfits.iter().map(|misfit| misfit * misfit).sum::<f64>();
        let law = temperature(&wanted, share)?;
        rows.push(ForecastRow {
            share,
            law,
            temperature: law + line(&logarithms, &misfits, place),
            band: [0.0; 2],
        });
    }
    let freedom = (shares.len() * runs.len()).saturating_sub(fit.estimates.len()).max(1);
    let reach = quantile(freedom) * (squares / freedom as f64).sqrt();
    rows.iter_mut().for_each(|row| row.band = [row.temperature - reach, row.temperature + reach]);
    Ok(rows)
}

/// Cooling curve of the law from T₀ to T∞.
fn cooling(kinetics: &Kinetics, known: &FixedConstants, rate: f64) -> Result<Run, Error> {
    let [high, low] = [known.equilibrium_melting, known.frozen];
    let count = ((high - low) / STEP).ceil() as usize;
    let temperatures = (0..count).map(|row| high - row as f64 * STEP).collect();
    let mut run = Run::cooling(rate, temperatures, vec![0.0; count], known)?;
    run.degrees = run.integrals(kinetics).into_iter().map(|z| kinetics.degree(z)).collect();
    Ok(run)
}

/// Temperature at which α first reaches a share, K, linear between the rows.
fn reached(run: &Run, share: f64) -> Option<f64> {
    let row = run.degrees.iter().position(|&degree| degree >= share)?;
    let before = row.checked_sub(1);
    let Some(before) = before else { return (run.degrees[row] <= share).then(|| run.temperatures[row]) };
    let [low, high] = [run.degrees[before], run.degrees[row]];
    let [start, end] = [run.temperatures[before], run.temperatures[row]];
    Some(start + (end - start) * (share - low) / (high - low))
}

/// Value at `place` of the least-squares line through points; their mean where they have one abscissa.
fn line(x: &[f64], y: &[f64], place: f64) -> f64 {
    let count = x.len() as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
    let [middle, level] = [mean(x), mean(y)];
    let spread: f64 = x.iter().map(|x| (x - middle).powi(2)).sum();
    let slope: f64 = x.iter().zip(y).map(|(x, y)| (x - middle) * (y - level)).sum();
    if spread > 0.0 { level + slope / spread * (place - middle) } else { level }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::nakamura;
    use crate::kinetics::KineticConstants;

    const KNOWN: FixedConstants =
        FixedConstants { equilibrium_melting: 466.35, frozen: 294.15, activation_energy: 6270.0 };

    /// Run of Table 4.1, column 1, at a rate, K/min, whose temperatures are raised by a function of α.
    fn run(rate: f64, raised: impl Fn(f64) -> f64) -> Run {
        let kinetics = Kinetics::new(KineticConstants::TABLE_4_1_COLUMN_1).expect("constants");
        let mut run = cooling(&kinetics, &KNOWN, rate / 60.0).expect("a curve");
        let rows = run.degrees.iter().position(|&degree| degree > 0.999).expect("an end");
        run.times.truncate(rows);
        run.degrees.truncate(rows);
        run.temperatures.truncate(rows);
        run.temperatures.iter_mut().zip(&run.degrees).for_each(|(t, &degree)| *t += raised(degree));
        run
    }

    fn forecast_of(runs: [(f64, &Run); 2], rate: f64) -> Vec<ForecastRow> {
        let fit = nakamura(&runs.map(|(_, run)| run.clone()), &KNOWN).expect("a fit");
        let runs = runs.map(|(rate, run)| (rate / 60.0, run));
        forecast(&runs, &KNOWN, &fit, rate / 60.0).expect("a forecast")
    }

    /// Exact runs give the law itself and a band of nearly no width.
    #[test]
    fn exact_runs() {
        let [slow, fast, truth] = [5.0, 10.0, 7.5].map(|rate| run(rate, |_| 0.0));
        let rows = forecast_of([(5.0, &slow), (10.0, &fast)], 7.5);
        assert_eq!(rows.len(), SHARES.len());
        for row in rows {
            let exact = reached(&truth, row.share).expect("a share");
            assert!((row.temperature - exact).abs() < 1e-3, "{row:?}, {exact}");
            assert!(row.band[1] - row.band[0] < 2e-3, "{row:?}");
        }
    }

    /// A late tail that the law cannot follow is carried over to the rate between, and lies in the band.
    #[test]
    fn misfit_is_carried_over() {
        let tail = |degree: f64| -6.0 * degree.powi(4);
        let [slow, fast, truth] = [5.0, 10.0, 7.5].map(|rate| run(rate, tail));
        let rows = forecast_of([(5.0, &slow), (10.0, &fast)], 7.5);
        let error = |of: fn(&ForecastRow) -> f64| {
            let errors =
                rows.iter().map(|row| (of(row) - reached(&truth, row.share).expect("a share")).abs());
            errors.fold(0.0, f64::max)
        };
        let [with, without] = [error(|row| row.temperature), error(|row| row.law)];
        assert!(with < 0.05 && without > 0.5, "{with} K with the misfit, {without} K without");
        assert!(rows.iter().all(|row| row.band[0] < row.law && row.law < row.band[1]), "{rows:?}");
    }
}
