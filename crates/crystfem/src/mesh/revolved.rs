//! Bodies of revolution, from plane sections.

use super::structured::MAX_NODES;
use crate::error::Error;
use crate::mesh::{Cell, Face, Mesh};
use std::collections::{BTreeMap, HashSet};

/// Names that the body gives to its cuts and to the nodes on its axis.
const OWN_NAMES: [&str; 3] = ["start", "end", "axis"];

/// A radius below this fraction of the largest one is on the axis, or is rounding.
const ON_AXIS: f64 = 1e-9;

/// Elements of a body of revolution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum RevolvedCells {
    /// Hexahedra of quadrangles and wedges of triangles; wedges and tetrahedra of those with an edge on the
    /// axis. A section with an element that has a single node on the axis gives tetrahedra throughout.
    #[default]
    Hexahedra,
    /// Tetrahedra.
    Tetrahedra,
}

/// A plane section of a body of revolution around z, on one side of its axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlaneSection {
    /// Radius and z of the nodes, m.
    pub points: Vec<[f64; 2]>,
    /// Corners of triangles and quadrangles, in either sense.
    pub elements: Vec<Vec<u32>>,
    /// Number of each element, for messages.
    pub labels: Vec<u64>,
    /// Named sets of elements.
    pub element_sets: BTreeMap<String, Vec<u32>>,
    /// Named sets of nodes.
    pub node_sets: BTreeMap<String, Vec<u32>>,
    /// Named edges, each by its two nodes.
    pub edges: BTreeMap<String, Vec<[u32; 2]>>,
}

/// A sector of a body of revolution.
#[derive(Clone, Debug, PartialEq)]
pub struct Revolved {
    /// Mesh of the sector.
    pub mesh: Mesh,
    /// Number of the section's element in which each element originates.
    pub labels: Vec<u64>,
}

impl PlaneSection {
    /// Turns the section about z by `angle`, rad, from the plane y = 0 (x > 0) towards positive y, with
    /// `around` elements. Faces are plane: the body differs from one of revolution by (angle/around)².
    /// Element and node sets keep their names, named edges become surfaces; surfaces and node sets `start`
    /// (y = 0) and `end` are the cuts, node set `axis` has the nodes at r = 0, if there are any.
    ///
    /// # Errors
    /// [`Error::Parameter`] for an angle outside 0 … 2π, elements of a quarter turn or more, no elements, and
    /// more than 2²⁸ nodes; [`Error::Mesh`] for no element, a node at a negative radius, and a set with a
    /// name of the cuts or the axis.
    pub fn revolve(&self, angle: f64, around: usize, cells: RevolvedCells) -> Result<Revolved, Error> {
        self.check(angle, around)?;
        let largest = self.points.iter().map(|point| point[0]).fold(0.0, f64::max);
        let on_axis: Vec<bool> = self.points.iter().map(|point| point[0] <= ON_AXIS * largest).collect();
        let mut mesh = Mesh::default();
        // node of the body of each node of the section, and back with its turn; on the axis all turns are one
        let (mut first, mut origin) = (Vec::with_capacity(self.points.len()), Vec::new());
        for (node, &[radius, z]) in self.points.iter().enumerate() {
            first.push(origin.len() as u32);
            for turn in 0..=if on_axis[node] { 0 } else { around } {
                let (sine, cosine) = (angle * (turn as f64 / around as f64)).sin_cos();
                let radius = if on_axis[node] { 0.0 } else { radius };
                mesh.points.push([radius * cosine, radius * sine, z]);
                origin.push((node as u32, turn));
            }
        }
        let at = |node: u32, turn: usize| {
            first[node as usize] + if on_axis[node as usize] { 0 } else { turn as u32 }
        };
        let rings: Vec<Vec<u32>> = self.elements.iter().map(|ring| self.anticlockwise(ring)).collect();
        let touching = |ring: &[u32]| ring.iter().filter(|&&node| on_axis[node as usize]).count();
        let split = cells == RevolvedCells::Tetrahedra || rings.iter().any(|ring| touching(ring) == 1);
        // element of the section of each hexahedron, tetrahedron and other element
        let mut owners = [const { Vec::new() }; 3];
        for (owner, ring) in rings.iter().enumerate() {
            for turn in 0..around {
                if split {
                    let count = mesh.tetrahedra.len();
                    for triangle in (1..ring.len() - 1).map(|k| [ring[0], ring[k], ring[k + 1]]) {
                        mesh.tetrahedra.extend(stair(triangle, |node, up| at(node, turn + up)));
                    }
                    owners[1].extend(std::iter::repeat_n(owner, mesh.tetrahedra.len() - count));
                    continue;
                }
                let nodes = solid(ring, &on_axis, |node, up| at(node, turn + up));
                let list = match nodes.len() {
                    8 => 0,
                    4 => 1,
                    _ => 2,
                };
                match list {
                    0 => mesh.hexahedra.extend(nodes.first_chunk::<8>()),
                    1 => mesh.tetrahedra.extend(nodes.first_chunk::<4>()),
                    _ => mesh.others.extend(Cell::new(&nodes)),
                }
                owners[list].push(owner);
            }
        }
        let owners = owners.concat();
        for (name, set) in &self.element_sets {
            let members: HashSet<usize> = set.iter().map(|&element| element as usize).collect();
            let own = (0..).zip(&owners).filter(|(_, owner)| members.contains(owner));
            mesh.element_sets.insert(name.clone(), own.map(|(element, _)| element).collect());
        }
        for (name, set) in &self.node_sets {
            let members: HashSet<u32> = set.iter().copied().collect();
            let own = (0..).zip(&origin).filter(|(_, (node, _))| members.contains(node));
            mesh.node_sets.insert(name.clone(), own.map(|(node, _)| node).collect());
        }
        self.name_faces(&mut mesh, &origin, &on_axis, around);
        let axis: Vec<u32> = (0..)
            .zip(&origin)
            .filter(|(_, (node, _))| on_axis[*node as usize])
            .map(|(node, _)| node)
            .collect();
        if !axis.is_empty() {
            mesh.node_sets.insert("axis".into(), axis);
        }
        let labels = owners.iter().map(|&owner| self.labels.get(owner).copied().unwrap_or(owner as u64));
        Ok(Revolved { labels: labels.collect(), mesh })
    }

