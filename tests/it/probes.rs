//! Tables along lines and of sections: exact values, empty cells outside of the body, forces that equal the
//! grips'.

use crate::parts::BAR;
use crate::program::{command, finish, peri};
use crate::results::{assert_same, report, scalar};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// A strip of 40 × 10 mm that is pulled in two steps, with sections straight and oblique.
const STRIP: &str = r#"version = 1
program = "peri"

[body]
space = "plane-stress"
thickness = "2 mm"
spacing = "1 mm"
shapes = [{ add = "box", min = ["0 mm", "0 mm"], max = ["40 mm", "10 mm"] }]

[material]
youngs_modulus = "1 MPa"
law = "chain-offset"
links = 100
dissociation = 1200
critical = { stretch = 3 }

[[boundary]]
name = "left"
side = "x-"
displacement = ["0 mm", "0 mm"]

[[boundary]]
name = "right"
side = "x+"
displacement = ["8 mm", "0 mm"]

[solver]
steps = 2
tolerance = 1e-8

[stress]
measures = ["hardy"]

[[probe]]
name = "gauge"
track = "displacement"
axis = "x"
side = "x+"

[output]
pictures = false
fields = false
line = [
  { name = "axis", from = ["-1 mm", "4.5 mm"], to = ["41 mm", "4.5 mm"], points = 43 },
  { name = "stress", from = ["20 mm", "0 mm"], to = ["20 mm", "10 mm"],
    fields = ["cauchy_hardy_11", "damage", "displacement"] },
]
section = [
  { name = "middle", point = ["20 mm", "5 mm"], normal = [1, 0] },
  { name = "on-particles", point = ["12.5 mm", "5 mm"], normal = [2, 0] },
  { name = "oblique", point = ["25 mm", "5 mm"], normal = [1, 0.5] },
  { name = "turned", point = ["20 mm", "5 mm"], normal = [-1, 0] },
]
"#;

/// Reads a table by its headings; an empty cell is `None`.
fn table(path: &Path) -> BTreeMap<String, Vec<Option<f64>>> {
    let text = fs::read_to_string(path).unwrap();
    assert!(!text.contains("NaN"), "{text}");
    let mut lines = text.lines();
    let headings: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut table: BTreeMap<String, Vec<Option<f64>>> = BTreeMap::new();
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), headings.len(), "{line}");
        for (heading, cell) in headings.iter().zip(cells) {
            let value = (!cell.is_empty()).then(|| cell.parse().unwrap());
            table.entry((*heading).to_owned()).or_default().push(value);
        }
    }
    table
}

#[test]
fn sections_carry_the_reaction() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("strip.toml"), STRIP).unwrap();
    for threads in 1..=2 {
        peri(&format!("run strip.toml --output out{threads} --threads {threads}"), here).with_code(0);
    }
    let out = here.join("out1");
    assert_same(&out, &here.join("out2"));
    let report = report(&out);
    let reaction = scalar(&report, "reaction_x");
    assert!(reaction > 1.0, "{reaction}");
    // forces out of balance are 1e-8 of the reactions in their root mean square; 340 particles are free
    let within = 1e-7 * reaction;
    let arm = 10e-3;
    let middle = |what: &str| scalar(&report, &format!("middle_{what}"));
    let (across, moment) = (middle("force_y"), middle("moment_z"));
    // the strip and its loads are symmetric about y = 5 mm
    assert!(across.abs() < 1e-5 * reaction && moment.abs() < 1e-5 * reaction * arm, "{across} {moment}");
    for (name, sign) in [("middle", 1.0), ("on-particles", 1.0), ("oblique", 1.0), ("turned", -1.0)] {
        let of = |what: &str| sign * scalar(&report, &format!("{name}_{what}"));
        assert!((of("force_x") - reaction).abs() < within, "{name}: {} of {reaction}", of("force_x"));
        let off = [of("force_y") - across, (of("moment_z") - moment) / arm];
        assert!(off.iter().all(|off| off.abs() < within), "{name}: {off:?}");
        let rows = table(&out.join(format!("section_{name}_dx-1mm_m-3.015.csv")));
        let (load, force) = (&rows["load [N]"], &rows["force_x [N]"]);
        assert_eq!(load.len(), 2);
        for (load, force) in load.iter().zip(force) {
            assert!((load.unwrap() - sign * force.unwrap()).abs() < within, "{load:?} {force:?}");
        }
        assert!(rows.contains_key("displacement [m]") && rows.contains_key("moment_z [N m]"));
    }
}

