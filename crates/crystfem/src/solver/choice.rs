//! Choice of the linear solver, with its reason.

/// Linear solver of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum LinearSolver {
    /// Automatic, by an estimate of the work, see [`SolverChoice`].
    #[default]
    Auto,
    /// Conjugate gradients with the diagonal as preconditioner.
    ConjugateGradients,
    /// Conjugate gradients with a multigrid cycle as preconditioner.
    Multigrid,
    /// Cholesky factors, even if each step has its own matrix.
    Direct,
}

/// Method for linear systems.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum LinearMethod {
    /// Conjugate or biconjugate gradients with the diagonal.
    #[default]
    Diagonal,
    /// Conjugate gradients with a multigrid cycle.
    Multigrid,
    /// Cholesky factors.
    Factors,
}

/// A method with the reason for it.
#[derive(Clone, Debug, PartialEq)]
pub struct SolverChoice {
    /// Initial method.
    pub method: LinearMethod,
    /// Reason for it.
    pub reason: String,
}

/// Largest number of equations for factors: about 1.5 GB.
const MAX_EQUATIONS: usize = 250_000;
/// Cost of a multigrid solve in diagonal iterations: measured on blocks of 16³ to 48³ elements, a solve takes
/// 10 to 21 cycles, and a cycle costs 3 to 5 iterations (up to 7 on bricks of equal elements).
const CYCLES: f64 = 64.0;
/// Cost of building multigrid levels, or of an analysis for factors, in diagonal iterations; measured there:
/// 46 to 67 (up to 295 on bricks of equal elements).
pub const LEVELS: f64 = 300.0;

/// Properties of a linear system known before it is solved.
#[derive(Clone, Copy, Debug)]
pub struct LinearTask {
    /// Number of equations.
    pub size: usize,
    /// Number of equations along the longest side of the body.
    pub length: f64,
    /// Number of stored entries of K; few if rows are equal.
    pub entries: usize,
    /// Largest ratio of A's diagonal to the capacity.
    pub stiffness: f64,
    /// Number of solves with one matrix.
    pub solves: f64,
    /// True for a linear problem.
    pub linear: bool,
    /// True for a symmetric matrix.
    pub symmetric: bool,
    /// True if conduction never changes, so that multigrid levels can serve it.
    pub constant: bool,
    /// True if all steps are equal.
    pub equal_steps: bool,
    /// Solver requested by the scene.
    pub wanted: LinearSolver,
}

impl LinearTask {
    /// Number of equations in a section across the longest side.
    fn across(&self) -> f64 {
        (self.size as f64 / self.length).max(1.0)
    }

    /// Estimates the entries of the factors, about 11 n √s with s equations across.
    pub fn factor_entries(&self) -> f64 {
        11.0 * self.size as f64 * self.across().sqrt()
    }

    /// Compares the work of the methods in iterations of conjugate gradients.
    ///
    /// With the diagonal as preconditioner the condition number is at most 2·`stiffness` (Gershgorin: λmax ≤
    /// 2; λmin ≥ C/A_ii), and about `length`² at most; √κ/2·ln(2/ε) iterations gain ε, here 1e-4 from an
    /// extrapolated first guess. An iteration reads and writes 120 bytes per equation and 12 per stored
    /// entry. Factors have about 11 n √s entries with s equations across; the cost of a factorization and of
    /// a solve was measured relative to that (bricks of 20 000 and 97 000 equations: 100 and 180 iterations
    /// per solve, 800 and 3200 per factorization).
    pub fn choose(&self) -> SolverChoice {
        let by = |direct, reason: String| {
            let method = if direct { LinearMethod::Factors } else { LinearMethod::Diagonal };
            SolverChoice { method, reason }
        };
        if !self.symmetric {
            return by(
                false,
                "biconjugate gradients: the conductivity jumps, the matrix is not symmetric".into(),
            );
        }
        match self.wanted {
            LinearSolver::ConjugateGradients => return by(false, "conjugate gradients: requested".into()),
            LinearSolver::Direct => return by(true, "factors: requested".into()),
            LinearSolver::Multigrid if self.constant => {
                return SolverChoice {
                    method: LinearMethod::Multigrid,
                    reason: "multigrid: requested".into(),
                };
            }
            LinearSolver::Multigrid => {
                return by(
                    false,
                    "conjugate gradients: the conductivity changes, multigrid cannot serve it".into(),
                );
            }
            LinearSolver::Auto => {}
        }
        let until = "until another method is cheaper by the iterations counted";
        if !self.linear {
            return by(false, format!("conjugate gradients: the matrix changes with temperature; {until}"));
        }
        if !self.equal_steps {
            return by(
                false,
                format!("conjugate gradients: the matrix changes with the adaptive step; {until}"),
            );
        }
        if self.size > MAX_EQUATIONS {
            return by(
                false,
                format!("conjugate gradients: factors of {} equations are too large", self.size),
            );
        }
        let condition = (2.0 * self.stiffness).min(self.length * self.length);
        let iterations = 0.5 * condition.sqrt() * (2.0_f64 / 1e-4).ln();
        let [solve, factor] = self.direct(self.solves);
        let direct = iterations > solve + factor;
        let name = if direct { "factors" } else { "conjugate gradients" };
        by(
            direct,
            format!(
                "{name}: about {iterations:.0} iterations a solve, against {solve:.0} for a solve with \
                 factors and {factor:.0} for its share of a factorization over {:.0} solves",
                self.solves
            ),
        )
    }

