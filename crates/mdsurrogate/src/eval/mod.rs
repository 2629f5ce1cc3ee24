//! Quality of a law: errors on data, and properties of elastic solids.

mod ellipticity;
mod physics;
mod uncertainty;
pub mod uniaxial;

pub use ellipticity::Ellipticity;
pub use physics::PhysicsChecks;
pub use uncertainty::{FLAGS, FlagStatistics};

use crate::Error;
use crate::dataset::{DataRow, Dataset, Path};
use crate::surrogate::{Prediction, SofteningHistory, Surrogate, Workspace};
use polycore::constitutive::viscoelastic::{Branch, BranchState, Increment};
use polycore::numerics::range;
use polycore::tensor::Voigt;
use std::time::Instant;

/// Number of evaluations per time measurement.
const TIMED: usize = 2000;
/// Number of measurements; the shortest counts, as other load only adds time.
const ROUNDS: usize = 5;

/// Errors of a law on some rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Number of rows.
    pub rows: usize,
    /// Mean squared error of each component, Pa².
    pub squares: Voigt,
    /// Mean of (3.13), %, over the rows with nonzero stress.
    pub percentage: f64,
    /// Number of rows whose C lies outside the box of the training data.
    pub flagged: usize,
}

impl Errors {
    /// Returns (3.12): mean of ‖S − Ŝ‖² over the rows, Pa²; Keras reports a sixth of it.
    pub fn mean_square(&self) -> f64 {
        self.squares.sum()
    }
}

/// Computes the errors of a law on some rows; zeros for no rows.
///
/// # Errors
/// Returns the errors of [`Surrogate::stress`].
pub fn errors<'a>(law: &Surrogate, rows: impl Iterator<Item = &'a DataRow>) -> Result<Errors, Error> {
    let mut memory = Workspace::default();
    sum_errors(rows.map(|row| Ok((row, law.stress(&row.c, &mut memory)?))))
}

/// Computes the sum of the stresses S of branches along a run from rest, Pa; C is linear between rows.
///
/// # Errors
/// Errors of [`Branch::advance`]: times that go backwards.
pub fn overstress(branches: &[Branch], path: &Path) -> Result<Vec<Voigt>, Error> {
    let mut states = vec![BranchState::REST; branches.len()];
    let mut from = BranchState::REST.viscous;
    let mut time = 0.0;
    let mut row = |row: &DataRow| {
        let increment = Increment::new(from, row.c, row.time - time);
        (from, time) = (row.c, row.time);
        branches.iter().zip(&mut states).try_fold(Voigt::zeros(), |sum, (branch, state)| {
            let (stress, end) = branch.advance(state, &increment)?;
            *state = end;
            Ok(sum + stress)
        })
    };
    path.rows.iter().map(&mut row).collect()
}

/// Predicts the stress of a law and branches along a whole run; the damage variable follows its history.
///
/// # Errors
/// Returns the errors of [`Surrogate::stress`] and of [`overstress`].
pub fn answers_along<'a>(
    law: &Surrogate,
    branches: &[Branch],
    run: &'a Path,
) -> Result<Vec<(&'a DataRow, Prediction)>, Error> {
    let (mut memory, mut history) = (Workspace::default(), SofteningHistory::default());
    let answer = |(row, own): (&'a DataRow, Voigt)| {
        let mut answer = law.follow(&row.c, false, &mut history, &mut memory)?;
        answer.stress += own;
        Ok((row, answer))
    };
    run.rows.iter().zip(overstress(branches, run)?).map(answer).collect()
}

/// Computes the errors of a law and branches along a whole run.
///
/// # Errors
/// Returns the errors of [`answers_along`].
pub fn errors_along(law: &Surrogate, branches: &[Branch], run: &Path) -> Result<Errors, Error> {
    sum_errors(answers_along(law, branches, run)?.into_iter().map(Ok))
}

fn sum_errors<'a>(
    answers: impl Iterator<Item = Result<(&'a DataRow, Prediction), Error>>,
) -> Result<Errors, Error> {
    let (mut squares, mut percentage, mut flagged) = (Voigt::zeros(), 0.0, 0);
    let (mut count, mut stressed) = (0, 0);
    for answer in answers {
        let (row, answer) = answer?;
        let [measured, predicted] = row.compared(&answer.stress);
        let error = predicted - measured;
        squares += error.component_mul(&error);
        if let Some(share) = percentage_error(&measured, &predicted) {
            percentage += share;
            stressed += 1;
        }
        flagged += usize::from(answer.flags.outside.contains(&true));
        count += 1;
    }
    let over = |sum: f64, count: usize| if count > 0 { sum / count as f64 } else { 0.0 };
    Ok(Errors {
        rows: count,
        squares: squares.map(|square| over(square, count)),
        percentage: over(percentage, stressed),
        flagged,
    })
}

/// NominalAgreement of a law with measured nominal stresses, in the measures of published fits to rubber.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NominalAgreement {
    /// Number of measured stresses.
    pub count: usize,
    /// Mean of |P − P̂|, Pa.
    pub absolute: f64,
    /// Sum of (P − P̂)², Pa².
    pub squares: f64,
    /// R² = 1 − Σ(P − P̂)²/Σ(P − P̄)² with the mean P̄; `None` if all stresses are equal.
    pub r2: Option<f64>,
}

