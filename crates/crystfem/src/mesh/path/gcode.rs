//! A reader of G-code.

use std::collections::BTreeMap;
use std::path::Path;

use super::printer::Printer;
use super::{Command, Setting, ToolPath, error};
use crate::error::Error;

/// 0 °C, K.
const CELSIUS: f64 = 273.15;

/// Reads a G-code file: G0 and G1 with X, Y, Z, E, F; arcs G2 and G3 in the XY plane with I and J or R, in chords that
/// are 0.01 mm from the arc at most; G4 (wait), G20 and G21 (inch, mm), G28 (home), G90 and G91, M82 and M83 (absolute, relative),
/// G92 (here is …), M104 and M109, M140 and M190 (temperatures; how long it is waited for them is not known, and S0, off, leaves the last one), M106 and M107
/// (fan). A move lays material down if E grows along it and it goes across. Velocity is F all along a move;
/// [`ToolPath::accelerated`] limits acceleration. Other commands are passed over and noted.
///
/// # Errors
/// [`Error::Shared`] where the file cannot be read; [`Error::File`] with the line for words that are no numbers, a move
/// before any F, an F that is not positive, arcs without a centre or radius that fits, other curves (G5), other planes (G18,
/// G19), and temperatures below absolute zero.
pub fn read_gcode(path: &Path) -> Result<ToolPath, Error> {
    parse(path, &crate::mesh::read_bytes(path)?)
}

/// [`read_gcode`], of bytes; `path` is for messages only.
///
/// # Errors
/// See [`read_gcode`].
pub fn parse(path: &Path, bytes: &[u8]) -> Result<ToolPath, Error> {
    let mut printer = Printer::new();
    let mut path_of = ToolPath::default();
    let mut skipped: BTreeMap<String, usize> = BTreeMap::new();
    for (line, text) in (1..).zip(bytes.split(|byte| *byte == b'\n')) {
        let text = String::from_utf8_lossy(text);
        let text = without_comments(&text);
        let words = words(&text).map_err(|word| error(path, line, "word", word, "a letter and a number"))?;
        let Some((letter, number)) = words.iter().copied().find(|word| word.0 != 'N') else { continue };
        let code = format!("{letter}{number}");
        let value = |letter: char| words.iter().rev().find(|word| word.0 == letter).map(|word| word.1);
        match code.as_str() {
            "G0" | "G1" | "G2" | "G3" => {
                let arc = match code.as_str() {
                    "G2" => Some(-1.0),
                    "G3" => Some(1.0),
                    _ => None,
                };
                printer
                    .go(value, arc, &mut path_of.moves)
                    .map_err(|wrong| error(path, line, wrong.what, wrong.found_in(&text), wrong.allowed))?;
            }
            "G5" => {
                return Err(error(path, line, "command", code, "straight moves and arcs, G0 to G3"));
            }
            "G18" | "G19" => return Err(error(path, line, "command", code, "G17, arcs in the XY plane")),
            "G17" => {}
            "M104" | "M109" | "M140" | "M190" => {
                let setting =
                    if matches!(code.as_str(), "M104" | "M109") { Setting::Nozzle } else { Setting::Bed };
                // S, or R that waits for cooling too; a command without either waits
                if let Some(celsius) = value('S').or(value('R')) {
                    if celsius < -CELSIUS {
                        return Err(error(path, line, "temperature", celsius, "-273.15 °C or above"));
                    }
                    // 0 switches the heater off; how it cools is not known
                    if celsius != 0.0 {
                        let value = celsius + CELSIUS;
                        path_of.commands.push(Command { time: printer.time, setting, value });
                    }
                }
            }
            "M106" | "M107" => {
                let speed = if code == "M107" { 0.0 } else { value('S').unwrap_or(255.0) / 255.0 };
                let value = speed.clamp(0.0, 1.0);
                path_of.commands.push(Command { time: printer.time, setting: Setting::Fan, value });
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
    if !skipped.is_empty() {
        let more = skipped.len().saturating_sub(20);
        let mut names: Vec<String> =
            skipped.iter().take(20).map(|(name, count)| format!("{name} ({count})")).collect();
        if more > 0 {
            names.push(format!("{more} more"));
        }
        path_of.notes.push(format!("commands not used: {}", names.join(", ")));
    }
    path_of.rest = printer.time - path_of.moves.last().map_or(0.0, |last| last.end);
    if printer.time.is_finite() {
        Ok(path_of)
    } else {
        Err(error(path, 1, "duration", printer.time, "a finite time, s"))
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
