//! Corners of the triangles of an STL file, text or binary.

use std::path::Path;

use crate::error::{Error, line_error};

/// Three corners of each triangle, and a note on ignored bytes.
pub(super) type Corners = (Vec<[f32; 3]>, Option<String>);

/// Reads either encoding: binary if the number of triangles in bytes 81 to 84 fits the file (as text these
/// four exceed 5e8), with any header.
///
/// # Errors
/// [`Error::File`] with the line of text, or the sizes in bytes.
pub(super) fn corners(path: &Path, bytes: &[u8]) -> Result<Corners, Error> {
    let announced = bytes.get(80..84).and_then(|four| four.try_into().ok()).map(u32::from_le_bytes);
    let needed = announced.map(|count| 84 + 50 * u64::from(count)).filter(|needed| *needed > 84);
    if let Some(needed) = needed.filter(|needed| *needed <= bytes.len() as u64) {
        let list: Vec<[f32; 3]> =
            bytes[84..needed as usize].chunks_exact(50).flat_map(triangle_corners).collect();
        if let Some(wrong) = list.iter().position(|corner| corner.iter().any(|x| !x.is_finite())) {
            let found = format!("{:?} in triangle {}", list[wrong], wrong / 3 + 1);
            return Err(line_error(path, 1, "corner of a triangle", found, "finite numbers"));
        }
        let more = bytes.len() - needed as usize;
        let note = || format!("{more} bytes after the last triangle that the header counts are left out");
        return Ok((list, (more > 0).then(note)));
    }
    let start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let word = start.trim_ascii_start().get(..5).unwrap_or(b"");
    // four characters of text are a count of at least 0x09090909
    let is_text = announced.is_none_or(|count| count >= 0x0909_0909);
    if !word.eq_ignore_ascii_case(b"solid") || !is_text {
        let found = match announced {
            Some(count) => format!("{} bytes, and bytes 81 to 84 count {count} triangles", bytes.len()),
            None => format!("{} bytes", bytes.len()),
        };
        let allowed = "text that begins with `solid`, or bytes: 84 and 50 for each triangle counted, 1 or \
                       more (a shorter file was cut off)";
        return Err(line_error(path, 1, "STL", found, allowed));
    }
    text(path, start).map(|list| (list, None))
}

/// Corners of a binary triangle, after its normal.
fn triangle_corners(bytes: &[u8]) -> [[f32; 3]; 3] {
    let number = |k: usize| bytes[4 * k..].first_chunk().map_or(f32::NAN, |four| f32::from_le_bytes(*four));
    [3, 6, 9].map(|k| [number(k), number(k + 1), number(k + 2)])
}

/// Parses text with keywords in upper or lower case, and any number of words a line.
fn text(path: &Path, bytes: &[u8]) -> Result<Vec<[f32; 3]>, Error> {
    // old programs end lines with a carriage return alone
    let end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    let (mut corners, mut begun, mut last) = (Vec::new(), 0, 1);
    for (line, text) in (1..).zip(bytes.split(|byte| *byte == end)) {
        let text = String::from_utf8_lossy(text);
        let mut words = text.split_whitespace();
        last = line;
        while let Some(word) = words.next() {
            let mut numbers = |corner: &mut [f32; 3]| {
                corner.iter_mut().all(|x| {
                    *x = words.next().map_or(f32::NAN, |word| word.parse().unwrap_or(f32::NAN));
                    x.is_finite()
                })
            };
            match word.to_lowercase().as_str() {
                "vertex" => {
                    let mut corner = [0.0; 3];
                    if !numbers(&mut corner) {
                        let allowed = "three finite numbers with decimal points";
                        return Err(line_error(path, line, "vertex", text.trim(), allowed));
                    }
                    corners.push(corner);
                }
                "facet" => begun = corners.len(),
                // normals are ignored, and some programs write nan; a name may be any words
                "normal" => _ = (words.next(), words.next(), words.next()),
                "solid" | "endsolid" => break,
                "endfacet" if corners.len() != begun + 3 => {
                    let found = corners.len() - begun;
                    return Err(line_error(path, line, "vertices of a facet", found, "3"));
                }
                "outer" | "loop" | "endloop" | "endfacet" => {}
                _ => {
                    let allowed = "solid, facet, outer loop, vertex, endloop, endfacet, endsolid";
                    return Err(line_error(path, line, "line of an STL", text.trim(), allowed));
                }
            }
        }
    }
    if corners.is_empty() || corners.len() % 3 != 0 {
        return Err(line_error(path, last, "vertices", corners.len(), "3 of each facet, 1 facet or more"));
    }
    Ok(corners)
}
