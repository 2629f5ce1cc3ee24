//! `crystfem run` of a printed part.

use crate::program::{command, finish};
use crate::results::{assert_same, report, scalar, timeless};
use harness::output::vtkhdf;
use std::fs;
use std::path::Path;

/// A bar of three layers on glass that crystallizes, with latent heat.
pub const BAR: &str = r#"version = 1
program = "crystfem"
title = "Small bar"

[mesh.bar]
size = ["16 mm", "6 mm"]
layers = 3
layer_height = "0.5 mm"
element_size = "1 mm"
substrate = { size = ["24 mm", "12 mm"], thickness = "2 mm" }

[materials.pa12]
law = "semicrystalline"
density = "1010 kg/m^3"
conductivity = "0.25 W/(m K)"
specific_heat = "2200 J/(kg K)"
kinetics = "table-4.1-column-1"
melting = "pa12"
crystallinity = 0.25
latent_heat = "209 J/g"

[materials.glass]
law = "conductor"
density = "2500 kg/m^3"
conductivity = "1 W/(m K)"
specific_heat = "800 J/(kg K)"

[[region]]
material = "glass"
temperature = "100 degC"

[[region]]
elements = "bar"
material = "pa12"
temperature = "220 degC"

[print]
temperature = "220 degC"
layer_time = "10 s"

[[boundary]]
surface = "bottom"
temperature = "100 degC"

[[boundary]]
surface = "outer"
except = ["bottom"]
film = "15 W/(m^2 K)"
emissivity = 0.9
ambient = "100 degC"

[time]
end = "120 s"
tolerance = "1 K"

[output]
every = "10 s"
stages = 2

[[probe]]
name = "middle"
at = ["0 mm", "0 mm", "0.75 mm"]
"#;

#[test]
fn a_printed_bar() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let solid = "solid = { turntable = true, cut = { normal = [0, 1, 0] } }";
    fs::write(here.join("bar.toml"), BAR.replace("stages = 2", &format!("stages = 2\n{solid}"))).unwrap();
    let crystfem = |arguments: &str| finish(command("crystfem", arguments, here).spawn().unwrap());
    let told = crystfem("check bar.toml").with_code(0);
    told.shows("builds     3 births with 288 elements in total");
    told.shows("solver     after the last birth: not linear: Newton's iteration");
    told.shows("leaves out time-dependent conditions");
    for threads in 1..=3 {
        crystfem(&format!("run bar.toml --output out{threads} --threads {threads}")).with_code(0);
        assert_same(&here.join("out1"), &here.join(format!("out{threads}")));
    }
    let out = here.join("out1");
    let report = report(&out);
    // the stored energy came in, to rounding of a few hundred steps and thousands of nodes
    assert!(scalar(&report, "worst_balance") < 1e-10);
    let [least, mean, largest] =
        ["least_alpha", "mean_alpha", "largest_alpha"].map(|name| scalar(&report, name));
    assert!(least <= mean && mean <= largest && largest <= 1.0, "{least} {mean} {largest}");
    // 90 s after the last layer all is at the temperature of its surroundings, and crystallized
    assert!((scalar(&report, "mean_temperature") - 100.0).abs() < 1.0 && least > 0.95);
    let series = vtkhdf::read(out.join("fields.vtkhdf")).unwrap();
    assert_eq!(series.len(), 13);
    let born: Vec<f64> =
        (0..series.len()).map(|step| series.cell_data(step, "exists").unwrap().iter().sum()).collect();
    // a layer is born at the beginning of a step: fields at that time show what was before
    let layers: Vec<f64> = born.iter().map(|count| (count - (born[12] - 288.0)) / 96.0).collect();
    assert_eq!(layers[..5], [1.0, 1.0, 2.0, 3.0, 3.0]);
    let temperature = series.data(0, "temperature_degC").unwrap();
    assert!(temperature.iter().any(|t| t.is_nan()) && temperature.iter().all(|t| t.is_nan() || *t >= 99.9));
    // the probe lies between nodes of the second layer: it begins with that, and its values are between
    // theirs
    let rows = harness::output::csv::read(out.join("probe_middle.csv")).unwrap();
    let of = |name: &str| &rows.iter().find(|(heading, _)| heading.starts_with(name)).unwrap().1;
    assert!((10.0..10.1).contains(&of("time")[0]), "{}", of("time")[0]);
    let last = series.data(12, "temperature_degC").unwrap();
    let ends: Vec<f64> = series
        .points(12)
        .unwrap()
        .iter()
        .zip(&last)
        .filter(|([x, y, z], _)| x.abs().max(y.abs()) < 1e-9 && (z - 7.5e-4).abs() < 3e-4)
        .map(|(_, t)| *t)
        .collect();
    assert_eq!(ends.len(), 2);
    let between = of("temperature")[of("time").len() - 1];
    assert!(ends[0] != ends[1] && (between - 0.5 * (ends[0] + ends[1])).abs() < 1e-9, "{between} {ends:?}");
    assert_eq!(scalar(&report, "middle.distance"), 0.0);
    for name in [
        "probe_middle.csv",
        "probes_temperature.png",
        "sections.png",
        "process.png",
        "solid.png",
        "process_solid.png",
        "turntable.png",
    ] {
        assert!(out.join(name).is_file(), "{name}");
    }
}

