//! Named sets of the mesh files of a body, which select particles.

use super::mesh_cells::CellMesh;
use super::region::layers;
use super::values::{ONE_OF_THEM, required};
use super::{Boundary, Scene, ShapeSpec};
use crate::bonds::Bonds;
use crate::geometry::{Enclosure, Facet, FacetSet};
use crate::surface::SurfaceFace;
use harness::scene::{SceneError, Source};
use polycore::numerics::DisjointSets;
use polycore::units::Length;
use std::collections::HashSet;
use std::path::Path;

/// Mesh files of a body that regions name.
pub struct MeshSets<const D: usize>(Vec<SetFile<D>>);

/// Mesh file with sets.
struct SetFile<const D: usize> {
    mesh: CellMesh<D>,
    /// True if particles fill its cells, false if it is only cut out.
    is_filled: bool,
}

impl<const D: usize> Default for MeshSets<D> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

/// Region of a set.
pub(super) enum SetRegion<const D: usize> {
    /// Inside of cells.
    Cells(Enclosure<D>),
    /// Particles below faces or around edges or a node.
    Below(Box<LayerBelow<D>>),
}

/// Particles within a distance of faces, edges or a node.
pub(super) struct LayerBelow<const D: usize> {
    faces: FacetSet<D>,
    /// Greatest distance, m.
    reach: f64,
    /// The pieces of the mesh that have them.
    pieces: Enclosure<D>,
    /// True if particles fill the mesh, false if it is only cut out.
    is_filled: bool,
}

impl<const D: usize> SetRegion<D> {
    /// Returns true if the region contains a point.
    pub fn contains(&self, place: [f64; D]) -> bool {
        match self {
            Self::Cells(body) => body.contains(place),
            Self::Below(layer) => {
                let LayerBelow { faces, reach, pieces, is_filled } = &**layer;
                // a set of one body takes no particles of another across a gap
                (!is_filled || pieces.contains(place)) && faces.covers(place, *reach, pieces.facets())
            }
        }
    }

    /// Returns true for a face of particles of this spacing, m, that stands for a facet of the set: from half
    /// a spacing in front of it, no other facet of the mesh is nearer. Faces of cells lie beside the facets
    /// of the mesh by up to a spacing.
    pub fn has_face(&self, face: &SurfaceFace<D>, spacing: f64) -> bool {
        let before = std::array::from_fn(|d| face.place[d] + 0.5 * spacing * face.normal[d]);
        match self {
            Self::Cells(_) => false,
            Self::Below(layer) => layer.faces.is_nearest(before, 2.0 * spacing, layer.pieces.facets()),
        }
    }
}

impl Scene {
    /// Returns true if a region is a set of a mesh file.
    fn names_sets(&self) -> bool {
        let boundaries = self.boundary.iter().chain(self.step.iter().flat_map(|step| &step.boundary));
        boundaries.filter_map(|boundary| boundary.set.as_ref()).next().is_some()
            || self.probe.iter().any(|probe| probe.set.is_some())
    }

    /// Lists the mesh files of the body, each once.
    fn mesh_files(&self) -> Vec<MeshEntry<'_>> {
        let mut files: Vec<MeshEntry> = Vec::new();
        for (index, shape) in self.body.shapes().iter().enumerate() {
            let keys = ["file", "unit"].map(|name| format!("body.shapes[{index}].{name}"));
            files.extend(shape.file.as_ref().map(|file| MeshEntry { file, unit: shape.unit, keys }));
        }
        let keys = ["body.points", "body.unit"].map(str::to_owned);
        files.extend(self.body.points.as_ref().map(|file| MeshEntry { file, unit: self.body.unit, keys }));
        let mut known: Vec<&Path> = Vec::new();
        files.retain(|entry| {
            let is_new = meshfile::is_mesh(entry.file) && !known.contains(&entry.file);
            known.push(entry.file);
            is_new
        });
        files
    }
}

/// Mesh file that a scene names, with the keys of its name and its unit.
struct MeshEntry<'a> {
    file: &'a Path,
    unit: Option<Length>,
    keys: [String; 2],
}

