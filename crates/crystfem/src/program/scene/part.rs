//! Scene of a part over time: mesh, materials, printing, conditions.

use super::{
    HealingSpec, MaterialSpec, MechanicsSpec, MeshSpec, Program, ScheduleSpec, StudySpec, check_name,
};
use crate::problem::Capacity;
use crate::simulation::LinearSolver;
use crate::time::Scheme;
use harness::report::Expect;
use harness::scene::{LineSpec, SceneError, SolidSpec, Source};
use harness::study::{Convergence, ErrorAgainstTime};
use polycore::units::dimension::{
    HeatFluxDimension, HeatTransferDimension, PowerDensityDimension, TemperatureDimension,
};
use polycore::units::{Acceleration, Length, Speed, Temperature, TemperatureDifference, Time};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A scene of a part.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PartScene {
    /// Program of the scene: `crystfem`.
    pub program: Program,
    /// Title for tables and pictures.
    #[serde(default)]
    pub title: String,
    /// Mesh of the part.
    pub mesh: MeshSpec,
    /// Materials by name.
    pub materials: BTreeMap<String, MaterialSpec>,
    /// Elements of each material.
    pub region: Vec<RegionSpec>,
    /// Printing: elements that are added during the run; default: all exist from the start.
    pub print: Option<PrintSpec>,
    /// Boundary conditions.
    #[serde(default)]
    pub boundary: Vec<BoundarySpec>,
    /// Heat sources in volumes.
    #[serde(default)]
    pub source: Vec<SourceSpec>,
    /// Stress and warpage.
    pub mechanics: Option<MechanicsSpec>,
    /// Healing of interfaces between layers and beads.
    pub healing: Option<HealingSpec>,
    /// Times and steps.
    #[serde(default)]
    pub time: TimeSpec,
    /// Places whose temperature and state are recorded in each step.
    #[serde(default)]
    pub probe: Vec<ProbeSpec>,
    /// Files to write.
    #[serde(default)]
    pub output: PartOutput,
    /// Variants that run instead of the scene itself.
    #[serde(default)]
    pub study: Vec<StudySpec>,
    /// Limits and convergence orders of quantities over studies.
    #[serde(default)]
    pub convergence: Vec<Convergence>,
    /// Plots of error against run time over studies.
    #[serde(default)]
    pub error_against_time: Vec<ErrorAgainstTime>,
    /// Expected results.
    #[serde(default)]
    pub expect: Vec<Expect>,
}

/// Elements of one material. Where regions overlap, the last one applies.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RegionSpec {
    /// Element set of the mesh; default: all elements.
    pub elements: Option<String>,
    /// Name of the material.
    pub material: String,
    /// Temperature at the start.
    pub temperature: Temperature,
}

/// Elements that are added during the run, in layers or along a path.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrintSpec {
    /// Temperature of new material; default: that of the nozzle in the G-code file.
    pub temperature: Option<ScheduleSpec<TemperatureDimension>>,
    /// Prefix of the element sets of the layers, `PREFIX1`, `PREFIX2`, …; default `layer-`.
    pub layers: Option<String>,
    /// Element set that is cut into layers of `layer_height`, or printed along `path`, instead of `layers`.
    pub elements: Option<String>,
    /// Height of these layers.
    pub layer_height: Option<Length>,
    /// Time between layers.
    pub layer_time: Option<Time>,
    /// Start time of the first layer or of the path; default 0.
    pub start: Option<Time>,
    /// Tool path: G-code (`.gcode`, `.g`, `.nc`) or a CSV table (`time [s]`, `x [mm]`, `y [mm]`, `z [mm]`,
    /// `print`).
    pub path: Option<PathBuf>,
    /// Width of the bead.
    pub bead_width: Option<Length>,
    /// Height of the bead.
    pub bead_height: Option<Length>,
    /// Centers the beads of the path on `elements`, in x and y.
    #[serde(default)]
    pub centre: bool,
    /// Shift of the path.
    pub offset: Option<[Length; 3]>,
    /// Fills gaps between beads when the last bead at their height is finished. By default elements that no
    /// bead covers are left out.
    #[serde(default)]
    pub fill: bool,
    /// Filament diameter, for the volume that G-code extrudes; default: that of the file, or 1.75 mm.
    pub filament: Option<Length>,
    /// Slicer features that are left out of the part, as in `mesh.path`.
    #[serde(default)]
    pub leave_out: Vec<String>,
    /// Acceleration limit along G-code, for the times; default: that of the file, or none (velocity is F).
    pub acceleration: Option<Acceleration>,
    /// Jump of velocity at corners, with `acceleration`.
    pub jerk: Option<Speed>,
    /// Time window: elements that the nozzle passes within one window are added together; default: 1 % of the
    /// duration of the path.
    pub window: Option<Time>,
}

