//! Command lines: exit codes, help, closed forms, reports and files.

use crate::program::{command, finish, peri, workspace};
use crate::results::{report, scalar};
use crate::scenes;
use harness::output::vtkhdf;
use std::fs;
use std::path::Path;

#[test]
fn help_of_every_command() {
    let here = workspace();
    peri("", here).with_code(2).tells("Usage: peri");
    let help = peri("--help", here).with_code(0);
    help.shows("Exit codes: 0 done, 1 an expectation or the run failed, 2 bad input, 130 interrupted.");
    let listed = help.stdout.lines().skip_while(|line| !line.starts_with("Commands:")).skip(1);
    let names: Vec<&str> = listed
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    for name in ["run", "resume", "check", "exact", "completions"] {
        assert!(names.contains(&name), "{names:?}");
    }
    for name in names.iter().filter(|&&name| name != "help") {
        peri(&format!("{name} --help"), here).with_code(0).shows(&format!("Usage: peri {name}"));
        peri(&format!("help {name}"), here).with_code(0).shows(&format!("Usage: peri {name}"));
    }
    for name in ["kirsch", "law", "lattice"] {
        peri(&format!("exact {name} --help"), here).with_code(0).shows("Usage: peri exact");
    }
    let ended = finish(command("xtask", "--help", here).spawn().unwrap()).with_code(0);
    ended.shows("Usage: xtask");
}

