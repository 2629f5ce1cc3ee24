//! The `crystfem` command line.

// polycore::say! prints without a panic where nobody reads any more
#![deny(clippy::print_stdout, clippy::print_stderr)]

use clap::{CommandFactory, Parser, Subcommand};
use crystfem::run::{Failure, Options, Progress, Search, SweepOptions, Vary};
use crystfem::scene::Kind;
use polycore::command::{Progress as Bar, Threads, default_output, exit, interrupted, is_finished, seconds};
use polycore::scene::Source;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

mod bench;

/// Heat conduction and crystallization of semicrystalline polymers printed layer by layer.
#[derive(Parser)]
#[command(
    version,
    about,
    after_help = "Examples:
  crystfem check cases/ch4/printed-bar/case.toml    what it builds and leaves out
  crystfem run cases/ch4/printed-bar/case.toml      print the bar, draw, judge; results in out/printed-bar
  crystfem run cases/ch4/cooling-rates/case.toml    the material alone
  crystfem resume out/printed-bar                   go on after an interruption
  crystfem schema > crystfem.schema.json            for editors

Exit codes: 0 done, 1 an expectation or the run failed, 2 bad input, 130 interrupted."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    threads: Threads,
}

/// A scene and where its results go.
#[derive(clap::Args)]
struct Scene {
    /// The scene (TOML).
    scene: PathBuf,
    /// Directory for results; default: out/NAME after the scene's folder.
    #[arg(long, short)]
    output: Option<PathBuf>,
    /// Leave out what the scene marks `quick = false`.
    #[arg(long)]
    quick: bool,
    /// First print what the scene builds and leaves out.
    #[arg(long)]
    explain: bool,
    /// Seconds between checkpoints of a part's run.
    #[arg(long, value_name = "SECONDS", default_value_t = 30.0, value_parser = seconds)]
    checkpoint_every: f64,
}

#[derive(Subcommand)]
enum Command {
    /// Run a scene of any kind, compare, draw, and judge its expectations.
    Run(Scene),
    /// Run a scene of the material alone: kinetics and melting under temperature histories.
    Point(Scene),
    /// Run a scene of fits: constants of the kinetics from measurements, with confidence intervals.
    Fit(Scene),
    /// Run a part for every combination of values of some keys, in parallel; finished runs are kept.
    Sweep {
        /// The scene (TOML), without studies.
        scene: PathBuf,
        /// A key of the scene and its values, e.g. print.layer_time=10s,20s,40s; several make a grid, and keys behind one
        /// another with `;` change together.
        #[arg(long, value_name = "KEY=VALUE,…", required_unless_present = "search")]
        vary: Vec<Vary>,
        /// Instead: the least value of a key with which all expectations are met, e.g. print.layer_time=5s..40s.
        #[arg(long, value_name = "KEY=LOW..HIGH", conflicts_with = "vary")]
        search: Option<Search>,
        /// A further value to tell of each run, e.g. layer-*.mean_crystallinity; may be repeated.
        #[arg(long, value_name = "NAME")]
        column: Vec<String>,
        /// Directory for results; default: out/NAME-sweep.
        #[arg(long, short)]
        output: Option<PathBuf>,
        /// Seconds between checkpoints of each run.
        #[arg(long, value_name = "SECONDS", default_value_t = 30.0, value_parser = seconds)]
        checkpoint_every: f64,
    },
    /// Go on with an interrupted or killed run of a part.
    Resume {
        /// The run's output directory.
        output: PathBuf,
        /// Seconds between checkpoints.
        #[arg(long, value_name = "SECONDS", default_value_t = 30.0, value_parser = seconds)]
        checkpoint_every: f64,
    },
    /// Validate a scene and print what it builds and leaves out.
    Check {
        /// The scene (TOML).
        scene: PathBuf,
        /// As `run --quick` would.
        #[arg(long)]
        quick: bool,
    },
    /// Measure error against run time.
    Bench(bench::Bench),
    /// Print the JSON Schema of scenes, by which editors complete and check them.
    Schema,
    /// Print a shell's completion script.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

fn main() -> ExitCode {
    let cli = polycore::command::parse::<Cli>();
    if let Err(error) = cli.threads.apply() {
        polycore::command::complain(format_args!("error: {error}\n"));
        return ExitCode::FAILURE;
    }
    let result = match cli.command {
        Command::Run(scene) => run(&scene, None),
        Command::Point(scene) => run(&scene, Some(Kind::Point)),
        Command::Fit(scene) => run(&scene, Some(Kind::Fit)),
        Command::Sweep { scene, vary, search, column, output, checkpoint_every } => {
            let output = output.unwrap_or_else(|| {
                let mut name = default_output(&scene).into_os_string();
                name.push("-sweep");
                name.into()
            });
            sweep(&scene, &vary, search.as_ref(), &column, &output, checkpoint_every)
        }
        Command::Resume { output, checkpoint_every } => resume(&output, checkpoint_every),
        Command::Check { scene, quick } => check(&scene, quick),
        Command::Bench(bench) => bench.print(),
        Command::Schema => {
            polycore::say!("{:#}", crystfem::scene::schema());
            Ok(true)
        }
        Command::Completions { shell } => {
            let mut text = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "crystfem", &mut text);
            polycore::command::print(String::from_utf8_lossy(&text));
            Ok(true)
        }
    };
    exit(result, crystfem::Error::exit_code)
}

