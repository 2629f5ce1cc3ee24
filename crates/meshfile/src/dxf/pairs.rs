//! Checks of the lines of a drawing, which the reader of the crate `dxf` leaves out where it cannot read
//! them.

use std::path::Path;

use crate::error::{Error, line_error};

/// Entities that may draw an outline.
const DRAWN: [&str; 8] = ["LINE", "ARC", "CIRCLE", "ELLIPSE", "LWPOLYLINE", "POLYLINE", "SPLINE", "INSERT"];

/// Checks codes and numbers of the entities of a drawing as text, and counts those that may draw an outline.
///
/// # Errors
/// [`Error::File`] for a line that is no code or no finite number, and for a file that does not end as
/// drawings do; [`Error::Data`] for a binary file.
pub fn count(path: &Path, bytes: &[u8]) -> Result<usize, Error> {
    if bytes.starts_with(b"AutoCAD") {
        let reason = "found a binary drawing; allowed: DXF as text (ASCII)".to_owned();
        return Err(Error::Data { path: path.to_path_buf(), reason });
    }
    let text = String::from_utf8_lossy(bytes);
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let (mut section, mut named, mut count) = ("", false, 0);
    for (number, pair) in lines.chunks_exact(2).enumerate() {
        let line = 2 * number + 1;
        let Ok(code) = pair[0].parse::<i32>() else {
            return Err(line_error(
                path,
                line,
                "code of a pair",
                pair[0],
                "a whole number, a value below it",
            ));
        };
        if named && code == 2 {
            section = pair[1];
        }
        named = (code, pair[1]) == (0, "SECTION");
        match code {
            0 if pair[1] == "EOF" => return Ok(count),
            0 => count += usize::from(section == "ENTITIES" && DRAWN.contains(&pair[1])),
            10..=59 | 210..=239
                if section == "ENTITIES" && !pair[1].parse::<f64>().is_ok_and(f64::is_finite) =>
            {
                let what = format!("value of code {code}");
                return Err(line_error(path, line + 1, what, pair[1], "a finite number"));
            }
            _ => {}
        }
    }
    Err(line_error(path, lines.len(), "end of the file", "no pair of 0 and EOF", "a whole drawing in DXF"))
}
