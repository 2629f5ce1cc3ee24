use super::*;
use crate::mesh::{Grid, layers};

fn parsed(text: &str) -> ToolPath {
    parse(Path::new("a.gcode"), text.as_bytes()).unwrap()
}

fn refused(text: &str, words: &[&str]) {
    let error = parse(Path::new("a.gcode"), text.as_bytes()).unwrap_err().to_string();
    assert!(words.iter().all(|word| error.contains(word)), "{error}");
}

/// Returns a plate of 20 × 10 × 2 elements of 0.5 mm, 0.2 mm high, and alternating lines along x at the
/// centres of the rows, 10 mm/s.
fn plate() -> (Mesh, ToolPath) {
    let mesh = Grid::uniform([0.0; 3], [0.01, 0.005, 4e-4], [20, 10, 2]).unwrap().mesh("plate").unwrap();
    let mut text = "G21\nG90\nM83\nG0 X0 Y0.25 Z0.2 F600\n".to_owned();
    for layer in 0..2 {
        for row in 0..10 {
            let y = 0.25 + 0.5 * f64::from(row);
            text += &format!(
                "G0 Y{y} Z{}\nG1 X{} E1\n",
                0.2 * f64::from(layer + 1),
                if row % 2 == 0 { 10 } else { 0 }
            );
        }
        text += "G0 X0\n";
    }
    (mesh, parsed(&text))
}

#[test]
fn elements_appear_as_the_nozzle_passes() {
    let (mesh, path) = plate();
    let all: Vec<u32> = (0..400).collect();
    let activation = path.activation_times(&mesh, &all, Bead { width: 5e-4, height: 2e-4 }).unwrap();
    assert!(activation.missed.is_empty());
    let begin = path.moves.iter().find(|one| one.prints).unwrap().start;
    // a row lasts 1 s and the step to the next 0.05 s; centres lie at 0.25 mm, 0.75 mm, …
    for (element, time) in activation.times.iter().enumerate() {
        let (column, row, layer) = (element % 20, element / 20 % 10, element / 200);
        let along = (column as f64 + 0.5) / 20.0;
        let along = if row % 2 == 0 { along } else { 1.0 - along };
        // from one layer to the next: 4.5 mm back and 0.2 mm up in one move
        let back = (4.5f64.powi(2) + 0.04).sqrt() / 10.0;
        let exact = begin + layer as f64 * (10.0 + 9.0 * 0.05 + back) + row as f64 * 1.05 + along;
        assert!((time - exact).abs() < 1e-9, "{element}: {time} {exact}");
    }
    // in windows of a second: never early, at most a second late
    let groups = layers::groups(&activation.times, 1.0).unwrap();
    assert!(groups.len() <= 24);
    for (time, elements) in groups {
        assert!(elements.iter().all(|e| (0.0..1.0 + 1e-9).contains(&(time - activation.times[*e as usize]))));
    }
}

#[test]
fn activation_agrees_with_an_exhaustive_search() {
    // slanted, rising, standing and distant moves against a double loop over moves and elements
    let mesh = Grid::uniform([0.0; 3], [0.01, 0.007, 0.002], [23, 17, 5]).unwrap().mesh("plate").unwrap();
    let line = |from: [f64; 3], to: [f64; 3], start: f64| Move {
        from,
        to,
        start,
        end: start + 1.0,
        prints: true,
        ..Move::default()
    };
    let moves = vec![
        line([-0.5, -0.4, 4e-4], [0.9, 0.6, 4e-4], 3.0),
        line([0.002, 0.001, 1e-3], [0.009, 0.006, 2e-3], 1.0),
        line([0.005, 0.003, 8e-4], [0.005, 0.003, 8e-4], 0.0),
        line([1e9, 0.003, 2e-3], [-1e9, 0.004, 2e-3], 5.0),
        line([0.0, 0.1, 4e-4], [0.01, 0.1, 4e-4], 0.0),
    ];
    let path = ToolPath { moves, ..ToolPath::default() };
    let bead = Bead { width: 1.3e-3, height: 5e-4 };
    let all: Vec<u32> = (0..mesh.element_count() as u32).collect();
    let activation = path.activation_times(&mesh, &all, bead).unwrap();
    for element in all {
        let [x, y, z] = mesh.centre(element);
        let mut first = f64::INFINITY;
        for one in &path.moves {
            let along = [one.to[0] - one.from[0], one.to[1] - one.from[1]];
            let square = along[0] * along[0] + along[1] * along[1];
            let way = (x - one.from[0]) * along[0] + (y - one.from[1]) * along[1];
            let share = if square > 0.0 { (way / square).clamp(0.0, 1.0) } else { 0.0 };
            let away = (x - one.from[0] - share * along[0]).hypot(y - one.from[1] - share * along[1]);
            let top = one.from[2] + share * (one.to[2] - one.from[2]);
            if away <= 0.5 * bead.width && z <= top && z > top - bead.height {
                first = first.min(one.start + share);
            }
        }
        assert_eq!(activation.times[element as usize], first, "{element}");
    }
    assert!(!activation.missed.is_empty());
}

