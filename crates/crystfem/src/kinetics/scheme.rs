//! Time schemes for the kinetics, for comparisons of error and work.

use super::Kinetics;

/// A one-step scheme. The first two advance α by Eq. (4.5), as the thesis does, and may leave \[0, 1\]; the
/// others advance z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KineticScheme {
    /// Euler's method in α, Eq. (4.10).
    Euler,
    /// Classical Runge–Kutta method of four stages in α.
    RungeKutta4,
    /// Midpoint rule in z.
    Midpoint,
    /// Gauss' rule of two points in z.
    Gauss2,
}

impl KineticScheme {
    /// All schemes.
    pub const ALL: [Self; 4] = [Self::Euler, Self::RungeKutta4, Self::Midpoint, Self::Gauss2];

    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Euler => "euler",
            Self::RungeKutta4 => "rk4",
            Self::Midpoint => "z-midpoint",
            Self::Gauss2 => "z-gauss2",
        }
    }

    /// State variable of the scheme, α or z, from α.
    pub fn state(self, kinetics: &Kinetics, degree: f64) -> f64 {
        match self {
            Self::Euler | Self::RungeKutta4 => degree,
            Self::Midpoint | Self::Gauss2 => kinetics.z_of_degree(degree),
        }
    }

    /// α from the state variable.
    pub fn degree(self, kinetics: &Kinetics, state: f64) -> f64 {
        match self {
            Self::Euler | Self::RungeKutta4 => state,
            Self::Midpoint | Self::Gauss2 => kinetics.degree(state),
        }
    }

    /// Advances the state by a step `dt`, s, with the temperature linear from `start` to `end`, K.
    #[inline]
    pub fn advance(self, kinetics: &Kinetics, state: f64, start: f64, end: f64, dt: f64) -> f64 {
        let middle = 0.5 * (start + end);
        match self {
            Self::Euler => state + dt * kinetics.degree_rate(start, state),
            Self::RungeKutta4 => {
                let first = kinetics.degree_rate(start, state);
                let second = kinetics.degree_rate(middle, state + 0.5 * dt * first);
                let third = kinetics.degree_rate(middle, state + 0.5 * dt * second);
                let fourth = kinetics.degree_rate(end, state + dt * third);
                state + dt / 6.0 * (first + 2.0 * (second + third) + fourth)
            }
            Self::Midpoint => state + dt * kinetics.rate(middle),
            Self::Gauss2 => {
                let reach = 0.5 * (end - start) / 3.0_f64.sqrt();
                state + 0.5 * dt * (kinetics.rate(middle - reach) + kinetics.rate(middle + reach))
            }
        }
    }
}
