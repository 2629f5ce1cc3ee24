//! Output, files and exit codes of the `polycore` command line.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use harness::report::Report;

const CASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../cases/ch1/rubber-fits/case.toml");

const SCENE: &str = r#"
version = 1
program = "polycore"
[fit]
laws = ["neo-hookean"]
[[fit.data]]
name = "bar"
file = "bar.csv"
[[expect]]
quantity = "bar.neo-hookean.shear_modulus"
reference = 0.5
tolerance = 1e-6
kind = "closed-form"
source = "the data were made with it"
"#;

/// Exact neo-Hookean stress for μ = 0.5 MPa: λ − λ⁻² halved.
const BAR: &str = "stretch,nominal_MPa\n1,0\n2,0.875\n4,1.96875\n";

fn polycore(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_polycore")).args(arguments).output().unwrap()
}

/// Creates a folder with a scene and its table; returns the scene's path.
fn folder(scene: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bar.csv"), BAR).unwrap();
    let path = folder.path().join("case.toml");
    std::fs::write(&path, scene).unwrap();
    (folder, path)
}

fn run(scene: &Path, output: &Path) -> Output {
    polycore(&["run", scene.to_str().unwrap(), "--output", output.to_str().unwrap(), "--quick", "--verbose"])
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn the_case_of_chapter_1_passes() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let result = polycore(&["run", CASE, "--output", out]);
    assert_eq!(result.status.code(), Some(0), "{}{}", text(&result.stdout), text(&result.stderr));
    let report = Report::read(folder.path().join("report.json")).unwrap();
    assert!(report.passed());
    assert_eq!(report.expect.len(), 8);
    for file in [
        "fits.csv",
        "kawabata_states.csv",
        "treloar_uniaxial_chains.png",
        "kawabata_parity_phenomenological.png",
    ] {
        assert!(folder.path().join(file).exists(), "{file}");
    }
}

#[test]
fn exit_codes_0_and_1() {
    let (folder, scene) = folder(SCENE);
    let result = run(&scene, &folder.path().join("out"));
    assert_eq!(result.status.code(), Some(0), "{}", text(&result.stderr));
    let report = Report::read(folder.path().join("out/report.json")).unwrap();
    assert!((report.scalar("bar.neo-hookean.shear_modulus").unwrap() - 0.5).abs() < 1e-9);

    std::fs::write(&scene, SCENE.replace("reference = 0.5", "reference = 0.6")).unwrap();
    let result = run(&scene, &folder.path().join("out"));
    assert_eq!(result.status.code(), Some(1));
    assert!(text(&result.stdout).contains("FAIL  bar.neo-hookean.shear_modulus"), "{}", text(&result.stdout));
}

#[test]
fn bad_scenes_exit_with_2_and_write_nothing() {
    for (from, to, message) in [
        ("neo-hookean\"]", "neo-hooke\"]", "fit.laws[0]"),
        ("neo-hookean\"]", "neo-hookean\", \"neo-hookean\"]", "a second time"),
        ("laws = [\"neo-hookean\"]", "laws = []", "no law"),
        ("laws =", "law =", "did you mean `laws`?"),
        ("\"bar.csv\"", "\"foo.csv\"", "foo.csv"),
        ("name = \"bar\"", "name = \"../bar\"", "../bar"),
        ("neo-hookean\"]", "ogden-3\"]", "2 measured stresses"),
        ("bar.neo-hookean.shear_modulus", "bar.gent.rms", "found `bar.gent.rms`; allowed: "),
        ("version = 1", "version = 2", "version"),
        ("[[fit.data]]\nname = \"bar\"\nfile = \"bar.csv\"", "data = []", "no data"),
    ] {
        assert!(SCENE.contains(from), "{from}");
        let (folder, scene) = folder(&SCENE.replacen(from, to, 1));
        let out = folder.path().join("out");
        for result in [run(&scene, &out), polycore(&["check", scene.to_str().unwrap()])] {
            let error = text(&result.stderr);
            assert_eq!(result.status.code(), Some(2), "{from} → {to}: {error}");
            // miette may break lines
            let joined = error.replace(['\n', '│'], " ").split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(joined.contains(message), "{from} → {to}: {error}");
            assert!(!error.contains("panicked"));
        }
        assert!(!out.exists(), "{from} → {to}");
    }
    let (folder, scene) = folder(SCENE);
    std::fs::write(folder.path().join("file"), "").unwrap();
    assert_eq!(run(&scene, &folder.path().join("file")).status.code(), Some(2));
    assert_eq!(polycore(&["run"]).status.code(), Some(2));
    assert_eq!(polycore(&["run", "no/such/case.toml"]).status.code(), Some(2));
}

