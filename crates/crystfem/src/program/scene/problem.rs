//! Builds the heat problem of a part scene.

use super::locate_error::{located, located_in};
use super::mechanics::Mechanics;
use super::memory;
use super::part::{BoundarySpec, PartScene};
use super::selection::{elements, millimetres};
use super::voxels::{BuiltMesh, Filling};
use crate::boundary::{Condition, FaceSelection, Field, HeatSource, Schedule};
use crate::coupling::HealingSettings;
use crate::material::{ThermalMaterial, fill_elements};
use crate::mesh::surface::OuterSurface;
use crate::mesh::{Face, LocatedPoint, Mesh};
use crate::print_plan::PrintPlan;
use crate::problem::{Problem, initial_temperatures};
use crate::simulation::Settings;
use crate::time::Steps;
use harness::scene::{LineSpec, SceneError, Source};
use std::collections::HashSet;
use std::sync::Arc;

/// Default temporal error in a step, K, and default rms error of linear solves, K.
const TOLERANCE: f64 = 0.1;
const SOLVER_TOLERANCE: f64 = 1e-7;
/// Temperatures below this, K, are probably °C.
const COLD: f64 = 200.0;
/// Default first step over the end time, and smallest over first step.
const FIRST_STEP: f64 = 1e-6;
const SMALLEST_STEP: f64 = 1e-3;

/// Parameters of conditions and their keys.
const CONDITION_KEYS: [(&str, &str); 5] = [
    ("prescribed temperature", "temperature"),
    ("flux", "flux"),
    ("film coefficient", "film"),
    ("emissivity", "emissivity"),
    ("ambient temperature", "ambient"),
];

/// Problem and settings of a part scene.
pub struct PartTask {
    /// Heat problem.
    pub problem: Arc<Problem>,
    /// Settings of the solution.
    pub settings: Settings,
    /// End time, s.
    pub end: f64,
    /// Printed elements, ascending; all elements without printing.
    pub printed: Vec<u32>,
    /// Elements of each layer, if there are layers.
    pub layers: Vec<Vec<u32>>,
    /// Location of each probe.
    pub probes: Vec<LocatedPoint>,
    /// Locations of the points of each line; `None` outside the mesh.
    pub lines: Vec<Vec<Option<LocatedPoint>>>,
    /// Filled fractions of the elements, for a mesh from a path or an STL surface.
    pub filling: Option<Filling>,
    /// Settings of the stress, if the scene has `[mechanics]`.
    pub mechanics: Option<Mechanics>,
    /// Interfaces that heal, if the scene has `[healing]`.
    pub interfaces: Option<HealingSettings>,
    /// Notes for the user.
    pub notes: Vec<String>,
}

