//! What is laid down when: in layers, or along a path.

use super::fault::located;
use super::file;
use super::part::PrintSpec;
use super::places::{elements, millimetres};
use super::voxels::Filling;
use crate::element;
use crate::error::Error;
use crate::mesh::Mesh;
use crate::mesh::RATIOS;
use crate::mesh::layers::{Layers, groups};
use crate::mesh::path::{Bead, Setting, ToolPath, read_csv, read_gcode};
use crate::problem::Birth;
use harness::scene::{SceneError, Source};
use std::collections::BTreeMap;
use std::path::Path;

/// Elements and times of births.
#[derive(Default)]
pub(super) struct Laid {
    pub births: Vec<Birth>,
    /// Elements that are never printed, ascending.
    pub absent: Vec<u32>,
    pub layers: Vec<Vec<u32>>,
    /// End of the path, s.
    pub end: f64,
}

impl PrintSpec {
    /// `filling`: of a mesh of a path, which is printed along it unless layers are asked for.
    pub(super) fn laid(
        &self,
        source: &Source,
        mesh: &Mesh,
        filling: Option<&Filling>,
        notes: &mut Vec<String>,
    ) -> Result<Laid, SceneError> {
        if let Some(file) = &self.path {
            return self.along(source, mesh, file, notes);
        }
        if let (Some((tool, times)), None) =
            (filling.and_then(|filling| filling.path.as_ref()), self.layer_time)
        {
            return self.timed(source, tool, times, Vec::new());
        }
        let at = |key: &str, error: Error| located(source, key, &error);
        let layers = match (&self.elements, self.layer_height) {
            (Some(set), Some(height)) => {
                let elements = elements(source, mesh, "print.elements", Some(set))?;
                Layers::from_height(mesh, &elements, height.si())
                    .map_err(|error| at("print.layer_height", error))?
            }
            _ => Layers::from_sets(mesh, self.layers.as_deref().unwrap_or("layer-"))
                .map_err(|error| at("print.layers", error))?,
        };
        notes.extend(layers.notes);
        let start = self.start.map_or(0.0, |start| start.si());
        let interval = self.layer_time.map_or(0.0, |time| time.si());
        let groups = (0..).zip(&layers.elements);
        let groups = groups.map(|(layer, elements)| (start + f64::from(layer) * interval, elements.clone()));
        let births = self.births(source, None, &[], groups.collect())?;
        let end = start + births.len() as f64 * interval;
        Ok(Laid { births, layers: layers.elements, end, absent: Vec::new() })
    }

    /// `tool`, `times`: the path whose nozzle gives the temperature where the scene does not, and the time of each element on it.
    fn births(
        &self,
        source: &Source,
        tool: Option<&ToolPath>,
        times: &[f64],
        groups: Vec<(f64, Vec<u32>)>,
    ) -> Result<Vec<Birth>, SceneError> {
        let start = self.start.map_or(0.0, |start| start.si());
        let schedule = match &self.temperature {
            Some(given) => Some(given.build(source, "print.temperature")?),
            None => None,
        };
        let nozzle = tool.map_or_else(Vec::new, |tool| tool.setting(Setting::Nozzle));
        let mut births = Vec::with_capacity(groups.len());
        for (time, elements) in groups {
            if let Some(schedule) = &schedule {
                births.push(Birth { time, elements, temperature: schedule.at(time) });
                continue;
            }
            // each as it is laid down, not when all appear: tools differ
            let mut by_temperature: BTreeMap<u64, Vec<u32>> = BTreeMap::new();
            for element in elements {
                let laid = times.get(element as usize).copied().unwrap_or(time - start);
                let before = nozzle.partition_point(|(from, _)| *from <= laid);
                let Some(set) = before.checked_sub(1).map(|at| nozzle[at].1) else {
                    let found = format!("nothing, and no M104 or M109 in the file before {time} s");
                    return Err(source.error("print.temperature", found, "a temperature"));
                };
                by_temperature.entry(set.to_bits()).or_default().push(element);
            }
            let births_of = by_temperature.into_iter();
            births.extend(births_of.map(|(bits, elements)| Birth {
                time,
                elements,
                temperature: f64::from_bits(bits),
            }));
        }
        Ok(births)
    }

