//! The harness of the programs: scenes in TOML, runs with checkpoints and progress, reports judged by their
//! expectations, pictures, fields, pages, the command line. It knows no physics: a program is a
//! [`case::Case`].

pub mod case;
pub mod checkpoint;
pub mod observe;
pub mod report;
pub mod scene;
mod stamp;
pub mod study;
pub mod view;

pub use resultfile as output;