fn run(scene: &Scene, kind: Option<Kind>) -> Result<bool, Failure> {
    let source = Source::read(&scene.scene)?;
    if let Some(asked) = kind
        && crystfem::scene::kind(&source)? != asked
    {
        let found = "a scene of another kind";
        return Err(source.error("program", found, "`crystfem run`, which takes scenes of all kinds").into());
    }
    if scene.explain {
        for line in crystfem::run::explain(&source, scene.quick)? {
            polycore::say!("{line}");
        }
    }
    let output = scene.output.clone().unwrap_or_else(|| default_output(&scene.scene));
    solve(&source, &output, scene.quick, scene.checkpoint_every, false)
}

fn sweep(
    scene: &Path,
    vary: &[Vary],
    search: Option<&Search>,
    columns: &[String],
    output: &Path,
    every: f64,
) -> Result<bool, Failure> {
    let source = Source::read(scene)?;
    let mut bar = Bar::start();
    let mut progress = |done: usize, all: usize, last: &str| {
        bar.show(done as f64 / all as f64, || format!("{done} of {all} runs are done, last {last}"));
    };
    let mut options = SweepOptions {
        output,
        columns,
        checkpoint_every: Duration::from_secs_f64(every),
        interrupted: interrupted(),
        progress: &mut progress,
    };
    let finished = match search {
        Some(search) => crystfem::run::search(&source, search, &mut options)?,
        None => crystfem::run::sweep(&source, vary, &mut options)?,
    };
    bar.finish();
    tell(&finished.text, output);
    Ok(finished.report.passed())
}

fn tell(text: &str, output: &Path) {
    polycore::command::print(format_args!("{text}results in {}\n", output.display()));
}

fn resume(output: &Path, every: f64) -> Result<bool, Failure> {
    if is_finished(output) {
        return Ok(true);
    }
    let header = crystfem::run::checkpoint::header(output)?;
    if header.study.is_some()
        && let Some(whole) = output.canonicalize().ok().and_then(|output| output.parent().map(PathBuf::from))
    {
        polycore::say!("{} is a study of the run in {}", output.display(), whole.display());
        return resume(&whole, every);
    }
    solve(&Source::new(header.scene_path, header.scene), output, header.quick, every, true)
}

fn solve(source: &Source, output: &Path, quick: bool, every: f64, resume: bool) -> Result<bool, Failure> {
    let mut bar = Bar::start();
    let mut progress = |at: &Progress| {
        let done = (at.of[0] as f64 - 1.0 + at.time / at.end) / at.of[1] as f64;
        bar.show(done, || {
            let run =
                if at.of[1] > 1 { format!("run {} of {}  ", at.of[0], at.of[1]) } else { String::new() };
            let Progress { time, end, dt, equations, .. } = at;
            format!("{run}t = {time:.4} of {end:.4} s  step {dt:.3e} s  {equations} equations")
        });
    };
    let mut options = Options {
        output,
        quick,
        checkpoint_every: Duration::from_secs_f64(every),
        resume,
        interrupted: interrupted(),
        progress: &mut progress,
    };
    let finished = crystfem::run::run(source, &mut options)?;
    bar.finish();
    tell(&finished.text, output);
    Ok(finished.report.passed())
}

fn check(path: &Path, quick: bool) -> Result<bool, Failure> {
    let source = Source::read(path)?;
    for line in crystfem::run::explain(&source, quick)? {
        polycore::say!("{line}");
    }
    polycore::say!("{}: the scene is valid", path.display());
    Ok(true)
}
