//! A run that was killed or interrupted continues with `peri resume` and ends with the same bits.

use crate::program::{command, finish, peri};
use crate::results::{assert_same, report};
use crate::scenes::{self, Random};
use std::fs;
use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

/// A plate of two variants that runs for about a second and a half on one thread.
const LONG: (&str, &str) = ("\"10 mm\", \"5 mm\"", "1e-7");

/// The slower method, so that there is something to interrupt.
fn relaxed(scene: &str) -> String {
    scene.replace("[solver]", "[solver]\nmethod = \"adr\"")
}

fn start(arguments: &str, here: &Path) -> Child {
    command("peri", arguments, here).spawn().unwrap()
}

/// Kills a program (SIGKILL) after a while; false if it had ended before.
fn killed(mut child: Child, delay: Duration) -> bool {
    std::thread::sleep(delay);
    // if it has ended there is nothing to kill
    let _ = child.kill();
    let ended = finish(child);
    assert!(matches!(ended.code, None | Some(0)), "{ended:?}");
    ended.code.is_none()
}

/// Waits until a file exists.
#[track_caller]
fn wait_for(path: &Path) {
    let begun = Instant::now();
    while !path.is_file() {
        assert!(begun.elapsed() < Duration::from_secs(60), "{} does not appear", path.display());
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Starts a run of `scene.toml` and ends it as soon as it has written a checkpoint in the middle of a
/// variant.
fn interrupt(here: &Path, signal: &str) -> crate::program::Ended {
    let checkpoint = here.join("out/checkpoint.bin");
    let child = start("run scene.toml --output out --threads 1 --checkpoint-every 0", here);
    wait_for(&checkpoint);
    // the first checkpoint holds the scene only; those with a state are far larger
    let empty = 2 * fs::metadata(here.join("scene.toml")).unwrap().len() + 1000;
    let begun = Instant::now();
    while fs::metadata(&checkpoint).map_or(0, |file| file.len()) < empty {
        assert!(begun.elapsed() < Duration::from_secs(60), "no checkpoint with a state");
        std::thread::sleep(Duration::from_millis(1));
    }
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    finish(child)
}

#[test]
#[ignore = "takes 6 to 35 s; .ci/run runs it"]
fn killed_at_random_times() {
    survives_kills(&relaxed(&scenes::plate(LONG.0, LONG.1)));
}

/// Broken bonds, histories and the fields of stages are restored.
#[test]
#[ignore = "takes 6 to 35 s; .ci/run runs it"]
fn killed_while_it_breaks() {
    survives_kills(&scenes::fracture("2 mm", "[contact]"));
    survives_kills(&scenes::fracture("2 mm", "method = \"lbfgs\""));
}

/// Variants solved at the same time: some finished, some running, some not begun.
#[test]
#[ignore = "takes 6 to 35 s; .ci/run runs it"]
fn killed_with_several_variants() {
    survives_kills(&several());
}

/// A bar of four spacings with a crack.
fn several() -> String {
    let scene = relaxed(&scenes::bar().replace("1e-4", "1e-8"));
    scene + "[[study]]\nspacing = [\"20 mm\", \"10 mm\", \"8 mm\", \"16 mm\"]\n"
}

/// The error is that of the first variant that fails, in whichever order they fail; the others can be
/// continued.
#[test]
fn several_variants_of_which_one_fails() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let short =
        "[[study]]\nname = \"short\"\nsolver = { method = \"adr\", tolerance = 1e-8, max_iterations = 40 }\n";
    let shorter = short.replace("40", "20").replace("\"short\"", "\"shorter\"");
    fs::write(here.join("scene.toml"), format!("{}{short}{shorter}", several())).unwrap();
    for threads in 1..=3 {
        let ended =
            peri(&format!("run scene.toml --output out{threads} --threads {threads}"), here).with_code(1);
        ended.tells("short: not converged after 40 iterations");
        assert!(here.join(format!("out{threads}/checkpoint.bin")).is_file());
    }
}

/// Explicit dynamics in mixed precision, whose rounded displacements are not part of a checkpoint.
#[test]
fn killed_while_it_cracks() {
    survives_kills(&scenes::cracking("0.5 mm", "mixed"));
}

/// Friction, which is a part of the forces of a state, and moving planes.
#[test]
fn killed_while_it_rubs() {
    let case = concat!(env!("CARGO_MANIFEST_DIR"), "/../cases/ch5/rubber-friction/case.toml");
    let scene = fs::read_to_string(case).unwrap();
    let (scene, _) = scene.split_once("[[expect]]").unwrap();
    survives_kills(&scene.replace("end_time = \"0.5 s\"", "end_time = \"0.2 s\""));
}

/// Steps in sequence: statics, dynamics from there, statics again with a crack that appears.
#[test]
fn killed_between_and_within_steps() {
    let case = concat!(env!("CARGO_MANIFEST_DIR"), "/../cases/time/let-go/case.toml");
    let scene = fs::read_to_string(case).unwrap();
    let (scene, _) = scene.split_once("[[study]]").unwrap();
    let again = "[[step]]\nboundary = [{ side = \"x-\", traction = [\"-5 kPa\", \"0 kPa\"] }, \
                 { side = \"x+\", traction = [\"5 kPa\", \"0 kPa\"] }]\n\
                 solver = { steps = 4, tolerance = 1e-8 }\n\
                 cracks = [{ from = [\"50 mm\", \"-1 mm\"], to = [\"50 mm\", \"1.5 mm\"] }]\n";
    survives_kills(&format!("{scene}{again}"));
}

/// A press that closes (statics), a rough floor that moves below it (dynamics), and both go on (statics).
#[test]
fn killed_between_steps_in_contact() {
    survives_kills(scenes::STEPS_IN_CONTACT);
}

/// Layers, stresses and fields.
#[test]
fn killed_while_it_warps() {
    survives_kills_of("crystfem", &crate::parts::warped());
}

/// Layers, crystallization with its latent heat, probes.
#[test]
#[ignore = "takes 6 to 35 s; .ci/run runs it"]
fn killed_while_it_prints() {
    survives_kills_of("crystfem", &crate::parts::studies());
    survives_kills_of(
        "crystfem",
        &crate::parts::BAR.replace("tolerance = \"1 K\"", "tolerance = \"0.02 K\""),
    );
}

fn survives_kills(scene: &str) {
    survives_kills_of("peri", scene);
}

fn survives_kills_of(program: &str, scene: &str) {
    let run = |line: &str, here: &Path| finish(command(program, line, here).spawn().unwrap());
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("plate.toml"), scene).unwrap();
    run("run plate.toml --output undisturbed --threads 1", here).with_code(0);
    let mut random = Random(2026);
    let mut kills = 0;
    for round in 0..3 {
        let output = format!("killed{round}");
        let out = here.join(&output);
        let line = || {
            // killed in its first milliseconds, a run has nothing to resume
            let verb = if out.join("checkpoint.bin").is_file() {
                format!("resume {output}")
            } else {
                format!("run plate.toml --output {output}")
            };
            format!("{verb} --checkpoint-every 0.02 --threads {}", 1 + round % 2)
        };
        for _ in 0..12 {
            let delay = Duration::from_secs_f64(0.5 * random.next());
            if !killed(command(program, &line(), here).spawn().unwrap(), delay) {
                break;
            }
            kills += 1;
        }
        if !out.join("report.json").is_file() || out.join("checkpoint.bin").is_file() {
            run(&line(), here).with_code(0);
        }
        assert_same(&here.join("undisturbed"), &out);
    }
    assert!(kills >= 3, "only {kills} kills hit");
}

