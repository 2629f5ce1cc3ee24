//! Malformed and absurd input: exit code 2, the message that helps, nothing written, no panic.
//!
//! A scene in `tests/bad/` (of `peri`) or `tests/bad-parts/` (of `crystfem`) says itself what it must be told: each leading `# expect: TEXT` is a part of the message;
//! the line at fault ends in `# <- here`.

use crate::program::{Ended, command, executable, finish, peri, workspace};
use crate::scenes;
use std::fs;
use std::path::Path;

const MARK: &str = "# <- here";

#[test]
fn every_bad_scene_gets_its_message() {
    judge_all("peri", "tests/bad", 100);
}

#[test]
fn every_bad_scene_of_a_part_gets_its_message() {
    judge_all("crystfem", "tests/bad-parts", 60);
}

fn judge_all(program: &str, folder: &str, least: usize) {
    let folder = workspace().join(folder);
    let mut names: Vec<String> = fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.retain(|name| name.ends_with(".toml"));
    names.sort();
    let failures: Vec<String> = names.iter().filter_map(|name| judge(program, &folder, name).err()).collect();
    assert!(names.len() >= least, "only {} scenes", names.len());
    assert!(failures.is_empty(), "{} of {}:\n{}", failures.len(), names.len(), failures.join("\n"));
}

fn judge(program: &str, folder: &Path, name: &str) -> Result<(), String> {
    let text = fs::read_to_string(folder.join(name)).unwrap();
    let expected: Vec<&str> = text.lines().map_while(|line| line.strip_prefix("# expect: ")).collect();
    let fault = |what: String| Err(format!("{name}: {what}"));
    if expected.is_empty() {
        return fault("has no `# expect:`".into());
    }
    let temporary = tempfile::tempdir().unwrap();
    let output = temporary.path().join("out");
    let verb = |arguments: String| finish(command(program, &arguments, folder).spawn().unwrap());
    let check = verb(format!("check {name}"));
    let run = verb(format!("run {name} --output {}", output.display()));
    for (verb, ended) in [("check", &check), ("run", &run)] {
        if ended.code != Some(2) || !ended.stdout.is_empty() {
            return fault(format!("{verb}: exit code {:?}, prints `{}`", ended.code, ended.stdout));
        }
        let message = ended.message();
        if let Some(missing) = expected.iter().find(|&&part| !message.contains(part)) {
            return fault(format!("{verb}: `{missing}` is not in\n{}", ended.stderr));
        }
        let mark = text.lines().position(|line| line.ends_with(MARK));
        let place = mark.map_or(format!("[{name}:"), |line| format!("[{name}:{}:", line + 1));
        if !message.contains(&place) {
            return fault(format!("{verb}: `{place}` is not in\n{}", ended.stderr));
        }
    }
    if fs::read_dir(temporary.path()).unwrap().count() > 0 {
        return fault("something was written".into());
    }
    Ok(())
}

/// Checks and runs a scene with the given bytes; returns what `check` told.
fn refused(bytes: &[u8], arguments: &str) -> Ended {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("scene.toml"), bytes).unwrap();
    let run = peri(&format!("run scene.toml --output out {arguments}"), directory.path()).with_code(2);
    assert!(!directory.path().join("out").exists(), "something was written");
    let check = peri(&format!("check scene.toml {arguments}"), directory.path()).with_code(2);
    assert_eq!(run.stderr, check.stderr);
    assert_eq!(run.stdout + &check.stdout, "");
    check
}

#[test]
fn files_that_are_no_text() {
    refused(b"version = 1\n\xff\xfe", "").tells("scene.toml: is not UTF-8 text (byte 12, line 2)");
    refused(b"version = 1\n", "").tells("`program` is missing");
    refused(b"version = 1\n\0\x01\x02", "").tells("not valid TOML");
    refused(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "").tells("is not UTF-8 text (byte 0, line 1)");
    refused(&b"# padding\n".repeat(2_000_000), "").tells("is larger than 16 MiB");
}

#[test]
fn nesting_without_end() {
    let deep =
        |head: &str, piece: &str, tail: &str| format!("version = 1\n{head}{}{tail}", piece.repeat(100_000));
    refused(deep("a = ", "[", "").as_bytes(), "").tells("not valid TOML");
    refused(deep("a = ", "{ b = ", "").as_bytes(), "").tells("not valid TOML");
    // a line longer than the 65535 columns of the pictures
    refused(deep("[a", ".a", "]\n").as_bytes(), "").tells("scene.toml:2");
    refused(deep("title = \"", "long", "\"\n").as_bytes(), "").tells("`program` is missing");
}

