//! Whole scenes: run, compared, drawn and judged.

mod draw;
mod explain;
mod fit;
mod fit_part;
mod heat_flow;
mod nodes;
mod part;
mod point;
mod program;
mod suite;

pub use program::Crystfem;

use crate::error::Error;
use crate::program::quantities;
use crate::program::scene::{self, FitScene, Kind, PartScene, PointScene};
use harness::case::{Finished, Run, check_expectations};
use harness::scene::{SceneError, Source};

/// What stops a run: a fault in the scene, or one met on the way.
pub type Failure = harness::scene::Failure<Error>;

/// Runs a scene of any kind, all but `report.json`, which [`Run::finish`] writes.
///
/// # Errors
/// [`Failure`].
pub fn run(source: &Source, run: &mut Run) -> Result<Finished, Failure> {
    match scene::kind(source)? {
        Kind::Point => self::point::run(source, &points(source)?, run).map(Finished::from),
        Kind::Fit => {
            let scene = fits(source)?;
            let mut finished = self::fit::run(source, &scene, run)?;
            let read: Vec<String> = self::fit::read(source, &scene).collect();
            finished.text = read.iter().map(|line| format!("{line}\n")).collect::<String>() + &finished.text;
            finished.notes.splice(0..0, read);
            Ok(finished)
        }
        Kind::Part => {
            let scene = source.parse::<PartScene>()?;
            match scene.study.is_empty() {
                true => self::part::run(source, &scene, run),
                false => self::suite::run(source, &scene, run),
            }
        }
    }
}

fn points(source: &Source) -> Result<PointScene, SceneError> {
    let scene = source.parse::<PointScene>()?;
    check_expectations(source, &scene.expect, &[quantities::OF_POINTS])?;
    Ok(scene)
}

fn fits(source: &Source) -> Result<FitScene, SceneError> {
    let scene = source.parse::<FitScene>()?;
    check_expectations(source, &scene.expect, &[quantities::OF_FITS])?;
    Ok(scene)
}

/// What a scene of any kind builds and leaves out, in lines; `quick`: as a run without what is marked `quick = false`.
///
/// # Errors
/// A fault of the scene.
pub fn explain(source: &Source, quick: bool) -> Result<Vec<String>, Failure> {
    match scene::kind(source)? {
        Kind::Point => Ok(self::point::explain(source, &points(source)?, quick)?),
        Kind::Fit => Ok(self::fit::explain(source, &fits(source)?)?),
        Kind::Part => {
            let scene = source.parse::<PartScene>()?;
            match scene.study.is_empty() {
                true => self::part::explain(source, &scene),
                false => self::suite::explain(source, &scene, quick),
            }
        }
    }
}
