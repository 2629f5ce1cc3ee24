//! Print plan of a scene: elements and their birth times, in layers or along a path.

use super::gcode_file;
use super::locate_error::located;
use super::part::PrintSpec;
use super::selection::{elements, millimetres};
use super::voxels::Filling;
use crate::boundary::Schedule;
use crate::error::Error;
use crate::mesh::Mesh;
use crate::mesh::RATIOS;
use crate::mesh::layers::Layers;
use crate::mesh::path::{Bead, ToolPath, read_csv, read_gcode};
use crate::print_plan::{NOZZLE, PrintPlan};
use harness::scene::{SceneError, Source};
use std::path::Path;

impl PrintSpec {
    /// Plans the print. A mesh from a path (`filling`) is printed along it, unless the scene gives layers.
    pub(super) fn plan(
        &self,
        source: &Source,
        mesh: &Mesh,
        filling: Option<&Filling>,
        notes: &mut Vec<String>,
    ) -> Result<PrintPlan, SceneError> {
        if let Some(file) = &self.path {
            return self.plan_along_file(source, mesh, file, notes);
        }
        if let (Some((tool, times)), None) =
            (filling.and_then(|filling| filling.path.as_ref()), self.layer_time)
        {
            return self.plan_along(source, tool, times);
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
        let interval = self.layer_time.map_or(0.0, |time| time.si());
        let schedule = self.schedule(source)?;
        let temperature = |time| schedule.as_ref().map_or(f64::NAN, |schedule| schedule.value_at(time));
        Ok(PrintPlan::in_layers(layers.elements, self.start(), interval, temperature))
    }

    fn start(&self) -> f64 {
        self.start.map_or(0.0, |start| start.si())
    }

    fn schedule(&self, source: &Source) -> Result<Option<Schedule>, SceneError> {
        self.temperature.as_ref().map(|given| given.build(source, "print.temperature")).transpose()
    }

    /// Plans elements with given times along a path.
    fn plan_along(&self, source: &Source, path: &ToolPath, times: &[f64]) -> Result<PrintPlan, SceneError> {
        let (window, schedule) = (self.window.map(|window| window.si()), self.schedule(source)?);
        PrintPlan::along_path(path, times, self.start(), window, schedule.as_ref()).map_err(|error| {
            match error {
                Error::Parameter { name: NOZZLE, found: time, .. } => {
                    let why =
                        format!("the file sets no nozzle temperature (M104, M109) before {time} s; write it");
                    source.missing("print.temperature", why)
                }
                other => located(source, "print.window", &other),
            }
        })
    }

    /// Plans elements along a path file; elements that no bead covers are not printed.
    fn plan_along_file(
        &self,
        source: &Source,
        mesh: &Mesh,
        file: &Path,
        notes: &mut Vec<String>,
    ) -> Result<PrintPlan, SceneError> {
        let at = |key: &str, error: Error| located(source, key, &error);
        let path = source.file(file);
        let table = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
        let tool = if table { read_csv(&path) } else { read_gcode(&path) };
        let mut tool = tool.map_err(|error| at("print.path", error))?;
        notes.append(&mut tool.notes);
        let fed = gcode_file::filament(source, "print", &tool, self.filament)?;
        if !table || self.acceleration.is_some() || self.jerk.is_some() {
            tool = gcode_file::with_times(source, "print", tool, self.acceleration, self.jerk, notes)?;
        }
        if tool.has_feed() {
            notes.extend(tool.summary(fed));
        }
        gcode_file::leave_out(source, "print", &self.leave_out, &mut tool, notes)?;
        let elements = elements(source, mesh, "print.elements", self.elements.as_deref())?;
        let bead = Bead {
            width: self.bead_width.map_or(0.0, |width| width.si()),
            height: self.bead_height.map_or(0.0, |height| height.si()),
        };
        if self.centre {
            tool = tool.centred(mesh, &elements, bead);
        }
        if let Some(offset) = self.offset {
            tool = tool.translated(offset.map(|x| x.si()));
        }
        let mut activation =
            tool.activation_times(mesh, &elements, bead).map_err(|error| at("print.path", error))?;
        let volume = |list: &[u32]| list.iter().map(|&element| mesh.volume(element)).sum::<f64>();
        let whole = volume(&elements);
        let share = |list: &[u32]| 100.0 * (1.0 - volume(list) / whole);
        let covered = share(&activation.missed);
        let outside = 100.0 * tool.fraction_outside(mesh, &elements, bead);
        if covered <= 0.0 || activation.missed.len() == elements.len() {
            let boxed = |bounds: Option<[[f64; 3]; 2]>| {
                let [low, high] = bounds.unwrap_or_default().map(millimetres);
                format!("from {low} to {high}")
            };
            let found = format!(
                "a path {} whose beads cover no element center of the part",
                boxed(tool.bounds(bead))
            );
            let allowed = format!(
                "a path over the part, which reaches {} (`centre = true` centers the path, `offset` shifts \
                 it)",
                boxed(mesh.bounds_of(&elements))
            );
            return Err(source.error("print.path", found, allowed));
        }
        let mut text = format!(
            "the beads cover {covered:.1} % of the part; {outside:.1} % of their length lies outside"
        );
        if self.fill {
            activation.fill(mesh);
            text += &format!("; with filled gaps {:.1} % are printed", share(&activation.missed));
        } else if !activation.missed.is_empty() {
            text += "; the rest is not printed (`fill = true` fills gaps)";
        }
        notes.push(text);
        let extruded: f64 = tool.printing_moves().map(|bead| bead.volume(fed)).sum();
        if extruded > 0.0 {
            let ratio = (whole - volume(&activation.missed)) / extruded;
            if !(RATIOS[0]..=RATIOS[1]).contains(&ratio) {
                notes.push(format!(
                    "the printed elements have {ratio:.3} times the extruded volume of the file (use \
                      `[mesh.path]` to print it)"
                ));
            }
        }
        let plan = self.plan_along(source, &tool, &activation.times)?;
        Ok(PrintPlan { absent: activation.missed, ..plan })
    }
}
