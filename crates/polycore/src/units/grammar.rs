//! The grammar of `NUMBER UNIT`.
//!
//! ```text
//! unit    = ["/"] product { "/" factor }          a product after "/" needs brackets
//! product = factor { ("*" | "·" | space) factor }
//! factor  = (symbol | "1" | "(" product { "/" factor } ")") [ power ]
//! power   = ["^"] integer | superscript digits
//! ```

use super::{Exponents, UnitError, table};

/// Largest power of a unit; keeps exponents far from overflow.
const LARGEST_POWER: i32 = 12;
/// Deepest nesting of brackets.
const DEEPEST_NESTING: usize = 8;
/// Longest text of a unit, characters.
const LONGEST_UNIT: usize = 200;

/// Splits `2e-3 N/mm^2` into the number and the trimmed rest.
pub(super) fn split_number(text: &str) -> Result<(f64, &str), UnitError> {
    let trimmed = text.trim();
    if trimmed.is_empty() {
        return Err(UnitError::Empty);
    }
    let bytes = trimmed.as_bytes();
    let digits = |mut at: usize| {
        while bytes.get(at).is_some_and(u8::is_ascii_digit) {
            at += 1;
        }
        at
    };
    let sign = usize::from(matches!(bytes[0], b'+' | b'-'));
    let mut end = digits(sign);
    if bytes.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    // an `e` is an exponent only if digits follow: `2 eV` is a unit
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let from = end + 1 + usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let to = digits(from);
        if to > from {
            end = to;
        }
    }
    if bytes.get(end) == Some(&b',') {
        return Err(UnitError::NoNumber { text: trimmed.into(), hint: "; write decimals with a point" });
    }
    match trimmed[..end].parse::<f64>() {
        Ok(number) => Ok((number, trimmed[end..].trim_start())),
        Err(_) => {
            let word = trimmed.trim_start_matches(['+', '-']).to_lowercase();
            if word.starts_with("nan") || word.starts_with("inf") {
                return Err(UnitError::Range { text: trimmed.into(), problem: "is not a finite number" });
            }
            Err(UnitError::NoNumber { text: trimmed.into(), hint: "" })
        }
    }
}

/// Numerator and denominator factors to SI, and the dimension, of a unit expression. Kept apart because
/// powers of ten are exact where their inverses are not. An empty text is the unit 1.
pub(super) fn unit(unit: &str, whole: &str) -> Result<(f64, f64, Exponents), UnitError> {
    let mut reader = UnitParser { rest: unit, whole, depth: 0 };
    if unit.is_empty() {
        return Ok((1.0, 1.0, [0; 8]));
    }
    if unit.len() > LONGEST_UNIT {
        return Err(reader.problem("too long"));
    }
    let value = reader.expression()?;
    match reader.peek() {
        None => Ok((value.numerator, value.denominator, value.exponents)),
        Some(c) => Err(reader.problem(format!("unexpected `{c}`"))),
    }
}

#[derive(Clone, Copy)]
struct UnitValue {
    numerator: f64,
    denominator: f64,
    exponents: Exponents,
}

struct UnitParser<'a> {
    rest: &'a str,
    whole: &'a str,
    depth: usize,
}

