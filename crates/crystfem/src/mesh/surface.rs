//! Element adjacency and outer surface of active elements.

use crate::element::FaceGeometry;
use crate::error::Error;
use crate::mesh::{BOX_SIDES, Face, Mesh};

/// No neighbour.
const NONE: u32 = u32::MAX;

/// Outer surface of the active elements: faces with exactly one active element. Neighbours are found once;
/// each activation updates only the faces of the new elements.
#[derive(Clone, Debug)]
pub struct OuterSurface {
    /// Number of hexahedra.
    hexahedra: usize,
    /// Number of elements.
    elements: usize,
    /// First face of each of the other elements, and the end of the last one's.
    firsts: Vec<u32>,
    /// Opposite face of each face, or [`NONE`]; faces are numbered 6·element + side, then 4·… for tetrahedra,
    /// then those of the others.
    opposite: Vec<u32>,
    active: Vec<bool>,
    outer: Vec<bool>,
}

/// Change of the outer surface by an activation; faces sorted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceChange {
    /// Faces that became outer faces.
    pub appeared: Vec<Face>,
    /// Faces that are no longer outer faces.
    pub vanished: Vec<Face>,
}

/// A set of faces that may become outer faces; see [`OuterSurface::region`].
#[derive(Clone, Debug, PartialEq)]
pub struct FaceRegion {
    /// Face numbers, sorted.
    faces: Vec<u32>,
}

impl OuterSurface {
    /// Finds the neighbours in a mesh; no element is active.
    ///
    /// # Errors
    /// [`Error::Mesh`] for a node out of range, a face of three elements (named), and two elements with the
    /// same corners of a face and different mid-edge nodes; [`Error::Parameter`] for more than 2³² − 1 faces.
    pub fn new(mesh: &Mesh) -> Result<Self, Error> {
        let (hexahedra, elements) = (mesh.hexahedra.len(), mesh.element_count());
        let mut count = 6 * hexahedra + 4 * mesh.tetrahedra.len();
        let mut firsts = Vec::new();
        for cell in &mesh.others {
            firsts.push(count as u32);
            count += usize::from(cell.shape.side_count());
        }
        if count >= NONE as usize {
            let allowed = format!("below {NONE}");
            return Err(Error::Parameter { name: "faces of a mesh", found: count as f64, allowed });
        }
        let mut surface = Self {
            hexahedra,
            elements,
            firsts,
            opposite: Vec::new(),
            active: vec![false; elements],
            outer: vec![false; count],
        };
        surface.opposite = surface.neighbours(mesh)?;
        Ok(surface)
    }

    /// Returns the outer surface of the whole mesh.
    ///
    /// # Errors
    /// Errors of [`Self::new`].
    pub fn of_all(mesh: &Mesh) -> Result<Self, Error> {
        let mut surface = Self::new(mesh)?;
        surface.active.fill(true);
        for (outer, opposite) in surface.outer.iter_mut().zip(&surface.opposite) {
            *outer = *opposite == NONE;
        }
        Ok(surface)
    }

    /// Activates elements; active ones are skipped.
    ///
    /// # Errors
    /// [`Error::Parameter`] for an element out of range, without any change.
    pub fn activate(&mut self, elements: &[u32]) -> Result<SurfaceChange, Error> {
        if let Some(element) = elements.iter().find(|element| **element as usize >= self.elements) {
            let allowed = format!("below {}", self.elements);
            return Err(Error::Parameter { name: "element", found: f64::from(*element), allowed });
        }
        let mut fresh: Vec<u32> =
            elements.iter().copied().filter(|element| !self.active[*element as usize]).collect();
        fresh.sort_unstable();
        fresh.dedup();
        for element in &fresh {
            self.active[*element as usize] = true;
        }
        let mut change = SurfaceChange::default();
        for element in fresh {
            for number in self.faces_of(element) {
                let opposite = self.opposite[number];
                if opposite == NONE || !self.active[self.face(opposite).element as usize] {
                    self.outer[number] = true;
                    change.appeared.push(self.face(number as u32));
                } else if std::mem::take(&mut self.outer[opposite as usize]) {
                    change.vanished.push(self.face(opposite));
                }
            }
        }
        change.vanished.sort_unstable();
        Ok(change)
    }

