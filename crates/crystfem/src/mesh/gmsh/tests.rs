use super::*;
use crate::mesh::surface::{OuterSurface, area};

fn fixture(name: &str) -> (std::path::PathBuf, Vec<u8>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name);
    let bytes = std::fs::read(&path).unwrap();
    (path, bytes)
}

fn refused(text: &str, words: &[&str]) {
    let error = parse(Path::new("a.msh"), text.as_bytes(), 1.0).unwrap_err().to_string();
    assert!(words.iter().all(|word| error.contains(word)), "{error}");
}

/// Two stacked boxes of 3 × 1 × 1, meshed by Gmsh 4.15 and saved as 4.1, 4.0 and 2.2.
#[test]
fn meshes_written_by_gmsh() {
    for name in [
        "hexes_ascii.msh",
        "hexes_binary.msh",
        "tets_ascii.msh",
        "tets_binary.msh",
        "hexes_ascii_40.msh",
        "hexes_ascii_22.msh",
        "hexes_binary_22.msh",
    ] {
        let (path, _) = fixture(name);
        let read = read(&path, 1e-3).unwrap();
        let mesh = &read.mesh;
        assert!((read.quality.volume / 6e-9 - 1.0).abs() < 1e-12, "{name}");
        assert_eq!(mesh.hexahedra.len(), if name.starts_with('h') { 16 } else { 0 });
        let sets: Vec<&str> = mesh.element_sets.keys().map(String::as_str).collect();
        assert_eq!(sets, ["printed bar", "substrate"]);
        for element in &mesh.element_sets["printed bar"] {
            assert!(mesh.centre(*element)[2] > 1e-3);
        }
        for (surface, z) in [("bottom", 0.0), ("interface", 1e-3)] {
            let faces = &mesh.surfaces[surface];
            let total: f64 = faces.iter().map(|face| area(mesh, *face)).sum();
            assert!((total / 3e-6 - 1.0).abs() < 1e-12, "{name} {surface}");
            assert_eq!(mesh.node_sets[surface], mesh.nodes_of(faces));
            assert!(
                mesh.node_sets[surface].iter().all(|node| (mesh.points[*node as usize][2] - z).abs() < 1e-12)
            );
        }
        // the curve from the origin upwards
        assert_eq!(mesh.node_sets["edge"].len(), if name.starts_with('h') { 3 } else { 4 }, "{name}");
        assert_eq!(read.notes, Vec::<String>::new());
        let outer = OuterSurface::of_all(mesh).unwrap();
        let total: f64 = outer.faces().map(|face| area(mesh, face)).sum();
        assert!((total / 22e-6 - 1.0).abs() < 1e-12);
    }
}

#[test]
fn text_and_bytes_are_one_mesh() {
    for (text, binary) in [("hexes_ascii.msh", "hexes_binary.msh"), ("tets_ascii.msh", "tets_binary.msh")] {
        let [text, binary] = [text, binary].map(|name| read(&fixture(name).0, 1.0).unwrap());
        assert_eq!(text.element_labels, binary.element_labels);
        assert_eq!(text.mesh.element_sets, binary.mesh.element_sets);
        for (a, b) in text.mesh.points.iter().zip(&binary.mesh.points) {
            // 16 digits in text
            assert!((0..3).all(|d| (a[d] - b[d]).abs() < 1e-14));
        }
    }
}

/// A cube, written by meshio 5.3.
#[test]
fn a_mesh_written_by_meshio() {
    let read = read(&fixture("meshio_binary.msh").0, 1.0).unwrap();
    assert_eq!(read.mesh.hexahedra, [[0, 1, 2, 3, 4, 5, 6, 7]]);
    assert!((read.quality.volume - 1.0).abs() < 1e-15 && read.notes.is_empty());
}

