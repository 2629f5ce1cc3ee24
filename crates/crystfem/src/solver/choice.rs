//! Which linear solver a run takes, and why.

/// How linear systems are solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum LinearSolver {
    /// By an estimate of the work, see [`Choice`].
    #[default]
    Auto,
    /// Conjugate gradients.
    ConjugateGradients,
    /// Factors, even where each step has a matrix of its own.
    Direct,
}

/// A choice with its reason.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Whether factors are used.
    pub direct: bool,
    /// Why.
    pub reason: String,
}

/// Equations beyond which factors are too large: about 1.5 GB.
const MOST_EQUATIONS: usize = 250_000;

/// What is known of a matrix before anything is solved.
#[derive(Clone, Copy, Debug)]
pub struct Task {
    /// Equations.
    pub size: usize,
    /// Equations along the longest side of the body.
    pub length: f64,
    /// Entries stored of K; few where rows are equal.
    pub entries: usize,
    /// The largest quotient of A's diagonal and the capacity.
    pub stiffness: f64,
    /// Solves that one matrix serves.
    pub solves: f64,
    /// Whether the scene is linear.
    pub linear: bool,
    /// Whether the matrix is symmetric.
    pub symmetric: bool,
    /// Whether steps are all equal.
    pub equal_steps: bool,
    /// The requirement.
    pub wanted: LinearSolver,
}

impl Task {
    /// Equations across the longest side.
    fn across(&self) -> f64 {
        (self.size as f64 / self.length).max(1.0)
    }

    /// Entries of the factors, about 11 n √s with s the equations across.
    pub fn factor_entries(&self) -> f64 {
        11.0 * self.size as f64 * self.across().sqrt()
    }

    /// Compares the work of both in iterations of conjugate gradients.
    ///
    /// With the diagonal as preconditioner the condition is at most 2·`stiffness` (Gershgorin: λmax ≤ 2; λmin ≥ C/A_ii),
    /// and about `length`² at most; √κ/2·ln(2/ε) iterations gain ε, here 1e-4 from a first guess by extrapolation.
    /// An iteration reads and writes 120 bytes for each equation and 12 for each stored entry. Factors have about
    /// 11 n √s entries, s the equations across; a solve with them and their making were measured against that (bricks
    /// of 20 000 and 97 000 equations, whose solves took 100 and 180 iterations, their making 800 and 3200).
    pub fn choose(&self) -> Choice {
        let by = |direct, reason: String| Choice { direct, reason };
        if !self.symmetric {
            return by(
                false,
                "biconjugate gradients: the conductivity jumps, the matrix is not symmetric".into(),
            );
        }
        match self.wanted {
            LinearSolver::ConjugateGradients => return by(false, "conjugate gradients: requested".into()),
            LinearSolver::Direct => return by(true, "factors: requested".into()),
            LinearSolver::Auto => {}
        }
        if !self.linear {
            return by(false, "conjugate gradients: the matrix changes with temperature".into());
        }
        if !self.equal_steps {
            return by(false, "conjugate gradients: the matrix changes with the adaptive step".into());
        }
        if self.size > MOST_EQUATIONS {
            return by(
                false,
                format!("conjugate gradients: factors of {} equations are too large", self.size),
            );
        }
        let size = self.size as f64;
        let condition = (2.0 * self.stiffness).min(self.length * self.length);
        let iterations = 0.5 * condition.sqrt() * (2.0_f64 / 1e-4).ln();
        let across = self.across();
        let stored = 120.0 / (120.0 + 12.0 * self.entries as f64 / size);
        let solve = 3.9 * stored * across.sqrt();
        let factor = 1.4 * stored * across / self.solves.max(1.0);
        let direct = iterations > solve + factor;
        let name = if direct { "factors" } else { "conjugate gradients" };
        by(
            direct,
            format!(
                "{name}: about {iterations:.0} iterations a solve, against {solve:.0} for a solve with factors and \
                 {factor:.0} for its share of a factorization over {:.0} solves",
                self.solves
            ),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_steps_with_one_matrix_take_factors() {
        let task = Task {
            size: 27_000,
            length: 30.0,
            entries: 1000,
            stiffness: 1.5,
            solves: 1000.0,
            linear: true,
            symmetric: true,
            equal_steps: true,
            wanted: LinearSolver::Auto,
        };
        assert!(!task.choose().direct);
        let long = Task { stiffness: 1e4, ..task };
        assert!(long.choose().direct && long.choose().reason.contains("1000 solves"));
        assert!(!Task { solves: 1.0, ..long }.choose().direct);
        assert!(!Task { linear: false, ..long }.choose().direct);
        assert!(!Task { equal_steps: false, ..long }.choose().direct);
        assert!(!Task { symmetric: false, wanted: LinearSolver::Direct, ..long }.choose().direct);
        assert!(!Task { size: 1_000_000, ..long }.choose().direct);
        assert!(Task { wanted: LinearSolver::Direct, ..task }.choose().direct);
        assert!(!Task { wanted: LinearSolver::ConjugateGradients, ..long }.choose().direct);
    }
}
