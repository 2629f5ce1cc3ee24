//! Nonlinear least squares.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};

/// Minimum, or the point where the search ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Optimum {
    /// Parameters.
    pub at: DVector<f64>,
    /// ½Σr².
    pub objective: f64,
}

/// Minimises ½Σr² from `start` by the Levenberg–Marquardt method of MINPACK (Moré 1978,
/// doi:10.1007/BFb0067700), with at most `patience`·(n + 1) evaluations of residuals in n parameters. A
/// `None` of residuals or of their Jacobian ends the search.
pub fn levenberg_marquardt(
    start: DVector<f64>,
    patience: usize,
    residuals: impl Fn(&DVector<f64>) -> Option<DVector<f64>>,
    jacobian: impl Fn(&DVector<f64>) -> Option<DMatrix<f64>>,
) -> Optimum {
    let problem = ResidualFunction { at: start, residuals, jacobian };
    let (problem, report) = LevenbergMarquardt::new().with_patience(patience).minimize(problem);
    Optimum { at: problem.at, objective: report.objective_function }
}

struct ResidualFunction<R, J> {
    at: DVector<f64>,
    residuals: R,
    jacobian: J,
}

impl<R, J> LeastSquaresProblem<f64, Dyn, Dyn> for ResidualFunction<R, J>
where
    R: Fn(&DVector<f64>) -> Option<DVector<f64>>,
    J: Fn(&DVector<f64>) -> Option<DMatrix<f64>>,
{
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, at: &DVector<f64>) {
        self.at.copy_from(at);
    }

    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        (self.residuals)(&self.at)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        (self.jacobian)(&self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley, whose minimum is at (1, 1) and 0.
    #[test]
    fn rosenbrock() {
        let residuals =
            |x: &DVector<f64>| Some(DVector::from_vec(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]));
        let jacobian =
            |x: &DVector<f64>| Some(DMatrix::from_row_slice(2, 2, &[-20.0 * x[0], 10.0, -1.0, 0.0]));
        let found = levenberg_marquardt(DVector::from_vec(vec![-1.2, 1.0]), 100, residuals, jacobian);
        assert!((found.at.add_scalar(-1.0)).amax() < 1e-12 && found.objective < 1e-24, "{found:?}");
    }
}
