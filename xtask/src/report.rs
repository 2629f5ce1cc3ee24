//! Report of `cargo xtask validate`: target/validation/{report.html, report.json, validation.md}, and after a
//! complete full run docs/validation.md.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use harness::report::{Judgement, Provenance};
use miette::{IntoDiagnostic, Result, miette};
use polycore::file::atomic_write;
use serde::Serialize;

use crate::outcome::CaseOutcome;
use crate::summary;
use crate::test::{self, Records};
use crate::workspace::Repository;

mod baseline;
mod cross;
mod errata;
mod evidence;
mod markdown;
mod others;
mod pages;
mod pictures;
mod points;
mod references;
mod stability;
mod thesis;
mod timing;

use baseline::{EarlierReport, ReportDifference};
use pictures::{Gallery, ReportPicture};

/// Number of pictures of each case in the list of cases.
const PICTURES: usize = 6;

/// Sources of the report besides the outcomes.
pub struct Sources {
    map: thesis::ThesisMap,
    errata: Vec<errata::Erratum>,
    /// Measurements of the last run of the tests.
    records: Records,
    baseline: Option<EarlierReport>,
}

impl Sources {
    /// Reads cases/thesis.toml, docs/errata.md and an earlier report.
    pub fn read(workspace: &Repository, baseline: Option<&Path>) -> Result<Self> {
        let map = thesis::ThesisMap::read(workspace)?;
        let errata = errata::Erratum::read(workspace)?;
        let mut faults = map.faults(workspace);
        faults.extend(errata::faults(workspace, &errata, &map.erratum));
        if !faults.is_empty() {
            return Err(miette!("cases/thesis.toml:\n{}", faults.join("\n")));
        }
        let records = test::read(workspace);
        Ok(Self { map, errata, records, baseline: baseline.map(EarlierReport::read).transpose()? })
    }
}

/// Amount of work of a validation.
#[derive(Clone, Copy)]
pub struct Tier {
    /// Cases without `quick = false`.
    pub quick: bool,
    /// All cases below cases/.
    pub everything: bool,
}

/// Content of the page.
#[derive(Serialize)]
struct Page {
    passed: bool,
    /// True for all cases of the repository, false for a selection.
    everything: bool,
    tier: &'static str,
    sums: String,
    command: String,
    commit: String,
    date: String,
    machine: String,
    versions: Vec<(String, String)>,
    seconds: f64,
    counts: Vec<(String, usize)>,
    kinds: Vec<(String, usize)>,
    thesis: Vec<thesis::RowVerdict>,
    links: Vec<thesis::RowVerdict>,
    measurements: Vec<others::ExternalFigure>,
    others: Vec<others::ExternalFigure>,
    timing: Vec<timing::TimingSubject>,
    references: Vec<references::ReferenceSeries>,
    stability: Vec<stability::StabilityTrial>,
    errata: Vec<errata::ErratumVerdict>,
    cross: Vec<cross::CrossCheck>,
    difference: Option<ReportDifference>,
    cases: Vec<CaseView>,
}

/// Case on the page.
#[derive(Serialize)]
struct CaseView {
    case: String,
    anchor: String,
    title: String,
    program: String,
    file: String,
    href: String,
    command: String,
    results: String,
    /// Link to the page with its bodies.
    page: Option<String>,
    log: String,
    seconds: f64,
    kept: bool,
    passed: bool,
    complaint: String,
    rows: Vec<[String; 6]>,
    missed: usize,
    pictures: Vec<ReportPicture>,
    work: Vec<(String, String)>,
}

/// Content of report.json.
#[derive(Serialize)]
struct Json<'a> {
    version: u32,
    passed: bool,
    tier: &'static str,
    commit: String,
    date: String,
    machine: String,
    versions: Vec<(String, String)>,
    /// Number of expectations by kind of evidence.
    kinds: BTreeMap<String, usize>,
    cases: Vec<JsonCase<'a>>,
    thesis: Vec<thesis::RowVerdict>,
    links: Vec<thesis::RowVerdict>,
    measurements: Vec<others::ExternalFigure>,
    others: Vec<others::ExternalFigure>,
    timing: Vec<timing::TimingSubject>,
    references: Vec<references::ReferenceSeries>,
    stability: Vec<stability::StabilityTrial>,
    errata: Vec<errata::ErratumVerdict>,
    cross_checks: Vec<cross::CrossCheck>,
    difference: Option<ReportDifference>,
}

