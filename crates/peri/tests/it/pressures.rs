//! Pressures of rigid surfaces on bodies: Hertz's profiles, a squeezed block, resultants, friction.

use evidence::{at_most, near};
use harness::output::{csv, vtkhdf};
use peri::program::run::FinishedScene;
use std::collections::HashMap;
use std::f64::consts::PI;
use std::path::Path;

/// K/μ = 5/3, so ν = 1/4 and E/(1 − ν²) = 8μ/3.
const SOFT: &str = "[material.solid]\nlaw = \"correspondence\"\nconstitutive = { model = \"neo-hookean\", \
                    parameters = { shear_modulus = \"1 MPa\" }, bulk_modulus = \"1.6666667 MPa\" }\n";
const MODULUS: f64 = 8e6 / 3.0;
/// The middle column of a block stays there.
const HELD: &str = "[[boundary]]\nmin = [\"-0.6 mm\", \"-1 mm\"]\nmax = [\"0.6 mm\", \"13 mm\"]\n\
                    displacement = [\"0 mm\", \"free\"]\n";

fn solve(text: &str, output: &Path) -> FinishedScene {
    crate::answers::solve(&format!("version = 1\nprogram = \"peri\"\n{text}"), output)
}

/// Columns of a table by name, without units.
fn table(path: &Path) -> HashMap<String, Vec<f64>> {
    let columns = csv::read(path).unwrap().into_iter();
    columns.map(|(name, values)| (name.split(' ').next().unwrap().to_owned(), values)).collect()
}

/// Distances from the middle and pressures below a cylinder of R = 80 mm that 400 N/m press on a half-space.
fn below_a_roller(spacing: &str, output: &Path) -> [Vec<f64>; 2] {
    let text = format!(
        r#"
[body]
space = "plane-strain"
thickness = "1 mm"
spacing = "{spacing}"
shapes = [{{ add = "box", min = ["-30 mm", "0 mm"], max = ["30 mm", "30 mm"] }}]
{SOFT}
[[boundary]]
min = ["-1.1 mm", "0 mm"]
max = ["1.1 mm", "1.2 mm"]
displacement = ["0 mm", "free"]
[contact]
stiffness = 0
[[contact.plane]]
name = "base"
point = ["0 mm", "0 mm"]
normal = [0, 1]
stiffness = 10
[[contact.indenter]]
name = "roller"
point = ["0 mm", "111 mm"]
radius = "80 mm"
force = ["0 N", "-0.4 N"]
[solver]
steps = 2
tolerance = 1e-4
[output]
contact = true
"#
    );
    let finished = solve(&text, output);
    let variant = format!("dx-{}_m-3.015", spacing.replace(' ', ""));
    let rows = table(&output.join(format!("contact_roller_{variant}.csv")));
    let sum: f64 = rows["pressure"].iter().zip(&rows["area"]).map(|(p, a)| p * a).sum();
    // the normals of the cylinder turn by a/R
    near(&format!("roller_resultant_{variant}"), sum, 0.4, 0.4 * 0.5 * (4.5f64 / 80.0).powi(2));
    let greatest = rows["pressure"].iter().copied().fold(0.0, f64::max);
    assert_eq!(finished.report.scalar("roller_pressure"), Some(greatest));
    assert!(output.join(format!("contact_{variant}.png")).is_file());
    // the field of the particles below: of one face each
    let frames = vtkhdf::read(output.join(format!("{variant}.vtkhdf"))).unwrap();
    let field = frames.data(frames.len() - 1, "contact_pressure").unwrap();
    let of_roller = field.iter().zip(frames.points(frames.len() - 1).unwrap()).filter(|(_, x)| x[1] > 0.015);
    let of_roller = of_roller.map(|(p, _)| *p).fold(0.0, f64::max);
    assert!((of_roller / greatest - 1.0).abs() < 1e-6, "{of_roller} {greatest}");
    [rows["along"].clone(), rows["pressure"].clone()]
}

