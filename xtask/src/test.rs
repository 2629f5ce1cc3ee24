//! `cargo xtask test`: runs all tests; the numbers that they measure go to target/evidence.json, and skipped
//! tests are listed at the end.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use harness::report::Judgement;
use miette::{IntoDiagnostic, Result, WrapErr, miette};
use polycore::file::atomic_write;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::stamp::{SourceStamp, sources};
use crate::table::print;
use crate::workspace::Repository;

/// Arguments that choose targets.
const TARGETS: [&str; 10] = [
    "--lib",
    "--bin",
    "--bins",
    "--test",
    "--tests",
    "--doc",
    "--example",
    "--examples",
    "--bench",
    "--all-targets",
];

/// Environment variable that crate `evidence` reads.
const FOLDER: &str = "EVIDENCE_FOLDER";

/// Number measured by a test, as crate `evidence` writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TestRecord {
    /// Name, as cases/thesis.toml refers to it.
    pub name: String,
    /// A number, or `NaN`, `inf`.
    value: serde_json::Value,
    #[serde(skip_serializing_if = "Option::is_none")]
    reference: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tolerance: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    at_least: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    at_most: Option<f64>,
    /// True if the assertion held.
    pub met: bool,
    /// Test: `calibrate::tests::single_point_integrals`.
    pub test: String,
    /// Source file: `crates/peri/src/calibrate.rs`.
    pub file: String,
    /// Provenance of the test run; `None` in a file that a test has just written.
    pub stamp: Option<SourceStamp>,
}