/// Two scenes of one folder have separate results; the parameters and the block for `peri` are printed.
#[test]
fn what_a_newcomer_sees() {
    let (folder, scene) = folder(SCENE);
    let other = folder.path().join("chains.toml");
    std::fs::write(&other, SCENE.replace("neo-hookean", "eight-chain").replace("laws", "cross = true\nlaws"))
        .unwrap();
    let mut texts = Vec::new();
    for name in [scene.file_name(), other.file_name()] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_polycore"));
        let result = command
            .current_dir(folder.path())
            .arg("run")
            .arg(name.unwrap())
            .args(["--quick", "--verbose"])
            .output();
        texts.push(text(&result.unwrap().stdout));
    }
    assert!(folder.path().join("out/chains/report.json").exists());
    assert_eq!(std::fs::read_dir(folder.path().join("out")).unwrap().count(), 2);
    assert!(texts[0].contains("neo-hookean           shear_modulus 0.500000 ± "), "{}", texts[0]);
    assert!(
        texts[0].contains("shear_modulus = \"0.5000000000 MPa\"")
            && texts[0].contains("model = \"neo-hookean\""),
        "{}",
        texts[0]
    );
    assert!(texts[1].contains("links "), "{}", texts[1]);
    let blocks = std::fs::read_to_string(folder.path().join("out/case/materials.toml")).unwrap();
    assert!(toml::from_str::<toml::Table>(&blocks).unwrap().contains_key("material"), "{blocks}");
    let plan = text(&polycore(&["check", scene.to_str().unwrap()]).stdout);
    assert!(plan.contains("no line `# source: …` in it"), "{plan}");
}

const TRIALS: &str = r#"
version = 1
program = "polycore"
[[trial]]
name = "locked"
description = "be refused"
law = "gent"
parameters = ["1 MPa", 5.0625]
mode = "equibiaxial"
stretch = 2.0
refused = "locking value 5.0625"
[[trial]]
name = "strip"
description = "be linear in the modulus"
law = "neo-hookean"
parameters = ["1 MPa"]
mode = "pure-shear"
stretch = 2.0
[[trial]]
name = "line"
description = "go through its datum"
law = "neo-hookean"
data = [[2.0, "1.75 MPa"]]
[[expect]]
quantity = "strip.nominal"
reference = 1.875
tolerance = 1e-12
kind = "closed-form"
source = "λ − 1/λ³"
[[expect]]
quantity = "line.shear_modulus"
reference = 1.0
tolerance = 1e-9
kind = "closed-form"
source = "P(2) = 1.75 μ"
"#;

