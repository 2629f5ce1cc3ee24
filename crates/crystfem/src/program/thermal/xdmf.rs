//! XDMF 2 and 3 (`.xdmf`, `.xmf`), as written by FEniCS, meshio and ParaView: numbers as text, in HDF5 or in
//! binary files.
//!
//! Format: <https://www.xdmf.org/index.php/XDMF_Model_and_Format>.

use super::xml::{XmlElement, read};
use super::{Analysis, CellsByDimension, ThermalFrame, choose_array, data_error};
use crate::error::Error;
use meshfile::netcdf::Netcdf;
use meshfile::vtu::numbers;
use std::path::{Path, PathBuf};

/// Topology name in lower case, its number in mixed topologies, nodes per element, and cell type of VTK.
const TOPOLOGIES: [(&str, u32, usize, u64); 23] = [
    ("polyvertex", 1, 1, 1),
    ("polyline", 2, 2, 3),
    ("triangle", 4, 3, 5),
    ("quadrilateral", 5, 4, 9),
    ("tetrahedron", 6, 4, 10),
    ("pyramid", 7, 5, 14),
    ("wedge", 8, 6, 13),
    ("hexahedron", 9, 8, 12),
    ("edge_3", 34, 3, 21),
    ("quadrilateral_9", 35, 9, 28),
    ("triangle_6", 36, 6, 22),
    ("tri_6", 36, 6, 22),
    ("quadrilateral_8", 37, 8, 23),
    ("quad_8", 37, 8, 23),
    ("quad_9", 35, 9, 28),
    ("tetrahedron_10", 38, 10, 24),
    ("tet_10", 38, 10, 24),
    ("pyramid_13", 39, 13, 27),
    ("wedge_15", 40, 15, 26),
    ("hexahedron_20", 48, 20, 25),
    ("hex_20", 48, 20, 25),
    ("hexahedron_27", 50, 27, 29),
    ("hex_27", 50, 27, 29),
];