    /// Costs of a solve with factors, and of its share of a factorization that serves `solves` solves.
    fn direct(&self, solves: f64) -> [f64; 2] {
        let stored = 120.0 / (120.0 + 12.0 * self.entries as f64 / self.size as f64);
        let across = self.across();
        [3.9 * stored * across.sqrt(), 1.4 * stored * across / solves.max(1.0)]
    }

    /// Picks the method to switch to from the diagonal, from iterations per solve and solves per matrix.
    pub fn method_after(&self, iterations: f64, solves: f64) -> LinearMethod {
        let [solve, factor] = self.direct(solves);
        let factors = if self.size > MAX_EQUATIONS { f64::INFINITY } else { solve + factor };
        let cycles = if self.constant { CYCLES } else { f64::INFINITY };
        if !self.symmetric || iterations <= factors.min(cycles) {
            LinearMethod::Diagonal
        } else if factors <= cycles {
            LinearMethod::Factors
        } else {
            LinearMethod::Multigrid
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_after_slow_solves() {
        let task = LinearTask {
            size: 100_000,
            length: 46.0,
            entries: 1000,
            stiffness: 1.0,
            solves: 1.0,
            linear: false,
            symmetric: true,
            constant: true,
            equal_steps: false,
            wanted: LinearSolver::Auto,
        };
        assert_eq!(task.method_after(50.0, 1.0), LinearMethod::Diagonal);
        assert_eq!(task.method_after(200.0, 1.0), LinearMethod::Multigrid);
        // a rod of 3 × 3 nodes
        assert_eq!(LinearTask { length: 11_111.0, ..task }.method_after(200.0, 1.0), LinearMethod::Factors);
        assert_eq!(LinearTask { constant: false, ..task }.method_after(200.0, 1.0), LinearMethod::Diagonal);
        assert_eq!(LinearTask { symmetric: false, ..task }.method_after(1e4, 1.0), LinearMethod::Diagonal);
    }

    #[test]
    fn long_steps_with_one_matrix_take_factors() {
        let task = LinearTask {
            size: 27_000,
            length: 30.0,
            entries: 1000,
            stiffness: 1.5,
            solves: 1000.0,
            linear: true,
            symmetric: true,
            constant: true,
            equal_steps: true,
            wanted: LinearSolver::Auto,
        };
        assert!(task.choose().method == LinearMethod::Diagonal);
        let long = LinearTask { stiffness: 1e4, ..task };
        assert!(
            long.choose().method == LinearMethod::Factors && long.choose().reason.contains("1000 solves")
        );
        assert!(LinearTask { solves: 1.0, ..long }.choose().method == LinearMethod::Diagonal);
        assert!(LinearTask { linear: false, ..long }.choose().method == LinearMethod::Diagonal);
        assert!(LinearTask { equal_steps: false, ..long }.choose().method == LinearMethod::Diagonal);
        assert!(
            LinearTask { symmetric: false, wanted: LinearSolver::Direct, ..long }.choose().method
                == LinearMethod::Diagonal
        );
        assert!(LinearTask { size: 1_000_000, ..long }.choose().method == LinearMethod::Diagonal);
        assert!(LinearTask { wanted: LinearSolver::Direct, ..task }.choose().method == LinearMethod::Factors);
        assert!(
            LinearTask { wanted: LinearSolver::ConjugateGradients, ..long }.choose().method
                == LinearMethod::Diagonal
        );
    }
}