#[test]
fn trials_pass_and_fail() {
    let (folder, scene) = folder(TRIALS);
    let out = folder.path().join("out");
    assert_eq!(run(&scene, &out).status.code(), Some(0));
    let report = Report::read(out.join("report.json")).unwrap();
    assert_eq!(report.trials.len(), 3);
    // a law that answers instead of refusing, one that refuses in other words, and a wrong figure
    for (from, to) in
        [("5.0625]", "6.0]"), ("locking value", "overflow"), ("reference = 1.875", "reference = 2.0")]
    {
        assert!(TRIALS.contains(from), "{from}");
        std::fs::write(&scene, TRIALS.replacen(from, to, 1)).unwrap();
        assert_eq!(run(&scene, &out).status.code(), Some(1), "{from}");
        let report = Report::read(out.join("report.json")).unwrap();
        assert!(
            !report.passed() && report.trials.iter().filter(|trial| !trial.passed).count() == 1,
            "{from}"
        );
    }
    for (from, to, message) in [
        ("law = \"gent\"", "law = \"gnet\"", "trial[0].law"),
        ("[\"1 MPa\", 5.0625]", "[\"1 MPa\"]", "shear_modulus, J_m"),
        ("[\"1 MPa\", 5.0625]", "[1.0, 5.0625]", "without a unit"),
        ("[\"1 MPa\", 5.0625]", "[\"1 MPa\", \"5 MPa\"]", "with a unit"),
        ("stretch = 2.0\nrefused", "refused", "missing `trial[0].stretch`"),
        ("name = \"strip\"", "name = \"locked\"", "a second time"),
        ("data = [[2.0, \"1.75 MPa\"]]", "", "missing `trial[2].parameters`"),
        ("data = [[", "parameters = [\"1 MPa\"]\ndata = [[", "`trial[2].data` conflicts with `parameters`"),
        ("data = [[", "stretch = 2.0\ndata = [[", "unexpected `trial[2].stretch`"),
        ("mode = \"pure-shear\"", "mode = \"shear\"", "allowed: `uniaxial`, `equibiaxial`, `pure-shear`"),
        ("\"strip.nominal\"", "\"strip.stress\"", "found `strip.stress`; allowed: "),
    ] {
        assert!(TRIALS.contains(from), "{from}");
        std::fs::write(&scene, TRIALS.replacen(from, to, 1)).unwrap();
        let result = polycore(&["check", scene.to_str().unwrap()]);
        let error = text(&result.stderr);
        assert_eq!(result.status.code(), Some(2), "{from}: {error}");
        let joined = error.replace(['\n', '│'], " ").split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(joined.contains(message), "{from}: {error}");
    }
}

#[test]
fn check_says_what_run_would_do() {
    let result = polycore(&["check", CASE]);
    assert_eq!(result.status.code(), Some(0));
    let text = text(&result.stdout);
    assert!(text.contains("data treloar: 21 states, 20 measured stresses"), "{text}");
    assert!(text.contains("law eight-chain: chain_modulus, links"), "{text}");
    assert!(text.contains("42 fits, 0 trials, 0 tables of networks, 8 expectations"), "{text}");
}

#[test]
fn exact_tables_read_back_as_data() {
    let arguments = ["exact", "neo-hookean", "0.5 MPa", "--from", "2", "--to", "4", "--points", "2"];
    let result = polycore(&arguments);
    assert_eq!(result.status.code(), Some(0), "{}", text(&result.stderr));
    let table =
        polycore::constitutive::hyperelastic::data::TestData::parse("exact", &text(&result.stdout)).unwrap();
    assert_eq!(table.measurements(), 2);
    assert!((table.states[0].nominal[0] - 0.875e6).abs() < 1e-6);
    for bad in [
        &["exact", "gent", "0.3 MPa", "5", "--to", "9"][..],
        &["exact", "gent", "0.3 m", "5"],
        &["exact", "gent", "0.3 MPa"],
        &["exact", "rubber", "1 MPa"],
        &["exact", "neo-hookean", "1 MPa", "--from", "-1"],
        &["exact", "neo-hookean", "1 MPa", "--points", "0"],
    ] {
        let result = polycore(bad);
        assert_eq!(result.status.code(), Some(2), "{bad:?} {}", text(&result.stdout));
        assert!(text(&result.stderr).contains("error"), "{bad:?}");
    }
}

#[test]
fn completions() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let result = polycore(&["completions", shell]);
        assert_eq!(result.status.code(), Some(0));
        assert!(text(&result.stdout).contains("polycore"));
    }
}

