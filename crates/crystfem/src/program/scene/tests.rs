use super::*;

const MATERIAL: &str = r#"
[material]
law = "semicrystalline"
density = "1010 kg/m^3"
conductivity = "0.25 W/(m K)"
specific_heat = "2200 J/(kg K)"
kinetics = "table-4.1-column-1"
melting = "pa12"
crystallinity = 0.25
"#;

const POINT: &str = r#"
[[point]]
name = "a"
start = "200 degC"
legs = [{ to = "120 degC", rate = "1 K/min" }]
"#;

const FIT: &str = r#"
[[fit]]
name = "a"
law = "nakamura"
equilibrium_melting = "193.2 degC"
frozen = "21 degC"
data = [{ file = "a.csv", rate = "1 K/min" }]
"#;

fn head(rest: &str) -> String {
    format!("version = 1\nprogram = \"crystfem\"\n{rest}")
}

/// Returns what `crystfem check` prints for a scene.
fn check_output(text: &str, folder: &std::path::Path) -> String {
    let source = Source::new(folder.join("case.toml"), text);
    let result = crate::program::run::explain(&source, false);
    result.map_or_else(|error| error.to_string(), |lines| lines.join("\n"))
}

fn replaced(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1)
}

#[test]
fn a_good_scene_is_explained() {
    let folder = tempfile::tempdir().unwrap();
    let lines = check_output(&head(&format!("{MATERIAL}{POINT}")), folder.path());
    assert!(lines.contains("material: Semicrystalline, linear heat, melting, no latent heat"), "{lines}");
    assert!(lines.contains("point a: prescribed temperature, 1 segments, 4800 s; adaptive steps"), "{lines}");
    std::fs::write(folder.path().join("a.csv"), "temperature [degC],alpha\n160,0.1\n150,0.5\n").unwrap();
    let lines = check_output(&head(FIT), folder.path());
    let how =
        "separator `,`, decimal point, UTF-8, headings in line 1, columns `temperature [degC]`, `alpha`";
    assert_eq!(
        lines,
        format!("data a.csv: {how}\nfit a: Nakamura, K0, K_G and n from 2 measurements in 1 runs")
    );
}