    /// Elements at their times along a path.
    fn timed(
        &self,
        source: &Source,
        tool: &ToolPath,
        times: &[f64],
        absent: Vec<u32>,
    ) -> Result<Laid, SceneError> {
        let start = self.start.map_or(0.0, |start| start.si());
        let window = self.window.map_or(0.01 * tool.duration(), |window| window.si());
        let groups = groups(times, window).map_err(|error| located(source, "print.window", &error))?;
        let groups = groups.into_iter().map(|(time, list)| (start + time, list)).collect();
        let births = self.births(source, Some(tool), times, groups)?;
        let last = births.last().map_or(start, |birth| birth.time);
        let end = (start + tool.duration()).max(last + window);
        Ok(Laid { births, absent, layers: Vec::new(), end })
    }

    /// Along a path; what its beads do not cover is never printed.
    fn along(
        &self,
        source: &Source,
        mesh: &Mesh,
        file: &Path,
        notes: &mut Vec<String>,
    ) -> Result<Laid, SceneError> {
        let at = |key: &str, error: Error| located(source, key, &error);
        let path = source.file(file);
        let table = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
        let tool = if table { read_csv(&path) } else { read_gcode(&path) };
        let mut tool = tool.map_err(|error| at("print.path", error))?;
        notes.append(&mut tool.notes);
        let fed = file::filament(source, "print", &tool, self.filament)?;
        if !table || self.acceleration.is_some() || self.jerk.is_some() {
            tool = file::timed(source, "print", tool, self.acceleration, self.jerk, notes)?;
        }
        if tool.is_fed() {
            notes.extend(tool.told(fed));
        }
        file::leave_out(source, "print", &self.leave_out, &mut tool, notes)?;
        let elements = elements(source, mesh, "print.elements", self.elements.as_deref())?;
        let bead = Bead {
            width: self.bead_width.map_or(0.0, |width| width.si()),
            height: self.bead_height.map_or(0.0, |height| height.si()),
        };
        if self.centre {
            tool = tool.centred(mesh, &elements, bead);
        }
        if let Some(offset) = self.offset {
            tool = tool.shifted(offset.map(|x| x.si()));
        }
        let mut activation =
            tool.activation(mesh, &elements, bead).map_err(|error| at("print.path", error))?;
        let volume = |list: &[u32]| list.iter().map(|&element| element::volume(mesh, element)).sum::<f64>();
        let whole = volume(&elements);
        let share = |list: &[u32]| 100.0 * (1.0 - volume(list) / whole);
        let covered = share(&activation.missed);
        let outside = 100.0 * tool.outside(mesh, &elements, bead);
        if covered <= 0.0 || activation.missed.len() == elements.len() {
            let boxed = |bounds: Option<[[f64; 3]; 2]>| {
                let [low, high] = bounds.unwrap_or_default().map(millimetres);
                format!("from {low} to {high}")
            };
            let found = format!(
                "a path {} whose beads cover no centre of an element of the part",
                boxed(tool.bounds(bead))
            );
            let allowed = format!(
                "one that meets the part, which reaches {}; `centre = true` puts the path over it, `offset` anywhere",
                boxed(mesh.bounds_of(&elements))
            );
            return Err(source.error("print.path", found, allowed));
        }
        let mut told = format!(
            "the beads cover {covered:.1} % of the part; {outside:.1} % of their length lies outside of it"
        );
        if self.fill {
            activation.fill(mesh);
            told += &format!("; with gaps filled {:.1} % is printed", share(&activation.missed));
        } else if !activation.missed.is_empty() {
            told += "; what they do not cover is not printed (`fill = true` fills gaps)";
        }
        notes.push(told);
        let extruded: f64 = tool.printing().map(|one| one.volume(fed)).sum();
        if extruded > 0.0 {
            let ratio = (whole - volume(&activation.missed)) / extruded;
            if !(RATIOS[0]..=RATIOS[1]).contains(&ratio) {
                notes.push(format!(
                    "what is printed has {ratio:.3} times the volume that the file extrudes: `[mesh.path]` prints what it extrudes"
                ));
            }
        }
        self.timed(source, &tool, &activation.times, activation.missed)
    }
}