impl PartScene {
    /// Builds the problem on a mesh.
    ///
    /// # Errors
    /// Returns a [`SceneError`] for unknown sets and surfaces, elements without a material, and the errors of
    /// [`Problem::check`].
    pub fn task(&self, source: &Source, built: BuiltMesh) -> Result<PartTask, SceneError> {
        let BuiltMesh { mesh, filling, .. } = built;
        let mut notes = Vec::new();
        let probes = self.locate_probes(source, &mesh, &mut notes)?;
        let (mut materials, mut material_of, temperature_of) = self.regions(source, &mesh)?;
        let shown = materials.iter().flat_map(|material| material.field_names().iter().copied());
        let shown: Vec<String> = ["temperature"].into_iter().chain(shown).map(str::to_owned).collect();
        let lines = self.locate_lines(source, &mesh, &shown)?;
        let conditions = self.conditions(source, &mesh)?;
        self.note_cold(source, &mut notes)?;
        let mut heats = Vec::new();
        for (index, spec) in self.source.iter().enumerate() {
            let elements =
                elements(source, &mesh, &format!("source[{index}].elements"), spec.elements.as_deref())?;
            let power = Field::Uniform(spec.power.build(source, &format!("source[{index}].power"))?);
            heats.push(HeatSource { elements, power });
        }
        let PrintPlan { births, absent, layers, end: default_end } = match &self.print {
            Some(print) => print.plan(source, &mesh, filling.as_ref(), &mut notes).map_err(|fault| {
                // a file in millimetres that is read in metres has few layers, or lies far away
                self.mesh.without_unit(source, &mesh).unwrap_or(fault)
            })?,
            None => PrintPlan::default(),
        };
        let mut mechanics = {
            let path = filling.as_ref().and_then(|filling| filling.path.as_ref()).map(|(path, _)| path);
            self.mechanics(source, &mesh, &material_of, &absent, path)?
        };
        if let Some(mechanics) = &mut mechanics {
            if let Some((kind, _)) = self.mesh.sector() {
                notes.push(format!(
                    "the cuts `start` and `end` of `[mesh.{kind}]` are planes of symmetry for `[mechanics]`: \
                     warpage has the symmetry of the body"
                ));
            }
            mechanics.settings.stress_free = Some(temperature_of.clone());
        }
        let interfaces = self.interfaces(source, &mesh, &material_of, &births)?;
        let end = self.time.end.map_or(default_end, |end| end.si());
        memory::refuse_times(source, self, end)?;
        self.note_hot_bed(source, end, &mut notes)?;
        if let Some(last) = births.iter().map(|birth| birth.time).reduce(f64::max).filter(|last| *last >= end)
        {
            let allowed = format!("after the last birth at {last} s");
            return Err(source.error("time.end", format!("{end} s"), allowed));
        }
        self.check_release(source, births.iter().map(|birth| birth.time).reduce(f64::max), end)?;
        for (spec, place) in self.probe.iter().zip(&probes) {
            if place.elements().iter().all(|element| absent.binary_search(element).is_ok()) {
                notes
                    .push(format!("probe `{}` lies where nothing is printed and records nothing", spec.name));
            }
        }
        let mut printed: Vec<u32> = births.iter().flat_map(|birth| birth.elements.iter().copied()).collect();
        printed.sort_unstable();
        if printed.is_empty() {
            printed = (0..mesh.element_count() as u32).collect();
        }
        let later = births.iter().flat_map(|birth| &birth.elements).chain(&absent).copied();
        let later: HashSet<u32> = later.collect();
        let initial = initial_temperatures(&mesh, &temperature_of, &later);
        let capacity = self.time.capacity;
        if let Some((parts, part_of)) = filling.as_ref().and_then(|filling| filling.parts.as_ref()) {
            fill_elements(&mut materials, &mut material_of, parts, part_of)
                .map_err(|error| located(source, "mesh", &error))?;
        }
        let problem = Problem {
            mesh,
            materials,
            material_of,
            initial,
            conditions,
            sources: heats,
            births,
            absent,
            capacity,
        };
        problem.check().map_err(|error| located(source, "mesh", &error))?;
        let settings = self.settings(end, problem.shortest_period());
        Ok(PartTask {
            problem: Arc::new(problem),
            settings,
            end,
            printed,
            layers,
            probes,
            lines,
            filling,
            mechanics,
            interfaces,
            notes,
        })
    }

    /// Notes implausibly cold temperatures: values in °C that are written as K.
    fn note_cold(&self, source: &Source, notes: &mut Vec<String>) -> Result<(), SceneError> {
        let mut written = Vec::new();
        for (index, region) in self.region.iter().enumerate() {
            written.push((format!("region[{index}].temperature"), region.temperature.si()));
        }
        for (index, boundary) in self.boundary.iter().enumerate() {
            for (name, given) in [("temperature", &boundary.temperature), ("ambient", &boundary.ambient)] {
                let key = format!("boundary[{index}].{name}");
                if let Some(given) = given {
                    written.push((key.clone(), given.build(source, &key)?.lowest()));
                }
            }
        }
        if let Some(temperature) = self.print.as_ref().and_then(|print| print.temperature.as_ref()) {
            let key = "print.temperature".to_owned();
            let lowest = temperature.build(source, &key)?.lowest();
            written.push((key, lowest));
        }
        for (key, kelvin) in written.into_iter().filter(|(_, kelvin)| *kelvin < COLD) {
            notes
                .push(format!("`{key}` is {kelvin} K, which is {:.2} °C: is `degC` meant?", kelvin - 273.15));
        }
        Ok(())
    }

    /// Notes a bed that the G-code switches off but that is still hot at the end, s.
    fn note_hot_bed(&self, source: &Source, end: f64, notes: &mut Vec<String>) -> Result<(), SceneError> {
        for (index, boundary) in self.boundary.iter().enumerate() {
            for (name, given) in [("temperature", &boundary.temperature), ("ambient", &boundary.ambient)] {
                let key = format!("boundary[{index}].{name}");
                let Some(given) = given else { continue };
                if let Some((off, then)) = given.still_hot(source, &key, end)? {
                    let celsius = then - 273.15;
                    notes.push(format!(
                        "`{key}`: the bed is switched off at {off:.1} s and still has {celsius:.1} °C at \
                          the end of the run, {end:.1} s; a later `time.end` lets the part cool"
                    ));
                }
            }
        }
        Ok(())
    }

