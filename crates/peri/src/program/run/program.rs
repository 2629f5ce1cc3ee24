//! The program `peri` for the harness.

use super::{explanation, run};
use crate::error::Error;
use crate::program::scene::{self, Scene};
use harness::case::{Case, Fault, Finished, Program, Run};
use harness::scene::{Failure, Source};

/// Program that runs scenes of `peri`.
pub struct Peri;

impl Case for Peri {
    const PROGRAM: Program = Program {
        name: "peri",
        version: env!("CARGO_PKG_VERSION"),
        about: "Bond-based peridynamics of elastomers",
        examples: "  peri check cases/ch2/dent/case.toml               what it builds and leaves out
  peri run cases/ch2/dent/case.toml --quick         solve, draw, judge; results in out/dent
  peri resume out/dent                              continue an interrupted run
  peri sweep SCENE --vary material.critical.fracture_energy=50J/m^2,100J/m^2
  peri exact law --law chain-affine --links 720 --dissociation 1200
  peri schema > peri.schema.json                    for editors",
        magic: b"peri-c19",
        columns: &[
            "peak_load*",
            "load_at_*mm",
            "*_stiffness_at_*mm",
            "displacement_at_peak*",
            "first_break*",
            "stored_energy*",
            "largest_displacement*",
        ],
    };
    type Error = Error;

    fn explain(source: &Source, quick: bool) -> Result<Vec<String>, Failure<Error>> {
        explanation(source, &source.parse::<Scene>()?, quick)
    }

    fn solve(source: &Source, own: &mut Run) -> Result<Finished, Failure<Error>> {
        let finished = run(source, &source.parse::<Scene>()?, own)?;
        let (text, notes) = (finished.summary(), finished.notes());
        Ok(Finished::new(finished.report, text).with_notes(&notes))
    }

    fn large_outputs(_: &Source) -> &'static [&'static str] {
        &["output.pictures", "output.fields"]
    }

    fn schema() -> serde_json::Value {
        scene::schema()
    }
}

impl Fault for Error {
    fn exit_code(&self) -> u8 {
        match self {
            Self::Geometry(_) | Self::Parameter { .. } | Self::TimeStep { .. } => 2,
            #[cfg(feature = "gpu")]
            Self::Device(_) => 2,
            Self::NoEquilibrium { torn, .. } => 2 - u8::from(*torn),
            Self::NotFinite { .. }
            | Self::NotConverged { .. }
            | Self::Unstable { .. }
            | Self::Penetration { .. } => 1,
            Self::Within { error, .. } | Self::PartLaw { error, .. } => error.exit_code(),
            Self::Shared(error) => error.exit_code(),
        }
    }
}
