//! The command line that all programs have: run, resume, check, sweep, schema, completions, and a program's
//! own commands.

use super::inputs::{InputArguments, attach, describe};
use super::summary::summary;
use super::terminal::{
    self, Progress, Threads, default_output, exit, interrupted, seconds, with_negative_numbers,
};
use super::{Case, Options, Part, Sample, Search, Shard, SweepOptions, Vary};
use crate::checkpoint::Header;
use crate::scene::{Failure, SceneError, Source};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use polycore::Error;
use polycore::file::prepare_directory;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

#[derive(Parser)]
struct Cli<V: Subcommand> {
    #[command(subcommand)]
    command: Command<V>,
    #[command(flatten)]
    threads: Threads,
    /// Show all values and expectations of a run, not only the main ones.
    #[arg(long, global = true, display_order = 101)]
    verbose: bool,
}

#[derive(Subcommand)]
enum Command<V: Subcommand> {
    /// Run a scene, compare, draw, and judge its expectations.
    Run(RunArguments),
    /// Continue an interrupted or killed run; the results are bit-identical.
    Resume {
        /// The output directory of that run.
        output: PathBuf,
        #[command(flatten)]
        checkpoints: Checkpoints,
    },
    /// Validate a scene and print what it builds and leaves out.
    Check {
        /// The scene (TOML).
        scene: PathBuf,
        /// Check as `run --quick` would.
        #[arg(long)]
        quick: bool,
        #[command(flatten)]
        inputs: InputArguments,
    },
    /// Run a scene for every combination of values of some keys, in parallel; finished runs are kept.
    Sweep(Box<SweepArguments>),
    /// Write one HTML page that shows a run: solids that turn, step by step, beside the curves.
    View {
        /// The output directory of the run, finished or not.
        output: PathBuf,
        /// The page; default: view.html in that directory.
        #[arg(long, value_name = "FILE")]
        html: Option<PathBuf>,
    },
    #[command(flatten)]
    Own(V),
    /// Print the JSON Schema of scenes for editors.
    Schema,
    /// Print a shell's completion script.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Write man pages, one for the program and one for each of its commands.
    Man {
        /// Folder for the pages.
        output: PathBuf,
    },
}

/// A scene and where its results go.
#[derive(clap::Args)]
pub struct RunArguments {
    /// The scene (TOML).
    pub scene: PathBuf,
    /// Directory for results; default: out/NAME after the scene's folder.
    #[arg(long, short)]
    output: Option<PathBuf>,
    /// Leave out what the scene marks `quick = false`.
    #[arg(long)]
    quick: bool,
    /// First print what the scene builds and leaves out.
    #[arg(long)]
    explain: bool,
    #[command(flatten)]
    checkpoints: Checkpoints,
    /// First run the scenes of `[inputs]` whose results are missing or stale.
    #[arg(long)]
    with_inputs: bool,
    #[command(flatten)]
    inputs: InputArguments,
}

#[derive(clap::Args)]
struct SweepArguments {
    /// The scene (TOML).
    scene: PathBuf,
    /// A key of the scene and its values, e.g. print.layer_time=10s,20s,40s; several make a grid, and keys
    /// joined with `;` change together.
    #[arg(long, value_name = "KEY=VALUE,…", required_unless_present_any = ["search", "sample"])]
    vary: Vec<Vary>,
    /// A table of the scene and a CSV file with draws of its keys, such as a fit writes, e.g.
    /// materials.pa12.kinetics=out/fit/nakamura_posterior.csv: gives the band of every value; may be
    /// repeated.
    #[arg(long, value_name = "KEY=FILE", conflicts_with = "search")]
    sample: Vec<Sample>,
    /// Draws of the samples to run; default: 20, or all of a shorter file.
    #[arg(long, requires = "sample")]
    count: Option<usize>,
    /// Find the least value of a key that satisfies all expectations instead, e.g. print.layer_time=5s..40s.
    #[arg(long, value_name = "KEY=LOW..HIGH", conflicts_with_all = ["vary", "shard", "merge", "slurm"])]
    search: Option<Search>,
    /// Compute only part I of N, every N-th run, into the folder that all parts share, and write no table.
    #[arg(long, value_name = "I/N", conflicts_with_all = ["merge", "slurm"])]
    shard: Option<Shard>,
    /// Write the table of a sweep whose parts are all finished; compute nothing.
    #[arg(long, conflicts_with = "slurm")]
    merge: bool,
    /// Write job.sh, a SLURM job array of N parts, into the folder of results; compute nothing.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    slurm: Option<u16>,
    /// A further value to show for each run, e.g. layer-*.mean_crystallinity; may be repeated.
    #[arg(long, value_name = "NAME")]
    column: Vec<String>,
    /// Directory for results; default: out/NAME-sweep.
    #[arg(long, short)]
    output: Option<PathBuf>,
    /// Leave out what the scene marks `quick = false`.
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    checkpoints: Checkpoints,
    #[command(flatten)]
    inputs: InputArguments,
}

