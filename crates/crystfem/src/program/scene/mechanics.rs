//! Stress of a part: which elements, which bed, how often.

use super::PartScene;
use super::fault::located;
use crate::coupling::{STRAIN_STEP, StressSettings, loose_elements};
use crate::mechanics::{SolidifyingMaxwell, is_supported, key};
use crate::mesh::Mesh;
use crate::mesh::path::ToolPath;
use harness::scene::{SceneError, Source};
use polycore::units::{PerTemperature, Ratio, Stress};
use serde::Deserialize;
use std::collections::HashSet;

/// Bytes of the matrices of a hexahedron, and of tetrahedra of 4 and 10 nodes.
const HEXAHEDRON: f64 = 26e3;
const TETRAHEDRON: [f64; 2] = [2e3, 10e3];

/// Stress and warpage beside the heat: what happens to the shape does not act back on temperatures.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MechanicsSpec {
    /// The material whose elements bear stress; with `pa12` it must be semicrystalline.
    pub material: String,
    /// Its mechanical constants.
    pub law: MechanicsLaw,
    /// A surface of the mesh or a side, whose nodes are held while the part is printed; default: the nodes that the part shares with other
    /// materials.
    pub bed: Option<String>,
    /// Whether the part is taken off the bed at the end; default true.
    #[serde(default = "yes")]
    pub release: bool,
    /// Largest change of the linear free strain in any element between two solutions; default 2e-4.
    pub strain_step: Option<f64>,
}

fn yes() -> bool {
    true
}

/// Mechanical constants.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MechanicsLaw {
    /// PA12, with assumed constants: see the guide, *Stress of prints*.
    Pa12,
    /// Elastic, with thermal expansion; of any material.
    Elastic(ElasticSpec),
}

/// σ = C:(ε − α ΔT 1).
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
    /// The law of a material with these crystals at α = 1.
    fn solve(&self, source: &Source, crystallinity: f64) -> Result<SolidifyingMaxwell, SceneError> {
        let Self::Elastic(spec) = self else {
            return Ok(SolidifyingMaxwell::pa12().with_crystallinity(crystallinity));
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

/// Stress beside the heat, and what it needs.
pub struct Mechanics {
    /// The part that bears stress.
    pub settings: StressSettings,
    /// Numbers of elements that bear stress, and of shapes of all elements.
    pub counts: [usize; 2],
    /// Bytes of the matrices of all shapes.
    pub matrices: f64,
    /// Whether all that bears stress are tetrahedra of 4 nodes, which are too stiff.
    pub stiff: bool,
}

impl PartScene {
    /// The mechanics of a scene on a mesh, where it has any; `material_of` are the materials of elements by their place in the scene, and `absent`
    /// elements are never printed; `path` is that of a mesh of one.
    ///
    /// # Errors
    /// A [`SceneError`] for unknown names, elements that are neither hexahedra of first order nor tetrahedra, and a part that nothing holds.
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
            let found = format!("`{}`, which does not crystallize", spec.material);
            return Err(source.error("mechanics.material", found, "a semicrystalline material"));
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
            let found = format!("a mesh with {others} wedges, or hexahedra of second order");
            let allowed = "hexahedra of 8 nodes, tetrahedra of 4 or 10 (tetrahedra fill any shape: \
                           `cells` of a bar or brick, any mesher)";
            return Err(source.error("mechanics", found, allowed));
        }
        let share = |given: Option<Ratio>| given.map_or(0.0, |ratio| ratio.si());
        let law = spec.law.solve(source, share(material.crystallinity))?;
        let settings = StressSettings::new(mesh, law, bears, spec.bed.as_deref())
            .map_err(|error| located(source, "mechanics.bed", &error))?;
        let StressSettings { bears, bed, .. } = &settings;
        if bed.len() < 3 {
            let found = format!("{} nodes of the part on the bed", bed.len());
            let allowed = "at least 3: a surface of the part, or another material below it";
            return Err(source.error("mechanics.bed", found, allowed));
        }
        let loose = loose_elements(mesh, bears, bed);
        if loose > 0 {
            let found = format!("{loose} elements that nothing connects with the bed");
            let mut allowed = "a part that hangs together and touches the bed".to_owned();
            if let Some(path) = path {
                let names: Vec<&str> =
                    path.shares().iter().map(|share| share.0).filter(|name| !name.is_empty()).collect();
                allowed += "; `mesh.path.leave_out` takes skirts, brims and purge lines out of it";
                allowed += &format!(
                    " (the file names {})",
                    if names.is_empty() { "none".into() } else { names.join(", ") }
                );
            }
            return Err(source.error("mechanics.bed", found, allowed));
        }
        let places =
            |nodes: &[u32]| -> Vec<_> { nodes.iter().map(|&node| mesh.points[node as usize]).collect() };
        let shapes: HashSet<(usize, Vec<i64>)> =
            all().map(|nodes| (nodes.len(), key(&places(nodes)))).collect();
        let counts = [bears.iter().filter(|bears| **bears).count(), shapes.len()];
        // K̂ and gradients
        let matrices = shapes
            .iter()
            .map(|(nodes, _)| if *nodes == 8 { HEXAHEDRON } else { TETRAHEDRON[usize::from(*nodes > 4)] });
        let matrices = matrices.sum();
        let stiff = all().zip(bears).all(|(nodes, bears)| nodes.len() == 4 || !bears);
        let settings = StressSettings {
            initial_alpha: share(material.initial_alpha),
            strain_step,
            release: spec.release,
            ..settings
        };
        Ok(Some(Mechanics { settings, counts, matrices, stiff }))
    }
}
