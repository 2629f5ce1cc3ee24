//! Whole scenes: run, compared, drawn and judged.

pub mod checkpoint;
mod draw;
mod explain;
mod film;
mod fit;
mod part;
mod point;
mod probe;
mod rows;
mod section;
mod suite;
mod sweep;

pub(crate) use rows::STATISTICS;
pub use sweep::{Search, SweepOptions, Vary, search, sweep};

use crate::error::Error;
use crate::scene::{self, FitScene, Kind, PartScene, PointScene};
use polycore::report::Report;
use polycore::scene::Source;
use std::path::Path;
use std::time::Duration;

/// How a run behaves towards its user.
pub struct Options<'a> {
    /// Where results go.
    pub output: &'a Path,
    /// Leave out what is marked `quick = false`.
    pub quick: bool,
    /// Time between checkpoints of a part's run.
    pub checkpoint_every: Duration,
    /// Go on from the checkpoint in `output`.
    pub resume: bool,
    /// Whether the user asked to stop.
    pub interrupted: &'a (dyn Fn() -> bool + Sync),
    /// Sees the progress of a part's run.
    pub progress: &'a mut (dyn FnMut(&Progress) + Send),
}

/// Where the run of a part stands.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Time, s.
    pub time: f64,
    /// When it ends, s.
    pub end: f64,
    /// The last step, s.
    pub dt: f64,
    /// Equations.
    pub equations: usize,
    /// Which of how many runs this is, from 1.
    pub of: [usize; 2],
}

/// What stops a run: a fault in the scene, or one met on the way.
pub type Failure = polycore::scene::Failure<Error>;

/// A run that came to its end.
#[derive(Debug)]
pub struct Finished {
    /// What is in `report.json`.
    pub report: Report,
    /// What the user is shown of it.
    pub text: String,
}

impl From<Report> for Finished {
    fn from(report: Report) -> Self {
        Self { text: report.table(), report }
    }
}

/// Runs a scene of any kind and writes its report.
///
/// # Errors
/// [`Failure`].
pub fn run(source: &Source, options: &mut Options) -> Result<Finished, Failure> {
    match scene::kind(source)? {
        Kind::Point => self::point::run(source, &source.parse::<PointScene>()?, options).map(Finished::from),
        Kind::Fit => self::fit::run(source, &source.parse::<FitScene>()?, options).map(Finished::from),
        Kind::Part => self::part::run(source, &source.parse::<PartScene>()?, options),
    }
}

/// What a scene of any kind builds and leaves out, in lines; `quick`: as a run without what is marked `quick = false`.
///
/// # Errors
/// A fault of the scene.
pub fn explain(source: &Source, quick: bool) -> Result<Vec<String>, Failure> {
    match scene::kind(source)? {
        Kind::Point => Ok(self::point::explain(source, &source.parse::<PointScene>()?, quick)?),
        Kind::Fit => Ok(self::fit::explain(source, &source.parse::<FitScene>()?)?),
        Kind::Part => self::part::explain(source, &source.parse::<PartScene>()?, quick),
    }
}
