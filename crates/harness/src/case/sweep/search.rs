//! The least value of a key with which a scene meets all that it expects.

use super::{LEAST_VALUE, SweepOptions, Vary, rows};
use crate::case::rows::numeric;
use crate::case::{Case, Finished, Row};
use crate::report::Named;
use crate::scene::{Failure, Source};
use polycore::Error;
use std::str::FromStr;

/// The least value is found to this part of the interval.
const PART: f64 = 0.01;

/// A key and the interval in which its least value is sought.
#[derive(Clone, Debug, PartialEq)]
pub struct Search {
    key: String,
    ends: [f64; 2],
    unit: String,
}

impl FromStr for Search {
    type Err = String;

    /// Parses `KEY=LOW..HIGH`, both in one unit.
    fn from_str(text: &str) -> Result<Self, String> {
        let refused = || {
            let usage =
                "KEY=LOW..HIGH with numbers of one unit, the lower first, e.g. print.layer_time=5s..40s";
            format!("found `{text}`; allowed: {usage}")
        };
        let (key, range) = text.split_once('=').ok_or_else(refused)?;
        let (low, high) = range.split_once("..").ok_or_else(refused)?;
        let (ends, unit) = numeric(&[low.trim().to_owned(), high.trim().to_owned()]).ok_or_else(refused)?;
        let ends = <[f64; 2]>::try_from(ends).map_err(|_| refused())?;
        let finite = ends.iter().all(|end| end.is_finite());
        let right = finite && ends[0] < ends[1] && !key.trim().is_empty();
        if right { Ok(Self { key: key.trim().to_owned(), ends, unit }) } else { Err(refused()) }
    }
}

/// Bisects for the least value with which all expectations of a scene are met, to a hundredth of the
/// interval: as sweeps into one folder, which keeps what is finished. It is taken that a greater value is no
/// worse.
///
/// # Errors
/// As [`super::sweep`]; a scene without expectations.
pub fn search<C: Case>(
    source: &Source,
    search: &Search,
    options: &mut SweepOptions,
) -> Result<Finished, Failure<C::Error>> {
    let Search { key, ends: [low, high], unit } = search;
    let told = |value: f64| format!("{value}{unit}");
    let mut try_out = |values: &[f64]| -> Result<(Vec<bool>, Finished), Failure<C::Error>> {
        let tried = values.iter().map(|&value| told(value)).collect();
        let vary = Vary { key: key.clone(), values: tried, drawn: false };
        let (rows, _, report) = rows::<C>(source, &[vary], options)?;
        let met = |row: &Row| row.outcome.as_ref().is_ok_and(|own| own.passed());
        if rows.rows.iter().any(|row| row.outcome.as_ref().is_ok_and(|own| own.expect.is_empty())) {
            let reason = "found a scene without [[expect]]; allowed: one with expectations".to_owned();
            return Err(Error::Option { option: format!("--search {key}"), reason }.into());
        }
        let first = rows.rows.iter().take(values.len()).map(met).collect();
        let table = Some(rows.short_text(super::WIDTH));
        Ok((first, Finished { table, ..Finished::new(report, rows.text()) }))
    };
    let (met, mut finished) = try_out(&[*low, *high])?;
    let verdict = match met[..] {
        [true, ..] => {
            format!("{key} = {} satisfies all expectations; smaller values were not tried", told(*low))
        }
        [_, false] => {
            finished.report.passed = false;
            format!(
                "{key} = {} does not satisfy all expectations; greater values were not tried",
                told(*high)
            )
        }
        _ => {
            let (mut fails, mut passes) = (*low, *high);
            while passes - fails > PART * (high - low) {
                // five digits: no value that a user would not write
                let middle = 0.5 * (fails + passes);
                let middle = format!("{middle:.4e}").parse().unwrap_or(middle);
                if !(fails < middle && middle < passes) {
                    break;
                }
                let (met, last) = try_out(&[middle])?;
                finished = last;
                if met.first() == Some(&true) { passes = middle } else { fails = middle }
            }
            finished.report.value(Named::from(LEAST_VALUE).in_unit(unit), passes);
            finished.report.write(options.output)?;
            format!(
                "{key} = {} is the least value that satisfies all expectations; {} does not",
                told(passes),
                told(fails)
            )
        }
    };
    finished.text += &format!("{verdict}\n");
    finished.table.iter_mut().for_each(|table| *table += &format!("{verdict}\n"));
    Ok(finished)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals() {
        let of = |text: &str| text.parse::<Search>();
        let found = of("print.layer_time=5s .. 40 s").unwrap();
        assert_eq!(
            (found.key.as_str(), found.ends, found.unit.as_str()),
            ("print.layer_time", [5.0, 40.0], "s")
        );
        for wrong in ["a", "a=1", "a=1..", "a=2s..1s", "a=1s..2min", "=1..2", "a=1..inf"] {
            assert!(of(wrong).unwrap_err().contains("allowed: KEY=LOW..HIGH"), "{wrong}");
        }
    }
}
