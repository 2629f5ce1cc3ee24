//! The `peri` command line.

// polycore::say! prints without a panic where nobody reads any more
#![deny(clippy::print_stdout, clippy::print_stderr)]

use clap::{CommandFactory, Parser, Subcommand};
use peri::run::{Failure, Options};
use peri::scene::Scene;
use polycore::command::{Progress, Threads, default_output, exit, interrupted, is_finished, seconds};
use polycore::scene::Source;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

mod bench;
mod exact_command;

/// Bond-based peridynamics of elastomers.
#[derive(Parser)]
#[command(
    version,
    about,
    after_help = "Examples:
  peri check cases/ch2/dent/case.toml               what it builds and leaves out
  peri run cases/ch2/dent/case.toml --quick         solve, draw, judge; results in out/dent
  peri resume out/dent                              go on after an interruption
  peri exact law --law chain --links 720 --dissociation 1200
  peri schema > peri.schema.json                    for editors

Exit codes: 0 done, 1 an expectation or the run failed, 2 bad input, 130 interrupted."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    threads: Threads,
}

#[derive(Subcommand)]
enum Command {
    /// Solve a scene, compare, draw, and judge its expectations.
    Run {
        /// The scene (TOML).
        scene: PathBuf,
        /// Directory for results; default: out/NAME after the scene's folder.
        #[arg(long, short)]
        output: Option<PathBuf>,
        /// Leave out what the scene marks `quick = false`.
        #[arg(long)]
        quick: bool,
        /// Print what the scene builds and leaves out, before it runs.
        #[arg(long)]
        explain: bool,
        /// Seconds between checkpoints.
        #[arg(long, default_value_t = 30.0, value_parser = seconds)]
        checkpoint_every: f64,
    },
    /// Continue an interrupted or killed run from its checkpoint.
    Resume {
        /// The output directory of that run.
        output: PathBuf,
        /// Seconds between checkpoints.
        #[arg(long, default_value_t = 30.0, value_parser = seconds)]
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
    /// Print closed-form solutions and the constants of a bond law.
    #[command(subcommand)]
    Exact(exact_command::Exact),
    /// Measure bond evaluations per second, memory, and the machine's bandwidth.
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
        Command::Run { scene, output, quick, explain, checkpoint_every } => {
            let output = output.unwrap_or_else(|| default_output(&scene));
            run(&scene, &output, quick, explain, checkpoint_every)
        }
        Command::Resume { output, checkpoint_every } => resume(&output, checkpoint_every),
        Command::Check { scene, quick } => check(&scene, quick),
        Command::Exact(exact) => exact.print(),
        Command::Bench(bench) => bench.print(),
        Command::Schema => {
            polycore::say!("{:#}", peri::scene::schema());
            Ok(true)
        }
        Command::Completions { shell } => {
            let mut text = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "peri", &mut text);
            polycore::command::print(String::from_utf8_lossy(&text));
            Ok(true)
        }
    };
    exit(result, peri::Error::exit_code)
}

fn load(path: &Path) -> Result<(Source, Scene), Failure> {
    let source = Source::read(path)?;
    let scene = source.parse::<Scene>()?;
    Ok((source, scene))
}

fn run(scene: &Path, output: &Path, quick: bool, explain: bool, every: f64) -> Result<bool, Failure> {
    let (source, scene) = load(scene)?;
    if explain {
        print_explanation(&source, &scene, quick)?;
    }
    solve(&source, &scene, output, quick, every, false)
}

fn resume(output: &Path, every: f64) -> Result<bool, Failure> {
    if is_finished(output) {
        return Ok(true);
    }
    let header = peri::checkpoint::header(output)?;
    let source = Source::new(header.scene_path, header.scene);
    let scene = source.parse::<Scene>()?;
    solve(&source, &scene, output, header.quick, every, true)
}

fn solve(
    source: &Source,
    scene: &Scene,
    output: &Path,
    quick: bool,
    every: f64,
    resume: bool,
) -> Result<bool, Failure> {
    let mut bar = Progress::start();
    let mut last = String::new();
    let mut progress = |variant: &str, status: &peri::solver::Status| {
        if last != variant {
            variant.clone_into(&mut last);
            bar.restart();
        }
        if !status.iteration.is_multiple_of(20) {
            return;
        }
        let broken = if status.broken > 0 { format!("  broken {}", status.broken) } else { String::new() };
        let load = status.load.map_or(String::new(), |load| format!("  load {load:.4e} N before"));
        // residuals fall by powers of ten: progress is the share of the decades done
        let decades = (1.0 / status.tolerance).log10();
        let done = (-status.residual.log10()).clamp(0.0, decades) / decades;
        bar.show((status.step as f64 + done) / status.steps as f64, || {
            format!(
                "{variant}  step {}/{}{broken}  iteration {}  residual {:.2e}{load}",
                status.step + 1,
                status.steps,
                status.iteration,
                status.residual
            )
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
    let finished = peri::run::run(source, scene, &mut options)?;
    bar.finish();
    polycore::command::print(finished.summary());
    polycore::say!("results in {}", output.display());
    Ok(finished.report.passed())
}

fn check(path: &Path, quick: bool) -> Result<bool, Failure> {
    let (source, scene) = load(path)?;
    print_explanation(&source, &scene, quick)?;
    polycore::say!("{}: the scene is valid", path.display());
    Ok(true)
}

fn print_explanation(source: &Source, scene: &Scene, quick: bool) -> Result<(), Failure> {
    for line in peri::run::explanation(source, scene, quick)? {
        polycore::say!("{line}");
    }
    Ok(())
}
