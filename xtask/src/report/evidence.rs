//! What a verdict rests on: quantities that cases are judged by, or numbers that tests assert.

use std::fs;

use miette::{Result, miette};
use serde::{Deserialize, Serialize};

use crate::validate::outcome::Outcome;
use crate::workspace::Workspace;

/// A quantity of a case, as named in cases/thesis.toml.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Number {
    /// One that the case has an `[[expect]]` of, unless `judged` is false.
    pub quantity: String,
    /// False for a number that is only shown: a loading of which the thesis prints no figure.
    #[serde(default = "yes")]
    pub judged: bool,
    /// In words, with its unit.
    pub what: String,
    /// Another case than that of the row.
    pub case: Option<String>,
    /// The thesis' own figure, where it prints one.
    pub thesis: Option<String>,
}

fn yes() -> bool {
    true
}

/// A test that asserts a number.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Asserted {
    /// `crates/peri/src/calibrate.rs`.
    pub file: String,
    /// The function's name.
    pub test: String,
    /// What its body says of the number.
    pub holds: String,
    /// In words, with its unit.
    pub what: String,
    /// The number for a reader.
    pub number: String,
}

/// A row of numbers: what it is, what was found, what was asked for, how that ended.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// In words.
    pub what: String,
    /// As found.
    pub value: String,
    /// What the case asks for.
    pub asked: String,
    /// The thesis' figure, if any.
    pub thesis: String,
    /// Where from: a case's quantity, or a test.
    pub from: String,
    /// How it ended.
    pub state: State,
}

/// How a number was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// By this run, within its tolerance.
    Met,
    /// By this run; nothing is asked of it.
    Found,
    /// By this run, outside its tolerance; or the case failed.
    Missed,
    /// Not in this run.
    NotRun,
    /// By a test of `cargo xtask test`.
    Asserted,
}

impl Number {
    /// Looks it up in what was run.
    pub fn find(&self, row: Option<&str>, outcomes: &[Outcome]) -> Finding {
        let case = self.case.as_deref().or(row).unwrap_or_default();
        let from = format!("{case}: {}", self.quantity);
        let empty = |state, value: &str| Finding {
            what: self.what.clone(),
            value: value.to_owned(),
            asked: String::new(),
            thesis: self.thesis.clone().unwrap_or_default(),
            from: from.clone(),
            state,
        };
        let Some(outcome) = outcomes.iter().find(|outcome| outcome.case == case) else {
            return empty(State::NotRun, "not in this run");
        };
        if !self.judged {
            return match outcome.scalar(&self.quantity) {
                Some(value) => empty(State::Found, &value),
                None => empty(State::NotRun, "not in this tier"),
            };
        }
        let judged: Vec<_> = outcome.expect().iter().filter(|j| j.expect.quantity == self.quantity).collect();
        let Some(last) = judged.last() else {
            return match &outcome.failure {
                Some(failure) => empty(State::Missed, failure),
                None => empty(State::NotRun, "not in this tier"),
            };
        };
        let [_, _, value, _, _] = last.row();
        let asked: Vec<String> = judged.iter().map(|judgement| judgement.row()[3].clone()).collect();
        let met = judged.iter().all(|judgement| judgement.pass) && outcome.failure.is_none();
        let unit = outcome.unit(&self.quantity);
        let value = if unit.is_empty() { value } else { format!("{value} {unit}") };
        let state = if met { State::Met } else { State::Missed };
        Finding { asked: asked.join(", "), ..empty(state, &value) }
    }
}

impl Asserted {
    /// The number, as the test asserts it.
    pub fn finding(&self) -> Finding {
        Finding {
            what: self.what.clone(),
            value: self.number.clone(),
            asked: String::new(),
            thesis: String::new(),
            from: format!("test {} in {}", self.test, self.file),
            state: State::Asserted,
        }
    }

    /// The test exists and says so.
    pub fn check(&self, workspace: &Workspace) -> Result<()> {
        let text = fs::read_to_string(workspace.root().join(&self.file))
            .map_err(|error| miette!("{}: {error}", self.file))?;
        let body =
            body(&text, &self.test).ok_or_else(|| miette!("{}: no test `{}`", self.file, self.test))?;
        if body.contains(&self.holds) {
            Ok(())
        } else {
            Err(miette!("{}: the test `{}` does not say `{}`", self.file, self.test, self.holds))
        }
    }
}

/// The text of a function or a table of a test, up to the bracket that closes it in its own column.
pub fn body<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let start = text.find(&format!("fn {name}(")).or_else(|| text.find(&format!("const {name}: ")))?;
    let line = text[..start].rfind('\n').map_or(0, |at| at + 1);
    let indent = text[line..start].chars().take_while(|letter| *letter == ' ').count();
    let close = |bracket: char| text[start..].find(&format!("\n{}{bracket}", " ".repeat(indent)));
    let end = ['}', ']'].into_iter().filter_map(close).min().map_or(text.len(), |at| start + at);
    Some(&text[start..end])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_of_functions() {
        let text = "mod tests {\n    fn a() {\n        if x {\n        }\n        1.5\n    }\n    fn b() {\n    2.5 }\n}\n\
                    const T: [f64; 1] = [\n    7.5,\n];\n8.5";
        assert!(body(text, "a").is_some_and(|body| body.contains("1.5") && !body.contains("2.5")));
        assert!(body(text, "T").is_some_and(|body| body.contains("7.5") && !body.contains("8.5")));
        assert_eq!(body(text, "c"), None);
    }
}
