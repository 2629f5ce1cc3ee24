//! A page that shows a run: one HTML file with everything in it, which opens without a network.
//!
//! [`view`] reads what a run has written (`report.json`, tables, fields) and gives the page: solids that turn
//! and can be cut, coloured by any field, step by step, beside the curves of the history. Numbers are
//! quantised and deflated, and steps and cells are dropped until all of it fits. Pages list what is dropped.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::{Value as Json, json};

use crate::case::{Names, main_names, natural};
use crate::checkpoint;
use crate::report::{self, Report, SceneUnits, Value};
use crate::scene::Source;
use body::{Detail, PageBody};
use frames::FrameReader;
use polycore::Error;
use polycore::file::atomic_write;
use tables::PageTables;

mod body;
mod frames;
mod pack;
mod particles;
mod scalars;
mod solid;
mod tables;
#[cfg(test)]
mod tests;

/// The name of a page in the folder of its run.
pub const FILE_NAME: &str = "view.html";

/// Characters of all bodies of a page at most: with tables and values, 1 MB, it stays below 5 MB.
const FIELDS: usize = 3_500_000;
/// Steps of a body at most.
const STEPS: usize = 100;
/// Steps that stay before cells are left out.
const FEW_STEPS: usize = 20;
/// Cells are left out up to this factor.
const COARSEST: usize = 16;
/// Bodies of a page at most.
const BODIES: usize = 8;
/// Scalars of a page at most.
const SCALARS: usize = 2_000;

/// Results of a run in its folder and the folders of its studies.
#[derive(Default)]
struct Found {
    report: Option<Report>,
    /// The run has not ended.
    unfinished: bool,
    bodies: Vec<(String, FrameReader)>,
    tables: PageTables,
}

/// Returns the page of a run in a folder, as HTML.
///
/// # Errors
/// [`Error::OutputDirectory`] for a folder without any result; [`Error::Io`], [`Error::Format`] for files
/// that cannot be read or are damaged, with their names.
pub fn view(folder: impl AsRef<Path>) -> Result<String, Error> {
    let folder = folder.as_ref();
    let mut found = Found::default();
    found.read(folder, "")?;
    for name in frames::names(folder)? {
        let path = folder.join(&name);
        let is_run =
            || [report::FILE_NAME, checkpoint::FILE_NAME].iter().any(|file| path.join(file).is_file());
        if path.is_dir() && !name.starts_with('.') && is_run() {
            found.read(&path, &format!("{name}/"))?;
        }
    }
    if let Some(report) = &found.report {
        found.tables.curves(report);
        let scene = &report.provenance.scene;
        let listed = Source::new("scene", scene.as_str()).report_values();
        found.tables.prepare(&SceneUnits::from_scene(scene), &listed);
    }
    if found.report.is_none()
        && found.bodies.is_empty()
        && found.tables.tables.is_empty()
        && !found.unfinished
    {
        return Err(Error::OutputDirectory {
            path: folder.to_path_buf(),
            reason: format!(
                "there are no results: no {}, no tables (*.csv), no fields (*.vtkhdf)",
                report::FILE_NAME
            ),
        });
    }
    let name =
        folder.canonicalize().ok().and_then(|path| Some(path.file_name()?.to_string_lossy().into_owned()));
    page(&name.unwrap_or_else(|| folder.display().to_string()), found)
}

/// Writes the page of a run, whole or not at all, to `html`, or to `view.html` in its folder; gives its path.
///
/// # Errors
/// As [`view()`].
pub fn write(folder: impl AsRef<Path>, html: Option<&Path>) -> Result<PathBuf, Error> {
    let folder = folder.as_ref();
    let page = view(folder)?;
    let path = html.map_or_else(|| folder.join(FILE_NAME), Path::to_path_buf);
    atomic_write(&path, |file| file.write_all(page.as_bytes()))?;
    Ok(path)
}

impl Found {
    /// Adds what is in a folder; `prefix` stands before all names.
    fn read(&mut self, folder: &Path, prefix: &str) -> Result<(), Error> {
        let names = frames::names(folder)?;
        let has = |name: &str| names.iter().any(|other| other == name);
        self.unfinished |= has(checkpoint::FILE_NAME);
        if prefix.is_empty() && has(report::FILE_NAME) {
            self.report = Some(Report::read(folder.join(report::FILE_NAME))?);
        }
        for name in names.iter().filter_map(|name| name.strip_suffix(".csv")) {
            self.tables.file(&folder.join(format!("{name}.csv")), &format!("{prefix}{name}"))?;
        }
        self.bodies.extend(FrameReader::all(folder)?.into_iter().map(|frames| (prefix.to_owned(), frames)));
        Ok(())
    }