    /// Faces of the outer surface, in ascending order.
    pub fn faces(&self) -> impl Iterator<Item = Face> + '_ {
        (0..self.outer.len() as u32)
            .filter(|number| self.outer[*number as usize])
            .map(|number| self.face(number))
    }

    /// Active elements.
    pub fn active(&self) -> &[bool] {
        &self.active
    }

    /// Returns true if a face belongs to the outer surface.
    pub fn is_outer(&self, face: Face) -> bool {
        self.number(face).is_some_and(|number| self.outer[number as usize])
    }

    /// Returns the same face as a face of the other element.
    pub fn opposite(&self, face: Face) -> Option<Face> {
        let opposite = self.opposite[self.number(face)? as usize];
        (opposite != NONE).then(|| self.face(opposite))
    }

    /// Finds the region of a boundary condition: `outer` (everywhere), a named surface (given from either
    /// side), the surface of a named element set, the faces with all nodes in a named node set, or a side of
    /// the bounding box ([`BOX_SIDES`]: faces within 1e-9 of its diagonal). Names of the mesh take
    /// precedence.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another name, and [`Error::Mesh`] for a named surface with a face that does not
    /// exist.
    pub fn region(&self, mesh: &Mesh, name: &str) -> Result<FaceRegion, Error> {
        let mut faces = Vec::new();
        if let Some(named) = mesh.surfaces.get(name) {
            for face in named {
                let Some(number) = self.number(*face) else {
                    return Err(Error::Mesh(format!(
                        "surface `{name}`: element {} has no side {}",
                        face.element, face.side
                    )));
                };
                let opposite = self.opposite[number as usize];
                faces.extend([number, opposite].iter().filter(|number| **number != NONE));
            }
        } else if let Some(set) = mesh.element_sets.get(name) {
            let elements = set.iter().filter(|element| (**element as usize) < self.elements);
            faces.extend(elements.flat_map(|element| self.faces_of(*element)).map(|number| number as u32));
        } else if let Some(set) = mesh.node_sets.get(name) {
            let within = |number: &u32| {
                mesh.face_nodes(self.face(*number)).iter().all(|node| set.binary_search(node).is_ok())
            };
            faces.extend((0..self.outer.len() as u32).filter(within));
            if faces.is_empty() {
                let count = set.len();
                return Err(Error::Mesh(format!(
                    "node set `{name}` ({count} nodes) has all nodes of no face; allowed: one that has, or \
                     a temperature, which acts on nodes"
                )));
            }
        } else if name == "outer" {
            faces.extend(0..self.outer.len() as u32);
        } else if let Some(side) = BOX_SIDES.iter().position(|side| *side == name) {
            let d = side / 2;
            let [lower, upper] = mesh.bounds().unwrap_or_default();
            let near = 1e-9 * (0..3).map(|d| (upper[d] - lower[d]).powi(2)).sum::<f64>().sqrt();
            let plane = if side % 2 == 0 { lower[d] } else { upper[d] };
            faces.extend((0..self.outer.len() as u32).filter(|number| {
                let nodes = mesh.face_nodes(self.face(*number));
                nodes.iter().all(|node| (mesh.points[*node as usize][d] - plane).abs() <= near)
            }));
        } else {
            let mut known: Vec<String> =
                mesh.surfaces.keys().chain(mesh.element_sets.keys()).cloned().collect();
            for own in ["outer"].into_iter().chain(BOX_SIDES) {
                if !known.iter().any(|name| name == own) {
                    known.push(own.to_owned());
                }
            }
            let sets = mesh.node_sets.keys().filter(|name| !known.contains(name)).cloned();
            let known = [&known[..], &sets.collect::<Vec<_>>()].concat();
            return Err(Error::Unknown { what: "surface", name: name.to_owned(), known });
        }
        faces.sort_unstable();
        faces.dedup();
        Ok(FaceRegion { faces })
    }

    /// Outer faces in a region, ascending.
    pub fn faces_in(&self, region: &FaceRegion) -> Vec<Face> {
        let outer = |number: &&u32| self.outer.get(**number as usize) == Some(&true);
        region.faces.iter().filter(outer).map(|number| self.face(*number)).collect()
    }

    /// All faces of a region, outer or not, ascending.
    pub fn all_in(&self, region: &FaceRegion) -> Vec<Face> {
        region.faces.iter().map(|number| self.face(*number)).collect()
    }

    fn number(&self, face: Face) -> Option<u32> {
        ((face.element as usize) < self.elements
            && usize::from(face.side) < self.faces_of(face.element).len())
        .then(|| self.faces_of(face.element).start as u32 + u32::from(face.side))
    }

    fn face(&self, number: u32) -> Face {
        if self.firsts.first().is_some_and(|&first| number >= first) {
            let other = self.firsts.partition_point(|&first| first <= number) - 1;
            let element = self.elements - self.firsts.len() + other;
            return Face { element: element as u32, side: (number - self.firsts[other]) as u8 };
        }
        let (number, first) = (number as usize, 6 * self.hexahedra);
        if number < first {
            Face { element: (number / 6) as u32, side: (number % 6) as u8 }
        } else {
            let rest = number - first;
            Face { element: (self.hexahedra + rest / 4) as u32, side: (rest % 4) as u8 }
        }
    }

    fn faces_of(&self, element: u32) -> std::ops::Range<usize> {
        let element = element as usize;
        if element < self.hexahedra {
            6 * element..6 * element + 6
        } else if let Some(other) = element.checked_sub(self.elements - self.firsts.len()) {
            let end = self.firsts.get(other + 1).map_or(self.outer.len(), |&next| next as usize);
            self.firsts[other] as usize..end
        } else {
            let first = 6 * self.hexahedra + 4 * (element - self.hexahedra);
            first..first + 4
        }
    }

    /// Sorts faces into buckets by their smallest node and pairs those with equal nodes: linear in the mesh,
    /// and independent of any order.
    fn neighbours(&self, mesh: &Mesh) -> Result<Vec<u32>, Error> {
        let key = |number: u32| mesh.face_nodes(self.face(number)).key();
        let all = |number: u32| {
            let mut nodes = mesh.face_nodes(self.face(number)).to_vec();
            nodes.sort_unstable();
            nodes
        };
        let count = self.outer.len() as u32;
        // starts of the buckets, shifted by one so that filling them leaves their ends
        let mut start = vec![0u32; mesh.points.len() + 2];
        for number in 0..count {
            let node = key(number)[0] as usize;
            if node >= mesh.points.len() {
                return Err(Error::Mesh(format!(
                    "element {}: node {node}; allowed: below {}",
                    self.face(number).element,
                    mesh.points.len()
                )));
            }
            start[node + 2] += 1;
        }
        for node in 2..start.len() {
            start[node] += start[node - 1];
        }
        let mut sorted = vec![0u32; count as usize];
        for number in 0..count {
            let place = &mut start[key(number)[0] as usize + 1];
            sorted[*place as usize] = number;
            *place += 1;
        }
        let mut bucket: Vec<([u32; 4], u32)> = Vec::new();
        let mut opposite = vec![NONE; count as usize];
        for node in 0..mesh.points.len() {
            let numbers = &sorted[start[node] as usize..start[node + 1] as usize];
            bucket.clear();
            bucket.extend(numbers.iter().map(|number| (key(*number), *number)));
            bucket.sort_unstable();
            for same in bucket.chunk_by(|a, b| a.0 == b.0) {
                match same {
                    [_] => {}
                    [a, b] if !self.firsts.is_empty() && all(a.1) != all(b.1) => {
                        let [a, b] = [a.1, b.1].map(|number| self.face(number).element);
                        return Err(Error::Mesh(format!(
                            "elements {a} and {b} have the corners of one face and different nodes on its \
                             edges; allowed: elements of one order side by side, with the same nodes"
                        )));
                    }
                    [a, b] => {
                        opposite[a.1 as usize] = b.1;
                        opposite[b.1 as usize] = a.1;
                    }
                    _ => {
                        let elements: Vec<_> =
                            same.iter().map(|face| self.face(face.1).element.to_string()).collect();
                        return Err(Error::Mesh(format!(
                            "elements {} share one face; allowed: 2 elements a face",
                            elements.join(", ")
                        )));
                    }
                }
            }
        }
        Ok(opposite)
    }
}

