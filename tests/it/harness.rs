//! What all programs have from the harness: the same commands, and sweeps.

use crate::program::{command, finish, peri, workspace};
use crate::scenes;
use std::fs;

const PROGRAMS: [&str; 4] = ["crystfem", "mdsurrogate", "peri", "polycore"];

/// The commands on scenes and their flags are the same in every program.
#[test]
fn all_programs_have_the_same_commands() {
    let here = workspace();
    let help = |program: &str, of: &str| {
        let ended = finish(command(program, &format!("{of} --help"), here).spawn().unwrap()).with_code(0);
        ended.stdout.replace(program, "PROGRAM")
    };
    for of in ["run", "resume", "check", "sweep", "schema", "completions"] {
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
        // what a case expects need not hold for other values: the table says so
        finish(command(program, &line, workspace()).spawn().unwrap()).with_code(0);
        let table = fs::read_to_string(output.join("sweep.csv")).unwrap();
        assert!(table.lines().count() == 3 && table.lines().next().unwrap().contains(heads), "{table}");
    }
}

/// A quick run is not taken for a whole one, and the table of a sweep takes no other keys.
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