    fn check(&self, angle: f64, around: usize) -> Result<(), Error> {
        let wrong =
            |name, found, allowed: &str| Err(Error::Parameter { name, found, allowed: allowed.into() });
        if !(angle > 0.0 && angle < std::f64::consts::TAU) {
            return wrong("angle of the sector", angle, "above 0 rad, below 2π");
        }
        if around == 0 {
            return wrong("elements around the axis", 0.0, "1 or more");
        }
        if angle / around as f64 >= std::f64::consts::FRAC_PI_2 {
            let allowed = "below π/2 rad: more elements around";
            return wrong("angle of an element", angle / around as f64, allowed);
        }
        let nodes = self.points.len() as f64 * (around as f64 + 1.0);
        if nodes > MAX_NODES as f64 {
            return wrong("nodes of a body of revolution", nodes, &format!("at most {MAX_NODES}"));
        }
        if self.elements.is_empty() {
            return Err(Error::Mesh("no triangles or quadrangles; allowed: 1 or more".into()));
        }
        let largest = self.points.iter().map(|point| point[0].abs()).fold(0.0, f64::max);
        if let Some([radius, z]) = self.points.iter().find(|[radius, _]| *radius < -ON_AXIS * largest) {
            return Err(Error::Mesh(format!(
                "a node at r = {radius:.6e} m, z = {z:.6e} m; allowed: r ≥ 0, a section on one side of its \
                 axis"
            )));
        }
        let mut names = self.element_sets.keys().chain(self.node_sets.keys()).chain(self.edges.keys());
        match names.find(|name| OWN_NAMES.contains(&name.as_str())) {
            None => Ok(()),
            Some(name) => Err(Error::Mesh(format!(
                "a set `{name}`; allowed: other names, `start` and `end` are the cuts of the body and `axis` \
                 the nodes at r = 0"
            ))),
        }
    }

    /// Corners of an element, anticlockwise with r to the right and z upwards.
    fn anticlockwise(&self, ring: &[u32]) -> Vec<u32> {
        let corner = |k: usize| self.points[ring[k % ring.len()] as usize];
        let twice: f64 = (0..ring.len())
            .map(|k| {
                let ([r, z], [next_r, next_z]) = (corner(k), corner(k + 1));
                r * next_z - next_r * z
            })
            .sum();
        if twice < 0.0 { ring.iter().rev().copied().collect() } else { ring.to_vec() }
    }

