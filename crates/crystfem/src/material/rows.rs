//! Growth and melting of crystals at many points of one law.
//!
//! Points at one node share one temperature history, for any z. Quantities that depend on the history alone
//! are computed once a node: growth Δz, and on heating the fall ln (1−X_m(T₂))/(1−X_m(T₁)), by which crystals
//! decrease. These, and the melting of each point, are vectorized loops. Increments that cross panel borders
//! are cut there into pieces, which are passed one after another.

use super::Crystallization;
use super::crystallization::{Grown, HEATING_PANELS, NEGLIGIBLE_MELTING, SMALLEST_MELTING_Z};
use super::semicrystalline::{LARGEST_CHANGE, MAX_STEP_RATIO};
use crate::kinetics::{PANELS, Panels};
use crate::simd_math::{MAX_SMALL_ARGUMENT, exp, expm1_small, ln, ln_1p};
use pulp::{Arch, Simd, WithSimd};

/// Smallest z for powers.
const MIN_Z: f64 = 1e-20;
/// Largest zⁿ for its exponential.
const MAX_POWER: f64 = 700.0;
/// Logarithm of [`MAX_POWER`].
const MAX_LOGARITHM: f64 = 6.5;

/// Increments of temperature at nodes, all over the same time.
#[derive(Clone, Copy)]
pub(crate) struct Increments<'a> {
    /// Temperatures at the start, K.
    pub start: &'a [f64],
    /// Temperatures at the end, K.
    pub end: &'a [f64],
    /// Δt, s.
    pub dt: f64,
}

/// Buffers for one work item.
#[derive(Default)]
pub(crate) struct Scratch {
    /// Δz of each node; NaN for nodes that heat in pieces.
    growth: Vec<f64>,
    /// ln (1−X_m(T₂))/(1−X_m(T₁)) of each node; 0 without melting.
    fall: Vec<f64>,
    /// First and last piece of each node with pieces; none if the increment is not finite.
    pieces: Vec<[u32; 2]>,
    /// Pieces: temperatures at their ends, fraction of the time, growth and fall.
    piece: Pieces,
    queue: MeltQueue,
    /// Points of nodes that heat in pieces, and their initial z.
    long: Vec<(u32, f64)>,
    seen: ChangeScan,
}

#[derive(Default)]
struct Pieces {
    start: Vec<f64>,
    end: Vec<f64>,
    share: Vec<f64>,
    growth: Vec<f64>,
    fall: Vec<f64>,
}

impl Crystallization {
    /// Advances z of points over an increment, like [`Self::advance`]; `node` is the node of each point.
    /// Returns the requested ratio of next to present step: [`LARGEST_CHANGE`] over the largest change of α,
    /// if there is any. z becomes NaN if an increment is not finite.
    pub(crate) fn advance_all(
        &self,
        increments: Increments,
        node: &[u32],
        z: &mut [f64],
        scratch: &mut Scratch,
    ) -> Option<f64> {
        self.histories(increments, scratch);
        let Scratch { growth, fall, pieces, piece, queue, long, seen } = scratch;
        seen.clear();
        long.clear();
        for (point, (own, &node)) in (0..).zip(z.iter_mut().zip(node)) {
            let (growth, fall) = (growth[node as usize], fall[node as usize]);
            if growth.is_nan() {
                let [first, last] = pieces[node as usize];
                *own = if first < last { *own } else { f64::NAN };
                long.push((point, *own));
                continue;
            }
            let before = *own;
            if let Some(after) = queue.advance_or_queue(self, point, before, growth, fall) {
                *own = after;
                seen.record(self, before, after);
            }
        }
        queue.melt_all(self, |point, after| {
            let before = std::mem::replace(&mut z[point as usize], after);
            seen.record(self, before, after);
        });
        let most = long.iter().map(|&(point, _)| pieces[node[point as usize] as usize]);
        let most = most.map(|[first, last]| last - first).max().unwrap_or(0);
        for round in 0..most {
            for &(point, _) in &*long {
                let [first, last] = pieces[node[point as usize] as usize];
                let own = &mut z[point as usize];
                let at = (first + round) as usize;
                if first + round < last {
                    *own = queue
                        .advance_or_queue(self, point, *own, piece.growth[at], piece.fall[at])
                        .unwrap_or(*own);
                }
            }
            queue.melt_all(self, |point, after| z[point as usize] = after);
        }
        for &(point, before) in &*long {
            seen.record(self, before, z[point as usize]);
        }
        seen.requested_ratio(self)
    }

