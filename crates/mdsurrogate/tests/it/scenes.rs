//! Scenes through the command line: refusals, interruptions, invalid data.
//!
//! A scene in `tests/bad/` states its message: each leading `# expect: TEXT` is a part of it; the line of the
//! error ends in `# <- here`.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// Returns twelve paths of 30 rows, S = E in GPa along one or two axes.
pub fn table() -> String {
    let mut text = String::from("run_id,kind,C11,C22,C33,C12,C13,C23,S11,S22,S33,S12,S13,S23\n");
    for path in 0..12 {
        for row in 0..30 {
            let strain = 0.002 * f64::from(row) * (1.0 + 0.1 * f64::from(path));
            let mut c = [1.0, 1.0, 1.0];
            c[path as usize % 3] += strain;
            if path >= 6 {
                c[(path as usize + 1) % 3] += 0.5 * strain;
            }
            let s = c.map(|c| 500.0 * (c - 1.0));
            let [x, y, z] = c;
            let _ =
                writeln!(text, "p{path},u{},{x},{y},{z},0,0,0,{},{},{},0,0,0", path % 3, s[0], s[1], s[2]);
        }
    }
    text
}

fn run(arguments: &str, here: &Path) -> Output {
    let output = program(arguments, here).output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(!text.contains("panicked") && output.status.code() != Some(101), "a panic:\n{text}");
    output
}

fn program(arguments: &str, here: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mdsurrogate"));
    command.args(arguments.split_whitespace()).current_dir(here).env("NO_COLOR", "1");
    command.env_remove("RUST_BACKTRACE");
    command
}

fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Creates a folder with data and a scene.
fn folder(scene: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("data.csv"), table()).unwrap();
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    folder
}

const HEAD: &str = "version = 1\nprogram = \"mdsurrogate\"\n[data]\nfiles = [\"data.csv\"]\n";

/// Trains an ensemble and an energy for some seconds, long enough for interruptions.
const LONG: &str = "[training]\nepochs = 25\nlearning_rate = 3e-3\nschedule = \"cosine\"\n\
    [[model]]\nkind = \"ann\"\nhidden = [[64, \"relu\"], [64, \"softplus\"], [64, \"tanh\"]]\nmembers = 2\n\
    [[model]]\nkind = \"energy\"\nhidden = [[32, \"softplus\"], [32, \"softplus\"]]\n";

const SEARCH: &str = "[search]\nepochs = 9\ntrials = 5\ninitial = 3\n\
                      [search.space]\nlayers = [1, 2]\nneurons = [8, 24]\nstep = 8\n";

