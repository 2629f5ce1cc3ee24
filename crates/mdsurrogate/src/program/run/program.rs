//! `mdsurrogate` as a program of the harness.

use super::{explain, run};
use crate::error::Error;
use crate::program::scene;
use harness::case::{Case, Fault, Finished, Program, Run};
use harness::scene::{Failure, Source};

/// Constitutive laws from molecular dynamics.
pub struct Mdsurrogate;

impl Case for Mdsurrogate {
    const PROGRAM: Program = Program {
        name: "mdsurrogate",
        version: env!("CARGO_PKG_VERSION"),
        about: "Constitutive laws from molecular dynamics",
        examples: "  mdsurrogate check cases/ch3/train-default/case.toml   describe the scene and its data
  mdsurrogate run cases/ch3/train-default/case.toml     train and evaluate; results in out/train-default
  mdsurrogate resume out/train-default                  continue an interrupted run
  mdsurrogate sweep cases/ch3/train-default/case.toml --vary training.batch=32,256
  mdsurrogate predict law.safetensors strains.csv -o stresses.csv
                                                        predict stress and uncertainty at these strains
  mdsurrogate info cases/ch3/pa12-data/runs.csv.gz      describe a table
  mdsurrogate schema > mdsurrogate.schema.json          write the schema for editors",
        magic: b"mdsg-ck4",
        columns: &["*.error_over_noise", "*.best_validation_loss"],
    };
    type Error = Error;

    fn explain(source: &Source, _quick: bool) -> Result<Vec<String>, Failure<Error>> {
        explain(source)
    }

    fn solve(source: &Source, case: &mut Run) -> Result<Finished, Failure<Error>> {
        run(source, case)
    }

    fn schema() -> serde_json::Value {
        scene::schema()
    }
}

impl Fault for Error {
    fn exit_code(&self) -> u8 {
        match self {
            Self::Diverged { .. } | Self::NotFinite { .. } => 1,
            Self::Shared(error) => error.exit_code(),
            _ => harness::scene::EXIT_BAD_INPUT,
        }
    }
}
