//! Stress of a part: its elements, its bed and the interval between solutions.

use super::PartScene;
use super::locate_error::located;
use super::polymer::PolymerSpec;
use crate::coupling::{STRAIN_STEP, StressSettings, loose_elements};
use crate::mechanics::{Roller, SolidifyingMaxwell, is_supported, key};
use crate::mesh::Mesh;
use crate::mesh::path::ToolPath;
use harness::scene::{SceneError, Source};
use polycore::units::{PerTemperature, Ratio, Stress, Time};
use serde::Deserialize;
use std::collections::HashSet;

/// Matrix bytes per hexahedron, and per tetrahedron of 4 and 10 nodes.
const HEXAHEDRON_BYTES: f64 = 26e3;
const TETRAHEDRON_BYTES: [f64; 2] = [2e3, 10e3];

/// Angle, rad, and share of a length, that are rounding.
const SMALLEST_TURN: f64 = 1e-9;

/// Stress and warpage, computed from the temperatures; deformation does not affect the heat.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MechanicsSpec {
    /// Material whose elements bear stress; with `pa12` it must be semicrystalline.
    pub material: String,
    /// Mechanical constants.
    pub law: MechanicsLaw,
    /// Surface or side of the mesh whose nodes are fixed during printing; default: the nodes that the part
    /// shares with other materials.
    pub bed: Option<String>,
    /// Releases the part from the bed, at the end or at `release_at`; default true.
    #[serde(default = "super::default_true")]
    pub release: bool,
    /// Time of the release, for annealing of the free part until the end of the run; default: the end.
    pub release_at: Option<Time>,
    /// Longest time between two solutions, for relaxation while the temperature rests; default: none.
    pub longest_step: Option<Time>,
    /// Writes the compensation of the displacements, and prints the compensated shape in simulation; default
    /// false.
    #[serde(default)]
    pub compensation: bool,
    /// Largest change of the linear free strain of an element between two solutions; default 2e-4.
    pub strain_step: Option<f64>,
}

/// Mechanical constants.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MechanicsLaw {
    /// PA12, with assumed constants: see the guide, *Stress of prints*.
    Pa12,
    /// Elastic, with thermal expansion, for any material.
    Elastic(ElasticSpec),
    /// Relaxing, with shifts of the relaxation times and flow, for any material.
    Polymer(Box<PolymerSpec>),
}

/// Linear thermoelasticity, σ = C:(ε − α ΔT 1).
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ElasticSpec {
    /// Young's modulus.
    pub modulus: Stress,
    /// Poisson's ratio, above −1 and below 0.5.
    pub poisson: f64,
    /// Linear thermal expansion α.
    pub expansion: PerTemperature,
    /// Tensile strength, for `largest_mises_over_strength`.
    pub strength: Option<Stress>,
}

impl MechanicsLaw {
    /// Returns the law of a material with this ultimate crystallinity.
    fn build(&self, source: &Source, crystallinity: f64) -> Result<SolidifyingMaxwell, SceneError> {
        let spec = match self {
            Self::Pa12 => return Ok(SolidifyingMaxwell::pa12().with_crystallinity(crystallinity)),
            Self::Polymer(spec) => return spec.build(source),
            Self::Elastic(spec) => spec,
        };
        let wrong = |key: &str, found: f64, allowed: &str| {
            Err(source.error(&format!("mechanics.law.elastic.{key}"), found, allowed))
        };
        let positive = |stress: f64| stress > 0.0 && stress.is_finite();
        let strength = spec.strength.map_or(f64::INFINITY, |strength| strength.si());
        if !positive(spec.modulus.si()) {
            return wrong("modulus", spec.modulus.si(), "above 0, finite");
        }
        if !(spec.poisson > -1.0 && spec.poisson < 0.5) {
            return wrong("poisson", spec.poisson, "above -1 and below 0.5");
        }
        if strength.is_nan() || strength <= 0.0 {
            return wrong("strength", strength, "above 0");
        }
        if !spec.expansion.si().is_finite() {
            return wrong("expansion", spec.expansion.si(), "finite");
        }
        Ok(SolidifyingMaxwell::elastic(spec.modulus.si(), spec.poisson, spec.expansion.si(), strength))
    }
}

/// Stress settings of a part, and their cost.
pub struct Mechanics {
    /// Settings of the stress solution.
    pub settings: StressSettings,
    /// Number of elements that bear stress, and of different element shapes.
    pub counts: [usize; 2],
    /// Matrix bytes of all shapes.
    pub matrices: f64,
    /// True if displacements are compensated.
    pub compensation: bool,
    /// True if all stressed elements are 4-node tetrahedra, which are too stiff.
    pub stiff: bool,
}

