//! A bond law as a material evaluates it: its fit in the kernels, and tables of its energies and tangents.

use super::{LawCover, LawRange};
use crate::error::Error;
use crate::potential::{BondPotential, EnergyTable, KernelFit, StretchRange, TangentTable};
use std::sync::Arc;

/// Samples of a law over a range of stretches.
const SAMPLES: u32 = 200;

/// A law with its fit and its tables.
pub(super) struct FittedLaw<'a> {
    law: Arc<dyn BondPotential + 'a>,
    /// The fit, after [`Self::cover`].
    pub fit: Option<KernelFit>,
    /// Energies of the fit, unless it is a table.
    fitted: Option<EnergyTable>,
    /// Energies of the law over the range of stretches last requested: sampling it takes longer than summing
    /// bonds.
    sampled: Option<(StretchRange, EnergyTable)>,
    /// Tangents likewise.
    tangents: Option<(StretchRange, TangentTable)>,
}

impl<'a> FittedLaw<'a> {
    pub fn new(law: Arc<dyn BondPotential + 'a>) -> Self {
        Self { law, fit: None, fitted: None, sampled: None, tangents: None }
    }

    /// Fits the law to a range of stretches; returns its greatest tangent there, max(|t′|, |t|/λ)/kθ.
    ///
    /// # Errors
    /// As [`KernelFit::new`].
    pub fn cover(&mut self, cover: &LawCover) -> Result<f64, Error> {
        let law = &*self.law;
        let fit = KernelFit::new(law, cover.stretches, cover.bound)?;
        let fit = if cover.clamped { fit.clamped() } else { fit };
        self.fitted = EnergyTable::of_fit(&fit, law.energy(1.0));
        self.fit = Some(fit);
        let tangent =
            |stretch: f64| law.tension_derivative(stretch).abs().max(law.tension(stretch).abs() / stretch);
        Ok(samples(cover.stretches).map(tangent).fold(0.0, f64::max))
    }

    /// q(e) of the fit; 0 before [`Self::cover`].
    #[inline]
    pub fn pull(&self, e: f64) -> f64 {
        self.fit.as_ref().map_or(0.0, |fit| fit.value(e))
    }

    /// Samples the energies of the stretches observed, unless the fit gives them.
    pub fn sample_energies(&mut self, observed: StretchRange) {
        if self.fitted.is_none() && self.sampled.as_ref().is_none_or(|(range, _)| *range != observed) {
            self.sampled = Some((observed, EnergyTable::new(&*self.law, observed)));
        }
    }

    /// Energies, after [`Self::sample_energies`].
    pub fn energies(&self) -> Option<&EnergyTable> {
        self.fitted.as_ref().or(self.sampled.as_ref().map(|(_, table)| table))
    }

    /// Samples the tangents of a range of stretches.
    pub fn sample_tangents(&mut self, range: StretchRange) {
        if self.tangents.as_ref().is_none_or(|(sampled, _)| *sampled != range) {
            self.tangents = Some((range, TangentTable::new(&*self.law, range)));
        }
    }

    /// Tangents, after [`Self::sample_tangents`].
    pub fn tangents(&self) -> Option<&TangentTable> {
        self.tangents.as_ref().map(|(_, table)| table)
    }

    /// Bounds of the law over a range of stretches, of a body of `dimension` axes.
    pub fn range(&self, stretches: [f64; 2], dimension: usize) -> LawRange {
        let (mut steepest, mut tension) = (0.0_f64, 0.0_f64);
        let mut range = LawRange { mean_tangent: 0.0, least_tangent: f64::INFINITY, least_energy: 0.0 };
        for stretch in samples(stretches) {
            let slope = self.law.tension_derivative(stretch).abs();
            steepest = steepest.max(slope);
            tension = tension.max(self.law.tension(stretch) / stretch);
            range.least_tangent = range.least_tangent.min(slope);
            range.least_energy = range.least_energy.min(self.law.energy(stretch));
        }
        range.mean_tangent = steepest + (dimension - 1) as f64 * tension;
        range
    }
}

fn samples([low, high]: [f64; 2]) -> impl Iterator<Item = f64> {
    (0..=SAMPLES).map(move |k| low + (high - low) * f64::from(k) / f64::from(SAMPLES))
}
