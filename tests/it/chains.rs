//! Scenes that read results of other scenes: missing or stale results are reported and computed, changed
//! files are noticed.

use crate::program::{Ended, command, finish, peri};
use crate::results::{assert_same, report, scalar};
use evidence::near;
use harness::output::vtkhdf::{Cells, MeshSeries, ParticleSeries, read};
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// A block that cools from one side: crystallinity between 0 and 0.25.
const PRINT: &str = r#"version = 1
program = "crystfem"

[mesh.brick]
size = ["8 mm", "4 mm", "1 mm"]
elements = [8, 2, 1]

[materials.pa12]
law = "semicrystalline"
density = "1010 kg/m^3"
conductivity = "0.25 W/(m K)"
specific_heat = "2200 J/(kg K)"
kinetics = "table-4.1-column-1"
melting = "pa12"
crystallinity = 0.25

[[region]]
elements = "brick"
material = "pa12"
temperature = "180 degC"

[[boundary]]
surface = "left"
film = "20 W/(m^2 K)"
ambient = "25 degC"

[time]
end = "300 s"
tolerance = "0.5 K"

[output]
every = "100 s"
pictures = false
"#;

/// A strip whose stiffness follows the crystallinity.
const STRIP: &str = r#"version = 1
program = "peri"

[inputs]
print = "../print/case.toml"

[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "0.5 mm"
shapes = [{ add = "box", min = ["0 mm", "0 mm"], max = ["8 mm", "4 mm"] }]

[material]
youngs_modulus = "1.6 GPa"
law = "linear"

[[material.fields]]
of = "youngs-modulus"
from = { input = "print", field = "crystallinity" }
table = [[0, "0.9 GPa"], [0.25, "1.6 GPa"]]

[[boundary]]
side = "x-"
displacement = ["0 mm", "0 mm"]

[[boundary]]
side = "x+"
displacement = ["0.01 mm", "0 mm"]

[output]
fields = false
pictures = false
"#;

/// Writes scenes `NAME/case.toml`.
fn write(here: &Path, scenes: &[(&str, &str)]) {
    for (name, text) in scenes {
        fs::create_dir_all(here.join(name)).unwrap();
        fs::write(here.join(name).join("case.toml"), text).unwrap();
    }
}

fn crystfem(arguments: &str, here: &Path) -> Ended {
    finish(command("crystfem", arguments, here).spawn().unwrap())
}

fn strip(here: &Path, options: &str) -> Ended {
    peri(&format!("run strip/case.toml {options}"), here)
}

#[test]
fn what_is_missing_or_stale_is_computed_first() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    write(here, &[("print", PRINT), ("strip", STRIP)]);
    let missing = strip(here, "").with_code(2);
    missing.tells("`inputs.print`: its results in out/print are missing");
    missing.tells("`crystfem run strip/../print/case.toml --output out/print --with-inputs` computes them");
    assert!(!here.join("out").exists(), "something was written");
    // a quick run makes quick results
    strip(here, "--quick --with-inputs").with_code(0).shows("input `print` is missing");
    strip(here, "--quick").with_code(0);
    strip(here, "").with_code(2).tells("are stale: of a run with --quick");
    strip(here, "--with-inputs").with_code(0).shows("input `print` is stale");
    let again = strip(here, "--with-inputs --explain").with_code(0);
    assert!(!again.stdout.contains("input `print` is"), "{}", again.stdout);
    again.shows("results in out/print: current");
    again.shows("follows    youngs-modulus");
    peri("check strip/case.toml", here).with_code(0).shows("results in out/print: current");
    // another place
    fs::create_dir(here.join("elsewhere")).unwrap();
    fs::rename(here.join("out/print"), here.join("elsewhere/print")).unwrap();
    strip(here, "").with_code(2).tells("are missing");
    strip(here, "--input print=elsewhere/print").with_code(0);
    strip(here, "--input prnt=elsewhere/print").with_code(2).tells("did you mean `print`?");
    strip(here, "--input print").with_code(2).tells("allowed: NAME=FOLDER");
    // another scene
    write(here, &[("print", &PRINT.replace("300 s", "310 s"))]);
    strip(here, "--input print=elsewhere/print").with_code(2).tells("are stale: its scene has changed");
    strip(here, "--input print=elsewhere/print --with-inputs").with_code(0);
    strip(here, "--input print=elsewhere/print").with_code(0);
    // a sweep needs the results, too
    let vary = "sweep strip/case.toml --vary material.youngs_modulus=1GPa,2GPa";
    peri(vary, here).with_code(2).tells("are missing");
    peri(&format!("{vary} --input print=elsewhere/print"), here).with_code(0);
}

