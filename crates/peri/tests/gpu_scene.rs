//! A scene whose steps a graphics card takes, or a program that stands for one: the report of the processor.

use harness::case::{Case, Options, Run};
use harness::scene::Source;
use peri::Error;
use peri::gpu::{Device, Precision};
use peri::program::run::{FinishedScene, Peri};
use peri::program::scene::Scene;

/// A notched plate that is hit beside its notch, and torn.
const SCENE: &str = r#"
version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "1 mm"
shapes = [{ add = "box", min = ["0 mm", "0 mm"], max = ["24 mm", "30 mm"] }]
cracks = [{ from = ["-1 mm", "15 mm"], to = ["9.6 mm", "15 mm"] }]
[material]
youngs_modulus = "191 GPa"
law = "linear"
critical = { stretch = 1.01 }
[[boundary]]
name = "hit"
min = ["0 mm", "15 mm"]
max = ["2 mm", "30 mm"]
displacement = ["0.5 mm", "free"]
[[boundary]]
name = "pushed"
min = ["0 mm", "0 mm"]
max = ["24 mm", "2 mm"]
force = ["0 N", "50 N"]
[solver]
method = "verlet"
[dynamics]
density = "8000 kg/m^3"
end_time = "20 us"
ramp = "20 us"
damping = "1000 1/s"
records = 8
device = "cpu"
[[probe]]
name = "crack"
track = "crack"
axis = "x"
[output]
pictures = false
fields = false
"#;

fn run(name: &str, text: &str) -> Result<FinishedScene, harness::scene::Failure<Error>> {
    let folder = tempfile::tempdir().unwrap();
    let source = Source::new(name, text);
    let scene = source.parse::<Scene>()?;
    let mut own = Run::new(const { &Peri::PROGRAM }, &source, Options::new(folder.path()));
    peri::program::run::run(&source, &scene, &mut own)
}

#[test]
fn gpu_scene_has_the_report_of_the_processor() {
    let host = run("host.toml", SCENE).unwrap();
    let broken = host.report.scalar("broken_bonds").unwrap();
    assert!(broken > 10.0, "{broken} bonds broke");
    let auto = run("auto.toml", &SCENE.replace("\"cpu\"", "\"auto\"")).unwrap();
    let why = auto.outcomes[0].warnings.join("\n");
    assert!(why.contains("directed bonds are too few"), "{why}");
    let Ok(device) = Device::portable() else {
        let error =
            run("gpu.toml", &SCENE.replace("\"cpu\"", "\"gpu\"")).err().map(|error| error.to_string());
        assert!(error.unwrap_or_default().contains("no graphics card"));
        return evidence::skipped("a device behind Vulkan, Metal or DirectX 12");
    };
    for (precision, word) in [(Precision::Double, "double"), (Precision::Single, "single")] {
        if Device::portable().and_then(|device| device.with_precision(precision)).is_err() {
            continue;
        }
        let scene = SCENE.replace("device = \"cpu\"", &format!("device = \"gpu\"\nprecision = \"{word}\""));
        let found = run("gpu.toml", &scene).unwrap();
        let note = found.outcomes[0].warnings.join("\n");
        assert!(note.contains(device.name()) && note.contains(word), "{note}");
        if precision == Precision::Single {
            // a bond at its limit may break a step earlier or later
            for name in ["broken_bonds", "largest_displacement", "work_of_loads"] {
                let [value, expected] = [&found, &host].map(|run| run.outcomes[0].get(name).unwrap());
                assert!((value / expected - 1.0).abs() <= 0.02, "{name}: {value:e} {expected:e}");
            }
            continue;
        }
        compare_reports(&found, &host);
    }
}

/// Compares values, and broken bonds and cracks of each row.
fn compare_reports(found: &FinishedScene, host: &FinishedScene) {
    for (name, expected, _) in &host.outcomes[0].values {
        let value = found.outcomes[0].get(name).unwrap();
        // errors are what rounding leaves
        let bound = if name.ends_with("_error") { 1e-9 } else { 1e-9 * expected.abs().max(1e-12) };
        assert!((value - expected).abs() <= bound, "{name}: {value:e} {expected:e}");
    }
    // rows without a crack have no number
    let crack = |finished: &FinishedScene| {
        let rows = finished.outcomes[0].history.iter();
        format!("{:?}", rows.map(|row| (row.broken, row.seen.clone())).collect::<Vec<_>>())
    };
    assert_eq!(crack(found), crack(host));
}