#[test]
#[cfg(unix)]
fn interrupted_by_the_user() {
    for (signal, scene, points) in [
        ("-INT", scenes::plate("\"10 mm\"", "1e-7"), None),
        ("-TERM", scenes::bar().replace("1e-4", "1e-7"), None),
        ("-INT", scenes::strip().replace("1e-6", "1e-9"), Some(scenes::points())),
    ] {
        let directory = tempfile::tempdir().unwrap();
        let here = directory.path();
        let scene = relaxed(&scene);
        fs::write(here.join("scene.toml"), &scene).unwrap();
        if let Some(points) = &points {
            fs::write(here.join("points.csv"), points).unwrap();
        }
        peri("run scene.toml --output undisturbed", here).with_code(0);
        let ended = interrupt(here, signal).with_code(130);
        ended.tells("interrupted; resume with `peri resume out`");
        assert!(!here.join("out/report.json").exists());
        // from another folder, on other threads, and without the scene, whose text is in the checkpoint
        fs::remove_file(here.join("scene.toml")).unwrap();
        let elsewhere = tempfile::tempdir().unwrap();
        let out = here.join("out");
        peri(&format!("resume {} --threads 2", out.display()), elsewhere.path()).with_code(0);
        assert_same(&here.join("undisturbed"), &out);
        assert!(report(&out)["provenance"]["scene"].as_str().unwrap().starts_with(&scene));

        let again = peri("resume out", here).with_code(0);
        again.shows("out is finished: nothing to resume");
        assert_same(&here.join("undisturbed"), &out);
    }
}