/// A table that an input reads, and an input of an input.
#[test]
fn staleness_is_handed_on() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let over = PRINT.replace("ambient = \"25 degC\"", "ambient = { file = \"air.csv\" }");
    let after = STRIP.replace("[inputs]\n", "[inputs]\nstrip = \"../strip/case.toml\"\n");
    write(here, &[("print", &over), ("strip", STRIP), ("after", &after)]);
    fs::write(here.join("print/air.csv"), "time [s],value [degC]\n0,25\n300,30\n").unwrap();
    let run = |options: &str| peri(&format!("run after/case.toml {options}"), here);
    let both = run("").with_code(2);
    both.tells("its results in out/print are missing");
    both.tells("input `strip`: its results in out/strip are missing");
    run("--with-inputs").with_code(0);
    run("").with_code(0);
    fs::write(here.join("print/air.csv"), "time [s],value [degC]\n0,25\n300,31\n").unwrap();
    let stale = run("").with_code(2);
    stale.tells("are stale: the file air.csv has changed");
    stale.tells("its input `print` is stale: the file air.csv has changed");
    run("--with-inputs").with_code(0);
    run("").with_code(0);
    // computed separately, with other results: what was read from it is stale
    fs::write(here.join("print/air.csv"), "time [s],value [degC]\n0,25\n300,32\n").unwrap();
    crystfem("run print/case.toml", here).with_code(0);
    let stale = run("").with_code(2);
    stale.tells("`inputs.strip`: its results in out/strip are stale");
    stale.tells("fields.vtkhdf has changed");
}

#[test]
fn chains_that_cannot_be() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let back = format!("{PRINT}\n[inputs]\nstrip = \"../strip/case.toml\"\n");
    write(here, &[("print", &back), ("strip", STRIP)]);
    for verb in ["run strip/case.toml --with-inputs", "check strip/case.toml"] {
        let ended = peri(verb, here).with_code(2);
        ended.tells("a cycle: strip/case.toml → print/case.toml → strip/case.toml");
    }
    assert!(!here.join("out").exists(), "something was written");
    write(here, &[("print", &PRINT.replace("\"crystfem\"", "\"sh\""))]);
    strip(here, "--with-inputs").with_code(2).tells("program `sh`");
    // one that fails
    write(here, &[("print", &PRINT.replace("\"300 s\"", "\"-1 s\""))]);
    let failed = strip(here, "--with-inputs").with_code(2);
    failed.tells("time.end");
    failed.tells("its results in out/print are missing");
}

