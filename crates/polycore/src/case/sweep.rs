//! Many runs of one scene over a grid of values: in parallel, one thread each; finished ones are kept.

use super::rows::{Row, Rows};
use super::{Case, Fault, Finished, Options};
use crate::Error;
use crate::checkpoint::Header;
use crate::report::{Phases, Provenance, Report};
use crate::scene::{Failure, SWEEP, SceneError, Source};
use rayon::prelude::*;
use std::path::Path;
use std::str::FromStr;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

mod sample;
mod search;
mod table;

crate::quantities! {
    /// Scalars that reports of sweeps have, whatever the program.
    pub OF_SWEEPS:
    FAILED_RUNS = "failed_runs", "", "runs of a sweep that ended with an error";
    LEAST_VALUE = "least_value", "*", "least value that a search found to meet all expectations";
}

pub use sample::{OF_SAMPLES, Sample, drawn};
pub use search::{Search, search};
use table::{draw, together};

/// The table of a sweep, in its folder.
const TABLE: &str = "sweep.csv";
/// Runs of a sweep at most.
const MOST: usize = 10_000;

/// A key of the scene and the values that it takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Vary {
    /// Its path: `print.layer_time`, `boundary[1].film`.
    pub key: String,
    /// The values as the user wrote them.
    pub values: Vec<String>,
    /// Whether they are draws from a [`Sample`], over which the sweep gives bands.
    pub drawn: bool,
}

impl FromStr for Vary {
    type Err = String;

    /// From `KEY=VALUE,VALUE,…`; commas in brackets, braces and quotes belong to a value. Keys that change together stand
    /// behind one another, `KEY=A,B;OTHER=C,D`, with as many values each: the values are then `A;C` and `B;D`.
    fn from_str(text: &str) -> Result<Self, String> {
        let usage = "KEY=VALUE,VALUE,…, e.g. print.layer_time=10s,20s,40s";
        let mut linked = Self { key: String::new(), values: Vec::new(), drawn: false };
        for part in divided(text, ';') {
            let (key, list) =
                part.split_once('=').ok_or_else(|| format!("found `{part}`; allowed: {usage}"))?;
            let values = divided(list, ',');
            let key = key.trim();
            if key.is_empty() || values.iter().any(String::is_empty) {
                return Err(format!("found `{part}`; allowed: {usage}"));
            }
            if linked.key.is_empty() {
                linked = Self { key: key.to_owned(), values, drawn: false };
            } else if linked.values.len() == values.len() {
                linked.key += &format!(";{key}");
                linked.values.iter_mut().zip(values).for_each(|(all, value)| *all += &format!(";{value}"));
            } else {
                let (found, allowed) = (values.len(), linked.values.len());
                return Err(format!(
                    "found {found} values of `{key}`; allowed: {allowed}, as the key before it has"
                ));
            }
        }
        let values = &linked.values;
        if let Some(twice) = (1..values.len()).find(|&k| values[..k].contains(&values[k])) {
            return Err(format!("found `{}` twice; allowed: different values", values[twice]));
        }
        Ok(linked)
    }
}

impl Vary {
    /// Its keys, several where they change together.
    fn keys(&self) -> Vec<String> {
        divided(&self.key, ';')
    }
}

/// Pieces between separators that stand in no brackets, braces and quotes.
fn divided(text: &str, separator: char) -> Vec<String> {
    let (mut pieces, mut piece, mut depth, mut quoted) = (Vec::new(), String::new(), 0, false);
    for c in text.chars() {
        match c {
            '"' => quoted = !quoted,
            '[' | '{' if !quoted => depth += 1,
            ']' | '}' if !quoted => depth -= 1,
            _ => {}
        }
        if c == separator && depth == 0 && !quoted {
            pieces.push(std::mem::take(&mut piece).trim().to_owned());
        } else {
            piece.push(c);
        }
    }
    pieces.push(piece.trim().to_owned());
    pieces
}

