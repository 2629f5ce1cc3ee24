//! Model for fits to measurements in a part: one simulation per trial of the constants.

use crate::error::Error;
use crate::fit::{self, KineticFit};
use crate::kinetics::KineticConstants;
use crate::program::observe::celsius::CELSIUS;
use crate::program::observe::{ProbeRecord, record};
use crate::program::scene::PartFit;
use crate::simulation::Simulation;
use harness::scene::Failure;
use std::cell::RefCell;

/// Fits the constants. `show` is called before each trial; its error ends the fit.
pub fn solve(
    job: &PartFit,
    show: &mut dyn FnMut(usize) -> Result<(), polycore::Error>,
) -> Result<KineticFit, Failure<Error>> {
    // report an invalid scene by its own error, before the fit starts
    trial(job, &job.constants)?;
    let (state, stopped) = (RefCell::new((0, show)), RefCell::new(None));
    let model = |constants: &KineticConstants| -> Option<Vec<[f64; 2]>> {
        let (count, show) = &mut *state.borrow_mut();
        *count += 1;
        if stopped.borrow().is_some() {
            return None;
        }
        if let Err(error) = show(*count) {
            *stopped.borrow_mut() = Some(error);
            return None;
        }
        trial(job, constants).ok()
    };
    let found = fit::fit_in_part(&model, &job.degrees(), &job.constants);
    match stopped.into_inner() {
        Some(error) => Err(Error::from(error).into()),
        None => Ok(found?),
    }
}

/// Returns temperature, K, and α at each measurement, computed with some constants.
fn trial(job: &PartFit, constants: &KineticConstants) -> Result<Vec<[f64; 2]>, Failure<Error>> {
    let scene = job.with_constants(constants);
    let task = scene.task(&job.source, scene.mesh.build(&job.source)?)?;
    let mut simulation = Simulation::new(std::sync::Arc::clone(&task.problem), task.settings)?;
    let names = simulation.field_names();
    let fields = names.len();
    let field = names.iter().position(|name| *name == "alpha").unwrap_or(0);
    let mut probes: Vec<ProbeRecord> = scene
        .probe
        .iter()
        .zip(&task.probes)
        .map(|(spec, place)| ProbeRecord::new(spec, place, fields))
        .collect();
    record(&mut probes, &simulation, &names)?;
    simulation.observe(task.end, |simulation| record(&mut probes, simulation, &names))?;
    let mut rows = Vec::new();
    for (probe, times, _) in &job.curves {
        let probe = &probes[*probe];
        for &time in times {
            let Some([temperature, degree]) = probe.value_at(time, field) else {
                let reason = format!(
                    "probe `{}` has no value at {time} s; the run of the part ends at {} s",
                    probe.name(),
                    task.end
                );
                return Err(Error::Data { what: "measurements of a part".to_owned(), reason }.into());
            };
            rows.push([temperature + CELSIUS, degree]);
        }
    }
    Ok(rows)
}
