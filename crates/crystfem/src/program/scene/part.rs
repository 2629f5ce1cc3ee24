//! The scene of a body in time: mesh, materials, layers, what acts on it.

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

/// A whole scene.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PartScene {
    /// The program that runs it: `crystfem`.
    pub program: Program,
    /// One line for tables and pictures.
    #[serde(default)]
    pub title: String,
    /// The mesh.
    pub mesh: MeshSpec,
    /// The materials, by name.
    pub materials: BTreeMap<String, MaterialSpec>,
    /// Elements of each material.
    pub region: Vec<RegionSpec>,
    /// Layers that appear one after another; without it everything exists from the start.
    pub print: Option<PrintSpec>,
    /// Conditions on surfaces.
    #[serde(default)]
    pub boundary: Vec<BoundarySpec>,
    /// Heat released in a volume.
    #[serde(default)]
    pub source: Vec<SourceSpec>,
    /// Stress and warpage.
    pub mechanics: Option<MechanicsSpec>,
    /// Healing of interfaces between layers and beads.
    pub healing: Option<HealingSpec>,
    /// Times and steps.
    #[serde(default)]
    pub time: TimeSpec,
    /// Places whose temperature and state are recorded in every step.
    #[serde(default)]
    pub probe: Vec<ProbeSpec>,
    /// Files to write.
    #[serde(default)]
    pub output: PartOutput,
    /// Variants to run instead of the scene itself.
    #[serde(default)]
    pub study: Vec<StudySpec>,
    /// Limits and orders of quantities over studies.
    #[serde(default)]
    pub convergence: Vec<Convergence>,
    /// Error against run time over studies.
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
    /// An element set of the mesh; default: all.
    pub elements: Option<String>,
    /// Name of its material.
    pub material: String,
    /// Temperature at the start, of what exists then.
    pub temperature: Temperature,
}

/// Elements that appear during the run: in layers, or along a path.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrintSpec {
    /// Temperature of new material at its birth; default: that of the nozzle in the G-code file.
    pub temperature: Option<ScheduleSpec<TemperatureDimension>>,
    /// Element sets `PREFIX1`, `PREFIX2`, …; default `layer-`.
    pub layers: Option<String>,
    /// Or an element set cut into layers of `layer_height`, or printed along a `path`.
    pub elements: Option<String>,
    /// Height of these layers.
    pub layer_height: Option<Length>,
    /// Time from one layer to the next.
    pub layer_time: Option<Time>,
    /// When the first layer, or the path, begins; default 0.
    pub start: Option<Time>,
    /// G-code (`.gcode`, `.g`, `.nc`) or a CSV table (`time [s]`, `x [mm]`, `y [mm]`, `z [mm]`, `print`).
    pub path: Option<PathBuf>,
    /// Width of the bead.
    pub bead_width: Option<Length>,
    /// Its height.
    pub bead_height: Option<Length>,
    /// Whether the middle of what the path lays down is put over the middle of `elements`, in x and y.
    #[serde(default)]
    pub centre: bool,
    /// Shifts the path.
    pub offset: Option<[Length; 3]>,
    /// Whether gaps between beads are filled, when the last bead at their height is finished; otherwise what no bead covers
    /// is not printed.
    #[serde(default)]
    pub fill: bool,
    /// Diameter of the filament, for the volume that G-code extrudes; default: as the file states it, or 1.75
    /// mm.
    pub filament: Option<Length>,
    /// Features of G-code that print nothing of the part, as of `mesh.path`.
    #[serde(default)]
    pub leave_out: Vec<String>,
    /// Limit of acceleration along G-code, for times; default: as the file states, or none: velocity is F.
    pub acceleration: Option<Acceleration>,
    /// Step of velocity at corners, with `acceleration`.
    pub jerk: Option<Speed>,
    /// Elements that the nozzle passes within one window appear together; default: a hundredth of the path's duration.
    pub window: Option<Time>,
}

/// A condition on a surface: one of a temperature, a flux, or a film and radiation.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoundarySpec {
    /// `outer` (the current outer surface), a surface of the mesh, an element set, a node set (a temperature acts on its nodes, else its
    /// outer faces count), or a side of the box around the mesh:
    /// `left`, `right`, `front`, `back`, `bottom`, `top`.
    pub surface: String,
    /// Surfaces that are left out of `outer`.
    #[serde(default)]
    pub except: Vec<String>,
    /// Lower corner of a box: only faces of the surface whose middle lies in it count; default: no bound.
    pub min: Option<[Length; 3]>,
    /// Its upper corner.
    pub max: Option<[Length; 3]>,
    /// Prescribed temperature.
    pub temperature: Option<ScheduleSpec<TemperatureDimension>>,
    /// Heat flux into the body.
    pub flux: Option<ScheduleSpec<HeatFluxDimension>>,
    /// Film coefficient h.
    pub film: Option<ScheduleSpec<HeatTransferDimension>>,
    /// Emissivity ε.
    pub emissivity: Option<f64>,
    /// Temperature of the surroundings, for film and radiation.
    pub ambient: Option<ScheduleSpec<TemperatureDimension>>,
}

/// Heat released in elements.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SourceSpec {
    /// An element set of the mesh; default: all.
    pub elements: Option<String>,
    /// Heat per volume.
    pub power: ScheduleSpec<PowerDensityDimension>,
}

