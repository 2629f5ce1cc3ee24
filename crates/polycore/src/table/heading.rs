//! Headings: names and units.

use crate::units::is_unit;

/// Heading of a column.
#[derive(Clone, Debug, PartialEq)]
pub struct Heading {
    /// Text of the heading in the file.
    pub text: String,
    /// Name without the unit.
    pub name: String,
    /// Name in small letters, words separated by one blank.
    pub plain: String,
    /// Unit of the heading or of the row below it; empty brackets and dashes are the unit 1, the empty text.
    pub unit: Option<String>,
}

/// Builds the headings, with the row of units if there is one.
pub(super) fn read(texts: &[String], units: &[String]) -> Vec<Heading> {
    let below = |i: usize| units.get(i).map(String::as_str).filter(|unit| !unit.is_empty());
    let heading = |(i, text): (usize, &String)| {
        let (name, own) = split(text);
        let unit = own.map(str::to_owned).or_else(|| below(i).map(|unit| bare(unit).to_owned()));
        Heading { text: text.clone(), name: name.to_owned(), plain: plainly(name), unit }
    };
    texts.iter().enumerate().map(heading).collect()
}

/// Splits `name [unit]`, `name (unit)`, `name/unit` into name and unit.
fn split(text: &str) -> (&str, Option<&str>) {
    let text = text.trim();
    if let Some((name, unit)) = text.strip_suffix(']').and_then(|text| text.rsplit_once('[')) {
        return (name.trim_end_matches(['/', ' ']), Some(bare(unit)));
    }
    // from the left, so that in `DSC/(mW/mg)` the whole bracket is the unit
    for (at, sign) in text.char_indices().filter(|(at, sign)| *at > 0 && matches!(sign, '/' | '(' | ',')) {
        let (name, rest) = (text[..at].trim(), text[at..].trim());
        let unit = match sign {
            '(' if rest.ends_with(')') => bare(rest),
            '(' => continue,
            _ => bare(rest[1..].trim()),
        };
        let known = is_unit(&plain_unit(unit)) || (sign == '(' && unit.is_empty());
        if known && !name.is_empty() {
            return (name, Some(unit));
        }
    }
    (text, None)
}

/// Removes the brackets of a unit; empty if it says that there is none.
pub(super) fn bare(unit: &str) -> &str {
    let unit = unit.trim();
    let pairs = [('[', ']'), ('(', ')'), ('<', '>'), ('{', '}')];
    let inside = pairs.iter().find_map(|&(open, close)| unit.strip_prefix(open)?.strip_suffix(close));
    match inside.unwrap_or(unit).trim() {
        "-" | "–" | "--" | "1" | "none" => "",
        unit => unit,
    }
}

/// Converts a unit as laboratories write it to the grammar of [`crate::units`].
pub fn plain_unit(unit: &str) -> String {
    let unit = bare(unit).replace(['º', '˚'], "°").replace("° C", "°C").replace('\u{a0}', " ");
    let same = match unit.to_lowercase().as_str() {
        "c" | "deg c" | "deg. c" | "celsius" | "°c" => "degC",
        "min." | "mins" | "minute" | "minutes" => "min",
        "sec." | "secs" | "second" | "seconds" => "s",
        "hours" | "hour" | "hrs" => "h",
        "percent" | "pct" | "prozent" => "%",
        "mm/mm" | "m/m" | "in/in" | "in./in." | "dimensionless" => "",
        "mpa" if unit != "mPa" => "MPa",
        "kpa" => "kPa",
        "gpa" => "GPa",
        _ => "",
    };
    if !same.is_empty() || unit.is_empty() || unit.to_lowercase().ends_with("m/mm") {
        return same.to_owned();
    }
    // `N/mm2`
    let mut text = String::with_capacity(unit.len() + 1);
    let mut before = ' ';
    for letter in unit.chars() {
        if letter.is_ascii_digit() && before.is_alphabetic() {
            text.push('^');
        }
        text.push(letter);
        before = letter;
    }
    text
}

/// Reduces a name to small letters and digits, words separated by one blank.
pub fn plainly(name: &str) -> String {
    let lower = name.to_lowercase();
    let words = lower.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join(" ")
}
