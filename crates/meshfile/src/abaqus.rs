//! Reads input files of Abaqus and CalculiX (`.inp`): nodes, elements, sets and surfaces.

use std::collections::BTreeMap;
use std::path::Path;

use crate::content::{ElementKind, FileElement, FileNode, MeshFile};
use crate::error::{Error, line_error};
use crate::shape::ElementShape;

mod cards;
mod ignored;
mod instance;
mod sets;

use cards::{Card, Cards};
use ignored::Ignored;
use instance::InstancePosition;
use sets::{FileSet, Resolver, SetEntry, SetKind};

/// Names what replaces a keyword that has no effect on the mesh; `None` lists it among the others.
pub type Advice = fn(keyword: &str) -> Option<&'static str>;

/// Reads a file.
///
/// Supported keywords, in upper or lower case: `*NODE` (`NSET`), `*ELEMENT` (`TYPE`, `ELSET`), `*NSET` and
/// `*ELSET` (`GENERATE`, names of other sets, `*NSET, ELSET=`), `*SURFACE` (of elements, with or without
/// `Sn`, or of nodes), one `*PART` with one `*INSTANCE` (translated and rotated), `*INCLUDE`, continuation
/// lines, comments. Other keywords are skipped: notes name them, with what `advice` says. A name keeps
/// the letter case of its first use.
///
/// # Errors
/// [`Error::Shared`] if the file cannot be read; [`Error::File`] with the line for other elements, numbers
/// that do not fit, sets and nodes that do not exist, and keywords that would change the mesh (`*NGEN`,
/// `*SYSTEM`, …). Memory is bounded by the size of the file.
pub fn read(path: &Path, advice: Advice) -> Result<MeshFile, Error> {
    parse(path, &crate::error::read_bytes(path)?, advice)
}

/// Reads bytes; `path` is for messages only.
///
/// # Errors
/// Errors of [`read`].
pub fn parse(path: &Path, bytes: &[u8], advice: Advice) -> Result<MeshFile, Error> {
    let mut cards = Cards::new(path, bytes);
    mesh(path, &mut cards, advice).map_err(|error| cards.placed(error))
}

fn mesh(path: &Path, cards: &mut Cards, advice: Advice) -> Result<MeshFile, Error> {
    let mut reader = InputReader {
        path,
        content: MeshFile::default(),
        sets: Vec::new(),
        single: BTreeMap::new(),
        place: None,
    };
    let mut ignored = Ignored::default();
    while let Some(card) = cards.next()? {
        match card.keyword.as_str() {
            "NODE" => reader.nodes(&card, cards)?,
            "ELEMENT" => reader.elements(&card, cards)?,
            "NSET" => reader.set(card, SetKind::Nodes, "NSET", cards)?,
            "ELSET" => reader.set(card, SetKind::Elements, "ELSET", cards)?,
            "SURFACE" => reader.surface(card, cards)?,
            "PART" => reader.check_single(&card)?,
            "INSTANCE" => {
                reader.check_single(&card)?;
                reader.place = InstancePosition::read(cards)?.or(reader.place);
            }
            "END PART" | "ASSEMBLY" | "END ASSEMBLY" | "END INSTANCE" | "HEADING" => {}
            keyword if MESH_CHANGING.contains(&keyword) => {
                let allowed = "a file that contains all its nodes and elements itself";
                return Err(line_error(path, card.line, "keyword", format!("*{keyword}"), allowed));
            }
            _ => ignored.add(&card, cards),
        }
    }
    reader.content.included = cards.included();
    if !reader.content.included.is_empty() {
        let count = reader.content.included.len();
        reader.content.notes.push(format!("{count} files are included"));
    }
    ignored.write_notes(advice, &mut reader.content.notes);
    if let Some(place) = &reader.place {
        reader.content.nodes.iter_mut().for_each(|node| node.point = place.transform(node.point));
        reader.content.notes.push("the part is moved to the place of its instance".to_owned());
    }
    let [nodes, elements] = reader.content.labels(path)?;
    let budget = cards.bytes.saturating_mul(16).saturating_add(1 << 16);
    let sets = std::mem::take(&mut reader.sets);
    let is_plane = reader.content.elements.iter().all(|element| element.kind.solid().is_none());
    let mut resolver = Resolver { path, nodes: &nodes, elements: &elements, is_plane, budget };
    resolver.resolve(sets, &mut reader.content)?;
    reader.content.number_nodes(path, &nodes)?;
    Ok(reader.content)
}

