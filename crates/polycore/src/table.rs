//! Tables of measured numbers, as programs and laboratories write them.
//!
//! [`Table::read`] detects the layout of a file: its encoding (UTF-8, UTF-16, Latin-1), separator (tab, `;`,
//! `,`, blanks), decimal sign, the line of headings below any lines of metadata, and a row of units. Headings
//! are `name [unit]`, `name (unit)`, `name/unit` or `name` over a unit. [`Table::describe`] states the layout
//! in one line, and so does every error.
//!
//! ```
//! use polycore::table::Table;
//! use polycore::units::dimension::{StressDimension, TimeDimension};
//!
//! let text = "Operator;Smith\nTime (min);Stress\n;MPa\n0,5;1,25\n1,0;2,5\n";
//! let table = Table::parse("tests.csv", text.as_bytes().to_vec())?;
//! let [time, stress] = [table.require_column(&["time"])?, table.require_column(&["stress"])?];
//! assert_eq!(table.column::<TimeDimension>(time, None)?, [30.0, 60.0]);
//! assert_eq!(table.column::<StressDimension>(stress, None)?, [1.25e6, 2.5e6]);
//! let how = "separator `;`, decimal comma, UTF-8, headings in line 2, units in line 3";
//! assert_eq!(table.describe(&[time, stress]), format!("{how}, columns `Time (min)`, `Stress`"));
//! # Ok::<(), polycore::table::Error>(())
//! ```

mod heading;
mod layout;
mod text;

use crate::units::{Dimension, Unit};
use std::path::{Path, PathBuf};

pub use heading::{Heading, plain_unit, plainly};
pub use layout::{Decimal, Layout, Separator};

/// Error of reading a table.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}{}: {what}: found {found:?}; allowed: {allowed}", path.display(), location(*line))]
pub struct Error {
    /// The file.
    pub path: PathBuf,
    /// Line, from 1; 0 for the file as a whole.
    pub line: usize,
    /// Column, row, headings or file.
    pub what: String,
    /// Content found.
    pub found: String,
    /// Allowed content, and the layout of the table.
    pub allowed: String,
}

fn location(line: usize) -> String {
    if line == 0 { String::new() } else { format!(":{line}") }
}

/// Headings and rows.
#[derive(Clone, Debug)]
pub struct Table {
    path: PathBuf,
    /// The columns.
    pub headings: Vec<Heading>,
    layout: Layout,
    /// Lines above the headings, and comments among the rows.
    pub remarks: Vec<String>,
    /// The text of all cells, where each ends, the first of each row and one more, and the line of each row.
    cells: String,
    ends: Vec<usize>,
    firsts: Vec<usize>,
    lines: Vec<usize>,
}

