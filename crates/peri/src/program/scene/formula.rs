//! Formulas of scenes: functions of position (`x`, `y`, `z`, m) or time (`t`, s), in SI units.
//!
//! They have sums, products, powers (`^`), brackets, `pi`, and the functions of [`FormulaFunction`]. A
//! formula is evaluated together with its exact rate, by dual numbers.

use harness::scene::{SceneError, Source};
use serde::Deserialize;
use std::f64::consts::PI;

/// Largest length of a formula, which bounds the depth of recursion.
const LONGEST: usize = 500;

/// A parsed formula.
#[derive(Clone, Debug, PartialEq)]
pub struct Formula {
    text: String,
    root: FormulaNode,
}

#[derive(Clone, Debug, PartialEq)]
enum FormulaNode {
    Number(f64),
    /// `x`, `y`, `z` or `t`, by its index in [`VARIABLES`].
    Variable(usize),
    Binary(char, Box<[FormulaNode; 2]>),
    Call(FormulaFunction, Vec<FormulaNode>),
}

const VARIABLES: [char; 4] = ['x', 'y', 'z', 't'];

#[derive(Clone, Copy, Debug, PartialEq)]
enum FormulaFunction {
    Sin,
    Cos,
    Exp,
    Sqrt,
    Abs,
    Min,
    Max,
    Hypot,
    Atan2,
}

impl FormulaFunction {
    const ALL: [(&str, Self, usize); 9] = [
        ("sin", Self::Sin, 1),
        ("cos", Self::Cos, 1),
        ("exp", Self::Exp, 1),
        ("sqrt", Self::Sqrt, 1),
        ("abs", Self::Abs, 1),
        ("min", Self::Min, 2),
        ("max", Self::Max, 2),
        ("hypot", Self::Hypot, 2),
        ("atan2", Self::Atan2, 2),
    ];
}

/// A value and its rate.
type Dual = [f64; 2];

impl Formula {
    /// Parses a formula.
    ///
    /// # Errors
    /// The text found, its position, and what is allowed.
    pub fn parse(text: &str) -> Result<Self, String> {
        if text.len() > LONGEST {
            return Err(format!("found a formula of {} characters; allowed: up to {LONGEST}", text.len()));
        }
        let mut parser = Parser { text, at: 0 };
        let root = parser.sum()?;
        match parser.peek() {
            None => Ok(Self { text: text.to_owned(), root }),
            Some(_) => Err(parser.error("an operator, or the end")),
        }
    }

    /// Returns the value at a position.
    pub fn value_at<const D: usize>(&self, place: [f64; D]) -> f64 {
        self.value_at_time(place, 0.0)
    }

    /// Returns the value at a position and a time.
    pub fn value_at_time<const D: usize>(&self, place: [f64; D], time: f64) -> f64 {
        let mut values = [[0.0; 2], [0.0; 2], [0.0; 2], [time, 0.0]];
        for (value, x) in values.iter_mut().zip(place) {
            value[0] = x;
        }
        eval(&self.root, &values)[0]
    }

    /// Returns the value and the rate at a time.
    pub fn value_and_rate(&self, time: f64) -> (f64, f64) {
        let [value, rate] = eval(&self.root, &[[0.0; 2], [0.0; 2], [0.0; 2], [time, 1.0]]);
        (value, rate)
    }

    /// Returns the first variable that is not `allowed`.
    pub fn find_variable_except(&self, allowed: &str) -> Option<char> {
        fn find(node: &FormulaNode, allowed: &str) -> Option<char> {
            match node {
                FormulaNode::Number(_) => None,
                FormulaNode::Variable(index) => {
                    Some(VARIABLES[*index]).filter(|&name| !allowed.contains(name))
                }
                FormulaNode::Binary(_, parts) => parts.iter().find_map(|part| find(part, allowed)),
                FormulaNode::Call(_, parts) => parts.iter().find_map(|part| find(part, allowed)),
            }
        }
        find(&self.root, allowed)
    }