/// Faults in the fields are reported with the key that names them.
#[test]
fn fields_that_cannot_be_used() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    write(here, &[("print", PRINT), ("strip", STRIP)]);
    strip(here, "--with-inputs").with_code(0);
    let path = here.join("out/print/fields.vtkhdf");
    let whole = fs::read(&path).unwrap();
    let refused = |told: &str| {
        let ended = strip(here, "").with_code(2);
        ended.tells("`material.fields[0].");
        ended.tells(told);
    };
    let (points, cells, values) = {
        let series = read(&path).unwrap();
        (series.points(0).unwrap(), series.cells().unwrap(), series.data(0, "crystallinity").unwrap())
    };
    let replaced = |points: &[[f64; 3]], cells: &Cells, name: &str, values: &[f64]| {
        let mut series = MeshSeries::create(&path, points.to_vec(), cells.clone()).unwrap();
        series.step(0.0, &[(name, 1, values)], &[]).unwrap();
        series.finish().unwrap();
    };
    let mut holed = values.clone();
    holed[4] = f64::NAN;
    replaced(&points, &cells, "crystallinity", &holed);
    refused("`crystallinity` is NaN at [4.0, 0.0, 0.0] mm of the mesh");
    replaced(&points, &cells, "crystallinity_degC", &values);
    refused("a temperature, such as \"160 degC\": the field is `crystallinity_degC`");
    replaced(&points, &cells, "chi", &values);
    refused("found `crystallinity`; allowed: `chi`");
    replaced(&points, &cells, "crystallinity", &vec![0.3; values.len()]);
    refused("values of the table, 0 to 0.25");
    let far: Vec<[f64; 3]> = points.iter().map(|&[x, y, z]| [x + 1.0, y, z]).collect();
    replaced(&far, &cells, "crystallinity", &values);
    refused("lies outside of the mesh of `print`; is it another mesh?");
    let mut tetrahedra = Cells::default();
    tetrahedra.push(10, &[0, 1, 9, 27]);
    replaced(&points, &tetrahedra, "crystallinity", &values);
    refused("cells of VTK's type 10");
    fs::remove_file(&path).unwrap();
    refused("fields.vtkhdf");
    let mut particles = ParticleSeries::create(&path).unwrap();
    particles.step(0.0, &points, &[("crystallinity", 1, &values)]).unwrap();
    particles.finish().unwrap();
    refused("particles and no cells");
    fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    refused("not a valid VTKHDF file");
    fs::write(&path, &whole).unwrap();
    strip(here, "").with_code(0);
    let at = |key: &str, value: &str| {
        write(
            here,
            &[(
                "strip",
                &STRIP.replace(
                    "field = \"crystallinity\"",
                    &format!("field = \"crystallinity\", {key} = {value}"),
                ),
            )],
        );
    };
    at("time", "\"100 s\"");
    strip(here, "").with_code(0);
    at("time", "\"110 s\"");
    refused("one of 4 times, the nearest 100 s");
    at("file", "\"none.vtkhdf\"");
    refused("none.vtkhdf");
}

/// The stress of a print, 1 MPa along its second axis, acts in a strip that is held at its ends: it pulls
/// them with stress × section.
#[test]
fn a_stress_is_handed_over() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    write(here, &[("print", PRINT), ("strip", STRIP)]);
    strip(here, "--with-inputs").with_code(0);
    let path = here.join("out/print/fields.vtkhdf");
    let (points, cells) = {
        let series = read(&path).unwrap();
        (series.points(0).unwrap(), series.cells().unwrap())
    };
    let stressed = |stress: f64| {
        let tensors: Vec<f64> = (0..cells.len()).flat_map(|_| [0.0, stress, 0.0, 0.0, 0.0, 0.0]).collect();
        let mut series = MeshSeries::create(&path, points.clone(), cells.clone()).unwrap();
        series.step(0.0, &[], &[("residual_stress_kPa", 6, &tensors)]).unwrap();
        series.finish().unwrap();
    };
    stressed(1e3);
    let held = STRIP
        .replace("of = \"youngs-modulus\"", "of = \"prestrain\"")
        .replace("\"crystallinity\"", "\"residual_stress\"")
        .replace("displacement = [\"0 mm\", \"0 mm\"]", "displacement = [\"0 mm\", \"free\"]")
        .replace("[\"0.01 mm\", \"0 mm\"]", "[\"0 mm\", \"free\"]")
        .replace("max = [\"8 mm\", \"4 mm\"]", "max = [\"4 mm\", \"2 mm\"]");
    write(here, &[("strip", &held)]);
    let ended = strip(here, "").with_code(2);
    ended.tells("unexpected `material.fields[0].table`: the strain of a stress tensor");
    let table = "table = [[0, \"0.9 GPa\"], [0.25, \"1.6 GPa\"]]";
    let turned = held
        .replace(table, "placement = { axes = [\"-y\", \"x\"], origin = [\"0 mm\", \"4 mm\", \"0 mm\"] }");
    write(here, &[("strip", &turned)]);
    strip(here, "").with_code(0);
    let report = report(&here.join("out/strip"));
    let force = scalar(&report, "reaction_x");
    near(
        "force of a strip that is held with a residual stress, over stress × section",
        0.5 * force,
        1.0,
        0.15,
    );
    let mean = scalar(&report, "prestrain_field_mean");
    near("mean stress handed over", mean, 1e6 / 3.0, 1e-3);
    // in GPa by mistake
    stressed(1e9);
    strip(here, "").with_code(2).tells("a prestrain of -");
    write(here, &[("strip", &STRIP.replace("\"crystallinity\"", "\"residual_stress\""))]);
    strip(here, "").with_code(2).tells("`material.fields[0].from.field`");
}