#[test]
fn a_raster_fills_its_bar() {
    let (mesh, _) = plate();
    let all: Vec<u32> = (0..400).collect();
    let bead = Bead { width: 5e-4, height: 2e-4 };
    let area = [[0.0, 0.0], [0.01, 0.005]];
    // ten lines of 1 s and nine steps of 0.05 s
    let path = ToolPath::raster(area, bead, 2, 0.01, 12.0).unwrap();
    assert_eq!(path.moves.len(), 20 + 19);
    let activation = path.activation_times(&mesh, &all, bead).unwrap();
    assert!(activation.missed.is_empty());
    for (element, time) in activation.times.iter().enumerate() {
        let (column, row, layer) = (element % 20, element / 20 % 10, element / 200);
        let along = (column as f64 + 0.5) / 20.0;
        let along = if row % 2 == 0 { along } else { 1.0 - along };
        assert!((time - (layer as f64 * 12.0 + row as f64 * 1.05 + along)).abs() < 1e-9);
    }
    let text =
        |velocity, interval| ToolPath::raster(area, bead, 2, velocity, interval).unwrap_err().to_string();
    assert!(text(0.01, 10.0).contains("time from layer to layer: found 10; allowed: 10.45 s or more"));
    assert!(text(0.0, 10.0).contains("velocity: found 0"));
    let fine = ToolPath::raster(area, Bead { width: 1e-12, ..bead }, 2, 0.01, 1e12).unwrap_err().to_string();
    assert!(fine.contains("lines of a path: found"), "{fine}");
}

#[test]
fn gaps_can_be_filled() {
    let (mesh, path) = plate();
    let all: Vec<u32> = (0..400).collect();
    // every other row only
    let moves: Vec<Move> = (path.moves.iter().copied())
        .map(|one| Move { prints: one.prints && one.to[0] > one.from[0] && one.to[2] < 3e-4, ..one })
        .collect();
    let path = ToolPath { moves, ..ToolPath::default() };
    let mut activation = path.activation_times(&mesh, &all, Bead { width: 5e-4, height: 2e-4 }).unwrap();
    assert_eq!(activation.missed.len(), 300);
    // the second layer was never printed
    assert_eq!(activation.fill(&mesh), 200);
    let last = path.moves.iter().filter(|one| one.prints).map(|one| one.end).fold(0.0, f64::max);
    assert_eq!(activation.times[20], last);
    assert_eq!(activation.times[399], f64::INFINITY);
}

#[test]
fn codes_and_their_forms() {
    let text = "; a comment\nN10 G21 ; mm*\nM104 S220\nM117 Printing... (1/2)\nG28\nG92 E0\nG1 F1200\n\
        G1X10Y0E1\ng1 x10 y20 e1.5 (two) f600\nG4 P500\nG91\nG1 Z0.2 F60\nG90\nG92 X0 E0\nG1 X5 E1 F300*71\n\
        G1 E0\nG1 E2\nG20\nG0 X1\n";
    let path = parsed(text);
    let places: Vec<[f64; 3]> = path.moves.iter().map(|one| one.to).collect();
    let exact = [
        [0.01, 0.0, 0.0],
        [0.01, 0.02, 0.0],
        [0.01, 0.02, 2e-4],
        [0.015, 0.02, 2e-4],
        [0.01 + 0.0254, 0.02, 2e-4],
    ];
    for (place, exact) in places.iter().zip(exact) {
        assert!((0..3).all(|d| (place[d] - exact[d]).abs() < 1e-15), "{place:?} {exact:?}");
    }
    assert_eq!(path.moves.iter().map(|one| one.prints).collect::<Vec<_>>(), [true, true, false, true, false]);
    // 10 mm at 20 mm/s, 20 at 10, a wait of 0.5 s, 0.2 at 1, 5 at 5, filament 1 and 2 at 5
    let starts = [0.0, 0.5, 3.0, 3.2, 4.8];
    for (one, start) in path.moves.iter().zip(starts) {
        assert!((one.start - start).abs() < 1e-12, "{one:?} {start}");
    }
    assert_eq!(path.notes, ["commands not used: M117 (1)"]);
    assert_eq!(path.commands, [Command { time: 0.0, setting: Setting::Nozzle, value: 220.0 + 273.15 }]);
    let moved = path.clone().translated([1.0, 0.0, 0.0]);
    assert_eq!(moved.moves[0].from, [1.0, 0.0, 0.0]);
    assert_eq!(moved.duration(), path.duration());
}

