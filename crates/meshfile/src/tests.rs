//! Meshes in result files of VTK and Exodus II, written by VTK and netCDF (`tests/fixtures/make.py`).

use crate::content::{FileElement, MeshFile};
use crate::{exodus, read, vtu};
use std::path::{Path, PathBuf};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

fn point(mesh: &MeshFile, element: &FileElement, node: usize) -> [f64; 3] {
    mesh.nodes[mesh.nodes_of(element)[node] as usize].point
}

/// Nodes of second order are in the middles of the edges of their corners, and the first face is
/// anticlockwise seen from the other nodes.
#[test]
fn nodes_of_all_kinds() {
    for (name, elements, set) in [("kinds.vtu", 9, "MaterialIds-4"), ("kinds.e", 6, "block-10")] {
        let mesh = read(&fixture(name), |_| None).unwrap();
        assert_eq!(mesh.elements.len(), elements, "{name}");
        assert_eq!(mesh.element_sets[set], [3], "{name}");
        for element in &mesh.elements {
            let shape = element.kind.solid().unwrap();
            for (edge, &[a, b]) in shape.edges().iter().enumerate().filter(|_| shape.is_second_order()) {
                let middle = point(&mesh, element, shape.corners() + edge);
                let [a, b] = [a, b].map(|corner| point(&mesh, element, corner));
                for d in 0..3 {
                    assert!((middle[d] - 0.5 * (a[d] + b[d])).abs() < 1e-12, "{name} {shape:?} {edge}");
                }
            }
            let last = shape.corners() - 1;
            let [o, a, b, c] = [0, 1, 2, last].map(|corner| point(&mesh, element, corner));
            let [a, b, c] = [a, b, c].map(|p| [0, 1, 2].map(|d| p[d] - o[d]));
            let normal = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
            assert!((0..3).map(|d| normal[d] * c[d]).sum::<f64>() > 0.5, "{name} {shape:?}");
        }
    }
}

/// Sides of side sets have the corners that VTK's reader finds (`sides.csv`: element, side, nodes).
#[test]
fn sides_are_those_of_vtk() {
    let mesh = exodus::read(&fixture("sides.e")).unwrap();
    let names: Vec<&str> = mesh.element_sets.keys().map(String::as_str).collect();
    assert_eq!(names, ["block-8", "cube", "wedge"]);
    assert_eq!(mesh.node_sets["nodeset-4"], [0, 8]);
    let table = std::fs::read_to_string(fixture("sides.csv")).unwrap();
    assert_eq!(mesh.surfaces.len(), table.lines().count());
    for (row, line) in table.lines().enumerate() {
        let numbers: Vec<u32> = line.split(',').map(|word| word.parse().unwrap()).collect();
        let [face] = mesh.surfaces[&format!("sideset-{}", row + 1)][..] else { panic!("{line}") };
        assert_eq!(face.element, numbers[0] - 1);
        let element = &mesh.elements[face.element as usize];
        let local = element.kind.solid().unwrap().side(face.side);
        let mut nodes: Vec<u32> = local.iter().map(|&k| mesh.nodes_of(element)[k]).collect();
        nodes.sort_unstable();
        assert_eq!(nodes, numbers[2..], "{line}");
    }
}