    /// Returns the text as written.
    pub fn text(&self) -> &str {
        &self.text
    }
}

/// Components of a vector as formulas of position and time.
#[derive(Clone, Debug)]
pub(super) struct VectorFormula<const D: usize>([Formula; D]);

impl<const D: usize> VectorFormula<D> {
    /// Checks number and variables of the components at a key.
    pub(super) fn new(source: &Source, key: &str, formulas: &[Formula]) -> Result<Self, SceneError> {
        let all = if D == 2 { "xyt" } else { "xyzt" };
        let mut each = formulas.iter().enumerate();
        if let Some((d, name)) = each.find_map(|(d, own)| Some((d, own.find_variable_except(all)?))) {
            let allowed = if D == 2 { "`x`, `y` and `t`" } else { "`x`, `y`, `z` and `t`" };
            let found = format!("`{name}` in `{}`", formulas[d].text());
            return Err(source.error(&format!("{key}[{d}]"), found, allowed));
        }
        let found = format!("{} components", formulas.len());
        let each = formulas.to_vec().try_into();
        each.map(Self).map_err(|_| source.error(key, found, format!("{D} components")))
    }

    /// Refuses values that are not finite: at all positions at five times up to `end`, s, at the first and
    /// the last one at each of `moments`, s.
    pub(super) fn check(
        &self,
        source: &Source,
        key: &str,
        places: &[[f64; D]],
        (end, moments): (f64, &[f64]),
    ) -> Result<(), SceneError> {
        let quarters = [0.0, 0.25, 0.5, 0.75, 1.0].map(|part| part * end);
        let at_all = places.iter().map(|place| (place, &quarters[..]));
        let ends = places.first().into_iter().chain(places.last());
        for (place, times) in at_all.chain(ends.map(|place| (place, moments))) {
            for &time in times {
                let place = *place;
                let value = self.value(place, time);
                if let Some(d) = value.iter().position(|x| !x.is_finite()) {
                    let found = format!("{} of `{}` at {place:?} m and {time} s", value[d], self.0[d].text());
                    let allowed = "a finite value at every particle and time";
                    return Err(source.error(&format!("{key}[{d}]"), found, allowed));
                }
            }
        }
        Ok(())
    }

    /// Returns the vector at a position and a time.
    pub(super) fn value(&self, place: [f64; D], time: f64) -> [f64; D] {
        self.0.each_ref().map(|formula| formula.value_at_time(place, time))
    }
}

fn eval(node: &FormulaNode, values: &[Dual; 4]) -> Dual {
    match node {
        FormulaNode::Number(value) => [*value, 0.0],
        FormulaNode::Variable(index) => values[*index],
        FormulaNode::Binary(sign, parts) => {
            let [[a, da], [b, db]] = [eval(&parts[0], values), eval(&parts[1], values)];
            match sign {
                '+' => [a + b, da + db],
                '-' => [a - b, da - db],
                '*' => [a * b, da * b + a * db],
                '/' => [a / b, (da * b - a * db) / (b * b)],
                _ => {
                    let value = a.powf(b);
                    // a constant exponent is also valid for bases up to 0
                    let base = if da == 0.0 { 0.0 } else { b * a.powf(b - 1.0) * da };
                    [value, if db == 0.0 { base } else { base + value * a.ln() * db }]
                }
            }
        }
        FormulaNode::Call(function, parts) => {
            let [a, da] = eval(&parts[0], values);
            let second = parts.get(1).map_or([0.0; 2], |part| eval(part, values));
            let [b, db] = second;
            match function {
                FormulaFunction::Sin => [a.sin(), a.cos() * da],
                FormulaFunction::Cos => [a.cos(), -a.sin() * da],
                FormulaFunction::Exp => [a.exp(), a.exp() * da],
                FormulaFunction::Sqrt => [a.sqrt(), if da == 0.0 { 0.0 } else { 0.5 * da / a.sqrt() }],
                FormulaFunction::Abs => [a.abs(), if a < 0.0 { -da } else { da }],
                FormulaFunction::Min => {
                    if b < a {
                        second
                    } else {
                        [a, da]
                    }
                }
                FormulaFunction::Max => {
                    if b > a {
                        second
                    } else {
                        [a, da]
                    }
                }
                FormulaFunction::Hypot => {
                    let length = a.hypot(b);
                    [length, if length == 0.0 { 0.0 } else { (a * da + b * db) / length }]
                }
                FormulaFunction::Atan2 => {
                    let square = a * a + b * b;
                    [a.atan2(b), if square == 0.0 { 0.0 } else { (b * da - a * db) / square }]
                }
            }
        }
    }
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
}

