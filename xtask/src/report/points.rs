//! Points of errors and run times: from rows of benches, from tables and curves of cases.

use std::collections::BTreeMap;

use harness::report::Value;

use crate::bench::Row;
use crate::outcome::CaseOutcome;

/// Pairs rows of errors with the rows of times of the same point, for the largest size that has both: name,
/// time, error.
pub fn pairs(rows: &[Row], error: &str, time: &str) -> Vec<(String, f64, f64)> {
    let key = |row: &Row, marker: &str| {
        let at = row.what.find(marker)?;
        // `error` must not be found in `terrors`
        let before = row.what[..at].chars().next_back().is_none_or(|c| c == ' ');
        let rest = format!("{} {}", &row.what[..at], &row.what[at + marker.len()..]);
        let rest = rest.split_whitespace().collect::<Vec<_>>().join(" ");
        before.then(|| rest.trim_end_matches([':', ' ']).to_owned())
    };
    let mut points = Vec::new();
    for row in rows {
        let Some(name) = key(row, error) else { continue };
        let same = |other: &&Row| key(other, time).as_ref() == Some(&name);
        // if a size is that of the problem, both rows have the same
        let partner = rows.iter().filter(same).find(|other| other.size == row.size);
        let partner = partner.or_else(|| rows.iter().find(same));
        if let (Some(error), Some(time)) = (row.value, partner.and_then(|row| row.value)) {
            points.push((row.size, name, time, error));
        }
    }
    // the same name at several sizes: only the largest
    let largest: BTreeMap<String, u64> = points.iter().fold(BTreeMap::new(), |mut most, (size, name, ..)| {
        let entry = most.entry(name.clone()).or_insert(*size);
        *entry = (*entry).max(*size);
        most
    });
    points.retain(|(size, name, ..)| largest.get(name) == Some(size));
    points.into_iter().map(|(_, name, time, error)| (name, time, error)).collect()
}

/// Reads rows `NAME,…` with numbers in two columns.
pub fn read_table_points(text: &str, error: usize, time: usize, scale: f64) -> Vec<(String, f64, f64)> {
    let point = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |k: usize| cells.get(k)?.trim().parse::<f64>().ok();
        Some((cells[0].to_owned(), scale * number(time)?, number(error)?))
    };
    text.lines().skip(1).filter_map(point).collect()
}

/// Reads every point of every curve whose name begins with `prefix`.
pub fn read_curve_points(outcome: &CaseOutcome, prefix: &str) -> Vec<(String, f64, f64)> {
    let values = outcome.report.iter().flat_map(|report| &report.values);
    let mut points = Vec::new();
    for (name, value) in values {
        let (Some(name), Value::Curve { columns }) = (name.strip_prefix(prefix), value) else { continue };
        let seconds = columns.iter().find(|column| column.name == "seconds");
        let (Some(time), Some(error)) = (seconds, columns.last()) else { continue };
        let name = name.replace('[', " [");
        points.extend(time.data.iter().zip(&error.data).map(|(t, e)| (name.clone(), *t, *e)));
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(what: &str, size: u64, value: f64) -> Row {
        Row { what: what.to_owned(), size, threads: 1, value: Some(value), unit: String::new() }
    }

    #[test]
    fn errors_and_times_of_the_same_point() {
        let rows = [
            row("adr 1e-2: error", 10, 0.1),
            row("adr 1e-2: time", 10, 3.0),
            row("adr 1e-2: error", 20, 0.2),
            row("adr 1e-2: time", 20, 6.0),
            row("adr 1e-3: error", 20, 0.02),
        ];
        assert_eq!(pairs(&rows, "error", "time"), [("adr 1e-2".to_owned(), 6.0, 0.2)]);
        let rows = [row("bdf 4: error, smooth", 1, 0.1), row("bdf 4: time, smooth", 1, 8.0)];
        assert_eq!(pairs(&rows, "error, smooth", "time, smooth"), [("bdf 4".to_owned(), 8.0, 0.1)]);
        assert_eq!(pairs(&rows, "error, quenched", "time, quenched"), []);
        // sizes that count repetitions differ
        let rows = [row("exact: error", 200, 1e-16), row("exact: time", 7, 4.0)];
        assert_eq!(pairs(&rows, "error", "time"), [("exact".to_owned(), 4.0, 1e-16)]);
    }

    #[test]
    fn rows_of_a_table() {
        let text = "law,error,training [s],one stress [s]\nenergy,2.5,30,1e-6\nANN-4,3,nothing,2e-6\n";
        assert_eq!(
            read_table_points(text, 1, 3, 1e6),
            [("energy".to_owned(), 1.0, 2.5), ("ANN-4".to_owned(), 2.0, 3.0)]
        );
        assert_eq!(read_table_points(text, 1, 2, 1.0), [("energy".to_owned(), 30.0, 2.5)]);
    }
}