#[test]
fn version() {
    let ended = peri("--version", workspace()).with_code(0);
    assert_eq!(ended.stdout, format!("peri {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn wrong_usage_is_bad_input() {
    let here = workspace();
    peri("runn", here).with_code(2).tells("similar subcommand exists: 'run'");
    peri("run", here).with_code(2).tells("<SCENE>");
    peri("check a.toml b.toml", here).with_code(2).tells("unexpected argument 'b.toml'");
    peri("run a.toml --ouput b", here).with_code(2).tells("similar argument exists: '--output'");
    for threads in ["0", "-1", "5000", "many"] {
        peri(&format!("exact kirsch --threads={threads}"), here).with_code(2).tells("--threads");
    }
    // negative numbers are values: the message states their range
    peri("exact law --links -5", here).with_code(2).tells("links: found -5");
    peri("run a.toml --checkpoint-every -1", here).with_code(2).tells("-1 is not within 0 to 1e9");
    peri("exact kirsch --threads -1", here).with_code(2).tells("-1 is not in 1..=4096");
    for seconds in ["-1", "nan", "inf", "soon"] {
        let line = format!("run a.toml --checkpoint-every={seconds}");
        peri(&line, here).with_code(2).tells("--checkpoint-every");
    }
}

/// `| head` closes the pipe early, which is no failure and no panic; a full disk is a failure.
#[test]
fn standard_output_that_takes_no_more() {
    let here = workspace();
    for (program, arguments) in [
        ("peri", "schema"),
        ("peri", "exact law"),
        ("peri", "completions bash"),
        ("crystfem", "check cases/ch4/printed-bar/case.toml"),
        ("mdsurrogate", "info cases/ch3/pa12-data/runs.csv.gz"),
        ("polycore", "check cases/ch1/rubber-fits/case.toml"),
    ] {
        let mut child = command(program, arguments, here);
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        finish(child.stdout(writer).spawn().unwrap()).with_code(0);
        #[cfg(target_os = "linux")]
        {
            let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
            let ended = finish(command(program, arguments, here).stdout(full).spawn().unwrap()).with_code(1);
            ended.tells("error: cannot write to standard output: No space left on device");
        }
    }
}

/// Unreadable inputs are bad input, in a scene with their place; misspelled component names are refused.
#[test]
fn inputs_of_mdsurrogate_that_cannot_be_used() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let run = |line: &str| finish(command("mdsurrogate", line, here).spawn().unwrap());
    let scene = "version = 1\nprogram = \"mdsurrogate\"\ntitle = \"none\"\n[data]\nfiles = [\"none.csv\"]\n";
    fs::write(here.join("scene.toml"), scene).unwrap();
    let ended = run("check scene.toml").with_code(2);
    ended.tells("data.files[0]");
    ended.tells("none.csv");
    for line in ["info none.csv", "export none.safetensors out/law", "md run none"] {
        run(line).with_code(2).tells("none");
    }
    let law = "version = 1\nprogram = \"mdsurrogate\"\ntitle = \"law\"\n[data]\nfiles = \
               [\"rows.csv\"]\n[split]\nby = \"random\"\n\
               [training]\nepochs = 1\n[[model]]\nkind = \"energy\"\nhidden = [[4, \"softplus\"]]\n";
    let row = |k: usize| format!("{},1,1,0,0,0,{k},0,0,0,0,0\n", 1.0 + 0.01 * k as f64);
    let head = "C11,C22,C33,C12,C13,C23,S11,S22,S33,S12,S13,S23\n".to_owned();
    fs::write(here.join("rows.csv"), head + &(0..20).map(row).collect::<String>()).unwrap();
    fs::write(here.join("law.toml"), law).unwrap();
    run("run law.toml").with_code(0);
    let ask = "predict out/law/energy.safetensors strains.csv --output answers.csv --tangent";
    fs::write(here.join("strains.csv"), "C11,C22,C33,C21\n1,1,1,0.1\n").unwrap();
    run(ask).with_code(2).tells("column `C21`");
    fs::write(here.join("strains.csv"), "C11,C22,C33\n1,1,1\n1,-1,1\n").unwrap();
    run(ask).with_code(2).tells("point 1 of the list");
    fs::write(here.join("strains.csv"), "C11,C22,C33,C12\n1,1,1,0\n1,1,1,0.3\n").unwrap();
    run(ask).with_code(0).shows("2 predictions, 2 of them flagged");
    let answers = harness::output::csv::read(here.join("answers.csv")).unwrap();
    let column = |name: &str| &answers.iter().find(|(heading, _)| heading == name).unwrap().1;
    // an energy has no stress at rest; C11 = 1 was no training row; there was no shear
    assert_eq!(column("S11 [MPa]")[0], 0.0);
    assert_eq!(*column("never seen"), [0.0, 1.0]);
    assert_eq!(column("tangent 11 22 [MPa]"), column("tangent 22 11 [MPa]"));
    run("export out/law/energy.safetensors new/folder/law").with_code(0);
    assert!(here.join("new/folder/law.c").is_file());
    run("export out/law/energy.safetensors new/").with_code(2).tells("name of the function");
}

#[test]
fn completions() {
    let here = workspace();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let ended = peri(&format!("completions {shell}"), here).with_code(0);
        for word in ["peri", "resume", "checkpoint-every", "explain"] {
            ended.shows(word);
        }
    }
    peri("completions cmd", here).with_code(2).tells("possible values");
}

/// Reads rows of numbers below a heading as [`f64`]; words are left out.
fn row(text: &str, begin: &str) -> Vec<f64> {
    let line = text.lines().find(|line| line.trim_start().starts_with(begin));
    let line = line.unwrap_or_else(|| panic!("no line `{begin}` in\n{text}"));
    let words = line.trim_start()[begin.len()..].split([' ', ',']);
    words.filter_map(|word| word.parse().ok()).collect()
}

#[track_caller]
fn near(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?} for {expected:?}");
    for (f, e) in found.iter().zip(expected) {
        assert!((f - e).abs() <= tolerance, "{found:?} for {expected:?} ± {tolerance}");
    }
}

/// Kirsch (1898): σxx along x = 0 is (2 + a²/y² + 3a⁴/y⁴)/2, which is 3 at the hole.
#[test]
fn kirsch_of_the_textbook() {
    let ended = peri("exact kirsch", workspace()).with_code(0);
    for k in 0..=16 {
        let y = 1.0 + 0.25 * f64::from(k);
        let xx = (2.0 + y.powi(-2) + 3.0 * y.powi(-4)) / 2.0;
        let yy = 1.5 * (y.powi(-2) - y.powi(-4));
        // six printed digits
        near(&row(&ended.stdout, &format!("{y:.2}")), &[xx, yy], 0.5e-6);
    }
    // Heywood's gross factor for the plate of the issue
    ended.shows("peak 3.047");
    peri("exact kirsch --width-ratio 1", workspace()).with_code(2).tells("--width-ratio: found 1");
    peri("exact kirsch --width-ratio nan", workspace()).with_code(2).tells("--width-ratio: found NaN");
}