#[test]
fn every_bad_scene_gets_its_message() {
    let bad = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/bad");
    let mut names: Vec<PathBuf> = fs::read_dir(bad).unwrap().map(|entry| entry.unwrap().path()).collect();
    names.sort();
    assert!(names.len() >= 29, "only {} scenes", names.len());
    let mut faults = Vec::new();
    for path in names {
        let text = fs::read_to_string(&path).unwrap();
        let folder = folder(&text);
        let line = text.lines().position(|line| line.ends_with("# <- here")).unwrap() + 1;
        let mut expected: Vec<String> =
            text.lines().map_while(|line| line.strip_prefix("# expect: ")).map(str::to_owned).collect();
        assert!(!expected.is_empty(), "{}", path.display());
        expected.push(format!("[scene.toml:{line}:"));
        for verb in ["check scene.toml", "run scene.toml --output out"] {
            let output = run(verb, folder.path());
            // quoted lines of the scene are not part of the message
            let message: Vec<String> = message(&output)
                .lines()
                .filter(|line| {
                    !line.trim_start().trim_start_matches(|c: char| c.is_ascii_digit()).starts_with(" │")
                })
                .map(str::to_owned)
                .collect();
            let message = message.join("\n");
            let missing = expected.iter().find(|part| !message.contains(part.as_str()));
            if let Some(part) = missing {
                faults.push(format!("{} {verb}: `{part}` is not in\n{message}", path.display()));
            }
            if output.status.code() != Some(2) || folder.path().join("out").exists() {
                faults.push(format!("{} {verb}: {:?}", path.display(), output.status));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Errors of a table name file, line and column or run; nothing is written.
#[test]
fn invalid_data_are_refused() {
    let rows = table();
    let lines: Vec<&str> = rows.lines().collect();
    let replaced = |line: usize, text: String| {
        let mut lines: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
        lines[line] = text;
        lines.join("\n")
    };
    let cells = |line: usize, column: usize, value: &str| {
        let mut cells: Vec<&str> = lines[line].split(',').collect();
        cells[column] = value;
        replaced(line, cells.join(","))
    };
    let one_path: Vec<&str> = lines[..31].to_vec();
    for (table, part) in [
        (cells(7, 8, "NaN"), "data.csv:8: column `S11`: found `NaN`"),
        (cells(7, 2, "-1"), "data.csv"),
        (String::new(), "data.csv"),
        (lines[0].to_owned(), "headings without rows"),
        (one_path.join("\n"), "1 path"),
        (lines[..2].join("\n"), "1 path"),
        (rows.replace("S11,", "S11 [TPa],"), "is a unit wrong?"),
        (rows.clone() + &rows.replace('p', "q").lines().skip(1).collect::<Vec<_>>().join("\n"), "same rows"),
    ] {
        let folder = folder(&(HEAD.to_owned() + LONG));
        fs::write(folder.path().join("data.csv"), table).unwrap();
        let output = run("run scene.toml --output out", folder.path());
        assert!(message(&output).contains(part), "`{part}` is not in\n{}", message(&output));
        assert_eq!(output.status.code(), Some(2));
        assert!(!folder.path().join("out").exists());
    }
}

/// A learning rate of 1000 diverges: the message has epoch and batch, curve and checkpoint remain, the exit
/// code is 1.
#[test]
fn divergence_is_reported() {
    let scene = HEAD.to_owned()
        + &LONG.replace("learning_rate = 3e-3", "learning_rate = 1e3").replace("members = 2", "");
    let folder = folder(&scene.replace("[64, \"tanh\"]", "[64, \"relu\"], [64, \"relu\"], [64, \"relu\"]"));
    let output = run("run scene.toml --output out", folder.path());
    let message = message(&output);
    assert!(
        message.contains("training diverged in epoch 1, batch ") && message.contains("learning rate 1e3"),
        "{message}"
    );
    assert_eq!(output.status.code(), Some(1));
    assert!(
        folder.path().join("out/checkpoint.bin").is_file() && !folder.path().join("out/report.json").exists()
    );
}

#[test]
fn weights_of_another_architecture() {
    let folder = folder(&(HEAD.to_owned() + &LONG.replace("epochs = 25", "epochs = 1")));
    let here = folder.path();
    assert_eq!(run("run scene.toml --output out", here).status.code(), Some(0));
    let both = run("eval scene.toml out/energy.safetensors out/ann.safetensors --output judged", here);
    assert_eq!(both.status.code(), Some(0), "{}", message(&both));
    assert!(String::from_utf8_lossy(&both.stdout).contains("energy.stress_at_rest"));
    // a header with other widths
    let mut bytes = fs::read(here.join("out/energy.safetensors")).unwrap();
    let place = bytes.windows(8).position(|window| window == b"[7,32,32").unwrap();
    bytes[place + 4] = b'1';
    fs::write(here.join("bad.safetensors"), bytes).unwrap();
    for (law, part) in [("bad.safetensors", "shape"), ("data.csv", "no safetensors file")] {
        let output = run(&format!("eval scene.toml {law} --output refused"), here);
        assert_eq!(output.status.code(), Some(2), "{}", message(&output));
        assert!(message(&output).contains(part), "{}", message(&output));
        assert!(!here.join("refused").exists());
    }
}

/// Returns name and bytes of the result files, without times.
fn results(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<(String, Vec<u8>)> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| {
            let bytes = fs::read(entry.path()).unwrap_or_else(|e| panic!("{}: {e}", entry.path().display()));
            (entry.file_name().into_string().unwrap(), bytes)
        })
        .filter(|(name, _)| !name.starts_with("error_against_time"))
        .collect();
    for (name, bytes) in &mut files {
        if name == "report.json" {
            let mut report: serde_json::Value = serde_json::from_slice(bytes).unwrap();
            report.as_object_mut().unwrap().retain(|key, _| key != "seconds" && key != "provenance");
            let values = report["values"].as_object_mut().unwrap();
            values.retain(|name, _| !name.starts_with("error_against_time"));
            *bytes = report.to_string().into_bytes();
        }
    }
    files.sort();
    files
}

/// Trainings and searches that are killed repeatedly and resumed give bit-identical results.
#[test]
fn killed_at_any_time() {
    for scene in [LONG, SEARCH] {
        let folder = folder(&(HEAD.to_owned() + scene));
        let here = folder.path();
        let undisturbed = run("run scene.toml --output undisturbed", here);
        assert_eq!(undisturbed.status.code(), Some(0), "{}", message(&undisturbed));
        let out = here.join("killed");
        let (mut kills, begun) = (0, Instant::now());
        loop {
            let verb = match out.join("checkpoint.bin").is_file() {
                true => "resume killed --checkpoint-every 0",
                false => "run scene.toml --output killed --checkpoint-every 0",
            };
            let mut child = program(verb, here)
                .stdout(std::process::Stdio::null())
                .stderr(std::process::Stdio::null())
                .spawn()
                .unwrap();
            // longer and longer, so that each attempt gets further
            std::thread::sleep(Duration::from_millis(60 + 40 * kills));
            let _ = child.kill();
            if child.wait().unwrap().success() {
                break;
            }
            kills += 1;
            assert!(begun.elapsed() < Duration::from_secs(200), "no end after {kills} kills");
        }
        assert!(kills >= 2, "only {kills} kills hit");
        let (a, b) = (results(&here.join("undisturbed")), results(&out));
        let names =
            |files: &[(String, Vec<u8>)]| files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&a), names(&b));
        for ((name, x), (_, y)) in a.iter().zip(&b) {
            assert!(x == y, "{name} differs");
        }
        // nothing is left to do
        assert!(String::from_utf8_lossy(&run("resume killed", here).stdout).contains("nothing to resume"));
    }
}
