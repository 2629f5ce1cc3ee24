//! Flags of a learnt law: particles at which it is uncertain.

use super::moment::Moment;
use super::rows::width;
use crate::program::quantities as q;
use crate::program::scene::Scene;
use harness::observe::{Fields, Place, Scalars};
use polycore::constitutive::Flags;

/// Returns the first column of the two shares in the rows of the history, after those of probes.
fn first_column(scene: &Scene) -> usize {
    scene.probe.iter().map(width).sum()
}

/// Returns the first row of the history, from 1, in which a column is above 0.
fn first_row<const D: usize>(m: &Moment<D>, column: usize) -> Option<usize> {
    m.state.history.iter().position(|row| row.seen[column] > 0.0).map(|row| row + 1)
}

/// Adds the shares of flagged particles.
pub(super) fn scalars<const D: usize>(scene: &Scene, to: &mut Scalars<Moment<D>>) {
    if scene.is_learnt() {
        let column = first_column(scene);
        for (index, quantity) in [q::OUTSIDE_SHARE, q::FLAGGED_SHARE].into_iter().enumerate() {
            to.add_if(quantity, |m| m.state.history.last()?.seen.get(column + index).copied());
        }
        to.add_if(q::FIRST_STEP_OUTSIDE, |m| first_row(m, column).map(|row| row as f64));
    }
}

/// Warns if particles were flagged.
pub(super) fn warnings<const D: usize>(m: &Moment<D>) -> Vec<String> {
    let column = first_column(m.scene);
    let last = m.state.history.last().filter(|_| m.scene.is_learnt());
    let Some(&[outside, flagged]) = last.and_then(|row| row.seen.get(column..column + 2)) else {
        return Vec::new();
    };
    let steps = if m.scene.dynamics.is_some() { "row" } else { "step" };
    let warning = match (first_row(m, column), first_row(m, column + 1)) {
        (Some(left), _) => format!(
            "the learnt law leaves the box of its training data from {steps} {left} on; in the last {steps} \
             in {:.3} % of the \
             particles",
            100.0 * outside
        ),
        (None, Some(any)) => format!(
            "the learnt law is uncertain inside the box of its training data from {steps} {any} on; in the \
             last {steps} in {:.3} % \
             of the particles",
            100.0 * flagged
        ),
        (None, None) => return Vec::new(),
    };
    vec![warning]
}

/// Adds the flags of particles as a number, if the scene requests them.
pub(super) fn flag_field<const D: usize>(scene: &Scene, to: &mut Fields<Moment<D>>) {
    if scene.output.flags && scene.is_learnt() {
        to.add("flags", 1, Place::Points, |m| {
            let flags = m.physics.evaluator.flags(m.bonds, m.state).unwrap_or_default();
            flags.iter().map(encode).collect()
        });
    }
}

/// Encodes flags as a sum: 1 for a component of C outside the box of the training data, 2 for a component
/// that never changed there, 4 for a gap in the data, 8 for members that disagree.
fn encode(flags: &Flags) -> f64 {
    let reasons = [flags.outside.contains(&true), flags.unseen.contains(&true), flags.far, flags.spread];
    reasons.iter().zip([1.0, 2.0, 4.0, 8.0]).map(|(&given, bit)| if given { bit } else { 0.0 }).sum()
}
