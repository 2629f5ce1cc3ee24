//! The table of a suite: each variant, its expected and observed behaviour, and its cost.

use super::Naming;
use crate::report::{Report, Trial};
use polycore::Error;
use polycore::file::atomic_write;
use std::path::Path;

/// A variant in the table of a suite.
#[derive(Debug)]
pub struct SuiteRow<'a> {
    /// Name.
    pub name: &'a str,
    /// Expected behaviour.
    pub description: Option<&'a str>,
    /// Observed behaviour, or the error.
    pub observed: Result<String, &'a str>,
    /// Iterations or steps.
    pub count: u64,
    /// Seconds of the solution.
    pub seconds: f64,
}

/// Writes `suite.md` if a variant has a description, with the verdict of the report on each; `counted` heads
/// the column of counts. Returns the rows.
///
/// # Errors
/// A file that cannot be written.
pub fn suite(
    report: &Report,
    naming: Naming,
    counted: &str,
    rows: &[SuiteRow],
    output: &Path,
) -> Result<Vec<Trial>, Error> {
    if rows.iter().all(|row| row.description.is_none()) {
        return Ok(Vec::new());
    }
    let mut text = format!("| case | expected | observed | {counted} | seconds |\n|---|---|---|---|---|\n");
    let mut trials = Vec::new();
    for SuiteRow { name, description, observed, count, seconds } in rows {
        let (held, missed) = report.verdict_on(|quantity| naming.is_of(name, quantity));
        let observed = match observed {
            Err(error) => format!("refused: {}", error.lines().next().unwrap_or_default()),
            Ok(_) if !missed.is_empty() => format!("missed: {}", missed.join(", ")),
            Ok(observed) => format!("{observed}; {held} expectations satisfied"),
        };
        let description = description.unwrap_or_default().to_owned();
        text += &format!("| {name} | {description} | {observed} | {count} | {seconds:.2} |\n");
        let (what, iterations) = ((*name).to_owned(), Some(*count));
        trials.push(Trial { what, description, observed, iterations, passed: missed.is_empty() });
    }
    atomic_write(output.join("suite.md"), |file| std::io::Write::write_all(file, text.as_bytes()))?;
    Ok(trials)
}
