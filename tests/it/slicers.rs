//! G-code as slicers write it: correct values of small prints, and the messages of `check`.

use crate::program::{Ended, command, finish};
use crate::results::{report, scalar};
use std::f64::consts::PI;
use std::fs;
use std::path::Path;

fn crystfem(arguments: &str, here: &Path) -> Ended {
    finish(command("crystfem", arguments, here).spawn().unwrap())
}

/// Filament, mm, for a bead of a volume in mm³.
fn filament(volume: f64) -> f64 {
    volume / (0.25 * PI * 1.75f64.powi(2))
}

/// Formats a scene for `part.gcode`, with the height of its cells, mm, more keys of its mesh, a film, and
/// whether it lies on a bed of 60 °C.
fn scene(height: f64, keys: &str, film: &str, bed: bool, end: f64) -> String {
    let bed = match bed {
        true => "[[boundary]]\nsurface = \"bottom\"\nfilm = \"500 W/(m^2 K)\"\nambient = \"60 degC\"\n",
        false => "",
    };
    let except = if bed.is_empty() { "" } else { "except = [\"bottom\"]\n" };
    format!(
        "version = 1\nprogram = \"crystfem\"\n[mesh.path]\nfile = \"part.gcode\"\ncell = [\"0.5 mm\", \"0.5 \
         mm\", \"{height} mm\"]\n{keys}\n\
         [materials.pla]\nlaw = \"conductor\"\ndensity = \"1240 kg/m^3\"\nconductivity = \"0.13 W/(m \
                                  K)\"\nspecific_heat = \"1800 J/(kg K)\"\n\
         [[region]]\nmaterial = \"pla\"\ntemperature = \"25 degC\"\n[print]\nwindow = \"0.5 \
                                  s\"\n{bed}[[boundary]]\nsurface = \"outer\"\n{except}film = {film}\n\
         ambient = \"25 degC\"\n[time]\nend = \"{end} s\"\ntolerance = \"0.5 K\"\nfirst_step = \"10 ms\"\n\
         [output]\npictures = false\nfields = false\nevery = \"1000 s\"\n"
    )
}

const STILL: &str = "\"15 W/(m^2 K)\"";

/// A purge of 40 mm at 0.2 mm, then three layers of 0.3 mm: 20 lines of 9.5 mm and 0.15 mm² each.
fn purge() -> String {
    let mut text =
        format!("G21\nG90\nM83\nM104 S210\nG1 Z0.2 F1200\nG1 X0 Y-20\nG1 X40 E{:.5}\n", filament(4.0));
    for layer in 1..=3 {
        text += &format!("G1 Z{:.2} F1200\n", 0.3 * f64::from(layer));
        for line in 0..20 {
            let (from, to) = if line % 2 == 0 { (0.25, 9.75) } else { (9.75, 0.25) };
            let y = 0.25 + 0.5 * f64::from(line);
            text += &format!("G0 X{from} Y{y}\nG1 X{to} E{:.5}\n", filament(9.5 * 0.15));
        }
    }
    text
}

/// A part of layers of 0.2 mm beside a support of layers of 0.3 mm, 1.2 mm high, in the order of their
/// heights.
fn support() -> String {
    let mut lines: Vec<(u32, f64, f64)> = Vec::new();
    for layer in 1..=6 {
        lines.extend((0..10).map(|line| (2 * layer, 0.25 + 0.5 * f64::from(line), 0.1)));
    }
    for layer in 1..=4 {
        lines.extend((0..4).map(|line| (3 * layer, 10.25 + 0.5 * f64::from(line), 0.15)));
    }
    lines.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut text = "G21\nG90\nM83\nM104 S210\n".to_owned();
    for (z, y, area) in lines {
        let (z, e) = (0.1 * f64::from(z), filament(10.0 * area));
        text += &format!("G0 X0 Y{y} Z{z:.1} F3000\nG1 X10 E{e:.5} F1200\n");
    }
    text
}

