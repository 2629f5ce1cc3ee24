//! Runs whole scenes: solves, compares, draws and judges.

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
use crate::program::scene::{self, FitScene, PartScene, PointScene, SceneKind};
use harness::case::{Finished, Run, check_expectations};
use harness::scene::{Failure, SceneError, Source};

/// Runs a scene of any kind; [`Run::finish`] writes `report.json`.
///
/// # Errors
/// Returns a [`Failure`] for an invalid scene or a failed run.
pub fn run(source: &Source, run: &mut Run) -> Result<Finished, Failure<Error>> {
    match scene::kind(source)? {
        SceneKind::Point => self::point::run(source, &points(source)?, run).map(Finished::from),
        SceneKind::Fit => {
            let scene = fits(source)?;
            let mut finished = self::fit::run(source, &scene, run)?;
            let read: Vec<String> = self::fit::describe_tables(source, &scene).collect();
            finished.text = read.iter().map(|line| format!("{line}\n")).collect::<String>() + &finished.text;
            finished.notes.splice(0..0, read);
            Ok(finished)
        }
        SceneKind::Part => {
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
    check_expectations(source, &scene.expect, &[quantities::POINT_QUANTITIES])?;
    Ok(scene)
}

fn fits(source: &Source) -> Result<FitScene, SceneError> {
    let scene = source.parse::<FitScene>()?;
    check_expectations(source, &scene.expect, &[quantities::FIT_QUANTITIES])?;
    Ok(scene)
}

/// Describes a scene of any kind, line by line. `quick` skips the parts marked `quick = false`.
///
/// # Errors
/// Returns an error for an invalid scene.
pub fn explain(source: &Source, quick: bool) -> Result<Vec<String>, Failure<Error>> {
    match scene::kind(source)? {
        SceneKind::Point => Ok(self::point::explain(source, &points(source)?, quick)?),
        SceneKind::Fit => Ok(self::fit::explain(source, &fits(source)?)?),
        SceneKind::Part => {
            let scene = source.parse::<PartScene>()?;
            match scene.study.is_empty() {
                true => self::part::explain(source, &scene),
                false => self::suite::explain(source, &scene, quick),
            }
        }
    }
}
