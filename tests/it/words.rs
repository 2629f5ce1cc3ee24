//! Messages of `crystfem` for mistakes that would pass in silence, and their number.

use crate::browser::Browser;
use crate::parts::BAR;
use crate::program::{Ended, command, finish, peri, workspace};
use std::fs;
use std::path::Path;

fn crystfem(arguments: &str, here: &Path) -> Ended {
    finish(command("crystfem", arguments, here).spawn().unwrap())
}

#[test]
fn slips_are_reported() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let write = |name: &str, text: &str| fs::write(here.join(name), text).unwrap();
    // a quantity that no run reports
    let expect = "\n[[expect]]\nquantity = \"layer-1.min_crystallinity\"\nat_least = 0.2\nkind = \
                  \"bound\"\nsource = \"none\"\n";
    write("expect.toml", &(BAR.to_owned() + expect));
    for verb in ["check", "run"] {
        let ended = crystfem(&format!("{verb} expect.toml"), here).with_code(2);
        ended.tells("`expect[0].quantity`: found `layer-1.min_crystallinity`; allowed: ");
        ended.tells("`layer-1.mean_crystallinity`");
    }
    let studies = "\n[[study]]\nname = \"a\"\n[[study]]\nname = \"b\"\nquick = false\n";
    write("studies.toml", &(BAR.to_owned() + studies + &expect.replace("layer-1.min", "b.layer-1.min")));
    crystfem("check studies.toml", here).with_code(2).tells("`b.layer-1.min_crystallinity`");
    crystfem("check studies.toml --quick", here).with_code(0);
    // kelvins that were meant as degrees
    write("cold.toml", &BAR.replace("ambient = \"100 degC\"", "ambient = \"60 K\""));
    let told = crystfem("check cold.toml", here).with_code(0);
    told.shows("note       `boundary[1].ambient` is 60 K, which is -213.15 °C: is `degC` meant?");
    told.shows("builds     a mesh from (-12, -6, -2) mm to (12, 6, 1.5) mm");
    // a segment that is a jump
    write(
        "point.toml",
        "version = 1\nprogram = \"crystfem\"\n[material]\nlaw = \"semicrystalline\"\ndensity = \"1010 \
         kg/m^3\"\n\
         conductivity = \"0.25 W/(m K)\"\nspecific_heat = \"2200 J/(kg K)\"\nkinetics = \
                          \"table-4.1-column-1\"\n\
         crystallinity = 0.25\n[[point]]\nname = \"p\"\nstart = \"200 degC\"\nlegs = \
             [{ to = \"120 degC\" }]\n",
    );
    crystfem("check point.toml", here)
        .with_code(0)
        .shows("1 segments, 0 s, 1 of them jumps (without `rate` and `duration`)");
    // a key of a sweep without its block
    write("bar.toml", BAR);
    let ended = crystfem("sweep bar.toml --vary layer_time=5s", here).with_code(2);
    ended
        .tells("`--vary layer_time=5s`: unknown key `layer_time`: a key is a path from the top of the scene");
    ended.tells("did you mean `print.layer_time`?");
}

/// A mesh written in millimetres whose unit is not given is metres large.
#[test]
fn a_mesh_without_its_unit() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let mesh = "*NODE\n1, 0, 0, 0\n2, 60, 0, 0\n3, 60, 10, 0\n4, 0, 10, 0\n5, 0, 0, 6\n6, 60, 0, 6\n7, 60, \
                10, 6\n\
                8, 0, 10, 6\n*ELEMENT, TYPE=C3D8, ELSET=part\n1, 1, 2, 3, 4, 5, 6, 7, 8\n";
    fs::write(here.join("part.inp"), mesh).unwrap();
    let scene = |unit: &str, height: &str| {
        let from = BAR.find("[mesh.bar]").unwrap();
        let to = BAR.find("[materials.pa12]").unwrap();
        let text = BAR.replace(&BAR[from..to], &format!("[mesh]\nfile = \"part.inp\"\n{unit}\n"));
        let text = text.replace("elements = \"bar\"", "elements = \"part\"");
        let print = format!("layer_time = \"10 s\"\nelements = \"part\"\nlayer_height = \"{height}\"");
        let text = text
            .replace("layer_time = \"10 s\"", &print)
            .replace("[\"0 mm\", \"0 mm\", \"0.75 mm\"]", "[\"1 mm\", \"1 mm\", \"1 mm\"]");
        fs::write(here.join("part.toml"), text).unwrap();
    };
    scene("", "0.5 mm");
    let ended = crystfem("check part.toml", here).with_code(2);
    ended.tells("missing `mesh.unit`: in metres the part is 60 × 10 × 6 m");
    scene("unit = \"1 mm\"", "6 mm");
    crystfem("check part.toml", here).with_code(0).shows("a mesh from (0, 0, 0) mm to (60, 10, 6) mm");
}

/// The terminal shows a screenful of messages of a run; the file has all.
#[test]
fn few_lines() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let bar = BAR.replace("tolerance = \"1 K\"", "tolerance = \"3 K\"").replace("layers = 3", "layers = 12");
    fs::write(here.join("bar.toml"), bar.replace("layer_time = \"10 s\"", "layer_time = \"5 s\"")).unwrap();
    let short = crystfem("run bar.toml --output out", here).with_code(0);
    assert!(short.stdout.lines().count() <= 25, "{}", short.stdout);
    assert!(short.stdout.lines().all(|line| line.chars().count() <= 100), "{}", short.stdout);
    assert!(!short.stdout.contains('\u{1b}'), "a file has no colours");
    short.shows("results in out: report.json");
    short.shows("view out");
    let ended = crystfem("run bar.toml --output out --verbose", here).with_code(0);
    assert!(ended.stdout.lines().count() < 40, "{}", ended.stdout);
    ended.shows(" more values in report.json");
}

