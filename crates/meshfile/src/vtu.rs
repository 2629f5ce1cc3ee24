//! Unstructured grids in VTK's XML files (`.vtu`), of one piece or of a parallel run (`.pvtu`).
//!
//! Format: <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>. An own reader, because
//! `vtkio` 0.7 panics on damaged files.

mod arrays;
mod mesh;

pub use arrays::numbers;
pub use mesh::read;

use crate::error::{Error, data_error, read_bytes};
use arrays::ArrayEncoding;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

type Attributes = HashMap<String, String>;

/// A grid of one or several pieces, in file order.
#[derive(Debug, Default)]
pub struct VtuGrid {
    /// Positions of the nodes. Nodes that pieces share are repeated.
    pub points: Vec<[f64; 3]>,
    /// VTK type of each cell, and the end of its nodes in `nodes`.
    pub cells: Vec<(u8, usize)>,
    /// Nodes of all cells.
    pub nodes: Vec<u32>,
    /// Scalars of nodes.
    pub point_arrays: Vec<VtuArray>,
    /// Integers of cells.
    pub cell_arrays: Vec<VtuArray>,
    /// First node of each piece.
    pub pieces: Vec<usize>,
    /// Files that were read.
    pub files: Vec<PathBuf>,
}

/// Scalars of nodes or cells.
#[derive(Debug)]
pub struct VtuArray {
    /// Name.
    pub name: String,
    /// True for a type of integers.
    pub integers: bool,
    /// Values.
    pub values: Vec<f64>,
}

#[derive(Default)]
struct VtuPiece {
    /// Numbers of points and cells, where the piece states them.
    counts: [Option<usize>; 2],
    points: Vec<f64>,
    nodes: Vec<f64>,
    ends: Vec<f64>,
    kinds: Vec<f64>,
    point_arrays: Vec<VtuArray>,
    cell_arrays: Vec<VtuArray>,
}

/// Array of cells that other pieces have, too, where it is not 0.
const GHOST: &str = "vtkGhostType";

impl VtuPiece {
    /// Refuses lists that do not fit each other.
    fn check(&self, path: &Path) -> Result<(), Error> {
        let [points, cells] = self.counts;
        let cells = cells.unwrap_or(self.ends.len());
        let last = self.ends.last().map_or(0, |&end| end as usize);
        let wrong = |name: &str, found: usize, allowed: usize| {
            let what = format!("a piece has {found} values of `{name}`; allowed: {allowed}");
            Err(data_error(path, &what))
        };
        match points {
            Some(points) if self.points.len() != 3 * points => wrong("Points", self.points.len(), 3 * points),
            _ if !self.points.len().is_multiple_of(3) => {
                wrong("Points", self.points.len(), 3 * self.points.len().div_ceil(3))
            }
            _ if self.ends.len() != cells => wrong("offsets", self.ends.len(), cells),
            _ if self.kinds.len() != cells => wrong("types", self.kinds.len(), cells),
            _ if self.nodes.len() != last => wrong("connectivity", self.nodes.len(), last),
            _ => match self.cell_arrays.iter().find(|array| array.values.len() != cells) {
                Some(array) => wrong(&array.name, array.values.len(), cells),
                None => Ok(()),
            },
        }
    }
}

/// Returns true for a path with an ending, in any case of letters.
pub fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending))
}

/// Returns the path of a file that is named in another file, relative to it.
pub fn beside(path: &Path, name: &str) -> PathBuf {
    path.with_file_name(name.replace('\\', "/"))
}

