//! Tables of measured numbers: CSV whose headings are `name [unit]`, as the programs write them too.

use crate::error::Error;
use polycore::units::{Dimension, Quantity};
use std::path::Path;

/// A column that is requested.
#[derive(Clone, Copy)]
pub struct Column {
    name: &'static str,
    read: fn(&str) -> Result<f64, String>,
    example: &'static str,
    unit: &'static str,
    least: f64,
    most: f64,
}

impl Column {
    /// A column of quantities of dimension `D`.
    pub fn of<D: Dimension>(name: &'static str) -> Self {
        let read =
            |text: &str| text.parse::<Quantity<D>>().map(Quantity::si).map_err(|error| error.to_string());
        Self { name, read, example: D::EXAMPLE, unit: "", least: f64::NEG_INFINITY, most: f64::INFINITY }
    }

    /// Takes a heading without a unit in this one.
    pub fn or_unit(mut self, unit: &'static str) -> Self {
        self.unit = unit;
        self
    }

    /// Refuses numbers, in SI, outside a range.
    pub fn within(mut self, least: f64, most: f64) -> Self {
        (self.least, self.most) = (least, most);
        self
    }
}

/// Reads columns, in SI units, whatever their order and units in the file; others are passed over. Lines that begin
/// with `#` are comments.
///
/// # Errors
/// [`Error::File`] with line and column for a file that cannot be read, a missing or repeated column, a row of another
/// length, what is no finite number or not of the column's dimension, a number out of its range, and no row at all.
pub fn read<const N: usize>(path: &Path, columns: [Column; N]) -> Result<[Vec<f64>; N], Error> {
    read_with_lines(path, columns).map(|(data, _)| data)
}

/// As [`read`], with the line of each row, from 1.
///
/// # Errors
/// As [`read`].
pub fn read_with_lines<const N: usize>(
    path: &Path,
    columns: [Column; N],
) -> Result<([Vec<f64>; N], Vec<usize>), Error> {
    let text = std::fs::read_to_string(path).map_err(polycore::Error::io("read", path))?;
    let fail = |line: u64, what: String, found: &str, allowed: String| Error::File {
        path: path.to_path_buf(),
        line: usize::try_from(line).unwrap_or(0),
        what,
        found: found.to_owned(),
        allowed,
    };
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .flexible(true)
        .from_reader(text.as_bytes());
    let header =
        reader.headers().map_err(|error| fail(1, "header".into(), &error.to_string(), "CSV".into()))?;
    let header = header.clone();
    let line = line_of(&text, header.position());
    let mut places = [(); N].map(|()| (0, String::new()));
    for (column, place) in columns.iter().zip(&mut places) {
        let heads: Vec<(usize, String)> = header
            .iter()
            .enumerate()
            .filter_map(|(index, heading)| {
                let (name, unit) = heading.split_once('[').unwrap_or((heading, ""));
                let unit = unit.trim_end_matches(']').trim();
                let unit = if unit.is_empty() { column.unit } else { unit };
                (name.trim() == column.name).then(|| (index, unit.to_owned()))
            })
            .collect();
        let allowed = format!("one column `{} [unit]`, with numbers like {}", column.name, column.example);
        let found = header.iter().collect::<Vec<_>>().join(",");
        let [head] = <[_; 1]>::try_from(heads).map_err(|_| fail(line, "header".into(), &found, allowed))?;
        *place = head;
    }
    let (mut data, mut lines) = ([(); N].map(|()| Vec::new()), Vec::new());
    for record in reader.records() {
        let record = record.map_err(|error| fail(0, "row".into(), &error.to_string(), "CSV".into()))?;
        let line = line_of(&text, record.position());
        if record.len() != header.len() {
            let found = format!("{} cells", record.len());
            return Err(fail(line, "row".into(), &found, format!("{}, as the header has", header.len())));
        }
        for ((column, (index, unit)), data) in columns.iter().zip(&places).zip(&mut data) {
            let cell = &record[*index];
            let what = format!("column {}, `{}`", index + 1, &header[*index]);
            let number = (column.read)(format!("{cell} {unit}").trim());
            let number = number.map_err(|why| fail(line, what.clone(), cell, format!("a number; {why}")))?;
            if !(column.least..=column.most).contains(&number) {
                let allowed = format!("{} to {} (SI)", column.least, column.most);
                return Err(fail(line, what, cell, allowed));
            }
            data.push(number);
        }
        lines.push(usize::try_from(line).unwrap_or(0));
    }
    if data.iter().any(Vec::is_empty) {
        return Err(fail(line, "table".into(), "no row", "at least one row of numbers".into()));
    }
    Ok((data, lines))
}

