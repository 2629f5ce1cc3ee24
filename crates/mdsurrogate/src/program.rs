//! The program `mdsurrogate`: TOML scenes, their runs and the command line. No other module of this crate
//! uses them.

pub mod command;
pub mod quantities;
pub mod run;
pub mod scene;

impl From<crate::Error> for harness::scene::Failure<crate::Error> {
    fn from(error: crate::Error) -> Self {
        Self::Run(error)
    }
}
