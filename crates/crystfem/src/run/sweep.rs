//! Many runs of one scene over a grid of values: in parallel, one thread each; finished ones are kept.

use super::checkpoint::{self, Header};
use super::rows::{Row, Rows, STATISTICS};
use super::{Failure, Finished, Options, part};
use crate::error::Error;
use crate::scene::{Kind, PartScene, kind};
use polycore::output::picture::{LinePlot, Series};
use polycore::report::{Phases, Report};
use polycore::scene::{SceneError, Source};
use rayon::prelude::*;
use std::path::Path;
use std::str::FromStr;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

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
}

impl FromStr for Vary {
    type Err = String;

    /// From `KEY=VALUE,VALUE,…`; commas in brackets, braces and quotes belong to a value.
    fn from_str(text: &str) -> Result<Self, String> {
        let usage = "KEY=VALUE,VALUE,…, e.g. print.layer_time=10s,20s,40s";
        let (key, list) = text.split_once('=').ok_or_else(|| format!("found `{text}`; allowed: {usage}"))?;
        let (mut values, mut value, mut depth, mut quoted) = (Vec::new(), String::new(), 0, false);
        for c in list.chars() {
            match c {
                '"' => quoted = !quoted,
                '[' | '{' if !quoted => depth += 1,
                ']' | '}' if !quoted => depth -= 1,
                _ => {}
            }
            if c == ',' && depth == 0 && !quoted {
                values.push(std::mem::take(&mut value));
            } else {
                value.push(c);
            }
        }
        values.push(value);
        let values: Vec<String> = values.into_iter().map(|value| value.trim().to_owned()).collect();
        let key = key.trim().to_owned();
        if key.is_empty() || values.iter().any(String::is_empty) {
            return Err(format!("found `{text}`; allowed: {usage}"));
        }
        if let Some(twice) = (1..values.len()).find(|&k| values[..k].contains(&values[k])) {
            return Err(format!("found `{}` twice; allowed: values that differ", values[twice]));
        }
        Ok(Self { key, values })
    }
}

/// How a sweep behaves towards its user.
pub struct SweepOptions<'a> {
    /// Where results go; each run in a folder of its own.
    pub output: &'a Path,
    /// Time between checkpoints of each run.
    pub checkpoint_every: Duration,
    /// Whether the user asked to stop.
    pub interrupted: &'a (dyn Fn() -> bool + Sync),
    /// Sees how many of how many runs are done, and the name of the last.
    pub progress: &'a mut (dyn FnMut(usize, usize, &str) + Send),
}

/// One run: its name, its values, its scene with the study that sets them.
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
pub fn sweep(source: &Source, vary: &[Vary], options: &mut SweepOptions) -> Result<Finished, Failure> {
    let runs = runs(source, vary)?;
    refuse_other_keys(vary, options.output)?;
    polycore::output::prepare_directory(options.output)?;
    let _lock = polycore::output::lock_run(options.output)?;
    let _ = std::fs::remove_file(options.output.join(polycore::report::FILE_NAME));
    let mut phases = Phases::new();
    phases.start("solve");
    let outcomes = solve(&runs, options)?;
    phases.start("write");
    let rows = Rows {
        settings: vary.iter().map(|vary| vary.key.clone()).collect(),
        rows: runs
            .iter()
            .zip(outcomes)
            .map(|(run, outcome)| Row { name: run.name.clone(), settings: run.values.clone(), outcome })
            .collect(),
    };
    rows.write(&options.output.join(TABLE))?;
    draw(vary, &rows, options.output)?;
    let mut report = together(source, vary, &rows);
    phases.stop();
    report.phases(&phases).threads(rayon::current_num_threads());
    report.passed &= rows.rows.iter().all(|row| row.outcome.is_ok());
    report.write(options.output)?;
    Ok(Finished { text: rows.text(), report })
}

