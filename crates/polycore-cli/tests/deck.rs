//! `polycore deck`: cards of a run return as the blocks of its `materials.toml`.

use std::process::{Command, Output};

const SCENE: &str = "version = 1\nprogram = \"polycore\"\n[fit]\nlaws = [\"neo-hookean\"]\n\
                     [[fit.data]]\nname = \"bar\"\nfile = \"bar.csv\"\n";

/// Exact neo-Hookean stress for μ = 0.5 MPa: λ − λ⁻² halved.
const BAR: &str = "stretch,nominal_MPa\n1,0\n2,0.875\n4,1.96875\n";

fn polycore(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_polycore")).args(arguments).output().unwrap()
}

/// Reads the number of a line `key = "NUMBER UNIT"`.
fn value(text: &str, key: &str) -> f64 {
    let line = text.lines().find(|line| line.starts_with(key)).unwrap_or_else(|| panic!("{key}: {text}"));
    line.split('"').nth(1).unwrap().split(' ').next().unwrap().parse().unwrap()
}

/// Cards have ten digits.
#[test]
fn cards_return_as_blocks() {
    let folder = tempfile::tempdir().unwrap();
    let [scene, output, cards] = ["case.toml", "out", "out/materials_mm.inp"]
        .map(|name| folder.path().join(name).display().to_string());
    std::fs::write(&scene, SCENE).unwrap();
    std::fs::write(folder.path().join("bar.csv"), BAR).unwrap();
    assert!(polycore(&["run", &scene, "--output", &output]).status.success());
    let result = polycore(&["deck", &cards]);
    let shown = String::from_utf8_lossy(&result.stdout);
    assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    let blocks = std::fs::read_to_string(folder.path().join("out/materials.toml")).unwrap();
    for key in ["shear_modulus", "bulk_modulus"] {
        let (found, expected) = (value(&shown, key), value(&blocks, key));
        assert!((found / expected - 1.0).abs() < 2e-9, "{key}: {found} {expected}");
    }
}

/// The bulk modulus of a volumetric test, 20 MPa at J = 0.99: 2 GPa, in block, card and deck.
#[test]
fn a_volumetric_test_gives_the_bulk_modulus() {
    let folder = tempfile::tempdir().unwrap();
    let [scene, output, cards] = ["case.toml", "out", "out/materials_mm.inp"]
        .map(|name| folder.path().join(name).display().to_string());
    std::fs::write(&scene, format!("{SCENE}[[volumetric]]\nname = \"bulk\"\nfile = \"bulk.csv\"\n")).unwrap();
    std::fs::write(folder.path().join("bar.csv"), BAR).unwrap();
    std::fs::write(folder.path().join("bulk.csv"), "pressure [MPa],J\n0,1\n20,0.99\n40,0.98\n").unwrap();
    let result = polycore(&["run", &scene, "--output", &output, "--verbose"]);
    let shown = String::from_utf8_lossy(&result.stdout);
    assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    assert!(shown.contains("volumetric bulk: K 2.000000 GPa ± "), "{shown}");
    let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    assert!(read("materials.toml").contains("bulk_modulus = \"2.000000000 GPa\" # volumetric test `bulk`"));
    assert!(read("materials_mm.inp").contains("; K: volumetric test `bulk`"), "{}", read("materials_mm.inp"));
    assert_eq!(read("bulk_volumetric.csv").lines().count(), 4);
    let shown = polycore(&["deck", &cards]);
    assert_eq!(value(&String::from_utf8_lossy(&shown.stdout), "bulk_modulus"), 2.0);
}

/// 20 MPa at J = 0.99: K without `--verbose`, of a scene without fits, too.
#[test]
fn a_run_prints_the_bulk_modulus() {
    let folder = tempfile::tempdir().unwrap();
    let [scene, output] = ["case.toml", "out"].map(|name| folder.path().join(name).display().to_string());
    let text = "version = 1\nprogram = \"polycore\"\n[[volumetric]]\nname = \"bulk\"\nfile = \"bulk.csv\"\n";
    std::fs::write(&scene, text).unwrap();
    std::fs::write(folder.path().join("bulk.csv"), "pressure [MPa],J\n20,0.99\n40,0.98\n").unwrap();
    let shown = polycore(&["run", &scene, "--output", &output]);
    let shown = String::from_utf8_lossy(&shown.stdout);
    assert!(shown.contains("volumetric bulk: K 2.000000 GPa ± "), "{shown}");
}

