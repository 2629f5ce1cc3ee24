//! The tables of a run: its CSV files and the curves of its report.

use std::path::Path;

use serde::Serialize;

use crate::case::matches_pattern;
use crate::report::{Report, SceneUnits, Value};
use polycore::Error;

/// Rows of a table at most: longer ones are thinned.
const ROWS: usize = 2_000;
/// Numbers of all tables of a page at most.
const NUMBERS: usize = 80_000;

/// Columns of numbers.
#[derive(Debug, Serialize)]
pub struct PageTable {
    /// File without `.csv`, or name of a curve.
    name: String,
    /// Row k is row k · `every` of the file.
    every: usize,
    /// Place among the curves that the scene shows first.
    main: Option<usize>,
    /// Times of the rows, s, where the column is in another unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    times: Option<Vec<Option<f64>>>,
    columns: Vec<PageColumn>,
}

#[derive(Debug, Serialize)]
struct PageColumn {
    name: String,
    unit: String,
    data: Vec<Option<f64>>,
}

/// All tables of a page, and what had no room.
#[derive(Debug, Default)]
pub struct PageTables {
    /// PageTables in the order in which they came.
    pub tables: Vec<PageTable>,
    /// Names of those left out.
    pub left_out: Vec<String>,
    numbers: usize,
}

impl PageTables {
    /// Adds a CSV file; cells that hold no number are gaps, and columns without any number are left out.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] for a file that is no table.
    pub fn file(&mut self, path: &Path, name: &str) -> Result<(), Error> {
        let fail = |error: csv::Error| Error::Format {
            path: path.to_path_buf(),
            format: "CSV table",
            reason: error.to_string(),
        };
        let text = std::fs::read(path).map_err(Error::from_io("read", path))?;
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_slice());
        let headings = reader.headers().map_err(fail)?;
        let mut columns: Vec<(String, String, Vec<f64>)> = headings
            .iter()
            .map(|heading| {
                let (name, unit) = heading.rsplit_once(" [").unwrap_or((heading, ""));
                (name.to_owned(), unit.trim_end_matches(']').to_owned(), Vec::new())
            })
            .collect();
        for record in reader.records() {
            let record = record.map_err(fail)?;
            for ((_, _, data), cell) in columns.iter_mut().zip(&record) {
                data.push(cell.trim().parse().unwrap_or(f64::NAN));
            }
        }
        self.push(name, columns);
        Ok(())
    }

    /// Adds the curves of a report.
    pub fn curves(&mut self, report: &Report) {
        for (name, value) in &report.values {
            if let Value::Curve { columns } = value {
                let columns = columns.iter().map(|c| (c.name.clone(), c.unit.clone(), c.data.clone()));
                self.push(name, columns.collect());
            }
        }
    }

    /// Converts columns to the units of a scene, and marks the curves that it lists.
    pub fn prepare(&mut self, units: &SceneUnits, listed: &[String]) {
        for table in &mut self.tables {
            let plain = table.name.split('[').next().unwrap_or_default();
            table.main = listed
                .iter()
                .position(|name| matches_pattern(name, &table.name) || matches_pattern(name, plain));
            for column in &mut table.columns {
                let largest = column.data.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
                let Some(unit) = units.shown(&column.unit, largest) else { continue };
                if unit.factor != 1.0 && column.name == "time" {
                    table.times = Some(column.data.clone());
                }
                column.data.iter_mut().flatten().for_each(|x| *x = rounded(*x * unit.factor));
                column.unit = unit.name.to_owned();
            }
        }
    }

    fn push(&mut self, name: &str, columns: Vec<(String, String, Vec<f64>)>) {
        let every = columns.first().map_or(1, |(_, _, data)| data.len().div_ceil(ROWS)).max(1);
        let columns: Vec<PageColumn> = columns
            .into_iter()
            .filter(|(_, _, data)| data.iter().any(|x| x.is_finite()))
            .map(|(name, unit, data)| {
                let last = data.len() - 1;
                let rows = (0..data.len()).filter(|row| row % every == 0 || *row == last);
                PageColumn { name, unit, data: rows.map(|row| short(data[row])).collect() }
            })
            .collect();
        let numbers: usize = columns.iter().map(|column| column.data.len()).sum();
        if columns.len() < 2 {
            return;
        }
        if self.numbers + numbers > NUMBERS {
            self.left_out.push(name.to_owned());
            return;
        }
        self.numbers += numbers;
        self.tables.push(PageTable { name: name.to_owned(), every, main: None, times: None, columns });
    }
}

/// Six digits; none of what is not finite.
fn short(number: f64) -> Option<f64> {
    number.is_finite().then(|| rounded(number))
}

fn rounded(number: f64) -> f64 {
    format!("{number:.5e}").parse().unwrap_or(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_with_gaps_and_words() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("study.csv");
        let text = "variant,dx [m],\"peak, of all [N]\",empty\n# comment\na,0.1,NaN,\nb,0.123456789,5,\n";
        std::fs::write(&path, text).unwrap();
        let mut tables = PageTables::default();
        tables.file(&path, "study").unwrap();
        let columns = &tables.tables[0].columns;
        let heads: Vec<[&str; 2]> = columns.iter().map(|c| [c.name.as_str(), c.unit.as_str()]).collect();
        assert_eq!(heads, [["dx", "m"], ["peak, of all", "N"]]);
        assert_eq!(columns[0].data, [Some(0.1), Some(0.123457)]);
        assert_eq!(columns[1].data, [None, Some(5.0)]);
        std::fs::write(&path, "a,b\n1\n").unwrap();
        let error = tables.file(&path, "study").unwrap_err().to_string();
        assert!(error.contains("study.csv is not a valid CSV table"), "{error}");
        assert!(tables.file(&folder.path().join("none.csv"), "none").is_err());
    }

    #[test]
    fn long_tables_are_thinned_and_pages_end() {
        let mut tables = PageTables::default();
        let rows = || (0..10_001).map(f64::from).collect::<Vec<f64>>();
        for name in 0..30 {
            let columns =
                [("x", rows()), ("y", rows())].map(|(name, data)| (name.into(), String::new(), data));
            tables.push(&name.to_string(), columns.into());
        }
        let data = &tables.tables[0].columns[0].data;
        assert_eq!((data.len() <= ROWS + 1, data.last()), (true, Some(&Some(10_000.0))));
        assert_eq!(tables.tables.len() + tables.left_out.len(), 30);
        assert!(!tables.left_out.is_empty() && tables.numbers <= NUMBERS);
    }
}