/// [`TETRAHEDRON`] in binary: either byte order, sizes of 4 and of 8 bytes.
#[test]
fn bytes_in_either_order_and_width() {
    let text = parse(Path::new("a.msh"), TETRAHEDRON.as_bytes(), 1.0).unwrap();
    for (little, width) in [(true, 8), (true, 4), (false, 8), (false, 4)] {
        let ordered = |mut bytes: Vec<u8>| {
            if !little {
                bytes.reverse();
            }
            bytes
        };
        let int = |value: i32| ordered(value.to_le_bytes().to_vec());
        let size = |value: u64| ordered(value.to_le_bytes()[..width].to_vec());
        let double = |value: f64| ordered(value.to_le_bytes().to_vec());
        let sizes = |values: &[u64]| values.iter().flat_map(|value| size(*value)).collect::<Vec<_>>();
        let ints = |values: &[i32]| values.iter().flat_map(|value| int(*value)).collect::<Vec<_>>();
        let doubles = |values: &[f64]| values.iter().flat_map(|value| double(*value)).collect::<Vec<_>>();
        let header = format!("$MeshFormat\n4.1 1 {width}\n").into_bytes();
        let points = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1., 5., 5., 5.];
        let parts: [Vec<u8>; 19] = [
            header,
            int(1),
            b"\n$EndMeshFormat\n$Comments\nby $ hand\n$EndComments\n$Entities\n".to_vec(),
            sizes(&[0, 0, 0, 1]),
            int(7),
            doubles(&[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]),
            size(1),
            int(9),
            size(0),
            b"\n$EndEntities\n$Nodes\n".to_vec(),
            sizes(&[1, 5, 1, 5]),
            ints(&[3, 7, 0]),
            sizes(&[5, 1, 2, 3, 4, 5]),
            doubles(&points),
            b"\n$EndNodes\n$Elements\n".to_vec(),
            sizes(&[1, 1, 1, 1]),
            ints(&[3, 7, 4]),
            sizes(&[1, 11, 1, 2, 3, 4]),
            b"\n$EndElements\n".to_vec(),
        ];
        let read = parse(Path::new("a.msh"), &parts.concat(), 1.0).unwrap();
        assert_eq!(read, text, "{little} {width}");
    }
}

const TETRAHEDRON: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Comments\nby hand\n$EndComments\n\
     $Entities\n0 0 0 1\n7 0 0 0 1 1 1 1 9 0\n$EndEntities\n\
     $Nodes\n1 5 1 5\n3 7 0 5\n1\n2\n3\n4\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n5 5 5\n$EndNodes\n\
     $Elements\n1 1 1 1\n3 7 4 1\n11 1 2 3 4\n$EndElements\n";

#[test]
fn unused_input_is_noted() {
    let read = parse(Path::new("a.msh"), TETRAHEDRON.as_bytes(), 1.0).unwrap();
    assert_eq!(read.mesh.element_sets["physical-9"], [0]);
    assert_eq!((read.node_labels, read.element_labels), (vec![1, 2, 3, 4], vec![11]));
    assert_eq!(read.notes.len(), 2);
    assert!(read.notes[0].contains("1 × section $Comments: not used"));
    assert!(read.notes[1].contains("1 nodes that belong to no hexahedron"));
    // parametric nodes
    let parametric = TETRAHEDRON
        .replace("3 7 0 5", "1 7 1 5")
        .replace("0 0 0\n1 0 0\n0 1 0\n0 0 1\n5 5 5", "0 0 0 .1\n1 0 0 .2\n0 1 0 .3\n0 0 1 .4\n5 5 5 .5");
    let again = parse(Path::new("a.msh"), parametric.as_bytes(), 1.0).unwrap();
    assert_eq!(again.mesh.points, read.mesh.points);
}

