//! Text tables, compressed by gzip or not, with the place of each cell.

use super::lammps;
use super::options::{PROPERTIES, ReadOptions, is_sampled};
use crate::Error;
use crate::error::nearest;
use flate2::Crc;
use flate2::read::MultiGzDecoder;
use polycore::table;
use polycore::units::{Length, Stress};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Largest size of an unpacked text, bytes: larger ones may be decompression bombs.
pub(super) const LARGEST: u64 = 2 << 30;

/// Å per metre.
const METRE: f64 = 1e10;

/// Usual layout of a table, which needs no note.
const USUAL: &str = "separator `,`, decimal point, UTF-8, headings in line";

/// Rows of a file.
enum TableCells {
    /// Rows of a CSV table.
    Table(Box<table::Table>),
    /// Rows of LAMMPS output.
    Lammps(Vec<csv::StringRecord>),
}

/// Headings and rows of a file.
pub(super) struct DataTable {
    pub path: PathBuf,
    /// Bytes and checksum of the file, for the provenance.
    pub fingerprint: String,
    /// Names and units.
    pub headings: Vec<(String, Option<String>)>,
    cells: TableCells,
    /// Interpretation of LAMMPS output.
    lammps: Option<lammps::LammpsReading>,
}

/// Index of a column.
#[derive(Clone, Copy, Debug)]
pub(super) struct ColumnIndex(usize);

impl DataTable {
    /// Reads a table or LAMMPS output.
    pub fn read(path: &Path, options: &ReadOptions) -> Result<Self, Error> {
        let (text, fingerprint) = read_text(path)?;
        if let Some(kind) = lammps::kind(&text) {
            let (headings, records, origin) = lammps::read(path, &text, kind, options)?;
            let (path, cells) = (path.to_path_buf(), TableCells::Lammps(records));
            return Ok(Self { path, fingerprint, headings, cells, lammps: Some(origin) });
        }
        let read = table::Table::parse(path, text).map_err(polycore::Error::from)?;
        if read.rows() == 0 {
            return Err(Error::file(path, "headings without rows", "at least one row"));
        }
        let heading = |heading: &table::Heading| {
            let unit = heading.unit.as_ref().filter(|unit| !unit.is_empty());
            // `c_p[1]` has an index in its brackets, not a unit
            let name =
                if unit.is_none() && heading.text.ends_with(']') { &heading.text } else { &heading.name };
            (name.clone(), unit.cloned())
        };
        let headings = read.headings.iter().map(heading).collect();
        let (path, cells) = (path.to_path_buf(), TableCells::Table(Box::new(read)));
        let mut table = Self { path, fingerprint, headings, cells, lammps: None };
        table.rename(options)?;
        Ok(table)
    }

    /// Renames columns to their properties, as the options say.
    fn rename(&mut self, options: &ReadOptions) -> Result<(), Error> {
        let averaged = options.prefix();
        let mut named = Vec::new();
        for (property, name) in &options.names {
            if !PROPERTIES.contains(&property.as_str()) {
                let similar = nearest(property, PROPERTIES.into_iter());
                let allowed = similar.map_or(PROPERTIES.join(", "), |name| format!("`{name}`?"));
                return Err(Error::parameter("names", format!("`{property}`"), allowed));
            }
            let Some(ColumnIndex(column)) = self.find(name) else {
                let similar = nearest(name, self.headings.iter().map(|(other, _)| other.as_str()));
                return Err(Error::MissingColumn { path: self.path.clone(), column: name.clone(), similar });
            };
            let prefix = if is_sampled(property) { averaged } else { "" };
            named.push((column, format!("{prefix}{property}")));
        }
        for (column, name) in named {
            self.headings[column].0 = name;
        }
        Ok(())
    }

    /// Tells if LAMMPS wrote the file.
    pub fn is_lammps(&self) -> bool {
        self.lammps.is_some()
    }

    /// Returns the interpretation of LAMMPS output.
    pub fn lammps(&self) -> Option<&lammps::LammpsReading> {
        self.lammps.as_ref()
    }

    /// Returns the pressure unit of LAMMPS, Pa.
    pub fn pressure_unit(&self) -> Option<f64> {
        self.lammps.as_ref()?.units.map(|units| units.sizes()[0])
    }

    /// Locates an error at the line of a row.
    pub fn at_row(&self, row: usize, error: Error) -> Error {
        let (found, allowed) = match error {
            Error::Parameter { name, found, allowed } => (format!("{name}: {found}"), allowed),
            other => (other.to_string(), "a deformation with positive determinant".into()),
        };
        Error::file(&self.path, format!("line {}: {found}", self.line(row)), allowed)
    }

    /// Describes the layout of the file, if it is unusual.
    pub fn layout_note(&self) -> Option<String> {
        let TableCells::Table(table) = &self.cells else { return None };
        let layout = table.layout().to_string();
        (!layout.starts_with(USUAL) || layout.contains("units in line")).then_some(layout)
    }