#[test]
fn errors_name_the_line() {
    refused("G21\nG1 X1\n", &["a.gcode:2: velocity F: found \"0\""]);
    refused("G1 X1 F-5\n", &["a.gcode:1: velocity F: found \"-5\""]);
    refused(
        "G1 F100\nG5 X1 Y1 I1\n",
        &["a.gcode:2: command: found \"G5\"; allowed: straight moves and arcs"],
    );
    refused("G18\n", &["a.gcode:1: command: found \"G18\"", "G17"]);
    refused("G1 F100\nG2 X1 Y1\n", &["a.gcode:2: arc: found \"G2 X1 Y1\"; allowed: I and J, or R"]);
    refused("G1 F100\nG3 X4 R1\n", &["a.gcode:2: radius of an arc: found \"1\"; allowed: 2 or more in size"]);
    refused("G1 F100\nG3 R1\n", &["a.gcode:2: arc: found \"G3 R1\"", "full circle"]);
    refused("G1 F100\nG2 X5 Y5 I1\n", &["a.gcode:2: end of an arc", "1 from its centre"]);
    refused("M104 S-300\n", &["a.gcode:1: temperature", "-273.15"]);
    refused("G1 X1.2.3 F100\n", &["a.gcode:1: word: found \"X1.2.3 F100\""]);
    refused("G1 X?\n", &["a.gcode:1: word: found \"?\""]);
    let (mesh, path) = plate();
    let text = |result: Result<ActivationTimes, Error>| result.unwrap_err().to_string();
    assert!(
        text(path.activation_times(&mesh, &[0], Bead { width: 0.0, height: 1.0 }))
            .contains("width of the bead: found 0")
    );
    let bead = Bead { width: 5e-4, height: 2e-4 };
    assert!(
        text(path.activation_times(&mesh, &[400], bead)).contains("element: found 400; allowed: below 400")
    );
    assert!(text(ToolPath::default().activation_times(&mesh, &[0], bead)).contains("prints nothing"));
    let mut bad = path.clone();
    bad.moves[3].to[1] = f64::NAN;
    assert!(text(bad.activation_times(&mesh, &[0], bead)).contains("move of the path: found NaN"));
}

