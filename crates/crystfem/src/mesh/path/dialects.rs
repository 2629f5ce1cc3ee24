//! Tests of G-code dialects of slicers and firmwares, in own snippets.

use super::*;
use std::f64::consts::PI;

fn parsed(text: &str) -> ToolPath {
    parse(Path::new("a.gcode"), text.as_bytes()).unwrap()
}

/// Length of filament for 0.1 mm² over 10 mm, mm.
fn line() -> f64 {
    0.1 * 10.0 / (0.25 * PI * 1.75f64.powi(2))
}

/// Filament of printing moves, mm.
#[test]
fn extruders_keep_their_mode() {
    for (dialect, text, fed) in [
        ("PrusaSlicer, lift by G91", "G90\nM83\nG1 F600 X10 E1\nG91\nG1 Z1\nG90\nG1 X0 E1\n", 2.0),
        ("SuperSlicer, M83 within G91", "G91\nM83\nG90\nG1 F600 X10 E1\nG1 X0 E1\n", 2.0),
        ("Cura, M82 and G91 to lift", "M82\nG1 F600 X10 E1\nG91\nG1 Z1\nG90\nG1 X0 E2\n", 2.0),
        ("Klipper, M82 holds within G91", "M82\nG1 F600 X10 E1\nG91\nG1 X10 E2\nG90\n", 2.0),
        ("Bambu, M83 then G90 in a macro", "M83\nG90\nG1 F600 X10 E.5\nG90\nG1 X0 E.5\n", 1.0),
        ("several commands in a line", "G21 G90\nM83\nG1 F600 X10 E1\nX0 E1\n", 2.0),
        ("no M82 or M83, absolute", "G90\nG1 F600 X10 E1\nG1 X0 E2\n", 2.0),
        ("no M82 or M83, relative", "G91\nG1 F600 X10 E1\nG1 X10 E1\n", 2.0),
        (
            "Klipper, a macro that keeps the state",
            "M82\nG90\nG1 F600 X10 E1\nSAVE_GCODE_STATE NAME=a\nG91\nM83\nG1 E-1\n\
             RESTORE_GCODE_STATE NAME=a\nG1 X0 E2\n",
            2.0,
        ),
        ("RepRapFirmware, G92", "M83\nG92 E0\nG1 F600 X10 E1\nG92 E5\nG1 X0 E1\n", 2.0),
    ] {
        let found = 1e3 * parsed(text).fed();
        assert!((found - fed).abs() < 1e-12, "{dialect}: {found} {fed}");
    }
    let notes = |text: &str| parsed(text).notes.join("\n");
    assert!(
        notes("G91\nG1 F600 X10 E1\n").contains("the first in line 2: E is read as relative, as the axes")
    );
    assert!(notes("M82\nG91\nG1 F600 X10 E1\n").contains("E is read as absolute, as M82 says"));
    assert!(notes("M83\nG91\nG1 F600 X10 E1\n").is_empty());
}

