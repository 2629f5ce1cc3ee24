//! Pictures of a part: sections through its middle at some times, and all of them as an animation.

use super::part::{TEMPERATURE, shifted};
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
    let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; 1 + usize::from(field.is_some())];
    for &frame in &shown {
        for (values, [low, high]) in frames.values(frame)?.1.iter().zip(&mut ranges) {
            for &value in values.iter().filter(|value| value.is_finite()) {
                (*low, *high) = (low.min(value), high.max(value));
            }
        }
    }
    let strips = frames.strips(scene, &ranges);
    if count > 1 {
        strips.animate(output.join("process.png"), shown.len(), SHOWN, |k| {
            frames.values(shown[k]).map_err(|error| match error {
                Error::Shared(error) => error,
                other => polycore::Error::Data { what: "animation".into(), reason: other.to_string() },
            })
        })?;
    }
    let last = count - 1;
    let stages = scene.output.stages.min(last.max(1));
    let at = (1..=stages).map(|stage| frames.values(stage * last / stages));
    Ok(strips.write(output.join("sections.png"), &at.collect::<Result<Vec<_>, _>>()?)?)
}

impl Frames<'_> {
    fn count(&self) -> usize {
        match &self.from {
            Origin::File(series) => series.len().max(1),
            Origin::End(_) => 1,
        }
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
                let temperature = shifted(&simulation.temperatures(f64::NAN));
                let field = self.field.map(|name| simulation.field(name));
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