/// A law learnt by another scene: neo-Hookean stresses S = μ(1 − C⁻¹) + ½λ(J² − 1)C⁻¹ with μ = 0.4 and λ = 1
/// MPa; the sheet has about that force.
#[test]
fn a_law_of_an_input() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let mut rows =
        "run_id,C11,C22,C33,C12,C13,C23,S11 [MPa],S22 [MPa],S33 [MPa],S12 [MPa],S13 [MPa],S23 [MPa]\n"
            .to_owned();
    for path in 0..60 {
        let end = [0, 1, 2].map(|d| 1.0 + 0.25 * (1.3 * f64::from(path) + 2.1 * f64::from(d)).sin());
        for row in 1..=5 {
            let c = end.map(|stretch| (1.0 + (stretch - 1.0) * f64::from(row) / 5.0).powi(2));
            let square: f64 = c.iter().product();
            let s = c.map(|c| 0.4 - 0.4 / c + 0.5 * (square - 1.0) / c);
            rows += &format!("p{path},{},{},{},0,0,0,{},{},{},0,0,0\n", c[0], c[1], c[2], s[0], s[1], s[2]);
        }
    }
    let law = "version = 1\nprogram = \"mdsurrogate\"\n[data]\nfiles = [\"rows.csv\"]\n[training]\nepochs = \
               60\nlearning_rate = 1e-2\n\
        [[model]]\nname = \"law\"\nkind = \"energy\"\nsymmetry = \"isotropic\"\npolyconvex = true\nhidden = \
                            [[8, \"softplus\"]]\n";
    let block = STRIP.find("[material]").unwrap()..STRIP.find("[[boundary]]").unwrap();
    let solid = |law: &str| {
        let own = format!("[material.solid]\nlaw = \"correspondence\"\nconstitutive = {law}\n\n");
        STRIP.replace("../print/case.toml", "../law/case.toml").replace(&STRIP[block.clone()], &own)
    };
    let learnt = solid("{ learnt = \"law.safetensors\", input = \"print\" }");
    write(here, &[("law", law), ("strip", &learnt)]);
    fs::write(here.join("law/rows.csv"), rows).unwrap();
    strip(here, "--with-inputs").with_code(0);
    let force = |folder: &str| scalar(&report(&here.join(folder)), "reaction_x");
    let found = force("out/strip");
    let bulk = "{ model = \"neo-hookean\", parameters = { shear_modulus = \"0.4 MPa\" }, \
                bulk_modulus = \"1.2666667 MPa\" }";
    write(here, &[("strip", &solid(bulk))]);
    strip(here, "--output out/exact").with_code(0);
    near(
        "force of a law that an input has learnt, over the exact one",
        found / force("out/exact"),
        1.0,
        0.05,
    );
    write(here, &[("strip", &solid("{ learnt = \"law.safetensors\", input = \"prints\" }"))]);
    strip(here, "").with_code(2).tells("`material.solid.constitutive.input`");
    write(here, &[("strip", &solid(&bulk.replace("{ model", "{ input = \"print\", model")))]);
    strip(here, "").with_code(2).tells("only with `learnt`");
}