/// Hertz's line contact (Johnson, Contact Mechanics (1985), §4.2): p = p₀√(1 − x²/a²), a² = 4FR/(πE*),
/// p₀ = 2F/(πa). The block adds (a/h)² = 2 %, to the greatest pressure at 8 spacings in a; with half as many
/// the bar is twice that. At the rim the two outer faces may be off by half their pressure, √(Δx/a)/2.
#[test]
fn pressures_below_a_cylinder_are_those_of_hertz() {
    let a = (4.0 * 400.0 * 0.08 / (PI * MODULUS)).sqrt();
    let most = 2.0 * 400.0 / (PI * a);
    for (spacing, peak, error) in [("1 mm", 0.04, 0.08), ("0.5 mm", 0.02, 0.05)] {
        let directory = tempfile::tempdir().unwrap();
        let [along, pressures] = below_a_roller(spacing, directory.path());
        let greatest = pressures.iter().copied().fold(0.0, f64::max);
        let name = |what: &str| format!("hertz_{what}_{}", spacing.replace(' ', ""));
        near(&name("peak"), greatest / most, 1.0, peak);
        let hertz = |x: f64| (1.0 - (x / a).powi(2)).max(0.0).sqrt();
        let off = |(x, p): (&f64, &f64)| (p / most - hertz(*x)).powi(2);
        let square = along.iter().zip(&pressures).map(off).sum::<f64>() / along.len() as f64;
        at_most(&name("rms"), square.sqrt(), error);
    }
}

/// A block of 25 × 12 particles between planes, with keys of the planes and of the upper one.
fn squeezed(planes: &str, upper: &str) -> String {
    format!(
        r#"
[body]
space = "plane-strain"
thickness = "2 mm"
spacing = "1 mm"
shapes = [{{ add = "box", min = ["-12.5 mm", "0 mm"], max = ["12.5 mm", "12 mm"] }}]
{SOFT}
[contact]
stiffness = 0
[[contact.plane]]
name = "lower"
point = ["0 mm", "0 mm"]
normal = [0, 1]
stiffness = 100
{planes}
[[contact.plane]]
name = "upper"
point = ["0 mm", "12 mm"]
normal = [0, -1]
stiffness = 100
{planes}
{upper}
[solver]
method = "lbfgs"
steps = 8
tolerance = 1e-6
[output]
contact = true
"#
    )
}

/// Between smooth planes a block bears the same pressure everywhere: its force over its present width.
#[test]
fn pressures_of_a_squeezed_block_are_those_of_its_present_width() {
    let directory = tempfile::tempdir().unwrap();
    let upper = "displacement = [\"0 mm\", \"-3.6 mm\"]";
    let finished = solve(&(squeezed("", upper) + HELD), directory.path());
    let rows = table(&directory.path().join("contact_upper_dx-1mm_m-3.015.csv"));
    let force = -finished.report.scalar("upper_force_y").unwrap();
    assert_eq!(rows["x"].len(), 25);
    let ends = [f64::min, f64::max].map(|pick| rows["x"].iter().copied().fold(0.0, pick));
    let width = (ends[1] - ends[0]) * 25.0 / 24.0;
    // 30 % of squeeze widen it by a tenth
    assert!(width > 0.027, "{width}");
    // forces balance to 1e-6
    let area: f64 = rows["area"].iter().sum();
    near("squeezed_area", area / (width * 2e-3), 1.0, 1e-5);
    for pressure in &rows["pressure"] {
        near("squeezed_pressure", pressure * width * 2e-3 / force, 1.0, 1e-5);
    }
}