fn piece(places: &str, nodes: &str, ends: &str, kinds: &str, more: &str) -> String {
    let array = |name: &str, kind: &str, text: &str| {
        format!("<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">{text}</DataArray>")
    };
    format!(
        "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece><Points>{}</Points><Cells>{}{}{}</Cells>\
         {more}</Piece></UnstructuredGrid></VTKFile>",
        array("Points", "Float64", places),
        array("connectivity", "Int32", nodes),
        array("offsets", "Int32", ends),
        array("types", "UInt8", kinds)
    )
}

/// Two squares in two pieces share the nodes of their common edge; a ghost is left out.
#[test]
fn pieces_are_one_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: String| std::fs::write(folder.path().join(name), text).unwrap();
    let left = "0 0 0 1 0 0 0 1 0 1 1 0 2 0 0 2 1 0";
    let ghost = "<CellData><DataArray type=\"UInt8\" Name=\"vtkGhostType\" format=\"ascii\">0 1\
                 </DataArray><DataArray type=\"Int32\" Name=\"part\" format=\"ascii\">-1 7</DataArray>\
                 </CellData>";
    write("a.vtu", piece(left, "0 1 3 2 1 4 5 3", "4 8", "9 9", ghost));
    let right = "1 -0 0 2 0 0 1 1 0 2 1 0";
    let whole = "<CellData><DataArray type=\"UInt8\" Name=\"vtkGhostType\" format=\"ascii\">0\
                 </DataArray><DataArray type=\"Int32\" Name=\"part\" format=\"ascii\">7</DataArray>\
                 </CellData>";
    write("b.vtu", piece(right, "0 1 3 2", "4", "9", whole));
    let parts = "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid><Piece Source=\"a.vtu\"/>\
                 <Piece Source=\"b.vtu\"/></PUnstructuredGrid></VTKFile>";
    write("all.pvtu", parts.into());
    let mesh = vtu::read(&folder.path().join("all.pvtu")).unwrap();
    assert_eq!((mesh.nodes.len(), mesh.elements.len(), mesh.included.len()), (6, 2, 2));
    assert_eq!(mesh.element_nodes, [0, 1, 3, 2, 1, 4, 5, 3]);
    let sets: Vec<(&str, &[u32])> =
        mesh.element_sets.iter().map(|(name, places)| (name.as_str(), places.as_slice())).collect();
    assert_eq!(sets, [("part--1", &[0][..]), ("part-7", &[1][..])]);

    // flags of the second piece are not those of the first
    write("b.vtu", piece(right, "0 1 3 2", "4", "9", ""));
    write("all.pvtu", parts.replace("a.vtu", "c.vtu").replace("b.vtu", "a.vtu").replace("c.vtu", "b.vtu"));
    let mesh = vtu::read(&folder.path().join("all.pvtu")).unwrap();
    assert_eq!((mesh.nodes.len(), mesh.elements.len()), (6, 2));
    assert!(mesh.notes[0].contains("array `part` has 2 values for 3 cells"), "{:?}", mesh.notes);
}

#[test]
fn other_content_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let points = "0 0 0 1 0 0 1 1 0 0 1 0 0 0 1";
    for (name, text, says) in [
        ("pyramid.vtu", piece(points, "0 1 2 3 4", "5", "14", ""), "cell 0 of VTK's type 14 with 5 nodes"),
        ("beyond.vtu", piece(points, "0 1 2 5", "4", "10", ""), "allowed: nodes 0 to 4"),
        ("short.vtu", piece(points, "0 1 2 0 1 2", "3 6", "5", ""), "1 values of `types`; allowed: 2"),
        ("long.vtu", piece(points, "0 1 2 3", "3", "5", ""), "4 values of `connectivity`; allowed: 3"),
        ("nan.vtu", piece(&points.replace("0 0 1", "0 0 nan"), "0 1 3 4", "4", "10", ""), "finite positions"),
        ("old.vtk", "# vtk DataFile Version 3.0".into(), "save it as .vtu"),
        ("text.e", "CDF?".into(), "allowed: netCDF"),
        ("mesh.stl", String::new(), "allowed: `.msh`"),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let error = read(&path, |_| None).unwrap_err().to_string();
        assert!(error.contains(says) && error.contains(name), "{name}: {error}");
    }
}

/// A file truncated anywhere, or with a byte changed, gives an error or another mesh whose nodes exist.
#[test]
fn damaged_files() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["kinds.vtu", "sides.e"] {
        let good = std::fs::read(fixture(name)).unwrap();
        let path = folder.path().join(name);
        let mut refused = 0;
        for place in (0..good.len()).step_by(1 + good.len() / 200) {
            let mut changed = [good.clone(), good.clone()];
            changed[0][place] ^= 0xff;
            changed[1][place] ^= 0x04;
            for bytes in [&good[..place], &changed[0], &changed[1]] {
                std::fs::write(&path, bytes).unwrap();
                match read(&path, |_| None) {
                    Ok(mesh) => {
                        let nodes = mesh.nodes.len() as u32;
                        assert!(mesh.element_nodes.iter().all(|&node| node < nodes));
                        let places = mesh.surfaces.values().flatten().map(|face| face.element);
                        assert!(places.into_iter().all(|place| (place as usize) < mesh.elements.len()));
                    }
                    Err(_) => refused += 1,
                }
            }
        }
        assert!(refused > 150, "{name}: {refused}");
    }
}
