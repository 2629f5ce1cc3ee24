//! Numerical methods that more than one crate needs. Results have the same bits on any number of threads.

pub mod bisection;
pub mod bounds;
#[cfg(feature = "solvers")]
pub mod cholesky;
#[cfg(feature = "solvers")]
pub mod conjugate_gradients;
pub mod groups;
pub mod hexahedron;
pub mod least_squares;
pub mod nonnegative;
pub mod sets;

pub use bisection::{bisect, bisected};
pub use bounds::{bounds, range, segments_meet};
#[cfg(feature = "solvers")]
pub use conjugate_gradients::conjugate_gradients;
pub use groups::Groups;
pub use sets::DisjointSets;

/// Sums the values of work items in their order, whichever thread computes them.
#[cfg(feature = "solvers")]
pub fn ordered_sum(items: impl rayon::iter::IndexedParallelIterator<Item = f64>) -> f64 {
    items.collect::<Vec<_>>().iter().sum()
}

#[cfg(all(test, feature = "solvers"))]
mod tests {
    use rayon::prelude::*;

    /// Geometric series: 1 + q + … + q^(n−1) = (1 − qⁿ)/(1 − q), added from the front.
    #[test]
    fn a_sum_is_taken_in_order() {
        let term = |k: i32| 0.9_f64.powi(k);
        let found = super::ordered_sum((0..1000).into_par_iter().map(term));
        assert_eq!(found, (0..1000).map(term).sum::<f64>());
        // 1000 roundings of at most 10 ε/2
        assert!((found - (1.0 - 0.9_f64.powi(1000)) / 0.1).abs() < 1000.0 * 5.0 * f64::EPSILON);
    }
}