/// Heights of beads, mm, of lines of 0.1 mm².
#[test]
fn beads_lie_on_what_is_below() {
    let e = line();
    let prusa = format!(
        "M83\n;TYPE:Custom\nG1 Z.25 F600\nG1 X10 Y-9 E{e}\n;LAYER_CHANGE\n;Z:0.3\n;HEIGHT:0.3\nG1 Z.3\n\
         ;TYPE:Perimeter\nG1 X0 Y0\nG1 X10 E{e}\n;LAYER_CHANGE\n;Z:0.5\n;HEIGHT:0.2\nG1 Z.5\nG1 X0 E{e}\n\
         ;TYPE:Bridge infill\n;HEIGHT:0.4\nG1 Y5\nG1 X10 E{e}\n;TYPE:Custom\nG0 X0 Y-9 Z.25\nG1 X10 E{e}\n"
    );
    let cura = format!(
        "M83\nG1 X0.1 Y20 Z0.3 F600\nG1 X10 E{e}\n;LAYER_COUNT:2\n;LAYER:0\n;TYPE:WALL-OUTER\n\
         G0 X0 Y0 Z0.2\nG1 X10 E{e}\n;LAYER:1\nG0 X0 Y0 Z0.35\nG1 X10 E{e}\n"
    );
    let bambu = format!(
        "M83\n; FEATURE: Custom\nG1 X0 Y20 Z0.28 F600\nG1 X10 E{e}\n; CHANGE_LAYER\n; Z_HEIGHT: 0.2\n\
         ; LAYER_HEIGHT: 0.2\n; FEATURE: Outer wall\nG1 X0 Y0 Z0.2\nG1 X10 E{e}\n; CHANGE_LAYER\n\
         ; Z_HEIGHT: 0.36\n; LAYER_HEIGHT: 0.16\nG1 Z0.36\nG1 X0 E{e}\n"
    );
    // a support with its own intermediate layer, and a first layer that crosses a purge line
    let klipper = format!(
        "M83\nG1 F600 X0 Y5 Z.2\nG1 X10 E{e}\nG0 X5 Y0 Z.3\nG1 Y10 E{e}\nG0 X0 Y20 Z.15\nG1 X10 E{e}\n\
         G0 X0 Y20 Z.3\nG1 X10 E{e}\nG0 X0 Y30 Z.3\nG1 X10 E{e}\nG0 X0 Y30 Z.5\nG1 X10 E{e}\n"
    );
    // the second layer overhangs the bed beside its support; sparse lines cross lines
    let over = format!(
        "M83\nG1 F600 X0 Y0 Z.2\nG1 X10 E{e}\nG0 X0 Y0 Z.4\nG1 X10 E{e}\nG0 X0 Y3\nG1 X10 E{e}\n\
         G0 X0 Y0 Z.6\nG1 X10 E{e}\nG0 X5 Y-5\nG1 Y5 E{e}\n"
    );
    // two objects, printed one after the other
    let sequential = format!(
        "M83\nG1 F600 X0 Y0 Z.2\nG1 X10 E{e}\nG0 X0 Y0 Z.4\nG1 X10 E{e}\nG0 X0 Y50 Z.3\nG1 X10 E{e}\n\
         G0 X0 Y50 Z.5\nG1 X10 E{e}\n"
    );
    let thin = format!(
        "M83\nG1 F600 X0 Y9 Z.3\nG1 X10 E{}\nG0 X0 Y0 Z.2\nG1 X10 E{e}\nG0 X0 Y0 Z.4\nG1 X10 E{e}\n",
        0.4 * e
    );
    for (dialect, text, heights) in [
        ("PrusaSlicer", &prusa, vec![0.25, 0.3, 0.2, 0.4, 0.25]),
        ("Cura", &cura, vec![0.3, 0.2, 0.15]),
        ("Bambu Studio", &bambu, vec![0.28, 0.2, 0.16]),
        ("OrcaSlicer for Klipper, without comments", &klipper, vec![0.2, 0.3, 0.15, 0.15, 0.3, 0.2]),
        ("overhang", &over, vec![0.2, 0.2, 0.2, 0.2, 0.2]),
        ("a thin purge line, alone at its height", &thin, vec![0.3, 0.2, 0.2]),
        ("one by one", &sequential, vec![0.2, 0.2, 0.3, 0.2]),
    ] {
        let found = parsed(text).heights(1.75e-3, None);
        let near = found.iter().zip(&heights).all(|(found, exact)| (1e3 * found - exact).abs() < 1e-9);
        assert!(near && found.len() == heights.len(), "{dialect}: {found:?} {heights:?}");
    }
    assert_eq!(parsed(&prusa).heights(1.75e-3, Some(1e-4)), [1e-4; 5]);
}

/// A square of 10 mm: a flat ring, then five turns that each rise by 0.2 mm.
#[test]
fn vases_rise_by_a_turn() {
    let e = line();
    let mut text = "M83\nG1 F600 X0 Y0 Z.2\n".to_owned();
    let corners = [[10, 0], [10, 10], [0, 10], [0, 0]];
    for side in 0..24 {
        let [x, y] = corners[side % 4];
        let z = 0.2 + 0.05 * (side + 1).saturating_sub(4) as f64;
        text += &format!("G1 X{x} Y{y} Z{z:.3} E{e}\n");
    }
    let heights = parsed(&text).heights(1.75e-3, None);
    assert!(heights[..4].iter().all(|height| (1e3 * height - 0.2).abs() < 1e-9), "{heights:?}");
    // the first turn begins as a wedge on the flat ring
    assert!(heights[4..8].iter().all(|height| (1e3 * height - 0.2).abs() < 0.02), "{heights:?}");
    assert!(heights[8..].iter().all(|height| (1e3 * height - 0.2).abs() < 2e-3), "{heights:?}");
}

