//! The `peri` command line.

use clap::{CommandFactory, Parser, Subcommand};
use peri::run::{Failure, Options};
use peri::scene::Scene;
use polycore::scene::Source;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time between lines of progress where there is no terminal.
const LOG_EVERY: Duration = Duration::from_secs(10);

mod bench;
mod exact_command;

/// Bond-based peridynamics of elastomers.
#[derive(Parser)]
#[command(
    version,
    about,
    after_help = "Exit codes: 0 done, 1 an expectation or the run failed, 2 bad input, 130 interrupted."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Threads to compute on; default: all. The results are the same bits on any number.
    #[arg(long, global = true, value_parser = clap::value_parser!(u16).range(1..=4096))]
    threads: Option<u16>,
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
    /// Print a shell's completion script.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

fn seconds(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("`{text}` is no number"))?;
    if (0.0..=1e9).contains(&value) { Ok(value) } else { Err(format!("{value} is not within 0 to 1e9")) }
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    if let Some(threads) = cli.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
        if let Err(error) = pool.build_global() {
            eprintln!("error: --threads {threads}: {error}");
            return ExitCode::FAILURE;
        }
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
        Command::Completions { shell } => {
            clap_complete::generate(shell, &mut Cli::command(), "peri", &mut std::io::stdout());
            Ok(true)
        }
    };
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(failure) => complain(failure),
    }
}

/// Prints a failure and tells its exit code.
fn complain(failure: Failure) -> ExitCode {
    match failure {
        Failure::Scene(error) => {
            eprint!("{}", error.render());
            ExitCode::from(error.exit_code())
        }
        Failure::Run(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

/// `cases/ch2/plate-with-hole/case.toml` → `out/plate-with-hole`.
fn default_output(scene: &Path) -> PathBuf {
    let stem = scene.file_stem().unwrap_or_default();
    let folder = scene.parent().and_then(Path::file_name);
    let name = if stem == "case" { folder.unwrap_or(stem) } else { stem };
    Path::new("out").join(name)
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
    if !output.join(peri::checkpoint::FILE_NAME).is_file()
        && output.join(polycore::report::FILE_NAME).is_file()
    {
        println!("{} is finished: nothing to resume", output.display());
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
    static STOP: AtomicBool = AtomicBool::new(false);
    // a second handler cannot be set; the first does the same
    let _ = ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed));
    let bar = if std::io::stderr().is_terminal() {
        indicatif::ProgressBar::new(1000)
    } else {
        indicatif::ProgressBar::hidden()
    };
    let style =
        indicatif::ProgressStyle::with_template("{spinner} {bar:30} {elapsed} (about {eta} left) {wide_msg}");
    bar.set_style(style.unwrap_or_else(|_| indicatif::ProgressStyle::default_bar()));
    let mut last = String::new();
    // a log file gets a line now and then
    let mut logged = Instant::now();
    let mut progress = |variant: &str, status: &peri::solver::Status| {
        if last != variant {
            variant.clone_into(&mut last);
            bar.reset();
        }
        if !status.iteration.is_multiple_of(20) {
            return;
        }
        let broken = if status.broken > 0 { format!("  broken {}", status.broken) } else { String::new() };
        let message = || {
            format!(
                "{variant}  step {}/{}{broken}  iteration {}  residual {:.2e}  reaction {:.3e}",
                status.step + 1,
                status.steps,
                status.iteration,
                status.residual,
                status.reaction
            )
        };
        if !bar.is_hidden() {
            // residuals fall by powers of ten: progress is the share of the decades done
            let decades = (1.0 / status.tolerance).log10();
            let done = (-status.residual.log10()).clamp(0.0, decades) / decades;
            let position = 1000.0 * (status.step as f64 + done) / status.steps as f64;
            bar.set_position(position as u64);
            bar.set_message(message());
        } else if logged.elapsed() >= LOG_EVERY {
            logged = Instant::now();
            eprintln!("{}", message());
        }
    };
    let mut options = Options {
        output,
        quick,
        checkpoint_every: Duration::from_secs_f64(every),
        resume,
        interrupted: &|| STOP.load(Ordering::Relaxed),
        progress: &mut progress,
    };
    let finished = peri::run::run(source, scene, &mut options)?;
    bar.finish_and_clear();
    print!("{}", finished.summary());
    println!("results in {}", output.display());
    Ok(finished.report.passed())
}

fn check(path: &Path, quick: bool) -> Result<bool, Failure> {
    let (source, scene) = load(path)?;
    print_explanation(&source, &scene, quick)?;
    println!("{}: the scene is valid", path.display());
    Ok(true)
}

fn print_explanation(source: &Source, scene: &Scene, quick: bool) -> Result<(), Failure> {
    for line in peri::run::explanation(source, scene, quick)? {
        println!("{line}");
    }
    Ok(())
}
