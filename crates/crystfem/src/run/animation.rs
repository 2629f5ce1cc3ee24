//! Pictures of a part: sections through its middle at some times, and all of them as an animation.

use super::celsius::{TEMPERATURE, of_kelvin};
use super::section::Section;
use crate::error::Error;
use crate::mesh::Mesh;
use crate::scene::{PartScene, Task};
use crate::simulation::Simulation;
use polycore::output::picture::{ColorMap, Stage, Strip, Strips};
use polycore::output::vtkhdf::{self, Series};
use std::path::Path;

/// Frames of an animation at most, and how long each is shown, s.
const FRAMES: usize = 60;
const SHOWN: f64 = 0.12;

/// Where a section's values come from, frame by frame.
struct Frames<'a> {
    mesh: &'a Mesh,
    section: Section,
    /// The field beside the temperature.
    field: Option<&'static str>,
    from: Origin<'a>,
}

enum Origin<'a> {
    /// All fields were written.
    File(Series),
    /// Only the end is there.
    End(&'a Simulation),
}

/// sections.png: stages below one another, temperature beside crystallinity; process.png: all frames, animated.
pub fn draw(
    scene: &PartScene,
    task: &Task,
    simulation: &Simulation,
    fields: Option<&Path>,
    output: &Path,
) -> Result<(), Error> {
    let mesh = &task.problem.mesh;
    let Some(section) = Section::through_the_middle(mesh, &task.printed) else { return Ok(()) };
    let names = simulation.field_names();
    let field = names.iter().copied().find(|name| *name == "crystallinity").or(names.first().copied());
    let from = match fields {
        Some(path) => Origin::File(vtkhdf::read(path)?),
        None => Origin::End(simulation),
    };
    let frames = Frames { mesh, section, field, from };
    let count = frames.count();
    // all frames, or as many as an animation may have, the last among them
    let every = count.div_ceil(FRAMES);
    let shown: Vec<usize> = (0..count).rev().step_by(every).collect::<Vec<_>>().into_iter().rev().collect();
    if count > 1 {
        let mut ranges = frames.no_ranges();
        for &frame in &shown {
            widen(&mut ranges, &frames.values(frame)?);
        }
        frames.strips(scene, &ranges).animate(output.join("process.png"), shown.len(), SHOWN, |k| {
            frames.values(shown[k]).map_err(|error| match error {
                Error::Shared(error) => error,
                other => polycore::Error::Data { what: "animation".into(), reason: other.to_string() },
            })
        })?;
    }
    let births: Vec<f64> = task.problem.births.iter().map(|birth| birth.time).collect();
    let stages = stages(&births, &frames.times(), scene.output.stages);
    let stages = stages.into_iter().map(|frame| frames.values(frame)).collect::<Result<Vec<_>, _>>()?;
    let mut ranges = frames.no_ranges();
    stages.iter().for_each(|stage| widen(&mut ranges, stage));
    Ok(frames.strips(scene, &ranges).write(output.join("sections.png"), &stages)?)
}

/// Frames to show: the first after some births, which shows fresh material while it is hot, then evenly to the end.
fn stages(births: &[f64], times: &[f64], wanted: usize) -> Vec<usize> {
    let last = times.len() - 1;
    let hot = births.len().min(wanted - 1);
    let after = |birth: f64| times.partition_point(|&time| time <= birth).min(last);
    let mut frames: Vec<usize> =
        (1..=hot).map(|k| after(births[(k * births.len()).div_ceil(hot) - 1])).collect();
    let (begin, rest) = (frames.last().copied().unwrap_or(0), wanted - hot);
    frames.extend((1..=rest).map(|k| begin + k * (last - begin) / rest));
    frames.dedup();
    // nothing has happened yet in the very first frame
    frames.retain(|&frame| frame > 0 || last == 0);
    frames
}

/// Takes the values of a stage into the ranges of its fields.
fn widen(ranges: &mut [[f64; 2]], stage: &Stage) {
    for (values, [low, high]) in stage.1.iter().zip(ranges) {
        for &value in values.iter().filter(|value| value.is_finite()) {
            (*low, *high) = (low.min(value), high.max(value));
        }
    }
}

