//! Increment Δz = ∫K(T(t)) dt for a temperature linear in time, with its derivative.

use super::{KineticConstants, Kinetics, LARGEST_Z};
use crate::simd_math::exp;

/// Number of panels that divide (T∞, T₀); an increment is integrated panel by panel. The error in α for one
/// panel of PA12 (5.4 K) is about 1e-5 at worst, for steps of 1 K 3e-8.
pub const PANELS: usize = 32;

/// Largest increment, in panels, that is integrated in one piece across a border: K is smooth, and the error
/// of the rule is below 1e-13.
const MAX_SINGLE_PIECE: f64 = 0.01;

/// Δz and ∂Δz/∂T at the end of the increment, at fixed Δt.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Growth {
    /// Δz.
    pub z: f64,
    /// ∂Δz/∂T_end, 1/K.
    pub slope: f64,
}

impl Kinetics {
    /// Computes Δz over an increment of temperature in the time `dt`, s: Gauss' rule of two points on each
    /// panel.
    ///
    /// The borders of the panels are fixed temperatures, so that Δz is a continuous function of the end.
    pub fn growth(&self, start: f64, end: f64, dt: f64) -> Growth {
        let mut sum = Growth::default();
        if dt == 0.0 {
            return sum;
        }
        for panel in Panels::new(self, start, end, PANELS) {
            let growth = self.growth_over(&panel, dt);
            sum.z = (sum.z + growth.z).min(LARGEST_Z);
            sum.slope += growth.slope;
        }
        sum
    }

    /// Computes Δz over one panel.
    pub fn growth_over(&self, panel: &TemperaturePanel, dt: f64) -> Growth {
        let half = 0.5 * panel.share * dt;
        if !panel.inside || half == 0.0 {
            return Growth::default();
        }
        let (middle, reach) = (0.5 * (panel.start + panel.end), 0.5 * (panel.end - panel.start) * NODE);
        let [below, slope_below] = self.rate_and_slope(middle - reach);
        let [above, slope_above] = self.rate_and_slope(middle + reach);
        let sum = below + above;
        let mut slope = 0.5 * dt * panel.share_slope * sum;
        if panel.last {
            slope += half * (slope_below * 0.5 * (1.0 - NODE) + slope_above * 0.5 * (1.0 + NODE));
        }
        Growth { z: half * sum, slope }
    }
}

impl Kinetics {
    /// Computes Δz of many increments, each within one of `count` panels; NaN for increments that cross a
    /// border or are not finite.
    ///
    /// Inlined into functions that `pulp` dispatches, so that the loop is vectorized.
    #[inline(always)]
    pub(crate) fn growth_of_all(
        &self,
        start: &[f64],
        end: &[f64],
        dt: f64,
        counts: [f64; 2],
        growth: &mut [f64],
    ) {
        let (low, high) = (self.constants.frozen, self.constants.equilibrium_melting);
        let size = growth.len();
        let (start, end) = (&start[..size], &end[..size]);
        for k in 0..size {
            let change = end[k] - start[k];
            // on heating, or otherwise
            let count = if change > 0.0 { counts[1] } else { counts[0] };
            let width = (high - low) / count;
            let whole = change.abs() <= MAX_SINGLE_PIECE * width;
            let single = whole || panel(start[k], low, width, count) == panel(end[k], low, width, count);
            let (middle, reach) = (0.5 * (start[k] + end[k]), 0.5 * change * NODE);
            let sum = self.rate_of_all(middle - reach) + self.rate_of_all(middle + reach);
            let inside = whole || (middle > low && middle < high);
            let own = if inside { 0.5 * dt * sum } else { 0.0 };
            growth[k] = if single && change.abs() < f64::INFINITY { own.min(LARGEST_Z) } else { f64::NAN };
        }
    }

    /// Computes Δz per second of increments that each lie within one panel.
    #[inline(always)]
    pub(crate) fn growth_of_pieces(&self, start: &[f64], end: &[f64], growth: &mut [f64]) {
        let size = growth.len();
        let (start, end) = (&start[..size], &end[..size]);
        for k in 0..size {
            let (middle, reach) = (0.5 * (start[k] + end[k]), 0.5 * (end[k] - start[k]) * NODE);
            growth[k] = 0.5 * (self.rate_of_all(middle - reach) + self.rate_of_all(middle + reach));
        }
    }

