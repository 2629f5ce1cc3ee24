//! Paths as tables of moves.

use super::{Move, ToolPath, error};
use crate::error::Error;
use crate::table::{TableColumn, read_with_lines};
use polycore::units::dimension::{LengthDimension, RatioDimension, TimeDimension};
use std::path::Path;

/// Reads a path from a CSV table with columns `time [unit]` (not descending), `x [unit]`, `y [unit]`, `z
/// [unit]`, by default in s and m, and `print`: nonzero if the move that ends there deposits material.
///
/// # Errors
/// Errors of [`crate::table::read`]; [`Error::File`] for times that descend.
pub fn read_csv(path: &Path) -> Result<ToolPath, Error> {
    let length = |name| TableColumn::new::<LengthDimension>(name).or_unit("m");
    let columns = [
        TableColumn::new::<TimeDimension>("time").or_unit("s"),
        length("x"),
        length("y"),
        length("z"),
        TableColumn::new::<RatioDimension>("print"),
    ];
    let ([time, x, y, z, print], lines) = read_with_lines(path, columns)?;
    let mut moves = Vec::with_capacity(time.len());
    for row in 1..time.len() {
        let (start, end) = (time[row - 1], time[row]);
        if end < start {
            return Err(error(path, lines[row], "time", end, format!("{start} s or later")));
        }
        let place = |row: usize| [x[row], y[row], z[row]];
        moves.push(Move {
            from: place(row - 1),
            to: place(row),
            start,
            end,
            prints: print[row] != 0.0,
            ..Move::default()
        });
    }
    Ok(ToolPath { moves, ..ToolPath::default() })
}
