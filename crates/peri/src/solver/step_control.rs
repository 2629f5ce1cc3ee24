//! Load steps of a state: their progress, their cuts, and the last one to which a run can return.

use super::fracture::Fracture;
use crate::field::Field;
use crate::potential::StretchRange;
use serde::{Deserialize, Serialize};

/// Control of load steps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct StepControl<const D: usize> {
    /// True if this step's first guess is made.
    pub(super) predicted: bool,
    /// Equilibria found in this step.
    pub round: u64,
    /// Displacements of the two equilibria before the last, if no bond has broken since.
    pub(super) past: Vec<Field<D>>,
    /// Factor, and the loads' conjugate sums, at the last equilibrium.
    pub(super) balanced: [f64; 3],
    /// Force density at the start of the step, if loads follow curves and the step may be cut.
    pub(super) start_force: Option<Box<Field<D>>>,
    /// Body force and displacement at the last equilibrium, if body forces depend on the displacement.
    pub(super) pushed: Option<Box<[Field<D>; 2]>>,
    /// Load factors and times of all steps, if steps have been cut …
    pub(super) factors: Vec<f64>,
    pub(super) times: Vec<f64>,
    /// … which of them were inserted, and how often the present one was cut.
    pub(super) inserted: Vec<usize>,
    pub(super) cuts: u32,
    /// Factor and largest stretch of the equilibrium from which the load was lowered, see
    /// [`System::snap_back`](super::System::snap_back).
    pub(super) lowered: Option<[f64; 2]>,
    /// The last finished step under given forces, which may tear the body apart.
    pub(super) accepted: Option<Box<Accepted<D>>>,
}

/// A finished step, without the data in the history.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub(super) struct Accepted<const D: usize> {
    pub displacement: Field<D>,
    pub force: Field<D>,
    pub fracture: Fracture,
    pub stretches: StretchRange,
}

impl<const D: usize> StepControl<D> {
    /// Inserts load factors before that of the step `at`.
    pub(super) fn insert(&mut self, at: usize, factors: &[f64], new: &[f64]) {
        let count = new.len();
        self.factors = factors.to_vec();
        self.factors.splice(at..at, new.iter().copied());
        self.inserted.iter_mut().filter(|row| **row >= at).for_each(|row| *row += count);
        self.inserted.extend(at..at + count);
        self.inserted.sort_unstable();
    }

    /// Number of prescribed steps finished in the first `rows` of the history; `None` if the last row is not
    /// the end of one.
    pub fn prescribed(&self, rows: usize) -> Option<usize> {
        let last = rows.checked_sub(1)?;
        let inserted = self.inserted.partition_point(|&row| row < last);
        (self.inserted.get(inserted) != Some(&last)).then(|| rows - inserted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prescribed_steps_keep_their_numbers() {
        let mut control = StepControl::<2>::default();
        control.insert(1, &[0.5, 1.0], &[0.6, 0.7]);
        let factors = control.factors.clone();
        control.insert(2, &factors, &[0.65]);
        assert_eq!(control.factors, [0.5, 0.6, 0.65, 0.7, 1.0]);
        let numbers: Vec<_> = (0..=5).map(|rows| control.prescribed(rows)).collect();
        assert_eq!(numbers, [None, Some(1), None, None, None, Some(2)]);
    }
}
