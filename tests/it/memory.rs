//! Memory of whole programs (Linux only): a run takes no more than `check` states, and a large one not much
//! less; scenes of absurd size are refused before anything is allocated.

#![cfg(target_os = "linux")]

use crate::program::{Ended, command, finish};
use crate::{parts, scenes};
use std::fs;
use std::path::Path;
use std::time::Duration;

/// Largest ratio of stated to used memory, for needs above the second number; below it constants dominate.
/// Stated is the allocation, used are the pages written: most sites of a thin body are not.
const LARGE: f64 = 100e6;
const FACTOR: f64 = 4.0;
/// Memory that a program may take before it refuses a scene, bytes, beside [`TABLE`] times its tables' text.
const REFUSED: f64 = 20e6;
const TABLE: f64 = 10.0;

/// Runs a program; returns its output and its peak memory, bytes (VmHWM of proc_pid_status(5)).
fn watched(program: &str, arguments: &str, here: &Path) -> (Ended, f64) {
    let child = command(program, arguments, here).spawn().unwrap();
    let status = format!("/proc/{}/status", child.id());
    // of a program that has ended there is no such line
    let peak = move || -> Option<f64> {
        let text = fs::read_to_string(&status).ok()?;
        let line = text.lines().find(|line| line.starts_with("VmHWM:"))?;
        Some(1024.0 * line.split_whitespace().nth(1)?.parse::<f64>().ok()?)
    };
    let watch = std::thread::spawn(move || {
        let mut most = 0.0;
        while let Some(now) = peak() {
            most = now;
            std::thread::sleep(Duration::from_micros(100));
        }
        most
    });
    (finish(child), watch.join().unwrap())
}

/// Bytes beyond those that the program takes for its help: the most of several runs, each of which may end
/// before a sample of its memory.
fn beyond_help(program: &str, arguments: &str, here: &Path) -> (Ended, f64) {
    let empty = (0..5).map(|_| watched(program, "--help", here).1).fold(0.0, f64::max);
    let (ended, most) = watched(program, arguments, here);
    (ended, most - empty)
}

/// Largest memory that `check` states, bytes.
fn stated(program: &str, here: &Path) -> f64 {
    let told = finish(command(program, "check scene.toml", here).spawn().unwrap()).with_code(0).stdout;
    let needs = told.lines().filter_map(|line| {
        let rest = line.trim_start().strip_prefix("needs ")?.trim_start();
        rest.strip_prefix("at most about ")?.split_whitespace().next()?.parse::<f64>().ok()
    });
    1e6 * needs.reduce(f64::max).unwrap_or_else(|| panic!("no need is stated in\n{told}"))
}

#[track_caller]
fn holds(program: &str, scene: &str, files: &[(&str, String)]) {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("scene.toml"), scene).unwrap();
    for (name, text) in files {
        fs::write(here.join(name), text).unwrap();
    }
    let stated = stated(program, here);
    // checkpoints all the time: their memory counts
    let (ended, taken) = beyond_help(program, "run scene.toml --output out --checkpoint-every 0.01", here);
    ended.with_code(0);
    let amounts = format!("{:.0} MB taken, {:.0} MB stated", taken / 1e6, stated / 1e6);
    println!("{program}: {amounts}");
    assert!(taken > 1e6, "{amounts}");
    assert!(taken <= stated, "{amounts}");
    assert!(stated <= LARGE || stated <= FACTOR * taken, "{amounts}");
}

