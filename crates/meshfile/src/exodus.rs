//! Exodus II files, as MOOSE, Cubit and ParaView write them (Schoof & Yarberry 1994, SAND92-2137, "EXODUS II:
//! A Finite Element Data Model"), in the classic format of netCDF or in HDF5.

use crate::content::{ElementKind, Face, FileElement, FileNode, MeshFile};
use crate::error::{Error, data_error};
use crate::netcdf::Netcdf;
use crate::shape::ElementShape;
use std::path::Path;

/// Block of elements of one type.
#[derive(Debug)]
pub struct Block {
    /// Name, or `block-ID`.
    pub name: String,
    /// Type in capitals, such as `HEX8`.
    pub element_type: String,
    /// Number of nodes of an element.
    pub nodes_each: usize,
    /// Nodes of all elements, from 0.
    pub nodes: Vec<u32>,
}

/// Reads a mesh: blocks become element sets, node sets and side sets keep their names or are `nodeset-ID` and
/// `sideset-ID`.
///
/// # Errors
/// [`Error::Data`] for damaged files, pyramids and other elements, and members of sets that do not exist;
/// [`Error::Shared`] for a file that cannot be read.
pub fn read(path: &Path) -> Result<MeshFile, Error> {
    let mut file = Netcdf::open(path)?;
    let mut mesh = MeshFile::default();
    for (label, point) in (1..).zip(points(&mut file, path)?) {
        if !point.iter().all(|x| x.is_finite()) {
            return Err(data_error(path, &format!("node {label} at {point:?}; allowed: finite positions")));
        }
        mesh.nodes.push(FileNode { label, line: 0, point });
    }
    let mut reduced = 0;
    // number of sides of an element that are faces of a shell, before its edges
    let mut shells = Vec::new();
    for block in blocks(&mut file, path, mesh.nodes.len())? {
        let Some((kind, order)) = element_kind(&block.element_type, block.nodes_each) else {
            let Block { name, element_type, nodes_each, .. } = block;
            let found = format!("block `{name}` of {element_type} with {nodes_each} nodes");
            let allowed = "HEX, TET, WEDGE, QUAD, SHELL, TRI, BAR, BEAM, EDGE and SPHERE";
            return Err(data_error(path, &format!("{found}; allowed: {allowed} of first or second order")));
        };
        let is_shell = block.element_type.starts_with("SHELL") || block.element_type.starts_with("TRISHELL");
        for nodes in block.nodes.chunks(block.nodes_each) {
            let (place, first) = (mesh.elements.len(), mesh.element_nodes.len());
            let count = kind.node_count();
            mesh.element_nodes.extend((0..count).map(|k| nodes[order.get(k).copied().unwrap_or(k)]));
            mesh.elements.push(FileElement { label: place as u64 + 1, line: 0, kind, first });
            mesh.element_sets.entry(block.name.clone()).or_default().push(place as u32);
            shells.push(if is_shell { 2 } else { 0 });
            reduced += usize::from(count < nodes.len());
        }
    }
    if mesh.elements.is_empty() {
        return Err(data_error(path, "found no elements; allowed: at least one block with elements"));
    }
    if reduced > 0 {
        let note =
            "elements of complete second order: nodes in the middles of sides and elements are left out";
        mesh.notes.push(format!("{reduced} {note}"));
    }
    for (list, name) in lists(&mut file, ["ns", "nodeset", "node_ns"])? {
        let members = file.numbers(&list, None)?;
        let nodes = indices(path, &list, &members, mesh.nodes.len())?;
        mesh.node_sets.entry(name).or_default().extend(nodes);
    }
    for (elements, name) in lists(&mut file, ["ss", "sideset", "elem_ss"])? {
        let sides = elements.replace("elem", "side");
        let members = file.numbers(&elements, None)?;
        let members = indices(path, &elements, &members, mesh.elements.len())?;
        let numbers = file.numbers(&sides, None)?;
        if numbers.len() != members.len() {
            let (found, allowed) = (numbers.len(), members.len());
            return Err(data_error(path, &format!("found {found} numbers in `{sides}`; allowed: {allowed}")));
        }
        let mut unused = 0;
        for (&element, &side) in members.iter().zip(&numbers) {
            let kind = mesh.elements[element as usize].kind;
            match side_of(kind, side as i64 - shells[element as usize]) {
                Some(side) => mesh.surfaces.entry(name.clone()).or_default().push(Face { element, side }),
                None => unused += 1,
            }
        }
        if unused > 0 {
            mesh.notes
                .push(format!("side set `{name}`: {unused} sides of shells, lines or points: not used"));
        }
    }
    Ok(mesh)
}

