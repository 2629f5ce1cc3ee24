//! Results of CalculiX, ASCII `.frd`: nodes, elements, and nodal temperatures over time.
//!
//! Columns are fixed (CalculiX GraphiX manual, "Result Format"): a data line begins with −1 in three columns,
//! followed by a number in ten columns and numbers in twelve columns each.

use super::{Analysis, CellsByDimension, ThermalFrame};
use crate::error::Error;
use harness::output::vtkhdf::Cells;
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// Element type of CalculiX, number of corners, and cell type of VTK.
const SHAPES: [(u32, usize, u64); 12] = [
    (1, 8, 12),
    (4, 8, 12),
    (3, 4, 10),
    (6, 4, 10),
    (2, 6, 13),
    (5, 6, 13),
    (7, 3, 5),
    (8, 3, 5),
    (9, 4, 9),
    (10, 4, 9),
    (11, 2, 3),
    (12, 2, 3),
];

/// Opens a file and reads its mesh.
pub fn open(path: &Path) -> Result<Analysis, Error> {
    let mut frd = Frd::open(path)?;
    let (points, cells) = (std::mem::take(&mut frd.points), std::mem::take(&mut frd.cells));
    Ok(Analysis { points, cells, frames: Box::new(std::iter::from_fn(move || frd.frame().transpose())) })
}

/// A file during reading.
struct Frd {
    path: PathBuf,
    lines: std::io::Lines<BufReader<File>>,
    line: usize,
    /// Positions of the nodes, in file order.
    points: Vec<[f64; 3]>,
    /// Elements of the highest dimension, by their corners.
    cells: Cells,
    places: HashMap<u32, u32>,
}

impl Frd {
    /// Opens a file and reads its mesh.
    ///
    /// # Errors
    /// Returns [`Error::File`] for invalid files, and I/O errors.
    fn open(path: &Path) -> Result<Self, Error> {
        let file = File::open(path).map_err(polycore::Error::from_io("read", path))?;
        let mut frd = Self {
            path: path.to_path_buf(),
            lines: BufReader::new(file).lines(),
            line: 0,
            points: Vec::new(),
            cells: Cells::default(),
            places: HashMap::new(),
        };
        loop {
            let Some(line) = frd.next()? else {
                return Err(frd.wrong("mesh", "the end of the file", "blocks 2C (nodes) and 3C (elements)"));
            };
            match line.get(..6).map(str::trim) {
                Some("2C") => frd.nodes()?,
                Some("3C") => {
                    frd.elements()?;
                    return Ok(frd);
                }
                _ => {}
            }
        }
    }

    fn next(&mut self) -> Result<Option<String>, Error> {
        self.line += 1;
        let path = &self.path;
        let line = self.lines.next().transpose().map_err(|error| {
            let allowed = "text, as CalculiX writes it (cgx also writes binary files)";
            file(path, self.line, "line", error.to_string(), allowed)
        })?;
        Ok(line)
    }

    fn wrong(&self, what: &str, found: &str, allowed: &str) -> Error {
        file(&self.path, self.line, what, found.trim().to_owned(), allowed)
    }

    /// Reads the next data line of a block; `None` at its end.
    fn data(&mut self, what: &str) -> Result<Option<String>, Error> {
        match self.next()? {
            Some(line) if line.starts_with(" -3") => Ok(None),
            Some(line) => Ok(Some(line)),
            None => Err(self.wrong(what, "the end of the file", "a line ` -3` at the end of the block")),
        }
    }

    fn number<T: std::str::FromStr>(
        &self,
        line: &str,
        columns: std::ops::Range<usize>,
        what: &str,
    ) -> Result<T, Error> {
        let text = line.get(columns.start..columns.end.min(line.len())).unwrap_or_default();
        text.trim().parse().map_err(|_| self.wrong(what, text, "a number"))
    }

