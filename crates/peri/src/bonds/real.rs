//! The two precisions that lattice kernels compute in.

use pulp::Simd;

/// Scalar type of a lattice kernel, and vectors of it. Forces are summed in double precision in either case.
pub trait KernelReal: Copy + Send + Sync + 'static {
    /// A vector with instructions `S`.
    type Vector<S: Simd>: Copy;
    /// Number of bonds summed in this precision; the sum is then added in double precision.
    const RUN: usize;
    /// Number of lanes of a vector.
    fn lanes<S: Simd>() -> usize;
    /// Rounds to the nearest number.
    fn from_f64(value: f64) -> Self;
    /// Fills all lanes with a number.
    fn splat<S: Simd>(simd: S, value: Self) -> Self::Vector<S>;
    /// a + b.
    fn add<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    /// a − b.
    fn sub<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    /// ab.
    fn mul<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    /// a/b.
    fn div<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    /// √a.
    fn sqrt<S: Simd>(simd: S, a: Self::Vector<S>) -> Self::Vector<S>;
    /// ab + c.
    fn mul_add<S: Simd>(
        simd: S,
        a: Self::Vector<S>,
        b: Self::Vector<S>,
        c: Self::Vector<S>,
    ) -> Self::Vector<S>;
    /// The lesser of each lane.
    fn min<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    /// The greater of each lane.
    fn max<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    /// The least of all lanes.
    fn least<S: Simd>(simd: S, a: Self::Vector<S>) -> f64;
    /// The greatest of all lanes.
    fn greatest<S: Simd>(simd: S, a: Self::Vector<S>) -> f64;
    /// Keeps the lanes that have all bits of `bit` in their word; 0 elsewhere.
    ///
    /// # Safety
    /// `words` are as many as a vector has lanes.
    unsafe fn keep<S: Simd>(simd: S, a: Self::Vector<S>, words: *const u64, bit: u64) -> Self::Vector<S>;
    /// Loads a vector of consecutive sites.
    ///
    /// # Safety
    /// `at + lanes ≤ slice.len()`.
    unsafe fn load<S: Simd>(slice: &[Self], at: usize) -> Self::Vector<S>;
    /// Adds `unit` times a vector to consecutive sums.
    ///
    /// # Safety
    /// `out` takes as many values as a vector has lanes.
    unsafe fn add_to<S: Simd>(simd: S, out: *mut f64, unit: f64, a: Self::Vector<S>);
}

/// Code common to both precisions.
macro_rules! real {
    ($real:ty, $run:expr, $vector:ident, $lanes:ident, $splat:ident, $least:ident, $greatest:ident;
     { $($name:ident = $operation:ident($($of:ident),*);)* } $($rest:item)*) => {
        impl KernelReal for $real {
            type Vector<S: Simd> = S::$vector;
            const RUN: usize = $run;
            #[inline(always)]
            fn lanes<S: Simd>() -> usize {
                S::$lanes
            }
            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as $real
            }
            #[inline(always)]
            fn splat<S: Simd>(simd: S, value: Self) -> S::$vector {
                simd.$splat(value)
            }
            #[inline(always)]
            fn least<S: Simd>(simd: S, a: S::$vector) -> f64 {
                simd.$least(a).into()
            }
            #[inline(always)]
            fn greatest<S: Simd>(simd: S, a: S::$vector) -> f64 {
                simd.$greatest(a).into()
            }
            #[inline(always)]
            unsafe fn load<S: Simd>(slice: &[Self], at: usize) -> S::$vector {
                debug_assert!(at + S::$lanes <= slice.len());
                // SAFETY: as the trait asks
                unsafe { slice.as_ptr().add(at).cast::<S::$vector>().read_unaligned() }
            }
            $(#[inline(always)]
            fn $name<S: Simd>(simd: S, $($of: S::$vector),*) -> S::$vector {
                simd.$operation($($of),*)
            })*
            $($rest)*
        }
    };
}

real! {
    f64, usize::MAX, f64s, F64_LANES, splat_f64s, reduce_min_f64s, reduce_max_f64s;
    {
        add = add_f64s(a, b); sub = sub_f64s(a, b); mul = mul_f64s(a, b); div = div_f64s(a, b);
        min = min_f64s(a, b); max = max_f64s(a, b); sqrt = sqrt_f64s(a); mul_add = mul_add_f64s(a, b, c);
    }
    #[inline(always)]
    unsafe fn keep<S: Simd>(simd: S, a: S::f64s, words: *const u64, bit: u64) -> S::f64s {
        let bit = simd.splat_u64s(bit);
        // SAFETY: as the trait asks
        let words = unsafe { words.cast::<S::u64s>().read_unaligned() };
        let has = simd.equal_u64s(simd.and_u64s(words, bit), bit);
        simd.select_f64s(has, a, simd.splat_f64s(0.0))
    }
    #[inline(always)]
    unsafe fn add_to<S: Simd>(simd: S, out: *mut f64, unit: f64, a: S::f64s) {
        let out = out.cast::<S::f64s>();
        // SAFETY: as the trait asks
        unsafe { out.write_unaligned(simd.mul_add_f64s(a, simd.splat_f64s(unit), out.read_unaligned())) };
    }
}

real! {
    f32, 8, f32s, F32_LANES, splat_f32s, reduce_min_f32s, reduce_max_f32s;
    {
        add = add_f32s(a, b); sub = sub_f32s(a, b); mul = mul_f32s(a, b); div = div_f32s(a, b);
        min = min_f32s(a, b); max = max_f32s(a, b); sqrt = sqrt_f32s(a); mul_add = mul_add_f32s(a, b, c);
    }
    #[inline(always)]
    unsafe fn keep<S: Simd>(_simd: S, mut a: S::f32s, words: *const u64, bit: u64) -> S::f32s {
        // compilers vectorise this loop: half a vector of words at a time
        let lanes = pulp::bytemuck::cast_slice_mut::<S::f32s, f32>(std::slice::from_mut(&mut a));
        for (lane, value) in lanes.iter_mut().enumerate() {
            // SAFETY: as the trait asks
            let has = unsafe { *words.add(lane) } & bit == bit;
            *value = if has { *value } else { 0.0 };
        }
        a
    }
    #[inline(always)]
    unsafe fn add_to<S: Simd>(_simd: S, out: *mut f64, unit: f64, a: S::f32s) {
        let lanes = pulp::bytemuck::cast_slice::<S::f32s, f32>(std::slice::from_ref(&a));
        for (lane, &value) in lanes.iter().enumerate() {
            // SAFETY: as the trait asks
            unsafe { *out.add(lane) += unit * f64::from(value) };
        }
    }
}