/// The plate of Kalthoff and Winkler, coarse, with stresses along a line: the card computes them, too.
#[test]
fn gpu_scene_of_kalthoff_and_winkler() {
    if Device::portable().and_then(|device| device.with_precision(Precision::Double)).is_err() {
        return evidence::skipped("a device behind Vulkan, Metal or DirectX 12 in double precision");
    }
    let line = "[stress]\nmeasures = [\"hardy\"]\n[[output.line]]\nname = \"ligament\"\n\
                from = [\"2 mm\", \"0 mm\", \"4 mm\"]\nto = [\"45 mm\", \"0 mm\", \"4 mm\"]\npoints = 30\n";
    let plate = case(
        "external/kalthoff-winkler",
        &[("\ndevice = \"auto\"", "\ndevice = \"cpu\""), ("spacing = \"1.5 mm\"", "spacing = \"4.5 mm\"")],
    );
    let studies = plate.find("\n[[study]]").unwrap();
    let plate = format!("{}\n{line}", &plate[..studies]);
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let [host, found] = std::array::from_fn(|k| {
        let text = plate.replace("\"cpu\"", ["\"cpu\"", "\"gpu\""][k]);
        let source = Source::new("case.toml", text);
        let scene = source.parse::<Scene>().unwrap();
        let mut own = Run::new(const { &Peri::PROGRAM }, &source, Options::new(folders[k].path()));
        peri::program::run::run(&source, &scene, &mut own).unwrap()
    });
    assert!(host.outcomes[0].get("broken_bonds").unwrap() > 1000.0);
    compare_reports(&found, &host);
    let [host, found] = folders.map(|folder| {
        let files = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
        let file = files.into_iter().find(|path| path.to_string_lossy().contains("line_")).unwrap();
        let text = std::fs::read_to_string(file).unwrap();
        text.lines().skip(1).flat_map(|row| row.split(',')).map(|x| x.parse().unwrap()).collect::<Vec<f64>>()
    });
    let most = host.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    assert!(most > 1e7 && host.len() == found.len(), "{most:e}");
    for (found, host) in found.iter().zip(&host) {
        assert!((found - host).abs() <= 1e-9 * most, "{found:e} {host:e}");
    }
}

/// A notched plate that is torn between equilibria.
const TORN: &str = r#"
version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "1 mm"
shapes = [{ add = "box", min = ["0 mm", "0 mm"], max = ["24 mm", "30 mm"] }]
cracks = [{ from = ["-1 mm", "15 mm"], to = ["9.6 mm", "15 mm"] }]
[material]
youngs_modulus = "191 GPa"
law = "linear"
critical = { stretch = 1.02 }
[[boundary]]
name = "pulled"
min = ["0 mm", "27 mm"]
max = ["24 mm", "30 mm"]
displacement = ["0 mm", "0.25 mm"]
[[boundary]]
name = "fixed"
min = ["0 mm", "0 mm"]
max = ["24 mm", "3 mm"]
displacement = ["0 mm", "0 mm"]
[solver]
method = "adr"
steps = 8
device = "cpu"
[output]
pictures = false
fields = false
"#;

/// Compares the report of a scene with `device = "cpu"` with that on the device of this machine, in both
/// precisions.
fn compare_equilibria(text: &str, allowed: f64) {
    let host = run("host.toml", text).unwrap();
    if Device::portable().is_err() {
        return evidence::skipped("a device behind Vulkan, Metal or DirectX 12");
    }
    for (precision, word) in [(Precision::Double, "double"), (Precision::Single, "single")] {
        if Device::portable().and_then(|device| device.with_precision(precision)).is_err() {
            continue;
        }
        let scene = text.replace("device = \"cpu\"", &format!("device = \"gpu\"\nprecision = \"{word}\""));
        let found = run("gpu.toml", &scene).unwrap();
        for (found, host) in found.outcomes.iter().zip(&host.outcomes) {
            let note = found.warnings.join("\n");
            assert!(note.contains("equilibria on") && note.contains(word), "{note}");
            for name in ["largest_displacement", "work_of_loads", "broken_bonds"] {
                let [value, expected] = [found, host].map(|outcome| outcome.get(name).unwrap_or(0.0));
                let bound = match precision {
                    Precision::Double => allowed,
                    Precision::Single => 0.02,
                };
                eprintln!("{word}, {name}: {value:e} {expected:e}");
                let apart = (value - expected).abs();
                assert!(apart <= bound * expected.abs(), "{word}, {name}: {value:e} {expected:e}");
            }
            assert!(host.get("work_of_loads").unwrap() > 0.0);
        }
    }
}