#[derive(clap::Args)]
struct Checkpoints {
    /// Seconds between checkpoints.
    #[arg(long = "checkpoint-every", value_name = "SECONDS", default_value_t = 30.0, value_parser = seconds)]
    every: f64,
}

impl Checkpoints {
    fn every(&self) -> Duration {
        Duration::from_secs_f64(self.every)
    }
}

/// The main function of a program: its commands on scenes, and `own`, which runs its own commands `V`. Each
/// gives whether it passed.
pub fn main<C: Case, V: Subcommand>(own: impl FnOnce(V) -> Result<bool, Failure<C::Error>>) -> ExitCode {
    let program = C::PROGRAM;
    let mut command = with_negative_numbers(Cli::<V>::command())
        .name(program.name)
        .version(program.version)
        .about(program.about)
        .after_help(format!(
            "Examples:\n{}\n\n\
             Exit codes: 0 done, 1 an expectation or the run failed, 2 bad input, 130 interrupted.",
            program.examples
        ));
    let matches = command.clone().get_matches();
    let cli = Cli::<V>::from_arg_matches(&matches).unwrap_or_else(|error| error.format(&mut command).exit());
    if let Err(error) = cli.threads.apply() {
        terminal::complain(format_args!("error: {error}\n"));
        return ExitCode::FAILURE;
    }
    exit(match cli.command {
        Command::Run(arguments) => read_scene::<C>(&arguments.scene)
            .map_err(Failure::from)
            .and_then(|source| run_shown::<C>(&source, &arguments, cli.verbose)),
        Command::Resume { output, checkpoints } => resume::<C>(&output, checkpoints.every(), cli.verbose),
        Command::Check { scene, quick, inputs } => check::<C>(&scene, quick, &inputs),
        Command::Sweep(arguments) => sweep::<C>(*arguments, cli.verbose),
        Command::View { output, html } => show::<C>(&output, html.as_deref()),
        Command::Own(command) => own(command),
        Command::Schema => {
            crate::say!("{:#}", C::schema());
            Ok(true)
        }
        Command::Completions { shell } => {
            let mut text = Vec::new();
            clap_complete::generate(shell, &mut command, program.name, &mut text);
            terminal::print(String::from_utf8_lossy(&text));
            Ok(true)
        }
        Command::Man { output } => prepare_directory(&output)
            .and_then(|()| {
                clap_mangen::generate_to(command, &output).map_err(Error::from_io("write into", &output))
            })
            .map(|()| true)
            .map_err(Failure::from),
    })
}

/// Runs a scene that is read, as `run` does.
///
/// # Errors
/// [`Failure`].
pub fn solve<C: Case>(source: &Source, arguments: &RunArguments) -> Result<bool, Failure<C::Error>> {
    run_shown::<C>(source, arguments, false)
}

fn run_shown<C: Case>(
    source: &Source,
    arguments: &RunArguments,
    verbose: bool,
) -> Result<bool, Failure<C::Error>> {
    let RunArguments { scene, output, quick, explain, checkpoints, with_inputs, inputs } = arguments;
    let output = output.clone().unwrap_or_else(|| default_output(scene));
    let source = &attach::<C>(source.clone(), &output, *quick, inputs, *with_inputs)?;
    if *explain {
        explain_all::<C>(source, &output, *quick, inputs)?;
    }
    finish::<C>(source, &output, (*quick, false), checkpoints.every(), verbose)
}

fn resume<C: Case>(output: &Path, every: Duration, verbose: bool) -> Result<bool, Failure<C::Error>> {
    if terminal::is_finished(output) {
        return Ok(true);
    }
    let header = Header::read(output, C::PROGRAM.magic)?;
    header.check(output)?;
    let source = Source::new(header.scene_path, header.scene).with_inputs(header.stamp.inputs);
    finish::<C>(&source, output, (header.quick, true), every, verbose)
}