/// The bar with its stress and the healing of its interfaces.
pub fn warped() -> String {
    let mechanics = "[mechanics]\nmaterial = \"pa12\"\nlaw = \"pa12\"\n\n";
    let healing = "[healing]\nmaterial = \"pa12\"\ntime = \"2 s\"\ntemperature = \"180 degC\"\nenergy = \
                   \"60 kJ/mol\"\n\n";
    BAR.replace("[time]", &format!("{mechanics}{healing}[time]")).replace("latent_heat = \"209 J/g\"\n", "")
}

/// A released body bears no force: the stress adds up to zero in each slice across it.
#[test]
fn a_released_bar_is_in_equilibrium() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("bar.toml"), warped()).unwrap();
    let crystfem = |arguments: &str| finish(command("crystfem", arguments, here).spawn().unwrap());
    crystfem("check bar.toml").with_code(0).shows("released at the end");
    for threads in 1..=2 {
        crystfem(&format!("run bar.toml --output out{threads} --threads {threads}")).with_code(0);
    }
    let out = here.join("out1");
    assert_same(&out, &here.join("out2"));
    let found = report(&out);
    assert!(scalar(&found, "worst_stress_balance") < 1e-12 && scalar(&found, "warpage") > 1e-6);
    assert!(out.join("warped.png").is_file());
    let series = vtkhdf::read(out.join("fields.vtkhdf")).unwrap();
    let last = series.len() - 1;
    // 96 elements a layer, two interfaces between three layers
    assert_eq!(found["work"]["interfaces"], 192);
    let healing: Vec<f64> =
        series.cell_data(last, "healing").unwrap().into_iter().filter(|x| x.is_finite()).collect();
    let [least, mean] = ["least_healing", "mean_healing"].map(|name| scalar(&found, name));
    assert_eq!(healing.len(), 288);
    assert_eq!(healing.iter().copied().fold(1.0, f64::min), least);
    assert!(0.0 < least && least < mean && mean < 1.0, "{least} {mean}");
    let stress = series.cell_data(last, "residual_stress_Pa").unwrap();
    let mut slices = std::collections::BTreeMap::<i64, [f64; 2]>::new();
    let (points, cells) = (series.points(last).unwrap(), series.cells().unwrap());
    for (corners, stress) in cells.connectivity.chunks(8).zip(stress.chunks(6)) {
        if stress[0].is_finite() {
            let x = corners.iter().map(|&node| points[node as usize][0]).sum::<f64>() / 8.0;
            let slice = slices.entry((1e4 * x).round() as i64).or_default();
            *slice = [slice[0] + stress[0], slice[1] + stress[0].abs()];
        }
    }
    assert_eq!(slices.len(), 16);
    for (place, [sum, parts]) in slices {
        // except for the floor: it bears 1e-4 of the modulus in the step of the release, and forgets it
        assert!(parts > 1e5 && sum.abs() < 5e-3 * parts, "{place}: {sum} of {parts} Pa");
    }
}

