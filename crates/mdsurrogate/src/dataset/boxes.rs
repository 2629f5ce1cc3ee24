//! F of periodic boxes: each run from its own undeformed box, with the flips of tilted boxes undone.

use super::options::{LENGTHS, Origin, ReadOptions, TILTS};
use super::table::{Column, Table};
use crate::Error;
use crate::kinematics::PeriodicBox;
use polycore::tensor::DeformationGradient;

/// The rows of one run.
pub(super) struct Run {
    /// Its name.
    pub id: String,
    /// All its rows, as they stand in the file.
    pub all: Vec<usize>,
    /// The first of them.
    pub first: usize,
    /// Those with values, with their samples, in the order of the samples.
    pub rows: Vec<(u64, usize)>,
}

/// F of a row in which a box is taken for undeformed may be so far from 1: how tables round.
const ROUNDED: f64 = 1e-6;

/// LAMMPS flips beyond half a length (`fix deform`) or 0.6 of it (`fix npt`): a larger tilt says that boxes are not flipped.
const FLIPPED_BELOW: f64 = 0.65;

/// Parts of a length: what lies so far between two sides of a flip is a mean of both.
const BETWEEN: f64 = 0.02;

/// Steps of a tilt over its length, beyond which either direction may be meant.
const COARSE: f64 = 0.4;

/// Columns of the box.
pub(super) struct Boxes {
    lengths: [Column; 3],
    tilts: Option<[Column; 3]>,
    averaged: bool,
}

impl Boxes {
    pub fn new(table: &Table, prefix: &str) -> Result<Self, Error> {
        let prefixed = |name: &str| format!("{prefix}{name}");
        let tilted = TILTS.iter().any(|name| table.has(&prefixed(name)));
        let tilts = if tilted { Some(table.columns(TILTS.map(prefixed))?) } else { None };
        Ok(Self { lengths: table.columns(LENGTHS.map(prefixed))?, tilts, averaged: !prefix.is_empty() })
    }

    pub fn lengths(&self) -> &[Column; 3] {
        &self.lengths
    }

    fn at(&self, table: &Table, row: usize) -> Result<PeriodicBox, Error> {
        let in_angstroms = |columns: &[Column; 3]| -> Result<[f64; 3], Error> {
            let mut numbers = table.numbers(row, columns)?;
            for (number, column) in numbers.iter_mut().zip(columns) {
                *number *= table.length_unit(*column)?;
            }
            Ok(numbers)
        };
        let tilts = self.tilts.as_ref().map_or(Ok([0.0; 3]), in_angstroms)?;
        Ok(PeriodicBox { lengths: in_angstroms(&self.lengths)?, tilts })
    }

    /// The box at the instant of a row, where the table has it.
    fn instant(&self, table: &Table, row: usize) -> Result<PeriodicBox, Error> {
        let of = |names: [&str; 3]| {
            let [Some(a), Some(b), Some(c)] = names.map(|name| table.find(name)) else { return None };
            Some([a, b, c])
        };
        Self {
            lengths: of(LENGTHS).unwrap_or(self.lengths),
            tilts: of(TILTS).or(self.tilts),
            averaged: false,
        }
        .at(table, row)
    }

    /// F of each row of each run, and notes on what was done.
    ///
    /// # Errors
    /// A run without an undeformed row, means across a flip, lengths that are none.
    pub fn deformations(
        &self,
        table: &Table,
        runs: &[Run],
        options: &ReadOptions,
    ) -> Result<(Vec<Vec<DeformationGradient>>, Vec<String>), Error> {
        let mut flips = Vec::new();
        let mut all = Vec::new();
        for run in runs {
            let reference = self.reference(table, run, runs, options)?;
            let boxes: Vec<PeriodicBox> =
                run.rows.iter().map(|(_, row)| self.at(table, *row)).collect::<Result<_, _>>()?;
            if self.averaged && self.tilts.is_some() {
                refuse_mixed(table, run, &boxes)?;
            }
            let (boxes, flipped) = unwrapped(reference, &boxes);
            if !flipped.is_empty() {
                refuse_coarse(table, run, reference, &boxes)?;
            }
            flips.extend(flipped.first().map(|&place| (run, run.rows[place].0, flipped.len())));
            let of = |(current, (_, row)): (&PeriodicBox, &(u64, usize))| {
                current.deformation_from(&reference).map_err(|error| table.at_row(*row, error))
            };
            all.push(boxes.iter().zip(&run.rows).map(of).collect::<Result<_, _>>()?);
        }
        let mut notes = Vec::new();
        if let Some((run, sample, _)) = flips.first() {
            let count: usize = flips.iter().map(|(.., count)| count).sum();
            notes.push(format!(
                "{count} flips of the tilted box undone in {} runs (the first: run `{}`, sample {sample})",
                flips.len(),
                run.id
            ));
        }
        Ok((all, notes))
    }

