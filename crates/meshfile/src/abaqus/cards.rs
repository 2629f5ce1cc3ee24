//! Keyword lines and data lines of an input file.

use std::path::{Path, PathBuf};

use crate::error::{Error, line_error};

/// A keyword line with its parameters.
#[derive(Debug)]
pub(super) struct Card {
    /// Keyword in upper case, with single spaces.
    pub keyword: String,
    /// Parameters: names in upper case, values as written.
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
pub(super) struct DataLine<'a> {
    path: &'a Path,
    text: String,
    pub line: usize,
}

impl DataLine<'_> {
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Values between commas, without an empty last one.
    pub fn words(&self) -> Vec<&str> {
        let text = self.text.strip_suffix(',').unwrap_or(&self.text);
        text.split(',').map(str::trim).collect()
    }

    /// Returns true if the line ends with a comma.
    pub fn is_open(&self) -> bool {
        self.text.ends_with(',')
    }

    pub fn label(&self, word: &str, what: &str) -> Result<u64, Error> {
        word.parse().map_err(|_| self.error(what, word, "a whole number, 0 or more"))
    }

    /// Parses a finite number; the exponent may be written with `D`.
    pub fn number(&self, word: &str, what: &str) -> Result<f64, Error> {
        let number = word.parse().or_else(|_| word.replace(['D', 'd'], "e").parse());
        // an empty value is zero
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

/// A file being read.
struct OpenFile {
    path: PathBuf,
    bytes: Vec<u8>,
    at: usize,
    line: usize,
}

/// Reader of a file and its includes, card by card. Lines are counted through all files.
pub(super) struct Cards<'a> {
    path: &'a Path,
    files: Vec<OpenFile>,
    line: usize,
    /// First line of each section, its file, and the line in that file.
    parts: Vec<(usize, PathBuf, usize)>,
    /// Total size of all files, bytes.
    pub bytes: usize,
    fault: Option<Error>,
}

/// Largest depth of includes.
const MAX_DEPTH: usize = 10;

