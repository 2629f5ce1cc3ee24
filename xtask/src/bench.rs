//! Measurements: a table on the terminal and rows in target/bench/NAME.json.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

pub use evidence::measurement::Measurement as Row;
use miette::{IntoDiagnostic, Result, WrapErr, miette};
use polycore::file::atomic_write;
use serde::{Deserialize, Serialize};

use crate::stamp::{SourceStamp, sources};
use crate::table::{TextTable, print};
use crate::workspace::Repository;

mod brick;
mod calculix;
mod crystfem;
mod forces;
mod lammps;
mod langevin;
mod peri_peers;
mod peri_solvers;
mod scikit_fem;
mod surrogate;

/// Options of `bench`.
#[derive(clap::Args)]
pub struct Options {
    /// Bench: `langevin`, `peri-laws`, `peri-peers` (compared with LAMMPS), `peri-solvers [-- MM,MM…]`,
    /// `crystfem [-- PART… N,N…]` (its brick compared with CalculiX and scikit-fem), `mdsurrogate` (training
    /// and inference compared with PyTorch and onnxruntime), or a crate with a `benches/measure.rs`.
    name: String,
    /// Print the rows as JSON.
    #[arg(long)]
    json: bool,
    /// Options of `benches/measure.rs`; spacings of `peri-solvers`; parts and edges of `crystfem`.
    #[arg(last = true)]
    arguments: Vec<String>,
}

/// target/bench/NAME.json.
#[derive(Debug, Serialize, Deserialize)]
pub struct Bench {
    /// Provenance: date, machine and hash of the sources.
    pub stamp: SourceStamp,
    /// Measured rows.
    pub rows: Vec<Row>,
}

/// Reads the result of a bench; `None` if it has not run.
pub fn read(workspace: &Repository, name: &str) -> Option<Bench> {
    let text = std::fs::read_to_string(workspace.target().join(format!("bench/{name}.json"))).ok()?;
    serde_json::from_str(&text).ok()
}

/// Measures, prints and writes the rows.
pub fn run(workspace: &Repository, options: &Options) -> Result<bool> {
    let folder = workspace.results("bench")?;
    let (rows, table, passed) = match options.name.as_str() {
        "langevin" | "peri-laws" | "peri-peers" if !options.arguments.is_empty() => {
            return Err(miette!("`bench {}` takes no arguments", options.name));
        }
        "langevin" => {
            let (rows, table) = langevin::run(&folder)?;
            (rows, table, true)
        }
        "peri-peers" => peri_peers::run(workspace, &folder)?,
        "crystfem" if !options.arguments.iter().any(|argument| argument.starts_with('-')) => {
            // writes the rows of each part
            let (rows, table, passed) = crystfem::run(workspace, &folder, &options.arguments)?;
            if options.json {
                print(&(serde_json::to_string_pretty(&rows).into_diagnostic()? + "\n"));
            } else {
                print(&format!("{table}written: {}\n", workspace.short(&folder)));
            }
            return Ok(passed);
        }
        "peri-solvers" => {
            let (rows, table) = peri_solvers::run(workspace, &folder, &options.arguments)?;
            (rows, table, true)
        }
        "peri-laws" => {
            let rows = external(&workspace.bench("peri")?, &["--laws".to_owned()])?;
            let table = text(&rows);
            (rows, table, true)
        }
        "mdsurrogate" if options.arguments.is_empty() => {
            let rows = surrogate::run(workspace, &folder)?;
            let table = text(&rows);
            (rows, table, true)
        }
        program => {
            let rows = external(&workspace.bench(program)?, &options.arguments)?;
            let table = text(&rows);
            (rows, table, true)
        }
    };
    // a part with other options is not what the report shows
    if options.name == "crystfem" {
        print(&if options.json {
            serde_json::to_string_pretty(&rows).into_diagnostic()? + "\n"
        } else {
            table
        });
        return Ok(passed);
    }
    let path = write(workspace, &options.name, &rows)?;
    if options.json {
        print(&(serde_json::to_string_pretty(&rows).into_diagnostic()? + "\n"));
    } else {
        print(&format!("{table}written: {}\n", workspace.short(&path)));
    }
    Ok(passed)
}

/// Runs the measurements of a crate ([`Repository::bench`]), which print rows as a JSON list.
fn external(program: &Path, arguments: &[String]) -> Result<Vec<Row>> {
    let output = Command::new(program)
        .args(arguments)
        .arg("--json")
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .output()
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot start {}", program.display()))?;
    if !output.status.success() {
        return Err(miette!("{}: {}", program.display(), output.status));
    }
    serde_json::from_slice(&output.stdout)
        .into_diagnostic()
        .wrap_err_with(|| format!("{} printed no list of rows", program.display()))
}

fn text(rows: &[Row]) -> String {
    let mut table = TextTable::new(["what", "size", "threads", "value", "unit"]);
    for row in rows {
        let value = row.value.map_or_else(|| "-".to_owned(), |value| format!("{value:.4e}"));
        table.push([
            row.what.clone(),
            row.size.to_string(),
            row.threads.to_string(),
            value,
            row.unit.clone(),
        ]);
    }
    table.text()
}

/// Writes target/bench/NAME.json, with the provenance of the rows.
fn write(workspace: &Repository, name: &str, rows: &[Row]) -> Result<PathBuf> {
    let path = workspace.results("bench")?.join(format!("{name}.json"));
    let of = name.split('-').next().unwrap_or(name);
    let crates = workspace.programs();
    // `langevin` belongs to no program: the numerics of `polycore`
    let measured: Vec<&str> = crates.iter().map(String::as_str).filter(|program| *program == of).collect();
    let stamp =
        SourceStamp::new(workspace.root(), &sources(workspace.root(), &measured, &["src", "benches"]))?;
    let bench = Bench { stamp, rows: rows.to_vec() };
    atomic_write(&path, |file| {
        serde_json::to_writer_pretty(&mut *file, &bench)?;
        file.write_all(b"\n")
    })
    .into_diagnostic()?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_another_program() {
        let json = r#"[{"what": "lattice", "size": 1000, "threads": 2, "value": 1.5e9, "unit": "bonds/s"},
                       {"what": "lattice", "size": 1000, "threads": 4, "value": null, "unit": "bonds/s"}]"#;
        let rows: Vec<Row> = serde_json::from_str(json).expect("rows");
        assert!(text(&rows).contains("lattice  1000  2        1.5000e9  bonds/s"), "{}", text(&rows));
        assert_eq!(rows[1].value, None);
    }
}
