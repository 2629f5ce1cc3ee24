//! Closed-form solutions of heat conduction, for verification.
//!
//! Arguments outside their domain (negative times or conductivities, NaN) give NaN or the limit named,
//! without a panic.

mod benchmark;
mod cooling;
pub mod cube;
mod front;
mod half_space;
mod manufactured;
mod wall;

pub use benchmark::{CooledPlate, SwingingSlab, radiating_rod};
pub use cooling::{adiabatic_rise, lumped_film, lumped_radiation};
pub use front::{Freezing, stefan_root};
pub use half_space::{HalfSpace, HalfSpaceContact};
pub use manufactured::Manufactured;
pub use wall::{Wall, steady_wall};

/// Scaled complementary error function erfcx x = e^{x²} erfc x, within 5e-16 of its value for x > −26;
/// infinity below, where e^{x²} overflows.
///
/// Up to 25 both factors are evaluated, with the rounding of x² compensated; beyond, the asymptotic series
/// (Abramowitz & Stegun 7.1.23), whose eighth term is below 1e-17.
pub fn erfcx(x: f64) -> f64 {
    if x < 25.0 {
        let square = x * x;
        let rounding = x.mul_add(x, -square);
        let gaussian = square.exp();
        // infinity times its rounding error would be NaN
        let correction = if gaussian.is_finite() { gaussian * rounding } else { 0.0 };
        return (gaussian + correction) * libm::erfc(x);
    }
    let u = 0.5 / (x * x);
    let series = (1..8).rev().fold(1.0, |sum, k| 1.0 - f64::from(2 * k - 1) * u * sum);
    series / (x * std::f64::consts::PI.sqrt())
}

/// Finds the sign change of a function positive at `low` and negative at `high`, to the last bit.
fn root(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    // halving from 1e308 to 1e-308 takes 2100 steps
    polycore::numerics::bisected(low, high, 2200, |x| f(x) > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn erfcx_to_the_last_digits() {
        // 40-digit arithmetic (mpmath)
        for (x, exact) in [
            (-2.0, 108.940_904_389_977_97),
            (-0.5, 1.952_360_489_182_557),
            (0.0, 1.0),
            (0.5, 0.615_690_344_192_925_9),
            (2.0, 0.255_395_676_310_505_75),
            (10.0, 0.056_140_992_743_822_59),
            (24.999, 0.022_550_473_014_042_08),
            (25.0, 0.022_549_572_432_641_36),
            (26.0, 0.021_683_584_850_562_907),
            (100.0, 0.005_641_613_782_989_433),
            (1e8, 5.641_895_835_477_563e-9),
            (1e200, 5.641_895_835_477_563e-201),
        ] {
            // four roundings
            assert!((erfcx(x) / exact - 1.0).abs() < 5e-16, "{x}: {} {exact}", erfcx(x));
        }
        assert_eq!(erfcx(f64::INFINITY), 0.0);
        assert_eq!(erfcx(-30.0), f64::INFINITY);
        assert!(erfcx(f64::NAN).is_nan());
    }
}