/// The bar with and without latent heat, colder, and one that is no bar; small, to be fast.
pub fn studies() -> String {
    let bar =
        BAR.replace("latent_heat = \"209 J/g\"\n", "").replace("tolerance = \"1 K\"", "tolerance = \"2 K\"");
    bar + r#"
[[study]]
name = "uncoupled"
description = "crystallize"

[[study]]
name = "coupled"
description = "crystallize later"
set = { "materials.pa12.latent_heat" = "209 J/g" }

[[study]]
name = "cold"
quick = false
set = { "boundary[0].temperature" = "20 degC" }

[[study]]
name = "flat"
description = "be refused"
expect_error = "no extent"
mesh = { brick = { size = ["1 mm", "1 mm", "0 mm"], elements = [1, 1, 1] } }

[[expect]]
quantity = "coupled.least_alpha"
at_least = 0.95
kind = "bound"
source = "90 s after the last layer"
"#
}

#[test]
fn studies_of_a_part() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("bar.toml"), studies()).unwrap();
    let crystfem = |arguments: &str| finish(command("crystfem", arguments, here).spawn().unwrap());
    let told = crystfem("check bar.toml").with_code(0);
    told.shows("study coupled");
    told.shows("leaves out latent heat: crystallinity does not affect the temperature");
    told.shows("  expects    an error that contains `no extent`");
    crystfem("run bar.toml --output out --verbose").with_code(0).shows("pass  coupled.least_alpha");
    let out = here.join("out");
    let report = report(&out);
    let of = |name: &str| scalar(&report, name);
    // heat of crystallization stays in the bar for a while; glass at 20 °C quenches it
    assert!(of("coupled.worst_balance") < 1e-10 && of("cold.mean_alpha") < 0.5);
    assert!(of("uncoupled.least_alpha") > 0.95 && of("flat.failed_as_expected") == 1.0);
    // a study equals a run of its scene alone
    let alone = BAR.replace("tolerance = \"1 K\"", "tolerance = \"2 K\"");
    fs::write(here.join("alone.toml"), alone).unwrap();
    crystfem("run alone.toml --output alone").with_code(0);
    let names: Vec<String> = timeless(&out)
        .into_keys()
        .filter_map(|name| Some(name.strip_prefix("coupled/")?.to_owned()))
        .collect();
    assert!(names.contains(&"fields.vtkhdf".to_owned()), "{names:?}");
    for name in names.iter().filter(|name| *name != "report.json") {
        let same = fs::read(out.join("coupled").join(name)).unwrap()
            == fs::read(here.join("alone").join(name)).unwrap();
        assert!(same, "{name}");
    }
    let table = fs::read_to_string(out.join("suite.md")).unwrap();
    assert!(
        table.contains("| coupled | crystallize later | ends at") && table.contains("refused: "),
        "{table}"
    );
    let rows = fs::read_to_string(out.join("studies.csv")).unwrap();
    assert_eq!(rows.lines().count(), 5, "{rows}");
    assert!(out.join("probe_middle_temperature.png").is_file());
    // a quick run leaves the third out
    crystfem("run bar.toml --output quick --quick").with_code(0);
    assert!(!here.join("quick/cold").exists());
}

/// All runs are checked before the first, and the message names the option, since no file has a faulty line.
#[test]
fn options_of_a_sweep_are_named() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("bar.toml"), BAR).unwrap();
    fs::write(here.join("bad.toml"), BAR.replace("emissivity = 0.9", "emissivity = 9")).unwrap();
    let refused = |scene: &str, vary: &str, message: &str| {
        let arguments = format!("sweep {scene}.toml {vary} --output sweep");
        let ended = finish(command("crystfem", &arguments, here).spawn().unwrap()).with_code(2);
        ended.tells(message);
        assert!(!ended.stderr.contains("sweep.set"), "{}", ended.stderr);
        assert!(!here.join("sweep").exists());
    };
    for (vary, message) in [
        ("--vary print.layer_time=6kg", "`--vary print.layer_time=6kg`: `6kg` is a mass; a time is needed"),
        ("--vary print.layer_time=5s,100s", "`--vary print.layer_time=100s`: `time.end`: found 120 s"),
        ("--vary mesh.bar.layers=3,0", "`--vary mesh.bar.layers=0`: found layers = 0; allowed: 1"),
        ("--vary print.start=0s --vary print.start=1s", "`--vary print.start`: found the key twice"),
        (
            "--vary print.start=0s,1s --vary boundary[7].film=1",
            "`--vary boundary[7].film=1`: found `boundary[7]`",
        ),
    ] {
        refused("bar", vary, message);
    }
    // keys without options are those of the file
    refused("bad", "--vary print.start=0s", "emissivity = 9");
    refused("bad", "--vary print.start=0s", "[bad.toml:49:");
}