/// Nozzle temperatures and fan speeds.
#[test]
fn tools_and_fans() {
    let settings = |text: &str, of: Setting| -> Vec<f64> {
        let round = |value: f64| (1e6 * value).round() / 1e6;
        parsed(text)
            .setting(of)
            .iter()
            .map(|pair| round(if of == Setting::Fan { pair.1 } else { pair.1 - 273.15 }))
            .collect()
    };
    let go = "G91\nG1 X1 F600\n";
    for (dialect, text, found) in [
        (
            "PrusaSlicer, idle tool",
            format!("T0\nM104 S210\nM104 T1 S150\n{go}M104 S205\n"),
            vec![210.0, 205.0],
        ),
        (
            "Cura, tool change",
            format!("T0\nM109 S210\nM104 T1 S180\n{go}T1\nM109 S230\n{go}M104 T0 S150\n"),
            vec![210.0, 230.0],
        ),
        (
            "Cura, waiting tool",
            format!("T0\nM109 T0 S210\nM109 T1 S230\n{go}T1\n{go}T0\n"),
            vec![210.0, 230.0, 210.0],
        ),
        ("Prusa MMU, one nozzle", format!("M104 S215\nT0\n{go}T1\n{go}Tx\nT?\n"), vec![215.0]),
        ("RepRapFirmware", format!("G10 P0 S200 R160\nG10 P1 S240\nT0\n{go}T1\n"), vec![200.0, 240.0]),
        (
            "Klipper",
            format!("M104 S220\nM104 T1 S190\n{go}ACTIVATE_EXTRUDER EXTRUDER=extruder1\n"),
            vec![220.0, 190.0],
        ),
        ("Klipper, macro", format!("START_PRINT BED_TEMP=60 EXTRUDER_TEMP=205\n{go}"), vec![205.0]),
        (
            "Klipper, heaters by name",
            format!(
                "SET_HEATER_TEMPERATURE HEATER=extruder TARGET=220\n\
                 {go}SET_HEATER_TEMPERATURE HEATER=extruder1 TARGET=200\n"
            ),
            vec![220.0],
        ),
        ("Bambu", format!("M104 S250 ; nozzle\nT1000\n{go}M620.1 E F299 T270\n"), vec![250.0]),
    ] {
        assert_eq!(settings(&text, Setting::Nozzle), found, "{dialect}");
    }
    for (dialect, text, found) in [
        ("PrusaSlicer", format!("M106 S255\n{go}M107\n"), vec![1.0, 0.0]),
        (
            "OrcaSlicer, auxiliary and exhaust",
            format!("M106 S255\n{go}M106 P2 S0\nM106 P3 S127\n"),
            vec![1.0],
        ),
        ("Bambu, its part fan", format!("; BambuStudio 01.07\nM106 P1 S51\n{go}M106 P2 S178\n"), vec![0.2]),
        ("another printer's P1", format!("M106 P0 S51\n{go}M106 P1 S255\nM107 P1\n"), vec![0.2]),
        ("RepRapFirmware", format!("M106 S0.4\n{go}M106 P0 S0.2\n"), vec![0.4, 0.2]),
    ] {
        assert_eq!(settings(&text, Setting::Fan), found, "{dialect}");
    }
    assert!(parsed("M106 P2 S0\nM106 P2 S9\nM107\n").notes[0].contains("M106 P2 (2)"));
    let tools = parsed("M83\nG1 X1 E1 F600\nT1\nG1 X2 E1\n");
    assert_eq!(tools.tools(), [0, 1]);
}

