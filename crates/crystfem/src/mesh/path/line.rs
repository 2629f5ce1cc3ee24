//! Lines of G-code: commands with their words, macros of firmwares, comments.

/// A command: `G1 X10`, or by name (`START_PRINT BED=60`).
#[derive(Clone, Debug, PartialEq)]
pub(super) enum GcodeCommand<'a> {
    /// Letter, number, and the words after them.
    Code(char, f64, Words),
    /// Words alone, which repeat the last move.
    Again(Words),
    /// Any other command: its first word, and the rest.
    Named(&'a str, &'a str),
}

/// Letters with their numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Words {
    all: Vec<(char, f64)>,
    /// First invalid text, which ends the words.
    pub wrong: Option<String>,
}

impl Words {
    /// Number of a letter; the last if repeated.
    pub fn value(&self, letter: char) -> Option<f64> {
        self.all.iter().rev().find(|word| word.0 == letter).map(|word| word.1)
    }
}

/// Splits off the comment after `;`, and removes comments in parentheses and the checksum.
pub(super) fn split(text: &str) -> (String, Option<&str>) {
    let mut depth = 0;
    let mut code = String::new();
    for (at, c) in text.char_indices() {
        match c {
            ';' if depth == 0 => return (code, Some(&text[at + 1..])),
            '*' if depth == 0 => break,
            '(' => depth += 1,
            ')' if depth > 0 => depth -= 1,
            c if depth == 0 => code.push(c),
            _ => {}
        }
    }
    let comment = text.find(';').filter(|_| depth == 0).map(|at| &text[at + 1..]);
    (code, comment)
}

/// Splits a line without comments into commands: one, or several that begin with G or M after a G.
pub(super) fn commands(code: &str) -> Vec<GcodeCommand<'_>> {
    let code = without_number(code.trim());
    let Some(first) = code.chars().next().filter(|first| *first != '%') else { return Vec::new() };
    let head = code.find(|c: char| !(c.is_ascii_alphanumeric() || "_.".contains(c))).unwrap_or(code.len());
    let after = code[first.len_utf8()..].trim_start();
    let number = after.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
    if !first.is_ascii_alphabetic() || !number || code[..head].contains('_') {
        let end = code.find(char::is_whitespace).unwrap_or(code.len());
        return vec![GcodeCommand::Named(&code[..end], code[end..].trim())];
    }
    let words = words(code);
    let upper = first.to_ascii_uppercase();
    if "XYZEFIJR".contains(upper) {
        return vec![GcodeCommand::Again(words)];
    }
    let mut all: Vec<GcodeCommand> = Vec::new();
    for (letter, number) in words.all {
        match all.last_mut() {
            // no G code has a parameter M or G
            Some(GcodeCommand::Code('G', _, own)) if !"GM".contains(letter) => own.all.push((letter, number)),
            Some(GcodeCommand::Code(of, _, own)) if *of != 'G' => own.all.push((letter, number)),
            _ => all.push(GcodeCommand::Code(letter, number, Words::default())),
        }
    }
    match all.last_mut() {
        Some(GcodeCommand::Code(_, _, own)) => own.wrong = words.wrong,
        // the number itself is invalid
        _ => return vec![GcodeCommand::Again(Words { all: Vec::new(), wrong: words.wrong })],
    }
    all
}

/// Removes a line number `N10`.
fn without_number(code: &str) -> &str {
    let Some(rest) = code.strip_prefix(['N', 'n']) else { return code };
    let digits = rest.trim_start().trim_start_matches(|c: char| c.is_ascii_digit());
    if digits.len() < rest.trim_start().len() { digits.trim_start() } else { code }
}

/// Parses letters with their numbers, with or without spaces; 0 for a letter alone (`G28 X`).
fn words(text: &str) -> Words {
    let mut words = Words::default();
    let mut rest = text;
    while let Some(letter) = rest.chars().next() {
        let after = rest[letter.len_utf8()..].trim_start();
        let end = after.find(|c: char| !(c.is_ascii_digit() || "+-.".contains(c))).unwrap_or(after.len());
        let number = if end == 0 { Ok(0.0) } else { after[..end].parse() };
        match number {
            Ok(number) if letter.is_ascii_alphabetic() && f64::is_finite(number) => {
                words.all.push((letter.to_ascii_uppercase(), number));
            }
            _ => {
                words.wrong = Some(rest.to_owned());
                break;
            }
        }
        rest = after[end..].trim_start();
    }
    words
}

/// Parses `KEY=VALUE` words of a macro, with keys in upper case.
pub(super) fn keys(rest: &str) -> impl Iterator<Item = (String, &str)> {
    rest.split_whitespace()
        .filter_map(|word| word.split_once('='))
        .map(|(key, value)| (key.to_ascii_uppercase(), value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_every_dialect() {
        let told = |text: &str| -> Vec<String> {
            let (code, _) = split(text);
            let one = |command: &GcodeCommand| match command {
                GcodeCommand::Code(letter, number, words) => format!("{letter}{number} {:?}", words.all),
                GcodeCommand::Again(words) => format!("again {:?} {:?}", words.all, words.wrong),
                GcodeCommand::Named(name, rest) => format!("{name} | {rest}"),
            };
            commands(&code).iter().map(one).collect()
        };
        for (text, found) in [
            ("N10 G1 X10 ; right*", vec!["G1 [('X', 10.0)]"]),
            ("g1x10y-.5e1.25*71", vec!["G1 [('X', 10.0), ('Y', -0.5), ('E', 1.25)]"]),
            ("G21 G90 (mm) M83", vec!["G21 []", "G90 []", "M83 []"]),
            ("M104 T1 S150", vec!["M104 [('T', 1.0), ('S', 150.0)]"]),
            ("X10 Y2", vec!["again [('X', 10.0), ('Y', 2.0)] None"]),
            ("START_PRINT BED_TEMP=60", vec!["START_PRINT | BED_TEMP=60"]),
            ("GET_POSITION", vec!["GET_POSITION | "]),
            ("G1_PURGE A=1", vec!["G1_PURGE | A=1"]),
            ("Tx", vec!["Tx | "]),
            ("T?", vec!["T? | "]),
            ("M862.3 P \"MK3S\"", vec!["M862.3 [('P', 0.0)]"]),
            ("%", vec![]),
            ("@pause", vec!["@pause | "]),
            ("{if x}", vec!["{if | x}"]),
        ] {
            assert_eq!(told(text), found, "{text}");
        }
        assert_eq!(split("G1 X1 (a;b) ;TYPE:Skirt"), ("G1 X1  ".to_owned(), Some("TYPE:Skirt")));
        assert_eq!(split("G1 E1*71 ;c"), ("G1 E1".to_owned(), Some("c")));
    }
}