#[test]
fn a_sweep_keeps_what_is_finished() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let scene = BAR.replace("tolerance = \"1 K\"", "tolerance = \"3 K\"");
    fs::write(here.join("bar.toml"), &scene).unwrap();
    let crystfem = |arguments: &str| finish(command("crystfem", arguments, here).spawn().unwrap());
    let refused = crystfem("sweep bar.toml --vary print.layer_tim=5s --output sweep").with_code(2);
    refused.tells("did you mean `layer_time`?");
    assert!(!here.join("sweep").exists());
    let vary = "sweep bar.toml --vary print.layer_time=5s,10s --vary boundary[1].film=10W/m^2/K";
    crystfem(&format!("{vary} --output one --threads 1")).with_code(0);
    crystfem(&format!("{vary} --output two --threads 2")).with_code(0);
    assert_same(&here.join("one"), &here.join("two"));
    let rows = fs::read_to_string(here.join("one/sweep.csv")).unwrap();
    assert_eq!(rows.lines().count(), 3, "{rows}");
    assert!(rows.starts_with("run,print.layer_time [s],boundary[1].film [W/m^2/K],"), "{rows}");
    assert!(rows.lines().nth(1).is_some_and(|row| row.contains(",5,10,")), "{rows}");
    assert!(here.join("one/sweep_deviation_of_alpha.png").is_file());
    // another sweep in the same folder would overwrite its table
    crystfem("sweep bar.toml --vary print.layer_time=5s --output one")
        .with_code(2)
        .tells("found a sweep over print.layer_time, boundary[1].film; allowed: one over the same keys");
    assert_eq!(fs::read_to_string(here.join("one/sweep.csv")).unwrap(), rows);
    // a run that fails is reported, the other continues
    fs::create_dir(here.join("three")).unwrap();
    fs::write(here.join("three/layer_time-5s"), "").unwrap();
    crystfem("sweep bar.toml --vary print.layer_time=5s,10s --output three")
        .with_code(1)
        .shows("layer_time-5s cannot be used: it is a file");
    assert!(scalar(&report(&here.join("three")), "failed_runs") == 1.0);
    // a run of the sweep equals a run of its scene alone
    let alone = scene
        .replace("layer_time = \"10 s\"", "layer_time = \"5 s\"")
        .replace("15 W/(m^2 K)", "10 W/(m^2 K)");
    fs::write(here.join("alone.toml"), alone).unwrap();
    crystfem("run alone.toml --output alone").with_code(0);
    let row = here.join("one/layer_time-5s_film-10W_m_2_K");
    let own = report(&row);
    let alone = report(&here.join("alone"));
    for name in ["mean_alpha", "deviation_of_alpha", "mean_temperature", "heat_given_off"] {
        assert_eq!(scalar(&own, name), scalar(&alone, name), "{name}");
    }
    // the same command computes nothing again; a finished run that was deleted is repeated
    let written = |path: &Path| fs::metadata(path.join("report.json")).unwrap().modified().unwrap();
    let other = here.join("one/layer_time-10s_film-10W_m_2_K");
    let before = (written(&row), fs::read(other.join("probe_middle.csv")).unwrap());
    fs::remove_dir_all(&other).unwrap();
    crystfem(&format!("{vary} --output one")).with_code(0);
    assert_eq!(before, (written(&row), fs::read(other.join("probe_middle.csv")).unwrap()));
    assert_same(&here.join("one"), &here.join("two"));
}
