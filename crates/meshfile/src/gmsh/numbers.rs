//! Numbers of an MSH file, as text or binary, in the same order.

use std::path::Path;

use crate::error::{Error, line_error};

/// Encoding of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum NumberEncoding {
    Text,
    /// Bytes per size, and true for little-endian order.
    Binary {
        width: usize,
        little: bool,
    },
}

/// Versions of the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Version {
    /// 2.0 to 2.2.
    Two,
    /// 4.0.
    Four,
    /// 4.1.
    FourOne,
}

/// Reader of numbers.
pub(super) struct Numbers<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
    /// Line of the last text; for binary numbers that of the text before them.
    line: usize,
    /// Number of bytes whose line ends are counted already.
    counted: usize,
    form: NumberEncoding,
}

impl<'a> Numbers<'a> {
    pub fn new(path: &'a Path, bytes: &'a [u8]) -> Self {
        Self { path, bytes, at: 0, line: 1, counted: 0, form: NumberEncoding::Text }
    }

    pub fn line(&self) -> u32 {
        u32::try_from(self.line).unwrap_or(u32::MAX)
    }

    pub fn error(&self, what: &str, found: impl ToString, allowed: impl Into<String>) -> Error {
        let what = match self.form {
            NumberEncoding::Text => what.to_owned(),
            NumberEncoding::Binary { .. } => format!("{what}, byte {}", self.at),
        };
        line_error(self.path, self.line, what, found, allowed)
    }

    /// Reads `$MeshFormat`: a version, 0 or 1 (binary), bytes per size; in binary also the number 1 in the
    /// file's byte order.
    pub fn header(&mut self) -> Result<Version, Error> {
        let mut line = self.text_line();
        // comments may precede it
        while line.trim().is_empty() && self.at < self.bytes.len() || line.trim() == "$Comments" {
            if line.trim() == "$Comments" {
                self.skip("Comments")?;
            }
            line = self.text_line();
        }
        if line.trim_start_matches('\u{feff}').trim() != "$MeshFormat" {
            let advice = if line.trim() == "$NOD" { ": this is format 1" } else { "" };
            return Err(self.error(
                "first line",
                line,
                format!("$MeshFormat{advice} (versions 2 and 4 are read)"),
            ));
        }
        let line = self.text_line();
        let words: Vec<&str> = line.split_whitespace().collect();
        let allowed = "2, 2.1, 2.2, 4, 4.0 or 4.1, then 0 (ASCII) or 1 (binary), then 4 or 8 (in Gmsh: \
                       Mesh.MshFileVersion = 4.1)";
        let [version, form @ ("0" | "1"), width @ ("4" | "8")] = words[..] else {
            return Err(self.error("version, form, bytes of a size", line, allowed));
        };
        let version = match version {
            "2" | "2.0" | "2.1" | "2.2" => Version::Two,
            "4" | "4.0" => Version::Four,
            "4.1" => Version::FourOne,
            _ => return Err(self.error("version, form, bytes of a size", line, allowed)),
        };
        if form == "1" {
            let width = if width == "4" { 4 } else { 8 };
            let one = self.take::<4>("the number 1")?;
            let little = match one {
                [1, 0, 0, 0] => true,
                [0, 0, 0, 1] => false,
                _ => return Err(self.error("the number 1", format!("{one:?}"), "1 in either byte order")),
            };
            self.form = NumberEncoding::Binary { width, little };
        }
        self.end("MeshFormat")?;
        Ok(version)
    }

    /// Reads the name after the next `$`; `None` at the end of the file.
    pub fn section(&mut self) -> Result<Option<String>, Error> {
        loop {
            if self.at >= self.bytes.len() {
                return Ok(None);
            }
            let line = self.text_line();
            match line.trim() {
                "" => {}
                text => match text.strip_prefix('$') {
                    Some(name) if !name.is_empty() => return Ok(Some(name.to_owned())),
                    _ => return Err(self.error("section", text, "$ and a name")),
                },
            }
        }
    }