fn finish<C: Case>(
    source: &Source,
    output: &Path,
    (quick, resume): (bool, bool),
    checkpoint_every: Duration,
    verbose: bool,
) -> Result<bool, Failure<C::Error>> {
    let begun = Instant::now();
    let mut bar = Progress::start();
    let mut progress = |part: f64, line: &dyn Fn() -> String| bar.show(part, line);
    let interrupted = interrupted();
    let options = Options {
        quick,
        resume,
        checkpoint_every,
        interrupted,
        progress: Some(&mut progress),
        ..Options::new(output)
    };
    let finished = super::run::<C>(source, options)?;
    bar.finish();
    if verbose {
        terminal::print(format_args!("{}results in {}\n", finished.text, output.display()));
    } else {
        let style = terminal::TerminalStyle::of_output();
        terminal::print(summary(&C::PROGRAM, source, &finished, output, begun.elapsed(), &style));
    }
    Ok(finished.report.passed())
}

/// Reads a scene, or makes that of a table.
fn read_scene<C: Case>(path: &Path) -> Result<Source, SceneError> {
    match C::scene_of_table(path).filter(|_| Source::is_table(path) && path.is_file()) {
        Some(text) => Ok(Source::new(path, text)),
        None => Source::read(path),
    }
}

fn check<C: Case>(path: &Path, quick: bool, inputs: &InputArguments) -> Result<bool, Failure<C::Error>> {
    let (source, output) = (read_scene::<C>(path)?, default_output(path));
    let source = attach::<C>(source, &output, quick, inputs, false)?;
    explain_all::<C>(&source, &output, quick, inputs)?;
    crate::say!("{}: the scene is valid", path.display());
    Ok(true)
}

fn explain_all<C: Case>(
    source: &Source,
    output: &Path,
    quick: bool,
    inputs: &InputArguments,
) -> Result<(), Failure<C::Error>> {
    let lines = C::explain(source, quick)?;
    describe(source, output, quick, inputs)?;
    lines.into_iter().for_each(|line| crate::say!("{line}"));
    Ok(())
}

fn show<C: Case>(output: &Path, html: Option<&Path>) -> Result<bool, Failure<C::Error>> {
    let page = crate::view::write(output, html)?;
    crate::say!("{}: open it in a browser", page.display());
    Ok(true)
}

fn sweep<C: Case>(arguments: SweepArguments, verbose: bool) -> Result<bool, Failure<C::Error>> {
    let SweepArguments { scene, mut vary, sample, count, search, shard, merge, slurm, column, .. } =
        arguments;
    let output = &arguments.output.unwrap_or_else(|| {
        let mut name = default_output(&scene).into_os_string();
        name.push("-sweep");
        name.into()
    });
    let (quick, checkpoint_every) = (arguments.quick, arguments.checkpoints.every());
    let source = &attach::<C>(Source::read(&scene)?, output, quick, &arguments.inputs, false)?;
    vary.extend(super::drawn(&sample, count)?);
    let part = match shard {
        Some(shard) => Part::Shard(shard),
        None if merge => Part::Merge,
        None => Part::Whole,
    };
    let mut bar = Progress::start();
    let mut progress = |done: usize, all: usize, last: &str| {
        bar.show(done as f64 / all as f64, || format!("{done} of {all} runs are done, last {last}"));
    };
    let (columns, interrupted) = (&column, interrupted());
    let mut options =
        SweepOptions { output, columns, quick, part, checkpoint_every, interrupted, progress: &mut progress };
    if let Some(parts) = slurm {
        crate::say!("{}", super::job::<C>(source, &vary, &options, &without_slurm(), parts.into())?);
        return Ok(true);
    }
    let finished = match search {
        Some(search) => super::search::<C>(source, &search, &mut options)?,
        None => super::sweep::<C>(source, &vary, &mut options)?,
    };
    bar.finish();
    let text = finished.table.as_ref().filter(|_| !verbose).unwrap_or(&finished.text);
    terminal::print(format_args!("{text}results in {}\n", output.display()));
    Ok(finished.report.passed())
}

/// Returns the command line of this process without `--slurm N` and `--threads N`, which its jobs do not take
/// over.
fn without_slurm() -> Vec<String> {
    let program = std::env::current_exe().map(|path| path.display().to_string());
    let mut words = vec![program.unwrap_or_else(|_| "sweep".into())];
    let mut arguments = std::env::args().skip(1);
    while let Some(word) = arguments.next() {
        if ["--slurm", "--threads"].contains(&word.as_str()) {
            arguments.next();
        } else if !word.starts_with("--slurm=") && !word.starts_with("--threads=") {
            words.push(word);
        }
    }
    words
}