/// Each error states key, value and allowed values.
#[test]
fn bad_points() {
    let good = head(&format!("{MATERIAL}{POINT}"));
    let legs = "legs = [{ to = \"120 degC\", rate = \"1 K/min\" }]";
    let kinetics = "kinetics = \"table-4.1-column-1\"";
    let given = |rest: &str| {
        format!(
            "kinetics = {{ growth_rate = \"1 1/s\", nucleation = \"1e5 K^2\", avrami_exponent = 2.5, {rest} \
             }}"
        )
    };
    let cases: &[(&str, String, &[&str])] = &[
        ("law = \"semicrystalline\"", "law = \"semicrystaline\"".into(), &["did you mean `semicrystalline`"]),
        ("program = \"crystfem\"", "program = \"peri\"".into(), &["`program`", "crystfem"]),
        ("kinetics = ", "kinetic = ".into(), &["unknown key `kinetic`", "did you mean `kinetics`"]),
        (kinetics, "kinetics = \"table-4.1-column-3\"".into(), &["did you mean `table-4.1-column-"]),
        (kinetics, String::new(), &["`material.kinetics`", "a semicrystalline material needs it"]),
        (kinetics, "kinetics = 3".into(), &["`material.kinetics`", "growth_rate"]),
        (kinetics, given("frozen = \"21 degC\""), &["equilibrium_melting"]),
        (kinetics, given("equilibrium_melting = \"193 degC\""), &["`glass_transition` for T∞ = T_g − 30 K"]),
        (
            kinetics,
            given("equilibrium_melting = \"20 degC\", frozen = \"21 degC\""),
            &["above the temperature of frozen chains"],
        ),
        (
            kinetics,
            given("equilibrium_melting = \"193 degC\", frozen = \"21 degC\", glass_transition = \"51 degC\""),
            &["one of them"],
        ),
        (
            "crystallinity = 0.25",
            "crystallinity = 1.25".into(),
            &["`material.crystallinity`", "1.25", "above 0, up to 1"],
        ),
        (
            "crystallinity = 0.25",
            "crystallinity = 0.25\nlatent_heat = \"209 J\"".into(),
            &["is an energy", "an energy per mass is needed"],
        ),
        (
            "crystallinity = 0.25",
            "crystallinity = 0.25\nlatent_heat = \"-1 J/g\"".into(),
            &["`material.latent_heat`", "0 or above"],
        ),
        (
            "crystallinity = 0.25",
            "crystallinity = 0.25\ninitial_alpha = 1".into(),
            &["`material.initial_alpha`", "below 1"],
        ),
        (
            "crystallinity = 0.25",
            "crystallinity = 0.25\nsign = \"mended\"".into(),
            &["unexpected `material.sign`: it belongs to `law = \"as-published\"`"],
        ),
        (
            "law = \"semicrystalline\"",
            "law = \"conductor\"".into(),
            &["unexpected `material.kinetics`: it belongs to `law = \"semicrystalline\"`"],
        ),
        ("density = \"1010 kg/m^3\"", "density = \"0 kg/m^3\"".into(), &["`material.density`", "above 0"]),
        (
            "\"0.25 W/(m K)\"",
            "\"0.25 W/m^2/K\"".into(),
            &["is a heat transfer coefficient", "a thermal conductivity is needed"],
        ),
        (
            "\"0.25 W/(m K)\"",
            "{ temperature = [\"20 degC\"], value = [] }".into(),
            &["`material.conductivity.value`", "a value for each of the 1"],
        ),
        ("melting = \"pa12\"", "melting = \"pa11\"".into(), &["did you mean `pa12`"]),
        (
            "melting = \"pa12\"",
            "melting = { sharpness = \"1 1/K\", shape = 0.5, peak = \"177 degC\" }".into(),
            &["`material.melting.shape`", "1.001"],
        ),
        ("name = \"a\"", "name = \"a/b\"".into(), &["`point[0].name`", "it names files"]),
        (
            legs,
            String::new(),
            &["missing `point[0].legs`: write one of `legs`, `history`, `exchange`, `adiabatic`"],
        ),
        (legs, format!("{legs}\nadiabatic = true"), &["`point[0].adiabatic` conflicts with `point[0].legs`"]),
        (legs, "adiabatic = true".into(), &["missing `point[0].duration`: `adiabatic` needs it"]),
        (legs, "adiabatic = true\nduration = \"-1 s\"".into(), &["`point[0].duration`", "above 0"]),
        (legs, "history = \"none.csv\"".into(), &["`point[0].start` conflicts with `point[0].history`"]),
        ("start = \"200 degC\"\n", String::new(), &["missing `point[0].start`: `legs` needs it"]),
        ("start = \"200 degC\"", "start = \"-300 degC\"".into(), &["below absolute zero"]),
        (
            legs,
            "legs = [{ to = \"120 degC\", rate = \"-1 K/min\" }]".into(),
            &["`point[0].legs`", "for heating and cooling alike"],
        ),
        (legs, "legs = [{ rate = \"1 K/min\" }]".into(), &["`point[0].legs[0]`", "`hold`, or `to`"]),
        (legs, format!("{legs}\ncycles = 0"), &["`point[0].cycles`", "1 to 100000"]),
        (legs, format!("{legs}\ntime_step = \"0 s\""), &["`point[0].time_step`", "above 0"]),
        (
            legs,
            format!("{legs}\ntime_step = \"1 s\"\nlargest_change = 0.1"),
            &["`point[0].largest_change` conflicts with `point[0].time_step`"],
        ),
        (
            legs,
            format!("{legs}\nmaterials = [\"b\"]"),
            &["unexpected `point[0].materials[0]`: the only material is `[material]`"],
        ),
        (legs, format!("{legs}\n[[compare]]\nmaterial = \"a\"\nwith = \"b\""), &["`compare[0].material`"]),
        ("[material]", "[materials.x]".into(), &["point a"]),
        ("[[point]]", "[[fit]]\nname = \"x\"\n[[point]]".into(), &["`fit` conflicts with `point`"]),
        ("[[point]]", "[[pint]]".into(), &["missing `mesh`: the scene needs a block"]),
    ];
    let folder = tempfile::tempdir().unwrap();
    let mut missed = Vec::new();
    for (from, to, parts) in cases {
        let message = check_output(&replaced(&good, from, to), folder.path());
        if !parts.iter().all(|part| message.contains(part)) {
            missed.push(format!("{to}: {message}"));
        }
    }
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}

