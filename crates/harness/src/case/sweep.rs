//! Many runs of one scene over a grid of values: in parallel, one thread each; finished ones are kept.

use super::rows::{Row, Rows, key_and_unit};
use super::terminal::WIDTH;
use super::{Case, Fault, Finished, Options, Program};
use crate::report::{Phases, Report};
use crate::scene::{Failure, Source};
use crate::study::{grid, named};
use polycore::Error;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::str::FromStr;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

mod one;
mod sample;
mod search;
mod shard;
mod table;

crate::quantities! {
    /// Scalars that reports of sweeps have, whatever the program.
    pub OF_SWEEPS:
    FAILED_RUNS = "failed_runs", "", "runs of a sweep that ended with an error";
    LEAST_VALUE = "least_value", "*", "least value that a search found to meet all expectations";
}

use one::{Run, quoted};
pub use sample::{OF_SAMPLES, Sample, drawn};
pub use search::{Search, search};
pub use shard::{Part, Shard, job};
use table::{draw, together};

/// The table of a sweep, in its folder.
const TABLE: &str = "sweep.csv";
/// Runs of a sweep at most.
const MOST: usize = 10_000;

/// A key of the scene and the values that it takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Vary {
    /// Path of the key: `print.layer_time`, `boundary[1].film`.
    pub key: String,
    /// The values as the user wrote them.
    pub values: Vec<String>,
    /// True for draws from a [`Sample`], over which the sweep computes bands.
    pub drawn: bool,
}

impl FromStr for Vary {
    type Err = String;

    /// Parses `KEY=VALUE,VALUE,…`; commas in brackets, braces and quotes belong to a value. Keys that change
    /// together stand behind one another, `KEY=A,B;OTHER=C,D`, with as many values each: the values are then
    /// `A;C` and `B;D`.
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
    /// Returns the keys, several if they change together.
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

/// Options of a sweep.
pub struct SweepOptions<'a> {
    /// Folder of the results; each run has a folder of its own in it.
    pub output: &'a Path,
    /// Further values to report, by name; `*` stands for any text.
    pub columns: &'a [String],
    /// Leave out what is marked `quick = false`.
    pub quick: bool,
    /// Part of the sweep to compute.
    pub part: Part,
    /// Time between checkpoints of each run.
    pub checkpoint_every: Duration,
    /// Returns true once the user has asked to stop.
    pub interrupted: &'a (dyn Fn() -> bool + Sync),
    /// Sees how many of how many runs are done, and the name of the last.
    pub progress: &'a mut (dyn FnMut(usize, usize, &str) + Send),
}

/// Runs a scene for every combination of values; those that an earlier sweep into the same folder has
/// finished are kept.
///
/// # Errors
/// Faults of the scene or of a key, before anything is run; [`Error::SweepInterrupted`]. What ends a single
/// run does not end the sweep: its row says so, and the report fails.
pub fn sweep<C: Case>(
    source: &Source,
    vary: &[Vary],
    options: &mut SweepOptions,
) -> Result<Finished, Failure<C::Error>> {
    let (rows, bands, report) = rows::<C>(source, vary, options)?;
    let table = rows.short_text(WIDTH) + &bands;
    Ok(Finished { table: Some(table), ..Finished::new(report, rows.text() + &bands) })
}

/// [`sweep`], and its rows: those requested first, in their order. And the bands of what was sampled.
fn rows<C: Case>(
    source: &Source,
    vary: &[Vary],
    options: &mut SweepOptions,
) -> Result<(Rows, String, Report), Failure<C::Error>> {
    let mut runs = runs::<C>(source, vary, options.quick)?;
    if let Part::Shard(shard) = options.part {
        let mut numbers = 0..runs.len();
        runs.retain(|_| numbers.next().is_some_and(|number| shard.contains(number)));
        polycore::file::prepare_directory(options.output)?;
        let _lock = crate::case::share_run(options.output)?;
        let rows = rows_of(&C::PROGRAM, &runs, solve::<C>(&runs, options)?, vary, options);
        let mut report = together(&C::PROGRAM, source, vary, &rows);
        report.passed &= rows.passed();
        return Ok((rows, String::new(), report));
    }
    if options.part == Part::Merge
        && let Some((number, run)) = (1..).zip(&runs).find(|(_, run)| run.finished(options.output).is_none())
    {
        let reason = format!(
            "found run {number} of {}, {}, unfinished or of another scene; allowed: finished runs, of \
             `--shard 1/N` to `--shard N/N` into {}",
            runs.len(),
            run.name,
            options.output.display()
        );
        return Err(Error::Option { option: "--merge".into(), reason }.into());
    }
    let former = former(vary, options.output)?;
    polycore::file::prepare_directory(options.output)?;
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
    let rows = rows_of(&C::PROGRAM, &runs, outcomes, vary, options);
    rows.write(&options.output.join(TABLE))?;
    draw(vary, &rows, options.output)?;
    let mut report = together(&C::PROGRAM, source, vary, &rows);
    let bands = sample::bands(vary, &rows, options.output, &mut report)?;
    phases.stop();
    report.phases(&phases).threads(rayon::current_num_threads());
    report.passed &= rows.passed();
    report.write(options.output)?;
    Ok((rows, bands, report))
}

