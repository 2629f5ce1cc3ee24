//! Forces in mixed precision: bonds in single precision, the sums of their forces in double precision.
//!
//! Kernels read displacements over the spacing, rounded to 24 bits: the stretch of a bond has an error of
//! about 6e-8 of the displacement over the bond's length. All other data are in double precision.

use super::LatticeBonds;
use crate::bonds::BondForces;
use crate::bonds::lattice_factors::Factors;
use crate::bonds::lattice_kernel::Tiles;
use crate::bonds::rows::{LatticeKernel, StencilBond, single_kernel};
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;
use crate::potential::{KernelFit, StretchRange};

/// Largest relative error of the law in single precision.
const LAW_ERROR: f64 = 1e-5;

/// Input of forces in mixed precision.
pub(super) struct Mixed<const D: usize> {
    /// Displacement over the spacing.
    displacement: [Vec<f32>; D],
    factors: Option<[Vec<f32>; D]>,
    /// `None` if the law needs double precision.
    kernel: Option<Box<dyn LatticeKernel<D, f32>>>,
}

impl<const D: usize> Mixed<D> {
    pub(super) fn set_law(&mut self, fit: &KernelFit, stencil: &[StencilBond<D>], spacing: f64) {
        let enough = fit.single_error() <= LAW_ERROR;
        self.kernel = enough.then(|| single_kernel(fit, stencil, spacing)).flatten();
    }

    pub(super) fn set_factors(&mut self, factors: &Field<D>) {
        let single = |component: &[f64]| component.iter().map(|&factor| factor as f32).collect();
        self.factors = Some(factors.components().map(single));
    }

    pub(super) fn set_displacement(&mut self, displacement: &Field<D>, spacing: f64) {
        let inverse = 1.0 / spacing;
        for (rounded, exact) in self.displacement.iter_mut().zip(displacement.components()) {
            parallel::for_chunks(rounded, CHUNK, |chunk, rounded| {
                let exact = &exact[chunk * CHUNK..];
                rounded.iter_mut().zip(exact).for_each(|(rounded, u)| *rounded = (u * inverse) as f32);
            });
        }
    }

    pub(super) fn bytes(&self) -> usize {
        let fields = 1 + usize::from(self.factors.is_some());
        fields * D * size_of_val(self.displacement[0].as_slice())
    }
}

impl<const D: usize> LatticeBonds<D> {
    /// Evaluates bonds in single precision and sums their forces in double precision, from the next
    /// [`BondForces::set_law`] on: forces of the displacement last given to
    /// [`crate::bonds::BondForces::prepare`]. A law whose single-precision error exceeds 1e-5
    /// ([`KernelFit::single_error`]) stays in double precision.
    pub fn set_mixed(&mut self) {
        let displacement = std::array::from_fn(|_| vec![0.0; self.sites]);
        let mut mixed = Mixed { displacement, factors: None, kernel: None };
        if let Some(factors) = &self.factors {
            mixed.set_factors(factors);
        }
        self.mixed = Some(mixed);
    }

    /// Root mean square of the difference of forces in mixed and double precision over that of the latter, in
    /// the displacement last given to [`crate::bonds::BondForces::prepare`]; `None` without mixed precision.
    pub fn mixed_error(&self, displacement: &Field<D>) -> Option<f64> {
        self.mixed.as_ref()?;
        let squares = |chunk: usize| {
            let (start, length) = (chunk * CHUNK, chunk_range(chunk, self.sites).len());
            let [mut mixed, mut double] = [(); 2].map(|()| [(); D].map(|()| vec![0.0; length]));
            self.force(displacement, start, &mut mixed.each_mut().map(Vec::as_mut_slice), None);
            self.double_force(displacement, start, &mut double.each_mut().map(Vec::as_mut_slice), None);
            let pairs = mixed.iter().flatten().zip(double.iter().flatten());
            pairs
                .fold([0.0; 2], |[d, f], (mixed, double)| [d + (mixed - double).powi(2), f + double * double])
        };
        let parts: Vec<[f64; 2]> = parallel::map(self.sites.div_ceil(CHUNK), squares);
        let [difference, force] = parts.into_iter().fold([0.0; 2], |[d, f], [e, g]| [d + e, f + g]);
        Some(if force > 0.0 { (difference / force).sqrt() } else { 0.0 })
    }

    /// Computes [`BondForces::force`] in mixed precision; returns false if it is not set.
    pub(super) fn mixed_force(
        &self,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) -> bool {
        let Some(Mixed { displacement, factors, kernel: Some(kernel) }) = &self.mixed else { return false };
        let tiles = Tiles {
            displacement: displacement.each_ref().map(Vec::as_slice),
            intact: &self.intact,
            classes: &self.classes,
            factors: factors
                .as_ref()
                .map(|factors| Factors::new(factors.each_ref().map(Vec::as_slice), self.even)),
            guard: self.guard,
        };
        kernel.run(&tiles, start, force, track);
        true
    }
}
