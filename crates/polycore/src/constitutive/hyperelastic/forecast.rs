//! Forecast of the rest of tension curves from their beginning, with a band from other curves.
//!
//! Laws are fitted to the beginning of each curve, up to the stretch λₕ. With e = ln(P measured/P of the law)
//! and x = ¼ + (λ − λₕ)/(λₕ − 1), the extrapolation in lengths of the beginning and ¼ for the lack of fit at
//! its end, a curve has the slopes min e/x and max e/x. The band of a curve runs between the least and the
//! largest slopes of the other curves: if the n curves are exchangeable and the law is given, a curve has the
//! least slope of all with probability 1/n, and the largest likewise, so that a whole curve lies inside with
//! 1 − 2/n (Wilks, doi:10.1214/aoms/1177731788). Among several laws that of the narrowest band of the other
//! curves is taken.

use super::data::{Mode, TestData, TestState};
use super::fit::{Identifiability, fit_until};
use super::{Error, Hyperelastic, ModelDescriptor, homogeneous};

/// Tension curve to rupture.
#[derive(Debug, Clone, PartialEq)]
pub struct TensionCurve {
    /// Name of the specimen or material.
    pub name: String,
    /// Stretches and nominal stresses (Pa), ascending; the last one is that of rupture.
    pub points: Vec<[f64; 2]>,
}

/// Forecast of a point that the fit did not see.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForecastPoint {
    /// Stretch.
    pub stretch: f64,
    /// Measured nominal stress, Pa.
    pub measured: f64,
    /// Nominal stress of the law, Pa.
    pub predicted: f64,
    /// Band, Pa.
    pub band: [f64; 2],
}

/// Forecast of a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Forecast {
    /// Key of the law.
    pub law: &'static str,
    /// Points beyond the beginning.
    pub points: Vec<ForecastPoint>,
    /// Locking stretch in tension of the eight-chain law, from the beginning and from the whole curve; `None`
    /// where the data do not determine it.
    pub locking: [Option<f64>; 2],
    /// Band of the second locking stretch from the first one.
    pub locking_band: Option<[f64; 2]>,
}

impl ForecastPoint {
    /// Returns true if the measurement lies in the band.
    pub fn is_inside(&self) -> bool {
        (self.band[0]..=self.band[1]).contains(&self.measured)
    }
}

/// Law of the locking stretch.
const CHAIN: &str = "eight-chain";

/// Least number of curves: one to predict and two for a band.
pub const LEAST_CURVES: usize = 3;

/// Lack of fit at the end of the beginning, as an extrapolation in lengths of the beginning.
const LACK_OF_FIT: f64 = 0.25;

/// Errors of a law beyond the beginning of a curve.
struct LawTrial {
    /// Stress of the law at each point beyond the beginning.
    predicted: Vec<f64>,
    /// Least and largest e/x.
    slopes: [f64; 2],
}