impl<'a> Cards<'a> {
    pub fn new(path: &'a Path, bytes: &[u8]) -> Self {
        let mut cards = Self { path, files: Vec::new(), line: 0, parts: Vec::new(), bytes: 0, fault: None };
        cards.open(path.to_path_buf(), bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).to_vec());
        cards
    }

    fn open(&mut self, path: PathBuf, bytes: Vec<u8>) {
        self.bytes += bytes.len();
        self.parts.push((self.line, path.clone(), 0));
        self.files.push(OpenFile { path, bytes, at: 0, line: 0 });
    }

    /// Lists the included files, each once.
    pub fn included(&self) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> = self.parts.iter().map(|part| part.1.clone()).collect();
        files.sort_unstable();
        files.dedup();
        files.retain(|file| file != self.path);
        files
    }

    /// Converts the line of an error to its file and line there.
    pub fn placed(&self, error: Error) -> Error {
        match error {
            Error::File { line, what, found, allowed, .. } => {
                let part = self.parts.iter().rev().find(|part| part.0 < line);
                let (path, line) = part.map_or((self.path.to_owned(), line), |(first, path, own)| {
                    (path.clone(), line - first + own)
                });
                Error::File { path, line, what, found, allowed }
            }
            other => other,
        }
    }

    /// Reads the next keyword line, skipping data lines. A parameter list that ends with a comma continues in
    /// the next line.
    pub fn next(&mut self) -> Result<Option<Card>, Error> {
        while let Some((text, line, end)) = self.peek() {
            self.move_to(line, end);
            let Some(text) = text.strip_prefix('*') else { continue };
            let text = self.with_continuation(text);
            return card(self.path, &text, line).map(Some);
        }
        self.fault.take().map_or(Ok(None), Err)
    }

    /// Reads the continuation of a keyword line.
    fn with_continuation(&mut self, text: &str) -> String {
        let mut text = text.to_owned();
        while text.ends_with(',') {
            let Some((more, line, end)) = self.line_ahead() else { break };
            if more.starts_with('*') {
                break;
            }
            self.move_to(line, end);
            text.push_str(&more);
        }
        text
    }

    /// Reads the next data line before the next keyword.
    pub fn row(&mut self) -> Option<DataLine<'a>> {
        let (text, line, end) = self.peek()?;
        if text.starts_with('*') {
            return None;
        }
        self.move_to(line, end);
        Some(DataLine { path: self.path, text, line })
    }

    /// Returns the next line of any file that is not an include, see [`Self::line_ahead`].
    fn peek(&mut self) -> Option<(String, usize, usize)> {
        loop {
            let Some((text, line, end)) = self.line_ahead() else {
                // return to the including file
                if self.files.len() < 2 || self.fault.is_some() {
                    return None;
                }
                self.files.pop();
                let outer = self.files.last()?;
                self.parts.push((self.line, outer.path.clone(), outer.line));
                continue;
            };
            let keyword = text.split(',').next().unwrap_or_default().trim();
            if !keyword.eq_ignore_ascii_case("*INCLUDE") {
                return Some((text, line, end));
            }
            self.move_to(line, end);
            let text = self.with_continuation(text.strip_prefix('*')?);
            if let Err(error) = self.include(&text, line) {
                self.fault = Some(error);
                return None;
            }
        }
    }

    fn include(&mut self, text: &str, line: usize) -> Result<(), Error> {
        let card = card(self.path, text, line)?;
        let name = card.parameter("INPUT").unwrap_or_default();
        let wrong =
            |what: &str, found: &str, allowed: &str| Err(line_error(self.path, line, what, found, allowed));
        if name.is_empty() {
            return wrong("file that is included", "", "*INCLUDE, INPUT=FILE");
        }
        if self.files.len() > MAX_DEPTH {
            return wrong("files in each other", name, "10: does one include itself?");
        }
        let path =
            self.files.last().map_or(self.path, |file| &file.path).with_file_name(name.replace('\\', "/"));
        match std::fs::read(&path) {
            Ok(bytes) => self.open(path, bytes),
            Err(error) => {
                let allowed = format!("a file beside this one ({}: {error})", path.display());
                return wrong("file that is included", name, &allowed);
            }
        }
        Ok(())
    }

    /// Returns the next line of this file that is neither empty nor a comment, its number, and its end.
    fn line_ahead(&mut self) -> Option<(String, usize, usize)> {
        loop {
            let file = self.files.last()?;
            let rest = file.bytes.get(file.at..).filter(|rest| !rest.is_empty())?;
            let length = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
            let text = rest[..length].trim_ascii();
            let end = file.at + (length + 1).min(rest.len());
            if !text.is_empty() && !text.starts_with(b"**") {
                return Some((String::from_utf8_lossy(text).into_owned(), self.line + 1, end));
            }
            self.move_to(self.line + 1, end);
        }
    }

    fn move_to(&mut self, line: usize, end: usize) {
        if let Some(file) = self.files.last_mut() {
            (file.at, file.line) = (end, file.line + line - self.line);
        }
        self.line = line;
    }
}

/// Parses a keyword with its parameters, after the `*`.
fn card(path: &Path, text: &str, line: usize) -> Result<Card, Error> {
    let mut parts = text.split(',').map(str::trim);
    let words: Vec<&str> = parts.next().unwrap_or("").split_whitespace().collect();
    let keyword = words.join(" ").to_uppercase();
    if keyword.is_empty() {
        return Err(line_error(path, line, "keyword", text, "a name after *"));
    }
    let parameters = parts.filter(|part| !part.is_empty()).map(|part| {
        let (name, value) = part.split_once('=').unwrap_or((part, ""));
        (name.trim().to_uppercase(), value.trim().trim_matches('"').to_owned())
    });
    Ok(Card { keyword, parameters: parameters.collect(), line })
}
