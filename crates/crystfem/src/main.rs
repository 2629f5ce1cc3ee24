//! The `crystfem` command line.

use clap::{CommandFactory, Parser, Subcommand};
use crystfem::run::{Failure, Options};
use crystfem::scene::Kind;
use polycore::scene::Source;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

mod bench;

/// Heat conduction and crystallization of semicrystalline polymers printed layer by layer.
#[derive(Parser)]
#[command(
    version,
    about,
    after_help = "Exit codes: 0 done, 1 an expectation or the run failed, 2 bad input."
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
}

#[derive(Subcommand)]
enum Command {
    /// Run a scene of any kind, compare, draw, and judge its expectations.
    Run(Scene),
    /// Run a scene of the material alone: kinetics and melting under temperature histories.
    Point(Scene),
    /// Run a scene of fits: constants of the kinetics from measurements, with confidence intervals.
    Fit(Scene),
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
    let report = crystfem::run::run(&source, &Options { output: &output, quick: scene.quick })?;
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
