//! Rows of docs/errata.md, each with the number that proves it (cases/thesis.toml).

use std::fs;

use miette::{IntoDiagnostic, Result, WrapErr};
use serde::{Deserialize, Serialize};

use super::evidence::{CaseNumber, MeasuredNumbers, NumberRow, TestNumber, check, verdict};
use crate::workspace::Repository;

/// Proof of an erratum.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Proof {
    /// Words of the row's first two cells that no other row has.
    pub says: String,
    /// Case of the numbers.
    pub case: Option<String>,
    /// Quantities that a case expects.
    #[serde(default)]
    pub numbers: Vec<CaseNumber>,
    /// Numbers that tests measure.
    #[serde(default)]
    pub tests: Vec<TestNumber>,
}

/// Row of docs/errata.md.
pub struct Erratum {
    chapter: String,
    cells: [String; 4],
}

/// Row with its numbers.
#[derive(Serialize)]
pub struct ErratumVerdict {
    chapter: String,
    place: String,
    wrong: String,
    ours: String,
    test: String,
    findings: Vec<NumberRow>,
    verdict: &'static str,
    tone: &'static str,
}

impl Erratum {
    /// Reads all rows of docs/errata.md.
    pub fn read(workspace: &Repository) -> Result<Vec<Self>> {
        let text = fs::read_to_string(workspace.root().join("docs/errata.md"));
        Ok(parse(&text.into_diagnostic().wrap_err("docs/errata.md")?))
    }

    fn matches(&self, proof: &Proof) -> bool {
        format!("{} {}", self.cells[0], self.cells[1]).contains(&proof.says)
    }
}

/// Parses tables of four columns, below headings `## Chapter N: …`.
fn parse(text: &str) -> Vec<Erratum> {
    let (mut rows, mut chapter, mut inside) = (Vec::new(), String::new(), false);
    for line in text.lines() {
        if let Some(heading) = line.strip_prefix("## ") {
            chapter = heading.split(':').next().unwrap_or(heading).to_owned();
        }
        let table = line.starts_with('|');
        if table && inside && !line.starts_with("|---") {
            let cells = cells(line);
            if let Ok(cells) = <[String; 4]>::try_from(cells) {
                rows.push(Erratum { chapter: chapter.clone(), cells });
            }
        }
        // the first line of a table is its heading
        inside = table;
    }
    rows
}

/// Splits a row of Markdown into cells; `\|` is no separator, and other escapes are removed.
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut cell, mut escaped) = (Vec::new(), String::new(), false);
    for letter in line.trim().trim_start_matches('|').chars() {
        match letter {
            '\\' if !escaped => escaped = true,
            '|' if !escaped => cells.push(std::mem::take(&mut cell).trim().to_owned()),
            _ => {
                cell.push(letter);
                escaped = false;
            }
        }
    }
    cells
}

/// Checks docs/errata.md against the proofs.
pub fn faults(workspace: &Repository, rows: &[Erratum], proofs: &[Proof]) -> Vec<String> {
    let mut faults = Vec::new();
    for row in rows {
        let count = proofs.iter().filter(|proof| row.matches(proof)).count();
        if count != 1 {
            faults.push(format!("docs/errata.md, {} {}: {count} proofs", row.chapter, row.cells[0]));
        }
    }
    for proof in proofs {
        let mut fault = |text: String| faults.push(format!("erratum `{}`: {text}", proof.says));
        if rows.iter().filter(|row| row.matches(proof)).count() != 1 {
            fault("is not exactly one row of docs/errata.md".to_owned());
        }
        if proof.numbers.is_empty() && proof.tests.is_empty() {
            fault("has no number".to_owned());
        }
        check(workspace, proof.case.as_deref(), &proof.numbers, &proof.tests, &mut fault);
    }
    faults
}

/// Evaluates the numbers of the rows.
pub fn judge(rows: &[Erratum], proofs: &[Proof], found: &MeasuredNumbers) -> Vec<ErratumVerdict> {
    let judged = |row: &Erratum| {
        let proof = proofs.iter().find(|proof| row.matches(proof));
        let findings = proof.map_or_else(Vec::new, |proof| {
            found.findings(proof.case.as_deref(), &proof.numbers, &proof.tests)
        });
        let (verdict, tone) = verdict(&findings).unwrap_or(("proven", "good"));
        let [place, wrong, ours, test] =
            row.cells.clone().map(|cell| cell.replace('`', "").replace("**", ""));
        ErratumVerdict { chapter: row.chapter.clone(), place, wrong, ours, test, findings, verdict, tone }
    };
    rows.iter().map(judged).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_markdown() {
        let text = "## Chapter 4: x\n\n| a | b | c | d |\n|---|---|---|---|\n| (4.1) | \\|DTEMP\\| | z = \
                    \\[1\\] | t |\nno\n| a |";
        let rows = parse(text);
        assert_eq!(rows.len(), 1);
        assert_eq!(rows[0].chapter, "Chapter 4");
        assert_eq!(rows[0].cells, ["(4.1)", "|DTEMP|", "z = [1]", "t"]);
    }
}