#[test]
fn errors_name_the_line() {
    let with = |from: &str, to: &str| {
        assert!(TETRAHEDRON.contains(from));
        TETRAHEDRON.replace(from, to)
    };
    refused("", &["a.msh:1: first line", "$MeshFormat"]);
    refused(&with("4.1 0 8", "3.1 0 8"), &["a.msh:2:", "found \"3.1 0 8\"", "Mesh.MshFileVersion = 4.1"]);
    refused(
        &with("3 7 4 1\n11", "3 7 14 1\n11"),
        &["a.msh:27: type of elements: found \"14\"", "4, 11 (tetrahedra)", "pyramids are none"],
    );
    refused(&with("11 1 2 3 4", "11 1 2 3 9"), &["a.msh:28: node of element 11: found \"9\""]);
    refused(&with("0 1 0\n0 0", "0 x 0\n0 0"), &["a.msh:21: coordinate: found \"x\"; allowed: a number"]);
    refused(&with("0 1 0\n0 0", "0 nan 0\n0 0"), &["a.msh:21: coordinate", "finite"]);
    refused(&with("2\n3\n4\n5", "2\n3\n3\n5"), &["number of a node: found \"3\"", "also on line 16"]);
    refused(&with("1 5 1 5\n3 7 0 5", "1 5 1 5\n3 7 0 1000000000000"), &["a.msh:", "number of a node"]);
    refused(&with("1 5 1 5", "1000000000000 5 1 5"), &["dimension of an entity: found \"$EndNodes\""]);
    refused(&with("1 5 1 5", "1 6 1 5"), &["number of nodes: found \"5\"; allowed: 6, as announced"]);
    refused(&with("$EndElements\n", ""), &["$EndElements"]);
    refused(&with("$Comments\nby hand\n$EndComments", "$PartitionedEntities\n"), &["one partition"]);
    refused(&with("0 0 1\n5", "0 0 -1\n5"), &["a.msh: tetrahedron 11 at", "inverted"]);
    let (path, bytes) = fixture("hexes_binary.msh");
    let error = parse(&path, &bytes[..bytes.len() - 500], 1.0).unwrap_err().to_string();
    assert!(error.contains("hexes_binary.msh:") && error.contains("end of file"), "{error}");
    assert!(parse(&path, &bytes, 0.0).unwrap_err().to_string().contains("scale of the mesh: found 0"));
    assert!(
        read(Path::new("/no/such.msh"), 1.0).unwrap_err().to_string().contains("cannot read /no/such.msh")
    );
}

#[test]
fn groups_cannot_multiply_beyond_the_file() {
    // one entity in 3000 groups, its elements in 3000 blocks
    let groups: String = (0..3000).map(|tag| format!("{tag} ")).collect();
    let blocks: String = (0..3000).map(|label| format!("3 7 4 1\n{label} 1 2 3 4\n")).collect();
    let text = TETRAHEDRON
        .replace("1 9 0\n", &format!("3000 {groups}0\n"))
        .replace("1 1 1 1\n3 7 4 1\n11 1 2 3 4\n", &format!("3000 3000 0 2999\n{blocks}"));
    refused(&text, &["members of physical groups"]);
}

/// A quarter of a ring, radii 1 and 2, height 1, one element high, with curved second-order edges; written by
/// Gmsh 4.15 in both formats, which differ in node order.
#[test]
fn second_order_meshes_written_by_gmsh() {
    for (name, count) in [("second_hexes", 3), ("second_wedges", 6), ("second_tets", 18)] {
        let [msh, inp] = ["msh", "inp"]
            .map(|ending| crate::mesh::read(&fixture(&format!("{name}.{ending}")).0, 1.0).unwrap());
        let exact = 0.75 * std::f64::consts::PI;
        for read in [&msh, &inp] {
            let mesh = &read.mesh;
            assert_eq!((mesh.others.len(), mesh.element_sets["ring"].len()), (count, count), "{name}");
            // arcs of 30° as parabolas: 1e-4 of the area between arc and chord and its square
            assert!((read.quality.volume / exact - 1.0).abs() < 1e-3, "{name}: {}", read.quality.volume);
            for (surface, exact) in [("below", exact), ("outside", std::f64::consts::PI)] {
                let total: f64 = mesh.surfaces[surface].iter().map(|face| area(mesh, *face)).sum();
                assert!((total / exact - 1.0).abs() < 1e-3, "{name} {surface} {total}");
            }
            // mid-edge nodes lie near the middles
            for cell in &mesh.others {
                let nodes = cell.nodes();
                for (&[p, q], middle) in cell.shape.edges().iter().zip(&nodes[cell.shape.corners()..]) {
                    let ends = [mesh.point(nodes[p]), mesh.point(nodes[q])];
                    let away = (0.5 * (ends[0] + ends[1]) - mesh.point(*middle)).norm();
                    assert!(away < 0.1 * (ends[0] - ends[1]).norm(), "{name}");
                }
            }
        }
        assert!((msh.quality.volume / inp.quality.volume - 1.0).abs() < 1e-12);
        // the same nodes at the same positions in each element
        for (a, b) in msh.mesh.others.iter().zip(&inp.mesh.others) {
            for (a, b) in a.nodes().iter().zip(b.nodes()) {
                assert!((msh.mesh.point(*a) - inp.mesh.point(*b)).norm() < 1e-12, "{name}");
            }
        }
        // written and read back
        let mut text = Vec::new();
        crate::mesh::abaqus::write(&msh.mesh, true, &mut text).unwrap();
        let again = crate::mesh::abaqus::parse(Path::new("again.inp"), &text, 1.0).unwrap();
        assert_eq!(again.mesh.others, msh.mesh.others);
        assert_eq!(again.mesh.surfaces, msh.mesh.surfaces);
    }
}