    /// [`Self::rate`] without branches.
    #[inline(always)]
    fn rate_of_all(&self, temperature: f64) -> f64 {
        let KineticConstants { nucleation, equilibrium_melting, frozen, .. } = self.constants;
        let (above, below) = (temperature - frozen, equilibrium_melting - temperature);
        let barrier = 2.0 * temperature * temperature * below;
        let exponent = nucleation * (temperature + equilibrium_melting) * above;
        let exponent = self.activation.mul_add(barrier, exponent) / (above * barrier);
        let rate = self.prefactor * exp(-exponent);
        if above > 0.0 && below > 0.0 { rate } else { 0.0 }
    }
}

/// Index of the panel of a temperature; the ranges below and above are one panel each.
#[inline(always)]
fn panel(temperature: f64, low: f64, width: f64, count: f64) -> f64 {
    ((temperature - low) / width).max(-1.0).min(count).floor()
}

/// Node 1/√3 of Gauss' rule of two points on \[−1, 1\].
const NODE: f64 = 0.577_350_269_189_625_8;

/// A part of an increment within one panel, or outside (T∞, T₀).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TemperaturePanel {
    /// Temperature at its start, K.
    pub start: f64,
    /// Temperature at its end, K.
    pub end: f64,
    /// True for the last panel of the increment, whose end moves with it.
    pub last: bool,
    /// True within (T∞, T₀).
    inside: bool,
    /// Fraction of the time increment.
    share: f64,
    /// ∂share/∂T_end, 1/K.
    share_slope: f64,
}

impl TemperaturePanel {
    /// Fraction of the time increment.
    pub(crate) fn share(&self) -> f64 {
        if self.inside { self.share } else { 0.0 }
    }
}

/// Iterator over the panels of an increment, in order.
#[derive(Clone, Debug)]
pub struct Panels {
    start: f64,
    end: f64,
    at: f64,
    /// T∞, width and number of the panels.
    low: f64,
    width: f64,
    count: f64,
    whole: bool,
    done: bool,
}

impl Panels {
    /// Returns the panels of an increment; `count` panels divide (T∞, T₀).
    pub fn new(kinetics: &Kinetics, start: f64, end: f64, count: usize) -> Self {
        let (low, high) = (kinetics.constants.frozen, kinetics.constants.equilibrium_melting);
        let width = (high - low) / count as f64;
        let whole = (end - start).abs() <= MAX_SINGLE_PIECE * width;
        Self { start, end, at: start, low, width, count: count as f64, whole, done: false }
    }

    /// Next border from `at` towards the end, or the end.
    fn border(&self) -> f64 {
        let place = (self.at - self.low) / self.width;
        if self.end > self.at {
            let next = if place < 0.0 { 0.0 } else { place.floor() + 1.0 };
            let border = self.low + next * self.width;
            if next > self.count { self.end } else { border.max(self.at).min(self.end) }
        } else {
            let next = if place > self.count { self.count } else { place.ceil() - 1.0 };
            let border = self.low + next * self.width;
            if next < 0.0 { self.end } else { border.min(self.at).max(self.end) }
        }
    }
}

impl Iterator for Panels {
    type Item = TemperaturePanel;

    fn next(&mut self) -> Option<TemperaturePanel> {
        if self.done {
            return None;
        }
        let start = self.at;
        let mut border = if self.whole { self.end } else { self.border() };
        if border == start && start != self.end {
            // rounding has put `at` just before a border: continue to the next
            self.at = if self.end > start { start.next_up() } else { start.next_down() };
            border = self.border();
        }
        self.at = border;
        self.done = border == self.end;
        let change = self.end - self.start;
        let (share, share_slope) = if start == self.start && self.done {
            (1.0, 0.0)
        } else {
            let width = border - start;
            let grows = if self.done { change } else { 0.0 };
            (width / change, (grows - width) / (change * change))
        };
        let middle = 0.5 * (start + border);
        let inside = self.whole || (middle > self.low && middle < self.low + self.width * self.count);
        Some(TemperaturePanel { start, end: border, last: self.done, inside, share, share_slope })
    }
}
