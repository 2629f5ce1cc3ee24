//! Problem definition: mesh, materials, conditions, and times at which elements appear.

use crate::boundary::{Condition, FaceSelection, Field, HeatSource};
use crate::error::Error;
use crate::material::ThermalMaterial;
use crate::mesh::{Face, Mesh};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Representation of the heat capacity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Capacity {
    /// Lumped at the nodes, as are film, radiation and the state of materials with constant conductivity.
    /// Temperatures do not overshoot at births.
    #[default]
    Lumped,
    /// Consistent with the shape functions; everything at Gauss points.
    Consistent,
}

/// Elements that appear at the same time.
#[derive(Clone, Debug, PartialEq)]
pub struct Birth {
    /// Time, s.
    pub time: f64,
    /// Elements. An element without birth exists from the start, unless it is absent.
    pub elements: Vec<u32>,
    /// Temperature at birth, K.
    pub temperature: f64,
}

/// A problem of heat conduction, Eqs (4.14)–(4.17).
#[derive(Clone)]
pub struct Problem {
    /// Mesh with all elements that ever exist.
    pub mesh: Mesh,
    /// Materials.
    pub materials: Vec<Arc<dyn ThermalMaterial>>,
    /// Material of each element, as an index into `materials`.
    pub material_of: Vec<u16>,
    /// Initial temperature of the existing elements, K.
    pub initial: Field,
    /// Conditions on nodes and faces.
    pub conditions: Vec<Condition>,
    /// Heat sources in elements.
    pub sources: Vec<HeatSource>,
    /// Births, in the order of time.
    pub births: Vec<Birth>,
    /// Elements that never appear.
    pub absent: Vec<u32>,
    /// Lumped or consistent capacity.
    pub capacity: Capacity,
}