/// Hexahedra of complete second order, in the two boxes, keep 20 of their 27 nodes.
#[test]
fn complete_second_order_is_reduced() {
    let read = read(&fixture("hexes27.msh").0, 1e-3).unwrap();
    assert!(read.mesh.others.len() == 16 && read.mesh.is_second_order());
    assert!((read.quality.volume / 6e-9 - 1.0).abs() < 1e-12);
    assert!(read.notes[0].contains("16 elements of complete second order"), "{:?}", read.notes);
    // faces of their surfaces are found by the kept nodes
    let total: f64 = read.mesh.surfaces["bottom"].iter().map(|face| area(&read.mesh, *face)).sum();
    assert!((total / 3e-6 - 1.0).abs() < 1e-12);
}

/// A tetrahedron in all versions, by hand: parametric nodes, several groups, no groups, comments, negative
/// tags.
#[test]
fn versions_by_hand() {
    let points = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"];
    let names = "$PhysicalNames\n2\n3 1 \"a\"\n3 2 \"b c\"\n$EndPhysicalNames\n";
    let numbered =
        |more: &str| -> String { (1..).zip(points).map(|(k, at)| format!("{k} {at}{more}\n")).collect() };
    let two = |elements: &str| {
        let head = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
        format!("{head}{names}$Nodes\n4\n{}$EndNodes\n$Elements\n{elements}$EndElements\n", numbered(""))
    };
    let four = |head: &str, physical: &str, parametric: &str, more: &str| {
        let box_of = "0 0 0 1 1 1";
        format!(
            "{head}$MeshFormat\n4 0 8\n$EndMeshFormat\n{names}$Entities\n0 0 0 1\n7 {box_of} {physical} 0\n\
             $EndEntities\n$Nodes\n1 4\n7 3 {parametric} 4\n{}$EndNodes\n$Elements\n1 1\n7 3 4 1\n\
             1 1 2 3 4\n$EndElements\n",
            numbered(more)
        )
    };
    for (name, text, sets) in [
        ("2.2", two("1\n1 4 2 1 7 1 2 3 4\n"), &["a"][..]),
        ("2.2 without tags", two("1\n1 4 0 1 2 3 4\n"), &[]),
        ("2.2, no group", two("1\n1 4 2 0 7 1 2 3 4\n"), &[]),
        ("2.2, partitions", two("1\n1 4 4 2 7 1 1 1 2 3 4\n"), &["b c"]),
        ("2.2, two groups", two("2\n1 4 2 1 7 1 2 3 4\n2 4 2 2 7 1 2 3 4\n"), &["a", "b c"]),
        ("2.2, a group without a name", two("1\n1 4 2 9 7 1 2 3 4\n"), &["physical-9"]),
        ("2.2, carriage returns", two("1\n1 4 2 1 7 1 2 3 4\n").replace('\n', "\r\n"), &["a"]),
        ("4.0", four("", "1 2", "0", ""), &["b c"]),
        ("4.0, two groups, turned", four("", "2 -1 2", "0", ""), &["a", "b c"]),
        (
            "4.0, parametric, comments",
            four("$Comments\nby hand\n$EndComments\n", "0", "1", " 0.1 0.2 0.3"),
            &[],
        ),
    ] {
        let read =
            parse(Path::new("a.msh"), text.as_bytes(), 1.0).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!((read.quality.volume - 1.0 / 6.0).abs() < 1e-15 && read.mesh.tetrahedra.len() == 1, "{name}");
        let found: Vec<&str> = read.mesh.element_sets.keys().map(String::as_str).collect();
        assert_eq!(found, sets, "{name}");
    }
    refused("$NOD\n4\n", &["this is format 1"]);
    refused("$MeshFormat\n3 0 8\n$EndMeshFormat\n", &["2.2, 4, 4.0 or 4.1"]);
    refused(&two("2\n1 4 2 1 7 1 2 3 4\n"), &["a.msh:"]);
    refused(&two("1\n1 7 2 1 7 1 2 3 4 4\n"), &["pyramids are none"]);
}
