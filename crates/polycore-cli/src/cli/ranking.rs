//! Ranking of laws by their predictions of modes of deformation left out of the fit.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use harness::case::Run;
use harness::report::Report;
use polycore::constitutive::hyperelastic::fit::Fit;
use polycore::constitutive::hyperelastic::ranking::CrossValidation;
use polycore::file::atomic_write;
use polycore::{Error, constitutive};

use super::data::DataSet;
use super::material::digits;
use super::quantities as q;
use super::verdict::FitVerdict;

/// Law with its errors in modes of deformation, relative to the largest stress of each.
pub struct RankedLaw {
    pub key: &'static str,
    parameters: usize,
    /// Errors of the fit to all modes.
    fitted: Vec<Option<f64>>,
    found: CrossValidation,
    /// Reason not to take the law.
    obstacle: Option<String>,
}

/// Error up to which a prediction of a mode left out counts as safe.
const SAFE_ERROR: f64 = 0.1;

/// Ranks laws fitted to a table by their largest error in a mode left out; laws without one come last.
///
/// # Errors
/// [`constitutive::Error::Stopped`].
pub fn rank<'a>(
    set: &DataSet,
    fits: impl Iterator<Item = (&'a Fit, &'a FitVerdict)>,
    run: &Run,
) -> Result<Vec<RankedLaw>, constitutive::Error> {
    let mut laws = Vec::new();
    for (fit, verdict) in fits.filter(|_| !set.modes.is_empty()) {
        laws.push(RankedLaw {
            key: fit.model.key,
            parameters: fit.parameters.len(),
            fitted: set.modes.iter().map(|mode| mode.error(&fit.law)).collect(),
            found: CrossValidation::new(fit.model, &set.modes, run.options.interrupted)?,
            obstacle: verdict.obstacle(),
        });
    }
    let error = |law: &RankedLaw| law.found.worst().unwrap_or(f64::INFINITY);
    laws.sort_by(|a, b| error(a).total_cmp(&error(b)).then(a.parameters.cmp(&b.parameters)));
    Ok(laws)
}

/// Records the errors and the rank of each law.
pub fn record(set: &DataSet, laws: &[RankedLaw], report: &mut Report) {
    for (rank, law) in (1..).zip(laws) {
        let key = format!("{}.{}", set.name, law.key);
        report.value(q::RANK.named(&[&key]), f64::from(rank));
        if let Some(error) = law.found.worst() {
            report.value(q::LEFT_OUT.named(&[&key]), error);
        }
        for (i, mode) in set.modes.iter().enumerate() {
            for (quantity, error) in [
                (q::MODE_FITTED, law.fitted[i]),
                (q::MODE_LEFT_OUT, law.found.left_out[i]),
                (q::MODE_ALONE, law.found.alone[i]),
            ] {
                if let Some(error) = error {
                    report.value(quantity.named(&[&key, mode.mode]), error);
                }
            }
        }
    }
}

/// Lists the names of the scalars of a law.
pub fn quantities(set: &DataSet, law: &str) -> Vec<String> {
    let key = format!("{}.{law}", set.name);
    let mut names = Vec::new();
    for mode in &set.modes {
        let all = [q::MODE_FITTED, q::MODE_LEFT_OUT, q::MODE_ALONE];
        names.extend(all.map(|quantity| quantity.named(&[&key, mode.mode]).name));
    }
    if !set.modes.is_empty() {
        names.extend([q::RANK, q::LEFT_OUT].map(|quantity| quantity.named(&[&key]).name));
    }
    names
}

fn percent(error: Option<f64>) -> String {
    match error {
        Some(error) if error < 10.0 => format!("{} %", digits(100.0 * error, 2)),
        Some(error) => format!("{error:.0e} ×"),
        None => "-".to_owned(),
    }
}