impl Parser<'_> {
    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.at..];
        let space = rest.len() - rest.trim_start().len();
        self.at += space;
        self.text[self.at..].chars().next()
    }

    fn accept(&mut self, sign: char) -> bool {
        let found = self.peek() == Some(sign);
        self.at += if found { sign.len_utf8() } else { 0 };
        found
    }

    fn error(&mut self, what: &str) -> String {
        let found =
            self.peek().map_or("the end".to_owned(), |c| format!("`{c}` at character {}", self.at + 1));
        format!("found {found} in the formula `{}`; allowed: {what}", self.text)
    }

    fn sum(&mut self) -> Result<FormulaNode, String> {
        let mut left = self.product()?;
        loop {
            let sign = match self.peek() {
                Some(sign @ ('+' | '-')) => sign,
                _ => return Ok(left),
            };
            self.at += 1;
            left = FormulaNode::Binary(sign, Box::new([left, self.product()?]));
        }
    }

    fn product(&mut self) -> Result<FormulaNode, String> {
        let mut left = self.signed()?;
        loop {
            let sign = match self.peek() {
                Some(sign @ ('*' | '/')) => sign,
                _ => return Ok(left),
            };
            self.at += 1;
            left = FormulaNode::Binary(sign, Box::new([left, self.signed()?]));
        }
    }

    /// Parses a sign and a power: −a^b is −(a^b).
    fn signed(&mut self) -> Result<FormulaNode, String> {
        if self.accept('-') {
            return Ok(FormulaNode::Binary('-', Box::new([FormulaNode::Number(0.0), self.signed()?])));
        }
        let base = self.atom()?;
        if self.accept('^') {
            return Ok(FormulaNode::Binary('^', Box::new([base, self.signed()?])));
        }
        Ok(base)
    }

    fn atom(&mut self) -> Result<FormulaNode, String> {
        let what = "a number, `x`, `y`, `z`, `t`, `pi`, a function or a bracket";
        match self.peek() {
            Some('(') => {
                self.at += 1;
                let inner = self.sum()?;
                if self.accept(')') { Ok(inner) } else { Err(self.error("`)`")) }
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_ascii_alphabetic() => self.name(),
            _ => Err(self.error(what)),
        }
    }

    fn number(&mut self) -> Result<FormulaNode, String> {
        let rest = &self.text[self.at..];
        let mut end = rest.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(rest.len());
        if let Some(exponent) = rest[end..].strip_prefix(['e', 'E']) {
            let sign = usize::from(exponent.starts_with(['+', '-']));
            let digits = exponent[sign..].chars().take_while(char::is_ascii_digit).count();
            end += if digits > 0 { 1 + sign + digits } else { 0 };
        }
        match rest[..end].parse::<f64>() {
            Ok(value) if value.is_finite() => {
                self.at += end;
                Ok(FormulaNode::Number(value))
            }
            _ => Err(self.error("a finite number")),
        }
    }

    fn name(&mut self) -> Result<FormulaNode, String> {
        let rest = &self.text[self.at..];
        let end = rest.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(rest.len());
        let name = &rest[..end];
        if name == "pi" {
            self.at += end;
            return Ok(FormulaNode::Number(PI));
        }
        if let Some(index) = VARIABLES.iter().position(|v| name.chars().eq([*v])) {
            self.at += end;
            return Ok(FormulaNode::Variable(index));
        }
        let Some(&(_, function, count)) = FormulaFunction::ALL.iter().find(|(known, _, _)| *known == name)
        else {
            let known: Vec<&str> = FormulaFunction::ALL.iter().map(|(name, _, _)| *name).collect();
            return Err(self.error(&format!("`x`, `y`, `z`, `t`, `pi`, {}", known.join(", "))));
        };
        self.at += end;
        let mut parts = Vec::new();
        for index in 0..count {
            if !self.accept(if index == 0 { '(' } else { ',' }) {
                return Err(self.error(if index == 0 { "`(`" } else { "`,` and a second argument" }));
            }
            parts.push(self.sum()?);
        }
        if self.accept(')') { Ok(FormulaNode::Call(function, parts)) } else { Err(self.error("`)`")) }
    }
}

