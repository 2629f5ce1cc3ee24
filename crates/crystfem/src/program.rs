//! The program `crystfem`: scenes in TOML, their runs, the command line. The only room of this crate that knows of them.

pub mod command;
pub mod observe;
pub mod quantities;
pub mod run;
pub mod scene;
pub mod thermal;

impl From<crate::Error> for harness::scene::Failure<crate::Error> {
    fn from(error: crate::Error) -> Self {
        Self::Run(error)
    }
}