impl UnitParser<'_> {
    fn expression(&mut self) -> Result<UnitValue, UnitError> {
        let mut value = UnitValue { numerator: 1.0, denominator: 1.0, exponents: [0; 8] };
        let mut divided = self.peek() == Some('/');
        if !divided {
            value = self.factor()?;
        }
        loop {
            match self.peek() {
                Some('/') => {
                    divided = true;
                    self.advance();
                    let factor = self.factor()?;
                    value = self.multiply(value, factor, -1)?;
                }
                None | Some(')') => return Ok(value),
                Some(c) => {
                    if divided {
                        return Err(
                            self.problem("a product after `/` is ambiguous; use brackets, as in `J/(kg K)`")
                        );
                    }
                    if matches!(c, '*' | '·' | '⋅' | '×') {
                        self.advance();
                    }
                    let factor = self.factor()?;
                    value = self.multiply(value, factor, 1)?;
                }
            }
        }
    }

    fn factor(&mut self) -> Result<UnitValue, UnitError> {
        let base = match self.peek() {
            Some('(') => {
                self.depth += 1;
                if self.depth > DEEPEST_NESTING {
                    return Err(self.problem("too many brackets"));
                }
                self.advance();
                let inside = self.expression()?;
                if self.peek() != Some(')') {
                    return Err(self.problem("a bracket is not closed"));
                }
                self.advance();
                self.depth -= 1;
                inside
            }
            Some('1') => {
                self.advance();
                UnitValue { numerator: 1.0, denominator: 1.0, exponents: [0; 8] }
            }
            Some(c) if is_symbol(c) => self.symbol()?,
            Some(c) => return Err(self.problem(format!("unexpected `{c}`"))),
            None => return Err(self.problem("it ends where a unit is needed")),
        };
        match self.power()? {
            1 => Ok(base),
            power => {
                let one = UnitValue { numerator: 1.0, denominator: 1.0, exponents: [0; 8] };
                self.multiply(one, base, power)
            }
        }
    }

    fn symbol(&mut self) -> Result<UnitValue, UnitError> {
        let end = self.rest.find(|c| !is_symbol(c)).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        if table::affine(word).is_some() {
            return Err(UnitError::affine(self.whole.trim(), word));
        }
        let Some(([numerator, denominator], exponents)) = table::symbol(word) else {
            let suggestion = table::nearest(word);
            return Err(UnitError::Unknown { unit: word.into(), text: self.whole.trim().into(), suggestion });
        };
        self.rest = rest;
        Ok(UnitValue { numerator, denominator, exponents })
    }

    /// The power after a symbol or bracket; 1 if there is none.
    fn power(&mut self) -> Result<i32, UnitError> {
        let superscript = |c: char| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().position(|s| s == c);
        let ascii: String;
        if let Some(rest) = self.rest.strip_prefix("**").or_else(|| self.rest.strip_prefix('^')) {
            let end =
                rest.find(|c: char| !(c.is_ascii_digit() || c == '-' || c == '+')).unwrap_or(rest.len());
            ascii = rest[..end].to_owned();
            self.rest = &rest[end..];
        } else {
            let is_superscript = |c: char| superscript(c).is_some() || c == '⁻';
            let end = self.rest.find(|c| !is_superscript(c)).unwrap_or(self.rest.len());
            let translate = |c| superscript(c).map_or("-".to_owned(), |digit| digit.to_string());
            ascii = self.rest[..end].chars().map(translate).collect();
            self.rest = &self.rest[end..];
            if ascii.is_empty() {
                // `mm2`: the digit follows the symbol directly
                if let Some(digit) = self.rest.chars().next().filter(char::is_ascii_digit) {
                    return Err(self.problem(format!("write powers with `^`, as in `^{digit}`")));
                }
                return Ok(1);
            }
        }
        match ascii.parse::<i32>() {
            Ok(power) if power != 0 && power.abs() <= LARGEST_POWER => Ok(power),
            _ => Err(self.problem(format!(
                "a power is a whole number from -{LARGEST_POWER} to {LARGEST_POWER} but not 0, found \
                 `{ascii}`"
            ))),
        }
    }

    fn multiply(&self, a: UnitValue, b: UnitValue, power: i32) -> Result<UnitValue, UnitError> {
        let (up, down) = if power > 0 { (b.numerator, b.denominator) } else { (b.denominator, b.numerator) };
        let size = power.abs();
        let mut exponents = a.exponents;
        for (sum, &exponent) in exponents.iter_mut().zip(&b.exponents) {
            let wide = i32::from(*sum) + i32::from(exponent) * power;
            if wide.abs() > LARGEST_POWER {
                return Err(self.problem("its powers are too large"));
            }
            *sum = wide as i8;
        }
        Ok(UnitValue {
            numerator: a.numerator * up.powi(size),
            denominator: a.denominator * down.powi(size),
            exponents,
        })
    }

    /// The next character that is not a space.
    fn peek(&mut self) -> Option<char> {
        self.rest = self.rest.trim_start();
        self.rest.chars().next()
    }

    fn advance(&mut self) {
        let mut characters = self.rest.chars();
        characters.next();
        self.rest = characters.as_str();
    }

    fn problem(&self, problem: impl Into<String>) -> UnitError {
        UnitError::Grammar { text: self.whole.trim().into(), problem: problem.into() }
    }
}

fn is_symbol(c: char) -> bool {
    c.is_alphabetic() || matches!(c, '°' | '%' | '‰' | '℃' | '℉')
}
