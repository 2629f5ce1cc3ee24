//! Parts of a result that must be reproduced to the bit, and those that may differ: times and provenance.

use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Reads `report.json` of an output directory.
#[track_caller]
pub fn report(directory: &Path) -> Value {
    let path = directory.join("report.json");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap()
}

/// Returns a scalar of a report.
#[track_caller]
pub fn scalar(report: &Value, name: &str) -> f64 {
    report["values"][name]["value"]
        .as_f64()
        .unwrap_or_else(|| panic!("no `{name}` in {:#}", report["values"]))
}

/// Reads all results of a run, file by file and folder by folder, without times: equal for equal runs.
///
/// Numbers keep all digits of the JSON text (shortest representation that reads back to the same bits), so
/// equal text is equal bits.
pub fn timeless(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(directory).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        // the picture of error against run time; a table with run times that is in suite.json too
        if name.starts_with("error_against_time") || name == "suite.md" {
            continue;
        }
        if entry.path().is_dir() {
            let inside = timeless(&entry.path()).into_iter();
            files.extend(inside.map(|(file, bytes)| (format!("{name}/{file}"), bytes)));
            continue;
        }
        let bytes = match name.as_str() {
            "report.json" => without_times(report(directory)).into_bytes(),
            "suite.json" => {
                let text = std::fs::read_to_string(entry.path()).unwrap();
                let mut rows: Value = serde_json::from_str(&text).unwrap();
                for row in rows.as_array_mut().unwrap() {
                    row.as_object_mut().unwrap().remove("seconds").unwrap();
                }
                rows.to_string().into_bytes()
            }
            "convergence.csv" => {
                without_run_time(&std::fs::read_to_string(entry.path()).unwrap()).into_bytes()
            }
            _ => std::fs::read(entry.path()).unwrap(),
        };
        files.insert(name, bytes);
    }
    files
}

fn without_times(mut report: Value) -> String {
    let report_map = report.as_object_mut().unwrap();
    report_map.remove("seconds").unwrap();
    report_map.remove("provenance").unwrap();
    for (name, value) in report["values"].as_object_mut().unwrap() {
        if let Some(columns) = value["columns"].as_array_mut() {
            columns.retain(|column| column["unit"] != "s");
        }
        // the body's own times are results, those of the machine are not
        let own = ["time_step", "first_break_time"].iter().any(|own| name.contains(own));
        assert!(own || value["unit"] != "s", "times belong to `seconds`: {name}: {value}");
    }
    format!("{report:#}")
}

/// Removes the column `run_time [s]` from a table.
fn without_run_time(table: &str) -> String {
    let times = table.lines().next().unwrap().split(',').position(|head| head.ends_with("[s]")).unwrap();
    let kept = |line: &str| {
        let cells = line.split(',').enumerate().filter(|(column, _)| *column != times);
        cells.map(|(_, cell)| cell).collect::<Vec<_>>().join(",")
    };
    table.lines().map(kept).collect::<Vec<_>>().join("\n")
}

/// Asserts that two output directories contain the same files with the same bytes, except for times.
#[track_caller]
pub fn assert_same(a: &Path, b: &Path) {
    let (a, b) = (timeless(a), timeless(b));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, bytes) in &a {
        if name == "report.json" {
            let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
            let (a, b) = (text(bytes), text(&b[name]));
            let differing = a.lines().zip(b.lines()).find(|(a, b)| a != b);
            assert!(a == b, "report.json differs: {differing:?}");
        } else {
            assert!(*bytes == b[name], "{name} differs");
        }
    }
}