/// Requirement that a test could not find.
#[derive(Debug, Deserialize)]
struct Skip {
    skipped: String,
    needs: String,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum StoredRecord {
    Skip(Skip),
    Record(Box<TestRecord>),
}

/// All records by name.
pub type Records = BTreeMap<String, TestRecord>;

impl TestRecord {
    /// Formats the value and the requirement.
    pub fn cells(&self) -> [String; 2] {
        let mut expect = json!({ "quantity": self.name, "kind": "bound", "source": "a test" });
        let asked = [
            ("reference", self.reference),
            ("tolerance", self.tolerance),
            ("at_least", self.at_least),
            ("at_most", self.at_most),
        ];
        for (key, number) in asked {
            if let Some(number) = number {
                expect[key] = json!(number);
            }
        }
        let value = self.value.as_f64();
        let judged = serde_json::from_value(expect).map(|expect| {
            let [_, _, value, asked, _] = Judgement { expect, value, pass: self.met, message: None }.row();
            [value, asked]
        });
        let mut cells = judged.unwrap_or_default();
        if value.is_none() {
            cells[0] = self.value.as_str().unwrap_or_default().to_owned();
        }
        cells
    }
}

/// Runs the tests; `arguments` go to `cargo test`.
pub fn run(workspace: &Repository, arguments: &[String]) -> Result<bool> {
    let folder = workspace.results("evidence")?;
    fs::remove_dir_all(&folder).into_diagnostic()?;
    fs::create_dir_all(&folder).into_diagnostic()?;
    let chosen = arguments.iter().take_while(|argument| *argument != "--").any(|argument| {
        let name = argument.split('=').next().unwrap_or_default();
        TARGETS.contains(&name)
    });
    // without the examples, which tests include: each would compile the solvers again
    let mut runs: &[&[&str]] = if chosen { &[&[]] } else { &[&["--lib", "--bins", "--tests"], &["--doc"]] };
    if arguments.iter().any(|argument| argument == "--no-run") {
        runs = &runs[..1];
    }
    let mut passed = true;
    for targets in runs {
        let command = [&["test", "--release", "--workspace"], *targets].concat();
        passed &= workspace.cargo(&command, arguments, &[(FOLDER, &folder)])?;
    }
    let (new, skips) = collect(&folder)?;
    // a selection of tests keeps the numbers of the others
    let before = if arguments.is_empty() { Records::new() } else { read(workspace) };
    let records = stamped(workspace, before, new)?;
    atomic_write(workspace.target().join("evidence.json"), |file| {
        Ok(serde_json::to_writer_pretty(file, &records.values().collect::<Vec<_>>())?)
    })
    .into_diagnostic()?;
    print(&untested(&skips));
    Ok(passed)
}

/// Merges earlier records and new ones, with stamps of their crates' sources.
fn stamped(workspace: &Repository, mut records: Records, new: Vec<TestRecord>) -> Result<Records> {
    let mut stamps = BTreeMap::<String, SourceStamp>::new();
    for mut record in new {
        let of = record.file.strip_prefix("crates/").and_then(|rest| rest.split('/').next());
        let key = of.unwrap_or_default().to_owned();
        if !stamps.contains_key(&key) {
            // tests of whole programs depend on all crates
            let crates = of.map_or_else(|| workspace.programs(), |name| vec![name.to_owned()]);
            let crates: Vec<&str> = crates.iter().map(String::as_str).collect();
            let sources = sources(workspace.root(), &crates, &["src", "tests"]);
            stamps.insert(key.clone(), SourceStamp::new(workspace.root(), &sources)?);
        }
        record.stamp = stamps.get(&key).cloned();
        records.insert(record.name.clone(), record);
    }
    Ok(records)
}

/// Reads the records of the last runs; empty if there was no run.
pub fn read(workspace: &Repository) -> Records {
    let text = fs::read_to_string(workspace.target().join("evidence.json")).unwrap_or_default();
    let records: Vec<TestRecord> = serde_json::from_str(&text).unwrap_or_default();
    records.into_iter().map(|record| (record.name.clone(), record)).collect()
}

/// Reads the records that tests have left in the folder.
fn collect(folder: &Path) -> Result<(Vec<TestRecord>, Vec<Skip>)> {
    let (mut records, mut skips) = (Vec::new(), Vec::new());
    for entry in fs::read_dir(folder).into_diagnostic()? {
        let path = entry.into_diagnostic()?.path();
        if path.extension().is_none_or(|extension| extension != "json") {
            continue;
        }
        let text =
            fs::read_to_string(&path).into_diagnostic().wrap_err_with(|| path.display().to_string())?;
        match serde_json::from_str(&text).map_err(|error| miette!("{}: {error}", path.display()))? {
            StoredRecord::Skip(skip) => skips.push(skip),
            StoredRecord::Record(record) => records.push(*record),
        }
    }
    skips.sort_by(|a, b| a.skipped.cmp(&b.skipped));
    Ok((records, skips))
}

/// Lists the skipped tests; empty if there are none.
fn untested(skips: &[Skip]) -> String {
    let lines = skips.iter().map(|skip| format!("  {}: needs {}\n", skip.skipped, skip.needs));
    let lines: String = lines.collect();
    if lines.is_empty() { lines } else { format!("not tested here:\n{lines}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// New records replace those of the same name; each becomes stale when its own crate changes, and only
    /// then.
    #[test]
    fn records_have_the_stamp_of_their_crate() {
        let root = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| {
            let path = root.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            fs::write(path, text).expect("a file");
        };
        write("crates/peri/src/main.rs", "1");
        write("crates/crystfem/src/main.rs", "1");
        let workspace = Repository::new(root.path().to_path_buf());
        let record = |name: &str, value: f64, file: &str| -> TestRecord {
            let text =
                json!({ "name": name, "value": value, "at_most": 5, "met": true, "test": "t", "file": file });
            serde_json::from_value(text).expect("a record")
        };
        let old = record("a", 1.0, "crates/peri/src/a.rs");
        let kept = record("b", 1.0, "crates/crystfem/src/b.rs");
        let before = stamped(&workspace, Records::new(), vec![old, kept]).expect("records");
        let new = vec![record("a", 2.0, "crates/peri/src/a.rs"), record("c", 3.0, "tests/it/c.rs")];
        let records = stamped(&workspace, before, new).expect("records");
        assert_eq!(records["a"].cells()[0], "2");
        let fresh =
            |name: &str| records[name].stamp.as_ref().is_some_and(|stamp| stamp.fresh(workspace.root()));
        assert_eq!(["a", "b", "c"].map(fresh), [true, true, true]);
        write("crates/crystfem/src/main.rs", "2");
        assert_eq!(["a", "b", "c"].map(fresh), [true, false, false]);
    }

    #[test]
    fn what_tests_leave() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("a file");
        write("1.json", r#"{"skipped": "export::fortran", "needs": "gfortran"}"#);
        write(
            "2.json",
            r#"{"name": "n", "value": 1.5, "reference": 1.4, "tolerance": 0.2, "met": true,
                "test": "t", "file": "crates/peri/src/a.rs"}"#,
        );
        write(
            "3.json",
            r#"{"name": "m", "value": "NaN", "at_most": 1e-12, "met": false,
                "test": "t", "file": "crates/peri/src/a.rs"}"#,
        );
        write("4.17.part", "{");
        let (mut records, skips) = collect(folder.path()).expect("records");
        records.sort_by(|a, b| a.name.cmp(&b.name));
        assert_eq!(records[1].cells(), ["1.5", "1.4 ± 0.2"]);
        assert_eq!(records[0].cells(), ["NaN", "≤ 1.00000e-12"]);
        assert_eq!(untested(&skips), "not tested here:\n  export::fortran: needs gfortran\n");
        assert_eq!(untested(&[]), "");
    }
}
