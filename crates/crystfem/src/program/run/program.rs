//! `crystfem` as a program of the harness.

use super::{explain, run};
use crate::error::Error;
use crate::program::scene::{self, SceneKind};
use harness::case::{Case, Fault, Finished, Program, Run};
use harness::scene::{Failure, Source};

/// Heat conduction and crystallization of semicrystalline polymers printed layer by layer.
pub struct Crystfem;

impl Case for Crystfem {
    const PROGRAM: Program = Program {
        name: "crystfem",
        version: env!("CARGO_PKG_VERSION"),
        about: "Heat conduction and crystallization of semicrystalline polymers printed layer by layer",
        examples: "  crystfem check cases/ch4/printed-bar/case.toml    describe what it builds
  crystfem run cases/ch4/printed-bar/case.toml      print the bar; results in out/printed-bar
  crystfem run cases/ch4/cooling-rates/case.toml    run the material alone
  crystfem resume out/printed-bar                   continue an interrupted run
  crystfem sweep cases/ch4/printed-bar/case.toml --vary print.layer_time=10s,20s,40s
  crystfem schema > crystfem.schema.json            write the schema for editors",
        magic: b"part-ck7",
        columns: &[],
    };
    type Error = Error;

    fn explain(source: &Source, quick: bool) -> Result<Vec<String>, Failure<Error>> {
        explain(source, quick)
    }

    fn solve(source: &Source, case: &mut Run) -> Result<Finished, Failure<Error>> {
        run(source, case)
    }

    fn large_outputs(source: &Source) -> &'static [&'static str] {
        match scene::kind(source) {
            Ok(SceneKind::Part) => &["output.pictures", "output.fields"],
            _ => &[],
        }
    }

    fn schema() -> serde_json::Value {
        scene::schema()
    }
}

impl Fault for Error {
    fn exit_code(&self) -> u8 {
        match self {
            Self::Mesh(_)
            | Self::Parameter { .. }
            | Self::Unknown { .. }
            | Self::File { .. }
            | Self::Data { .. } => 2,
            Self::NotFinite { .. }
            | Self::Finite { .. }
            | Self::NotConverged { .. }
            | Self::Stopped { .. } => 1,
            Self::Study { error, .. } => error.exit_code(),
            Self::Shared(error) => error.exit_code(),
        }
    }
}