#[test]
fn a_table_of_moves() {
    let folder = std::env::temp_dir().join(format!("crystfem-path-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let write = |text: &str| {
        let file = folder.join("moves.csv");
        std::fs::write(&file, text).unwrap();
        read_csv(&file)
    };
    let path =
        write("time [min],x [mm],y [cm],z,print\n0,0,0,2e-4,0\n1,10,0,2e-4,1\n1.5,10,5,2e-4,0\n").unwrap();
    assert_eq!(path.moves.len(), 2);
    assert_eq!(path.moves[0].to, [0.01, 0.0, 2e-4]);
    assert_eq!((path.moves[1].to, path.moves[1].end), ([0.01, 0.05, 2e-4], 90.0));
    assert!(path.moves[0].prints && !path.moves[1].prints);
    let text = |result: Result<ToolPath, Error>| result.unwrap_err().to_string();
    assert!(text(write("time,x,y,z\n0,0,0,0\n")).contains("one column `print"));
    assert!(text(write("time,x [s],y,z,print\n0,0,0,0,0\n")).contains("a length is needed"));
    assert!(
        text(write("time,x,y,z,print\n1,0,0,0,0\n0,0,0,0,0\n")).contains("moves.csv:3: time: found \"0\"")
    );
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A path of two lines of 10 mm along x over a brick: one misses it by half of its length, the other
/// entirely.
#[test]
fn fraction_outside_and_centring() {
    let (mesh, _) = plate();
    let all: Vec<u32> = (0..400).collect();
    let bead = Bead { width: 5e-4, height: 2e-4 };
    let line = |from: [f64; 2], start: f64| Move {
        from: [from[0], from[1], 2e-4],
        to: [from[0] + 0.01, from[1], 2e-4],
        start,
        end: start + 1.0,
        prints: true,
        ..Move::default()
    };
    let path =
        ToolPath { moves: vec![line([0.005, 0.0025], 0.0), line([0.1, 0.0025], 1.0)], ..ToolPath::default() };
    assert!((path.fraction_outside(&mesh, &all, bead) - 0.75).abs() < 1e-12);
    assert_eq!(path.bounds(bead), Some([[0.005, 0.0025, 0.0], [0.11, 0.0025, 2e-4]]));
    // over the whole bed and one more: nothing above the brick, nothing below it
    for z in [-1e-3, 1e-2] {
        assert_eq!(path.clone().translated([0.0, 0.0, z]).fraction_outside(&mesh, &all, bead), 1.0);
    }
    let one =
        ToolPath { moves: vec![line([0.1, 0.3], 0.0)], ..ToolPath::default() }.centred(&mesh, &all, bead);
    assert!(one.fraction_outside(&mesh, &all, bead) == 0.0 && (one.moves[0].from[1] - 0.0025).abs() < 1e-15);
    assert_eq!(ToolPath::default().bounds(bead), None);
}

/// Arcs of tinyg's test, 270° clockwise and 90° anticlockwise of radius 10, a full circle of 20, a half
/// circle by R, have exact lengths, chords within 0.01 mm, and filament along them.
#[test]
fn arcs_have_their_lengths() {
    let path = parsed(
        "G21\nG90\nM83\nG0 X0 Y0 Z0.25 F1200\nG2 X10 Y-10 I10 E1\nG0 X0 Y0\nG3 X10 Y-10 I10 E1\nG0 X0 Y0\n\
         G2 X0 Y0 I20 E1\nG0 X0 Y5\nG0 X0 Y0\nG3 X20 Y0 R10 E1\nG0 X0 Y0\nG2 X0 Y20 R-10.5 E1\n",
    );
    let centres =
        [[10.0, 0.0], [10.0, 0.0], [20.0, 0.0], [10.0, 0.0], [-(10.5f64.powi(2) - 100.0).sqrt(), 10.0]];
    let half = (10.0f64 / 10.5).asin();
    let exact = [47.12389, 15.70796, 125.66371, 31.41593, 10.5 * 2.0 * (std::f64::consts::PI - half)];
    let mut arcs = path.moves.split(|one| !one.prints).filter(|arc| !arc.is_empty());
    for (centre, exact) in centres.into_iter().zip(exact) {
        let arc = arcs.next().unwrap();
        // at 20 mm/s
        let found = 20.0 * (arc[arc.len() - 1].end - arc[0].start);
        assert!((found - exact).abs() < 6e-6, "{found} {exact}");
        assert!((arc.iter().map(|one| one.fed).sum::<f64>() - 1e-3).abs() < 1e-15);
        let radius = |x: [f64; 2]| 1e-3 * (1e3 * x[0] - centre[0]).hypot(1e3 * x[1] - centre[1]);
        let own = radius([arc[0].from[0], arc[0].from[1]]);
        for one in arc {
            assert!((radius([one.to[0], one.to[1]]) - own).abs() < 1e-12);
            let away = own - radius([0, 1].map(|d| 0.5 * (one.from[d] + one.to[d])));
            assert!(away > 0.0 && away < 1.0001e-5, "{away}");
        }
    }
    assert!(arcs.next().is_none());
    // a helix, relative, in inches: half a turn of radius 1 in, 1 in up
    let helix = parsed("G20\nG91\nG1 F60\nG3 X2 Y0 Z1 R1 E0.1\n");
    let last = helix.moves[helix.moves.len() - 1];
    assert!((last.to[0] - 0.0508).abs() < 1e-12 && (last.to[2] - 0.0254).abs() < 1e-15);
    assert!((last.end - std::f64::consts::PI.hypot(1.0)).abs() < 1e-9);
    let middle = helix.moves[helix.moves.len() / 2].from;
    assert!((middle[1] + 0.0254).abs() < 1e-4 && (middle[2] - 0.0127).abs() < 4e-4, "{middle:?}");
}

/// Times from rest to rest: L/v + v/a if the velocity is reached, otherwise 2√(L/a); through a corner of 90°
/// at jerk speed.
#[test]
fn accelerations_take_their_time() {
    let time = |text: &str| parsed(text).with_acceleration(0.5, 0.008).unwrap().duration();
    assert!((time("G1 X100 F3000\n") - (2.0 + 0.1)).abs() < 1e-12);
    assert!((time("G1 X2 F6000\n") - 2.0 * (0.002f64 / 0.5).sqrt()).abs() < 1e-12);
    // straight on as one move
    assert!((time("G1 X60 F3000\nG1 X100\n") - 2.1).abs() < 1e-12);
    // from 50 mm/s down to 8 at the corner: twice (50 + 42)/500 s and the remainder at 50 mm/s
    let ramp = (2.5e-3 - 0.64e-4 / 1.0 + 2.5e-3) / (2.0 * 0.5);
    let exact = 2.0 * ((0.05 + 0.042) / 0.5 + (0.1 - ramp) / 0.05);
    let found = time("G1 X100 F3000\nG1 Y100\n");
    assert!((found - exact).abs() < 1e-12, "{found} {exact}");
    // a dwell keeps its duration, and the command after it shifts with it
    let path = parsed("G1 X100 F3000\nG4 S3\nM104 S200\nG1 Y100\n").with_acceleration(0.5, 0.008).unwrap();
    assert!((path.duration() - exact - 3.0).abs() < 1e-12);
    assert!((path.commands[0].time - path.moves[1].start).abs() < 1e-12);
    assert!(parsed("G1 X1 F60\n").with_acceleration(0.0, 1.0).is_err());
}

/// Bead widths follow from filament; cube.gcode of the formulation: the first bead is 0.449985 mm wide.
#[test]
fn beads_come_from_filament() {
    let path = parsed("M83\nG1 F600 Z0.25\nG1 X10 E0.4\nG1 Z0.5\nG1 X0 E0.4\nM106 S127.5\nG1 E-1\n");
    let area = 0.4 * std::f64::consts::PI * 1.75f64.powi(2) / 4.0 / 10.0;
    let printed: Vec<&Move> = path.printing_moves().collect();
    assert!((1e6 * printed[0].area(1.75e-3) - area).abs() < 1e-12);
    assert!((path.fed() - 0.8e-3).abs() < 1e-15);
    let levels = path.levels();
    assert!(levels.len() == 2 && (levels[1] - 5e-4).abs() < 1e-15);
    assert!(path.heights(1.75e-3, None).iter().all(|height| (height - 2.5e-4).abs() < 1e-15));
    let width = stadium_width(1e-6 * area, 2.5e-4);
    // the area is recovered: rectangle and circle
    let (h, w) = (2.5e-4, width);
    assert!((h * (w - h) + 0.25 * std::f64::consts::PI * h * h - 1e-6 * area).abs() < 1e-18);
    assert_eq!(path.setting(Setting::Fan), [(path.moves[3].end, 0.5)]);
    let bed =
        parsed("M140 S60\nM190 S60\nG1 X10 F600\nM140 S55\nM140 S50\nG1 X0\nM140 S0\n").setting(Setting::Bed);
    assert_eq!(bed[..2], [(0.0, 333.15), (1.0, 323.15)]);
    assert!(bed.len() == 3 && bed[2].0 == 2.0 && bed[2].1.is_nan());
    // feeding takes time without a move: 1 mm at 10 mm/s
    assert!((path.rest - 0.1).abs() < 1e-12);
}

/// Slicer files agree with an own reader in Python: filament of printing
/// moves, time at F with dwells, and with 500 mm/s² and a jerk of 8 mm/s.
#[test]
fn files_of_slicers() {
    // Zugstab_small.gcode is a file of PeriLab (BSD-3-Clause, see its head); the others are not ours to copy
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    let other = std::env::var_os("CRYSTFEM_GCODE").map_or_else(|| own.clone(), std::path::PathBuf::from);
    for (file, folder, fed, even, limited, wait, bed) in [
        ("Zugstab_small.gcode", &own, 320.1546, 443.32, 457.45, 0.0, 85.0),
        ("20x20x20_1wall_1bottom.gcode", &other, 736.5961, 965.29, 1010.68, 10.0, 60.0),
        ("GuideCurve.gcode", &other, 46.79, 94.50, 95.12, 5.0, 230.0),
    ] {
        let path = folder.join(file);
        if !path.exists() {
            evidence::skipped(&format!("{file} (CRYSTFEM_GCODE names its folder)"));
            continue;
        }
        let path = read_gcode(&path).unwrap();
        assert!((1e3 * path.fed() - fed).abs() < 5e-5, "{file}: {}", path.fed());
        assert!((path.duration() - wait - even).abs() < 5.1e-3, "{file}: {}", path.duration());
        let planned = path.clone().with_acceleration(0.5, 8e-3).unwrap();
        assert!((planned.duration() - wait - limited).abs() < 5.1e-3, "{file}: {}", planned.duration());
        assert!((path.setting(Setting::Bed)[0].1 - 273.15 - bed).abs() < 1e-9, "{file}");
    }
}