impl PartScene {
    /// Returns the mechanics of a scene that has `[mechanics]`. `material_of` holds the material index of
    /// each element, `absent` the elements that are never printed, `path` the tool path of a `[mesh.path]`.
    ///
    /// # Errors
    /// Returns a [`SceneError`] for unknown names, unsupported element types, and a part that is not fixed.
    pub(super) fn mechanics(
        &self,
        source: &Source,
        mesh: &Mesh,
        material_of: &[u16],
        absent: &[u32],
        path: Option<&ToolPath>,
    ) -> Result<Option<Mechanics>, SceneError> {
        let Some(spec) = &self.mechanics else { return Ok(None) };
        let known: Vec<&str> = self.materials.keys().map(String::as_str).collect();
        let Some(index) = known.iter().position(|name| *name == spec.material) else {
            return Err(source.unknown("mechanics.material", &spec.material, &known));
        };
        let material = &self.materials[&spec.material];
        if spec.law == MechanicsLaw::Pa12 && material.kinetics.is_none() {
            let found = format!("`{}`, a material that does not crystallize", spec.material);
            return Err(source.error("mechanics.material", found, "a semicrystalline material"));
        }
        if let MechanicsLaw::Polymer(law) = &spec.law {
            law.check_crystals(source, &spec.material, material.kinetics.is_some())?;
        }
        for (name, given) in [("release_at", spec.release_at), ("longest_step", spec.longest_step)] {
            let first = if name == "release_at" { 0.0 } else { f64::MIN_POSITIVE };
            if let Some(time) = given.map(|t| t.si()).filter(|t| !(*t >= first && t.is_finite())) {
                let allowed = if first > 0.0 { "above 0 s, finite" } else { "0 s or later, finite" };
                return Err(source.error(&format!("mechanics.{name}"), time, allowed));
            }
        }
        if spec.release_at.is_some() && !spec.release {
            let why = "`release = false` keeps the part on its bed; remove one";
            return Err(source.conflict("mechanics.release_at", "mechanics.release", why));
        }
        let strain_step = spec.strain_step.unwrap_or(STRAIN_STEP);
        if !(strain_step > 0.0 && strain_step.is_finite()) {
            return Err(source.error("mechanics.strain_step", strain_step, "above 0, finite"));
        }
        let mut bears: Vec<bool> =
            material_of.iter().map(|&material| usize::from(material) == index).collect();
        absent.iter().for_each(|&element| bears[element as usize] = false);
        let all = || (0..mesh.element_count() as u32).map(|element| mesh.nodes(element));
        let others = all().filter(|nodes| !is_supported(nodes.len())).count();
        if others > 0 {
            let found = format!("a mesh with {others} wedges or second-order hexahedra");
            let allowed = "8-node hexahedra, 4- or 10-node tetrahedra (meshers produce tetrahedra for any \
                shape; so does `cells` of a bar, brick or revolved section)";
            return Err(source.error("mechanics", found, allowed));
        }
        let share = |given: Option<Ratio>| given.map_or(0.0, |ratio| ratio.si());
        let law = spec.law.build(source, share(material.crystallinity))?;
        self.check_temperatures(source, &spec.material, &law)?;
        let settings = StressSettings::new(mesh, law, bears, spec.bed.as_deref())
            .map_err(|error| located(source, "mechanics.bed", &error))?;
        let StressSettings { bears, bed, .. } = &settings;
        if bed.len() < 3 {
            let found = format!("{} nodes of the part on the bed", bed.len());
            let allowed = "at least 3 (use a surface of the part, or another material below it)";
            return Err(source.error("mechanics.bed", found, allowed));
        }
        let loose = loose_elements(mesh, bears, bed);
        if loose > 0 {
            let found = format!("{loose} elements that are not connected to the bed");
            let mut allowed = "a connected part that touches the bed".to_owned();
            if let Some(path) = path {
                let names: Vec<&str> =
                    path.shares().iter().map(|share| share.0).filter(|name| !name.is_empty()).collect();
                allowed += "; `mesh.path.leave_out` removes skirts, brims and purge lines";
                allowed += &format!(
                    " (features of the file: {})",
                    if names.is_empty() { "none".into() } else { names.join(", ") }
                );
            }
            return Err(source.error("mechanics.bed", found, allowed));
        }
        let rollers = self.rollers(source, mesh, bed)?;
        let places =
            |nodes: &[u32]| -> Vec<_> { nodes.iter().map(|&node| mesh.points[node as usize]).collect() };
        let shapes: HashSet<(usize, Vec<i64>)> =
            all().map(|nodes| (nodes.len(), key(&places(nodes)))).collect();
        let counts = [bears.iter().filter(|bears| **bears).count(), shapes.len()];
        // K̂ and gradients
        let matrices = shapes.iter().map(|(nodes, _)| {
            if *nodes == 8 { HEXAHEDRON_BYTES } else { TETRAHEDRON_BYTES[usize::from(*nodes > 4)] }
        });
        let matrices = matrices.sum();
        let stiff = all().zip(bears).all(|(nodes, bears)| nodes.len() == 4 || !bears);
        let settings = StressSettings {
            initial_alpha: share(material.initial_alpha),
            strain_step,
            longest_step: spec.longest_step.map_or(f64::INFINITY, |time| time.si()),
            release: spec.release,
            release_at: spec.release_at.map(|time| time.si()),
            rollers,
            ..settings
        };
        Ok(Some(Mechanics { settings, counts, matrices, compensation: spec.compensation, stiff }))
    }

