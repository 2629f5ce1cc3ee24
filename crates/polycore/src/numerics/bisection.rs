//! Bisection.

/// Bisects [low, high] by the condition `is_below` in the middle, `steps` times or until no number lies
/// between; the condition holds below some place and not above. `low` may be greater than `high`.
pub fn bisect(mut low: f64, mut high: f64, steps: usize, mut is_below: impl FnMut(f64) -> bool) -> [f64; 2] {
    for _ in 0..steps {
        let middle = 0.5 * (low + high);
        if middle == low || middle == high || middle.is_nan() {
            break;
        }
        if is_below(middle) { low = middle } else { high = middle }
    }
    [low, high]
}

/// Middle of the interval of [`bisect`].
pub fn bisected(low: f64, high: f64, steps: usize, is_below: impl FnMut(f64) -> bool) -> f64 {
    let [low, high] = bisect(low, high, steps, is_below);
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// √2 from either side: neighbouring numbers, and 2⁻ⁿ of the interval after n steps.
    #[test]
    fn roots_of_two() {
        let mut calls = 0;
        let [low, high] = bisect(1.0, 2.0, 2000, |x| {
            calls += 1;
            x * x < 2.0
        });
        assert!(low * low < 2.0 && high * high >= 2.0 && high == low.next_up() && calls <= 53);
        assert!((bisected(2.0, 1.0, 2000, |x| x * x > 2.0) - 2.0_f64.sqrt()).abs() <= f64::EPSILON);
        let [low, high] = bisect(1.0, 2.0, 10, |x| x * x < 2.0);
        assert!(high - low == 1.0 / 1024.0 && (low..high).contains(&2.0_f64.sqrt()));
    }
}
