//! Draws the pictures and tables of README and guide from cases, copies the files that pages show, and finds
//! what is stale.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use harness::report::{FILE_NAME, Report};
use miette::{IntoDiagnostic, Result, WrapErr, miette};
use serde::{Deserialize, Serialize};

use crate::stamp::{SourceStamp, hash_bytes};
use crate::table::print;
use crate::workspace::Repository;

mod chart;
mod compose;
mod fill;
mod include;
mod page;

use chart::Chart;
use compose::Image;

/// The list of pictures and tables, below the root.
const LIST: &str = "docs/pictures.toml";

/// The stamps of what was drawn last, below the root.
const STAMPS: &str = "docs/pictures.lock";

/// Options of `cargo xtask pictures`.
#[derive(clap::Args)]
pub struct Options {
    /// Draw all pictures and tables, also those whose sources have not changed.
    #[arg(long)]
    all: bool,
    /// Take programs from this folder instead of building them.
    #[arg(long, value_name = "FOLDER")]
    from: Option<PathBuf>,
}

/// Content of `docs/pictures.toml`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    /// Scenes by name, relative to the root.
    cases: BTreeMap<String, PathBuf>,
    #[serde(default)]
    picture: Vec<Picture>,
    #[serde(default)]
    table: Vec<Block>,
}

/// A PNG file made of panels side by side, or a chart of values.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Picture {
    file: PathBuf,
    /// Greatest width, pixels.
    #[serde(default)]
    width: usize,
    #[serde(default)]
    panel: Vec<Panel>,
    chart: Option<Chart>,
}

/// A part of a picture that a case draws.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Panel {
    case: String,
    /// File in the results of the case; `view.html`: its result page, photographed by a browser.
    from: PathBuf,
    /// Left, top, width and height of the part that is used, pixels; all by default.
    crop: Option<[usize; 4]>,
}

/// A part of a Markdown file that values of reports fill.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Block {
    file: PathBuf,
    /// Name in the markers `<!-- values: NAME -->` and `<!-- end -->` around the part.
    name: String,
    /// Text with placeholders `{case > quantity > decimals}`.
    text: String,
}

/// State in which a picture or table was drawn last.
#[derive(Deserialize, Serialize)]
struct DrawnEntry {
    /// Hash of its entry in the list.
    entry: String,
    #[serde(flatten)]
    stamp: SourceStamp,
}

impl Picture {
    fn cases(&self) -> Vec<&str> {
        let panels = self.panel.iter().map(|panel| panel.case.as_str());
        panels.chain(self.chart.iter().flat_map(Chart::cases)).collect()
    }

    fn key(&self) -> String {
        self.file.display().to_string()
    }

    fn shows_page(&self) -> bool {
        self.panel.iter().any(Panel::is_page)
    }
}

impl Panel {
    fn is_page(&self) -> bool {
        self.from == Path::new(page::FILE)
    }
}

impl Block {
    fn cases(&self) -> Vec<&str> {
        fill::placeholders(&self.text).map(|[case, ..]| case).collect()
    }

    fn key(&self) -> String {
        format!("{} ({})", self.file.display(), self.name)
    }
}

impl List {
    fn read(root: &Path) -> Result<Self> {
        let text = fs::read_to_string(root.join(LIST)).into_diagnostic().wrap_err(LIST)?;
        toml::from_str(&text).into_diagnostic().wrap_err(LIST)
    }

    /// Every picture and table with the cases from which it is made.
    fn entries(&self) -> Vec<(String, Vec<&str>)> {
        let pictures = self.picture.iter().map(|picture| (picture.key(), picture.cases()));
        pictures.chain(self.table.iter().map(|table| (table.key(), table.cases()))).collect()
    }

    fn picture(&self, key: &str) -> Option<&Picture> {
        self.picture.iter().find(|picture| picture.key() == key)
    }

    fn block(&self, key: &str) -> Option<&Block> {
        self.table.iter().find(|block| block.key() == key)
    }

    /// Hashes the entry of a picture or table.
    fn hash(&self, key: &str) -> Result<String> {
        let text = match (self.picture(key), self.block(key)) {
            (Some(picture), _) => toml::to_string(picture),
            (None, block) => toml::to_string(&block),
        };
        Ok(hash_bytes(text.into_diagnostic()?.as_bytes()))
    }

    /// Returns true if neither the entry nor its sources have changed since it was drawn.
    fn is_fresh(&self, root: &Path, key: &str, drawn: Option<&DrawnEntry>) -> bool {
        drawn.is_some_and(|drawn| {
            self.hash(key).is_ok_and(|hash| hash == drawn.entry) && drawn.stamp.fresh(root)
        })
    }

    fn case(&self, name: &str) -> Result<&Path> {
        let file = self.cases.get(name).ok_or_else(|| miette!("{LIST}: unknown case `{name}`"))?;
        Ok(file)
    }

