use super::*;
use crate::mesh::Face;
use crate::mesh::surface::area;
use crate::mesh::{Bar, Block, Grid, Mesh, Split, Substrate};

fn fixture(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

fn parsed(text: &str) -> ReadMesh {
    parse(Path::new("a.inp"), text.as_bytes(), 1.0).unwrap()
}

fn refused(text: &str, words: &[&str]) {
    let error = parse(Path::new("a.inp"), text.as_bytes(), 1.0).unwrap_err().to_string();
    assert!(words.iter().all(|word| error.contains(word)), "{error}");
}

/// Two boxes of 3 × 1 × 1, one on the other, written by Gmsh 4.15, groups of surfaces as plane elements.
#[test]
fn meshes_written_by_gmsh() {
    for name in ["hexes.inp", "tets.inp"] {
        let read = read(&fixture(name), 1e-3).unwrap();
        let mesh = &read.mesh;
        assert!((read.quality.volume / 6e-9 - 1.0).abs() < 1e-12, "{name}");
        for surface in ["bottom", "interface", "Surface5"] {
            let total: f64 = mesh.surfaces[surface].iter().map(|face| area(mesh, *face)).sum();
            assert!((total / 3e-6 - 1.0).abs() < 1e-12, "{name} {surface}");
        }
        assert_eq!(mesh.element_sets["printed_bar"], mesh.element_sets["Volume2"]);
        assert_eq!(read.notes.len(), 2, "{:?}", read.notes);
        assert!(read.notes[1].contains("element set `edge` contains no"), "{:?}", read.notes);
    }
}

/// A cube and a pyramid of two tetrahedra on its side x = 1, height 2/3, written by meshio 5.3.
#[test]
fn a_mesh_written_by_meshio() {
    let read = read(&fixture("meshio.inp"), 1.0).unwrap();
    assert_eq!((read.mesh.hexahedra.len(), read.mesh.tetrahedra.len()), (1, 2));
    assert!((read.quality.volume - (1.0 + 2.0 / 9.0)).abs() < 1e-15);
    // quadrangle against two triangles
    assert!(read.notes.iter().any(|note| note.contains("a side of hexahedron 1")), "{:?}", read.notes);
}

#[test]
fn what_is_written_is_read_back() {
    let bar = Bar {
        size: [0.02, 0.004],
        layers: 2,
        layer_height: 2e-4,
        elements_per_layer: 1,
        element_size: 2e-3,
        substrate: Some(Substrate { size: [0.03, 0.01], thickness: 1e-3, growth: 1.7 }),
        cells: Split::Hexahedra,
    };
    let block = Block { name: "brick".into(), lower: [0.0; 3], upper: [1.0; 3] };
    let grid = Grid::uniform([0.0; 3], [1.0; 3], [3, 2, 2]).unwrap();
    let mut both = Grid::uniform([0.0; 3], [1.0; 3], [1, 1, 1]).unwrap().mesh("brick").unwrap();
    both.points.push([5.0 / 3.0, 0.5, 0.5]);
    both.tetrahedra.extend([[1, 3, 5, 8], [3, 7, 5, 8]]);
    for mesh in [bar.mesh().unwrap(), grid.blocks(&[block], Split::FiveTetrahedra).unwrap(), both] {
        for diffusive in [false, true] {
            let mut text = Vec::new();
            write(&mesh, diffusive, &mut text).unwrap();
            let mut read = parse(Path::new("a.inp"), &text, 1.0).unwrap();
            for (found, written) in read.mesh.points.iter_mut().flatten().zip(mesh.points.iter().flatten()) {
                // numbers of twenty letters
                assert!((*found - written).abs() <= 1e-12 * written.abs(), "{found}, {written}");
                *found = *written;
            }
            assert!(read.mesh == mesh);
        }
    }
}

const BRICK: &str = "*Heading\nby hand\n** a comment\n*Part, name=P\n*Node, nset=All\n1, 0., 0., 0.\n2, 1.0D0\n3, 1., 1.\n\
     4, 0, 1\n5, 0,0,1\n6, 1,0,1\n7, 1,1,1\n8, 0,1,1\n\n*ELEMENT, TYPE=dc3d8,\n ELSET=Bricks\n\
     10, 1, 2, 3, 4,\n 5, 6, 7, 8\n*End Part\n*Assembly\n*Instance, name=I, part=P\n*End Instance\n\
     *Nset, nset=low, generate\n1, 4\n*nset, NSET=LOW\n5,\n*Nset, nset=odd, generate\n1, 100000000000, 2\n\
     *Nset, nset=mixed\nlow, 8\n*Nset, nset=of, elset=bricks\n*Elset, elset=again, instance=I\nBRICKS, 10\n\
     *Surface, type=ELEMENT, name=top\nI.again, S2\n*Surface, name=skin\n10,\n*Surface, name=dots, type=node\nodd\n\
     *Material, name=PA12\n*Conductivity\n0.25\n*Step\n*Heat transfer\n*End Step\n";

#[test]
fn all_that_is_understood() {
    let read = parsed(BRICK);
    let mesh = &read.mesh;
    assert!((read.quality.volume - 1.0).abs() < 1e-15);
    assert_eq!((read.node_labels, read.element_labels), ((1..=8).collect(), vec![10]));
    assert_eq!(mesh.node_sets["All"], (0..8).collect::<Vec<_>>());
    assert_eq!(mesh.node_sets["of"], (0..8).collect::<Vec<_>>());
    assert_eq!(mesh.node_sets["low"], [0, 1, 2, 3, 4]);
    assert_eq!(mesh.node_sets["odd"], [0, 2, 4, 6]);
    assert_eq!(mesh.node_sets["dots"], [0, 2, 4, 6]);
    assert_eq!(mesh.node_sets["mixed"], [0, 1, 2, 3, 4, 7]);
    assert_eq!(mesh.element_sets["Bricks"], [0]);
    assert_eq!(mesh.element_sets["again"], [0]);
    assert_eq!(mesh.surfaces["top"], [Face { element: 0, side: 1 }]);
    assert_eq!(mesh.surfaces["skin"].len(), 6);
    assert_eq!(
        read.notes,
        ["keywords not used: *CONDUCTIVITY (1), *END STEP (1), *HEAT TRANSFER (1), *MATERIAL (1), *STEP (1)"]
    );
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    let with = |from: &str, to: &str| {
        assert!(BRICK.contains(from), "{from}");
        BRICK.replace(from, to)
    };
    refused("", &["no hexahedra or tetrahedra"]);
    refused(&with("dc3d8", "C3D20R"), &["a.inp:15: element type: found \"C3D20R\"; allowed: C3D8, DC3D8"]);
    for name in ["", "C3D", "C3D6", "C3D10", "C3D4-", "C3D8R5", "S8R"] {
        refused(&with("dc3d8", name), &["a.inp:15: element type"]);
    }
    refused(
        &with(" 5, 6, 7, 8\n", " 5, 6, 7\n"),
        &["a.inp:18: nodes of an element: found \"7\"; allowed: 8"],
    );
    refused(&with("4,\n 5", "4\n 5"), &["a.inp:17: nodes of an element: found \"4\""]);
    refused(&with(" 5, 6, 7, 8\n", " 5, 6, 7, 8, 9\n"), &["a.inp:18: nodes of an element"]);
    refused(&with(" 5, 6, 7, 8\n", " 5, 6, 7, 88\n"), &["a.inp:17: node of element 10: found \"88\""]);
    refused(&with("2, 1.0D0", "2, 1.0x"), &["a.inp:7: coordinate: found \"1.0x\"; allowed: a finite number"]);
    refused(&with("2, 1.0D0", "2, inf"), &["a.inp:7: coordinate"]);
    refused(&with("2, 1.0D0", "-2, 1"), &["a.inp:7: number of a node: found \"-2\""]);
    refused(&with("2, 1.0D0", "1, 1"), &["a.inp:7: number of a node: found \"1\"", "also on line 6"]);
    refused(&with("low, 8", "lower, 8"), &["node set: found \"lower\"", "node sets above: All, low, odd"]);
    refused(&with("low, 8", "low, 9"), &["member of a set of nodes: found \"9\""]);
    refused(&with("1, 4\n", "1, 4, 0\n"), &["a.inp:24: range: found \"1, 4, 0\""]);
    refused(&with("again, S2", "again, SPOS"), &["side: found \"SPOS\"; allowed: S1 … S6"]);
    refused(&with("*Assembly", "*Include, input=b.inp"), &["a.inp:20: keyword: found \"*INCLUDE\""]);
    refused(&with("*Assembly", "*Part"), &["a.inp:20: keyword: found \"*PART\"", "also on line 4"]);
    refused(&with("*End Instance", "1., 0., 0."), &["place of an instance"]);
    refused(&with("nset=mixed", "color=red"), &["name of a set", "*NSET, NSET=NAME"]);
    refused(&with("5, 6, 7, 8", "7, 6, 5, 8"), &["a.inp: hexahedron 10 at", "inverted"]);
    refused(&with("*Assembly", "*"), &["a.inp:20: keyword"]);
    let tetrahedron = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT,TYPE=C3D4,ELSET=E\n1,1,2,3,4\n";
    refused(
        &format!("{tetrahedron}*SURFACE,NAME=s\nE,S5\n"),
        &["a.inp:9: side of element 1: found \"S5\"", "S4"],
    );
    assert_eq!(
        parsed(tetrahedron).mesh,
        Mesh {
            points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            tetrahedra: vec![[0, 1, 2, 3]],
            element_sets: [("E".to_owned(), vec![0])].into(),
            ..Mesh::default()
        }
    );
}

#[test]
fn sets_cannot_multiply_beyond_the_file() {
    // each set twice the one before: 2⁶⁰ members without a bound
    let doubling: String = (0..60).map(|k| format!("*NSET,NSET=s{}\ns{k},s{k}\n", k + 1)).collect();
    refused(&format!("{BRICK}*NSET,NSET=s0\n1\n{doubling}"), &["members of sets"]);
}