impl<const D: usize> MeshSets<D> {
    /// Reads the mesh files of a body, if a region of the scene names a set.
    ///
    /// # Errors
    /// Errors of [`CellMesh::read`].
    pub(super) fn of_scene(source: &Source, scene: &Scene) -> Result<Self, SceneError> {
        if !scene.names_sets() {
            return Ok(Self::default());
        }
        for (index, shape) in scene.body.shapes().iter().enumerate() {
            let differs = |other: &ShapeSpec| other.file == shape.file && other.unit != shape.unit;
            if shape.file.is_some() && scene.body.shapes()[..index].iter().any(differs) {
                let found = "a second unit of one file, whose sets a region names";
                return Err(source.error(
                    &format!("body.shapes[{index}].unit"),
                    found,
                    "one unit for a file",
                ));
            }
        }
        let read = |MeshEntry { file, unit, keys: [key, unit_key] }: MeshEntry| {
            let unit = required(source, &unit_key, unit, "the file has none, e.g. \"1 mm\"")?;
            let fills = |shape: &ShapeSpec| shape.add.is_some() && shape.file.as_deref() == Some(file);
            let is_filled =
                scene.body.shapes().iter().any(fills) || scene.body.points.as_deref() == Some(file);
            Ok(SetFile { mesh: CellMesh::read(source, &key, &unit_key, file, unit)?, is_filled })
        };
        scene.mesh_files().into_iter().map(read).collect::<Result<_, _>>().map(Self)
    }

    /// Finds the region of a set of a boundary: in its cells; of faces or nodes the particles within the
    /// depth of the boundary.
    ///
    /// # Errors
    /// A body without mesh files, an unknown set, a depth of cells, and a depth that is not positive.
    pub(super) fn find(
        &self,
        source: &Source,
        key: &str,
        name: &str,
        boundary: &Boundary,
        bonds: &dyn Bonds<D>,
    ) -> Result<SetRegion<D>, SceneError> {
        let set = format!("{key}.set");
        if self.0.is_empty() {
            let allowed = "a body with a mesh file, whose sets have names";
            return Err(source.error(&set, format!("`{name}` of a body without one"), allowed));
        }
        let own: Vec<&SetFile<D>> = self.0.iter().filter(|file| file.mesh.has_set(name)).collect();
        let SetFile { mesh, is_filled } = match own[..] {
            [file] => file,
            [] => {
                let mut names: Vec<&str> = self.0.iter().flat_map(|file| file.mesh.set_names()).collect();
                names.sort_unstable();
                names.dedup();
                if names.is_empty() {
                    let found = format!("`{name}` of a mesh without sets");
                    return Err(source.error(&set, found, "a mesh with named sets, or `side` and `shapes`"));
                }
                return Err(source.unknown(&set, name, &names));
            }
            [one, other, ..] => {
                let found = format!("`{name}`, which {} and {} have", one.mesh.path(), other.mesh.path());
                return Err(source.error(&set, found, "a name that one of the files has"));
            }
        };
        let places = mesh.content().element_sets.get(name).cloned().unwrap_or_default();
        let cells = mesh.cells_of(places);
        if !cells.is_empty() {
            if mesh.has_other_kind(name, &cells) {
                let found = format!("`{name}`, a set of cells and one of faces or nodes of {}", mesh.path());
                return Err(source.error(&set, found, "a name of one kind: rename one of them in the file"));
            }
            if let Some(depth) = boundary.depth_key() {
                return Err(source.unexpected(&format!("{key}.{depth}"), "cells have their own extent"));
            }
            let body = mesh.enclosure(&cells);
            let body =
                body.map_err(|error| source.error(&set, format!("{}: {error}", mesh.path()), "cells"))?;
            return Ok(SetRegion::Cells(body));
        }
        if boundary.depth.is_some() && boundary.layers.is_some() {
            return Err(source.conflict(&format!("{key}.depth"), "layers", ONE_OF_THEM));
        }
        let depth = boundary.depth.map(|depth| depth.si());
        let reach = depth.unwrap_or_else(|| layers(boundary, bonds) as f64 * bonds.spacing());
        if reach.is_nan() || reach <= 0.0 || boundary.layers == Some(0) {
            let depth = boundary.depth_key().unwrap_or("depth");
            return Err(source.error(&format!("{key}.{depth}"), format!("{reach} m"), "above 0"));
        }
        let wrong = |error: String| source.error(&set, format!("{}: {error}", mesh.path()), "cells");
        let pieces = mesh.enclosure(&mesh.pieces_at(name)).map_err(wrong)?;
        let faces = FacetSet::new(mesh.facets_of_set(name).map_err(|nodes| {
            let found = format!("`{name}` of {}, {nodes} nodes that no side of a cell joins", mesh.path());
            let allowed = "the nodes of whole faces or edges of cells, a single node, or a set of faces";
            source.error(&set, found, allowed)
        })?);
        // particles on the border belong to it
        let reach = reach * (1.0 + 1e-9);
        Ok(SetRegion::Below(Box::new(LayerBelow { faces, reach, pieces, is_filled: *is_filled })))
    }
}