/// Features are removed by name, with the number of printing moves removed.
#[test]
fn features_have_one_name() {
    let file = |features: &[&str]| {
        let lines = features.iter().map(|feature| format!("{feature}\nG1 X1 E1\nG1 X0 E1\n"));
        format!("M83\nG1 F600 Z.2\nG1 X2 E1\n{}", lines.collect::<String>())
    };
    let prusa =
        file(&[";TYPE:Skirt/Brim", ";LAYER_CHANGE\n;TYPE:External perimeter", ";TYPE:Support material"]);
    let cura =
        file(&[";LAYER:0\n;TYPE:SKIRT", ";TYPE:WALL-OUTER", ";TYPE:SUPPORT", ";TYPE:SUPPORT-INTERFACE"]);
    let bambu = file(&["; CHANGE_LAYER\n; FEATURE: Brim", "; FEATURE: Outer wall", "; FEATURE: Prime tower"]);
    let orca =
        file(&[";LAYER_CHANGE\n;TYPE:Skirt", ";TYPE:Outer wall", ";TYPE:Support interface", ";TYPE:Custom"]);
    for (dialect, text, name, count) in [
        ("PrusaSlicer", &prusa, "skirt", Some(2)),
        ("PrusaSlicer", &prusa, "brim", Some(2)),
        ("PrusaSlicer", &prusa, "External Perimeter", Some(2)),
        ("PrusaSlicer", &prusa, "support", Some(2)),
        ("Cura", &cura, "skirt", Some(2)),
        ("Cura", &cura, "support", Some(4)),
        ("Cura", &cura, "support-interface", Some(2)),
        ("Cura", &cura, "purge", Some(1)),
        ("Bambu Studio", &bambu, "brim", Some(2)),
        ("Bambu Studio", &bambu, "skirt", Some(0)),
        ("Bambu Studio", &bambu, "prime-tower", Some(2)),
        ("OrcaSlicer", &orca, "supports", Some(2)),
        ("OrcaSlicer", &orca, "purge", Some(3)),
        ("OrcaSlicer", &orca, "outer-wall", Some(2)),
        ("OrcaSlicer", &orca, "walls", None),
    ] {
        let mut path = parsed(text);
        let all = path.printing_moves().count();
        assert_eq!(path.remove_feature(name), count, "{dialect} {name}");
        assert_eq!(all - path.printing_moves().count(), count.unwrap_or(0), "{dialect} {name}");
    }
    let shares = parsed(&cura);
    let shares = shares.shares();
    assert_eq!(shares.len(), 5);
    assert!((shares.iter().map(|share| share.1).sum::<f64>() - 1.0).abs() < 1e-12);
}

/// Volumes of extrusion, mm³.
#[test]
fn extrusion_by_volume() {
    for (dialect, text, volume) in [
        ("Marlin", "M200 D1.75\nM83\nG1 F600 X10 E2\n", 2.0),
        ("Marlin, S1", "M200 S1 D2.85\nM83\nG1 F600 X10 E2\n", 2.0),
        (
            "Marlin, off again",
            "M200 D1.75\nM83\nG1 F600 X10 E2\nM200 D0\nG1 X0 E1\n",
            2.0 + 0.25 * PI * 1.75f64.powi(2),
        ),
        ("PrusaSlicer", "M83\nM200 D1.75 ; volumetric\nG1 F600 X10 E2\nM200 S0\n", 2.0),
        ("Cura, Marlin (Volumetric)", ";FLAVOR:Marlin(Volumetric)\nM82\nG1 F600 X10 E2\n", 2.0),
        (
            "a thick filament",
            "M83\nG1 F600 X10 E1\n; filament_diameter = 2.85\n",
            0.25 * PI * 2.85f64.powi(2),
        ),
        (
            "two filaments",
            "M83\nG1 F600 X10 E1\nT1\nG1 X0 E1\n; filament_diameter = 1.75,2.85\n",
            0.25 * PI * (1.75f64.powi(2) + 2.85f64.powi(2)),
        ),
    ] {
        let path = parsed(text);
        let found: f64 =
            path.printing_moves().map(|one| 1e9 * one.volume(path.filament.unwrap_or(FILAMENT))).sum();
        assert!((found - volume).abs() < 1e-9, "{dialect}: {found} {volume}");
    }
}

