//! A small reader of G-code.

use std::collections::BTreeMap;
use std::path::Path;

use super::{Move, ToolPath, error};
use crate::error::Error;

/// Reads the moves of a G-code file: G0 and G1 with X, Y, Z, E, F; G4 (wait), G20 and G21 (inch, mm), G28 (home),
/// G90 and G91, M82 and M83 (absolute, relative), G92 (here is …). A move lays material down if E grows along it and it goes across.
/// Velocity is F all along a move, without acceleration. Other commands are passed over and noted.
///
/// # Errors
/// [`Error::Shared`] where the file cannot be read; [`Error::File`] with the line for words that are no numbers, a move
/// before any F, an F that is not positive, and moves that are not straight (G2, G3, G5).
pub fn read_gcode(path: &Path) -> Result<ToolPath, Error> {
    parse(path, &crate::mesh::read_bytes(path)?)
}

/// [`read_gcode`], of bytes; `path` is for messages only.
///
/// # Errors
/// See [`read_gcode`].
pub fn parse(path: &Path, bytes: &[u8]) -> Result<ToolPath, Error> {
    let mut printer = Printer { unit: 1e-3, ..Printer::default() };
    let mut moves = Vec::new();
    let mut skipped: BTreeMap<String, usize> = BTreeMap::new();
    for (line, text) in (1..).zip(bytes.split(|byte| *byte == b'\n')) {
        let text = String::from_utf8_lossy(text);
        let text = without_comments(&text);
        let words = words(&text).map_err(|word| error(path, line, "word", word, "a letter and a number"))?;
        let Some((letter, number)) = words.iter().copied().find(|word| word.0 != 'N') else { continue };
        let code = format!("{letter}{number}");
        let value = |letter: char| words.iter().rev().find(|word| word.0 == letter).map(|word| word.1);
        match code.as_str() {
            "G0" | "G1" => {
                if let Some(one) = printer.go(value).map_err(|found| {
                    error(path, line, "velocity F", found, "positive and finite, before or in the first move")
                })? {
                    moves.push(one);
                }
            }
            "G2" | "G3" | "G5" => {
                return Err(error(
                    path,
                    line,
                    "command",
                    code,
                    "straight moves, G0 and G1 (arc fitting off)",
                ));
            }
            // P is in ms, S in s
            "G4" => printer.time += value('S').unwrap_or(value('P').unwrap_or(0.0) * 1e-3).max(0.0),
            "G20" => printer.unit = 25.4e-3,
            "G21" => printer.unit = 1e-3,
            "G28" => printer.home(value),
            "G90" => (printer.relative, printer.relative_feed) = (false, false),
            "G91" => (printer.relative, printer.relative_feed) = (true, true),
            "M82" => printer.relative_feed = false,
            "M83" => printer.relative_feed = true,
            "G92" => printer.rename(value),
            _ => *skipped.entry(code).or_default() += 1,
        }
    }
    let mut notes = Vec::new();
    if !skipped.is_empty() {
        let more = skipped.len().saturating_sub(20);
        let mut names: Vec<String> =
            skipped.iter().take(20).map(|(name, count)| format!("{name} ({count})")).collect();
        if more > 0 {
            names.push(format!("{more} more"));
        }
        notes.push(format!("commands not used: {}", names.join(", ")));
    }
    if printer.time.is_finite() {
        Ok(ToolPath { moves, notes })
    } else {
        Err(error(path, 1, "duration", printer.time, "a finite time, s"))
    }
}

/// State of the printer; places in m as the printer counts them, with what G92 has added.
#[derive(Debug, Default)]
struct Printer {
    /// Metres per unit.
    unit: f64,
    place: [f64; 3],
    /// Names of places minus places.
    offset: [f64; 3],
    /// Filament fed, as named, in units of the file.
    feed: f64,
    relative: bool,
    relative_feed: bool,
    /// m/s; 0 before the first F.
    velocity: f64,
    time: f64,
}

impl Printer {
    /// A move; `None` where the nozzle stays. A velocity that cannot be is the error.
    fn go(&mut self, value: impl Fn(char) -> Option<f64>) -> Result<Option<Move>, f64> {
        if let Some(feed) = value('F') {
            // per minute
            self.velocity = feed * self.unit / 60.0;
            if !(self.velocity > 0.0 && self.velocity.is_finite()) {
                return Err(feed);
            }
        }
        let from = self.place;
        for (d, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            if let Some(number) = value(letter) {
                let to = number * self.unit;
                self.place[d] = if self.relative { from[d] + to } else { to - self.offset[d] };
            }
        }
        let fed = match value('E') {
            None => 0.0,
            Some(number) if self.relative_feed => number,
            Some(number) => number - self.feed,
        };
        self.feed += fed;
        let length = (0..3).map(|d| (self.place[d] - from[d]).powi(2)).sum::<f64>().sqrt();
        // filament alone takes its time too
        let way = if length > 0.0 { length } else { fed.abs() * self.unit };
        if way == 0.0 {
            return Ok(None);
        }
        if self.velocity == 0.0 {
            return Err(0.0);
        }
        let start = self.time;
        self.time += way / self.velocity;
        // filament that comes while the nozzle goes up or down alone fills it again after a retraction
        let across = self.place[0] != from[0] || self.place[1] != from[1];
        let one = Move { from, to: self.place, start, end: self.time, prints: fed > 0.0 && across };
        Ok((length > 0.0).then_some(one))
    }

    /// To zero along the axes named, or along all.
    fn home(&mut self, value: impl Fn(char) -> Option<f64>) {
        let named = ['X', 'Y', 'Z'].map(|letter| value(letter).is_some());
        for d in 0..3 {
            if named[d] || named == [false; 3] {
                self.place[d] = 0.0;
                self.offset[d] = 0.0;
            }
        }
    }

    /// G92: the place keeps, its name changes.
    fn rename(&mut self, value: impl Fn(char) -> Option<f64>) {
        for (d, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            if let Some(number) = value(letter) {
                self.offset[d] = number * self.unit - self.place[d];
            }
        }
        if let Some(number) = value('E') {
            self.feed = number;
        }
    }
}

/// Text before `;` and `*` (checksum), without what is in parentheses.
fn without_comments(text: &str) -> String {
    let mut depth = 0;
    let mut rest = String::new();
    for c in text.chars() {
        match c {
            ';' | '*' if depth == 0 => break,
            '(' => depth += 1,
            ')' if depth > 0 => depth -= 1,
            c if depth == 0 => rest.push(c),
            _ => {}
        }
    }
    rest
}

/// Letters and their numbers, spaced or not; 0 for a letter alone (`G28 X`). Text after M117 and the like ends the
/// words. What is no word is the error.
fn words(text: &str) -> Result<Vec<(char, f64)>, String> {
    let mut words = Vec::new();
    let mut rest = text.trim();
    while let Some(letter) = rest.chars().next() {
        let after = rest[letter.len_utf8()..].trim_start();
        let end = after.find(|c: char| !(c.is_ascii_digit() || "+-.".contains(c))).unwrap_or(after.len());
        let number = if end == 0 { Ok(0.0) } else { after[..end].parse() };
        match number {
            Ok(number) if letter.is_ascii_alphabetic() && f64::is_finite(number) => {
                words.push((letter.to_ascii_uppercase(), number));
            }
            _ => {
                // only the moves' own words must be right
                let first = words.iter().find(|word| word.0 != 'N');
                return match first {
                    Some(('G', _)) | None => Err(rest.to_owned()),
                    Some(_) => Ok(words),
                };
            }
        }
        rest = after[end..].trim_start();
    }
    Ok(words)
}
