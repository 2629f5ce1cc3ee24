//! `polycore network` and scenes with tables of networks.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use harness::report::Report;
use polycore::table::Table;

const CASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../cases/external/networks");

const TABLE: &str = "source,f,r,M_strand_kg_mol,p,w_sol,sol,G_MPa\n\
                     perfect,4,1,10,1,,present,\n\
                     poor,4,1,10,0.5,,present,0.1\n\
                     measured,4,1.33,11.3,,0.005,removed,0.276\n";

fn polycore(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_polycore")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn folder(table: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("networks.csv");
    std::fs::write(&file, table).unwrap();
    (folder, file)
}

fn number(table: &Table, row: usize, column: &str) -> Option<f64> {
    table.number_or_blank(row, table.find(column).unwrap()).unwrap()
}

/// A file of predictions, one row for each of the input, with a reason where there is none; a summary by
/// source.
#[test]
fn predictions_in_a_file() {
    let (folder, file) = folder(TABLE);
    let output = folder.path().join("new/predicted.csv");
    let result = polycore(&["network", file.to_str().unwrap(), "-o", output.to_str().unwrap()]);
    assert_eq!(result.status.code(), Some(0), "{}", text(&result.stderr));
    let summary = text(&result.stdout);
    for part in
        ["measured ", "all measured ", "line 3: `p` = 0.5: no gel: (f - 1) p_A p_B = 0.7500", "predicted.csv"]
    {
        assert!(summary.contains(part), "{summary}");
    }
    let table = Table::read(&output).unwrap();
    assert_eq!(table.rows(), 3);
    // (ν − μ)RT = ρRT/2M, and n = M/M_K of PDMS
    let phantom = number(&table, 0, "predicted_phantom_MPa").unwrap();
    assert!((phantom / (0.970 / 20.0 * 8.314_462_6 * 0.298_15) - 1.0).abs() < 1e-5, "{phantom}");
    assert!((number(&table, 0, "kuhn_segments").unwrap() - 26.2467).abs() < 1e-4);
    assert!((number(&table, 0, "fracture_energy_low_J_m2").unwrap() - 5.24).abs() < 0.005);
    assert!((number(&table, 0, "fracture_energy_high_J_m2").unwrap() - 30.6).abs() < 0.05);
    assert_eq!(number(&table, 0, "deviation"), None);
    assert_eq!(number(&table, 1, "predicted_G_MPa"), None);
    let [low, used] = ["least_conversion", "conversion"].map(|name| number(&table, 2, name).unwrap());
    assert!(low < used && used <= 1.0 / 1.33, "{low} {used}");
    let deviation = number(&table, 2, "predicted_G_MPa").unwrap() / 0.276 - 1.0;
    assert!((number(&table, 2, "deviation").unwrap() - deviation).abs() < 1e-5);
}

/// Without a file the predictions go to standard output, alone; options change them.
#[test]
fn predictions_on_standard_output() {
    let (_folder, file) = folder(TABLE);
    let file = file.to_str().unwrap();
    let predicted = |options: &[&str]| {
        let result = polycore(&[&["network", file], options].concat());
        assert_eq!(result.status.code(), Some(0), "{}", text(&result.stderr));
        assert!(text(&result.stderr).contains("all measured"));
        Table::parse("out.csv", result.stdout).unwrap()
    };
    let usual = predicted(&[]);
    assert_eq!(usual.headings.last().unwrap().text, "reason");
    let none = predicted(&["--entanglement-modulus", "0 Pa", "--loop-factor=0"]);
    assert_eq!(number(&none, 0, "predicted_entangled_MPa"), Some(0.0));
    assert_eq!(number(&none, 2, "conversion"), number(&usual, 2, "least_conversion"));
    let dense = predicted(&["--density", "1.94 g/cm^3", "--temperature", "50 degC"]);
    let ratio = number(&dense, 0, "predicted_phantom_MPa").unwrap()
        / number(&usual, 0, "predicted_phantom_MPa").unwrap();
    assert!((ratio / (2.0 * 323.15 / 298.15) - 1.0).abs() < 1e-5, "{ratio}");
    let other = predicted(&["--polymer", "PI", "--entanglement-modulus", "0.35 MPa"]);
    assert!((number(&other, 0, "kuhn_segments").unwrap() - 10e3 / 113.0).abs() < 1e-3);
}