    /// Reads the end of a section, after its numbers.
    pub fn end(&mut self, section: &str) -> Result<(), Error> {
        let expected = format!("$End{section}");
        loop {
            if self.at >= self.bytes.len() {
                return Err(self.error("section", "end of file", expected));
            }
            let line = self.text_line();
            match line.trim() {
                "" => {}
                text if text == expected => return Ok(()),
                text => return Err(self.error("end of a section", text, expected)),
            }
        }
    }

    /// Skips an unused section.
    pub fn skip(&mut self, section: &str) -> Result<(), Error> {
        let end = format!("$End{section}");
        while self.at < self.bytes.len() {
            // binary numbers may contain line ends, and directly precede the keyword
            if self.text_line().trim_end().ends_with(&end) {
                return Ok(());
            }
        }
        Err(self.error("section", "end of file", end))
    }

    /// Reads the rest of a line as text; empty at the end of the file.
    pub fn text_line(&mut self) -> String {
        self.count_lines();
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
        self.at += (length + 1).min(rest.len());
        String::from_utf8_lossy(&rest[..length]).into_owned()
    }

    /// Reads a signed number, four bytes in binary.
    pub fn int(&mut self, what: &str) -> Result<i64, Error> {
        match self.form {
            NumberEncoding::Text => {
                let word = self.word();
                word.parse().map_err(|_| self.error(what, word, "a whole number"))
            }
            NumberEncoding::Binary { little, .. } => {
                let bytes = self.take::<4>(what)?;
                Ok(i64::from(if little { i32::from_le_bytes(bytes) } else { i32::from_be_bytes(bytes) }))
            }
        }
    }

    /// Reads a count, or a tag of nodes and elements.
    pub fn size(&mut self, what: &str) -> Result<u64, Error> {
        match self.form {
            NumberEncoding::Text => {
                let word = self.word();
                word.parse().map_err(|_| self.error(what, word, "a whole number, 0 or more"))
            }
            NumberEncoding::Binary { width: 4, little } => {
                let bytes = self.take::<4>(what)?;
                Ok(u64::from(if little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) }))
            }
            NumberEncoding::Binary { little, .. } => {
                let bytes = self.take::<8>(what)?;
                Ok(if little { u64::from_le_bytes(bytes) } else { u64::from_be_bytes(bytes) })
            }
        }
    }

    /// Returns true for binary numbers.
    pub fn is_binary(&self) -> bool {
        self.form != NumberEncoding::Text
    }

    /// Reads the four counts at the start of `$Nodes` and `$Elements`.
    pub fn four_sizes(&mut self) -> Result<[u64; 4], Error> {
        let mut sizes = [0; 4];
        for (size, what) in
            sizes.iter_mut().zip(["number of blocks", "number of all", "least tag", "greatest tag"])
        {
            *size = self.size(what)?;
        }
        Ok(sizes)
    }

    pub fn double(&mut self, what: &str) -> Result<f64, Error> {
        match self.form {
            NumberEncoding::Text => {
                let word = self.word();
                word.parse().map_err(|_| self.error(what, word, "a number"))
            }
            NumberEncoding::Binary { little, .. } => {
                let bytes = self.take::<8>(what)?;
                Ok(if little { f64::from_le_bytes(bytes) } else { f64::from_be_bytes(bytes) })
            }
        }
    }

    /// Reads the next word of text; empty at the end of the file.
    fn word(&mut self) -> &'a str {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
        self.count_lines();
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += length;
        std::str::from_utf8(&rest[..length]).unwrap_or("bytes that are not text")
    }

    fn count_lines(&mut self) {
        let passed = &self.bytes[self.counted..self.at];
        self.line += passed.iter().filter(|byte| **byte == b'\n').count();
        self.counted = self.at;
    }

    fn take<const N: usize>(&mut self, what: &str) -> Result<[u8; N], Error> {
        let rest = &self.bytes[self.at..];
        let Some(bytes) = rest.first_chunk::<N>() else {
            return Err(self.error(what, "end of file", format!("{N} bytes")));
        };
        self.at += N;
        Ok(*bytes)
    }
}
