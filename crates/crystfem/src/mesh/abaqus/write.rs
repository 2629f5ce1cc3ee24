//! Writes a mesh in the format of CalculiX and Abaqus.

use std::io::{self, Write};

use crate::mesh::Mesh;

/// Width of a number in characters; CalculiX reads the first twenty.
const WIDTH: usize = 20;

/// Writes nodes, elements, sets and surfaces, numbered from 1. Coordinates keep all bits if twenty characters
/// suffice, otherwise 1e-12. `diffusive` elements are DC3D8, DC3D4, … (Abaqus), others C3D8, C3D4, …
/// (CalculiX accepts both, structural ones for `*HEAT TRANSFER` too). Spaces and commas in names become
/// underscores.
///
/// # Errors
/// Errors of the writer.
pub fn write(mesh: &Mesh, diffusive: bool, to: &mut impl Write) -> io::Result<()> {
    writeln!(to, "*NODE")?;
    for (number, [x, y, z]) in (1u32..).zip(&mesh.points) {
        let [x, y, z] = [x, y, z].map(|x| coordinate(*x));
        writeln!(to, "{number},{x},{y},{z}")?;
    }
    let prefix = if diffusive { "D" } else { "" };
    let mut number = 1u32;
    if !mesh.hexahedra.is_empty() {
        writeln!(to, "*ELEMENT,TYPE={prefix}C3D8")?;
        for [a, b, c, d, e, f, g, h] in mesh.hexahedra.iter().map(|nodes| nodes.map(|node| node + 1)) {
            writeln!(to, "{number},{a},{b},{c},{d},{e},{f},{g},{h}")?;
            number += 1;
        }
    }
    if !mesh.tetrahedra.is_empty() {
        writeln!(to, "*ELEMENT,TYPE={prefix}C3D4")?;
        for [a, b, c, d] in mesh.tetrahedra.iter().map(|nodes| nodes.map(|node| node + 1)) {
            writeln!(to, "{number},{a},{b},{c},{d}")?;
            number += 1;
        }
    }
    for same in mesh.others.chunk_by(|a, b| a.shape == b.shape) {
        let kind = same.first().map_or("", |cell| cell.shape.abaqus());
        writeln!(to, "*ELEMENT,TYPE={prefix}{kind}")?;
        for cell in same {
            let words: Vec<String> = cell.nodes().iter().map(|node| (node + 1).to_string()).collect();
            // at most sixteen numbers to a line
            let lines: Vec<String> = words.chunks(15).map(|line| line.join(",")).collect();
            writeln!(to, "{number},{}", lines.join(",\n"))?;
            number += 1;
        }
    }
    for (name, set) in &mesh.node_sets {
        writeln!(to, "*NSET,NSET={}", plain(name))?;
        numbers(set, to)?;
    }
    for (name, set) in &mesh.element_sets {
        writeln!(to, "*ELSET,ELSET={}", plain(name))?;
        numbers(set, to)?;
    }
    for (name, faces) in &mesh.surfaces {
        writeln!(to, "*SURFACE,NAME={},TYPE=ELEMENT", plain(name))?;
        for face in faces {
            writeln!(to, "{},S{}", face.element + 1, face.side + 1)?;
        }
    }
    Ok(())
}

/// Formats a number in at most [`WIDTH`] characters.
fn coordinate(x: f64) -> String {
    let short = format!("{x:e}");
    let plain = format!("{x}").replacen("0.", ".", usize::from(x.abs() < 1.0));
    let rounded = (12..17).rev().map(|digits| format!("{x:.digits$e}"));
    let all = [short, plain].into_iter().chain(rounded);
    all.min_by_key(|text| text.len().saturating_sub(WIDTH)).unwrap_or_default()
}

/// Writes twelve numbers a line; CalculiX accepts sixteen.
fn numbers(set: &[u32], to: &mut impl Write) -> io::Result<()> {
    for line in set.chunks(12) {
        let words: Vec<String> = line.iter().map(|number| (number + 1).to_string()).collect();
        writeln!(to, "{},", words.join(","))?;
    }
    Ok(())
}

fn plain(name: &str) -> String {
    name.replace(|c: char| c.is_whitespace() || ",=*\"".contains(c), "_")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_fit_calculix() {
        for x in
            [0.0, -0.0, 1.0, 0.02 / 13.0, -0.02 / 13.0, 1.0 / 3.0, -1e-7 / 3.0, 1e300 / 7.0, -1e-300 / 7.0]
        {
            let text = coordinate(x);
            assert!(text.len() <= WIDTH, "{text}");
            let read: f64 = text.parse().unwrap();
            assert!((read - x).abs() <= 1e-12 * x.abs() && (x == 0.0 || read != 0.0), "{text}, {x}");
        }
        assert_eq!(coordinate(0.02 / 13.0), ".0015384615384615385");
        assert_eq!(coordinate(-0.25), "-2.5e-1");
    }
}
