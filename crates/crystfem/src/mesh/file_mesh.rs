//! Converts labelled nodes and elements of a file to a [`Mesh`].

use std::collections::BTreeMap;
use std::path::Path;

use meshfile::MeshFile;

use crate::error::Error;
use crate::mesh::quality::{self, Quality};
use crate::mesh::{Cell, ElementShape, Face, Mesh};

/// A checked mesh from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadMesh {
    /// Mesh with nodes and elements in the order of the file, 8-node hexahedra before 4-node tetrahedra
    /// before others, without unused nodes.
    pub mesh: Mesh,
    /// Label of each node in the file.
    pub node_labels: Vec<u64>,
    /// Label of each element in the file.
    pub element_labels: Vec<u64>,
    /// Result of [`quality::check`].
    pub quality: Quality,
    /// Notes for the user: omissions and doubtful input.
    pub notes: Vec<String>,
}

/// Converts the content of a file to a mesh, with coordinates multiplied by `scale`.
///
/// # Errors
/// [`Error::Parameter`] for a scale that is not positive, and errors of [`quality::check`].
pub(super) fn convert(path: &Path, mut content: MeshFile, scale: f64) -> Result<ReadMesh, Error> {
    if !(scale > 0.0 && scale.is_finite()) {
        let allowed = "positive and finite, m per unit of the file".into();
        return Err(Error::Parameter { name: "scale of the mesh", found: scale, allowed });
    }
    let mut mesh = Mesh::default();
    mesh.points.extend(content.nodes.iter().map(|node| node.point.map(|x| scale * x)));
    mesh.node_sets = std::mem::take(&mut content.node_sets);
    // hexahedra, tetrahedra and others
    let mut labels = [const { Vec::new() }; 3];
    // index in the mesh, first within each of the three
    let mut number = vec![u32::MAX; content.elements.len()];
    let mut facets: Vec<([u32; 4], u32)> = Vec::new();
    let list = |shape| match shape {
        ElementShape::Hexahedron => 0,
        ElementShape::Tetrahedron => 1,
        _ => 2,
    };
    for (place, element) in content.elements.iter().enumerate() {
        let mut own = [u32::MAX; 20];
        let nodes = content.nodes_of(element);
        own[..nodes.len()].copy_from_slice(nodes);
        if let Some(shape) = element.kind.solid() {
            let labels = &mut labels[list(shape)];
            number[place] = labels.len() as u32;
            labels.push(element.label);
            match shape {
                ElementShape::Hexahedron => mesh.hexahedra.extend(own.first_chunk::<8>()),
                ElementShape::Tetrahedron => mesh.tetrahedra.extend(own.first_chunk::<4>()),
                _ => mesh.others.extend(Cell::new(&own[..shape.nodes()])),
            }
        } else if let Some(corners) = element.kind.facet() {
            let mut key = [u32::MAX; 4];
            key[..corners].copy_from_slice(&own[..corners]);
            key.sort_unstable();
            facets.push((key, place as u32));
        }
    }
    let starts = [0, labels[0].len(), labels[0].len() + labels[1].len()];
    for (number, element) in number.iter_mut().zip(&content.elements) {
        *number += element.kind.solid().map_or(0, |shape| starts[list(shape)] as u32);
    }
    let element_labels = labels.concat();
    let face_of = match_facets(&mut content, &mesh, facets);
    name_sets(&mut content, &mut mesh, &number, &face_of);
    let kept = quality::drop_unused_nodes(&mut mesh);
    if kept.len() < content.nodes.len() {
        let unused = content.nodes.len() - kept.len();
        content
            .notes
            .push(format!("{unused} nodes that belong to no hexahedron, tetrahedron or wedge are left out"));
    }
    let notes = &mut content.notes;
    mesh.node_sets.retain(|name, set| {
        if set.is_empty() {
            notes.push(format!("node set `{name}` contains no node of the mesh: left out"));
        }
        !set.is_empty()
    });
    let quality = quality::check(&mesh, Some(&element_labels)).map_err(|error| match error {
        Error::Mesh(text) => Error::Mesh(format!("{}: {text}", path.display())),
        other => other,
    })?;
    content.notes.extend(quality.notes.iter().cloned());
    let node_labels = kept.iter().map(|node| content.nodes[*node as usize].label).collect();
    Ok(ReadMesh { mesh, node_labels, element_labels, quality, notes: content.notes })
}

/// Finds the face of a solid element for each triangle and quadrangle; the first of two.
fn match_facets(
    content: &mut MeshFile,
    mesh: &Mesh,
    mut facets: Vec<([u32; 4], u32)>,
) -> BTreeMap<u32, Face> {
    facets.sort_unstable();
    let mut face_of = BTreeMap::new();
    if facets.is_empty() {
        return face_of;
    }
    for element in 0..mesh.element_count() as u32 {
        for side in 0..mesh.side_count(element) {
            let face = Face { element, side };
            let key = mesh.face_nodes(face).key();
            let first = facets.partition_point(|facet| facet.0 < key);
            for facet in facets[first..].iter().take_while(|facet| facet.0 == key) {
                face_of.entry(facet.1).or_insert(face);
            }
        }
    }
    if face_of.len() < facets.len() {
        let missed = facets.len() - face_of.len();
        let first = facets.iter().find(|facet| !face_of.contains_key(&facet.1));
        let label = first.map_or(0, |facet| content.elements[facet.1 as usize].label);
        content.notes.push(format!(
            "{missed} triangles or quadrangles are not sides of a hexahedron, tetrahedron or wedge, \
             element {label} first: left out"
        ));
    }
    face_of
}

/// Converts element sets and surfaces to the mesh's indices.
fn name_sets(content: &mut MeshFile, mesh: &mut Mesh, number: &[u32], face_of: &BTreeMap<u32, Face>) {
    mesh.surfaces = std::mem::take(&mut content.surfaces);
    for faces in mesh.surfaces.values_mut() {
        // edges of plane elements are no faces of solids
        faces.retain(|face| number[face.element as usize] != u32::MAX);
        faces.iter_mut().for_each(|face| face.element = number[face.element as usize]);
    }
    for (name, places) in std::mem::take(&mut content.element_sets) {
        let mut set: Vec<u32> =
            places.iter().map(|place| number[*place as usize]).filter(|n| *n != u32::MAX).collect();
        let faces: Vec<Face> = places.iter().filter_map(|place| face_of.get(place).copied()).collect();
        if set.is_empty() && faces.is_empty() {
            content.notes.push(format!(
                "element set `{name}` contains no hexahedra, tetrahedra, wedges or sides of them: left \
                 out"
            ));
        }
        if !faces.is_empty() {
            mesh.surfaces.entry(name.clone()).or_default().extend(faces);
        }
        if !set.is_empty() {
            set.sort_unstable();
            set.dedup();
            mesh.element_sets.insert(name, set);
        }
    }
    for (name, faces) in &mut mesh.surfaces {
        faces.sort_unstable();
        faces.dedup();
        if faces.is_empty() {
            content.notes.push(format!("surface `{name}` contains no face: left out"));
        }
    }
    mesh.surfaces.retain(|_, faces| !faces.is_empty());
    for set in mesh.node_sets.values_mut() {
        set.sort_unstable();
        set.dedup();
    }
}
