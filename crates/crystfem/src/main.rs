//! The `crystfem` command line.

use clap::{CommandFactory, Parser, Subcommand};
use crystfem::run::{Failure, Options, Progress};
use crystfem::scene::Kind;
use polycore::scene::Source;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

mod bench;

/// Between lines of progress where no terminal shows a bar.
const LOG_EVERY: Duration = Duration::from_secs(10);

/// Heat conduction and crystallization of semicrystalline polymers printed layer by layer.
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
    },
    /// Measure error against run time.
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
        Command::Run(scene) => run(&scene, None),
        Command::Point(scene) => run(&scene, Some(Kind::Point)),
        Command::Fit(scene) => run(&scene, Some(Kind::Fit)),
        Command::Resume { output, checkpoint_every } => resume(&output, checkpoint_every),
        Command::Check { scene } => check(&scene),
        Command::Bench(bench) => bench.print(),
        Command::Completions { shell } => {
            clap_complete::generate(shell, &mut Cli::command(), "crystfem", &mut std::io::stdout());
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

/// `cases/ch4/cooling-rates/case.toml` → `out/cooling-rates`.
fn default_output(scene: &Path) -> PathBuf {
    let stem = scene.file_stem().unwrap_or_default();
    let folder = scene.parent().and_then(Path::file_name);
    let name = if stem == "case" { folder.unwrap_or(stem) } else { stem };
    Path::new("out").join(name)
}

fn run(scene: &Scene, kind: Option<Kind>) -> Result<bool, Failure> {
    let source = Source::read(&scene.scene)?;
    if let Some(asked) = kind
        && crystfem::scene::kind(&source)? != asked
    {
        let found = "a scene of another kind";
        return Err(source.error("program", found, "`crystfem run`, which takes scenes of all kinds").into());
    }
    let output = scene.output.clone().unwrap_or_else(|| default_output(&scene.scene));
    solve(&source, &output, scene.quick, scene.checkpoint_every, false)
}

fn resume(output: &Path, every: f64) -> Result<bool, Failure> {
    if !output.join(polycore::checkpoint::FILE_NAME).is_file()
        && output.join(polycore::report::FILE_NAME).is_file()
    {
        println!("{} is finished: nothing to resume", output.display());
        return Ok(true);
    }
    let header = crystfem::run::checkpoint::header(output)?;
    solve(&Source::new(header.scene_path, header.scene), output, header.quick, every, true)
}

fn solve(source: &Source, output: &Path, quick: bool, every: f64, resume: bool) -> Result<bool, Failure> {
    static STOP: AtomicBool = AtomicBool::new(false);
    // a second handler cannot be set; the first does the same
    let _ = ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed));
    let bar = match std::io::stderr().is_terminal() {
        true => indicatif::ProgressBar::new(1000),
        false => indicatif::ProgressBar::hidden(),
    };
    let style =
        indicatif::ProgressStyle::with_template("{spinner} {bar:30} {elapsed} (about {eta} left) {wide_msg}");
    bar.set_style(style.unwrap_or_else(|_| indicatif::ProgressStyle::default_bar()));
    // a log file gets a line now and then
    let mut logged = Instant::now();
    let mut progress = |at: &Progress| {
        let message = || {
            format!("t = {:.4} of {:.4} s  step {:.3e} s  {} equations", at.time, at.end, at.dt, at.equations)
        };
        if !bar.is_hidden() {
            bar.set_position((1000.0 * at.time / at.end) as u64);
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
    let report = crystfem::run::run(source, &mut options)?;
    bar.finish_and_clear();
    report.print_table();
    println!("results in {}", output.display());
    Ok(report.passed())
}

fn check(path: &Path) -> Result<bool, Failure> {
    let source = Source::read(path)?;
    for line in crystfem::run::explain(&source)? {
        println!("{line}");
    }
    println!("{}: the scene is valid", path.display());
    Ok(true)
}