/// formulation.md, "Dual force, calibration": moduli of the lattice over the continuum's, four digits.
#[test]
#[expect(clippy::approx_constant, reason = "a Poisson ratio of 0.318 happens to be near 1/π")]
fn lattice_moduli_of_the_formulation() {
    let ended = peri("exact lattice", workspace()).with_code(0);
    for (name, moduli) in [
        ("2D volume None", [1.037, 0.990, 1.0486, 1.0017, 0.318, 0.934]),
        ("2D volume Linear", [0.861, 0.867, 0.859, 0.865, 0.336, 1.010]),
    ] {
        near(&row(&ended.stdout, name), &moduli, 0.6e-3);
    }
    // in 3D: E100, ν and Zener's ratio (C44 = C12 there, so that Zener = 2ν'/(1 − ν') needs no third modulus)
    for (name, nu, zener) in [("3D volume None", 0.278, 1.248), ("3D volume Linear", 0.269, 1.165)] {
        let found = row(&ended.stdout, name);
        near(&found[4..], &[nu, zener], 0.6e-3);
    }
    peri("exact lattice --horizon-ratio 0.5", workspace()).with_code(2).tells("--horizon-ratio: found 0.5");
    peri("exact lattice --horizon-ratio 1e6", workspace()).with_code(2).tells("1 to 20");
}

/// formulation.md, "Force law" and "Critical stretch", for n̄ = 720, D̂ = 1200.
#[test]
fn bond_law_of_the_formulation() {
    let ended = peri("exact law --to 2", workspace()).with_code(0);
    near(&row(&ended.stdout, "2.0000")[..1], &[3.017455], 1e-6);
    let tangent = ended.stdout.lines().next().unwrap().rsplit(' ').next().unwrap().parse::<f64>().unwrap();
    near(&[tangent], &[3.007_453_65], 2e-8);
    near(&row(&ended.stdout, "force maximum: λ_b 2.716018, λ̄")[..1], &[2.713_754 * 720_f64.sqrt()], 1e-3);
    for (name, stretch) in
        [("bond-full", 32.20), ("bond-eighth", 11.38), ("chain-full", 5.849), ("chain-eighth", 2.9442)]
    {
        let line = format!("critical stretch of 1.2 √n̄ by {name}:");
        near(&row(&ended.stdout, &line), &[stretch], 5e-3);
    }
    for law in ["chain-offset", "chain-shifted", "chain-affine", "as-published", "linear"] {
        let ended = peri(&format!("exact law --law {law}"), workspace()).with_code(0);
        ended.shows(&format!("law {law}"));
        assert!(!ended.stdout.contains("NaN"), "{}", ended.stdout);
    }
    for (line, told) in [
        ("--links nan", "links: found NaN"),
        ("--links 0.5", "links: found 0.5"),
        ("--dissociation 0", "dissociation"),
        ("--to 1", "--to: found 1; allowed: above 1"),
        ("--to 1e300", "at most 1000"),
        ("--to nan", "--to: found NaN"),
    ] {
        let ended = peri(&format!("exact law {line}"), workspace()).with_code(2);
        ended.tells(told);
        assert_eq!(ended.stdout, "");
    }
}

