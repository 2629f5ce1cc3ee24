//! Plane sections from mesh files.

use crate::error::Error;
use crate::mesh::PlaneSection;
use crate::mesh::abaqus::advice;
use meshfile::{ElementKind, MeshFile};
use std::collections::BTreeMap;
use std::path::Path;

/// A coordinate across the plane below this fraction of the others is rounding.
const FLAT: f64 = 1e-9;

impl PlaneSection {
    /// Reads a section from a mesh file of a format of [`meshfile::read`]: x is the radius, y becomes z,
    /// both multiplied by `scale` (1e-3 for a file in mm). Lines and sides of elements name edges. The second
    /// value holds notes for the user.
    ///
    /// # Errors
    /// [`Error::Mesh`] for solids, second-order elements, no plane elements, and nodes outside the plane
    /// z = 0; [`Error::Parameter`] for a scale that is not positive; errors of [`meshfile::read`].
    pub fn read(path: &Path, scale: f64) -> Result<(Self, Vec<String>), Error> {
        Self::convert(path, meshfile::read(path, advice)?, scale)
    }

    pub(super) fn convert(
        path: &Path,
        mut content: MeshFile,
        scale: f64,
    ) -> Result<(Self, Vec<String>), Error> {
        if !(scale > 0.0 && scale.is_finite()) {
            let allowed = "positive and finite, m per unit of the file".into();
            return Err(Error::Parameter { name: "scale of the mesh", found: scale, allowed });
        }
        let refused = |what: String| Err(Error::Mesh(format!("{}: {what}", path.display())));
        let second = [ElementKind::Quadrangle8, ElementKind::Triangle6];
        if let Some(element) = content.elements.iter().find(|element| element.kind.dimension() == 3) {
            return refused(format!(
                "element {} is a solid; allowed: triangles and quadrangles of a section, with x as radius \
                 and y as z (`mesh.file` takes solids)",
                element.label
            ));
        }
        if let Some(element) = content.elements.iter().find(|element| second.contains(&element.kind)) {
            return refused(format!(
                "element {} is of second order; allowed: triangles of 3 nodes and quadrangles of 4 \
                 (`mesh.order = 2` adds the nodes in the middle of edges)",
                element.label
            ));
        }
        let mut section = Self::default();
        // number in the section of each node and element of the file
        let mut node_of = vec![u32::MAX; content.nodes.len()];
        let mut element_of = vec![u32::MAX; content.elements.len()];
        for (place, element) in content.elements.iter().enumerate() {
            if element.kind.dimension() == 2 {
                element_of[place] = section.elements.len() as u32;
                section.labels.push(element.label);
                section.elements.push(content.nodes_of(element).to_vec());
            }
        }
        section.elements.iter().flatten().for_each(|&node| node_of[node as usize] = 0);
        let size = content.nodes.iter().flat_map(|node| node.point).fold(0.0, |most, x| x.abs().max(most));
        for (node, number) in content.nodes.iter().zip(&mut node_of).filter(|(_, number)| **number == 0) {
            let [x, y, z] = node.point;
            if z.abs() > FLAT * size {
                return refused(format!(
                    "node {} at ({x}, {y}, {z}); allowed: z = 0, a section with x as radius and y as z",
                    node.label
                ));
            }
            *number = section.points.len() as u32;
            section.points.push([scale * x, scale * y]);
        }
        section.elements.iter_mut().flatten().for_each(|node| *node = node_of[*node as usize]);
        section.name(&mut content, &node_of, &element_of);
        Ok((section, content.notes))
    }

    /// Adds the sets of a file.
    fn name(&mut self, content: &mut MeshFile, node_of: &[u32], element_of: &[u32]) {
        let known = |list: &[u32], members: &[u32]| -> Vec<u32> {
            let all = members.iter().map(|&member| list[member as usize]);
            all.filter(|&number| number != u32::MAX).collect()
        };
        for (name, set) in &content.node_sets {
            self.node_sets.insert(name.clone(), known(node_of, set));
        }
        let mut edges: BTreeMap<String, Vec<[u32; 2]>> = BTreeMap::new();
        for (name, places) in content.element_sets.iter().chain(&content.curve_sets) {
            self.element_sets.entry(name.clone()).or_default().extend(known(element_of, places));
            let lines = places.iter().map(|&place| &content.elements[place as usize]);
            let ends = lines.filter(|line| line.kind.dimension() == 1).map(|line| content.nodes_of(line));
            edges.entry(name.clone()).or_default().extend(ends.map(|nodes| [nodes[0], nodes[1]]));
        }
        for (name, faces) in &content.surfaces {
            let ends = faces.iter().map(|face| {
                let nodes = content.nodes_of(&content.elements[face.element as usize]);
                [0, 1].map(|k| nodes[(usize::from(face.side) + k) % nodes.len()])
            });
            edges.entry(name.clone()).or_default().extend(ends);
        }
        for (name, ends) in edges {
            let own: Vec<[u32; 2]> = ends
                .iter()
                .map(|ends| ends.map(|node| node_of[node as usize]))
                .filter(|ends| !ends.contains(&u32::MAX))
                .collect();
            self.edges.insert(name, own);
        }
        self.element_sets.retain(|_, set| !set.is_empty());
        self.node_sets.retain(|_, set| !set.is_empty());
        self.edges.retain(|_, ends| !ends.is_empty());
        for name in content.element_sets.keys().chain(content.node_sets.keys()).chain(content.surfaces.keys())
        {
            let kept = self.element_sets.contains_key(name)
                || self.node_sets.contains_key(name)
                || self.edges.contains_key(name);
            let note = format!("set `{name}` has nothing of the section: left out");
            if !kept && !content.notes.contains(&note) {
                content.notes.push(note);
            }
        }
    }
}