/// Files other than G-code text are refused by kind; unknown commands are skipped.
#[test]
fn files_of_other_kinds() {
    let refused = |bytes: &[u8]| parse(Path::new("a.gcode"), bytes).unwrap_err().to_string();
    for (bytes, told) in [
        (&b"GCDE\x01\0\0\0"[..], "binary G-code"),
        (b"PK\x03\x04abc", "an archive"),
        (b"\x1f\x8b\x08", "a compressed file"),
        (b"\xff\xfeG\x001\x00", "UTF-16"),
    ] {
        assert!(refused(bytes).contains(told), "{told}");
    }
    assert!(refused(b"GCDE\x01").contains("export it from the slicer as text"));
    for text in [
        "\u{feff}%\nN1 G21*33\nN2 G1 X10 F600 E1*5\nM117 Hi; there\n%\n",
        "EXCLUDE_OBJECT_DEFINE NAME=a CENTER=1,2 POLYGON=[[1,2]]\nGET_POSITION\nG29 P1 A?\n/G1 X5\n@pause\n\
         g1x10f600e1\n",
        "(Cura) G1 (to) X10 F600 E1\r\nM84 X Y E\r\nG5\r\n",
        "G1 X10 F600 E1\rM84\rM300\r",
    ] {
        let path = parsed(text);
        assert_eq!(path.moves.len(), 1, "{text}");
        assert_eq!(path.moves[0].to, [0.01, 0.0, 0.0], "{text}");
    }
    assert!(
        parsed("START_PRINT A=1\nSTART_PRINT A=2\nM73 P1\nG1 X1 F60\n").notes[0]
            .contains("START_PRINT (2), M73 (1)")
    );
    let mut loose = parsed("M83\nG1 X10 E1 F600\nG0 X0 Z15\nG1 X8 Z.2 E1\nG1 X18 E8\n");
    let (count, line, share) = loose.remove_loose().unwrap();
    assert!(count == 2 && line == 2 && (share - 0.2).abs() < 1e-12 && loose.printing_moves().count() == 1);
}

/// Times with limits stated in the file agree with closed forms: from rest to rest with jerk and
/// acceleration.
#[test]
fn limits_of_the_file() {
    let time = |text: &str| parsed(text).with_stated_limits().duration();
    // both ends at jerk speed j: L/v + (v − j)²/(v a)
    let with_jerk = |length: f64, v: f64, a: f64, j: f64| length / v + (v - j).powi(2) / (v * a);
    let one = "G1 X100 F3000\n";
    for (dialect, text, exact) in [
        ("Marlin", format!("M204 P500 T500\nM205 X10 Y10\n{one}"), with_jerk(100.0, 50.0, 500.0, 10.0)),
        (
            "Marlin, an axis is slower",
            format!("M201 X500\nM204 P5000 T5000\nM205 X10\n{one}"),
            with_jerk(100.0, 50.0, 500.0, 10.0),
        ),
        ("Marlin, M203", format!("M203 X25 Y25\n{one}"), 4.0),
        (
            "RepRapFirmware, mm/min",
            "M566 X600 Y600\nM201 X500\nM203 X3000\nG1 X100 F6000\n".to_owned(),
            with_jerk(100.0, 50.0, 500.0, 10.0),
        ),
        (
            "Klipper",
            format!("SET_VELOCITY_LIMIT ACCEL=500 SQUARE_CORNER_VELOCITY=10\n{one}"),
            with_jerk(100.0, 50.0, 500.0, 10.0),
        ),
        (
            "PrusaSlicer, settings",
            format!("{one}; machine_max_acceleration_x = 500,100\n; machine_max_jerk_x = 10,5\n"),
            with_jerk(100.0, 50.0, 500.0, 10.0),
        ),
        ("Marlin, junction deviation", format!("M204 P500 T500\nM205 J0.01\n{one}"), 2.0 + 0.1),
        (
            "printing and travel differ",
            format!("M83\nM204 P500 T1000\nM205 X10 E100\n{}", "G1 X100 E1 F3000\n"),
            with_jerk(100.0, 50.0, 500.0, 10.0),
        ),
    ] {
        let found = time(&text);
        // the last move ends at rest
        let end = if exact == 4.0 || dialect.contains("deviation") {
            exact
        } else {
            ends_at_rest(exact, 50.0, 500.0, 10.0)
        };
        assert!((found - end).abs() < 1e-9, "{dialect}: {found} {end}");
    }
    assert_eq!(parsed(one).describe_limits(), None);
    // a corner of 90° at jerk speed: two moves that each end at 10 mm/s, except the last
    let corner = time("M204 S500\nM205 X10 Y10\nG1 X100 F3000\nG1 Y100\n");
    let halves = with_jerk(100.0, 50.0, 500.0, 10.0)
        + ends_at_rest(with_jerk(100.0, 50.0, 500.0, 10.0), 50.0, 500.0, 10.0);
    assert!((corner - halves).abs() < 1e-9, "{corner} {halves}");
    // a retraction between moves stops the nozzle, and takes time itself
    let through = time("M83\nM204 S500 T500\nM205 X10 E10\nG1 X50 F3000\nG1 X100\n");
    let stopped = time("M83\nM204 S500 T500\nM205 X10 E10\nG1 X50 F3000\nG1 E-1 F3000\nG1 X100 F3000\n");
    assert!(stopped > through + 0.1, "{through} {stopped}");
    // commands shift with the moves
    let path = parsed("M204 S500\nG1 X100 F3000\nG4 S3\nM104 S200\nG1 X0\n").with_stated_limits();
    assert!((path.commands[0].time - path.moves[1].start).abs() < 1e-9);
}