    fn real(&self, line: &str, columns: std::ops::Range<usize>, what: &str) -> Result<f64, Error> {
        let value: f64 = self.number(line, columns, what)?;
        if value.is_finite() {
            Ok(value)
        } else {
            Err(self.wrong(what, &value.to_string(), "a finite number"))
        }
    }

    fn nodes(&mut self) -> Result<(), Error> {
        while let Some(line) = self.data("nodes")? {
            let number = self.number(&line, 3..13, "node")?;
            let mut point = [0.0; 3];
            for (axis, x) in point.iter_mut().enumerate() {
                *x = self.real(&line, 13 + 12 * axis..25 + 12 * axis, "coordinate")?;
            }
            if self.places.insert(number, self.points.len() as u32).is_some() {
                return Err(self.wrong("node", &number.to_string(), "each node once"));
            }
            self.points.push(point);
        }
        Ok(())
    }

    fn elements(&mut self) -> Result<(), Error> {
        let (mut kind, mut wanted, mut own) = (0, 0, Vec::new());
        let mut cells = CellsByDimension::default();
        while let Some(line) = self.data("elements")? {
            if line.starts_with(" -1") {
                let number: u32 = self.number(&line, 13..18, "type of element")?;
                (wanted, kind) = SHAPES
                    .iter()
                    .find(|(code, ..)| *code == number)
                    .map_or((0, 0), |&(_, corners, vtk)| (corners, vtk));
                own.clear();
                continue;
            }
            let mut column = 3;
            while own.len() < wanted && column < line.len() {
                let node: u32 = self.number(&line, column..column + 10, "node of an element")?;
                let Some(place) = self.places.get(&node) else {
                    return Err(self.wrong("node of an element", &node.to_string(), "a node of block 2C"));
                };
                own.push(*place);
                column += 10;
            }
            if wanted > 0 && own.len() == wanted {
                cells.push(kind, &own);
                wanted = 0;
            }
        }
        let missing = || self.wrong("elements", "none", "solids, shells or beams");
        self.cells = cells.highest().ok_or_else(missing)?;
        Ok(())
    }

    /// Reads the next temperatures and skips other results; `None` at the end of the file.
    ///
    /// # Errors
    /// Returns [`Error::File`] for truncated blocks, nodes without a temperature, and invalid numbers.
    fn frame(&mut self) -> Result<Option<ThermalFrame>, Error> {
        let mut time = f64::NAN;
        while let Some(line) = self.next()? {
            if line.trim_start().starts_with("100C") {
                time = self.real(&line, 12..24, "time")?;
            } else if line.starts_with(" -4  NDTEMP") {
                let mut temperature = vec![f64::NAN; self.places.len()];
                while let Some(line) = self.data("temperatures")? {
                    if !line.starts_with(" -1") {
                        continue;
                    }
                    let node: u32 = self.number(&line, 3..13, "node")?;
                    let Some(place) = self.places.get(&node) else {
                        return Err(self.wrong("node", &node.to_string(), "a node of block 2C"));
                    };
                    temperature[*place as usize] = self.real(&line, 13..25, "temperature")?;
                }
                if let Some(place) = temperature.iter().position(|value| value.is_nan()) {
                    let node = self.places.iter().find(|(_, other)| **other as usize == place);
                    let node = node.map_or(0, |(node, _)| *node).to_string();
                    return Err(self.wrong("node without a temperature", &node, "`NT` for all nodes"));
                }
                return Ok(Some(ThermalFrame { time, temperature }));
            }
        }
        Ok(None)
    }
}

