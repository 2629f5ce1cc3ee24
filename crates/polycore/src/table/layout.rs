//! Layout of a table: separator, decimal sign, headings.

use super::heading::plain_unit;
use crate::units::is_unit;
use std::fmt;

/// Number of lines from which the layout is detected.
const SAMPLE: usize = 1000;

/// Separator of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Separator {
    /// Single character.
    Sign(char),
    /// Blanks and tabs, any number of them.
    Blanks,
}

/// Separators in order of preference.
const SEPARATORS: [Separator; 4] =
    [Separator::Sign('\t'), Separator::Sign(';'), Separator::Sign(','), Separator::Blanks];

/// Decimal sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decimal {
    /// 0.5
    Point,
    /// 0,5
    Comma,
}

/// Layout of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Separator of cells.
    pub separator: Separator,
    /// Decimal sign.
    pub decimal: Decimal,
    /// Encoding of the file.
    pub encoding: &'static str,
    /// Line of the headings, from 1.
    pub heading_line: usize,
    /// Line of the units, if they have a row of their own.
    pub unit_line: Option<usize>,
}

/// Cells of the headings and units, and the least number of cells of a row.
pub(super) struct Heads {
    pub texts: Vec<String>,
    pub units: Vec<String>,
    pub least: usize,
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.separator {
            Separator::Sign('\t') => write!(f, "separator tab")?,
            Separator::Sign(sign) => write!(f, "separator `{sign}`")?,
            Separator::Blanks => write!(f, "separated by blanks")?,
        }
        let decimal = if self.decimal == Decimal::Comma { "comma" } else { "point" };
        write!(f, ", decimal {decimal}, {}, headings in line {}", self.encoding, self.heading_line)?;
        self.unit_line.map_or(Ok(()), |line| write!(f, ", units in line {line}"))
    }
}

impl Separator {
    /// Splits a line into cells, without the blanks around them.
    pub(super) fn record(self, line: &str) -> csv::StringRecord {
        match self {
            Self::Blanks => line.split_whitespace().collect(),
            Self::Sign(sign) if line.contains('"') => {
                let mut reader = csv::ReaderBuilder::new()
                    .delimiter(u8::try_from(sign).unwrap_or(b','))
                    .has_headers(false)
                    .trim(csv::Trim::All)
                    .buffer_capacity(line.len())
                    .from_reader(line.as_bytes());
                let first = reader.records().next();
                first.and_then(Result::ok).unwrap_or_default()
            }
            Self::Sign(sign) => line.split(sign).map(str::trim).collect(),
        }
    }

    /// Splits a line of headings whose names may be several words, into as many as a row has cells if
    /// possible.
    fn headings(self, line: &str, width: usize) -> Vec<String> {
        let cells: Vec<String> = self.record(line).iter().map(str::to_owned).collect();
        if self != Self::Blanks || cells.len() == width {
            return cells;
        }
        let wide = line.trim().replace('\t', "  ");
        let apart: Vec<String> =
            wide.split("  ").map(str::trim).filter(|cell| !cell.is_empty()).map(str::to_owned).collect();
        let mut joined: Vec<String> = Vec::new();
        for cell in &cells {
            match joined.last_mut() {
                Some(last) if cell.starts_with(['(', '[']) => *last = format!("{last} {cell}"),
                _ => joined.push(cell.clone()),
            }
        }
        [joined, apart].into_iter().find(|found| found.len() == width).unwrap_or(cells)
    }

    /// Number of cells that are numbers, less twice those of several numbers that contain another separator
    /// or a blank.
    fn score(self, lines: &[(usize, &str)]) -> i64 {
        let digit = |text: &str, end: bool| {
            let letter = if end { text.chars().next_back() } else { text.chars().next() };
            letter.is_some_and(|letter| letter.is_ascii_digit())
        };
        let of = |cell: &str| {
            if is_number(cell) {
                1
            } else if cell.contains([';', ',', '\t']) && cell.contains(|c: char| c.is_ascii_digit()) {
                -2
            } else if cell
                .split_once(' ')
                .is_some_and(|(one, two)| digit(one, true) && digit(two.trim_start(), false))
            {
                -1
            } else {
                0
            }
        };
        lines.iter().map(|(_, line)| self.record(line).iter().map(of).sum::<i64>()).sum()
    }

    fn occurs(self, lines: &[(usize, &str)]) -> bool {
        let in_line = |line: &str| match self {
            Self::Sign(sign) => line.contains(sign),
            Self::Blanks => line.trim().contains(char::is_whitespace),
        };
        lines.iter().any(|(_, line)| in_line(line))
    }
}