/// Keywords that make or move nodes and elements: skipping them would give another mesh.
const MESH_CHANGING: [&str; 10] = [
    "NGEN",
    "NFILL",
    "NCOPY",
    "NMAP",
    "ELGEN",
    "ELCOPY",
    "SYSTEM",
    "ELEMENT RESPONSE",
    "IMPORT",
    "MODEL CHANGE",
];

/// Element kinds by the stems of their names.
const KIND_STEMS: [(ElementKind, &[&str]); 13] = [
    (ElementKind::Solid(ElementShape::Hexahedron), &["C3D8", "DC3D8", "DCC3D8"]),
    (ElementKind::Solid(ElementShape::Tetrahedron), &["C3D4", "DC3D4"]),
    (ElementKind::Solid(ElementShape::Wedge), &["C3D6", "DC3D6"]),
    (ElementKind::Solid(ElementShape::Hexahedron20), &["C3D20", "DC3D20"]),
    (ElementKind::Solid(ElementShape::Tetrahedron10), &["C3D10", "DC3D10"]),
    (ElementKind::Solid(ElementShape::Wedge15), &["C3D15", "DC3D15"]),
    (ElementKind::Quadrangle8, &["S8", "M3D8", "SFM3D8", "DS8", "CPS8", "CPE8", "CAX8", "DC2D8"]),
    (ElementKind::Triangle6, &["STRI65", "M3D6", "SFM3D6", "DS6", "CPS6", "CPE6", "CAX6", "DC2D6"]),
    (ElementKind::Line3, &["T3D3", "T2D3", "B32", "B22", "DC1D3"]),
    (ElementKind::Quadrangle, &["S4", "M3D4", "SFM3D4", "R3D4", "DS4", "CPS4", "CPE4", "CAX4", "DC2D4"]),
    (
        ElementKind::Triangle,
        &["S3", "STRI3", "M3D3", "SFM3D3", "R3D3", "DS3", "CPS3", "CPE3", "CAX3", "DC2D3"],
    ),
    (ElementKind::Line, &["T3D2", "T2D2", "B31", "B21", "DC1D2"]),
    (ElementKind::Point, &["MASS", "HEATCAP"]),
];

/// Returns the kind of an element by its name in upper case: letters after a stem (R, I, H, T, …) denote
/// integration and physics, not nodes.
fn kind_of(name: &str) -> Option<ElementKind> {
    let is = |stem: &&str| {
        name.strip_prefix(stem).is_some_and(|rest| rest.bytes().all(|byte| byte.is_ascii_alphabetic()))
    };
    KIND_STEMS.iter().find(|(_, stems)| stems.iter().any(&is)).map(|(kind, _)| *kind)
}

struct InputReader<'a> {
    path: &'a Path,
    content: MeshFile,
    sets: Vec<FileSet>,
    /// First lines of keywords allowed only once.
    single: BTreeMap<String, usize>,
    /// Position of the instance.
    place: Option<InstancePosition>,
}