#[test]
fn right_values() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let run = |name: &str, gcode: &str, scene: &str| {
        fs::write(here.join("part.gcode"), gcode).unwrap();
        fs::write(here.join("part.toml"), scene).unwrap();
        crystfem(&format!("run part.toml --output {name}"), here).with_code(0);
        report(&here.join(name))
    };
    let probe = |at: &str| format!("[[probe]]\nname = \"top\"\nat = [{at}]\n");
    let mut wrong = Vec::new();
    let mut judge = |name: &str, found: f64, right: f64, tolerance: f64| {
        if (found - right).abs() > tolerance {
            wrong.push(format!("{name}: {found}, right {right} ± {tolerance}"));
        }
    };
    // heights: of a purge line at another height, of a support with its own layers
    let top = scene(0.1, "", STILL, true, 60.0) + &probe("\"5 mm\", \"5 mm\", \"0.85 mm\"");
    let found = run("purge", &purge(), &top);
    judge("purge: cells_over_body", scalar(&found, "cells_over_body"), 1.0950, 5e-5);
    judge("purge: top", scalar(&found, "top.temperature"), 58.6, 0.5);
    let middle = probe("\"5 mm\", \"2.25 mm\", \"1.15 mm\"");
    let found = run("support", &support(), &(scene(0.1, "", STILL, true, 60.0) + &middle));
    judge("support: cells_over_body", scalar(&found, "cells_over_body"), 1.0, 1e-4);
    // the part as with its own height given to all beads: the support does not touch it
    let given = scene(0.1, "bead_height = \"0.2 mm\"", STILL, true, 60.0) + &middle;
    let alone = scalar(&run("given", &support(), &given), "top.temperature");
    judge("support: part", scalar(&found, "top.temperature"), alone, 0.1);
    // modes
    let lift = "G21\nG90\nM83\nM104 S210\nG1 Z0.2 F600\nG1 X10 E0.4\nG91\nG1 Z0.2\nG90\nG1 X0 E0.4\nG91\nG1 \
                Z0.2\nG90\nG1 X10 E0.4\n";
    let found = run("lift", lift, &scene(0.2, "", STILL, false, 60.0));
    judge("lift: filament", scalar(&found, "filament"), 1.2e-3, 1e-12);
    judge("lift: printed_volume", scalar(&found, "printed_volume"), 2.8863e-9, 5e-14);
    // tools: ρ c V of two beads at 235 and 200 °C
    let tools = "G21\nG90\nM82\nT0\nM109 S235\nM104 T1 S150\nG92 E0\nG1 Z0.2 F600\nG1 X10 E0.4\nT1\nG92 \
                 E0\nM109 S200\nM104 T0 S175\nG1 X10 Y1\nG1 X0 E0.4\n";
    let found = run("tools", tools, &scene(0.2, "", STILL, false, 60.0));
    judge("tools: birth_energy", scalar(&found, "birth_energy"), 2.1073, 5e-5);
    // the second tool prints a material of twice the density
    let dense = "[materials.dense]\nlaw = \"conductor\"\ndensity = \"2480 kg/m^3\"\nconductivity = \"0.13 \
                 W/(m K)\"\nspecific_heat = \"1800 J/(kg K)\"\n\
                 [[region]]\nelements = \"tool-1\"\nmaterial = \"dense\"\ntemperature = \"25 degC\"\n";
    let found = run("materials", tools, &(scene(0.2, "", STILL, false, 60.0) + dense));
    let each = 1240.0 * 1800.0 * 0.25 * PI * 1.75e-3f64.powi(2) * 0.4e-3;
    judge("materials: birth_energy", scalar(&found, "birth_energy"), each * (508.15 + 2.0 * 473.15), 1e-6);
    // fans
    let fan = "G21\nG90\nM83\nM104 S210\nM106 S255\nM106 P2 S0\nM106 P3 S0\nG1 Z0.2 F600\nG1 X10 E0.4\nG1 \
               Y1\nG1 X0 E0.4\n";
    let film = "{ file = \"part.gcode\", of = \"fan\", low = \"10 W/(m^2 K)\", high = \"100 W/(m^2 K)\" }";
    let found = run("fan", fan, &scene(0.2, "", film, false, 10.0));
    judge("fan: mean", scalar(&found, "mean_temperature"), 25.03, 0.05);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn check_tells_what_a_file_prints() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let e = filament(1.0);
    let text = format!(
        "; generated by a slicer\nM83\nM204 S500\nM205 X10 Y10\nM104 S210\nM140 S60\n;TYPE:Custom\nG1 Z0 \
         F600\nG1 X10 Y-5 E{}\nG1 Z0.2\nG1 X0 E{e}\n;LAYER_CHANGE\n\
         ;Z:0.2\n;HEIGHT:0.2\n;TYPE:Skirt/Brim\nG1 X0 Y9\nG1 X10 E{e}\n;TYPE:External perimeter\nG1 Y0\n\
         G1 X0 E{e}\nM140 S0\nM106 P2 S9\n; estimated printing time (normal mode) = 9s\n",
        0.1 * e
    );
    fs::write(here.join("part.gcode"), text).unwrap();
    let check = |keys: &str, bed: &str| {
        let scene = scene(0.2, keys, STILL, true, 100.0).replacen("\"60 degC\"", bed, 1);
        fs::write(here.join("part.toml"), scene).unwrap();
        crystfem("check part.toml", here)
    };
    let bed = "{ file = \"part.gcode\", of = \"bed\" }";
    let told = check("leave_out = [\"skirt\", \"purge\", \"support\"]", bed).with_code(0);
    told.shows(
        "the file prints 1 marked layer, centrelines from (0, -5, 0) mm to (10, 9, 0.2) mm, 3.100 \
                mm³ of 1.3 mm of filament",
    );
    told.shows("by feature: `Custom` 35.5 %, ");
    told.shows("`Skirt/Brim` 32.3 %");
    told.shows("path times follow the limits in the file: at the end 500, 500,");
    told.shows("9 s as its slicer estimates");
    told.shows(
        "1 printing moves lie at or below the bed (z ≤ 0) or have no support, the first in \
                line 9: 3.23 % of the filament, left out",
    );
    told.shows("found no `support` to leave out; the file prints");
    told.shows("left out of the part: 66.7 % of the filament (skirt, purge, support)");
    told.shows("commands not used: M106 P2 (1)");
    told.shows("`boundary[0].ambient`: the bed is switched off at");
    told.shows("a later `time.end` lets the part cool");
    // the line in the middle alone
    told.shows("1.000 mm³");
    check("filament = \"2.85 mm\"", bed).with_code(0).shows("8.222 mm³");
    // cooled in 100 s with a constant of 10 s
    let cold = "{ file = \"part.gcode\", of = \"bed\", cools_to = \"20 degC\", cooling_time = \"10 s\" }";
    assert!(!check("", cold).with_code(0).stdout.contains("lets the part cool"));
    // a piece without contact to the bed
    let loose = format!(
        "M83\nM104 S210\n;TYPE:Perimeter\nG1 Z.2 F600\nG1 X10 E{e}\n;TYPE:Support\n;HEIGHT:0.2\nG1 Z5\nG1 \
         X0 E{e}\n"
    );
    fs::write(here.join("part.gcode"), loose).unwrap();
    let mechanics = "[mechanics]\nmaterial = \"pla\"\nbed = \"bottom\"\nlaw = \
                     { elastic = { modulus = \"1 GPa\", poisson = 0.3, expansion = \"1e-4 1/K\" } }\n";
    for (keys, code) in [("", 2), ("leave_out = [\"support\"]", 0)] {
        fs::write(here.join("part.toml"), scene(0.2, keys, STILL, true, 100.0) + mechanics).unwrap();
        let told = crystfem("check part.toml", here).with_code(code);
        if code == 2 {
            told.tells(
                "`mesh.path.leave_out` removes skirts, brims and purge lines (features of the file: \
                        Perimeter, Support)",
            );
        }
    }
    for (bytes, text) in [(&b"GCDE\x01\0\0\0"[..], "binary G-code"), (b"PK\x03\x04", "an archive")] {
        fs::write(here.join("part.gcode"), bytes).unwrap();
        check("", "\"60 degC\"").with_code(2).tells(text);
    }
    fs::write(here.join("part.gcode"), "M200 D1.75\nM83\nM104 S200\nG1 Z.2 F600\nG1 X10 E1\n").unwrap();
    check("filament = \"2.85 mm\"", "\"60 degC\"")
        .with_code(2)
        .tells("E in the file is a volume (M200) of this diameter");
    check("", "\"60 degC\"").with_code(0).shows("1.000 mm³ of 0.4 mm");
}
