//! The page that `view` writes: its content, and that a browser shows it without a network.

use crate::browser::Browser;
use crate::parts::BAR;
use crate::program::{Ended, command, finish, peri};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A notched sheet of 20 × 30 particles that tears, in 30 steps.
const SHEET: &str = r#"version = 1
program = "peri"

[body]
space = "plane-stress"
thickness = "3 mm"
spacing = "4 mm"
shapes = [{ add = "box", min = ["-40 mm", "-60 mm"], max = ["40 mm", "60 mm"] }]
cracks = [{ from = ["-41 mm", "0 mm"], to = ["0 mm", "0 mm"] }]

[material]
youngs_modulus = "0.6 MPa"
law = "chain-offset"
links = 720
dissociation = 1200
critical = { stretch = 2.0 }

[[boundary]]
side = "y-"
layers = 3
displacement = ["0 mm", "-60 mm"]

[[boundary]]
side = "y+"
layers = 3
displacement = ["0 mm", "60 mm"]

[solver]
steps = 30

[stress]
measures = ["hardy"]

[output]
every = 2
pictures = false
"#;

/// Largest size of a page, bytes: longer ones load slowly and cannot be mailed.
const LARGEST_PAGE: usize = 5_000_000;

fn run(program: &str, arguments: &str, here: &Path) -> Ended {
    finish(command(program, arguments, here).spawn().unwrap())
}