#[test]
fn bad_fits() {
    let good = head(FIT);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.csv"), "temperature [degC],alpha\n160,0.1\n150,0.5\n").unwrap();
    std::fs::write(folder.path().join("rising.csv"), "temperature [degC],alpha\n150,0.1\n160,0.5\n").unwrap();
    std::fs::write(folder.path().join("text.csv"), "temperature [degC],alpha\n150,much\n").unwrap();
    let cases: &[(&str, &str, &[&str])] = &[
        ("law = \"nakamura\"", "law = \"nakamora\"", &["did you mean `nakamura`"]),
        ("file = \"a.csv\"", "file = \"none.csv\"", &["`fit[0].data[0].file`: cannot read", "none.csv"]),
        ("file = \"a.csv\"", "file = \"rising.csv\"", &["measurement 2", "decreasing temperatures"]),
        ("file = \"a.csv\"", "file = \"text.csv\"", &["text.csv:2: column 2, `alpha`: found \"much\""]),
        ("rate = \"1 K/min\"", "rate = \"0 K/min\"", &["`fit[0].data[0].rate`", "above 0"]),
        (", rate = \"1 K/min\"", "", &["a.csv:1: headings", "`time [unit]`"]),
        ("frozen = \"21 degC\"", "", &["missing `fit[0].frozen`", "`glass_transition`"]),
        ("frozen = \"21 degC\"", "frozen = \"200 degC\"", &["above the temperature of frozen chains"]),
        (
            "equilibrium_melting = \"193.2 degC\"",
            "",
            &["missing `fit[0].equilibrium_melting`", "Hoffman–Weeks"],
        ),
        (
            "law = \"nakamura\"",
            "law = \"avrami\"",
            &["unexpected `fit[0].equilibrium_melting`: it belongs to `law = \"nakamura\"`"],
        ),
        (
            "law = \"nakamura\"",
            "law = \"nakamura\"\ntemperatures = [\"157 degC\"]",
            &["unexpected `fit[0].temperatures`: it belongs to `law = \"ozawa\"`"],
        ),
        ("data = [{ file = \"a.csv\", rate = \"1 K/min\" }]", "data = []", &["`fit[0].data`", "at least 1"]),
        ("name = \"a\"", "name = \"\"", &["it names files"]),
    ];
    for (from, to, parts) in cases {
        let message = check_output(&replaced(&good, from, to), folder.path());
        assert!(parts.iter().all(|part| message.contains(part)), "{to}: {message}");
    }
    std::fs::write(
        folder.path().join("w.csv"),
        "time [s],temperature [degC],heat_flow [W/g]\n0,170,0\n9,165,1\n18,160,0\n",
    )
    .unwrap();
    let other = "# mW\ntime [s],temperature [degC],heat_flow [mW]\n0,170,0\n9,165,-1\n18,160,0\n";
    std::fs::write(folder.path().join("mw.csv"), other).unwrap();
    std::fs::write(folder.path().join("back.csv"), other.replace("18,", "8,")).unwrap();
    let flow = |file: &str, rest: &str, up: &str| {
        let data = format!("data = [{{ file = \"{file}\", rate = \"1 K/min\"{rest} }}]");
        let flow = format!("heat_flow = {{ exothermal = \"{up}\" }}\n{data}");
        replaced(&good, "data = [{ file = \"a.csv\", rate = \"1 K/min\" }]", &flow)
    };
    let lines = check_output(&flow("w.csv", "", "up"), folder.path());
    assert!(lines.ends_with("3 measurements in 1 runs; peaks of 9.0000 J/g"), "{lines}");
    let lines = check_output(&flow("mw.csv", ", mass = \"2 mg\"", "down"), folder.path());
    assert!(lines.ends_with("; peaks of 4.5000 J/g"), "{lines}");
    let lines = check_output(&flow("w.csv", ", from = \"4.5 s\", to = \"162.5 degC\"", "up"), folder.path());
    assert!(lines.ends_with("; peaks of 2.2500 J/g"), "{lines}");
    let two = flow("w.csv", "", "up");
    let block = two.find("[[fit]]").unwrap();
    let level = flow("w.csv", "", "up").replace("exothermal", "latent_heat = \"0 J/g\", exothermal");
    let cases: &[(String, &[&str])] = &[
        (flow("mw.csv", "", "down"), &["missing `fit[0].data[0].mass`", "mw.csv is a power", "5.2 mg"]),
        (
            flow("w.csv", ", mass = \"2 mg\"", "up"),
            &["unexpected `fit[0].data[0].mass`", "w.csv is already per mass"],
        ),
        (flow("w.csv", ", mass = \"0 mg\"", "up"), &["`fit[0].data[0].mass`", "above 0"]),
        (
            flow("w.csv", "", "down"),
            &["`fit[0].heat_flow.exothermal`", "`down`", "-9.0000e3 J/kg", "wrong way round"],
        ),
        (flow("w.csv", "", "left"), &["`left`", "`up`"]),
        (
            flow("back.csv", ", mass = \"2 mg\"", "down"),
            &["back.csv:5: column `time`", "8 s", "9 s or later"],
        ),
        (flow("a.csv", "", "up"), &["a.csv:1: headings", "`time [unit]`"]),
        (flow("w.csv", ", from = \"20 s\"", "up"), &["`fit[0].data[0].from`", "20 s", "0 to 18 s"]),
        (
            flow("w.csv", ", to = \"150 degC\"", "up"),
            &["`fit[0].data[0].to`", "150.00 degC", "passes on cooling", "160.00 to 170.00"],
        ),
        (flow("w.csv", ", from = \"9 s\", to = \"3 s\"", "up"), &["`fit[0].data[0].to`", "after `from`"]),
        (
            flow("w.csv", ", from = \"9 mm\"", "up"),
            &["found `9 mm`", "a time, e.g. \"90 s\", or a temperature"],
        ),
        (
            flow("w.csv", "", "up").replace("name = \"a\"", "name = \"estimates\""),
            &["`fit[0].name`", "estimates.csv holds all estimates", "a different name"],
        ),
        (
            [two.as_str(), &two[block..].replace("name = \"a\"", "name = \"a-heat-flow\"")].concat(),
            &["`fit[1].name`", "a-heat-flow.csv holds the heat flow of `a`", "a different name"],
        ),
        (level, &["`fit[0].heat_flow.latent_heat`", "above 0"]),
        (
            good.replace("rate =", "mass = \"1 mg\", rate ="),
            &["unexpected `fit[0].data[0].mass`: it belongs to raw heat flow", "`heat_flow` to the fit"],
        ),
        (
            flow("w.csv", "", "up").replace("\"up\"", "\"up\", baseline = \"tangential\""),
            &["1 measurements from", "before the first limit"],
        ),
    ];
    for (text, parts) in cases {
        let message = check_output(text, folder.path());
        assert!(parts.iter().all(|part| message.contains(part)), "{parts:?}: {message}");
    }
    // history of the melt: rows before `from`
    let text = "time [s],temperature [degC],heat_flow [W/g]\n0,200,0\n1,195,0\n9,165,0\n19,165,0\n20,160,0\n\
                    30,150,1\n40,140,0\n";
    std::fs::write(folder.path().join("held.csv"), text).unwrap();
    let held = flow("held.csv", ", from = \"20 s\"", "up").replace(", rate = \"1 K/min\"", "");
    let source = Source::new(folder.path().join("case.toml"), &held);
    let scene: super::FitScene = source.parse().unwrap();
    let (_, peaks) = &scene.jobs(&source).unwrap()[0];
    let times: Vec<f64> = peaks[0].history.iter().map(|row| row[0]).collect();
    assert_eq!(times, [1.0, 9.0, 19.0, 20.0]);
    // two rows for three constants are an error of the fit itself
    let source = Source::new(folder.path().join("case.toml"), good);
    let output = folder.path().join("out");
    let result =
        harness::case::run::<crate::program::run::Crystfem>(&source, harness::case::Options::new(&output));
    let error = result.unwrap_err().to_string();
    assert!(error.contains("`fit[0].data`") && error.contains("2 measurements for 3 parameters"), "{error}");
}