/// How a sweep behaves towards its user.
pub struct SweepOptions<'a> {
    /// Where results go; each run in a folder of its own.
    pub output: &'a Path,
    /// Further values to report, by name; `*` stands for any text.
    pub columns: &'a [String],
    /// Leave out what is marked `quick = false`.
    pub quick: bool,
    /// Time between checkpoints of each run.
    pub checkpoint_every: Duration,
    /// Whether the user asked to stop.
    pub interrupted: &'a (dyn Fn() -> bool + Sync),
    /// Sees how many of how many runs are done, and the name of the last.
    pub progress: &'a mut (dyn FnMut(usize, usize, &str) + Send),
}

/// One run: its name, its values, its scene with the table that sets them.
struct Run {
    name: String,
    values: Vec<String>,
    source: Source,
}

/// Runs a scene for every combination of values; those that an earlier sweep into the same folder has finished are kept.
///
/// # Errors
/// Faults of the scene or of a key, before anything is run; [`Error::SweepInterrupted`]. What ends a single run does
/// not end the sweep: its row says so, and the report fails.
pub fn sweep<C: Case>(
    source: &Source,
    vary: &[Vary],
    options: &mut SweepOptions,
) -> Result<Finished, Failure<C::Error>> {
    let (rows, bands, report) = rows::<C>(source, vary, options)?;
    Ok(Finished { text: rows.text() + &bands, report })
}

/// [`sweep`], and its rows: those requested first, in their order. And the bands of what was sampled.
fn rows<C: Case>(
    source: &Source,
    vary: &[Vary],
    options: &mut SweepOptions,
) -> Result<(Rows, String, Report), Failure<C::Error>> {
    let mut runs = runs::<C>(source, vary, options.quick)?;
    let former = former(vary, options.output)?;
    crate::output::prepare_directory(options.output)?;
    let _lock = crate::case::lock_run(options.output)?;
    // what an earlier sweep of the same scene has finished stays in the table
    let mut vary = vary.to_vec();
    for values in former {
        let name = name(&vary, &values);
        let run = Run::new::<C>(source, &vary, name, values, options.quick);
        let known = runs.iter().any(|other| other.name == run.name);
        if known || run.finished(options.output).is_none() {
            continue;
        }
        for (vary, value) in vary.iter_mut().zip(&run.values) {
            if !vary.values.contains(value) {
                vary.values.push(value.clone());
            }
        }
        runs.push(run);
    }
    let vary = vary.as_slice();
    let _ = std::fs::remove_file(options.output.join(crate::report::FILE_NAME));
    let mut phases = Phases::new();
    phases.start("solve");
    let outcomes = solve::<C>(&runs, options)?;
    phases.start("write");
    let rows = Rows {
        settings: vary.iter().map(|vary| vary.key.clone()).collect(),
        columns: C::PROGRAM
            .columns
            .iter()
            .map(|&name| name.to_owned())
            .chain(options.columns.to_vec())
            .collect(),
        rows: runs
            .iter()
            .zip(outcomes)
            .map(|(run, outcome)| Row { name: run.name.clone(), settings: run.values.clone(), outcome })
            .collect(),
    };
    rows.write(&options.output.join(TABLE))?;
    draw(vary, &rows, options.output)?;
    let mut report = together(&C::PROGRAM, source, vary, &rows);
    let bands = sample::bands(vary, &rows, options.output, &mut report)?;
    phases.stop();
    report.phases(&phases).threads(rayon::current_num_threads());
    report.passed &= rows.rows.iter().all(|row| row.outcome.is_ok());
    report.write(options.output)?;
    Ok((rows, bands, report))
}

/// Values of the runs that the table of an earlier sweep has; one over other keys would be lost.
fn former(vary: &[Vary], output: &Path) -> Result<Vec<Vec<String>>, Error> {
    let Ok(mut table) = csv::Reader::from_path(output.join(TABLE)) else { return Ok(Vec::new()) };
    let head = table.headers().cloned().unwrap_or_default();
    let rows: Vec<csv::StringRecord> = table.records().flatten().collect();
    // the scene of a finished run tells which columns are keys: it sets them
    let scene = |row: &csv::StringRecord| {
        let report = output.join(row.get(0)?).join(crate::report::FILE_NAME);
        Some(Report::read(report).ok()?.provenance.scene)
    };
    let Some(scene) = rows.iter().find_map(scene) else { return Ok(Vec::new()) };
    let set =
        |name: &&str| divided(name, ';').iter().all(|key| scene.contains(&format!("{} = ", quoted(key))));
    let keys: Vec<&str> = head.iter().skip(1).take_while(set).collect();
    if vary.iter().map(|vary| vary.key.as_str()).eq(keys.iter().copied()) {
        let values =
            |row: &csv::StringRecord| row.iter().skip(1).take(keys.len()).map(str::to_owned).collect();
        return Ok(rows.iter().map(values).collect());
    }
    let reason =
        format!("found a sweep over {}; allowed: one over the same keys, or another folder", keys.join(", "));
    Err(Error::Option { option: format!("--output {}", output.display()), reason })
}

