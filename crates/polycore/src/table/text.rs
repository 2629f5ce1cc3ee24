//! Decoding of bytes to lines.

/// Decodes a text and names its encoding; otherwise returns what the file is and what to do.
pub(super) fn decode(bytes: Vec<u8>) -> Result<(String, &'static str), [&'static str; 2]> {
    const EXPORT: &str = "a text: export the sheet as CSV";
    if bytes.starts_with(b"PK\x03\x04") {
        return Err(["a packed workbook (.xlsx, .ods)", EXPORT]);
    }
    if bytes.starts_with(&[0xd0, 0xcf, 0x11, 0xe0]) {
        return Err(["a workbook or document of an old Office (.xls)", EXPORT]);
    }
    let wide = |from: usize, order: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes[from..].chunks_exact(2).map(|pair| order([pair[0], pair[1]])).collect();
        String::from_utf16_lossy(&units).trim_start_matches('\u{feff}').to_owned()
    };
    match bytes[..] {
        [0xef, 0xbb, 0xbf, ..] => return utf8(bytes[3..].to_vec(), "UTF-8 with BOM"),
        [0xff, 0xfe, ..] => return Ok((wide(2, u16::from_le_bytes), "UTF-16")),
        [0xfe, 0xff, ..] => return Ok((wide(2, u16::from_be_bytes), "UTF-16")),
        [_, 0, _, 0, ..] => return Ok((wide(0, u16::from_le_bytes), "UTF-16")),
        [0, _, 0, _, ..] => return Ok((wide(0, u16::from_be_bytes), "UTF-16")),
        _ => {}
    }
    if bytes.iter().take(1 << 12).any(|&byte| byte == 0) {
        return Err(["a binary file", "a text: export the table as CSV"]);
    }
    utf8(bytes, "UTF-8")
}

/// Decodes UTF-8, or else Latin-1, in which every byte is a character.
fn utf8(bytes: Vec<u8>, name: &'static str) -> Result<(String, &'static str), [&'static str; 2]> {
    match String::from_utf8(bytes) {
        Ok(text) => Ok((text, name)),
        Err(error) => {
            let text = error.into_bytes().iter().map(|&byte| char::from(byte)).collect();
            Ok((text, "Latin-1"))
        }
    }
}

/// Splits lines that end in LF, CR LF or CR alone.
pub(super) fn lines(text: &str) -> Vec<&str> {
    let old = !text.contains('\n') && text.contains('\r');
    if old { text.split('\r').collect() } else { text.lines().collect() }
}
