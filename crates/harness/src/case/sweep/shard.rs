//! A sweep over many machines: each takes every n-th run, one puts them together.

use super::{SweepOptions, Vary, runs};
use crate::case::Case;
use crate::scene::{Failure, Source};
use polycore::Error;
use std::path::Path;
use std::str::FromStr;

/// Parts at most.
const MOST: usize = 10_000;

/// Every `of`-th run from number `index` on, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    of: usize,
}

/// Part of a sweep to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Part {
    /// All runs, and their table.
    #[default]
    Whole,
    /// Some of the runs, without a table.
    Shard(Shard),
    /// The table, of runs that are all finished.
    Merge,
}

impl FromStr for Shard {
    type Err = String;

    /// Parses `I/N`.
    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match numbers {
            Some((index, of)) if (1..=of).contains(&index) && of <= MOST => Ok(Self { index, of }),
            _ => Err(format!("found `{text}`; allowed: I/N, part I of N, e.g. 1/8 to 8/8")),
        }
    }
}

impl Shard {
    /// Returns whether the part contains a run, counted from 0.
    pub fn contains(&self, run: usize) -> bool {
        run % self.of == self.index - 1
    }
}

/// Checks a sweep and writes `job.sh`, a SLURM job array of so many parts of it, into its folder; gives a
/// line that says how to submit it. `command` is the command line of the sweep.
///
/// # Errors
/// Faults of the scene or of a key; the folder cannot be written to.
pub fn job<C: Case>(
    source: &Source,
    vary: &[Vary],
    options: &SweepOptions,
    command: &[String],
    parts: usize,
) -> Result<String, Failure<C::Error>> {
    let runs = runs::<C>(source, vary, options.quick)?.len();
    polycore::file::prepare_directory(options.output)?;
    let here = std::env::current_dir().map_err(Error::from_io("read", "."))?;
    let text = script(command, &here, &here.join(options.output), parts.min(runs));
    let path = options.output.join("job.sh");
    polycore::file::atomic_write(&path, |file| std::io::Write::write_all(file, text.as_bytes()))?;
    Ok(format!("{runs} runs in {} parts: sbatch {}", parts.min(runs), path.display()))
}

/// Returns a SLURM job array of a sweep: `command` is its command line without `--slurm`, to be started in
/// `folder`.
fn script(command: &[String], folder: &Path, output: &Path, of: usize) -> String {
    let quoted = |text: &str| format!("'{}'", text.replace('\'', "'\\''"));
    let line: Vec<String> = command.iter().map(|word| quoted(word)).collect();
    let (line, folder) = (line.join(" "), quoted(&folder.display().to_string()));
    let log = output.join("slurm-%A_%a.txt");
    format!(
        "#!/bin/sh
# Submit:         sbatch job.sh (again after an interruption: finished runs are kept)
# Then, once:     cd {folder} && {line} --merge
#SBATCH --job-name=sweep
#SBATCH --array=1-{of}
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --time=12:00:00
#SBATCH --output={log}
cd {folder} || exit 2
exec {line} --threads \"${{SLURM_CPUS_PER_TASK:-1}}\" --shard \"$SLURM_ARRAY_TASK_ID/{of}\"
",
        log = log.display()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_share_all_runs() {
        let of = |text: &str| text.parse::<Shard>();
        let shards: Vec<Shard> = ["1/3", "2/3", "3/3"].map(|text| of(text).unwrap()).into();
        for run in 0..10 {
            assert_eq!(shards.iter().filter(|shard| shard.contains(run)).count(), 1);
        }
        for wrong in ["", "1", "0/3", "4/3", "1/0", "-1/3", "a/b", "1/3/3", "1/100000"] {
            assert!(of(wrong).unwrap_err().contains("allowed"), "{wrong}");
        }
    }
}