impl<const D: usize> CellMesh<D> {
    /// Names of all sets with members in the dimension of the body or below.
    fn set_names(&self) -> Vec<&str> {
        let content = self.content();
        let elements = content.element_sets.keys().chain(content.curve_sets.keys());
        let names = elements.chain(content.surfaces.keys()).chain(content.node_sets.keys());
        names.map(String::as_str).filter(|name| self.has_set(name)).collect()
    }

    fn has_set(&self, name: &str) -> bool {
        let places = self.content().element_sets.get(name).cloned().unwrap_or_default();
        let nodes = self.content().node_sets.get(name);
        !self.cells_of(places).is_empty()
            || nodes.is_some_and(|nodes| !nodes.is_empty())
            || !self.faces_of_set(name).is_empty()
    }

    /// Encloses cells by their outer sides.
    fn enclosure(&self, cells: &[u32]) -> Result<Enclosure<D>, String> {
        let (facets, _) = self.boundary(cells)?;
        Enclosure::new(facets).map_err(|error| error.to_string())
    }

    /// Selects the cells that nodes join, over any number of cells, with a corner of a face or node of a set.
    fn pieces_at(&self, name: &str) -> Vec<u32> {
        let content = self.content();
        let nodes = |cell: u32| content.nodes_of(&content.elements[cell as usize]);
        let mut sets = DisjointSets::new(content.nodes.len());
        for &cell in self.cells() {
            for pair in nodes(cell).windows(2) {
                sets.join(pair[0], pair[1]);
            }
        }
        let bits = |point: [f64; D]| point.map(f64::to_bits);
        let own = content.node_sets.get(name).into_iter().flatten().map(|&node| bits(self.point(node)));
        let faces = self.faces_of_set(name);
        let corners = faces.iter().flatten().map(|corner| bits(*corner));
        let corners: HashSet<[u64; D]> = if faces.is_empty() { own.collect() } else { corners.collect() };
        let at = (0..content.nodes.len() as u32).filter(|&node| corners.contains(&bits(self.point(node))));
        let roots: HashSet<u32> = at.map(|node| sets.root(node)).collect();
        let joined = |cell: &u32| nodes(*cell).first().is_some_and(|&node| roots.contains(&sets.root(node)));
        self.cells().iter().copied().filter(joined).collect()
    }

    /// Returns true if a set of cells is one of faces, too, or one of other nodes than theirs.
    fn has_other_kind(&self, name: &str, cells: &[u32]) -> bool {
        let content = self.content();
        let own: HashSet<u32> = cells
            .iter()
            .flat_map(|&cell| content.nodes_of(&content.elements[cell as usize]).iter().copied())
            .collect();
        let nodes = content.node_sets.get(name).map(|nodes| nodes.iter().copied().collect::<HashSet<u32>>());
        !self.faces_of_set(name).is_empty() || nodes.is_some_and(|nodes| nodes != own)
    }

    /// Returns the facets of the faces of a set (in 2D edges); without any those that its nodes span.
    ///
    /// # Errors
    /// The number of nodes that are on no face or edge of it.
    fn facets_of_set(&self, name: &str) -> Result<Vec<Facet<D>>, usize> {
        let faces = self.faces_of_set(name);
        if !faces.is_empty() {
            return Ok(faces);
        }
        self.facets_of_nodes(self.content().node_sets.get(name).map_or(&[], Vec::as_slice))
    }

    /// Facets of the faces of a set (in 2D edges).
    fn faces_of_set(&self, name: &str) -> Vec<Facet<D>> {
        let content = self.content();
        let dimension = |place: u32| content.elements[place as usize].kind.dimension();
        let lists = [content.element_sets.get(name), content.curve_sets.get(name)];
        let places = lists.into_iter().flatten().flatten();
        let sides = places.filter(|place| dimension(**place) + 1 == D);
        let mut facets: Vec<Facet<D>> = sides.flat_map(|&place| self.facets_of_side(place)).collect();
        let faces = content.surfaces.get(name).into_iter().flatten();
        let faces = faces.filter(|face| dimension(face.element) == D);
        facets.extend(faces.flat_map(|face| self.facets_of_face(face.element, face.side)));
        facets
    }
}
