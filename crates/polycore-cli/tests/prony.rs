//! Prony series and fits with time from the command line: relaxation, isotherms, two rates, bad scenes.

use std::path::Path;
use std::process::Command;

use harness::report::Report;

const SCENE: &str = r#"
version = 1
program = "polycore"
[[prony]]
name = "held"
file = "held.csv"
modulus = "shear"
[[prony]]
name = "sweeps"
file = "sweeps.csv"
modulus = "tension"
reference = "20 degC"
"#;

/// Runs a scene; returns the exit code and the text of both outputs without line breaks.
fn run(folder: &Path, scene: &str) -> (Option<i32>, String) {
    std::fs::write(folder.join("scene.toml"), scene).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_polycore"));
    command.current_dir(folder).args(["run", "scene.toml", "--output", "out", "--verbose"]);
    let ended = command.output().unwrap();
    let text = String::from_utf8([ended.stdout, ended.stderr].concat()).unwrap();
    (ended.status.code(), text.replace('│', " ").split_whitespace().collect::<Vec<_>>().join(" "))
}

/// Storage and loss at ωτ.
fn maxwell(x: f64) -> [f64; 2] {
    [x * x / (1.0 + x * x), x / (1.0 + x * x)]
}

/// A solid of one relaxation time, 2 s, 1 MPa beside 3 MPa: held, and swept at five temperatures whose times
/// halve every 5 K.
#[test]
fn series_and_isotherms() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut held = "time [min],modulus [kPa]\n".to_owned();
    for k in 0..40 {
        let time = 0.05 * 1.2_f64.powi(k);
        held += &format!("{},{}\n", time / 60.0, 3000.0 + 1000.0 * (-time / 2.0).exp());
    }
    let mut sweeps = "T [degC],f [Hz],E' [MPa],E'' [MPa]\n".to_owned();
    for step in 0..5 {
        let (temperature, tau) = (10 + 5 * step, 2.0 * 0.5_f64.powi(step - 2));
        for k in 0..13 {
            let frequency = 0.01 * 10_f64.powf(0.25 * f64::from(k));
            let [storage, loss] = maxwell(std::f64::consts::TAU * frequency * tau);
            sweeps += &format!("{temperature},{frequency},{},{loss}\n", 3.0 + storage);
        }
    }
    std::fs::write(folder.join("held.csv"), &held).unwrap();
    std::fs::write(folder.join("sweeps.csv"), &sweeps).unwrap();
    let (code, shown) = run(folder, SCENE);
    assert_eq!(code, Some(0), "{shown}");
    let report = Report::read(folder.join("out/report.json")).unwrap();
    let value = |name: &str| report.scalar(name).unwrap();
    for (name, expected, error) in [
        ("held.terms", 1.0, 0.0),
        ("held.equilibrium", 3.0, 1e-4),
        ("held.instantaneous", 4.0, 1e-4),
        ("sweeps.equilibrium", 3.0, 0.03),
        ("sweeps.instantaneous", 4.0, 0.04),
    ] {
        assert!((value(name) - expected).abs() <= error, "{name}: {} beside {expected}", value(name));
    }
    let read = |name: &str| std::fs::read_to_string(folder.join("out").join(name)).unwrap();
    // log₁₀ 2 for 5 K
    for (line, expected) in read("sweeps_shifts.csv").lines().skip(1).zip([2.0, 1.0, 0.0, -1.0, -2.0]) {
        let found: f64 = line.split(',').nth(1).unwrap().parse().unwrap();
        assert!((found - expected * 2.0_f64.log10()).abs() < 0.02, "{line}");
    }
    let branches: toml::Table = read("held_branches.toml").parse().unwrap();
    let branch = &branches["material"]["solid"]["branch"][0];
    assert_eq!(branch["viscosity"].as_str(), Some("constant"));
    // relative modulus, no relaxation of the volume, relaxation time; C₁₀ is half the shear modulus at once
    let card = read("held_prony.inp");
    assert!(card.contains("MODULI=INSTANTANEOUS\n2.000000e0"), "{card}");
    let term: Vec<f64> =
        card.lines().last().unwrap().split(", ").map(|number| number.parse().unwrap()).collect();
    assert!((term[0] - 0.25).abs() < 1e-4 && term[1] == 0.0 && (term[2] - 2.0).abs() < 1e-3, "{term:?}");
    assert!(read("sweeps_prony.inp").contains("*TRS, DEFINITION=WLF\n20.0000, "));
}

#[test]
fn faults_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let held = "time [s],modulus [MPa]\n1,3\n2,2\n3,1.5\n4,1.2\n";
    std::fs::write(folder.join("held.csv"), held).unwrap();
    let sweeps = "T [degC],f [Hz],E' [MPa],E'' [MPa]\n20,1,3,1\n20,2,4,1\n20,3,5,1\n";
    std::fs::write(folder.join("sweeps.csv"), sweeps).unwrap();
    std::fs::write(folder.join("negative.csv"), held.replace("1.5", "-1.5")).unwrap();
    std::fs::write(folder.join("bare.csv"), held.replace(" [s]", "")).unwrap();
    for (from, to, message) in [
        ("name = \"sweeps\"", "name = \"held\"", "`held`, which is taken"),
        (
            "modulus = \"shear\"",
            "modulus = \"shear\"\nreference = \"20 degC\"",
            "no reference, or a table with",
        ),
        ("reference = \"20 degC\"", "", "`reference`, the temperature of the master curve"),
        ("reference = \"20 degC\"", "reference = \"30 degC\"", "20.00 to 20.00 degC"),
        ("modulus = \"shear\"", "modulus = \"shear\"\nterms = 0", "`prony[0].terms`: found 0"),
        (
            "modulus = \"shear\"",
            "modulus = \"shear\"\nloss_weight = -1.0",
            "`prony[0].loss_weight`: found -1",
        ),
        (
            "\"held.csv\"",
            "\"negative.csv\"",
            "negative.csv:4: column 2, `modulus [MPa]`: found \"-1.5\"; allowed: above 0",
        ),
        ("\"held.csv\"", "\"bare.csv\"", "no unit"),
        ("modulus = \"shear\"", "", "missing `prony[0].modulus`"),
    ] {
        let (code, shown) = run(folder, &SCENE.replacen(from, to, 1));
        assert_eq!(code, Some(2), "{from}: {shown}");
        assert!(shown.contains(message), "{message}: {shown}");
    }
}