#[test]
fn of_bodies() {
    // a quarter of a million particles, two measures, fields, a picture
    let plate = scenes::plate("\"2 mm\"", "1e-1");
    holds("peri", &plate.replace("[solver]", "[solver]\nmethod = \"adr\""), &[]);
    // ten pairs of L-BFGS, and no results
    let bare = plate.replace("[stress]\nmeasures = [\"hardy\", \"one-point\"]\n", "");
    let bare =
        bare.replace("[exact]\nproblem = \"kirsch\"\nradius = \"60 mm\"\nremote_stress = \"1 kPa\"\n", "");
    let bare = bare.replace("1e-1", "1e-5") + "[output]\nfields = false\npictures = false\n";
    holds("peri", &bare, &[]);
    // a solid with surface factors; a cloud; a sheet that breaks and touches itself
    holds("peri", &scenes::bar().replace("\"10 mm\"", "\"2 mm\""), &[]);
    holds("peri", scenes::strip(), &[("points.csv", scenes::points())]);
    holds("peri", &(scenes::fracture("4 mm", "accept = 0.1") + "[contact]\nstiffness = 1.0\n"), &[]);
}

/// Lines of many points with many particles around each; lines with many points in all.
#[test]
fn of_lines() {
    let line = |name: usize, points: usize| {
        format!(
            "[[output.line]]\nname = \"l{name}\"\nfrom = [\"1 mm\", \"1 mm\", \"1 mm\"]\n\
             to = [\"39 mm\", \"39 mm\", \"39 mm\"]\npoints = {points}\n"
        )
    };
    let bar = scenes::bar().replace("spacing =", "horizon_ratio = 6.015\nspacing =");
    holds("peri", &(bar + "\n[output]\nfields = false\npictures = false\n" + &line(0, 30_000)), &[]);
    let lines: String = (0..10).map(|name| line(name, 100_000)).collect();
    let brick = brick([20; 3], "").replace("every = \"1 s\"", "fields = false\npictures = false");
    holds("crystfem", &(brick + &lines), &[]);
}

/// Thin bodies: one row of cells and a long horizon, so that most sites are empty.
#[test]
fn of_a_thin_body() {
    let thin = scenes::plate("\"100 mm\"", "1e-2")
        .replace("  { cut = \"disk\", centre = [\"0 mm\", \"0 mm\"], radius = \"60 mm\" },\n", "")
        .replace(
            "[\"-500 mm\", \"-500 mm\"], max = [\"500 mm\", \"500 mm\"]",
            "[\"0 mm\", \"0 mm\"], max = [\"3 m\", \"1 mm\"]",
        )
        .replace("[exact]\nproblem = \"kirsch\"\nradius = \"60 mm\"\nremote_stress = \"1 kPa\"\n", "")
        .replace("spacing = [\"100 mm\"]", "spacing = [\"1 mm\"]\nhorizon_ratio = [20]");
    holds("peri", &thin, &[]);
}

#[test]
#[ignore = "takes 6 to 35 s; .ci/run runs it"]
fn of_parts() {
    let fine =
        parts::BAR.replace("element_size = \"1 mm\"", "element_size = \"0.25 mm\"\nelements_per_layer = 2");
    holds("crystfem", &fine.replace("end = \"120 s\"", "end = \"40 s\""), &[]);
    holds("crystfem", &brick([40; 3], "solver = \"direct\""), &[]);
    holds("crystfem", &brick([60; 3], ""), &[]);
    holds("crystfem", &brick([500, 200, 1], ""), &[]);
    // elements that all differ, with and without levels of multigrid
    let unequal = |solver| {
        let equal = "[mesh.brick]\nsize = [\"100 mm\", \"100 mm\", \"100 mm\"]\nelements = [40, 40, 40]";
        let scene = brick([40; 3], solver);
        assert!(scene.contains(equal));
        scene.replace(equal, "[mesh]\nfile = \"body.inp\"")
    };
    for solver in ["solver = \"conjugate-gradients\"", "solver = \"multigrid\""] {
        holds("crystfem", &unequal(solver), &[("body.inp", distorted(40))]);
    }
}

