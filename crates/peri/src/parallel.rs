//! Parallel loops over particles and work items. Each calls its body through a reference, so that rayon is
//! compiled once for each type of result instead of once for each loop: 500 instances were a fifth of the
//! code of this crate.

use rayon::prelude::*;

/// Values of a function at 0 .. `count`, in order.
pub(crate) fn map<R: Send>(count: usize, of: impl Fn(usize) -> R + Sync) -> Vec<R> {
    fn run<R: Send>(count: usize, of: &(dyn Fn(usize) -> R + Sync)) -> Vec<R> {
        (0..count).into_par_iter().map(of).collect()
    }
    run(count, &of)
}

/// Sum of a function over 0 .. `count`, added in order whichever thread computes a term.
pub(crate) fn sum(count: usize, of: impl Fn(usize) -> f64 + Sync) -> f64 {
    map(count, of).iter().sum()
}

/// Values of a function of each item, in order.
pub(crate) fn map_each<T: Sync, R: Send>(items: &[T], of: impl Fn(&T) -> R + Sync) -> Vec<R> {
    map(items.len(), |index| of(&items[index]))
}

/// Values of a function of each run of `length` items, in order.
pub(crate) fn map_chunks<T: Sync, R: Send>(
    items: &[T],
    length: usize,
    of: impl Fn(&[T]) -> R + Sync,
) -> Vec<R> {
    map(items.len().div_ceil(length), |run| of(&items[run * length..items.len().min((run + 1) * length)]))
}

/// Calls a function with the index and the items of each run of `length` items.
pub(crate) fn for_chunks<T: Send>(items: &mut [T], length: usize, visit: impl Fn(usize, &mut [T]) + Sync) {
    fn run<T: Send>(items: &mut [T], length: usize, visit: &(dyn Fn(usize, &mut [T]) + Sync)) {
        items.par_chunks_mut(length).enumerate().for_each(|(index, items)| visit(index, items));
    }
    run(items, length, &visit);
}

/// Values of a function that takes each item with its index, in order.
pub(crate) fn map_items<T: Send, R: Send>(items: Vec<T>, of: impl Fn(usize, T) -> R + Sync) -> Vec<R> {
    fn run<T: Send, R: Send>(items: Vec<T>, of: &(dyn Fn(usize, T) -> R + Sync)) -> Vec<R> {
        items.into_par_iter().enumerate().map(|(index, item)| of(index, item)).collect()
    }
    run(items, &of)
}

/// Calls a function with each item and its index.
pub(crate) fn for_items<T: Send>(items: Vec<T>, visit: impl Fn(usize, T) + Sync) {
    fn run<T: Send>(items: Vec<T>, visit: &(dyn Fn(usize, T) + Sync)) {
        items.into_par_iter().enumerate().for_each(|(index, item)| visit(index, item));
    }
    run(items, &visit);
}