/// Bad input: exit code 2, place and content of the fault, no file and no table of standard output.
#[test]
fn bad_input_writes_nothing() {
    for (from, to, message) in [
        (
            "10,0.5",
            "10,1.5",
            "networks.csv:3: column 5, `p`: found \"1.5\"; allowed: a conversion within 0 to 1",
        ),
        (
            "10,0.5",
            "ten,0.5",
            "networks.csv:3: column 4, `M_strand_kg_mol`: found \"ten\"; allowed: a number",
        ),
        ("10,0.5", "-10,0.5", "found \"-10\"; allowed: a positive number"),
        ("f,r,", "f,ratio,", "allowed: a column `r`: groups of the cross-linkers per group"),
        ("removed", "lost", "column 7, `sol`: found \"lost\"; allowed: `present` (left in) or `removed`"),
        (TABLE, "", "an empty file"),
    ] {
        let (folder, file) = folder(&TABLE.replacen(from, to, 1));
        let output = folder.path().join("predicted.csv");
        for options in [&["-o", output.to_str().unwrap()][..], &[]] {
            let result = polycore(&[&["network", file.to_str().unwrap()], options].concat());
            let error = text(&result.stderr);
            assert_eq!(result.status.code(), Some(2), "{error}");
            assert!(error.contains(message), "{error}\n{message}");
            assert!(result.stdout.is_empty() && !output.exists());
        }
    }
    let (folder, file) = folder(TABLE);
    let file = file.to_str().unwrap();
    let below = folder.path().join("networks.csv/out.csv");
    for (options, message) in [
        (&["-o", file][..], "it is the table of compositions"),
        (&["-o", below.to_str().unwrap()], "cannot be used"),
        (&["--polymer", "PDMZ"], "`--polymer`: unknown polymer `PDMZ`; known: PDMS"),
        (&["--density", "0 kg/m^3"], "`--density`: found 0"),
        (&["--density", "970"], "970"),
        (&["--entanglement-modulus=-1 Pa"], "`--entanglement-modulus`: found -1 Pa"),
        (&["--loop-factor", "-1"], "`--loop-factor`: found -1"),
        (&["--conversion", "guess"], "possible values: best, given, sol"),
    ] {
        let result = polycore(&[&["network", file], options].concat());
        let error = text(&result.stderr);
        assert_eq!(result.status.code(), Some(2), "{options:?}: {error}");
        assert!(error.contains(message), "{error}\n{message}");
    }
    assert_eq!(std::fs::read_to_string(file).unwrap(), TABLE);
    assert_eq!(polycore(&["network", "no/such/file.csv"]).status.code(), Some(2));
}

/// The case meets its expectations and writes its tables.
#[test]
fn the_case_passes() {
    let folder = tempfile::tempdir().unwrap();
    let case = Path::new(CASE).join("case.toml");
    let result =
        polycore(&["run", case.to_str().unwrap(), "--output", folder.path().to_str().unwrap(), "--quick"]);
    assert_eq!(result.status.code(), Some(0), "{}{}", text(&result.stdout), text(&result.stderr));
    let report = Report::read(folder.path().join("report.json")).unwrap();
    assert!(report.passed() && report.expect.len() == 9);
    assert!(folder.path().join("measured_networks.csv").exists());
    assert!(!folder.path().join("fits.csv").exists());
}

/// Scenes that name what is not there.
#[test]
fn bad_scenes() {
    const SCENE: &str =
        "version = 1\nprogram = \"polycore\"\n[[network]]\nname = \"a\"\nfile = \"networks.csv\"\n";
    let (folder, _) = folder(TABLE);
    let scene = folder.path().join("case.toml");
    for (keys, message) in [
        ("", "network a: 3 compositions, 2 with a modulus"),
        ("source = \"Nobody\"\n", "no row that is asked for"),
        ("polymer = \"PDMZ\"\n", "network[0].polymer"),
        ("loop_factor = -1\n", "network[0].loop_factor"),
        ("kind = \"guessed\"\n", "allowed: `measured`, `simulated`"),
        ("conversions = \"sol\"\n", "did you mean `conversion`?"),
        ("[[network]]\nname = \"a\"\nfile = \"networks.csv\"\n", "a second time"),
        ("[[network]]\nname = \"b\"\nfile = \"none.csv\"\n", "none.csv"),
        (
            "[[expect]]\nquantity = \"a.rms\"\nat_most = 1\nkind = \"bound\"\nsource = \"none\"\n",
            "found `a.rms`; allowed: ",
        ),
    ] {
        std::fs::write(&scene, format!("{SCENE}{keys}")).unwrap();
        let result = polycore(&["check", scene.to_str().unwrap()]);
        let error = text(&result.stderr) + &text(&result.stdout);
        assert_eq!(result.status.code(), Some(if keys.is_empty() { 0 } else { 2 }), "{keys}: {error}");
        let joined = error.replace(['\n', '│'], " ").split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(joined.contains(message), "{keys}: {error}");
    }
}
