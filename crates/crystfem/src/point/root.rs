//! Root of a function with known derivative and unknown shape.

use crate::error::Error;

/// Finds the root of a function that rises overall, near `guess`, by Newton's method with a bracket.
pub(super) fn root(guess: f64, mut f: impl FnMut(f64) -> Result<[f64; 2], Error>) -> Result<f64, Error> {
    let [value, slope] = f(guess)?;
    if value == 0.0 {
        return Ok(guess);
    }
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    let (mut at, mut value, mut slope) = (guess, value, slope);
    let mut reach = 1.0;
    for _ in 0..200 {
        if value > 0.0 {
            high = at
        } else {
            low = at
        }
        let newton = at - value / slope;
        // a Newton step that stays inside, otherwise wider until a bracket is found, otherwise bisection
        let next = if slope > 0.0 && newton > low && newton < high && (newton - at).abs() < 100.0 {
            newton
        } else if low.is_finite() && high.is_finite() {
            0.5 * (low + high)
        } else {
            reach *= 2.0;
            if value > 0.0 { at - reach } else { at + reach }
        };
        if (next - at).abs() <= 4.0 * f64::EPSILON * at.abs() || next == low || next == high {
            return Ok(next);
        }
        at = next;
        [value, slope] = f(at)?;
        if value == 0.0 {
            return Ok(at);
        }
    }
    let iteration = "the temperature of a lumped body";
    Err(polycore::Error::NoConvergence { iteration, steps: 200, residual: value }.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cubic with a falling part is solved from every side; a function without a root is an error.
    #[test]
    fn zeros() {
        let cubic = |x: f64| Ok([x.powi(3) - 3.0 * x - 10.0, 3.0 * x * x - 3.0]);
        for guess in [-50.0, -1.0, 0.0, 1.0, 2.0, 40.0, 1e5] {
            let found = root(guess, cubic).unwrap();
            // Cardano's formula
            let exact = (5.0 + 24.0_f64.sqrt()).cbrt() + (5.0 - 24.0_f64.sqrt()).cbrt();
            assert!((found - exact).abs() < 1e-13, "{guess} {found}");
        }
        assert_eq!(root(3.0, |x| Ok([x - 3.0, 1.0])).unwrap(), 3.0);
        let error = root(0.0, |_| Ok([1.0, 0.0])).unwrap_err().to_string();
        assert!(error.contains("did not converge"), "{error}");
    }
}