/// Scene of one table, all laws, `keys` in its entry.
fn fitted(table: &str, keys: &str) -> (tempfile::TempDir, Output) {
    let scene = format!(
        "version = 1\nprogram = \"polycore\"\n[fit]\n[[fit.data]]\nname = \"t\"\nfile = \"bar.csv\"\n{keys}\n"
    );
    let (folder, scene) = folder(&scene);
    std::fs::write(folder.path().join("bar.csv"), table).unwrap();
    let result = run(&scene, &folder.path().join("out"));
    (folder, result)
}

/// Exact neo-Hookean stresses λ − λ⁻² times a modulus.
fn neo_hookean(unit: &str, modulus: f64, stretches: impl IntoIterator<Item = f64>) -> String {
    let row = |l: f64| format!("{l},{}\n", modulus * (l - 1.0 / (l * l)));
    format!("stretch,nominal_{unit}\n{}", stretches.into_iter().map(row).collect::<String>())
}

/// Compression, one-term data, gels: every law is fitted or reported, and written numbers have all digits.
#[test]
fn ordinary_tables_give_every_law() {
    let laws = 21;
    let squeezed = neo_hookean("MPa", 0.4, [0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6, 0.55, 0.5]);
    let gel = neo_hookean("Pa", 5.123_45, (1..12).map(|i| 1.0 + 0.1 * f64::from(i)));
    let stiff = neo_hookean("GPa", 1.25, (1..12).map(|i| 1.0 + 0.01 * f64::from(i)));
    for (table, modulus, written) in [
        (&squeezed, 0.4, "\"0.4000000000 MPa\""),
        (&gel, 5.123_45e-6, "\"5.123450000 Pa\""),
        (&stiff, 1250.0, "\"1.250000000 GPa\""),
    ] {
        let (folder, result) = fitted(table, "");
        let shown = text(&result.stdout);
        assert_eq!(result.status.code(), Some(0), "{shown}{}", text(&result.stderr));
        assert!(!shown.contains("failed") && shown.contains("separator `,`, decimal point"), "{shown}");
        assert!(shown.contains("mooney-rivlin") && shown.contains("C2 absent"), "{shown}");
        let report = Report::read(folder.path().join("out/report.json")).unwrap();
        let found = report.scalar("t.neo-hookean.shear_modulus").unwrap();
        assert!((found / modulus - 1.0).abs() < 1e-6, "{found} {modulus}");
        assert_eq!(report.scalar("t.ogden-3.stable"), Some(1.0));
        let materials = std::fs::read_to_string(folder.path().join("out/materials.toml")).unwrap();
        assert!(materials.contains(written), "{materials}");
        assert!(
            materials.contains("# mooney-rivlin, rms") && materials.contains("use `neo-hookean`"),
            "{materials}"
        );
        let fits = std::fs::read_to_string(folder.path().join("out/fits.csv")).unwrap();
        let keys = fits.lines().filter(|line| line.contains(",r2,")).count();
        assert_eq!(keys, laws, "{fits}");
        assert!(fits.lines().all(|line| line.split(',').all(|cell| cell.len() < 24)), "{fits}");
    }
}

/// Few data: laws with more parameters are reported as failed, the others are kept.
#[test]
fn a_law_that_fails_is_named() {
    let (folder, result) = fitted("stretch,nominal_MPa\n1.5,0.4\n2,0.7\n3,1.1\n", "");
    let shown = text(&result.stdout);
    assert_eq!(result.status.code(), Some(0), "{shown}{}", text(&result.stderr));
    assert!(
        shown.contains("failed  ogden-3 on t: fit of `ogden-3`: 3 measurements for 6 parameters"),
        "{shown}"
    );
    let report = Report::read(folder.path().join("out/report.json")).unwrap();
    assert_eq!(report.scalar("t.ogden-2.failed"), Some(1.0));
    assert!(report.scalar("t.gent.rms").is_some() && report.scalar("t.ogden-2.rms").is_none());
}

