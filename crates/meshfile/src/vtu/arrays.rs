//! Arrays of VTK's XML files: text, base64 or raw bytes, compressed by zlib or not.

use super::Attributes;
use crate::error::{Error, data_error};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use std::io::Read;
use std::path::Path;

/// Encoding of the arrays of a file.
pub(super) struct ArrayEncoding<'a> {
    pub path: &'a Path,
    pub big: bool,
    /// Bytes of a number in an array header.
    pub header: usize,
    pub packed: bool,
    /// Bytes after the `_` of the appended data, and a flag for base64.
    pub appended: (&'a [u8], bool),
}

impl ArrayEncoding<'_> {
    fn wrong(&self, attributes: &Attributes, reason: &str) -> Error {
        let name = attributes.get("Name").map(String::as_str).unwrap_or_default();
        data_error(self.path, &format!("array `{name}`: {reason}"))
    }

    pub fn values(&self, attributes: &Attributes, content: &str) -> Result<Vec<f64>, Error> {
        let wrong = |reason: &str| self.wrong(attributes, reason);
        let attribute = |key: &str| attributes.get(key).map(String::as_str).unwrap_or_default();
        let bytes = match attribute("format") {
            "ascii" => {
                let number = |word: &str| {
                    word.parse().map_err(|_| wrong(&format!("found {word:?}; allowed: a number")))
                };
                return content.split_ascii_whitespace().map(number).collect();
            }
            "binary" => self.block(content.trim().as_bytes(), true),
            "appended" => {
                let offset: Option<usize> = attribute("offset").parse().ok();
                let from = offset.and_then(|offset| self.appended.0.get(offset..));
                from.and_then(|from| self.block(from, self.appended.1))
            }
            other => {
                return Err(wrong(&format!("found format {other:?}; allowed: ascii, binary, appended")));
            }
        };
        let Some(bytes) = bytes else {
            return Err(wrong("damaged or truncated"));
        };
        let kind = attribute("type");
        numbers(&bytes, kind, self.big)
            .ok_or_else(|| wrong(&format!("found type {kind:?}; allowed: Int8 … UInt64, Float32, Float64")))
    }

    /// Decodes a block of bytes after its header.
    fn block(&self, data: &[u8], base64: bool) -> Option<Vec<u8>> {
        let digits = |bytes: usize| if base64 { bytes.div_ceil(3).checked_mul(4) } else { Some(bytes) };
        // compressed arrays encode header and data separately
        let cut = |from: usize, bytes: usize| -> Option<Vec<u8>> {
            let part = data.get(from..from.checked_add(digits(bytes)?)?)?;
            let mut all = if base64 { BASE64_STANDARD.decode(part).ok()? } else { part.to_vec() };
            (all.len() >= bytes).then(|| all.truncate(bytes))?;
            Some(all)
        };
        let sizes = |bytes: &[u8]| -> Vec<usize> {
            let size = |bytes: &[u8]| {
                let fold = |size: usize, byte: &u8| size << 8 | usize::from(*byte);
                if self.big { bytes.iter().fold(0, fold) } else { bytes.iter().rev().fold(0, fold) }
            };
            bytes.chunks_exact(self.header).map(size).collect()
        };
        if !self.packed {
            let size = *sizes(&cut(0, self.header)?).first()?;
            return Some(cut(0, self.header.checked_add(size)?)?.split_off(self.header));
        }
        let blocks = *sizes(&cut(0, self.header)?).first()?;
        let header = blocks.checked_add(3)?.checked_mul(self.header)?;
        let sizes = sizes(&cut(0, header)?);
        let packed =
            cut(digits(header)?, sizes[3..].iter().try_fold(0usize, |sum, &size| sum.checked_add(size))?)?;
        let (mut rest, mut all) = (packed.as_slice(), Vec::new());
        for (block, &size) in sizes[3..].iter().enumerate() {
            let (own, behind) = rest.split_at(size);
            let whole = if block + 1 == blocks && sizes[2] > 0 { sizes[2] } else { sizes[1] };
            let before = all.len();
            flate2::read::ZlibDecoder::new(own).take(whole as u64).read_to_end(&mut all).ok()?;
            (all.len() - before == whole).then_some(())?;
            rest = behind;
        }
        Some(all)
    }
}

/// Converts bytes to numbers of a type of VTK, `Int8` to `Float64`; `None` for another type.
pub fn numbers(bytes: &[u8], kind: &str, big: bool) -> Option<Vec<f64>> {
    fn convert<const N: usize>(bytes: &[u8], big: bool, number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
        let value = |chunk: &[u8]| {
            let mut own = [0; N];
            own.copy_from_slice(chunk);
            if big {
                own.reverse();
            }
            number(own)
        };
        bytes.chunks_exact(N).map(value).collect()
    }
    Some(match kind {
        "Int8" => convert(bytes, big, |own| f64::from(i8::from_le_bytes(own))),
        "UInt8" => convert(bytes, big, |own| f64::from(u8::from_le_bytes(own))),
        "Int16" => convert(bytes, big, |own| f64::from(i16::from_le_bytes(own))),
        "UInt16" => convert(bytes, big, |own| f64::from(u16::from_le_bytes(own))),
        "Int32" => convert(bytes, big, |own| f64::from(i32::from_le_bytes(own))),
        "UInt32" => convert(bytes, big, |own| f64::from(u32::from_le_bytes(own))),
        "Int64" => convert(bytes, big, |own| i64::from_le_bytes(own) as f64),
        "UInt64" => convert(bytes, big, |own| u64::from_le_bytes(own) as f64),
        "Float32" => convert(bytes, big, |own| f64::from(f32::from_le_bytes(own))),
        "Float64" => convert(bytes, big, f64::from_le_bytes),
        _ => return None,
    })
}
