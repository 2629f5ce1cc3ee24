//! Writes a mesh as CalculiX and Abaqus read it.

use std::io::{self, Write};

use crate::mesh::Mesh;

/// Writes nodes, elements, sets and surfaces, numbers counted from 1, coordinates so that they are read back to the last
/// bit. `diffusive` elements are DC3D8 and DC3D4 (Abaqus), otherwise C3D8 and C3D4 (CalculiX takes both, structural ones
/// for `*HEAT TRANSFER` too). Names with spaces or commas are written with underscores.
///
/// # Errors
/// Of the writer.
pub fn write(mesh: &Mesh, diffusive: bool, to: &mut impl Write) -> io::Result<()> {
    writeln!(to, "*NODE")?;
    for (number, [x, y, z]) in (1u32..).zip(&mesh.points) {
        writeln!(to, "{number},{x:e},{y:e},{z:e}")?;
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

/// Twelve to a line: CalculiX takes sixteen.
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