    /// Locates each probe in the mesh.
    fn locate_probes(
        &self,
        source: &Source,
        mesh: &Mesh,
        notes: &mut Vec<String>,
    ) -> Result<Vec<LocatedPoint>, SceneError> {
        let mut places = Vec::new();
        for (index, probe) in self.probe.iter().enumerate() {
            let at = probe.at.map(|x| x.si());
            let Some(place) = mesh.locate(at) else {
                let [low, high] = mesh.bounds().unwrap_or_default().map(millimetres);
                let found = format!("{}, outside the mesh", millimetres(at));
                let allowed = format!("a place in the mesh, which reaches from {low} to {high}");
                return Err(source.error(&format!("probe[{index}].at"), found, allowed));
            };
            if place.distance() > 0.0 {
                let (name, distance) = (&probe.name, 1e3 * place.distance());
                notes.push(format!(
                    "probe `{name}` lies {distance:.4} mm outside the mesh: values are those of the nearest \
                     element"
                ));
            }
            places.push(place);
        }
        Ok(places)
    }

    /// Locates the points of each line in the mesh.
    fn locate_lines(
        &self,
        source: &Source,
        mesh: &Mesh,
        columns: &[String],
    ) -> Result<Vec<Vec<Option<LocatedPoint>>>, SceneError> {
        LineSpec::check(&self.output.line, source, 3, columns)?;
        let mut lines = Vec::new();
        for (index, line) in self.output.line.iter().enumerate() {
            let places = line.places::<3>();
            let places = mesh.locate_along(places[0], places[places.len() - 1], &places);
            line.refuse_outside(source, index, places.iter().any(Option::is_some))?;
            lines.push(places);
        }
        Ok(lines)
    }

    #[allow(clippy::type_complexity)]
    fn regions(
        &self,
        source: &Source,
        mesh: &Mesh,
    ) -> Result<(Vec<Arc<dyn ThermalMaterial>>, Vec<u16>, Vec<f64>), SceneError> {
        let mut materials: Vec<Arc<dyn ThermalMaterial>> = Vec::new();
        for (name, spec) in &self.materials {
            materials.push(spec.build(source, &format!("materials.{name}"))?.into());
        }
        let mut material_of = vec![u16::MAX; mesh.element_count()];
        let mut temperature_of = vec![f64::NAN; mesh.element_count()];
        for (index, region) in self.region.iter().enumerate() {
            let key = format!("region[{index}].elements");
            let material = self.materials.keys().position(|name| *name == region.material).unwrap_or(0);
            for element in elements(source, mesh, &key, region.elements.as_deref())? {
                material_of[element as usize] = material as u16;
                temperature_of[element as usize] = region.temperature.si();
            }
        }
        if let Some(bare) = material_of.iter().position(|&material| material == u16::MAX) {
            let [x, y, z] = mesh.centre(bare as u32);
            let found = format!("element {bare} at ({x:.4e}, {y:.4e}, {z:.4e}) m without a material");
            return Err(source.error("region", found, "regions that cover all elements"));
        }
        Ok((materials, material_of, temperature_of))
    }

    fn conditions(&self, source: &Source, mesh: &Mesh) -> Result<Vec<Condition>, SceneError> {
        let surface = OuterSurface::of_all(mesh).map_err(|error| located(source, "mesh", &error))?;
        let faces = |key: &str, name: &str| -> Result<Vec<Face>, SceneError> {
            let region = surface.region(mesh, name);
            region.map(|region| surface.all_in(&region)).map_err(|error| located(source, key, &error))
        };
        let middle = |face: &Face| {
            let nodes = mesh.face_nodes(*face);
            let sum = |d: usize| nodes.iter().map(|node| mesh.points[*node as usize][d]).sum::<f64>();
            [0, 1, 2].map(|d| sum(d) / nodes.len() as f64)
        };
        let mut conditions = Vec::new();
        for (index, spec) in self.boundary.iter().enumerate() {
            let key = format!("boundary[{index}]");
            let mut except = Vec::new();
            for name in &spec.except {
                except.extend(faces(&format!("{key}.except"), name)?);
            }
            // cuts are not outside
            if spec.surface == "outer" && self.mesh.sector().is_some() {
                except.extend(["start", "end"].iter().filter_map(|cut| mesh.surfaces.get(*cut)).flatten());
            }
            // a node set has no faces
            if let (Some(temperature), Some(nodes)) = (&spec.temperature, spec.node_set(mesh)) {
                let value = Field::Uniform(temperature.build(source, &format!("{key}.temperature"))?);
                let condition = Condition::Temperature { nodes, value };
                condition.check().map_err(|error| located_in(source, &key, &CONDITION_KEYS, &error))?;
                conditions.push(condition);
                continue;
            }
            let place = if let Some([min, max]) = spec.corners() {
                let mut inside = faces(&format!("{key}.surface"), &spec.surface)?;
                inside.retain(|face| {
                    let at = middle(face);
                    (0..3).all(|d| (min[d]..=max[d]).contains(&at[d])) && !except.contains(face)
                });
                if inside.is_empty() {
                    let found = format!(
                        "no face of `{}` from {} to {}",
                        spec.surface,
                        millimetres(min),
                        millimetres(max)
                    );
                    return Err(source.error(
                        &format!("{key}.min"),
                        found,
                        "a box that contains the centre of a face",
                    ));
                }
                FaceSelection::Faces(inside)
            } else if spec.surface == "outer" {
                FaceSelection::Outer { except }
            } else {
                FaceSelection::Faces(faces(&format!("{key}.surface"), &spec.surface)?)
            };
            for condition in spec.conditions(source, &key, mesh, place)? {
                condition.check().map_err(|error| located_in(source, &key, &CONDITION_KEYS, &error))?;
                conditions.push(condition);
            }
        }
        Ok(conditions)
    }

