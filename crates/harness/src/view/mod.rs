//! A page that shows a run: one HTML file with everything in it, which opens without a network.
//!
//! [`view`] reads what a run has written (`report.json`, tables, fields) and gives the page: solids that turn and can be
//! cut, coloured by any field, step by step, beside the curves of the history. Drawing is done by plotly.js, which the
//! crate [`plotly`] contains; numbers are quantised and deflated, and steps and cells are dropped until all of
//! it fits. Pages list what is dropped.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::{Value as Json, json};

use crate::checkpoint;
use crate::report::{self, Report, Value};
use body::{Body, Detail};
use frames::Frames;
use polycore::Error;
use polycore::file::atomic_write;
use tables::Tables;

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

/// Characters of all bodies of a page at most: with the script, 1.9 MB, and tables, 0.4 MB, it stays below 5 MB.
const FIELDS: usize = 2_500_000;
/// Steps of a body at most.
const STEPS: usize = 100;
/// Steps that stay before cells are left out.
const FEW_STEPS: usize = 20;
/// Cells are left out up to this factor.
const COARSEST: usize = 16;
/// Bodies of a page at most.
const BODIES: usize = 8;
/// Scalars of a page at most.
const SCALARS: usize = 600;

/// What a run left in a folder, and the folders of its studies.
#[derive(Default)]
struct Found {
    report: Option<Report>,
    /// The run has not ended.
    unfinished: bool,
    bodies: Vec<(String, Frames)>,
    tables: Tables,
}

/// The page of a run in a folder, as HTML.
///
/// # Errors
/// [`Error::OutputDirectory`] for a folder without any result; [`Error::Io`], [`Error::Format`] for files that cannot be
/// read or are damaged, with their names.
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
        self.bodies.extend(Frames::all(folder)?.into_iter().map(|frames| (prefix.to_owned(), frames)));
        Ok(())
    }

    /// How far apart, in spacings, neighbours of a variant may be that are still bonded: the rule of the pictures.
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
    fn bodies(&self) -> Result<Vec<(Body, String)>, Error> {
        let share = FIELDS / self.bodies.len().clamp(1, BODIES);
        let fitting = |(prefix, frames): &(String, Frames)| {
            let bridge = self.bridge(&frames.name);
            let mut detail = Detail { steps: STEPS, coarser: 1 };
            loop {
                let (body, store) = Body::new(frames, format!("{prefix}{}", frames.name), bridge, detail)?;
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
    /// Less of a file of `steps` steps that took `over` times the room it has: steps first, then cells, then steps.
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

/// A scalar of the report.
#[derive(Serialize)]
struct Scalar<'a> {
    name: &'a str,
    value: Option<f64>,
    unit: &'a str,
}

fn page(name: &str, found: Found) -> Result<String, Error> {
    let (bodies, numbers): (Vec<Body>, Vec<String>) = found.bodies()?.into_iter().unzip();
    let beyond = found.bodies.iter().skip(BODIES).map(|(prefix, frames)| format!("{prefix}{}", frames.name));
    let mut left_out: Vec<String> = beyond.chain(found.tables.left_out.iter().cloned()).collect();
    let finite = |x: f64| x.is_finite().then_some(x);
    let mut scalars = Vec::new();
    let (mut judged, mut header) = (Vec::new(), json!(null));
    if let Some(report) = &found.report {
        for (name, value) in &report.values {
            if let Value::Scalar { value, unit } = value {
                scalars.push(Scalar { name, value: finite(*value), unit });
            }
        }
        judged.extend(report.expect.iter().map(|judgement| json!({
            "quantity": judgement.expect.quantity, "pass": judgement.pass, "value": judgement.value.and_then(finite),
        })));
        let provenance = &report.provenance;
        header = json!({
            "passed": report.passed, "program": provenance.program, "version": provenance.version,
            "date": provenance.date, "non_finite": report.non_finite, "work": report.work,
        });
    }
    if scalars.len() > SCALARS {
        left_out.push(format!("{} scalars of {}", scalars.len() - SCALARS, report::FILE_NAME));
        scalars.truncate(SCALARS);
    }
    let told: Json = json!({
        "name": name, "unfinished": found.unfinished, "report": header, "scalars": scalars, "expect": judged,
        "bodies": bodies, "tables": found.tables.tables, "left_out": left_out,
    });
    // nothing in the data can end the script
    let told = told.to_string().replace('<', "\\u003c");
    let page = include_str!("page.html")
        .replace("<!--style-->", include_str!("page.css"))
        .replace("<!--shape-->", include_str!("shape.js"))
        .replace("<!--page-->", include_str!("page.js"))
        .replace("<!--title-->", &escaped(name));
    let mut data = format!("<script type=\"application/json\" id=\"run\">{told}</script>\n");
    for (index, text) in numbers.iter().enumerate() {
        data += &format!("<script type=\"text/plain\" id=\"body-{index}\">{text}</script>\n");
    }
    if !bodies.is_empty() || !found.tables.tables.is_empty() {
        data += &format!(
            "<script type=\"text/plain\" id=\"plotly\">{}</script>\n",
            pack::zipped(plotly().as_bytes())
        );
    }
    Ok(page.replacen("<!--data-->", &data, 1))
}

/// The script of plotly.js.
fn plotly() -> String {
    let all = plotly::Plot::offline_js_sources();
    let begin = all.find('>').map_or(0, |at| at + 1);
    let end = all.find("</script>").unwrap_or(all.len());
    all.get(begin..end).unwrap_or_default().to_owned()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
