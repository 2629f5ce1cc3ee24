//! Pictures of named states, and animations.

use crate::answers::{self, RUBBER, solve};
use std::fs;
use std::path::Path;

const BRITTLE: &str =
    "[material]\nyoungs_modulus = \"1 MPa\"\nlaw = \"linear\"\ncritical = { stretch = 1.04 }\n";
const STRESS: &str = "[stress]\nmeasures = [\"constitutive\"]\n";

/// A strip of 20 × 6 particles, pulled at its right end.
fn strip(material: &str, rest: &str) -> String {
    let head = "[[boundary]]\nname = \"head\"\nside = \"x+\"\ndisplacement = [\"2 mm\", \"1 mm\"]\n";
    answers::strip(material, &format!("{head}{rest}"))
}

fn picture(output: &Path, kind: &str, state: &str) -> Vec<u8> {
    let path = output.join(format!("{kind}_dx-1mm_m-3.015{state}.png"));
    fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The picture of a state is that of a run which ends there, whatever follows: of a load factor, and of the
/// end of a step.
#[test]
fn pictures_of_states_are_those_of_shorter_runs() {
    let output = "[output]\nenergy = true\n[[output.state]]\nname = \"half\"\n";
    let solver = |path: &str, steps: u32| format!("{STRESS}[solver]\npath = {path}\nsteps = {steps}\n");
    let at_factor = format!("{output}factor = 0.5\n");
    let texts = [
        strip(RUBBER, &(solver("[1]", 4) + &at_factor)),
        // the first step of this load factor
        strip(RUBBER, &(solver("[1, 0]", 8) + &at_factor)),
        strip(RUBBER, &(solver("[0.5]", 2) + &at_factor)),
        strip(
            RUBBER,
            &(solver("[0.5]", 2)
                + "[[step]]\nboundary = [{ name = \"foot\", side = \"x-\", displacement = [\"0 mm\", \"0 \
                   mm\"] }]\n"
                + &format!("{output}step = 1\n")),
        ),
    ];
    let folders: Vec<_> = texts.iter().map(|_| tempfile::tempdir().unwrap()).collect();
    for (text, folder) in texts.iter().zip(&folders) {
        let finished = solve(text, folder.path());
        assert!(finished.outcomes[0].warnings.iter().all(|warning| !warning.contains("output.state")));
    }
    for kind in ["stress", "energy"] {
        let all: Vec<Vec<u8>> = folders.iter().map(|folder| picture(folder.path(), kind, "_half")).collect();
        assert!(all[1..].iter().all(|other| *other == all[0]), "{kind}");
        assert_ne!(all[0], picture(folders[0].path(), kind, ""), "{kind}");
    }
}

/// In explicit dynamics a state is the first row from its time on.
#[test]
fn states_in_time() {
    let rest = r#"
[solver]
method = "verlet"
[dynamics]
density = "1000 kg/m^3"
end_time = "4 ms"
records = 8
[output]
energy = true
state = [{ name = "early", time = "0.9 ms" }, { name = "last", time = "4 ms" }]
"#;
    let directory = tempfile::tempdir().unwrap();
    let moving = strip(RUBBER, rest);
    let finished = solve(&moving, directory.path());
    assert_eq!(finished.outcomes[0].history[1].time, 1e-3);
    // rows at other times in between, the same time steps
    let shorter = tempfile::tempdir().unwrap();
    solve(&moving.replace("4 ms", "1 ms").replace("records = 8", "records = 2"), shorter.path());
    assert_eq!(picture(directory.path(), "energy", "_early"), picture(shorter.path(), "energy", "_early"));
    picture(directory.path(), "energy", "_last");
}

/// A run that ends before a state says so.
#[test]
fn states_that_are_not_reached() {
    let rest = r#"
[solver]
steps = 20
stop_below = 0.1
[output]
energy = true
state = [{ name = "whole", factor = 0.25 }, { name = "end", factor = 1 }]
"#;
    let directory = tempfile::tempdir().unwrap();
    let text = strip(BRITTLE, rest).replace("[\"2 mm\", \"1 mm\"]", "[\"2 mm\", \"0 mm\"]");
    let finished = solve(&text, directory.path());
    assert!(finished.outcomes[0].history.len() < 20);
    let warnings: Vec<&String> =
        finished.outcomes[0].warnings.iter().filter(|text| text.contains("output.state")).collect();
    assert!(matches!(&warnings[..], [one] if one.contains("before the state `end`")), "{warnings:?}");
    picture(directory.path(), "energy", "_whole");
    assert!(!directory.path().join("energy_dx-1mm_m-3.015_end.png").exists());
}

/// Runs the program with a folder of programs as the PATH; returns what it says.
#[cfg(unix)]
fn run_with_path(text: &str, folder: &Path) -> String {
    fs::write(folder.join("scene.toml"), text).unwrap();
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_peri"));
    command.args(["run", "scene.toml", "--output", "out", "--threads", "1"]).current_dir(folder);
    let ended = command.env("PATH", folder.join("bin")).output().unwrap();
    let all = [ended.stdout, ended.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert_eq!(ended.status.code(), Some(0), "{all}");
    all
}

/// A GIF needs no other program; an MP4 is what `ffmpeg` makes of the frames, else a GIF with a warning that
/// says why.
#[cfg(unix)]
#[test]
fn animations() {
    use std::os::unix::fs::PermissionsExt;
    let text = |kind: &str| {
        strip(RUBBER, &format!("{STRESS}[solver]\nsteps = 4\n[output]\nevery = 1\nanimation = \"{kind}\"\n"))
    };
    let program = |folder: &Path, script: &str| {
        fs::create_dir_all(folder.join("bin")).unwrap();
        let path = folder.join("bin/ffmpeg");
        fs::write(&path, format!("#!/bin/sh\n{script}\n")).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    };
    let folder = || tempfile::tempdir().unwrap();
    let file = |folder: &Path, kind: &str| folder.join(format!("out/animation_dx-1mm_m-3.015.{kind}"));
    // size of the picture and number of frames
    let gif = |folder: &Path| {
        let bytes = fs::read(file(folder, "gif")).unwrap();
        let mut decoder = gif::DecodeOptions::new().read_info(&bytes[..]).unwrap();
        let size = [decoder.width(), decoder.height()].map(usize::from);
        let mut frames = 0;
        while decoder.read_next_frame().unwrap().is_some() {
            frames += 1;
        }
        (size, frames)
    };
    let plain = folder();
    let said = run_with_path(&text("gif"), plain.path());
    assert!(!said.contains("output.animation"), "{said}");
    let ([width, height], frames) = gif(plain.path());
    assert_eq!(frames, 4);

    let none = folder();
    let said = run_with_path(&text("mp4"), none.path());
    assert!(said.contains("a GIF in place of the MP4") && said.contains("no `ffmpeg` on the PATH"), "{said}");
    assert_eq!(gif(none.path()).1, 4);
    assert!(!file(none.path(), "mp4").exists());

    let broken = folder();
    program(broken.path(), "echo 'Unknown encoder libx264' >&2; exit 3");
    let said = run_with_path(&text("mp4"), broken.path());
    assert!(said.contains("Unknown encoder libx264"), "{said}");
    assert_eq!(gif(broken.path()).1, 4);

    // what it gets: 3 bytes for each pixel, the last frame for as long as 20
    let whole = folder();
    program(whole.path(), "for last; do :; done; exec /bin/cat > \"$last\"");
    let said = run_with_path(&text("mp4"), whole.path());
    assert!(!said.contains("output.animation"), "{said}");
    assert_eq!(fs::read(file(whole.path(), "mp4")).unwrap().len(), 3 * width * height * 23);
    assert!(!file(whole.path(), "gif").exists() && !file(whole.path(), "part.mp4").exists());
}