/// Keys resolve ambiguous tables, and tables that cannot be read are refused.
#[test]
fn tables_of_laboratories() {
    let laboratory = "Test;Specimen;Strain (%);Stress (MPa)\nuniaxial;1;0,0;0\nuniaxial;1;50,0;0,527778\n\
                      uniaxial;1;100,0;0,875\nequibiaxial;1;50,0;0,684156\nplanar;1;50,0;0,601852\n\
                      planar;1;60,0;0,7\n";
    let (_folder, result) = fitted(laboratory, "");
    let shown = text(&result.stdout);
    assert_eq!(result.status.code(), Some(0), "{shown}{}", text(&result.stderr));
    for part in [
        "separator `;`, decimal comma, UTF-8, headings in line 1, columns `Test`, `Strain (%)`, `Stress \
         (MPa)`",
        "engineering strain and nominal stress (assumed; the keys `strain` and `stress` set them)",
        "stretches 1.0000 to 2.0000",
    ] {
        assert!(shown.contains(part), "{shown}");
    }
    // σ = λP of the same bar
    let (folder, result) = fitted(
        "eps;sigma\n0.5;0.791667\n1;1.75\n2;4.33333\n",
        "strain = \"engineering\"\nstress = \"true\"\nstress_unit = \"MPa\"",
    );
    assert_eq!(result.status.code(), Some(0), "{}", text(&result.stderr));
    let report = Report::read(folder.path().join("out/report.json")).unwrap();
    assert!((report.scalar("t.neo-hookean.shear_modulus").unwrap() / 0.5 - 1.0).abs() < 1e-5);
    let strains = "stretch,nominal_MPa\n0.05,0.05719\n0.1,0.10942\n0.4,0.35592\n0.8,0.59654\n1.2,0.79736\n";
    for (table, keys, parts) in [
        (strains, "", &["bar.csv", "line 2: column 1, `stretch`", "is this a strain?"][..]),
        ("eps;sigma\n0.5;0.79\n", "", &["unit of column 2, `sigma`", "stress_unit"]),
        ("eps;sigma/MPa\n0.5;0,79\n", "", &["line 2", "decimal"]),
        ("Force (N),Extension (mm)\n1,2\n", "", &["divide forces by the undeformed area"]),
    ] {
        let (_folder, result) = fitted(table, keys);
        let error = text(&result.stderr).replace(['\n', '│'], " ");
        let error = error.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(result.status.code(), Some(2), "{error}");
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    }
    // strains whose measure the key names
    let (_folder, result) = fitted(strains, "strain = \"engineering\"");
    assert_eq!(result.status.code(), Some(0), "{}", text(&result.stderr));
}

/// `cross` reports where a law is safe: Ogden's term of α < 0, which fits bars, is far off in equibiaxial
/// tension.
#[test]
fn cross_ends_in_a_verdict() {
    let case = concat!(env!("CARGO_MANIFEST_DIR"), "/../../cases/external/treloar-fits/treloar1944_20C.csv");
    let scene = "version = 1\nprogram = \"polycore\"\n[fit]\ncross = true\nlaws = [\"ogden-1\", \
                 \"eight-chain-root-i2\"]\n\
                 [[fit.data]]\nname = \"bar\"\nfile = \"t.csv\"\nmode = \"uniaxial\"\n\
                 [[fit.data]]\nname = \"sheet\"\nfile = \"t.csv\"\nmode = \"equibiaxial\"\n";
    let (folder, scene) = folder(scene);
    std::fs::copy(case, folder.path().join("t.csv")).unwrap();
    let result = run(&scene, &folder.path().join("out"));
    let shown = text(&result.stdout);
    assert_eq!(result.status.code(), Some(0), "{shown}{}", text(&result.stderr));
    assert!(shown.contains("; unsafe outside bar"), "{shown}");
    let lines: Vec<&str> = shown.lines().filter(|line| line.contains("safe outside bar")).collect();
    assert!(lines[0].trim_start().starts_with("ogden-1") && lines[0].contains("; unsafe"), "{shown}");
    assert!(
        lines[1].trim_start().starts_with("eight-chain-root-i2") && lines[1].contains("; safe"),
        "{shown}"
    );
    let fits = std::fs::read_to_string(folder.path().join("out/fits.csv")).unwrap();
    assert!(fits.contains("bar,ogden-1,r2.sheet,-"), "{fits}");
}