    /// Returns the largest distance, in spacings, of neighbours of a variant that are still bonded, as in the
    /// pictures.
    fn bridge(&self, variant: &str) -> f64 {
        let of_it = |name: &str, quantity: &str| {
            let written = |name: &str| name.replace(' ', "_").replace('=', "-");
            match name.strip_prefix(quantity).map(|rest| rest.trim_matches(['[', ']'])) {
                Some(rest) => rest.is_empty() || written(rest) == variant,
                None => false,
            }
        };
        let of = |quantity: &str| {
            let values = self.report.as_ref()?.values.iter();
            let scalars = values.filter_map(|(name, value)| match value {
                Value::Scalar { value, .. } if of_it(name, quantity) => Some(*value),
                _ => None,
            });
            scalars.reduce(f64::max)
        };
        let most = of("critical_stretch").or(of("largest_stretch")).unwrap_or(100.0);
        (1.02 * most).clamp(1.5, 100.0)
    }

    /// Bodies and their numbers as text, each within its share of the page.
    fn bodies(&self) -> Result<Vec<(PageBody, String)>, Error> {
        let share = FIELDS / self.bodies.len().clamp(1, BODIES);
        let fitting = |(prefix, frames): &(String, FrameReader)| {
            let bridge = self.bridge(&frames.name);
            let mut detail = Detail { steps: STEPS, coarser: 1 };
            loop {
                let (body, store) =
                    PageBody::new(frames, format!("{prefix}{}", frames.name), bridge, detail)?;
                let text = store.text();
                let least = detail.coarser >= COARSEST && detail.steps <= 2;
                if text.len() <= share || least {
                    return Ok((body, text));
                }
                detail = detail.less(frames.len(), text.len() as f64 / share as f64);
            }
        };
        self.bodies.iter().take(BODIES).map(fitting).collect()
    }
}

impl Detail {
    /// Less of a file of `steps` steps that took `over` times the room it has: steps first, then cells, then
    /// steps.
    fn less(self, steps: usize, over: f64) -> Self {
        let now = self.steps.min(steps);
        let part = ((now as f64 / over * 0.95) as usize).min(now.saturating_sub(1));
        if now > FEW_STEPS {
            Self { steps: part.max(FEW_STEPS), ..self }
        } else if self.coarser < COARSEST {
            Self { coarser: 2 * self.coarser, ..self }
        } else {
            Self { steps: part.max(2), ..self }
        }
    }
}

/// A scalar of the report, in the unit of the scene.
#[derive(Serialize)]
struct PageScalar<'a> {
    name: &'a str,
    /// The name without its variant.
    quantity: &'a str,
    variant: &'a str,
    value: Option<f64>,
    unit: String,
    /// Place among the main values.
    main: Option<usize>,
    /// Verdict of its expectations, if it has any.
    pass: Option<bool>,
}

/// Returns the scalars of a report, the main ones first if there are more than fit.
fn scalars<'a>(report: &'a Report, main: &[String], units: &SceneUnits) -> Vec<PageScalar<'a>> {
    let names = Names::new(report);
    let mut pass: BTreeMap<&str, bool> = BTreeMap::new();
    for one in &report.expect {
        one.expect.names().for_each(|name| *pass.entry(name).or_insert(true) &= one.pass);
    }
    let each = report.values.iter().filter_map(|(name, value)| {
        let Value::Scalar { value, unit } = value else { return None };
        let (quantity, variant) = names.split(name);
        // values of one quantity share a unit
        let same = main.iter().filter(|other| names.split(other).0 == quantity);
        let largest =
            same.filter_map(|other| report.scalar(other)).fold(value.abs(), |most, x| most.max(x.abs()));
        let shown = units.shown(unit, largest);
        Some(PageScalar {
            name,
            quantity,
            variant,
            value: value.is_finite().then(|| value * shown.map_or(1.0, |shown| shown.factor)),
            unit: shown.map_or_else(|| units.convert(0.0, unit).1, |shown| shown.name.to_owned()),
            main: main.iter().position(|other| other == name),
            pass: pass.get(name.as_str()).copied(),
        })
    });
    let (first, rest): (Vec<PageScalar>, Vec<PageScalar>) = each.partition(|scalar| scalar.main.is_some());
    let mut all: Vec<PageScalar> = first.into_iter().chain(rest).take(SCALARS).collect();
    all.sort_by_key(|scalar| natural(scalar.name));
    all
}

