//! Laws that are no materials: what a run says on the terminal, in blocks and in the cards of all programs.

use std::path::Path;
use std::process::Command;

const CARDS: &str = "cards = [\"ansys\", \"ls-dyna\", \"febio\", \"moose\"]";

/// Runs a scene with these settings, `[[fit.data]]` and table; returns its output.
fn run(folder: &Path, settings: &str, data: &str, table: &str) -> String {
    let scene = folder.join("case.toml");
    let text = format!("version = 1\nprogram = \"polycore\"\n[fit]\n{CARDS}\n{settings}\n{data}");
    std::fs::write(&scene, text).unwrap();
    std::fs::write(folder.join("t.csv"), table).unwrap();
    polycore(folder, &["run", "case.toml", "--quick", "--output", "out"])
}

fn polycore(folder: &Path, arguments: &[&str]) -> String {
    let command = Command::new(env!("CARGO_BIN_EXE_polycore")).args(arguments).current_dir(folder).output();
    let result = command.unwrap();
    let shown = String::from_utf8_lossy(&result.stdout).into_owned();
    assert!(result.status.success(), "{shown}{}", String::from_utf8_lossy(&result.stderr));
    shown
}

/// Text in one line.
fn plain(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Cards in N, mm: file, start of a material, start of a comment.
const FILES: [(&str, &str, &str); 5] = [
    ("materials_mm.inp", "*MATERIAL", "** "),
    ("materials_mm.mac", "TB,HYPER", "! "),
    ("materials_mm.k", "*MAT_", "$ "),
    ("materials_mm.feb", "<material", "<!-- "),
    ("materials_mm.i", "[Materials]", "# "),
];

fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join("out").join(name)).unwrap()
}

/// In simple shear I₁ = I₂: it determines sums of the five constants alone.
#[test]
fn a_law_that_the_data_do_not_determine() {
    let folder = tempfile::tempdir().unwrap();
    let law = |g: f64| g * (0.6 - 0.04 * g * g + 0.006 * g.powi(4));
    let rows: String = (1..=12).map(|k| f64::from(k) / 6.0).map(|g| format!("{g},{}\n", law(g))).collect();
    let data = "[[fit.data]]\nname = \"shear\"\nfile = \"t.csv\"\n";
    let table = format!("shear strain,shear stress [MPa]\n{rows}");
    let shown = plain(&run(folder.path(), "laws = [\"polynomial-2\"]", data, &table));
    assert!(shown.contains("warning: shear: no block, no card of polynomial-2 (parameters not determined)"));
    assert!(
        shown.contains("shear: no block for a scene of peri") && !shown.contains("for a scene of peri, from")
    );
    assert!(!read(folder.path(), "materials.toml").contains("[material.solid]"));
    for (file, material, comment) in FILES {
        let text = read(folder.path(), file);
        let why = format!("{comment}no card of polynomial-2 on shear: the data do not determine C10, C01, ");
        assert!(text.contains(&why) && !text.contains(material), "{file}: {text}");
    }
    // the same tests determine the law of I₁, 2 (C₁ + 2C₂ γ² + 3C₃ γ⁴) γ
    let shown = run(folder.path(), "laws = [\"yeoh\"]", data, &table);
    assert!(shown.contains("C1 = \"0.3000000000 MPa\"") && !shown.contains("warning"), "{shown}");
}

/// Yeoh's law of C = 1, −0.2, 0.015 MPa loses ellipticity in pure shear (`stability`): waves of ρc² < 0.
#[test]
fn a_law_that_is_not_elliptic() {
    let folder = tempfile::tempdir().unwrap();
    let slope = |x: f64| 1.0 - 0.4 * x + 0.045 * x * x;
    let rows: String = (4..=18)
        .map(|k| 1.0 + 0.05 * f64::from(k))
        .map(|l| format!("{l},{}\n", 2.0 * slope(l * l + l.powi(-2) - 2.0) * (l - l.powi(-3))))
        .collect();
    let data = "[[fit.data]]\nname = \"strip\"\nfile = \"t.csv\"\n";
    let shown =
        run(folder.path(), "laws = [\"yeoh\"]", data, &format!("stretch,planar stress [MPa]\n{rows}"));
    let told = plain(&shown);
    assert!(
        told.contains("warning: strip: yeoh is not elliptic at ") && told.contains(" of 15 states"),
        "{told}"
    );
    assert!(!told.contains("for a scene of peri, from"), "{told}");
    let blocks = read(folder.path(), "materials.toml");
    assert!(
        blocks.contains("no block, not elliptic at ") && !blocks.contains("[material.solid]"),
        "{blocks}"
    );
    for (file, material, comment) in &FILES[..4] {
        let text = read(folder.path(), file);
        let warned = |what: &str| {
            let line = format!("{comment}warning: {what}");
            text.lines().any(|found| found.starts_with(&line))
        };
        assert!(warned("not elliptic at ") && warned("unstable in ") && text.contains(material), "{text}");
    }
}