impl InputReader<'_> {
    fn nodes(&mut self, card: &Card, cards: &mut Cards) -> Result<(), Error> {
        let first = self.content.nodes.len();
        while let Some(row) = cards.row() {
            let words = row.words();
            let label = row.label(words.first().copied().unwrap_or(""), "number of a node")?;
            let mut point = [0.0; 3];
            for (x, word) in point.iter_mut().zip(words.iter().skip(1)) {
                *x = row.number(word, "coordinate")?;
            }
            // further columns are direction cosines
            if words.len() < 2 {
                return Err(row.error("node", row.text(), "number, x, y, z"));
            }
            self.content.nodes.push(FileNode { label, line: row.line as u32, point });
        }
        if let Some(name) = card.parameter("NSET") {
            let labels = self.content.nodes[first..].iter();
            let entries = labels.map(|node| (node.line as usize, SetEntry::Label(node.label))).collect();
            self.sets.push(FileSet { name: name.to_owned(), kind: SetKind::Nodes, entries });
        }
        Ok(())
    }

    fn elements(&mut self, card: &Card, cards: &mut Cards) -> Result<(), Error> {
        let name = card.parameter("TYPE").unwrap_or("").to_uppercase();
        let Some(kind) = kind_of(&name) else {
            let allowed = "C3D8, C3D4, C3D6, C3D20, C3D10, C3D15, with D before or letters after them or \
                not (DC3D8, C3D20R, …); shells, membranes and trusses only name surfaces";
            return Err(line_error(self.path, card.line, "element type", name, allowed));
        };
        let count = kind.node_count();
        let first = self.content.elements.len();
        while let Some(row) = cards.row() {
            let (line, mut labels) = (row.line, [0u64; 21]);
            let mut filled = 0;
            let mut row = row;
            loop {
                for word in row.words() {
                    if filled > count {
                        return Err(row.error(
                            "nodes of an element",
                            row.text(),
                            format!("{count} for {name}"),
                        ));
                    }
                    labels[filled] = row.label(word, "element or node")?;
                    filled += 1;
                }
                // an open line continues in the next
                let next = if filled <= count && row.is_open() { cards.row() } else { None };
                match next {
                    Some(next) => row = next,
                    None => break,
                }
            }
            if filled <= count {
                let found = filled.saturating_sub(1);
                return Err(row.error("nodes of an element", found, format!("{count} for {name}")));
            }
            let first = self.content.element_labels.len();
            self.content.element_labels.extend_from_slice(&labels[1..=count]);
            self.content.elements.push(FileElement { label: labels[0], line: line as u32, kind, first });
        }
        if let Some(name) = card.parameter("ELSET") {
            let labels = self.content.elements[first..].iter();
            let entries =
                labels.map(|element| (element.line as usize, SetEntry::Label(element.label))).collect();
            self.sets.push(FileSet { name: name.to_owned(), kind: SetKind::Elements, entries });
        }
        Ok(())
    }

    fn set(&mut self, card: Card, kind: SetKind, key: &'static str, cards: &mut Cards) -> Result<(), Error> {
        let Some(name) = card.parameter(key) else {
            let allowed = format!("*{key}, {key}=NAME");
            return Err(line_error(self.path, card.line, "name of a set", "", allowed));
        };
        let mut entries = Vec::new();
        let mut kind = kind;
        if let (SetKind::Nodes, Some(elements)) = (kind, card.parameter("ELSET")) {
            kind = SetKind::NodesOfElements;
            entries.push((card.line, SetEntry::Set(elements.to_owned())));
        }
        let generate = card.parameter("GENERATE").is_some();
        while let Some(row) = cards.row() {
            let words = row.words();
            if generate {
                let mut range = [0, 0, 1];
                if !(2..=3).contains(&words.len()) {
                    return Err(row.error("range", row.text(), "first, last, step"));
                }
                for (number, word) in range.iter_mut().zip(&words) {
                    *number = row.label(word, "range")?;
                }
                if range[2] == 0 || range[0] > range[1] {
                    return Err(row.error("range", row.text(), "first ≤ last, step 1 or more"));
                }
                entries.push((row.line, SetEntry::Range(range)));
            } else {
                entries.extend(words.iter().map(|word| (row.line, SetEntry::parse(word))));
            }
        }
        self.sets.push(FileSet { name: name.to_owned(), kind, entries });
        Ok(())
    }

    fn surface(&mut self, card: Card, cards: &mut Cards) -> Result<(), Error> {
        let Some(name) = card.parameter("NAME") else {
            return Err(line_error(self.path, card.line, "name of a surface", "", "*SURFACE, NAME=NAME"));
        };
        let kind = card.parameter("TYPE").unwrap_or("ELEMENT").to_uppercase();
        let nodes = match kind.as_str() {
            "ELEMENT" => false,
            "NODE" => true,
            _ => return Err(line_error(self.path, card.line, "type of a surface", kind, "ELEMENT, NODE")),
        };
        let mut entries = Vec::new();
        while let Some(row) = cards.row() {
            let words = row.words();
            let Some(first) = words.first() else { continue };
            if nodes {
                // the second column is an area
                entries.push((row.line, SetEntry::parse(first)));
                continue;
            }
            let side = words.get(1).map_or("", |word| *word).to_uppercase();
            let side = match side.strip_prefix('S').map(str::parse::<u8>) {
                None if side.is_empty() => None,
                Some(Ok(number @ 1..=6)) => Some(number - 1),
                _ => {
                    return Err(row.error(
                        "side",
                        side,
                        "S1 … S6 of hexahedra, S1 … S4 of tetrahedra and quadrangles, S1 … S5 of wedges, \
                            S1 … S3 of triangles, or none",
                    ));
                }
            };
            entries.push((row.line, SetEntry::Side(Box::new(SetEntry::parse(first)), side)));
        }
        let kind = if nodes { SetKind::Nodes } else { SetKind::Faces };
        self.sets.push(FileSet { name: name.to_owned(), kind, entries });
        Ok(())
    }

    /// Checks that there is one part with one instance, so that numbers are unique.
    fn check_single(&mut self, card: &Card) -> Result<(), Error> {
        let Some(line) = self.single.insert(card.keyword.clone(), card.line) else { return Ok(()) };
        let allowed = "one: write the deck without parts and assemblies (Abaqus/CAE: Model, Edit Attributes)";
        let found = format!("*{}, after that of line {line}", card.keyword);
        Err(line_error(self.path, card.line, "keyword", found, allowed))
    }
}
