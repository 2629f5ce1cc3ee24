//! Factors of the particles of a lattice: the weights of their bonds.

use super::real::KernelReal;
use pulp::Simd;

/// Surface-correction factors of particles.
#[derive(Clone, Copy)]
pub enum Factors<'a, const D: usize, T = f64> {
    /// Equal along all axes: the weight of a bond is the mean of its ends.
    Even(&'a [T]),
    /// Along each axis.
    Along([&'a [T]; D]),
    /// Weights of one law among several: its share (c_I + c_J)/(C_I + C_J), c = `own` and C = `whole`, times
    /// those of factors along each axis, if there are any.
    Shared { along: Option<[&'a [T]; D]>, own: &'a [T], whole: &'a [T] },
}

impl<'a, const D: usize, T> Factors<'a, D, T> {
    /// Wraps the components of a field; `even` if all are equal.
    pub fn new(components: [&'a [T]; D], even: bool) -> Self {
        if even { Self::Even(components[0]) } else { Self::Along(components) }
    }

    /// Returns true if there is a factor for each site.
    pub fn cover(&self, sites: usize) -> bool {
        let cover = |along: &[&[T]; D]| along.iter().all(|component| component.len() == sites);
        match self {
            Self::Even(factors) => factors.len() == sites,
            Self::Along(along) => cover(along),
            Self::Shared { along, own, whole } => {
                along.as_ref().is_none_or(cover) && own.len() == sites && whole.len() == sites
            }
        }
    }
}

/// Computes the mean of a field at both ends of a vector of bonds.
///
/// # Safety
/// Both places are followed by a vector's width.
#[inline(always)]
pub unsafe fn mean<T: KernelReal, S: Simd>(simd: S, field: &[T], [here, there]: [usize; 2]) -> T::Vector<S> {
    // SAFETY: as above
    let pair = unsafe { T::add(simd, T::load::<S>(field, here), T::load::<S>(field, there)) };
    T::mul(simd, pair, T::splat(simd, T::from_f64(0.5)))
}