    /// Returns the solution settings. Adaptive steps are at most 1/8 of the shortest period of the
    /// conditions.
    fn settings(&self, end: f64, period: Option<f64>) -> Settings {
        let time = &self.time;
        let most = period.map_or(f64::INFINITY, |period| period / 8.0);
        let steps = match time.step {
            Some(step) => Steps::Fixed { dt: step.si() },
            None => {
                let first = time.first_step.map_or(FIRST_STEP * end, |first| first.si()).min(most);
                Steps::Adaptive {
                    tolerance: time.tolerance.map_or(TOLERANCE, |tolerance| tolerance.si()),
                    first,
                    smallest: SMALLEST_STEP * first,
                    largest: time
                        .longest_step
                        .map_or(f64::INFINITY, |longest| longest.si())
                        .min(most)
                        .max(first),
                }
            }
        };
        let tolerance = time.solver_tolerance.map_or(SOLVER_TOLERANCE, |tolerance| tolerance.si());
        Settings { scheme: time.scheme, steps, tolerance, solver: time.solver }
    }
}

impl BoundarySpec {
    /// Returns the nodes of a node set, inside the box if there is one; `None` if a surface has this name.
    fn node_set(&self, mesh: &Mesh) -> Option<Vec<u32>> {
        let set = mesh.node_sets.get(&self.surface).filter(|_| !mesh.surfaces.contains_key(&self.surface))?;
        let Some([min, max]) = self.corners() else { return Some(set.clone()) };
        let inside = |node: &&u32| {
            let at = mesh.points[**node as usize];
            (0..3).all(|d| (min[d]..=max[d]).contains(&at[d]))
        };
        Some(set.iter().filter(inside).copied().collect()).filter(|nodes: &Vec<u32>| !nodes.is_empty())
    }

    fn conditions(
        &self,
        source: &Source,
        key: &str,
        mesh: &Mesh,
        place: FaceSelection,
    ) -> Result<Vec<Condition>, SceneError> {
        let path = |name: &str| format!("{key}.{name}");
        let mut conditions = Vec::new();
        if let Some(temperature) = &self.temperature {
            let nodes = match &place {
                FaceSelection::Faces(faces) => mesh.nodes_of(faces),
                FaceSelection::Outer { .. } => Vec::new(),
            };
            let value = Field::Uniform(temperature.build(source, &path("temperature"))?);
            conditions.push(Condition::Temperature { nodes, value });
        }
        if let Some(flux) = &self.flux {
            let inward = Field::Uniform(flux.build(source, &path("flux"))?);
            conditions.push(Condition::Flux { surface: place.clone(), inward });
        }
        let ambient = match &self.ambient {
            Some(ambient) => ambient.build(source, &path("ambient"))?,
            None => Schedule::constant(0.0),
        };
        if let Some(film) = &self.film {
            let coefficient = film.build(source, &path("film"))?;
            let (surface, ambient) = (place.clone(), ambient.clone());
            conditions.push(Condition::Film { surface, coefficient, ambient });
        }
        if let Some(emissivity) = self.emissivity {
            conditions.push(Condition::Radiation { surface: place, emissivity, ambient });
        }
        Ok(conditions)
    }
}
