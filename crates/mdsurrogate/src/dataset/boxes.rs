//! Deformation gradients of periodic boxes: relative to the undeformed box of each run, with flips of tilted
//! boxes undone.

use super::options::{BoxReference, LENGTHS, ReadOptions, TILTS};
use super::table::{ColumnIndex, DataTable};
use crate::Error;
use crate::kinematics::PeriodicBox;
use polycore::tensor::DeformationGradient;

/// Rows of one run.
pub(super) struct TableRun {
    /// Name of the run.
    pub id: String,
    /// All rows, in file order.
    pub all: Vec<usize>,
    /// First row.
    pub first: usize,
    /// Rows with values: sample and row, in the order of the samples.
    pub rows: Vec<(u64, usize)>,
}

/// Tolerance of F = 1 for the undeformed box, from the rounding of tables.
const ROUNDING: f64 = 1e-6;

/// LAMMPS flips a tilt beyond 0.5 (`fix deform`) or 0.6 (`fix npt`) of a length; larger tilts mean that boxes
/// are not flipped.
const FLIPPED_BELOW: f64 = 0.65;

/// Distance from both sides of a flip, over the length, beyond which a value is a mean of both sides.
const MIXED_MARGIN: f64 = 0.02;

/// Change of a tilt over its length between rows, beyond which its direction is ambiguous.
const AMBIGUOUS_STEP: f64 = 0.4;

/// Columns of a periodic box.
pub(super) struct BoxColumns {
    lengths: [ColumnIndex; 3],
    tilts: Option<[ColumnIndex; 3]>,
    averaged: bool,
}

impl BoxColumns {
    pub fn new(table: &DataTable, prefix: &str) -> Result<Self, Error> {
        let prefixed = |name: &str| format!("{prefix}{name}");
        let tilted = TILTS.iter().any(|name| table.contains(&prefixed(name)));
        let tilts = if tilted { Some(table.columns(TILTS.map(prefixed))?) } else { None };
        Ok(Self { lengths: table.columns(LENGTHS.map(prefixed))?, tilts, averaged: !prefix.is_empty() })
    }

    pub fn lengths(&self) -> &[ColumnIndex; 3] {
        &self.lengths
    }

    fn box_of_row(&self, table: &DataTable, row: usize) -> Result<PeriodicBox, Error> {
        let in_angstroms = |columns: &[ColumnIndex; 3]| -> Result<[f64; 3], Error> {
            let mut numbers = table.numbers(row, columns)?;
            for (number, column) in numbers.iter_mut().zip(columns) {
                *number *= table.length_unit(*column)?;
            }
            Ok(numbers)
        };
        let tilts = self.tilts.as_ref().map_or(Ok([0.0; 3]), in_angstroms)?;
        Ok(PeriodicBox { lengths: in_angstroms(&self.lengths)?, tilts })
    }

    /// Returns the instantaneous box of a row, if the table has it, else the averaged one.
    fn instant(&self, table: &DataTable, row: usize) -> Result<PeriodicBox, Error> {
        let found = |names: [&str; 3]| {
            let [Some(a), Some(b), Some(c)] = names.map(|name| table.find(name)) else { return None };
            Some([a, b, c])
        };
        Self {
            lengths: found(LENGTHS).unwrap_or(self.lengths),
            tilts: found(TILTS).or(self.tilts),
            averaged: false,
        }
        .box_of_row(table, row)
    }