/// Calls `found` for each element, with its name, attributes and text, and for its end with `/` before the
/// name.
fn elements(
    path: &Path,
    text: &[u8],
    mut found: impl FnMut(&str, &Attributes, &str) -> Result<(), Error>,
) -> Result<(), Error> {
    let mut reader = Reader::from_reader(text);
    reader.config_mut().check_end_names = false;
    let wrong = |reason: String| data_error(path, &reason);
    let mut open: Option<(String, Attributes)> = None;
    let mut content = String::new();
    loop {
        let event = reader.read_event().map_err(|error| wrong(error.to_string()))?;
        let begins = matches!(event, Event::Start(_));
        match event {
            Event::Start(start) | Event::Empty(start) => {
                // report a container when its first child begins
                if let Some((name, attributes)) = open.take() {
                    found(&name, &attributes, &content)?;
                }
                content.clear();
                let element = parse_element(path, &start)?;
                if begins {
                    open = Some(element);
                } else {
                    found(&element.0, &element.1, "")?;
                }
            }
            Event::Text(text) => content.push_str(&String::from_utf8_lossy(&text)),
            Event::End(end) => {
                if let Some((name, attributes)) = open.take() {
                    found(&name, &attributes, &content)?;
                }
                let name = end.name();
                found(&format!("/{}", String::from_utf8_lossy(name.as_ref())), &Attributes::new(), "")?;
            }
            Event::Eof => return Ok(()),
            _ => {}
        }
    }
}

fn parse_element(path: &Path, start: &BytesStart) -> Result<(String, Attributes), Error> {
    let name = String::from_utf8_lossy(start.name().as_ref()).into_owned();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let attributes = start
        .attributes()
        .map(|attribute| {
            let attribute = attribute.map_err(|error| data_error(path, &format!("<{name}>: {error}")))?;
            Ok((text(attribute.key.as_ref()), text(&attribute.value)))
        })
        .collect::<Result<_, Error>>()?;
    Ok((name, attributes))
}

impl VtuGrid {
    /// Nodes of a cell.
    pub fn cell_nodes(&self, cell: usize) -> &[u32] {
        let begin = cell.checked_sub(1).map_or(0, |before| self.cells[before].1);
        &self.nodes[begin..self.cells[cell].1]
    }

    /// Reads a grid from several files, including the pieces of `.pvtu`.
    ///
    /// # Errors
    /// [`Error::Data`] for another type of grid, damaged arrays, cells with other nodes than those of the
    /// grid, and a grid without points; [`Error::Shared`] for files that cannot be read.
    pub fn read(files: &[PathBuf]) -> Result<Self, Error> {
        let mut grid = Self::default();
        for file in files {
            if !has_ending(file, "pvtu") {
                grid.add_file(file)?;
                continue;
            }
            let mut pieces = Vec::new();
            elements(file, &read_bytes(file)?, |name, attributes, _| {
                if let ("Piece", Some(source)) = (name, attributes.get("Source")) {
                    pieces.push(beside(file, source));
                }
                Ok(())
            })?;
            if pieces.is_empty() {
                return Err(data_error(file, "found no Piece with a Source; allowed: at least one"));
            }
            pieces.iter().try_for_each(|piece| grid.add_file(piece))?;
        }
        // a part of a parallel run may be empty, but not the whole grid
        let first = files.first().filter(|_| grid.points.is_empty());
        first.map_or(Ok(grid), |path| {
            Err(data_error(path, "found no points; allowed: at least one Piece with Points"))
        })
    }

