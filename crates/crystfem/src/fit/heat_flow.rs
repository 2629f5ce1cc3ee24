//! Relative crystallinity and enthalpy from the heat flow of a calorimeter.

use super::check_finite;
use crate::error::Error;
use serde::Deserialize;

/// Baseline between the limits of integration: the heat flow without the transition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Baseline {
    /// Straight line between the heat flows at the limits.
    #[default]
    Linear,
    /// Heat flow from the value at the first limit to that at the second, in proportion to α: a step of the
    /// heat capacity.
    Sigmoidal,
    /// Heat flow from the tangent before the first limit to the tangent after the second, in proportion to α.
    /// The tangents are least-squares lines through the measurements within a tenth of the peak width from
    /// the limits.
    Tangential,
}

/// Number of measurements per side that a tangent needs.
const TANGENT_ROWS: usize = 3;
/// Limit on iterations of α and its baseline.
const ITERATIONS: usize = 200;
/// Change of α at which the iteration ends.
const CONVERGED: f64 = 1e-12;
/// Smallest peak area over the integral of |q|; smaller ones are rounding errors.
const MIN_AREA: f64 = 1e-10;

/// A peak of heat flow between two limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Peak {
    /// Limits and measurement times between them, s.
    pub times: Vec<f64>,
    /// Heat flow given off by the sample, q, W/kg.
    pub flows: Vec<f64>,
    /// Baseline B, W/kg.
    pub baseline: Vec<f64>,
    /// α(t) = ∫(q − B) dt/ΔH from the first limit to t: 0 at the first limit, 1 at the second.
    pub degrees: Vec<f64>,
    /// ΔH = ∫(q − B) dt between the limits, J/kg.
    pub enthalpy: f64,
}

impl Peak {
    /// Integrates the heat flow given off, W/kg, at `times`, s, between `limits`, s, by the trapezoidal rule.
    /// B = (1 − α) B₁ + α B₂ with lines B₁ and B₂ through the limits is iterated with α; see Höhne, Hemminger
    /// & Flammersheim, Differential Scanning Calorimetry (2003).
    ///
    /// # Errors
    /// [`Error::Data`] for columns of different lengths, numbers that are not finite, times that decrease,
    /// limits that are not in order within the times, too few rows for a tangent, and a baseline that does
    /// not converge; [`Error::Parameter`] for an enthalpy that is not above 0.
    pub fn integrate(
        times: &[f64],
        flows: &[f64],
        limits: [f64; 2],
        baseline: Baseline,
    ) -> Result<Self, Error> {
        let what = "integration of a heat flow";
        let refuse = |reason: String| Error::Data { what: what.to_owned(), reason };
        if times.len() != flows.len() || times.len() < 2 {
            let reason =
                format!("{} times and {} heat flows; allowed: two or more of each", times.len(), flows.len());
            return Err(refuse(reason));
        }
        check_finite(what, "time (s)", times, f64::MIN)?;
        check_finite(what, "heat flow (W/kg)", flows, f64::MIN)?;
        if let Some(row) = (1..times.len()).find(|&row| times[row] < times[row - 1]) {
            let allowed = format!("allowed: {} or later", times[row - 1]);
            return Err(refuse(format!("measurement {}: time = {} s; {allowed}", row + 1, times[row])));
        }
        let [from, to] = limits;
        let [first, last] = [times[0], times[times.len() - 1]];
        if !(first <= from && from < to && to <= last) {
            return Err(refuse(format!("limits {from} and {to} s; allowed: in order, {first} to {last} s")));
        }
        let inside: Vec<usize> =
            (0..times.len()).filter(|&row| times[row] > from && times[row] < to).collect();
        let [start, end] = limits.map(|limit| interpolate(times, flows, limit));
        let cut = |start: f64, values: &[f64], end: f64| {
            let between = inside.iter().map(|&row| values[row]);
            std::iter::once(start).chain(between).chain(std::iter::once(end)).collect::<Vec<f64>>()
        };
        let mut peak = Self {
            times: cut(from, times, to),
            flows: cut(start, flows, end),
            baseline: Vec::new(),
            degrees: Vec::new(),
            enthalpy: 0.0,
        };
        let chord = (end - start) / (to - from);
        // value at its limit and slope of each line
        let lines = match baseline {
            Baseline::Linear => [[start, chord], [end, chord]],
            Baseline::Sigmoidal => [[start, 0.0], [end, 0.0]],
            Baseline::Tangential => {
                let width = 0.1 * (to - from);
                let line = |low: f64, high: f64, limit: f64, side: &str| {
                    let rows = (0..times.len()).filter(|&row| times[row] >= low && times[row] <= high);
                    let rows: Vec<[f64; 2]> = rows.map(|row| [times[row] - limit, flows[row]]).collect();
                    tangent(&rows).ok_or_else(|| {
                        let allowed =
                            format!("allowed: at least {TANGENT_ROWS} at different times, for the tangent");
                        refuse(format!(
                            "{} measurements from {low} to {high} s, {side}; {allowed}",
                            rows.len()
                        ))
                    })
                };
                [
                    line(from - width, from, from, "before the first limit")?,
                    line(to, to + width, to, "after the second limit")?,
                ]
            }
        };
        peak.degrees = peak.times.iter().map(|time| (time - from) / (to - from)).collect();
        for _ in 0..ITERATIONS {
            let change = peak.iterate(limits, lines)?;
            // both lines coincide: B does not depend on α
            if baseline == Baseline::Linear || change < CONVERGED {
                return Ok(peak);
            }
        }
        Err(refuse(format!(
            "the baseline does not converge within {ITERATIONS} iterations; allowed: a step of the heat \
             flow across the peak that is small against the peak"
        )))
    }

