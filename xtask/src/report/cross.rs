//! Comparisons with programs that nobody here wrote. One that was not made is named, with what makes it.

use std::fs;
use std::path::Path;

use serde::Serialize;

use crate::bench::Row;

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
    verdict: &'static str,
    tone: &'static str,
    command: &'static str,
    needs: &'static str,
}

impl Crossed {
    /// For docs/validation.md.
    pub fn cells(&self) -> [String; 4] {
        [self.title, &self.value, &self.asked, self.verdict].map(str::to_owned)
    }
}

/// All comparisons, from the rows that benches have left.
pub fn checked(bench: &Path) -> Vec<Crossed> {
    CHECKS.iter().map(|check| check.made(bench)).collect()
}

impl Check {
    fn made(&self, bench: &Path) -> Crossed {
        let text = fs::read_to_string(bench.join(format!("{}.json", self.bench))).unwrap_or_default();
        let rows: Vec<Row> = serde_json::from_str(&text).unwrap_or_default();
        let is_it = |row: &&Row| {
            let what = row.what.to_lowercase();
            self.words.iter().all(|word| what.contains(&word.to_lowercase()))
        };
        let worst = rows
            .iter()
            .filter(is_it)
            .filter_map(|row| Some((row, row.value?)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let (what, value, verdict, tone) = match worst {
            Some((row, value)) => {
                let (verdict, tone) =
                    if value <= self.agree { ("agrees", "good") } else { ("disagrees", "bad") };
                (row.what.clone(), format!("{value:.2e} {}", row.unit), verdict, tone)
            }
            None => (String::new(), String::new(), "skipped", "open"),
        };
        Crossed {
            title: self.title,
            what,
            value: value.trim_end().to_owned(),
            asked: format!("≤ {:e}", self.agree),
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

    #[test]
    fn made_skipped_and_disagreeing() {
        let folder = tempfile::tempdir().expect("a folder");
        let check = &CHECKS[0];
        assert_eq!(check.made(folder.path()).verdict, "skipped");
        let write = |value: f64| {
            let rows = format!(
                r#"[{{"what": "forces, partial volumes: max |Δf|/rms f", "size": 1, "threads": 1, "value": {value}, "unit": ""}}]"#
            );
            fs::write(folder.path().join("peri-peers.json"), rows).expect("rows");
        };
        write(3.4e-10);
        assert_eq!(check.made(folder.path()).verdict, "agrees");
        write(1e-3);
        assert_eq!(check.made(folder.path()).verdict, "disagrees");
    }
}
