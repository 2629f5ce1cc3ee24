//! Whole scenes: run, compared, drawn and judged.

mod animation;
mod celsius;
mod draw;
mod explain;
mod fit;
mod part;
mod point;
mod probe;
mod program;
mod section;
mod suite;

pub use program::Crystfem;

use crate::error::Error;
use crate::scene::{self, FitScene, Kind, PartScene, PointScene};
use polycore::case::{Finished, Run};
use polycore::scene::Source;

/// What stops a run: a fault in the scene, or one met on the way.
pub type Failure = polycore::scene::Failure<Error>;

/// Runs a scene of any kind, all but `report.json`, which [`Run::finish`] writes.
///
/// # Errors
/// [`Failure`].
pub fn run(source: &Source, run: &mut Run) -> Result<Finished, Failure> {
    match scene::kind(source)? {
        Kind::Point => self::point::run(source, &source.parse::<PointScene>()?, run).map(Finished::from),
        Kind::Fit => self::fit::run(source, &source.parse::<FitScene>()?, run).map(Finished::from),
        Kind::Part => {
            let scene = source.parse::<PartScene>()?;
            match scene.study.is_empty() {
                true => self::part::run(source, &scene, run),
                false => self::suite::run(source, &scene, run),
            }
        }
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
        Kind::Part => {
            let scene = source.parse::<PartScene>()?;
            match scene.study.is_empty() {
                true => self::part::explain(source, &scene),
                false => self::suite::explain(source, &scene, quick),
            }
        }
    }
}