/// Extra time of a ramp from v to rest over one to j.
fn ends_at_rest(time: f64, v: f64, a: f64, j: f64) -> f64 {
    time + (v * v - (v - j).powi(2)) / (2.0 * a * v)
}

/// A square of one wall as written by PrusaSlicer for a MINI: fifteen layers with retractions, wipes and
/// lifts; estimated at 67 s.
#[test]
fn time_of_prusa_slicer() {
    let mut text = "M201 X1250 Y1250 Z400 E5000\nM203 X180 Y180 Z12 E80\nM204 P1250 R1250 T1250\n\
        M205 X8 Y8 Z2 E10\nM83\nG1 Y-2 X179 F2400\nG1 Z3 F720\nG1 X170 F1000\nG1 Z0.2 F720\n\
        G1 X110 E8 F900\nG1 X40 E10 F700\nG1 E-3.2 F4200\nG1 Z.4 F10800\n"
        .to_owned();
    for layer in 1..=15 {
        let (z, low, high) = (0.2 * f64::from(layer), 82.725, 97.275);
        if layer > 1 {
            text += &format!(
                "G1 E-2.24 F4200\nG1 F8640 X84.7 Y82.777 E-.912\nG1 E-.048 F4200\nG1 Z{z:.1} F10800\n\
                 G1 Z{:.1}\n",
                z + 0.2
            );
        }
        text += &format!(
            "G1 X{low} Y{low} F10800\nG1 Z{z:.1}\nG1 E3.2 F2400\nM204 S800\nG1 F{}\n",
            if layer > 1 { 1293 } else { 1637 }
        );
        for [x, y] in [[high, low], [high, high], [low, high], [low, low + 0.06]] {
            text += &format!("G1 X{x} Y{y} E.4925\n");
        }
        text += "M204 S1250\n";
    }
    text += "G1 E-2.24 F4200\nG1 F8640 X84.7 Y82.777 E-.912\nG1 E-.048 F4200\nG1 Z3.2 F10800\nG1 E-1 F2100\n\
        G1 Z5 F720\nG1 X178 Y178 F4200\nG1 Z33 F720\n";
    let path = parsed(&text);
    let found = path.clone().with_stated_limits().duration();
    assert!((found / 67.0 - 1.0).abs() < 0.01, "{found}");
    assert!(path.duration() < 0.94 * 67.0, "{}", path.duration());
}

#[test]
fn estimates_are_compared() {
    let told = |text: &str| parsed(text).compare_estimate("at F").unwrap();
    let go = "G1 X100 F600\n";
    assert!(told(&format!("{go};TIME:10\n")).ends_with("and 10 s as its slicer estimates (+0.0 %)"));
    let off = told(&format!("{go}; estimated printing time (normal mode) = 12s\n"));
    assert!(off.contains("(-16.7 %): `acceleration` and `jerk` set other limits"), "{off}");
    let bambu = told(&format!(
        "; model printing time: 10s; total estimated time: 5m 1s\n{go}; CHANGE_LAYER\nG1 X0\n"
    ));
    assert!(
        bambu.starts_with("from the first layer on the path takes 10 s at F") && bambu.contains("+0.0 %"),
        "{bambu}"
    );
    assert_eq!(parsed(go).compare_estimate("at F"), None);
    let lines = parsed(&format!(
        "M83\n{go};LAYER_CHANGE\n;TYPE:Perimeter\nG1 X0 E1\n;TYPE:Solid infill\nG1 X10 E3\n"
    ))
    .summary(1.75e-3);
    assert!(
        lines[0].starts_with(
            "the file prints 1 marked layer, centrelines from (0, 0, 0) mm to (100, \
        0, 0) mm, 9.621 mm³ of 4.0 mm"
        ),
        "{lines:?}"
    );
    assert_eq!(lines[1], "by feature: `Solid infill` 75.0 %, `Perimeter` 25.0 %");
}
