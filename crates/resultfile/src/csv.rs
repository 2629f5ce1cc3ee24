//! Curves as CSV: one header row `name [unit]`, then numbers that read back to the same bits.

use std::path::Path;

use polycore::Error;
use polycore::file::atomic_write;

/// A column: name, unit (empty if dimensionless), numbers.
pub type Column<'a> = (&'a str, &'a str, &'a [f64]);

/// Writes columns of equal length, whole or not at all.
///
/// # Errors
/// [`Error::Data`] if the lengths differ, [`Error::Io`] if writing fails.
pub fn write(path: impl AsRef<Path>, columns: &[Column<'_>]) -> Result<(), Error> {
    // `{:?}` is the shortest text that reads back to the same f64
    write_cells(path.as_ref(), columns, |number| format!("{number:?}"))
}

/// Writes as [`write()`], with an empty cell for NaN.
///
/// # Errors
/// As [`write()`].
pub fn write_with_gaps(path: impl AsRef<Path>, columns: &[Column<'_>]) -> Result<(), Error> {
    let cell = |number: f64| if number.is_nan() { String::new() } else { format!("{number:?}") };
    write_cells(path.as_ref(), columns, cell)
}

fn write_cells(path: &Path, columns: &[Column<'_>], cell: impl Fn(f64) -> String) -> Result<(), Error> {
    let rows = columns.first().map_or(0, |(_, _, data)| data.len());
    if let Some((name, _, data)) = columns.iter().find(|(_, _, data)| data.len() != rows) {
        let reason = format!("{} rows, but the first column has {rows}", data.len());
        return Err(Error::Data { what: format!("column `{name}` of {}", path.display()), reason });
    }
    atomic_write(path, |file| {
        let mut writer = csv::Writer::from_writer(file);
        writer.write_record(columns.iter().map(|(name, unit, _)| heading(name, unit))).map_err(plain)?;
        for row in 0..rows {
            writer.write_record(columns.iter().map(|(_, _, data)| cell(data[row]))).map_err(plain)?;
        }
        writer.flush()
    })
}

/// Reads a table of numbers: headings and columns. Lines that begin with `#` are comments.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read; [`Error::Format`] with the line for text that is not a number or
/// for rows of different lengths.
pub fn read(path: impl AsRef<Path>) -> Result<Vec<(String, Vec<f64>)>, Error> {
    let path = path.as_ref();
    let fail = |reason: String| Error::Format { path: path.to_path_buf(), format: "CSV table", reason };
    let text = std::fs::read_to_string(path).map_err(Error::from_io("read", path))?;
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let headings = reader.headers().map_err(|error| fail(error.to_string()))?;
    let mut columns: Vec<(String, Vec<f64>)> =
        headings.iter().map(|name| (name.to_owned(), Vec::new())).collect();
    for record in reader.records() {
        let record = record.map_err(|error| fail(error.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        for ((name, data), cell) in columns.iter_mut().zip(&record) {
            let number = cell
                .parse()
                .map_err(|_| fail(format!("line {line}, column `{name}`: `{cell}` is not a number")));
            data.push(number?);
        }
    }
    Ok(columns)
}

/// Returns the error of the system inside: its kind says whether there is room on the disk.
fn plain(error: csv::Error) -> std::io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => std::io::Error::other(format!("{other:?}")),
    }
}

fn heading(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_trip_keeps_the_bits() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("profile.csv");
        let x = [0.1 + 0.2, -0.0, 1e-300, f64::NAN];
        let y = [1.0, 2.5e300, f64::INFINITY, 4.0];
        write(&path, &[("x", "m", &x), ("stress, xx", "Pa", &y), ("n", "", &x)]).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text.lines().next(), Some("x [m],\"stress, xx [Pa]\",n"));
        let read = read(&path).unwrap();
        assert_eq!(read[1].0, "stress, xx [Pa]");
        assert_eq!(read[1].1, y);
        assert!(x.iter().zip(&read[0].1).all(|(a, b)| a.to_bits() == b.to_bits()));
    }

    #[test]
    fn gaps_are_empty_cells() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("line.csv");
        write_with_gaps(&path, &[("x", "m", &[0.0, 1.0]), ("u", "m", &[f64::NAN, 0.5])]).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "x [m],u [m]\n0.0,\n1.0,0.5\n");
    }

    #[test]
    fn bad_tables() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("t.csv");
        let error = write(&path, &[("x", "", &[1.0]), ("y", "", &[])]).unwrap_err();
        assert!(error.to_string().contains("column `y`") && !path.exists());
        for (text, part) in
            [("# source: x\na,b\n1,2\n3,four\n", "line 4, column `b`: `four`"), ("a,b\n1\n", "2 fields")]
        {
            std::fs::write(&path, text).unwrap();
            let error = read(&path).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
        std::fs::write(&path, "# source: x\n a , b\n 1, 2 \n").unwrap();
        assert_eq!(read(&path).unwrap(), [("a".to_owned(), vec![1.0]), ("b".to_owned(), vec![2.0])]);
        assert!(read(directory.path().join("none.csv")).is_err());
    }
}