#[test]
fn lines_of_a_strip() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("strip.toml"), STRIP).unwrap();
    peri("run strip.toml --output out", here).with_code(0);
    let rows = table(&here.join("out/line_axis_dx-1mm_m-3.015.csv"));
    let (arc, x, u) = (&rows["arc_length [m]"], &rows["x [m]"], &rows["displacement_x [m]"]);
    assert_eq!(arc.len(), 43);
    for k in 0..43 {
        let at = x[k].unwrap();
        assert!(
            (at - (k as f64 - 1.0) * 1e-3).abs() < 1e-15 && (arc[k].unwrap() - k as f64 * 1e-3).abs() < 1e-15
        );
        // outside of the body there is no value
        assert_eq!(u[k].is_none(), !(1..=41).contains(&k), "{at}");
    }
    // both faces move with their grips, and everything between follows
    assert!(u[1].unwrap().abs() < 1e-15 && (u[41].unwrap() - 8e-3).abs() < 1e-15, "{u:?}");
    assert!(u[1..=41].windows(2).all(|pair| pair[0].unwrap() < pair[1].unwrap() + 1e-6), "{u:?}");
    assert_eq!(rows["damage"][5], Some(0.0));
    assert!(rows.contains_key("cauchy_hardy_12 [Pa]") && !rows.keys().any(|name| name.starts_with("piola")));
    let rows = table(&here.join("out/line_stress_dx-1mm_m-3.015.csv"));
    let names: Vec<&str> = rows.keys().map(String::as_str).collect();
    let expected = [
        "arc_length [m]",
        "cauchy_hardy_11 [Pa]",
        "damage",
        "displacement_x [m]",
        "displacement_y [m]",
        "x [m]",
        "y [m]",
    ];
    assert_eq!(names, expected);
    assert_eq!(rows["y [m]"].len(), 101);
}

#[test]
fn lines_of_a_part() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let line = "[[output.line]]\nname = \"up\"\nfrom = [\"0 mm\", \"0 mm\", \"-2.25 mm\"]\nto = [\"0 mm\", \
                \"0 mm\", \"1.75 mm\"]\npoints = 17\n";
    // the third layer is never printed before the end
    let bar = BAR.replace("end = \"120 s\"", "end = \"25 s\"") + line;
    fs::write(here.join("bar.toml"), &bar).unwrap();
    let crystfem = |arguments: &str| finish(command("crystfem", arguments, here).spawn().unwrap());
    crystfem("run bar.toml --output out").with_code(0);
    let report = report(&here.join("out"));
    let rows = table(&here.join("out/line_up.csv"));
    let (z, temperature, alpha) = (&rows["z [m]"], &rows["temperature [degC]"], &rows["alpha"]);
    for k in 0..17 {
        let height = z[k].unwrap();
        assert!((height - (k as f64 * 0.25e-3 - 2.25e-3)).abs() < 1e-15);
        assert_eq!(temperature[k].is_some(), (1..=15).contains(&k), "{height}");
        // glass has none
        assert_eq!(alpha[k].is_some(), (9..=15).contains(&k), "{height}");
    }
    // the probe at z = 0.75 mm
    for (column, name) in [(temperature, "middle.temperature"), (alpha, "middle.alpha")] {
        assert!((column[12].unwrap() - scalar(&report, name)).abs() < 1e-12, "{name}");
    }
}
