//! Point scenes and fits, from text to report.

use crystfem::kinetics::{KineticConstants, Kinetics, cooling_curve};
use crystfem::program::run::Crystfem;
use harness::case::Options;
use harness::report::Report;
use harness::scene::{Failure, Source};
use std::path::Path;

fn run_quietly(source: &Source, output: &Path, quick: bool) -> Result<Report, Failure<crystfem::Error>> {
    let options = Options { quick, ..Options::new(output) };
    harness::case::run::<Crystfem>(source, options).map(|finished| finished.report)
}

const SCENE: &str = r#"
version = 1
program = "crystfem"

[material]
law = "semicrystalline"
density = "1010 kg/m^3"
conductivity = "0.25 W/(m K)"
specific_heat = "2200 J/(kg K)"
kinetics = "table-4.1-column-1"
melting = "pa12"
crystallinity = 0.25
latent_heat = "209 J/g"

[[point]]
name = "cooling"
start = "200 degC"
legs = [{ to = "120 degC", rate = "10 K/min" }, { hold = "1 min" }, { to = "172 degC", duration = "30 s" }]

[[point]]
name = "slow"
quick = false
history = "history.csv"

[[expect]]
quantity = "cooling.temperature_at_0.5"
reference = 152.77
tolerance = 0.02
kind = "independent-program"
source = "formulation.md, kinetics table"
"#;

fn run_in(folder: &Path, text: &str, quick: bool) -> Report {
    let source = Source::new(folder.join("case.toml"), text);
    match run_quietly(&source, &folder.join("out"), quick) {
        Ok(report) => report,
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn a_scene_gives_the_same_files_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let history = "time [min],temperature [degC]\n0,200\n80,120\n";
    std::fs::write(folder.path().join("history.csv"), history).expect("a file");
    let report = run_in(folder.path(), SCENE, false);
    assert!(report.passed(), "{}", report.table());
    let files = ["cooling.csv", "slow.csv", "alpha.png", "melting.png", "kinetics.png", "temperature.png"];
    let read = || files.map(|name| std::fs::read(folder.path().join("out").join(name)).expect(name));
    let first = read();
    let again = run_in(folder.path(), SCENE, false);
    assert!(first == read());
    assert_eq!(report.values, again.values);
    // 1 K/min from the table of the history; some crystals melt at 172 °C
    let at = |name: &str| report.scalar(name).expect(name);
    assert!((at("slow.temperature_at_0.5") - 162.05).abs() < 0.02);
    assert!(at("cooling.highest_alpha") > 0.999 && at("cooling.final_alpha") < 0.9);
    assert!((at("cooling.final_crystallinity") - 0.25 * at("cooling.final_alpha")).abs() < 1e-15);
    let quick = run_in(folder.path(), SCENE, true);
    assert!(quick.scalar("slow.final_alpha").is_none() && quick.passed());
}

/// One scene writes the curve that another scene fits.
#[test]
fn a_fit_reads_what_a_point_writes() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = SCENE.replace(
        "history = \"history.csv\"",
        "start = \"200 degC\"\nlegs = [{ to = \"120 degC\", rate = \"1 K/min\" }]",
    );
    run_in(folder.path(), &text, false);
    let fit = r#"
version = 1
program = "crystfem"

[[fit]]
name = "pa12"
law = "nakamura"
equilibrium_melting = "193.2 degC"
glass_transition = "51 degC"
data = [{ file = "out/slow.csv" }, { file = "fast.csv" }]
"#;
    // up to the hold, because the fit ignores melting
    let text = std::fs::read_to_string(folder.path().join("out/cooling.csv")).expect("a table");
    let cooling = text.lines().enumerate().take_while(|(row, line)| {
        *row == 0 || line.split(',').next().is_some_and(|time| time.parse::<f64>().is_ok_and(|t| t <= 480.0))
    });
    let fast: Vec<&str> = cooling.map(|(_, line)| line).collect();
    std::fs::write(folder.path().join("fast.csv"), fast.join("\n")).expect("a file");
    let source = Source::new(folder.path().join("fit.toml"), fit);
    let report = match run_quietly(&source, &folder.path().join("fit"), false) {
        Ok(report) => report,
        Err(error) => panic!("{error}"),
    };
    for (name, value) in [("growth_rate", 37_869.0), ("nucleation", 136_235.0), ("avrami_exponent", 2.678)] {
        let found = report.scalar(&format!("pa12.{name}")).expect(name);
        assert!((found / value - 1.0).abs() < 1e-4, "{name} {found}");
    }
}