/// An original export of Netzsch Proteus: `##` before the headings, `;`, decimal commas, Latin-1. The peak q
/// = 0.5 W/g e^{−((T − 170 °C)/4 K)²} of a run at 10 K/min over 0.05 W/g has ΔH = √π · 4 K · 0.5 W/g · 6 s/K
/// = 21.2694 J/g.
#[test]
fn an_export_of_netzsch() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "#EXO:1\r\n#DECIMAL:COMMA\r\n#SEPARATOR:SEMICOLON\r\n#SAMPLE MASS /mg:5,21\r\n".to_owned();
    text += "##Temp./°C;Time/min;DSC/(mW/mg)\r\n";
    for row in 0..=600 {
        let celsius = 200.0 - f64::from(row) / 12.0;
        let flow = 0.05 + 0.5 * (-((celsius - 170.0) / 4.0).powi(2)).exp();
        text += &format!("{celsius:.4};{:.5};{flow:.6}\r\n", f64::from(row) / 120.0).replace('.', ",");
    }
    let latin: Vec<u8> = text.chars().map(|c| u8::try_from(c).unwrap()).collect();
    std::fs::write(folder.path().join("proteus.csv"), latin).unwrap();
    let fit = "[[fit]]\nname = \"cool\"\nlaw = \"nakamura\"\nequilibrium_melting = \"193.2 degC\"\n\
        glass_transition = \"51 degC\"\nheat_flow = { exothermal = \"up\" }\n\
        data = [{ file = \"proteus.csv\", rate = \"10 K/min\", from = \"185 degC\", to = \"155 degC\" }]\n";
    let lines = check_output(&head(fit), folder.path());
    assert!(lines.ends_with("; peaks of 21.2694 J/g"), "{lines}");
    assert!(lines.contains("separator `;`, decimal comma, Latin-1, headings in line 5"), "{lines}");
}