    /// Updates the baseline from α, then α; returns the largest change of α.
    fn iterate(&mut self, limits: [f64; 2], lines: [[f64; 2]; 2]) -> Result<f64, Error> {
        let on = |side: usize, time: f64| lines[side][0] + lines[side][1] * (time - limits[side]);
        let rows = self.times.iter().zip(&self.degrees);
        self.baseline = rows.map(|(&t, degree)| (1.0 - degree) * on(0, t) + degree * on(1, t)).collect();
        let (mut sums, mut sum, mut size) = (vec![0.0], 0.0, 0.0);
        for row in 1..self.times.len() {
            let half = 0.5 * (self.times[row] - self.times[row - 1]);
            let over = |row: usize| self.flows[row] - self.baseline[row];
            sum += half * (over(row - 1) + over(row));
            size += half * (self.flows[row - 1].abs() + self.flows[row].abs());
            sums.push(sum);
        }
        if !(sum > MIN_AREA * size && sum.is_finite()) {
            let allowed = "above 0: a peak of heat given off over its baseline. Crystallization is \
                exothermal; is `exothermal` the wrong way round, or is the peak outside the limits?";
            return Err(Error::Parameter { name: "enthalpy in J/kg", found: sum, allowed: allowed.into() });
        }
        let mut change = 0.0_f64;
        for (degree, part) in self.degrees.iter_mut().zip(sums) {
            change = change.max((part / sum - *degree).abs());
            *degree = part / sum;
        }
        self.enthalpy = sum;
        Ok(change)
    }
}

/// Interpolates a column at a time within sorted times.
pub fn interpolate(times: &[f64], values: &[f64], time: f64) -> f64 {
    let after = times.partition_point(|&t| t < time).clamp(1, times.len() - 1);
    let [a, b] = [times[after - 1], times[after]];
    let share = if b > a { (time - a) / (b - a) } else { 1.0 };
    values[after - 1] + share * (values[after] - values[after - 1])
}