/// `rank` on two files fitted at once: of bodies of one modulus the neo-Hookean law predicts each mode left
/// out, and is taken for its single parameter.
#[test]
fn laws_are_ranked_by_modes_left_out() {
    let scene = "version = 1\nprogram = \"polycore\"\n[fit]\nlaws = [\"yeoh\", \"neo-hookean\"]\n\
                 [[fit.data]]\nname = \"bar\"\nfile = \"bar.csv\"\n\
                 [[fit.data]]\nname = \"sheet\"\nfile = \"sheet.csv\"\nmode = \"equibiaxial\"\n\
                 [[fit.data]]\nname = \"both\"\ntables = [\"bar\", \"sheet\"]\nrank = true\n";
    let (folder, scene) = folder(scene);
    let bar = neo_hookean("MPa", 0.5, [1.5, 2.0, 3.0, 4.0]);
    // 1 % stiffer as a sheet
    let sheet = [1.5_f64, 2.0, 3.0].iter().fold("stretch,nominal_MPa\n".to_owned(), |text, l| {
        format!("{text}{l},{}\n", 0.505 * (l - l.powi(-5)))
    });
    std::fs::write(folder.path().join("bar.csv"), bar).unwrap();
    std::fs::write(folder.path().join("sheet.csv"), sheet).unwrap();
    let result = run(&scene, &folder.path().join("out"));
    let shown = text(&result.stdout);
    assert_eq!(result.status.code(), Some(0), "{shown}{}", text(&result.stderr));
    for part in ["both: take neo-hookean", "laws ranked on both", "both: rows of bar, sheet"] {
        assert!(shown.contains(part), "{shown}");
    }
    let report = Report::read(folder.path().join("out/report.json")).unwrap();
    assert_eq!(report.scalar("both.neo-hookean.rank"), Some(1.0));
    // a modulus 1 % off, over the largest of three stresses
    let stresses = [1.5_f64, 2.0, 3.0].map(|l| l - l.powi(-5));
    let rms = (stresses.iter().map(|p| p * p).sum::<f64>() / 3.0).sqrt() / stresses[2];
    let found = report.scalar("both.neo-hookean.equibiaxial.left_out").unwrap();
    assert!((found / (0.005 / 0.505 * rms) - 1.0).abs() < 1e-4, "{found}");
    assert_eq!(report.scalar("both.neo-hookean.uniaxial.alone"), Some(found));
    assert_eq!(report.scalar("bar.neo-hookean.rank"), None);
    let csv = std::fs::read_to_string(folder.path().join("out/both_ranking.csv")).unwrap();
    assert!(csv.starts_with("rank,law,parameters,left_out_largest,left_out_uniaxial"), "{csv}");
    assert_eq!(csv.lines().nth(1).map(|line| line.starts_with("1,neo-hookean,1,")), Some(true), "{csv}");
}

/// Names used by other programs lead to the law of this one.
#[test]
fn laws_of_other_names_get_advice() {
    for (name, advice) in [
        ("8-chain", "`eight-chain`, or `arruda-boyce`"),
        ("reduced-polynomial", "`yeoh`"),
        ("prony", "fitted by `[time]` and `[[prony]]`"),
        ("poisson_ratio", "incompressible"),
        ("ogden", "by the number of terms"),
    ] {
        let (_folder, scene) = folder(&SCENE.replace("\"neo-hookean\"]", &format!("\"{name}\"]")));
        let result = polycore(&["check", scene.to_str().unwrap()]);
        let error = text(&result.stderr).replace(['\n', '│'], " ");
        let error = error.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(result.status.code(), Some(2), "{error}");
        assert!(error.contains(advice), "{error}");
    }
}