/// Raw heat flow of known kinetics, ΔH dα/dt with α of Nakamura's law by Gauss quadrature, over a sloped
/// baseline: enthalpies and constants are recovered, from heat flows in mW (exothermal down) and W/g
/// (exothermal up).
#[test]
fn a_fit_reads_heat_flows() {
    let kinetics = Kinetics::new(KineticConstants::TABLE_4_1_COLUMN_1).expect("constants");
    let folder = tempfile::tempdir().expect("a folder");
    let (enthalpy, mass) = (52e3, 5.2e-6);
    let export = |name: &str, per_minute: f64, heading: &str, scale: f64| {
        let rate = per_minute / 60.0;
        let curve = cooling_curve(&kinetics, rate, 466.35, 400.0, 0.0, 6000);
        // one minute in the melt first
        let mut text =
            format!("time [min],temperature [degC],heat_flow [{heading}]\n0,193.2,{}\n", scale * 20.0);
        for (&temperature, &z) in curve.temperature.iter().zip(&curve.z).skip(1) {
            let time = 60.0 + (466.35 - temperature) / rate;
            let flow = enthalpy * kinetics.degree_slope(z) * kinetics.rate(temperature) + 20.0 + 0.01 * time;
            text += &format!("{},{},{}\n", time / 60.0, temperature - 273.15, scale * flow);
        }
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    for (heading, scale, exothermal, extra) in
        [("mW", -1e3 * mass, "down", ", mass = \"5.2 mg\""), ("W/g", 1e-3, "up", "")]
    {
        export("slow.csv", 2.0, heading, scale);
        export("fast.csv", 10.0, heading, scale);
        let data = |file: &str| {
            format!("{{ file = \"{file}.csv\", from = \"175 degC\", to = \"130 degC\"{extra} }}")
        };
        let text = format!(
            r#"
version = 1
program = "crystfem"

[[fit]]
name = "dsc"
law = "nakamura"
equilibrium_melting = "193.2 degC"
glass_transition = "51 degC"
heat_flow = {{ exothermal = "{exothermal}", latent_heat = "209 J/g" }}
data = [{}, {}]
"#,
            data("slow"),
            data("fast")
        );
        let source = Source::new(folder.path().join("fit.toml"), &text);
        let output = folder.path().join("fit");
        let report = match run_quietly(&source, &output, false) {
            Ok(report) => report,
            Err(error) => panic!("{error}"),
        };
        let is = |name: &str, value: f64, tolerance: f64| {
            let found = report.scalar(&format!("dsc.{name}")).expect(name);
            assert!((found / value - 1.0).abs() < tolerance, "{name} {found}");
        };
        for run in ["run-1", "run-2"] {
            is(&format!("{run}.enthalpy"), 52.0, 1e-4);
            is(&format!("{run}.crystallinity"), 52.0 / 209.0, 1e-4);
        }
        for (name, value) in
            [("growth_rate", 37_869.0), ("nucleation", 136_235.0), ("avrami_exponent", 2.678)]
        {
            is(name, value, 2e-3);
        }
        for file in ["dsc-heat-flow.csv", "dsc-heat-flow.png", "dsc.csv", "dsc.png"] {
            assert!(output.join(file).is_file(), "{file}");
        }
    }
}
