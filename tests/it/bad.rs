//! Malformed and absurd input: exit code 2, the message that helps, nothing written, no panic.
//!
//! Each scene is a patch of a valid one, with its fault and its message: `tests/bad/peri.txt`, `crystfem.txt`
//! and `polycore.txt`, whose heads describe the format; the valid scenes are in `tests/bad/peri/`,
//! `crystfem/` and `polycore/`.

use crate::program::{Ended, command, executable, finish, peri, workspace};
use crate::scenes;
use std::fs;
use std::path::Path;

const MARK: &str = "# <- here";

#[test]
fn every_bad_scene_gets_its_message() {
    judge_all("peri", 541);
}

#[test]
fn every_bad_scene_of_a_part_gets_its_message() {
    judge_all("crystfem", 142);
}

#[test]
fn every_bad_scene_of_a_fit_gets_its_message() {
    judge_all("polycore", 38);
}

/// Scene with one fault.
pub struct BadScene {
    pub name: String,
    pub text: String,
    /// Parts of its message.
    expected: Vec<String>,
}

/// Reads the patches of a program and writes their scenes and files to a folder.
pub fn write_bad_scenes(program: &str, folder: &Path) -> Vec<BadScene> {
    let bad = workspace().join("tests/bad");
    for files in ["clouds", "inputs"] {
        fs::create_dir(folder.join(files)).unwrap();
        for file in fs::read_dir(bad.join(files)).unwrap().map(|entry| entry.unwrap()) {
            fs::copy(file.path(), folder.join(files).join(file.file_name())).unwrap();
        }
    }
    let table = fs::read_to_string(bad.join(program).with_extension("txt")).unwrap();
    let entries = table.split("\n= ").skip(1).map(|entry| {
        let mut lines = entry.lines();
        let head = lines.next().unwrap_or_default();
        let (name, base) = head.split_once(" of ").unwrap_or((head, ""));
        let base = match base {
            "" => String::new(),
            base => fs::read_to_string(bad.join(program).join(base).with_extension("toml")).unwrap(),
        };
        let (expected, patch): (Vec<&str>, Vec<&str>) = lines.partition(|line| line.starts_with("? "));
        let expected = expected.into_iter().map(|line| line[2..].to_owned()).collect();
        let text =
            patched(&base, &patch).unwrap_or_else(|line| panic!("{name}: `{line}` is not in its base"));
        let text = text.replace("../../", &format!("{}/", workspace().display()));
        fs::write(folder.join(format!("{name}.toml")), &text).unwrap();
        BadScene { name: name.to_owned(), text, expected }
    });
    entries.collect()
}

/// Applies a patch; the error is the line that is missing in the base.
fn patched(base: &str, patch: &[&str]) -> Result<String, String> {
    let mut rest = base.lines();
    let mut scene: Vec<&str> = Vec::new();
    if patch.first().is_some_and(|line| line.starts_with('+')) {
        scene.extend(rest.by_ref());
    }
    for line in patch.iter().filter(|line| !line.is_empty()) {
        let (kind, line) = (&line[..1], line.get(2..).unwrap_or_default());
        if kind != "+" {
            let unmarked = line.strip_suffix(MARK).map_or(line, str::trim_end);
            loop {
                match rest.next() {
                    Some(other) if other == unmarked => break,
                    Some(other) => scene.push(other),
                    None => return Err(line.to_owned()),
                }
            }
        }
        if kind != "-" {
            scene.push(line);
        }
    }
    scene.extend(rest);
    Ok(scene.iter().map(|line| format!("{line}\n")).collect())
}

fn judge_all(program: &str, count: usize) {
    let folder = tempfile::tempdir().unwrap();
    let scenes = write_bad_scenes(program, folder.path());
    assert_eq!(scenes.len(), count);
    // the fault is in the patch
    for base in fs::read_dir(workspace().join("tests/bad").join(program)).unwrap() {
        let text = fs::read_to_string(base.unwrap().path()).unwrap();
        let text = text.replace("../../", &format!("{}/", workspace().display()));
        fs::write(folder.path().join("base.toml"), text).unwrap();
        finish(command(program, "check base.toml", folder.path()).spawn().unwrap()).with_code(0);
    }
    let failures: Vec<String> =
        scenes.iter().filter_map(|scene| judge(program, folder.path(), scene).err()).collect();
    assert!(failures.is_empty(), "{} of {}:\n{}", failures.len(), scenes.len(), failures.join("\n"));
}

fn judge(program: &str, folder: &Path, scene: &BadScene) -> Result<(), String> {
    let BadScene { name, text, expected } = scene;
    let fault = |what: String| Err(format!("{name}: {what}"));
    if expected.is_empty() {
        return fault("has no message".into());
    }
    let temporary = tempfile::tempdir().unwrap();
    let output = temporary.path().join("out");
    let verb = |arguments: String| finish(command(program, &arguments, folder).spawn().unwrap());
    let check = verb(format!("check {name}.toml"));
    let run = verb(format!("run {name}.toml --output {}", output.display()));
    for (verb, ended) in [("check", &check), ("run", &run)] {
        if ended.code != Some(2) || !ended.stdout.is_empty() {
            return fault(format!("{verb}: exit code {:?}, prints `{}`", ended.code, ended.stdout));
        }
        let message = ended.message();
        if let Some(missing) = expected.iter().find(|part| !message.contains(part.as_str())) {
            return fault(format!("{verb}: `{missing}` is not in\n{}", ended.stderr));
        }
        let mark = text.lines().position(|line| line.ends_with(MARK));
        let place = mark.map_or(format!("[{name}.toml:"), |line| format!("[{name}.toml:{}:", line + 1));
        if !message.contains(&place) {
            return fault(format!("{verb}: `{place}` is not in\n{}", ended.stderr));
        }
    }
    if fs::read_dir(temporary.path()).unwrap().count() > 0 {
        return fault("something was written".into());
    }
    Ok(())
}

/// Checks and runs a scene with the given bytes; returns the output of `check`.
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
    refused(b"version = 1\n", "").tells("missing `program`");
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
    refused(deep("title = \"", "long", "\"\n").as_bytes(), "").tells("missing `program`");
}

/// A valid scene cut anywhere is refused, or is itself valid (if only a trailing part is missing); it never
/// panics.
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
            peri(&format!("{verb} /dev/null"), here).with_code(2).tells("missing `version`");
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