/// An input that is killed is resumed by `--with-inputs`, with the same bits.
#[test]
fn a_killed_input_is_resumed() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let slow = PRINT.replace("0.5 K", "0.002 K").replace("[8, 2, 1]", "[32, 8, 2]");
    write(here, &[("print", &slow), ("strip", STRIP)]);
    crystfem("run print/case.toml --output undisturbed --threads 1", here).with_code(0);
    let line = "run print/case.toml --output out/print --checkpoint-every 0 --threads 1";
    let mut child = command("crystfem", line, here).spawn().unwrap();
    let frame = here.join("out/print/fields.frames/0001.vtkhdf");
    let begun = Instant::now();
    while !frame.is_file() && child.try_wait().unwrap().is_none() {
        assert!(begun.elapsed() < Duration::from_secs(60), "no frame");
        std::thread::sleep(Duration::from_millis(1));
    }
    let _ = child.kill();
    assert_eq!(finish(child).code, None, "it had ended");
    strip(here, "").with_code(2).tells("its results in out/print are not finished");
    // a run of another scene is not resumed, but repeated
    let copy = here.join("copy");
    fs::create_dir(&copy).unwrap();
    fs::copy(here.join("out/print/checkpoint.bin"), copy.join("checkpoint.bin")).unwrap();
    write(here, &[("print", PRINT)]);
    strip(here, "--with-inputs --input print=copy").with_code(0);
    write(here, &[("print", &slow)]);
    strip(here, "--with-inputs").with_code(0).shows("input `print` is not finished");
    assert_same(&here.join("undisturbed"), &here.join("out/print"));
    assert!(scalar(&report(&here.join("out/strip")), "youngs_modulus_field_mean") > 0.0);
}

/// A run does not continue with another input or another table than it began with.
#[test]
fn what_changes_before_a_resume_is_noticed() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let slow =
        STRIP.replace("[output]", "[solver]\nmethod = \"adr\"\ntolerance = 1e-9\nsteps = 50\n\n[output]");
    write(here, &[("print", PRINT), ("strip", &slow)]);
    crystfem("run print/case.toml", here).with_code(0);
    let mut child =
        command("peri", "run strip/case.toml --checkpoint-every 0 --threads 1", here).spawn().unwrap();
    let checkpoint = here.join("out/strip/checkpoint.bin");
    let begun = Instant::now();
    while fs::metadata(&checkpoint).map_or(0, |file| file.len()) < 2 * slow.len() as u64 + 2000 {
        assert!(begun.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    finish(child);
    let saved = fs::read(&checkpoint).unwrap();
    let fields = here.join("out/print/fields.vtkhdf");
    let whole = fs::read(&fields).unwrap();
    fs::write(&fields, [&whole[..], b"x"].concat()).unwrap();
    let ended = peri("resume out/strip", here).with_code(2);
    ended.tells("fields.vtkhdf has changed since this run began; run the scene again");
    fs::write(&fields, &whole).unwrap();
    write(here, &[("print", &PRINT.replace("300 s", "310 s"))]);
    crystfem("run print/case.toml", here).with_code(0);
    fs::write(&fields, &whole).unwrap();
    peri("resume out/strip", here).with_code(2).tells("the results of its input `print` have changed");
    write(here, &[("print", PRINT)]);
    crystfem("run print/case.toml", here).with_code(0);
    fs::write(&fields, &whole).unwrap();
    assert_eq!(fs::read(&checkpoint).unwrap(), saved, "it stays as it is");
    peri("resume out/strip", here).with_code(0);
    strip(here, "--output out/undisturbed --threads 2").with_code(0);
    assert_same(&here.join("out/undisturbed"), &here.join("out/strip"));
}

/// Reports describe how tables were read, for a part and in all programs.
#[test]
fn a_report_tells_what_was_read() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    write(here, &[("print", &PRINT.replace("ambient = \"25 degC\"", "ambient = { file = \"air.csv\" }"))]);
    fs::write(here.join("print/air.csv"), "time [s],value [degC]\n0,25\n300,30\n").unwrap();
    crystfem("run print/case.toml", here).with_code(0);
    let report = report(&here.join("out/print"));
    let files = report["provenance"]["stamp"]["files"].as_object().unwrap();
    assert_eq!(files.keys().collect::<Vec<_>>(), ["air.csv"]);
    assert_eq!(files["air.csv"].as_str().unwrap().len(), 64);
}