/// The runs of a grid, each checked.
fn runs<C: Case>(source: &Source, vary: &[Vary], quick: bool) -> Result<Vec<Run>, Failure<C::Error>> {
    let keys: Vec<String> = vary.iter().flat_map(Vary::keys).collect();
    if let Some(twice) = (1..keys.len()).find(|&k| keys[..k].contains(&keys[k])) {
        let reason = "found the key twice; allowed: each key once, with all its values".to_owned();
        return Err(Error::Option { option: format!("--vary {}", keys[twice]), reason }.into());
    }
    let count = vary.iter().map(|vary| vary.values.len()).try_fold(1, usize::checked_mul);
    let Some(count) = count.filter(|&count| count <= MOST) else {
        let found: f64 = vary.iter().map(|vary| vary.values.len() as f64).product();
        let reason = format!("found {found} runs; allowed: 1 to {MOST}");
        let option = "--vary".to_owned();
        return Err(Error::Option { option, reason }.into());
    };
    let mut runs: Vec<Run> = Vec::new();
    for index in 0..count {
        let mut rest = index;
        // the last key runs fastest
        let mut values: Vec<String> = Vec::new();
        for vary in vary.iter().rev() {
            values.insert(0, vary.values[rest % vary.values.len()].clone());
            rest /= vary.values.len();
        }
        let mut name = name(vary, &values);
        let same = runs.iter().filter(|run| run.name == name).count();
        if same > 0 {
            name += &format!("-{}", same + 1);
        }
        runs.push(Run::new::<C>(source, vary, name, values, quick));
    }
    // every problem is built once before anything is computed: faults show at once
    let faults: Vec<_> = runs.par_iter().map(|run| C::explain(&run.source, quick).err()).collect();
    match runs.iter().zip(faults).find_map(|(run, fault)| Some((run, fault?))) {
        None => Ok(runs),
        Some((run, fault)) => {
            // what is wrong without any option too is reported at its place
            C::explain(source, quick)?;
            Err(match fault {
                Failure::Scene(fault) => run.of_options(source, vary, &fault).into(),
                other => other,
            })
        }
    }
}

impl Run {
    fn new<C: Case>(source: &Source, vary: &[Vary], name: String, values: Vec<String>, quick: bool) -> Self {
        let keys: Vec<String> = vary.iter().flat_map(Vary::keys).collect();
        let each = keys.iter().zip(values.iter().flat_map(|value| divided(value, ';')));
        let mut set: Vec<String> =
            each.map(|(key, value)| format!("{} = {}", quoted(key), literal(&value))).collect();
        for key in C::bulky(source) {
            if !keys.iter().any(|other| other == key) {
                set.push(format!("{} = false", quoted(key)));
            }
        }
        // a quick run is another run: what it finished is not taken for a whole one
        let quick = if quick { "quick = true\n" } else { "" };
        let (text, set) = (source.text.trim_end(), set.join(", "));
        let text = format!("{text}\n\n[{SWEEP}]\n{quick}set = {{ {set} }}\n");
        Self { name, values, source: source.with_text(text) }
    }

    /// Its report, where it is finished in the folder of a sweep.
    fn finished(&self, sweep: &Path) -> Option<Report> {
        let report = Report::read(sweep.join(&self.name).join(crate::report::FILE_NAME)).ok()?;
        let Provenance { scene, stamp, .. } = &report.provenance;
        let same = scene.starts_with(self.source.text.trim_end());
        let holds = stamp.as_ref().is_none_or(|stamp| stamp.changed(&self.source.path).is_none());
        (same && holds).then_some(report)
    }