/// Pressures and shears add up to the force of the plane, whether it slides, sticks or is bonded; shears stay
/// within friction.
#[test]
fn tractions_add_up_to_the_force_of_the_plane() {
    let upper = "displacement = [\"1.5 mm\", \"-1 mm\"]";
    for (planes, friction) in [("friction = 0.3", Some(0.3)), ("bonded = true", None)] {
        let directory = tempfile::tempdir().unwrap();
        let pulled = "[[boundary]]\nside = \"x+\"\ntraction = [\"1 kPa\", \"0 Pa\"]\n";
        let held = if friction.is_some() { HELD } else { pulled };
        // sums hold at any residual
        let text =
            squeezed(planes, upper).replace("steps = 8\ntolerance = 1e-6", "steps = 2\ntolerance = 1e-3");
        let finished = solve(&(text + held), directory.path());
        for (plane, up) in [("lower", 1.0), ("upper", -1.0)] {
            let rows = table(&directory.path().join(format!("contact_{plane}_dx-1mm_m-3.015.csv")));
            let sum = |column: &str| rows[column].iter().zip(&rows["area"]).map(|(t, a)| t * a).sum::<f64>();
            let force = |axis: &str| finished.report.scalar(&format!("{plane}_force_{axis}")).unwrap();
            let size = force("y").abs();
            // sums of 25 numbers in another order
            assert!((up * sum("pressure") + sum("shear_y") - force("y")).abs() < 1e-12 * size);
            assert!((sum("shear_x") - force("x")).abs() < 1e-12 * size, "{} {}", sum("shear_x"), force("x"));
            let rubs = rows["shear_x"].iter().zip(&rows["area"]).map(|(t, a)| (t * a).abs()).sum::<f64>();
            assert!(rubs > 0.05 * size, "{plane}: no shear");
            for (shear, pressure) in rows["shear_x"].iter().zip(&rows["pressure"]) {
                // friction follows normal forces to 1e-3 of their sum over 25 faces
                assert!(friction.is_none_or(|mu| shear.abs() <= mu * pressure * (1.0 + 0.025)));
            }
        }
    }
}

/// Two blocks, the upper one `width` mm wide, that are 20 mm high and pressed on each other by 0.2 mm.
fn blocks_in_contact(width: f64, rest: &str) -> String {
    let half = 0.5 * width;
    format!(
        r#"
[body]
space = "plane-strain"
thickness = "1 mm"
spacing = "0.5 mm"
shapes = [
  {{ add = "box", min = ["-10 mm", "-10 mm"], max = ["10 mm", "0 mm"], part = "lower" }},
  {{ add = "box", min = ["-{half} mm", "0 mm"], max = ["{half} mm", "10 mm"], part = "upper" }},
]
{SOFT}
[[interface]]
between = ["lower", "upper"]
unbonded = true
{rest}
[solver]
steps = 1
tolerance = 1e-5
[output]
contact = true
"#
    )
}

/// Blocks between smooth planes have the pressure of the load but for a horizon at their corners; those with
/// rough faces between held ends have its sum on both sides, and at most μp of shear.
#[test]
fn pressures_between_blocks_are_those_of_the_load() {
    let pressed = |width: f64, rest: &str| {
        let directory = tempfile::tempdir().unwrap();
        let finished = solve(&blocks_in_contact(width, rest), directory.path());
        let rows = table(&directory.path().join("contact_particles_dx-0.5mm_m-3.015.csv"));
        let greatest = rows["pressure"].iter().copied().fold(0.0, f64::max);
        assert_eq!(finished.report.scalar("contact_pressure"), Some(greatest));
        assert!(directory.path().join("contact_dx-0.5mm_m-3.015.png").is_file());
        (finished.outcomes[0].history.last().unwrap().load.abs(), rows)
    };
    let smooth = "[[boundary]]\nside = \"y-\"\ndisplacement = [\"free\", \"0 mm\"]\n\
                  [[boundary]]\nside = \"y+\"\ndisplacement = [\"free\", \"-0.2 mm\"]\n\
                  [[boundary]]\nmin = [\"-0.6 mm\", \"-10 mm\"]\nmax = [\"0.6 mm\", \"10 mm\"]\n\
                  displacement = [\"0 mm\", \"free\"]\n[contact]\n";
    let (load, rows) = pressed(20.0, smooth);
    for (pressure, x) in rows["pressure"].iter().zip(&rows["x"]) {
        let error = if x.abs() < 8e-3 { 0.02 } else { 0.25 };
        near("even_pressure", pressure * 2e-5 / load, 1.0, error);
    }
    let rough = "[[boundary]]\nside = \"y-\"\ndisplacement = [\"0 mm\", \"0 mm\"]\n\
                 [[boundary]]\nside = \"y+\"\ndisplacement = [\"0 mm\", \"-0.2 mm\"]\n\
                 [contact]\nfriction = 0.3\n";
    let (load, rows) = pressed(10.0, rough);
    let middle = rows["y"].iter().sum::<f64>() / rows["y"].len() as f64;
    for upper in [false, true] {
        let each = rows["pressure"].iter().zip(&rows["area"]).zip(&rows["y"]);
        let side = each.filter(|(_, y)| (**y > middle) == upper);
        // normals tilt, and friction has a part along them
        near("resultant", side.map(|((p, a), _)| p * a).sum::<f64>() / load, 1.0, 5e-3);
    }
    let shear = rows["shear_x"].iter().zip(&rows["pressure"]).map(|(s, p)| s.abs() / p).fold(0.0, f64::max);
    assert!(shear > 0.01, "{shear}");
    at_most("coulomb", shear, 0.3 + 1e-6);
}