    fn add_file(&mut self, path: &Path) -> Result<(), Error> {
        let bytes = read_bytes(path)?;
        self.files.push(path.to_owned());
        let wrong = |reason: &str| data_error(path, reason);
        // raw bytes are not XML: the appended data are cut off before parsing
        let at = bytes.windows(13).position(|window| window == b"<AppendedData").unwrap_or(bytes.len());
        let (text, tail) = bytes.split_at(at);
        let begin = tail.iter().position(|&byte| byte == b'_').map_or(tail.len(), |place| place + 1);
        let base64 = !tail[..begin].windows(5).any(|window| window == b"\"raw\"");
        let mut coding =
            ArrayEncoding { path, big: false, header: 4, packed: false, appended: (&tail[begin..], base64) };
        let (grid, mut section) = (self, String::new());
        let mut piece = VtuPiece::default();
        elements(path, text, |name, attributes, content| {
            let attribute = |key: &str| attributes.get(key).map(String::as_str).unwrap_or_default();
            match name {
                "VTKFile" => {
                    if attribute("type") != "UnstructuredGrid" {
                        let found = attribute("type");
                        return Err(wrong(&format!("found type {found:?}; allowed: UnstructuredGrid")));
                    }
                    coding.big = attribute("byte_order") == "BigEndian";
                    coding.header = if attribute("header_type") == "UInt64" { 8 } else { 4 };
                    coding.packed = match attribute("compressor") {
                        "" => false,
                        "vtkZLibDataCompressor" => true,
                        other => {
                            let allowed = "vtkZLibDataCompressor or none";
                            return Err(wrong(&format!("found compressor {other:?}; allowed: {allowed}")));
                        }
                    };
                }
                "Piece" => {
                    let count = |key: &str| attribute(key).parse::<usize>().ok();
                    piece.counts = [count("NumberOfPoints"), count("NumberOfCells")];
                }
                "PointData" | "Points" | "Cells" | "CellData" => section = name.to_owned(),
                "/PointData" | "/Points" | "/Cells" | "/CellData" => section.clear(),
                "DataArray" => {
                    let values = || coding.values(attributes, content);
                    let is_scalar = matches!(attribute("NumberOfComponents"), "" | "1");
                    let integers = attribute("type").contains("Int");
                    let array = || {
                        let name = attribute("Name").to_owned();
                        values().map(|values| VtuArray { name, integers, values })
                    };
                    match (section.as_str(), attribute("Name")) {
                        ("Points", _) => piece.points = values()?,
                        ("Cells", "connectivity") => piece.nodes = values()?,
                        ("Cells", "offsets") => piece.ends = values()?,
                        ("Cells", "types") => piece.kinds = values()?,
                        ("PointData", _) if is_scalar => piece.point_arrays.push(array()?),
                        ("CellData", _) if is_scalar && integers => piece.cell_arrays.push(array()?),
                        _ => {}
                    }
                }
                "/Piece" => grid.add(std::mem::take(&mut piece), path)?,
                _ => {}
            }
            Ok(())
        })?;
        Ok(())
    }

    fn add(&mut self, piece: VtuPiece, path: &Path) -> Result<(), Error> {
        let first = self.points.len();
        self.pieces.push(first);
        piece.check(path)?;
        self.points.extend(piece.points.chunks_exact(3).map(|x| [x[0], x[1], x[2]]));
        let nodes = self.points.len() - first;
        let mut begin = 0;
        for (&end, &kind) in piece.ends.iter().zip(&piece.kinds) {
            let own = piece.nodes.get(begin..end as usize);
            let fits = |&node: &f64| (0.0..nodes as f64).contains(&node);
            let Some(own) = own.filter(|own| own.iter().all(fits)) else {
                let reason = format!(
                    "found a cell that ends at {end} with invalid nodes; allowed: nodes 0 to {}",
                    nodes.max(1) - 1
                );
                return Err(data_error(path, &reason));
            };
            self.nodes.extend(own.iter().map(|&node| first as u32 + node as u32));
            self.cells.push((kind as u8, self.nodes.len()));
            begin = end as usize;
        }
        let cells = self.cells.len() - piece.kinds.len();
        for (own, all) in
            [(piece.point_arrays, &mut self.point_arrays), (piece.cell_arrays, &mut self.cell_arrays)]
        {
            for mut array in own {
                if array.name == GHOST {
                    // pieces without it have no ghosts
                    let known =
                        all.iter().find(|known| known.name == GHOST).map_or(0, |own| own.values.len());
                    array.values.splice(0..0, std::iter::repeat_n(0.0, cells - known));
                }
                match all.iter_mut().find(|known| known.name == array.name) {
                    Some(known) => known.values.extend(array.values),
                    None => all.push(array),
                }
            }
        }
        Ok(())
    }
}