/// Condition on a surface: a temperature, a flux, or convection and radiation.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoundarySpec {
    /// Surface: `outer` (the current outer surface), a surface of the mesh, an element set (its outer faces),
    /// a node set (for a temperature), or a side of the bounding box: `left`, `right`, `front`, `back`,
    /// `bottom`, `top`.
    pub surface: String,
    /// Surfaces that are excluded from `outer`.
    #[serde(default)]
    pub except: Vec<String>,
    /// Lower corner of a box that limits the surface to faces whose centers lie inside; default: no limit.
    pub min: Option<[Length; 3]>,
    /// Upper corner of this box.
    pub max: Option<[Length; 3]>,
    /// Prescribed temperature.
    pub temperature: Option<ScheduleSpec<TemperatureDimension>>,
    /// Heat flux into the body.
    pub flux: Option<ScheduleSpec<HeatFluxDimension>>,
    /// Film coefficient h.
    pub film: Option<ScheduleSpec<HeatTransferDimension>>,
    /// Emissivity ε.
    pub emissivity: Option<f64>,
    /// Temperature of the surroundings, for convection and radiation.
    pub ambient: Option<ScheduleSpec<TemperatureDimension>>,
}

/// Heat released in elements.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SourceSpec {
    /// Element set of the mesh; default: all elements.
    pub elements: Option<String>,
    /// Heat per volume.
    pub power: ScheduleSpec<PowerDensityDimension>,
}

/// End time, and fixed or adaptive steps.
#[derive(Clone, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TimeSpec {
    /// End time; default: one layer time after the last layer, or one window after the last birth of a path.
    pub end: Option<Time>,
    /// Time integrator.
    pub scheme: Scheme,
    /// Length of fixed steps; default: adaptive steps.
    pub step: Option<Time>,
    /// Largest temporal error in a step; default 0.1 K.
    pub tolerance: Option<TemperatureDifference>,
    /// First step, also after each birth; default: a millionth of the end time.
    pub first_step: Option<Time>,
    /// Longest step; default: none.
    pub longest_step: Option<Time>,
    /// Lumped or consistent capacity.
    pub capacity: Capacity,
    /// Linear solver.
    pub solver: LinearSolver,
    /// Largest rms error of linear solves; default 1e-7 K.
    pub solver_tolerance: Option<TemperatureDifference>,
}

/// Place in the mesh at which values are interpolated from the nodes of its element.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeSpec {
    /// Name of the probe, prefix of its values: `NAME.temperature`, ….
    pub name: String,
    /// Coordinates, in the mesh or at most half an element outside.
    pub at: [Length; 3],
}

/// Output beside the report.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PartOutput {
    /// Draws pictures (PNG); default true.
    pub pictures: bool,
    /// Writes fields as VTKHDF; default true.
    pub fields: bool,
    /// Time between field outputs; default: a fiftieth of the run.
    pub every: Option<Time>,
    /// Number of stages in pictures; default 5.
    pub stages: usize,
    /// View of the part in pictures.
    pub solid: SolidSpec,
    /// Magnification of displacements in `warped.png`, with `[mechanics]`; default: chosen from the
    /// displacements.
    pub magnify: Option<f64>,
    /// Lines along which temperature and fields are written at the end.
    pub line: Vec<LineSpec>,
}

impl Default for PartOutput {
    fn default() -> Self {
        let (solid, line) = (SolidSpec::default(), Vec::new());
        Self { pictures: true, fields: true, every: None, stages: 5, solid, magnify: None, line }
    }
}

/// Default number of field outputs.
const FRAMES: f64 = 50.0;

impl PartScene {
    /// Returns the time between field outputs of a run to `end`, s. By default, fixed steps are not cut.
    pub fn every(&self, end: f64) -> f64 {
        let frame = end / FRAMES;
        match (self.output.every, self.time.step.map(|step| step.si())) {
            (Some(every), _) => every.si(),
            (None, Some(step)) => step * (frame / step).ceil().max(1.0),
            (None, None) => frame,
        }
    }