    /// Computes growth and fall of all nodes and pieces.
    fn histories(&self, increments: Increments, scratch: &mut Scratch) {
        let Scratch { growth, fall, pieces, piece, .. } = scratch;
        let Increments { start, end, dt } = increments;
        let size = start.len();
        growth.resize(size, 0.0);
        fall.resize(size, 0.0);
        pieces.clear();
        pieces.resize(size, [0; 2]);
        let arch = Arch::new();
        arch.dispatch(Histories { law: self, start, end, dt: Some(dt), growth, fall });
        let Pieces { start: from, end: to, share, growth: parts, fall: falls } = piece;
        [&mut *from, &mut *to, &mut *share].into_iter().for_each(Vec::clear);
        let melts = |k: usize| end[k] > start[k] && self.melting.is_some();
        let crosses = |k: &usize| growth[*k].is_nan() && (end[*k] - start[*k]).is_finite();
        for k in (0..size).filter(crosses) {
            let count = if melts(k) { HEATING_PANELS } else { PANELS };
            let first = from.len() as u32;
            for panel in Panels::new(&self.kinetics, start[k], end[k], count) {
                from.push(panel.start);
                to.push(panel.end);
                share.push(panel.share());
            }
            pieces[k] = [first, from.len() as u32];
        }
        parts.resize(from.len(), 0.0);
        falls.resize(from.len(), 0.0);
        arch.dispatch(Histories { law: self, start: from, end: to, dt: None, growth: parts, fall: falls });
        parts.iter_mut().zip(share).for_each(|(growth, share)| *growth *= *share * dt);
        // without melting the growth of pieces adds up
        for k in 0..size {
            let [first, last] = pieces[k];
            if first < last && !melts(k) {
                growth[k] = parts[first as usize..last as usize].iter().sum();
                fall[k] = 0.0;
            }
        }
    }
}

/// Queue of points whose crystals melt: point, z, Δz and fall of each.
#[derive(Default)]
struct MeltQueue {
    points: Vec<u32>,
    z: Vec<f64>,
    growth: Vec<f64>,
    fall: Vec<f64>,
}

impl MeltQueue {
    /// Returns z after an increment within one panel, or `None` if queued until [`Self::melt_all`].
    #[inline]
    fn advance_or_queue(
        &mut self,
        law: &Crystallization,
        point: u32,
        z: f64,
        growth: f64,
        fall: f64,
    ) -> Option<f64> {
        if fall == 0.0 {
            return Some(z + growth);
        }
        let grown = z + 0.5 * growth;
        if grown < MIN_Z {
            return Some(law.melt(Grown { z: grown, slope: 0.0 }, fall, 0.0).z + 0.5 * growth);
        }
        self.points.push(point);
        self.z.push(z);
        self.growth.push(growth);
        self.fall.push(fall);
        None
    }

    /// Melts the queued points and hands out their z.
    fn melt_all(&mut self, law: &Crystallization, mut to: impl FnMut(u32, f64)) {
        let Self { points, z, growth, fall } = self;
        let exponent = law.kinetics.constants().avrami_exponent;
        Arch::new().dispatch(Melt { exponent, z, growth, fall });
        points.iter().zip(&*z).for_each(|(&point, &after)| to(point, after));
        points.clear();
        [z, growth, fall].into_iter().for_each(Vec::clear);
    }
}

/// Changes of α, for the step suggestion.
#[derive(Default)]
struct ChangeScan {
    /// True once a change is too small to limit the step.
    small: bool,
    /// z before and after large changes of α.
    before: Vec<f64>,
    after: Vec<f64>,
}

impl ChangeScan {
    fn clear(&mut self) {
        self.small = false;
        self.before.clear();
        self.after.clear();
    }

    /// Records a change; |∂α/∂z| ≤ n bounds most without evaluating α.
    #[inline]
    fn record(&mut self, law: &Crystallization, before: f64, after: f64) {
        if after == before {
            return;
        }
        let exponent = law.kinetics.constants().avrami_exponent;
        if exponent * (after - before).abs() > LARGEST_CHANGE / MAX_STEP_RATIO {
            self.before.push(before);
            self.after.push(after);
        } else if !self.small {
            self.small = after < 1.0 || law.kinetics.degree(before) != law.kinetics.degree(after);
        }
    }

