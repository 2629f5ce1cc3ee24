//! Functions that all programs have from the harness: the same commands, and sweeps.

use crate::program::{command, finish, peri, workspace};
use crate::scenes;
use std::fs;
use std::process::{Command, Stdio};

const PROGRAMS: [&str; 4] = ["crystfem", "mdsurrogate", "peri", "polycore"];

/// Commands on scenes and their flags are the same in every program.
#[test]
fn all_programs_have_the_same_commands() {
    let here = workspace();
    let help = |program: &str, of: &str| {
        let ended = finish(command(program, &format!("{of} --help"), here).spawn().unwrap()).with_code(0);
        ended.stdout.replace(program, "PROGRAM")
    };
    for of in ["run", "resume", "check", "sweep", "view", "schema", "completions", "man"] {
        for program in PROGRAMS {
            assert_eq!(help(program, of), help("peri", of), "{program} {of}");
        }
    }
}

#[test]
fn every_program_sweeps() {
    let directory = tempfile::tempdir().unwrap();
    let rubber = directory.path().join("rubber.toml");
    let scene = "version = 1\nprogram = \"polycore\"\n[[fit.data]]\nname = \"mine\"\nfile = \"mine.csv\"\n";
    fs::write(&rubber, scene).unwrap();
    fs::write(directory.path().join("mine.csv"), "stretch,nominal_MPa\n1.2,0.1\n1.5,0.2\n2.0,0.35\n")
        .unwrap();
    let rubber = format!("{} --vary fit.laws=[\"neo-hookean\"],[\"mooney-rivlin\"]", rubber.display());
    for (program, arguments, heads) in [
        (
            "peri",
            "cases/ch2/bar-in-tension/case.toml --vary material.youngs_modulus=1MPa,2MPa --column work_of_*",
            "work_of_loads[dx=20mm m=3.015] [J]",
        ),
        ("polycore", &rubber, "mine.mooney-rivlin.rms [MPa]"),
        (
            "mdsurrogate",
            "cases/ch3/crystal/case.toml --vary crystal.levels=2,3 --column grid.runs",
            "grid.runs",
        ),
    ] {
        let output = directory.path().join(program);
        let line = format!("sweep {arguments} --quick -o {}", output.display());
        // expectations of a case need not hold for other values: the table says so
        finish(command(program, &line, workspace()).spawn().unwrap()).with_code(0);
        let table = fs::read_to_string(output.join("sweep.csv")).unwrap();
        assert!(table.lines().count() == 3 && table.lines().next().unwrap().contains(heads), "{table}");
    }
}

/// A sweep over draws gives the band of a value, one for each value of another key; wrong samples are
/// refused.
#[test]
fn a_sample_makes_a_band() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let rows: String = (0..=10).map(|k| format!("{},1.36e5\n", 37_000.0 + 100.0 * f64::from(k))).collect();
    fs::write(here.join("draws.csv"), format!("growth_rate [1/s],nucleation [K^2]\n{rows}")).unwrap();
    let scene = "cases/ch5/kinetics-uncertainty/case.toml --column fast.*temperature_at_0.5";
    let sweep = |flags: &str| {
        let line = format!("sweep {scene} {flags} -o {}", here.join("out").display());
        finish(command("crystfem", &line, workspace()).spawn().unwrap())
    };
    let sample = format!("--sample materials.pa12.kinetics={}", here.join("draws.csv").display());
    sweep(&format!("{sample} --count 11 --vary materials.pa12.kinetics.avrami_exponent=2.5,2.7"))
        .with_code(0);
    let table = fs::read_to_string(here.join("out/sweep_bands.csv")).unwrap();
    let found: Vec<Vec<&str>> = table.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert_eq!(found.len(), 2, "{table}");
    for (row, exponent) in found.iter().zip(["2.5", "2.7"]) {
        let [lower, median, upper] = [5, 6, 7].map(|k: usize| row[k].parse::<f64>().unwrap());
        // the temperature rises with the rate, nearly in proportion to its logarithm
        assert!(row[0] == exponent && row[2] == "11" && lower < median && median < upper, "{row:?}");
        assert!(((upper - median) / (median - lower) - 1.0).abs() < 0.05, "{row:?}");
    }
    for (flags, told) in [
        (format!("{sample} --count 22"), "1 to 11"),
        ("--sample materials.pa12.kinetics=absent.csv".to_owned(), "absent.csv"),
        (sample.replace("kinetics=", "kinetic="), "did you mean `kinetics`?"),
    ] {
        let ended = sweep(&flags).with_code(2);
        assert!(ended.stderr.contains(told), "{}", ended.stderr);
    }
}

/// A quick run does not replace a full one, and the table of a sweep accepts no other keys.
#[test]
fn a_quick_sweep_is_another_sweep() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let study = "[[study]]\nname = \"fine\"\nquick = false\n[[study]]\nname = \"coarse\"\n";
    fs::write(here.join("bar.toml"), scenes::bar().to_owned() + study).unwrap();
    let sweep = |flags: &str| {
        peri(&format!("sweep bar.toml --vary material.youngs_modulus=1MPa -o out {flags}"), here)
            .with_code(0);
        fs::read_to_string(here.join("out/sweep.csv")).unwrap()
    };
    let quick = sweep("--quick");
    assert!(quick.contains("coarse") && !quick.contains("fine"), "{quick}");
    let whole = sweep("");
    assert!(whole.contains("coarse") && whole.contains("fine"), "{whole}");
    fs::write(here.join("bad.toml"), scenes::bar().to_owned() + "[sweep]\nsets = {}\n").unwrap();
    peri("check bad.toml", here).with_code(2).tells("did you mean `set`?");
}

/// Parts of a sweep at the same time, as the job script starts them, and a table of all: equal to that of one
/// sweep, to the byte.
#[test]
fn a_sweep_in_parts() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("bar.toml"), scenes::bar()).unwrap();
    let line = "sweep bar.toml --vary material.youngs_modulus=1MPa,2MPa,3MPa,4MPa --vary solver.steps=1,2";
    peri(&format!("{line} -o whole"), here).with_code(0);
    let written = peri(&format!("{line} -o it's --slurm 3"), here).with_code(0);
    assert_eq!(written.stdout, "8 runs in 3 parts: sbatch it's/job.sh\n");
    let merge = || peri(&format!("{line} -o it's --merge"), here);
    merge().with_code(2).tells("found run 1 of 8");
    let start = |part: u32| {
        let mut job = Command::new("sh");
        job.arg("it's/job.sh").env("SLURM_ARRAY_TASK_ID", part.to_string()).current_dir(here);
        job.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let parts = [1, 3].map(start);
    parts.into_iter().for_each(|part| drop(finish(part).with_code(0)));
    merge().with_code(2).tells("found run 2 of 8");
    assert!(!here.join("it's/sweep.csv").exists());
    // part 2, stopped half way and submitted again
    let run = here.join("it's/youngs_modulus-1MPa_steps-2/report.json");
    finish(start(2)).with_code(0);
    fs::remove_file(&run).unwrap();
    finish(start(2)).with_code(0);
    let before = fs::metadata(&run).unwrap().modified().unwrap();
    merge().with_code(0);
    assert_eq!(fs::metadata(&run).unwrap().modified().unwrap(), before, "nothing is computed again");
    let table = |folder: &str| fs::read(here.join(folder).join("sweep.csv")).unwrap();
    assert_eq!(table("it's"), table("whole"));
    peri(&format!("{line} --shard 4/3"), here).with_code(2).tells("allowed: I/N");
}