/// Formats the table of errors: of fits to the other modes, in brackets of the fit to all.
pub fn table(set: &DataSet, laws: &[RankedLaw]) -> String {
    let mut text = format!(
        "laws ranked on {} by the largest error in a mode left out; error: rms over the largest stress of \
         the mode, of a fit to the other modes (of the fit to all)\n{:<22}{:>3}{:>10}",
        set.name, "law", "k", "largest"
    );
    set.modes.iter().for_each(|mode| {
        let _ = write!(text, "{:>22}", mode.mode);
    });
    text.push('\n');
    for law in laws {
        let _ = write!(text, "{:<22}{:>3}{:>10}", law.key, law.parameters, percent(law.found.worst()));
        for (left_out, fitted) in law.found.left_out.iter().zip(&law.fitted) {
            let _ = write!(text, "{:>22}", format!("{} ({})", percent(*left_out), percent(*fitted)));
        }
        let _ = writeln!(text, "{}", law.obstacle.as_ref().map_or(String::new(), |why| format!("  {why}")));
    }
    text
}

/// Returns the first law that predicts every mode and passes the checks.
pub fn best(laws: &[RankedLaw]) -> Option<&RankedLaw> {
    laws.iter().find(|law| law.obstacle.is_none() && law.found.worst().is_some())
}

/// Says which law to take, and which are safe after tests of one mode.
pub fn advice(set: &DataSet, laws: &[RankedLaw]) -> String {
    let Some(best) = best(laws) else {
        return match laws {
            [] => String::new(),
            _ => format!("{}: no law to take: each fails a mode left out or a check\n", set.name),
        };
    };
    let list: Vec<String> = set
        .modes
        .iter()
        .zip(&best.found.left_out)
        .map(|(mode, error)| format!("{} {}", mode.mode, percent(*error)))
        .collect();
    let safe = |error: Option<f64>| error.is_some_and(|error| error <= SAFE_ERROR);
    let verdict = match safe(best.found.worst()) {
        true => format!("take {}", best.key),
        false => format!("{} is the best law, but unsafe in modes without data", best.key),
    };
    let mut text = format!(
        "{}: {verdict}; it predicts each mode left out within {} of its largest stress ({})\n",
        set.name,
        percent(best.found.worst()),
        list.join(", ")
    );
    for (i, mode) in set.modes.iter().enumerate() {
        let held = |law: &&RankedLaw| law.obstacle.is_none() && safe(law.found.alone[i]);
        let mut those: Vec<&RankedLaw> = laws.iter().filter(held).collect();
        those.sort_by(|a, b| a.found.alone[i].unwrap_or(0.0).total_cmp(&b.found.alone[i].unwrap_or(0.0)));
        let names: Vec<String> = those
            .iter()
            .take(MOST_NAMED)
            .map(|law| format!("{} ({})", law.key, percent(law.found.alone[i])))
            .collect();
        let _ = match names.is_empty() {
            true => writeln!(text, "  all laws are unsafe outside {} tests", mode.mode),
            false => writeln!(
                text,
                "  fitted to {} tests alone, safe: {}; unsafe: the other {}",
                mode.mode,
                names.join(", ") + if those.len() > MOST_NAMED { ", …" } else { "" },
                laws.len() - those.len()
            ),
        };
    }
    text
}

/// Laws named in a line of advice.
const MOST_NAMED: usize = 3;

/// Writes `NAME_ranking.csv`: a row for each law, errors relative to the largest stress of each mode.
///
/// # Errors
/// A file that cannot be written.
pub fn write(directory: &Path, set: &DataSet, laws: &[RankedLaw]) -> Result<(), Error> {
    let cell = |error: Option<f64>| error.map_or_else(String::new, |error| digits(error, 5));
    atomic_write(directory.join(format!("{}_ranking.csv", set.name)), |file| {
        let columns = |kind: &str| -> String {
            set.modes.iter().map(|mode| format!(",{kind}_{}", mode.mode.replace('-', "_"))).collect()
        };
        let heads = ["left_out", "fitted", "alone"].map(columns).concat();
        writeln!(file, "rank,law,parameters,left_out_largest{heads},obstacle")?;
        for (rank, law) in (1..).zip(laws) {
            let errors = [&law.found.left_out, &law.fitted, &law.found.alone];
            let cells: String =
                errors.into_iter().flatten().map(|error| format!(",{}", cell(*error))).collect();
            let why = law.obstacle.as_deref().unwrap_or_default();
            writeln!(
                file,
                "{rank},{},{},{}{cells},\"{why}\"",
                law.key,
                law.parameters,
                cell(law.found.worst())
            )?;
        }
        Ok(())
    })
}