#[derive(Serialize)]
struct JsonCase<'a> {
    case: &'a str,
    file: &'a str,
    program: &'a str,
    command: &'a str,
    passed: bool,
    failure: Option<&'a str>,
    seconds: f64,
    expect: &'a [Judgement],
    work: BTreeMap<&'a str, u64>,
}

impl<'a> JsonCase<'a> {
    fn new(outcome: &'a CaseOutcome) -> Self {
        let work = outcome.report.iter().flat_map(|report| &report.work);
        Self {
            case: &outcome.case,
            file: &outcome.file,
            program: &outcome.program,
            command: &outcome.command,
            passed: outcome.passed(),
            failure: outcome.failure.as_deref(),
            seconds: outcome.seconds,
            expect: outcome.expect(),
            work: work.map(|(name, count)| (name.as_str(), *count)).collect(),
        }
    }
}

/// Writes the report; returns the paths of its files.
pub fn write(
    workspace: &Repository,
    sources: &Sources,
    outcomes: &[CaseOutcome],
    tier: Tier,
) -> Result<Vec<PathBuf>> {
    let folder = workspace.results("validation")?;
    let page = page(workspace, &folder, sources, outcomes, tier)?;
    let html = render(&page)?;
    let text = markdown::text(&page, outcomes);
    let mut paths =
        vec![folder.join("report.html"), folder.join("report.json"), folder.join("validation.md")];
    put(&paths[0], html.as_bytes())?;
    put(&paths[2], text.as_bytes())?;
    if tier.everything && !tier.quick {
        paths.push(workspace.root().join("docs/validation.md"));
        put(&paths[3], text.as_bytes())?;
    }
    let json = json(page, outcomes);
    atomic_write(&paths[1], |file| {
        serde_json::to_writer_pretty(&mut *file, &json)?;
        file.write_all(b"\n")
    })
    .into_diagnostic()?;
    Ok(paths)
}

fn put(path: &Path, bytes: &[u8]) -> Result<()> {
    atomic_write(path, |file| file.write_all(bytes)).into_diagnostic()
}

fn page(
    workspace: &Repository,
    folder: &Path,
    sources: &Sources,
    outcomes: &[CaseOutcome],
    tier: Tier,
) -> Result<Page> {
    let mut gallery = Gallery::default();
    let found = evidence::MeasuredNumbers { outcomes, records: &sources.records, root: workspace.root() };
    let [thesis, links] = sources.map.judge(&found, &mut gallery);
    let provenance: Vec<&Provenance> =
        outcomes.iter().filter_map(|outcome| Some(&outcome.report.as_ref()?.provenance)).collect();
    let first = provenance.first();
    let mut versions: Vec<(String, String)> =
        provenance.iter().map(|p| (p.program.clone(), p.version.clone())).collect();
    versions.sort();
    versions.dedup();
    let mut counts: Vec<(String, usize)> = Vec::new();
    for judged in thesis.iter().chain(&links) {
        match counts.iter_mut().find(|(verdict, _)| verdict == judged.verdict()) {
            Some((_, count)) => *count += 1,
            None => counts.push((judged.verdict().to_owned(), 1)),
        }
    }
    Ok(Page {
        passed: outcomes.iter().all(CaseOutcome::passed),
        everything: tier.everything,
        tier: if tier.quick { "quick" } else { "full" },
        sums: summary::sums(outcomes),
        command: format!("cargo xtask {}", std::env::args().skip(1).collect::<Vec<_>>().join(" ")),
        commit: first
            .and_then(|p| p.git.as_ref())
            .map_or_else(|| "unknown".to_owned(), |git| git.hash.clone()),
        date: first.map(|p| p.date.clone()).unwrap_or_default(),
        machine: first.map_or_else(String::new, |p| {
            format!("{}, {}, {} cores, {} threads", p.host.cpu, p.host.system, p.host.cores, p.host.threads)
        }),
        versions,
        seconds: outcomes.iter().map(|outcome| outcome.seconds).sum(),
        counts,
        kinds: summary::kinds(outcomes).into_iter().map(|(kind, n)| (kind.to_string(), n)).collect(),
        thesis,
        links,
        measurements: others::measurements(outcomes),
        others: others::figures(outcomes),
        timing: timing::measured(workspace, folder, outcomes)?,
        references: references::series(outcomes),
        stability: stability::trials(outcomes),
        errata: errata::judge(&sources.errata, &sources.map.erratum, &found),
        cross: cross::checked(workspace)?,
        difference: sources.baseline.as_ref().map(|baseline| baseline.compare(outcomes)),
        cases: outcomes.iter().map(|outcome| view(workspace, outcome, &mut gallery)).collect(),
    })
}

