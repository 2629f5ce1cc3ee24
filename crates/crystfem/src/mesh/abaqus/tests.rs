use super::*;
use crate::mesh::Face;
use crate::mesh::surface::area;
use crate::mesh::{Bar, Block, CellSplit, Grid, Mesh, Substrate};

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

/// Two stacked boxes of 3 × 1 × 1, written by Gmsh 4.15, with groups of surfaces as plane elements.
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
fn written_meshes_are_read_back() {
    let bar = Bar {
        size: [0.02, 0.004],
        layers: 2,
        layer_height: 2e-4,
        elements_per_layer: 1,
        element_size: 2e-3,
        substrate: Some(Substrate { size: [0.03, 0.01], thickness: 1e-3, growth: 1.7 }),
        cells: CellSplit::Hexahedra,
    };
    let block = Block { name: "brick".into(), lower: [0.0; 3], upper: [1.0; 3] };
    let grid = Grid::uniform([0.0; 3], [1.0; 3], [3, 2, 2]).unwrap();
    let mut both = Grid::uniform([0.0; 3], [1.0; 3], [1, 1, 1]).unwrap().mesh("brick").unwrap();
    both.points.push([5.0 / 3.0, 0.5, 0.5]);
    both.tetrahedra.extend([[1, 3, 5, 8], [3, 7, 5, 8]]);
    for mesh in [bar.mesh().unwrap(), grid.blocks(&[block], CellSplit::FiveTetrahedra).unwrap(), both] {
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

const BRICK: &str = "*Heading\nby hand\n** a comment\n*Part, name=P\n*Node, nset=All\n1, 0., 0., 0.\n\
    2, 1.0D0\n3, 1., 1.\n4, 0, 1\n5, 0,0,1\n6, 1,0,1\n7, 1,1,1\n8, 0,1,1\n\n\
    *ELEMENT, TYPE=dc3d8,\n ELSET=Bricks\n10, 1, 2, 3, 4,\n 5, 6, 7, 8\n*End Part\n*Assembly\n\
    *Instance, name=I, part=P\n*End Instance\n*Nset, nset=low, generate\n1, 4\n*nset, NSET=LOW\n5,\n\
    *Nset, nset=odd, generate\n1, 100000000000, 2\n*Nset, nset=mixed\nlow, 8\n*Nset, nset=of, elset=bricks\n\
    *Elset, elset=again, instance=I\nBRICKS, 10\n*Surface, type=ELEMENT, name=top\nI.again, S2\n\
    *Surface, name=skin\n10,\n*Surface, name=dots, type=node\nodd\n*Material, name=PA12\n*Conductivity\n\
    0.25\n*Step\n*Heat transfer\n*End Step\n";

#[test]
fn supported_keywords_are_read() {
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
        [
            "*CONDUCTIVITY (line 41, `0.25`) is NOT used: the deck has no units; give `conductivity` of \
             [materials.NAME]",
            "*HEAT TRANSFER (line 44) is NOT used: the deck has no units; give [time]",
            "*MATERIAL (line 40, `PA12`) is NOT used: the deck has no units; give [materials.NAME]",
            "keywords not used: *END STEP (1), *STEP (1)",
        ]
    );
}

#[test]
fn errors_name_the_line() {
    let with = |from: &str, to: &str| {
        assert!(BRICK.contains(from), "{from}");
        BRICK.replace(from, to)
    };
    refused("", &["no hexahedra, tetrahedra or wedges"]);
    refused(&with("dc3d8", "C3D27R"), &["a.inp:15: element type: found \"C3D27R\"; allowed: C3D8, C3D4"]);
    refused(&with("dc3d8", "C3D20R"), &["nodes of an element: found \"8\"; allowed: 20 for C3D20R"]);
    for name in ["", "C3D", "C3D5", "C3D27", "C3D4-", "C3D8R5", "S9R"] {
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
    refused(
        &with("*Assembly", "*Include, input=b.inp"),
        &["a.inp:20: file that is included: found \"b.inp\""],
    );
    refused(&with("*Assembly", "*Include"), &["a.inp:20: file that is included", "INPUT=FILE"]);
    refused(&with("*Assembly", "*Part"), &["a.inp:20: keyword: found \"*PART, after that of line 4"]);
    refused(&with("*End Instance", "1., 0., 0., 4."), &["place of an instance", "x, y, z"]);
    refused(
        &with("*End Instance", "1., 0., 0.\n1,1,1,1,1,1,90"),
        &["a.inp:23: place", "two different points"],
    );
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
    // each set doubles the one before: 2⁶⁰ members without a bound
    let doubling: String = (0..60).map(|k| format!("*NSET,NSET=s{}\ns{k},s{k}\n", k + 1)).collect();
    refused(&format!("{BRICK}*NSET,NSET=s0\n1\n{doubling}"), &["members of sets"]);
}

/// Elements of all types, one each, in the order of nodes and sides of the Abaqus manual (28.1.4,
/// three-dimensional solids), with mid-edge nodes in that order: a wrong one would fold the element.
#[test]
fn elements_of_all_types() {
    let places: [[f64; 3]; 8] = [
        [0., 0., 0.],
        [2., 0., 0.],
        [2., 2., 0.],
        [0., 2., 0.],
        [0., 0., 2.],
        [2., 0., 2.],
        [2., 2., 2.],
        [0., 2., 2.],
    ];
    // of 20 nodes: 9 between 1 and 2, 10: 2-3, 11: 3-4, 12: 4-1, 13: 5-6, …, 17: 1-5, …, 20: 4-8
    let hexahedron = "12 23 34 41 56 67 78 85 15 26 37 48";
    let wedge = "12 23 31 45 56 64 14 25 36";
    let tetrahedron = "12 23 31 14 24 34";
    // sides of the manual: 1-2-3-4 of a hexahedron is S1, 3-6-4-1 of a wedge S5, 1-2-3 of a tetrahedron S1
    let cases = [
        ("DC3D20", vec![0, 1, 2, 3, 4, 5, 6, 7], hexahedron, 8.0, [("S1", 4.0, 2, 0.0), ("S4", 4.0, 0, 2.0)]),
        ("C3D20R", vec![0, 1, 2, 3, 4, 5, 6, 7], hexahedron, 8.0, [("S3", 4.0, 1, 0.0), ("S2", 4.0, 2, 2.0)]),
        ("DC3D6", vec![0, 1, 3, 4, 5, 7], "", 4.0, [("S3", 4.0, 1, 0.0), ("S5", 4.0, 0, 0.0)]),
        ("C3D15", vec![0, 1, 3, 4, 5, 7], wedge, 4.0, [("S2", 2.0, 2, 2.0), ("S5", 4.0, 0, 0.0)]),
        ("C3D10", vec![0, 1, 3, 4], tetrahedron, 4.0 / 3.0, [("S1", 2.0, 2, 0.0), ("S4", 2.0, 0, 0.0)]),
        ("DC3D10", vec![0, 1, 3, 4], tetrahedron, 4.0 / 3.0, [("S2", 2.0, 1, 0.0), ("S1", 2.0, 2, 0.0)]),
    ];
    for (kind, corners, edges, volume, sides) in cases {
        let mut points: Vec<[f64; 3]> = corners.iter().map(|&k| places[k]).collect();
        for edge in edges.split_whitespace() {
            let [p, q] = [0, 1].map(|k| edge.as_bytes()[k] as usize - usize::from(b'1'));
            points.push([0, 1, 2].map(|d| 0.5 * (points[p][d] + points[q][d])));
        }
        let mut text = "*NODE\n".to_owned();
        for (number, [x, y, z]) in (1..).zip(&points) {
            text += &format!("{number}, {x}, {y}, {z}\n");
        }
        text += &format!("*ELEMENT, TYPE={kind}, ELSET=ALL\n7");
        for number in 1..=points.len() {
            // sixteen numbers to a line
            text += if number % 16 == 0 { ",\n" } else { ", " };
            text += &number.to_string();
        }
        text += "\n";
        for (side, ..) in sides {
            text += &format!("*SURFACE, NAME={side}\nALL, {side}\n");
        }
        text += "*SURFACE, NAME=skin\nALL,\n";
        let read = parsed(&text);
        assert!((read.quality.volume - volume).abs() < 1e-13, "{kind}");
        assert_eq!(read.mesh.others[0].nodes(), (0..points.len() as u32).collect::<Vec<_>>());
        for (side, exact, axis, at) in sides {
            let faces = &read.mesh.surfaces[side];
            assert!((area(&read.mesh, faces[0]) - exact).abs() < 1e-13, "{kind} {side}");
            let nodes = read.mesh.face_nodes(faces[0]);
            assert!(nodes.iter().all(|node| read.mesh.points[*node as usize][axis] == at), "{kind} {side}");
        }
        assert_eq!(read.mesh.surfaces["skin"].len(), usize::from(read.mesh.side_count(0)));
        // two nodes of an edge exchanged: folded, and reported
        if !edges.is_empty() {
            let folded =
                text.replace("*ELEMENT", "*NODE\n900, -9., 0., 0.\n*ELEMENT").replace("\n7, 1,", "\n7, 900,");
            let error = parse(Path::new("a.inp"), folded.as_bytes(), 1.0).unwrap_err().to_string();
            assert!(error.contains("inverted or without volume"), "{error}");
        }
    }
}

#[test]
fn orders_do_not_mix() {
    let nodes: String = (1..=16).map(|n| format!("{n},{},{},{}\n", n % 3, n % 5, n % 7)).collect();
    let text = format!("*NODE\n{nodes}*ELEMENT,TYPE=C3D7\n1,1,2,3,4\n");
    refused(&text, &["element type: found \"C3D7\"", "C3D20"]);
    let mut mesh = Grid::uniform([0.0; 3], [2.0, 1.0, 1.0], [2, 1, 1]).unwrap().mesh("all").unwrap();
    let second = mesh.clone().second_order();
    let cell = second.others[1];
    mesh.points = second.points;
    mesh.hexahedra.pop();
    mesh.others.push(cell);
    let error = crate::mesh::quality::check(&mesh, None).unwrap_err().to_string();
    assert!(error.contains("elements 0 and 1 have the corners of one face and different nodes"), "{error}");
}

/// Lists keywords with an equivalent one by one, with their count and first values.
#[test]
fn unused_keywords_name_their_scene_keys() {
    let more = "*Tie, name=glue\na, b\n*Dflux\nBricks, BF, 1.\n*DFLUX, amplitude=RAMP\nagain, BF, 2.\n\
        *initial conditions, type=temperature\nAll, 20.\n*Node File\nNT\n*NODE FILE\nNT\n";
    let notes = parsed(&format!("{BRICK}{more}")).notes;
    for told in [
        "*TIE (line 46, `glue`) is NOT used: heat passes only between elements that share nodes",
        "*DFLUX (line 48, `Bricks, BF, 1.`, 2 times) is NOT used: the deck has no units; give `flux` of \
         [[boundary]], or `power`",
        "*INITIAL CONDITIONS (line 52, `All, 20.`) is NOT used: the deck has no units; give `temperature` \
         of [[region]]",
        "keywords not used: *END STEP (1), *NODE FILE (2), *STEP (1)",
    ] {
        assert!(notes.iter().any(|note| note.starts_with(told)), "{told}: {notes:#?}");
    }
}

/// An instance is translated, then rotated about a line.
#[test]
fn instances_are_placed() {
    let with = |lines: &str| BRICK.replace("*End Instance", &format!("{lines}\n*End Instance"));
    for (lines, lower, upper) in [
        ("0., 0., 0.", [0.0; 3], [1.0; 3]),
        ("10., 0., -2.", [10.0, 0.0, -2.0], [11.0, 1.0, -1.0]),
        ("10.\n0,0,0, 0,0,1, 90.", [-1.0, 10.0, 0.0], [0.0, 11.0, 1.0]),
        ("0,0,0\n5., 0., 0., 5., 3., 0., 180.", [9.0, 0.0, -1.0], [10.0, 1.0, 0.0]),
    ] {
        let found = parsed(&with(lines)).mesh.bounds().unwrap();
        for (found, exact) in found.iter().flatten().zip([lower, upper].iter().flatten()) {
            assert!((found - exact).abs() < 1e-14, "{lines}: {found} {exact}");
        }
    }
}

/// Includes work for nested files, with data lines alone or keywords, and errors point to their lines.
#[test]
fn files_are_included() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let write = |name: &str, text: &str| std::fs::write(at(name), text).unwrap();
    std::fs::create_dir(at("sub")).unwrap();
    write("nodes.txt", "1,0,0,0\n** a comment\n2,1,0,0\n3,0,1,0\n");
    write("sub/elements.inp", "*ELEMENT, TYPE=C3D4, ELSET=E\n*INCLUDE, INPUT=rows.inp\n");
    write("sub/rows.inp", "1,1,2,3,4\n");
    write("bad.txt", "1,0,0,0\n\n2,1,x,0\n");
    write("again.inp", "*INCLUDE, INPUT=again.inp\n");
    let deck = "*NODE, NSET=N\n*INCLUDE, INPUT=nodes.txt\n4,0,0,1\n*Include,\n input=sub\\elements.inp\n\
        *NSET, NSET=low\n1,2,3\n";
    let read_from = |text: &str| {
        write("deck.inp", text);
        read(&at("deck.inp"), 1.0)
    };
    let mesh = read_from(deck).unwrap();
    assert!((mesh.quality.volume - 1.0 / 6.0).abs() < 1e-15);
    assert_eq!((mesh.mesh.node_sets["N"].len(), mesh.mesh.node_sets["low"].len()), (4, 3));
    assert_eq!(mesh.notes, ["3 files are included"]);
    for (from, to, says) in [
        ("nodes.txt", "bad.txt", "bad.txt:3: coordinate: found \"x\""),
        ("nodes.txt", "none.txt", "deck.inp:2: file that is included: found \"none.txt\""),
        ("nodes.txt", "again.inp", "again.inp:1: files in each other"),
        ("4,0,0,1", "4,0,y,1", "deck.inp:3: coordinate: found \"y\""),
        ("1,2,3\n", "1,2,9\n", "deck.inp:7: member of a set of nodes: found \"9\""),
    ] {
        let error = read_from(&deck.replace(from, to)).unwrap_err().to_string();
        assert!(error.contains(says), "{to}: {error}");
    }
}