/// Returns the data of a page.
fn page_data(page: &str) -> Value {
    let (_, rest) = page.split_once("<script type=\"application/json\" id=\"run\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

/// Values of the data that the page shows.
fn shown_values(browser: &Browser, name: &str) -> String {
    browser.value(&format!("document.body.dataset.{name} ?? ''")).as_str().unwrap().to_owned()
}

/// Selects an entry of a list by its beginning, as a user does.
fn choose(browser: &Browser, id: &str, entry: &str) {
    let set = format!(
        "(() => {{ const list = document.getElementById('{id}'); \
         list.selectedIndex = [...list.options].findIndex((option) => option.text.startsWith('{entry}')); \
         list.dispatchEvent(new Event('change')); return list.selectedIndex; }})()"
    );
    assert!(browser.value(&set).as_i64().unwrap() >= 0, "no {entry} in {id}");
}

/// The page of a run that tears: rendered, rotated, cut, stepped by slider, key, click and play, by mouse and
/// by fingers.
#[test]
fn a_sheet_that_tears() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("sheet.toml"), SHEET).unwrap();
    peri("run sheet.toml --output out", here).with_code(0);
    let ended = peri("view out", here).with_code(0);
    ended.shows("view.html: open it in a browser");
    let page = fs::read_to_string(here.join("out/view.html")).unwrap();
    assert!(page.len() < LARGEST_PAGE, "{} characters", page.len());
    let told = page_data(&page);
    let body = &told["bodies"][0];
    let frames = body["frames"].as_array().unwrap();
    assert!(frames.len() >= 15 && body["cells"][0]["kind"] == 9, "{body:#}");
    assert_eq!(body["notes"], serde_json::json!([]), "nothing of so small a run is left out");
    // the crack is open: cells on both sides of it share no corners, and it has grown
    let (cells, points) = (20 * 30, body["points"][0]["count"].as_u64().unwrap());
    assert_eq!(body["cells"][0]["low"]["count"], cells);
    assert!((21 * 31 + 9..21 * 31 + 60).contains(&points), "{points} corners");

    let Some(browser) = Browser::open(&here.join("out/view.html"), [1400, 1000]) else { return };
    browser.wait("document.body.dataset.ready");
    assert_eq!(shown_values(&browser, "step"), (frames.len() - 1).to_string(), "it begins at the end");
    assert_eq!(shown_values(&browser, "triangles"), (2 * cells).to_string());
    browser.picture("sheet-end.txt");
    // the first step by key; the marker on the curve follows
    let last = shown_values(&browser, "mark");
    browser.press("#step", "\u{e011}");
    browser.wait("document.body.dataset.step === '0'");
    assert_ne!(shown_values(&browser, "mark"), last);
    browser.press("#step", "\u{e014}\u{e014}");
    browser.wait("document.body.dataset.step === '2'");
    let moment = browser.value("document.getElementById('moment').textContent");
    assert!(moment.as_str().unwrap().contains("displacement"), "{moment}");
    // the marker lies on the row of its step: the displacement of the frame
    let mark: Value = serde_json::from_str(&shown_values(&browser, "mark")).unwrap();
    let displacement = 1e3 * frames[2]["displacement"].as_f64().unwrap();
    assert!((mark[0][0].as_f64().unwrap() - displacement).abs() < 1e-2, "{mark} {displacement} mm");
    // a click on the peak of the curve
    let place = |browser: &Browser, row: usize| -> [f64; 2] {
        let at = browser.value(&format!(
            "(() => {{ chart.element.scrollIntoView({{ block: 'center' }}); \
             const box = chart.element.getBoundingClientRect(), line = chart.lines[0]; \
             return [box.left + chart.place.x(line.x[{row}]), box.top + chart.place.y(line.y[{row}])]; }})()"
        ));
        [0, 1].map(|k| at[k].as_f64().unwrap())
    };
    let there = place(&browser, 19);
    browser.drag("mouse", &[[there, there]]);
    browser.wait("document.body.dataset.step !== '2'");
    let step: usize = shown_values(&browser, "step").parse().unwrap();
    assert!((frames[step]["time"].as_f64().unwrap() - 20.0).abs() <= 1.0, "step {step}");
    // colours
    let ends = |browser: &Browser| [shown_values(browser, "low"), shown_values(browser, "high")];
    let damage = ends(&browser);
    choose(&browser, "fields", "cauchy_hardy 22");
    browser.wait(&format!("document.body.dataset.high !== '{}'", damage[1]));
    let whole = ends(&browser);
    browser.click("#more summary");
    browser.click("#own-range");
    browser.wait(&format!("document.body.dataset.high !== '{}'", whole[1]));
    // moved by the mouse and by a finger, and two fingers for nearer: a plane body stays in its plane
    let eye = "JSON.stringify(stage.centre)";
    let size = "stage.zoom";
    let before = browser.value(eye);
    let middle = browser.value(
        "(() => { stage.element.scrollIntoView({ block: 'center' }); const box = \
         stage.element.getBoundingClientRect(); \
         return [box.left + box.width / 2, box.top + box.height / 2]; })()",
    );
    let [x, y] = [0, 1].map(|k| middle[k].as_f64().unwrap());
    browser.drag("mouse", &[[[x, y], [x + 120.0, y + 60.0]]]);
    browser.wait(&format!("{eye} !== '{}'", before.as_str().unwrap()));
    browser.picture("sheet-moved.txt");
    let moved = browser.value(eye);
    browser.drag("touch", &[[[x, y], [x - 90.0, y - 80.0]]]);
    browser.wait(&format!("{eye} !== '{}'", moved.as_str().unwrap()));
    let near = browser.value(size).as_f64().unwrap();
    browser.drag("touch", &[[[x - 20.0, y], [x - 140.0, y]], [[x + 20.0, y], [x + 140.0, y]]]);
    browser.wait(&format!("{size} > {}", 1.5 * near));
    // play to the end; its button shows that it stopped
    browser.press("#step", "\u{e011}");
    browser.wait("document.body.dataset.step === '0'");
    browser.click("#play");
    browser.wait(&format!("document.body.dataset.step === '{}'", frames.len() - 1));
    browser.wait("document.getElementById('play').textContent === '▶'");
    assert_eq!(browser.layout_faults(), Vec::<Value>::new());
    assert_eq!(browser.complaints(), Vec::<Value>::new());
    assert_eq!(browser.requests(), Vec::<String>::new());
}