/// Reactions of a square of 20 mm of a mesh, turned by an angle in degrees, whose side `right` is held and on
/// whose side `left` a pressure of 1 kPa acts, in a thickness of 1 mm.
fn reaction_of_a_turned_square(angle: f64, spacing: &str, output: &Path) -> [f64; 2] {
    let (sine, cosine) = angle.to_radians().sin_cos();
    let corner = |[x, y]: [f64; 2]| format!("{} {} 0", cosine * x - sine * y, sine * x + cosine * y);
    let corners = [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]].map(corner);
    let nodes: String = corners.iter().zip(1..).map(|(corner, k)| format!("{k} {corner}\n")).collect();
    let mesh = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n1 1 \"left\"\n1 2 \"right\"\n2 3 \"all\"\n\
         $EndPhysicalNames\n$Nodes\n4\n{nodes}$EndNodes\n$Elements\n3\n1 3 2 3 3 1 2 3 4\n2 1 2 1 1 4 1\n\
         3 1 2 2 2 2 3\n$EndElements\n"
    );
    let file = output.join("turned.msh");
    std::fs::create_dir_all(output).unwrap();
    std::fs::write(&file, mesh).unwrap();
    let text = format!(
        r#"
[body]
space = "plane-strain"
thickness = "1 mm"
spacing = "{spacing}"
shapes = [{{ add = "mesh", file = '{}', unit = "1 mm" }}]
{SOFT}
[[boundary]]
name = "right"
set = "right"
displacement = ["0 mm", "0 mm"]
[[boundary]]
set = "left"
pressure = "1 kPa"
[output]
pictures = false
fields = false
"#,
        file.display()
    );
    let report = solve(&text, &output.join("run")).report;
    ["reaction_x", "reaction_y"].map(|name| report.scalar(name).unwrap())
}

/// A pressure on a set of a mesh acts on the faces of the particles behind it: its resultant is that of the
/// side; along a staircase but for faces at its two ends, of up to a spacing each.
#[test]
fn pressure_on_a_set_of_a_mesh() {
    let folder = tempfile::tempdir().unwrap();
    for (angle, spacing, name, share) in [
        (0.0, "1 mm", "upright", 5e-4),
        (20.0, "1 mm", "turned_1mm", 0.1),
        (20.0, "0.5 mm", "turned_0.5mm", 0.05),
    ] {
        let (sine, cosine) = f64::to_radians(angle).sin_cos();
        let [x, y] = reaction_of_a_turned_square(angle, spacing, &folder.path().join(name));
        let (along, across) = (cosine * x + sine * y, cosine * y - sine * x);
        near(&format!("pressure_on_a_set_{name}"), along, 0.02, share * 0.02);
        near(&format!("pressure_along_a_set_{name}"), across, 0.0, share * 0.02);
    }
}