/// A fit with time: the table of the run, its files, and what a scene may not ask.
#[test]
fn a_law_with_time_is_fitted() {
    let scene = r#"
version = 1
program = "polycore"
[time]
equilibrium = "neo-hookean"
leave_out = "0.1 1/s"
starts = 1
[[time.branch]]
spring = "neo-hookean"
viscosity = "constant"
[[time.data]]
name = "bar"
file = "bar.csv"
runs = ["rate"]
[[time.predict]]
name = "hold"
steps = [{ to = 1.5, rate = "0.1 1/s" }, { hold = "100 s" }]
[[expect]]
quantity = "time.all.rms"
at_most = 0.001
kind = "closed-form"
source = "the data are elastic"
"#;
    // λ − λ⁻² times 0.5 MPa at both rates: a branch has no effect
    let mut table = String::from("rate [1/s],stretch,nominal [MPa]\n");
    for rate in [0.1, 0.01] {
        for path in [0.1, 0.3, 0.5, 0.7, 0.9] {
            let stretch: f64 = if path <= 0.5 { 1.0 + path } else { 2.0 - path };
            table += &format!("{rate},{stretch},{}\n", 0.5 * (stretch - stretch.powi(-2)));
        }
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bar.csv"), &table).unwrap();
    let out = folder.path().join("out");
    let (code, shown) = run(folder.path(), scene);
    assert_eq!(code, Some(0), "{shown}");
    for part in ["bar-0.1 ", "bar-0.01 ", "all ", "predicted by a fit to the other rates", "not determined"] {
        assert!(shown.contains(part), "{part}: {shown}");
    }
    let report = Report::read(out.join("report.json")).unwrap();
    assert!(report.scalar("time.left-out.rms").unwrap() < 1e-3);
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    assert!(read("time_runs.csv").lines().count() == 11, "{}", read("time_runs.csv"));
    let block: toml::Table = read("time_material.toml").parse().unwrap();
    let solid = &block["material"]["solid"];
    assert_eq!(solid["constitutive"]["model"].as_str(), Some("neo-hookean"));
    assert!(solid["branch"][0]["parameters"]["eta"].is_str());
    let cards = read("time_materials_mm.inp");
    assert!(shown.contains("10 state variables (*DEPVAR)") && cards.contains("*DEPVAR\n10\n**\n"), "{cards}");
    assert!(cards.ends_with("no *HYSTERESIS of Abaqus: its viscosity is that of Bergström and Boyce\n"));
    let card = cards.split("*USER MATERIAL, CONSTANTS=11\n").nth(1).unwrap();
    let rows = card.lines().take(2).flat_map(|line| line.split(", "));
    let numbers: Vec<f64> = rows.map(|number| number.parse().unwrap()).collect();
    // K, μ, absolute zero, r, m, β, neo-Hooke, ν, constant, η, no shift
    let modulus =
        |text: &toml::Value| text.as_str().unwrap().split(' ').next().unwrap().parse::<f64>().unwrap();
    let parameters = &solid["branch"][0]["parameters"];
    let constitutive = &solid["constitutive"];
    let given = [
        modulus(&constitutive["bulk_modulus"]),
        modulus(&constitutive["parameters"]["shear_modulus"]),
        modulus(&parameters["nu"]),
        modulus(&parameters["eta"]),
    ];
    for (found, given) in [numbers[0], numbers[1], numbers[7], numbers[9]].iter().zip(given) {
        assert!((found / given - 1.0).abs() < 1e-4, "{cards} {given}");
    }
    assert_eq!([2, 3, 4, 5, 6, 8, 10].map(|k| numbers[k]), [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0]);
    assert_eq!(numbers.len(), 11);
    assert_eq!(read("hold_prediction.csv").lines().count(), 83);
    for (from, to, message) in [
        ("\"0.1 1/s\"\nstarts", "\"0.2 1/s\"\nstarts", "0.01 /s, 0.1 /s"),
        ("starts = 1", "starts = 0", "at least 1"),
        ("starts = 1", "softening = \"yes\"", "time.softening"),
        ("starts = 1", "fix = { \"mullins.r\" = 2.0 }", "`mullins.r`"),
        ("starts = 1", "fix = { \"1.tau\" = 3.0 }", "allowed: `shear_modulus`, `1.nu`, `1.eta`"),
        ("{ hold = \"100 s\" }", "{ hold = \"100 s\", to = 2.0 }", "`to` another strain"),
        ("time.all.rms", "time.al.rms", "time.all.rms"),
    ] {
        let (code, error) = run(folder.path(), &scene.replace(from, to));
        assert!(code != Some(0) && error.contains(message), "{from}: {error}");
    }
}