    fn requested_ratio(&mut self, law: &Crystallization) -> Option<f64> {
        let Self { before, after, small } = self;
        let exponent = law.kinetics.constants().avrami_exponent;
        Arch::new().dispatch(AlphaChanges { exponent, before, after });
        let most = before.iter().copied().fold(0.0, f64::max);
        match most > 0.0 {
            true => Some((LARGEST_CHANGE / most).clamp(0.1, MAX_STEP_RATIO)),
            false => small.then_some(MAX_STEP_RATIO),
        }
    }
}

/// Computes growth and fall over increments: of nodes (NaN if panel borders are crossed), or of pieces, per
/// second.
struct Histories<'a> {
    law: &'a Crystallization,
    start: &'a [f64],
    end: &'a [f64],
    dt: Option<f64>,
    growth: &'a mut [f64],
    fall: &'a mut [f64],
}

impl WithSimd for Histories<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { law: Crystallization { kinetics, melting }, start, end, dt, growth, fall } = self;
        match dt {
            Some(dt) => {
                let heating = if melting.is_some() { HEATING_PANELS } else { PANELS };
                kinetics.growth_of_all(start, end, dt, [PANELS as f64, heating as f64], growth);
            }
            None => kinetics.growth_of_pieces(start, end, growth),
        }
        let Some(melting) = melting else {
            fall.fill(0.0);
            return;
        };
        let size = fall.len();
        let (start, end) = (&start[..size], &end[..size]);
        for k in 0..size {
            let change = melting.survival_of_all(end[k]) - melting.survival_of_all(start[k]);
            let none = end[k] <= start[k] || change > NEGLIGIBLE_MELTING;
            fall[k] = if none { 0.0 } else { change };
        }
    }
}

/// Half of the growth, α ← α e^L, the other half; z with half of its growth is at least [`MIN_Z`].
///
/// With p = zⁿ and u = (1 − e^L)(eᵖ − 1), p becomes p − ln(1 + u) if close, otherwise −ln(1 − α).
struct Melt<'a> {
    exponent: f64,
    z: &'a mut [f64],
    growth: &'a [f64],
    fall: &'a [f64],
}

impl WithSimd for Melt<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { exponent, z, growth, fall } = self;
        let size = z.len();
        let (growth, fall) = (&growth[..size], &fall[..size]);
        let root = 1.0 / exponent;
        for k in 0..size {
            let grown = z[k] + 0.5 * growth[k];
            let kept = exp(fall[k]);
            let lost = if fall[k] > -MAX_SMALL_ARGUMENT {
                -expm1_small(fall[k].max(-MAX_SMALL_ARGUMENT))
            } else {
                1.0 - kept
            };
            // exp(n ln z) has an error of 1e-14, and so have quantities small beside 1, but not z
            let power = exp(exponent * ln(grown)).min(MAX_POWER);
            let whole = exp(power);
            let above = if power < MAX_SMALL_ARGUMENT {
                expm1_small(power.min(MAX_SMALL_ARGUMENT))
            } else {
                whole - 1.0
            };
            let melted = lost * above;
            let part = ln_1p(melted.min(1.0)) / power;
            let near = melted <= 1.0 && part <= 0.5;
            let degree = above / whole * kept;
            let logarithm = ln_1p(-(if near { part } else { degree }).min(0.5));
            let remainder = kept / whole + lost;
            let far = ln(if degree < 0.5 { -logarithm } else { -ln(remainder) });
            let factor = exp(root * if near { logarithm } else { far });
            let after = if near { grown * factor } else { factor };
            z[k] = if degree < SMALLEST_MELTING_Z { 0.0 } else { after } + 0.5 * growth[k];
        }
    }
}

/// Replaces `before` by |α − α before|.
struct AlphaChanges<'a> {
    exponent: f64,
    before: &'a mut [f64],
    after: &'a [f64],
}

impl WithSimd for AlphaChanges<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { exponent, before, after } = self;
        let size = before.len();
        let after = &after[..size];
        for k in 0..size {
            before[k] = (remainder(exponent, before[k]) - remainder(exponent, after[k])).abs();
        }
    }
}

/// Returns 1 − α.
#[inline(always)]
fn remainder(exponent: f64, z: f64) -> f64 {
    let held = z.clamp(MIN_Z, MAX_POWER);
    exp(-exp((exponent * ln(held)).min(MAX_LOGARITHM)))
}

#[cfg(test)]
mod tests;