impl Decimal {
    /// Parses a cell: digits with one decimal sign, separators of thousands only if unambiguous (both signs
    /// occur, in groups of three), an exponent.
    pub fn number(self, text: &str) -> Option<f64> {
        let start = text.trim_start_matches(['+', '-', '−']);
        if !start.starts_with(|c: char| c.is_ascii_digit() || c == '.' || c == ',') {
            return None;
        }
        let plain = |text: &str| text.replace('−', "-").parse::<f64>().ok();
        let (own, other) = if self == Self::Point { ('.', ',') } else { (',', '.') };
        if !text.contains(other) && self == Self::Point {
            return plain(text);
        }
        let (whole, rest) = text.split_once(own).unwrap_or((text, ""));
        if text.contains(other) {
            let digits = whole.trim_start_matches(['+', '-', '−']);
            let groups: Vec<&str> = digits.split(other).collect();
            let right = (1..=3).contains(&groups[0].len())
                && groups[1..].iter().all(|group| group.len() == 3)
                && text.contains(own)
                && groups.iter().all(|group| group.bytes().all(|byte| byte.is_ascii_digit()));
            if !right || rest.contains(other) {
                return None;
            }
        }
        if text.contains(own) && !rest.starts_with(|c: char| c.is_ascii_digit()) {
            return None;
        }
        plain(format!("{}.{rest}", whole.replace(other, "")).trim_end_matches('.'))
    }
}

fn is_number(cell: &str) -> bool {
    Decimal::Point.number(cell).or_else(|| Decimal::Comma.number(cell)).is_some()
}

/// Returns true if a line is a remark wherever it stands.
pub(super) fn is_comment(line: &str) -> bool {
    let line = line.trim_start();
    let percent = line.strip_prefix('%').is_some_and(|rest| rest.trim_start_matches('%').starts_with(' '));
    line.starts_with('#') || line.starts_with("//") || percent
}

/// Removes the mark of a remark.
fn uncommented(line: &str) -> &str {
    line.trim_start().trim_start_matches(['#', '%', '/']).trim()
}

impl Layout {
    /// Detects the layout of a text; returns the row that stands in place of headings if there are none.
    pub(super) fn detect(lines: &[&str]) -> Result<(Self, Heads), (usize, String)> {
        let blank = |line: &str| line.chars().all(|c| c.is_whitespace() || matches!(c, ';' | ',' | '"'));
        let written = |(_, line): &(usize, &str)| !blank(line) && !is_comment(line);
        let numbered = || lines.iter().copied().enumerate();
        let mut sample: Vec<(usize, &str)> = numbered().filter(written).take(SAMPLE).collect();
        let told = sample
            .first()
            .and_then(|(_, line)| line.trim().to_lowercase().strip_prefix("sep=")?.chars().next());
        if told.is_some() {
            sample.remove(0);
        }
        let best = || {
            let key = |(order, separator): &(usize, Separator)| {
                (separator.score(&sample), separator.occurs(&sample), std::cmp::Reverse(*order))
            };
            SEPARATORS.into_iter().enumerate().max_by_key(key).map_or(Separator::Blanks, |(_, best)| best)
        };
        let separator = told.map_or_else(best, Separator::Sign);
        let rows: Vec<csv::StringRecord> = sample.iter().map(|(_, line)| separator.record(line)).collect();
        let cells = || rows.iter().flat_map(csv::StringRecord::iter);
        let of = |decimal: Decimal| cells().filter(|cell| decimal.number(cell).is_some()).count();
        let decimal = if of(Decimal::Comma) > of(Decimal::Point) { Decimal::Comma } else { Decimal::Point };

        let pattern = |row: &csv::StringRecord| row.iter().map(is_number).collect::<Vec<bool>>();
        let patterns: Vec<Vec<bool>> = rows.iter().map(pattern).collect();
        let numeric = |i: usize| patterns[i].contains(&true);
        // rows from here on with the same pattern
        let run = |from: usize| {
            patterns[from..].iter().take_while(|row| row.contains(&true) && **row == patterns[from]).count()
        };
        let above = |i: usize| i + 1 < rows.len() && !numeric(i) && numeric(i + 1);
        let fits = |i: usize| {
            let text = sample[i].1;
            separator.headings(text, rows[i + 1].len()).len() == rows[i + 1].len()
                || is_units(&rows[i]) && i > 0 && !numeric(i - 1)
        };
        let candidates = || (0..rows.len()).filter(|&i| above(i));
        let longest = |fitting: bool| {
            let those = candidates().filter(|&i| !fitting || fits(i));
            those.max_by_key(|&i| (run(i + 1), std::cmp::Reverse(i)))
        };
        let mut layout = Self { separator, decimal, encoding: "UTF-8", heading_line: 0, unit_line: None };
        let begin = (0..rows.len()).find(|&i| numeric(i));
        let head = match longest(true) {
            Some(head) => head,
            None => {
                let first =
                    (0..rows.len()).filter(|&i| numeric(i)).max_by_key(|&i| (run(i), std::cmp::Reverse(i)));
                let remark =
                    first.and_then(|i| headed_by_remark(separator, lines, sample[i].0, rows[i].len()));
                if let Some((line, heads)) = remark {
                    layout.heading_line = line;
                    return Ok((layout, heads));
                }
                match (longest(false), begin) {
                    (Some(head), _) => head,
                    (None, None) if !rows.is_empty() => 0,
                    (None, Some(row)) => {
                        return Err((sample[row].0 + 1, rows[row].iter().collect::<Vec<_>>().join(", ")));
                    }
                    (None, None) => return Err((0, "an empty file".to_owned())),
                }
            }
        };
        let width = rows.get(head + 1).map_or(rows[head].len(), csv::StringRecord::len);
        let split = head > 0 && is_units(&rows[head]) && !numeric(head - 1) && !is_units(&rows[head - 1]);
        let (names, units) = if split { (head - 1, Some(head)) } else { (head, None) };
        layout.heading_line = sample[names].0 + 1;
        layout.unit_line = units.map(|line| sample[line].0 + 1);
        let texts = separator.headings(sample[names].1, width);
        let units = units.map(|line| aligned(separator, sample[names].1, sample[line].1, texts.len()));
        Ok((layout, Heads::new(texts, units.unwrap_or_default())))
    }