    /// Returns a note if field outputs cut fixed steps.
    pub fn cut_steps(&self) -> Option<String> {
        let [step, every] = [self.time.step?.si(), self.output.every?.si()];
        let count = every / step;
        let cuts = (count - count.round()).abs() > 1e-9 * count || count < 0.5;
        cuts.then(|| {
            format!(
                "`output.every` of {every} s is no multiple of `time.step` = {step} s: some steps are \
                 shortened"
            )
        })
    }

    /// Checks everything that does not need the mesh.
    ///
    /// # Errors
    /// Returns a [`SceneError`] with key, value and allowed values.
    pub fn check(&self, source: &Source) -> Result<(), SceneError> {
        for name in self.materials.keys() {
            check_name(source, &format!("materials.{name}"), name)?;
        }
        if self.region.is_empty() {
            return Err(source.missing("region", "the scene needs at least one [[region]]"));
        }
        for (index, region) in self.region.iter().enumerate() {
            if !self.materials.contains_key(&region.material) {
                let known: Vec<&str> = self.materials.keys().map(String::as_str).collect();
                let key = format!("region[{index}].material");
                return Err(source.unknown(&key, &region.material, &known));
            }
        }
        for (index, boundary) in self.boundary.iter().enumerate() {
            boundary.check(source, &format!("boundary[{index}]"))?;
        }
        for (index, probe) in self.probe.iter().enumerate() {
            let key = format!("probe[{index}].name");
            check_name(source, &key, &probe.name)?;
            if self.probe[..index].iter().any(|other| other.name == probe.name) {
                return Err(source.error(
                    &key,
                    format!("`{}` twice", probe.name),
                    "a different name for each probe",
                ));
            }
        }
        if let Some(print) = &self.print {
            print.check(source, self.mesh.path.is_some())?;
        } else if self.time.end.is_none() {
            return Err(source.missing("time.end", "a scene without [print] needs an end time"));
        }
        let positive = |key: &str, value: Option<f64>| match value {
            Some(value) if !(value > 0.0 && value.is_finite()) => {
                Err(source.error(key, value, "above 0, finite"))
            }
            _ => Ok(()),
        };
        positive("time.end", self.time.end.map(|t| t.si()))?;
        positive("time.step", self.time.step.map(|t| t.si()))?;
        positive("time.first_step", self.time.first_step.map(|t| t.si()))?;
        positive("time.longest_step", self.time.longest_step.map(|t| t.si()))?;
        positive("time.tolerance", self.time.tolerance.map(|t| t.si()))?;
        positive("time.solver_tolerance", self.time.solver_tolerance.map(|t| t.si()))?;
        positive("output.every", self.output.every.map(|t| t.si()))?;
        if self.time.step.is_some() {
            for (key, given) in [
                ("tolerance", self.time.tolerance.is_some()),
                ("first_step", self.time.first_step.is_some()),
                ("longest_step", self.time.longest_step.is_some()),
            ] {
                if given {
                    let key = format!("time.{key}");
                    let why = "it belongs to adaptive steps; remove it, or remove `time.step`";
                    return Err(source.unexpected(&key, why));
                }
            }
        }
        if !(1..=12).contains(&self.output.stages) {
            return Err(source.error("output.stages", self.output.stages, "1 to 12"));
        }
        positive("output.magnify", self.output.magnify)?;
        self.output.solid.check(source, "output.solid")
    }
}

impl BoundarySpec {
    /// Returns the corners of the box that limits the surface, m.
    pub fn corners(&self) -> Option<[[f64; 3]; 2]> {
        let corner =
            |given: &Option<[Length; 3]>, default: f64| given.map_or([default; 3], |x| x.map(|x| x.si()));
        let bounded = self.min.is_some() || self.max.is_some();
        bounded.then(|| [corner(&self.min, f64::NEG_INFINITY), corner(&self.max, f64::INFINITY)])
    }