impl<'de> Deserialize<'de> for Formula {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        Self::parse(&String::deserialize(from)?).map_err(serde::de::Error::custom)
    }
}

impl schemars::JsonSchema for Formula {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Formula".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "a formula of x, y, z (m) or t (s), in SI units: \"0.001*y\"",
            "type": "string",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values() {
        let place = [0.3, -0.7, 2.0];
        let [x, y, z] = place;
        for (text, value) in [
            ("1 - 2 - 3", -4.0),
            ("2^3^2", 512.0),
            ("-x^2", -x * x),
            ("2*-x", -2.0 * x),
            ("1.5e-3*y/z", 1.5e-3 * y / z),
            ("(x + y)*z", (x + y) * z),
            ("sin(pi*x) + cos(y)", (PI * x).sin() + y.cos()),
            ("hypot(x, y)*atan2(y, x)", x.hypot(y) * y.atan2(x)),
            ("max(x, y) - min(x, y) + abs(y) + sqrt(z) + exp(0)", 1.7 + 2.0_f64.sqrt() + 1.0),
            ("2e", f64::NAN),
        ] {
            match Formula::parse(text) {
                Ok(formula) => assert!((formula.value_at(place) - value).abs() < 1e-15, "{text}"),
                Err(_) => assert!(value.is_nan(), "{text}"),
            }
        }
    }

    /// Rates against central differences.
    #[test]
    fn rates() {
        for text in
            ["t^3 - 2*t", "sin(3*t)/t", "exp(-t)*sqrt(t)", "2^t", "hypot(t, 1)", "atan2(t, 2)", "min(t/2, 1)"]
        {
            let formula = Formula::parse(text).unwrap();
            let (time, step) = (0.8, 1e-5);
            let difference = (formula.value_and_rate(time + step).0 - formula.value_and_rate(time - step).0)
                / (2.0 * step);
            assert!((formula.value_and_rate(time).1 - difference).abs() < 1e-8, "{text}");
        }
        let pulse = Formula::parse("(1 - cos(2*pi*min(t/2, 1)))/2").unwrap();
        assert_eq!(pulse.value_and_rate(3.0).1, 0.0, "after its end");
    }

    #[test]
    fn what_is_refused() {
        for (text, part) in [
            ("", "found the end"),
            ("2 +", "found the end"),
            ("2 x", "found `x` at character 3"),
            ("(1", "allowed: `)`"),
            ("sinh(x)", "allowed: `x`, `y`, `z`, `t`, `pi`, sin"),
            ("min(1)", "a second argument"),
            ("1e999", "a finite number"),
            ("1..2", "a finite number"),
            ("3 §", "found `§`"),
        ] {
            let error = Formula::parse(text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
        assert!(Formula::parse(&"(".repeat(100_000)).unwrap_err().contains("up to 500"));
        assert!(Formula::parse(&"(".repeat(500)).is_err());
        let formula = Formula::parse("0.1*x + t").unwrap();
        assert_eq!(
            (formula.find_variable_except("xyz"), formula.find_variable_except("xt")),
            (Some('t'), None)
        );
    }
}