/// The table of a sweep over other keys would be lost.
fn refuse_other_keys(vary: &[Vary], output: &Path) -> Result<(), Error> {
    let Ok(mut table) = csv::Reader::from_path(output.join(TABLE)) else { return Ok(()) };
    let head = table.headers().cloned().unwrap_or_default();
    let ends = |name: &&str| name.starts_with(STATISTICS[0]) || *name == "steps";
    let keys: Vec<&str> = head.iter().skip(1).take_while(|name| !ends(name)).collect();
    if vary.iter().map(|vary| vary.key.as_str()).eq(keys.iter().copied()) {
        return Ok(());
    }
    let reason =
        format!("found a sweep over {}; allowed: one over the same keys, or another folder", keys.join(", "));
    Err(Error::Option { option: format!("--output {}", output.display()), reason })
}

/// The runs of a grid, each checked.
fn runs(source: &Source, vary: &[Vary]) -> Result<Vec<Run>, Failure> {
    if kind(source)? != Kind::Part {
        return Err(source.error("program", "a scene without a mesh", "a scene of a part").into());
    }
    let scene = source.parse::<PartScene>()?;
    if !scene.study.is_empty() {
        return Err(source.error("study", "a sweep of a scene with studies", "a scene without").into());
    }
    if let Some(twice) = (1..vary.len()).find(|&k| vary[..k].iter().any(|other| other.key == vary[k].key)) {
        let reason = "found the key twice; allowed: each key once, with all its values".to_owned();
        return Err(Error::Option { option: format!("--vary {}", vary[twice].key), reason }.into());
    }
    let count = vary.iter().map(|vary| vary.values.len()).try_fold(1, usize::checked_mul);
    let Some(count) = count.filter(|&count| count <= MOST) else {
        let found = vary.iter().map(|vary| vary.values.len() as f64).product();
        let allowed = format!("1 to {MOST}");
        return Err(Error::Parameter { name: "runs of a sweep", found, allowed }.into());
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
        let mut name: String =
            vary.iter().zip(&values).map(|(vary, value)| named(&vary.key, value)).collect();
        name = name.trim_start_matches('_').to_owned();
        let same = runs.iter().filter(|run| run.name == name).count();
        if same > 0 {
            name += &format!("-{}", same + 1);
        }
        let mut set: Vec<String> = vary
            .iter()
            .zip(&values)
            .map(|(vary, value)| format!("{} = {}", quoted(&vary.key), literal(value)))
            .collect();
        for key in ["output.pictures", "output.fields"] {
            if !vary.iter().any(|vary| vary.key == key) {
                set.push(format!("{} = false", quoted(key)));
            }
        }
        let text = format!(
            "{}\n\n# a run of a sweep\n[[study]]\nname = {}\nset = {{ {} }}\n",
            source.text.trim_end(),
            quoted(&name),
            set.join(", ")
        );
        runs.push(Run { name, values, source: Source::new(&source.path, text) });
    }
    // every problem is built once before anything is computed: faults show at once
    let faults: Vec<Option<SceneError>> = runs.par_iter().map(|run| run.check().err()).collect();
    let fault = runs.iter().zip(faults).find_map(|(run, fault)| Some((run, fault?)));
    match fault {
        None => Ok(runs),
        Some((run, fault)) => {
            // what is wrong without any option too is told at its place
            scene.check(source)?;
            scene.task(source, scene.mesh.build(source)?.mesh)?;
            Err(run.of_options(vary, &fault).into())
        }
    }
}

impl Run {
    fn check(&self) -> Result<(), SceneError> {
        let scene = self.source.parse::<PartScene>()?;
        scene.studies(&self.source, false)?;
        let (source, scene) = scene.of_study(&self.source, 0)?;
        scene.task(&source, scene.mesh.build(&source)?.mesh).map(|_| ())
    }