    /// Adds the surfaces of named edges and the cuts.
    fn name_faces(&self, mesh: &mut Mesh, origin: &[(u32, usize)], on_axis: &[bool], around: usize) {
        let mut names: BTreeMap<[u32; 2], Vec<&String>> = BTreeMap::new();
        for (name, edges) in &self.edges {
            for &[a, b] in edges {
                names.entry([a.min(b), a.max(b)]).or_default().push(name);
            }
        }
        let mut seen = HashSet::new();
        let mut cuts = [const { Vec::new() }; 2];
        let mut surfaces: BTreeMap<&String, Vec<Face>> = BTreeMap::new();
        for face in (0..mesh.element_count() as u32).flat_map(|element| mesh.faces_of(element)) {
            let nodes = mesh.face_nodes(face);
            let places = || nodes.iter().map(|&node| origin[node as usize]);
            for (cut, end) in cuts.iter_mut().zip([0, around]) {
                if places().all(|(node, turn)| turn == end || on_axis[node as usize]) {
                    cut.push(face);
                }
            }
            let mut edge: Vec<u32> = places().map(|(node, _)| node).collect();
            edge.sort_unstable();
            edge.dedup();
            // of an edge inside the section only the first of two faces
            if let Ok(edge) = <[u32; 2]>::try_from(edge)
                && let Some(names) = names.get(&edge)
                && seen.insert(nodes.key())
            {
                names.iter().for_each(|name| surfaces.entry(name).or_default().push(face));
            }
        }
        for (name, faces) in surfaces {
            mesh.surfaces.insert(name.clone(), faces);
        }
        for (name, faces) in OWN_NAMES.into_iter().zip(cuts) {
            mesh.node_sets.insert(name.into(), mesh.nodes_of(&faces));
            mesh.surfaces.insert(name.into(), faces);
        }
    }
}

/// Nodes of the solid that an anticlockwise element sweeps; `at` gives the node after no or one turn.
fn solid(ring: &[u32], on_axis: &[bool], at: impl Fn(u32, usize) -> u32) -> Vec<u32> {
    let edge = (0..ring.len())
        .find(|&k| [k, (k + 1) % ring.len()].iter().all(|&corner| on_axis[ring[corner] as usize]));
    let Some(edge) = edge else {
        return [1, 0]
            .iter()
            .flat_map(|&up| ring.iter().map(move |&node| (node, up)))
            .map(|(n, up)| at(n, up))
            .collect();
    };
    // anticlockwise the edge on the axis leads downwards
    let corner = |k: usize| ring[(edge + k) % ring.len()];
    let (upper, lower) = (at(corner(0), 0), at(corner(1), 0));
    let swept = |k: usize| [at(corner(k), 0), at(corner(k), 1)];
    match ring.len() {
        3 => [&[lower], &swept(2)[..], &[upper]].concat(),
        _ => [&[lower], &swept(2)[..], &[upper], &swept(3)[..]].concat(),
    }
}

/// Tetrahedra that an anticlockwise triangle sweeps. A diagonal runs from the lower of two nodes before the
/// turn to the higher after it, so that neighbours meet; what an edge on the axis collapses is left out.
fn stair(triangle: [u32; 3], at: impl Fn(u32, usize) -> u32) -> impl Iterator<Item = [u32; 4]> {
    let mut sorted = triangle;
    sorted.sort_unstable();
    let [p, q, r] = sorted;
    let cyclic = (0..3).any(|k| [triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]] == sorted);
    let all = [
        [(p, 0), (q, 0), (r, 0), (r, 1)],
        [(p, 0), (q, 0), (q, 1), (r, 1)],
        [(p, 0), (p, 1), (q, 1), (r, 1)],
    ];
    let tetrahedra = all.map(|corners| corners.map(|(node, up)| at(node, up)));
    (0..3).zip(tetrahedra).filter_map(move |(step, [a, b, c, d])| {
        let whole = a != b && b != c && c != d;
        whole.then_some(if cyclic == (step == 1) { [a, b, c, d] } else { [b, a, c, d] })
    })
}

#[cfg(test)]
mod tests;