/// Area of a face, m²: exact for plane faces, by Gauss points for warped and curved ones.
pub fn area(mesh: &Mesh, face: Face) -> f64 {
    let nodes = mesh.face_nodes(face);
    match nodes[..] {
        [a, b, c] => {
            let corner = mesh.point(a);
            0.5 * (mesh.point(b) - corner).cross(&(mesh.point(c) - corner)).norm()
        }
        [a, b, c, d] => {
            let [a, b, c, d] = [a, b, c, d].map(|node| mesh.point(node));
            let point = 1.0 / 3f64.sqrt();
            let jacobian = |s: f64, t: f64| {
                let along = 0.25 * ((1.0 - t) * (b - a) + (1.0 + t) * (c - d));
                let across = 0.25 * ((1.0 - s) * (d - a) + (1.0 + s) * (c - b));
                along.cross(&across).norm()
            };
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .iter()
                .map(|(s, t)| jacobian(s * point, t * point))
                .sum()
        }
        _ => {
            let places: Vec<[f64; 3]> = nodes.iter().map(|&node| mesh.points[node as usize]).collect();
            FaceGeometry::<8, 9>::new(&places).weights.iter().sum()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Bar, Block, CellSplit, Grid, Substrate};

    fn total(mesh: &Mesh, faces: impl IntoIterator<Item = Face>) -> f64 {
        faces.into_iter().map(|face| area(mesh, face)).sum()
    }

    #[test]
    fn the_surface_follows_the_layers() {
        let substrate = Substrate { size: [0.03, 0.01], thickness: 2e-3, growth: 1.5 };
        let mesh = Bar {
            size: [0.02, 0.004],
            layers: 4,
            layer_height: 2e-4,
            elements_per_layer: 2,
            element_size: 1e-3,
            substrate: Some(substrate),
            cells: CellSplit::Hexahedra,
        }
        .mesh()
        .unwrap();
        let mut surface = OuterSurface::new(&mesh).unwrap();
        assert_eq!(surface.faces().count(), 0);
        surface.activate(&mesh.element_sets["substrate"]).unwrap();
        let glass = 2.0 * (0.03 * 0.01 + 0.04 * 2e-3);
        assert!((total(&mesh, surface.faces()) / glass - 1.0).abs() < 1e-12);
        for layer in 1..=4 {
            let change = surface.activate(&mesh.element_sets[&format!("layer-{layer}")]).unwrap();
            // the new layer covers as much as its own top exposes; its sides are added
            assert_eq!(change.vanished.len(), 20 * 4);
            assert_eq!(change.appeared.len(), 20 * 4 + 2 * 2 * (20 + 4));
            let exact = glass + 2.0 * 0.024 * 2e-4 * f64::from(layer);
            assert!((total(&mesh, surface.faces()) / exact - 1.0).abs() < 1e-12);
            assert!(change.vanished.iter().all(|face| !surface.is_outer(*face)));
        }
        // one by one or at once: the same surface
        let whole: Vec<Face> = OuterSurface::of_all(&mesh).unwrap().faces().collect();
        assert_eq!(surface.faces().collect::<Vec<_>>(), whole);
        let mut backwards = OuterSurface::new(&mesh).unwrap();
        for element in (0..mesh.element_count() as u32).rev() {
            backwards.activate(&[element, element]).unwrap();
        }
        assert_eq!(backwards.faces().collect::<Vec<_>>(), whole);
        assert_eq!(backwards.activate(&[0]).unwrap(), SurfaceChange::default());
        assert!(backwards.activate(&[u32::MAX]).is_err());
    }

    #[test]
    fn regions_are_found_by_name() {
        let grid = Grid::uniform([0.0; 3], [1.0, 1.0, 2.0], [2, 2, 4]).unwrap();
        let block =
            |name: &str, z0, z1| Block { name: name.into(), lower: [0.0, 0.0, z0], upper: [1.0, 1.0, z1] };
        let mut mesh =
            grid.blocks(&[block("lower", 0.0, 1.0), block("upper", 1.0, 2.0)], CellSplit::Hexahedra).unwrap();
        // the interface, given from above
        let above = mesh.element_sets["upper"][..4].iter().map(|element| Face { element: *element, side: 0 });
        mesh.surfaces.insert("interface".into(), above.collect());
        let mut surface = OuterSurface::new(&mesh).unwrap();
        surface.activate(&mesh.element_sets["lower"]).unwrap();
        let interface = surface.region(&mesh, "interface").unwrap();
        let faces = surface.faces_in(&interface);
        assert_eq!(faces.len(), 4, "seen from below while nothing is above");
        assert!(faces.iter().all(|face| face.side == 1));
        surface.activate(&mesh.element_sets["upper"]).unwrap();
        assert!(surface.faces_in(&interface).is_empty());
        let outer = surface.region(&mesh, "outer").unwrap();
        assert_eq!(surface.faces_in(&outer), surface.faces().collect::<Vec<_>>());
        let upper = surface.faces_in(&surface.region(&mesh, "upper").unwrap());
        assert!((total(&mesh, upper) - 5.0).abs() < 1e-14);
        // by name and by position
        let named = surface.faces_in(&surface.region(&mesh, "left").unwrap());
        let mut bare = mesh.clone();
        bare.surfaces.clear();
        assert_eq!(surface.faces_in(&surface.region(&bare, "left").unwrap()), named);
        let error = surface.region(&bare, "lid").unwrap_err().to_string();
        assert!(error.contains("no surface `lid`; allowed: lower, upper, outer, left"), "{error}");
        // a node set with all nodes of faces, and one with none
        bare.node_sets.insert("rim".into(), bare.node_sets["left"].clone());
        assert_eq!(surface.faces_in(&surface.region(&bare, "rim").unwrap()), named);
        bare.node_sets.insert("dots".into(), vec![0, 5]);
        let error = surface.region(&bare, "dots").unwrap_err().to_string();
        assert!(error.contains("node set `dots` (2 nodes) has all nodes of no face"), "{error}");
        bare.surfaces.insert("odd".into(), vec![Face { element: 99, side: 0 }]);
        assert!(surface.region(&bare, "odd").unwrap_err().to_string().contains("element 99 has no side 0"));
    }

    #[test]
    fn three_elements_a_face_and_missing_nodes_are_refused() {
        let mut mesh = Mesh { points: vec![[0.0; 3]; 6], ..Mesh::default() };
        mesh.tetrahedra = vec![[0, 1, 2, 3], [0, 2, 1, 4], [0, 1, 2, 5]];
        let error = OuterSurface::new(&mesh).unwrap_err().to_string();
        assert!(error.contains("elements 0, 1, 2 share one face"), "{error}");
        mesh.tetrahedra = vec![[6, 7, 8, 9]];
        assert!(OuterSurface::new(&mesh).unwrap_err().to_string().contains("node 6; allowed: below 6"));
        assert_eq!(OuterSurface::of_all(&Mesh::default()).unwrap().faces().count(), 0);
    }

    #[test]
    fn the_area_of_a_warped_face() {
        // z = x y over the unit square: ∫∫ √(1 + x² + y²) = 1.2807893…, 2×2 points are right to 2e-4
        let mut mesh = Grid::uniform([0.0; 3], [1.0; 3], [1, 1, 1]).unwrap().mesh("brick").unwrap();
        mesh.points[7][2] = 2.0;
        let top = area(&mesh, Face { element: 0, side: 1 });
        assert!((top / 1.280_789_3 - 1.0).abs() < 5e-4, "{top}");
    }
}
