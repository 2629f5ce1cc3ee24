//! The program `crystfem`: TOML scenes, their runs and the command line. No other module of this crate uses
//! them.

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