/// Forecasts each curve from the share of its strain range, with the band of the others.
///
/// # Errors
/// [`Error::Data`] for fewer than three curves, a curve without points before and after the end of its
/// beginning, no law that can be continued on all curves; [`Error::Stopped`].
pub fn forecast(
    curves: &[TensionCurve],
    share: f64,
    laws: &[&'static ModelDescriptor],
    stop: &dyn Fn() -> bool,
) -> Result<Vec<Forecast>, Error> {
    let refused = |what: &str, reason: String| Error::Data { what: what.to_owned(), reason };
    if curves.len() < LEAST_CURVES {
        return Err(refused("forecast", format!("{} curves, {LEAST_CURVES} needed", curves.len())));
    }
    let mut trials: Vec<Vec<Option<LawTrial>>> = Vec::new();
    let mut lockings = Vec::new();
    let chain = super::model(CHAIN)?;
    for curve in curves {
        let (first, rest) = curve.split(share);
        if first.is_empty() || rest.is_empty() {
            let reason = format!("{} points before and {} after its beginning", first.len(), rest.len());
            return Err(refused(&format!("curve `{}`", curve.name), reason));
        }
        let reached = 1.0 + share * (curve.rupture() - 1.0);
        let mut own = Vec::new();
        for law in laws {
            own.push(match fit_until(law, &table(first), stop) {
                Ok(fit) => trial(&fit.law, rest, reached),
                Err(Error::Stopped) => return Err(Error::Stopped),
                Err(_) => None,
            });
        }
        trials.push(own);
        lockings.push([locking(chain, first, stop)?, locking(chain, &curve.points, stop)?]);
    }
    let mut found = Vec::new();
    for (i, curve) in curves.iter().enumerate() {
        let others = |k: usize| (0..curves.len()).filter(move |j| *j != i).map(move |j| (j, k));
        let slopes = |k: usize| {
            let all = others(k).map(|(j, k)| trials[j][k].as_ref().map(|trial| trial.slopes));
            extremes(all.collect::<Option<Vec<_>>>()?)
        };
        let narrowest = (0..laws.len())
            .filter(|&k| trials[i][k].is_some())
            .filter_map(|k| slopes(k).map(|band| (k, band)))
            .min_by(|(_, a), (_, b)| (a[1] - a[0]).total_cmp(&(b[1] - b[0])));
        let Some((k, band)) = narrowest else {
            return Err(refused(
                &format!("curve `{}`", curve.name),
                "no law continues all curves".to_owned(),
            ));
        };
        let reached = 1.0 + share * (curve.rupture() - 1.0);
        let (_, rest) = curve.split(share);
        let predicted = trials[i][k].iter().flat_map(|trial| trial.predicted.iter().copied());
        let point = |(&[stretch, measured], predicted): (&[f64; 2], f64)| {
            let x = extrapolation(stretch, reached);
            let band = band.map(|slope| predicted * (slope * x).exp());
            ForecastPoint { stretch, measured, predicted, band }
        };
        let ratios = others(0).filter_map(|(j, _)| {
            let [first, whole] = lockings[j];
            first.zip(whole).map(|(first, whole)| [(whole / first).ln(); 2])
        });
        let ratios = extremes(ratios.collect());
        let locking_band = ratios.zip(lockings[i][0]).map(|(band, at)| band.map(|log| at * log.exp()));
        let points = rest.iter().zip(predicted).map(point).collect();
        found.push(Forecast { law: laws[k].key, points, locking: lockings[i], locking_band });
    }
    Ok(found)
}

impl TensionCurve {
    /// Largest stretch.
    pub fn rupture(&self) -> f64 {
        self.points.last().map_or(1.0, |point| point[0])
    }

    /// Points up to a share of the strain range, and those beyond.
    pub fn split(&self, share: f64) -> (&[[f64; 2]], &[[f64; 2]]) {
        let reached = 1.0 + share * (self.rupture() - 1.0);
        self.points.split_at(self.points.partition_point(|point| point[0] <= reached))
    }
}

/// Least first and largest second value of some pairs; `None` of none.
fn extremes(pairs: Vec<[f64; 2]>) -> Option<[f64; 2]> {
    pairs.into_iter().reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

fn table(points: &[[f64; 2]]) -> TestData {
    let mode = Mode::Uniaxial;
    let state = |&[stretch, nominal]: &[f64; 2]| {
        TestState::new(mode, [stretch, mode.second_stretch(stretch)], [nominal, 0.0])
    };
    TestData::new(String::new(), points.iter().map(state).collect())
}

/// x of a stretch beyond the end of the beginning.
fn extrapolation(stretch: f64, reached: f64) -> f64 {
    LACK_OF_FIT + (stretch - reached) / (reached - 1.0)
}

/// Continues a law beyond the beginning; `None` if it locks there or has no stress above zero.
fn trial<L: Hyperelastic + ?Sized>(law: &L, rest: &[[f64; 2]], reached: f64) -> Option<LawTrial> {
    let (mut predicted, mut slopes) = (Vec::new(), [f64::INFINITY, f64::NEG_INFINITY]);
    for &[stretch, measured] in rest {
        let nominal = homogeneous::uniaxial(law, stretch).ok()?;
        let slope = (measured / nominal).ln() / extrapolation(stretch, reached);
        if !slope.is_finite() {
            return None;
        }
        slopes = [slopes[0].min(slope), slopes[1].max(slope)];
        predicted.push(nominal);
    }
    Some(LawTrial { predicted, slopes })
}

/// Locking stretch in tension, λ² + 2/λ = 3n, of the eight-chain law; `None` if the data do not determine n.
fn locking(
    chain: &'static ModelDescriptor,
    points: &[[f64; 2]],
    stop: &dyn Fn() -> bool,
) -> Result<Option<f64>, Error> {
    let fit = match fit_until(chain, &table(points), stop) {
        Ok(fit) => fit,
        Err(Error::Stopped) => return Err(Error::Stopped),
        Err(_) => return Ok(None),
    };
    let links = &fit.parameters[1];
    if links.identifiability != Identifiability::Determined {
        return Ok(None);
    }
    let mut stretch = (3.0 * links.value).sqrt();
    for _ in 0..50 {
        stretch = (3.0 * links.value - 2.0 / stretch).sqrt();
    }
    Ok(Some(stretch))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::{EightChain, model};

    fn curve(name: &str, modulus: f64, links: f64, rupture: f64) -> TensionCurve {
        let law = EightChain::new(modulus, links).unwrap();
        let point = |i: i32| {
            let stretch = 1.0 + (rupture - 1.0) * f64::from(i) / 12.0;
            [stretch, homogeneous::uniaxial(&law, stretch).unwrap()]
        };
        TensionCurve { name: name.to_owned(), points: (1..=12).map(point).collect() }
    }

    /// Curves of one law give it back: no error beyond the beginning, a band without width, the locking
    /// stretch of λ² + 2/λ = 3n.
    #[test]
    fn curves_of_the_law_itself() {
        let curves: Vec<TensionCurve> = [(0.2e6, 12.0, 5.0), (0.1e6, 30.0, 8.0), (0.4e6, 6.0, 3.8)]
            .iter()
            .map(|&(modulus, links, rupture)| curve("c", modulus, links, rupture))
            .collect();
        let found = forecast(&curves, 0.6, &[model("eight-chain").unwrap()], &|| false).unwrap();
        for (one, links) in found.iter().zip([12.0, 30.0, 6.0]) {
            for point in &one.points {
                assert!((point.predicted / point.measured - 1.0).abs() < 1e-5, "{point:?}");
                assert!((point.band[1] / point.band[0] - 1.0).abs() < 1e-4, "{point:?}");
            }
            let [first, whole] = one.locking.map(Option::unwrap);
            assert!((whole * whole + 2.0 / whole - 3.0 * links).abs() < 1e-4 * links);
            assert!((first / whole - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn bands_hold_what_the_others_do() {
        let mut curves: Vec<TensionCurve> =
            (0..4).map(|i| curve("c", 0.2e6, 40.0, 5.0 + f64::from(i))).collect();
        let last = curves[0].points.len() - 1;
        curves[0].points[last][1] *= 1.3;
        let found = forecast(&curves, 0.5, &[model("eight-chain").unwrap()], &|| false).unwrap();
        assert!(!found[0].points.iter().all(ForecastPoint::is_inside), "{:?}", found[0]);
        assert!(
            found[1..].iter().all(|one| one.points.last().unwrap().band[1] > 1.2 * one.points[0].band[0])
        );
        assert!(forecast(&curves[..2], 0.5, &[model("eight-chain").unwrap()], &|| false).is_err());
        assert!(forecast(&curves, 1.0, &[model("eight-chain").unwrap()], &|| false).is_err());
        let stopped = forecast(&curves, 0.5, &[model("eight-chain").unwrap()], &|| true);
        assert!(matches!(stopped, Err(Error::Stopped)));
    }
}