impl Table {
    /// Reads a file.
    ///
    /// # Errors
    /// [`crate::Error::Io`] and what [`Table::parse`] refuses.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, crate::Error> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(crate::Error::from_io("read", path))?;
        Ok(Self::parse(path, bytes)?)
    }

    /// Parses the bytes of a file.
    ///
    /// # Errors
    /// Bytes that are no text, a table without headings, a row with another number of cells than the
    /// headings.
    pub fn parse(path: impl AsRef<Path>, bytes: Vec<u8>) -> Result<Self, Error> {
        let path = path.as_ref();
        let refuse = |line, what: &str, found: String, allowed: String| Error {
            path: path.to_path_buf(),
            line,
            what: what.to_owned(),
            found,
            allowed,
        };
        let (text, encoding) = text::decode(bytes)
            .map_err(|[found, allowed]| refuse(0, "file", found.to_owned(), allowed.to_owned()))?;
        let lines = text::lines(&text);
        let (mut layout, heads) = match Layout::detect(&lines) {
            Ok(found) => found,
            Err((line, found)) => {
                let allowed = "a line of headings above the numbers, such as `time [s],temperature [degC]`";
                return Err(refuse(line, "headings", found, allowed.to_owned()));
            }
        };
        layout.encoding = encoding;
        let width = heads.texts.len();
        let first = layout.heading_line.max(layout.unit_line.unwrap_or(0));
        let mut table = Self {
            path: path.to_path_buf(),
            headings: heading::read(&heads.texts, &heads.units),
            remarks: lines[..layout.heading_line.saturating_sub(1)].iter().map(|&l| l.to_owned()).collect(),
            layout,
            cells: String::new(),
            ends: Vec::new(),
            firsts: vec![0],
            lines: Vec::new(),
        };
        for (index, line) in lines.iter().enumerate().skip(first) {
            if line.trim().is_empty() {
                continue;
            }
            if layout::is_comment(line) {
                table.remarks.push((*line).to_owned());
                continue;
            }
            let record = table.layout.separator.record(line);
            let surplus = (width..record.len()).any(|extra| !record[extra].is_empty());
            if surplus || record.len() < heads.least {
                let found = format!("{} cells", record.len());
                let hint = table.layout.hint(&record, width);
                let allowed = format!("{width}, as the headings have{hint}; {}", table.layout);
                return Err(refuse(index + 1, "row", found, allowed));
            }
            // a line of separators alone
            if record.iter().any(|cell| !cell.is_empty()) {
                for cell in &record {
                    table.cells.push_str(cell);
                    table.ends.push(table.cells.len());
                }
                table.firsts.push(table.ends.len());
                table.lines.push(index + 1);
            }
        }
        Ok(table)
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Layout of the file.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Describes the layout and the columns used, in one line.
    pub fn describe(&self, used: &[usize]) -> String {
        let names: Vec<String> = used.iter().map(|&i| format!("`{}`", self.headings[i].text)).collect();
        let plural = if names.len() == 1 { "" } else { "s" };
        format!("{}, column{plural} {}", self.layout, names.join(", "))
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.lines.len()
    }

    /// Line of a row in the file, from 1.
    pub fn line(&self, row: usize) -> usize {
        self.lines[row]
    }

    /// First column of exactly this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.headings.iter().position(|heading| heading.name == name)
    }

    /// Columns of the first of some names that exists: an exact match or, if there is none, a match without
    /// regard to capitals, dots and dashes; single letters (t is a time, T a temperature) match only exactly.
    pub fn matching(&self, names: &[&str]) -> Vec<usize> {
        let all = |test: &dyn Fn(&Heading) -> bool| -> Vec<usize> {
            (0..self.headings.len()).filter(|&i| test(&self.headings[i])).collect()
        };
        let exact = names.iter().map(|name| all(&|heading| heading.name == *name));
        let words = names.iter().filter(|name| name.chars().count() > 1);
        let plain = words.map(|name| all(&|heading| heading.plain == plainly(name)));
        exact.chain(plain).find(|found| !found.is_empty()).unwrap_or_default()
    }

    /// Finds the only column with one of some names, the first of which appears in errors.
    ///
    /// # Errors
    /// No such column, or several.
    pub fn require_column(&self, names: &[&str]) -> Result<usize, Error> {
        let found = self.matching(names);
        match found[..] {
            [column] => Ok(column),
            _ => Err(self.refuse_headings(format!("one column `{} [unit]`", names[0]))),
        }
    }

    /// Creates an error about the headings, with all of them.
    pub fn refuse_headings(&self, allowed: impl Into<String>) -> Error {
        let texts: Vec<&str> = self.headings.iter().map(|heading| heading.text.as_str()).collect();
        let (line, found) = (self.layout.heading_line, texts.join(","));
        self.refuse(line, "headings", found, &allowed.into())
    }

    /// Creates an error, with the layout of the table.
    pub fn refuse(&self, line: usize, what: &str, found: String, allowed: &str) -> Error {
        let allowed = format!("{allowed} ({})", self.layout);
        Error { path: self.path.clone(), line, what: what.to_owned(), found, allowed }
    }

    /// Creates an error about a cell.
    pub fn refuse_cell(&self, row: usize, column: usize, allowed: &str) -> Error {
        let what = format!("column {}, `{}`", column + 1, self.headings[column].text);
        self.refuse(self.lines[row], &what, self.text(row, column).to_owned(), allowed)
    }

    /// Text of a cell, without the blanks around it.
    pub fn text(&self, row: usize, column: usize) -> &str {
        let cell = self.firsts[row] + column;
        if cell >= self.firsts[row + 1] {
            return "";
        }
        let start = cell.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.cells[start..self.ends[cell]]
    }

    /// Finite number of a cell, in the unit of its column.
    ///
    /// # Errors
    /// A cell that is blank or not a finite number.
    pub fn number(&self, row: usize, column: usize) -> Result<f64, Error> {
        let text = self.text(row, column);
        let number = self.layout.decimal.number(text).filter(|number| number.is_finite());
        number.ok_or_else(|| self.refuse_cell(row, column, &self.why_no_number(text)))
    }

    /// Reads a number, or `None` from a cell that is blank or states that there is no number (`n/a`, `-`).
    ///
    /// # Errors
    /// A cell that is neither blank nor a finite number.
    pub fn number_or_blank(&self, row: usize, column: usize) -> Result<Option<f64>, Error> {
        let blank = ["", "n/a", "na", "n.a."].contains(&self.text(row, column).to_lowercase().as_str())
            || self.text(row, column).chars().all(|c| c == '-');
        if blank { Ok(None) } else { self.number(row, column).map(Some) }
    }

    /// Refuses a column without a unit in its heading, whose numbers could be meant in several.
    ///
    /// # Errors
    /// A heading without a unit.
    pub fn require_unit(&self, column: usize, allowed: &str) -> Result<(), Error> {
        let heading = &self.headings[column];
        if heading.unit.is_some() {
            return Ok(());
        }
        let what = format!("unit of column {}, `{}`", column + 1, heading.text);
        Err(self.refuse(self.layout.heading_line, &what, "no unit".to_owned(), allowed))
    }

    /// Unit of a column: that of its heading, or `default` for headings without.
    ///
    /// # Errors
    /// A unit of another dimension than `D`, no unit if one is needed.
    pub fn unit<D: Dimension>(&self, column: usize, default: Option<&str>) -> Result<Unit<D>, Error> {
        let heading = &self.headings[column];
        let unit = heading.unit.as_deref().or(default).unwrap_or_default();
        Unit::parse(&plain_unit(unit)).map_err(|error| {
            let what = format!("unit of column {}, `{}`", column + 1, heading.text);
            let found = if unit.is_empty() { "no unit".to_owned() } else { unit.to_owned() };
            self.refuse(self.layout.heading_line, &what, found, &format!("a heading with a unit; {error}"))
        })
    }

    /// A column in SI units.
    ///
    /// # Errors
    /// As [`Table::unit`] and [`Table::number`]; numbers that are out of range in SI units.
    pub fn column<D: Dimension>(&self, column: usize, default: Option<&str>) -> Result<Vec<f64>, Error> {
        let unit = self.unit::<D>(column, default)?;
        let value = |row| {
            let number = self.number(row, column)?;
            let quantity = unit.quantity(number);
            quantity.map(|q| q.si()).map_err(|error| self.refuse_cell(row, column, &format!("{error}")))
        };
        (0..self.rows()).map(value).collect()
    }

    /// Text after a mark such as `# source:`, from the first remark that has it.
    pub fn remark(&self, mark: &str) -> Option<&str> {
        self.remarks.iter().find_map(|line| line.trim().strip_prefix(mark)).map(str::trim)
    }

    fn why_no_number(&self, text: &str) -> String {
        let again = self.headings.iter().any(|heading| !text.is_empty() && heading.text == text);
        let lower = text.trim_start_matches(['+', '-']).to_lowercase();
        let why = match self.layout.decimal {
            _ if text.is_empty() => "; the cell is blank",
            _ if again => "; a second table begins here: split the file",
            _ if lower.starts_with("nan") || lower.starts_with("inf") => "; that is not a finite number",
            Decimal::Point if Decimal::Comma.number(text).is_some() => {
                "; a decimal comma, where other cells have decimal points"
            }
            Decimal::Comma if Decimal::Point.number(text).is_some() => {
                "; a decimal point, where other cells have decimal commas"
            }
            _ if text.starts_with(|c: char| c.is_ascii_digit()) && text.ends_with(char::is_alphabetic) => {
                "; units stand in the heading, as in `time [s]`"
            }
            _ if text.matches([',', '.']).count() > 1 => "; without separators of thousands",
            _ => "",
        };
        format!("a number{why}")
    }
}

#[cfg(test)]
mod tests;