    /// Files and folders that determine how an entry looks: the scenes and the code that draws.
    /// Code of the programs is not among them: it changes daily, and tests judge its values.
    fn sources(&self, key: &str, cases: &[&str]) -> Result<Vec<String>> {
        let page = self.picture(key).is_some_and(Picture::shows_page);
        let code = if page { "crates/harness/src/view" } else { "crates/resultfile/src" };
        let mut all = vec![code.to_owned()];
        for name in cases {
            let file = self.case(name)?;
            let folder = file.parent().unwrap_or(file);
            all.push(folder.to_string_lossy().into_owned());
        }
        all.sort();
        all.dedup();
        Ok(all)
    }
}

/// Draws what is missing or stale, or all; returns true.
pub fn run(workspace: &Repository, options: &Options) -> Result<bool> {
    let root = workspace.root();
    let list = List::read(root)?;
    let mut stamps = stamps(root)?;
    stamps.retain(|key, _| list.entries().iter().any(|(known, _)| known == key));
    let is_wanted = |key: &str| options.all || !list.is_fresh(root, key, stamps.get(key));
    let wanted: Vec<_> = list.entries().into_iter().filter(|(key, _)| is_wanted(key)).collect();
    let mut results = BTreeMap::new();
    for name in wanted.iter().flat_map(|(_, cases)| cases) {
        if !results.contains_key(*name) {
            results.insert((*name).to_owned(), solve(workspace, options, name, &list)?);
        }
    }
    for (key, cases) in &wanted {
        if let Some(picture) = list.picture(key) {
            draw(root, picture, &results)?;
        } else if let Some(block) = list.block(key) {
            write(root, block, &results)?;
        }
        let stamp = SourceStamp::new(root, &list.sources(key, cases)?)?;
        stamps.insert(key.clone(), DrawnEntry { entry: list.hash(key)?, stamp });
        print(&format!("{key}\n"));
    }
    include::update(root, &crate::tidy::tracked(root)?)?;
    let text = toml::to_string(&stamps).into_diagnostic()?;
    fs::write(root.join(STAMPS), text).into_diagnostic().wrap_err(STAMPS)?;
    print(&format!("pictures: {} drawn of {}\n", wanted.len(), list.entries().len()));
    Ok(true)
}

/// Findings of `cargo xtask tidy`: stale pictures and tables, and pictures that no case draws.
pub fn findings(root: &Path, files: &[PathBuf]) -> Result<Vec<String>> {
    let list = List::read(root)?;
    let stamps = stamps(root)?;
    let mut findings = include::findings(root, files)?;
    for (key, _) in list.entries() {
        if !list.is_fresh(root, &key, stamps.get(&key)) {
            findings.push(format!("{key}: stale; run `cargo xtask pictures`"));
        }
    }
    let is_picture =
        |file: &&PathBuf| file.starts_with("docs") && file.extension().is_some_and(|e| e == "png");
    for file in files.iter().filter(is_picture).filter(|file| root.join(file).is_file()) {
        if !list.picture.iter().any(|picture| picture.file == *file) {
            findings.push(format!("{}: not in {LIST}", file.display()));
        }
    }
    Ok(findings)
}

fn stamps(root: &Path) -> Result<BTreeMap<String, DrawnEntry>> {
    match fs::read_to_string(root.join(STAMPS)) {
        Ok(text) => toml::from_str(&text).into_diagnostic().wrap_err(STAMPS),
        Err(_) => Ok(BTreeMap::new()),
    }
}

/// The program that a scene names.
fn program(root: &Path, scene: &Path) -> Result<String> {
    let place = || scene.display().to_string();
    let text = fs::read_to_string(root.join(scene)).into_diagnostic().wrap_err_with(place)?;
    let scene: toml::Table = toml::from_str(&text).into_diagnostic().wrap_err_with(place)?;
    let program = scene.get("program").and_then(toml::Value::as_str);
    program.map(str::to_owned).ok_or_else(|| miette!("{}: missing `program`", place()))
}

/// Runs a case and returns the folder of its results; writes its page if a picture shows it.
fn solve(workspace: &Repository, options: &Options, name: &str, list: &List) -> Result<PathBuf> {
    let scene = list.case(name)?;
    let program = program(workspace.root(), scene)?;
    let executable = match &options.from {
        Some(folder) => folder.join(&program).with_extension(std::env::consts::EXE_EXTENSION),
        None => workspace.build_program(&program)?,
    };
    let output = workspace.results("pictures")?.join(name);
    print(&format!("{program} run {}\n", scene.display()));
    let ended = Command::new(&executable)
        .arg("run")
        .arg(scene)
        .arg("--output")
        .arg(&output)
        .current_dir(workspace.root())
        .stdout(Stdio::null())
        .status()
        .into_diagnostic()
        .wrap_err_with(|| executable.display().to_string())?;
    if !ended.success() {
        return Err(miette!("{program} run {}: {ended}", scene.display()));
    }
    let shows = |panel: &Panel| panel.case == name && panel.is_page();
    if list.picture.iter().flat_map(|picture| &picture.panel).any(shows) {
        page::write(&executable, &output)?;
    }
    Ok(output)
}