/// Returns the verdict in one sentence, and its colour.
fn verdict(report: Option<&Report>, unfinished: bool) -> Json {
    let (state, text) = match report {
        Some(report) if !unfinished => {
            let failed = report.expect.iter().filter(|one| !one.pass).count();
            let trials = report.trials.iter().filter(|trial| !trial.passed).count();
            let all = report.expect.len();
            let known = report.expect.iter().filter(|one| one.is_known_miss()).count();
            match (report.passed, all) {
                (true, 0) => ("", "The run has ended; the scene states no expectations.".to_owned()),
                (true, 1) if known == 0 => ("good", "The one expectation of the scene is met.".to_owned()),
                (true, all) if known > 0 => {
                    let met = all - known;
                    (
                        "",
                        format!(
                            "{met} of {all} expectations of the scene are met; {known} are known misses."
                        ),
                    )
                }
                (true, all) => ("good", format!("All {all} expectations of the scene are met.")),
                (false, _) if failed > 0 => {
                    ("bad", format!("{failed} of {all} expectations of the scene are not met."))
                }
                (false, _) if trials > 0 => {
                    ("bad", format!("{trials} of {} trials failed.", report.trials.len()))
                }
                (false, _) => ("bad", format!("{} values are not finite.", report.non_finite.len())),
            }
        }
        _ => ("bad", "The run has not ended: this is what it has written so far.".to_owned()),
    };
    json!({ "state": state, "text": text })
}

fn page(name: &str, found: Found) -> Result<String, Error> {
    let (bodies, numbers): (Vec<PageBody>, Vec<String>) = found.bodies()?.into_iter().unzip();
    let beyond = found.bodies.iter().skip(BODIES).map(|(prefix, frames)| format!("{prefix}{}", frames.name));
    let mut left_out: Vec<String> = beyond.chain(found.tables.left_out.iter().cloned()).collect();
    let scene = found.report.as_ref().map_or("", |report| report.provenance.scene.as_str());
    let source = Source::new("scene", scene);
    let (mut values, mut judged, mut header) = (Vec::new(), Vec::new(), json!(null));
    let mut variants: Vec<&str> = Vec::new();
    if let Some(report) = &found.report {
        let main = main_names(report, &source.report_values(), &[]);
        values = scalars(report, &main, &SceneUnits::from_scene(scene));
        // expectations stand in the order of the studies
        let split = Names::new(report);
        let expected = report.expect.iter().flat_map(|one| one.expect.names());
        let named =
            expected.map(|name| split.split(name).1).chain(values.iter().map(|scalar| scalar.variant));
        for variant in named.filter(|variant| !variant.is_empty()) {
            if !variants.contains(&variant) {
                variants.push(variant);
            }
        }
        let count = report.values.values().filter(|value| matches!(value, Value::Scalar { .. })).count();
        if count > values.len() {
            left_out.push(format!("{} scalars of {}", count - values.len(), report::FILE_NAME));
        }
        judged.extend(report.expect.iter().map(|judgement| {
            let [_, quantity, value, bound, source] = judgement.row();
            let (pass, kind) = (judgement.pass, judgement.expect.kind);
            json!({
                "quantity": quantity, "pass": pass, "missed": judgement.expect.missed, "value": value,
                "bound": bound, "kind": kind, "source": source,
            })
        }));
        let provenance = &report.provenance;
        header = json!({
            "program": provenance.program, "version": provenance.version, "date": provenance.date,
        });
    }
    let title = source.title().unwrap_or_else(|| name.to_owned());
    let run: Json = json!({
        "name": name, "report": header, "verdict": verdict(found.report.as_ref(), found.unfinished),
        "scalars": values, "variants": variants, "expect": judged, "bodies": bodies,
        "tables": found.tables.tables, "left_out": left_out,
    });
    // nothing in the data can end the script
    let run = run.to_string().replace('<', "\\u003c");
    let page = include_str!("page.html")
        .replace("<!--style-->", include_str!("page.css"))
        .replace("<!--shape-->", include_str!("shape.js"))
        .replace("<!--stage-->", include_str!("stage.js"))
        .replace("<!--chart-->", include_str!("chart.js"))
        .replace("<!--page-->", include_str!("page.js"))
        .replace("<!--title-->", &escaped(&title));
    let mut data = format!("<script type=\"application/json\" id=\"run\">{run}</script>\n");
    for (index, text) in numbers.iter().enumerate() {
        data += &format!("<script type=\"text/plain\" id=\"body-{index}\">{text}</script>\n");
    }
    Ok(page.replacen("<!--data-->", &data, 1))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
