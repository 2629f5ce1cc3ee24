//! Pictures of a part at selected times, and animations: sections through its middle and views from outside.

use super::celsius::{TEMPERATURE, to_celsius};
use super::part_skin::{PartSkin, SolidFrame};
use super::section::MeshSection;
use crate::error::Error;
use crate::mesh::Mesh;
use crate::program::scene::{PartScene, PartTask};
use crate::simulation::Simulation;
use harness::observe::{Observer, Outputs};
use harness::output::picture::{ColorMap, Skin, Solids, Stage, Strip, Strips};
use harness::output::vtkhdf::{self, Series};
use std::path::Path;

/// Name of the field file.
pub const FIELDS: &str = "fields.vtkhdf";

/// Largest number of animation frames.
const MOST_FRAMES: usize = 60;
/// Time for which each frame is shown, s.
const FRAME_TIME: f64 = 0.12;

/// Frames of a full turn of the turntable.
const TURNTABLE_FRAMES: usize = 36;

/// Field values of each frame.
struct AnimationFrames<'a> {
    mesh: &'a Mesh,
    /// Field shown beside the temperature.
    field: Option<&'static str>,
    from: FrameSource<'a>,
}

enum FrameSource<'a> {
    /// Field file of the run.
    File(Series),
    /// Final state, if no fields were written.
    End(&'a Simulation),
}

/// Observer that draws the printing process.
pub struct AnimationObserver<'a> {
    /// Scene of the run.
    pub scene: &'a PartScene,
    /// Mesh, births and layers.
    pub task: &'a PartTask,
}

impl Observer<Simulation, Error> for AnimationObserver<'_> {
    fn draw(&self, simulation: &Simulation, to: &Outputs) -> Result<(), Error> {
        let path = to.folder.join(FIELDS);
        let path = Some(path.as_path()).filter(|_| self.scene.output.fields);
        draw(self.scene, self.task, simulation, path, to.folder)
    }
}

/// Draws sections.png and solid.png (stages side by side, temperature and crystallinity), process.png and
/// process_solid.png (all frames, animated), and turntable.png (the end, turning). All use one color range
/// per field.
fn draw(
    scene: &PartScene,
    task: &PartTask,
    simulation: &Simulation,
    fields: Option<&Path>,
    output: &Path,
) -> Result<(), Error> {
    let mesh = &task.problem.mesh;
    let names = simulation.field_names();
    let field = names.iter().copied().find(|name| *name == "crystallinity").or(names.first().copied());
    let from = match fields {
        Some(path) => FrameSource::File(vtkhdf::read(path)?),
        None => FrameSource::End(simulation),
    };
    let frames = AnimationFrames { mesh, field, from };
    let count = frames.count();
    // all frames, or an evenly thinned set that includes the last one
    let every = count.div_ceil(MOST_FRAMES);
    let shown: Vec<usize> = (0..count).rev().step_by(every).collect::<Vec<_>>().into_iter().rev().collect();
    let births: Vec<f64> = task.problem.births.iter().map(|birth| birth.time).collect();
    let stages = stages(&births, &frames.times(), scene.output.stages);
    let mut printed: Vec<u32> =
        task.printed.iter().flat_map(|&element| mesh.nodes(element)).copied().collect();
    printed.sort_unstable();
    printed.dedup();
    let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; 1 + usize::from(frames.field.is_some())];
    let others = stages.iter().filter(|stage| shown.binary_search(stage).is_err());
    for &frame in shown.iter().chain(others) {
        widen(&mut ranges, &frames.read(frame)?, &printed);
    }
    let columns = frames.columns(&ranges);
    if let Some(section) = MeshSection::through_the_middle(mesh, &task.printed) {
        let strips = Strips {
            title: scene.title.clone(),
            samples: section.samples,
            low: section.low,
            spacing: section.spacing,
            unit: ("mm".into(), 1e-3),
            axes: ["x", "z"],
            columns: columns.clone(),
        };
        let stage = |frame: usize| Ok(frames.section(&section, frames.read(frame)?));
        if count > 1 {
            let path = output.join("process.png");
            strips.animate(path, shown.len(), FRAME_TIME, |k| stage(shown[k]).map_err(polycore_error))?;
        }
        let stages = stages.iter().map(|&frame| stage(frame)).collect::<Result<Vec<_>, Error>>()?;
        strips.write(output.join("sections.png"), &stages)?;
    }
    let Some(bounds) = mesh.bounds_of(&task.printed) else { return Ok(()) };
    let solid = &scene.output.solid;
    let view = solid.view();
    let solids =
        Solids { title: scene.title.clone(), bounds, unit: ("mm".into(), 1e-3), view, fields: columns };
    let outside = PartSkin::new(mesh, &task.printed, solid.plane(bounds))?;
    let stage = |frame: usize| -> Result<(String, Skin), polycore::Error> {
        frames.read(frame).map(|frame| outside.skin(frame)).map_err(polycore_error)
    };
    solids.write(output.join("solid.png"), stages.len(), |k| stage(stages[k]))?;
    if count > 1 {
        solids.animate(output.join("process_solid.png"), shown.len(), FRAME_TIME, |k| stage(shown[k]))?;
    }
    if solid.turntable {
        solids.turn(output.join("turntable.png"), TURNTABLE_FRAMES, FRAME_TIME, &stage(count - 1)?)?;
    }
    Ok(())
}

