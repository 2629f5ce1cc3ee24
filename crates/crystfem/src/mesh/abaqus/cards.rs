//! Keyword lines and data lines of an input file.

use std::path::Path;

use crate::error::Error;
use crate::mesh::labelled::line_error;

/// A keyword line with its parameters.
#[derive(Debug)]
pub(super) struct Card {
    /// In upper case, single spaces inside.
    pub keyword: String,
    /// Names in upper case, values as written.
    parameters: Vec<(String, String)>,
    pub line: usize,
}

impl Card {
    /// Value of a parameter; empty for one without.
    pub fn parameter(&self, name: &str) -> Option<&str> {
        self.parameters.iter().find(|parameter| parameter.0 == name).map(|parameter| parameter.1.as_str())
    }
}

/// A data line.
pub(super) struct Row<'a> {
    path: &'a Path,
    text: String,
    pub line: usize,
}

impl Row<'_> {
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Values between commas; an empty one at the end does not count.
    pub fn words(&self) -> Vec<&str> {
        let text = self.text.strip_suffix(',').unwrap_or(&self.text);
        text.split(',').map(str::trim).collect()
    }

    /// Whether the line ends with a comma.
    pub fn is_open(&self) -> bool {
        self.text.ends_with(',')
    }

    pub fn label(&self, word: &str, what: &str) -> Result<u64, Error> {
        word.parse().map_err(|_| self.error(what, word, "a whole number, 0 or more"))
    }

    /// A finite number; the exponent may be a `D`.
    pub fn number(&self, word: &str, what: &str) -> Result<f64, Error> {
        let number = word.parse().or_else(|_| word.replace(['D', 'd'], "e").parse());
        // an empty place is zero
        let number = if word.is_empty() { Ok(0.0) } else { number };
        match number {
            Ok(number) if f64::is_finite(number) => Ok(number),
            _ => Err(self.error(what, word, "a finite number")),
        }
    }

    pub fn error(&self, what: &str, found: impl ToString, allowed: impl Into<String>) -> Error {
        line_error(self.path, self.line, what, found, allowed)
    }
}

/// The file, card by card.
pub(super) struct Cards<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
    line: usize,
}

impl<'a> Cards<'a> {
    pub fn new(path: &'a Path, bytes: &'a [u8]) -> Self {
        Self { path, bytes, at: 0, line: 0 }
    }

    /// The next keyword line; data lines before it are passed over. A parameter list that ends with a comma goes on in
    /// the next line.
    pub fn next(&mut self) -> Result<Option<Card>, Error> {
        while let Some((text, line, end)) = self.peek() {
            self.move_to(line, end);
            let Some(text) = text.strip_prefix('*') else { continue };
            let mut text = text.to_owned();
            while text.ends_with(',') {
                let Some((more, line, end)) = self.peek() else { break };
                if more.starts_with('*') {
                    break;
                }
                self.move_to(line, end);
                text.push_str(&more);
            }
            let mut parts = text.split(',').map(str::trim);
            let words: Vec<&str> = parts.next().unwrap_or("").split_whitespace().collect();
            let keyword = words.join(" ").to_uppercase();
            if keyword.is_empty() {
                return Err(line_error(self.path, line, "keyword", text, "a name after *"));
            }
            let parameters = parts.filter(|part| !part.is_empty()).map(|part| {
                let (name, value) = part.split_once('=').unwrap_or((part, ""));
                (name.trim().to_uppercase(), value.trim().trim_matches('"').to_owned())
            });
            return Ok(Some(Card { keyword, parameters: parameters.collect(), line }));
        }
        Ok(None)
    }

    /// The next data line before the next keyword.
    pub fn row(&mut self) -> Option<Row<'a>> {
        let (text, line, end) = self.peek()?;
        if text.starts_with('*') {
            return None;
        }
        self.move_to(line, end);
        Some(Row { path: self.path, text, line })
    }

    /// The next line that is neither empty nor a comment, its number, and where it ends.
    fn peek(&mut self) -> Option<(String, usize, usize)> {
        loop {
            let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
            let length = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
            let text = rest[..length].trim_ascii();
            let end = self.at + (length + 1).min(rest.len());
            if !text.is_empty() && !text.starts_with(b"**") {
                return Some((String::from_utf8_lossy(text).into_owned(), self.line + 1, end));
            }
            self.move_to(self.line + 1, end);
        }
    }

    fn move_to(&mut self, line: usize, end: usize) {
        self.line = line;
        self.at = end;
    }
}