    /// Kept where it is finished, gone on with where it is begun.
    fn solve<C: Case>(&self, sweep: &Path, options: Options) -> Result<Report, Failure<C::Error>> {
        if let Some(report) = self.finished(sweep) {
            return Ok(report);
        }
        let begun = |header: Header| header.scene == self.source.text && header.check(options.output).is_ok();
        let resume = Header::read(options.output, C::PROGRAM.magic).is_ok_and(begun);
        Ok(super::run::<C>(&self.source, Options { resume, ..options })?.report)
    }

    /// A fault of a scene that nobody wrote, as one of the options that made it: of that at whose key it is, else of all.
    fn of_options(&self, scene: &Source, vary: &[Vary], fault: &SceneError) -> Error {
        let set = format!("{SWEEP}.set.");
        let key = fault.key().unwrap_or_default().trim_start_matches(set.as_str());
        let at_key = |vary: &&Vary| {
            let within = |rest: &str| rest.is_empty() || rest.starts_with(['.', '[']);
            vary.keys().iter().any(|own| key.strip_prefix(own.as_str()).is_some_and(within))
        };
        let named: Vec<&Vary> = vary.iter().filter(at_key).collect();
        let options = vary.iter().zip(&self.values).filter(|(v, _)| named.is_empty() || named.contains(v));
        let option: Vec<String> =
            options.map(|(vary, value)| format!("--vary {}={value}", vary.key)).collect();
        let mut reason = fault.message().replace(&set, "");
        // of a key that the scene has elsewhere
        if let Some((before, _)) = reason.split_once(&format!(" in `{SWEEP}.set`"))
            && let Some(name) = before.split('`').nth(1)
            && let Ok(value) = scene.parse::<serde_json::Value>()
        {
            let mut paths = Vec::new();
            paths_of(&value, name, "", &mut paths);
            reason = format!("{before}: a key is a path from the top of the scene");
            if let Some(path) = paths.first() {
                reason += &format!("; did you mean `{path}`?");
            }
        }
        let reason = match named[..] {
            [vary] => reason.trim_start_matches(&format!("`{}`: ", vary.key)).to_owned(),
            _ => reason,
        };
        Error::Option { option: option.join(" "), reason }
    }
}

/// Paths of the keys of a scene that have a name, blocks of studies left out.
fn paths_of(value: &serde_json::Value, name: &str, above: &str, paths: &mut Vec<String>) {
    match value {
        serde_json::Value::Object(table) => {
            for (key, value) in table.iter().filter(|(key, _)| !(above.is_empty() && *key == "study")) {
                let path = if above.is_empty() { key.clone() } else { format!("{above}.{key}") };
                if key == name {
                    paths.push(path.clone());
                }
                paths_of(value, name, &path, paths);
            }
        }
        serde_json::Value::Array(list) => {
            for (index, value) in list.iter().enumerate() {
                paths_of(value, name, &format!("{above}[{index}]"), paths);
            }
        }
        _ => {}
    }
}

/// `print.layer_time`, `10 s` → `_layer_time-10s`.
fn named(key: &str, value: &str) -> String {
    let key = key.rsplit('.').next().unwrap_or(key);
    let plain = |text: &str| -> String {
        let kept = text.chars().filter(|c| !c.is_whitespace());
        kept.map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect()
    };
    format!("_{}-{}", plain(key), plain(value))
}

fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// A value as TOML: numbers, truth values, arrays, tables and texts in quotes as they are, all else a text.
fn literal(value: &str) -> String {
    if let Ok(whole) = value.parse::<i64>() {
        return whole.to_string();
    }
    if let Ok(number) = value.parse::<f64>() {
        return format!("{number:?}").to_lowercase();
    }
    let as_it_is = matches!(value, "true" | "false") || value.starts_with(['[', '{', '"']);
    if as_it_is { value.to_owned() } else { quoted(value) }
}

/// What a run gave; nothing where it was not run.
type Outcome<C> = Option<Result<Report, Failure<<C as Case>::Error>>>;

