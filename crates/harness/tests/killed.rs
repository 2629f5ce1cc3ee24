//! A writer of VTKHDF killed with SIGKILL at arbitrary times leaves only complete files, and can be resumed.
#![cfg(unix)]

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use harness::output::vtkhdf::{ParticleSeries, read};

const TARGET: &str = "POLY_TEST_SERIES";
const POINTS: usize = 2000;
const STEPS: usize = 6;

fn step(series: &mut ParticleSeries, step: usize) {
    let points: Vec<[f64; 3]> =
        (0..POINTS).map(|i| [(i * step) as f64, (i as f64).sin(), step as f64]).collect();
    let speed: Vec<f64> = points.iter().map(|point| point[0] * 0.3).collect();
    series.step(step as f64, &points, &[("speed", 1, &speed)]).unwrap();
}

/// Process that `survives_kill_9` starts and kills; no test of its own.
#[test]
#[ignore = "the process that survives_kill_9 kills"]
fn writer() {
    let path = PathBuf::from(std::env::var_os(TARGET).expect("run by survives_kill_9"));
    loop {
        let mut series = ParticleSeries::create(&path).unwrap();
        (0..STEPS).for_each(|k| step(&mut series, k));
        series.finish().unwrap();
    }
}

/// Every file that readers would open is complete; returns how many frames there are.
fn complete_frames(path: &Path) -> usize {
    if path.exists() {
        assert_eq!(read(path).unwrap().len(), STEPS);
    }
    let Ok(entries) = std::fs::read_dir(path.with_extension("frames")) else { return 0 };
    let frames = entries.map(|entry| entry.unwrap().path());
    let visible: Vec<PathBuf> =
        frames.filter(|path| path.extension().is_some_and(|e| e == "vtkhdf")).collect();
    for frame in &visible {
        let series = read(frame).unwrap();
        assert_eq!(series.points(0).unwrap().len(), series.data(0, "speed").unwrap().len());
    }
    // the last action may have been the removal of merged frames
    if path.exists() { STEPS } else { visible.len() }
}

#[test]
fn survives_kill_9() {
    let directory = tempfile::tempdir().unwrap();
    let undisturbed = directory.path().join("undisturbed.vtkhdf");
    let mut series = ParticleSeries::create(&undisturbed).unwrap();
    (0..STEPS).for_each(|k| step(&mut series, k));
    series.finish().unwrap();
    for round in 0..6 {
        let path = directory.path().join("killed.vtkhdf");
        let mut writer = Command::new(std::env::current_exe().unwrap());
        writer.args(["--ignored", "--exact", "writer"]).env(TARGET, &path);
        let mut child = writer.stdout(std::process::Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(15 + 29 * round));
        child.kill().unwrap();
        child.wait().unwrap();
        let done = complete_frames(&path);
        // a checkpoint is never newer than the last frame
        for checkpoint in [done, done.saturating_sub(1)] {
            let mut series = ParticleSeries::resume(&path, checkpoint).unwrap();
            (checkpoint..STEPS).for_each(|k| step(&mut series, k));
            series.finish().unwrap();
            assert!(std::fs::read(&path).unwrap() == std::fs::read(&undisturbed).unwrap(), "round {round}");
        }
    }
}