/// Positions of the nodes, in one to three dimensions.
///
/// # Errors
/// [`Error::Data`] for coordinates that are missing or of different lengths.
pub fn points(file: &mut Netcdf, path: &Path) -> Result<Vec<[f64; 3]>, Error> {
    // older files have one variable for all axes
    let axes: Vec<Vec<f64>> = match file.shape("coord") {
        Some(shape) => {
            let values = file.numbers("coord", None)?;
            values.chunks(shape.last().copied().unwrap_or(1).max(1)).map(<[f64]>::to_vec).collect()
        }
        None => ["coordx", "coordy", "coordz"]
            .iter()
            .filter(|name| file.shape(name).is_some())
            .copied()
            .collect::<Vec<_>>()
            .into_iter()
            .map(|name| file.numbers(name, None))
            .collect::<Result<_, _>>()?,
    };
    let count = axes.first().map_or(0, Vec::len);
    if !(1..=3).contains(&axes.len()) || count == 0 {
        return Err(data_error(path, &format!("found {} axes of coordinates; allowed: 1 to 3", axes.len())));
    }
    if let Some(axis) = axes.iter().find(|axis| axis.len() != count) {
        let found = format!("found {} numbers in `coord`; allowed: {count}, one per node", axis.len());
        return Err(data_error(path, &found));
    }
    Ok((0..count).map(|k| [0, 1, 2].map(|d| axes.get(d).map_or(0.0, |axis| axis[k]))).collect())
}

/// Blocks of elements; those without elements are left out.
///
/// # Errors
/// [`Error::Data`] for nodes that do not exist.
pub fn blocks(file: &mut Netcdf, path: &Path, nodes: usize) -> Result<Vec<Block>, Error> {
    let mut found = Vec::new();
    for (list, name) in lists(file, ["eb", "block", "connect"])? {
        let shape = file.shape(&list).unwrap_or_default();
        let nodes_each = shape.get(1).copied().unwrap_or_default().max(1);
        let element_type = file.attribute(&list, "elem_type").unwrap_or_default();
        let element_type = element_type.trim_matches(['\0', ' ']).to_uppercase();
        let members = file.numbers(&list, None)?;
        let nodes = indices(path, &list, &members, nodes)?;
        if nodes.len() % nodes_each != 0 {
            let count = nodes.len();
            return Err(data_error(
                path,
                &format!("`{list}`: {count} nodes; allowed: {nodes_each} an element"),
            ));
        }
        found.push(Block { name, element_type, nodes_each, nodes });
    }
    Ok(found)
}

/// Lists of the blocks or sets that have members, with their names.
fn lists(file: &mut Netcdf, [kind, prefix, list]: [&str; 3]) -> Result<Vec<(String, String)>, Error> {
    let names = names(file, kind, prefix)?;
    let mut found = Vec::new();
    for number in 1.. {
        let own = format!("{list}{number}");
        if file.shape(&own).is_some() {
            let name = names.get(number - 1).cloned();
            found.push((own, name.unwrap_or_else(|| format!("{prefix}-{number}"))));
        } else if number > names.len() {
            break;
        }
    }
    Ok(found)
}

/// Names of the blocks or sets, `PREFIX-ID` for those without one.
fn names(file: &mut Netcdf, kind: &str, prefix: &str) -> Result<Vec<String>, Error> {
    let list = format!("{kind}_prop1");
    let ids = if file.shape(&list).is_some() { file.numbers(&list, None)? } else { Vec::new() };
    let given = text_rows(file, &format!("{kind}_names"))?;
    let name = |(index, id): (usize, &f64)| {
        let given = given.get(index).filter(|name| !name.is_empty());
        given.cloned().unwrap_or_else(|| format!("{prefix}-{id}"))
    };
    Ok(ids.iter().enumerate().map(name).collect())
}