fn rows_of(
    program: &Program,
    runs: &[Run],
    outcomes: Vec<Result<Report, String>>,
    vary: &[Vary],
    options: &SweepOptions,
) -> Rows {
    let own = program.columns.iter().map(|&name| name.to_owned());
    let row =
        |(run, outcome): (&Run, _)| Row { name: run.name.clone(), settings: run.values.clone(), outcome };
    Rows {
        settings: vary.iter().map(|vary| vary.key.clone()).collect(),
        columns: own.chain(options.columns.to_vec()).collect(),
        rows: runs.iter().zip(outcomes).map(row).collect(),
    }
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
    let set = |(name, _): &(&str, &str)| {
        divided(name, ';').iter().all(|key| scene.contains(&format!("{} = ", quoted(key))))
    };
    let (keys, units): (Vec<&str>, Vec<&str>) = head.iter().skip(1).map(key_and_unit).take_while(set).unzip();
    if vary.iter().map(|vary| vary.key.as_str()).eq(keys.iter().copied()) {
        let values = |row: &csv::StringRecord| {
            row.iter().skip(1).zip(&units).map(|(value, unit)| format!("{value}{unit}")).collect()
        };
        return Ok(rows.iter().map(values).collect());
    }
    let reason =
        format!("found a sweep over {}; allowed: one over the same keys, or another folder", keys.join(", "));
    Err(Error::Option { option: format!("--output {}", output.display()), reason })
}

/// Returns the runs of a grid, each checked.
fn runs<C: Case>(source: &Source, vary: &[Vary], quick: bool) -> Result<Vec<Run>, Failure<C::Error>> {
    let keys: Vec<String> = vary.iter().flat_map(Vary::keys).collect();
    if let Some(twice) = (1..keys.len()).find(|&k| keys[..k].contains(&keys[k])) {
        let reason = "found the key twice; allowed: each key once, with all its values".to_owned();
        return Err(Error::Option { option: format!("--vary {}", keys[twice]), reason }.into());
    }
    let count = vary.iter().map(|vary| vary.values.len()).try_fold(1, usize::checked_mul);
    if count.is_none_or(|count| count > MOST) {
        let found: f64 = vary.iter().map(|vary| vary.values.len() as f64).product();
        let reason = format!("found {found} runs; allowed: 1 to {MOST}");
        let option = "--vary".to_owned();
        return Err(Error::Option { option, reason }.into());
    }
    let mut runs: Vec<Run> = Vec::new();
    for places in grid(&vary.iter().map(|vary| vary.values.len()).collect::<Vec<_>>()) {
        let values: Vec<String> =
            vary.iter().zip(places).map(|(vary, place)| vary.values[place].clone()).collect();
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

/// Each run on a thread of its own, as many at once as there are threads.
fn solve<C: Case>(
    runs: &[Run],
    options: &mut SweepOptions,
) -> Result<Vec<Result<Report, String>>, Failure<C::Error>> {
    let SweepOptions { output, quick, checkpoint_every, interrupted, .. } = *options;
    let next = AtomicUsize::new(0);
    let finished = Mutex::new((BTreeMap::new(), &mut *options.progress));
    let work = || {
        while !interrupted() {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(run) = runs.get(index) else { break };
            let directory = &output.join(&run.name);
            let one = Options { quick, checkpoint_every, interrupted, ..Options::new(directory) };
            let outcome = run.solve::<C>(output, one);
            let (outcomes, progress) = &mut *finished.lock().unwrap_or_else(PoisonError::into_inner);
            outcomes.insert(index, outcome);
            progress(outcomes.len(), runs.len(), &run.name);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..rayon::current_num_threads().min(runs.len()) {
            // not rayon's own threads: one that waits would take up a second run on top of its first
            scope.spawn(|| {
                // a pool of this thread alone, which is in no other
                let _pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
                work();
            });
        }
    });
    let (outcomes, _) = finished.into_inner().unwrap_or_else(PoisonError::into_inner);
    let stopped = |outcome: &Result<Report, Failure<C::Error>>| match outcome {
        Err(Failure::Run(error)) => error.is_interruption(),
        _ => false,
    };
    if outcomes.len() < runs.len() || outcomes.values().any(stopped) {
        return Err(Error::SweepInterrupted(output.to_path_buf()).into());
    }
    Ok(outcomes.into_values().map(|outcome| outcome.map_err(|failure| failure.to_string())).collect())
}

/// `layer_time-10s_film-20W_m_2_K`, of values of keys; `to-8mm_0mm` of a list of them.
fn name(vary: &[Vary], values: &[String]) -> String {
    let each = vary.iter().flat_map(Vary::keys).zip(values.iter().flat_map(|value| divided(value, ';')));
    let name = each.map(|(key, value)| named(&key, &value)).collect::<Vec<_>>().join("_");
    // brackets and quotes leave several underscores, and some behind a hyphen
    let pieces = name.split('_').filter(|piece| !piece.is_empty());
    pieces.collect::<Vec<_>>().join("_").replace("-_", "-")
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
        let linked = of("print.layer_time=5s,10s; time.end = 60s,120s").unwrap();
        assert_eq!((linked.key.as_str(), linked.keys().len()), ("print.layer_time;time.end", 2));
        assert_eq!(linked.values, ["5s;60s", "10s;120s"]);
        assert_eq!(name(&[linked], &["5s;60s".into()]), "layer_time-5s_end-60s");
        let list = of("boundary[1].to=[\"-8 mm\", \"0 mm\"]").unwrap();
        assert_eq!(name(std::slice::from_ref(&list), &list.values), "to--8mm_0mm");
        for wrong in ["a", "a=", "=1", "a=1,,2", "a=1,1", "a=1,2;b=3", "a=1;"] {
            assert!(of(wrong).unwrap_err().contains("allowed"), "{wrong}");
        }
    }
}