    /// Hint for a row with too many cells.
    pub(super) fn hint(&self, row: &csv::StringRecord, width: usize) -> &'static str {
        let commas = self.separator == Separator::Sign(',') && row.len() == 2 * width;
        if commas { "; a decimal comma cannot stand beside the separator `,`: export with `;`" } else { "" }
    }
}

impl Heads {
    /// Creates the headings; columns without a name at the end need not be in every row.
    fn new(texts: Vec<String>, units: Vec<String>) -> Self {
        let least = texts.iter().rposition(|text| !text.is_empty()).map_or(0, |last| last + 1);
        Self { texts, units, least }
    }
}

/// Returns true for a row of units: every cell that is not blank is one, and at least one is more than a
/// dash.
fn is_units(row: &csv::StringRecord) -> bool {
    let real = row.iter().any(|cell| is_unit(&plain_unit(cell)));
    let unit = |cell: &str| plain_unit(cell).is_empty() || is_unit(&plain_unit(cell));
    real && row.iter().all(unit)
}

/// Assigns units to the headings above them; if some headings have none, each unit belongs to the heading
/// that ends next to it.
fn aligned(separator: Separator, names: &str, units: &str, width: usize) -> Vec<String> {
    let cells: Vec<String> = separator.record(units).iter().map(str::to_owned).collect();
    if separator != Separator::Blanks || cells.len() == width {
        return cells;
    }
    let ends = |line: &str| {
        let begin = line.as_ptr() as usize;
        let end = |word: &str| line[..word.as_ptr() as usize - begin + word.len()].chars().count();
        line.split_whitespace().map(end).collect::<Vec<usize>>()
    };
    let mut found = vec![String::new(); width];
    let heads = ends(names);
    for (cell, end) in cells.into_iter().zip(ends(units)) {
        let nearest = (0..heads.len()).min_by_key(|&i| heads[i].abs_diff(end));
        if let Some(place) = nearest.and_then(|i| found.get_mut(i)) {
            *place = cell;
        }
    }
    found
}

/// Finds headings in the last remark above a row that has as many cells (`##Temp./°C;Time/min`,
/// `# strain stress`), and its line.
fn headed_by_remark(
    separator: Separator,
    lines: &[&str],
    row: usize,
    width: usize,
) -> Option<(usize, Heads)> {
    let above = (0..row).rev().filter(|&i| is_comment(lines[i]));
    let texts = |i: usize| separator.headings(uncommented(lines[i]), width);
    let good = |texts: &Vec<String>| {
        texts.len() == width && texts.iter().all(|text| !text.is_empty() && !is_number(text))
    };
    above
        .map(|i| (i + 1, texts(i)))
        .find(|(_, found)| good(found))
        .map(|(line, texts)| (line, Heads::new(texts, Vec::new())))
}