fn file(path: &Path, line: usize, what: &str, found: String, allowed: &str) -> Error {
    Error::File { path: path.to_path_buf(), line, what: what.to_owned(), found, allowed: allowed.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "    1C
    2C                             5                                     1
 -1         1 0.00000E+00 0.00000E+00 0.00000E+00
 -1         2 1.00000E+00 0.00000E+00 0.00000E+00
 -1         3 0.00000E+00 1.00000E+00 0.00000E+00
 -1         7 0.00000E+00 0.00000E+00 1.00000E+00
 -1         8 0.00000E+00 0.00000E+00-1.00000E+00
 -3
    3C                             2                                     1
 -1         1    3    0    1
 -2         1         2         3         7
 -1         2   11    0    1
 -2         1         8
 -3
    1PSTEP                         1           2           1
  100CL  101 6.000000000           5                     1    1           1
 -4  NDTEMP      1    1
 -5  T           1    1    0    0
 -1         1 4.72150E+02
 -1         2 4.72160E+02
 -1         3 4.72170E+02
 -1         7 4.72180E+02
 -1         8-1.00000E+02
 -3
 9999
";

    fn read(text: &str) -> Result<(Frd, Vec<ThermalFrame>), Error> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.frd");
        std::fs::write(&path, text).unwrap();
        let mut frd = Frd::open(&path)?;
        let mut frames = Vec::new();
        while let Some(frame) = frd.frame()? {
            frames.push(frame);
        }
        Ok((frd, frames))
    }

    #[test]
    fn nodes_elements_temperatures() {
        let (frd, frames) = read(GOOD).unwrap();
        assert_eq!((frd.points.len(), frd.points[3]), (5, [0.0, 0.0, 1.0]));
        assert_eq!(
            (frd.cells.types.as_slice(), frd.cells.connectivity.as_slice()),
            (&[10][..], &[0, 1, 2, 3][..])
        );
        assert_eq!((frames.len(), frames[0].time), (1, 6.0));
        assert_eq!(frames[0].temperature, [472.15, 472.16, 472.17, 472.18, -100.0]);
    }

    /// Shells form the mesh if there are no solids, beams if there are no shells.
    #[test]
    fn shells_and_beams() {
        let shells = GOOD.replace(
            " -1         1    3    0    1\n -2         1         2         3         7",
            " -1         1    7    0    1\n -2         1         2         3",
        );
        let (frd, frames) = read(&shells).unwrap();
        assert_eq!(
            (frd.cells.types.as_slice(), frd.cells.connectivity.as_slice()),
            (&[5][..], &[0, 1, 2][..])
        );
        assert_eq!(frames[0].temperature.len(), 5);
        let beams = shells.replace(
            "    7    0    1\n -2         1         2         3",
            "   11    0    1\n -2         1         2",
        );
        let (frd, _) = read(&beams).unwrap();
        assert_eq!(
            (frd.cells.types.as_slice(), frd.cells.connectivity.as_slice()),
            (&[3, 3][..], &[0, 1, 0, 4][..])
        );
        let none =
            GOOD.replace("    3    0    1", "   99    0    1").replace("   11    0    1", "   99    0    1");
        assert!(read(&none).err().unwrap().to_string().contains("solids, shells or beams"));
    }

    /// A truncated or altered file gives an error with a line, or fewer results, but no panic.
    #[test]
    fn damaged_files() {
        let lines: Vec<&str> = GOOD.lines().collect();
        for end in 0..lines.len() {
            if let Err(error) = read(&lines[..end].join("\n")) {
                assert!(error.to_string().contains("allowed"), "{error}");
            }
        }
        for (from, to) in [
            ("E+00 1.0", "E+00 x.0"),
            ("         7 4.7", "         9 4.7"),
            ("        7\n", "        9\n"),
            (" -1         8-1.00000E+02\n", ""),
            ("4.72160E+02", "NaN"),
        ] {
            let text = GOOD.replace(from, to);
            assert!(
                text != GOOD && read(&text).err().is_some_and(|error| error.to_string().contains("allowed")),
                "{from}"
            );
        }
        assert!(read("").is_err() && read("\u{e9}\u{e9}\u{e9}\u{e9}\u{e9}\u{e9}\u{e9}").is_err());
    }
}
