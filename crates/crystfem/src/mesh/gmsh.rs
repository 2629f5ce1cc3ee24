//! Reads Gmsh's MSH 4.1, ASCII and binary of either byte order
//! (<https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format>).
//!
//! A reader of our own: `mshio` 0.4 does not read physical names and panics (`unimplemented!`, `expect`) on sizes and
//! digits that it does not know.

use std::collections::BTreeMap;
use std::path::Path;

use crate::error::Error;
use crate::mesh::Shape;
use crate::mesh::labelled::{Content, Element, Kind, Labels, Node, ReadMesh};

mod numbers;

use numbers::Numbers;

/// Reads a mesh, coordinates multiplied by `scale` (1e-3 for a file in mm). Physical groups of volumes become element
/// sets, those of surfaces become surfaces and node sets, those of curves and points node sets; a group without a name
/// is called `physical-TAG`. Hexahedra (8 or 20 nodes), tetrahedra (4 or 10) and prisms (6 or 15) are computed on.
///
/// # Errors
/// [`Error::Shared`] where the file cannot be read; [`Error::File`] with the line (in binary files the section's line
/// and the byte) for what is not MSH 4.1, other elements, and numbers that do not fit; [`Error::Mesh`] from
/// [`crate::mesh::quality::check`]. Memory follows the size of the file, not the counts that it announces.
pub fn read(path: &Path, scale: f64) -> Result<ReadMesh, Error> {
    let bytes = super::read_bytes(path)?;
    parse(path, &bytes, scale)
}

/// [`read`], of bytes; `path` is for messages only.
///
/// # Errors
/// See [`read`].
pub fn parse(path: &Path, bytes: &[u8], scale: f64) -> Result<ReadMesh, Error> {
    let mut reader = Reader {
        content: Content::default(),
        names: BTreeMap::new(),
        groups: BTreeMap::new(),
        members: bytes.len().saturating_mul(16),
    };
    let mut numbers = Numbers::new(path, bytes);
    numbers.header()?;
    let mut skipped: BTreeMap<String, usize> = BTreeMap::new();
    while let Some(section) = numbers.section()? {
        match section.as_str() {
            "PhysicalNames" => reader.physical_names(&mut numbers)?,
            "Entities" => reader.entities(&mut numbers)?,
            "Nodes" => reader.nodes(&mut numbers)?,
            "Elements" => reader.elements(&mut numbers)?,
            "PartitionedEntities" => {
                return Err(numbers.error("section", "$PartitionedEntities", "a mesh in one partition"));
            }
            _ => {
                numbers.skip(&section)?;
                *skipped.entry(section).or_default() += 1;
                continue;
            }
        }
        numbers.end(&section)?;
    }
    for (section, count) in skipped {
        reader.content.notes.push(format!("{count} × section ${section}: not used"));
    }
    let [nodes, _] = reader.content.labels(path)?;
    reader.name_nodes(&nodes);
    reader.content.into_mesh(path, &nodes, scale)
}

struct Reader {
    content: Content,
    /// Name of a physical group by dimension and tag.
    names: BTreeMap<(i64, i64), String>,
    /// Physical groups of an entity by dimension and tag.
    groups: BTreeMap<(i64, i64), Vec<i64>>,
    /// Members that groups may still have: sixteen a byte, so that memory follows the size of the file.
    members: usize,
}

/// Elements by their number in the format.
const KINDS: [(i64, Kind); 13] = [
    (1, Kind::Line),
    (2, Kind::Triangle),
    (3, Kind::Quadrangle),
    (4, Kind::Solid(Shape::Tetrahedron)),
    (5, Kind::Solid(Shape::Hexahedron)),
    (6, Kind::Solid(Shape::Wedge)),
    (8, Kind::Line3),
    (9, Kind::Triangle6),
    (11, Kind::Solid(Shape::Tetrahedron10)),
    (15, Kind::Point),
    (16, Kind::Quadrangle8),
    (17, Kind::Solid(Shape::Hexahedron20)),
    (18, Kind::Solid(Shape::Wedge15)),
];

impl Reader {
    /// `count`, then lines of dimension, tag and "name"; text in binary files too.
    fn physical_names(&mut self, numbers: &mut Numbers) -> Result<(), Error> {
        let line = numbers.text_line();
        let Ok(count) = line.trim().parse::<u64>() else {
            return Err(numbers.error("number of physical names", line, "a count"));
        };
        for _ in 0..count {
            let line = numbers.text_line();
            let mut parts = line.trim().splitn(3, char::is_whitespace);
            let mut tag = || parts.next().and_then(|part| part.parse::<i64>().ok());
            let (Some(dimension), Some(tag)) = (tag(), tag()) else {
                return Err(numbers.error("physical name", line, "dimension, tag, \"name\""));
            };
            let name = parts.next().unwrap_or("").trim().trim_matches('"');
            if name.is_empty() {
                return Err(numbers.error("physical name", line, "dimension, tag, \"name\""));
            }
            self.names.insert((dimension, tag), name.to_owned());
        }
        Ok(())
    }