/// Opens a file: its first mesh, and the nodal temperatures at each time.
pub fn open(path: &Path, array: Option<&str>) -> Result<Analysis, Error> {
    let file = Xdmf { path: path.to_path_buf(), root: read(path)? };
    let wrong = |reason: &str| data_error(path, reason);
    let all = file.root.descendants();
    if !all.iter().any(|node| node.name == "Xdmf") {
        return Err(wrong("found no <Xdmf>; allowed: XDMF 2 or 3"));
    }
    let grids: Vec<&XmlElement> = all.iter().filter(|node| node.name == "Grid").copied().collect();
    if let Some(spatial) = grids.iter().find(|grid| grid.get("CollectionType") == "Spatial") {
        let name = spatial.get("Name");
        let allowed = "uniform grids and temporal collections (merge the parts into one mesh)";
        return Err(wrong(&format!("grid `{name}` is a spatial collection; allowed: {allowed}")));
    }
    let whole = |grid: &&&XmlElement| grid.child("Topology").is_some() && grid.child("Geometry").is_some();
    let Some(mesh) = grids.iter().find(whole) else {
        return Err(wrong("found no Grid with Topology and Geometry; allowed: at least one"));
    };
    let points = mesh.child("Geometry").map_or(Ok(Vec::new()), |geometry| file.points(geometry))?;
    let cells = mesh
        .child("Topology")
        .map_or(Ok(CellsByDimension::default()), |own| file.cells(own, points.len()))?;
    let cells = cells.highest().ok_or_else(|| wrong("found no elements; allowed: at least one"))?;
    let mut names: Vec<String> = Vec::new();
    for attribute in grids.iter().flat_map(|grid| grid.all("Attribute")).filter(|own| is_scalar(own)) {
        let name = attribute.get("Name").to_owned();
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let name = choose_array(path, &names, array)?;
    let mut frames: Vec<(f64, XmlElement)> = Vec::new();
    for collection in &all {
        let times = file.times(collection)?;
        for (index, grid) in collection.all("Grid").enumerate() {
            let Some(attribute) = grid.all("Attribute").find(|own| is_scalar(own) && own.get("Name") == name)
            else {
                continue;
            };
            if attribute.get("ItemType") == "FiniteElementFunction" {
                let allowed = "nodal values (write the file with `XDMFFile.write`, not as a checkpoint)";
                return Err(wrong(&format!("`{name}` is a FiniteElementFunction; allowed: {allowed}")));
            }
            let Some(item) = attribute.child("DataItem") else {
                return Err(wrong(&format!("`{name}` has no DataItem with its values")));
            };
            let time = match grid.child("Time").map(|time| time.get("Value")) {
                Some(value) => value
                    .trim()
                    .parse()
                    .map_err(|_| wrong(&format!("found time {value:?}; allowed: a number, s")))?,
                None => times.get(index).copied().unwrap_or(frames.len() as f64),
            };
            frames.push((time, item.clone()));
        }
    }
    let (nodes, name) = (points.len(), name.to_owned());
    let frames = frames.into_iter().map(move |(time, item)| {
        let temperature = file.values(&item)?;
        if temperature.len() != nodes {
            let found = format!("found {} values of `{name}` at t = {time} s", temperature.len());
            let reason = format!("{found}; allowed: {nodes}, one per node of the first mesh");
            return Err(data_error(&file.path, &reason));
        }
        Ok(ThermalFrame { time, temperature })
    });
    Ok(Analysis { points, cells, frames: Box::new(frames) })
}

/// Tells if an attribute is a nodal scalar.
fn is_scalar(attribute: &XmlElement) -> bool {
    let (kind, centre) = (attribute.get("AttributeType"), attribute.get("Center"));
    matches!(kind, "" | "Scalar") && matches!(centre, "" | "Node")
}

struct Xdmf {
    path: PathBuf,
    root: XmlElement,
}

impl Xdmf {
    fn wrong(&self, reason: String) -> Error {
        data_error(&self.path, &reason)
    }

    /// Returns the times of the grids in a collection.
    fn times(&self, collection: &XmlElement) -> Result<Vec<f64>, Error> {
        let Some(time) = collection.child("Time").filter(|_| collection.child("Grid").is_some()) else {
            return Ok(Vec::new());
        };
        let values = time.child("DataItem").map_or(Ok(Vec::new()), |item| self.values(item))?;
        match (time.get("TimeType"), &values[..]) {
            ("List", _) => Ok(values),
            ("HyperSlab", &[start, step, count]) if (0.0..1e7).contains(&count) => {
                Ok((0..count as usize).map(|k| start + k as f64 * step).collect())
            }
            (kind, _) => {
                Err(self.wrong(format!("found collection times by {kind:?}; allowed: List or HyperSlab")))
            }
        }
    }

    fn points(&self, geometry: &XmlElement) -> Result<Vec<[f64; 3]>, Error> {
        let kind = match geometry.get("GeometryType") {
            "" => geometry.get("Type"),
            kind => kind,
        };
        let axes = geometry.all("DataItem").map(|item| self.values(item)).collect::<Result<Vec<_>, _>>()?;
        let size = match kind {
            "XYZ" | "" => 3,
            "XY" => 2,
            "X" | "X_Y" | "X_Y_Z" => 1,
            _ => {
                let allowed = "XYZ, XY, X, X_Y_Z, X_Y";
                return Err(self.wrong(format!("found geometry type {kind:?}; allowed: {allowed}")));
            }
        };
        let count = axes.first().map_or(0, |axis| axis.len() / size);
        let fits = (size == 1 || axes.len() == 1) && axes.len() <= 3;
        if count == 0 || !fits || axes.iter().any(|axis| axis.len() != count * size) {
            let found: Vec<usize> = axes.iter().map(Vec::len).collect();
            return Err(self.wrong(format!(
                "found {found:?} numbers in geometry {kind}; allowed: all coordinates of each node"
            )));
        }
        let place = |k: usize| {
            let mut point = [0.0; 3];
            for (d, x) in point.iter_mut().enumerate() {
                let value = if size == 1 {
                    axes.get(d).map(|axis| axis[k])
                } else {
                    axes[0].get(size * k + d).copied().filter(|_| d < size)
                };
                *x = value.unwrap_or(0.0);
            }
            point
        };
        Ok((0..count).map(place).collect())
    }

    fn cells(&self, topology: &XmlElement, nodes: usize) -> Result<CellsByDimension, Error> {
        let kind = match topology.get("TopologyType") {
            "" => topology.get("Type"),
            kind => kind,
        };
        let lower = kind.to_lowercase();
        let values = topology.child("DataItem").map_or(Ok(Vec::new()), |item| self.values(item))?;
        let mut cells = CellsByDimension::default();
        let mut push = |vtk: u64, own: &[f64]| {
            let fits = |node: &f64| (0.0..nodes as f64).contains(node);
            if let Some(node) = own.iter().find(|node| !fits(node)) {
                return Err(self
                    .wrong(format!("found node {node} in an element; allowed: 0 to {}", nodes.max(1) - 1)));
            }
            cells.push(vtk, &own.iter().map(|&node| node as u32).collect::<Vec<u32>>());
            Ok(())
        };
        let cut = || self.wrong(format!("topology {kind} is truncated within an element"));
        if lower == "mixed" {
            let mut rest = values.as_slice();
            while let Some((&code, behind)) = rest.split_first() {
                let known = TOPOLOGIES.iter().find(|(_, own, ..)| f64::from(*own) == code);
                let Some(&(.., count, vtk)) = known else {
                    let reason =
                        format!("found element type {code} in a mixed topology; allowed: {}", topologies());
                    return Err(self.wrong(reason));
                };
                // polyvertices and polylines are preceded by their number of nodes
                let prefix = usize::from(code <= 2.0);
                let count = if prefix == 1 { behind.first().map_or(0, |&n| n as usize) } else { count };
                let own = behind.get(prefix..).and_then(|rest| rest.get(..count)).ok_or_else(cut)?;
                push(if prefix == 1 && code > 1.0 && count > 2 { 4 } else { vtk }, own)?;
                rest = &behind[prefix + count..];
            }
            return Ok(cells);
        }
        let Some(&(name, _, count, vtk)) = TOPOLOGIES.iter().find(|(name, ..)| *name == lower) else {
            return Err(self.wrong(format!("found topology type {kind:?}; allowed: {}", topologies())));
        };
        let given = topology.get("NodesPerElement").trim().parse().ok().filter(|own| *own > 0);
        let count: usize = if name.starts_with("poly") { given.unwrap_or(count) } else { count };
        if values.len() % count != 0 {
            return Err(cut());
        }
        values
            .chunks_exact(count)
            .try_for_each(|own| push(if name == "polyline" && count > 2 { 4 } else { vtk }, own))?;
        Ok(cells)
    }

    /// Reads the numbers of an item: text, HDF5, binary, or a reference to another item.
    fn values(&self, item: &XmlElement) -> Result<Vec<f64>, Error> {
        let reference = item.get("Reference");
        if !reference.is_empty() {
            let target = if reference == "XML" { item.text.trim() } else { reference };
            let name = target.rsplit_once("@Name=").map(|(_, name)| {
                name.replace("&quot;", "\"").trim_matches(|c| matches!(c, '"' | '\'' | ']')).to_owned()
            });
            let all = self.root.descendants();
            let found = all.iter().find(|node| {
                node.name == "DataItem"
                    && node.get("Reference").is_empty()
                    && Some(node.get("Name")) == name.as_deref()
            });
            let wrong = || {
                self.wrong(format!(
                    "found a DataItem reference to {target:?}; allowed: a path that ends with [@Name=…]"
                ))
            };
            return self.values(found.ok_or_else(wrong)?);
        }
        let kind = item.get("ItemType");
        if !matches!(kind, "" | "Uniform") {
            return Err(self.wrong(format!("found DataItem type {kind:?}; allowed: Uniform")));
        }
        let text = item.text.trim();
        match item.get("Format").to_uppercase().as_str() {
            "" | "XML" => {
                let number = |word: &str| {
                    word.parse()
                        .map_err(|_| self.wrong(format!("found {word:?} in a DataItem; allowed: numbers")))
                };
                text.split_ascii_whitespace().map(number).collect()
            }
            "HDF" | "HDF5" => {
                let Some((file, name)) = text.rsplit_once(':') else {
                    return Err(self.wrong(format!("found {text:?}; allowed: FILE.h5:/PATH")));
                };
                let mut file = Netcdf::open(&self.path.with_file_name(file))?;
                Ok(file.numbers(name.trim_start_matches('/'), None)?)
            }
            "BINARY" => self.binary(item, text),
            other => Err(self.wrong(format!("found DataItem format {other:?}; allowed: XML, HDF, Binary"))),
        }
    }

    fn binary(&self, item: &XmlElement, file: &str) -> Result<Vec<f64>, Error> {
        let path = self.path.with_file_name(file);
        let bytes = std::fs::read(&path).map_err(polycore::Error::from_io("read", &path))?;
        let kind = match item.get("NumberType") {
            "" => item.get("DataType"),
            kind => kind,
        };
        let precision: usize = item.get("Precision").parse().unwrap_or(4);
        let size = if matches!(kind, "Char" | "UChar") { 1 } else { precision };
        let base = match kind {
            "" | "Float" => "Float",
            "Char" | "Int" => "Int",
            _ => "UInt",
        };
        let dimensions = item.get("Dimensions").split_whitespace();
        let count = dimensions.filter_map(|word| word.parse::<usize>().ok()).try_fold(1, usize::checked_mul);
        let seek: usize = item.get("Seek").parse().unwrap_or(0);
        let end = count.and_then(|count| count.checked_mul(size)?.checked_add(seek));
        let found = end.and_then(|end| bytes.get(seek..end)).and_then(|own| {
            numbers(own, &format!("{base}{}", 8 * size), item.get("Endian").eq_ignore_ascii_case("big"))
        });
        let allowed = "the number of values in `Dimensions`, of `NumberType` and `Precision`";
        found.ok_or_else(|| data_error(&path, &format!("found {} bytes; allowed: {allowed}", bytes.len())))
    }
}

/// Lists the names of supported topologies.
fn topologies() -> String {
    let names: Vec<&str> = TOPOLOGIES.iter().map(|(name, ..)| *name).collect();
    format!("mixed, {}", names.join(", "))
}