    /// Rollers on the cuts of a body of revolution, its planes of symmetry, and on its axis; none for other
    /// meshes.
    ///
    /// # Errors
    /// Returns a [`SceneError`] for half a body and more, whose cuts leave it free across the axis, and for a
    /// bed that is no cross-section.
    fn rollers(&self, source: &Source, mesh: &Mesh, bed: &[u32]) -> Result<Vec<Roller>, SceneError> {
        let Some((kind, angle)) = self.mesh.sector() else { return Ok(Vec::new()) };
        if angle >= std::f64::consts::PI - SMALLEST_TURN {
            let allowed = "below 180 deg with `[mechanics]`: the cuts are planes of symmetry, which hold the \
                           part only if they meet at an angle";
            let key = format!("mesh.{kind}.angle");
            return Err(source.error(&key, format!("{} deg", angle.to_degrees()), allowed));
        }
        let heights = bed.iter().map(|&node| mesh.points[node as usize][2]);
        let spread =
            heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(z), high.max(z)]);
        let [low, high] = mesh.bounds().unwrap_or_default();
        if spread[1] - spread[0] > SMALLEST_TURN * (high[2] - low[2]) {
            let flat = if kind == "tube" { "`bottom` or `top` of a tube" } else { "a side at one height z" };
            let allowed = format!("{flat}: its cuts are planes of symmetry and slide in themselves");
            return Err(source.error("mechanics.bed", "a side that is no cross-section", allowed));
        }
        Ok(Roller::on_cuts(mesh, angle))
    }

    /// Refuses initial and deposition temperatures outside the range of the law.
    fn check_temperatures(
        &self,
        source: &Source,
        material: &str,
        law: &SolidifyingMaxwell,
    ) -> Result<(), SceneError> {
        let check = |key: &str, kelvin: f64| {
            law.check_temperature(kelvin).map_err(|error| located(source, key, &error))
        };
        for (index, region) in
            self.region.iter().enumerate().filter(|(_, region)| region.material == material)
        {
            check(&format!("region[{index}].temperature"), region.temperature.si())?;
        }
        let printed = self.print.as_ref().and_then(|print| print.temperature.as_ref());
        let printed = printed.map(|schedule| schedule.build(source, "print.temperature")).transpose()?;
        for kelvin in printed.iter().flat_map(|schedule| [schedule.lowest(), schedule.highest()]) {
            check("print.temperature", kelvin)?;
        }
        Ok(())
    }

    /// Refuses a release before the last birth or after the end.
    ///
    /// # Errors
    /// Returns a [`SceneError`].
    pub(super) fn check_release(
        &self,
        source: &Source,
        last: Option<f64>,
        end: f64,
    ) -> Result<(), SceneError> {
        let release = self.mechanics.as_ref().and_then(|spec| spec.release_at).map(|time| time.si());
        let refused = |time: &f64| last.is_some_and(|last| *time <= last) || *time > end;
        let Some(time) = release.filter(refused) else { return Ok(()) };
        let first = last.map_or("from 0 s".to_owned(), |last| format!("after the last birth at {last} s,"));
        let allowed = format!("{first} up to the end at {end} s");
        Err(source.error("mechanics.release_at", format!("{time} s"), allowed))
    }
}