/// In pure shear I₁ = I₂: two measurements, as many as parameters, determine C₁ + C₂ alone. Two of a bar
/// determine both.
#[test]
fn as_many_measurements_as_parameters() {
    let folder = tempfile::tempdir().unwrap();
    let data = "[[fit.data]]\nname = \"strip\"\nfile = \"t.csv\"\n";
    let table = "stretch,planar stress [MPa]\n1.5,0.7222\n2,1.126\n";
    let shown = plain(&run(folder.path(), "laws = [\"mooney-rivlin\"]", data, table));
    assert!(shown.contains("strip: test: pure-shear, as the headings say"), "{shown}");
    assert!(shown.contains("warning: strip: no block, no card of mooney-rivlin"), "{shown}");
    let why = "the data do not determine C1, C2, other values fit as well";
    assert!(read(folder.path(), "materials_mm.inp").contains(why));
    let law = |l: f64| 2.0 * (0.3 + 0.1 / l) * (l - l.powi(-2));
    let table = format!("stretch,tensile stress [MPa]\n1.5,{}\n2,{}\n", law(1.5), law(2.0));
    let shown = plain(&run(folder.path(), "laws = [\"mooney-rivlin\"]", data, &table));
    assert!(shown.contains("C1 = \"0.3000000000 MPa\"") && !shown.contains("warning"), "{shown}");
}

/// Strains of 1e-4 say nothing of the exponent of Ogden's law, which has no limit to be at.
#[test]
fn an_exponent_without_effect() {
    let folder = tempfile::tempdir().unwrap();
    let data = "[[fit.data]]\nname = \"bar\"\nfile = \"t.csv\"\n";
    let rows: String = (1..=6)
        .map(|k| 1.0 + 1e-5 * f64::from(k))
        .map(|l| format!("{l},{}\n", 0.4 * (l - l.powi(-2))))
        .collect();
    run(folder.path(), "laws = [\"ogden-1\"]", data, &format!("stretch,tensile stress [MPa]\n{rows}"));
    let text = read(folder.path(), "materials_mm.inp");
    assert!(
        text.contains("the data do not determine alpha") && text.contains("use a law with fewer"),
        "{text}"
    );
    assert!(!text.contains("infinite"), "{text}");
}

/// Rows after the break of a specimen are left out with a warning.
#[test]
fn rows_that_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let table = "stretch,nominal_MPa\n1.5,0.4\n2,0.6\n2.5,0.8\n2.6,0.1\n";
    let data = "[[fit.data]]\nname = \"bar\"\nfile = \"t.csv\"\n";
    let shown = plain(&run(folder.path(), "laws = [\"neo-hookean\"]", data, table));
    assert!(shown.contains("warning: bar: 1 row after the largest stress left out"), "{shown}");
}

/// Names of a law on two tables tell the cards of each program apart, and the blocks that return from them.
/// Exact data: μ = 0.5 and 0.3 MPa.
#[test]
fn materials_have_names_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let rows = |mode: &str, modulus: f64, of: fn(f64) -> f64| -> String {
        let each = [1.3, 1.6, 2.0].map(|l| format!("{mode},{l},{}\n", modulus * of(l)));
        each.concat()
    };
    let bar = rows("uniaxial", 0.5, |l| l - l.powi(-2));
    let sheet = rows("equibiaxial", 0.3, |l| l - l.powi(-5));
    let data = "[[fit.data]]\nname = \"bar-1\"\nfile = \"t.csv\"\nmode = \"uniaxial\"\n\
                [[fit.data]]\nname = \"bar_1\"\nfile = \"t.csv\"\nmode = \"equibiaxial\"\n";
    run(folder.path(), "laws = [\"neo-hookean\"]", data, &format!("mode,stretch,nominal_MPa\n{bar}{sheet}"));
    let names: Vec<String> = read(folder.path(), "materials_mm.inp")
        .lines()
        .filter_map(|line| Some(line.strip_prefix("*MATERIAL, NAME=")?.to_owned()))
        .collect();
    assert_eq!(names, ["NEO_HOOKEAN_BAR_1", "NEO_HOOKEAN_BAR_1_2"]);
    for (file, titles) in [
        ("materials_mm.inp", ["NEO_HOOKEAN_BAR_1", "NEO_HOOKEAN_BAR_1_2"]),
        (
            "materials_mm.mac",
            ["material 1, neo-hookean fitted to bar-1", "material 2, neo-hookean fitted to bar_1"],
        ),
        (
            "materials_mm.k",
            ["material 1, neo-hookean fitted to bar-1", "material 2, neo-hookean fitted to bar_1"],
        ),
        ("materials_mm.feb", ["material neo_hookean_bar_1", "material neo_hookean_bar_1_2"]),
        (
            "materials_mm.i",
            ["material 1, neo-hookean fitted to bar-1", "material 2, neo-hookean fitted to bar_1"],
        ),
    ] {
        let shown = polycore(folder.path(), &["deck", &format!("out/{file}")]);
        let blocks: Vec<&str> = shown.split("[material.solid] # ").skip(1).collect();
        assert_eq!(blocks.len(), 2, "{file}: {shown}");
        for (block, (title, modulus)) in blocks.iter().zip(titles.into_iter().zip([0.5, 0.3])) {
            assert_eq!(block.lines().next(), Some(title), "{file}");
            let number = |key: &str| -> f64 {
                let line = block.lines().find(|line| line.starts_with(key)).unwrap();
                line.split('"').nth(1).unwrap().split(' ').next().unwrap().parse().unwrap()
            };
            assert!((number("shear_modulus") / modulus - 1.0).abs() < 1e-8, "{file}: {block}");
            assert!((number("bulk_modulus") / (100.0 * modulus) - 1.0).abs() < 1e-8, "{file}: {block}");
        }
    }
}