/// The line of a record, from 1; the reader counts comments and blank lines before it as its own.
fn line_of(text: &str, position: Option<&csv::Position>) -> u64 {
    let Some(position) = position else { return 1 };
    let rest = usize::try_from(position.byte()).ok().and_then(|byte| text.get(byte..)).unwrap_or("");
    let skipped = rest.lines().take_while(|line| line.trim().is_empty() || line.starts_with('#')).count();
    position.line() + skipped as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use polycore::units::dimension::{RatioDimension, TemperatureDimension, TimeDimension};

    fn of(text: &str) -> Result<[Vec<f64>; 3], String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        std::fs::write(&path, text).unwrap();
        let columns = [
            Column::of::<TimeDimension>("time"),
            Column::of::<TemperatureDimension>("temperature"),
            Column::of::<RatioDimension>("alpha").within(0.0, 1.0),
        ];
        read(&path, columns).map_err(|error| error.to_string())
    }

    #[test]
    fn units_of_the_heading() {
        let found =
            of("# source: none\nalpha,note,time [min],temperature [degC]\n0.5,x,2,20\n0,y,3,-10\n").unwrap();
        assert_eq!(found, [vec![120.0, 180.0], vec![293.15, 263.15], vec![0.5, 0.0]]);
        let found = of("time [s] , temperature [K], alpha [%]\n1,300,50\n").unwrap();
        assert_eq!(found, [vec![1.0], vec![300.0], vec![0.5]]);
    }

    #[test]
    fn refusals_name_file_line_and_column() {
        let good = "time [s],temperature [degC],alpha\n";
        for (text, parts) in [
            ("time [s],alpha\n", ["t.csv:1: header", "one column `temperature [unit]`"]),
            ("time [s],time [s],temperature [K],alpha\n", ["t.csv:1: header", "one column `time"]),
            (good, ["t.csv:1: table", "at least one row"]),
            ("", ["header", "one column"]),
            (&format!("{good}1,2,x\n"), ["t.csv:2: column 3, `alpha`: found \"x\"", "a number"]),
            (&format!("{good}1,20,0.5\n# c\n1,-300,0.5\n"), ["t.csv:4: column 2", "below absolute zero"]),
            (&format!("{good}1,20,1.5\n"), ["found \"1.5\"", "0 to 1"]),
            (&format!("{good}nan,20,0.5\n"), ["t.csv:2: column 1", "not a finite number"]),
            (&format!("{good}1,20\n"), ["t.csv:2: row", "3, as the header has"]),
            ("time,temperature [K],alpha\n1,2,0\n", ["t.csv:2: column 1, `time`", "has no unit"]),
            ("time [m],temperature [K],alpha\n1,2,0\n", ["t.csv:2: column 1", "a time is needed"]),
        ] {
            let error = of(text).unwrap_err();
            assert!(parts.iter().all(|part| error.contains(part)), "{error}");
        }
        let columns = [Column::of::<TimeDimension>("time")];
        assert!(
            read(Path::new("/no/such.csv"), columns)
                .unwrap_err()
                .to_string()
                .contains("cannot read /no/such.csv")
        );
    }
}
