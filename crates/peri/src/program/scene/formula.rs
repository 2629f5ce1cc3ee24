//! Formulas in scenes: a number as a function of place (`x`, `y`, `z`, m) or of time (`t`, s), in SI units.
//!
//! Sums, products, powers (`^`), brackets, `pi`, and the functions of [`Function`]. Derivatives are exact: a formula is
//! evaluated together with its rate along one direction of its variables.

use serde::Deserialize;
use std::f64::consts::PI;

/// Longer formulas are refused: each bracket nests one level deeper.
const LONGEST: usize = 500;

/// A parsed formula.
#[derive(Clone, Debug, PartialEq)]
pub struct Formula {
    text: String,
    root: Node,
}

#[derive(Clone, Debug, PartialEq)]
enum Node {
    Number(f64),
    /// `x`, `y`, `z` or `t`, by its place in [`VARIABLES`].
    Variable(usize),
    Binary(char, Box<[Node; 2]>),
    Call(Function, Vec<Node>),
}

const VARIABLES: [char; 4] = ['x', 'y', 'z', 't'];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Function {
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

impl Function {
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
    /// Reads a formula.
    ///
    /// # Errors
    /// What was found where, and what is allowed.
    pub fn parse(text: &str) -> Result<Self, String> {
        if text.len() > LONGEST {
            return Err(format!("found a formula of {} characters; allowed: up to {LONGEST}", text.len()));
        }
        let mut parser = Parser { text, at: 0 };
        let root = parser.sum()?;
        match parser.peek() {
            None => Ok(Self { text: text.to_owned(), root }),
            Some(_) => Err(parser.expected("an operator, or the end")),
        }
    }

    /// Its value at a place.
    pub fn at<const D: usize>(&self, place: [f64; D]) -> f64 {
        let mut values = [[0.0; 2]; 4];
        for (value, x) in values.iter_mut().zip(place) {
            value[0] = x;
        }
        eval(&self.root, &values)[0]
    }

    /// Its value at a time, and its rate.
    pub fn in_time(&self, time: f64) -> (f64, f64) {
        let [value, rate] = eval(&self.root, &[[0.0; 2], [0.0; 2], [0.0; 2], [time, 1.0]]);
        (value, rate)
    }

    /// The first variable in it that is none of the `allowed`.
    pub fn other_than(&self, allowed: &str) -> Option<char> {
        fn find(node: &Node, allowed: &str) -> Option<char> {
            match node {
                Node::Number(_) => None,
                Node::Variable(index) => Some(VARIABLES[*index]).filter(|&name| !allowed.contains(name)),
                Node::Binary(_, parts) => parts.iter().find_map(|part| find(part, allowed)),
                Node::Call(_, parts) => parts.iter().find_map(|part| find(part, allowed)),
            }
        }
        find(&self.root, allowed)
    }

    /// As it was written.
    pub fn text(&self) -> &str {
        &self.text
    }
}

fn eval(node: &Node, values: &[Dual; 4]) -> Dual {
    match node {
        Node::Number(value) => [*value, 0.0],
        Node::Variable(index) => values[*index],
        Node::Binary(sign, parts) => {
            let [[a, da], [b, db]] = [eval(&parts[0], values), eval(&parts[1], values)];
            match sign {
                '+' => [a + b, da + db],
                '-' => [a - b, da - db],
                '*' => [a * b, da * b + a * db],
                '/' => [a / b, (da * b - a * db) / (b * b)],
                _ => {
                    let value = a.powf(b);
                    // of a fixed exponent, also where the base is not above 0
                    let base = if da == 0.0 { 0.0 } else { b * a.powf(b - 1.0) * da };
                    [value, if db == 0.0 { base } else { base + value * a.ln() * db }]
                }
            }
        }
        Node::Call(function, parts) => {
            let [a, da] = eval(&parts[0], values);
            let second = parts.get(1).map_or([0.0; 2], |part| eval(part, values));
            let [b, db] = second;
            match function {
                Function::Sin => [a.sin(), a.cos() * da],
                Function::Cos => [a.cos(), -a.sin() * da],
                Function::Exp => [a.exp(), a.exp() * da],
                Function::Sqrt => [a.sqrt(), if da == 0.0 { 0.0 } else { 0.5 * da / a.sqrt() }],
                Function::Abs => [a.abs(), if a < 0.0 { -da } else { da }],
                Function::Min => {
                    if b < a {
                        second
                    } else {
                        [a, da]
                    }
                }
                Function::Max => {
                    if b > a {
                        second
                    } else {
                        [a, da]
                    }
                }
                Function::Hypot => {
                    let length = a.hypot(b);
                    [length, if length == 0.0 { 0.0 } else { (a * da + b * db) / length }]
                }
                Function::Atan2 => {
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

    fn takes(&mut self, sign: char) -> bool {
        let found = self.peek() == Some(sign);
        self.at += if found { sign.len_utf8() } else { 0 };
        found
    }

    fn expected(&mut self, what: &str) -> String {
        let found =
            self.peek().map_or("the end".to_owned(), |c| format!("`{c}` at character {}", self.at + 1));
        format!("found {found} in the formula `{}`; allowed: {what}", self.text)
    }

    fn sum(&mut self) -> Result<Node, String> {
        let mut left = self.product()?;
        loop {
            let sign = match self.peek() {
                Some(sign @ ('+' | '-')) => sign,
                _ => return Ok(left),
            };
            self.at += 1;
            left = Node::Binary(sign, Box::new([left, self.product()?]));
        }
    }

    fn product(&mut self) -> Result<Node, String> {
        let mut left = self.signed()?;
        loop {
            let sign = match self.peek() {
                Some(sign @ ('*' | '/')) => sign,
                _ => return Ok(left),
            };
            self.at += 1;
            left = Node::Binary(sign, Box::new([left, self.signed()?]));
        }
    }

    /// −a^b is −(a^b).
    fn signed(&mut self) -> Result<Node, String> {
        if self.takes('-') {
            return Ok(Node::Binary('-', Box::new([Node::Number(0.0), self.signed()?])));
        }
        let base = self.single()?;
        if self.takes('^') {
            return Ok(Node::Binary('^', Box::new([base, self.signed()?])));
        }
        Ok(base)
    }

    fn single(&mut self) -> Result<Node, String> {
        let what = "a number, `x`, `y`, `z`, `t`, `pi`, a function or a bracket";
        match self.peek() {
            Some('(') => {
                self.at += 1;
                let inner = self.sum()?;
                if self.takes(')') { Ok(inner) } else { Err(self.expected("`)`")) }
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_ascii_alphabetic() => self.name(),
            _ => Err(self.expected(what)),
        }
    }

    fn number(&mut self) -> Result<Node, String> {
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
                Ok(Node::Number(value))
            }
            _ => Err(self.expected("a finite number")),
        }
    }

    fn name(&mut self) -> Result<Node, String> {
        let rest = &self.text[self.at..];
        let end = rest.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(rest.len());
        let name = &rest[..end];
        if name == "pi" {
            self.at += end;
            return Ok(Node::Number(PI));
        }
        if let Some(index) = VARIABLES.iter().position(|v| name.chars().eq([*v])) {
            self.at += end;
            return Ok(Node::Variable(index));
        }
        let Some(&(_, function, count)) = Function::ALL.iter().find(|(known, _, _)| *known == name) else {
            let known: Vec<&str> = Function::ALL.iter().map(|(name, _, _)| *name).collect();
            return Err(self.expected(&format!("`x`, `y`, `z`, `t`, `pi`, {}", known.join(", "))));
        };
        self.at += end;
        let mut parts = Vec::new();
        for index in 0..count {
            if !self.takes(if index == 0 { '(' } else { ',' }) {
                return Err(self.expected(if index == 0 { "`(`" } else { "`,` and a second argument" }));
            }
            parts.push(self.sum()?);
        }
        if self.takes(')') { Ok(Node::Call(function, parts)) } else { Err(self.expected("`)`")) }
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
                Ok(formula) => assert!((formula.at(place) - value).abs() < 1e-15, "{text}"),
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
            let difference = (formula.in_time(time + step).0 - formula.in_time(time - step).0) / (2.0 * step);
            assert!((formula.in_time(time).1 - difference).abs() < 1e-8, "{text}");
        }
        let pulse = Formula::parse("(1 - cos(2*pi*min(t/2, 1)))/2").unwrap();
        assert_eq!(pulse.in_time(3.0).1, 0.0, "after its end");
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
        assert_eq!((formula.other_than("xyz"), formula.other_than("xt")), (Some('t'), None));
    }
}