/// Fits a line; returns its value at 0 and its slope.
fn tangent(rows: &[[f64; 2]]) -> Option<[f64; 2]> {
    let count = rows.len() as f64;
    let mean = |k: usize| rows.iter().map(|row| row[k]).sum::<f64>() / count;
    let [x, y] = [mean(0), mean(1)];
    let square: f64 = rows.iter().map(|row| (row[0] - x).powi(2)).sum();
    let slope = rows.iter().map(|row| (row[0] - x) * (row[1] - y)).sum::<f64>() / square;
    (rows.len() >= TANGENT_ROWS && slope.is_finite()).then_some([y - slope * x, slope])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::LN_2;

    const HALF: f64 = 60.0;
    const EXPONENT: f64 = 3.0;
    const HEAT: f64 = 52e3;

    fn avrami(t: f64) -> f64 {
        crate::kinetics::avrami(t.max(0.0), HALF, EXPONENT)
    }

    /// ΔH dα/dt.
    fn released(t: f64) -> f64 {
        let t = t.max(0.0);
        let slope = LN_2 * EXPONENT / HALF * (t / HALF).powf(EXPONENT - 1.0);
        HEAT * slope * (-LN_2 * (t / HALF).powf(EXPONENT)).exp()
    }

    /// Returns times from −30 to 240 s in `steps` steps, and heat flows over a baseline.
    fn curve(steps: usize, baseline: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
        let times: Vec<f64> = (0..=steps).map(|k| -30.0 + 270.0 * k as f64 / steps as f64).collect();
        let flows = times.iter().map(|&t| released(t) + baseline(t)).collect();
        (times, flows)
    }

    /// Returns the largest error of α and the relative error of ΔH.
    fn errors(peak: &Peak, degree: impl Fn(f64) -> f64, enthalpy: f64) -> [f64; 2] {
        let rows = peak.times.iter().zip(&peak.degrees);
        let worst = rows.map(|(&t, found)| (found - degree(t)).abs()).fold(0.0, f64::max);
        [worst, (peak.enthalpy / enthalpy - 1.0).abs()]
    }

    fn orders(errors: &[[f64; 2]]) -> Vec<[f64; 2]> {
        errors.windows(2).map(|pair| [0, 1].map(|k| (pair[0][k] / pair[1][k]).log2())).collect()
    }

    /// Recovers α, to second order, and ΔH from Avrami's law on a sloped baseline over the whole peak.
    #[test]
    fn a_whole_peak_on_a_slope() {
        let of = |steps: usize| {
            let (times, flows) = curve(steps, |t| 700.0 + 3.0 * t);
            errors(&Peak::integrate(&times, &flows, [-30.0, 240.0], Baseline::Linear).unwrap(), avrami, HEAT)
        };
        let found = [of(216), of(432), of(864)];
        for order in orders(&found) {
            assert!((order[0] - 2.0).abs() < 0.05, "{found:?}: {order:?}");
        }
        assert!(found[2][0] < 1e-5 && found[2][1] < 1e-6, "{found:?}");
    }

    /// Recovers closed forms of α and ΔH to second order with limits in the flanks of the peak, between rows,
    /// under refinement by four.
    #[test]
    fn limits_in_the_flanks() {
        // a third of a step behind a row, at every refinement
        let [a, b] = [21.0 + 1.0 / 3.0, 97.0 + 1.0 / 3.0];
        let [low, high] = [a, b].map(released);
        let area = |t: f64| {
            let share = (t - a) / (b - a);
            HEAT * (avrami(t) - avrami(a)) - (t - a) * (low + 0.5 * share * (high - low))
        };
        let of = |steps: usize| {
            let (times, flows) = curve(steps, |t| -200.0 - 1.5 * t);
            let peak = Peak::integrate(&times, &flows, [a, b], Baseline::Linear).unwrap();
            assert_eq!((peak.degrees[0], *peak.degrees.last().unwrap()), (0.0, 1.0));
            errors(&peak, |t| area(t) / area(b), area(b))
        };
        let found = [1080, 4320, 17280].map(of);
        for order in orders(&found) {
            assert!(order.iter().all(|order| (0.5 * order - 2.0).abs() < 0.05), "{found:?}: {order:?}");
        }
    }

    /// Recovers a step of the heat capacity from levels and from tangents: B = (1 − α) B₁ + α B₂, which a
    /// straight baseline misses by several per cent.
    #[test]
    fn a_step_of_the_heat_capacity() {
        for (baseline, slopes) in [(Baseline::Sigmoidal, [0.0, 0.0]), (Baseline::Tangential, [1.0, 0.4])] {
            let of = |steps: usize, baseline: Baseline| {
                let truth = |t: f64| {
                    let degree = avrami(t);
                    (1.0 - degree) * (500.0 + slopes[0] * t) + degree * (250.0 + slopes[1] * (t - 200.0))
                };
                let (times, flows) = curve(steps, truth);
                // tangents reach a tenth of the width beyond: −19 to 0 s and 190 to 209 s
                errors(&Peak::integrate(&times, &flows, [0.0, 190.0], baseline).unwrap(), avrami, HEAT)
            };
            let found = [of(270, baseline), of(540, baseline), of(1080, baseline)];
            for order in orders(&found) {
                assert!((order[0] - 2.0).abs() < 0.1, "{found:?}: {order:?}");
            }
            assert!(found[2][0] < 1e-5 && found[2][1] < 1e-5, "{baseline:?}: {found:?}");
            let straight = of(1080, Baseline::Linear);
            assert!(straight[0] > 0.02 && straight[1] > 0.02, "{straight:?}");
        }
    }

    #[test]
    fn invalid_integrations_are_refused() {
        let (times, flows) = curve(270, |t| 700.0 + 3.0 * t);
        let of = |times: &[f64], flows: &[f64], limits, baseline| {
            Peak::integrate(times, flows, limits, baseline).unwrap_err().to_string()
        };
        use Baseline::{Linear, Sigmoidal, Tangential};
        let whole = [-30.0, 240.0];
        let down: Vec<f64> = flows.iter().map(|q| -q).collect();
        let flat = vec![0.3; times.len()];
        let mut swapped = times.clone();
        swapped.swap(7, 8);
        let mut gap = flows.clone();
        gap[9] = f64::NAN;
        for (message, part) in [
            (of(&times, &down, whole, Linear), "`exothermal` the wrong way round"),
            (of(&times, &down, whole, Sigmoidal), "enthalpy in J/kg: found -"),
            (of(&times, &flat, whole, Linear), "above 0"),
            (of(&swapped, &flows, whole, Linear), "measurement 9: time = -23 s; allowed: -22 or later"),
            (of(&times, &gap, whole, Linear), "measurement 10: heat flow"),
            (
                of(&times, &flows, [-31.0, 240.0], Linear),
                "limits -31 and 240 s; allowed: in order, -30 to 240 s",
            ),
            (of(&times, &flows, [60.0, 60.0], Linear), "in order"),
            (of(&times, &flows, [f64::NAN, 60.0], Linear), "in order"),
            (of(&times, &flows, whole, Tangential), "1 measurements"),
            (of(&times[1..], &flows, whole, Linear), "270 times and 271 heat flows"),
        ] {
            assert!(message.contains(part), "{message}");
        }
    }
}