#[test]
fn check_tells_what_is_built_and_what_is_left_out() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("plate.toml"), scenes::plate("\"20 mm\"", "1e-4")).unwrap();
    let ended = peri("check plate.toml", here).with_code(0);
    ended.shows("variant dx=20mm m=3.015");
    ended.shows(&format!("  builds     {} particles", particles_of_the_plate()));
    ended.shows("one stencil of 28 bonds");
    ended.shows("stress once per variant: hardy, one-point");
    for left_out in ["neighbour lists", "damage and bond breaking", "prescribed displacements"] {
        assert!(left_out_of(&ended.stdout).contains(left_out), "{}", ended.stdout);
    }
    let longest = ended.stdout.lines().map(|line| line.chars().count()).max();
    assert!(longest <= Some(110), "{}", ended.stdout);
    ended.shows("plate.toml: the scene is valid");

    fs::write(here.join("bar.toml"), scenes::bar()).unwrap();
    let ended = peri("check bar.toml", here).with_code(0);
    ended.shows("  builds     320 particles");
    assert!(left_out_of(&ended.stdout).contains("body forces"), "{}", ended.stdout);
    let line = "builds     a crack, (100, 0, 0) – (100, 20, 0) – (100, 0, 40) mm:";
    let severed = row(&ended.stdout, line)[0] as usize;
    // pairs that meet the edge of the crack are on either side of it by rounding
    assert!((pairs_across_the_crack(19)..=pairs_across_the_crack(20)).contains(&severed), "{severed}");
    for built in ["surface correction", "volume correction", "prescribed displacements", "stress"] {
        assert!(!left_out_of(&ended.stdout).contains(built), "{}", ended.stdout);
    }

    fs::write(here.join("strip.toml"), scenes::strip()).unwrap();
    fs::write(here.join("points.csv"), scenes::points()).unwrap();
    let ended = peri("check strip.toml", here).with_code(0);
    ended.shows("  builds     1600 particles");
    ended.shows("a neighbour list");
    assert_eq!(fs::read_dir(here).unwrap().count(), 4, "check writes nothing");
}

/// The list of what `check` leaves out, in one line.
fn left_out_of(text: &str) -> String {
    let mut lines = text.lines().skip_while(|line| !line.starts_with("  leaves out "));
    let first = lines.next().map_or("", |line| &line["  leaves out ".len()..]);
    let more = lines.take_while(|line| line.starts_with("             "));
    more.fold(first.to_owned(), |list, line| list + " " + line.trim())
}

/// Cells of 20 mm in 1 × 1 m whose centres lie outside of the hole of radius 60 mm.
fn particles_of_the_plate() -> usize {
    let centre = |cell: i32| -490.0 + 20.0 * f64::from(cell);
    let cells = (0..50).flat_map(|x| (0..50).map(move |y| (centre(x), centre(y))));
    cells.filter(|(x, y)| x * x + y * y >= 3600.0).count()
}

/// Counts, among the bar's 20 × 4 × 4 cells, 10 mm wide, the pairs within 30.15 mm whose segment meets x =
/// 100 mm at y up to `height` mm.
fn pairs_across_the_crack(height: i32) -> usize {
    let cells = |from: i32, to: i32| {
        (from..to).flat_map(|x| (0..16).map(move |k| [x, k / 4, k % 4].map(|cell| 5 + 10 * cell)))
    };
    let crosses = |(a, b): ([i32; 3], [i32; 3])| {
        let square: i32 = (0..3).map(|d| (b[d] - a[d]).pow(2)).sum();
        // y at x = 100 mm, times the distance along x
        let y = a[1] * (b[0] - a[0]) + (100 - a[0]) * (b[1] - a[1]);
        square <= 909 && y <= height * (b[0] - a[0])
    };
    cells(0, 10).flat_map(|a| cells(10, 20).map(move |b| (a, b))).filter(|&pair| crosses(pair)).count()
}

#[test]
fn report_of_a_small_plate() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let expect = r#"
[[expect]]
quantity = "applied_x"
reference = 10.0
tolerance = "0.001 %"
kind = "closed-form"
source = "1 kPa on 1 m × 10 mm"