impl Problem {
    /// Names of the output quantities of all materials, without duplicates, in the order of the materials.
    pub fn field_names(&self) -> Vec<&'static str> {
        let mut names = Vec::new();
        for name in self.materials.iter().flat_map(|material| material.field_names()) {
            if !names.contains(name) {
                names.push(*name);
            }
        }
        names
    }

    /// Returns a problem of one material and one initial temperature, without conditions.
    pub fn new(mesh: Mesh, material: Arc<dyn ThermalMaterial>, temperature: f64) -> Self {
        let elements = mesh.element_count();
        Self {
            mesh,
            materials: vec![material],
            material_of: vec![0; elements],
            initial: Field::constant(temperature),
            conditions: Vec::new(),
            sources: Vec::new(),
            births: Vec::new(),
            absent: Vec::new(),
            capacity: Capacity::Lumped,
        }
    }

    /// Times of births and of changes of slope, sorted.
    pub(crate) fn breaks(&self) -> Vec<f64> {
        let mut times: Vec<f64> = self.conditions.iter().flat_map(Condition::breaks).collect();
        times.extend(self.sources.iter().flat_map(|s| s.power.breaks().iter().copied()));
        times.extend(self.births.iter().map(|birth| birth.time));
        times.sort_unstable_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// Shortest period of the conditions, s; steps must be shorter.
    pub fn shortest_period(&self) -> Option<f64> {
        let conditions = self.conditions.iter().filter_map(Condition::period);
        conditions.chain(self.sources.iter().filter_map(|s| s.power.period())).min_by(f64::total_cmp)
    }

    /// Checks the problem, as far as possible before a run.
    ///
    /// # Errors
    /// [`Error::Mesh`] for elements, nodes, faces or materials that do not exist and for inverted elements;
    /// [`Error::Parameter`] for values out of their domain.
    pub fn check(&self) -> Result<(), Error> {
        let count = self.mesh.element_count();
        let points = self.mesh.points.len();
        let mesh_error = |text: String| Err(Error::Mesh(text));
        if count == 0 {
            return mesh_error("found no element; allowed: at least one".into());
        }
        if count >= (1 << 28) || points >= (1 << 31) {
            return mesh_error(format!("found {count} elements, {points} nodes; allowed: below 2²⁸ and 2³¹"));
        }
        if self.material_of.len() != count {
            return mesh_error(format!(
                "found materials for {} elements; allowed: one for each of the {count}",
                self.material_of.len()
            ));
        }
        for element in 0..count as u32 {
            let material = usize::from(self.material_of[element as usize]);
            if material >= self.materials.len() {
                return mesh_error(format!(
                    "element {element}: found material {material}; allowed: below {}",
                    self.materials.len()
                ));
            }
            if let Some(node) = self.mesh.nodes(element).iter().find(|&&n| n as usize >= points) {
                return mesh_error(format!("element {element}: found node {node}; allowed: below {points}"));
            }
            if self.mesh.node_volumes(element).is_none() {
                let first =
                    self.mesh.nodes(element).first().map_or([0.0; 3], |&n| self.mesh.points[n as usize]);
                return mesh_error(format!(
                    "element {element}, first node at {first:?} m: inverted, flat or folded; \
                     allowed: a positive Jacobian at each Gauss point"
                ));
            }
        }
        if self.mesh.is_second_order() && (self.capacity == Capacity::Lumped || !self.births.is_empty()) {
            return mesh_error(
                "found second-order elements with lumped capacity or births; allowed: `consistent` capacity \
                 and no births (their row sums are negative at corners); print first-order elements"
                    .into(),
            );
        }
        for material in &self.materials {
            let density = material.density();
            if !(density > 0.0 && density.is_finite()) {
                return Err(Error::Parameter {
                    name: "density",
                    found: density,
                    allowed: "above 0 kg/m³, finite".into(),
                });
            }
        }
        self.check_actions(count, points)?;
        self.check_births(count)
    }

    fn check_actions(&self, count: usize, points: usize) -> Result<(), Error> {
        for condition in &self.conditions {
            condition.check()?;
            if let Condition::Temperature { nodes, .. } = condition
                && let Some(node) = nodes.iter().find(|&&node| node as usize >= points)
            {
                return Err(Error::Mesh(format!(
                    "prescribed temperature: found node {node}; allowed: below {points}"
                )));
            }
            let faces: &[Face] = match condition.surface() {
                Some(FaceSelection::Faces(faces)) => faces,
                Some(FaceSelection::Outer { except }) => except,
                None => &[],
            };
            if let Some(face) = faces.iter().find(|&&face| self.mesh.face_nodes(face).is_empty()) {
                return Err(Error::Mesh(format!(
                    "surface: found side {} of element {}; allowed: a side of one of the {count} elements",
                    face.side, face.element
                )));
            }
        }
        for source in &self.sources {
            source.check()?;
            if let Some(element) = source.elements.iter().find(|&&element| element as usize >= count) {
                return Err(Error::Mesh(format!(
                    "heat source: found element {element}; allowed: below {count}"
                )));
            }
        }
        Ok(())
    }

    fn check_births(&self, count: usize) -> Result<(), Error> {
        let linear = self.materials.iter().all(|material| material.is_linear());
        if self.capacity == Capacity::Consistent && !self.births.is_empty() && !linear {
            return Err(Error::Parameter {
                name: "births with consistent capacity",
                found: self.births.len() as f64,
                allowed:
                    "none where a material's energy or conductivity is not linear; lumped capacity conserves \
                          their energy"
                        .into(),
            });
        }
        let mut born = vec![false; count];
        for &element in &self.absent {
            match born.get_mut(element as usize) {
                Some(born) => *born = true,
                None => {
                    return Err(Error::Mesh(format!("absent element {element}; allowed: below {count}")));
                }
            }
        }
        let mut last = 0.0;
        for birth in &self.births {
            if !(birth.time >= last && birth.time.is_finite()) {
                return Err(Error::Parameter {
                    name: "birth time",
                    found: birth.time,
                    allowed: format!("{last} s (the previous birth) or later, finite"),
                });
            }
            last = birth.time;
            if !(birth.temperature >= 0.0 && birth.temperature.is_finite()) {
                return Err(Error::Parameter {
                    name: "deposition temperature",
                    found: birth.temperature,
                    allowed: "an absolute temperature, 0 K or above".into(),
                });
            }
            for &element in &birth.elements {
                match born.get_mut(element as usize) {
                    Some(born) if !*born => *born = true,
                    Some(_) => {
                        return Err(Error::Mesh(format!(
                            "birth at {} s: element {element} is born twice, or absent; allowed: once",
                            birth.time
                        )));
                    }
                    None => {
                        return Err(Error::Mesh(format!(
                            "birth at {} s: found element {element}; allowed: below {count}",
                            birth.time
                        )));
                    }
                }
            }
        }
        Ok(())
    }
}

/// Temperature at the nodes, K, from that of each element; a node takes that of its last element that is not
/// among those printed `later`.
pub fn initial_temperatures(mesh: &Mesh, temperature_of: &[f64], later: &HashSet<u32>) -> Field {
    let first = temperature_of.first().copied().unwrap_or(0.0);
    if temperature_of.iter().all(|&temperature| temperature == first) {
        return Field::constant(first);
    }
    // by position, as a problem takes a field; node positions are exact keys
    let mut at = HashMap::new();
    for (element, &temperature) in temperature_of.iter().enumerate() {
        if later.contains(&(element as u32)) {
            continue;
        }
        for &node in mesh.nodes(element as u32) {
            at.insert(mesh.points[node as usize].map(f64::to_bits), temperature);
        }
    }
    Field::function(move |place, _| at.get(&place.map(f64::to_bits)).copied().unwrap_or(first))
}
