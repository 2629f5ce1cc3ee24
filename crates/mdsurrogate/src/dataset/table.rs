//! Tables of text, packed (gzip) or not, with the place of each cell.

use crate::Error;
use crate::error::nearest;
use flate2::Crc;
use flate2::read::MultiGzDecoder;
use polycore::units::Stress;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// A larger text is refused: no table of this kind, but perhaps a bomb.
pub(super) const LARGEST: u64 = 2 << 30;

/// Headings and rows of a CSV file.
pub(super) struct Table {
    pub path: PathBuf,
    /// Bytes and checksum of the file, for provenance.
    pub fingerprint: String,
    /// Name, and unit in square brackets if there is one.
    pub headings: Vec<(String, Option<String>)>,
    records: Vec<csv::StringRecord>,
}

/// A column that was looked up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column(usize);

impl Table {
    pub fn read(path: &Path) -> Result<Self, Error> {
        let mut packed = Vec::new();
        File::open(path)
            .and_then(|file| file.take(LARGEST + 1).read_to_end(&mut packed))
            .map_err(Error::io("read", path))?;
        let mut crc = Crc::new();
        crc.update(&packed);
        let fingerprint = format!("{} bytes, CRC-32 {:08x}", packed.len(), crc.sum());
        let gzip = packed.starts_with(&[0x1f, 0x8b]);
        let mut text = Vec::new();
        if gzip {
            let unpack = MultiGzDecoder::new(&packed[..]).take(LARGEST + 1).read_to_end(&mut text);
            unpack.map_err(|error| {
                Error::file(
                    path,
                    format!("a gzip file that is truncated or damaged after {} bytes ({error})", text.len()),
                    "a complete gzip file",
                )
            })?;
        } else {
            text = packed;
        }
        if text.len() as u64 > LARGEST {
            return Err(Error::file(path, "more than 2 GiB of text", "tables up to 2 GiB"));
        }
        if text.iter().all(u8::is_ascii_whitespace) {
            return Err(Error::file(path, "an empty file", "a CSV table with a line of headings"));
        }
        let fail =
            |error: csv::Error| Error::file(path, error, "a CSV table, all rows as long as the headings");
        let mut reader =
            csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(&text[..]);
        let headings = reader.headers().map_err(fail)?.iter().map(heading).collect();
        let records = reader.records().collect::<Result<Vec<_>, _>>().map_err(fail)?;
        if records.is_empty() {
            return Err(Error::file(path, "headings without rows", "at least one row"));
        }
        Ok(Self { path: path.to_path_buf(), fingerprint, headings, records })
    }

    pub fn rows(&self) -> usize {
        self.records.len()
    }

    pub fn has(&self, name: &str) -> bool {
        self.find(name).is_some()
    }

    pub fn find(&self, name: &str) -> Option<Column> {
        self.headings.iter().position(|(other, _)| other == name).map(Column)
    }

    /// All of these columns; one that is missing is not likened to another of them.
    pub fn columns<const N: usize>(&self, names: [String; N]) -> Result<[Column; N], Error> {
        let mut columns = [Column(0); N];
        for (column, name) in columns.iter_mut().zip(&names) {
            let others = self.headings.iter().map(|(other, _)| other).filter(|other| !names.contains(other));
            *column = self.find(name).ok_or_else(|| Error::MissingColumn {
                path: self.path.clone(),
                column: name.clone(),
                similar: nearest(name, others.map(String::as_str)),
            })?;
        }
        Ok(columns)
    }

    pub fn text(&self, row: usize, column: Column) -> &str {
        self.records[row].get(column.0).unwrap_or_default()
    }

    pub fn line(&self, row: usize) -> u64 {
        self.records[row].position().map_or(0, csv::Position::line)
    }

    /// A finite number.
    pub fn number(&self, row: usize, column: Column) -> Result<f64, Error> {
        let text = self.text(row, column);
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.cell(row, column, "a finite number")),
        }
    }

    pub fn numbers<const N: usize>(&self, row: usize, columns: &[Column; N]) -> Result<[f64; N], Error> {
        let mut numbers = [0.0; N];
        for (number, &column) in numbers.iter_mut().zip(columns) {
            *number = self.number(row, column)?;
        }
        Ok(numbers)
    }

    pub fn cell(&self, row: usize, column: Column, allowed: &str) -> Error {
        let text = self.text(row, column);
        Error::Cell {
            path: self.path.clone(),
            line: self.line(row),
            column: self.headings[column.0].0.clone(),
            found: if text.is_empty() { "an empty cell".into() } else { format!("`{text}`") },
            allowed: allowed.to_owned(),
        }
    }

    /// Pa in one unit of a column: that of its heading (`S11 [GPa]`), else `default`.
    pub fn stress_unit(&self, column: Column, default: f64) -> Result<f64, Error> {
        let (name, unit) = &self.headings[column.0];
        let Some(unit) = unit else { return Ok(default) };
        let one = format!("1 {unit}").parse::<Stress>().map_err(|error| Error::Cell {
            path: self.path.clone(),
            line: 1,
            column: name.clone(),
            found: format!("the unit `{unit}` ({error})"),
            allowed: "a unit of stress, as in `S11 [MPa]`".into(),
        })?;
        Ok(one.si())
    }
}

fn heading(text: &str) -> (String, Option<String>) {
    match text.strip_suffix(']').and_then(|text| text.split_once('[')) {
        Some((name, unit)) => (name.trim().to_owned(), Some(unit.trim().to_owned())),
        None => (text.to_owned(), None),
    }
}

/// A file's name without its folder: provenance is the same from wherever a file is read.
pub(super) fn name_of(path: &std::path::Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