[[expect]]
quantity = "hardy_peak"
at_most = 3.0
kind = "bound"
source = "a coarse lattice is below Kirsch's peak"
"#;
    let scene = scenes::plate("\"20 mm\"", "1e-6") + expect;
    fs::write(here.join("plate.toml"), &scene).unwrap();
    let ended = peri("run plate.toml --output out --explain --threads 2 --verbose", here).with_code(0);
    ended.shows("  builds ");
    ended.shows("results in out");
    assert_eq!(ended.stdout.matches("pass  ").count(), 2, "{}", ended.stdout);
    assert_eq!(ended.stderr, "", "no progress bar where nobody looks");

    let out = here.join("out");
    let report = report(&out);
    assert_eq!(report["passed"], true);
    assert_eq!(report["non_finite"], serde_json::json!([]));
    let work = |name: &str| report["work"][name].as_u64().unwrap_or_else(|| panic!("no work `{name}`"));
    assert_eq!(work("particles"), particles_of_the_plate() as u64);
    assert_eq!(work("steps"), 1);
    assert!(work("iterations") > 5 && work("force_evaluations") > work("iterations"));
    assert_eq!(work("bond_evaluations"), work("directed_bonds") * work("force_evaluations"));
    assert!(work("bytes_bonds") <= 200 * work("particles"), "{:#}", report["work"]);
    for phase in ["build", "solve", "stress hardy", "stress one-point"] {
        assert!(report["seconds"][phase].as_f64().unwrap() >= 0.0);
    }
    let provenance = &report["provenance"];
    assert_eq!(provenance["program"], "peri");
    assert_eq!(provenance["version"], env!("CARGO_PKG_VERSION"));
    // as written, with the defaults below it
    assert!(provenance["scene"].as_str().unwrap().starts_with(&scene));
    assert_eq!(provenance["host"]["threads"], 2);
    assert_eq!(report["expect"].as_array().unwrap().len(), 2);
    assert_eq!(report["expect"][0]["pass"], true);
    // 1 kPa on 1 m × 10 mm, to the residual
    near(&[scalar(&report, "applied_x")], &[10.0], 1e-5);
    let columns = report["values"]["profile_hardy"]["columns"].as_array().unwrap();
    assert_eq!(columns[0]["data"].as_array().unwrap().len(), 22, "particles above the hole");

    fields_agree(&out, &report);
    let mut names: Vec<String> =
        fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert!(names.iter().all(|name| !name.starts_with('.') && name != "checkpoint.bin"), "{names:?}");
    let pictures: Vec<&String> = names.iter().filter(|name| name.ends_with(".png")).collect();
    assert!(pictures.len() >= 2, "{names:?}");
    for name in pictures {
        is_a_picture(&out.join(name));
    }
    for name in names.iter().filter(|name| name.ends_with(".csv")) {
        let text = fs::read_to_string(out.join(name)).unwrap();
        assert_eq!(text.lines().count(), 23, "{name}: {text}");
        assert!(!text.contains("NaN") && !text.contains("inf"));
    }
}

/// The field file, read by polycore, agrees with the report.
fn fields_agree(out: &Path, report: &serde_json::Value) {
    let series = vtkhdf::read(out.join("dx-20mm_m-3.015.vtkhdf")).unwrap();
    assert_eq!((series.len(), series.number_of_points()), (1, particles_of_the_plate()));
    for (name, components) in
        [("displacement", 3), ("cauchy_hardy", 9), ("cauchy_one-point", 9), ("piola_hardy", 9)]
    {
        assert!(series.arrays().contains(&(name.to_owned(), components)), "{:?}", series.arrays());
        assert!(series.data(0, name).unwrap().iter().all(|value| value.is_finite()));
    }
    let displacement = series.data(0, "displacement").unwrap();
    let size = |u: &[f64]| u.iter().map(|x| x * x).sum::<f64>().sqrt();
    let largest = displacement.chunks(3).map(size).fold(0.0, f64::max);
    near(&[largest], &[scalar(report, "largest_displacement")], 1e-15);
    // positions are the deformed ones; without their displacement they lie on the lattice
    for (point, u) in series.points(0).unwrap().iter().zip(displacement.chunks(3)) {
        for d in 0..2 {
            let cell = (point[d] - u[d] + 0.49) / 0.02;
            assert!((cell - cell.round()).abs() < 1e-9, "{point:?}");
        }
    }
}