/// The page of a print on a telephone: layers appear, the cut shows the inside, probes over time select the
/// step.
#[test]
fn a_print_on_a_small_screen() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::write(here.join("bar.toml"), BAR).unwrap();
    run("crystfem", "run bar.toml --output out", here).with_code(0);
    run("crystfem", "view out --html page.html", here).with_code(0).shows("page.html");
    let page = fs::read_to_string(here.join("page.html")).unwrap();
    assert!(page.len() < LARGEST_PAGE && !here.join("out/view.html").exists(), "{}", page.len());
    let Some(browser) = Browser::open(&here.join("page.html"), [390, 800]) else { return };
    browser.wait("document.body.dataset.ready");
    browser.picture("print-end.txt");
    assert_eq!(browser.layout_faults(), Vec::<Value>::new());
    let azimuth = browser.value("stage.azimuth").as_f64().unwrap();
    browser.press("#stage", "\u{e014}");
    browser.wait(&format!("stage.azimuth !== {azimuth}"));
    browser.click("#more summary");
    let triangles = |browser: &Browser| shown_values(browser, "triangles").parse::<usize>().unwrap();
    let whole = triangles(&browser);
    browser.press("#step", "\u{e011}");
    browser.wait("document.body.dataset.step === '0'");
    let bed = triangles(&browser);
    assert!(bed < whole, "{bed} of {whole}: layers come");
    browser.press("#step", "\u{e010}");
    browser.wait("document.body.dataset.step !== '0'");
    // the part by crystallinity, the plate by none
    choose(&browser, "fields", "crystallinity");
    choose(&browser, "axis", "y");
    browser.wait(&format!("document.body.dataset.triangles !== '{whole}'"));
    assert_ne!(shown_values(&browser, "grey"), "0", "glass has no crystallinity");
    browser.picture("print-cut.txt");
    browser.press("#cut", "\u{e010}");
    browser.wait("document.body.dataset.triangles === '0'");
    browser.click("#other-side");
    browser.wait(&format!("document.body.dataset.triangles === '{whole}'"));
    // probes
    assert!(browser.value("chart.lines.length").as_u64().unwrap() >= 1, "a probe");
    assert!(
        shown_values(&browser, "mark").contains("120"),
        "the marker is at the end: {}",
        shown_values(&browser, "mark")
    );
    assert_eq!(browser.complaints(), Vec::<Value>::new());
    assert_eq!(browser.requests(), Vec::<String>::new());
}

/// Folders without results, without fields, of runs that have not ended, and damaged ones.
#[test]
fn what_there_is_is_shown_or_named() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    fs::create_dir(here.join("empty")).unwrap();
    for program in ["crystfem", "mdsurrogate", "peri", "polycore"] {
        run(program, "view empty", here).with_code(2).tells("there are no results: no report.json");
        run(program, "view nowhere", here).with_code(2).tells("cannot read nowhere");
    }
    fs::write(here.join("empty/fields.vtkhdf"), "no HDF5").unwrap();
    peri("view empty", here).with_code(2).tells("fields.vtkhdf is not a valid VTKHDF file");
    assert!(!here.join("empty/view.html").exists());
    // curves alone, with a gap and a name that would end a script
    fs::create_dir(here.join("curves")).unwrap();
    fs::write(here.join("curves/point_a&b.csv"), "time [s],alpha </script>\n0,0\n1,\n2,NaN\n3,1\n").unwrap();
    run("polycore", "view curves", here).with_code(0);
    let page = fs::read_to_string(here.join("curves/view.html")).unwrap();
    assert_eq!(
        page_data(&page)["tables"][0]["columns"][1]["data"],
        serde_json::json!([0.0, null, null, 1.0])
    );
    // a run in progress, and one without any file
    fs::write(here.join("sheet.toml"), SHEET.replace("steps = 30", "steps = 3000")).unwrap();
    let mut child = command("peri", "run sheet.toml --output half", here).spawn().unwrap();
    let written = || {
        fs::read_dir(here.join("half")).into_iter().flatten().flatten().find_map(|entry| {
            entry
                .file_name()
                .to_string_lossy()
                .ends_with(".frames")
                .then(|| fs::read_dir(entry.path()).unwrap().count())
        })
    };
    while written().is_none_or(|count| count < 4) {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    peri("view half", here).with_code(0);
    let page = fs::read_to_string(here.join("half/view.html")).unwrap();
    let half = page_data(&page);
    assert!(half["verdict"]["state"] == "bad" && half["bodies"][0]["frames"].as_array().unwrap().len() >= 3);
    fs::create_dir(here.join("begun")).unwrap();
    fs::write(here.join("begun/checkpoint.bin"), "x").unwrap();
    peri("view begun", here).with_code(0);

    let Some(browser) = Browser::open(&here.join("half/view.html"), [1000, 800]) else { return };
    browser.wait("document.body.dataset.ready === 'yes'");
    let verdict = "document.getElementById('verdict').textContent";
    assert!(browser.value(verdict).as_str().unwrap().contains("The run has not ended"));
    assert_eq!(browser.complaints(), Vec::<Value>::new());
    let Some(browser) = Browser::open(&here.join("begun/view.html"), [1000, 800]) else { return };
    browser.wait("document.body.dataset.ready === 'nothing'");
    let notes = browser.value("document.getElementById('notes').textContent");
    assert!(notes.as_str().unwrap().contains("no fields and no tables"), "{notes}");
    let Some(browser) = Browser::open(&here.join("curves/view.html"), [1000, 800]) else { return };
    browser.wait("document.body.dataset.ready === 'yes'");
    assert_eq!(browser.complaints(), Vec::<Value>::new());
}
