//! Evaluations for finite element codes do not allocate.

use mdsurrogate::network::Activation::{Relu, Softplus};
use mdsurrogate::surrogate::{Header, Kind, Prediction, Surrogate, Symmetry, Workspace};
use nalgebra::SVector;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// System allocator that counts the allocations of each thread.
struct Counting;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call is passed on to the system's allocator as it is; the counter needs no allocation.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations(work: impl FnOnce()) -> u64 {
    let before = COUNT.with(Cell::get);
    work();
    COUNT.with(Cell::get) - before
}

#[test]
fn no_allocation_after_the_first_call() {
    assert!(allocations(|| drop(std::hint::black_box(vec![1u8; 10]))) > 0, "the counter counts");
    let hidden = [(40, Relu), (24, Softplus)];
    for kind in [Kind::Ann, Kind::energy(Symmetry::Orthotropic), Kind::energy(Symmetry::Isotropic)] {
        let law = Surrogate::<f64>::random(Header::new(kind, &hidden, 3), 1).unwrap();
        let points: Vec<SVector<f64, 6>> =
            (0..20).map(|k| SVector::from([1.0 + 0.01 * f64::from(k), 1.1, 0.9, 0.05, 0.0, 0.1])).collect();
        let mut predictions = vec![Prediction::default(); points.len()];
        let mut memory = Workspace::default();
        let mut all = || {
            for c in &points {
                law.stress(c, &mut memory).unwrap();
                law.tangent(c, &mut memory).unwrap();
            }
            law.stresses(&points, &mut memory, &mut predictions).unwrap();
            law.tangents(&points, &mut memory, &mut predictions).unwrap();
        };
        assert!(allocations(&mut all) > 0);
        assert_eq!(allocations(&mut all), 0);
    }
}