impl Frames<'_> {
    fn count(&self) -> usize {
        match &self.from {
            Origin::File(series) => series.len().max(1),
            Origin::End(_) => 1,
        }
    }

    fn times(&self) -> Vec<f64> {
        match &self.from {
            Origin::File(series) if !series.times().is_empty() => series.times().to_vec(),
            Origin::File(_) => vec![0.0],
            Origin::End(simulation) => vec![simulation.time()],
        }
    }

    fn no_ranges(&self) -> Vec<[f64; 2]> {
        vec![[f64::INFINITY, f64::NEG_INFINITY]; 1 + usize::from(self.field.is_some())]
    }

    fn values(&self, frame: usize) -> Result<Stage, Error> {
        let (time, all, exists): (f64, Vec<Vec<f64>>, Vec<bool>) = match &self.from {
            Origin::File(series) => {
                let names = std::iter::once(TEMPERATURE).chain(self.field);
                let all = names.map(|name| series.data(frame, name)).collect::<Result<_, _>>()?;
                let exists = series.cell_data(frame, "exists")?;
                (series.times()[frame], all, exists.iter().map(|&there| there == 1.0).collect())
            }
            Origin::End(simulation) => {
                let temperature = of_kelvin(&simulation.temperatures(f64::NAN));
                let or_nan = |x: Option<f64>| x.unwrap_or(f64::NAN);
                let field = self.field.map(|name| simulation.field(name).into_iter().map(or_nan).collect());
                let elements = 0..self.mesh.element_count() as u32;
                let exists = elements.map(|element| simulation.is_born(element)).collect();
                (simulation.time(), std::iter::once(temperature).chain(field).collect(), exists)
            }
        };
        let there = |element: u32| exists.get(element as usize) == Some(&true);
        let values = all.iter().map(|field| self.section.values(self.mesh, field, &there)).collect();
        Ok((format!("t = {} s", (time * 100.0).round() / 100.0), values))
    }

    fn strips(&self, scene: &PartScene, ranges: &[[f64; 2]]) -> Strips<'static> {
        let label = match self.field {
            Some("crystallinity") => "crystallinity X",
            Some("alpha") => "relative crystallinity α",
            Some(name) => name,
            None => "",
        };
        let labels = [("T [°C]", ColorMap::Inferno), (label, ColorMap::Viridis)];
        let columns =
            labels.into_iter().zip(ranges).enumerate().map(|(k, ((label, colors), &[low, high]))| {
                // a field that is the same everywhere still needs a bar, and crystallinity begins at 0
                let low = if k == 0 { low } else { low.min(0.0) };
                let range = if high > low { (low, high) } else { (low.min(0.0), low.max(0.0) + 1.0) };
                let range = if range.0.is_finite() && range.1.is_finite() { range } else { (0.0, 1.0) };
                Strip { label: label.to_owned(), range, colors }
            });
        Strips {
            title: scene.title.clone(),
            samples: self.section.samples,
            low: self.section.low,
            spacing: self.section.spacing,
            unit: ("mm".into(), 1e-3),
            axes: ["x", "z"],
            columns: columns.collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_follow_births() {
        // eight layers, a frame every 8 s: 4 s after layers 2, 4, 6 and 8, and the end
        let births: Vec<f64> = (0..8).map(|k| 20.0 * f64::from(k)).collect();
        let times: Vec<f64> = (0..=50).map(|k| 8.0 * f64::from(k)).collect();
        assert_eq!(stages(&births, &times, 5), [3, 8, 13, 18, 50]);
        // fewer layers than stages: each, then evenly
        assert_eq!(stages(&births[..2], &times, 5), [1, 3, 18, 34, 50]);
        assert_eq!(stages(&[], &times, 5), [10, 20, 30, 40, 50]);
        assert_eq!(stages(&births, &times, 1), [50]);
        // frames further apart than births, and only the end
        assert_eq!(stages(&births, &[0.0, 80.0, 160.0], 5), [1, 2]);
        assert_eq!(stages(&births, &[160.0], 5), [0]);
    }
}
