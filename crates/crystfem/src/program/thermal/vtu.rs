//! VTK XML files: unstructured grids (`.vtu`), parallel grids (`.pvtu`) and series (`.pvd`), with text,
//! base64 or raw arrays, compressed by zlib or not.
//!
//! Format: <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>. `vtkio` 0.7 panics on
//! damaged files.

use super::{Analysis, CellsByDimension, ThermalFrame, choose_array, data_error};
use crate::error::Error;
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};

type Attributes = HashMap<String, String>;

/// Opens a grid, at t = 0, or a series of grids with the same nodes. Files of the same time are parts of one
/// grid.
pub fn open(path: &Path, array: Option<&str>) -> Result<Analysis, Error> {
    let files = if has_ending(path, "pvd") { series(path)? } else { vec![(0.0, vec![path.to_path_buf()])] };
    let Some((_, first)) = files.first() else {
        return Err(data_error(path, "found no DataSet; allowed: at least one"));
    };
    let VtuGrid { points, cells, scalars } = VtuGrid::from_files(first)?;
    let first = first.first().map_or(path, PathBuf::as_path);
    let allowed = "lines, triangles, quadrilaterals, tetrahedra, pyramids, wedges, hexahedra";
    let Some(cells) = cells.highest() else {
        return Err(data_error(first, &format!("found no elements; allowed: {allowed}")));
    };
    let names: Vec<String> = scalars.into_iter().map(|(name, _)| name).collect();
    let name = choose_array(first, &names, array)?.to_owned();
    let nodes = points.len();
    if let Some(missing) = files.iter().flat_map(|(_, parts)| parts).find(|file| !file.is_file()) {
        return Err(data_error(path, &format!("refers to {}, which does not exist", missing.display())));
    }
    let frames = files.into_iter().map(move |(time, parts)| {
        let mut scalars = VtuGrid::from_files(&parts)?.scalars;
        let index = scalars.iter().position(|(own, _)| *own == name);
        let temperature = index.map(|index| scalars.swap_remove(index).1).unwrap_or_default();
        if temperature.len() != nodes {
            let found = format!("found {} values of `{name}`", temperature.len());
            let path = parts.first().map_or(Path::new(""), PathBuf::as_path);
            return Err(data_error(
                path,
                &format!("{found}; allowed: {nodes}, one per node of the first time"),
            ));
        }
        Ok(ThermalFrame { time, temperature })
    });
    Ok(Analysis { points, cells, frames: Box::new(frames) })
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending))
}

/// Returns the path of a file that is named in another file, relative to it.
fn beside(path: &Path, name: &str) -> PathBuf {
    path.with_file_name(name.replace('\\', "/"))
}

/// Reads times and files of a series.
fn series(path: &Path) -> Result<Vec<(f64, Vec<PathBuf>)>, Error> {
    let text = std::fs::read_to_string(path).map_err(polycore::Error::from_io("read", path))?;
    let mut files: Vec<(f64, Vec<PathBuf>)> = Vec::new();
    elements(path, text.as_bytes(), |name, attributes, _| {
        if name == "DataSet" {
            let number = attributes.get("timestep").and_then(|time| time.parse::<f64>().ok());
            let (Some(time), Some(file)) = (number, attributes.get("file")) else {
                return Err(data_error(
                    path,
                    "found a DataSet without them; allowed: `timestep`, a number, and `file`",
                ));
            };
            match files.iter_mut().find(|(other, _)| *other == time) {
                Some((_, parts)) => parts.push(beside(path, file)),
                None => files.push((time, vec![beside(path, file)])),
            }
        }
        Ok(())
    })?;
    Ok(files)
}

/// Calls `found` for each element, with its attributes and text.
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

/// A grid of one or several pieces.
#[derive(Default)]
struct VtuGrid {
    points: Vec<[f64; 3]>,
    cells: CellsByDimension,
    /// Names and nodal values.
    scalars: Vec<(String, Vec<f64>)>,
}

