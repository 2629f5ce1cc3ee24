//! Measurements of tests, kept for the report of `cargo xtask validate`.
//!
//! A test calls [`near`], [`at_most`] or [`within`] instead of `assert!`, with a name that cases/thesis.toml
//! refers to. The test fails as with `assert!`. Under `cargo xtask test`, which names a folder in [`FOLDER`],
//! the number is also recorded there, met or not. [`skipped`] records a missing requirement of this machine.

pub mod hosts;
pub mod measurement;

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Write;
use std::panic::Location;
use std::path::Path;

use serde_json::{Map, Value, json};

/// Runs the examples of a package as tests, one each, where it includes them as modules: compiled together
/// they take as long as one of them. The last test finds those that are missing; `except` names those that
/// read arguments.
#[macro_export]
macro_rules! run_examples {
    ($($name:ident)*; except $($other:ident)*) => {
        $(
            #[test]
            fn $name() -> impl std::process::Termination {
                $name::main()
            }
        )*

        #[test]
        fn every_example_runs() {
            let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");
            let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
            let mut found: Vec<String> =
                files.map(|file| file.file_stem().unwrap().to_str().unwrap().to_owned()).collect();
            found.sort();
            let mut all = vec![$(stringify!($name),)* $(stringify!($other),)*];
            all.sort();
            assert_eq!(found, all);
        }
    };
}

/// Environment variable with the folder of the records.
pub const FOLDER: &str = "EVIDENCE_FOLDER";

/// Asserts that |`value` − `reference`| ≤ `tolerance`.
///
/// # Panics
/// Otherwise.
#[track_caller]
pub fn near(name: &str, value: f64, reference: f64, tolerance: f64) {
    let met = (value - reference).abs() <= tolerance;
    judge(name, value, json!({ "reference": reference, "tolerance": tolerance }), met);
}

/// Asserts that `value` ≤ `bound`.
///
/// # Panics
/// Otherwise.
#[track_caller]
pub fn at_most(name: &str, value: f64, bound: f64) {
    judge(name, value, json!({ "at_most": bound }), value <= bound);
}

/// Asserts that `low` ≤ `value` ≤ `high`.
///
/// # Panics
/// Otherwise.
#[track_caller]
pub fn within(name: &str, value: f64, low: f64, high: f64) {
    judge(name, value, json!({ "at_least": low, "at_most": high }), (low..=high).contains(&value));
}

/// Records that the running test lacks a requirement on this machine; the test then returns.
#[track_caller]
pub fn skipped(needs: &str) {
    let test = test();
    eprintln!("skipped {test}: needs {needs}");
    leave(&format!("skipped {test}"), json!({ "skipped": test, "needs": needs }));
}

#[track_caller]
fn judge(name: &str, value: f64, asked: Value, met: bool) {
    let place = Location::caller();
    let mut record = Map::from_iter([
        ("name".to_owned(), json!(name)),
        // JSON has no NaN
        ("value".to_owned(), if value.is_finite() { json!(value) } else { json!(value.to_string()) }),
        ("met".to_owned(), json!(met)),
        ("test".to_owned(), json!(test())),
        ("file".to_owned(), json!(place.file())),
    ]);
    let text = asked.to_string();
    record.extend(asked.as_object().cloned().unwrap_or_default());
    leave(name, Value::Object(record));
    assert!(met, "{name}: {value}, asked for {text}");
}

/// Name of the running test: the test harness names its threads by their tests.
fn test() -> String {
    std::thread::current().name().unwrap_or("a test").to_owned()
}

fn leave(key: &str, record: Value) {
    let Some(folder) = std::env::var_os(FOLDER) else { return };
    leave_in(Path::new(&folder), key, &record);
}

/// Writes a file by rename: tests of many threads and processes write at once, some under one name.
fn leave_in(folder: &Path, key: &str, record: &Value) {
    let mut hasher = DefaultHasher::new();
    key.hash(&mut hasher);
    let path = folder.join(format!("{:016x}.json", hasher.finish()));
    let write = || -> std::io::Result<()> {
        fs::create_dir_all(folder)?;
        let mut part = tempfile::Builder::new().suffix(".part").tempfile_in(folder)?;
        writeln!(part, "{record}")?;
        part.persist(&path)?;
        Ok(())
    };
    let written = write();
    assert!(written.is_ok(), "{}: {written:?}", path.display());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_for_is_asserted() {
        near("tests of evidence: near", 1.0, 1.5, 0.5);
        within("tests of evidence: within", 1.0, 1.0, 2.0);
        at_most("tests of evidence: at most", 1.0, 1.0);
        for wrong in [
            || near("tests of evidence: not near", 1.0, 1.5, 0.4),
            || near("tests of evidence: not a number", f64::NAN, 1.5, 0.4),
            || within("tests of evidence: not within", 2.1, 1.0, 2.0),
            || at_most("tests of evidence: more", 1.1, 1.0),
        ] {
            assert!(std::panic::catch_unwind(wrong).is_err());
        }
    }

    #[test]
    fn records_are_files() {
        let folder = tempfile::tempdir().expect("a folder");
        leave_in(folder.path(), "a", &json!({ "value": 1 }));
        leave_in(folder.path(), "a", &json!({ "value": 2 }));
        leave_in(folder.path(), "b", &json!({ "value": 3 }));
        let mut texts: Vec<String> = fs::read_dir(folder.path())
            .expect("a folder")
            .map(|entry| fs::read_to_string(entry.expect("an entry").path()).expect("a record"))
            .collect();
        texts.sort();
        assert_eq!(texts, ["{\"value\":2}\n", "{\"value\":3}\n"]);
    }

    #[test]
    fn records_of_one_name_from_many_threads() {
        let folder = tempfile::tempdir().expect("a folder");
        std::thread::scope(|scope| {
            for thread in 0..8 {
                let folder = folder.path();
                scope
                    .spawn(move || (0..200).for_each(|_| leave_in(folder, "a", &json!({ "value": thread }))));
            }
        });
        let files = fs::read_dir(folder.path()).expect("a folder").count();
        assert_eq!(files, 1);
    }
}