/// Rows of a variable of characters; none if there is no such variable.
///
/// # Errors
/// [`Error::Data`] for a damaged variable.
pub fn text_rows(file: &mut Netcdf, name: &str) -> Result<Vec<String>, Error> {
    let Some(shape) = file.shape(name) else { return Ok(Vec::new()) };
    let letters = file.numbers(name, None)?;
    let row = |letters: &[f64]| -> String {
        letters.iter().map(|&letter| letter as u8 as char).take_while(|letter| *letter != '\0').collect()
    };
    let longest = shape.last().copied().unwrap_or(1).max(1);
    Ok(letters.chunks(longest).map(|letters| row(letters).trim().to_owned()).collect())
}

/// Converts numbers from 1 to indices.
fn indices(path: &Path, name: &str, numbers: &[f64], count: usize) -> Result<Vec<u32>, Error> {
    let index = |&number: &f64| {
        let fits = (1.0..=count as f64).contains(&number);
        let what = if name.starts_with("elem") { "element" } else { "node" };
        fits.then(|| number as u32 - 1).ok_or_else(|| {
            data_error(path, &format!("found {what} {number} in `{name}`; allowed: 1 to {count}"))
        })
    };
    numbers.iter().map(index).collect()
}

/// Exodus numbers the edges between bottom and top before those of the top.
const HEXAHEDRON20: [usize; 20] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15];
const WEDGE15: [usize; 15] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 9, 10, 11];

/// Begin of an element type, numbers of nodes that it may have, element kind, and the places of its nodes
/// where Exodus has another order; further nodes are those in the middles of sides and elements.
const TYPES: [(&str, &[usize], ElementKind, &[usize]); 19] = [
    ("HEX", &[8], ElementKind::Solid(ElementShape::Hexahedron), &[]),
    ("HEX", &[20, 27], ElementKind::Solid(ElementShape::Hexahedron20), &HEXAHEDRON20),
    ("TET", &[4], ElementKind::Solid(ElementShape::Tetrahedron), &[]),
    ("TET", &[10, 11, 14, 15], ElementKind::Solid(ElementShape::Tetrahedron10), &[]),
    ("WEDGE", &[6], ElementKind::Solid(ElementShape::Wedge), &[]),
    ("WEDGE", &[15, 18], ElementKind::Solid(ElementShape::Wedge15), &WEDGE15),
    ("TRI", &[3], ElementKind::Triangle, &[]),
    ("TRI", &[6, 7], ElementKind::Triangle6, &[]),
    ("QUAD", &[4], ElementKind::Quadrangle, &[]),
    ("QUAD", &[8, 9], ElementKind::Quadrangle8, &[]),
    ("SHELL", &[3], ElementKind::Triangle, &[]),
    ("SHELL", &[6, 7], ElementKind::Triangle6, &[]),
    ("SHELL", &[4], ElementKind::Quadrangle, &[]),
    ("SHELL", &[8, 9], ElementKind::Quadrangle8, &[]),
    ("BAR", &[2, 3], ElementKind::Line, &[]),
    ("BEAM", &[2, 3], ElementKind::Line, &[]),
    ("TRUSS", &[2, 3], ElementKind::Line, &[]),
    ("EDGE", &[2, 3], ElementKind::Line, &[]),
    ("SPHERE", &[1], ElementKind::Point, &[]),
];

fn element_kind(name: &str, nodes: usize) -> Option<(ElementKind, &'static [usize])> {
    let found = TYPES.iter().find(|(begin, counts, ..)| name.starts_with(begin) && counts.contains(&nodes));
    found.map(|&(_, _, kind, order)| (kind, order))
}

/// Side of an element by its number in Exodus, from 1; `None` for lines, points and unknown numbers.
fn side_of(kind: ElementKind, number: i64) -> Option<u8> {
    let sides: &[u8] = match kind {
        ElementKind::Solid(shape) => match shape.corners() {
            8 => &[2, 3, 4, 5, 0, 1],
            4 => &[1, 2, 3, 0],
            _ => &[2, 3, 4, 0, 1],
        },
        _ => [0, 1, 2, 3].split_at(kind.facet()?).0,
    };
    sides.get(usize::try_from(number - 1).ok()?).copied()
}