    /// Computes F of each row of each run; returns it with notes.
    ///
    /// # Errors
    /// Returns an error for a run without undeformed row, means across a flip, and invalid lengths.
    pub fn deformations(
        &self,
        table: &DataTable,
        runs: &[TableRun],
        options: &ReadOptions,
    ) -> Result<(Vec<Vec<DeformationGradient>>, Vec<String>), Error> {
        let mut flips = Vec::new();
        let mut all = Vec::new();
        for run in runs {
            let reference = self.reference(table, run, runs, options)?;
            let boxes: Vec<PeriodicBox> =
                run.rows.iter().map(|(_, row)| self.box_of_row(table, *row)).collect::<Result<_, _>>()?;
            if self.averaged && self.tilts.is_some() {
                refuse_averaged_flips(table, run, &boxes)?;
            }
            let (boxes, flipped) = undo_flips(reference, &boxes);
            if !flipped.is_empty() {
                refuse_ambiguous_steps(table, run, reference, &boxes)?;
            }
            flips.extend(flipped.first().map(|&place| (run, run.rows[place].0, flipped.len())));
            let deformation = |(current, (_, row)): (&PeriodicBox, &(u64, usize))| {
                current.deformation_from(&reference).map_err(|error| table.at_row(*row, error))
            };
            all.push(boxes.iter().zip(&run.rows).map(deformation).collect::<Result<_, _>>()?);
        }
        let mut notes = Vec::new();
        if let Some((run, sample, _)) = flips.first() {
            let count: usize = flips.iter().map(|(.., count)| count).sum();
            notes.push(format!(
                "{count} flips of the tilted box undone in {} runs (first: run `{}`, sample {sample})",
                flips.len(),
                run.id
            ));
        }
        Ok((all, notes))
    }

    fn reference(
        &self,
        table: &DataTable,
        run: &TableRun,
        runs: &[TableRun],
        options: &ReadOptions,
    ) -> Result<PeriodicBox, Error> {
        if let Some(reference) = options.reference {
            return Ok(reference);
        }
        match options.origin {
            Some(BoxReference::Run) => self.instant(table, run.first),
            Some(BoxReference::File) => {
                self.instant(table, runs.iter().map(|run| run.first).min().unwrap_or(run.first))
            }
            None => {
                if let [Some(a), Some(b), Some(c)] = ["F11", "F22", "F33"].map(|name| table.find(name)) {
                    for &row in &run.all {
                        let rest =
                            table.numbers(row, &[a, b, c])?.iter().all(|f| (f - 1.0).abs() <= ROUNDING);
                        if rest {
                            return self.instant(table, row);
                        }
                    }
                }
                let whose = if runs.len() > 1 { format!(" of run `{}`", run.id) } else { String::new() };
                Err(Error::file(
                    &table.path,
                    format!("no undeformed row{whose} with F11 = F22 = F33 = 1 and lx, ly, lz"),
                    "such a row in each run; or in the scene `reference = \"run\"` (the first row of each \
                     run is undeformed), `reference = \"file\"` (the first row of the file is) or \
                     `reference_lengths`",
                ))
            }
        }
    }
}

/// Returns the boxes without jumps, and the places of flips: a flipped box has the edges b + n a and c + m a
/// + k b of the same lattice.
fn undo_flips(start: PeriodicBox, boxes: &[PeriodicBox]) -> (Vec<PeriodicBox>, Vec<usize>) {
    let far = |cell: &PeriodicBox| {
        let ([x, y, _], [xy, xz, yz]) = (cell.lengths, cell.tilts);
        [xy / x, xz / x, yz / y].iter().any(|part| part.abs() > FLIPPED_BELOW)
    };
    if boxes.iter().any(far) {
        return (boxes.to_vec(), Vec::new());
    }
    let (mut found, mut flips) = (Vec::new(), Vec::new());
    let (mut before, mut turns) = (start, [0.0; 3]);
    for (place, cell) in boxes.iter().enumerate() {
        let ([x, y, _], [xy, xz, yz]) = (cell.lengths, cell.tilts);
        let n = ((before.tilts[0] - xy) / x).round();
        let k = ((before.tilts[2] - yz) / y).round();
        let xz = xz + k * (xy + n * x);
        let m = ((before.tilts[1] - xz) / x).round();
        before = PeriodicBox { lengths: cell.lengths, tilts: [xy + n * x, xz + m * x, yz + k * y] };
        if turns != [n, m, k] {
            flips.push(place);
        }
        turns = [n, m, k];
        found.push(before);
    }
    (found, flips)
}

