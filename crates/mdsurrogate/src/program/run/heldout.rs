//! Held-out runs, what was measured on them and what laws predict.

use crate::dataset::{Path as Path_, Row};
use crate::eval::percentage_error;

/// A held-out run as laws see it.
pub(super) struct Heldout<'a> {
    pub run: &'a Path_,
    /// The axis that is pulled most; of all, where it is not known which ones are.
    pub axis: usize,
    /// Whether its rates lie within those of the training runs, where that is known.
    pub within: Option<bool>,
    /// Of each law: S at the rows, or what was measured there ([`Row::compared`]).
    pub predicted: Vec<Vec<[f64; 6]>>,
}

impl Heldout<'_> {
    /// What was measured along the axis, and its name.
    pub fn measured(&self) -> (String, Vec<f64>) {
        let rows = &self.run.rows;
        let letter = if rows.iter().any(|row| row.nominal.is_some()) { "P" } else { "S" };
        let along = rows.iter().map(|row| row.compared(&row.s)[0][self.axis] / 1e6).collect();
        (format!("{letter}{}", crate::kinematics::NAMES[self.axis]), along)
    }
}

/// (3.13) row by row; NaN where there is no stress.
pub(super) fn percentages(rows: &[Row], predicted: &[[f64; 6]]) -> Vec<f64> {
    let error = |(row, stress): (&Row, &[f64; 6])| {
        percentage_error(&row.compared(&row.s)[0], &(*stress).into()).unwrap_or(f64::NAN)
    };
    rows.iter().zip(predicted).map(error).collect()
}