/// The first command of the README, at its coarse spacings: a screen of text, a handful of files.
#[test]
fn the_first_command_fits_a_screen() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let case = workspace().join("cases/ch2/plate-with-hole/case.toml");
    let line = format!("run {} --quick --output out", case.display());
    let ended = peri(&line, here).with_code(0);
    let lines: Vec<&str> = ended.stdout.lines().collect();
    assert!(lines.len() <= 25 && lines.iter().all(|line| line.chars().count() <= 100), "{}", ended.stdout);
    assert_eq!(lines[0], "Plate with a hole");
    for shown in [
        "variant ",
        "hardy_first",
        "dx=4mm m=3.015",
        " expectations met (",
        "results in out: report.json",
        "view out",
    ] {
        ended.shows(shown);
    }
    let files: Vec<u64> =
        fs::read_dir(here.join("out")).unwrap().map(|file| file.unwrap().metadata().unwrap().len()).collect();
    assert!(files.len() <= 12 && files.iter().sum::<u64>() < 20_000_000, "{files:?}");
    peri("view out", here).with_code(0);
    for size in [[1400, 1000], [390, 800]] {
        let Some(browser) = Browser::open(&here.join("out/view.html"), size) else { return };
        browser.wait("document.body.dataset.ready");
        browser.picture(&format!("plate-{}.txt", size[0]));
        assert_eq!(browser.layout_faults(), Vec::<serde_json::Value>::new(), "{size:?}");
        assert_eq!(browser.value("chart.lines.length"), 3, "the curves that the scene lists");
        browser.click("#theme");
        browser.press("#find-value", "force_imb");
        browser.wait("document.querySelectorAll('#scalars tbody tr').length < 5");
        assert_eq!(browser.layout_faults(), Vec::<serde_json::Value>::new(), "{size:?}, dark");
        assert_eq!(browser.complaints(), Vec::<serde_json::Value>::new());
    }
}

/// Values of layers and the expectations of each run in the table of a sweep, which a shorter sweep keeps.
#[test]
fn columns_of_a_sweep() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let expect = "\n[[expect]]\nquantity = \"layer-3.least_crystallinity\"\nat_least = 0.2\nkind = \
                  \"bound\"\nsource = \"none\"\n";
    let bar = BAR
        .replace("tolerance = \"1 K\"", "tolerance = \"3 K\"")
        .replace("end = \"120 s\"", "end = \"30 s\"");
    fs::write(here.join("bar.toml"), bar + expect).unwrap();
    let sweep = |values: &str| {
        let line = format!(
            "sweep bar.toml --vary print.layer_time={values} --column layer-*.mean_crystallinity -o out"
        );
        crystfem(&line, here).with_code(0);
        fs::read_to_string(here.join("out/sweep.csv")).unwrap()
    };
    let rows = sweep("1s,12s");
    let head = rows.lines().next().unwrap();
    assert!(
        head.contains(
            "layer-1.mean_crystallinity,layer-2.mean_crystallinity,layer-3.mean_crystallinity,passed,steps"
        ),
        "{head}"
    );
    // 28 s and 6 s after the third layer
    assert!(rows.contains(",yes,") && rows.contains(",no: layer-3.least_crystallinity,"), "{rows}");
    assert_eq!(sweep("12s"), {
        let lines: Vec<&str> = rows.lines().collect();
        [lines[0], lines[2], lines[1]].map(|line| line.to_owned() + "\n").concat()
    });
    // another scene is another sweep
    let text = fs::read_to_string(here.join("bar.toml")).unwrap();
    fs::write(here.join("bar.toml"), text.replace("film = \"15 W", "film = \"16 W")).unwrap();
    assert_eq!(sweep("12s").lines().count(), 2);
}

/// Bisection by runs: the answer meets the expectations, a hundredth of the interval less does not, and all
/// runs are in the table.
#[test]
fn the_least_value_that_passes() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    // crystals of the whole bar after a time that is sought, without anything printed: one run is a few steps
    let bar = BAR
        .replace("[print]\ntemperature = \"220 degC\"\nlayer_time = \"10 s\"\n", "")
        .replace("1 K\"", "4 K\"");
    let expect =
        "\n[[expect]]\nquantity = \"mean_alpha\"\nat_least = 0.5\nkind = \"bound\"\nsource = \"none\"\n";
    fs::write(here.join("bar.toml"), bar.clone() + expect).unwrap();
    let ended = crystfem("sweep bar.toml --search time.end=5s..105s -o out", here).with_code(0);
    ended.shows(" is the least value that satisfies all expectations; ");
    let line = ended.stdout.lines().find(|line| line.starts_with("time.end = ")).unwrap();
    let numbers: Vec<f64> = line.split([' ', 's']).filter_map(|word| word.parse().ok()).collect();
    assert!(numbers.len() == 2 && numbers[0] > numbers[1] && numbers[0] - numbers[1] <= 1.0 + 1e-9, "{line}");
    let rows = fs::read_to_string(here.join("out/sweep.csv")).unwrap();
    // two ends, and seven halves of 100 s
    assert_eq!(rows.lines().count(), 1 + 2 + 7, "{rows}");
    fs::write(here.join("bar.toml"), bar).unwrap();
    crystfem("sweep bar.toml --search time.end=5s..105s -o none", here)
        .with_code(2)
        .tells("without [[expect]]");
}