/// Moduli of long times, a material left out, and one without a law, each in a comment.
#[test]
fn a_deck_says_what_it_leaves_out() {
    let folder = tempfile::tempdir().unwrap();
    let deck = folder.path().join("d.inp");
    let text = "*MATERIAL, NAME=SEAL\n*HYPERELASTIC, MOONEY-RIVLIN, MODULI=INSTANTANEOUS\n0.3, 0.1, 0.01\n\
                *VISCOELASTIC, TIME=PRONY\n0.5, 0.0, 1.0\n*EXPANSION\n1e-4\n*MATERIAL, NAME=PAD\n\
                *HYPERFOAM, N=1, POISSON=0.2\n0.1, 5\n*MATERIAL, NAME=STEEL\n*ELASTIC\n2e5, 0.3\n";
    std::fs::write(&deck, text).unwrap();
    let result = polycore(&["deck", &deck.display().to_string()]);
    let shown = String::from_utf8_lossy(&result.stdout);
    assert!(result.status.success() && shown.matches("[material.solid]\n").count() == 0, "{shown}");
    for part in [
        "# MODULI=INSTANTANEOUS: moduli of long times, 0.500000 times",
        "# *EXPANSION left out",
        "C1 = \"0.1500000000 MPa\"\nC2 = \"0.05000000000 MPa\"",
        "# left out: material `PAD`: line 9: found `*HYPERFOAM, N=1, POISSON=0.2`",
        "# left out: material `STEEL`: line 11: no law of a rubber or foam; it has *ELASTIC",
    ] {
        assert!(shown.contains(part), "{part}: {shown}");
    }
    assert_eq!(shown.matches("[material.solid] #").count(), 1);
}

/// Materials of other programs, in both units, and a law that LS-DYNA does not have.
#[test]
fn materials_of_other_programs() {
    let folder = tempfile::tempdir().unwrap();
    let [scene, output] = ["case.toml", "out"].map(|name| folder.path().join(name).display().to_string());
    let laws =
        "cards = [\"ansys\", \"ls-dyna\", \"febio\", \"moose\"]\nlaws = [\"neo-hookean\", \"arruda-boyce\"]";
    std::fs::write(&scene, SCENE.replace("laws = [\"neo-hookean\"]", laws)).unwrap();
    let law = |l: f64| 0.5 * (l - l.powi(-2)) * (1.0 + 0.02 * (l * l + 2.0 / l - 3.0));
    let rows: String = [1.5, 2.0, 3.0, 4.0].iter().map(|l| format!("{l},{}\n", law(*l))).collect();
    std::fs::write(folder.path().join("bar.csv"), format!("stretch,nominal_MPa\n{rows}")).unwrap();
    let result = polycore(&["run", &scene, "--output", &output]);
    assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    for (name, parts) in [
        ("materials_mm.mac", &["! units mm, N, MPa", "TB,HYPER,1,1,1,NEO", "TB,HYPER,2,1,1,BOYCE"][..]),
        ("materials_si.mac", &["! units m, N, Pa", "100 times the shear modulus"]),
        ("materials_mm.k", &["*MAT_077_H+", "$ LS-DYNA has no law `arruda-boyce`"]),
        ("materials_mm.i", &["type = ComputeNeoHookeanStress", "# MOOSE has no law `arruda-boyce`"]),
        ("materials_si.feb", &["type=\"Mooney-Rivlin\"", "<!-- FEBio has no law `arruda-boyce` -->"]),
    ] {
        let text = read(name);
        assert!(parts.iter().all(|part| text.contains(part)), "{name}: {text}");
    }
    let modulus = |name: &str| -> f64 {
        let text = read(name);
        let line = text.lines().find(|line| line.starts_with("TBDATA,1,")).unwrap().to_owned();
        line.split(',').nth(2).unwrap().parse().unwrap()
    };
    assert!((modulus("materials_si.mac") / modulus("materials_mm.mac") / 1e6 - 1.0).abs() < 1e-6);
}

#[test]
fn files_without_a_law_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("case.toml").display().to_string();
    std::fs::write(&file, SCENE).unwrap();
    let result = polycore(&["deck", &file]);
    assert_eq!(result.status.code(), Some(2));
    let shown = String::from_utf8_lossy(&result.stderr);
    assert!(shown.contains("no `*HYPERELASTIC`"), "{shown}");
}