fn draw(root: &Path, picture: &Picture, results: &BTreeMap<String, PathBuf>) -> Result<()> {
    if let Some(chart) = &picture.chart {
        let reports = reports(&chart.cases(), results)?;
        let path = root.join(&picture.file);
        return chart.write(&path, |case, quantity| reports.get(case)?.scalar(quantity));
    }
    let mut panels = Vec::new();
    for panel in &picture.panel {
        let mut file = results[&panel.case].join(&panel.from);
        if panel.is_page() {
            file = page::photograph(&file)?;
        }
        let image = Image::read(&file)?;
        panels.push(match panel.crop {
            Some(crop) => image.crop(crop).wrap_err_with(|| panel.from.display().to_string())?,
            None => image,
        });
    }
    compose::side_by_side(&panels, picture.width).write(&root.join(&picture.file))
}

/// Reports of cases by name.
fn reports(cases: &[&str], results: &BTreeMap<String, PathBuf>) -> Result<BTreeMap<String, Report>> {
    let read = |name: &&str| Ok(((*name).to_owned(), Report::read(results[*name].join(FILE_NAME))?));
    cases.iter().map(read).collect::<std::result::Result<_, polycore::Error>>().into_diagnostic()
}

fn write(root: &Path, block: &Block, results: &BTreeMap<String, PathBuf>) -> Result<()> {
    let reports = reports(&block.cases(), results)?;
    let value = |case: &str, quantity: &str| reports.get(case).and_then(|report| report.scalar(quantity));
    let filled = fill::fill(&block.text, value).wrap_err_with(|| block.key())?;
    let path = root.join(&block.file);
    let text = fs::read_to_string(&path).into_diagnostic().wrap_err_with(|| block.key())?;
    let text = fill::replace(&text, &block.name, &filled).wrap_err_with(|| block.key())?;
    fs::write(&path, text).into_diagnostic().wrap_err_with(|| block.key())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scene or a line of code that changes makes the picture stale, a comment does not.
    #[test]
    fn changed_sources_make_a_picture_stale() {
        let root = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| {
            let path = root.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            fs::write(path, text).expect("a file");
        };
        write("crates/resultfile/src/picture.rs", "fn a() {}\n");
        write("cases/plate/case.toml", "program = 'peri'\n");
        let text = "cases = { plate = 'cases/plate/case.toml' }\n[[picture]]\nfile = 'docs/a.png'\nwidth = \
            10\n\
                    [[picture.panel]]\ncase = 'plate'\nfrom = 'a.png'\n";
        write(LIST, text);
        let files = ["docs/a.png", "docs/b.png"].map(PathBuf::from);
        write("docs/b.png", "");
        let found = || findings(root.path(), &files).expect("findings");
        let stale = "docs/a.png: stale; run `cargo xtask pictures`";
        assert_eq!(found(), [stale, "docs/b.png: not in docs/pictures.toml"]);
        fs::remove_file(root.path().join("docs/b.png")).expect("removed");
        let list = List::read(root.path()).expect("a list");
        let sources = list.sources("docs/a.png", &["plate"]).expect("sources");
        let stamp = SourceStamp::new(root.path(), &sources).expect("a stamp");
        let entry = list.hash("docs/a.png").expect("a hash");
        let stamps = BTreeMap::from([("docs/a.png".to_owned(), DrawnEntry { entry, stamp })]);
        write(STAMPS, &toml::to_string(&stamps).expect("text"));
        assert_eq!(found(), [""; 0]);
        write("crates/resultfile/src/picture.rs", "// a comment\nfn a() {}\n");
        assert_eq!(found(), [""; 0]);
        write("cases/plate/case.toml", "program = 'peri'\ntitle = 'b'\n");
        assert_eq!(found(), [stale]);
        write("cases/plate/case.toml", "program = 'peri'\n");
        write("crates/resultfile/src/picture.rs", "fn a() { }\n");
        assert_eq!(found(), [stale]);
        // another entry changes nothing, its own does
        write("crates/resultfile/src/picture.rs", "fn a() {}\n");
        write(LIST, &format!("{text}[[table]]\nfile = 'docs/a.md'\nname = 'a'\ntext = ''\n"));
        assert_eq!(found(), [stale.replace("a.png", "a.md (a)")]);
        write(LIST, &text.replace("width = 10", "width = 20"));
        assert_eq!(found(), [stale]);
    }

    /// The list of this tree names scenes that exist.
    #[test]
    fn listed_cases_exist() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let list = List::read(&root).expect("a list");
        for (key, cases) in list.entries() {
            assert!(!cases.is_empty(), "{key}");
            list.sources(&key, &cases).expect("sources");
        }
    }
}
