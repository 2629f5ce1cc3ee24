//! Comparisons with programs that nobody here wrote. One that was not made is named, with what makes it.

use serde::Serialize;

use crate::bench::{self, Bench, Row};
use crate::workspace::Workspace;

/// A comparison.
struct Check {
    title: &'static str,
    /// Rows of target/bench/NAME.json …
    bench: &'static str,
    /// … of which one holds all of these words.
    words: &'static [&'static str],
    /// The largest number that counts as agreement; none where the difference has a stated cause.
    agree: f64,
    command: &'static str,
    needs: &'static str,
}

const CHECKS: &[Check] = &[
    Check {
        title: "LAMMPS peri/pmb: forces, particle by particle",
        bench: "peri-peers",
        words: &["forces, partial volumes: max"],
        // the tolerance of `bench peri-peers`: the bound of the fitted law, ten bonds' worth
        agree: 1e-8,
        command: "cargo xtask bench peri-peers",
        needs: "LAMMPS in target/venv-lammps (docs/guide/src/how-to/bench.md)",
    },
    Check {
        title: "LAMMPS peri/pmb: forces after velocity-Verlet steps",
        bench: "peri-peers",
        words: &["forces, partial volumes, after", "max"],
        agree: 1e-8,
        command: "cargo xtask bench peri-peers",
        needs: "LAMMPS in target/venv-lammps (docs/guide/src/how-to/bench.md)",
    },
    Check {
        title: "CalculiX: temperatures, node by node",
        bench: "crystfem-brick",
        words: &["calculix", "largest difference"],
        // twice what it prints
        agree: 1e-4,
        command: "cargo xtask bench crystfem -- brick",
        needs: "Debian's calculix-ccx",
    },
    Check {
        title: "scikit-fem: temperatures, node by node",
        bench: "crystfem-brick",
        words: &["scikit-fem", "largest difference"],
        // what Newton's iterations of both leave
        agree: 1e-5,
        command: "cargo xtask bench crystfem -- brick",
        needs: "scikit-fem from PyPI",
    },
    Check {
        title: "PyTorch: stresses and tangents of a trained ANN-4",
        bench: "mdsurrogate",
        words: &["pytorch", "largest difference"],
        // some hundred roundings of doubles in another order, as for exported C
        agree: 1e-12,
        command: "cargo xtask bench mdsurrogate",
        needs: "PyTorch in the Python that TORCH_PYTHON names",
    },
    Check {
        title: "onnxruntime: stresses of the exported ANN-4",
        bench: "mdsurrogate",
        words: &["onnxruntime", "largest difference"],
        agree: 1e-12,
        command: "cargo xtask bench mdsurrogate",
        needs: "onnxruntime in the Python that ONNX_PYTHON names",
    },
];

/// A comparison as made, or why it was not.
#[derive(Serialize)]
pub struct Crossed {
    title: &'static str,
    what: String,
    value: String,
    asked: String,
    /// When, where and from which commit.
    measured: String,
    verdict: &'static str,
    tone: &'static str,
    command: &'static str,
    needs: &'static str,
}

impl Crossed {
    /// For docs/validation.md.
    pub fn cells(&self) -> [String; 5] {
        [self.title, &self.value, &self.asked, self.verdict, &self.measured].map(str::to_owned)
    }
}

/// All comparisons, from the rows that benches have left.
pub fn checked(workspace: &Workspace) -> Vec<Crossed> {
    let made = |check: &Check| {
        let bench = bench::read(workspace, check.bench);
        let fresh = bench.as_ref().is_some_and(|bench| bench.stamp.fresh(workspace.root()));
        check.made(bench.as_ref(), fresh)
    };
    CHECKS.iter().map(made).collect()
}

impl Check {
    /// `fresh`: the sources that the bench measured have not changed.
    fn made(&self, bench: Option<&Bench>, fresh: bool) -> Crossed {
        let is_it = |row: &&Row| {
            let what = row.what.to_lowercase();
            self.words.iter().all(|word| what.contains(&word.to_lowercase()))
        };
        let worst = bench
            .iter()
            .flat_map(|bench| &bench.rows)
            .filter(is_it)
            // what JSON has no number for is no agreement
            .map(|row| (row, row.value.unwrap_or(f64::NAN)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let (what, value, verdict, tone) = match worst {
            Some((row, value)) => {
                let (verdict, tone) = match () {
                    () if value.is_nan() || value > self.agree => ("disagrees", "bad"),
                    () if !fresh => ("stale", "open"),
                    () => ("agrees", "good"),
                };
                (row.what.clone(), format!("{value:.2e} {}", row.unit), verdict, tone)
            }
            None => (String::new(), String::new(), "skipped", "open"),
        };
        Crossed {
            title: self.title,
            what,
            value: value.trim_end().to_owned(),
            asked: format!("≤ {:e}", self.agree),
            measured: bench.map(|bench| bench.stamp.to_string()).unwrap_or_default(),
            verdict,
            tone,
            command: self.command,
            needs: self.needs,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stamp::Stamp;

    #[test]
    fn made_skipped_disagreeing_and_stale() {
        let check = &CHECKS[0];
        assert_eq!(check.made(None, false).verdict, "skipped");
        let root = tempfile::tempdir().expect("a folder");
        let bench = |value: f64| {
            let what = "forces, partial volumes: max |Δf|/rms f".to_owned();
            let row = Row { what, size: 1, threads: 1, value: Some(value), unit: String::new() };
            Bench { stamp: Stamp::new(root.path(), &[]).expect("a stamp"), rows: vec![row] }
        };
        let verdict = |value, fresh| check.made(Some(&bench(value)), fresh).verdict;
        assert_eq!(verdict(3.4e-10, true), "agrees");
        assert_eq!(verdict(1e-3, true), "disagrees");
        assert_eq!(verdict(f64::NAN, true), "disagrees");
        assert_eq!(verdict(3.4e-10, false), "stale");
        assert!(check.made(Some(&bench(1.0)), true).measured.contains(", commit "));
    }
}