/// Encoding of the arrays of a file.
struct ArrayEncoding<'a> {
    path: &'a Path,
    big: bool,
    /// Bytes of a number in an array header.
    header: usize,
    packed: bool,
    /// Bytes after the `_` of the appended data, and a flag for base64.
    appended: (&'a [u8], bool),
}

impl VtuGrid {
    /// Reads a grid from several files, including the files of `.pvtu`. Nodes shared by parts are repeated.
    fn from_files(files: &[PathBuf]) -> Result<Self, Error> {
        let mut grid = Self::default();
        for file in files {
            if !has_ending(file, "pvtu") {
                grid.read(file)?;
                continue;
            }
            let text = std::fs::read_to_string(file).map_err(polycore::Error::from_io("read", file))?;
            let mut pieces = Vec::new();
            elements(file, text.as_bytes(), |name, attributes, _| {
                if let ("Piece", Some(source)) = (name, attributes.get("Source")) {
                    pieces.push(beside(file, source));
                }
                Ok(())
            })?;
            if pieces.is_empty() {
                return Err(data_error(file, "found no Piece with a Source; allowed: at least one"));
            }
            pieces.iter().try_for_each(|piece| grid.read(piece))?;
        }
        // a part of a parallel run may be empty, but not the whole grid
        let first = files.first().filter(|_| grid.points.is_empty());
        first.map_or(Ok(grid), |path| {
            Err(data_error(path, "found no points; allowed: at least one Piece with Points"))
        })
    }

    fn read(&mut self, path: &Path) -> Result<(), Error> {
        let bytes = std::fs::read(path).map_err(polycore::Error::from_io("read", path))?;
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
                "PointData" | "Points" | "Cells" | "CellData" => section = name.to_owned(),
                "/PointData" | "/Points" | "/Cells" | "/CellData" => section.clear(),
                "DataArray" => {
                    let values = || coding.values(attributes, content);
                    match (section.as_str(), attribute("Name")) {
                        ("Points", _) => piece.points = values()?,
                        ("Cells", "connectivity") => piece.nodes = values()?,
                        ("Cells", "offsets") => piece.ends = values()?,
                        ("Cells", "types") => piece.kinds = values()?,
                        ("PointData", own) if matches!(attribute("NumberOfComponents"), "" | "1") => {
                            piece.scalars.push((own.to_owned(), values()?));
                        }
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
            let own: Vec<u32> = own.iter().map(|&node| first as u32 + node as u32).collect();
            self.cells.push(kind as u64, &own);
            begin = end as usize;
        }
        for (name, values) in piece.scalars {
            match self.scalars.iter_mut().find(|(own, _)| *own == name) {
                Some((_, all)) => all.extend(values),
                None => self.scalars.push((name, values)),
            }
        }
        Ok(())
    }
}

#[derive(Default)]
struct VtuPiece {
    points: Vec<f64>,
    nodes: Vec<f64>,
    ends: Vec<f64>,
    kinds: Vec<f64>,
    scalars: Vec<(String, Vec<f64>)>,
}

impl ArrayEncoding<'_> {
    fn wrong(&self, attributes: &Attributes, reason: &str) -> Error {
        let name = attributes.get("Name").map(String::as_str).unwrap_or_default();
        data_error(self.path, &format!("array `{name}`: {reason}"))
    }

    fn values(&self, attributes: &Attributes, content: &str) -> Result<Vec<f64>, Error> {
        let wrong = |reason: &str| self.wrong(attributes, reason);
        let attribute = |key: &str| attributes.get(key).map(String::as_str).unwrap_or_default();
        let bytes = match attribute("format") {
            "ascii" => {
                let number = |word: &str| {
                    word.parse().map_err(|_| wrong(&format!("found {word:?}; allowed: a number")))
                };
                return content.split_ascii_whitespace().map(number).collect();
            }
            "binary" => self.block(content.trim().as_bytes(), true),
            "appended" => {
                let offset: Option<usize> = attribute("offset").parse().ok();
                let from = offset.and_then(|offset| self.appended.0.get(offset..));
                from.and_then(|from| self.block(from, self.appended.1))
            }
            other => {
                return Err(wrong(&format!("found format {other:?}; allowed: ascii, binary, appended")));
            }
        };
        let Some(bytes) = bytes else {
            return Err(wrong("damaged or truncated"));
        };
        let kind = attribute("type");
        numbers(&bytes, kind, self.big)
            .ok_or_else(|| wrong(&format!("found type {kind:?}; allowed: Int8 … UInt64, Float32, Float64")))
    }