/// Abaqus mesh of a brick of 100 mm, `count` elements along an edge, none equal to another.
fn distorted(count: usize) -> String {
    let (nodes, edge) = (count + 1, 0.1 / count as f64);
    let number = |x: usize, y: usize, z: usize| (z * nodes + y) * nodes + x + 1;
    let grid = |count: usize| {
        (0..count).flat_map(move |z| (0..count).flat_map(move |y| (0..count).map(move |x| [x, y, z])))
    };
    let mut text = "*NODE\n".to_owned();
    for [x, y, z] in grid(nodes) {
        let moved = |a: usize, b: usize, c: usize| {
            edge * (a as f64 + 0.2 * (1.0 + 2.0 * b as f64 + 3.0 * c as f64 + a as f64).sin())
        };
        let [p, q, r] = [moved(x, y, z), moved(y, z, x), moved(z, x, y)];
        text += &format!("{}, {p:e}, {q:e}, {r:e}\n", number(x, y, z));
    }
    text += "*ELEMENT, TYPE=C3D8, ELSET=body\n";
    for (index, [x, y, z]) in grid(count).enumerate() {
        let layer = |z| [number(x, y, z), number(x + 1, y, z), number(x + 1, y + 1, z), number(x, y + 1, z)];
        let corners = [layer(z), layer(z + 1)].concat().iter().map(usize::to_string).collect::<Vec<_>>();
        text += &format!("{}, {}\n", index + 1, corners.join(", "));
    }
    text
}

/// A block that cools, two steps, fields.
fn brick(elements: [usize; 3], solver: &str) -> String {
    format!(
        r#"version = 1
program = "crystfem"
[mesh.brick]
size = ["100 mm", "100 mm", "100 mm"]
elements = {elements:?}
[materials.glass]
law = "conductor"
density = "2500 kg/m^3"
conductivity = "1 W/(m K)"
specific_heat = "800 J/(kg K)"
[[region]]
material = "glass"
temperature = "220 degC"
[[boundary]]
surface = "outer"
film = "15 W/(m^2 K)"
ambient = "100 degC"
[time]
end = "2 s"
step = "1 s"
{solver}
[output]
every = "1 s"
"#
    )
}

/// Twelve invented runs of molecular dynamics.
fn data(rows: usize) -> String {
    let mut text = String::from("run_id,kind,C11,C22,C33,C12,C13,C23,S11,S22,S33,S12,S13,S23\n");
    for (path, row) in (0..12).flat_map(|path| (0..rows).map(move |row| (path, row))) {
        let mut c = [1.0, 1.0, 1.0];
        c[path % 3] += 0.5 * row as f64 / rows as f64 * (1.0 + 0.1 * path as f64);
        let s = c.map(|c| 500.0 * (c - 1.0));
        text += &format!(
            "p{path},u{},{},{},{},0,0,0,{},{},{},0,0,0\n",
            path % 3,
            c[0],
            c[1],
            c[2],
            s[0],
            s[1],
            s[2]
        );
    }
    text
}

fn surrogate(more: &str) -> String {
    format!("version = 1\nprogram = \"mdsurrogate\"\n[data]\nfiles = [\"data.csv\"]\n{more}")
}

#[test]
#[ignore = "takes 6 to 35 s; .ci/run runs it"]
fn of_surrogates() {
    holds("mdsurrogate", &surrogate(""), &[("data.csv", data(10_000))]);
    let wide = "[training]\nepochs = 1\nbatch = 512\n[[model]]\nkind = \"ann\"\nhidden = [[1200, \
                \"softplus\"], [1200, \"softplus\"]]\n";
    holds("mdsurrogate", &surrogate(&format!("{wide}members = 2\n")), &[("data.csv", data(60))]);
}

/// A scene of absurd size is refused with the key, and takes no memory.
#[track_caller]
fn refused(program: &str, scene: &str, key: &str, files: &[(&str, String)]) {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("scene.toml"), scene).unwrap();
    for (name, text) in files {
        fs::write(here.join(name), text).unwrap();
    }
    for verb in ["check scene.toml", "run scene.toml --output out"] {
        let (ended, taken) = beyond_help(program, verb, here);
        let ended = ended.with_code(2);
        ended.tells(key);
        ended.tells("scene.toml:");
        let text: usize = files.iter().map(|(_, text)| text.len()).sum();
        assert!(
            taken <= REFUSED + TABLE * text as f64,
            "{:.0} MB taken before\n{}",
            taken / 1e6,
            ended.stderr
        );
    }
    assert!(!here.join("out").exists());
}