/// Two terms of a volumetric test: all in the card of a kind that has them, named in that of another.
#[test]
fn terms_of_a_volumetric_test_are_not_dropped() {
    let folder = tempfile::tempdir().unwrap();
    let [scene, output] = ["case.toml", "out"].map(|name| folder.path().join(name).display().to_string());
    let laws = "cards = [\"febio\"]\nlaws = [\"neo-hookean\", \"reduced-polynomial-2\"]";
    let volumetric = "[[volumetric]]\nname = \"bulk\"\nfile = \"bulk.csv\"\nterms = 2\n";
    let text = SCENE.replace("laws = [\"neo-hookean\"]", laws) + volumetric;
    std::fs::write(&scene, text).unwrap();
    let law = |l: f64| 0.5 * (l - l.powi(-2)) * (1.0 + 0.02 * (l * l + 2.0 / l - 3.0));
    let rows: String = [1.5, 2.0, 3.0, 4.0].iter().map(|l| format!("{l},{}\n", law(*l))).collect();
    std::fs::write(folder.path().join("bar.csv"), format!("stretch,nominal_MPa\n{rows}")).unwrap();
    // p = −2 (J − 1)/D₁ − 4 (J − 1)³/D₂
    let pressure = |j: f64| -2.0 * (j - 1.0) / 1e-3 - 4.0 * (j - 1.0).powi(3) / 1e-5;
    let rows: String = [0.99, 0.97, 0.95].iter().map(|j| format!("{},{j}\n", pressure(*j))).collect();
    std::fs::write(folder.path().join("bulk.csv"), format!("pressure [MPa],J\n{rows}")).unwrap();
    let result = polycore(&["run", &scene, "--output", &output]);
    assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    let deck = read("materials_mm.inp");
    assert!(deck.contains("*HYPERELASTIC, REDUCED POLYNOMIAL, N=2"), "{deck}");
    assert!(deck.contains(", 1.000000000e-3, 1.000000000e-5\n"), "{deck}");
    let note = "left out: D2 = 1.000000000e-5; this material has D1 alone";
    assert!(deck.contains(&format!("** {note}\n*MATERIAL, NAME=NEO_HOOKEAN")), "{deck}");
    assert_eq!(read("materials_mm.feb").matches(note).count(), 2);
    assert!(read("materials_si.inp").contains(", 1.000000000e-9, 1.000000000e-11\n"));
    assert!(read("materials.toml").contains("# volumetric test `bulk`, 2/D1 of 2 terms"));
    let cards = folder.path().join("out/materials_mm.inp").display().to_string();
    let result = polycore(&["deck", &cards]);
    let shown = String::from_utf8_lossy(&result.stdout);
    assert!(shown.contains("# D2 = 0.00001 left out: K = 2/D1 is that at rest"), "{shown}");
    assert_eq!(shown.matches("bulk_modulus = \"2.000000000 GPa\"").count(), 2, "{shown}");
}

/// A second term that falls with compression from J = 0.9 on, and one that the test does not determine: a
/// warning in `check`, the run, its report and every card.
#[test]
fn doubtful_volumetric_terms_are_told_everywhere() {
    let folder = tempfile::tempdir().unwrap();
    let [scene, output] = ["case.toml", "out"].map(|name| folder.path().join(name).display().to_string());
    let laws = "cards = [\"ansys\", \"ls-dyna\", \"febio\", \"moose\"]\nlaws = [\"neo-hookean\"]";
    let volumetric = "[[volumetric]]\nname = \"bulk\"\nfile = \"bulk.csv\"\nterms = 2\n";
    std::fs::write(&scene, SCENE.replace("laws = [\"neo-hookean\"]", laws) + volumetric).unwrap();
    std::fs::write(folder.path().join("bar.csv"), BAR).unwrap();
    // p = −2 (J − 1)/D₁ − 4 (J − 1)³/D₂; U″ = 2/D₁ + 12 (J − 1)²/D₂ is 0 at J = 0.9
    let soft = [0.98, 0.95, 0.92, 0.88].map(|j: f64| {
        let pressure = -2.0 * (j - 1.0) / 1e-3 + 4.0 * (j - 1.0).powi(3) / 6e-5;
        (j, pressure)
    });
    let noisy = [(0.998, 4.2), (0.995, 9.8), (0.992, 16.3), (0.99, 19.9)];
    for (states, part) in
        [(soft, "at J below 0.9000"), (noisy, "D2 is not determined: its standard error is 369 % of it")]
    {
        let rows: String = states.iter().map(|(j, pressure)| format!("{pressure},{j}\n")).collect();
        std::fs::write(folder.path().join("bulk.csv"), format!("pressure [MPa],J\n{rows}")).unwrap();
        let checked = polycore(&["check", &scene]);
        let result = polycore(&["run", &scene, "--output", &output]);
        assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
        for shown in [checked, result] {
            let shown = String::from_utf8_lossy(&shown.stdout);
            let shown = shown.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(shown.contains("warning: volumetric bulk: ") && shown.contains(part), "{shown}");
        }
        let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
        for (name, sign) in [
            ("materials.toml", "# "),
            ("materials_mm.inp", "** "),
            ("materials_si.inp", "** "),
            ("materials_mm.mac", "! "),
            ("materials_mm.k", "$ "),
            ("materials_si.feb", "<!-- "),
            ("materials_mm.i", "# "),
        ] {
            let text = read(name);
            let told = |line: &str| line.starts_with(&format!("{sign}warning: ")) && line.contains(part);
            assert!(text.lines().any(told), "{name}: {text}");
        }
        let report = harness::report::Report::read(folder.path().join("out/report.json")).unwrap();
        let scalar = |name: &str| report.scalar(name).unwrap();
        // the term of noise is negative, too
        assert_eq!(scalar("bulk.monotonic"), 0.0);
        let share = scalar("bulk.D2.standard_error") / scalar("bulk.D2").abs();
        assert_eq!(share > 1.0, part.starts_with("D2"), "{share}");
    }
}