/// Computes the agreement of a law with the nominal stresses in some rows; `None` without nominal stresses.
///
/// # Errors
/// Returns the errors of [`Surrogate::stress`].
pub fn agreement<'a>(
    law: &Surrogate,
    rows: impl Iterator<Item = &'a DataRow>,
) -> Result<Option<NominalAgreement>, Error> {
    let mut memory = Workspace::default();
    let mut pairs = Vec::new();
    for row in rows {
        let Some(nominal) = row.nominal else { continue };
        let [measured, predicted] = row.compared(&law.stress(&row.c, &mut memory)?.stress);
        pairs.extend((0..2).filter(|&i| nominal[i] != 0.0).map(|i| [measured[i], predicted[i]]));
    }
    if pairs.is_empty() {
        return Ok(None);
    }
    let count = pairs.len() as f64;
    let mean = pairs.iter().map(|[measured, _]| measured).sum::<f64>() / count;
    let squares = pairs.iter().map(|[measured, predicted]| (predicted - measured).powi(2)).sum::<f64>();
    let variation: f64 = pairs.iter().map(|[measured, _]| (measured - mean).powi(2)).sum();
    Ok(Some(NominalAgreement {
        count: pairs.len(),
        absolute: pairs.iter().map(|[measured, predicted]| (predicted - measured).abs()).sum::<f64>() / count,
        squares,
        r2: (variation > 0.0).then(|| 1.0 - squares / variation),
    }))
}

/// Computes 100 ‖S − Ŝ‖/‖S‖ (3.13), with the norm of the six components; `None` for S = 0.
pub fn percentage_error(stress: &Voigt, predicted: &Voigt) -> Option<f64> {
    let norm = stress.norm();
    (norm > 0.0).then(|| 100.0 * (stress - predicted).norm() / norm)
}

/// Tells if the rates of a held-out run lie within those of the training runs of its kind; `None` for unknown
/// rates or kinds.
pub fn within_rates(run: &Path, training: &Dataset) -> Option<bool> {
    let of_kind = || training.paths.iter().filter(|path| path.kind == run.kind);
    let pulled = || (0..3).filter(|&axis| !run.rates[axis].is_nan());
    if pulled().next().is_none() || of_kind().next().is_none() {
        return None;
    }
    let enclosed = |axis: usize| {
        let rates = || of_kind().map(|path| path.rates[axis]).filter(|rate| !rate.is_nan());
        let [least, greatest] = range(rates());
        (least..=greatest).contains(&run.rates[axis])
    };
    Some(pulled().all(enclosed))
}

/// Measures the seconds per stress at the C of some rows, on one thread: the shortest of several
/// measurements.
///
/// # Errors
/// Returns the errors of [`Surrogate::stress`], and [`Error::Data`] for no rows.
pub fn time_per_stress(law: &Surrogate, rows: &[&DataRow]) -> Result<f64, Error> {
    if rows.is_empty() {
        let (found, allowed) = ("no row".into(), "at least one row".into());
        return Err(Error::Data { what: "measuring a stress", found, allowed });
    }
    let mut memory = Workspace::default();
    let mut shortest = f64::INFINITY;
    for _ in 0..ROUNDS {
        let since = Instant::now();
        let mut sum = 0.0;
        for k in 0..TIMED {
            sum += law.stress(&rows[k % rows.len()].c, &mut memory)?.stress[0];
        }
        // keeps the compiler from removing the loop
        std::hint::black_box(sum);
        shortest = shortest.min(since.elapsed().as_secs_f64() / TIMED as f64);
    }
    Ok(shortest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::tests::set_of_a_law;
    use crate::network::Activation::Tanh;
    use crate::surrogate::{Header, Kind};

    #[test]
    fn errors_by_hand() {
        let set = set_of_a_law();
        let mut header = Header::new(Kind::Ann, &[(3, Tanh)], 1);
        // a law that predicts 7 MPa on 22 and zero elsewhere
        header.output_deviation = vec![0.0; 6];
        header.output_mean[1] = 7e6;
        let law = Surrogate::random(header, 1).unwrap();
        let row = &set.paths[0].rows[10];
        let found = errors(&law, [row].into_iter()).unwrap();
        let off = row.s - Voigt::new(0.0, 7e6, 0.0, 0.0, 0.0, 0.0);
        assert!((found.mean_square() / off.norm_squared() - 1.0).abs() < 1e-14);
        assert!((found.percentage - 100.0 * off.norm() / row.s.norm()).abs() < 1e-12);
        // the box of this header is C = I
        assert_eq!((found.rows, found.flagged), (1, 1));
        assert_eq!(errors(&law, [].into_iter()).unwrap().mean_square(), 0.0);
        assert_eq!(percentage_error(&Voigt::zeros(), &row.s), None);
        // the first row is C = I, S = 0 and has no percentage
        assert_eq!(errors(&law, set.paths[0].rows[..1].iter()).unwrap().percentage, 0.0);
        assert!(time_per_stress(&law, &[row]).unwrap() > 0.0);
        assert!(time_per_stress(&law, &[]).is_err());
    }

    #[test]
    fn rates_within_and_beyond() {
        let mut set = set_of_a_law();
        for (index, path) in set.paths.iter_mut().enumerate() {
            path.rates[index % 3] = 1e9 * (1 + index) as f64;
        }
        let mut run = set.paths[0].clone();
        // runs u0 are numbers 0 and 6
        for (rate, expected) in [(1e9, true), (5e9, true), (7e9, true), (0.9e9, false), (8e9, false)] {
            run.rates[0] = rate;
            assert_eq!(within_rates(&run, &set), Some(expected), "{rate}");
        }
        run.rates = [f64::NAN; 3];
        assert_eq!(within_rates(&run, &set), None);
        run.kind = "twisted".into();
        run.rates[0] = 1e9;
        assert_eq!(within_rates(&run, &set), None);
    }
}