    pub fn rows(&self) -> usize {
        match &self.cells {
            TableCells::Table(table) => table.rows(),
            TableCells::Lammps(records) => records.len(),
        }
    }

    pub fn contains(&self, name: &str) -> bool {
        self.find(name).is_some()
    }

    pub fn find(&self, name: &str) -> Option<ColumnIndex> {
        self.headings.iter().position(|(other, _)| other == name).map(ColumnIndex)
    }

    /// Returns the columns with these names; a missing name is not compared to the other names in the list.
    pub fn columns<const N: usize>(&self, names: [String; N]) -> Result<[ColumnIndex; N], Error> {
        let mut columns = [ColumnIndex(0); N];
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

    pub fn text(&self, row: usize, column: ColumnIndex) -> &str {
        match &self.cells {
            TableCells::Table(table) => table.text(row, column.0),
            TableCells::Lammps(records) => records[row].get(column.0).unwrap_or_default(),
        }
    }

    pub fn line(&self, row: usize) -> u64 {
        match &self.cells {
            TableCells::Table(table) => table.line(row) as u64,
            TableCells::Lammps(records) => records[row].position().map_or(0, csv::Position::line),
        }
    }

    /// Parses a finite number.
    pub fn number(&self, row: usize, column: ColumnIndex) -> Result<f64, Error> {
        let text = self.text(row, column);
        let number = match &self.cells {
            TableCells::Table(table) => table.layout().decimal.number(text),
            TableCells::Lammps(_) => text.parse().ok(),
        };
        number.filter(|number| number.is_finite()).ok_or_else(|| {
            let how = self.layout_note().map_or(String::new(), |how| format!(" ({how})"));
            self.cell(row, column, &format!("a finite number{how}"))
        })
    }

    pub fn numbers<const N: usize>(&self, row: usize, columns: &[ColumnIndex; N]) -> Result<[f64; N], Error> {
        let mut numbers = [0.0; N];
        for (number, &column) in numbers.iter_mut().zip(columns) {
            *number = self.number(row, column)?;
        }
        Ok(numbers)
    }

    pub fn cell(&self, row: usize, column: ColumnIndex, allowed: &str) -> Error {
        let text = self.text(row, column);
        Error::Cell {
            path: self.path.clone(),
            line: self.line(row),
            column: self.headings[column.0].0.clone(),
            found: if text.is_empty() { "an empty cell".into() } else { format!("`{text}`") },
            allowed: allowed.to_owned(),
        }
    }

    /// Returns the unit in the heading of a stress column, Pa (`S11 [GPa]`, `pxx (eV/Å³)`).
    pub fn stress_unit(&self, column: ColumnIndex) -> Result<Option<f64>, Error> {
        // `A` means Å: an ampere is no part of a stress unit
        let plain = |unit: &str| table::plain_unit(unit).replace("/A", "/Å");
        let parse = |unit: &str| format!("1 {}", plain(unit)).parse::<Stress>().map(|stress| stress.si());
        self.unit(column, parse, "a unit of stress, as in `S11 [MPa]`")
    }

    /// Returns the unit in the heading of a length column, Å.
    pub fn length_unit(&self, column: ColumnIndex) -> Result<f64, Error> {
        let plain = |unit: &str| if unit == "A" { "Å".to_owned() } else { table::plain_unit(unit) };
        let parse =
            |unit: &str| format!("1 {}", plain(unit)).parse::<Length>().map(|length| length.si() * METRE);
        Ok(self.unit(column, parse, "a unit of length, as in `lx [nm]`")?.unwrap_or(1.0))
    }

    fn unit(
        &self,
        column: ColumnIndex,
        parse: impl Fn(&str) -> Result<f64, polycore::units::UnitError>,
        allowed: &str,
    ) -> Result<Option<f64>, Error> {
        let (name, unit) = &self.headings[column.0];
        let Some(unit) = unit else { return Ok(None) };
        let line = match &self.cells {
            TableCells::Table(table) => table.layout().unit_line.unwrap_or(table.layout().heading_line),
            TableCells::Lammps(_) => 1,
        };
        let found = parse(unit).map_err(|error| Error::Cell {
            path: self.path.clone(),
            line: line as u64,
            column: name.clone(),
            found: format!("the unit `{unit}` ({error})"),
            allowed: allowed.into(),
        })?;
        Ok(Some(found))
    }
}

/// Returns the text of a file, with its bytes and checksum.
fn read_text(path: &Path) -> Result<(Vec<u8>, String), Error> {
    let mut packed = Vec::new();
    File::open(path)
        .and_then(|file| file.take(LARGEST + 1).read_to_end(&mut packed))
        .map_err(Error::from_io("read", path))?;
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
                format!("a gzip file truncated or damaged after {} bytes ({error})", text.len()),
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
        return Err(Error::file(path, "an empty file", "a CSV table with headings"));
    }
    Ok((text, fingerprint))
}