fn polycore_error(error: Error) -> polycore::Error {
    match error {
        Error::Shared(error) => error,
        other => polycore::Error::Data { what: "picture".into(), reason: other.to_string() },
    }
}

/// Returns the frames to show: the first after some births, while the new material is hot, then evenly spaced
/// ones to the end.
fn stages(births: &[f64], times: &[f64], wanted: usize) -> Vec<usize> {
    let last = times.len() - 1;
    let hot = births.len().min(wanted - 1);
    let after = |birth: f64| times.partition_point(|&time| time <= birth).min(last);
    let mut frames: Vec<usize> =
        (1..=hot).map(|k| after(births[(k * births.len()).div_ceil(hot) - 1])).collect();
    let (begin, rest) = (frames.last().copied().unwrap_or(0), wanted - hot);
    frames.extend((1..=rest).map(|k| begin + k * (last - begin) / rest));
    frames.dedup();
    // the first frame shows the initial state only
    frames.retain(|&frame| frame > 0 || last == 0);
    frames
}

/// Extends the range of each field by the values of a frame at `nodes`.
fn widen(ranges: &mut [[f64; 2]], frame: &SolidFrame, nodes: &[u32]) {
    for (values, [low, high]) in frame.values.iter().zip(ranges) {
        let there = nodes.iter().filter_map(|&node| values.get(node as usize));
        for &value in there.filter(|value| value.is_finite()) {
            (*low, *high) = (low.min(value), high.max(value));
        }
    }
}

impl AnimationFrames<'_> {
    fn count(&self) -> usize {
        match &self.from {
            FrameSource::File(series) => series.len().max(1),
            FrameSource::End(_) => 1,
        }
    }

    fn times(&self) -> Vec<f64> {
        match &self.from {
            FrameSource::File(series) if !series.times().is_empty() => series.times().to_vec(),
            FrameSource::File(_) => vec![0.0],
            FrameSource::End(simulation) => vec![simulation.time()],
        }
    }

    /// Reads the temperature and the second field of a frame.
    fn read(&self, frame: usize) -> Result<SolidFrame, Error> {
        let (time, values, exists): (f64, Vec<Vec<f64>>, Vec<bool>) = match &self.from {
            FrameSource::File(series) => {
                let names = std::iter::once(TEMPERATURE).chain(self.field);
                let all = names.map(|name| series.data(frame, name)).collect::<Result<_, _>>()?;
                let exists = series.cell_data(frame, "exists")?;
                (series.times()[frame], all, exists.iter().map(|&there| there == 1.0).collect())
            }
            FrameSource::End(simulation) => {
                let temperature = to_celsius(&simulation.temperatures(f64::NAN));
                let or_nan = |x: Option<f64>| x.unwrap_or(f64::NAN);
                let field = self.field.map(|name| simulation.field(name).into_iter().map(or_nan).collect());
                let elements = 0..self.mesh.element_count() as u32;
                let exists = elements.map(|element| simulation.is_born(element)).collect();
                (simulation.time(), std::iter::once(temperature).chain(field).collect(), exists)
            }
        };
        Ok(SolidFrame { title: format!("t = {} s", (time * 100.0).round() / 100.0), values, exists })
    }

    fn section(&self, section: &MeshSection, frame: SolidFrame) -> Stage {
        let there = |element: u32| frame.exists.get(element as usize) == Some(&true);
        let values = frame.values.iter().map(|field| section.values(self.mesh, field, &there)).collect();
        (frame.title, values)
    }

    fn columns(&self, ranges: &[[f64; 2]]) -> Vec<Strip> {
        let label = match self.field {
            Some("crystallinity") => "crystallinity X",
            Some("alpha") => "relative crystallinity α",
            Some(name) => name,
            None => "",
        };
        let labels = [("T [°C]", ColorMap::Inferno), (label, ColorMap::Viridis)];
        let column = |(k, ((label, colors), &[low, high])): (usize, ((&str, ColorMap), &[f64; 2]))| {
            // a uniform field still needs a color bar; crystallinity starts at 0
            let low = if k == 0 { low } else { low.min(0.0) };
            let range = if high > low { (low, high) } else { (low.min(0.0), low.max(0.0) + 1.0) };
            let range = if range.0.is_finite() && range.1.is_finite() { range } else { (0.0, 1.0) };
            Strip { label: label.to_owned(), range, colors }
        };
        labels.into_iter().zip(ranges).enumerate().map(column).collect()
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