/// Each run on a thread of its own, as many at once as there are threads.
fn solve<C: Case>(
    runs: &[Run],
    options: &mut SweepOptions,
) -> Result<Vec<Result<Report, String>>, Failure<C::Error>> {
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let outcomes: Vec<Mutex<Outcome<C>>> = runs.iter().map(|_| Mutex::default()).collect();
    let SweepOptions { output, quick, checkpoint_every, interrupted, .. } = *options;
    let progress = Mutex::new(&mut *options.progress);
    let work = || {
        while !interrupted() {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let (Some(run), Some(place)) = (runs.get(index), outcomes.get(index)) else { break };
            let directory = &output.join(&run.name);
            let one = Options { quick, checkpoint_every, interrupted, ..Options::new(directory) };
            let outcome = run.solve::<C>(output, one);
            if let Ok(mut place) = place.lock() {
                *place = Some(outcome);
            }
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            if let Ok(mut progress) = progress.lock() {
                progress(done, runs.len(), &run.name);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..rayon::current_num_threads().min(runs.len()) {
            // not rayon's own threads: one that waits would take up a second run on top of its first
            scope.spawn(|| match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
                Ok(pool) => pool.install(work),
                Err(_) => work(),
            });
        }
    });
    let mut told = Vec::new();
    for outcome in outcomes {
        told.push(match outcome.into_inner().ok().flatten() {
            None => return Err(Error::SweepInterrupted(output.to_path_buf()).into()),
            Some(Err(Failure::Run(error))) if error.is_interruption() => {
                return Err(Error::SweepInterrupted(output.to_path_buf()).into());
            }
            Some(outcome) => outcome.map_err(|failure| failure.to_string()),
        });
    }
    Ok(told)
}

/// `layer_time-10s_film-20W_m_2_K`, of values of keys.
fn name(vary: &[Vary], values: &[String]) -> String {
    let each = vary.iter().flat_map(Vary::keys).zip(values.iter().flat_map(|value| divided(value, ';')));
    let name: String = each.map(|(key, value)| named(&key, &value)).collect();
    name.trim_start_matches('_').to_owned()
}

#[cfg(test)]
mod tests {
    use super::table::numeric;
    use super::*;

    #[test]
    fn keys_and_values() {
        let of = |text: &str| text.parse::<Vary>();
        let values = |text: &str| of(text).unwrap().values;
        assert_eq!(of("print.layer_time=10s, 20 s").unwrap().key, "print.layer_time");
        assert_eq!(values("a=10s, 20 s"), ["10s", "20 s"]);
        assert_eq!(values("a=[1,2],[3,4]"), ["[1,2]", "[3,4]"]);
        assert_eq!(values("a={x=[1,2],y=2},\"p,q\""), ["{x=[1,2],y=2}", "\"p,q\""]);
        let linked = of("print.layer_time=5s,10s; time.end = 60s,120s").unwrap();
        assert_eq!((linked.key.as_str(), linked.keys().len()), ("print.layer_time;time.end", 2));
        assert_eq!(linked.values, ["5s;60s", "10s;120s"]);
        assert_eq!(name(&[linked], &["5s;60s".into()]), "layer_time-5s_end-60s");
        for wrong in ["a", "a=", "=1", "a=1,,2", "a=1,1", "a=1,2;b=3", "a=1;"] {
            assert!(of(wrong).unwrap_err().contains("allowed"), "{wrong}");
        }
    }

    #[test]
    fn values_in_toml() {
        for (value, toml) in [
            ("10s", "\"10s\""),
            ("3", "3"),
            ("007", "7"),
            (".5", "0.5"),
            ("1e3", "1000.0"),
            ("nan", "nan"),
            ("true", "true"),
            ("[\"1 mm\"]", "[\"1 mm\"]"),
            ("a \"b\" \\", "\"a \\\"b\\\" \\\\\""),
        ] {
            assert_eq!(literal(value), toml);
        }
        assert_eq!(named("boundary[1].ambient", "80 degC"), "_ambient-80degC");
        let texts = |list: &[&str]| list.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>();
        assert_eq!(numeric(&texts(&["10s", "20 s"])), Some((vec![10.0, 20.0], "s".into())));
        assert_eq!(numeric(&texts(&["10s", "1 min"])), None);
        assert_eq!(numeric(&texts(&["tr-bdf2"])), None);
    }
}
