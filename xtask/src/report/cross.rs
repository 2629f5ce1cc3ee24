//! Comparisons with programs that nobody here wrote. One that was not made is named, with what makes it.

use serde::Serialize;

use crate::bench::{self, Bench, Row};
use crate::test::{self, Record};
use crate::workspace::Workspace;

/// A comparison by a bench.
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

/// A comparison by a test that runs the other program.
struct Tested {
    title: &'static str,
    /// The name of its number, as the test gives it by crate `evidence`.
    record: &'static str,
    needs: &'static str,
}

const LAMMPS: &str = "LAMMPS in the Python that PERI_LAMMPS_PYTHON names";
const CALCULIX: &str = "CalculiX built from source, CALCULIX_SOURCE";

const TESTS: &[Tested] = &[
    Tested {
        title: "LAMMPS: bond tables, forces of the self-check state over their rms",
        record: "forces in LAMMPS over their rms",
        needs: LAMMPS,
    },
    Tested {
        title: "LAMMPS: loads of a strip that tears, every step before it parts",
        record: "loads of a torn strip in LAMMPS",
        needs: LAMMPS,
    },
    Tested {
        title: "CalculiX with UMATHT: temperatures of crystallization at 10 K/min, K",
        record: "crystallization in CalculiX, K",
        needs: CALCULIX,
    },
    Tested {
        title: "CalculiX with UMATHT: temperatures of a printed bar, node by node, K",
        record: "printed bar in CalculiX, K",
        needs: CALCULIX,
    },
    Tested {
        title: "CalculiX with UMAT: load of a notched sheet, our neo-Hookean law over its own",
        record: "notched sheet in CalculiX: our neo-Hookean law over CalculiX' own",
        needs: CALCULIX,
    },
    Tested {
        title: "CalculiX with UMAT: stress at the centre of a cooling plate of PA12, over the series",
        record: "plate of PA12 in CalculiX, held, centre",
        needs: CALCULIX,
    },
    Tested {
        title: "CalculiX with a learnt law: stresses along a path with softening, over their norm",
        record: "a learnt law in CalculiX, stresses",
        needs: CALCULIX,
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

/// All comparisons, from the rows that benches and the numbers that tests have left.
pub fn checked(workspace: &Workspace) -> Vec<Crossed> {
    let made = |check: &Check| {
        let bench = bench::read(workspace, check.bench);
        let fresh = bench.as_ref().is_some_and(|bench| bench.stamp.fresh(workspace.root()));
        check.made(bench.as_ref(), fresh)
    };
    let records = test::read(workspace);
    let tested = |tested: &Tested| {
        let record = records.get(tested.record);
        let stamp = record.and_then(|record| record.stamp.as_ref());
        tested.made(record, stamp.is_some_and(|stamp| stamp.fresh(workspace.root())))
    };
    CHECKS.iter().map(made).chain(TESTS.iter().map(tested)).collect()
}

/// Verdict and tone.
fn judged(agrees: bool, fresh: bool) -> (&'static str, &'static str) {
    match (agrees, fresh) {
        (false, _) => ("disagrees", "bad"),
        (true, false) => ("stale", "open"),
        (true, true) => ("agrees", "good"),
    }
}

impl Tested {
    fn made(&self, record: Option<&Record>, fresh: bool) -> Crossed {
        let [value, asked] = record.map(Record::cells).unwrap_or_default();
        let (verdict, tone) = record.map_or(("skipped", "open"), |record| judged(record.met, fresh));
        let stamp = record.and_then(|record| record.stamp.as_ref());
        Crossed {
            title: self.title,
            what: record.map(|record| record.test.clone()).unwrap_or_default(),
            value,
            asked,
            measured: stamp.map(ToString::to_string).unwrap_or_default(),
            verdict,
            tone,
            command: "cargo xtask test",
            needs: self.needs,
        }
    }
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
                let (verdict, tone) = judged(value <= self.agree, fresh);
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
