//! The program `peri`: scenes in TOML, their runs, the command line. No other module of this crate uses them.

pub mod bridge;
pub mod command;
pub mod observe;
pub mod quantities;
pub mod run;
pub mod scene;

impl From<crate::Error> for harness::scene::Failure<crate::Error> {
    fn from(error: crate::Error) -> Self {
        Self::Run(error)
    }
}