/// A PNG file of the given size with more than one colour: a plain picture compresses to nothing.
fn is_a_picture(path: &Path) {
    let bytes = fs::read(path).unwrap();
    assert!(bytes.starts_with(b"\x89PNG\r\n\x1a\n"), "{}", path.display());
    let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    let (width, height) = (number(16), number(20));
    assert!(width >= 300 && height >= 200, "{}: {width} × {height}", path.display());
    assert!(bytes.len() > 5000, "{}: {} bytes", path.display(), bytes.len());
}

#[test]
fn a_failed_expectation_is_exit_code_1() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let expect = |quantity: &str| {
        let more = format!(
            "\n[[expect]]\nquantity = \"{quantity}\"\nreference = 3.0\ntolerance = \"1 %\"\nkind = \
             \"closed-form\"\nsource = \"wish\"\n"
        );
        scenes::plate("\"50 mm\"", "1e-3") + &more
    };
    fs::write(here.join("plate.toml"), expect("hardy_peak")).unwrap();
    peri("run plate.toml --output out", here).with_code(1).shows("FAIL  hardy_peak");
    let found = report(&here.join("out"));
    assert_eq!((&found["passed"], &found["expect"][0]["pass"]), (&false.into(), &false.into()));

    // a name that no run of the scene can have is refused at once
    fs::write(here.join("plate.toml"), expect("hardy_peek")).unwrap();
    for verb in ["check plate.toml", "run plate.toml --output refused"] {
        peri(verb, here).with_code(2).tells("found `hardy_peek`; allowed: `hardy_peak`");
    }
    assert!(!here.join("refused").exists());

    // one that exists only if bonds break fails if none does
    let whole = expect("first_break").replace("links = 720", "links = 720\ncritical = { stretch = 3.0 }");
    fs::write(here.join("plate.toml"), whole).unwrap();
    let ended = peri("run plate.toml --output out", here).with_code(1);
    ended.shows("the report has no value of that name");
    assert!(report(&here.join("out"))["expect"][0]["value"].is_null());
}

#[test]
fn a_run_that_does_not_converge_leaves_no_report() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let scene = scenes::plate("\"50 mm\"", "1e-6");
    fs::write(here.join("plate.toml"), &scene).unwrap();
    peri("run plate.toml --output out", here).with_code(0);
    let scene = scene.replace("tolerance = 1e-6", "tolerance = 1e-6\nmax_iterations = 5");
    fs::write(here.join("plate.toml"), scene).unwrap();
    let ended = peri("run plate.toml --output out", here).with_code(1);
    ended.tells("not converged after 5 iterations");
    ended.tells("residual");
    ended.tells("needed 1.000e-6");
    // not even that of the previous run
    assert!(!here.join("out/report.json").exists());
}

#[test]
fn default_output_is_named_after_the_scene() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::create_dir(here.join("sheet")).unwrap();
    let scene = scenes::plate("\"50 mm\"", "1e-2") + "\n[output]\npictures = false\nfields = false\n";
    fs::write(here.join("sheet/case.toml"), &scene).unwrap();
    fs::write(here.join("thin.toml"), &scene).unwrap();
    peri("run sheet/case.toml", here).with_code(0).shows("results in out/sheet");
    peri("run thin.toml", here).with_code(0).shows("results in out/thin");
    let files = fs::read_dir(here.join("out/thin")).unwrap();
    let names: Vec<_> = files.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    assert!(names.iter().all(|name| name.ends_with(".csv") || name == "report.json"), "{names:?}");
}

/// Every case of chapter 2 is a valid scene.
#[test]
fn cases_are_valid() {
    let folder = workspace().join("cases/ch2");
    let mut count = 0;
    for case in fs::read_dir(folder).unwrap() {
        let path = case.unwrap().path().join("case.toml");
        peri(&format!("check --quick {}", path.display()), workspace())
            .with_code(0)
            .shows("the scene is valid");
        count += 1;
    }
    assert!(count >= 2);
}
