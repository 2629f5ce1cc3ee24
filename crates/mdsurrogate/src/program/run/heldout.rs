//! Held-out runs with measured and predicted stresses.

use crate::dataset::{DataRow, Path as Path_};
use crate::eval::percentage_error;

/// Held-out run with predictions.
pub(super) struct Heldout<'a> {
    pub run: &'a Path_,
    /// Axis with the largest deformation; of the pulled axes if the rates are known.
    pub axis: usize,
    /// True if its rates lie within those of the training runs; `None` if unknown.
    pub within: Option<bool>,
    /// Predictions of each law: S at the rows, or nominal stresses ([`DataRow::compared`]).
    pub predicted: Vec<Vec<[f64; 6]>>,
}

impl Heldout<'_> {
    /// Returns name and values of the measured stress along the axis.
    pub fn measured(&self) -> (String, Vec<f64>) {
        let rows = &self.run.rows;
        let letter = if rows.iter().any(|row| row.nominal.is_some()) { "P" } else { "S" };
        let along = rows.iter().map(|row| row.compared(&row.s)[0][self.axis] / 1e6).collect();
        (format!("{letter}{}", crate::kinematics::NAMES[self.axis]), along)
    }
}

/// Computes (3.13) for each row; NaN without stress.
pub(super) fn percentages(rows: &[DataRow], predicted: &[[f64; 6]]) -> Vec<f64> {
    let error = |(row, stress): (&DataRow, &[f64; 6])| {
        percentage_error(&row.compared(&row.s)[0], &(*stress).into()).unwrap_or(f64::NAN)
    };
    rows.iter().zip(predicted).map(error).collect()
}