/// A valid scene cut anywhere is refused, or is itself valid (where only a trailing part is gone); it never panics.
#[test]
fn cut_anywhere() {
    let scene = scenes::plate("\"100 mm\"", "1e-3");
    let directory = tempfile::tempdir().unwrap();
    let mut refused = 0;
    for cut in (0..scene.len()).step_by(23) {
        fs::write(directory.path().join("scene.toml"), &scene[..cut]).unwrap();
        let ended = peri("check scene.toml", directory.path());
        assert!(matches!(ended.code, Some(0 | 2)), "cut at {cut}: {ended:?}");
        refused += usize::from(ended.code == Some(2));
    }
    assert!(refused > 20, "{refused}");
}

#[test]
fn what_is_not_a_file() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::create_dir(here.join("folder")).unwrap();
    fs::write(here.join("folder/case.toml"), "").unwrap();
    fs::write(here.join("plate.toml"), "").unwrap();
    for verb in ["check", "run"] {
        let ended = peri(&format!("{verb} folder"), here).with_code(2);
        ended.tells("folder: is a directory, not a scene file");
        ended.tells("did you mean folder/case.toml?");
        let ended = peri(&format!("{verb} plat.toml"), here).with_code(2);
        ended.tells("plat.toml: there is no such file");
        ended.tells("did you mean ./plate.toml?");
        peri(&format!("{verb} nowhere/case.toml"), here)
            .with_code(2)
            .tells("there is no directory nowhere either");
        if cfg!(unix) {
            peri(&format!("{verb} /dev/zero"), here).with_code(2).tells("is larger than 16 MiB");
            peri(&format!("{verb} /dev/null"), here).with_code(2).tells("`version` is missing");
        }
    }
    assert!(!here.join("out").exists());
}

#[test]
fn output_directories_that_cannot_be() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("scene.toml"), scenes::plate("\"100 mm\"", "1e-3")).unwrap();
    let run = |output: &str| peri(&format!("run scene.toml --output {output}"), here).with_code(2);
    run("scene.toml").tells("the output directory scene.toml cannot be used: it is a file");
    run("scene.toml/below").tells("the output directory scene.toml/below cannot be used");
    if cfg!(target_os = "linux") {
        run("/proc/out").tells("the output directory /proc/out cannot be used");
    }
    assert_eq!(fs::read_dir(here).unwrap().count(), 1);
}

#[test]
fn a_quick_run_of_nothing() {
    let scene = scenes::plate("\"100 mm\"", "1e-3") + "quick = false\n";
    refused(scene.as_bytes(), "--quick").tells("`study`: found no variant left in a --quick run");
}

/// 200,000 points within one horizon would make 4e10 bonds.
#[test]
fn a_horizon_around_the_whole_cloud() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let mut points = String::from("x,y,volume\n");
    for index in 0..200_000 {
        points += &format!("{}e-3,{}e-3,1e-9\n", index % 500, index / 500);
    }
    fs::write(here.join("points.csv"), points).unwrap();
    fs::write(here.join("scene.toml"), scenes::strip().replace("3.2 mm", "1 km")).unwrap();
    let ended = peri("run scene.toml --output out", here).with_code(2);
    ended.tells("`body.horizon`: found 1000 m, which makes about 1.4e10 bonds that need");
    ended.tells("take a smaller horizon");
    assert!(!here.join("out").exists());
}

/// No single changed byte of a valid scene makes `peri check` panic or hang.
#[test]
fn changed_bytes() {
    let scene = scenes::plate("\"100 mm\"", "1e-3").into_bytes();
    let directory = tempfile::tempdir().unwrap();
    let mut random = scenes::Random(7);
    let mut pick = |count: usize| (random.next() * count as f64) as usize;
    for _ in 0..150 {
        let mut changed = scene.clone();
        let at = pick(changed.len());
        changed[at] = b"0123456789-.eE\"'[]{}=,#\n \xff\0zm"[pick(29)];
        fs::write(directory.path().join("scene.toml"), &changed).unwrap();
        let child = command("peri", "check scene.toml", directory.path()).spawn().unwrap();
        let ended = finish(child);
        let text = String::from_utf8_lossy(&changed);
        assert!(matches!(ended.code, Some(0 | 2)), "{ended:?} for\n{text}");
    }
    assert!(executable("peri").is_file());
}