    /// Decodes a block of bytes after its header.
    fn block(&self, data: &[u8], base64: bool) -> Option<Vec<u8>> {
        let digits = |bytes: usize| if base64 { bytes.div_ceil(3).checked_mul(4) } else { Some(bytes) };
        // compressed arrays encode header and data separately
        let cut = |from: usize, bytes: usize| -> Option<Vec<u8>> {
            let part = data.get(from..from.checked_add(digits(bytes)?)?)?;
            let mut all = if base64 { BASE64_STANDARD.decode(part).ok()? } else { part.to_vec() };
            (all.len() >= bytes).then(|| all.truncate(bytes))?;
            Some(all)
        };
        let sizes = |bytes: &[u8]| -> Vec<usize> {
            let size = |bytes: &[u8]| {
                let fold = |size: usize, byte: &u8| size << 8 | usize::from(*byte);
                if self.big { bytes.iter().fold(0, fold) } else { bytes.iter().rev().fold(0, fold) }
            };
            bytes.chunks_exact(self.header).map(size).collect()
        };
        if !self.packed {
            let size = *sizes(&cut(0, self.header)?).first()?;
            return Some(cut(0, self.header.checked_add(size)?)?.split_off(self.header));
        }
        let blocks = *sizes(&cut(0, self.header)?).first()?;
        let header = blocks.checked_add(3)?.checked_mul(self.header)?;
        let sizes = sizes(&cut(0, header)?);
        let packed =
            cut(digits(header)?, sizes[3..].iter().try_fold(0usize, |sum, &size| sum.checked_add(size))?)?;
        let (mut rest, mut all) = (packed.as_slice(), Vec::new());
        for (block, &size) in sizes[3..].iter().enumerate() {
            let (own, behind) = rest.split_at(size);
            let whole = if block + 1 == blocks && sizes[2] > 0 { sizes[2] } else { sizes[1] };
            let before = all.len();
            flate2::read::ZlibDecoder::new(own).take(whole as u64).read_to_end(&mut all).ok()?;
            (all.len() - before == whole).then_some(())?;
            rest = behind;
        }
        Some(all)
    }
}

pub(super) fn numbers(bytes: &[u8], kind: &str, big: bool) -> Option<Vec<f64>> {
    fn convert<const N: usize>(bytes: &[u8], big: bool, number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
        let value = |chunk: &[u8]| {
            let mut own = [0; N];
            own.copy_from_slice(chunk);
            if big {
                own.reverse();
            }
            number(own)
        };
        bytes.chunks_exact(N).map(value).collect()
    }
    Some(match kind {
        "Int8" => convert(bytes, big, |own| f64::from(i8::from_le_bytes(own))),
        "UInt8" => convert(bytes, big, |own| f64::from(u8::from_le_bytes(own))),
        "Int16" => convert(bytes, big, |own| f64::from(i16::from_le_bytes(own))),
        "UInt16" => convert(bytes, big, |own| f64::from(u16::from_le_bytes(own))),
        "Int32" => convert(bytes, big, |own| f64::from(i32::from_le_bytes(own))),
        "UInt32" => convert(bytes, big, |own| f64::from(u32::from_le_bytes(own))),
        "Int64" => convert(bytes, big, |own| i64::from_le_bytes(own) as f64),
        "UInt64" => convert(bytes, big, |own| u64::from_le_bytes(own) as f64),
        "Float32" => convert(bytes, big, |own| f64::from(f32::from_le_bytes(own))),
        "Float64" => convert(bytes, big, f64::from_le_bytes),
        _ => return None,
    })
}