/// Refuses rows between which the direction of a tilt is ambiguous.
///
/// # Errors
/// Returns [`Error::File`] with the tilt, line and sample.
fn refuse_ambiguous_steps(
    table: &DataTable,
    run: &TableRun,
    mut before: PeriodicBox,
    boxes: &[PeriodicBox],
) -> Result<(), Error> {
    for (cell, (sample, row)) in boxes.iter().zip(&run.rows) {
        for (tilt, length) in [(0, 0), (1, 0), (2, 1)] {
            let step = (cell.tilts[tilt] - before.tilts[tilt]).abs() / cell.lengths[length];
            if step > AMBIGUOUS_STEP {
                return Err(Error::file(
                    &table.path,
                    format!(
                        "rows too far apart to undo flips of the box: tilt {} changes by {step:.2} of its \
                         length up to line {} (run `{}`, sample {sample})",
                        TILTS[tilt],
                        table.line(*row),
                        run.id
                    ),
                    "changes below 0.4 between samples, or a run with `flip no`",
                ));
            }
        }
        before = *cell;
    }
    Ok(())
}

/// Refuses means over an interval with a flip: they are neither a shape nor a strain.
///
/// # Errors
/// Returns [`Error::File`] with the tilt, line and sample.
fn refuse_averaged_flips(table: &DataTable, run: &TableRun, boxes: &[PeriodicBox]) -> Result<(), Error> {
    for (tilt, length) in [(0, 0), (1, 0), (2, 1)] {
        let part: Vec<f64> = boxes.iter().map(|cell| cell.tilts[tilt] / cell.lengths[length]).collect();
        if part.iter().any(|part| part.abs() > FLIPPED_BELOW) {
            continue;
        }
        let mut steps: Vec<f64> = part.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
        steps.sort_by(f64::total_cmp);
        let usual = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
        let mixed = part.windows(3).position(|three| {
            let (low, high) = (three[0].min(three[2]), three[0].max(three[2]));
            high - low > 0.6 && three[1] > low + MIXED_MARGIN && three[1] < high - MIXED_MARGIN
        });
        // at the end no row shows the other side
        let last = part.last_chunk().filter(|[a, b]| {
            a.abs() > 0.3
                && b.abs() < a.abs()
                && (b - a).abs() > (4.0 * usual).max(0.2)
                && (b - a).abs() < 0.6
        });
        let place = mixed.map(|k| k + 1).or(last.map(|_: &[f64; 2]| part.len() - 1));
        if let Some(place) = place {
            let (sample, row) = run.rows[place];
            return Err(Error::file(
                &table.path,
                format!(
                    "the mean tilt avg_{} = {} in line {} (run `{}`, sample {sample}), averaged across a \
                     flip of the box",
                    TILTS[tilt],
                    boxes[place].tilts[tilt],
                    table.line(row),
                    run.id
                ),
                "`columns = \"instantaneous\"`, or a run with `flip no`",
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A shear of any size in small steps, flipped as in LAMMPS (yz shifts xz as well), is recovered.
    #[test]
    fn flips_of_all_tilts_are_undone() {
        let lengths = [10.0, 12.0, 9.0];
        for speed in [[0.8, 0.0, 0.0], [0.0, -0.9, 0.3], [0.3, 0.5, 0.7], [-0.4, 0.2, -0.9]] {
            let (mut raw, mut true_) = (Vec::new(), Vec::new());
            for step in 0..60 {
                let whole: [f64; 3] = std::array::from_fn(|i| speed[i] * f64::from(step));
                let [mut xy, mut xz, mut yz] = whole;
                while yz.abs() > 6.0 {
                    let sign = yz.signum();
                    (yz, xz) = (yz - sign * 12.0, xz - sign * xy);
                }
                while xz.abs() > 5.0 {
                    xz -= xz.signum() * 10.0;
                }
                while xy.abs() > 5.0 {
                    xy -= xy.signum() * 10.0;
                }
                raw.push(PeriodicBox { lengths, tilts: [xy, xz, yz] });
                true_.push(whole);
            }
            let (found, flips) = undo_flips(PeriodicBox::orthogonal(lengths), &raw);
            assert!(!flips.is_empty());
            for (found, expected) in found.iter().zip(true_) {
                for (a, b) in found.tilts.iter().zip(expected) {
                    assert!((a - b).abs() < 1e-12, "{:?} {expected:?}", found.tilts);
                }
            }
        }
        // larger tilts than those of flips are kept
        let far = [PeriodicBox { lengths, tilts: [0.0; 3] }, PeriodicBox { lengths, tilts: [7.0, 0.0, 0.0] }];
        assert_eq!(undo_flips(far[0], &far).0, far);
    }
}
