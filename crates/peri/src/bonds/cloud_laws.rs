//! Forces of several laws in a cloud: a pass of the kernel for each law, over the particles with bonds of it.

use super::cloud_kernel::CloudData;
use super::law_shares::add_force;
use super::rows::{CloudKernel, cloud_kernel};
use super::{BodyGeometry, CloudBonds, LawShares};
use crate::potential::{KernelFit, StretchRange};
use std::ops::Range;

/// A law of the kernel, and its share in bonds.
pub(super) struct CloudLaw<const D: usize> {
    kernel: Box<dyn CloudKernel<D>>,
    /// 2kθ.
    stiffness: f64,
    /// w V_J of each bond times the law's share in it.
    weights: Vec<f64>,
    /// Consecutive sites with bonds of this law.
    runs: Vec<Range<usize>>,
}

impl<const D: usize> CloudLaw<D> {
    /// Builds the pass of a law, by its number in the shares; `None` if it has no kernel.
    pub fn new(
        bonds: &CloudBonds<D>,
        fit: &KernelFit,
        modulus: f64,
        (shares, law): (&LawShares, usize),
    ) -> Option<Self> {
        let kernel = cloud_kernel(fit)?;
        let (lists, own) = (bonds.lists(), shares.stiffness_of(law));
        let mut weights = vec![0.0; lists.neighbours.len()];
        let mut runs: Vec<Range<usize>> = Vec::new();
        for site in 0..bonds.sites() {
            let row = lists.starts[site]..lists.starts[site + 1];
            let mut has_law = false;
            for (index, k) in row.enumerate() {
                let other = lists.neighbours[k] as usize;
                let share = own[site] + own[other];
                if other == site || share == 0.0 {
                    continue;
                }
                has_law = true;
                let whole = shares.stiffness_at(site) + shares.stiffness_at(other);
                weights[k] = share / whole * bonds.whole_bond(site, index as u32).weight;
            }
            match runs.last_mut() {
                _ if !has_law => {}
                Some(run) if run.end == site => run.end += 1,
                _ => runs.push(site..site + 1),
            }
        }
        Some(Self { kernel, stiffness: 2.0 * modulus, weights, runs })
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        8 * self.weights.len() + size_of_val(self.runs.as_slice())
    }
}

impl<const D: usize> CloudBonds<D> {
    /// Computes [`super::BondForces::force`] of several laws, from the lists and displacements of `data`.
    pub(super) fn force_of_laws(
        &self,
        data: &CloudData<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
        mut track: Option<&mut StretchRange>,
    ) {
        force.iter_mut().for_each(|force| force.fill(0.0));
        let end = start + force[0].len();
        for pass in &self.law.passes {
            let data = CloudData { weights: &pass.weights, stiffness: pass.stiffness, ..*data };
            let first = pass.runs.partition_point(|run| run.end <= start);
            for run in pass.runs[first..].iter().take_while(|run| run.start < end) {
                let sites = run.start.max(start)..run.end.min(end);
                add_force(force, start, sites, |from, part| {
                    pass.kernel.run(&data, from, part, track.as_deref_mut());
                });
            }
        }
    }
}
