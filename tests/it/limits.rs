//! Limits of the system: disk space, memory of a process, one run per folder.
#![cfg(unix)]

use crate::parts::BAR;
use crate::program::{Ended, command, executable, finish, workspace};
use crate::scenes;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Runs a program behind a limit of the shell.
fn limited(program: &str, arguments: &str, limit: &str, here: &Path) -> Ended {
    let mut shell = Command::new("sh");
    // a file that is too large gives an error of its write, like a full disk, if the signal is ignored
    let script = format!("trap '' XFSZ; {limit} || exit 77; exec \"$0\" \"$@\"");
    shell.arg("-c").arg(script).arg(executable(program)).args(arguments.split_whitespace());
    shell.current_dir(here).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    finish(shell.spawn().unwrap())
}

const LAW: &str = "version = 1\nprogram = \"mdsurrogate\"\ntitle = \"law\"\n[data]\nfiles = \
                   [\"rows.csv\"]\n[split]\n\
                   by = \"random\"\n[training]\nepochs = 2\n[[model]]\nkind = \"energy\"\nhidden = [[4, \
                          \"softplus\"]]\n";

fn rows() -> String {
    let row = |k: usize| format!("{},1,1,0,0,0,{k},0,0,0,0,0\n", 1.0 + 0.01 * k as f64);
    "C11,C22,C33,C12,C13,C23,S11,S22,S33,S12,S13,S23\n".to_owned() + &(0..20).map(row).collect::<String>()
}

/// Files of any size from none to all: the run fails with 1 and names the file without space, or succeeds.
#[test]
#[ignore = "takes 6 to 35 s; .ci/run runs it"]
fn no_room_on_the_disk() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("bar.toml"), BAR).unwrap();
    fs::write(here.join("sheet.toml"), scenes::fracture("4 mm", "method = \"lbfgs\"")).unwrap();
    fs::write(here.join("law.toml"), LAW).unwrap();
    fs::write(here.join("rows.csv"), rows()).unwrap();
    let rubber = workspace().join("cases/ch1/rubber-fits/case.toml");
    let rubber = format!("run {} --output", rubber.display());
    let mut fields = 0;
    for (program, line) in [
        ("crystfem", "run bar.toml --output"),
        ("peri", "run sheet.toml --output"),
        ("mdsurrogate", "run law.toml --output"),
        ("polycore", rubber.as_str()),
    ] {
        // in units of 512 bytes
        let (mut blocks, mut failed) = (1.0_f64, 0);
        loop {
            let out = format!("{program}-{failed}");
            let limit = format!("ulimit -f {blocks:.0}");
            let ended = limited(program, &format!("{line} {out}"), &limit, here);
            if ended.code == Some(0) {
                break;
            }
            let ended = ended.with_code(1);
            ended.tells("cannot write ");
            ended.tells("the file exceeds the size limit: ");
            assert!(!ended.stderr.contains("rust-hdf5"), "{}", ended.stderr);
            fields += usize::from(ended.stderr.contains(".vtkhdf"));
            assert!(!here.join(&out).join("report.json").exists());
            failed += 1;
            blocks = (1.6 * blocks).max(blocks + 8.0);
            assert!(failed < 30, "{ended:?}");
        }
        assert!(failed > 0, "{program}");
    }
    assert!(fields > 0, "no file of fields was refused");
}

/// A mesh that fits into the machine but not into the process is refused before it is built.
#[test]
#[cfg(target_os = "linux")]
fn memory_of_the_process() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let brick = "version = 1\nprogram = \"crystfem\"\n[mesh.brick]\nsize = [\"1 m\", \"1 m\", \"1 m\"]\n\
                 elements = [100, 100, 100]\n[materials.a]\nlaw = \"conductor\"\ndensity = \"1000 kg/m^3\"\n\
                 conductivity = \"1 W/(m K)\"\nspecific_heat = \"1000 J/(kg K)\"\n[[region]]\nmaterial = \
                                  \"a\"\n\
                 temperature = \"20 degC\"\n[time]\nend = \"10 s\"\nstep = \"1 s\"\n";
    fs::write(here.join("brick.toml"), brick).unwrap();
    // 4.1e8 bytes are needed
    let ended = limited("crystfem", "check brick.toml", "ulimit -v 450000", here).with_code(2);
    ended.tells("`mesh.brick.elements`: found 1.030e6 nodes, which need about 0.4 GiB");
    ended.tells("(the available memory)");
}

/// Begins a run and waits for one of its files.
fn begun(program: &str, line: &str, file: &Path, here: &Path) -> Child {
    let mut child = command(program, line, here).spawn().unwrap();
    let since = Instant::now();
    while !file.exists() {
        assert!(since.elapsed() < Duration::from_secs(120), "{} does not appear", file.display());
        assert!(child.try_wait().unwrap().is_none(), "{program} has ended");
        std::thread::sleep(Duration::from_millis(2));
    }
    child
}

/// While a run writes into its folder, a second one, a `resume` and a sweep are refused, and damage nothing.
#[test]
fn one_run_at_a_time() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let slow = BAR.replace("tolerance = \"1 K\"", "step = \"2 ms\"");
    fs::write(here.join("bar.toml"), &slow).unwrap();
    let studies = "\n[[study]]\nname = \"a\"\n[[study]]\nname = \"b\"\n";
    fs::write(here.join("studies.toml"), slow.clone() + studies).unwrap();
    fs::write(here.join("law.toml"), LAW.replace("epochs = 2", "epochs = 100000")).unwrap();
    fs::write(here.join("rows.csv"), rows()).unwrap();
    let sweep = "sweep bar.toml --vary print.layer_time=5s,10s --output sweep";
    for (program, line, file, again) in [
        ("crystfem", "run bar.toml --output part", "part/checkpoint.bin", "resume part"),
        ("crystfem", "run studies.toml --output whole", "whole/checkpoint.bin", "resume whole"),
        ("crystfem", sweep, "sweep/layer_time-5s/checkpoint.bin", sweep),
        ("mdsurrogate", "run law.toml --output law --checkpoint-every 0", "law/checkpoint.bin", "resume law"),
    ] {
        let mut first = begun(program, line, &here.join(file), here);
        let before = fs::read_dir(here.join(file).parent().unwrap()).unwrap().count();
        for second in [line, again] {
            let ended = finish(command(program, second, here).spawn().unwrap()).with_code(2);
            ended.tells("cannot be used: another run is writing into it");
        }
        assert!(here.join(file).is_file() && before > 0 && first.try_wait().unwrap().is_none(), "{line}");
        first.kill().unwrap();
        finish(first);
        // the lock ended with its process
        let mut next = command(program, again, here).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(500));
        assert!(next.try_wait().unwrap().is_none(), "{again}");
        next.kill().unwrap();
        finish(next);
    }
}
