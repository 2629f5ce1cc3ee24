//! Tool paths that miss the part, gaps that stay empty, and values that cease to be finite.

use crate::parts::BAR;
use crate::program::{Ended, command, finish};
use crate::results::{report, scalar};
use harness::output::vtkhdf;
use std::fs;
use std::path::Path;

fn crystfem(arguments: &str, here: &Path) -> Ended {
    finish(command("crystfem", arguments, here).spawn().unwrap())
}

/// The scene that hid NaN: Appendix B with its sign corrected takes steps by temperature only, and α passes
/// 1.
#[test]
fn a_state_that_is_not_finite_ends_the_run() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let semicrystalline = &BAR[BAR.find("law = \"semi").unwrap()..BAR.find("[materials.glass]").unwrap()];
    let printed = "law = \"as-published\"\nsign = \"mended\"\nguarded = true\ndensity = \"1010 kg/m^3\"\n\
                   conductivity = \"0.25 W/(m K)\"\nspecific_heat = \"2200 J/(kg K)\"\n\n";
    let scene =
        BAR.replace(semicrystalline, printed).replace("layer_time = \"10 s\"", "layer_time = \"8 s\"");
    fs::write(here.join("bar.toml"), &scene).unwrap();
    let ended = crystfem("run bar.toml --output out", here).with_code(1);
    ended.tells("error: alpha is not finite at node ");
    ended.tells(" mm, t = ");
    assert!(!here.join("out/report.json").exists());
    // except if the scene expects it, and then it must occur
    let study = |set: &str| {
        format!(
            "{scene}\n[[study]]\nname = \"as-coded\"\nexpect_error = \"alpha is not finite\"\nset = \
             {{ {set} }}\n"
        )
    };
    fs::write(here.join("asked.toml"), study("\"print.start\" = \"0 s\"")).unwrap();
    crystfem("run asked.toml --output asked", here).with_code(0);
    assert_eq!(scalar(&report(&here.join("asked")), "as-coded.failed_as_expected"), 1.0);
    fs::write(here.join("none.toml"), study("\"materials.pa12.sign\" = \"as-published\"")).unwrap();
    let ended = crystfem("run none.toml --output none", here).with_code(1);
    ended.shows("FAIL  study as-coded succeeded, but must fail");
}

#[test]
fn a_point_that_is_not_finite_ends_the_run() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let scene = "version = 1\nprogram = \"crystfem\"\n[material]\nlaw = \"as-published\"\nsign = \
                 \"mended\"\nguarded = true\n\
                 density = \"1010 kg/m^3\"\nconductivity = \"0.25 W/(m K)\"\nspecific_heat = \"2200 J/(kg \
                             K)\"\n\
                 [output]\npictures = false\n\
                 [[point]]\nname = \"p\"\nstart = \"200 degC\"\nlegs = \
                                     [{ to = \"120 degC\", rate = \"10 K/min\" }]\n";
    let run = |name: &str, keys: &str| {
        fs::write(here.join(format!("{name}.toml")), format!("{scene}{keys}")).unwrap();
        crystfem(&format!("run {name}.toml --output {name}"), here)
    };
    run("coarse", "temperature_step = \"1 K\"\n")
        .with_code(1)
        .tells("rate of crystallization is not finite at point `p`, t = ");
    run("asked", "temperature_step = \"1 K\"\nnon_finite = true\n").with_code(0);
    assert!(scalar(&report(&here.join("asked")), "p.non_finite_rows") >= 1.0);
    run("fine", "temperature_step = \"0.01 K\"\n").with_code(0);
    let ended = run("none", "temperature_step = \"0.01 K\"\nnon_finite = true\n").with_code(1);
    ended.tells("point `p`: expected a non-finite value");
}

/// A wall 1 mm wide around a square of 20 mm, four layers of 0.5 mm, in the middle of a printer's bed.
fn wall() -> String {
    let mut text = "G21\nG90\nM83\nG1 F6000\n".to_owned();
    for layer in 1..=4 {
        text += &format!("G0 X105.5 Y105.5 Z{}\n", 0.5 * f64::from(layer));
        text += "G1 X124.5 Y105.5 E1\nG1 X124.5 Y124.5 E1\nG1 X105.5 Y124.5 E1\nG1 X105.5 Y105.5 E1\n";
    }
    text
}

const BRICK: &str = r#"version = 1
program = "crystfem"