    fn check(&self, source: &Source, key: &str) -> Result<(), SceneError> {
        let exchange = self.film.is_some() || self.emissivity.is_some();
        let given = [self.temperature.is_some(), self.flux.is_some(), exchange];
        if given.iter().filter(|&&given| given).count() != 1 {
            let allowed = "one of `temperature`, `flux`, and `film` with or without `emissivity`";
            return Err(source.error(key, "none or several conditions", allowed));
        }
        if exchange != self.ambient.is_some() {
            let key = format!("{key}.ambient");
            return Err(match exchange {
                true => {
                    source.missing(&key, "convection and radiation need the temperature of the surroundings")
                }
                false => source.unexpected(&key, "it belongs to `film` and `emissivity`; remove it"),
            });
        }
        if self.temperature.is_some() && self.surface == "outer" {
            let key = format!("{key}.surface");
            let allowed = "a named surface or a side (prescribed temperatures act on nodes)";
            return Err(source.error(&key, "`outer` with a `temperature`", allowed));
        }
        if !self.except.is_empty() && self.surface != "outer" {
            let key = format!("{key}.except");
            return Err(source.unexpected(&key, "it belongs to `surface = \"outer\"`; remove it"));
        }
        Ok(())
    }
}

impl PrintSpec {
    /// Checks the keys; `of_mesh` is true for a mesh with its own tool path.
    fn check(&self, source: &Source, of_mesh: bool) -> Result<(), SceneError> {
        let along = self.path.is_some();
        if along && of_mesh {
            return Err(source.conflict(
                "print.path",
                "mesh.path",
                "the part is printed along `mesh.path`; remove it",
            ));
        }
        let layers = self.layers.is_some() || self.elements.is_some() || self.layer_height.is_some();
        if of_mesh && !layers && self.layer_time.is_none() {
            for (name, given) in [
                ("bead_width", self.bead_width.is_some()),
                ("bead_height", self.bead_height.is_some()),
                ("centre", self.centre),
                ("offset", self.offset.is_some()),
                ("fill", self.fill),
                ("filament", self.filament.is_some()),
                ("leave_out", !self.leave_out.is_empty()),
                ("acceleration", self.acceleration.is_some()),
                ("jerk", self.jerk.is_some()),
            ] {
                if given {
                    let key = format!("print.{name}");
                    return Err(source.unexpected(&key, "`mesh.path` determines it; remove it"));
                }
            }
            return self.check_numbers(source);
        }
        let path = along;
        let needed = [
            ("temperature", self.temperature.is_some(), !path, true),
            ("layer_time", self.layer_time.is_some(), !path, !path),
            ("filament", self.filament.is_some(), false, path),
            ("leave_out", !self.leave_out.is_empty(), false, path),
            ("acceleration", self.acceleration.is_some(), false, path),
            ("jerk", self.jerk.is_some(), false, path),
            ("layer_height", self.layer_height.is_some(), false, !path && self.elements.is_some()),
            ("layers", self.layers.is_some(), false, !path && self.elements.is_none()),
            ("bead_width", self.bead_width.is_some(), path, path),
            ("bead_height", self.bead_height.is_some(), path, path),
            ("window", self.window.is_some(), false, path),
            ("centre", self.centre, false, path),
            ("offset", self.offset.is_some(), false, path),
            ("fill", self.fill, false, path),
            ("elements", self.elements.is_some(), path || self.layer_height.is_some(), true),
        ];
        for (name, given, needed, allowed) in needed {
            let key = format!("print.{name}");
            let kind = if path { "printing along a path" } else { "printing in layers" };
            if needed && !given {
                return Err(source.missing(&key, format!("{kind} needs it")));
            }
            if given && !allowed {
                return Err(source.unexpected(&key, format!("{kind} does not use it; remove it")));
            }
        }
        self.check_numbers(source)
    }

    fn check_numbers(&self, source: &Source) -> Result<(), SceneError> {
        for (name, value) in [
            ("layer_time", self.layer_time.map(|t| t.si())),
            ("layer_height", self.layer_height.map(|t| t.si())),
            ("bead_width", self.bead_width.map(|t| t.si())),
            ("bead_height", self.bead_height.map(|t| t.si())),
            ("window", self.window.map(|t| t.si())),
        ] {
            if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
                return Err(source.error(&format!("print.{name}"), value, "above 0, finite"));
            }
        }
        match self.start.map(|t| t.si()).filter(|t| !(*t >= 0.0 && t.is_finite())) {
            Some(start) => Err(source.error("print.start", start, "0 s or later, finite")),
            None => Ok(()),
        }
    }
}