#[test]
fn absurd_bodies() {
    let plate = scenes::plate("\"20 mm\"", "1e-4");
    refused("peri", &plate.replace("\"20 mm\"", "\"1 um\""), "`study`: found 1.000e12 lattice cells", &[]);
    // fewer cells than can be counted, but 4 kB of bonds each
    let dense = scenes::bar().replace("\"10 mm\"", "\"0.07 mm\"\nhorizon_ratio = 20");
    refused("peri", &dense, "`body.spacing`: found 9.", &[]);
    let steps = plate.replace("[solver]", "[solver]\nsteps = 1000000000000");
    refused("peri", &steps, "`solver.steps`", &[]);
    let moving = plate.replace("[solver]", "[solver]\nmethod = \"verlet\"")
        + "[dynamics]\ndensity = \"1000 kg/m^3\"\nend_time = \"1 s\"\nrecords = 1000000000000\n";
    refused("peri", &moving, "`dynamics.records`", &[]);
    let long = scenes::strip().replace("3.2 mm", "3.2 m");
    let many: String = (0..60_000).map(|k| format!("{}e-3,{}e-3,1.{k:05}e-9\n", k % 300, k / 300)).collect();
    if 60_000.0_f64.powi(2) * 20.0 > polycore::memory::available() {
        refused("peri", &long, "`body.horizon`", &[("points.csv", format!("x,y,volume\n{many}"))]);
    }
}

#[test]
fn absurd_parts() {
    let with = |from: &str, to: &str| parts::BAR.replace(from, to);
    refused("crystfem", &brick([1_000_000_000; 3], ""), "`mesh.brick.elements`: found", &[]);
    refused("crystfem", &brick([268_435_455, 1, 1], ""), "`mesh.brick.elements`: found", &[]);
    refused("crystfem", &with("layers = 3", "layers = 1000000000"), "`mesh.bar.layers`: found", &[]);
    refused("crystfem", &with("layers = 3", "layers = 10000000"), "`mesh.bar", &[]);
    refused("crystfem", &with("element_size = \"1 mm\"", "element_size = \"1 um\""), "`mesh.bar", &[]);
    refused(
        "crystfem",
        &brick([4; 3], "").replace("step = \"1 s\"", "step = \"1 ps\""),
        "`time.step`: found 2.0e12 steps",
        &[],
    );
    let every = brick([4; 3], "").replace("every = \"1 s\"", "every = \"1 ps\"");
    refused("crystfem", &every, "`output.every`: found 2.0e12 times", &[]);
}

#[test]
fn absurd_surrogates() {
    let files = [("data.csv", data(20))];
    let wide = "[[model]]\nkind = \"ann\"\nhidden = [[65536, \"relu\"], [65536, \"relu\"]]\n";
    refused("mdsurrogate", &surrogate(wide), "`model[0].hidden`: found 4295", &files);
    let many = "[[model]]\nkind = \"ann\"\nhidden = [[1000, \"relu\"], [1000, \"relu\"]]\nmembers = 1000\n";
    refused("mdsurrogate", &surrogate(many), "`model[0].hidden`: found 1014", &files);
    let batch = "[[model]]\nkind = \"ann\"\n[training]\nbatch = 1000000000000\n";
    refused("mdsurrogate", &surrogate(batch), "`training.batch`", &files);
    let search = "[search]\n[search.space]\nlayers = [2, 5]\nneurons = [32, 65536]\nstep = 32\n\
                  activations = [\"relu\"]\nlearning_rates = [1e-3]\n";
    refused("mdsurrogate", &surrogate(search), "`search.space`", &files);
}