/// Times and steps: of one length, or adaptive.
#[derive(Clone, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TimeSpec {
    /// End; default: one layer time after the last layer, or when the path ends and one window after its last birth.
    pub end: Option<Time>,
    /// Time integrator.
    pub scheme: Scheme,
    /// Steps of this length; default: adaptive.
    pub step: Option<Time>,
    /// Largest temporal error in a step; default 0.1 K.
    pub tolerance: Option<TemperatureDifference>,
    /// First step, and first after a birth; default: a millionth of the end.
    pub first_step: Option<Time>,
    /// Longest step; default: none.
    pub longest_step: Option<Time>,
    /// Lumped or consistent capacity.
    pub capacity: Capacity,
    /// Linear solver.
    pub solver: LinearSolver,
    /// Rms error of linear solves; default 1e-7 K.
    pub solver_tolerance: Option<TemperatureDifference>,
}

/// A place in the mesh; values there are interpolated between the nodes of its element.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeSpec {
    /// Its name: values are `NAME.temperature` and so on.
    pub name: String,
    /// Where: in the mesh, or no further outside than half an element.
    pub at: [Length; 3],
}

/// Files beside the report.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PartOutput {
    /// Pictures (PNG).
    pub pictures: bool,
    /// Fields as VTKHDF.
    pub fields: bool,
    /// Time between fields; default: a fiftieth of the whole.
    pub every: Option<Time>,
    /// Pictures of so many stages.
    pub stages: usize,
    /// How pictures show the body from outside.
    pub solid: SolidSpec,
    /// Factor on the displacements of `warped.png`, with `[mechanics]`; default: one that makes them well seen.
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

/// Fields written unless the scene says how often.
const FRAMES: f64 = 50.0;

impl PartScene {
    /// Time between fields of a run to `end`, s; fixed steps are not cut unless the scene says so.
    pub fn every(&self, end: f64) -> f64 {
        let frame = end / FRAMES;
        match (self.output.every, self.time.step.map(|step| step.si())) {
            (Some(every), _) => every.si(),
            (None, Some(step)) => step * (frame / step).ceil().max(1.0),
            (None, None) => frame,
        }
    }

    /// What is to be said where the times of fields cut fixed steps.
    pub fn cut_steps(&self) -> Option<String> {
        let [step, every] = [self.time.step?.si(), self.output.every?.si()];
        let count = every / step;
        let cuts = (count - count.round()).abs() > 1e-9 * count || count < 0.5;
        cuts.then(|| {
            format!("steps of {step} s end at the times of fields, too: `output.every` of {every} s is no multiple of `time.step`")
        })
    }

    /// Checks what can be judged without a mesh.
    ///
    /// # Errors
    /// A [`SceneError`] that names the key, the value found and what is allowed.
    pub fn check(&self, source: &Source) -> Result<(), SceneError> {
        for name in self.materials.keys() {
            check_name(source, &format!("materials.{name}"), name)?;
        }
        if self.region.is_empty() {
            return Err(source.error("region", "nothing", "at least one [[region]]"));
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
                return Err(source.error(&key, format!("`{}` twice", probe.name), "different names"));
            }
        }
        if let Some(print) = &self.print {
            print.check(source, self.mesh.path.is_some())?;
        } else if self.time.end.is_none() {
            return Err(source.error("time.end", "nothing", "a time, or a [print] that ends by itself"));
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
                    return Err(source.error(&key, "a key of adaptive steps", "nothing beside `step`"));
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
    /// Corners of the box that limits the surface, m.
    pub fn corners(&self) -> Option<[[f64; 3]; 2]> {
        let corner = |of: &Option<[Length; 3]>, none: f64| of.map_or([none; 3], |of| of.map(|x| x.si()));
        let bounded = self.min.is_some() || self.max.is_some();
        bounded.then(|| [corner(&self.min, f64::NEG_INFINITY), corner(&self.max, f64::INFINITY)])
    }

    fn check(&self, source: &Source, key: &str) -> Result<(), SceneError> {
        let exchange = self.film.is_some() || self.emissivity.is_some();
        let given = [self.temperature.is_some(), self.flux.is_some(), exchange];
        if given.iter().filter(|&&given| given).count() != 1 {
            let allowed = "one of `temperature`, `flux`, and `film` or `emissivity` (or both)";
            return Err(source.error(key, "none or several conditions", allowed));
        }
        if exchange != self.ambient.is_some() {
            let (found, allowed) = match exchange {
                true => ("nothing", "a temperature of the surroundings"),
                false => ("`ambient` of another condition", "nothing"),
            };
            return Err(source.error(&format!("{key}.ambient"), found, allowed));
        }
        if self.temperature.is_some() && self.surface == "outer" {
            let key = format!("{key}.surface");
            let allowed =
                "a named surface or a side: prescribed temperatures act on nodes, inside as outside";
            return Err(source.error(&key, "`outer` with a `temperature`", allowed));
        }
        if !self.except.is_empty() && self.surface != "outer" {
            let key = format!("{key}.except");
            return Err(source.error(&key, "`except` of another surface", "`surface = \"outer\"`"));
        }
        Ok(())
    }
}

impl PrintSpec {
    /// `of_mesh`: the mesh is that of a path.
    fn check(&self, source: &Source, of_mesh: bool) -> Result<(), SceneError> {
        let along = self.path.is_some();
        if along && of_mesh {
            return Err(source.error(
                "print.path",
                "a path beside that of the mesh",
                "nothing: `mesh.path` is printed",
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
                    return Err(source.error(&key, format!("`{name}` of a mesh of a path"), "nothing"));
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
            let of = if path { "a path" } else { "layers" };
            if needed && !given {
                return Err(source.error(&key, "nothing", format!("`{name}`: {of} need it")));
            }
            if given && !allowed {
                return Err(source.error(&key, format!("`{name}` of {of}"), "nothing"));
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