/// Expectations are judged alike, and pictures, tables and fields are the same files, pictures to the bit.
#[test]
fn gpu_scene_draws_and_judges_as_the_processor() {
    if Device::portable().and_then(|device| device.with_precision(Precision::Double)).is_err() {
        return evidence::skipped("a device behind Vulkan, Metal or DirectX 12 in double precision");
    }
    let expect = |quantity: &str, bound: &str| {
        format!("[[expect]]\nquantity = \"{quantity}\"\n{bound}\nkind = \"bound\"\nsource = \"test\"\n")
    };
    let scene = SCENE.replace("pictures = false\nfields = false", "every = 4")
        + &expect("broken_bonds", "at_least = 10")
        + &expect("energy_error", "at_most = 0.01")
        + &expect("crack_speed", "at_least = 1e6");
    let drawn = |device: &str| {
        let folder = tempfile::tempdir().unwrap();
        let source = Source::new("case.toml", scene.replace("\"cpu\"", device));
        let scene = source.parse::<Scene>().unwrap();
        let mut own = Run::new(const { &Peri::PROGRAM }, &source, Options::new(folder.path()));
        let finished = peri::program::run::run(&source, &scene, &mut own).unwrap();
        let judged: Vec<bool> = finished.report.expect.iter().map(|one| one.pass).collect();
        let files = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
        let mut files: Vec<_> = files.collect();
        files.sort();
        let named = |path: std::path::PathBuf| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            let picture = if name.ends_with(".png") { std::fs::read(&path).unwrap() } else { Vec::new() };
            (name, picture)
        };
        (judged, files.into_iter().map(named).collect::<Vec<_>>())
    };
    let (host, card) = (drawn("\"cpu\""), drawn("\"gpu\""));
    assert_eq!((&host.0[..], &card.0[..]), (&[true, true, false][..], &[true, true, false][..]));
    let names = |files: &[(String, Vec<u8>)]| files.iter().map(|file| file.0.clone()).collect::<Vec<_>>();
    assert_eq!(names(&host.1), names(&card.1));
    assert!(names(&host.1).iter().filter(|name| name.ends_with(".png")).count() >= 2, "{:?}", names(&host.1));
    for ((name, host), (_, card)) in host.1.iter().zip(&card.1) {
        assert!(host == card, "{name} differs");
    }
}

/// The scene of a case with lines replaced, without expectations.
fn case(name: &str, lines: &[(&str, &str)]) -> String {
    let path = format!("{}/../../cases/{name}/case.toml", env!("CARGO_MANIFEST_DIR"));
    let mut text = std::fs::read_to_string(path).unwrap();
    for (old, new) in lines {
        assert!(text.contains(old), "{old}");
        text = text.replace(old, new);
    }
    // expectations are those of other spacings
    let end = text.find("\n[[expect]]").unwrap_or(text.len());
    text.truncate(end);
    text
}

/// Bars in tension, coarse, without and with a surface correction, by L-BFGS.
#[test]
fn gpu_scene_of_bars_in_tension() {
    let bar = case(
        "ch2/bar-in-tension",
        &[
            ("tolerance = 1e-6", "tolerance = 1e-6\ndevice = \"cpu\""),
            (
                "spacing = [\"20 mm\", \"10 mm\"]\nsurface_correction = [\"none\", \"energy\"]",
                "spacing = [\"20 mm\"]\nsurface_correction = [\"none\", \"energy\"]",
            ),
        ],
    );
    let others = bar.find("[[study]]\nspacing = [\"10 mm\"]").unwrap();
    // the balance is 1e-6 of the load, by different iterations
    compare_equilibria(&bar[..others], 1e-5);
}

/// The sheet of mode I, coarse and to its first steps, by L-BFGS and by relaxation.
#[test]
fn gpu_scene_of_mode_one() {
    for (method, allowed) in [("adr", 1e-9), ("lbfgs", 1e-4)] {
        let solver = format!("method = \"{method}\"\ndevice = \"cpu\"\nsteps = 2");
        let sheet = case(
            "ch2/mode-1",
            &[
                ("steps = 100 ", &solver),
                ("\"-100 mm\"", "\"-20 mm\""),
                ("\"100 mm\"", "\"20 mm\""),
                ("spacing = [\"4 mm\"]", "spacing = [\"8 mm\"]"),
                ("thickness = \"2 mm\"\nspacing = \"2 mm\"", "thickness = \"2 mm\"\nspacing = \"8 mm\""),
            ],
        );
        let others = sheet.find("# voids of 3Δx").unwrap();
        compare_equilibria(&sheet[..others], allowed);
    }
}

#[test]
fn gpu_scene_of_equilibria_has_the_report_of_the_processor() {
    let auto = run("auto.toml", &TORN.replace("\"cpu\"", "\"auto\"")).unwrap();
    let why = auto.outcomes[0].warnings.join("\n");
    assert!(why.contains("directed bonds are too few"), "{why}");
    compare_equilibria(TORN, 1e-9);
    // a stiffer and tougher part, with a surface correction
    let law = r#"law = "linear"
surface_correction = "energy"
inclusions = [{ shape = { add = "disk", centre = ["16 mm", "16 mm"], radius = "4 mm" }, stiffness = 3 }]"#;
    compare_equilibria(&TORN.replace("law = \"linear\"", law), 1e-9);
}