    fn reference(
        &self,
        table: &Table,
        run: &Run,
        runs: &[Run],
        options: &ReadOptions,
    ) -> Result<PeriodicBox, Error> {
        if let Some(reference) = options.reference {
            return Ok(reference);
        }
        match options.origin {
            Some(Origin::Run) => self.instant(table, run.first),
            Some(Origin::File) => {
                self.instant(table, runs.iter().map(|run| run.first).min().unwrap_or(run.first))
            }
            None => {
                if let [Some(a), Some(b), Some(c)] = ["F11", "F22", "F33"].map(|name| table.find(name)) {
                    for &row in &run.all {
                        let rest = table.numbers(row, &[a, b, c])?.iter().all(|f| (f - 1.0).abs() <= ROUNDED);
                        if rest {
                            return self.instant(table, row);
                        }
                    }
                }
                let whose = if runs.len() > 1 { format!(" of run `{}`", run.id) } else { String::new() };
                Err(Error::file(
                    &table.path,
                    format!("box lengths, but no row{whose} with F11 = F22 = F33 = 1 and its lx, ly, lz"),
                    "such a row in each run, `reference = \"run\"` where the first row of each run is undeformed \
                     (`\"file\"`: the first of the file), or `reference_lengths` in the scene",
                ))
            }
        }
    }
}

/// Boxes that follow each other without jumps: a flipped box has the edges b + n a and c + m a + k b of the same lattice.
/// Also the places of flips.
fn unwrapped(start: PeriodicBox, boxes: &[PeriodicBox]) -> (Vec<PeriodicBox>, Vec<usize>) {
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

/// # Errors
/// Rows between which a tilt changes by so much that the direction cannot be told.
fn refuse_coarse(
    table: &Table,
    run: &Run,
    mut before: PeriodicBox,
    boxes: &[PeriodicBox],
) -> Result<(), Error> {
    for (cell, (sample, row)) in boxes.iter().zip(&run.rows) {
        for (tilt, length) in [(0, 0), (1, 0), (2, 1)] {
            let step = (cell.tilts[tilt] - before.tilts[tilt]).abs() / cell.lengths[length];
            if step > COARSE {
                return Err(Error::file(
                    &table.path,
                    format!(
                        "rows too far apart to undo flips of the box: its tilt {} changes by {step:.2} of its length up to line {} \
                         (run `{}`, sample {sample})",
                        TILTS[tilt],
                        table.line(*row),
                        run.id
                    ),
                    "samples between which it changes by less than 0.4, or a run with `flip no`",
                ));
            }
        }
        before = *cell;
    }
    Ok(())
}

/// # Errors
/// A mean over an interval in which the box was flipped: neither shape nor strain.
fn refuse_mixed(table: &Table, run: &Run, boxes: &[PeriodicBox]) -> Result<(), Error> {
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
            high - low > 0.6 && three[1] > low + BETWEEN && three[1] < high - BETWEEN
        });
        // at the end nothing follows that would tell the other side
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
                    "the mean tilt avg_{} = {} in line {} (run `{}`, sample {sample}), between the two sides of a flip of \
                     the box",
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

    /// A shear of any size in small steps, flipped as LAMMPS flips (yz takes xz along), comes back as it was.
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
            let (found, flips) = unwrapped(PeriodicBox::orthogonal(lengths), &raw);
            assert!(!flips.is_empty());
            for (found, expected) in found.iter().zip(true_) {
                for (a, b) in found.tilts.iter().zip(expected) {
                    assert!((a - b).abs() < 1e-12, "{:?} {expected:?}", found.tilts);
                }
            }
        }
        // tilts beyond what LAMMPS flips at are as they are
        let far = [PeriodicBox { lengths, tilts: [0.0; 3] }, PeriodicBox { lengths, tilts: [7.0, 0.0, 0.0] }];
        assert_eq!(unwrapped(far[0], &far).0, far);
    }
}