[mesh.brick]
size = ["20 mm", "20 mm", "2 mm"]
elements = [20, 20, 4]

[materials.plain]
law = "conductor"
density = "1000 kg/m^3"
conductivity = "0.25 W/(m K)"
specific_heat = "2000 J/(kg K)"

[[region]]
material = "plain"
temperature = "200 degC"

[print]
temperature = "200 degC"
elements = "brick"
path = "wall.gcode"
bead_width = "1 mm"
bead_height = "0.5 mm"

[[boundary]]
surface = "outer"
film = "15 W/(m^2 K)"
ambient = "20 degC"

[time]
tolerance = "5 K"

[[probe]]
name = "middle"
at = ["10 mm", "10 mm", "1 mm"]
"#;

#[test]
fn a_path_beside_the_part() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("wall.gcode"), wall()).unwrap();
    let scene = |keys: &str| {
        let text =
            BRICK.replace("bead_height = \"0.5 mm\"\n", &format!("bead_height = \"0.5 mm\"\n{keys}\n"));
        fs::write(here.join("cube.toml"), text).unwrap();
    };
    scene("");
    for verb in ["check", "run"] {
        let ended = crystfem(&format!("{verb} cube.toml"), here).with_code(2);
        ended.tells(
            "`print.path`: found a path from (105.5, 105.5, 0) mm to (124.5, 124.5, 2) mm whose \
                     beads cover no element",
        );
        ended.tells("the part, which reaches from (0, 0, 0) mm to (20, 20, 2) mm");
    }
    // 76 of the 400 elements of a layer are under the wall
    for keys in ["centre = true", "offset = [\"-105 mm\", \"-105 mm\", \"0 mm\"]"] {
        scene(keys);
        let told = crystfem("check cube.toml", here).with_code(0);
        told.shows("the beads cover 19.0 % of the part; 0.0 % of their length lies outside");
        told.shows("probe `middle` lies where nothing is printed");
        told.shows("304 elements in total");
    }
    crystfem("run cube.toml --output out", here).with_code(0);
    let series = vtkhdf::read(here.join("out/fields.vtkhdf")).unwrap();
    let born: f64 = series.cell_data(series.len() - 1, "exists").unwrap().iter().sum();
    assert_eq!(born, 304.0);
    // ρVc·473.15 K of 304 mm² × 0.5 mm
    let birth = scalar(&report(&here.join("out")), "birth_energy");
    assert!((birth - 1000.0 * 304.0 * 0.5e-9 * 2000.0 * 473.15).abs() < 1e-6 * birth, "{birth}");
    // half of the wall beside the part: two of its sides lie outside
    scene("offset = [\"-95 mm\", \"-105 mm\", \"0 mm\"]");
    let told = crystfem("check cube.toml", here).with_code(0);
    // of 76 mm of a layer 19 and twice 9.5 lie at x > 20 mm; 38 elements are under the rest
    told.shows("the beads cover 9.5 % of the part; 50.0 % of their length lies outside");
    scene("centre = true\nfill = true");
    let told = crystfem("check cube.toml", here).with_code(0);
    told.shows(
        "the beads cover 19.0 % of the part; 0.0 % of their length lies outside; with filled gaps \
        100.0 % are printed",
    );
    told.shows("1600 elements in total");
}

/// A table in mm is read as such, and needs no `time.end`.
#[test]
fn a_table_of_moves_with_units() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let moves = "0,0,10.5,0.5,0\n2,20,10.5,0.5,1\n";
    fs::write(here.join("line.csv"), format!("time [s],x [mm],y [mm],z [mm],print\n{moves}")).unwrap();
    let scene = BRICK.replace("wall.gcode\"", "line.csv\"\nwindow = \"0.3 s\"");
    fs::write(here.join("brick.toml"), scene).unwrap();
    let told = crystfem("check brick.toml", here).with_code(0);
    told.shows("20 elements in total");
    // the last of them is passed at 1.95 s and born at the end of its window, 2.15 s, after the path
    told.shows("ends at    2.4");
    crystfem("run brick.toml --output out", here).with_code(0);
    // in metres it lies far away
    fs::write(here.join("line.csv"), format!("time,x,y,z,print\n{moves}")).unwrap();
    crystfem("check brick.toml", here)
        .with_code(2)
        .tells("from (0, 10500, 499.5) mm to (20000, 10500, 500) mm");
}