    /// Physical groups of each entity.
    fn entities(&mut self, numbers: &mut Numbers) -> Result<(), Error> {
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = numbers.size("number of entities")?;
        }
        for (dimension, count) in (0..).zip(counts) {
            for _ in 0..count {
                let tag = numbers.int("tag of an entity")?;
                // a point has a place, all else a box
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    numbers.double("place of an entity")?;
                }
                let mut groups = Vec::new();
                for _ in 0..numbers.size("number of physical groups")? {
                    // the sign is an orientation
                    groups.push(numbers.int("physical group")?.abs());
                }
                if dimension > 0 {
                    for _ in 0..numbers.size("number of bounding entities")? {
                        numbers.int("bounding entity")?;
                    }
                }
                self.groups.insert((dimension, tag), groups);
            }
        }
        Ok(())
    }

    fn nodes(&mut self, numbers: &mut Numbers) -> Result<(), Error> {
        let [blocks, count, _, _] = numbers.four_sizes()?;
        let before = self.content.nodes.len();
        for _ in 0..blocks {
            let dimension = numbers.int("dimension of an entity")?;
            numbers.int("tag of an entity")?;
            let parametric = numbers.int("parametric (0 or 1)")?;
            let parameters = match (parametric, dimension) {
                (0, _) => 0,
                (1, 0..=3) => dimension,
                _ => {
                    return Err(numbers.error(
                        "parametric coordinates",
                        parametric,
                        "0, or 1 in dimension 0 … 3",
                    ));
                }
            };
            let first = self.content.nodes.len();
            for _ in 0..numbers.size("number of nodes")? {
                let label = numbers.size("number of a node")?;
                self.content.nodes.push(Node { label, line: numbers.line(), point: [0.0; 3] });
            }
            for node in first..self.content.nodes.len() {
                let mut point = [0.0; 3];
                for x in &mut point {
                    *x = numbers.double("coordinate")?;
                    if !x.is_finite() {
                        return Err(numbers.error("coordinate", *x, "a finite number"));
                    }
                }
                for _ in 0..parameters {
                    numbers.double("parametric coordinate")?;
                }
                self.content.nodes[node].point = point;
            }
        }
        let found = self.content.nodes.len() - before;
        if found as u64 != count {
            return Err(numbers.error("number of nodes", found, format!("{count}, as announced")));
        }
        Ok(())
    }

    fn elements(&mut self, numbers: &mut Numbers) -> Result<(), Error> {
        let [blocks, count, _, _] = numbers.four_sizes()?;
        let before = self.content.elements.len();
        for _ in 0..blocks {
            let dimension = numbers.int("dimension of an entity")?;
            let tag = numbers.int("tag of an entity")?;
            let code = numbers.int("type of elements")?;
            let Some((_, kind)) = KINDS.into_iter().find(|kind| kind.0 == code) else {
                let allowed = "1, 8 (lines), 2, 9 (triangles), 3, 16 (quadrangles), 4, 11 (tetrahedra), 5, 17 (hexahedra), \
                               6, 18 (prisms), 15 (point); in Gmsh: Mesh.ElementOrder = 1, or 2 with \
                               Mesh.SecondOrderIncomplete = 1";
                return Err(numbers.error("type of elements", code, allowed));
            };
            let first = self.content.elements.len();
            for _ in 0..numbers.size("number of elements")? {
                let label = numbers.size("number of an element")?;
                let mut nodes = [0; 20];
                for node in &mut nodes[..kind.node_count()] {
                    *node = numbers.size("node of an element")?;
                }
                let first = self.content.element_nodes.len();
                let all = &mut self.content.element_nodes;
                match kind.solid() {
                    Some(shape) => all.extend(shape.gmsh().iter().map(|&place| nodes[place])),
                    None => all.extend(&nodes[..kind.node_count()]),
                }
                self.content.elements.push(Element { label, line: numbers.line(), kind, first });
            }
            let places = first as u32..self.content.elements.len() as u32;
            let groups = self.groups.get(&(dimension, tag)).map_or(&[][..], Vec::as_slice);
            let members = groups.len().saturating_mul(places.len().max(1));
            let Some(left) = self.members.checked_sub(members) else {
                return Err(numbers.error(
                    "members of physical groups",
                    members,
                    "16 a byte of the file in all",
                ));
            };
            self.members = left;
            for group in groups {
                let name = self.names.get(&(dimension, *group)).cloned();
                let name = name.unwrap_or_else(|| format!("physical-{group}"));
                self.content.element_sets.entry(name).or_default().extend(places.clone());
            }
        }
        let found = self.content.elements.len() - before;
        if found as u64 != count {
            return Err(numbers.error("number of elements", found, format!("{count}, as announced")));
        }
        Ok(())
    }

    /// Node sets of the groups of points, curves and surfaces.
    fn name_nodes(&mut self, nodes: &Labels) {
        let Content { elements, element_nodes, element_sets, node_sets, .. } = &mut self.content;
        element_sets.retain(|name, places| {
            let low = |kind: Kind| kind.solid().is_none();
            let members = places.iter().map(|place| &elements[*place as usize]);
            let set: Vec<u32> = members
                .clone()
                .filter(|element| low(element.kind))
                .flat_map(|element| &element_nodes[element.first..element.first + element.kind.node_count()])
                .filter_map(|label| nodes.get(*label))
                .collect();
            if !set.is_empty() {
                node_sets.entry(name.clone()).or_default().extend(set);
            }
            // of curves and points nothing else remains
            members.into_iter().any(|element| !matches!(element.kind, Kind::Line | Kind::Line3 | Kind::Point))
        });
    }
}

#[cfg(test)]
mod tests;
