//! The `polycore` command line: fits hyperelastic laws to the data that a case names, tabulates laws, and
//! predicts polymer networks from their compositions.

// harness::say! prints without a panic if the output is closed
#![deny(clippy::print_stdout, clippy::print_stderr)]

use std::path::Path;
use std::process::ExitCode;

use harness::case::{self, Finished, Program, Run, terminal};
use harness::scene::{Failure, Source};
use polycore::Error;

mod cli {
    /// Unit of all output, Pa: MPa.
    pub const MPA: f64 = 1e6;

    pub mod card;
    pub mod data;
    pub mod deck;
    pub mod draw;
    pub mod exact;
    pub mod fits;
    pub mod foams;
    pub mod forecasts;
    pub mod material;
    pub mod network;
    pub mod networks;
    pub mod prony;
    pub mod prony_files;
    pub mod quantities;
    pub mod ranking;
    pub mod scene;
    pub mod table_fits;
    pub mod time;
    pub mod time_block;
    pub mod time_card;
    pub mod time_fits;
    pub mod trials;
    pub mod verdict;
    pub mod volumetric;
}

use cli::{deck, exact, fits, network, scene};

/// Program that fits hyperelastic laws.
struct Fits;

impl case::Case for Fits {
    const PROGRAM: Program = Program {
        name: "polycore",
        version: env!("CARGO_PKG_VERSION"),
        about: "Hyperelastic laws: fits to data, tables, checks; networks from their chemistry",
        examples: "  polycore check cases/ch1/rubber-fits/case.toml    which laws it fits to which data
  polycore run cases/ch1/rubber-fits/case.toml      fit, draw, judge; results in out/rubber-fits
  polycore run rubber.csv                           every law on one table of tests in several modes
  polycore exact eight-chain \"0.27 MPa\" 25 --to 4  nominal stress against stretch, as CSV
  polycore network networks.csv -o predicted.csv    moduli of polymer networks from their chemistry",
        magic: b"poly-ck3",
        columns: &["*.rms", "*.deviation_rms"],
    };
    type Error = Error;

    fn explain(source: &Source, _quick: bool) -> Result<Vec<String>, Failure<Error>> {
        Ok(scene::FitCase::parse(source)?.plan().lines().map(str::to_owned).collect())
    }

    fn solve(source: &Source, run: &mut Run) -> Result<Finished, Failure<Error>> {
        Ok(fits::run(&scene::FitCase::parse(source)?, run)?)
    }

    fn scene_of_table(table: &Path) -> Option<String> {
        let [file, stem] = [table.file_name(), table.file_stem()].map(|name| name?.to_str());
        let name = stem?.replace(|letter: char| !letter.is_alphanumeric(), "-");
        let file = serde_json::Value::from(file?);
        Some(format!(
            "version = 1\nprogram = \"polycore\"\ntitle = {file}\n\n\
             [[fit.data]]\nname = \"{name}\"\nfile = {file}\n"
        ))
    }

    fn schema() -> serde_json::Value {
        scene::schema()
    }
}

#[derive(clap::Subcommand)]
enum Command {
    /// Tabulate the nominal stress of an incompressible law, as CSV that a case can read back as data.
    Exact(exact::Arguments),
    /// Print the hyperelastic laws of a finite-element program as blocks of scenes.
    Deck(deck::Arguments),
    /// Predict modulus, sol, chain length and fracture energy of polymer networks from their compositions.
    Network(network::Arguments),
}

fn main() -> ExitCode {
    case::main::<Fits, _>(|command| match command {
        Command::Exact(arguments) => {
            let refused = |reason| Error::Option { option: "exact".to_owned(), reason };
            terminal::print(exact::table(&arguments).map_err(refused)?);
            Ok(true)
        }
        Command::Deck(arguments) => {
            terminal::print(deck::blocks(&arguments)?);
            Ok(true)
        }
        Command::Network(arguments) => Ok(network::run(&arguments)?),
    })
}