#[test]
#[cfg(unix)]
fn checkpoints_that_cannot_be_used() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("scene.toml"), relaxed(&scenes::strip().replace("1e-6", "1e-9"))).unwrap();
    fs::write(here.join("points.csv"), scenes::points()).unwrap();
    peri("run scene.toml --output undisturbed", here).with_code(0);
    interrupt(here, "-KILL");
    let path = here.join("out/checkpoint.bin");
    let bytes = fs::read(&path).unwrap();
    let refused = |bytes: &[u8], told: &str| {
        fs::write(&path, bytes).unwrap();
        let ended = peri("resume out", here).with_code(2);
        ended.tells("error: checkpoint out/checkpoint.bin: ");
        ended.tells(told);
        assert!(!here.join("out/report.json").exists());
        assert_eq!(fs::read(&path).unwrap(), bytes, "it stays as it is");
    };
    let damaged = "damaged or truncated";
    refused(&bytes[..bytes.len() / 2], damaged);
    refused(&bytes[..bytes.len() - 1], damaged);
    refused(&[&bytes[..], b"more"].concat(), damaged);
    for at in [9, 16, 40, bytes.len() / 3, bytes.len() - 9, bytes.len() - 1] {
        let mut changed = bytes.clone();
        changed[at] ^= 0x10;
        refused(&changed, damaged);
    }
    refused(b"", "not a checkpoint of this version");
    refused(b"peri-ck1", "not a checkpoint of this version");
    refused(&bytes[8..], "not a checkpoint of this version");

    // the points that the scene names have changed
    fs::write(&path, &bytes).unwrap();
    let points = scenes::points();
    let half: Vec<&str> = points.lines().take(800).collect();
    fs::write(here.join("points.csv"), half.join("\n")).unwrap();
    peri("resume out", here).with_code(2).tells("the file points.csv has changed since this run began");
    fs::remove_file(here.join("points.csv")).unwrap();
    peri("resume out", here).with_code(2).tells("points.csv");

    fs::write(here.join("points.csv"), points).unwrap();
    peri("resume out", here).with_code(0);
    assert_same(&here.join("undisturbed"), &here.join("out"));
}

#[test]
fn nothing_to_resume() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::create_dir(here.join("empty")).unwrap();
    fs::write(here.join("file"), "").unwrap();
    for name in ["empty", "nowhere", "file"] {
        let ended = peri(&format!("resume {name}"), here).with_code(2);
        ended.tells(&format!("error: checkpoint {name}/checkpoint.bin: there is none"));
    }
    assert!(!here.join("nowhere").exists());
}
