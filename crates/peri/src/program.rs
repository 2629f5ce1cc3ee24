//! The program `peri`: scenes in TOML, runs, the command line. The library does not depend on it.

pub mod bridge;
mod card;
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
