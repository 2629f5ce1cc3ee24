//! Scenes of the material alone, and fits, from their text to their report.

use crystfem::run::{Crystfem, Failure};
use polycore::case::Options;
use polycore::report::Report;
use polycore::scene::Source;
use std::path::Path;

fn run_quietly(source: &Source, output: &Path, quick: bool) -> Result<Report, Failure> {
    let options = Options { quick, ..Options::new(output) };
    polycore::case::run::<Crystfem>(source, options).map(|finished| finished.report)
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
    // 1 K/min from the table of the history; some melts at 172 °C
    let at = |name: &str| report.scalar(name).expect(name);
    assert!((at("slow.temperature_at_0.5") - 162.05).abs() < 0.02);
    assert!(at("cooling.highest_alpha") > 0.999 && at("cooling.final_alpha") < 0.9);
    assert!((at("cooling.final_crystallinity") - 0.25 * at("cooling.final_alpha")).abs() < 1e-15);
    let quick = run_in(folder.path(), SCENE, true);
    assert!(quick.scalar("slow.final_alpha").is_none() && quick.passed());
}

/// The curve that one scene writes is what another one fits.
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
    // up to the hold: the fit knows no melting
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