    /// A fault of a scene that nobody wrote, as one of the options that made it: of that at whose key it is, else of all.
    fn of_options(&self, vary: &[Vary], fault: &SceneError) -> Error {
        const SET: &str = "study[0].set.";
        let key = fault.key().unwrap_or_default().trim_start_matches(SET);
        let at_key = |vary: &&Vary| {
            key.strip_prefix(vary.key.as_str())
                .is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        let named: Vec<&Vary> = vary.iter().filter(at_key).collect();
        let options = vary.iter().zip(&self.values).filter(|(v, _)| named.is_empty() || named.contains(v));
        let option: Vec<String> =
            options.map(|(vary, value)| format!("--vary {}={value}", vary.key)).collect();
        let reason = fault.message().replace(SET, "");
        let reason = match named[..] {
            [vary] => reason.trim_start_matches(&format!("`{}`: ", vary.key)).to_owned(),
            _ => reason,
        };
        Error::Option { option: option.join(" "), reason }
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

/// Each run on a thread of its own, as many at once as there are threads.
fn solve(runs: &[Run], options: &mut SweepOptions) -> Result<Vec<Result<Report, String>>, Failure> {
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let outcomes: Vec<Mutex<Option<Result<Report, Failure>>>> =
        runs.iter().map(|_| Mutex::default()).collect();
    let progress = Mutex::new(&mut *options.progress);
    let (output, every, interrupted) = (options.output, options.checkpoint_every, options.interrupted);
    let work = || {
        while !interrupted() {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let (Some(run), Some(place)) = (runs.get(index), outcomes.get(index)) else { break };
            let outcome = one(run, &output.join(&run.name), every, interrupted);
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
            None | Some(Err(Failure::Run(Error::Interrupted(_)))) => {
                return Err(Error::SweepInterrupted(output.to_path_buf()).into());
            }
            Some(outcome) => outcome.map_err(|failure| failure.to_string()),
        });
    }
    Ok(told)
}

/// One run: kept where it is finished, gone on with where it is begun.
fn one(
    run: &Run,
    output: &Path,
    every: Duration,
    interrupted: &(dyn Fn() -> bool + Sync),
) -> Result<Report, Failure> {
    if let Ok(report) = Report::read(output.join(polycore::report::FILE_NAME))
        && report.provenance.scene == run.source.text
    {
        return Ok(report);
    }
    let begun = |header: Header| header.scene == run.source.text;
    let resume = checkpoint::header(output).is_ok_and(begun);
    let mut progress = |_: &super::Progress| {};
    let mut options = Options {
        output,
        quick: false,
        checkpoint_every: every,
        resume,
        interrupted,
        progress: &mut progress,
    };
    let (source, scene) = run.source.parse::<PartScene>()?.of_study(&run.source, 0)?;
    part::one(&source, &scene, Some(&run.name), &mut options)
}

/// Every statistic of every run, and as curves against the number of the run.
fn together(source: &Source, vary: &[Vary], rows: &Rows) -> Report {
    let mut report = Report::new("crystfem", env!("CARGO_PKG_VERSION"), &source.text);
    let finished = || rows.rows.iter().filter_map(|row| Some((row, row.outcome.as_ref().ok()?)));
    let numbers: Vec<f64> =
        rows.rows.iter().zip(1..).filter(|(row, _)| row.outcome.is_ok()).map(|(_, k)| f64::from(k)).collect();
    let mut columns = vec![("run".to_owned(), String::new(), numbers)];
    for (index, vary) in vary.iter().enumerate() {
        if let Some((values, unit)) = numeric(&vary.values) {
            let of = |text: &String| values[vary.values.iter().position(|v| v == text).unwrap_or(0)];
            let list = finished().map(|(row, _)| of(&row.settings[index])).collect();
            columns.push((vary.key.clone(), unit, list));
        }
    }
    for field in rows.fields() {
        for statistic in STATISTICS {
            let name = format!("{statistic}{field}");
            let list = finished().map(|(_, report)| report.scalar(&name).unwrap_or(0.0)).collect();
            columns.push((name, String::new(), list));
        }
    }
    let views: Vec<(&str, &str, Vec<f64>)> =
        columns.iter().map(|(name, unit, list)| (name.as_str(), unit.as_str(), list.clone())).collect();
    report.curve("sweep", &views);
    report.value("failed_runs", (rows.rows.len() - finished().count()) as f64, "");
    report.work("runs", rows.rows.len() as u64);
    report.work("steps", finished().filter_map(|(_, own)| own.work.get("steps")).sum());
    report
}

/// The numbers of values that have one unit, and the unit.
fn numeric(values: &[String]) -> Option<(Vec<f64>, String)> {
    let split = |text: &String| -> Option<(f64, String)> {
        let end = text.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).unwrap_or(text.len());
        Some((text[..end].parse().ok()?, text[end..].trim().to_owned()))
    };
    let all: Vec<(f64, String)> = values.iter().map(split).collect::<Option<_>>()?;
    let unit = all.first()?.1.clone();
    all.iter().all(|(_, other)| *other == unit).then(|| (all.iter().map(|(x, _)| *x).collect(), unit))
}

/// sweep_FIELD.png: mean, least and largest at the end (the mean only where several keys vary), and
/// sweep_deviation_of_FIELD.png, against the first key, with a line for each combination of the others.
fn draw(vary: &[Vary], rows: &Rows, output: &Path) -> Result<(), polycore::Error> {
    let Some(first) = vary.first().filter(|vary| vary.values.len() > 1) else { return Ok(()) };
    let (places, label) = match numeric(&first.values) {
        Some((places, unit)) if unit.is_empty() => (places, first.key.clone()),
        Some((places, unit)) => (places, format!("{} [{}]", first.key, unit.replace("degC", "°C"))),
        None => {
            let names = first.values.join(", ");
            ((1..=first.values.len()).map(|k| k as f64).collect(), format!("{}: {names}", first.key))
        }
    };
    let mut others: Vec<String> = rows.rows.iter().map(|row| row.settings[1..].join(", ")).collect();
    others.dedup();
    others.sort();
    others.dedup();
    for field in rows.fields() {
        let line = |other: &String, statistic: &str| {
            let mut points: Vec<(f64, f64)> = rows
                .rows
                .iter()
                .filter(|row| row.settings[1..].join(", ") == *other)
                .filter_map(|row| {
                    let value = row.outcome.as_ref().ok()?.scalar(&format!("{statistic}{field}"))?;
                    Some((places[first.values.iter().position(|v| *v == row.settings[0])?], value))
                })
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            let name = [statistic.trim_end_matches("_of_").trim_end_matches('_'), other];
            let name: Vec<&str> = name.into_iter().filter(|part| !part.is_empty()).collect();
            let name = name.join(", ").replace("degC", " °C");
            let (x, y): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
            Series::marked_line(&name, &x, &y)
        };
        let plot = |statistics: &[&str], what: &str| {
            let mut plot = LinePlot::new("At the end").axes(&label, what).size(800.0, 480.0);
            for other in &others {
                for statistic in statistics {
                    plot = plot.series(line(other, statistic));
                }
            }
            plot
        };
        let unit = if field == "temperature" {
            ["temperature [°C]", "deviation of temperature [K]"]
        } else {
            ["", ""]
        };
        let what = if unit[0].is_empty() { field.as_str() } else { unit[0] };
        let shown = if others.len() > 1 { &STATISTICS[..1] } else { &STATISTICS[..3] };
        plot(shown, what).write(output.join(format!("sweep_{field}.png")))?;
        let deviation = format!("deviation of {field}");
        let what = if unit[1].is_empty() { deviation.as_str() } else { unit[1] };
        plot(&STATISTICS[3..], what).write(output.join(format!("sweep_deviation_of_{field}.png")))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_and_values() {
        let of = |text: &str| text.parse::<Vary>();
        let values = |text: &str| of(text).unwrap().values;
        assert_eq!(of("print.layer_time=10s, 20 s").unwrap().key, "print.layer_time");
        assert_eq!(values("a=10s, 20 s"), ["10s", "20 s"]);
        assert_eq!(values("a=[1,2],[3,4]"), ["[1,2]", "[3,4]"]);
        assert_eq!(values("a={x=[1,2],y=2},\"p,q\""), ["{x=[1,2],y=2}", "\"p,q\""]);
        for wrong in ["a", "a=", "=1", "a=1,,2", "a=1,1"] {
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