fn view(workspace: &Repository, outcome: &CaseOutcome, gallery: &mut Gallery) -> CaseView {
    let short = |path: &Path| workspace.short(path).to_string();
    let work = outcome.report.iter().flat_map(|report| &report.work);
    CaseView {
        case: outcome.case.clone(),
        anchor: anchor(&outcome.case),
        title: outcome.title.clone(),
        program: outcome.program.clone(),
        file: outcome.file.clone(),
        href: outcome.href.clone(),
        command: outcome.command.clone(),
        results: short(&outcome.output),
        page: pages::page(outcome).map(|path| link(workspace, &path)),
        log: short(&outcome.log),
        seconds: outcome.seconds,
        kept: outcome.kept,
        passed: outcome.passed(),
        complaint: outcome.complaint(short),
        rows: outcome.rows().collect(),
        missed: outcome.expect().iter().filter(|judgement| !judgement.pass).count(),
        pictures: gallery.rest(outcome, PICTURES),
        work: work.map(|(name, count)| (name.clone(), count.to_string())).collect(),
    }
}

/// Report without pictures, and the cases with their judgements.
fn json(page: Page, outcomes: &[CaseOutcome]) -> Json<'_> {
    Json {
        version: 1,
        passed: page.passed,
        tier: page.tier,
        commit: page.commit,
        date: page.date,
        machine: page.machine,
        versions: page.versions,
        kinds: page.kinds.into_iter().collect(),
        cases: outcomes.iter().map(JsonCase::new).collect(),
        measurements: page.measurements,
        others: page.others,
        thesis: page.thesis.into_iter().map(thesis::RowVerdict::without_pictures).collect(),
        links: page.links.into_iter().map(thesis::RowVerdict::without_pictures).collect(),
        timing: page.timing.into_iter().map(timing::TimingSubject::without_picture).collect(),
        references: page.references,
        stability: page.stability,
        errata: page.errata,
        cross_checks: page.cross,
        difference: page.difference,
    }
}

/// Renders the page as HTML.
fn render(page: &Page) -> Result<String> {
    let mut environment = minijinja::Environment::new();
    environment.add_template("report.html", include_str!("report/template.html")).into_diagnostic()?;
    let template = environment.get_template("report.html").into_diagnostic()?;
    template.render(minijinja::value::Serde(page)).into_diagnostic()
}

/// Converts `Fig. 2.7` to `fig-2-7`.
fn anchor(name: &str) -> String {
    let parts = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|part| !part.is_empty());
    parts.collect::<Vec<_>>().join("-").to_lowercase()
}

/// Path of a file relative to target/validation.
pub fn link(workspace: &Repository, file: &Path) -> String {
    match (workspace.target().strip_prefix(workspace.root()), file.strip_prefix(workspace.root())) {
        (Ok(target), Ok(below)) => {
            let up = "../".repeat(target.components().count() + 1);
            format!("{up}{}", below.display())
        }
        _ => format!("file://{}", file.display()),
    }
}
