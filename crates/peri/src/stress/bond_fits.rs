//! Fitted laws of bonds, one or one for each part of a body.

use crate::bonds::LawShares;
use crate::error::Error;
use crate::potential::KernelFit;
use pulp::Simd;
use std::slice;

/// Fitted laws of all bonds of a body: q(e) of a bond is the mean of both ends' laws, see [`LawShares`].
#[derive(Clone, Copy, Debug)]
pub struct BondFits<'a> {
    fits: &'a [KernelFit],
    shares: Option<&'a LawShares>,
}

impl<'a> From<&'a KernelFit> for BondFits<'a> {
    fn from(fit: &'a KernelFit) -> Self {
        Self { fits: slice::from_ref(fit), shares: None }
    }
}

impl<'a> BondFits<'a> {
    /// Creates the fits of several laws of a body of `sites`, in the order of their numbers in `shares`;
    /// without shares all bonds have the first. Laws without a fit pull nothing.
    ///
    /// # Errors
    /// As [`LawShares::check`].
    pub fn new(fits: &'a [KernelFit], shares: Option<&'a LawShares>, sites: usize) -> Result<Self, Error> {
        shares.map_or(Ok(()), |shares| shares.check(sites))?;
        Ok(Self { fits, shares })
    }

    /// Returns the law of all bonds; `None` where there are several.
    #[cfg(feature = "gpu")]
    pub(crate) fn single(&self) -> Option<&'a KernelFit> {
        self.fits.first().filter(|_| self.shares.is_none())
    }

    /// q(e) of a bond.
    #[inline]
    pub fn value(&self, from: usize, to: usize, e: f64) -> f64 {
        let of = |number: usize| self.fits.get(number).map_or(0.0, |fit| fit.value(e));
        self.shares.map_or_else(|| of(0), |shares| shares.mean(from, to, of))
    }

    /// Evaluates q for vectors of bonds from the sites `start` on to those from `there` on; arbitrary where
    /// there is no particle.
    #[inline(always)]
    pub(super) fn vectors<S: Simd, const V: usize>(
        &self,
        simd: S,
        [start, there]: [usize; 2],
        e: [S::f64s; V],
    ) -> [S::f64s; V] {
        let zero = simd.splat_f64s(0.0);
        // closures would not be inlined into vector code
        let Some(shares) = self.shares else {
            if let [fit, ..] = self.fits {
                return fit.vectors(simd, e);
            }
            return [zero; V];
        };
        let (mut q, mut whole) = ([zero; V], [zero; V]);
        for number in 0..self.fits.len().min(shares.laws()) {
            let stiffness = shares.stiffness_of(number);
            let own = self.fits[number].vectors(simd, e);
            for v in 0..V {
                let (near, far) = (start + v * S::F64_LANES, there + v * S::F64_LANES);
                let near = S::as_simd_f64s(&stiffness[near..near + S::F64_LANES]).0[0];
                let far = S::as_simd_f64s(&stiffness[far..far + S::F64_LANES]).0[0];
                let share = simd.add_f64s(near, far);
                q[v] = simd.mul_add_f64s(share, own[v], q[v]);
                whole[v] = simd.add_f64s(whole[v], share);
            }
        }
        for v in 0..V {
            q[v] = simd.div_f64s(q[v], whole[v]);
        }
        q
    }
}
